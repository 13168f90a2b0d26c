#include "rayrep/mesh/mesh_check.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <utility>

#include "base/text.h"
#include "base/union_find.h"
#include "mesh/close_pairs.h"
#include "mesh/first_aid.h"
#include "mesh/mesh_edges.h"
#include "mesh/orientation.h"
#include "mesh/predicates.h"
#include "mesh/shells.h"
#include "mesh/unite_bodies.h"
#include "rayrep/base/error.h"

namespace rayrep {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

// ------------------------------------------------------------------------------------------------------------------ words

const char* const kHowToRepair =
    "Repair the model and try again, for example in Blender (3D-Print Toolbox, Clean Up, Make Manifold), in MeshLab "
    "(Filters, Remeshing, Close Holes) or in PrusaSlicer on Windows (right-click the part, Fix by Windows repair algorithm; "
    "then export it as STL).";

void note_first(Defect& defect, const Vector3d& where) {
  if (defect.count++ == 0) defect.first_mm = where;
}

Vector3d centroid(const Mesh& mesh, std::size_t t) { return (mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2)) / 3; }

// --------------------------------------------------------------------------------------------------------------- vertices

std::size_t used_vertices(const Mesh& mesh) {
  std::vector<bool> used(mesh.vertices.size(), false);
  for (const auto& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) used[t[k]] = true;
  return static_cast<std::size_t>(std::count(used.begin(), used.end(), true));
}

void drop_unused_vertices(Mesh& mesh) {
  std::vector<int> number(mesh.vertices.size(), -1);
  for (const auto& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) number[t[k]] = 0;
  int used = 0;
  for (std::size_t i = 0; i < number.size(); ++i)
    if (number[i] == 0) {
      mesh.vertices[used] = mesh.vertices[i];
      number[i] = used++;
    }
  mesh.vertices.resize(used);
  for (auto& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) t[k] = number[t[k]];
}

// ------------------------------------------------------------------------------------------------------------------ edges

EdgeUse edge_use(const Mesh& mesh, int triangle, int k) {
  const int a = mesh.triangles[triangle][k];
  const int b = mesh.triangles[triangle][(k + 1) % 3];
  return {std::min(a, b), std::max(a, b), triangle, a < b ? 1 : -1};
}

Vector3d midpoint(const Mesh& mesh, const EdgeUse& use) { return (mesh.vertices[use.low] + mesh.vertices[use.high]) / 2; }

void count_edge_defects(const Mesh& mesh, MeshReport& report) {
  UnionFind components(static_cast<int>(mesh.triangles.size()));
  for_each_edge(mesh, [&](auto begin, auto end) {
    const auto uses = end - begin;
    if (uses == 1) note_first(report.open_edges, midpoint(mesh, *begin));
    if (uses > 2) note_first(report.non_manifold_edges, midpoint(mesh, *begin));
    if (uses == 2 && begin->direction == (begin + 1)->direction) note_first(report.misoriented_edges, midpoint(mesh, *begin));
    for (auto use = begin + 1; use != end; ++use) components.unite(begin->triangle, use->triangle);
  });
  for (int t = 0; t < static_cast<int>(mesh.triangles.size()); ++t) report.components += components.root(t) == t;
}

/// Why a surface is not closed.
struct Gaps {
  Defect rims;       ///< unbalanced edges of one triangle
  Defect unmatched;  ///< unbalanced edges of more triangles
};

Gaps count_unbalanced_edges(const Mesh& mesh, MeshReport& report) {
  Gaps gaps;
  for_each_edge(mesh, [&](auto begin, auto end) {
    if (edge_balance(begin, end) == 0) return;
    note_first(report.unbalanced_edges, midpoint(mesh, *begin));
    note_first(end - begin == 1 ? gaps.rims : gaps.unmatched, midpoint(mesh, *begin));
  });
  return gaps;
}

// --------------------------------------------------------------------------------------------- triangles that are too many

