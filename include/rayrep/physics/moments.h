#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "rayrep/mesh/mesh.h"

namespace rayrep {

/// The ten mass moments of a body about the world origin (theory.md (1)): integrals of
/// phi(p) = (1, x, y, z, xx, yy, zz, xy, yz, xz) over its volume, times a density. With unit density the units are mm^3,
/// mm^4 and mm^5. Additive over disjoint bodies, negative for a cavity (inward orientation).
using Moments = Eigen::Matrix<double, 10, 1>;
/// A linear map of moments, or the second derivative of a function of them.
using Matrix10 = Eigen::Matrix<double, 10, 10>;

/// Places of the entries of Moments and of phi.
enum MomentIndex { M1 = 0, MX, MY, MZ, MXX, MYY, MZZ, MXY, MYZ, MXZ };

/// phi(p), the ten monomials at a point (mm). theory.md (1).
Moments monomials(const Eigen::Vector3d& p);

/// A quadric q as a function of a point: q.phi(p), its gradient (q_x, q_y, q_z) + H p, and H, which does not depend on p.
double quadric_value(const Moments& q, const Eigen::Vector3d& p);
Eigen::Vector3d quadric_gradient(const Moments& q, const Eigen::Vector3d& p);
Eigen::Matrix3d quadric_hessian(const Moments& q);

/// Exact moments, unit density, of the region a closed mesh bounds, about the world origin: the sum over triangles (a, b, c)
/// of the moments of the signed tetrahedra (r, a, b, c) from the mesh's own centre r, moved to the origin. theory.md (3).
/// Closedness is not checked. Regions counted twice by overlapping components count twice; see boundary_of_union.
Moments mesh_moments(const Mesh& mesh);

/// Moments about the origin of the body moved by t: phi(p + t) integrated. theory.md (4).
Moments translated(const Moments& s, const Eigen::Vector3d& t);

/// Units in which the moments of a body of this volume and length are of order 1: V, V L, V L^2 (mm^3, mm^4, mm^5).
Moments moment_units(double volume_mm3, double length_mm);

/// The linear map of a body's moments to those of the body moved by p -> R p + t. theory.md (4).
/// @param motion  rigid (not checked)
Eigen::Matrix<double, 10, 10> moment_map(const Eigen::Affine3d& motion);

/// Mass, centre of mass and inertia of a body from its moments.
struct MassProperties {
  double volume_mm3 = 0;
  double mass_g = 0;
  Eigen::Vector3d centre_of_mass_mm = Eigen::Vector3d::Zero();
  /// Inertia tensor about the centre of mass, g mm^2: I = integral of (|p|^2 1 - p p^T) dm. Off-diagonals are the negative
  /// products of inertia. theory.md (2).
  Eigen::Matrix3d inertia_g_mm2 = Eigen::Matrix3d::Zero();
  Eigen::Vector3d principal_moments_g_mm2 = Eigen::Vector3d::Zero();  ///< ascending
  /// Columns: unit principal axes in the order of the moments, right-handed; the largest component of the first two is positive.
  Eigen::Matrix3d principal_axes = Eigen::Matrix3d::Identity();
};

/// @param s  moments with unit density, about the origin (mm^3, mm^4, mm^5). Of a body far from it the inertia is what rounding
///           leaves: see mass_properties of a mesh.
/// @throws Error{input} if the volume is not positive, or not finite.
MassProperties mass_properties(const Moments& s, double density_g_cm3);

/// The same of the region a closed mesh bounds (see mesh_moments), computed about the mesh's own centre: by way of moments about
/// the origin the inertia of a body of size L at a distance D would lose (D / L)^2 of its digits.
/// @throws Error{input} as above
MassProperties mass_properties(const Mesh& mesh, double density_g_cm3);

}  // namespace rayrep
