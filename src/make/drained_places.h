#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "make/body.h"
#include "make/rod.h"
#include "physics/trapped.h"
#include "rayrep/mesh/surface_query.h"
#include "rayrep/physics/spec.h"

namespace rayrep::detail {

/// A straight hole from the outside into a cavity, in the frame given.
struct DrainHole {
  Eigen::Vector3d mouth_mm = Eigen::Vector3d::Zero();  ///< where its axis meets the outside
  Eigen::Vector3d outward = Eigen::Vector3d::UnitZ();  ///< a unit vector
  double wall_mm = 0;                                  ///< from the mouth to the cavity, along the axis
  double length_mm = 0;                                ///< from the mouth to its end
  bool inside = false;                                 ///< it leads into another cavity
  Eigen::Vector3d inner_mm() const { return mouth_mm - wall_mm * outward; }
  Rod rod(double radius_mm) const { return {mouth_mm, mouth_mm - length_mm * outward, radius_mm}; }
};

/// What is drilled: a prism of this radius, facing outward, from well outside the mouth to the hole's end.
Mesh drill(const DrainHole& hole, double radius_mm);

/// Where cavities can be drained. theory.md (103)
class DrainPlaces {
public:
  using Drilled = std::function<Mesh(const std::vector<DrainHole>&)>;

  /// Keeps references. @param spec  filled in: waterline, axis, contact point
  /// @param rooms    so many of the last triangles of Body::outer are of rooms for what is fixed in it
  /// @param pillars  that holes keep clear of
  /// @param solid    regions that they are as far from as cavities are: closed, facing outward
  DrainPlaces(const Body& body, const Spec& spec, std::size_t rooms, std::vector<Rod> pillars, const std::vector<Mesh>& solid);

  /// The holes asked for: at the places given, or for each cavity where it drains and where air comes in, and more while something
  /// would stay in it.
  /// @param shells   surfaces of the cavities, facing inward, in the frame given
  /// @param drilled  the body with these holes
  /// @throws Error{goal}, of places that were given Error{usage}, with figures and what to do
  std::vector<DrainHole> find(const Mesh& shells, const Drilled& drilled);

  /// Whether they still let out enough of what these cavities hold, where they were to be found.
  bool still_drain(const Mesh& drilled, const Mesh& shells) const;

  const Eigen::Vector3d& print_up() const { return print_up_; }

private:
  /// A way up in which the hole must lie above a height.
  struct Bound {
    Eigen::Vector3d up;
    double above_mm = 0;
    double slope = 0;  ///< and higher by so much of its distance from `middle_mm`
    Eigen::Vector3d middle_mm;
    const char* words;
  };
  /// A hole that may do, and how well it drains.
  struct Candidate {
    DrainHole hole;
    double spill_mm = 0;  ///< along the print's direction: what lies higher in its cavity runs out
    bool on_axis = false;
  };
  /// One cavity: facing outward, and what is asked of it.
  struct Cavity {
    explicit Cavity(Mesh shell);
    bool holds(const Eigen::Vector3d& p) const;
    double height_with(double share, const Eigen::Vector3d& up) const;

    Mesh mesh;
    SurfaceQuery surface;
    double volume_mm3;
  };
  struct Wanted {
    enum class End { drain, vent } end;
    double enough_mm;  ///< along the print's direction: where a drain spills, or a vent begins, that is good enough
    double apart = 2;  ///< from the axes of other holes, in diameters
  };

  void add_bound(const FloatSpec& spec);
  void add_bound(const SpinSpec& spec);
  void add_bound(const StandSpec& spec);
  void add_bound(const PoseSpec& spec);
  void add_bound(const TargetSpec&) {}
  void add_bound(const DiceSpec&) {}
  double lowest_along(const Eigen::Vector3d& up) const;

  std::optional<DrainHole> hole_to(const Eigen::Vector3d& inner, const Eigen::Vector3d& mouth, const Cavity& cavity) const;
  std::string wrong_with(const DrainHole& hole, const Cavity& cavity) const;
  std::string out_of_bounds(const DrainHole& hole) const;
  bool has_a_mouth(const DrainHole& hole) const;
  bool is_clear_of_pillars(const DrainHole& hole) const;
  bool keeps_in_the_wall(const DrainHole& hole, const Cavity& cavity) const;
  bool leaves_solid(const DrainHole& hole) const;
  double longest_mm() const { return 6 * wall_mm_ + 2 * drains_.diameter_mm; }  ///< a hole through so much is none through a wall
  double stays_mm3(const Mesh& drilled, std::vector<Pool>& pools) const;
  std::string held() const;
  std::string bounds_words() const;
  std::string remedies(const std::string& words) const;
  static bool apart(const DrainHole& hole, const std::vector<DrainHole>& others, double distance_mm);

  std::vector<Candidate> candidates(const Cavity& cavity) const;
  std::optional<Candidate> candidate(const Eigen::Vector3d& inner, const Cavity& cavity) const;
  void add_on_axis(const Cavity& cavity, std::vector<Candidate>& all) const;
  double spill_of(const DrainHole& hole, const Cavity& cavity) const;
  std::vector<DrainHole> best(std::vector<Candidate> all, const Wanted& wanted, const Cavity& cavity,
                              const std::vector<DrainHole>& before) const;
  DrainHole sunk(const DrainHole& hole, const Cavity& cavity) const;
  std::optional<DrainHole> opposite(const Candidate& one, const std::vector<Candidate>& all, const Cavity& cavity) const;

  Eigen::Vector3d mouth_near(const Eigen::Vector3d& given) const;
  std::optional<DrainHole> given_hole(const Eigen::Vector3d& mouth, const Eigen::Vector3d& inner, const Cavity& cavity) const;
  std::vector<DrainHole> at_given_places() const;
  std::optional<DrainHole> passage(const Cavity& cavity) const;
  std::vector<DrainHole> drains_of(const Cavity& cavity, const std::vector<Candidate>& all,
                                   const std::vector<DrainHole>& before) const;
  std::vector<DrainHole> drains_of(const Pool& pool, const std::vector<DrainHole>& before) const;
  std::vector<DrainHole> for_cavity(const Cavity& cavity, const std::vector<DrainHole>& before) const;
  void drain_what_stays(const Drilled& drilled, std::vector<DrainHole>& holes) const;

  const Body& body_;
  const Spec& spec_;
  const Drains& drains_;
  double radius_mm_;
  double wall_mm_;
  bool sinks_;  ///< drains, as what stays weighs
  Eigen::Vector3d print_up_;
  Eigen::Affine3d from_working_;
  SurfaceQuery outside_;
  int first_of_rooms_;
  double reach_mm_;  ///< a radius within which everything is found
  bool balanced_ = false;
  std::vector<Bound> bounds_;
  std::vector<Rod> pillars_;
  std::vector<Cavity> cavities_;
  std::optional<SurfaceQuery> kept_solid_;
};

}  // namespace rayrep::detail
