#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "rayrep/mesh/mesh.h"

namespace rayrep {

/// One number for the edge between two vertices, whichever comes first: the lower one in its upper half.
inline std::uint64_t edge_key(int a, int b) {
  return (static_cast<std::uint64_t>(std::min(a, b)) << 32) | static_cast<std::uint32_t>(std::max(a, b));
}

/// The corners of triangles at each vertex: those at vertex v are corners[first[v]] to corners[first[v + 1] - 1], ascending. Corner
/// k of triangle t is 3 t + k.
struct VertexCorners {
  std::vector<int> first;
  std::vector<int> corners;

  explicit VertexCorners(const Mesh& mesh);
};

/// One side of a triangle, at the undirected edge from vertex `low` to `high`.
struct EdgeUse {
  int low, high;
  int triangle;
  int direction;  ///< +1: from low to high
};

/// How much more often the uses of an edge run from `low` to `high` than back: 0 where a surface is closed.
template <typename Use>
int edge_balance(Use begin, Use end) {
  int balance = 0;
  for (; begin != end; ++begin) balance += begin->direction;
  return balance;
}

/// Calls visit(begin, end) with the uses of each edge from a vertex `low` to a higher one, the edges by their higher vertex, the
/// uses of each by their triangle. Sides from a vertex to itself are no edges.
/// @param uses  memory, to be used again
template <typename Visit>
void for_each_edge_from(const Mesh& mesh, const VertexCorners& at, int low, std::vector<EdgeUse>& uses, const Visit& visit) {
  uses.clear();
  for (int n = at.first[low]; n < at.first[low + 1]; ++n) {
    const int t = at.corners[n] / 3;
    const int k = at.corners[n] % 3;
    const Eigen::Vector3i& v = mesh.triangles[t];
    if (v[(k + 1) % 3] > low) uses.push_back({low, v[(k + 1) % 3], t, 1});
    if (v[(k + 2) % 3] > low) uses.push_back({low, v[(k + 2) % 3], t, -1});
  }
  std::sort(uses.begin(), uses.end(), [](const EdgeUse& a, const EdgeUse& b) {
    if (a.high != b.high) return a.high < b.high;
    if (a.triangle != b.triangle) return a.triangle < b.triangle;
    return a.direction < b.direction;
  });
  for (auto begin = uses.begin(); begin != uses.end();) {
    auto end = begin;
    while (end != uses.end() && end->high == begin->high) ++end;
    visit(begin, end);
    begin = end;
  }
}

/// The same for all edges, by their lower vertex.
template <typename Visit>
void for_each_edge(const Mesh& mesh, const Visit& visit) {
  const VertexCorners at(mesh);
  std::vector<EdgeUse> uses;
  for (int low = 0; low < static_cast<int>(mesh.vertices.size()); ++low) for_each_edge_from(mesh, at, low, uses, visit);
}

}  // namespace rayrep
