#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <vector>

#include "make/body.h"
#include "rayrep/physics/hydrostatics.h"
#include "rayrep/physics/mechanism.h"
#include "rayrep/physics/support_polygon.h"
#include "rayrep/solve/parts.h"

namespace rayrep::detail {

/// What a state asks for, in a frame in which up is z: rows r of which r.(m, m c) shall be 0 or at most 0, with m the mass and c
/// the centre of mass of all parts together.
struct StateRows {
  struct Row {
    Eigen::Vector4d r;                    ///< mm
    const HingeBalance* hinge = nullptr;  ///< m and c are of what turns on it
  };
  std::vector<Row> level, at_most;
};

/// The printed parts on their rays, and all states of the mechanism.
class MechanismStates {
public:
  /// @param bodies  of the printed parts, in order
  /// @throws Error{goal} for a state that touches the ground in a point or an edge only
  MechanismStates(const Mechanism& mechanism, std::vector<std::shared_ptr<Body>> bodies, const Progress& progress);

  std::size_t size() const { return placed_.size(); }
  bool any(Pose::Kind kind) const;
  const std::vector<PartInterior>& interiors() const { return interiors_; }
  const Body& body(std::size_t j) const { return *bodies_[j]; }
  double lightest_g() const { return lightest_g_; }  ///< all parts together, with nothing but their walls
  double solid_g() const { return solid_g_; }
  double most_afloat_g() const;  ///< of the state that carries least, with the usual reserve

  /// Of one that floats at a waterline that is given: what it weighs then. @throws Error{usage} for one above the thing
  std::optional<double> given_mass_g(std::size_t state) const;

  /// What the states ask for, and what is minimised meanwhile: with a mass given the heights of the centre of mass, else the mass
  /// and, a little, these; where nothing stands, how deep the centre of mass lies below the points it hangs from.
  /// @param tip  tangent of the least tipping angle of states that stand
  /// @param only  the one state that counts; none: all of them
  PartsGoal goal(double tip, std::optional<double> mass_g, std::optional<std::size_t> only = {}) const;

  /// Mass and static moments of all parts in that state, up = z. @param s  of the printed parts, in their working frames
  Eigen::Vector4d together(std::size_t state, const std::vector<Moments>& s) const;
  double tipping_angle_rad(std::size_t state, const std::vector<Moments>& s) const;  ///< infinite where it does not stand
  /// Of one that floats: of the metacentre above the centre of mass, over the diagonal.
  double metacentric_height(std::size_t state, const std::vector<Moments>& s) const;
  /// Of one that floats: let go at a tilt it comes back, dry.
  bool comes_back(std::size_t state, const std::vector<Moments>& s) const;

private:
  struct Placed {
    Eigen::Matrix3d turn;              ///< takes up to z
    SupportPolygon polygon;            ///< of one that stands
    std::optional<PreparedHull> hull;  ///< of one that floats
    Eigen::AlignedBox3d box;           ///< of the hull
    double diagonal_mm = 0;
    /// Of each part that is printed: its moments to mass (g) and static moments; of each other one these themselves.
    std::vector<Eigen::Matrix<double, 4, 10>> of_part;
    std::vector<Eigen::Vector4d> constant;
  };
  Placed placed(const MechanismState& state, const Progress& progress) const;
  /// A row as one of PartsGoal, and what it says of the parts that are not printed.
  struct Wanted {
    Eigen::VectorXd row;
    double constant = 0;
  };
  Wanted wanted(const Placed& p, const StateRows::Row& row, double scale) const;
  StateRows rows(std::size_t state, double tip, std::optional<double> mass_g) const;

  const Mechanism& mechanism_;
  std::vector<std::shared_ptr<Body>> bodies_;
  std::vector<PartInterior> interiors_;
  std::vector<Placed> placed_;
  double lightest_g_ = 0;
  double solid_g_ = 0;
};

}  // namespace rayrep::detail
