#include "rayrep/base/setting.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "base/text.h"
#include "rayrep/base/error.h"

namespace rayrep {
namespace {

[[noreturn]] void usage_error(const std::string& message) { throw Error(ErrorCode::usage, message); }

std::optional<double> number_in(const std::string& text) {
  double value = 0;
  if (!parse_number(text, value)) return std::nullopt;
  return value;
}

/// The parts of a list as numbers; none where it says `open`, unless that is empty.
std::vector<std::optional<double>> open_numbers(const std::string& name, const std::string& text, const std::string& open) {
  std::vector<std::optional<double>> numbers;
  for (const std::string& part : parts_of(text)) {
    const bool is_open = !open.empty() && part == open;
    const std::optional<double> value = is_open ? std::nullopt : number_in(part);
    if (!is_open && (!value || !std::isfinite(*value))) usage_error("--" + name + " does not take '" + text + "'.");
    numbers.push_back(value);
  }
  return numbers;
}

/// What was probably meant by a text that is no number.
std::string number_hint(const std::string& text) {
  std::string with_point = text;
  std::replace(with_point.begin(), with_point.end(), ',', '.');
  if (with_point != text && number_in(with_point)) return " Write the decimals after a point: " + with_point + ".";
  const std::size_t digits = text.find_last_of("0123456789.");
  if (digits == std::string::npos || !number_in(text.substr(0, digits + 1))) return "";
  const std::string rest = text.substr(digits + 1);
  if (rest == "%") return " Write a fraction: " + shown(*number_in(text.substr(0, digits + 1)) / 100) + ".";
  return " Give the number alone, without '" + rest + "'.";
}

int parse_int(const std::string& name, const std::string& text) {
  long long value = 0;
  if (!parse_integer(text, value) || std::abs(value) > std::numeric_limits<int>::max())
    usage_error("--" + name + " takes a whole number; it is '" + text + "'.");
  return static_cast<int>(value);
}

std::string shown_point(const Eigen::Vector3d& p) { return shown(p.x()) + "," + shown(p.y()) + "," + shown(p.z()); }

std::string list_of(std::span<const char* const> names) {
  std::string text;
  for (std::size_t n = 0; n < names.size(); ++n)
    text += (n == 0 ? "" : n + 1 < names.size() ? ", " : " or ") + std::string(names[n]);
  return text;
}

}  // namespace

bool Range::contains(double value) const {
  return std::isfinite(value) && (open ? value > lo && value < hi : value >= lo && value <= hi);
}

std::string Range::words() const {
  if (std::isfinite(lo) && std::isfinite(hi)) return "must lie between " + shown(lo) + " and " + shown(hi);
  if (lo == 0) return open ? "must be a positive number" : "must not be negative";
  return "must be a finite number";
}

void parse(Setting& setting, const std::string& text) {
  struct Parse {
    const Setting& setting;
    const std::string& text;
    void operator()(double* place) const { *place = parse_number(setting.name, text); }
    void operator()(std::optional<double>* place) const { *place = parse_number(setting.name, text); }
    void operator()(int* place) const { *place = parse_int(setting.name, text); }
    void operator()(bool* place) const { *place = true; }
    void operator()(const TextPlace& place) const { place.parse(text); }
  };
  std::visit(Parse{setting, text}, setting.place);
}

std::string shown(const Setting& setting) {
  struct Show {
    const Setting& setting;
    std::string operator()(const double* place) const { return shown(*place); }
    std::string operator()(const std::optional<double>* place) const { return *place ? shown(**place) : setting.unset; }
    std::string operator()(const int* place) const { return std::to_string(*place); }
    std::string operator()(const bool* place) const { return *place ? "yes" : "no"; }
    std::string operator()(const TextPlace& place) const { return place.show(); }
  };
  return std::visit(Show{setting}, setting.place);
}

void check(const Settings& settings) {
  struct Value {
    std::optional<double> operator()(const double* place) const { return *place; }
    std::optional<double> operator()(const std::optional<double>* place) const { return *place; }
    std::optional<double> operator()(const int* place) const { return *place; }
    std::optional<double> operator()(const bool*) const { return std::nullopt; }
    std::optional<double> operator()(const TextPlace&) const { return std::nullopt; }
  };
  for (const Setting& setting : settings)
    if (const std::optional<double> value = std::visit(Value{}, setting.place); value && !setting.range.contains(*value))
      usage_error("--" + setting.name + " " + setting.range.words() + "; it is " + shown(*value) + ".");
}

double parse_number(const std::string& name, const std::string& text) {
  const std::optional<double> value = number_in(text);
  if (!value || std::isnan(*value))
    usage_error("--" + name + " takes a number, such as 12.5; it is '" + text + "'." + number_hint(text));
  return *value;
}

std::string nearest_name(const std::string& text, const std::vector<std::string>& names) {
  const auto distance = [&text](const std::string& name) {
    // Optimal string alignment, row by row.
    std::vector<std::vector<std::size_t>> d(text.size() + 1, std::vector<std::size_t>(name.size() + 1));
    for (std::size_t i = 0; i <= text.size(); ++i)
      for (std::size_t j = 0; j <= name.size(); ++j) {
        if (i == 0 || j == 0) {
          d[i][j] = i + j;
          continue;
        }
        d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + (text[i - 1] != name[j - 1])});
        if (i > 1 && j > 1 && text[i - 1] == name[j - 2] && text[i - 2] == name[j - 1])
          d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
      }
    return d.back().back();
  };
  std::string nearest;
  std::size_t least = std::max<std::size_t>(1, text.size() / 3) + 1;
  for (const std::string& name : names)
    if (const std::size_t d = distance(name); d < least) {
      least = d;
      nearest = name;
    }
  return nearest;
}

