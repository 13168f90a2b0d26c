// Scenes as glTF: read back by the formulas of its specification, parts are where the scene has them.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>

#include "motion_scenes.h"
#include "rayrep/motion/gltf.h"

namespace rayrep::test {
namespace {

using Eigen::Isometry3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

/// As much of a reader of glTF 2.0 as these scenes take.
class Glb {
public:
  explicit Glb(std::string bytes) : bytes_(std::move(bytes)) {
    const std::size_t json_size = word(12);
    json = nlohmann::json::parse(bytes_.substr(20, json_size));
    begin_ = 20 + json_size + 8;
  }

  bool well_formed() const {
    const std::size_t binary = begin_ - 8;
    return bytes_.substr(0, 4) == "glTF" && word(4) == 2 && word(8) == bytes_.size() && bytes_.substr(16, 4) == "JSON" &&
           word(12) % 4 == 0 && word(binary) == json["buffers"][0]["byteLength"] && bytes_.size() == begin_ + word(binary) &&
           bytes_.substr(binary + 4, 4) == std::string("BIN\0", 4);
  }

  /// Rows of an accessor.
  std::vector<Eigen::VectorXd> rows(std::size_t accessor) const {
    const nlohmann::json& a = json["accessors"][accessor];
    const nlohmann::json& view = json["bufferViews"][a["bufferView"].get<std::size_t>()];
    const std::string type = a["type"];
    const Eigen::Index width = type == "SCALAR" ? 1 : type[3] - '0';
    std::size_t at = begin_ + view["byteOffset"].get<std::size_t>() + a["byteOffset"].get<std::size_t>();
    std::vector<Eigen::VectorXd> rows(a["count"].get<std::size_t>(), Eigen::VectorXd(width));
    for (Eigen::VectorXd& row : rows)
      for (double& entry : row) {
        const std::uint32_t bits = word(at);
        float number;
        std::memcpy(&number, &bits, 4);
        entry = a["componentType"] == 5125 ? bits : static_cast<double>(number);
        at += 4;
      }
    return rows;
  }

  /// Of a node in its parent, at a time of an animation.
  Isometry3d pose(std::size_t node, const nlohmann::json& animation, double time) const {
    Isometry3d pose = Isometry3d::Identity();
    for (const nlohmann::json& channel : animation["channels"]) {
      if (channel["target"]["node"] != node) continue;
      const nlohmann::json& sampler = animation["samplers"][channel["sampler"].get<std::size_t>()];
      const auto times = rows(sampler["input"]), keys = rows(sampler["output"]);
      std::size_t k = 0;
      while (k + 2 < times.size() && times[k + 1][0] <= time) ++k;
      const double length = times[k + 1][0] - times[k][0], t = std::clamp((time - times[k][0]) / length, 0.0, 1.0);
      if (channel["target"]["path"] == "translation")
        pose.translation() = hermite(keys, k, t, length);
      else
        pose.linear() = slerp(keys[k], keys[k + 1], t).toRotationMatrix();
    }
    return pose;
  }

  nlohmann::json json;

private:
  std::uint32_t word(std::size_t at) const {
    std::uint32_t value = 0;
    for (std::size_t k = 0; k < 4; ++k)
      value |= static_cast<std::uint32_t>(static_cast<unsigned char>(bytes_.at(at + k))) << (8 * k);
    return value;
  }

  /// CUBICSPLINE: of each key its tangent before, its value, its tangent after.
  static Vector3d hermite(const std::vector<Eigen::VectorXd>& keys, std::size_t k, double t, double length) {
    return (2 * t * t * t - 3 * t * t + 1) * keys[3 * k + 1] + length * (t * t * t - 2 * t * t + t) * keys[3 * k + 2] +
           (3 * t * t - 2 * t * t * t) * keys[3 * k + 4] + length * (t * t * t - t * t) * keys[3 * k + 3];
  }

  static Quaterniond slerp(const Eigen::VectorXd& a, const Eigen::VectorXd& b, double t) {
    const double d = a.dot(b), angle = std::acos(std::min(1.0, std::abs(d)));
    if (angle < 1e-6) return Quaterniond(Eigen::Vector4d(a)).normalized();
    const double sign = d < 0 ? -1 : 1;
    const Eigen::Vector4d q = std::sin((1 - t) * angle) / std::sin(angle) * a + sign * std::sin(t * angle) / std::sin(angle) * b;
    return Quaterniond(q).normalized();
  }

