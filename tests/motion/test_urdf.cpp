// Robots that come as URDF: where their parts are, what is told of files that are wrong, and what the motion check makes of them.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "base/text.h"
#include "motion_scenes.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/io/write_file.h"
#include "rayrep/motion/urdf.h"
#include "rayrep/physics/moments.h"

namespace rayrep::test {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
namespace fs = std::filesystem;

std::string words(const Vector3d& v) {
  std::string text;
  for (int k = 0; k < 3; ++k) {
    append_number(text, v[k]);
    text += k < 2 ? " " : "";
  }
  return text;
}

std::string words(double value) {
  std::string text;
  append_number(text, value);
  return text;
}

class Urdf : public ::testing::Test {
protected:
  fs::path folder() const { return folder_.path(); }
  fs::path write(const std::string& text) const {
    std::ofstream(folder() / "robot.urdf", std::ios::binary) << text;
    return folder() / "robot.urdf";
  }
  SceneFile import(const std::string& text, const UrdfOptions& options = {}) const { return import_urdf(write(text), options); }
  std::string message(const std::string& text) const {
    return message_of([&] { import(text); }, ErrorCode::input);
  }

  TemporaryFolder folder_;
};

// -------------------------------------------------------------------------------------------------------------------- kinematics

/// A joint as this test knows it, in m and rad.
struct Joint {
  std::string name, type;
  Vector3d xyz, rpy, axis;
  double lower = 0, upper = 0;
  int mimics = -1;
  double multiplier = 1, offset = 0;
};

/// A chain of links, each a box, "link0" to "linkN".
struct Chain {
  std::vector<Joint> joints;

  std::string text() const {
    std::string all = "<?xml version=\"1.0\"?>\n<robot name=\"chain\">\n";
    for (std::size_t n = 0; n <= joints.size(); ++n)
      all += "<link name=\"link" + std::to_string(n) +
             "\"><collision><origin xyz=\"0.01 0.02 0.05\" rpy=\"0.1 0.2 0.3\"/><geometry><box size=\"0.02 0.03 0.1\"/></geometry>"
             "</collision></link>\n";
    for (std::size_t n = 0; n < joints.size(); ++n) {
      const Joint& j = joints[n];
      all += "<joint name=\"" + j.name + "\" type=\"" + j.type + "\"><parent link=\"link" + std::to_string(n) +
             "\"/><child link=\"link" + std::to_string(n + 1) + "\"/><origin xyz=\"" + words(j.xyz) + "\" rpy=\"" + words(j.rpy) +
             "\"/><axis xyz=\"" + words(j.axis) + "\"/>";
      if (j.type != "continuous") all += "<limit lower=\"" + words(j.lower) + "\" upper=\"" + words(j.upper) + "\"/>";
      if (j.mimics >= 0)
        all += "<mimic joint=\"" + joints[static_cast<std::size_t>(j.mimics)].name + "\" multiplier=\"" + words(j.multiplier) +
               "\" offset=\"" + words(j.offset) + "\"/>";
      all += "</joint>\n";
    }
    return all + "</robot>\n";
  }

  /// Values of all joints where the free ones have these.
  std::vector<double> all_values(const std::vector<double>& values) const {
    std::vector<double> all = values;
    for (std::size_t n = 0; n < joints.size(); ++n)
      if (joints[n].mimics >= 0) all[n] = joints[n].multiplier * all[static_cast<std::size_t>(joints[n].mimics)] + joints[n].offset;
    return all;
  }

  std::vector<double> rest() const {
    std::vector<double> values;
    for (const Joint& j : joints) values.push_back(j.type == "continuous" ? 0 : std::clamp(0.0, j.lower, j.upper));
    return values;
  }

