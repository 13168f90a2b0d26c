#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include "base/linear_algebra.h"
#include "base/text.h"
#include "physics/attitude.h"
#include "physics/clipped_hull.h"
#include "physics/prepared_hull.h"
#include "rayrep/base/error.h"
#include "rayrep/physics/hydrostatics.h"

namespace rayrep {
namespace {

constexpr double kLargestTurn = 0.1;     // rad: an energy barrier that a turn could jump would have to be narrower
constexpr double kNeutralArm = 1e-5;     // over the hull's diagonal: 1 micron on 100 mm
constexpr double kNeutralHeight = 1e-4;  // metacentric height over the diagonal
constexpr double kNeutralEnergy = 2e-6;  // change of energy over weight and diagonal within kProbe
constexpr double kProbe = 0.2;           // rad: wider than a facet
constexpr double kTurnToARim = 1e-4;     // rad: so near a body comes before a rim that goes under floods it

// The tilts about the two principal axes of the energy's Hessian. Along a neutral axis (a sphere, a log about its length) the
// moment left is that of the facets, and the body stays as it is; here it is marked by the moment alone.
struct Tilts {
  Eigen::Matrix2d axes;
  Eigen::Vector2d gradient;
  Eigen::Vector2d stiffness;
  bool neutral[2] = {false, false};
};

Tilts tilts(const Attitude& a, double diagonal) {
  const SymmetricEigen eigen = symmetric_eigen(a.hessian);
  Tilts t;
  t.axes = eigen.vectors;
  t.gradient = t.axes.transpose() * a.gradient;
  t.stiffness = eigen.values;
  for (int k = 0; k < 2; ++k) {
    t.neutral[k] = std::abs(t.gradient[k]) <= kNeutralArm * diagonal && std::abs(t.stiffness[k]) <= kNeutralHeight * diagonal;
  }
  return t;
}

// Minimises g.d + d.H d / 2 over |d| <= radius, along the axes that are not neutral. Between Newton's step (radius large) and
// steepest descent (radius small), it is a linearly implicit step along the path of the righting moment. Where the moment vanishes
// on a maximum or a saddle of the energy, it steps off along the direction of strongest tipping. Zero at a minimum.
Eigen::Vector2d restricted_step(const Tilts& tilts, double radius, bool* restricted) {
  const auto step = [&](double shift) {
    Eigen::Vector2d d;
    for (int k = 0; k < 2; ++k) d[k] = tilts.gradient[k] == 0 ? 0 : -tilts.gradient[k] / (tilts.stiffness[k] + shift);
    return d;
  };
  int softest = -1;  // the smallest stiffness comes first
  for (int k = 1; k >= 0; --k)
    if (!tilts.neutral[k]) softest = k;
  *restricted = false;
  if (softest < 0) return Eigen::Vector2d::Zero();
  const double least = tilts.stiffness[softest];
  if (least > 0 && step(0).norm() <= radius) return tilts.axes * step(0);

  *restricted = true;
  // |step(shift)| falls to radius or below before hi, and beyond -least it falls steadily.
  double lo = std::max(0., -least);
  double hi = lo + tilts.gradient.norm() / radius;
  for (int i = 0; i < 100; ++i) {
    const double middle = (lo + hi) / 2;
    if (middle == lo || middle == hi) break;
    (step(middle).norm() > radius ? lo : hi) = middle;
  }
  Eigen::Vector2d d = step(hi);
  if (!d.allFinite()) d.setZero();
  if (least < 0) {  // a negative curvature is followed to the full radius
    const double other = d[1 - softest];
    const double left = std::sqrt(std::max(0., radius * radius - other * other));
    if (std::abs(d[softest]) < left) d[softest] = std::copysign(left, d[softest]);
  }
  return tilts.axes * d;
}

// A body on its way to rest.
class Release {
public:
  Release(ClippedHull hull, double volume, const Eigen::Vector3d& centre_of_mass_mm, const FloatingRestOptions& options)
      : hull_(std::move(hull)), volume_(volume), centre_of_mass_(centre_of_mass_mm - hull_.centre()), options_(options) {}

