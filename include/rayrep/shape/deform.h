#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "rayrep/base/figure.h"
#include "rayrep/base/progress.h"
#include "rayrep/base/setting.h"
#include "rayrep/make/hollow.h"
#include "rayrep/mesh/mesh.h"
#include "rayrep/physics/spec.h"

namespace rayrep {

/// A ball, mm.
struct Ball3 {
  Eigen::Vector3d centre_mm;
  double radius_mm;
};

/// A part of space: a box, a ball, or what a closed mesh encloses. In the frame of the mesh that is given.
using Region3 = std::variant<Eigen::AlignedBox3d, Ball3, Mesh>;

/// "X,Y,Z,X,Y,Z", two opposite corners of a box, or "X,Y,Z,R", a ball. @throws Error{usage}
Region3 parse_region(const std::string& text);
std::string shown(const Region3& region);

struct DeformOptions {
  /// No point of the outside may move farther; none: 0.1 of the diagonal of the bounding box.
  std::optional<double> limit_mm = {};
  /// What lies in these does not move at all; the motion fades over one cell around them.
  std::vector<Region3> fixed = {};
  /// By how much more than what it takes the goal is to be met: the slope of ground on which a stand does not yet tip over (none:
  /// 0.06), the ratio of a spin's moments less 1, a float's metacentric height over the height of the body (none: 0.02).
  std::optional<double> margin = {};
  int cells = 7;            ///< of the cage, along the longest side, 3 to 16
  double stiffness = 0.08;  ///< over the diagonal: what bends within that length is resisted more than what shifts, theory.md (63)
  int resolution = 80;      ///< rays along the longest side while the outside is searched, 20 to 400
};

/// The rows that set them.
Settings settings(DeformOptions& options);

/// An outside that was changed, and by how much.
struct Deformation {
  Mesh mesh;                    ///< as the one given, with its vertices moved
  bool changed = false;         ///< false: the goal can be met as it is, and the mesh is the one given
  std::string refusal;          ///< why it could not be met before
  double rms_mm = 0;            ///< of the displacement, over the surface
  double largest_mm = 0;        ///< displacement of any point
  double normals_rad = 0;       ///< root of the mean square of the change of normals, over the surface
  double pressed_mm = 0;        ///< a foot was pressed flat by so much
  double diagonal_mm = 0;       ///< of the bounding box before
  double violation_before = 0;  ///< see theory.md (61)
  int handles = 0;              ///< of the cage
  int iterations = 0;           ///< outsides that were solved for
  Figures figures() const;      ///< all of this but the mesh
  std::string words() const;    ///< in a sentence; empty where nothing was changed
};

/// Moves the outside of a solid as little as possible until the goal can be met with a margin by some interior: the least bending
/// and mean square displacement of a cage, under the condition that what is attainable, see nearest_attainable, reaches what is
/// wanted. Sequential quadratic programming over the handles of the cage, with exact interiors on few rays inside and their
/// derivative by the envelope theorem. theory.md (61)-(65)
/// @param solid  as for hollow. Whether the result can be hollowed is tried on as many rays as `options` say before it is returned
/// @throws Error{goal} with figures when that takes more than the limit, or would make the surface cross itself; Error{usage} for
///         options out of range, and for a TargetSpec; Error{interrupted}
Deformation deform(const Mesh& solid, const Spec& spec, const HollowOptions& options = {}, const DeformOptions& how = {},
                   const Progress& progress = {});

}  // namespace rayrep
