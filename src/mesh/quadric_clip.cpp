#include "mesh/quadric_clip.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numeric>
#include <set>
#include <unordered_map>

#include "mesh/crossing.h"
#include "mesh/mesh_edges.h"
#include "mesh/quadric_cap.h"
#include "mesh/quadric_ellipsoid.h"
#include "mesh/quadric_landing.h"
#include "mesh/quadric_refiner.h"

namespace rayrep {
namespace {

using Eigen::Vector3d;

/// Where steps from edges and vertices lead on the curve, or none: what is split leaves most of them as they are.
struct Landed {
  std::unordered_map<std::uint64_t, std::optional<Vector3d>> from_edge;
  std::unordered_map<int, std::optional<Vector3d>> from_vertex;
};

/// Cuts a mesh along f = 0, where f changes its sign at most once along each edge.
class Cutter {
public:
  /// @param keeps_chords  whether chords of the curve may not become longer than they are where points become one
  Cutter(Mesh mesh, const QuadricRefiner& refiner, const Quadric& f, const QuadricClipOptions& options, bool keeps_chords)
      : mesh_(std::move(mesh)),
        keeps_chords_(keeps_chords && options.surface),
        value_(refiner.values()),
        is_new_(refiner.is_new()),
        is_moved_(refiner.is_moved()),
        f_(f),
        options_(options),
        land_(f, options),
        snapped_(mesh_.vertices.size(), 0) {
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t)
      if (is_cut(mesh_.triangles[t])) cut_.push_back(t);
  }

  /// Puts points on the curve. @returns triangles of whose points some found no place there, or whose piece is folded by that
  /// @param landed  of this mesh before some of it was split; what is new is added
  std::vector<std::size_t> place(Landed& landed) {
    snap(landed);
    find_crossings(landed);
    return pieces_where([this](std::size_t t, const Piece& piece) {
      return is_folded(t) || is_unplaced(t) || lacks_wall(piece, 0.5 * options_.error_mm);
    });
  }

  /// Triangles at the curve, or with a corner that was moved onto the surface, that leave it between their corners. theory.md (139)
  std::vector<std::size_t> thin() const {
    const auto is_moved = [this](int n) { return is_moved_[n] != 0; };
    std::vector<std::size_t> triangles;
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      const Eigen::Vector3i& v = mesh_.triangles[t];
      if (is_cut(v) ? leaves_surface(piece(v))
                    : std::any_of(v.begin(), v.end(), is_moved) && leaves_surface({{v[0], v[1], v[2]}, 3}))
        triangles.push_back(t);
    }
    return triangles;
  }

  /// Of the curve's chords in these triangles, before their ends were put on it.
  double length_in(const std::vector<std::size_t>& triangles) const {
    double sum = 0;
    for (const std::size_t t : triangles) {
      const Piece whole = piece(mesh_.triangles[t]);
      sum += (before(whole.enters) - before(whole.leaves)).norm();
    }
    return sum;
  }

  /// Points that found no place on the curve, or whose way there has folded something, become one with a neighbour that has its
  /// place; where that folds something, too, they go back. Then points closer to each other than the error become one.
  /// @param may_close  whether closed curves may become a point, which is where parts of the surface then touch f = 0
  void settle(bool may_close) {
    constexpr int kRounds = 4;
    may_close_ = may_close;
    merged_.clear();
    groups_.clear();
    for (int round = 0; round < kRounds; ++round) {
      for (bool changed = true; changed;) {
        changed = false;
        for (const std::size_t t : cut_)
          if (is_folded(t) || is_unplaced(t)) changed = merge_at(t) || changed;
      }
      std::vector<int> back;
      for (const std::size_t t : cut_) {
        if (!is_folded(t)) continue;
        const Piece left = piece(mesh_.triangles[t]);
        back.insert(back.end(), left.corner.begin(), left.corner.begin() + left.count);
        back.insert(back.end(), {left.leaves, left.enters});
      }
      if (back.empty()) break;
      for (const int n : back) take_back(n);
    }
    if (!options_.surface) return;
    for (const auto& [n, triangles] : at_)
      if (!merged_.contains(n)) merge(n, options_.error_mm);
    for (bool changed = may_close; changed;) {
      changed = false;
      for (const auto& [n, triangles] : at_)
        if (!merged_.contains(n) && (tangled_.contains(n) || is_of_three(n))) changed = merge(n, 4 * options_.error_mm) || changed;
    }
  }

