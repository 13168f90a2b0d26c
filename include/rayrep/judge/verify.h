#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "rayrep/base/figure.h"
#include "rayrep/base/progress.h"
#include "rayrep/mesh/delivery.h"
#include "rayrep/mesh/mesh.h"
#include "rayrep/physics/hydrostatics.h"
#include "rayrep/physics/inertial.h"
#include "rayrep/physics/moments.h"
#include "rayrep/physics/resting_faces.h"
#include "rayrep/physics/righting_arm.h"
#include "rayrep/physics/spec.h"
#include "rayrep/physics/spin.h"
#include "rayrep/physics/support_polygon.h"

namespace rayrep {

/// One thing a delivered mesh must satisfy.
struct Criterion {
  enum class Kind { at_most, at_least };
  std::string name;         ///< stable identifier, e.g. "mass_error"
  std::string description;  ///< words and unit for a table, e.g. "mass against displaced mass, relative"
  double value = 0;
  double limit = 0;
  Kind kind = Kind::at_most;
  bool pass() const { return kind == Kind::at_most ? value <= limit : value >= limit; }  ///< false for NaN
};

/// A body as it floats with more plastic than its mesh holds, the same everywhere: its mass scaled, its centre of mass kept.
struct HeavierFloat {
  double excess = 0;                   ///< of the mass, relative
  std::optional<double> waterline_mm;  ///< above the lowest point, of the body held upright; none: it sinks
  FloatingRest::Outcome settles = FloatingRest::Outcome::rests;  ///< as in FloatState, of three releases
  double settled_tilt_rad = 0;
  bool rests_within(double tilt_rad) const { return settles == FloatingRest::Outcome::rests && settled_tilt_rad <= tilt_rad; }
};

/// A body as it floats with its waterline at a given height, or under water.
struct FloatState {
  MassProperties body;
  Hydrostatics water;
  double displaced_mass_g = 0;
  double mass_error = 0;             ///< |mass - displaced mass| / displaced mass
  double horizontal_offset_mm = 0;   ///< between centre of mass and centre of buoyancy
  double metacentric_height_mm = 0;  ///< GM: metacentre above the centre of mass
  /// How the releases end: sinks if one does, else did_not_rest if one does not, else rests.
  FloatingRest::Outcome settles = FloatingRest::Outcome::rests;
  double settled_tilt_rad = 0;  ///< largest angle to the upright over the releases that come to rest
  /// What the hull displaces at most over the mass, less 1: how much more plastic it carries, the same everywhere, until it sinks.
  double buoyancy_reserve = 0;
  /// The smallest heel at which water comes over the rim of a dry pocket (flooding_heel); none without one below the waterline.
  std::optional<double> flooding_heel_rad;
  /// In a verdict, of a body that comes to rest upright (a submerged one: always): weakest_righting_curve, or the curve
  /// of the side over which water comes in first.
  std::optional<RightingCurve> righting;
  /// In a verdict, where the body comes to rest upright: with 1 and 3 % more plastic (Limits::too_heavy).
  std::vector<HeavierFloat> heavier;
};

/// How far a body may be off.
struct Limits {
  double wall_ratio = 0.98;            ///< smallest wall over Print::wall_mm
  double offset_over_diagonal = 1e-3;  ///< of the centre of mass from where it shall be, over the diagonal of the bounding box
  // float
  double mass_error = 1e-3;
  double release_tilt_rad = 0.17453292519943295;   ///< 10 degrees
  int release_directions = 8;                      ///< 0: it is not let go, and nothing is told of how it heels
  double settled_tilt_rad = 0.017453292519943295;  ///< 1 degree
  /// By how much prints come out too heavy: often, which a body must bear, and seldom, of which a note tells.
  std::array<double, 2> too_heavy = {0.01, 0.03};
  // spin
  double axis_angle_rad = 1e-3;      ///< between the spin axis and the nearest principal axis
  double class_margin = 1e-6;        ///< by which the axial moment must differ from the nearest lateral one, relative
  double simulated_tilt_rad = 0.05;  ///< largest tilt in the simulation
  // stand
  double tipping_angle_rad = 1e-6;  ///< smallest tipping angle; the default only says that the body stands
  // roly-poly
  double righted_tilt_rad = 0.08726646259971647;  ///< 5 degrees: where it rests lies on the facets of the mesh
  // dice
  double load_share = 5e-3;  ///< of the share of throws from the wanted one
  // target
  double relative = 1e-3;  ///< deviation of every wanted number, see InertialDeviation
};

/// What a delivered mesh is found to be, whatever the goal.
struct Verdict {
  std::string goal;      ///< its name: "float", "spin", "yo-yo" ...
  std::string headline;  ///< what it was held to, for people
  Figures wanted;        ///< the same, figure by figure
  Figures figures;       ///< its state
  MassProperties body;
  std::size_t bad_edges = 0;      ///< edges not run equally often both ways
  std::size_t cavities = 0;       ///< cavity shells
  std::size_t solid_islands = 0;  ///< solid components floating free inside a cavity
  /// Triangles of cavities and islands that cross or touch others beyond shared corners and edges, or are there twice.
  std::size_t crossing_triangles = 0;
  std::size_t outer_crossing_triangles = 0;  ///< of the outer surface that cross or touch each other: told, not judged
  /// Smallest distance between any triangle of a cavity and the outer surface, theory.md (43): 0 where they cross, negative where a
  /// vertex pokes out of it; infinite without cavities.
  double smallest_wall_mm = 0;
  double outer_deviation_mm = 0;  ///< two-sided Hausdorff distance of what was changed of the outer surface, theory.md (41): 0 when
                                  ///< nothing was, infinite when none is left
  double trapped_resin_g = 0;     ///< uncured, in sealed cavities: of Print::liquid_g_cm3, and not where Print says it is drained
  double coordinate_rounding_mm = 0;  ///< of the largest coordinate: 2^-23 of it where all are float32 values, else 2^-50
  std::vector<Criterion> criteria;
  std::vector<std::string> meaning;  ///< what it comes to for the print, in sentences
  std::vector<std::string> notes;
  bool pass() const;  ///< every criterion passes
};

struct FloatVerdict : Verdict {
  FloatSpec spec;  ///< what it was held to: what was left open is filled in
  FloatState state;
};

/// Judges a delivered mesh from its triangles alone: closed and consistently oriented, outer surface unchanged, no solid island,
/// wall, mass against displaced mass, offset, metacentric height, and where it settles after releases tilted in several
/// directions. Shares no code with ray-reps or solvers.
///
/// Criteria, in this order, with the limits of Limits where they are not named here:
///   closed              edges not run equally often both ways, of shells that face inward but lie in nothing, and of cavities that
///                       do not lead from winding number 1 into 0 (one inside another, or where bodies overlap): 0
///   outer_unchanged     mm, only with an original: outer_deviation_mm, at most coordinate_rounding_mm. Triangles are compared in
///                       any order and orientation: as float32 where all delivered coordinates are such values (STL), else exactly
///   no_islands          0
///   no_crossings        triangles of cavities and islands that cross or touch others, or are there twice, in the mesh's own
///                       coordinates: 0. Those of the outer surface are told in a note.
///   wall                only with a cavity and spec.print.wall_mm > 0: smallest wall over spec.print.wall_mm, in the middle of
///                       triangles too
///   trapped_resin       g, only of a Print with a liquid that is not drained, and a closed mesh: trapped_resin_g, 0
///   mass_error          relative to the displaced mass
///   offset              over the diagonal
///   metacentric_height  mm, at least 1e-5 of the diagonal
///   settled_tilt        rad; NaN, which fails, unless all releases come to rest; of a submerged body the tilt at which its centre
///                       of mass hangs below its centre of buoyancy, NaN where it sinks
///   reserve             only where settled_tilt is met, and not of a submerged body: the same with 1 % more plastic, within the
///                       same limit; a note tells when 3 % are too much
///
/// A body is submerged that its spec says is (is_submerged), or whose waterline lies at its top or above: the displaced mass is
/// then that of its whole hull, and the metacentric height the depth of its centre of mass below its centre of buoyancy.
///
/// With an original, its triangles are the outer surface (existing cavities included) and all others form cavity shells and islands
/// by their orientation and the winding number around them; without one, nesting decides for all. Mass and displacement are those
/// of the region of positive winding number; of a mesh that is not closed, of its triangles as they are.
/// @param original  the surface the user gave (checked); none: "outer surface unchanged" is not judged
/// @throws Error{interrupted}; Error{usage} for a goal that makes no sense; Error{input} when the mesh has no volume. A mesh that
///         fails a criterion is a result, not an error.
FloatVerdict verify(const Mesh& delivered, const Mesh* original, const FloatSpec& spec, const Limits& limits = {},
                    const Progress& progress = {});

Figures state_figures(const Mesh& mesh, const FloatSpec& spec, const Limits& limits = {}, const Progress& progress = {});

/// The state of a body at a waterline, for the "before" column. `settle` false skips the releases.
FloatState float_state(const Mesh& mesh, const FloatSpec& spec, const Limits& limits, bool settle, const Progress& progress = {});

struct SpinVerdict : Verdict {
  SpinSpec spec;  ///< as in FloatVerdict
  SpinState state;
  double scatter_mm = 0;  ///< print_scatter_mm
  /// Of a top that is balanced about its axis and has a range of stable speeds: by how much its axis leans, at the speed of the
  /// simulation, with the centre of mass that far beside it (off_balance_tilt_rad).
  std::optional<double> scatter_tilt_rad;
};

/// Judges a delivered mesh, as the judge of floating does, by whether it spins. Criteria, in this order: closed, outer_unchanged,
/// no_islands, no_crossings, wall and trapped_resin as there, then
///   offset         distance of the centre of mass from the axis, over the diagonal
///   centre         only of a yo-yo: distance of the centre of mass from contact_mm, over the diagonal
///   axis_angle     rad
///   axis_class     Izz over the larger lateral moment, at least 1 + class_margin (prefer largest); Izz over the smaller one, at
///                  most 1 - class_margin (prefer smallest). A middle axis fails both.
///   stable_speeds  number of ranges of speed in which the spin is stable: at least 1; for a tip that slides, of a yo-yo for a free
///                  body
///   simulated_tilt rad, only with a range: the body as delivered, nonlinear and with all its offsets, spun in the last range (1.2
///                  times its lower end, or its middle) on a sliding tip, a yo-yo freely, and kicked by 0.001 rad, over 100 turns
/// A note explains a middle axis, an axis of the other class, and parts below the contact point.
/// @throws Error{usage} for a goal that makes no sense; otherwise as verify_float
SpinVerdict verify(const Mesh& delivered, const Mesh* original, const SpinSpec& spec, const Limits& limits = {},
                   const Progress& progress = {});

Figures state_figures(const Mesh& mesh, const SpinSpec& spec, const Limits& limits = {}, const Progress& progress = {});

/// The state of a body on its axis, for the "before" column.
SpinState spin_state_of(const Mesh& mesh, const SpinSpec& spec, const Progress& progress = {});

/// A body as it stands.
struct StandState {
  MassProperties body;
  /// Turns the mesh's frame such that up is +z: the frame of `polygon`. The identity when up is +z, entries 0 and +-1 when it is
  /// along an axis.
  Eigen::Matrix3d to_ground = Eigen::Matrix3d::Identity();
  double contact_tolerance_mm = 0;  ///< what is no higher above the lowest point touches the ground
  SupportPolygon polygon;
  Eigen::Vector2d centre_mm = Eigen::Vector2d::Zero();  ///< of mass, in plan, in the frame of `polygon`
  double height_mm = 0;                                 ///< of the centre of mass above the ground
  std::vector<double> tipping_angles_rad;               ///< for each edge; see tipping_angles_rad()
  double smallest_tipping_angle_rad = 0;
  double target_offset_mm = 0;  ///< horizontal distance of the centre of mass from the target; 0 without one
};

struct StandVerdict : Verdict {
  StandSpec spec;  ///< as in FloatVerdict
  StandState state;
  double scatter_mm = 0;                   ///< print_scatter_mm
  double scattered_tipping_angle_rad = 0;  ///< the smallest one with the centre of mass that much nearer to the edge
};

/// Judges a delivered mesh, as the judge of floating does, by whether it stands. Criteria, in this order: closed, outer_unchanged,
/// no_islands, no_crossings, wall and trapped_resin as there, then
///   supported  corners of the support polygon: at least 3
///   inside     smallest tipping angle, rad
///   offset     only with a target: over the diagonal
///   most_mass  only with a most_mass_g: mass over it, at most 1 + relative
/// @throws Error{usage} for a goal that makes no sense; otherwise as verify_float
StandVerdict verify(const Mesh& delivered, const Mesh* original, const StandSpec& spec, const Limits& limits = {},
                    const Progress& progress = {});

Figures state_figures(const Mesh& mesh, const StandSpec& spec, const Limits& limits = {}, const Progress& progress = {});

/// The state of a body as it stands, for the "before" column.
StandState stand_state_of(const Mesh& mesh, const StandSpec& spec, const Progress& progress = {});

/// The ten numbers of a body, and those wanted beside them.
struct TargetState {
  MassProperties body;
  std::vector<InertialDeviation> deviations;     ///< of every wanted number; lengths relative to the diagonal of the bounding box
  std::vector<InertialDeviation> below, beyond;  ///< of at_least and at_most, as far as they are not kept, else 0
  double spin_ratio = 0;  ///< moment of inertia about TargetSpec::up over the larger one across it, about the centre of mass
};

struct TargetVerdict : Verdict {
  TargetSpec spec;  ///< as in FloatVerdict
  TargetState state;
};

/// Judges a delivered mesh, as the judge of floating does, by its mass, centre of mass and inertia. Criteria, in this order:
/// closed, outer_unchanged, no_islands, no_crossings, wall and trapped_resin as there, then one for every wanted number, named by
/// inertial_name: its deviation, relative as InertialDeviation says; and for every bound, "mass_at_most", how far it is beyond; of
/// least_spin_ratio spin_ratio_at_least.
/// @throws Error{usage} for a goal that makes no sense; otherwise as verify_float
TargetVerdict verify(const Mesh& delivered, const Mesh* original, const TargetSpec& spec, const Limits& limits = {},
                     const Progress& progress = {});

Figures state_figures(const Mesh& mesh, const TargetSpec& spec, const Limits& limits = {}, const Progress& progress = {});

/// The state of a body, for the "before" column.
TargetState target_state_of(const Mesh& mesh, const TargetSpec& spec, const Progress& progress = {});

/// A body as it hangs from a point.
struct HangState {
  double below_mm = 0;   ///< how far its centre of mass lies below the point, held upright
  double beside_mm = 0;  ///< and how far beside the vertical through it
  double tilt_rad = 0;   ///< at which it comes to hang, off upright
};

struct PoseVerdict : Verdict {
  PoseSpec spec;                          ///< as in FloatVerdict
  std::vector<Verdict> poses;             ///< each by itself, in the order of spec.poses; of the surface nothing
  double smallest_tipping_angle_rad = 0;  ///< of all in which it stands; infinite without any
};

/// Judges a delivered mesh, as the judge of floating does, in each of its poses. Criteria, in this order: closed, outer_unchanged,
/// no_islands, no_crossings, wall and trapped_resin as there; then of a closed mesh for pose 1, 2, ... those of the judge of
/// standing, floating or spinning, named "pose_1_inside" and the like, of one that hangs pose_1_hangs and of one that rights itself
/// pose_1_righted:
///   hangs      rad: angle between up and the direction from the centre of mass to the point, at most settled_tilt_rad
///   righted    rad: largest tilt at which it comes to rest, let go on level ground in 26 directions (righted), at most
///              righted_tilt_rad; NaN, which fails, if it does not come to rest
///   least_tip  last, only with a least_tip_deg: the smallest tipping angle of all, rad, at least that less 1e-4
/// @throws Error{usage} for a goal that makes no sense; otherwise as verify_float
PoseVerdict verify(const Mesh& delivered, const Mesh* original, const PoseSpec& spec, const Limits& limits = {},
                   const Progress& progress = {});

Figures state_figures(const Mesh& mesh, const PoseSpec& spec, const Limits& limits = {}, const Progress& progress = {});

HangState hang_state_of(const MassProperties& body, const Eigen::Vector3d& point_mm, const Eigen::Vector3d& up);

/// A body as a die.
struct DiceState {
  MassProperties body;
  std::vector<RestingFace> rests;  ///< the largest share first
  std::size_t counted = 0;         ///< so many of these count as faces of a fair die
  double largest_share = 0;        ///< of those that count
  double smallest_share = 0;
  double load_share = 0;  ///< of a loaded die: share_with_up
};

struct DiceVerdict : Verdict {
  DiceSpec spec;  ///< as in FloatVerdict
  DiceState state;
  DiceState solid;        ///< the same with all sealed cavities filled
  double scatter_mm = 0;  ///< print_scatter_mm
  /// The largest share over the smallest one, or a loaded die's share, at its worst with the centre of mass that far off.
  double scattered = 0;
};

/// Judges a delivered mesh, as the judge of floating does, by how often it comes to rest on which of its faces, thrown
/// quasi-statically (Tumbler). Criteria, in this order: closed, outer_unchanged, no_islands, no_crossings, wall and trapped_resin
/// as there; then of a closed mesh, of a fair die
///   faces     on which it comes to rest: at least two, or spec.faces
///   fairness  the largest share over the smallest one of those that count: at most spec.fairness, with 1e-3 of it for rounding
/// and of a loaded one
///   load      with a share: off the wanted one, at most load_share; else the share: more than 0
/// @throws Error{usage} for a goal that makes no sense; otherwise as verify_float
DiceVerdict verify(const Mesh& delivered, const Mesh* original, const DiceSpec& spec, const Limits& limits = {},
                   const Progress& progress = {});

Figures state_figures(const Mesh& mesh, const DiceSpec& spec, const Limits& limits = {}, const Progress& progress = {});

/// The verdict by a spec of any goal, without its typed state.
Verdict verify(const Mesh& delivered, const Mesh* original, const Spec& spec, const Limits& limits = {},
               const Progress& progress = {});

/// Judges what a printer lays down: mass, centre of mass and inertia are those of the print, what touches water and ground is the
/// original's outer surface. Criteria are those of the goal, from mass_error, offset, supported or the first number wanted on; of
/// the surface itself nothing is judged. Without a waterline it floats where it displaces the print's mass.
/// @param printed  unit density, in the frame of the original: place_print
/// @throws Error{input} for an original that is not closed, or a print without volume; otherwise as verify
Verdict verify_print(const Mesh& original, const Moments& printed, const Spec& spec, const Limits& limits = {},
                     const Progress& progress = {});

/// What is delivered and what a printer lays down for it.
struct PrintedDelivery {
  const Delivery& delivery;
  const Moments& printed;  ///< unit density, in the frame of the meshes
};

/// Judges both: of the meshes their surface (closed, outer_unchanged, no_islands, no_crossings, wall, trapped_resin; sparse regions
/// are held to what cavities are held to), of the print, with what is put into it, what verify_print judges. Then, of what is put
/// in, by the figures `inserts`:
///   inserts_fit  mm: how deep it reaches into the print, out of it, or into another one: 0.1. Infinite for one that is not closed.
/// @throws Error as verify
Verdict verify(const PrintedDelivery& delivered, const Mesh* original, const Spec& spec, const Limits& limits = {},
               const Progress& progress = {});

/// Judges what a slicer is told: as a mesh where no part is sparse and nothing is put in. Else as above, with the moments of
/// moments_of: the shares of the infill are assumed, and the verdict says so.
/// @throws Error as verify
Verdict verify(const Delivery& delivered, const Mesh* original, const Spec& spec, const Limits& limits = {},
               const Progress& progress = {});

/// The figures of a body as they stand in a verdict, for the "before" column.
Figures state_figures(const Mesh& mesh, const Spec& spec, const Limits& limits = {}, const Progress& progress = {});

}  // namespace rayrep
