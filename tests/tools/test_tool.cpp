// The rayrep command as a user meets it: exit codes, messages, files.

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <pugixml.hpp>
#include <regex>
#include <sstream>

#include "places.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/judge/verify.h"
#include "rayrep/mesh/mesh_check.h"
#include "solids.h"

namespace rayrep {
namespace {

using namespace test;
namespace fs = std::filesystem;

std::string text_of(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// An ellipsoid with a hole whose rim is bent.
Mesh opened_egg() {
  Mesh open = uv_ellipsoid(30, 22, 16, 24);
  std::erase_if(open.triangles, [&](const Eigen::Vector3i& t) {
    const Eigen::Vector3d p = (open.vertices[t[0]] + open.vertices[t[1]] + open.vertices[t[2]]) / 3;
    return p.z() + p.x() * p.x() / 60 > 14;
  });
  return open;
}

/// Each test runs in a folder of its own.
class Tool : public ::testing::Test {
protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("rayrep_tool_" + std::to_string(getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    write_mesh(folder_ / "egg.stl", uv_ellipsoid(30, 22, 16, 24));
  }
  void TearDown() override { fs::remove_all(folder_); }

  struct Run {
    int code = -1;
    std::string out;
    std::string err;
  };

  Run run(const std::string& arguments) const {
    const std::string command = "cd '" + folder_.string() + "' && '" + test::tool() + "' " + arguments + " >.out 2>.err";
    const int status = std::system(command.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, text_of(folder_ / ".out"), text_of(folder_ / ".err")};
  }

  /// Files in the folder other than what SetUp and run leave there.
  std::vector<std::string> new_files() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_)) {
      const std::string name = entry.path().filename().string();
      if (name != "egg.stl" && name != ".out" && name != ".err") names.push_back(name);
    }
    std::sort(names.begin(), names.end());
    return names;
  }

  fs::path folder_;
};

// Holes and plugs as they are written, and judged again by the command line that is told.
TEST_F(Tool, WritesPlugsThatCloseTheHoles) {
  for (const std::string name : {"a.stl", "a.3mf"}) {
    const Run made = run("float egg.stl --resin --resolution 40 -v --no-advice --report r.json -o " + name);
    ASSERT_EQ(made.code, 0) << made.err;
    EXPECT_TRUE(mentions(made.out, {"2 holes of 4.00 mm", "stay in its cavities", "g of resin", "glue in the"})) << made.out;
    EXPECT_EQ(fs::exists(folder_ / "a_plugs.stl"), true);
    const nlohmann::json report = nlohmann::json::parse(text_of(folder_ / "r.json"));
    EXPECT_EQ(report["plugs"]["pieces"], 2);
    EXPECT_EQ(report["plugs"]["path"], name == "a.3mf" ? "a.3mf" : "a_plugs.stl");
    EXPECT_EQ(report["after"]["holes"].size(), 2u);
    const std::string before = "to judge it again: rayrep ";
    const std::size_t at = made.out.find(before);
    ASSERT_NE(at, std::string::npos) << made.out;
    const std::string line = made.out.substr(at + before.size(), made.out.find('\n', at + 1) - at - before.size());
    const Run judged = run(line);
    EXPECT_EQ(judged.code, 0) << line << judged.err;
  }
  EXPECT_EQ(run("verify a.stl --drain auto --plug --density 1.14 --original egg.stl").code, 4);  // without them
  EXPECT_TRUE(mentions(run("verify a.stl --drain auto").err, {"--original"}));
  EXPECT_TRUE(mentions(run("float egg.stl --resin --material pla").err, {"either --material or --resin"}));
  EXPECT_TRUE(mentions(run("float egg.stl --plug").err, {"--drain auto"}));
  EXPECT_TRUE(mentions(run("float egg.stl --drain 1,2").err, {"X,Y,Z"}));
  EXPECT_TRUE(mentions(run("verify a.gcode --original egg.stl --drain auto --plug").err, {"--plugs FILE"}));
  EXPECT_TRUE(mentions(run("float egg.stl --drain auto --infill 15").err, {"--drain"}));
  EXPECT_TRUE(mentions(run("float egg.stl --drain auto --plug --plug-clearance 1 --drain-diameter 2").err, {"too thin"}));
}

TEST_F(Tool, SaysWhatComesOutOfHolesAndWhatDoesNot) {
  const std::string how = "float egg.stl --submerged 0.5 --wall 2 --resolution 40 --drain ";
  const Run above = run(how + "0,0,16");
  EXPECT_TRUE(mentions(above.out, {"Nothing of the liquid that is left inside"})) << above.out << above.err;
  const Run below = run(how + "0,0,16 --print-direction -z");
  EXPECT_TRUE(mentions(below.out, {"What is left inside comes out of the holes. "})) << below.out << below.err;
}

TEST_F(Tool, AnOptionMayBeGivenWithoutItsValue) {
  // What is said is noted before the work begins, which is refused.
  const auto noted = [this](const std::string& words) {
    fs::remove(folder_ / "said.json");
    const Run refused = run("float " + words + " --solver voxels --no-advice --save-config said.json");
    EXPECT_TRUE(mentions(refused.err, {"Only --solver quadric"})) << words;
    return nlohmann::json::parse(text_of(folder_ / "said.json"))["self-supporting"];
  };
  EXPECT_EQ(noted("egg.stl --self-supporting"), 45);
  EXPECT_EQ(noted("--self-supporting egg.stl"), 45);
  EXPECT_EQ(noted("--self-supporting 40 egg.stl"), 40);
  EXPECT_EQ(noted("--self-supporting=30.5 egg.stl"), 30.5);
  std::ofstream(folder_ / "spec.json") << R"({ "mesh": "egg.stl", "self-supporting": true })";
  EXPECT_EQ(noted("spec.json"), 45);
  EXPECT_TRUE(mentions(run("float egg.stl --self-supporting 45deg").err, {"without 'deg'"}));
  EXPECT_TRUE(mentions(run("float egg.stl --wall").err, {"wall"}));
  EXPECT_TRUE(mentions(run("float --help").out, {"--self-supporting [DEG]"}));
  EXPECT_TRUE(mentions(run("sweep float egg.stl --self-supporting --vary wall=1,2").out, {"\"self-supporting\":true"}));
}

TEST_F(Tool, SuggestsACommandThatWorks) {
  const Run refused = run("float egg.stl --resolution 40 --waterline 2 --suggest --output s.stl");
  EXPECT_EQ(refused.code, 4);
  std::istringstream lines(refused.out);
  std::string line;
  ASSERT_TRUE(std::getline(lines, line)) << refused.err;
  EXPECT_EQ(line.substr(0, 7), "rayrep ");
  EXPECT_EQ(line.find("--suggest"), std::string::npos);
  EXPECT_EQ(line.find("--waterline 2 "), std::string::npos) << line;
  EXPECT_EQ(run(line.substr(7)).code, 0) << line;
  EXPECT_EQ(new_files(), (std::vector<std::string>{"s.stl"}));
}

TEST_F(Tool, ChangesWhatIsAllowed) {
  const Run changed = run("float egg.stl --resolution 40 --waterline 2 --allow wall,waterline --report r.json");
  EXPECT_EQ(changed.code, 0) << changed.err;
  EXPECT_TRUE(mentions(changed.err, {"With a change that --allow lets: a waterline of", "rayrep float egg.stl"}));
  EXPECT_TRUE(mentions(changed.out, {"Changed, as --allow lets: a waterline of", "VERIFIED"}));
  EXPECT_TRUE(mentions(nlohmann::json::parse(text_of(folder_ / "r.json"))["changed"].get<std::string>(), {"a waterline of"}));
  // What needs no change gets none.
  const Run asked = run("float egg.stl --resolution 40 --allow all");
  EXPECT_EQ(asked.code, 0);
  EXPECT_EQ(asked.out.find("Changed"), std::string::npos);
  const Run refused = run("float egg.stl --resolution 40 --waterline 2 --allow contact -o none.stl");
  EXPECT_EQ(refused.code, 4);
  EXPECT_TRUE(mentions(refused.err, {"Nothing that --allow lets change"}));
  EXPECT_FALSE(fs::exists(folder_ / "none.stl"));
  EXPECT_TRUE(mentions(run("float egg.stl --allow walls").err, {"Did you mean wall?"}));
  // A mesh is not among what it lets change.
  Mesh open = icosphere(20, 2);
  open.triangles.resize(open.triangles.size() - 60);
  write_mesh(folder_ / "torn.stl", open);
  const Run torn = run("float torn.stl --resolution 40 --allow all --suggest -o none.stl");
  EXPECT_EQ(torn.code, 3) << torn.err;
  EXPECT_EQ(torn.err.find("Internal"), std::string::npos) << torn.err;
  EXPECT_EQ(run("float egg.stl --allow").code, 2);
}

TEST_F(Tool, CertifiesAndSearchesTheAxis) {
  const Run spin = run("spin egg.stl --resolution 40 --point auto --axis auto --max-tilt 10 --certify --report c.json -v");
  ASSERT_EQ(spin.code, 0) << spin.err;
  EXPECT_NE(spin.out.find("of the global optimum (proven"), std::string::npos) << spin.out;
  EXPECT_NE(spin.out.find("axis along ("), std::string::npos);
  const auto report = nlohmann::json::parse(text_of(folder_ / "c.json"));
  const auto& certificate = report["solver"]["certificate"];
  EXPECT_TRUE(certificate["closed"]);
  EXPECT_LE(certificate["gap"].get<double>(), 1e-4);
  EXPECT_LE(report["solver"]["as_built_error"].get<double>(), 1e-6);
  // The line to judge it again names the axis that was found.
  const auto at = spin.out.find("rayrep verify ");
  ASSERT_NE(at, std::string::npos);
  EXPECT_EQ(run(spin.out.substr(at + 7, spin.out.find('\n', at) - at - 7)).code, 0);
  for (const char* wrong : {"--certify --prefer smallest", "--certify --objective spinit", "--max-tilt 5",
                            "--axis auto --max-tilt 0", "--yoyo --point auto", "--axis sideways"})
    EXPECT_EQ(run(std::string("spin egg.stl ") + wrong).code, 2) << wrong;
}

/// The page without what the clock and the memory have told.
std::string steady(const std::string& page) {
  static const std::regex kTold(R"re("(timings_s":\{[^}]*\}|seconds":[^,}]*|peak_memory_mb":[^,}]*|threads":"[^"]*"))re");
  std::string result;
  std::istringstream lines(page);
  for (std::string line; std::getline(lines, line);) {
    const bool data = line.find("id=\"rayrep-data\"") != std::string::npos;
    result += (data ? std::regex_replace(line, kTold, "") : line) + "\n";
  }
  return result;
}

TEST_F(Tool, WritesAPageToLookAt) {
  ASSERT_EQ(run("float egg.stl --resolution 50 --html a.html --threads 1 -q -o e.stl").code, 0);
  ASSERT_EQ(run("float egg.stl --resolution 50 --html b.html --threads 2 -q -o e.stl").code, 0);
  const std::string page = text_of(folder_ / "a.html");
  EXPECT_TRUE(mentions(page, {"<title>e.stl: float</title>", "id=\"rayrep-mesh-1\""}));
  EXPECT_EQ(steady(page), steady(text_of(folder_ / "b.html")));
  // Of what fails, too.
  EXPECT_EQ(run("verify egg.stl --waterline 20 --html failed.html").code, 4);
  EXPECT_TRUE(mentions(text_of(folder_ / "failed.html"), {"\"pass\":false"}));
  EXPECT_EQ(run("inspect egg.stl --html /dev/stdout -q").out.substr(0, 15), "<!doctype html>");
  write_mesh(folder_ / "torn.stl", opened_egg());
  EXPECT_EQ(run("inspect torn.stl --html torn.html").code, 3);
  EXPECT_TRUE(mentions(text_of(folder_ / "torn.html"), {"\"usable\":false"}));
  EXPECT_EQ(run("float egg.stl --html egg.stl").code, 2);
  EXPECT_EQ(run("float egg.stl --html r --report r").code, 2);
  EXPECT_EQ(run("float egg.stl --html none/r.html").code, 6);
  EXPECT_TRUE(mentions(run("inspect print.gcode --html r.html").err, {"A page shows meshes"}));
}

TEST_F(Tool, FloatsAndVerifies) {
  const Run run_float = run("float egg.stl --resolution 60 --report r.json");
  ASSERT_EQ(run_float.code, 0) << run_float.err;
  EXPECT_NE(run_float.out.find("VERIFIED: wrote egg_float.stl"), std::string::npos) << run_float.out;
  EXPECT_EQ(run_float.err, "");
  EXPECT_EQ(new_files(), (std::vector<std::string>{"egg_float.stl", "r.json"}));

  const auto report = nlohmann::json::parse(text_of(folder_ / "r.json"));
  EXPECT_EQ(report["command"], "float");
  EXPECT_TRUE(report["pass"]);
  for (const char* key : {"input", "options", "before", "after", "criteria", "solver", "timings_s", "peak_memory_mb", "version"})
    EXPECT_TRUE(report.contains(key)) << key;
  for (const char* key : {"name", "status", "iterations", "variables", "objective", "seconds"})
    EXPECT_TRUE(report["solver"].contains(key)) << key;
  for (const char* key : {"read", "domain", "rays", "solve", "mesh", "verify", "write", "total"})
    EXPECT_GE(report["timings_s"][key].get<double>(), 0) << key;
  ASSERT_EQ(report["criteria"].size(), 10u);
  for (const auto& c : report["criteria"]) EXPECT_TRUE(c["pass"]) << c["name"];
  EXPECT_GT(report["before"]["mass_g"].get<double>(), report["after"]["mass_g"].get<double>());

  const std::string waterline = std::to_string(report["goal"]["waterline_mm"].get<double>());
  EXPECT_EQ(run("verify egg_float.stl --original egg.stl --waterline " + waterline).code, 0);
  EXPECT_EQ(run("verify egg_float.stl").code, 0);
  const Run solid = run("verify egg.stl --waterline " + waterline);
  EXPECT_EQ(solid.code, 4);
  EXPECT_NE(solid.err.find("mass_error"), std::string::npos);
}