  /// @returns none where the curves cannot be capped: some are tangled, then
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
    tangled_.clear();
    crossings_ = 0;
    if (!look_at_merged(cut) || !follow_rim(rim, next)) return std::nullopt;
    const std::size_t pieces = cut.triangles.size();
    std::vector<int> tangled;
    const bool is_capped = append_caps(f_, loops_of(next), options_.error_mm, cut, tangled);
    tangled_.insert(tangled.begin(), tangled.end());
    if (!is_capped) return std::nullopt;
    note_crossings(cut);
    return numbered(cut, pieces, next);
  }
  /// Pairs of triangles that cross where points were merged.
  std::size_t crossings() const { return crossings_; }

  /// Triangles in which curves cross others.
  std::vector<std::size_t> tangled() const {
    return pieces_where(
        [this](std::size_t, const Piece& piece) { return tangled_.contains(piece.leaves) && tangled_.contains(piece.enters); });
  }

  /// Points at which curves cross go back, and points that cannot be one stay apart. @returns false where there are none
  bool untangle() {
    bool some = false;
    for (const int n : tangled_) some = take_back(n) || some;
    for (const int n : spoilt_) {
      const auto group = groups_.find(n);
      if (group == groups_.end()) continue;
      for (const int m : group->second) some = separate_.insert(m).second || some;
    }
    return some;
  }
  void take_back_all() {
    merged_.clear();
    groups_.clear();
    for (std::size_t n = 0; n < mesh_.vertices.size(); ++n) take_back(static_cast<int>(n));
  }