/// Indices of triangles that have the same three corners as another one: each group ascending, groups by first member.
std::vector<std::vector<int>> duplicate_groups(const Mesh& mesh) {
  using Key = std::array<int, 4>;
  std::vector<Key> keys;
  keys.reserve(mesh.triangles.size());
  for (int t = 0; t < static_cast<int>(mesh.triangles.size()); ++t) {
    const Vector3i& v = mesh.triangles[t];
    Key key{v[0], v[1], v[2], t};
    std::sort(key.begin(), key.begin() + 3);
    keys.push_back(key);
  }
  std::sort(keys.begin(), keys.end());
  std::vector<std::vector<int>> groups;
  for (std::size_t i = 0; i < keys.size();) {
    std::size_t j = i + 1;
    while (j < keys.size() && std::equal(keys[i].begin(), keys[i].begin() + 3, keys[j].begin())) ++j;
    if (j > i + 1) {
      auto& group = groups.emplace_back();
      for (; i < j; ++i) group.push_back(keys[i][3]);
    }
    i = j;
  }
  std::sort(groups.begin(), groups.end());
  return groups;
}

bool same_orientation(const Vector3i& a, const Vector3i& b) {
  return (a[0] == b[0] && a[1] == b[1]) || (a[0] == b[1] && a[1] == b[2]) || (a[0] == b[2] && a[1] == b[0]);
}

/// How often a mesh is there, each triangle of it as often and facing the same way.
std::size_t times_there(const Mesh& mesh, const std::vector<std::vector<int>>& duplicates) {
  const std::size_t times = duplicates.empty() ? 1 : duplicates.front().size();
  if (times * duplicates.size() != mesh.triangles.size()) return 1;
  for (const std::vector<int>& group : duplicates)
    for (const int t : group)
      if (group.size() != times || !same_orientation(mesh.triangles[group.front()], mesh.triangles[t])) return 1;
  return times;
}

struct Dropped {
  std::size_t times = 1;       ///< that all of it is there; one is left
  std::size_t duplicates = 0;  ///< copies whose removal closes the surface
  std::size_t opposite = 0;    ///< pairs of coincident triangles that face each other
  std::size_t flat = 0;        ///< triangles of zero area whose removal closes the surface
};

/// Removes what only harms: duplicates and zero-area triangles without which the edges are better balanced, and pairs of coincident
/// triangles with opposite orientation, which bound nothing and change no edge's balance.
Dropped drop_superfluous(Mesh& mesh, std::vector<bool>& is_flat, const std::vector<std::vector<int>>& duplicates) {
  Dropped dropped;
  if (duplicates.empty() && std::find(is_flat.begin(), is_flat.end(), true) == is_flat.end()) return dropped;

  std::vector<std::pair<std::pair<int, int>, int>> net;  // of each edge, ascending
  for_each_edge(mesh,
                [&](auto begin, auto end) { net.emplace_back(std::pair(begin->low, begin->high), edge_balance(begin, end)); });
  const auto net_of = [&](const EdgeUse& use) -> int& {
    const std::pair edge(use.low, use.high);
    return std::lower_bound(net.begin(), net.end(), edge, [](const auto& n, const auto& e) { return n.first < e; })->second;
  };
  std::vector<bool> gone(mesh.triangles.size(), false);
  const auto drop = [&](int t) {
    for (int k = 0; k < 3; ++k) {
      const EdgeUse use = edge_use(mesh, t, k);
      net_of(use) -= use.direction;
    }
    gone[t] = true;
  };
  dropped.times = times_there(mesh, duplicates);
  if (dropped.times > 1)
    for (const auto& group : duplicates) std::for_each(group.begin() + 1, group.end(), drop);
  const auto drop_if_too_many = [&](int t) {
    if (gone[t]) return false;
    int change = 0;  // of the sum of |net|
    for (int k = 0; k < 3; ++k) {
      const EdgeUse use = edge_use(mesh, t, k);
      change += net_of(use) * use.direction > 0 ? -1 : 1;
    }
    if (change > 0) return false;
    drop(t);
    return true;
  };
  for (bool changed = true; changed;) {
    changed = false;
    for (const auto& group : duplicates) {
      auto left = std::count_if(group.begin(), group.end(), [&gone](int t) { return !gone[t]; });
      for (auto t = group.rbegin(); t != group.rend() && left > 1; ++t)
        if (drop_if_too_many(*t)) {
          ++dropped.duplicates;
          --left;
          changed = true;
        }
    }
    for (int t = 0; t < static_cast<int>(mesh.triangles.size()); ++t)
      if (is_flat[t] && drop_if_too_many(t)) {
        ++dropped.flat;
        changed = true;
      }
  }
  for (const auto& group : duplicates)
    for (std::size_t i = 0; i < group.size(); ++i)
      for (std::size_t j = i + 1; j < group.size() && !gone[group[i]]; ++j)
        if (!gone[group[j]] && !same_orientation(mesh.triangles[group[i]], mesh.triangles[group[j]])) {
          gone[group[i]] = gone[group[j]] = true;
          ++dropped.opposite;
        }

  std::size_t kept = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (!gone[t]) {
      mesh.triangles[kept] = mesh.triangles[t];
      is_flat[kept++] = is_flat[t];
    }
  mesh.triangles.resize(kept);
  is_flat.resize(kept);
  return dropped;
}

