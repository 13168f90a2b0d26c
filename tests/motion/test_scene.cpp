// Scenes: their files, motions between states, and what is told of those that are wrong.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "motion_scenes.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/io/write_file.h"

namespace rayrep::test {
namespace {

using Eigen::Vector3d;
using Kind = SceneProblem::Kind;
namespace fs = std::filesystem;

/// A folder with meshes: a cube of 10 mm around the origin, a table of 100 x 100 x 10 mm below it, and a cube with a hole.
class SceneFiles : public ::testing::Test {
protected:
  void SetUp() override {
    write_mesh(folder() / "cube.stl", box(Vector3d::Constant(-5), Vector3d::Constant(5)));
    write_mesh(folder() / "table.stl", box({-50, -50, -15}, {50, 50, -5}));
    Mesh open = icosphere(10, 3);
    std::erase_if(open.triangles, [&](const Eigen::Vector3i& t) {
      const Vector3d& p = open.vertices[static_cast<std::size_t>(t[0])];
      return p.z() + 0.2 * p.x() > 0;
    });
    write_mesh(folder() / "open.stl", open);
  }

  fs::path folder() const { return folder_.path(); }
  SceneFile read(const std::string& text) const {
    std::ofstream(folder() / "scene.json") << text;
    return read_scene(folder() / "scene.json");
  }

  TemporaryFolder folder_;
};

constexpr const char* kLid = R"({
  "parts": {
    "table": {"mesh": "table.stl", "printed": false, "density": 0.7},
    "cube": {"mesh": "cube.stl", "pivot": [5, 0, -5], "material": "petg", "wall": 0.8}
  },
  "states": {
    "down": {},
    "up": {"up": "y", "poses": {"cube": {"at": [0, 0, 40], "axis": [0, 1, 0], "deg": 90}}}
  },
  "transitions": [
    {"from": "down", "to": "up", "motions": {"cube": {
      "translation": [{"time": 0.5, "at": [0, 0, 30], "in": [0, 0, 20], "out": [10, 0, 30]}],
      "rotation": [{"time": 0.25, "axis": "y", "deg": 0}]}}},
    {"name": "back", "from": "up", "to": "down"}
  ],
  "may_touch": [{"parts": ["table", "cube"], "clearance": 0}],
  "clearance": 0.2,
  "room": [[-60, -60, -20], [60, 60, 80]]
})";

TEST_F(SceneFiles, AreReadAsTheyAreWritten) {
  const SceneFile file = read(kLid);
  ASSERT_TRUE(file.problems.empty()) << file.problems[0].message;
  const Scene& scene = file.scene;
  ASSERT_EQ(scene.parts.size(), 2u);
  EXPECT_FALSE(scene.parts[0].printed);
  EXPECT_EQ(scene.parts[0].print.density_g_cm3, 0.7);
  EXPECT_EQ(scene.parts[1].print.wall_mm, 0.8);
  EXPECT_EQ(scene.parts[1].pivot_mm, Vector3d(5, 0, -5));
  EXPECT_EQ(scene.states[1].up, Vector3d(0, 1, 0));
  EXPECT_EQ(scene.transitions[0].name, "down to up");
  EXPECT_EQ(scene.transitions[1].name, "back");
  EXPECT_EQ(scene.pairs.at(0).clearance_mm, 0);
  EXPECT_EQ(scene.clearance_mm, 0.2);
  const Motion& motion = scene.transitions[0].motions[1];
  EXPECT_EQ(motion.at(0).translation_mm, Vector3d::Zero());
  EXPECT_EQ(motion.at(0.5).translation_mm, Vector3d(0, 0, 30));
  EXPECT_TRUE(motion.at(0.25).rotation.isApprox(Eigen::Quaterniond::Identity()));
  EXPECT_NEAR(motion.at(0.625).rotation.angularDistance(Eigen::Quaterniond::Identity()), kPi / 4, 1e-12);
  // Bezier: halfway from time 0 to 0.5, whose first handle is a third of the way.
  EXPECT_TRUE(motion.at(0.25).translation_mm.isApprox(Vector3d(0, 0, (0 + 3 * 10 + 3 * 20 + 30) / 8.0)));
  EXPECT_TRUE(misplaced(scene).empty());
}

TEST_F(SceneFiles, AreTheSameAfterTheyWereWritten) {
  const Scene scene = read(kLid).scene;
  const SceneFile again = read(scene_text(scene, folder() / "scene.json"));
  ASSERT_TRUE(again.problems.empty()) << again.problems[0].message;
  ASSERT_EQ(again.scene.transitions.size(), 2u);
  for (std::size_t t = 0; t < 2; ++t)
    for (std::size_t p = 0; p < 2; ++p)
      for (const double time : {0.0, 0.1, 0.3, 0.5, 0.7, 1.0}) {
        const PartPose a = scene.transitions[t].motions[p].at(time), b = again.scene.transitions[t].motions[p].at(time);
        EXPECT_TRUE(a.translation_mm.isApprox(b.translation_mm) || (a.translation_mm - b.translation_mm).norm() < 1e-12);
        EXPECT_LT(a.rotation.angularDistance(b.rotation), 1e-7);
      }
  EXPECT_EQ(again.scene.parts[1].pivot_mm, scene.parts[1].pivot_mm);
  EXPECT_EQ(again.scene.room->max(), scene.room->max());
}

