#include "rayrep/physics/hydrostatics.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <vector>

#include "base/linear_algebra.h"
#include "base/text.h"
#include "mesh/mesh_edges.h"
#include "mesh/shells.h"
#include "rayrep/base/error.h"

namespace rayrep {
namespace {

// u, v, n right-handed and orthonormal.
struct Frame {
  Eigen::Vector3d u;
  Eigen::Vector3d v;
  Eigen::Vector3d n;
};

Frame frame_of(const Eigen::Vector3d& normal) {
  int smallest = 0;
  normal.cwiseAbs().minCoeff(&smallest);
  const Eigen::Vector3d u = normal.cross(Eigen::Vector3d::Unit(smallest)).normalized();
  return {u, normal.cross(u), normal};
}

// Integrals over the wet part of a body and over its waterplane, in a frame whose third axis is the height above the water.
struct Integrals {
  double volume = 0;
  Eigen::Vector3d first = Eigen::Vector3d::Zero();  // of (x, y, h) over the volume
  double area = 0;
  Eigen::Vector2d area_first = Eigen::Vector2d::Zero();   // of (x, y) over the waterplane
  Eigen::Matrix2d area_second = Eigen::Matrix2d::Zero();  // of (x, y)(x, y)^T over the waterplane

  // A wet triangle: the fluxes of (0, 0, h), (0, 0, x h), (0, 0, y h), (0, 0, h^2/2). theory.md (5)-(6).
  void add_wet_triangle(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
    const double projected = ((b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x())) / 2;
    const Eigen::Vector3d sum = a + b + c;
    volume += projected * sum.z() / 3;
    const Eigen::Vector3d by_height = a.z() * a + b.z() * b + c.z() * c + sum.z() * sum;  // 12 times the mean of h (x, y, h)
    first.head<2>() += projected / 12 * by_height.head<2>();
    first.z() += projected / 24 * by_height.z();
  }

