#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

#include "rayrep/base/progress.h"
#include "rayrep/motion/motion_check.h"
#include "rayrep/motion/scene.h"

// How parts get out of each other's way: what of a scene may be moved, and where to. theory.md (115)

namespace rayrep {

/// Something of a scene that may be moved.
struct Freedom {
  enum class Kind {
    translation,  ///< a key's place with its handles, mm
    rotation,     ///< a key's attitude, turned about its pivot, rad
    time,         ///< of a key of the translation; between its neighbours
    turn_time,    ///< of a key of the rotation
    rest          ///< the part's place in all states and on all ways, mm
  } kind = Kind::translation;
  std::size_t part = 0;
  std::size_t transition = 0;  ///< not of rest
  std::size_t key = 0;         ///< likewise
  int size() const { return kind == Kind::time || kind == Kind::turn_time ? 1 : 3; }
};

/// All there are: keys between the ends, which are those of the states, and the rest of each part.
std::vector<Freedom> freedoms_of(const Scene& scene);

/// For people: "arm on the way fold, key at 0.5: where it is".
std::string words_of(const Scene& scene, const Freedom& freedom);

/// The scene with one of them moved. Times stay 1e-3 away from those of their neighbours.
Scene moved_by(const Scene& scene, const Freedom& freedom, const Eigen::Vector3d& amount);

/// The scene with a key of the translation in the middle of each way of a part that moves and has none between its ends. The ways
/// are the same.
Scene with_middle_keys(const Scene& scene);

/// The derivative of an overlap's (112) by a freedom: from how its contour's length changes as the parts move, moment by moment,
/// and the chain rule (Eq. 2 and 3 of the Reconfigurables paper).
Eigen::Vector3d slope(const Scene& scene, const PairMotion& pair, const CollisionInterval& overlap, const Freedom& freedom);

/// What one freedom alone can do for a pair that overlaps.
struct Hint {
  Freedom freedom;
  std::size_t transition = 0, first = 0, second = 0;  ///< the pair
  Eigen::Vector3d amount = Eigen::Vector3d::Zero();   ///< the smallest move found that does most
  double before_mm = 0, after_mm = 0;                 ///< (112) of the pair
  bool frees = false;                                 ///< the pair then overlaps no more
};

struct ResolveOptions {
  MotionCheckOptions check;
  std::vector<std::string> parts;  ///< that may be moved; empty: all
  int steps = 60;                  ///< at most
};

/// For each pair that overlaps what each freedom of its parts can do, the best first.
std::vector<Hint> hints(const Scene& scene, const ResolveOptions& options = {}, const Progress& progress = {});

struct Resolved {
  Scene scene;
  MotionReport report;  ///< of it
  int steps = 0;
};

/// Moves what may be moved down the slope of (112), the worst pair first, until nothing overlaps or no step helps. What was free
/// stays free: a step after which a pair overlaps that did not before is not taken.
/// @throws Error{input} for a part that is not in the scene; Error{interrupted}
Resolved resolve(const Scene& scene, const ResolveOptions& options = {}, const Progress& progress = {});

}  // namespace rayrep
