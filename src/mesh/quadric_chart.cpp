#include "mesh/quadric_chart.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace rayrep {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// Unit vectors across w and w itself, right-handed, as rows.
Matrix3d frame_along(const Vector3d& w) {
  Matrix3d axes;
  axes.row(2) = w.normalized();
  axes.row(0) = w.unitOrthogonal();
  axes.row(1) = axes.row(2).cross(axes.row(0));
  return axes;
}

QuadricChart graph(const Vector3d& along, const Vector3d& middle) {
  return {QuadricChart::Kind::graph, frame_along(along), middle};
}

/// The principal axes of a quadric, and where its bends are centred.
struct Principal {
  Vector3d bends;  ///< eigenvalues of the Hessian
  Matrix3d axes;   ///< rows
  Vector3d centre;
  double value = 0;  ///< of f there
  bool is_bent[3] = {false, false, false};

  Principal(const Quadric& f, const Vector3d& middle, double size_mm, double error_mm) {
    const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(f.hessian);
    bends = solver.eigenvalues();
    axes = solver.eigenvectors().transpose();
    if (axes.determinant() < 0) axes.row(2) *= -1;
    const Vector3d slope = f.gradient(middle);
    centre = middle;
    const double steepest = slope.norm() + bends.cwiseAbs().maxCoeff() * size_mm;
    for (int k = 0; k < 3; ++k) {
      is_bent[k] = std::abs(bends[k]) * size_mm * size_mm > 0.01 * error_mm * steepest;
      if (is_bent[k]) centre -= axes.row(k).transpose() * (axes.row(k).dot(slope) / bends[k]);
    }
    value = f.value(centre);
  }

  /// The semi-axis along k of the quadric's ellipse or hyperbola; 0 where that is not bent.
  double radius(int k) const { return is_bent[k] ? std::sqrt(2 * std::abs(value / bends[k])) : 0; }
  bool is_round(int i, int j) const { return is_bent[i] && is_bent[j] && bends[i] * bends[j] > 0; }
};

/// Around axis k, where the two others are bent the same way.
QuadricChart tube(const Principal& principal, int k, double size_mm) {
  const int i = (k + 1) % 3;
  const int j = (k + 2) % 3;
  QuadricChart chart{QuadricChart::Kind::tube, {}, principal.centre};
  const double unit = std::max(std::sqrt(principal.radius(i) * principal.radius(j)), 0.02 * size_mm);
  chart.axes.row(0) = principal.axes.row(i) * (std::sqrt(principal.bends[i] / principal.bends[j]) / unit);
  chart.axes.row(1) = principal.axes.row(j) / unit;
  chart.axes.row(2) = principal.axes.row(k) / unit;
  return chart;
}

/// From the middle of each loop, and from the ends of the axes and between them.
void add_spheres(const Principal& principal, const std::vector<Vector3d>& middles, std::vector<QuadricChart>& charts) {
  Matrix3d to_unit;
  for (int k = 0; k < 3; ++k) to_unit.row(k) = principal.axes.row(k) / principal.radius(k);
  std::vector<Vector3d> poles;
  for (const Vector3d& middle : middles) poles.push_back(to_unit * (middle - principal.centre));
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      for (int z = -1; z <= 1; ++z) poles.emplace_back(x, y, z);
  for (const Vector3d& pole : poles)
    if (pole.norm() > 1e-6) charts.push_back({QuadricChart::Kind::sphere, frame_along(pole) * to_unit, principal.centre});
}

}  // namespace

Vector2d QuadricChart::at(const Vector3d& p) const {
  const Vector3d q = axes * (p - centre_mm);
  if (kind == Kind::graph) return q.head<2>();
  if (kind == Kind::sphere) return q.head<2>() / (1 - q.z());
  const double across = q.head<2>().norm();
  const double root = std::sqrt(1 + q.z() * q.z());
  return q.head<2>() * ((q.z() >= 0 ? q.z() + root : 1 / (root - q.z())) / across);
}

int QuadricChart::orientation(const Quadric& f, const Vector3d& p) const {
  const Vector3d outward = -f.gradient(p).normalized();
  if (kind == Kind::graph) {
    const double along = axes.row(2).dot(outward);
    return along > 0 ? 1 : along < 0 ? -1 : 0;
  }
  const double step = 1e-4 / axes.norm();
  const Vector3d u = step * outward.unitOrthogonal();
  const Vector3d v = outward.cross(u);
  const Vector2d du = at(p + u) - at(p - u);
  const Vector2d dv = at(p + v) - at(p - v);
  const double turn = du.x() * dv.y() - du.y() * dv.x();
  return turn > 0 ? 1 : turn < 0 ? -1 : 0;
}

std::optional<Vector3d> QuadricChart::lifted(const Quadric& f, const Vector2d& at, int turn) const {
  // Along a line from `foot` f is value + slope t + bend t^2.
  Vector3d foot = centre_mm;
  Vector3d along;
  const Matrix3d inverse = axes.inverse();
  if (kind == Kind::graph) {
    foot += inverse * Vector3d(at.x(), at.y(), 0);
    along = axes.row(2);
  } else if (kind == Kind::tube) {
    const double r = at.norm();
    foot += inverse * Vector3d(0, 0, 0.5 * (r - 1 / r));
    along = inverse * Vector3d(at.x() / r, at.y() / r, 0);
  } else {
    const double r2 = at.squaredNorm();
    along = inverse * Vector3d(2 * at.x(), 2 * at.y(), r2 - 1) / (r2 + 1);
  }
  const double value = f.value(foot);
  const double slope = f.gradient(foot).dot(along);
  const double bend = 0.5 * along.dot(f.hessian * along);
  const double root2 = slope * slope - 4 * bend * value;
  if (!(root2 >= 0)) return std::nullopt;
  // On a graph the slope there is against the way it turns; else the line goes outward from within.
  const double root = kind == Kind::graph ? -turn * std::sqrt(root2) : std::copysign(std::sqrt(root2), bend);
  const double t = slope * root >= 0 ? -2 * value / (slope + root) : (root - slope) / (2 * bend);
  if (!std::isfinite(t) || (kind != Kind::graph && t <= 0)) return std::nullopt;
  return f.nearest(foot + t * along);
}

std::vector<QuadricChart> quadric_charts(const Quadric& f, const std::vector<std::vector<Vector3d>>& loops, double error_mm) {
  Eigen::AlignedBox3d box;
  std::vector<Vector3d> middles;
  for (const auto& loop : loops) {
    Eigen::AlignedBox3d own;
    for (const Vector3d& p : loop) own.extend(p);
    box.extend(own);
    middles.push_back(own.center());
  }
  const Vector3d middle = box.center();
  const double size_mm = box.diagonal().norm();
  const Principal principal(f, middle, size_mm, error_mm);
  std::vector<QuadricChart> charts;
  const Vector3d slope = f.gradient(f.nearest(middle));
  if (slope.norm() > 0) charts.push_back(graph(slope, middle));
  // Two sheets, or one that is a graph: along the axis that is bent unlike the two others.
  for (int k = 2; k >= 0; --k) charts.push_back(graph(principal.axes.row(k), middle));
  for (int k = 0; k < 3; ++k)
    if (principal.is_round((k + 1) % 3, (k + 2) % 3)) charts.push_back(tube(principal, k, size_mm));
  if (principal.is_round(0, 1) && principal.is_round(1, 2)) add_spheres(principal, middles, charts);
  return charts;
}

}  // namespace rayrep
