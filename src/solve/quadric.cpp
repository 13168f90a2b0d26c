#include "rayrep/solve/quadric.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <vector>

#include "base/linear_algebra.h"
#include "solve/dual_ascent.h"

namespace rayrep {
namespace {

using detail::blur;
using detail::Dual;
using detail::dual_of;
using detail::DualPoint;
using detail::kInfinity;
using detail::LinearMinimum;
using detail::maximise;
using detail::minimise_linear;

constexpr int kWarmEvaluations = 40;  ///< that a warm start may take before it is given up for a cold one

/// A goal over rays with moments in units that make them of order 1; q in the inverse units, so that q.s is the same number.
class Problem {
public:
  using Vector = Moments;
  /// @param price  of what fills the rays, see RayIntegrals::priced
  Problem(const Goal& goal, const RayIntegrals& rays, const Moments& constant, double price = 0)
      : goal_(goal), rays_(rays), constant_(constant), price_(price) {
    const Moments solid = constant + rays.full();
    const double volume = std::abs(solid[M1]);
    // The second moments give a length that does not depend on where the origin is.
    const Eigen::Vector3d centre = solid.segment<3>(MX) / solid[M1];
    const double length = std::sqrt(std::max(std::abs(solid.segment<3>(MXX).sum() / solid[M1]), centre.squaredNorm()));
    unit_ = moment_units(volume, length);
    J_ = goal.J * unit_.asDiagonal();
    c_0_ = goal.c_0;
  }

  struct Evaluation {
    Moments s;        ///< constant + S(q)
    Matrix10 spread;  ///< -ds/dq
    double cost = 0;
    double filled_mm3 = 0;
  };
  Evaluation evaluate(const Moments& q, double blur) {
    ++evaluations_;
    const RayIntegrals::Priced priced = rays_.priced(q.cwiseQuotient(unit_), price_, blur);
    const RayIntegrals::Pass& pass = priced.pass;
    return {scaled(constant_ + pass.moments), unit_.cwiseInverse().asDiagonal() * pass.spread * unit_.cwiseInverse().asDiagonal(),
            priced.cost, priced.filled_mm3};
  }
  /// Of all that has room.
  double highest_cost() const { return price_ * (1 - rays_.grid().substitute) * rays_.full()[M1]; }
  /// Where q.s is least of all interiors, whatever they cost.
  Moments minimiser(const Moments& q) {
    ++evaluations_;
    return scaled(constant_ + rays_.moments(q.cwiseQuotient(unit_)));
  }
  double lowest(const Moments& q) { return q.dot(minimiser(q)); }
  /// K P K^T with the spread P of an interior.
  static Eigen::MatrixXd curvature(const Eigen::MatrixXd& K, const Evaluation& at) { return congruence(K, at.spread); }

  Moments scaled(const Moments& s) const { return s.cwiseQuotient(unit_); }
  Moments in_mm(const Moments& s) const { return s.cwiseProduct(unit_); }
  Moments q_in_mm(const Moments& q) const { return q.cwiseQuotient(unit_); }

