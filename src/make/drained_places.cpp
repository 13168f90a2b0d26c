#include "make/drained_places.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <tuple>

#include "base/text.h"
#include "mesh/shells.h"
#include "rayrep/base/error.h"
#include "rayrep/base/setting.h"
#include "rayrep/mesh/boolean.h"
#include "rayrep/mesh/clip.h"
#include "rayrep/physics/support_polygon.h"

namespace rayrep::detail {
namespace {

constexpr int kSides = 36;
constexpr double kMostTrapped = 0.01;  // of the room of all cavities
constexpr double kGoodEnough = 0.006;  // likewise, while there is a better place
constexpr double kMatters = 5e-4;      // likewise: a smaller pool is not worth a hole
constexpr double kGoodDrain = 0.003;   // of a cavity's room below which a place is as good as its lowest one
constexpr double kGoodVent = 0.05;     // and above which as its highest one
constexpr double kNear = 1.5;          // from axis to axis, in diameters: where it has to be
constexpr double kFreeboard = 0.03;    // of the height
constexpr double kHeel_rad = std::numbers::pi / 18;
constexpr int kMostTries = 12;  // of drains beside the first ones

std::string place(const Eigen::Vector3d& at) {
  const Eigen::Vector3d p = at.unaryExpr([](double x) { return std::abs(x) < 5e-3 ? 0 : x; });  // not -0.00
  return "(" + number(p.x(), 2) + ", " + number(p.y(), 2) + ", " + number(p.z(), 2) + ")";
}

/// Unit vectors across a direction, evenly around.
std::vector<Eigen::Vector3d> around(const Eigen::Vector3d& direction, int count) {
  const Eigen::Vector3d u = direction.unitOrthogonal();
  const Eigen::Vector3d v = direction.cross(u);
  std::vector<Eigen::Vector3d> all;
  for (int k = 0; k < count; ++k) {
    const double angle = 2 * std::numbers::pi * k / count;
    all.emplace_back(std::cos(angle) * u + std::sin(angle) * v);
  }
  return all;
}

/// How far a disc across `axis` reaches along `up`, over its radius.
double reach_along(const Eigen::Vector3d& axis, const Eigen::Vector3d& up) {
  return std::sqrt(std::max(0.0, 1 - std::pow(axis.dot(up), 2)));
}

/// How far outside its mouth a drill begins, over its radius: the outside may slope as much over a mouth.
constexpr double kOutside = 1;

/// Points on all triangles, no farther apart than this.
std::vector<Eigen::Vector3d> samples(const Mesh& mesh, double apart_mm) {
  std::vector<Eigen::Vector3d> points = mesh.vertices;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Eigen::Vector3d& a = mesh.corner(t, 0);
    const Eigen::Vector3d b = mesh.corner(t, 1) - a;
    const Eigen::Vector3d c = mesh.corner(t, 2) - a;
    const double longest = std::max({b.norm(), c.norm(), (c - b).norm()});
    const int n = static_cast<int>(std::ceil(longest / apart_mm));
    for (int i = 1; i < n; ++i)
      for (int j = 1; i + j < n; ++j) points.emplace_back(a + b * i / n + c * j / n);
    if (n < 3) points.emplace_back(a + (b + c) / 3);
  }
  return points;
}

/// @throws Error{usage} for cavities that were in the mesh before: none of them is drilled into
void refuse_own_cavities(const Mesh& given) {
  const Mesh mesh = with_merged_vertices(given);
  const Components shells = connected_components(mesh);
  double sealed_mm3 = 0;
  for (const double volume : shell_volumes(mesh, shells.of_triangle, shells.count)) sealed_mm3 -= std::min(volume, 0.0);
  if (sealed_mm3 > 0)
    throw Error(ErrorCode::usage,
                "The mesh has sealed cavities of its own, of " + number(sealed_mm3 / 1000, 2) +
                    " cm3 together: what is in them stays, as holes are drilled only into those that are made here. "
                    "Give the mesh without its inner surfaces, or leave the holes out (--drain, --resin).");
}

Mesh without_last(Mesh mesh, std::size_t triangles) {
  mesh.triangles.resize(mesh.triangles.size() - triangles);
  return mesh;
}

}  // namespace

