#include "rayrep/quadric.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "rayrep/ray_interior.h"

namespace rayrep {
namespace {

using Vector4 = Eigen::Vector4d;  // over phi = (1, x, y, z)

/// One pass over the rays at the plane q.phi = 0: moments of the material below it and, where the plane cuts a ray inside its
/// interval, the sum of psi psi^T with psi = (1, x, y).
struct Pass {
  Vector4 moments = Vector4::Zero();
  Eigen::Matrix3d free = Eigen::Matrix3d::Zero();
};

Pass fill_below(const RayRep& domain, const Vector4& q) {
  Pass pass;
  for (std::size_t ray = 0; ray < domain.grid.size(); ++ray) {
    if (domain.first[ray] == domain.first[ray + 1]) continue;
    const Eigen::Vector2d xy = domain.grid.at(ray);
    const double plane = -(q[0] + q[1] * xy.x() + q[2] * xy.y()) / q[3];
    const Eigen::Vector3d psi(1, xy.x(), xy.y());
    double length = 0;
    for (std::uint32_t n = domain.first[ray]; n < domain.first[ray + 1]; ++n) {
      const Interval& interval = domain.intervals[n];
      if (plane <= interval.lo) break;
      const double z1 = std::min(plane, interval.hi);
      length += z1 - interval.lo;
      pass.moments[3] += 0.5 * (z1 - interval.lo) * (z1 + interval.lo);
      if (plane < interval.hi) pass.free += psi * psi.transpose();
    }
    pass.moments.head<3>() += length * psi;
  }
  pass.moments *= domain.grid.cell_area_mm2();
  pass.free *= domain.grid.cell_area_mm2();
  return pass;
}

/// The affine goal restricted to (s_1, s_x, s_y, s_z).
struct AffineGoal {
  Vector4 gradient;
  double objective_0;
  Eigen::Matrix<double, Eigen::Dynamic, 4> C;
  Eigen::VectorXd c_0;
};

AffineGoal restrict(const Goal& goal, const Moments& constant) {
  assert(goal.affine());
  const Moments g = goal.gradient(constant);
  const auto J = goal.constraint_jacobian(constant);
  assert(g[MZ] > 0 && g.tail<6>().isZero() && J.rightCols<6>().isZero() && J.col(MZ).isZero());
  return {g.head<4>(), goal.objective(constant), J.leftCols<4>(), goal.constraint_values(constant)};
}

/// Dual value, its gradient (the constraints' values) and Hessian at mu.
struct Dual {
  double value = 0;
  Eigen::VectorXd residual;
  Eigen::MatrixXd hessian;
};

Dual evaluate(const AffineGoal& goal, const RayRep& domain, const Eigen::VectorXd& mu) {
  const Vector4 q = goal.gradient + goal.C.transpose() * mu;
  const Pass pass = fill_below(domain, q);
  Dual dual;
  dual.residual = goal.c_0 + goal.C * pass.moments;
  dual.value = goal.objective_0 + goal.gradient.dot(pass.moments) + mu.dot(dual.residual);
  dual.hessian = goal.C.leftCols<3>() * pass.free * goal.C.leftCols<3>().transpose() / -q[3];
  return dual;
}

}  // namespace

QuadricSolution solve_quadric(const Goal& goal, const RayRep& domain, const Moments& constant) {
  constexpr int max_evaluations = 200;
  constexpr double tolerance = 1e-10;
  const AffineGoal affine = restrict(goal, constant);
  QuadricSolution solution;

  // The Hessian with every ray cut, to make singular ones definite.
  Eigen::Matrix3d all = Eigen::Matrix3d::Zero();
  double lowest = std::numeric_limits<double>::infinity();
  double highest = -lowest;
  for (std::size_t ray = 0; ray < domain.grid.size(); ++ray) {
    const Eigen::Vector2d xy = domain.grid.at(ray);
    const Eigen::Vector3d psi(1, xy.x(), xy.y());
    all += static_cast<double>(domain.first[ray + 1] - domain.first[ray]) * psi * psi.transpose();
  }
  for (const Interval& interval : domain.intervals) {
    lowest = std::min(lowest, interval.lo);
    highest = std::max(highest, interval.hi);
  }
  if (domain.intervals.empty()) return solution;
  const Eigen::MatrixXd H_all =
      affine.C.leftCols<3>() * all * affine.C.leftCols<3>().transpose() * (domain.grid.cell_area_mm2() / affine.gradient[3]);

  // Where the first constraint fixes the mass, start at the level plane that gives it.
  Eigen::VectorXd mu = Eigen::VectorXd::Zero(affine.C.rows());
  if (affine.C(0, M1) != 0 && affine.C.row(0).tail<3>().isZero()) {
    const double per_height = -affine.gradient[3] / affine.C(0, M1);
    Interval level{lowest, highest};
    for (int n = 0; n < 12; ++n) {
      mu[0] = per_height * level.middle();
      ++solution.evaluations;
      (evaluate(affine, domain, mu).residual[0] > 0 ? level.hi : level.lo) = level.middle();
    }
  }

  Dual dual = evaluate(affine, domain, mu);
  double damping = 1e-12;
  while (solution.evaluations < max_evaluations) {
    if (dual.residual.cwiseAbs().maxCoeff() < tolerance) {
      solution.converged = true;
      break;
    }
    const Eigen::VectorXd step = (-dual.hessian + damping * H_all).ldlt().solve(dual.residual);
    const double slope = dual.residual.dot(step);
    double length = 1;
    Dual next;
    bool accepted = false;
    for (int cut = 0; cut < 12 && !accepted; ++cut, length *= 0.5) {
      next = evaluate(affine, domain, mu + length * step);
      ++solution.evaluations;
      // Near the top the gain drowns in rounding; there a smaller residual is as good.
      accepted = next.value >= dual.value + 1e-4 * length * slope || next.residual.norm() < 0.5 * dual.residual.norm();
      if (accepted) mu += length * step;
    }
    if (accepted) {
      dual = next;
      damping = std::max(1e-12, 0.1 * damping);
    } else {
      damping *= 100;
      if (damping > 1e6) break;
    }
  }
  solution.q = goal.gradient(constant) + goal.constraint_jacobian(constant).transpose() * mu;
  solution.lower_bound = dual.value;

  RayRep material = domain;
  for (std::size_t ray = 0; ray < domain.grid.size(); ++ray) {
    const Eigen::Vector2d xy = domain.grid.at(ray);
    const double plane = -(solution.q[M1] + solution.q[MX] * xy.x() + solution.q[MY] * xy.y()) / solution.q[MZ];
    for (std::uint32_t n = domain.first[ray]; n < domain.first[ray + 1]; ++n)
      material.intervals[n].hi = std::clamp(plane, material.intervals[n].lo, material.intervals[n].hi);
  }
  solution.moments = constant + ray_moments(material);
  solution.objective = goal.objective(solution.moments);
  return solution;
}

namespace {

/// One pass at a switching function that is linear in z: moments of the material where it is negative, and minus their derivative
/// by it.
struct LinearPass {
  Moments moments = Moments::Zero();
  Eigen::Matrix<double, 10, 10> free = Eigen::Matrix<double, 10, 10>::Zero();
};

LinearPass fill_negative(const RayRep& domain, const Moments& q) {
  LinearPass pass;
  RayRep material = domain;
  for (std::size_t ray = 0; ray < domain.grid.size(); ++ray) {
    if (domain.first[ray] == domain.first[ray + 1]) continue;
    const Eigen::Vector2d xy = domain.grid.at(ray);
    const double at_zero = q.dot(monomials({xy.x(), xy.y(), 0}));
    const double slope = q[MZ] + xy.x() * q[MXZ] + xy.y() * q[MYZ];
    const double root = slope != 0 ? -at_zero / slope : 0;
    for (std::uint32_t n = domain.first[ray]; n < domain.first[ray + 1]; ++n) {
      Interval& m = material.intervals[n];
      if (slope > 0)
        m.hi = std::clamp(root, m.lo, m.hi);
      else if (slope < 0)
        m.lo = std::clamp(root, m.lo, m.hi);
      else if (at_zero >= 0)
        m.hi = m.lo;
      if (slope != 0 && root > domain.intervals[n].lo && root < domain.intervals[n].hi) {
        const Moments phi = monomials({xy.x(), xy.y(), root});
        pass.free += (domain.grid.cell_area_mm2() / std::abs(slope)) * phi * phi.transpose();
      }
    }
  }
  pass.moments = ray_moments(material);
  return pass;
}

}  // namespace

NearestSolution nearest_attainable(const Eigen::Matrix<double, Eigen::Dynamic, 10>& A, const RayRep& domain,
                                   const Moments& constant, double tolerance) {
  assert(A.col(MZZ).isZero());
  constexpr int max_iterations = 100;
  NearestSolution solution;
  const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(A.rows(), A.rows());
  struct Point {
    Eigen::VectorXd y, residual;
    LinearPass pass;
    double value;
  };
  const auto evaluate_at = [&](const Eigen::VectorXd& y) {
    Point p{y, {}, fill_negative(domain, A.transpose() * y), 0};
    const Eigen::VectorXd c = A * (constant + p.pass.moments);
    p.residual = c - y;
    p.value = y.dot(c) - 0.5 * y.squaredNorm();
    return p;
  };
  Point at = evaluate_at(A * (constant + 0.5 * ray_moments(domain)));
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    if (at.y.norm() < 0.1 * tolerance || at.residual.norm() < 1e-9 * at.y.norm()) {
      solution.converged = true;
      break;
    }
    const Eigen::VectorXd step = (identity + A * at.pass.free * A.transpose()).ldlt().solve(at.residual);
    const double slope = at.residual.dot(step);
    bool moved = false;
    for (double length = 1; length > 1e-6 && !moved; length *= 0.5) {
      Point next = evaluate_at(at.y + length * step);
      moved = next.value >= at.value + 1e-4 * length * slope;
      if (moved) at = std::move(next);
    }
    if (!moved) break;  // as near as rounding lets it come
  }
  solution.moments = constant + at.pass.moments;
  solution.distance = (A * solution.moments).norm();
  // |A s|^2 / 2 >= g(y) for every s and y.
  solution.lower_bound = std::sqrt(2 * std::max(0.0, at.value));
  solution.attainable = solution.lower_bound < tolerance;
  return solution;
}

}  // namespace rayrep
