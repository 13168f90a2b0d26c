#include "judge/verify_detail.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

#include "base/text.h"
#include "base/union_find.h"
#include "judge/outer_surface.h"
#include "mesh/mesh_edges.h"
#include "mesh/shells.h"
#include "rayrep/base/error.h"
#include "rayrep/mesh/mesh_check.h"
#include "rayrep/mesh/surface_query.h"
#include "rayrep/physics/hydrostatics.h"

namespace rayrep::verify_detail {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

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

// Some triangles of a mesh, with the vertices that they use, in the order of those.
Mesh part(const Mesh& mesh, const std::vector<int>& triangles) {
  std::vector<int> number(mesh.vertices.size(), -1);
  for (const int t : triangles)
    for (const int v : mesh.triangles[t]) number[v] = 0;
  Mesh result;
  for (std::size_t v = 0; v < number.size(); ++v)
    if (number[v] == 0) {
      number[v] = static_cast<int>(result.vertices.size());
      result.vertices.push_back(mesh.vertices[v]);
    }
  result.triangles.reserve(triangles.size());
  for (const int t : triangles) {
    const Eigen::Vector3i& v = mesh.triangles[t];
    result.triangles.emplace_back(number[v[0]], number[v[1]], number[v[2]]);
  }
  return result;
}

Shells find_shells(const Mesh& mesh, const std::vector<bool>& known, const Progress& progress) {
  std::vector<int> rest;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (!known[t]) rest.push_back(static_cast<int>(t));
  const Components components = connected_components(part(mesh, rest));
  Shells result;
  result.of_triangle.assign(mesh.triangles.size(), -1);
  result.shells.resize(components.count);
  for (std::size_t i = 0; i < rest.size(); ++i) {
    result.of_triangle[rest[i]] = components.of_triangle[i];
    result.shells[components.of_triangle[i]].triangles.push_back(rest[i]);
  }

  const std::vector<double> volumes = shell_volumes(mesh, result.of_triangle, components.count);
  ShellNesting nesting(mesh, result.of_triangle);
  Surroundings around;
  for (int s = 0; s < components.count; ++s) {
    progress.check();
    Shell& shell = result.shells[s];
    nesting.around(mesh.corner(shell.triangles.front(), 0), s, around);
    if (volumes[s] < 0) {
      shell.kind = around.winding > 0 ? ShellKind::cavity : ShellKind::inside_out;
    } else if (!around.shells.empty() && around.winding <= 0) {
      // A strut that reaches from a cavity into the wall is no island: every vertex must lie in the open.
      const Mesh alone = part(mesh, shell.triangles);
      const bool free = std::all_of(alone.vertices.begin(), alone.vertices.end(), [&](const Eigen::Vector3d& v) {
        nesting.around(v, s, around);
        return around.winding <= 0;
      });
      shell.kind = free ? ShellKind::island : ShellKind::outer;
    }
  }
  return result;
}

// Calls body(begin, end, smallest) for blocks of 0 <= i < count in parallel, each with the smallest of what is known from blocks
// before; body makes that smaller. Nothing depends on the number of threads.
template <typename Body>
double smallest_over_blocks(std::size_t count, double smallest, const Progress& progress, const Body& body) {
  constexpr std::size_t block = 512;
  constexpr std::size_t blocks_at_once = 32;
  for (std::size_t first = 0; first < count; first += block * blocks_at_once) {
    progress.check();
    std::vector<double> found(blocks_at_once, smallest);
    tbb::parallel_for(std::size_t{0}, blocks_at_once, [&](std::size_t b) {
      body(std::min(first + b * block, count), std::min(first + (b + 1) * block, count), found[b]);
    });
    smallest = *std::min_element(found.begin(), found.end());
  }
  return smallest;
}

// For each vertex one that lies on the same side of a surface: ends of edges shorter than the distance of both from it do.
std::vector<int> on_the_same_side(const Mesh& mesh, double distance_mm) {
  UnionFind sides(static_cast<int>(mesh.vertices.size()));
  if (distance_mm > 0)
    for (const auto& t : mesh.triangles)
      for (int k = 0; k < 3; ++k) {
        const int a = t[k];
        const int b = t[(k + 1) % 3];
        if (a < b && (mesh.vertices[a] - mesh.vertices[b]).squaredNorm() < distance_mm * distance_mm) sides.unite(a, b);
      }
  std::vector<int> representative(mesh.vertices.size());
  for (std::size_t v = 0; v < representative.size(); ++v) representative[v] = sides.root(static_cast<int>(v));
  return representative;
}

// Smallest distance from the cavities' vertices to the outer surface, negative where one lies outside of it.
double smallest_wall(const Mesh& cavities, const Mesh& outer, const Progress& progress) {
  if (cavities.vertices.empty()) return kInfinity;
  const SurfaceQuery surface(outer);
  Eigen::AlignedBox3d box = bounding_box(outer);
  box.extend(bounding_box(cavities));
  const double diagonal = box.diagonal().norm();
  const std::size_t count = cavities.vertices.size();
  const double nearest = smallest_over_blocks(count, diagonal, progress, [&](std::size_t begin, std::size_t end, double& smallest) {
    for (std::size_t v = begin; v < end && smallest > 0; ++v)
      smallest = std::min(smallest, surface.closest(cavities.vertices[v], smallest).distance_mm);
  });
  // SurfaceQuery may be wrong about which triangle is nearest by 1e-6 of the diagonal. A surface with holes has no sides.
  const std::vector<int> representative = on_the_same_side(cavities, unbalanced_edges(outer) == 0 ? nearest - 1e-5 * diagonal : 0);
  std::vector<char> outside(count);
  smallest_over_blocks(count, 0, progress, [&](std::size_t begin, std::size_t end, double&) {
    std::vector<LineHit> hits;
    for (std::size_t v = begin; v < end; ++v) {
      if (representative[v] != static_cast<int>(v)) continue;
      const Eigen::Vector3d& p = cavities.vertices[v];
      closed_line_hits(surface, p.head<2>(), hits);
      outside[v] = winding_below(hits, p.z()) <= 0;
    }
  });
  return smallest_over_blocks(count, nearest, progress, [&](std::size_t begin, std::size_t end, double& smallest) {
    for (std::size_t v = begin; v < end; ++v)
      if (outside[representative[v]]) smallest = std::min(smallest, -surface.closest(cavities.vertices[v], diagonal).distance_mm);
  });
}

// The triangles that are outer surface before anything is asked of shells: the original's own. When some of those are gone a
// triangle that is not the original's may be a moved one, and then so is whatever hangs together with the original.
std::vector<bool> known_outer(const Mesh& mesh, const Match& matched) {
  if (matched.missing.empty()) return matched.delivered;
  const Components components = connected_components(mesh);
  std::vector<bool> holds_original(components.count, false);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (matched.delivered[t]) holds_original[components.of_triangle[t]] = true;
  std::vector<bool> known(mesh.triangles.size());
  for (std::size_t t = 0; t < known.size(); ++t) known[t] = holds_original[components.of_triangle[t]];
  return known;
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
  const VertexCorners at(mesh);
  return tbb::parallel_reduce(
      tbb::blocked_range<int>(0, static_cast<int>(mesh.vertices.size()), 1024), std::size_t{0},
      [&](const tbb::blocked_range<int>& range, std::size_t count) {
        std::vector<EdgeUse> uses;
        for (int low = range.begin(); low < range.end(); ++low)
          for_each_edge_from(mesh, at, low, uses, [&count](auto begin, auto end) { count += edge_balance(begin, end) != 0; });
        return count;
      },
      std::plus<>());
}

Mesh material_of(const Mesh& mesh, bool closed, const Progress& progress) {
  return closed ? boundary_of_union(mesh, progress) : mesh;
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
  surface.box = bounding_box(mesh);
  surface.diagonal_mm = surface.box.diagonal().norm();
  surface.is_float32 = is_float32(mesh);
  const double largest_mm = surface.box.min().cwiseAbs().cwiseMax(surface.box.max().cwiseAbs()).maxCoeff();
  verdict.coordinate_rounding_mm = std::ldexp(largest_mm, surface.is_float32 ? -23 : -50);
  verdict.bad_edges = unbalanced_edges(mesh);

  Match matched;
  matched.delivered.assign(mesh.triangles.size(), false);
  if (original) matched = match(mesh, *original, surface.is_float32);
  const Shells shells = find_shells(mesh, known_outer(mesh, matched), progress);

  std::vector<int> outer_triangles;
  std::vector<int> added_triangles;  // outer surface that is not the original's
  std::vector<int> cavity_triangles;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const int s = shells.of_triangle[t];
    const ShellKind kind = s < 0 ? ShellKind::outer : shells.shells[s].kind;
    if (kind == ShellKind::outer) outer_triangles.push_back(static_cast<int>(t));
    if (kind == ShellKind::outer && !matched.delivered[t]) added_triangles.push_back(static_cast<int>(t));
    if (kind == ShellKind::cavity) cavity_triangles.push_back(static_cast<int>(t));
  }
  for (const Shell& shell : shells.shells) {
    verdict.cavities += shell.kind == ShellKind::cavity;
    verdict.solid_islands += shell.kind == ShellKind::island;
    if (shell.kind == ShellKind::inside_out) surface.inside_out_edges += shell.triangles.size() * 3 / 2;
  }
  surface.outer = part(mesh, outer_triangles);
  verdict.smallest_wall_mm = smallest_wall(part(mesh, cavity_triangles), surface.outer, progress);
  if (original)
    verdict.outer_deviation_mm =
        outer_deviation({*original, surface.outer, part(*original, matched.missing), part(mesh, added_triangles)}, progress);
  return surface;
}

