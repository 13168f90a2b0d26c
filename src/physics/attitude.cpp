#include "physics/attitude.h"

namespace rayrep {

std::optional<Attitude> attitude(ClippedHull& hull, double volume, const Eigen::Vector3d& centre_of_mass, const Eigen::Vector3d& up,
                                 double guess) {
  Attitude a;
  a.up = up;
  hull.set_up(up);
  a.frame = hull.frame();
  const std::optional<double> offset = hull.offset_for_volume(volume, guess);
  if (!offset) return std::nullopt;
  a.offset = *offset;
  const Integrals sum = hull.integrals(a.offset);
  const Eigen::Vector3d b = sum.first / volume;
  a.energy = up.dot(centre_of_mass) - (a.offset + b.z());
  a.gradient = Eigen::Vector2d(a.frame.u.dot(centre_of_mass), a.frame.v.dot(centre_of_mass)) - b.head<2>();
  a.hessian = central_second_moments(sum) / volume - a.energy * Eigen::Matrix2d::Identity();
  const Eigen::Vector2d f = sum.area > 0 ? Eigen::Vector2d(sum.area_first / sum.area) : Eigen::Vector2d(b.head<2>());
  a.centre_of_flotation = a.frame.u * f.x() + a.frame.v * f.y() + a.frame.n * a.offset;
  a.dry_points = hull.dry_points(a.offset);
  return a;
}

}  // namespace rayrep
