#include "rayrep/advice/suggest.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "base/text.h"
#include "make/plan.h"
#include "make/spin_search.h"
#include "rayrep/base/error.h"
#include "rayrep/judge/verify.h"
#include "rayrep/physics/materials.h"

namespace rayrep {
namespace {

using detail::SpinFrame;

constexpr int kFewRays = 80;     ///< along the longest side, to see whether a change is worth a trial
constexpr int kMostLooks = 100;  ///< on few rays: then it is enough
constexpr int kMostTrials = 12;  ///< in full

/// A change of what was asked, on the way to become a suggestion.
using Change = Suggestion;

Change combined(const Change& before, const Change& more) {
  if (before.options.empty()) return more;
  Change change{before.change + " and " + more.change, before.options};
  change.options.insert(change.options.end(), more.options.begin(), more.options.end());
  return change;
}

/// A way to change what was asked.
struct Way {
  std::string words;  ///< of what was tried
  /// From the least change to the largest: what one of them makes possible, the next makes possible mostly, too.
  std::vector<Change> ladder;
  /// Or searched, given what has been changed already. None when there is nothing of the kind.
  std::function<std::optional<Change>(const Change& before)> search;
};

std::string vector_text(const Eigen::Vector3d& v, int digits) {
  return number(v.x(), digits) + "," + number(v.y(), digits) + "," + number(v.z(), digits);
}

/// Sets one setting of a spec from its text. What says the same in another way no longer does.
void set(Spec& spec, const std::string& name, const std::string& text) {
  const auto apply = [&](auto& goal) {
    Settings rows = settings(goal, Setting::For::making);
    for (Setting& row : settings(goal.print, Setting::For::making)) rows.push_back(std::move(row));
    for (Setting& row : settings(goal.print.infill, Setting::For::making)) rows.push_back(std::move(row));
    for (Setting& row : settings(goal.print.core, Setting::For::making)) rows.push_back(std::move(row));
    for (Setting& row : rows)
      if (row.name == name) parse(row, text);
  };
  std::visit(apply, spec);
  if (SpinSpec* spin = std::get_if<SpinSpec>(&spec); spin && name == "up") spin->max_tilt_rad = 0;
  if (FloatSpec* floating = std::get_if<FloatSpec>(&spec); floating && name == "waterline") {
    floating->submerged_fraction.reset();
    floating->submerged_volume_fraction.reset();
  }
}

class Adviser {
public:
  Adviser(const Mesh& mesh, const Spec& asked, const HollowOptions& options, const Progress& progress)
      : mesh_(mesh), asked_(asked), options_(options), quiet_{.stage = {}, .cancelled = progress.cancelled} {
    size_mm_ = bounding_box(mesh).sizes().maxCoeff();
    add_ways();
  }

  Advice run(const std::function<void(const Suggestion&)>& found) {
    Advice advice;
    const auto keep = [&](const std::optional<Change>& change) {
      if (!change) return;
      advice.suggestions.push_back(*change);
      if (found) found(*change);
    };
    for (const Way& way : ways_) {
      advice.tried += (advice.tried.empty() ? "" : ", ") + way.words;
      keep(least(way, {}));
    }
    if (advice.suggestions.empty()) {
      advice.tried += ", and two of these together";
      for (std::size_t a = 0; a < ways_.size(); ++a)
        for (std::size_t b = 0; b < ways_.size() && advice.suggestions.empty(); ++b)
          if (a != b && !ways_[a].ladder.empty() && (a < b || ways_[b].ladder.empty())) keep(least_pair(ways_[a], ways_[b]));
    }
    return advice;
  }

private:
  Spec spec_with(const Change& change) const {
    Spec spec = asked_;
    for (const auto& [name, text] : change.options) set(spec, name, text);
    return spec;
  }

  Mesh mesh_with(const Change& change) const {
    Mesh mesh = mesh_;
    for (const auto& [name, text] : change.options) {
      if (name != "size") continue;
      const double factor = parse_number("size", text) / size_mm_;
      for (auto& v : mesh.vertices) v *= factor;
    }
    return mesh;
  }

  HollowOptions few_rays() const {
    HollowOptions few = options_;
    few.resolution = std::min(options_.resolution, kFewRays);
    return few;
  }

