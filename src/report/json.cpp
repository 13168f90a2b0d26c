#include <cmath>
#include <nlohmann/json.hpp>
#include <span>

#include "rayrep/report/balance_report.h"
#include "rayrep/report/report.h"

namespace rayrep {
namespace {

using Json = nlohmann::ordered_json;

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json vector(const Eigen::Ref<const Eigen::VectorXd>& v) {
  Json array = Json::array();
  for (Eigen::Index n = 0; n < v.size(); ++n) array.push_back(number(v[n]));
  return array;
}

/// Names of files need not be UTF-8, JSON has to be.
/// DEL and the control characters after ASCII, which JSON may hold as they are, are escaped too: a terminal obeys them.
std::string dumped(const Json& json) {
  const std::string text = json.dump(2, ' ', false, Json::error_handler_t::replace);
  std::string escaped;
  escaped.reserve(text.size() + 1);
  const auto escape = [&escaped](unsigned char c) {
    constexpr const char* kDigits = "0123456789abcdef";
    escaped += std::string("\\u00") + kDigits[c / 16] + kDigits[c % 16];
  };
  for (std::size_t n = 0; n < text.size(); ++n) {
    const auto c = static_cast<unsigned char>(text[n]);
    const auto next = static_cast<unsigned char>(n + 1 < text.size() ? text[n + 1] : '\0');
    if (c == 0x7F) {
      escape(c);
    } else if (c == 0xC2 && next >= 0x80 && next < 0xA0) {
      escape(next);
      ++n;
    } else {
      escaped += text[n];
    }
  }
  return escaped + "\n";
}

/// What every report begins with.
Json head(const std::string& command) { return {{"schema", 1}, {"version", version()}, {"command", command}}; }

Json matrix(const Eigen::Matrix3d& m) {
  Json rows = Json::array();
  for (Eigen::Index n = 0; n < 3; ++n) rows.push_back(vector(m.row(n).transpose()));
  return rows;
}

/// A figure's value, whatever it is.
struct Value {
  Json operator()(std::monostate) const { return nullptr; }
  Json operator()(double value) const { return number(value); }
  Json operator()(bool value) const { return value; }
  Json operator()(const std::string& text) const { return text; }
  Json operator()(const Record& record) const {
    Json json = Json::object();
    for (const auto& [name, value] : record) json[name] = std::visit(*this, value);
    return json;
  }
  template <typename T>
  Json operator()(const std::vector<T>& values) const {
    Json array = Json::array();
    for (const T& value : values) array.push_back((*this)(value));
    return array;
  }
};

void add(const Figures& figures, Json& json) {
  for (const Figure& figure : figures) json[figure.name] = std::visit(Value{}, figure.value);
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
  const FirstAidReport& aid = check.first_aid;
  json["first_aid"] = {{"corners_joined", aid.corners_joined},
                       {"joined_within", aid.joined_within},
                       {"sides_split", aid.sides_split},
                       {"sheets_dropped", aid.sheets_dropped},
                       {"triangles_dropped", aid.triangles_dropped},
                       {"holes_closed", aid.holes_closed},
                       {"triangles_added", aid.triangles_added},
                       {"surface_change", number(aid.surface_change)},
                       {"volume_change", number(aid.volume_change)},
                       {"repaired", aid.repaired},
                       {"bodies_united", aid.bodies_united}};
  if (!check.usable) {
    json["refusal"] = check.refusal;
    json["repairable"] = check.repairable;
  }
  Json notes = Json::array();
  for (const std::string& note : input.notes) notes.push_back(note);
  for (const std::string& note : check.notes) notes.push_back(note);
  json["notes"] = notes;
  if (input.body > 0) {
    json["body"] = input.body;
    json["bodies"] = input.bodies;
  }
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

Json print_json(const Measurement& measurement) {
  const Printed& printed = measurement.printed;
  Json features = Json::array();
  for (const PrintedFeature& feature : printed.features)
    features.push_back({{"name", feature.name},
                        {"of_body", feature.of_body},
                        {"beads", feature.beads},
                        {"volume_mm3", feature.s[M1]},
                        {"moments", vector(feature.s)}});
  Json json = {{"path", measurement.path},
               {"format", printed.format},
               {"slicer", printed.slicer},
               {"density_g_cm3", measurement.density_g_cm3},
               {"density_told", measurement.density_told},
               {"told_volume_mm3", printed.told_volume_mm3 ? Json(*printed.told_volume_mm3) : Json(nullptr)},
               {"laid_down_mm3", printed.volume_mm3()},
               {"features", features},
               {"mass_properties", mass_json(measurement.body)},
               {"notes", printed.notes}};
  if (const auto& placed = measurement.placed)
    json["placed"] = {{"mesh", measurement.mesh},
                      {"rotation", matrix(placed->to_mesh.linear())},
                      {"translation_mm", vector(placed->to_mesh.translation())},
                      {"layers", placed->layers},
                      {"area_error", number(placed->area_error)},
                      {"size_error_mm", number(placed->size_error_mm)},
                      {"centre_error_mm", number(placed->centre_error_mm)},
                      {"notes", placed->notes}};
  return json;
}

double seconds_of(const RunReport& report, const std::string& stage) {
  for (const auto& [name, seconds] : report.timings_s)
    if (name == stage) return seconds;
  return 0;
}

Json criteria_json(const Verdict& verdict) {
  Json criteria = Json::array();
  for (const Criterion& c : verdict.criteria)
    criteria.push_back({{"name", c.name},
                        {"description", c.description},
                        {"value", number(c.value)},
                        {"limit", number(c.limit)},
                        {"kind", c.kind == Criterion::Kind::at_most ? "at_most" : "at_least"},
                        {"pass", c.pass()}});
  return criteria;
}

void add_solver(const RunReport& report, Json& json) {
  const HollowResult& hollow = *report.hollow;
  json["solver"] = {{"name", hollow.solve.solver},
                    {"status", kSolveStatusNames[static_cast<std::size_t>(hollow.solve.status)]},
                    {"solver_status", hollow.solve.solver_status},
                    {"iterations", hollow.solver_iterations},
                    {"variables", hollow.solve.variables},
                    {"objective", number(hollow.solve.objective)},
                    {"constraint_violation", number(hollow.solve.constraint_violation)},
                    {"passes", hollow.passes},
                    {"as_built_error", number(hollow.as_built_error)},
                    {"seconds", seconds_of(report, "solve")}};
  add(hollow.proof_figures, json["solver"]);
  if (!hollow.slices.empty()) {
    json["slices"] = Json::array();
    for (const auto& slice : hollow.slices)
      json["slices"].push_back({{"excess", number(slice.excess)}, {"error", number(slice.error)}});
    json["delivered_slice"] = hollow.best_slice;
    json["waterline_of_print"] = hollow.gave_way;
  }
  json["model"] = {
      {"ray_spacing_mm", hollow.ray_spacing_mm},
      {"field_spacing_mm", hollow.field_spacing_mm},
      {"rays_cast", hollow.cast.rays},
      {"rays_bad", hollow.cast.bad},
      {"dropped_components", hollow.dropped_components},
      {"filled_cavities", hollow.filled_cavities},
      {"filled_mm3", hollow.filled_mm3},
      {"removed_islands", hollow.removed_islands},
      {"quadric", vector(hollow.q)},
      {"quadric_frame",
       {{"rotation", matrix(hollow.to_working.linear())}, {"translation_mm", vector(hollow.to_working.translation())}}}};
}

}  // namespace

std::string to_json(const RunReport& report) {
  const Verdict& verdict = report.after;
  Json json = head(report.command);
  json["pass"] = verdict.pass();
  json["input"] = input_json(report.input);
  if (report.print) json["print"] = print_json(*report.print);
  if (!report.output.empty()) json["output"] = {{"path", report.output}, {"triangles", report.delivered_triangles}};
  if (!report.changed.empty()) json["changed"] = report.changed;
  if (report.insert) json["insert"] = {{"path", report.insert->path}, {"mass_properties", mass_json(report.insert->mass)}};
  if (report.plugs)
    json["plugs"] = {{"path", report.plugs->path.empty() ? report.output : report.plugs->path}, {"pieces", report.plugs->pieces}};
  if (report.outside) {
    json["outside"] = {{"path", report.outside->path}, {"note", report.outside->note}};
    add(report.outside->changes, json["outside"]);
  }
  if (!report.dense_output.empty()) json["phases"] = {{"dense", report.dense_output}, {"sparse", report.sparse_output}};
  if (!report.piece_outputs.empty()) json["pieces"] = report.piece_outputs;
  if (!report.pauses_mm.empty()) json["pauses_mm"] = report.pauses_mm;
  if (report.hollow && !report.hollow->balls.empty()) {
    json["balls"] = Json::array();
    for (const Ball& ball : report.hollow->balls)
      json["balls"].push_back({{"centre_mm", vector(ball.centre_mm)}, {"pause_mm", ball.pause_mm}});
  }
  json["options"] = Json::object();
  for (const auto& [name, value] : report.options) json["options"][name] = value;
  json["goal"] = {{"name", verdict.goal}};
  add(verdict.wanted, json["goal"]);
  json["before"] = Json::object();
  add(report.hollow ? report.before : verdict.figures, json["before"]);
  json["after"] = Json::object();
  add(verdict.figures, json["after"]);
  json["after"]["cavities"] = verdict.cavities;
  json["after"]["solid_islands"] = verdict.solid_islands;
  json["after"]["trapped_resin_g"] = verdict.trapped_resin_g;
  json["after"]["crossing_triangles"] = verdict.crossing_triangles;
  json["after"]["outer_crossing_triangles"] = verdict.outer_crossing_triangles;
  json["after"]["smallest_wall_mm"] = number(verdict.smallest_wall_mm);
  json["inertial"] = is_physical(verdict.body.inertia_g_mm2)
                         ? Json{{"urdf", urdf_inertial(verdict.body)}, {"mjcf", mjcf_inertial(verdict.body)}}
                         : Json(nullptr);
  json["criteria"] = criteria_json(verdict);
  json["meaning"] = verdict.meaning;
  json["notes"] = verdict.notes;
  if (report.hollow) add_solver(report, json);
  json["timings_s"] = Json::object();
  for (const auto& [stage, seconds] : report.timings_s) json["timings_s"][stage] = seconds;
  json["peak_memory_mb"] = report.peak_memory_mb;
  return dumped(json);
}

std::string to_json(const Inspection& inspection) {
  Json json = head("inspect");
  json["input"] = input_json(inspection.input);
  json["density_g_cm3"] = inspection.density_g_cm3;
  json["area_mm2"] = number(inspection.area_mm2);
  json["mass_properties"] = inspection.mass ? mass_json(*inspection.mass) : Json(nullptr);
  return dumped(json);
}

std::string to_json(const Measurement& measurement) {
  Json json = head("measure");
  json["print"] = print_json(measurement);
  return dumped(json);
}

std::string version() { return RAYREP_VERSION; }

std::string to_json(const BalanceReport& report) {
  Json json = head("balance");
  json["scene"] = report.scene;
  json["pass"] = report.verdict.pass();
  json["mass_g"] = number(report.verdict.mass_g);
  json["parts"] = Json::array();
  std::size_t n = 0;
  for (const MechanismPart& part : report.mechanism.parts) {
    if (!part.printed) continue;
    const Verdict& verdict = report.verdict.parts[n];
    Json one = {{"name", part.name}, {"mass_g", number(verdict.body.mass_g)}, {"cavities", verdict.cavities}};
    if (n < report.outputs.size()) one["output"] = report.outputs[n];
    one["criteria"] = criteria_json(verdict);
    one["notes"] = verdict.notes;
    json["parts"].push_back(one);
    ++n;
  }
  json["states"] = Json::array();
  for (std::size_t k = 0; k < report.verdict.states.size(); ++k) {
    const PoseVerdict& verdict = report.verdict.states[k];
    Json figures = Json::object();
    add(verdict.figures, figures);
    json["states"].push_back({{"name", report.mechanism.states[k].name},
                              {"pass", verdict.pass()},
                              {"after", figures},
                              {"criteria", criteria_json(verdict)},
                              {"meaning", verdict.meaning},
                              {"notes", verdict.notes}});
  }
  if (report.made) {
    json["passes"] = report.made->passes;
    json["as_built_error"] = number(report.made->as_built_error);
    json["least_tip_rad"] = report.made->least_tip_rad ? number(*report.made->least_tip_rad) : Json(nullptr);
    json["tip_bound_rad"] = report.made->tip_bound_rad ? number(*report.made->tip_bound_rad) : Json(nullptr);
    json["proof"] = report.made->proof;
  }
  if (!report.outputs.empty()) json["output"] = report.outputs.back();
  return dumped(json);
}

}  // namespace rayrep
