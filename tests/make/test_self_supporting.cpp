#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "judge/overhang.h"
#include "judge/verify_detail.h"
#include "make/carriers.h"
#include "rayrep/judge/verify.h"
#include "rayrep/make/hollow.h"
#include "rayrep/physics/inertial.h"
#include "shapes.h"
#include "solids.h"

namespace rayrep {
namespace {

using namespace test;
using verify_detail::Overhang;

constexpr double kDegree = kPi / 180;

Overhang overhang_of(const Mesh& delivered, const Eigen::Vector3d& direction, double angle_deg) {
  verify_detail::PrintedUp print;
  print.direction = direction;
  print.angle_rad = angle_deg * kDegree;
  return verify_detail::overhang(verify_detail::cavities_of(delivered), print);
}

HollowOptions quick() {
  HollowOptions options;
  options.resolution = 60;
  return options;
}

double figure(const HollowResult& result, const char* name) {
  for (const Figure& f : result.proof_figures)
    if (f.name == "self_supporting")
      for (const auto& [key, value] : std::get<Record>(f.value))
        if (key == name) return std::holds_alternative<bool>(value) ? std::get<bool>(value) : std::get<double>(value);
  return -1;
}

bool says_what_hangs(const Verdict& verdict) {
  return std::any_of(verdict.notes.begin(), verdict.notes.end(), [](const std::string& note) {
    return mentions(note, {"Not all roofs", "--print-direction"});
  });
}

/// As verify tells it: of what was made for one angle and is judged for another.
double flatter_share(const HollowResult& made, const Mesh& solid, double deg, bool noted) {
  Spec spec = made.spec;
  print_of(spec).self_supporting_deg = deg;
  const Verdict verdict = verify(made.delivery.body(), &solid, spec);
  EXPECT_EQ(noted, says_what_hangs(verdict)) << deg;
  for (const Figure& f : verdict.figures)
    if (f.name == "flatter_share") return std::get<double>(f.value);
  return -1;
}

TEST(Carriers, CarryEveryRoofThatIsTooFlat) {
  // What is planned on rays is looked at on other rays: nothing is left to carry.
  const Mesh body = merged({box({-20, -15, 0}, {20, 15, 25})});
  detail::Carrying how{.angle_rad = 45 * kDegree, .wall_mm = 1.2, .spacing_mm = 0.5, .within = {}};
  const SurfaceQuery alone(body);
  const detail::Carriers found = detail::carriers({alone}, how, {});
  EXPECT_NEAR(found.roof_mm2, 37.6 * 27.6, 0.03 * 37.6 * 27.6);
  Mesh all = body;
  for (const Mesh& bone : found.bones) {
    EXPECT_TRUE(is_closed_solid(bone));
    append(all, bone);
  }
  const auto first = static_cast<int>(body.triangles.size());
  const SurfaceQuery surface(all, {first, how.wall_mm - how.clearance_mm()});
  const detail::KeptSolid carried{surface, first};
  how.spacing_mm = 0.37;
  EXPECT_LT(detail::carriers(carried, how, {}).roof_mm2, 2e-3 * found.roof_mm2);
  // A roof that rises to a ridge from all walls would take 38 %, pillars of 2.5 mm take 24 %.
  const double before = inner_domain(alone, {1.2, 0.5, 0.5, 0}).rays.volume_mm3();
  EXPECT_GT(detail::inner_domain(carried, {1.2, 0.5, 0.5, 0}).rays.volume_mm3(), 0.83 * before);
}

TEST(Carriers, WidePillarsStandWhereNoneFitsBetween) {
  // Nothing but a pillar as wide as the room itself.
  const SurfaceQuery surface(box({-20, -15, 0}, {20, 15, 25}));
  const detail::Carrying how{.angle_rad = 45 * kDegree, .wall_mm = 1.2, .pillar_mm = 60, .spacing_mm = 0.5, .within = {}};
  const detail::Carriers found = detail::carriers({surface}, how, {});
  ASSERT_FALSE(found.bones.empty());
  double top_mm = 0;
  for (const Mesh& bone : found.bones) top_mm = std::max(top_mm, bounding_box(bone).max().z());
  EXPECT_GE(top_mm, 25 - 1.2);
}

TEST(Carriers, LeaveASteepRoofAlone) {
  const SurfaceQuery surface(cone(15, 22, 64));
  EXPECT_TRUE(
      detail::carriers({surface}, {.angle_rad = 45 * kDegree, .wall_mm = 1.2, .spacing_mm = 0.5, .within = {}}, {}).bones.empty());
}

TEST(SelfSupporting, AFloatMeetsItsGoalWithRoofsThatRise) {
  FloatSpec spec;
  spec.print.self_supporting_deg = 45;
  const Mesh solid = uv_ellipsoid(30, 22, 18, 64);
  const HollowResult result = hollow(solid, spec, quick());
  EXPECT_LE(result.as_built_error, 1e-6);
  const Verdict verdict = verify(result.delivery.body(), &solid, result.spec);
  EXPECT_TRUE(verdict.pass());
  const Overhang found = overhang_of(result.delivery.body(), spec.up, 43);
  EXPECT_LT(found.roof_share(), 0.01);
  EXPECT_EQ(found.islands, 0u);
  EXPECT_FALSE(says_what_hangs(verdict));
  spec.print.self_supporting_deg = 0;
  const HollowResult flat = hollow(solid, spec, quick());
  EXPECT_GT(overhang_of(flat.delivery.body(), spec.up, 43).roof_share(), 0.1);
  EXPECT_FALSE(says_what_hangs(verify(flat.delivery.body(), &solid, flat.spec)));
  // A judge does not take the maker's word for it.
  EXPECT_TRUE(says_what_hangs(verify(flat.delivery.body(), &solid, result.spec)));
  // Nor the width of holes that there are none of for that of a bridge.
  Spec narrow = result.spec;
  print_of(narrow).drains.diameter_mm = 0.5;
  EXPECT_FALSE(says_what_hangs(verify(result.delivery.body(), &solid, narrow)));
  EXPECT_GT(figure(result, "carriers"), 5);
  EXPECT_GT(figure(result, "inner_domain_kept"), 0.7);
  EXPECT_LT(figure(result, "inner_domain_kept"), 0.95);
  EXPECT_GT(figure(result, "price"), 0);
}

TEST(SelfSupporting, IsJudgedAtTheAngleAskedFor) {
  FloatSpec spec;
  const Mesh solid = uv_ellipsoid(20, 16, 14, 48);
  for (const double deg : {32.0, 60.0}) {
    spec.print.self_supporting_deg = deg;
    const HollowResult made = hollow(solid, spec, quick());
    EXPECT_EQ(figure(made, "carried"), 1) << deg;
    EXPECT_NEAR(flatter_share(made, solid, deg, false), overhang_of(made.delivery.body(), spec.up, deg - 2).roof_share(), 1e-9);
    EXPECT_LT(flatter_share(made, solid, deg, false), 0.01);
    EXPECT_GT(flatter_share(made, solid, deg + 15, true), 0.02);
  }
}

TEST(SelfSupporting, PillarsAreAsThickAsAskedForAndThinOnesCostLess) {
  StandSpec spec;
  spec.print.self_supporting_deg = 45;
  const Mesh solid = box({0, 0, 0}, {30, 24, 20});
  double before = 0;
  for (const double mm : {2.4, 0.9}) {
    spec.print.min_feature_mm = mm;
    const HollowResult result = hollow(solid, spec, quick());
    EXPECT_TRUE(verify(result.delivery.body(), &solid, result.spec).pass()) << mm;
    EXPECT_LE(result.as_built_error, 1e-6);
    const Overhang found = overhang_of(result.delivery.body(), spec.up, 43);
    EXPECT_LT(found.roof_share(), 0.012) << mm;
    EXPECT_EQ(found.islands, 0u) << mm;
    ASSERT_TRUE(found.pillar_mm.has_value()) << mm;
    EXPECT_GE(*found.pillar_mm, mm);
    EXPECT_LT(*found.pillar_mm, mm + 0.08);
    EXPECT_GT(figure(result, "inner_domain_kept"), before + 0.02) << mm;
    before = figure(result, "inner_domain_kept");
  }
  spec.print.min_feature_mm = 0.201;  // of 300 mm nobody can tell
  Mesh large = solid;
  for (Eigen::Vector3d& v : large.vertices) v *= 10;
  EXPECT_TRUE(mentions(message_of([&] { hollow(large, spec, quick()); }, ErrorCode::usage), {"--min-feature", "1.28"}));
  spec.print.self_supporting_deg = 0;
  EXPECT_TRUE(mentions(message_of([&] { hollow(solid, spec, quick()); }, ErrorCode::usage), {"--self-supporting"}));
}

TEST(SelfSupporting, TheDirectionOfThePrintIsThatOfTheRoofs) {
  StandSpec spec;
  spec.print.self_supporting_deg = 45;
  spec.print.direction = Eigen::Vector3d(1, 0, 1);
  const Mesh solid = box({0, 0, 0}, {20, 16, 26});
  const HollowResult result = hollow(solid, spec, quick());
  EXPECT_TRUE(verify(result.delivery.body(), &solid, result.spec).pass());
  // The box stands on an edge: its own roofs rise 45 degrees, and nothing is to be carried.
  EXPECT_EQ(figure(result, "carriers"), 0);
  spec.print.direction = -Eigen::Vector3d::UnitZ();  // upside down the floor of the cavity is its roof
  const HollowResult turned = hollow(solid, spec, quick());
  EXPECT_TRUE(verify(turned.delivery.body(), &solid, turned.spec).pass());
  EXPECT_GT(figure(turned, "carriers"), 0);
  const Overhang found = overhang_of(turned.delivery.body(), *spec.print.direction, 43);
  EXPECT_LT(found.roof_share(), 0.01);
  EXPECT_EQ(found.islands, 0u);
  EXPECT_LE(turned.as_built_error, 1e-6);
}

TEST(SelfSupporting, ASpinIsPrintedAsItCostsLeast) {
  SpinSpec spec;
  spec.print.self_supporting_deg = 45;
  const Mesh solid = uv_ellipsoid(20, 16, 13, 48);
  const HollowResult result = hollow(solid, spec, quick());
  const Print& print = print_of(result.spec);
  const Verdict verdict = verify(result.delivery.body(), &solid, result.spec);
  EXPECT_TRUE(verdict.pass());
  EXPECT_LE(result.as_built_error, 1e-6);
  const Overhang found = overhang_of(result.delivery.body(), print.direction.value_or(spec.up), 43);
  EXPECT_LT(found.roof_share(), 0.01);
  EXPECT_EQ(found.islands, 0u);
}

TEST(SelfSupporting, RefusesWhatItDoesNotKnow) {
  FloatSpec spec;
  spec.print.self_supporting_deg = 45;
  spec.print.infill.percent = 15;
  const Mesh solid = icosphere(20, 3);
  EXPECT_TRUE(mentions(message_of([&] { hollow(solid, spec, quick()); }, ErrorCode::usage), {"--self-supporting"}));
  spec.print.infill.percent = 0;
  HollowOptions other = quick();
  other.solver = Solver::voxels;
  EXPECT_TRUE(mentions(message_of([&] { hollow(solid, spec, other); }, ErrorCode::usage), {"--solver quadric"}));
}

TEST(SelfSupporting, IsRefusedWithAllTenNumbersBeforeAnythingIsMade) {
  TargetSpec spec;
  spec.print.self_supporting_deg = 45;
  const Mesh solid = box({-20, -15, -10}, {20, 15, 10});
  const MassProperties body = mass_properties(mesh_moments(solid), 1);
  for (int k = M1; k <= MXZ; ++k) spec.wanted[static_cast<std::size_t>(k)] = inertial_number(body, static_cast<MomentIndex>(k));
  EXPECT_TRUE(mentions(message_of([&] { hollow(solid, spec, quick()); }, ErrorCode::usage),
                       {"all ten numbers", "--mass", "--inertia", "--self-supporting"}));
}

TEST(KeptSolid, IsCountedProvenAndLeftAlone) {
  StandSpec spec;
  spec.target_mm = Eigen::Vector3d(0, 0, 0);
  const Mesh solid = box({-15, -15, 0}, {15, 15, 30});
  HollowOptions options = quick();
  const HollowResult free = hollow(solid, spec, options);
  options.keep_solid = {box({-6, -6, 22}, {6, 6, 40})};  // reaches out of the top
  const HollowResult kept = hollow(solid, spec, options);
  EXPECT_TRUE(verify(kept.delivery.body(), &solid, kept.spec).pass());
  EXPECT_LE(kept.as_built_error, 1e-6);
  EXPECT_LT(std::abs(*kept.duality_gap), 1e-6);
  EXPECT_GT(kept.solve.objective, free.solve.objective);
  const SurfaceQuery region(options.keep_solid[0]);
  for (const Eigen::Vector3d& v : verify_detail::cavities_of(kept.delivery.body()).vertices)
    ASSERT_GT(region.closest(v, 100).distance_mm, 0.98 * spec.print.wall_mm);
  // Free in the cavity it would be left out: that is said. On a strut it stays.
  options.keep_solid = {box({-2, -2, 18}, {2, 2, 21})};
  EXPECT_TRUE(mentions(message_of([&] { hollow(solid, spec, options); }, ErrorCode::usage), {"Region 1", "free in a cavity"}));
  options.keep_solid = {box({-2, -2, 18}, {2, 2, 40})};
  EXPECT_TRUE(verify(hollow(solid, spec, options).delivery.body(), &solid, spec).pass());
  options.keep_solid = {box({-50, -50, -50}, {50, 50, 50})};
  EXPECT_TRUE(mentions(message_of([&] { hollow(solid, spec, options); }, ErrorCode::usage), {"--keep-solid", "takes all", "-50"}));
  options.keep_solid = {flipped(box({-2, -2, 18}, {2, 2, 40}))};
  EXPECT_TRUE(mentions(message_of([&] { hollow(solid, spec, options); }, ErrorCode::usage), {"--keep-solid"}));
}

}  // namespace
}  // namespace rayrep
