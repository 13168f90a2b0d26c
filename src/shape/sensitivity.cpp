#include "shape/sensitivity.h"

#include <tbb/parallel_for.h>

#include <array>
#include <utility>

#include "rayrep/mesh/level_set.h"

namespace rayrep::detail {

std::vector<char> outer_triangles(const Mesh& mesh) {
  std::vector<char> outer(mesh.triangles.size(), 1);
  if (connected_components(mesh).count < 2) return outer;
  const SurfaceQuery surface(mesh);
  const double step = 1e-6 * bounding_box(mesh).diagonal().norm();
  tbb::parallel_for(std::size_t{0}, outer.size(), [&](std::size_t t) {
    const Eigen::Vector3d& a = mesh.corner(t, 0);
    const Eigen::Vector3d normal = (mesh.corner(t, 1) - a).cross(mesh.corner(t, 2) - a).normalized();
    const Eigen::Vector3d p = (a + mesh.corner(t, 1) + mesh.corner(t, 2)) / 3 + step * normal;
    if (!p.allFinite()) return;
    std::vector<LineHit> hits;
    if (closed_line_hits(surface, p.head<2>(), hits)) outer[t] = winding_below(hits, p.z()) <= 0;
  });
  return outer;
}

void add_outer(const Mesh& mesh, const std::vector<char>& outer, const Moments& q, VertexGradient& gradient) {
  // Exact for cubic polynomials, as q.phi times a corner's weight is.
  static const std::array<std::pair<Eigen::Vector3d, double>, 4> kRule = {
      std::pair{Eigen::Vector3d(1.0 / 3, 1.0 / 3, 1.0 / 3), -27.0 / 48}, std::pair{Eigen::Vector3d(0.6, 0.2, 0.2), 25.0 / 48},
      std::pair{Eigen::Vector3d(0.2, 0.6, 0.2), 25.0 / 48}, std::pair{Eigen::Vector3d(0.2, 0.2, 0.6), 25.0 / 48}};
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (!outer[t]) continue;
    const Eigen::Vector3d& a = mesh.corner(t, 0);
    const Eigen::Vector3d& b = mesh.corner(t, 1);
    const Eigen::Vector3d& c = mesh.corner(t, 2);
    const Eigen::Vector3d area = 0.5 * (b - a).cross(c - a);
    for (const auto& [weights, share] : kRule) {
      const double value = share * quadric_value(q, weights[0] * a + weights[1] * b + weights[2] * c);
      for (int k = 0; k < 3; ++k) gradient[static_cast<std::size_t>(mesh.triangles[t][k])] += value * weights[k] * area;
    }
  }
}

Eigen::Vector3d corner_weights(const Mesh& mesh, int triangle, const Eigen::Vector3d& p) {
  const auto t = static_cast<std::size_t>(triangle);
  const Eigen::Vector3d& a = mesh.corner(t, 0);
  const Eigen::Vector3d& b = mesh.corner(t, 1);
  const Eigen::Vector3d& c = mesh.corner(t, 2);
  const Eigen::Vector3d normal = (b - a).cross(c - a);
  const double square = normal.squaredNorm();
  if (!(square > 0)) return {1, 0, 0};
  const double v = normal.dot((p - a).cross(c - a)) / square;
  const double w = normal.dot((b - a).cross(p - a)) / square;
  return {1 - v - w, v, w};
}

WallSamples::WallSamples(const Body& body, double wall_mm) {
  const Mesh wall = mesh_zero_set(body.inner.field);
  std::vector<double> size(wall.vertices.size(), 0);
  std::vector<Sample> all(wall.vertices.size());
  const double reach = wall_mm + 4 * body.inner.field.spacing_mm;
  Mesh moved = wall;
  tbb::parallel_for(std::size_t{0}, wall.vertices.size(), [&](std::size_t n) {
    Sample& sample = all[n];
    sample.at = wall.vertices[n];
    const ClosestPoint closest = body.surface.closest(sample.at, reach);
    sample.triangle = closest.triangle;
    if (closest.triangle < 0 || closest.distance_mm == 0) return;
    sample.outward = (closest.point_mm - sample.at) / closest.distance_mm;
    sample.at = closest.point_mm - wall_mm * sample.outward;
    sample.weights = corner_weights(body.surface.mesh(), closest.triangle, closest.point_mm);
    moved.vertices[n] = sample.at;
  });
  for (std::size_t t = 0; t < moved.triangles.size(); ++t) {
    const Eigen::Vector3d& a = moved.corner(t, 0);
    const double third = (moved.corner(t, 1) - a).cross(moved.corner(t, 2) - a).norm() / 6;
    for (int k = 0; k < 3; ++k) size[static_cast<std::size_t>(moved.triangles[t][k])] += third;
  }
  const auto triangles = static_cast<int>(body.working.triangles.size());
  for (std::size_t n = 0; n < all.size(); ++n) {
    Sample& sample = all[n];
    if (sample.triangle < 0 || sample.triangle >= triangles) continue;  // of a post under a room: it stays where it is
    sample.outward *= size[n];
    samples_.push_back(sample);
  }
}

void WallSamples::add(const Mesh& mesh, const Phases& phases, const Moments& q, VertexGradient& gradient) const {
  for (const Sample& sample : samples_) {
    const double value = quadric_value(q, sample.at);
    // What lies there is of the phase that is best, and of the print where the wall comes over it.
    const double gain = value * ((value > 0 ? phases.light : phases.heavy) - 1);
    if (gain == 0) continue;
    const Eigen::Vector3i& corners = mesh.triangles[static_cast<std::size_t>(sample.triangle)];
    for (int k = 0; k < 3; ++k) gradient[static_cast<std::size_t>(corners[k])] += gain * sample.weights[k] * sample.outward;
  }
}

}  // namespace rayrep::detail
