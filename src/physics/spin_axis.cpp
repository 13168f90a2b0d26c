#include "rayrep/physics/spin_axis.h"

#include <vector>

#include "rayrep/base/error.h"
#include "rayrep/mesh/mesh_check.h"
#include "rayrep/mesh/surface_query.h"
#include "rayrep/physics/moments.h"

namespace rayrep {

Eigen::Vector3d contact_point(const Mesh& mesh, const SpinAxis& axis, const Eigen::Vector3d& up, const Progress& progress) {
  const Eigen::Affine3d standing = working_frame(mesh, up);
  const Mesh upright = transformed(mesh, standing);
  Eigen::Vector3d through = Eigen::Vector3d::Zero();
  switch (axis.through) {
    case SpinAxis::Through::lowest_point: {
      // Vertices merge where the lowest place is an edge or a face: its middle.
      const double diagonal = bounding_box(upright).diagonal().norm();
      Eigen::AlignedBox3d lowest;
      for (const auto& v : upright.vertices)
        if (v.z() <= 1e-6 * diagonal) lowest.extend(v);
      return standing.inverse() * Eigen::Vector3d(lowest.center().x(), lowest.center().y(), 0);
    }
    case SpinAxis::Through::centre_of_mass:
    case SpinAxis::Through::best: {  // where its search starts
      const Moments s = mesh_moments(boundary_of_union(upright, progress));
      through = s.segment<3>(MX) / s[M1];
      break;
    }
    case SpinAxis::Through::point:
      if (!axis.leaves_below) return axis.point_mm;
      through = standing * axis.point_mm;
      break;
  }
  // The centre of mass may lie in a hole: a tip is then thought down to the level of the lowest point.
  std::vector<LineHit> hits;
  line_hits_brute_force(upright, through.head<2>(), hits);
  if (hits.empty() && axis.through == SpinAxis::Through::point)
    throw Error(ErrorCode::usage, "The spin axis does not meet the mesh: choose a point of it (--point) below or inside the body.");
  return standing.inverse() * Eigen::Vector3d(through.x(), through.y(), hits.empty() ? 0 : hits.front().z_mm);
}

}  // namespace rayrep
