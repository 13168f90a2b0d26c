#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "mesh/box_tree.h"
#include "mesh/exact_point.h"
#include "rayrep/mesh/boolean.h"

namespace rayrep {

/// The triangles of all operands over common vertices, none of zero area.
struct Operands {
  Mesh mesh;
  std::vector<int> operand;  ///< of each triangle
  std::vector<int> number;   ///< in it
  std::vector<int> group;    ///< of triangles in one plane that meet: the least of them
  int count = 0;
};

/// The axis against which a triangle is seen best, and seen at all.
int best_axis(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c);

/// The middle of a triangle whose inside nothing crosses: on no triangle but those of its group.
class Probe {
public:
  Probe(const ExactPoint& a, const ExactPoint& b, const ExactPoint& c, int axis);

  int axis() const { return axis_; }
  const Eigen::Vector3d& near() const { return near_; }
  double error() const { return error_; }
  const HomogeneousPoint& exact() const;

private:
  const ExactPoint& a_;
  const ExactPoint& b_;
  const ExactPoint& c_;
  int axis_;
  Eigen::Vector3d near_;
  double error_;
  mutable std::optional<HomogeneousPoint> exact_;
};

/// What an operand is at a point of a plane, in the direction of an axis.
struct Beside {
  int below = 0;        ///< winding number
  int step = 0;         ///< what it changes by through the plane
  std::vector<int> on;  ///< its triangles of the plane's group there
};

/// Winding numbers of the operands by counting what a line along an axis passes, half-open as in theory.md (10), exactly.
class Windings {
public:
  Windings(const Operands& all, const ExactNumbers& numbers);

  /// +1 for a triangle that faces up an axis, -1 down, 0 along it. Exact.
  int facing(int t, int axis) const;
  /// @param group  the triangles that the probe lies on, if any
  Beside beside(int operand, const Probe& probe, int group) const;
  /// Calls visit(operand, winding number) for all but those in `known` (ascending) whose winding number may not be 0, until it
  /// returns false.
  template <typename Visit>
  void for_others(const Probe& probe, const std::vector<int>& known, const Visit& visit) const {
    if (trees_.empty()) return;
    bool go_on = true;
    operands_->below(probe.near(), probe.axis(), probe.error(), [&](int k) {
      if (!go_on || std::binary_search(known.begin(), known.end(), k)) return;
      go_on = visit(k, beside(k, probe, -1).below);
    });
  }

private:
  bool passes(int t, const Probe& probe, int up) const;
  bool is_below(int t, const Probe& probe, int up) const;

  const Operands& all_;
  const ExactNumbers& numbers_;
  std::vector<std::vector<int>> triangles_;  ///< of each operand
  std::vector<BoxTree> trees_;
  std::optional<BoxTree> operands_;
};

}  // namespace rayrep
