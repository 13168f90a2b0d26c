#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace rayrep {

/// Exact sign of the area of the triangle (a, b, c): +1 counter-clockwise, -1 clockwise, 0 collinear.
/// Like all predicates here: evaluated in double with an error bound first, then, if that does not decide, without rounding. Exact
/// as long as products of two (orient2d) or three (orient3d) coordinate differences neither overflow nor underflow. Shewchuk,
/// "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates", 1997.
int orient2d(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c);

/// Exact sign of (b - a) x (c - a) . (d - a): +1 when a, b, c run counter-clockwise seen from d, 0 when the four are coplanar.
int orient3d(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c, const Eigen::Vector3d& d);

/// True when the three points lie exactly on one line.
bool collinear(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c);

/// True when two triangles with corners p and q, none of them of zero area, have a point in common beyond the corners and edges
/// that they share. Shared are corners with equal numbers in `ip` and `iq`; equal coordinates under different numbers count as an
/// intersection. Triangles that share all three corners do not intersect by this definition: they are duplicates. Exact.
bool triangles_intersect(const Eigen::Vector3d p[3], const Eigen::Vector3i& ip, const Eigen::Vector3d q[3],
                         const Eigen::Vector3i& iq);

}  // namespace rayrep
