#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace rayrep::detail {

/// What a G-code file says of itself in comments, wherever they stand: slicers write their settings at the end.
struct GcodeHeader {
  std::string slicer;
  std::vector<double> filament_diameters_mm;  ///< by tool; may be empty
  std::vector<double> densities_g_cm3;        ///< by tool; may be empty
  bool volumetric = false;                    ///< E counts mm^3
  std::optional<double> layer_height_mm;
  std::vector<double> told_mm;  ///< of filament, by tool; may be empty
  std::string told;             ///< the slicer's own words for that
  double told_digit_mm = 0;     ///< of which it is a multiple
  bool has_features = false;    ///< comments say what is being printed
  bool has_layers = false;      ///< and when a layer begins
};

/// Takes time in the length of the text.
GcodeHeader gcode_header(std::string_view text);

/// One command: "G1 X10 Y2 E0.3 ; perimeter".
struct GcodeLine {
  char letter = 0;           ///< of the command, upper case; 0: none
  int code = 0;              ///< its whole number
  bool whole = true;         ///< false for codes like G38.2
  std::string_view comment;  ///< behind ';', without blanks around
  std::array<double, 26> values = {};
  std::array<bool, 26> given = {};

  std::optional<double> operator[](char word) const {
    const auto n = static_cast<std::size_t>(word - 'A');
    return given[n] ? std::optional<double>(values[n]) : std::nullopt;
  }
};

/// Takes a line apart: line numbers, checksums and comments in brackets are passed over, words need no blanks between them. False
/// if a number cannot be read.
bool parse_gcode_line(std::string_view text, GcodeLine& line);

/// The next line, without its end; `rest` is what follows it.
std::string_view next_line(std::string_view& rest);

/// The rest of `text` if it begins with `start`, without blanks around.
std::optional<std::string_view> after(std::string_view text, std::string_view start);

/// "1.75,1.75" as numbers, without blanks around; empty if one of them is no finite number.
std::vector<double> numbers_in(std::string_view text, std::string_view separators);

/// Whether what a slicer prints under this name becomes part of the body.
bool is_of_body(std::string_view feature);
/// Whether its paths, where they are closed, can be an outline.
bool is_perimeter(std::string_view feature);

}  // namespace rayrep::detail
