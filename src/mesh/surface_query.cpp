#include "rayrep/mesh/surface_query.h"

#include <embree3/rtcore.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <new>
#include <utility>

#include "rayrep/base/error.h"

namespace rayrep {
namespace {

__extension__ typedef __float128 Quad;  // 113 bits: the determinant below is exact for coordinates of like size

/// Twice the signed area of (u, v, p) in the xy plane: 0 only when it is exactly 0.
double area2_from(const Eigen::Vector3d& u, const Eigen::Vector3d& v, const Eigen::Vector2d& p) {
  const double left = (v.x() - u.x()) * (p.y() - u.y());
  const double right = (v.y() - u.y()) * (p.x() - u.x());
  const double area = left - right;
  // Four roundings, each below 2^-53 relative: outside this bound the sign is right.
  if (std::abs(area) > 8 * std::numeric_limits<double>::epsilon() * (std::abs(left) + std::abs(right))) return area;
  const Quad exact =
      (Quad(v.x()) - Quad(u.x())) * (Quad(p.y()) - Quad(u.y())) - (Quad(v.y()) - Quad(u.y())) * (Quad(p.x()) - Quad(u.x()));
  return static_cast<double>(exact);
}

/// The side of the directed edge u -> v on which p lies in the xy plane: twice the signed area, and its sign with p moved by
/// an infinitesimal (e, e^2), so that it vanishes only for an edge that projects to a point. theory.md (10).
struct Side {
  double area2 = 0;
  int sign = 0;
};

Side side_of(const Eigen::Vector3d& u, const Eigen::Vector3d& v, const Eigen::Vector2d& p) {
  Side side;
  side.area2 = area2_from(u, v, p);
  double decides = side.area2;
  if (decides == 0) decides = u.y() - v.y();  // d area2 / d p_x
  if (decides == 0) decides = v.x() - u.x();  // d area2 / d p_y
  side.sign = decides > 0 ? 1 : decides < 0 ? -1 : 0;
  return side;
}

/// side_of with the lower index first, so that both triangles of an edge get the same answer up to sign.
Side edge_side(const Mesh& mesh, int u, int v, const Eigen::Vector2d& p) {
  if (u < v) return side_of(mesh.vertices[u], mesh.vertices[v], p);
  const Side reversed = side_of(mesh.vertices[v], mesh.vertices[u], p);
  return {-reversed.area2, -reversed.sign};
}

/// Appends the crossing of the vertical line through p with triangle t, if there is one.
void add_line_hit(const Mesh& mesh, int t, const Eigen::Vector2d& p, std::vector<LineHit>& hits) {
  const Eigen::Vector3i& v = mesh.triangles[t];
  const Side c = edge_side(mesh, v[0], v[1], p);
  const Side a = edge_side(mesh, v[1], v[2], p);
  if (a.sign != c.sign) return;
  const Side b = edge_side(mesh, v[2], v[0], p);
  if (b.sign != c.sign || c.sign == 0) return;
  const double total = a.area2 + b.area2 + c.area2;
  const double z0 = mesh.vertices[v[0]].z();
  LineHit hit;
  hit.triangle = t;
  hit.sign = -c.sign;  // counter-clockwise from above: the line leaves
  hit.z_mm = z0;       // from a corner, so that a level triangle gives its own height exactly
  if (total != 0) hit.z_mm += (b.area2 * (mesh.vertices[v[1]].z() - z0) + c.area2 * (mesh.vertices[v[2]].z() - z0)) / total;
  hits.push_back(hit);
}

/// Ascending in z, entering hits first where they coincide; the rest makes the order unique.
void sort_hits(std::vector<LineHit>& hits) {
  std::sort(hits.begin(), hits.end(), [](const LineHit& a, const LineHit& b) {
    if (a.z_mm != b.z_mm) return a.z_mm < b.z_mm;
    if (a.sign != b.sign) return a.sign > b.sign;
    return a.triangle < b.triangle;
  });
}

/// Handed through Embree to `meet`.
struct LineContext {
  RTCIntersectContext base;  // must come first: Embree hands this back
  Eigen::Vector2d xy;
  std::vector<LineHit>* hits;
};

struct ClosestContext {
  const Mesh* mesh;
  const SurfaceQuery::Farther* farther;
  Eigen::Vector3d p;
  ClosestPoint best;
  double slack_mm;
};

/// A radius within which a tie with the best so far is still found, whatever the order of traversal.
float search_radius(double distance_mm, double slack_mm) { return static_cast<float>((distance_mm + slack_mm) * (1 + 1e-6)); }

void consider(ClosestContext& context, int triangle) {
  const Eigen::Vector3i& v = context.mesh->triangles[triangle];
  const Eigen::Vector3d& a = context.mesh->vertices[v[0]];
  const Eigen::Vector3d& b = context.mesh->vertices[v[1]];
  const Eigen::Vector3d& c = context.mesh->vertices[v[2]];
  // Not even its plane is near enough. Of a needle, whose plane rounding has tilted, this is not asked.
  const Eigen::Vector3d normal = (b - a).cross(c - a);
  const double area2 = normal.squaredNorm();
  const double height = normal.dot(context.p - a);
  const double reach = (1 + 1e-6) * context.best.distance_mm;
  if (height * height > reach * reach * area2 && area2 > 1e-10 * (b - a).squaredNorm() * (c - a).squaredNorm()) return;
  Eigen::Vector3d nearest;
  const double there = point_triangle_distance(context.p, a, b, c, &nearest);
  const double farther = context.farther->of(triangle);
  const double d = there + farther;
  if (farther > 0 && there > 0) nearest += farther / there * (nearest - context.p);
  if (d < context.best.distance_mm ||
      (d == context.best.distance_mm && (context.best.triangle < 0 || triangle < context.best.triangle)))
    context.best = {d, nearest, triangle};
}

bool closest_callback(RTCPointQueryFunctionArguments* args) {
  auto& context = *static_cast<ClosestContext*>(args->userPtr);
  const double before = context.best.distance_mm;
  consider(context, static_cast<int>(args->primID));
  if (context.best.distance_mm >= before) return false;
  args->query->radius = search_radius(context.best.distance_mm, context.slack_mm);
  return true;
}

struct Device {
  RTCDevice handle = nullptr;
  Device() {
    // oneTBB hands the floating-point mode that it is first used in on to all loops that this thread starts, and Embree uses it in
    // one that takes denormal numbers for 0: it must not be the first.
    tbb::parallel_for(0, 2, [](int) {});
    handle = rtcNewDevice(nullptr);
    if (handle) return;
    const RTCError error = rtcGetDeviceError(nullptr);  // which forgets it
    if (error == RTC_ERROR_OUT_OF_MEMORY) throw std::bad_alloc();
    throw Error(ErrorCode::internal, "Embree could not be started (error " + std::to_string(error) + ").");
  }
  ~Device() { rtcReleaseDevice(handle); }
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  void check() const {
    const RTCError error = rtcGetDeviceError(handle);
    if (error == RTC_ERROR_OUT_OF_MEMORY) throw std::bad_alloc();
    if (error != RTC_ERROR_NONE) throw Error(ErrorCode::internal, "Embree reported error " + std::to_string(error) + ".");
  }
};

}  // namespace

struct SurfaceQuery::Impl {
  Mesh mesh;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< Embree works in float32 about this point
  double diagonal_mm = 0;
  Farther farther;
  Device device;
  RTCScene scene = nullptr;

