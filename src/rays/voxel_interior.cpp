#include "rayrep/rays/voxel_interior.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <vector>

#include "rayrep/rays/ray_interior.h"

namespace rayrep {

Eigen::VectorXd FillInterior::lower_bounds() const { return Eigen::VectorXd::Zero(variables()); }

Eigen::VectorXd FillInterior::upper_bounds() const { return Eigen::VectorXd::Ones(variables()); }

Eigen::VectorXd FillInterior::start(double fill) const { return Eigen::VectorXd::Constant(variables(), fill); }

Eigen::Matrix<double, 10, Eigen::Dynamic> FillInterior::contributions(const Eigen::VectorXd& fill) const {
  assert(fill.size() == variables());
  return moments_ * fill.asDiagonal();
}

Eigen::VectorXd FillInterior::hessian_diagonal(const Eigen::VectorXd&, const Moments&, Eigen::Index, Eigen::Index count) const {
  return Eigen::VectorXd::Zero(count);
}

double lowest_end_mm(const RayRep& domain) {
  double lowest = std::numeric_limits<double>::infinity();
  for (const Interval& interval : domain.intervals) lowest = std::min(lowest, interval.lo);
  return std::isfinite(lowest) ? lowest : 0;
}

VoxelInterior::VoxelInterior(const RayRep& domain, int spacings_per_voxel) {
  assert(spacings_per_voxel >= 1);
  const RayGrid& grid = domain.grid;
  const int k = spacings_per_voxel;
  const double side = k * grid.spacing_mm;
  const double bottom = lowest_end_mm(domain);

  std::vector<Moments> cells;
  std::vector<Moments> column;  // of k x k rays, by height
  for (int j0 = 0; j0 < grid.ny; j0 += k)
    for (int i0 = 0; i0 < grid.nx; i0 += k) {
      for (int j = j0; j < std::min(j0 + k, grid.ny); ++j)
        for (int i = i0; i < std::min(i0 + k, grid.nx); ++i) {
          const std::size_t ray = static_cast<std::size_t>(j) * static_cast<std::size_t>(grid.nx) + static_cast<std::size_t>(i);
          for (std::uint32_t n = domain.first[ray]; n < domain.first[ray + 1]; ++n) {
            const Interval& interval = domain.intervals[n];
            const auto above = static_cast<std::size_t>(std::max(0.0, std::ceil((interval.hi - bottom) / side)));
            if (column.size() < above) column.resize(above, Moments::Zero());
            for (auto cell = static_cast<std::size_t>((interval.lo - bottom) / side); cell < above; ++cell) {
              const double lo = std::max(interval.lo, bottom + static_cast<double>(cell) * side);
              const double hi = std::min(interval.hi, bottom + static_cast<double>(cell + 1) * side);
              if (lo < hi) column[cell] += grid.weighted_area_mm2() * segment_moments(grid.at(ray), lo, hi);
            }
          }
        }
      for (const Moments& cell : column)
        if (cell[M1] > 0) cells.push_back(cell);
      column.clear();
    }
  moments_.resize(10, static_cast<Eigen::Index>(cells.size()));
  for (std::size_t n = 0; n < cells.size(); ++n) moments_.col(static_cast<Eigen::Index>(n)) = cells[n];
}

}  // namespace rayrep
