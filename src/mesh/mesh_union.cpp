#include "mesh/mesh_union.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>

#include "base/text.h"
#include "base/union_find.h"
#include "mesh/close_pairs.h"
#include "mesh/mesh_edges.h"
#include "mesh/predicates.h"
#include "rayrep/base/error.h"
#include "rayrep/mesh/mesh_check.h"
#include "rayrep/mesh/surface_query.h"

// The boundary of {winding > 0} in three steps. Triangles that meet no other one beyond shared corners and edges are classified by
// one ray for each connected patch of them, since the winding number beside such a patch is constant. Every other triangle is split
// along its intersections with the others into convex pieces, each classified by a ray of its own. A piece is kept when exactly one
// side of it has a positive winding number; of pieces that lie on each other one is kept.
//
// Splitting works in double: a cut that is off by rounding moves area of that size from one piece to its neighbour, which changes
// nothing but last digits as long as sheets that lie on each other are recognised, see kTouching.

namespace rayrep {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3i;

/// Sheets nearer than this times the mesh's diagonal lie on each other: far above the rounding of a rotation, far below float32.
constexpr double kTouching = 1e-12;

/// Largest sine of the angle between sheets that may lie on each other. At larger angles the strip in which they are within the
/// tolerance is too narrow to matter.
constexpr double kParallel = 1e-5;

/// Up to so many rays the time goes into building a tree rather than into looking at every triangle.
constexpr std::size_t kFewRays = 32;

struct Segment {
  Vector2d a, b;
};

using Polygon = std::vector<Vector2d>;  // convex, counter-clockwise

double cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

/// A triangle's plane, with coordinates in which corner 0 is the origin, corner 1 is (x1, 0) and corner 2 is (x2, y2), y2 > 0.
struct Frame {
  Vector3d origin, x, y, normal;
  double x1 = 0, x2 = 0, y2 = 0;

  double distance(const Vector3d& p) const { return normal.dot(p - origin); }
  Vector2d local(const Vector3d& p) const { return {x.dot(p - origin), y.dot(p - origin)}; }
  Vector3d global(const Vector2d& p) const { return origin + p.x() * x + p.y() * y; }
  Polygon triangle() const { return {Vector2d(0, 0), Vector2d(x1, 0), Vector2d(x2, y2)}; }
};

Frame frame_of(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  Frame f;
  f.origin = a;
  f.x1 = (b - a).norm();
  f.x = f.x1 > 0 ? Vector3d((b - a) / f.x1) : Vector3d::UnitX();
  f.x2 = f.x.dot(c - a);
  const Vector3d rise = (c - a) - f.x2 * f.x;
  f.y2 = rise.norm();
  f.y = f.y2 > 0 ? Vector3d(rise / f.y2) : f.x.unitOrthogonal();
  f.normal = f.x.cross(f.y);
  return f;
}

/// True when the interiors overlap by more than `tolerance` (separating axes).
bool overlap(const Polygon& p, const Polygon& q, double tolerance) {
  const auto separated = [tolerance](const Polygon& a, const Polygon& b) {
    for (std::size_t i = 0; i < a.size(); ++i) {
      const Vector2d edge = a[(i + 1) % a.size()] - a[i];
      const double length = edge.norm();
      double deepest = -std::numeric_limits<double>::infinity();
      for (const Vector2d& v : b) deepest = std::max(deepest, cross(edge, v - a[i]) / length);
      if (deepest <= tolerance) return true;
    }
    return false;
  };
  return !separated(p, q) && !separated(q, p);
}

/// Nearly parallel triangles are taken to lie on each other where they are within the tolerance; others merely cross.
bool parallel(const Frame& s, const Frame& t) { return s.normal.cross(t.normal).norm() < kParallel; }

Polygon counter_clockwise(Polygon p) {
  if (cross(p[1] - p[0], p[2] - p[0]) < 0) std::swap(p[1], p[2]);
  return p;
}

/// Length of the part of a segment inside a convex polygon; 0 when it only runs along the rim.
double length_inside(const Segment& s, const Polygon& polygon, double tolerance) {
  const Vector2d d = s.b - s.a;
  double begin = 0, end = 1;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d& p = polygon[i];
    const Vector2d edge = polygon[(i + 1) % polygon.size()] - p;
    const double at_a = cross(edge, s.a - p);
    const double slope = cross(edge, d);
    if (slope > 0)
      begin = std::max(begin, -at_a / slope);
    else if (slope < 0)
      end = std::min(end, -at_a / slope);
    else if (at_a <= 0)
      return 0;
    if (begin >= end) return 0;
  }
  const double length = (end - begin) * d.norm();
  if (length <= tolerance) return 0;
  const Vector2d middle = s.a + (begin + end) / 2 * d;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d edge = polygon[(i + 1) % polygon.size()] - polygon[i];
    if (cross(edge, middle - polygon[i]) <= tolerance * edge.norm()) return 0;
  }
  return length;
}

