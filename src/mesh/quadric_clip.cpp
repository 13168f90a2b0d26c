#include "mesh/quadric_clip.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <unordered_map>

#include "mesh/edge_collapse.h"
#include "mesh/mesh_edges.h"
#include "mesh/quadric_cap.h"
#include "mesh/quadric_ellipsoid.h"

namespace rayrep {
namespace {

using Eigen::Vector3d;

/// f along a segment from a to b: fa + t slope + t^2 bend.
struct Along {
  double at_a, slope, bend;

  Along(const Quadric& f, const Vector3d& a, const Vector3d& b, double fa, double fb)
      : at_a(fa), slope(0), bend(0.5 * (b - a).dot(f.hessian * (b - a))) {
    slope = fb - fa - bend;
  }
  /// Where it changes its sign, once.
  double root() const {
    const double root = std::sqrt(std::max(0.0, slope * slope - 4 * bend * at_a));
    const double q = -0.5 * (slope + std::copysign(root, slope != 0 ? slope : bend));  // the other way for -f
    const double one = q == 0 ? 0.5 : at_a / q;
    const double two = bend == 0 ? one : q / bend;
    const auto outside = [](double t) { return std::max({0.0, -t, t - 1}); };
    return std::clamp(outside(one) <= outside(two) ? one : two, 0.0, 1.0);
  }
};

bool is_above(double value, const QuadricClipOptions& options) { return value > 0 || (value == 0 && options.zero_is_above); }

/// Puts points on both surfaces.
class Lander {
public:
  Lander(const Quadric& f, const QuadricClipOptions& options) : f_(f), options_(options) {}

  /// The point of the curve near p; none where steps do not settle there, or lead farther away than `reach_mm`.
  std::optional<Vector3d> on_curve(const Vector3d& start, double reach_mm) const {
    constexpr int kSteps = 12;
    const double settled = 1e-4 * options_.error_mm;
    Vector3d p = start;
    for (int step = 0; step < kSteps; ++step) {
      const double d = f_.distance(p);
      const Vector3d m = f_.gradient(p).normalized();
      const std::optional<LevelAt> level = options_.surface ? options_.surface(p) : LevelAt{0, m.unitOrthogonal()};
      if (!level || !std::isfinite(d) || (p - start).norm() > reach_mm) return std::nullopt;
      if (std::max(std::abs(d), std::abs(level->height_mm)) < settled) return f_.nearest(p);
      const double cosine = m.dot(level->normal);
      const double sine2 = 1 - cosine * cosine;
      if (sine2 < 0.01) return std::nullopt;  // the surfaces all but touch
      p += ((cosine * level->height_mm - d) * m + (cosine * d - level->height_mm) * level->normal) / sine2;
    }
    return std::nullopt;
  }

  /// The point of the surface near p.
  Vector3d on_surface(const Vector3d& start, double reach_mm) const {
    constexpr int kSteps = 6;
    if (!options_.surface) return start;
    Vector3d p = start;
    for (int step = 0; step < kSteps; ++step) {
      const std::optional<LevelAt> level = options_.surface(p);
      if (!level || std::abs(level->height_mm) < 1e-9 * reach_mm) break;
      p -= level->height_mm * level->normal;
    }
    return (p - start).norm() <= reach_mm ? p : start;
  }

private:
  const Quadric& f_;
  const QuadricClipOptions& options_;
};

/// Splits edges and triangles until f changes its sign at most once along each, and the chords of the curve follow it.
class Refiner {
public:
  Refiner(Mesh& mesh, const Quadric& f, const QuadricClipOptions& options)
      : mesh_(mesh), f_(f), options_(options), land_(f, options) {
    for (const Vector3d& v : mesh.vertices) value_.push_back(f.value(v));
  }

  void run() {
    constexpr int kRounds = 60;  // two halve a triangle's size
    new_.resize(mesh_.triangles.size());
    std::iota(new_.begin(), new_.end(), std::size_t{0});
    for (int round = 0; round < kRounds; ++round) {
      middle_.clear();
      inner_.clear();
      for (const std::size_t t : new_) look_at(t);
      if (middle_.empty() && inner_.empty()) return;
      new_.clear();
      split();
    }
  }

