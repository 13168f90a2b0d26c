#include "micro.h"

#include <benchmark/benchmark.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <functional>
#include <map>
#include <numeric>

#include "motion.h"
#include "problem.h"
#include "rayrep/judge/verify.h"
#include "rayrep/make/cavity.h"

namespace rayrep::bench {
namespace {

/// The tilted ellipsoid as a top: one interval on each ray, so that figures can be compared with what is known of the shape.
const Problem& problem(int resolution) {
  static std::map<int, Problem> kept;
  if (!kept.contains(resolution)) {
    kept.clear();  // one at a time: at 1000 rays it takes much memory
    HollowOptions options;
    options.resolution = resolution;
    kept.emplace(resolution, problem_of({std::filesystem::path(RAYREP_EXAMPLES) / "tilted_ellipsoid.stl"}, SpinSpec{}, options));
  }
  return kept.at(resolution);
}

int resolution(const benchmark::State& state) { return static_cast<int>(state.range(0)); }

double as_double(std::size_t n) { return static_cast<double>(n); }

void set_rate(benchmark::State& state, const char* name, double amount) {
  state.counters[name] =
      benchmark::Counter(amount * as_double(static_cast<std::size_t>(state.iterations())), benchmark::Counter::kIsRate);
}

void casting(benchmark::State& state) {
  const detail::Body& body = *problem(resolution(state)).plan.body;
  const RayGrid grid = covering_grid(bounding_box(body.working), body.size_mm / resolution(state));
  for (auto _ : state) benchmark::DoNotOptimize(cast_rays(body.surface, grid, Region::single_layer));
  set_rate(state, "rays", as_double(grid.size()));
}

void inner_domains(benchmark::State& state) {
  const Problem& p = problem(resolution(state));
  const detail::Body& body = *p.plan.body;
  InnerDomainOptions options;
  options.wall_mm = print_of(p.plan.spec).wall_mm;
  options.ray_spacing_mm = body.inner.rays.grid.spacing_mm;
  options.field_spacing_mm = body.inner.field.spacing_mm;
  options.min_component_mm3 = p.options.min_cavity_mm3;
  for (auto _ : state) benchmark::DoNotOptimize(inner_domain(body.surface, options));
  set_rate(state, "rays", as_double(body.inner.rays.grid.size()));
}

void quadric_moments(benchmark::State& state) {
  const Problem& p = problem(resolution(state));
  const RayIntegrals& rays = *p.plan.body->integrals;
  for (auto _ : state) benchmark::DoNotOptimize(rays.moments(p.exact.q));
  set_rate(state, "intervals", as_double(rays.intervals()));
  set_rate(state, "bytes", as_double(rays.bytes()));
}

void quadric_pass(benchmark::State& state) {
  const Problem& p = problem(resolution(state));
  const RayIntegrals& rays = *p.plan.body->integrals;
  for (auto _ : state) benchmark::DoNotOptimize(rays.pass(p.exact.q));
  set_rate(state, "intervals", as_double(rays.intervals()));
  set_rate(state, "bytes", as_double(rays.bytes()));
}

/// The bound for the two above: as many bytes as they read, added up on all cores.
void plain_read(benchmark::State& state) {
  const RayIntegrals& rays = *problem(resolution(state)).plan.body->integrals;
  const std::vector<double> ends(rays.bytes() / sizeof(double), 0.5);
  for (auto _ : state)
    benchmark::DoNotOptimize(tbb::parallel_reduce(
        tbb::blocked_range<std::size_t>(0, ends.size(), 8192), 0.0,
        [&](const tbb::blocked_range<std::size_t>& range, double sum) {
          std::array<double, 8> lanes{};  // independent sums, so that adding does not wait for itself
          std::size_t n = range.begin();
          for (; n + 8 <= range.end(); n += 8)
            for (std::size_t k = 0; k < 8; ++k) lanes[k] += ends[n + k];
          for (; n < range.end(); ++n) lanes[0] += ends[n];
          return std::accumulate(lanes.begin(), lanes.end(), sum);
        },
        std::plus<>()));
  set_rate(state, "intervals", as_double(rays.intervals()));
  set_rate(state, "bytes", as_double(rays.bytes()));
}

void quadric_solve(benchmark::State& state) {
  const Problem& p = problem(resolution(state));
  int evaluations = 0;
  for (auto _ : state) evaluations = solve_quadric(p.plan.goal, *p.plan.body->integrals, p.plan.body->shell).evaluations;
  state.counters["evaluations"] = evaluations;
  set_rate(state, "intervals", as_double(p.plan.body->integrals->intervals()));
}

CavityMesh cavity_of(const Problem& p) {
  BlockField field = p.plan.body->inner.field;
  CavityOptions options;
  options.wall_mm = print_of(p.plan.spec).wall_mm;
  return mesh_cavity(field, p.plan.body->surface, p.exact.q, options);
}

void meshing(benchmark::State& state) {
  const Problem& p = problem(resolution(state));
  std::size_t triangles = 0;
  for (auto _ : state) triangles = cavity_of(p).mesh.triangles.size();
  set_rate(state, "triangles", as_double(triangles));
}

void verifying(benchmark::State& state) {
  const Problem& p = problem(resolution(state));
  Mesh delivered = p.plan.body->outer;
  append(delivered, transformed(cavity_of(p).mesh, p.plan.body->to_working.inverse()));
  for (auto _ : state) benchmark::DoNotOptimize(verify(delivered, &p.plan.body->outer, std::get<SpinSpec>(p.plan.spec)));
  set_rate(state, "triangles", as_double(delivered.triangles.size()));
}

void register_all() {
  // Resolution by resolution, since one problem is kept at a time.
  for (const int n : {100, 400, 1000}) {
    const auto add = [n](const char* name, void (*function)(benchmark::State&)) {
      benchmark::RegisterBenchmark(name, function)->Unit(benchmark::kMillisecond)->UseRealTime()->ArgName("N")->Arg(n);
    };
    add("casting", casting);
    add("inner domain", inner_domains);
    add("plain read of the rays' bytes", plain_read);
    add("moments of a quadric", quadric_moments);
    add("moments and derivative of a quadric", quadric_pass);
    add("solve by quadric", quadric_solve);
    add("meshing the cavity", meshing);
    add("verify", verifying);
  }
}

}  // namespace

int run_micro(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  register_all();
  register_motion();
  const std::size_t ran = benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  return ran > 0 ? 0 : 1;
}

}  // namespace rayrep::bench
