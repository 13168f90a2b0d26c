#include "motion/pair_timeline.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <tuple>

namespace rayrep {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kLooseAtClearance = 1.01;

constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// Stretches of time below this are those of rounding.
constexpr double kShortest = 1e-11;

bool same(const std::vector<TranslationKey>& a, const std::vector<TranslationKey>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const TranslationKey& k, const TranslationKey& l) {
    return k.time == l.time && k.at_mm == l.at_mm && k.in_mm == l.in_mm && k.out_mm == l.out_mm;
  });
}

bool same(const std::vector<RotationKey>& a, const std::vector<RotationKey>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const RotationKey& k, const RotationKey& l) {
    return k.time == l.time && k.rotation.coeffs() == l.rotation.coeffs();
  });
}

bool turns(const Motion& motion) {
  return std::any_of(motion.rotation.begin(), motion.rotation.end(),
                     [&](const RotationKey& k) { return k.rotation.coeffs() != motion.rotation.front().rotation.coeffs(); });
}

CollisionInterval interval_of(CollisionInterval::Kind kind, double from, double to) {
  CollisionInterval interval;
  interval.kind = kind;
  interval.from = from;
  interval.to = to;
  return interval;
}

bool turn_alike(const MovingBody& a, const MovingBody& b) {
  return (!turns(*a.motion) && !turns(*b.motion)) || same(a.motion->rotation, b.motion->rotation);
}

/// Whether both go the same way, so that they are at rest to each other.
bool move_as_one(const MovingBody& a, const MovingBody& b) {
  if (!same(a.motion->translation, b.motion->translation) || !turn_alike(a, b)) return false;
  return !turns(*a.motion) || a.pivot_mm == b.pivot_mm;
}

/// Of the second seen from the first, at most.
Travel travel_of(const MovingBody& a, const MovingBody& b) {
  if (move_as_one(a, b)) return {};
  if (turn_alike(a, b)) return Travel::seen_from(*a.motion, *b.motion, b.pivot_mm - a.pivot_mm);
  return Travel::of_both(Travel(*a.motion, a.reach_mm()), Travel(*b.motion, b.reach_mm()));
}

}  // namespace

PairTimeline::PairTimeline(const MovingBody& first, const MovingBody& second, const Limits& limits)
    : first_(first),
      second_(second),
      limits_(limits),
      travel_(travel_of(first, second)),
      slides_(!turns(*first.motion) && !turns(*second.motion)) {
  add(0, 1, Kind::open);
}

Isometry3d PairTimeline::pose_at(double time) const { return first_.at(time).inverse() * second_.at(time); }

void PairTimeline::add(double from, double to, Kind kind) {
  if (!(to > from)) return;
  pieces_[from] = {to, kind};
  if (kind == Kind::open) open_.emplace(to - from, from);
}

void PairTimeline::by_boxes(double longest) {
  while (!open_.empty() && open_.top().first > longest) {
    const double from = open_.top().second;
    const double to = pieces_.at(from).end;
    open_.pop();
    const double middle = travel_.middle(from, to);
    const double free = apart_by_boxes(*first_.body, *second_.body, pose_at(middle)) - limits_.clearance_mm - limits_.touch_mm;
    if (!(free > 0) && travel_.at(to) <= travel_.at(from)) continue;  // at rest: nothing will change there
    const double lo = free > 0 ? travel_.earlier(middle, free, from) : middle;
    const double hi = free > 0 ? travel_.later(middle, free, to) : middle;
    add(from, lo, Kind::open);
    add(lo, hi, Kind::clear);
    add(hi, to, Kind::open);
  }
  merge_open();
}

void PairTimeline::merge_open() {
  Pieces merged;
  for (const auto& [from, piece] : pieces_) {
    const bool joins = !merged.empty() && piece.kind == Kind::open && merged.rbegin()->second.kind == Kind::open;
    if (joins)
      merged.rbegin()->second.end = piece.end;
    else
      merged[from] = piece;
  }
  pieces_ = std::move(merged);
  open_ = {};
  for (const auto& [from, piece] : pieces_)
    if (piece.kind == Kind::open) open_.emplace(piece.end - from, from);
}

void PairTimeline::refine(double longest, int moments) {
  for (int n = 0; n < moments && is_undecided(longest); ++n) {
    const double from = open_.top().second;
    open_.pop();
    refine_piece(from, pieces_.at(from).end);
  }
}

bool PairTimeline::beside_overlap(double from, double to) const {
  const auto here = pieces_.find(from);
  const bool before = here != pieces_.begin() && std::prev(here)->second.kind == Kind::overlap;
  const auto after = pieces_.find(to);
  return before || (after != pieces_.end() && after->second.kind == Kind::overlap);
}

