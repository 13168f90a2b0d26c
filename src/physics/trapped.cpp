#include "physics/trapped.h"

#include <algorithm>
#include <array>
#include <limits>
#include <map>

#include "base/union_find.h"
#include "physics/pockets.h"

namespace rayrep {
namespace {

/// Adds what a triangle of the boundary contributes to the moments of what it bounds, by the divergence of (x, y, 0) f / (k + 2),
/// f a monomial with k factors x and y. Exact: the rule is right for cubics.
void add_side(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c, Moments& s) {
  static constexpr std::array<double, 10> kDegree = {0, 1, 1, 0, 2, 2, 0, 2, 1, 1};
  struct Node {
    double a, b, c, weight;
  };
  static constexpr std::array<Node, 4> kRule = {
      {{1. / 3, 1. / 3, 1. / 3, -27. / 48}, {0.6, 0.2, 0.2, 25. / 48}, {0.2, 0.6, 0.2, 25. / 48}, {0.2, 0.2, 0.6, 25. / 48}}};
  const Eigen::Vector3d area = 0.5 * (b - a).cross(c - a);
  for (const Node& node : kRule) {
    const Eigen::Vector3d p = node.a * a + node.b * b + node.c * c;
    const double flux = node.weight * (area.x() * p.x() + area.y() * p.y());
    const Moments f = monomials(p);
    for (int n = 0; n < 10; ++n) s[n] += flux * f[n] / (kDegree[static_cast<std::size_t>(n)] + 2);
  }
}

/// The same of the part of a triangle below a height.
void add_side_below(const std::array<Eigen::Vector3d, 3>& corners, double height, Moments& s) {
  std::array<Eigen::Vector3d, 4> kept;
  std::size_t count = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const Eigen::Vector3d& p = corners[k];
    const Eigen::Vector3d& q = corners[(k + 1) % 3];
    if (p.z() <= height) kept[count++] = p;
    if ((p.z() <= height) == (q.z() <= height)) continue;
    const Eigen::Vector3d& low = p.z() <= height ? p : q;  // both triangles of an edge get the same bits
    const Eigen::Vector3d& high = p.z() <= height ? q : p;
    kept[count++] = low + (height - low.z()) / (high.z() - low.z()) * (high - low);
  }
  for (std::size_t k = 2; k < count; ++k) add_side(kept[0], kept[k - 1], kept[k], s);
}

}  // namespace

std::vector<Pool> pools_in(const Mesh& given, const Eigen::Vector3d& up) {
  const Mesh body = with_merged_vertices(given);
  const Frame frame = frame_of(up.normalized());
  const Eigen::Vector3d centre = bounding_box(body).center();
  Eigen::Affine3d upright = Eigen::Affine3d::Identity();  // to the frame, from the centre
  upright.linear() << frame.u.transpose(), frame.v.transpose(), frame.n.transpose();
  upright.translation() = -(upright.linear() * centre);
  std::vector<Eigen::Vector3d> points;
  std::vector<double> heights;
  for (const auto& v : body.vertices) {
    points.emplace_back(upright * v);
    heights.push_back(points.back().z());
  }
  const HullSurface surface(body.vertices, body.triangles);
  const FloodHeights floods = surface.flood_heights(frame, heights, {});
  std::vector<Pool> pools;
  if (floods.empty()) return pools;

  // A triangle bounds a pool below the height at which what is beside its lowest corner runs over. Those of one pool hang together
  // over corners below that.
  const auto holds = [&](std::size_t t) {
    const Eigen::Vector3i& v = body.triangles[t];
    return floods.of_triangle[t] > std::min({heights[v[0]], heights[v[1]], heights[v[2]]});
  };
  UnionFind joined(static_cast<int>(body.vertices.size()));
  const auto corner_in_pool = [&](std::size_t t) {
    const Eigen::Vector3i& v = body.triangles[t];
    int lowest = v[0];
    for (const int k : v)
      if (heights[k] < heights[lowest]) lowest = k;
    return lowest;
  };
  for (std::size_t t = 0; t < body.triangles.size(); ++t)
    if (holds(t))
      for (const int v : body.triangles[t])
        if (heights[v] < floods.of_triangle[t]) joined.unite(corner_in_pool(t), v);
  std::map<std::pair<int, double>, std::size_t> numbers;
  for (std::size_t t = 0; t < body.triangles.size(); ++t) {
    if (!holds(t)) continue;
    const Eigen::Vector3i& v = body.triangles[t];
    const int lowest = corner_in_pool(t);
    const auto [at, is_new] = numbers.try_emplace({joined.root(lowest), floods.of_triangle[t]}, pools.size());
    if (is_new) pools.push_back({.s = Moments::Zero(), .lowest_mm = body.vertices[lowest], .surface_mm = floods.of_triangle[t]});
    Pool& pool = pools[at->second];
    if (frame.n.dot(body.vertices[lowest] - pool.lowest_mm) < 0) pool.lowest_mm = body.vertices[lowest];
    // Its normal points into the liquid.
    add_side_below({points[v[0]], points[v[2]], points[v[1]]}, floods.of_triangle[t], pool.s);
  }
  const Eigen::Affine3d back(upright.inverse());
  for (Pool& pool : pools) {
    pool.s = moment_map(back) * pool.s;
    pool.surface_mm += frame.n.dot(centre);
  }
  return pools;
}

Moments total(const std::vector<Pool>& pools) {
  Moments s = Moments::Zero();
  for (const Pool& pool : pools) s += pool.s;
  return s;
}

}  // namespace rayrep
