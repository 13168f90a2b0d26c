#include "make/mechanism_states.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "base/text.h"
#include "make/comes_back.h"
#include "rayrep/base/error.h"
#include "rayrep/mesh/bodies.h"
#include "rayrep/mesh/mesh_check.h"

namespace rayrep::detail {
namespace {

/// As of poses: below the point it hangs from, and of the metacentre above the centre of mass, over the diagonal.
constexpr double kLeastDepth = 0.01;
constexpr double kLeastHeight = 2e-5;
constexpr double kReserve = 0.05;  ///< part of the hull that a chosen waterline leaves dry
constexpr double kHeights = 1e-2;  ///< weight beside the mass: ends of rays are to be continuous in the multipliers, as of targets

/// 1e-3 g/mm3 per g/cm3.
double g_per_mm3(const Print& print) { return 1e-3 * print.density_g_cm3; }

/// On the vertical through a point.
void add_vertical(const Eigen::Vector3d& through_mm, StateRows& rows) {
  rows.level.push_back({{-through_mm.x(), 1, 0, 0}});
  rows.level.push_back({{-through_mm.y(), 0, 1, 0}});
}

/// theory.md (23): distance from each edge over height at least `tip`.
void add_edges(const SupportPolygon& polygon, double tip, StateRows& rows) {
  const std::vector<Eigen::Vector2d>& corners = polygon.corners_mm;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const Eigen::Vector2d edge = corners[(k + 1) % corners.size()] - corners[k];
    const Eigen::Vector2d inward = Eigen::Vector2d(-edge.y(), edge.x()).normalized();
    rows.at_most.push_back({{inward.dot(corners[k]) - tip * polygon.ground_mm, -inward.x(), -inward.y(), tip}});
  }
}

/// In the vertical plane through the axis.
void add_hinge(const HingeBalance& hinge, const Eigen::Matrix3d& turn, StateRows& rows) {
  const Eigen::Vector3d across = (turn * hinge.axis).cross(Eigen::Vector3d::UnitZ()).normalized();
  rows.level.push_back({{-across.dot(turn * hinge.point_mm), across.x(), across.y(), 0}, &hinge});
}

}  // namespace

MechanismStates::MechanismStates(const Mechanism& mechanism, std::vector<std::shared_ptr<Body>> bodies, const Progress& progress)
    : mechanism_(mechanism), bodies_(std::move(bodies)) {
  std::size_t j = 0;
  for (const MechanismPart& part : mechanism.parts) {
    const double g = g_per_mm3(part.print);
    if (!part.printed) {
      const double mass = g * mesh_moments(boundary_of_union(part.mesh, progress))[M1];
      lightest_g_ += mass;
      solid_g_ += mass;
      continue;
    }
    const Body& body = *bodies_[j++];
    interiors_.push_back({&*body.integrals, body.shell});
    lightest_g_ += g * body.shell[M1];
    solid_g_ += g * (body.shell + body.integrals->full())[M1];
  }
  for (const MechanismState& state : mechanism.states) placed_.push_back(placed(state, progress));
}

MechanismStates::Placed MechanismStates::placed(const MechanismState& state, const Progress& progress) const {
  Placed p;
  const Eigen::Vector3d up = state.rests.up_or(Eigen::Vector3d::UnitZ());
  p.turn = up_to_z(up);
  Mesh all;
  std::size_t j = 0;
  for (std::size_t n = 0; n < mechanism_.parts.size(); ++n) {
    const MechanismPart& part = mechanism_.parts[n];
    const Eigen::Affine3d to_state = Eigen::Affine3d(p.turn) * state.poses[n];
    const double g = g_per_mm3(part.print);
    if (part.printed) {
      const Body& body = *bodies_[j++];
      const Eigen::Affine3d from_working = to_state * body.to_working.inverse();
      p.of_part.emplace_back(g * moment_map(from_working).topRows<4>());
      p.constant.emplace_back(Eigen::Vector4d::Zero());
      append(all, transformed(body.hull, from_working));
    } else {
      const Mesh outer = transformed(boundary_of_union(outer_hull(part.mesh), progress), to_state);
      p.constant.emplace_back(g * mesh_moments(transformed(boundary_of_union(part.mesh, progress), to_state)).head<4>());
      append(all, outer);
    }
  }
  const Mesh hull = boundary_of_union(all, progress);
  p.box = bounding_box(hull);
  p.diagonal_mm = p.box.diagonal().norm();
  if (state.rests.kind == Pose::Kind::stands) {
    const double tolerance = mechanism_.contact_tolerance_mm.value_or(contact_tolerance_mm(p.box.sizes().z()));
    p.polygon = support_polygon(hull, tolerance);
    if (p.polygon.corners_mm.size() < 3)
      throw Error(ErrorCode::goal, "It cannot stand" + state_words(mechanism_, state) + ": it touches the ground in " +
                                       (p.polygon.corners_mm.size() < 2 ? "a point" : "an edge") + " only (within " +
                                       number(tolerance, 3) + " mm of its lowest point).");
  }
  if (state.rests.kind == Pose::Kind::floats) p.hull.emplace(hull);
  return p;
}

