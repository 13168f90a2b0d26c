#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "rayrep/mesh/quadric.h"

namespace rayrep {

/// A map of part of a quadric's surface to the plane that takes no two points of it to one.
struct QuadricChart {
  enum class Kind {
    graph,   ///< along the last axis
    tube,    ///< around it: direction about it times zeta + sqrt(1 + zeta^2), zeta the height in its unit
    sphere,  ///< of an ellipsoid, from its pole on the last axis: stereographic
  };
  Kind kind = Kind::graph;
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  ///< rows, right-handed, in their units of 1 / mm
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();

  Eigen::Vector2d at(const Eigen::Vector3d& p) const;
  /// The point of f = 0 that is mapped there; of a graph on the sheet that turns as `turn` says. None where there is none.
  std::optional<Eigen::Vector3d> lifted(const Quadric& f, const Eigen::Vector2d& at, int turn) const;
  /// Whether the map keeps the way round (+1) or turns it (-1), seen from where f is negative; 0 where that cannot be told.
  int orientation(const Quadric& f, const Eigen::Vector3d& p) const;
};

/// Charts that may hold what lies near some points of f = 0, likeliest first. Which does is for the caller to find out.
/// @param loops  closed curves on f = 0, of which the charts are to hold one side
/// @param error_mm  bends of less than this are none
std::vector<QuadricChart> quadric_charts(const Quadric& f, const std::vector<std::vector<Eigen::Vector3d>>& loops, double error_mm);

}  // namespace rayrep
