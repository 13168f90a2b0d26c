#include "rayrep/physics/bead.h"

#include <algorithm>
#include <cmath>

namespace rayrep {
namespace {

Moments of_parts(double volume, const Eigen::Vector3d& centre, const Eigen::Matrix3d& spread) {
  Moments s = monomials(centre);
  s[MXX] += spread(0, 0);
  s[MYY] += spread(1, 1);
  s[MZZ] += spread(2, 2);
  s[MXY] += spread(0, 1);
  s[MYZ] += spread(1, 2);
  s[MXZ] += spread(0, 2);
  return volume * s;
}

}  // namespace

Moments bead_moments(const Bead& bead) {
  const Eigen::Vector3d d = bead.to_mm - bead.from_mm;
  const double length = d.head<2>().norm();
  const double w2 = bead.width_mm * bead.width_mm / 12;
  Eigen::Matrix3d spread = d * d.transpose() / 12;
  if (length > 0) {
    const Eigen::Vector2d across(-d.y() / length, d.x() / length);
    spread.topLeftCorner<2, 2>() += w2 * across * across.transpose();
  } else {
    spread.topLeftCorner<2, 2>() += w2 * Eigen::Matrix2d::Identity();
  }
  spread(2, 2) += bead.height_mm * bead.height_mm / 12;
  const Eigen::Vector3d centre = 0.5 * (bead.from_mm + bead.to_mm) - Eigen::Vector3d(0, 0, 0.5 * bead.height_mm);
  return of_parts(bead.volume_mm3, centre, spread);
}

Moments bead_moments(const ArcBead& bead) {
  const double R = bead.radius_mm;
  const double w = std::min(bead.width_mm, 2 * R);
  // Means over the annular sector, whose elements are r dr da: of r, of r^2; of cos, sin and their products over the angle.
  const double r1 = R + w * w / (12 * R);
  const double r2 = R * R + w * w / 4;
  const double half = 0.5 * bead.sweep_rad;
  const double middle = bead.from_rad + half;
  const double sinc1 = std::sin(half) / half;
  const double sinc2 = std::sin(2 * half) / (2 * half);
  const Eigen::Vector2d towards(std::cos(middle), std::sin(middle));
  const double c2 = sinc2 * std::cos(2 * middle);
  const double s2 = sinc2 * std::sin(2 * middle);
  const Eigen::Vector2d mean = r1 * sinc1 * towards;
  Eigen::Matrix2d square;
  square << 1 + c2, s2, s2, 1 - c2;
  square *= 0.5 * r2;

  // Of t = (angle - middle) / sweep, by which a helix rises: the mean of t (cos, sin) is along the sideways direction.
  const double rise = bead.to_z_mm - bead.from_z_mm;
  const double turned = (sinc1 - std::cos(half)) / (2 * half);
  const Eigen::Vector2d sideways(-towards.y(), towards.x());

  const Eigen::Vector2d plan = bead.centre_mm + mean;
  const Eigen::Vector3d centre(plan.x(), plan.y(), 0.5 * (bead.from_z_mm + bead.to_z_mm - bead.height_mm));
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  spread.topLeftCorner<2, 2>() = square - mean * mean.transpose();
  spread.topRightCorner<2, 1>() = rise * r1 * turned * sideways;
  spread(2, 2) = (rise * rise + bead.height_mm * bead.height_mm) / 12;
  return of_parts(bead.volume_mm3, centre, spread);
}

}  // namespace rayrep
