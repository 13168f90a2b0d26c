#pragma once

#include <Eigen/Core>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace rayrep {

/// Which numbers a setting takes.
struct Range {
  double lo = -std::numeric_limits<double>::infinity();
  double hi = std::numeric_limits<double>::infinity();
  bool open = true;  ///< the ends themselves are not taken; infinity never is

  bool contains(double value) const;
  std::string words() const;  ///< "must be a positive number", "must lie between 20 and 1000", ...
  static Range positive() { return {.lo = 0}; }
};

/// Values that are not one number: how they are read and told.
struct TextPlace {
  std::function<void(const std::string&)> parse;  ///< @throws Error{usage}
  std::function<std::string()> show;
  std::vector<std::string> choices = {};  ///< where it is one of a few words
};

/// One member of a struct as people set it: its name, words, unit, range, and where it is kept. From these rows come the command
/// line, its help, the man page and completion, what a report says of the options, and what the library checks.
struct Setting {
  enum class For {
    all,
    making,   ///< a judge does not ask for it
    judging,  ///< a maker does not ask for it
  };

  std::string name;     ///< "wall": --wall, "wall" in reports
  std::string value;    ///< what it takes, in capitals: "MM"; empty: nothing, it is a switch
  std::string words;    ///< one line of help
  std::string details;  ///< what the man page says beyond `words`; may be empty
  std::variant<double*, std::optional<double>*, int*, bool*, TextPlace> place;
  Range range = {};
  std::string unset = "auto";  ///< what the absence of an optional number is called
  For applies = For::all;
  bool rare = false;       ///< help only names it, the man page tells it
  bool repeated = false;   ///< may be given several times: each is parsed in its turn
  std::string also = {};   ///< a setting that says the same in another way: at most one of the two may be given
  std::string alone = {};  ///< what it is when it is given without a value; empty: it needs one
};

using Settings = std::vector<Setting>;

/// Sets the value from its text, in no locale's way of writing numbers. @throws Error{usage} that names the setting
void parse(Setting& setting, const std::string& text);

/// The value as `parse` takes it; numbers with six digits.
std::string shown(const Setting& setting);

/// @throws Error{usage} for the first number out of its range
void check(const Settings& settings);

/// `words` and the unit's names of an enumeration as a place: its values are the places in `names`.
template <typename Enum>
TextPlace choice(const char* name, Enum& value, std::span<const char* const> names);

/// A point or vector "X,Y,Z", and one that may be absent.
TextPlace point_place(const char* name, std::optional<Eigen::Vector3d>& point, const char* unset);
/// "x", "-z", "0,1,0.5": a unit vector.
TextPlace direction_place(const char* name, Eigen::Vector3d& direction);

/// All of the text as a number. @throws Error{usage} that names the setting, with a hint
double parse_number(const std::string& name, const std::string& text);

/// "1,-2" or "1,-2,3.5". @throws Error{usage} that names the setting
std::vector<double> parse_numbers(const std::string& name, const std::string& text);
/// The same with - for a number that is left open.
std::vector<std::optional<double>> parse_open_numbers(const std::string& name, const std::string& text);
/// @throws Error{usage}
Eigen::Vector3d parse_direction(const std::string& text);

/// The one of `names` that was probably meant: the nearest by letters left out, added, changed or swapped; empty when none is near.
std::string nearest_name(const std::string& text, const std::vector<std::string>& names);

/// The parts of a list, without its commas.
std::vector<std::string> parts_of(const std::string& list);

/// Which of `names` it is. @throws Error{usage} that lists them
std::size_t parse_choice(const std::string& name, const std::string& text, std::span<const char* const> names);

template <typename Enum>
TextPlace choice(const char* name, Enum& value, std::span<const char* const> names) {
  return {[name, &value, names](const std::string& text) { value = static_cast<Enum>(parse_choice(name, text, names)); },
          [&value, names] { return std::string(names[static_cast<std::size_t>(value)]); },
          {names.begin(), names.end()}};
}

}  // namespace rayrep
