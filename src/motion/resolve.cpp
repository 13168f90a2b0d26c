#include "rayrep/motion/resolve.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <set>
#include <utility>

#include "base/text.h"
#include "motion/pair_timeline.h"

namespace rayrep {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using Kind = Freedom::Kind;

constexpr double kTimeApart = 1e-3;

Eigen::Quaterniond turned(const Vector3d& by) {
  const double angle = by.norm();
  return Eigen::Quaterniond(angle > 0 ? Eigen::AngleAxisd(angle, by / angle) : Eigen::AngleAxisd::Identity());
}

template <typename Key>
void move_time(std::vector<Key>& keys, std::size_t n, double by) {
  const double lo = keys[n - 1].time + kTimeApart, hi = keys[n + 1].time - kTimeApart;
  if (lo < hi) keys[n].time = std::clamp(keys[n].time + by, lo, hi);
}

void shift(TranslationKey& key, const Vector3d& by) {
  for (Vector3d* p : {&key.at_mm, &key.in_mm, &key.out_mm}) *p += by;
}

/// Motion of a rigid body at a moment: a point y moves by v + w x y.
struct Twist {
  Vector3d v = Vector3d::Zero(), w = Vector3d::Zero();
};

/// Of a part at a time, for one unit of a freedom; theory.md (115).
Twist twist_of(const Scene& scene, std::size_t transition, double time, const Freedom& freedom, int axis) {
  if (freedom.kind != Kind::rest && freedom.transition != transition) return {};
  const double step = freedom.kind == Kind::translation || freedom.kind == Kind::rest ? 1e-3 : 1e-6;
  const Vector3d by = step * Vector3d::Unit(axis);
  const auto pose = [&](const Vector3d& amount) {
    Scene one;
    one.states = scene.states;
    one.transitions = {scene.transitions[transition]};
    Freedom there = freedom;
    there.transition = 0;
    return moved_by(one, there, amount).transitions[0].motions[freedom.part].at(time);
  };
  const PartPose less = pose(-by), more = pose(by);
  const Eigen::AngleAxisd turn(more.rotation * less.rotation.conjugate());
  Twist twist;
  const double angle = turn.angle() > std::numbers::pi ? turn.angle() - 2 * std::numbers::pi : turn.angle();
  twist.w = angle / (2 * step) * turn.axis();
  const Vector3d moved = (more.translation_mm - less.translation_mm) / (2 * step);
  const Vector3d centre = scene.parts[freedom.part].pivot_mm + (more.translation_mm + less.translation_mm) / 2;
  twist.v = moved - twist.w.cross(centre);
  return twist;
}

/// How a contour's length changes at a moment as the second body moves: force . v + torque . w.
struct Wrench {
  double time = 0, weight = 0;
  Vector3d force = Vector3d::Zero(), torque = Vector3d::Zero();
};

/// An end of a piece where a side (along e) meets a triangle (normal n) goes along with the motion d of the second body by
/// d - e (n.d) / (n.e) if the side is that body's, else by e (n.d) / (n.e).
void add_end(const ContourPiece::End& end, const Vector3d& direction, const Isometry3d& to_scene, Wrench& wrench) {
  const double across = end.normal.dot(end.along);
  if (!(std::abs(across) > 1e-12 * end.normal.norm() * end.along.norm())) return;
  const Vector3d slide = end.normal * (end.along.dot(direction) / across);
  const Vector3d force = to_scene.linear() * (end.moved_side ? Vector3d(direction - slide) : slide);
  wrench.force += force;
  wrench.torque += (to_scene * end.at_mm).cross(force);
}

Wrench wrench_at(const MovingBody& first, const MovingBody& second, double time) {
  Wrench wrench;
  wrench.time = time;
  const Isometry3d scene = first.at(time);
  for (const ContourPiece& piece : contour(*first.body, *second.body, scene.inverse() * second.at(time))) {
    const double length = piece.length_mm();
    if (!(length > 0)) continue;
    const Vector3d direction = (piece.ends[1].at_mm - piece.ends[0].at_mm) / length;
    add_end(piece.ends[0], -direction, scene, wrench);
    add_end(piece.ends[1], direction, scene, wrench);
  }
  return wrench;
}

/// Bodies of a scene's parts, made once.
class Bodies {
public:
  explicit Bodies(const Scene& scene) {
    for (const ScenePart& part : scene.parts) {
      bodies_.push_back(std::make_shared<SolidBody>(part.mesh));
      bodies_.back()->prepare();
    }
  }
  MovingBody moving(const Scene& scene, std::size_t transition, std::size_t part) const {
    return {bodies_[part].get(), &scene.transitions[transition].motions[part], scene.parts[part].pivot_mm};
  }
  const SolidBody& operator[](std::size_t part) const { return *bodies_[part]; }

private:
  std::vector<std::shared_ptr<SolidBody>> bodies_;
};

/// At the moments by which (112) is integrated.
std::vector<Wrench> wrenches(const Scene& scene, const Bodies& bodies, const PairMotion& pair, const CollisionInterval& overlap) {
  constexpr int kMoments = 12;
  const double half = (overlap.to - overlap.from) / 2, centre = (overlap.to + overlap.from) / 2;
  std::vector<Wrench> all;
  for (int n = 1; n <= kMoments; ++n) {
    const double angle = std::numbers::pi * n / (kMoments + 1);
    all.push_back(wrench_at(bodies.moving(scene, pair.transition, pair.first), bodies.moving(scene, pair.transition, pair.second),
                            centre - half * std::cos(angle)));
    all.back().weight = half * std::numbers::pi / (kMoments + 1) * std::sin(angle);
  }
  return all;
}

Vector3d slope_of(const Scene& scene, const PairMotion& pair, const std::vector<Wrench>& all, const Freedom& freedom) {
  Vector3d slope = Vector3d::Zero();
  if (freedom.part != pair.first && freedom.part != pair.second) return slope;
  const double sign = freedom.part == pair.second ? 1 : -1;
  for (int axis = 0; axis < freedom.size(); ++axis)
    for (const Wrench& wrench : all) {
      const Twist twist = twist_of(scene, pair.transition, wrench.time, freedom, axis);
      slope[axis] += sign * wrench.weight * (wrench.force.dot(twist.v) + wrench.torque.dot(twist.w));
    }
  return slope;
}

/// mm that a unit of a freedom moves something, about.
double unit_of(const Scene& scene, const Bodies& bodies, const Freedom& freedom) {
  if (freedom.kind == Kind::translation || freedom.kind == Kind::rest) return 1;
  const double reach = bodies[freedom.part].reach_mm(scene.parts[freedom.part].pivot_mm);
  if (freedom.kind == Kind::rotation) return std::max(reach, 1e-9);
  return std::max(Travel(scene.transitions[freedom.transition].motions[freedom.part], reach).whole(), 1e-9);
}

double severity(const PairMotion& pair) {
  double sum = 0;
  for (const CollisionInterval& i : pair.intervals)
    // Of what has no contour at least how long it lasts counts, a little of what only touches, too: it is better clear.
    sum += i.kind == CollisionInterval::Kind::overlap ? i.intersection_mm + 1e-3 * (i.to - i.from) : 1e-4 * (i.to - i.from);
  return sum;
}

using PairNames = std::set<std::array<std::size_t, 3>>;
PairNames overlapping(const MotionReport& report) {
  PairNames names;
  for (const PairMotion& pair : report.pairs)
    if (pair.overlaps()) names.insert({pair.transition, pair.first, pair.second});
  return names;
}

const PairMotion* same_pair(const MotionReport& report, const PairMotion& pair) {
  for (const PairMotion& other : report.pairs)
    if (other.transition == pair.transition && other.first == pair.first && other.second == pair.second) return &other;
  return nullptr;
}

bool is_at_rest(const Scene& scene, std::size_t transition, std::size_t part) {
  return Travel(scene.transitions[transition].motions[part], 1).whole() == 0;
}

/// A scene on its way to be free.
class Descent {
public:
  Descent(const Scene& scene, const ResolveOptions& options, const Progress& progress)
      : options_(options), progress_(progress), bodies_(scene), now_{scene, checker_.check(scene, options.check, progress)} {
    for (const std::string& name : options.parts) allowed_.insert(scene.part(name));
  }

