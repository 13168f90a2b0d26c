#include "mesh/surface_distance.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

// Branch and bound. The distance from one triangle of the surface is a convex function, so that over a piece it is largest at a
// corner; the distance from the surface is nowhere larger than that. Pieces for which this does not settle it are cut, best along
// the sides of the triangle that is nearest: then each piece lies over one.

namespace rayrep {
namespace {

using Eigen::Vector3d;

struct Corner {
  Vector3d p;
  ClosestPoint closest;
};

/// A part of a triangle of the mesh.
struct Piece {
  std::array<Corner, 3> corners;
  double upper = 0;  ///< no point of it is farther
  double lower = 0;  ///< one of its points is as far
  int nearest = -1;  ///< the surface's triangle nearest to its middle
};

double longest_side2(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  return std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
}

class Search {
public:
  Search(const SurfaceQuery& surface, double radius_mm, const DistanceTolerance& tolerance)
      : surface_(surface), radius_mm_(radius_mm), tolerance_(tolerance) {}

  /// What is not above this is not of interest.
  double enough(double found_mm) const { return std::max((1 + tolerance_.relative) * found_mm, found_mm + tolerance_.absolute_mm); }

  Corner corner(const Vector3d& p, int hint) const { return {p, surface_.closest(p, radius_mm_, hint)}; }

  /// Bounds by what is near the corners and, where that leaves more than `enough_mm`, the middle.
  void bound(Piece& piece, double enough_mm) const {
    piece.lower = piece.upper = std::numeric_limits<double>::infinity();
    for (const Corner& c : piece.corners) consider(piece, c.closest.triangle);
    piece.lower = std::max(
        {piece.corners[0].closest.distance_mm, piece.corners[1].closest.distance_mm, piece.corners[2].closest.distance_mm});
    if (piece.upper <= enough_mm) return;
    const auto& c = piece.corners;
    const Corner middle = corner((c[0].p + c[1].p + c[2].p) / 3, c[0].closest.triangle);
    piece.nearest = middle.closest.triangle;
    piece.lower = std::max(piece.lower, middle.closest.distance_mm);
    consider(piece, piece.nearest);
    double reach = 0;
    for (const Corner& other : c) reach = std::max(reach, (other.p - middle.p).norm());
    piece.upper = std::max(std::min(piece.upper, middle.closest.distance_mm + reach), piece.lower);
  }

  /// Appends the two or three parts of a piece.
  void cut(const Piece& piece, std::vector<Piece>& parts) const {
    std::array<double, 3> height;  // of the corners, over the plane along which it is cut
    if (!heights_over_side(piece, height)) heights_over_middle(piece, height);
    std::size_t alone = 0;  // the corner that the plane cuts off, or through which it goes
    for (std::size_t k = 0; k < 3; ++k) {
      const double product = height[(k + 1) % 3] * height[(k + 2) % 3];
      if (height[k] == 0 ? product < 0 : product > 0) alone = k;
    }
    const Corner& a = piece.corners[alone];
    const Corner& b = piece.corners[(alone + 1) % 3];
    const Corner& c = piece.corners[(alone + 2) % 3];
    const auto between = [&](const Corner& u, const Corner& v, double hu, double hv) {
      return corner(u.p + hu / (hu - hv) * (v.p - u.p), u.closest.triangle);
    };
    const double ha = height[alone], hb = height[(alone + 1) % 3], hc = height[(alone + 2) % 3];
    if (ha == 0) {
      const Corner bc = between(b, c, hb, hc);
      parts.push_back({{a, b, bc}});
      parts.push_back({{a, bc, c}});
      return;
    }
    const Corner ab = between(a, b, ha, hb);
    const Corner ac = between(a, c, ha, hc);
    parts.push_back({{a, ab, ac}});
    parts.push_back({{ab, b, c}});
    parts.push_back({{ab, c, ac}});
  }

private:
  /// The bound by one triangle of the surface.
  void consider(Piece& piece, int triangle) const {
    const Mesh& mesh = surface_.mesh();
    const auto t = static_cast<std::size_t>(triangle);
    double largest = 0;
    for (const Corner& c : piece.corners)
      largest = std::max(largest, point_triangle_distance(c.p, mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2)));
    piece.upper = std::min(piece.upper, largest);
  }

