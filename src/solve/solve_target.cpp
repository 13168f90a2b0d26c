#include "rayrep/solve/solve_target.h"

#include <cassert>
#include <optional>
#include <utility>
#include <vector>

namespace rayrep {

TargetSolution solve_target(const TargetGoal::Setup& setup, const RayIntegrals& rays, const Moments& constant) {
  assert(!TargetGoal(setup).determined());
  std::vector<TargetGoal::Wish> inertia = setup.order;
  inertia.insert(inertia.end(), {{M1}, {MXX}, {MYY}});
  std::optional<TargetSolution> tried;
  for (const double weight : {1e-2, 3e-2, 1e-1, 3e-1, 1.0})
    for (const auto& order : {setup.order, inertia}) {
      TargetGoal::Setup attempt = setup;
      attempt.order = order;
      attempt.weight = weight;
      TargetGoal goal(attempt);
      const QuadricSolution solution = solve_quadric(goal, rays, constant);
      tried.emplace(TargetSolution{std::move(goal), solution});
      if (solution.converged || solution.infeasible) return *tried;
    }
  return *tried;
}

}  // namespace rayrep
