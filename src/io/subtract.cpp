#include "io/subtract.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

#include "io/mesh_io_detail.h"
#include "mesh/mesh_edges.h"
#include "rayrep/mesh/mesh_check.h"

namespace rayrep::detail {
namespace {

using Eigen::Vector3d;

/// What the cuts of boundary_of_union are off by is far below this, what makers can tell apart is far above; of the diagonal.
constexpr double kSame = 1e-9;

/// Along a direction that no CAD model has its faces in, few vertices share a place.
const Vector3d kAlong = Vector3d(0.5377, 0.6271, 0.5634).normalized();

double volume(const Mesh& mesh, const Vector3d& centre) {
  double six = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    six += (mesh.corner(t, 0) - centre).dot((mesh.corner(t, 1) - centre).cross(mesh.corner(t, 2) - centre));
  return six / 6;
}

/// Vertices in the order of their places along kAlong.
struct Sorted {
  std::vector<int> order;
  std::vector<double> place;  ///< by vertex
};

Sorted sorted(const std::vector<Vector3d>& vertices) {
  Sorted result;
  result.place.reserve(vertices.size());
  for (const auto& v : vertices) result.place.push_back(kAlong.dot(v));
  result.order.resize(vertices.size());
  std::iota(result.order.begin(), result.order.end(), 0);
  std::stable_sort(result.order.begin(), result.order.end(), [&](int a, int b) { return result.place[a] < result.place[b]; });
  return result;
}

/// Vertices within the tolerance of an earlier one become that one; triangles that lose a corner by it go.
Mesh welded(const Mesh& mesh, double tolerance) {
  const Sorted by_place = sorted(mesh.vertices);
  std::vector<int> same(mesh.vertices.size());
  for (std::size_t i = 0; i < same.size(); ++i) {
    const int v = by_place.order[i];
    same[v] = v;
    for (std::size_t j = i; j-- > 0;) {
      const int w = by_place.order[j];
      if (by_place.place[v] - by_place.place[w] > tolerance) break;
      if (same[w] != w || (mesh.vertices[v] - mesh.vertices[w]).norm() > tolerance) continue;
      same[v] = w;
      break;
    }
  }
  Mesh result;
  std::vector<int> number(mesh.vertices.size(), -1);
  for (const auto& t : mesh.triangles) {
    Eigen::Vector3i corners(same[t[0]], same[t[1]], same[t[2]]);
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) continue;
    for (int& corner : corners) {
      if (number[corner] < 0) {
        number[corner] = static_cast<int>(result.vertices.size());
        result.vertices.push_back(mesh.vertices[corner]);
      }
      corner = number[corner];
    }
    result.triangles.push_back(corners);
  }
  return result;
}

using Edge = std::pair<int, int>;  // the lower vertex first

/// Edges that are not run equally often both ways, sorted.
std::vector<Edge> unbalanced_edges(const Mesh& mesh) {
  std::vector<Edge> result;
  for_each_edge(mesh, [&](auto begin, auto end) {
    int net = 0;
    for (auto use = begin; use != end; ++use) net += use->direction;
    if (net != 0) result.emplace_back(begin->low, begin->high);
  });
  std::sort(result.begin(), result.end());
  return result;
}

/// Vertices of unbalanced edges that lie on an edge, from its first vertex to its second.
class OnEdges {
public:
  OnEdges(const Mesh& mesh, const std::vector<Edge>& edges, double tolerance) : mesh_(mesh), tolerance_(tolerance) {
    std::vector<int> ends;
    for (const auto& [a, b] : edges) ends.insert(ends.end(), {a, b});
    std::sort(ends.begin(), ends.end());
    ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
    for (const int v : ends) candidates_.emplace_back(kAlong.dot(mesh.vertices[v]), v);
    std::sort(candidates_.begin(), candidates_.end());
  }

  std::vector<int> on(int from, int to) const {
    const Vector3d& a = mesh_.vertices[from];
    const Vector3d d = mesh_.vertices[to] - a;
    const double length = d.norm();
    const auto [low, high] = std::minmax({kAlong.dot(a), kAlong.dot(mesh_.vertices[to])});
    std::vector<std::pair<double, int>> found;
    for (auto c = std::lower_bound(candidates_.begin(), candidates_.end(), std::pair{low - tolerance_, -1});
         c != candidates_.end() && c->first <= high + tolerance_; ++c) {
      if (c->second == from || c->second == to) continue;
      const Vector3d p = mesh_.vertices[c->second] - a;
      const double along = p.dot(d) / length;
      if (along > 0 && along < length && (p - along / length * d).norm() <= tolerance_) found.emplace_back(along, c->second);
    }
    std::sort(found.begin(), found.end());
    std::vector<int> result;
    for (const auto& [along, vertex] : found) result.push_back(vertex);
    return result;
  }

private:
  const Mesh& mesh_;
  double tolerance_;
  std::vector<std::pair<double, int>> candidates_;
};

/// Splits triangles at the vertices of others that lie on their sides.
Mesh without_t_junctions(const Mesh& mesh, double tolerance) {
  const std::vector<Edge> edges = unbalanced_edges(mesh);
  if (edges.empty()) return mesh;
  const OnEdges vertices(mesh, edges, tolerance);
  Mesh result;
  result.vertices = mesh.vertices;
  std::vector<int> polygon;
  for (const auto& t : mesh.triangles) {
    polygon.clear();
    for (int k = 0; k < 3; ++k) {
      const int a = t[k];
      const int b = t[(k + 1) % 3];
      polygon.push_back(a);
      if (!std::binary_search(edges.begin(), edges.end(), Edge(std::minmax({a, b})))) continue;
      std::vector<int> between = vertices.on(std::min(a, b), std::max(a, b));
      if (a > b) std::reverse(between.begin(), between.end());
      polygon.insert(polygon.end(), between.begin(), between.end());
    }
    append_triangulated(polygon, result);
  }
  return result;
}

}  // namespace

std::optional<Mesh> without(const Mesh& material, std::size_t parts, const Mesh& negative) {
  const CheckOptions quick{.self_intersections = false};
  const CheckedMesh body = check_mesh(material, quick);
  CheckedMesh hole = check_mesh(negative, quick);
  if (!body.report.usable || !hole.report.usable) return std::nullopt;
  flip(hole.mesh);
  Mesh both = body.mesh;
  for (std::size_t i = 0; i < std::max<std::size_t>(parts, 1); ++i) append(both, hole.mesh);
  const Mesh pieces = boundary_of_union(both);
  if (pieces.triangles.empty()) return std::nullopt;
  const Eigen::AlignedBox3d box = bounding_box(both);
  const double tolerance = kSame * box.diagonal().norm();
  Mesh result = without_t_junctions(welded(pieces, tolerance), tolerance);
  if (result.triangles.empty() || !unbalanced_edges(result).empty()) return std::nullopt;
  const double expected = volume(pieces, box.center());
  // The tolerance times the surface is what welding may move; the box bounds both.
  if (!(std::abs(volume(result, box.center()) - expected) <= 1e-7 * box.volume()) || !(expected > 0)) return std::nullopt;
  return result;
}

}  // namespace rayrep::detail
