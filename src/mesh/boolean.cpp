#include "rayrep/mesh/boolean.h"

#include <Eigen/Geometry>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "base/text.h"
#include "mesh/close_pairs.h"
#include "mesh/combination.h"
#include "mesh/corner_joiner.h"
#include "mesh/crossing.h"
#include "mesh/mesh_edges.h"
#include "mesh/part.h"
#include "mesh/predicates.h"
#include "mesh/shells.h"
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

/// What `combination` left, and what rounding did to it.
struct Rounded {
  CombinedMesh combined;
  Flaws flaws;
};

/// Looks for corners to join that leave a mesh without flaws. Each step takes what it is given, joined, as a solid once more and
/// rounds that, so that it may leave more flaws and the next one none; of all steps, of which there are so many at most, the best
/// is kept.
class RoundingRepair {
public:
  RoundingRepair(Rounded given, const BooleanOptions& options, const Progress& progress)
      : best_(std::move(given)),
        float32_(options.float32),
        rounding_mm_(float32_spacing_mm(bounding_box(best_.combined.mesh)) * (float32_ ? 1 : 0x1p-29)),
        progress_(progress) {}

  Rounded run() {
    const Rounded given = best_;
    for (double reach = 2; flawed() && reach <= kFarthestJoined; reach *= 4) step(best_, {reach * rounding_mm_}, most_after(best_));
    if (!flawed()) return std::move(best_);
    const Rounded first = without_plates(given);
    best_ = without_plates(best_);
    if (first.flaws.size() < best_.flaws.size()) best_ = first;
    for (const bool at_crossings : {true, false}) follow_all(best_, at_crossings);
    for (const bool at_crossings : {true, false}) follow_all(first, at_crossings);
    return std::move(best_);
  }

private:
  bool flawed() const { return best_.flaws.size() > 0; }

  /// How many flaws a mesh may have on the way from another one: what grows faster does so without end.
  static std::size_t most_after(const Rounded& given) { return 10 * given.flaws.size() + 100; }

  void follow_all(const Rounded& given, bool at_crossings) {
    const double farthest = kFarthestJoined * (float32_ ? 1 : 100);
    for (double first = 2; first <= farthest; first *= 16) {
      std::optional<Rounded> current = given;
      for (double reach = first; flawed() && current && reach <= farthest; reach *= 4)
        current = step(*current, {reach * rounding_mm_, at_crossings}, most_after(given));
    }
  }

  /// A mesh with flaws, its corners joined, taken as a solid once more; kept if nothing better was found so far.
  /// @return  nothing where it has more than `most` flaws before or after that, or is not closed
  std::optional<Rounded> step(const Rounded& given, const Joining& joining, std::size_t most) {
    const CombinedMesh mesh = with_joined_corners(given.combined, given.flaws, joining);
    Operands all = joined({&mesh.mesh, 1});
    const TrianglePairs close = close_pairs(all.mesh, progress_);
    if (crossing_pairs(all.mesh, close).size() > most) return std::nullopt;
    Rounded next{combination(std::move(all), close, {.operation = BooleanOperation::unite, .float32 = float32_}, progress_), {}};
    for (CombinedMesh::Source& source : next.combined.sources) {
      const CombinedMesh::Source& before = mesh.sources[static_cast<std::size_t>(source.triangle)];
      source = {before.operand, before.triangle, before.whole && source.whole};
    }
    next.flaws = flaws_of(next.combined.mesh, progress_);
    if (next.flaws.size() > most || !is_closed(next.combined.mesh)) return std::nullopt;
    if (next.flaws.size() < best_.flaws.size()) best_ = next;
    return next;
  }

  /// Without what has flaws and is on the mean thinner than the rounding: nothing says that it is there at all.
  Rounded without_plates(const Rounded& given) const {
    const Mesh& mesh = given.combined.mesh;
    const Components parts = connected_components(mesh);
    const auto count = static_cast<std::size_t>(parts.count);
    const std::vector<double> volumes = shell_volumes(mesh, parts.of_triangle, parts.count);
    std::vector<double> areas(count, 0);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
      areas[static_cast<std::size_t>(parts.of_triangle[t])] +=
          (mesh.corner(t, 1) - mesh.corner(t, 0)).cross(mesh.corner(t, 2) - mesh.corner(t, 0)).norm() / 2;
    std::vector<char> drop(count, 0);
    for (const int t : given.flaws.triangles()) {
      const auto n = static_cast<std::size_t>(parts.of_triangle[static_cast<std::size_t>(t)]);
      drop[n] = 2 * std::abs(volumes[n]) <= rounding_mm_ * areas[n];
    }
    std::vector<int> kept;
    Rounded result;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      if (drop[static_cast<std::size_t>(parts.of_triangle[t])]) continue;
      kept.push_back(static_cast<int>(t));
      result.combined.sources.push_back(given.combined.sources[t]);
    }
    if (kept.size() == mesh.triangles.size()) return given;
    result.combined.mesh = part(mesh, kept);
    result.flaws = flaws_of(result.combined.mesh, progress_);
    return result;
  }

  Rounded best_;
  bool float32_;
  double rounding_mm_;
  const Progress& progress_;
};

}  // namespace

CombinedMesh combined(std::span<const Mesh> meshes, const BooleanOptions& options, const Progress& progress) {
  Operands all = joined(meshes);
  const TrianglePairs close = close_pairs(all.mesh, progress);
  Rounded result{combination(std::move(all), close, options, progress), {}};
  result.flaws = flaws_of(result.combined.mesh, progress);
  if (result.flaws.size() > 0) result = RoundingRepair(std::move(result), options, progress).run();
  result.combined.crossings = result.flaws.crossings.size();
  result.combined.flat = result.flaws.flat.size();
  return std::move(result.combined);
}

}  // namespace rayrep
