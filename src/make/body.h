#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <string>

#include "rayrep/make/hollow.h"
#include "rayrep/mesh/surface_query.h"
#include "rayrep/rays/ray_integrals.h"

namespace rayrep::detail {

/// What of the options a body depends on.
struct Discretisation {
  double wall_mm = 1.2;
  int resolution = 200;
  double min_cavity_mm3 = 4.0;
  double share = 0;  ///< of a cavity that infill takes
};
Discretisation discretisation(const Print& print, const HollowOptions& options);

/// @throws Error{usage} for options out of range
void check(const HollowOptions& options, const Spec& spec);

/// What every goal needs: the body in the working frame and its inner domain.
struct Body {
  Mesh outer;  ///< as stored, in the frame given
  Eigen::Affine3d to_working;
  Mesh working;   ///< outer in the working frame
  Mesh hull;      ///< what a fluid touches: sealed cavities left out, overlaps united; working frame
  Moments solid;  ///< of the union of its components, unit density, working frame
  double size_mm = 0;
  double diagonal_mm = 0;
  double height_mm = 0;
  SurfaceQuery surface;
  InnerDomain inner;
  std::optional<RayIntegrals> integrals;  ///< over the inner domain
  Moments shell;                          ///< of the lightest there is: the inner domain all cavity

  /// @throws Error{goal} when the wall leaves no inside or cannot be resolved
  Body(Mesh mesh, const Eigen::Affine3d& frame, const Discretisation& options, const Progress& progress);

  /// The same body with another wall at a resolution that is enough for advice: its inner domain. Empty when nothing is left.
  RayRep inner_with(double wall_mm, double spacing_mm, const Progress& progress) const;

  /// By how much the volume of the rays differs from that of the field, relative: thin walls that run along the rows of the rays
  /// are hit or passed by chance.
  double missed() const;

  /// Samples the field anew on the finest grid that is of use.
  /// @returns false when it was that fine already
  bool refine(const Discretisation& options, const Progress& progress);

private:
  double weight_ = 1;  ///< of the rays

  InnerDomain domain(const InnerDomainOptions& options, const Progress& progress) const;
  std::string nothing_inside(const Discretisation& options, const Progress& progress) const;
};

/// The body on rays that do not miss its inner domain: where they do, their grid is turned about z, and made finer, until they see
/// its volume to 1 % (or are four times as fine, or 1600 along the longest side). @param frame  to the working frame, but for a
/// turn about z
std::unique_ptr<Body> resolved_body(Mesh mesh, const Eigen::Affine3d& frame, Discretisation options, const Progress& progress);

}  // namespace rayrep::detail