Mesh drill(const DrainHole& hole, double radius_mm) {
  Mesh mesh;
  const std::vector<Eigen::Vector3d> sides = around(hole.outward, kSides);
  for (const double along : {-hole.length_mm, kOutside * radius_mm})
    for (const Eigen::Vector3d& side : sides) mesh.vertices.emplace_back(hole.mouth_mm + along * hole.outward + radius_mm * side);
  for (int k = 0; k < kSides; ++k) {
    const int next = (k + 1) % kSides;
    mesh.triangles.emplace_back(k, next, kSides + next);
    mesh.triangles.emplace_back(k, kSides + next, kSides + k);
    if (k == 0 || next == 0) continue;
    mesh.triangles.emplace_back(0, next, k);
    mesh.triangles.emplace_back(kSides, kSides + k, kSides + next);
  }
  return mesh;
}

DrainPlaces::Cavity::Cavity(Mesh shell) : mesh(std::move(shell)), surface(mesh), volume_mm3(mesh_moments(mesh)[M1]) {}

bool DrainPlaces::Cavity::holds(const Eigen::Vector3d& p) const { return is_inside(surface, p); }

/// Height below which this share of its room lies.
double DrainPlaces::Cavity::height_with(double share, const Eigen::Vector3d& up) const {
  double lo = std::numeric_limits<double>::infinity();
  double hi = -lo;
  for (const auto& v : mesh.vertices) {
    lo = std::min(lo, up.dot(v));
    hi = std::max(hi, up.dot(v));
  }
  for (int n = 0; n < 14; ++n) {
    const double middle = 0.5 * (lo + hi);
    const double below = volume_mm3 - mesh_moments(clipped(mesh, {up, middle}))[M1];
    (below < share * volume_mm3 ? lo : hi) = middle;
  }
  return 0.5 * (lo + hi);
}

DrainPlaces::DrainPlaces(const Body& body, const Spec& spec, std::size_t rooms, std::vector<Rod> pillars,
                         const std::vector<Mesh>& solid)
    : body_(body),
      spec_(spec),
      drains_(print_of(spec).drains),
      radius_mm_(0.5 * drains_.diameter_mm),
      wall_mm_(print_of(spec).wall_mm),
      sinks_(print_of(spec).liquid_g_cm3 > 0 && !print_of(spec).drained),
      print_up_(print_of(spec).direction.value_or(up_of(spec)).normalized()),
      from_working_(body.to_working.inverse()),
      outside_(combined({&body.outer, 1}).mesh),
      first_of_rooms_(static_cast<int>(outside_.mesh().triangles.size() - rooms)),
      reach_mm_(2 * body.diagonal_mm),
      pillars_(std::move(pillars)) {
  refuse_own_cavities(without_last(body.outer, rooms));
  std::visit([this](const auto& s) { add_bound(s); }, spec);
  Mesh all;
  for (const Mesh& region : solid) append(all, region);
  if (!all.triangles.empty()) kept_solid_.emplace(with_merged_vertices(all));
}

double DrainPlaces::lowest_along(const Eigen::Vector3d& up) const {
  double lowest = std::numeric_limits<double>::infinity();
  for (const auto& v : body_.outer.vertices) lowest = std::min(lowest, up.dot(v));
  return lowest;
}

void DrainPlaces::add_bound(const FloatSpec& spec) {
  if (drains_.plugged) return;
  if (is_submerged(spec) || !spec.waterline_mm)
    throw Error(ErrorCode::goal, "A body that is wholly under water is flooded through any hole: plug them (--plug).");
  const Eigen::Vector3d up = spec.up.normalized();
  bounds_.push_back(
      {up, lowest_along(up) + *spec.waterline_mm + kFreeboard * body_.height_mm, std::tan(kHeel_rad),
       bounding_box(body_.outer).center(),
       "lie above the waterline, by 3 % of the height and so that it takes no water when it heels by 10 degrees, unless it is "
       "closed again (--plug)"});
}

void DrainPlaces::add_bound(const StandSpec& spec) {
  const Eigen::Vector3d up = spec.up.normalized();
  const double height_mm = -lowest_along(-up) - lowest_along(up);
  bounds_.push_back({up, lowest_along(up) + spec.contact_tolerance_mm.value_or(contact_tolerance_mm(height_mm)), 0,
                     Eigen::Vector3d::Zero(), "not be in the support"});
}

void DrainPlaces::add_bound(const SpinSpec& spec) {
  balanced_ = true;
  if (spec.yoyo) return;
  const Eigen::Vector3d up = spec.up.normalized();
  bounds_.push_back({up, up.dot(from_working_.translation()) + contact_tolerance_mm(body_.height_mm), 0, Eigen::Vector3d::Zero(),
                     "be clear of the tip"});
}

