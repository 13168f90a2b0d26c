#include "make/pose_top.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "base/text.h"
#include "make/poses.h"
#include "make/spin_search.h"
#include "rayrep/base/error.h"
#include "rayrep/solve/certify.h"

namespace rayrep::detail {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kBeside = 1e-4;  ///< verticals that pass each other nearer than this, over the diagonal, are one
constexpr double kNearly = 1e-5;  ///< of constraints: enough for words
constexpr double kDegree = std::numbers::pi / 180;
constexpr int kMostHeights = 400;  ///< at which the best top is searched,
constexpr int kFewHeights = 40;    ///< and where a core is scarce, which the bounds do not know

bool is_top(const Pose& pose) { return pose.kind == Pose::Kind::spins; }

/// Heights above the contact at which the centre of mass may lie, on the axis.
struct Heights {
  double lo = -kInfinity;
  double hi = kInfinity;
  double beside_mm = 0;  ///< how far beside the axis the vertical passes that a pose needs
  bool empty(double diagonal_mm) const { return !(lo <= hi) || beside_mm > kBeside * diagonal_mm; }

  /// row[0] + row[3] h <= 0
  void keep(const CentreProblem::Row& row) {
    if (row[3] > 1e-12)
      hi = std::min(hi, -row[0] / row[3]);
    else if (row[3] < -1e-12)
      lo = std::max(lo, -row[0] / row[3]);
    else if (row[0] > 0)
      hi = -kInfinity;
  }
};

/// What a pose leaves of the z axis of its problem's frame. theory.md (74)
/// @param least_ratio  of those that it stands with; none: its ratios are wishes
Heights heights_on_axis(const CentreProblem& problem, std::optional<double> least_ratio) {
  Heights heights;
  for (const CentreProblem::Row& row : problem.at_most) heights.keep(row);
  if (least_ratio)
    for (const CentreProblem::Ratio& r : problem.ratios) heights.keep(*least_ratio * r.run - r.rise);
  double square = 0;
  double mixed = 0;
  for (const CentreProblem::Row& row : problem.level) {
    square += row[3] * row[3];
    mixed += row[0] * row[3];
  }
  // Two axes that are parallel, or cross.
  const bool crosses = square > 1e-12;
  const double h = crosses ? -mixed / square : 0;
  double missed = 0;
  for (const CentreProblem::Row& row : problem.level) missed += (row[0] + row[3] * h) * (row[0] + row[3] * h);
  heights.beside_mm = std::sqrt(missed);
  if (crosses) {
    heights.lo = heights.lo > h ? kInfinity : h;
    heights.hi = heights.hi < h ? -kInfinity : h;
  }
  return heights;
}

/// The best top of those that have their centre of mass within some heights.
struct BestTop {
  Moments moments = Moments::Zero();
  double objective = kInfinity;  ///< infinite: there is none, or it does not spin about its largest axis
  bool attainable = false;
  double height_mm() const { return moments[MZ] / moments[M1]; }
  double ratio() const {
    return spin_state(mass_properties(moments, 1), Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitZ()).ratio_larger;
  }
};

/// The poses about one axis, the z axis of the body's working frame through the contact.
class Top {
public:
  /// Keeps references. @param asked  with the place of its axis, and a least tipping angle where it stands
  Top(const Body& body, const Poses& poses, const PoseSpec& asked) : body_(body), poses_(poses), asked_(asked) {
    const Eigen::AlignedBox3d box = bounding_box(body.working);
    box_ = {box.min().z(), box.max().z()};
  }

  /// What one pose leaves of the axis.
  Heights heights(std::size_t n, std::optional<double> volume_mm3, double tip_deg) const {
    const bool stands = poses_[n].pose.kind == Pose::Kind::stands;
    return heights_on_axis(moved(poses_.problem(n, volume_mm3), body_.to_working),
                           stands ? std::optional(std::max(std::tan(tip_deg * kDegree), kSmallestTipping_rad)) : std::nullopt);
  }