private:
  bool above(int v) const { return options_.is_above(value_[v]); }
  bool is_cut(const Eigen::Vector3i& v) const { return above(v[0]) != above(v[1]) || above(v[1]) != above(v[2]); }

  template <typename Condition>
  std::vector<std::size_t> pieces_where(const Condition& holds) const {
    std::vector<std::size_t> triangles;
    for (const std::size_t t : cut_)
      if (holds(t, piece(mesh_.triangles[t]))) triangles.push_back(t);
    return triangles;
  }

  /// Vertices on the mesh's own curve are points of it as they are. Those close to it are moved onto it: what the cut leaves of
  /// their triangles would be slivers. No two neighbours are, and none around which f changes its sign more than twice.
  void snap(Landed& landed) {
    for (std::size_t n = 0; n < value_.size(); ++n)
      if (value_[n] == 0 && !options_.surface) {
        snapped_[n] = 1;
        before_.emplace(static_cast<int>(n), mesh_.vertices[n]);
      }
    if (!options_.surface) return;  // others would leave the mesh
    std::vector<char> is_near(mesh_.vertices.size(), 0);
    for (const std::size_t t : cut_)
      for (const int n : mesh_.triangles[t]) is_near[n] = 1;
    std::unordered_map<int, std::vector<Fan>> fans;
    for (const Eigen::Vector3i& v : mesh_.triangles)
      for (int k = 0; k < 3; ++k)
        if (is_near[v[k]]) fans[v[k]].push_back({v[(k + 1) % 3], v[(k + 2) % 3]});
    for (const std::size_t t : cut_)
      for (const int n : mesh_.triangles[t])
        if (std::exchange(is_near[n], 0)) snap(n, fans.at(n), landed);
  }

  using Fan = std::array<int, 2>;  ///< a triangle's two other corners, seen from one

  void snap(int n, const std::vector<Fan>& fans, Landed& landed) {
    constexpr double kShare = 0.2;  // of the shortest edge
    double shortest = HUGE_VAL;
    int changes = 0;
    Vector3d normal = Vector3d::Zero();
    for (const auto& [a, b] : fans) {
      if (snapped_[a] || snapped_[b]) return;
      changes += above(a) != above(b);
      shortest = std::min(shortest, (mesh_.vertices[a] - mesh_.vertices[n]).norm());
      normal += (mesh_.vertices[a] - mesh_.vertices[n]).cross(mesh_.vertices[b] - mesh_.vertices[n]);
    }
    if (changes != 2) return;
    const Vector3d gradient = f_.gradient(mesh_.vertices[n]);
    normal.normalize();
    const Vector3d along = gradient - gradient.dot(normal) * normal;  // the mesh
    if (!(std::abs(value_[n]) < kShare * shortest * along.norm())) return;
    const double reach = 2 * kShare * shortest;  // which splits make shorter
    const auto [place, is_new] = landed.from_vertex.try_emplace(n);
    if (is_new) place->second = land_.on_curve(mesh_.vertices[n], reach);
    const std::optional<Vector3d>& p = place->second;
    if (!p || (*p - mesh_.vertices[n]).norm() > reach) return;
    const auto is_long = [&](const Fan& fan) { return above(fan[0]) != above(fan[1]) && is_far(*p, on_edge(fan[0], fan[1])); };
    if (keeps_chords_ && std::any_of(fans.begin(), fans.end(), is_long)) return;
    before_.emplace(n, mesh_.vertices[n] - value_[n] / along.squaredNorm() * along);
    mesh_.vertices[n] = *p;
    snapped_[n] = 1;
  }

  /// Where f changes its sign between two vertices.
  Vector3d on_edge(int a, int b) const {
    const Vector3d way = mesh_.vertices[b] - mesh_.vertices[a];
    return mesh_.vertices[a] + QuadricAlong(f_, mesh_.vertices[a], mesh_.vertices[b], value_[a], value_[b]).root() * way;
  }

  /// Whether the chord between two points of f = 0 leaves it by more than the error.
  bool is_far(const Vector3d& a, const Vector3d& b) const { return std::abs(f_.distance(0.5 * (a + b))) > options_.error_mm; }

  void find_crossings(Landed& landed) {
    std::vector<std::array<int, 2>> edges;
    for (const std::size_t t : cut_) {
      const Eigen::Vector3i& v = mesh_.triangles[t];
      for (int k = 0; k < 3; ++k) {
        const int a = v[k];
        const int b = v[(k + 1) % 3];
        if (above(a) == above(b) || snapped_[a] || snapped_[b]) continue;
        const int number = static_cast<int>(mesh_.vertices.size() + edges.size());
        if (crossing_.try_emplace(edge_key(a, b), number).second) edges.push_back({std::min(a, b), std::max(a, b)});
      }
    }
    for (const std::size_t t : cut_) {
      const Piece whole = piece(mesh_.triangles[t]);
      at_[whole.leaves].push_back(t);
      at_[whole.enters].push_back(t);
    }
    const std::size_t first = mesh_.vertices.size();
    mesh_.vertices.resize(first + edges.size());
    std::vector<Vector3d> chord(edges.size());
    std::vector<std::optional<Vector3d>> place(edges.size());
    tbb::parallel_for(std::size_t{0}, edges.size(), [&](std::size_t n) {
      const auto [a, b] = edges[n];
      chord[n] = f_.nearest(on_edge(a, b));
      const auto before = landed.from_edge.find(edge_key(a, b));
      place[n] = !options_.surface                  ? chord[n]
                 : before != landed.from_edge.end() ? before->second
                                                    : land_.on_curve(chord[n], (mesh_.vertices[b] - mesh_.vertices[a]).norm());
    });
    for (std::size_t n = 0; n < edges.size(); ++n) {
      landed.from_edge.try_emplace(edge_key(edges[n][0], edges[n][1]), place[n]);
      mesh_.vertices[first + n] = place[n].value_or(chord[n]);
      if (place[n]) before_.emplace(static_cast<int>(first + n), chord[n]);
    }
  }

  int crossing(int a, int b) const { return snapped_[a] ? a : snapped_[b] ? b : crossing_.at(edge_key(a, b)); }

  /// The point that a point was merged into, or itself.
  int merged(int n) const {
    const auto found = merged_.find(n);
    return found == merged_.end() ? n : found->second;
  }

  /// What is left of a triangle where f > 0: up to four corners, and the two of the cut.
  struct Piece {
    std::array<int, 4> corner{};
    int count = 0;
    int leaves = -1, enters = -1;  ///< where its rim goes below f = 0, and where it comes back
  };
  Piece piece(const Eigen::Vector3i& v) const {
    return piece(v, [this](int n) { return merged(n); });
  }
  template <typename Name>
  Piece piece(const Eigen::Vector3i& v, const Name& name) const {
    Piece piece;
    const auto push = [&piece](int n) {
      if (piece.count == 0 || (piece.corner[piece.count - 1] != n && piece.corner[0] != n)) piece.corner[piece.count++] = n;
    };
    for (int k = 0; k < 3; ++k) {
      const int a = v[k];
      const int b = v[(k + 1) % 3];
      if (above(a)) push(a);
      if (above(a) == above(b)) continue;
      const int c = name(crossing(a, b));
      push(c);
      (above(a) ? piece.leaves : piece.enters) = c;
    }
    return piece;
  }

  /// Whether the chord of a piece is outside of the surface by more than that.
  bool lacks_wall(const Piece& piece, double most_mm) const {
    if (!options_.surface || piece.leaves == piece.enters) return false;
    return land_.height(0.5 * (mesh_.vertices[piece.leaves] + mesh_.vertices[piece.enters])) > most_mm;
  }

  /// Whether it leaves f = 0 by more than the error.
  bool lacks_cap(const Piece& piece) const {
    return piece.leaves != piece.enters && is_far(mesh_.vertices[piece.leaves], mesh_.vertices[piece.enters]);
  }

  /// Whether it is outside of the surface in the middle, or between two corners, by more than half of the error.
  bool leaves_surface(const Piece& piece) const {
    const double most_mm = 0.5 * options_.error_mm;
    Vector3d sum = Vector3d::Zero();
    for (int i = 0; i < piece.count; ++i) {
      const Vector3d& p = mesh_.vertices[piece.corner[i]];
      sum += p;
      for (int j = 0; j < i; ++j)
        if (land_.height(0.5 * (p + mesh_.vertices[piece.corner[j]])) > most_mm) return true;
    }
    return land_.height(sum / piece.count) > most_mm;
  }

  /// Where a vertex was before it was moved onto the curve.
  const Vector3d& before(int n) const {
    const auto found = before_.find(n);
    return found == before_.end() ? mesh_.vertices[n] : found->second;
  }

  /// Whether the way onto the curve has turned a piece over, or its part of the curve round.
  bool is_folded(std::size_t t) const {
    constexpr double kLeast = 0.3;  // cosine between then and now
    const auto is_turned = [](const Vector3d& now, const Vector3d& then) {
      return now.dot(then) <= kLeast * now.norm() * then.norm() && then.squaredNorm() > 0;
    };
    const auto at = [this](int n) -> const Vector3d& { return mesh_.vertices[merged(n)]; };
    const Piece whole = piece(mesh_.triangles[t], [](int n) { return n; });
    if (merged(whole.leaves) != merged(whole.enters) &&
        is_turned(at(whole.enters) - at(whole.leaves), before(whole.enters) - before(whole.leaves)))
      return true;
    if (piece(mesh_.triangles[t]).count < 3) return false;
    Vector3d now = Vector3d::Zero();
    Vector3d then = Vector3d::Zero();
    for (int k = 2; k < whole.count; ++k) {
      const auto& c = whole.corner;
      now += (at(c[k - 1]) - at(c[0])).cross(at(c[k]) - at(c[0]));
      then += (before(c[k - 1]) - before(c[0])).cross(before(c[k]) - before(c[0]));
    }
    return is_turned(now, then);
  }

  bool is_vertex(int n) const { return n < static_cast<int>(snapped_.size()); }

  /// Whether an end of its part of the curve found no place there.
  bool is_unplaced(std::size_t t) const {
    const Piece whole = piece(mesh_.triangles[t]);
    return !before_.contains(whole.leaves) || !before_.contains(whole.enters);
  }

  /// Merges one end of a triangle's part of the curve into another point: one without a place rather than the one that has come
  /// farther.
  bool merge_at(std::size_t t) {
    const Piece whole = piece(mesh_.triangles[t]);
    const auto worth = [this](int n) { return before_.contains(n) ? -(mesh_.vertices[n] - before(n)).norm() : -HUGE_VAL; };
    if (!before_.contains(whole.leaves) && !before_.contains(whole.enters)) return false;
    std::array<int, 2> ends{whole.leaves, whole.enters};
    if (worth(ends[1]) < worth(ends[0])) std::swap(ends[0], ends[1]);
    return merge(ends[0], HUGE_VAL) || merge(ends[1], HUGE_VAL);
  }

  /// The triangles at a point and those that are one with it.
  std::vector<std::size_t> triangles_at(int n) const {
    std::vector<std::size_t> triangles = at_.at(n);
    if (const auto found = groups_.find(n); found != groups_.end())
      for (const int m : found->second) triangles.insert(triangles.end(), at_.at(m).begin(), at_.at(m).end());
    return triangles;
  }

  /// Its neighbours along the curve, nearest first.
  std::vector<std::pair<double, int>> neighbours(int n, const std::vector<std::size_t>& triangles) const {
    std::vector<std::pair<double, int>> ways;
    for (const std::size_t t : triangles) {
      const Piece whole = piece(mesh_.triangles[t]);
      for (const int other : {whole.leaves, whole.enters})
        if (other != n) ways.emplace_back((mesh_.vertices[other] - mesh_.vertices[n]).norm(), other);
    }
    std::sort(ways.begin(), ways.end());
    ways.erase(std::unique(ways.begin(), ways.end()), ways.end());
    return ways;
  }

  /// Whether no more than three points are left of its closed curve.
  bool is_of_three(int n) const {
    const auto along = neighbours(n, triangles_at(n));
    if (along.size() < 2) return true;
    const auto beyond = neighbours(along[0].second, triangles_at(along[0].second));
    return std::any_of(beyond.begin(), beyond.end(), [&along](const auto& way) { return way.second == along[1].second; });
  }

  /// Makes a point one with its nearest neighbour on the curve, at most so far away, that has its place there unless neither has.
  /// Nothing may be folded by that, and three points are to be left of each closed curve. Vertices stay themselves.
  bool merge(int n, double most_mm) {
    if (is_vertex(n) || separate_.contains(n)) return false;
    const std::vector<std::size_t> triangles = triangles_at(n);
    std::vector<int> group{n};
    if (const auto found = groups_.find(n); found != groups_.end())
      group.insert(group.end(), found->second.begin(), found->second.end());
    for (const auto& [length, other] : neighbours(n, triangles)) {
      if (length >= most_mm || (before_.contains(n) && !before_.contains(other))) continue;
      for (const int m : group) merged_[m] = other;
      std::vector<std::size_t> around = triangles_at(other);
      around.insert(around.end(), triangles.begin(), triangles.end());
      const auto is_worse = [this](std::size_t t) {
        const Piece left = piece(mesh_.triangles[t]);
        return is_folded(t) || lacks_wall(left, options_.error_mm) || (keeps_chords_ && lacks_cap(left));
      };
      if ((may_close_ || neighbours(other, around).size() >= 2) && std::none_of(triangles.begin(), triangles.end(), is_worse)) {
        std::vector<int>& joined = groups_[other];
        joined.insert(joined.end(), group.begin(), group.end());
        groups_.erase(n);
        return true;
      }
      for (const int m : group) merged_[m] = n;
      merged_.erase(n);
    }
    return false;
  }

  bool take_back(int n) {
    const auto place = before_.find(n);
    if (place == before_.end()) return false;
    mesh_.vertices[n] = f_.nearest(place->second);
    before_.erase(place);
    return true;
  }

  /// Whether every edge is still of two triangles where points were merged; notes where it is not.
  bool look_at_merged(const Mesh& cut) {
    spoilt_.clear();
    if (groups_.empty()) return true;
    std::set<std::array<int, 2>> sides;
    std::set<std::array<int, 3>> triangles;
    for (const Eigen::Vector3i& v : cut.triangles) {
      std::array<int, 3> corners{v[0], v[1], v[2]};
      if (std::none_of(corners.begin(), corners.end(), [this](int n) { return groups_.contains(n); })) continue;
      bool is_new = sides.insert({v[0], v[1]}).second;
      is_new = sides.insert({v[1], v[2]}).second && is_new;
      is_new = sides.insert({v[2], v[0]}).second && is_new;
      std::sort(corners.begin(), corners.end());
      is_new = triangles.insert(corners).second && is_new;
      if (!is_new) spoilt_.insert(v.begin(), v.end());
    }
    return spoilt_.empty();
  }

  /// Notes points that others were merged into where triangles cross, and how many pairs do.
  void note_crossings(const Mesh& cut) {
    if (groups_.empty()) return;
    const auto is_near = [&cut](std::size_t t, const std::vector<char>& marked) {
      const Eigen::Vector3i& v = cut.triangles[t];
      return marked[v[0]] || marked[v[1]] || marked[v[2]];
    };
    std::vector<char> is_merged(cut.vertices.size(), 0);
    for (const auto& [n, group] : groups_) is_merged[n] = 1;
    std::vector<char> around = is_merged;
    for (std::size_t t = 0; t < cut.triangles.size(); ++t)
      if (is_near(t, is_merged))
        for (const int n : cut.triangles[t]) around[n] = 1;
    Mesh local;
    local.vertices = cut.vertices;
    for (std::size_t t = 0; t < cut.triangles.size(); ++t)
      if (is_near(t, around)) local.triangles.push_back(cut.triangles[t]);
    const TrianglePairs pairs = crossing_pairs(local, close_pairs(local));
    crossings_ = pairs.size();
    for (const auto& [s, t] : pairs)
      for (const int triangle : {s, t})
        for (const int n : local.triangles[triangle])
          if (is_merged[n]) spoilt_.insert(n);
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
          if (next.contains(n) && !is_settled && options_.surface)
            result.off_mm = std::max(result.off_mm, std::abs(land_.height(cut.vertices[n])));
          result.on.push_back(next.contains(n) && is_settled    ? On::crease
                              : next.contains(n) || t >= pieces ? On::cap
                                                                : On::surface);
          result.is_new.push_back(!is_vertex(n) || is_new_[n] || snapped_[n]);
        }
        n = number[n];
      }
      result.mesh.triangles.push_back(v);
    }
    return result;
  }

  Mesh mesh_;
  bool keeps_chords_;
  std::vector<double> value_;
  std::vector<char> is_new_, is_moved_;
  const Quadric& f_;
  const QuadricClipOptions& options_;
  QuadricLanding land_;
  std::vector<char> snapped_;
  std::set<int> tangled_;   ///< points at which curves cross
  std::set<int> spoilt_;    ///< points at which edges are of more than two triangles because of what was merged
  std::set<int> separate_;  ///< points that are not merged into others
  std::size_t crossings_ = 0;
  bool may_close_ = false;
  std::vector<std::size_t> cut_;                      ///< triangles in which f changes its sign
  std::map<int, std::vector<std::size_t>> at_;        ///< those at each point of the curve
  std::unordered_map<int, int> merged_;               ///< points that are one with another one
  std::unordered_map<int, std::vector<int>> groups_;  ///< the same from there
  std::unordered_map<std::uint64_t, int> crossing_;
  std::unordered_map<int, Vector3d> before_;  ///< where points of the cut were before they were moved onto the curve
};

