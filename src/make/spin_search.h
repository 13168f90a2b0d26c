#pragma once

#include <memory>
#include <optional>

#include "make/body.h"
#include "rayrep/base/error.h"
#include "rayrep/physics/spec.h"
#include "rayrep/solve/goals.h"

namespace rayrep::detail {

/// A spin axis in the working frame of a Body: the direction that points up and the contact point (the centre of a yo-yo).
struct SpinFrame {
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d contact_mm = Eigen::Vector3d::Zero();
};

/// True when Izz is the largest (or the smallest) principal moment of a body on its spin axis, the z axis through the origin.
bool spins_as_wanted(const Moments& s, bool largest);

/// Compares spin axes on the rays of one body: the rays are a quadrature of its inner domain for axes of any direction, so that a
/// change of axis changes the goal only (`mapped`), and a candidate costs one solve_quadric.
class SpinSearch {
public:
  /// Keeps references to both.
  SpinSearch(const Body& body, const SpinSpec& spec);

  /// Of the best interior for this axis; infinite when there is none, or when the axis is then not the principal one that is
  /// wanted.
  double objective(const SpinFrame& frame) const;

  /// The frame that the spec describes, tilted to `up`: the contact point follows by SpinSpec::axis. For Through::best and a
  /// point inside the body the axis goes through the same point of it.
  SpinFrame tilted(const SpinFrame& frame, const Eigen::Vector3d& up) const;

  /// The axis that spins best: contact point (if `points`), direction (within max_tilt_rad of frame.up), or both.
  SpinFrame best(const SpinFrame& frame, bool points, double max_tilt_rad, const Progress& progress) const;
  /// The nearest axis parallel to this one for which there is an interior, by its distance in mm.
  std::optional<std::pair<SpinFrame, double>> nearest_point(const SpinFrame& frame, const Progress& progress) const;
  /// The least tilted axis by SpinSpec::axis for which there is an interior, within `most_rad`, and its tilt in rad.
  std::optional<std::pair<SpinFrame, double>> smallest_tilt(const SpinFrame& frame, double most_rad,
                                                            const Progress& progress) const;

private:
  SpinFrame through(const Eigen::Vector3d& point, const Eigen::Vector3d& up) const;

  const Body& body_;
  const SpinSpec& spec_;
  Goal goal_;
  Eigen::Vector3d centre_;  ///< of mass of the solid
};

/// A certificate as a report lists it.
Record record_of(const SpinCertificate& certificate);

/// Why the body cannot be balanced about this axis, and how near it comes. @param goal  of its spin, in the body's frame
Error unbalanced(const Body& body, const SpinSpec& spec, const Goal& goal);

/// To the working frame of an axis: that is z, through the origin. @param axis  in the frame of `outer`
Eigen::Affine3d frame_about(const SpinFrame& axis, const Mesh& outer);

/// The body in the working frame of an axis: that is z, through the origin.
/// @param axis  in the frame of `outer`
std::shared_ptr<Body> body_about(const SpinFrame& axis, Mesh outer, const Discretisation& options, const Progress& progress);

/// An axis found in the working frame, in the frame of the mesh that was given.
SpinFrame in_frame_given(const SpinFrame& axis, const Body& body);

/// Axis and contact point in the frame of the mesh that was given, searched at a coarse resolution where that is asked for.
SpinFrame spin_frame(const Mesh& outer, const SpinSpec& spec, const Discretisation& options, const Progress& progress);

}  // namespace rayrep::detail
