#pragma once

#include <optional>
#include <string>

#include "rayrep/base/progress.h"
#include "rayrep/mesh/mesh.h"
#include "rayrep/physics/hydrostatics.h"
#include "rayrep/physics/moments.h"
#include "rayrep/rays/ray_rep.h"
#include "rayrep/solve/quadric.h"

namespace rayrep {

/// A body that shall float, in the working frame: z up, its lowest point at z = 0.
struct FloatProblem {
  const PreparedHull& hull;       ///< what the fluid touches
  const RayRep& inner;            ///< inner domain
  const RayIntegrals& integrals;  ///< over it
  Moments shell;                  ///< moments of everything outside the inner domain, unit density
  double fluid_g_cm3 = 1.0;
  double density_g_cm3 = 1.24;
  double height_mm = 0;    ///< of the body
  double diagonal_mm = 0;  ///< of its bounding box
};

/// What a body can do at a waterline.
struct WaterlineState {
  double waterline_mm = 0;
  Hydrostatics water;
  double displaced_g = 0;
  bool attainable = false;           ///< some interior meets mass and both offsets
  QuadricSolution lowest;            ///< the lowest centre of mass, when attainable
  double metacentric_height_mm = 0;  ///< GM of it
};

WaterlineState at_waterline(const FloatProblem& problem, double waterline_mm);

/// What it can do wholly under the fluid, any pockets of it full: displaced is its whole hull, there is no waterplane, and the
/// metacentric height is the depth of the centre of mass below the centre of buoyancy. The waterline is at its top. theory.md (58).
WaterlineState submerged(const FloatProblem& problem);

/// Whether the body with the lowest centre of mass floats upright there: the metacentric height is at least 2e-5 of the diagonal
/// (a judge asks for half of that), and let go tilted by 10 degrees in four directions it comes back upright, dry; so it does, to
/// within 0.9 degrees, with 1 % more of the plastic everywhere.
bool comes_back(const FloatProblem& problem, const WaterlineState& state);

/// The waterline of largest metacentric height among those that can be met and at which it comes back; none if there is no such
/// waterline. A scan over the height refined by golden section; waterlines at the very edge of what can be met are left out, and so
/// are those that leave less than `reserve` of the hull dry: a print a little heavier than planned must not sink. The best one may
/// lie close below the top of the body.
/// @throws Error{interrupted}
std::optional<double> best_waterline(const FloatProblem& problem, double reserve, const Progress& progress = {});

/// The smallest horizontal distance between centre of mass and `target_mm` over all interiors of a given mass or of any mass, by
/// maximising the support function of the attainable set over directions. theory.md (17). 0 when the target can be reached.
/// @param material_mm3  volume of the whole body, between that of the shell and that of the solid; none: any
double smallest_offset_mm(const RayRep& inner, const Moments& shell, std::optional<double> material_mm3,
                          const Eigen::Vector2d& target_mm);

/// Why a waterline is not one at which it comes back, for people, with the numbers.
std::string why_unattainable(const FloatProblem& problem, const WaterlineState& state);

/// Why it cannot hang upright under water; empty: it can, with the centre of mass at least 2e-5 of the diagonal below the centre of
/// buoyancy.
std::string why_not_submerged(const FloatProblem& problem, const WaterlineState& state);

/// Why there is no waterline at all.
std::string why_no_waterline(const FloatProblem& problem, double reserve, const Progress& progress = {});

}  // namespace rayrep
