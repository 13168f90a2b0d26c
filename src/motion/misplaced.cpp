#include <algorithm>
#include <cmath>
#include <limits>

#include "base/text.h"
#include "mesh/reach.h"
#include "motion/travel.h"
#include "rayrep/motion/motion_check.h"
#include "rayrep/motion/scene.h"

namespace rayrep {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;
using Kind = SceneProblem::Kind;

/// Each state as a transition in which nothing moves.
Scene at_rest(const Scene& scene) {
  Scene resting = scene;
  resting.transitions.clear();
  for (std::size_t s = 0; s < scene.states.size(); ++s) {
    Transition rest{scene.states[s].name, s, s, {}};
    for (const PartPose& pose : scene.states[s].poses) rest.motions.push_back(straight_motion(pose, pose));
    resting.transitions.push_back(std::move(rest));
  }
  return resting;
}

SceneProblem overlap_problem(const Scene& scene, const PairMotion& pair, const CollisionInterval& interval) {
  SceneProblem problem{.kind = Kind::overlap, .part = scene.parts[pair.first].name, .other = scene.parts[pair.second].name};
  const std::string& state = scene.states[pair.transition].name;
  problem.where = "states, " + state;
  problem.place_mm = interval.worst_box_mm.center();
  problem.message = problem.where + ": " + problem.part + " and " + problem.other +
                    (interval.only_near(pair.clearance_mm)
                         ? " are only " + number(interval.distance_mm, 3) + " mm apart, not " + shown(pair.clearance_mm) + " mm,"
                         : " overlap, " + number(interval.depth_mm, 3) + " mm deep or more,") +
                    " around " + shown_to_thousandths(*problem.place_mm) + ".";
  return problem;
}

/// The corner that is furthest out of the room, negative: inside, and by how much.
std::pair<double, Vector3d> furthest_out(const Mesh& mesh, const Eigen::Isometry3d& pose, const AlignedBox3d& room) {
  std::pair<double, Vector3d> furthest(-std::numeric_limits<double>::infinity(), Vector3d::Zero());
  for (const Vector3d& v : mesh.vertices) {
    const Vector3d p = pose * v;
    const double out = std::max((room.min() - p).maxCoeff(), (p - room.max()).maxCoeff());
    if (out > furthest.first) furthest = {out, p};
  }
  return furthest;
}

/// Follows a part through a transition, with steps in which it cannot leave the room; where it touches that, of 1/1000.
std::optional<SceneProblem> leaving(const Scene& scene, const Transition& transition, std::size_t part) {
  const ScenePart& p = scene.parts[part];
  const Travel travel(transition.motions[part], reach_mm(*p.mesh, p.pivot_mm));
  const double allowed = 1e-5 * scene.room->diagonal().norm();
  for (double time = 0;;) {
    const auto [out, place] = furthest_out(*p.mesh, transition.motions[part].at(time).about(p.pivot_mm), *scene.room);
    if (out > allowed) {
      SceneProblem problem{.kind = Kind::leaves, .part = p.name, .other = {}, .where = transition.name, .place_mm = place};
      problem.message = "The way from " + transition.name + ": " + p.name + " leaves the room by " + number(out, 3) + " mm at " +
                        shown_to_thousandths(place) + ", at " + number(time, 3) + " of the way.";
      return problem;
    }
    if (time >= 1) return std::nullopt;
    time = std::min(1.0, std::max(travel.later(time, -out, 1), time + 1e-3));
  }
}

}  // namespace

std::vector<SceneProblem> misplaced(const Scene& scene, const Progress& progress) {
  std::vector<SceneProblem> problems;
  const Scene resting = at_rest(scene);
  for (const PairMotion& pair : MotionChecker().check(resting, {}, progress).pairs)
    for (const CollisionInterval& interval : pair.intervals)
      if (interval.kind == CollisionInterval::Kind::overlap) problems.push_back(overlap_problem(scene, pair, interval));
  if (!scene.room) return problems;
  for (const Transition& transition : scene.transitions)
    for (std::size_t part = 0; part < scene.parts.size(); ++part) {
      progress.check();
      if (auto problem = leaving(scene, transition, part)) problems.push_back(std::move(*problem));
    }
  return problems;
}

}  // namespace rayrep