  /// Where each link is, as a matrix in mm.
  std::vector<Eigen::Matrix4d> forward(const std::vector<double>& values) const {
    const std::vector<double> all = all_values(values);
    std::vector<Eigen::Matrix4d> links = {Eigen::Matrix4d::Identity()};
    for (std::size_t n = 0; n < joints.size(); ++n) {
      const Joint& j = joints[n];
      Eigen::Matrix4d origin = Eigen::Matrix4d::Identity(), moved = origin;
      const auto about = [](double angle, const Vector3d& axis) { return Eigen::AngleAxisd(angle, axis).toRotationMatrix(); };
      origin.topLeftCorner<3, 3>() =
          about(j.rpy.z(), Vector3d::UnitZ()) * about(j.rpy.y(), Vector3d::UnitY()) * about(j.rpy.x(), Vector3d::UnitX());
      origin.topRightCorner<3, 1>() = 1000 * j.xyz;
      if (j.type == "prismatic")
        moved.topRightCorner<3, 1>() = 1000 * all[n] * j.axis.normalized();
      else
        moved.topLeftCorner<3, 3>() = about(all[n], j.axis.normalized());
      links.emplace_back(links.back() * origin * moved);
    }
    return links;
  }
};

Chain draw_chain(Draw& draw) {
  Chain chain;
  const int count = draw.count(2, 5);
  for (int n = 0; n < count; ++n) {
    Joint j;
    j.name = "j" + std::to_string(n);
    const int kind = draw.count(0, 3);
    j.type = kind == 0 ? "prismatic" : kind == 1 ? "continuous" : "revolute";
    j.xyz = draw.vector(0.3);
    j.rpy = draw.vector(3);
    j.axis = draw.vector(2) + Vector3d(0, 0, 0.1);
    j.lower = draw.number(-2, 0.2);
    j.upper = j.lower + draw.number(0.3, 4);
    if (kind == 0) j.lower /= 10, j.upper /= 10;
    // Those after the first follow it in some chains, by a factor that keeps them small.
    if (n > 0 && chain.joints[0].mimics < 0 && draw.count(0, 3) == 0) {
      j.mimics = 0;
      j.multiplier = draw.number(-0.5, 0.5) * (kind == 0 ? 0.1 : 1);
      j.offset = draw.number(-0.2, 0.2) * (kind == 0 ? 0.1 : 1);
    }
    chain.joints.push_back(j);
  }
  return chain;
}

/// The value that the way "rest to j0 upper" leads joint j0 to.
double end_value(const Joint& joint, const std::string& way) {
  if (way.ends_with(" lower")) return joint.lower;
  return way.ends_with(" upper") ? joint.upper : 2 * kPi;
}

/// How far corners of a part are from where the chain's joints have them.
double deviation(const ScenePart& part, const PartPose& pose, const Eigen::Matrix4d& rest, const Eigen::Matrix4d& link) {
  const Eigen::Matrix4d moved = link * rest.inverse();
  double most = 0;
  for (const Vector3d& v : part.mesh->vertices) {
    const Vector3d expected = (moved * v.homogeneous()).head<3>();
    most = std::max(most, (pose.about(part.pivot_mm) * v - expected).norm());
  }
  return most;
}

/// What the notes say of it, in mm.
double told_deviation(const SceneFile& file) {
  const std::string begin = "between keys a part is where its joints have it to ";
  double told = 0;
  for (const std::string& note : file.notes)
    if (note.starts_with(begin)) parse_number(note.substr(begin.size(), note.find(" mm") - begin.size()), told);
  return told;
}

TEST_F(Urdf, PartsAreWhereTheProductOfJointsHasThem) {
  Draw draw(11);
  std::size_t ways = 0, within = 0;
  for (int scenes = 0; scenes < 30; ++scenes) {
    const Chain chain = draw_chain(draw);
    const SceneFile file = import(chain.text());
    const Scene& scene = file.scene;
    const double bound = told_deviation(file);
    within += bound <= 1.1 * kUrdfDeviation_mm;
    const std::vector<double> rest = chain.rest();
    const std::vector<Eigen::Matrix4d> at_rest = chain.forward(rest);
    for (const Transition& way : scene.transitions) {
      std::size_t j = 0;
      while (way.name.find(chain.joints[j].name + " ") == std::string::npos) ++j;
      ++ways;
      for (std::size_t p = 0; p < scene.parts.size(); ++p) {
        const auto off = [&](double time) {
          std::vector<double> values = rest;
          values[j] += time * (end_value(chain.joints[j], way.name) - rest[j]);
          const std::size_t link = static_cast<std::size_t>(scene.parts[p].name.back() - '0');
          return deviation(scene.parts[p], way.motions[p].at(time), at_rest[link], chain.forward(values)[link]);
        };
        for (const double end : {0.0, 1.0}) EXPECT_LT(off(end), 1e-6) << way.name;
        if (way.motions[p].translation.size() == way.motions[p].rotation.size()) {
          for (const TranslationKey& key : way.motions[p].translation) EXPECT_LT(off(key.time), 1e-6) << way.name;
        }
        for (int n = 0; n < 40; ++n) EXPECT_LE(off(draw.number(0, 1)), bound + 1e-9) << way.name << " part " << p;
      }
    }
  }
  EXPECT_GT(ways, 60u);
  EXPECT_GT(within, 25u);
}

TEST_F(Urdf, MotionOfOneJointIsExactForThePartItCarries) {
  Chain chain;
  chain.joints = {{"a", "revolute", {0.1, 0.2, 0.3}, {1, 2, 3}, {1, 2, -1}, -2.5, 2.9, -1, 1, 0}};
  const Scene scene = import(chain.text()).scene;
  for (const Transition& way : scene.transitions) {
    EXPECT_EQ(way.motions[1].translation.size(), 2u);  // only turned, about its pivot
    for (int n = 0; n <= 50; ++n) {
      const double time = n / 50.0;
      const auto link = chain.forward({time * end_value(chain.joints[0], way.name)})[1];
      EXPECT_LT(deviation(scene.parts[1], way.motions[1].at(time), chain.forward({0})[1], link), 1e-9);
    }
  }
}

TEST_F(Urdf, AreTheSameAfterTheyWereWritten) {
  Draw draw(5);
  for (int n = 0; n < 5; ++n) {
    Scene scene = import(draw_chain(draw).text()).scene;
    for (ScenePart& part : scene.parts) {
      part.file = folder() / (part.name + ".stl");
      write_mesh(part.file, *part.mesh);
    }
    std::ofstream(folder() / "scene.json") << scene_text(scene, folder() / "scene.json");
    const SceneFile again = read_scene(folder() / "scene.json");
    ASSERT_TRUE(again.problems.empty()) << again.problems[0].message;
    ASSERT_EQ(again.scene.transitions.size(), scene.transitions.size());
    ASSERT_EQ(again.scene.pairs.size(), scene.pairs.size());
    for (std::size_t t = 0; t < scene.transitions.size(); ++t) {
      EXPECT_EQ(again.scene.transitions[t].to, scene.transitions[t].to);
      for (std::size_t p = 0; p < scene.parts.size(); ++p)
        for (int k = 0; k <= 20; ++k) {
          const PartPose a = scene.transitions[t].motions[p].at(k / 20.0), b = again.scene.transitions[t].motions[p].at(k / 20.0);
          EXPECT_LT((a.translation_mm - b.translation_mm).norm(), 1e-9);
          EXPECT_LT(a.rotation.angularDistance(b.rotation), 1e-7);
        }
    }
  }
}

// ------------------------------------------------------------------------------------------------------------------- collisions

/// A forearm on an upper arm on a table: where the elbow bends, a corner of the forearm comes down on the table.
constexpr const char* kArm = R"(<robot name="arm">
  <link name="table"><collision><origin xyz="0 0 -0.01"/><geometry><box size="1 1 0.02"/></geometry></collision></link>
  <link name="upper"><collision><origin xyz="0 0 0.1"/><geometry><box size="0.02 0.02 0.16"/></geometry></collision></link>
  <link name="fore"><collision><origin xyz="0 0 0.15"/><geometry><box size="0.02 0.02 0.26"/></geometry></collision></link>
  <joint name="shoulder" type="continuous"><parent link="table"/><child link="upper"/><origin xyz="0 0 0"/><axis xyz="0 0 1"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="fore"/><origin xyz="0 0 0.2"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="2.8"/></joint>
</robot>)";

