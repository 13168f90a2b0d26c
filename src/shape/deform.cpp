#include "rayrep/shape/deform.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>

#include "base/text.h"
#include "make/fixed.h"
#include "make/plan.h"
#include "make/spin_search.h"
#include "mesh/crossing.h"
#include "rayrep/base/error.h"
#include "rayrep/mesh/mesh_check.h"
#include "rayrep/physics/hydrostatics.h"
#include "rayrep/physics/support_polygon.h"
#include "shape/measure.h"
#include "shape/outside.h"
#include "shape/region.h"

namespace rayrep {
namespace detail {
namespace {

/// min energy / 2 under the cuts, linear in the handles. By its dual, one unknown a cut.
struct LeastEnergy {
  Handles handles;
  double price = 0;  ///< how much it would gain per unit by which all cuts were moved
};
LeastEnergy least_energy(const Cage& cage, const Look& from) {
  std::vector<Handles> answers;
  for (const Cut& cut : from.cuts) answers.push_back(cage.compliant(cut.slope));
  const auto n = static_cast<Eigen::Index>(answers.size());
  const auto dot = [](const Handles& a, const Handles& b) { return a.cwiseProduct(b).sum(); };
  Eigen::MatrixXd G(n, n);
  Eigen::VectorXd b(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Cut& cut = from.cuts[static_cast<std::size_t>(i)];
    for (Eigen::Index j = 0; j < n; ++j) G(i, j) = dot(cut.slope, answers[static_cast<std::size_t>(j)]);
    b[i] = cut.value - dot(cut.slope, from.handles);
  }
  Eigen::VectorXd mu = Eigen::VectorXd::Zero(n);
  for (int sweep = 0; sweep < 2000; ++sweep)
    for (Eigen::Index i = 0; i < n; ++i)
      if (G(i, i) > 0) mu[i] = std::max(0.0, mu[i] + (b[i] - G.row(i).dot(mu)) / G(i, i));
  Handles handles = Handles::Zero(from.handles.rows(), 3);
  for (Eigen::Index i = 0; i < n; ++i) handles -= mu[i] * answers[static_cast<std::size_t>(i)];
  return {handles, mu.sum()};
}

double margin_of(const DeformOptions& how, const Spec& spec) {
  return how.margin.value_or(std::holds_alternative<StandSpec>(spec) ? 0.06 : 0.02);
}

constexpr double kRoom = 5e-4;  ///< with which equations are to be met: what few rays promise by a hair, many may miss

TrianglePairs crossings(const Mesh& mesh, const Progress& progress = {}) {
  return crossing_pairs(mesh, close_pairs(mesh, progress));
}

/// Sequential quadratic programming over the handles of a cage.
class OutsideSearch {
public:
  OutsideSearch(const Outside::Problem& problem, const Progress& progress)
      : outside_(problem, progress), crossed_before_(crossings(problem.solid).size()), weights_(problem.solid.vertices.size(), 1) {
    outside_.ask(margin_of(problem.how, problem.spec), kRoom);
    first_ = outside_.look(Handles::Zero(outside_.cage().handles(), 3), {});
  }

  const Look& first() const { return first_; }
  const Outside& outside() const { return outside_; }

  /// The outside of least energy whose worst cut is at most 0, from where `from` is: each step minimises the energy under the cuts,
  /// or goes a part of that way, as far as energy plus price times the worst cut falls as foretold.
  /// @param limit_mm  of the displacement from `original`
  Look search(Look from, const Mesh& original, double limit_mm) {
    constexpr int most_steps = 18;
    for (int step = 0; step < most_steps; ++step) {
      const LeastEnergy least = least_energy(cage(), from);
      const Handles way = least.handles - from.handles;
      price_ = std::max(price_, 1.5 * least.price);
      const double before = merit(from);
      const double to_gain = before - 0.5 * cage().energy(least.handles);
      if (from.worst < kClose && std::abs(to_gain) <= 0.02 * before && change_between(original, from.mesh).largest_mm < limit_mm)
        break;
      Look next = outside_.look(from.handles + part_ * way, from.cuts);
      const double foretold = before - (0.5 * cage().energy(next.handles) + (1 - part_) * price_ * from.worst);
      const double gained = before - merit(next);
      if (const TrianglePairs crossing = crossings(next.mesh); crossing.size() > crossed_before_) {
        part_ = std::max(0.7 * part_, 0.2);
        part_solid(crossing, original);
        continue;
      }
      if (gained < 0.05 * foretold && part_ > 0.05) {
        part_ *= 0.4;
        keep_cuts(next, from);
        continue;
      }
      if (gained > 0.5 * foretold) part_ = std::min(1.0, 2 * part_);
      from = std::move(next);
      if (soften(original, from.mesh, limit_mm)) cage().weigh(weights_);
      cage().keep_open(from.handles);
    }
    return from;
  }