  /// What all of them leave of the body's height, but one.
  Heights common(std::optional<double> volume_mm3, double tip_deg, std::optional<std::size_t> but = {}) const {
    Heights all = box_;
    for (std::size_t n = 0; n < poses_.size(); ++n) {
      if (is_top(poses_[n].pose) || n == but) continue;
      const Heights one = heights(n, volume_mm3, tip_deg);
      all.lo = std::max(all.lo, one.lo);
      all.hi = std::min(all.hi, one.hi);
      all.beside_mm = std::max(all.beside_mm, one.beside_mm);
    }
    // Heights that several poses fix agree to what verticals do.
    const double tolerance = kBeside * body_.diagonal_mm;
    if (all.lo > all.hi && all.lo - all.hi < tolerance) all.lo = all.hi = 0.5 * (all.lo + all.hi);
    return all;
  }
  Heights common(std::optional<double> volume_mm3) const { return common(volume_mm3, tip_deg()); }
  const Heights& box() const { return box_; }  ///< of the body itself
  double tip_deg() const { return asked_.least_tip_deg.value_or(PoseSpec::kUsualTip_deg); }

  CertifiedSpin problem(std::optional<double> volume_mm3) const {
    const SpinSpec usual;
    return {.lambda = usual.lambda,
            .gamma_i = usual.gamma_i,
            .yoyo = false,
            .material_mm3 = volume_mm3,
            .volume_mm3 = body_.solid[M1],
            .length_mm = body_.diagonal_mm};
  }

  /// Balanced about the axis with the measure of spin, and with the volume of material where something floats.
  Goal goal(std::optional<double> volume_mm3) const {
    const Goal spin = spin_goal(weights_of({}), true, false, body_.solid[M1], body_.diagonal_mm);
    return volume_mm3 ? with_equation(spin, Moments::Unit(M1) / *volume_mm3, -1) : spin;
  }
  /// The same with its centre of mass at a height.
  Goal goal_at(double height_mm, std::optional<double> volume_mm3) const {
    const Moments row = Moments::Unit(MZ) - height_mm * Moments::Unit(M1);
    return with_equation(goal(volume_mm3), row / (body_.solid[M1] * body_.diagonal_mm), 0);
  }

  /// Solved free, and where that lies beyond the heights at the nearer end of them; where neither comes to an end, over the
  /// heights.
  BestTop look(std::optional<double> volume_mm3, const Heights& within) const {
    if (within.empty(body_.diagonal_mm)) return {};
    QuadricSolution solution = solve_quadric(goal(volume_mm3), *body_.integrals, body_.shell);
    if (solution.infeasible) return {};
    const double free_mm = solution.moments[MZ] / solution.moments[M1];
    if (solution.converged && (free_mm < within.lo || free_mm > within.hi))
      solution = solve_quadric(goal_at(std::clamp(free_mm, within.lo, within.hi), volume_mm3), *body_.integrals, body_.shell);
    if (!solution.converged)
      solution = certify_spin(problem(volume_mm3), *body_.integrals, body_.shell,
                              {.heights = {within.lo, within.hi}, .within = true, .gap = 1e-2, .max_nodes = 40})
                     .best;
    BestTop best;
    best.attainable = solution.converged;
    if (!best.attainable) return best;
    best.moments = solution.moments;
    if (spins_as_wanted(solution.moments, true)) best.objective = goal(volume_mm3).objective(solution.moments);
    return best;
  }

  /// Lowest and highest centre of mass of all that is balanced about the axis, by Dinkelbach's method; none: nothing is.
  std::optional<Heights> balanced(std::optional<double> volume_mm3) const {
    Heights reach;
    for (const double sign : {1., -1.}) {
      double height_mm = body_.solid[MZ] / body_.solid[M1];
      for (int round = 0; round < 30; ++round) {
        const Moments above = Moments::Unit(MZ) - height_mm * Moments::Unit(M1);
        const Goal lowest = linear_goal(sign / (body_.solid[M1] * body_.diagonal_mm) * above, goal(volume_mm3));
        const QuadricSolution end = solve_quadric(lowest, *body_.integrals, body_.shell);
        if (end.infeasible || end.residual > kNearly) return std::nullopt;
        const double before_mm = std::exchange(height_mm, end.moments[MZ] / end.moments[M1]);
        if (std::abs(height_mm - before_mm) < 1e-6 * body_.diagonal_mm) break;
      }
      (sign > 0 ? reach.lo : reach.hi) = height_mm;
    }
    return reach;
  }