TEST_F(Urdf, TwoLinksCollideAtTheAngleOfTrigonometry) {
  const Scene scene = import(kArm).scene;
  const auto way = std::find_if(scene.transitions.begin(), scene.transitions.end(),
                                [](const Transition& t) { return t.name == "rest to elbow upper"; });
  ASSERT_NE(way, scene.transitions.end());
  MotionCheckOptions how;
  how.tolerance = 1e-5;
  const MotionReport report = MotionChecker().check(scene, how);
  const std::size_t number = static_cast<std::size_t>(way - scene.transitions.begin());
  const std::size_t table = scene.part("table"), fore = scene.part("fore");
  double from = -1;
  for (const PairMotion& pair : report.pairs) {
    if (pair.transition == number && pair.first == table && pair.second == fore) {
      ASSERT_EQ(pair.intervals.size(), 1u);
      from = pair.intervals[0].from;
    } else {
      EXPECT_TRUE(pair.intervals.empty()) << scene.transitions[pair.transition].name;
    }
  }
  // Its corner at (10, 280) from the elbow, 200 mm above the table: 280 cos a - 10 sin a = -200.
  const double angle = std::acos(-200 / std::hypot(280, 10)) - std::atan2(10, 280);
  EXPECT_NEAR(2.8 * from, angle, 1e-4);
}

