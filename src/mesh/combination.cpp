#include "mesh/combination.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <unordered_map>
#include <utility>

#include "base/union_find.h"
#include "mesh/crossing.h"
#include "mesh/cut_group.h"
#include "mesh/float32.h"
#include "mesh/mesh_edges.h"
#include "mesh/predicates.h"

// In four steps, theory.md (91): which triangles meet; those that nothing meets, in patches joined over sides of two of them, are
// settled by one probe for each patch; all others are cut in their planes (cut_group); what is kept is put together by the rounded
// places of its corners. A corner is an exact point wherever it is found, so that rounding makes it the same for all.

namespace rayrep {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

bool coplanar(const Mesh& mesh, std::size_t s, std::size_t t) {
  for (int k = 0; k < 3; ++k)
    if (orient3d(mesh.corner(s, 0), mesh.corner(s, 1), mesh.corner(s, 2), mesh.corner(t, k)) != 0) return false;
  return true;
}

class Combination {
public:
  Combination(Operands all, const TrianglePairs& close, const BooleanOptions& options, const Progress& progress)
      : options_(options),
        progress_(progress),
        operands_(std::move(all)),
        numbers_(operands_.mesh.vertices),
        cutters_(find_meetings(close)),
        windings_(operands_, numbers_),
        arrangement_{operands_, {options.operation}, cutters_, numbers_, windings_} {}

  CombinedMesh run() {
    find_groups();
    settle_patches();
    cut_groups();
    return assemble();
  }

private:
  std::size_t size() const { return operands_.mesh.triangles.size(); }

  /// Which triangles meet: in one plane, or else they cut each other.
  std::vector<std::vector<int>> find_meetings(const TrianglePairs& close) {
    const TrianglePairs pairs = crossing_pairs(operands_.mesh, close);
    std::vector<char> flat(pairs.size());
    tbb::parallel_for(std::size_t{0}, pairs.size(), [&](std::size_t n) {
      flat[n] = coplanar(operands_.mesh, static_cast<std::size_t>(pairs[n].first), static_cast<std::size_t>(pairs[n].second));
    });
    UnionFind groups(static_cast<int>(size()));
    std::vector<std::vector<int>> cutters(size());
    for (std::size_t n = 0; n < pairs.size(); ++n) {
      const auto [s, t] = pairs[n];
      if (flat[n]) {
        groups.unite(s, t);
      } else {
        cutters[static_cast<std::size_t>(s)].push_back(t);
        cutters[static_cast<std::size_t>(t)].push_back(s);
      }
    }
    for (int t = 0; t < static_cast<int>(size()); ++t) operands_.group.push_back(groups.root(t));
    tbb::parallel_for(std::size_t{0}, size(), [&](std::size_t t) {
      std::sort(cutters[t].begin(), cutters[t].end(), [this](int a, int b) {
        const int ka = operands_.operand[static_cast<std::size_t>(a)], kb = operands_.operand[static_cast<std::size_t>(b)];
        return ka != kb ? ka < kb : a < b;
      });
    });
    return cutters;
  }

  void find_groups() {
    members_.resize(size());
    for (std::size_t t = 0; t < size(); ++t) members_[static_cast<std::size_t>(operands_.group[t])].push_back(static_cast<int>(t));
    met_.assign(size(), 0);
    for (std::size_t t = 0; t < size(); ++t)
      met_[t] = !cutters_[t].empty() || members_[static_cast<std::size_t>(operands_.group[t])].size() > 1;
  }

