#include <algorithm>
#include <cctype>
#include <cmath>
#include <set>

#include "judge/figures.h"
#include "rayrep/report/balance_report.h"
#include "rayrep/report/report.h"
#include "report/words.h"

namespace rayrep {
namespace {

using namespace report_detail;

/// Broken before the width of a terminal.
std::string wrapped(const std::string& text) {
  constexpr std::size_t width = 110;
  std::string out;
  std::size_t at = 0;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find(' ', begin), text.size());
    if (at > 0 && at + 1 + (end - begin) > width) {
      out += "\n";
      at = 0;
    }
    if (at > 0) out += " ";
    out += text.substr(begin, end - begin);
    at += (at > 0) + (end - begin);
    begin = end + 1;
  }
  return out + "\n";
}

std::string input_text(const InputSummary& input) {
  const std::string name = input.body > 0 ? format("%s, body %zu of %zu", input.path, input.body, input.bodies) : input.path;
  std::string text =
      format("%s: %s, %.4g x %.4g x %.4g mm, %zu triangles, %zu component%s\n", name, input.format, input.size_mm.x(),
             input.size_mm.y(), input.size_mm.z(), input.triangles, input.check.components, input.check.components == 1 ? "" : "s");
  for (const std::string& note : input.notes) text += "  note: " + note + "\n";
  for (const std::string& note : input.check.notes) text += "  note: " + note + "\n";
  const double longest = input.size_mm.maxCoeff();
  if (input.check.usable && (longest < 1 || longest > 2000))
    text += format("  note: the longest side is %g mm; if that is not meant, see --unit and --size\n", longest);
  return text;
}

std::string figures_text(const Figures* before, const Figures& after) {
  const Rows rows = rows_of(before, after);
  std::string text;
  const auto row = [&](const Row& r) {
    text += before ? format("  %-44s %14s %14s\n", r.words, r.before, r.after) : format("  %-44s %14s\n", r.words, r.after);
  };
  if (before) row({"", "before (solid)", "after"});
  for (const Row& r : rows.table) row(r);
  for (const Row& r : rows.lines) text += "  " + r.words + ": " + r.after + "\n";
  return text + "\n";
}

/// Verdict per criterion, and notes.
std::string criteria_text(const Verdict& verdict) {
  std::string text;
  for (const Criterion& c : verdict.criteria)
    text += format("  %-6s %-58s %12s  (%s %s)\n", c.pass() ? "ok" : "FAILED", words_of(c), value_text(c, c.value),
                   c.kind == Criterion::Kind::at_most ? "at most" : "at least", value_text(c, c.limit));
  for (const std::string& note : verdict.notes) text += "  note: " + note + "\n";
  return text;
}

/// What came of the making beside the figures.
std::string making_text(const RunReport& report) {
  std::string text;
  for (const std::string& note : notes_of(report)) text += "  note: " + note + "\n";
  return text;
}

/// What came of each slicing.
std::string slices_text(const HollowResult& hollow) {
  std::string text;
  for (std::size_t n = 0; n < hollow.slices.size(); ++n)
    text += format("  slice %zu: lays down %+.3f %% of the mesh, off by %.1e of mass or diagonal%s\n", n + 1,
                   100 * hollow.slices[n].excess, hollow.slices[n].error, n == hollow.best_slice ? " (delivered)" : "");
  if (hollow.gave_way)
    text += "  note: slices jump by whole layers, past the waterline that was found: it is now that of the print\n";
  return text;
}

/// How the inside was found.
std::string solver_text(const HollowResult& hollow) {
  const bool one = hollow.cavities == 1;
  const bool sparse = print_of(hollow.spec).infill.wanted();
  return format("\n%zu %s; %s: %s, %ld variables, %d iterations in %d pass%s\n", hollow.cavities,
                sparse ? (one ? "sparse region" : "sparse regions") : (one ? "cavity" : "cavities"), hollow.solve.solver,
                hollow.solve.solver_status, hollow.solve.variables, hollow.solver_iterations, hollow.passes,
                hollow.passes == 1 ? "" : "es");
}

