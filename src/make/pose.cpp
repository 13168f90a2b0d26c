#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "base/rotation.h"
#include "base/text.h"
#include "make/centred.h"
#include "make/plan.h"
#include "make/pose_top.h"
#include "make/poses.h"
#include "rayrep/base/error.h"
#include "rayrep/make/waterline.h"
#include "rayrep/physics/ground_rest.h"

namespace rayrep::detail {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kFewRays = 60;  ///< along the longest side, to see which way the plane faces
/// A slope, see SafestCentre, below which the poses stand against each other, and not against what is attainable.
constexpr double kFlat = 1e-3;

constexpr double kLeastRighted = 4.5 * std::numbers::pi / 180;  ///< a judge allows 5 degrees

double degrees(double rad) { return rad * 180 / std::numbers::pi; }

bool is_good(const SafestCentre& best) { return best.attainable && best.ratio > kSmallestTipping_rad; }

/// What a problem without feet brings its centre of mass below.
std::string named(const Poses& poses) {
  return poses.any(Pose::Kind::hangs) ? "point" : poses.any(Pose::Kind::floats) ? "metacentre" : "top";
}

/// What a ratio means, for people.
std::string safety_words(const Poses& poses, double ratio, double diagonal_mm) {
  if (poses.tips()) return "tips over at " + number(degrees(std::atan(ratio)), 2) + " degrees at the soonest";
  return "has its centre of mass " + number(ratio * diagonal_mm, 2) + " mm below its " + named(poses);
}

/// The poses on one set of rays.
class Chooser {
public:
  Chooser(const Body& body, const Poses& poses, const PoseSpec& spec)
      : body_(body), poses_(poses), spec_(spec), search_(*body.integrals, body.shell) {}

  SafestCentre solve(std::optional<double> volume_mm3) {
    return search_.solve(moved(poses_.problem(volume_mm3), body_.to_working));
  }

  /// The volume of material of the poses that float, given or searched; none: nothing floats.
  /// @throws Error{goal} when it cannot weigh that
  /// @param roughly  that of the scan will do
  std::optional<double> volume_mm3(const Progress& progress, bool roughly = false) {
    if (!poses_.any(Pose::Kind::floats)) return std::nullopt;
    const double lightest = body_.shell[M1];
    const double heaviest = (body_.shell + body_.integrals->full())[M1];
    if (const auto given = poses_.given_volume_mm3()) {
      require_weight(body_, spec_, *given);
      return given;
    }
    const double most = std::min(heaviest, poses_.most_afloat_mm3());
    require_weight(body_, spec_, most);
    return searched(lightest, most, progress, roughly);
  }

  /// Whether all that floats comes back when it is let go at a tilt.
  bool comes_back(double volume_mm3) {
    const SafestCentre best = solve(volume_mm3);
    const Eigen::Vector3d centre_mm = body_.to_working.inverse() * best.centre_mm;
    for (std::size_t n = 0; n < poses_.size(); ++n)
      if (poses_[n].pose.kind == Pose::Kind::floats && !poses_.comes_back(body_, poses_[n], volume_mm3, centre_mm)) return false;
    return best.attainable;
  }

private:
  /// The best of a scan that comes back upright when it is let go, refined; if none does the best of those that can be balanced.
  double searched(double lightest, double most, const Progress& progress, bool roughly) {
    constexpr int steps = 24;
    std::vector<std::pair<double, double>> order;  // minus the ratio, and the volume
    for (int n = 1; n < steps; ++n) {
      progress.check();
      const double volume = lightest + (most - lightest) * n / steps;
      const SafestCentre best = solve(volume);
      order.emplace_back(best.attainable ? -best.ratio : kInfinity, volume);
    }
    std::stable_sort(order.begin(), order.end());
    for (const auto& [minus_ratio, volume] : order)
      if (std::isfinite(minus_ratio) && comes_back(volume))
        return roughly ? volume : refined(volume, (most - lightest) / steps, progress);
    return order.front().second;
  }

