#include "make/balls.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <utility>

#include "base/rotation.h"
#include "base/text.h"
#include "make/fixed.h"
#include "make/plan.h"
#include "mesh/revolved.h"
#include "rayrep/base/error.h"
#include "rayrep/mesh/mesh_check.h"

namespace rayrep::detail {
namespace {

constexpr int kMostRounds = 3;      // of exchanges
constexpr int kSegments = 48;       // of a circle
constexpr double kLonger_mm = 0.5;  // a shaft is made so much longer at most, to be filled with others in one pause
constexpr double kGain = 1e-5;      // of the objective that an exchange is worth

/// Around the origin, with the exact volume.
Mesh ball_mesh(const Balls& balls) {
  std::vector<Eigen::Vector2d> profile;
  for (int k = 0; k <= kSegments / 2; ++k) {
    const double angle = 2 * std::numbers::pi * k / kSegments;
    profile.emplace_back(std::sin(angle), -std::cos(angle));
  }
  Mesh mesh = revolved(profile, kSegments);
  const double volume = std::numbers::pi / 6 * std::pow(balls.diameter_mm, 3);
  const double scale = std::cbrt(volume / mesh_moments(mesh)[M1]);
  for (Eigen::Vector3d& v : mesh.vertices) v *= scale;
  return mesh;
}

/// Half a ball, and on it a shaft as wide, up to so high above the ball's centre. Around all of the ball's clearance.
Mesh pocket_mesh(const Balls& balls, double height_mm) {
  const double radius = balls.pocket_radius_mm() / std::cos(std::numbers::pi / kSegments);
  std::vector<Eigen::Vector2d> profile;
  for (int k = 0; k <= kSegments / 4; ++k) {
    const double angle = 2 * std::numbers::pi * k / kSegments;
    profile.emplace_back(radius * std::sin(angle), -radius * std::cos(angle));
  }
  profile.emplace_back(radius, height_mm);
  profile.emplace_back(0, height_mm);
  return revolved(profile, kSegments);
}

/// From a ball's centre to the farthest point of its pocket.
double reach_mm(const Balls& balls) {
  const double radius = balls.pocket_radius_mm();
  return std::hypot(radius, radius + kLonger_mm) / std::cos(std::numbers::pi / kSegments);
}

/// For each ball, how high above its centre its shaft ends: just above it, or where that of another one does that is a little
/// higher.
std::vector<double> shaft_heights_mm(const std::vector<Eigen::Vector3d>& centres, const Eigen::Vector3d& up, double radius_mm) {
  std::vector<std::size_t> order(centres.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto height = [&](std::size_t n) { return up.dot(centres[n]); };
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return height(a) < height(b); });
  std::vector<double> shafts(centres.size());
  for (std::size_t first = 0; first < order.size();) {
    std::size_t end = first;
    while (end < order.size() && height(order[end]) <= height(order[first]) + kLonger_mm) ++end;
    for (std::size_t k = first; k < end; ++k) shafts[order[k]] = radius_mm + height(order[end - 1]) - height(order[k]);
    first = end;
  }
  return shafts;
}

class Placing {
public:
  Placing(const Mesh& solid, const Spec& spec, const HollowOptions& options, const Progress& progress)
      : solid_(solid), spec_(spec), options_(options), quiet_{.stage = {}, .cancelled = progress.cancelled} {
    balls_ = print_of(spec).balls;
    print_of(spec_).balls = {};
    few_ = on_few_rays(options);
    upright_ = rotation_between(Eigen::Vector3d::UnitZ(), up_of(spec).normalized());
  }

  /// Centres, in the frame given.
  std::vector<Eigen::Vector3d> run() {
    hold_waterline();
    std::vector<Eigen::Vector3d> centres;
    while (static_cast<int>(centres.size()) < balls_.count) {
      const std::optional<Eigen::Vector3d> place = best_place(centres, balls_.count - static_cast<int>(centres.size()));
      if (!place)
        throw Error(ErrorCode::goal,
                    "There is room for " + std::to_string(centres.size()) + " of the " + std::to_string(balls_.count) +
                        " balls only: a ball of " + shown(balls_.diameter_mm) + " mm takes a place that is " +
                        number(reach_mm(balls_) + print_of(spec_).wall_mm, 2) +
                        " mm from the surface and from other pockets. Use smaller ones (--ball-diameter), fewer, or "
                        "a thinner wall.");
      centres.push_back(*place);
    }
    exchange(centres);
    placed_ = objective(centres);
    return centres;
  }

