#include "mesh/rims.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <numeric>

#include "base/union_find.h"
#include "mesh/mesh_edges.h"
#include "mesh/order.h"
#include "mesh/point_tree.h"

namespace rayrep {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

/// found[n] = what is near the n-th of `count` segments; in parallel, with a look at the progress now and then. Nothing where that
/// is so much that the tolerance must be too large: as when all of a mesh is small beside a stray far away.
template <typename Find>
std::vector<std::vector<int>> found_near(std::size_t count, const Progress& progress, const Find& find) {
  constexpr std::size_t kBatch = 256;
  const std::size_t most = 100 * count + 20'000'000;
  std::vector<std::vector<int>> found(count);
  std::size_t sum = 0;
  for (std::size_t begin = 0; begin < count; begin += kBatch) {
    progress.check();
    const std::size_t end = std::min(begin + kBatch, count);
    tbb::parallel_for(begin, end, [&](std::size_t n) { find(n, found[n]); });
    for (std::size_t n = begin; n < end; ++n) sum += found[n].size();
    if (sum > most) return {};
  }
  return found;
}

/// A triangle that is to be split at vertices on its sides: those of side k lie from corner k to the next one.
struct Split {
  Vector3i corners;
  std::array<std::vector<int>, 3> on;
};

/// Halves the triangle at the middle one of the vertices on its fullest side, and so on: no part of it is flat unless it was.
void split(const Split& whole, std::vector<Vector3i>& triangles) {
  std::vector<Split> stack{whole};
  while (!stack.empty()) {
    const Split part = std::move(stack.back());
    stack.pop_back();
    std::size_t k = 0;
    for (std::size_t other = 1; other < 3; ++other)
      if (part.on[other].size() > part.on[k].size()) k = other;
    const std::vector<int>& side = part.on[k];
    if (side.empty()) {
      triangles.push_back(part.corners);
      continue;
    }
    const auto i = static_cast<int>(k);
    const int a = part.corners[i];
    const int b = part.corners[(i + 1) % 3];
    const int c = part.corners[(i + 2) % 3];
    const auto middle = side.begin() + static_cast<std::ptrdiff_t>(side.size() / 2);
    stack.push_back({{*middle, b, c}, {std::vector<int>(middle + 1, side.end()), part.on[(k + 1) % 3], {}}});
    stack.push_back({{a, *middle, c}, {std::vector<int>(side.begin(), middle), {}, part.on[(k + 2) % 3]}});
  }
}

}  // namespace

Rims rims_of(const Mesh& mesh) {
  Rims rims;
  for_each_edge(mesh, [&](auto begin, auto end) {
    const int balance = edge_balance(begin, end);
    if (balance == 0) return;
    const bool upward = balance < 0;
    rims.edges.push_back({upward ? begin->low : begin->high, upward ? begin->high : begin->low, std::abs(balance)});
    rims.vertices.insert(rims.vertices.end(), {begin->low, begin->high});
    rims.length += (mesh.vertices[begin->high] - mesh.vertices[begin->low]).norm();
  });
  std::sort(rims.vertices.begin(), rims.vertices.end());
  rims.vertices.erase(std::unique(rims.vertices.begin(), rims.vertices.end()), rims.vertices.end());
  return rims;
}