/// Splits along the line of a segment: `left` of it and the rest.
void split(const Polygon& polygon, const Segment& s, double tolerance, Polygon& left, Polygon& right) {
  left.clear();
  right.clear();
  const Vector2d d = (s.b - s.a).normalized();
  const auto side = [&](const Vector2d& p) {  // no new corner right beside an old one: its edge would have no direction
    const double distance = cross(d, p - s.a);
    return std::abs(distance) <= tolerance ? 0 : distance;
  };
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d& p = polygon[i];
    const Vector2d& q = polygon[(i + 1) % polygon.size()];
    const double side_p = side(p);
    const double side_q = side(q);
    if (side_p >= 0) left.push_back(p);
    if (side_p <= 0) right.push_back(p);
    if (side_p * side_q < 0) {
      const Vector2d crossing = p + side_p / (side_p - side_q) * (q - p);
      left.push_back(crossing);
      right.push_back(crossing);
    }
  }
}

/// Cuts a polygon until no segment runs through the inside of a piece; visit(piece) for each.
template <typename Visit>
void for_each_piece(const Polygon& whole, const std::vector<Segment>& segments, double tolerance, const Visit& visit) {
  struct Open {
    Polygon polygon;
    std::vector<Segment> segments;
  };
  std::vector<Open> stack{{whole, segments}};
  while (!stack.empty()) {
    Open open = std::move(stack.back());
    stack.pop_back();
    std::vector<Segment> inside;
    double longest = 0;
    std::size_t cut = 0;
    for (const Segment& s : open.segments) {
      const double length = length_inside(s, open.polygon, tolerance);
      if (length == 0) continue;
      if (length > longest) {
        longest = length;
        cut = inside.size();
      }
      inside.push_back(s);
    }
    if (inside.empty()) {
      visit(open.polygon);
      continue;
    }
    const Segment line = inside[cut];
    inside.erase(inside.begin() + static_cast<std::ptrdiff_t>(cut));
    Open left, right;
    split(open.polygon, line, tolerance, left.polygon, right.polygon);
    left.segments = inside;
    right.segments = std::move(inside);
    if (right.polygon.size() >= 3) stack.push_back(std::move(right));
    if (left.polygon.size() >= 3) stack.push_back(std::move(left));
  }
}

/// Points well inside a convex polygon, the centroid first.
std::array<Vector2d, 4> sample_points(const Polygon& polygon) {
  Vector2d weighted = Vector2d::Zero();
  Vector2d mean = Vector2d::Zero();
  double area = 0;
  for (std::size_t i = 1; i + 1 < polygon.size(); ++i) {
    const double a = cross(polygon[i] - polygon[0], polygon[i + 1] - polygon[0]);
    weighted += a * (polygon[0] + polygon[i] + polygon[i + 1]) / 3;
    area += a;
  }
  for (const Vector2d& p : polygon) mean += p / static_cast<double>(polygon.size());
  const Vector2d centre = area > 0 ? Vector2d(weighted / area) : mean;
  return {centre, 0.71 * centre + 0.29 * polygon[0], 0.63 * centre + 0.37 * polygon[1], 0.57 * centre + 0.43 * polygon[2]};
}