// ------------------------------------------------------------------------------------------------------------- shapes and links

double volume(const Mesh& mesh) { return mesh_moments(mesh)[0]; }

TEST_F(Urdf, ShapesAreSolidsOfTheirSizeInTheirPlace) {
  const Scene scene = import(R"(<robot name="shapes"><link name="a"><collision><origin xyz="1 2 3"/><geometry>
    <cylinder radius="0.05" length="0.2"/></geometry></collision></link><link name="b"><visual><geometry><sphere radius="0.04"/></geometry>
    </visual></link><joint name="j" type="prismatic"><parent link="a"/><child link="b"/><origin xyz="0 0 0.5" rpy="0 1.5707963267948966 0"/>
    <limit lower="-0.1" upper="0.3"/></joint></robot>)")
                          .scene;
  ASSERT_EQ(scene.parts.size(), 2u);
  EXPECT_NEAR(volume(*scene.parts[0].mesh), kPi * 50 * 50 * 200, 2e-3 * kPi * 50 * 50 * 200);
  EXPECT_NEAR(volume(*scene.parts[1].mesh), 4 / 3.0 * kPi * 64e3, 3e-3 * 4 / 3.0 * kPi * 64e3);
  EXPECT_TRUE(bounding_box(*scene.parts[0].mesh).center().isApprox(Vector3d(1000, 2000, 3000)));
  EXPECT_EQ(scene.parts[1].pivot_mm, Vector3d(0, 0, 500));
  // Pushed along x of a frame whose x points down.
  ASSERT_EQ(scene.states.size(), 3u);
  EXPECT_TRUE(scene.states[1].poses[1].translation_mm.isApprox(Vector3d(0, 0, 100)));
  EXPECT_TRUE(scene.states[2].poses[1].translation_mm.isApprox(Vector3d(0, 0, -300)));
  EXPECT_EQ(scene.pairs.size(), 1u);
}

