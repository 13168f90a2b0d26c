#include "rayrep/make/balance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>

#include "base/text.h"
#include "make/body.h"
#include "make/cavity_maker.h"
#include "make/fixed.h"
#include "make/mechanism_states.h"
#include "make/plan.h"
#include "rayrep/base/error.h"
#include "rayrep/mesh/mesh_check.h"

namespace rayrep {
namespace detail {
namespace {

double degrees(double rad) { return rad * 180 / std::numbers::pi; }
double radians(double degrees) { return degrees * std::numbers::pi / 180; }

void check_prints(const Mechanism& mechanism) {
  for (const MechanismPart& part : mechanism.parts) {
    const Print& print = part.print;
    if (print.core.wanted() || print.balls.wanted() || print.infill.wanted())
      throw Error(ErrorCode::usage,
                  "Part '" + part.name + "': parts that are balanced together have cavities, no core, balls or infill.");
    require_size(part.mesh);
  }
}

std::vector<std::shared_ptr<Body>> bodies_of(const Mechanism& mechanism, const HollowOptions& options, const Progress& progress) {
  std::vector<std::shared_ptr<Body>> bodies;
  for (std::size_t n = 0; n < mechanism.parts.size(); ++n) {
    const MechanismPart& part = mechanism.parts[n];
    if (!part.printed) continue;
    progress.begin("domain");
    Mesh mesh = stored(part.mesh, options);
    // Rays run along what is up in the first state, turned a little: where a plane holds them whole rays would switch at once.
    const MechanismState& first = mechanism.states.front();
    const Eigen::Vector3d up = first.rests.up_or(Eigen::Vector3d::UnitZ()).normalized();
    const Eigen::Vector3d in_part = first.poses[n].linear().transpose() * up + Eigen::Vector3d(0.031, 0.017, 0.023);
    const Eigen::Affine3d frame = working_frame(mesh, in_part);
    try {
      bodies.push_back(resolved_body(std::move(mesh), frame, discretisation(part.print, options), progress));
    } catch (const Error& error) {
      if (error.code() != ErrorCode::goal) throw;
      throw Error(ErrorCode::goal, "Part '" + part.name + "': " + error.what());
    }
  }
  return bodies;
}

/// The insides that the states ask for, on the rays.
class Search {
public:
  Search(const Mechanism& mechanism, const MechanismStates& states) : mechanism_(mechanism), states_(states) {}

  struct Found {
    double tip = 0;  ///< tangent
    std::optional<double> tip_bound;
    std::optional<double> mass_g;
    bool searched_tip = false;
  };
  /// @throws Error{goal}
  Found find(const Progress& progress) const {
    Found found;
    const bool floats = states_.any(Pose::Kind::floats);
    const bool stands = states_.any(Pose::Kind::stands);
    if (stands) found.tip = std::tan(radians(mechanism_.least_tip_deg.value_or(floats ? PoseSpec::kUsualTip_deg : 0)));
    if (floats) {
      found.mass_g = mass(found.tip, progress);
      return found;
    }
    if (stands && !mechanism_.least_tip_deg) {
      safest(found, progress);
    } else if (!solved(found.tip, {}).converged) {
      refuse(found.tip, {});
    }
    return found;
  }

private:
  PartsSolution solved(double tip, std::optional<double> mass_g, std::optional<std::size_t> only = {}) const {
    return solve_parts(states_.goal(tip, mass_g, only), states_.interiors());
  }

  /// The largest tipping angle that all states can have, by bisection: what is attainable at one is attainable at less.
  void safest(Found& found, const Progress& progress) const {
    double lo = kSmallestTipping_rad;
    if (!solved(lo, {}).converged) refuse(lo, {});
    double hi = std::tan(radians(89));
    bool proven = false;
    while (hi > lo * (1 + 1e-3)) {
      progress.check();
      const double middle = hi > 4 * lo ? std::sqrt(lo * hi) : 0.5 * (lo + hi);
      const PartsSolution at = solved(middle, {});
      if (at.converged) {
        lo = middle;
      } else {
        hi = middle;
        proven = at.infeasible;
      }
    }
    // At the edge of what these rays reach there is no room to correct the meshes, which differ a little.
    constexpr double room = 0.98;
    found.tip = room * lo;
    found.searched_tip = true;
    if (proven) found.tip_bound = hi;
  }

  std::optional<double> given_mass_g() const {
    for (std::size_t k = 0; k < states_.size(); ++k)
      if (const auto mass = states_.given_mass_g(k)) return mass;
    return std::nullopt;
  }

