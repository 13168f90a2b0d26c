#pragma once

#include <Eigen/Core>
#include <vector>

#include "rayrep/mesh/mesh.h"

namespace rayrep {

/// Where a body touches level ground: the convex hull of its contact points, seen from above. theory.md (22).
struct SupportPolygon {
  /// Counter-clockwise corners, mm, in the plane of the ground, no three on a line; 1 corner: it stands on a point, 2: on an edge.
  std::vector<Eigen::Vector2d> corners_mm;
  double ground_mm = 0;  ///< height of the ground along up: of the lowest point
  double area_mm2 = 0;

  /// Signed distance of p from the line through each edge (corner k to k + 1), positive inside. An edge alone is run both ways: its
  /// two distances have opposite signs. A point gives one value, minus the distance from it.
  std::vector<double> edge_distances_mm(const Eigen::Vector2d& p) const;
  /// Centre of the largest circle inside: the point farthest from tipping for a given height. theory.md (24). Where many circles
  /// are as large (a rectangle), the middle of their centres. The radius is the smallest of its edge distances. The middle of an
  /// edge, the point itself. There must be a corner (asserted).
  Eigen::Vector2d safest_point_mm() const;
};

/// How far above the lowest point a body of this height touches the ground, unless told: 0.15 mm, the give of a printed base (most
/// of a first layer, whose foot spreads), but at most 5e-3 and at least 1e-4 of the height.
double contact_tolerance_mm(double height_mm);

/// Contact of a mesh whose up is +z: the convex hull of all points of its surface no higher than `tolerance_mm` above the lowest
/// point (triangles are clipped at that height). Corners nearer than 1 % of the tolerance to the line between others are left out.
///
/// A tip, an edge or a rounded bottom has such points, too, as far as the tolerance makes them. The polygon therefore counts as an
/// edge if it is narrower than the tolerance over a slope of a quarter degree (each side) and than 10 % of the diagonal of the
/// mesh, and its width falls to between 0.4 and 0.8 when the tolerance is halved; as a point, if the same is true of its length. A
/// flat foot keeps its size, however small, and feet of different heights come and go as wholes. theory.md (22).
/// @param tolerance_mm  how much a print and the ground give way; see contact_tolerance_mm. Not negative (asserted).
/// @throws Error{input} for a mesh without triangles, or with coordinates that are not finite
SupportPolygon support_polygon(const Mesh& mesh, double tolerance_mm);

/// Angle by which the ground may be tilted about each edge before the body tips over it, rad: atan2(distance of the centre of mass
/// from the edge (in plan), its height above the ground). Negative when it tips by itself. Order of edge_distances_mm; theory.md
/// (23).
std::vector<double> tipping_angles_rad(const SupportPolygon& polygon, const Eigen::Vector3d& centre_of_mass_mm);

}  // namespace rayrep