  double objective(const Moments& s) const { return goal_.objective(in_mm(s)); }
  Moments gradient(const Moments& s) const { return goal_.gradient(in_mm(s)).cwiseProduct(unit_); }
  Matrix10 hessian(const Moments& s) const { return unit_.asDiagonal() * goal_.hessian(in_mm(s)) * unit_.asDiagonal(); }
  const Eigen::MatrixXd& J() const { return J_; }
  /// What its multipliers are not to fall below.
  Eigen::VectorXd lowest_multipliers() const {
    Eigen::VectorXd lowest = Eigen::VectorXd::Constant(J_.rows(), -kInfinity);
    lowest.tail(goal_.at_most).setZero();
    return lowest;
  }
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
  double price_;
  Moments unit_;
  Eigen::MatrixXd J_;
  Eigen::VectorXd c_0_;
  int evaluations_ = 0;
};

/// Relative KKT residual of an interior that comes from q = grad F(s) + J^T mu.
double residual(const Problem& problem, const Moments& s, const Moments& S) {
  return std::max((S - s).cwiseAbs().maxCoeff(), problem.constraints(S).cwiseAbs().maxCoeff());
}

void store(const Problem& problem, const Moments& q, const Problem::Evaluation& at, const Eigen::VectorXd& mu,
           QuadricSolution& solution) {
  solution.q = problem.q_in_mm(q);
  solution.multipliers = mu;
  solution.moments = problem.in_mm(at.s);
  solution.objective = problem.objective(at.s);
  solution.filled_mm3 = at.filled_mm3;
}

QuadricSolution solve_affine(Problem& problem, const QuadricOptions& options) {
  QuadricSolution solution;
  const Moments zero = Moments::Zero();
  const Eigen::Index m = problem.J().rows();
  const bool warm = options.multipliers.size() == m;
  Eigen::VectorXd start = Eigen::VectorXd::Zero(m);
  // Half full: the mean of q.phi over the inner domain is 0, so that there are free ends.
  const Moments inner = 2 * (problem.solid() - problem.centre());
  const Eigen::VectorXd c = problem.J() * inner;
  if (c.norm() > 1e-6 * inner.norm()) start = -problem.gradient(zero).dot(inner) / c.squaredNorm() * c;
  LinearMinimum<Problem> minimum;
  if (warm) minimum = minimise_linear(problem, problem.gradient(zero), options.multipliers, options.tolerance, kWarmEvaluations);
  if (!minimum.converged && !minimum.infeasible)
    minimum =
        minimise_linear(problem, problem.gradient(zero), start, options.tolerance, problem.evaluations() + options.max_evaluations);
  const auto& top = minimum.top;
  store(problem, top.q, top.at, top.u, solution);
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
  const Eigen::MatrixXd N = kernel(product(problem.J(), P));
  const Eigen::MatrixXd M = restricted(product(product(P, problem.hessian(p.s)), P) + P, N);
  const Eigen::VectorXd values = symmetric_eigenvalues(0.5 * (M + M.transpose()));
  return values[0] >= -1e-9 * std::max(1e-300, values.cwiseAbs().maxCoeff());
}

/// The residual of the KKT conditions, (S(q) - s, -c(s)).
Eigen::VectorXd kkt_residual(const Problem& problem, const KktPoint& p) {
  Eigen::VectorXd r(10 + problem.J().rows());
  r << p.at.s - p.s, -problem.constraints(p.s);
  return r;
}

/// Newton's method on s = S(grad F(s) + J^T mu), c(s) = 0. Gives up when neither a step nor a part of it improves the residual.
/// @return the last point that was an improvement
KktPoint newton(Problem& problem, KktPoint from, double tolerance, int max_evaluations) {
  constexpr double near = 1e-3;
  const Eigen::Index m = problem.J().rows();
  while (residual(problem, from.s, from.at.s) > tolerance && problem.evaluations() < max_evaluations) {
    Eigen::MatrixXd K = Eigen::MatrixXd::Zero(10 + m, 10 + m);
    K.topLeftCorner<10, 10>() = Matrix10::Identity() + product(from.at.spread, problem.hessian(from.s));
    K.topRightCorner(10, m) = product(from.at.spread, problem.J().transpose());
    K.bottomLeftCorner(m, 10) = problem.J();
    const Eigen::VectorXd r = kkt_residual(problem, from);
    const Eigen::VectorXd step = solve_square(K, r);
    if (!step.allFinite()) break;
    const auto along = [&](double length) {
      return kkt_at(problem, from.s + length * step.head<10>(), from.mu + length * step.tail(m), &from.q);
    };
    if (!(from.s[M1] + step[M1] > 0)) break;
    KktPoint next = along(1);
    bool moved = next.merit < 0.95 * from.merit;
    const bool is_near = from.merit < near && (next.q - from.q).norm() < 0.03 * from.q.norm();
    if (!moved && is_near) {
      // A ray that becomes tangent to the quadric on the way grows like a root, and the step overshoots: find where what the step
      // got wrong vanishes, by the Illinois method.
      const Eigen::VectorXd wrong = kkt_residual(problem, next);
      double lo = 0;
      double hi = 1;
      double at_lo = wrong.dot(r);
      double at_hi = wrong.squaredNorm();
      int side = 0;
      const int last = std::min(max_evaluations, problem.evaluations() + 5);
      while (at_lo < 0 && !moved && problem.evaluations() < last) {
        const double length = std::clamp((lo * at_hi - hi * at_lo) / (at_hi - at_lo), lo + 0.02 * (hi - lo), hi - 0.02 * (hi - lo));
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
        moved = next.merit < 0.9 * from.merit;
      }
    }
    if (!moved && !is_near) {
      next = along(0.4);
      moved = next.merit < 0.92 * from.merit;
    }
    if (!moved) break;
    from = std::move(next);
  }
  return from;
}

/// The multipliers that make q = grad F(s) + J^T mu shortest.
Eigen::VectorXd shortest(const Problem& problem, const Moments& s) {
  return -least_squares_transposed(problem.J(), problem.gradient(s));
}

/// B = L L^T: the objective's Hessian within the constraints and its level set, without its negative part. theory.md (30d)
Eigen::MatrixXd curvature_root(const Problem& problem, const Moments& s) {
  const Eigen::Index m = problem.J().rows();
  Eigen::MatrixXd normals(10, m + 1);
  normals << problem.J().transpose(), problem.gradient(s);
  const Eigen::MatrixXd Z = orthogonal_completion(normals).rightCols(9 - m);
  const SymmetricEigen eigen = symmetric_eigen(restricted(problem.hessian(s), Z));
  return product(Z, eigen.vectors) * eigen.values.cwiseMax(0).cwiseSqrt().asDiagonal();
}

/// Sequential quadratic programming over the attainable moments, a convex set: the convex model of the objective at s is minimised
/// over them by its dual, and the best point on the way there, which costs no pass over the rays, is the next s. Newton's method
/// tries to finish from each.
class Descent {
public:
  struct Start {
    Moments s;
    double cost;  ///< of s, or more
    Eigen::VectorXd mu;
    int max_evaluations;
  };
  Descent(Problem& problem, const Start& start, double tolerance)
      : problem_(problem),
        s_(start.s),
        cost_(start.cost),
        mu_(start.mu),
        tolerance_(tolerance),
        max_evaluations_(problem.evaluations() + start.max_evaluations),
        patience_(problem.evaluations() + 11) {}

