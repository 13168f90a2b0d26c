#include "make/poses.h"

#include <algorithm>
#include <cmath>

#include "base/linear_algebra.h"
#include "base/text.h"
#include "rayrep/base/error.h"
#include "rayrep/make/waterline.h"

namespace rayrep::detail {
namespace {

using Row = CentreProblem::Row;

/// How far below the point it hangs from the centre of mass lies at least, over the diagonal: the scatter of prints tilts it by
/// less than 3 degrees then.
constexpr double kLeastDepth = 0.01;
constexpr double kReserve = 0.05;      ///< part of the hull that a chosen waterline leaves dry, as of floats
constexpr double kLeastHeight = 2e-5;  ///< metacentric, over the diagonal: as of floats

}  // namespace

Poses::Poses(const Body& body, const PoseSpec& spec) : spec_(spec), diagonal_mm_(body.diagonal_mm) {
  const Mesh hull = transformed(body.hull, body.to_working.inverse());
  for (const Pose& pose : spec.poses) {
    placed_.push_back(placed(hull, pose));
    if (pose.kind == Pose::Kind::spins) placed_.back().contact_mm = contact_point(body.outer, pose.axis, placed_.back().up);
  }
  hull_mm3_ = mesh_moments(body.hull)[M1];
}

bool Poses::any(Pose::Kind kind) const {
  return std::any_of(placed_.begin(), placed_.end(), [kind](const Placed& p) { return p.pose.kind == kind; });
}

Placed Poses::placed(const Mesh& hull, const Pose& pose) const {
  Placed p{pose, pose.up_or(spec_.up).normalized(), up_to_z(pose.up_or(spec_.up)), {}, {}, {}, 0, 0};
  const Mesh turned = transformed(hull, Eigen::Affine3d(p.turn));
  const Eigen::AlignedBox3d box = bounding_box(turned);
  p.lowest_mm = box.min().z();
  p.height_mm = box.sizes().z();
  if (pose.kind == Pose::Kind::stands || pose.kind == Pose::Kind::rights)
    p.polygon = support_polygon(turned, spec_.contact_tolerance_mm.value_or(contact_tolerance_mm(p.height_mm)));
  if (pose.kind == Pose::Kind::rights) {
    const Eigen::Vector2d foot = p.polygon.safest_point_mm();
    p.contact_mm = p.turn.transpose() * Eigen::Vector3d(foot.x(), foot.y(), p.lowest_mm);
  }
  if (pose.kind == Pose::Kind::floats)
    p.hull.emplace(transformed(turned, Eigen::Affine3d(Eigen::Translation3d(0, 0, -p.lowest_mm))));
  return p;
}

std::optional<double> Poses::given_volume_mm3() const {
  std::optional<double> given;
  std::size_t first = 0;
  for (std::size_t n = 0; n < placed_.size(); ++n) {
    const Placed& p = placed_[n];
    if (!p.pose.waterline_mm) continue;
    if (!(*p.pose.waterline_mm < p.height_mm))
      throw Error(ErrorCode::usage, "The waterline must lie between the lowest and the highest point, 0 and " +
                                        number(p.height_mm, 2) + " mm; " + words(n) + " it is " + number(*p.pose.waterline_mm, 2) +
                                        " mm.");
    const double volume = hydrostatics(*p.hull, {Eigen::Vector3d::UnitZ(), *p.pose.waterline_mm}).displaced_volume_mm3 / volumes();
    const double g = 1e-3 * spec_.print.density_g_cm3;
    if (given && std::abs(volume - *given) > 1e-4 * *given)
      throw Error(ErrorCode::goal, "These waterlines contradict each other: " + words(first) + " it would have to weigh " +
                                       number(g * *given, 2) + " g, " + words(n) + " " + number(g * volume, 2) +
                                       " g. Leave one of them out (--float UP): it follows from the other.");
    if (given) continue;
    given = volume;
    first = n;
  }
  return given;
}

double Poses::most_afloat_mm3() const { return (1 - kReserve) * hull_mm3_ / volumes(); }

Afloat Poses::afloat(const Placed& p, double volume_mm3) const {
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  const double waterline_mm = p.pose.waterline_mm ? *p.pose.waterline_mm : waterline_for_volume(*p.hull, z, volume_mm3 * volumes());
  const Waterplane plane{z, waterline_mm};
  const Hydrostatics water = hydrostatics(*p.hull, plane);
  return {waterline_mm, p.turn.transpose() * (water.centre_of_buoyancy_mm + p.lowest_mm * z),
          water.metacentre_mm(plane).z() + p.lowest_mm};
}

void Poses::add(const Placed& p, std::optional<double> volume_mm3, CentreProblem& problem) const {
  switch (p.pose.kind) {
    case Pose::Kind::stands:
      add_edges(p, problem);
      break;
    case Pose::Kind::hangs:
      add_vertical(p, p.pose.point_mm, problem);
      add_depth(p.up.dot(p.pose.point_mm), p.up, {kLeastDepth, !tips()}, problem);
      break;
    case Pose::Kind::rights:
      add_vertical(p, p.contact_mm, problem);
      add_depth(p.lowest_mm + p.height_mm, p.up, {0, !tips()}, problem);
      break;
    case Pose::Kind::floats: {
      const Afloat water = afloat(p, *volume_mm3);
      add_vertical(p, water.centre_of_buoyancy_mm, problem);
      add_depth(water.metacentre_mm, p.up, {kLeastHeight, !tips()}, problem);
      problem.volume_mm3 = volume_mm3;
      break;
    }
    case Pose::Kind::spins:
      add_vertical(p, p.contact_mm, problem);
      break;
  }
}

CentreProblem Poses::problem(std::optional<double> volume_mm3) const {
  CentreProblem problem;
  for (const Placed& p : placed_) add(p, volume_mm3, problem);
  return problem;
}

CentreProblem Poses::problem(std::size_t n, std::optional<double> volume_mm3) const {
  CentreProblem problem;
  add(placed_[n], volume_mm3, problem);
  return problem;
}

bool Poses::comes_back(const Body& body, const Placed& p, double volume_mm3, const Eigen::Vector3d& centre_mm) const {
  const FloatProblem problem{*p.hull,           body.inner.rays,           *body.integrals, body.shell,
                             spec_.fluid_g_cm3, spec_.print.density_g_cm3, p.height_mm,     diagonal_mm_};
  const Afloat water = afloat(p, volume_mm3);
  WaterlineState state;
  state.waterline_mm = water.waterline_mm;
  state.attainable = true;
  state.metacentric_height_mm = water.metacentre_mm - p.up.dot(centre_mm);
  state.lowest.moments[M1] = volume_mm3;
  state.lowest.moments.segment<3>(MX) = volume_mm3 * (p.turn * centre_mm - p.lowest_mm * Eigen::Vector3d::UnitZ());
  return rayrep::comes_back(problem, state);
}

Poses::Freedom Poses::freedom() const {
  Eigen::MatrixXd fixed = Eigen::MatrixXd::Zero(3, 3);
  for (const Placed& p : placed_)
    if (p.pose.kind != Pose::Kind::stands) fixed += Eigen::Matrix3d::Identity() - p.up * p.up.transpose();
  const SymmetricEigen eigen = symmetric_eigen(fixed);
  if (eigen.values[2] < 1e-9) return {};
  if (eigen.values[0] < 1e-9) return {1, eigen.vectors.col(0)};
  return {0, Eigen::Vector3d::Zero()};
}

Eigen::Vector3d Poses::through_mm(const Placed& p, std::optional<double> volume_mm3) const {
  if (p.pose.kind == Pose::Kind::rights || p.pose.kind == Pose::Kind::spins) return p.contact_mm;
  return p.pose.kind == Pose::Kind::hangs ? p.pose.point_mm : afloat(p, *volume_mm3).centre_of_buoyancy_mm;
}

std::optional<Poses::Apart> Poses::apart(std::optional<double> volume_mm3) const {
  std::optional<Apart> farthest;
  for (std::size_t a = 0; a < size(); ++a)
    for (std::size_t b = a + 1; b < size(); ++b) {
      const Placed& one = placed_[a];
      const Placed& other = placed_[b];
      if (one.pose.kind == Pose::Kind::stands || other.pose.kind == Pose::Kind::stands) continue;
      const Eigen::Vector3d between = through_mm(other, volume_mm3) - through_mm(one, volume_mm3);
      const Eigen::Vector3d normal = one.up.cross(other.up);
      const double distance_mm = normal.norm() > 1e-6 ? std::abs(normal.normalized().dot(between)) : between.cross(one.up).norm();
      if (distance_mm > (farthest ? farthest->distance_mm : 1e-3 * diagonal_mm_)) farthest = {a, b, distance_mm};
    }
  return farthest;
}

/// The tangent of each edge's tipping angle: distance over height.
void Poses::add_edges(const Placed& p, CentreProblem& problem) {
  const std::vector<Eigen::Vector2d>& corners = p.polygon.corners_mm;
  Row run;
  run << -p.polygon.ground_mm, p.up;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const Eigen::Vector2d edge = corners[(k + 1) % corners.size()] - corners[k];
    const Eigen::Vector2d inward = Eigen::Vector2d(-edge.y(), edge.x()).normalized();
    Row rise;
    rise << -inward.dot(corners[k]), p.turn.transpose() * Eigen::Vector3d(inward.x(), inward.y(), 0);
    problem.ratios.push_back({rise, run});
  }
}

