#pragma once

#include <Eigen/Core>
#include <limits>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "rayrep/base/setting.h"
#include "rayrep/physics/core.h"
#include "rayrep/physics/cut.h"
#include "rayrep/physics/drains.h"
#include "rayrep/physics/inertial.h"
#include "rayrep/physics/infill.h"
#include "rayrep/physics/spin.h"
#include "rayrep/physics/spin_axis.h"

namespace rayrep {

// What a body is for. A maker is given one of these, fills in what it found (a waterline, a contact point), and a judge holds the
// result to that. Each names its goal, and its settings (base/setting.h) are all there is to set.

/// What is printed, and how thick.
struct Print {
  double density_g_cm3 = 1.24;  ///< of the printed material
  double wall_mm = 1.2;         ///< smallest distance of a cavity to the surface; for a judge 0: the wall is not judged
  double liquid_g_cm3 = 0;      ///< of what stays uncured in a sealed cavity, see Material; 0: nothing does
  bool drained = false;         ///< nothing does all the same: the cavities are drained after the print, and closed again
  Infill infill = {};           ///< of a maker: what the cavities hold; a judge takes it from the file
  Core core = {};               ///< of a maker: what a part of the cavity holds; a judge is given it as an insert
  Balls balls = {};             ///< of a maker, likewise
  Drains drains = {};           ///< of a maker, with plugs as parts
  Cut cut = {};                 ///< of a maker: into pieces that are printed by themselves
  /// Of the mesh, upward on the bed; none: that of the spec.
  std::optional<Eigen::Vector3d> direction = {};
  /// Of a maker: roofs of cavities rise at least so many degrees from the horizontal along that direction; 0: as they come.
  double self_supporting_deg = 0;
  std::optional<double> min_feature_mm = {};  ///< of a maker: so thick are the pillars that carry them; none: as thick as the wall
};

/// How prints scatter: the centre of mass may lie this far from where the mesh has it. 0.1 mm, or 5e-4 of the diagonal of the
/// bounding box if that is more.
double print_scatter_mm(double diagonal_mm);

/// What the inside is made of, by densities over that of the print: the lighter where q.phi > 0 (theory.md (47)).
struct Phases {
  double light = 0;
  double heavy = 1;
  double most_mm3 = std::numeric_limits<double>::infinity();  ///< of the heavy one, with the print's own material in its place
};
Phases phases_of(const Print& print);

/// Floats upright.
struct FloatSpec {
  static constexpr const char* kGoal = "float";
  static constexpr int kUsualResolution = 200;
  static constexpr const char* kGroup = "Floating";
  static constexpr const char* kMakes = "hollow MESH so that it floats upright";

  Print print;
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< direction of the mesh that shall point up; need not be a unit vector
  double fluid_g_cm3 = 1.0;
  /// Of the fluid's surface above the lowest point along `up`. With neither this nor the next two: a maker searches it, see
  /// best_waterline; a judge takes the one at which the body displaces its own mass.
  std::optional<double> waterline_mm;
  std::optional<double> submerged_fraction;         ///< of the height: this much of it under the fluid; 0 to 1, see is_submerged
  std::optional<double> submerged_volume_fraction;  ///< or of the volume of the hull (see outer_hull)
  double reserve = 0.05;            ///< part of the displaceable volume that a searched waterline leaves dry at least
  bool waterline_searched = false;  ///< said by a maker: waterline_mm was found by search
};

/// Whether a body shall be wholly under the fluid, a fraction of 1: it neither sinks nor rises, and has no waterline.
bool is_submerged(const FloatSpec& spec);

/// Spins stably about an axis as a top, or as a yo-yo.
struct SpinSpec {
  static constexpr const char* kGoal = "spin";
  static constexpr int kUsualResolution = 100;
  static constexpr const char* kGroup = "Spinning";
  static constexpr const char* kMakes = "hollow MESH so that it spins as a top or a yo-yo";
  enum class Objective { rayreps, spinit };

  Print print;
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< the spin axis; need not be a unit vector
  SpinAxis axis;                                  ///< of a top: through which point
  bool yoyo = false;
  Axle axle = {};                            ///< of a yo-yo
  std::optional<Eigen::Vector3d> centre_mm;  ///< of a yo-yo: wanted centre of mass; none: the middle of the bounding box
  AxisClass prefer = AxisClass::largest;     ///< or smallest: which principal moment Izz shall be

  // What a maker minimises, and how it searches.
  Objective objective = Objective::rayreps;
  double lambda = 0.1;      ///< rayreps: weight of the height of the centre of mass, over L
  double gamma_c = 1;       ///< spinit: of its static moment squared, over (V L)^2
  double gamma_i = 1;       ///< of the inertia term
  double max_tilt_rad = 0;  ///< the axis is searched within this angle of `up`; 0: it is not
  bool certify = false;     ///< search for the global optimum, with proof; for a largest axis and the objective rayreps only
};

/// Stands on level ground.
struct StandSpec {
  static constexpr const char* kGoal = "stand";
  static constexpr int kUsualResolution = 200;
  static constexpr const char* kGroup = "Standing";
  static constexpr const char* kMakes = "hollow MESH so that it stands as safely as it can";
  enum class Objective {
    lowest,     ///< the lowest centre of mass above the target
    tip_angle,  ///< the target is moved to where the smallest tipping angle is largest
  };