std::string scatter_words(double scatter_mm) { return shown(scatter_mm, 2) + " mm"; }

namespace {

// What sealed cavities keep of the liquid it is printed from.
void judge_trapped(const Surface& surface, const Print& print, const Progress& progress, Verdict& verdict) {
  if (!(print.liquid_g_cm3 > 0) || print.drained || !Surface::closed(verdict)) return;
  const double material_mm3 = mesh_moments(boundary_of_union(surface.mesh, progress))[M1];
  const double sealed_mm3 = mesh_moments(boundary_of_union(outer_hull(surface.mesh), progress))[M1] - material_mm3;
  if (sealed_mm3 > 1e-9 * material_mm3) verdict.trapped_resin_g = 1e-3 * print.liquid_g_cm3 * sealed_mm3;
  verdict.criteria.push_back(at_most("trapped_resin", "uncured resin kept in sealed cavities, g", verdict.trapped_resin_g, 0));
  if (verdict.trapped_resin_g == 0) return;
  verdict.meaning.push_back("Printed from resin it keeps " + number(verdict.trapped_resin_g, 1) +
                            " g of it uncured in its sealed cavities; what follows is of the mesh without that.");
  const double mass_g = 1e-3 * print.density_g_cm3 * material_mm3;
  verdict.notes.push_back("Sealed cavities keep " + number(verdict.trapped_resin_g, 1) +
                          " g of uncured resin: the print then weighs " + number(mass_g + verdict.trapped_resin_g, 1) +
                          " g instead of " + number(mass_g, 1) +
                          " g. If you will drill a hole into each, drain it and close the hole, say --drained.");
}

}  // namespace

