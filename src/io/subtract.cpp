#include "io/subtract.h"

#include <algorithm>
#include <cmath>

#include "mesh/rims.h"
#include "rayrep/mesh/mesh_check.h"

namespace rayrep::detail {
namespace {

using Eigen::Vector3d;

/// What the cuts of boundary_of_union are off by is far below this, what makers can tell apart is far above; of the diagonal.
constexpr double kSame = 1e-9;

double volume(const Mesh& mesh, const Vector3d& centre) {
  double six = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    six += (mesh.corner(t, 0) - centre).dot((mesh.corner(t, 1) - centre).cross(mesh.corner(t, 2) - centre));
  return six / 6;
}

}  // namespace

std::optional<Mesh> without(const Mesh& material, std::size_t parts, const Mesh& negative) {
  const CheckOptions quick{.self_intersections = false, .first_aid = false};
  const CheckedMesh body = check_mesh(material, quick);
  CheckedMesh hole = check_mesh(negative, quick);
  if (!body.report.usable || !hole.report.usable) return std::nullopt;
  flip(hole.mesh);
  Mesh both = body.mesh;
  for (std::size_t i = 0; i < std::max<std::size_t>(parts, 1); ++i) append(both, hole.mesh);
  const Mesh pieces = boundary_of_union(both);
  if (pieces.triangles.empty()) return std::nullopt;
  const Eigen::AlignedBox3d box = bounding_box(both);
  const double tolerance = kSame * box.diagonal().norm();
  Mesh result = with_merged_vertices(pieces);
  result = with_welded_rims(result, rims_of(result), tolerance, {}).mesh;
  result = with_merged_vertices(with_split_rims(result, rims_of(result), tolerance, {}).mesh);
  if (result.triangles.empty() || !rims_of(result).closed()) return std::nullopt;
  const double expected = volume(pieces, box.center());
  // The tolerance times the surface is what welding may move; the box bounds both.
  if (!(std::abs(volume(result, box.center()) - expected) <= 1e-7 * box.volume()) || !(expected > 0)) return std::nullopt;
  return result;
}

}  // namespace rayrep::detail
