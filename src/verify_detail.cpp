#include "verify_detail.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <unordered_map>
#include <utility>
#include <vector>

#include "rayrep/error.h"
#include "rayrep/mesh_check.h"
#include "rayrep/surface_query.h"

namespace rayrep::verify_detail {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// ---------------------------------------------------------------------------------------------------------------- the triangles

// Which triangles of two meshes are the same, with coordinates as float32 (what STL keeps) and corners in any order.
struct Match {
  std::vector<bool> delivered;       // is one of the original's
  std::vector<std::size_t> missing;  // of the original
};

Match match(const Mesh& delivered, const Mesh& original) {
  using Corner = std::array<float, 3>;
  struct Hash {
    std::size_t operator()(const Corner& c) const {
      std::uint64_t hash = 0;
      for (const float x : c) hash = (hash ^ std::bit_cast<std::uint32_t>(x)) * 0x9e3779b97f4a7c15u;
      return hash ^ hash >> 32;
    }
  };
  std::unordered_map<Corner, int, Hash> corners;
  corners.reserve(original.vertices.size());
  const auto key = [&corners](const Mesh& mesh, std::size_t t) {
    std::array<int, 3> numbers;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3f p = mesh.corner(t, k).cast<float>().array() + 0.0f;  // -0 becomes 0
      numbers[k] = corners.try_emplace({p.x(), p.y(), p.z()}, static_cast<int>(corners.size())).first->second;
    }
    std::sort(numbers.begin(), numbers.end());
    return numbers;
  };
  std::map<std::array<int, 3>, std::vector<std::size_t>> expected;
  for (std::size_t t = 0; t < original.triangles.size(); ++t) expected[key(original, t)].push_back(t);
  Match result;
  for (std::size_t t = 0; t < delivered.triangles.size(); ++t) {
    const auto found = expected.find(key(delivered, t));
    const bool is_known = found != expected.end() && !found->second.empty();
    if (is_known) found->second.pop_back();
    result.delivered.push_back(is_known);
  }
  for (const auto& [corner, left] : expected) result.missing.insert(result.missing.end(), left.begin(), left.end());
  std::sort(result.missing.begin(), result.missing.end());
  return result;
}

// ------------------------------------------------------------------------------------------------------------------- the shells

enum class ShellKind {
  outer,       // bounds material from outside, or overlaps other material
  cavity,      // faces inward, inside material
  island,      // faces outward, inside a cavity
  inside_out,  // faces inward, not inside anything
};

struct Shell {
  std::vector<int> triangles;
  ShellKind kind = ShellKind::outer;
};

// The triangles known to be outer surface, and the shells made of all others.
struct Shells {
  std::vector<int> of_triangle;  // -1: known
  std::vector<Shell> shells;
};

Mesh part(const Mesh& mesh, const std::vector<int>& triangles) {
  Mesh result;
  result.vertices = mesh.vertices;
  for (const int t : triangles) result.triangles.push_back(mesh.triangles[t]);
  return result;
}

double signed_volume(const Mesh& mesh, const std::vector<int>& triangles) {
  const Eigen::Vector3d& reference = mesh.corner(triangles.front(), 0);
  double volume = 0;
  for (const int t : triangles)
    volume += (mesh.corner(t, 0) - reference).dot((mesh.corner(t, 1) - reference).cross(mesh.corner(t, 2) - reference)) / 6;
  return volume;
}

// Vertices of some triangles, each once, ascending.
std::vector<int> vertices_of(const Mesh& mesh, const std::vector<int>& triangles) {
  std::vector<int> vertices;
  for (const int t : triangles) vertices.insert(vertices.end(), mesh.triangles[t].begin(), mesh.triangles[t].end());
  std::sort(vertices.begin(), vertices.end());
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  return vertices;
}

