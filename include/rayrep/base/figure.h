#pragma once

#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace rayrep {

/// What a figure is counted in. Angles are in rad; people are shown degrees. What is told in rpm has a line of its own.
enum class Unit { none, mm, mm2, mm3, mm4, g, g_cm3, g_mm2, rad, rpm };

/// One value, or none.
using Scalar = std::variant<std::monostate, double, bool, std::string>;
/// Values by name.
using Record = std::vector<std::pair<std::string, Scalar>>;

/// Something that was found out or was wanted, with all that a report needs to tell it: JSON, text and pictures are made from
/// these.
struct Figure {
  using Value = std::variant<std::monostate, double, bool, std::string, std::vector<double>, std::vector<std::vector<double>>,
                             Record, std::vector<Record>>;

  std::string name;   ///< key in JSON; with the unit at its end, see docs/conventions.md
  std::string words;  ///< for people, in a table; empty: only in JSON
  Unit unit = Unit::none;
  Value value;               ///< monostate: there is none. Infinite and undefined numbers count as none
  int digits = 3;            ///< in a table: after the point,
  bool significant = false;  ///< or in all
  std::string none = "-";    ///< what a table says where there is no value
};

using Figures = std::vector<Figure>;

}  // namespace rayrep
