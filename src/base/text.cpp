#include "base/text.h"

#include <cassert>
#include <charconv>
#include <cmath>
#include <system_error>

namespace rayrep {
namespace {

constexpr int kMostDigits = 40;

std::string formatted(double value, std::chars_format format, int digits) {
  assert(digits >= 0 && digits <= kMostDigits);
  char text[400];  // the largest double has 309 digits before the point
  const std::to_chars_result end = std::to_chars(text, text + sizeof text, value, format, digits);
  assert(end.ec == std::errc());
  return {text, end.ptr};
}

std::string_view without_plus(std::string_view text) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  return text;
}

template <class Number>
bool parse_whole(std::string_view text, Number& value, std::errc& problem) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  problem = error;
  return error != std::errc::invalid_argument && end == text.data() + text.size();
}

template <class Number>
void append_shortest(std::string& text, Number value) {
  char buffer[32];
  text.append(buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr);
}

}  // namespace

std::string number(double value, int digits) {
  constexpr double readable = 1e15;
  return std::abs(value) < readable || !std::isfinite(value) ? formatted(value, std::chars_format::fixed, digits) : shown(value);
}

std::string shown(double value, int digits) { return formatted(value, std::chars_format::general, digits); }

std::string scientific(double value) { return formatted(value, std::chars_format::scientific, 0); }

std::string shown(const Eigen::Vector3d& point) {
  const Eigen::Vector3d p = point.array() + 0.0;  // -0 becomes 0
  return concat("(", p.x(), ", ", p.y(), ", ", p.z(), ")");
}

std::string shown_to_thousandths(const Eigen::Vector3d& point) {
  return shown(Eigen::Vector3d(point.unaryExpr([](double x) { return std::round(1e3 * x) / 1e3; })));
}

std::string percent(double share, int digits) { return number(100 * share, digits) + " %"; }

std::string rough_percent(double share) { return shown(100 * share, 2) + " %"; }

std::string plural(std::size_t count, std::string_view one, std::string_view many) {
  return concat(count, " ", count == 1 ? one : many);
}

void append_number(std::string& text, double value) { append_shortest(text, value); }
void append_number(std::string& text, long long value) { append_shortest(text, value); }

bool parse_number(std::string_view text, double& value) {
  text = without_plus(text);
  std::errc problem;
  if (!parse_whole(text, value, problem)) return false;
  if (problem != std::errc::result_out_of_range) return true;
  // Outside double's range: long double still tells too large (inf) from too small (0).
  long double wide = 0;
  if (!parse_whole(text, wide, problem) || problem != std::errc()) return false;
  value = static_cast<double>(wide);
  return true;
}

bool parse_integer(std::string_view text, long long& value) {
  std::errc problem;
  return parse_whole(without_plus(text), value, problem) && problem == std::errc();
}

}  // namespace rayrep