/// Centre of mass and inertia.
std::string body_text(const MassProperties& body) {
  std::string text;
  const Eigen::Vector3d& c = body.centre_of_mass_mm;
  text += format("  centre of mass       %14.7g %14.7g %14.7g mm\n", c.x(), c.y(), c.z());
  text += "  inertia tensor about the centre of mass, g mm2 (off-diagonals: negative products of inertia)\n";
  for (int n = 0; n < 3; ++n)
    text += format("                       %14.6g %14.6g %14.6g\n", body.inertia_g_mm2(n, 0), body.inertia_g_mm2(n, 1),
                   body.inertia_g_mm2(n, 2));
  text += "  principal moments, g mm2, and axes\n";
  for (int n = 0; n < 3; ++n)
    text += format("  %20.6g  (%9.6f, %9.6f, %9.6f)\n", body.principal_moments_g_mm2[n], body.principal_axes(0, n),
                   body.principal_axes(1, n), body.principal_axes(2, n));
  return text;
}

bool ends_in_3mf(const std::string& path) {
  std::string ending = path.substr(std::min(path.size(), path.rfind('.')));
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
  return ending == ".3mf";
}

/// Where to pause the print, and how many balls belong there.
std::string pauses_text(const RunReport& report) {
  std::string heights;
  for (const double pause_mm : report.pauses_mm) {
    heights += (heights.empty() ? "" : ", ") + format("%.2f mm", pause_mm);
    const auto balls = std::count_if(report.hollow->balls.begin(), report.hollow->balls.end(),
                                     [pause_mm](const Ball& ball) { return std::abs(ball.pause_mm - pause_mm) < 1e-5; });
    if (balls > 0) heights += format(" (%d)", balls);
  }
  const Eigen::Vector3d up = up_of(report.hollow->spec).normalized();
  if ((up - Eigen::Vector3d::UnitZ()).norm() > 1e-6)
    heights += format(" along its up direction (%.4g, %.4g, %.4g)", up.x(), up.y(), up.z());
  const bool told = report.print || ends_in_3mf(report.output);
  return "Pause the print at the first layer above " + heights + " and put in what belongs there" +
         (told ? "; for PrusaSlicer the pauses are in the file" : "; a 3MF output has the pauses for PrusaSlicer");
}

/// What is put in, and how.
std::string insert_text(const RunReport& report) {
  const HollowResult& hollow = *report.hollow;
  const MassProperties& mass = report.insert->mass;
  if (hollow.balls.empty()) {
    const Core& core = print_of(hollow.spec).core;
    const int pieces = report.insert->pieces;
    return format("%s is the core: %.1f cm3, %.1f g of %s%s; ", report.insert->path, mass.volume_mm3 / 1000, mass.mass_g,
                  core.material.empty() ? "what you chose" : core.material, pieces > 1 ? format(" in %d pieces", pieces) : "") +
           (core.poured() ? (pieces > 1 ? "pour it into each of its rooms through a hole or during a pause of the print"
                                        : "pour it into its room through a hole or during a pause of the print")
                          : "print the body in two parts, glue the core in and the parts together");
  }
  return format("%s shows where the balls are", report.insert->path);
}

bool tells(const Verdict& verdict, const char* name) {
  return std::any_of(verdict.figures.begin(), verdict.figures.end(), [name](const Figure& f) { return f.name == name; });
}

/// What comes out of the holes, and what closes them.
std::string drains_text(const RunReport& report) {
  const Print& print = print_of(report.hollow->spec);
  double stays = 0;
  for (const Figure& figure : report.after.figures)
    if (const double* share = std::get_if<double>(&figure.value); share && figure.name == "trapped_share") stays = *share;
  constexpr double kTold = 0.01;
  const bool resin = print.liquid_g_cm3 > 0;
  std::string what = resin ? "Let the resin run out of the holes" : "What is left inside comes out of the holes";
  if (stays > 1 - kTold)
    what = std::string("Nothing of the ") + (resin ? "resin" : "liquid that is left inside") +
           " comes out of the holes, the way it is printed: turn it, or let holes be found (--drain auto)";
  else if (stays > kTold)
    what += format(", but for the %.0f %% that stay", 100 * stays);
  if (!report.plugs) return what;
  const std::string where = report.plugs->path.empty() ? "in the file, too" : "in " + report.plugs->path;
  return what + format("; then glue in the %s (%s), tight",
                       report.plugs->pieces > 1 ? format("%d plugs", report.plugs->pieces) : std::string("plug"), where);
}

}  // namespace

