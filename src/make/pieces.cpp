#include "make/pieces.h"

#include <algorithm>

namespace rayrep::detail {

void lay_down(Part& piece, const Eigen::Vector3d& up) {
  piece.to_bed = Eigen::Affine3d::Identity();
  piece.to_bed.linear() = up_to_z(up);
  piece.to_bed.translation().z() = -bounding_box(transformed(piece.mesh, piece.to_bed)).min().z();
}

void lay_side_by_side(std::vector<Part>& pieces) {
  constexpr double kApart_mm = 5;
  constexpr double kBed_mm = 200;  // what beds have at least; a wider piece has a row for itself
  double x = 0;
  double y = 0;
  double row_mm = 0;
  for (Part& piece : pieces) {
    const Eigen::AlignedBox3d box = bounding_box(transformed(piece.mesh, piece.to_bed));
    const Eigen::Vector3d size = box.sizes();
    if (x > 0 && x + size.x() > kBed_mm) {
      x = 0;
      y += row_mm + kApart_mm;
      row_mm = 0;
    }
    piece.to_bed.translation() += Eigen::Vector3d(x - box.min().x(), y - box.min().y(), 0);
    x += size.x() + kApart_mm;
    row_mm = std::max(row_mm, size.y());
  }
}

}  // namespace rayrep::detail
