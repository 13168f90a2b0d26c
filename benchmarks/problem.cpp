#include "problem.h"

#include <malloc.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <fstream>

#include "rayrep/base/error.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/make/cavity.h"
#include "rayrep/make/waterline.h"
#include "rayrep/mesh/mesh_check.h"

namespace rayrep::bench {
namespace {

Problem start(const Shape& shape, const HollowOptions& options, const char* goal_name) {
  Problem p;
  p.mesh = shape.path.filename();
  p.goal_name = goal_name;
  p.resolution = options.resolution;
  p.options = options;
  p.options.up = shape.up;
  return p;
}

void finish(Problem& p) { p.exact = solve_quadric(*p.goal, *p.body->integrals, p.body->shell); }

/// How many voxels one ray spacing wide the inner domain has, about.
long long voxel_estimate(const detail::Body& body) {
  const double spacing = body.inner.rays.grid.spacing_mm;
  return static_cast<long long>(body.inner.rays.volume_mm3() / (spacing * spacing * spacing));
}

std::string name(SolveStatus status) {
  switch (status) {
    case SolveStatus::not_run:
      return "not run";
    case SolveStatus::converged:
      return "converged";
    case SolveStatus::infeasible:
      return "infeasible";
    case SolveStatus::iteration_limit:
      return "iteration limit";
    case SolveStatus::failed:
      return "failed";
  }
  return "unknown";
}

}  // namespace

Mesh load(const Shape& shape) {
  CheckOptions check;
  check.self_intersections = false;
  Mesh mesh = require_solid(read_mesh(shape.path).mesh, shape.path.string(), check).mesh;
  if (shape.size_mm > 0) {
    const double factor = shape.size_mm / bounding_box(mesh).sizes().maxCoeff();
    for (auto& v : mesh.vertices) v *= factor;
  }
  return mesh;
}

// The three follow hollow_float, hollow_spin and hollow_stand in src/make/hollow.cpp, options of Ipopt included.

Problem float_problem(const Shape& shape, const HollowOptions& options, std::optional<double> waterline_mm) {
  Problem p = start(shape, options, "float");
  Mesh mesh = load(shape);
  const Eigen::Affine3d frame = working_frame(mesh, shape.up);
  p.body = std::make_unique<detail::Body>(std::move(mesh), frame, p.options, Progress{});
  const detail::Body& body = *p.body;
  const double fluid_g_cm3 = FloatOptions{}.fluid_g_cm3;
  const FloatProblem problem{body.hull,         body.inner.rays, *body.integrals, body.shell, fluid_g_cm3, p.options.density_g_cm3,
                             p.options.wall_mm, body.height_mm,  body.diagonal_mm};
  if (!waterline_mm) waterline_mm = best_waterline(problem);
  if (!waterline_mm) throw Error(ErrorCode::goal, "no waterline");
  const WaterlineState target = at_waterline(problem, *waterline_mm);
  const double material_mm3 = target.water.displaced_volume_mm3 * fluid_g_cm3 / p.options.density_g_cm3;
  p.goal = std::make_unique<FloatGoal>(material_mm3, target.water.centre_of_buoyancy_mm.head<2>(), body.diagonal_mm);
  p.setup.scale = {material_mm3, body.diagonal_mm};
  p.setup.options = p.options.solve;
  finish(p);
  return p;
}

Problem spin_problem(const Shape& shape, const HollowOptions& options, const SpinAxis& axis, const SpinGoal::Weights& weights,
                     bool yoyo) {
  Problem p = start(shape, options, yoyo ? "yo-yo" : "spin");
  Mesh mesh = load(shape);
  const Eigen::Vector3d contact = yoyo ? Eigen::Vector3d(bounding_box(mesh).center()) : contact_point(mesh, axis, shape.up);
  Eigen::Affine3d frame = working_frame(mesh, shape.up);
  frame.translation() = -(frame.linear() * contact);
  p.body = std::make_unique<detail::Body>(std::move(mesh), frame, p.options, Progress{});
  p.setup.scale = {p.body->solid[M1], p.body->diagonal_mm};
  p.goal = std::make_unique<SpinGoal>(weights, true, yoyo, p.setup.scale.volume_mm3, p.setup.scale.length_mm);
  p.setup.segments = true;
  p.setup.start_fill = SpinOptions{}.start_fill;
  p.setup.options = p.options.solve;
  p.setup.options.tolerance = std::max(p.options.solve.tolerance, 1e-7);
  p.setup.options.barrier_target = 1e-8;
  p.setup.options.max_iterations = std::min(p.options.solve.max_iterations, 200);
  finish(p);
  return p;
}

Problem stand_problem(const Shape& shape, const HollowOptions& options, const Eigen::Vector3d& target_mm) {
  Problem p = start(shape, options, "stand");
  Mesh mesh = load(shape);
  const Eigen::Affine3d frame = working_frame(mesh, shape.up);
  p.body = std::make_unique<detail::Body>(std::move(mesh), frame, p.options, Progress{});
  p.setup.scale = {p.body->solid[M1], p.body->diagonal_mm};
  p.goal = std::make_unique<StandGoal>((frame * target_mm).head<2>(), p.setup.scale.volume_mm3, p.setup.scale.length_mm);
  p.setup.options = p.options.solve;
  p.setup.options.tolerance = std::max(p.options.solve.tolerance, 1e-7);
  p.setup.options.barrier_target = 1e-9;
  finish(p);
  return p;
}

std::string name(Method method) {
  switch (method) {
    case Method::rays_paper:
      return "rays, paper's bounds";
    case Method::rays:
      return "rays";
    case Method::quadric:
      return "quadric";
    case Method::voxels:
      return "voxels";
    case Method::octree:
      return "octree";
  }
  return "unknown";
}

void repeat(const Limits& limits, Record& record, const std::function<void()>& work) {
  std::vector<double> seconds;
  std::vector<double> processor;
  do {
    const double begin = now_s();
    const double processor_begin = processor_s();
    work();
    seconds.push_back(now_s() - begin);
    processor.push_back(processor_s() - processor_begin);
  } while (static_cast<int>(seconds.size()) < limits.repeats && seconds.front() < limits.repeat_below_s);
  record.seconds = spread(seconds);
  record.more["processor_s"] = spread(processor).median;
}

void mark_capped(Record& record, const Limits& limits) {
  record.status = "capped";
  record.seconds = spread({limits.cap_s});
  record.note = "stopped after " + significant(limits.cap_s, 3) + " s";
}

Record measure(const Problem& problem, Method method, const Limits& limits, const InteriorSolver::Setup* changed) {
  const detail::Body& body = *problem.body;
  Record record;
  record.mesh = problem.mesh;
  record.goal = problem.goal_name;
  record.solver = name(method);
  record.resolution = problem.resolution;
  record.intervals = static_cast<long long>(body.inner.rays.intervals.size());
  if (method == Method::voxels && voxel_estimate(body) > limits.most_variables) {
    record.status = "skipped";
    record.variables = voxel_estimate(body);
    record.note = "more than " + std::to_string(limits.most_variables) + " variables";
    return record;
  }

  InteriorSolver::Setup setup = changed ? *changed : problem.setup;
  setup.bounds = method == Method::rays_paper ? SegmentBounds::paper : SegmentBounds::complete;
  switch (method) {
    case Method::rays_paper:
    case Method::rays:
      setup.solver = Solver::rays;
      break;
    case Method::quadric:
      setup.solver = Solver::quadric;
      break;
    case Method::voxels:
      setup.solver = Solver::voxels;
      break;
    case Method::octree:
      setup.solver = Solver::octree;
      break;
  }
  InteriorSolver::Solved solved;
  const auto solve_once = [&] {
    const double begin = now_s();
    Progress progress;
    progress.cancelled = [&] { return now_s() - begin > limits.cap_s; };
    // To arrange the rays for integrals is a part of the quadric solver's work, and of no other's.
    std::optional<RayIntegrals> arranged;
    if (method == Method::quadric) arranged.emplace(body.inner.rays);
    InteriorSolver solver(*problem.goal, body.inner.rays, arranged ? *arranged : *body.integrals, setup);
    solved = solver.solve(body.shell, progress);
  };
  reset_peak_memory();
  try {
    repeat(limits, record, solve_once);
  } catch (const Error& error) {
    if (error.code() != ErrorCode::interrupted) throw;
    mark_capped(record, limits);
    return record;
  }
  record.peak_memory_mb = peak_memory_mb();
  record.status = name(solved.report.status);
  record.variables = solved.report.variables;
  record.iterations = solved.report.iterations;
  if (solved.report.status == SolveStatus::failed) record.note = solved.report.solver_status;
  if (solved.report.status != SolveStatus::infeasible) judge(problem, solved.model, solved.q, record);
  return record;
}

InteriorSolver::Setup tuned(const Problem& problem, double barrier_target) {
  InteriorSolver::Setup setup = problem.setup;
  if (!setup.segments) return setup;
  setup.start_fill = 0.5;
  setup.options.barrier_target = barrier_target;
  setup.options.tolerance = std::max(setup.options.tolerance, barrier_target);
  setup.options.max_iterations = problem.options.solve.max_iterations;
  return setup;
}

void judge(const Problem& problem, const Moments& model, const Moments& q, Record& record) {
  const detail::Body& body = *problem.body;
  const Goal& goal = *problem.goal;
  record.objective = goal.objective(model);
  record.residual = goal.constraint_values(model).cwiseAbs().maxCoeff();
  if (problem.exact.converged) {
    const bool is_exact = record.solver == name(Method::quadric);
    const double best = is_exact ? problem.exact.lower_bound : problem.exact.objective;
    if (std::isfinite(best)) record.gap = (record.objective - best) / std::abs(best);
  }
  if (record.status != "converged" || !(q.cwiseAbs().maxCoeff() > 0)) return;
  BlockField field = body.inner.field;
  CavityOptions options;
  options.wall_mm = problem.options.wall_mm;
  options.min_cavity_mm3 = problem.options.min_cavity_mm3;
  const Moments built = body.solid + mesh_moments(mesh_cavity(field, body.surface, q, options).mesh);
  record.residual_meshed = goal.constraint_values(built).cwiseAbs().maxCoeff();
}

void reset_peak_memory() {
  malloc_trim(0);
  std::ofstream("/proc/self/clear_refs") << "5";
}

double peak_memory_mb() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.rfind("VmHWM:", 0) == 0) return std::stod(line.substr(6)) / 1024;
  return kUnknown;
}

double processor_s() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

double now_s() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

}  // namespace rayrep::bench