  /// How near the balls come to metal that can be shared out, as much as all of them have.
  std::string words() const {
    if (!placed_) return {};
    const double gap = (*placed_ - relaxed_) / std::abs(relaxed_);
    return "With the balls it does " + (gap > 0 ? number(100 * gap, 2) + " % less well" : std::string("as well")) +
           " than with metal that can be shared out as it likes" +
           (proven_ ? ": no other places do better by more than that (proven on few rays, but for what their pockets take)" : "");
  }

  HollowOptions with(const std::vector<Eigen::Vector3d>& centres, const HollowOptions& options) const {
    HollowOptions result = options;
    const std::vector<double> shafts = shaft_heights_mm(centres, upright_ * Eigen::Vector3d::UnitZ(), balls_.pocket_radius_mm());
    for (std::size_t n = 0; n < centres.size(); ++n) {
      Eigen::Affine3d place(upright_);
      place.pretranslate(centres[n]);
      result.fixed.push_back(
          {{.mesh = transformed(ball_mesh(balls_), place), .role = Part::Role::insert, .density_g_cm3 = balls_.density_g_cm3},
           transformed(pocket_mesh(balls_, shafts[n]), place)});
    }
    return result;
  }

private:
  /// The spec with so much metal to be shared out; none: without.
  Spec relaxed_spec(int balls) const {
    Spec spec = spec_;
    if (balls == 0) return spec;
    // Of a pocket, as it is filled.
    const double share = std::pow(0.5 * balls_.diameter_mm / balls_.pocket_radius_mm(), 3);
    Core& core = print_of(spec).core;
    core.density_g_cm3 = std::max(share * balls_.density_g_cm3, 1.01 * print_of(spec).density_g_cm3);
    core.volume_cm3 = 1e-3 * balls * 4 * std::numbers::pi / 3 * std::pow(balls_.pocket_radius_mm(), 3);
    return spec;
  }

  struct Solved {
    Plan plan;
    QuadricSolution solution;
  };
  std::optional<Solved> solve(const std::vector<Eigen::Vector3d>& centres, int more) {
    quiet_.check();
    const HollowOptions options = with(centres, few_);
    try {
      Solved solved{std::visit([&](const auto& s) { return plan(solid_, s, options, quiet_); }, relaxed_spec(more)), {}};
      const Body& body = *solved.plan.body;
      solved.solution = solve_quadric(solved.plan.goal, *body.integrals, body.shell);
      if (solved.solution.converged) return solved;
    } catch (const Error& error) {
      if (error.code() != ErrorCode::goal) throw;
      if (why_.empty()) why_ = error.what();
    }
    return std::nullopt;
  }

  /// A waterline that is left open is searched once: places are compared at the same one.
  void hold_waterline() {
    const std::optional<Solved> first = solve({}, balls_.count);
    if (!first)
      throw Error(ErrorCode::goal, "Not even metal that could be shared out, as much as all balls have, would do. " + why_);
    relaxed_ = first->solution.objective;
    proven_ = first->plan.goal.affine;
    FloatSpec* floating = std::get_if<FloatSpec>(&spec_);
    if (!floating) return;
    if (is_submerged(*floating)) return;
    floating->waterline_mm = std::get<FloatSpec>(first->plan.spec).waterline_mm;
    floating->submerged_fraction.reset();
    floating->submerged_volume_fraction.reset();
  }

