#include "mesh/shells.h"

#include <algorithm>
#include <cmath>

namespace rayrep {

std::vector<double> shell_volumes(const Mesh& mesh, const std::vector<int>& of_triangle, int count) {
  std::vector<double> volumes(static_cast<std::size_t>(count), 0);
  std::vector<int> first(static_cast<std::size_t>(count), -1);  // triangle, whose corner is the shell's origin
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const int shell = of_triangle[t];
    if (shell < 0) continue;
    if (first[shell] < 0) first[shell] = static_cast<int>(t);
    const Eigen::Vector3d& origin = mesh.corner(static_cast<std::size_t>(first[shell]), 0);
    volumes[shell] += (mesh.corner(t, 0) - origin).dot((mesh.corner(t, 1) - origin).cross(mesh.corner(t, 2) - origin)) / 6;
  }
  return volumes;
}

ShellNesting::ShellNesting(const Mesh& mesh, const std::vector<int>& of_triangle)
    : mesh_(mesh),
      of_triangle_(of_triangle),
      touching_mm_(mesh.vertices.empty() ? 0 : 1e-9 * bounding_box(mesh).diagonal().norm()) {}

void ShellNesting::around(const Eigen::Vector3d& p, int self, Surroundings& result) {
  result = {};
  if (!surface_ && few_-- > 0) {
    line_hits_brute_force(mesh_, p.head<2>(), hits_);
    result.line_closes = line_closes(hits_);
  } else {
    if (!surface_) surface_.emplace(mesh_);
    result.line_closes = closed_line_hits(*surface_, p.head<2>(), hits_);
  }
  below_.clear();
  for (const LineHit& hit : hits_) {
    const int other = of_triangle_[hit.triangle];
    if (other == self) continue;
    if (std::abs(hit.z_mm - p.z()) <= touching_mm_) result.touched.push_back(other);
    if (hit.z_mm < p.z()) below_.push_back({other, hit.sign});
  }
  std::sort(below_.begin(), below_.end(), [](const auto& a, const auto& b) { return a.shell < b.shell; });
  for (std::size_t i = 0; i < below_.size();) {
    Surroundings::Around around{below_[i].shell, 0};
    for (; i < below_.size() && below_[i].shell == around.shell; ++i) around.winding += below_[i].winding;
    if (around.winding != 0) result.shells.push_back(around);
    result.winding += around.winding;
  }
}

}  // namespace rayrep