  /// Until converged, infeasible or out of evaluations.
  void run() {
    while (problem_.evaluations() < max_evaluations_) {
      KktPoint here = kkt_at(problem_, s_, mu_);
      if (here.merit < worth_ && finished(here)) return;
      if (!step(here)) return;
    }
  }

  bool converged() const { return converged_; }
  const KktPoint& best() const { return best_; }
  /// Multipliers that prove infeasibility, or empty.
  const Eigen::VectorXd& separation() const { return separation_; }

private:
  /// Objective, cost, and violated constraints at a price at which no violation pays.
  double value(const Moments& s, double cost, const Eigen::VectorXd& mu) const {
    return problem_.objective(s) + cost + 2 * mu.cwiseAbs().maxCoeff() * problem_.constraints(s).cwiseAbs().sum();
  }

  /// Newton's method; where it does not converge, what it has reached is kept if it is better than `here`.
  bool finished(KktPoint& here) {
    const KktPoint polished = newton(problem_, here, tolerance_, max_evaluations_);
    const double left = residual(problem_, polished.s, polished.at.s);
    const bool solved = left < tolerance_;
    converged_ = solved && is_minimum(problem_, polished);
    if (converged_ || left < best_left_) {
      best_ = polished;
      best_left_ = left;
    }
    if (converged_) return true;
    worth_ = here.merit;
    saddle_ = solved;
    if (solved || polished.merit >= here.merit) return false;
    const bool much = polished.merit < 0.3 * much_;
    if (!much && value(polished.at.s, polished.at.cost, polished.mu) >= value(s_, cost_, polished.mu)) return false;
    much_ = std::min(much_, polished.merit);
    s_ = polished.at.s;
    cost_ = polished.at.cost;
    // Multipliers that have gone astray are no start.
    mu_ = polished.q.norm() < 30 * here.q.norm() ? polished.mu : shortest(problem_, s_);
    here = kkt_at(problem_, s_, mu_);
    return false;
  }

