#include "rayrep/draw/section_picture.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/text.h"
#include "rayrep/base/error.h"
#include "rayrep/base/setting.h"
#include "rayrep/mesh/mesh.h"

namespace rayrep {
namespace {

/// Of a vector what lies across a unit vector, as a unit vector.
Eigen::Vector3d part_across(const Eigen::Vector3d& v, const Eigen::Vector3d& unit) { return (v - v.dot(unit) * unit).normalized(); }

/// Numbers that are meant to be 0 or 1 but for rounding.
Eigen::Vector3d tidied(const Eigen::Vector3d& v) {
  return v.unaryExpr([](double x) { return std::abs(x - std::round(x)) < 1e-15 ? std::round(x) + 0.0 : x; });
}

}  // namespace

std::string SectionPlane::words(double offset) const {
  const bool vector = axis.find(',') != std::string::npos;
  return concat(vector ? "(" + axis + ")/|...| p" : axis, " = ", shown(std::round(1e3 * offset) / 1e3 + 0.0, 6), " mm");
}

std::string SectionPlane::file_word() const {
  std::string word = axis;
  std::replace(word.begin(), word.end(), ',', '_');
  if (!offset_mm) return word;
  return word + (axis.find(',') == std::string::npos ? "" : "_") + shown(*offset_mm + 0.0, 12);
}

SectionPlane parse_section_plane(const std::string& text) {
  const std::size_t equals = text.find('=');
  SectionPlane plane;
  plane.axis = text.substr(0, equals);
  try {
    plane.normal = parse_direction(plane.axis);
  } catch (const Error&) {
    throw Error(ErrorCode::usage,
                "--section takes x, y, z or a direction X,Y,Z, with an offset or without, such as y=0; it is '" + text + "'.");
  }
  if (equals != std::string::npos) plane.offset_mm = parse_number("section", text.substr(equals + 1));
  return plane;
}

void require_plane_meets(const SectionPlane& plane, const Mesh& mesh) {
  double lowest = std::numeric_limits<double>::infinity();
  double highest = -lowest;
  for (const Eigen::Vector3d& v : mesh.vertices) {
    lowest = std::min(lowest, plane.normal.dot(v));
    highest = std::max(highest, plane.normal.dot(v));
  }
  const double offset = plane.offset_mm.value();
  if (lowest < offset && offset <= highest) return;
  throw Error(ErrorCode::usage,
              concat("The plane ", plane.words(offset), " of --section does not meet the body, which lies between ",
                     shown(lowest + 0.0, 4), " and ", shown(highest + 0.0, 4), " mm there."));
}

SectionView view_of(const SectionPlane& plane, double offset_mm, const Eigen::Vector3d& up) {
  constexpr double kLevel = 0.05;  // sine of the angle: flatter planes are seen from above
  SectionView view;
  const Eigen::Vector3d vertical = up.normalized();
  view.level = plane.normal.cross(vertical).norm() < kLevel;
  Eigen::Vector3d right;
  Eigen::Vector3d upward;
  if (view.level) {
    const Eigen::Vector3d to_viewer = plane.normal.dot(vertical) < 0 ? Eigen::Vector3d(-plane.normal) : plane.normal;
    const bool along_x = std::abs(to_viewer.x()) > 0.9;
    right = tidied(part_across(along_x ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitX(), to_viewer));
    upward = tidied(to_viewer.cross(right));
  } else {
    upward = tidied(part_across(vertical, plane.normal));
    right = tidied(upward.cross(plane.normal).normalized());
    Eigen::Index largest = 0;
    right.cwiseAbs().maxCoeff(&largest);
    if (right[largest] < 0) right = -right;
  }
  const Eigen::Vector3d to_viewer = tidied(right.cross(upward));
  view.to_view.row(0) = right;
  view.to_view.row(1) = upward;
  view.to_view.row(2) = to_viewer;
  view.depth_mm = to_viewer.dot(plane.normal) < 0 ? -offset_mm : offset_mm;
  return view;
}

double SectionArea::area_mm2() const {
  double sum = 0;
  for (const SectionLoop& loop : loops) sum += loop_moments(loop).area_mm2;
  return sum;
}

std::vector<SectionArea> section_areas(const Delivery& delivery, const SectionView& view) {
  std::vector<SectionArea> areas;
  for (const auto& [role, kind] :
       {std::pair{Part::Role::body, SectionArea::Kind::material}, std::pair{Part::Role::plug, SectionArea::Kind::material},
        std::pair{Part::Role::modifier, SectionArea::Kind::infill}, std::pair{Part::Role::insert, SectionArea::Kind::insert}}) {
    const Mesh mesh = delivery.mesh_of(role);
    if (mesh.triangles.empty()) continue;
    const Mesh seen = with_merged_vertices(transformed(mesh, Eigen::Affine3d(view.to_view)));
    areas.push_back({kind, section(seen, view.depth_mm)});
  }
  return areas;
}

}  // namespace rayrep