  const std::vector<double>& values() const { return value_; }

private:
  bool above(int v) const { return is_above(value_[v], options_); }

  void look_at(std::size_t t) {
    const Eigen::Vector3i& v = mesh_.triangles[t];
    const int count = above(v[0]) + above(v[1]) + above(v[2]);
    bool is_split = false;
    for (int k = 0; k < 3; ++k)
      if (above(v[k]) == above(v[(k + 1) % 3])) is_split = split_twice_crossed(v[k], v[(k + 1) % 3]) || is_split;
    if (is_split) return;
    if (count == 0 || count == 3)
      split_around_extreme(t);
    else
      split_long_chord(v);
  }

  /// Where f changes its sign and back along an edge, by more than the error.
  bool split_twice_crossed(int a, int b) {
    const Along along(f_, mesh_.vertices[a], mesh_.vertices[b], value_[a], value_[b]);
    if (along.bend == 0 || (along.bend > 0) != above(a) ||
        std::min(std::abs(value_[a]), std::abs(value_[b])) >= 0.25 * std::abs(along.bend))
      return false;
    const double t = -0.5 * along.slope / along.bend;
    if (!(t > 0 && t < 1) || (along.at_a + 0.5 * t * along.slope > 0) == above(a)) return false;
    const Vector3d p = mesh_.vertices[a] + t * (mesh_.vertices[b] - mesh_.vertices[a]);
    if (!(std::abs(f_.distance(p)) > options_.error_mm)) return false;
    middle_.try_emplace(edge_key(a, b), p);
    return true;
  }

  /// Where f has another sign within a triangle than all around it.
  void split_around_extreme(std::size_t t) {
    const Vector3d& a = mesh_.corner(t, 0);
    Eigen::Matrix<double, 3, 2> sides;
    sides << mesh_.corner(t, 1) - a, mesh_.corner(t, 2) - a;
    const Eigen::Matrix2d bend = sides.transpose() * f_.hessian * sides;
    const double sign = above(mesh_.triangles[t][0]) ? 1 : -1;
    const double determinant = bend.determinant();
    if (!(determinant > 0) || sign * bend(0, 0) <= 0) return;
    const Eigen::Vector2d s = -bend.inverse() * (sides.transpose() * f_.gradient(a));
    if (!(s.minCoeff() > 0 && s.sum() < 1)) return;
    const Vector3d p = a + sides * s;
    if (sign * f_.value(p) < 0 && std::abs(f_.distance(p)) > options_.error_mm) inner_.emplace_back(t, p);
  }

  /// Where the curve leaves its chord in a triangle, that is halved.
  void split_long_chord(const Eigen::Vector3i& v) {
    Vector3d ends[2];
    int n = 0;
    int longest = 0;
    for (int k = 0; k < 3; ++k) {
      const Vector3d& a = mesh_.vertices[v[k]];
      const Vector3d& b = mesh_.vertices[v[(k + 1) % 3]];
      if (above(v[k]) != above(v[(k + 1) % 3]) && n < 2)
        ends[n++] = a + Along(f_, a, b, value_[v[k]], value_[v[(k + 1) % 3]]).root() * (b - a);
      if ((b - a).norm() > (mesh_.vertices[v[longest]] - mesh_.vertices[v[(longest + 1) % 3]]).norm()) longest = k;
    }
    const double length = (ends[1] - ends[0]).norm();
    const double sag = std::abs(f_.distance(0.5 * (ends[0] + ends[1])));
    if (length < 4 * options_.error_mm || !(sag > options_.error_mm)) return;
    const int a = v[longest];
    const int b = v[(longest + 1) % 3];
    middle_.try_emplace(edge_key(a, b), 0.5 * (mesh_.vertices[a] + mesh_.vertices[b]));
  }

