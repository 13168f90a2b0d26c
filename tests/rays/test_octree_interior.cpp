#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "ellipsoid_rays.h"
#include "rayrep/base/error.h"
#include "rayrep/rays/octree_interior.h"
#include "rayrep/solve/goals.h"
#include "rayrep/solve/quadric.h"
#include "rayrep/solve/solve_octree.h"
#include "solids.h"

namespace rayrep {
namespace {

using namespace test;
using MomentColumns = Eigen::Matrix<double, 10, Eigen::Dynamic>;

MomentColumns moments_of_cells(const FillInterior& interior) { return interior.jacobian(interior.start(0)); }

/// The columns as a sorted list, to compare cells in another order.
std::vector<std::vector<double>> sorted_columns(const MomentColumns& columns) {
  std::vector<std::vector<double>> list;
  for (Eigen::Index n = 0; n < columns.cols(); ++n) list.emplace_back(columns.col(n).data(), columns.col(n).data() + 10);
  std::sort(list.begin(), list.end());
  return list;
}

Eigen::VectorXd random_fill(Eigen::Index count, std::uint64_t seed) {
  Random random(seed);
  Eigen::VectorXd fill(count);
  for (double& rho : fill) rho = random.uniform();
  return fill;
}

std::uint64_t size_of(const OctreeLeaf& leaf) { return std::uint64_t{1} << 3 * leaf.level; }

/// Leaves of many levels: large ones are split where a random number says so.
std::vector<OctreeLeaf> mixed_leaves(const RayRep& domain, int level, std::uint64_t seed) {
  std::vector<OctreeLeaf> leaves = uniform_leaves(domain, level);
  for (int round = 0; round < level; ++round) {
    const OctreeInterior interior(domain, leaves);
    Eigen::VectorXd fill = random_fill(interior.variables(), seed + static_cast<std::uint64_t>(round));
    // 0.5 is split; the others alternate so that nothing is merged.
    for (Eigen::Index n = 0; n < fill.size(); ++n) fill[n] = fill[n] < 0.4 ? 0.5 : static_cast<double>(n % 2);
    leaves = interior.split_and_merge(fill, 0.01, false).leaves;
  }
  return leaves;
}

Eigen::Vector3i corner_of(const OctreeLeaf& leaf) {
  Eigen::Vector3i corner = Eigen::Vector3i::Zero();
  for (int bit = 0; bit < 63; ++bit) corner[bit % 3] |= static_cast<int>(leaf.code >> bit & 1) << bit / 3;
  return corner;
}

TEST(OctreeInterior, UniformLeavesAreVoxels) {
  const EllipsoidRays p(20, true);
  for (int level = 0; level < 5; ++level) {
    const OctreeInterior octree(p.domain, uniform_leaves(p.domain, level));
    const VoxelInterior voxels(p.domain, 1 << level);
    EXPECT_EQ(sorted_columns(moments_of_cells(octree)), sorted_columns(moments_of_cells(voxels))) << level;
    EXPECT_GT(octree.variables(), 0);
  }
}

TEST(OctreeInterior, ALeafHoldsWhatItsFinestCellsHold) {
  const EllipsoidRays p(20, false);
  const OctreeInterior finest(p.domain, uniform_leaves(p.domain, 0));
  const OctreeInterior octree(p.domain, mixed_leaves(p.domain, 3, 11));
  std::set<int> levels;
  MomentColumns sums = MomentColumns::Zero(10, octree.variables());
  std::size_t at = 0;
  for (std::size_t n = 0; n < finest.leaves().size(); ++n) {
    const std::uint64_t code = finest.leaves()[n].code;
    while (octree.leaves()[at].code + size_of(octree.leaves()[at]) <= code) ++at;
    ASSERT_LE(octree.leaves()[at].code, code) << "a cell of the domain is in no leaf";
    sums.col(static_cast<Eigen::Index>(at)) += moments_of_cells(finest).col(static_cast<Eigen::Index>(n));
    levels.insert(octree.leaves()[at].level);
  }
  EXPECT_EQ(levels, (std::set<int>{0, 1, 2, 3}));
  for (Eigen::Index n = 0; n < sums.cols(); ++n) expect_moments_near(moments_of_cells(octree).col(n), sums.col(n), 1e-11, 50);
  expect_moments_near(octree.moments(octree.upper_bounds()), ray_moments(p.domain), 1e-13, 50);
  EXPECT_TRUE(octree.moments(octree.lower_bounds()).isZero());
}

TEST(OctreeInterior, NeighboursShareAFace) {
  const EllipsoidRays p(12, false);
  const OctreeInterior octree(p.domain, mixed_leaves(p.domain, 2, 4));
  std::set<std::pair<int, int>> expected;
  for (int a = 0; a < octree.variables(); ++a)
    for (int b = a + 1; b < octree.variables(); ++b) {
      const OctreeLeaf& one = octree.leaves()[static_cast<std::size_t>(a)];
      const OctreeLeaf& two = octree.leaves()[static_cast<std::size_t>(b)];
      // How far they overlap along each axis: a shared face has no extent along one, and some along the others.
      const Eigen::Array3i lo = corner_of(one).cwiseMax(corner_of(two));
      const Eigen::Array3i hi = (corner_of(one).array() + (1 << one.level)).min(corner_of(two).array() + (1 << two.level));
      const Eigen::Array3i overlap = hi - lo;
      if ((overlap >= 0).all() && (overlap == 0).count() == 1) expected.emplace(a, b);
    }
  std::set<std::pair<int, int>> found;
  for (const auto& [i, j] : octree.neighbours()) EXPECT_TRUE(found.emplace(std::min(i, j), std::max(i, j)).second) << "twice";
  EXPECT_EQ(found, expected);
  EXPECT_GT(found.size(), 100u);
}

TEST(OctreeInterior, SplitsMixedLeavesAndMergesEqualOnes) {
  const EllipsoidRays p(20, false);
  for (const bool at_changes : {false, true}) {
    const OctreeInterior before(p.domain, mixed_leaves(p.domain, 3, 21));
    // Void below a plane, full above, mixed between.
    Eigen::VectorXd fill(before.variables());
    for (Eigen::Index n = 0; n < fill.size(); ++n)
      fill[n] = std::clamp(moments_of_cells(before)(MZ, n) / moments_of_cells(before)(M1, n) / 6, 0.0, 1.0);
    const OctreeInterior::Refinement refined = before.split_and_merge(fill, 0.01, at_changes);
    const OctreeInterior after(p.domain, refined.leaves);
    std::vector<bool> at_change(before.leaves().size());
    for (const auto& [i, j] : before.neighbours())
      if ((fill[i] > 0.5) != (fill[j] > 0.5))
        at_change[static_cast<std::size_t>(i)] = at_change[static_cast<std::size_t>(j)] = true;

    std::size_t splits = 0;
    std::size_t merged = 0;
    std::map<std::uint64_t, std::set<bool>> fills_of_merged;
    for (std::size_t n = 0; n < before.leaves().size(); ++n) {
      const OctreeLeaf& leaf = before.leaves()[n];
      const double rho = fill[static_cast<Eigen::Index>(n)];
      const bool mixed = (rho >= 0.01 && rho <= 0.99) || (at_changes && at_change[n]);
      // The new leaf that holds the old one's first cell with material: it or one of its children, or a merged one.
      const auto next = std::upper_bound(refined.leaves.begin(), refined.leaves.end(), leaf.code,
                                         [](std::uint64_t code, const OctreeLeaf& l) { return code < l.code; });
      ASSERT_NE(next, refined.leaves.begin());
      const OctreeLeaf& now = *(next - 1);
      ASSERT_LT(leaf.code - now.code, size_of(now));
      if (mixed && leaf.level > 0) {
        ++splits;
        EXPECT_EQ(now, (OctreeLeaf{leaf.code, leaf.level - 1}));
      } else if (mixed) {
        EXPECT_EQ(now, leaf);
      } else {
        EXPECT_GE(now.level, leaf.level);
        merged += now.level > leaf.level;
        fills_of_merged[now.code].insert(rho > 0.5);
      }
    }
    EXPECT_EQ(refined.splits, splits);
    EXPECT_GT(splits, 5u);
    EXPECT_GT(merged, 20u);
    for (const auto& [code, fills] : fills_of_merged) EXPECT_EQ(fills.size(), 1u) << "void and full leaves were merged";
    // As coarse as possible: no eight siblings of the new leaves are left that came from equal binary ones. Merging again with the
    // same fills changes nothing.
    Eigen::VectorXd same(after.variables());
    for (Eigen::Index n = 0; n < same.size(); ++n) {
      const auto found = fills_of_merged.find(after.leaves()[static_cast<std::size_t>(n)].code);
      same[n] = found == fills_of_merged.end() ? 0.5 : static_cast<double>(*found->second.begin());
    }
    std::vector<OctreeLeaf> binary;
    const OctreeInterior::Refinement again = after.split_and_merge(same, 0.01, false);
    for (Eigen::Index n = 0; n < same.size(); ++n)
      if (same[n] != 0.5) binary.push_back(after.leaves()[static_cast<std::size_t>(n)]);
    EXPECT_TRUE(std::includes(
        again.leaves.begin(), again.leaves.end(), binary.begin(), binary.end(),
        [](const OctreeLeaf& a, const OctreeLeaf& b) { return std::pair(a.code, a.level) < std::pair(b.code, b.level); }));
    expect_moments_near(after.moments(after.upper_bounds()), ray_moments(p.domain), 1e-13, 50);
  }
}

TEST(OctreeInterior, AllFullMergesToOneCube) {
  const EllipsoidRays p(20, false);
  const OctreeInterior octree(p.domain, uniform_leaves(p.domain, 1));
  const OctreeInterior::Refinement refined = octree.split_and_merge(octree.start(1), 0.01, true);
  EXPECT_EQ(refined.leaves.size(), 1u);
  EXPECT_EQ(refined.splits, 0u);
}

TEST(OctreeInterior, TheRegulariserIsTheLaplaciansAndItsDerivativesAreExact) {
  const EllipsoidRays p(10, true);
  const double gamma = 3e-3;
  const OctreeInterior octree(p.domain, mixed_leaves(p.domain, 2, 9), gamma);
  const OctreeInterior plain(p.domain, octree.leaves());
  ASSERT_EQ(plain.variables(), octree.variables());
  ASSERT_GT(octree.variables(), 30);
  const Goal floating = float_goal(0.7 * p.solid[M1], {0.3, -0.2}, 40);
  const Goal spinning = spin_goal({.lambda = 0.3}, true, false, p.solid[M1], p.length_mm);
  for (const Goal& goal : {floating, spinning}) {
    const InteriorNlp with(goal, octree, p.shell, {p.solid[M1], p.length_mm});
    const InteriorNlp without(goal, plain, p.shell, {p.solid[M1], p.length_mm});
    EXPECT_EQ(with.quadratic(), goal.affine);
    Eigen::VectorXd x = with.start();
    const auto n = octree.variables();
    EXPECT_NEAR(with.objective(x), without.objective(x), 1e-12);  // a constant fill is free
    x.head(n) = random_fill(n, 31);

    // gamma / 2 rho^T L rho with the Laplacian as a dense matrix.
    Eigen::MatrixXd L = Eigen::MatrixXd::Zero(n, n);
    for (const auto& [i, j] : octree.neighbours()) {
      L(i, i) += 1;
      L(j, j) += 1;
      L(i, j) -= 1;
      L(j, i) -= 1;
    }
    const Eigen::VectorXd rho = with.interior_variables(x);
    EXPECT_NEAR(with.objective(x) - without.objective(x), static_cast<double>(n) * gamma / 2 * rho.dot(L * rho), 1e-9);

    const Eigen::VectorXd g = with.gradient(x);
    const double factor = 0.6;
    const Eigen::VectorXd mu = Eigen::VectorXd::LinSpaced(with.constraints(), -0.7, 1.1);
    Eigen::MatrixXd H = Eigen::MatrixXd::Zero(x.size(), x.size());
    const auto add = [&](const InteriorNlp& nlp, double sign) {
      const Nlp::Pattern pattern = nlp.hessian_pattern();
      const Eigen::VectorXd values = nlp.hessian_values(x, factor, mu);
      ASSERT_EQ(static_cast<Eigen::Index>(pattern.size()), values.size());
      for (Eigen::Index e = 0; e < values.size(); ++e) {
        const auto [row, column] = pattern[static_cast<std::size_t>(e)];
        ASSERT_GE(row, column) << "not in the lower triangle";
        H(row, column) += sign * values[e];
        if (row != column) H(column, row) += sign * values[e];
      }
    };
    add(with, 1);
    add(without, -1);
    EXPECT_LT((H.topLeftCorner(n, n) - factor * static_cast<double>(n) * gamma * L).norm(), 1e-9);
    EXPECT_LT(H.norm() - H.topLeftCorner(n, n).norm(), 1e-9);
    for (Eigen::Index v = 0; v < x.size(); ++v) {
      Eigen::VectorXd above = x;
      above[v] += 1e-4;
      Eigen::VectorXd below = x;
      below[v] -= 1e-4;
      ASSERT_NEAR(g[v], (with.objective(above) - with.objective(below)) / 2e-4, 1e-5 * (1 + std::abs(g[v]))) << v;
      const Eigen::VectorXd constraint = (with.constraint_values(above) - with.constraint_values(below)) / 2e-4;
      Eigen::VectorXd column = Eigen::VectorXd::Zero(with.constraints());
      const Nlp::Pattern pattern = with.jacobian_pattern();
      const Eigen::VectorXd values = with.jacobian_values(x);
      for (Eigen::Index e = 0; e < values.size(); ++e)
        if (pattern[static_cast<std::size_t>(e)].second == v) column[pattern[static_cast<std::size_t>(e)].first] += values[e];
      ASSERT_LT((column - constraint).norm(), 1e-6 * (1 + constraint.norm())) << v;
    }
  }
}

/// A float problem and its proven optimum on the rays.
struct Floating {
  EllipsoidRays rays;
  double volume;
  Goal goal;
  double bound;