void PairTimeline::refine_piece(double from, double to) {
  const double length = to - from;
  if (length <= kShortest || (length <= limits_.tolerance / 2 && beside_overlap(from, to))) {
    pieces_.at(from).kind = Kind::touching;
    return;
  }
  const double middle = travel_.middle(from, to);
  const double here = travel_.at(middle);
  const Answer answer = look(middle, std::max(here - travel_.at(from), travel_.at(to) - here));
  if (answer.kind == Kind::touching) {
    // At rest to each other, but for less than counts.
    if (length <= limits_.tolerance || travel_.at(to) - travel_.at(from) <= limits_.touch_mm) {
      pieces_.at(from).kind = Kind::touching;
    } else {
      add(from, middle, Kind::open);
      add(middle, to, Kind::open);
    }
    return;
  }
  const double lo = travel_.earlier(middle, answer.radius_mm, from);
  const double hi = travel_.later(middle, answer.radius_mm, to);
  if (answer.kind == Kind::clear && hi - lo < length / 2 && slides_clear(from, middle, to)) return add(from, to, Kind::clear);
  add(from, lo, Kind::open);
  add(lo, hi, answer.kind);
  add(hi, to, Kind::open);
}

/// Of two that are clear in the middle and little further by travel: by slabs between them.
bool PairTimeline::slides_clear(double from, double middle, double to) {
  if (!slides_ || to - from > slides_within_) return false;
  const Isometry3d pose = pose_at(middle);
  const Eigen::Matrix3d seen = first_.at(middle).linear().transpose();
  const Vector3d at = second_.motion->at(middle).translation_mm - first_.motion->at(middle).translation_mm;
  std::vector<Vector3d> offsets = hull_of_way(*first_.motion, *second_.motion, from, to);
  for (Vector3d& offset : offsets) offset = seen * (offset - at);
  if (keeps_apart(*first_.body, *second_.body, pose, offsets, limits_.clearance_mm + limits_.touch_mm)) return true;
  slides_within_ = (to - from) / 4;
  return false;
}

PairTimeline::Answer PairTimeline::look(double time, double ahead_mm) {
  ++moments_;
  const double clearance = limits_.clearance_mm, touch = limits_.touch_mm;
  const double rounding = 1e-3 * touch;
  const Isometry3d pose = pose_at(time);
  const double enough = 1.001 * ahead_mm + clearance + 2 * touch;
  // What is more than the clearance counts: of that no more than a part may be lost.
  const double loose = clearance > 0 ? kLooseAtClearance : kLoose;
  Nearness near = nearness(*first_.body, *second_.body, pose, enough, loose);
  const bool cross = near.at_most_mm == 0;
  if (!cross && one_holds_other(*first_.body, *second_.body, pose)) {
    if (near.at_least_mm + clearance > touch) return {Kind::overlap, near.at_least_mm + clearance - rounding};
    return look_inside(pose, ahead_mm);
  }
  if (near.at_least_mm - clearance > touch) return {Kind::clear, near.at_least_mm - clearance - rounding};
  if (clearance > 0 && !cross) near = nearness(*first_.body, *second_.body, pose, enough, 1 + 1e-6);
  if (near.at_least_mm - clearance > touch) return {Kind::clear, near.at_least_mm - clearance - rounding};
  if (!cross && clearance - near.at_most_mm > touch) return {Kind::overlap, clearance - near.at_most_mm - rounding};
  if (cross || near.at_most_mm <= touch) return look_inside(pose, ahead_mm);
  return {Kind::touching};
}

PairTimeline::Answer PairTimeline::look_inside(const Isometry3d& pose, double ahead_mm) const {
  const Depth depth =
      depth_inside(*first_.body, *second_.body, pose, {1.001 * ahead_mm + 2 * limits_.touch_mm, limits_.touch_mm / 2});
  const double radius = depth.at_least_mm + limits_.clearance_mm;
  if (radius > limits_.touch_mm) return {Kind::overlap, radius - 1e-3 * limits_.touch_mm};
  return {Kind::touching};
}