// The hits of the vertical line through p, by every triangle where the quick answer does not close.
void closed_line_hits(const SurfaceQuery& surface, const Eigen::Vector3d& p, std::vector<LineHit>& hits) {
  surface.line_hits(p.head<2>(), hits);
  int sum = 0;
  for (const LineHit& hit : hits) sum += hit.sign;
  if (sum != 0) surface.line_hits_brute_force(p.head<2>(), hits);
}

// What lies around a point of a shell, the shell itself left aside.
struct Surroundings {
  int winding = 0;        // > 0: material
  bool enclosed = false;  // something goes around it, be it material or a cavity
};

Surroundings surroundings(const SurfaceQuery& surface, const Shells& all, int shell, const Eigen::Vector3d& p) {
  std::vector<LineHit> hits;
  closed_line_hits(surface, p, hits);
  std::map<int, int> windings;
  for (const LineHit& hit : hits)
    if (const int other = all.of_triangle[hit.triangle]; other != shell && hit.z_mm < p.z()) windings[other] += hit.sign;
  Surroundings result;
  for (const auto& [other, winding] : windings) {
    result.winding += winding;
    result.enclosed = result.enclosed || winding != 0;
  }
  return result;
}

Shells find_shells(const Mesh& mesh, const std::vector<bool>& known, const Progress& progress) {
  Mesh rest = mesh;
  std::vector<int> back;
  rest.triangles.clear();
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (!known[t]) {
      rest.triangles.push_back(mesh.triangles[t]);
      back.push_back(static_cast<int>(t));
    }
  const Components components = connected_components(rest);
  Shells result;
  result.of_triangle.assign(mesh.triangles.size(), -1);
  result.shells.resize(components.count);
  for (std::size_t i = 0; i < back.size(); ++i) {
    result.of_triangle[back[i]] = components.of_triangle[i];
    result.shells[components.of_triangle[i]].triangles.push_back(back[i]);
  }

  const SurfaceQuery surface(mesh);
  for (int s = 0; s < components.count; ++s) {
    progress.check();
    Shell& shell = result.shells[s];
    const bool inward = signed_volume(mesh, shell.triangles) < 0;
    const Surroundings around = surroundings(surface, result, s, mesh.corner(shell.triangles.front(), 0));
    if (inward) {
      shell.kind = around.winding > 0 ? ShellKind::cavity : ShellKind::inside_out;
    } else if (around.enclosed && around.winding <= 0) {
      // A strut that reaches from a cavity into the wall is no island: every vertex must lie in the open.
      const std::vector<int> vertices = vertices_of(mesh, shell.triangles);
      const bool free = std::all_of(vertices.begin(), vertices.end(),
                                    [&](int v) { return surroundings(surface, result, s, mesh.vertices[v]).winding <= 0; });
      shell.kind = free ? ShellKind::island : ShellKind::outer;
    }
  }
  return result;
}

// Smallest distance from the cavities' vertices to the outer surface, negative where one lies outside of it.
double smallest_wall(const Mesh& mesh, const std::vector<int>& cavity_vertices, const Mesh& outer, const Progress& progress) {
  if (cavity_vertices.empty()) return kInfinity;
  const SurfaceQuery surface(outer);
  const double diagonal = bounding_box(mesh).diagonal().norm();
  constexpr std::size_t block = 512;
  constexpr std::size_t blocks_at_once = 32;
  double smallest = kInfinity;
  for (std::size_t first = 0; first < cavity_vertices.size(); first += block * blocks_at_once) {
    progress.check();
    // Fixed blocks, each with what is known from the blocks before: nothing depends on the number of threads.
    std::vector<double> found(blocks_at_once, smallest);
    tbb::parallel_for(std::size_t{0}, blocks_at_once, [&](std::size_t b) {
      std::vector<LineHit> hits;
      const std::size_t end = std::min(first + (b + 1) * block, cavity_vertices.size());
      for (std::size_t i = first + b * block; i < end; ++i) {
        const Eigen::Vector3d& p = mesh.vertices[cavity_vertices[i]];
        closed_line_hits(surface, p, hits);
        int winding = 0;
        for (const LineHit& hit : hits)
          if (hit.z_mm < p.z()) winding += hit.sign;
        const bool inside = winding > 0;
        if (inside && found[b] <= 0) continue;
        const double distance = surface.closest(p, inside ? std::min(found[b], diagonal) : diagonal).distance_mm;
        found[b] = std::min(found[b], inside ? distance : -distance);
      }
    });
    smallest = *std::min_element(found.begin(), found.end());
  }
  return smallest;
}

