#include "tables.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <stdexcept>

#include "cavities.h"
#include "overhang.h"
#include "problem.h"
#include "rayrep/base/error.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/judge/verify.h"
#include "rayrep/print/slicer.h"
#include "rayrep/rays/ray_interior.h"
#include "rayrep/rays/voxel_interior.h"
#include "rayrep/solve/certify.h"
#include "rayrep/solve/nlp.h"
#include "rayrep/solve/solve_octree.h"
#include "whole_run.h"

namespace rayrep::bench {
namespace {

const char* const kTop = "lowest";
const char* const kThroughCentre = "com";

SpinSpec top(const std::string& point) {
  SpinSpec spec;
  if (point == kThroughCentre) spec.axis.through = SpinAxis::Through::centre_of_mass;
  return spec;
}

/// A thicker wall needs a coarser grid for the cavity: most of the time at small resolutions.
constexpr double kQuickWall_mm = 2;

HollowOptions at(int resolution) {
  HollowOptions options;
  options.resolution = resolution;
  return options;
}

/// As tables measure it: quick ones with a thicker wall.
Spec walled(Spec spec, const TableOptions& table) {
  if (table.quick) std::visit([](auto& s) { s.print.wall_mm = kQuickWall_mm; }, spec);
  return spec;
}

// Where Ipopt's barrier stops, see tuned(): the objective may be off by 0.5 % in the papers' tables, by 1e-5 in the table of
// shapes.
constexpr double kBarrierForSpeed = 1e-4;
constexpr double kBarrierForQuality = 1e-5;

Limits limits_of(const TableOptions& options) {
  Limits limits;
  limits.cap_s = options.cap_s;
  return limits;
}

/// Collects the records of one table.
class Collector {
public:
  Collector(std::string table, const TableOptions& options) : table_(std::move(table)), options_(options) {}

  Record& add(Record record) {
    record.table = table_;
    records_.push_back(std::move(record));
    if (options_.each) options_.each(records_.back());
    return records_.back();
  }
  std::vector<Record> take() { return std::move(records_); }

private:
  std::string table_;
  const TableOptions& options_;
  std::vector<Record> records_;
};

/// Measures methods at growing resolutions; one that met the time cap or the limit on variables is not tried on larger problems.
class Series {
public:
  Series(Collector& collector, const Limits& limits) : collector_(collector), limits_(limits) {}

