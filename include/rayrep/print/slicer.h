#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "rayrep/base/progress.h"
#include "rayrep/io/printed.h"
#include "rayrep/mesh/delivery.h"
#include "rayrep/print/place_print.h"

namespace rayrep {

/// A slicer of PrusaSlicer's kind (PrusaSlicer, SuperSlicer) and how it is asked to slice.
struct SlicerOptions {
  std::string program = {};                                    ///< its name, looked for where the shell would, or its path
  std::filesystem::path profile = {};                          ///< its .ini, as it exports it; empty: its own defaults
  Eigen::Vector3d print_direction = Eigen::Vector3d::UnitZ();  ///< of the mesh, upward on the bed
  double time_limit_s = 900;
};

/// What a profile says that matters for the model.
struct SlicerProfile {
  std::optional<double> density_g_cm3;  ///< filament_density, of the first extruder; none if 0
  std::optional<double> fill_percent;
  std::optional<std::string> fill_pattern;
  std::optional<int> perimeters;
  std::optional<double> extrusion_width_mm;  ///< none where it is automatic, or a share of the layer's height
  std::optional<int> top_layers;
  std::optional<int> bottom_layers;
  std::optional<double> layer_height_mm;
  Eigen::Vector2d bed_centre_mm = Eigen::Vector2d(100, 100);  ///< of bed_shape's box
};

/// Reads an .ini profile; an empty path gives the defaults of PrusaSlicer. @throws Error{input} if it cannot be read
SlicerProfile read_slicer_profile(const std::filesystem::path& path);

/// A mesh as it was sliced.
struct Sliced {
  Printed printed;
  PrintPlacement placed;
};

/// Slices a body as it is laid down with 100 % infill, supports on the bed only, its box in the middle of the bed; writes the
/// G-code. The program is run without a shell, in a temporary folder of its own, and is killed with its children after the time
/// limit and when `progress` says so.
/// @param delivery  what is sliced: closed, oriented, cavities as reversed shells; its sparse regions as modifiers
/// @param ending  of the mesh file that the slicer reads: ".stl", ".3mf" or ".obj"
/// @param gcode   where the G-code is written
/// @throws Error{usage} when there is no such program or profile; Error{solver} with what it said when it fails or takes too long;
///         Error{interrupted}
Sliced slice(const Delivery& delivery, const std::string& ending, const std::filesystem::path& gcode, const SlicerOptions& options,
             const Progress& progress = {});

}  // namespace rayrep
