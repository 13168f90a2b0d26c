// Open vessels: hydrostatics with dry pockets against a flood fill of voxels, and laws.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "places.h"
#include "rayrep/base/error.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/mesh/mesh_check.h"
#include "rayrep/physics/hydrostatics.h"
#include "rayrep/physics/moments.h"
#include "solids.h"

namespace rayrep {
namespace {

using test::kPi;
using Cells = std::vector<Eigen::Vector3i>;
const Eigen::Vector3d kUp = Eigen::Vector3d::UnitZ();

// Cells of a block [0, size) of which those where keep(x, y, z) holds are material.
template <typename Keep>
Cells cells(const Eigen::Vector3i& size, const Keep& keep) {
  Cells result;
  for (int z = 0; z < size.z(); ++z)
    for (int y = 0; y < size.y(); ++y)
      for (int x = 0; x < size.x(); ++x)
        if (keep(x, y, z)) result.emplace_back(x, y, z);
  return result;
}

Cells cockpit() {  // 6 x 4 x 3, walls 1
  return cells({6, 4, 3}, [](int x, int y, int z) { return z == 0 || x == 0 || x == 5 || y == 0 || y == 3; });
}

Cells two_cockpits() {  // with rims of different heights
  return cells({9, 4, 4}, [](int x, int y, int z) {
    return z == 0 || ((x == 0 || x == 4 || x == 8 || y == 0 || y == 3) && (x < 5 || z < 3));
  });
}

Cells cup_in_a_basin() {  // an island with a pocket of its own in the middle of a pocket
  return cells({9, 9, 5}, [](int x, int y, int z) {
    const int r = std::max(std::abs(x - 4), std::abs(y - 4));
    return z == 0 || r == 4 || (z < 4 && r == 1);
  });
}

Cells moat() {  // a ring-shaped trough around a shaft that is open below
  return cells({9, 9, 4}, [](int x, int y, int z) {
    const int r = std::max(std::abs(x - 4), std::abs(y - 4));
    return r == 4 || r == 1 || (z == 0 && r > 0);
  });
}

struct Displaced {
  double volume = 0;
  Eigen::Vector3d first = Eigen::Vector3d::Zero();
  double dry = 0;
};

// Voxels of side 1/fine below the plane, as columns of centres; the fluid fills from outside over faces.
Displaced flood_fill(const Cells& material, const Waterplane& plane, int fine) {
  Eigen::Vector3i lo = material.front();
  Eigen::Vector3i hi = material.front();
  for (const auto& c : material) {
    lo = lo.cwiseMin(c);
    hi = hi.cwiseMax(c);
  }
  lo.array() -= 1;
  const Eigen::Vector3i size = (hi - lo).array() + 2;
  const Eigen::Vector3i n = size * fine;
  const auto index = [&](int x, int y, int z) { return (static_cast<std::size_t>(z) * n.y() + y) * n.x() + x; };
  enum : char { unfilled, solid, sea };
  std::vector<char> state(index(0, 0, n.z()), unfilled);
  for (const auto& c : material)
    for (int i = 0; i < fine * fine * fine; ++i) {
      const Eigen::Vector3i v = (c - lo) * fine + Eigen::Vector3i(i % fine, i / fine % fine, i / fine / fine);
      state[index(v.x(), v.y(), v.z())] = solid;
    }
  const auto centre = [&](int x, int y, int z) {
    return Eigen::Vector3d(lo.cast<double>() + (Eigen::Vector3d(x, y, z).array() + 0.5).matrix() / fine);
  };
  const auto below = [&](int x, int y, int z) { return plane.normal.dot(centre(x, y, z)) < plane.offset_mm; };
  std::vector<Eigen::Vector3i> todo;
  const auto reach = [&](int x, int y, int z) {
    if (x < 0 || y < 0 || z < 0 || x >= n.x() || y >= n.y() || z >= n.z()) return;
    char& s = state[index(x, y, z)];
    if (s != unfilled || !below(x, y, z)) return;
    s = sea;
    todo.emplace_back(x, y, z);
  };
  for (int z = 0; z < n.z(); ++z)
    for (int y = 0; y < n.y(); ++y)
      for (int x = 0; x < n.x(); ++x)
        if (x == 0 || y == 0 || z == 0 || x == n.x() - 1 || y == n.y() - 1 || z == n.z() - 1) reach(x, y, z);
  while (!todo.empty()) {
    const Eigen::Vector3i v = todo.back();
    todo.pop_back();
    for (int k = 0; k < 3; ++k)
      for (const int step : {-1, 1}) {
        const Eigen::Vector3i w = v + step * Eigen::Vector3i::Unit(k);
        reach(w.x(), w.y(), w.z());
      }
  }
  Displaced result;
  const double voxel = 1. / (fine * fine * fine);
  for (int z = 0; z < n.z(); ++z)
    for (int y = 0; y < n.y(); ++y)
      for (int x = 0; x < n.x(); ++x) {
        if (!below(x, y, z) || state[index(x, y, z)] == sea) continue;
        result.volume += voxel;
        result.first += voxel * centre(x, y, z);
        if (state[index(x, y, z)] == unfilled) result.dry += voxel;
      }
  return result;
}

Cells random_cells(test::Random& random, double filled) {
  Cells result = cells({5, 5, 5}, [&](int, int, int) { return random.uniform() < filled; });
  if (result.empty()) result.emplace_back(0, 0, 0);
  return result;
}

// Level planes between layers: voxels of side 1 are exact, with pockets within pockets, rings, touching edges and corners, loose
// parts in pockets and parts under water.
TEST(Pockets, AsAFloodFillOfVoxelsExactly) {
  test::Random random(41);
  int with_pockets = 0;
  for (int i = 0; i < 300; ++i) {
    const Cells material = random_cells(random, random.uniform(0.3, 0.85));
    const Mesh mesh = test::polycubes(material);
    for (int axis = 0; axis < 6; ++axis)
      for (int level = 1; level <= 5; ++level) {
        const double sign = axis < 3 ? 1 : -1;
        const Waterplane plane{sign * Eigen::Vector3d::Unit(axis % 3), sign > 0 ? level : level - 5.};
        const Displaced twin = flood_fill(material, plane, 1);
        const Hydrostatics water = hydrostatics(mesh, plane);
        ASSERT_NEAR(water.displaced_volume_mm3, twin.volume, 1e-10) << "body " << i << " axis " << axis << " level " << level;
        ASSERT_NEAR(water.dry_interior_mm3, twin.dry, 1e-10);
        if (twin.volume > 0) {
          EXPECT_TRUE(test::near(water.centre_of_buoyancy_mm, twin.first / twin.volume, 1e-9));
        }
        with_pockets += twin.dry > 0;
      }
  }
  EXPECT_GT(with_pockets, 500);
}

TEST(Pockets, AsAFloodFillUnderTiltedPlanes) {
  test::Random random(42);
  constexpr int fine = 6;
  int compared = 0;
  std::vector<Cells> bodies{cockpit(), two_cockpits(), cup_in_a_basin(), moat()};
  for (int i = 0; i < 6; ++i) bodies.push_back(random_cells(random, 0.6));
  for (const Cells& material : bodies) {
    const Mesh mesh = test::polycubes(material);
    const Eigen::Vector3d middle = bounding_box(mesh).center();
    for (int i = 0; i < 8; ++i) {
      const Eigen::Vector3d n = (kUp + random.in_box(i < 4 ? 0.2 : 2)).normalized();
      const double offset = n.dot(middle) + random.uniform(-1.5, 1.5);
      // Near a rim the voxels cannot tell.
      const Displaced lower = flood_fill(material, {n, offset - 0.3}, fine);
      const Displaced twin = flood_fill(material, {n, offset}, fine);
      const Displaced higher = flood_fill(material, {n, offset + 0.3}, fine);
      if (lower.dry > twin.dry || twin.dry > higher.dry) continue;
      const Hydrostatics water = hydrostatics(mesh, {n, offset});
      EXPECT_NEAR(water.displaced_volume_mm3, twin.volume, 0.03 * twin.volume + 0.5);
      EXPECT_NEAR(water.dry_interior_mm3, twin.dry, 0.05 * twin.dry + 0.4);
      compared += twin.dry > 1;
    }
  }
  EXPECT_GT(compared, 5);
}

TEST(Pockets, TurnWithTheBody) {
  for (const Cells& material : {cockpit(), two_cockpits(), cup_in_a_basin(), moat()}) {
    const Mesh mesh = test::polycubes(material);
    const Hydrostatics here = hydrostatics(mesh, {kUp, 1.7});
    EXPECT_GT(here.dry_interior_mm3, 1);
    for (int seed = 1; seed <= 10; ++seed) {
      const Eigen::Affine3d T = Eigen::Translation3d(30, -20, 7) * Eigen::Affine3d(test::random_rotation(seed));
      const Eigen::Vector3d n = T.linear() * kUp;
      const Mesh turned = transformed(mesh, T);
      for (const Mesh& one : {turned, test::soup(turned)}) {
        const Hydrostatics there = hydrostatics(one, {n, 1.7 + n.dot(T.translation())});
        EXPECT_NEAR(there.displaced_volume_mm3, here.displaced_volume_mm3, 1e-10);
        EXPECT_NEAR(there.dry_interior_mm3, here.dry_interior_mm3, 1e-10);
        EXPECT_TRUE(test::near(there.centre_of_buoyancy_mm, T * here.centre_of_buoyancy_mm, 1e-10));
        EXPECT_NEAR(there.smallest_second_moment_mm4, here.smallest_second_moment_mm4, 1e-8);
        EXPECT_NEAR(*there.freeboard_mm, *here.freeboard_mm, 1e-10);
      }
    }
  }
}

// What the water cannot enter counts as filled; the water enters above the rim, not at it.
TEST(Pockets, AsClosedByALidUpToTheRim) {
  const Mesh vessel = test::polycubes(cockpit());
  const Mesh closed = test::box({0, 0, 0}, {6, 4, 3});
  for (const double level : {0.5, 1., 1.5, 2.9, 3.}) {
    const Hydrostatics water = hydrostatics(vessel, {kUp, level});
    const Hydrostatics lid = hydrostatics(closed, {kUp, level});
    EXPECT_NEAR(water.displaced_volume_mm3, lid.displaced_volume_mm3, 1e-12);
    EXPECT_NEAR(water.waterplane_area_mm2, 24, 1e-12);
    EXPECT_NEAR(water.smallest_second_moment_mm4, lid.smallest_second_moment_mm4, 1e-10);
    EXPECT_NEAR(water.dry_interior_mm3, 8 * std::max(0., level - 1), 1e-12);
    EXPECT_EQ(water.freeboard_mm.has_value(), level > 1);
    if (water.freeboard_mm) {
      EXPECT_EQ(*water.freeboard_mm, 3 - level);
    }
  }
  const Hydrostatics flooded = hydrostatics(vessel, {kUp, 3.0001});
  EXPECT_NEAR(flooded.displaced_volume_mm3, 24 * 3 - 16, 1e-12);
  EXPECT_EQ(flooded.dry_interior_mm3, 0);
  EXPECT_FALSE(flooded.freeboard_mm);
}

TEST(Pockets, OfAHemisphericalBowl) {
  // Two nested lower half balls of radius 10 and 9 closed by the flat rim between them.
  const Mesh full = test::uv_ellipsoid(10, 10, 10, 64);
  const Mesh inner = test::uv_ellipsoid(9, 9, 9, 64);
  Mesh bowl = test::merged({full, test::flipped(inner)});
  // Above the equator both are flattened onto it: the upper halves become the rim, covered twice within the inner circle.
  for (auto& v : bowl.vertices) v.z() = std::min(v.z(), 0.);
  const Mesh rim = boundary_of_union(bowl);
  const double depth = 4;
  const Hydrostatics water = hydrostatics(rim, {kUp, -10 + depth});
  EXPECT_NEAR(water.displaced_volume_mm3, kPi * depth * depth * (30 - depth) / 3, 2);
  EXPECT_NEAR(water.dry_interior_mm3, kPi * 3 * 3 * (27 - 3) / 3, 2);
  EXPECT_NEAR(*water.freeboard_mm, 6, 1e-9);
}

// A vessel put together from boxes that overlap, its triangles cut by the union: not edge to edge.
TEST(Pockets, OfOverlappingParts) {
  const Mesh parts = boundary_of_union(
      test::merged({test::box({0, 0, 0}, {6, 4, 1}), test::box({0, 0, 0.5}, {1, 4, 3}), test::box({5, 0, 0.3}, {6, 4, 3}),
                    test::box({0.5, 0, 0.2}, {5.5, 1, 3}), test::box({0.2, 3, 0.2}, {5.7, 4, 3})}));
  for (const double level : {0.8, 1.5, 2.5}) {
    for (int seed = 1; seed <= 4; ++seed) {
      const Eigen::Matrix3d R = test::random_rotation(seed);
      const Hydrostatics water = hydrostatics(test::rotated(parts, R), {R * kUp, level});
      EXPECT_NEAR(water.displaced_volume_mm3, 24 * level, 1e-9);
      EXPECT_NEAR(water.dry_interior_mm3, 8 * std::max(0., level - 1), 1e-9);
    }
  }
}

TEST(Pockets, WaterlineIsTheLowestThatCarries) {
  // All at the highest rim, where of the two cockpits the lower one is full: 9 x 4 x 3 - 12 + 20.
  const std::vector<std::pair<Cells, double>> bodies{
      {cockpit(), 72}, {two_cockpits(), 116}, {cup_in_a_basin(), 405}, {moat(), 320}};
  for (const auto& [material, expected] : bodies) {
    const Mesh mesh = test::polycubes(material);
    const double largest = largest_displacement_mm3(mesh, kUp);
    EXPECT_NEAR(largest, expected, 1e-9);
    for (const double fraction : {0.01, 0.2, 0.5, 0.7, 0.9, 0.999}) {
      const double volume = fraction * largest;
      const double offset = waterline_for_volume(mesh, kUp, volume);
      EXPECT_NEAR(hydrostatics(mesh, {kUp, offset}).displaced_volume_mm3, volume, 1e-9);
      for (double lower = 0; lower < offset - 0.01; lower += 0.01)
        EXPECT_LT(hydrostatics(mesh, {kUp, lower}).displaced_volume_mm3, volume);
    }
    EXPECT_THROW(waterline_for_volume(mesh, kUp, 1.001 * largest), Error);
  }
}

TEST(Pockets, FloatAndSinkOnceARimGoesUnder) {
  const Mesh vessel = test::polycubes(cockpit(), 10);  // 56 cm3 of material
  const Eigen::Vector3d centre(30, 20, 8);
  const FloatingRest floats = floating_rest(vessel, 60, centre, Eigen::Vector3d(0.05, 0.1, 1));
  EXPECT_EQ(floats.outcome, FloatingRest::Outcome::rests);
  EXPECT_FALSE(floats.took_water);
  EXPECT_TRUE(test::near(floats.up, kUp, 1e-6));
  EXPECT_NEAR(floats.plane.offset_mm, 25, 1e-6);
  // Let go on its side it is full before it could right itself.
  EXPECT_EQ(floating_rest(vessel, 60, centre, Eigen::Vector3d(0, 1, 0.2)).outcome, FloatingRest::Outcome::sinks);
  // Top-heavy it tips over, takes water and sinks.
  const FloatingRest tips = floating_rest(vessel, 60, Eigen::Vector3d(30, 20, 28), Eigen::Vector3d(0, 0.05, 1));
  EXPECT_EQ(tips.outcome, FloatingRest::Outcome::sinks);
  EXPECT_TRUE(tips.took_water);
  // Lighter than water it rests with its cockpit full: upright it lies deeper than it did dry.
  const FloatingRest full = floating_rest(vessel, 50, Eigen::Vector3d(30, 20, 5), Eigen::Vector3d(0, 1, 0.1));
  EXPECT_EQ(full.outcome, FloatingRest::Outcome::rests);
  EXPECT_TRUE(test::near(full.up, kUp, 1e-4));
  EXPECT_GT(full.plane.offset_mm, 23);
}

TEST(Pockets, FirstFloodingHeel) {
  const Mesh vessel = test::polycubes(cockpit());
  const double volume = 30;
  const auto heel = flooding_heel(vessel, volume, kUp);
  ASSERT_TRUE(heel.has_value());
  const auto dry_at = [&](double angle, const Eigen::Vector3d& towards) {
    const Eigen::Vector3d up = std::cos(angle) * kUp + std::sin(angle) * towards;
    return hydrostatics(vessel, {up, waterline_for_volume(vessel, up, volume)}).dry_interior_mm3 > 0;
  };
  const Eigen::Vector3d towards = (heel->up - heel->up.z() * kUp).normalized();
  EXPECT_NEAR(std::acos(heel->up.z()), heel->angle_rad, 1e-7);
  EXPECT_TRUE(dry_at(heel->angle_rad - 1e-5, towards));
  for (int n = 0; n < 16; ++n)
    EXPECT_TRUE(dry_at(heel->angle_rad - 1e-5, {std::cos(2 * kPi * n / 16), std::sin(2 * kPi * n / 16), 0})) << n;
  EXPECT_FALSE(flooding_heel(test::box({0, 0, 0}, {6, 4, 3}), volume, kUp).has_value());
  EXPECT_THROW(flooding_heel(vessel, 100, kUp), Error);
}

/// A box whose top slants up along x, with a pocket that widens upward.
Mesh slanted_cup() {
  const auto ring = [](double half, double z, double slope) {
    std::vector<Eigen::Vector3d> corners;
    for (const auto& [x, y] : {std::pair(-1., -1.), {1., -1.}, {1., 1.}, {-1., 1.}})
      corners.emplace_back(half * x, half * y, z + slope * half * x);
    return corners;
  };
  Mesh mesh;
  for (const auto& corners : {ring(20, 0, 0), ring(20, 30, 0.3), ring(15, 30, 0.3), ring(5, 5, 0)})
    mesh.vertices.insert(mesh.vertices.end(), corners.begin(), corners.end());
  mesh.triangles = {{0, 2, 1}, {0, 3, 2}, {12, 13, 14}, {12, 14, 15}};
  for (int ring_at = 0; ring_at < 12; ring_at += 4)
    for (int k = 0; k < 4; ++k) {
      const int next = (k + 1) % 4;
      mesh.triangles.emplace_back(ring_at + k, ring_at + next, ring_at + 4 + next);
      mesh.triangles.emplace_back(ring_at + k, ring_at + 4 + next, ring_at + 4 + k);
    }
  return mesh;
}

TEST(Pockets, OfASlantedCupCarryUpToTheLowestRim) {
  const Mesh cup = slanted_cup();
  EXPECT_TRUE(test::is_closed_solid(cup));
  // The pocket floods where the ring between its edge and the outer one is lowest.
  constexpr double rim = 30 - 0.3 * 15;
  // Dry it displaces what its outside does: a box, without a wedge where the top is under water.
  const auto volume = [](double waterline) { return 1600 * waterline - 6 * std::pow(std::max(0., waterline - 24) / 0.3, 2); };
  EXPECT_NEAR(largest_displacement_mm3(cup, kUp), volume(rim), 1e-6);
  for (const double waterline : {10., 20., 25., rim - 0.01})
    EXPECT_NEAR(waterline_for_volume(cup, kUp, volume(waterline)), waterline, 1e-7);
  const auto floods = hydrostatics(cup, {kUp, 20});
  EXPECT_NEAR(floods.displaced_volume_mm3, 32000, 1e-6);
  ASSERT_TRUE(floods.freeboard_mm);
  EXPECT_NEAR(*floods.freeboard_mm, rim - 20, 1e-9);
}

TEST(Pockets, AboveTheWaterHaveNoFreeboard) {
  // A deep pocket with its rim at 6, and a tray that begins above the water, with its rim at 5.
  const Cells body = cells({9, 4, 6}, [](int x, int y, int z) {
    if (x >= 1 && x <= 3 && y >= 1 && y <= 2) return z == 0;
    if (x >= 5 && x <= 7 && y >= 1 && y <= 2) return z < 4;
    return x < 5 || z < 5;
  });
  for (const double shift : {0., -20.}) {
    const Mesh mesh = test::moved(test::polycubes(body), {shift, shift, 0});
    const Hydrostatics water = hydrostatics(mesh, {kUp, 3});
    ASSERT_TRUE(water.freeboard_mm);
    EXPECT_NEAR(*water.freeboard_mm, 3, 1e-9);
  }
}

TEST(Pockets, FloodOverALowPlaceOfTheRimWhereverItIs) {
  // A dish with a notch, turned in steps that are no multiples of those between the directions that are tried.
  Mesh dish = test::polycubes(cells({12, 12, 4}, [](int x, int y, int z) {
    const bool wall = x == 0 || x == 11 || y == 0 || y == 11;
    const bool notch = x == 11 && y >= 5 && y <= 6;
    return z == 0 || (wall && !(notch && z == 3));
  }));
  dish = test::moved(dish, {-6, -6, 0});
  for (const int degrees : {0, 10, 20, 50, 80, 130, 250}) {
    const double turn = degrees * kPi / 180;
    const Mesh turned = test::rotated(dish, Eigen::AngleAxisd(turn, kUp).toRotationMatrix());
    const auto heel = flooding_heel(turned, 250, kUp, 36);
    ASSERT_TRUE(heel);
    const auto straight = flooding_heel(dish, 250, kUp, 36);
    EXPECT_NEAR(heel->angle_rad, straight->angle_rad, 1e-4) << degrees;
  }
}

Mesh shared_case(const std::string& name) {
  const auto path = test::shared_meshes().parent_path() / "cases" / name;
  return std::filesystem::exists(path) ? with_merged_vertices(read_mesh(path).mesh) : Mesh();
}

TEST(Pockets, SharedDinghyAndCup) {
  const Mesh dinghy = shared_case("h_dinghy.stl");
  const Mesh cup = shared_case("h_cup.stl");
  if (dinghy.triangles.empty() || cup.triangles.empty()) GTEST_SKIP() << "no cases";
  const auto metacentric_height = [](const Mesh& mesh, double expected_draft) {
    const Moments s = mesh_moments(mesh);
    const Waterplane plane{kUp, waterline_for_volume(mesh, kUp, 1.24 * s[M1])};
    EXPECT_NEAR(plane.offset_mm - bounding_box(mesh).min().z(), expected_draft, 1e-4);
    const FloatingRest rest = floating_rest(mesh, 1.24e-3 * s[M1], s.segment<3>(MX) / s[M1], Eigen::Vector3d(0.1, 0.1, 1));
    EXPECT_EQ(rest.outcome, FloatingRest::Outcome::rests);
    EXPECT_TRUE(test::near(rest.up, kUp, 1e-5));
    return hydrostatics(mesh, plane).metacentre_mm(plane).z() - s[MZ] / s[M1];
  };
  EXPECT_NEAR(metacentric_height(dinghy, 21.0304), 10.2142, 1e-4);
  EXPECT_NEAR(metacentric_height(cup, 7.1464), 102.858, 1e-3);
  EXPECT_NEAR(hydrostatics(dinghy, {kUp, bounding_box(dinghy).min().z() + 20}).dry_interior_mm3, 62208, 1e-6);
}

TEST(FloatingRest, TellsRestingUpsideDownFromSinking) {
  const Mesh capsizes = shared_case("capsizes.obj");
  const Mesh sphere = shared_case("s_hollow_sphere.stl");
  const Mesh bar = shared_case("ae_bar.stl");
  if (capsizes.triangles.empty() || sphere.triangles.empty() || bar.triangles.empty()) GTEST_SKIP() << "no cases";
  const auto tilt = [](const Mesh& mesh, double density) {
    const Moments s = mesh_moments(mesh);
    const FloatingRest rest =
        floating_rest(outer_hull(mesh), density * 1e-3 * s[M1], s.segment<3>(MX) / s[M1], Eigen::Vector3d(0.1, 0.14, 1));
    EXPECT_EQ(rest.outcome, FloatingRest::Outcome::rests);
    return std::acos(std::clamp(rest.up.z(), -1., 1.));
  };
  EXPECT_NEAR(tilt(capsizes, 1.24), kPi, 1e-4);
  for (const double density : {0.8, 1.0, 1.3}) EXPECT_NEAR(tilt(sphere, density), kPi, 1e-3);
  EXPECT_NEAR(tilt(bar, 0.79), 0, 1e-4);
}

}  // namespace
}  // namespace rayrep
