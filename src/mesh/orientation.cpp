#include "mesh/orientation.h"

#include <algorithm>
#include <array>
#include <utility>

#include "base/union_find.h"
#include "mesh/mesh_edges.h"

namespace rayrep {

Orientation orient_neighbours(Mesh& mesh) {
  const int n = static_cast<int>(mesh.triangles.size());
  struct Neighbour {
    int triangle;
    bool agrees;
  };
  std::vector<std::array<Neighbour, 3>> neighbours(n, {Neighbour{-1, true}, Neighbour{-1, true}, Neighbour{-1, true}});
  std::vector<int> degree(n, 0);
  for_each_edge(mesh, [&](auto begin, auto end) {
    if (end - begin != 2) return;
    const int a = begin->triangle, b = (begin + 1)->triangle;
    const bool agrees = begin->direction != (begin + 1)->direction;
    neighbours[a][degree[a]++] = {b, agrees};
    neighbours[b][degree[b]++] = {a, agrees};
  });

  Orientation result;
  result.turned.assign(n, false);
  std::vector<int>& patch = result.patch;
  patch.assign(n, -1);
  std::vector<bool> against(n, false);  // the first triangle of its patch
  std::vector<int> members;
  int& patches = result.patches;
  for (int first = 0; first < n; ++first) {
    if (patch[first] >= 0) continue;
    members.assign(1, first);
    patch[first] = patches;
    std::size_t turned = 0;
    bool one_sided = false;
    for (std::size_t m = 0; m < members.size(); ++m) {
      const int t = members[m];
      turned += against[t];
      for (int k = 0; k < degree[t]; ++k) {
        const auto [other, agrees] = neighbours[t][k];
        const bool turn = against[t] == agrees;
        if (patch[other] < 0) {
          patch[other] = patches;
          against[other] = turn;
          members.push_back(other);
        } else if (against[other] != turn && !one_sided) {
          one_sided = true;
          if (result.one_sided.count++ == 0) {
            const auto o = static_cast<std::size_t>(other);
            result.one_sided.first_mm = (mesh.corner(o, 0) + mesh.corner(o, 1) + mesh.corner(o, 2)) / 3;
          }
        }
      }
    }
    ++patches;
    if (one_sided || turned == 0) continue;
    const bool turn_value = 2 * turned <= members.size();
    for (const int t : members)
      if (against[t] == turn_value) {
        std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
        result.turned[t] = true;
      }
  }

  UnionFind joined(patches);
  std::vector<std::pair<int, int>> net;  // patch, its balance over one edge
  for_each_edge(mesh, [&](auto begin, auto end) {
    if (end - begin <= 2) return;
    net.clear();
    for (auto use = begin; use != end; ++use) net.emplace_back(patch[use->triangle], use->direction);
    std::sort(net.begin(), net.end());
    int previous = -1;
    for (std::size_t i = 0; i < net.size();) {
      const int p = net[i].first;
      int sum = 0;
      for (; i < net.size() && net[i].first == p; ++i) sum += net[i].second;
      if (sum == 0) continue;
      if (previous >= 0) joined.unite(previous, p);
      previous = p;
    }
  });
  std::vector<int> number(patches, -1);
  result.of_triangle.reserve(n);
  for (int t = 0; t < n; ++t) {
    int& shell = number[joined.root(patch[t])];
    if (shell < 0) shell = result.count++;
    result.of_triangle.push_back(shell);
  }
  return result;
}

}  // namespace rayrep