std::string to_text(const RunReport& report, bool verbose) {
  const Verdict& verdict = report.after;
  std::string text = report.hollow || !report.print ? input_text(report.input) : "";
  if (report.print) text += heading_text(*report.print);
  text += "\n";
  if (!report.changed.empty()) text += wrapped("Changed, as --allow lets: " + report.changed + ".");
  for (const std::string& sentence : verdict.meaning) text += wrapped(sentence);
  if (report.outside) text += "\n" + wrapped("note: " + report.outside->note);
  text += "\n" + verdict.headline + "\n\n";
  text += figures_text(report.hollow ? &report.before : nullptr, verdict.figures) + criteria_text(verdict);
  if (report.hollow) text += making_text(report) + slices_text(*report.hollow);
  if (verbose) {
    if (report.hollow) text += solver_text(*report.hollow);
    for (const auto& [stage, seconds] : report.timings_s) text += format("  %-10s %8.3f s\n", stage, seconds);
    text += format("  %-10s %8.1f MB\n", "memory", report.peak_memory_mb);
  }
  if (report.hollow && !report.hollow->proof.empty()) {
    text += "\n";
    for (const std::string& sentence : proof_of(*report.hollow, verbose)) text += sentence + "\n";
  }
  return text;
}

std::string printing_text(const RunReport& report) {
  if (!report.hollow) return {};
  const HollowResult& hollow = *report.hollow;
  const Print& print = print_of(hollow.spec);
  std::string text = "To print: ";
  if (report.print) {
    text += report.print->path + " as it is: it is what was judged, and another profile prints something else";
  } else if (!hollow.slices.empty()) {
    text += "with the profile it was sliced with before";
  } else if (print.liquid_g_cm3 > 0) {
    text += "solid, not hollowed again by the slicer";
    if (hollow.cavities > 0 && !print.drains.wanted() && !tells(report.after, "pieces"))
      text += format("; drill a hole into %s, let the resin run out, and close it with cured resin",
                     hollow.cavities == 1 ? std::string("the cavity") : format("each of the %zu cavities", hollow.cavities));
  } else if (hollow.cavities == 0) {
    text += "at 100 % infill";
  } else if (const Infill& infill = print.infill; infill.wanted()) {
    text += format(
        "the file says 100 %% infill, and %.4g %% (%s) in its modifier; keep both. It takes %d perimeters of %.4g mm, %d solid "
        "layers above and %d below, of %.4g mm",
        infill.percent, infill.pattern, infill.perimeters, infill.extrusion_width_mm, infill.top_layers, infill.bottom_layers,
        infill.layer_height_mm);
  } else if (ends_in_3mf(report.output)) {
    text +=
        "the file asks PrusaSlicer, Bambu Studio and OrcaSlicer for 100 % infill and for supports on the build plate only; set "
        "both yourself in another slicer";
  } else {
    text +=
        "at 100 % infill, with supports on the build plate only (automatic supports fill the cavity). A 3MF output (-o NAME.3mf) "
        "carries both";
  }
  if (std::optional<Eigen::Vector3d> up = print.direction;
      up && report.piece_outputs.empty() && up->normalized() != Eigen::Vector3d::UnitZ())
    text += ". The file stands as it came: in the slicer turn it so that " +
            shown(Setting{.name = "", .value = "", .words = "", .details = "", .place = direction_place("", *up)}) + " points up";
  if (report.outside) text += format(". %s is the outside that it has now", report.outside->path);
  if (!report.dense_output.empty())
    text += format(". %s is what is solid, %s what is sparse", report.dense_output, report.sparse_output);
  if (!report.piece_outputs.empty()) {
    text += ". Its pieces, each lying on its cut, are ";
    for (const std::string& path : report.piece_outputs)
      text += (&path == &report.piece_outputs.front() ? "" : &path == &report.piece_outputs.back() ? " and " : ", ") + path;
    text += ", too";
  }
  if (report.insert) text += ". " + insert_text(report);
  if (print.drains.wanted()) text += ". " + drains_text(report);
  if (!report.pauses_mm.empty()) text += ". " + pauses_text(report);
  const bool more = report.insert || report.plugs || tells(report.after, "inserts");
  return wrapped(text + (more ? ". All together" : ". The print") + " should weigh " +
                 verify_detail::grams(report.after.body.mass_g) + ".");
}

