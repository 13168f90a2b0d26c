#pragma once

#include <string>
#include <vector>

namespace rayrep::bench {

/// Points of one colour, joined by a line in the order given.
struct Curve {
  std::string name;
  std::vector<double> x;
  std::vector<double> y;
  bool dashed = false;
};

/// A plot with two logarithmic axes.
struct LogPlot {
  std::string title;
  std::string x_label;
  std::string y_label;
  std::vector<Curve> curves;
};

/// The plot as a stand-alone SVG document. Points that are not positive and finite are left out.
std::string to_svg(const LogPlot& plot);

}  // namespace rayrep::bench