  /// False when the constraints are proven infeasible.
  bool step(const KktPoint& here) {
    const Eigen::Index m = mu_.size();
    // Where Newton's method has met a saddle, the convex model leads along its ridge; the linear one is bolder.
    const Eigen::MatrixXd L = saddle_ ? Eigen::MatrixXd(10, 0) : curvature_root(problem_, s_);
    saddle_ = false;
    const Eigen::Index r = L.cols();
    Dual<Moments> dual{problem_.gradient(s_), Eigen::MatrixXd(m + r, 10), Eigen::VectorXd(m + r), Eigen::VectorXd(m + r),
                       Eigen::VectorXd::Constant(m + r, -kInfinity)};
    dual.K << problem_.J(), L.transpose();
    dual.e << -problem_.c_0(), L.transpose() * s_;
    dual.W << Eigen::VectorXd::Zero(m), Eigen::VectorXd::Ones(r);
    Eigen::VectorXd u = Eigen::VectorXd::Zero(m + r);
    u.head(m) = mu_;
    DualPoint<Problem> from = dual_of<Problem>(dual, u, here.q, here.at);

    const double start = from.gradient.norm();
    const double fine = std::max(1e-9, fine_ * start);
    const DualPoint<Problem> top =
        maximise<Problem>(problem_, dual, std::move(from), max_evaluations_, [&](const DualPoint<Problem>& p) {
          const double left = p.gradient.norm();
          if (left < fine) return true;
          if (left < 0.5 * start) {
            // What the model at best has to give: enough of it will do.
            const double wanted = value(s_, cost_, p.u.head(m)) - problem_.objective(s_) + dual.q_0.dot(s_) - p.value;
            if (search(p).gain > 0.3 * wanted) return true;
          }
          if (separates(p)) separation_ = p.u.head(m);
          return separation_.size() > 0;
        });
    if (separation_.size() > 0) return false;
    const Search found = search(top);
    mu_ = top.u.head(m);
    s_ += found.length * (top.at.s - s_);
    cost_ += found.length * (top.at.cost - cost_);
    fine_ = found.length > 0 ? 0.02 : 0.01 * fine_;
    return true;
  }

  struct Search {
    double length = 0, gain = 0;
  };
  /// The best of all between s and an interior: attainable, as both are.
  Search search(const DualPoint<Problem>& p) const {
    const Eigen::VectorXd mu = p.u.head(mu_.size());
    const double here = value(s_, cost_, mu);
    Search found;
    for (int k = 1; k <= 64; ++k) {
      const double length = k / 64.0;
      const double gain = here - value(s_ + length * (p.at.s - s_), cost_ + length * (p.at.cost - cost_), mu);
      if (gain > found.gain) found = {length, gain};
    }
    return found;
  }

