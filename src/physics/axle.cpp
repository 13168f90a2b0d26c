#include "rayrep/physics/axle.h"

#include <algorithm>

#include "mesh/prism.h"
#include "rayrep/physics/moments.h"

namespace rayrep {
namespace {

constexpr double kSteel_g_cm3 = 7.85;
constexpr double kClearance_mm = 0.1;
constexpr double kPlay_mm = 0.01;  ///< between faces that touch

/// A deep-groove ball bearing 608, ISO 15; its mass, with the air in it, from data sheets.
constexpr double kBearingAcross_mm = 22;
constexpr double kBearingWidth_mm = 7;
constexpr double kBearing_g = 12;

double rod_diameter_mm(Axle::Kind kind) { return kind == Axle::Kind::m4 ? 4 : 8; }

/// The bearing between two coaxial prisms: a ring, closed at its ends.
Mesh ring(Prism outer, double hole_radius_mm) {
  Mesh mesh = surface_of(outer);
  outer.radius_mm = hole_radius_mm;
  Mesh hole = surface_of(outer);
  const int n = outer.sides;
  mesh.triangles.resize(2 * static_cast<std::size_t>(n));
  hole.triangles.resize(2 * static_cast<std::size_t>(n));
  flip(hole);
  append(mesh, hole);
  for (int k = 0; k < n; ++k) {
    const int next = (k + 1) % n;
    mesh.triangles.emplace_back(k, 2 * n + k, 2 * n + next);
    mesh.triangles.emplace_back(k, 2 * n + next, next);
    mesh.triangles.emplace_back(n + k, 3 * n + next, 3 * n + k);
    mesh.triangles.emplace_back(n + k, n + next, 3 * n + next);
  }
  return mesh;
}

}  // namespace

bool has_axle(const Axle& axle) { return axle.kind != Axle::Kind::none; }

const char* words_of(Axle::Kind kind) {
  switch (kind) {
    case Axle::Kind::none:
      return "no axle";
    case Axle::Kind::m4:
      return "an M4 rod";
    case Axle::Kind::rod_8mm:
      return "an 8 mm rod";
    case Axle::Kind::bearing_608:
      break;
  }
  return "an 8 mm rod in a 608 bearing";
}

AxleFit fit(const Axle& axle, const Eigen::Vector3d& centre_mm, const Eigen::Vector3d& axis, double reach_mm) {
  AxleFit fitted;
  const bool has_bearing = axle.kind == Axle::Kind::bearing_608;
  const double d = rod_diameter_mm(axle.kind);
  const double between = has_bearing ? std::max(axle.gap_mm, kBearingWidth_mm) : axle.gap_mm;  // of where the holes begin
  const auto prism = [&](double radius, double length, Prism::Fit how) {
    return Prism{centre_mm, axis, radius, -0.5 * length, 0.5 * length, 96, how};
  };
  fitted.rod_diameter_mm = fitted.across_mm = d;
  fitted.rod_length_mm = between + 4 * d;
  fitted.steel.push_back({.mesh = surface_of(prism(0.5 * d, fitted.rod_length_mm, Prism::Fit::same_area)),
                          .role = Part::Role::insert,
                          .density_g_cm3 = kSteel_g_cm3});
  fitted.bore = surface_of(prism(0.5 * d + kClearance_mm, fitted.rod_length_mm + 2 * kPlay_mm, Prism::Fit::around));
  Prism slab = prism(reach_mm, axle.gap_mm, Prism::Fit::around);
  slab.sides = 4;
  fitted.taken = {surface_of(slab), fitted.bore};
  if (!has_bearing) return fitted;
  fitted.across_mm = kBearingAcross_mm;
  Mesh bearing = ring(prism(0.5 * kBearingAcross_mm, kBearingWidth_mm, Prism::Fit::same_area), 0.5 * d + kPlay_mm);
  const double density = 1000 * kBearing_g / mesh_moments(bearing)[M1];
  fitted.steel.push_back({.mesh = std::move(bearing), .role = Part::Role::insert, .density_g_cm3 = density});
  fitted.taken.push_back(
      surface_of(prism(0.5 * kBearingAcross_mm + kClearance_mm, kBearingWidth_mm + 2 * kPlay_mm, Prism::Fit::around)));
  return fitted;
}

}  // namespace rayrep
