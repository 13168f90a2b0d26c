#include "judge/verify_detail.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <numeric>
#include <utility>
#include <vector>

#include "base/text.h"
#include "base/union_find.h"
#include "judge/figures.h"
#include "judge/outer_surface.h"
#include "judge/overhang.h"
#include "judge/pieces.h"
#include "mesh/crossing.h"
#include "mesh/mesh_edges.h"
#include "mesh/mesh_union.h"
#include "mesh/part.h"
#include "mesh/shells.h"
#include "mesh/surface_gap.h"
#include "rayrep/base/error.h"
#include "rayrep/mesh/boolean.h"
#include "rayrep/mesh/clip.h"
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

// Smallest distance from the cavities to the outer surface, negative where a vertex lies outside of it.
double smallest_wall(const Mesh& cavities, const Mesh& outer, const Progress& progress) {
  if (cavities.vertices.empty()) return kInfinity;
  const SurfaceQuery surface(outer);
  const double gap = smallest_gap(cavities, surface, progress);
  // What does not cross the surface lies on one side of it. A surface with holes has no sides.
  const bool whole = gap > 0 && unbalanced_edges(outer) == 0;
  std::vector<int> representative(cavities.vertices.size());
  std::iota(representative.begin(), representative.end(), 0);
  if (whole) {
    const Components components = connected_components(cavities);
    std::vector<int> first(components.count, -1);
    for (std::size_t t = 0; t < cavities.triangles.size(); ++t)
      for (const int v : cavities.triangles[t]) {
        int& vertex = first[components.of_triangle[t]];
        if (vertex < 0) vertex = v;
        representative[v] = vertex;
      }
  }
  progress.check();
  Eigen::AlignedBox3d box = bounding_box(outer);
  box.extend(bounding_box(cavities));
  std::vector<char> outside(cavities.vertices.size());
  std::vector<double> depth(cavities.vertices.size(), 0);
  tbb::parallel_for(std::size_t{0}, outside.size(), [&](std::size_t v) {
    if (representative[v] == static_cast<int>(v)) outside[v] = !is_inside(surface, cavities.vertices[v]);
  });
  progress.check();
  tbb::parallel_for(std::size_t{0}, outside.size(), [&](std::size_t v) {
    if (outside[representative[v]]) depth[v] = surface.closest(cavities.vertices[v], box.diagonal().norm()).distance_mm;
  });
  const double deepest = *std::max_element(depth.begin(), depth.end());
  return deepest > 0 ? -deepest : gap;
}

// Counts the triangles of cavities and islands that cross another one, those that were added to an original and are there twice,
// and those of the outer surface that cross each other otherwise.
// @param added  of the outer surface: not the original's
void count_crossings(const Mesh& mesh, const TrianglePairs& close, const std::vector<char>& is_outer,
                     const std::vector<char>& added, Verdict& verdict) {
  const auto corners_of = [&mesh](int t) {
    std::array<int, 3> corners{mesh.triangles[t][0], mesh.triangles[t][1], mesh.triangles[t][2]};
    std::sort(corners.begin(), corners.end());
    return corners;
  };
  std::vector<char> crosses(mesh.triangles.size(), 0);
  std::vector<char> twice(mesh.triangles.size(), 0);
  for (const auto& [s, t] : crossing_pairs(mesh, close)) {
    const bool again = (added[s] || added[t]) && corners_of(s) == corners_of(t);
    for (const int triangle : {s, t}) {
      if (!is_outer[triangle] || (is_outer[s] && is_outer[t])) crosses[triangle] = 1;
      if (again && added[triangle]) twice[triangle] = 1;
    }
  }
  for (std::size_t t = 0; t < crosses.size(); ++t)
    if (crosses[t]) ++(is_outer[t] && !twice[t] ? verdict.outer_crossing_triangles : verdict.crossing_triangles);
}