  Print print;
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  /// Where the centre of mass shall be in plan. None: a maker takes the safest point of the support polygon, or with tip_angle
  /// starts there; a judge asks for no place.
  std::optional<Eigen::Vector3d> target_mm;
  std::optional<double> contact_tolerance_mm;  ///< none: see contact_tolerance_mm()
  /// How much may be cut off below, along `up`, for a base. A maker takes the least that makes it stand, and nothing where it
  /// stands without; then this is what was cut. A judge compares what is above the cut with the original.
  double flatten_mm = 0;
  Objective objective = Objective::lowest;  ///< of a maker
  std::optional<double> most_mass_g;        ///< no heavier than this
};

/// Has given mass, centre of mass and inertia, any of them.
struct TargetSpec {
  static constexpr const char* kGoal = "target";
  static constexpr int kUsualResolution = 200;
  static constexpr const char* kGroup = "Wanted (any of the ten numbers)";
  static constexpr const char* kMakes = "hollow MESH to a given mass, centre of mass, inertia";

  Print print;
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< along which a maker casts its rays, unless another axis is better
  InertialTargets wanted;                         ///< in the mesh's own frame
  InertialTargets at_least, at_most;              ///< likewise, of numbers that are not wanted
  /// At least: the moment of inertia about `up` over the larger of the two across it, about the centre of mass, which must be
  /// wanted.
  std::optional<double> least_spin_ratio;
  /// What a maker minimises first, second, ... while the wanted numbers are met; then as TargetGoal says. A coordinate of the
  /// centre of mass needs the mass wanted; a moment or product of inertia needs the coordinates that it depends on, as if it were
  /// wanted.
  std::vector<InertialWish> order;
};

/// One way in which a body rests.
struct Pose {
  enum class Kind {
    stands,  ///< on level ground
    hangs,   ///< from a point
    floats,  ///< upright
    rights,  ///< itself from any tilt, like a roly-poly
    spins,   ///< as a top, about its largest axis
  };
  Kind kind = Kind::stands;
  std::optional<Eigen::Vector3d> up = {};   ///< what points up then; none: PoseSpec::up
  Eigen::Vector3d point_mm = {0, 0, 0};     ///< of one that hangs
  std::optional<double> waterline_mm = {};  ///< of one that floats, as in FloatSpec; none: a maker chooses it
  SpinAxis axis = {};                       ///< of one that spins, as in SpinSpec, but not searched
  std::string state = {};                   ///< it is that state of a thing of several parts; empty: it is spoken of by its number
  Eigen::Vector3d up_or(const Eigen::Vector3d& usual) const { return up.value_or(usual); }
};

/// Rests in several poses, all with the same inside: stands as safely as it can, hangs, floats and rights itself with the attitudes
/// given. One that spins, of which there is one at most, is made as good a top as all others allow.
struct PoseSpec {
  static constexpr const char* kGoal = "pose";
  static constexpr int kUsualResolution = 200;
  static constexpr const char* kGroup = "Poses";
  static constexpr const char* kMakes = "hollow MESH for poses: stands, hangs, floats, spins";
  static constexpr double kUsualTip_deg = 3;

  Print print;
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< of poses that do not say theirs
  std::vector<Pose> poses;
  double fluid_g_cm3 = 1.0;
  std::optional<double> contact_tolerance_mm;  ///< as in StandSpec
  /// Of a maker: it stands at least so safely, and is as light as that allows; none: as safely as it can. With one that spins none
  /// is kUsualTip_deg.
  std::optional<double> least_tip_deg;
};

/// Is thrown as a die: on all of its faces as often, or on one of them as often as possible. How often: Tumbler.
struct DiceSpec {
  static constexpr const char* kGoal = "dice";
  static constexpr int kUsualResolution = 100;
  static constexpr const char* kGroup = "Dice";
  static constexpr const char* kMakes = "hollow MESH so that it falls fairly, or loaded";

  Print print;
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< of a maker: along which it casts its rays, unless another axis is better
  struct Load {
    Eigen::Vector3d up;           ///< that throws shall end with up, or within 10 degrees of it; need not be a unit vector
    std::optional<double> share;  ///< of all throws; none: as large as a maker can make it, who says here what that is
  };
  std::optional<Load> load;  ///< none: a fair die
  int faces = 0;             ///< of a fair die: so many, those that it comes to rest on most often; 0: all
  double fairness = 1.02;    ///< of a fair die: the largest share over the smallest one may be that
  double shake_deg = 3;      ///< faces that hold it by no more than that do not count
};

using Spec = std::variant<FloatSpec, SpinSpec, StandSpec, TargetSpec, PoseSpec, DiceSpec>;

/// "standing with z up", "hanging from (0, 0, 30) mm with z up", "floating with (0, 0.6, 0.8) up"
std::string words_of(const Pose& pose, const Eigen::Vector3d& usual_up);

/// The rows that set a spec; they keep references to it. @param purpose  leaves out what the other one alone asks for
Settings settings(Print& print, Setting::For purpose);
Settings settings(Infill& infill, Setting::For purpose);
Settings settings(Core& core, Setting::For purpose);
Settings settings(Balls& balls, Setting::For purpose);
Settings settings(FloatSpec& spec, Setting::For purpose);
Settings settings(SpinSpec& spec, Setting::For purpose);
Settings settings(StandSpec& spec, Setting::For purpose);
Settings settings(TargetSpec& spec, Setting::For purpose);
Settings settings(PoseSpec& spec, Setting::For purpose);
Settings settings(DiceSpec& spec, Setting::For purpose);

/// @throws Error{usage} for a spec that makes no sense, in the words of its settings
void check(const FloatSpec& spec, Setting::For purpose);
void check(const SpinSpec& spec, Setting::For purpose);
void check(const StandSpec& spec, Setting::For purpose);
void check(const TargetSpec& spec, Setting::For purpose);
void check(const PoseSpec& spec, Setting::For purpose);
void check(const DiceSpec& spec, Setting::For purpose);

/// The print of any spec, and its up direction.
const Print& print_of(const Spec& spec);
Print& print_of(Spec& spec);
const Eigen::Vector3d& up_of(const Spec& spec);

}  // namespace rayrep
