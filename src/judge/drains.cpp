#include "judge/drains.h"

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "judge/figures.h"
#include "judge/inserts.h"
#include "mesh/surface_gap.h"
#include "physics/trapped.h"
#include "rayrep/mesh/boolean.h"
#include "rayrep/mesh/surface_query.h"

namespace rayrep::verify_detail {
namespace {

constexpr double kMostTrapped = 0.01;
constexpr double kLeastClearance = 0.9;
constexpr double kStandsOut_mm = 0.1;

Eigen::Vector3d print_up(const Spec& spec) { return print_of(spec).direction.value_or(up_of(spec)).normalized(); }

std::string held(const Spec& spec) {
  Eigen::Vector3d up = print_up(spec);
  return shown(Setting{.name = "", .value = "", .words = "", .details = "", .place = direction_place("", up)});
}

// What leaves no room for a liquid: the print, and what is put in.
Mesh filled(const Drained& what) {
  if (!what.delivered.has_inserts()) return what.surface.material;
  const std::vector<Mesh> both = {what.surface.material, what.delivered.mesh_of(Part::Role::insert)};
  return with_merged_vertices(combined(both).mesh);
}

// Rooms that what is put in takes up.
std::size_t rooms_taken(const Drained& what) {
  if (!what.delivered.has_inserts()) return 0;
  constexpr double kLeft = 0.01;  // of a room; coordinates are rounded
  const Mesh shells = with_merged_vertices(what.surface.cavities);
  std::size_t taken = 0;
  for (Mesh& room : split(shells, connected_components(shells))) {
    flip(room);
    const std::vector<Mesh> both = {room, what.delivered.mesh_of(Part::Role::insert)};
    const double left_mm3 = mesh_moments(combined(both, {.operation = BooleanOperation::subtract}).mesh)[M1];
    taken += left_mm3 < kLeft * mesh_moments(room)[M1];
  }
  return taken;
}

// Of what lies in the cavities of a body held as it is printed, those that it had before, too; hollows of the outside do not count.
Moments stays(const Drained& what) {
  const Eigen::Vector3d up = print_up(what.spec);
  return total(pools_in(filled(what), up)) - total(pools_in(outer_hull(what.surface.holes.sealed), up));
}

bool keeps_resin(const Print& print) { return print.liquid_g_cm3 > 0 && !print.drained; }

std::vector<Mesh> plugs_of(const Delivery& delivered) {
  const Mesh all = with_merged_vertices(delivered.mesh_of(Part::Role::plug));
  return split(all, connected_components(all));
}

// Whether a plug stands in a hole.
bool closes(const Mesh& plug, const Mouth& mouth) {
  const Moments s = mesh_moments(plug);
  if (!(s[M1] > 0)) return false;
  const Eigen::Vector3d from_mouth = s.segment<3>(MX) / s[M1] - mouth.centre_mm;
  const double along = mouth.axis.dot(from_mouth);
  const double reach = (bounding_box(plug).diagonal()).norm();
  return (from_mouth - along * mouth.axis).norm() < 0.25 * mouth.diameter_mm && std::abs(along) < reach;
}

// The smallest distance of plugs from the body; 0 where they meet or one lies in it.
double clearance(const std::vector<Mesh>& plugs, const Mesh& body, const Progress& progress) {
  const SurfaceQuery surface(body);
  double smallest = std::numeric_limits<double>::infinity();
  for (const Mesh& plug : plugs)
    smallest = std::min(smallest, is_inside(surface, plug.vertices.front()) ? 0 : smallest_gap(plug, surface, progress));
  return smallest;
}

void judge_plugs(const Drained& what, const Progress& progress, Verdict& verdict) {
  const Drains& drains = print_of(what.spec).drains;
  const std::vector<Mesh> plugs = plugs_of(what.delivered);
  const std::vector<Mouth>& mouths = what.surface.holes.mouths;
  const auto open = std::count_if(mouths.begin(), mouths.end(), [&](const Mouth& mouth) {
    return std::none_of(plugs.begin(), plugs.end(), [&](const Mesh& plug) { return closes(plug, mouth); });
  });
  double volume_mm3 = 0;
  double stands_out_mm = 0;
  const SurfaceQuery outside(what.original);
  for (const Mesh& plug : plugs) {
    const double own_mm3 = mesh_moments(plug)[M1];
    const bool solid = unbalanced_edges(plug) == 0 && own_mm3 > 0;
    volume_mm3 += own_mm3;
    stands_out_mm =
        solid ? std::max(stands_out_mm, deepest_outside(plug, outside, progress)) : std::numeric_limits<double>::infinity();
  }
  const double clear_mm = clearance(plugs, what.surface.mesh, progress);
  verdict.figures.push_back({.name = "plugs", .words = "", .value = static_cast<double>(plugs.size())});
  verdict.figures.push_back({.name = "plugs_mm3", .words = "plugs", .unit = Unit::mm3, .value = volume_mm3, .digits = 1});
  Figure figure{.name = "plug_clearance_mm", .words = "smallest clearance of a plug", .unit = Unit::mm, .value = {}};
  if (std::isfinite(clear_mm)) figure.value = clear_mm;
  verdict.figures.push_back(figure);
  verdict.criteria.push_back(at_most("plugged", "holes without a plug", static_cast<double>(open), 0));
  if (drains.clearance_mm > 0 && !plugs.empty())
    verdict.criteria.push_back(at_least("plug_clearance", "smallest clearance of a plug, over the one asked for",
                                        clear_mm / drains.clearance_mm, kLeastClearance));
  verdict.criteria.push_back(at_most("plugs_flush", "how far a plug stands out, mm", stands_out_mm, kStandsOut_mm));
  if (open > 0 && plugs.empty())
    verdict.notes.push_back("There are no plugs in what is judged: where they are in a file of their own, name it (--plugs).");
  if (open > 0 || plugs.empty()) return;
  verdict.notes.push_back("Assumed: " + plural(plugs.size(), "plug is", "plugs are") +
                          " glued in flush and tight, after what is inside has run out.");
}

Record record_of(const Mouth& mouth) {
  return {{"x_mm", mouth.centre_mm.x()},     {"y_mm", mouth.centre_mm.y()}, {"z_mm", mouth.centre_mm.z()},
          {"out_x", mouth.axis.x()},         {"out_y", mouth.axis.y()},     {"out_z", mouth.axis.z()},
          {"diameter_mm", mouth.diameter_mm}};
}

// "2 holes of 4 mm, at (1, 2, 3) and (4, 5, 6) mm"
std::string holes_words(const std::vector<Mouth>& mouths) {
  double widest = 0;
  for (const Mouth& mouth : mouths) widest = std::max(widest, mouth.diameter_mm);
  std::string places;
  for (std::size_t n = 0; n < mouths.size(); ++n) {
    const Eigen::Vector3d p = mouths[n].centre_mm.unaryExpr([](double x) { return std::abs(x) < 0.05 ? 0 : x; });  // not -0.0
    places += (n == 0                  ? ""
               : n + 1 < mouths.size() ? ", "
                                       : " and ") +
              std::string("(") + number(p.x(), 1) + ", " + number(p.y(), 1) + ", " + number(p.z(), 1) + ")";
  }
  return plural(mouths.size(), "hole", "holes") + " of " + number(widest, 2) + " mm, at " + places + " mm";
}

}  // namespace

const Mesh& outside_with_plugs(const Drained& what, const Verdict& verdict) {
  const Surface& surface = what.surface;
  if (!print_of(what.spec).drains.plugged || surface.holes.mouths.empty()) return surface.outer;
  return verdict.outer_deviation_mm <= verdict.coordinate_rounding_mm ? what.original : surface.holes.sealed;
}

Moments closed_in(const Drained& what) {
  Moments s = mesh_moments(what.delivered.mesh_of(Part::Role::plug));
  const Print& print = print_of(what.spec);
  if (keeps_resin(print)) s += print.liquid_g_cm3 / print.density_g_cm3 * stays(what);
  return s;
}

void judge_drains(const Drained& what, const Progress& progress, Verdict& verdict) {
  const Print& print = print_of(what.spec);
  const std::vector<Mouth>& mouths = what.surface.holes.mouths;
  const double stays_mm3 = std::max(0.0, stays(what)[M1]);
  const double room_mm3 = mesh_moments(outer_hull(what.surface.holes.sealed))[M1] - mesh_moments(filled(what))[M1];
  const double share = room_mm3 > 0 ? stays_mm3 / room_mm3 : 0;
  const std::size_t sealed = verdict.cavities - what.surface.holes.cavities - rooms_taken(what);
  std::vector<Record> records;
  for (const Mouth& mouth : mouths) records.push_back(record_of(mouth));
  verdict.figures.push_back({.name = "holes", .words = "", .value = records});
  verdict.figures.push_back(
      {.name = "trapped_mm3", .words = "stays in the cavities when drained", .unit = Unit::mm3, .value = stays_mm3, .digits = 1});
  verdict.figures.push_back({.name = "trapped_share", .words = "", .value = share});
  verdict.figures.push_back({.name = "sealed_cavities", .words = "", .value = static_cast<double>(sealed)});
  if (print.drains.where == Drains::Where::found)
    verdict.criteria.push_back(at_most("drains", "what stays in the cavities when drained, over their room", share, kMostTrapped));
  if (keeps_resin(print)) {
    const double g = 1e-3 * print.liquid_g_cm3;
    verdict.trapped_resin_g = g * stays_mm3;
    verdict.criteria.push_back(
        at_most("trapped_resin", "uncured resin kept in cavities, g", verdict.trapped_resin_g, kMostTrapped * g * room_mm3));
  }
  std::string text = mouths.empty() ? "It has no holes" : "It has " + holes_words(mouths);
  text += ". Held with " + held(what.spec) + " up, as it is printed, " + number(stays_mm3 / 1000, 3) +
          " cm3 stay in its cavities, " + number(100 * share, 2) + " % of what they hold";
  if (keeps_resin(print)) text += ", and count as " + number(verdict.trapped_resin_g, 2) + " g of resin";
  if (sealed > 0) text += "; " + plural(sealed, "cavity has", "cavities have") + " no hole";
  verdict.meaning.push_back(text + ".");
  if (print.drains.plugged) judge_plugs(what, progress, verdict);
}

}  // namespace rayrep::verify_detail
