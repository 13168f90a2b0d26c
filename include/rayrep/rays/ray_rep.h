#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <vector>

namespace rayrep {

/// A closed interval of a ray, mm. Empty when hi <= lo.
struct Interval {
  double lo = 0;
  double hi = 0;
  double length() const { return hi - lo; }
  double middle() const { return 0.5 * (lo + hi); }
};

/// A regular grid of rays along +z: ray (i, j) runs through (origin.x + i spacing, origin.y + j spacing), 0 <= i < nx, 0 <= j < ny.
struct RayGrid {
  Eigen::Vector2d origin_mm = Eigen::Vector2d::Zero();
  double spacing_mm = 1;
  int nx = 0;
  int ny = 0;
  /// By how much more material, per volume, a ray holds where it is full than where it is empty: 1 for solid and void, less than 1
  /// where empty means infill. Moments and their derivatives are proportional to it, volumes are not.
  double weight = 1;
  /// Of what fills a ray there is no more than this volume, and `substitute` of its weight where it is too dear: theory.md (49).
  double most_mm3 = std::numeric_limits<double>::infinity();
  double substitute = 0;

  std::size_t size() const { return static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny); }
  Eigen::Vector2d at(std::size_t ray) const;  ///< ray = j nx + i
  double cell_area_mm2() const { return spacing_mm * spacing_mm; }
  double weighted_area_mm2() const { return weight * cell_area_mm2(); }
};

/// A solid as its intersections with a grid of rays (ray-reps paper, Eq. 1): the intervals of ray r are
/// intervals[first[r]] ... intervals[first[r + 1]] (exclusive), disjoint and ascending.
struct RayRep {
  RayGrid grid;
  std::vector<std::uint32_t> first;  ///< size grid.size() + 1
  std::vector<Interval> intervals;

  /// Volume by quadrature: sum of lengths times the cell area, mm^3.
  double volume_mm3() const;

  /// Every `step`-th ray in both directions: the same solid on a coarser grid.
  RayRep thinned(int step) const;
};

}  // namespace rayrep