  Impl(const Mesh& m, const Farther& f) : mesh(m), farther(f) {
    const Eigen::AlignedBox3d box = bounding_box(mesh);
    if (!box.isEmpty()) {
      centre = box.center();
      diagonal_mm = box.diagonal().norm();
    }
    // Boxes and not triangles: Embree's float32 tests of triangles disagree with ours beside edges, a box with room for rounding
    // is never missed.
    RTCGeometry geometry = rtcNewGeometry(device.handle, RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(mesh.triangles.size()));
    rtcSetGeometryUserData(geometry, this);
    rtcSetGeometryBoundsFunction(geometry, bounds_of, nullptr);
    rtcSetGeometryOccludedFunction(geometry, meet);
    rtcCommitGeometry(geometry);
    scene = rtcNewScene(device.handle);
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_MEDIUM);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene);
    device.check();
  }
  ~Impl() { rtcReleaseScene(scene); }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  static void bounds_of(const RTCBoundsFunctionArguments* args) {
    const auto& self = *static_cast<const Impl*>(args->geometryUserPtr);
    Eigen::AlignedBox3d box;
    for (int k = 0; k < 3; ++k) box.extend(self.mesh.corner(args->primID, k) - self.centre);
    const double rounding_mm = 4 * std::numeric_limits<float>::epsilon() * self.diagonal_mm;
    const Eigen::Vector3f lower = (box.min().array() - rounding_mm).cast<float>();
    const Eigen::Vector3f upper = (box.max().array() + rounding_mm).cast<float>();
    *args->bounds_o = {lower.x(), lower.y(), lower.z(), 0, upper.x(), upper.y(), upper.z(), 0};
  }

  /// Notes where the line meets a triangle, and lets it go on.
  static void meet(const RTCOccludedFunctionNArguments* args) {
    assert(args->N == 1);
    const auto& self = *static_cast<const Impl*>(args->geometryUserPtr);
    const auto& context = *reinterpret_cast<const LineContext*>(args->context);
    add_line_hit(self.mesh, static_cast<int>(args->primID), context.xy, *context.hits);
  }

  /// Calls back for the triangles that a ball about p may reach.
  void query(const Eigen::Vector3d& p, float radius, RTCPointQueryFunction callback, void* user) const {
    const Eigen::Vector3d local = p - centre;
    RTCPointQuery ball;
    ball.x = static_cast<float>(local.x());
    ball.y = static_cast<float>(local.y());
    ball.z = static_cast<float>(local.z());
    ball.time = 0;
    ball.radius = radius;
    RTCPointQueryContext stack;
    rtcInitPointQueryContext(&stack);
    rtcPointQuery(scene, &ball, &stack, callback, user);
  }
};

