#include "rayrep/physics/moments.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cmath>

#include "base/text.h"
#include "rayrep/base/error.h"

namespace rayrep {
namespace {

Moments from_parts(double volume, const Eigen::Vector3d& first, const Eigen::Matrix3d& second) {
  Moments s;
  s << volume, first, second(0, 0), second(1, 1), second(2, 2), second(0, 1), second(1, 2), second(0, 2);
  return s;
}

Eigen::Matrix3d second_moments(const Moments& s) {
  Eigen::Matrix3d m;
  m << s[MXX], s[MXY], s[MXZ],  //
      s[MXY], s[MYY], s[MYZ],   //
      s[MXZ], s[MYZ], s[MZZ];
  return m;
}

// Right-handed unit axes whose signs do not depend on the eigensolver's whim.
Eigen::Matrix3d with_fixed_signs(Eigen::Matrix3d axes) {
  for (int k = 0; k < 2; ++k) {
    int largest = 0;
    axes.col(k).cwiseAbs().maxCoeff(&largest);
    if (axes(largest, k) < 0) axes.col(k) = -axes.col(k);
  }
  axes.col(2) = axes.col(0).cross(axes.col(1));
  return axes;
}

// Those of the region a closed mesh bounds, of the points' places from `centre` on.
Moments moments_about(const Eigen::Vector3d& centre, const Mesh& mesh) {
  double volume = 0;                                 // 6 V
  Eigen::Vector3d first = Eigen::Vector3d::Zero();   // 24 integral of p
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();  // 120 integral of p p^T
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Eigen::Vector3d a = mesh.corner(t, 0) - centre;
    const Eigen::Vector3d b = mesh.corner(t, 1) - centre;
    const Eigen::Vector3d c = mesh.corner(t, 2) - centre;
    const double det = a.dot(b.cross(c));
    const Eigen::Vector3d sum = a + b + c;
    volume += det;
    first += det * sum;
    second += det * (sum * sum.transpose() + a * a.transpose() + b * b.transpose() + c * c.transpose());
  }
  return from_parts(volume / 6, first / 24, second / 120);
}

}  // namespace

Moments monomials(const Eigen::Vector3d& p) { return from_parts(1, p, p * p.transpose()); }

double quadric_value(const Moments& q, const Eigen::Vector3d& p) { return q.dot(monomials(p)); }

Eigen::Vector3d quadric_gradient(const Moments& q, const Eigen::Vector3d& p) { return q.segment<3>(MX) + quadric_hessian(q) * p; }

Eigen::Matrix3d quadric_hessian(const Moments& q) {
  Eigen::Matrix3d H;
  H << 2 * q[MXX], q[MXY], q[MXZ],  //
      q[MXY], 2 * q[MYY], q[MYZ],   //
      q[MXZ], q[MYZ], 2 * q[MZZ];
  return H;
}

Moments mesh_moments(const Mesh& mesh) {
  if (mesh.triangles.empty()) return Moments::Zero();
  const Eigen::Vector3d centre = bounding_box(mesh).center();
  return translated(moments_about(centre, mesh), centre);
}

Moments translated(const Moments& s, const Eigen::Vector3d& t) {
  const Eigen::Vector3d first = s.segment<3>(MX);
  const Eigen::Matrix3d cross = first * t.transpose();
  return from_parts(s[M1], first + s[M1] * t, second_moments(s) + cross + cross.transpose() + s[M1] * t * t.transpose());
}

Moments moment_units(double volume_mm3, double length_mm) {
  Moments unit;
  for (int k = 0; k < 10; ++k) unit[k] = volume_mm3 * std::pow(length_mm, k == M1 ? 0 : k <= MZ ? 1 : 2);
  return unit;
}

Eigen::Matrix<double, 10, 10> moment_map(const Eigen::Affine3d& motion) {
  const Eigen::Matrix3d R = motion.linear();
  Eigen::Matrix<double, 10, 10> map;
  for (int k = 0; k < 10; ++k) {
    const Moments s = Moments::Unit(k);
    map.col(k) = translated(from_parts(s[M1], R * s.segment<3>(MX), R * second_moments(s) * R.transpose()), motion.translation());
  }
  return map;
}

MassProperties mass_properties(const Moments& s, double density_g_cm3) {
  if (!s.allFinite() || !(s[M1] > 0))
    throw Error(ErrorCode::input, concat("The volume is ", s[M1],
                                         " mm3, which is not that of a solid: the surface must be closed and face outward."));
  const double grams_per_mm3 = density_g_cm3 * 1e-3;
  const Eigen::Vector3d centre = s.segment<3>(MX) / s[M1];
  const Eigen::Matrix3d central = second_moments(s) - s[M1] * centre * centre.transpose();

  MassProperties result;
  result.volume_mm3 = s[M1];
  result.mass_g = grams_per_mm3 * s[M1];
  result.centre_of_mass_mm = centre;
  result.inertia_g_mm2 = grams_per_mm3 * (central.trace() * Eigen::Matrix3d::Identity() - central);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(result.inertia_g_mm2);
  result.principal_moments_g_mm2 = eigen.eigenvalues();
  result.principal_axes = with_fixed_signs(eigen.eigenvectors());
  return result;
}

MassProperties mass_properties(const Mesh& mesh, double density_g_cm3) {
  if (mesh.triangles.empty()) return mass_properties(Moments(Moments::Zero()), density_g_cm3);
  const Eigen::Vector3d centre = bounding_box(mesh).center();
  MassProperties body = mass_properties(moments_about(centre, mesh), density_g_cm3);
  body.centre_of_mass_mm += centre;
  return body;
}

}  // namespace rayrep