/// On the vertical through a point.
void Poses::add_vertical(const Placed& p, const Eigen::Vector3d& through_mm, CentreProblem& problem) {
  for (int k = 0; k < 2; ++k) {
    const Eigen::Vector3d across = p.turn.row(k).transpose();
    Row row;
    row << -across.dot(through_mm), across;
    problem.level.push_back(row);
  }
}

/// Below a height along up by so much at least, and if nothing else is wanted as far as it goes.
void Poses::add_depth(double height_mm, const Eigen::Vector3d& up, const Depth& depth, CentreProblem& problem) const {
  Row above;
  above << depth.least * diagonal_mm_ - height_mm, up;
  problem.at_most.push_back(above);
  if (!depth.wanted) return;
  Row below;
  below << height_mm, -up;
  problem.ratios.push_back({below, Row(diagonal_mm_, 0, 0, 0)});
}

CentreProblem moved(CentreProblem problem, const Eigen::Affine3d& to_working) {
  const auto move = [&to_working](Row& row) {
    const Eigen::Vector3d a = to_working.linear() * row.tail<3>();
    row << row[0] - a.dot(to_working.translation()), a;
  };
  for (CentreProblem::Ratio& r : problem.ratios) {
    move(r.rise);
    move(r.run);
  }
  for (Row& row : problem.at_most) move(row);
  for (Row& row : problem.level) move(row);
  return problem;
}

}  // namespace rayrep::detail
