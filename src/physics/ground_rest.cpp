#include "rayrep/physics/ground_rest.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include "base/rotation.h"

namespace rayrep {
namespace {

constexpr int kMostSteps = 5000;
constexpr double kTolerance = 1e-7;  ///< over the diagonal: what is so near counts as touching
constexpr double kShake = 3 * std::numbers::pi / 180;

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

/// Counter-clockwise corners of the convex hull, none on a line within `tolerance`.
std::vector<Eigen::Vector2d> hull_of(std::vector<Eigen::Vector2d> points, double tolerance) {
  std::sort(points.begin(), points.end(),
            [](const auto& a, const auto& b) { return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y()); });
  std::vector<Eigen::Vector2d> hull;
  for (const bool back : {false, true}) {
    const std::size_t begin = hull.size();
    const auto add = [&](const Eigen::Vector2d& p) {
      if (hull.size() > begin && (p - hull.back()).norm() <= tolerance) return;
      while (hull.size() >= begin + 2) {
        const Eigen::Vector2d edge = p - hull[hull.size() - 2];
        if (cross(edge, hull.back() - hull[hull.size() - 2]) < -tolerance * edge.norm()) break;
        hull.pop_back();
      }
      hull.push_back(p);
    };
    if (back)
      std::for_each(points.rbegin(), points.rend(), add);
    else
      std::for_each(points.begin(), points.end(), add);
    if (hull.size() > begin + 1) hull.pop_back();  // the other way begins there
  }
  if (hull.size() == 2 && (hull[0] - hull[1]).norm() <= tolerance) hull.pop_back();
  return hull;
}

/// Where the vertical through the centre of mass meets the ground, against what touches it.
struct Foot {
  bool inside = false;
  Eigen::Vector2d pivot;     ///< if not inside: the nearest point of what touches
  double edge_distance = 0;  ///< if inside: of the nearest edge
};

Foot foot_of(const std::vector<Eigen::Vector2d>& touching, const Eigen::Vector2d& p) {
  Foot foot;
  double nearest = std::numeric_limits<double>::infinity();
  foot.inside = touching.size() >= 3;
  for (std::size_t k = 0; k < touching.size(); ++k) {
    const Eigen::Vector2d& a = touching[k];
    const Eigen::Vector2d edge = touching[(k + 1) % touching.size()] - a;
    const double along = edge.squaredNorm() > 0 ? std::clamp((p - a).dot(edge) / edge.squaredNorm(), 0.0, 1.0) : 0;
    const Eigen::Vector2d q = a + along * edge;
    if (touching.size() >= 3 && cross(edge, p - a) <= 0) foot.inside = false;
    if ((p - q).norm() >= nearest) continue;
    nearest = (p - q).norm();
    foot.pivot = q;
  }
  foot.edge_distance = nearest;
  return foot;
}

}  // namespace

namespace {

/// A body on level ground.
struct Touching {
  Eigen::Matrix3d turn;                  ///< takes up to z
  double lowest = 0;                     ///< height of the ground along up
  std::vector<Eigen::Vector2d> corners;  ///< of what touches it, turned
};

Touching touching(const Mesh& mesh, const Eigen::Vector3d& up, double tolerance) {
  Touching result{up_to_z(up), std::numeric_limits<double>::infinity(), {}};
  for (const Eigen::Vector3d& v : mesh.vertices) result.lowest = std::min(result.lowest, up.dot(v));
  for (const Eigen::Vector3d& v : mesh.vertices)
    if (up.dot(v) <= result.lowest + tolerance) result.corners.push_back((result.turn * v).head<2>());
  result.corners = hull_of(std::move(result.corners), tolerance);
  return result;
}

/// How far a body turns over a pivot on the ground, towards `out`, until it touches there.
double turn_until_it_touches(const Mesh& mesh, const Eigen::Vector3d& up, const Eigen::Vector3d& pivot, const Eigen::Vector3d& out,
                             double tolerance) {
  double angle = std::numbers::pi;
  for (const Eigen::Vector3d& v : mesh.vertices) {
    const double above = up.dot(v - pivot);
    const double ahead = out.dot(v - pivot);
    // What it turns about does not stop it.
    if (above <= tolerance && ahead <= 10 * tolerance) continue;
    angle = std::min(angle, std::atan2(std::max(above, 0.0), ahead));
  }
  return angle;
}

}  // namespace

