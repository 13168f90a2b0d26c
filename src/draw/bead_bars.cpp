#include "rayrep/draw/bead_bars.h"

#include <array>
#include <utility>

namespace rayrep {

Mesh bead_bars(const std::vector<Bead>& beads) {
  Mesh mesh;
  mesh.vertices.reserve(8 * beads.size());
  mesh.triangles.reserve(12 * beads.size());
  for (const Bead& bead : beads) {
    const Eigen::Vector2d along = (bead.to_mm - bead.from_mm).head<2>();
    const double length = along.norm();
    const Eigen::Vector2d forward = length > 0 ? Eigen::Vector2d(along / length) : Eigen::Vector2d::UnitX();
    const Eigen::Vector2d aside = 0.5 * bead.width_mm * Eigen::Vector2d(-forward.y(), forward.x());
    const Eigen::Vector2d reach = length > 0 ? Eigen::Vector2d::Zero() : Eigen::Vector2d(0.5 * bead.width_mm * forward);
    const auto first = static_cast<int>(mesh.vertices.size());
    for (const double down : {bead.height_mm, 0.0})
      for (const auto& [end, sign] : {std::pair{bead.from_mm, -1.0}, std::pair{bead.to_mm, 1.0}})
        for (const double side : {-sign, sign}) {  // round the bar, against the clock seen from above
          const Eigen::Vector2d plan = end.head<2>() + sign * reach + side * aside;
          mesh.vertices.emplace_back(plan.x(), plan.y(), end.z() - down);
        }
    for (const auto& [a, b, c] : {std::array{0, 2, 1}, std::array{0, 3, 2}, std::array{4, 5, 6}, std::array{4, 6, 7},
                                  std::array{0, 1, 5}, std::array{0, 5, 4}, std::array{1, 2, 6}, std::array{1, 6, 5},
                                  std::array{2, 3, 7}, std::array{2, 7, 6}, std::array{3, 0, 4}, std::array{3, 4, 7}})
      mesh.triangles.emplace_back(first + a, first + b, first + c);
  }
  return mesh;
}

}  // namespace rayrep
