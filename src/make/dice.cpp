#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <utility>

#include "base/rotation.h"
#include "base/text.h"
#include "make/centre_reach.h"
#include "make/centred.h"
#include "make/plan.h"
#include "mesh/convex_hull.h"
#include "rayrep/base/error.h"
#include "rayrep/physics/resting_faces.h"
#include "rayrep/solve/quadric.h"

namespace rayrep::detail {
namespace {

using Eigen::Vector3d;

constexpr int kFewRays = 60;              ///< along the longest side, to see what is attainable
constexpr std::size_t kMostFaces = 3000;  ///< of the hull, for a search; what comes of it is judged by all
constexpr double kLarge = 1e9;            ///< a ratio as bad as none
/// Of a share that is asked for. A judge allows more.
constexpr double kShareMet = 2e-3;

std::string percent(double share) { return rayrep::percent(share, 2); }
std::string up_words(const Vector3d& up) { return shown_to_thousandths(up) + " up"; }

/// The corners of the hull, so few that there are no more faces than these: of a round body those that matter most.
Mesh simplified(const Mesh& hull, std::size_t most_faces) {
  Mesh result{hull.vertices, {}};
  for (double tolerance = 1e-5 * bounding_box(hull).diagonal().norm();; tolerance *= 4) {
    const ConvexPolytope polytope = convex_hull(result.vertices, tolerance);
    result.vertices = polytope.vertices;
    if (polytope.faces.size() <= most_faces) return result;
  }
}

/// How often it falls on which face, over centres of mass in the working frame.
class Throws {
public:
  enum class For { telling, searching };

  Throws(const Body& body, const DiceSpec& spec, For purpose = For::telling)
      : tumbler_(purpose == For::searching ? simplified(body.hull, kMostFaces) : body.hull,
                 spec.shake_deg * std::numbers::pi / 180),
        spec_(spec),
        scatter_mm_(print_scatter_mm(body.diagonal_mm)),
        to_working_(body.to_working.linear()) {}

  const Tumbler& tumbler() const { return tumbler_; }

  /// Of the faces that count the shares, less what they should be; the largest first.
  struct Counted {
    std::vector<std::size_t> faces;
    std::vector<double> shares;
    Eigen::VectorXd off;
    double ratio() const { return shares.back() > 0 ? shares.front() / shares.back() : std::numeric_limits<double>::infinity(); }
  };
  /// @param faces  that count; 0: all on which it comes to rest
  Counted counted(const Vector3d& centre, int faces) const {
    const std::vector<double> shares = tumbler_.shares(centre);
    std::vector<std::size_t> order(shares.size());
    for (std::size_t f = 0; f < order.size(); ++f) order[f] = f;
    std::stable_sort(order.begin(), order.end(), [&shares](std::size_t a, std::size_t b) { return shares[a] > shares[b]; });
    const auto rests = static_cast<std::size_t>(std::count_if(shares.begin(), shares.end(), [](double s) { return s > 0; }));
    const std::size_t count = std::min(order.size(), faces > 0 ? static_cast<std::size_t>(faces) : std::max<std::size_t>(2, rests));
    Counted result;
    result.off.resize(static_cast<Eigen::Index>(count));
    for (std::size_t k = 0; k < count; ++k) {
      result.faces.push_back(order[k]);
      result.shares.push_back(shares[order[k]]);
      result.off[static_cast<Eigen::Index>(k)] = shares[order[k]] - 1 / static_cast<double>(count);
    }
    return result;
  }
  /// theory.md (72). With the number of faces left open more of them are better: the sum of squares of all shares.
  double unfairness(const Vector3d& centre, int faces) const {
    const Counted c = counted(centre, faces);
    return c.off.squaredNorm() + (faces > 0 ? 0 : 1 / static_cast<double>(c.faces.size()));
  }
  Counted counted(const Vector3d& centre) const { return counted(centre, spec_.faces); }

  /// Whether it comes to rest on all the faces that it shall have, and on each of them nearly as often.
  bool is_fair(const Vector3d& centre) const {
    return rests(centre) >= wanted_faces() && counted(centre).ratio() <= spec_.fairness;
  }
  std::size_t rests(const Vector3d& centre) const { return tumbler_.rests(centre).size(); }
  double fairness() const { return spec_.fairness; }
  int faces() const { return spec_.faces; }
  std::size_t wanted_faces() const { return static_cast<std::size_t>(std::max(2, spec_.faces)); }