SurfaceQuery::SurfaceQuery(const Mesh& mesh) : SurfaceQuery(mesh, Farther{}) {}
SurfaceQuery::SurfaceQuery(const Mesh& mesh, const Farther& farther) : impl_(std::make_unique<Impl>(mesh, farther)) {
  assert(farther.by_mm >= 0);
}
SurfaceQuery::~SurfaceQuery() = default;
SurfaceQuery::SurfaceQuery(SurfaceQuery&&) noexcept = default;
SurfaceQuery& SurfaceQuery::operator=(SurfaceQuery&&) noexcept = default;

const Mesh& SurfaceQuery::mesh() const { return impl_->mesh; }
const SurfaceQuery::Farther& SurfaceQuery::farther() const { return impl_->farther; }

ClosestPoint SurfaceQuery::closest(const Eigen::Vector3d& p, double radius_mm, int hint) const {
  ClosestContext context{&impl_->mesh, &impl_->farther, p, {}, 1e-6 * impl_->diagonal_mm};
  context.best.distance_mm = radius_mm;
  if (hint >= 0) consider(context, hint);
  impl_->query(p, search_radius(context.best.distance_mm, context.slack_mm), closest_callback, &context);
  if (context.best.triangle < 0) context.best.distance_mm = std::numeric_limits<double>::infinity();
  return context.best;
}

void SurfaceQuery::triangles_near(const Eigen::Vector3d& p, double radius_mm, std::vector<int>& found) const {
  found.clear();
  impl_->query(
      p, search_radius(radius_mm, 1e-6 * impl_->diagonal_mm),
      [](RTCPointQueryFunctionArguments* args) {
        static_cast<std::vector<int>*>(args->userPtr)->push_back(static_cast<int>(args->primID));
        return false;
      },
      &found);
}

void SurfaceQuery::line_hits(const Eigen::Vector2d& xy, std::vector<LineHit>& hits) const {
  hits.clear();
  LineContext context;
  rtcInitIntersectContext(&context.base);
  context.xy = xy;
  context.hits = &hits;
  RTCRay ray;
  ray.org_x = static_cast<float>(xy.x() - impl_->centre.x());
  ray.org_y = static_cast<float>(xy.y() - impl_->centre.y());
  ray.org_z = static_cast<float>(-impl_->diagonal_mm);
  ray.dir_x = 0;
  ray.dir_y = 0;
  ray.dir_z = 1;
  ray.tnear = 0;
  ray.tfar = std::numeric_limits<float>::infinity();
  ray.time = 0;
  ray.mask = ~0u;
  ray.id = 0;
  ray.flags = 0;
  rtcOccluded1(impl_->scene, &context.base, &ray);
  sort_hits(hits);
}

