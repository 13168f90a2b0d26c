#pragma once

#include <Eigen/Geometry>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "rayrep/make/hollow.h"
#include "rayrep/mesh/surface_query.h"
#include "rayrep/physics/hydrostatics.h"
#include "rayrep/rays/ray_integrals.h"

namespace rayrep::detail {

/// What of the options a body depends on.
struct Discretisation {
  double wall_mm = 1.2;
  int resolution = 200;
  double min_cavity_mm3 = 4.0;
  double hole_mm = 0;      ///< that each cavity is to have; 0: none
  bool look_only = false;  ///< see HollowOptions
  Phases phases;
  std::vector<Mesh> rooms;          ///< of what is fixed in the body, in the frame given
  Moments fixed = Moments::Zero();  ///< of what is fixed in the body, unit density of the print, in the frame given
  std::vector<Mesh> keep_solid;     ///< see HollowOptions
  std::vector<Mesh> pillars;        ///< likewise
  double pillar_clearance_mm = 0;
  /// Throws for a hull, in the working frame, with which it makes no sense to go on to the inner domain. May be empty.
  std::function<void(const Mesh& hull)> require = {};
  std::shared_ptr<KeptBodies> kept = {};  ///< see HollowOptions
};
/// The clearance of pillars that a field can tell in a body of that size.
double least_pillar_clearance_mm(double size_mm);

Discretisation discretisation(const Print& print, const HollowOptions& options);

/// @throws Error{usage} for options out of range
void check(const HollowOptions& options, const Spec& spec);

/// What every goal needs: the body in the working frame and its inner domain.
struct Body {
  Mesh outer;  ///< as stored, in the frame given, with rooms for what is fixed in it
  Eigen::Affine3d to_working;
  Mesh working;   ///< outer in the working frame
  Mesh hull;      ///< what a fluid touches: sealed cavities left out, overlaps united; working frame
  Moments solid;  ///< of the union of its components with what is fixed in it, unit density, working frame
  double size_mm = 0;
  double diagonal_mm = 0;
  double height_mm = 0;
  /// Of `working`, with rods where posts are to stand under rooms, and last what is kept solid.
  std::shared_ptr<const SurfaceQuery> query;
  const SurfaceQuery& surface = *query;
  InnerDomain inner;
  std::optional<RayIntegrals> integrals;  ///< over the inner domain
  Moments shell;                          ///< of the lightest there is: lightest(*integrals)

  /// @throws Error{goal} when the wall leaves no inside or cannot be resolved
  Body(Mesh mesh, const Eigen::Affine3d& frame, const Discretisation& options, const Progress& progress);
  /// The outside of another one, without rooms in it, with an inner domain of its own. @throws likewise
  Body(const Body& outside, const Discretisation& options, const Progress& progress);
  Body(const Body&) = delete;
  Body& operator=(const Body&) = delete;

  /// The same body with another wall at a resolution that is enough for advice: its inner domain. Empty when nothing is left.
  RayRep inner_with(double wall_mm, double spacing_mm, const Progress& progress) const;

  /// Of the lightest body: all that these rays of the inner domain go through is of the lighter phase.
  Moments lightest(const RayIntegrals& rays) const;

  /// The first triangle of `query` that bounds what is kept solid.
  int kept_from() const { return kept_from_; }

  /// `hull` as fluids ask for it, with what was found out about it so far.
  const PreparedHull& prepared_hull();

  /// By how much the volume of the rays differs from that of the field, relative: thin walls that run along the rows of the rays
  /// are hit or passed by chance.
  double missed() const;

  /// Samples the field anew on the finest grid that is of use.
  /// @returns false when it was that fine already
  bool refine(const Discretisation& options, const Progress& progress);

private:
  Phases phases_;
  int kept_from_;
  std::optional<PreparedHull> prepared_;

  void find_inside(const Discretisation& options, const Progress& progress);
  InnerDomain domain(const InnerDomainOptions& options, const Progress& progress) const;
  std::string nothing_inside(const Discretisation& options, const Progress& progress) const;
};

/// " The core is limited to ...", or nothing.
std::string scarce_words(const RayGrid& grid);

/// The body on rays that do not miss its inner domain: where they do, their grid is turned about z, and made finer, until they see
/// its volume to 1 % (or are four times as fine, or 1600 along the longest side). @param frame  to the working frame, but for a
/// turn about z
std::shared_ptr<Body> resolved_body(Mesh mesh, const Eigen::Affine3d& frame, Discretisation options, const Progress& progress);

}  // namespace rayrep::detail
