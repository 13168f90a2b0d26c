#include "mesh/holes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "mesh/order.h"
#include "mesh/polygon.h"

namespace rayrep {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Up to so many vertices a loop is triangulated with the smallest area, which takes the cube of them.
constexpr std::size_t kMostForSmallest = 200;

Hole hole_of(const Mesh& mesh, std::vector<int> loop) {
  Hole hole;
  std::rotate(
      loop.begin(),
      std::min_element(loop.begin(), loop.end(), [&](int a, int b) { return comes_first(mesh.vertices[a], mesh.vertices[b]); }),
      loop.end());
  hole.loop = std::move(loop);
  Eigen::AlignedBox3d box;
  for (const int v : hole.loop) {
    box.extend(mesh.vertices[v]);
    hole.middle += mesh.vertices[v] / static_cast<double>(hole.loop.size());
  }
  for (std::size_t n = 0; n < hole.loop.size(); ++n) {
    const Vector3d& a = mesh.vertices[hole.loop[n]];
    const Vector3d& b = mesh.vertices[hole.loop[(n + 1) % hole.loop.size()]];
    hole.length += (b - a).norm();
    hole.normal += (a - hole.middle).cross(b - hole.middle);
  }
  hole.size = box.diagonal().norm();
  if (hole.normal.norm() > 1e-12 * hole.size * hole.size) {
    hole.normal.normalize();
    for (const int v : hole.loop) hole.bulge = std::max(hole.bulge, std::abs(hole.normal.dot(mesh.vertices[v] - hole.middle)));
  } else {
    hole.normal.setZero();
  }
  return hole;
}

double area(const Mesh& mesh, int a, int b, int c) {
  return 0.5 * (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]).norm();
}

// ------------------------------------------------------------------------------------------------------------------- bent ones

/// The triangulation of smallest area, by the smallest areas of its parts (Barequet and Sharir 1995).
void close_smallest(const std::vector<int>& loop, Mesh& mesh) {
  const std::size_t n = loop.size();
  std::vector<double> least(n * n, 0);  // of the part from vertex i to k
  std::vector<std::size_t> tip(n * n, 0);
  for (std::size_t span = 2; span < n; ++span)
    for (std::size_t i = 0; i + span < n; ++i) {
      const std::size_t k = i + span;
      double best = std::numeric_limits<double>::infinity();
      for (std::size_t j = i + 1; j < k; ++j) {
        const double sum = least[i * n + j] + least[j * n + k] + area(mesh, loop[i], loop[j], loop[k]);
        if (sum >= best) continue;
        best = sum;
        tip[i * n + k] = j;
      }
      least[i * n + k] = best;
    }
  std::vector<std::pair<std::size_t, std::size_t>> parts{{0, n - 1}};
  while (!parts.empty()) {
    const auto [i, k] = parts.back();
    parts.pop_back();
    if (k - i < 2) continue;
    const std::size_t j = tip[i * n + k];
    mesh.triangles.emplace_back(loop[i], loop[j], loop[k]);
    parts.emplace_back(i, j);
    parts.emplace_back(j, k);
  }
}

/// The chord that is shortest for what it cuts off, which is at least a fifth.
std::pair<std::size_t, std::size_t> best_chord(const std::vector<int>& loop, const Mesh& mesh) {
  const std::size_t n = loop.size();
  const std::size_t step = 1 + n / 4000;
  std::pair<std::size_t, std::size_t> best{0, n / 2};
  double shortest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < n; i += step)
    for (std::size_t k = i + n / 5; k < n && k - i <= n - n / 5; k += step) {
      const double length2 = (mesh.vertices[loop[i]] - mesh.vertices[loop[k]]).squaredNorm();
      const auto part = static_cast<double>(std::min(k - i, n - (k - i)));
      if (length2 >= shortest * part * part) continue;
      shortest = length2 / (part * part);
      best = {i, k};
    }
  return best;
}

// ------------------------------------------------------------------------------------------------------------------- flat ones

