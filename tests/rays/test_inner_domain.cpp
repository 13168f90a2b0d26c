#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>

#include "rayrep/mesh/level_set.h"
#include "rayrep/rays/inner_domain.h"
#include "rayrep/rays/ray_interior.h"
#include "solids.h"

namespace rayrep {
namespace {

using namespace test;

InnerDomainOptions options(double wall, double ray_spacing, double field_spacing) {
  InnerDomainOptions o;
  o.wall_mm = wall;
  o.ray_spacing_mm = ray_spacing;
  o.field_spacing_mm = field_spacing;
  return o;
}

TEST(InnerDomain, OfABoxIsTheSmallerBox) {
  const Eigen::Vector3d lo(-10, -8, 0);
  const Eigen::Vector3d hi(10, 8, 13);
  const SurfaceQuery surface(box(lo, hi));
  const InnerDomain domain = inner_domain(surface, options(1.2, 0.4, 0.4));
  ASSERT_FALSE(domain.rays.intervals.empty());
  for (std::size_t ray = 0; ray < domain.rays.grid.size(); ++ray) {
    const Eigen::Vector2d xy = domain.rays.grid.at(ray);
    const double side = std::min({xy.x() - lo.x(), hi.x() - xy.x(), xy.y() - lo.y(), hi.y() - xy.y()});
    if (std::abs(side - 1.2) < 1e-6) continue;
    ASSERT_EQ(domain.rays.first[ray + 1] - domain.rays.first[ray], side > 1.2 ? 1u : 0u) << xy.transpose();
    if (side < 1.2) continue;
    EXPECT_NEAR(domain.rays.intervals[domain.rays.first[ray]].lo, 1.2, 1e-9);
    EXPECT_NEAR(domain.rays.intervals[domain.rays.first[ray]].hi, 13 - 1.2, 1e-9);
  }
}

TEST(InnerDomain, EndsLieOnTheOffsetSurface) {
  // Every end is at the wall's distance from the surface, far more exactly than the spacing.
  for (const Mesh& mesh : {icosphere(10, 4), torus(9, 5, 60, 40), rotated(l_shape(8), random_rotation(5))}) {
    const SurfaceQuery surface(mesh);
    const InnerDomain domain = inner_domain(surface, options(1.5, 0.5, 0.5));
    ASSERT_GT(domain.rays.intervals.size(), 50u);
    double sum = 0;
    double worst = 0;
    for (std::size_t ray = 0; ray < domain.rays.grid.size(); ++ray)
      for (std::uint32_t n = domain.rays.first[ray]; n < domain.rays.first[ray + 1]; ++n)
        for (const double z : {domain.rays.intervals[n].lo, domain.rays.intervals[n].hi}) {
          const Eigen::Vector2d xy = domain.rays.grid.at(ray);
          const double error = std::abs(surface.closest({xy.x(), xy.y(), z}, 10).distance_mm - 1.5);
          sum += error;
          worst = std::max(worst, error);
        }
    EXPECT_LT(sum / (2.0 * static_cast<double>(domain.rays.intervals.size())), 5e-4 * 0.5);
    EXPECT_LT(worst, 0.1);
  }
}

TEST(InnerDomain, MiddlesAreInside) {
  const Mesh mesh = rotated(l_shape(8), random_rotation(9));
  const SurfaceQuery surface(mesh);
  const InnerDomain domain = inner_domain(surface, options(1.5, 0.5, 0.5));
  for (std::size_t ray = 0; ray < domain.rays.grid.size(); ++ray)
    for (std::uint32_t n = domain.rays.first[ray]; n < domain.rays.first[ray + 1]; ++n) {
      const Interval& i = domain.rays.intervals[n];
      const Eigen::Vector2d xy = domain.rays.grid.at(ray);
      EXPECT_GT(surface.closest({xy.x(), xy.y(), 0.5 * (i.lo + i.hi)}, 20).distance_mm, 1.5 - 1e-3);
    }
}

TEST(InnerDomain, VolumeConvergesToTheSmallerSphere) {
  const SurfaceQuery surface(icosphere(10, 6));
  const double exact = 4.0 / 3 * kPi * std::pow(8.5, 3);
  const auto error = [&](double h) { return std::abs(inner_domain(surface, options(1.5, h, 0.4)).rays.volume_mm3() / exact - 1); };
  EXPECT_LT(error(0.2) + error(0.18) + error(0.16), 3e-3);
  EXPECT_LT(error(0.2) + error(0.18) + error(0.16), 0.5 * (error(1.0) + error(0.9) + error(0.8)) + 1e-3);
}

TEST(InnerDomain, FieldSamplesAreExactWhereTheSignChanges) {
  const Mesh mesh = rotated(torus(9, 5, 60, 40), random_rotation(2));
  const SurfaceQuery surface(mesh);
  const InnerDomain domain = inner_domain(surface, options(1.5, 0.5, 0.5));
  const BlockField& f = domain.field;
  std::size_t crossings = 0;
  for (int i = 0; i + 1 < f.blocks.x() * 8; ++i)
    for (int j = 0; j + 1 < f.blocks.y() * 8; ++j)
      for (int k = 0; k + 1 < f.blocks.z() * 8; ++k)
        for (const Eigen::Vector3i& step : {Eigen::Vector3i(1, 0, 0), Eigen::Vector3i(0, 1, 0), Eigen::Vector3i(0, 0, 1)}) {
          const float a = f.at(i, j, k);
          const float b = f.at(i + step.x(), j + step.y(), k + step.z());
          if ((a < 0) == (b < 0)) continue;
          ++crossings;
          if (a < 0) {
            ASSERT_NEAR(a, 1.5 - surface.closest(f.position(i, j, k), 20).distance_mm, 1e-5);
          }
          if (b < 0) {
            ASSERT_NEAR(b, 1.5 - surface.closest(f.position(i + step.x(), j + step.y(), k + step.z()), 20).distance_mm, 1e-5);
          }
        }
  EXPECT_GT(crossings, 1000u);
}

TEST(InnerDomain, NeedsRoom) {
  const SurfaceQuery surface(box({0, 0, 0}, {20, 20, 2}));
  EXPECT_TRUE(inner_domain(surface, options(1.2, 0.5, 0.5)).rays.intervals.empty());
  const ClosestPoint deepest = deepest_point(surface);
  EXPECT_NEAR(deepest.distance_mm, 1.0, 1e-4);
  EXPECT_NEAR(deepest.point_mm.z(), 1.0, 1e-3);
}

TEST(InnerDomain, DeepestPointOfASphereIsItsCentre) {
  const ClosestPoint deepest = deepest_point(SurfaceQuery(icosphere(10, 5, {3, -2, 7})));
  EXPECT_NEAR(deepest.distance_mm, 10, 2e-2);
  EXPECT_LT((deepest.point_mm - Eigen::Vector3d(3, -2, 7)).norm(), 0.2);
}

TEST(InnerDomain, SmallPiecesStaySolid) {
  // A large and a small ball: with the wall, 4/3 pi 7^3 and 4/3 pi 0.8^3 = 2.1 mm^3 remain.
  const SurfaceQuery surface(merged({icosphere(8, 4), icosphere(1.8, 4, {20, 0, 0})}));
  InnerDomainOptions o = options(1, 0.3, 0.3);
  const InnerDomain all = inner_domain(surface, o);
  o.min_component_mm3 = 4;
  const InnerDomain kept = inner_domain(surface, o);
  EXPECT_EQ(all.dropped_components, 0u);
  EXPECT_EQ(kept.dropped_components, 1u);
  EXPECT_NEAR(kept.dropped_mm3, 4.0 / 3 * kPi * std::pow(0.8, 3), 0.4);
  EXPECT_NEAR(all.rays.volume_mm3() - kept.rays.volume_mm3(), kept.dropped_mm3, 1e-9);
}

TEST(InnerDomain, OverlapsStaySolid) {
  // Where two boxes overlap a cavity shell would leave winding number one: no ray may be inside there.
  const SurfaceQuery surface(merged({box({0, 0, 0}, {20, 20, 20}), box({10, 0, 0}, {30, 20, 20})}));
  const InnerDomain domain = inner_domain(surface, options(1, 0.5, 0.5));
  ASSERT_FALSE(domain.rays.intervals.empty());
  for (std::size_t ray = 0; ray < domain.rays.grid.size(); ++ray) {
    const double x = domain.rays.grid.at(ray).x();
    if (x > 9 && x < 21) {
      EXPECT_EQ(domain.rays.first[ray], domain.rays.first[ray + 1]) << x;
    }
  }
}

TEST(InnerDomain, IsTheSameForAnyNumberOfThreads) {
  const SurfaceQuery surface(rotated(torus(9, 5, 60, 40), random_rotation(2)));
  const auto run = [&](std::size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return inner_domain(surface, options(1.5, 0.4, 0.4));
  };
  const InnerDomain one = run(1);
  const InnerDomain two = run(2);
  EXPECT_EQ(one.field.state, two.field.state);
  EXPECT_EQ(one.field.samples, two.field.samples);
  EXPECT_EQ(one.rays.first, two.rays.first);
  ASSERT_EQ(one.rays.intervals.size(), two.rays.intervals.size());
  for (std::size_t n = 0; n < one.rays.intervals.size(); ++n) {
    EXPECT_EQ(one.rays.intervals[n].lo, two.rays.intervals[n].lo);
    EXPECT_EQ(one.rays.intervals[n].hi, two.rays.intervals[n].hi);
  }
}

TEST(LevelSet, MeshesASphereOutwardAndConverges) {
  const double exact = 4.0 / 3 * kPi * 1000;
  const auto f = [](const Eigen::Vector3d& p) { return p.norm() - 10; };
  double previous = 0;
  for (const double h : {1.0, 0.5, 0.25}) {
    const Mesh mesh = mesh_implicit(f, {Eigen::Vector3d::Constant(-12), Eigen::Vector3d::Constant(12)}, h);
    EXPECT_TRUE(is_closed_solid(mesh));
    const double error = std::abs(mesh_moments(mesh)[M1] / exact - 1);
    EXPECT_LT(error, 0.012 * h * h) << h;
    if (previous > 0) {
      EXPECT_LT(error, previous / 2.5);
    }
    previous = error;
  }
}

}  // namespace
}  // namespace rayrep
