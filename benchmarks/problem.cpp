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
#include "rayrep/mesh/mesh_check.h"

namespace rayrep::bench {
namespace {

/// How many voxels one ray spacing wide the inner domain has, about.
long long voxel_estimate(const detail::Body& body) {
  const double spacing = body.inner.rays.grid.spacing_mm;
  return static_cast<long long>(body.inner.rays.volume_mm3() / (spacing * spacing * spacing));
}

std::string name(SolveStatus status) {
  std::string text = kSolveStatusNames[static_cast<std::size_t>(status)];
  std::replace(text.begin(), text.end(), '_', ' ');
  return text;
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

std::optional<Mesh> closed(const Shape& shape) {
  try {
    return load(shape);
  } catch (const Error&) {
    return std::nullopt;
  }
}

std::vector<std::filesystem::path> meshes_in(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  if (folder.empty()) return files;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    if (const std::string ending = entry.path().extension(); ending != ".md" && ending != ".json") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

Problem problem_of(const Shape& shape, Spec spec, const HollowOptions& options) {
  std::visit([&shape](auto& s) { s.up = shape.up; }, spec);
  const SpinSpec* spin = std::get_if<SpinSpec>(&spec);
  Problem p;
  p.mesh = shape.path.filename();
  p.goal_name = spin && spin->yoyo ? "yo-yo" : std::visit([](const auto& s) { return std::string(s.kGoal); }, spec);
  p.resolution = options.resolution;
  p.options = options;
  const Mesh mesh = load(shape);
  p.plan = std::visit([&](const auto& s) { return detail::plan(mesh, s, options, Progress{}); }, spec);
  p.plan.setup.warm = {};  // every solver starts from nothing
  p.exact = solve_quadric(p.plan.goal, *p.plan.body->integrals, p.plan.body->shell);
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
  const detail::Body& body = *problem.plan.body;
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

  InteriorSolver::Setup setup = changed ? *changed : problem.plan.setup;
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
    InteriorSolver solver(problem.plan.goal, body.inner.rays, arranged ? *arranged : *body.integrals, setup);
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
  InteriorSolver::Setup setup = problem.plan.setup;
  if (!setup.segments) return setup;
  setup.start_fill = 0.5;
  setup.options.barrier_target = barrier_target;
  setup.options.tolerance = std::max(setup.options.tolerance, barrier_target);
  setup.options.max_iterations = problem.options.solve.max_iterations;
  return setup;
}

void judge(const Problem& problem, const Moments& model, const Moments& q, Record& record) {
  const detail::Body& body = *problem.plan.body;
  const Goal& goal = problem.plan.goal;
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
  options.wall_mm = print_of(problem.plan.spec).wall_mm;
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