TEST_F(Tool, MendsWhatEverySlicerPrints) {
  Mesh loose = soup(read_mesh(folder_ / "egg.stl").mesh);
  Random random(1);
  for (auto& v : loose.vertices) v += random.in_box(1e-5);
  const int last = static_cast<int>(loose.vertices.size()) - 1;
  loose.triangles.emplace_back(last - 2, last, last - 4);  // a fin
  write_mesh(folder_ / "loose.obj", loose);
  for (const char* name : {"a.stl", "a.obj"}) {
    const Run made = run(std::string("float loose.obj --resolution 60 --report r.json -v -o ") + name);
    ASSERT_EQ(made.code, 0) << made.err;
    EXPECT_TRUE(mentions(made.out, {"note: First aid: ", "corners were joined with others at most"})) << made.out;
    const auto report = nlohmann::json::parse(text_of(folder_ / "r.json"));
    EXPECT_GT(report["input"]["first_aid"]["corners_joined"].get<int>(), 100);
    EXPECT_FALSE(report["input"]["first_aid"]["repaired"]);
    EXPECT_EQ(report["criteria"][1]["name"], "outer_unchanged");
    EXPECT_EQ(report["criteria"][1]["value"], 0.0);
    const auto at = made.out.find("rayrep verify ");
    ASSERT_NE(at, std::string::npos);
    const Run judged = run(made.out.substr(at + 7, made.out.find('\n', at) - at - 7));
    EXPECT_EQ(judged.code, 0) << judged.err;
    EXPECT_TRUE(mentions(judged.out, {"note: Of --original: First aid: "})) << judged.out;
  }
}

TEST_F(Tool, TellsWhatFirstAidDidToRegionsThatStaySolid) {
  Mesh post = box({-4, -4, -20}, {4, 4, 0});
  post.triangles.pop_back();
  write_mesh(folder_ / "post.stl", post);
  const Run made = run("float egg.stl --resolution 40 --keep-solid post.stl -o made.stl");
  EXPECT_EQ(made.code, 0) << made.err;
  EXPECT_TRUE(mentions(made.out, {"note: Of post.stl: First aid: 1 flat hole was closed"})) << made.out;
  const Run judged = run("verify made.stl --goal float --original egg.stl --keep-solid post.stl");
  EXPECT_TRUE(mentions(judged.out, {"note: Of post.stl: First aid"})) << judged.out << judged.err;
}

TEST_F(Tool, SuggestsTheWholeLineWhereAnOptionStoodAlone) {
  write_mesh(folder_ / "bar.stl", box({0, 0, 0}, {60, 24, 20}));
  const Run refused = run("float bar.stl --resolution 40 --wall 4 --self-supporting -o bar.3mf");
  EXPECT_EQ(refused.code, 4);
  EXPECT_TRUE(
      mentions(refused.err, {"float bar.stl --resolution 40 --wall 4 -o bar.3mf --self-supporting 0", "--print-direction x"}))
      << refused.err;
}

TEST_F(Tool, MakesOneOfBodiesThatOverlap) {
  const Mesh torso = icosphere(30, 3), head = icosphere(18, 3, {2, 3, 36});
  write_mesh(folder_ / "both.stl", merged({torso, head}));
  const Run made = run("float both.stl --resolution 60 --report r.json -v -o a.stl");
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_TRUE(mentions(made.out, {"note: First aid: 2 bodies overlap: taken as one"})) << made.out;
  EXPECT_FALSE(mentions(made.out, {"crosses or touches itself"})) << made.out;
  const auto report = nlohmann::json::parse(text_of(folder_ / "r.json"));
  EXPECT_EQ(report["input"]["first_aid"]["bodies_united"], 2);
  // Faces inside would have kept 1.2 mm of material on either side, and all of the lens between them.
  EXPECT_LT(report["after"]["volume_mm3"].get<double>(), 0.5 * report["before"]["volume_mm3"].get<double>());
  const Run judged = run("verify a.stl --original both.stl --waterline " + report["goal"]["waterline_mm"].dump());
  EXPECT_EQ(judged.code, 0) << judged.err;
  EXPECT_TRUE(mentions(judged.out, {"Of --original: First aid: 2 bodies overlap"})) << judged.out;
  // What was delivered with its bodies as they were is judged against them as they are.
  const Run same = run("verify both.stl --original both.stl");
  EXPECT_EQ(same.out.find("outer_unchanged"), std::string::npos) << same.out;
  EXPECT_EQ(same.err.find("outer_unchanged"), std::string::npos) << same.err;
}

TEST_F(Tool, RepairsOnRequest) {
  write_mesh(folder_ / "open.stl", opened_egg());
  const Run inspected = run("inspect open.stl");
  EXPECT_EQ(inspected.code, 3);
  EXPECT_TRUE(mentions(inspected.err, {"1 hole that is neither flat nor small", "--repair closes the surface by a guess"}))
      << inspected.err;
  const Run refused = run("float open.stl --resolution 60 --suggest -o a.stl");
  EXPECT_EQ(refused.code, 3);
  ASSERT_EQ(refused.out, "rayrep float open.stl --resolution 60 -o a.stl --repair\n");
  const Run made = run(refused.out.substr(7, refused.out.size() - 8) + " -v");
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_TRUE(mentions(made.out, {"Repair: 1 hole was closed by", "of the surface", "The volume has changed by"})) << made.out;
  const auto at = made.out.find("rayrep verify ");
  ASSERT_NE(at, std::string::npos);
  const std::string again = made.out.substr(at + 7, made.out.find('\n', at) - at - 7);
  EXPECT_TRUE(mentions(again, {"--repair", "--original open.stl"})) << again;
  EXPECT_EQ(run(again).code, 0) << again;
  EXPECT_EQ(run("inspect open.stl --repair").code, 0);
}

TEST_F(Tool, WritesTheSameBytesForAnyNumberOfThreads) {
  ASSERT_EQ(run("float egg.stl --resolution 60 --submerged 0.5 --threads 1 -o one.stl").code, 0);
  ASSERT_EQ(run("float egg.stl --resolution 60 --submerged 0.5 --threads 2 -o two.stl").code, 0);
  EXPECT_EQ(text_of(folder_ / "one.stl"), text_of(folder_ / "two.stl"));
}

TEST_F(Tool, WritesEveryFormat) {
  for (const char* name : {"a.stl", "a.obj", "a.ply", "a.3mf"}) {
    const Run result = run(std::string("float egg.stl --resolution 40 --submerged 0.5 -q -o ") + name);
    EXPECT_EQ(result.code, 0) << name << ": " << result.err;
    EXPECT_EQ(result.out, "");
    EXPECT_EQ(run(std::string("verify --submerged 0.5 --original egg.stl ") + name).code, 0) << name;
  }
}

TEST_F(Tool, UnitsSizeAndUp) {
  // The same egg in centimetres, lying on its side.
  write_mesh(
      folder_ / "cm.obj",
      scaled(rotated(uv_ellipsoid(30, 22, 16, 24), Eigen::AngleAxisd(-kPi / 2, Eigen::Vector3d::UnitX()).toRotationMatrix()), 0.1));
  const Run result = run("float cm.obj --unit cm --up y --resolution 60 --submerged 0.5 --report r.json");
  ASSERT_EQ(result.code, 0) << result.err;
  const auto report = nlohmann::json::parse(text_of(folder_ / "r.json"));
  EXPECT_NEAR(report["input"]["size_mm"][0].get<double>(), 60, 1e-6);
  EXPECT_NEAR(report["goal"]["waterline_mm"].get<double>(), 16, 1e-6);
  const Run sized = run("inspect cm.obj --size 120 --json");
  ASSERT_EQ(sized.code, 0) << sized.err;
  EXPECT_NEAR(nlohmann::json::parse(sized.out)["input"]["size_mm"][0].get<double>(), 120, 1e-9);
  EXPECT_EQ(run("float cm.obj --unit cm --up -y --resolution 60 --submerged 0.5 -o down.stl").code, 0);
}

TEST_F(Tool, InspectTellsMassProperties) {
  const Run result = run("inspect egg.stl --json --density 2");
  ASSERT_EQ(result.code, 0) << result.err;
  const auto report = nlohmann::json::parse(result.out);
  const MassProperties exact = mass_properties(mesh_moments(as_stored("x.stl", uv_ellipsoid(30, 22, 16, 24))), 2);
  EXPECT_NEAR(report["mass_properties"]["mass_g"].get<double>(), exact.mass_g, 1e-9 * exact.mass_g);
  for (std::size_t n = 0; n < 3; ++n)
    EXPECT_NEAR(report["mass_properties"]["principal_moments_g_mm2"][n].get<double>(),
                exact.principal_moments_g_mm2[static_cast<Eigen::Index>(n)],
                1e-9 * exact.principal_moments_g_mm2[static_cast<Eigen::Index>(n)]);
  const Run words = run("inspect egg.stl --material petg");
  EXPECT_EQ(words.code, 0);
  for (const char* word : {"volume", "surface area", "mass", "centre of mass", "inertia tensor", "principal moments"})
    EXPECT_NE(words.out.find(word), std::string::npos) << word;
}

TEST_F(Tool, UsageErrorsAre2) {
  for (const char* arguments : {"",
                                "swim egg.stl",
                                "float",
                                "float egg.stl --wall",
                                "float egg.stl --wall -1",
                                "float egg.stl --fluid zero",
                                "float egg.stl --resolution 10",
                                "float egg.stl --resolution 1001",
                                "float egg.stl --up 0,0,0",
                                "float egg.stl --up w",
                                "float egg.stl --unit furlong",
                                "float egg.stl --nonsense 3",
                                "float egg.stl --waterline 5 --submerged 0.5",
                                "float egg.stl --submerged 1.5",
                                "float egg.stl --submerged 101%",
                                "float egg.stl --submerged 0volume",
                                "float egg.stl --each --rigid",
                                "float egg.stl --each --suggest",
                                "verify egg.stl --each --original egg.stl",
                                "float egg.stl --material cheese",
                                "float egg.stl -o egg.xyz",
                                "float egg.stl -o egg.stl",
                                "float egg.stl --threads 0",
                                "float egg.stl extra.stl",
                                "float egg.stl --waterline 500"}) {
    const Run result = run(arguments);
    EXPECT_EQ(result.code, 2) << arguments << ": " << result.err;
    EXPECT_EQ(result.err.rfind("rayrep: ", 0), 0u) << result.err;
    EXPECT_EQ(result.out, "") << arguments;
    EXPECT_TRUE(new_files().empty()) << arguments;
  }
}

TEST_F(Tool, InputErrorsAre3) {
  const Mesh open = opened_egg();
  write_mesh(folder_ / "open.stl", open);
  std::ofstream(folder_ / "empty.stl");
  std::ofstream(folder_ / "words.obj") << "these are words\n";
  for (const char* command : {"float", "inspect", "verify"})
    for (const char* name : {"missing.stl", "open.stl", "empty.stl", "words.obj", "."}) {
      const Run result = run(std::string(command) + " " + name);
      EXPECT_EQ(result.code, 3) << command << " " << name << ": " << result.err;
      EXPECT_NE(result.err.find(name), std::string::npos) << result.err;
    }
  EXPECT_NE(run("inspect open.stl").out.find("open edges"), std::string::npos);
  EXPECT_EQ(run("verify open.stl --goal spin --point com").code, 3);
  // What needs no solid is judged all the same.
  const Run judged = run("verify open.stl --goal yoyo");
  EXPECT_EQ(judged.code, 4);
  EXPECT_NE(judged.err.find("(closed"), std::string::npos) << judged.err;
}

TEST_F(Tool, UnreachableGoalsAre4AndLeaveTheOldFileAlone) {
  std::ofstream(folder_ / "egg_float.stl") << "old";
  const Run result = run("float egg.stl --waterline 3 --resolution 60");
  EXPECT_EQ(result.code, 4);
  EXPECT_NE(result.err.find("The shell alone weighs"), std::string::npos) << result.err;
  EXPECT_EQ(text_of(folder_ / "egg_float.stl"), "old");
  EXPECT_EQ(new_files(), std::vector<std::string>{"egg_float.stl"});
}

TEST_F(Tool, SpinsAndVerifies) {
  const Mesh tilted = rotated(uv_ellipsoid(30, 22, 16, 24), Eigen::AngleAxisd(0.26, Eigen::Vector3d::UnitX()).toRotationMatrix());
  write_mesh(folder_ / "egg.stl", tilted);
  const Run result = run("spin egg.stl --point com --resolution 40 --report r.json");
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_NE(result.out.find("VERIFIED: wrote egg_spin.stl"), std::string::npos) << result.out;
  EXPECT_EQ(result.err, "");
  EXPECT_EQ(new_files(), (std::vector<std::string>{"egg_spin.stl", "r.json"}));

  const auto report = nlohmann::json::parse(text_of(folder_ / "r.json"));
  EXPECT_EQ(report["command"], "spin");
  EXPECT_TRUE(report["pass"]);
  EXPECT_EQ(report["goal"]["name"], "spin");
  EXPECT_EQ(report["goal"]["prefer"], "largest");
  EXPECT_EQ(report["goal"]["contact_mm"].size(), 3u);
  for (const char* when : {"before", "after"}) {
    for (const char* key : {"mass_g", "offset_mm", "height_mm", "axis_angle_rad", "axis_class", "ratio_to_larger_lateral",
                            "ratio_to_smaller_lateral", "stable_sliding", "stable_fixed"})
      EXPECT_TRUE(report[when].contains(key)) << when << " " << key;
    EXPECT_EQ(report[when]["axis_class"], "largest") << when;
  }
  ASSERT_EQ(report["after"]["stable_sliding"].size(), 1u);
  EXPECT_GT(report["after"]["stable_sliding"][0]["from_rpm"].get<double>(), 0);
  EXPECT_GT(report["after"]["ratio_to_larger_lateral"].get<double>(), report["before"]["ratio_to_larger_lateral"].get<double>());
  EXPECT_LT(report["after"]["axis_angle_rad"].get<double>(), 1e-3);
  EXPECT_GT(report["before"]["axis_angle_rad"].get<double>(), 0.1);
  for (const auto& c : report["criteria"]) EXPECT_TRUE(c["pass"]) << c["name"];
}