  double load(const Vector3d& centre) const {
    const Vector3d up = to_working_ * spec_.load->up;
    return share_with_up(tumbler_.rests(centre), up);
  }
  /// At its worst where the print's centre of mass may lie. @param floor  what is no more than that need not be known exactly
  double sure_load(const Vector3d& centre, double floor) const {
    double least = load(centre);
    if (least <= floor) return least;
    for (int axis = 0; axis < 3; ++axis)
      for (const double sign : {-1.0, 1.0}) {
        try {
          least = std::min(least, load(centre + sign * scatter_mm_ * Vector3d::Unit(axis)));
        } catch (const Error&) {
          // The hull of a tiny body ends nearer than that, and with it its shares.
        }
      }
    return least;
  }

  /// d off / d centre by central differences.
  Eigen::MatrixXd slopes(const Vector3d& centre, const Counted& at, double step_mm) const {
    std::array<std::vector<double>, 6> shares;
    tbb::parallel_for(0, 6, [&](int n) {
      const Vector3d step = (n % 2 == 0 ? 1 : -1) * step_mm * Vector3d::Unit(n / 2);
      shares[static_cast<std::size_t>(n)] = tumbler_.shares(centre + step);
    });
    Eigen::MatrixXd J(at.off.size(), 3);
    for (int axis = 0; axis < 3; ++axis)
      for (std::size_t k = 0; k < at.faces.size(); ++k)
        J(static_cast<Eigen::Index>(k), axis) = (shares[static_cast<std::size_t>(2 * axis)][at.faces[k]] -
                                                 shares[static_cast<std::size_t>(2 * axis + 1)][at.faces[k]]) /
                                                (2 * step_mm);
    return J;
  }

private:
  Tumbler tumbler_;
  const DiceSpec& spec_;
  double scatter_mm_;
  Eigen::Matrix3d to_working_;
};

/// A centre of mass that was chosen.
struct Choice {
  Vector3d centre = Vector3d::Zero();
  double value = -std::numeric_limits<double>::infinity();  ///< the larger the better
};

/// Searches the centres of mass that some inside has.
class CentreChooser {
public:
  CentreChooser(const Body& body, const Throws& throws, const Progress& progress)
      : throws_(throws), reach_(*body.integrals, body.shell), size_mm_(body.diagonal_mm), progress_(progress) {
    solid_ = reach_.nearest(body.solid.segment<3>(MX) / body.solid[M1]);
  }

  CentreReach& reach() { return reach_; }
  const Vector3d& solid() const { return solid_; }

  /// Where it falls fairly on as many faces as it can, or else where its shares are nearest to equal. theory.md (72)
  Vector3d fairest() {
    Vector3d best = fairest_of(throws_.faces());
    if (throws_.faces() > 0 || throws_.is_fair(best)) return best;
    // More faces are not better where fewer are fair.
    Throws::Counted at = throws_.counted(best);
    for (int faces = static_cast<int>(at.faces.size()) - 1; faces >= 2; --faces) {
      const Vector3d centre = fairest_of(faces);
      if (throws_.is_fair(centre)) return centre;
      Throws::Counted there = throws_.counted(centre);
      if (there.ratio() >= at.ratio()) continue;
      at = std::move(there);
      best = centre;
    }
    return best;
  }
  /// Where one face has its largest share, or its smallest one: steps in 26 directions, halved. Shares jump where faces cease to
  /// hold.
  Choice extreme(bool largest) {
    const auto value = [this, largest](const Vector3d& c, double floor) {
      return largest ? throws_.sure_load(c, floor) : -throws_.load(c);
    };
    const std::vector<Choice> starts = best_of(value);
    if (largest && !(starts.front().value > 0)) return starts.front();  // nowhere does it fall so
    return climbed(starts, 5e-3, value);
  }

private:
  /// @param floor  what is no more than that need not be known exactly
  using Value = std::function<double(const Vector3d&, double floor)>;

