#pragma once

#include <optional>

#include "mesh/quadric_clip.h"

namespace rayrep {

/// Puts points on f = 0 and on the surface that a mesh stands for. theory.md (87)
class QuadricLanding {
public:
  /// Keeps references to both.
  QuadricLanding(const Quadric& f, const QuadricClipOptions& options) : f_(f), options_(options) {}

  /// The point of both near `start`; none where steps do not settle there, or lead farther away than `reach_mm`.
  std::optional<Eigen::Vector3d> on_curve(const Eigen::Vector3d& start, double reach_mm) const;

  /// The point of the surface near `start`; none where steps lead farther away.
  std::optional<Eigen::Vector3d> on_surface(const Eigen::Vector3d& start, double reach_mm) const;

  /// Where an edge from a to b cuts off a ridge of the surface by more than half of the error: the point of the ridge near its
  /// middle. theory.md (130)
  std::optional<Eigen::Vector3d> on_ridge(const Eigen::Vector3d& a, const Eigen::Vector3d& b) const;

  /// Whether a triangle with a middle and an area vector faces as the surface does there, within 60 degrees.
  bool faces_outward(const Eigen::Vector3d& middle, const Eigen::Vector3d& area) const;

  /// How far p is outside of the surface; 0 where there is none.
  double height(const Eigen::Vector3d& p) const;

private:
  const Quadric& f_;
  const QuadricClipOptions& options_;
};

}  // namespace rayrep