Stepped with_welded_rims(const Mesh& mesh, const Rims& rims, double tolerance, const Progress& progress) {
  const PointTree tree(mesh.vertices, rims.vertices);
  const auto near = found_near(rims.vertices.size(), progress, [&](std::size_t n, std::vector<int>& found) {
    const Vector3d& p = mesh.vertices[rims.vertices[n]];
    tree.near_segment(p, p, tolerance, found);
  });
  progress.check();
  // Ranks by coordinates, so that the least of a set is the one to stay.
  std::vector<int> by_place = rims.vertices;
  std::sort(by_place.begin(), by_place.end(), [&](int a, int b) { return comes_first(mesh.vertices[a], mesh.vertices[b]); });
  std::vector<int> rank(mesh.vertices.size(), -1);
  for (std::size_t n = 0; n < by_place.size(); ++n) rank[by_place[n]] = static_cast<int>(n);
  UnionFind joined(static_cast<int>(by_place.size()));
  for (std::size_t n = 0; n < near.size(); ++n)
    for (const int other : near[n]) joined.unite(rank[rims.vertices[n]], rank[other]);

  std::vector<int> same(mesh.vertices.size());
  std::iota(same.begin(), same.end(), 0);
  Stepped result;
  for (const int v : by_place) {
    const int first = by_place[joined.root(rank[v])];
    if (first == v || (mesh.vertices[v] - mesh.vertices[first]).norm() > 3 * tolerance) continue;
    same[v] = first;
    ++result.count;
  }
  result.mesh.vertices = mesh.vertices;
  for (const Vector3i& t : mesh.triangles) {
    const Vector3i corners(same[t[0]], same[t[1]], same[t[2]]);
    if (corners[0] != corners[1] && corners[1] != corners[2] && corners[2] != corners[0]) result.mesh.triangles.push_back(corners);
  }
  return result;
}

Stepped with_split_rims(const Mesh& mesh, const Rims& rims, double tolerance, const Progress& progress) {
  const PointTree tree(mesh.vertices, rims.vertices);
  const auto near = found_near(rims.edges.size(), progress, [&](std::size_t n, std::vector<int>& found) {
    const Vector3d& a = mesh.vertices[rims.edges[n].from];
    const Vector3d& b = mesh.vertices[rims.edges[n].to];
    const double length = (b - a).norm();
    tree.near_segment(a, b, tolerance, found);
    const auto along = [&](int v) { return on_segment(mesh.vertices[v], a, b).along; };
    std::erase_if(found, [&](int v) { return along(v) <= tolerance || along(v) >= length - tolerance; });
    std::sort(found.begin(), found.end(), [&](int v, int w) {
      const double at_v = along(v);
      const double at_w = along(w);
      return at_v != at_w ? at_v < at_w : comes_first(mesh.vertices[v], mesh.vertices[w]);
    });
  });

  std::vector<std::pair<std::pair<int, int>, std::size_t>> rim_of;  // ascending: an edge from its lower vertex on
  for (std::size_t n = 0; n < near.size(); ++n)
    if (!near[n].empty()) rim_of.push_back({std::minmax({rims.edges[n].from, rims.edges[n].to}), n});
  std::sort(rim_of.begin(), rim_of.end());
  Stepped result;
  result.mesh.vertices = mesh.vertices;
  for (const Vector3i& t : mesh.triangles) {
    // From the corner of the smallest coordinates on, so that the order in which they come does not matter.
    int first = 0;
    for (int k = 1; k < 3; ++k)
      if (comes_first(mesh.vertices[t[k]], mesh.vertices[t[first]])) first = k;
    const Vector3i corners(t[first], t[(first + 1) % 3], t[(first + 2) % 3]);
    Split whole{corners, {}};
    for (int k = 0; k < 3; ++k) {
      const std::pair<int, int> edge = std::minmax({corners[k], corners[(k + 1) % 3]});
      const auto found = std::lower_bound(rim_of.begin(), rim_of.end(), std::pair{edge, std::size_t{0}});
      if (found == rim_of.end() || found->first != edge) continue;
      std::vector<int>& side = whole.on[static_cast<std::size_t>(k)];
      side = near[found->second];
      std::erase(side, corners[(k + 2) % 3]);
      if (rims.edges[found->second].from != corners[k]) std::reverse(side.begin(), side.end());
      result.count += !side.empty();
    }
    if (whole.on[0].empty() && whole.on[1].empty() && whole.on[2].empty())
      result.mesh.triangles.push_back(t);
    else
      split(whole, result.mesh.triangles);
  }
  return result;
}

}  // namespace rayrep
