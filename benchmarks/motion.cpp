#include "motion.h"

#include <benchmark/benchmark.h>

#include <chrono>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>

#include "rayrep/motion/motion_check.h"

namespace rayrep::bench {
namespace {

using Eigen::Vector3d;

constexpr int kParts = 10;

/// A ring with bumps, of 2 n m triangles.
Mesh ring(int n, int m, double bump_mm) {
  Mesh mesh;
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < m; ++k) {
      const double a = 2 * std::numbers::pi * i / n, b = 2 * std::numbers::pi * k / m;
      const double r = 6 + bump_mm * std::cos(5 * a + 3 * b), across = 15 + r * std::cos(b);
      mesh.vertices.emplace_back(across * std::cos(a), across * std::sin(a), r * std::sin(b));
      const int i1 = (i + 1) % n, k1 = (k + 1) % m;
      mesh.triangles.emplace_back(i * m + k, i1 * m + k, i1 * m + k1);
      mesh.triangles.emplace_back(i * m + k, i1 * m + k1, i * m + k1);
    }
  return mesh;
}

/// Ten parts of 10 000 triangles that cross a box of 200 mm on curves, turning.
Scene crowd() {
  std::mt19937 engine(1);
  const auto number = [&engine] { return 2 * static_cast<double>(engine()) / 4294967295.0 - 1; };
  const auto vector = [&number](double size) { return Vector3d(size * number(), size * number(), size * number()); };
  Scene scene;
  scene.transitions = {{"way", 0, 0, {}}};
  for (int n = 0; n < kParts; ++n) {
    ScenePart part;
    part.name = "ring " + std::to_string(n);
    part.mesh = std::make_shared<const Mesh>(ring(100, 50, 1 + 0.1 * n));
    scene.parts.push_back(part);
    Motion motion;
    for (int k = 0; k < 3; ++k) {
      const Vector3d at = vector(100);
      motion.translation.push_back({0.5 * k, at, at + vector(30), at + vector(30)});
      motion.rotation.push_back({0.5 * k, Eigen::Quaterniond(Eigen::AngleAxisd(number(), vector(1).normalized()))});
    }
    scene.transitions[0].motions.push_back(motion);
  }
  return scene;
}

void set_counters(benchmark::State& state, const MotionReport& report) {
  std::size_t overlapping = 0;
  for (const PairMotion& pair : report.pairs) overlapping += pair.overlaps();
  state.counters["looks"] = static_cast<double>(report.moments);
  state.counters["overlapping"] = static_cast<double>(overlapping);
}

/// From scenes with meshes in memory: nothing is known of them.
void whole_check(benchmark::State& state) {
  const Scene scene = crowd();
  MotionReport report;
  double first_s = 0;
  for (auto _ : state) {
    const auto begin = std::chrono::steady_clock::now();
    first_s = 0;
    MotionCheckOptions options;
    options.found = [&](const MotionReport&) {
      if (first_s == 0) first_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    };
    report = MotionChecker().check(scene, options);
  }
  set_counters(state, report);
  state.counters["first_answer_ms"] = 1e3 * first_s;
}

/// One key of one part is moved to and fro.
void after_an_edit(benchmark::State& state) {
  Scene scene = crowd();
  MotionChecker checker;
  MotionReport report = checker.check(scene);
  double by = 1;
  for (auto _ : state) {
    scene.transitions[0].motions[3].translation[1].at_mm.x() += by;
    by = -by;
    report = checker.check(scene);
  }
  set_counters(state, report);
  state.counters["kept"] = static_cast<double>(report.kept);
}

}  // namespace

void register_motion() {
  const auto add = [](const char* name, void (*function)(benchmark::State&)) {
    benchmark::RegisterBenchmark(name, function)->Unit(benchmark::kMillisecond)->UseRealTime()->ArgName("N")->Arg(kParts);
  };
  add("motion of N parts of 10 000 triangles", whole_check);
  add("motion of them after an edit", after_an_edit);
}

}  // namespace rayrep::bench
