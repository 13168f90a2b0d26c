#include "rayrep/physics/hydrostatics.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "base/linear_algebra.h"
#include "base/text.h"
#include "mesh/mesh_edges.h"
#include "mesh/shells.h"
#include "physics/clipped_hull.h"
#include "physics/pockets.h"
#include "physics/prepared_hull.h"
#include "rayrep/base/error.h"
#include "rayrep/physics/moments.h"

namespace rayrep {
namespace {

// ----------------------------------------------------------------------------------------------------------- nesting of components

// A component of a mesh, as its triangles in the whole.
struct Part {
  std::vector<int> triangles;
  Eigen::AlignedBox3d box;
  bool closed = true;
};

std::vector<Part> parts_of(const Mesh& mesh, const Components& components) {
  std::vector<Part> parts(components.count);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    Part& part = parts[components.of_triangle[t]];
    part.triangles.push_back(static_cast<int>(t));
    for (int k = 0; k < 3; ++k) part.box.extend(mesh.corner(t, k));
  }
  for_each_edge(mesh, [&](auto begin, auto end) {
    if (edge_balance(begin, end) != 0) parts[components.of_triangle[begin->triangle]].closed = false;
  });
  return parts;
}

// Winding number of the surroundings of a part (all others) where it lies, taken at the first of a few of its triangles'
// centroids that is not on another part's surface.
int winding_of_surroundings(ShellNesting& nesting, const Mesh& mesh, const Part& part, int self) {
  const std::size_t tries = std::min<std::size_t>(part.triangles.size(), 8);
  Surroundings around;
  for (std::size_t i = 0; i < tries; ++i) {
    const int t = part.triangles[i * part.triangles.size() / tries];
    nesting.around((mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2)) / 3, self, around);
    if (around.touched.empty() && around.line_closes) return around.winding;
  }
  return 0;
}

}  // namespace

double Hydrostatics::metacentric_radius_mm() const {
  return displaced_volume_mm3 > 0 ? smallest_second_moment_mm4 / displaced_volume_mm3 : 0;
}

Eigen::Vector3d Hydrostatics::metacentre_mm(const Waterplane& plane) const {
  return centre_of_buoyancy_mm + metacentric_radius_mm() * plane.normal;
}

namespace {

// At which height of the water, along the normal, the space beside each triangle is joined to the sea; none when nothing below the
// water is dry.
std::shared_ptr<const FloodHeights> flood_heights(PreparedHull::State& prepared, const Frame& frame,
                                                  const std::vector<Eigen::Vector3d>& points) {
  const Mesh& hull = prepared.mesh;
  std::vector<double> heights(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) heights[i] = points[i].z();
  std::vector<double> projected(hull.triangles.size());
  for (std::size_t t = 0; t < projected.size(); ++t) {
    const Eigen::Vector2d b = (points[hull.triangles[t][1]] - points[hull.triangles[t][0]]).head<2>();
    const Eigen::Vector2d c = (points[hull.triangles[t][2]] - points[hull.triangles[t][0]]).head<2>();
    projected[t] = (b.x() * c.y() - b.y() * c.x()) / 2;
  }
  if (!may_have_pockets(hull.triangles, heights, projected, prepared.pinched(), 0)) return nullptr;
  if (auto known = prepared.floods_along(frame)) return known;
  for (std::size_t i = 0; i < points.size(); ++i) heights[i] = frame.n.dot(hull.vertices[i]);
  return std::make_shared<FloodHeights>(prepared.surface.get(hull.vertices, hull.triangles).flood_heights(frame, heights, {}));
}

}  // namespace

PreparedHull::PreparedHull(Mesh mesh) : state_(std::make_shared<State>(std::move(mesh))) {}

const Mesh& PreparedHull::mesh() const { return state_->mesh; }