  /// Of material, where something floats: given, or that of the best top that comes back.
  /// @throws Error{goal} when it cannot weigh that
  std::optional<double> volume_mm3(const Progress& progress) const {
    if (!poses_.any(Pose::Kind::floats)) return std::nullopt;
    if (const auto given = poses_.given_volume_mm3()) {
      require_weight(body_, asked_, *given);
      return given;
    }
    constexpr int steps = 40;
    const double lightest = body_.shell[M1];
    const double most = std::min((body_.shell + body_.integrals->full())[M1], poses_.most_afloat_mm3());
    require_weight(body_, asked_, most);
    std::vector<std::pair<double, double>> order;  // objective and volume; beyond all of these, those nearest to the axis
    for (int n = 1; n < steps; ++n) {
      progress.check();
      const double volume = lightest + (most - lightest) * n / steps;
      const Heights within = common(volume);
      const BestTop best = look(volume, within);
      order.emplace_back(std::isfinite(best.objective) ? best.objective : kBesideAll + within.beside_mm, volume);
    }
    std::stable_sort(order.begin(), order.end());
    for (const auto& [objective, volume] : order)
      if (objective < kBesideAll && comes_back(volume, look(volume, common(volume)).height_mm())) return volume;
    return order.front().first < kBesideAll ? order.front().second
                                            : nearest_to_axis(order.front().second, (most - lightest) / steps);
  }

  /// Whether all that floats does when it is let go at a tilt.
  bool comes_back(double volume_mm3, double height_mm) const {
    const Eigen::Vector3d centre_mm = body_.to_working.inverse() * Eigen::Vector3d(0, 0, height_mm);
    for (std::size_t n = 0; n < poses_.size(); ++n)
      if (poses_[n].pose.kind == Pose::Kind::floats && !poses_.comes_back(body_, poses_[n], volume_mm3, centre_mm)) return false;
    return true;
  }

private:
  static constexpr double kBesideAll = 1e6;  ///< more than any objective

  /// Where the verticals of what floats pass nearest to the axis, around a volume, by golden section.
  double nearest_to_axis(double volume_mm3, double step_mm3) const {
    const double part = 0.5 * (std::sqrt(5.) - 1);
    double lo = volume_mm3 - step_mm3;
    double hi = volume_mm3 + step_mm3;
    for (int n = 0; n < 40; ++n) {
      const double a = hi - part * (hi - lo);
      const double b = lo + part * (hi - lo);
      const bool lower = common(a).beside_mm < common(b).beside_mm;
      (lower ? hi : lo) = lower ? b : a;
    }
    return 0.5 * (lo + hi);
  }

