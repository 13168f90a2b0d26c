#include "mesh/corner_joiner.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "base/union_find.h"
#include "mesh/point_tree.h"
#include "mesh/polygon.h"

namespace rayrep {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

class CornerJoiner {
public:
  CornerJoiner(const CombinedMesh& given, const Flaws& flaws, const Joining& joining)
      : given_(given),
        reach_mm_(joining.reach_mm),
        crossings_(joining.at_crossings ? flaws.crossings : TrianglePairs()),
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
    for (const auto& [s, t] : crossings_)
      for (int n = 0; n < 9; ++n) split_both(ends_of(triangle(s), n / 3), ends_of(triangle(t), n % 3));
    for (auto& [side, stops] : on_side_) std::sort(stops.begin(), stops.end());
    CombinedMesh result{{given_.mesh.vertices, {}}, {}};
    result.mesh.vertices.insert(result.mesh.vertices.end(), passes_at_.begin(), passes_at_.end());
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
  using Side = std::pair<int, int>;     ///< its ends, the lower first
  using Stop = std::pair<double, int>;  ///< how far along a side from its lower end, and which corner

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
    std::vector<Stop>& stops = on_side_[side];
    for (const int v : near_)
      if (const int r = joined_.root(v); r != side.first && r != side.second)
        stops.emplace_back(on_segment(place(r), a, b).along, r);
    std::sort(stops.begin(), stops.end());
    stops.erase(std::unique(stops.begin(), stops.end()), stops.end());
  }

  bool stops_near(const Side& side, double along) const {
    const std::vector<Stop>& stops = on_side_.at(side);
    return std::any_of(stops.begin(), stops.end(), [&](const Stop& stop) { return std::abs(stop.first - along) < reach_mm_; });
  }

  /// Where two sides pass each other within reach, away from their ends.
  void split_both(const Side& a, const Side& b) {
    const std::set<int> ends{a.first, a.second, b.first, b.second};
    if (ends.size() < 4 || !passed_.insert(std::minmax(a, b)).second) return;
    const Vector3d p = place(a.first), u = place(a.second) - p;
    const Vector3d q = place(b.first), v = place(b.second) - q;
    const Vector3d across = u.cross(v);
    const double squared = across.squaredNorm();
    if (!(squared > 0) || std::abs((q - p).dot(across)) > reach_mm_ * std::sqrt(squared)) return;
    const double x = (q - p).cross(v).dot(across) / squared, y = (q - p).cross(u).dot(across) / squared;
    const double along_a = x * u.norm(), along_b = y * v.norm();
    const auto between = [this](double along, double length) { return along > reach_mm_ && along < length - reach_mm_; };
    if (!between(along_a, u.norm()) || !between(along_b, v.norm())) return;
    if (stops_near(a, along_a) || stops_near(b, along_b)) return;
    const int corner = static_cast<int>(given_.mesh.vertices.size() + passes_at_.size());
    passes_at_.push_back((p + x * u + q + y * v) / 2);
    on_side_.at(a).emplace_back(along_a, corner);
    on_side_.at(b).emplace_back(along_b, corner);
  }

  /// A triangle with what its sides are split at; less than three corners where it has gone.
  std::vector<int> polygon_of(const Vector3i& t) {
    std::vector<int> polygon;
    const auto add = [&polygon](const Stop& stop) { polygon.push_back(stop.second); };
    for (int k = 0; k < 3; ++k) {
      const Side ends = ends_of(t, k);
      if (ends.first == ends.second) continue;
      polygon.push_back(joined_.root(t[k]));
      const auto found = on_side_.find(ends);
      if (found == on_side_.end()) continue;
      if (polygon.back() == ends.first)
        std::for_each(found->second.begin(), found->second.end(), add);
      else
        std::for_each(found->second.rbegin(), found->second.rend(), add);
    }
    return polygon;
  }

  const CombinedMesh& given_;
  double reach_mm_;
  TrianglePairs crossings_;  ///< whose sides are split where they pass each other
  std::vector<int> flawed_, corners_;
  PointTree tree_;
  UnionFind joined_;
  std::map<Side, std::vector<Stop>> on_side_;  ///< what it is split at
  std::set<std::pair<Side, Side>> passed_;     ///< looked at
  std::vector<Vector3d> passes_at_;            ///< new corners
  std::vector<int> near_;
};

}  // namespace

CombinedMesh with_joined_corners(const CombinedMesh& given, const Flaws& flaws, const Joining& joining) {
  return CornerJoiner(given, flaws, joining).run();
}

}  // namespace rayrep