  double refined(double volume, double step, const Progress& progress) {
    const double start = volume;
    double best = solve(volume).ratio;
    for (step *= 0.5; step > 1e-3 * volume; step *= 0.5)
      for (const double other : {volume - step, volume + step}) {
        progress.check();
        const SafestCentre found = solve(other);
        if (!found.attainable || !(found.ratio > best)) continue;
        best = found.ratio;
        volume = other;
        break;
      }
    return volume == start || comes_back(volume) ? volume : start;
  }

  const Body& body_;
  const Poses& poses_;
  const PoseSpec& spec_;
  CentreSearch search_;
};

/// What the others could do without each of the poses.
std::string costs(const Body& body, const PoseSpec& spec, double ratio, const Progress& progress) {
  std::string text;
  for (std::size_t n = 0; n < spec.poses.size(); ++n) {
    const std::string words = words_without(n, body, spec, ratio, progress);
    text += (text.empty() || words.empty() ? "" : " ") + words;
  }
  return text;
}

/// The pose that is worst off at a centre of mass, and by how much, in the frame given.
std::string worst_words(const Poses& poses, const Eigen::Vector3d& centre_mm) {
  std::string text;
  double worst = kInfinity;
  for (std::size_t n = 0; n < poses.size(); ++n) {
    const Placed& p = poses[n];
    if (p.pose.kind != Pose::Kind::stands) continue;
    const std::vector<double> distances = p.polygon.edge_distances_mm((p.turn * centre_mm).head<2>());
    const double inside_mm = *std::min_element(distances.begin(), distances.end());
    if (inside_mm >= worst) continue;
    worst = inside_mm;
    text = "its centre of mass lies " + number(std::max(0.0, -inside_mm), 2) + " mm beside its base " + poses.words(n) + " (" +
           number(p.polygon.area_mm2, 1) + " mm2)";
  }
  return text;
}

/// How far beside its vertical the nearest centre of mass lies.
std::string vertical_words(const Poses& poses, const Eigen::Vector3d& centre_mm) {
  const Placed& p = poses[0];
  if (p.pose.kind == Pose::Kind::floats)
    return "the centre of mass cannot be brought below the metacentre on the vertical it needs";
  const bool hangs = p.pose.kind == Pose::Kind::hangs;
  const Eigen::Vector3d string = (hangs ? p.pose.point_mm : p.contact_mm) - centre_mm;
  const double below_mm = p.up.dot(string);
  return "the nearest any inside brings the centre of mass lies " + number((string - below_mm * p.up).norm(), 2) +
         " mm beside the vertical through " + (hangs ? "that point and " + number(below_mm, 2) + " mm below it" : "its contact");
}

/// Those of several poses that are out of reach by themselves.
std::string alone_words(const Body& body, const PoseSpec& spec, const Progress& progress) {
  std::string text;
  for (const Pose& pose : spec.poses) {
    PoseSpec alone = spec;
    alone.poses = {pose};
    const Poses poses(body, alone);
    try {
      Chooser chooser(body, poses, alone);
      if (is_good(chooser.solve(chooser.volume_mm3(progress, true)))) continue;
    } catch (const Error& error) {
      if (error.code() == ErrorCode::interrupted) throw;
    }
    text += (text.empty() ? "; by itself it is out of reach " : ", and ") + words_of(pose, spec.up);
  }
  return text;
}

Error contradiction(const Body& body, const PoseSpec& spec, const SafestCentre& best, const Progress& progress) {
  const Poses poses(body, spec);
  const Eigen::Vector3d centre_mm = body.to_working.inverse() * best.centre_mm;
  const bool single = poses.size() == 1;
  std::string text = single ? "It cannot be made for " + poses.words(0) + ": " : "These poses contradict each other: ";
  if (best.attainable && poses.tips())
    text += "at best " + worst_words(poses, centre_mm);
  else if (single)
    text +=
        poses[0].pose.kind == Pose::Kind::stands ? "at best " + worst_words(poses, centre_mm) : vertical_words(poses, centre_mm);
  else
    text += "no inside gives the body a centre of mass that suits all of them" + alone_words(body, spec, progress);
  std::optional<double> volume;
  try {
    if (poses.any(Pose::Kind::floats)) volume = poses.given_volume_mm3();
  } catch (const Error&) {
    volume.reset();
  }
  if (volume || !poses.any(Pose::Kind::floats))
    if (const auto apart = poses.apart(volume))
      text += "; the vertical that " + poses.words(apart->one) + " needs and that of " + poses.words(apart->other) + " pass " +
              number(apart->distance_mm, 2) + " mm beside each other";
  const std::string without = costs(body, spec, -kInfinity, progress);
  return {ErrorCode::goal, text + "." + (without.empty() ? "" : " " + without) + scarce_words(body.inner.rays.grid)};
}

/// Which way down the best interior goes as far as it can, a unit vector of the working frame; none: the best centre of mass is not
/// at the edge of what is attainable.
std::optional<Eigen::Vector3d> downhill(const Poses::Freedom& freedom, const SafestCentre& best,
                                        const Eigen::Matrix3d& to_working) {
  const Eigen::Vector3d slope = best.slope;
  if (freedom.ways == 3 && slope.norm() > kFlat) return -slope.normalized();
  if (freedom.ways != 1) return std::nullopt;
  const Eigen::Vector3d along = to_working * freedom.along;
  const double rise = slope.dot(along);
  if (!(std::abs(rise) > kFlat)) return std::nullopt;
  return rise > 0 ? Eigen::Vector3d(-along) : along;
}

/// A row of a problem, for moments: values near 1 matter.
Moments functional(const CentreProblem::Row& row, const Body& body) {
  Moments a = Moments::Zero();
  a.head<4>() = row / (body.solid[M1] * body.diagonal_mm);
  return a;
}

/// The lightest with ratios no smaller than this. theory.md (70)
Goal lightest_goal(const CentreProblem& problem, double ratio, const Eigen::Vector3d& centre_mm, const Body& body) {
  Goal rows;
  const auto levels = static_cast<Eigen::Index>(problem.level.size());
  rows.J.resize(levels, 10);
  rows.c_0 = Eigen::VectorXd::Zero(levels);
  for (Eigen::Index k = 0; k < levels; ++k)
    rows.J.row(k) = functional(problem.level[static_cast<std::size_t>(k)], body).transpose();
  for (const CentreProblem::Row& row : problem.at_most) rows = with_at_most(std::move(rows), functional(row, body), 0);
  for (const CentreProblem::Ratio& r : problem.ratios)
    rows = with_at_most(std::move(rows), functional((ratio * r.run - r.rise) / std::hypot(1, ratio), body), 0);
  // Inertia keeps the ends of rays along the plane continuous, as in TargetGoal.
  Moments q = Moments::Zero();
  q.segment<3>(MXX).setConstant(1e-2 / (body.solid[M1] * body.diagonal_mm * body.diagonal_mm));
  q = moment_map(Eigen::Affine3d(Eigen::Translation3d(-centre_mm))).transpose() * q;
  q[M1] += 1 / body.solid[M1];
  return linear_goal(q, rows);
}

/// How far beyond its constraints a body is.
double excess(const Goal& goal, const Moments& s) {
  Eigen::VectorXd c = goal.constraint_values(s);
  c.tail(goal.at_most) = c.tail(goal.at_most).cwiseMax(0);
  return c.size() > 0 ? c.cwiseAbs().maxCoeff() : 0;
}

/// Goal and error of a plan for the best centre of mass that was found on its body.
void aim(Plan& plan, const Poses& poses, const SafestCentre& best, std::optional<double> volume_mm3) {
  const Body& body = *plan.body;
  const double L = body.diagonal_mm;
  const Poses::Freedom freedom = poses.freedom();
  const std::optional<Eigen::Vector3d> down = downhill(freedom, best, body.to_working.linear());
  Eigen::Vector3d centre = best.centre_mm;
  const auto off_mass = [volume_mm3](const Moments& s) { return volume_mm3 ? std::abs(s[M1] / *volume_mm3 - 1) : 0; };
  // The rays run down the slope, unless few of them took it for another.
  if (down && -down->z() > 0.9) {
    const Eigen::Vector2d target = centre.head<2>();
    plan.goal = volume_mm3 ? float_goal(*volume_mm3, target, L) : stand_goal(target, body.solid[M1], L);
    plan.error = [=](const Moments& s) { return std::max(off_mass(s), (s.segment<2>(MX) / s[M1] - target).norm() / L); };
    return;
  }
  if (down) {
    // At the edge of what is attainable nothing is left to correct the mesh with.
    const Moments half = body.shell + 0.5 * body.integrals->full();
    const Eigen::Vector3d inward = half.segment<3>(MX) / half[M1] - centre;
    const Eigen::Vector3d along = body.to_working.linear() * freedom.along;
    centre += 0.02 * (freedom.ways == 3 ? inward : Eigen::Vector3d(inward.dot(along) * along));
  }
  plan.goal = centred_goal(centre, volume_mm3, body, print_of(plan.spec).density_g_cm3);
  plan.error = [=](const Moments& s) { return std::max(off_mass(s), (s.segment<3>(MX) / s[M1] - centre).norm() / L); };
}

/// What is proven, and what each pose costs.
struct Claim {
  CentreProblem problem;  ///< in the working frame
  std::string named;      ///< what of a problem without feet the depth is below
  bool tips;
  bool lightest;
  std::string costs;
};

/// No interior within the constraints is lighter: by the multipliers of the last solution.
void prove_lightest(const Plan& plan, const Moments& constant, HollowResult& result) {
  const RayIntegrals& rays = *plan.body->integrals;
  QuadricOptions warm;
  warm.multipliers = result.solve.multipliers;
  const QuadricSolution last = solve_quadric(plan.goal, rays, constant, warm);
  if (!last.converged) return;
  const double V = plan.body->solid[M1];
  const Moments q = Moments::Unit(M1) / V + plan.goal.J.transpose() * last.multipliers;
  const double bound = last.multipliers.dot(plan.goal.c_0) + q.dot(constant) + rays.least(q, last.price);
  const double g = 1e-3 * print_of(plan.spec).density_g_cm3;
  const double found_g = g * last.moments[M1];
  result.proof_figures = {{.name = "mass_g", .words = "", .unit = Unit::g, .value = found_g},
                          {.name = "smallest_possible_g", .words = "", .unit = Unit::g, .value = g * V * bound}};
  result.proof.insert(result.proof.begin(), "no other inside that stands so safely is lighter than " + number(g * V * bound, 3) +
                                                " g (proven on these rays, on which this one weighs " + number(found_g, 3) + " g)");
}

void prove(const Claim& claim, const Plan& plan, const Moments& constant, HollowResult& result) {
  if (claim.lightest) {
    prove_lightest(plan, constant, result);
    return;
  }
  const RayIntegrals& rays = *plan.body->integrals;
  CentreSearch search(rays, constant);
  const SafestCentre best = search.solve(claim.problem);
  if (!claim.costs.empty()) result.proof = {claim.costs};
  if (!best.attainable) return;
  const Moments s = constant + rays.priced(result.q, result.price).pass.moments;
  const double found = claim.problem.smallest_ratio(s.segment<3>(MX) / s[M1]);
  if (claim.tips) {
    result.proof_figures = {{.name = "smallest_tipping_angle_rad", .words = "", .unit = Unit::rad, .value = std::atan(found)},
                            {.name = "largest_possible_rad", .words = "", .unit = Unit::rad, .value = std::atan(best.bound)}};
    result.proof.insert(result.proof.begin(), "no other inside makes the smallest tipping angle of all poses larger than " +
                                                  number(degrees(std::atan(best.bound)), 4) +
                                                  " degrees (proven on these rays), this one has " +
                                                  number(degrees(std::atan(found)), 4));
    return;
  }
  const double L = plan.body->diagonal_mm;
  result.proof_figures = {{.name = "depth_mm", .words = "", .unit = Unit::mm, .value = L * found},
                          {.name = "largest_possible_mm", .words = "", .unit = Unit::mm, .value = L * best.bound}};
  result.proof.insert(result.proof.begin(), "no other inside brings its centre of mass farther below its " + claim.named +
                                                " than " + number(L * best.bound, 4) + " mm (proven on these rays), this one " +
                                                number(L * found, 4));
}

/// @throws Error{goal} when it does not right itself, or not as safely as asked for
void require_rest(const Body& body, const Poses& poses, const PoseSpec& spec, const SafestCentre& best, const Progress& progress) {
  require_righted(body, poses, best.centre_mm, progress);
  if (spec.least_tip_deg && best.ratio < std::tan(*spec.least_tip_deg * std::numbers::pi / 180))
    throw Error(ErrorCode::goal, "It cannot stand so safely: at best it " + safety_words(poses, best.ratio, body.diagonal_mm) +
                                     ", and that shall be no less than " + number(*spec.least_tip_deg, 2) + " degrees.");
}

}  // namespace