  /// Asks for more.
  Look raise(double margin, double room, const Look& from) {
    outside_.ask(margin, room);
    return outside_.look(from.handles, from.cuts);
  }

private:
  static constexpr double kClose = 1e-4;

  Cage& cage() { return outside_.cage(); }

  double merit(const Look& look) { return 0.5 * cage().energy(look.handles) + price_ * std::max(0.0, look.worst); }

  /// Where the outside moves too far its motion counts more, and less again where it no longer does. @returns whether any does
  bool soften(const Mesh& original, const Mesh& mesh, double limit_mm) {
    bool any = false;
    for (std::size_t v = 0; v < weights_.size(); ++v) {
      const double over = (mesh.vertices[v] - original.vertices[v]).norm() / (0.95 * limit_mm);
      const double before = weights_[v];
      weights_[v] = std::max(1.0, before * std::pow(std::clamp(over, 0.5, 2.0), 3));
      any = any || weights_[v] != before;
    }
    return any;
  }

  /// Where the surface would have crossed itself it moves as one.
  void part_solid(const TrianglePairs& crossing, const Mesh& original) {
    constexpr std::size_t most = 200;
    std::vector<std::pair<int, int>> pairs;
    for (std::size_t n = 0; n < crossing.size(); n += 1 + crossing.size() / most)
      pairs.emplace_back(original.triangles[static_cast<std::size_t>(crossing[n].first)][0],
                         original.triangles[static_cast<std::size_t>(crossing[n].second)][1]);
    cage().keep_apart(pairs, original);
  }

  /// What a step that was not taken has shown counts, too.
  void keep_cuts(const Look& tried, Look& from) {
    if (!tried.cuts.empty()) from = outside_.look(from.handles, tried.cuts);
  }