void DrainPlaces::add_bound(const PoseSpec& spec) {
  for (const Pose& pose : spec.poses) {
    const Eigen::Vector3d up = pose.up_or(spec.up).normalized();
    const double lowest = lowest_along(up);
    const double height_mm = -lowest_along(-up) - lowest;
    if (pose.kind == Pose::Kind::floats && !drains_.plugged && pose.waterline_mm)
      bounds_.push_back({up, lowest + *pose.waterline_mm + kFreeboard * height_mm, std::tan(kHeel_rad),
                         bounding_box(body_.outer).center(),
                         "lie above the waterline of each pose, unless it is closed again (--plug)"});
    if (pose.kind == Pose::Kind::stands)
      bounds_.push_back({up, lowest + spec.contact_tolerance_mm.value_or(contact_tolerance_mm(height_mm)), 0,
                         Eigen::Vector3d::Zero(), "not be in the support of any pose"});
    balanced_ = balanced_ || pose.kind == Pose::Kind::spins;
  }
}

std::string DrainPlaces::out_of_bounds(const DrainHole& hole) const {
  for (const Bound& bound : bounds_) {
    const Eigen::Vector3d beside = hole.mouth_mm - bound.middle_mm;
    const double away = (beside - bound.up.dot(beside) * bound.up).norm() + radius_mm_;
    const double lowest = bound.up.dot(hole.mouth_mm) - radius_mm_ * reach_along(hole.outward, bound.up);
    const double needed = bound.above_mm + bound.slope * away;
    if (lowest <= needed)
      return std::string("it must ") + bound.words + ": its lowest point is " + number(needed - lowest, 2) + " mm too low";
  }
  return {};
}

/// The outside is one piece around it, not too steep, and there is room in front of it.
bool DrainPlaces::has_a_mouth(const DrainHole& hole) const {
  for (const Eigen::Vector3d& side : around(hole.outward, 12)) {
    const Eigen::Vector3d rim = hole.mouth_mm + radius_mm_ * side;
    if (outside_.closest(rim, 0.5 * radius_mm_).triangle < 0) return false;
    if (outside_.closest(rim + kOutside * radius_mm_ * hole.outward, 0.35 * radius_mm_).triangle >= 0) return false;
  }
  for (const double away : {1.0, 2.0, 3.0})
    if (outside_.closest(hole.mouth_mm + away * radius_mm_ * hole.outward, 0.6 * away * radius_mm_).triangle >= 0) return false;
  return true;
}

/// It comes out nowhere else, and its end leaves the wall what it needs.
bool DrainPlaces::keeps_in_the_wall(const DrainHole& hole, const Cavity& cavity) const {
  for (const Eigen::Vector3d& side : around(hole.outward, 12)) {
    const Eigen::Vector3d at = hole.inner_mm() + radius_mm_ * side;
    if (outside_.closest(at, std::min(0.5 * wall_mm_, 0.5 * hole.wall_mm)).triangle >= 0) return false;
    const Eigen::Vector3d end = at - (hole.length_mm - hole.wall_mm) * hole.outward;
    if (outside_.closest(end, 0.98 * wall_mm_).triangle >= 0 && !cavity.holds(end)) return false;
  }
  for (const double part : {0.2, 0.4, 0.6, 0.8}) {
    const Eigen::Vector3d between = hole.mouth_mm - part * hole.wall_mm * hole.outward;
    if (std::any_of(cavities_.begin(), cavities_.end(), [&](const Cavity& other) { return other.holds(between); })) return false;
  }
  return true;
}

/// Else what stands on it would begin in mid-air.
bool DrainPlaces::is_clear_of_pillars(const DrainHole& hole) const {
  const Rod drilled = hole.rod(radius_mm_);
  return std::all_of(pillars_.begin(), pillars_.end(),
                     [&](const Rod& pillar) { return gap_mm(drilled, pillar) >= kClearOfPillars_mm; });
}

/// What is kept solid lies neither around it nor within the wall of it; what is in front of the outside is no matter.
bool DrainPlaces::leaves_solid(const DrainHole& hole) const {
  if (!kept_solid_) return true;
  const double before_mm = hole.inside ? kOutside * radius_mm_ : 0;
  const double long_mm = before_mm + hole.length_mm;
  const int steps = static_cast<int>(std::ceil(4 * long_mm / radius_mm_));
  for (int n = 0; n <= steps; ++n) {
    const Eigen::Vector3d at = hole.mouth_mm + (before_mm - long_mm * n / steps) * hole.outward;
    if (is_inside(*kept_solid_, at) || kept_solid_->closest(at, radius_mm_ + wall_mm_).triangle >= 0) return false;
  }
  return true;
}

