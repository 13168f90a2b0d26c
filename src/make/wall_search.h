#pragma once

#include <functional>
#include <optional>
#include <string>

namespace rayrep::detail {

/// The thinnest wall that is ever proposed: what the finest printers print.
constexpr double kThinnestWall_mm = 0.2;

/// A little less than a wall with which something will do, the thickest one found by halving `asked_mm` down to the thinnest and
/// bisection; at the very edge there is no room to correct the mesh. None when none was found.
std::optional<double> thinner_wall(double asked_mm, const std::function<bool(double)>& will_do);

/// As it is told: rounded down to 0.01 mm.
std::string wall_words(double wall_mm);

}  // namespace rayrep::detail