TEST_F(Urdf, FixedLinksAreOnePartAndEmptyLinksNone) {
  const std::string text =
      R"(<robot name="r"><link name="world"/><link name="base"><collision><geometry><box size="1 1 1"/></geometry>
    </collision></link><link name="foot"><collision><origin xyz="2 0 0"/><geometry><box size="1 1 1"/></geometry></collision></link>
    <link name="cross"/><link name="head"><visual><geometry><box size="0.1 0.1 0.1"/></geometry></visual><collision><origin xyz="0 0 2"/>
    <geometry><box size="0.2 0.2 0.2"/></geometry></collision></link>
    <joint name="w" type="fixed"><parent link="world"/><child link="base"/></joint>
    <joint name="f" type="fixed"><parent link="base"/><child link="foot"/></joint>
    <joint name="pan" type="continuous"><parent link="base"/><child link="cross"/><axis xyz="0 0 1"/></joint>
    <joint name="tilt" type="revolute"><parent link="cross"/><child link="head"/><limit lower="0.1" upper="0.4"/></joint></robot>)";
  const SceneFile file = import(text);
  ASSERT_EQ(file.scene.parts.size(), 2u);
  EXPECT_EQ(file.scene.parts[0].name, "base");
  EXPECT_EQ(file.scene.parts[1].name, "head");
  EXPECT_NEAR(volume(*file.scene.parts[0].mesh), 2e9, 1);
  EXPECT_NEAR(volume(*file.scene.parts[1].mesh), 8e6, 1);
  EXPECT_NEAR(volume(*import(text, {.visual = true}).scene.parts[1].mesh), 1e6, 1);
  ASSERT_EQ(file.scene.pairs.size(), 1u);
  // Round and back to rest, and from the lower limit, which is rest, to the upper one.
  ASSERT_EQ(file.scene.transitions.size(), 2u);
  EXPECT_EQ(file.scene.transitions[0].name, "pan round");
  EXPECT_EQ(file.scene.transitions[0].to, 0u);
  EXPECT_EQ(file.scene.transitions[1].name, "rest to tilt upper");
  std::string notes;
  for (const std::string& note : file.notes) notes += note + "\n";
  EXPECT_TRUE(mentions(notes, {"'foot'", "'tilt' rests at 0.1"}));
}

TEST_F(Urdf, MeshesAreFoundNextToTheFileAndScaled) {
  const Mesh wedge = transformed(unit_tetrahedron(), Eigen::Affine3d(Eigen::Scaling(0.1)));
  fs::create_directories(folder() / "my_robot" / "meshes");
  fs::create_directories(folder() / "my_robot" / "urdf");
  write_mesh(folder() / "my_robot" / "meshes" / "wedge.stl", wedge);
  const fs::path robot = folder() / "my_robot" / "urdf" / "robot.urdf";
  const auto volume_of = [&](const std::string& name, const std::string& scale) {
    std::ofstream(robot) << "<robot name=\"r\"><link name=\"a\"><visual><geometry><mesh filename=\"" + name + "\" " + scale +
                                "/></geometry></visual></link></robot>";
    return volume(*import_urdf(robot).scene.parts[0].mesh);
  };
  const double expected = 1e-3 * 1e9 / 6;
  for (const char* name : {"package://my_robot/meshes/wedge.stl", "../meshes/wedge.stl"})
    EXPECT_NEAR(volume_of(name, ""), expected, 1);
  EXPECT_NEAR(volume_of("file://" + (folder() / "my_robot/meshes/wedge.stl").string(), ""), expected, 1);
  EXPECT_NEAR(volume_of("../meshes/wedge.stl", "scale=\"1 -2 0.5\""), expected, 1);
  const std::string none = message_of([&] { volume_of("package://other/wedge.stl", ""); }, ErrorCode::input);
  EXPECT_TRUE(mentions(none, {"link 'a'", "package://other/wedge.stl", "does not exist"}));
}

