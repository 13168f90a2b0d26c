#pragma once

#include <Eigen/Core>
#include <array>
#include <boost/multiprecision/cpp_int.hpp>
#include <vector>

namespace rayrep {

/// A whole number of any length; up to 256 bits take no memory of their own.
using Integer = boost::multiprecision::number<
    boost::multiprecision::cpp_int_backend<256, 0, boost::multiprecision::signed_magnitude, boost::multiprecision::unchecked,
                                           std::allocator<boost::multiprecision::limb_type>>,
    boost::multiprecision::et_off>;
using Integer3 = std::array<Integer, 3>;

/// The point x / w on the grid of ExactNumbers, w > 0.
struct HomogeneousPoint {
  Integer3 x;
  Integer w = 1;
};

/// The points with normal . x = offset on that grid.
struct ExactPlane {
  Integer3 normal;
  Integer offset;
};

/// Coordinates as whole numbers: every double of a set is one after multiplication with 2^shift.
class ExactNumbers {
public:
  explicit ExactNumbers(const std::vector<Eigen::Vector3d>& points);

  Integer3 of(const Eigen::Vector3d& point) const;
  /// The double nearest to each coordinate, ties to even: points that are equal are so bit for bit, however they were found.
  Eigen::Vector3d rounded(const HomogeneousPoint& point) const;

private:
  int shift_ = 0;
};

/// A point that is known exactly, with the doubles nearest to it.
struct ExactPoint {
  Eigen::Vector3d near = Eigen::Vector3d::Zero();
  HomogeneousPoint exact;
  double error = 0;  ///< bound of |coordinate - near|
  int vertex = -1;   ///< of the mesh, if it is one
};

ExactPlane plane_through(const Integer3& a, const Integer3& b, const Integer3& c);
/// The plane through the line ab that contains the direction of a coordinate axis. The line must not run along it.
ExactPlane plane_along(const Integer3& a, const Integer3& b, int axis);
/// Where the line ab meets a plane that is not parallel to it.
HomogeneousPoint line_and_plane(const Integer3& a, const Integer3& b, const ExactPlane& plane);
/// The only point of three planes.
HomogeneousPoint three_planes(const ExactPlane& p, const ExactPlane& q, const ExactPlane& r);
/// The mean of three points.
HomogeneousPoint centroid(const HomogeneousPoint& a, const HomogeneousPoint& b, const HomogeneousPoint& c);

/// orient2d of predicates.h seen against a coordinate axis: of coordinates axis + 1 and axis + 2. Exact.
int orient2d(const ExactPoint& a, const ExactPoint& b, const ExactPoint& c, int axis);

/// Sign of normal . p - offset.
int side_of(const ExactPlane& plane, const HomogeneousPoint& p);

}  // namespace rayrep