  template <typename Body>
  void in_batches(std::size_t count, std::size_t batch, const Body& body) const {
    for (std::size_t begin = 0; begin < count; begin += batch) {
      progress_.check();
      tbb::parallel_for(tbb::blocked_range<std::size_t>(begin, std::min(begin + batch, count), 1), [&body](const auto& range) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) body(i);
      });
    }
  }

  double area(std::size_t t) const {
    const Vector3d& a = operands_.mesh.corner(t, 0);
    return (operands_.mesh.corner(t, 1) - a).cross(operands_.mesh.corner(t, 2) - a).squaredNorm();
  }

  /// Patches of triangles that nothing meets: the windings beside them are the same all over.
  void settle_patches() {
    UnionFind patches(static_cast<int>(size()));
    for_each_edge(operands_.mesh, [&](auto begin, auto end) {
      const int s = begin->triangle, t = (end - 1)->triangle;
      if (end - begin == 2 && !met_[static_cast<std::size_t>(s)] && !met_[static_cast<std::size_t>(t)] &&
          begin->direction != (end - 1)->direction)
        patches.unite(s, t);
    });
    std::vector<int> largest(size(), -1);
    std::vector<int> roots;
    for (std::size_t t = 0; t < size(); ++t) {
      if (met_[t]) continue;
      int& n = largest[static_cast<std::size_t>(patches.root(static_cast<int>(t)))];
      if (n < 0) roots.push_back(patches.root(static_cast<int>(t)));
      if (n < 0 || area(t) > area(static_cast<std::size_t>(n))) n = static_cast<int>(t);
    }
    std::vector<signed char> fate(size(), 0);
    in_batches(roots.size(), 256, [&](std::size_t i) {
      const auto root = static_cast<std::size_t>(roots[i]);
      fate[root] = fate_of(largest[root]);
    });
    fate_.resize(size());
    for (std::size_t t = 0; t < size(); ++t)
      if (!met_[t]) fate_[t] = fate[static_cast<std::size_t>(patches.root(static_cast<int>(t)))];
  }

  /// Of a triangle that nothing meets: 1 kept, -1 kept and turned, 0 dropped.
  signed char fate_of(int t) const {
    const Vector3i& v = arrangement_.corners(t);
    const ExactPoint a = arrangement_.exact(v[0]), b = arrangement_.exact(v[1]), c = arrangement_.exact(v[2]);
    const Probe probe(a, b, c, best_axis(a.near, b.near, c.near));
    const int k = operands_.operand[static_cast<std::size_t>(t)];
    const Beside beside = windings_.beside(k, probe, operands_.group[static_cast<std::size_t>(t)]);
    const bool below = arrangement_.rule.holds(k, beside.below);
    const bool above = arrangement_.rule.holds(k, beside.below + beside.step);
    if (below == above || !arrangement_.others_hold(probe, {k})) return 0;
    return arrangement_.rule.solid(below) == (windings_.facing(t, probe.axis()) > 0) ? 1 : -1;
  }

  void cut_groups() {
    std::vector<int> groups;
    for (std::size_t t = 0; t < size(); ++t)
      if (met_[t] && operands_.group[t] == static_cast<int>(t)) groups.push_back(static_cast<int>(t));
    parts_.resize(size());
    in_batches(groups.size(), 256, [&](std::size_t i) {
      const auto g = static_cast<std::size_t>(groups[i]);
      parts_[g] = cut_group(arrangement_, members_[g]);
    });
  }

  using Place = std::array<double, 3>;
  struct PlaceHash {
    std::size_t operator()(const Place& p) const {
      std::size_t hash = 0;
      for (const double x : p) hash = (hash ^ std::hash<double>()(x)) * 0x9E3779B97F4A7C15u + (hash >> 29);
      return hash;
    }
  };
  static Place place_of(const Vector3d& p) { return {p.x() + 0.0, p.y() + 0.0, p.z() + 0.0}; }

  int vertex_at(const Vector3d& p) {
    const auto [place, is_new] = vertices_.try_emplace(place_of(p), static_cast<int>(result_.mesh.vertices.size()));
    if (is_new) result_.mesh.vertices.push_back(p);
    return place->second;
  }

  void add(std::array<Vector3d, 3> corners, int source, bool whole) {
    if (options_.float32)
      for (Vector3d& p : corners) p = as_float32(p);
    const auto& [a, b, c] = corners;
    if (a == b || b == c || c == a) return;
    const Vector3i triangle{vertex_at(a), vertex_at(b), vertex_at(c)};  // braces: in this order
    result_.mesh.triangles.push_back(triangle);
    const auto n = static_cast<std::size_t>(source);
    result_.sources.push_back({operands_.operand[n], operands_.number[n], whole});
  }

  std::array<Vector3d, 3> corners_of(const BoundaryPart& part, const BoundaryPart::Triangle& piece) const {
    const auto point = [&part](int k) { return part.points[static_cast<std::size_t>(k)]; };
    return {point(piece.point[0]), point(piece.point[1]), point(piece.point[2])};
  }

  bool is_corner(const Vector3d& p, std::size_t t) const {
    for (int k = 0; k < 3; ++k)
      if (operands_.mesh.corner(t, k) == p) return true;
    return false;
  }

  /// Whether what meets in a point between their corners is one triangle, or two on a side that they share.
  bool in_one_side(const std::vector<int>& triangles) const {
    if (triangles.size() != 2) return triangles.size() == 1;
    int shared = 0;
    for (const int v : arrangement_.corners(triangles[0])) shared += (arrangement_.corners(triangles[1]).array() == v).any();
    return shared == 2;
  }

  /// Triangles that were cut in vain: all of their pieces are kept, and nothing else that is kept needs the points in between.
  void find_uncut() {
    for (const BoundaryPart& part : parts_)
      for (const BoundaryPart::Whole& whole : part.whole) fate_[static_cast<std::size_t>(whole.triangle)] = whole.turned ? -1 : 1;
    std::unordered_map<Place, std::vector<int>, PlaceHash> cut_at;  // of them, those with a point between their corners
    std::vector<Vector3d> needed;
    for (const BoundaryPart& part : parts_)
      for (const BoundaryPart::Triangle& piece : part.triangles)
        for (const Vector3d& p : corners_of(part, piece)) {
          if (fate_[static_cast<std::size_t>(piece.source)] == 0)
            needed.push_back(p);
          else if (!is_corner(p, static_cast<std::size_t>(piece.source)))
            cut_at[place_of(p)].push_back(piece.source);
        }
    for (std::size_t t = 0; t < size(); ++t)
      if (fate_[t] != 0)
        for (int k = 0; k < 3; ++k) needed.push_back(operands_.mesh.corner(t, k));
    std::unordered_map<int, std::vector<Vector3d>> points;
    for (auto& [place, triangles] : cut_at) {
      std::sort(triangles.begin(), triangles.end());
      triangles.erase(std::unique(triangles.begin(), triangles.end()), triangles.end());
      const Vector3d p(place[0], place[1], place[2]);
      for (const int t : triangles) points[t].push_back(p);
      if (!in_one_side(triangles)) needed.push_back(p);
    }
    while (!needed.empty()) {
      const auto found = cut_at.find(place_of(needed.back()));
      needed.pop_back();
      if (found == cut_at.end()) continue;
      const std::vector<int> triangles = std::move(found->second);
      cut_at.erase(found);
      for (const int t : triangles) {
        if (fate_[static_cast<std::size_t>(t)] == 0) continue;
        fate_[static_cast<std::size_t>(t)] = 0;
        needed.insert(needed.end(), points[t].begin(), points[t].end());
      }
    }
  }

  /// Operands that do not meet are mostly kept as they are.
  bool all_kept() const {
    return !options_.float32 && std::all_of(fate_.begin(), fate_.end(), [](signed char fate) { return fate > 0; });
  }

  CombinedMesh assemble() {
    if (all_kept()) {
      for (std::size_t t = 0; t < size(); ++t) result_.sources.push_back({operands_.operand[t], operands_.number[t], true});
      result_.mesh = std::move(operands_.mesh);
      return std::move(result_);
    }
    find_uncut();
    for (std::size_t t = 0; t < size(); ++t) {
      const auto corner = [&](int k) { return operands_.mesh.corner(t, k); };
      if (fate_[t] > 0) add({corner(0), corner(1), corner(2)}, static_cast<int>(t), true);
      if (fate_[t] < 0) add({corner(0), corner(2), corner(1)}, static_cast<int>(t), true);
      for (const BoundaryPart::Triangle& piece : parts_[t].triangles)
        if (fate_[static_cast<std::size_t>(piece.source)] == 0) add(corners_of(parts_[t], piece), piece.source, false);
    }
    return std::move(result_);
  }

  const BooleanOptions& options_;
  const Progress& progress_;
  Operands operands_;
  ExactNumbers numbers_;
  std::vector<std::vector<int>> cutters_;
  Windings windings_;
  Arrangement arrangement_;
  std::vector<std::vector<int>> members_;  ///< of each group
  std::vector<char> met_;                  ///< by others, beyond shared corners and sides
  std::vector<signed char> fate_;          ///< of triangles that are kept as they are (1) or turned (-1)
  std::vector<BoundaryPart> parts_;        ///< of each group
  std::unordered_map<Place, int, PlaceHash> vertices_;
  CombinedMesh result_;
};

}  // namespace

CombinedMesh combination(Operands all, const TrianglePairs& close, const BooleanOptions& options, const Progress& progress) {
  return Combination(std::move(all), close, options, progress).run();
}

}  // namespace rayrep
