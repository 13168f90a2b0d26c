// No bytes whatsoever may make the reader of G-code crash, hang or return moments that are no numbers; they end in a print or in
// Error{input}. What is understood does not depend on how lines end. The first byte of the input picks the filament's diameter.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "bodies.h"
#include "io/read_gcode.h"
#include "rayrep/base/error.h"

namespace {

using fuzz::require;
using rayrep::Printed;

std::optional<Printed> read(const std::string& bytes, const rayrep::PrintedOptions& options) {
  try {
    return rayrep::detail::read_gcode({bytes, "input.gcode"}, options);
  } catch (const rayrep::Error& error) {
    require(error.code() == rayrep::ErrorCode::input, "bad bytes are Error{input}");
    return std::nullopt;
  }
}

void check_laws(const Printed& printed) {
  require(!printed.features.empty(), "what was read lays something down");
  for (const rayrep::PrintedFeature& feature : printed.features) {
    require(feature.beads > 0, "a feature has beads");
    require(feature.s.allFinite(), "moments are numbers");
    require(feature.s[rayrep::M1] > 0, "material has a volume");
    for (const auto square : {rayrep::MXX, rayrep::MYY, rayrep::MZZ})
      require(feature.s[square] >= -1e-9 * std::abs(feature.s[square]), "squares are not negative");
  }
  for (const rayrep::PrintedLayer& layer : printed.layers)
    require(layer.area_mm2 >= 0 && std::isfinite(layer.z_mm) && layer.centroid_mm.allFinite(),
            "an outline has an area and a place");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {  // NOLINT(readability-identifier-naming)
  if (size == 0) return 0;
  rayrep::PrintedOptions options;
  if (data[0] % 3 == 1) options.filament_diameter_mm = 1.75;
  if (data[0] % 3 == 2) options.filament_diameter_mm = 2.85;
  const std::string bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  const std::optional<Printed> printed = read(bytes, options);
  if (!printed) return 0;
  check_laws(*printed);
  if (bytes.find('\r') != std::string::npos) return 0;
  std::string windows;
  for (const char c : bytes) {
    if (c == '\n') windows += '\r';
    windows += c;
  }
  const std::optional<Printed> same = read(windows, options);
  require(same.has_value() && same->body() == printed->body() && same->layers.size() == printed->layers.size(),
          "the ends of lines make no difference");
  return 0;
}
