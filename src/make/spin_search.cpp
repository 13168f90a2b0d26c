#include "make/spin_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/rotation.h"
#include "make/plan.h"
#include "rayrep/physics/spin.h"

namespace rayrep::detail {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kDirections = 16;

Eigen::Vector2d direction(int n, int of) {
  const double angle = 2 * std::numbers::pi * n / of;
  return {std::cos(angle), std::sin(angle)};
}

/// Where the line through `point` along `up` leaves the mesh at its lower end; none when it does not meet it. In double, without
/// care for hits on edges: for a search.
std::optional<double> lower_end(const Mesh& mesh, const Eigen::Vector3d& point, const Eigen::Vector3d& up) {
  double lowest = kInfinity;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Eigen::Vector3d a = mesh.corner(t, 0) - point;
    const Eigen::Vector3d b = mesh.corner(t, 1) - point;
    const Eigen::Vector3d c = mesh.corner(t, 2) - point;
    const double u = up.dot(b.cross(c));
    const double v = up.dot(c.cross(a));
    const double w = up.dot(a.cross(b));
    if ((u < 0 || v < 0 || w < 0) && (u > 0 || v > 0 || w > 0)) continue;
    if (const double sum = u + v + w; sum != 0) lowest = std::min(lowest, up.dot(u * a + v * b + w * c) / sum);
  }
  if (lowest == kInfinity) return std::nullopt;
  return lowest;
}

/// Minimises f from x by steps in eight directions, halved when none of them helps.
template <typename F>
Eigen::Vector2d pattern_search(const F& f, Eigen::Vector2d x, double step, double smallest_step) {
  double best = f(x);
  while (step > smallest_step) {
    Eigen::Vector2d next = x;
    for (int n = 0; n < 8; ++n) {
      const Eigen::Vector2d candidate = x + step * direction(n, 8);
      if (const double value = f(candidate); value < best) {
        best = value;
        next = candidate;
      }
    }
    if (next == x) step *= 0.5;
    x = next;
  }
  return x;
}

/// The shortest vector of at most `largest` for which `feasible`, by rings of growing radius and bisection; none if no ring has
/// one.
template <typename F>
std::optional<Eigen::Vector2d> shortest(const F& feasible, double largest, double room) {
  for (double radius = largest / 64; radius < 1.01 * largest; radius *= std::numbers::sqrt2) {
    std::optional<Eigen::Vector2d> best;
    for (int n = 0; n < kDirections; ++n) {
      const Eigen::Vector2d towards = direction(n, kDirections);
      if (!feasible(radius * towards)) continue;
      double lo = radius / std::numbers::sqrt2;
      double hi = radius;
      if (radius == largest / 64) lo = 0;
      while (hi - lo > 0.02 * radius) {
        const double middle = 0.5 * (lo + hi);
        (feasible(middle * towards) ? hi : lo) = middle;
      }
      if (feasible((hi + room) * towards)) hi += room;
      if (!best || hi < best->norm()) best = hi * towards;
    }
    if (best) return best;
  }
  return std::nullopt;
}

}  // namespace

bool spins_as_wanted(const Moments& s, bool largest) {
  constexpr double margin = 1e-6;
  const SpinState state = spin_state(mass_properties(s, 1), Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitZ());
  return largest ? state.ratio_larger > 1 + margin : state.ratio_smaller < 1 - margin;
}

SpinSearch::SpinSearch(const Body& body, const SpinSpec& spec)
    : body_(body),
      spec_(spec),
      goal_(spin_goal(weights_of(spec), spec.prefer == AxisClass::largest, spec.yoyo, body.solid[M1], body.diagonal_mm)),
      centre_(body.solid.segment<3>(MX) / body.solid[M1]) {}

double SpinSearch::objective(const SpinFrame& frame) const {
  Eigen::Affine3d motion(rotation_between(frame.up, Eigen::Vector3d::UnitZ()));
  motion.translation() = -(motion.linear() * frame.contact_mm);
  const Goal goal = mapped(goal_, moment_map(motion));
  const QuadricSolution solution = solve_quadric(goal, *body_.integrals, body_.shell);
  const bool usable =
      solution.converged && spins_as_wanted(moment_map(motion) * solution.moments, spec_.prefer == AxisClass::largest);
  return usable ? solution.objective : kInfinity;
}

SpinFrame SpinSearch::through(const Eigen::Vector3d& point, const Eigen::Vector3d& up) const {
  return {up, point + lower_end(body_.working, point, up).value_or(0) * up};
}

SpinFrame SpinSearch::tilted(const SpinFrame& frame, const Eigen::Vector3d& up) const {
  if (spec_.yoyo) return {up, frame.contact_mm};
  switch (spec_.axis.through) {
    case SpinAxis::Through::lowest_point: {
      double lowest = kInfinity;
      Eigen::Vector3d at = frame.contact_mm;
      for (const auto& v : body_.working.vertices)
        if (const double height = up.dot(v); height < lowest) {
          lowest = height;
          at = v;
        }
      return {up, at};
    }
    case SpinAxis::Through::centre_of_mass:
    case SpinAxis::Through::best:
      return through(centre_, up);
    case SpinAxis::Through::point:
      break;
  }
  return {up, frame.contact_mm};
}