  /// Costs a pass: asked for when it takes long, and again when the multipliers run away or it takes much longer.
  bool separates(const DualPoint<Problem>& p) {
    const Eigen::VectorXd mu = p.u.head(mu_.size());
    if (problem_.evaluations() <= patience_ || (mu.norm() < 1.5 * tried_ && problem_.evaluations() <= patience_ + 8)) return false;
    // An interior that shows that they do not.
    if (mu.dot(problem_.constraints(p.at.s)) <= 1e-9 * mu.norm()) return false;
    patience_ = problem_.evaluations() + 1;
    tried_ = mu.norm();
    return problem_.lowest(problem_.J().transpose() * mu) + problem_.c_0().dot(mu) > 1e-9 * mu.norm();
  }

  Problem& problem_;
  Moments s_;
  double cost_;
  Eigen::VectorXd mu_;
  double tolerance_;
  int max_evaluations_;
  int patience_;
  double tried_ = 0;          ///< length of the multipliers last tried for separation
  double worth_ = kInfinity;  ///< residuals below it are worth a trial of Newton's method
  double much_ = 1;           ///< the least residual at which Newton's method was taken at its word
  double fine_ = 0.02;        ///< to which part of its gradient a model is solved
  bool saddle_ = false;       ///< Newton's method has just met a stationary point that is no minimum
  bool converged_ = false;
  KktPoint best_;
  double best_left_ = kInfinity;
  Eigen::VectorXd separation_;
};

QuadricSolution solve_curved(Problem& problem, const QuadricOptions& options) {
  QuadricSolution solution;
  solution.lower_bound = -kInfinity;
  using Start = Descent::Start;
  const double highest = problem.highest_cost();
  const auto cold = [&](const Moments& s, double cost) { return Start{s, cost, shortest(problem, s), options.max_evaluations}; };
  std::vector<Start> starts;
  if (options.multipliers.size() == problem.J().rows())
    starts.push_back(
        {problem.scaled(options.moments), highest, options.multipliers, std::min(kWarmEvaluations, options.max_evaluations)});
  starts.push_back(cold(problem.solid(), highest));
  starts.push_back(cold(problem.centre(), 0.5 * highest));
  for (const Start& start : starts) {
    Descent descent(problem, start, options.tolerance);
    descent.run();
    const KktPoint& best = descent.best();
    if (descent.converged() || solution.multipliers.size() == 0) {
      store(problem, best.q, best.at, best.mu, solution);
      solution.residual = residual(problem, best.s, best.at.s);
    }
    solution.converged = descent.converged();
    solution.infeasible = descent.separation().size() > 0;
    solution.separation = descent.separation();
    if (solution.converged || solution.infeasible) break;
  }
  return solution;
}

/// A goal on its rays, where what fills them has a price.
struct Priced {
  const Goal& goal;
  const RayIntegrals& rays;
  const Moments& constant;
  double price = 0;
};

/// A curved goal with inequalities, by its gradients: theory.md (70)
QuadricSolution solve_by_gradients(const Priced& asked, const QuadricOptions& options) {
  constexpr int most_rounds = 40;
  QuadricSolution solution;
  QuadricOptions warm = options;
  Moments s = asked.constant + asked.rays.full();
  double objective = kInfinity;
  int evaluations = 0;
  for (int round = 0; round < most_rounds; ++round) {
    const Goal gradient = linear_goal(asked.goal.gradient(s), asked.goal);
    Problem problem(gradient, asked.rays, asked.constant, asked.price);
    solution = solve_affine(problem, warm);
    evaluations += problem.evaluations();
    solution.evaluations = evaluations;
    solution.objective = asked.goal.objective(solution.moments);
    solution.lower_bound = -kInfinity;
    if (!solution.converged) return solution;
    s = solution.moments;
    warm.multipliers = solution.multipliers;
    if (round > 0 && std::abs(solution.objective - objective) <= 1e-13 * std::abs(objective)) return solution;
    objective = solution.objective;
  }
  solution.converged = false;
  return solution;
}

QuadricSolution solve_at(const Priced& asked, const QuadricOptions& options) {
  if (!asked.goal.affine && asked.goal.at_most > 0) return solve_by_gradients(asked, options);
  Problem problem(asked.goal, asked.rays, asked.constant, asked.price);
  QuadricSolution solution = asked.goal.affine ? solve_affine(problem, options) : solve_curved(problem, options);
  solution.evaluations = problem.evaluations();
  return solution;
}

constexpr double kInCone = 1e-9;

/// The matrix of a cone in axes turned by an angle.
struct Turned {
  double p, q, c;  ///< [[p, c], [c, q]]