/// Splits triangles at the curve that leave the surface.
void keep_to_surface(const Mesh& mesh, QuadricRefiner& refiner, const Quadric& f, const QuadricClipOptions& options,
                     Landed& landed) {
  constexpr int kRounds = 8;
  if (!options.surface) return;
  for (int round = 0; round < kRounds; ++round) {
    Cutter cutter(mesh, refiner, f, options, false);
    if (refiner.land(cutter.place(landed))) {
      landed = {};
      continue;
    }
    const std::vector<std::size_t> thin = cutter.thin();
    if (thin.empty() || !refiner.split(thin)) return;
  }
}

/// Splits triangles in which the curve does not find its place until it does, or that no longer helps.
Cutter placed(const Mesh& mesh, QuadricRefiner& refiner, const Quadric& f, const QuadricClipOptions& options, bool keeps_chords) {
  constexpr int kRounds = 12;
  constexpr int kPatience = 2;  // rounds in which what has no place does not become that much less
  constexpr double kLess = 0.9;
  std::optional<Cutter> best;
  Landed landed;
  keep_to_surface(mesh, refiner, f, options, landed);
  double least_mm = HUGE_VAL;
  int patience = kPatience;
  for (int round = 0; round < kRounds && patience > 0; ++round) {
    Cutter cutter(mesh, refiner, f, options, keeps_chords);
    const std::vector<std::size_t> folds = cutter.place(landed);
    const double length_mm = cutter.length_in(folds);
    --patience;
    if (!best || length_mm < kLess * least_mm) {
      best.emplace(std::move(cutter));
      least_mm = length_mm;
      patience = kPatience;
    }
    if (folds.empty() || !options.surface) break;
    if (refiner.land(folds))
      landed = {};
    else if (!refiner.split(folds))
      break;
  }
  return std::move(*best);
}

