#include "judge/figures.h"

#include <iterator>
#include <numbers>

#include "base/text.h"

namespace rayrep::verify_detail {

std::vector<double> list(const Eigen::Ref<const Eigen::VectorXd>& v) { return {v.begin(), v.end()}; }

std::vector<std::vector<double>> rows(const Eigen::Ref<const Eigen::MatrixXd>& m) {
  std::vector<std::vector<double>> result;
  for (Eigen::Index n = 0; n < m.rows(); ++n) result.push_back(list(m.row(n).transpose()));
  return result;
}

Figure::Value value_or_none(const std::optional<Eigen::Vector3d>& point) {
  if (!point) return std::monostate{};
  return list(*point);
}

Figures body_figures(const MassProperties& body, const char* mass_words) {
  return {{.name = "volume_mm3", .words = "", .unit = Unit::mm3, .value = body.volume_mm3},
          {.name = "mass_g", .words = mass_words, .unit = Unit::g, .value = body.mass_g},
          {.name = "centre_of_mass_mm", .words = "", .unit = Unit::mm, .value = list(body.centre_of_mass_mm)},
          {.name = "inertia_g_mm2", .words = "", .unit = Unit::g_mm2, .value = rows(body.inertia_g_mm2)},
          {.name = "principal_moments_g_mm2", .words = "", .unit = Unit::g_mm2, .value = list(body.principal_moments_g_mm2)},
          {.name = "principal_axes", .words = "", .value = rows(body.principal_axes.transpose())}};
}

std::string print_words(const Print& print) {
  return "material " + shown(print.density_g_cm3) + " g/cm3, wall " + shown(print.wall_mm) + " mm";
}

void add_print(const Print& print, Figures& wanted) {
  wanted.push_back({.name = "density_g_cm3", .words = "", .unit = Unit::g_cm3, .value = print.density_g_cm3});
  wanted.push_back({.name = "wall_mm", .words = "", .unit = Unit::mm, .value = print.wall_mm});
  Figure liquid{.name = "liquid_g_cm3", .words = "", .unit = Unit::g_cm3, .value = {}};
  if (print.liquid_g_cm3 > 0) liquid.value = print.liquid_g_cm3;
  wanted.push_back(liquid);
  wanted.push_back({.name = "drained", .words = "", .value = print.drained});
}

void put_first(Figures first, Figures& figures) {
  first.insert(first.end(), std::make_move_iterator(figures.begin()), std::make_move_iterator(figures.end()));
  figures = std::move(first);
}

std::string grams(double mass_g) { return number(mass_g, mass_g < 1 ? 3 : mass_g < 10 ? 2 : 1) + " g"; }

std::string degrees(double rad, int digits) { return number(rad * 180 / std::numbers::pi, digits) + " degrees"; }

std::string place_words(const Eigen::Vector3d& p) {
  return "(" + number(p.x(), 3) + ", " + number(p.y(), 3) + ", " + number(p.z(), 3) + ") mm";
}

}  // namespace rayrep::verify_detail