double largest_distance(const std::vector<Eigen::Vector3d>& points, const Mesh& from) {
  const SurfaceQuery surface(from);
  const double diagonal = bounding_box(from).diagonal().norm();
  double largest = 0;
  for (const auto& p : points) largest = std::max(largest, surface.closest(p, diagonal).distance_mm);
  return largest;
}

// How far the outer surface has moved: the original's triangles that are gone against the delivered surface, and what was added
// outside against the original.
double outer_deviation(const Mesh& mesh, const Mesh& original, const std::vector<std::size_t>& missing, const Shells& shells) {
  std::vector<Eigen::Vector3d> gone;
  for (const std::size_t t : missing) {
    for (int k = 0; k < 3; ++k) gone.push_back(original.corner(t, k));
    gone.push_back((original.corner(t, 0) + original.corner(t, 1) + original.corner(t, 2)) / 3);  // a hole leaves its corners
  }
  std::vector<Eigen::Vector3d> added;
  for (const Shell& shell : shells.shells)
    if (shell.kind == ShellKind::outer)
      for (const int v : vertices_of(mesh, shell.triangles)) added.push_back(mesh.vertices[v]);
  const double lost = gone.empty() ? 0 : largest_distance(gone, mesh);
  const double gained = added.empty() ? 0 : largest_distance(added, original);
  return std::max(lost, gained);
}

}  // namespace

Criterion at_most(std::string name, std::string description, double value, double limit) {
  return {std::move(name), std::move(description), value, limit, Criterion::Kind::at_most};
}

Criterion at_least(std::string name, std::string description, double value, double limit) {
  return {std::move(name), std::move(description), value, limit, Criterion::Kind::at_least};
}

Mesh merged_mesh(const Mesh& mesh) {
  Mesh merged = with_merged_vertices(mesh);
  const auto finite = [](const Eigen::Vector3d& v) { return v.allFinite(); };
  if (merged.triangles.empty() || !std::all_of(merged.vertices.begin(), merged.vertices.end(), finite))
    throw Error(ErrorCode::input, "The mesh has no triangles, or coordinates that are not finite.");
  return merged;
}

std::size_t unbalanced_edges(const Mesh& mesh) {
  std::vector<std::pair<std::uint64_t, int>> runs;
  runs.reserve(3 * mesh.triangles.size());
  for (const auto& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(t[k], t[(k + 1) % 3]);
      if (low != high)
        runs.emplace_back(static_cast<std::uint64_t>(low) << 32 | static_cast<std::uint64_t>(high), t[k] == low ? 1 : -1);
    }
  std::sort(runs.begin(), runs.end());
  std::size_t count = 0;
  for (std::size_t i = 0; i < runs.size();) {
    int balance = 0;
    const std::uint64_t edge = runs[i].first;
    for (; i < runs.size() && runs[i].first == edge; ++i) balance += runs[i].second;
    count += balance != 0;
  }
  return count;
}

Mesh material_of(const Mesh& mesh, bool closed, const Progress& progress) {
  return closed ? boundary_of_union(mesh, progress) : mesh;
}

