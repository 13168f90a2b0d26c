#include "rayrep/mesh/boolean.h"

#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include "base/text.h"
#include "base/union_find.h"
#include "mesh/close_pairs.h"
#include "mesh/combination.h"
#include "mesh/crossing.h"
#include "mesh/mesh_edges.h"
#include "mesh/point_tree.h"
#include "mesh/polygon.h"
#include "mesh/predicates.h"
#include "rayrep/base/error.h"

namespace rayrep {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

/// Corners of triangles that rounding made cross are joined where they are as near as so many times the rounding, at most.
constexpr double kFarthestJoined = 10000;

Error bad_operand(std::size_t operand, const std::string& what) {
  return Error(ErrorCode::input, concat("Mesh ", operand + 1, " of those to be combined ", what));
}

void require_finite(const Mesh& mesh, std::size_t operand) {
  for (const Vector3d& v : mesh.vertices)
    if (!v.allFinite()) throw bad_operand(operand, "has coordinates that are no numbers. Export it anew.");
}

/// @throws Error{input} where the triangles of an operand do not close
void require_closed(const Operands& all) {
  for_each_edge(all.mesh, [&](auto begin, auto end) {
    while (begin != end) {
      const int k = all.operand[static_cast<std::size_t>(begin->triangle)];
      int balance = 0;
      for (; begin != end && all.operand[static_cast<std::size_t>(begin->triangle)] == k; ++begin) balance += begin->direction;
      if (balance == 0) continue;
      const EdgeUse& use = *(begin - 1);
      throw bad_operand(static_cast<std::size_t>(k),
                        concat("is not closed: the edge from ", shown(all.mesh.vertices[static_cast<std::size_t>(use.low)]), " to ",
                               shown(all.mesh.vertices[static_cast<std::size_t>(use.high)]),
                               " has an open side. Close its holes first, in your modelling program or by check_mesh."));
    }
  });
}

/// All triangles over common vertices; those of no area, which bound nothing, are left out once the rest is known to close.
Operands joined(std::span<const Mesh> meshes) {
  Operands all;
  all.count = static_cast<int>(meshes.size());
  for (std::size_t k = 0; k < meshes.size(); ++k) {
    require_finite(meshes[k], k);
    append(all.mesh, meshes[k]);
    for (std::size_t t = 0; t < meshes[k].triangles.size(); ++t) {
      all.operand.push_back(static_cast<int>(k));
      all.number.push_back(static_cast<int>(t));
    }
  }
  all.mesh = with_merged_vertices(all.mesh);
  require_closed(all);
  std::size_t kept = 0;
  for (std::size_t t = 0; t < all.mesh.triangles.size(); ++t) {
    if (collinear(all.mesh.corner(t, 0), all.mesh.corner(t, 1), all.mesh.corner(t, 2))) continue;
    all.mesh.triangles[kept] = all.mesh.triangles[t];
    all.operand[kept] = all.operand[t];
    all.number[kept++] = all.number[t];
  }
  all.mesh.triangles.resize(kept);
  all.operand.resize(kept);
  all.number.resize(kept);
  return all;
}

/// What rounding has done to a mesh.
struct Flaws {
  TrianglePairs crossings;
  std::vector<int> flat;

  std::size_t size() const { return crossings.size() + flat.size(); }
  std::vector<int> triangles() const {
    std::vector<int> found = flat;
    for (const auto& [s, t] : crossings) found.insert(found.end(), {s, t});
    return found;
  }
};

/// Whether every edge is run as often one way as the other. One repair in 10^5 random pairs, of triangles as small as the rounding,
/// was not closed; such a one is not taken.
bool is_closed(const Mesh& mesh) {
  bool closed = true;
  for_each_edge(mesh, [&closed](auto begin, auto end) { closed = closed && edge_balance(begin, end) == 0; });
  return closed;
}

Flaws flaws_of(const Mesh& mesh, const Progress& progress) {
  Flaws flaws{crossing_pairs(mesh, close_pairs(mesh, progress)), {}};
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (collinear(mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2))) flaws.flat.push_back(static_cast<int>(t));
  return flaws;
}

/// Joins corners of triangles with flaws that are within reach of each other, to the first of them, and splits sides of such
/// triangles at corners within reach of them. A closed surface stays so.
class CornerJoiner {
public:
  CornerJoiner(const CombinedMesh& given, const Flaws& flaws, double reach_mm)
      : given_(given),
        reach_mm_(reach_mm),
        flawed_(flaws.triangles()),
        corners_(corners()),
        tree_(given.mesh.vertices, corners_),
        joined_(static_cast<int>(given.mesh.vertices.size())) {}

