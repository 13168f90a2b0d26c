#include "judge/parts_off.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/rotation.h"
#include "base/text.h"
#include "judge/figures.h"
#include "rayrep/physics/hydrostatics.h"

namespace rayrep::verify_detail {
namespace {

using Eigen::Vector3d;

constexpr int kDirections = 64;  // around the upright: the worst of them is within 1 - cos(pi / 64) = 0.12 % of the worst of all

double off_of(const PlacedPart& part, const Limits& limits) { return part.printed ? limits.too_heavy[0] : 0; }

/// The worst of it, and which parts are heavier and lighter then.
struct Worst {
  double value = 0;
  std::vector<double> e;
};

/// Of a thing that stands: the smallest tipping angle, rad.
Worst tipping(const PlacedState& placed, const PoseSpec& spec) {
  StandSpec stand;
  stand.print = spec.print;
  stand.up = placed.state.rests.up_or(spec.up);
  stand.contact_tolerance_mm = spec.contact_tolerance_mm;
  const StandState as_is = stand_state_of(placed.print.hull, stand);
  Worst worst{std::numeric_limits<double>::infinity(), {}};
  for (std::size_t edge = 0; edge < as_is.tipping_angles_rad.size(); ++edge) {
    std::vector<Share> shares;
    for (const PlacedPart& part : placed.parts) {
      const Vector3d centre = as_is.to_ground * part.centre_mm;
      const double inside = as_is.polygon.edge_distances_mm(centre.head<2>())[edge];
      shares.push_back({-part.mass_g * inside, part.mass_g * (centre.z() - as_is.polygon.ground_mm), off_of(part, placed.limits)});
    }
    const Largest found = largest_fraction(shares);
    if (const double angle = std::atan(-found.value); angle < worst.value) worst = {angle, found.e};
  }
  return worst;
}

/// The largest of fractions over all directions across up. @param share_of  (part, direction)
template <typename ShareOf>
Worst around(const PlacedState& placed, const Vector3d& up, const ShareOf& share_of) {
  const Vector3d side = up.unitOrthogonal(), ahead = up.cross(side);
  Worst worst{-std::numeric_limits<double>::infinity(), {}};
  for (int n = 0; n < kDirections; ++n) {
    const double turn = 2 * std::numbers::pi * n / kDirections;
    const Vector3d u = std::cos(turn) * side + std::sin(turn) * ahead;
    std::vector<Share> shares;
    for (const PlacedPart& part : placed.parts) shares.push_back(share_of(part, u));
    const Largest found = largest_fraction(shares);
    if (found.value > worst.value) worst = {found.value, found.e};
  }
  return worst;
}

struct Body {
  double mass_g = 0;
  Vector3d centre_mm = Vector3d::Zero();
};

/// All parts together, each so much heavier.
Body together(const std::vector<PlacedPart>& parts, const std::vector<double>& e) {
  Body body;
  for (std::size_t n = 0; n < parts.size(); ++n) {
    const double mass = (1 + e[n]) * parts[n].mass_g;
    body.mass_g += mass;
    body.centre_mm += mass * parts[n].centre_mm;
  }
  body.centre_mm /= body.mass_g;
  return body;
}

/// Of a thing that hangs: the largest tilt, rad.
Worst hanging(const PlacedState& placed, const Vector3d& up) {
  const Vector3d point = placed.state.rests.point_mm;
  Worst worst = around(placed, up, [&](const PlacedPart& part, const Vector3d& u) {
    const Vector3d arm = part.centre_mm - point;
    return Share{part.mass_g * u.dot(arm), -part.mass_g * up.dot(arm), off_of(part, placed.limits)};
  });
  const Vector3d string = point - together(placed.parts, worst.e).centre_mm;
  worst.value = angle_between(string, up);
  return worst;
}

/// Of a thing that floats: the tilt at which it comes to rest with its centre of mass as far beside as it comes; NaN: it does not.
Worst floating(const PlacedState& placed, const PoseSpec& spec, const Vector3d& up) {
  const Vector3d middle = together(placed.parts, std::vector<double>(placed.parts.size(), 0.0)).centre_mm;
  Worst worst = around(placed, up, [&](const PlacedPart& part, const Vector3d& u) {
    return Share{part.mass_g * u.dot(part.centre_mm - middle), part.mass_g, off_of(part, placed.limits)};
  });
  const Body body = together(placed.parts, worst.e);
  FloatingRestOptions options;
  options.fluid_g_cm3 = spec.fluid_g_cm3;
  const FloatingRest rest = floating_rest(PreparedHull(placed.print.hull), body.mass_g, body.centre_mm, up, options);
  worst.value = rest.rests() ? angle_between(rest.up, up) : std::numeric_limits<double>::quiet_NaN();
  return worst;
}

std::string names(const std::vector<PlacedPart>& parts, const std::vector<double>& e, double sign) {
  std::string all;
  for (std::size_t n = 0; n < parts.size(); ++n)
    if (sign * e[n] > 0) all += (all.empty() ? "" : ", ") + parts[n].name;
  return all;
}

/// What it does then, its measure as a figure, and whether it still rests.
struct Told {
  Worst worst;
  const char* figure;
  std::string words;
  bool rests;
};

Told told_of(const PlacedState& placed, const PoseSpec& spec) {
  const Vector3d up = placed.state.rests.up_or(spec.up).normalized();
  if (placed.state.rests.kind == Pose::Kind::stands) {
    const Worst worst = tipping(placed, spec);
    const bool stands = worst.value > 0;
    return {worst, "tipping_angle_rad", stands ? "it tips over at " + degrees(worst.value, 1) : "it tips over by itself", stands};
  }
  const bool hangs = placed.state.rests.kind == Pose::Kind::hangs;
  const Worst worst = hangs ? hanging(placed, up) : floating(placed, spec, up);
  if (std::isnan(worst.value)) return {worst, "tilt_rad", "it does not come to rest", false};
  return {worst, "tilt_rad", (hangs ? "it hangs " : "it floats ") + degrees(worst.value, 2) + " off upright",
          worst.value <= placed.limits.settled_tilt_rad};
}

/// "Weigh the parts: port 39.67 g and starboard 33.35 g are wanted."
std::string weights(const std::vector<PlacedPart>& parts) {
  std::string all;
  for (const PlacedPart& part : parts)
    if (part.printed) all += (all.empty() ? "" : ", ") + part.name + " " + number(part.mass_g, 2) + " g";
  return " Weigh the parts: " + all + " are wanted.";
}

}  // namespace

Largest largest_fraction(const std::vector<Share>& shares) {
  Largest best;
  best.e.assign(shares.size(), 0.0);
  const auto value = [&shares](const std::vector<double>& e) {
    double numerator = 0, denominator = 0;
    for (std::size_t n = 0; n < shares.size(); ++n) {
      numerator += (1 + e[n]) * shares[n].numerator;
      denominator += (1 + e[n]) * shares[n].denominator;
    }
    return numerator / denominator;
  };
  best.value = value(best.e);
  for (;;) {
    std::vector<double> e;
    for (const Share& share : shares) {
      const double gain = share.numerator - best.value * share.denominator;
      e.push_back(gain > 0 ? share.off : gain < 0 ? -share.off : 0);
    }
    const double next = value(e);
    if (!(next > best.value)) return best;
    best = {next, std::move(e)};
  }
}

void judge_parts_off(const PlacedState& placed, PoseVerdict& verdict) {
  if (placed.parts.size() < 2 || !verdict.pass()) return;
  if (const bool* submerged = wanted_of<bool>(verdict.poses.front(), "submerged"); submerged && *submerged) return;
  const Told told = told_of(placed, verdict.spec);
  const double off = placed.limits.too_heavy[0];
  const std::string heavier = names(placed.parts, told.worst.e, 1), lighter = names(placed.parts, told.worst.e, -1);
  const bool measured = !std::isnan(told.worst.value);
  verdict.figures.push_back({.name = "with_parts_off",
                             .words = "",
                             .value = Record{{"off", off},
                                             {"heavier", heavier},
                                             {"lighter", lighter},
                                             {told.figure, measured ? Scalar(told.worst.value) : Scalar()}}});
  if (told.rests)
    verdict.meaning.back() +=
        " With each part " + rough_percent(off) + " heavier or lighter by itself, as prints come out, " + told.words + " at worst.";
  else
    verdict.notes.push_back("In the state '" + placed.state.name + "': with " +
                            (heavier.empty() ? "" : heavier + " " + rough_percent(off) + " heavier") +
                            (heavier.empty() || lighter.empty() ? "" : " and ") +
                            (lighter.empty() ? "" : lighter + " " + rough_percent(off) + " lighter") + ", as prints come out, " +
                            told.words + "." + weights(placed.parts));
}

double hinge_off_mm(const PlacedState& placed, const HingeBalance& hinge) {
  const Vector3d up = placed.state.rests.up_or(Vector3d::UnitZ());
  const Vector3d across = hinge.axis.cross(up).normalized();
  double most = 0;
  for (const double side : {-1.0, 1.0}) {
    std::vector<Share> shares;
    for (const std::size_t n : hinge.parts) {
      const PlacedPart& part = placed.parts[n];
      shares.push_back(
          {side * part.mass_g * across.dot(part.centre_mm - hinge.point_mm), part.mass_g, off_of(part, placed.limits)});
    }
    most = std::max(most, largest_fraction(shares).value);
  }
  return most;
}

}  // namespace rayrep::verify_detail
