// The commands that take a scene, as a user meets them.

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "places.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/io/write_file.h"
#include "solids.h"

namespace rayrep::test {
namespace {

namespace fs = std::filesystem;

std::string text_of(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// A cube that flies over or through a table.
class SceneTool : public ::testing::Test {
protected:
  void SetUp() override {
    write_mesh(folder() / "cube.stl", box({-5, -5, 0}, {5, 5, 10}));
    write_mesh(folder() / "table.stl", box({-20, -20, -10}, {20, 20, 0}));
    write_scene("over.json", 1);
    write_scene("through.json", -3);
  }

  fs::path folder() const { return folder_.path(); }

  void write_scene(const std::string& name, double height) const {
    const std::string pose = R"({"poses": {"cube": {"at": [)";
    const std::string rest = ", 0, " + std::to_string(height) + "]}}}";
    std::ofstream(folder() / name)
        << R"({"parts": {"cube": {"mesh": "cube.stl"}, "table": {"mesh": "table.stl"}}, "states": {"left": )" << pose << "-50"
        << rest << R"(, "right": )" << pose << "50" << rest
        << R"(}, "transitions": [{"name": "fly", "from": "left", "to": "right"}]})";
  }

  struct Run {
    int code = -1;
    std::string out, err;
  };
  Run run(const std::string& arguments) const {
    const std::string command = "cd '" + folder().string() + "' && '" + tool() + "' " + arguments + " >.out 2>.err";
    const int status = std::system(command.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, text_of(folder() / ".out"), text_of(folder() / ".err")};
  }

  TemporaryFolder folder_;
};

TEST_F(SceneTool, MotionTellsWhenWhereAndHowBadly) {
  const Run clear = run("motion over.json");
  EXPECT_EQ(clear.code, 0) << clear.err;
  EXPECT_TRUE(mentions(clear.out, {"fly", "clear all the way: 1 pair"}));
  const Run near = run("motion over.json --clearance 2");
  EXPECT_EQ(near.code, 4);
  EXPECT_TRUE(mentions(near.out, {"cube and table", "nearer than 2 mm"}));
  const Run hit = run("motion through.json");
  EXPECT_EQ(hit.code, 4);
  EXPECT_TRUE(mentions(hit.out, {"cube and table overlap from 0.25", "to 0.75", "mm deep", "around ("}));
  EXPECT_TRUE(mentions(hit.err, {"through.json", "cube and table (fly)"}));
  const nlohmann::json json = nlohmann::json::parse(run("motion through.json --json").out);
  EXPECT_FALSE(json["pass"]);
  EXPECT_NEAR(json["pairs"][0]["intervals"][0]["from"].get<double>(), 0.25, 1e-3);
}

TEST_F(SceneTool, MotionWritesAPageToo) {
  EXPECT_EQ(run("motion over.json -q --html over.html").code, 0);
  EXPECT_TRUE(mentions(text_of(folder() / "over.html"), {"<!doctype html>", "over.json", "No part gets into another"}));
  EXPECT_EQ(run("motion through.json -q --html through.html").code, 4);
  EXPECT_TRUE(mentions(text_of(folder() / "through.html"), {"cube and table overlap from 25.0 % to 75.0 % of 'fly'"}));
  EXPECT_EQ(run("motion over.json -q --html none/over.html").code, 6);
}

TEST_F(SceneTool, ImportMakesASceneOfARobot) {
  const std::string robot = "'" + (source_folder() / "examples/scenes/arm.urdf").string() + "'";
  const Run imported = run("scene import " + robot);
  EXPECT_EQ(imported.code, 0) << imported.err;
  EXPECT_TRUE(mentions(imported.out,
                       {"arm.json: 6 parts, 6 states, 6 transitions", "also what is fixed to it: 'camera'", "Nothing is wrong"}));
  EXPECT_EQ(run("scene check arm.json").code, 0);
  const Run motion = run("motion arm.json");
  EXPECT_EQ(motion.code, 4);
  EXPECT_TRUE(mentions(motion.err, {"foot and fore (yaw round)"}));
  const nlohmann::json again = nlohmann::json::parse(run("scene import " + robot + " --json -o twin.json").out);
  EXPECT_EQ(again["parts"][3]["mesh"], "twin_fore.stl");
  EXPECT_TRUE(fs::exists(folder() / "twin_fore.stl"));

  std::ofstream(folder() / "bad.urdf") << "<robot name=\"r\"><link name=\"a\"/><link name=\"b\"/></robot>";
  const Run bad = run("scene import bad.urdf");
  EXPECT_EQ(bad.code, 3);
  EXPECT_TRUE(mentions(bad.err, {"bad.urdf: 1 thing is wrong", "'a', 'b'"}));
  EXPECT_FALSE(fs::exists(folder() / "bad.json"));
  EXPECT_EQ(run("scene import " + robot + " -o none/arm.json").code, 6);
  EXPECT_EQ(run("scene check arm.json --visual").code, 2);
  EXPECT_TRUE(mentions(run("scene imprt arm.urdf").err, {"Did you mean import"}));
  EXPECT_TRUE(mentions(run("scene import").err, {"Name the robot"}));
  const Run scene = run("scene import arm.json -o arm.json");
  EXPECT_EQ(scene.code, 2);
  EXPECT_TRUE(mentions(scene.err, {"arm.json' is no URDF", "scene check"}));
  std::ofstream(folder() / "arm.txt") << "{\"robot\": \"<r>\"}";
  EXPECT_TRUE(mentions(run("scene import arm.txt").err, {"arm.txt is no URDF", "not XML"}));
}

TEST_F(SceneTool, ExportWritesGltf) {
  const Run exported = run("scene export over.json");
  EXPECT_EQ(exported.code, 0) << exported.err;
  EXPECT_TRUE(mentions(exported.out, {"over.glb: 2 parts, 1 animation of 2 s"}));
  EXPECT_EQ(text_of(folder() / "over.glb").substr(0, 4), "glTF");
  EXPECT_EQ(run("scene export over.json -o over.gltf").code, 2);
  EXPECT_EQ(run("scene export over.json --visual").code, 2);
  EXPECT_EQ(run("scene export none.json").code, 3);
  EXPECT_EQ(run("scene check over.json -o over.glb").code, 2);
}

TEST_F(SceneTool, SceneCheckTellsWhatIsWrong) {
  EXPECT_EQ(run("scene check over.json").code, 0);
  EXPECT_EQ(run("scene over.json -q").code, 0);
  std::ofstream(folder() / "sunk.json") << R"({"parts": {"cube": {"mesh": "cube.stl"}, "table": {"mesh": "table.stl"}},
    "states": {"in": {"poses": {"cube": {"at": [0, 0, -3]}}}}})";
  const Run sunk = run("scene check sunk.json");
  EXPECT_EQ(sunk.code, 3);
  EXPECT_TRUE(mentions(sunk.out, {"wrong: states, in: cube and table overlap"}));
  EXPECT_TRUE(mentions(sunk.err, {"1 thing is wrong"}));
  const Run none = run("motion none.json");
  EXPECT_EQ(none.code, 3);
  EXPECT_TRUE(mentions(none.err, {"none.json"}));
  EXPECT_EQ(run("motion").code, 2);
  EXPECT_TRUE(mentions(run("motion").err, {"Name the scene"}));
  EXPECT_EQ(run("motion over.json --tolerance 0").code, 2);
  std::ofstream(folder() / "bad.json") << R"({"parts": {"cube": {"mesh": "cub.stl"}}})";
  EXPECT_TRUE(mentions(run("motion bad.json").err, {"cub.stl"}));
}

TEST_F(SceneTool, CarveMakesRoom) {
  const Run carved = run("carve through.json --part table --by cube --clearance 0.4 --tolerance 1");
  EXPECT_EQ(carved.code, 0) << carved.err;
  EXPECT_TRUE(mentions(carved.out, {"table_carved.stl", "table without", "cube needs"}));
  std::string text = text_of(folder() / "through.json");
  text.replace(text.find("table.stl"), 9, "table_carved.stl");
  std::ofstream(folder() / "after.json") << text;
  const Run after = run("motion after.json --clearance 0.4");
  EXPECT_EQ(after.code, 0) << after.out;
  EXPECT_TRUE(mentions(run("carve over.json --part table").err, {"--part A --by B"}));
  EXPECT_TRUE(mentions(run("carve over.json --part table --by cup").err, {"no part 'cup'", "cube, table"}));
  EXPECT_EQ(run("carve over.json --part table --by table").code, 2);
}

TEST_F(SceneTool, BalanceWritesPartsThatRestInEveryStateAndASceneThatNamesThem) {
  const std::string giraffe = "'" + (source_folder() / "examples" / "scenes" / "giraffe.json").string() + "'";
  const Run made = run("balance " + giraffe + " --resolution 40 -o giraffe");
  EXPECT_EQ(made.code, 0) << made.err;
  EXPECT_TRUE(mentions(made.out, {"giraffe/body.stl", "giraffe/neck.stl", "In the state 'reaching'", "proven", "VERIFIED"}));
  const Run again = run("balance giraffe/giraffe.json --as-is --json");
  EXPECT_EQ(again.code, 0) << again.err;
  const nlohmann::json json = nlohmann::json::parse(again.out);
  EXPECT_TRUE(json["pass"]);
  EXPECT_EQ(json["parts"][0]["cavities"], 1);
  EXPECT_FALSE(json.contains("output"));
  EXPECT_EQ(run("motion giraffe/giraffe.json").code, 0);
  EXPECT_EQ(run("balance " + giraffe + " --resolution 40 -o giraffe -q --html giraffe.html").code, 0) << "over what is there";
  EXPECT_TRUE(mentions(text_of(folder() / "giraffe.html"), {"<!doctype html>", "giraffe.json", "In the state 'reaching'"}));
  const Run none = run("balance over.json");
  EXPECT_EQ(none.code, 2);
  EXPECT_TRUE(mentions(none.err, {"rests"}));
  EXPECT_FALSE(fs::exists(folder() / "over_balanced"));
}

TEST_F(SceneTool, BalanceLeavesNothingBehindWhereItCannotBeDone) {
  // Stood on its side the cube lies beyond the edge of the table, whatever is inside.
  std::ofstream(folder() / "falls.json") << R"({"parts": {"cube": {"mesh": "cube.stl"}, "table": {"mesh": "cube.stl"}},
    "states": {"beside": {"poses": {"cube": {"at": [9, 0, 10]}}, "rests": "stands"},
               "far": {"poses": {"cube": {"at": [60, 0, 10]}}, "rests": "stands"}}})";
  const Run falls = run("balance falls.json");
  EXPECT_EQ(falls.code, 4);
  EXPECT_TRUE(mentions(falls.err, {"cannot rest", "'far'"}));
  EXPECT_FALSE(fs::exists(folder() / "falls_balanced"));
  // In one place twice they would weigh twice.
  std::ofstream(folder() / "sunk.json") << R"({"parts": {"cube": {"mesh": "cube.stl"}, "table": {"mesh": "table.stl"}},
    "states": {"in": {"poses": {"cube": {"at": [0, 0, -3]}}, "rests": "stands"}}})";
  const Run sunk = run("balance sunk.json");
  EXPECT_EQ(sunk.code, 3);
  EXPECT_TRUE(mentions(sunk.err, {"cube and table overlap"}));
  EXPECT_FALSE(fs::exists(folder() / "sunk_balanced"));
}

TEST_F(SceneTool, HintsAndResolves) {
  const Run hint = run("motion through.json --hint");
  EXPECT_EQ(hint.code, 4);
  EXPECT_TRUE(mentions(hint.out, {"For cube and table on the way fly", "cube, everywhere: move it by", "clear then"}));
  const Run resolved = run("motion through.json --resolve --free cube -o out.json --html out.html");
  EXPECT_EQ(resolved.code, 0) << resolved.out << resolved.err;
  EXPECT_TRUE(mentions(resolved.out, {"out.json: after"}));
  EXPECT_TRUE(mentions(text_of(folder() / "out.html"), {"out.json", "No part gets into another"}));
  EXPECT_EQ(run("motion out.json").code, 0);
  EXPECT_EQ(run("motion through.json --free cube").code, 2);
}

}  // namespace
}  // namespace rayrep::test
