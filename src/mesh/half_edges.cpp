#include "mesh/half_edges.h"

#include <tbb/parallel_for.h>

#include <algorithm>

namespace rayrep {

HalfEdges::HalfEdges(const Mesh& mesh, const VertexCorners& at)
    : from_(3 * mesh.triangles.size()),
      twin_(from_.size(), -1),
      out_(mesh.vertices.size(), -1),
      regular_(out_.size(), 0),
      seen_(out_.size(), 0) {
  std::vector<int> ends(from_.size());  // of the half-edges in the order of at.corners
  tbb::parallel_for(std::size_t{0}, from_.size(), [&](std::size_t h) {
    from_[h] = mesh.triangles[h / 3][static_cast<int>(h % 3)];
    ends[h] = mesh.triangles[static_cast<std::size_t>(at.corners[h] / 3)][(at.corners[h] + 1) % 3];
  });
  const auto only = [&](int a, int b) {
    int found = -1;
    for (int n = at.first[a]; n < at.first[a + 1]; ++n)
      if (ends[n] == b) found = found == -1 ? at.corners[n] : -2;
    return found;
  };
  tbb::parallel_for(std::size_t{0}, from_.size(), [&](std::size_t h) {
    const int a = from_[h];
    const int b = to(static_cast<int>(h));
    if (a != b && only(a, b) >= 0) twin_[h] = std::max(only(b, a), -1);
  });
  tbb::parallel_for(std::size_t{0}, out_.size(), [&](std::size_t v) {
    const int count = at.first[v + 1] - at.first[v];
    if (count == 0) return;
    out_[v] = at.corners[at.first[v]];
    int h = out_[v];
    int gone_round = 0;
    do {
      h = twin_[last(h)];
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
    h = twin_[last(h)];
  } while (h != out_[vertex]);
}

bool HalfEdges::can_collapse(const std::vector<int>& half_edges, std::size_t n) {
  const int h = half_edges[n];
  if (!regular(from(h)) || !regular(to(h))) return false;
  const auto opposite = [this](int side) { return from_[last(twin_[side])]; };
  for (const int side : {h, twin_[h]})
    if (opposite(next(side)) == opposite(last(side))) return false;
  ++calls_;
  around(to(h), around_end_);
  for (const int g : around_end_) seen_[to(g)] = calls_;
  int common = 0;
  for (const int g : half_edges) common += seen_[to(g)] == calls_;
  return common == 2;
}

/// Removes the triangle of half-edge h, of no width now: the triangles along its other two sides become neighbours.
void HalfEdges::remove(int h) {
  const int a = twin_[next(h)];
  const int b = twin_[last(h)];
  twin_[a] = b;
  twin_[b] = a;
  out_[from_[a]] = a;
  out_[from_[b]] = b;
  for (const int side : {h, next(h), last(h)}) from_[side] = -1;
}

void HalfEdges::collapse(const std::vector<int>& half_edges, std::size_t n) {
  const int h = half_edges[n];
  const int gone = from(h);
  const int stays = to(h);
  const int back = twin_[h];
  for (const int side : half_edges) from_[side] = stays;
  remove(h);
  remove(back);
  out_[gone] = -1;
}

std::vector<int> HalfEdges::remaining_triangles() const {
  std::vector<int> triangles;
  for (int h = 0; h < size(); h += 3)
    if (from_[h] >= 0) triangles.push_back(h / 3);
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
    mesh.triangles.emplace_back(number[from_[3 * t]], number[from_[3 * t + 1]], number[from_[3 * t + 2]]);
  return mesh;
}

}  // namespace rayrep
