#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "make/body.h"
#include "rayrep/physics/hydrostatics.h"
#include "rayrep/physics/spec.h"
#include "rayrep/physics/support_polygon.h"
#include "solve/safest_centre.h"

namespace rayrep::detail {

/// A pose in the frame given, with all of it that does not depend on the inside.
struct Placed {
  Pose pose;
  Eigen::Vector3d up;
  Eigen::Matrix3d turn;              ///< takes up to z
  SupportPolygon polygon;            ///< of one that stands or rights itself: turned
  Eigen::Vector3d contact_mm;        ///< of one that rights itself or spins: where it touches the ground then
  std::optional<PreparedHull> hull;  ///< of one that floats: turned, its lowest point at z = 0
  double lowest_mm = 0;              ///< height of the lowest point along up
  double height_mm = 0;              ///< of the body
};

/// The state of the water for one that floats.
struct Afloat {
  double waterline_mm = 0;
  Eigen::Vector3d centre_of_buoyancy_mm;  ///< in the frame given
  double metacentre_mm = 0;               ///< along up
};

/// The poses of a spec, and what they ask of the centre of mass. All of it in the frame given.
class Poses {
public:
  /// Keeps a reference to the spec.
  Poses(const Body& body, const PoseSpec& spec);

  std::size_t size() const { return placed_.size(); }
  const Placed& operator[](std::size_t n) const { return placed_[n]; }
  std::string words(std::size_t n) const { return words_of(placed_[n].pose, spec_.up); }
  bool any(Pose::Kind kind) const;

  double volumes() const { return spec_.print.density_g_cm3 / spec_.fluid_g_cm3; }  ///< displaced by one of material
  double most_afloat_mm3() const;  ///< of material: of the highest waterline that is chosen
  /// The volume of material that the waterlines given ask for. @throws Error{goal} when they do not agree, Error{usage} for one
  /// above the body
  std::optional<double> given_volume_mm3() const;
  /// @param volume_mm3  of material
  Afloat afloat(const Placed& p, double volume_mm3) const;

  /// theory.md (67); of one that spins the axis alone. @param volume_mm3  of material, where something floats
  CentreProblem problem(std::optional<double> volume_mm3) const;
  /// The same of one pose.
  CentreProblem problem(std::size_t n, std::optional<double> volume_mm3) const;
  /// Whether one that floats comes back when it is let go at a tilt, with its centre of mass there in the frame given.
  bool comes_back(const Body& body, const Placed& p, double volume_mm3, const Eigen::Vector3d& centre_mm) const;
  /// Whether the ratios of the problem are tangents of tipping angles; else they are depths below point or metacentre over the
  /// diagonal.
  bool tips() const { return any(Pose::Kind::stands); }

  /// In how many ways the centre of mass is free once the poses that hang and float have their verticals: 3, or 1 along a
  /// direction, or 0.
  struct Freedom {
    int ways = 3;
    Eigen::Vector3d along = Eigen::Vector3d::Zero();
  };
  Freedom freedom() const;

  /// A point of the vertical on which the centre of mass must lie. @param p  that does not stand
  Eigen::Vector3d through_mm(const Placed& p, std::optional<double> volume_mm3) const;

  /// The two poses that hang or float whose verticals pass each other farthest apart; none that does by more than 1e-3 of the
  /// diagonal.
  struct Apart {
    std::size_t one, other;
    double distance_mm;
  };
  std::optional<Apart> apart(std::optional<double> volume_mm3) const;

private:
  Placed placed(const Mesh& hull, const Pose& pose) const;
  void add(const Placed& p, std::optional<double> volume_mm3, CentreProblem& problem) const;
  static void add_edges(const Placed& p, CentreProblem& problem);
  static void add_vertical(const Placed& p, const Eigen::Vector3d& through_mm, CentreProblem& problem);
  struct Depth {
    double least;  ///< over the diagonal
    bool wanted;
  };
  void add_depth(double height_mm, const Eigen::Vector3d& up, const Depth& depth, CentreProblem& problem) const;

  const PoseSpec& spec_;
  double diagonal_mm_;
  std::vector<Placed> placed_;
  double hull_mm3_ = 0;
};

/// A problem of the frame given in the working frame.
CentreProblem moved(CentreProblem problem, const Eigen::Affine3d& to_working);

/// @throws Error{goal} when no inside has so much material
void require_weight(const Body& body, const PoseSpec& spec, double volume_mm3);
/// @throws Error{goal} for a pose in which it touches the ground in a point or an edge
void require_feet(const Poses& poses, const PoseSpec& spec, const Body& body);
/// @throws Error{goal} for one that does not right itself with its centre of mass there, in the working frame
void require_righted(const Body& body, const Poses& poses, const Eigen::Vector3d& centre_mm, const Progress& progress);

/// The spec with the waterlines that were found. @param volume_mm3  of material, where something floats
PoseSpec filled_in(const PoseSpec& spec, const Poses& poses, std::optional<double> volume_mm3);

/// "Without hanging from ... it tips over at ... degrees at the soonest.": what the static ones of the others can do without a
/// pose; empty when that is no more than `ratio`.
std::string words_without(std::size_t n, const Body& body, const PoseSpec& spec, double ratio, const Progress& progress);

}  // namespace rayrep::detail
