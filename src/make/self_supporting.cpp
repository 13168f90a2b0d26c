#include "make/self_supporting.h"

#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <utility>

#include "base/rotation.h"
#include "base/text.h"
#include "make/as_built.h"
#include "make/carriers.h"
#include "make/drain_refusal.h"
#include "make/plan.h"
#include "rayrep/base/error.h"

namespace rayrep::detail {
namespace {

constexpr int kMostRounds = 8;
/// So many of them begin anew on all of the inner domain: what was carried for earlier cuts only takes room.
constexpr int kAnew = 3;
/// By how much more the cut is let rise each round from then on, and at most, over what it was first.
constexpr double kMoreRoom = 4;
constexpr double kMostRoom = 8;
/// Of the cavity's surface: roofs that are flatter and may be left, as rays see them.
constexpr double kLeft = 0.001;

double radians(double degrees) { return degrees * std::numbers::pi / 180; }

Plan plan_of(const Mesh& solid, const Spec& spec, const HollowOptions& options, const Progress& progress) {
  return std::visit([&](const auto& s) { return plan(solid, s, options, progress); }, spec);
}

/// A plan, and what comes of it in the model.
struct Planned {
  Plan plan;
  InteriorSolver::Solved solved;
};

Planned planned(const Mesh& solid, const Spec& spec, const HollowOptions& options, const Progress& progress) {
  Planned result{plan_of(solid, spec, options, progress), {}};
  const Plan& plan = result.plan;
  progress.begin("solve");
  InteriorSolver solver(plan.goal, plan.body->inner.rays, *plan.body->integrals, plan.setup);
  result.solved = solver.solve(plan.body->shell, progress);
  if (result.solved.report.status != SolveStatus::converged) throw unsolved(result.solved.report);
  return result;
}

/// A body's frame turned such that it is printed along z.
class PrintFrame {
public:
  PrintFrame(const Body& body, const Eigen::Vector3d& direction)
      : turn_(up_to_z(body.to_working.linear() * direction)),
        surface_(transformed(body.surface.mesh(), turn_), body.surface.farther()),
        body_(body) {}

