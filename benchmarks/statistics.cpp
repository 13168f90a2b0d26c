#include "statistics.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

namespace rayrep::bench {

Spread spread(std::vector<double> values) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return {0.5 * (values[(n - 1) / 2] + values[n / 2]), values.front(), values.back(), static_cast<int>(n)};
}

PowerLaw fit_power_law(const std::vector<double>& x, const std::vector<double>& y) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  if (x.size() != y.size() || x.empty()) return {kNone, kNone};
  const double n = static_cast<double>(x.size());
  double mean_x = 0;
  double mean_y = 0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    mean_x += std::log(x[k]) / n;
    mean_y += std::log(y[k]) / n;
  }
  double xx = 0;
  double xy = 0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    xx += (std::log(x[k]) - mean_x) * (std::log(x[k]) - mean_x);
    xy += (std::log(x[k]) - mean_x) * (std::log(y[k]) - mean_y);
  }
  if (!(xx > 1e-24)) return {kNone, kNone};
  return {std::exp(mean_y - xy / xx * mean_x), xy / xx};
}

bool slower(double before_s, double after_s) { return after_s > 1.15 * before_s && after_s > before_s + 0.010; }

std::string significant(double value, int digits) {
  if (!std::isfinite(value)) return "-";
  char text[48];
  const double size = std::abs(value);
  if (size == 0 || size < 1e-4 || size >= 1e6) {
    std::snprintf(text, sizeof text, "%.*g", digits, value);
  } else {
    const int decimals = std::max(0, digits - 1 - static_cast<int>(std::floor(std::log10(size))));
    std::snprintf(text, sizeof text, "%.*f", decimals, value);
  }
  return text;
}

}  // namespace rayrep::bench
