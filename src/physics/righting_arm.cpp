#include "rayrep/physics/righting_arm.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "base/linear_algebra.h"
#include "base/text.h"
#include "physics/attitude.h"
#include "physics/clipped_hull.h"
#include "physics/prepared_hull.h"
#include "rayrep/base/error.h"

namespace rayrep {
namespace {

using End = RightingCurve::End;

constexpr double kPi = std::numbers::pi;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kNear = 1e-3;           // rad: what turns over within the first or last step is told by the arm so near its end
constexpr double kUpsideDownArm = 1e-5;  // over the hull's diagonal: less is that of facets, as in floating_rest
constexpr double kAsGood = 0.999;  // of the smallest range: a direction with so much is not followed, as the other side of a boat
constexpr double kPockets = 1e-3;  // over the displaced volume: less is folds of a figure, not a vessel

// How far a body rights itself.
struct Stability {
  double heel = 0;
  double area = 0;
  End end = End::none;
};

// A body on its way over, from heel to heel.
class Heeling {
public:
  Heeling(const FloatingBody& body, const RightingOptions& options)
      : up_(body.up.normalized()),
        hull_(body.hull.state().clipped_along(up_)),
        volume_(body.volume_mm3),
        centre_of_mass_(body.centre_of_mass_mm - hull_.centre()),
        tolerance_(options.tolerance_rad) {
    if (hull_.most_in_pockets() < kPockets * volume_) hull_.leave_pockets_wet();
    now_ = at(0);
    if (!now_)
      throw Error(ErrorCode::goal, concat("A body that has to displace ", volume_ / 1000, " cm3 sinks before it is heeled."));
    hull_.record_wet(now_->attitude.offset);
    upright_energy_ = now_->attitude.energy;
    vessel_ = now_->attitude.dry_points;
  }

  // The horizontal direction that it leans to most easily: across the axis of the smallest metacentric height.
  Eigen::Vector3d weakest_side() const {
    const Eigen::Vector2d weakest = symmetric_eigen(now_->attitude.hessian).vectors.col(0);
    return now_->attitude.frame.u * weakest.x() + now_->attitude.frame.v * weakest.y();
  }

  // Before the first heel: which side goes down.
  void lower(const Eigen::Vector3d& side) {
    raised_ = (up_.dot(side) * up_ - side).normalized();
    now_->arm = arm_of(now_->attitude, raised_);
  }
  Eigen::Vector3d lowered() const { return -raised_; }

  // Of the present heel; NaN once it has sunk.
  double arm() const { return now_ ? now_->arm : kNaN; }
  const std::optional<Stability>& range() const { return range_; }
  bool falls_short() const { return range_ && range_->end != End::none; }

  // On to the next heel.
  void turn_to(double heel) {
    if (!now_) return;
    std::optional<Heeled> next = at(heel);
    while (floods(next)) {
      take_water(heel);
      if (!now_) return;
      next = at(heel);
    }
    if (!range_ && look_back(*next)) next = at(heel);  // the hull is where it was looked at last
    now_ = std::move(next);
    hull_.record_wet(now_->attitude.offset);
  }

private:
  struct Heeled {
    double heel;
    Attitude attitude;
    double arm;
  };

  std::optional<Heeled> at(double heel) {
    const Eigen::Vector3d up = std::cos(heel) * up_ + std::sin(heel) * raised_;
    const Eigen::Vector3d onwards = std::cos(heel) * raised_ - std::sin(heel) * up_;  // d up / d heel
    const double guess = now_ ? up.dot(now_->attitude.centre_of_flotation) : kNaN;
    std::optional<Attitude> a = attitude(hull_, volume_, centre_of_mass_, up, guess);
    if (!a) return std::nullopt;
    const double arm = arm_of(*a, onwards);
    return Heeled{heel, std::move(*a), arm};
  }

  static double arm_of(const Attitude& a, const Eigen::Vector3d& onwards) {
    return onwards.dot(a.frame.u * a.gradient.x() + a.frame.v * a.gradient.y());
  }

  // Whether water has come into any pocket since the present heel. Asks the hull: at the heel that was looked at last.
  bool floods(const std::optional<Heeled>& there) const {
    return !there || hull_.reaches_any(now_->attitude.dry_points, there->attitude.offset);
  }

  void end_at(const Heeled& there, End how) { range_ = {there.heel, there.attitude.energy - upright_energy_, how}; }

  bool turns_over(const Heeled& there) const { return there.arm <= (there.heel < kPi ? 0 : -kUpsideDownArm * hull_.diagonal()); }

  // Whether it has turned over since the present heel, and where. Returns whether other heels were looked at.
  bool look_back(const Heeled& there) {
    const bool turned_over = turns_over(there);
    if (!turned_over && there.heel < kPi) return false;
    const std::optional<Heeled> almost = turned_over ? there : at(kPi - kNear);
    if (almost && turns_over(*almost))
      find_vanishing_heel(*almost);
    else
      end_at(there, End::none);
    return true;
  }

  // On to the heel, at most `heel`, at which water comes over a rim, and lets it in.
  void take_water(double heel) {
    Heeled dry = *now_;
    double wet = heel;
    while (wet - dry.heel > tolerance_) {
      const double halfway = (dry.heel + wet) / 2;
      std::optional<Heeled> there = at(halfway);
      if (floods(there))
        wet = halfway;
      else
        dry = std::move(*there);
    }
    if (!range_ && turns_over(dry)) find_vanishing_heel(dry);
    now_ = at(wet);
    const bool into_vessel = !now_ || hull_.reaches_any(vessel_, now_->attitude.offset);
    if (!range_ && into_vessel) end_at(dry, End::takes_water);
    if (now_) {
      hull_.record_wet(now_->attitude.offset);
      now_ = at(wet);
    }
    if (!now_) return;
    // What the energy falls by here is no work of the arms.
    upright_energy_ += now_->attitude.energy - dry.attitude.energy;
    if (!range_ && turns_over(*now_)) end_at(*now_, End::turns_over);
  }