TEST_F(Tool, SpinsAYoyoQuietly) {
  const Run result = run("spin egg.stl --yoyo --axle none --center 0.5,0,0 --resolution 40 -q -o yoyo.ply --report r.json");
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(result.out, "");
  const auto report = nlohmann::json::parse(text_of(folder_ / "r.json"));
  EXPECT_EQ(report["goal"]["name"], "yo-yo");
  EXPECT_EQ(report["goal"]["centre_mm"][0], 0.5);
  const Mesh delivered = read_mesh(folder_ / "yoyo.ply").mesh;
  EXPECT_TRUE(near(mass_properties(mesh_moments(delivered), 1).centre_of_mass_mm, Eigen::Vector3d(0.5, 0, 0), 0.005));
  EXPECT_EQ(run("verify yoyo.ply --goal yoyo --center 0.5,0,0 --original egg.stl").code, 0);
}

TEST_F(Tool, AYoyoIsInTwoHalvesUnlessItIsToBeOnePiece) {
  write_mesh(folder_ / "puck.stl", uv_ellipsoid(30, 29, 20, 24));
  const Run made = run("spin puck.stl --yoyo --resolution 40 -v");
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_TRUE(mentions(made.out, {"half 1", "half 2", "an M4 rod", "20.0 mm long", "wrote puck_spin.3mf"}));
  const std::string again = made.out.substr(made.out.find("verify puck_spin.3mf"));
  const Run judged = run(again.substr(0, again.find('\n')));
  EXPECT_EQ(judged.code, 0) << judged.err;
  EXPECT_TRUE(mentions(judged.out, {"half 1", "an M4 rod", "change of the outer surface"}));
  // Its steel tells the axle; with another one the judge holds it to the rest of the outside.
  const Run untold = run("verify puck_spin.3mf --goal yoyo --original puck.stl");
  EXPECT_EQ(untold.code, 0) << untold.err;
  EXPECT_TRUE(mentions(untold.out, {"an M4 rod", "4.0 mm apart"}));
  const Run strict = run("verify puck_spin.3mf --goal yoyo --axle 8mm --gap 4 --original puck.stl");
  EXPECT_EQ(strict.code, 4);
  EXPECT_NE(strict.err.find("outer_unchanged"), std::string::npos);
  EXPECT_TRUE(mentions(judged.out, {"2 cavities stay closed"}));
  const Run halves = run("spin puck.stl --yoyo --resolution 40 -o p.stl --report r.json");
  EXPECT_TRUE(mentions(halves.out, {"wrote p.3mf", "p_1.stl and", "p_2.stl"})) << halves.err;
  const auto report = nlohmann::json::parse(text_of(folder_ / "r.json"));
  EXPECT_EQ(report["goal"]["axle"], "m4");
  EXPECT_EQ(report["goal"]["gap_mm"], 4);
  EXPECT_EQ(run("spin puck.stl --yoyo --axle none --resolution 40 -o p.stl").code, 0);
}

TEST_F(Tool, PiecesAreWrittenJudgedAndSeenPutTogether) {
  const Run made = run("float egg.stl --submerged 0.5 --cut auto --wall 2 --resolution 40 -v --report r.json");
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_TRUE(mentions(made.out, {"2 pieces", "piece 1", "wrote egg_float.3mf", "ok     cavities that no cut opens"}));
  const auto report = nlohmann::json::parse(text_of(folder_ / "r.json"));
  EXPECT_EQ(report["after"]["pieces"].size(), 2u);
  const std::string again = made.out.substr(made.out.find("verify egg_float.3mf"));
  EXPECT_EQ(run(again.substr(0, again.find('\n'))).code, 0);
  EXPECT_NE(run("inspect egg_float.3mf").out.find("2 pieces are taken as they are when put together"), std::string::npos);
  // Where one file cannot hold both: each as it lies on its cut.
  const Run flat = run("float egg.stl --submerged 0.5 --cut auto --wall 2 --resolution 40 -o p.stl --report r.json");
  ASSERT_EQ(flat.code, 0) << flat.err;
  EXPECT_FALSE(fs::exists(folder_ / "p.stl"));
  const auto told = nlohmann::json::parse(text_of(folder_ / "r.json"));
  ASSERT_EQ(told["pieces"], nlohmann::json({"p_1.stl", "p_2.stl"}));
  for (std::size_t n = 0; n < 2; ++n) {
    const Mesh piece = read_mesh(folder_ / told["pieces"][n].get<std::string>()).mesh;
    EXPECT_TRUE(is_closed_solid(with_merged_vertices(piece)));
    const auto& known = told["after"]["pieces"][n];
    EXPECT_NEAR(mesh_moments(piece)[M1], known["volume_mm3"], 1e-5 * known["volume_mm3"].get<double>());
    EXPECT_NEAR(bounding_box(piece).min().z(), 0, 1e-5);
    EXPECT_NEAR(bounding_box(piece).sizes().z(), known["size_z_mm"], 1e-4);
  }
  // Of the third piece and more nobody knows before they are made.
  fs::copy_file(folder_ / "egg.stl", folder_ / "q_3.stl");
  const Run four = run("float q_3.stl --submerged 0.5 --cut 'z=0;x=1' --wall 2 --resolution 40 -o q.stl");
  EXPECT_EQ(four.code, 2) << four.err;
  EXPECT_TRUE(mentions(four.err, {"'q_3.stl' is the input itself"})) << four.err;
  EXPECT_EQ(text_of(folder_ / "q_3.stl"), text_of(folder_ / "egg.stl"));
  for (const char* name : {"q.3mf", "q_1.stl", "q_2.stl"}) EXPECT_FALSE(fs::exists(folder_ / name)) << name;
  EXPECT_TRUE(mentions(run("float egg.stl --cut sideways").err, {"--cut takes auto, none"}));
  EXPECT_TRUE(mentions(run("float egg.stl --submerged 0.5 --cut z=500 --resolution 40").err, {"does not meet the body"}));
  EXPECT_TRUE(mentions(run("float egg.stl --cut auto --infill 15").err, {"--cut"}));
}

TEST_F(Tool, PosesAreMadeAndJudgedAgain) {
  write_mesh(folder_ / "block.obj", box({0, 0, 0}, {40, 30, 24}));
  const Run made =
      run("pose block.obj --stand z --stand 0,-1,0 --hang 20,15,30 --hang '10,15,12:0,0,1' --resolution 30 -v --report pose.json");
  ASSERT_EQ(made.code, 4) << made.out;  // two points, one vertical
  EXPECT_TRUE(mentions(made.err, {"contradict", "10.00 mm beside each other", "Without hanging from (10, 15, 12)"})) << made.err;
  const Run good = run("pose block.obj --stand z --stand 0,-1,0 --hang 20,15.5,30 --resolution 30 -v --report pose.json");
  ASSERT_EQ(good.code, 0) << good.err;
  EXPECT_TRUE(
      mentions(good.out, {"Pose 1, standing with z up: it stands", "Pose 3, hanging from (20, 15.5, 30) mm with z up: it hangs"}))
      << good.out;
  const std::string before = "\nto judge it again: rayrep ";
  const std::size_t at = good.out.find(before);
  ASSERT_NE(at, std::string::npos) << good.out;
  const std::string line = good.out.substr(at + before.size(), good.out.find('\n', at + 1) - at - before.size());
  EXPECT_TRUE(mentions(line, {"--goal pose", "--stand 'z;-y'", "--hang 20,15.5,30"})) << line;
  const Run judged = run(line + " --report verify.json");
  ASSERT_EQ(judged.code, 0) << line << "\n" << judged.err;
  const auto pose = nlohmann::json::parse(text_of(folder_ / "pose.json"));
  const auto verify = nlohmann::json::parse(text_of(folder_ / "verify.json"));
  EXPECT_EQ(verify["goal"]["poses"].size(), 3u);
  ASSERT_EQ(verify["criteria"].size(), pose["criteria"].size());
  for (const char* key : {"mass_g", "smallest_tipping_angle_rad", "pose_3_below_mm"})
    EXPECT_NEAR(verify["after"][key].get<double>(), pose["after"][key].get<double>(), 1e-6 * pose["after"][key].get<double>())
        << key;
  EXPECT_EQ(run("verify block_pose.stl --goal stand --stand z").code, 2);
  EXPECT_EQ(run("pose block.obj").code, 2);
  EXPECT_EQ(run("pose block.obj --hang 1,2").code, 2);
}

TEST_F(Tool, DiceAreMadeAndJudgedAgain) {
  write_mesh(folder_ / "cube.obj", box({0, 0, 0}, {20, 20, 20}));
  const Run made = run("dice cube.obj --load z --resolution 30 -v --report dice.json");
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_TRUE(mentions(made.out, {"It is loaded: thrown, it comes to rest with (0, 0, 1) up in", "(solid in 16.67 %)",
                                  "share of throws, up: (0, 0, -1) ", " 0.1667 ", "Real throws bounce"}))
      << made.out;
  const std::string before = "\nto judge it again: rayrep ";
  const std::size_t at = made.out.find(before);
  ASSERT_NE(at, std::string::npos) << made.out;
  const std::string line = made.out.substr(at + before.size(), made.out.find('\n', at + 1) - at - before.size());
  EXPECT_TRUE(mentions(line, {"--goal dice", "--load 'z:0."})) << line;
  const Run judged = run(line + " --report verify.json");
  ASSERT_EQ(judged.code, 0) << line << "\n" << judged.err;
  const auto dice = nlohmann::json::parse(text_of(folder_ / "dice.json"));
  const auto verify = nlohmann::json::parse(text_of(folder_ / "verify.json"));
  for (const char* state : {"before", "after"}) {
    double sum = 0;
    ASSERT_EQ(dice[state]["faces"].size(), 6u);
    for (const auto& face : dice[state]["faces"]) sum += face["share"].get<double>();
    EXPECT_NEAR(sum, 1, 1e-9);
  }
  EXPECT_NEAR(verify["after"]["load_share"].get<double>(), dice["after"]["load_share"].get<double>(), 1e-9);
  EXPECT_NEAR(dice["before"]["load_share"].get<double>(), 1.0 / 6, 1e-9);
  EXPECT_EQ(verify["goal"]["load_up"][2], 1);
  write_mesh(folder_ / "brick.obj", box({0, 0, 0}, {20, 20, 24}));
  const Run unfair = run("dice brick.obj --resolution 30 --no-advice");
  EXPECT_EQ(unfair.code, 4);
  EXPECT_TRUE(mentions(unfair.err, {"It cannot fall fairly", "times as often", "That is its shape"})) << unfair.err;
  EXPECT_EQ(run("dice cube.obj --load z:1.5").code, 2);
  EXPECT_EQ(run("dice cube.obj --faces 1").code, 2);
  EXPECT_EQ(run("dice cube.obj --faces 6 --load z").code, 2);
}

TEST_F(Tool, ATopAmongPosesIsMadeAndJudgedAgain) {
  write_mesh(folder_ / "block.obj", box({0, 0, 0}, {40, 36, 18}));
  const Run made = run("pose block.obj --spin z --stand z --stand x --resolution 30 -v --report pose.json");
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_TRUE(mentions(made.out, {"spinning on (20, 18, 0) mm with z up: it spins as a top", "is a better top than",
                                  "of the global optimum (proven"}))
      << made.out;
  const std::string before = "\nto judge it again: rayrep ";
  const std::size_t at = made.out.find(before);
  ASSERT_NE(at, std::string::npos) << made.out;
  const std::string line = made.out.substr(at + before.size(), made.out.find('\n', at + 1) - at - before.size());
  EXPECT_TRUE(mentions(line, {"--spin 'z:20,18,0'", "--stand 'z;x'", "--min-tip 3"})) << line;
  EXPECT_EQ(run(line).code, 0) << line;
  EXPECT_EQ(run("pose block.obj --spin z").code, 2);
  EXPECT_EQ(run("pose block.obj --spin z:1,2,3,4 --stand z").code, 2);
}

TEST_F(Tool, ASpecFileSaysWhatTheCommandLineDoes) {
  fs::create_directories(folder_ / "there");
  write_mesh(folder_ / "there" / "block.obj", box({0, 0, 0}, {40, 30, 24}));
  const auto write = [&](const std::string& text) { std::ofstream(folder_ / "there" / "spec.json") << text; };
  const auto result_of = [&](const std::string& arguments) {
    const Run made = run(arguments + " -o out.stl --report r.json -q");
    EXPECT_EQ(made.code, 0) << arguments << ": " << made.err;
    return text_of(folder_ / "out.stl");
  };
  const std::string by_words =
      result_of("pose there/block.obj --stand z --stand 0,-1,0 --hang 20,15.5,30:z --resolution 30 --wall 2");
  write(R"({ "mesh": "block.obj",
  "stand": ["z", [0, -1, 0]], "hang": "20,15.5,30:z",
  "resolution": 30, "wall": 2.0, "suggest": false })");
  EXPECT_EQ(result_of("pose there/spec.json"), by_words);
  EXPECT_EQ(result_of("pose there/block.obj --config there/spec.json"), by_words);
  // The command line goes before: a list as a whole, and the same thing in other words.
  EXPECT_EQ(result_of("pose there/spec.json --wall 3"),
            result_of("pose there/block.obj --stand z --stand 0,-1,0 --hang 20,15.5,30:z --resolution 30 --wall 3"));
  EXPECT_EQ(result_of("pose there/spec.json --stand x"),
            result_of("pose there/block.obj --stand x --hang 20,15.5,30:z --resolution 30 --wall 2"));
  write(R"({ "mesh": "block.obj", "resolution": 30, "submerged": "60%", "density": 0.9, "rigid": true })");
  EXPECT_EQ(result_of("float there/spec.json --waterline 12"),
            result_of("float there/block.obj --resolution 30 --density 0.9 --waterline 12"));
  write(R"({ "mesh": "block.obj", "resolution": 30, "com": [20, 15, null], "at-least": { "mass": 20, "com_z": 9 } })");
  EXPECT_EQ(result_of("target there/spec.json"),
            result_of("target there/block.obj --resolution 30 --com 20,15,- --at-least mass=20,com_z=9"));
  // What is said once can be said again.
  const std::string said = "pose there/block.obj --stand z --stand 0,-1,0 --hang 20,15.5,30:z --resolution 30 --wall 2";
  EXPECT_EQ(result_of(said + " --save-config there/saved.json"), by_words);
  EXPECT_EQ(nlohmann::json::parse(text_of(folder_ / "there" / "saved.json"))["mesh"], "block.obj");
  EXPECT_EQ(result_of("pose there/saved.json"), by_words);
  // Any command has it.
  write(R"({ "mesh": "block.obj", "density": 2 })");
  EXPECT_EQ(run("inspect there/spec.json").out, run("inspect there/block.obj --density 2").out);
  write(R"({ "mesh": "block.obj", "goal": "stand", "original": "block.obj" })");
  EXPECT_EQ(run("verify there/spec.json").out, run("verify there/block.obj --goal stand --original there/block.obj").out);
}