std::string DrainPlaces::wrong_with(const DrainHole& hole, const Cavity& cavity) const {
  if (std::string outside = out_of_bounds(hole); !outside.empty()) return outside;
  if (!has_a_mouth(hole)) return "the outside is too bent there, or something is in front of it";
  if (!is_clear_of_pillars(hole)) return "it would go through a pillar that carries a roof (--self-supporting)";
  if (!keeps_in_the_wall(hole, cavity)) return "it would come out at another place, or leave less than the wall there";
  if (!leaves_solid(hole)) return "it would come nearer than the wall to what is kept solid (--keep-solid)";
  return {};
}

bool DrainPlaces::apart(const DrainHole& hole, const std::vector<DrainHole>& others, double distance_mm) {
  return std::all_of(others.begin(), others.end(),
                     [&](const DrainHole& other) { return (other.mouth_mm - hole.mouth_mm).norm() >= distance_mm; });
}

/// Straight, with its end as far inside the cavity as there is room for, up to a radius.
std::optional<DrainHole> DrainPlaces::hole_to(const Eigen::Vector3d& inner, const Eigen::Vector3d& mouth,
                                              const Cavity& cavity) const {
  DrainHole hole;
  hole.wall_mm = (mouth - inner).norm();
  hole.mouth_mm = mouth;
  hole.outward = (mouth - inner).normalized();
  for (const double part : {1.0, 0.5, 0.25}) {
    hole.length_mm = hole.wall_mm + part * radius_mm_;
    if (cavity.holds(mouth - hole.length_mm * hole.outward)) return hole;
  }
  return std::nullopt;
}

/// What lies higher runs out: above the lowest line of the hole if that begins in the cavity, else above its axis there.
double DrainPlaces::spill_of(const DrainHole& hole, const Cavity& cavity) const {
  const double across = radius_mm_ * reach_along(hole.outward, print_up_);
  double inside = print_up_.dot(hole.inner_mm());
  if (across > 0.05 * radius_mm_) {
    const Eigen::Vector3d down = (print_up_.dot(hole.outward) * hole.outward - print_up_).normalized();
    const double in_mm = 0.5 * (hole.length_mm - hole.wall_mm);
    if (cavity.holds(hole.inner_mm() - in_mm * hole.outward + radius_mm_ * down)) inside -= across;
  }
  return std::max(inside, print_up_.dot(hole.mouth_mm) - across);
}

std::optional<DrainPlaces::Candidate> DrainPlaces::candidate(const Eigen::Vector3d& inner, const Cavity& cavity) const {
  const ClosestPoint mouth = outside_.closest(inner, longest_mm());
  if (mouth.triangle < 0 || mouth.triangle >= first_of_rooms_ || !(mouth.distance_mm > 0)) return std::nullopt;
  const std::optional<DrainHole> hole = hole_to(inner, mouth.point_mm, cavity);
  if (!hole || !out_of_bounds(*hole).empty()) return std::nullopt;
  return Candidate{*hole, spill_of(*hole, cavity)};
}

/// Along the spin axis, from its ends.
void DrainPlaces::add_on_axis(const Cavity& cavity, std::vector<Candidate>& all) const {
  std::vector<LineHit> outer;
  std::vector<LineHit> inner;
  closed_line_hits(body_.surface, {0, 0}, outer);
  closed_line_hits(SurfaceQuery(transformed(cavity.mesh, body_.to_working)), {0, 0}, inner);
  if (outer.size() < 2 || inner.empty()) return;
  const auto add = [&](double from_mm, double to_mm) {
    const auto hole = hole_to(from_working_ * Eigen::Vector3d(0, 0, to_mm), from_working_ * Eigen::Vector3d(0, 0, from_mm), cavity);
    if (hole && out_of_bounds(*hole).empty()) all.push_back({*hole, spill_of(*hole, cavity), true});
  };
  if (inner.back().z_mm > outer[outer.size() - 2].z_mm) add(outer.back().z_mm, inner.back().z_mm);
  if (inner.front().z_mm < outer[1].z_mm) add(outer.front().z_mm, inner.front().z_mm);
}

