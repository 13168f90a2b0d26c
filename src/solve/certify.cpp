#include "rayrep/solve/certify.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <vector>

namespace rayrep {
namespace {

/// With the volume of material that is asked for, if one is.
Goal with_material(Goal goal, const CertifiedSpin& problem) {
  if (!problem.material_mm3) return goal;
  return with_equation(std::move(goal), Moments::Unit(M1) / *problem.material_mm3, -1);
}

/// Solves at one height and bounds the intervals below and above it.
class Height {
public:
  Height(const CertifiedSpin& problem, const RayIntegrals& rays, const Moments& constant, double l)
      : problem_(problem),
        rays_(rays),
        constant_(constant),
        l_(l),
        T_(moment_map(Eigen::Affine3d(Eigen::Translation3d(0, 0, -l)))) {
    const Goal fixed = with_material(
        spin_goal({.lambda = 0, .gamma_c = 0, .gamma_i = 1}, true, true, problem.volume_mm3, problem.length_mm), problem);
    const Goal goal = mapped(fixed, T_);
    solution_ = solve_quadric(goal, rays, constant);
    evaluations_ = solution_.evaluations;
    J_ = fixed.J;
    c_0_ = fixed.c_0;
    if (solution_.infeasible) {
      margin_ = separation_margin(goal, solution_.separation, rays, constant);
      ++evaluations_;
    }
    if (!solution_.converged) return;
    // grad R = 2 rho / Izz (grad <W, I~> - rho grad Izz): with multipliers in that unit, q.s is 0 at the optimum.
    const Moments s = T_ * solution_.moments;
    inertia_ << s[MYY] + s[MZZ], -s[MXY], -s[MXY], s[MXX] + s[MZZ];
    W_ = inertia_ / inertia_.norm();
    const double axial = s[MXX] + s[MYY];
    ratio_ = inertia_.norm() / axial;
    multipliers_ = solution_.multipliers * (axial / (2 * ratio_));
  }

  const QuadricSolution& solution() const { return solution_; }
  int evaluations() const { return evaluations_; }
  double objective() const { return problem_.lambda * l_ / problem_.length_mm + problem_.gamma_i * ratio_ * ratio_; }

