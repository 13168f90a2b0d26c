#include "rayrep/make/waterline.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "base/text.h"
#include "make/wall_search.h"
#include "rayrep/rays/inner_domain.h"
#include "rayrep/rays/ray_interior.h"
#include "rayrep/solve/goals.h"

namespace rayrep {
namespace {

constexpr int kScanSteps = 80;

/// Part of the hull that a searched waterline leaves dry: a print a little heavier than planned must not sink.
constexpr double kReserveBuoyancy = 0.05;

double grams(double volume_mm3, double density_g_cm3) { return volume_mm3 * density_g_cm3 / 1000; }

Moments solid_moments(const FloatProblem& problem) { return problem.shell + problem.integrals.full(); }

/// The largest volume that the body displaces upright: its hull, or with dry pockets perhaps more.
double capacity_mm3(const FloatProblem& problem) {
  return std::max(mesh_moments(problem.hull)[M1], largest_displacement_mm3(problem.hull, Eigen::Vector3d::UnitZ()));
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

/// States over the range that mass allows, its ends left out.
std::vector<WaterlineState> scan(const FloatProblem& problem, const Progress& progress) {
  const Interval range = range_by_mass(problem);
  std::vector<WaterlineState> states;
  if (range.length() <= 0) return states;
  states.resize(kScanSteps - 1);
  constexpr std::size_t at_once = 16;
  for (std::size_t first = 0; first < states.size(); first += at_once) {
    progress.check();
    tbb::parallel_for(first, std::min(first + at_once, states.size()), [&](std::size_t n) {
      states[n] = at_waterline(problem, range.lo + range.length() * static_cast<double>(n + 1) / kScanSteps);
    });
  }
  return states;
}

bool comes_back(const FloatProblem& problem, const WaterlineState& state) {
  constexpr double tilt = 10 * std::numbers::pi / 180;
  const Eigen::Vector3d centre = state.lowest.moments.segment<3>(MX) / state.lowest.moments[M1];
  FloatingRestOptions options;
  options.fluid_g_cm3 = problem.fluid_g_cm3;
  options.tolerance_rad = 1e-4;
  for (int n = 0; n < 4; ++n) {
    const double azimuth = (n + 0.5) * std::numbers::pi / 2;
    const Eigen::Vector3d up(std::sin(tilt) * std::cos(azimuth), std::sin(tilt) * std::sin(azimuth), std::cos(tilt));
    const FloatingRest rest =
        floating_rest(problem.hull, grams(state.lowest.moments[M1], problem.density_g_cm3), centre, up, options);
    if (!rest.rests() || rest.took_water || std::acos(std::clamp(rest.up.z(), -1.0, 1.0)) > 0.5 * std::numbers::pi / 180)
      return false;
  }
  return true;
}

/// The inner domain's volume for another wall, mm^3, at a resolution that is enough for advice.
double inner_volume(const SurfaceQuery& surface, double wall_mm, double size_mm, const Progress& progress) {
  InnerDomainOptions options;
  options.wall_mm = wall_mm;
  options.ray_spacing_mm = options.field_spacing_mm = size_mm / 80;
  Progress quiet;
  quiet.cancelled = progress.cancelled;
  return inner_domain(surface, options, quiet).rays.volume_mm3();
}

/// A wall with which the shell weighs no more than `shell_mm3` of material.
std::optional<double> wall_for_shell(const FloatProblem& problem, double shell_mm3, const SurfaceQuery& surface,
                                     const Progress& progress) {
  const double solid_mm3 = solid_moments(problem)[M1];
  const double size = bounding_box(surface.mesh()).sizes().maxCoeff();
  return detail::thinner_wall(problem.wall_mm,
                              [&](double wall) { return solid_mm3 - inner_volume(surface, wall, size, progress) <= shell_mm3; });
}

/// What makes a shell light enough for `available_mm3` of material; with 2 % to spare among the remedies.
std::string lighter(const FloatProblem& problem, double available_mm3, const SurfaceQuery& surface, const Progress& progress,
                    std::vector<std::string>& remedies) {
  std::string text;
  if (const auto wall = wall_for_shell(problem, available_mm3, surface, progress)) {
    text += "make the wall " + detail::wall_words(*wall) + " mm thick or thinner (--wall), or ";
    remedies.push_back("--wall " + detail::wall_words(*wall));
  }
  const double density = problem.density_g_cm3 * available_mm3 / problem.shell[M1];
  remedies.push_back("--density " + number(0.98 * density, 3));
  return text + "use a material lighter than " + number(density, 3) + " g/cm3 (--density)";
}

/// Whether a body that displaces so much comes to rest at this waterline when it is lowered into the water: above a flooded rim it
/// would have come to rest below that rim, dry.
bool rests_at(const FloatProblem& problem, const WaterlineState& state) {
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  const double lowest = waterline_for_volume(problem.hull, up, state.water.displaced_volume_mm3 * (1 - 1e-9));
  return state.waterline_mm - lowest < 1e-3 * problem.height_mm || hydrostatics(problem.hull, {up, lowest}).dry_interior_mm3 == 0;
}

}  // namespace

WaterlineState at_waterline(const FloatProblem& problem, double waterline_mm) {
  WaterlineState state;
  state.waterline_mm = waterline_mm;
  state.water = hydrostatics(problem.hull, {Eigen::Vector3d::UnitZ(), waterline_mm});
  state.displaced_g = grams(state.water.displaced_volume_mm3, problem.fluid_g_cm3);
  const double material_mm3 = state.water.displaced_volume_mm3 * problem.fluid_g_cm3 / problem.density_g_cm3;
  if (material_mm3 < problem.shell[M1] || material_mm3 > solid_moments(problem)[M1] || material_mm3 <= 0) return state;
  if (!rests_at(problem, state)) return state;
  const Goal goal = float_goal(material_mm3, state.water.centre_of_buoyancy_mm.head<2>(), problem.diagonal_mm);
  state.lowest = solve_quadric(goal, problem.integrals, problem.shell);
  state.attainable = state.lowest.converged;
  if (state.attainable)
    state.metacentric_height_mm = state.water.metacentre_mm({Eigen::Vector3d::UnitZ(), waterline_mm}).z() -
                                  state.lowest.moments[MZ] / state.lowest.moments[M1];
  return state;
}

std::optional<double> best_waterline(const FloatProblem& problem, const Progress& progress) {
  const std::vector<WaterlineState> states = scan(problem, progress);
  const double most_mm3 = (1 - kReserveBuoyancy) * capacity_mm3(problem);
  const auto usable = [&](std::size_t n) {
    return n > 0 && n + 1 < states.size() && states[n + 1].water.displaced_volume_mm3 <= most_mm3 && states[n - 1].attainable &&
           states[n].attainable && states[n + 1].attainable && states[n].metacentric_height_mm > 0;
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
    // The top of the curve lies between the neighbours, which can be met too.
    Interval bracket{states[n - 1].waterline_mm, states[n + 1].waterline_mm};
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
    const WaterlineState top = at_waterline(problem, 0.5 * (bracket.lo + bracket.hi));
    // At the edge of the range the curve has no top; stay where both neighbours can be met.
    const bool has_top = usable(n - 1) && usable(n + 1) && top.metacentric_height_mm > states[n].metacentric_height_mm;
    return has_top && comes_back(problem, top) ? top.waterline_mm : states[n].waterline_mm;
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
    if (length > 0) columns.push_back({inner.grid.at(ray) - target_mm, length * inner.grid.cell_area_mm2()});
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

Explanation explain_unattainable(const FloatProblem& problem, const WaterlineState& state, const SurfaceQuery& surface,
                                 const Progress& progress) {
  const double shell_g = grams(problem.shell[M1], problem.density_g_cm3);
  const double solid_g = grams(solid_moments(problem)[M1], problem.density_g_cm3);
  const double available_mm3 = state.displaced_g * 1000 / problem.density_g_cm3;
  const Interval range = range_by_mass(problem);
  std::vector<std::string> remedies;
  const std::string line = "a waterline " + number(state.waterline_mm, 2) + " mm above the lowest point displaces " +
                           number(state.displaced_g, 2) + " g";
  if (available_mm3 < problem.shell[M1]) {
    if (range.length() <= 0) return explain_no_waterline(problem, surface, progress);
    std::string deeper = number(range.lo, 2) + " mm (--waterline";
    for (const WaterlineState& other : scan(problem, progress))
      if (other.attainable && other.metacentric_height_mm > 0) {
        remedies.push_back("--waterline " + number(other.waterline_mm, 2));
        if (other.waterline_mm > range.lo + 0.05)
          deeper += "; from about " + number(other.waterline_mm, 2) + " mm on it also balances";
        break;
      }
    const std::string text = "The shell alone weighs " + number(shell_g, 2) + " g, but " + line + ": float it deeper than " +
                             deeper + "), or " + lighter(problem, available_mm3, surface, progress, remedies) + ".";
    return {text, remedies};
  }
  if (available_mm3 > solid_moments(problem)[M1])
    return {"Even completely solid it weighs only " + number(solid_g, 2) + " g, but " + line + ": float it shallower than " +
                number(range.hi, 2) + " mm (--waterline), or use a material heavier than " +
                number(problem.density_g_cm3 * available_mm3 / solid_moments(problem)[M1], 3) + " g/cm3 (--density).",
            {"--waterline " + number(0.98 * range.hi, 2),
             "--density " + number(1.02 * problem.density_g_cm3 * available_mm3 / solid_moments(problem)[M1], 3)}};

  if (!rests_at(problem, state)) {
    const double dry = waterline_for_volume(problem.hull, Eigen::Vector3d::UnitZ(), state.water.displaced_volume_mm3);
    return {"It does not stay at this waterline: " + line +
                " because an open hollow of the body is full of water then; let down with the hollow dry it floats at " +
                number(dry, 2) + " mm: use a waterline below the rim.",
            {"--waterline " + number(dry, 2)}};
  }
  const double offset =
      smallest_offset_mm(problem.inner, problem.shell, available_mm3, state.water.centre_of_buoyancy_mm.head<2>());
  std::string text = "It cannot be balanced: " + line + ", and with that mass no interior brings the centre of mass closer than " +
                     number(offset, 2) + " mm (horizontally) to the centre of buoyancy.";
  const std::vector<WaterlineState> states = scan(problem, progress);
  const WaterlineState* nearest = nullptr;
  for (const WaterlineState& other : states)
    if (other.attainable && other.metacentric_height_mm > 0 &&
        (!nearest || std::abs(other.waterline_mm - state.waterline_mm) < std::abs(nearest->waterline_mm - state.waterline_mm)))
      nearest = &other;
  if (nearest) {
    remedies.push_back("--waterline " + number(nearest->waterline_mm, 2));
    text += " The nearest waterline that can be met is about " + number(nearest->waterline_mm, 2) +
            " mm (--waterline); a thinner wall (--wall) leaves more freedom.";
  } else {
    text += " No other waterline can be met either: try a thinner wall (--wall) or another attitude (--up).";
  }
  return {text, remedies};
}

Explanation explain_no_waterline(const FloatProblem& problem, const SurfaceQuery& surface, const Progress& progress) {
  const double hull_mm3 = capacity_mm3(problem);
  const double available_mm3 = hull_mm3 * problem.fluid_g_cm3 / problem.density_g_cm3;
  const double shell_g = grams(problem.shell[M1], problem.density_g_cm3);
  if (available_mm3 <= problem.shell[M1]) {
    std::vector<std::string> remedies;
    const std::string text = "It sinks at any waterline: the shell alone weighs " + number(shell_g, 2) +
                             " g, and completely under water it displaces only " + number(grams(hull_mm3, problem.fluid_g_cm3), 2) +
                             " g: " + lighter(problem, available_mm3, surface, progress, remedies) + ".";
    return {text, remedies};
  }

  const std::vector<WaterlineState> states = scan(problem, progress);
  std::size_t attainable = 0;
  const WaterlineState* best = nullptr;
  double offset = std::numeric_limits<double>::infinity();
  double offset_at = 0;
  for (const WaterlineState& state : states) {
    if (state.attainable) {
      ++attainable;
      if (!best || state.metacentric_height_mm > best->metacentric_height_mm) best = &state;
    } else if (attainable == 0) {
      progress.check();
      const double at = smallest_offset_mm(problem.inner, problem.shell, state.displaced_g * 1000 / problem.density_g_cm3,
                                           state.water.centre_of_buoyancy_mm.head<2>());
      if (at < offset) {
        offset = at;
        offset_at = state.waterline_mm;
      }
    }
  }
  if (best && best->metacentric_height_mm <= 0)
    return {"It does not float upright at any waterline: even with the lowest centre of mass the metacentric height is negative, " +
                number(best->metacentric_height_mm, 2) + " mm at best (waterline " + number(best->waterline_mm, 2) +
                " mm). Try a denser material (--density), a thinner wall (--wall) or another attitude (--up).",
            {}};
  if (best)
    return {
        "It does not float upright at any waterline: where the metacentric height is positive (at best " +
            number(best->metacentric_height_mm, 2) + " mm, waterline " + number(best->waterline_mm, 2) +
            " mm) it still does not come back when let go tilted by 10 degrees. Name a waterline (--waterline) to see the figures, "
            "or try another attitude (--up) or a denser material (--density).",
        {}};
  return {"It cannot be balanced at any waterline: the centre of mass comes no closer than " + number(offset, 2) +
              " mm (horizontally) to the centre of buoyancy, at a waterline of " + number(offset_at, 2) +
              " mm. Try a thinner wall (--wall), a lighter material (--density) or another attitude (--up).",
          {}};
}

}  // namespace rayrep