  std::string bytes_;
  std::size_t begin_ = 0;
};

Scene drawn_scene(Draw& draw) {
  Scene scene;
  for (const char* name : {"one", "two"}) {
    scene.parts.push_back(scene_part(name, mesh_of(draw_boxes(draw))));
    scene.parts.back().pivot_mm = draw.vector(20);
  }
  Transition way{"there", 0, 1, {draw_motion(draw), draw_motion(draw)}};
  for (int s = 0; s < 2; ++s) {
    SceneState state{s == 0 ? "before" : "after", draw.vector(1), {}};
    for (const Motion& motion : way.motions) state.poses.push_back(motion.at(s));
    scene.states.push_back(state);
  }
  scene.transitions = {way};
  return scene;
}

/// How far in mm corners are from where they should be, in axes in which the scene's up is +Y.
double furthest_off(const Scene& scene, const Glb& glb, double time) {
  const nlohmann::json& animation = glb.json["animations"][0];
  const Isometry3d up = glb.pose(0, animation, kGltfSeconds * time);
  double most = 0;
  for (std::size_t p = 0; p < scene.parts.size(); ++p) {
    const Isometry3d pose = up * glb.pose(p + 1, animation, kGltfSeconds * time);
    const auto points = glb.rows(glb.json["meshes"][p]["primitives"][0]["attributes"]["POSITION"]);
    const Isometry3d wanted = scene.transitions[0].motions[p].at(time).about(scene.parts[p].pivot_mm);
    for (std::size_t n = 0; n < points.size(); ++n) {
      const Vector3d expected = up * (wanted * scene.parts[p].mesh->vertices[n]);
      most = std::max(most, (1000 * (pose * Vector3d(points[n])) - expected).norm());
    }
  }
  return most;
}

TEST(Gltf, PartsAreWhereTheSceneHasThem) {
  Draw draw(3);
  for (int n = 0; n < 30; ++n) {
    const Scene scene = drawn_scene(draw);
    const Glb glb(to_glb(scene));
    ASSERT_TRUE(glb.well_formed());
    for (int k = 0; k <= 20; ++k) EXPECT_LT(furthest_off(scene, glb, k / 20.0), 1e-4);
    for (int s = 0; s < 2; ++s) {
      const Isometry3d up = glb.pose(0, glb.json["animations"][0], kGltfSeconds * s);
      EXPECT_LT((up * scene.states[static_cast<std::size_t>(s)].up.normalized() - Vector3d::UnitY()).norm(), 1e-6);
    }
    for (std::size_t p = 0; p < 2; ++p) {
      const auto indices = glb.rows(glb.json["meshes"][p]["primitives"][0]["indices"]);
      ASSERT_EQ(indices.size(), 3 * scene.parts[p].mesh->triangles.size());
      for (std::size_t i = 0; i < indices.size(); ++i)
        EXPECT_EQ(indices[i][0], scene.parts[p].mesh->triangles[i / 3][static_cast<Eigen::Index>(i % 3)]);
    }
    EXPECT_EQ(to_glb(scene), to_glb(scene));
  }
}

TEST(Gltf, HalfATurnAndKeysCloseTogetherStayExact) {
  const Quaterniond half(0, 0, 1, 0);
  Scene scene = fly_by(box(Vector3d::Zero(), Vector3d::Ones()), box({2, 0, 0}, {3, 1, 1}), {}, moved_by({0, 0, 10}, half));
  Motion& motion = scene.transitions[0].motions[1];
  motion.translation.insert(motion.translation.begin() + 1,
                            {{0.5, {0, 1, 0}, {0, 1, 0}, {0, 1, 0}}, {0.5 + 1e-9, {0, 1, 1}, {}, {}}});
  straighten(motion);
  const Glb glb(to_glb(scene));
  const nlohmann::json& animation = glb.json["animations"][0];
  for (const nlohmann::json& sampler : animation["samplers"]) {
    const auto times = glb.rows(sampler["input"]);
    EXPECT_EQ(times.front()[0], 0);
    EXPECT_EQ(times.back()[0], kGltfSeconds);
    for (std::size_t n = 1; n < times.size(); ++n) EXPECT_GT(times[n][0], times[n - 1][0]);
    if (sampler["interpolation"] == "CUBICSPLINE") continue;
    const auto keys = glb.rows(sampler["output"]);
    for (std::size_t n = 1; n < keys.size(); ++n) EXPECT_GT(keys[n].dot(keys[n - 1]), 0.4);
  }
  for (const double time : {0.0, 0.2, 0.4, 0.7, 1.0}) EXPECT_LT(furthest_off(scene, glb, time), 1e-4);
}

TEST(Gltf, SceneWithoutStatesIsItsParts) {
  Scene scene;
  scene.parts = {scene_part("\xff \"name\"", box({0, 0, 0}, {1, 2, 3}))};
  const Glb glb(to_glb(scene));
  EXPECT_TRUE(glb.well_formed());
  EXPECT_FALSE(glb.json.contains("animations"));
  EXPECT_EQ(glb.json["accessors"][0]["max"], nlohmann::json({0.001f, 0.002f, 0.003f}));
  EXPECT_EQ(glb.json["bufferViews"].size(), 2u);
}

}  // namespace
}  // namespace rayrep::test