// ------------------------------------------------------------------------------------------------------------- orientation

/// For each shell, the shells that contain it, ascending. Decided at the centroids of up to three of its triangles, those that look
/// largest from above, which all have to lie inside: shells that cross are not nested.
std::vector<std::vector<int>> containing_shells(const Mesh& mesh, const Orientation& shells, const Progress& progress) {
  std::vector<std::vector<int>> inside(shells.count);
  if (shells.count < 2) return inside;

  constexpr int kSamples = 3;
  struct Sample {
    double area = 0;
    int triangle = -1;
  };
  std::vector<std::array<Sample, kSamples>> samples(shells.count);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vector3d n = (mesh.corner(t, 1) - mesh.corner(t, 0)).cross(mesh.corner(t, 2) - mesh.corner(t, 0));
    Sample candidate{std::abs(n.z()), static_cast<int>(t)};
    for (Sample& s : samples[shells.of_triangle[t]])
      if (candidate.area > s.area) std::swap(candidate, s);
  }

  ShellNesting nesting(mesh, shells.of_triangle);
  Surroundings around;
  struct Verdicts {
    int inside = 0;
    bool touches = false;
  };
  std::map<int, Verdicts> verdicts;  // on the other shells
  for (int shell = 0; shell < shells.count; ++shell) {
    if (shell % 256 == 0) progress.check();
    verdicts.clear();
    int used = 0;
    for (const Sample& sample : samples[shell]) {
      if (sample.triangle < 0) continue;
      ++used;
      nesting.around(centroid(mesh, static_cast<std::size_t>(sample.triangle)), shell, around);
      for (const int other : around.touched) verdicts[other].touches = true;
      for (const auto& [other, winding] : around.shells) ++verdicts[other].inside;
    }
    for (const auto& [other, verdict] : verdicts)
      if (verdict.inside == used && !verdict.touches) inside[shell].push_back(other);
  }
  return inside;
}