/// Works on a copy turned into a general position, so that triangles and the vertical rays are not parallel; results refer to the
/// mesh as it was given.
class UnionBoundary {
public:
  UnionBoundary(const Mesh& mesh, const TrianglePairs& close, const Progress& progress)
      : mesh_(mesh), close_(close), progress_(progress), turned_(in_general_position(mesh)), cutters_(mesh.triangles.size()) {
    tolerance_mm_ = kTouching * bounding_box(turned_).diagonal().norm();
    needle_.resize(mesh.triangles.size());
    seen_area_.resize(mesh.triangles.size());
    tbb::parallel_for(std::size_t{0}, mesh.triangles.size(), [this](std::size_t t) {
      const Vector3d ab = turned_.corner(t, 1) - turned_.corner(t, 0);
      const Vector3d ac = turned_.corner(t, 2) - turned_.corner(t, 0);
      const Vector3d area2 = ab.cross(ac);
      const double longest2 = std::max({ab.squaredNorm(), ac.squaredNorm(), (ac - ab).squaredNorm()});
      needle_[t] = area2.squaredNorm() <= tolerance_mm_ * tolerance_mm_ * longest2;  // the smallest height is below the tolerance
      seen_area_[t] = std::abs(area2.z());
    });
  }

  Mesh run() {
    find_cutters();
    classify_patches();
    cut_triangles();
    return assemble();
  }

private:
  static Mesh in_general_position(const Mesh& mesh) {
    const Eigen::AlignedBox3d box = bounding_box(mesh);
    const Vector3d centre = box.isEmpty() ? Vector3d::Zero() : Vector3d(box.center());
    const Eigen::Quaterniond R = Eigen::Quaterniond(0.81472, 0.36324, 0.21698, 0.39754).normalized();  // nothing special about it
    return transformed(mesh, R * Eigen::Translation3d(-centre));
  }

  int size() const { return static_cast<int>(mesh_.triangles.size()); }

  /// Of a triangle, in general position. That of a needle means nothing.
  Frame frame(int t) const {
    const Vector3i& v = mesh_.triangles[t];
    return frame_of(turned_.vertices[v[0]], turned_.vertices[v[1]], turned_.vertices[v[2]]);
  }

  /// Distances of the corners of s from the plane of t, 0 where they are shared.
  Vector3d distances(int s, int t, const Frame& frame_t) const {
    Vector3d d;
    for (int k = 0; k < 3; ++k) {
      const int v = mesh_.triangles[s][k];
      d[k] = (mesh_.triangles[t].array() == v).any() ? 0 : frame_t.distance(turned_.vertices[v]);
    }
    return d;
  }

  bool within_tolerance(const Vector3d& d) const { return d.cwiseAbs().maxCoeff() <= tolerance_mm_; }

  Polygon projected(int s, const Frame& frame) const {
    Polygon p;
    for (int k = 0; k < 3; ++k) p.push_back(frame.local(turned_.corner(static_cast<std::size_t>(s), k)));
    return p;
  }

  /// True when s and t meet beyond what they share, so that each may have to be cut by the other.
  bool cut_each_other(int s, int t) const {
    if (needle_[s] || needle_[t]) return false;
    const Frame frame_s = frame(s);
    const Frame frame_t = frame(t);
    const Vector3d ds = distances(s, t, frame_t);
    const Vector3d dt = distances(t, s, frame_s);
    const auto apart = [this](const Vector3d& d) { return d.minCoeff() > tolerance_mm_ || d.maxCoeff() < -tolerance_mm_; };
    if (apart(ds) || apart(dt)) return false;
    if (parallel(frame_s, frame_t)) return overlap(frame_t.triangle(), counter_clockwise(projected(s, frame_t)), tolerance_mm_);
    const auto corner = [&](int triangle, int k) { return mesh_.corner(static_cast<std::size_t>(triangle), k); };
    const Vector3d p[3] = {corner(s, 0), corner(s, 1), corner(s, 2)};
    const Vector3d q[3] = {corner(t, 0), corner(t, 1), corner(t, 2)};
    return triangles_intersect(p, mesh_.triangles[s], q, mesh_.triangles[t]);
  }