std::vector<std::string> parts_of(const std::string& list) {
  std::vector<std::string> parts(1);
  for (const char c : list) c == ',' ? void(parts.emplace_back()) : parts.back().push_back(c);
  if (parts.back().empty()) parts.pop_back();
  return parts;
}

std::vector<double> parse_numbers(const std::string& name, const std::string& text) {
  std::vector<double> numbers;
  for (const std::optional<double>& number : open_numbers(name, text, "")) numbers.push_back(*number);
  return numbers;
}

std::vector<std::optional<double>> parse_open_numbers(const std::string& name, const std::string& text) {
  return open_numbers(name, text, "-");
}

std::size_t parse_choice(const std::string& name, const std::string& text, std::span<const char* const> names) {
  const auto found = std::find(names.begin(), names.end(), text);
  if (found == names.end()) usage_error("--" + name + " is " + list_of(names) + "; it is '" + text + "'.");
  return static_cast<std::size_t>(found - names.begin());
}

Eigen::Vector3d parse_direction(const std::string& text) {
  const double sign = !text.empty() && text[0] == '-' ? -1 : 1;
  const std::string axis = !text.empty() && (text[0] == '-' || text[0] == '+') ? text.substr(1) : text;
  for (int k = 0; k < 3; ++k)
    if (axis == std::string(1, "xyz"[k]) || axis == std::string(1, "XYZ"[k])) return sign * Eigen::Vector3d::Unit(k);
  std::vector<double> v;
  for (const std::string& part : parts_of(text))
    if (const std::optional<double> value = number_in(part)) v.push_back(*value);
  const bool whole = v.size() == 3 && v.size() == parts_of(text).size();
  if (whole)
    if (const Eigen::Vector3d direction(v[0], v[1], v[2]); direction.allFinite() && direction.norm() > 0)
      return direction.normalized();
  usage_error("'" + text + "' is no direction: give x, y, z, -x, -y, -z or a vector such as 0,1,0.5.");
}

TextPlace point_place(const char* name, std::optional<Eigen::Vector3d>& point, const char* unset) {
  return {[name, &point](const std::string& text) {
            const std::vector<double> c = parse_numbers(name, text);
            if (c.size() != 3) usage_error(std::string("--") + name + " takes X,Y,Z; it is '" + text + "'.");
            point = Eigen::Vector3d(c[0], c[1], c[2]);
          },
          [&point, unset] { return point ? shown_point(*point) : std::string(unset); }};
}

TextPlace direction_place(const char* name, Eigen::Vector3d& direction) {
  return {[&direction, name](const std::string& text) {
            try {
              direction = parse_direction(text);
            } catch (const Error& error) {
              usage_error(std::string("--") + name + ": " + error.what());
            }
          },
          [&direction] {
            for (int k = 0; k < 3; ++k)
              for (const double sign : {1.0, -1.0})
                if (direction == sign * Eigen::Vector3d::Unit(k)) return (sign < 0 ? "-" : "") + std::string(1, "xyz"[k]);
            return shown_point(direction);
          }};
}

}  // namespace rayrep
