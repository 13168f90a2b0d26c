#include "rayrep/report/report.h"

#include <cmath>
#include <nlohmann/json.hpp>

namespace rayrep {
namespace {

using Json = nlohmann::ordered_json;

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json vector(const Eigen::Ref<const Eigen::VectorXd>& v) {
  Json array = Json::array();
  for (Eigen::Index n = 0; n < v.size(); ++n) array.push_back(number(v[n]));
  return array;
}

Json matrix(const Eigen::Matrix3d& m) {
  Json rows = Json::array();
  for (Eigen::Index n = 0; n < 3; ++n) rows.push_back(vector(m.row(n).transpose()));
  return rows;
}

Json defect(const Defect& d) {
  Json json = {{"count", d.count}};
  if (d) json["first_mm"] = vector(d.first_mm);
  return json;
}

Json input_json(const InputSummary& input) {
  const MeshReport& check = input.check;
  Json json = {
      {"path", input.path},
      {"format", input.format},
      {"mm_per_unit", input.mm_per_unit},
      {"scale", input.scale},
      {"size_mm", vector(input.size_mm)},
      {"vertices", input.vertices},
      {"triangles", input.triangles},
      {"components", check.components},
      {"nested_components", check.nested_components},
      {"cavities", check.cavities},
      {"vertices_merged", check.vertices_merged},
      {"components_turned", check.components_turned},
      {"triangles_turned", check.triangles_turned},
      {"usable", check.usable},
      {"defects",
       {{"not_finite", defect(check.not_finite)},
        {"degenerate", defect(check.degenerate)},
        {"duplicate", defect(check.duplicate)},
        {"open_edges", defect(check.open_edges)},
        {"non_manifold_edges", defect(check.non_manifold_edges)},
        {"misoriented_edges", defect(check.misoriented_edges)},
        {"unbalanced_edges", defect(check.unbalanced_edges)},
        {"self_intersections", defect(check.self_intersections)}}},
  };
  if (!check.usable) json["refusal"] = check.refusal;
  Json notes = Json::array();
  for (const std::string& note : input.notes) notes.push_back(note);
  for (const std::string& note : check.notes) notes.push_back(note);
  json["notes"] = notes;
  return json;
}

Json mass_json(const MassProperties& mass) {
  return {
      {"volume_mm3", number(mass.volume_mm3)},
      {"mass_g", number(mass.mass_g)},
      {"centre_of_mass_mm", vector(mass.centre_of_mass_mm)},
      {"inertia_g_mm2", matrix(mass.inertia_g_mm2)},
      {"principal_moments_g_mm2", vector(mass.principal_moments_g_mm2)},
      {"principal_axes", matrix(mass.principal_axes.transpose())},
  };
}

Json state_json(const FloatState& state) {
  Json json = mass_json(state.body);
  json["displaced_mass_g"] = number(state.displaced_mass_g);
  json["mass_error"] = number(state.mass_error);
  json["centre_of_buoyancy_mm"] = vector(state.water.centre_of_buoyancy_mm);
  json["waterplane_area_mm2"] = number(state.water.waterplane_area_mm2);
  json["waterplane_smallest_second_moment_mm4"] = number(state.water.smallest_second_moment_mm4);
  json["horizontal_offset_mm"] = number(state.horizontal_offset_mm);
  json["metacentric_height_mm"] = number(state.metacentric_height_mm);
  json["settled_tilt_rad"] = state.settled_tilt_rad < 3.14159 ? number(state.settled_tilt_rad) : Json(nullptr);  // null: it sinks
  return json;
}

std::string status_name(SolveStatus status) {
  switch (status) {
    case SolveStatus::not_run:
      return "not_run";
    case SolveStatus::converged:
      return "converged";
    case SolveStatus::infeasible:
      return "infeasible";
    case SolveStatus::iteration_limit:
      return "iteration_limit";
    case SolveStatus::failed:
      return "failed";
  }
  return "unknown";
}

double seconds_of(const RunReport& report, const std::string& stage) {
  for (const auto& [name, seconds] : report.timings_s)
    if (name == stage) return seconds;
  return 0;
}

/// The part of a report that comes before what is particular to a goal.
Json opening(const RunReport& report, const Verdict& verdict) {
  Json json;
  json["schema"] = 1;
  json["version"] = version();
  json["command"] = report.command;
  json["pass"] = verdict.pass();
  json["input"] = input_json(report.input);
  if (!report.output.empty()) json["output"] = {{"path", report.output}, {"triangles", report.delivered_triangles}};
  Json options = Json::object();
  for (const auto& [name, value] : report.options) options[name] = value;
  json["options"] = options;
  return json;
}

/// Adds what the judge found besides the state.
void add_shells(Json& after, const Verdict& verdict) {
  after["cavities"] = verdict.cavities;
  after["solid_islands"] = verdict.solid_islands;
  after["smallest_wall_mm"] = number(verdict.smallest_wall_mm);
}

/// Adds criteria, solver, timings; `hollow` may be null.
void close(Json& json, const RunReport& report, const Verdict& verdict, const HollowResult* hollow) {
  Json criteria = Json::array();
  for (const Criterion& c : verdict.criteria)
    criteria.push_back({{"name", c.name},
                        {"description", c.description},
                        {"value", number(c.value)},
                        {"limit", number(c.limit)},
                        {"kind", c.kind == Criterion::Kind::at_most ? "at_most" : "at_least"},
                        {"pass", c.pass()}});
  json["criteria"] = criteria;
  Json notes = Json::array();
  for (const std::string& note : verdict.notes) notes.push_back(note);
  json["notes"] = notes;
  if (hollow) {
    json["solver"] = {{"name", hollow->solve.solver},
                      {"status", status_name(hollow->solve.status)},
                      {"solver_status", hollow->solve.solver_status},
                      {"iterations", hollow->solver_iterations},
                      {"variables", hollow->solve.variables},
                      {"objective", number(hollow->solve.objective)},
                      {"constraint_violation", number(hollow->solve.constraint_violation)},
                      {"passes", hollow->passes},
                      {"as_built_error", number(hollow->as_built_error)},
                      {"seconds", seconds_of(report, "solve")}};
    json["model"] = {
        {"ray_spacing_mm", hollow->ray_spacing_mm},
        {"field_spacing_mm", hollow->field_spacing_mm},
        {"rays_cast", hollow->cast.rays},
        {"rays_recast", hollow->cast.recast},
        {"rays_bad", hollow->cast.bad},
        {"dropped_components", hollow->dropped_components},
        {"filled_cavities", hollow->filled_cavities},
        {"filled_mm3", hollow->filled_mm3},
        {"removed_islands", hollow->removed_islands},
        {"quadric", vector(hollow->q)},
        {"quadric_frame",
         {{"rotation", matrix(hollow->to_working.linear())}, {"translation_mm", vector(hollow->to_working.translation())}}}};
  }
  Json timings = Json::object();
  for (const auto& [stage, seconds] : report.timings_s) timings[stage] = seconds;
  json["timings_s"] = timings;
  json["peak_memory_mb"] = report.peak_memory_mb;
}

Json ranges_json(const std::vector<SpeedRange>& ranges) {
  Json array = Json::array();
  for (const SpeedRange& range : ranges)
    array.push_back({{"from_rpm", number(rpm(range.lo_rad_s))}, {"to_rpm", number(rpm(range.hi_rad_s))}});
  return array;
}

std::string class_name(AxisClass axis) {
  return axis == AxisClass::largest ? "largest" : axis == AxisClass::smallest ? "smallest" : "middle";
}

Json spin_json(const SpinState& state) {
  Json json = mass_json(state.body);
  json["offset_mm"] = number(state.offset_mm);
  json["height_mm"] = number(state.height_mm);
  json["axis_angle_rad"] = number(state.axis_angle_rad);
  json["axis_class"] = class_name(state.axis_class);
  json["ratio_to_larger_lateral"] = number(state.ratio_larger);
  json["ratio_to_smaller_lateral"] = number(state.ratio_smaller);
  json["stable_sliding"] = ranges_json(state.sliding);
  json["stable_fixed"] = ranges_json(state.fixed);
  return json;
}

Json stand_json(const StandState& state) {
  Json json = mass_json(state.body);
  Json corners = Json::array();
  for (const auto& corner : state.polygon.corners_mm) corners.push_back(vector(corner));
  json["support_polygon_mm"] = corners;
  json["support_area_mm2"] = number(state.polygon.area_mm2);
  json["centre_in_plan_mm"] = vector(state.centre_mm);
  json["height_mm"] = number(state.height_mm);
  Json angles = Json::array();
  for (const double angle : state.tipping_angles_rad) angles.push_back(number(angle));
  json["tipping_angles_rad"] = angles;
  json["smallest_tipping_angle_rad"] = number(state.smallest_tipping_angle_rad);
  json["target_offset_mm"] = number(state.target_offset_mm);
  return json;
}

/// By name.
Json inertial_json(const InertialTargets& wanted) {
  Json json = Json::object();
  for (int k = M1; k <= MXZ; ++k)
    if (const auto& value = wanted[static_cast<std::size_t>(k)]) json[inertial_name(static_cast<MomentIndex>(k))] = number(*value);
  return json;
}

Json target_json(const TargetState& state) {
  Json json = mass_json(state.body);
  Json deviations = Json::object();
  for (const InertialDeviation& d : state.deviations) deviations[inertial_name(d.number)] = number(d.relative);
  json["deviations"] = deviations;
  return json;
}

}  // namespace

std::string to_json(const FloatReport& report) {
  Json json = opening(report, report.after);
  json["goal"] = {{"name", "float"},
                  {"up", vector(report.goal.up)},
                  {"waterline_mm", report.goal.waterline_mm},
                  {"waterline_searched", report.hollowed && report.result.waterline_searched},
                  {"fluid_g_cm3", report.goal.fluid_g_cm3},
                  {"density_g_cm3", report.goal.density_g_cm3},
                  {"wall_mm", report.goal.wall_mm}};
  json["before"] = state_json(report.before);
  json["after"] = state_json(report.after.state);
  add_shells(json["after"], report.after);
  close(json, report, report.after, report.hollowed ? &report.result.hollow : nullptr);
  if (report.hollowed) json["solver"]["duality_gap"] = number(report.result.hollow.duality_gap);
  return json.dump(2) + "\n";
}

std::string to_json(const SpinReport& report) {
  Json json = opening(report, report.after);
  json["goal"] = {{"name", report.goal.yoyo ? "yo-yo" : "spin"},
                  {"axis", vector(report.goal.axis)},
                  {report.goal.yoyo ? "centre_mm" : "contact_mm", vector(report.goal.contact_mm)},
                  {"prefer", class_name(report.goal.prefer)},
                  {"density_g_cm3", report.goal.density_g_cm3},
                  {"wall_mm", report.goal.wall_mm}};
  json["before"] = spin_json(report.before);
  json["after"] = spin_json(report.after.state);
  add_shells(json["after"], report.after);
  close(json, report, report.after, report.hollowed ? &report.result.hollow : nullptr);
  if (report.hollowed && report.result.certificate) {
    const SpinCertificate& certificate = *report.result.certificate;
    json["solver"]["certificate"] = {{"objective", number(certificate.best.objective)},
                                     {"lower_bound", number(certificate.lower_bound)},
                                     {"gap", number(certificate.gap)},
                                     {"closed", certificate.closed},
                                     {"nodes", certificate.nodes},
                                     {"evaluations", certificate.evaluations}};
  }
  return json.dump(2) + "\n";
}

std::string to_json(const StandReport& report) {
  Json json = opening(report, report.after);
  json["goal"] = {{"name", "stand"},
                  {"up", vector(report.goal.up)},
                  {"target_mm", report.goal.target_mm ? vector(*report.goal.target_mm) : Json(nullptr)},
                  {"density_g_cm3", report.goal.density_g_cm3},
                  {"wall_mm", report.goal.wall_mm}};
  json["before"] = stand_json(report.before);
  json["after"] = stand_json(report.after.state);
  add_shells(json["after"], report.after);
  close(json, report, report.after, report.hollowed ? &report.result.hollow : nullptr);
  if (report.hollowed) json["solver"]["duality_gap"] = number(report.result.hollow.duality_gap);
  return json.dump(2) + "\n";
}

std::string to_json(const TargetReport& report) {
  Json json = opening(report, report.after);
  json["goal"] = {{"name", "target"},
                  {"wanted", inertial_json(report.goal.wanted)},
                  {"density_g_cm3", report.goal.density_g_cm3},
                  {"wall_mm", report.goal.wall_mm}};
  json["before"] = target_json(report.before);
  json["after"] = target_json(report.after.state);
  add_shells(json["after"], report.after);
  const MassProperties& body = report.after.state.body;
  json["inertial"] =
      is_physical(body.inertia_g_mm2) ? Json{{"urdf", urdf_inertial(body)}, {"mjcf", mjcf_inertial(body)}} : Json(nullptr);
  close(json, report, report.after, report.hollowed ? &report.result.hollow : nullptr);
  if (report.hollowed) {
    const TargetResult& result = report.result;
    json["solver"]["duality_gap"] = number(result.hollow.duality_gap);
    json["solver"]["wall_mm"] = number(result.wall_mm);
    if (result.first)
      json["solver"]["first"] = {{"number", inertial_name(result.first->number)},
                                 {"sense", result.first->largest ? "largest" : "smallest"},
                                 {"value", number(result.first_found)},
                                 {"bound", number(result.first_bound)}};
  }
  return json.dump(2) + "\n";
}

std::string to_json(const InputSummary& input, double density_g_cm3, double area_mm2, const MassProperties* mass) {
  Json json;
  json["schema"] = 1;
  json["version"] = version();
  json["command"] = "inspect";
  json["input"] = input_json(input);
  json["density_g_cm3"] = density_g_cm3;
  json["area_mm2"] = number(area_mm2);
  json["mass_properties"] = mass ? mass_json(*mass) : Json(nullptr);
  return json.dump(2) + "\n";
}

std::string version() { return RAYREP_VERSION; }

}  // namespace rayrep
