#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "ellipsoid_rays.h"
#include "rayrep/rays/ray_interior.h"
#include "rayrep/rays/voxel_interior.h"
#include "rayrep/solve/goals.h"
#include "rayrep/solve/nlp.h"
#include "rayrep/solve/quadric.h"
#include "rayrep/solve/solve.h"
#include "solids.h"

namespace rayrep {
namespace {

using namespace test;
using MomentColumns = Eigen::Matrix<double, 10, Eigen::Dynamic>;

/// Up to three intervals a ray, at random.
RayRep random_rays(std::uint64_t seed) {
  Random random(seed);
  RayRep rays;
  rays.grid = {.origin_mm = {-3.1, 2.2}, .spacing_mm = 0.8, .nx = 9, .ny = 7};
  rays.first.push_back(0);
  for (std::size_t ray = 0; ray < rays.grid.size(); ++ray) {
    double z = random.uniform(-4, 3);
    const int count = static_cast<int>(4 * random.uniform());
    for (int n = 0; n < count; ++n) {
      const double lo = z + 2 * random.uniform();
      z = lo + 3 * random.uniform();
      rays.intervals.push_back({lo, z});
    }
    rays.first.push_back(static_cast<std::uint32_t>(rays.intervals.size()));
  }
  return rays;
}

/// The part of the rays in a box.
RayRep clipped(RayRep rays, const Eigen::AlignedBox3d& box) {
  for (std::size_t ray = 0; ray < rays.grid.size(); ++ray)
    for (std::uint32_t n = rays.first[ray]; n < rays.first[ray + 1]; ++n) {
      Interval& interval = rays.intervals[n];
      const Eigen::Vector2d xy = rays.grid.at(ray);
      const bool through = (xy.array() >= box.min().head<2>().array()).all() && (xy.array() < box.max().head<2>().array()).all();
      interval.lo = std::max(interval.lo, box.min().z());
      interval.hi = through ? std::max(interval.lo, std::min(interval.hi, box.max().z())) : interval.lo;
    }
  return rays;
}

SolveReport solved(const InteriorNlp& nlp, double barrier_target = 0) {
  SolveOptions options;
  options.barrier_target = barrier_target;
  const SolveReport report = solve_ipopt(nlp, options);
  EXPECT_EQ(report.solver_status, "Solve_Succeeded");
  return report;
}

TEST(SegmentMoments, AreThoseOfAThinBox) {
  // A box of 1 mm^2 around the line has the same moments but for its own width, 1/12 in xx and yy.
  const Moments thin = segment_moments({2, -3}, -1, 4);
  Moments box = box_moments({1.5, -3.5, -1}, {2.5, -2.5, 4});
  box[MXX] -= 5.0 / 12;
  box[MYY] -= 5.0 / 12;
  expect_moments_near(thin, box, 1e-14, 4);
  EXPECT_TRUE(segment_moments({2, -3}, 4, 4).isZero());
}

TEST(VoxelInterior, AllSolidIsTheDomain) {
  for (const int k : {1, 2, 3, 5, 100}) {
    const RayRep rays = random_rays(5);
    const VoxelInterior voxels(rays, k);
    expect_moments_near(voxels.moments(voxels.upper_bounds()), ray_moments(rays), 1e-13, 10);
    EXPECT_TRUE(voxels.moments(voxels.lower_bounds()).isZero());
    if (k == 100) {
      EXPECT_EQ(voxels.variables(), 1);
    }
    const EllipsoidRays ellipsoid(20, false);
    const VoxelInterior inside(ellipsoid.domain, k);
    expect_moments_near(inside.moments(inside.upper_bounds()), ray_moments(ellipsoid.domain), 1e-13, 50);
  }
}

TEST(VoxelInterior, EachVoxelHoldsTheRaysClippedToIt) {
  for (const std::uint64_t seed : {1u, 2u, 3u})
    for (const int k : {1, 2, 3}) {
      const RayRep rays = random_rays(seed);
      const VoxelInterior voxels(rays, k);
      const MomentColumns J = voxels.jacobian(voxels.start(0.5));
      const double side = k * rays.grid.spacing_mm;
      const Eigen::Vector3d corner(rays.grid.origin_mm.x() - 0.5 * rays.grid.spacing_mm,
                                   rays.grid.origin_mm.y() - 0.5 * rays.grid.spacing_mm, lowest_end_mm(rays));
      Eigen::Index next = 0;
      for (int j = 0; j * k < rays.grid.ny; ++j)
        for (int i = 0; i * k < rays.grid.nx; ++i)
          for (int height = 0; height < 30; ++height) {
            const Eigen::Vector3d min = corner + side * Eigen::Vector3d(i, j, height);
            const Moments part = ray_moments(clipped(rays, {min, min + Eigen::Vector3d::Constant(side)}));
            if (part[M1] < 1e-12) continue;
            ASSERT_LT(next, voxels.variables());
            ASSERT_LT((J.col(next) - part).norm(), 1e-11) << "voxel " << i << " " << j << " " << height << " of " << k;
            ++next;
          }
      EXPECT_EQ(next, voxels.variables());
    }
}

TEST(VoxelInterior, DerivativesAreThoseOfTheMoments) {
  const VoxelInterior voxels(random_rays(7), 2);
  ASSERT_GT(voxels.variables(), 50);
  Eigen::VectorXd x(voxels.variables());
  Random random(3);
  for (double& fill : x) fill = random.uniform();
  const MomentColumns J = voxels.jacobian(x);
  for (Eigen::Index n = 0; n < x.size(); ++n) {
    Eigen::VectorXd above = x;
    above[n] += 1e-3;
    Eigen::VectorXd below = x;
    below[n] -= 1e-3;
    const Moments d = (voxels.moments(above) - voxels.moments(below)) / 2e-3;
    EXPECT_LT((J.col(n) - d).norm(), 1e-8 * (1 + d.norm()));
  }
  EXPECT_EQ(J, voxels.jacobian(voxels.start(0)));
  EXPECT_EQ(voxels.hessian_diagonal(x, Moments::Ones(), 3, 5), (Eigen::VectorXd::Zero(5)));
}

TEST(VoxelInterior, AnEmptyDomainHasNoVoxels) {
  RayRep empty;
  empty.grid = {.nx = 2, .ny = 2};
  empty.first.assign(5, 0);
  EXPECT_EQ(VoxelInterior(empty, 1).variables(), 0);
}

/// Slope of log(gap) over log(size) by least squares.
double slope(const std::vector<double>& size, const std::vector<double>& gap) {
  Eigen::MatrixX2d A(static_cast<Eigen::Index>(size.size()), 2);
  Eigen::VectorXd b(A.rows());
  for (std::size_t n = 0; n < size.size(); ++n) {
    const auto row = static_cast<Eigen::Index>(n);
    A.row(row) << std::log(size[n]), 1;
    b[row] = std::log(gap[n]);
  }
  return (A.transpose() * A).inverse().row(0) * (A.transpose() * b);
}

TEST(VoxelInterior, FloatConvergesFromAboveToTheProvenOptimum) {
  // Cubes cut by the plane of the optimum are off by O(k) each, and there are O(k^-2) of them: the objective by O(k^2).
  const EllipsoidRays p(48, false);
  const double volume = 0.7 * p.solid[M1];
  const Goal goal = float_goal(volume, {0.5, -0.3}, p.length_mm);
  const double bound = solve_quadric(goal, RayIntegrals(p.domain), p.shell).lower_bound;
  std::vector<double> sizes;
  std::vector<double> gaps;
  for (const int k : {2, 3, 4, 6, 8}) {
    const VoxelInterior voxels(p.domain, k);
    const InteriorNlp nlp(goal, voxels, p.shell, {volume, p.length_mm});
    const Moments body = nlp.body(solved(nlp).x);
    EXPECT_LT(goal.constraint_values(body).norm(), 1e-7);
    sizes.push_back(k);
    gaps.push_back(goal.objective(body) - bound);
    EXPECT_GT(gaps.back(), 0) << k;
  }
  RecordProperty("slope", std::to_string(slope(sizes, gaps)));
  EXPECT_NEAR(slope(sizes, gaps), 2, 0.3);
}

TEST(VoxelInterior, ItsOptimumConvergesAsTheRaysDo) {
  // Rays and voxels refined together: the gap between the two is O(spacing^2).
  std::vector<double> sizes;
  std::vector<double> gaps;
  for (const int across : {14, 20, 28, 40}) {
    const EllipsoidRays p(across, false);
    const double volume = 0.7 * p.solid[M1];
    const Goal goal = float_goal(volume, {0.5, -0.3}, p.length_mm);
    const VoxelInterior voxels(p.domain, 1);
    const InteriorNlp nlp(goal, voxels, p.shell, {volume, p.length_mm});
    sizes.push_back(p.domain.grid.spacing_mm);
    gaps.push_back(goal.objective(nlp.body(solved(nlp).x)) - solve_quadric(goal, RayIntegrals(p.domain), p.shell).lower_bound);
    EXPECT_GT(gaps.back(), 0) << across;
  }
  RecordProperty("slope", std::to_string(slope(sizes, gaps)));
  EXPECT_NEAR(slope(sizes, gaps), 2, 0.3);
}

TEST(VoxelInterior, SpinConvergesFromAboveToTheRays) {
  const EllipsoidRays p(24, true);
  const Goal goal = spin_goal({}, true, false, p.solid[M1], p.length_mm);
  const InteriorNlp::Scale scale{p.solid[M1], p.length_mm};
  const SegmentRays rays(p.domain);
  const InteriorNlp on_rays(goal, rays, p.shell, scale, 1);
  const double best = goal.objective(on_rays.body(solved(on_rays, 1e-7).x));
  std::vector<double> sizes;
  std::vector<double> gaps;
  for (const int k : {1, 2, 3, 4}) {
    const VoxelInterior voxels(p.domain, k);
    const InteriorNlp nlp(goal, voxels, p.shell, scale, 1);
    const Moments body = nlp.body(solved(nlp, 1e-7).x);
    EXPECT_LT(goal.constraint_values(body).norm(), 1e-9);
    sizes.push_back(k);
    gaps.push_back(goal.objective(body) - best);
    EXPECT_GT(gaps.back(), 0) << k;
  }
  RecordProperty("slope", std::to_string(slope(sizes, gaps)));
  EXPECT_NEAR(slope(sizes, gaps), 2, 0.5);
}

TEST(VoxelInterior, VoxelsInsideVoxelsDoNoWorse) {
  const EllipsoidRays p(24, false);
  const double volume = 0.6 * p.solid[M1];
  const Goal goal = float_goal(volume, {-1, 0.4}, p.length_mm);
  double coarser = 1;
  for (const int k : {8, 4, 2, 1}) {
    const VoxelInterior voxels(p.domain, k);
    const InteriorNlp nlp(goal, voxels, p.shell, {volume, p.length_mm});
    const double objective = goal.objective(nlp.body(solved(nlp).x));
    EXPECT_LT(objective, coarser + 1e-8) << k;
    coarser = objective;
  }
}

}  // namespace
}  // namespace rayrep
