#include "judge/outer_surface.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <utility>

#include "base/linear_algebra.h"
#include "base/union_find.h"
#include "mesh/float32.h"
#include "mesh/mesh_edges.h"
#include "mesh/surface_distance.h"
#include "rayrep/mesh/surface_query.h"

namespace rayrep::verify_detail {
namespace {

template <typename Number>
struct Hash {
  std::size_t operator()(const std::array<Number, 3>& key) const {
    std::uint64_t hash = 0;
    for (const Number x : key) {
      hash = (hash ^ bits(x)) * 0x9e3779b97f4a7c15u;
      hash ^= hash >> 32;
    }
    return hash;
  }
  static std::uint64_t bits(int x) { return static_cast<std::uint32_t>(x); }
  static std::uint64_t bits(double x) { return std::bit_cast<std::uint64_t>(x); }
};

std::array<double, 3> coordinates(const Eigen::Vector3d& p, bool as_float) {
  std::array<double, 3> result;
  for (int k = 0; k < 3; ++k) result[static_cast<std::size_t>(k)] = (as_float ? as_float32(p[k]) : p[k]) + 0.0;  // -0 becomes 0
  return result;
}

std::array<int, 3> sorted_corners(const Eigen::Vector3i& t, const std::vector<int>& numbers) {
  std::array<int, 3> corners{numbers[t[0]], numbers[t[1]], numbers[t[2]]};
  std::sort(corners.begin(), corners.end());
  return corners;
}

}  // namespace

Match match(const Mesh& delivered, const Mesh& original, bool as_float) {
  std::unordered_map<std::array<double, 3>, int, Hash<double>> points;
  points.reserve(original.vertices.size());
  std::vector<int> numbers;  // of the vertices, by their points
  for (const auto& v : original.vertices)
    numbers.push_back(points.try_emplace(coordinates(v, as_float), static_cast<int>(points.size())).first->second);
  std::unordered_map<std::array<int, 3>, std::vector<int>, Hash<int>> expected;
  expected.reserve(original.triangles.size());
  for (std::size_t t = 0; t < original.triangles.size(); ++t)
    expected[sorted_corners(original.triangles[t], numbers)].push_back(static_cast<int>(t));

  numbers.resize(delivered.vertices.size());
  tbb::parallel_for(std::size_t{0}, numbers.size(), [&](std::size_t v) {
    const auto found = points.find(coordinates(delivered.vertices[v], as_float));
    numbers[v] = found == points.end() ? -1 : found->second;
  });
  Match result;
  result.delivered.resize(delivered.triangles.size(), false);
  for (std::size_t t = 0; t < delivered.triangles.size(); ++t) {
    const std::array<int, 3> corners = sorted_corners(delivered.triangles[t], numbers);
    if (corners[0] < 0) continue;
    const auto found = expected.find(corners);
    if (found == expected.end() || found->second.empty()) continue;
    found->second.pop_back();
    result.delivered[t] = true;
  }
  for (const auto& [corners, left] : expected) result.missing.insert(result.missing.end(), left.begin(), left.end());
  std::sort(result.missing.begin(), result.missing.end());
  return result;
}

double outer_deviation(const OuterSurfaces& surfaces, const Progress& progress) {
  Eigen::AlignedBox3d box = bounding_box(surfaces.original);
  box.extend(bounding_box(surfaces.delivered));
  DistanceTolerance tolerance;
  tolerance.absolute_mm = std::ldexp(box.diagonal().norm(), -30);
  double largest = 0;
  if (!surfaces.added.triangles.empty())
    largest = largest_distance(surfaces.added, SurfaceQuery(surfaces.original), largest, tolerance, progress);
  if (!surfaces.gone.triangles.empty())
    largest = largest_distance(surfaces.gone, SurfaceQuery(surfaces.delivered), largest, tolerance, progress);
  // Of a face cut into other triangles corners lie beside it by what computing their distances leaves.
  return largest > std::ldexp(box.diagonal().norm(), -40) ? largest : 0;
}

namespace {

constexpr double kWider = 1.01;  // than asked for, by rounding
constexpr double kAround = 1.02;

// A side of a triangle on the outside, as it is run there, whose other side is not.
struct RimSide {
  int from, to;
  int inside;  // the triangle beyond
};

std::vector<RimSide> rim_sides(const Mesh& outer, const std::vector<char>& inside) {
  std::vector<RimSide> rim;
  for_each_edge(outer, [&](auto begin, auto end) {
    const auto within = std::find_if(begin, end, [&](const EdgeUse& use) { return inside[use.triangle]; });
    const auto without = std::find_if(begin, end, [&](const EdgeUse& use) { return !inside[use.triangle]; });
    if (within == end || without == end) return;
    const bool up = without->direction > 0;
    rim.push_back({up ? without->low : without->high, up ? without->high : without->low, within->triangle});
  });
  return rim;
}

// The direction across which the triangles beyond a rim lie, outward.
Eigen::Vector3d axis_of(const Mesh& outer, const std::vector<RimSide>& rim, const Eigen::Vector3d& centre) {
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  Eigen::Vector3d beyond = Eigen::Vector3d::Zero();
  double area = 0;
  for (const RimSide& side : rim) {
    const auto t = static_cast<std::size_t>(side.inside);
    const Eigen::Vector3d n = (outer.corner(t, 1) - outer.corner(t, 0)).cross(outer.corner(t, 2) - outer.corner(t, 0));
    if (!(n.norm() > 0)) continue;
    spread += n * n.transpose() / n.norm();
    beyond += n.norm() * (outer.corner(t, 0) + outer.corner(t, 1) + outer.corner(t, 2)) / 3;
    area += n.norm();
  }
  if (!(area > 0)) return Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d axis = symmetric_eigen(spread).vectors.col(0);
  return axis.dot(centre - beyond / area) < 0 ? Eigen::Vector3d(-axis) : axis;
}

// Its centre is that of the area that the rim encloses, seen along the axis.
Mouth mouth_of(const Mesh& outer, const std::vector<RimSide>& rim) {
  Mouth mouth;
  double length = 0;
  for (const RimSide& side : rim) {
    const double l = (outer.vertices[side.to] - outer.vertices[side.from]).norm();
    mouth.centre_mm += 0.5 * l * (outer.vertices[side.to] + outer.vertices[side.from]);
    length += l;
  }
  mouth.centre_mm /= length;
  mouth.axis = axis_of(outer, rim, mouth.centre_mm);
  double area = 0;
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  for (const RimSide& side : rim) {
    const Eigen::Vector3d a = outer.vertices[side.from] - mouth.centre_mm;
    const Eigen::Vector3d b = outer.vertices[side.to] - mouth.centre_mm;
    const double twice = mouth.axis.dot(a.cross(b));
    area += twice;
    moment += twice * (a + b) / 3;
  }
  if (area != 0) {
    const Eigen::Vector3d off = moment / area;
    mouth.centre_mm += off - mouth.axis.dot(off) * mouth.axis;
  }
  for (const RimSide& side : rim) {
    const Eigen::Vector3d p = outer.vertices[side.from] - mouth.centre_mm;
    mouth.diameter_mm = std::max(mouth.diameter_mm, 2 * (p - mouth.axis.dot(p) * mouth.axis).norm());
  }
  return mouth;
}

double from_axis(const Mouth& mouth, const Eigen::Vector3d& p) {
  const Eigen::Vector3d d = p - mouth.centre_mm;
  return (d - mouth.axis.dot(d) * mouth.axis).norm();
}

// A piece of a surface, but for rounding. What stands on it in a kink of a rim is as near, and runs across it.
bool lies_on(const Mesh& outer, std::size_t t, const SurfaceQuery& surface, double rounding_mm) {
  const Eigen::Vector3d &a = outer.corner(t, 0), &b = outer.corner(t, 1), &c = outer.corner(t, 2);
  const ClosestPoint middle = surface.closest((a + b + c) / 3, rounding_mm);
  if (middle.triangle < 0) return false;
  for (const Eigen::Vector3d& p :
       {a, b, c, Eigen::Vector3d((a + b) / 2), Eigen::Vector3d((b + c) / 2), Eigen::Vector3d((c + a) / 2)})
    if (surface.closest(p, rounding_mm).triangle < 0) return false;
  const auto s = static_cast<std::size_t>(middle.triangle);
  const Mesh& mesh = surface.mesh();
  const Eigen::Vector3d n = (b - a).cross(c - a);
  const Eigen::Vector3d there = (mesh.corner(s, 1) - mesh.corner(s, 0)).cross(mesh.corner(s, 2) - mesh.corner(s, 0));
  const bool flat = n.norm() <= rounding_mm * std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
  return flat || n.dot(there) > 0.5 * n.norm() * there.norm();
}

// Rims that hang together, in the order of their first sides.
std::vector<std::vector<RimSide>> rims_of(const Mesh& outer, const std::vector<RimSide>& sides) {
  UnionFind joined(static_cast<int>(outer.vertices.size()));
  for (const RimSide& side : sides) joined.unite(side.from, side.to);
  std::unordered_map<int, std::size_t> numbers;
  std::vector<std::vector<RimSide>> rims;
  for (const RimSide& side : sides) {
    const auto [at, is_new] = numbers.try_emplace(joined.root(side.from), rims.size());
    if (is_new) rims.emplace_back();
    rims[at->second].push_back(side);
  }
  return rims;
}

// Pieces of what is inside, by triangle; -1 for all others.
std::pair<std::vector<int>, int> pieces_inside(const Mesh& outer, const std::vector<char>& inside) {
  Mesh only;
  only.vertices = outer.vertices;
  std::vector<std::size_t> numbers;
  for (std::size_t t = 0; t < inside.size(); ++t)
    if (inside[t]) {
      only.triangles.push_back(outer.triangles[t]);
      numbers.push_back(t);
    }
  const Components components = connected_components(only);
  std::vector<int> piece(inside.size(), -1);
  for (std::size_t i = 0; i < numbers.size(); ++i) piece[numbers[i]] = components.of_triangle[i];
  return {std::move(piece), components.count};
}

// Marks what is joined to a rim within the cylinder around it.
void mark_hole(const Mesh& outer, const VertexCorners& at, const Mouth& mouth, const std::vector<RimSide>& rim,
               HoledOutside& found) {
  const double radius_mm = 0.5 * kAround * mouth.diameter_mm;
  std::vector<int> left;
  for (const RimSide& side : rim) left.push_back(side.inside);
  while (!left.empty()) {
    const int t = left.back();
    left.pop_back();
    if (!found.inside[t] || found.in_hole[t]) continue;
    const Eigen::Vector3i& v = outer.triangles[t];
    if (std::any_of(v.begin(), v.end(), [&](int k) { return from_axis(mouth, outer.vertices[k]) > radius_mm; })) continue;
    found.in_hole[t] = 1;
    for (const int k : v)
      for (int n = at.first[k]; n < at.first[k + 1]; ++n) left.push_back(at.corners[n] / 3);
  }
}

}  // namespace

HoledOutside holes_in(const Holed& what, const Progress& progress) {
  const Mesh& outer = what.outer;
  HoledOutside found;
  found.inside.assign(outer.triangles.size(), 0);
  found.in_hole = found.inside;
  const SurfaceQuery original(what.original);
  tbb::parallel_for(std::size_t{0}, outer.triangles.size(),
                    [&](std::size_t t) { found.inside[t] = !what.unchanged[t] && !lies_on(outer, t, original, what.rounding_mm); });
  progress.check();
  const auto [piece, count] = pieces_inside(outer, found.inside);
  const std::vector<std::vector<RimSide>> rims = rims_of(outer, rim_sides(outer, found.inside));
  std::vector<Mouth> mouths;
  std::vector<char> open(static_cast<std::size_t>(count), 0);  // 1: by holes, 2: by something else
  for (const auto& rim : rims) {
    mouths.push_back(mouth_of(outer, rim));
    char& state = open[static_cast<std::size_t>(piece[static_cast<std::size_t>(rim.front().inside)])];
    state = mouths.back().diameter_mm <= kWider * what.widest_mm ? std::max<char>(state, 1) : 2;
  }
  for (std::size_t t = 0; t < piece.size(); ++t)
    if (piece[t] >= 0 && open[static_cast<std::size_t>(piece[t])] != 1) found.inside[t] = 0;
  found.cavities = static_cast<std::size_t>(std::count(open.begin(), open.end(), 1));

  found.sealed.vertices = outer.vertices;
  for (std::size_t t = 0; t < outer.triangles.size(); ++t)
    if (!found.inside[t]) found.sealed.triangles.push_back(outer.triangles[t]);
  const VertexCorners at(outer);
  for (std::size_t n = 0; n < rims.size(); ++n) {
    if (open[static_cast<std::size_t>(piece[static_cast<std::size_t>(rims[n].front().inside)])] != 1) continue;
    Mouth& mouth = mouths[n];
    mark_hole(outer, at, mouth, rims[n], found);
    const auto middle = static_cast<int>(found.sealed.vertices.size());
    const Eigen::Vector3d to_surface = original.closest(mouth.centre_mm, mouth.diameter_mm).point_mm - mouth.centre_mm;
    mouth.centre_mm += mouth.axis.dot(to_surface) * mouth.axis;
    found.sealed.vertices.push_back(mouth.centre_mm);
    for (const RimSide& side : rims[n]) found.sealed.triangles.emplace_back(side.to, side.from, middle);
    found.mouths.push_back(mouth);
  }
  return found;
}

Mesh beside_mouths(const Mesh& mesh, const std::vector<Mouth>& mouths, double widest_mm) {
  const double radius_mm = 0.5 * kAround * widest_mm;
  const auto within = [&](const Mouth& mouth, const Eigen::Vector3d& p) {
    return from_axis(mouth, p) <= radius_mm && std::abs(mouth.axis.dot(p - mouth.centre_mm)) <= widest_mm;
  };
  Mesh pieces;
  std::vector<Eigen::Matrix3d> left;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    left.emplace_back();
    left.back() << mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2);
  }
  while (!left.empty()) {
    const Eigen::Matrix3d corners = left.back();
    left.pop_back();
    const Eigen::Vector3d middle = corners.rowwise().mean();
    const double size_mm = (corners.colwise() - middle).colwise().norm().maxCoeff();
    bool dropped = false;
    bool near = false;
    for (const Mouth& mouth : mouths) {
      dropped = dropped || (within(mouth, corners.col(0)) && within(mouth, corners.col(1)) && within(mouth, corners.col(2)));
      near = near || (from_axis(mouth, middle) <= radius_mm + size_mm &&
                      std::abs(mouth.axis.dot(middle - mouth.centre_mm)) <= widest_mm + size_mm);
    }
    if (dropped) continue;
    if (!near || size_mm <= 0.005 * widest_mm) {
      const auto first = static_cast<int>(pieces.vertices.size());
      for (int k = 0; k < 3; ++k) pieces.vertices.emplace_back(corners.col(k));
      pieces.triangles.emplace_back(first, first + 1, first + 2);
      continue;
    }
    Eigen::Matrix3d halves;  // of the sides
    for (int k = 0; k < 3; ++k) halves.col(k) = 0.5 * (corners.col(k) + corners.col((k + 1) % 3));
    left.push_back(halves);
    for (int k = 0; k < 3; ++k) {
      left.emplace_back();
      left.back() << corners.col(k), halves.col(k), halves.col((k + 2) % 3);
    }
  }
  return pieces;
}

}  // namespace rayrep::verify_detail
