#include "motion/keys.h"
#include "rayrep/base/error.h"
#include "rayrep/motion/scene.h"

namespace rayrep {

Eigen::Isometry3d PartPose::about(const Eigen::Vector3d& pivot_mm) const {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.linear() = rotation.toRotationMatrix();
  X.translation() = pivot_mm + translation_mm - X.linear() * pivot_mm;
  return X;
}

PartPose Motion::at(double time) const {
  PartPose pose;
  if (translation.size() == 1) {
    pose.translation_mm = translation.front().at_mm;
  } else if (!translation.empty()) {
    const auto [n, f] = piece_at(translation, time);
    const TranslationKey& a = translation[n];
    const TranslationKey& b = translation[n + 1];
    const double g = 1 - f;
    pose.translation_mm = g * g * g * a.at_mm + 3 * g * g * f * a.out_mm + 3 * g * f * f * b.in_mm + f * f * f * b.at_mm;
  }
  if (rotation.size() == 1) {
    pose.rotation = rotation.front().rotation;
  } else if (!rotation.empty()) {
    const auto [n, f] = piece_at(rotation, time);
    pose.rotation = rotation[n].rotation.slerp(f, rotation[n + 1].rotation);
  }
  return pose;
}

Motion straight_motion(const PartPose& from, const PartPose& to) {
  Motion motion;
  motion.translation = {{.time = 0, .at_mm = from.translation_mm}, {.time = 1, .at_mm = to.translation_mm}};
  motion.rotation = {{0, from.rotation}, {1, to.rotation}};
  straighten(motion);
  return motion;
}

void straighten(Motion& motion) {
  auto& keys = motion.translation;
  for (std::size_t n = 0; n < keys.size(); ++n) {
    keys[n].in_mm = n > 0 ? Eigen::Vector3d((2 * keys[n].at_mm + keys[n - 1].at_mm) / 3) : keys[n].at_mm;
    keys[n].out_mm = n + 1 < keys.size() ? Eigen::Vector3d((2 * keys[n].at_mm + keys[n + 1].at_mm) / 3) : keys[n].at_mm;
  }
}

std::size_t Scene::part(const std::string& name) const {
  std::string known;
  for (std::size_t n = 0; n < parts.size(); ++n) {
    if (parts[n].name == name) return n;
    known += (n > 0 ? ", " : "") + parts[n].name;
  }
  throw Error(ErrorCode::input, "The scene has no part '" + name + "'. It has: " + known + ".");
}

}  // namespace rayrep