  /// By least squares, and where these do not make the shares nearly equal by the largest over the smallest of as many faces.
  /// @param faces  as Throws::counted
  Vector3d fairest_of(int faces) {
    const Choice squares = least_squares(faces);
    const Throws::Counted at = throws_.counted(squares.centre, faces);
    // What prints scatter is more.
    if (at.ratio() - 1 <= 0.25 * (throws_.fairness() - 1)) return squares.centre;
    const auto value = [this, faces, count = at.faces.size()](const Vector3d& c, double) {
      const Throws::Counted there = throws_.counted(c, faces);
      return there.faces.size() < count ? -kLarge : -std::min(kLarge, there.ratio());
    };
    std::vector<Choice> starts{best_of(value).front()};
    starts.push_back({squares.centre, value(squares.centre, -kLarge)});
    return climbed(starts, 1e-3, value).centre;
  }

  /// Gauss and Newton from the best of many places.
  Choice least_squares(int faces) {
    const auto value = [this, faces](const Vector3d& c, double) { return -throws_.unfairness(c, faces); };
    Choice best;
    for (Choice start : best_of(value)) {
      for (int n = 0; n < 60; ++n) {
        progress_.check();
        const Choice next = newton_step(start, faces, value);
        if (!(next.value > start.value + 1e-15)) break;
        start = next;
      }
      if (start.value > best.value) best = start;
    }
    return best;
  }

  /// The best that steps lead to from any of the starts. @param least_step  over the size of what is attainable
  Choice climbed(const std::vector<Choice>& starts, double least_step, const Value& value) {
    Choice best;
    for (Choice start : starts) {
      for (double step = 0.5 * reach_.size_mm(); step > least_step * reach_.size_mm();) {
        progress_.check();
        const Choice next = best_step(start, step, value);
        if (next.value > start.value + 1e-9)
          start = next;
        else
          step *= 0.5;
      }
      if (start.value > best.value) best = start;
    }
    return best;
  }

  std::vector<Choice> evaluated(const std::vector<Vector3d>& places, double floor, const Value& value) const {
    std::vector<Choice> all(places.size());
    tbb::parallel_for(std::size_t{0}, places.size(), [&](std::size_t n) { all[n] = {places[n], value(places[n], floor)}; });
    return all;
  }

  /// The three best of places all over what is attainable.
  std::vector<Choice> best_of(const Value& value) {
    std::vector<Vector3d> places{solid_, reach_.middle()};
    for (const Vector3d& far : reach_.found())
      for (const double part : {0.25, 0.5, 0.75, 1.0}) places.push_back(reach_.middle() + part * (far - reach_.middle()));
    std::vector<Choice> all = evaluated(places, -kLarge, value);
    std::stable_sort(all.begin(), all.end(), [](const Choice& a, const Choice& b) { return a.value > b.value; });
    constexpr std::size_t starts = 3;
    if (all.size() > starts) all.resize(starts);
    return all;
  }

  Choice newton_step(const Choice& from, int faces, const Value& value) {
    const Throws::Counted at = throws_.counted(from.centre, faces);
    const Eigen::MatrixXd J = throws_.slopes(from.centre, at, 1e-5 * size_mm_);
    const Vector3d gradient = J.transpose() * at.off;
    if (gradient.norm() > 0) reach_.look(-gradient);
    const Vector3d to = reach_.least(J, at.off - J * from.centre, from.centre);
    for (double part = 1; part > 1e-4; part *= 0.5) {
      const Vector3d place = from.centre + part * (to - from.centre);
      if (const double v = value(place, from.value); v > from.value) return {place, v};
    }
    return from;
  }

  Choice best_step(const Choice& from, double step_mm, const Value& value) {
    std::vector<Vector3d> wanted, places;
    for (const Vector3d& direction : cube_directions()) {
      wanted.push_back(from.centre + step_mm * direction.normalized());
      places.push_back(reach_.nearest(wanted.back()));
    }
    const std::vector<Choice> all = evaluated(places, from.value, value);
    std::size_t best = 0;
    for (std::size_t n = 1; n < all.size(); ++n)
      if (all[n].value > all[best].value) best = n;
    // At its edge what is attainable is known better by looking there.
    if (const Vector3d outward = wanted[best] - places[best]; outward.norm() > 1e-3 * step_mm) reach_.look(outward);
    return all[best].value > from.value ? all[best] : from;
  }