  /// Heights over the plane upright on the nearest triangle along one of its sides, the one that cuts deepest; those too small to
  /// matter are 0. False where none cuts, or the piece is so much larger than the triangle that halving leads on faster.
  bool heights_over_side(const Piece& piece, std::array<double, 3>& height) const {
    const Mesh& mesh = surface_.mesh();
    const auto t = static_cast<std::size_t>(piece.nearest);
    const std::array<Vector3d, 3> s{mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2)};
    const double size2 = longest_side2(piece.corners[0].p, piece.corners[1].p, piece.corners[2].p);
    if (size2 > 9 * longest_side2(s[0], s[1], s[2])) return false;
    const double clear = std::max(0.25 * tolerance_.absolute_mm, 1e-12 * std::sqrt(size2));
    const Vector3d normal = (s[1] - s[0]).cross(s[2] - s[0]);
    double deepest = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector3d outward = (s[(k + 1) % 3] - s[k]).cross(normal).normalized();
      std::array<double, 3> h;
      for (std::size_t i = 0; i < 3; ++i) {
        h[i] = outward.dot(piece.corners[i].p - s[k]);
        if (!(std::abs(h[i]) > clear)) h[i] = 0;
      }
      const double depth = std::min(*std::max_element(h.begin(), h.end()), -*std::min_element(h.begin(), h.end()));
      if (depth <= deepest) continue;
      deepest = depth;
      height = h;
    }
    return deepest > 0;
  }

  /// Heights that lead to the middle of the longest side.
  static void heights_over_middle(const Piece& piece, std::array<double, 3>& height) {
    std::size_t from = 0;
    double longest = -1;
    for (std::size_t k = 0; k < 3; ++k)
      if (const double side = (piece.corners[(k + 1) % 3].p - piece.corners[k].p).squaredNorm(); side > longest) {
        longest = side;
        from = k;
      }
    height[from] = 1;
    height[(from + 1) % 3] = -1;
    height[(from + 2) % 3] = 0;
  }

  const SurfaceQuery& surface_;
  double radius_mm_;
  DistanceTolerance tolerance_;
};

/// The mesh's triangles as pieces, not yet bounded.
std::vector<Piece> whole_triangles(const Mesh& mesh, const Search& search) {
  std::vector<Corner> corners(mesh.vertices.size());
  tbb::parallel_for(std::size_t{0}, corners.size(), [&](std::size_t v) { corners[v] = search.corner(mesh.vertices[v], -1); });
  std::vector<Piece> pieces(mesh.triangles.size());
  for (std::size_t t = 0; t < pieces.size(); ++t)
    for (int k = 0; k < 3; ++k)
      pieces[t].corners[static_cast<std::size_t>(k)] = corners[static_cast<std::size_t>(mesh.triangles[t][k])];
  return pieces;
}

}  // namespace

double largest_distance(const Mesh& mesh, const SurfaceQuery& surface, double known_mm, const DistanceTolerance& tolerance,
                        const Progress& progress) {
  if (mesh.triangles.empty()) return known_mm;
  if (surface.mesh().triangles.empty()) return std::numeric_limits<double>::infinity();
  Eigen::AlignedBox3d box = bounding_box(mesh);
  box.extend(bounding_box(surface.mesh()));
  const Search search(surface, 1.01 * box.diagonal().norm(), tolerance);

  double found = known_mm;
  std::vector<Piece> pieces = whole_triangles(mesh, search);
  for (const Piece& piece : pieces)
    for (const Corner& c : piece.corners) found = std::max(found, c.closest.distance_mm);
  const std::size_t most = (std::size_t{1} << 20) + 8 * pieces.size();
  std::size_t count = 0;
  while (true) {
    progress.check();
    const double enough = search.enough(found);
    tbb::parallel_for(std::size_t{0}, pieces.size(), [&](std::size_t n) { search.bound(pieces[n], enough); });
    for (const Piece& piece : pieces) found = std::max(found, piece.lower);
    std::erase_if(pieces, [&](const Piece& piece) { return piece.upper <= search.enough(found); });
    if (pieces.empty()) return found;
    count += pieces.size();
    if (count > most) break;
    std::vector<std::vector<Piece>> parts(pieces.size());
    tbb::parallel_for(std::size_t{0}, pieces.size(), [&](std::size_t n) { search.cut(pieces[n], parts[n]); });
    pieces.clear();
    for (const auto& some : parts) pieces.insert(pieces.end(), some.begin(), some.end());
  }
  for (const Piece& piece : pieces) found = std::max(found, piece.upper);
  return found;
}

}  // namespace rayrep
