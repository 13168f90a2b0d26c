#pragma once

#include "rayrep/rays/interior.h"
#include "rayrep/rays/ray_rep.h"

namespace rayrep {

/// Interior of cells with one fill fraction rho in [0, 1] each (Spin-It, Sec. 5.2, where beta = 1 - rho):
///
///     S(rho) = constant + sum over cells c of rho_c m_c,   m_c = moments of the part of the inner domain in cell c.
///
/// Linear: the Jacobian is the constant matrix of the m_c, and the Hessian of any w.S is zero.
class FillInterior : public Interior {
public:
  Eigen::Index variables() const override { return moments_.cols(); }
  Eigen::VectorXd lower_bounds() const override;
  Eigen::VectorXd upper_bounds() const override;
  Eigen::VectorXd start(double fill) const override;
  Eigen::Matrix<double, 10, Eigen::Dynamic> contributions(const Eigen::VectorXd& fill) const override;
  Eigen::Matrix<double, 10, Eigen::Dynamic> jacobian(const Eigen::VectorXd&) const override { return moments_; }
  Eigen::VectorXd hessian_diagonal(const Eigen::VectorXd& fill, const Moments& w, Eigen::Index first,
                                   Eigen::Index count) const override;
  double variable_unit(double) const override { return 1; }

protected:
  Eigen::Matrix<double, 10, Eigen::Dynamic> moments_;  ///< of each cell when full, unit density
};

/// The lowest end of all intervals, where the cells of a domain begin; 0 for an empty one.
double lowest_end_mm(const RayRep& domain);

/// Uniform cubes of k x k rays and k ray spacings high, from the first ray and the lowest end of the domain upward. Cells that meet
/// the domain get a fill fraction; those on its boundary count with their part inside. m_c is exact on the ray-rep: the moments of
/// the intervals clipped to the cell, so that no filling of the cells can do better than the rays. With k = 1 these are the voxels
/// the ray-reps paper compares with (Table 2).
class VoxelInterior final : public FillInterior {
public:
  /// @param spacings_per_voxel  k, at least 1
  VoxelInterior(const RayRep& domain, int spacings_per_voxel);
};

}  // namespace rayrep
