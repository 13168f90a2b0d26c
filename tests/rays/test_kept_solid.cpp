#include <gtest/gtest.h>

#include <cmath>

#include "rayrep/mesh/level_set.h"
#include "rays/kept_solid.h"
#include "shapes.h"
#include "solids.h"

namespace rayrep {
namespace {

using namespace test;

/// What is left of a body when some of it is kept solid.
InnerDomain left_of(const Mesh& body, const Mesh& kept) {
  Mesh all = body;
  append(all, kept);
  const SurfaceQuery surface(all);
  return detail::inner_domain({surface, static_cast<int>(body.triangles.size())}, {1.5, 0.25, 0.4, 0});
}

/// Volume within `r` of a box, itself included.
double around_box_mm3(const Eigen::Vector3d& size, double r) {
  const double area = 2 * (size.x() * size.y() + size.y() * size.z() + size.z() * size.x());
  return size.prod() + area * r + kPi * r * r * size.sum() + 4 * kPi / 3 * r * r * r;
}

TEST(KeptSolid, TakesItselfAndTheWallAroundIt) {
  const Mesh body = box({-15, -12, 0}, {15, 12, 20});
  const double whole = 27 * 21 * 17;
  const InnerDomain domain = left_of(body, box({-4, -3, 7}, {3, 2, 12}));
  EXPECT_NEAR(domain.rays.volume_mm3(), whole - around_box_mm3({7, 5, 5}, 1.5), 2e-3 * whole);
  EXPECT_EQ(domain.cast.bad, 0u);
}

TEST(KeptSolid, MayReachOutAndOverlap) {
  // Two rods through the body, one across the other: what is outside stays outside.
  const Mesh body = box({-15, -12, 0}, {15, 12, 20});
  const Mesh rods = merged({box({-40, -1, 9}, {40, 1, 11}), box({-1, -40, 9}, {1, 40, 11})});
  const InnerDomain domain = left_of(body, rods);
  const double section = 4 + 4 * 2 * 1.5 + kPi * 1.5 * 1.5;
  const double whole = 27 * 21 * 17;
  EXPECT_GT(domain.rays.volume_mm3(), whole - section * (27 + 21));
  EXPECT_LT(domain.rays.volume_mm3(), whole - section * (27 + 21) + 5 * 5 * 5);
  const Eigen::AlignedBox3d inside(Eigen::Vector3d(-13.5 - 1e-9, -10.5 - 1e-9, 1.5 - 1e-9),
                                   Eigen::Vector3d(13.5 + 1e-9, 10.5 + 1e-9, 18.5 + 1e-9));
  for (std::size_t ray = 0; ray < domain.rays.grid.size(); ++ray)
    for (std::uint32_t n = domain.rays.first[ray]; n < domain.rays.first[ray + 1]; ++n) {
      const Eigen::Vector2d xy = domain.rays.grid.at(ray);
      const Interval& interval = domain.rays.intervals[n];
      ASSERT_TRUE(inside.contains(Eigen::Vector3d(xy.x(), xy.y(), interval.lo)));
      ASSERT_TRUE(inside.contains(Eigen::Vector3d(xy.x(), xy.y(), interval.hi)));
    }
}

TEST(KeptSolid, MayHaveAClearanceOfItsOwn) {
  // Of two rods one is kept with the wall, the other with less.
  const Mesh body = box({-15, -12, 0}, {15, 12, 20});
  Mesh all = body;
  append(all, box({-4, -3, 7}, {-3, 2, 12}));
  const auto thin_from = static_cast<int>(all.triangles.size());
  append(all, box({4, -3, 7}, {6, 2, 12}));
  for (const double clearance : {1.5, 0.7, 0.3}) {
    const SurfaceQuery surface(all, {thin_from, 1.5 - clearance});
    const InnerDomain domain = detail::inner_domain({surface, static_cast<int>(body.triangles.size())}, {1.5, 0.2, 0.22, 0});
    const double whole = 27 * 21 * 17;
    const double taken = around_box_mm3({1, 5, 5}, 1.5) + around_box_mm3({2, 5, 5}, clearance);
    EXPECT_NEAR(domain.rays.volume_mm3(), whole - taken, 2e-3 * whole) << clearance;
    // What is meshed has no more of it than the rays.
    const SurfaceQuery thin(box({4, -3, 7}, {6, 2, 12}));
    double nearest = HUGE_VAL;
    for (const Eigen::Vector3d& v : mesh_zero_set(domain.field).vertices)
      nearest = std::min(nearest, thin.closest(v, 10).distance_mm);
    EXPECT_NEAR(nearest, clearance, 0.1);
  }
}

TEST(KeptSolid, NothingKeptChangesNothing) {
  const Mesh body = icosphere(10, 3);
  const SurfaceQuery surface(body);
  const InnerDomain with = detail::inner_domain({surface}, {1.5, 0.5, 0.5, 0});
  const InnerDomain without = inner_domain(surface, {1.5, 0.5, 0.5, 0});
  ASSERT_EQ(with.rays.intervals.size(), without.rays.intervals.size());
  EXPECT_EQ(with.rays.volume_mm3(), without.rays.volume_mm3());
  // Far away from the body likewise: the grids cover the body alone.
  const InnerDomain far = left_of(body, box({30, 30, 30}, {31, 31, 31}));
  EXPECT_EQ(far.rays.volume_mm3(), inner_domain(surface, {1.5, 0.25, 0.4, 0}).rays.volume_mm3());
}

}  // namespace
}  // namespace rayrep