  /// Whether it can be done on few rays.
  bool in_reach(const Change& change) {
    quiet_.check();
    if (++looks_ > kMostLooks) return false;
    try {
      std::visit([&](const auto& spec) { detail::plan(mesh_with(change), spec, few_rays(), quiet_); }, spec_with(change));
      return true;
    } catch (const Error& error) {
      if (error.code() == ErrorCode::interrupted) throw;
      // All ten numbers of a target take more than a plan.
      return error.code() == ErrorCode::usage && std::holds_alternative<TargetSpec>(asked_);
    }
  }

  /// Whether it is done: made as asked, and judged.
  bool delivers(const Change& change) {
    quiet_.check();
    if (++trials_ > kMostTrials) return false;
    try {
      const Mesh mesh = mesh_with(change);
      const HollowResult result = hollow(mesh, spec_with(change), options_, quiet_);
      return verify(result.delivery, &mesh, result.spec, {}, quiet_).pass();
    } catch (const Error& error) {
      if (error.code() == ErrorCode::interrupted) throw;
      return false;
    }
  }

  /// The least change along a way that is in reach after what was changed `before`, by its place in the ladder.
  std::optional<std::size_t> first_in_reach(const Way& way, const Change& before) {
    const auto will_do = [&](std::size_t n) { return in_reach(combined(before, way.ladder[n])); };
    std::size_t known = way.ladder.size() - 1;
    // The largest change can be too much.
    if (!will_do(known)) {
      if (known < 2 || !will_do(known / 2)) return std::nullopt;
      known /= 2;
    }
    std::size_t first = 0;
    while (first < known) {
      const std::size_t middle = (first + known) / 2;
      if (will_do(middle))
        known = middle;
      else
        first = middle + 1;
    }
    return known;
  }

  /// The least change along a way that is in reach and, tried in full, delivers.
  std::optional<Change> least(const Way& way, const Change& before) {
    if (way.search) {
      const std::optional<Change> change = way.search(before);
      if (!change || !delivers(combined(before, *change))) return std::nullopt;
      return combined(before, *change);
    }
    const std::optional<std::size_t> first = first_in_reach(way, before);
    if (!first) return std::nullopt;
    // What few rays promise by a hair the mesh may miss.
    for (std::size_t n = *first; n < std::min(way.ladder.size(), *first + 2); ++n)
      if (const Change change = combined(before, way.ladder[n]); delivers(change)) return change;
    return std::nullopt;
  }

  /// A pair: half or all of the first way, and as little as possible of the second.
  std::optional<Change> least_pair(const Way& first, const Way& second) {
    for (const std::size_t n : {first.ladder.size() / 2, first.ladder.size() - 1})
      if (const auto change = least(second, first.ladder[n])) return change;
    return std::nullopt;
  }

  void add_ways();
  void add_waterlines();
  void add_axes(const SpinSpec& spec);
  void add_contacts(const StandSpec& spec);
  void add_walls();
  void add_infill();
  void add_cores();
  void add_attitudes();
  void add_sizes();
  void add_materials();

  std::optional<Change> waterline(const Change& before);
  std::optional<Change> axis(const Change& before, bool tilt);