MassProperties mass_properties_of(const Mesh& mesh, double density_g_cm3) {
  const Eigen::Vector3d centre = mesh.vertices.empty() ? Eigen::Vector3d::Zero() : Eigen::Vector3d(bounding_box(mesh).center());
  MassProperties body =
      mass_properties(mesh_moments(transformed(mesh, Eigen::Affine3d(Eigen::Translation3d(-centre)))), density_g_cm3);
  body.centre_of_mass_mm += centre;
  return body;
}
double lowest_along(const Mesh& mesh, const Eigen::Vector3d& up) {
  double lowest = kInfinity;
  for (const auto& v : mesh.vertices) lowest = std::min(lowest, up.dot(v));
  return lowest;
}

Surface judge_surface(const Mesh& delivered, const Mesh* original, const Progress& progress, Verdict& verdict) {
  Surface surface;
  surface.mesh = merged_mesh(delivered);
  const Mesh& mesh = surface.mesh;
  const Eigen::AlignedBox3d box = bounding_box(mesh);
  surface.diagonal_mm = box.diagonal().norm();
  surface.float32_mm = std::ldexp(box.min().cwiseAbs().cwiseMax(box.max().cwiseAbs()).maxCoeff(), -23);
  verdict.bad_edges = unbalanced_edges(mesh);

  Match matched;
  matched.delivered.assign(mesh.triangles.size(), false);
  if (original) matched = match(mesh, *original);
  if (!matched.missing.empty()) {
    // Then a triangle that is not the original's may be a moved one: whatever hangs together with the original is outer surface.
    const Components components = connected_components(mesh);
    std::vector<bool> holds_original(components.count, false);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
      if (matched.delivered[t]) holds_original[components.of_triangle[t]] = true;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) matched.delivered[t] = holds_original[components.of_triangle[t]];
  }
  const Shells shells = find_shells(mesh, matched.delivered, progress);

  std::vector<int> outer_triangles;
  std::vector<int> cavity_triangles;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const int s = shells.of_triangle[t];
    const ShellKind kind = s < 0 ? ShellKind::outer : shells.shells[s].kind;
    if (kind == ShellKind::outer) outer_triangles.push_back(static_cast<int>(t));
    if (kind == ShellKind::cavity) cavity_triangles.push_back(static_cast<int>(t));
  }
  for (const Shell& shell : shells.shells) {
    verdict.cavities += shell.kind == ShellKind::cavity;
    verdict.solid_islands += shell.kind == ShellKind::island;
    if (shell.kind == ShellKind::inside_out) surface.inside_out_edges += shell.triangles.size() * 3 / 2;
  }
  surface.outer = part(mesh, outer_triangles);
  verdict.smallest_wall_mm = smallest_wall(mesh, vertices_of(mesh, cavity_triangles), surface.outer, progress);
  if (original) verdict.outer_deviation_mm = outer_deviation(mesh, *original, matched.missing, shells);
  return surface;
}

void add_surface_criteria(const Surface& surface, bool has_original, double wall_mm, double wall_ratio, Verdict& verdict) {
  if (verdict.bad_edges > 0) verdict.notes.push_back("The surface is not closed: the other figures take it as it is.");
  if (surface.inside_out_edges > 0) verdict.notes.push_back("A part of the surface faces inward and lies inside nothing.");

  auto& criteria = verdict.criteria;
  criteria.push_back(at_most("closed", "edges that are open or face the wrong way",
                             static_cast<double>(verdict.bad_edges + surface.inside_out_edges), 0));
  if (has_original)
    criteria.push_back(
        at_most("outer_unchanged", "change of the outer surface, mm", verdict.outer_deviation_mm, surface.float32_mm));
  criteria.push_back(
      at_most("no_islands", "pieces of material loose inside a cavity", static_cast<double>(verdict.solid_islands), 0));
  if (wall_mm > 0 && verdict.cavities > 0)
    criteria.push_back(at_least("wall", "thinnest wall, over the wall asked for", verdict.smallest_wall_mm / wall_mm, wall_ratio));
}

}  // namespace rayrep::verify_detail
