#include "mesh/crossing.h"

#include <tbb/parallel_for.h>

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

}  // namespace rayrep