  // A segment of the waterplane's rim, counter-clockwise seen from above: Green's theorem. theory.md (7).
  void add_rim(const Eigen::Vector2d& p, const Eigen::Vector2d& q) {
    const double cross = p.x() * q.y() - p.y() * q.x();
    const Eigen::Vector2d sum = p + q;
    area += cross / 2;
    area_first += cross / 6 * sum;
    area_second += cross / 24 * (sum * sum.transpose() + p * p.transpose() + q * q.transpose());
  }
};

// Where the edge from a wet to a dry corner meets the water. Both triangles of an edge get the same bits, since both call it with
// the wet corner first.
Eigen::Vector3d crossing(const Eigen::Vector3d& wet, const Eigen::Vector3d& dry) {
  const double t = wet.z() / (wet.z() - dry.z());
  return {wet.x() + t * (dry.x() - wet.x()), wet.y() + t * (dry.y() - wet.y()), 0};
}

// `points` are the vertices as (x, y, h). A corner is wet when h < 0: a face or an edge that lies in the plane counts as dry, so
// that the waterplane is the section just below the plane, and no case is special.
Integrals integrate(const std::vector<Eigen::Vector3d>& points, const std::vector<Eigen::Vector3i>& triangles) {
  Integrals sum;
  for (const auto& t : triangles) {
    const Eigen::Vector3d* corner[3] = {&points[t[0]], &points[t[1]], &points[t[2]]};
    const bool wet[3] = {corner[0]->z() < 0, corner[1]->z() < 0, corner[2]->z() < 0};
    const int count = wet[0] + wet[1] + wet[2];
    if (count == 0) continue;
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

// The waterplane's second moments about its centroid, in the frame's u and v.
Eigen::Matrix2d central_second_moments(const Integrals& sum) {
  if (!(sum.area > 0)) return Eigen::Matrix2d::Zero();
  return sum.area_second - sum.area_first * sum.area_first.transpose() / sum.area;
}

// A hull prepared for many waterplanes. Vertices that no triangle uses are left out; coordinates are relative to the middle of the
// bounding box, so that a body far from the origin keeps its digits.
class Hull {
public:
  explicit Hull(const Mesh& mesh) : triangles_(mesh.triangles) {
    std::vector<int> renumbered(mesh.vertices.size(), -1);
    Eigen::AlignedBox3d box;
    for (auto& t : triangles_)
      for (int k = 0; k < 3; ++k) {
        int& index = renumbered[t[k]];
        if (index < 0) {
          index = static_cast<int>(vertices_.size());
          vertices_.push_back(mesh.vertices[t[k]]);
          box.extend(vertices_.back());
        }
        t[k] = index;
      }
    if (vertices_.empty()) return;
    centre_ = box.center();
    diagonal_ = box.diagonal().norm();
    for (auto& v : vertices_) v -= centre_;
    twice_areas_.reserve(triangles_.size());
    for (const auto& t : triangles_) {
      const Eigen::Vector3d& a = vertices_[t[0]];
      twice_areas_.push_back((vertices_[t[1]] - a).cross(vertices_[t[2]] - a));
      volume_ += twice_areas_.back().dot(a) / 6;
    }
  }

  double volume() const { return volume_; }
  double diagonal() const { return diagonal_; }
  const Eigen::Vector3d& centre() const { return centre_; }

  // Sets the direction of up; offsets are then measured from centre() along it.
  void set_up(const Eigen::Vector3d& up) {
    frame_ = frame_of(up);
    lowest_ = std::numeric_limits<double>::infinity();
    highest_ = -lowest_;
    heights_.resize(vertices_.size());
    for (std::size_t i = 0; i < vertices_.size(); ++i) {
      heights_[i] = up.dot(vertices_[i]);
      lowest_ = std::min(lowest_, heights_[i]);
      highest_ = std::max(highest_, heights_[i]);
    }
    projected_.resize(triangles_.size());
    for (std::size_t t = 0; t < triangles_.size(); ++t) projected_[t] = up.dot(twice_areas_[t]) / 2;
  }

  const Frame& frame() const { return frame_; }
  double lowest() const { return lowest_; }

  // Volume below an offset and its derivative, the waterplane's area, from heights alone: minus the sum over triangles of the
  // projected area times the mean depth of its wet part. theory.md (8).
  double volume_below(double offset, double* area) const {
    double volume = 0;
    double slope = 0;
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      std::array<double, 3> depth;
      for (int k = 0; k < 3; ++k) depth[k] = offset - heights_[triangles_[t][k]];
      const bool wet[3] = {depth[0] > 0, depth[1] > 0, depth[2] > 0};
      const int count = wet[0] + wet[1] + wet[2];
      if (count == 0) continue;
      double mean = (depth[0] + depth[1] + depth[2]) / 3;
      double fraction = 1;
      if (count != 3) {
        int k = 0;
        while (wet[k] != (count == 1)) ++k;
        const double alone = depth[k];
        const double part = alone / (alone - depth[(k + 1) % 3]) * (alone / (alone - depth[(k + 2) % 3]));
        fraction = count == 1 ? part : 1 - part;
        mean = count == 1 ? part * alone / 3 : mean - part * alone / 3;
      }
      volume -= projected_[t] * mean;
      slope -= projected_[t] * fraction;
    }
    *area = slope;
    return volume;
  }

  // The offset at which `volume` is displaced, 0 <= volume <= this->volume(). Newton's method, with bisection whenever it leaves
  // the bracket or does not halve the error: the waterplane's area may jump (flat faces) or vanish (gaps between parts).
  double offset_for_volume(double volume, double guess) const {
    double lo = lowest_;
    double hi = highest_;
    if (!(volume > 0)) return lo;
    if (volume >= volume_) return hi;
    const double volume_accuracy = 1e-15 * volume_;
    const double offset_accuracy = 1e-15 * (hi - lo);
    double offset = guess > lo && guess < hi ? guess : (lo + hi) / 2;
    double last_error = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 200; ++i) {
      double area = 0;
      const double error = volume_below(offset, &area) - volume;
      if (std::abs(error) <= volume_accuracy) break;
      (error > 0 ? hi : lo) = offset;
      double next = offset - error / area;
      if (!(next > lo && next < hi) || std::abs(error) > last_error / 2) next = (lo + hi) / 2;
      last_error = std::abs(error);
      const double turn = std::abs(next - offset);
      offset = next;
      if (turn <= offset_accuracy || hi - lo <= offset_accuracy) break;
    }
    return offset;
  }

  // Integrals at an offset, in the frame, from the point below centre() on the plane.
  Integrals integrals(double offset) {
    points_.resize(vertices_.size());
    for (std::size_t i = 0; i < vertices_.size(); ++i)
      points_[i] = {frame_.u.dot(vertices_[i]), frame_.v.dot(vertices_[i]), heights_[i] - offset};
    return integrate(points_, triangles_);
  }

private:
  std::vector<Eigen::Vector3d> vertices_;
  std::vector<Eigen::Vector3i> triangles_;
  std::vector<Eigen::Vector3d> twice_areas_;
  Eigen::Vector3d centre_ = Eigen::Vector3d::Zero();
  double diagonal_ = 0;
  double volume_ = 0;
  Frame frame_;
  std::vector<double> heights_;
  std::vector<double> projected_;
  std::vector<Eigen::Vector3d> points_;
  double lowest_ = 0;
  double highest_ = 0;
};

// ----------------------------------------------------------------------------------------------------------- nesting of components

// A component of a mesh, as its triangles in the whole.
struct Part {
  std::vector<int> triangles;
  Eigen::AlignedBox3d box;
  bool closed = true;
};

std::vector<Part> parts_of(const Mesh& mesh, const Components& components) {
  std::vector<Part> parts(components.count);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    Part& part = parts[components.of_triangle[t]];
    part.triangles.push_back(static_cast<int>(t));
    for (int k = 0; k < 3; ++k) part.box.extend(mesh.corner(t, k));
  }
  for_each_edge(mesh, [&](auto begin, auto end) {
    if (edge_balance(begin, end) != 0) parts[components.of_triangle[begin->triangle]].closed = false;
  });
  return parts;
}

// Winding number of the surroundings of a part (all others) where it lies, taken at the first of a few of its triangles'
// centroids that is not on another part's surface.
int winding_of_surroundings(ShellNesting& nesting, const Mesh& mesh, const Part& part, int self) {
  const std::size_t tries = std::min<std::size_t>(part.triangles.size(), 8);
  Surroundings around;
  for (std::size_t i = 0; i < tries; ++i) {
    const int t = part.triangles[i * part.triangles.size() / tries];
    nesting.around((mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2)) / 3, self, around);
    if (around.touched.empty() && around.line_closes) return around.winding;
  }
  return 0;
}

}  // namespace

