#include "rayrep/make/waterline.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "base/text.h"
#include "make/comes_back.h"
#include "rayrep/rays/ray_interior.h"
#include "rayrep/solve/goals.h"

namespace rayrep {
namespace {

constexpr int kScanSteps = 80;
constexpr int kFinerSteps = 20;

/// Metacentric height over the diagonal below which no interior is made: a judge asks for half of it.
constexpr double kSmallestHeight = 2e-5;

double grams(double volume_mm3, double density_g_cm3) { return volume_mm3 * density_g_cm3 / 1000; }

/// The inside is infill where it is not solid.
bool sparse(const FloatProblem& problem) { return problem.inner.grid.weight < 1; }

Moments solid_moments(const FloatProblem& problem) { return problem.shell + problem.integrals.full(); }

/// The largest volume that the body displaces upright: its hull, or with dry pockets perhaps more.
double capacity_mm3(const FloatProblem& problem) {
  return std::max(mesh_moments(problem.hull.mesh())[M1], largest_displacement_mm3(problem.hull, Eigen::Vector3d::UnitZ()));
}

/// Waterlines (bottom to top) between those at which a body of the shell's mass and one of the solid's come to rest. In between
/// there may be heights at which no body does: the displaced volume falls where a pocket is flooded.
Interval range_by_mass(const FloatProblem& problem) {
  const double hull_mm3 = capacity_mm3(problem);
  const double shell_mm3 = problem.shell[M1] * problem.density_g_cm3 / problem.fluid_g_cm3;
  const double solid_mm3 = solid_moments(problem)[M1] * problem.density_g_cm3 / problem.fluid_g_cm3;
  if (shell_mm3 >= hull_mm3) return {0, 0};
  return {waterline_for_volume(problem.hull, Eigen::Vector3d::UnitZ(), shell_mm3),
          solid_mm3 >= hull_mm3 ? problem.height_mm : waterline_for_volume(problem.hull, Eigen::Vector3d::UnitZ(), solid_mm3)};
}

/// States at `steps` - 1 heights within a range, its ends left out.
std::vector<WaterlineState> scan(const FloatProblem& problem, const Interval& range, int steps, const Progress& progress) {
  std::vector<WaterlineState> states;
  if (range.length() <= 0) return states;
  states.resize(static_cast<std::size_t>(steps) - 1);
  constexpr std::size_t at_once = 16;
  for (std::size_t first = 0; first < states.size(); first += at_once) {
    progress.check();
    tbb::parallel_for(first, std::min(first + at_once, states.size()), [&](std::size_t n) {
      states[n] = at_waterline(problem, range.lo + range.length() * static_cast<double>(n + 1) / steps);
    });
  }
  return states;
}

/// Whether a body that displaces so much comes to rest at this waterline when it is lowered into the water: above a flooded rim it
/// would have come to rest below that rim, dry.
bool rests_at(const FloatProblem& problem, const WaterlineState& state) {
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  const double lowest = waterline_for_volume(problem.hull, up, state.water.displaced_volume_mm3 * (1 - 1e-9));
  return state.waterline_mm - lowest < 1e-3 * problem.height_mm || hydrostatics(problem.hull, {up, lowest}).dry_interior_mm3 == 0;
}

/// Where the metacentric height is largest between two waterlines, by golden section.
WaterlineState highest_between(const FloatProblem& problem, double lowest_mm, double highest_mm, const Progress& progress) {
  Interval bracket{lowest_mm, highest_mm};
  const double ratio = 0.5 * (3 - std::sqrt(5.0));
  const auto height = [&problem](double w) {
    const WaterlineState state = at_waterline(problem, w);
    return state.attainable ? state.metacentric_height_mm : -std::numeric_limits<double>::infinity();
  };
  double left = bracket.lo + ratio * bracket.length();
  double right = bracket.hi - ratio * bracket.length();
  double at_left = height(left);
  double at_right = height(right);
  for (int step = 0; step < 8; ++step) {
    progress.check();
    if (at_left > at_right) {
      bracket.hi = right;
      right = left;
      at_right = at_left;
      left = bracket.lo + ratio * bracket.length();
      at_left = height(left);
    } else {
      bracket.lo = left;
      left = right;
      at_left = at_right;
      right = bracket.hi - ratio * bracket.length();
      at_right = height(right);
    }
  }
  return at_waterline(problem, 0.5 * (bracket.lo + bracket.hi));
}

/// The waterline of largest metacentric height near those of a scan, see best_waterline.
std::optional<double> best_of(const FloatProblem& problem, const std::vector<WaterlineState>& states, double reserve,
                              const Progress& progress) {
  const double most_mm3 = (1 - reserve) * capacity_mm3(problem);
  const auto usable = [&](std::size_t n) {
    return n > 0 && n + 1 < states.size() && states[n + 1].water.displaced_volume_mm3 <= most_mm3 && states[n - 1].attainable &&
           states[n].attainable && states[n + 1].attainable &&
           states[n].metacentric_height_mm > kSmallestHeight * problem.diagonal_mm;
  };
  std::vector<std::size_t> order;
  for (std::size_t n = 0; n < states.size(); ++n)
    if (usable(n)) order.push_back(n);
  std::stable_sort(order.begin(), order.end(), [&states](std::size_t a, std::size_t b) {
    return states[a].metacentric_height_mm > states[b].metacentric_height_mm;
  });
  for (const std::size_t n : order) {
    progress.check();
    if (!comes_back(problem, states[n])) continue;
    const WaterlineState top = highest_between(problem, states[n - 1].waterline_mm, states[n + 1].waterline_mm, progress);
    // At the edge of the range the curve has no top; stay where both neighbours can be met.
    const bool has_top = usable(n - 1) && usable(n + 1) && top.metacentric_height_mm > states[n].metacentric_height_mm;
    return has_top && comes_back(problem, top) ? top.waterline_mm : states[n].waterline_mm;
  }
  return std::nullopt;
}

/// Volume of material that weighs as much as is displaced.
double material_mm3(const FloatProblem& problem, const WaterlineState& state) {
  return state.water.displaced_volume_mm3 * problem.fluid_g_cm3 / problem.density_g_cm3;
}

/// Whether some interior weighs what is displaced.
bool can_weigh(const FloatProblem& problem, const WaterlineState& state) {
  const double wanted = material_mm3(problem, state);
  return wanted >= problem.shell[M1] && wanted <= solid_moments(problem)[M1] && wanted > 0;
}

/// Fills in what an interior of the lowest centre of mass does in this state of the water. @param metacentre_mm  its height
void find_lowest(const FloatProblem& problem, double metacentre_mm, WaterlineState& state) {
  const Goal goal = float_goal(material_mm3(problem, state), state.water.centre_of_buoyancy_mm.head<2>(), problem.diagonal_mm);
  state.lowest = solve_quadric(goal, problem.integrals, problem.shell);
  state.attainable = state.lowest.converged;
  if (state.attainable) state.metacentric_height_mm = metacentre_mm - state.lowest.moments[MZ] / state.lowest.moments[M1];
}

}  // namespace

WaterlineState at_waterline(const FloatProblem& problem, double waterline_mm) {
  WaterlineState state;
  state.waterline_mm = waterline_mm;
  const Waterplane plane{Eigen::Vector3d::UnitZ(), waterline_mm};
  state.water = hydrostatics(problem.hull, plane);
  state.displaced_g = grams(state.water.displaced_volume_mm3, problem.fluid_g_cm3);
  if (can_weigh(problem, state) && rests_at(problem, state)) find_lowest(problem, state.water.metacentre_mm(plane).z(), state);
  return state;
}

WaterlineState submerged(const FloatProblem& problem) {
  WaterlineState state;
  state.waterline_mm = problem.height_mm;
  state.water = submerged_hydrostatics(problem.hull);
  state.displaced_g = grams(state.water.displaced_volume_mm3, problem.fluid_g_cm3);
  if (can_weigh(problem, state)) find_lowest(problem, state.water.centre_of_buoyancy_mm.z(), state);
  return state;
}

namespace {

/// Of a body of the state's centre of mass and `factor` times its mass.
detail::LetGo let_go(const FloatProblem& problem, const WaterlineState& state, double factor) {
  const Moments& s = state.lowest.moments;
  return {problem.hull, problem.fluid_g_cm3, factor * grams(s[M1], problem.density_g_cm3), s.segment<3>(MX) / s[M1]};
}

}  // namespace

bool comes_back(const FloatProblem& problem, const WaterlineState& state) {
  constexpr double degree = std::numbers::pi / 180;
  return state.attainable && state.metacentric_height_mm >= kSmallestHeight * problem.diagonal_mm &&
         detail::comes_back(let_go(problem, state, 1), 4, 0.5 * degree) &&
         detail::comes_back(let_go(problem, state, 1.01), 3, 0.9 * degree);
}

std::optional<double> best_waterline(const FloatProblem& problem, double reserve, const Progress& progress) {
  const std::vector<WaterlineState> states = scan(problem, range_by_mass(problem), kScanSteps, progress);
  if (const auto best = best_of(problem, states, reserve, progress)) return best;
  // Between what can be met and what cannot there may be more than the scan has seen.
  for (std::size_t n = 1; n + 1 < states.size(); ++n) {
    if (!states[n].attainable || (n > 1 && states[n - 1].attainable)) continue;
    const std::vector<WaterlineState> finer =
        scan(problem, {states[n - 1].waterline_mm, states[n + 1].waterline_mm}, kFinerSteps, progress);
    if (const auto best = best_of(problem, finer, reserve, progress)) return best;
  }
  return std::nullopt;
}

double smallest_offset_mm(const RayRep& inner, const Moments& shell, std::optional<double> material_mm3,
                          const Eigen::Vector2d& target_mm) {
  struct Column {
    Eigen::Vector2d xy;
    double volume;
  };
  std::vector<Column> columns;
  for (std::size_t ray = 0; ray < inner.grid.size(); ++ray) {
    double length = 0;
    for (std::uint32_t n = inner.first[ray]; n < inner.first[ray + 1]; ++n) length += inner.intervals[n].length();
    if (length > 0) columns.push_back({inner.grid.at(ray) - target_mm, length * inner.grid.weighted_area_mm2()});
  }
  // min of direction.(centre of mass - target): fill the columns from the lowest side until the mass is reached.
  std::vector<std::pair<double, double>> along(columns.size());
  const auto support = [&](double angle) {
    const Eigen::Vector2d direction(std::cos(angle), std::sin(angle));
    for (std::size_t n = 0; n < columns.size(); ++n) along[n] = {direction.dot(columns[n].xy), columns[n].volume};
    std::sort(along.begin(), along.end());
    double moment = direction.dot(shell.segment<2>(MX) - shell[M1] * target_mm);
    double volume = shell[M1];
    for (const auto& [position, available] : along) {
      // With the mass given, fill up to it; else as long as that moves the centre further down.
      const double used = material_mm3 ? std::min(*material_mm3 - volume, available) : position * volume < moment ? available : 0;
      if (used <= 0) break;
      moment += position * used;
      volume += used;
    }
    return moment / volume;
  };
  double best_angle = 0;
  double best = -std::numeric_limits<double>::infinity();
  constexpr int directions = 48;
  for (int n = 0; n < directions; ++n) {
    const double angle = 2 * std::numbers::pi * n / directions;
    if (const double value = support(angle); value > best) {
      best = value;
      best_angle = angle;
    }
  }
  for (double step = std::numbers::pi / directions; step > 1e-4; step *= 0.5)
    for (const double angle : {best_angle - step, best_angle + step})
      if (const double value = support(angle); value > best) {
        best = value;
        best_angle = angle;
      }
  return std::max(0.0, best);
}

std::string why_unattainable(const FloatProblem& problem, const WaterlineState& state) {
  const double shell_g = grams(problem.shell[M1], problem.density_g_cm3);
  const double solid_g = grams(solid_moments(problem)[M1], problem.density_g_cm3);
  const double available_mm3 = state.displaced_g * 1000 / problem.density_g_cm3;
  const Interval range = range_by_mass(problem);
  const std::string line = "a waterline " + number(state.waterline_mm, 2) + " mm above the lowest point displaces " +
                           number(state.displaced_g, 2) + " g";
  if (available_mm3 < problem.shell[M1])
    return (sparse(problem) ? "Sparse all through it weighs " : "The shell alone weighs ") + number(shell_g, 2) + " g, but " +
           line + (range.length() > 0 ? ": it floats deeper than " + number(range.lo, 2) + " mm." : ": it sinks.") +
           " At this waterline it takes a material lighter than " +
           number(problem.density_g_cm3 * available_mm3 / problem.shell[M1], 3) + " g/cm3.";
  if (available_mm3 > solid_moments(problem)[M1])
    return (problem.inner.grid.weight > 1 ? "Even with a core that takes all the room it weighs only "
                                          : "Even completely solid it weighs only ") +
           number(solid_g, 2) + " g, but " + line + ": it floats shallower than " + number(range.hi, 2) +
           " mm. At this waterline it takes a material heavier than " +
           number(problem.density_g_cm3 * available_mm3 / solid_moments(problem)[M1], 3) + " g/cm3.";
  if (!rests_at(problem, state))
    return "It does not stay at this waterline: " + line +
           " because an open hollow of the body is full of water then; let down with the hollow dry it floats at " +
           number(waterline_for_volume(problem.hull, Eigen::Vector3d::UnitZ(), state.water.displaced_volume_mm3), 2) + " mm.";
  if (!state.attainable) {
    const double offset =
        smallest_offset_mm(problem.inner, problem.shell, available_mm3, state.water.centre_of_buoyancy_mm.head<2>());
    return "It cannot be balanced: " + line + ", and with that mass no interior brings the centre of mass closer than " +
           number(offset, 2) + " mm (horizontally) to the centre of buoyancy.";
  }
  if (state.metacentric_height_mm < kSmallestHeight * problem.diagonal_mm)
    return "It cannot float upright at a waterline of " + number(state.waterline_mm, 2) +
           " mm: with the lowest possible centre of mass the metacentric height is " + number(state.metacentric_height_mm, 2) +
           " mm, and it must be positive.";
  return "It does not float upright at a waterline of " + number(state.waterline_mm, 2) + " mm: the metacentric height is " +
         number(state.metacentric_height_mm, 2) +
         " mm, but let go tilted by 10 degrees it does not come back, or not with 1 % more plastic than planned.";
}

std::string why_not_submerged(const FloatProblem& problem, const WaterlineState& state) {
  const double displaced_g = state.displaced_g;
  const std::string line = "wholly under water it displaces " + number(displaced_g, 2) + " g";
  const double shell_g = grams(problem.shell[M1], problem.density_g_cm3);
  const double solid_g = grams(solid_moments(problem)[M1], problem.density_g_cm3);
  if (shell_g > displaced_g)
    return (sparse(problem) ? "It sinks: sparse all through it weighs " : "It sinks: the shell alone weighs ") +
           number(shell_g, 2) + " g, and " + line + ". It takes a material lighter than " +
           number(problem.density_g_cm3 * displaced_g / shell_g, 3) + " g/cm3.";
  if (solid_g < displaced_g)
    return (problem.inner.grid.weight > 1 ? "It rises: even with a core that takes all the room it weighs only "
                                          : "It rises: even completely solid it weighs only ") +
           number(solid_g, 2) + " g, and " + line + ". It takes a material heavier than " +
           number(problem.density_g_cm3 * displaced_g / solid_g, 3) + " g/cm3.";
  if (!state.attainable)
    return "It cannot be balanced: " + line + ", and with that mass no interior brings the centre of mass closer than " +
           number(smallest_offset_mm(problem.inner, problem.shell, material_mm3(problem, state),
                                     state.water.centre_of_buoyancy_mm.head<2>()),
                  2) +
           " mm (horizontally) to the centre of buoyancy.";
  if (state.metacentric_height_mm < kSmallestHeight * problem.diagonal_mm)
    return "It cannot hang upright under water: the lowest possible centre of mass lies " +
           number(-state.metacentric_height_mm, 2) + " mm above the centre of buoyancy, and it must lie below.";
  return {};
}

std::string why_no_waterline(const FloatProblem& problem, double reserve, const Progress& progress) {
  const double hull_mm3 = capacity_mm3(problem);
  if (hull_mm3 * problem.fluid_g_cm3 / problem.density_g_cm3 <= problem.shell[M1])
    return (sparse(problem) ? "It sinks at any waterline: sparse all through it weighs "
                            : "It sinks at any waterline: the shell alone weighs ") +
           number(grams(problem.shell[M1], problem.density_g_cm3), 2) + " g, and completely under water it displaces only " +
           number(grams(hull_mm3, problem.fluid_g_cm3), 2) + " g. It takes a material lighter than " +
           number(hull_mm3 * problem.fluid_g_cm3 / problem.shell[M1], 3) + " g/cm3.";

  const WaterlineState* best = nullptr;
  double offset = std::numeric_limits<double>::infinity();
  double offset_at = 0;
  const std::vector<WaterlineState> states = scan(problem, range_by_mass(problem), kScanSteps, progress);
  bool enough_dry = false;
  for (const WaterlineState& state : states) {
    if (state.attainable) {
      // Of those that leave enough dry, or if there are none of all.
      const bool dry = state.water.displaced_volume_mm3 <= (1 - reserve) * hull_mm3;
      if (!best || dry > enough_dry || (dry == enough_dry && state.metacentric_height_mm > best->metacentric_height_mm))
        best = &state;
      enough_dry = enough_dry || dry;
    } else if (!best) {
      progress.check();
      const double at = smallest_offset_mm(problem.inner, problem.shell, state.displaced_g * 1000 / problem.density_g_cm3,
                                           state.water.centre_of_buoyancy_mm.head<2>());
      if (at < offset) {
        offset = at;
        offset_at = state.waterline_mm;
      }
    }
  }
  if (!best)
    return "It cannot be balanced at any waterline: the centre of mass comes no closer than " + number(offset, 2) +
           " mm (horizontally) to the centre of buoyancy, at a waterline of " + number(offset_at, 2) + " mm.";
  const std::string at_best =
      number(best->metacentric_height_mm, 2) + " mm at best (waterline " + number(best->waterline_mm, 2) + " mm)";
  const std::string dry = number(100 * reserve, 1) + " % of its volume dry (--reserve)";
  if (best->metacentric_height_mm < kSmallestHeight * problem.diagonal_mm)
    return "It does not float upright at any waterline that leaves " + dry +
           ": even with the lowest centre of mass the metacentric height is " + at_best + ", and it must be positive.";
  if (!enough_dry)
    return "It does not float upright with " + dry +
           ": it can only be balanced deeper, where a print a little too heavy sinks. The metacentric height is " + at_best +
           " there.";
  return "It does not float upright at any waterline that leaves " + dry + ": where the metacentric height is positive, " +
         at_best + ", it still does not come back when let go tilted by 10 degrees, or not with 1 % more plastic than planned.";
}

}  // namespace rayrep
