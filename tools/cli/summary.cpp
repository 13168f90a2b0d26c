#include "summary.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <numbers>

#include "options.h"

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

/// The figures of a body, beside those of the solid it was made from when there is one.
class Table {
public:
  explicit Table(bool with_before) : with_before_(with_before) {
    if (with_before_) row("", "before (solid)", "after");
  }

  void row(const char* name, const std::string& before, const std::string& after) {
    text_ += with_before_ ? format("  %-44s %14s %14s\n", name, before.c_str(), after.c_str())
                          : format("  %-44s %14s\n", name, after.c_str());
  }

  void row(const char* name, int decimals, double before, double after) {
    row(name, format("%.*f", decimals, before), format("%.*f", decimals, after));
  }

  const std::string& text() const { return text_; }

private:
  bool with_before_;
  std::string text_;
};

/// Verdict per criterion, notes, solver, and with `verbose` the timings.
std::string closing(const RunReport& report, const Verdict& verdict, const HollowResult* hollow, bool verbose) {
  std::string text;
  for (const Criterion& c : verdict.criteria)
    text +=
        format("  %-6s %-58s %12s  (%s %s)\n", c.pass() ? "ok" : "FAILED", c.description.c_str(), value_text(c, c.value).c_str(),
               c.kind == Criterion::Kind::at_most ? "at most" : "at least", value_text(c, c.limit).c_str());
  for (const std::string& note : verdict.notes) text += "  note: " + note + "\n";
  if (hollow) {
    if (hollow->cast.bad > 0)
      text += format("  note: %zu of %zu rays did not close and were left solid\n", hollow->cast.bad, hollow->cast.rays);
    if (hollow->filled_cavities > 0)
      text += format("  note: cavities too small to print, %zu with %.2g mm3 in all, were filled; the rest makes up for it\n",
                     hollow->filled_cavities, hollow->filled_mm3);
    text += format("\n%zu cavit%s; %s: %s, %ld variables, %d iterations in %d pass%s\n", hollow->cavities,
                   hollow->cavities == 1 ? "y" : "ies", hollow->solve.solver.c_str(), hollow->solve.solver_status.c_str(),
                   static_cast<long>(hollow->solve.variables), hollow->solver_iterations, hollow->passes,
                   hollow->passes == 1 ? "" : "es");
  }
  if (verbose) {
    text += "\n";
    for (const auto& [stage, seconds] : report.timings_s) text += format("  %-10s %8.3f s\n", stage.c_str(), seconds);
    text += format("  %-10s %8.1f MB\n", "memory", report.peak_memory_mb);
  }
  return text;
}

/// "387 to 412, above 498 rpm"
/// Stable speeds. Ends too near to be told apart in the text count as one: a gap or range of a fraction of a turn is of no use.
std::string speeds(const std::vector<SpeedRange>& all) {
  std::vector<SpeedRange> ranges;
  for (const SpeedRange& range : all) {
    if (!ranges.empty() && rpm(range.lo_rad_s) - rpm(ranges.back().hi_rad_s) < 1)
      ranges.back().hi_rad_s = range.hi_rad_s;
    else
      ranges.push_back(range);
  }
  std::erase_if(ranges, [](const SpeedRange& range) { return rpm(range.hi_rad_s) - rpm(range.lo_rad_s) < 1; });
  std::string text;
  for (const SpeedRange& range : ranges) {
    text += text.empty() ? "" : ", ";
    if (!std::isfinite(range.hi_rad_s))
      text += range.lo_rad_s > 0 ? format("above %.0f", rpm(range.lo_rad_s)) : "any speed";
    else
      text += format("%.0f to %.0f", rpm(range.lo_rad_s), rpm(range.hi_rad_s));
  }
  return text.empty() ? "none" : text;
}

const char* class_text(AxisClass axis) {
  return axis == AxisClass::largest ? "largest" : axis == AxisClass::smallest ? "smallest" : "middle";
}

std::string option_value(const RunReport& report, const std::string& name) {
  for (const auto& [option, value] : report.options)
    if (option == name) return value;
  return {};
}

