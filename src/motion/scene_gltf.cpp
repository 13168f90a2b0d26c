#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>
#include <vector>

#include "rayrep/base/error.h"
#include "rayrep/motion/gltf.h"

namespace rayrep {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using Json = nlohmann::ordered_json;

constexpr double kMetre = 1e-3;

/// sRGB, as the page shows parts.
constexpr std::array<std::uint32_t, 8> kColours = {0x4e86c6, 0x3f9c8f, 0xc2a33c, 0x8f74bf, 0x77858f, 0x7f9a45, 0xa5785a, 0xc27fae};

double linear(std::uint32_t byte) {
  const double c = (byte & 255) / 255.0;
  return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
}

Json material(std::size_t number) {
  const std::uint32_t c = kColours[number];
  return {
      {"pbrMetallicRoughness",
       {{"baseColorFactor", {linear(c >> 16), linear(c >> 8), linear(c), 1}}, {"metallicFactor", 0}, {"roughnessFactor", 0.8}}}};
}

Json json_of(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }
Json json_of(const Quaterniond& q) { return {q.x(), q.y(), q.z(), q.w()}; }

void append_word(std::uint32_t word, std::string& bytes) {
  for (int k = 0; k < 4; ++k) bytes += static_cast<char>(word >> (8 * k) & 255);
}

// The kinds of data in the file, each in a view of its own.
enum View : std::size_t { kIndices, kPositions, kKeys, kViews };

/// All numbers of the file, with the accessors that say what they are.
class Data {
public:
  std::size_t add_indices(const std::vector<Eigen::Vector3i>& triangles) {
    const std::size_t begin = bytes_[kIndices].size();
    for (const Eigen::Vector3i& t : triangles)
      for (const int corner : t) put(kIndices, static_cast<std::uint32_t>(corner));
    constexpr int kUnsignedInt = 5125;
    return add({{"bufferView", kIndices},
                {"byteOffset", begin},
                {"componentType", kUnsignedInt},
                {"count", 3 * triangles.size()},
                {"type", "SCALAR"}});
  }

  std::size_t add_positions(const std::vector<Vector3d>& points) {
    std::vector<double> numbers;
    Eigen::AlignedBox3f box;  // of what is stored
    for (const Vector3d& p : points) {
      box.extend(p.cast<float>());
      numbers.insert(numbers.end(), p.begin(), p.end());
    }
    const std::size_t number = add_floats(kPositions, numbers, "VEC3");
    accessors_[number]["min"] = {box.min().x(), box.min().y(), box.min().z()};
    accessors_[number]["max"] = {box.max().x(), box.max().y(), box.max().z()};
    return number;
  }

  std::size_t add_times(const std::vector<double>& times) {
    const std::size_t number = add_floats(kKeys, times, "SCALAR");
    accessors_[number]["min"] = {times.front()};
    accessors_[number]["max"] = {times.back()};
    return number;
  }

  std::size_t add_keys(const std::vector<double>& numbers, const char* type) { return add_floats(kKeys, numbers, type); }

  const Json& accessors() const { return accessors_; }

  Json views() const {
    constexpr int kArrayBuffer = 34962, kElementBuffer = 34963;
    Json views = Json::array();
    std::size_t begin = 0;
    for (std::size_t v = 0; v < kViews; begin += bytes_[v++].size())
      views.push_back({{"buffer", 0}, {"byteOffset", begin}, {"byteLength", bytes_[v].size()}});
    views[kIndices]["target"] = kElementBuffer;
    views[kPositions]["byteStride"] = 12;
    views[kPositions]["target"] = kArrayBuffer;
    if (bytes_[kKeys].empty()) views.erase(kKeys);
    return views;
  }

  std::string bytes() const { return bytes_[kIndices] + bytes_[kPositions] + bytes_[kKeys]; }

private:
  std::size_t add(Json accessor) {
    accessors_.push_back(std::move(accessor));
    return accessors_.size() - 1;
  }

