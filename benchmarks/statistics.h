#pragma once

#include <string>
#include <vector>

namespace rayrep::bench {

/// Seconds of repeated measurements of the same work.
struct Spread {
  double median = 0;
  double smallest = 0;
  double largest = 0;
  int repeats = 0;
};

/// Median (of an even number: the mean of the middle two), smallest and largest; all 0 for no values.
Spread spread(std::vector<double> values);

/// y = factor x^exponent.
struct PowerLaw {
  double factor = 0;
  double exponent = 0;
};

/// The straight line through (log x, log y) by least squares. Needs two different positive x and as many positive y; NaN otherwise.
PowerLaw fit_power_law(const std::vector<double>& x, const std::vector<double>& y);

/// A slowdown that matters: by more than 15 % and by more than 10 ms.
bool slower(double before_s, double after_s);

/// `value` with so many significant digits, without an exponent between 1e-4 and 1e6; "-" for what is not finite.
std::string significant(double value, int digits);

}  // namespace rayrep::bench