  void find_cutters() {
    std::vector<char> relevant(close_.size());
    in_batches(close_.size(), 1 << 18, 512,
               [&](std::size_t i) { relevant[i] = cut_each_other(close_[i].first, close_[i].second); });
    for (std::size_t i = 0; i < close_.size(); ++i)
      if (relevant[i]) {
        cutters_[close_[i].first].push_back(close_[i].second);
        cutters_[close_[i].second].push_back(close_[i].first);
      }
    refuse_thicket();
  }

  /// A triangle that k others cut falls into as many as k^2 / 2 pieces, as each cut runs on to its edge.
  /// @throws Error{input} where that would take more than some seconds
  void refuse_thicket() const {
    constexpr double most_pieces = 3e7;
    double pieces = 0;
    std::size_t most_cuts = 0;
    for (const auto& cutters : cutters_) {
      pieces += 0.5 * static_cast<double>(cutters.size()) * static_cast<double>(cutters.size());
      most_cuts = std::max(most_cuts, cutters.size());
    }
    if (pieces > most_pieces)
      throw Error(ErrorCode::input,
                  concat("Too many parts of the surface run through each other: single triangles are cut by up to ", most_cuts,
                         " others, which would make some ", shown(pieces, 1),
                         " pieces. Unite the parts in your modelling program, or leave some of them out."));
  }

  /// Calls body(i) for 0 <= i < count in parallel, with a look at the progress after every `batch`.
  template <typename Body>
  void in_batches(std::size_t count, std::size_t batch, std::size_t grain, const Body& body) const {
    for (std::size_t begin = 0; begin < count; begin += batch) {
      progress_.check();
      tbb::parallel_for(tbb::blocked_range<std::size_t>(begin, std::min(begin + batch, count), grain),
                        [&body](const tbb::blocked_range<std::size_t>& range) {
                          for (std::size_t i = range.begin(); i < range.end(); ++i) body(i);
                        });
    }
  }

  /// The crossings of a vertical line with the turned mesh; true if they close.
  template <typename Closes>
  bool line_hits(const Vector2d& xy, std::vector<LineHit>& hits, const Closes& closes) const {
    if (surface_) return closed_line_hits(*surface_, xy, hits, closes) != LineAnswer::open;
    line_hits_brute_force(turned_, xy, hits);
    return closes(hits);
  }

  /// True when the piece of triangle t around one of the points `samples` (in its frame) belongs to the boundary.
  template <std::size_t N>
  bool on_boundary(int t, const Frame& frame_t, const std::array<Vector2d, N>& samples) const {
    std::vector<LineHit> hits;
    const int sign = frame_t.normal.z() > 0 ? -1 : 1;  // +1 where a line going up through t enters the material
    bool result = false;
    for (const Vector2d& sample : samples) {
      const Vector3d p = frame_t.global(sample);
      const auto closes = [t, sign](const std::vector<LineHit>&
                                        found) {  // t itself counts, whether or not the line through its inside was found to hit it
        int sum = sign;
        for (const LineHit& hit : found)
          if (hit.triangle != t) sum += hit.sign;
        return sum == 0;
      };
      const bool closed = line_hits(p.head<2>(), hits, closes);
      int below = 0;
      int step = sign;                 // of the winding number, over all sheets that lie on t
      std::array<int, 2> first{t, t};  // of these, the first that enters and the first that leaves
      first[sign > 0 ? 1 : 0] = size();
      for (const LineHit& hit : hits) {
        if (hit.triangle == t) continue;
        const double steepness = needle_[hit.triangle] ? 1 : std::abs(frame(hit.triangle).normal.z());
        if (std::abs(hit.z_mm - p.z()) * steepness <= tolerance_mm_) {
          step += hit.sign;
          int& f = first[hit.sign > 0 ? 0 : 1];
          f = std::min(f, hit.triangle);
        } else if (hit.z_mm < p.z()) {
          below += hit.sign;
        }
      }
      const bool enters = below <= 0 && below + step > 0;
      const bool leaves = below > 0 && below + step <= 0;
      result = (enters && first[0] == t) || (leaves && first[1] == t);
      if (closed) break;
    }
    return result;
  }

