#include "rayrep/rays/ray_rep.h"

namespace rayrep {

Eigen::Vector2d RayGrid::at(std::size_t ray) const {
  const auto columns = static_cast<std::size_t>(nx);
  return origin_mm + spacing_mm * Eigen::Vector2d(static_cast<double>(ray % columns), static_cast<double>(ray / columns));
}

double RayRep::volume_mm3() const {
  double length = 0;
  for (const Interval& interval : intervals) length += interval.length();
  return length * grid.cell_area_mm2();
}

RayRep RayRep::thinned(int step) const {
  RayRep coarse;
  coarse.grid = grid;
  coarse.grid.spacing_mm *= step;
  coarse.grid.nx = (grid.nx + step - 1) / step;
  coarse.grid.ny = (grid.ny + step - 1) / step;
  coarse.first.push_back(0);
  for (int j = 0; j < grid.ny; j += step)
    for (int i = 0; i < grid.nx; i += step) {
      const std::size_t ray = static_cast<std::size_t>(j) * static_cast<std::size_t>(grid.nx) + static_cast<std::size_t>(i);
      coarse.intervals.insert(coarse.intervals.end(), intervals.begin() + first[ray], intervals.begin() + first[ray + 1]);
      coarse.first.push_back(static_cast<std::uint32_t>(coarse.intervals.size()));
    }
  return coarse;
}

}  // namespace rayrep
