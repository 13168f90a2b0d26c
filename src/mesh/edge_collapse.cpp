#include "mesh/edge_collapse.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>

namespace rayrep {
namespace {

using Eigen::Vector3d;

constexpr double kNoArea2 = 1e-20;  ///< a triangle so slender, squared, faces nowhere

/// Square of a triangle's smallest height over its longest side; at most 3/4.
double squared_slenderness(const Vector3d& side, const Vector3d& other_side, const Vector3d& normal) {
  const double longest2 = std::max({side.squaredNorm(), other_side.squaredNorm(), (other_side - side).squaredNorm()});
  return longest2 > 0 ? normal.squaredNorm() / (longest2 * longest2) : 0;
}

}  // namespace

void EdgeCollapse::look_at(int vertex) {
  vertex_ = vertex;
  surface_.around(vertex, half_edges_);
  const std::size_t count = half_edges_.size();
  neighbours_.resize(count);
  spokes_.resize(count);
  normals_.resize(count);
  for (std::size_t n = 0; n < count; ++n) {
    neighbours_[n] = surface_.to(half_edges_[n]);
    spokes_[n] = vertices_[neighbours_[n]] - vertices_[vertex];
  }
  for (std::size_t n = 0; n < count; ++n) normals_[n] = spokes_[n].cross(spokes_[after(n)]);
}

bool EdgeCollapse::prepare(std::size_t n) {
  prepared_ = n;
  facets_.clear();
  facet_numbers_.clear();
  facet_ends_.clear();
  const Vector3d& corner = vertices_[neighbours_[n]];
  double least = std::numeric_limits<double>::infinity();
  double least_before = least;
  const double least_cos2 = limits_.least_cos_of_turn * limits_.least_cos_of_turn;
  const Vector3d facing = std::accumulate(normals_.begin(), normals_.end(), Vector3d(Vector3d::Zero()));
  for (std::size_t a = after(n); after(a) != n; a = after(a)) {
    const std::size_t b = after(a);
    const double slenderness_before = squared_slenderness(spokes_[a], spokes_[b], normals_[a]);
    const Facet now(corner, vertices_[neighbours_[a]], vertices_[neighbours_[b]]);
    const Vector3d& was_facing = slenderness_before > kNoArea2 ? normals_[a] : facing;
    const double turned = now.normal.dot(was_facing);
    if (!(turned > 0 && turned * turned > least_cos2 * now.normal.squaredNorm() * was_facing.squaredNorm())) return false;
    least = std::min(least, squared_slenderness(now.side, now.other_side, now.normal));
    least_before = std::min(least_before, slenderness_before);
    facets_.push_back(now);
    facet_numbers_.push_back(half_edges_[a] / 3);
    facet_ends_.push_back(neighbours_[b]);
  }
  return least > std::min(limits_.least_slenderness * limits_.least_slenderness, least_before) &&
         surface_.can_collapse(half_edges_, neighbours_, n);
}

std::vector<int> collapse_short_edges(Mesh& mesh, double length_mm, const std::vector<char>& fixed) {
  HalfEdges surface(mesh, VertexCorners(mesh));
  EdgeCollapse edges(surface, mesh.vertices);
  const auto shorten = [&](int v) {
    edges.look_at(v);
    std::vector<std::pair<double, std::size_t>> shorter;
    for (std::size_t n = 0; n < edges.spokes().size(); ++n)
      if (const double length2 = edges.spokes()[n].squaredNorm(); length2 < length_mm * length_mm) shorter.emplace_back(length2, n);
    std::sort(shorter.begin(), shorter.end());
    for (const auto& [length2, n] : shorter) {
      if (!edges.prepare(n)) continue;
      edges.collapse();
      return true;
    }
    return false;
  };
  for (bool changed = true; changed;) {
    changed = false;
    for (int v = 0; v < surface.vertices(); ++v)
      if (surface.regular(v) && !surface.removed(v) && (fixed.empty() || !fixed[v])) changed = shorten(v) || changed;
  }
  std::vector<int> kept;
  mesh = surface.remaining(mesh.vertices, kept);
  return kept;
}

}  // namespace rayrep