  struct Place {
    Scene scene;
    MotionReport report;
  };
  const Place& now() const { return now_; }

  std::vector<Freedom> freedoms(const PairMotion& pair) const {
    std::vector<Freedom> all = freedoms_of(now_.scene);
    std::erase_if(all, [&](const Freedom& f) {
      const bool of_pair = f.part == pair.first || f.part == pair.second;
      const bool of_way = f.kind == Kind::rest || f.transition == pair.transition;
      const bool of_times = f.kind == Kind::time || f.kind == Kind::turn_time;
      const std::size_t other = f.part == pair.first ? pair.second : pair.first;
      // Past what is at rest it is the same way, sooner or later.
      if (of_pair && of_way && of_times && is_at_rest(now_.scene, pair.transition, other)) return true;
      return !of_pair || !of_way || (!allowed_.empty() && !allowed_.contains(f.part));
    });
    return all;
  }

  /// Moves freedoms against their slopes for the pair, as far as that lessens its severity and frees what is free.
  /// @returns the place reached; none: no step helps
  std::optional<Place> step(const PairMotion& pair, const std::vector<Freedom>& along) {
    std::vector<Vector3d> moves(along.size(), Vector3d::Zero());
    double norm2 = 0;
    for (const CollisionInterval& interval : pair.intervals) {
      if (interval.kind != CollisionInterval::Kind::overlap) continue;
      const std::vector<Wrench> all = wrenches(now_.scene, bodies_, pair, interval);
      for (std::size_t n = 0; n < along.size(); ++n) moves[n] -= slope_of(now_.scene, pair, all, along[n]);
    }
    for (std::size_t n = 0; n < along.size(); ++n) {
      const double unit = unit_of(now_.scene, bodies_, along[n]);
      moves[n] /= unit;  // slope by mm
      norm2 += moves[n].squaredNorm();
      moves[n] /= unit;  // mm into units
    }
    if (!(norm2 > 0)) return std::nullopt;
    double deepest = 0;
    for (const CollisionInterval& interval : pair.intervals) deepest = std::max(deepest, interval.depth_mm);
    const double furthest = bodies_[pair.first].diagonal_mm() + bodies_[pair.second].diagonal_mm();
    return search(pair, along, moves, {std::max(deepest, 1e-3) / std::sqrt(norm2) / 8, furthest / std::sqrt(norm2)});
  }

