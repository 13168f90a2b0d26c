#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "rayrep/mesh/mesh.h"
#include "rayrep/report/page_data.h"
#include "rayrep/report/scene_page.h"

// What the page is given is written down in tools/report/README.md.

namespace rayrep {
namespace {

using Json = nlohmann::ordered_json;

Json vector(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

/// All bodies in their places.
Mesh placed(const Mechanism& mechanism, const MechanismState& state) {
  Mesh all;
  for (std::size_t n = 0; n < mechanism.parts.size(); ++n) append(all, transformed(mechanism.parts[n].mesh, state.poses[n]));
  return all;
}

Json parts_of(const BalanceReport& report) {
  Json parts = Json::array();
  std::size_t judged = 0;
  for (std::size_t n = 0; n < report.mechanism.parts.size(); ++n) {
    if (!report.mechanism.parts[n].printed) continue;
    const Verdict& verdict = report.verdict.parts[judged++];
    parts.push_back({{"part", n},
                     {"mass_g", verdict.body.mass_g},
                     {"cavities", verdict.cavities},
                     {"pass", verdict.pass()},
                     {"criteria", Json::parse(page_json(verdict, report.mechanism.parts[n].mesh)).at("criteria")}});
  }
  return parts;
}

Json state_of(const BalanceReport& report, std::size_t k) {
  const MechanismState& state = report.mechanism.states[k];
  const PoseVerdict& verdict = report.verdict.states[k];
  const Json page = Json::parse(page_json(verdict, placed(report.mechanism, state)));
  Json told = {{"pass", verdict.pass()}, {"told", page.at("told")},   {"criteria", page.at("criteria")},
               {"notes", verdict.notes}, {"after", page.at("after")}, {"attitude", page.at("attitudes").at(0)},
               {"hinges", Json::array()}};
  for (const HingeBalance& hinge : state.hinges)
    told["hinges"].push_back({{"point_mm", vector(hinge.point_mm)}, {"axis", vector(hinge.axis)}, {"parts", hinge.parts}});
  return told;
}

}  // namespace

std::string balance_json(const Scene& scene, const BalanceReport& report) {
  Json json = {{"pass", report.verdict.pass()},   {"made", report.made.has_value()},
               {"mass_g", report.verdict.mass_g}, {"proof", report.made ? report.made->proof : std::vector<std::string>()},
               {"parts", parts_of(report)},       {"states", Json::array()}};
  std::size_t judged = 0;
  for (std::size_t n = 0; n < scene.states.size() && judged < report.verdict.states.size(); ++n) {
    if (!scene.states[n].rests) continue;
    Json state = state_of(report, judged++);
    state["state"] = n;
    json["states"].push_back(std::move(state));
  }
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace rayrep