  int add(const Vector3d& p) {
    mesh_.vertices.push_back(p);
    value_.push_back(f_.value(p));
    return static_cast<int>(mesh_.vertices.size()) - 1;
  }

  void split() {
    std::unordered_map<std::uint64_t, int> numbers;
    const std::size_t count = mesh_.triangles.size();
    for (const auto& [t, p] : inner_) {
      const Eigen::Vector3i v = mesh_.triangles[t];
      bool is_cut = false;  // by a neighbour: it is looked at again
      for (int k = 0; k < 3; ++k) is_cut = is_cut || middle_.contains(edge_key(v[k], v[(k + 1) % 3]));
      if (is_cut) continue;
      const int n = add(land_.on_surface(p, 4 * options_.error_mm));
      replace(t, {{v[0], v[1], n}, {v[1], v[2], n}, {v[2], v[0], n}});
    }
    if (middle_.empty()) return;
    for (std::size_t t = 0; t < count; ++t) {
      const Eigen::Vector3i v = mesh_.triangles[t];
      std::array<int, 3> middle{-1, -1, -1};
      int cuts = 0;
      for (int k = 0; k < 3; ++k) {
        const std::uint64_t key = edge_key(v[k], v[(k + 1) % 3]);
        const auto found = middle_.find(key);
        if (found == middle_.end()) continue;
        const auto [place, is_new] = numbers.try_emplace(key, -1);
        if (is_new) place->second = add(land_.on_surface(found->second, 4 * options_.error_mm));
        middle[k] = place->second;
        ++cuts;
      }
      if (cuts > 0) cut(t, v, middle);
    }
  }

  /// Replaces a triangle by those that its split sides leave.
  void cut(std::size_t t, const Eigen::Vector3i& v, const std::array<int, 3>& middle) {
    std::vector<int> ring;
    for (int k = 0; k < 3; ++k) {
      ring.push_back(v[k]);
      if (middle[k] >= 0) ring.push_back(middle[k]);
    }
    // A corner whose both sides are split is cut off; what remains has a corner that sees it all.
    std::vector<Eigen::Vector3i> pieces;
    for (int k = 0; k < 3 && ring.size() > 4; ++k)
      if (middle[k] >= 0 && middle[(k + 2) % 3] >= 0) {
        pieces.emplace_back(middle[(k + 2) % 3], v[k], middle[k]);
        ring.erase(std::find(ring.begin(), ring.end(), v[k]));
      }
    if (ring.size() == 4) {
      const auto length = [&](int i, int j) { return (mesh_.vertices[ring[i]] - mesh_.vertices[ring[j]]).squaredNorm(); };
      const int first = pieces.empty() ? start_of(ring, middle) : length(0, 2) <= length(1, 3) ? 0 : 1;
      std::rotate(ring.begin(), ring.begin() + first, ring.end());
    }
    for (std::size_t k = 2; k < ring.size(); ++k) pieces.emplace_back(ring[0], ring[k - 1], ring[k]);
    replace(t, pieces);
  }

  void replace(std::size_t t, const std::vector<Eigen::Vector3i>& pieces) {
    mesh_.triangles[t] = pieces[0];
    new_.push_back(t);
    for (std::size_t n = 1; n < pieces.size(); ++n) {
      new_.push_back(mesh_.triangles.size());
      mesh_.triangles.push_back(pieces[n]);
    }
  }

  /// With one side split: its middle.
  static int start_of(const std::vector<int>& ring, const std::array<int, 3>& middle) {
    for (std::size_t k = 0; k < ring.size(); ++k)
      if (std::find(middle.begin(), middle.end(), ring[k]) != middle.end()) return static_cast<int>(k);
    return 0;
  }

