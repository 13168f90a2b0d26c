#include "rayrep/solve/parts.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "solve/dual_ascent.h"

namespace rayrep {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kTolerance = 1e-10;
constexpr int kMaxEvaluations = 200;
constexpr int kWarmEvaluations = 40;

/// The moments of all bodies, one below the other, in units that make them of order 1.
class Problem {
public:
  using Vector = VectorXd;
  struct Evaluation {
    VectorXd s;
    std::vector<Matrix10> spread;  ///< of each body
    double cost = 0;
  };

  Problem(const PartsGoal& goal, const std::vector<PartInterior>& parts) : parts_(parts), at_most_(goal.at_most) {
    unit_.resize(rows());
    for (std::size_t j = 0; j < parts.size(); ++j) {
      const Moments solid = parts[j].constant + parts[j].rays->full();
      const double length = std::sqrt(std::abs(solid.segment<3>(MXX).sum() / solid[M1]));
      unit_.segment<10>(first(j)) = moment_units(std::abs(solid[M1]), length);
    }
    J_ = goal.J * unit_.asDiagonal();
    g_ = goal.g.cwiseProduct(unit_);
    c_0_ = goal.c_0;
  }

  Evaluation evaluate(const VectorXd& q, double blur) {
    ++evaluations_;
    Evaluation at{VectorXd(rows()), std::vector<Matrix10>(parts_.size()), 0};
    for (std::size_t j = 0; j < parts_.size(); ++j) {
      const Moments unit = unit_.segment<10>(first(j));
      const RayIntegrals::Pass pass = parts_[j].rays->pass(q_of(q, j), blur);
      at.s.segment<10>(first(j)) = (parts_[j].constant + pass.moments).cwiseQuotient(unit);
      at.spread[j] = unit.cwiseInverse().asDiagonal() * pass.spread * unit.cwiseInverse().asDiagonal();
    }
    return at;
  }
  int evaluations() const { return evaluations_; }

  static Eigen::MatrixXd curvature(const Eigen::MatrixXd& K, const Evaluation& at) {
    Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(K.rows(), K.rows());
    for (std::size_t j = 0; j < at.spread.size(); ++j) sum += congruence(K.middleCols<10>(first(j)), at.spread[j]);
    return sum;
  }

  /// A body that q says nothing of may be anything: it adds nothing.
  double lowest(const VectorXd& q) {
    ++evaluations_;
    double sum = 0;
    for (std::size_t j = 0; j < parts_.size(); ++j) {
      const Moments q_j = q_of(q, j);
      if (!q_j.isZero(0)) sum += q_j.dot(parts_[j].constant + parts_[j].rays->moments(q_j));
    }
    return sum;
  }
  static double highest_cost() { return 0; }

  const Eigen::MatrixXd& J() const { return J_; }
  const VectorXd& c_0() const { return c_0_; }
  const VectorXd& g() const { return g_; }
  VectorXd lowest_multipliers() const {
    VectorXd lowest = VectorXd::Constant(J_.rows(), -detail::kInfinity);
    lowest.tail(at_most_).setZero();
    return lowest;
  }

  /// Of the bodies filled, less those empty.
  VectorXd inner() const {
    VectorXd all(rows());
    for (std::size_t j = 0; j < parts_.size(); ++j)
      all.segment<10>(first(j)) = parts_[j].rays->full().cwiseQuotient(unit_.segment<10>(first(j)));
    return all;
  }
  Moments q_of(const VectorXd& q, std::size_t j) const {
    return q.segment<10>(first(j)).cwiseQuotient(unit_.segment<10>(first(j)));
  }
  Moments moments_of(const VectorXd& s, std::size_t j) const {
    return s.segment<10>(first(j)).cwiseProduct(unit_.segment<10>(first(j)));
  }

private:
  Index rows() const { return 10 * static_cast<Index>(parts_.size()); }
  static Index first(std::size_t j) { return 10 * static_cast<Index>(j); }

  const std::vector<PartInterior>& parts_;
  Index at_most_;
  VectorXd unit_;
  Eigen::MatrixXd J_;
  VectorXd g_, c_0_;
  int evaluations_ = 0;
};

}  // namespace

PartsSolution solve_parts(const PartsGoal& goal, const std::vector<PartInterior>& parts, const VectorXd& multipliers) {
  assert(!parts.empty() && goal.J.cols() == 10 * static_cast<Index>(parts.size()) && goal.g.size() == goal.J.cols());
  Problem problem(goal, parts);
  const Index m = goal.J.rows();
  detail::LinearMinimum<Problem> minimum;
  if (multipliers.size() == m) minimum = detail::minimise_linear(problem, problem.g(), multipliers, kTolerance, kWarmEvaluations);
  if (!minimum.converged && !minimum.infeasible) {
    // Where the mean of q.phi over all inner domains is 0 there are free ends.
    VectorXd start = VectorXd::Zero(m);
    const VectorXd inner = problem.inner();
    const VectorXd c = problem.J() * inner;
    if (c.norm() > 1e-6 * inner.norm()) start = -problem.g().dot(inner) / c.squaredNorm() * c;
    minimum = detail::minimise_linear(problem, problem.g(), start, kTolerance, problem.evaluations() + kMaxEvaluations);
  }
  PartsSolution solution;
  solution.converged = minimum.converged;
  solution.infeasible = minimum.infeasible;
  solution.evaluations = problem.evaluations();
  for (std::size_t j = 0; j < parts.size(); ++j) {
    solution.q.push_back(problem.q_of(minimum.top.q, j));
    solution.moments.push_back(problem.moments_of(minimum.top.at.s, j));
  }
  solution.multipliers = minimum.top.u;
  solution.objective = problem.g().dot(minimum.top.at.s);
  solution.residual = m > 0 ? minimum.top.gradient.cwiseAbs().maxCoeff() : 0;
  solution.lower_bound = minimum.top.value;
  if (minimum.infeasible) solution.separation = minimum.top.u;
  return solution;
}

}  // namespace rayrep
