#include "report/words.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace rayrep::report_detail {
namespace {

double degrees(double rad) { return rad * 180 / std::numbers::pi; }

bool is_angle(const Criterion& c) { return c.description.ends_with(", rad"); }

/// A figure as a table shows it.
std::string cell(const Figure& figure, double value) {
  if (!std::isfinite(value)) return figure.none;
  if (figure.unit == Unit::rad) value = degrees(value);
  return figure.significant ? format("%.*g", figure.digits, value) : format("%.*f", figure.digits, value);
}

std::string cell(const Figure& figure) {
  if (const double* value = std::get_if<double>(&figure.value)) return cell(figure, *value);
  if (const std::string* text = std::get_if<std::string>(&figure.value)) return *text;
  return figure.none;
}

const char* unit_words(Unit unit) {
  static constexpr const char* kWords[] = {"",    ", mm",    ", mm2",   ", mm3",     ", mm4",
                                           ", g", ", g/cm3", ", g mm2", ", degrees", ", rpm"};
  return kWords[static_cast<std::size_t>(unit)];
}

/// Fills Rows from figures and those before, which there may be none of.
class RowsOfFigures {
public:
  void add(const Figure* before, const Figure& after) {
    if (after.words.empty()) return;
    const std::string before_text = before ? cell(*before) : "";
    if (after.unit == Unit::rpm) {
      if (before) rows_.lines.push_back({after.words + " before" + unit_words(after.unit), "", before_text});
      rows_.lines.push_back({after.words + (before ? " after" : "") + unit_words(after.unit), "", cell(after)});
    } else if (const auto* list = std::get_if<std::vector<double>>(&after.value)) {
      add_list(before, after, *list);
    } else if (const auto* record = std::get_if<Record>(&after.value)) {
      add_record(before, after, *record);
    } else {
      rows_.table.push_back({after.words + unit_words(after.unit), before_text, cell(after)});
    }
  }

  Rows rows() const { return rows_; }

private:
  /// One row an entry, where both have as many and they are few. A report lists all of them.
  void add_list(const Figure* before, const Figure& after, const std::vector<double>& list) {
    constexpr std::size_t few = 12;
    const auto* other = before ? std::get_if<std::vector<double>>(&before->value) : &list;
    if (!other || other->size() != list.size() || list.size() > few) return;
    for (std::size_t n = 0; n < list.size(); ++n)
      rows_.table.push_back({after.words + " " + std::to_string(n + 1), cell(after, (*other)[n]), cell(after, list[n])});
  }

  /// One row an entry, beside the entry of that name.
  void add_record(const Figure* before, const Figure& after, const Record& record) {
    const auto* other = before ? std::get_if<Record>(&before->value) : nullptr;
    const auto text = [&after](const Scalar& value) {
      const double* number = std::get_if<double>(&value);
      return number ? cell(after, *number) : after.none;
    };
    for (const auto& [name, value] : record) {
      const auto same = [&name = name](const auto& entry) { return entry.first == name; };
      const auto found = other ? std::find_if(other->begin(), other->end(), same) : record.end();
      rows_.table.push_back(
          {after.words + " " + name, other && found != other->end() ? text(found->second) : after.none, text(value)});
    }
    if (!other) return;
    for (const auto& [name, value] : *other) {
      const auto same = [&name = name](const auto& entry) { return entry.first == name; };
      if (std::none_of(record.begin(), record.end(), same))
        rows_.table.push_back({after.words + " " + name, text(value), after.none});
    }
  }

  Rows rows_;
};

/// @param least  what is smaller is rounding
std::string place(const Eigen::Vector3d& p, double least) {
  const Eigen::Vector3d shown = (p.array().abs() < least).select(Eigen::Array3d::Zero(), p.array());
  return format("%.7g, %.7g, %.7g", shown.x(), shown.y(), shown.z());
}

}  // namespace

std::vector<std::pair<const char*, const Defect&>> defects_of(const MeshReport& check) {
  return {{"coordinates that are not numbers", check.not_finite},
          {"degenerate triangles (dropped)", check.degenerate},
          {"duplicate triangles", check.duplicate},
          {"open edges", check.open_edges},
          {"non-manifold edges", check.non_manifold_edges},
          {"mis-oriented edges", check.misoriented_edges},
          {"edges where the surface is not closed", check.unbalanced_edges},
          {"self-intersecting pairs", check.self_intersections}};
}

