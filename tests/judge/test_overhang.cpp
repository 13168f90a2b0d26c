#include <gtest/gtest.h>

#include <cmath>

#include "judge/overhang.h"
#include "mesh/revolved.h"
#include "rayrep/judge/kept_solid.h"
#include "rayrep/judge/verify.h"
#include "rayrep/mesh/assembly.h"
#include "rayrep/mesh/boolean.h"
#include "rayrep/mesh/section.h"
#include "shapes.h"
#include "solids.h"

namespace rayrep {
namespace {

using namespace test;
using verify_detail::Overhang;
using verify_detail::overhang;
using verify_detail::overhang_in_piece;
using verify_detail::PrintedUp;

/// A cavity of this shape; the bed lies 5 mm below it.
Overhang in_cavity(const Mesh& shape, const Eigen::Vector3d& direction = Eigen::Vector3d::UnitZ(), double angle_deg = 45) {
  PrintedUp print;
  print.direction = direction;
  print.angle_rad = angle_deg * kPi / 180;
  print.bed_mm = HUGE_VAL;
  for (const Eigen::Vector3d& v : shape.vertices) print.bed_mm = std::min(print.bed_mm, direction.normalized().dot(v) - 5.03);
  return overhang(with_merged_vertices(flipped(shape)), print);
}

/// A house of this width and length whose roof rises by so many degrees, walls of 10 mm.
Mesh gable(double width, double length, double roof_deg) {
  const double top = 10 + 0.5 * width * std::tan(roof_deg * kPi / 180);
  Mesh mesh = box({0, 0, 0}, {width, length, 10});
  // The top is folded up along its middle.
  mesh.vertices.insert(mesh.vertices.end(), {{0.5 * width, 0, top}, {0.5 * width, length, top}});
  const auto at = [&mesh](double x, double y, double z) {
    for (std::size_t n = 0; n < mesh.vertices.size(); ++n)
      if ((mesh.vertices[n] - Eigen::Vector3d(x, y, z)).norm() < 1e-9) return static_cast<int>(n);
    return -1;
  };
  std::erase_if(mesh.triangles, [&mesh](const Eigen::Vector3i& t) {
    return mesh.vertices[t[0]].z() == 10 && mesh.vertices[t[1]].z() == 10 && mesh.vertices[t[2]].z() == 10;
  });
  const int a = at(0, 0, 10), b = at(width, 0, 10), c = at(width, length, 10), d = at(0, length, 10);
  const int e = at(0.5 * width, 0, top), f = at(0.5 * width, length, top);
  for (const Eigen::Vector3i& t : {Eigen::Vector3i(a, b, e), {b, c, f}, {b, f, e}, {c, d, f}, {d, a, e}, {d, e, f}})
    mesh.triangles.push_back(t);
  return mesh;
}

TEST(Overhang, OfABoxIsItsCeiling) {
  const Mesh shape = box({1, 2, 3}, {41, 22, 33});
  const Overhang found = in_cavity(shape);
  EXPECT_NEAR(found.roof_mm2, 800, 1e-9);
  EXPECT_NEAR(found.roof_share(), 800.0 / 5200, 1e-12);
  EXPECT_NEAR(found.bridge_mm, 20, 0.25);  // the narrower way across
  EXPECT_NEAR(found.sealed_mm3, 24000, 1e-6);
  EXPECT_EQ(found.islands, 0u);
  EXPECT_NEAR(in_cavity(shape, {-1, 0, 0}).roof_mm2, 600, 1e-9);
  // On an edge its two roofs rise 45 degrees, which is enough; a degree less is not.
  EXPECT_EQ(in_cavity(shape, {0, 1, 1}).roof_mm2, 0);
  EXPECT_NEAR(in_cavity(shape, {0, 1, 1}, 46).roof_mm2, 800 + 1200, 1e-9);
}

TEST(Overhang, ItsWidestBridgeIsFoundAmongManyLayersWithMoreRoof) {
  // Forty narrow rooms, each with more of a ceiling than the one room that is wide, at heights of their own.
  Mesh rooms;
  for (int n = 0; n < 40; ++n) append(rooms, box({20.0 * n, 0, 0}, {20.0 * n + 4, 90, 10.1 + 0.4 * n}));
  append(rooms, box({-30, 0, 0}, {-12, 18, 31}));
  const Overhang found = in_cavity(rooms);
  EXPECT_NEAR(found.bridge_mm, 18, 0.4);
  EXPECT_NEAR(found.roof_mm2, 40 * 360 + 324, 1e-6);
}

TEST(Overhang, WhatIsNarrowerThanAPrinterSeesEndsTheSearch) {
  // Two rooms upon a wider one, with a wall between them that hangs over it.
  const auto with_wall = [](double wide_mm) {
    Mesh rooms = box({0, 0, 0}, {20, 40, 5});
    append(rooms, box({0, 0, 5}, {9.7, 40, 10}));
    append(rooms, box({9.7 + wide_mm, 0, 5}, {20, 40, 10}));
    return in_cavity(rooms);
  };
  for (const double wide_mm : {0.0, 1e-13, 1e-9, 1e-5}) EXPECT_NEAR(with_wall(wide_mm).bridge_mm, 10.3, 0.2) << wide_mm;
  EXPECT_NEAR(with_wall(0.5).bridge_mm, 20, 0.5);
}

TEST(Overhang, ATallBodyIsLookedAtInLayersThatGrowWithIt) {
  const Mesh shape = merged({box({0, 0, 0}, {40, 20, 20}), box({-30, 0, 0}, {-12, 18, 30})});
  const Overhang small = in_cavity(shape);
  EXPECT_EQ(small.layer_mm, 0.2);
  const Overhang tall = in_cavity(scaled(shape, 1e4));
  EXPECT_NEAR(tall.layer_mm, 30e4 / 2000, 0.01);
  EXPECT_NEAR(tall.bridge_mm, 1e4 * small.bridge_mm, 0.03 * tall.bridge_mm);
  EXPECT_NEAR(tall.roof_mm2, 1e8 * small.roof_mm2, 1e-9 * tall.roof_mm2);
}

TEST(Overhang, OfABallIsTheCapAbove) {
  const Overhang found = in_cavity(icosphere(12, 5), {0.3, -0.5, 0.8});
  EXPECT_NEAR(found.roof_share(), 0.5 * (1 - std::sqrt(0.5)), 2e-3);
  EXPECT_NEAR(found.roof_mm2, found.roof_share() * 4 * kPi * 144, 1);
  // The last layer closes a disc that depends on where it lies: at most 0.2 mm below the pole.
  EXPECT_GT(found.bridge_mm, 2 * std::sqrt(2 * 12 * 0.2) * 0.5);
  EXPECT_LT(found.bridge_mm, 2 * std::sqrt(2 * 12 * 0.2) * 1.02);
}

TEST(Overhang, OfAConeIsNothingOrItsBase) {
  const Mesh shape = cone(10, 14, 64);
  EXPECT_EQ(in_cavity(shape).roof_mm2, 0);
  EXPECT_EQ(in_cavity(shape).bridge_mm, 0);
  EXPECT_NEAR(in_cavity(shape, {0, 0, -1}).roof_mm2, kPi * 100, 1);
  EXPECT_NEAR(in_cavity(shape, {0, 0, -1}).bridge_mm, 20, 0.3);
}

TEST(Overhang, OfAGableDependsOnItsAngle) {
  EXPECT_EQ(in_cavity(gable(20, 30, 46)).roof_mm2, 0);
  const Overhang flat = in_cavity(gable(20, 30, 44));
  EXPECT_NEAR(flat.roof_mm2, 600 / std::cos(44 * kPi / 180), 1e-6);
  EXPECT_GE(flat.bridge_mm, 2 * 0.2 / std::tan(44 * kPi / 180) * 0.98);  // a layer farther than below, from both sides
}

TEST(Overhang, WhatHangsInTheAirIsAnIslandUntilItStands) {
  const Mesh room = box({-10, -10, 0}, {10, 10, 20});
  const auto with = [&room](const Mesh& solid) { return flipped(merged({flipped(room), solid})); };
  // Tip down: steep all around, but it begins in mid-air; and the same on a rod that reaches down into the floor.
  const Mesh tip = detail::revolved({{0, 8}, {4, 19}, {4, 19.5}, {0, 19.5}}, 24);
  const Mesh rod = detail::revolved({{0, 0.5}, {1, 0.5}, {1, 9}, {4, 19}, {4, 19.5}, {0, 19.5}}, 24);
  EXPECT_EQ(in_cavity(with(tip)).islands, 1u);
  EXPECT_EQ(in_cavity(room).islands, 0u);
  const Mesh standing = box({-1, -1, -1}, {1, 1, 12});
  EXPECT_EQ(in_cavity(with(standing)).islands, 0u);
  EXPECT_EQ(in_cavity(with(rod)).islands, 1u);  // half a millimetre above the floor
}

TEST(Overhang, APillarStandsOnTheFloorAndCarriesTheRoof) {
  const Mesh room = box({-10, -10, 0}, {10, 10, 20});
  const auto with = [&room](const Mesh& solid) {
    const std::vector<Mesh> both = {room, solid};
    return combined(both, {.operation = BooleanOperation::subtract}).mesh;
  };
  // Square, with a waist; a round one is as thick as its polygon.
  const Mesh square = merged({box({-2, -1.5, -1}, {1, 1.5, 21})});
  EXPECT_NEAR(in_cavity(with(square)).pillar_mm.value(), 3, 0.06);
  const Mesh waist = detail::revolved({{0, -1}, {2, -1}, {2, 6}, {0.7, 8}, {0.7, 9}, {2, 11}, {2, 21}, {0, 21}}, 24);
  EXPECT_NEAR(in_cavity(with(waist)).pillar_mm.value(), 1.4 * std::cos(kPi / 24), 0.03);
  // Twisted, so that sections of consecutive layers have no corner in one another.
  Mesh twisted;
  constexpr int kRings = 111;
  for (int n = 0; n < kRings; ++n)
    for (int k = 0; k < 4; ++k) {
      const double turn = kPi / 2 * k + kPi / 4 * n;
      twisted.vertices.emplace_back(2 * std::cos(turn), 2 * std::sin(turn), -1 + 0.2 * n);
    }
  for (int n = 0; n + 1 < kRings; ++n)
    for (int k = 0; k < 4; ++k) {
      const int a = 4 * n + k, b = 4 * n + (k + 1) % 4;
      twisted.triangles.insert(twisted.triangles.end(), {{a, b, b + 4}, {a, b + 4, a + 4}});
    }
  twisted.triangles.insert(twisted.triangles.end(), {{0, 2, 1}, {0, 3, 2}});
  const int top = 4 * (kRings - 1);
  twisted.triangles.insert(twisted.triangles.end(), {{top, top + 1, top + 2}, {top, top + 2, top + 3}});
  ASSERT_TRUE(is_closed_solid(twisted));
  EXPECT_EQ(in_cavity(with(twisted)).islands, 0u);
  EXPECT_TRUE(in_cavity(with(twisted)).pillar_mm.has_value());
  // What only stands, or only hangs, is none: its tip may be as thin as it likes.
  const Mesh spike = detail::revolved({{0, -1}, {2, -1}, {0, 9}}, 24);
  const Mesh icicle = detail::revolved({{0, 11}, {2, 21}, {0, 21}}, 24);
  EXPECT_FALSE(in_cavity(with(spike)).pillar_mm.has_value());
  EXPECT_FALSE(in_cavity(with(icicle)).pillar_mm.has_value());
  EXPECT_FALSE(in_cavity(room).pillar_mm.has_value());
}

/// What lies above all of these planes of a body with rooms, standing on the first one.
Overhang above(const Mesh& outer, const Mesh& rooms, const std::vector<ClipPlane>& planes) {
  Mesh piece = with_merged_vertices(hollow(outer, rooms));
  for (const ClipPlane& plane : planes) piece = halves(piece, plane).above;
  EXPECT_TRUE(is_closed_solid(piece));
  const PrintedUp print{.direction = planes.front().normal, .bed_mm = planes.front().offset_mm};
  return overhang_in_piece(piece, with_merged_vertices(flipped(rooms)), print);
}

TEST(OverhangInPieces, OfAHollowBallIsTheCapOfADome) {
  const Eigen::Vector3d n = Eigen::Vector3d(1, 2, -2).normalized();
  for (const double side : {1.0, -1.0}) {
    const Overhang half = above(icosphere(15, 5), icosphere(12, 5), {{side * n, 0}});
    EXPECT_NEAR(half.roof_mm2, 2 * kPi * 144 * (1 - std::sqrt(0.5)), 1.5);
    EXPECT_NEAR(half.roof_share(), 1 - std::sqrt(0.5), 2e-3);
    EXPECT_EQ(half.islands, 0u);
    EXPECT_EQ(half.sealed_mm3, 0);
    EXPECT_GT(half.bridge_mm, 2 * std::sqrt(2 * 12 * 0.2) * 0.5);
    EXPECT_LT(half.bridge_mm, 2 * std::sqrt(2 * 12 * 0.2) * 1.02);
  }
}

TEST(OverhangInPieces, ARoofThatIsOpenAtASideIsHeldAtTheOthersAlone) {
  const Mesh outer = box({-30, -25, -20}, {30, 25, 20});
  const Mesh room = box({-20, -20, -10}, {20, 20, 10});
  const ClipPlane bed{Eigen::Vector3d::UnitZ(), 1};
  EXPECT_NEAR(above(outer, room, {bed}).bridge_mm, 40, 0.9);
  const Overhang corner = above(outer, room, {bed, {Eigen::Vector3d::UnitX(), 6}});
  EXPECT_NEAR(corner.bridge_mm, 28, 0.6);  // 14 mm from the wall to the open side; closed there it would bridge 14
  EXPECT_NEAR(corner.roof_mm2, 14 * 40, 1e-9);
  EXPECT_NEAR(corner.surface_mm2, 14 * 40 + (40 + 2 * 14) * 9, 1e-9);
  // Lying on the other cut, one wall is the roof.
  EXPECT_NEAR(above(outer, room, {{Eigen::Vector3d::UnitX(), 6}, bed}).roof_mm2, 40 * 9, 1e-9);
}

TEST(OverhangInPieces, WhatHangsFromTheRoofBeginsInMidAirAndTheOutsideIsNotAskedFor) {
  // A bracket: its arm is flat below and has a tooth that hangs from it, outside.
  const std::vector<Mesh> parts = {box({-15, -15, -15}, {15, 15, 20}), box({14, -5, 12}, {40, 5, 18}),
                                   box({30, -2, 4}, {34, 2, 13})};
  const Mesh outer = combined(parts).mesh;
  const std::vector<Mesh> inside = {box({-10, -10, -10}, {10, 10, 15}), detail::revolved({{0, 6}, {4, 12}, {4, 16}, {0, 16}}, 24)};
  const Mesh room = combined(inside, {.operation = BooleanOperation::subtract}).mesh;
  const Overhang upper = above(outer, room, {{Eigen::Vector3d::UnitZ(), 0}});
  EXPECT_EQ(upper.islands, 1u);
  EXPECT_NEAR(upper.roof_mm2, 400 - loop_moments(section(cylinder(4, 1, 24), 0.5).front()).area_mm2, 1e-6);
  // The other way up it stands on the floor, and so does what a cut went through.
  EXPECT_EQ(above(outer, room, {{-Eigen::Vector3d::UnitZ(), 0}}).islands, 0u);
  EXPECT_EQ(above(outer, room, {{Eigen::Vector3d::UnitZ(), 9}}).islands, 0u);
}

TEST(OverhangInPieces, SaysWhatStaysSealedAndNothingWithoutRooms) {
  const Mesh outer = box({-30, -25, -20}, {30, 25, 20});
  const Mesh rooms = merged({box({-20, -20, -10}, {-4, 20, 10}), box({4, -20, 5}, {20, 20, 15})});
  const Overhang found = above(outer, rooms, {{Eigen::Vector3d::UnitZ(), 0.5}});
  EXPECT_NEAR(found.sealed_mm3, 16 * 40 * 10, 1e-6);
  EXPECT_NEAR(found.roof_mm2, 2 * 16 * 40, 1e-9);
  EXPECT_EQ(overhang_in_piece(outer, {}, {}).surface_mm2, 0);
}

TEST(Overhang, IsToldOfEveryVerdictWithACavityAndJudgesNothing) {
  const Mesh body = hollow(box({0, 0, 0}, {30, 20, 20}), box({2, 2, 10}, {28, 18, 18}));
  const auto figure = [](const Verdict& verdict, const char* name) -> double {
    for (const Figure& f : verdict.figures)
      if (f.name == name) return std::get<double>(f.value);
    return -1;
  };
  StandSpec spec;
  const Verdict upright = verify(body, nullptr, spec);
  EXPECT_TRUE(upright.pass());
  EXPECT_NEAR(figure(upright, "roof_mm2"), 26 * 16, 1e-6);
  EXPECT_NEAR(figure(upright, "sealed_mm3"), 26 * 16 * 8, 1e-6);
  spec.print.direction = Eigen::Vector3d::UnitX();
  EXPECT_NEAR(figure(verify(body, nullptr, spec), "roof_mm2"), 16 * 8, 1e-6);
  EXPECT_EQ(figure(verify(box({0, 0, 0}, {30, 20, 20}), nullptr, spec), "roof_mm2"), -1);
}

TEST(KeptSolid, IsJudgedByTheDistanceOfCavities) {
  const Mesh body = hollow(box({0, 0, 0}, {30, 20, 20}), box({2, 2, 10}, {28, 18, 18}));
  const auto judged = [&body](const Mesh& region, double wall_mm) {
    Verdict verdict;
    judge_kept_solid(body, {.regions = {region}, .wall_mm = wall_mm}, verdict);
    return verdict.criteria.at(0);
  };
  const Mesh below = box({10, 8, 4}, {12, 10, 7});
  EXPECT_NEAR(judged(below, 1.5).value, 2, 1e-9);
  EXPECT_TRUE(judged(below, 3).pass());
  EXPECT_FALSE(judged(below, 3.2).pass());
  EXPECT_NEAR(judged(moved(below, {0, 0, 8}), 1).value, -3, 1e-9);  // in the cavity, 12 to 15 of 10 to 18 mm
  EXPECT_LT(judged(moved(below, {0, 0, 5}), 1).value, 0);           // half in it
  EXPECT_LT(judged(box({-5, -5, -5}, {50, 50, 50}), 1).value, 0);
}

}  // namespace
}  // namespace rayrep
