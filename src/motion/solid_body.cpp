#include "motion/solid_body.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "mesh/reach.h"

namespace rayrep {
namespace {

using Eigen::Vector3d;

std::vector<Eigen::AlignedBox3d> boxes_of(const Mesh& mesh) {
  std::vector<Eigen::AlignedBox3d> boxes(mesh.triangles.size());
  for (std::size_t t = 0; t < boxes.size(); ++t)
    for (int k = 0; k < 3; ++k) boxes[t].extend(mesh.corner(t, k));
  return boxes;
}

}  // namespace

SolidBody::SolidBody(std::shared_ptr<const Mesh> mesh) : mesh_(std::move(mesh)), box_(bounding_box(*mesh_)) {}

void SolidBody::prepare() {
  surface_.emplace(*mesh_);
  corners_.clear();
  inner_points_.clear();
  const Components components = connected_components(*mesh_);
  std::vector<int> largest(static_cast<std::size_t>(components.count), -1);
  std::vector<double> area(largest.size(), -1);
  for (std::size_t t = 0; t < mesh_->triangles.size(); ++t) {
    const Vector3d& a = mesh_->corner(t, 0);
    const double size = (mesh_->corner(t, 1) - a).cross(mesh_->corner(t, 2) - a).squaredNorm();
    const auto c = static_cast<std::size_t>(components.of_triangle[t]);
    if (size <= area[c]) continue;
    area[c] = size;
    largest[c] = static_cast<int>(t);
  }
  for (const int t : largest) {
    const auto n = static_cast<std::size_t>(t);
    const Vector3d& a = mesh_->corner(n, 0);
    const Vector3d normal = (mesh_->corner(n, 1) - a).cross(mesh_->corner(n, 2) - a).normalized();
    const Vector3d middle = (a + mesh_->corner(n, 1) + mesh_->corner(n, 2)) / 3;
    corners_.push_back(a);
    // As deep behind its largest triangle as there is material.
    Vector3d best = middle;
    double deepest = 0;
    for (double step = diagonal_mm() / 2; step > 1e-4 * diagonal_mm(); step /= 2) {
      const Vector3d p = middle - step * normal;
      const double depth = depth_mm(p, deepest);
      if (depth <= deepest) continue;
      deepest = depth;
      best = p;
    }
    if (deepest > 0) inner_points_.push_back(best);
  }
  tree_.emplace(boxes_of(*mesh_));
}

double SolidBody::reach_mm(const Vector3d& pivot_mm) const { return rayrep::reach_mm(*mesh_, pivot_mm); }

bool SolidBody::contains(const Vector3d& p) const { return box_.contains(p) && is_inside(*surface_, p); }

double SolidBody::depth_mm(const Vector3d& p, double least_mm) const {
  const double outside = box_.exteriorDistance(p);
  if (outside > 0) return -outside;
  const double distance = surface_->closest(p, std::numeric_limits<double>::infinity()).distance_mm;
  if (distance <= least_mm) return distance;  // inside or not, it is no deeper
  return contains(p) ? distance : -distance;
}

}  // namespace rayrep