Rows rows_of(const Figures* before, const Figures& after) {
  RowsOfFigures rows;
  for (std::size_t n = 0; n < after.size(); ++n)  // what a verdict alone finds comes last
    rows.add(before && n < before->size() ? &(*before)[n] : nullptr, after[n]);
  return rows.rows();
}

Rows rows_of(const Inspection& inspection) {
  Rows rows;
  const auto add = [&rows](const char* words, std::string text) { rows.table.push_back({words, "", std::move(text)}); };
  const MeshReport& check = inspection.input.check;
  add("triangles", std::to_string(inspection.input.triangles));
  add("components", std::to_string(check.components));
  if (check.nested_components > 0)
    add("components inside another, of which cavities", format("%zu, %zu", check.nested_components, check.cavities));
  if (const MassProperties* mass = inspection.mass) {
    add("volume, cm3", format("%.7g", mass->volume_mm3 / 1000));
    add("surface area, cm2", format("%.7g", inspection.area_mm2 / 100));
    add("density, g/cm3", format("%g", inspection.density_g_cm3));
    add("mass, g", format("%.7g", mass->mass_g));
    add("centre of mass, mm", place(mass->centre_of_mass_mm, 1e-7 * inspection.input.size_mm.maxCoeff()));
    add("principal moments, g mm2", place(mass->principal_moments_g_mm2, 0));
  }
  for (const auto& [words, d] : defects_of(check))
    if (d) rows.lines.push_back({words, "", format("%zu, the first at (%s)", d.count, place(d.first_mm, 0))});
  return rows;
}

std::string words_of(const Criterion& c) {
  return is_angle(c) ? c.description.substr(0, c.description.size() - 3) + "degrees" : c.description;
}

std::string value_text(const Criterion& c, double value) {
  if (!std::isfinite(value)) return "-";
  if (is_angle(c)) return format("%.4f", degrees(value));
  if (c.name == "trapped_resin") return format("%.2f", value);
  if (c.name == "wall" || c.name == "fairness" || c.name == "pose_1_afloat" || c.name.ends_with("metacentric_height"))
    return format("%.3f", value);
  if (value == std::round(value) && std::abs(value) < 1e6) return format("%.0f", value);
  return format("%.2e", value);
}

namespace {

/// Where the last pass still missed what was asked for; a print that was sliced tells that of its slices.
std::optional<std::string> missed_words(const RunReport& report) {
  const double asked = HollowOptions{}.as_built_tolerance;
  const double missed = report.hollow->as_built_error;
  if (!report.hollow->slices.empty() || !(missed > asked) || !std::isfinite(missed)) return std::nullopt;
  const double mass_g = report.after.body.mass_g;
  return format(
      "after %d passes it still misses what was asked for by %.1e of its mass or size, and should by %.0e at most: by up to "
      "%.2g g of %.4g g, or %.2g mm; another --resolution may come nearer",
      report.hollow->passes, missed, asked, missed * mass_g, mass_g, missed * report.input.size_mm.norm());
}

}  // namespace

std::vector<std::string> notes_of(const RunReport& report) {
  const HollowResult& hollow = *report.hollow;
  std::vector<std::string> notes;
  if (const auto missed = missed_words(report)) notes.push_back(*missed);
  if (hollow.cast.bad > 0)
    notes.push_back(format("%zu of %zu rays did not close and were left solid", hollow.cast.bad, hollow.cast.rays));
  if (hollow.filled_cavities > 0)
    notes.push_back(format("%s, %zu with %.2g mm3 in all, were filled; the rest makes up for it",
                           print_of(hollow.spec).infill.wanted()                        ? "sparse regions too small to print"
                           : print_of(hollow.spec).drains.where == Drains::Where::found ? "cavities too small for holes"
                                                                                        : "cavities too small to print",
                           hollow.filled_cavities, hollow.filled_mm3));
  return notes;
}

std::vector<std::string> proof_of(const HollowResult& hollow, bool verbose) {
  constexpr double closed = 1e-6;
  const bool gap_alone = hollow.duality_gap && !hollow.extreme && hollow.proof.size() == 1;
  if (gap_alone && !verbose && std::abs(*hollow.duality_gap) <= closed)
    return {"No other inside brings its centre of mass lower (proven on the rays that were cast)."};
  return hollow.proof;
}

}  // namespace rayrep::report_detail
