#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "rayrep/physics/moments.h"
#include "rayrep/rays/ray_rep.h"

namespace rayrep {

/// An inner domain arranged for integrals over the part of it where a quadric is negative. Along a ray q.phi is a quadratic in z,
/// so that part ends at its roots: the rays are eliminated in closed form and an integral is one pass over the rays. theory.md (29)
class RayIntegrals {
public:
  /// Copies the intervals: 24 bytes each, and up to seven empty ones a row of the grid.
  explicit RayIntegrals(const RayRep& domain);

  struct Pass {
    Moments moments = Moments::Zero();  ///< S(q): of the material { q.phi < 0 } of the domain; mm^3, mm^4, mm^5
    /// -dS/dq = sum over ends inside their interval of A phi phi^T / |d(q.phi)/dz|, symmetric, positive semidefinite
    Eigen::Matrix<double, 10, 10> spread = Eigen::Matrix<double, 10, 10>::Zero();
  };

  /// The same bytes for any number of threads and any processor.
  /// @param q     not zero; only its direction matters to the moments
  /// @param blur  0 for the derivative itself; else its mean over so large a range of the discriminant (with coordinates and q
  ///              scaled to at most 1), which is finite where a ray is tangent to the quadric. theory.md (29)
  Pass pass(const Moments& q, double blur = 0) const;
  Moments moments(const Moments& q) const;

  /// Of the domain where what fills it costs `price` per unit of q.phi: filled where q.phi < -price, with the substitute where
  /// -price < q.phi < 0. theory.md (49)
  struct Priced {
    Pass pass;              ///< of both
    double filled_mm3 = 0;  ///< volume
    double cost = 0;        ///< so much more than q.moments it costs
  };
  Priced priced(const Moments& q, double price, double blur = 0) const;

  /// No interior whose filled volume is at most RayGrid::most_mm3 has a smaller q.S. @param price  any; 0 where there is no limit
  double least(const Moments& q, double price) const;

  const RayGrid& grid() const { return grid_; }
  const Moments& full() const { return full_; }                  ///< of the whole domain
  std::size_t intervals() const { return intervals_; }           ///< of the domain
  std::size_t bytes() const { return 24 * lo_.size(); }          ///< that a pass reads
  const std::vector<double>& lower_ends() const { return lo_; }  ///< over `length_mm`, with the empty ones; for benchmarks

private:
  struct Row {
    double y;
    std::uint32_t first, last;  ///< multiples of kLanes
  };
  template <bool kWithSpread>
  Pass sum(const Moments& q, double blur) const;

  RayGrid grid_;
  // Everything over length_, the largest coordinate, so that all powers are of order 1.
  double length_ = 1;
  double area_ = 0;
  Moments unit_ = Moments::Zero();  ///< mm of each moment
  std::vector<double> x_, lo_, hi_;
  std::vector<Row> rows_;
  std::vector<std::uint32_t> chunks_;  ///< rows_[chunks_[c]] ... rows_[chunks_[c + 1]] are summed together
  Moments full_ = Moments::Zero();
  std::size_t intervals_ = 0;
};

}  // namespace rayrep