  const Mesh& mesh_;
  const Spec& asked_;
  const HollowOptions& options_;
  Progress quiet_;
  double size_mm_ = 0;
  std::vector<Way> ways_;
  int looks_ = 0;
  int trials_ = 0;
};

void Adviser::add_ways() {
  if (std::holds_alternative<FloatSpec>(asked_)) add_waterlines();
  if (const auto* spec = std::get_if<SpinSpec>(&asked_)) add_axes(*spec);
  if (const auto* spec = std::get_if<StandSpec>(&asked_)) add_contacts(*spec);
  add_walls();
  add_infill();
  add_cores();
  add_attitudes();
  add_sizes();
  add_materials();
}

/// The waterline that a search finds, where there is one; else one that leaves less dry than a search would.
void Adviser::add_waterlines() {
  ways_.push_back({"other waterlines", {}, [this](const Change& before) { return waterline(before); }});
}

std::optional<Change> Adviser::waterline(const Change& before) {
  FloatSpec spec = std::get<FloatSpec>(spec_with(before));
  const bool given = spec.waterline_mm || spec.submerged_fraction || spec.submerged_volume_fraction;
  spec.waterline_mm.reset();
  spec.submerged_fraction.reset();
  spec.submerged_volume_fraction.reset();
  // What a print's own scatter would sink is not worth a try.
  constexpr double least_reserve = 0.015;
  for (const double reserve : {spec.reserve, 0.03, least_reserve}) {
    if (!(reserve < spec.reserve || (given && reserve == spec.reserve))) continue;
    spec.reserve = reserve;
    try {
      const detail::Plan plan = detail::plan(mesh_with(before), spec, few_rays(), quiet_);
      const double found_mm = *std::get<FloatSpec>(plan.spec).waterline_mm;
      const std::string text = number(found_mm, 2);
      return Change{"a waterline of " + text + " mm (" + number(100 * found_mm / plan.body->height_mm, 0) + " % of the height)",
                    {{"waterline", text}}};
    } catch (const Error& error) {
      if (error.code() == ErrorCode::interrupted) throw;
    }
  }
  return std::nullopt;
}

void Adviser::add_axes(const SpinSpec& spec) {
  ways_.push_back(
      {spec.yoyo ? "other centres" : "parallel axes", {}, [this](const Change& before) { return axis(before, false); }});
  ways_.push_back({"axes tilted by up to 30 degrees", {}, [this](const Change& before) { return axis(before, true); }});
  if (spec.prefer == AxisClass::largest)
    ways_.push_back(
        {"the axis of the smallest moment", {{"spinning about the axis of its smallest moment", {{"prefer", "smallest"}}}}, {}});
}

/// The nearest axis, moved or tilted, about which it can spin.
std::optional<Change> Adviser::axis(const Change& before, bool tilt) {
  const SpinSpec spec = std::get<SpinSpec>(spec_with(before));
  const detail::Discretisation few = detail::discretisation(spec.print, few_rays());
  const Mesh outer = detail::stored(mesh_with(before), options_);
  try {
    const auto body = detail::body_about(detail::spin_frame(outer, spec, few, quiet_), outer, few, quiet_);
    const detail::SpinSearch search(*body, spec);
    const auto found = tilt ? search.smallest_tilt({}, quiet_) : search.nearest_point({}, quiet_);
    if (!found) return std::nullopt;
    const SpinFrame frame = detail::in_frame_given(found->first, *body);
    if (tilt)
      return Change{"the axis tilted by " + number(found->second * 180 / std::numbers::pi, 1) + " degrees",
                    {{"up", vector_text(frame.up, 5)}}};
    return Change{"the axis moved by " + number(found->second, 2) + " mm",
                  {{spec.yoyo ? "center" : "point", vector_text(frame.contact_mm, 3)}}};
  } catch (const Error& error) {
    if (error.code() == ErrorCode::interrupted) throw;
    return std::nullopt;
  }
}

void Adviser::add_contacts(const StandSpec& spec) {
  if (spec.target_mm || spec.objective != StandSpec::Objective::tip_angle)
    ways_.push_back({"other targets", {{"the target where it is safest", {{"objective", "tip-angle"}}}}, {}});
  Way way{"bases of up to 1 mm of give", {}, {}};
  const double height_mm = bounding_box(transformed(mesh_, working_frame(mesh_, spec.up))).sizes().z();
  const double asked_mm = spec.contact_tolerance_mm.value_or(contact_tolerance_mm(height_mm));
  for (const char* text : {"0.1", "0.2", "0.3", "0.5", "0.7", "1"})
    if (const double mm = parse_number("contact", text); mm > asked_mm && mm < 0.02 * height_mm)
      way.ladder.push_back({std::string("a base that gives way or is flattened by ") + text + " mm", {{"contact", text}}});
  if (!way.ladder.empty()) ways_.push_back(std::move(way));
}

void Adviser::add_walls() {
  const Infill& infill = print_of(asked_).infill;
  const double least_mm = infill.wanted() ? infill.skin_mm() : size_mm_ / 500;
  Way way{"walls down to 0.2 mm", {}, {}};
  for (const char* text :
       {"12", "10", "8", "6", "5", "4", "3", "2.5", "2", "1.6", "1.2", "1", "0.8", "0.6", "0.5", "0.4", "0.3", "0.2"})
    if (const double mm = parse_number("wall", text); mm < print_of(asked_).wall_mm && mm > least_mm)
      way.ladder.push_back({std::string("a wall of ") + text + " mm", {{"wall", text}}});
  if (!way.ladder.empty()) ways_.push_back(std::move(way));
}

/// Less infill, then none: what a sparse region can do, a cavity can, and it can be lighter.
void Adviser::add_infill() {
  const Infill& infill = print_of(asked_).infill;
  if (!infill.wanted()) return;
  Way way{"less infill", {}, {}};
  for (const char* text : {"50", "30", "20", "15", "10", "5"})
    if (!infill.percent_laid_down && parse_number("infill", text) < infill.percent)
      way.ladder.push_back({std::string(text) + " % infill", {{"infill", text}}});
  way.ladder.push_back({"a cavity instead of infill", {{"cavity", "void"}, {"infill", "0"}}});
  ways_.push_back(std::move(way));
}

/// A heavy core, or a heavier one. To float it takes a heavy body.
void Adviser::add_cores() {
  const Print& print = print_of(asked_);
  if (print.infill.wanted()) return;
  const double asked = print.core.wanted() ? print.core.density_g_cm3 : print.density_g_cm3;
  Way way{"heavy cores", {}, {}};
  for (const char* name : {"steel-shot", "tin", "bismuth-tin", "lead"})
    if (const CoreMaterial& m = core_material(name); m.density_g_cm3 > asked)
      way.ladder.push_back(
          {std::string("a core of ") + name + " (" + number(m.density_g_cm3, 2) + " g/cm3)", {{"core-material", name}}});
  if (!way.ladder.empty()) ways_.push_back(std::move(way));
}

/// Each of the other five attitudes by itself: none of them is more than another.
void Adviser::add_attitudes() {
  if (std::holds_alternative<TargetSpec>(asked_)) return;
  const Eigen::Vector3d asked = up_of(asked_).normalized();
  std::vector<Change> attitudes;
  for (const char* name : {"z", "y", "x", "-z", "-y", "-x"})
    if ((parse_direction(name) - asked).norm() > 1e-6) attitudes.push_back({std::string(name) + " pointing up", {{"up", name}}});
  ways_.push_back({"the other sides up", {}, [this, attitudes](const Change& before) -> std::optional<Change> {
                     for (const Change& change : attitudes)
                       if (in_reach(combined(before, change))) return change;
                     return std::nullopt;
                   }});
}

/// Whether places or lengths of the spec are those of this size.
bool says_places(const Spec& asked) {
  if (const auto* spec = std::get_if<FloatSpec>(&asked)) return spec->waterline_mm.has_value();
  if (const auto* spec = std::get_if<SpinSpec>(&asked)) return spec->centre_mm || spec->axis.through == SpinAxis::Through::point;
  if (const auto* spec = std::get_if<StandSpec>(&asked)) return spec->target_mm.has_value();
  return true;
}

void Adviser::add_sizes() {
  if (says_places(asked_) || !options_.fixed.empty()) return;
  Way way{"sizes up to 2.5 times this one", {}, {}};
  for (const double factor : {1.25, 1.5, 2., 2.5}) {
    const std::string text = number(size_mm_ * factor, size_mm_ < 10 ? 2 : 0);
    way.ladder.push_back({"a size of " + text + " mm", {{"size", text}}});
  }
  ways_.push_back(std::move(way));
}

/// The known materials, those nearest in density first.
void Adviser::add_materials() {
  const double asked = print_of(asked_).density_g_cm3;
  std::vector<Material> nearest = materials();
  std::stable_sort(nearest.begin(), nearest.end(), [asked](const Material& a, const Material& b) {
    return std::abs(a.density_g_cm3 - asked) < std::abs(b.density_g_cm3 - asked);
  });
  for (const bool lighter : {true, false}) {
    Way way{lighter ? "lighter materials" : "heavier materials", {}, {}};
    for (const Material& m : nearest)
      if (m.name != "resin" && (lighter ? m.density_g_cm3 < asked - 1e-6 : m.density_g_cm3 > asked + 1e-6))
        way.ladder.push_back({"printed of " + m.name + " (" + number(m.density_g_cm3, 2) + " g/cm3)", {{"material", m.name}}});
    const bool matters = std::holds_alternative<FloatSpec>(asked_) || std::holds_alternative<TargetSpec>(asked_);
    if (matters && !way.ladder.empty()) ways_.push_back(std::move(way));
  }
}

}  // namespace

Advice suggest(const Mesh& mesh, const Spec& asked, const HollowOptions& options, const Progress& progress,
               const std::function<void(const Suggestion&)>& found) {
  detail::check(options, asked);
  std::visit([](const auto& s) { check(s, Setting::For::making); }, asked);
  progress.begin("advice");
  return Adviser(mesh, asked, options, progress).run(found);
}

}  // namespace rayrep