double Hydrostatics::metacentric_radius_mm() const {
  return displaced_volume_mm3 > 0 ? smallest_second_moment_mm4 / displaced_volume_mm3 : 0;
}

Eigen::Vector3d Hydrostatics::metacentre_mm(const Waterplane& plane) const {
  return centre_of_buoyancy_mm + metacentric_radius_mm() * plane.normal;
}

Hydrostatics hydrostatics(const Mesh& hull, const Waterplane& plane) {
  assert(std::abs(plane.normal.norm() - 1) < 1e-9);
  Hydrostatics result;
  if (hull.triangles.empty()) return result;
  const Frame frame = frame_of(plane.normal);
  const Eigen::Vector3d centre = bounding_box(hull).center();
  std::vector<Eigen::Vector3d> points;
  points.reserve(hull.vertices.size());
  for (const auto& v : hull.vertices) {
    const Eigen::Vector3d from_centre = v - centre;
    // Height from the coordinates as they are: a vertex that lies on the plane must give exactly 0.
    points.emplace_back(frame.u.dot(from_centre), frame.v.dot(from_centre), frame.n.dot(v) - plane.offset_mm);
  }
  const Integrals sum = integrate(points, hull.triangles);
  const Eigen::Vector3d on_plane = centre - (frame.n.dot(centre) - plane.offset_mm) * frame.n;
  if (sum.volume > 0) {
    const Eigen::Vector3d c = sum.first / sum.volume;
    result.displaced_volume_mm3 = sum.volume;
    result.centre_of_buoyancy_mm = on_plane + frame.u * c.x() + frame.v * c.y() + frame.n * c.z();
  }
  if (sum.area > 0) {
    const Eigen::Vector2d f = sum.area_first / sum.area;
    result.waterplane_area_mm2 = sum.area;
    result.centre_of_flotation_mm = on_plane + frame.u * f.x() + frame.v * f.y();
    const Eigen::Vector2d second = symmetric_eigen(central_second_moments(sum)).values;
    result.smallest_second_moment_mm4 = std::max(0., second[0]);
    result.largest_second_moment_mm4 = std::max(0., second[1]);
  }
  return result;
}

