#include "make/centred.h"

#include <Eigen/Geometry>

namespace rayrep::detail {

Goal centred_goal(const Eigen::Vector3d& centre_mm, std::optional<double> volume_mm3, const Body& body, double density_g_cm3) {
  TargetGoal::Setup setup;
  setup.density_g_cm3 = density_g_cm3;
  if (volume_mm3) setup.wanted[M1] = 1e-3 * density_g_cm3 * *volume_mm3;
  for (int k = MX; k <= MZ; ++k) setup.wanted[static_cast<std::size_t>(k)] = 0;
  setup.volume_mm3 = body.solid[M1];
  setup.length_mm = body.diagonal_mm;
  const Matrix10 to_centre = moment_map(Eigen::Affine3d(Eigen::Translation3d(-centre_mm)));
  const Moments domain = to_centre * body.integrals->full();
  // So far that there is material, whose surface can be moved to correct the mesh.
  const double square_mm2 = 1.5 * domain.segment<3>(MXX).sum() / domain[M1];
  Moments q = Moments::Zero();
  q[M1] = 1 / setup.volume_mm3;
  q.segment<3>(MXX).setConstant(-1 / (setup.volume_mm3 * square_mm2));
  return mapped(linear_goal(q, TargetGoal(setup)), to_centre);
}

}  // namespace rayrep::detail