  /// Where a ball does most, with metal for those that are still to come; none: there is no room.
  std::optional<Eigen::Vector3d> best_place(const std::vector<Eigen::Vector3d>& centres, int to_come) {
    std::optional<Solved> solved = solve(centres, to_come);
    if (!solved)
      throw Error(ErrorCode::goal, "With " + std::to_string(centres.size()) + " of the " + std::to_string(balls_.count) +
                                       " balls in their places the others can no longer make up for what is missing: use fewer, or "
                                       "other ones.");
    const Body& body = *solved->plan.body;
    const Moments& q = solved->solution.q;
    const RayRep room = body.inner_with(print_of(spec_).wall_mm + 1.02 * reach_mm(balls_), body.inner.rays.grid.spacing_mm, quiet_);
    double least = std::numeric_limits<double>::infinity();
    std::optional<Eigen::Vector3d> best;
    for (std::size_t ray = 0; ray < room.grid.size(); ++ray)
      for (std::uint32_t n = room.first[ray]; n < room.first[ray + 1]; ++n) {
        const Interval& interval = room.intervals[n];
        const Eigen::Vector2d xy = room.grid.at(ray);
        // q.phi is a parabola along the ray.
        const double slope = q[MZ] + q[MXZ] * xy.x() + q[MYZ] * xy.y();
        const double vertex = q[MZZ] > 0 ? std::clamp(-0.5 * slope / q[MZZ], interval.lo, interval.hi) : interval.lo;
        for (const double z : {interval.lo, vertex, interval.hi})
          if (const double value = quadric_value(q, {xy.x(), xy.y(), z}); value < least) {
            least = value;
            best = Eigen::Vector3d(xy.x(), xy.y(), z);
          }
      }
    if (best) best = body.to_working.inverse() * *best;
    return best;
  }

  std::optional<double> objective(const std::vector<Eigen::Vector3d>& centres) {
    const std::optional<Solved> solved = solve(centres, 0);
    if (!solved) return std::nullopt;
    return solved->solution.objective;
  }

  /// Takes each out and puts it where it does most without it, until nothing is gained.
  void exchange(std::vector<Eigen::Vector3d>& centres) {
    std::optional<double> now = objective(centres);
    for (int round = 0; round < kMostRounds; ++round) {
      bool changed = false;
      for (std::size_t n = 0; n < centres.size(); ++n) {
        std::vector<Eigen::Vector3d> others = centres;
        others.erase(others.begin() + static_cast<std::ptrdiff_t>(n));
        if (!solve(others, 1)) continue;
        const std::optional<Eigen::Vector3d> place = best_place(others, 1);
        if (!place || (*place - centres[n]).norm() < 0.05 * balls_.diameter_mm) continue;
        std::vector<Eigen::Vector3d> next = centres;
        next[n] = *place;
        const std::optional<double> then = objective(next);
        if (!then || (now && *then > *now - kGain * std::abs(*now))) continue;
        centres = std::move(next);
        now = then;
        changed = true;
      }
      if (!changed) return;
    }
  }

  const Mesh& solid_;
  Spec spec_;
  const HollowOptions& options_;
  HollowOptions few_;
  Progress quiet_;
  Balls balls_;
  Eigen::Matrix3d upright_;
  double relaxed_ = 0;            ///< objective with metal that can be shared out
  std::optional<double> placed_;  ///< with balls
  bool proven_ = false;           ///< the first is a lower bound
  std::string why_;               ///< it cannot be done
};

}  // namespace

HollowResult hollow_with_balls(const Mesh& solid, const Spec& spec, const HollowOptions& options, const Progress& progress) {
  progress.begin("balls");
  Placing placing(solid, spec, options, progress);
  std::vector<Eigen::Vector3d> centres = placing.run();
  const Balls& balls = print_of(spec).balls;
  const Eigen::Vector3d up = up_of(spec).normalized();
  // From the bottom up, as they are put in.
  std::stable_sort(centres.begin(), centres.end(),
                   [&up](const Eigen::Vector3d& a, const Eigen::Vector3d& b) { return up.dot(a) < up.dot(b); });
  Spec without = spec;
  print_of(without).balls = {};
  HollowResult result = hollow(solid, without, placing.with(centres, options), progress);
  double lowest = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& v : solid.vertices) lowest = std::min(lowest, up.dot(v));
  const std::vector<double> shafts = shaft_heights_mm(centres, up, balls.pocket_radius_mm());
  for (std::size_t n = 0; n < centres.size(); ++n) result.balls.push_back({centres[n], up.dot(centres[n]) + shafts[n] - lowest});
  if (const std::string words = placing.words(); !words.empty()) result.proof.push_back(words);
  print_of(result.spec).balls = balls;
  return result;
}

}  // namespace rayrep::detail