/// Turns shells that face inward where nothing could be hollowed out, and fills in the counts and notes on nesting.
void orient_shells(Mesh& mesh, Orientation& shells, MeshReport& report, const Progress& progress) {
  std::vector<double> volumes = shell_volumes(mesh, shells.of_triangle, shells.count);
  const auto inside = containing_shells(mesh, shells, progress);
  std::vector<int> order(shells.count);
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return inside[a].size() < inside[b].size(); });

  std::vector<bool> turn(shells.count, false);
  std::size_t unions = 0;
  const auto outward = [&](int shell) { return (volumes[shell] > 0) != turn[shell]; };
  for (const int shell : order) {  // those that contain others come first
    int winding = 0;               // just outside this shell
    bool in_turned = false;        // inside a body that was inside out
    for (const int other : inside[shell]) {
      winding += outward(other) ? 1 : -1;
      in_turned = in_turned || (inside[other].empty() && turn[other]);
    }
    if (in_turned)
      turn[shell] = outward(shell) != (inside[shell].size() % 2 == 0);
    else if (volumes[shell] < 0 && winding <= 0)
      turn[shell] = true;
    report.components_turned += turn[shell];
    if (inside[shell].empty()) continue;
    ++report.nested_components;
    if (!outward(shell)) ++report.cavities;
    if (outward(shell) && winding > 0) ++unions;
  }

  std::size_t turned = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (turn[shells.of_triangle[t]]) {
      std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
      shells.turned[t] = !shells.turned[t];
      ++turned;
    }
  if (report.components_turned > 0)
    report.notes.push_back(plural(report.components_turned, "part of the surface was", "parts of the surface were") +
                           " inside out and turned (" + plural(turned, "triangle", "triangles") + ").");
  if (report.cavities > 0)
    report.notes.push_back(plural(report.cavities, "closed surface faces", "closed surfaces face") +
                           " inward inside another one: kept as existing " + (report.cavities == 1 ? "cavity." : "cavities."));
  if (unions > 0)
    report.notes.push_back(plural(unions, "closed surface faces", "closed surfaces face") +
                           " outward inside solid material: taken as one body with it (union), not as a cavity.");
}

// ------------------------------------------------------------------------------------------------------- self-intersections

struct PairCount {
  std::size_t count = 0;
  std::size_t first = std::numeric_limits<std::size_t>::max();
};

std::string self_intersection_words(const Defect& found) {
  return "The surface crosses or touches itself in " + plural(found.count, "pair", "pairs") + " of triangles, first near " +
         shown(found.first_mm) + ": overlapping parts are taken as one body.";
}

void count_self_intersections(const Mesh& mesh, const std::vector<bool>& is_flat, MeshReport& report, const Progress& progress) {
  const std::vector<std::pair<int, int>> pairs = close_pairs(mesh, progress);
  const auto intersect = [&](const std::pair<int, int>& pair) {
    const auto [s, t] = pair;
    if (is_flat[s] || is_flat[t]) return false;
    const Vector3d p[3] = {mesh.corner(s, 0), mesh.corner(s, 1), mesh.corner(s, 2)};
    const Vector3d q[3] = {mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2)};
    return triangles_intersect(p, mesh.triangles[s], q, mesh.triangles[t]);
  };
  constexpr std::size_t kBatch = 1 << 18;  // between two looks at the progress
  PairCount total;
  for (std::size_t begin = 0; begin < pairs.size(); begin += kBatch) {
    progress.check();
    const PairCount batch = tbb::parallel_reduce(
        tbb::blocked_range<std::size_t>(begin, std::min(begin + kBatch, pairs.size()), 512), PairCount{},
        [&](const tbb::blocked_range<std::size_t>& range, PairCount sum) {
          for (std::size_t i = range.begin(); i < range.end(); ++i)
            if (intersect(pairs[i])) {
              ++sum.count;
              sum.first = std::min(sum.first, i);
            }
          return sum;
        },
        [](const PairCount& a, const PairCount& b) {
          return PairCount{a.count + b.count, std::min(a.first, b.first)};
        });
    total = {total.count + batch.count, std::min(total.first, batch.first)};
  }
  if (total.count == 0) return;
  const auto area2 = [&](std::size_t t) {
    return (mesh.corner(t, 1) - mesh.corner(t, 0)).cross(mesh.corner(t, 2) - mesh.corner(t, 0)).squaredNorm();
  };
  const auto s = static_cast<std::size_t>(pairs[total.first].first);
  const auto t = static_cast<std::size_t>(pairs[total.first].second);
  report.self_intersections = {total.count, centroid(mesh, area2(s) < area2(t) ? s : t)};
  report.notes.push_back(self_intersection_words(report.self_intersections));
}