TEST_F(Urdf, JointsThatMimicMoveWithTheirs) {
  const SceneFile file =
      import(R"(<robot name="gripper"><link name="palm"/><link name="l"><collision><geometry><box size="0.01 0.01 0.05"/>
    </geometry></collision></link><link name="r"><collision><origin xyz="0.1 0 0"/><geometry><box size="0.01 0.01 0.05"/></geometry>
    </collision></link>
    <joint name="left" type="prismatic"><parent link="palm"/><child link="l"/><limit lower="0" upper="0.04"/></joint>
    <joint name="right" type="prismatic"><parent link="palm"/><child link="r"/><limit lower="-0.03" upper="0"/>
      <mimic joint="left" multiplier="-1"/></joint></robot>)");
  ASSERT_EQ(file.scene.transitions.size(), 1u);
  const SceneState& open = file.scene.states[1];
  EXPECT_TRUE(open.poses[0].translation_mm.isApprox(Vector3d(40, 0, 0)));
  EXPECT_TRUE(open.poses[1].translation_mm.isApprox(Vector3d(-40, 0, 0)));
  EXPECT_TRUE(mentions(file.notes.at(0), {"'right' follows 'left' beyond its own limits, to -0.04"}));
}

// -------------------------------------------------------------------------------------------------------------------- bad files

const std::string kBox = "<collision><geometry><box size=\"1 1 1\"/></geometry></collision>";
std::string link(const std::string& name) { return "<link name=\"" + name + "\">" + kBox + "</link>"; }
std::string joint(const std::string& name, const std::string& parent, const std::string& child, const std::string& more = "") {
  return "<joint name=\"" + name + "\" type=\"revolute\"><parent link=\"" + parent + "\"/><child link=\"" + child + "\"/>" +
         (more.empty() ? "<limit lower=\"0\" upper=\"1\"/>" : more) + "</joint>";
}
std::string robot(const std::string& text) { return "<robot name=\"r\">" + text + "</robot>"; }

TEST_F(Urdf, TellsWhatIsWrongWithNames) {
  EXPECT_TRUE(mentions(message(""), {"robot.urdf", "no URDF"}));
  EXPECT_TRUE(mentions(message("<robot><link name=\"a\"></robot>"), {"byte", "XML is damaged"}));
  EXPECT_TRUE(mentions(message("<sdf/>"), {"SDF, not URDF"}));
  EXPECT_TRUE(mentions(message(robot("<xacro:macro name=\"m\"/>")), {"macros", "xacro FILE.xacro"}));
  EXPECT_TRUE(mentions(message(robot("")), {"no <link>"}));
  EXPECT_TRUE(mentions(message(robot("<link name=\"a\"/>")), {"no link has a shape"}));
  EXPECT_TRUE(mentions(message(robot(link("a") + link("a"))), {"two links 'a'"}));
  EXPECT_TRUE(mentions(message(robot(link("arm") + link("hand") + joint("j", "arn", "hand"))),
                       {"'j'", "'arn' is no link", "is it 'arm'?"}));
  EXPECT_TRUE(mentions(message(robot(link("a") + link("b") + joint("j", "a", "b", "<axis xyz=\"0 0 1\"/>"))),
                       {"'j'", "<limit", "continuous"}));
  EXPECT_TRUE(mentions(message(robot(link("a") + link("b") + joint("j", "a", "b", "<limit lower=\"1\" upper=\"0\"/>"))),
                       {"lower limit 1"}));
  EXPECT_TRUE(
      mentions(message(robot(link("a") + link("b") + joint("j", "a", "b", "<limit lower=\"nan\" upper=\"0\"/>"))), {"'nan'"}));
  EXPECT_TRUE(mentions(
      message(robot(link("a") + link("b") + joint("j", "a", "b", "<axis xyz=\"0 0 0\"/><limit lower=\"0\" upper=\"1\"/>"))),
      {"no direction"}));
  EXPECT_TRUE(mentions(
      message(robot(link("a") + link("b") + joint("j", "a", "b", "<origin xyz=\"0 0\"/><limit lower=\"0\" upper=\"1\"/>"))),
      {"three numbers"}));
  EXPECT_TRUE(
      mentions(message(robot("<link name=\"a\"><visual><geometry><capsule/></geometry></visual></link>")), {"'a'", "'capsule'"}));
  EXPECT_TRUE(mentions(message(robot("<link name=\"a\"><visual><geometry><sphere radius=\"-1\"/></geometry></visual></link>")),
                       {"radius"}));
  EXPECT_TRUE(mentions(message(robot("<link name=\"a\"><visual><geometry><mesh filename=\"a.dae\"/></geometry></visual></link>")),
                       {"link 'a'", "a.dae", "does not exist"}));
  std::ofstream(folder() / "a.dae") << "<COLLADA/>";
  EXPECT_TRUE(mentions(message(robot("<link name=\"a\"><visual><geometry><mesh filename=\"a.dae\"/></geometry></visual></link>")),
                       {"link 'a'", "COLLADA"}));
}

