#include "make/fixed.h"

#include <algorithm>
#include <string>

#include "base/text.h"
#include "mesh/revolved.h"
#include "mesh/surface_gap.h"
#include "rayrep/base/error.h"
#include "rayrep/mesh/boolean.h"
#include "rayrep/mesh/mesh_check.h"
#include "rayrep/mesh/surface_query.h"
#include "rayrep/physics/moments.h"

namespace rayrep::detail {
namespace {

const Mesh& room_of(const FixedBody& body) { return body.room.triangles.empty() ? body.part.mesh : body.room; }

void add_room(Mesh& mesh, const FixedBody& body) {
  Mesh room = room_of(body);
  flip(room);
  append(mesh, room);
}

}  // namespace

Mesh with_rooms(Mesh solid, const std::vector<FixedBody>& fixed) {
  for (const FixedBody& body : fixed) add_room(solid, body);
  return solid;
}

std::vector<Mesh> rooms_of(const std::vector<FixedBody>& fixed) {
  std::vector<Mesh> rooms;
  for (const FixedBody& body : fixed) rooms.push_back(room_of(body));
  return rooms;
}

std::size_t triangles_of(const std::vector<Mesh>& meshes) {
  std::size_t count = 0;
  for (const Mesh& mesh : meshes) count += mesh.triangles.size();
  return count;
}

Mesh posts_below(const std::vector<Mesh>& rooms, const Mesh& mesh, double wall_mm) {
  Mesh posts;
  if (rooms.empty()) return posts;
  const SurfaceQuery surface(mesh);
  std::vector<LineHit> hits;
  for (const Mesh& room : rooms) {
    const Eigen::Vector3d top = *std::min_element(room.vertices.begin(), room.vertices.end(),
                                                  [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) { return a.z() < b.z(); });
    surface.line_hits(top.head<2>(), hits);
    double bottom = bounding_box(mesh).min().z();
    for (const LineHit& hit : hits)
      if (hit.z_mm < top.z() - 1e-6 * wall_mm && hit.sign > 0) bottom = hit.z_mm;
    constexpr int kSides = 6;
    const double radius = 0.5 * wall_mm;
    Mesh post = revolved({{0, bottom}, {radius, bottom}, {radius, top.z()}, {0, top.z()}}, kSides);
    for (Eigen::Vector3d& v : post.vertices) v.head<2>() += top.head<2>();
    append(posts, post);
  }
  return posts;
}

std::vector<double> pauses_mm(const std::vector<FixedBody>& fixed, const Mesh& solid, const Eigen::Vector3d& up) {
  const Eigen::Vector3d direction = up.normalized();
  const auto height = [&direction](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return direction.dot(a) < direction.dot(b);
  };
  if (fixed.empty()) return {};
  const double lowest = direction.dot(*std::min_element(solid.vertices.begin(), solid.vertices.end(), height));
  std::vector<double> all;
  for (const Mesh& room : rooms_of(fixed))
    all.push_back(direction.dot(*std::max_element(room.vertices.begin(), room.vertices.end(), height)) - lowest);
  std::sort(all.begin(), all.end());
  constexpr double kSame_mm = 1e-6;
  all.erase(std::unique(all.begin(), all.end(), [](double a, double b) { return b - a < kSame_mm; }), all.end());
  return all;
}

Moments fixed_moments(const std::vector<FixedBody>& fixed, double density_g_cm3) {
  Delivery all;
  for (const FixedBody& body : fixed) all.parts.push_back(body.part);
  return insert_moments(all, density_g_cm3);
}

void require_room(const std::vector<FixedBody>& fixed, const Mesh& solid, double wall_mm, const Progress& progress) {
  Mesh around = solid;
  for (std::size_t n = 0; n < fixed.size(); ++n) {
    progress.check();
    const Part& part = fixed[n].part;
    const Mesh& room = room_of(fixed[n]);
    const std::string name = "Fixed body " + std::to_string(n + 1);
    if (!(part.density_g_cm3 > 0) || !(mesh_moments(part.mesh)[M1] > 0) || !(mesh_moments(room)[M1] > 0))
      throw Error(ErrorCode::usage, name + " needs a positive density and a closed surface that faces outward.");
    const SurfaceQuery surface(around);
    const double gap_mm = smallest_gap(room, surface, progress);
    if (!(gap_mm > 0) || !is_inside(surface, room.vertices.front()))
      throw Error(ErrorCode::goal, name + " does not lie inside the body, or meets another one that is fixed in it.");
    if (gap_mm < wall_mm * (1 - 1e-6))
      throw Error(ErrorCode::goal, name + " lies " + number(gap_mm, 3) +
                                       " mm below the surface, or from another one that is fixed in the body, which is less than "
                                       "the wall of " +
                                       number(wall_mm, 2) + " mm: move it, or choose a thinner wall (--wall).");
    add_room(around, fixed[n]);
  }
}

void require_kept(const std::vector<Mesh>& regions, const Mesh& solid, const Progress& progress) {
  for (std::size_t n = 0; n < regions.size(); ++n) {
    const std::vector<Mesh> both = {solid, regions[n]};
    if (mesh_moments(combined(both, {.operation = BooleanOperation::intersect}, progress).mesh)[M1] > 0) continue;
    const Eigen::AlignedBox3d region = bounding_box(regions[n]);
    const Eigen::AlignedBox3d body = bounding_box(solid);
    throw Error(ErrorCode::usage,
                concat("Region ", n + 1, " of what is kept solid (--keep-solid) lies outside the body: it reaches from ",
                       shown_to_thousandths(region.min()), " to ", shown_to_thousandths(region.max()), " mm, the body from ",
                       shown_to_thousandths(body.min()), " to ", shown_to_thousandths(body.max()),
                       ". Its mesh is taken in mm, where it is in the body after --unit and --size."));
  }
}

void require_held(const HollowOptions& options, const Mesh& solid, const HollowResult& made) {
  if (options.keep_solid.empty() || made.removed_islands == 0) return;
  const Mesh delivered = made.delivery.solid();
  const SurfaceQuery before(solid), after(delivered);
  const auto in_void = [&](const Eigen::Vector3d& p) { return is_inside(before, p) && !is_inside(after, p); };
  for (std::size_t n = 0; n < options.keep_solid.size(); ++n) {
    const std::vector<Eigen::Vector3d>& region = options.keep_solid[n].vertices;
    if (!std::all_of(region.begin(), region.end(), in_void)) continue;
    throw Error(
        ErrorCode::usage,
        concat("Region ", n + 1, " of what is kept solid (--keep-solid) lies free in a cavity, where nothing holds it: let it ",
               "reach into the wall, with a strut for example",
               print_of(made.spec).infill.wanted() || print_of(made.spec).self_supporting_deg > 0
                   ? "."
                   : ", or have it carried by pillars (--self-supporting)."));
  }
}

}  // namespace rayrep::detail