// ---------------------------------------------------------------------------------------------------------------- refusals

/// True when a corner of a triangle is NaN or infinite: then nothing else can be said of the mesh.
bool refuse_not_finite(const Mesh& mesh, MeshReport& report) {
  std::vector<bool> counted(mesh.vertices.size(), false);
  std::size_t first_triangle = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k) {
      const int v = mesh.triangles[t][k];
      if (mesh.vertices[v].allFinite() || counted[v]) continue;
      counted[v] = true;
      if (report.not_finite.count == 0) first_triangle = t;
      note_first(report.not_finite, mesh.vertices[v]);
    }
  if (!report.not_finite) return false;
  std::string where = "triangle " + std::to_string(first_triangle + 1) + " of " + std::to_string(mesh.triangles.size());
  for (int k = 0; k < 3; ++k)
    if (mesh.corner(first_triangle, k).allFinite()) {
      where += ", near " + shown(mesh.corner(first_triangle, k));
      break;
    }
  report.refusal = plural(report.not_finite.count, "corner has", "corners have") +
                   " coordinates that are not finite numbers (NaN or infinity), first in " + where +
                   ". The file is damaged or was written wrongly: export the model again from the program that made it.";
  return true;
}

/// True when products of five coordinates, which moments are made of, may be no numbers any more.
bool refuse_out_of_reach(const Mesh& mesh, MeshReport& report) {
  constexpr double kMost = 1e50;
  for (const Vector3i& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) {
      const Vector3d& p = mesh.vertices[t[k]];
      if (p.cwiseAbs().maxCoeff() <= kMost) continue;
      report.refusal =
          concat("A corner lies at ", shown(p),
                 ": so far away nothing can be computed. The file is damaged, or was written with a wrong unit: export "
                 "the model again from the program that made it.");
      return true;
    }
  return false;
}

std::string not_closed_refusal(const Gaps& gaps, const Defect& one_sided) {
  std::string causes;
  const auto add = [&causes](const Defect& defect, const std::string& one, const std::string& many) {
    if (!defect) return;
    if (!causes.empty()) causes += "; ";
    causes += plural(defect.count, one, many) + ", the first near " + shown(defect.first_mm);
  };
  add(gaps.rims, "edge belongs to one triangle only (the rim of a hole)", "edges belong to one triangle only (rims of holes)");
  add(gaps.unmatched, "edge has more triangles on one side than on the other",
      "edges have more triangles on one side than on the other");
  add(one_sided, "piece has only one side, like a Moebius strip", "pieces have only one side, like a Moebius strip");
  return "The surface is not closed, so it has no inside: " + causes + ".";
}

std::string no_volume_refusal(const Mesh& mesh, double volume) {
  const Vector3d size = mesh.vertices.empty() ? Vector3d::Zero() : Vector3d(bounding_box(mesh).sizes());
  return concat("The surface encloses no volume (", shown(volume, 4), " in a box of ", shown(size.x(), 4), " x ",
                shown(size.y(), 4), " x ", shown(size.z(), 4),
                "): it is flat, or its sheets cancel each other. Give the model a thickness, or check that the right object was "
                "exported.");
}

// --------------------------------------------------------------------------------------------------------------- all together

/// A mesh with its vertices merged and without triangles that have a corner twice.
struct Cleaned {
  Mesh mesh;
  std::size_t points = 0;     ///< that were used before
  std::vector<bool> is_flat;  ///< triangles of zero area although their corners differ
  Defect degenerate;
};