Mesh outer_hull(const Mesh& mesh) {
  const Mesh joined = with_merged_vertices(mesh);
  const Components components = connected_components(joined);
  const std::vector<Part> parts = parts_of(joined, components);

  const std::vector<double> volumes = shell_volumes(joined, components.of_triangle, components.count);
  ShellNesting nesting(joined, components.of_triangle);

  std::vector<bool> sealed(parts.size(), false);
  for (int i = 0; i < components.count; ++i)
    sealed[i] = parts[i].closed && volumes[i] < 0 && winding_of_surroundings(nesting, joined, parts[i], i) > 0;
  if (std::find(sealed.begin(), sealed.end(), true) == sealed.end()) return mesh;
  // What floats inside a cavity does not meet the fluid either.
  std::vector<bool> dropped = sealed;
  Surroundings around;
  for (int i = 0; i < components.count; ++i) {
    if (sealed[i]) continue;
    nesting.around(joined.corner(parts[i].triangles.front(), 0), i, around);
    for (const auto& [other, winding] : around.shells)
      if (sealed[other] && winding < 0 && parts[other].box.contains(parts[i].box)) dropped[i] = true;
  }
  Mesh result;
  result.vertices = mesh.vertices;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (!dropped[components.of_triangle[t]]) result.triangles.push_back(mesh.triangles[t]);
  return result;
}

double waterline_for_volume(const Mesh& mesh, const Eigen::Vector3d& normal, double volume_mm3) {
  Hull hull(mesh);
  // Rounding must not turn "all of it" into "too much".
  if (!(volume_mm3 >= 0 && volume_mm3 <= hull.volume() * (1 + 1e-12)))
    throw Error(ErrorCode::goal,
                concat("The body would have to displace ", volume_mm3 / 1000, " cm3, but its hull holds only ",
                       hull.volume() / 1000, " cm3: it sinks. Use a lighter material or leave more of it hollow."));
  hull.set_up(normal);
  return normal.dot(hull.centre()) + hull.offset_for_volume(volume_mm3, std::numeric_limits<double>::quiet_NaN());
}

namespace {

constexpr double kLargestTurn = 0.1;     // rad: an energy barrier that a turn could jump would have to be narrower
constexpr double kNeutralArm = 1e-5;     // over the hull's diagonal: 1 micron on 100 mm
constexpr double kNeutralHeight = 1e-4;  // metacentric height over the diagonal

// Potential energy of the floating body over its weight, as a function of the direction of up, with its gradient and Hessian on the
// sphere of directions. theory.md (9).
struct Attitude {
  Eigen::Vector3d up;
  Frame frame;
  double offset = 0;         // of the waterplane, from the hull's centre
  double energy = 0;         // (c - b).n, mm
  Eigen::Vector2d gradient;  // horizontal part of c - b: the righting arm, mm
  Eigen::Matrix2d hessian;   // J / V - (c - b).n, mm per rad: the metacentric heights
  Eigen::Vector3d centre_of_flotation;
};

Attitude attitude(Hull& hull, double volume, const Eigen::Vector3d& centre_of_mass, const Eigen::Vector3d& up, double guess) {
  Attitude a;
  a.up = up;
  hull.set_up(up);
  a.frame = hull.frame();
  a.offset = hull.offset_for_volume(volume, guess);
  const Integrals sum = hull.integrals(a.offset);
  const Eigen::Vector3d b = sum.first / volume;
  a.energy = up.dot(centre_of_mass) - (a.offset + b.z());
  a.gradient = Eigen::Vector2d(a.frame.u.dot(centre_of_mass), a.frame.v.dot(centre_of_mass)) - b.head<2>();
  a.hessian = central_second_moments(sum) / volume - a.energy * Eigen::Matrix2d::Identity();
  const Eigen::Vector2d f = sum.area > 0 ? Eigen::Vector2d(sum.area_first / sum.area) : Eigen::Vector2d(b.head<2>());
  a.centre_of_flotation = a.frame.u * f.x() + a.frame.v * f.y() + a.frame.n * a.offset;
  return a;
}

// The tilts about the two principal axes of the energy's Hessian, as far as they matter: along a neutral axis (a sphere, a log
// about its length) the moment left is that of the facets, and the body stays as it is.
struct Tilts {
  Eigen::Matrix2d axes;
  Eigen::Vector2d gradient;
  Eigen::Vector2d stiffness;
  bool neutral[2] = {false, false};
};

Tilts tilts(const Attitude& a, double diagonal) {
  const SymmetricEigen eigen = symmetric_eigen(a.hessian);
  Tilts t;
  t.axes = eigen.vectors;
  t.gradient = t.axes.transpose() * a.gradient;
  t.stiffness = eigen.values;
  for (int k = 0; k < 2; ++k) {
    t.neutral[k] = std::abs(t.gradient[k]) <= kNeutralArm * diagonal && std::abs(t.stiffness[k]) <= kNeutralHeight * diagonal;
    if (t.neutral[k]) t.gradient[k] = 0;
  }
  return t;
}

// Minimises g.d + d.H d / 2 over |d| <= radius, along the axes that are not neutral. Between Newton's step (radius large) and
// steepest descent (radius small), it is a linearly implicit step along the path of the righting moment. Where the moment vanishes
// on a maximum or a saddle of the energy, it steps off along the direction of strongest tipping. Zero at a minimum.
Eigen::Vector2d restricted_step(const Tilts& tilts, double radius, bool* restricted) {
  const auto step = [&](double shift) {
    Eigen::Vector2d d;
    for (int k = 0; k < 2; ++k) d[k] = tilts.gradient[k] == 0 ? 0 : -tilts.gradient[k] / (tilts.stiffness[k] + shift);
    return d;
  };
  int softest = -1;  // the smallest stiffness comes first
  for (int k = 1; k >= 0; --k)
    if (!tilts.neutral[k]) softest = k;
  *restricted = false;
  if (softest < 0) return Eigen::Vector2d::Zero();
  const double least = tilts.stiffness[softest];
  if (least > 0 && step(0).norm() <= radius) return tilts.axes * step(0);

  *restricted = true;
  // |step(shift)| falls to radius or below before hi, and beyond -least it falls steadily.
  double lo = std::max(0., -least);
  double hi = lo + tilts.gradient.norm() / radius;
  for (int i = 0; i < 100; ++i) {
    const double middle = (lo + hi) / 2;
    if (middle == lo || middle == hi) break;
    (step(middle).norm() > radius ? lo : hi) = middle;
  }
  Eigen::Vector2d d = step(hi);
  if (!d.allFinite()) d.setZero();
  if (least < 0) {  // a negative curvature is followed to the full radius
    const double other = d[1 - softest];
    const double left = std::sqrt(std::max(0., radius * radius - other * other));
    if (std::abs(d[softest]) < left) d[softest] = std::copysign(left, d[softest]);
  }
  return tilts.axes * d;
}

}  // namespace

