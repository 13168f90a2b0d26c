#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <string_view>
#include <type_traits>

// Numbers to text and back, the same for every locale of the program that uses the library.

namespace rayrep {

/// With `digits` after the point, at most 40; from 1e15 on as `shown`.
std::string number(double value, int digits);

/// With `digits` significant digits, at most 40, and without trailing zeros; very large and small numbers with an exponent.
std::string shown(double value, int digits = 6);

/// One significant digit and an exponent: "2e-07".
std::string scientific(double value);

/// "(x, y, z)", each as `shown`, without a sign on 0.
std::string shown(const Eigen::Vector3d& point);

/// The same, its entries rounded to thousandths first.
std::string shown_to_thousandths(const Eigen::Vector3d& point);

/// "12.35 %" of 0.12345, with `digits` after the point.
std::string percent(double share, int digits);
/// "12 %" of it: to two significant digits.
std::string rough_percent(double share);

/// "3 <many>", or "1 <one>".
std::string plural(std::size_t count, std::string_view one, std::string_view many);

/// Appends the shortest decimal text that reads back as exactly `value`.
void append_number(std::string& text, double value);
void append_number(std::string& text, long long value);

/// Parses all of `text` as a decimal number: optional sign (also +), fraction, exponent, "nan" or "inf" in any case.
/// Numbers too large or too small for a double become +-inf or +-0.
bool parse_number(std::string_view text, double& value);

/// Parses all of `text` as a decimal integer that fits a long long.
bool parse_integer(std::string_view text, long long& value);

/// Texts, characters, whole numbers and numbers as `shown`, one after the other.
template <class... Parts>
std::string concat(const Parts&... parts) {
  std::string text;
  const auto add = [&text](const auto& part) {
    using Kind = std::decay_t<decltype(part)>;
    if constexpr (std::is_floating_point_v<Kind>)
      text += shown(part);
    else if constexpr (std::is_integral_v<Kind> && !std::is_same_v<Kind, char>)
      text += std::to_string(part);
    else
      text += part;
  };
  (add(parts), ...);
  return text;
}

}  // namespace rayrep