  std::size_t add_floats(View view, const std::vector<double>& numbers, const char* type) {
    const std::size_t begin = bytes_[view].size();
    for (const double number : numbers) put(view, std::bit_cast<std::uint32_t>(static_cast<float>(number)));
    const std::size_t width = std::string(type) == "SCALAR" ? 1 : static_cast<std::size_t>(type[3] - '0');
    constexpr int kFloat = 5126;
    return add({{"bufferView", view},
                {"byteOffset", begin},
                {"componentType", kFloat},
                {"count", numbers.size() / width},
                {"type", type}});
  }

  void put(View view, std::uint32_t word) { append_word(word, bytes_[view]); }

  std::array<std::string, kViews> bytes_;
  Json accessors_ = Json::array();
};

/// As float32 has them in s: strictly ascending.
template <typename Key>
std::vector<double> seconds_of(const std::vector<Key>& keys) {
  std::vector<double> times;
  for (const Key& key : keys) {
    auto time = static_cast<float>(kGltfSeconds * key.time);
    if (!times.empty() && !(time > times.back()))
      time = std::nextafter(static_cast<float>(times.back()), std::numeric_limits<float>::infinity());
    times.push_back(time);
  }
  return times;
}

/// One key is a rest: two of them say so until the end. None is the pose where the mesh has the part.
template <typename Key>
std::vector<Key> from_begin_to_end(std::vector<Key> keys) {
  if (keys.empty()) keys.emplace_back();
  if (keys.size() > 1) return keys;
  keys.push_back(keys.front());
  keys.front().time = 0;
  keys.back().time = 1;
  return keys;
}

/// Turns of no more than 120 degrees from key to key, each the shorter way as it is written.
std::vector<RotationKey> in_short_turns(const std::vector<RotationKey>& keys) {
  constexpr double kMost = 2 * std::numbers::pi / 3 + 1e-6;
  std::vector<RotationKey> all;
  const auto add = [&all](RotationKey key) {
    if (!all.empty() && all.back().rotation.dot(key.rotation) < 0) key.rotation.coeffs() *= -1;
    all.push_back(key);
  };
  for (const RotationKey& key : keys) {
    if (!all.empty() && all.back().rotation.angularDistance(key.rotation) > kMost)
      add({(all.back().time + key.time) / 2, all.back().rotation.slerp(0.5, key.rotation)});
    add(key);
  }
  return all;
}

class GlbWriter {
public:
  explicit GlbWriter(const Scene& scene) : scene_(scene) {}

  std::string write() {
    gltf_ = {{"asset", {{"version", "2.0"}, {"generator", "rayrep"}}},
             {"scene", 0},
             {"scenes", {{{"name", "scene"}, {"nodes", {0}}}}},
             {"nodes", Json::array()},
             {"meshes", Json::array()},
             {"materials", Json::array()}};
    for (std::size_t n = 0; n < std::min(scene_.parts.size(), kColours.size()); ++n) gltf_["materials"].push_back(material(n));
    add_nodes();
    for (const Transition& transition : scene_.transitions) gltf_["animations"].push_back(animation(transition));
    gltf_["accessors"] = data_.accessors();
    gltf_["bufferViews"] = data_.views();
    const std::string bytes = data_.bytes();
    gltf_["buffers"] = {{{"byteLength", bytes.size()}}};
    return in_chunks(gltf_.dump(-1, ' ', false, Json::error_handler_t::replace), bytes);
  }

private:
  /// Node 0 turns up to +Y; that of part p is number p + 1.
  void add_nodes() {
    Json children = Json::array();
    for (std::size_t p = 0; p < scene_.parts.size(); ++p) children.push_back(p + 1);
    gltf_["nodes"].push_back({{"name", "up"},
                              {"rotation", json_of(upright(scene_.states.empty() ? Vector3d::UnitZ() : scene_.states[0].up))},
                              {"children", children}});
    for (std::size_t p = 0; p < scene_.parts.size(); ++p) {
      const ScenePart& part = scene_.parts[p];
      const PartPose pose = scene_.states.empty() ? PartPose() : scene_.states[0].poses[p];
      gltf_["nodes"].push_back({{"name", part.name},
                                {"mesh", p},
                                {"translation", json_of(kMetre * (part.pivot_mm + pose.translation_mm))},
                                {"rotation", json_of(pose.rotation)}});
      std::vector<Vector3d> points;
      for (const Vector3d& v : part.mesh->vertices) points.push_back(kMetre * (v - part.pivot_mm));
      const std::size_t positions = data_.add_positions(points);
      gltf_["meshes"].push_back({{"name", part.name},
                                 {"primitives",
                                  {{{"attributes", {{"POSITION", positions}}},
                                    {"indices", data_.add_indices(part.mesh->triangles)},
                                    {"material", p % kColours.size()}}}}});
    }
  }

