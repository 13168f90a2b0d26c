#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>

#include "base/text.h"
#include "judge/figures.h"
#include "judge/verify_detail.h"
#include "rayrep/base/error.h"
#include "rayrep/judge/verify.h"

namespace rayrep {
namespace {

using namespace verify_detail;

/// @param mesh  what touches the ground
StandState state_of(const Mesh& mesh, const MassProperties& mass, const StandSpec& spec) {
  StandState state;
  state.body = mass;
  state.to_ground = up_to_z(spec.up);
  const Mesh standing = transformed(mesh, Eigen::Affine3d(state.to_ground));
  const double height_mm = bounding_box(standing).sizes().z();
  state.contact_tolerance_mm = spec.contact_tolerance_mm.value_or(contact_tolerance_mm(height_mm));
  state.polygon = support_polygon(standing, state.contact_tolerance_mm);

  const Eigen::Vector3d centre = state.to_ground * state.body.centre_of_mass_mm;
  state.centre_mm = centre.head<2>();
  state.height_mm = centre.z() - state.polygon.ground_mm;
  state.tipping_angles_rad = tipping_angles_rad(state.polygon, centre);
  state.smallest_tipping_angle_rad = *std::min_element(state.tipping_angles_rad.begin(), state.tipping_angles_rad.end());
  if (spec.target_mm) state.target_offset_mm = (state.centre_mm - (state.to_ground * *spec.target_mm).head<2>()).norm();
  return state;
}

Figures figures_of(const StandState& state, const StandSpec& spec) {
  Figures figures = body_figures(state.body, "mass");
  const auto add = [&figures](Figure figure) { figures.push_back(std::move(figure)); };
  std::vector<std::vector<double>> corners;
  for (const Eigen::Vector2d& corner : state.polygon.corners_mm) corners.push_back(list(corner));
  add({.name = "support_polygon_mm", .words = "", .unit = Unit::mm, .value = corners});
  add({.name = "support_area_mm2", .words = "", .unit = Unit::mm2, .value = state.polygon.area_mm2});
  add({.name = "centre_in_plan_mm", .words = "", .unit = Unit::mm, .value = list(state.centre_mm)});
  add({.name = "target_offset_mm",
       .words = spec.target_mm ? "centre of mass beside the target" : "",
       .unit = Unit::mm,
       .value = state.target_offset_mm,
       .digits = 5});
  add({.name = "height_mm", .words = "centre of mass above the ground", .unit = Unit::mm, .value = state.height_mm});
  add({.name = "smallest_tipping_angle_rad",
       .words = "smallest tipping angle",
       .unit = Unit::rad,
       .value = state.smallest_tipping_angle_rad});
  add({.name = "tipping_angles_rad", .words = "  over edge", .unit = Unit::rad, .value = state.tipping_angles_rad});
  return figures;
}

/// What it does, and what the print's scatter changes. More plastic, the same everywhere, changes nothing but its mass.
void say(StandVerdict& verdict, double diagonal_mm) {
  const StandState& state = verdict.state;
  verdict.scatter_mm = print_scatter_mm(diagonal_mm);
  const std::vector<double> distances = state.polygon.edge_distances_mm(state.centre_mm);
  verdict.scattered_tipping_angle_rad =
      std::atan2(*std::min_element(distances.begin(), distances.end()) - verdict.scatter_mm, state.height_mm);
  if (state.polygon.corners_mm.size() < 3 || !(state.smallest_tipping_angle_rad > 0)) {
    verdict.meaning.push_back("It does not stand: it falls over.");
    return;
  }
  verdict.meaning.push_back("It stands, and tips over where the ground slopes by more than " +
                            degrees(state.smallest_tipping_angle_rad, 1) + " towards the nearest edge of its foot.");
  const std::string off =
      "With its centre of mass " + scatter_words(verdict.scatter_mm) + " nearer to the edge, as prints scatter, ";
  if (verdict.scattered_tipping_angle_rad > 0)
    verdict.meaning.push_back(off + "it tips over at " + degrees(verdict.scattered_tipping_angle_rad, 1) + ".");
  else
    verdict.notes.push_back(off + "it tips over by itself: it stands on the computer only.");
}

void describe(StandVerdict& verdict) {
  const StandSpec& spec = verdict.spec;
  const SupportPolygon& polygon = verdict.state.polygon;
  verdict.goal = StandSpec::kGoal;
  verdict.body = verdict.state.body;
  put_first(figures_of(verdict.state, spec), verdict.figures);
  verdict.figures.push_back({.name = "scatter_mm", .words = "", .unit = Unit::mm, .value = verdict.scatter_mm});
  verdict.figures.push_back(
      {.name = "scattered_tipping_angle_rad", .words = "", .unit = Unit::rad, .value = verdict.scattered_tipping_angle_rad});
  if (spec.target_mm) verdict.headline = "target " + place_words(*spec.target_mm) + ", ";
  verdict.headline += "support of " + std::to_string(polygon.corners_mm.size()) + " corners and " + number(polygon.area_mm2, 1) +
                      " mm2 within " + number(verdict.state.contact_tolerance_mm, 3) + " mm of the lowest point, " +
                      print_words(spec.print);
  verdict.wanted = {{.name = "up", .words = "", .value = list(spec.up)},
                    {.name = "target_mm", .words = "", .unit = Unit::mm, .value = value_or_none(spec.target_mm)},
                    {.name = "contact_tolerance_mm", .words = "", .unit = Unit::mm, .value = verdict.state.contact_tolerance_mm}};
  add_print(spec.print, verdict.wanted);
}

/// The criteria of standing itself, and what they come to.
void conclude(StandVerdict& verdict, double diagonal_mm, const Limits& limits) {
  const StandSpec& spec = verdict.spec;
  const StandState& state = verdict.state;
  const std::size_t corners = state.polygon.corners_mm.size();
  auto& criteria = verdict.criteria;
  criteria.push_back(at_least("supported", "corners of the support polygon", static_cast<double>(corners), 3));
  criteria.push_back(at_least("inside", "smallest tipping angle, rad", state.smallest_tipping_angle_rad, limits.tipping_angle_rad));
  if (spec.target_mm)
    criteria.push_back(at_most("offset", "horizontal distance of the centre of mass from the target, over the diagonal",
                               state.target_offset_mm / diagonal_mm, limits.offset_over_diagonal));
  if (spec.most_mass_g)
    criteria.push_back(
        at_most("most_mass", "mass over the largest that is allowed", state.body.mass_g / *spec.most_mass_g, 1 + limits.relative));
  if (corners < 3)
    verdict.notes.push_back(std::string("The body touches the ground only in ") + (corners == 1 ? "a point" : "an edge") +
                            ": it cannot stand there, wherever its centre of mass lies.");
  say(verdict, diagonal_mm);
  describe(verdict);
}

}  // namespace

StandState stand_state_of(const Mesh& mesh, const StandSpec& spec, const Progress& progress) {
  check(spec, Setting::For::judging);
  const Mesh merged = merged_mesh(mesh);
  const Mesh material = material_of(merged, unbalanced_edges(merged) == 0, progress);
  return state_of(material, mass_properties(material, spec.print.density_g_cm3), spec);
}

StandVerdict verify(const Mesh& delivered, const Mesh* original, const StandSpec& spec, const Limits& limits,
                    const Progress& progress) {
  check(spec, Setting::For::judging);
  StandVerdict verdict;
  verdict.spec = spec;
  const AllowedOutside outside(delivered, original, spec, progress);
  const Surface surface = judge_surface(delivered, outside.mesh(), progress, verdict);
  verdict.state = state_of(surface.material, mass_properties(surface.material, spec.print.density_g_cm3), spec);
  add_surface_criteria(surface, {original != nullptr, spec.print, spec.up, limits.wall_ratio}, progress, verdict);
  outside.tell(verdict);
  conclude(verdict, surface.diagonal_mm, limits);
  return verdict;
}

StandVerdict verify_detail::judge_print(const PrintInHull& print, const StandSpec& spec, const Limits& limits, const Progress&) {
  StandVerdict verdict;
  verdict.spec = spec;
  verdict.state = state_of(print.hull, mass_properties(print.s, spec.print.density_g_cm3), spec);
  conclude(verdict, print.diagonal_mm, limits);
  return verdict;
}

Figures state_figures(const Mesh& mesh, const StandSpec& spec, const Limits&, const Progress& progress) {
  return figures_of(stand_state_of(mesh, spec, progress), spec);
}

}  // namespace rayrep
