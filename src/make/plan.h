#pragma once

#include <functional>
#include <memory>

#include "make/body.h"
#include "make/cavity_maker.h"
#include "rayrep/make/hollow.h"
#include "rayrep/solve/goals.h"
#include "solve/interior_solver.h"

namespace rayrep::detail {

/// How a goal is to be reached on one body: all that solving, making and proving take, and nothing of what the body is for.
/// Benchmarks compare solvers on plans.
struct Plan {
  std::shared_ptr<Body> body;  ///< changed by nobody but who carries the plan out: see HollowOptions::kept
  Goal goal;
  InteriorSolver::Setup setup;
  std::function<double(const Moments&)> error;  ///< see AsBuilt
  Spec spec;                                    ///< filled in: what a judge is to hold the result to
  Moments start = Moments::Zero();              ///< see AsBuilt
  /// Changes what was left open (goal, error and spec), so that a print with these moments is nearly what is wanted; empty: nothing
  /// was left open that would help. What a slicer lays down jumps by layers, and no other inside may have the mass wanted.
  std::function<void(Plan& plan, const Moments& printed)> give_way;
  std::optional<SpinCertificate> certificate;
  /// Says what is proven of a result, given the constant part of the last pass.
  std::function<void(const Plan& plan, const Moments& constant, HollowResult& result)> prove;

  InteriorSolver::Setup solver_setup(const HollowOptions& options) const;
};

/// Plans of the goals. @throws Error{goal} with figures and remedies when it cannot be met
Plan plan(const Mesh& solid, const FloatSpec& spec, const HollowOptions& options, const Progress& progress);
Plan plan(const Mesh& solid, const SpinSpec& spec, const HollowOptions& options, const Progress& progress);
Plan plan(const Mesh& solid, const StandSpec& spec, const HollowOptions& options, const Progress& progress);
/// @throws Error{usage} when all ten numbers are wanted, which takes more than one plan: see make/target.cpp
Plan plan(const Mesh& solid, const TargetSpec& spec, const HollowOptions& options, const Progress& progress);
Plan plan(const Mesh& solid, const PoseSpec& spec, const HollowOptions& options, const Progress& progress);
Plan plan(const Mesh& solid, const DiceSpec& spec, const HollowOptions& options, const Progress& progress);

/// Carries it out with the cavity as what is made.
/// @param correction  if not null: the correction of the constant part that led to what is delivered
HollowResult carry_out(Plan& plan, const HollowOptions& options, const Progress& progress, Moments* correction = nullptr);

/// A target with all ten numbers given: the plan of the nine others, over and over, until the wall makes the mass right.
std::optional<HollowResult> hollow_determined(const Mesh& solid, const TargetSpec& spec, const HollowOptions& options,
                                              const Progress& progress);

/// What Ipopt minimises for a spin.
SpinWeights weights_of(const SpinSpec& spec);

/// Below which a body that stands is at the point of tipping: ten times what a judge asks for.
constexpr double kSmallestTipping_rad = 1e-5;

/// On few rays and without a slicer: enough to tell places, cuts and changes apart.
HollowOptions on_few_rays(const HollowOptions& options);

/// The solid as it will be stored, in the frame given.
Mesh stored(const Mesh& solid, const HollowOptions& options);
/// The body with up = z, its lowest point at z = 0 and its box centred in x and y.
std::shared_ptr<Body> upright_body(const Mesh& solid, const Eigen::Vector3d& up, const Discretisation& discretised,
                                   const HollowOptions& options, const Progress& progress);

/// What is left when so much is cut off below.
Mesh flattened(const Mesh& solid, const Eigen::Vector3d& up, double cut_mm, const Progress& progress);

}  // namespace rayrep::detail