  const Throws& throws_;
  CentreReach reach_;
  double size_mm_;
  const Progress& progress_;
  Vector3d solid_;
};

Error unfair(const Throws& throws, const DiceSpec& spec, const Body& body, const Vector3d& centre, bool at_edge) {
  const Throws::Counted c = throws.counted(centre);
  const Eigen::Matrix3d back = body.to_working.linear().transpose();
  const auto face = [&](std::size_t k) {
    return percent(c.shares[k]) + " of all throws with " + up_words(back * throws.tumbler().up(c.faces[k]));
  };
  const std::size_t rests = throws.rests(centre);
  const std::size_t last = c.faces.size() - 1;
  std::string text = "It cannot fall fairly: ";
  if (rests < throws.wanted_faces())
    return {ErrorCode::goal, text + "with its centre of mass where its shares are nearest to equal it comes to rest on " +
                                 plural(rests, "face", "faces") + " only."};
  text += "with its centre of mass where its shares are nearest to equal it comes to rest in " + face(0) + " and in " + face(last) +
          ", " + number(c.ratio(), 2) + " times as often, and --fairness allows " + shown(spec.fairness) + ". " +
          (at_edge ? "No inside brings its centre of mass farther."
                   : "That is its shape: no other centre of mass that the search tried is better.");
  if (spec.faces == 0 && rests > 2)
    text += " It comes to rest on " + std::to_string(rests) +
            " faces: --faces N counts the N that it falls on most often, --shake DEG leaves out those that hardly hold it.";
  return {ErrorCode::goal, text + (at_edge ? scarce_words(body.inner.rays.grid) : "")};
}

/// Of an attitude in which it does not come to rest. @param solid  the centre of mass of the solid
Error never(const Throws& throws, const Body& body, const Vector3d& solid) {
  std::string text;
  const std::vector<RestingFace> rests = throws.tumbler().rests(solid);
  for (std::size_t k = 0; k < std::min<std::size_t>(rests.size(), 6); ++k)
    text +=
        (k > 0 ? ", " : "") + up_words(body.to_working.linear().transpose() * rests[k].up) + " (" + percent(rests[k].share) + ")";
  return {ErrorCode::goal,
          "It never comes to rest like that with any centre of mass that was tried. Solid it does with " + text + "."};
}

/// The centre of mass for a share that was asked for, on the way from that of the solid to the one where it is largest or smallest.
Vector3d centre_for_share(CentreChooser& chooser, const Throws& throws, double wanted, const Body& body) {
  const double before = throws.load(chooser.solid());
  const Choice best = chooser.extreme(wanted > before);
  const Vector3d run = best.centre - chooser.solid();
  const auto missing = [&](double t) { return (wanted > before ? 1 : -1) * (wanted - throws.load(chooser.solid() + t * run)); };
  constexpr int steps = 64;
  double lo = 0;
  double hi = 1;
  for (int n = 1; n <= steps; ++n) {
    hi = static_cast<double>(n) / steps;
    if (missing(hi) <= 0) break;
    if (n < steps) lo = hi;
  }
  for (int n = 0; n < 40; ++n) {
    const double t = 0.5 * (lo + hi);
    (missing(t) > 0 ? lo : hi) = t;
  }
  if (std::abs(missing(hi)) <= kShareMet) return chooser.solid() + hi * run;
  if (std::abs(missing(lo)) <= kShareMet) return chooser.solid() + lo * run;
  const double beyond = throws.load(chooser.solid() + hi * run);
  const double within = throws.load(chooser.solid() + lo * run);
  const bool out_of_reach = missing(hi) > 0;
  throw Error(ErrorCode::goal,
              (out_of_reach
                   ? "It cannot fall like that so often or so seldom: with the farthest centre of mass that was found it does in " +
                         percent(beyond) + " of all throws; solid it does in " + percent(before) + "."
                   : "Between " + percent(within) + " and " + percent(beyond) +
                         " its share jumps, as another face ceases to hold it: ask for one of these.") +
                  (out_of_reach ? scarce_words(body.inner.rays.grid) : ""));
}

/// Where the centre of mass shall be.
struct Aim {
  Vector3d centre;                  ///< in the frame given
  std::optional<Vector3d> outward;  ///< at the edge of what is attainable: its normal there, in the frame given
};

Aim aim_of(const Body& body, const DiceSpec& spec, const Progress& progress) {
  const Throws throws(body, spec, Throws::For::searching);
  CentreChooser chooser(body, throws, progress);
  Vector3d centre;
  if (!spec.load) {
    centre = chooser.fairest();
  } else if (spec.load->share) {
    centre = centre_for_share(chooser, throws, *spec.load->share, body);
  } else {
    centre = chooser.extreme(true).centre;
  }
  // The search knows less of the hull of a round body.
  const Throws all(body, spec);
  if (spec.load && !(all.load(centre) > 0)) throw never(all, body, chooser.solid());
  const std::optional<Vector3d> outward = chooser.reach().outward(centre);
  if (!spec.load && !all.is_fair(centre)) throw unfair(all, spec, body, centre, outward.has_value());
  const Eigen::Matrix3d back = body.to_working.linear().transpose();
  Aim aim{body.to_working.inverse() * centre, std::nullopt};
  if (outward) aim.outward = back * *outward;
  return aim;
}

/// With further constraints: the rows take these values.
Goal with_rows(Goal goal, const Eigen::Matrix<double, Eigen::Dynamic, 10>& rows, const Eigen::VectorXd& values) {
  const Eigen::Index before = goal.J.rows();
  goal.J.conservativeResize(before + rows.rows(), 10);
  goal.J.bottomRows(rows.rows()) = rows;
  goal.c_0.conservativeResize(before + rows.rows());
  goal.c_0.tail(rows.rows()) = -values;
  return goal;
}

/// What vanishes of a body whose centre of mass this is and whose moments of inertia are equal about all axes. theory.md (73)
Eigen::Matrix<double, Eigen::Dynamic, 10> inertia_rows(const Vector3d& centre, const Body& body) {
  Eigen::Matrix<double, Eigen::Dynamic, 10> rows = Eigen::Matrix<double, Eigen::Dynamic, 10>::Zero(5, 10);
  rows(0, MXX) = 1;
  rows(0, MYY) = -1;
  rows(1, MYY) = 1;
  rows(1, MZZ) = -1;
  rows(2, MXY) = rows(3, MYZ) = rows(4, MXZ) = 1;
  const Matrix10 to_centre = moment_map(Eigen::Affine3d(Eigen::Translation3d(-centre)));
  return rows * to_centre / (body.solid[M1] * body.diagonal_mm * body.diagonal_mm);
}

/// The goal with moments of inertia as equal as insides with this centre of mass can have them.
struct Even {
  Goal goal;
  QuadricSolution solution;
};
std::optional<Even> evened(const Goal& centred, const Vector3d& centre, const Body& body, const Progress& progress) {
  const RayIntegrals& rays = *body.integrals;
  const QuadricSolution plain = solve_quadric(centred, rays, body.shell);
  if (!plain.converged) return std::nullopt;
  const auto rows = inertia_rows(centre, body);
  const Eigen::VectorXd uneven = rows * plain.moments;
  const auto at = [&](double left) -> std::optional<Even> {
    progress.check();
    Goal goal = with_rows(centred, rows, left * uneven);
    QuadricSolution solution = solve_quadric(goal, rays, body.shell);
    if (!solution.converged) return std::nullopt;
    return Even{std::move(goal), std::move(solution)};
  };
  if (auto even = at(0)) return even;
  double lo = 0;  // out of reach
  double hi = 1;
  for (int n = 0; n < 6; ++n) {
    const double left = 0.5 * (lo + hi);
    (at(left) ? hi : lo) = left;
  }
  // At the edge of what is attainable nothing is left to correct the mesh with.
  if (auto most = at(hi + 0.1 * (1 - hi))) return most;
  return Even{centred, plain};
}

/// What is known of the centre of mass that was chosen: a search found it, nothing proves it.
std::string searched_words(const DiceSpec& spec, double found, bool at_edge) {
  if (spec.load && spec.load->share) return "on the rays it falls so in " + percent(found) + " of all throws";
  return std::string("of the centres of mass that insides can have a search chose one") +
         (at_edge ? ", at the edge of those" : "") + ", with which " +
         (spec.load ? "it falls so in " + percent(found) + " of all throws"
                    : "the largest share is " + number(found, 6) + " times the smallest") +
         "; that none is better is not proven";
}

/// What came of it; of a share that was left open, what it is.
void say(const Plan& plan, const Moments& constant, bool at_edge, HollowResult& result) {
  DiceSpec& spec = std::get<DiceSpec>(result.spec);
  const Moments s = constant + plan.body->integrals->priced(result.q, result.price).pass.moments;
  const Vector3d centre = s.segment<3>(MX) / s[M1];
  const Throws throws(*plan.body, spec);
  const double value = spec.load ? throws.load(centre) : throws.counted(centre).ratio();
  result.proof = {searched_words(spec, value, at_edge)};
  result.proof_figures = {{.name = spec.load ? "load_share" : "share_ratio", .words = "", .value = value}};
  if (spec.load && !spec.load->share && value > 0) spec.load->share = value;
}

/// Goal and error of a plan for a centre of mass in its body's working frame. @returns false when no inside has it
bool aim(Plan& plan, const Aim& at, const Progress& progress) {
  const Body& body = *plan.body;
  const double L = body.diagonal_mm;
  const DiceSpec& spec = std::get<DiceSpec>(plan.spec);
  const Vector3d centre = body.to_working * at.centre;
  Moments found;
  if (at.outward) {
    const Eigen::Vector2d target = centre.head<2>();
    plan.goal = stand_goal(target, body.solid[M1], L);
    const QuadricSolution solution = solve_quadric(plan.goal, *body.integrals, body.shell);
    if (!solution.converged) return false;
    found = solution.moments;
    plan.error = [=](const Moments& s) { return (s.segment<2>(MX) / s[M1] - target).norm() / L; };
  } else {
    plan.goal = centred_goal(centre, std::nullopt, body, spec.print.density_g_cm3);
    QuadricSolution solution;
    if (spec.load) {
      solution = solve_quadric(plan.goal, *body.integrals, body.shell);
    } else if (auto even = evened(plan.goal, centre, body, progress)) {
      plan.goal = even->goal;
      solution = even->solution;
    }
    if (!solution.converged) return false;
    found = solution.moments;
    plan.error = [=](const Moments& s) { return (s.segment<3>(MX) / s[M1] - centre).norm() / L; };
  }
  const Throws throws(body, spec);
  const Vector3d reached = found.segment<3>(MX) / found[M1];
  if (spec.load && !(throws.load(reached) > 0)) throw never(throws, body, body.solid.segment<3>(MX) / body.solid[M1]);
  if (!spec.load && !throws.is_fair(reached)) throw unfair(throws, spec, body, reached, at.outward.has_value());
  plan.prove = [at_edge = at.outward.has_value()](const Plan& p, const Moments& constant, HollowResult& result) {
    say(p, constant, at_edge, result);
  };
  return true;
}

}  // namespace

Plan plan(const Mesh& solid, const DiceSpec& spec, const HollowOptions& options, const Progress& progress) {
  if (options.solver != Solver::quadric) throw Error(ErrorCode::usage, "Dice are made by the quadric solver only.");
  HollowOptions few = options;
  few.resolution = std::min(options.resolution, kFewRays);
  const std::shared_ptr<Body> first = upright_body(solid, spec.up, discretisation(spec.print, few), few, progress);
  progress.begin("throws");
  Aim at = aim_of(*first, spec, progress);
  Plan plan;
  plan.spec = spec;
  plan.setup.solver = options.solver;
  plan.setup.options = options.solve;
  // Where the rays run down the slope of the plane below which the inside is filled, what the mesh lacks can be corrected.
  const Vector3d up = at.outward ? Vector3d(-*at.outward) : spec.up;
  const Discretisation discretised = discretisation(spec.print, options);
  plan.body = upright_body(solid, up, discretised, options, progress);
  progress.begin("throws");
  // What few rays promise by a hair all of them may miss.
  const Vector3d middle = plan.body->to_working.inverse() * middling_centre(*plan.body->integrals, plan.body->shell);
  for (int n = 0; !aim(plan, at, progress); ++n) {
    if (n == 4) throw Error(ErrorCode::solver, "The solver stopped before it converged. Try another resolution (--resolution).");
    at.centre += 0.02 * (middle - at.centre);
  }
  plan.setup.scale = {plan.body->solid[M1], plan.body->diagonal_mm};
  return plan;
}

}  // namespace rayrep::detail