std::string to_text(const Inspection& inspection) {
  const InputSummary& input = inspection.input;
  const MassProperties* mass = inspection.mass;
  std::string text = input_text(input);
  const MeshReport& check = input.check;
  for (const auto& [words, d] : defects_of(check))
    if (d) text += format("  %-34s %9zu   first at (%g, %g, %g)\n", words, d.count, d.first_mm.x(), d.first_mm.y(), d.first_mm.z());
  if (check.nested_components > 0)
    text += format("  components inside another: %zu, of which cavities: %zu\n", check.nested_components, check.cavities);
  if (!mass) return text;
  text += format("\n  volume               %14.7g cm3\n", mass->volume_mm3 / 1000);
  text += format("  surface area         %14.7g cm2\n", inspection.area_mm2 / 100);
  text += format("  mass                 %14.7g g          (density %g g/cm3)\n", mass->mass_g, inspection.density_g_cm3);
  text += body_text(*mass);
  return text;
}

std::string heading_text(const Measurement& measurement) {
  const Printed& printed = measurement.printed;
  std::string text = measurement.path + ": " + printed.format + (printed.slicer.empty() ? "" : " by " + printed.slicer) + "\n";
  for (const std::string& note : printed.notes) text += "  note: " + note + "\n";
  if (printed.told_volume_mm3) {
    const double all = printed.volume_mm3();
    const double off = 100 * (all / *printed.told_volume_mm3 - 1);
    text += format("  The slicer says \"%s\": %.3f cm3; the file lays down %.3f cm3 (%+.3f %%).\n", printed.told,
                   *printed.told_volume_mm3 / 1000, all / 1000, std::abs(off) < 5e-4 ? 0.0 : off);
  }
  if (!measurement.density_told && printed.usual_density_g_cm3 == measurement.density_g_cm3)
    text += format("  Density %g g/cm3, as resins have: the file does not say it (--density).\n", measurement.density_g_cm3);
  else if (!measurement.density_told)
    text += format("  Density %g g/cm3.\n", measurement.density_g_cm3);
  else
    text += format("  Density %g g/cm3, as the file says.\n", measurement.density_g_cm3);
  if (!measurement.placed) return text;
  const PrintPlacement& placed = *measurement.placed;
  if (placed.layers == 0)
    return text + "  " + measurement.mesh + " lies where --bed-center says; there are no outlines to check that.\n";
  text += format("  %s was found in it by the outlines of %zu layers, which agree in width and depth to %.3f mm (median).\n",
                 measurement.mesh, placed.layers, placed.size_error_mm);
  for (const std::string& note : placed.notes) text += "  note: " + note + "\n";
  return text;
}

std::string to_text(const Measurement& measurement) {
  std::string text = heading_text(measurement);
  text += format("\n  %-34s %12s %12s\n", "laid down as", "cm3", "g");
  const double g = 1e-3 * measurement.density_g_cm3;
  for (const PrintedFeature& feature : measurement.printed.features)
    text += format("  %-34s %12.4f %12.4f%s\n", feature.name, feature.s[M1] / 1000, g * feature.s[M1],
                   feature.of_body ? "" : "   not of the body");
  text += format("\n  mass of the body     %14.7g g          (%.7g cm3)\n", measurement.body.mass_g,
                 measurement.body.volume_mm3 / 1000);
  text += measurement.placed ? "  In the coordinates of the mesh:\n"
                             : "  In the printer's coordinates (--of MESH gives those of the mesh):\n";
  return text + body_text(measurement.body);
}

std::string to_text(const BalanceReport& report) {
  std::string text;
  std::size_t n = 0;
  for (const MechanismPart& part : report.mechanism.parts) {
    if (!part.printed) continue;
    const Verdict& verdict = report.verdict.parts[n];
    text += format("  %-16s %10.2f g  %s\n", part.name, verdict.body.mass_g,
                   n < report.outputs.size() ? report.outputs[n] : std::to_string(verdict.cavities) + " cavities");
    for (const Criterion& c : verdict.criteria)
      if (!c.pass()) text += wrapped("fails: " + words_of(c) + ", " + value_text(c, c.value) + " (" + value_text(c, c.limit) + ")");
    ++n;
  }
  text += format("  %-16s %10.2f g\n", "together", report.verdict.mass_g);
  for (const PoseVerdict& verdict : report.verdict.states)
    for (const std::string& sentence : verdict.meaning) text += "\n" + wrapped(sentence);
  std::set<std::string> told;
  for (const PoseVerdict& verdict : report.verdict.states)
    for (const std::string& note : verdict.notes)
      if (told.insert(note).second) text += "\n" + wrapped("note: " + note);
  if (report.made && !report.made->proof.empty()) {
    text += "\n";
    for (const std::string& sentence : report.made->proof) text += sentence + "\n";
  }
  return text;
}

}  // namespace rayrep