std::vector<DrainPlaces::Candidate> DrainPlaces::candidates(const Cavity& cavity) const {
  std::vector<Candidate> all;
  const double apart_mm = std::max(0.5 * drains_.diameter_mm, body_.diagonal_mm / 120);
  for (const Eigen::Vector3d& inner : samples(cavity.mesh, apart_mm))
    if (const auto one = candidate(inner, cavity)) all.push_back(*one);
  if (balanced_) add_on_axis(cavity, all);
  return all;
}

/// The hole on the other side of the spin axis, as nearly as the body's shape has it.
std::optional<DrainHole> DrainPlaces::opposite(const Candidate& one, const std::vector<Candidate>& all,
                                               const Cavity& cavity) const {
  Eigen::Vector3d p = body_.to_working * one.hole.mouth_mm;
  p.head<2>() *= -1;
  const Eigen::Vector3d there = from_working_ * p;
  const Candidate* nearest = nullptr;
  double distance = 0.75 * drains_.diameter_mm;
  for (const Candidate& other : all) {
    const double d = (other.hole.mouth_mm - there).norm();
    if (d >= distance || !apart(other.hole, {one.hole}, 2 * drains_.diameter_mm)) continue;
    distance = d;
    nearest = &other;
  }
  if (!nearest || !wrong_with(nearest->hole, cavity).empty()) return std::nullopt;
  return nearest->hole;
}

/// The hole that serves best of those that may be there, with the one opposite to it for a body that spins, if
/// there is one; empty if there is none.
std::vector<DrainHole> DrainPlaces::best(std::vector<Candidate> all, const Wanted& wanted, const Cavity& cavity,
                                         const std::vector<DrainHole>& before) const {
  const bool drain = wanted.end == Wanted::End::drain;
  const auto rank = [&](const Candidate& c) {
    const double off = drain ? c.spill_mm - wanted.enough_mm : wanted.enough_mm - print_up_.dot(c.hole.inner_mm());
    // Good enough: through the thinnest wall then, and with its bottom as low as can be, so that a floor that moves still drains.
    const double bottom = std::max(print_up_.dot(c.hole.inner_mm()), print_up_.dot(c.hole.mouth_mm)) -
                          radius_mm_ * reach_along(c.hole.outward, print_up_);
    return std::tuple(std::max(off, 0.0), !c.on_axis, std::floor(c.hole.wall_mm / (0.1 * wall_mm_)), drain ? bottom : off);
  };
  std::stable_sort(all.begin(), all.end(), [&](const Candidate& a, const Candidate& b) { return rank(a) < rank(b); });
  std::optional<DrainHole> alone;
  for (const Candidate& one : all) {
    if (!apart(one.hole, before, wanted.apart * drains_.diameter_mm) || !wrong_with(one.hole, cavity).empty()) continue;
    if (!balanced_ || one.on_axis) return {drain && sinks_ ? sunk(one.hole, cavity) : one.hole};
    const auto other = opposite(one, all, cavity);
    if (other && apart(*other, before, wanted.apart * drains_.diameter_mm)) return {one.hole, *other};
    if (!alone) alone = one.hole;
  }
  // What it takes is made up for inside.
  return alone ? std::vector<DrainHole>{*alone} : std::vector<DrainHole>();
}

/// Lower, so that its bottom is a gutter in the floor: what stays beside it is then as smooth in where the floor lies as that is.
/// theory.md (153)
DrainHole DrainPlaces::sunk(const DrainHole& hole, const Cavity& cavity) const {
  if (std::abs(hole.outward.dot(print_up_)) > 0.5) return hole;  // it leads down, or up
  const double open_mm = 0.5 * radius_mm_;                       // above the floor, of the axis
  for (const double part : {1.0, 0.75, 0.5, 0.25}) {
    DrainHole lower = hole;
    const Eigen::Vector3d down = hole.mouth_mm - part * radius_mm_ * print_up_;
    const ClosestPoint mouth = outside_.closest(down, radius_mm_);
    if (mouth.triangle < 0 || mouth.triangle >= first_of_rooms_) continue;
    lower.mouth_mm = mouth.point_mm;
    const double longer_mm = hole.outward.dot(mouth.point_mm - down);
    lower.wall_mm += longer_mm;
    lower.length_mm += longer_mm;
    const Eigen::Vector3d end = lower.mouth_mm - lower.length_mm * lower.outward;
    if (lower.wall_mm > 0 && cavity.holds(end - open_mm * print_up_) && wrong_with(lower, cavity).empty()) return lower;
  }
  return hole;
}

