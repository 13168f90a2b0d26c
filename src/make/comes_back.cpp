#include "make/comes_back.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace rayrep::detail {

bool comes_back(const LetGo& body, int directions, double rest_rad) {
  constexpr double tilt = 10 * std::numbers::pi / 180;
  FloatingRestOptions options;
  options.fluid_g_cm3 = body.fluid_g_cm3;
  options.tolerance_rad = 1e-4;
  for (int n = 0; n < directions; ++n) {
    const double azimuth = (n + 0.5) * 2 * std::numbers::pi / directions;
    const Eigen::Vector3d up(std::sin(tilt) * std::cos(azimuth), std::sin(tilt) * std::sin(azimuth), std::cos(tilt));
    const FloatingRest rest = floating_rest(body.hull, body.mass_g, body.centre_mm, up, options);
    if (!rest.rests() || rest.took_water || std::acos(std::clamp(rest.up.z(), -1.0, 1.0)) > rest_rad) return false;
  }
  return true;
}

}  // namespace rayrep::detail