void require_weight(const Body& body, const PoseSpec& spec, double volume_mm3) {
  const double lightest = body.shell[M1];
  const double heaviest = (body.shell + body.integrals->full())[M1];
  if (volume_mm3 >= lightest && volume_mm3 <= heaviest) return;
  const double g = 1e-3 * spec.print.density_g_cm3;
  throw Error(ErrorCode::goal, "It cannot float like that: it may weigh " + number(g * volume_mm3, 2) +
                                   " g, and whatever is inside it weighs between " + number(g * lightest, 2) + " and " +
                                   number(g * heaviest, 2) + " g.");
}

void require_feet(const Poses& poses, const PoseSpec& spec, const Body& body) {
  for (std::size_t n = 0; n < poses.size(); ++n) {
    const Placed& p = poses[n];
    if (p.pose.kind != Pose::Kind::stands || p.polygon.corners_mm.size() >= 3) continue;
    const double tolerance = spec.contact_tolerance_mm.value_or(contact_tolerance_mm(p.height_mm));
    const GroundRest rest = ground_rest(body.hull, body.solid.segment<3>(MX) / body.solid[M1], body.to_working.linear() * p.up);
    Eigen::Vector3d up = body.to_working.linear().transpose() * rest.up;
    up = up.unaryExpr([](double x) { return std::abs(x) < 1e-9 ? 0 : x; });
    const double off = angle_between(up, p.up);
    throw Error(ErrorCode::goal, "It cannot be " + poses.words(n) + ": it touches the ground in " +
                                     (p.polygon.corners_mm.size() < 2 ? "a point" : "an edge") + " only (within " +
                                     number(tolerance, 3) + " mm of its lowest point). Let go like that it comes to rest, solid, " +
                                     number(degrees(off), 1) + " degrees off, with " + shown(up) + " up.");
  }
}