TEST_F(Urdf, TellsWhatIsNoTree) {
  EXPECT_TRUE(mentions(message(robot(link("a") + link("b"))), {"2 links are no joint's child ('a', 'b')"}));
  EXPECT_TRUE(
      mentions(message(robot(link("a") + link("b") + joint("j", "a", "b") + joint("k", "b", "a"))), {"in a circle", "'a'", "'b'"}));
  EXPECT_TRUE(mentions(message(robot(link("a") + joint("j", "a", "a"))), {"in a circle: 'a'"}));
  EXPECT_TRUE(
      mentions(message(robot(link("r") + link("a") + link("b") + joint("j", "a", "b") + joint("k", "b", "a"))), {"in a circle"}));
  EXPECT_TRUE(mentions(message(robot(link("a") + link("b") + link("c") + joint("j", "a", "c") + joint("k", "b", "c"))),
                       {"'c' is the child of two joints, 'j' and 'k'"}));
  const std::string mimic = "<limit lower=\"0\" upper=\"1\"/><mimic joint=\"";
  EXPECT_TRUE(mentions(message(robot(link("a") + link("b") + joint("j", "a", "b", mimic + "x\"/>"))), {"'x', which is no joint"}));
  EXPECT_TRUE(mentions(message(robot(link("a") + link("b") + joint("j", "a", "b", mimic + "j\"/>"))), {"mimics itself"}));
}

TEST_F(Urdf, HostileFilesEndWithAMessage) {
  std::string bomb = "<!DOCTYPE robot [<!ENTITY a \"ha\">";
  for (char c = 'b'; c < 'p'; ++c) bomb += std::string("<!ENTITY ") + c + " \"" + std::string(10, '&') + "\">";
  EXPECT_TRUE(mentions(
      message(bomb + "]><robot name=\"r\"><link name=\"&p;\"><visual><geometry><sphere radius=\"&p;\"/></geometry></visual>"
                     "</link></robot>"),
      {"radius", "'&p;'"}));
  std::string deep = "<robot>";
  for (int n = 0; n < 200'000; ++n) deep += "<a>";
  EXPECT_TRUE(mentions(message(deep), {"XML is damaged"}));
  std::string many = "";
  for (int n = 0; n < 5000; ++n) many += "<link name=\"l" + std::to_string(n) + "\"/>";
  EXPECT_TRUE(mentions(message(robot(many)), {"more than 2000 <link>"}));
  std::string snake = link("l0");
  for (int n = 1; n < 300; ++n)
    snake += link("l" + std::to_string(n)) + joint("j" + std::to_string(n), "l" + std::to_string(n - 1), "l" + std::to_string(n));
  EXPECT_TRUE(mentions(message(robot(snake)), {"299 joints move", "at most 128"}));
  EXPECT_TRUE(mentions(message_of([&] { import_urdf(folder()); }, ErrorCode::input), {"Cannot read"}));
  EXPECT_TRUE(mentions(message(std::string("\x1f\x8b\0\xff", 4)), {"robot.urdf"}));
}

}  // namespace
}  // namespace rayrep::test
