#include "run.h"

#include <sys/resource.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <cstdio>
#include <iostream>
#include <system_error>

#include "rayrep/rayrep.h"

namespace rayrep::tool {
namespace {

using Clock = std::chrono::steady_clock;

double seconds(Clock::duration d) { return std::chrono::duration<double>(d).count(); }

/// Notes how long each stage takes and shows it on a terminal.
class Stages {
public:
  explicit Stages(const Options& options)
      : verbose_(options.verbose && !options.quiet), live_(!options.quiet && isatty(STDERR_FILENO)) {}
  ~Stages() { clear_line(); }
  Stages(const Stages&) = delete;
  Stages& operator=(const Stages&) = delete;

  void begin(std::string_view name) {
    end();
    current_ = name;
    started_ = Clock::now();
    if (verbose_)
      std::cerr << "rayrep: " << current_ << std::endl;
    else if (live_)
      std::cerr << "\r\033[K" << current_ << " ..." << std::flush;
  }

  /// Stages and their seconds in order of first occurrence, then "total".
  std::vector<std::pair<std::string, double>> finish() {
    end();
    current_.clear();
    clear_line();
    auto result = spent_;
    result.emplace_back("total", seconds(Clock::now() - born_));
    return result;
  }

private:
  void end() {
    if (current_.empty()) return;
    const double took = seconds(Clock::now() - started_);
    const auto known = std::find_if(spent_.begin(), spent_.end(), [this](const auto& s) { return s.first == current_; });
    if (known == spent_.end())
      spent_.emplace_back(current_, took);
    else
      known->second += took;
  }
  void clear_line() const {
    if (live_ && !verbose_) std::cerr << "\r\033[K" << std::flush;
  }

