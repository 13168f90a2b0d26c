#include "make/ridges.h"

#include <tbb/parallel_for.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "make/take_back.h"
#include "mesh/mesh_edges.h"

namespace rayrep::detail {
namespace {

/// Where a vertex is, and its plane.
struct Tangent {
  Eigen::Vector3d at;
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< zero: out of reach
};

std::vector<std::vector<int>> neighbours_of(const Mesh& mesh) {
  std::vector<std::vector<int>> neighbours(mesh.vertices.size());
  for (const Eigen::Vector3i& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) neighbours[static_cast<std::size_t>(t[k])].push_back(t[(k + 1) % 3]);
  return neighbours;
}

/// Whether the surface folds outward between two points.
bool folds(const Tangent& a, const Tangent& b) {
  const double kSharp = std::cos(0.5);
  return b.normal != Eigen::Vector3d::Zero() && a.normal.dot(b.normal) < kSharp && (b.at - a.at).dot(b.normal - a.normal) > 0;
}

/// Where the planes come nearest to meeting; where they leave that open, near `start`.
Eigen::Vector3d meeting_point(const Eigen::Vector3d& start, const std::vector<Tangent>& planes) {
  Eigen::Matrix3d normals = Eigen::Matrix3d::Zero();
  Eigen::Vector3d off = Eigen::Vector3d::Zero();
  for (const Tangent& plane : planes) {
    normals += plane.normal * plane.normal.transpose();
    off += plane.normal * plane.normal.dot(plane.at - start);
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(normals);
  constexpr double kFlat = 0.05;
  Eigen::Vector3d to = Eigen::Vector3d::Zero();
  for (int k = 0; k < 3; ++k)
    if (solver.eigenvalues()[k] > kFlat * solver.eigenvalues()[2])
      to += solver.eigenvectors().col(k) * (solver.eigenvectors().col(k).dot(off) / solver.eigenvalues()[k]);
  return start + to;
}

/// Moved outward or inward along the middle of the planes' normals until it is the wall from the surface.
Eigen::Vector3d at_wall(Eigen::Vector3d p, const std::vector<Tangent>& planes, const SurfaceQuery& surface, double wall_mm) {
  Eigen::Vector3d out = Eigen::Vector3d::Zero();
  for (const Tangent& plane : planes) out += plane.normal;
  out.normalize();
  constexpr int kSteps = 3;
  for (int step = 0; step < kSteps; ++step) {
    const ClosestPoint closest = surface.closest(p, 2 * wall_mm);
    if (closest.triangle < 0 || closest.distance_mm <= 0) break;
    const double towards = out.dot(closest.point_mm - p) / closest.distance_mm;
    if (towards < 0.2) break;
    p += out * ((closest.distance_mm - wall_mm) / towards);
  }
  return p;
}

/// Of vertices that would come together, from both sides of a ridge, the nearest one goes there, the others stay.
void move_one_row(const Mesh& before, const std::vector<Eigen::Vector3d>& to, const std::vector<std::vector<int>>& neighbours,
                  Mesh& mesh) {
  const std::vector<Eigen::Vector3d>& from = before.vertices;
  std::vector<std::pair<double, int>> order;
  for (std::size_t n = 0; n < to.size(); ++n)
    if (to[n] != from[n] && mesh.vertices[n] == from[n]) order.emplace_back((to[n] - from[n]).squaredNorm(), static_cast<int>(n));
  std::sort(order.begin(), order.end());
  for (const auto& [squared, n] : order) {
    const bool taken = std::any_of(neighbours[n].begin(), neighbours[n].end(), [&, n = n](int other) {
      return mesh.vertices[other] != from[other] &&
             (to[n] - to[other]).squaredNorm() < 0.25 * (from[n] - from[other]).squaredNorm();
    });
    if (!taken) mesh.vertices[n] = to[n];
  }
}

/// Takes back moves that turn triangles over.
void take_back(const Mesh& before, const std::vector<Tangent>& tangents, Mesh& mesh) {
  const auto turned_over = [&](std::size_t t) {
    const Eigen::Vector3i& v = mesh.triangles[t];
    const Eigen::Vector3d out = tangents[v[0]].normal + tangents[v[1]].normal + tangents[v[2]].normal;
    return !(twice_area(mesh, t).dot(out) > 0.05 * twice_area(before, t).norm());
  };
  take_back_where(turned_over, before, mesh);
}

int corner_beside(const Eigen::Vector3i& t, int a, int b) { return t[0] + t[1] + t[2] - a - b; }

/// A side from one flank of a ridge to the other, between two corners on it.
struct Bridge {
  Eigen::Vector2i flanks, ridge;
  std::array<std::size_t, 2> triangles;
};

/// The triangles beside it, with the side along the ridge instead.
std::array<Eigen::Vector3i, 2> turned(const Mesh& mesh, const Bridge& bridge) {
  std::array<Eigen::Vector3i, 2> triangles;
  for (const int k : {0, 1}) {
    // Of the triangle with flank a, in which b comes after or before it, b becomes the other corner on the ridge.
    triangles[k] = mesh.triangles[bridge.triangles[k]];
    std::replace(triangles[k].begin(), triangles[k].end(), bridge.flanks[1 - k], bridge.ridge[1 - k]);
  }
  return triangles;
}

/// Whether every triangle faces as the flank does that it has a corner on, and more so than before.
bool is_better(const Mesh& mesh, const Bridge& bridge, const std::vector<Tangent>& tangents) {
  const auto towards = [&](const Eigen::Vector3i& t, int flank) {
    const auto& v = mesh.vertices;
    const Eigen::Vector3d twice = (v[t[1]] - v[t[0]]).cross(v[t[2]] - v[t[0]]);
    return twice.norm() > 0 ? twice.normalized().dot(tangents[flank].normal) : -1.0;
  };
  const std::array<Eigen::Vector3i, 2> after = turned(mesh, bridge);
  for (const int k : {0, 1})
    if (towards(after[k], bridge.flanks[k]) < std::max(0.7, towards(mesh.triangles[bridge.triangles[k]], bridge.flanks[k])))
      return false;
  return true;
}

/// Sides that lead over a ridge from flank to flank, between two corners that have come to lie on it, are laid along it.
void lay_along(const Mesh& before, const std::vector<Tangent>& tangents, Mesh& mesh) {
  const auto on_ridge = [&](int v) { return mesh.vertices[v] != before.vertices[v]; };
  std::vector<Bridge> bridges;
  for_each_edge(mesh, [&](auto begin, auto end) {
    if (end - begin != 2) return;
    const int a = begin->low, b = begin->high;
    if (on_ridge(a) || on_ridge(b) || !folds(tangents[a], tangents[b])) return;
    const std::array<std::size_t, 2> sides = {static_cast<std::size_t>(begin->triangle),
                                              static_cast<std::size_t>((begin + 1)->triangle)};
    const int c = corner_beside(mesh.triangles[sides[0]], a, b), d = corner_beside(mesh.triangles[sides[1]], a, b);
    if (on_ridge(c) && on_ridge(d)) bridges.push_back({{a, b}, {c, d}, sides});
  });
  std::vector<std::vector<int>> neighbours = neighbours_of(mesh);
  std::vector<char> used(mesh.triangles.size(), 0);
  for (const Bridge& bridge : bridges) {
    const auto& [s, t] = bridge.triangles;
    const std::vector<int>& beside = neighbours[bridge.ridge[0]];
    if (used[s] || used[t] || std::find(beside.begin(), beside.end(), bridge.ridge[1]) != beside.end()) continue;
    if (!is_better(mesh, bridge, tangents)) continue;
    const std::array<Eigen::Vector3i, 2> after = turned(mesh, bridge);
    mesh.triangles[s] = after[0];
    mesh.triangles[t] = after[1];
    used[s] = used[t] = 1;
    neighbours[bridge.ridge[0]].push_back(bridge.ridge[1]);
    neighbours[bridge.ridge[1]].push_back(bridge.ridge[0]);
  }
}

}  // namespace

void sharpen_ridges(Mesh& mesh, const SurfaceQuery& surface, double wall_mm, double cell_mm) {
  const Mesh before = mesh;
  std::vector<Tangent> tangents(mesh.vertices.size());
  tbb::parallel_for(std::size_t{0}, tangents.size(), [&](std::size_t n) {
    tangents[n].at = before.vertices[n];
    const ClosestPoint closest = surface.closest(before.vertices[n], wall_mm + cell_mm);
    if (closest.triangle < 0 || closest.distance_mm <= 0) return;
    if (std::abs(closest.distance_mm - wall_mm) > 0.1 * cell_mm) return;  // on another surface
    tangents[n].normal = (closest.point_mm - before.vertices[n]) / closest.distance_mm;
    // The plane of the offset surface itself.
    tangents[n].at += (closest.distance_mm - wall_mm) * tangents[n].normal;
  });
  const std::vector<std::vector<int>> neighbours = neighbours_of(mesh);
  constexpr double kFarthest = 2;
  std::vector<Eigen::Vector3d> to = before.vertices;
  tbb::parallel_for(std::size_t{0}, tangents.size(), [&](std::size_t n) {
    bool on_ridge = false;
    std::vector<Tangent> planes{tangents[n]};
    for (const int other : neighbours[n]) {
      const Tangent& tangent = tangents[static_cast<std::size_t>(other)];
      on_ridge = on_ridge || folds(tangents[n], tangent);
      if (tangent.normal != Eigen::Vector3d::Zero()) planes.push_back(tangent);
    }
    if (!on_ridge || tangents[n].normal == Eigen::Vector3d::Zero()) return;
    const Eigen::Vector3d found = at_wall(meeting_point(tangents[n].at, planes), planes, surface, wall_mm);
    if ((found - before.vertices[n]).norm() <= kFarthest * cell_mm) to[n] = found;
  });
  // Where a vertex could not go, one beside it can.
  constexpr int kTries = 3;
  for (int n = 0; n < kTries; ++n) {
    move_one_row(before, to, neighbours, mesh);
    const Mesh moved = mesh;
    take_back(before, tangents, mesh);
    for (std::size_t v = 0; v < to.size(); ++v)
      if (mesh.vertices[v] != moved.vertices[v]) to[v] = before.vertices[v];
  }
  lay_along(before, tangents, mesh);
}

}  // namespace rayrep::detail