  static Quaterniond upright(const Vector3d& up) {
    const Eigen::AngleAxisd z_to_y(-std::numbers::pi / 2, Vector3d::UnitX());
    return Quaterniond(z_to_y * up_to_z(up)).normalized();
  }

  Json animation(const Transition& transition) {
    Json animation = {{"name", transition.name}, {"channels", Json::array()}, {"samplers", Json::array()}};
    const auto add = [&animation](std::size_t node, const char* path, Json sampler) {
      animation["channels"].push_back({{"sampler", animation["samplers"].size()}, {"target", {{"node", node}, {"path", path}}}});
      animation["samplers"].push_back(std::move(sampler));
    };
    const RotationKey begin{0, upright(scene_.states[transition.from].up)}, end{1, upright(scene_.states[transition.to].up)};
    add(0, "rotation", rotation({begin, end}));
    for (std::size_t p = 0; p < scene_.parts.size(); ++p) {
      add(p + 1, "translation", translation(transition.motions[p].translation, scene_.parts[p].pivot_mm));
      add(p + 1, "rotation", rotation(transition.motions[p].rotation));
    }
    return animation;
  }

  Json translation(const std::vector<TranslationKey>& moved, const Vector3d& pivot_mm) {
    const std::vector<TranslationKey> keys = from_begin_to_end(moved);
    const std::vector<double> times = seconds_of(keys);
    std::vector<double> numbers;
    const auto add = [&numbers](const Vector3d& v) { numbers.insert(numbers.end(), v.begin(), v.end()); };
    for (std::size_t n = 0; n < keys.size(); ++n) {
      const TranslationKey& key = keys[n];
      const Vector3d none = Vector3d::Zero();
      add(n > 0 ? Vector3d(3 * kMetre * (key.at_mm - key.in_mm) / (times[n] - times[n - 1])) : none);
      add(kMetre * (pivot_mm + key.at_mm));
      add(n + 1 < keys.size() ? Vector3d(3 * kMetre * (key.out_mm - key.at_mm) / (times[n + 1] - times[n])) : none);
    }
    return {{"input", data_.add_times(times)}, {"output", data_.add_keys(numbers, "VEC3")}, {"interpolation", "CUBICSPLINE"}};
  }

  Json rotation(const std::vector<RotationKey>& turned) {
    const std::vector<RotationKey> keys = in_short_turns(from_begin_to_end(turned));
    std::vector<double> numbers;
    for (const RotationKey& key : keys)
      for (const double c : key.rotation.coeffs()) numbers.push_back(c);
    return {{"input", data_.add_times(seconds_of(keys))}, {"output", data_.add_keys(numbers, "VEC4")}, {"interpolation", "LINEAR"}};
  }

  static std::string in_chunks(std::string json, const std::string& bytes) {
    json.resize((json.size() + 3) / 4 * 4, ' ');
    std::string glb;
    const auto word = [&glb](std::size_t value) { append_word(static_cast<std::uint32_t>(value), glb); };
    const std::size_t whole = 12 + 8 + json.size() + 8 + bytes.size();
    if (whole > std::numeric_limits<std::uint32_t>::max())
      throw Error(ErrorCode::write, "The scene takes more than the 4 GB that a .glb file can hold: use coarser meshes.");
    glb += "glTF";
    word(2);
    word(whole);
    word(json.size());
    glb += "JSON" + json;
    word(bytes.size());
    glb += std::string("BIN\0", 4) + bytes;
    return glb;
  }

  const Scene& scene_;
  Data data_;
  Json gltf_;
};

}  // namespace

std::string to_glb(const Scene& scene) { return GlbWriter(scene).write(); }

}  // namespace rayrep