TEST_F(Tool, JsonStandsAloneOnStandardOutput) {
  const Run made = run("float egg.stl --resolution 30 --json --report r.json");
  ASSERT_EQ(made.code, 0) << made.err;
  auto printed = nlohmann::json::parse(made.out);
  auto written = nlohmann::json::parse(text_of(folder_ / "r.json"));
  EXPECT_EQ(printed, written);
  EXPECT_TRUE(printed["pass"].get<bool>());
  const Run failed = run("verify egg.stl --goal float --density 0.5 --waterline 3 --json");
  EXPECT_EQ(failed.code, 4);
  EXPECT_FALSE(nlohmann::json::parse(failed.out)["pass"].get<bool>());
  EXPECT_EQ(run("float egg.stl --each --json").code, 2);
}

TEST_F(Tool, ASpecFileIsToldWhereItIsWrong) {
  const auto told = [&](const std::string& text, const std::string& arguments = "") {
    std::ofstream(folder_ / "spec.json") << text;
    const Run refused = run("pose egg.stl --config spec.json --resolution 30 " + arguments);
    EXPECT_EQ(refused.code, 2) << text;
    return refused.err;
  };
  EXPECT_TRUE(mentions(told("{ \"stand\": \"z\",\n\n \"wal\": 2 }"), {"spec.json, line 3: ", "'wal'", "Did you mean wall?"}));
  EXPECT_TRUE(mentions(told("{ \"stand\": \"z\",\n \"wall\": true }"), {"spec.json, line 2: wall takes MM", "it is true"}));
  EXPECT_TRUE(mentions(told("{ \"stand\": \"z\",\n \"rigid\": 1 }"), {"spec.json, line 2: rigid is a switch", "it is 1"}));
  EXPECT_TRUE(mentions(told("{\n\"wall\": -1, \"stand\": \"z\" }"), {"spec.json, line 2: --wall must be a positive number"}));
  EXPECT_TRUE(mentions(told("{\n\"stand\":\n[ \"up\" ] }"), {"spec.json, line 2: What points up in --stand", "it is 'up'"}));
  EXPECT_TRUE(mentions(told("{ \"stand\": \"z\",\n\"stand\": \"x\" }"), {"stand is there twice"}));
  EXPECT_TRUE(mentions(told("{ \"stand\": \"z\",\n \"wall\": }"), {"spec.json, line 2, column"}));
  EXPECT_TRUE(mentions(told("[ 1 ]"), {"no object of settings"}));
  EXPECT_TRUE(mentions(told("{ \"stand\": \"z\",\n \"material\": \"pls\" }"), {"spec.json, line 2: There is no material 'pls'"}));
  EXPECT_TRUE(
      mentions(told("{ \"stand\": \"z\",\n \"spin\": \"z:foo\" }"), {"spec.json, line 2: The point of --spin is lowest, com"}));
  EXPECT_TRUE(mentions(told(""), {"spec.json, line 1, column 1"}));
  EXPECT_TRUE(mentions(told("{ \"stand\": [[[1]]] }"), {"line 1: stand takes UP"}));
  EXPECT_TRUE(mentions(told("{ \"target\": \"1,2,3\" }"), {"there is no setting 'target' of this command"}));
  // What the command line says is not the file's fault.
  const std::string own = told("{ \"wall\": -1, \"stand\": \"z\" }", "--wall -2");
  EXPECT_EQ(own.find("spec.json"), std::string::npos) << own;
  EXPECT_TRUE(mentions(run("pose missing.json").err, {"Cannot read 'missing.json'"}));
  std::ofstream(folder_ / "spec.json") << "{ \"stand\": \"z\" }";
  EXPECT_TRUE(mentions(run("pose spec.json").err, {"Name the mesh", "\"mesh\""}));
  EXPECT_TRUE(mentions(run("pose egg.stl --config spec.json --report spec.json").err, {"would overwrite what is read"}));
}

TEST_F(Tool, SpinTellsHowToVerifyIt) {
  const Mesh tilted = rotated(uv_ellipsoid(30, 22, 16, 24), Eigen::AngleAxisd(0.26, Eigen::Vector3d::UnitX()).toRotationMatrix());
  write_mesh(folder_ / "the egg.obj", tilted);
  const Run made =
      run("spin 'the egg.obj' --size 30 --point com --density 1.1 --resolution 30 -v --report spin.json -o 'an egg.stl'");
  ASSERT_EQ(made.code, 0) << made.err;
  const std::string before = "\nto judge it again: rayrep ";
  const std::size_t at = made.out.find(before);
  ASSERT_NE(at, std::string::npos) << made.out;
  const std::string line = made.out.substr(at + before.size(), made.out.find('\n', at + 1) - at - before.size());
  EXPECT_NE(line.find(" --original 'the egg.obj'"), std::string::npos) << line;

  const auto spin = nlohmann::json::parse(text_of(folder_ / "spin.json"));
  const Run judged = run(line + " --report verify.json");
  ASSERT_EQ(judged.code, 0) << line << "\n" << judged.err;
  EXPECT_NE(judged.out.find("VERIFIED"), std::string::npos) << judged.out;
  const auto verify = nlohmann::json::parse(text_of(folder_ / "verify.json"));
  EXPECT_EQ(verify["command"], "verify");
  EXPECT_EQ(verify["options"]["goal"], "spin");
  EXPECT_EQ(verify["goal"]["name"], "spin");
  for (const char* key : {"solver", "model", "output"}) EXPECT_FALSE(verify.contains(key)) << key;
  ASSERT_EQ(verify["criteria"].size(), spin["criteria"].size());
  for (const char* key : {"mass_g", "height_mm", "ratio_to_larger_lateral", "ratio_to_smaller_lateral"})
    EXPECT_NEAR(verify["after"][key].get<double>(), spin["after"][key].get<double>(), 1e-6 * spin["after"][key].get<double>())
        << key;

  // By the same rules, the contact points of the solid are found again on what was hollowed.
  const auto contact = [&](const std::string& arguments, int code) {
    const Run result = run("verify 'an egg.stl' --goal spin --report again.json -q " + arguments);
    EXPECT_EQ(result.code, code) << arguments << ": " << result.err;
    return nlohmann::json::parse(text_of(folder_ / "again.json"))["goal"]["contact_mm"].get<std::vector<double>>();
  };
  const auto wanted = spin["goal"]["contact_mm"].get<std::vector<double>>();
  for (const char* arguments : {"--point com", "--point com --size 30 --original 'the egg.obj'", "--point 0,0"}) {
    const auto found = contact(arguments, 0);
    for (std::size_t n = 0; n < 3; ++n) EXPECT_NEAR(found[n], wanted[n], 1e-4) << arguments;
  }
  const std::vector<double> lowest = contact("--point lowest", 4);
  EXPECT_LT(lowest[2], wanted[2] - 0.1);
  EXPECT_EQ(run("verify 'an egg.stl' --goal spin --point 0,0 --prefer smallest").code, 4);
}

TEST_F(Tool, AMiddleAxisIs4WithTheReason) {
  write_mesh(folder_ / "box.stl", box({0, 0, 0}, {40, 20, 30}));
  const Run middle = run("verify box.stl --goal spin --report r.json");
  EXPECT_EQ(middle.code, 4);
  EXPECT_NE(middle.err.find("axis_class"), std::string::npos) << middle.err;
  EXPECT_NE(middle.err.find("the middle one of the three principal axes"), std::string::npos) << middle.err;
  const auto report = nlohmann::json::parse(text_of(folder_ / "r.json"));
  EXPECT_FALSE(report["pass"]);
  EXPECT_EQ(report["after"]["axis_class"], "middle");
  // 20 x 30 across the axis, along y: the largest.
  EXPECT_EQ(run("verify box.stl --goal spin --up y").code, 0);
  EXPECT_EQ(run("verify box.stl --goal spin --up x --prefer smallest").code, 0);
  EXPECT_EQ(run("verify box.stl --goal yoyo").code, 4);
  EXPECT_EQ(run("verify box.stl --goal yoyo --up y").code, 0);
  const Run along = run("verify box.stl --goal yoyo --up y --center 20,10.5,15");
  EXPECT_EQ(along.code, 4);
  EXPECT_NE(along.err.find("(centre)"), std::string::npos) << along.err;
}

TEST_F(Tool, StandsAndVerifies) {
  write_mesh(folder_ / "box.stl", box({0, 0, 0}, {20, 10, 15}));
  const Run solid = run("verify box.stl --goal stand --report r.json");
  ASSERT_EQ(solid.code, 0) << solid.err;
  EXPECT_EQ(solid.out.find("target"), std::string::npos) << solid.out;
  auto report = nlohmann::json::parse(text_of(folder_ / "r.json"));
  EXPECT_EQ(report["goal"]["name"], "stand");
  EXPECT_TRUE(report["goal"]["target_mm"].is_null());
  EXPECT_NEAR(report["after"]["smallest_tipping_angle_rad"].get<double>(), std::atan2(5, 7.5), 1e-9);
  for (const char* key : {"solver", "model", "output"}) EXPECT_FALSE(report.contains(key)) << key;
  EXPECT_EQ(run("verify box.stl --goal stand --target 10,5,99").code, 0);
  const Run aside = run("verify box.stl --goal stand --target 9,5,0");
  EXPECT_EQ(aside.code, 4);
  EXPECT_NE(aside.err.find("(offset)"), std::string::npos) << aside.err;

  const Run made = run("stand box.stl --target 9,5,0 --resolution 30 --report r.json");
  ASSERT_EQ(made.code, 0) << made.err;
  report = nlohmann::json::parse(text_of(folder_ / "r.json"));
  EXPECT_TRUE(report.contains("solver"));
  EXPECT_NEAR(report["goal"]["target_mm"][0].get<double>(), 9, 1e-9);
  EXPECT_LT(report["after"]["height_mm"].get<double>(), 7);
  EXPECT_EQ(run("verify box_stand.stl --goal stand --target 9,5,0 --original box.stl").code, 0);
  EXPECT_EQ(run("verify box_stand.stl --goal stand --target 10,5,0 --original box.stl").code, 4);
  // --point com is below the middle of the box, not of what is left of it.
  for (const char* original : {"", " --original box.stl"}) {
    EXPECT_EQ(run(std::string("verify box_stand.stl --goal spin --point com --report r.json") + original).code, 4);
    report = nlohmann::json::parse(text_of(folder_ / "r.json"));
    EXPECT_NEAR(report["goal"]["contact_mm"][0].get<double>(), 10, 1e-6) << original;
    EXPECT_NEAR(report["after"]["offset_mm"].get<double>(), 1, 0.01) << original;
  }
}

TEST_F(Tool, MeetsTargetsAndWritesThemForSimulators) {
  const Run made =
      run("target egg.stl --wall 2 --resolution 40 --mass 40 --com 0,0,-1 --inertia -,-,12000 --minimise ixx --report r.json"
          " --urdf egg.urdf --mjcf egg.xml");
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_NE(made.out.find("VERIFIED: wrote egg_target.stl"), std::string::npos) << made.out;
  EXPECT_EQ(new_files(), (std::vector<std::string>{"egg.urdf", "egg.xml", "egg_target.stl", "r.json"}));
  const auto report = nlohmann::json::parse(text_of(folder_ / "r.json"));
  EXPECT_EQ(report["command"], "target");
  EXPECT_EQ(report["goal"]["wanted"],
            (nlohmann::json{{"mass", 40.0}, {"com_x", 0.0}, {"com_y", 0.0}, {"com_z", -1.0}, {"izz", 12000.0}}));
  EXPECT_EQ(report["criteria"].size(), 10u);
  EXPECT_NEAR(report["after"]["mass_g"].get<double>(), 40, 1e-3);
  EXPECT_LT(report["after"]["deviations"]["izz"].get<double>(), 1e-4);
  EXPECT_EQ(report["solver"]["first"]["number"], "ixx");
  EXPECT_GE(report["solver"]["first"]["value"].get<double>(), report["solver"]["first"]["bound"].get<double>() * (1 - 1e-9));

  // The files hold the numbers of the mesh that was written, in kg and m; so do the report and inspect.
  const MassProperties body = mass_properties(mesh_moments(read_mesh(folder_ / "egg_target.stl").mesh), 1.24);
  EXPECT_NEAR(body.mass_g, 40, 1e-3);
  pugi::xml_document urdf;
  ASSERT_TRUE(urdf.load_file((folder_ / "egg.urdf").c_str()));
  const pugi::xml_node inertial = urdf.child("inertial");
  EXPECT_NEAR(inertial.child("mass").attribute("value").as_double(), 1e-3 * body.mass_g, 1e-8);
  EXPECT_NEAR(inertial.child("inertia").attribute("izz").as_double(), 1e-9 * body.inertia_g_mm2(2, 2), 1e-12);
  EXPECT_NEAR(inertial.child("inertia").attribute("iyz").as_double(), 1e-9 * body.inertia_g_mm2(1, 2), 1e-12);
  EXPECT_EQ(report["inertial"]["urdf"].get<std::string>(), text_of(folder_ / "egg.urdf"));
  EXPECT_EQ(report["inertial"]["mjcf"].get<std::string>(), text_of(folder_ / "egg.xml"));
  ASSERT_EQ(run("inspect egg_target.stl -q --urdf again.urdf").code, 0);
  ASSERT_TRUE(urdf.load_file((folder_ / "again.urdf").c_str()));
  EXPECT_NEAR(urdf.child("inertial").child("mass").attribute("value").as_double(), 1e-3 * body.mass_g, 1e-8);

  const std::string wanted = " --goal target --mass 40 --com 0,0,-1 --inertia -,-,12000 --wall 2 --original egg.stl";
  const Run judged = run("verify egg_target.stl" + wanted);
  EXPECT_EQ(judged.code, 0) << judged.err;
  const Run other = run("verify egg_target.stl --goal target --mass 41 --com -,-,0.5");
  EXPECT_EQ(other.code, 4);
  EXPECT_NE(other.err.find("(mass, com_z)"), std::string::npos) << other.err;
}