SpinFrame SpinSearch::best(const SpinFrame& frame, bool points, double max_tilt_rad, const Progress& progress) const {
  SpinFrame best = frame;
  double best_objective = objective(best);
  const auto keep_better = [&](const SpinFrame& candidate) {
    progress.check();
    const double value = objective(candidate);
    if (value < best_objective) {
      best_objective = value;
      best = candidate;
    }
    return value;
  };
  // Directions and points in turn; each has little to do with the other.
  for (int round = 0; round < (points && max_tilt_rad > 0 ? 2 : 1); ++round) {
    if (max_tilt_rad > 0) {
      const SpinFrame from = best;
      const auto at_tilt = [&](const Eigen::Vector2d& tilt) {
        if (tilt.norm() > max_tilt_rad) return kInfinity;
        const Eigen::Vector3d up = tilt_by(frame.up, tilt);
        // A point that was searched stays on the axis.
        return keep_better(points && round > 0 ? through(from.contact_mm + 0.5 * body_.height_mm * from.up, up) : tilted(from, up));
      };
      Eigen::Vector2d start = Eigen::Vector2d::Zero();
      double at_start = at_tilt(start);
      for (const double radius : {0.5 * max_tilt_rad, 0.98 * max_tilt_rad})
        for (int n = 0; n < 8; ++n)
          if (const double value = at_tilt(radius * direction(n, 8)); value < at_start) {
            at_start = value;
            start = radius * direction(n, 8);
          }
      pattern_search(at_tilt, start, 0.2 * max_tilt_rad, 1e-3);
    }
    if (points) {
      const SpinFrame from = best;
      const Eigen::Matrix<double, 3, 2> basis = across(from.up);
      const auto at_point = [&](const Eigen::Vector2d& shift) {
        const Eigen::Vector3d point = from.contact_mm + basis * shift;
        const auto end = lower_end(body_.working, point, from.up);
        return end ? keep_better({from.up, point + *end * from.up}) : kInfinity;
      };
      pattern_search(at_point, Eigen::Vector2d::Zero(), 0.05 * body_.diagonal_mm, 2e-4 * body_.diagonal_mm);
    }
  }
  return best;
}

std::optional<std::pair<SpinFrame, double>> SpinSearch::nearest_point(const SpinFrame& frame, const Progress& progress) const {
  const Eigen::Matrix<double, 3, 2> basis = across(frame.up);
  const auto at = [&](const Eigen::Vector2d& shift) {
    const Eigen::Vector3d point = frame.contact_mm + basis * shift;
    return spec_.yoyo ? SpinFrame{frame.up, point} : through(point, frame.up);
  };
  const auto shift = shortest(
      [&](const Eigen::Vector2d& candidate) {
        progress.check();
        return objective(at(candidate)) < kInfinity;
      },
      0.5 * body_.diagonal_mm, 2 * body_.inner.rays.grid.spacing_mm);
  if (!shift) return std::nullopt;
  return std::pair{at(*shift), shift->norm()};
}

std::optional<std::pair<SpinFrame, double>> SpinSearch::smallest_tilt(const SpinFrame& frame, double most_rad,
                                                                      const Progress& progress) const {
  const auto tilt = shortest(
      [&](const Eigen::Vector2d& candidate) {
        progress.check();
        return objective(tilted(frame, tilt_by(frame.up, candidate))) < kInfinity;
      },
      most_rad, 4 * body_.inner.rays.grid.spacing_mm / body_.size_mm);
  if (!tilt) return std::nullopt;
  return std::pair{tilted(frame, tilt_by(frame.up, *tilt)), tilt->norm()};
}

Eigen::Affine3d frame_about(const SpinFrame& axis, const Mesh& outer) {
  Eigen::Affine3d frame = working_frame(outer, axis.up);
  frame.translation() = -(frame.linear() * axis.contact_mm);
  return frame;
}

std::shared_ptr<Body> body_about(const SpinFrame& axis, Mesh outer, const Discretisation& options, const Progress& progress) {
  const Eigen::Affine3d frame = frame_about(axis, outer);
  return resolved_body(std::move(outer), frame, options, progress);
}

SpinFrame in_frame_given(const SpinFrame& axis, const Body& body) {
  return {body.to_working.linear().transpose() * axis.up, body.to_working.inverse() * axis.contact_mm};
}

SpinFrame spin_frame(const Mesh& outer, const SpinSpec& spec, const Discretisation& options, const Progress& progress) {
  const SpinFrame asked{spec.up.normalized(), spec.yoyo ? spec.centre_mm.value_or(bounding_box(outer).center())
                                                        : contact_point(outer, spec.axis, spec.up, progress)};
  const bool points = spec.axis.through == SpinAxis::Through::best && !spec.yoyo;
  if (!points && spec.max_tilt_rad == 0) return asked;
  Discretisation coarse = options;
  coarse.resolution = std::min(coarse.resolution, 80);
  const auto body = body_about(asked, outer, coarse, progress);
  progress.begin("axis");
  return in_frame_given(SpinSearch(*body, spec).best({}, points, spec.max_tilt_rad, progress), *body);
}

}  // namespace rayrep::detail