/// From the lowest point of a cavity into another one close below it, as the two of a top meet on its axis.
std::optional<DrainHole> DrainPlaces::passage(const Cavity& cavity) const {
  const Eigen::Vector3d& lowest =
      *std::min_element(cavity.mesh.vertices.begin(), cavity.mesh.vertices.end(),
                        [this](const Eigen::Vector3d& a, const Eigen::Vector3d& b) { return print_up_.dot(a) < print_up_.dot(b); });
  for (const Cavity& other : cavities_) {
    const ClosestPoint there = other.surface.closest(lowest, 2 * drains_.diameter_mm);
    if (&other == &cavity || there.triangle < 0 || print_up_.dot(there.point_mm - lowest) > 0) continue;
    DrainHole hole{.mouth_mm = there.point_mm, .outward = -print_up_, .wall_mm = there.distance_mm, .inside = true};
    if (hole.wall_mm > 0.5 * radius_mm_) hole.outward = (there.point_mm - lowest).normalized();
    hole.length_mm = hole.wall_mm + radius_mm_;
    const Eigen::Vector3d ends[] = {there.point_mm + kOutside * radius_mm_ * hole.outward,
                                    there.point_mm - hole.length_mm * hole.outward};
    if (outside_.closest(ends[0], radius_mm_ + wall_mm_).triangle < 0 &&
        outside_.closest(ends[1], radius_mm_ + wall_mm_).triangle < 0 && leaves_solid(hole) && is_clear_of_pillars(hole))
      return hole;
  }
  return std::nullopt;
}

/// @throws Error{goal} where there is no place
std::vector<DrainHole> DrainPlaces::drains_of(const Cavity& cavity, const std::vector<Candidate>& all,
                                              const std::vector<DrainHole>& before) const {
  if (const auto into_other = passage(cavity)) return {*into_other};
  std::vector<DrainHole> holes =
      best(all, {.end = Wanted::End::drain, .enough_mm = cavity.height_with(kGoodDrain, print_up_)}, cavity, before);
  if (!holes.empty()) return holes;
  const Eigen::Vector3d middle = mesh_moments(cavity.mesh).segment<3>(MX) / cavity.volume_mm3;
  throw Error(ErrorCode::goal, "The cavity around " + place(middle) + " cannot be drained: it has no place for a hole of " +
                                   number(drains_.diameter_mm, 2) + " mm" + bounds_words() + "." +
                                   remedies(" A smaller one may do (--drain-diameter)" +
                                            std::string(drains_.plugged ? "." : ", or holes that are closed again (--plug).")));
}

std::vector<DrainHole> DrainPlaces::for_cavity(const Cavity& cavity, const std::vector<DrainHole>& before) const {
  const std::vector<Candidate> all = candidates(cavity);
  std::vector<DrainHole> holes = drains_of(cavity, all, before);
  const double low = print_up_.dot(holes.front().inner_mm());
  const double high = cavity.height_with(1 - kGoodVent, print_up_);
  std::vector<DrainHole> others = before;
  others.insert(others.end(), holes.begin(), holes.end());
  for (const DrainHole& vent : best(all, {.end = Wanted::End::vent, .enough_mm = high}, cavity, others))
    if (print_up_.dot(vent.inner_mm()) > low + drains_.diameter_mm) holes.push_back(vent);
  return holes;
}

/// On the outside. @throws Error{usage} for a place that is not near it
Eigen::Vector3d DrainPlaces::mouth_near(const Eigen::Vector3d& given) const {
  const Eigen::AlignedBox3d box = bounding_box(body_.outer);
  const Eigen::Vector3d in_box = given.cwiseMax(box.min()).cwiseMin(box.max());
  constexpr double kSquaresOverflow = 1e9;
  const Eigen::Vector3d from = (given - in_box).stableNorm() < kSquaresOverflow * body_.diagonal_mm ? given : in_box;
  const Eigen::Vector3d mouth = outside_.closest(from, reach_mm_ + (from - body_.outer.vertices.front()).norm()).point_mm;
  const double away_mm = (given - mouth).stableNorm();
  if (away_mm <= longest_mm()) return mouth;
  throw Error(ErrorCode::usage,
              concat("There is no hole to drill at ", shown(given), ": that is ", shown(away_mm, 4),
                     " mm away from the outside, the nearest point of which is ", place(mouth),
                     ". Choose a place on the outside, in mm and in the mesh's frame (--drain), or --drain auto."));
}