  /// The smallest metacentric height over the diagonal of the states that float, with that mass; none: it cannot be.
  std::optional<double> stiffness(double tip, double mass_g, bool comes_back) const {
    const PartsSolution at = solved(tip, mass_g);
    if (!at.converged) return std::nullopt;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < states_.size(); ++k) {
      if (mechanism_.states[k].rests.kind != Pose::Kind::floats) continue;
      least = std::min(least, states_.metacentric_height(k, at.moments));
      if (comes_back && !states_.comes_back(k, at.moments)) return std::nullopt;
    }
    return least;
  }

  double mass(double tip, const Progress& progress) const {
    if (const auto given = given_mass_g()) {
      if (!stiffness(tip, *given, true)) refuse(tip, given);
      return *given;
    }
    constexpr int kScan = 24;
    const double lo = states_.lightest_g();
    const double hi = std::min(states_.solid_g(), states_.most_afloat_g());
    if (!(lo < hi))
      throw Error(ErrorCode::goal, "It sinks: with nothing but their walls the parts weigh " + number(lo, 2) +
                                       " g, and the state that carries least carries " + number(states_.most_afloat_g(), 2) +
                                       " g with the usual reserve. Make walls thinner (--wall) or the material lighter.");
    const double step = (hi - lo) / kScan;
    std::vector<std::pair<double, double>> scores;  // stiffness, mass
    for (int n = 1; n < kScan; ++n) {
      progress.check();
      const double mass = lo + n * step;
      if (const auto score = stiffness(tip, mass, false)) scores.emplace_back(*score, mass);
    }
    std::sort(scores.begin(), scores.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
    for (const auto& [score, mass] : scores) {
      progress.check();
      if (stiffness(tip, mass, true)) return refined(tip, mass, step);
    }
    refuse(tip, 0.5 * (lo + hi));
  }

  /// By golden section around the best of the scan.
  double refined(double tip, double mass_g, double step) const {
    const double ratio = 1 / std::numbers::phi;
    double lo = mass_g - step;
    double hi = mass_g + step;
    double best = mass_g;
    double best_score = *stiffness(tip, mass_g, false);
    for (int n = 0; n < 8; ++n) {
      const double a = hi - ratio * (hi - lo);
      const double b = lo + ratio * (hi - lo);
      const double at_a = stiffness(tip, a, false).value_or(-1);
      const double at_b = stiffness(tip, b, false).value_or(-1);
      (at_a > at_b ? hi : lo) = at_a > at_b ? b : a;
      const double mass = at_a > at_b ? a : b;
      if (std::max(at_a, at_b) > best_score && stiffness(tip, mass, true)) {
        best_score = std::max(at_a, at_b);
        best = mass;
      }
    }
    return best;
  }

  /// Says which states cannot be. @throws Error{goal}
  [[noreturn]] void refuse(double tip, std::optional<double> mass_g) const {
    const bool tips = tip > 2 * kSmallestTipping_rad;
    const std::string with = (mass_g ? " with " + number(*mass_g, 2) + " g" : std::string()) +
                             (tips ? " with tipping angles of " + number(degrees(std::atan(tip)), 2) + " degrees" : std::string());
    std::string alone;
    for (std::size_t k = 0; k < states_.size(); ++k)
      if (!solved(tip, mass_g, k).converged) alone += (alone.empty() ? "'" : ", '") + mechanism_.states[k].name + "'";
    if (!alone.empty())
      throw Error(ErrorCode::goal,
                  "It cannot rest" + with + " in the state " + alone +
                      ", whatever is inside the parts: the centre of mass cannot be brought where it would have to be. "
                      "Change that state, make walls thinner or parts broader there.");
    throw Error(ErrorCode::goal, "Each state can be had" + with +
                                     ", but not all of them with the same insides: they want the centre of "
                                     "mass in different places. Leave one of them out, or ask for less (least_tip_deg).");
  }

  const Mechanism& mechanism_;
  const MechanismStates& states_;
};

/// Solves and makes until the meshes themselves meet what the states ask for: theory.md (16d), with a correction for each part.
class AsBuiltParts {
public:
  AsBuiltParts(const MechanismStates& states, const PartsGoal& goal, std::vector<std::unique_ptr<CavityMaker>> makers)
      : states_(states), goal_(goal), makers_(std::move(makers)), interiors_(states.interiors()) {}

