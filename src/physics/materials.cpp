#include "rayrep/physics/materials.h"

#include <algorithm>
#include <cctype>

#include "rayrep/base/error.h"

namespace rayrep {

const std::vector<Material>& materials() {
  static const std::vector<Material> table = {
      {"abs", 1.04, "PrusaSlicer 2.5 filament profiles"},
      {"asa", 1.07, "PrusaSlicer 2.5 filament profiles"},
      {"hips", 1.04, "Cura fdm-materials"},
      {"nylon", 1.12, "middle of 1.11-1.14, PrusaSlicer profiles and Cura fdm-materials (PA)"},
      {"pc", 1.20, "middle of 1.19-1.22, PrusaSlicer profiles and Cura fdm-materials"},
      {"petg", 1.27, "PrusaSlicer 2.5 filament profiles"},
      {"pla", 1.24, "PrusaSlicer 2.5 filament profiles"},
      {"pp", 0.90, "middle of 0.89-0.91, Cura fdm-materials"},
      {"resin", 1.14, "middle of 1.10-1.18, common photopolymers (general knowledge)", 1.09},
      {"tpu", 1.22, "PrusaSlicer profiles and Cura fdm-materials"},
  };
  return table;
}

const Material& material(const std::string& name) {
  std::string lower = name;
  std::transform(lower.begin(), lower.end(), lower.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  std::string known;
  for (const Material& m : materials()) {
    if (m.name == lower) return m;
    known += (known.empty() ? "" : ", ") + m.name;
  }
  throw Error(ErrorCode::usage, "There is no material '" + name + "'. Known: " + known + ". Or give --density G_CM3.");
}

const std::vector<Fluid>& fluids() {
  static const std::vector<Fluid> table = {{"water", 0.998},    {"seawater", 1.025}, {"deadsea", 1.24}, {"ethanol", 0.789},
                                           {"glycerol", 1.261}, {"oliveoil", 0.913}, {"mercury", 13.55}};
  return table;
}

}  // namespace rayrep
