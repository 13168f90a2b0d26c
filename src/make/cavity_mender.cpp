#include "make/cavity_mender.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "mesh/crossing.h"
#include "mesh/surface_gap.h"

namespace rayrep::detail {
namespace {

using Eigen::Vector3d;

/// The shares of a triangle's corners in a point of it.
Vector3d shares(const Corners3& t, const Vector3d& p) {
  const Vector3d normal = (t[1] - t[0]).cross(t[2] - t[0]);
  const double area2 = normal.squaredNorm();
  Vector3d share = Vector3d::Constant(1.0 / 3);
  if (!(area2 > 1e-10 * (t[1] - t[0]).squaredNorm() * (t[2] - t[0]).squaredNorm())) return share;
  for (int k = 0; k < 3; ++k) {
    const auto next = static_cast<std::size_t>((k + 1) % 3);
    const auto last = static_cast<std::size_t>((k + 2) % 3);
    share[k] = std::clamp((t[next] - p).cross(t[last] - p).dot(normal) / area2, 0.0, 1.0);
  }
  return share;
}

bool is_at(const Mesh& mesh, int triangle, const std::vector<char>& marked) {
  const Eigen::Vector3i& v = mesh.triangles[triangle];
  return (marked[v[0]] | marked[v[1]] | marked[v[2]]) != 0;
}

std::vector<int> triangles_at(const Mesh& mesh, const std::vector<char>& marked) {
  std::vector<int> triangles;
  for (int t = 0; t < static_cast<int>(mesh.triangles.size()); ++t)
    if (is_at(mesh, t, marked)) triangles.push_back(t);
  return triangles;
}

void mark_corners(const Mesh& mesh, const std::vector<int>& triangles, std::vector<char>& marked) {
  for (const int t : triangles)
    for (const int v : mesh.triangles[t]) marked[v] = 1;
}

/// Moves the marked vertices half the way to the middle of those around them.
/// @param most  how far: at most as many times as it is to the nearest of them
void relax(Mesh& mesh, const std::vector<char>& marked, double most) {
  std::vector<Vector3d> sum(mesh.vertices.size(), Vector3d::Zero());
  std::vector<int> count(mesh.vertices.size(), 0);
  std::vector<double> nearest2(mesh.vertices.size(), HUGE_VAL);
  for (const auto& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) {
      if (!marked[t[k]]) continue;
      sum[t[k]] += mesh.vertices[t[(k + 1) % 3]] + mesh.vertices[t[(k + 2) % 3]];
      count[t[k]] += 2;
      nearest2[t[k]] = std::min(nearest2[t[k]], (mesh.vertices[t[(k + 1) % 3]] - mesh.vertices[t[k]]).squaredNorm());
    }
  for (std::size_t v = 0; v < marked.size(); ++v) {
    if (count[v] == 0) continue;
    const Vector3d way = 0.5 * (sum[v] / count[v] - mesh.vertices[v]);
    mesh.vertices[v] += std::min(1.0, most * std::sqrt(nearest2[v]) / way.norm()) * way;
  }
}

}  // namespace

std::vector<std::size_t> CavityMender::mend(Mesh& mesh, std::vector<char> moved, const std::vector<char>& within) const {
  constexpr int kAttempts = 8;
  constexpr std::size_t kFew = 64;
  const bool is_cut = within.empty() && std::find(moved.begin(), moved.end(), 0) != moved.end();
  const std::vector<Vector3d> before = mesh.vertices;
  thicken(mesh, moved, within);
  std::vector<std::size_t> crosses = crossing(mesh, moved);
  if (!crosses.empty() && crosses.size() <= kFew && mesh.vertices != before) take_back(mesh, moved, before, crosses);
  if (!crosses.empty() && crosses.size() <= kFew && is_cut) part_by_little(mesh, crosses);
  // Many that hardly become fewer are for the caller to close.
  auto goes_on = [&, before = 2 * crosses.size()]() mutable {
    const bool fewer = crosses.size() <= 0.7 * static_cast<double>(std::exchange(before, crosses.size()));
    return !crosses.empty() && (fewer || crosses.size() <= kFew);
  };
  for (int attempt = 0; attempt < kAttempts && goes_on(); ++attempt) {
    // Of a cut the triangles are of all sizes, and its creases are to stay where they are, if that helps.
    crosses = part(mesh, crosses, {attempt / 2, is_cut && attempt < kAttempts / 2 ? 1 : HUGE_VAL}, within);
  }
  return crosses;
}

/// Relaxes triangles that cross. @returns those that do then
std::vector<std::size_t> CavityMender::part(Mesh& mesh, const std::vector<std::size_t>& crosses, const Parting& how,
                                            const std::vector<char>& within) const {
  std::vector<char> moved(mesh.vertices.size(), 0);
  mark_corners(mesh, std::vector<int>(crosses.begin(), crosses.end()), moved);
  for (int ring = 0; ring < how.rings; ++ring) mark_corners(mesh, triangles_at(mesh, moved), moved);
  relax(mesh, moved, how.most);
  thicken(mesh, moved, within);
  return crossing(mesh, moved);
}

/// Where triangles cross by little, as in rounded coordinates only; changes nothing where that does not help.
void CavityMender::part_by_little(Mesh& mesh, std::vector<std::size_t>& crosses) const {
  Mesh parted = mesh;
  std::vector<std::size_t> left = crosses;
  for (const double most : {0.1, 0.3})
    if (!left.empty()) left = part(parted, left, {0, most}, {});
  if (!left.empty()) return;
  mesh = std::move(parted);
  crosses.clear();
}

void CavityMender::thicken(Mesh& mesh, std::vector<char>& moved, const std::vector<char>& within) const {
  constexpr int kRounds = 4;
  constexpr double kLeast = 0.99;    // of the wall: what rounding may take then leaves 0.98 of it
  constexpr double kWanted = 0.995;  // where less than the least is there
  const double wall = options_.wall_mm;
  std::vector<char> changed = moved;
  std::vector<Vector3d> push(mesh.vertices.size());
  for (int round = 0; round < kRounds; ++round) {
    std::vector<int> looked_at = triangles_at(mesh, changed);
    if (!within.empty()) std::erase_if(looked_at, [&](int t) { return !is_at(mesh, t, within); });
    const std::vector<Gap> gaps = gaps_below(mesh, looked_at, surface_, kLeast * wall);
    if (gaps.empty()) return;
    std::fill(changed.begin(), changed.end(), 0);
    std::fill(push.begin(), push.end(), Vector3d::Zero());
    for (const Gap& gap : gaps) {
      if (!(gap.nearest.distance_mm > 0)) continue;
      const Vector3d inward = (gap.nearest.on_first - gap.nearest.on_second) / gap.nearest.distance_mm;
      const Vector3d share = shares(corners_of(mesh, gap.triangle), gap.nearest.on_first);
      const double missing = (kWanted * wall - gap.nearest.distance_mm) / share.squaredNorm();
      for (int k = 0; k < 3; ++k) {
        const int v = mesh.triangles[gap.triangle][k];
        push[v] += std::max(0.0, missing * share[k] - push[v].dot(inward)) * inward;
        changed[v] = moved[v] = 1;
      }
    }
    for (std::size_t v = 0; v < push.size(); ++v)
      if (changed[v]) mesh.vertices[v] += push[v];
  }
}

/// Where thickening has made triangles cross, half of it or none may do: the wall was nearly there before.
void CavityMender::take_back(Mesh& mesh, const std::vector<char>& moved, const std::vector<Vector3d>& before,
                             std::vector<std::size_t>& crosses) const {
  constexpr double kLeast = 0.982;  // of the wall
  Mesh thinner = mesh;
  std::vector<std::size_t> left = crosses;
  for (const double share : {0.5, 0.0}) {
    std::vector<char> corners(mesh.vertices.size(), 0);
    mark_corners(mesh, std::vector<int>(left.begin(), left.end()), corners);
    for (std::size_t v = 0; v < corners.size(); ++v)
      if (corners[v]) thinner.vertices[v] = before[v] + share * (mesh.vertices[v] - before[v]);
    left = crossing(thinner, moved);
    if (!gaps_below(thinner, triangles_at(thinner, corners), surface_, kLeast * options_.wall_mm).empty()) return;
    if (!left.empty()) continue;
    mesh = std::move(thinner);
    crosses.clear();
    return;
  }
}

std::vector<std::size_t> CavityMender::crossing(const Mesh& mesh, const std::vector<char>& moved) const {
  return crossing_near(options_.as_delivered ? options_.as_delivered(mesh) : mesh, moved);
}

}  // namespace rayrep::detail
