#pragma once

#include <string>
#include <vector>

namespace rayrep {

/// A printing material. Densities are typical values of the printed solid; a spool's or bottle's own data sheet is better.
struct Material {
  std::string name;  ///< lower case, as given to --material
  double density_g_cm3;
  std::string source;       ///< where the figure is from
  double liquid_g_cm3 = 0;  ///< of a material printed from a liquid: its density before it is cured, of what a sealed cavity keeps
};

/// All known materials, by name.
const std::vector<Material>& materials();

/// The material of that name, in any case. @throws Error{usage} listing the known names.
const Material& material(const std::string& name);

/// What a heavy core is made of.
struct CoreMaterial {
  const char* name;
  double density_g_cm3;  ///< of what is poured: of the heap, with the air in it
  bool poured;           ///< grains, which need a closed room; else cast or cut
  const char* source;
};
const std::vector<CoreMaterial>& core_materials();

/// @throws Error{usage} listing the known names
const CoreMaterial& core_material(const std::string& name);

/// A fluid to float in, by name.
struct Fluid {
  const char* name;
  double density_g_cm3;  ///< at about 20 degrees
};
const std::vector<Fluid>& fluids();

}  // namespace rayrep
