#include "make/rod.h"

#include <algorithm>

namespace rayrep::detail {
namespace {

double distance_mm(const Eigen::Vector3d& p, const Rod& rod) {
  const Eigen::Vector3d along = rod.to_mm - rod.from_mm;
  const double length = along.squaredNorm();
  const double part = length > 0 ? std::clamp((p - rod.from_mm).dot(along) / length, 0.0, 1.0) : 0.0;
  return (p - rod.from_mm - part * along).norm();
}

}  // namespace

double gap_mm(const Rod& a, const Rod& b) {
  double distance =
      std::min({distance_mm(a.from_mm, b), distance_mm(a.to_mm, b), distance_mm(b.from_mm, a), distance_mm(b.to_mm, a)});
  // Else the lines are nearest to each other between the ends of both.
  const Eigen::Vector3d u = a.to_mm - a.from_mm;
  const Eigen::Vector3d v = b.to_mm - b.from_mm;
  const Eigen::Vector3d across = u.cross(v);
  if (const double squared = across.squaredNorm(); squared > 1e-12 * u.squaredNorm() * v.squaredNorm()) {
    const Eigen::Vector3d w = b.from_mm - a.from_mm;
    const double s = w.cross(v).dot(across) / squared;
    const double t = w.cross(u).dot(across) / squared;
    if (s > 0 && s < 1 && t > 0 && t < 1) distance = std::min(distance, (a.from_mm + s * u - b.from_mm - t * v).norm());
  }
  return distance - a.radius_mm - b.radius_mm;
}

Rod pillar_of(const Mesh& bone, double clearance_mm) {
  // A surface of revolution, from the middle of its foot to that of its top, as thick as the pillar up to its neck.
  const Eigen::Vector3d& foot = bone.vertices.front();
  const Eigen::Vector3d up = (bone.vertices.back() - foot).normalized();
  const auto height_mm = [&](const Eigen::Vector3d& v) { return up.dot(v - foot); };
  const auto beside_mm = [&](const Eigen::Vector3d& v) { return (v - foot - height_mm(v) * up).norm(); };
  const double radius_mm = beside_mm(bone.vertices[1]);
  double neck_mm = 0;
  for (const Eigen::Vector3d& v : bone.vertices)
    if (const double beside = beside_mm(v); beside > 0.99 * radius_mm && beside < 1.01 * radius_mm)
      neck_mm = std::max(neck_mm, height_mm(v));
  return {foot, foot + neck_mm * up, radius_mm + clearance_mm};
}

}  // namespace rayrep::detail