namespace {

/// Up after a turn over a line through `pivot` on the ground, across `over` in plan, until something touches.
Eigen::Vector3d turned_over(const Mesh& mesh, const Eigen::Vector3d& up, const Touching& ground, const Eigen::Vector2d& pivot,
                            const Eigen::Vector2d& over) {
  const double tolerance = kTolerance * bounding_box(mesh).diagonal().norm();
  const Eigen::Vector3d out = ground.turn.transpose() * Eigen::Vector3d(over.x(), over.y(), 0).normalized();
  const Eigen::Vector3d at = ground.turn.transpose() * Eigen::Vector3d(pivot.x(), pivot.y(), ground.lowest);
  const double angle = turn_until_it_touches(mesh, up, at, out, tolerance);
  return (std::cos(angle) * up - std::sin(angle) * out).normalized();
}

double height_above_ground(const Mesh& mesh, const Eigen::Vector3d& centre, const Eigen::Vector3d& up) {
  double lowest = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& v : mesh.vertices) lowest = std::min(lowest, up.dot(v));
  return up.dot(centre) - lowest;
}

/// The lowest place beyond the edges that hold a body at rest by no more than `shake_rad`; none if it lies no lower.
std::optional<Eigen::Vector3d> shaken_off(const Mesh& mesh, const Eigen::Vector3d& centre, const Touching& ground,
                                          const GroundRest& rest, double shake_rad) {
  std::optional<Eigen::Vector3d> lowest;
  double height = rest.height_mm - 1e-9 * rest.height_mm;
  const Eigen::Vector2d foot = (ground.turn * centre).head<2>();
  for (std::size_t k = 0; k < ground.corners.size(); ++k) {
    const Eigen::Vector2d& a = ground.corners[k];
    const Eigen::Vector2d edge = ground.corners[(k + 1) % ground.corners.size()] - a;
    const Eigen::Vector2d outward = Eigen::Vector2d(edge.y(), -edge.x()).normalized();
    if (std::atan2(outward.dot(a - foot), rest.height_mm) > shake_rad) continue;
    const Eigen::Vector3d up = turned_over(mesh, rest.up, ground, a, outward);
    const double there = height_above_ground(mesh, centre, up);
    if (there >= height) continue;
    height = there;
    lowest = up;
  }
  return lowest;
}

}  // namespace

GroundRest ground_rest(const Mesh& mesh, const Eigen::Vector3d& centre_of_mass_mm, const Eigen::Vector3d& up, double shake_rad) {
  const double tolerance = kTolerance * bounding_box(mesh).diagonal().norm();
  GroundRest rest;
  rest.up = up.normalized();
  for (int step = 0; step < kMostSteps; ++step) {
    const Touching ground = touching(mesh, rest.up, tolerance);
    const Eigen::Vector3d centre = ground.turn * centre_of_mass_mm;
    rest.height_mm = centre.z() - ground.lowest;
    const Foot foot = foot_of(ground.corners, centre.head<2>());
    rest.rests = foot.inside;
    rest.holds_rad = foot.inside ? std::atan2(foot.edge_distance, rest.height_mm) : 0;
    if (rest.rests) {
      const auto lower = rest.holds_rad > shake_rad ? std::nullopt : shaken_off(mesh, centre_of_mass_mm, ground, rest, shake_rad);
      if (!lower) return rest;
      rest.up = *lower;
      continue;
    }
    Eigen::Vector2d over = centre.head<2>() - foot.pivot;
    // Balanced: either side of an edge, any of a corner.
    if (over.norm() <= tolerance)
      over = ground.corners.size() == 1 ? Eigen::Vector2d::UnitX() : (ground.corners[1] - ground.corners[0]).unitOrthogonal();
    rest.up = turned_over(mesh, rest.up, ground, foot.pivot, over);
  }
  return rest;
}

Righted righted(const Mesh& mesh, const Eigen::Vector3d& centre_of_mass_mm, const Eigen::Vector3d& up, const Progress& progress) {
  const std::vector<Eigen::Vector3d> starts = cube_directions();
  std::vector<GroundRest> rests(starts.size());
  progress.check();
  tbb::parallel_for(std::size_t{0}, starts.size(),
                    [&](std::size_t n) { rests[n] = ground_rest(mesh, centre_of_mass_mm, starts[n], kShake); });
  progress.check();
  const Eigen::Vector3d upright = up.normalized();
  Righted all;
  all.up = upright;
  for (const GroundRest& rest : rests) {
    all.rests = all.rests && rest.rests;
    const double tilt_rad = angle_between(rest.up, upright);
    if (!rest.rests || tilt_rad <= all.tilt_rad) continue;
    all.tilt_rad = tilt_rad;
    all.up = rest.up;
  }
  return all;
}

}  // namespace rayrep