  Mesh& mesh_;
  const Quadric& f_;
  const QuadricClipOptions& options_;
  Lander land_;
  std::vector<double> value_;
  std::unordered_map<std::uint64_t, Vector3d> middle_;  ///< of edges that are split
  std::vector<std::pair<std::size_t, Vector3d>> inner_;
  std::vector<std::size_t> new_;  ///< triangles that were not looked at yet
};

/// Cuts a mesh along f = 0, where f changes its sign at most once along each edge.
class Cutter {
public:
  Cutter(Mesh mesh, std::vector<double> values, const Quadric& f, const QuadricClipOptions& options)
      : mesh_(std::move(mesh)),
        value_(std::move(values)),
        f_(f),
        options_(options),
        land_(f, options),
        snapped_(mesh_.vertices.size(), 0) {}

  std::optional<QuadricClipped> run() {
    snap();
    find_crossings();
    take_back_folds();
    if (std::optional<QuadricClipped> result = assemble()) return result;
    // Nearer to each other than the surfaces are to their mesh: on the mesh itself curves do not cross.
    for (std::size_t n = 0; n < mesh_.vertices.size(); ++n) take_back(static_cast<int>(n));
    return assemble();
  }

private:
  bool above(int v) const { return is_above(value_[v], options_); }
  bool is_cut(const Eigen::Vector3i& v) const { return above(v[0]) != above(v[1]) || above(v[1]) != above(v[2]); }

  /// Vertices on the mesh's own curve are points of it as they are. Those close to it are moved onto it: what the cut leaves of
  /// their triangles would be slivers. No two neighbours are, and none around which f changes its sign more than twice.
  void snap() {
    for (std::size_t n = 0; n < value_.size(); ++n)
      if (value_[n] == 0 && !options_.surface) {
        snapped_[n] = 1;
        before_.emplace(static_cast<int>(n), mesh_.vertices[n]);
      }
    if (!options_.surface) return;  // others would leave the mesh
    const VertexCorners at(mesh_);
    std::vector<char> looked_at(mesh_.vertices.size(), 0);
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      const Eigen::Vector3i v = mesh_.triangles[t];
      if (!is_cut(v)) continue;
      for (const int n : v)
        if (!std::exchange(looked_at[n], 1)) snap(n, at);
    }
  }

  void snap(int n, const VertexCorners& at) {
    constexpr double kShare = 0.2;  // of the shortest edge
    double shortest = HUGE_VAL;
    int changes = 0;
    Vector3d normal = Vector3d::Zero();
    for (int c = at.first[n]; c < at.first[n + 1]; ++c) {
      const Eigen::Vector3i& v = mesh_.triangles[at.corners[c] / 3];
      const int k = at.corners[c] % 3;
      const int a = v[(k + 1) % 3];
      const int b = v[(k + 2) % 3];
      if (snapped_[a] || snapped_[b]) return;
      changes += above(a) != above(b);
      shortest = std::min(shortest, (mesh_.vertices[a] - mesh_.vertices[n]).norm());
      normal += (mesh_.vertices[a] - mesh_.vertices[n]).cross(mesh_.vertices[b] - mesh_.vertices[n]);
    }
    if (changes != 2) return;
    const Vector3d gradient = f_.gradient(mesh_.vertices[n]);
    normal.normalize();
    const double along = (gradient - gradient.dot(normal) * normal).norm();
    if (!(std::abs(value_[n]) < kShare * shortest * along)) return;
    const std::optional<Vector3d> p = land_.on_curve(mesh_.vertices[n], 2 * kShare * shortest);
    if (!p) return;
    before_.emplace(n, mesh_.vertices[n]);
    mesh_.vertices[n] = *p;
    snapped_[n] = 1;
  }