  void take(Place place) { now_ = std::move(place); }

private:
  struct Lengths {
    double shortest, longest;
  };

  bool keeps_what_is_free(const MotionReport& report) const {
    const PairNames before = overlapping(now_.report), after = overlapping(report);
    return std::includes(before.begin(), before.end(), after.begin(), after.end());
  }

  /// The least of lengths that double, and then the least of those in between.
  std::optional<Place> search(const PairMotion& pair, const std::vector<Freedom>& along, const std::vector<Vector3d>& moves,
                              const Lengths& lengths) {
    std::optional<Place> best;
    double least = severity(pair), best_length = 0;
    const auto attempt = [&](double factor) {
      Scene scene = now_.scene;
      for (std::size_t n = 0; n < along.size(); ++n) scene = moved_by(scene, along[n], factor * moves[n]);
      MotionReport report = checker_.check(scene, options_.check, progress_);
      const PairMotion* after = same_pair(report, pair);
      const double left = after ? severity(*after) : 0;
      if (left >= least * (1 - 1e-6) || !keeps_what_is_free(report)) return false;
      least = left;
      best_length = factor;
      best = Place{std::move(scene), std::move(report)};
      return true;
    };
    for (double factor = lengths.shortest; factor <= lengths.longest; factor *= 2) {
      const bool better = attempt(factor);
      if (best && (!better || least == 0)) break;
    }
    // Free, and with as small a move as that takes.
    for (int n = 0; n < 4 && best && least == 0; ++n) {
      const double shorter = best_length * (n == 0 ? 0.75 : 0.9);
      least = 1e-300;
      const double kept = best_length;
      if (!attempt(shorter)) {
        best_length = kept;
        break;
      }
    }
    return best;
  }

