#include "rayrep/ray_rep.h"

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

}  // namespace rayrep