  Outside outside_;
  std::size_t crossed_before_;
  Look first_;
  std::vector<double> weights_;  ///< of the vertices, in the energy
  double part_ = 1;
  double price_ = 0;
};

/// What a spin's ratio of moments lacks of `margin`, if it is solved for: a plan asks for the least sum of squares of the lateral
/// moments, of which one may be more than the axial one by a hair.
std::string too_close(const Plan& plan, double margin) {
  const SpinSpec* spin = std::get_if<SpinSpec>(&plan.spec);
  const Moments& s = plan.setup.warm.moments;
  if (!spin || !(s[M1] > 0)) return {};
  const bool largest = spin->prefer == AxisClass::largest;
  const SpinState state = spin_state(mass_properties(s, 1), Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitZ());
  const double ratio = largest ? state.ratio_larger : state.ratio_smaller;
  if ((largest ? ratio - 1 : 1 - ratio) >= margin) return {};
  return "The ratio of its moments of inertia would be " + number(ratio, 4) + ", too close to 1.";
}

/// Why it cannot be done as it is; empty: it can. @param margin  that a spin's ratio of moments is to have
std::string refusal(const Mesh& mesh, const Spec& spec, const HollowOptions& options, double margin, const Progress& progress) {
  const Progress quiet{.stage = {}, .cancelled = progress.cancelled};
  try {
    return std::visit([&](const auto& s) { return too_close(plan(mesh, s, options, quiet), margin); }, spec);
  } catch (const Error& error) {
    if (error.code() != ErrorCode::goal) throw;
    return error.what();
  }
}

/// The part of a mesh that is lower than `by_mm` pressed to next to nothing; in order, so that nothing crosses.
Mesh pressed(const Mesh& upright, double by_mm, double left_mm, const std::vector<double>& free) {
  Mesh mesh = upright;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    if (double& z = mesh.vertices[v].z(); z < by_mm && free[v] > 0) z = by_mm - left_mm * (1 - z / by_mm);
  return mesh;
}

/// A stand's lowest points pressed up until they are a foot on which it can stand with the margin.
struct Pressed {
  Mesh mesh;
  double by_mm = 0;
};
Pressed pressed_foot(const Mesh& solid, const StandSpec& spec, const DeformOptions& how, double limit_mm) {
  const Eigen::Affine3d frame = working_frame(solid, spec.up);
  const Mesh upright = transformed(solid, frame);
  const double tolerance_mm = spec.contact_tolerance_mm.value_or(contact_tolerance_mm(bounding_box(upright).sizes().z()));
  const Moments s = mesh_moments(upright);
  const double needed_mm = 1.2 * margin_of(how, spec) * s[MZ] / s[M1];
  const std::vector<double> free = freedom_beside(how.fixed, solid, 0);
  for (double by_mm = 0; by_mm <= limit_mm; by_mm = std::max(0.5 * tolerance_mm, 1.25 * by_mm)) {
    const Mesh trial = by_mm > 0 ? pressed(upright, by_mm, std::min(0.02 * tolerance_mm, 0.1 * by_mm), free) : upright;
    const SupportPolygon polygon = support_polygon(outer_hull(trial), tolerance_mm);
    // Not one that the least change would make a tip again.
    if (polygon.corners_mm.size() < 3 || support_polygon(outer_hull(trial), 1.3 * tolerance_mm).corners_mm.size() < 3) continue;
    const std::vector<double> distances = polygon.edge_distances_mm(polygon.safest_point_mm());
    if (*std::min_element(distances.begin(), distances.end()) < needed_mm) continue;
    Pressed result{solid, by_mm};
    const Eigen::Vector3d up = frame.linear().transpose().col(2);
    for (std::size_t v = 0; v < trial.vertices.size(); ++v)
      if (const double raised = trial.vertices[v].z() - upright.vertices[v].z(); raised > 0) result.mesh.vertices[v] += raised * up;
    return result;
  }
  throw Error(ErrorCode::goal, "It touches the ground in a point or an edge, and pressing that flat by the " + number(limit_mm, 2) +
                                   " mm that the outside may change (--deform-limit) makes no foot on which it can stand.");
}

Eigen::Affine3d frame_of(const Mesh& solid, const Spec& spec, const HollowOptions& options, const Progress& progress) {
  const SpinSpec* spin = std::get_if<SpinSpec>(&spec);
  if (!spin) return working_frame(solid, up_of(spec));
  return frame_about(spin_frame(solid, *spin, discretisation(spin->print, options), progress), solid);
}

void require_sense(const DeformOptions& how, const Spec& spec) {
  DeformOptions copy = how;
  rayrep::check(settings(copy));
  if (how.resolution < 20 || how.resolution > 400 || !(how.stiffness > 0 && how.stiffness < 1))
    throw Error(ErrorCode::usage, "To deform takes 20 to 400 rays and a stiffness between 0 and 1.");
  const FloatSpec* floats = std::get_if<FloatSpec>(&spec);
  const bool hovers = floats && is_submerged(*floats);
  if (hovers || !(floats || std::holds_alternative<SpinSpec>(spec) || std::holds_alternative<StandSpec>(spec)))
    throw Error(ErrorCode::usage,
                "The outside is deformed for what floats at the surface, spins or stands, and for nothing else (--deform-limit).");
}

/// What it took, or why that is too much.
Deformation outcome(const OutsideSearch& search, const Look& last, Deformation result, const Mesh& solid) {
  const Change change = change_between(solid, last.mesh);
  result.mesh = last.mesh;
  result.changed = true;
  result.rms_mm = change.rms_mm;
  result.largest_mm = change.largest_mm;
  result.normals_rad = change.normals_rad;
  result.violation_before = search.first().distance;
  result.handles = static_cast<int>(search.outside().cage().handles());
  result.iterations = search.outside().looks();
  return result;
}

/// That the limit does not allow it.
Error beyond(const Deformation& result, const Look& last, double limit_mm) {
  const double left = last.distance / std::max(result.violation_before, 1e-12);
  return {ErrorCode::goal, result.refusal + " Nor can it with an outside that is deformed by at most " + number(limit_mm, 2) +
                               " mm (--deform-limit): where the search ended it had moved by " + number(result.largest_mm, 2) +
                               " mm at most and " + number(result.rms_mm, 2) + " mm in the root mean square, and " +
                               (last.distance > 0 ? shown(100 * left, 2) + " % was left of what it falls short by as it is."
                                                  : std::string("it takes so much."))};
}

}  // namespace
}  // namespace detail

Deformation deform(const Mesh& solid, const Spec& spec, const HollowOptions& options, const DeformOptions& how,
                   const Progress& progress) {
  detail::check(options, spec);
  detail::require_sense(how, spec);
  std::visit([](const auto& s) { check(s, Setting::For::making); }, spec);
  require_size(solid);
  progress.begin("outside");
  Deformation result;
  result.diagonal_mm = bounding_box(solid).diagonal().norm();
  const double limit_mm = how.limit_mm.value_or(0.1 * result.diagonal_mm);
  result.mesh = solid;
  result.refusal = detail::refusal(solid, spec, options, 0, progress);
  if (result.refusal.empty()) return result;

  detail::Pressed foot{solid};
  if (const auto* stand = std::get_if<StandSpec>(&spec)) foot = detail::pressed_foot(solid, *stand, how, limit_mm);
  result.pressed_mm = foot.by_mm;
  progress.check();
  detail::OutsideSearch search({foot.mesh, detail::frame_of(foot.mesh, spec, options, progress), spec, options, how}, progress);
  detail::Look best = search.first();
  std::string why;
  const double asked = detail::margin_of(how, spec);
  double margin = asked;
  double room = detail::kRoom;
  for (int round = 0; round < 3; ++round) {
    best = search.search(std::move(best), solid, limit_mm);
    result = detail::outcome(search, best, std::move(result), solid);
    if (result.largest_mm > limit_mm || best.worst > std::max(1e-3, 0.1 * result.violation_before))
      throw detail::beyond(result, best, limit_mm);
    why = detail::refusal(result.mesh, spec, options, 0.3 * asked, progress);
    if (why.empty()) break;
    margin *= 1.5;
    room *= 2;
    best = search.raise(margin, room, best);
  }
  if (!why.empty())
    throw Error(ErrorCode::goal, result.refusal + " With its outside deformed by at most " + number(result.largest_mm, 2) +
                                     " mm it is nearly so, but on all rays: " + why);
  if (detail::crossings(result.mesh, progress).size() > detail::crossings(solid, progress).size())
    throw Error(ErrorCode::goal, result.refusal + " With its outside deformed by " + number(result.largest_mm, 2) +
                                     " mm it could, but the surface would cross itself.");
  return result;
}

Settings settings(DeformOptions& options) {
  return {{.name = "deform-limit",
           .value = "MM",
           .words = "if it cannot be met as it is, move the outside by at most MM",
           .details = "The outside is deformed as little as possible until the goal can be met with a margin, while the inside is "
                      "hollowed. What was changed is told, and the new outside is written as NAME_outside beside the output: it is "
                      "what the result is judged against.",
           .place = &options.limit_mm,
           .range = Range::positive(),
           .unset = "not deformed"},
          {.name = "deform-margin",
           .value = "M",
           .words = "by how much more than it takes the goal is met",
           .details = "The slope of ground on which a stand does not yet tip, how much the ratio of a spin's moments is above 1, "
                      "a float's metacentric height over that of the body.",
           .place = &options.margin,
           .range = {.lo = 0, .hi = 0.5, .open = false},
           .unset = "0.02, of a stand 0.06",
           .rare = true},
          {.name = "deform-cells",
           .value = "N",
           .words = "of the cage along the longest side, 3 to 16",
           .details = "",
           .place = &options.cells,
           .range = {.lo = 3, .hi = 16, .open = false},
           .rare = true}};
}

std::string Deformation::words() const {
  if (!changed) return {};
  return "the outside was changed: it moved by " + number(largest_mm, 2) + " mm at most and " + number(rms_mm, 2) + " mm (" +
         number(100 * rms_mm / diagonal_mm, 2) + " % of the diagonal) in the root mean square, and its normals turned by " +
         number(normals_rad * 180 / std::numbers::pi, 1) + " degrees" +
         (pressed_mm > 0 ? "; a foot was pressed flat by " + number(pressed_mm, 2) + " mm" : "") + ". As it was: " + refusal;
}

Figures Deformation::figures() const {
  return {{.name = "rms_mm", .words = "outside moved by (root mean square)", .unit = Unit::mm, .value = rms_mm, .digits = 2},
          {.name = "largest_mm", .words = "outside moved by at most", .unit = Unit::mm, .value = largest_mm, .digits = 2},
          {.name = "normals_rad",
           .words = "its normals turned by (root mean square)",
           .unit = Unit::rad,
           .value = normals_rad,
           .digits = 1},
          {.name = "pressed_mm", .words = "", .unit = Unit::mm, .value = pressed_mm},
          {.name = "rms_of_diagonal", .words = "", .value = rms_mm / diagonal_mm},
          {.name = "violation_before", .words = "", .value = violation_before},
          {.name = "handles", .words = "", .value = static_cast<double>(handles)},
          {.name = "iterations", .words = "", .value = static_cast<double>(iterations)},
          {.name = "refusal", .words = "", .value = refusal}};
}

}  // namespace rayrep