  /// What is left of the heights from l to `end` and what no interior there does better than. Empty when none is attainable.
  HeightBound bounded(double end, double known) {
    const double side = end > l_ ? 1 : -1;
    const double d = std::abs(end - l_);
    HeightBound node{{std::min(l_, end), std::max(l_, end)}, known};
    if (margin_ > 0) {
      // y.c(s) >= margin, where only the last constraint, (c_z - l) m / (V L), is not 0.
      const double y = side * solution_.separation[4] / (problem_.volume_mm3 * problem_.length_mm);
      const double largest_mass = constant_[M1] + rays_.full()[M1];
      const double away = y > 0 ? margin_ / (y * largest_mass) : d;
      if (away >= d) return {{l_, l_}, known};
      (side > 0 ? node.heights.lo : node.heights.hi) = l_ + side * away;
      return node;
    }
    if (!solution_.converged) return node;
    // Within these heights I~ >= I - d^2 m (moments about l), and 0 <= side (c_z - l) m <= d m: the multiplier nu of that may stay
    // when it rewards staying at l, else what moving away gains is counted in full.
    Moments q = Moments::Zero();
    q[MXX] = W_(1, 1);
    q[MYY] = W_(0, 0);
    q[MZZ] = W_.trace();
    q[MXY] = -2 * W_(0, 1);
    q[M1] = -d * d * W_.trace();
    q += J_.transpose() * multipliers_;
    const double nu = side * (J_.transpose() * multipliers_)[MZ];
    if (nu > 0) q[M1] -= nu * d;
    Moments axial = Moments::Zero();
    axial[MXX] = axial[MYY] = 1;
    // The largest t with min over interiors of (q - t axial).s + mu.c_0 >= 0: Newton's method on a concave function, from above.
    const double smallest_axial = axial.dot(constant_);
    const double offset = multipliers_.dot(c_0_);
    double t = ratio_;
    for (int step = 0; step < 20; ++step) {
      const Moments at = T_.transpose() * (q - t * axial);
      const Moments s = T_ * (constant_ + rays_.moments(at));
      ++evaluations_;
      const double g = (q - t * axial).dot(s) + offset;
      const double next = t + g / axial.dot(s);
      if (g >= 0 || t - next < 1e-9 * ratio_) {
        if (g < 0) t += g / smallest_axial;  // falls at least as fast as this
        break;
      }
      t = next;
    }
    t = std::max(t, 0.0);
    const double bound = problem_.lambda * node.heights.lo / problem_.length_mm + problem_.gamma_i * t * t;
    node.bound = std::max(known, bound);
    return node;
  }

private:
  const CertifiedSpin& problem_;
  const RayIntegrals& rays_;
  const Moments& constant_;
  double l_;
  Matrix10 T_;
  QuadricSolution solution_;
  int evaluations_ = 0;
  double margin_ = 0;  ///< of an infeasible height's separation
  Eigen::MatrixXd J_;  ///< of the constraints, about l
  Eigen::VectorXd c_0_;
  Eigen::Matrix2d inertia_;
  Eigen::Matrix2d W_;
  double ratio_ = 0;
  Eigen::VectorXd multipliers_;
};

}  // namespace

HeightBound bound_heights(const CertifiedSpin& problem, const RayIntegrals& rays, const Moments& constant, double l, double end) {
  return Height(problem, rays, constant, l).bounded(end, -std::numeric_limits<double>::infinity());
}

SpinCertificate certify_spin(const CertifiedSpin& problem, const RayIntegrals& rays, const Moments& constant,
                             const CertifyOptions& options, const Progress& progress) {
  const Interval& heights = options.heights;
  SpinCertificate certificate;
  const Goal goal = with_material(spin_goal({.lambda = problem.yoyo ? 0 : problem.lambda, .gamma_c = 0, .gamma_i = problem.gamma_i},
                                            true, problem.yoyo, problem.volume_mm3, problem.length_mm),
                                  problem);
  QuadricSolution& best = certificate.best;
  best = solve_quadric(goal, rays, constant);
  certificate.evaluations = best.evaluations;
  if (best.infeasible) {
    certificate.infeasible = true;
    return certificate;
  }
  // Where the best interior found has its centre is where heights are hardest to rule out.
  const double first = best.converged ? best.moments[MZ] / best.moments[M1] : heights.middle();
  const auto counts = [&](const QuadricSolution& solution) {
    if (!options.within || problem.yoyo) return solution.converged;
    const double height = solution.moments[MZ] / solution.moments[M1];
    return solution.converged && height >= heights.lo && height <= heights.hi;
  };
  if (!counts(best)) {
    best.converged = false;
    best.objective = std::numeric_limits<double>::infinity();
  }

  const auto finish = [&](double bound) {
    certificate.lower_bound = std::min(bound, best.objective);
    certificate.gap = (best.objective - certificate.lower_bound) / best.objective;
    certificate.closed = best.converged && certificate.gap <= options.gap;
    return certificate;
  };
  if (problem.yoyo) {
    CertifiedSpin fixed = problem;
    fixed.lambda = 0;
    Height height(fixed, rays, constant, 0);
    const double bound = height.bounded(0, 0).bound;
    certificate.nodes = 1;
    certificate.evaluations += height.evaluations();
    return finish(bound);
  }

  const auto higher = [](const HeightBound& a, const HeightBound& b) { return a.bound > b.bound; };
  std::priority_queue<HeightBound, std::vector<HeightBound>, decltype(higher)> open(higher);  // the lowest on top
  const auto split = [&](const HeightBound& node, double at) {
    Height height(problem, rays, constant, at);
    for (const double end : {node.heights.lo, node.heights.hi}) {
      const HeightBound child = height.bounded(end, node.bound);
      if (child.heights.length() > 0) open.push(child);
    }
    ++certificate.nodes;
    certificate.evaluations += height.evaluations();
    if (!height.solution().converged || !(height.objective() < best.objective * (1 - 1e-9))) return;
    const Eigen::VectorXd& fixed = height.solution().multipliers;
    QuadricOptions from;
    from.moments = height.solution().moments;
    from.multipliers.resize(goal.constraints());
    from.multipliers << fixed.head(4), fixed.tail(fixed.size() - 5);
    from.multipliers *= problem.gamma_i;
    const QuadricSolution better = solve_quadric(goal, rays, constant, from);
    certificate.evaluations += better.evaluations;
    if (counts(better) && better.objective < best.objective) best = better;
    if (!options.within || !(height.objective() < best.objective)) return;
    best = height.solution();
    best.objective = height.objective();
    best.lower_bound = -std::numeric_limits<double>::infinity();
  };
  split({heights, -std::numeric_limits<double>::infinity()}, std::clamp(first, heights.lo, heights.hi));
  while (!open.empty() && certificate.nodes < options.max_nodes) {
    progress.check();
    const HeightBound node = open.top();
    if (best.converged && best.objective - node.bound <= options.gap * best.objective) break;
    open.pop();
    split(node, node.heights.middle());
  }
  certificate.infeasible = open.empty() && !best.converged;
  return finish(open.empty() ? best.objective : open.top().bound);
}

}  // namespace rayrep