// For each triangle of a mesh the patch it belongs to, by its first triangle: those that hang together over edges of no others.
std::vector<int> patches_of(const Mesh& mesh) {
  const VertexCorners at(mesh);
  std::vector<std::array<int, 3>> neighbours(mesh.triangles.size(), {-1, -1, -1});
  tbb::parallel_for(tbb::blocked_range<int>(0, static_cast<int>(mesh.vertices.size()), 1024), [&](const auto& range) {
    std::vector<EdgeUse> uses;
    for (int low = range.begin(); low < range.end(); ++low)
      for_each_edge_from(mesh, at, low, uses, [&](auto begin, auto end) {
        if (end - begin != 2) return;
        const Eigen::Vector3i& v = mesh.triangles[begin->triangle];
        for (std::size_t k = 0; k < 3; ++k)
          if (v[static_cast<int>(k)] != begin->low && v[static_cast<int>(k)] != begin->high)
            neighbours[begin->triangle][k] = (begin + 1)->triangle;
      });
  });
  UnionFind patches(static_cast<int>(mesh.triangles.size()));
  for (std::size_t t = 0; t < neighbours.size(); ++t)
    for (const int other : neighbours[t])
      if (other >= 0) patches.unite(static_cast<int>(t), other);
  std::vector<int> result(mesh.triangles.size());
  for (std::size_t t = 0; t < result.size(); ++t) result[t] = patches.root(static_cast<int>(t));
  return result;
}

// Edges of those parts of a closed mesh's cavities that do not lead from winding number 1 into 0. Where nothing crosses, one point
// of a patch speaks for all of it.
std::size_t misplaced_edges(const Mesh& mesh, const std::vector<int>& cavity_triangles, const Progress& progress) {
  const std::vector<int> patches = patches_of(part(mesh, cavity_triangles));
  const auto area_from_above = [&](std::size_t i) {
    const auto t = static_cast<std::size_t>(cavity_triangles[i]);
    return (mesh.corner(t, 1) - mesh.corner(t, 0)).cross(mesh.corner(t, 2) - mesh.corner(t, 0)).z();
  };
  struct Patch {
    std::size_t largest = 0;  // triangle, seen from above
    std::size_t triangles = 0;
  };
  std::vector<Patch> found(patches.size());  // by their first triangles
  for (std::size_t i = 0; i < patches.size(); ++i) {
    Patch& patch = found[patches[i]];
    if (patch.triangles++ == 0 || std::abs(area_from_above(i)) > std::abs(area_from_above(patch.largest))) patch.largest = i;
  }
  std::vector<int> own_shell(mesh.triangles.size());
  std::iota(own_shell.begin(), own_shell.end(), 0);
  ShellNesting nesting(mesh, own_shell);
  Surroundings below;
  std::size_t edges = 0;
  for (const Patch& patch : found) {
    if (patch.triangles == 0) continue;
    progress.check();
    const int t = cavity_triangles[patch.largest];
    const double area = area_from_above(patch.largest);
    nesting.around((mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2)) / 3, t, below);
    if (area != 0 && below.winding != (area > 0 ? 1 : 0)) edges += 3 * patch.triangles / 2;
  }
  return edges;
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

