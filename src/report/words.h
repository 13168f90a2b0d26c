#pragma once

#include <fmt/printf.h>

#include <string>
#include <utility>
#include <vector>

#include "rayrep/report/report.h"

// What reports for people say, whatever they are written in.

namespace rayrep::report_detail {

/// printf's patterns in no locale.
template <typename... Arguments>
std::string format(const char* pattern, const Arguments&... arguments) {
  return fmt::sprintf(pattern, arguments...);
}

/// All defects of a surface, by what people call them.
std::vector<std::pair<const char*, const Defect&>> defects_of(const MeshReport& check);

/// One figure of a body, and of the solid it was made from.
struct Row {
  std::string words;  ///< with the unit
  std::string before;
  std::string after;
};

/// What stands in columns, then what has a line of its own.
struct Rows {
  std::vector<Row> table;
  std::vector<Row> lines;
};

/// @param before  null: there is none
Rows rows_of(const Figures* before, const Figures& after);

/// Volume, area, mass, centre of mass, inertia and defects of a mesh.
Rows rows_of(const Inspection& inspection);

/// What is judged, its unit in words.
std::string words_of(const Criterion& criterion);

/// A value or limit: few digits, and "-" for what is no number.
std::string value_text(const Criterion& criterion, double value);

/// What came of the making beside the figures; of a report with that.
std::vector<std::string> notes_of(const RunReport& report);

/// What is proven, a sentence each. Of a duality gap only that it is closed, unless more is asked for.
std::vector<std::string> proof_of(const HollowResult& hollow, bool verbose);

}  // namespace rayrep::report_detail
