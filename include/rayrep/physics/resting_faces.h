#pragma once

#include <Eigen/Core>
#include <memory>
#include <numbers>
#include <vector>

#include "rayrep/mesh/mesh.h"

namespace rayrep {

struct ConvexPolytope;

/// A face of its convex hull on which a body comes to rest on level ground.
struct RestingFace {
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< direction of world up in the body's frame then
  double share = 0;                               ///< of all attitudes, each as likely as any other, from which it rolls there
  double height_mm = 0;                           ///< of the centre of mass above the ground
  double holds_rad = 0;                           ///< the smallest angle by which it must be tilted from there to roll on
};

/// How often a throw ends with `up` up, or within 10 degrees of it: the share of those faces.
double share_with_up(const std::vector<RestingFace>& rests, const Eigen::Vector3d& up);

/// On which faces a body comes to rest, and how often, when it is let go with a random attitude on level, hard ground and rolls and
/// topples there as ground_rest says, without inertia. The shares are exact: where a body rolls to is constant between arcs of
/// great circles on the sphere of directions. theory.md (71)
class Tumbler {
public:
  /// What holds a body by no more than this does not keep it where it can be lower beyond: no throw ends on the facets of a rounded
  /// edge. It leaves over each of the edges that hold it by so little as often.
  static constexpr double kShake_rad = 3 * std::numbers::pi / 180;

  /// Of a mesh only the convex hull counts; faces that are flat to 1e-5 of its diagonal are one, and so much less is no corner.
  /// @throws Error{input} for a mesh that is flat
  explicit Tumbler(const Mesh& mesh, double shake_rad = kShake_rad);

  std::size_t faces() const;                            ///< of the hull
  Eigen::Vector3d up(std::size_t face) const;           ///< what points up when it rests on this one
  const std::vector<Eigen::Vector3d>& corners() const;  ///< of the hull

  /// For each face of the hull, 0 where it does not come to rest. They sum up to 1.
  /// @throws Error{input} for a centre of mass that does not lie within the hull, where no body has it
  std::vector<double> shares(const Eigen::Vector3d& centre_of_mass_mm) const;
  /// Those on which it comes to rest, the largest share first.
  std::vector<RestingFace> rests(const Eigen::Vector3d& centre_of_mass_mm) const;

private:
  struct Around;
  class Rolling;
  std::shared_ptr<const ConvexPolytope> hull_;
  std::shared_ptr<const Around> around_;  ///< each corner
  double shake_rad_;
};

}  // namespace rayrep
