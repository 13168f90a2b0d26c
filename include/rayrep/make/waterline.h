#pragma once

#include <optional>
#include <string>
#include <vector>

#include "rayrep/base/progress.h"
#include "rayrep/mesh/mesh.h"
#include "rayrep/mesh/surface_query.h"
#include "rayrep/physics/hydrostatics.h"
#include "rayrep/physics/moments.h"
#include "rayrep/rays/ray_rep.h"
#include "rayrep/solve/quadric.h"

namespace rayrep {

/// A body that shall float, in the working frame: z up, its lowest point at z = 0.
struct FloatProblem {
  const Mesh& hull;               ///< what the fluid touches, see hydrostatics
  const RayRep& inner;            ///< inner domain
  const RayIntegrals& integrals;  ///< over it
  Moments shell;                  ///< moments of everything outside the inner domain, unit density
  double fluid_g_cm3 = 1.0;
  double density_g_cm3 = 1.24;
  double wall_mm = 1.2;
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

/// The waterline of largest metacentric height among those that can be met and at which the body comes back upright when let go
/// tilted by 10 degrees (in four directions); none if there is no such waterline. A scan over the height refined by golden section;
/// waterlines at the very edge of what can be met are left out, and so are those that leave less than 5 % of the hull dry: a print
/// a little heavier than planned must not sink. The best one may lie close below the top of the body.
/// @throws Error{interrupted}
std::optional<double> best_waterline(const FloatProblem& problem, const Progress& progress = {});

/// The smallest horizontal distance between centre of mass and `target_mm` over all interiors of a given mass or of any mass, by
/// maximising the support function of the attainable set over directions. theory.md (17). 0 when the target can be reached.
/// @param material_mm3  volume of the whole body, between that of the shell and that of the solid; none: any
double smallest_offset_mm(const RayRep& inner, const Moments& shell, std::optional<double> material_mm3,
                          const Eigen::Vector2d& target_mm);

/// Why a goal cannot be met, for a user to read, and what would make it possible, as for Error::remedies.
struct Explanation {
  std::string text;
  std::vector<std::string> remedies;
};

/// Why a waterline cannot be met, with the numbers.
/// @param surface  of the body in the working frame, for trying other walls
Explanation explain_unattainable(const FloatProblem& problem, const WaterlineState& state, const SurfaceQuery& surface,
                                 const Progress& progress = {});

/// Why no waterline at all can be met.
Explanation explain_no_waterline(const FloatProblem& problem, const SurfaceQuery& surface, const Progress& progress = {});

}  // namespace rayrep
