#include "mesh/quadric_landing.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

namespace rayrep {
namespace {

using Eigen::Vector3d;

/// The shortest way to where two planes meet, of unit normals m and n and d and g below a point; none where they are almost one.
std::optional<Vector3d> way_to_both(const Vector3d& m, double d, const Vector3d& n, double g) {
  constexpr double kLeastSine2 = 0.01;
  const double cosine = m.dot(n);
  const double sine2 = 1 - cosine * cosine;
  if (sine2 < kLeastSine2) return std::nullopt;
  return ((cosine * g - d) * m + (cosine * d - g) * n) / sine2;
}

}  // namespace

std::optional<Vector3d> QuadricLanding::on_curve(const Vector3d& start, double reach_mm) const {
  constexpr int kSteps = 12;
  const double settled = 1e-4 * options_.error_mm;
  Vector3d p = start;
  for (int step = 0; step < kSteps; ++step) {
    const double d = f_.distance(p);
    const Vector3d m = f_.gradient(p).normalized();
    const std::optional<LevelAt> level = options_.surface ? options_.surface(p) : LevelAt{0, m.unitOrthogonal()};
    if (!level || !std::isfinite(d) || (p - start).norm() > reach_mm) return std::nullopt;
    if (std::max(std::abs(d), std::abs(level->height_mm)) < settled) return f_.nearest(p);
    const std::optional<Vector3d> way = way_to_both(m, d, level->normal, level->height_mm);
    if (!way) return std::nullopt;  // the surfaces all but touch
    p += *way;
  }
  return std::nullopt;
}

std::optional<Vector3d> QuadricLanding::on_surface(const Vector3d& start, double reach_mm) const {
  constexpr int kSteps = 6;
  if (!options_.surface) return start;
  Vector3d p = start;
  for (int step = 0; step < kSteps; ++step) {
    const std::optional<LevelAt> level = options_.surface(p);
    if (!level || std::abs(level->height_mm) < 1e-9 * reach_mm) break;
    p -= level->height_mm * level->normal;
  }
  if ((p - start).norm() > reach_mm) return std::nullopt;
  return p;
}

std::optional<Vector3d> QuadricLanding::on_ridge(const Vector3d& a, const Vector3d& b) const {
  constexpr double kMostCosine = 0.9;  // between the surface's normals at a and b
  const Vector3d middle = 0.5 * (a + b);
  const double length = (b - a).norm();
  if (!options_.surface || height(middle) > -0.5 * options_.error_mm) return std::nullopt;
  const std::optional<LevelAt> at_a = options_.surface(a);
  const std::optional<LevelAt> at_b = options_.surface(b);
  if (!at_a || !at_b || at_a->normal.dot(at_b->normal) > kMostCosine) return std::nullopt;
  const auto below = [&middle](const LevelAt& level, const Vector3d& p) { return level.height_mm + level.normal.dot(middle - p); };
  const std::optional<Vector3d> way = way_to_both(at_a->normal, below(*at_a, a), at_b->normal, below(*at_b, b));
  if (!way || way->norm() > length) return std::nullopt;
  return on_surface(middle + *way, 0.5 * length);
}

bool QuadricLanding::faces_outward(const Vector3d& middle, const Vector3d& area) const {
  const std::optional<LevelAt> level = options_.surface ? options_.surface(middle) : std::nullopt;
  return level && area.dot(level->normal) > 0.5 * area.norm();
}

double QuadricLanding::height(const Vector3d& p) const {
  const std::optional<LevelAt> level = options_.surface ? options_.surface(p) : std::nullopt;
  return level ? level->height_mm : 0;
}

}  // namespace rayrep