  FloatingRest follow(const Eigen::Vector3d& up) {
    FloatingRest rest;
    rest.up = up;
    rest.plane.normal = up;
    std::optional<Attitude> start = attitude(hull_, volume_, centre_of_mass_, up, std::numeric_limits<double>::quiet_NaN());
    if (!start) {
      rest.outcome = FloatingRest::Outcome::sinks;
      return rest;
    }
    now_ = std::move(*start);
    hull_.record_wet(now_.offset);
    for (int turns = 0; turns < options_.max_turns && rest.outcome == FloatingRest::Outcome::did_not_rest; ++turns) turn(rest);
    rest.up = rest.plane.normal = now_.up;
    if (rest.sinks()) return rest;
    rest.plane.offset_mm = now_.offset + now_.up.dot(hull_.centre());
    rest.residual_mm = now_.gradient.norm();
    return rest;
  }

private:
  void turn(FloatingRest& rest) {
    bool restricted = false;
    const Eigen::Vector2d d = restricted_step(relevant_tilts(), radius_, &restricted);
    const double angle = d.norm();
    if (angle <= options_.tolerance_rad) rest.outcome = FloatingRest::Outcome::rests;
    if (angle == 0) return;
    const Eigen::Vector3d up = turned(d);
    std::optional<Attitude> next = attitude(hull_, volume_, centre_of_mass_, up, up.dot(now_.centre_of_flotation));
    if (!next || hull_.reaches_any(now_.dry_points, next->offset)) {
      // A rim goes under on the way. Only when it does so within a small turn the body gets there.
      if (angle > std::max(kTurnToARim, 8 * options_.tolerance_rad)) {
        radius_ = angle / 4;
        return;
      }
      rest.took_water = true;
      rest.outcome = next ? FloatingRest::Outcome::did_not_rest : FloatingRest::Outcome::sinks;
      if (next) accept(std::move(*next));
      radius_ = kLargestTurn;
      return;
    }

    // Of two energies that differ by rounding only, none is taken for an improvement: the turns shrink and end there.
    const double predicted = -(now_.gradient.dot(d) + d.dot(now_.hessian * d) / 2);
    const double agreement = (now_.energy - next->energy) / predicted;
    if (agreement > 0.1) {
      accept(std::move(*next));
      if (agreement > 0.75 && restricted) radius_ = std::min(2 * radius_, kLargestTurn);
    } else {
      radius_ = angle / 4;
    }
  }

  Eigen::Vector3d turned(const Eigen::Vector2d& d) const {
    const double angle = d.norm();
    const Eigen::Vector3d direction = (now_.frame.u * d.x() + now_.frame.v * d.y()) / angle;
    return (std::cos(angle) * now_.up + std::sin(angle) * direction).normalized();
  }

  void accept(Attitude next) {
    now_ = std::move(next);
    hull_.record_wet(now_.offset);
  }

  // The tilts about the two principal axes of the energy's Hessian, those that are neutral marked.
  Tilts relevant_tilts() {
    Tilts t = tilts(now_, hull_.diagonal());
    for (int k = 0; k < 2; ++k) {
      if (!t.neutral[k]) continue;
      t.neutral[k] = std::max(change_of_energy(kProbe * t.axes.col(k)), change_of_energy(-kProbe * t.axes.col(k))) <=
                     kNeutralEnergy * hull_.diagonal();
      if (t.neutral[k]) t.gradient[k] = 0;
    }
    return t;
  }

  double change_of_energy(const Eigen::Vector2d& d) {
    const Eigen::Vector3d up = turned(d);
    const std::optional<Attitude> there = attitude(hull_, volume_, centre_of_mass_, up, up.dot(now_.centre_of_flotation));
    return there ? std::abs(there->energy - now_.energy) : std::numeric_limits<double>::infinity();
  }

