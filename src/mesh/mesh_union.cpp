#include "mesh/mesh_union.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <utility>

#include "base/union_find.h"
#include "mesh/combination.h"
#include "mesh/crossing.h"
#include "mesh/mesh_edges.h"
#include "mesh/predicates.h"
#include "rayrep/mesh/mesh_check.h"

// The union of the parts of a mesh is that of solids of their own where each part has no negative winding number: a closed part
// that does not cross itself and faces outward, and is nowhere near one of which that is not known. Those and what is near them are
// one solid. With many solids what lies deep inside some is left out early, see theory.md (91).

namespace rayrep {
namespace {

/// Triangles that hang together over sides of two of them.
struct Part {
  double volume = 0;
  bool closed = true;
  bool crosses_itself = false;
  Eigen::AlignedBox3d box;
};

class UnionOfParts {
public:
  UnionOfParts(const Mesh& mesh, const TrianglePairs& crossings) : part_(mesh.triangles.size()) {
    find_parts(mesh);
    measure(mesh);
    find_faults(mesh, crossings);
  }

  bool is_one_plain_body() const { return parts_.size() == 1 && is_plain(parts_[0]); }

  /// Of each triangle; the first is of all that has to stay together.
  std::vector<int> operands(int& count) const {
    std::vector<Eigen::AlignedBox3d> doubtful;
    Eigen::AlignedBox3d around_open;  // what is not closed may be so together
    for (const Part& part : parts_) {
      if (part.closed && !is_plain(part)) doubtful.push_back(part.box);
      if (!part.closed) around_open.extend(part.box);
    }
    if (!around_open.isEmpty()) doubtful.push_back(around_open);
    constexpr std::size_t most_comparisons = 10'000'000;
    const bool all = doubtful.size() * parts_.size() > most_comparisons;
    count = doubtful.empty() ? 0 : 1;
    std::vector<int> number(parts_.size(), 0);
    for (std::size_t n = 0; n < parts_.size(); ++n) {
      const bool together = all || std::any_of(doubtful.begin(), doubtful.end(),
                                               [&](const Eigen::AlignedBox3d& box) { return box.intersects(parts_[n].box); });
      if (!together) number[n] = count++;
    }
    std::vector<int> result;
    for (const int p : part_) result.push_back(number[static_cast<std::size_t>(p)]);
    return result;
  }

private:
  static bool is_plain(const Part& part) { return part.closed && !part.crosses_itself && part.volume > 0; }

  void find_parts(const Mesh& mesh) {
    UnionFind joined(static_cast<int>(part_.size()));
    for_each_edge(mesh, [&](auto begin, auto end) {
      if (end - begin == 2) joined.unite(begin->triangle, (end - 1)->triangle);
    });
    for (std::size_t t = 0; t < part_.size(); ++t) {
      const auto root = static_cast<std::size_t>(joined.root(static_cast<int>(t)));
      if (root == t) {
        part_[t] = static_cast<int>(parts_.size());
        parts_.emplace_back();
      } else {
        part_[t] = part_[root];
      }
    }
  }

  Part& part_of(int t) { return parts_[static_cast<std::size_t>(part_[static_cast<std::size_t>(t)])]; }

  void measure(const Mesh& mesh) {
    for (std::size_t t = 0; t < part_.size(); ++t)
      for (int k = 0; k < 3; ++k) part_of(static_cast<int>(t)).box.extend(mesh.corner(t, k));
    for (std::size_t t = 0; t < part_.size(); ++t) {
      Part& part = part_of(static_cast<int>(t));
      const Eigen::Vector3d origin = part.box.center();
      part.volume += (mesh.corner(t, 0) - origin).dot((mesh.corner(t, 1) - origin).cross(mesh.corner(t, 2) - origin));
    }
  }

  void find_faults(const Mesh& mesh, const TrianglePairs& crossings) {
    for (const auto& [s, t] : crossings)
      if (part_[static_cast<std::size_t>(s)] == part_[static_cast<std::size_t>(t)]) part_of(s).crosses_itself = true;
    for_each_edge(mesh, [&](auto begin, auto end) {
      for (auto use = begin; use != end; ++use) {
        int balance = 0;
        for (auto other = begin; other != end; ++other)
          if (part_[static_cast<std::size_t>(other->triangle)] == part_[static_cast<std::size_t>(use->triangle)])
            balance += other->direction;
        if (balance != 0) part_of(use->triangle).closed = false;
      }
    });
  }

  std::vector<int> part_;  ///< of each triangle
  std::vector<Part> parts_;
};

}  // namespace

Mesh boundary_of_union(const Mesh& mesh, const Progress& progress) {
  return boundary_of_union(mesh, close_pairs(mesh, progress), progress);
}

Mesh boundary_of_union(const Mesh& mesh, const TrianglePairs& close, const Progress& progress) {
  Operands all;
  all.mesh = with_merged_vertices(mesh);
  const bool merged = all.mesh.vertices.size() == mesh.vertices.size();
  std::size_t kept = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (!collinear(mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2))) {
      all.mesh.triangles[kept++] = all.mesh.triangles[t];
      all.number.push_back(static_cast<int>(t));
    }
  all.mesh.triangles.resize(kept);
  const bool as_given = merged && kept == mesh.triangles.size();
  const TrianglePairs crossings = crossing_pairs(all.mesh, as_given ? close : close_pairs(all.mesh, progress));
  const UnionOfParts parts(all.mesh, crossings);
  if (mesh.triangles.empty() || (crossings.empty() && parts.is_one_plain_body())) return mesh;
  all.operand = parts.operands(all.count);
  CombinedMesh result = combination(std::move(all), crossings, {.operation = BooleanOperation::unite}, progress);
  const bool unchanged = result.sources.size() == kept &&
                         std::all_of(result.sources.begin(), result.sources.end(), [](const auto& s) { return s.whole; });
  if (unchanged) return mesh;
  return std::move(result.mesh);
}

}  // namespace rayrep