void line_hits_brute_force(const Mesh& mesh, const Eigen::Vector2d& xy, std::vector<LineHit>& hits) {
  hits.clear();
  for (std::size_t n = 0; n < mesh.triangles.size(); ++n) {
    const Eigen::Vector3i& t = mesh.triangles[n];
    const Eigen::Vector3d& a = mesh.vertices[t[0]];
    const Eigen::Vector3d& b = mesh.vertices[t[1]];
    const Eigen::Vector3d& c = mesh.vertices[t[2]];
    const bool beside =
        (a.x() < xy.x() && b.x() < xy.x() && c.x() < xy.x()) || (a.x() > xy.x() && b.x() > xy.x() && c.x() > xy.x()) ||
        (a.y() < xy.y() && b.y() < xy.y() && c.y() < xy.y()) || (a.y() > xy.y() && b.y() > xy.y() && c.y() > xy.y());
    if (!beside) add_line_hit(mesh, static_cast<int>(n), xy, hits);
  }
  sort_hits(hits);
}

bool line_closes(const std::vector<LineHit>& hits) { return winding_below(hits, std::numeric_limits<double>::infinity()) == 0; }

int winding_below(const std::vector<LineHit>& hits, double z_mm) {
  int winding = 0;
  for (const LineHit& hit : hits)
    if (hit.z_mm < z_mm) winding += hit.sign;
  return winding;
}

bool closed_line_hits(const SurfaceQuery& surface, const Eigen::Vector2d& xy, std::vector<LineHit>& hits) {
  surface.line_hits(xy, hits);
  return line_closes(hits);
}

int winding_at(const SurfaceQuery& surface, const Eigen::Vector3d& p) {
  thread_local std::vector<LineHit> hits;
  surface.line_hits(p.head<2>(), hits);
  return winding_below(hits, p.z());
}

bool is_inside(const SurfaceQuery& surface, const Eigen::Vector3d& p) { return winding_at(surface, p) > 0; }

double point_triangle_distance(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                               const Eigen::Vector3d& c, Eigen::Vector3d* nearest) {
  // By the Voronoi regions of the corners, the edges and the face. A triangle without area has only the former.
  const Eigen::Vector3d ab = b - a;
  const Eigen::Vector3d ac = c - a;
  const Eigen::Vector3d ap = p - a;
  const double ab_ap = ab.dot(ap);
  const double ac_ap = ac.dot(ap);
  const Eigen::Vector3d bp = p - b;
  const double ab_bp = ab.dot(bp);
  const double ac_bp = ac.dot(bp);
  const Eigen::Vector3d cp = p - c;
  const double ab_cp = ab.dot(cp);
  const double ac_cp = ac.dot(cp);
  const double on_c = ab_ap * ac_bp - ab_bp * ac_ap;  // barycentric weights of the projection, times twice the area squared
  const double on_b = ab_cp * ac_ap - ab_ap * ac_cp;
  const double on_a = ab_bp * ac_cp - ab_cp * ac_bp;
  Eigen::Vector3d best = a;
  if (on_a + on_b + on_c <= 1e-12 * ab.squaredNorm() * ac.squaredNorm()) {
    // A sliver whose regions rounding has mixed up: the nearest of its sides.
    double best2 = std::numeric_limits<double>::infinity();
    for (const auto& [u, v] : {std::pair{a, b}, {b, c}, {c, a}}) {
      const Eigen::Vector3d uv = v - u;
      const double length2 = uv.squaredNorm();
      const Eigen::Vector3d q = length2 > 0 ? Eigen::Vector3d(u + std::clamp((p - u).dot(uv) / length2, 0.0, 1.0) * uv) : u;
      if (const double d2 = (p - q).squaredNorm(); d2 < best2) {
        best2 = d2;
        best = q;
      }
    }
  } else if (ab_ap <= 0 && ac_ap <= 0) {
    // a
  } else if (ab_bp >= 0 && ac_bp <= ab_bp) {
    best = b;
  } else if (ac_cp >= 0 && ab_cp <= ac_cp) {
    best = c;
  } else if (on_c <= 0 && ab_ap >= 0 && ab_bp <= 0) {
    best = a + ab_ap / (ab_ap - ab_bp) * ab;
  } else if (on_b <= 0 && ac_ap >= 0 && ac_cp <= 0) {
    best = a + ac_ap / (ac_ap - ac_cp) * ac;
  } else if (on_a <= 0 && ac_bp - ab_bp >= 0 && ab_cp - ac_cp >= 0) {
    best = b + (ac_bp - ab_bp) / ((ac_bp - ab_bp) + (ab_cp - ac_cp)) * (c - b);
  } else {
    best = a + (on_b * ab + on_c * ac) / (on_a + on_b + on_c);
  }
  if (nearest) *nearest = best;
  return (p - best).norm();
}

}  // namespace rayrep