  bool verbose_;
  bool live_;
  std::string current_;
  Clock::time_point born_ = Clock::now();
  Clock::time_point started_;
  std::vector<std::pair<std::string, double>> spent_;
};

double peak_memory_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

struct ReadMesh {
  CheckedMesh checked;
  InputSummary summary;
};

/// Reads and checks in the file's own numbers, so that places are told in them, then scales to millimetres and to --size.
ReadMesh read(const std::filesystem::path& path, const Options& options, CheckOptions check, const Progress& progress) {
  check.repair = options.repair;
  progress.begin("read");
  const MeshFile file = read_mesh(path);
  ReadMesh result;
  InputSummary& summary = result.summary;
  progress.begin("check");
  result.checked = check_mesh(file.mesh, check, progress);
  Mesh& mesh = result.checked.mesh;
  const bool own_unit = file.format == "3MF";  // already applied by the reader
  summary.mm_per_unit = own_unit ? file.mm_per_unit : millimetres(options.unit);
  double factor = own_unit ? 1 : summary.mm_per_unit;
  const Eigen::AlignedBox3d box = bounding_box(mesh);
  if (!box.isEmpty()) {
    const double longest = factor * box.sizes().maxCoeff();
    if (options.size_mm && longest > 0 && std::isfinite(longest)) {
      summary.scale = *options.size_mm / longest;
      factor *= summary.scale;
    }
    summary.size_mm = factor * box.sizes();
  }
  if (factor != 1)
    for (auto& v : mesh.vertices) v *= factor;
  summary.path = path.string();
  summary.format = file.format;
  summary.notes = file.notes;
  summary.check = result.checked.report;
  summary.vertices = mesh.vertices.size();
  summary.triangles = mesh.triangles.size();
  return result;
}

void refuse_unusable(const ReadMesh& mesh) {
  const MeshReport& report = mesh.checked.report;
  if (report.usable) return;
  std::vector<std::string> remedies;
  if (report.repairable) remedies.emplace_back("--repair");
  throw Error(ErrorCode::input, mesh.summary.path + ": " + report.refusal, remedies);
}

void write_report(const Options& options, const RunReport& report) {
  if (!options.report.empty()) write_text_file(options.report, to_json(report));
}

/// What failed and the judge's explanation, for the message that goes with exit code 4: "(NAMES)END EXPLANATION".
std::string failures(const Verdict& verdict, const std::string& end) {
  std::string text;
  for (const Criterion& c : verdict.criteria)
    if (!c.pass()) text += (text.empty() ? "(" : ", ") + c.name;
  text += ")" + end;
  for (const std::string& note : verdict.notes) text += " " + note;
  return text;
}

/// What is known of a run before its goal is looked at.
RunReport start_report(const Options& options, const ReadMesh& mesh) {
  RunReport report;
  report.command = options.word;
  report.input = mesh.summary;
  report.options = options.in_force;
  return report;
}

/// Writes the files for simulators that were asked for.
void write_inertial(const Options& options, const MassProperties& body) {
  if (!options.urdf.empty()) write_text_file(options.urdf, urdf_inertial(body));
  if (!options.mjcf.empty()) write_text_file(options.mjcf, mjcf_inertial(body));
}

/// @throws Error{input} for a mesh of several bodies, unless something is said to hold them together
void refuse_loose_bodies(const Options& options, ReadMesh& mesh, const Progress& progress) {
  const int bodies = bodies_of(mesh.checked.mesh, progress).count;
  if (bodies < 2) return;
  const std::string count = "There are " + std::to_string(bodies) + " bodies that do not touch each other";
  if (!options.rigid)
    throw Error(ErrorCode::input,
                mesh.summary.path + ": " + count +
                    ": each would float, spin or stand by itself. Save each as a file of its own, or say --rigid if "
                    "something holds them together.");
  mesh.summary.notes.push_back(count + ": taken as one rigid body, as --rigid says.");
}

/// A mesh that can be hollowed.
ReadMesh read_solid(const Options& options, const Progress& progress) {
  ReadMesh input = read(options.input, options, {}, progress);
  refuse_unusable(input);
  refuse_loose_bodies(options, input, progress);
  return input;
}

/// Writes the hollowed mesh beside its final place, has it judged as re-read from disk, and puts it in place if it passes.
void deliver(const Options& options, const Mesh& solid, RunReport& report, Stages& stages, const Progress& progress) {
  HollowResult& hollow = *report.hollow;
  progress.begin("write");
  PendingFile pending(options.output);
  {
    const Mesh body = hollow.delivery.body();
    report.delivered_triangles = body.triangles.size();
    hollow.delivery = {};
    pending.write(body);
  }
  progress.begin("verify");
  report.after = verify(read_mesh(pending.path()).mesh, &solid, hollow.spec, {}, progress);
  report.before = state_figures(solid, hollow.spec, {}, progress);
  report.timings_s = stages.finish();
  report.peak_memory_mb = peak_memory_mb();
  if (!report.after.pass()) {
    write_report(options, report);
    if (!options.quiet) std::cout << to_text(report, options.verbose);
    throw Error(ErrorCode::goal, "The hollowed mesh does not meet the goal " + failures(report.after, "; nothing was written."));
  }
  std::error_code ignored;
  const bool replaced = std::filesystem::exists(options.output, ignored);
  pending.commit();
  report.output = options.output.string();
  write_report(options, report);
  if (options.quiet) return;
  std::cout << to_text(report, options.verbose);
  if (options.verbose) {
    const bool alike = report.input.scale != 1 || report.input.mm_per_unit == 1 || report.input.format == "3MF";
    std::cout << "\nto judge it again: " << judging_command(options, hollow.spec, report.output, alike) << "\n";
  }
  char took[32];
  std::snprintf(took, sizeof took, "%.2f", report.timings_s.back().second);
  std::cout << "VERIFIED: wrote " << report.output << ", " << report.delivered_triangles << " triangles, in " << took << " s"
            << (replaced ? "; it replaced the file that was there" : "") << "\n";
}

/// Finds out before the work that STL, which stores float32, cannot hold the wall so far from the origin.
void require_room_for_wall(const Options& options, const Mesh& solid) {
  std::string ending = options.output.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
  const Eigen::AlignedBox3d box = bounding_box(solid);
  const double wall_mm = print_of(options.spec).wall_mm;
  if (ending != ".stl" || float32_holds_wall(box, wall_mm)) return;
  char text[256];
  std::snprintf(text, sizeof text,
                "So far from the origin the numbers of an STL file (float32) lie %.3g mm apart: too far for a wall of %.3g mm. "
                "Write .3mf or .obj, which keep doubles (-o), or move the body to the origin.",
                float32_spacing_mm(box), wall_mm);
  throw Error(ErrorCode::input, text);
}

void run_hollow(const Options& options, Stages& stages, const Progress& progress) {
  const ReadMesh input = read_solid(options, progress);
  const Mesh& solid = input.checked.mesh;
  require_room_for_wall(options, solid);
  RunReport report = start_report(options, input);
  HollowOptions how = options.hollow;
  how.as_stored = [&options](const Mesh& mesh) { return as_stored(options.output, mesh); };
  report.hollow = hollow(solid, options.spec, how, progress);
  deliver(options, solid, report, stages, progress);
  write_inertial(options, report.after.body);
}

void run_verify(const Options& options, Stages& stages, const Progress& progress) {
  const CheckOptions check{.self_intersections = false};
  // What rayrep has written is in millimetres and of its final size; unit and size are then those of what it was made from.
  Options as_written = options;
  if (!options.original.empty()) {
    as_written.unit = LengthUnit::millimetre;
    as_written.size_mm.reset();
  }
  ReadMesh input = read(options.input, as_written, check, progress);
  if (input.checked.report.usable) refuse_loose_bodies(options, input, progress);
  std::optional<ReadMesh> original;
  if (!options.original.empty()) {
    original = read(options.original, options, check, progress);
    refuse_unusable(*original);
    if (original->checked.report.first_aid)
      for (const std::string& note : original->checked.report.notes) input.summary.notes.push_back("Of --original: " + note);
  }
  RunReport report = start_report(options, input);
  progress.begin("verify");
  try {
    report.after = verify(input.checked.mesh, original ? &original->checked.mesh : nullptr, options.spec, {}, progress);
  } catch (const Error& error) {
    // The check says better than the judge what is wrong with a mesh that has no inside.
    if (error.code() == ErrorCode::input) refuse_unusable(input);
    throw;
  }
  report.timings_s = stages.finish();
  report.peak_memory_mb = peak_memory_mb();
  write_report(options, report);
  if (!options.quiet) std::cout << to_text(report, options.verbose);
  if (!report.after.pass()) throw Error(ErrorCode::goal, "It does not meet the goal " + failures(report.after, "."));
  if (!options.quiet) std::cout << "VERIFIED\n";
}

void run_inspect(const Options& options, Stages& stages, const Progress& progress) {
  const ReadMesh input = read(options.input, options, {}, progress);
  std::optional<MassProperties> mass;
  double area_mm2 = 0;
  if (input.checked.report.usable) {
    const Mesh boundary = boundary_of_union(input.checked.mesh, progress);
    mass = mass_properties(boundary, options.print.density_g_cm3);
    for (std::size_t t = 0; t < boundary.triangles.size(); ++t)
      area_mm2 += 0.5 * (boundary.corner(t, 1) - boundary.corner(t, 0)).cross(boundary.corner(t, 2) - boundary.corner(t, 0)).norm();
  }
  stages.finish();
  const Inspection inspection{input.summary, options.print.density_g_cm3, area_mm2, mass ? &*mass : nullptr};
  if (options.json)
    std::cout << to_json(inspection);
  else if (!options.quiet)
    std::cout << to_text(inspection);
  refuse_unusable(input);
  write_inertial(options, *mass);
}

/// Finds out before the work that an output cannot be written. What is text may go to a device, such as /dev/stdout.
void require_outputs(const Options& options) {
  if (!options.output.empty()) require_writable(options.output);
  for (const auto& text : {options.report, options.urdf, options.mjcf}) {
    std::error_code ignored;
    const bool device = std::filesystem::exists(text, ignored) && !std::filesystem::is_regular_file(text, ignored) &&
                        !std::filesystem::is_directory(text, ignored);
    if (!text.empty() && !device) require_writable(text);
  }
}

}  // namespace

void run(const Options& options, const std::function<bool()>& cancelled) {
  std::optional<tbb::global_control> limit;
  if (options.threads > 0) limit.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(options.threads));
  require_outputs(options);
  Stages stages(options);
  Progress progress;
  progress.stage = [&stages](std::string_view name) { stages.begin(name); };
  progress.cancelled = cancelled;
  switch (options.command) {
    case Command::hollow:
      run_hollow(options, stages, progress);
      break;
    case Command::verify:
      run_verify(options, stages, progress);
      break;
    case Command::inspect:
      run_inspect(options, stages, progress);
      break;
    case Command::text:
      std::cout << options.text;
      break;
  }
  if (!std::cout.flush()) throw Error(ErrorCode::write, "Cannot write to standard output.");
}

}  // namespace rayrep::tool
