// Casting against twins that test every triangle. First byte of the input: even, a mesh on whole numbers, of triangles in any
// state, cast along rays through whole and other places, where crossings are decided in integers; odd, bodies of fuzz/bodies.h,
// whose inner domain is held against the definition of it.

#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

#include "bodies.h"
#include "plain.h"
#include "rayrep/mesh/mesh_check.h"
#include "rayrep/mesh/surface_query.h"
#include "rayrep/rays/inner_domain.h"
#include "rayrep/rays/ray_cast.h"

namespace {

using fuzz::Bytes;
using fuzz::require;
using rayrep::Interval;
using rayrep::Mesh;
using rayrep::RayGrid;
using rayrep::RayRep;
using rayrep::Region;

// -------------------------------------------------------------------------------------------------- whole numbers, any triangles

constexpr std::int64_t kUnit = std::int64_t{1} << 32;  ///< what is one unit of a mesh of whole numbers

struct Flat {
  std::int64_t x, y;
};

/// Twice the area of (u, v, p): exact for whole numbers up to 255 and p moved by less than one.
__extension__ typedef __int128 Wide;
Wide area2(const Flat& u, const Flat& v, const Flat& p) { return Wide(v.x - u.x) * (p.y - u.y) - Wide(v.y - u.y) * (p.x - u.x); }

struct Hit {
  double z;
  int sign;
};

/// The hits of the ray through the place p, in whole units: p is moved by so little, in x and far less in y, that it changes sides
/// of no edge it does not lie on.
std::vector<Hit> hits_of(const Mesh& mesh, const Flat& p) {
  const Flat moved{p.x * kUnit + kUnit / 4096, p.y * kUnit + kUnit / (4096L * 4096)};
  std::vector<Hit> hits;
  for (const auto& t : mesh.triangles) {
    Flat corners[3];
    for (int k = 0; k < 3; ++k)
      corners[k] = {static_cast<std::int64_t>(mesh.vertices[t[k]].x()) * kUnit,
                    static_cast<std::int64_t>(mesh.vertices[t[k]].y()) * kUnit};
    const Wide c = area2(corners[0], corners[1], moved);
    const Wide a = area2(corners[1], corners[2], moved);
    const Wide b = area2(corners[2], corners[0], moved);
    if (!((a > 0 && b > 0 && c > 0) || (a < 0 && b < 0 && c < 0))) continue;
    // The height is that above p itself.
    const Flat at{p.x * kUnit, p.y * kUnit};
    const auto weight = [&](int k, int l) { return static_cast<long double>(area2(corners[k], corners[l], at)); };
    const long double wc = weight(0, 1);
    const long double wa = weight(1, 2);
    const long double wb = weight(2, 0);
    const long double z =
        (wa * mesh.vertices[t[0]].z() + wb * mesh.vertices[t[1]].z() + wc * mesh.vertices[t[2]].z()) / (wa + wb + wc);
    hits.push_back({static_cast<double>(z), a > 0 ? -1 : 1});
  }
  return hits;
}

/// The intervals where the winding number is as asked; none if it falls below 0 or does not end at 0.
std::vector<Interval> intervals_of(std::vector<Hit> hits, Region region) {
  // Heights of small whole numbers differ by far more than rounding, or not at all.
  std::sort(hits.begin(), hits.end(), [](const Hit& a, const Hit& b) { return a.z < b.z; });
  for (std::size_t k = 1; k < hits.size(); ++k)
    if (hits[k].z - hits[k - 1].z < 1e-8) hits[k].z = hits[k - 1].z;
  std::sort(hits.begin(), hits.end(), [](const Hit& a, const Hit& b) { return a.z != b.z ? a.z < b.z : a.sign > b.sign; });
  std::vector<Interval> intervals;
  int winding = 0;
  for (std::size_t k = 0; k < hits.size(); ++k) {
    winding += hits[k].sign;
    if (winding < 0) return {};
    const double next = k + 1 < hits.size() ? hits[k + 1].z : hits[k].z;
    if (!(region == Region::solid ? winding > 0 : winding == 1) || next == hits[k].z) continue;
    if (!intervals.empty() && intervals.back().hi == hits[k].z)
      intervals.back().hi = next;
    else
      intervals.push_back({hits[k].z, next});
  }
  return winding == 0 ? intervals : std::vector<Interval>();
}

/// Triangles of any kind, or closed tetrahedra, over few corners.
Mesh whole_numbers(Bytes& bytes) {
  Mesh mesh;
  const int corners = 3 + bytes.below(12);
  const int range = 1 + bytes.below(9);
  for (int k = 0; k < corners; ++k) {
    const Eigen::Vector3i place{bytes.below(range), bytes.below(range), bytes.below(range)};
    mesh.vertices.emplace_back(place.cast<double>());
  }
  const bool closed = bytes.chance(170);
  const int pieces = 1 + bytes.below(12);
  for (int k = 0; k < pieces; ++k) {
    int v[4];
    for (int& corner : v) corner = bytes.below(corners);
    mesh.triangles.emplace_back(v[0], v[1], v[2]);
    if (!closed) continue;
    mesh.triangles.emplace_back(v[0], v[3], v[1]);
    mesh.triangles.emplace_back(v[1], v[3], v[2]);
    mesh.triangles.emplace_back(v[2], v[3], v[0]);
    const Eigen::Vector3d a = mesh.vertices[v[1]] - mesh.vertices[v[0]];
    const Eigen::Vector3d b = mesh.vertices[v[2]] - mesh.vertices[v[0]];
    const Eigen::Vector3d c = mesh.vertices[v[3]] - mesh.vertices[v[0]];
    if (a.cross(b).dot(c) > 0)  // outward, with the fourth corner behind the first triangle
      for (std::size_t t = mesh.triangles.size() - 4; t < mesh.triangles.size(); ++t)
        std::swap(mesh.triangles[t][0], mesh.triangles[t][1]);
  }
  return mesh;
}

bool same(const std::vector<Interval>& twin, const Interval* begin, const Interval* end) {
  return std::equal(twin.begin(), twin.end(), begin, end, [](const Interval& a, const Interval& b) {
    return std::abs(a.lo - b.lo) < 1e-7 && std::abs(a.hi - b.hi) < 1e-7;
  });
}

void cast_whole_numbers(Bytes& bytes) {
  const Mesh mesh = whole_numbers(bytes);
  const rayrep::SurfaceQuery surface(mesh);
  RayGrid grid;
  grid.origin_mm = Eigen::Vector2d(-1, -1);
  grid.nx = grid.ny = 11;
  for (const Region region : {Region::solid, Region::single_layer}) {
    rayrep::CastReport report;
    const RayRep rays = cast_rays(surface, grid, region, &report);
    require(rays.first.size() == grid.size() + 1 && rays.first.back() == rays.intervals.size(), "every ray has its intervals");
    require(report.rays == grid.size() && report.bad <= report.rays, "every ray is counted");
    for (std::size_t ray = 0; ray < grid.size(); ++ray) {
      const Eigen::Vector2d at = grid.at(ray);
      const std::vector<Interval> twin =
          intervals_of(hits_of(mesh, {static_cast<std::int64_t>(at.x()), static_cast<std::int64_t>(at.y())}), region);
      require(same(twin, rays.intervals.data() + rays.first[ray], rays.intervals.data() + rays.first[ray + 1]),
              "a ray's intervals are those of its crossings with all triangles");
    }
  }
}

// ------------------------------------------------------------------------------------------------------------- the inner domain

struct Place {
  double distance;
  double winding;
};

Place place_of(const plain::Surface& surface, const Eigen::Vector3d& v) {
  const plain::Point p = plain::point(v);
  plain::Real nearest = 1e30L;
  for (const auto& t : surface) nearest = std::min(nearest, plain::distance(p, t));
  return {static_cast<double>(nearest), static_cast<double>(plain::winding(surface, p))};
}

/// Whether the winding number is negative somewhere on a ray: where a cavity pokes out of its body.
bool falls_below_0(const Mesh& mesh, const plain::Surface& surface, const Eigen::Vector2d& xy) {
  std::vector<rayrep::LineHit> hits;
  line_hits_brute_force(mesh, xy, hits);
  for (std::size_t k = 1; k < hits.size(); ++k)
    if (place_of(surface, {xy.x(), xy.y(), (hits[k - 1].z_mm + hits[k].z_mm) / 2}).winding < -0.9) return true;
  return false;
}

void cast_bodies(Bytes& bytes) {
  const rayrep::CheckedMesh checked = rayrep::check_mesh(fuzz::bodies(bytes), {.unite = false});  // rays meet bodies in others
  if (!checked.report.usable) return;
  const rayrep::SurfaceQuery query(checked.mesh);
  rayrep::InnerDomainOptions options;
  const double size = bounding_box(checked.mesh).sizes().maxCoeff();
  options.wall_mm = size * bytes.number(0.01, 0.3);
  options.ray_spacing_mm = size / 5;
  options.field_spacing_mm = size * bytes.number(0.05, 0.15);
  const rayrep::InnerDomain inner = rayrep::inner_domain(query, options);
  const plain::Surface surface = plain::surface_of(checked.mesh);
  require(inner.cast.bad == 0 || falls_below_0(checked.mesh, surface, inner.cast.first_bad_mm),
          "every ray of a closed mesh closes but where its winding number is negative");
  require(inner.dropped_components == 0, "nothing is too small unless asked for");
  const double h = options.field_spacing_mm;
  const double wall = options.wall_mm;
  const auto* intervals = inner.rays.intervals.data();
  for (std::size_t ray = 0; ray < inner.rays.grid.size(); ++ray) {
    const Eigen::Vector2d xy = inner.rays.grid.at(ray);
    const auto begin = inner.rays.first[ray];
    const auto end = inner.rays.first[ray + 1];
    double below = -1;
    for (auto k = begin; k < end; ++k) {
      require(intervals[k].lo < intervals[k].hi && (k == begin || intervals[k].lo >= below), "intervals are disjoint and ascend");
      below = intervals[k].hi;
      const Place middle = place_of(surface, {xy.x(), xy.y(), intervals[k].middle()});
      require(middle.distance > wall - 1.8 * h, "what may be hollow is a wall away from the surface");
      if (middle.distance > 1e-6 * size) require(std::abs(middle.winding - 1) < 0.01, "what may be hollow is inside one body");
    }
    // Where all samples around are in the inner domain, so is the ray.
    for (int k = 0; k < 4; ++k) {
      const double z = bounding_box(checked.mesh).min().z() + size * bytes.odd_number(0, 1);
      const Place place = place_of(surface, {xy.x(), xy.y(), z});
      if (std::abs(place.winding - 1) > 0.01 || place.distance < wall + 2.8 * h) continue;
      require(std::any_of(intervals + begin, intervals + end, [z](const Interval& i) { return i.lo <= z && z <= i.hi; }),
              "what is well inside may be hollow");
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {  // NOLINT(readability-identifier-naming)
  static const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, 1);
  Bytes bytes(data, size);
  if (bytes.byte() % 2 == 0)
    cast_whole_numbers(bytes);
  else
    cast_bodies(bytes);
  return 0;
}