double cross(const Vector2d& a, const Vector2d& b, const Vector2d& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

/// A plane seen such that loops around `normal` run counter-clockwise; a coordinate is dropped.
struct View {
  int u, v;
  explicit View(const Vector3d& normal) {
    int axis = 0;
    normal.cwiseAbs().maxCoeff(&axis);
    u = (axis + 1) % 3;
    v = (axis + 2) % 3;
    if (normal[axis] < 0) std::swap(u, v);
  }
  Vector2d of(const Vector3d& p) const { return {p[u], p[v]}; }
};

bool encloses(const View& view, const Mesh& mesh, const std::vector<int>& loop, const Vector2d& p) {
  bool inside = false;
  for (std::size_t n = 0; n < loop.size(); ++n) {
    const Vector2d a = view.of(mesh.vertices[loop[n]]);
    const Vector2d b = view.of(mesh.vertices[loop[(n + 1) % loop.size()]]);
    if ((a.y() > p.y()) == (b.y() > p.y())) continue;
    if ((cross(a, b, p) > 0) == (b.y() > a.y())) inside = !inside;
  }
  return inside;
}

/// The outline with a hole joined to it by a double edge from the hole's outermost vertex to one of the outline's that it sees.
std::vector<int> bridged(const std::vector<int>& outline, const std::vector<int>& hole, const View& view, const Mesh& mesh) {
  const auto at = [&](int v) { return view.of(mesh.vertices[v]); };
  const auto start = std::max_element(
      hole.begin(), hole.end(), [&](int a, int b) { return std::pair(at(a).x(), at(a).y()) < std::pair(at(b).x(), at(b).y()); });
  const Vector2d h = at(*start);
  // The nearest edge to the right, then the most forward of the corners in the triangle between it and the hole.
  const std::size_t n = outline.size();
  double nearest = std::numeric_limits<double>::infinity();
  std::size_t chosen = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const Vector2d a = at(outline[i]);
    const Vector2d b = at(outline[(i + 1) % n]);
    if (a.y() > h.y() || b.y() <= h.y()) continue;  // runs upward: the inside is to its left
    const double x = a.x() + (h.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
    if (x < h.x() || x >= nearest) continue;
    nearest = x;
    chosen = a.x() > b.x() ? i : (i + 1) % n;
  }
  if (std::isfinite(nearest)) {
    const Vector2d hit(nearest, h.y());
    const Vector2d corner = at(outline[chosen]);
    const double turn = cross(h, hit, corner) < 0 ? -1 : 1;
    double steepest = std::numeric_limits<double>::infinity();
    double closest = steepest;
    for (std::size_t i = 0; i < n; ++i) {
      const Vector2d q = at(outline[i]);
      if (q.x() < h.x() || q == h) continue;
      if (turn * cross(h, hit, q) < 0 || turn * cross(hit, corner, q) < 0 || turn * cross(corner, h, q) < 0) continue;
      // Where corners repeat, at an earlier bridge, only the one that opens towards the hole will do.
      const Vector2d before = at(outline[(i + n - 1) % n]);
      const Vector2d after = at(outline[(i + 1) % n]);
      const bool convex = cross(before, q, after) >= 0;
      const bool left_of_before = cross(before, q, h) > 0;
      const bool left_of_after = cross(q, after, h) > 0;
      if (convex ? !(left_of_before && left_of_after) : !(left_of_before || left_of_after)) continue;
      const double slope = std::abs(q.y() - h.y()) / std::max(q.x() - h.x(), std::numeric_limits<double>::min());
      const double distance = (q - h).squaredNorm();
      if (slope > steepest || (slope == steepest && distance >= closest)) continue;
      steepest = slope;
      closest = distance;
      chosen = i;
    }
  }
  std::vector<int> result(outline.begin(), outline.begin() + static_cast<std::ptrdiff_t>(chosen) + 1);
  result.insert(result.end(), start, hole.end());
  result.insert(result.end(), hole.begin(), start + 1);
  result.insert(result.end(), outline.begin() + static_cast<std::ptrdiff_t>(chosen), outline.end());
  return result;
}

/// For each hole the smallest one around it in the same plane that faces the other way, or -1.
std::vector<int> outlines_around(const std::vector<Hole>& holes, double tolerance, const Mesh& mesh, const Progress& progress) {
  std::vector<Eigen::AlignedBox3d> boxes(holes.size());
  for (std::size_t n = 0; n < holes.size(); ++n)
    for (const int v : holes[n].loop) boxes[n].extend(mesh.vertices[v]);
  std::vector<int> order(holes.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    const double x = boxes[a].min().x();
    const double y = boxes[b].min().x();
    return x != y ? x < y : a < b;
  });
  std::vector<int> around(holes.size(), -1);
  std::vector<int> open;  // those whose boxes reach as far as the sweep along x
  for (std::size_t done = 0, next = 0; done < order.size(); ++done) {
    if (done % 1024 == 0) progress.check();
    const int n = order[done];
    const double x = boxes[n].min().x();
    for (; next < order.size() && boxes[order[next]].min().x() <= x; ++next) open.push_back(order[next]);
    std::erase_if(open, [&](int other) { return boxes[other].max().x() < x; });
    for (const int m : open) {
      const Eigen::AlignedBox3d reach(boxes[m].min().array() - tolerance, boxes[m].max().array() + tolerance);
      if (m == n || !reach.contains(boxes[n]) || !(holes[m].normal.dot(holes[n].normal) < -0.99)) continue;
      const bool level = std::all_of(holes[n].loop.begin(), holes[n].loop.end(), [&](int v) {
        return std::abs(holes[m].normal.dot(mesh.vertices[v] - holes[m].middle)) <= std::max(tolerance, holes[m].bulge);
      });
      if (!level || (around[n] >= 0 && holes[around[n]].length <= holes[m].length)) continue;
      const View view(holes[m].normal);
      if (encloses(view, mesh, holes[m].loop, view.of(mesh.vertices[holes[n].loop[0]]))) around[n] = m;
    }
  }
  // What lies in a hole of an outline is an outline again.
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return holes[a].length > holes[b].length; });
  for (const int n : order)
    if (around[n] >= 0 && around[around[n]] >= 0) around[n] = -1;
  return around;
}

}  // namespace

