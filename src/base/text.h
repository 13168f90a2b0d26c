#pragma once

#include <cstdio>
#include <string>

namespace rayrep {

/// A number for a message, with `digits` after the point.
inline std::string number(double value, int digits) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

}  // namespace rayrep