void add_surface_criteria(const Surface& surface, const SurfaceTerms& terms, const Progress& progress, Verdict& verdict) {
  const double wall_mm = terms.print.wall_mm;
  if (verdict.bad_edges > 0) verdict.notes.push_back("The surface is not closed: the other figures take it as it is.");
  if (surface.inside_out_edges > 0) verdict.notes.push_back("A part of the surface faces inward and lies inside nothing.");
  if (wall_mm > 0 && verdict.cavities > 0 && surface.is_float32 && !float32_holds_wall(surface.box, wall_mm))
    verdict.notes.push_back(concat("The coordinates are float32 values, which lie ", float32_spacing_mm(surface.box),
                                   " mm apart here: too far for a wall of ", wall_mm,
                                   " mm. Move the body to the origin, or write a format that keeps doubles (OBJ, PLY, 3MF)."));

  auto& criteria = verdict.criteria;
  criteria.push_back(at_most("closed", "edges that are open or face the wrong way",
                             static_cast<double>(verdict.bad_edges + surface.inside_out_edges), 0));
  if (terms.has_original)
    criteria.push_back(
        at_most("outer_unchanged", "change of the outer surface, mm", verdict.outer_deviation_mm, verdict.coordinate_rounding_mm));
  criteria.push_back(
      at_most("no_islands", "pieces of material loose inside a cavity", static_cast<double>(verdict.solid_islands), 0));
  if (wall_mm > 0 && verdict.cavities > 0)
    criteria.push_back(
        at_least("wall", "thinnest wall, over the wall asked for", verdict.smallest_wall_mm / wall_mm, terms.wall_ratio));
  judge_trapped(surface, terms.print, progress, verdict);
}

}  // namespace rayrep::verify_detail

namespace rayrep {

double print_scatter_mm(double diagonal_mm) { return std::max(0.1, 5e-4 * diagonal_mm); }

}  // namespace rayrep