std::vector<CollisionInterval> PairTimeline::intervals() const {
  using Told = CollisionInterval::Kind;
  // What is not clear, with neighbours of a kind as one.
  std::vector<CollisionInterval> runs;
  const auto follows = [&runs](double from) { return !runs.empty() && runs.back().to == from; };
  for (const auto& [from, piece] : pieces_) {
    if (piece.kind == Kind::clear) continue;
    const Told kind = piece.kind == Kind::overlap ? Told::overlap : piece.kind == Kind::touching ? Told::contact : Told::undecided;
    if (follows(from) && runs.back().kind == kind)
      runs.back().to = piece.end;
    else
      runs.push_back(interval_of(kind, from, piece.end));
  }
  // Short contact beside an overlap is its uncertain end, or nothing between two.
  std::vector<CollisionInterval> told;
  const auto is_short = [this](const CollisionInterval& run) {
    return run.kind == Told::contact && run.to - run.from <= limits_.tolerance;
  };
  for (std::size_t n = 0; n < runs.size(); ++n) {
    CollisionInterval run = runs[n];
    const bool overlap_follows = n + 1 < runs.size() && runs[n + 1].from == run.to && runs[n + 1].kind == Told::overlap;
    const bool after_overlap = !told.empty() && told.back().kind == Told::overlap && told.back().to == run.from;
    if (is_short(run) && after_overlap && overlap_follows) {
      told.back().to = runs[++n].to;
    } else if (is_short(run) && after_overlap) {
      const double half = (run.to - run.from) / 2;
      told.back().to += half;
      told.back().within = std::max(told.back().within, half);
    } else if (is_short(run) && overlap_follows) {
      CollisionInterval overlap = runs[++n];
      overlap.within = (run.to - run.from) / 2;
      overlap.from -= overlap.within;
      told.push_back(overlap);
    } else {
      told.push_back(run);
    }
  }
  return told;
}

double PairTimeline::length_at(double time) const {
  double length = 0;
  for (const ContourPiece& piece : contour(*first_.body, *second_.body, pose_at(time))) length += piece.length_mm();
  return length;
}

/// The worst of moments with the lengths of their contours: of those that are as long as any, the deepest.
std::pair<double, double> PairTimeline::worst_of(const std::vector<std::pair<double, double>>& lengths) const {
  constexpr double kAsLong = 0.99;
  double longest = 0, deepest = -kInfinite;
  std::pair<double, double> worst = lengths.front();
  for (const auto& [time, length] : lengths) longest = std::max(longest, length);
  if (lengths.size() == 1) return worst;
  for (const auto& [time, length] : lengths) {
    if (length < kAsLong * longest) continue;
    double depth = depth_inside(*first_.body, *second_.body, pose_at(time)).at_least_mm;
    if (depth == 0) depth = -nearness(*first_.body, *second_.body, pose_at(time), kInfinite).at_most_mm;
    if (depth <= deepest) continue;
    deepest = depth;
    worst = {time, length};
  }
  return worst;
}

void PairTimeline::describe(CollisionInterval& interval) const {
  // By the rule of Gauss and Chebyshev: near its ends a contour is as long as the root of the time.
  constexpr int kMoments = 12;
  const double half = (interval.to - interval.from) / 2, centre = (interval.to + interval.from) / 2;
  std::vector<std::pair<double, double>> lengths;
  interval.intersection_mm = 0;
  const bool moves = interval.kind == CollisionInterval::Kind::overlap && travel_.whole() > 0;
  // And, without weight, where the way begins or ends in an overlap: that may be its worst.
  const int first = interval.from > interval.within ? 1 : 0;
  const int last = interval.to + interval.within < 1 ? kMoments : kMoments + 1;
  for (int n = first; moves && n <= last; ++n) {
    const double angle = std::numbers::pi * n / (kMoments + 1);
    lengths.emplace_back(std::clamp(centre - half * std::cos(angle), interval.from, interval.to), 0);
    lengths.back().second = length_at(lengths.back().first);
    interval.intersection_mm += half * std::numbers::pi / (kMoments + 1) * std::sin(angle) * lengths.back().second;
  }
  if (!moves) {
    lengths = {{centre, length_at(centre)}};
    interval.intersection_mm = 2 * half * lengths[0].second;
  }
  std::tie(interval.worst_time, interval.contour_length_mm) = worst_of(lengths);
  const Isometry3d scene = first_.at(interval.worst_time);
  const Isometry3d pose = pose_at(interval.worst_time);
  interval.worst_box_mm.setEmpty();
  interval.contour_mm.clear();
  for (const ContourPiece& piece : contour(*first_.body, *second_.body, pose)) {
    interval.contour_mm.push_back({scene * piece.ends[0].at_mm, scene * piece.ends[1].at_mm});
    for (const Vector3d& p : interval.contour_mm.back()) interval.worst_box_mm.extend(p);
  }
  const Nearness near = nearness(*first_.body, *second_.body, pose, kInfinite, 1 + 1e-6);
  const Depth depth = depth_inside(*first_.body, *second_.body, pose, {.factor = 1.01, .points = 800});
  interval.distance_mm = near.at_most_mm;
  interval.depth_mm = depth.at_least_mm;
  if (!interval.worst_box_mm.isEmpty()) return;
  if (depth.at_least_mm > 0) {
    interval.worst_box_mm.extend(scene * depth.place_mm);
  } else {
    interval.worst_box_mm.extend(scene * near.points.on_first);
    interval.worst_box_mm.extend(scene * near.points.on_second);
  }
}

}  // namespace rayrep
