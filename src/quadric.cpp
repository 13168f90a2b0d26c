#include "rayrep/quadric.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

namespace rayrep {
namespace {

using Matrix10 = Eigen::Matrix<double, 10, 10>;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A goal over rays with moments in units that make them of order 1; q in the inverse units, so that q.s is the same number.
class Problem {
public:
  Problem(const Goal& goal, const RayIntegrals& rays, const Moments& constant) : goal_(goal), rays_(rays), constant_(constant) {
    const Moments solid = constant + rays.full();
    const double volume = std::abs(solid[M1]);
    // The second moments give a length that does not depend on where the origin is.
    const Eigen::Vector3d centre = solid.segment<3>(MX) / solid[M1];
    const double length = std::sqrt(std::max(std::abs(solid.segment<3>(MXX).sum() / solid[M1]), centre.squaredNorm()));
    for (int k = 0; k < 10; ++k) unit_[k] = volume * std::pow(length, k == M1 ? 0 : k <= MZ ? 1 : 2);
    J_ = goal.constraint_jacobian(solid) * unit_.asDiagonal();
    c_0_ = goal.constraint_values(Moments::Zero());
  }

  struct Evaluation {
    Moments s;        ///< constant + S(q)
    Matrix10 spread;  ///< -ds/dq
  };
  Evaluation evaluate(const Moments& q, double blur) {
    ++evaluations_;
    const RayIntegrals::Pass pass = rays_.pass(q.cwiseQuotient(unit_), blur);
    return {scaled(constant_ + pass.moments), unit_.cwiseInverse().asDiagonal() * pass.spread * unit_.cwiseInverse().asDiagonal()};
  }
  /// Where q.s is least of all interiors.
  Moments minimiser(const Moments& q) {
    ++evaluations_;
    return scaled(constant_ + rays_.moments(q.cwiseQuotient(unit_)));
  }
  double lowest(const Moments& q) { return q.dot(minimiser(q)); }

  Moments scaled(const Moments& s) const { return s.cwiseQuotient(unit_); }
  Moments in_mm(const Moments& s) const { return s.cwiseProduct(unit_); }
  Moments q_in_mm(const Moments& q) const { return q.cwiseQuotient(unit_); }

  double objective(const Moments& s) const { return goal_.objective(in_mm(s)); }
  Moments gradient(const Moments& s) const { return goal_.gradient(in_mm(s)).cwiseProduct(unit_); }
  Matrix10 hessian(const Moments& s) const { return unit_.asDiagonal() * goal_.hessian(in_mm(s)) * unit_.asDiagonal(); }
  const Eigen::MatrixXd& J() const { return J_; }
  Eigen::VectorXd constraints(const Moments& s) const { return c_0_ + J_ * s; }
  const Eigen::VectorXd& c_0() const { return c_0_; }

