#include "rayrep/advice/suggest.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "base/rotation.h"
#include "base/text.h"
#include "make/plan.h"
#include "make/spin_search.h"
#include "rayrep/base/error.h"
#include "rayrep/judge/kept_solid.h"
#include "rayrep/judge/verify.h"
#include "rayrep/physics/ground_rest.h"
#include "rayrep/physics/materials.h"
#include "rayrep/shape/deform.h"

namespace rayrep {
namespace {

using detail::SpinFrame;

constexpr int kMostLooks = 150;  ///< on few rays: then it is enough
constexpr int kFewestRays = 40;  ///< likewise, of many changes
constexpr int kMostTrials = 12;  ///< in full
constexpr double kDegree = std::numbers::pi / 180;

/// A change of what was asked, on the way to become a suggestion.
using Change = Suggestion;

Change combined(const Change& before, const Change& more) {
  if (before.options.empty()) return more;
  Change change{before.change + " and " + more.change, before.options, before.kinds, more.outside};
  change.options.insert(change.options.end(), more.options.begin(), more.options.end());
  change.kinds.insert(change.kinds.end(), more.kinds.begin(), more.kinds.end());
  return change;
}

/// A way to change what was asked.
struct Way {
  ChangeKind kind;
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
  if (PoseSpec* poses = std::get_if<PoseSpec>(&spec); poses && name == "stand")
    std::erase_if(poses->poses, [](const Pose& pose) { return pose.kind == Pose::Kind::stands; });
  const auto apply = [&](auto& goal) {
    Settings rows = settings(goal, Setting::For::making);
    for (Setting& row : settings(goal.print, Setting::For::making)) rows.push_back(std::move(row));
    for (Setting& row : settings(goal.print.infill, Setting::For::making)) rows.push_back(std::move(row));
    for (Setting& row : settings(goal.print.core, Setting::For::making)) rows.push_back(std::move(row));
    for (Setting& row : settings(goal.print.balls, Setting::For::making)) rows.push_back(std::move(row));
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

/// Goals that ask for a centre of mass, wherever from: neither another side up nor a moved outside is an answer to them.
bool is_of_numbers(const Spec& spec) {
  return std::holds_alternative<TargetSpec>(spec) || std::holds_alternative<PoseSpec>(spec) ||
         std::holds_alternative<DiceSpec>(spec);
}

class Adviser {
public:
  Adviser(const Mesh& mesh, const Spec& asked, const HollowOptions& options, const Search& search, const Progress& progress)
      : mesh_(mesh),
        asked_(asked),
        options_(options),
        few_(detail::on_few_rays(options)),
        search_(search),
        quiet_{.stage = {}, .cancelled = progress.cancelled} {
    size_mm_ = bounding_box(mesh).sizes().maxCoeff();
    add_ways();
    std::erase_if(ways_, [&kinds = search.kinds](const Way& way) {
      return !kinds.empty() && std::find(kinds.begin(), kinds.end(), way.kind) == kinds.end();
    });
    std::stable_sort(ways_.begin(), ways_.end(), [](const Way& a, const Way& b) { return a.kind < b.kind; });
  }

  Advice run() {
    const auto enough = [this] { return search_.first_only && !advice_.suggestions.empty(); };
    for (const Way& way : ways_) {
      if (enough()) return advice_;
      if (way.kind == ChangeKind::deform && search_.kinds.empty() && !advice_.suggestions.empty()) continue;
      advice_.tried += (advice_.tried.empty() ? "" : ", ") + way.words;
      const std::optional<Change> change = least(way, {});
      keep(change);
      // What stood in the way is out of it: else all would be tried with holes or pillars, which takes long.
      if (change && way.kind == ChangeKind::drain) return advice_;
      if (change && way.kind == ChangeKind::roof) return print_of(asked_).min_feature_mm ? advice_ : with_print_directions();
    }
    std::erase_if(ways_, [](const Way& way) { return way.kind == ChangeKind::deform; });
    if (!advice_.suggestions.empty() || ways_.size() < 2) return advice_;
    advice_.tried += ", and two of these together";
    for (std::size_t a = 0; a < ways_.size(); ++a)
      for (std::size_t b = 0; b < ways_.size() && advice_.suggestions.empty(); ++b)
        if (a != b && !ways_[a].ladder.empty() && (a < b || ways_[b].ladder.empty())) keep(least_pair(ways_[a], ways_[b]));
    return advice_;
  }

private:
  /// Beside what has been found, if those are looked for.
  Advice with_print_directions() {
    for (const Way& way : ways_) {
      if (way.kind != ChangeKind::direction || search_.first_only) continue;
      advice_.tried += ", " + way.words;
      keep(least(way, {}));
    }
    return advice_;
  }

  void keep(const std::optional<Change>& change) {
    if (!change) return;
    advice_.suggestions.push_back(*change);
    if (search_.found) search_.found(*change);
  }

  Spec spec_with(const Change& change) const {
    Spec spec = asked_;
    for (const auto& [name, text] : change.options) set(spec, name, text);
    return spec;
  }

  Mesh mesh_with(const Change& change) const {
    if (change.outside) return detail::stored(change.outside->mesh, options_);
    Mesh mesh = mesh_;
    for (const auto& [name, text] : change.options) {
      if (name != "size") continue;
      const double factor = parse_number("size", text) / size_mm_;
      for (auto& v : mesh.vertices) v *= factor;
    }
    return mesh;
  }

  static Change step_of(const Way& way, std::size_t n) {
    Change change = way.ladder[n];
    change.kinds = {way.kind};
    return change;
  }

  /// Whether it can be done on few rays.
  bool in_reach(const Change& change) { return in_reach(change, few_); }

  bool in_reach(const Change& change, const HollowOptions& few) {
    quiet_.check();
    if (++looks_ > kMostLooks) return false;
    try {
      std::visit([&](const auto& spec) { detail::plan(mesh_with(change), spec, few, quiet_); }, spec_with(change));
      return true;
    } catch (const Error& error) {
      if (error.code() == ErrorCode::interrupted) throw;
      // All ten numbers of a target take more than a plan.
      return error.code() == ErrorCode::usage && std::holds_alternative<TargetSpec>(asked_);
    }
  }

  /// Whether it is done: made as asked, and judged.
  bool delivers(const Change& change) {
    if (!search_.deliver) return is_made(change, options_);
    quiet_.check();
    return ++trials_ <= kMostTrials && search_.deliver(change);
  }

  bool is_made(const Change& change, const HollowOptions& options) {
    quiet_.check();
    if (++trials_ > kMostTrials) return false;
    try {
      const Mesh mesh = mesh_with(change);
      const HollowResult result = hollow(mesh, spec_with(change), options, quiet_);
      Verdict verdict = verify(result.delivery, &mesh, result.spec, {}, quiet_);
      judge_kept_solid(result.delivery.solid(), kept_solid_terms(options.keep_solid, result.spec, &mesh), verdict, quiet_);
      return verdict.pass() && carries_roofs(result);
    } catch (const Error& error) {
      if (error.code() == ErrorCode::interrupted) throw;
      return false;
    }
  }

  /// All that were to be carried.
  static bool carries_roofs(const HollowResult& result) {
    for (const Figure& figure : result.proof_figures)
      if (figure.name == "self_supporting")
        for (const auto& [key, value] : std::get<Record>(figure.value))
          if (key == "carried") return std::get<bool>(value);
    return true;
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
      std::optional<Change> change = way.search(before);
      if (!change) return std::nullopt;
      change->kinds = {way.kind};
      if (!delivers(combined(before, *change))) return std::nullopt;
      return combined(before, *change);
    }
    const std::optional<std::size_t> first = first_in_reach(way, before);
    if (!first) return std::nullopt;
    // What few rays promise by a hair the mesh may miss.
    for (std::size_t n = *first; n < std::min(way.ladder.size(), *first + 2); ++n)
      if (const Change change = combined(before, step_of(way, n)); delivers(change)) return change;
    return std::nullopt;
  }

  /// A pair: half or all of the first way, and as little as possible of the second.
  std::optional<Change> least_pair(const Way& first, const Way& second) {
    for (const std::size_t n : {first.ladder.size() / 2, first.ladder.size() - 1})
      if (const auto change = least(second, step_of(first, n))) return change;
    return std::nullopt;
  }

  void add_ways();
  void add_plugs();
  void add_holes();
  void add_roofs();
  void add_print_directions();
  void add_waterlines();
  void add_axes(const SpinSpec& spec);
  void add_targets(const StandSpec& spec);
  void add_faces(const PoseSpec& spec);
  void add_contacts(const std::optional<double>& tolerance_mm);
  void add_walls();
  void add_infill();
  void add_cores();
  void add_tilts();
  void add_flattening(const StandSpec& spec);
  void add_balls();
  void add_attitudes();
  void add_sizes();
  void add_materials();
  void add_deformation();

  std::optional<Change> waterline(const Change& before);
  std::optional<Change> print_direction(const Change& before);
  std::optional<Change> axis(const Change& before, bool tilt);
  std::optional<Change> attitude(const Change& before);
  std::optional<Change> steel_balls(const Change& before);
  std::optional<Change> deformation();
  std::optional<Change> flattening(const Change& before, const std::string& most_mm);
  std::optional<Change> tilt_to_stand(const Change& before);
  std::optional<Change> tilt_to_float(const Change& before);
  const std::vector<Eigen::Vector3d>& rests();

  const Mesh& mesh_;
  const Spec& asked_;
  const HollowOptions& options_;
  const HollowOptions few_;  ///< to see whether a change is worth a trial
  const Search& search_;
  Progress quiet_;
  Advice advice_;
  double size_mm_ = 0;
  std::optional<std::vector<Eigen::Vector3d>> rests_;  ///< see rests()
  std::vector<Way> ways_;
  int looks_ = 0;
  int trials_ = 0;
};

void Adviser::add_ways() {
  add_plugs();
  add_holes();
  add_roofs();
  add_print_directions();
  if (std::holds_alternative<FloatSpec>(asked_)) add_waterlines();
  if (const auto* spec = std::get_if<SpinSpec>(&asked_)) add_axes(*spec);
  if (const auto* spec = std::get_if<StandSpec>(&asked_)) {
    add_targets(*spec);
    add_flattening(*spec);
  }
  if (const auto* spec = std::get_if<PoseSpec>(&asked_)) add_faces(*spec);
  add_tilts();
  add_walls();
  add_infill();
  add_cores();
  add_balls();
  add_attitudes();
  add_sizes();
  add_materials();
  add_deformation();
}

/// Holes that are closed again may be anywhere.
void Adviser::add_plugs() {
  const Drains& drains = print_of(asked_).drains;
  if (!drains.wanted() || drains.plugged) return;
  ways_.push_back({ChangeKind::plug, "plugs", {{"the holes closed again by plugs", {{"plug", ""}}}}, {}});
}

/// Resin runs out of holes only; where a wide one has no place, or its cavity no room, a narrower one may.
void Adviser::add_holes() {
  const Print& print = print_of(asked_);
  Way way{ChangeKind::drain, "", {}, {}};
  if (print.drains.where == Drains::Where::found) {
    way.words = "narrower holes";
    for (const char* text : {"3", "2", "1"})
      if (const double mm = parse_number("drain-diameter", text); mm < 0.9 * print.drains.diameter_mm)
        way.ladder.push_back({std::string("holes of ") + text + " mm", {{"drain-diameter", text}}});
  } else if (print.liquid_g_cm3 > 0 && !print.drained && !print.drains.wanted()) {
    way.words = "holes by which it runs out";
    way.ladder.push_back({"holes by which the resin runs out, and plugs", {{"drain", "auto"}, {"plug", ""}}});
  }
  if (!way.ladder.empty()) ways_.push_back(std::move(way));
}

/// Thinner pillars take less room; without any the roofs are as the goal has them.
void Adviser::add_roofs() {
  const Print& print = print_of(asked_);
  if (print.self_supporting_deg == 0) return;
  Way way{ChangeKind::roof, "roofs that are not carried", {}, {}};
  if (print.min_feature_mm.value_or(0) > print.wall_mm) {
    const std::string text = shown(print.wall_mm, 3);
    way.ladder.push_back({"pillars of " + text + " mm", {{"min-feature", text}}});
  }
  if (!print.min_feature_mm) way.ladder.push_back({"roofs that are not carried", {{"self-supporting", "0"}}});
  if (!way.ladder.empty()) ways_.push_back(std::move(way));
}

/// Where pools stay as it is held, they may run out as it is held otherwise; other roofs are flat then.
void Adviser::add_print_directions() {
  const Print& print = print_of(asked_);
  if (print.drains.where != Drains::Where::found && print.self_supporting_deg == 0) return;
  ways_.push_back({ChangeKind::direction, "other ways to hold it in the printer", {}, [this](const Change& before) {
                     return print_direction(before);
                   }});
}

std::optional<Change> Adviser::print_direction(const Change& before) {
  const Eigen::Vector3d held = print_of(asked_).direction.value_or(up_of(asked_)).normalized();
  if (!in_reach(before)) return std::nullopt;  // something else is in the way
  HollowOptions fewer = options_;
  fewer.resolution = few_.resolution;
  fewer.as_printed = nullptr;
  for (const char* text : {"z", "-z", "x", "-x", "y", "-y"}) {
    const Change change{std::string("held with ") + text + " up in the printer", {{"print-direction", text}}};
    const Change there = combined(before, change);
    const bool is_another = print_of(spec_with(there)).direction->dot(held) < 0.999;
    if (is_another && is_made(there, fewer)) return change;
  }
  return std::nullopt;
}

/// The waterline that a search finds, where there is one; else one that leaves less dry than a search would.
void Adviser::add_waterlines() {
  ways_.push_back({ChangeKind::waterline, "other waterlines", {}, [this](const Change& before) { return waterline(before); }});
}

std::optional<Change> Adviser::waterline(const Change& before) {
  FloatSpec spec = std::get<FloatSpec>(spec_with(before));
  const bool given = spec.waterline_mm || spec.submerged_fraction || spec.submerged_volume_fraction;
  spec.waterline_mm.reset();
  spec.submerged_fraction.reset();
  spec.submerged_volume_fraction.reset();
  for (const double reserve : {spec.reserve, 0.03, search_.limits.least_reserve}) {
    if (!(reserve < spec.reserve || (given && reserve == spec.reserve))) continue;
    spec.reserve = reserve;
    try {
      const detail::Plan plan = detail::plan(mesh_with(before), spec, few_, quiet_);
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
  ways_.push_back({ChangeKind::point, spec.yoyo ? "other centres" : "parallel axes", {}, [this](const Change& before) {
                     return axis(before, false);
                   }});
  ways_.push_back({ChangeKind::tilt,
                   "axes tilted by up to " + number(search_.limits.tilt_deg, 0) + " degrees",
                   {},
                   [this](const Change& before) { return axis(before, true); }});
  if (spec.prefer == AxisClass::largest)
    ways_.push_back({ChangeKind::prefer,
                     "the axis of the smallest moment",
                     {{"spinning about the axis of its smallest moment", {{"prefer", "smallest"}}}},
                     {}});
}

/// The nearest axis, moved or tilted, about which it can spin.
std::optional<Change> Adviser::axis(const Change& before, bool tilt) {
  const SpinSpec spec = std::get<SpinSpec>(spec_with(before));
  const detail::Discretisation few = detail::discretisation(spec.print, few_);
  const Mesh outer = detail::stored(mesh_with(before), options_);
  try {
    const auto body = detail::body_about(detail::spin_frame(outer, spec, few, quiet_), outer, few, quiet_);
    const detail::SpinSearch search(*body, spec);
    const auto found =
        tilt ? search.smallest_tilt({}, search_.limits.tilt_deg * kDegree, quiet_) : search.nearest_point({}, quiet_);
    if (!found) return std::nullopt;
    const SpinFrame frame = detail::in_frame_given(found->first, *body);
    if (tilt)
      return Change{"the axis tilted by " + number(found->second / kDegree, 1) + " degrees", {{"up", vector_text(frame.up, 5)}}};
    return Change{"the axis moved by " + number(found->second, 2) + " mm",
                  {{spec.yoyo ? "center" : "point", vector_text(frame.contact_mm, 3)}}};
  } catch (const Error& error) {
    if (error.code() == ErrorCode::interrupted) throw;
    return std::nullopt;
  }
}

void Adviser::add_targets(const StandSpec& spec) {
  if (spec.target_mm || spec.objective != StandSpec::Objective::tip_angle)
    ways_.push_back({ChangeKind::point, "other targets", {{"the target where it is safest", {{"objective", "tip-angle"}}}}, {}});
  add_contacts(spec.contact_tolerance_mm);
}

/// The faces of its hull that it rolls to where it is let go as it shall stand.
void Adviser::add_faces(const PoseSpec& spec) {
  const Moments s = mesh_moments(mesh_);
  std::string text;
  double farthest = 0;
  for (const Pose& pose : spec.poses) {
    if (pose.kind != Pose::Kind::stands) continue;
    const Eigen::Vector3d up = pose.up_or(spec.up).normalized();
    const Eigen::Vector3d face = ground_rest(mesh_, s.segment<3>(MX) / s[M1], up).up;
    farthest = std::max(farthest, angle_between(face, up));
    text += (text.empty() ? "" : ";");
    for (int k = 0; k < 3; ++k) text += (k > 0 ? "," : "") + shown(std::abs(face[k]) < 1e-9 ? 0.0 : face[k], 8);
  }
  if (text.empty()) return;
  if (farthest > 1e-5)
    ways_.push_back(
        {ChangeKind::tilt,
         "the faces it rolls to",
         {{"standing on the faces it rolls to, " + number(farthest / kDegree, 1) + " degrees off at most", {{"stand", text}}}},
         {}});
  add_contacts(spec.contact_tolerance_mm);
}

void Adviser::add_contacts(const std::optional<double>& tolerance_mm) {
  Way way{ChangeKind::contact, "bases of up to " + number(search_.limits.contact_mm, 1) + " mm of give", {}, {}};
  const double height_mm = bounding_box(transformed(mesh_, working_frame(mesh_, up_of(asked_)))).sizes().z();
  const double asked_mm = tolerance_mm.value_or(contact_tolerance_mm(height_mm));
  for (const char* text : {"0.1", "0.2", "0.3", "0.5", "0.7", "1"})
    if (const double mm = parse_number("contact", text); mm > asked_mm && mm <= search_.limits.contact_mm && mm < 0.02 * height_mm)
      way.ladder.push_back({std::string("a base that gives way by ") + text + " mm", {{"contact", text}}});
  if (!way.ladder.empty()) ways_.push_back(std::move(way));
}

void Adviser::add_walls() {
  const Infill& infill = print_of(asked_).infill;
  const double least_mm = infill.wanted() ? infill.skin_mm() : std::max(size_mm_ / 500, search_.limits.thinnest_wall_mm - 1e-9);
  Way way{ChangeKind::wall, "walls down to " + number(search_.limits.thinnest_wall_mm, 1) + " mm", {}, {}};
  for (const char* text : {"12", "10", "8", "6", "5", "4", "3", "2.5", "2", "1.6", "1.2", "1", "0.8", "0.6", "0.5", "0.4"})
    if (const double mm = parse_number("wall", text); mm < print_of(asked_).wall_mm && mm > least_mm)
      way.ladder.push_back({std::string("a wall of ") + text + " mm", {{"wall", text}}});
  if (!way.ladder.empty()) ways_.push_back(std::move(way));
}

/// Less infill, then none: what a sparse region can do, a cavity can, and it can be lighter.
void Adviser::add_infill() {
  const Infill& infill = print_of(asked_).infill;
  if (!infill.wanted()) return;
  Way way{ChangeKind::infill, "less infill", {}, {}};
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
  Way way{ChangeKind::core, "heavy cores", {}, {}};
  for (const char* name : {"steel-shot", "tin", "bismuth-tin", "lead"})
    if (const CoreMaterial& m = core_material(name); m.density_g_cm3 > asked)
      way.ladder.push_back(
          {std::string("a core of ") + name + " (" + number(m.density_g_cm3, 2) + " g/cm3)", {{"core-material", name}}});
  if (!way.ladder.empty()) ways_.push_back(std::move(way));
}

/// Unit vectors at this angle from `up`, evenly around it.
std::vector<Eigen::Vector3d> ring(const Eigen::Vector3d& up, double angle_rad) {
  constexpr int kCount = 8;
  std::vector<Eigen::Vector3d> directions;
  for (int n = 0; n < kCount; ++n) {
    const double azimuth = 2 * std::numbers::pi * n / kCount;
    directions.push_back(tilt_by(up, angle_rad * Eigen::Vector2d(std::cos(azimuth), std::sin(azimuth))));
  }
  return directions;
}

Change tilted(const Eigen::Vector3d& up, double angle_rad) {
  return {"tilted by " + number(angle_rad / kDegree, 1) + " degrees", {{"up", vector_text(up, 5)}}};
}

/// The attitudes in which a body comes to rest when it is put down in many, by their angle from the attitude asked for. It does so
/// with the centre of mass of the solid, and with one that is lower by a tenth of the size, as it can be in what is hollowed.
const std::vector<Eigen::Vector3d>& Adviser::rests() {
  if (rests_) return *rests_;
  const Eigen::Vector3d up = up_of(asked_).normalized();
  const Moments s = mesh_moments(mesh_);
  const Eigen::Vector3d centre = s.segment<3>(MX) / s[M1];
  std::vector<Eigen::Vector3d> starts{up};
  for (const double degrees : {10, 20, 30, 60, 90, 120, 150, 180})
    for (const Eigen::Vector3d& direction : ring(up, degrees * kDegree)) starts.push_back(direction);
  std::vector<Eigen::Vector3d>& found = rests_.emplace();
  for (const Eigen::Vector3d& start : starts)
    for (const double lower : {0.0, 0.1}) {
      quiet_.check();
      const Eigen::Vector3d at = centre - lower * size_mm_ * start;
      const GroundRest rest = ground_rest(mesh_, at, start);
      constexpr double same = 0.02;
      const auto is_known = [&](const Eigen::Vector3d& other) { return angle_between(other, rest.up) < same; };
      if (rest.rests && std::none_of(found.begin(), found.end(), is_known)) found.push_back(rest.up);
    }
  std::stable_sort(found.begin(), found.end(), [&up](const auto& a, const auto& b) { return a.dot(up) > b.dot(up); });
  return found;
}

void Adviser::add_tilts() {
  if (!std::holds_alternative<FloatSpec>(asked_) && !std::holds_alternative<StandSpec>(asked_)) return;
  ways_.push_back(
      {ChangeKind::tilt, "tilts of up to " + number(search_.limits.tilt_deg, 0) + " degrees", {}, [this](const Change& before) {
         return std::holds_alternative<StandSpec>(asked_) ? tilt_to_stand(before) : tilt_to_float(before);
       }});
}

/// To the nearest attitude in which it rests by itself and can be made to stand.
std::optional<Change> Adviser::tilt_to_stand(const Change& before) {
  const Eigen::Vector3d up = up_of(asked_).normalized();
  for (const Eigen::Vector3d& rest : rests()) {
    const double angle_rad = angle_between(rest, up);
    if (angle_rad > search_.limits.tilt_deg * kDegree) break;
    if (const Change change = tilted(rest, angle_rad); angle_rad > 1e-6 && in_reach(combined(before, change))) return change;
  }
  return std::nullopt;
}

/// The first ring of attitudes with one in which it can float, and on the way to that one the least tilt that does.
std::optional<Change> Adviser::tilt_to_float(const Change& before) {
  const Eigen::Vector3d up = up_of(asked_).normalized();
  HollowOptions fewer = few_;  // there are many directions
  fewer.resolution = std::min(fewer.resolution, kFewestRays);
  double nearer_deg = 0;
  for (const double degrees : {5., 10., 20., 30.}) {
    if (degrees > search_.limits.tilt_deg) break;
    for (const Eigen::Vector3d& direction : ring(up, degrees * kDegree)) {
      const Change there = combined(before, tilted(direction, 0));
      if (!in_reach(there, fewer) || !in_reach(there)) continue;
      double lo = nearer_deg;
      double hi = degrees;
      const Eigen::Vector2d towards = (across(up).transpose() * direction).normalized();
      const auto at = [&](double deg) { return tilted(tilt_by(up, deg * kDegree * towards), deg * kDegree); };
      while (hi - lo > 1) {
        const double middle = 0.5 * (lo + hi);
        (in_reach(combined(before, at(middle))) ? hi : lo) = middle;
      }
      return at(hi);
    }
    nearer_deg = degrees;
  }
  return std::nullopt;
}

void Adviser::add_attitudes() {
  if (is_of_numbers(asked_)) return;
  ways_.push_back({ChangeKind::up, "the other sides up", {}, [this](const Change& before) { return attitude(before); }});
}

/// Another side up: one of the five others of the box, or one on which it rests; none of them is more than another.
std::optional<Change> Adviser::attitude(const Change& before) {
  const Eigen::Vector3d asked = up_of(asked_).normalized();
  for (const char* name : {"z", "y", "x", "-z", "-y", "-x"}) {
    if ((parse_direction(name) - asked).norm() <= 1e-6) continue;
    if (const Change change{std::string(name) + " pointing up", {{"up", name}}}; in_reach(combined(before, change))) return change;
  }
  if (!std::holds_alternative<StandSpec>(asked_)) return std::nullopt;
  for (const Eigen::Vector3d& rest : rests()) {
    if (angle_between(rest, asked) <= search_.limits.tilt_deg * kDegree) continue;
    if (const Change change{"another side up", {{"up", vector_text(rest, 5)}}}; in_reach(combined(before, change))) return change;
  }
  return std::nullopt;
}

void Adviser::add_flattening(const StandSpec& spec) {
  if (spec.flatten_mm > 0) return;
  const double height_mm = bounding_box(transformed(mesh_, working_frame(mesh_, spec.up))).sizes().z();
  const std::string most = number(search_.limits.flatten * height_mm, 2);
  ways_.push_back({ChangeKind::flatten, "cuts of up to " + most + " mm below", {}, [this, most](const Change& before) {
                     return flattening(before, most);
                   }});
}

/// The least cut below with which it stands.
std::optional<Change> Adviser::flattening(const Change& before, const std::string& most_mm) {
  quiet_.check();
  try {
    Spec cut = spec_with(before);
    set(cut, "flatten", most_mm);
    const detail::Plan plan = detail::plan(mesh_with(before), std::get<StandSpec>(cut), few_, quiet_);
    const double cut_mm = std::get<StandSpec>(plan.spec).flatten_mm;
    if (cut_mm == 0) return std::nullopt;
    const std::string text = number(std::ceil(100 * cut_mm) / 100, 2);
    return Change{text + " mm cut off below for a base", {{"flatten", text}}};
  } catch (const Error& error) {
    if (error.code() == ErrorCode::interrupted) throw;
    return std::nullopt;
  }
}

void Adviser::add_balls() {
  const Print& print = print_of(asked_);
  if (print.infill.wanted() || print.core.wanted() || print.balls.wanted()) return;
  if (is_of_numbers(asked_)) return;
  ways_.push_back(
      {ChangeKind::balls, "4, 8 and 16 balls of steel", {}, [this](const Change& before) { return steel_balls(before); }});
}

/// Balls of steel, as few as do. What a core of the same density cannot do they cannot either.
std::optional<Change> Adviser::steel_balls(const Change& before) {
  const Balls ball;
  if (!in_reach(combined(before, {"", {{"core-density", number(ball.density_g_cm3, 2)}}}))) return std::nullopt;
  HollowOptions few = few_;
  few.look_only = false;
  for (const char* count : {"4", "8", "16"})
    if (const Change change{count + (" balls of steel of " + number(ball.diameter_mm, 0) + " mm"), {{"balls", count}}};
        is_made(combined(before, change), few))
      return change;
  return std::nullopt;
}

/// Whether places or lengths of the spec are those of this size.
bool says_places(const Spec& asked) {
  if (const auto* spec = std::get_if<FloatSpec>(&asked)) return spec->waterline_mm.has_value();
  if (const auto* spec = std::get_if<SpinSpec>(&asked)) return spec->centre_mm || spec->axis.through == SpinAxis::Through::point;
  if (const auto* spec = std::get_if<StandSpec>(&asked)) return spec->target_mm.has_value();
  if (const auto* spec = std::get_if<PoseSpec>(&asked))
    return std::any_of(spec->poses.begin(), spec->poses.end(), [](const Pose& pose) {
      return pose.kind == Pose::Kind::hangs || pose.waterline_mm || pose.axis.through == SpinAxis::Through::point;
    });
  return !std::holds_alternative<DiceSpec>(asked);
}

void Adviser::add_sizes() {
  if (says_places(asked_) || !options_.fixed.empty()) return;
  Way way{ChangeKind::size, "sizes up to " + number(search_.limits.largest_size, 1) + " times this one", {}, {}};
  for (const double factor : {1.25, 1.5, 2., 2.5}) {
    if (factor > search_.limits.largest_size) continue;
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
    Way way{ChangeKind::material, lighter ? "lighter materials" : "heavier materials", {}, {}};
    for (const Material& m : nearest)
      if (m.name != "resin" && (lighter ? m.density_g_cm3 < asked - 1e-6 : m.density_g_cm3 > asked + 1e-6))
        way.ladder.push_back({"printed of " + m.name + " (" + number(m.density_g_cm3, 2) + " g/cm3)", {{"material", m.name}}});
    // A lighter print lets what is heavy in a die move its centre of mass farther.
    const bool loads = std::holds_alternative<DiceSpec>(asked_) && (print_of(asked_).core.wanted() || !options_.fixed.empty());
    const bool matters = std::holds_alternative<FloatSpec>(asked_) || std::holds_alternative<TargetSpec>(asked_) || loads;
    if (matters && !way.ladder.empty()) ways_.push_back(std::move(way));
  }
}

void Adviser::add_deformation() {
  if (is_of_numbers(asked_)) return;
  ways_.push_back({ChangeKind::deform,
                   "an outside moved by up to " + number(100 * search_.limits.deform, 0) + " % of the diagonal",
                   {},
                   [this](const Change&) { return deformation(); }});
}

/// The outside moved as little as makes the goal attainable.
std::optional<Change> Adviser::deformation() {
  try {
    const std::string most = number(search_.limits.deform * bounding_box(mesh_).diagonal().norm(), 2);
    DeformOptions how = search_.deform;
    how.limit_mm = parse_number("deform-limit", most);
    auto found = std::make_shared<const Deformation>(deform(mesh_, asked_, options_, how, quiet_));
    if (!found->changed) return std::nullopt;
    return Change{"the outside moved by up to " + number(found->largest_mm, 2) + " mm (" + number(found->rms_mm, 2) + " mm rms)",
                  {{"deform-limit", most}},
                  {},
                  std::move(found)};
  } catch (const Error& error) {
    if (error.code() == ErrorCode::interrupted) throw;
    return std::nullopt;
  }
}

}  // namespace

Advice suggest(const Mesh& mesh, const Spec& asked, const HollowOptions& options, const Search& search, const Progress& progress) {
  detail::check(options, asked);
  std::visit([](const auto& s) { check(s, Setting::For::making); }, asked);
  progress.begin("advice");
  return Adviser(mesh, asked, options, search, progress).run();
}

}  // namespace rayrep