Cleaned clean(const Mesh& mesh) {
  Cleaned cleaned;
  Mesh& m = cleaned.mesh;
  m = with_merged_vertices(mesh);
  cleaned.points = m.vertices.size();
  std::size_t kept = 0;
  cleaned.is_flat.reserve(m.triangles.size());
  for (std::size_t t = 0; t < m.triangles.size(); ++t) {
    const Vector3i v = m.triangles[t];
    const bool repeated = v[0] == v[1] || v[1] == v[2] || v[2] == v[0];
    const bool flat = !repeated && collinear(m.vertices[v[0]], m.vertices[v[1]], m.vertices[v[2]]);
    if (repeated || flat) note_first(cleaned.degenerate, centroid(m, t));
    if (repeated) continue;
    m.triangles[kept++] = v;
    cleaned.is_flat.push_back(flat);
  }
  m.triangles.resize(kept);
  drop_unused_vertices(m);
  return cleaned;
}

/// Of a surface that gets first aid self-intersections are counted after it.
bool counted_later(const CheckOptions& options, const MeshReport& report) { return options.first_aid && report.open_edges; }

/// What check_mesh finds before first aid.
CheckedMesh examined(const Mesh& mesh, const CheckOptions& options, const Progress& progress) {
  CheckedMesh checked;
  MeshReport& report = checked.report;
  report.triangles_read = mesh.triangles.size();
  if (mesh.triangles.empty()) {
    report.refusal = "There is not a single triangle in this model: check that the right object was exported, as a mesh.";
    return checked;
  }
  for ([[maybe_unused]] const auto& t : mesh.triangles)
    assert(t.minCoeff() >= 0 && t.maxCoeff() < static_cast<int>(mesh.vertices.size()));
  if (refuse_not_finite(mesh, report) || refuse_out_of_reach(mesh, report)) {
    checked.mesh = mesh;
    return checked;
  }

  Mesh& m = checked.mesh;
  Cleaned cleaned = clean(mesh);
  m = std::move(cleaned.mesh);
  std::vector<bool>& is_flat = cleaned.is_flat;
  const std::size_t repeated_corners = mesh.triangles.size() - m.triangles.size();
  report.degenerate = cleaned.degenerate;
  report.vertices_merged = used_vertices(mesh) - cleaned.points;
  progress.check();

  count_edge_defects(m, report);
  const auto duplicates = duplicate_groups(m);
  for (const auto& group : duplicates)
    for (std::size_t i = 1; i < group.size(); ++i) note_first(report.duplicate, centroid(m, static_cast<std::size_t>(group[i])));
  if (options.self_intersections && !counted_later(options, report)) count_self_intersections(m, is_flat, report, progress);

  const Dropped dropped = drop_superfluous(m, is_flat, duplicates);
  if (repeated_corners + dropped.flat > 0)
    report.notes.push_back(plural(repeated_corners + dropped.flat, "triangle of zero area was", "triangles of zero area were") +
                           " left out, the first near " + shown(report.degenerate.first_mm) + ".");
  if (const std::size_t flat = report.degenerate.count - repeated_corners - dropped.flat; flat > 0)
    report.notes.push_back(plural(flat, "triangle of zero area was", "triangles of zero area were") +
                           " kept, because the surface would not be closed without.");
  if (dropped.times > 1)
    report.notes.push_back("The whole surface is there " + std::to_string(dropped.times) +
                           " times, in the same place: it was taken once.");
  if (dropped.duplicates > 0)
    report.notes.push_back(plural(dropped.duplicates, "triangle", "triangles") +
                           " there more than once left out, because that closes the surface; the first near " +
                           shown(report.duplicate.first_mm) + ".");
  if (dropped.opposite > 0)
    report.notes.push_back(plural(dropped.opposite, "pair of triangles that lie on each other face",
                                  "pairs of triangles that lie on each other face") +
                           " opposite ways (a wall without thickness) and left out, the first near " +
                           shown(report.duplicate.first_mm) + ".");
  const std::size_t left_out =
      dropped.times > 1 ? report.duplicate.count : std::min(report.duplicate.count, dropped.duplicates + dropped.opposite);
  if (const std::size_t copies = report.duplicate.count - left_out; copies > 0)
    report.notes.push_back(plural(copies, "triangle is", "triangles are") +
                           " there more than once and kept: bodies that lie on each other count as one.");
  progress.check();

  Orientation shells = orient_neighbours(m);
  const auto turned = [&shells] { return static_cast<std::size_t>(std::count(shells.turned.begin(), shells.turned.end(), true)); };
  if (turned() > 0)
    report.notes.push_back(plural(turned(), "triangle was", "triangles were") + " turned to agree with " +
                           (turned() == 1 ? "its" : "their") + " neighbours (" +
                           plural(report.misoriented_edges.count, "edge", "edges") + " disagreed, the first near " +
                           shown(report.misoriented_edges.first_mm) + ").");
  const Gaps gaps = count_unbalanced_edges(m, report);
  if (report.unbalanced_edges) {
    report.refusal = not_closed_refusal(gaps, shells.one_sided);
  } else {
    orient_shells(m, shells, report, progress);
    const std::vector<double> volumes = shell_volumes(m, shells.of_triangle, shells.count);
    const double volume = std::accumulate(volumes.begin(), volumes.end(), 0.0);
    const double diagonal = m.triangles.empty() ? 0 : bounding_box(m).diagonal().norm();
    report.usable = volume > 1e-12 * diagonal * diagonal * diagonal;
    if (!report.usable) report.refusal = no_volume_refusal(m, volume);
  }
  report.triangles_turned = turned();
  drop_unused_vertices(m);
  return checked;
}