void require_righted(const Body& body, const Poses& poses, const Eigen::Vector3d& centre_mm, const Progress& progress) {
  for (std::size_t n = 0; n < poses.size(); ++n) {
    const Placed& p = poses[n];
    if (p.pose.kind != Pose::Kind::rights) continue;
    const Righted state = righted(body.hull, centre_mm, body.to_working.linear() * p.up, progress);
    if (state.rests && state.tilt_rad <= kLeastRighted) continue;
    throw Error(ErrorCode::goal,
                "It cannot be " + poses.words(n) + ": even with its centre of mass where it is best, " +
                    (state.rests ? "it also rests " + number(degrees(state.tilt_rad), 1) + " degrees off, with " +
                                       shown(Eigen::Vector3d(body.to_working.linear().transpose() * state.up)) + " up."
                                 : "it does not come to rest."));
  }
}

PoseSpec filled_in(const PoseSpec& spec, const Poses& poses, std::optional<double> volume_mm3) {
  PoseSpec found = spec;
  for (std::size_t n = 0; n < poses.size(); ++n)
    if (poses[n].pose.kind == Pose::Kind::floats) found.poses[n].waterline_mm = poses.afloat(poses[n], *volume_mm3).waterline_mm;
  return found;
}

std::string words_without(std::size_t n, const Body& body, const PoseSpec& spec, double ratio, const Progress& progress) {
  PoseSpec fewer = spec;
  fewer.poses.erase(fewer.poses.begin() + static_cast<std::ptrdiff_t>(n));
  if (fewer.poses.empty()) return {};
  const Poses poses(body, fewer);
  try {
    Chooser chooser(body, poses, fewer);
    const SafestCentre best = chooser.solve(chooser.volume_mm3(progress, true));
    const bool same_kind = poses.tips() == Poses(body, spec).tips();
    if (!is_good(best) || (same_kind && best.ratio < 1.001 * ratio)) return {};
    return "Without " + words_of(spec.poses[n], spec.up) + " it " + safety_words(poses, best.ratio, body.diagonal_mm) + ".";
  } catch (const Error& error) {
    if (error.code() == ErrorCode::interrupted) throw;
    return {};
  }
}