  ClippedHull hull_;
  double volume_;
  Eigen::Vector3d centre_of_mass_;  // from the hull's centre
  FloatingRestOptions options_;
  Attitude now_;
  double radius_ = kLargestTurn;
};

}  // namespace

FloatingRest floating_rest(const PreparedHull& prepared, double mass_g, const Eigen::Vector3d& centre_of_mass_mm,
                           const Eigen::Vector3d& up, const FloatingRestOptions& options) {
  ClippedHull hull = prepared.state().clipped();
  const double volume = mass_g / (options.fluid_g_cm3 * 1e-3);
  const Eigen::Vector3d direction = up.normalized();
  if (!(mass_g > 0) || !(options.fluid_g_cm3 > 0) || !(hull.volume() > 0) || !direction.allFinite() ||
      !centre_of_mass_mm.allFinite())
    throw Error(ErrorCode::input,
                concat("A body of ", mass_g, " g with a hull of ", hull.volume(), " mm3 cannot be floated in a fluid of ",
                       options.fluid_g_cm3, " g/cm3: all three must be positive, and its centre of mass and its attitude finite."));
  return Release(std::move(hull), volume, centre_of_mass_mm, options).follow(direction);
}

std::optional<FloodingHeel> flooding_heel(const PreparedHull& prepared, double volume_mm3, const Eigen::Vector3d& up,
                                          int directions) {
  ClippedHull hull = prepared.state().clipped();
  const Eigen::Vector3d upright = up.normalized();
  const double here = waterline_for_volume(prepared, upright, volume_mm3) - upright.dot(hull.centre());
  hull.set_up(upright);
  const std::vector<int> pockets = hull.points_in_pockets(here);
  if (pockets.empty()) return std::nullopt;
  const Eigen::Vector3d side = upright.unitOrthogonal();
  const auto heeled = [&](int n, double angle) -> Eigen::Vector3d {
    const double azimuth = 2 * std::numbers::pi * n / directions;
    const Eigen::Vector3d towards = std::cos(azimuth) * side + std::sin(azimuth) * upright.cross(side);
    return std::cos(angle) * upright + std::sin(angle) * towards;
  };
  tbb::enumerable_thread_specific<ClippedHull> hulls(hull);
  const auto floods = [&](int n, double angle) {
    ClippedHull& own = hulls.local();
    own.set_up(heeled(n, angle));
    const auto offset = own.offset_for_volume(volume_mm3, std::numeric_limits<double>::quiet_NaN());
    return !offset || own.reaches_any(pockets, *offset);
  };
  const auto flooded = [&](const std::vector<int>& of, double angle) {
    std::vector<char> floods_here(of.size());
    tbb::parallel_for(std::size_t{0}, of.size(), [&](std::size_t k) { floods_here[k] = floods(of[k], angle); });
    std::vector<int> found;
    for (std::size_t k = 0; k < of.size(); ++k)
      if (floods_here[k]) found.push_back(of[k]);
    return found;
  };
  // All directions at once, and of those that flood in a step or half of it only they.
  constexpr double step = 2 * std::numbers::pi / 180;
  std::vector<int> all(static_cast<std::size_t>(std::max(0, directions)));
  std::iota(all.begin(), all.end(), 0);
  double dry = 0;
  double wet = step;
  std::vector<int> first = flooded(all, wet);
  while (first.empty()) {
    dry = wet;
    wet += step;
    if (wet > std::numbers::pi) return std::nullopt;
    first = flooded(all, wet);
  }
  while (wet - dry > 1e-6) {
    const double middle = (dry + wet) / 2;
    std::vector<int> sooner = flooded(first, middle);
    (sooner.empty() ? dry : wet) = middle;
    if (!sooner.empty()) first = std::move(sooner);
  }
  return FloodingHeel{wet, heeled(first.front(), wet)};
}

}  // namespace rayrep