TEST_F(Tool, UnreachableTargetsAre4AndTellHowNearTheyCome) {
  const Run result = run("target egg.stl --resolution 40 --wall 2 --mass 40 --com -,-,-9 --urdf egg.urdf");
  EXPECT_EQ(result.code, 4);
  for (const char* words :
       {"cannot be met together", "The nearest any interior comes (least squares of mass, static moments and inertia) is: mass",
        "instead of -9 mm", "without com_z"})
    EXPECT_NE(result.err.find(words), std::string::npos) << result.err;
  EXPECT_TRUE(new_files().empty());
}

TEST_F(Tool, TargetUsageErrorsAre2) {
  const std::pair<const char*, const char*> cases[] = {
      {"", "Say which numbers are wanted"},
      {"--mass 0", "--mass must be a positive number"},
      {"--com 1,2", "--com takes X,Y,Z"},
      {"--com -,-,-", "Say which numbers are wanted"},
      {"--com 1,2,x", "--com does not take"},
      {"--inertia 1,2,3,4", "--inertia takes"},
      {"--inertia 1,1,1", "Inertia targets need the centre of mass"},
      {"--com 0,0,0 --inertia 1,1,5", "No body has this inertia"},
      {"--mass 30 --minimise weight", "--minimise takes"},
      {"--com 0,0,- --minimise com_z", "--mass"},
      {"--mass 30 --solver rays", "unrecognised option '--solver'"},
      {"--mass 30 --urdf egg.stl", "would overwrite a mesh"},
      {"--mass 30 --urdf a --mjcf a", "name the same file"},
  };
  for (const auto& [arguments, message] : cases) {
    const Run result = run(std::string("target egg.stl --resolution 40 ") + arguments);
    EXPECT_EQ(result.code, 2) << arguments << ": " << result.err;
    EXPECT_NE(result.err.find(message), std::string::npos) << arguments << ": " << result.err;
    EXPECT_TRUE(new_files().empty()) << arguments;
  }
}

TEST_F(Tool, SolversAreChosenAndTold) {
  const auto solver_of = [&](const std::string& arguments) {
    const Run result = run(arguments + " --resolution 20 --wall 4 -o a.stl --report r.json");
    // At this resolution a mesh from voxels may miss the mass by more than the judge allows.
    EXPECT_TRUE(result.code == 0 || result.code == 4) << arguments << ": " << result.err;
    const auto report = nlohmann::json::parse(text_of(folder_ / "r.json"));
    return report["options"]["solver"].get<std::string>() + ": " + report["solver"]["name"].get<std::string>();
  };
  EXPECT_EQ(solver_of("float egg.stl --submerged 0.6"), "quadric: quadric");
  EXPECT_EQ(solver_of("float egg.stl --submerged 0.6 --solver rays"), "rays: rays (Ipopt)");
  EXPECT_EQ(solver_of("float egg.stl --submerged 0.6 --solver voxels"), "voxels: voxels (Ipopt)");
  EXPECT_EQ(solver_of("float egg.stl --submerged 0.6 --solver octree"), "octree: octree (Ipopt)");
  EXPECT_EQ(solver_of("spin egg.stl"), "quadric: quadric");
  EXPECT_EQ(solver_of("spin egg.stl --bounds paper"), "rays: rays (Ipopt)");
  const Run refused = run("spin egg.stl --bounds paper --solver quadric");
  EXPECT_EQ(refused.code, 2);
  EXPECT_NE(refused.err.find("--bounds paper belongs to --solver rays"), std::string::npos) << refused.err;
  EXPECT_EQ(run("stand egg.stl --solver magic").code, 2);
}

TEST_F(Tool, WhatCannotStandIs4WithTheReason) {
  const Run egg = run("verify egg.stl --goal stand");
  EXPECT_EQ(egg.code, 4);
  EXPECT_NE(egg.err.find("touches the ground only in a point"), std::string::npos) << egg.err;
  // A foot at one end, half a millimetre lower than the rest.
  Mesh foot = box({0, 0, 0}, {10, 10, 20});
  append(foot, box({5, 0, 0.5}, {40, 10, 20}));
  write_mesh(folder_ / "foot.stl", foot);
  const Run tips = run("verify foot.stl --goal stand");
  EXPECT_EQ(tips.code, 4);
  EXPECT_NE(tips.err.find("(inside)"), std::string::npos) << tips.err;
  EXPECT_EQ(run("verify foot.stl --goal stand --contact 1").code, 0);
}

TEST_F(Tool, VerifyRefusesOptionsOfOtherGoals) {
  const std::pair<const char*, const char*> cases[] = {{"--goal spin --waterline 5", "--waterline belongs to --goal float"},
                                                       {"--goal yoyo --submerged 0.5", "--submerged belongs to --goal float"},
                                                       {"--goal stand --fluid 1", "--fluid belongs to --goal float"},
                                                       {"--point com", "--point belongs to --goal spin; this is --goal float"},
                                                       {"--goal yoyo --point lowest", "--point belongs to --goal spin"},
                                                       {"--goal spin --center 0,0,0", "--center belongs to --goal yoyo"},
                                                       {"--goal stand --prefer largest", "--prefer belongs to --goal spin or yoyo"},
                                                       {"--goal spin --target 0,0,0", "--target belongs to --goal stand"},
                                                       {"--goal float --contact 1", "--contact belongs to --goal stand"},
                                                       {"--goal swim", "--goal is float, spin, yoyo, stand, target, pose or dice"},
                                                       {"--goal spin --point 500,0", "does not meet the mesh"},
                                                       {"--goal spin --point 1", "--point takes"},
                                                       {"--goal yoyo --center 1,2", "--center takes"},
                                                       {"--goal spin --mass 5", "--mass belongs to --goal target"},
                                                       {"--goal target", "Say which numbers are wanted"},
                                                       {"--goal stand --contact 0", "--contact must be a positive number"},
                                                       {"--goal spin --lambda 1", "unrecognised option '--lambda'"}};
  for (const auto& [arguments, message] : cases) {
    const Run result = run(std::string("verify egg.stl ") + arguments);
    EXPECT_EQ(result.code, 2) << arguments << ": " << result.err;
    EXPECT_NE(result.err.find(message), std::string::npos) << arguments << ": " << result.err;
    EXPECT_EQ(result.out, "") << arguments;
  }
}

TEST_F(Tool, UnitAndSizeInVerifyAreThoseOfTheOriginal) {
  // The egg measures 30 mm: 3 cm in the first file.
  Mesh small = read_mesh(folder_ / "egg.stl").mesh;
  for (auto& v : small.vertices) v /= 10;
  write_mesh(folder_ / "small.stl", small);
  ASSERT_EQ(run("float small.stl --unit cm --size 40 --resolution 40 -o out.stl").code, 0);
  EXPECT_EQ(run("verify out.stl --original small.stl --unit cm --size 40").code, 0);
  EXPECT_EQ(run("verify out.stl --original small.stl --size 40").code, 0);
  EXPECT_EQ(run("verify out.stl --original small.stl --unit cm").code, 4);
  EXPECT_EQ(run("verify out.stl").code, 0);
}

TEST_F(Tool, SpinUsageErrorsAre2) {
  for (const char* arguments :
       {"--point 1", "--point 1,2,3,4", "--point tip", "--point 1,", "--point 0,0 --up 0,1,1", "--point 500,0", "--center 0,0,0",
        "--yoyo --center 0,0", "--yoyo --point com", "--yoyo --center a,b,c", "--prefer middle", "--bounds x",
        "--objective fastest", "--lambda -1", "--objective spinit --gamma-c -1", "--gamma-i nan", "--waterline 5"}) {
    const Run result = run(std::string("spin egg.stl --resolution 40 ") + arguments);
    EXPECT_EQ(result.code, 2) << arguments << ": " << result.err;
    EXPECT_EQ(result.err.rfind("rayrep: ", 0), 0u) << result.err;
    EXPECT_EQ(result.out, "") << arguments;
    EXPECT_TRUE(new_files().empty()) << arguments;
  }
}

TEST_F(Tool, UnreachableSpinsAre4AndLeaveTheOldFileAlone) {
  write_mesh(folder_ / "egg.stl", box({0, 0, 0}, {40, 20, 20}));
  std::ofstream(folder_ / "egg_spin.stl") << "old";
  const Run result = run("spin egg.stl --point 3,10 --resolution 40");
  EXPECT_EQ(result.code, 4);
  EXPECT_NE(result.err.find("cannot be balanced"), std::string::npos) << result.err;
  EXPECT_EQ(text_of(folder_ / "egg_spin.stl"), "old");
  EXPECT_EQ(new_files(), std::vector<std::string>{"egg_spin.stl"});
}

TEST_F(Tool, WriteErrorsAre6) {
  const Run result = run("float egg.stl --resolution 40 --submerged 0.5 -o no/such/folder/egg.stl");
  EXPECT_EQ(result.code, 6);
  EXPECT_NE(result.err.find("no/such/folder"), std::string::npos) << result.err;
}

TEST_F(Tool, InterruptIs128AndTheSignalAndLeavesNothing) {
  std::ofstream(folder_ / "egg_float.stl") << "old";
  for (const auto& [signal, code] : {std::pair(SIGINT, 130), std::pair(SIGTERM, 143), std::pair(SIGHUP, 129)}) {
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      if (chdir(folder_.c_str()) != 0) _exit(99);
      execl(test::tool().c_str(), "rayrep", "float", "egg.stl", "--size", "200", "--resolution", "1000", "--quiet",
            static_cast<char*>(nullptr));
      _exit(98);
    }
    usleep(700000);
    kill(child, signal);
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), code);
    EXPECT_EQ(text_of(folder_ / "egg_float.stl"), "old");
    EXPECT_EQ(new_files(), std::vector<std::string>{"egg_float.stl"});
  }
}

TEST_F(Tool, WhatIsPrintedDoesNothingToATerminal) {
  fs::rename(folder_ / "egg.stl", folder_ / "e\x1b[31mg.stl");
  for (const char* arguments : {"inspect e\x1b[31mg.stl", "inspect \x1b[2J.stl", "float e\x1b[31mg.stl --resolution 30 -v",
                                "float e\x1b[31mg.stl --waterline \x1b[2J", "\x1b[2J", "float e\x1b[31mg.stl --up \xc2\x9b"}) {
    const Run told = run(arguments);
    EXPECT_EQ((told.out + told.err).find('\x1b'), std::string::npos) << arguments;
    EXPECT_EQ((told.out + told.err).find("\xc2\x9b"), std::string::npos) << arguments;
    EXPECT_NE((told.out + told.err).find("\\x"), std::string::npos) << told.out << told.err;
  }
  fs::rename(folder_ / "e\x1b[31mg.stl", folder_ / "egg.stl");
}

TEST_F(Tool, SizesOutOfReachAreRefused) {
  for (const char* size : {"1e-300", "1e-4", "1e7", "1e300", "0", "-1"}) {
    const Run refused = run("inspect egg.stl --size " + std::string(size));
    EXPECT_EQ(refused.code, 2) << size;
    EXPECT_NE(refused.err.find("0.001 and 1e+06"), std::string::npos) << refused.err;
  }
  const Run none = run("inspect egg.stl --size nan");
  EXPECT_EQ(none.code, 2);
  EXPECT_NE(none.err.find("--size takes a number"), std::string::npos) << none.err;
  for (const double factor : {1e-300, 1e-10, 1e6, 1e100, 1e300}) {
    Mesh egg = uv_ellipsoid(30, 22, 16, 24);
    for (auto& v : egg.vertices) v *= factor;
    write_mesh(folder_ / "sized.obj", egg);
    for (const char* command : {"inspect", "float", "verify"}) {
      const Run refused = run(command + std::string(" sized.obj"));
      EXPECT_EQ(refused.code, 3) << command << " " << factor << " " << refused.err;
      EXPECT_EQ(refused.err.find("nan"), std::string::npos) << refused.err;
    }
  }
}

TEST_F(Tool, MemoryToReadAMeshIsAnOption) {
  write_mesh(folder_ / "fine.3mf", icosphere(10, 6));
  const Run refused = run("inspect fine.3mf --memory 2MB");
  EXPECT_EQ(refused.code, 3);
  EXPECT_NE(refused.err.find("2 MB"), std::string::npos) << refused.err;
  EXPECT_EQ(run("inspect fine.3mf --memory 0.5GB").code, 0);
  for (const char* wrong : {"5", "GB", "-1GB", "0MB", "1e9GB", "5 bytes"})
    EXPECT_EQ(run("inspect egg.stl --memory '" + std::string(wrong) + "'").code, 2) << wrong;
}

TEST_F(Tool, ASummaryThatCannotBePrintedIsToldApartFromTheMesh) {
  const std::string command = "cd '" + folder_.string() + "' && '" + test::tool() + "' float egg.stl --resolution 30 ";
  for (const char* where : {">/dev/full", ">&-"}) {
    fs::remove(folder_ / "egg_float.stl");
    const int status = std::system((command + where + " 2>.err").c_str());
    EXPECT_EQ(WEXITSTATUS(status), 6) << where;
    const std::string told = text_of(folder_ / ".err");
    EXPECT_NE(told.find("the mesh is verified and in place: egg_float.stl"), std::string::npos) << told;
    EXPECT_EQ(run("verify egg_float.stl").code, 0);
  }
}