  /// Patches of triangles that nothing cuts, joined over edges of exactly two triangles: one ray each.
  void classify_patches() {
    UnionFind joined(size());
    const auto uncut = [this](int t) { return cutters_[t].empty() && !needle_[t]; };
    for_each_edge(mesh_, [&](auto begin, auto end) {
      if (end - begin == 2 && uncut(begin->triangle) && uncut((end - 1)->triangle))
        joined.unite(begin->triangle, (end - 1)->triangle);
    });

    // The ray goes through the triangle that looks largest from above.
    std::vector<int> representative(mesh_.triangles.size(), -1);
    for (int t = 0; t < size(); ++t)
      if (uncut(t)) {
        int& r = representative[joined.root(t)];
        if (r < 0 || seen_area_[t] > seen_area_[r]) r = t;
      }
    std::vector<int> patches;  // by their root
    for (int t = 0; t < size(); ++t)
      if (representative[t] >= 0) patches.push_back(t);
    std::size_t pieces = 0;  // at least
    for (const auto& cutters : cutters_)
      if (!cutters.empty()) pieces += 1 + cutters.size();
    if (patches.size() + pieces > kFewRays) surface_.emplace(turned_);
    std::vector<char> kept(mesh_.triangles.size(), 0);
    in_batches(patches.size(), 1 << 12, 1, [&](std::size_t i) {
      const int t = representative[patches[i]];
      const Frame frame_t = frame(t);
      kept[patches[i]] = on_boundary(t, frame_t, sample_points(frame_t.triangle()));
    });
    whole_.resize(mesh_.triangles.size());
    for (int t = 0; t < size(); ++t) whole_[t] = uncut(t) && kept[joined.root(t)];
  }

  std::vector<Segment> cuts_of(int t, const Frame& frame_t) const {
    std::vector<Segment> segments;
    for (const int s : cutters_[t]) {
      const Frame frame_s = frame(s);
      const Polygon corners = projected(s, frame_t);
      const Vector3d ds = distances(s, t, frame_t);
      if (!parallel(frame_s, frame_t)) {
        add_level(corners, ds, 0, segments);
        continue;
      }
      for (std::size_t k = 0; k < 3; ++k) segments.push_back({corners[k], corners[(k + 1) % 3]});
      const Vector3d dt = distances(t, s, frame_s);
      if (within_tolerance(ds) || within_tolerance(dt)) continue;
      add_level(frame_t.triangle(), dt, tolerance_mm_, segments);
      add_level(frame_t.triangle(), dt, -tolerance_mm_, segments);
    }
    return segments;
  }

