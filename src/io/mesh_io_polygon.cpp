#include <cassert>
#include <cmath>

#include "io/mesh_io_detail.h"

namespace rayrep::detail {
namespace {

// Clipping ears takes time in the square of the corners: this many take seconds.
constexpr std::size_t kMaxCornersOfFace = 50000;

/// A polygon seen along its Newell normal, counter-clockwise. A coordinate is dropped rather than the polygon turned,
/// so that the coordinates stay exact.
struct Projection {
  std::vector<Eigen::Vector2d> points;
  bool has_area = false;
};

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

Projection project(std::span<const int> polygon, const Mesh& mesh) {
  const Eigen::Vector3d& origin = mesh.vertices[polygon[0]];
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  for (std::size_t i = 1; i + 1 < polygon.size(); ++i)
    normal += (mesh.vertices[polygon[i]] - origin).cross(mesh.vertices[polygon[i + 1]] - origin);
  int axis = 0;
  const double largest = normal.cwiseAbs().maxCoeff(&axis);
  Projection result;
  result.has_area = std::isfinite(largest) && largest > 0;
  int u = (axis + 1) % 3;
  int v = (axis + 2) % 3;
  if (normal[axis] < 0) std::swap(u, v);
  result.points.reserve(polygon.size());
  for (const int i : polygon) result.points.emplace_back(mesh.vertices[i][u], mesh.vertices[i][v]);
  return result;
}

bool is_strictly_convex(const std::vector<Eigen::Vector2d>& p) {
  for (std::size_t i = 0, n = p.size(); i < n; ++i)
    if (!(cross(p[i], p[(i + 1) % n], p[(i + 2) % n]) > 0)) return false;
  return true;
}

/// Cuts ears off one polygon; the corners that remain form a ring of indices.
class EarClipper {
public:
  explicit EarClipper(const std::vector<Eigen::Vector2d>& points) : p_(points), before_(p_.size()), after_(p_.size()) {
    for (std::size_t i = 0, n = p_.size(); i < n; ++i) {
      before_[i] = (i + n - 1) % n;
      after_[i] = (i + 1) % n;
    }
    ear_.resize(p_.size());
    find_ears(0, p_.size());
  }

  /// Calls emit(a, b, c) for each of the n - 2 triangles.
  template <class Emit>
  void clip_all(const Emit& emit) {
    std::size_t at = 0;
    int searches = 8;
    for (std::size_t left = p_.size(); left > 3; --left) {
      at = next_ear(at, left);
      // Cutting an ear changes its two neighbours only, unless corners lie on the edges of others: then look again, but
      // not for ever. Without an ear the polygon crosses itself or has no area, and any corner will do.
      if (!ear_[at] && searches > 0) {
        --searches;
        find_ears(at, left);
        at = next_ear(at, left);
      }
      const std::size_t a = before_[at];
      const std::size_t c = after_[at];
      emit(a, at, c);
      after_[a] = c;
      before_[c] = a;
      ear_[a] = is_ear(a);
      ear_[c] = is_ear(c);
      at = after_[c];  // not c: alternating corners makes fewer slivers
    }
    emit(before_[at], at, after_[at]);
  }

private:
  void find_ears(std::size_t at, std::size_t left) {
    for (; left > 0; --left, at = after_[at]) ear_[at] = is_ear(at);
  }

  std::size_t next_ear(std::size_t at, std::size_t left) const {
    while (!ear_[at] && left-- > 0) at = after_[at];
    return at;
  }

  bool is_ear(std::size_t i) const {
    const auto& a = p_[before_[i]];
    const auto& b = p_[i];
    const auto& c = p_[after_[i]];
    if (!(cross(a, b, c) > 0)) return false;
    for (std::size_t j = after_[after_[i]]; j != before_[i]; j = after_[j]) {
      const auto& q = p_[j];
      // Corners repeat where a hole is joined to the outline by a double edge; such a twin blocks nothing.
      if (q == a || q == b || q == c) continue;
      if (cross(a, b, q) >= 0 && cross(b, c, q) >= 0 && cross(c, a, q) >= 0) return false;
    }
    return true;
  }

  const std::vector<Eigen::Vector2d>& p_;
  std::vector<std::size_t> before_;
  std::vector<std::size_t> after_;
  std::vector<bool> ear_;
};

}  // namespace

void PolygonSoup::end_polygon() {
  const std::size_t begin = ends.empty() ? 0 : ends.back();
  if (corners.size() - begin >= 3) {
    ends.push_back(corners.size());
  } else {
    corners.resize(begin);
    ++dropped;
  }
}

void append_triangulated(std::span<const int> polygon, Mesh& mesh) {
  assert(polygon.size() >= 3);
  const auto emit = [&](std::size_t a, std::size_t b, std::size_t c) {
    mesh.triangles.emplace_back(polygon[a], polygon[b], polygon[c]);
  };
  if (polygon.size() == 3) return emit(0, 1, 2);
  const Projection seen = project(polygon, mesh);
  if (!seen.has_area || is_strictly_convex(seen.points)) {
    for (std::size_t i = 1; i + 1 < polygon.size(); ++i) emit(0, i, i + 1);
  } else {
    EarClipper(seen.points).clip_all(emit);
  }
}

MeshFile triangulated(const FileBytes& file, PolygonSoup&& soup, std::string format) {
  MeshFile result;
  result.format = std::move(format);
  result.polygons = soup.ends.size();
  result.mesh.vertices = std::move(soup.vertices);
  result.mesh.triangles.reserve(soup.corners.size() - 2 * soup.ends.size());
  std::size_t begin = 0;
  for (std::size_t i = 0; i < soup.ends.size(); begin = soup.ends[i++]) {
    const auto polygon = std::span<const int>(soup.corners).subspan(begin, soup.ends[i] - begin);
    if (polygon.size() > kMaxCornersOfFace)
      fail_read(file, concat("face ", i + 1),
                concat("a single face has ", polygon.size(), " corners; at most ", kMaxCornersOfFace,
                       " are supported. Triangulate the mesh in the program that made it."));
    append_triangulated(polygon, result.mesh);
  }
  if (soup.dropped > 0)
    result.notes.push_back(plural(soup.dropped, "face of fewer than three corners was", "faces of fewer than three corners were") +
                           " ignored.");
  return result;
}

}  // namespace rayrep::detail
