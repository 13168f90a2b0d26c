#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "rayrep/hydrostatics.h"
#include "rayrep/mesh.h"
#include "rayrep/moments.h"
#include "rayrep/progress.h"

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

/// A body as it floats with its waterline at a given height.
struct FloatState {
  MassProperties body;
  Hydrostatics water;
  double displaced_mass_g = 0;
  double mass_error = 0;             ///< |mass - displaced mass| / displaced mass
  double horizontal_offset_mm = 0;   ///< between centre of mass and centre of buoyancy
  double metacentric_height_mm = 0;  ///< GM: metacentre above the centre of mass
  double settled_tilt_rad = 0;       ///< largest angle to the upright over all releases; pi if it sinks or never settles
};

struct FloatGoalSpec {
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< in the mesh's own frame
  double waterline_mm = 0;                        ///< above the lowest point of the mesh along `up`
  double fluid_g_cm3 = 1.0;
  double density_g_cm3 = 1.24;
  double wall_mm = 1.2;  ///< 0: the wall is not judged
};

struct FloatLimits {
  double mass_error = 1e-3;
  double offset_over_diagonal = 1e-3;             ///< horizontal offset over the diagonal of the bounding box
  double wall_ratio = 0.98;                       ///< smallest wall over FloatGoalSpec::wall_mm
  double release_tilt_rad = 0.17453292519943295;  ///< 10 degrees
  int release_directions = 8;
  double settled_tilt_rad = 0.017453292519943295;  ///< 1 degree
};

struct FloatVerdict {
  FloatState state;
  std::size_t bad_edges = 0;      ///< edges not run equally often both ways
  std::size_t cavities = 0;       ///< cavity shells
  std::size_t solid_islands = 0;  ///< solid components floating free inside a cavity
  double smallest_wall_mm = 0;    ///< smallest distance from a cavity vertex to the outer surface, negative where one pokes out of
                                  ///< it; infinite without cavities
  double outer_deviation_mm = 0;  ///< 0 when every triangle of the original is there unchanged; else the distance, or infinity
  std::vector<Criterion> criteria;
  std::vector<std::string> notes;
  bool pass() const;  ///< every criterion passes
};

/// Judges a delivered mesh from its triangles alone: closed and consistently oriented, outer surface unchanged, no solid island,
/// wall, mass against displaced mass, offset, metacentric height, and where it settles after releases tilted in several
/// directions. Shares no code with ray-reps or solvers.
///
/// Criteria, in this order, with the limits of FloatLimits where they are not named here:
///   closed              edges not run equally often both ways, and edges of shells that face inward but lie in nothing: 0
///   outer_unchanged     mm, only with an original: triangles are compared as float32, in any order and orientation; the limit is
///   the
///                       float32 rounding of the largest coordinate
///   no_islands          0
///   wall                only with a cavity and goal.wall_mm > 0: smallest wall over goal.wall_mm
///   mass_error          relative to the displaced mass
///   offset              over the diagonal
///   metacentric_height  mm, at least 1e-4 of the diagonal: below that floating_rest takes a body for neutral
///   settled_tilt        rad
///
/// With an original, its triangles are the outer surface (existing cavities included) and all others form cavity shells and islands
/// by their orientation and the winding number around them; without one, nesting decides for all. Mass and displacement are those
/// of the region of positive winding number; of a mesh that is not closed, of its triangles as they are.
/// @param original  the surface the user gave (checked); none: "outer surface unchanged" is not judged
/// @throws Error{interrupted}; Error{usage} for a goal that makes no sense; Error{input} when the mesh has no volume. A mesh that
/// fails
///         a criterion is a result, not an error.
FloatVerdict verify_float(const Mesh& delivered, const Mesh* original, const FloatGoalSpec& goal, const FloatLimits& limits = {},
                          const Progress& progress = {});

/// The state of a body at a waterline, for the "before" column. `settle` false skips the releases.
FloatState float_state(const Mesh& mesh, const FloatGoalSpec& goal, const FloatLimits& limits, bool settle,
                       const Progress& progress = {});

}  // namespace rayrep
