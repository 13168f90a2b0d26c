#include "mesh/crossing.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "mesh/predicates.h"

namespace rayrep {

TrianglePairs crossing_pairs(const Mesh& mesh, TrianglePairs pairs) {
  std::vector<char> crosses(pairs.size());
  tbb::parallel_for(std::size_t{0}, pairs.size(), [&](std::size_t n) {
    const auto s = static_cast<std::size_t>(pairs[n].first);
    const auto t = static_cast<std::size_t>(pairs[n].second);
    const Eigen::Vector3d p[3] = {mesh.corner(s, 0), mesh.corner(s, 1), mesh.corner(s, 2)};
    const Eigen::Vector3d q[3] = {mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2)};
    if (collinear(p[0], p[1], p[2]) || collinear(q[0], q[1], q[2])) return;
    const Eigen::Vector3i& v = mesh.triangles[t];
    const bool same = std::all_of(v.begin(), v.end(), [&](int corner) { return (mesh.triangles[s].array() == corner).any(); });
    crosses[n] = same || triangles_intersect(p, mesh.triangles[s], q, v);
  });
  std::size_t kept = 0;
  for (std::size_t n = 0; n < pairs.size(); ++n)
    if (crosses[n]) pairs[kept++] = pairs[n];
  pairs.resize(kept);
  return pairs;
}

std::vector<std::size_t> triangles_of(const TrianglePairs& pairs) {
  std::vector<std::size_t> triangles;
  for (const auto& [s, t] : pairs) {
    triangles.push_back(static_cast<std::size_t>(s));
    triangles.push_back(static_cast<std::size_t>(t));
  }
  std::sort(triangles.begin(), triangles.end());
  triangles.erase(std::unique(triangles.begin(), triangles.end()), triangles.end());
  return triangles;
}

std::vector<std::size_t> crossing_near(Mesh mesh, const std::vector<char>& marked) {
  const auto box_of = [&mesh](std::size_t t) {
    Eigen::AlignedBox3d box;
    for (int k = 0; k < 3; ++k) box.extend(mesh.corner(t, k));
    return box;
  };
  const auto is_marked = [&marked](int v) { return marked[v] != 0; };
  Eigen::AlignedBox3d box;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (std::any_of(mesh.triangles[t].begin(), mesh.triangles[t].end(), is_marked)) box.extend(box_of(t));
  std::vector<std::size_t> number;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (!box.intersects(box_of(t))) continue;
    mesh.triangles[number.size()] = mesh.triangles[t];
    number.push_back(t);
  }
  mesh.triangles.resize(number.size());
  std::vector<std::size_t> crosses = triangles_of(crossing_pairs(mesh, close_pairs(mesh)));
  for (std::size_t& t : crosses) t = number[t];
  return crosses;
}

}  // namespace rayrep
