#include "scene.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "rayrep/base/error.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/io/write_file.h"
#include "rayrep/judge/verify_mechanism.h"
#include "rayrep/make/balance.h"
#include "rayrep/motion/carve.h"
#include "rayrep/motion/gltf.h"
#include "rayrep/motion/motion_check.h"
#include "rayrep/motion/resolve.h"
#include "rayrep/motion/scene.h"
#include "rayrep/motion/urdf.h"
#include "rayrep/report/balance_report.h"
#include "rayrep/report/motion_report.h"
#include "rayrep/report/scene_page.h"

namespace rayrep::tool {
namespace {

/// @throws Error{input} for one that is not usable, with all that is wrong
Scene usable_scene(const Options& options, const Progress& progress) {
  progress.begin("read");
  SceneFile file = read_scene(options.input, progress);
  require_scene(file, options.input.string());
  if (options.verbose)
    for (const std::string& note : file.notes) std::cerr << "rayrep: " << printable(note) << std::endl;
  return std::move(file.scene);
}

MotionCheckOptions check_options(const Options& options) {
  MotionCheckOptions how;
  how.tolerance = options.scene.tolerance;
  how.clearance_mm = options.scene.clearance_mm;
  return how;
}

bool only_near(const PairMotion& pair) {
  return std::all_of(pair.intervals.begin(), pair.intervals.end(), [&pair](const CollisionInterval& one) {
    return one.kind != CollisionInterval::Kind::overlap || one.only_near(pair.clearance_mm);
  });
}

/// "parts get into each other: bench and table (fold); parts come nearer than they may: lid and box (open)"
std::string colliding(const Scene& scene, const MotionReport& report) {
  std::array<std::string, 2> names;
  for (const PairMotion& pair : report.pairs) {
    if (!pair.overlaps()) continue;
    std::string& list = names[only_near(pair) ? 1 : 0];
    list += (list.empty() ? "" : ", ") + scene.parts[pair.first].name + " and " + scene.parts[pair.second].name + " (" +
            scene.transitions[pair.transition].name + ")";
  }
  const std::string into = names[0].empty() ? "" : "parts get into each other: " + names[0];
  const std::string near = names[1].empty() ? "" : "parts come nearer than they may: " + names[1];
  return into + (into.empty() || near.empty() ? "" : "; ") + near;
}

}  // namespace

namespace {

/// Of a part: its name with what files are not to be called by replaced, and a number where that is taken.
std::filesystem::path file_of(const std::string& part, const std::vector<std::filesystem::path>& taken) {
  std::string name;
  for (const char c : part) name += std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '_' ? c : '_';
  std::filesystem::path file = name + ".stl";
  for (int n = 2; std::find(taken.begin(), taken.end(), file) != taken.end(); ++n) file = name + "_" + std::to_string(n) + ".stl";
  return file;
}

/// Writes meshes beside the scene, all or none, and the scene that names them.
void write_with_meshes(Scene& scene, const std::filesystem::path& path) {
  std::vector<std::filesystem::path> files;
  std::vector<std::unique_ptr<PendingFile>> pending;
  for (ScenePart& part : scene.parts) {
    files.push_back(file_of(path.stem().string() + "_" + part.name, files));
    part.file = path.parent_path() / files.back();
    part.mesh = std::make_shared<const Mesh>(as_stored(part.file, *part.mesh));
    pending.push_back(std::make_unique<PendingFile>(part.file));
    pending.back()->write({{{*part.mesh}}});
  }
  for (const auto& file : pending) file->commit();
  write_text_file(path, scene_text(scene, path));
}

/// @throws Error{input} when something is wrong with it
void check_and_tell(SceneFile& file, const std::string& name, const Options& options, Stages& stages, const Progress& progress) {
  if (file.problems.empty()) {
    progress.begin("check");
    file.problems = misplaced(file.scene, progress);
  }
  stages.finish();
  if (options.json)
    std::cout << to_json(file, name);
  else if (!options.quiet)
    std::cout << printable(to_text(file, name));
  std::cout.flush();
  if (file.problems.empty()) return;
  const std::size_t count = file.problems.size();
  const bool imported = options.scene.action == "import";
  const std::string things = std::to_string(count) + (count == 1 ? " thing is" : " things are");
  throw Error(ErrorCode::input, name + ": " + things + " wrong with this scene" + (imported ? ", which is written." : ".") +
                                    (options.json || !options.quiet ? "" : " " + file.problems[0].message));
}

}  // namespace

namespace {

void run_export(const Options& options, Stages& stages, const Progress& progress) {
  SceneFile file = read_scene(options.input, progress);
  require_scene(file, options.input.string());
  progress.begin("write");
  write_text_file(options.output, to_glb(file.scene));
  stages.finish();
  if (options.json)
    std::cout << to_json(file, options.input.string());
  else if (!options.quiet)
    std::cout << printable(options.output.string()) << ": " << file.scene.parts.size() << " parts, "
              << file.scene.transitions.size() << (file.scene.transitions.size() == 1 ? " animation" : " animations") << " of "
              << kGltfSeconds << " s\n";
}

}  // namespace

void run_scene(const Options& options, Stages& stages, const Progress& progress) {
  progress.begin("read");
  if (options.scene.action == "check") {
    SceneFile file = read_scene(options.input, progress);
    return check_and_tell(file, options.input.string(), options, stages, progress);
  }
  if (options.scene.action == "export") return run_export(options, stages, progress);
  SceneFile file = import_urdf(options.input, {.visual = options.scene.visual}, progress);
  progress.begin("write");
  write_with_meshes(file.scene, options.output);
  check_and_tell(file, options.output.string(), options, stages, progress);
}

namespace {

ResolveOptions resolve_options(const Options& options) {
  ResolveOptions how;
  how.check = check_options(options);
  how.parts = options.scene.free;
  return how;
}

void tell(const Options& options, const Scene& scene, const MotionReport& report) {
  if (options.json)
    std::cout << to_json(scene, report);
  else if (!options.quiet)
    std::cout << printable(to_text(scene, report));
  if (options.html.empty()) return;
  const std::filesystem::path& shown = options.scene.resolve ? options.output : options.input;
  write_text_file(options.html, to_html(scene, report, {shown.string(), options.scene.tolerance}));
}

/// What overlaps as an error, once it has been told.
void require_free(const Options& options, const Scene& scene, const MotionReport& report) {
  std::cout.flush();
  if (!report.free()) throw Error(ErrorCode::goal, options.input.string() + ": " + colliding(scene, report) + ".");
}

/// Writes a scene in which nothing overlaps, or less does.
void run_resolve(const Options& options, const Scene& scene, Stages& stages, const Progress& progress) {
  progress.begin("resolve");
  const Resolved resolved = resolve(scene, resolve_options(options), progress);
  write_text_file(options.output, scene_text(resolved.scene, options.output));
  stages.finish();
  tell(options, resolved.scene, resolved.report);
  if (!options.json && !options.quiet)
    std::cout << printable(options.output.string()) << ": after " << resolved.steps
              << (resolved.steps == 1 ? " step\n" : " steps\n");
  require_free(options, resolved.scene, resolved.report);
}

}  // namespace

void run_motion(const Options& options, Stages& stages, const Progress& progress) {
  const Scene scene = usable_scene(options, progress);
  if (options.scene.resolve) return run_resolve(options, scene, stages, progress);
  progress.begin("check");
  MotionCheckOptions how = check_options(options);
  if (options.verbose)
    how.found = [&](const MotionReport& report) {
      if (report.stage == MotionReport::Stage::coarse) progress.begin("when");
    };
  const MotionReport report = MotionChecker().check(scene, how, progress);
  std::vector<Hint> found;
  if (options.scene.hint && !report.free()) {
    progress.begin("hints");
    found = hints(scene, resolve_options(options), progress);
  }
  stages.finish();
  tell(options, scene, report);
  if (options.scene.hint && !options.quiet) std::cout << printable(to_text(with_middle_keys(scene), found));
  require_free(options, scene, report);
}

void run_carve(const Options& options, Stages& stages, const Progress& progress) {
  const Scene scene = usable_scene(options, progress);
  const std::size_t part = scene.part(options.scene.part), by = scene.part(options.scene.by);
  CarveOptions how;
  how.clearance_mm = options.scene.clearance_mm.value_or(scene.clearance_mm > 0 ? scene.clearance_mm : how.clearance_mm);
  how.tolerance_mm = options.scene.carve_tolerance_mm;
  how.float32 = ending_of(options.output) == ".stl";
  const Carving carving = carve(scene, part, by, how, progress);
  if (carving.bodies == 0)
    throw Error(ErrorCode::goal, options.scene.by + " goes through all of " + options.scene.part + ": nothing is left of it.");
  progress.begin("write");
  write_mesh(options.output, carving.left);
  stages.finish();
  if (options.json)
    std::cout << to_json(scene.parts[part].name, scene.parts[by].name, options.output.string(), carving);
  else if (!options.quiet)
    std::cout << printable(to_text(scene.parts[part].name, scene.parts[by].name, options.output.string(), carving));
}

namespace {

HollowOptions making_options(const Options& options) {
  HollowOptions making = options.hollow;
  making.as_stored = [](const Mesh& mesh) { return as_stored("part.stl", mesh); };
  return making;
}

/// @throws Error{goal} that names what fails
void require_pass(const Options& options, const BalanceReport& report) {
  if (report.verdict.pass()) return;
  std::string names;
  std::size_t n = 0;
  for (const MechanismPart& part : report.mechanism.parts)
    if (part.printed && !report.verdict.parts[n++].pass()) names += (names.empty() ? "part " : ", part ") + part.name;
  for (std::size_t k = 0; k < report.verdict.states.size(); ++k)
    if (!report.verdict.states[k].pass()) names += (names.empty() ? "state " : ", state ") + report.mechanism.states[k].name;
  throw Error(ErrorCode::goal, options.input.string() + ": NOT VERIFIED (" + names + ").");
}

void tell(const Options& options, const BalanceReport& report) {
  if (options.json)
    std::cout << to_json(report);
  else if (!options.quiet)
    std::cout << printable(to_text(report));
  std::cout.flush();
}

/// Makes the parts, writes them beside their places, judges what stands there, and puts it in place when it is good.
void balance_and_write(const Options& options, const Scene& scene, BalanceReport& report, const Progress& progress) {
  const Mechanism asked = report.mechanism;
  report.made = balance(asked, making_options(options), progress);
  std::error_code error;
  std::filesystem::create_directories(options.output, error);
  if (error) throw Error(ErrorCode::write, "Cannot make the folder '" + options.output.string() + "': " + error.message() + ".");
  std::vector<std::filesystem::path> files;
  std::vector<std::unique_ptr<PendingFile>> pending;
  Scene balanced = scene;
  progress.begin("write");
  for (const BalancedPart& made : report.made->parts) {
    files.push_back(file_of(asked.parts[made.part].name, files));
    pending.push_back(std::make_unique<PendingFile>(options.output / files.back()));
    pending.back()->write(made.delivery);
    report.mechanism.parts[made.part].mesh = read_mesh(pending.back()->path()).mesh;
    balanced.parts[made.part].file = options.output / files.back();
  }
  progress.begin("verify");
  std::vector<const Mesh*> originals;
  for (const MechanismPart& part : asked.parts) originals.push_back(&part.mesh);
  report.verdict = verify(report.mechanism, originals, {}, progress);
  if (!report.verdict.pass()) return;
  for (std::size_t n = 0; n < pending.size(); ++n) {
    pending[n]->commit();
    report.outputs.push_back((options.output / files[n]).string());
  }
  const std::filesystem::path path = options.output / options.input.filename();
  write_text_file(path, scene_text(balanced, path));
  report.outputs.push_back(path.string());
}

/// The page of what was judged: its ways are looked at, too.
void write_page(const Options& options, Scene scene, const BalanceReport& report, const Progress& progress) {
  progress.begin("check");
  if (report.made)
    for (std::size_t p = 0; p < scene.parts.size(); ++p)
      scene.parts[p].mesh = std::make_shared<const Mesh>(report.mechanism.parts[p].mesh);
  const MotionReport motion = MotionChecker().check(scene, check_options(options), progress);
  const std::string name = report.outputs.empty() ? options.input.string() : report.outputs.back();
  write_text_file(options.html, to_html(scene, motion, {name, options.scene.tolerance, &report}));
}

}  // namespace

void run_balance(const Options& options, Stages& stages, const Progress& progress) {
  const Scene scene = usable_scene(options, progress);
  // What is in one place twice would count twice.
  require_scene({scene, misplaced(scene, progress), {}}, options.input.string());
  BalanceReport report{options.input.string(), mechanism_of(scene), {}, {}, {}};
  if (options.scene.as_is) {
    progress.begin("verify");
    report.verdict = verify(report.mechanism, std::vector<const Mesh*>(report.mechanism.parts.size(), nullptr), {}, progress);
  } else {
    balance_and_write(options, scene, report, progress);
  }
  if (!options.html.empty()) write_page(options, scene, report, progress);
  stages.finish();
  tell(options, report);
  require_pass(options, report);
  if (!options.quiet && !options.json)
    std::cout << "VERIFIED" << (report.outputs.empty() ? "" : ": wrote " + printable(report.outputs.back())) << std::endl;
}

}  // namespace rayrep::tool
