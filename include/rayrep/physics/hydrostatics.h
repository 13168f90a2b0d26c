#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>

#include "rayrep/mesh/mesh.h"

namespace rayrep {

/// A plane n.p = offset with unit normal n; the fluid is where n.p < offset.
struct Waterplane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  double offset_mm = 0;
};

/// What the fluid sees of a body at rest; dry pockets (see hydrostatics) displace and belong to the waterplane. Units mm; "moments"
/// of the waterplane are per unit density.
struct Hydrostatics {
  double displaced_volume_mm3 = 0;
  Eigen::Vector3d centre_of_buoyancy_mm = Eigen::Vector3d::Zero();
  double waterplane_area_mm2 = 0;
  Eigen::Vector3d centre_of_flotation_mm = Eigen::Vector3d::Zero();  ///< centroid of the waterplane, on the plane
  double smallest_second_moment_mm4 = 0;  ///< I_w: smallest second moment of the waterplane about an axis through its centroid
  double largest_second_moment_mm4 = 0;
  double dry_interior_mm3 = 0;         ///< volume of the dry pockets below the waterplane
  std::optional<double> freeboard_mm;  ///< height of the lowest rim of a dry pocket above the waterplane; none without a pocket
  /// Height of the metacentre above the centre of buoyancy, I_w / V_b (ray-reps paper, Sec. 3.4); 0 if nothing is displaced.
  double metacentric_radius_mm() const;
  /// c_b + (I_w / V_b) n (ray-reps paper, Sec. 3.4).
  Eigen::Vector3d metacentre_mm(const Waterplane& plane) const;
};

/// What keeps the fluid out of a body: a surface outward, closed, not overlapping itself (see boundary_of_union), without sealed
/// cavities (see outer_hull). What the functions below work out of it alone is worked out once, when it is first needed; a mesh
/// given to them directly is prepared for that call. Copies share it; any thread may use it.
class PreparedHull {
public:
  PreparedHull(Mesh mesh);  // NOLINT(google-explicit-constructor)
  const Mesh& mesh() const;

  struct State;
  State& state() const { return *state_; }

private:
  std::shared_ptr<State> state_;
};

/// Exact hydrostatics of a closed surface by clipping each triangle at the waterplane; surface integrals about a point on the
/// plane, so the cap contributes nothing, and Green's theorem over the cut for the waterplane. theory.md (5)-(8).
///
/// A pocket is a space below the plane that is not material and has no way below it to the fluid around the body: a boat's cockpit,
/// the inside of a cup. It is dry and displaces as if it were filled, as long as the plane does not lie above its lowest rim.
/// theory.md (9d).
Hydrostatics hydrostatics(const PreparedHull& hull, const Waterplane& plane);

/// Of a hull that lies wholly under the fluid, its pockets full: what it encloses and the centroid of that; no waterplane.
Hydrostatics submerged_hydrostatics(const PreparedHull& hull);

/// The surface that the fluid touches: `mesh` without the components that bound sealed cavities (closed components that lie inside
/// others and whose signed volume is negative) and without what floats inside these. Vertices with equal coordinates count as one,
/// and the winding number of the other components decides what is inside.
///
/// Where components cross, call this before boundary_of_union, which cuts shells into pieces. A void that only several overlapping
/// components enclose together is not found: it counts as flooded.
Mesh outer_hull(const Mesh& mesh);

/// The lowest offset at which `hull` displaces `volume_mm3` with the plane's normal as given, that at which a body lowered into the
/// fluid with dry pockets comes to rest: Newton's method on the volume, whose derivative is the waterplane's area, kept in a
/// bracket between the rims at which pockets flood and the volume falls. theory.md (8). Where parts are apart and the area
/// vanishes, any offset in the gap is right.
/// @param normal      unit vector
/// @param volume_mm3  between 0 and largest_displacement_mm3
/// @throws Error{goal} if the volume is outside that range: the body sinks.
double waterline_for_volume(const PreparedHull& hull, const Eigen::Vector3d& normal, double volume_mm3);

/// The largest volume that `hull` displaces at any offset, with the plane's normal as given: at least that of the hull, with
/// pockets perhaps more, just before one of them floods.
double largest_displacement_mm3(const PreparedHull& hull, const Eigen::Vector3d& normal);

/// Where a floating body comes to rest when it is let go at a given attitude and follows the righting moment quasi-statically.
struct FloatingRest {
  enum class Outcome {
    rests,         ///< at `up`, whatever its tilt
    sinks,         ///< heavier than the fluid it can displace, from the start or after a pocket was flooded
    did_not_rest,  ///< still turning after FloatingRestOptions::max_turns; `up` is where it was then
  };
  Outcome outcome = Outcome::did_not_rest;
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< direction of world up in the body's frame; where it sinks, the last one
  Waterplane plane;                               ///< the waterplane in the body's frame, normal = up; offset 0 if it sinks
  double residual_mm = 0;                         ///< horizontal distance from centre of mass to centre of buoyancy at rest
  bool took_water = false;                        ///< a pocket that had been dry was flooded on the way
  bool rests() const { return outcome == Outcome::rests; }
  bool sinks() const { return outcome == Outcome::sinks; }
};

struct FloatingRestOptions {
  double fluid_g_cm3 = 1.0;
  double tolerance_rad = 1e-6;  ///< rest is reached when the last turn is smaller
  int max_turns = 500;
};

/// Follows the righting moment from `up` to the rest attitude: at each turn the body heaves until it displaces its own mass, then
/// turns about a horizontal axis by at most 0.1 rad such that its potential energy falls, so that it crosses no barrier; near
/// the rest these are Newton steps. An unstable equilibrium is left even without a push. theory.md (9).
///
/// The body is lowered at `up` with its pockets dry, as far as their rims stay above the fluid. A tilt that brings a rim under
/// floods that pocket, and what has once been wet stays so: a pocket that holds such a point is not dry until the release ends.
///
/// A body is neutral about an axis, and stays as it is, where its righting arm is below 1e-5 and its metacentric height below 1e-4
/// of the hull's diagonal, and a turn of 0.2 rad either way changes its energy over its weight by less than 2e-6 of it: less than
/// the facets of a meshed sphere make.
/// @param mass_g, centre_of_mass_mm  of the floating body, same frame as `hull`
/// @param up  the attitude at which the body is let go; need not be a unit vector
/// @throws Error{input} when the mass, the fluid's density or the hull's volume is not positive, or a coordinate not finite.
///         Sinking and not converging are results.
FloatingRest floating_rest(const PreparedHull& hull, double mass_g, const Eigen::Vector3d& centre_of_mass_mm,
                           const Eigen::Vector3d& up, const FloatingRestOptions& options = {});

/// The heel at which a floating body takes water, and the direction of up in the body's frame there.
struct FloodingHeel {
  double angle_rad = 0;
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
};

/// The smallest heel from `up`, over `directions` evenly spread ones, at which fluid enters a pocket of the body upright (one whose
/// rim lies above the waterplane, the pocket itself may too) while it displaces `volume_mm3` at every heel. Steps of 2 degrees,
/// then bisection to 1e-6 rad: a flooding that is over again within a step is not seen. None if the body has no such pocket.
/// @param up  need not be a unit vector
/// @throws Error{goal} if the body sinks upright
std::optional<FloodingHeel> flooding_heel(const PreparedHull& hull, double volume_mm3, const Eigen::Vector3d& up,
                                          int directions = 16);

}  // namespace rayrep
