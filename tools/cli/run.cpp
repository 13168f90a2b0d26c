#include "run.h"

#include <sys/resource.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <iostream>
#include <system_error>

#include "rayrep/rayrep.h"
#include "summary.h"

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

/// A hidden file beside the output that becomes the output only when `commit` is called.
class PendingFile {
public:
  explicit PendingFile(const std::filesystem::path& target) : target_(target) {
    path_ =
        target.parent_path() / ("." + target.stem().string() + ".rayrep-" + std::to_string(getpid()) + target.extension().string());
  }
  ~PendingFile() {
    std::error_code ignored;
    if (!committed_) std::filesystem::remove(path_, ignored);
  }
  PendingFile(const PendingFile&) = delete;
  PendingFile& operator=(const PendingFile&) = delete;

  const std::filesystem::path& path() const { return path_; }

  /// As write_mesh, but speaks of the file the user named.
  void write(const Mesh& mesh) const {
    try {
      write_mesh(path_, mesh);
    } catch (const Error& error) {
      std::string text = error.what();
      if (const auto at = text.find(path_.string()); at != std::string::npos)
        text.replace(at, path_.string().size(), target_.string());
      throw Error(error.code(), text);
    }
  }

  void commit() {
    std::error_code error;
    std::filesystem::rename(path_, target_, error);
    if (error) throw Error(ErrorCode::write, "Cannot write '" + target_.string() + "': " + error.message() + ".");
    committed_ = true;
  }

private:
  std::filesystem::path target_;
  std::filesystem::path path_;
  bool committed_ = false;
};

struct ReadMesh {
  CheckedMesh checked;
  InputSummary summary;
};

/// Reads and checks in the file's own numbers, so that places are told in them, then scales to millimetres and to --size.
ReadMesh read(const std::filesystem::path& path, const Options& options, const CheckOptions& check, const Progress& progress) {
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
  if (!mesh.checked.report.usable) throw Error(ErrorCode::input, mesh.summary.path + ": " + mesh.checked.report.refusal);
}

