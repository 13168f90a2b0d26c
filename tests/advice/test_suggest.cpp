// What a refusal is answered with: every suggestion, set as its text says, is made and judged here once more.

#include <gtest/gtest.h>

#include <algorithm>

#include "rayrep/advice/suggest.h"
#include "rayrep/base/error.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/judge/verify.h"
#include "rayrep/shape/deform.h"
#include "runs.h"
#include "solids.h"

namespace rayrep {
namespace {

using Eigen::Vector3d;

HollowOptions coarse() {
  HollowOptions options;
  options.resolution = 40;
  options.as_stored = [](const Mesh& mesh) { return as_stored("x.stl", mesh); };
  return options;
}

bool refused(const Mesh& mesh, const Spec& spec) {
  try {
    // It may also be delivered and fail.
    const HollowResult result = hollow(mesh, spec, coarse());
    Delivery delivered = result.delivery;
    for (Part& part : delivered.parts) part.mesh = as_stored("x.stl", part.mesh);
    return !verify(delivered, &mesh, result.spec).pass();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::goal) << error.what();
    return true;
  }
}

/// The options of a suggestion put into a spec and a mesh as people put them in: by name and text.
void take(const Suggestion& suggestion, Spec& spec, Mesh& mesh) {
  for (const auto& [name, text] : suggestion.options) {
    if (name == "size") {
      mesh = test::scaled(mesh, std::stod(text) / bounding_box(mesh).sizes().maxCoeff());
      continue;
    }
    // All of a kind at once.
    if (PoseSpec* poses = std::get_if<PoseSpec>(&spec); poses && name == "stand")
      std::erase_if(poses->poses, [](const Pose& pose) { return pose.kind == Pose::Kind::stands; });
    const auto set = [&, name = name, text = text](auto& s) {
      Settings rows = settings(s, Setting::For::making);
      for (Setting& row : settings(s.print, Setting::For::making)) rows.push_back(row);
      for (Setting& row : settings(s.print.core, Setting::For::making)) rows.push_back(row);
      for (Setting& row : settings(s.print.balls, Setting::For::making)) rows.push_back(row);
      const auto row = std::find_if(rows.begin(), rows.end(), [&](const Setting& r) { return r.name == name; });
      ASSERT_NE(row, rows.end()) << name;
      parse(*row, text);
    };
    std::visit(set, spec);
  }
}

/// Whatever drains it as it is printed lies below the water.
FloatSpec drained_below_the_water() {
  FloatSpec asked;
  asked.print.drains.where = Drains::Where::found;
  asked.print.wall_mm = 2;
  asked.submerged_fraction = 0.6;
  return asked;
}

TEST(Suggest, PlugsWhereHolesCannotBe) {
  const FloatSpec asked = drained_below_the_water();
  const Mesh mesh = test::uv_ellipsoid(30, 24, 20, 32);
  EXPECT_TRUE(refused(mesh, asked));
  const Advice advice = suggest(mesh, asked, coarse(), {.first_only = true});
  ASSERT_EQ(advice.suggestions.size(), 1u) << advice.tried;
  EXPECT_EQ(advice.suggestions[0].kinds, std::vector{ChangeKind::plug});
  const std::vector<std::pair<std::string, std::string>> plug = {{"plug", ""}};
  EXPECT_EQ(advice.suggestions[0].options, plug);
  Spec spec = asked;
  Mesh changed = mesh;
  take(advice.suggestions[0], spec, changed);
  EXPECT_FALSE(refused(changed, spec));
}

TEST(Suggest, HoldsItOtherwiseWhereHolesCannotBe) {
  const FloatSpec asked = drained_below_the_water();
  const Mesh mesh = test::uv_ellipsoid(30, 24, 20, 32);
  const Advice advice = suggest(mesh, asked, coarse(), {.kinds = {ChangeKind::direction}});
  ASSERT_EQ(advice.suggestions.size(), 1u) << advice.tried;
  const std::vector<std::pair<std::string, std::string>> turned = {{"print-direction", "-z"}};
  EXPECT_EQ(advice.suggestions[0].options, turned);
  Spec spec = asked;
  Mesh changed = mesh;
  take(advice.suggestions[0], spec, changed);
  EXPECT_FALSE(refused(changed, spec));
}

TEST(Suggest, PrintsItOtherwiseWhereConesLeaveNoRoom) {
  FloatSpec asked;
  asked.print.wall_mm = 4;
  asked.print.self_supporting_deg = 45;
  const Mesh mesh = test::box({0, 0, 0}, {60, 24, 20});
  EXPECT_TRUE(refused(mesh, asked));
  const Advice advice = suggest(mesh, asked, coarse());
  ASSERT_EQ(advice.suggestions.size(), 2u) << advice.tried;
  EXPECT_EQ(advice.suggestions[0].kinds, std::vector{ChangeKind::roof});
  EXPECT_EQ(advice.suggestions[1].kinds, std::vector{ChangeKind::direction});
  for (const Suggestion& suggestion : advice.suggestions) {
    Spec spec = asked;
    Mesh changed = mesh;
    take(suggestion, spec, changed);
    EXPECT_FALSE(refused(changed, spec)) << suggestion.change;
  }
}

TEST(Suggest, LetsResinOut) {
  FloatSpec asked;
  asked.print.density_g_cm3 = 1.14;
  asked.print.liquid_g_cm3 = 1.09;
  const Mesh mesh = test::uv_ellipsoid(30, 24, 20, 32);
  EXPECT_TRUE(refused(mesh, asked));
  const Advice advice = suggest(mesh, asked, coarse());
  ASSERT_EQ(advice.suggestions.size(), 1u) << advice.tried;  // and nothing else is tried with resin inside
  EXPECT_EQ(advice.suggestions[0].kinds, std::vector{ChangeKind::drain});
  Spec spec = asked;
  Mesh changed = mesh;
  take(advice.suggestions[0], spec, changed);
  EXPECT_FALSE(refused(changed, spec));
}

Advice advice_that_works(const Mesh& mesh, const Spec& asked) {
  EXPECT_TRUE(refused(mesh, asked));
  const Advice advice = suggest(mesh, asked, coarse());
  EXPECT_FALSE(advice.suggestions.empty()) << advice.tried;
  for (const Suggestion& suggestion : advice.suggestions) {
    SCOPED_TRACE(suggestion.change);
    EXPECT_FALSE(suggestion.options.empty());
    Spec spec = asked;
    Mesh changed = mesh;
    take(suggestion, spec, changed);
    EXPECT_FALSE(refused(changed, spec));
  }
  return advice;
}

const Suggestion* by(const Advice& advice, const std::string& option) {
  for (const Suggestion& s : advice.suggestions)
    if (s.options.size() == 1 && s.options[0].first == option) return &s;
  return nullptr;
}

TEST(Suggest, AShellTooHeavyGetsAThinnerWallALargerSizeALighterMaterial) {
  FloatSpec spec;
  spec.print.wall_mm = 7;
  const Advice advice = advice_that_works(test::box({0, 0, 0}, {40, 40, 24}), spec);
  EXPECT_NE(by(advice, "wall"), nullptr);
  EXPECT_NE(by(advice, "size"), nullptr);
  EXPECT_NE(by(advice, "material"), nullptr);
}

TEST(Suggest, AWaterlineOutOfReachGetsAnother) {
  FloatSpec spec;
  spec.waterline_mm = 1;
  const Advice advice = advice_that_works(test::box({0, 0, 0}, {60, 60, 20}), spec);
  const Suggestion* waterline = by(advice, "waterline");
  ASSERT_NE(waterline, nullptr);
  EXPECT_GT(std::stod(waterline->options[0].second), 1);
  // Places of this size do not grow with it.
  EXPECT_EQ(by(advice, "size"), nullptr);
}

// A statue that floats well, but with 3 % dry: less than a search leaves, more than a print's scatter.
TEST(Suggest, AStatueGetsAWaterlineThatIsNotSearched) {
  FloatSpec spec;
  spec.print.wall_mm = 7;
  const Advice advice = advice_that_works(test::box({0, 0, 0}, {30, 30, 80}), spec);
  const Suggestion* waterline = by(advice, "waterline");
  ASSERT_NE(waterline, nullptr);
  EXPECT_GT(std::stod(waterline->options[0].second), 0.95 * 80);
}

// The nearest axis, and the nearest but for little: half of the way does not do.
TEST(Suggest, AnAxisOutOfReachGetsTheNearest) {
  const Mesh block = test::box({0, 0, 0}, {40, 20, 20});
  const auto about = [](const Vector3d& point) {
    SpinSpec spec;
    spec.axis.through = SpinAxis::Through::point;
    spec.axis.point_mm = point;
    return spec;
  };
  const Advice advice = advice_that_works(block, about({6, 10, 0}));
  const Suggestion* point = by(advice, "point");
  ASSERT_NE(point, nullptr);
  const std::vector<double> at = parse_numbers("point", point->options[0].second);
  EXPECT_NEAR(at[1], 10, 1);
  EXPECT_GT(at[0], 6);
  EXPECT_TRUE(refused(block, about({0.5 * (6 + at[0]), 10, 0})));
}

TEST(Suggest, AUnevenBaseGetsTheGiveItTakes) {
  Mesh stool = test::box({-20, -20, 30}, {20, 20, 45});
  for (const Vector3d& foot : {Vector3d(-15, -15, 0), Vector3d(15, 0, 0.26), Vector3d(-15, 15, 0.05)})
    append(stool, test::box(foot - Vector3d(4, 4, 0), {foot.x() + 4, foot.y() + 4, 31}));
  const Advice advice = advice_that_works(stool, StandSpec{});
  const Suggestion* contact = by(advice, "contact");
  ASSERT_NE(contact, nullptr);
  EXPECT_EQ(contact->options[0].second, "0.3");
}

TEST(Suggest, ATargetOutOfReachGetsAThinnerWall) {
  TargetSpec spec;
  spec.print.wall_mm = 2.5;
  spec.wanted[M1] = 12.3;
  spec.wanted[MX] = 20;
  const Advice advice = advice_that_works(test::box({0, 0, 0}, {40, 30, 20}), spec);
  EXPECT_NE(by(advice, "wall"), nullptr);
}

TEST(Suggest, APoseBesideAFaceGetsTheFace) {
  PoseSpec spec;
  spec.poses = {{.kind = Pose::Kind::stands, .up = Vector3d(0, 0, 1)}, {.kind = Pose::Kind::stands, .up = Vector3d(0.1, 1, 0.2)}};
  const Advice advice = advice_that_works(test::box({0, 0, 0}, {40, 30, 20}), spec);
  const Suggestion* faces = by(advice, "stand");
  ASSERT_NE(faces, nullptr);
  EXPECT_EQ(faces->options[0].second, "0,0,1;0,1,0");
  EXPECT_NE(faces->change.find("12.6 degrees off"), std::string::npos) << faces->change;
}

TEST(Suggest, ADieOutOfReachGetsAThinnerWallALargerSizeOrACore) {
  DiceSpec spec;
  spec.load = DiceSpec::Load{Vector3d(0, 0, 1), 0.24};
  const Advice advice = advice_that_works(test::box({0, 0, 0}, {20, 20, 20}), spec);
  EXPECT_NE(by(advice, "wall"), nullptr);
  EXPECT_NE(by(advice, "size"), nullptr);
  EXPECT_NE(by(advice, "core-material"), nullptr);
  EXPECT_EQ(by(advice, "up"), nullptr);
}

// In a gas nothing floats.
TEST(Suggest, SaysWhatWasTriedWhenNothingDoes) {
  FloatSpec spec;
  spec.fluid_g_cm3 = 0.005;
  const Mesh block = test::box({0, 0, 0}, {40, 30, 20});
  ASSERT_TRUE(refused(block, spec));
  const Advice advice = suggest(block, spec, coarse());
  EXPECT_TRUE(advice.suggestions.empty());
  EXPECT_NE(advice.tried.find("walls down to 0.4 mm"), std::string::npos) << advice.tried;
  EXPECT_NE(advice.tried.find("two of these together"), std::string::npos) << advice.tried;
}

// A block on its edge rests on its nearest face.
TEST(Suggest, TiltsToWhereItRests) {
  const Mesh block = test::rotated(test::box({-20, -15, -10}, {20, 15, 10}),
                                   Eigen::AngleAxisd(0.2, Vector3d(1, 2, 0).normalized()).toRotationMatrix());
  const Advice advice = advice_that_works(block, StandSpec{});
  const auto tilt = std::find_if(advice.suggestions.begin(), advice.suggestions.end(),
                                 [](const Suggestion& s) { return s.kinds == std::vector{ChangeKind::tilt}; });
  ASSERT_NE(tilt, advice.suggestions.end());
  EXPECT_TRUE(test::mentions(tilt->change, {"tilted by 11.5 degrees"}));
}

TEST(Suggest, LooksForNothingButWhatIsAllowed) {
  const Mesh ball = test::icosphere(20, 3);
  Search search;
  search.kinds = {ChangeKind::flatten, ChangeKind::wall};
  const Advice advice = suggest(ball, StandSpec{}, coarse(), search);
  ASSERT_EQ(advice.suggestions.size(), 1U) << advice.tried;
  EXPECT_EQ(advice.suggestions[0].kinds, std::vector{ChangeKind::flatten});
  EXPECT_TRUE(test::mentions(advice.tried, {"walls", "cuts of up to 2.00 mm below"}));
  EXPECT_EQ(advice.tried.find("sizes"), std::string::npos);
  // Within the limits, and no further than the first.
  search.limits.flatten = 1e-5;
  EXPECT_TRUE(suggest(ball, StandSpec{}, coarse(), search).suggestions.empty());
  search = {};
  search.first_only = true;
  EXPECT_EQ(suggest(ball, StandSpec{}, coarse(), search).suggestions.size(), 1U);
}

TEST(Suggest, WhoeverDeliversDecidesWhatDoes) {
  const Mesh ball = test::icosphere(20, 3);
  Search search;
  search.kinds = {ChangeKind::flatten, ChangeKind::up};
  std::vector<Suggestion> tried;
  search.deliver = [&tried](const Suggestion& change) {
    tried.push_back(change);
    return tried.size() > 1;
  };
  const Advice advice = suggest(ball, StandSpec{}, coarse(), search);
  ASSERT_EQ(tried.size(), 2U) << advice.tried;
  EXPECT_EQ(tried[0].kinds, std::vector{ChangeKind::flatten});
  ASSERT_EQ(advice.suggestions.size(), 1U);
  EXPECT_EQ(advice.suggestions[0].options, tried[1].options);
  // An outside that was found comes with it.
  const Mesh leaning = test::polycubes({{0, 0, 0}, {1, 0, 1}, {0, 0, 1}, {1, 0, 2}, {2, 0, 2}, {2, 0, 3}, {3, 0, 3}}, 10);
  search.kinds = {ChangeKind::deform};
  std::shared_ptr<const Deformation> outside;
  search.deliver = [&outside](const Suggestion& change) {
    outside = change.outside;
    return true;
  };
  suggest(leaning, StandSpec{}, coarse(), search);
  ASSERT_TRUE(outside);
  EXPECT_TRUE(outside->changed);
  EXPECT_GT(outside->largest_mm, 0);
}

TEST(Suggest, DeformsWhenNamedAndTheOutsideIsWhatIsJudged) {
  // A post that leans out over its foot.
  const Mesh leaning = test::polycubes({{0, 0, 0}, {1, 0, 1}, {0, 0, 1}, {1, 0, 2}, {2, 0, 2}, {2, 0, 3}, {3, 0, 3}}, 10);
  ASSERT_TRUE(refused(leaning, StandSpec{}));
  Search search;
  search.kinds = {ChangeKind::deform};
  const Advice advice = suggest(leaning, StandSpec{}, coarse(), search);
  ASSERT_EQ(advice.suggestions.size(), 1U) << advice.tried;
  const auto& [name, text] = advice.suggestions[0].options.at(0);
  EXPECT_EQ(name, "deform-limit");
  DeformOptions how;
  how.limit_mm = std::stod(text);
  const Deformation found = deform(leaning, StandSpec{}, coarse(), how);
  EXPECT_TRUE(found.changed);
  EXPECT_LE(found.largest_mm, *how.limit_mm);
  EXPECT_FALSE(refused(as_stored("x.stl", found.mesh), StandSpec{}));
}

TEST(Suggest, StopsWhenToldTo) {
  FloatSpec spec;
  spec.print.wall_mm = 7;
  Progress progress;
  int polls = 0;
  progress.cancelled = [&polls] { return ++polls > 20; };
  EXPECT_THROW(suggest(test::box({0, 0, 0}, {40, 40, 24}), spec, coarse(), {}, progress), Error);
}

}  // namespace
}  // namespace rayrep
