#pragma once

// Scenes of bodies whose overlap is known without meshes: each is one to three boxes.

#include <algorithm>
#include <array>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "rayrep/mesh/boolean.h"
#include "rayrep/motion/motion_check.h"
#include "solids.h"

namespace rayrep::test {

inline ScenePart scene_part(const std::string& name, Mesh mesh) {
  ScenePart part;
  part.name = name;
  part.mesh = std::make_shared<const Mesh>(std::move(mesh));
  return part;
}

inline PartPose moved_by(const Eigen::Vector3d& translation_mm,
                         const Eigen::Quaterniond& rotation = Eigen::Quaterniond::Identity()) {
  return {rotation, translation_mm};
}

/// Two parts of which the second moves, straight and evenly.
inline Scene fly_by(const Mesh& first, const Mesh& second, const PartPose& from, const PartPose& to) {
  Scene scene;
  scene.parts = {scene_part("first", first), scene_part("second", second)};
  scene.states = {{"before", Eigen::Vector3d::UnitZ(), {{}, from}}, {"after", Eigen::Vector3d::UnitZ(), {{}, to}}};
  scene.transitions = {{"fly by", 0, 1, {straight_motion({}, {}), straight_motion(from, to)}}};
  return scene;
}

/// A box in a frame of its own.
struct TurnedBox {
  Eigen::Isometry3d frame;
  Eigen::Vector3d half;
};

/// By how much two boxes have to be moved at least until they are apart; negative: a bound from below of their distance. By the 15
/// axes that can separate them.
inline double box_overlap(const TurnedBox& a, const TurnedBox& b) {
  const Eigen::Matrix3d A = a.frame.linear(), B = b.frame.linear();
  const Eigen::Vector3d between = b.frame.translation() - a.frame.translation();
  std::vector<Eigen::Vector3d> axes;
  for (int i = 0; i < 3; ++i) {
    axes.push_back(A.col(i));
    axes.push_back(B.col(i));
    for (int j = 0; j < 3; ++j)
      if (const Eigen::Vector3d axis = A.col(i).cross(B.col(j)); axis.norm() > 1e-9) axes.push_back(axis.normalized());
  }
  double least = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& axis : axes) {
    const double reach = (A.transpose() * axis).cwiseAbs().dot(a.half) + (B.transpose() * axis).cwiseAbs().dot(b.half);
    least = std::min(least, reach - std::abs(axis.dot(between)));
  }
  return least;
}

using Boxes = std::vector<TurnedBox>;

inline double overlap_of(const Boxes& a, const Eigen::Isometry3d& pose_a, const Boxes& b, const Eigen::Isometry3d& pose_b) {
  double most = -std::numeric_limits<double>::infinity();
  for (const TurnedBox& p : a)
    for (const TurnedBox& q : b) most = std::max(most, box_overlap({pose_a * p.frame, p.half}, {pose_b * q.frame, q.half}));
  return most;
}

inline Mesh mesh_of(const Boxes& boxes) {
  std::vector<Mesh> meshes;
  for (const TurnedBox& one : boxes) meshes.push_back(transformed(box(-one.half, one.half), Eigen::Affine3d(one.frame)));
  return combined(meshes).mesh;
}

/// Numbers that are the same everywhere.
class Draw {
public:
  explicit Draw(unsigned seed) : engine_(seed) {}
  double number(double lo, double hi) { return lo + (hi - lo) * static_cast<double>(engine_() - engine_.min()) / 4294967295.0; }
  int count(int lo, int hi) { return lo + static_cast<int>(engine_() % static_cast<unsigned>(hi - lo + 1)); }
  Eigen::Vector3d vector(double size) { return {number(-size, size), number(-size, size), number(-size, size)}; }
  Eigen::Quaterniond rotation() {
    return Eigen::Quaterniond(number(-1, 1), number(-1, 1), number(-1, 1), number(-1, 1) + 1e-3).normalized();
  }

private:
  std::mt19937 engine_;
};