TEST_F(Tool, ReportsGoWhereStandardOutputGoes) {
  const std::string command = "cd '" + folder_.string() + "' && '" + test::tool() + "' float egg.stl --resolution 30 --report ";
  for (const char* where : {"/dev/stdout -q | cat >r.json", "/dev/fd/3 3>r.json >/dev/null", "/dev/stdout -q >r.json"}) {
    fs::remove(folder_ / "r.json");
    ASSERT_EQ(std::system((command + where).c_str()), 0) << where;
    EXPECT_EQ(nlohmann::json::parse(text_of(folder_ / "r.json"))["command"], "float") << where;
  }
}

TEST_F(Tool, BodiesThatDoNotTouchAreRefusedUnlessHeldTogether) {
  write_mesh(folder_ / "two.stl", test::merged({test::box({0, 0, 0}, {20, 20, 20}), test::box({30, 0, 0}, {50, 20, 20})}));
  for (const char* arguments : {"stand two.stl --resolution 30", "verify two.stl --goal stand"}) {
    const Run refused = run(arguments);
    EXPECT_EQ(refused.code, 3) << arguments;
    EXPECT_NE(refused.err.find("2 bodies that do not touch"), std::string::npos) << refused.err;
    const Run rigid = run(std::string(arguments) + " --rigid");
    EXPECT_EQ(rigid.code, 0) << rigid.err;
    EXPECT_NE(rigid.out.find("as --rigid says"), std::string::npos);
  }
}

// Two bodies, one of which cannot be made: the other is, each is told of, and the exit code is the worse one.
TEST_F(Tool, EachBodyIsTreatedByItself) {
  const Mesh egg = uv_ellipsoid(30, 22, 16, 24);
  write_mesh(folder_ / "two.stl", merged({egg, moved(box({0, 0, 0}, {20, 20, 20}), {100, 0, 0})}));
  const Run both = run("stand two.stl --resolution 30 --each --report r.json -v");
  EXPECT_EQ(both.code, 4) << both.err;
  EXPECT_EQ(new_files(), (std::vector<std::string>{"r-2.json", "two.stl", "two_stand-2.stl"}));
  EXPECT_NE(both.err.find("body 1 of 2: "), std::string::npos) << both.err;
  EXPECT_NE(both.err.find("1 of 2 bodies failed"), std::string::npos) << both.err;
  EXPECT_NE(both.out.find("two.stl, body 2 of 2: "), std::string::npos) << both.out;
  const auto report = nlohmann::json::parse(text_of(folder_ / "r-2.json"));
  EXPECT_EQ(report["input"]["body"], 2);
  EXPECT_EQ(report["output"]["path"], "two_stand-2.stl");
  EXPECT_NEAR(report["after"]["centre_of_mass_mm"][0].get<double>(), 110, 1e-3) << "where it is in the file";
  const std::string before = "\nto judge it again: rayrep ";
  const std::size_t at = both.out.find(before);
  ASSERT_NE(at, std::string::npos) << both.out;
  EXPECT_EQ(run(both.out.substr(at + before.size(), both.out.find('\n', at + 1) - at - before.size())).code, 0);
  // The same bytes as from a file of its own.
  write_mesh(folder_ / "one.stl", moved(box({0, 0, 0}, {20, 20, 20}), {100, 0, 0}));
  ASSERT_EQ(run("stand one.stl --resolution 30 -q").code, 0);
  EXPECT_EQ(text_of(folder_ / "one_stand.stl"), text_of(folder_ / "two_stand-2.stl"));

  EXPECT_EQ(run("verify two.stl --goal stand --each").code, 4);
  EXPECT_EQ(run("verify one.stl --goal stand --each").code, 0);
  ASSERT_EQ(run("float two.stl --resolution 30 --each -q -o f.3mf").code, 0);
  EXPECT_TRUE(fs::exists(folder_ / "f-1.3mf") && fs::exists(folder_ / "f-2.3mf"));
  fs::copy(folder_ / "two.stl", folder_ / "g-1.stl");
  EXPECT_EQ(run("float g-1.stl --resolution 30 --each -q -o g.stl").code, 2) << "an output would be the input";
}

// A density says nothing of the material; resin keeps what is not cured in a sealed cavity.
TEST_F(Tool, ResinIsRefusedUnlessItIsDrained) {
  const std::string arguments = "float egg.stl --resolution 40 --submerged 0.5 --density 1.14 -o resin.stl ";
  EXPECT_EQ(run(arguments).code, 0);
  fs::remove(folder_ / "resin.stl");
  const Run kept = run(arguments + "--material resin");
  EXPECT_EQ(kept.code, 4);
  EXPECT_NE(kept.err.find("(trapped_resin)"), std::string::npos) << kept.err;
  EXPECT_NE(kept.err.find("say --drained"), std::string::npos) << kept.err;
  EXPECT_FALSE(fs::exists(folder_ / "resin.stl"));
  const Run drained = run(arguments + "--material resin --drained -v --report r.json");
  ASSERT_EQ(drained.code, 0) << drained.err;
  EXPECT_NE(drained.out.find("let the resin run out"), std::string::npos) << drained.out;
  EXPECT_EQ(nlohmann::json::parse(text_of(folder_ / "r.json"))["goal"]["drained"], true);
  // What judges it again knows of both.
  const std::string before = "\nto judge it again: rayrep ";
  const std::size_t at = drained.out.find(before);
  ASSERT_NE(at, std::string::npos) << drained.out;
  const std::string line = drained.out.substr(at + before.size(), drained.out.find('\n', at + 1) - at - before.size());
  EXPECT_NE(line.find("--material resin"), std::string::npos) << line;
  EXPECT_NE(line.find("--drained"), std::string::npos) << line;
  EXPECT_EQ(run(line).code, 0) << line;
  EXPECT_EQ(run("verify resin.stl --material resin").code, 4);
  // The bottle's own density goes before the table's, whichever comes first.
  for (const char* order : {"--material resin --density 1.2", "--density 1.2 --material resin"}) {
    ASSERT_EQ(run(std::string("inspect egg.stl --json ") + order).code, 0);
    EXPECT_EQ(nlohmann::json::parse(run(std::string("inspect egg.stl --json ") + order).out)["density_g_cm3"], 1.2) << order;
  }
}

TEST_F(Tool, SubmergedIsOfTheHeightOrOfTheVolume) {
  const auto waterline = [&](const char* submerged) {
    const Run result = run(std::string("verify egg.stl --report r.json --submerged ") + submerged);
    EXPECT_EQ(result.code, 4) << submerged << ": " << result.err;
    return nlohmann::json::parse(text_of(folder_ / "r.json"))["goal"]["waterline_mm"].get<double>();
  };
  EXPECT_EQ(waterline("0.7"), waterline("70%"));
  EXPECT_EQ(waterline("0.7"), waterline("70%height"));
  EXPECT_NEAR(waterline("0.7"), 0.7 * 32, 1e-6);
  EXPECT_EQ(waterline("0.7volume"), waterline("70%volume"));
  // Of an ellipsoid of height 2c up to h: (h / c)^2 (3 - h / c) / 4.
  const double h = waterline("70%volume") / 16;
  EXPECT_NEAR(h * h * (3 - h) / 4, 0.7, 5e-3);
}

TEST_F(Tool, HoversUnderWater) {
  const Run made = run("float egg.stl --resolution 40 --submerged 1 --verbose --report r.json");
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_NE(made.out.find("It hovers upright at any depth"), std::string::npos) << made.out;
  EXPECT_NE(made.out.find("wholly under water"), std::string::npos) << made.out;
  EXPECT_NE(made.out.find("--submerged 1 "), std::string::npos) << made.out;
  const auto report = nlohmann::json::parse(text_of(folder_ / "r.json"));
  EXPECT_EQ(report["goal"]["submerged"], true);
  EXPECT_TRUE(report["goal"]["waterline_mm"].is_null());
  EXPECT_EQ(report["after"]["gz_mm"].size(), report["after"]["gz_heel_rad"].size());
  EXPECT_EQ(run("verify egg_float.stl --original egg.stl --submerged 100%").code, 0);
  EXPECT_EQ(run("verify egg_float.stl --original egg.stl --waterline 100").code, 0);
  EXPECT_EQ(run("verify egg_float.stl --original egg.stl --submerged 1 --fluid 1.01").code, 4);
}

TEST_F(Tool, SaysHowToPrint) {
  const Run stl = run("float egg.stl --resolution 40 --submerged 0.5");
  EXPECT_NE(stl.out.find("To print: at 100 % infill, with supports on the build plate only"), std::string::npos) << stl.out;
  EXPECT_NE(run("float egg.stl --resolution 40 --submerged 0.5 -o a.3mf").out.find("To print: the file asks PrusaSlicer"),
            std::string::npos);
  EXPECT_EQ(run("float egg.stl --resolution 40 --submerged 0.5 -q").out, "");
  EXPECT_EQ(run("verify egg_float.stl").out.find("To print"), std::string::npos);
}

// What it means for the print comes before the figures; how the solver came to it is for those who ask.
TEST_F(Tool, WordsComeBeforeFigures) {
  for (const char* command : {"float egg.stl", "spin egg.stl", "spin egg.stl --yoyo --axle none", "target egg.stl --mass 40"}) {
    const Run result = run(std::string(command) + " --resolution 40");
    ASSERT_EQ(result.code, 0) << result.err;
    const std::size_t words = result.out.find("\nIt ");
    ASSERT_NE(words, std::string::npos) << result.out;
    EXPECT_LT(words, result.out.find("before (solid)")) << command;
    for (const char* jargon : {"quadric", "iterations", "variables", "passes"})
      EXPECT_EQ(result.out.find(jargon), std::string::npos) << command << " says " << jargon;
    EXPECT_NE(run(std::string(command) + " --resolution 40 -v").out.find("iterations in"), std::string::npos) << command;
  }
}

TEST_F(Tool, HintsSayWhatWasMeant) {
  const std::pair<const char*, const char*> cases[] = {{"egg.stl", "rayrep float egg.stl"},
                                                       {"flaot egg.stl", "Did you mean float?"},
                                                       {"float egg.stl --densty 1", "Did you mean --density?"},
                                                       {"float egg.stl --density 1240", "give 1.24"},
                                                       {"float egg.stl --wall 2mm", "without 'mm'"},
                                                       {"float egg.stl --wall 1,2", "1.2"},
                                                       {"float egg.stl --submerged 50", "Did you mean 50%?"},
                                                       {"float egg.stl --fluid sewater", "Did you mean seawater?"},
                                                       {"float egg.stl --scale 2", "--size"},
                                                       {"float egg.stl egg.stl", "more than one mesh"}};
  for (const auto& [arguments, hint] : cases) {
    const Run result = run(arguments);
    EXPECT_EQ(result.code, 2) << arguments;
    EXPECT_NE(result.err.find(hint), std::string::npos) << arguments << ": " << result.err;
  }
}

/// Every option that some help names is in the man page and in the completion: they are made from the same rows.
TEST_F(Tool, ManPageAndCompletionKnowEveryOption) {
  const std::string man = run("--man").out;
  const std::string completion = run("--completion").out;
  EXPECT_EQ(man.rfind(".TH RAYREP 1", 0), 0u);
  std::size_t seen = 0;
  for (const std::string command : {"float", "spin", "stand", "target", "verify", "view", "inspect"}) {
    const std::string help = run(command + " --help").out;
    EXPECT_EQ(run("help " + command).out, help);
    static const std::regex kOption(R"(--[a-z][a-z-]*)");
    std::istringstream lines(help);
    for (std::string line; std::getline(lines, line);) {
      std::smatch option;
      if (line.rfind("  -", 0) != 0 || !std::regex_search(line, option, kOption)) continue;
      ++seen;
      EXPECT_NE(completion.find(option.str()), std::string::npos) << option.str();
      EXPECT_NE(man.find("\\-\\-" + std::regex_replace(option.str().substr(2), std::regex("-"), "\\-")), std::string::npos)
          << option.str();
    }
  }
  EXPECT_GT(seen, 80u);
}

/// What bash would offer.
TEST_F(Tool, CompletionKnowsWhatCanBeDoneWithAScene) {
  std::ofstream(folder_ / "complete.bash") << run("--completion").out;
  const auto offered = [&](const std::string& words, int at) {
    const fs::path out = folder_ / "offered";
    const std::string ask = "source complete.bash; COMP_WORDS=(" + words + "); COMP_CWORD=" + std::to_string(at) +
                            "; _rayrep; echo ${COMPREPLY[*]} > offered";
    EXPECT_EQ(std::system(("cd '" + folder_.string() + "' && bash -c '" + ask + "'").c_str()), 0);
    std::string text = text_of(out);
    text.pop_back();
    return text;
  };
  EXPECT_EQ(offered("rayrep scene \"\"", 2), "check import export");
  EXPECT_EQ(offered("rayrep scene im", 2), "import");
  EXPECT_EQ(offered("rayrep scene import \"\"", 3), "");
  EXPECT_EQ(offered("rayrep float \"\"", 2), "");
  EXPECT_EQ(offered("rayrep sce", 1), "scene");
}

/// Width and height that a PNG says, 0 for what is none.
std::pair<unsigned, unsigned> png_size(const std::string& bytes) {
  if (bytes.size() < 24 || bytes.rfind("\x89PNG\r\n\x1a\n", 0) != 0) return {};
  const auto number = [&bytes](std::size_t at) {
    unsigned value = 0;
    for (std::size_t n = at; n < at + 4; ++n) value = value << 8 | static_cast<unsigned char>(bytes[n]);
    return value;
  };
  return {number(16), number(20)};
}