/// To the nearest point of the cavity, or among cones to the nearest one to which there is nothing against it.
std::optional<DrainHole> DrainPlaces::given_hole(const Eigen::Vector3d& mouth, const Eigen::Vector3d& inner,
                                                 const Cavity& cavity) const {
  const std::optional<DrainHole> nearest = hole_to(inner, mouth, cavity);
  if (pillars_.empty() || (nearest && wrong_with(*nearest, cavity).empty())) return nearest;
  std::vector<Eigen::Vector3d> ends = samples(cavity.mesh, 0.25 * drains_.diameter_mm);
  std::erase_if(ends, [&](const Eigen::Vector3d& p) { return (p - mouth).norm() > longest_mm(); });
  std::sort(ends.begin(), ends.end(), [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return (a - mouth).squaredNorm() < (b - mouth).squaredNorm();
  });
  for (const Eigen::Vector3d& end : ends)
    if (const auto hole = hole_to(end, mouth, cavity); hole && wrong_with(*hole, cavity).empty()) return hole;
  return nearest;
}

std::vector<DrainHole> DrainPlaces::at_given_places() const {
  std::vector<DrainHole> holes;
  for (const Eigen::Vector3d& given : drains_.points_mm) {
    const Eigen::Vector3d mouth = mouth_near(given);
    const Cavity* nearest = nullptr;
    ClosestPoint inner{.distance_mm = reach_mm_};
    for (const Cavity& cavity : cavities_)
      if (const ClosestPoint p = cavity.surface.closest(mouth, inner.distance_mm); p.triangle >= 0) {
        inner = p;
        nearest = &cavity;
      }
    const std::string name = "The hole at " + place(mouth) + " cannot be drilled";
    if (!nearest) throw Error(ErrorCode::usage, name + ": there is no cavity.");
    const auto hole = given_hole(mouth, inner.point_mm, *nearest);
    const Eigen::Vector3d end = hole ? hole->inner_mm() : inner.point_mm;
    const double away_mm = (end - mouth).norm();
    const ClosestPoint back = outside_.closest(end, away_mm);
    if (!hole || away_mm > std::min(longest_mm(), back.distance_mm + drains_.diameter_mm))
      throw Error(ErrorCode::usage, name + ": behind it is no cavity. The nearest one is " + number(away_mm, 2) + " mm away, at " +
                                        place(end) + ", and holes are " + number(longest_mm(), 1) +
                                        " mm long at most. From there the outside is nearest at " + place(back.point_mm) + ", " +
                                        number(back.distance_mm, 2) +
                                        " mm away: choose a place near that (--drain), or --drain auto.");
    const std::string wrong = wrong_with(*hole, *nearest);
    if (!wrong.empty()) throw Error(ErrorCode::usage, name + ": " + wrong + ". Choose another place (--drain), or --drain auto.");
    if (!apart(*hole, holes, kNear * drains_.diameter_mm))
      throw Error(ErrorCode::usage, name + ": it lies too near to another one. Leave one of them out.");
    holes.push_back(*hole);
  }
  return holes;
}

/// Of what is in the cavities; hollows of the outside do not count.
double DrainPlaces::stays_mm3(const Mesh& drilled, std::vector<Pool>& pools) const {
  pools = pools_in(drilled, print_up_);
  std::erase_if(pools, [&](const Pool& pool) { return outside_.closest(pool.lowest_mm, 1e-6 * wall_mm_).triangle >= 0; });
  return total(pools)[M1];
}

bool DrainPlaces::still_drain(const Mesh& drilled, const Mesh& shells) const {
  std::vector<Pool> pools;
  return drains_.where == Drains::Where::given || stays_mm3(drilled, pools) <= kGoodEnough * -mesh_moments(shells)[M1];
}

