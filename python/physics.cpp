#include <pybind11/stl.h>

#include <cmath>

#include "bindings.h"

namespace py = pybind11;

namespace rayrep::python {
namespace {

/// Closed, corners joined. @throws Error{input}
Mesh solid_of(const Body& body) {
  return require_solid(body.mesh, body.name.empty() ? "The mesh" : body.name, {.self_intersections = false, .first_aid = false})
      .mesh;
}

/// What water and ground touch, each point of it once.
Mesh hull_of(const Body& body) { return boundary_of_union(outer_hull(solid_of(body))); }

/// Each part of the material once.
MassProperties mass_of(const Body& body, double density_g_cm3) {
  return mass_properties(boundary_of_union(solid_of(body)), density_g_cm3);
}

Eigen::Vector3d vector_of(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

/// A unit vector. @throws Error{usage}
Eigen::Vector3d direction_of(const std::array<double, 3>& v) {
  const Eigen::Vector3d direction = vector_of(v);
  if (!direction.allFinite() || !(direction.norm() > 0))
    throw Error(ErrorCode::usage, "A direction must be three finite numbers that are not all 0.");
  return direction.normalized();
}

Eigen::Vector3d centre_of(const Body& body, const std::optional<std::array<double, 3>>& centre) {
  if (centre && !vector_of(*centre).allFinite()) throw Error(ErrorCode::usage, "center_mass must be three finite numbers.");
  return centre ? vector_of(*centre) : mass_of(body, 1).centre_of_mass_mm;
}

double positive(const char* name, double value) {
  if (!(value > 0) || !std::isfinite(value))
    throw Error(ErrorCode::usage, std::string(name) + " must be a positive number; it is " + std::to_string(value) + ".");
  return value;
}

double lowest(const Mesh& mesh, const Eigen::Vector3d& up) {
  double least = std::numeric_limits<double>::infinity();
  for (const auto& v : mesh.vertices) least = std::min(least, v.dot(up));
  return least;
}

using Point = std::array<double, 3>;
using SomePoint = std::optional<Point>;

py::dict bind_hydrostatics(const Body& body, double fluid_g_cm3, const Point& up_given, const std::optional<double>& waterline_mm,
                           const std::optional<double>& mass_g) {
  const Eigen::Vector3d up = direction_of(up_given);
  positive("fluid", fluid_g_cm3);
  Hydrostatics water;
  Waterplane plane{up, 0};
  double bottom = 0;
  {
    const py::gil_scoped_release release;
    const PreparedHull hull(hull_of(body));
    bottom = lowest(hull.mesh(), up);
    plane.offset_mm = waterline_mm ? bottom + *waterline_mm
                                   : waterline_for_volume(hull, up, 1e3 * positive("mass", mass_g.value_or(0)) / fluid_g_cm3);
    water = hydrostatics(hull, plane);
  }
  py::dict found;
  found["waterline"] = plane.offset_mm - bottom;
  found["displaced_volume"] = water.displaced_volume_mm3;
  found["displaced_mass"] = 1e-3 * fluid_g_cm3 * water.displaced_volume_mm3;
  found["center_buoyancy"] = array_of(water.centre_of_buoyancy_mm);
  found["waterplane_area"] = water.waterplane_area_mm2;
  found["center_flotation"] = array_of(water.centre_of_flotation_mm);
  found["second_moments"] = std::pair(water.smallest_second_moment_mm4, water.largest_second_moment_mm4);
  found["metacentric_radius"] = water.metacentric_radius_mm();
  found["metacentre"] = array_of(water.metacentre_mm(plane));
  found["dry_interior"] = water.dry_interior_mm3;
  found["freeboard"] = water.freeboard_mm;
  return found;
}

py::dict bind_floating_rest(const Body& body, double mass_g, const SomePoint& centre, const Point& up, double fluid_g_cm3) {
  FloatingRest rest;
  double bottom = 0;
  {
    const py::gil_scoped_release release;
    const PreparedHull hull(hull_of(body));
    rest = floating_rest(hull, mass_g, centre_of(body, centre), direction_of(up), {.fluid_g_cm3 = fluid_g_cm3});
    bottom = lowest(hull.mesh(), rest.up);
  }
  constexpr const char* kOutcomes[] = {"rests", "sinks", "did_not_rest"};
  py::dict found;
  found["outcome"] = kOutcomes[static_cast<int>(rest.outcome)];
  found["up"] = array_of(rest.up);
  found["waterline"] = rest.sinks() ? py::object(py::none()) : py::float_(rest.plane.offset_mm - bottom);
  found["tilt"] = std::atan2(rest.up.cross(direction_of(up)).norm(), rest.up.dot(direction_of(up)));
  found["took_water"] = rest.took_water;
  return found;
}

py::dict bind_righting_curve(const Body& body, const FloatingBody& at, const SomePoint& lowered, int steps) {
  if (steps < 2 || steps > 3600) throw Error(ErrorCode::usage, "steps must lie between 2 and 3600.");
  RightingCurve curve;
  {
    const py::gil_scoped_release release;
    FloatingBody afloat = at;
    afloat.hull = PreparedHull(hull_of(body));
    const RightingOptions options{.steps = steps};
    curve = lowered ? righting_curve(afloat, direction_of(*lowered), options) : weakest_righting_curve(afloat, options);
  }
  constexpr const char* kEnds[] = {"turns_over", "takes_water", "none"};
  py::dict found;
  found["heel"] = array_of(curve.heel_rad);
  found["arm"] = array_of(curve.arm_mm);
  found["range"] = curve.range_rad;
  found["end"] = kEnds[static_cast<int>(curve.end)];
  found["area"] = curve.area_mm_rad;
  found["lowered"] = array_of(curve.lowered);
  return found;
}

py::array_t<double> ranges_of(const std::vector<SpeedRange>& ranges) {
  py::array_t<double> rows({static_cast<py::ssize_t>(ranges.size()), py::ssize_t{2}});
  for (std::size_t n = 0; n < ranges.size(); ++n) {
    rows.mutable_at(n, 0) = ranges[n].lo_rad_s;
    rows.mutable_at(n, 1) = ranges[n].hi_rad_s;
  }
  return rows;
}

py::dict bind_spin(const Body& body, double density_g_cm3, const Point& up_given, const SomePoint& contact, bool yoyo) {
  const Eigen::Vector3d up = direction_of(up_given);
  SpinState state;
  Eigen::Vector3d point;
  {
    const py::gil_scoped_release release;
    const MassProperties mass = mass_of(body, positive("density", density_g_cm3));
    point = contact ? vector_of(*contact) : yoyo ? mass.centre_of_mass_mm : contact_point(outer_hull(solid_of(body)), {}, up);
    state = spin_state(mass, point, up, yoyo);
  }
  py::dict found;
  found["contact"] = array_of(point);
  found["offset"] = state.offset_mm;
  found["height"] = state.height_mm;
  found["axis_angle"] = state.axis_angle_rad;
  found["axis_class"] = name_of(state.axis_class);
  found["ratio_larger"] = state.ratio_larger;
  found["ratio_smaller"] = state.ratio_smaller;
  found["sliding"] = ranges_of(state.sliding);
  found["fixed"] = ranges_of(state.fixed);
  return found;
}

py::dict bind_support(const Body& body, const SomePoint& centre_given, const Point& up, const std::optional<double>& tolerance_mm) {
  if (tolerance_mm && !(*tolerance_mm >= 0)) throw Error(ErrorCode::usage, "tolerance must not be negative.");
  const Eigen::Matrix3d to_ground = up_to_z(direction_of(up));
  SupportPolygon polygon;
  Eigen::Vector3d centre;
  double tolerance = 0;
  {
    const py::gil_scoped_release release;
    centre = to_ground * centre_of(body, centre_given);
    const Mesh standing = transformed(outer_hull(solid_of(body)), Eigen::Affine3d(to_ground));
    const Eigen::AlignedBox3d box = bounding_box(standing);
    tolerance = tolerance_mm ? *tolerance_mm : box.isEmpty() ? 0 : contact_tolerance_mm(box.sizes().z());
    polygon = support_polygon(standing, tolerance);
  }
  const auto in_mesh = [&](const Eigen::Vector2d& p) {
    return Eigen::Vector3d(to_ground.transpose() * Eigen::Vector3d(p.x(), p.y(), polygon.ground_mm));
  };
  std::vector<Eigen::Vector3d> corners;
  for (const auto& corner : polygon.corners_mm) corners.push_back(in_mesh(corner));
  py::dict found;
  found["corners"] = array_of(corners);
  found["area"] = polygon.area_mm2;
  found["safest_point"] = array_of(in_mesh(polygon.safest_point_mm()));
  found["tipping_angles"] = array_of(tipping_angles_rad(polygon, centre));
  found["height"] = centre.z() - polygon.ground_mm;
  found["tolerance"] = tolerance;
  return found;
}

py::list bind_resting_faces(const Body& body, const SomePoint& centre, double shake_rad) {
  if (!(shake_rad >= 0 && shake_rad < 1)) throw Error(ErrorCode::usage, "shake must lie between 0 and 1 rad.");
  std::vector<RestingFace> rests;
  {
    const py::gil_scoped_release release;
    rests = Tumbler(body.mesh, shake_rad).rests(centre_of(body, centre));
  }
  py::list found;
  for (const RestingFace& face : rests) {
    py::dict one;
    one["up"] = array_of(face.up);
    one["share"] = face.share;
    one["height"] = face.height_mm;
    one["holds"] = face.holds_rad;
    found.append(one);
  }
  return found;
}

FloatingBody afloat(const Body& body, double mass_g, const SomePoint& centre, const Point& up, double fluid_g_cm3) {
  return {Mesh{}, 1e3 * positive("mass", mass_g) / positive("fluid", fluid_g_cm3), centre_of(body, centre), direction_of(up)};
}

template <typename Materials>
py::dict densities_of(const Materials& materials) {
  py::dict densities;
  for (const auto& one : materials) densities[py::str(one.name)] = one.density_g_cm3;
  return densities;
}

}  // namespace

py::array_t<double> array_of(const Eigen::Vector3d& v) { return py::array_t<double>(3, v.data()); }

py::array_t<double> array_of(const Eigen::Matrix3d& m) {
  const Eigen::Matrix3d rows = m.transpose();  // numpy keeps rows, Eigen columns
  return py::array_t<double>({3, 3}, rows.data());
}

py::array_t<double> array_of(const std::vector<double>& values) {
  return py::array_t<double>(static_cast<py::ssize_t>(values.size()), values.data());
}

py::array_t<double> array_of(const std::vector<Eigen::Vector3d>& points) {
  return py::array_t<double>({static_cast<py::ssize_t>(points.size()), py::ssize_t{3}},
                             points.empty() ? nullptr : points.front().data());
}

py::dict mass_dict(const MassProperties& mass) {
  py::dict found;
  found["volume"] = mass.volume_mm3;
  found["mass"] = mass.mass_g;
  found["center_mass"] = array_of(mass.centre_of_mass_mm);
  found["moment_inertia"] = array_of(mass.inertia_g_mm2);
  found["principal_inertia_components"] = array_of(mass.principal_moments_g_mm2);
  found["principal_inertia_vectors"] = array_of(Eigen::Matrix3d(mass.principal_axes.transpose()));
  return found;
}

void bind_physics(py::module_& module) {
  module.def("moments", [](const Body& body) {
    const Moments s = mesh_moments(body.mesh);
    return py::array_t<double>(10, s.data());
  });
  module.def("mass_properties", [](const Body& body, double density_g_cm3) {
    MassProperties mass;
    {
      const py::gil_scoped_release release;
      mass = mass_of(body, positive("density", density_g_cm3));
    }
    return mass_dict(mass);
  });
  module.def("inertial", [](const Body& body, double density_g_cm3) {
    const MassProperties mass = mass_of(body, positive("density", density_g_cm3));
    return std::pair(urdf_inertial(mass), mjcf_inertial(mass));
  });
  module.def("hydrostatics", &bind_hydrostatics);
  module.def("floating_rest", &bind_floating_rest);
  module.def("righting_curve",
             [](const Body& body, const std::tuple<double, SomePoint, Point, double>& at, const SomePoint& lowered, int steps) {
               const auto& [mass_g, centre, up, fluid_g_cm3] = at;
               return bind_righting_curve(body, afloat(body, mass_g, centre, up, fluid_g_cm3), lowered, steps);
             });
  module.def("spin", &bind_spin);
  module.def("support_polygon", &bind_support);
  module.def("resting_faces", &bind_resting_faces);
  module.def("materials", [] { return densities_of(materials()); });
  module.def("core_materials", [] { return densities_of(core_materials()); });
  module.def("fluids", [] { return densities_of(fluids()); });
}

}  // namespace rayrep::python