template <typename Report>
void write_report(const Options& options, const Report& report) {
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
template <typename Report>
Report start_report(const Options& options, const ReadMesh& mesh, const char* command) {
  Report report;
  report.command = command;
  report.input = mesh.summary;
  report.options = options.in_force;
  report.goal.density_g_cm3 = options.density_g_cm3;
  report.goal.wall_mm = options.wall_mm;
  return report;
}

// The goals as given on the command line, for hollowing and for verifying. What is found from the mesh is filled in later.

FloatReport start_float(const Options& options, const ReadMesh& mesh, const char* command) {
  auto report = start_report<FloatReport>(options, mesh, command);
  report.goal.up = options.up;
  report.goal.fluid_g_cm3 = options.fluid_g_cm3;
  return report;
}

SpinReport start_spin(const Options& options, const ReadMesh& mesh, const char* command) {
  auto report = start_report<SpinReport>(options, mesh, command);
  report.goal.axis = options.up;
  report.goal.yoyo = options.yoyo;
  report.goal.prefer = options.largest ? AxisClass::largest : AxisClass::smallest;
  return report;
}

StandReport start_stand(const Options& options, const ReadMesh& mesh, const char* command) {
  auto report = start_report<StandReport>(options, mesh, command);
  report.goal.up = options.up;
  report.goal.contact_tolerance_mm = options.contact_mm;
  report.goal.target_mm = options.target_mm;
  return report;
}

TargetReport start_target(const Options& options, const ReadMesh& mesh, const char* command) {
  auto report = start_report<TargetReport>(options, mesh, command);
  report.goal.wanted = options.wanted;
  return report;
}

/// Writes the files for simulators that were asked for.
void write_inertial(const Options& options, const MassProperties& body) {
  if (!options.urdf.empty()) write_text_file(options.urdf, urdf_inertial(body));
  if (!options.mjcf.empty()) write_text_file(options.mjcf, mjcf_inertial(body));
}

/// A mesh that can be hollowed, with a note about what may surprise.
ReadMesh read_solid(const Options& options, const Progress& progress) {
  ReadMesh input = read(options.input, options, {}, progress);
  refuse_unusable(input);
  const MeshReport& check = input.checked.report;
  if (const std::size_t bodies = check.components - check.nested_components; bodies > 1 && !check.self_intersections)
    input.summary.notes.push_back("There are " + std::to_string(bodies) +
                                  " bodies that do not touch each other. All figures treat them as one rigid body.");
  return input;
}

HollowOptions hollow_options(const Options& options) {
  HollowOptions hollow;
  hollow.up = options.up;
  hollow.wall_mm = options.wall_mm;
  hollow.density_g_cm3 = options.density_g_cm3;
  hollow.resolution = options.resolution;
  hollow.solver = options.solver;
  hollow.as_stored = [&options](const Mesh& mesh) { return as_stored(options.output, mesh); };
  return hollow;
}

/// Writes the hollowed mesh beside its final place, has it judged as re-read from disk, and puts it in place if it passes.
/// @param judge  fills report.before and report.after from the delivered mesh
template <typename Report, typename Judge>
void deliver(const Options& options, Report& report, const Judge& judge, Stages& stages, const Progress& progress) {
  HollowResult& hollow = report.result.hollow;
  report.hollowed = true;
  report.delivered_triangles = hollow.delivered.triangles.size();
  progress.begin("write");
  PendingFile pending(options.output);
  pending.write(hollow.delivered);
  hollow.delivered = {};

  progress.begin("verify");
  judge(read_mesh(pending.path()).mesh);
  report.timings_s = stages.finish();
  report.peak_memory_mb = peak_memory_mb();
  if (!report.after.pass()) {
    write_report(options, report);
    if (!options.quiet) std::cout << summary(report, options.verbose);
    throw Error(ErrorCode::goal, "The hollowed mesh does not meet the goal " + failures(report.after, "; nothing was written."));
  }
  pending.commit();
  report.output = options.output.string();
  write_report(options, report);
  if (options.quiet) return;
  char took[32];
  std::snprintf(took, sizeof took, "%.2f", report.timings_s.back().second);
  std::cout << summary(report, options.verbose) << "VERIFIED: wrote " << report.output << ", " << report.delivered_triangles
            << " triangles, in " << took << " s\n";
}

void run_float(const Options& options, Stages& stages, const Progress& progress) {
  const ReadMesh input = read_solid(options, progress);
  const Mesh& solid = input.checked.mesh;
  FloatOptions float_options;
  float_options.hollow = hollow_options(options);
  float_options.fluid_g_cm3 = options.fluid_g_cm3;
  float_options.waterline_mm = options.waterline_mm;
  float_options.submerged_fraction = options.submerged_fraction;
  FloatReport report = start_float(options, input, "float");
  report.result = hollow_float(solid, float_options, progress);
  report.goal.waterline_mm = report.result.waterline_mm;
  const auto judge = [&](const Mesh& delivered) {
    report.after = verify_float(delivered, &solid, report.goal, report.limits, progress);
    report.before = float_state(solid, report.goal, report.limits, true, progress);
  };
  deliver(options, report, judge, stages, progress);
}

void run_spin(const Options& options, Stages& stages, const Progress& progress) {
  const ReadMesh input = read_solid(options, progress);
  const Mesh& solid = input.checked.mesh;
  SpinOptions spin;
  spin.hollow = hollow_options(options);
  spin.axis = options.axis;
  spin.yoyo = options.yoyo;
  spin.centre_mm = options.centre_mm;
  spin.largest = options.largest;
  spin.weights = options.weights;
  spin.bounds = options.bounds;
  spin.max_tilt_rad = options.max_tilt_rad;
  spin.certify = options.certify;
  SpinReport report = start_spin(options, input, "spin");
  report.result = hollow_spin(solid, spin, progress);
  report.goal.axis = report.result.up;
  report.goal.contact_mm = report.result.contact_mm;
  const auto judge = [&](const Mesh& delivered) {
    report.after = verify_spin(delivered, &solid, report.goal, report.limits, progress);
    report.before = spin_state_of(solid, report.goal, progress);
  };
  deliver(options, report, judge, stages, progress);
}

void run_stand(const Options& options, Stages& stages, const Progress& progress) {
  const ReadMesh input = read_solid(options, progress);
  const Mesh& solid = input.checked.mesh;
  StandOptions stand;
  stand.hollow = hollow_options(options);
  stand.objective = options.tip_angle ? StandOptions::Objective::tip_angle : StandOptions::Objective::lowest;
  stand.target_mm = options.target_mm;
  stand.contact_tolerance_mm = options.contact_mm;
  StandReport report = start_stand(options, input, "stand");
  report.result = hollow_stand(solid, stand, progress);
  report.goal.target_mm = report.result.target_mm;
  const auto judge = [&](const Mesh& delivered) {
    report.after = verify_stand(delivered, &solid, report.goal, report.limits, progress);
    report.before = stand_state_of(solid, report.goal, progress);
  };
  deliver(options, report, judge, stages, progress);
}

void run_target(const Options& options, Stages& stages, const Progress& progress) {
  const ReadMesh input = read_solid(options, progress);
  const Mesh& solid = input.checked.mesh;
  TargetOptions target;
  target.hollow = hollow_options(options);
  target.wanted = options.wanted;
  target.order = options.order;
  TargetReport report = start_target(options, input, "target");
  report.result = hollow_target(solid, target, progress);
  const auto judge = [&](const Mesh& delivered) {
    report.after = verify_target(delivered, &solid, report.goal, report.limits, progress);
    report.before = target_state_of(solid, report.goal, progress);
  };
  deliver(options, report, judge, stages, progress);
  write_inertial(options, report.after.state.body);
}

/// A mesh to be judged, and the surface it must have outside if one was given.
struct Judged {
  ReadMesh input;
  std::optional<ReadMesh> original;

  const Mesh& mesh() const { return input.checked.mesh; }
  const Mesh* original_mesh() const { return original ? &original->checked.mesh : nullptr; }
};

double waterline(const Options& options, const Judged& judged, const Progress& progress) {
  if (options.waterline_mm) return *options.waterline_mm;
  const Mesh standing = transformed(judged.mesh(), working_frame(judged.mesh(), options.up));
  if (options.submerged_fraction) return *options.submerged_fraction * bounding_box(standing).sizes().z();
  refuse_unusable(judged.input);
  const Mesh hull = boundary_of_union(outer_hull(standing), progress);
  const double displaced_mm3 =
      mesh_moments(boundary_of_union(standing, progress))[M1] * options.density_g_cm3 / options.fluid_g_cm3;
  return waterline_for_volume(hull, Eigen::Vector3d::UnitZ(), displaced_mm3);
}

/// Contact point of a top, centre of a yo-yo.
Eigen::Vector3d spin_point(const Options& options, const Judged& judged, const Progress& progress) {
  if (options.yoyo) return options.centre_mm.value_or(bounding_box(judged.mesh()).center());
  if (options.axis.through != SpinAxis::Through::centre_of_mass)
    return contact_point(judged.mesh(), options.axis, options.up, progress);
  if (judged.original) return contact_point(*judged.original_mesh(), options.axis, options.up, progress);
  refuse_unusable(judged.input);
  return contact_point(outer_hull(judged.mesh()), options.axis, options.up, progress);
}

/// Tells what `report.after` says.
template <typename Report>
void conclude(const Options& options, Report& report, Stages& stages) {
  report.before = report.after.state;
  report.timings_s = stages.finish();
  report.peak_memory_mb = peak_memory_mb();
  write_report(options, report);
  if (!options.quiet) std::cout << summary(report, options.verbose);
  if (!report.after.pass()) throw Error(ErrorCode::goal, "It does not meet the goal " + failures(report.after, "."));
  if (!options.quiet) std::cout << "VERIFIED\n";
}

void run_verify(const Options& options, Stages& stages, const Progress& progress) {
  const CheckOptions check{.self_intersections = false};
  // What rayrep has written is in millimetres and of its final size; unit and size are then those of what it was made from.
  Options as_written = options;
  if (!options.original.empty()) {
    as_written.unit = LengthUnit::millimetre;
    as_written.size_mm.reset();
  }
  Judged judged{read(options.input, as_written, check, progress), {}};
  if (!options.original.empty()) {
    judged.original = read(options.original, options, check, progress);
    refuse_unusable(*judged.original);
  }
  if (options.goal == Command::spin) {
    SpinReport report = start_spin(options, judged.input, "verify");
    report.goal.contact_mm = spin_point(options, judged, progress);
    progress.begin("verify");
    report.after = verify_spin(judged.mesh(), judged.original_mesh(), report.goal, report.limits, progress);
    conclude(options, report, stages);
  } else if (options.goal == Command::stand) {
    StandReport report = start_stand(options, judged.input, "verify");
    progress.begin("verify");
    report.after = verify_stand(judged.mesh(), judged.original_mesh(), report.goal, report.limits, progress);
    conclude(options, report, stages);
  } else if (options.goal == Command::target) {
    TargetReport report = start_target(options, judged.input, "verify");
    progress.begin("verify");
    report.after = verify_target(judged.mesh(), judged.original_mesh(), report.goal, report.limits, progress);
    conclude(options, report, stages);
  } else {
    FloatReport report = start_float(options, judged.input, "verify");
    report.goal.waterline_mm = waterline(options, judged, progress);
    progress.begin("verify");
    report.after = verify_float(judged.mesh(), judged.original_mesh(), report.goal, report.limits, progress);
    conclude(options, report, stages);
  }
}

void run_inspect(const Options& options, Stages& stages, const Progress& progress) {
  const ReadMesh input = read(options.input, options, {}, progress);
  std::optional<MassProperties> mass;
  double area_mm2 = 0;
  if (input.checked.report.usable) {
    const Mesh boundary = boundary_of_union(input.checked.mesh, progress);
    mass = mass_properties(mesh_moments(boundary), options.density_g_cm3);
    for (std::size_t t = 0; t < boundary.triangles.size(); ++t)
      area_mm2 += 0.5 * (boundary.corner(t, 1) - boundary.corner(t, 0)).cross(boundary.corner(t, 2) - boundary.corner(t, 0)).norm();
  }
  stages.finish();
  if (options.json)
    std::cout << to_json(input.summary, options.density_g_cm3, area_mm2, mass ? &*mass : nullptr);
  else if (!options.quiet)
    std::cout << summary(input.summary, options.density_g_cm3, area_mm2, mass ? &*mass : nullptr);
  refuse_unusable(input);
  write_inertial(options, *mass);
}

/// Finds out before the work that an output cannot be written.
void require_folder(const std::filesystem::path& output) {
  if (output.empty()) return;
  std::error_code ignored;
  const std::filesystem::path folder = output.has_parent_path() ? output.parent_path() : ".";
  if (!std::filesystem::is_directory(folder, ignored))
    throw Error(ErrorCode::write, "Cannot write '" + output.string() + "': there is no folder '" + folder.string() + "'.");
  if (std::filesystem::is_directory(output, ignored))
    throw Error(ErrorCode::write, "Cannot write '" + output.string() + "': it is a folder.");
  if (access(folder.c_str(), W_OK) != 0)
    throw Error(ErrorCode::write, "Cannot write '" + output.string() + "': the folder '" + folder.string() + "' is not writable.");
}

}  // namespace

void run(const Options& options, const std::function<bool()>& cancelled) {
  std::optional<tbb::global_control> limit;
  if (options.threads > 0) limit.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(options.threads));
  require_folder(options.output);
  for (const auto& text : {options.report, options.urdf, options.mjcf}) require_folder(text);
  Stages stages(options);
  Progress progress;
  progress.stage = [&stages](std::string_view name) { stages.begin(name); };
  progress.cancelled = cancelled;
  switch (options.command) {
    case Command::float_upright:
      run_float(options, stages, progress);
      break;
    case Command::spin:
      run_spin(options, stages, progress);
      break;
    case Command::stand:
      run_stand(options, stages, progress);
      break;
    case Command::target:
      run_target(options, stages, progress);
      break;
    case Command::verify:
      run_verify(options, stages, progress);
      break;
    case Command::inspect:
      run_inspect(options, stages, progress);
      break;
    case Command::help:
      std::cout << options.help_text;
      break;
    case Command::version:
      std::cout << "rayrep " << version() << "\n";
      break;
  }
  if (!std::cout.flush()) throw Error(ErrorCode::write, "Cannot write to standard output.");
}

}  // namespace rayrep::tool
