#include "rayrep/draw/marks.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "rayrep/base/error.h"
#include "rayrep/mesh/mesh_check.h"
#include "rayrep/physics/hydrostatics.h"
#include "rayrep/physics/spin_axis.h"
#include "rayrep/physics/support_polygon.h"

namespace rayrep {
namespace {

/// Heights of the lowest and highest vertex along `up`.
std::pair<double, double> heights_along(const Mesh& mesh, const Eigen::Vector3d& up) {
  std::pair<double, double> range = {std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  for (const Eigen::Vector3d& v : mesh.vertices) {
    range.first = std::min(range.first, up.dot(v));
    range.second = std::max(range.second, up.dot(v));
  }
  return range;
}

struct Body {
  const Mesh& hull;  ///< its surface, without sealed cavities
  const MassProperties& mass;
  std::pair<double, double> heights;
};

/// The surface of the fluid; none where the body sinks.
std::optional<double> surface_mm(const FloatSpec& spec, const Body& body, const PreparedHull& prepared, const Marks& marks) {
  const auto [bottom, top] = body.heights;
  if (spec.waterline_mm) return bottom + *spec.waterline_mm;
  if (spec.submerged_fraction) return bottom + *spec.submerged_fraction * (top - bottom);
  try {
    const double volume_mm3 = spec.submerged_volume_fraction
                                  ? *spec.submerged_volume_fraction * submerged_hydrostatics(prepared).displaced_volume_mm3
                                  : body.mass.mass_g / (1e-3 * spec.fluid_g_cm3);
    return waterline_for_volume(prepared, marks.up, volume_mm3);
  } catch (const Error& error) {
    if (error.code() != ErrorCode::goal) throw;
    return std::nullopt;
  }
}

void mark(const FloatSpec& spec, const Body& body, const Progress& progress, Marks& marks) {
  const PreparedHull prepared(boundary_of_union(body.hull, progress));
  const std::optional<double> offset = surface_mm(spec, body, prepared, marks);
  if (!offset) return;
  if (*offset >= body.heights.second) {  // under water
    marks.water = {*offset, submerged_hydrostatics(prepared).centre_of_buoyancy_mm};
    return;
  }
  const Waterplane plane{marks.up, *offset};
  const Hydrostatics water = hydrostatics(prepared, plane);
  marks.water = {*offset, water.centre_of_buoyancy_mm, water.metacentre_mm(plane), water.dry_interior_mm3 > 0};
}

void mark(const SpinSpec& spec, const Body& body, const Progress& progress, Marks& marks) {
  marks.yoyo = spec.yoyo;
  if (spec.yoyo)
    marks.contact_mm = spec.centre_mm.value_or(bounding_box(body.hull).center());
  else
    marks.contact_mm = contact_point(body.hull, spec.axis, spec.up, progress);
  if (!spec.yoyo) marks.ground_mm = marks.up.dot(*marks.contact_mm);
}

void mark(const StandSpec& spec, const Body& body, const Progress& /*progress*/, Marks& marks) {
  const Eigen::Matrix3d to_ground = up_to_z(marks.up);
  const Mesh turned = transformed(body.hull, Eigen::Affine3d(to_ground));
  const auto [bottom, top] = body.heights;
  const SupportPolygon polygon = support_polygon(turned, spec.contact_tolerance_mm.value_or(contact_tolerance_mm(top - bottom)));
  for (const Eigen::Vector2d& corner : polygon.corners_mm)
    marks.support_mm.push_back(to_ground.transpose() * Eigen::Vector3d(corner.x(), corner.y(), polygon.ground_mm));
  marks.ground_mm = bottom;
}

// Numbers and throws show nothing but the centres.
void mark(const TargetSpec& /*spec*/, const Body& /*body*/, const Progress& /*progress*/, Marks& /*marks*/) {}
void mark(const DiceSpec& /*spec*/, const Body& /*body*/, const Progress& /*progress*/, Marks& /*marks*/) {}

void mark(const PoseSpec& spec, const Body& body, const Progress& progress, Marks& marks) {
  if (spec.poses.empty()) return;
  const Pose& pose = spec.poses.front();
  switch (pose.kind) {
    case Pose::Kind::stands:
    case Pose::Kind::rights: {
      StandSpec stand;
      stand.contact_tolerance_mm = spec.contact_tolerance_mm;
      mark(stand, body, progress, marks);
      break;
    }
    case Pose::Kind::spins: {
      SpinSpec spins;
      spins.up = pose.up_or(spec.up);
      spins.axis = pose.axis;
      mark(spins, body, progress, marks);
      break;
    }
    case Pose::Kind::hangs:
      marks.hook_mm = pose.point_mm;
      break;
    case Pose::Kind::floats: {
      FloatSpec floats;
      floats.fluid_g_cm3 = spec.fluid_g_cm3;
      floats.waterline_mm = pose.waterline_mm;
      mark(floats, body, progress, marks);
      break;
    }
  }
}

Eigen::Vector3d up_in_picture(const Spec& spec) {
  const PoseSpec* poses = std::get_if<PoseSpec>(&spec);
  if (poses && !poses->poses.empty()) return poses->poses.front().up_or(poses->up);
  return up_of(spec);
}

}  // namespace

Marks marks_of(const Mesh& outside, const Spec& spec, const MassProperties& body, const Progress& progress) {
  Marks marks;
  marks.up = up_in_picture(spec).normalized();
  marks.mass_g = body.mass_g;
  marks.centre_of_mass_mm = body.centre_of_mass_mm;
  const Mesh hull = outer_hull(outside);
  const Body known{hull, body, heights_along(hull, marks.up)};
  std::visit([&](const auto& s) { mark(s, known, progress, marks); }, spec);
  return marks;
}

}  // namespace rayrep
