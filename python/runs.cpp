#include "runs.h"

#include <sys/resource.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <set>
#include <sstream>

#include "measure.h"

namespace rayrep::python {
namespace {

using tool::Options;

constexpr CheckOptions kChecksToJudge{.self_intersections = false, .unite = false};
constexpr CheckOptions kChecksOfOriginal{.self_intersections = false};
constexpr ReadOptions kAnySize{.memory_bytes = std::numeric_limits<std::size_t>::max()};

std::optional<tbb::global_control> limit_threads(const Options& options) {
  std::optional<tbb::global_control> limit;
  if (options.threads > 0) limit.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(options.threads));
  return limit;
}

double peak_memory_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

/// A mesh that runs work on, and what reports say of it.
struct Input {
  CheckedMesh checked;
  std::vector<Part> modifiers = {};
  std::vector<Part> pieces = {};
  std::vector<Part> inserts = {};
  InputSummary summary = {};
};

void scale(Input& input, double factor) {
  if (factor == 1) return;
  for (auto& v : input.checked.mesh.vertices) v *= factor;
  for (std::vector<Part>* parts : {&input.modifiers, &input.pieces, &input.inserts})
    for (Part& part : *parts) {
      for (auto& v : part.mesh.vertices) v *= factor;
      part.to_bed.translation() *= factor;
    }
}

/// Brings it to --unit and --size.
/// @param own_unit  it is in mm already, of a file's own unit or because it has been read before
void fit(Input& input, const Options& options, bool own_unit) {
  double factor = own_unit ? 1 : millimetres(options.unit);
  if (const Eigen::AlignedBox3d box = bounding_box(input.checked.mesh); !box.isEmpty()) {
    const double longest = factor * box.sizes().maxCoeff();
    if (options.size_mm && longest > 0 && std::isfinite(longest)) {
      input.summary.scale *= *options.size_mm / longest;
      factor *= *options.size_mm / longest;
    }
    input.summary.size_mm = factor * box.sizes();
  }
  scale(input, factor);
  if (input.checked.report.usable) require_size(input.checked.mesh, input.summary.path);
}

Input input_of(const Body& body, const Options& options, const CheckOptions& check, const Progress& progress) {
  Input input{.checked = {body.mesh, {}}, .modifiers = body.modifiers};
  const bool known = body.source && !(options.repair && !body.source->check.usable);
  if (known) input.summary = *body.source;
  if (!known) {
    progress.begin("check");
    input.checked = check_mesh(body.mesh, check, progress);
    input.summary.check = input.checked.report;
    input.summary.path = body.name;
    input.summary.vertices = input.checked.mesh.vertices.size();
    input.summary.triangles = input.checked.mesh.triangles.size();
    input.summary.mm_per_unit = millimetres(options.unit);
  }
  input.checked.report = input.summary.check;
  fit(input, options, body.source.has_value());
  return input;
}

Input read(const std::filesystem::path& path, const Options& options, CheckOptions check, const Progress& progress) {
  check.repair = options.repair;
  progress.begin("read");
  MeshFile file = read_mesh(path, {.memory_bytes = options.memory_bytes});
  progress.begin("check");
  Input input{.checked = check_mesh(file.mesh, check, progress),
              .modifiers = std::move(file.modifiers),
              .pieces = std::move(file.pieces),
              .inserts = std::move(file.inserts)};
  const bool own_unit = file.format == "3MF";  // applied by the reader
  InputSummary& summary = input.summary;
  summary.path = path.string();
  summary.format = file.format;
  summary.mm_per_unit = own_unit ? file.mm_per_unit : millimetres(options.unit);
  summary.notes = file.notes;
  summary.check = input.checked.report;
  summary.vertices = input.checked.mesh.vertices.size();
  summary.triangles = input.checked.mesh.triangles.size();
  fit(input, options, own_unit);
  return input;
}

Input input_for(const std::optional<Body>& body, const std::filesystem::path& path, const Options& options, CheckOptions check,
                const Progress& progress) {
  check.repair = options.repair;
  Input input = body ? input_of(*body, options, check, progress) : read(path, options, check, progress);
  if (!input.modifiers.empty() && options.command != tool::Command::verify)
    input.summary.notes.emplace_back(
        "The infill of modifiers is not counted here: the body is taken as solid. 'rayrep verify' counts it.");
  return input;
}

std::string named(const InputSummary& summary) { return summary.path.empty() ? "The mesh" : summary.path; }

void refuse_unusable(const Input& input) {
  if (!input.checked.report.usable) throw Error(ErrorCode::input, named(input.summary) + ": " + input.checked.report.refusal);
}

void refuse_loose_bodies(const Options& options, Input& input, const Progress& progress) {
  const int bodies = bodies_of(input.checked.mesh, progress).count;
  if (bodies < 2) return;
  const std::string count = "There are " + std::to_string(bodies) + " bodies that do not touch each other";
  if (!options.rigid)
    throw Error(ErrorCode::input, named(input.summary) + ": " + count +
                                      ": each would float, spin or stand by itself. Treat those of split() one by one, or say "
                                      "--rigid if something holds them together.");
  input.summary.notes.push_back(count + ": taken as one rigid body, as --rigid says.");
}

Input solid_for(const Options& options, const Given& given, const Progress& progress) {
  Input input = input_for(given.body, options.input, options, {}, progress);
  refuse_unusable(input);
  refuse_loose_bodies(options, input, progress);
  return input;
}

std::vector<Part> fixed_parts(const Options& options, const Given& given, const Progress& progress, tool::Notes* notes = nullptr) {
  std::vector<Part> parts = tool::read_fixed(options, progress, notes);
  for (Part part : given.fixed) {
    part.mesh = require_solid(part.mesh, "What is fixed in the body", kChecksOfOriginal, progress).mesh;
    parts.push_back(std::move(part));
  }
  return parts;
}

RunReport start_report(const Options& options, const Input& input) {
  RunReport report;
  report.command = options.word;
  report.input = input.summary;
  report.options = options.in_force;
  report.changed = options.changed;
  return report;
}

HollowOptions hollow_options(const Options& options, const std::vector<Part>& fixed, const Progress& progress,
                             tool::Notes* notes = nullptr) {
  HollowOptions how = options.hollow;
  how.keep_solid = tool::read_kept_solid(options, progress, notes);
  for (const Part& part : fixed) how.fixed.push_back({part});
  how.as_stored = [&options](const Mesh& mesh) { return as_stored(options.output, mesh); };
  return how;
}

DeformOptions deform_options(const Options& options, const Given& given, const Progress& progress, tool::Notes* notes = nullptr) {
  DeformOptions how = options.deform;
  for (const auto& path : options.deform_fixed) how.fixed.emplace_back(tool::read_closed(path, options, progress, notes));
  how.fixed.insert(how.fixed.end(), given.deform_fixed.begin(), given.deform_fixed.end());
  return how;
}

void require_room_for_wall(const Options& options, const Mesh& solid) {
  const Eigen::AlignedBox3d box = bounding_box(solid);
  const double wall_mm = print_of(options.spec).wall_mm;
  if (tool::ending_of(options.output) != ".stl" || float32_holds_wall(box, wall_mm)) return;
  throw Error(ErrorCode::input,
              "So far from the origin the numbers of an STL file (float32) lie too far apart for this wall. Say "
              "format='3mf' or 'obj', which keep doubles, or move the body to the origin.");
}

/// A mesh as it comes back from a file like that of the result.
Mesh stored(const Mesh& mesh, const Options& options, const TemporaryFolder& folder) {
  const std::filesystem::path path = folder.path() / ("stored" + options.output.extension().string());
  write_mesh(path, mesh);
  return read_mesh(path, kAnySize).mesh;
}

/// What was made as it comes back from its file, with what is put in: the user's own, then what was made for it.
Delivery read_back(const Options& options, const Outcome& outcome, RunReport& report, std::size_t given_inserts,
                   const TemporaryFolder& folder) {
  const std::filesystem::path path = folder.path() / ("made" + options.output.extension().string());
  write_delivery(path, outcome.made, options.flavor);
  Delivery judged = tool::delivery_of(read_mesh(path, kAnySize), print_of(report.hollow->spec).infill.percent_laid_down);
  Part made{{}, Part::Role::insert, options.insert_density()};
  for (const Part& part : outcome.made.parts) {
    if (part.role != Part::Role::insert || in_pieces(outcome.made)) continue;
    if (given_inserts > 0) {
      --given_inserts;
      judged.parts.push_back(part);
    } else {
      append(made.mesh, part.mesh);
    }
  }
  if (const Mesh plugs = outcome.made.mesh_of(Part::Role::plug); !plugs.triangles.empty()) {
    report.plugs = {"", connected_components(with_merged_vertices(plugs)).count};
    if (!options.plug_output.empty()) judged.parts.push_back({.mesh = stored(plugs, options, folder), .role = Part::Role::plug});
  }
  if (made.mesh.triangles.empty()) return judged;
  made.mesh = stored(made.mesh, options, folder);
  report.insert = {"", mass_properties(made.mesh, made.density_g_cm3), connected_components(with_merged_vertices(made.mesh)).count};
  judged.parts.push_back(std::move(made));
  return judged;
}

std::string text_in(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

Outcome hollow_once(Options options, const Given& given, const Progress& progress) {
  const Input input = solid_for(options, given, progress);
  require_room_for_wall(options, input.checked.mesh);
  Outcome outcome{start_report(options, input), options.spec, input.checked.mesh};
  RunReport& report = outcome.report;
  outcome.stored_as = tool::ending_of(options.output);
  outcome.flavor = options.flavor;
  const std::vector<Part> fixed = fixed_parts(options, given, progress, &report.input.notes);
  HollowOptions how = hollow_options(options, fixed, progress, &report.input.notes);
  const TemporaryFolder folder;
  std::optional<tool::SlicedBodies> sliced;
  const std::string gcode = options.gcode.filename().string();
  if (!options.slicer.program.empty() || !options.as_sliced.empty()) {
    options.gcode = folder.path() / "print.gcode";
    sliced.emplace(options, progress);
    how.as_printed = [&sliced](const Delivery& delivery) { return sliced->slice(delivery); };
  }
  Mesh outside = outcome.given;
  if (options.deform.limit_mm) {
    const Deformation deformation =
        options.outside
            ? *options.outside
            : deform(outside, options.spec, how, deform_options(options, given, progress, &report.input.notes), progress);
    if (deformation.changed) {
      outcome.outside = outside = as_stored(options.output, deformation.mesh);
      report.outside = {"", deformation.figures(), deformation.words()};
    }
  }
  report.hollow = hollow(outside, options.spec, how, progress);
  progress.begin("write");
  outcome.made = std::move(report.hollow->delivery);
  report.hollow->delivery = {};
  report.delivered_triangles = outcome.made.solid().triangles.size();
  report.pauses_mm = outcome.made.pauses_mm;
  outcome.judged = read_back(options, outcome, report, fixed.size(), folder);
  const Mesh original = report.outside ? stored(outside, options, folder) : outside;
  progress.begin("verify");
  const Spec& spec = report.hollow->spec;
  report.after =
      sliced ? sliced->judged(outcome.judged, original, report, progress) : verify(outcome.judged, &original, spec, {}, progress);
  tool::judge_kept({options, outcome.judged, &original}, spec, report.after, progress);
  report.before = state_figures(original, spec, {}, progress);
  if (sliced && report.after.pass()) {
    sliced->deliver(report.hollow->best_slice);
    if (!options.slicer.program.empty()) outcome.gcode = text_in(options.gcode);
  }
  if (report.print) report.print->path = gcode;
  report.peak_memory_mb = peak_memory_mb();
  return outcome;
}

Outcome verify_printed(const Options& options, const Given& given, const Progress& progress) {
  const Input original = input_for(given.original, options.original, options, kChecksOfOriginal, progress);
  refuse_unusable(original);
  Outcome outcome{start_report(options, original), options.spec, original.checked.mesh};
  RunReport& report = outcome.report;
  progress.begin("measure");
  report.print = tool::measured(options, &outcome.given, named(original.summary));
  Spec spec = options.spec;
  print_of(spec).density_g_cm3 = report.print->density_g_cm3;
  progress.begin("verify");
  outcome.judged = {fixed_parts(options, given, progress, &report.input.notes)};
  if (!options.plugs.empty())
    for (Part& part : tool::read_plugs(options.plugs)) outcome.judged.parts.push_back(std::move(part));
  report.after = tool::verify_print_with(outcome.judged, outcome.given, *report.print, spec, progress);
  outcome.judged.parts.push_back({.mesh = outcome.given});
  report.peak_memory_mb = peak_memory_mb();
  return outcome;
}

Options options_of(const Words& words) {
  std::vector<const char*> arguments{"rayrep"};
  for (const std::string& word : words) arguments.push_back(word.c_str());
  return tool::parse_command_line(static_cast<int>(arguments.size()), arguments.data());
}

/// The words with those of a change in place of their own.
Words changed(const Words& words, const Suggestion& change) {
  std::vector<const char*> arguments{"rayrep"};
  for (const std::string& word : words) arguments.push_back(word.c_str());
  Words result = tool::suggested(static_cast<int>(arguments.size()), arguments.data(), change);
  result.erase(result.begin());
  return result;
}

Advice advise(const Options& options, const Given& given, Search search, const Progress& progress) {
  const Input input = solid_for(options, given, progress);
  search.deform = deform_options(options, given, progress);
  return suggest(input.checked.mesh, options.spec, hollow_options(options, fixed_parts(options, given, progress), progress), search,
                 progress);
}

/// With the least change that --allow lets. @throws Error{goal} when none does
Outcome hollow_changed(const Words& words, const Options& options, const Given& given, const std::string& refusal,
                       const Progress& progress) {
  std::optional<Outcome> outcome;
  Search search;
  search.kinds = options.allow;
  search.first_only = true;
  search.deliver = [&](const Suggestion& change) {
    try {
      Options other = options_of(changed(words, change));
      other.changed = change.change;
      other.outside = change.outside;
      outcome = hollow_once(std::move(other), given, progress);
      return outcome->report.after.pass();
    } catch (const Error& error) {
      if (error.code() == ErrorCode::interrupted || error.code() == ErrorCode::write) throw;
      return false;
    }
  };
  const Advice advice = advise(options, given, search, progress);
  if (advice.suggestions.empty() || !outcome)
    throw Error(ErrorCode::goal, refusal + " Nothing that --allow lets change does: tried " + advice.tried + ".");
  return std::move(*outcome);
}

/// The original, with bodies of it that overlap made one as for a maker, unless those of what is judged were left as they are.
Input original_of(const Options& options, const Given& given, const Input& judged, const Progress& progress) {
  Input original = input_for(given.original, options.original, options, kChecksOfOriginal, progress);
  return tool::overlaps_stand(original.checked, judged.checked.mesh, progress)
             ? input_for(given.original, options.original, options, kChecksToJudge, progress)
             : original;
}

}  // namespace

Defaults defaults_of(const std::string& word, const std::string& goal) {
  for (const tool::Syntax& syntax : tool::commands()) {
    if (syntax.word != word) continue;
    if (syntax.command != tool::Command::verify) return {tool::defaults_of(syntax), &syntax};
    for (Options& options : tool::defaults_of_all_goals(syntax))
      if (options.goal == goal) return {std::move(options), &syntax};
  }
  throw Error(ErrorCode::usage, "There is no command '" + word + "' with a goal '" + goal + "'.");
}

Body load(const Words& words, const Progress& progress) {
  const Options options = options_of(words);
  if (options.command == tool::Command::measure)
    throw Error(ErrorCode::usage, "'" + options.input.string() + "' is a file for a printer: measure() reads it.");
  Input input = read(options.input, options, {}, progress);
  return {std::move(input.checked.mesh), options.input.string(), std::move(input.modifiers), std::move(input.summary)};
}

Body checked(const Body& body, const CheckOptions& check, const Progress& progress) {
  Options options;
  options.repair = check.repair;
  Input input = input_of({body.mesh, body.name, body.modifiers}, options, check, progress);
  return {std::move(input.checked.mesh), body.name, std::move(input.modifiers), std::move(input.summary)};
}

Outcome hollow(const Words& words, const Given& given, const Progress& progress) {
  const Options options = options_of(words);
  const auto limit = limit_threads(options);
  std::string refusal;
  try {
    Outcome outcome = hollow_once(options, given, progress);
    if (outcome.report.after.pass() || options.allow.empty()) return outcome;
    refusal = "The hollowed mesh does not meet the goal.";
  } catch (const Error& error) {
    if (error.code() != ErrorCode::goal || options.allow.empty()) throw;
    refusal = error.what();
  }
  return hollow_changed(words, options, given, refusal, progress);
}

Advice advise(const Words& words, const Given& given, const Progress& progress) {
  const Options options = options_of(words);
  const auto limit = limit_threads(options);
  Search search;
  search.kinds = options.allow;
  return advise(options, given, search, progress);
}

Outcome verify(const Words& words, const Given& given, const Progress& progress) {
  const Options options = options_of(words);
  const auto limit = limit_threads(options);
  if (!given.body && is_printed(options.input)) return verify_printed(options, given, progress);
  // What rayrep has written is in millimetres and of its final size; unit and size are then those of what it was made from.
  Options as_written = options;
  const bool has_original = given.original || !options.original.empty();
  if (has_original) {
    as_written.unit = LengthUnit::millimetre;
    as_written.size_mm.reset();
  }
  Input input = input_for(given.body, options.input, as_written, kChecksToJudge, progress);
  if (input.checked.report.usable && input.pieces.empty()) refuse_loose_bodies(options, input, progress);
  std::optional<Input> original;
  if (has_original) {
    original = original_of(options, given, input, progress);
    refuse_unusable(*original);
    if (original->checked.report.first_aid)
      for (const std::string& note : original->checked.report.notes) input.summary.notes.push_back("Of --original: " + note);
  }
  Outcome outcome{start_report(options, input), options.spec};
  if (original) outcome.given = original->checked.mesh;
  progress.begin("verify");
  try {
    outcome.judged = tool::delivery_of({.mesh = input.checked.mesh,
                                        .format = "",
                                        .notes = {},
                                        .modifiers = input.modifiers,
                                        .pieces = input.pieces,
                                        .inserts = input.inserts},
                                       print_of(options.spec).infill.percent_laid_down);
    for (Part& part : fixed_parts(options, given, progress, &outcome.report.input.notes))
      outcome.judged.parts.push_back(std::move(part));
    if (!options.plugs.empty())
      for (Part& part : tool::read_plugs(options.plugs)) outcome.judged.parts.push_back(std::move(part));
    outcome.report.after = verify(outcome.judged, original ? &outcome.given : nullptr, options.spec, {}, progress);
    tool::judge_kept({options, outcome.judged, original ? &outcome.given : nullptr, &outcome.report.input.notes}, options.spec,
                     outcome.report.after, progress);
  } catch (const Error& error) {
    // The check says better than the judge what is wrong with a mesh that has no inside.
    if (error.code() == ErrorCode::input) refuse_unusable(input);
    throw;
  }
  outcome.report.peak_memory_mb = peak_memory_mb();
  return outcome;
}

Measurement measure(const Words& words, const Given& given, const Progress& progress) {
  const Options options = options_of(words);
  std::optional<Input> mesh;
  if (given.original || !options.original.empty()) {
    mesh = input_for(given.original, options.original, options, kChecksOfOriginal, progress);
    refuse_unusable(*mesh);
  }
  progress.begin("measure");
  return tool::measured(options, mesh ? &mesh->checked.mesh : nullptr, mesh ? named(mesh->summary) : "");
}

Looked inspect(const Words& words, const Given& given, const Progress& progress) {
  const Options options = options_of(words);
  const auto limit = limit_threads(options);
  const Input input = input_for(given.body, options.input, options, {}, progress);
  Looked looked{input.summary, options.print.density_g_cm3, 0, {}};
  if (!input.checked.report.usable) return looked;
  const Mesh boundary = boundary_of_union(input.checked.mesh, progress);
  looked.mass = mass_properties(boundary, looked.density_g_cm3);
  looked.area_mm2 = surface_area(boundary);
  return looked;
}

std::string picture(const Outcome& outcome, const std::string& ending, const std::string& plane, const Progress& progress) {
  const RunReport& report = outcome.report;
  if (report.print && !report.hollow)
    throw Error(ErrorCode::usage, "What a nozzle lays down is drawn by 'rayrep view': here are no pictures of it.");
  const Mesh body = outcome.judged.body();
  Marks marks = marks_of(body, outcome.spec, report.after.body, progress);
  if (!outcome.given.triangles.empty())
    marks.centre_before_mm = mass_properties(boundary_of_union(outcome.given, progress), 1).centre_of_mass_mm;
  const Subject subject{outcome.judged, marks, std::filesystem::path(report.input.path).filename().string()};
  const Mesh* before = outcome.given.triangles.empty() ? nullptr : &outcome.given;
  const Mesh* deformed = outcome.outside.triangles.empty() ? nullptr : &outcome.outside;
  const Drawing drawing =
      plane.empty() ? body_drawing({subject, before, deformed}) : section_drawing(subject, parse_section_plane(plane));
  return ending == ".png" ? to_png(drawing) : to_svg(drawing);
}

void export_to(const std::filesystem::path& path, const Outcome& outcome) {
  const std::string ending = tool::ending_of(path);
  const bool rounds = ending == ".stl" && outcome.stored_as != ".stl" && !is_float32(outcome.made.solid());
  if (rounds)
    throw Error(ErrorCode::usage, "It was judged with the digits that " + outcome.stored_as +
                                      " keeps; STL rounds them. Hollow it with format='stl', or end '" + path.string() + "' in " +
                                      outcome.stored_as + ".");
  Delivery delivery = outcome.made;
  if (outcome.stored_as == ".stl")
    for (Part& part : delivery.parts) part.mesh = as_stored("x.stl", part.mesh);
  if (can_write_infill(path)) delivery.thumbnail_png = thumbnail_png(delivery, up_of(outcome.spec));
  PendingFile pending(path);
  pending.write(delivery, outcome.flavor);
  pending.commit();
}

std::vector<Found> judged_by(const Outcome& outcome) {
  const Spec& spec = outcome.spec;
  const auto* spin = std::get_if<SpinSpec>(&spec);
  const std::string goal = spin && spin->yoyo ? "yoyo" : std::visit([](const auto& s) { return std::string(s.kGoal); }, spec);
  Defaults now = defaults_of("verify", goal);
  Defaults usual = defaults_of("verify", goal);
  now.options.spec = spec;
  const std::vector<tool::Group> found = now.groups();
  const std::vector<tool::Group> before = usual.groups();
  struct Value {
    const Setting& setting;
    std::variant<double, bool, std::string> operator()(const double* place) const { return *place; }
    std::variant<double, bool, std::string> operator()(const std::optional<double>* place) const { return **place; }
    std::variant<double, bool, std::string> operator()(const int* place) const { return static_cast<double>(*place); }
    std::variant<double, bool, std::string> operator()(const bool* place) const { return *place; }
    std::variant<double, bool, std::string> operator()(const TextPlace&) const { return shown(setting); }
  };
  static const std::set<std::string> kOther = {"quiet,q", "verbose,v", "help,h"};
  std::vector<Found> result;
  for (std::size_t g = 0; g < found.size(); ++g)
    for (std::size_t n = 0; n < found[g].settings.size(); ++n) {
      const Setting& setting = found[g].settings[n];
      if (kOther.contains(setting.name) || shown(setting) == shown(before[g].settings[n])) continue;
      result.push_back({setting.name, std::visit(Value{setting}, setting.place)});
    }
  return result;
}

}  // namespace rayrep::python
