#pragma once

#include <array>
#include <map>
#include <vector>

#include "mesh/cut_plane.h"
#include "mesh/windings.h"

namespace rayrep {

/// Which points of the operands' windings are solid: by one condition on each operand. Where one does not hold, the others do not
/// matter.
struct BooleanRule {
  BooleanOperation operation = BooleanOperation::unite;

  bool wants_inside(int operand) const {
    return operation == BooleanOperation::intersect || (operation == BooleanOperation::subtract && operand == 0);
  }
  bool holds(int operand, int winding) const { return wants_inside(operand) == (winding > 0); }
  /// Whether a point is solid at which all conditions hold, or not all.
  bool solid(bool all_hold) const { return all_hold != (operation == BooleanOperation::unite); }
};

/// All that is known before triangles are cut.
struct Arrangement {
  const Operands& all;
  BooleanRule rule;
  const std::vector<std::vector<int>>& cutters;  ///< of each triangle, those in other planes that meet it beyond shared
                                                 ///< corners and sides, by their operands
  const ExactNumbers& numbers;
  const Windings& windings;

  const Eigen::Vector3i& corners(int t) const { return all.mesh.triangles[static_cast<std::size_t>(t)]; }
  const Eigen::Vector3d& point(int v) const { return all.mesh.vertices[static_cast<std::size_t>(v)]; }
  ExactPoint exact(int v) const { return {point(v), {numbers.of(point(v))}, 0, v}; }
  /// Whether the conditions on all operands but those in `known` (ascending) hold at a point on none of them.
  bool others_hold(const Probe& probe, const std::vector<int>& known) const;
};

/// What of the triangles of a group is part of the boundary.
struct BoundaryPart {
  struct Triangle {
    std::array<int, 3> point;
    int source;
  };
  /// A triangle of which nothing is lost.
  struct Whole {
    int triangle;
    bool turned;
  };
  std::vector<Eigen::Vector3d> points;
  std::vector<Triangle> triangles;
  std::vector<Whole> whole;
};

/// Cuts the triangles of one group, which lie in one plane, by all that meet them.
/// @param members  ascending
BoundaryPart cut_group(const Arrangement& arrangement, const std::vector<int>& members);

}  // namespace rayrep