  const ResolveOptions& options_;
  const Progress& progress_;
  Bodies bodies_;
  MotionChecker checker_;
  std::set<std::size_t> allowed_;
  Place now_;
};

/// By how much a freedom differs in two scenes.
Vector3d amount_between(const Scene& from, const Scene& to, const Freedom& freedom) {
  const Motion &a = from.transitions[freedom.transition].motions[freedom.part],
               &b = to.transitions[freedom.transition].motions[freedom.part];
  const std::size_t k = freedom.key;
  switch (freedom.kind) {
    case Kind::translation:
    case Kind::rest:
      return b.translation[k].at_mm - a.translation[k].at_mm;
    case Kind::time:
      return (b.translation[k].time - a.translation[k].time) * Vector3d::UnitX();
    case Kind::turn_time:
      return (b.rotation[k].time - a.rotation[k].time) * Vector3d::UnitX();
    case Kind::rotation:
      break;
  }
  const Eigen::AngleAxisd turn(b.rotation[k].rotation * a.rotation[k].rotation.conjugate());
  return turn.angle() * turn.axis();
}

}  // namespace

std::vector<Freedom> freedoms_of(const Scene& scene) {
  std::vector<Freedom> all;
  for (std::size_t t = 0; t < scene.transitions.size(); ++t)
    for (std::size_t p = 0; p < scene.parts.size(); ++p) {
      const Motion& motion = scene.transitions[t].motions[p];
      for (std::size_t k = 1; k + 1 < motion.translation.size(); ++k)
        for (const Kind kind : {Kind::translation, Kind::time}) all.push_back({kind, p, t, k});
      for (std::size_t k = 1; k + 1 < motion.rotation.size(); ++k)
        for (const Kind kind : {Kind::rotation, Kind::turn_time}) all.push_back({kind, p, t, k});
    }
  for (std::size_t p = 0; p < scene.parts.size(); ++p) all.push_back({Kind::rest, p, 0, 0});
  return all;
}

std::string words_of(const Scene& scene, const Freedom& freedom) {
  const std::string& part = scene.parts[freedom.part].name;
  if (freedom.kind == Kind::rest) return part + ", everywhere";
  const Transition& transition = scene.transitions[freedom.transition];
  const Motion& motion = transition.motions[freedom.part];
  const bool turns = freedom.kind == Kind::rotation || freedom.kind == Kind::turn_time;
  const double time = turns ? motion.rotation[freedom.key].time : motion.translation[freedom.key].time;
  return part + " on the way " + transition.name + ", " + (turns ? "attitude" : "place") + " at " + shown(time, 4);
}

Scene moved_by(const Scene& scene, const Freedom& freedom, const Vector3d& amount) {
  Scene moved = scene;
  if (freedom.kind == Kind::rest) {
    for (SceneState& state : moved.states) state.poses[freedom.part].translation_mm += amount;
    for (Transition& transition : moved.transitions)
      for (TranslationKey& key : transition.motions[freedom.part].translation) shift(key, amount);
    return moved;
  }
  Motion& motion = moved.transitions[freedom.transition].motions[freedom.part];
  if (freedom.kind == Kind::translation) shift(motion.translation[freedom.key], amount);
  if (freedom.kind == Kind::time) move_time(motion.translation, freedom.key, amount[0]);
  if (freedom.kind == Kind::turn_time) move_time(motion.rotation, freedom.key, amount[0]);
  if (freedom.kind == Kind::rotation) {
    Eigen::Quaterniond& rotation = motion.rotation[freedom.key].rotation;
    rotation = (turned(amount) * rotation).normalized();
  }
  return moved;
}