  void find_crossings() {
    std::vector<std::array<int, 2>> edges;
    for (const Eigen::Vector3i& v : mesh_.triangles) {
      if (!is_cut(v)) continue;
      for (int k = 0; k < 3; ++k) {
        const int a = v[k];
        const int b = v[(k + 1) % 3];
        if (above(a) == above(b) || snapped_[a] || snapped_[b]) continue;
        const int number = static_cast<int>(mesh_.vertices.size() + edges.size());
        if (crossing_.try_emplace(edge_key(a, b), number).second) edges.push_back({std::min(a, b), std::max(a, b)});
      }
    }
    const std::size_t first = mesh_.vertices.size();
    mesh_.vertices.resize(first + edges.size());
    std::vector<Vector3d> chord(edges.size());
    std::vector<char> settled(edges.size(), 1);
    tbb::parallel_for(std::size_t{0}, edges.size(), [&](std::size_t n) {
      const auto [a, b] = edges[n];
      const Vector3d& pa = mesh_.vertices[a];
      const Vector3d& pb = mesh_.vertices[b];
      chord[n] = f_.nearest(pa + Along(f_, pa, pb, value_[a], value_[b]).root() * (pb - pa));
      mesh_.vertices[first + n] = chord[n];
      if (!options_.surface) return;
      const std::optional<Vector3d> p = land_.on_curve(chord[n], 0.5 * (pb - pa).norm());
      settled[n] = p.has_value();
      if (p) mesh_.vertices[first + n] = *p;
    });
    for (std::size_t n = 0; n < edges.size(); ++n)
      if (settled[n]) before_.emplace(static_cast<int>(first + n), chord[n]);
  }

  int crossing(int a, int b) const { return snapped_[a] ? a : snapped_[b] ? b : crossing_.at(edge_key(a, b)); }

  /// What is left of a triangle where f > 0: up to four corners, and the two of the cut.
  struct Piece {
    std::array<int, 4> corner{};
    int count = 0;
    int leaves = -1, enters = -1;  ///< where its rim goes below f = 0, and where it comes back
  };
  Piece piece(const Eigen::Vector3i& v) const {
    Piece piece;
    const auto push = [&piece](int n) {
      if (piece.count == 0 || (piece.corner[piece.count - 1] != n && piece.corner[0] != n)) piece.corner[piece.count++] = n;
    };
    for (int k = 0; k < 3; ++k) {
      const int a = v[k];
      const int b = v[(k + 1) % 3];
      if (above(a)) push(a);
      if (above(a) == above(b)) continue;
      const int c = crossing(a, b);
      push(c);
      (above(a) ? piece.leaves : piece.enters) = c;
    }
    return piece;
  }

  /// Where a vertex was before it was moved onto the curve.
  const Vector3d& before(int n) const {
    const auto found = before_.find(n);
    return found == before_.end() ? mesh_.vertices[n] : found->second;
  }

  /// Whether the way onto the curve has turned a piece over, or its part of the curve round.
  bool is_folded(const Piece& piece) const {
    constexpr double kLeast = 0.3;  // cosine between then and now
    const auto is_turned = [](const Vector3d& now, const Vector3d& then) {
      return now.dot(then) <= kLeast * now.norm() * then.norm() && then.squaredNorm() > 0;
    };
    const auto& at = mesh_.vertices;
    Vector3d now = Vector3d::Zero();
    Vector3d then = Vector3d::Zero();
    for (int k = 2; k < piece.count; ++k) {
      const auto& c = piece.corner;
      now += (at[c[k - 1]] - at[c[0]]).cross(at[c[k]] - at[c[0]]);
      then += (before(c[k - 1]) - before(c[0])).cross(before(c[k]) - before(c[0]));
    }
    return is_turned(now, then) || is_turned(at[piece.enters] - at[piece.leaves], before(piece.enters) - before(piece.leaves));
  }

  void take_back(int n) {
    const auto place = before_.find(n);
    if (place == before_.end()) return;
    mesh_.vertices[n] = f_.nearest(place->second);
    before_.erase(place);
  }

  /// Points whose way onto the curve has folded something go back.
  void take_back_folds() {
    constexpr int kRounds = 4;
    for (int round = 0; round < kRounds; ++round) {
      std::vector<int> back;
      for (const Eigen::Vector3i& v : mesh_.triangles) {
        if (!is_cut(v)) continue;
        const Piece left = piece(v);
        if (!is_folded(left)) continue;
        back.insert(back.end(), left.corner.begin(), left.corner.begin() + left.count);
        back.push_back(left.leaves);
        back.push_back(left.enters);
      }
      if (back.empty()) return;
      for (const int n : back) take_back(n);
    }
  }