std::vector<Hole> holes_of(const Mesh& mesh, const Rims& rims) {
  // By the places of their ends, so that numbers do not matter.
  std::vector<int> by_place = rims.vertices;
  std::sort(by_place.begin(), by_place.end(), [&](int a, int b) { return comes_first(mesh.vertices[a], mesh.vertices[b]); });
  std::vector<int> rank(mesh.vertices.size(), -1);
  for (std::size_t n = 0; n < by_place.size(); ++n) rank[by_place[n]] = static_cast<int>(n);
  std::vector<std::pair<int, int>> steps;  // ranks, ascending
  for (const Rims::Edge& edge : rims.edges)
    for (int n = 0; n < edge.times; ++n) steps.emplace_back(rank[edge.from], rank[edge.to]);
  std::sort(steps.begin(), steps.end());
  std::vector<std::size_t> next(by_place.size() + 1, 0);
  for (const auto& [from, to] : steps) ++next[static_cast<std::size_t>(from) + 1];
  std::partial_sum(next.begin(), next.end(), next.begin());
  const std::vector<std::size_t> first = next;

  std::vector<Hole> holes;
  std::vector<int> path;
  std::vector<int> place(by_place.size(), -1);  // in the path
  for (std::size_t start = 0; start < by_place.size(); ++start)
    while (next[start] < first[start + 1]) {
      path.assign(1, static_cast<int>(start));
      place[start] = 0;
      // As many steps lead away from a vertex as to it: a path ends where it began. What it meets of itself on the way is a loop.
      while (true) {
        const auto from = static_cast<std::size_t>(path.back());
        if (next[from] == first[from + 1]) break;
        const int to = steps[next[from]++].second;
        if (place[static_cast<std::size_t>(to)] < 0) {
          place[static_cast<std::size_t>(to)] = static_cast<int>(path.size());
          path.push_back(to);
          continue;
        }
        std::vector<int> loop;
        const auto keep = static_cast<std::size_t>(place[static_cast<std::size_t>(to)]);
        for (std::size_t n = keep; n < path.size(); ++n) loop.push_back(by_place[path[n]]);
        for (std::size_t n = keep + 1; n < path.size(); ++n) place[static_cast<std::size_t>(path[n])] = -1;
        path.resize(keep + 1);
        holes.push_back(hole_of(mesh, std::move(loop)));
      }
      for (const int n : path) place[static_cast<std::size_t>(n)] = -1;
    }
  return holes;
}

void close_flat(const std::vector<Hole>& holes, double tolerance, Mesh& mesh, const Progress& progress) {
  const std::vector<int> around = outlines_around(holes, tolerance, mesh, progress);
  std::vector<std::vector<int>> within(holes.size());
  for (std::size_t n = 0; n < holes.size(); ++n)
    if (around[n] >= 0) within[around[n]].push_back(static_cast<int>(n));
  for (std::size_t n = 0; n < holes.size(); ++n) {
    if (around[n] >= 0) continue;
    progress.check();
    std::vector<int> polygon = holes[n].loop;
    const View view(holes[n].normal);
    // From the right to the left: then a bridge crosses no hole that is still to be joined.
    const auto right_end = [&](int m) {
      double x = -std::numeric_limits<double>::infinity();
      for (const int v : holes[m].loop) x = std::max(x, view.of(mesh.vertices[v]).x());
      return x;
    };
    std::stable_sort(within[n].begin(), within[n].end(), [&](int a, int b) { return right_end(a) > right_end(b); });
    for (const int m : within[n]) polygon = bridged(polygon, holes[m].loop, view, mesh);
    append_triangulated(polygon, mesh);
  }
}

void close_bent(const Hole& hole, Mesh& mesh) {
  std::vector<std::vector<int>> parts{hole.loop};
  while (!parts.empty()) {
    const std::vector<int> loop = std::move(parts.back());
    parts.pop_back();
    if (loop.size() <= kMostForSmallest) {
      close_smallest(loop, mesh);
      continue;
    }
    const auto [i, k] = best_chord(loop, mesh);
    const auto from = loop.begin() + static_cast<std::ptrdiff_t>(i);
    const auto to = loop.begin() + static_cast<std::ptrdiff_t>(k);
    parts.emplace_back(from, to + 1);
    std::vector<int> rest(to, loop.end());
    rest.insert(rest.end(), loop.begin(), from + 1);
    parts.push_back(std::move(rest));
  }
}

}  // namespace rayrep
