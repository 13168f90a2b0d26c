#include "rayrep/physics/materials.h"

#include <algorithm>
#include <cctype>

#include "rayrep/base/error.h"

namespace rayrep {
namespace {

/// The row of that name, in any case. @throws Error{usage} with the names there are
template <typename Row>
const Row& named(const std::vector<Row>& table, const std::string& name, const char* kind, const char* otherwise) {
  std::string lower = name;
  std::transform(lower.begin(), lower.end(), lower.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  std::string known;
  for (const Row& row : table) {
    if (row.name == lower) return row;
    known += (known.empty() ? "" : ", ") + std::string(row.name);
  }
  throw Error(ErrorCode::usage,
              "There is no " + std::string(kind) + " '" + name + "'. Known: " + known + ". Or give " + otherwise + ".");
}

}  // namespace

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

const Material& material(const std::string& name) { return named(materials(), name, "material", "--density G_CM3"); }

const std::vector<CoreMaterial>& core_materials() {
  static const std::vector<CoreMaterial> table = {
      {"bismuth-tin", 8.56, false, "eutectic Bi58Sn42, melts at 138 C (alloy data sheets)"},
      {"brass", 8.5, false, "CuZn37 (data sheets)"},
      {"lead", 11.34, false, "handbook value of the element"},
      {"lead-shot", 6.8, true, "lead, random close packing of spheres (0.60 as poured)"},
      {"sand", 1.6, true, "dry quartz sand, loose (bulk density tables: 1.5 to 1.7)"},
      {"steel", 7.85, false, "unalloyed steel (data sheets)"},
      {"steel-shot", 4.7, true, "steel, random packing of spheres (0.60 as poured)"},
      {"tin", 7.29, false, "handbook value of the element (white tin); Spin-It calculates with 8.1"},
  };
  return table;
}

const CoreMaterial& core_material(const std::string& name) {
  return named(core_materials(), name, "core material", "--core-density G_CM3");
}

const std::vector<Fluid>& fluids() {
  static const std::vector<Fluid> table = {{"water", 0.998},    {"seawater", 1.025}, {"deadsea", 1.24}, {"ethanol", 0.789},
                                           {"glycerol", 1.261}, {"oliveoil", 0.913}, {"mercury", 13.55}};
  return table;
}

}  // namespace rayrep
