#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "rayrep/io/mesh_io.h"
#include "rayrep/physics/bead.h"
#include "rayrep/physics/moments.h"

namespace rayrep {

/// What a printer lays down under one name of the slicer: "External perimeter", "WALL-OUTER", "Skirt" ...
struct PrintedFeature {
  std::string name;
  bool of_body = true;          ///< false for skirt, brim, raft, supports, wipe tower, and what start and end codes extrude
  std::size_t beads = 0;        ///< of resin, layers
  Moments s = Moments::Zero();  ///< unit density, about the printer's origin (mm^3, mm^4, mm^5)
};

/// The outline of one layer: what its outermost closed loops of perimeters enclose, out to the outer edge of their beads; of resin
/// what is cured and what that encloses.
struct PrintedLayer {
  double z_mm = 0;       ///< middle of the layer, where slicers cut the mesh
  double height_mm = 0;  ///< of the layer
  double area_mm2 = 0;
  Eigen::Vector2d centroid_mm = Eigen::Vector2d::Zero();
  Eigen::Vector2d size_mm = Eigen::Vector2d::Zero();  ///< of its bounding box
};

struct PrintedOptions {
  ReadOptions file;
  /// Wins over what the file says. Where neither does: 1.75, or 2.85 if the beads would be narrower than 0.2 mm otherwise.
  std::optional<double> filament_diameter_mm;
  bool keep_beads = false;  ///< in Printed::beads
};

/// What a file for a printer lays down, in the printer's own coordinates.
struct Printed {
  std::string format;                    ///< "G-code" or "SL1 archive"
  std::string slicer;                    ///< as it names itself: "PrusaSlicer 2.5.0"; may be empty
  std::vector<PrintedFeature> features;  ///< in order of first use
  std::vector<PrintedLayer> layers;      ///< that have an outline, in order of the file
  double bottom_mm = 0;                  ///< of the lowest bead of the body; infinite without one
  std::optional<double> density_g_cm3;   ///< of the material, as the file says
  /// Of what such printers print with, where that is known: resin.
  std::optional<double> usual_density_g_cm3 = {};
  std::optional<double> told_volume_mm3;  ///< of all filament or resin, as the slicer says in the file
  std::string told;                       ///< its own words for that
  std::vector<std::string> objects;       ///< names of the objects on the bed, where the file tells them
  std::vector<std::string> notes;
  /// Of G-code, on request: what becomes part of the body, in order of the file; of arcs chords.
  std::vector<Bead> beads = {};

  /// As the file says, or usual.
  std::optional<double> likely_density_g_cm3() const { return density_g_cm3 ? density_g_cm3 : usual_density_g_cm3; }
  Moments body() const;       ///< of the body's features
  double volume_mm3() const;  ///< of all features
};

/// True for a name that ends as files for printers do: .gcode, .gco, .g, .gcode.3mf, .sl1, .sl1s, in any case.
bool is_printed(const std::filesystem::path& path);

/// Reads the G-code of Marlin's kind as PrusaSlicer, SuperSlicer, Slic3r, OrcaSlicer, Bambu Studio and Cura write it. Understood:
/// G0 and G1, arcs in the plane of the bed (G2, G3 by I, J or R), absolute and relative coordinates (G90, G91, M82, M83), G92,
/// millimetres and inches (G20, G21), several tools, flow factors (M221), E as volume (M200, or as the file says). Retractions, and
/// extrusion without motion, lay down nothing. A bead's width and height are those of the file's comments where it has them;
/// otherwise the height is that of the layer and the width what the volume makes of it. Also reads the plate of a Bambu Studio or
/// OrcaSlicer project (.gcode.3mf).
/// And the layers that PrusaSlicer writes for resin printers (.sl1, .sl1s), in the coordinates of its bed: every pixel a box as
/// high as its layer, cured by as much as it is covered, which is what its grey says. What the profile enlarges because printer and
/// resin shrink is taken back. Supports, pad and other objects on the bed are not told from the body. Memory is taken for the
/// files of some layers and for rows of pixels, never for an image.
/// @throws Error{input} with the line or part, and what to do: for binary G-code, arcs in other planes, splines, coordinates that
///         are not numbers; damaged or missing layers, images that do not fit the display, displays without or of absurd size
Printed read_printed(const std::filesystem::path& path, const PrintedOptions& options = {});

}  // namespace rayrep