/// The command line that judges what a spin run wrote as that run did.
std::string verify_command(const SpinReport& report) {
  const SpinGoalSpec& goal = report.goal;
  const Eigen::Vector3d& p = goal.contact_mm;
  const Eigen::Vector3d& up = goal.axis;
  std::string text =
      "rayrep verify " + quoted(report.output) + " --goal " + (goal.yoyo ? "yoyo" : "spin") + " --up " +
      (option_value(report, "axis") == "auto" ? format("%.9g,%.9g,%.9g", up.x(), up.y(), up.z()) : option_value(report, "up")) +
      format(" %s %.9g,%.9g,%.9g", goal.yoyo ? "--center" : "--point", p.x(), p.y(), p.z());
  if (goal.prefer != AxisClass::largest) text += std::string(" --prefer ") + class_text(goal.prefer);
  text += format(" --density %.9g --wall %.9g", goal.density_g_cm3, goal.wall_mm);
  // --unit would scale the output, too, which is in mm; a --size fits both, whatever the unit.
  const bool sized = report.input.scale != 1;
  if (sized) text += format(" --size %.9g", report.input.size_mm.maxCoeff());
  if (sized || report.input.mm_per_unit == 1 || report.input.format == "3MF") text += " --original " + quoted(report.input.path);
  return text;
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
  Table table(report.hollowed);
  table.row("mass, g", 3, before.body.mass_g, after.body.mass_g);
  table.row("displaced at the waterline, g", 3, before.displaced_mass_g, after.displaced_mass_g);
  table.row("centre of mass above centre of buoyancy, mm", 3,
            up.dot(before.body.centre_of_mass_mm - before.water.centre_of_buoyancy_mm),
            up.dot(after.body.centre_of_mass_mm - after.water.centre_of_buoyancy_mm));
  table.row("horizontal offset between the two, mm", 5, before.horizontal_offset_mm, after.horizontal_offset_mm);
  table.row("metacentric height, mm", 3, before.metacentric_height_mm, after.metacentric_height_mm);
  table.row("settles at a tilt of, degrees", settled(before), settled(after));
  text += table.text() + "\n" + closing(report, report.after, report.hollowed ? &report.result.hollow : nullptr, verbose);
  if (report.hollowed)
    text += format("centre of mass within %.0e of the lowest possible on these rays (proven by duality)\n",
                   std::max(std::abs(report.result.hollow.duality_gap), 1e-9));
  return text;
}

std::string summary(const SpinReport& report, bool verbose) {
  std::string text = input_text(report.input);
  const SpinState& before = report.before;
  const SpinState& after = report.after.state;
  const Eigen::Vector3d& p = report.goal.contact_mm;
  const Eigen::Vector3d& up = report.goal.axis;
  if (option_value(report, "axis") == "auto") text += format("axis along (%.5f, %.5f, %.5f), ", up.x(), up.y(), up.z());
  text += format("%s at (%.3f, %.3f, %.3f) mm, material %g g/cm3, wall %g mm\n\n", report.goal.yoyo ? "centre" : "contact", p.x(),
                 p.y(), p.z(), report.goal.density_g_cm3, report.goal.wall_mm);
  Table table(report.hollowed);
  table.row("mass, g", 3, before.body.mass_g, after.body.mass_g);
  table.row("centre of mass beside the axis, mm", 5, before.offset_mm, after.offset_mm);
  if (!report.goal.yoyo) table.row("centre of mass above the contact, mm", 3, before.height_mm, after.height_mm);
  table.row("axis off the nearest principal axis, degrees", 4, degrees(before.axis_angle_rad), degrees(after.axis_angle_rad));
  table.row("Izz over the larger lateral moment", 4, before.ratio_larger, after.ratio_larger);
  table.row("Izz over the smaller lateral moment", 4, before.ratio_smaller, after.ratio_smaller);
  table.row("the axis is that of the ... moment", class_text(before.axis_class), class_text(after.axis_class));
  text += table.text();
  const auto stable = [&](const SpinState& state) {
    return speeds(state.sliding) + (report.goal.yoyo ? "" : " (sliding tip); " + speeds(state.fixed) + " (fixed tip)");
  };
  if (report.hollowed) {
    // Off its principal axis a body wobbles at any speed.
    const bool balanced = report.limits.axis_angle_rad >= before.axis_angle_rad;
    text += "  stable speeds before, rpm: " + (balanced ? stable(before) : "none, it is not balanced about this axis") + "\n";
  }
  text += format("  stable speeds%s, rpm: ", report.hollowed ? " after" : "") + stable(after) + "\n\n";
  text += closing(report, report.after, report.hollowed ? &report.result.hollow : nullptr, verbose);
  if (report.hollowed && report.result.certificate) {
    const SpinCertificate& certificate = *report.result.certificate;
    text += format(
        "no interior on these rays does better than %.6f, this one %.6f: within %.0e of the global optimum (proven, %d heights)\n",
        certificate.lower_bound, certificate.best.objective, std::max(certificate.gap, 1e-9), certificate.nodes);
  }
  if (verbose && !report.output.empty()) text += "\nto judge it again: " + verify_command(report) + "\n";
  return text;
}

