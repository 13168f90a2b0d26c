#include "rayrep/physics/infill.h"

#include <algorithm>
#include <array>

#include "rayrep/mesh/mesh_check.h"

namespace rayrep {
namespace {

constexpr std::array<double, 6> kPercents = {5, 10, 15, 20, 30, 50};

struct Measured {
  const char* pattern;
  std::array<double, kPercents.size()> laid_down;  // percent
};

constexpr Measured kMeasured[] = {
    {"gyroid", {5.99, 10.49, 15.32, 20.16, 29.29, 47.38}},      {"grid", {5.61, 10.77, 15.78, 20.79, 30.84, 50.75}},
    {"rectilinear", {6.41, 11.35, 16.29, 21.23, 31.11, 50.88}}, {"cubic", {5.86, 10.90, 15.85, 20.92, 30.89, 50.68}},
    {"triangles", {6.28, 11.23, 16.07, 21.04, 31.17, 50.86}},   {"honeycomb", {7.45, 14.00, 20.24, 26.36, 38.02, 59.09}},
    {"3dhoneycomb", {7.96, 14.20, 20.88, 28.43, 40.88, 67.55}}, {"line", {5.79, 10.89, 15.88, 20.88, 30.88, 50.89}},
    {"concentric", {6.46, 11.38, 16.29, 21.21, 31.11, 50.87}},
};

}  // namespace

double Infill::share() const {
  if (!wanted()) return 0;
  return percent_laid_down ? *percent_laid_down / 100 : infill_share(pattern, percent);
}

double Infill::skin_mm() const {
  return std::max(perimeters * extrusion_width_mm, std::max(top_layers, bottom_layers) * layer_height_mm);
}

double infill_share(const std::string& pattern, double percent) {
  for (const Measured& row : kMeasured) {
    if (row.pattern != pattern) continue;
    // Nothing for nothing, and all for all.
    double from = 0, at_from = 0;
    for (std::size_t n = 0; n <= kPercents.size(); ++n) {
      const bool last = n == kPercents.size();
      const double to = last ? 100 : kPercents[n];
      const double at_to = last ? 100 : row.laid_down[n];
      if (percent <= to) return (at_from + (at_to - at_from) * (percent - from) / (to - from)) / 100;
      from = to;
      at_from = at_to;
    }
  }
  return std::min(percent / 100, 1.0);
}

std::vector<std::string> infill_patterns() {
  std::vector<std::string> names;
  for (const Measured& row : kMeasured) names.emplace_back(row.pattern);
  return names;
}

bool is_uniform_infill(const std::string& pattern) {
  return pattern != "adaptivecubic" && pattern != "supportcubic" && pattern != "lightning";
}

void assume_shares(Delivery& delivery, const std::optional<double>& percent_laid_down) {
  for (Part& part : delivery.parts)
    if (part.infill)
      part.infill->share = percent_laid_down ? *percent_laid_down / 100 : infill_share(part.infill->pattern, part.infill->percent);
}

Moments moments_of(const Delivery& delivery, const Progress& progress) {
  Moments s = mesh_moments(boundary_of_union(delivery.body(), progress));
  for (const Part& part : delivery.parts)
    if (part.infill) s -= (1 - part.infill->share) * mesh_moments(part.mesh);
  return s;
}

}  // namespace rayrep