  const Body& body_;
  const Poses& poses_;
  const PoseSpec& asked_;
  Heights box_;
};

/// What was asked, and what came of it so far.
struct Case {
  const Body& body;
  const PoseSpec& spec;  ///< as it was given
  const Poses& poses;
  const Top& top;
  std::optional<double> volume_mm3;
};

std::string top_words(const BestTop& best) {
  return "spins with Izz " + number(best.ratio(), 3) + " times the larger lateral moment, its centre of mass " +
         number(best.height_mm(), 2) + " mm above the contact";
}

/// What the others could do without each of the poses; of the best top of all poses, if there is one, only what is better.
std::string costs(const Case& c, double objective, const Progress& progress) {
  std::string text;
  const auto say = [&text](const std::string& words) { text += (text.empty() || words.empty() ? "" : " ") + words; };
  for (std::size_t n = 0; n < c.spec.poses.size(); ++n) {
    progress.check();
    if (is_top(c.spec.poses[n])) {
      say(words_without(n, c.body, c.spec, -kInfinity, progress));
      continue;
    }
    const bool floats = c.spec.poses[n].kind == Pose::Kind::floats;
    const auto others =
        std::count_if(c.spec.poses.begin(), c.spec.poses.end(), [](const Pose& pose) { return pose.kind == Pose::Kind::floats; });
    const std::optional<double> volume = floats && others == 1 ? std::nullopt : c.volume_mm3;
    const BestTop best = c.top.look(volume, c.top.common(volume, c.top.tip_deg(), n));
    if (best.objective < (std::isfinite(objective) ? objective - 1e-3 * std::abs(objective) : kInfinity))
      say("Without " + words_of(c.spec.poses[n], c.spec.up) + " it " + top_words(best) + ".");
  }
  return text;
}

/// "3.00 to 8.20", "at most 8.20", "12.10", or why none.
std::string range_words(const Heights& heights, double diagonal_mm) {
  if (heights.beside_mm > kBeside * diagonal_mm)
    return "nowhere, the vertical that it needs passes " + number(heights.beside_mm, 2) + " mm beside the axis";
  if (!(heights.lo <= heights.hi)) return "nowhere";
  if (heights.hi - heights.lo < 1e-6 * diagonal_mm) return number(heights.lo, 2);
  if (!std::isfinite(heights.lo) && !std::isfinite(heights.hi)) return "anywhere";
  if (!std::isfinite(heights.lo)) return "at most " + number(heights.hi, 2);
  if (!std::isfinite(heights.hi)) return "at least " + number(heights.lo, 2);
  return number(heights.lo, 2) + " to " + number(heights.hi, 2);
}

/// A tipping angle, nearly the largest, below what was asked for with which the poses can be met: at the edge of what is attainable
/// nothing is left to correct the mesh with.
std::optional<double> smaller_tip_deg(const Case& c, const Progress& progress) {
  if (!c.poses.tips()) return std::nullopt;
  const auto can = [&](double tip) {
    progress.check();
    return std::isfinite(c.top.look(c.volume_mm3, c.top.common(c.volume_mm3, tip)).objective);
  };
  double met = 0;
  if (!can(met)) return std::nullopt;
  double missed = c.top.tip_deg();
  while (missed - met > 0.02) {
    const double tip = 0.5 * (met + missed);
    (can(tip) ? met : missed) = tip;
  }
  met = std::floor(9.8 * met) / 10;
  return met > 0 ? std::optional(met) : std::nullopt;
}

/// The centre of mass of the best top about a vertical through a point, both in the working frame; none: there is none.
std::optional<Eigen::Vector3d> centre_about(const Body& body, const Goal& goal, const Eigen::Vector3d& point) {
  const Matrix10 T = moment_map(Eigen::Affine3d(Eigen::Translation3d(-point.x(), -point.y(), 0)));
  const QuadricSolution solution = solve_quadric(mapped(goal, T), *body.integrals, body.shell);
  if (!solution.converged || !spins_as_wanted(T * solution.moments, true)) return std::nullopt;
  return solution.moments.segment<3>(MX) / solution.moments[M1];
}

/// @throws Error{goal} for a body that cannot be balanced about the axis, whatever its other poses
void require_balance(const Body& body, const PoseSpec& spec, const Goal& goal) {
  if (!solve_quadric(goal, *body.integrals, body.shell).infeasible) return;
  SpinSpec alone;
  alone.print = spec.print;
  const Error refusal = unbalanced(body, alone, goal);
  const bool com = centre_about(body, goal, body.solid.segment<3>(MX) / body.solid[M1]).has_value();
  throw Error(refusal.code(),
              refusal.what() + std::string(com ? " About the centre of mass of the solid it spins: --spin UP:com." : ""));
}

/// An axis through the point that what floats or hangs upright with it needs, as an option.
std::string other_axis_words(const Case& c) {
  const auto top = std::find_if(c.spec.poses.begin(), c.spec.poses.end(), is_top);
  const Eigen::Vector3d up = top->up_or(c.spec.up).normalized();
  if (std::abs(up.z()) < 1 - 1e-9) return {};
  for (std::size_t n = 0; n < c.poses.size(); ++n) {
    const Placed& p = c.poses[n];
    const bool fixes = p.pose.kind == Pose::Kind::hangs || p.pose.kind == Pose::Kind::floats || p.pose.kind == Pose::Kind::rights;
    if (!fixes || p.up.cross(up).norm() > 1e-9) continue;
    const Heights heights = c.top.heights(n, c.volume_mm3, 0);
    if (!heights.empty(c.body.diagonal_mm)) continue;
    const Eigen::Vector3d through = c.poses.through_mm(p, c.volume_mm3);
    const auto centre = centre_about(c.body, c.top.goal(c.volume_mm3), c.body.to_working * through);
    if (!centre || centre->z() < heights.lo || centre->z() > heights.hi) continue;
    const bool floats = p.pose.kind == Pose::Kind::floats;
    if (floats && !c.poses.comes_back(c.body, p, *c.volume_mm3, c.body.to_working.inverse() * *centre)) continue;
    const auto rounded = [](double mm) { return shown(1e-3 * std::round(1e3 * mm) + 0.0, 7); };
    return " Balanced about the vertical of " + words_of(c.spec.poses[n], c.spec.up) + " it spins: --spin " +
           (up.z() > 0 ? "z:" : "-z:") + rounded(through.x()) + "," + rounded(through.y()) + ".";
  }
  return {};
}

/// Why there is no such top: what each pose leaves of the axis, and what would be without it.
Error contradiction(const Case& c, const BestTop& best, const Progress& progress) {
  std::string text = "These poses contradict each other. The centre of mass lies on the axis, and so many mm above its contact:";
  const char* separator = " ";
  for (std::size_t n = 0; n < c.poses.size(); ++n) {
    if (is_top(c.poses[n].pose)) continue;
    text += separator + words_of(c.spec.poses[n], c.spec.up) +
            (c.poses[n].pose.kind == Pose::Kind::stands ? " (tipping over at " + number(c.top.tip_deg(), 2) + " degrees)" : "") +
            ": " + range_words(c.top.heights(n, c.volume_mm3, c.top.tip_deg()), c.body.diagonal_mm);
    separator = "; ";
  }
  if (const auto reach = c.top.balanced(c.volume_mm3))
    text += "; balanced about the axis" + std::string(c.volume_mm3 ? " with the mass that floats" : "") + ": " +
            range_words(*reach, c.body.diagonal_mm);
  else
    text += "; nothing" + std::string(c.volume_mm3 ? " with the mass that floats" : "") + " can be balanced about the axis";
  text += ".";
  if (best.attainable)
    text += " At best it then " + top_words(best) +
            ", and must have more than the larger one: a body tumbles about an axis of middle moment.";
  if (const auto tip = smaller_tip_deg(c, progress)) text += " It can be made with --min-tip " + number(*tip, 1) + ".";
  text += other_axis_words(c);
  const std::string without = costs(c, kInfinity, progress);
  return {ErrorCode::goal, text + (without.empty() ? "" : " " + without) + scarce_words(c.body.inner.rays.grid)};
}

/// The spec as a judge is to hold the result to it: with the place of its axis, and the tipping angle that it keeps.
PoseSpec at_its_place(PoseSpec spec, const SpinFrame& frame) {
  for (Pose& pose : spec.poses)
    if (is_top(pose)) pose.axis = {.through = SpinAxis::Through::point, .point_mm = frame.contact_mm};
  const bool stands = std::any_of(spec.poses.begin(), spec.poses.end(), [](const Pose& p) { return p.kind == Pose::Kind::stands; });
  if (stands && !spec.least_tip_deg) spec.least_tip_deg = PoseSpec::kUsualTip_deg;
  return spec;
}

/// What is proven of the top, and what each pose costs.
struct Claim {
  SpinCertificate certificate;
  Heights within;
  bool held;  ///< the other poses leave less than the body's height
  std::string costs;
};

void prove(const Claim& claim, HollowResult& result) {
  const SpinCertificate& c = claim.certificate;
  result.proof = {"no interior on these rays" +
                  (claim.held ? " with its centre of mass " + number(claim.within.lo, 2) + " to " + number(claim.within.hi, 2) +
                                    " mm above the contact, where the other poses let it be,"
                              : std::string()) +
                  " is a better top than " + number(c.lower_bound, 6) + ", this one " + number(c.best.objective, 6) + ": within " +
                  scientific(std::max(c.gap, 1e-9)) + " of the global optimum (proven, " + std::to_string(c.nodes) + " heights)"};
  if (!claim.costs.empty()) result.proof.push_back(claim.costs);
  Record certificate = record_of(c);
  certificate.emplace_back("lowest_mm", claim.within.lo);
  certificate.emplace_back("highest_mm", claim.within.hi);
  result.proof_figures = {{.name = "certificate", .words = "", .value = certificate}};
}

/// Goal, error and solver of a plan whose best top is known.
void aim(Plan& plan, const Top& top, const Moments& best, std::optional<double> volume_mm3) {
  const double L = plan.body->diagonal_mm;
  const double height_mm = best[MZ] / best[M1];
  plan.goal = top.goal_at(height_mm, volume_mm3);
  plan.error = [=](const Moments& s) {
    const double m = s[M1];
    const double products = Eigen::Vector2d(s[MXZ], s[MYZ]).norm() / (m * L * L);
    const double offset = (s.segment<3>(MX) / m - Eigen::Vector3d(0, 0, height_mm)).norm() / L;
    return std::max({offset, products, volume_mm3 ? std::abs(m / *volume_mm3 - 1) : 0});
  };
  plan.setup.scale = {plan.body->solid[M1], L};
  plan.setup.warm.moments = best;
}

/// The body about the axis of the top, and where that is.
SpinFrame frame_of(const Mesh& outer, const PoseSpec& spec, const Progress& progress) {
  const Pose& pose = *std::find_if(spec.poses.begin(), spec.poses.end(), is_top);
  const Eigen::Vector3d up = pose.up_or(spec.up).normalized();
  return {up, contact_point(outer, pose.axis, up, progress)};
}

}  // namespace

