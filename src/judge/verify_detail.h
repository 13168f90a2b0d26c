#pragma once

// What the verdicts of all goals share: the criteria on the surface itself, and the body's mass properties.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <string>

#include "judge/outer_surface.h"
#include "rayrep/base/progress.h"
#include "rayrep/judge/verify.h"
#include "rayrep/mesh/mesh.h"
#include "rayrep/physics/moments.h"

namespace rayrep::verify_detail {

Criterion at_most(std::string name, std::string description, double value, double limit);
Criterion at_least(std::string name, std::string description, double value, double limit);

/// The mesh with its vertices merged.
/// @throws Error{input} when it has no triangles, or coordinates that are not finite
Mesh merged_mesh(const Mesh& mesh);

/// The shells of a mesh that face inward. @throws Error{input}: see merged_mesh
Mesh cavities_of(const Mesh& delivered);

/// Edges of a mesh with merged vertices that are not run equally often both ways.
std::size_t unbalanced_edges(const Mesh& mesh);

/// The boundary of the material: of the region of positive winding number, or of a mesh that is not closed its triangles as they
/// are.
/// @param mesh  vertices merged
Mesh material_of(const Mesh& mesh, bool closed, const Progress& progress);

/// Height of the lowest vertex along `up`.
double lowest_along(const Mesh& mesh, const Eigen::Vector3d& up);

/// A delivered mesh taken apart.
struct Surface {
  Mesh mesh;                         ///< vertices merged
  Mesh outer;                        ///< of these, the triangles that are not of cavity shells or islands
  Mesh cavities;                     ///< and those of cavity shells
  Mesh material;                     ///< see material_of
  std::size_t inside_out_edges = 0;  ///< edges of shells that face inward but lie in nothing
  std::size_t misplaced_edges = 0;   ///< edges of cavities that do not lead from winding number 1 into 0
  Eigen::AlignedBox3d box;
  double diagonal_mm = 0;   ///< of the box
  bool is_float32 = false;  ///< all its coordinates are float32 values
  HoledOutside holes;       ///< of `outer`; empty where none are allowed

  /// Whether the winding number means anything.
  static bool closed(const Verdict& verdict) { return verdict.bad_edges == 0; }
};

/// Takes a delivered mesh apart, and fills in all of the verdict but criteria and notes.
/// @param drains  holes that the outside may have, with an original; null: none
/// @throws Error{input}: see merged_mesh; Error{interrupted}
Surface judge_surface(const Mesh& delivered, const Mesh* original, const Progress& progress, Verdict& verdict,
                      const Drains* drains = nullptr);

/// The rooms inside, facing into the void, with the holes that lead into them.
Mesh rooms_in(const Surface& surface, const Progress& progress);

/// The outside that a body is held to: the original, but for what a goal lets be cut off below, or be taken for an axle.
class AllowedOutside {
public:
  /// @param original  may be null
  AllowedOutside(const Mesh& delivered, const Mesh* original, const Spec& spec, const Progress& progress);
  AllowedOutside(const AllowedOutside&) = delete;
  AllowedOutside& operator=(const AllowedOutside&) = delete;

  const Mesh* mesh() const { return mesh_; }
  /// By how much more than rounding it may differ: planes and holes that are told by numbers.
  double tolerance_mm() const { return tolerance_mm_; }
  /// The criterion on what was cut off, and a note, where anything may be.
  void tell(Verdict& verdict) const;

private:
  void take_axle(const Spec& spec, const Progress& progress);

  const Mesh* mesh_;
  Mesh flattened_;  ///< or with what was taken
  double tolerance_mm_ = 0;
  double allowed_mm_ = 0;
  double cut_mm_ = 0;
};

/// " off, as prints scatter" and the like begin with this: "0.1 mm".
std::string scatter_words(double scatter_mm);

/// What the surface alone is held to.
struct SurfaceTerms {
  bool has_original;
  const Print& print;
  const Eigen::Vector3d& up;  ///< of the goal: it is printed so, unless the print says otherwise
  double wall_ratio;
  double tolerance_mm = 0;  ///< by which more than rounding the outside may differ
  bool in_pieces = false;   ///< each is printed as it lies: nothing is told of roofs
};

/// Adds the criteria closed, outer_unchanged (with an original), no_islands, no_crossings, wall (with a cavity and a wall asked
/// for) and trapped_resin (see Verdict) and their notes, and to the figures, of closed cavities, what hangs in the air while they
/// are printed.
void add_surface_criteria(const Surface& surface, const SurfaceTerms& terms, const Progress& progress, Verdict& verdict);

/// A print: what it looks like from outside, and what was laid down within.
struct PrintInHull {
  Mesh hull;  ///< closed, without sealed cavities or overlaps, vertices merged
  Moments s;  ///< unit density, in the frame of the hull
  double diagonal_mm;
};

/// @param merged  closed, vertices merged
PrintInHull in_hull(const Mesh& merged, const Moments& printed, const Progress& progress);

/// What is judged, and how.
struct Judged {
  const Mesh& delivered;
  const Mesh* original;  ///< may be null
  const Limits& limits;
  const Progress& progress;
};

/// Of a surface that is not closed: its mass properties as they are, and in words what cannot be said.
void tell_body_alone(const Surface& surface, const Print& print, const std::string& unsaid, Verdict& verdict);

/// The verdict of a goal that asks for nothing but hull and moments.
/// @param conclude  (verdict, PrintInHull, limits, progress): adds figures and criteria of a closed surface
/// @param describe  (verdict): fills in what was wanted; conclude does so itself
/// @param unsaid    of a surface that is not closed: see tell_body_alone
template <typename Verdict_, typename Spec_, typename Conclude, typename Describe>
Verdict_ judge_in_hull(const Judged& what, const Spec_& spec, const Conclude& conclude, const Describe& describe,
                       const std::string& unsaid) {
  check(spec, Setting::For::judging);
  Verdict_ verdict;
  verdict.spec = spec;
  const Surface surface = judge_surface(what.delivered, what.original, what.progress, verdict);
  add_surface_criteria(surface, {what.original != nullptr, spec.print, spec.up, what.limits.wall_ratio}, what.progress, verdict);
  if (Surface::closed(verdict)) {
    conclude(verdict, in_hull(surface.outer, mesh_moments(surface.material), what.progress), what.limits, what.progress);
  } else {
    tell_body_alone(surface, spec.print, unsaid, verdict);
    describe(verdict);
  }
  return verdict;
}

FloatVerdict judge_print(const PrintInHull& print, const FloatSpec& spec, const Limits& limits, const Progress& progress);
SpinVerdict judge_print(const PrintInHull& print, const SpinSpec& spec, const Limits& limits, const Progress& progress);
StandVerdict judge_print(const PrintInHull& print, const StandSpec& spec, const Limits& limits, const Progress& progress);
TargetVerdict judge_print(const PrintInHull& print, const TargetSpec& spec, const Limits& limits, const Progress& progress);
PoseVerdict judge_print(const PrintInHull& print, const PoseSpec& spec, const Limits& limits, const Progress& progress);
DiceVerdict judge_print(const PrintInHull& print, const DiceSpec& spec, const Limits& limits, const Progress& progress);

}  // namespace rayrep::verify_detail