/// @returns none where what it bounds cannot be capped
std::optional<QuadricClipped> cut_along(const Mesh& mesh, QuadricRefiner& refiner, const Quadric& f,
                                        const QuadricClipOptions& options, bool keeps_chords) {
  constexpr int kRounds = 3;
  for (int round = 0;; ++round) {
    Cutter cutter = placed(mesh, refiner, f, options, keeps_chords);
    std::optional<QuadricClipped> result;
    std::size_t fewest = 0;
    std::vector<std::size_t> tangled;
    for (const bool may_close : {false, true}) {
      do {
        cutter.settle(may_close);
        if (auto cut = cutter.assemble(); cut && (!result || cutter.crossings() < fewest)) {
          result = std::move(cut);
          fewest = cutter.crossings();
        }
        if (result && fewest == 0) return result;
        if (tangled.empty()) tangled = cutter.tangled();
      } while (cutter.untangle());
      if (result) return result;
    }
    // A triangle's number stays that of a part of it.
    if (round == kRounds || !options.surface || !refiner.split(tangled)) return std::nullopt;
  }
}

/// Where curves are nearer to each other than the surfaces are to their mesh: on the mesh itself they do not cross.
std::optional<QuadricClipped> cut_on_mesh(const Mesh& mesh, QuadricRefiner& refiner, const Quadric& f,
                                          const QuadricClipOptions& options) {
  Cutter cutter = placed(mesh, refiner, f, options, false);
  cutter.take_back_all();
  return cutter.assemble();
}

}  // namespace