Plan plan_top(const Mesh& solid, const PoseSpec& spec, const HollowOptions& options, const Progress& progress) {
  progress.begin("domain");
  Mesh outer = stored(solid, options);
  const SpinFrame frame = frame_of(outer, spec, progress);
  Plan plan;
  plan.body = body_about(frame, std::move(outer), discretisation(spec.print, options), progress);
  const Body& body = *plan.body;
  progress.begin("poses");
  const PoseSpec asked = at_its_place(spec, frame);
  const Poses poses(body, asked);
  require_feet(poses, asked, body);
  const Top top(body, poses, asked);
  require_balance(body, spec, top.goal({}));
  const std::optional<double> volume = top.volume_mm3(progress);
  const Case found{body, spec, poses, top, volume};
  const Heights within = top.common(volume);
  if (within.empty(body.diagonal_mm)) throw contradiction(found, {}, progress);
  progress.begin("solve");
  const bool scarce = std::isfinite(body.inner.rays.grid.most_mm3);
  Claim claim{
      certify_spin(top.problem(volume), *body.integrals, body.shell,
                   {.heights = {within.lo, within.hi}, .within = true, .max_nodes = scarce ? kFewHeights : kMostHeights}, progress),
      within,
      within.lo > top.box().lo || within.hi < top.box().hi,
      {}};
  const QuadricSolution& best = claim.certificate.best;
  if (!best.converged) throw contradiction(found, {}, progress);
  if (!spins_as_wanted(best.moments, true)) throw contradiction(found, {.moments = best.moments, .attainable = true}, progress);
  const double height_mm = best.moments[MZ] / best.moments[M1];
  require_righted(body, poses, {0, 0, height_mm}, progress);
  if (volume && !top.comes_back(*volume, height_mm))
    throw Error(ErrorCode::goal,
                "It does not float upright: let go tilted by 10 degrees it does not come back, or not with 1 % more plastic than "
                "planned.");
  claim.costs = costs(found, best.objective, progress);
  plan.spec = filled_in(asked, poses, volume);
  plan.setup.solver = options.solver;
  plan.setup.options = options.solve;
  aim(plan, top, best.moments, volume);
  plan.prove = [claim](const Plan&, const Moments&, HollowResult& result) { prove(claim, result); };
  return plan;
}

}  // namespace rayrep::detail