/// A mesh after first aid with what was found before it.
CheckedMesh mended(const CheckedMesh& before, FirstAid&& aid, CheckedMesh&& after) {
  CheckedMesh result{std::move(after.mesh), before.report};
  MeshReport& report = result.report;
  const MeshReport& now = after.report;
  report.first_aid = aid.report;
  report.unbalanced_edges = now.unbalanced_edges;
  report.self_intersections = now.self_intersections;
  report.components = now.components;
  report.nested_components = now.nested_components;
  report.cavities = now.cavities;
  report.components_turned += now.components_turned;
  report.triangles_turned += now.triangles_turned;
  report.usable = now.usable;
  report.refusal = now.refusal;
  report.notes.insert(report.notes.end(), aid.notes.begin(), aid.notes.end());
  report.notes.insert(report.notes.end(), now.notes.begin(), now.notes.end());
  return result;
}

/// What CheckOptions::repair would do, for a refusal.
std::string repair_words(const FirstAidReport& aid) {
  std::string words;
  if (aid.corners_joined > 0)
    words = concat("joins ", plural(aid.corners_joined, "corner", "corners"), " with others up to ", shown(aid.joined_within, 2),
                   " away");
  if (aid.holes_closed > 0)
    words += concat(words.empty() ? "" : " and ", "closes ", plural(aid.holes_closed, "hole", "holes"), ": ",
                    shown(100 * aid.surface_change, 2), " % of the surface would be new or gone");
  return concat(" --repair closes the surface by a guess: it ", words, ". Try it, and look at the result.");
}

/// After first aid; none where it does not make the mesh usable. @param left  what is open then
std::optional<CheckedMesh> aided(const CheckedMesh& before, const CheckOptions& options, const Progress& progress,
                                 std::string* left) {
  FirstAid aid = first_aid(before.mesh, options.repair, progress);
  *left = aid.left;
  if (!aid.closed) return std::nullopt;
  CheckedMesh after = examined(aid.mesh, {.self_intersections = options.self_intersections, .first_aid = false}, progress);
  if (!after.report.usable) return std::nullopt;
  return mended(before, std::move(aid), std::move(after));
}