bool MechanismStates::any(Pose::Kind kind) const {
  return std::any_of(mechanism_.states.begin(), mechanism_.states.end(),
                     [kind](const MechanismState& s) { return s.rests.kind == kind; });
}

double MechanismStates::most_afloat_g() const {
  double most = std::numeric_limits<double>::infinity();
  for (const Placed& p : placed_)
    if (p.hull) most = std::min(most, (1 - kReserve) * 1e-3 * mechanism_.fluid_g_cm3 * mesh_moments(p.hull->mesh())[M1]);
  return most;
}

std::optional<double> MechanismStates::given_mass_g(std::size_t state) const {
  const MechanismState& asked = mechanism_.states[state];
  if (asked.rests.kind != Pose::Kind::floats || !asked.rests.waterline_mm) return std::nullopt;
  const Placed& p = placed_[state];
  const double waterline_mm = *asked.rests.waterline_mm;
  if (!(waterline_mm > 0 && waterline_mm < p.box.sizes().z()))
    throw Error(ErrorCode::usage, "The waterline must lie between the lowest and the highest point, 0 and " +
                                      number(p.box.sizes().z(), 2) + " mm; it is " + number(waterline_mm, 2) + " mm" +
                                      state_words(mechanism_, asked) + ".");
  const Waterplane plane{Eigen::Vector3d::UnitZ(), p.box.min().z() + waterline_mm};
  return 1e-3 * mechanism_.fluid_g_cm3 * hydrostatics(*p.hull, plane).displaced_volume_mm3;
}

StateRows MechanismStates::rows(std::size_t state, double tip, std::optional<double> mass_g) const {
  const Placed& p = placed_[state];
  const Pose& rests = mechanism_.states[state].rests;
  StateRows rows;
  switch (rests.kind) {
    case Pose::Kind::stands:
      add_edges(p.polygon, tip, rows);
      break;
    case Pose::Kind::hangs: {
      const Eigen::Vector3d point = p.turn * rests.point_mm;
      add_vertical(point, rows);
      rows.at_most.push_back({{kLeastDepth * p.diagonal_mm - point.z(), 0, 0, 1}});
      break;
    }
    default: {
      const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
      const Waterplane plane{up, waterline_for_volume(*p.hull, up, *mass_g / (1e-3 * mechanism_.fluid_g_cm3))};
      const Hydrostatics water = hydrostatics(*p.hull, plane);
      add_vertical(water.centre_of_buoyancy_mm, rows);
      rows.at_most.push_back({{kLeastHeight * p.diagonal_mm - water.metacentre_mm(plane).z(), 0, 0, 1}});
    }
  }
  for (const HingeBalance& hinge : mechanism_.states[state].hinges) add_hinge(hinge, p.turn, rows);
  return rows;
}

MechanismStates::Wanted MechanismStates::wanted(const Placed& p, const StateRows::Row& row, double scale) const {
  Wanted w{Eigen::VectorXd::Zero(10 * static_cast<Eigen::Index>(bodies_.size())), 0};
  Eigen::Index j = 0;
  for (std::size_t n = 0; n < mechanism_.parts.size(); ++n) {
    const bool counts = !row.hinge || std::count(row.hinge->parts.begin(), row.hinge->parts.end(), n) > 0;
    if (counts) w.constant += row.r.dot(p.constant[n]) / scale;
    if (!mechanism_.parts[n].printed) continue;
    if (counts) w.row.segment<10>(10 * j) = p.of_part[static_cast<std::size_t>(j)].transpose() * row.r / scale;
    ++j;
  }
  return w;
}