  // Between the present heel and one at which it turns over: the Illinois method, until its next step would be within the
  // tolerance.
  void find_vanishing_heel(const Heeled& beyond) {
    std::optional<Heeled> lo = now_->heel > 0 ? now_ : at(kNear);
    if (!lo || lo->arm <= 0) {
      range_ = {0, 0, End::turns_over};
      return;
    }
    Heeled hi = beyond;
    double at_lo = lo->arm;
    double at_hi = std::min(hi.arm, 0.);
    int kept = 0;  // the end that the last step has left: -1 or 1
    while (at_hi < 0 && hi.heel - lo->heel > tolerance_) {
      const double slope = (lo->arm - std::min(hi.arm, 0.)) / (hi.heel - lo->heel);
      if (std::min(lo->arm, -hi.arm) <= slope * tolerance_) break;
      std::optional<Heeled> middle = at(lo->heel + at_lo / (at_lo - at_hi) * (hi.heel - lo->heel));
      if (!middle) break;
      if (middle->arm > 0) {
        lo = std::move(middle);
        at_lo = lo->arm;
        if (kept == 1) at_hi /= 2;
        kept = 1;
      } else {
        hi = std::move(*middle);
        at_hi = hi.arm;
        if (kept == -1) at_lo /= 2;
        kept = -1;
      }
    }
    end_at(lo->arm < -hi.arm ? *lo : hi, End::turns_over);
  }

  Eigen::Vector3d up_;
  ClippedHull hull_;
  double volume_;
  Eigen::Vector3d centre_of_mass_;  // from the hull's centre
  Eigen::Vector3d raised_ = Eigen::Vector3d::Zero();
  double tolerance_;
  double upright_energy_ = 0;  // with all that floodings have changed it by
  std::vector<int> vessel_;    // points of pockets that are dry upright
  std::optional<Heeled> now_;
  std::optional<Stability> range_;
};

double heel_at(int step, const RightingOptions& options) { return kPi * step / options.steps; }

// Up to which heel it rights itself; none: to the last of these, as far as the arms there tell.
std::optional<double> range_within(Heeling heeling, std::initializer_list<double> heels) {
  for (const double heel : heels) {
    heeling.turn_to(heel);
    if (heeling.falls_short()) return heeling.range()->heel;
  }
  return std::nullopt;
}

void find_largest(RightingCurve& curve) {
  for (std::size_t k = 0; k < curve.heel_rad.size() && curve.heel_rad[k] <= curve.range_rad; ++k)
    if (curve.arm_mm[k] > curve.arm_mm[curve.largest]) curve.largest = k;
}

RightingCurve follow(Heeling heeling, const RightingOptions& options) {
  RightingCurve curve;
  curve.lowered = heeling.lowered();
  for (int step = 0; step <= options.steps; ++step) {
    if (step > 0) heeling.turn_to(heel_at(step, options));
    curve.heel_rad.push_back(heel_at(step, options));
    curve.arm_mm.push_back(heeling.arm());
  }
  curve.range_rad = heeling.range()->heel;
  curve.end = heeling.range()->end;
  curve.area_mm_rad = heeling.range()->area;
  find_largest(curve);
  return curve;
}

}  // namespace

RightingCurve righting_curve(const FloatingBody& body, const Eigen::Vector3d& lowered, const RightingOptions& options) {
  Heeling heeling(body, options);
  heeling.lower(lowered);
  return follow(std::move(heeling), options);
}

RightingCurve weakest_righting_curve(const FloatingBody& body, const RightingOptions& options) {
  RightingOptions rough = options;
  rough.tolerance_rad = kNear;
  const Heeling upright(body, rough);
  const Eigen::Vector3d up = body.up.normalized();
  const Eigen::Vector3d first = upright.weakest_side();
  const auto side = [&](std::size_t n) -> Eigen::Vector3d {
    const double azimuth = 2 * kPi * static_cast<double>(n) / options.directions;
    return std::cos(azimuth) * first + std::sin(azimuth) * up.cross(first);
  };
  const auto towards = [&](std::size_t n) {
    Heeling heeling = upright;
    heeling.lower(side(n));
    return heeling;
  };
  std::vector<std::optional<double>> ranges(static_cast<std::size_t>(std::max(options.directions, 1)));
  ranges[0] = range_within(towards(0), {kPi / 4, kPi / 2, kPi * 3 / 4, kPi});
  const double range = kAsGood * ranges[0].value_or(kPi);
  tbb::parallel_for(std::size_t{1}, ranges.size(), [&](std::size_t n) {
    ranges[n] = range_within(towards(n), {range / 2, range});
  });
  std::size_t weakest = 0;
  for (std::size_t n = 1; n < ranges.size(); ++n)
    if (ranges[n] && *ranges[n] < ranges[weakest].value_or(kPi)) weakest = n;
  return righting_curve(body, side(weakest), options);
}

RightingCurve submerged_righting_curve(double depth_mm, const RightingOptions& options) {
  RightingCurve curve;
  for (int step = 0; step <= options.steps; ++step) {
    curve.heel_rad.push_back(heel_at(step, options));
    curve.arm_mm.push_back(depth_mm * std::sin(heel_at(step, options)));
  }
  if (depth_mm > 0) {
    curve.range_rad = kPi;
    curve.area_mm_rad = 2 * depth_mm;
    find_largest(curve);
  } else {
    curve.end = End::turns_over;
  }
  return curve;
}

}  // namespace rayrep
