#include "svg.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>

#include "statistics.h"

namespace rayrep::bench {
namespace {

constexpr double kWidth = 760;
constexpr double kHeight = 440;
constexpr double kLeft = 80;
constexpr double kRight = 250;  // room for the legend
constexpr double kTop = 40;
constexpr double kBottom = 55;
// Colours that stay apart for colour-blind readers (Okabe and Ito).
constexpr std::array<const char*, 8> kColours = {"#0072B2", "#D55E00", "#009E73", "#CC79A7",
                                                 "#E69F00", "#56B4E9", "#000000", "#999999"};

std::string fixed(double v) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f", v);
  return text;
}

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) out += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '>' ? "&gt;" : std::string(1, c);
  return out;
}

bool drawable(double v) { return std::isfinite(v) && v > 0; }

/// A logarithmic axis from `first` to `last` px.
struct Axis {
  double lowest = std::numeric_limits<double>::infinity();
  double highest = -std::numeric_limits<double>::infinity();
  double first, last;

  Axis(double first_px, double last_px) : first(first_px), last(last_px) {}
  void cover(double v) {
    lowest = std::min(lowest, std::log10(v));
    highest = std::max(highest, std::log10(v));
  }
  void close() {
    if (!(lowest <= highest)) lowest = highest = 0;
    const double room = std::max(0.05 * (highest - lowest), 0.02);
    lowest -= room;
    highest += room;
  }
  double at(double v) const { return first + (std::log10(v) - lowest) / (highest - lowest) * (last - first); }

  /// Powers of ten; where few decades are shown, 2 and 5 times them, too, and within a decade all multiples.
  std::vector<double> ticks() const {
    std::vector<double> found;
    const double span = highest - lowest;
    const int step = span > 8 ? 2 : 1;
    for (int p = static_cast<int>(std::floor(lowest)); p <= highest; ++p)
      for (int m = 1; m <= 9; ++m) {
        const double v = m * std::pow(10, p);
        const bool wanted = m == 1 ? p % step == 0 : span < 1 || (span < 2.5 && (m == 2 || m == 5));
        if (wanted && std::log10(v) >= lowest && std::log10(v) <= highest) found.push_back(v);
      }
    return found;
  }
};

std::string text_at(double x, double y, const std::string& anchor, const std::string& text, const std::string& more = "") {
  return "<text x=\"" + fixed(x) + "\" y=\"" + fixed(y) + "\" text-anchor=\"" + anchor + "\"" + more + ">" + escaped(text) +
         "</text>\n";
}

std::string tick_text(double v) {
  char text[32];
  std::snprintf(text, sizeof text, v < 1e-3 || v >= 1e5 ? "%.0e" : "%g", v);
  return text;
}

}  // namespace

std::string to_svg(const LogPlot& plot) {
  Axis x(kLeft, kWidth - kRight);
  Axis y(kHeight - kBottom, kTop);
  for (const Curve& curve : plot.curves)
    for (std::size_t n = 0; n < curve.x.size(); ++n)
      if (drawable(curve.x[n]) && drawable(curve.y[n])) {
        x.cover(curve.x[n]);
        y.cover(curve.y[n]);
      }
  x.close();
  y.close();

  std::string svg = "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 " + fixed(kWidth) + " " + fixed(kHeight) +
                    "\" font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n";
  svg += text_at(kLeft, kTop - 16, "start", plot.title, " font-size=\"14\"");
  for (const double v : x.ticks()) {
    svg += "<line x1=\"" + fixed(x.at(v)) + "\" x2=\"" + fixed(x.at(v)) + "\" y1=\"" + fixed(y.first) + "\" y2=\"" + fixed(y.last) +
           "\" stroke=\"#ddd\"/>\n";
    svg += text_at(x.at(v), y.first + 18, "middle", tick_text(v));
  }
  for (const double v : y.ticks()) {
    svg += "<line x1=\"" + fixed(x.first) + "\" x2=\"" + fixed(x.last) + "\" y1=\"" + fixed(y.at(v)) + "\" y2=\"" + fixed(y.at(v)) +
           "\" stroke=\"#ddd\"/>\n";
    svg += text_at(x.first - 8, y.at(v) + 4, "end", tick_text(v));
  }
  svg += "<rect x=\"" + fixed(x.first) + "\" y=\"" + fixed(y.last) + "\" width=\"" + fixed(x.last - x.first) + "\" height=\"" +
         fixed(y.first - y.last) + "\" fill=\"none\" stroke=\"#444\"/>\n";
  svg += text_at(0.5 * (x.first + x.last), kHeight - 14, "middle", plot.x_label);
  const double middle = 0.5 * (y.first + y.last);
  svg += text_at(18, middle, "middle", plot.y_label, " transform=\"rotate(-90 18 " + fixed(middle) + ")\"");

  for (std::size_t c = 0; c < plot.curves.size(); ++c) {
    const Curve& curve = plot.curves[c];
    const std::string colour = kColours[c % kColours.size()];
    const std::string dash = curve.dashed ? " stroke-dasharray=\"5 4\"" : "";
    std::string points;
    std::string dots;
    for (std::size_t n = 0; n < curve.x.size(); ++n) {
      if (!drawable(curve.x[n]) || !drawable(curve.y[n])) continue;
      points += fixed(x.at(curve.x[n])) + "," + fixed(y.at(curve.y[n])) + " ";
      dots += "<circle cx=\"" + fixed(x.at(curve.x[n])) + "\" cy=\"" + fixed(y.at(curve.y[n])) + "\" r=\"3.2\" fill=\"" + colour +
              "\"/>\n";
    }
    svg +=
        "<polyline points=\"" + points + "\" fill=\"none\" stroke=\"" + colour + "\" stroke-width=\"1.6\"" + dash + "/>\n" + dots;
    const double row = kTop + 10 + 20 * static_cast<double>(c);
    svg += "<line x1=\"" + fixed(x.last + 14) + "\" x2=\"" + fixed(x.last + 38) + "\" y1=\"" + fixed(row) + "\" y2=\"" +
           fixed(row) + "\" stroke=\"" + colour + "\" stroke-width=\"2.4\"" + dash + "/>\n";
    svg += text_at(x.last + 44, row + 4, "start", curve.name);
  }
  return svg + "</svg>\n";
}

}  // namespace rayrep::bench