TEST_F(SceneFiles, SayHowTheyRest) {
  const std::string text = R"({"parts": {"table": {"mesh": "table.stl"}, "cube": {"mesh": "cube.stl", "pivot": [0, 0, 5]}},
    "states": {"on": {"rests": "stands"}, "afloat": {"rests": {"kind": "floats", "waterline": 4}, "up": "x"}, "between": {},
               "up": {"rests": {"kind": "hangs", "point": [1, 2, 30]}, "poses": {"cube": {"at": [0, 0, 7], "axis": "x", "deg": 90}},
                      "hinges": [{"point": [1, 2, 3], "axis": "y", "parts": ["cube"]}]}},
    "fluid": "seawater", "least_tip": 4})";
  const SceneFile once = read(text);
  ASSERT_TRUE(once.problems.empty()) << once.problems[0].message;
  for (const Scene& scene : {once.scene, read(scene_text(once.scene, folder() / "scene.json")).scene}) {
    const Mechanism mechanism = mechanism_of(scene);
    ASSERT_EQ(mechanism.states.size(), 3u);
    EXPECT_EQ(mechanism.states[0].rests.kind, Pose::Kind::stands);
    EXPECT_EQ(mechanism.states[1].rests.waterline_mm, 4);
    EXPECT_EQ(*mechanism.states[1].rests.up, Vector3d::UnitX());
    EXPECT_EQ(mechanism.states[2].rests.point_mm, Vector3d(1, 2, 30));
    EXPECT_EQ(mechanism.states[2].hinges.at(0).parts, std::vector<std::size_t>{1});
    EXPECT_EQ(mechanism.states[2].hinges.at(0).axis, Vector3d::UnitY());
    EXPECT_TRUE((mechanism.states[2].poses[1] * Vector3d(0, 0, 5)).isApprox(Vector3d(0, 0, 12)));
    EXPECT_GT(mechanism.fluid_g_cm3, 1);
    EXPECT_EQ(mechanism.least_tip_deg, 4);
  }
  const auto message = [this](const std::string& state) {
    const SceneFile file = read(R"({"parts": {"cube": {"mesh": "cube.stl"}}, "states": {"one": )" + state + "}}");
    return file.problems.empty() ? "" : file.problems[0].message;
  };
  EXPECT_TRUE(mentions(message(R"({"rests": "stand"})"), {"one", "stands, floats or hangs"}));
  EXPECT_TRUE(mentions(message(R"({"rests": "hangs"})"), {"one", "point"}));
  EXPECT_TRUE(mentions(message(R"({"hinges": [{"point": [0, 0, 0], "axis": "x", "parts": ["lid"]}]})"), {"no part 'lid'"}));
}

TEST_F(SceneFiles, TurnsGoRoundAsOftenAsTheySay) {
  const SceneFile file = read(R"({"parts": {"cube": {"mesh": "cube.stl"}},
    "states": {"a": {}, "b": {"poses": {"cube": {"axis": "z", "deg": 720}}}}, "transitions": [{"from": "a", "to": "b"}]})");
  ASSERT_TRUE(file.problems.empty()) << file.problems[0].message;
  const Motion& motion = file.scene.transitions[0].motions[0];
  for (int n = 0; n <= 16; ++n) {
    const Eigen::Quaterniond expected(Eigen::AngleAxisd(n / 16.0 * 4 * kPi, Vector3d::UnitZ()));
    EXPECT_LT(motion.at(n / 16.0).rotation.angularDistance(expected), 1e-7) << n;
  }
}

TEST(ScenePoses, PivotStaysWhereItIsMoved) {
  Draw draw(2);
  for (int n = 0; n < 20; ++n) {
    const PartPose pose{draw.rotation(), draw.vector(10)};
    const Vector3d pivot = draw.vector(10);
    EXPECT_TRUE((pose.about(pivot) * pivot).isApprox(pivot + pose.translation_mm));
    EXPECT_TRUE(pose.about(pivot).linear().isApprox(pose.rotation.toRotationMatrix()));
  }
}

