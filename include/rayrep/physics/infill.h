#pragma once

#include <optional>
#include <string>
#include <vector>

#include "rayrep/base/progress.h"
#include "rayrep/mesh/delivery.h"
#include "rayrep/physics/moments.h"

namespace rayrep {

/// How a slicer fills what shall not be solid, and what it makes solid for all that.
struct Infill {
  double percent = 0;                            ///< nominal; 0: nothing, cavities are void
  std::string pattern = "gyroid";                ///< in PrusaSlicer's words
  std::optional<double> percent_laid_down = {};  ///< wins over infill_share
  int perimeters = 2;
  double extrusion_width_mm = 0.45;
  int top_layers = 6;
  int bottom_layers = 4;
  double layer_height_mm = 0.2;

  bool wanted() const { return percent > 0; }
  /// Of the room that material takes; 0 where cavities are void.
  double share() const;
  /// Everywhere solid so far below the surface, whatever the infill: the widest of perimeters, top and bottom layers.
  double skin_mm() const;
};

/// What this infill lays down in a region much larger than its cells, over the volume of the region, as measured with PrusaSlicer
/// 2.5 (benchmarks/infill.py); between the percentages measured, linear. Patterns that were not measured: the percentage itself.
double infill_share(const std::string& pattern, double percent);

/// The patterns that were measured.
std::vector<std::string> infill_patterns();

/// Of this pattern the same share is laid down everywhere in a region: not of those that are denser near the surface or below
/// roofs.
bool is_uniform_infill(const std::string& pattern);

/// Sets the shares of what was read from a file: as said, or as measured.
void assume_shares(Delivery& delivery, const std::optional<double>& percent_laid_down);

/// Of the body less what is sparse in it, (1 - share) of each modifier's; unit density.
/// @throws Error{interrupted}
Moments moments_of(const Delivery& delivery, const Progress& progress = {});

}  // namespace rayrep