inline Boxes draw_boxes(Draw& draw) {
  Boxes boxes(static_cast<std::size_t>(draw.count(1, 3)));
  for (TurnedBox& b : boxes) {
    b.half = {draw.number(1, 12), draw.number(1, 12), draw.number(0.5, 6)};
    b.frame = Eigen::Translation3d(draw.vector(6)) * draw.rotation();
  }
  return boxes;
}

inline Motion draw_motion(Draw& draw) {
  Motion motion;
  const int moved = draw.count(2, 4), turned = draw.count(2, 4);
  for (int n = 0; n < moved; ++n) {
    const Eigen::Vector3d at = draw.vector(30);
    motion.translation.push_back({static_cast<double>(n) / (moved - 1), at, at + draw.vector(20), at + draw.vector(20)});
  }
  for (int n = 0; n < turned; ++n) motion.rotation.push_back({static_cast<double>(n) / (turned - 1), draw.rotation()});
  return motion;
}

/// A scene of two bodies, checked, against samples of what is known of its boxes. Adds to `wrong` what differs.
struct SampledScene {
  std::size_t overlapping = 0;  ///< samples
  std::size_t intervals = 0;
  std::string wrong;
};

/// How both bodies of such a scene turn.
enum class Turning { freely, alike, never };

inline SampledScene sample_scene(unsigned seed, int samples, double tolerance, Turning turning = Turning::freely) {
  Draw draw(seed);
  const Boxes a = draw_boxes(draw), b = draw_boxes(draw);
  Scene scene;
  scene.parts = {scene_part("a", mesh_of(a)), scene_part("b", mesh_of(b))};
  scene.parts[1].pivot_mm = draw.vector(5);
  scene.transitions = {{"way", 0, 0, {draw_motion(draw), draw_motion(draw)}}};
  for (Motion& motion : scene.transitions[0].motions) {
    if (turning == Turning::never) motion.rotation.resize(1);
    if (turning == Turning::alike) motion.rotation = scene.transitions[0].motions[0].rotation;
  }
  MotionCheckOptions options;
  options.tolerance = tolerance;
  const std::vector<CollisionInterval> intervals = MotionChecker().check(scene, options).pairs.at(0).intervals;
  SampledScene found;
  found.intervals = intervals.size();
  const auto& motions = scene.transitions[0].motions;
  constexpr double kTouch = 2e-3;  // mm: what the check calls touching
  int run = 0;                     // samples in a row that overlap,
  bool told = true;                // of which one lies in an overlap that was told
  for (int n = 0; n <= samples; ++n) {
    const double time = static_cast<double>(n) / samples;
    const double overlap =
        overlap_of(a, motions[0].at(time).about(scene.parts[0].pivot_mm), b, motions[1].at(time).about(scene.parts[1].pivot_mm));
    const auto in = [&](CollisionInterval::Kind kind, double more) {
      return std::any_of(intervals.begin(), intervals.end(), [&](const auto& i) {
        return i.kind == kind && time >= i.from - more * i.within && time <= i.to + more * i.within;
      });
    };
    const bool in_overlap = in(CollisionInterval::Kind::overlap, 1), in_contact = in(CollisionInterval::Kind::contact, 1);
    const std::string at = "scene " + std::to_string(seed) + ", time " + std::to_string(time) + ": ";
    if (overlap > kTouch && !in_overlap && !in_contact) found.wrong += at + "missed an overlap\n";
    if (overlap < -kTouch && in(CollisionInterval::Kind::overlap, -1)) found.wrong += at + "told an overlap that is none\n";
    if (overlap < -0.1 && in_contact) found.wrong += at + "told a contact that is none\n";
    if (overlap > kTouch) {
      ++found.overlapping;
      told = (run++ > 0 && told) || in_overlap;
    } else {
      if (run > 2 + samples * tolerance && !told) found.wrong += at + "an overlap that ends was told as a contact\n";
      run = 0;
      told = false;
    }
  }
  return found;
}

}  // namespace rayrep::test