std::optional<QuadricClipped> clip_by_quadric(const Mesh& mesh, const Quadric& f, const QuadricClipOptions& options) {
  Mesh refined = mesh;
  QuadricRefiner refiner(refined, f, options);
  refiner.run();
  // Chords on flat walls are long: caps along those that leave the quadric face both ways. But what may not become one with a
  // neighbour is left where it is.
  std::optional<QuadricClipped> result;
  for (const bool keeps_chords : {true, false}) {
    if (keeps_chords && !options.keeps_chords) continue;
    std::optional<QuadricClipped> cut = cut_along(refined, refiner, f, options, keeps_chords);
    if (cut && (!result || cut->off_mm < result->off_mm)) result = std::move(cut);
    if (!options.surface || (result && result->off_mm <= options.error_mm)) break;
  }
  if (!result) result = cut_on_mesh(refined, refiner, f, options);
  if (!result) return result;
  const auto is_whole = [](QuadricClipped::On on) { return on == QuadricClipped::On::surface; };
  if (std::all_of(result->on.begin(), result->on.end(), is_whole) && holds_ellipsoid(mesh, f)) {
    append_ellipsoid(f, options.error_mm, result->mesh);
    result->on.resize(result->mesh.vertices.size(), QuadricClipped::On::cap);
    result->is_new.resize(result->mesh.vertices.size(), 1);
  }
  return result;
}

}  // namespace rayrep