Hydrostatics hydrostatics(const PreparedHull& prepared, const Waterplane& plane) {
  const Mesh& hull = prepared.mesh();
  assert(std::abs(plane.normal.norm() - 1) < 1e-9);
  Hydrostatics result;
  if (hull.triangles.empty()) return result;
  const Frame frame = frame_of(plane.normal);
  const Eigen::Vector3d centre = bounding_box(hull).center();
  std::vector<Eigen::Vector3d> points;
  points.reserve(hull.vertices.size());
  for (const auto& v : hull.vertices) {
    const Eigen::Vector3d from_centre = v - centre;
    // Height from the coordinates as they are: a vertex that lies on the plane must give exactly 0.
    points.emplace_back(frame.u.dot(from_centre), frame.v.dot(from_centre), frame.n.dot(v) - plane.offset_mm);
  }
  const auto floods = flood_heights(prepared.state(), frame, points);
  const auto dry = [&](std::size_t t) { return floods && floods->dry(t, plane.offset_mm); };
  const Integrals sum = integrate(points, hull.triangles, [&](std::size_t t) { return !dry(t); });
  if (floods && !floods->empty()) {
    result.dry_interior_mm3 = std::max(0., -integrate(points, hull.triangles, dry).volume);
    for (std::size_t t = 0; t < hull.triangles.size(); ++t) {
      const Eigen::Vector3i& v = hull.triangles[t];
      const bool below = std::min({points[v[0]].z(), points[v[1]].z(), points[v[2]].z()}) < 0;
      if (const double rim = floods->of_triangle[t]; below && dry(t) && std::isfinite(rim))
        result.freeboard_mm = std::min(result.freeboard_mm.value_or(rim - plane.offset_mm), rim - plane.offset_mm);
    }
  }
  const Eigen::Vector3d on_plane = centre - (frame.n.dot(centre) - plane.offset_mm) * frame.n;
  if (sum.volume > 0) {
    const Eigen::Vector3d c = sum.first / sum.volume;
    result.displaced_volume_mm3 = sum.volume;
    result.centre_of_buoyancy_mm = on_plane + frame.u * c.x() + frame.v * c.y() + frame.n * c.z();
  }
  if (sum.area > 0) {
    const Eigen::Vector2d f = sum.area_first / sum.area;
    result.waterplane_area_mm2 = sum.area;
    result.centre_of_flotation_mm = on_plane + frame.u * f.x() + frame.v * f.y();
    const Eigen::Vector2d second = symmetric_eigen(central_second_moments(sum)).values;
    result.smallest_second_moment_mm4 = std::max(0., second[0]);
    result.largest_second_moment_mm4 = std::max(0., second[1]);
  }
  return result;
}

Hydrostatics submerged_hydrostatics(const PreparedHull& hull) {
  const Moments s = mesh_moments(hull.mesh());
  Hydrostatics result;
  if (!(s[M1] > 0)) return result;
  result.displaced_volume_mm3 = s[M1];
  result.centre_of_buoyancy_mm = s.segment<3>(MX) / s[M1];
  return result;
}

Mesh outer_hull(const Mesh& mesh) {
  const Mesh joined = with_merged_vertices(mesh);
  const Components components = connected_components(joined);
  const std::vector<Part> parts = parts_of(joined, components);

  const std::vector<double> volumes = shell_volumes(joined, components.of_triangle, components.count);
  ShellNesting nesting(joined, components.of_triangle);

  std::vector<bool> sealed(parts.size(), false);
  for (int i = 0; i < components.count; ++i)
    sealed[i] = parts[i].closed && volumes[i] < 0 && winding_of_surroundings(nesting, joined, parts[i], i) > 0;
  if (std::find(sealed.begin(), sealed.end(), true) == sealed.end()) return mesh;
  // What floats inside a cavity does not meet the fluid either.
  std::vector<bool> dropped = sealed;
  Surroundings around;
  for (int i = 0; i < components.count; ++i) {
    if (sealed[i]) continue;
    nesting.around(joined.corner(parts[i].triangles.front(), 0), i, around);
    for (const auto& [other, winding] : around.shells)
      if (sealed[other] && winding < 0 && parts[other].box.contains(parts[i].box)) dropped[i] = true;
  }
  Mesh result;
  result.vertices = mesh.vertices;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (!dropped[components.of_triangle[t]]) result.triangles.push_back(mesh.triangles[t]);
  return result;
}

double waterline_for_volume(const PreparedHull& prepared, const Eigen::Vector3d& normal, double volume_mm3) {
  ClippedHull hull = prepared.state().clipped_along(normal);
  // Rounding must not turn "all of it" into "too much".
  std::optional<double> offset;
  if (volume_mm3 >= 0) offset = hull.offset_for_volume(volume_mm3, std::numeric_limits<double>::quiet_NaN());
  if (!offset && volume_mm3 >= 0) {
    const double largest = hull.largest_displacement();
    if (volume_mm3 <= largest * (1 + 1e-12))
      offset = hull.offset_for_volume(std::min(volume_mm3, largest * (1 - 1e-12)), std::numeric_limits<double>::quiet_NaN());
  }
  if (!offset)
    throw Error(ErrorCode::goal,
                concat("The body would have to displace ", volume_mm3 / 1000, " cm3, but its hull holds only ",
                       hull.largest_displacement() / 1000, " cm3: it sinks. Use a lighter material or leave more of it hollow."));
  return normal.dot(hull.centre()) + *offset;
}

double largest_displacement_mm3(const PreparedHull& prepared, const Eigen::Vector3d& normal) {
  ClippedHull hull = prepared.state().clipped_along(normal);
  return hull.largest_displacement();
}

}  // namespace rayrep