  Turned(const Goal::Cone& cone, const Moments& s, double angle) {
    const double xx = cone.xx.dot(s);
    const double yy = cone.yy.dot(s);
    const double xy = cone.xy.dot(s);
    const double cos = std::cos(angle);
    const double sin = std::sin(angle);
    p = cos * cos * xx + 2 * cos * sin * xy + sin * sin * yy;
    q = sin * sin * xx - 2 * cos * sin * xy + cos * cos * yy;
    c = cos * sin * (yy - xx) + (cos * cos - sin * sin) * xy;
  }
  double largest() const { return 0.5 * (p + q) + std::hypot(0.5 * (p - q), c); }
  /// From these axes to those of its eigenvectors, -pi/4 to pi/4.
  double to_axes() const {
    const double turn = p == q && c == 0 ? 0 : 0.5 * std::atan2(2 * c, p - q);
    const double quarter = 0.5 * std::numbers::pi;
    return turn - quarter * std::round(turn / quarter);
  }
};

std::vector<Moments> cuts_at(const Goal::Cone& cone, double angle) {
  const double cos = std::cos(angle);
  const double sin = std::sin(angle);
  return {cos * cos * cone.xx + sin * sin * cone.yy + 2 * cos * sin * cone.xy,
          sin * sin * cone.xx + cos * cos * cone.yy - 2 * cos * sin * cone.xy};
}

/// Goals with a cone. theory.md (76)
class InCone {
public:
  InCone(const Goal& goal, const RayIntegrals& rays, const Moments& constant, const QuadricOptions& options)
      : goal_(goal), rays_(rays), constant_(constant), warm_(options) {
    assert(goal.affine);
  }

  QuadricSolution solve() {
    double start = warm_.cut_angle_rad.value_or(0);
    if (!warm_.cut_angle_rad) {
      const QuadricSolution free = solved({});
      const Turned at(*goal_.cone, free.moments, 0);
      if (!free.converged || at.largest() <= kInCone) return free;
      start = at.to_axes();
      warm_.multipliers.conservativeResize(free.multipliers.size() + 2);
      warm_.multipliers.tail(2).setZero();
    }
    return turned(start);
  }

private:
  QuadricSolution solved(const std::vector<Moments>& cuts) {
    const Goal rows = with_cuts(goal_, cuts);
    QuadricSolution solution = solve_quadric(rows, rays_, constant_, warm_);
    evaluations_ += solution.evaluations;
    solution.evaluations = evaluations_;
    solution.cuts = cuts;
    if (solution.converged) warm_.multipliers = solution.multipliers;
    return solution;
  }

  /// Turns the cuts until the matrix is diagonal between them. A quarter turn on they are the same two, and its entry off the
  /// diagonal has the other sign: there is a zero between, found by the Illinois method.
  QuadricSolution turned(double lo) {
    constexpr int most_rounds = 60;
    double hi = lo + 0.5 * std::numbers::pi;
    double at_lo = 0;
    double at_hi = 0;
    double angle = lo;
    int side = 0;
    QuadricSolution solution;
    for (int round = 0; round < most_rounds; ++round) {
      solution = solved(cuts_at(*goal_.cone, angle));
      solution.cut_angle_rad = angle;
      const Turned at(*goal_.cone, solution.moments, angle);
      if (!solution.converged || at.largest() <= kInCone) return solution;
      if (round == 0) {
        at_lo = at.c;
        at_hi = -at.c;
        // To its own axes, the one way round or the other.
        const double turn = at.to_axes();
        angle = turn > 0 ? lo + turn : hi + turn;
        continue;
      }
      const bool low = (at.c > 0) == (at_lo > 0);
      if (side == (low ? -1 : 1)) (low ? at_hi : at_lo) *= 0.5;
      side = low ? -1 : 1;
      (low ? lo : hi) = angle;
      (low ? at_lo : at_hi) = at.c;
      angle = (lo * at_hi - hi * at_lo) / (at_hi - at_lo);
    }
    solution.converged = false;
    return solution;
  }