  /// The middle of all attainable moments: every ray half full.
  Moments centre() const { return scaled(constant_ + 0.5 * rays_.full()); }
  Moments solid() const { return scaled(constant_ + rays_.full()); }
  int evaluations() const { return evaluations_; }

private:
  const Goal& goal_;
  const RayIntegrals& rays_;
  Moments constant_;
  Moments unit_;
  Eigen::MatrixXd J_;
  Eigen::VectorXd c_0_;
  int evaluations_ = 0;
};

/// How far to blur the derivative where rays are tangent to the quadric: as far as q is on the move.
double blur(const Moments& q, const Moments* before) {
  return before ? 1e-3 * std::min(1.0, (q - *before).norm() / q.norm()) : 1e-7;
}

/// max over u of  min over interiors s of [ (q_0 + K^T u).s ] - e.u:  the dual of  min over s of  q_0.s  subject to  K s = e.
struct Dual {
  Moments q_0;
  Eigen::MatrixXd K;
  Eigen::VectorXd e;
};

struct DualPoint {
  Eigen::VectorXd u;
  Moments q;
  Problem::Evaluation at;
  double value = -kInfinity;
  Eigen::VectorXd gradient;
};

DualPoint dual_at(Problem& problem, const Dual& dual, const Eigen::VectorXd& u, const Moments* before = nullptr) {
  DualPoint p;
  p.u = u;
  p.q = dual.q_0 + dual.K.transpose() * u;
  p.at = problem.evaluate(p.q, blur(p.q, before));
  p.gradient = dual.K * p.at.s - dual.e;
  p.value = p.q.dot(p.at.s) - dual.e.dot(u);
  return p;
}

/// Newton's method with line search from `from`. Stops when `done`, or where rounding leaves no ascent.
/// @param max_evaluations  of the problem, in total
DualPoint maximise(Problem& problem, const Dual& dual, DualPoint from, int max_evaluations,
                   const std::function<bool(const DualPoint&)>& done) {
  double damping = 0;
  while (!done(from) && problem.evaluations() < max_evaluations) {
    Eigen::MatrixXd H = dual.K * from.at.spread * dual.K.transpose();
    const double size = H.diagonal().maxCoeff();
    Eigen::VectorXd step;
    if (size > 0) {
      // Multipliers that move no free end have no curvature: damp them, ever less as steps succeed.
      H.diagonal().array() += size * std::max(damping, 1e-13);
      step = H.ldlt().solve(from.gradient);
    } else {
      // No end is free: go uphill as far as q is long, where some should be.
      step = from.q.norm() / (dual.K.transpose() * from.gradient).norm() * from.gradient;
    }
    const double slope = from.gradient.dot(step);
    bool moved = false;
    // A step that changes q out of all recognition is not to be trusted.
    double length = std::min(1.0, 10 * from.q.norm() / (dual.K.transpose() * step).norm());
    for (int cut = 0; cut < 10 && !moved && problem.evaluations() < max_evaluations; ++cut) {
      DualPoint next = dual_at(problem, dual, from.u + length * step, &from.q);
      // Near the top the gain drowns in rounding; there a smaller gradient is as good.
      const double rounding = 1e-13 * (std::abs(from.value) + from.u.norm());
      moved = next.value >= from.value + 1e-4 * length * slope ||
              (next.value >= from.value - rounding && next.gradient.norm() < 0.5 * from.gradient.norm());
      if (moved) {
        from = std::move(next);
      } else {
        // The vertex of the parabola through what is known, kept away from both ends.
        const double loss = from.value + slope * length - next.value;
        length *= std::clamp(loss > 0 ? 0.5 * slope * length / loss : 0.5, 0.1, 0.5);
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

/// Relative KKT residual of an interior that comes from q = grad F(s) + J^T mu.
double residual(const Problem& problem, const Moments& s, const Moments& S) {
  return std::max((S - s).cwiseAbs().maxCoeff(), problem.constraints(S).cwiseAbs().maxCoeff());
}

void store(const Problem& problem, const Moments& q, const Moments& s, const Eigen::VectorXd& mu, QuadricSolution& solution) {
  solution.q = problem.q_in_mm(q);
  solution.multipliers = mu;
  solution.moments = problem.in_mm(s);
  solution.objective = problem.objective(s);
}

/// min over attainable s with c(s) = 0 of q_0.s, by its dual, or a proof that there is no such s.
struct LinearMinimum {
  DualPoint top;  ///< its u are the multipliers of c
  bool converged = false;
  bool infeasible = false;
};

LinearMinimum minimise_linear(Problem& problem, const Moments& q_0, const Eigen::VectorXd& mu, double tolerance,
                              int max_evaluations) {
  const Dual dual{q_0, problem.J(), -problem.c_0()};
  // No interior has a larger objective: a dual value above it proves that none meets the constraints.
  const double highest = -problem.lowest(-q_0);
  // Where the multipliers run away they separate long before the value says so: asked for when it takes long.
  const int patience = problem.evaluations() + 12;
  const auto separates = [&](const Eigen::VectorXd& u) {
    return problem.evaluations() > patience && problem.lowest(problem.J().transpose() * u) + problem.c_0().dot(u) > 1e-9 * u.norm();
  };
  const auto proven = [&](const DualPoint& p) { return p.value > highest + 1e-9 * q_0.norm() || separates(p.u); };
  const auto met = [&](const DualPoint& p) { return p.gradient.cwiseAbs().maxCoeff() < tolerance; };
  LinearMinimum minimum;
  minimum.top =
      maximise(problem, dual, dual_at(problem, dual, mu), max_evaluations, [&](const DualPoint& p) { return met(p) || proven(p); });
  minimum.converged = met(minimum.top);
  minimum.infeasible = !minimum.converged && proven(minimum.top);
  return minimum;
}

QuadricSolution solve_affine(Problem& problem, const QuadricOptions& options) {
  QuadricSolution solution;
  const Moments zero = Moments::Zero();
  const Eigen::Index m = problem.J().rows();
  Eigen::VectorXd start = Eigen::VectorXd::Zero(m);
  if (options.multipliers.size() == m) {
    start = options.multipliers;
  } else {
    // Half full: the mean of q.phi over the inner domain is 0, so that there are free ends.
    const Moments inner = 2 * (problem.solid() - problem.centre());
    const Eigen::VectorXd c = problem.J() * inner;
    if (c.norm() > 1e-6 * inner.norm()) start = -problem.gradient(zero).dot(inner) / c.squaredNorm() * c;
  }
  const LinearMinimum minimum = minimise_linear(problem, problem.gradient(zero), start, options.tolerance, options.max_evaluations);
  const DualPoint& top = minimum.top;
  store(problem, top.q, top.at.s, top.u, solution);
  solution.residual = top.gradient.cwiseAbs().maxCoeff();
  solution.converged = minimum.converged;
  solution.lower_bound = problem.objective(zero) + top.value;
  solution.infeasible = minimum.infeasible;
  if (minimum.infeasible) solution.separation = top.u;
  return solution;
}

/// A point of the curved problem: s need not be attainable, S(q) is.
struct KktPoint {
  Moments s;
  Eigen::VectorXd mu;
  Moments q;
  Problem::Evaluation at;
  double merit = kInfinity;
};

KktPoint kkt_at(Problem& problem, const Moments& s, const Eigen::VectorXd& mu, const Moments* before = nullptr) {
  KktPoint p{s, mu, problem.gradient(s) + problem.J().transpose() * mu, {}, 0};
  p.at = problem.evaluate(p.q, blur(p.q, before));
  p.merit = std::hypot((p.at.s - s).norm(), problem.constraints(s).norm());
  return p;
}

/// Second-order condition: no direction within the constraints along which the objective falls. A change dq of the switching
/// function moves s by -P dq; for J P dq = 0 the objective changes by dq.(P H P + P) dq / 2.
bool is_minimum(const Problem& problem, const KktPoint& p) {
  const Matrix10& P = p.at.spread;
  const Eigen::MatrixXd JP = problem.J() * P;
  const Eigen::FullPivLU<Eigen::MatrixXd> lu(JP);
  const Eigen::MatrixXd N = lu.kernel();
  const Eigen::MatrixXd M = N.transpose() * (P * problem.hessian(p.s) * P + P) * N;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(0.5 * (M + M.transpose()), Eigen::EigenvaluesOnly);
  return eigen.eigenvalues()[0] >= -1e-9 * std::max(1e-300, eigen.eigenvalues().cwiseAbs().maxCoeff());
}

/// The residual of the KKT conditions, (S(q) - s, -c(s)).
Eigen::VectorXd kkt_residual(const Problem& problem, const KktPoint& p) {
  Eigen::VectorXd r(10 + problem.J().rows());
  r << p.at.s - p.s, -problem.constraints(p.s);
  return r;
}

/// Newton's method on s = S(grad F(s) + J^T mu), c(s) = 0, with backtracking on the residual.
/// @param patience  evaluations after which it gives up, unless it is near
KktPoint newton(Problem& problem, KktPoint from, double tolerance, int patience, int max_evaluations) {
  constexpr double near = 1e-3;
  const Eigen::Index m = problem.J().rows();
  patience += problem.evaluations();
  while (residual(problem, from.s, from.at.s) > tolerance &&
         problem.evaluations() < (from.merit < near ? max_evaluations : patience)) {
    Eigen::MatrixXd K = Eigen::MatrixXd::Zero(10 + m, 10 + m);
    K.topLeftCorner<10, 10>() = Matrix10::Identity() + from.at.spread * problem.hessian(from.s);
    K.topRightCorner(10, m) = from.at.spread * problem.J().transpose();
    K.bottomLeftCorner(m, 10) = problem.J();
    const Eigen::VectorXd r = kkt_residual(problem, from);
    const Eigen::VectorXd step = K.fullPivLu().solve(r);
    if (!step.allFinite()) break;
    const auto along = [&](double length) {
      return kkt_at(problem, from.s + length * step.head<10>(), from.mu + length * step.tail(m), &from.q);
    };
    double length = 1;
    while (length > 0.01 && !(from.s[M1] + length * step[M1] > 0)) length *= 0.4;
    KktPoint next = along(length);
    bool moved = next.merit < (1 - 0.1 * length) * from.merit;
    if (!moved && from.merit < near) {
      // A ray that becomes tangent to the quadric on the way grows like a root, and the step overshoots: find where what the step
      // got wrong vanishes, by the Illinois method.
      const Eigen::VectorXd wrong = kkt_residual(problem, next);
      double lo = 0;
      double hi = length;
      double at_lo = wrong.dot(r);
      double at_hi = wrong.squaredNorm();
      int side = 0;
      while (at_lo < 0 && !moved && hi - lo > 1e-8 && problem.evaluations() < max_evaluations) {
        length = std::clamp((lo * at_hi - hi * at_lo) / (at_hi - at_lo), lo + 0.02 * (hi - lo), hi - 0.02 * (hi - lo));
        next = along(length);
        moved = next.merit < 0.5 * from.merit;
        const double at = wrong.dot(kkt_residual(problem, next));
        if (at < 0) {
          lo = length;
          at_lo = at;
          if (side < 0) at_hi *= 0.25;
          side = -1;
        } else {
          hi = length;
          at_hi = at;
          if (side > 0) at_lo *= 0.25;
          side = 1;
        }
      }
      if (!moved && lo > 0) {
        next = along(lo);
        moved = next.merit < 0.999 * from.merit;
      }
      length = 1;
    }
    while (!moved && length > 0.01 && problem.evaluations() < max_evaluations) {
      length *= 0.4;
      next = along(length);
      moved = next.merit < (1 - 0.1 * length) * from.merit;
    }
    if (!moved) break;
    from = std::move(next);
  }
  return from;
}

/// The conditional gradient method with Newton's: the objective's linear model is minimised over the attainable moments that meet
/// the constraints, by its dual; as these are a convex set, the search along the way there costs no pass over the rays; and
/// Newton's method tries to finish from every point reached.
/// @param s  attainable moments that meet the constraints, mu their multipliers
KktPoint descend(Problem& problem, Moments s, Eigen::VectorXd mu, double tolerance, int max_evaluations) {
  constexpr int patience = 10;
  KktPoint best;
  double best_left = kInfinity;
  while (problem.evaluations() < max_evaluations) {
    const KktPoint polished = newton(problem, kkt_at(problem, s, mu), tolerance, patience, max_evaluations);
    const double left = residual(problem, polished.s, polished.at.s);
    if (left < tolerance && is_minimum(problem, polished)) return polished;
    if (left < best_left) {
      best = polished;
      best_left = left;
    }
    const LinearMinimum target = minimise_linear(problem, problem.gradient(s), mu, 1e-6, max_evaluations);
    if (!target.converged) break;
    const Moments d = target.top.at.s - s;
    double lo = 0;
    double hi = 1;
    if (problem.gradient(s + d).dot(d) > 0)
      for (int step = 0; step < 30; ++step) {
        const double middle = 0.5 * (lo + hi);
        (problem.gradient(s + middle * d).dot(d) > 0 ? hi : lo) = middle;
      }
    if (hi * d.norm() < 1e-9) break;
    s += hi * d;
    mu = target.top.u;
  }
  return best;
}

QuadricSolution solve_curved(Problem& problem, const QuadricOptions& options) {
  constexpr int patience = 14;
  QuadricSolution solution;
  solution.lower_bound = -kInfinity;
  const auto finish = [&](const KktPoint& p) {
    store(problem, p.q, p.at.s, p.mu, solution);
    solution.residual = residual(problem, p.s, p.at.s);
    solution.converged = solution.residual < options.tolerance;
  };
  const Moments solid = problem.solid();
  const bool warm = options.multipliers.size() == problem.J().rows();
  const KktPoint start =
      warm ? kkt_at(problem, problem.scaled(options.moments), options.multipliers)
           : kkt_at(problem, solid, -problem.J().transpose().completeOrthogonalDecomposition().solve(problem.gradient(solid)));
  const KktPoint quick = newton(problem, start, options.tolerance, patience, options.max_evaluations);
  finish(quick);
  if (solution.converged && is_minimum(problem, quick)) return solution;

  for (const Moments& from : {solid, problem.centre()}) {
    const Eigen::VectorXd zero = Eigen::VectorXd::Zero(problem.J().rows());
    const LinearMinimum feasible =
        minimise_linear(problem, problem.gradient(from), zero, 1e-6, problem.evaluations() + options.max_evaluations);
    solution.converged = false;
    if (feasible.infeasible) {
      solution.infeasible = true;
      solution.separation = feasible.top.u;
      break;
    }
    if (!feasible.converged) continue;
    finish(descend(problem, feasible.top.at.s, feasible.top.u, options.tolerance, problem.evaluations() + options.max_evaluations));
    if (solution.converged) break;
  }
  return solution;
}

}  // namespace

QuadricSolution solve_quadric(const Goal& goal, const RayIntegrals& rays, const Moments& constant, const QuadricOptions& options) {
  Problem problem(goal, rays, constant);
  QuadricSolution solution = goal.affine() ? solve_affine(problem, options) : solve_curved(problem, options);
  solution.evaluations = problem.evaluations();
  return solution;
}

double separation_margin(const Goal& goal, const Eigen::VectorXd& y, const RayIntegrals& rays, const Moments& constant) {
  const Eigen::VectorXd c_0 = goal.constraint_values(Moments::Zero());
  const Moments q = goal.constraint_jacobian(constant).transpose() * y;
  return y.dot(c_0) + q.dot(constant + rays.moments(q));
}

NearestSolution nearest_attainable(const Goal& goal, const RayIntegrals& rays, const Moments& constant, double tolerance) {
  constexpr int max_evaluations = 1000;
  Problem problem(goal, rays, constant);
  NearestSolution solution;
  // Wolfe's method for the point of least norm in a convex set: x is the nearest point to 0 of the hull of a few interiors' c(s),
  // and the interior that minimises x.c(s) joins them.
  struct Corner {
    Moments s;
    Eigen::VectorXd c;
    double weight;
  };
  const Moments middle = problem.centre();
  std::vector<Corner> corners = {{middle, problem.constraints(middle), 1}};
  Eigen::VectorXd x = corners[0].c;
  while (!solution.converged && problem.evaluations() < max_evaluations) {
    const double norm = x.norm();
    if (norm < tolerance) break;
    const Moments s = problem.minimiser(problem.J().transpose() * x);
    const Eigen::VectorXd c = problem.constraints(s);
    // |c(s)| >= x.c(s) / |x| for every s.
    solution.lower_bound = std::max(solution.lower_bound, x.dot(c) / norm);
    solution.converged = norm - solution.lower_bound <= 1e-9 * norm;
    if (solution.converged) break;
    corners.push_back({s, c, 0});
    for (;;) {
      // The nearest point of the corners' affine hull; if outside of their hull, go as far as that and drop a corner.
      const auto n = static_cast<Eigen::Index>(corners.size()) - 1;
      Eigen::MatrixXd edges(x.size(), n);
      for (Eigen::Index k = 0; k < n; ++k) edges.col(k) = corners[static_cast<std::size_t>(k + 1)].c - corners[0].c;
      Eigen::VectorXd rest(n);
      if (n > 0) rest = -edges.completeOrthogonalDecomposition().solve(corners[0].c);
      Eigen::VectorXd weights(n + 1);
      weights << 1 - rest.sum(), rest;
      double step = 1;
      for (Eigen::Index k = 0; k <= n; ++k)
        if (weights[k] <= 0) {
          const double w = corners[static_cast<std::size_t>(k)].weight;
          step = std::min(step, w / std::max(w - weights[k], 1e-300));
        }
      for (Eigen::Index k = 0; k <= n; ++k) {
        double& w = corners[static_cast<std::size_t>(k)].weight;
        w += step * (weights[k] - w);
      }
      if (step == 1) break;
      const auto least =
          std::min_element(corners.begin(), corners.end(), [](const Corner& a, const Corner& b) { return a.weight < b.weight; });
      corners.erase(least);
    }
    x.setZero();
    for (const Corner& corner : corners) x += corner.weight * corner.c;
  }
  Moments nearest = Moments::Zero();
  for (const Corner& corner : corners) nearest += corner.weight * corner.s;
  solution.evaluations = problem.evaluations();
  solution.moments = problem.in_mm(nearest);
  solution.distance = problem.constraints(nearest).norm();
  solution.attainable = solution.distance < tolerance;
  solution.converged |= solution.attainable;
  return solution;
}

}  // namespace rayrep