  KeptSolid solid() const { return {surface_, body_.kept_from()}; }
  Eigen::Vector3d of_given(const Eigen::Vector3d& p) const { return turn_ * (body_.to_working * p); }
  /// The same function of the point.
  Moments quadric(const Moments& q) const { return moment_map(turn_.inverse()).transpose() * q; }
  Mesh in_given_frame(const Mesh& mesh) const { return transformed(mesh, body_.to_working.inverse() * turn_.inverse()); }

private:
  Eigen::Affine3d turn_;
  SurfaceQuery surface_;
  const Body& body_;
};

/// Whether a cut of any self-supporting domain is so, too: by a plane that is a floor or a steep wall. theory.md (97)
bool carries_itself(const Moments& q, double angle_rad, double size_mm) {
  const Eigen::Vector3d gradient = q.segment<3>(MX);
  if (quadric_hessian(q).norm() * size_mm > 1e-9 * gradient.norm()) return false;
  return -gradient.z() <= std::cos(angle_rad) * gradient.norm();
}

/// Whether there may be another way.
bool is_refusal(const Error& error) { return error.code() == ErrorCode::goal || error.code() == ErrorCode::solver; }

/// What is asked for, along one direction.
struct Wanted {
  const Mesh& solid;
  const Spec& spec;  ///< without that it is self-supporting
  double angle_rad;
  Eigen::Vector3d direction;
};

/// @throws Error{usage} when they are too thin to be meshed
double pillar_mm(const Print& print, double size_mm) {
  const double least_mm = 2.1 * least_pillar_clearance_mm(size_mm);
  if (print.min_feature_mm.value_or(least_mm) < least_mm)
    throw Error(ErrorCode::usage, "Pillars of " + number(*print.min_feature_mm, 2) + " mm are too thin to be resolved in a body " +
                                      number(size_mm, 1) + " mm long: choose at least " + number(least_mm, 2) +
                                      " mm (--min-feature).");
  return print.min_feature_mm.value_or(std::max(print.wall_mm, least_mm));
}

struct Slimmed {
  Planned planned;
  HollowOptions options;  ///< with what is kept solid for it
  std::size_t carriers = 0;
  bool carried = false;  ///< every roof is; else the last cut has some that nobody looked at, or no cone can be made
};

bool carries_itself(const Planned& planned, const Wanted& wanted) {
  const Body& body = *planned.plan.body;
  return carries_itself(PrintFrame(body, wanted.direction).quadric(planned.solved.q), wanted.angle_rad, body.size_mm);
}

/// Holes where they were asked for, straight through the wall and as far into the cavity as they are wide.
std::vector<Rod> holes_in(const Body& body, const Drains& drains, double wall_mm, const PrintFrame& frame) {
  std::vector<Rod> holes;
  if (drains.where != Drains::Where::given) return holes;
  const SurfaceQuery outside(body.outer);
  for (const Eigen::Vector3d& p : drains.points_mm) {
    const ClosestPoint mouth = outside.closest(p, 2 * body.diagonal_mm + (p - body.outer.vertices.front()).norm());
    const Eigen::Vector3d& corner = body.outer.corner(static_cast<std::size_t>(mouth.triangle), 0);
    const Eigen::Vector3d outward = (body.outer.corner(static_cast<std::size_t>(mouth.triangle), 1) - corner)
                                        .cross(body.outer.corner(static_cast<std::size_t>(mouth.triangle), 2) - corner)
                                        .normalized();
    const Eigen::Vector3d end = mouth.point_mm - (wall_mm + 0.5 * drains.diameter_mm) * outward;
    holes.push_back({frame.of_given(mouth.point_mm), frame.of_given(end), 0.5 * drains.diameter_mm});
  }
  return holes;
}

/// What carries the roofs of a plan's cavity.
Carriers carriers_of(const Planned& planned, const Wanted& wanted, Carrying how, const Progress& progress) {
  progress.begin("domain");
  const PrintFrame frame(*planned.plan.body, wanted.direction);
  how.holes = holes_in(*planned.plan.body, print_of(wanted.spec).drains, how.wall_mm, frame);
  Carriers found = carriers(frame.solid(), how, progress);
  for (Mesh& bone : found.bones) bone = frame.in_given_frame(bone);
  return found;
}

/// How they are carried that stand in the way of a cut which may rise by so much yet.
Carrying carrying(const Wanted& wanted, const Body& body, double room_mm) {
  const Print& print = print_of(wanted.spec);
  return {.angle_rad = wanted.angle_rad,
          .wall_mm = print.wall_mm,
          .pillar_mm = pillar_mm(print, body.size_mm),
          .room_mm = room_mm,
          .spacing_mm = std::min(std::max(body.size_mm / 160, print.wall_mm / 3), print.wall_mm / 2),
          .within = {}};
}

/// Plans on less and less, from a plan on all of the inner domain.
Slimmed slimmed(const Wanted& wanted, const Planned& all, const HollowOptions& options, double room_mm, const Progress& progress) {
  Slimmed result{all, options};
  Carrying how = carrying(wanted, *all.plan.body, room_mm);
  result.options.pillar_clearance_mm = how.clearance_mm();
  for (int round = 0; round < kMostRounds && !result.carried; ++round) {
    const bool anew = round < kAnew;
    const Planned& before = anew ? all : result.planned;
    if (round > kAnew) how.room_mm = std::min(kMoreRoom * how.room_mm, kMostRoom * room_mm);
    const bool cut_is_no_roof = carries_itself(result.planned, wanted);
    how.within.reset();
    if (!cut_is_no_roof) how.within = PrintFrame(*before.plan.body, wanted.direction).quadric(result.planned.solved.q);
    const Carriers found = carriers_of(before, wanted, how, progress);
    result.carried = found.roof_mm2 <= kLeft * found.surface_mm2;
    if (result.carried || found.bones.empty()) break;
    if (anew) result.options.pillars = options.pillars;
    result.options.pillars.insert(result.options.pillars.end(), found.bones.begin(), found.bones.end());
    result.planned = planned(wanted.solid, wanted.spec, result.options, progress);
    result.carried = cut_is_no_roof && carries_itself(result.planned, wanted);
  }
  result.carriers = result.options.pillars.size() - options.pillars.size();
  return result;
}

/// Where the cut is a roof, with little room for it to rise; with more, where that comes to no end or leaves too little.
Slimmed slimmed(const Wanted& wanted, const Planned& all, const HollowOptions& options, const Progress& progress) {
  const double wall_mm = print_of(wanted.spec).wall_mm;
  if (carries_itself(all, wanted)) return slimmed(wanted, all, options, wall_mm, progress);
  std::optional<Slimmed> first;
  try {
    first = slimmed(wanted, all, options, wall_mm, progress);
    if (first->carried) return *first;
  } catch (const Error& error) {
    if (!is_refusal(error)) throw;
  }
  try {
    Slimmed second = slimmed(wanted, all, options, kMoreRoom * wall_mm, progress);
    return first && !second.carried ? *first : second;
  } catch (const Error& error) {
    if (!first || !is_refusal(error)) throw;
  }
  return *first;
}

std::string degrees_words(const Print& print) { return shown(print.self_supporting_deg) + " degrees"; }

/// Upright, and lying two ways.
std::vector<Eigen::Vector3d> usual_directions(const Spec& spec) {
  const Eigen::Vector3d up = up_of(spec).normalized();
  const Eigen::Matrix<double, 3, 2> lying = across(up);
  return {up, lying.col(0), lying.col(1)};
}

/// Those to choose from, of a spin without one.
std::vector<Eigen::Vector3d> directions_of(const Spec& spec, const HollowOptions& options) {
  const Print& print = print_of(spec);
  if (print.direction) return {print.direction->normalized()};
  if (!std::holds_alternative<SpinSpec>(spec) || options.as_printed) return {up_of(spec).normalized()};
  return usual_directions(spec);
}

/// The direction in which it costs least of those in which all roofs are carried, on few rays; else of all.
/// @throws Error{goal} when it can be done in none
Eigen::Vector3d best_direction(const std::vector<Eigen::Vector3d>& directions, const Wanted& wanted, const HollowOptions& options,
                               const Progress& progress) {
  if (directions.size() == 1) return directions.front();
  const HollowOptions few = on_few_rays(options);
  const Planned all = planned(wanted.solid, wanted.spec, few, progress);
  std::optional<Eigen::Vector3d> best;
  std::pair<bool, double> least;
  for (const Eigen::Vector3d& direction : directions) try {
      const Slimmed slim = slimmed({wanted.solid, wanted.spec, wanted.angle_rad, direction}, all, few, progress);
      // What gave up on roofs has more room, and may cost less for that alone.
      const std::pair cost(!slim.carried, slim.planned.solved.report.objective);
      if (best && cost >= least) continue;
      best = direction;
      least = cost;
    } catch (const Error& error) {
      if (!is_refusal(error)) throw;
    }
  return best.value_or(directions.front());
}

/// Whether the goal lowers the centre of mass and nothing else.
bool lowers(const Spec& spec) {
  const StandSpec* stand = std::get_if<StandSpec>(&spec);
  return std::holds_alternative<FloatSpec>(spec) || (stand && stand->objective == StandSpec::Objective::lowest);
}

/// What it costs, against what is proven of all of the inner domain for the same goal; in one working frame.
std::string tell_price(const Planned& all, const Slimmed& slim, Record& record) {
  const Plan& plan = slim.planned.plan;
  const Body& body = *all.plan.body;
  if (body.to_working.matrix() != plan.body->to_working.matrix()) return {};
  const QuadricSolution free = solve_quadric(plan.goal, *body.integrals, body.shell);
  if (!free.converged) return {};
  const bool proven = std::isfinite(free.lower_bound);
  const double best = proven ? free.lower_bound : free.objective;
  const double price = (slim.planned.solved.report.objective - best) / std::abs(best);
  record.emplace_back("price", price);
  if (!lowers(plan.spec))
    return "; without that the objective could be " + number(100 * price, 2) + " % lower" + (proven ? " at most (proven)" : "");
  const auto height = [](const Moments& s) { return s[MZ] / s[M1]; };
  return "; without that its centre of mass could be " + number(height(slim.planned.solved.model) - height(free.moments), 2) +
         " mm lower" + (proven ? " at most (proven)" : "");
}

/// How its roofs are carried.
std::string told(const Slimmed& slim, const Print& print, double kept) {
  const std::string flatter = "roofs that would rise less than " + degrees_words(print);
  if (slim.carriers == 0)
    return slim.carried ? "it has no " + flatter : "it has " + flatter + " where no cone on a pillar can be made";
  return plural(slim.carriers, "cone on a pillar carries ", "cones on pillars carry ") + flatter + ", and take " +
         number(100 * (1 - kept), 1) + " % of the room inside" + (slim.carried ? "" : ", but not all roofs are carried");
}

void tell(const Planned& all, const Slimmed& slim, const Print& print, HollowResult& result) {
  const double kept = slim.planned.plan.body->inner.rays.volume_mm3() / all.plan.body->inner.rays.volume_mm3();
  Record record = {{"angle_deg", print.self_supporting_deg},
                   {"carriers", static_cast<double>(slim.carriers)},
                   {"carried", slim.carried},
                   {"inner_domain_kept", kept}};
  const std::string price = tell_price(all, slim, record);
  result.proof.push_back(told(slim, print, kept) + price);
  result.proof_figures.push_back({.name = "self_supporting", .words = "", .value = record});
}

/// What is told when nothing comes of it: whatever is proven is so with these cones only.
Error refused(const Wanted& wanted, const Error& why) {
  const Print& print = print_of(wanted.spec);
  const double thick_mm = print.min_feature_mm.value_or(0);
  const std::string thinner = thick_mm > print.wall_mm
                                  ? concat(" Their pillars are ", shown(thick_mm), " mm thick and the wall ", shown(print.wall_mm),
                                           " mm: thinner ones take less (--min-feature).")
                                  : std::string();
  return Error(ErrorCode::goal,
               concat("The cones on pillars that carry its roofs along ", shown(wanted.direction),
                      " (--self-supporting) leave too little room. With them: ", why.what(), thinner,
                      " Without them it can be done: leave --self-supporting out, give it a smaller angle, or print "
                      "it in another direction (--print-direction)."));
}

/// All that leads to a plan, and that.
struct Found {
  Planned all;  ///< on all of the inner domain
  Slimmed slim;
  Spec spec;  ///< filled in, with its direction
};

Found found(const Mesh& solid, const Spec& spec, const HollowOptions& options, const Progress& progress) {
  const Print& print = print_of(spec);
  if (options.solver != Solver::quadric)
    throw Error(ErrorCode::usage, "Only --solver quadric makes self-supporting cavities: leave the other solver out.");
  Spec plain = spec;
  print_of(plain).self_supporting_deg = 0;
  Wanted wanted{solid, plain, radians(print.self_supporting_deg), up_of(spec)};
  const Planned all = planned(solid, plain, options, progress);
  wanted.direction = best_direction(directions_of(spec, options), wanted, options, progress);
  try {
    Slimmed slim = slimmed(wanted, all, options, progress);
    Spec filled = slim.planned.plan.spec;
    Print& made = print_of(filled);
    made.self_supporting_deg = print.self_supporting_deg;
    if (!print.direction && (wanted.direction - up_of(spec).normalized()).norm() > 1e-9) made.direction = wanted.direction;
    return {all, std::move(slim), std::move(filled)};
  } catch (const Error& error) {
    if (error.code() != ErrorCode::goal) throw;
    throw refused(wanted, error);
  }
}

}  // namespace

Plan plan_self_supporting(const Mesh& solid, const Spec& spec, const HollowOptions& options, const Progress& progress) {
  Found way = found(solid, spec, options, progress);
  way.slim.planned.plan.spec = way.spec;
  return std::move(way.slim.planned.plan);
}

HollowResult hollow_self_supporting(const Mesh& solid, const Spec& spec, const HollowOptions& options, const Progress& progress) {
  Found way = found(solid, spec, options, progress);
  way.slim.options.max_passes *= 3;  // with many cones cuts are made anew more often, each mended in its own way
  print_of(way.slim.planned.plan.spec).direction = print_of(way.spec).direction;  // in which its holes have to drain it
  const auto carried_out = [&] {
    try {
      return carry_out(way.slim.planned.plan, way.slim.options, progress);
    } catch (const Error& error) {
      if (error.code() != ErrorCode::goal || print_of(spec).drains.where != Drains::Where::found || options.look_only) throw;
      throw drain_refusal({solid, spec, options, way.slim.planned.plan, way.slim.options}, error, progress);
    }
  };
  HollowResult result = carried_out();
  print_of(result.spec).self_supporting_deg = print_of(way.spec).self_supporting_deg;
  print_of(result.spec).direction = print_of(way.spec).direction;
  tell(way.all, way.slim, print_of(spec), result);
  return result;
}

}  // namespace rayrep::detail