FloatingRest floating_rest(const Mesh& mesh, double mass_g, const Eigen::Vector3d& centre_of_mass_mm, const Eigen::Vector3d& up,
                           const FloatingRestOptions& options) {
  Hull hull(mesh);
  FloatingRest rest;
  rest.up = up.normalized();
  rest.plane.normal = rest.up;
  const double volume = mass_g / (options.fluid_g_cm3 * 1e-3);
  if (!(mass_g > 0) || !(options.fluid_g_cm3 > 0) || !(hull.volume() > 0) || !rest.up.allFinite() || !centre_of_mass_mm.allFinite())
    throw Error(ErrorCode::input,
                concat("A body of ", mass_g, " g with a hull of ", hull.volume(), " mm3 cannot be floated in a fluid of ",
                       options.fluid_g_cm3, " g/cm3: all three must be positive, and its centre of mass and its attitude finite."));
  if (volume > hull.volume()) {
    rest.sinks = true;
    return rest;
  }

  const Eigen::Vector3d centre_of_mass = centre_of_mass_mm - hull.centre();
  Attitude now = attitude(hull, volume, centre_of_mass, rest.up, std::numeric_limits<double>::quiet_NaN());
  double radius = kLargestTurn;
  for (int turns = 0; turns < options.max_turns && !rest.converged; ++turns) {
    bool restricted = false;
    const Eigen::Vector2d d = restricted_step(tilts(now, hull.diagonal()), radius, &restricted);
    const double angle = d.norm();
    rest.converged = angle <= options.tolerance_rad;
    if (angle == 0) break;
    const Eigen::Vector3d direction = (now.frame.u * d.x() + now.frame.v * d.y()) / angle;
    const Eigen::Vector3d next_up = (std::cos(angle) * now.up + std::sin(angle) * direction).normalized();
    const Attitude next = attitude(hull, volume, centre_of_mass, next_up, next_up.dot(now.centre_of_flotation));

    // Of two energies that differ by rounding only, none is taken for an improvement: the turns shrink and end there.
    const double predicted = -(now.gradient.dot(d) + d.dot(now.hessian * d) / 2);
    const double agreement = (now.energy - next.energy) / predicted;
    if (agreement > 0.1) {
      now = next;
      if (agreement > 0.75 && restricted) radius = std::min(2 * radius, kLargestTurn);
    } else {
      radius = angle / 4;
    }
  }
  rest.up = now.up;
  rest.plane = {now.up, now.offset + now.up.dot(hull.centre())};
  rest.residual_mm = now.gradient.norm();
  return rest;
}

}  // namespace rayrep
