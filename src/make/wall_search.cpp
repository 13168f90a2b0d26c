#include "make/wall_search.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/text.h"

namespace rayrep::detail {

std::optional<double> thinner_wall(double asked_mm, const std::function<bool(double)>& will_do) {
  constexpr double tolerance_mm = 0.02;
  constexpr double room = 0.97;
  const auto halved = [](double wall) { return std::max(kThinnestWall_mm, 0.5 * wall); };
  double thick = asked_mm;
  double thin = halved(asked_mm);
  while (thin < thick && !will_do(thin)) thick = std::exchange(thin, halved(thin));
  if (!(thin < thick)) return std::nullopt;
  while (thick - thin > tolerance_mm) {
    const double middle = 0.5 * (thin + thick);
    (will_do(middle) ? thin : thick) = middle;
  }
  return std::max(kThinnestWall_mm, room * thin);
}

std::string wall_words(double wall_mm) { return number(std::floor(wall_mm * 100) / 100, 2); }

}  // namespace rayrep::detail
