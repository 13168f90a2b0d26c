// An ellipsoid off its axes with an inner domain that is an ellipsoid too, as a ray-rep without any casting.

#pragma once

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

#include "rayrep/physics/moments.h"
#include "rayrep/rays/ray_interior.h"
#include "rayrep/rays/ray_rep.h"
#include "solids.h"

namespace rayrep::test {

/// Half axes 50, 32.5 and 31.5 mm, turned by 15 degrees about (1, 2, 0); the inner domain is the same shrunk to 93 %.
struct EllipsoidRays {
  RayRep domain;
  Moments solid;           ///< exact, about the origin
  Moments shell;           ///< solid - ray_moments(domain)
  double length_mm = 120;  ///< for scaling

  /// @param across  rays per 100 mm
  /// @param stands  lowest point at z = 0, for spinning; else the centre
  EllipsoidRays(int across, bool stands) {
    const Eigen::Matrix3d R = Eigen::AngleAxisd(kPi / 12, Eigen::Vector3d(1, 2, 0).normalized()).toRotationMatrix();
    const Eigen::Vector3d half(50, 32.5, 31.5);
    const Eigen::Matrix3d C = R * half.cwiseAbs2().asDiagonal() * R.transpose();
    const double height = stands ? std::sqrt(C(2, 2)) : 0;
    const double volume = 4 * kPi / 3 * half.prod();
    solid = moments_of(volume, {0, 0, height}, volume / 5 * C);

    const double shrunk = 0.93;
    const Eigen::Matrix3d Q = (shrunk * shrunk * C).inverse();
    const Eigen::Vector2d reach = shrunk * C.diagonal().head<2>().cwiseSqrt();
    RayGrid& grid = domain.grid;
    grid.spacing_mm = 100.0 / across;
    grid.nx = static_cast<int>(std::ceil(2 * reach.x() / grid.spacing_mm));
    grid.ny = static_cast<int>(std::ceil(2 * reach.y() / grid.spacing_mm));
    grid.origin_mm = Eigen::Vector2d::Constant(0.45 * grid.spacing_mm) - reach;
    domain.first.push_back(0);
    for (std::size_t ray = 0; ray < grid.size(); ++ray) {
      const Eigen::Vector2d p = grid.at(ray);
      const double b = Q.block<1, 2>(2, 0) * p;
      const double c = p.dot(Q.topLeftCorner<2, 2>() * p) - 1;
      const double discriminant = b * b - Q(2, 2) * c;
      if (discriminant > 0) {
        const double root = std::sqrt(discriminant);
        domain.intervals.push_back({height + (-b - root) / Q(2, 2), height + (-b + root) / Q(2, 2)});
      }
      domain.first.push_back(static_cast<std::uint32_t>(domain.intervals.size()));
    }
    shell = solid - ray_moments(domain);
  }
};

}  // namespace rayrep::test
