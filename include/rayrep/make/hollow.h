#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "rayrep/base/progress.h"
#include "rayrep/mesh/mesh.h"
#include "rayrep/physics/hydrostatics.h"
#include "rayrep/physics/inertial.h"
#include "rayrep/rays/inner_domain.h"
#include "rayrep/rays/ray_interior.h"
#include "rayrep/solve/certify.h"
#include "rayrep/solve/goals.h"
#include "rayrep/solve/quadric.h"
#include "rayrep/solve/solve.h"

namespace rayrep {

/// How the inside is discretised and built, for every goal.
struct HollowOptions {
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< direction of the mesh that shall point up; need not be a unit vector
  double wall_mm = 1.2;                           ///< smallest distance of a cavity to the surface
  double density_g_cm3 = 1.24;                    ///< of the printed material
  int resolution = 200;                           ///< rays along the longest side, 20 to 1000
  double min_cavity_mm3 = 4.0;                    ///< a ball of 2 mm; smaller cavities are filled
  /// As-built passes: after each meshing the difference between the mesh's exact moments and the model's is fed back and the
  /// problem is solved again, until the mesh meets mass and offset to `as_built_tolerance` (relative to mass and to the diagonal).
  /// theory.md (16d). A mesh that misses it after the last pass is delivered all the same: verify_float judges.
  int max_passes = 6;
  double as_built_tolerance = 1e-6;
  Solver solver = Solver::quadric;
  SolveOptions solve;  ///< of Ipopt, where it is the solver
  /// What storing does to coordinates (e.g. rounding to float32), see as_stored in mesh_io.h; empty: nothing.
  std::function<Mesh(const Mesh&)> as_stored;
};

struct FloatOptions {
  HollowOptions hollow;
  double fluid_g_cm3 = 1.0;
  std::optional<double> waterline_mm;  ///< above the lowest point; with neither this nor the next: searched, see best_waterline
  std::optional<double> submerged_fraction;  ///< of the height
};

/// A hollowed body and how it came about.
struct HollowResult {
  Mesh delivered;  ///< the untouched outer surface, then the cavity shells; in the frame of the mesh that was given
  std::size_t cavities = 0;
  std::size_t filled_cavities = 0;  ///< too small to print
  double filled_mm3 = 0;
  std::size_t removed_islands = 0;  ///< specks of material that would have floated in a cavity
  CastReport cast;
  std::size_t dropped_components = 0;  ///< pieces of the inner domain too small to print
  double ray_spacing_mm = 0;
  double field_spacing_mm = 0;
  Eigen::Affine3d to_working =
      Eigen::Affine3d::Identity();  ///< to the working frame: up = z, lowest point at z = 0, box centred in x, y
  Moments q = Moments::Zero();      ///< working frame: material of the inner domain is where q.phi < 0, the cavity where q.phi > 0
  SolveReport solve;                ///< of the last pass
  int solver_iterations = 0;        ///< over all passes
  int passes = 0;
  double as_built_error = 0;  ///< of the delivered mesh, to compare with HollowOptions::as_built_tolerance
  double duality_gap = 0;     ///< (objective - proven lower bound) / |bound| on these rays, last pass; may be -1e-7 (tolerance)
};

struct FloatResult {
  HollowResult hollow;
  double waterline_mm = 0;  ///< above the lowest point
  bool waterline_searched = false;
};

/// Computes the inside of a body so that it floats upright (ray-reps paper, Eq. 3-6 and 11; theory.md (10)-(17)).
/// @param solid  closed, oriented, positive volume: see require_solid. Overlapping components count as their union.
/// @throws Error{usage} for options out of range; Error{goal} with figures and remedies when the wall leaves no inside, the
///         waterline cannot be met, or the upright position would not be stable; Error{solver} when the solver stops;
///         Error{interrupted}.
/// A result is not yet a success: that is for verify_float to say.
FloatResult hollow_float(const Mesh& solid, const FloatOptions& options, const Progress& progress = {});

/// Which line a body shall spin about. Along `HollowOptions::up`, unless that is searched too: `SpinOptions::max_tilt_rad`.
struct SpinAxis {
  enum class Through {
    lowest_point,    ///< the lowest point of the mesh: the middle of all points at that height
    centre_of_mass,  ///< of the solid; contact where the axis leaves the mesh below
    point,           ///< `point_mm`
    best             ///< searched: where a top spins best; contact where the axis leaves the mesh below
  };
  Through through = Through::lowest_point;
  /// In the frame of the mesh that was given: the contact point of a top, or any point of the axis with `leaves_below`.
  Eigen::Vector3d point_mm = Eigen::Vector3d::Zero();
  bool leaves_below = false;  ///< contact where the axis through `point_mm` leaves the mesh below
};

/// The contact point of a top, in the frame of `mesh`: the rule by which hollow_spin finds it, so that a hollowed mesh can be
/// judged at the point it was made for. `lowest_point` and `leaves_below` see the outside only; `centre_of_mass` is that of `mesh`
/// as it is: give the solid, not what has been hollowed (see outer_hull).
/// @param mesh  closed when `axis` goes through the centre of mass (not checked)
/// @param up    need not be a unit vector
/// @throws Error{usage} when the vertical through SpinAxis::point_mm does not meet the mesh; Error{interrupted}
Eigen::Vector3d contact_point(const Mesh& mesh, const SpinAxis& axis, const Eigen::Vector3d& up, const Progress& progress = {});

struct SpinOptions {
  HollowOptions hollow;
  SpinAxis axis;
  bool yoyo = false;
  std::optional<Eigen::Vector3d>
      centre_mm;        ///< yo-yo: wanted centre of mass, in the frame given; none: the middle of the bounding box
  bool largest = true;  ///< Izz shall be the largest principal moment, else the smallest
  SpinGoal::Weights weights;
  SegmentBounds bounds = SegmentBounds::complete;
  double start_fill = 0.5;  ///< where Ipopt starts: 1 all solid, 0 all void; half takes the fewest iterations on most bodies
  /// The axis is searched within this angle of HollowOptions::up; 0: it is not. With SpinAxis::Through::best, at the same time as
  /// the contact point.
  double max_tilt_rad = 0;
  bool certify = false;  ///< search for the global optimum, with proof; for a largest axis and gamma_c = 0 only
};

struct SpinResult {
  HollowResult hollow;
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();         ///< the spin axis, a unit vector
  Eigen::Vector3d contact_mm = Eigen::Vector3d::Zero();  ///< contact point of a top, centre of a yo-yo; in the frame given
  double objective = 0;                                  ///< SpinGoal::objective of the solver's body, last pass
  std::optional<SpinCertificate> certificate;            ///< of the first pass
};

/// Computes the inside of a body so that it spins stably about an axis as a top (ray-reps paper, Eq. 7-10; Spin-It, Eq. 3) or as a
/// yo-yo (Spin-It, Eq. 5). Working frame: the contact point, or the yo-yo's centre, at the origin.
/// @throws as hollow_float; Error{goal} says how close to the axis the centre of mass can be brought when that is not enough
/// Whether the axis is the largest or smallest principal one, and at which speeds the spin is stable, is for verify_spin to say.
SpinResult hollow_spin(const Mesh& solid, const SpinOptions& options, const Progress& progress = {});

struct StandOptions {
  HollowOptions hollow;
  enum class Objective {
    lowest,     ///< the lowest centre of mass above the target
    tip_angle,  ///< the target is moved to where the smallest tipping angle is largest
  };
  Objective objective = Objective::lowest;
  /// Where the centre of mass shall be in plan, in the frame given; none: the safest point of the support polygon. Where tip_angle
  /// starts.
  std::optional<Eigen::Vector3d> target_mm;
  std::optional<double> contact_tolerance_mm;  ///< none: see contact_tolerance_mm()
};

struct StandResult {
  HollowResult hollow;
  Eigen::Vector3d target_mm = Eigen::Vector3d::Zero();  ///< on the ground, in the frame given
  double objective = 0;                                 ///< StandGoal::objective of the solver's body, last pass
};

/// Computes the inside of a body so that it stands: the centre of mass above a point of the support polygon, as low as it goes.
/// @throws as hollow_float; Error{goal} for a body that touches the ground in a point or an edge only, and when the target is out
/// of reach, with the nearest that can be reached
StandResult hollow_stand(const Mesh& solid, const StandOptions& options, const Progress& progress = {});

struct TargetOptions {
  HollowOptions hollow;  ///< Solver::quadric only
  InertialTargets wanted;
  /// What is minimised first, second, ... while the wanted numbers are met; then as TargetGoal says. A coordinate of the centre of
  /// mass needs the mass wanted; a moment or product of inertia needs the coordinates that it depends on, as if it were wanted.
  std::vector<TargetGoal::Wish> order;
};

struct TargetResult {
  HollowResult hollow;  ///< its working frame has the wanted centre of mass, as far as given, at the origin and z along the rays:
                        ///< up, or an axis across it that meets the cavity's surface more squarely
  Eigen::Vector3d origin_mm = Eigen::Vector3d::Zero();  ///< of the working frame, in the frame given
  /// What was minimised first; none: not one of the ten numbers, or all of them were wanted.
  std::optional<TargetGoal::Wish> first;
  double first_found = 0;  ///< of the solver's body, last pass; unit of InertialTargets
  double first_bound = 0;  ///< proven: no interior on these rays with the wanted numbers has less (more, if largest)
  double wall_mm = 0;      ///< of the cavity: thicker than asked for when all ten numbers were wanted
};

/// Computes the inside of a body with any of its ten numbers given: mass, centre of mass, inertia. What is free is minimised in the
/// stated order. With all ten given nothing is: then the wall is made as thick as they allow, which singles out one
/// body. HollowOptions::as_built_tolerance holds then too, but at the very edge of what is possible, where the mass hardly depends
/// on the wall, only some 1e-4 may be reached.
/// @throws as hollow_float; Error{usage} for numbers that no body has, and for inertia without the coordinates of the centre of
///         mass it depends on, which would not be linear; Error{goal} when the numbers cannot be met, with the nearest that can,
///         and what would help
TargetResult hollow_target(const Mesh& solid, const TargetOptions& options, const Progress& progress = {});

/// A goal with its solution.
struct TargetSolution {
  TargetGoal goal;
  QuadricSolution solution;  ///< neither converged nor infeasible: no weight worked
};

/// Solves with a TargetGoal of the smallest weight with which Newton's method converges: 1e-2, or larger in steps of about three,
/// with height or moments of inertia as the second objective. What that costs of the first, TargetResult::first_bound tells.
/// @param setup  whose weight is not used; not determined, see TargetGoal
TargetSolution solve_target(const TargetGoal::Setup& setup, const RayIntegrals& rays, const Moments& constant);

/// The rigid motion that turns `up` to +z, puts the lowest point to z = 0 and centres the box in x and y. Exact (entries 0 and
/// +-1) for directions along the axes.
Eigen::Affine3d working_frame(const Mesh& mesh, const Eigen::Vector3d& up);

}  // namespace rayrep
