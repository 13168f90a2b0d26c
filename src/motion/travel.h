#pragma once

#include <vector>

#include "rayrep/motion/scene.h"

namespace rayrep {

/// How far the points of a moving body have come at most, as a function of time: theory.md (109). It ascends, linear between its
/// knots. Times are cut at 0 and 1.
class Travel {
public:
  Travel() : times_{0, 1}, lengths_{0, 0} {}  ///< of a body at rest
  /// @param reach_mm  of the body's points from its pivot, at most
  Travel(const Motion& motion, double reach_mm);
  /// Of a body as it is seen from another one that turns as it does, or does not turn either: theory.md (126).
  /// @param between_mm  from the other one's pivot to its own
  static Travel seen_from(const Motion& other, const Motion& motion, const Eigen::Vector3d& between_mm);
  /// Of two bodies towards each other.
  static Travel of_both(const Travel& a, const Travel& b);

  double at(double time) const;
  double whole() const { return lengths_.back(); }
  /// The middle of a stretch of time, by travel; of one at rest by time.
  double middle(double from, double to) const;
  /// The time before which no point has come `length` further than at `time`, at most `limit`.
  double later(double time, double length, double limit) const;
  /// The same backwards: after it none was so far away.
  double earlier(double time, double length, double limit) const;

private:
  std::vector<double> times_, lengths_;
};

/// Points whose convex hull holds all places of a pivot less those of another one during a stretch of time.
std::vector<Eigen::Vector3d> hull_of_way(const Motion& other, const Motion& motion, double from, double to);

}  // namespace rayrep