  /// Appends the segment of a triangle on which the linear function with values d at its corners equals `level`.
  void add_level(const Polygon& corners, const Vector3d& d, double level, std::vector<Segment>& segments) const {
    Segment segment;
    int ends = 0;
    const auto add = [&](const Vector2d& p) {
      (ends == 0 ? segment.a : segment.b) = p;
      ++ends;
    };
    const double snap = level == 0 ? tolerance_mm_ : 0;  // an edge in the plane is a cut, however it is rounded
    std::array<double, 3> above;
    for (std::size_t k = 0; k < 3; ++k) {
      const double difference = d[static_cast<int>(k)] - level;
      above[k] = std::abs(difference) <= snap ? 0 : difference;
    }
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t l = (k + 1) % 3;
      if (above[k] == 0) add(corners[k]);
      if (above[k] * above[l] < 0) add(corners[k] + above[k] / (above[k] - above[l]) * (corners[l] - corners[k]));
    }
    if (ends == 2) segments.push_back(segment);
  }

  void cut_triangles() {
    std::vector<int> cut;
    for (int t = 0; t < size(); ++t)
      if (!cutters_[t].empty()) cut.push_back(t);
    pieces_.resize(mesh_.triangles.size());
    in_batches(cut.size(), 64, 1, [&](std::size_t i) {
      const int t = cut[i];
      const Frame frame_t = frame(t);
      std::vector<Polygon> kept;
      bool all = true;
      for_each_piece(frame_t.triangle(), cuts_of(t, frame_t), tolerance_mm_, [&](const Polygon& piece) {
        if (on_boundary(t, frame_t, sample_points(piece)))
          kept.push_back(piece);
        else
          all = false;
      });
      if (all)
        whole_[t] = 1;
      else
        pieces_[t] = std::move(kept);
    });
  }

  Mesh assemble() const {
    const auto lost = [this](int t) { return !whole_[t] && !needle_[t]; };
    bool unchanged = true;
    for (int t = 0; t < size() && unchanged; ++t) unchanged = !lost(t);
    if (unchanged) return mesh_;

    Mesh result;
    std::vector<int> number(mesh_.vertices.size(), -1);
    for (int t = 0; t < size(); ++t) {
      const Vector3i& v = mesh_.triangles[t];
      if (whole_[t]) {
        Vector3i triangle;
        for (int k = 0; k < 3; ++k) {
          int& n = number[v[k]];
          if (n < 0) {
            n = static_cast<int>(result.vertices.size());
            result.vertices.push_back(mesh_.vertices[v[k]]);
          }
          triangle[k] = n;
        }
        result.triangles.push_back(triangle);
      }
      if (pieces_[t].empty()) continue;
      const Frame frame_t = frame(t);
      const Vector3d& a = mesh_.vertices[v[0]];
      const Vector3d ab = mesh_.vertices[v[1]] - a;
      const Vector3d ac = mesh_.vertices[v[2]] - a;
      for (const Polygon& piece : pieces_[t]) {
        const int first = static_cast<int>(result.vertices.size());
        for (const Vector2d& p : piece) {
          const double along_ac = p.y() / frame_t.y2;
          const double along_ab = (p.x() - along_ac * frame_t.x2) / frame_t.x1;
          result.vertices.push_back(a + along_ab * ab + along_ac * ac);
        }
        for (int k = 1; k + 1 < static_cast<int>(piece.size()); ++k) result.triangles.emplace_back(first, first + k, first + k + 1);
      }
    }
    return result;
  }

  const Mesh& mesh_;
  const TrianglePairs& close_;
  const Progress& progress_;
  Mesh turned_;
  std::optional<SurfaceQuery> surface_;  ///< of the turned mesh, when there are more than a few rays
  double tolerance_mm_ = 0;
  std::vector<char> needle_;                  ///< triangles no wider than the tolerance: their planes mean nothing
  std::vector<double> seen_area_;             ///< twice the area of each triangle as seen from above, in general position
  std::vector<std::vector<int>> cutters_;     ///< of each triangle, those that meet it beyond shared corners and edges
  std::vector<char> whole_;                   ///< triangles that belong to the boundary entirely
  std::vector<std::vector<Polygon>> pieces_;  ///< parts of other triangles that do, in their frames
};

}  // namespace

Mesh boundary_of_union(const Mesh& mesh, const Progress& progress) { return boundary_of_union(mesh, close_pairs(mesh), progress); }

Mesh boundary_of_union(const Mesh& mesh, const TrianglePairs& close, const Progress& progress) {
  if (mesh.triangles.empty()) return mesh;
  return UnionBoundary(mesh, close, progress).run();
}

}  // namespace rayrep
