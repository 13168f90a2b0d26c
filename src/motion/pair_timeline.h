#pragma once

#include <map>
#include <optional>
#include <queue>
#include <utility>
#include <vector>

#include "motion/proximity.h"
#include "motion/solid_body.h"
#include "motion/travel.h"
#include "rayrep/motion/motion_check.h"

namespace rayrep {

/// A body on its way.
struct MovingBody {
  const SolidBody* body;
  const Motion* motion;
  Eigen::Vector3d pivot_mm;

  Eigen::Isometry3d at(double time) const { return motion->at(time).about(pivot_mm); }
  double reach_mm() const { return body->reach_mm(pivot_mm); }
};

/// Of two bodies on their way what is known of when they are clear of each other: branch and bound in time, theory.md (110).
class PairTimeline {
public:
  struct Limits {
    double clearance_mm = 0;
    double tolerance = 1e-3;  ///< shortest stretch of time
    double touch_mm = 1e-3;
  };
  /// Keeps pointers to bodies and motions.
  PairTimeline(const MovingBody& first, const MovingBody& second, const Limits& limits);

  /// Finds out by boxes alone in which stretches not longer than `longest` they may be near.
  void by_boxes(double longest);
  /// Looks at undecided stretches, the longest first, until none is longer than `longest` or at most `moments` of them.
  void refine(double longest, int moments);
  bool is_undecided(double longest) const { return !open_.empty() && open_.top().first > longest; }
  /// Kinds and times.
  std::vector<CollisionInterval> intervals() const;
  /// Fills in where they collide and how badly.
  void describe(CollisionInterval& interval) const;
  std::size_t moments() const { return moments_; }

private:
  enum class Kind { open, clear, overlap, touching };
  struct Piece {
    double end;
    Kind kind;
  };
  struct Answer {
    Kind kind;
    double radius_mm = 0;  ///< it holds while nothing moves further than this
  };
  using Pieces = std::map<double, Piece>;  ///< by their beginnings, all of 0 to 1

  Eigen::Isometry3d pose_at(double time) const;  ///< of the second in the frame of the first
  void add(double from, double to, Kind kind);
  void refine_piece(double from, double to);
  Answer look(double time, double ahead_mm);
  Answer look_inside(const Eigen::Isometry3d& pose, double ahead_mm) const;
  bool slides_clear(double from, double middle, double to);
  bool beside_overlap(double from, double to) const;
  double length_at(double time) const;
  std::pair<double, double> worst_of(const std::vector<std::pair<double, double>>& lengths) const;
  void merge_open();

  MovingBody first_, second_;
  Limits limits_;
  Travel travel_;
  bool slides_;               ///< neither turns
  double slides_within_ = 1;  ///< stretches that are longer are not worth a look
  Pieces pieces_;
  std::priority_queue<std::pair<double, double>> open_;  ///< length and beginning
  std::size_t moments_ = 0;
};

}  // namespace rayrep