  void run(const HollowOptions& options, BalanceResult& result, const Progress& progress) {
    result.as_built_error = std::numeric_limits<double>::infinity();
    Eigen::VectorXd multipliers;
    for (int pass = 1; pass <= options.max_passes && result.as_built_error > options.as_built_tolerance; ++pass) {
      progress.begin("solve");
      const PartsSolution solution = solve_parts(goal_, interiors_, multipliers);
      if (solution.infeasible || !(solution.residual < 1e-5)) {
        if (pass == 1)
          throw Error(ErrorCode::solver, "The solver stopped before it converged. Try another resolution (--resolution).");
        break;
      }
      multipliers = solution.multipliers;
      result.passes = pass;
      progress.begin("mesh");
      make(solution, result);
    }
  }

private:
  void make(const PartsSolution& solution, BalanceResult& result) {
    std::vector<Moments> made;
    for (std::size_t j = 0; j < makers_.size(); ++j) {
      makers_[j]->make({solution.q[j], 0});
      if (makers_[j]->adapted() && makers_[j]->spoilt()) makers_[j]->make_anew({solution.q[j], 0});
      made.push_back(makers_[j]->moments());
      interiors_[j].constant += made[j] - solution.moments[j];
    }
    const double e = error(made);
    if (!(e < result.as_built_error)) return;
    result.as_built_error = e;
    result.duality_gap = std::abs(solution.objective - solution.lower_bound) / std::max(std::abs(solution.objective), 1e-300);
    result.parts.resize(makers_.size());
    for (std::size_t j = 0; j < makers_.size(); ++j) {
      Made all = makers_[j]->made();
      result.parts[j].delivery = std::move(all.delivery);
      result.parts[j].cavities = all.cavities;
      result.parts[j].q = solution.q[j];
      result.parts[j].to_working = states_.body(j).to_working;
    }
    result.tipping_angles_rad.clear();
    for (std::size_t k = 0; k < states_.size(); ++k) result.tipping_angles_rad.push_back(states_.tipping_angle_rad(k, made));
    result.mass_g = states_.together(0, made)[0];
  }

  /// The largest miss of any row.
  double error(const std::vector<Moments>& made) const {
    Eigen::VectorXd s(goal_.g.size());
    for (std::size_t j = 0; j < made.size(); ++j) s.segment<10>(10 * static_cast<Eigen::Index>(j)) = made[j];
    Eigen::VectorXd c = goal_.J * s + goal_.c_0;
    const Eigen::Index level = c.size() - goal_.at_most;
    double most = goal_.at_most > 0 ? std::max(0.0, c.tail(goal_.at_most).maxCoeff()) : 0.0;
    if (level > 0) most = std::max(most, c.head(level).cwiseAbs().maxCoeff());
    return most;
  }

  const MechanismStates& states_;
  const PartsGoal& goal_;
  std::vector<std::unique_ptr<CavityMaker>> makers_;
  std::vector<PartInterior> interiors_;
};

void tell(const Search::Found& found, BalanceResult& result) {
  if (found.tip > 0) result.least_tip_rad = std::atan(found.tip);
  if (found.tip_bound) {
    result.tip_bound_rad = std::atan(*found.tip_bound);
    result.proof.push_back("no insides on these rays stand to more than " + number(degrees(*result.tip_bound_rad), 2) +
                           " degrees in all states (proven by duality)");
  }
  result.proof.push_back((found.mass_g ? "centres of mass within " : "mass within ") +
                         scientific(std::max(result.duality_gap, 1e-9)) +
                         " of the least possible on these rays (proven by duality)");
}

}  // namespace
}  // namespace detail

BalanceResult balance(const Mechanism& mechanism, const HollowOptions& options, const Progress& progress) {
  using namespace detail;
  check(mechanism);
  check_prints(mechanism);
  std::vector<std::shared_ptr<Body>> bodies = bodies_of(mechanism, options, progress);
  const MechanismStates states(mechanism, bodies, progress);
  progress.begin("target");
  const Search::Found found = Search(mechanism, states).find(progress);

  BalanceResult result;
  std::vector<std::unique_ptr<CavityMaker>> makers;
  std::vector<std::size_t> printed;
  for (std::size_t n = 0; n < mechanism.parts.size(); ++n) {
    if (!mechanism.parts[n].printed) continue;
    makers.push_back(std::make_unique<CavityMaker>(*bodies[printed.size()], mechanism.parts[n].print, options, progress));
    printed.push_back(n);
  }
  const PartsGoal goal = states.goal(found.tip, found.mass_g);
  AsBuiltParts(states, goal, std::move(makers)).run(options, result, progress);
  for (std::size_t j = 0; j < printed.size(); ++j) result.parts[j].part = printed[j];
  tell(found, result);
  return result;
}

}  // namespace rayrep
