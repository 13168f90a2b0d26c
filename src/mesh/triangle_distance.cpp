#include "mesh/triangle_distance.h"

#include <algorithm>

#include "mesh/predicates.h"
#include "rayrep/mesh/surface_query.h"

namespace rayrep {
namespace {

using Eigen::Vector3d;

NearestPair segment_distance(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
  const Vector3d u = b - a;
  const Vector3d v = d - c;
  const Vector3d w = a - c;
  const double uu = u.squaredNorm(), uv = u.dot(v), vv = v.squaredNorm(), uw = u.dot(w), vw = v.dot(w);
  const double determinant = uu * vv - uv * uv;
  // Along parallel lines any place will do to begin with; each is then the best for the other.
  double s = determinant > 1e-14 * uu * vv ? std::clamp((uv * vw - vv * uw) / determinant, 0.0, 1.0) : 0;
  const double t = vv > 0 ? std::clamp((uv * s + vw) / vv, 0.0, 1.0) : 0;
  s = uu > 0 ? std::clamp((uv * t - uw) / uu, 0.0, 1.0) : 0;
  const Vector3d p = a + s * u;
  const Vector3d q = c + t * v;
  return {(p - q).norm(), p, q};
}

/// Whether the segment passes through the triangle, from one side of its plane to the other.
bool passes_through(const Vector3d& a, int side_of_a, const Vector3d& b, int side_of_b, const Corners3& t) {
  if (side_of_a * side_of_b >= 0) return false;
  int low = 0, high = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const int side = orient3d(a, b, t[k], t[(k + 1) % 3]);
    low = std::min(low, side);
    high = std::max(high, side);
  }
  return low == 0 || high == 0;
}

/// Makes `best` the crossing of the sides of `p` with the face of `q`, if there is one.
bool cross(const Corners3& p, const Corners3& q, NearestPair& best) {
  std::array<int, 3> side;
  for (std::size_t k = 0; k < 3; ++k) side[k] = orient3d(q[0], q[1], q[2], p[k]);
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t l = (k + 1) % 3;
    if (!passes_through(p[k], side[k], p[l], side[l], q)) continue;
    const Vector3d normal = (q[1] - q[0]).cross(q[2] - q[0]);
    const double from = normal.dot(p[k] - q[0]);
    const double to = normal.dot(p[l] - q[0]);
    const double share = from != to ? std::clamp(from / (from - to), 0.0, 1.0) : 0;
    best.on_first = best.on_second = p[k] + share * (p[l] - p[k]);
    best.distance_mm = 0;
    return true;
  }
  return false;
}

}  // namespace

NearestPair triangle_distance(const Corners3& p, const Corners3& q) {
  NearestPair best;
  if (cross(p, q, best) || cross(q, p, best)) return best;
  const auto consider = [&best](const NearestPair& pair) {
    if (pair.distance_mm < best.distance_mm) best = pair;
  };
  for (std::size_t k = 0; k < 3; ++k) {
    Vector3d nearest;
    const double to_q = point_triangle_distance(p[k], q[0], q[1], q[2], &nearest);
    consider({to_q, p[k], nearest});
    const double to_p = point_triangle_distance(q[k], p[0], p[1], p[2], &nearest);
    consider({to_p, nearest, q[k]});
    for (std::size_t l = 0; l < 3; ++l) consider(segment_distance(p[k], p[(k + 1) % 3], q[l], q[(l + 1) % 3]));
  }
  return best;
}

}  // namespace rayrep
