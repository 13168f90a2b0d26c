#include "mesh/half_edges.h"

#include <tbb/parallel_for.h>

#include <algorithm>

namespace rayrep {

HalfEdges::HalfEdges(const Mesh& mesh, const VertexCorners& at)
    : sides_(3 * mesh.triangles.size()), out_(mesh.vertices.size(), -1), regular_(out_.size(), 0) {
  std::vector<int> ends(sides_.size());  // of the half-edges in the order of at.corners
  tbb::parallel_for(std::size_t{0}, sides_.size(), [&](std::size_t h) {
    sides_[h].from = mesh.triangles[h / 3][static_cast<int>(h % 3)];
    ends[h] = mesh.triangles[static_cast<std::size_t>(at.corners[h] / 3)][(at.corners[h] + 1) % 3];
  });
  const auto only = [&](int a, int b) {
    int found = -1;
    for (int n = at.first[a]; n < at.first[a + 1]; ++n)
      if (ends[n] == b) found = found == -1 ? at.corners[n] : -2;
    return found;
  };
  tbb::parallel_for(std::size_t{0}, sides_.size(), [&](std::size_t h) {
    const int a = sides_[h].from;
    const int b = to(static_cast<int>(h));
    if (a >= b || only(a, b) < 0) return;
    const int back = only(b, a);
    if (back < 0) return;
    sides_[h].twin = back;
    sides_[back].twin = static_cast<int>(h);
  });
  tbb::parallel_for(std::size_t{0}, out_.size(), [&](std::size_t v) {
    const int count = at.first[v + 1] - at.first[v];
    if (count == 0) return;
    out_[v] = at.corners[at.first[v]];
    int h = out_[v];
    int gone_round = 0;
    do {
      h = sides_[last(h)].twin;
      ++gone_round;
    } while (h >= 0 && h != out_[v] && gone_round < count);
    regular_[v] = h == out_[v] && gone_round == count && count >= 3;
  });
}

void HalfEdges::around(int vertex, std::vector<int>& half_edges) const {
  half_edges.clear();
  int h = out_[vertex];
  do {
    half_edges.push_back(h);
    h = sides_[last(h)].twin;
  } while (h != out_[vertex]);
}

bool HalfEdges::can_collapse(const std::vector<int>& half_edges, const std::vector<int>& ends, std::size_t n) const {
  const int h = half_edges[n];
  if (!regular(from(h)) || !regular(to(h))) return false;
  const auto opposite = [this](int side) { return sides_[last(sides_[side].twin)].from; };
  for (const int side : {h, sides_[h].twin})
    if (opposite(next(side)) == opposite(last(side))) return false;
  int common = 0;
  int at_end = next(h);
  do {
    const int neighbour = to(at_end);
    for (const int end : ends) common += end == neighbour;
    at_end = twin(last(at_end));
  } while (at_end != next(h) && common <= 2);
  return common == 2;
}

/// Removes the triangle of half-edge h, of no width now: the triangles along its other two sides become neighbours.
void HalfEdges::remove(int h) {
  const int a = sides_[next(h)].twin;
  const int b = sides_[last(h)].twin;
  sides_[a].twin = b;
  sides_[b].twin = a;
  out_[sides_[a].from] = a;
  out_[sides_[b].from] = b;
  for (const int side : {h, next(h), last(h)}) sides_[side].from = -1;
}

void HalfEdges::collapse(const std::vector<int>& half_edges, std::size_t n) {
  const int h = half_edges[n];
  const int gone = from(h);
  const int stays = to(h);
  const int back = sides_[h].twin;
  for (const int side : half_edges) sides_[side].from = stays;
  remove(h);
  remove(back);
  out_[gone] = -1;
}

std::vector<int> HalfEdges::remaining_triangles() const {
  std::vector<int> triangles;
  for (int h = 0; h < size(); h += 3)
    if (sides_[h].from >= 0) triangles.push_back(h / 3);
  return triangles;
}

Mesh HalfEdges::remaining(const std::vector<Eigen::Vector3d>& vertices, std::vector<int>& kept) const {
  Mesh mesh;
  kept.clear();
  std::vector<int> number(vertices.size(), -1);
  for (int v = 0; v < static_cast<int>(vertices.size()); ++v) {
    if (removed(v)) continue;
    number[v] = static_cast<int>(kept.size());
    kept.push_back(v);
    mesh.vertices.push_back(vertices[v]);
  }
  for (const int t : remaining_triangles())
    mesh.triangles.emplace_back(number[sides_[3 * t].from], number[sides_[3 * t + 1].from], number[sides_[3 * t + 2].from]);
  return mesh;
}

}  // namespace rayrep