TEST_F(Tool, DrawsPictures) {
  const Run made =
      run("float egg.stl --resolution 40 --section y --section x=3 --section 1,0,1=2:tilted.png --picture p.png -o out/e.3mf");
  EXPECT_EQ(made.code, 6) << "there is no such folder";
  fs::create_directory(folder_ / "out");
  const std::string command =
      "float egg.stl --resolution 40 --section y --section x=3 --section 1,0,1=2:tilted.png --picture p.png -o out/e.3mf";
  const Run drawn = run(command);
  ASSERT_EQ(drawn.code, 0) << drawn.err;
  EXPECT_TRUE(mentions(drawn.out, {"pictures: out/e_section_y.svg, out/e_section_x3.svg, tilted.png, p.png"}));
  for (const char* name : {"out/e_section_y.svg", "out/e_section_x3.svg"}) {
    pugi::xml_document svg;
    EXPECT_TRUE(svg.load_file((folder_ / name).c_str())) << name;
    EXPECT_TRUE(svg.select_node("//*[@id='material']")) << name;
    EXPECT_TRUE(mentions(text_of(folder_ / name), {"centre of mass", "before (", "waterline", "centre of buoyancy"}));
  }
  EXPECT_EQ(png_size(text_of(folder_ / "tilted.png")).first, 1440U);
  EXPECT_EQ(png_size(text_of(folder_ / "p.png")).first, 1440U);
  // The same bytes whatever the number of threads.
  const std::string picture = text_of(folder_ / "p.png");
  const std::string section = text_of(folder_ / "out/e_section_y.svg");
  ASSERT_EQ(run(command + " --threads 1").code, 0);
  EXPECT_EQ(text_of(folder_ / "p.png"), picture);
  EXPECT_EQ(text_of(folder_ / "out/e_section_y.svg"), section);
  // What was written is judged and looked at as well.
  EXPECT_EQ(run("verify out/e.3mf --original egg.stl --section y").code, 0);
  EXPECT_TRUE(mentions(text_of(folder_ / "e_section_y.svg"), {"waterline", "before ("}));
  EXPECT_EQ(run("inspect out/e.3mf --section z --up y").code, 0);
  EXPECT_TRUE(fs::exists(folder_ / "e_section_z.svg"));
  const Run viewed = run("view out/e.3mf");
  EXPECT_EQ(viewed.code, 0) << viewed.err;
  EXPECT_EQ(viewed.out, "picture: e.png\npage: e.html\n");
  EXPECT_TRUE(mentions(text_of(folder_ / "e.html"), {"<!doctype html>"}));
  EXPECT_EQ(png_size(text_of(folder_ / "e.png")).first, 1440U);
}

// Every 3MF that is written holds a picture of itself, and slicers read it as before.
TEST_F(Tool, ThreeMfHasAThumbnailThatHarmsNothing) {
  ASSERT_EQ(run("float egg.stl --resolution 40 -o e.3mf").code, 0);
  ASSERT_EQ(run("float egg.stl --resolution 40 -o e.obj").code, 0);
  const MeshFile pictured = read_mesh(folder_ / "e.3mf");
  EXPECT_EQ(pictured.mesh.vertices, read_mesh(folder_ / "e.obj").mesh.vertices);
  const std::string bytes = text_of(folder_ / "e.3mf");
  EXPECT_NE(bytes.find("Metadata/thumbnail.png"), std::string::npos);
  if (std::system("command -v prusa-slicer >/dev/null") != 0) GTEST_SKIP() << "no prusa-slicer (package prusa-slicer)";
  ASSERT_EQ(std::system(("cd '" + folder_.string() + "' && prusa-slicer --info e.3mf >.out 2>.err").c_str()), 0);
  const std::string info = text_of(folder_ / ".out");
  EXPECT_TRUE(mentions(info, {"manifold = yes", "number_of_facets"})) << info;
  const std::size_t at = info.find("volume = ");
  ASSERT_NE(at, std::string::npos);
  const double volume = mesh_moments(pictured.mesh)[M1];
  EXPECT_NEAR(std::strtod(info.c_str() + at + 9, nullptr), volume, 1e-3 * volume);
}

TEST_F(Tool, RefusesPicturesThatCannotBe) {
  EXPECT_TRUE(mentions(run("float egg.stl --section y=500").err, {"y = 500 mm", "between -22 and 22"}));
  EXPECT_EQ(run("float egg.stl --section y=500").code, 2);
  EXPECT_EQ(run("view egg.stl --section q=1").code, 2);
  EXPECT_TRUE(mentions(run("view egg.stl --section y:cut.jpg").err, {"end 'cut.jpg' in .svg or .png"}));
  EXPECT_EQ(run("view egg.stl --picture egg.gif").code, 2);
  EXPECT_TRUE(mentions(run("view egg.stl --section y:a.svg --section x:a.svg").err, {"name the same file"}));
  EXPECT_TRUE(mentions(run("view egg.stl --section y:a.png --picture a.png").err, {"name the same file"}));
  EXPECT_EQ(run("view egg.stl --picture none/p.png").code, 6);
  EXPECT_TRUE(new_files().empty());
}

// What a run that fails leaves of pictures: nothing, and what was there stays.
TEST_F(Tool, PicturesAreWrittenOfSuccessOnly) {
  std::ofstream(folder_ / "p.png") << "old";
  EXPECT_EQ(run("float egg.stl --resolution 40 --waterline 2 --no-advice --picture p.png").code, 4);
  EXPECT_EQ(text_of(folder_ / "p.png"), "old");
  EXPECT_EQ(new_files(), std::vector<std::string>{"p.png"});
}

/// What a command prints on a terminal.
std::string on_a_terminal(const fs::path& folder, const std::string& environment, const std::string& arguments) {
  const std::string command = "cd '" + folder.string() + "' && TERM=xterm " + environment + " script -qec \"'" + test::tool() +
                              "' " + arguments + "\" /dev/null >.out 2>.err </dev/null";
  EXPECT_EQ(std::system(command.c_str()), 0) << command;
  return text_of(folder / ".out");
}

TEST_F(Tool, ProgressSuitsWhereItGoes) {
  const Run plain = run("float egg.stl --resolution 40 -v");
  EXPECT_TRUE(mentions(plain.err, {"rayrep: read\n", "rayrep: solve\n", "rayrep: verify\n"}));
  EXPECT_EQ(plain.err.find('\033'), std::string::npos);
  EXPECT_EQ(run("float egg.stl --resolution 40").err, "");
  if (std::system("command -v script >/dev/null") != 0) GTEST_SKIP() << "no script (package bsdutils)";
  const std::string terminal = on_a_terminal(folder_, "NO_COLOR=", "float egg.stl --resolution 40 -v");
  EXPECT_TRUE(mentions(terminal, {"\r\033[K", "\033[1mverify\033[0m", " s\r\n"}));
  const std::string colourless = on_a_terminal(folder_, "NO_COLOR=1", "float egg.stl --resolution 40 -v");
  EXPECT_EQ(colourless.find("\033[1m"), std::string::npos);
  EXPECT_TRUE(mentions(colourless, {"\r\033[K", "verify ..."}));
  const std::string dumb = on_a_terminal(folder_, "TERM=dumb", "float egg.stl --resolution 40 -v");
  EXPECT_EQ(dumb.find('\033'), std::string::npos);
  EXPECT_TRUE(mentions(dumb, {"rayrep: verify"}));
  const std::string quiet = on_a_terminal(folder_, "", "float egg.stl --resolution 40 -q");
  EXPECT_EQ(quiet, "");
}

TEST_F(Tool, HelpFitsAScreen) {
  for (const char* arguments : {"--help", "float --help", "spin --help", "stand --help", "target --help", "pose --help",
                                "dice --help", "verify --help", "measure --help", "view --help", "inspect --help"}) {
    const Run result = run(arguments);
    EXPECT_EQ(result.code, 0);
    EXPECT_EQ(result.err, "");
    std::istringstream lines(result.out);
    int count = 0;
    for (std::string line; std::getline(lines, line); ++count) EXPECT_LE(line.size(), 100u) << line;
    EXPECT_LE(count, 60) << arguments;
    EXPECT_GE(count, 8) << arguments;
  }
  EXPECT_EQ(run("--version").out.rfind("rayrep ", 0), 0u);
}

/// A box of 20 x 10 x 6 in 30 layers, each a loop 0.5 mm wide round 4 more beads, as a slicer would write it.
std::string gcode_of_a_box() {
  std::ostringstream text;
  text << "; generated by hand\n; filament_density = 1.3\nG90\nM83\n";
  const auto bead = [&text](double x, double y, double length) {
    text << "G1 X" << x << " Y" << y << " E" << length * 0.5 * 0.2 / 2.405281875404685 << "\n";
  };
  for (int layer = 1; layer <= 30; ++layer) {
    text << ";LAYER_CHANGE\n;TYPE:External perimeter\n;WIDTH:0.5\n;HEIGHT:0.2\nG1 X50.25 Y50.25 Z" << 0.2 * layer << "\n";
    bead(69.75, 50.25, 19.5);
    bead(69.75, 59.75, 9.5);
    bead(50.25, 59.75, 19.5);
    bead(50.25, 50.25, 9.5);
    text << ";TYPE:Internal infill\n";
    for (int line = 0; line < 18; ++line) {
      const double y = 50.75 + 0.5 * line;
      text << "G1 X50.5 Y" << y << "\n";
      bead(69.5, y, 19);
    }
  }
  return text.str();
}

TEST_F(Tool, APrintIsMeasuredAndJudged) {
  std::ofstream(folder_ / "box.gcode") << gcode_of_a_box();
  write_mesh(folder_ / "box.stl", box({0, 0, 0}, {20, 10, 6}));
  const Run measured = run("measure box.gcode --of box.stl --json");
  ASSERT_EQ(measured.code, 0) << measured.err;
  const auto json = nlohmann::json::parse(measured.out);
  const auto& mass = json["print"]["mass_properties"];
  EXPECT_NEAR(mass["volume_mm3"].get<double>(), 1200, 1e-3);
  EXPECT_NEAR(mass["mass_g"].get<double>(), 1.56, 1e-5);
  EXPECT_NEAR(mass["centre_of_mass_mm"][0].get<double>(), 10, 1e-3);
  EXPECT_NEAR(mass["centre_of_mass_mm"][2].get<double>(), 3, 1e-3);
  EXPECT_EQ(run("inspect box.gcode").out, run("measure box.gcode").out);

  // It is denser than water and sinks; in mercury it floats.
  EXPECT_EQ(run("verify box.gcode --original box.stl").code, 4);
  const Run floating = run("verify box.gcode --original box.stl --fluid mercury");
  EXPECT_TRUE(mentions(floating.out, {"It floats upright", "box.gcode: G-code by hand"})) << floating.err;
  EXPECT_EQ(floating.code, 0) << floating.err;
  const Run standing = run("verify box.gcode --original box.stl --goal stand");
  EXPECT_EQ(standing.code, 0) << standing.err;

  EXPECT_TRUE(mentions(run("verify box.gcode").err, {"--original"}));
  EXPECT_TRUE(mentions(run("float box.gcode").err, {"Name the mesh"}));
  EXPECT_TRUE(mentions(run("measure box.stl").err, {"inspect"}));
  EXPECT_TRUE(mentions(run("verify egg.stl --turned 5").err, {"--turned", ".gcode"}));
  EXPECT_TRUE(mentions(run("float egg.stl --gcode x.gcode").err, {"--slicer"}));
  EXPECT_TRUE(mentions(run("float egg.stl --as-sliced box.gcode").err, {"--of MESH"}));
  EXPECT_TRUE(mentions(run("float egg.stl --measured-mass 3").err, {"--as-sliced"}));
  EXPECT_TRUE(mentions(run("measure box.gcode --measured-mass 1.8").out, {"Density 1.5 g/cm3"}));
  EXPECT_TRUE(mentions(run("float egg.stl --as-sliced box.gcode --of box.stl --of egg.stl").err, {"of"}));
  // What that print has more than its mesh is made up for in another one.
  const Run by_hand = run("stand egg.stl --contact 1 --resolution 40 --as-sliced box.gcode --of box.stl");
  EXPECT_EQ(by_hand.code, 0) << by_hand.err;
  EXPECT_TRUE(mentions(by_hand.out, {"box.gcode", "lets expect it", "material 1.3"}));
  const Run missing = run("float egg.stl --slicer no-such-slicer --resolution 40");
  EXPECT_EQ(missing.code, 2);
  EXPECT_TRUE(mentions(missing.err, {"no-such-slicer"}));
}

