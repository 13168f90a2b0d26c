// The page of a scene: what it is given is the scene and what was found, whatever parts are called.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "motion_scenes.h"
#include "rayrep/judge/verify_mechanism.h"
#include "rayrep/report/motion_report.h"
#include "rayrep/report/scene_page.h"

namespace rayrep {
namespace {

using namespace test;
using Json = nlohmann::json;

/// A cube that flies past a table at a height, negative: through it.
Scene flight(double height) {
  Scene scene = fly_by(box({-20, -20, -10}, {20, 20, 0}), box({-5, -5, 0}, {5, 5, 10}), moved_by({-50, 0, height}),
                       moved_by({50, 0, height}, Eigen::Quaterniond(Eigen::AngleAxisd(1, Eigen::Vector3d::UnitZ()))));
  scene.parts[1].pivot_mm = {1, 2, 3};
  return scene;
}

Json data_of(const Scene& scene, const MotionReport& report) { return Json::parse(page_data(scene, report, {"flight.json"}).json); }

Eigen::Vector3d vector_in(const Json& json) { return {json[0].get<double>(), json[1].get<double>(), json[2].get<double>()}; }

TEST(ScenePage, HoldsKeysAndWhatWasFound) {
  const Scene scene = flight(-3);
  const MotionReport report = MotionChecker().check(scene);
  const Json data = data_of(scene, report);
  const Json& motion = data["scene"]["transitions"][0]["motions"][1];
  for (std::size_t n = 0; n < 2; ++n) {
    const TranslationKey& key = scene.transitions[0].motions[1].translation[n];
    EXPECT_EQ(motion["translation"][n]["time"], key.time);
    EXPECT_EQ(vector_in(motion["translation"][n]["at"]), key.at_mm);
    EXPECT_EQ(vector_in(motion["translation"][n]["in"]), key.in_mm);
    EXPECT_EQ(vector_in(motion["translation"][n]["out"]), key.out_mm);
    EXPECT_EQ(motion["rotation"][n]["rotation"][0], scene.transitions[0].motions[1].rotation[n].rotation.w());
  }
  EXPECT_EQ(vector_in(data["scene"]["parts"][1]["pivot_mm"]), scene.parts[1].pivot_mm);
  EXPECT_EQ(vector_in(data["scene"]["states"][1]["poses"][1]["translation"]), Eigen::Vector3d(50, 0, -3));
  const Json& pair = data["found"]["pairs"][0];
  const CollisionInterval& interval = report.pairs[0].intervals.at(0);
  EXPECT_EQ(pair["first"], 0);
  EXPECT_EQ(pair["second"], 1);
  EXPECT_EQ(pair["transition"], 0);
  EXPECT_EQ(pair["intervals"][0]["from"], interval.from);
  EXPECT_EQ(pair["intervals"][0]["to"], interval.to);
  EXPECT_EQ(pair["intervals"][0]["worst"]["contour_mm"].size(), interval.contour_mm.size());
  EXPECT_EQ(vector_in(pair["intervals"][0]["worst"]["box_mm"][0]), interval.worst_box_mm.min());
}

TEST(ScenePage, SaysFirstWhetherPartsGetIntoEachOther) {
  const auto told = [](const Scene& scene) {
    const Json found = data_of(scene, MotionChecker().check(scene))["found"];
    return std::pair(found["pass"].get<bool>(), found["told"][0].get<std::string>());
  };
  EXPECT_EQ(
      told(flight(1)),
      std::pair(
          true,
          std::string("No part gets into another: of 1 pair of parts on 1 way none overlaps for longer than 0.1 % of the way.")));
  EXPECT_EQ(told(flight(-3)),
            std::pair(false, std::string("Parts get into each other: 1 collision among 1 pair of parts on 1 way.")));
  Scene alone = flight(1);
  alone.pairs = {{0, 1, std::nullopt}};
  EXPECT_EQ(told(alone), std::pair(true, std::string("Nothing moves past anything else: no pair of parts had to be tested.")));
}

TEST(ScenePage, TellsNoPlaceThatIsNotKnownYet) {
  const Scene scene = flight(-3);
  std::vector<MotionReport> reports;
  MotionCheckOptions options;
  options.found = [&](const MotionReport& report) { reports.push_back(report); };
  MotionChecker().check(scene, options);
  ASSERT_GT(reports.size(), 1u);
  EXPECT_EQ(reports.front().stage, MotionReport::Stage::coarse);
  const Json coarse = Json::parse(found_json(scene, reports.front(), {"flight.json"}));
  EXPECT_EQ(coarse["stage"], "coarse");
  for (const Json& interval : coarse["pairs"][0]["intervals"]) EXPECT_TRUE(interval["worst"].is_null()) << interval;
  EXPECT_EQ(data_of(scene, MotionReport{})["found"]["told"][0], "Collisions are being looked for.");
}

TEST(ScenePage, TellsOfEachStateThatRestsHowItDoes) {
  Scene scene = flight(1);
  for (SceneState& state : scene.states) {
    state.rests = Pose{.kind = Pose::Kind::stands, .up = Eigen::Vector3d::UnitZ()};
    state.poses[1].translation_mm = {0, 0, 0};
  }
  scene.states[1].poses[1].translation_mm = {-10, 10, 0};
  scene.states.insert(scene.states.begin() + 1, scene.states[0]);
  scene.states[1].rests.reset();
  scene.states[2].hinges = {{.point_mm = {1, 2, 3}, .axis = Eigen::Vector3d::UnitY(), .parts = {1}}};
  scene.transitions.clear();
  BalanceReport balance{"flight.json", mechanism_of(scene), {}, {}, {}};
  balance.verdict = verify(balance.mechanism, {nullptr, nullptr});
  const Json told = Json::parse(page_data(scene, MotionReport{}, {.name = "flight.json", .balance = &balance}).json)["balance"];
  EXPECT_EQ(told["pass"], balance.verdict.pass());
  EXPECT_FALSE(told["made"]);
  ASSERT_EQ(told["states"].size(), 2u);
  EXPECT_EQ(told["states"][0]["state"], 0);
  const Json& last = told["states"][1];
  EXPECT_EQ(last["state"], 2);
  EXPECT_EQ(last["attitude"]["kind"], "stands");
  EXPECT_EQ(last["attitude"]["lowest_mm"], -10);
  EXPECT_EQ(last["after"]["pose_1_support_polygon_mm"].size(), 4u);
  EXPECT_EQ(last["told"][0], balance.verdict.states[1].meaning[0]);
  // The cube turns as its pose says: its centre of mass goes with it.
  const PartPose& pose = scene.states[2].poses[1];
  const Eigen::Vector3d centre = pose.about(scene.parts[1].pivot_mm) * Eigen::Vector3d(0, 0, 5);
  EXPECT_LT((vector_in(last["after"]["hinge_1_centre_of_mass_mm"]) - centre).norm(), 1e-9);
  EXPECT_EQ(vector_in(last["hinges"][0]["point_mm"]), Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(last["criteria"].back()["name"], "hinge_balance");
  EXPECT_FALSE(data_of(scene, MotionReport{}).contains("balance"));
}

TEST(ScenePage, IsReadAgainWhateverPartsAreCalled) {
  Scene scene = flight(-3);
  scene.parts[0].name = "</script><!--\xE2\x80\xA8&";
  scene.transitions[0].name = "\xFF\"'<b>";
  const MotionReport report = MotionChecker().check(scene);
  const std::string page = to_html(scene, report, {"<i>.json"});
  EXPECT_EQ(page, to_html(scene, report, {"<i>.json"}));
  const PageData put = page_data(scene, report, {"<i>.json"}), read = page_data(page);
  EXPECT_EQ(Json::parse(read.json), Json::parse(put.json));
  EXPECT_EQ(read.meshes, put.meshes);
  EXPECT_EQ(read.meshes.size(), 2u);
  EXPECT_EQ(Json::parse(read.json)["scene"]["parts"][0]["name"], scene.parts[0].name);
  EXPECT_EQ(page.find("<b>"), std::string::npos);
}

}  // namespace
}  // namespace rayrep
