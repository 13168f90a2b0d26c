#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace rayrep {

/// What of a triangle lies on one side of a plane: up to four corners, in its order.
struct CutCorners {
  std::array<int, 4> v{};
  int count = 0;
};

/// Corners that fall together, as at a vertex in the plane, count once.
/// @param height    of each vertex above the plane; what lies in it counts as above
/// @param kept      (vertex): its number in the result
/// @param crossing  (a, b): the number of the point where that edge crosses the plane
template <typename Kept, typename Crossing>
CutCorners cut_corners(const Eigen::Vector3i& triangle, const std::vector<double>& height, bool above, Kept&& kept,
                       Crossing&& crossing) {
  CutCorners corners;
  const auto push = [&corners](int v) {
    if (corners.count == 0 || (corners.v[corners.count - 1] != v && corners.v[0] != v)) corners.v[corners.count++] = v;
  };
  for (int k = 0; k < 3; ++k) {
    const int a = triangle[k];
    const int b = triangle[(k + 1) % 3];
    if ((height[a] >= 0) == above) push(kept(a));
    if ((height[a] >= 0) != (height[b] >= 0)) push(crossing(a, b));
  }
  return corners;
}

}  // namespace rayrep