TEST_F(Tool, InfillInsteadOfACavity) {
  const std::string egg = "float egg.stl --resolution 40 ";
  for (const char* flavor : {"prusa", "bambu", "core"}) {
    const Run made = run(egg + "--infill 20 --infill-laid-down 21.5 --3mf-flavor " + flavor + " -v");
    ASSERT_EQ(made.code, 0) << made.err;
    EXPECT_TRUE(fs::exists(folder_ / "egg_float.3mf"));
    EXPECT_TRUE(mentions(made.out, {"Assumed", "gyroid infill of 20.0 % takes 21.50 %", "1 sparse region", "20 % (gyroid)"}));
    std::smatch found;
    ASSERT_TRUE(std::regex_search(made.out, found, std::regex("to judge it again: rayrep (.*)"))) << made.out;
    const Run again = run(found[1].str());
    EXPECT_EQ(again.code, 0) << found[1].str() << "\n" << again.err;
    // Of another share it does not float as deep.
    EXPECT_EQ(run(std::regex_replace(found[1].str(), std::regex("21.5"), "25")).code, 4);
  }
  std::ofstream(folder_ / "p.ini") << "fill_density = 30%\nfill_pattern = cubic\nperimeters = 4\nextrusion_width = 0.5\n"
                                      "top_solid_layers = 3\nbottom_solid_layers = 3\nlayer_height = 0.3\nfilament_density = 1.3\n";
  const Run profiled = run(egg + "--cavity infill --profile p.ini --waterline 22");
  EXPECT_TRUE(mentions(profiled.out + profiled.err, {"30 % (cubic)", "wall 2 mm", "material 1.3 g/cm3"}));
  EXPECT_EQ(profiled.code, 0) << profiled.err;
  EXPECT_TRUE(mentions(run(egg + "--infill 20 -o egg.stl").err, {"3MF", ".3mf"}));
  // Both phases are closed meshes that make up the body, and weigh what was promised.
  const Run phases = run(egg + "--infill 20 --infill-laid-down 21.5 --phases --density 1 --report r.json");
  EXPECT_EQ(phases.code, 0) << phases.err;
  EXPECT_TRUE(mentions(phases.out, {"egg_float_dense.3mf", "egg_float_sparse.3mf"}));
  const auto volume = [this](const char* name) {
    const CheckedMesh mesh = check_mesh(read_mesh(folder_ / name).mesh);
    EXPECT_TRUE(mesh.report.usable) << mesh.report.refusal;
    return mass_properties(mesh.mesh, 1).volume_mm3;
  };
  const double dense = volume("egg_float_dense.3mf");
  const double sparse = volume("egg_float_sparse.3mf");
  EXPECT_GT(sparse, 100);
  EXPECT_NEAR(dense + sparse, volume("egg.stl"), 1e-3);
  EXPECT_NEAR((dense + 0.215 * sparse) / 1000, nlohmann::json::parse(text_of(folder_ / "r.json"))["after"]["mass_g"].get<double>(),
              1e-5);
  EXPECT_TRUE(mentions(run(egg + "--phases").err, {"--infill 15"}));
  const Run capitals = run(egg + "--infill 20 -o EGG.3MF");
  EXPECT_EQ(capitals.code, 0) << capitals.err;
  // Where modifiers are not counted that is said, or refused.
  EXPECT_TRUE(mentions(run("inspect EGG.3MF").out, {"not counted here"}));
  EXPECT_TRUE(mentions(run("verify EGG.3MF --each").err, {"whose the modifiers"}));
  // 0 is automatic; what was weighed goes before the profile.
  std::ofstream(folder_ / "auto.ini") << "extrusion_width = 0\nfilament_density = 1.1\n";
  EXPECT_EQ(run(egg + "--infill 20 --profile auto.ini").code, 0);
  std::ofstream(folder_ / "box.gcode") << gcode_of_a_box();
  write_mesh(folder_ / "box.stl", box({0, 0, 0}, {20, 10, 6}));
  const Run weighed =
      run("stand egg.stl --contact 1 --resolution 40 --infill 20 --profile auto.ini --as-sliced box.gcode --of box.stl "
          "--measured-mass 1.8");
  EXPECT_TRUE(mentions(weighed.out, {"material 1.5 g/cm3"})) << weighed.err;
  EXPECT_TRUE(mentions(run(egg + "--infill 20 --cavity void").err, {"--cavity void"}));
  EXPECT_TRUE(mentions(run(egg + "--perimeters 3").err, {"--infill 15"}));
  EXPECT_TRUE(mentions(run(egg + "--3mf-flavor bambu").err, {"--infill 15"}));
  EXPECT_TRUE(mentions(run(egg + "--infill 20 --wall 1").err, {"1.2 mm", "Leave --wall out"}));
  EXPECT_TRUE(mentions(run(egg + "--infill 20 --material resin").err, {"no infill"}));
  EXPECT_TRUE(mentions(run(egg + "--infill 20 --slicer true --profile p.ini --perimeters 2").err, {"profile"}));
}

TEST_F(Tool, ACoreIsAFileOfItsOwn) {
  write_mesh(folder_ / "tall.stl", uv_ellipsoid(24, 24, 56, 48));
  const std::string tall = "spin tall.stl --point com --resolution 50 ";
  std::ofstream(folder_ / "tall_spin_core.stl") << "mine";
  EXPECT_EQ(run(tall + "--core-density 1.5 --no-advice").code, 4);
  EXPECT_EQ(text_of(folder_ / "tall_spin_core.stl"), "mine");

  const Run made = run(tall + "--core-material tin --report r.json -v");
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_TRUE(mentions(made.out, {"tall_spin_core.stl is the core", "g of tin", "glue", "All together", "put in and not printed"}));
  const auto report = nlohmann::json::parse(text_of(folder_ / "r.json"));
  EXPECT_EQ(report["insert"]["path"], "tall_spin_core.stl");
  EXPECT_NEAR(report["insert"]["mass_properties"]["mass_g"].get<double>(), report["after"]["inserts"][0]["mass_g"].get<double>(),
              1e-9);
  std::smatch found;
  ASSERT_TRUE(std::regex_search(made.out, found, std::regex("to judge it again: rayrep (.*)"))) << made.out;
  EXPECT_TRUE(mentions(found[1].str(), {"--fixed tall_spin_core.stl=7.29"}));
  EXPECT_EQ(run(found[1].str()).code, 0) << found[1].str();
  // Hollow it is no top, and a core that lies elsewhere has no room.
  EXPECT_EQ(run(std::regex_replace(found[1].str(), std::regex("--fixed [^ ]*"), "")).code, 4);
  Mesh core = read_mesh(folder_ / "tall_spin_core.stl").mesh;
  write_mesh(folder_ / "tall_spin_core.stl", moved(core, {0, 0, 3}));
  const Run beside = run(found[1].str());
  EXPECT_EQ(beside.code, 4);
  EXPECT_TRUE(mentions(beside.err, {"inserts_fit"}));
}

TEST_F(Tool, AnOutsideThatWasDeformedIsAFileOfItsOwnAndIsTold) {
  const std::filesystem::path original = test::source_folder() / "examples/couple.stl";
  const std::string couple = "stand " + original.string() + " -o c.stl --resolution 60 --no-advice ";
  EXPECT_EQ(run(couple).code, 4);
  const Run little = run(couple + "--deform-limit 0.05");
  EXPECT_EQ(little.code, 4);
  EXPECT_TRUE(mentions(little.err, {"at most 0.05 mm (--deform-limit)"})) << little.err;
  EXPECT_FALSE(std::filesystem::exists(folder_ / "c_outside.stl"));

  const Run made = run(couple + "--deform-limit 5 --deform-fixed -70,-30,60,-40,30,80 --report r.json -v --picture p.svg");
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_TRUE(mentions(made.out, {"the outside was changed", "c_outside.stl is the outside"}));
  const auto outside = nlohmann::json::parse(text_of(folder_ / "r.json"))["outside"];
  EXPECT_EQ(outside["path"], "c_outside.stl");
  EXPECT_GT(outside["largest_mm"].get<double>(), outside["rms_mm"].get<double>());
  EXPECT_LE(outside["largest_mm"].get<double>(), 5);
  // The picture's scale ends with it.
  const std::string picture = text_of(folder_ / "p.svg");
  bool shown = false;
  const std::regex lengths(">([0-9.]+) mm<");
  for (std::sregex_iterator one(picture.begin(), picture.end(), lengths), none; one != none; ++one)
    shown = shown || std::abs(std::stod((*one)[1].str()) - outside["largest_mm"].get<double>()) < 0.01;
  EXPECT_TRUE(shown) << outside["largest_mm"];
  // What was fixed is where it was, corner by corner.
  const Mesh before = read_mesh(original).mesh;
  const Mesh after = read_mesh(folder_ / "c_outside.stl").mesh;
  ASSERT_EQ(before.vertices.size(), after.vertices.size());
  const Eigen::AlignedBox3d fixed(Eigen::Vector3d(-70, -30, 60), Eigen::Vector3d(-40, 30, 80));
  for (std::size_t v = 0; v < before.vertices.size(); ++v)
    if (fixed.contains(before.vertices[v])) {
      ASSERT_EQ(before.vertices[v], after.vertices[v]);
    }
  // It is what the result is judged by, and the outside as it was is not.
  std::smatch found;
  ASSERT_TRUE(std::regex_search(made.out, found, std::regex("to judge it again: rayrep (.*)"))) << made.out;
  EXPECT_TRUE(mentions(found[1].str(), {"--original c_outside.stl"}));
  EXPECT_EQ(run(found[1].str()).code, 0) << found[1].str();
  EXPECT_EQ(run(std::regex_replace(found[1].str(), std::regex("--original [^ ]*"), "--original " + original.string())).code, 4);

  EXPECT_EQ(run("target egg.stl --mass 3 --deform-limit 3").code, 2);
  EXPECT_TRUE(mentions(run(couple + "--deform-limit 3 --deform-fixed 1,2").err, {"--deform-fixed takes a box"}));
}

TEST_F(Tool, WhatIsFixedInsideCounts) {
  write_mesh(folder_ / "coin.stl", moved(cylinder(6, 2, 32), {4, 2, -10}));
  const std::string egg = "float egg.stl --resolution 40 ";
  const Run made = run(egg + "--fixed coin.stl=8.9 -v");
  ASSERT_EQ(made.code, 0) << made.err;
  std::smatch found;
  ASSERT_TRUE(std::regex_search(made.out, found, std::regex("to judge it again: rayrep (.*)"))) << made.out;
  EXPECT_EQ(run(found[1].str()).code, 0) << found[1].str();
  EXPECT_EQ(run("verify egg_float.stl").code, 4);  // by itself it leans
  write_mesh(folder_ / "other.stl", moved(cylinder(2, 2, 32), {-10, 2, -8}));
  EXPECT_EQ(run(egg + "--fixed coin.stl=8.9 --fixed other.stl=7.8 -o two.stl").code, 0);
  EXPECT_EQ(run("verify two.stl --fixed coin.stl=8.9 --fixed other.stl=7.8 --original egg.stl").code, 0);
  EXPECT_TRUE(mentions(run(egg + "--fixed coin.stl").err, {"a mesh and its density", "magnet.stl=7.5"}));
  EXPECT_TRUE(mentions(run(egg + "--fixed coin.stl=lead").err, {"takes a number"}));
  EXPECT_EQ(run(egg + "--fixed no.stl=8").code, 3);
  EXPECT_TRUE(mentions(run(egg + "--fixed coin.stl=8 --each").err, {"--fixed", "which body"}));
  EXPECT_TRUE(mentions(run(egg + "--fixed coin.stl=8 -o coin.stl").err, {"read, too"}));
  write_mesh(folder_ / "far.stl", moved(cylinder(6, 2, 32), {4, 2, 30}));
  const Run outside = run(egg + "--fixed far.stl=8 --no-advice");
  EXPECT_EQ(outside.code, 4);
  EXPECT_TRUE(mentions(outside.err, {"Fixed body 1", "does not lie inside"}));
}

TEST_F(Tool, BallsComeWithPauses) {
  const Run made = run("float egg.stl --resolution 40 --balls 3 --ball-diameter 5 -o balls.3mf -v");
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_EQ(new_files(), (std::vector<std::string>{"balls.3mf", "balls_balls.3mf"}));
  EXPECT_TRUE(mentions(made.out, {"Pause", "balls_balls.3mf shows where", "for PrusaSlicer"}));
  std::smatch found;
  ASSERT_TRUE(std::regex_search(made.out, found, std::regex("to judge it again: rayrep (.*)"))) << made.out;
  EXPECT_EQ(run(found[1].str()).code, 0) << found[1].str();
  EXPECT_TRUE(mentions(run("float egg.stl --resolution 40 --balls 60 --no-advice").err, {"of the 60 balls"}));
}

TEST_F(Tool, TheCommandThatJudgesASlicedBodyAgainHolds) {
  // A slicer that prints that box whatever it is given, in the middle of its bed.
  std::ofstream(folder_ / "box.gcode") << gcode_of_a_box();
  std::ofstream(folder_ / "bed.ini") << "bed_shape = 0x0,120x0,120x110,0x110\n";
  std::ofstream(folder_ / "slicer") << "#!/bin/sh\nwhile [ \"$1\" != --output ]; do shift; done\ncp '" +
                                           (folder_ / "box.gcode").string() + "' \"$2\"\n";
  fs::permissions(folder_ / "slicer", fs::perms::owner_all);
  write_mesh(folder_ / "box.stl", box({0, 0, 0}, {20, 10, 6}));
  const std::string slicer = (folder_ / "slicer").string();
  const Run made = run("stand box.stl --resolution 40 --slicer " + slicer + " --profile bed.ini -v");
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_TRUE(fs::exists(folder_ / "box_stand.gcode"));
  std::smatch found;
  ASSERT_TRUE(std::regex_search(made.out, found, std::regex("to judge it again: rayrep (.*)"))) << made.out;
  EXPECT_TRUE(mentions(found[1].str(), {"verify box_stand.gcode", "--original box.stl"}));
  const Run again = run(found[1].str());
  EXPECT_EQ(again.code, 0) << found[1].str() << "\n" << again.err;
  // What is only expected to be printed cannot be judged again.
  const Run by_hand = run("stand box.stl --resolution 40 --as-sliced box.gcode --of box.stl -v");
  EXPECT_EQ(by_hand.code, 0) << by_hand.err;
  EXPECT_EQ(by_hand.out.find("to judge it again"), std::string::npos);
}

TEST_F(Tool, NoNameCommandsATerminalOrBreaksTheReport) {
  for (const std::string name : {"a\x7f.stl",
                                 "a\xc2\x9b"
                                 "31m.stl",
                                 "a\x1b[31m.stl", "a\"\\.stl", "\xc3\xa4.stl"}) {
    fs::copy_file(folder_ / "egg.stl", folder_ / name);
    const Run result = run("inspect '" + name + "' --json");
    EXPECT_EQ(result.code, 0) << result.err;
    for (std::size_t n = 0; n < result.out.size(); ++n) {
      const auto c = static_cast<unsigned char>(result.out[n]);
      const auto next = static_cast<unsigned char>(n + 1 < result.out.size() ? result.out[n + 1] : 0);
      EXPECT_FALSE((c < 0x20 && c != '\n') || c == 0x7F || (c == 0xC2 && next >= 0x80 && next < 0xA0)) << name;
    }
    EXPECT_EQ(nlohmann::json::parse(result.out)["input"]["path"], name);
  }
}

TEST_F(Tool, NamesWithBlanksAndOtherScripts) {
  fs::copy(folder_ / "egg.stl", folder_ / "mein Ei 蛋.stl");
  const Run result = run("float 'mein Ei 蛋.stl' --resolution 40 --submerged 0.5");
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_TRUE(fs::exists(folder_ / "mein Ei 蛋_float.stl"));
}

}  // namespace
}  // namespace rayrep