  void measure_next(const Problem& problem, const std::vector<Method>& methods) {
    const InteriorSolver::Setup setup = tuned(problem, kBarrierForSpeed);
    for (const Method method : methods) {
      if (!given_up_.contains(method)) {
        const Record& r = collector_.add(measure(problem, method, limits_, &setup));
        if (r.status == "capped" || r.status == "skipped") given_up_.insert(method);
        continue;
      }
      Record skipped;
      skipped.mesh = problem.mesh;
      skipped.goal = problem.goal_name;
      skipped.solver = name(method);
      skipped.resolution = problem.resolution;
      skipped.intervals = static_cast<long long>(problem.plan.body->inner.rays.intervals.size());
      skipped.status = "skipped";
      skipped.note = "a coarser one was already too large";
      collector_.add(skipped);
    }
  }

private:
  Collector& collector_;
  Limits limits_;
  std::set<Method> given_up_;
};

std::vector<Record> table1(const TableOptions& options) {
  Collector collector("table1", options);
  for (const PaperRow& row : paper_table1()) {
    const bool spin = std::string(row.goal) == "spin";
    std::vector<Shape> shapes;
    for (const std::string& file : row.stand_ins) shapes.push_back({options.examples / file});
    if (!options.meshes.empty() && std::string(row.model) == "Duck") shapes.push_back({options.meshes / "duck.obj"});
    if (!options.meshes.empty() && std::string(row.model) == "Kitten")
      shapes.push_back({options.meshes / "cat.obj", Eigen::Vector3d::UnitY(), 80});
    for (const Shape& shape : shapes) {
      const HollowOptions hollow = at(options.quick ? row.longest / 4 : row.longest);
      try {
        const Problem problem = problem_of(shape, walled(spin ? Spec(top(kTop)) : Spec(FloatSpec{}), options), hollow);
        Series series(collector, limits_of(options));
        series.measure_next(problem, spin ? std::vector{Method::rays_paper, Method::rays, Method::quadric}
                                          : std::vector{Method::rays_paper, Method::quadric});
      } catch (const Error& error) {
        Record refused;
        refused.mesh = shape.path.filename();
        refused.goal = row.goal;
        refused.solver = name(Method::rays_paper);
        refused.resolution = hollow.resolution;
        refused.status = "refused";
        refused.note = error.what();
        collector.add(refused);
      }
    }
  }
  return collector.take();
}

std::vector<Record> table2(const TableOptions& options) {
  Collector collector("table2", options);
  std::set<std::pair<int, std::string>> wanted;
  for (const PaperRow& row : paper_table2())
    for (const std::string& file : row.stand_ins) wanted.insert({row.longest, file});
  for (const int n : {100, 160, 250, 400, 630, 1000})
    for (const char* stand_in : {"ellipsoid.stl", "robin.stl"}) wanted.insert({n, stand_in});
  // Flat shapes, whose best interiors leave many rays void: none of the paper's, and harder on rays.
  for (const int n : {54, 80})
    for (const char* flat : {"tilted_ellipsoid.stl", "bird.stl"}) wanted.insert({n, flat});
  if (options.quick) wanted = {{20, "robin.stl"}, {20, "ellipsoid.stl"}, {26, "robin.stl"}, {26, "ellipsoid.stl"}};
  std::map<std::string, Series> series;
  for (const auto& [n, stand_in] : wanted)
    series.try_emplace(stand_in, collector, limits_of(options))
        .first->second.measure_next(problem_of({options.examples / stand_in}, walled(top(kTop), options), at(n)),
                                    {Method::quadric, Method::rays_paper, Method::rays, Method::octree, Method::voxels});
  return collector.take();
}

Record blank(const Problem& problem, const std::string& solver) {
  Record r;
  r.mesh = problem.mesh;
  r.goal = problem.goal_name;
  r.solver = solver;
  r.resolution = problem.resolution;
  r.intervals = static_cast<long long>(problem.plan.body->inner.rays.intervals.size());
  return r;
}

/// One problem, each method with its own knob from coarse to fine: what accuracy costs.
std::vector<Record> trace(const TableOptions& options) {
  Collector collector("trace", options);
  const Problem p =
      problem_of({options.examples / "tilted_ellipsoid.stl"}, walled(top(kTop), options), at(options.quick ? 24 : 64));
  const detail::Body& body = *p.plan.body;
  const Limits limits = limits_of(options);
  const InteriorSolver::Setup fine = tuned(p, 1e-7);

  collector.add(measure(p, Method::quadric, limits));
  for (const double target : {1e-3, 1e-4, 1e-5, 1e-6, 1e-7}) {
    const InteriorSolver::Setup setup = tuned(p, target);
    Record r = measure(p, Method::rays, limits, &setup);
    r.solver += ", barrier " + significant(target, 1);
    collector.add(std::move(r));
  }
  for (const int k : {8, 6, 4, 3, 2, 1}) {
    Record r = blank(p, name(Method::voxels) + ", " + std::to_string(k) + " spacings wide");
    SolveReport report;
    Moments model = Moments::Zero();
    Moments q = Moments::Zero();
    repeat(limits, r, [&] {
      const VoxelInterior interior(body.inner.rays, k);
      const InteriorNlp nlp(p.plan.goal, interior, body.shell, fine.scale, fine.start_fill);
      SolveOptions solve = fine.options;
      solve.probing = true;
      report = solve_ipopt(nlp, solve);
      r.variables = interior.variables();
      if (report.status == SolveStatus::converged) {
        model = nlp.body(report.x);
        q = nlp.switching(report.multipliers);
      }
    });
    r.iterations = report.iterations;
    r.status = report.status == SolveStatus::converged ? "converged" : report.solver_status;
    if (r.converged()) judge(p, model, q, r);
    collector.add(std::move(r));
  }
  for (const int rounds : {1, 2, 3, 4, 6, 8}) {
    Record r = blank(p, name(Method::octree) + ", " + std::to_string(rounds) + (rounds == 1 ? " round" : " rounds"));
    OctreeOptions octree;
    octree.max_rounds = rounds;
    octree.scale = p.plan.setup.scale;
    octree.start_fill = fine.start_fill;
    octree.solve = fine.options;
    OctreeReport report;
    repeat(limits, r, [&] { report = solve_octree(p.plan.goal, body.inner.rays, body.shell, octree); });
    r.iterations = report.iterations;
    r.variables = report.solve.variables;
    // Stopped at the number of rounds asked for is what is measured here.
    const bool stopped = report.solve.status == SolveStatus::iteration_limit && report.solve.solver_status == "Solve_Succeeded";
    r.status = stopped || report.solve.status == SolveStatus::converged ? "converged" : report.solve.solver_status;
    r.more["rounds"] = report.rounds;
    if (r.converged()) judge(p, report.body, Moments::Zero(), r);
    const bool finished = report.solve.status == SolveStatus::converged;
    collector.add(std::move(r));
    if (finished) break;
  }
  return collector.take();
}

/// A shape and what it shall do.
struct Task {
  Shape shape;
  std::string goal;
  std::string point = kTop;  ///< of a top
};

std::string up_text(const Eigen::Vector3d& up) { return up.x() > 0.5 ? "x" : up.y() > 0.5 ? "y" : "z"; }

std::vector<std::string> arguments_of(const Task& task, int resolution, const TableOptions& options) {
  std::vector<std::string> a = {task.goal == "yo-yo" ? "spin" : task.goal,
                                task.shape.path.string(),
                                "--up",
                                up_text(task.shape.up),
                                "--resolution",
                                std::to_string(resolution)};
  if (task.shape.size_mm > 0) a.insert(a.end(), {"--size", significant(task.shape.size_mm, 6)});
  if (options.quick) a.insert(a.end(), {"--wall", significant(kQuickWall_mm, 3)});
  if (task.goal == "yo-yo") a.push_back("--yoyo");
  if (task.goal == "spin") a.insert(a.end(), {"--point", task.point});
  return a;
}

std::string task_name(const Task& task) {
  std::string text = task.shape.path.filename();
  if (up_text(task.shape.up) != "z") text += ", " + up_text(task.shape.up) + " up";
  if (task.goal == "spin" && task.point == kThroughCentre) text += ", axis through the centre of mass";
  return text;
}

std::vector<Task> quality_tasks(const TableOptions& options) {
  std::vector<Task> tasks;
  const std::filesystem::path& e = options.examples;
  if (options.quick) return {{{e / "three_spheres.stl"}, "float"}, {{e / "tilted_ellipsoid.stl"}, "spin"}};
  for (const char* shape : {"duck.stl", "bird.stl", "three_spheres.stl", "tilted_ellipsoid.stl", "heart.stl", "teapot.stl"})
    for (const char* goal : {"float", "spin", "yo-yo", "stand"}) {
      // The teapot's base lies beside its centre of mass by more than hollowing can mend.
      const bool off = std::string(shape) == "teapot.stl" && std::string(goal) == "spin";
      tasks.push_back({{e / shape}, goal, off ? kThroughCentre : kTop});
    }
  if (options.meshes.empty()) return tasks;
  const std::filesystem::path& m = options.meshes;
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX();
  const Eigen::Vector3d y = Eigen::Vector3d::UnitY();
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  const std::vector<std::pair<const char*, Eigen::Vector3d>> tops = {
      {"duck.obj", z},      {"heart_closed.stl", z}, {"heart_closed.stl", y}, {"utah_teapot_solid.stl", z},
      {"ellipsoid.ply", x}, {"ellipsoid.ply", z},    {"skull.obj", y},        {"thingi10k_37620_cuboid.stl", x},
      {"boat.obj", y},      {"twisted_knot.ply", z}, {"armadillo.obj", y},    {"elephant.ply", y},
      {"cat.obj", y},       {"fandisk.obj", z},      {"penguin.obj", y},      {"spot_quadrangulated.obj", y},
      {"nefertiti.obj", y}};
  for (const auto& [file, up] : tops) tasks.push_back({{m / file, up, 80}, "spin", kThroughCentre});
  for (const auto& [file, up] : {std::pair{"duck.obj", z}, {"boat.obj", y}, {"cat.obj", y}, {"penguin.obj", y}})
    tasks.push_back({{m / file, up, 80}, "float"});
  for (const auto& [file, up] : {std::pair{"t-rex.obj", z}, {"bunny.obj", y}}) tasks.push_back({{m / file, up, 80}, "stand"});
  return tasks;
}

Eigen::Vector3d vector_of(const nlohmann::json& json) {
  const auto v = json.get<std::array<double, 3>>();
  return {v[0], v[1], v[2]};
}

Spec spec_of(const Task& task, const nlohmann::json& goal) {
  if (task.goal == "float") {
    FloatSpec spec;
    spec.waterline_mm = goal.at("waterline_mm").get<double>();
    return spec;
  }
  if (task.goal == "stand") {
    StandSpec spec;
    spec.target_mm = vector_of(goal.at("target_mm"));
    return spec;
  }
  SpinSpec spec = top(task.point);
  spec.yoyo = task.goal == "yo-yo";
  if (spec.yoyo) spec.axis = {};
  return spec;
}

/// The global optimum of a spin problem, proven on its rays.
Record certificate(const Problem& p, bool yoyo, const Limits& limits) {
  Record r = blank(p, kCertificate);
  const SpinWeights weights = detail::weights_of(SpinSpec{});
  const CertifiedSpin spin{weights.lambda, weights.gamma_i, yoyo, p.plan.setup.scale.volume_mm3, p.plan.setup.scale.length_mm};
  const Eigen::AlignedBox3d box = bounding_box(p.plan.body->working);
  SpinCertificate found;
  try {
    repeat(limits, r, [&] {
      const double begin = now_s();
      Progress progress;
      progress.cancelled = [&] { return now_s() - begin > limits.cap_s; };
      found =
          certify_spin(spin, *p.plan.body->integrals, p.plan.body->shell, {.heights = {box.min().z(), box.max().z()}}, progress);
    });
  } catch (const Error& error) {
    if (error.code() != ErrorCode::interrupted) throw;
    mark_capped(r, limits);
    return r;
  }
  r.status = found.closed ? "converged" : found.infeasible ? "infeasible" : "not closed";
  r.iterations = found.evaluations;
  r.objective = found.best.objective;
  r.gap = found.gap;
  r.more["nodes"] = found.nodes;
  return r;
}

/// Shapes x goals: each solver on the rays on the same problem, and the file that the command delivers.
std::vector<Record> quality(const TableOptions& options) {
  Collector collector("quality", options);
  for (const Task& task : quality_tasks(options))
    for (const int n : options.quick ? std::vector{30} : std::vector{100, 200}) {
      WholeRun last;
      Record whole = measure_whole(options.tool, arguments_of(task, n, options), 1, &last);
      whole.mesh = task_name(task);
      whole.goal = task.goal;
      whole.resolution = n;
      collector.add(whole);
      if (last.report.is_null()) continue;
      const Problem problem = problem_of(task.shape, walled(spec_of(task, last.report.at("goal")), options), at(n));
      // Where the goal is linear in every ray's mass, Eq. 11 of the paper leaves nothing out.
      const bool segments = problem.plan.setup.segments;
      const InteriorSolver::Setup setup = tuned(problem, kBarrierForQuality);
      for (const Method method : segments ? std::vector{Method::rays_paper, Method::rays, Method::quadric}
                                          : std::vector{Method::rays_paper, Method::quadric}) {
        Record r = measure(problem, method, limits_of(options), &setup);
        r.mesh = task_name(task);
        collector.add(std::move(r));
      }
      if (segments) {
        Record r = certificate(problem, task.goal == "yo-yo", limits_of(options));
        r.mesh = task_name(task);
        collector.add(std::move(r));
      }
    }
  return collector.take();
}

std::vector<Record> growth(const TableOptions& options) {
  Collector collector("growth", options);
  const auto run = [&](const Shape& shape, int n, int repeats) {
    Record r = measure_whole(options.tool, arguments_of({shape, "float"}, n, options), repeats);
    r.mesh = shape.path.filename();
    r.goal = "float";
    r.resolution = n;
    collector.add(std::move(r));
  };
  for (const int n : options.quick ? std::vector{30, 60} : std::vector{100, 160, 250, 400, 630, 1000})
    run({options.examples / "duck.stl"}, n, options.quick ? 1 : 3);
  if (!options.meshes.empty())
    for (const char* file : {"duck.obj", "heart_closed.stl"})
      for (const int n : options.quick ? std::vector{30} : std::vector{100, 400, 1000}) run({options.meshes / file}, n, 3);
  return collector.take();
}

/// Start of the range of speeds that has no end, rpm: Spin-It's Eq. 1 for a largest axis on a sliding tip.
double least_rpm(const nlohmann::json& state, const char* tip) {
  if (state.at("axis_class") != "largest") return kUnknown;
  for (const auto& range : state.at(tip))
    if (range.at("to_rpm").is_null()) return range.at("from_rpm");
  return kUnknown;
}

void add_height(Record& r, const nlohmann::json& report) {
  r.more["height before"] = report.at("before").at("height_mm");
  r.more["height after"] = report.at("after").at("height_mm");
  r.more["mass before"] = report.at("before").at("mass_g");
  r.more["mass after"] = report.at("after").at("mass_g");
}

/// Spin-It's Fig. 9 (speeds of the teapot) and Fig. 12 (heights of centres of mass of standing shapes).
std::vector<Record> teapot(const TableOptions& options) {
  Collector collector("teapot", options);
  const int n = options.quick ? 40 : 200;
  struct Objective {
    std::string name;
    std::vector<std::string> arguments;
  };
  std::vector<Objective> objectives = {{"inertia only", {"--lambda", "0"}}};
  for (const char* w : {"0.1", "0.3", "1", "3", "10"}) {
    if (options.quick && std::string(w) != "1") continue;
    objectives.push_back({std::string("lowering, lambda ") + w, {"--lambda", w}});
  }
  for (const char* w : {"1", "3", "10", "30", "100"}) {
    if (options.quick && std::string(w) != "10") continue;
    objectives.push_back({std::string("lowering and mass, gamma_c ") + w, {"--objective", "spinit", "--gamma-c", w}});
  }
  std::vector<Task> pots = {{{options.examples / "teapot.stl"}, "spin", kThroughCentre}};
  if (!options.meshes.empty())
    pots.push_back({{options.meshes / "utah_teapot_solid.stl", Eigen::Vector3d::UnitZ(), 80}, "spin", kThroughCentre});
  for (const Task& pot : pots)
    for (const Objective& objective : objectives) {
      std::vector<std::string> arguments = arguments_of(pot, n, options);
      arguments.insert(arguments.end(), objective.arguments.begin(), objective.arguments.end());
      WholeRun last;
      Record r = measure_whole(options.tool, arguments, 1, &last);
      r.mesh = task_name(pot);
      r.goal = "spin";
      r.solver = objective.name;
      r.resolution = n;
      if (!last.report.is_null()) {
        add_height(r, last.report);
        for (const char* tip : {"stable_sliding", "stable_fixed"}) {
          r.more[std::string(tip) + " before"] = least_rpm(last.report.at("before"), tip);
          r.more[std::string(tip) + " after"] = least_rpm(last.report.at("after"), tip);
        }
      }
      collector.add(std::move(r));
    }

  std::vector<Task> standing;
  for (const char* file : {"duck.stl", "heart.stl", "teapot.stl"}) standing.push_back({{options.examples / file}, "stand"});
  if (options.quick) standing.resize(1);
  if (!options.meshes.empty()) {
    standing.push_back({{options.meshes / "t-rex.obj", Eigen::Vector3d::UnitZ(), 80}, "stand"});
    standing.push_back({{options.meshes / "bunny.obj", Eigen::Vector3d::UnitY(), 80}, "stand"});
  }
  for (const Task& task : standing) {
    WholeRun last;
    Record r = measure_whole(options.tool, arguments_of(task, n, options), 1, &last);
    r.mesh = task_name(task);
    r.goal = "stand";
    r.resolution = n;
    if (!last.report.is_null()) {
      add_height(r, last.report);
      r.more["tipping before"] = last.report.at("before").at("smallest_tipping_angle_rad");
      r.more["tipping after"] = last.report.at("after").at("smallest_tipping_angle_rad");
      const int up = up_text(task.shape.up) == "y" ? 1 : 2;
      r.more["size"] = last.report.at("input").at("size_mm").at(up);
    }
    collector.add(std::move(r));
  }
  return collector.take();
}

/// From the origin; its floor is level, which a slicer cannot follow.
Mesh box_mesh(const Eigen::Vector3d& sizes) {
  Mesh mesh;
  for (int corner = 0; corner < 8; ++corner)
    mesh.vertices.emplace_back((corner & 1) * sizes.x(), (corner >> 1 & 1) * sizes.y(), (corner >> 2) * sizes.z());
  mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return mesh;
}

/// What of a verdict is told of a print: its mass, how far its centre of mass is off over the diagonal, by how much it leans, and
/// what it is for (waterline, lowest stable speed, tipping angle).
void add_verdict(const std::string& when, const Verdict& verdict, Record& r) {
  r.more[when + " mass_g"] = verdict.body.mass_g;
  for (const Criterion& c : verdict.criteria)
    if (c.name == "offset") r.more[when + " offset"] = c.value;
  for (const Figure& f : verdict.figures) {
    if (const double* value = std::get_if<double>(&f.value)) {
      if (f.name == "settled_tilt_rad" || f.name == "axis_angle_rad") r.more[when + " lean_rad"] = *value;
      if (f.name == "smallest_tipping_angle_rad") r.more[when + " does"] = *value * 180 / std::numbers::pi;
    }
    const auto* speeds = std::get_if<std::vector<rayrep::Record>>(&f.value);
    if (f.name == "stable_sliding" && speeds && !speeds->empty())
      for (const auto& [name, value] : speeds->back())
        if (name == "from_rpm" && std::holds_alternative<double>(value)) r.more[when + " does"] = std::get<double>(value);
  }
  for (const Figure& f : verdict.wanted)
    if (f.name == "waterline_mm") r.more[when + " does"] = std::get<double>(f.value);
}

/// What the infill of the profile is, with another percentage; none: a cavity.
Infill infill_of(const SlicerProfile& profile, double percent) {
  Infill infill;
  infill.percent = percent;
  infill.pattern = profile.fill_pattern.value_or(infill.pattern);
  infill.perimeters = profile.perimeters.value_or(infill.perimeters);
  infill.extrusion_width_mm = profile.extrusion_width_mm.value_or(infill.extrusion_width_mm);
  infill.top_layers = profile.top_layers.value_or(infill.top_layers);
  infill.bottom_layers = profile.bottom_layers.value_or(infill.bottom_layers);
  infill.layer_height_mm = profile.layer_height_mm.value_or(infill.layer_height_mm);
  return infill;
}

struct Printing {
  const Mesh& solid;
  Spec spec;
  HollowOptions how;
  SlicerOptions slicer;
  std::filesystem::path gcode;
};

/// Of the mesh that meets its goal, of what PrusaSlicer lays down for it (open loop), and of the print that is delivered.
void measure_print(Printing printing, Record& r) {
  std::vector<Moments> prints;
  std::optional<Delivery> first;
  printing.how.as_printed = [&](const Delivery& delivery) {
    if (!first) first = delivery;
    prints.push_back(slice(delivery, ".3mf", printing.gcode, printing.slicer).placed.s);
    return prints.back();
  };
  const double begin = now_s();
  const HollowResult result = hollow(printing.solid, printing.spec, printing.how);
  r.seconds = spread({now_s() - begin});
  r.more["slices"] = static_cast<double>(prints.size());
  r.more["gave way"] = result.gave_way ? 1 : 0;
  r.more["laid down"] = result.slices.front().excess;
  add_verdict("promised", verify(*first, &printing.solid, result.spec), r);
  add_verdict("open", verify_print(printing.solid, prints.front(), result.spec), r);
  const Verdict closed = verify_print(printing.solid, prints[result.best_slice], result.spec);
  add_verdict("closed", closed, r);
  r.status = "converged";
  for (const Criterion& c : closed.criteria)
    if (!c.pass()) r.status = c.name;
}

/// Examples and a box, hollow and with infill, sliced.
std::vector<Record> sliced(const TableOptions& options) {
  Collector collector("sliced", options);
  const auto temporary = std::filesystem::temp_directory_path() / ("rayrep_bench_" + std::to_string(getpid()) + ".gcode");
  const SlicerOptions slicer{.program = "prusa-slicer", .profile = RAYREP_PROFILE};
  const SlicerProfile profile = read_slicer_profile(slicer.profile);
  TableOptions of_examples = options;
  of_examples.meshes.clear();
  std::vector<Task> tasks = quality_tasks(of_examples);
  std::erase_if(tasks, [](const Task& task) { return task.goal == "yo-yo"; });
  tasks.push_back({{}, "float"});
  for (const Task& task : tasks)
    for (const double percent : options.quick ? std::vector{0., 15.} : std::vector{0., 5., 15., 30.}) {
      const Mesh solid = task.shape.path.empty() ? box_mesh({60, 40, 30}) : load(task.shape);
      Spec spec = FloatSpec{};
      if (task.goal == "spin") spec = top(task.point);
      if (task.goal == "stand") spec = StandSpec{};
      Print print;
      print.infill = infill_of(profile, percent);
      if (percent > 0) print.wall_mm = print.infill.skin_mm();
      std::visit([&](auto& s) { s.print = print; }, spec);
      Record r;
      r.mesh = task.shape.path.empty() ? "a box, 60 x 40 x 30 mm" : task_name(task);
      r.goal = task.goal;
      r.solver = percent > 0 ? significant(percent, 2) + " %" : "void";
      r.resolution = options.quick ? 40 : 100;
      try {
        measure_print({solid, spec, at(r.resolution), slicer, temporary}, r);
      } catch (const Error& error) {
        if (error.code() == ErrorCode::usage) {  // there is no slicer
          r.note = error.what();
          r.status = "skipped";
          collector.add(std::move(r));
          return collector.take();
        }
        r.status = "refused";
        r.note = error.what();
      }
      collector.add(std::move(r));
    }
  std::filesystem::remove(temporary);
  return collector.take();
}

/// Whether every shape gets an answer: as asked, with the least change that --allow all lets, or none. The way up is that of the
/// files' z, as one who knows nothing of them would have it.
std::vector<Record> answers(const TableOptions& options) {
  Collector collector("answers", options);
  std::vector<std::filesystem::path> files;
  const std::filesystem::path& folder = options.meshes.empty() ? options.examples : options.meshes;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    if (const std::string ending = entry.path().extension(); ending != ".md" && ending != ".json") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  if (options.quick) files.resize(std::min<std::size_t>(files.size(), 2));
  const std::string n = options.quick ? "40" : "100";
  for (const std::filesystem::path& file : files)
    for (const char* goal : {"float", "spin", "yo-yo", "stand"}) {
      const bool yoyo = std::string(goal) == "yo-yo";
      std::vector<std::string> arguments = {
          yoyo ? "spin" : goal, file.string(), "--size", "80", "--resolution", n, "--allow", "all", "--rigid"};
      if (yoyo) arguments.push_back("--yoyo");
      if (goal == std::string("spin")) arguments.insert(arguments.end(), {"--point", kThroughCentre});
      WholeRun last;
      Record r = measure_whole(options.tool, arguments, 1, &last);
      r.mesh = file.filename();
      r.goal = goal;
      r.resolution = std::stoi(n);
      if (r.converged() && last.report.contains("changed")) r.note = last.report.at("changed");
      if (last.exit_code == static_cast<int>(ErrorCode::input)) r.status = "not closed";
      collector.add(std::move(r));
    }
  return collector.take();
}

}  // namespace

const std::vector<std::string>& table_names() {
  static const std::vector<std::string> names = {"table1", "table2", "trace",  "quality", "cavities", "overhang",
                                                 "roofs",  "growth", "teapot", "sliced",  "answers"};
  return names;
}

std::vector<Record> run_table(const std::string& name, const TableOptions& options) {
  if (name == "table1") return table1(options);
  if (name == "table2") return table2(options);
  if (name == "trace") return trace(options);
  if (name == "quality") return quality(options);
  if (name == "cavities") return measure_cavities(options);
  if (name == "overhang") return measure_overhang(options);
  if (name == "roofs") return measure_roofs(options);
  if (name == "growth") return growth(options);
  if (name == "teapot") return teapot(options);
  if (name == "sliced") return sliced(options);
  if (name == "answers") return answers(options);
  throw std::invalid_argument("There is no table '" + name + "'.");
}

const std::vector<PaperRow>& paper_table1() {
  static const std::vector<PaperRow> rows = {
      {"3-spheres", "51 x 101 x 101", 101, "float", {"three_spheres.stl"}, 4236, 0.499, 0, 0},
      {"Kitten", "101 x 92 x 154", 154, "float", {"heart.stl"}, 8176, 0.919, 0, 0},
      {"Duck", "89 x 105 x 101", 105, "float", {"duck.stl"}, 8087, 0.799, 0, 0},
      {"Ellipsoid", "100 x 65 x 63", 100, "spin", {"ellipsoid.stl"}, 8682, 3.870, 0, 0},
      {"Bird", "100 x 75 x 75", 100, "spin", {"robin.stl"}, 8776, 3.975, 0, 0}};
  return rows;
}

// The example ellipsoid and robin were shaped after these rows: the same proportions, about as many rays and voxels inside.
const std::vector<PaperRow>& paper_table2() {
  static const std::vector<PaperRow> rows = {{"Ellipsoid", "80 x 52 x 51", 80, "spin", {"ellipsoid.stl"}, 5882, 1.79, 94975, 34.74},
                                             {"Ellipsoid", "64 x 42 x 41", 64, "spin", {"ellipsoid.stl"}, 3706, 0.71, 46314, 11.48},
                                             {"Ellipsoid", "54 x 35 x 34", 54, "spin", {"ellipsoid.stl"}, 2536, 0.48, 26783, 3.48},
                                             {"Ellipsoid", "40 x 26 x 26", 40, "spin", {"ellipsoid.stl"}, 1390, 0.31, 10764, 1.37},
                                             {"Bird", "80 x 60 x 60", 80, "spin", {"robin.stl"}, 6184, 2.24, 100224, 17.94},
                                             {"Bird", "54 x 40 x 40", 54, "spin", {"robin.stl"}, 2646, 0.72, 28261, 4.43},
                                             {"Bird", "40 x 30 x 30", 40, "spin", {"robin.stl"}, 1414, 0.29, 11306, 2.20}};
  return rows;
}

}  // namespace rayrep::bench