  std::optional<QuadricClipped> assemble() {
    Mesh cut;
    cut.vertices = mesh_.vertices;
    std::vector<std::array<int, 2>> rim;  // along the caps: the other way round than along the pieces
    for (const Eigen::Vector3i& v : mesh_.triangles) {
      if (!is_cut(v)) {
        if (above(v[0])) cut.triangles.push_back(v);
        continue;
      }
      const Piece left = piece(v);
      add(left, cut);
      if (left.leaves != left.enters) rim.push_back({left.enters, left.leaves});
    }
    std::unordered_map<int, int> next;
    if (!follow_rim(rim, next)) return std::nullopt;
    const std::size_t pieces = cut.triangles.size();
    if (!append_caps(f_, loops_of(next), options_.error_mm, cut)) return std::nullopt;
    return numbered(cut, pieces, next);
  }

  /// Where each point of the rim leads. Edges that it runs both ways, in which the surface only touches f = 0, are none of it.
  /// @returns false where it does not lead round
  static bool follow_rim(std::vector<std::array<int, 2>>& rim, std::unordered_map<int, int>& next) {
    std::sort(rim.begin(), rim.end());
    const auto leads_back = [&](const std::array<int, 2>& side) {
      return std::binary_search(rim.begin(), rim.end(), std::array<int, 2>{side[1], side[0]});
    };
    for (const auto& side : rim)
      if (!leads_back(side) && !next.try_emplace(side[0], side[1]).second) return false;
    return std::all_of(next.begin(), next.end(), [&](const auto& side) { return next.contains(side.second); });
  }

  void add(const Piece& left, Mesh& cut) const {
    const auto& c = left.corner;
    const auto length = [&](int i, int j) { return (cut.vertices[c[i]] - cut.vertices[c[j]]).squaredNorm(); };
    if (left.count == 4 && length(1, 3) < length(0, 2)) {
      cut.triangles.emplace_back(c[0], c[1], c[3]);
      cut.triangles.emplace_back(c[1], c[2], c[3]);
      return;
    }
    for (int k = 2; k < left.count; ++k) cut.triangles.emplace_back(c[0], c[k - 1], c[k]);
  }

  static std::vector<std::vector<int>> loops_of(const std::unordered_map<int, int>& next) {
    std::vector<int> starts;
    for (const auto& [from, to] : next) starts.push_back(from);
    std::sort(starts.begin(), starts.end());
    std::unordered_map<int, char> done;
    std::vector<std::vector<int>> loops;
    for (const int start : starts) {
      if (done.contains(start)) continue;
      loops.emplace_back();
      for (int n = start; done.try_emplace(n, 1).second; n = next.at(n)) loops.back().push_back(n);
    }
    return loops;
  }

  QuadricClipped numbered(const Mesh& cut, std::size_t pieces, const std::unordered_map<int, int>& next) const {
    using On = QuadricClipped::On;
    QuadricClipped result;
    std::vector<int> number(cut.vertices.size(), -1);
    for (std::size_t t = 0; t < cut.triangles.size(); ++t) {
      Eigen::Vector3i v = cut.triangles[t];
      for (int& n : v) {
        if (number[n] < 0) {
          number[n] = static_cast<int>(result.mesh.vertices.size());
          result.mesh.vertices.push_back(cut.vertices[n]);
          const bool is_settled = before_.contains(n);  // on both surfaces
          result.on.push_back(next.contains(n) && is_settled    ? On::crease
                              : next.contains(n) || t >= pieces ? On::cap
                                                                : On::surface);
        }
        n = number[n];
      }
      result.mesh.triangles.push_back(v);
    }
    return result;
  }

  Mesh mesh_;
  std::vector<double> value_;
  const Quadric& f_;
  const QuadricClipOptions& options_;
  Lander land_;
  std::vector<char> snapped_;
  std::unordered_map<std::uint64_t, int> crossing_;
  std::unordered_map<int, Vector3d> before_;  ///< where points of the cut were before they were moved onto the curve
};

}  // namespace