  explicit Floating(int across)
      : rays(across, false),
        volume(0.7 * rays.solid[M1]),
        goal(float_goal(volume, {0.5, -0.3}, rays.length_mm)),
        bound(solve_quadric(goal, RayIntegrals(rays.domain), rays.shell).lower_bound) {}

  OctreeReport solve(OctreeOptions options = {}) const {
    options.scale = {volume, rays.length_mm};
    return solve_octree(goal, rays.domain, rays.shell, options);
  }
  double on_voxels() const {
    const VoxelInterior voxels(rays.domain, 1);
    const InteriorNlp nlp(goal, voxels, rays.shell, {volume, rays.length_mm});
    return goal.objective(nlp.body(solve_ipopt(nlp).x));
  }
};

TEST(SolveOctree, ReachesTheVoxelsOptimumWithFewerCells) {
  const Floating p(32);
  const OctreeReport report = p.solve();
  ASSERT_EQ(report.solve.status, SolveStatus::converged) << report.solve.solver_status;
  EXPECT_EQ(report.solve.solver, "octree (Ipopt)");
  EXPECT_LT(p.goal.constraint_values(report.body).norm(), 1e-7);
  EXPECT_EQ(report.solve.objective, p.goal.objective(report.body));
  EXPECT_GT(report.solve.objective, p.bound);
  // Octree cells are unions of voxels.
  const double voxels = p.on_voxels();
  EXPECT_GT(report.solve.objective, voxels - 1e-8);
  EXPECT_LT(report.solve.objective, voxels + 1e-6);
  const std::size_t count = uniform_leaves(p.rays.domain, 0).size();
  EXPECT_LT(report.leaves.size(), count / 2);
  EXPECT_LE(report.solve.variables, report.most_leaves);
  EXPECT_GT(report.rounds, 2);
  EXPECT_GT(report.iterations, report.solve.iterations);

  // What is said is what the leaves give.
  const OctreeInterior interior(p.rays.domain, report.leaves);
  ASSERT_EQ(interior.leaves(), report.leaves);
  EXPECT_TRUE(near(interior.moments(report.solve.x) + p.rays.shell, report.body, 1e-9 * report.body.norm()));
  const Eigen::VectorXd rounded = report.solve.x.array().round();
  EXPECT_TRUE(near(interior.moments(rounded) + p.rays.shell, report.rounded_body, 1e-9 * report.body.norm()));
  EXPECT_EQ(report.rounded_residual, p.goal.constraint_values(report.rounded_body).cwiseAbs().maxCoeff());
  EXPECT_EQ(report.rounded_objective, p.goal.objective(report.rounded_body));
  EXPECT_LT(report.rounded_residual, 1e-2);
}

TEST(SolveOctree, ConvergesFromAboveAsResolutionGrows) {
  std::vector<double> spacing;
  std::vector<double> gap;
  for (const int across : {14, 28, 56}) {
    const Floating p(across);
    const OctreeReport report = p.solve();
    ASSERT_EQ(report.solve.status, SolveStatus::converged);
    spacing.push_back(p.rays.domain.grid.spacing_mm);
    gap.push_back(report.solve.objective - p.bound);
    EXPECT_GT(gap.back(), 0);
  }
  for (std::size_t n = 1; n < gap.size(); ++n) {
    const double slope = std::log(gap[n - 1] / gap[n]) / std::log(spacing[n - 1] / spacing[n]);
    RecordProperty("slope" + std::to_string(n), std::to_string(slope));
    EXPECT_NEAR(slope, 2, 0.4);
  }
}

TEST(SolveOctree, SpinReachesTheVoxelsOptimum) {
  const EllipsoidRays p(20, true);
  const Goal goal = spin_goal({}, true, false, p.solid[M1], p.length_mm);
  const InteriorNlp::Scale scale{p.solid[M1], p.length_mm};
  OctreeOptions options;
  options.scale = scale;
  options.solve.barrier_target = 1e-7;
  const OctreeReport report = solve_octree(goal, p.domain, p.shell, options);
  ASSERT_EQ(report.solve.status, SolveStatus::converged) << report.solve.solver_status;
  EXPECT_LT(goal.constraint_values(report.body).norm(), 1e-9);
  const auto optimum = [&](const Interior& interior) {
    const InteriorNlp nlp(goal, interior, p.shell, scale, 1);
    return goal.objective(nlp.body(solve_ipopt(nlp, options.solve).x));
  };
  const double voxels = optimum(VoxelInterior(p.domain, 1));
  const double rays = optimum(SegmentRays(p.domain));
  EXPECT_GT(voxels, rays);
  EXPECT_GT(report.solve.objective, rays);
  EXPECT_GT(report.solve.objective, voxels - 1e-6);
  EXPECT_LT(report.solve.objective, voxels + 1e-5);
}

TEST(SolveOctree, FractionsAloneStopEarly) {
  // A linear goal has no more fractions than constraints at its optimum: without looking at the surface, few leaves are split.
  const Floating p(32);
  OctreeOptions options;
  options.split_at_fill_changes = false;
  const OctreeReport report = p.solve(options);
  ASSERT_EQ(report.solve.status, SolveStatus::converged);
  const OctreeReport whole = p.solve();
  EXPECT_LT(report.leaves.size(), whole.leaves.size() / 4);
  EXPECT_GT(report.solve.objective, whole.solve.objective + 1e-4);
}

TEST(SolveOctree, TheRegulariserSmoothsAndCosts) {
  const Floating p(24);
  const auto roughness = [&](const OctreeReport& report) {
    const OctreeInterior interior(p.rays.domain, report.leaves);
    double sum = 0;
    for (const auto& [i, j] : interior.neighbours()) sum += std::pow(report.solve.x[i] - report.solve.x[j], 2);
    return sum;
  };
  OctreeOptions options;
  options.max_rounds = 1;  // the same cells for all
  options.start_level = 1;
  double rougher = roughness(p.solve(options));
  double lower = p.solve(options).solve.objective;
  for (const double gamma : {1e-5, 1e-4, 1e-3}) {
    options.laplacian_weight = gamma;
    const OctreeReport report = p.solve(options);
    EXPECT_LT(roughness(report), rougher);
    EXPECT_GT(report.solve.objective, lower);
    rougher = roughness(report);
    lower = report.solve.objective;
  }
}

TEST(SolveOctree, AStartThatIsTooCoarseIsRefined) {
  // One cube has one fraction for three constraints.
  const Floating p(20);
  OctreeOptions options;
  options.start_level = 6;
  ASSERT_EQ(uniform_leaves(p.rays.domain, 6).size(), 1u);
  const OctreeReport report = p.solve(options);
  ASSERT_EQ(report.solve.status, SolveStatus::converged) << report.solve.solver_status;
  EXPECT_NEAR(report.solve.objective, p.solve().solve.objective, 1e-6);
}

TEST(SolveOctree, SaysWhyItStops) {
  const Floating p(20);
  OctreeOptions options;
  options.max_rounds = 2;
  const OctreeReport early = p.solve(options);
  EXPECT_EQ(early.solve.status, SolveStatus::iteration_limit);
  EXPECT_EQ(early.solve.solver_status, "Solve_Succeeded");
  EXPECT_EQ(early.rounds, 2);
  EXPECT_GT(early.unsplit, 0u);

  const Goal heavy = float_goal(1.1 * p.rays.solid[M1], {0, 0}, p.rays.length_mm);
  const OctreeReport infeasible = solve_octree(heavy, p.rays.domain, p.rays.shell, {.scale = {p.volume, p.rays.length_mm}});
  EXPECT_EQ(infeasible.solve.status, SolveStatus::infeasible) << infeasible.solve.solver_status;
  EXPECT_EQ(infeasible.rounds, 3);  // with each width down to one spacing

  Progress progress;
  progress.cancelled = [] { return true; };
  try {
    solve_octree(p.goal, p.rays.domain, p.rays.shell, {.scale = {p.volume, p.rays.length_mm}}, progress);
    FAIL() << "was not interrupted";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::interrupted);
  }
}

}  // namespace
}  // namespace rayrep