  const Goal& goal_;
  const RayIntegrals& rays_;
  const Moments& constant_;
  QuadricOptions warm_;
  int evaluations_ = 0;
};

}  // namespace

QuadricSolution solve_quadric(const Goal& goal, const RayIntegrals& rays, const Moments& constant, const QuadricOptions& options) {
  if (goal.cone) return InCone(goal, rays, constant, options).solve();
  const QuadricSolution free = solve_at({goal, rays, constant}, options);
  const double most = rays.grid().most_mm3;
  if (!free.converged || free.filled_mm3 <= most) return free;

  // The higher the price, the less is taken: where as much is taken as there is, by the Illinois method.
  int evaluations = free.evaluations;
  QuadricOptions warm = options;
  const auto at = [&](double price) {
    QuadricSolution solution = solve_at({goal, rays, constant, price}, warm);
    evaluations += solution.evaluations;
    solution.price = price;
    solution.evaluations = evaluations;
    if (solution.converged) {
      warm.multipliers = solution.multipliers;
      warm.moments = solution.moments;
    }
    return solution;
  };
  const auto excess = [most](const QuadricSolution& s) { return s.filled_mm3 / most - 1; };
  QuadricSolution cheap = free;
  // q.phi is of this size.
  double price = 0.05 * std::abs(free.q.dot(rays.full())) / rays.full()[M1] + 1e-3 * std::abs(free.q[M1]);
  QuadricSolution dear = at(price);
  for (int doubling = 0; doubling < 40 && dear.converged && excess(dear) > 0; ++doubling) {
    cheap = dear;
    price *= 2;
    dear = at(price);
  }
  if (!dear.converged || excess(dear) > 0) {
    cheap.converged = false;
    cheap.infeasible = true;
    cheap.evaluations = evaluations;
    return cheap;
  }
  double weight_of_cheap = 1;
  double weight_of_dear = 1;
  for (int n = 0; n < 60 && excess(dear) < -1e-7 && dear.price - cheap.price > 1e-12 * dear.price; ++n) {
    const double a = weight_of_cheap * excess(cheap);
    const double b = weight_of_dear * excess(dear);
    QuadricSolution next = at(cheap.price + (dear.price - cheap.price) * std::clamp(a / (a - b), 0.02, 0.98));
    if (!next.converged) break;
    const bool too_much = excess(next) > 1e-9;
    weight_of_cheap = too_much ? 1 : 0.5 * weight_of_cheap;
    weight_of_dear = too_much ? 0.5 * weight_of_dear : 1;
    (too_much ? cheap : dear) = std::move(next);
  }
  dear.evaluations = evaluations;
  // By weak duality, of all that take no more than there is.
  dear.lower_bound -= dear.price * (1 - rays.grid().substitute) * rays.grid().weight * most;
  return dear;
}

double separation_margin(const Goal& goal, const Eigen::VectorXd& y, const RayIntegrals& rays, const Moments& constant) {
  const Moments q = goal.J.transpose() * y;
  return y.dot(goal.c_0) + q.dot(constant + rays.moments(q));
}

NearestSolution nearest_attainable(const Goal& goal, const RayIntegrals& rays, const Moments& constant, double tolerance) {
  constexpr int max_evaluations = 1000;
  assert(goal.at_most == 0 && !goal.cone);
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
      if (n > 0) rest = -least_squares(edges, corners[0].c);
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