  CombinedMesh run() {
    for (const int v : corners_) {
      tree_.near_segment(place(v), place(v), reach_mm_, near_);
      for (const int other : near_) joined_.unite(v, other);
    }
    for (const int t : flawed_)
      for (int k = 0; k < 3; ++k) split_side(ends_of(triangle(t), k));
    CombinedMesh result{{given_.mesh.vertices, {}}, {}};
    for (std::size_t t = 0; t < given_.mesh.triangles.size(); ++t) {
      const std::vector<int> polygon = polygon_of(given_.mesh.triangles[t]);
      if (polygon.size() < 3) continue;
      append_triangulated(polygon, result.mesh);
      CombinedMesh::Source source = given_.sources[t];
      source.whole = source.whole && polygon.size() == 3 && result.mesh.triangles.back() == given_.mesh.triangles[t];
      result.sources.resize(result.mesh.triangles.size(), source);
    }
    return result;
  }

private:
  using Side = std::pair<int, int>;  ///< its ends, the lower first

  const Vector3d& place(int v) const { return given_.mesh.vertices[static_cast<std::size_t>(v)]; }
  const Vector3i& triangle(int t) const { return given_.mesh.triangles[static_cast<std::size_t>(t)]; }

  std::vector<int> corners() const {
    std::vector<int> found;
    for (const int t : flawed_)
      for (const int v : triangle(t)) found.push_back(v);
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
    return found;
  }

  Side ends_of(const Vector3i& t, int k) { return std::minmax({joined_.root(t[k]), joined_.root(t[(k + 1) % 3])}); }

  void split_side(const Side& side) {
    if (side.first == side.second || on_side_.contains(side)) return;
    const Vector3d &a = place(side.first), &b = place(side.second);
    tree_.near_segment(a, b, reach_mm_, near_);
    std::vector<std::pair<double, int>> along;
    for (const int v : near_)
      if (const int r = joined_.root(v); r != side.first && r != side.second)
        along.emplace_back(on_segment(place(r), a, b).along, r);
    std::sort(along.begin(), along.end());
    along.erase(std::unique(along.begin(), along.end()), along.end());
    std::vector<int>& found = on_side_[side];
    for (const auto& [distance, v] : along) found.push_back(v);
  }

  /// A triangle with what its sides are split at; less than three corners where it has gone.
  std::vector<int> polygon_of(const Vector3i& t) {
    std::vector<int> polygon;
    for (int k = 0; k < 3; ++k) {
      const Side ends = ends_of(t, k);
      if (ends.first == ends.second) continue;
      polygon.push_back(joined_.root(t[k]));
      const auto found = on_side_.find(ends);
      if (found == on_side_.end()) continue;
      if (polygon.back() == ends.first)
        polygon.insert(polygon.end(), found->second.begin(), found->second.end());
      else
        polygon.insert(polygon.end(), found->second.rbegin(), found->second.rend());
    }
    return polygon;
  }

  const CombinedMesh& given_;
  double reach_mm_;
  std::vector<int> flawed_, corners_;
  PointTree tree_;
  UnionFind joined_;
  std::map<Side, std::vector<int>> on_side_;  ///< corners that lie on a side, from its lower end on
  std::vector<int> near_;
};

CombinedMesh combined_once(std::span<const Mesh> meshes, const BooleanOptions& options, const Progress& progress) {
  Operands all = joined(meshes);
  const TrianglePairs close = close_pairs(all.mesh, progress);
  return combination(std::move(all), close, options, progress);
}

/// A mesh with flaws, its corners joined, taken as a solid once more.
CombinedMesh repaired(const CombinedMesh& flawed, bool float32, const Progress& progress) {
  CombinedMesh result = combined_once({&flawed.mesh, 1}, {.operation = BooleanOperation::unite, .float32 = float32}, progress);
  for (CombinedMesh::Source& source : result.sources) {
    const CombinedMesh::Source& first = flawed.sources[static_cast<std::size_t>(source.triangle)];
    source = {first.operand, first.triangle, first.whole && source.whole};
  }
  return result;
}

}  // namespace

CombinedMesh combined(std::span<const Mesh> meshes, const BooleanOptions& options, const Progress& progress) {
  CombinedMesh result = combined_once(meshes, options, progress);
  Flaws flaws = flaws_of(result.mesh, progress);
  const Eigen::AlignedBox3d box = bounding_box(result.mesh);
  const double rounding_mm = float32_spacing_mm(box) * (options.float32 ? 1 : 0x1p-29);
  for (double reach = 2; flaws.size() > 0 && reach <= kFarthestJoined; reach *= 4) {
    CombinedMesh next = repaired(CornerJoiner(result, flaws, reach * rounding_mm).run(), options.float32, progress);
    Flaws left = flaws_of(next.mesh, progress);
    if (left.size() >= flaws.size() || !is_closed(next.mesh)) continue;
    result = std::move(next);
    flaws = std::move(left);
  }
  result.crossings = flaws.crossings.size();
  result.flat = flaws.flat.size();
  return result;
}

}  // namespace rayrep