/// Below its surface, as near to its lowest point as there is one: farther away it may lead into another one.
std::vector<DrainHole> DrainPlaces::drains_of(const Pool& pool, const std::vector<DrainHole>& before) const {
  const double depth_mm = pool.surface_mm - print_up_.dot(pool.lowest_mm);
  const double wide_mm = std::max(drains_.diameter_mm, 2 * std::sqrt(pool.s[M1] / std::max(depth_mm, 1e-3)));
  const auto cavity = std::find_if(cavities_.begin(), cavities_.end(), [&](const Cavity& one) {
    return one.surface.closest(pool.lowest_mm, 0.1 * wall_mm_).triangle >= 0;
  });
  if (cavity == cavities_.end()) return {};
  const std::vector<Candidate> all = candidates(*cavity);
  std::vector<DrainHole> found;
  for (double within_mm = drains_.diameter_mm; found.empty() && within_mm < 2 * wide_mm; within_mm *= 2) {
    std::vector<Candidate> near = all;
    std::erase_if(near, [&](const Candidate& c) {
      return c.spill_mm >= pool.surface_mm - 0.2 * depth_mm || (c.hole.inner_mm() - pool.lowest_mm).norm() > within_mm;
    });
    found = best(std::move(near), {.end = Wanted::End::drain, .enough_mm = print_up_.dot(pool.lowest_mm), .apart = kNear}, *cavity,
                 before);
  }
  return found;
}

/// Adds drains for the largest pools that can be drained while more stays than may.
void DrainPlaces::drain_what_stays(const Drilled& drilled, std::vector<DrainHole>& holes) const {
  double room_mm3 = 0;
  for (const Cavity& cavity : cavities_) room_mm3 += cavity.volume_mm3;
  std::vector<Pool> pools;
  double stay_mm3 = stays_mm3(drilled(holes), pools);
  std::vector<DrainHole> tried = holes;
  for (int n = 0; n < kMostTries && stay_mm3 > kGoodEnough * room_mm3; ++n) {
    std::sort(pools.begin(), pools.end(), [](const Pool& a, const Pool& b) { return a.s[M1] > b.s[M1]; });
    std::vector<DrainHole> found;
    for (auto pool = pools.begin(); pool != pools.end() && found.empty(); ++pool)
      if (pool->s[M1] > kMatters * room_mm3) found = drains_of(*pool, tried);
    if (found.empty()) break;
    tried.insert(tried.end(), found.begin(), found.end());
    found.insert(found.begin(), holes.begin(), holes.end());
    std::vector<Pool> left;
    const double less_mm3 = stays_mm3(drilled(found), left);
    if (less_mm3 > stay_mm3 - kMatters * room_mm3) continue;  // it leads into another pool
    holes = std::move(found);
    pools = std::move(left);
    stay_mm3 = less_mm3;
  }
  if (stay_mm3 <= kMostTrapped * room_mm3) return;
  throw Error(
      ErrorCode::goal,
      "Held with " + held() + " up, as it is printed, " + number(stay_mm3 / 1000, 2) + " cm3 would stay in the cavities, " +
          number(100 * stay_mm3 / room_mm3, 1) + " % of their room: no hole can be lower" + bounds_words() + "." +
          remedies(" Print it the other way up (--print-direction), " +
                   std::string(drains_.plugged ? "" : "close the holes again (--plug), ") +
                   "drill narrower ones (--drain-diameter), or say where they shall be and take what stays (--drain X,Y,Z)."));
}

/// The print's direction.
std::string DrainPlaces::held() const {
  Eigen::Vector3d up = print_up_;
  return shown(Setting{.name = "", .value = "", .words = "", .details = "", .place = direction_place("", up)});
}

/// Among cones it is tried what helps: drain_refusal.h
std::string DrainPlaces::remedies(const std::string& words) const { return pillars_.empty() ? words : std::string(); }

/// ", as each must ..."
std::string DrainPlaces::bounds_words() const {
  std::string words = ", as each must be " + number(longest_mm(), 1) + " mm long at most";
  for (const Bound& bound : bounds_) words += std::string(", ") + bound.words;
  if (kept_solid_) words += ", keep off what is kept solid (--keep-solid)";
  if (!pillars_.empty()) words += ", pass beside pillars (--self-supporting)";
  return words + ", and have a mouth where the outside is even";
}

std::vector<DrainHole> DrainPlaces::find(const Mesh& shells, const Drilled& drilled) {
  cavities_.clear();
  const Mesh joined = with_merged_vertices(shells);
  for (Mesh& shell : split(joined, connected_components(joined))) {
    flip(shell);
    if (mesh_moments(shell)[M1] > 0) cavities_.emplace_back(std::move(shell));
  }
  if (drains_.where == Drains::Where::given) return at_given_places();
  std::vector<DrainHole> holes;
  for (const Cavity& cavity : cavities_)
    for (const DrainHole& hole : for_cavity(cavity, holes)) holes.push_back(hole);
  drain_what_stays(drilled, holes);
  return holes;
}

}  // namespace rayrep::detail
