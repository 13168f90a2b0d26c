#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "rayrep/base/progress.h"
#include "rayrep/motion/scene.h"

// When, where and how badly parts that move get into each other. theory.md (109)-(112)

namespace rayrep {

/// A stretch of time in which two parts are not known to be clear of each other. Times are shares of the transition, 0 to 1.
struct CollisionInterval {
  enum class Kind {
    undecided,  ///< not looked at closely yet
    contact,    ///< they touch: nearer than MotionCheckOptions::touch to the clearance, and no deeper than that where it was looked
    overlap     ///< one is in the other, or nearer than the clearance, all the time but for its ends
  } kind = Kind::undecided;
  double from = 0, to = 1;
  double within = 0;  ///< of either end, at most: they are clear of each other before from - within and after to + within

  // Where and how badly; known once MotionReport::stage says so, of overlaps and contacts.
  double worst_time = 0;                                   ///< when the contour is longest, of such moments the deepest
  Eigen::AlignedBox3d worst_box_mm;                        ///< then, around the contour or the deepest place; in the scene
  std::vector<std::array<Eigen::Vector3d, 2>> contour_mm;  ///< pieces of the curve in which the surfaces then cross, in the scene
  double contour_length_mm = 0;
  double depth_mm = 0;         ///< then: a point of one is at least so deep in the other
  double distance_mm = 0;      ///< then: of the surfaces
  double intersection_mm = 0;  ///< length of the contour integrated over the interval: Eq. 1 of the paper, theory.md (112)

  /// Whether nothing worse is known of an overlap than that bodies are nearer than a clearance, or touch.
  bool only_near(double clearance_mm) const { return clearance_mm > 0 && depth_mm < 1e-3 * clearance_mm; }
};

/// Two parts in a transition.
struct PairMotion {
  std::size_t transition = 0;
  std::size_t first = 0, second = 0;         ///< parts, first < second
  double clearance_mm = 0;                   ///< that was asked of them
  std::vector<CollisionInterval> intervals;  ///< ascending; none: clear of each other all the time
  bool overlaps() const;
};

struct MotionReport {
  enum class Stage {
    coarse,   ///< by boxes alone: intervals are too long
    when,     ///< being sharpened
    complete  ///< with where and how badly
  } stage = Stage::coarse;
  std::vector<PairMotion> pairs;  ///< that were tested, by transition and parts
  std::size_t kept = 0;           ///< of them, whose answer was known from before
  std::size_t moments = 0;        ///< at which bodies were looked at, for the others
  bool free() const;              ///< no pair overlaps; contacts count as free
};

struct MotionCheckOptions {
  /// Share of a transition. No overlap that lasts longer is missed: all that is not told is proven to be clear. Ends of overlaps
  /// are found to half of it, but where bodies only touch there.
  double tolerance = 1e-3;
  /// How near is touching, over the diagonal of the smaller part's box. What touches all the time need not overlap.
  double touch = 1e-5;
  std::optional<double> clearance_mm;  ///< in place of the scene's; those of its pairs stay
  /// Called with what is known so far from the thread that called, each time it has become sharper by a factor of four.
  std::function<void(const MotionReport&)> found;
};

/// Looks for collisions, and keeps what it has found: where a scene is given again after an edit, only what that touches is looked
/// at again. Meshes count as the same where they are the same object.
class MotionChecker {
public:
  MotionChecker();
  ~MotionChecker();
  MotionChecker(MotionChecker&&) noexcept;
  MotionChecker& operator=(MotionChecker&&) noexcept;

  /// For each transition and each pair of parts that may not touch the intervals in which they are not clear of each other,
  /// theory.md (110). Progressive: the longest undecided interval first. The same answer for any number of threads, and whatever
  /// was kept.
  /// @param scene  its meshes closed, see check_mesh
  /// @throws Error{usage} for a tolerance that is not between 1e-7 and 0.5; Error{interrupted}
  MotionReport check(const Scene& scene, const MotionCheckOptions& options = {}, const Progress& progress = {});

private:
  struct Kept;
  std::unique_ptr<Kept> kept_;
};

}  // namespace rayrep
