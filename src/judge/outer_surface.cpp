#include "judge/outer_surface.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <unordered_map>

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
  for (int k = 0; k < 3; ++k)
    result[static_cast<std::size_t>(k)] = (as_float ? static_cast<double>(static_cast<float>(p[k])) : p[k]) + 0.0;  // -0 becomes 0
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

}  // namespace rayrep::verify_detail