Plan plan(const Mesh& solid, const PoseSpec& spec, const HollowOptions& options, const Progress& progress) {
  if (options.solver != Solver::quadric) throw Error(ErrorCode::usage, "Poses are met by the quadric solver only.");
  if (std::any_of(spec.poses.begin(), spec.poses.end(), [](const Pose& pose) { return pose.kind == Pose::Kind::spins; }))
    return plan_top(solid, spec, options, progress);
  HollowOptions few = options;
  few.resolution = std::min(options.resolution, kFewRays);
  const std::shared_ptr<Body> first = upright_body(solid, spec.up, discretisation(spec.print, few), few, progress);
  progress.begin("poses");
  const Poses poses(*first, spec);
  require_feet(poses, spec, *first);
  Chooser coarse(*first, poses, spec);
  std::optional<double> volume = coarse.volume_mm3(progress);
  SafestCentre best = coarse.solve(volume);
  if (!is_good(best)) throw contradiction(*first, spec, best, progress);
  Claim claim{{}, named(poses), poses.tips(), spec.least_tip_deg.has_value(), costs(*first, spec, best.ratio, progress)};

  Plan plan;
  const auto down = downhill(poses.freedom(), best, first->to_working.linear());
  const Eigen::Vector3d up = down ? Eigen::Vector3d(first->to_working.linear().transpose() * -*down) : spec.up;
  plan.body = upright_body(solid, up, discretisation(spec.print, options), options, progress);
  const Body& body = *plan.body;
  progress.begin("poses");
  Chooser fine(body, poses, spec);
  best = fine.solve(volume);
  if (!is_good(best) && volume && !poses.given_volume_mm3()) best = fine.solve(volume = fine.volume_mm3(progress));
  if (!is_good(best)) throw contradiction(body, spec, best, progress);
  require_rest(body, poses, spec, best, progress);
  if (volume && !fine.comes_back(*volume))
    throw Error(ErrorCode::goal,
                "It does not float upright: let go tilted by 10 degrees it does not come back, or not with 1 % more plastic than "
                "planned.");
  plan.spec = filled_in(spec, poses, volume);
  plan.setup.solver = options.solver;
  plan.setup.scale = {body.solid[M1], body.diagonal_mm};
  plan.setup.options = options.solve;
  claim.problem = moved(poses.problem(volume), body.to_working);
  aim(plan, poses, best, volume);
  if (spec.least_tip_deg && !volume) {
    plan.goal = lightest_goal(claim.problem, std::tan(*spec.least_tip_deg * std::numbers::pi / 180), best.centre_mm, body);
    plan.error = [goal = plan.goal](const Moments& s) { return excess(goal, s); };
  }
  plan.prove = [claim](const Plan& p, const Moments& constant, HollowResult& result) { prove(claim, p, constant, result); };
  return plan;
}

}  // namespace rayrep::detail