Mesh cavities_of(const Mesh& delivered) {
  const Mesh mesh = merged_mesh(delivered);
  Mesh cavities;
  for (const Mesh& shell : split(mesh, connected_components(mesh)))
    if (mesh_moments(shell)[M1] < 0) append(cavities, shell);
  return cavities;
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

AllowedOutside::AllowedOutside(const Mesh& delivered, const Mesh* original, const Spec& spec, const Progress& progress)
    : mesh_(original) {
  if (original) take_axle(spec, progress);
  const auto* stand = std::get_if<StandSpec>(&spec);
  if (!original || !stand || stand->flatten_mm == 0) return;
  allowed_mm_ = stand->flatten_mm;
  const Eigen::Vector3d up = stand->up.normalized();
  const double lowest_mm = lowest_along(delivered, up);
  cut_mm_ = lowest_mm - lowest_along(*original, up);
  const double rounding_mm = 1e-6 * bounding_box(*original).diagonal().norm();
  if (!(cut_mm_ > rounding_mm)) {
    cut_mm_ = 0;
    return;
  }
  allowed_mm_ += rounding_mm;
  flattened_ = clipped(with_merged_vertices(*original), {up, lowest_mm}, progress);
  mesh_ = &flattened_;
}

void AllowedOutside::take_axle(const Spec& spec, const Progress& progress) {
  std::vector<Mesh> operands = allowed_to_be_taken(spec, *mesh_);
  if (operands.empty()) return;
  operands.insert(operands.begin(), *mesh_);
  flattened_ = combined(operands, {.operation = BooleanOperation::subtract}, progress).mesh;
  tolerance_mm_ = 1e-5 * bounding_box(*mesh_).diagonal().norm();
  mesh_ = &flattened_;
}

void AllowedOutside::tell(Verdict& verdict) const {
  if (allowed_mm_ == 0) return;
  verdict.criteria.push_back(at_most("flattened", "cut off below, mm", cut_mm_, allowed_mm_));
  if (cut_mm_ > 0)
    verdict.meaning.push_back("Its outside was changed: " + number(cut_mm_, 2) + " mm were cut off below for a base, as allowed.");
}

Surface judge_surface(const Mesh& delivered, const Mesh* original, const Progress& progress, Verdict& verdict,
                      const Drains* drains) {
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
  std::vector<char> is_outer(mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const int s = shells.of_triangle[t];
    const ShellKind kind = s < 0 ? ShellKind::outer : shells.shells[s].kind;
    is_outer[t] = kind == ShellKind::outer;
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
  progress.check();
  const bool holed = original && drains && Surface::closed(verdict);
  if (holed) {
    std::vector<char> unchanged;
    for (const int t : outer_triangles) unchanged.push_back(matched.delivered[static_cast<std::size_t>(t)]);
    // Distances are computed no better, and told no better.
    const double rounding_mm = std::max(verdict.coordinate_rounding_mm, std::ldexp(surface.diagonal_mm, -40));
    verdict.coordinate_rounding_mm = std::max(verdict.coordinate_rounding_mm, std::ldexp(surface.diagonal_mm, -30));
    surface.holes = holes_in({surface.outer, unchanged, *original, drains->diameter_mm, rounding_mm}, progress);
    std::erase_if(added_triangles, [&](int t) {
      const auto at = std::lower_bound(outer_triangles.begin(), outer_triangles.end(), t) - outer_triangles.begin();
      return surface.holes.inside[static_cast<std::size_t>(at)] != 0;
    });
    verdict.cavities += surface.holes.cavities;
  }
  const TrianglePairs close = close_pairs(mesh, progress);
  progress.check();
  std::vector<char> added(mesh.triangles.size(), 0);
  if (original)
    for (const int t : added_triangles) added[t] = 1;
  count_crossings(mesh, close, is_outer, added, verdict);
  if (Surface::closed(verdict) && verdict.crossing_triangles == 0)
    surface.misplaced_edges = misplaced_edges(mesh, cavity_triangles, progress);
  surface.material = Surface::closed(verdict) ? boundary_of_union(mesh, close, progress) : mesh;
  surface.cavities = part(mesh, cavity_triangles);
  std::vector<int> wall_triangles = cavity_triangles;
  std::vector<int> unholed_triangles = outer_triangles;
  if (holed) {
    unholed_triangles.clear();
    for (std::size_t n = 0; n < outer_triangles.size(); ++n) {
      if (!surface.holes.inside[n]) unholed_triangles.push_back(outer_triangles[n]);
      if (surface.holes.inside[n] && !surface.holes.in_hole[n]) wall_triangles.push_back(outer_triangles[n]);
    }
  }
  verdict.smallest_wall_mm = smallest_wall(part(mesh, wall_triangles), holed ? surface.holes.sealed : surface.outer, progress);
  if (!original) return surface;
  Mesh gone = part(*original, matched.missing);
  if (holed) gone = beside_mouths(gone, surface.holes.mouths, drains->diameter_mm);
  const Mesh outside = holed ? part(mesh, unholed_triangles) : surface.outer;
  verdict.outer_deviation_mm = outer_deviation({*original, outside, gone, part(mesh, added_triangles)}, progress);
  return surface;
}

Mesh rooms_in(const Surface& surface, const Progress& progress) {
  if (surface.holes.sealed.triangles.empty()) return surface.cavities;
  const std::vector<Mesh> operands = {surface.holes.sealed, surface.material};
  Mesh rooms = with_merged_vertices(combined(operands, {.operation = BooleanOperation::subtract}, progress).mesh);
  flip(rooms);
  return rooms;
}

std::string scatter_words(double scatter_mm) { return shown(scatter_mm, 2) + " mm"; }

namespace {

// What sealed cavities keep of the liquid it is printed from.
void judge_trapped(const Surface& surface, const Print& print, const Progress& progress, Verdict& verdict) {
  if (!(print.liquid_g_cm3 > 0) || print.drained || !Surface::closed(verdict)) return;
  if (print.drains.wanted()) return;  // judge_drains
  const double material_mm3 = mesh_moments(surface.material)[M1];
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

/// Facets of a roof that is as steep as asked for are tilted by what its mesh may be off.
double flattest_deg(const Print& print) { return std::max(0.0, print.self_supporting_deg - 2); }

/// Share of the cavities' surface that has material over it and is flatter than roofs were to be. theory.md (160)
double flatter_share(const Mesh& rooms, const PrintedUp& print, double least_rad) {
  const Eigen::Vector3d up = print.direction.normalized();
  double all_mm2 = 0;
  double flatter_mm2 = 0;
  for (std::size_t t = 0; t < rooms.triangles.size(); ++t) {
    const Eigen::Vector3d& a = rooms.corner(t, 0);
    const Eigen::Vector3d twice = (rooms.corner(t, 1) - a).cross(rooms.corner(t, 2) - a);
    all_mm2 += 0.5 * twice.norm();
    if (-up.dot(twice) > std::cos(least_rad) * twice.norm()) flatter_mm2 += 0.5 * twice.norm();
  }
  return all_mm2 > 0 ? flatter_mm2 / all_mm2 : 0;
}

/// Of roofs that were to be self-supporting: what of them is not.
void note_roofs(const Overhang& found, double flatter, const Print& print, Verdict& verdict) {
  constexpr double kMostShare = 0.01;
  // So far any printer bridges; the end of a hole in a roof is as wide as that.
  constexpr double kMostBridge_mm = 4;
  const double most_mm = print.drains.wanted() ? std::max(kMostBridge_mm, print.drains.diameter_mm) : kMostBridge_mm;
  std::string what;
  const auto add = [&what](bool is_so, const std::string& words) {
    if (is_so) what += (what.empty() ? "" : ", ") + words;
  };
  add(found.islands > 0, plural(found.islands, "piece begins", "pieces begin") + " in mid-air");
  add(flatter > kMostShare,
      number(100 * flatter, 1) + " % of the cavities' surface is flatter than " + shown(flattest_deg(print)) + " degrees");
  add(found.bridge_mm > most_mm, "a layer bridges " + number(found.bridge_mm, 1) + " mm");
  if (what.empty()) return;
  verdict.notes.push_back("Not all roofs came out self-supporting at " + shown(print.self_supporting_deg) + " degrees: " + what +
                          ". Look at the layers in the slicer, or print it in another direction (--print-direction).");
}

/// Of roofs that were to be self-supporting.
void judge_roofs(const Overhang& found, double flatter, const Print& print, Verdict& verdict) {
  verdict.figures.push_back({.name = "flatter_share",
                             .words = "of the cavities' surface, flatter than " + shown(flattest_deg(print)) + " degrees",
                             .value = flatter});
  note_roofs(found, flatter, print, verdict);
}

void tell_overhang(const Surface& surface, const SurfaceTerms& terms, const Progress& progress, Verdict& verdict) {
  if (verdict.cavities == 0 || terms.in_pieces || !Surface::closed(verdict)) return;
  PrintedUp print;
  print.direction = terms.print.direction.value_or(terms.up);
  print.bed_mm = lowest_along(surface.mesh, print.direction.normalized());
  const Mesh rooms = rooms_in(surface, progress);
  Overhang found = overhang(rooms, print, progress);
  found.sealed_mm3 = surface.cavities.triangles.empty() ? 0 : -mesh_moments(surface.cavities)[M1];
  verdict.figures = figures_of(found, print);
  if (terms.print.self_supporting_deg == 0) return;
  judge_roofs(found, flatter_share(rooms, print, flattest_deg(terms.print) * std::numbers::pi / 180), terms.print, verdict);
}

}  // namespace

void add_surface_criteria(const Surface& surface, const SurfaceTerms& terms, const Progress& progress, Verdict& verdict) {
  const double wall_mm = terms.print.wall_mm;
  if (verdict.bad_edges > 0) verdict.notes.push_back("The surface is not closed: the other figures take it as it is.");
  if (surface.inside_out_edges > 0) verdict.notes.push_back("A part of the surface faces inward and lies inside nothing.");
  if (surface.misplaced_edges > 0)
    verdict.notes.push_back(
        "A cavity does not lead from material into the empty: it lies inside another one, or where bodies overlap.");
  if (verdict.outer_crossing_triangles > 0)
    verdict.notes.push_back("The outer surface crosses or touches itself in " +
                            plural(verdict.outer_crossing_triangles, "triangle", "triangles") + ": that is not judged.");
  if (wall_mm > 0 && verdict.cavities > 0 && surface.is_float32 && !float32_holds_wall(surface.box, wall_mm))
    verdict.notes.push_back(concat("The coordinates are float32 values, which lie ", float32_spacing_mm(surface.box),
                                   " mm apart here: too far for a wall of ", wall_mm,
                                   " mm. Move the body to the origin, or write a format that keeps doubles (OBJ, PLY, 3MF)."));

  auto& criteria = verdict.criteria;
  criteria.push_back(at_most("closed", "edges that are open or face the wrong way",
                             static_cast<double>(verdict.bad_edges + surface.inside_out_edges + surface.misplaced_edges), 0));
  if (terms.has_original)
    criteria.push_back(at_most("outer_unchanged", "change of the outer surface, mm", verdict.outer_deviation_mm,
                               std::max(verdict.coordinate_rounding_mm, terms.tolerance_mm)));
  criteria.push_back(
      at_most("no_islands", "pieces of material loose inside a cavity", static_cast<double>(verdict.solid_islands), 0));
  criteria.push_back(at_most("no_crossings", "triangles of cavities that cross others or are there twice",
                             static_cast<double>(verdict.crossing_triangles), 0));
  if (wall_mm > 0 && verdict.cavities > 0)
    criteria.push_back(
        at_least("wall", "thinnest wall, over the wall asked for", verdict.smallest_wall_mm / wall_mm, terms.wall_ratio));
  judge_trapped(surface, terms.print, progress, verdict);
  tell_overhang(surface, terms, progress, verdict);
}

void tell_body_alone(const Surface& surface, const Print& print, const std::string& unsaid, Verdict& verdict) {
  verdict.body = mass_properties(surface.material, print.density_g_cm3);
  put_first(body_figures(verdict.body, "mass"), verdict.figures);
  verdict.meaning.push_back("Its surface is not closed: " + unsaid + " nothing can be said.");
}

}  // namespace rayrep::verify_detail