PartsGoal MechanismStates::goal(double tip, std::optional<double> mass_g, std::optional<std::size_t> only) const {
  const auto parts = static_cast<Eigen::Index>(bodies_.size());
  const double mass = mass_g.value_or(solid_g_);
  std::vector<Wanted> level, at_most;
  PartsGoal goal;
  goal.g = Eigen::VectorXd::Zero(10 * parts);
  const bool stands = any(Pose::Kind::stands);
  if (mass_g) {
    Wanted w = wanted(placed_.front(), {Eigen::Vector4d::UnitX()}, mass);
    w.constant -= 1;
    level.push_back(w);
  } else if (stands) {
    goal.g += wanted(placed_.front(), {Eigen::Vector4d::UnitX()}, mass).row;
  }
  for (std::size_t k = 0; k < placed_.size(); ++k) {
    const Placed& p = placed_[k];
    const double scale = mass * p.diagonal_mm;
    const bool hangs = mechanism_.states[k].rests.kind == Pose::Kind::hangs;
    const double from = hangs ? (p.turn * mechanism_.states[k].rests.point_mm).z() : p.polygon.ground_mm;
    const double weight = (mass_g || !stands ? 1 : kHeights) / static_cast<double>(placed_.size());
    goal.g += weight * wanted(p, {{-from, 0, 0, 1}}, scale).row;
    if (only && *only != k) continue;
    const StateRows rows = this->rows(k, tip, mass_g);
    for (const StateRows::Row& row : rows.level) level.push_back(wanted(p, row, scale));
    for (const StateRows::Row& row : rows.at_most) at_most.push_back(wanted(p, row, scale));
  }
  goal.at_most = static_cast<Eigen::Index>(at_most.size());
  level.insert(level.end(), at_most.begin(), at_most.end());
  goal.J.resize(static_cast<Eigen::Index>(level.size()), 10 * parts);
  goal.c_0.resize(goal.J.rows());
  for (Eigen::Index n = 0; n < goal.J.rows(); ++n) {
    goal.J.row(n) = level[static_cast<std::size_t>(n)].row.transpose();
    goal.c_0[n] = level[static_cast<std::size_t>(n)].constant;
  }
  return goal;
}

Eigen::Vector4d MechanismStates::together(std::size_t state, const std::vector<Moments>& s) const {
  const Placed& p = placed_[state];
  Eigen::Vector4d sum = std::accumulate(p.constant.begin(), p.constant.end(), Eigen::Vector4d(Eigen::Vector4d::Zero()));
  for (std::size_t j = 0; j < s.size(); ++j) sum += p.of_part[j] * s[j];
  return sum;
}

double MechanismStates::tipping_angle_rad(std::size_t state, const std::vector<Moments>& s) const {
  if (mechanism_.states[state].rests.kind != Pose::Kind::stands) return std::numeric_limits<double>::infinity();
  const Eigen::Vector4d m = together(state, s);
  const std::vector<double> angles = tipping_angles_rad(placed_[state].polygon, m.tail<3>() / m[0]);
  return *std::min_element(angles.begin(), angles.end());
}

double MechanismStates::metacentric_height(std::size_t state, const std::vector<Moments>& s) const {
  const Placed& p = placed_[state];
  const Eigen::Vector4d m = together(state, s);
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  const Waterplane plane{up, waterline_for_volume(*p.hull, up, m[0] / (1e-3 * mechanism_.fluid_g_cm3))};
  return (hydrostatics(*p.hull, plane).metacentre_mm(plane).z() - m[3] / m[0]) / p.diagonal_mm;
}

bool MechanismStates::comes_back(std::size_t state, const std::vector<Moments>& s) const {
  constexpr double degree = std::numbers::pi / 180;
  const Eigen::Vector4d m = together(state, s);
  return detail::comes_back({*placed_[state].hull, mechanism_.fluid_g_cm3, m[0], m.tail<3>() / m[0]}, 4, 0.5 * degree);
}

}  // namespace rayrep::detail