namespace {

/// Points closer to a crease than the error become points of it, and then points of creases that are so close become one.
void join_close_points(QuadricClipped& clipped, double error_mm) {
  using On = QuadricClipped::On;
  const auto is_crease = [&clipped](int n) { return clipped.on[n] == On::crease; };
  for (const bool join_creases : {false, true}) {
    const Mesh& mesh = clipped.mesh;
    std::vector<char> fixed(clipped.on.size(), 1);
    for (const Eigen::Vector3i& v : mesh.triangles)
      for (int k = 0; k < 3; ++k)
        for (const auto& [a, b] : {std::pair(v[k], v[(k + 1) % 3]), std::pair(v[(k + 1) % 3], v[k])})
          if (is_crease(b) && is_crease(a) == join_creases && (mesh.vertices[a] - mesh.vertices[b]).norm() < error_mm) fixed[a] = 0;
    const std::vector<int> old = collapse_short_edges(clipped.mesh, error_mm, fixed);
    std::vector<On> on;
    for (const int n : old) on.push_back(clipped.on[n]);
    clipped.on = std::move(on);
  }
}

/// By more than 60 degrees, where it is no needle thinner than the error.
bool is_turned(const Mesh& before, const Mesh& after, std::size_t t, double error_mm) {
  const auto area = [t](const Mesh& mesh) -> Vector3d {
    return (mesh.corner(t, 1) - mesh.corner(t, 0)).cross(mesh.corner(t, 2) - mesh.corner(t, 0));
  };
  const Vector3d now = area(after);
  const Vector3d then = area(before);
  if (now.dot(then) >= 0.5 * now.norm() * then.norm()) return false;
  double longest = 0;
  for (int k = 0; k < 3; ++k) longest = std::max(longest, (after.corner(t, k) - after.corner(t, (k + 1) % 3)).norm());
  return now.norm() > error_mm * longest;
}

}  // namespace

bool follow(QuadricClipped& clipped, const Quadric& f, const QuadricClipOptions& options) {
  constexpr double kReach = 8;  // times the way to f = 0: the curve goes farther where the surfaces meet at a sharp angle
  const Lander land(f, options);
  const Mesh before = clipped.mesh;
  tbb::parallel_for(std::size_t{0}, before.vertices.size(), [&](std::size_t n) {
    if (clipped.on[n] == QuadricClipped::On::surface) return;
    Vector3d& p = clipped.mesh.vertices[n];
    if (clipped.on[n] == QuadricClipped::On::crease) {
      if (const auto moved = land.on_curve(p, options.error_mm + kReach * std::abs(f.distance(p)))) {
        p = *moved;
        return;
      }
      clipped.on[n] = QuadricClipped::On::cap;
    }
    p = f.nearest(p);
  });
  for (std::size_t t = 0; t < before.triangles.size(); ++t)
    if (is_turned(before, clipped.mesh, t, options.error_mm)) return false;
  return true;
}

std::optional<QuadricClipped> clip_by_quadric(const Mesh& mesh, const Quadric& f, const QuadricClipOptions& options) {
  Mesh refined = mesh;
  Refiner refiner(refined, f, options);
  refiner.run();
  std::optional<QuadricClipped> result = Cutter(std::move(refined), refiner.values(), f, options).run();
  if (!result) return result;
  const auto is_whole = [](QuadricClipped::On on) { return on == QuadricClipped::On::surface; };
  if (std::all_of(result->on.begin(), result->on.end(), is_whole) && holds_ellipsoid(mesh, f)) {
    append_ellipsoid(f, options.error_mm, result->mesh);
    result->on.resize(result->mesh.vertices.size(), QuadricClipped::On::cap);
  }
  if (!options.surface) return result;
  join_close_points(*result, options.error_mm);
  return result;
}

}  // namespace rayrep