std::string summary(const StandReport& report, bool verbose) {
  std::string text = input_text(report.input);
  const StandState& before = report.before;
  const StandState& after = report.after.state;
  if (report.goal.target_mm) {
    const Eigen::Vector3d& t = *report.goal.target_mm;
    text += format("target (%.3f, %.3f, %.3f) mm, ", t.x(), t.y(), t.z());
  }
  text += format("support of %zu corners and %.1f mm2, material %g g/cm3, wall %g mm\n\n", after.polygon.corners_mm.size(),
                 after.polygon.area_mm2, report.goal.density_g_cm3, report.goal.wall_mm);
  Table table(report.hollowed);
  table.row("mass, g", 3, before.body.mass_g, after.body.mass_g);
  if (report.goal.target_mm) table.row("centre of mass beside the target, mm", 5, before.target_offset_mm, after.target_offset_mm);
  table.row("centre of mass above the ground, mm", 3, before.height_mm, after.height_mm);
  table.row("smallest tipping angle, degrees", 3, degrees(before.smallest_tipping_angle_rad),
            degrees(after.smallest_tipping_angle_rad));
  // Of a round base only the report lists every edge.
  if (before.tipping_angles_rad.size() == after.tipping_angles_rad.size() && after.tipping_angles_rad.size() <= 12)
    for (std::size_t n = 0; n < after.tipping_angles_rad.size(); ++n)
      table.row(format("  over edge %zu", n + 1).c_str(), 3, degrees(before.tipping_angles_rad[n]),
                degrees(after.tipping_angles_rad[n]));
  text += table.text() + "\n" + closing(report, report.after, report.hollowed ? &report.result.hollow : nullptr, verbose);
  if (report.hollowed)
    text += format("centre of mass within %.0e of the lowest possible above the target on these rays (proven by duality)\n",
                   std::max(report.result.hollow.duality_gap, 1e-9));
  return text;
}

std::string summary(const TargetReport& report, bool verbose) {
  std::string text = input_text(report.input);
  text += format("wanted: %zu of the ten numbers, material %g g/cm3, wall %g mm\n\n", report.after.state.deviations.size(),
                 report.goal.density_g_cm3, report.goal.wall_mm);
  const MassProperties& before = report.before.body;
  const MassProperties& after = report.after.state.body;
  Table table(report.hollowed);
  for (int k = M1; k <= MXZ; ++k) {
    const auto number = static_cast<MomentIndex>(k);
    const auto& wanted = report.goal.wanted[static_cast<std::size_t>(k)];
    std::string name = inertial_name(number);
    name += k == M1 ? ", g" : k <= MZ ? ", mm" : ", g mm2";
    if (wanted) name += format(" (wanted %.8g)", *wanted);
    table.row(name.c_str(), format("%.8g", inertial_number(before, number)), format("%.8g", inertial_number(after, number)));
  }
  text += table.text() + "\n" + closing(report, report.after, report.hollowed ? &report.result.hollow : nullptr, verbose);
  const TargetResult& result = report.result;
  if (report.hollowed && result.first)
    text += format("the %s %s that these rays allow with these numbers is %.8g (proven by duality); here it is %.8g\n",
                   result.first->largest ? "largest" : "smallest", inertial_name(result.first->number), result.first_bound,
                   result.first_found);
  if (report.hollowed && result.wall_mm > report.goal.wall_mm)
    text += format("all ten numbers were given: they allow a wall of %.4f mm, and that is what the cavity has\n", result.wall_mm);
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
