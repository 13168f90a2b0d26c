#include "scene.h"

#include <iostream>
#include <string>
#include <utility>

#include "rayrep/base/error.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/io/write_file.h"
#include "rayrep/motion/carve.h"
#include "rayrep/motion/motion_check.h"
#include "rayrep/motion/scene.h"
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

/// "bench and table (fold), lid and box (open)"
std::string colliding(const Scene& scene, const MotionReport& report) {
  std::string names;
  for (const PairMotion& pair : report.pairs)
    if (pair.overlaps())
      names += (names.empty() ? "" : ", ") + scene.parts[pair.first].name + " and " + scene.parts[pair.second].name + " (" +
               scene.transitions[pair.transition].name + ")";
  return names;
}

}  // namespace

void run_scene(const Options& options, Stages& stages, const Progress& progress) {
  progress.begin("read");
  SceneFile file = read_scene(options.input, progress);
  if (file.problems.empty()) {
    progress.begin("check");
    file.problems = misplaced(file.scene, progress);
  }
  stages.finish();
  if (options.json)
    std::cout << to_json(file, options.input.string());
  else if (!options.quiet)
    std::cout << printable(to_text(file, options.input.string()));
  std::cout.flush();
  if (file.problems.empty()) return;
  const std::size_t count = file.problems.size();
  throw Error(ErrorCode::input, options.input.string() + ": " + std::to_string(count) + (count == 1 ? " thing is" : " things are") +
                                    " wrong with this scene." +
                                    (options.json || !options.quiet ? "" : " " + file.problems[0].message));
}

void run_motion(const Options& options, Stages& stages, const Progress& progress) {
  const Scene scene = usable_scene(options, progress);
  progress.begin("check");
  MotionCheckOptions how = check_options(options);
  if (options.verbose)
    how.found = [&](const MotionReport& report) {
      if (report.stage == MotionReport::Stage::coarse) progress.begin("when");
    };
  const MotionReport report = MotionChecker().check(scene, how, progress);
  stages.finish();
  if (options.json)
    std::cout << to_json(scene, report);
  else if (!options.quiet)
    std::cout << printable(to_text(scene, report));
  std::cout.flush();
  if (!options.html.empty())
    write_text_file(options.html, to_html(scene, report, {options.input.string(), options.scene.tolerance}));
  if (!report.free())
    throw Error(ErrorCode::goal, options.input.string() + ": parts get into each other: " + colliding(scene, report) + ".");
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

}  // namespace rayrep::tool
