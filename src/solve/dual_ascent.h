#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "base/linear_algebra.h"

namespace rayrep::detail {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Newton's method on the concave dual of a linear objective over interiors (theory.md (30)): of one body, whose ten moments s
// answer to a switching function q, or of several parts at once, whose q and s are stacked. A Problem has a Vector (of q and s), an
// Evaluation (s of the interior that q makes, its spread -ds/dq, its cost), evaluate(q, blur), evaluations(),
// curvature(K, evaluation) = K spread K^T, lowest(q) = min over interiors of q.s, highest_cost(), J(), c_0() and
// lowest_multipliers().

/// How far to blur the derivative where rays are tangent to the quadric: as far as q is on the move.
template <typename Vector>
double blur(const Vector& q, const Vector* before) {
  return before ? 1e-3 * std::min(1.0, (q - *before).norm() / q.norm()) : 1e-7;
}

/// max over u of  min over interiors s of [ (q_0 + K^T u).s + cost ] - e.u - u.W u / 2:  the dual of  min over s of
/// q_0.s + cost + r.r / 2  subject to  r = K s - e  with a diagonal W of ones; a zero in W stands for r_k = 0, and with a `lowest`
/// of 0 for r_k <= 0.
template <typename Vector>
struct Dual {
  Vector q_0;
  Eigen::MatrixXd K;
  Eigen::VectorXd e;
  Eigen::VectorXd W;
  Eigen::VectorXd lowest;  ///< of u
};

template <class Problem>
struct DualPoint {
  Eigen::VectorXd u;
  typename Problem::Vector q;
  typename Problem::Evaluation at;
  double value = -kInfinity;
  Eigen::VectorXd gradient;  ///< 0 where it leads out of what u may be
};

template <class Problem>
DualPoint<Problem> dual_of(const Dual<typename Problem::Vector>& dual, const Eigen::VectorXd& u, const typename Problem::Vector& q,
                           const typename Problem::Evaluation& at) {
  const Eigen::VectorXd Wu = dual.W.cwiseProduct(u);
  DualPoint<Problem> p{u, q, at, q.dot(at.s) + at.cost - dual.e.dot(u) - 0.5 * u.dot(Wu), dual.K * at.s - dual.e - Wu};
  for (Eigen::Index k = 0; k < u.size(); ++k)
    if (u[k] <= dual.lowest[k] && p.gradient[k] < 0) p.gradient[k] = 0;
  return p;
}

template <class Problem>
DualPoint<Problem> dual_at(Problem& problem, const Dual<typename Problem::Vector>& dual, const Eigen::VectorXd& u,
                           const typename Problem::Vector* before = nullptr) {
  const typename Problem::Vector q = dual.q_0 + dual.K.transpose() * u;
  return dual_of<Problem>(dual, u, q, problem.evaluate(q, blur(q, before)));
}

/// Newton's step, with the unknowns that it would take below their bounds, where they nearly are already, held there.
/// @param damping  of multipliers that move no free end, relative to the largest curvature
template <class Problem>
Eigen::VectorXd newton_step(const Dual<typename Problem::Vector>& dual, const DualPoint<Problem>& from, double damping) {
  Eigen::MatrixXd H = Problem::curvature(dual.K, from.at);
  const double size = H.diagonal().maxCoeff();
  // No end is free: go uphill as far as q is long, where some should be.
  if (!(size > 0)) return from.q.norm() / (dual.K.transpose() * from.gradient).norm() * from.gradient;
  H.diagonal() += dual.W;
  H.diagonal().array() += size * std::max(damping, 1e-13);
  Eigen::VectorXd g = from.gradient;
  std::vector<bool> held(static_cast<std::size_t>(g.size()), false);
  const auto hold = [&](Eigen::Index k) {
    held[static_cast<std::size_t>(k)] = true;
    H.row(k).setZero();
    H.col(k).setZero();
    H(k, k) = size;
    g[k] = 0;
  };
  for (Eigen::Index k = 0; k < g.size(); ++k)
    if (from.u[k] <= dual.lowest[k] && g[k] <= 0) hold(k);
  for (;;) {
    const Eigen::VectorXd step = solve_symmetric(H, g);
    bool changed = false;
    for (Eigen::Index k = 0; k < g.size(); ++k) {
      const bool near = from.u[k] - dual.lowest[k] <= 1e-9 * from.u.cwiseAbs().maxCoeff();
      if (held[static_cast<std::size_t>(k)] || !near || from.u[k] + step[k] >= dual.lowest[k]) continue;
      hold(k);
      changed = true;
    }
    if (!changed) return step;
  }
}

/// Newton's method with line search from `from`. Stops when `done`, or where rounding leaves no ascent.
/// @param max_evaluations  of the problem, in total
template <class Problem>
DualPoint<Problem> maximise(Problem& problem, const Dual<typename Problem::Vector>& dual, DualPoint<Problem> from,
                            int max_evaluations, const std::function<bool(const DualPoint<Problem>&)>& done) {
  double damping = 0;
  while (!done(from) && problem.evaluations() < max_evaluations) {
    // Multipliers that move no free end have no curvature: damp them, ever less as steps succeed.
    const Eigen::VectorXd step = newton_step(dual, from, damping);
    const double slope = from.gradient.dot(step);
    bool moved = false;
    // A step that changes q out of all recognition is not to be trusted.
    double length = std::min(1.0, 10 * from.q.norm() / (dual.K.transpose() * step).norm());
    for (int cut = 0; cut < 10 && !moved && problem.evaluations() < max_evaluations; ++cut) {
      const Eigen::VectorXd u = from.u + length * step;
      const bool within = (u.array() >= dual.lowest.array()).all();
      DualPoint<Problem> next = dual_at(problem, dual, u.cwiseMax(dual.lowest), &from.q);
      const double promised = within ? length * slope : from.gradient.dot(next.u - from.u);
      // Near the top the gain drowns in rounding; there a smaller gradient is as good.
      const double rounding = 1e-13 * (std::abs(from.value) + from.u.norm());
      moved = next.value >= from.value + 1e-4 * promised ||
              (next.value >= from.value - rounding && next.gradient.norm() < 0.5 * from.gradient.norm());
      if (moved) {
        from = std::move(next);
      } else {
        // The vertex of the parabola through what is known, kept away from both ends.
        const double loss = from.value + promised - next.value;
        length *= std::clamp(loss > 0 ? 0.5 * promised / loss : 0.5, 0.1, 0.5);
      }
    }
    // A step that had to be cut down to next to nothing came from curvature that is not there.
    if (moved && length > 0.05) {
      damping *= 0.01;
    } else {
      damping = std::max(100 * damping, 1e-10);
      if (damping > 1e4) break;
    }
  }
  return from;
}

/// min over attainable s with c(s) = 0 of q_0.s, by its dual, or a proof that there is no such s.
template <class Problem>
struct LinearMinimum {
  DualPoint<Problem> top;  ///< its u are the multipliers of c
  bool converged = false;
  bool infeasible = false;
};

template <class Problem>
LinearMinimum<Problem> minimise_linear(Problem& problem, const typename Problem::Vector& q_0, const Eigen::VectorXd& mu,
                                       double tolerance, int max_evaluations) {
  using Point = DualPoint<Problem>;
  const Dual<typename Problem::Vector> dual{q_0, problem.J(), -problem.c_0(), Eigen::VectorXd::Zero(mu.size()),
                                            problem.lowest_multipliers()};
  // No interior has a larger objective: a dual value above it proves that none meets the constraints.
  const double highest = problem.highest_cost() - problem.lowest(typename Problem::Vector(-q_0));
  // Where the multipliers run away they separate long before the value says so: asked for when it takes long.
  const int patience = problem.evaluations() + 12;
  const auto separates = [&](const Point& p) {
    // Costs a pass, unless this interior shows that they do not.
    return problem.evaluations() > patience && p.u.dot(p.gradient) > 1e-9 * p.u.norm() &&
           problem.lowest(typename Problem::Vector(problem.J().transpose() * p.u)) + problem.c_0().dot(p.u) > 1e-9 * p.u.norm();
  };
  const auto proven = [&](const Point& p) { return p.value > highest + 1e-9 * q_0.norm() || separates(p); };
  const auto met = [&](const Point& p) { return p.gradient.cwiseAbs().maxCoeff() < tolerance; };
  LinearMinimum<Problem> minimum;
  minimum.top = maximise<Problem>(problem, dual, dual_at(problem, dual, mu.cwiseMax(dual.lowest)), max_evaluations,
                                  [&](const Point& p) { return met(p) || proven(p); });
  minimum.converged = met(minimum.top);
  minimum.infeasible = !minimum.converged && proven(minimum.top);
  return minimum;
}

}  // namespace rayrep::detail
