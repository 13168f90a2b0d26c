#include "shape/measure.h"

#include <algorithm>
#include <cmath>

#include "base/rotation.h"

namespace rayrep::detail {

Change change_between(const Mesh& before, const Mesh& after) {
  Change change;
  double area = 0;
  double squares = 0;
  double angles = 0;
  for (std::size_t t = 0; t < before.triangles.size(); ++t) {
    const Eigen::Vector3d one = (before.corner(t, 1) - before.corner(t, 0)).cross(before.corner(t, 2) - before.corner(t, 0));
    const Eigen::Vector3d other = (after.corner(t, 1) - after.corner(t, 0)).cross(after.corner(t, 2) - after.corner(t, 0));
    const double size = 0.5 * one.norm();
    area += size;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double of_corners = 0;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d u = after.corner(t, k) - before.corner(t, k);
      sum += u;
      of_corners += u.squaredNorm();
      change.largest_mm = std::max(change.largest_mm, u.norm());
    }
    squares += size / 12 * (sum.squaredNorm() + of_corners);
    const double angle = angle_between(one, other);
    angles += size * angle * angle;
  }
  if (area > 0) {
    change.rms_mm = std::sqrt(squares / area);
    change.normals_rad = std::sqrt(angles / area);
  }
  return change;
}

}  // namespace rayrep::detail
