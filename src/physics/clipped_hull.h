#pragma once

#include <Eigen/Core>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "physics/pockets.h"
#include "rayrep/mesh/mesh.h"
#include "rayrep/physics/hydrostatics.h"

namespace rayrep {

/// Integrals over the wet part of a body and over its waterplane, in a frame whose third axis is the height above the water.
struct Integrals {
  double volume = 0;
  Eigen::Vector3d first = Eigen::Vector3d::Zero();  ///< of (x, y, h) over the volume
  double area = 0;
  Eigen::Vector2d area_first = Eigen::Vector2d::Zero();   ///< of (x, y) over the waterplane
  Eigen::Matrix2d area_second = Eigen::Matrix2d::Zero();  ///< of (x, y)(x, y)^T over the waterplane

  void add_wet_triangle(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c);
  /// A segment of the waterplane's rim, counter-clockwise seen from above.
  void add_rim(const Eigen::Vector2d& p, const Eigen::Vector2d& q);
};

/// @param points  the vertices as (x, y, h). A corner is wet when h < 0: a face or an edge that lies in the plane counts as dry, so
///                that the waterplane is the section just below the plane, and no case is special.
/// @param take    take(t): whether triangle t takes part
template <typename Take>
Integrals integrate(const std::vector<Eigen::Vector3d>& points, const std::vector<Eigen::Vector3i>& triangles, const Take& take);

/// The waterplane's second moments about its centroid, in the frame's u and v.
Eigen::Matrix2d central_second_moments(const Integrals& sum);

/// A hull prepared for many waterplanes; copies share what they have in common. Vertices that no triangle uses are left out;
/// coordinates are relative to the middle of the bounding box, so that a body far from the origin keeps its digits.
///
/// The water comes from below at every attitude. A point once recorded as wet stays so (see record_wet): pockets with such a point
/// are not dry.
class ClippedHull {
public:
  explicit ClippedHull(const Mesh& mesh);

  double volume() const { return volume_; }  ///< with all pockets wet
  double diagonal() const { return diagonal_; }
  const Eigen::Vector3d& centre() const { return centre_; }

  /// Sets the direction of up; offsets are then measured from centre() along it.
  void set_up(const Eigen::Vector3d& up);
  const Frame& frame() const { return frame_; }

  /// Ahead of many calls at one attitude: those that follow need not look for pockets.
  void find_all_pockets() { find_pockets(std::numeric_limits<double>::infinity()); }

  /// From now on no pocket is dry, at any attitude.
  void leave_pockets_wet() {
    pockets_ = false;
    floods_ = {};
  }

  /// An upper bound of what all pockets at this attitude hold, each just before it floods.
  double most_in_pockets() {
    find_all_pockets();
    return floods_.empty() ? 0 : dry_volume_at_rims(highest_);
  }

  /// The lowest offset at which `volume` is displaced, that at which a body lowered into the water comes to rest, with the pockets
  /// that are dry there; none if the body sinks. Afterwards integrals and the functions below see these pockets.
  std::optional<double> offset_for_volume(double volume, double guess);

  /// The largest volume displaced at any offset.
  double largest_displacement();

  /// Integrals at an offset up to that of offset_for_volume, in the frame, from the point below centre() on the plane.
  Integrals integrals(double offset);

  /// Points (see HullSurface) below the offset that the water does not reach.
  std::vector<int> dry_points(double offset) const;
  /// Points below rims higher than the offset, whether below the water or above. Finds the pockets of all heights.
  std::vector<int> points_in_pockets(double offset);
  /// Whether the water reaches one of these.
  bool reaches_any(const std::vector<int>& points, double offset) const;
  /// What the water reaches at this attitude stays wet at all that come.
  void record_wet(double offset);

private:
  void find_pockets(double below);
  double volume_below(double offset, double rim, double* area) const;
  double offset_between(double lo, double hi, double rim, double volume, double guess) const;
  double dry_volume_at_rims(double highest) const;
  std::vector<double> rims(double highest) const;
  bool wet(std::size_t point, double offset) const;

  struct Attitude {
    Eigen::Vector3d up;
    double offset;
  };

  std::vector<Eigen::Vector3d> vertices_;
  std::vector<Eigen::Vector3i> triangles_;
  std::vector<Eigen::Vector3d> twice_areas_;
  Eigen::Vector3d centre_ = Eigen::Vector3d::Zero();
  double diagonal_ = 0;
  double volume_ = 0;
  Frame frame_;
  std::vector<double> heights_;
  std::vector<double> projected_;
  std::vector<char> pinched_;
  std::vector<Eigen::Vector3d> points_;
  double lowest_ = 0;
  double highest_ = 0;
  bool pockets_ = true;
  FloodHeights floods_;
  double found_below_ = -std::numeric_limits<double>::infinity();  // what floods_ is right for, at this attitude
  std::shared_ptr<LazyHullSurface> shared_surface_ = std::make_shared<LazyHullSurface>();  // with all copies
  const HullSurface* surface_ = nullptr;  // from the first attitude with something like a pocket on
  std::vector<Attitude> before_surface_;
  std::vector<char> wet_;
};

template <typename Take>
Integrals integrate(const std::vector<Eigen::Vector3d>& points, const std::vector<Eigen::Vector3i>& triangles, const Take& take) {
  // Where the edge from a wet to a dry corner meets the water. Both triangles of an edge get the same bits, since both call it with
  // the wet corner first.
  const auto crossing = [](const Eigen::Vector3d& wet, const Eigen::Vector3d& dry) {
    const double t = wet.z() / (wet.z() - dry.z());
    return Eigen::Vector3d(wet.x() + t * (dry.x() - wet.x()), wet.y() + t * (dry.y() - wet.y()), 0);
  };
  Integrals sum;
  for (std::size_t n = 0; n < triangles.size(); ++n) {
    const Eigen::Vector3i& t = triangles[n];
    const Eigen::Vector3d* corner[3] = {&points[t[0]], &points[t[1]], &points[t[2]]};
    const bool wet[3] = {corner[0]->z() < 0, corner[1]->z() < 0, corner[2]->z() < 0};
    const int count = wet[0] + wet[1] + wet[2];
    if (count == 0 || !take(n)) continue;
    if (count == 3) {
      sum.add_wet_triangle(*corner[0], *corner[1], *corner[2]);
      continue;
    }
    int k = 0;  // the corner that is alone on its side
    while (wet[k] != (count == 1)) ++k;
    const Eigen::Vector3d& a = *corner[k];
    const Eigen::Vector3d& b = *corner[(k + 1) % 3];
    const Eigen::Vector3d& c = *corner[(k + 2) % 3];
    if (count == 1) {
      const Eigen::Vector3d p = crossing(a, b);
      const Eigen::Vector3d q = crossing(a, c);
      sum.add_wet_triangle(a, p, q);
      sum.add_rim(q.head<2>(), p.head<2>());
    } else {
      const Eigen::Vector3d p = crossing(c, a);
      const Eigen::Vector3d q = crossing(b, a);
      sum.add_wet_triangle(b, c, p);
      sum.add_wet_triangle(b, p, q);
      sum.add_rim(q.head<2>(), p.head<2>());
    }
  }
  return sum;
}

}  // namespace rayrep
