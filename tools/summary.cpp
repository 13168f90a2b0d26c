#include "summary.h"

#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <numbers>

namespace rayrep::tool {
namespace {

std::string format(const char* pattern, ...) __attribute__((format(printf, 1, 2)));

std::string format(const char* pattern, ...) {
  va_list arguments;
  va_start(arguments, pattern);
  char text[512];
  std::vsnprintf(text, sizeof text, pattern, arguments);
  va_end(arguments);
  return text;
}

double degrees(double rad) { return rad * 180 / std::numbers::pi; }

/// A value for people: few digits, and words for what has no number.
std::string value_text(const Criterion& c, double value) {
  if (!std::isfinite(value)) return "-";
  if (c.name == "settled_tilt") return format("%.3f deg", degrees(value));
  if (c.name == "wall" || c.name == "metacentric_height") return format("%.3f", value);
  if (value == std::round(value) && std::abs(value) < 1e6) return format("%.0f", value);
  return format("%.2e", value);
}

std::string input_text(const InputSummary& input) {
  std::string text = format("%s: %s, %.4g x %.4g x %.4g mm, %zu triangles, %zu component%s\n", input.path.c_str(),
                            input.format.c_str(), input.size_mm.x(), input.size_mm.y(), input.size_mm.z(), input.triangles,
                            input.check.components, input.check.components == 1 ? "" : "s");
  for (const std::string& note : input.notes) text += "  note: " + note + "\n";
  for (const std::string& note : input.check.notes) text += "  note: " + note + "\n";
  const double longest = input.size_mm.maxCoeff();
  if (input.check.usable && (longest < 1 || longest > 2000))
    text += format("  note: the longest side is %g mm; if that is not meant, see --unit and --size\n", longest);
  return text;
}

std::string settled(const FloatState& state) {
  if (state.settled_tilt_rad >= std::numbers::pi) return "sinks";
  return format("%.3f", degrees(state.settled_tilt_rad));
}

void row(std::string& text, const char* name, const std::string& before, const std::string& after) {
  text += format("  %-44s %14s %14s\n", name, before.c_str(), after.c_str());
}

void number_row(std::string& text, const char* name, const char* pattern, double before, double after) {
  char b[64];
  char a[64];
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
  std::snprintf(b, sizeof b, pattern, before);
  std::snprintf(a, sizeof a, pattern, after);
#pragma GCC diagnostic pop
  row(text, name, b, a);
}

}  // namespace

std::string summary(const FloatReport& report, bool verbose) {
  std::string text = input_text(report.input);
  const FloatState& before = report.before;
  const FloatState& after = report.after.state;
  const Eigen::Vector3d up = report.goal.up.normalized();
  text += format("waterline %.3f mm above the lowest point%s, fluid %g g/cm3, material %g g/cm3, wall %g mm\n\n",
                 report.goal.waterline_mm,
                 report.hollowed && report.result.waterline_searched ? " (found: the largest metacentric height)" : "",
                 report.goal.fluid_g_cm3, report.goal.density_g_cm3, report.goal.wall_mm);
  if (report.hollowed) {
    row(text, "", "before (solid)", "after");
    number_row(text, "mass, g", "%.3f", before.body.mass_g, after.body.mass_g);
    number_row(text, "displaced at the waterline, g", "%.3f", before.displaced_mass_g, after.displaced_mass_g);
    number_row(text, "centre of mass above centre of buoyancy, mm", "%.3f",
               up.dot(before.body.centre_of_mass_mm - before.water.centre_of_buoyancy_mm),
               up.dot(after.body.centre_of_mass_mm - after.water.centre_of_buoyancy_mm));
    number_row(text, "horizontal offset between the two, mm", "%.5f", before.horizontal_offset_mm, after.horizontal_offset_mm);
    number_row(text, "metacentric height, mm", "%.3f", before.metacentric_height_mm, after.metacentric_height_mm);
    row(text, "settles at a tilt of, degrees", settled(before), settled(after));
    text += "\n";
  } else {
    text += format("  mass %.3f g, displaced at the waterline %.3f g\n\n", after.body.mass_g, after.displaced_mass_g);
  }
  for (const Criterion& c : report.after.criteria)
    text +=
        format("  %-6s %-52s %12s  (%s %s)\n", c.pass() ? "ok" : "FAILED", c.description.c_str(), value_text(c, c.value).c_str(),
               c.kind == Criterion::Kind::at_most ? "at most" : "at least", value_text(c, c.limit).c_str());
  for (const std::string& note : report.after.notes) text += "  note: " + note + "\n";
  if (report.hollowed) {
    const HollowResult& hollow = report.result.hollow;
    if (hollow.cast.bad > 0)
      text += format("  note: %zu of %zu rays did not close and were left solid\n", hollow.cast.bad, hollow.cast.rays);
    if (hollow.filled_cavities > 0)
      text += format("  note: %zu cavities too small to print (%.2f mm3) were filled; the rest makes up for it\n",
                     hollow.filled_cavities, hollow.filled_mm3);
    text += format("\n%zu cavit%s; %s: %s, %ld variables, %d iterations in %d pass%s, gap to the proven optimum %.1e\n",
                   hollow.cavities, hollow.cavities == 1 ? "y" : "ies", hollow.solve.solver.c_str(),
                   hollow.solve.solver_status.c_str(), static_cast<long>(hollow.solve.variables), hollow.solver_iterations,
                   hollow.passes, hollow.passes == 1 ? "" : "es", hollow.duality_gap);
  }
  if (verbose) {
    text += "\n";
    for (const auto& [stage, seconds] : report.timings_s) text += format("  %-10s %8.3f s\n", stage.c_str(), seconds);
    text += format("  %-10s %8.1f MB\n", "memory", report.peak_memory_mb);
  }
  return text;
}

std::string summary(const InputSummary& input, double density_g_cm3, double area_mm2, const MassProperties* mass) {
  std::string text = input_text(input);
  const MeshReport& check = input.check;
  const auto defect = [&text](const char* name, const Defect& d) {
    if (d) text += format("  %-34s %9zu   first at (%g, %g, %g)\n", name, d.count, d.first_mm.x(), d.first_mm.y(), d.first_mm.z());
  };
  defect("coordinates that are not numbers", check.not_finite);
  defect("degenerate triangles (dropped)", check.degenerate);
  defect("duplicate triangles", check.duplicate);
  defect("open edges", check.open_edges);
  defect("non-manifold edges", check.non_manifold_edges);
  defect("mis-oriented edges", check.misoriented_edges);
  defect("edges where the surface is not closed", check.unbalanced_edges);
  defect("self-intersecting pairs", check.self_intersections);
  if (check.nested_components > 0)
    text += format("  components inside another: %zu, of which cavities: %zu\n", check.nested_components, check.cavities);
  if (!mass) return text;
  text += format("\n  volume               %14.7g cm3\n", mass->volume_mm3 / 1000);
  text += format("  surface area         %14.7g cm2\n", area_mm2 / 100);
  text += format("  mass                 %14.7g g          (density %g g/cm3)\n", mass->mass_g, density_g_cm3);
  const Eigen::Vector3d& c = mass->centre_of_mass_mm;
  text += format("  centre of mass       %14.7g %14.7g %14.7g mm\n", c.x(), c.y(), c.z());
  text += "  inertia tensor about the centre of mass, g mm2 (off-diagonals: negative products of inertia)\n";
  for (int n = 0; n < 3; ++n)
    text += format("                       %14.6g %14.6g %14.6g\n", mass->inertia_g_mm2(n, 0), mass->inertia_g_mm2(n, 1),
                   mass->inertia_g_mm2(n, 2));
  text += "  principal moments, g mm2, and axes\n";
  for (int n = 0; n < 3; ++n)
    text += format("  %20.6g  (%9.6f, %9.6f, %9.6f)\n", mass->principal_moments_g_mm2[n], mass->principal_axes(0, n),
                   mass->principal_axes(1, n), mass->principal_axes(2, n));
  return text;
}

}  // namespace rayrep::tool