Scene with_middle_keys(const Scene& scene) {
  Scene more = scene;
  for (Transition& transition : more.transitions)
    for (Motion& motion : transition.motions) {
      if (motion.translation.size() != 2 || motion.translation[0].at_mm == motion.translation[1].at_mm) continue;
      TranslationKey &a = motion.translation[0], &b = motion.translation[1];
      // The curve cut in two (de Casteljau).
      const Vector3d ab = (a.at_mm + a.out_mm) / 2, bc = (a.out_mm + b.in_mm) / 2, cd = (b.in_mm + b.at_mm) / 2;
      TranslationKey middle{
          .time = (a.time + b.time) / 2, .at_mm = (ab + 2 * bc + cd) / 4, .in_mm = (ab + bc) / 2, .out_mm = (bc + cd) / 2};
      a.out_mm = ab;
      b.in_mm = cd;
      motion.translation.insert(motion.translation.begin() + 1, middle);
    }
  return more;
}

Vector3d slope(const Scene& scene, const PairMotion& pair, const CollisionInterval& overlap, const Freedom& freedom) {
  return slope_of(scene, pair, wrenches(scene, Bodies(scene), pair, overlap), freedom);
}

std::vector<Hint> hints(const Scene& scene, const ResolveOptions& options, const Progress& progress) {
  Descent descent(with_middle_keys(scene), options, progress);
  std::vector<Hint> all;
  for (const PairMotion& pair : descent.now().report.pairs) {
    if (!pair.overlaps()) continue;
    std::vector<Hint> of_pair;
    for (const Freedom& freedom : descent.freedoms(pair)) {
      const auto place = descent.step(pair, {freedom});
      if (!place) continue;
      const PairMotion* after = same_pair(place->report, pair);
      Hint hint{.freedom = freedom, .transition = pair.transition, .first = pair.first, .second = pair.second};
      hint.before_mm = severity(pair);
      hint.after_mm = after ? severity(*after) : 0;
      hint.frees = !after || !after->overlaps();
      hint.amount = amount_between(descent.now().scene, place->scene, freedom);
      // What helps by very little is no help.
      if (hint.frees || hint.after_mm < 0.9 * hint.before_mm) of_pair.push_back(hint);
    }
    std::stable_sort(of_pair.begin(), of_pair.end(), [](const Hint& a, const Hint& b) {
      if (a.frees != b.frees) return a.frees;
      return a.after_mm < b.after_mm;
    });
    all.insert(all.end(), of_pair.begin(), of_pair.end());
  }
  return all;
}

Resolved resolve(const Scene& scene, const ResolveOptions& options, const Progress& progress) {
  Descent descent(with_middle_keys(scene), options, progress);
  Resolved result;
  PairNames stuck;
  while (result.steps < options.steps) {
    const PairMotion* worst = nullptr;
    for (const PairMotion& pair : descent.now().report.pairs)
      if (pair.overlaps() && !stuck.contains({pair.transition, pair.first, pair.second}) &&
          (!worst || severity(pair) > severity(*worst)))
        worst = &pair;
    if (!worst) break;
    const PairMotion pair = *worst;
    if (auto place = descent.step(pair, descent.freedoms(pair))) {
      descent.take(std::move(*place));
      ++result.steps;
    } else {
      stuck.insert({pair.transition, pair.first, pair.second});
    }
  }
  result.scene = descent.now().scene;
  result.report = descent.now().report;
  return result;
}

}  // namespace rayrep
