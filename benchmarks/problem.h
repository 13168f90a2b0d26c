#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "make/plan.h"
#include "rayrep/make/hollow.h"
#include "rayrep/solve/goals.h"
#include "rayrep/solve/quadric.h"
#include "record.h"

namespace rayrep::bench {

/// A mesh of the examples or of a folder of the user's.
struct Shape {
  std::filesystem::path path;
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  double size_mm = 0;  ///< longest side after scaling; 0: as in the file
};

/// The checked, scaled solid. @throws Error{input}
Mesh load(const Shape& shape);
/// The same; none where it is not closed.
std::optional<Mesh> closed(const Shape& shape);

/// The meshes of a folder, by name; of no folder none.
std::vector<std::filesystem::path> meshes_in(const std::filesystem::path& folder);

/// A plan as `hollow` would carry it out: inner domain, shell, goal, scales and Ipopt's options. A comparison of solvers is a loop
/// over one Problem.
struct Problem {
  std::string mesh;
  std::string goal_name;
  int resolution = 0;
  HollowOptions options;
  detail::Plan plan;      ///< the solver is chosen by measure()
  QuadricSolution exact;  ///< of the same rays: what gaps are measured from
};

/// @throws Error{goal} when it cannot be met
Problem problem_of(const Shape& shape, Spec spec, const HollowOptions& options);

enum class Method { rays_paper, rays, quadric, voxels, octree };
std::string name(Method method);

struct Limits {
  double cap_s = 300;  ///< a solve that takes longer is stopped and reported as capped
  int repeats = 3;     ///< of solves shorter than this:
  double repeat_below_s = 5;
  long long most_variables = 2'000'000;  ///< larger problems are reported as skipped: their factors do not fit into memory
};

/// Does `work` once, and again up to limits.repeats times while it is short; notes wall-clock and processor time in `record`.
/// What `work` throws passes through, with nothing noted.
void repeat(const Limits& limits, Record& record, const std::function<void()>& work);

/// Notes that a solve was stopped by the time cap.
void mark_capped(Record& record, const Limits& limits);

/// Solves with one method and measures: interior and solver are built anew in each repeat and count, the inner domain does not.
/// `setup` overrides the problem's.
Record measure(const Problem& problem, Method method, const Limits& limits, const InteriorSolver::Setup* setup = nullptr);

/// The problem's setup for comparisons of speed: Ipopt starts from half full and its barrier stops at `barrier_target`. For
/// spinning that takes a third of the iterations that a start from the solid and a barrier of 1e-7 take, for rays and voxels alike,
/// and the objective is off by about the target (measured: 4e-5 to 1.1e-4 for 1e-4). Float and stand, which are fast, stay as they
/// are.
InteriorSolver::Setup tuned(const Problem& problem, double barrier_target);

/// What measure() says of an answer besides the time: objective, gap, residual, and residual once meshed.
void judge(const Problem& problem, const Moments& model, const Moments& q, Record& record);

/// Starts a new measurement of the process's peak memory (resident set); 0 MB of what was freed before stays in it.
void reset_peak_memory();
double peak_memory_mb();

/// Seconds on a steady clock.
double now_s();
/// Seconds of processor time of this process, over all threads: hardly changed by other work on the machine.
double processor_s();

}  // namespace rayrep::bench