TEST_F(SceneFiles, TellWhatIsWrongWithPartStateAndPlace) {
  const auto problem = [this](const std::string& text, Kind kind) {
    const SceneFile file = read(text);
    for (const SceneProblem& p : file.problems)
      if (p.kind == kind) return p;
    ADD_FAILURE() << "not found in " << text;
    return SceneProblem{};
  };
  const SceneProblem solid = problem(R"({"parts": {"bowl": {"mesh": "open.stl"}}})", Kind::not_solid);
  EXPECT_EQ(solid.part, "bowl");
  EXPECT_TRUE(solid.place_mm);
  EXPECT_TRUE(mentions(solid.message, {"bowl", "open.stl", "no solid"}));
  EXPECT_TRUE(mentions(problem(R"({"parts": {"bowl": {"mesh": "none.stl"}}})", Kind::not_solid).message, {"none.stl"}));
  const SceneProblem part =
      problem(R"({"parts": {"cube": {"mesh": "cube.stl"}}, "states": {"open": {"poses": {"cub": {}}}}})", Kind::no_part);
  EXPECT_EQ(part.part, "cub");
  EXPECT_TRUE(mentions(part.message, {"open", "'cub'", "is it cube?"}));
  const std::string one = R"({"parts": {"cube": {"mesh": "cube.stl"}}, "states": {"open": {}, "shut": {}}, "transitions": [)";
  EXPECT_TRUE(mentions(problem(one + R"({"from": "open", "to": "shutt"}]})", Kind::no_part).message, {"'shutt'", "is it shut?"}));
  EXPECT_TRUE(mentions(
      problem(one + R"({"from": "open", "to": "shut", "motions": {"cube": {"translation": [{"time": 1.5, "at": [0, 0, 0]}]}}}]})",
              Kind::leaves)
          .message,
      {"cube", "1.5", "0 to 1"}));
  EXPECT_TRUE(mentions(
      problem(one + R"({"from": "open", "to": "shut", "motions": {"cube": {"translation": [{"time": 1, "at": [0, 7, 0]}]}}}]})",
              Kind::leaves)
          .message,
      {"cube", "shut", "7 mm"}));
  EXPECT_TRUE(mentions(problem(R"({"part": {}})", Kind::form).message, {"'part'", "parts"}));
  EXPECT_TRUE(
      mentions(problem(R"({"parts": {"cube": {"mesh": "cube.stl", "density": "heavy"}}})", Kind::form).message, {"density"}));
  EXPECT_TRUE(mentions(message_of([&] { read("{"); }, ErrorCode::input), {"scene.json", "line 1"}));
  EXPECT_TRUE(mentions(message_of([&] { read("[]"); }, ErrorCode::input), {"scene.json", "parts"}));
  EXPECT_TRUE(
      mentions(message_of([&] { require_scene(read(R"({"part": {}})"), "my.json"); }, ErrorCode::input), {"my.json", "'part'"}));
}

TEST_F(SceneFiles, TellBodiesThatAreWhereTheyCannotBe) {
  const SceneFile file = read(R"({"parts": {"table": {"mesh": "table.stl"}, "cube": {"mesh": "cube.stl"}},
    "states": {"on": {}, "sunk": {"poses": {"cube": {"at": [20, 0, -3]}}}, "far": {"poses": {"cube": {"at": [0, 0, 500]}}}},
    "transitions": [{"from": "on", "to": "far"}], "room": [[-60, -60, -20], [60, 60, 80]]})");
  ASSERT_TRUE(file.problems.empty()) << file.problems[0].message;
  const std::vector<SceneProblem> found = misplaced(file.scene);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].kind, Kind::overlap);
  EXPECT_EQ(found[0].part, "table");
  EXPECT_EQ(found[0].other, "cube");
  EXPECT_TRUE(mentions(found[0].message, {"sunk", "table and cube overlap", "mm deep"}));
  EXPECT_NEAR(found[0].place_mm->x(), 20, 5);
  EXPECT_NEAR(found[0].place_mm->z(), -6.5, 1.6);
  EXPECT_EQ(found[1].kind, Kind::leaves);
  EXPECT_TRUE(mentions(found[1].message, {"on to far", "cube leaves the room"}));
}

TEST_F(SceneFiles, CallWhatTouchesTooNearToAClearanceAndNoOverlap) {
  const SceneFile file = read(R"({"parts": {"one": {"mesh": "cube.stl"}, "other": {"mesh": "cube.stl"}}, "clearance": 0.1,
    "states": {"flush": {"poses": {"other": {"at": [10, 0, 0]}}}, "turned": {"poses": {"other": {"axis": "z", "deg": 180, "at": [10, 0, 0]}}},
               "near": {"poses": {"other": {"at": [10.05, 0, 0]}}}, "sunk": {"poses": {"other": {"at": [9.5, 0, 0]}}}}})");
  ASSERT_TRUE(file.problems.empty()) << file.problems[0].message;
  const std::vector<SceneProblem> found = misplaced(file.scene);
  ASSERT_EQ(found.size(), 4u);
  for (const auto& [n, words] : {std::pair(0, "flush: one and other are only 0.000 mm apart, not 0.1 mm"),
                                 {1, "turned: one and other are only 0.000 mm apart, not 0.1 mm"},
                                 {2, "near: one and other are only 0.050 mm apart, not 0.1 mm"},
                                 {3, "sunk: one and other overlap, 0.500 mm deep"}})
    EXPECT_TRUE(mentions(found[n].message, {words})) << found[n].message;
}

}  // namespace
}  // namespace rayrep::test