/// check_mesh, bodies that overlap left as they are.
CheckedMesh closed(const Mesh& mesh, const CheckOptions& options, const Progress& progress) {
  CheckedMesh checked = examined(mesh, options, progress);
  MeshReport& report = checked.report;
  if (!report.unbalanced_edges) return checked;
  if (options.first_aid) {
    std::string left;
    if (std::optional<CheckedMesh> result = aided(checked, options, progress, &left)) return std::move(*result);
    if (!left.empty()) report.refusal += " First aid cannot close it: " + left + ".";
    if (options.self_intersections && counted_later(options, report)) {
      const Cleaned cleaned = clean(mesh);
      count_self_intersections(cleaned.mesh, cleaned.is_flat, report, progress);
    }
    if (!options.repair) {
      const CheckOptions repair{.self_intersections = false, .repair = true};
      if (const std::optional<CheckedMesh> repaired = aided(checked, repair, progress, &left)) {
        report.repairable = true;
        report.refusal += repair_words(repaired->report.first_aid);
        return checked;
      }
    }
  }
  report.refusal += concat(" ", kHowToRepair);
  return checked;
}

/// Makes one of bodies that overlap. What was found of them stays.
void unite(CheckedMesh& checked, const Progress& progress) {
  UnitedBodies united = united_bodies(checked.mesh, checked.report.duplicate.count > 0, progress);
  MeshReport& report = checked.report;
  if (united.bodies == 0) return;
  const std::string who = plural(united.bodies, "body overlaps", "bodies overlap");
  CheckedMesh after;
  if (united.left.empty()) {
    after = examined(united.mesh, {.self_intersections = false, .first_aid = false}, progress);
    if (!after.report.usable) united.left = "it would not be closed";
  }
  if (!united.left.empty()) {
    report.notes.push_back(concat(who, " and could not be made one: ", united.left, ". They stay solid where they overlap."));
    return;
  }
  std::erase(report.notes, self_intersection_words(report.self_intersections));
  report.cavities = after.report.cavities;  // bodies may enclose one together
  report.first_aid.bodies_united = united.bodies;
  report.notes.push_back(concat("First aid: ", who, ": taken as one where they do, the faces inside left out. ",
                                plural(checked.mesh.triangles.size(), "triangle", "triangles"), " before, ",
                                after.mesh.triangles.size(), " after."));
  checked.mesh = std::move(after.mesh);
}

}  // namespace

CheckedMesh check_mesh(const Mesh& mesh, const CheckOptions& options, const Progress& progress) {
  CheckedMesh checked = closed(mesh, options, progress);
  if (checked.report.usable && options.first_aid && options.unite) unite(checked, progress);
  return checked;
}

void require_size(const Mesh& mesh, const std::string& name) {
  constexpr double kFurthest_mm = 1e12;
  if (mesh.triangles.empty()) return;
  const Eigen::AlignedBox3d box = bounding_box(mesh);
  const double longest = box.sizes().maxCoeff();
  const std::string begin = name.empty() ? "" : name + ": ";
  if (!(longest >= kSmallestBody_mm && longest <= kLargestBody_mm))
    throw Error(ErrorCode::input, concat(begin, "The longest side is ", shown(longest, 3), " mm, and must lie between ",
                                         shown(kSmallestBody_mm), " mm and ", shown(kLargestBody_mm / 1e6),
                                         " km. Say what the file's numbers mean (--unit), or the size that you want (--size)."));
  const double furthest = std::max(box.min().cwiseAbs().maxCoeff(), box.max().cwiseAbs().maxCoeff());
  if (!(furthest <= kFurthest_mm))
    throw Error(ErrorCode::input,
                concat(begin, "It lies ", shown(furthest, 3), " mm from the origin, where numbers are too coarse ",
                       "for it. Move the model to the origin and export it again."));
}

CheckedMesh require_solid(const Mesh& mesh, const std::string& name, const CheckOptions& options, const Progress& progress) {
  CheckedMesh checked = check_mesh(mesh, options, progress);
  if (!checked.report.usable) throw Error(ErrorCode::input, name + ": " + checked.report.refusal);
  return checked;
}

}  // namespace rayrep
