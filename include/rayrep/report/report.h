#pragma once

#include <string>
#include <utility>
#include <vector>

#include "rayrep/io/mesh_io.h"
#include "rayrep/io/printed.h"
#include "rayrep/judge/verify.h"
#include "rayrep/make/hollow.h"
#include "rayrep/mesh/mesh_check.h"
#include "rayrep/print/place_print.h"

namespace rayrep {

/// What a report says of a mesh that was read.
struct InputSummary {
  std::string path;
  std::size_t body = 0;    ///< which of the file's bodies it is, from 1; 0: the whole file
  std::size_t bodies = 0;  ///< of how many
  std::string format;
  double mm_per_unit = 1;  ///< of the file
  double scale = 1;        ///< applied after that (--size)
  Eigen::Vector3d size_mm = Eigen::Vector3d::Zero();
  std::size_t vertices = 0;   ///< after merging
  std::size_t triangles = 0;  ///< after dropping degenerate ones
  MeshReport check;
  std::vector<std::string> notes;  ///< of the reader
};

/// What a file for a printer lays down.
struct Measurement {
  std::string path;
  Printed printed;
  double density_g_cm3 = 0;
  bool density_told = false;             ///< by the file
  MassProperties body;                   ///< in the frame of the mesh if it was placed, else in the printer's
  std::string mesh;                      ///< path of the mesh it was placed in; may be empty
  std::optional<PrintPlacement> placed;  ///< none: not asked for
};

/// "duck.gcode: G-code by PrusaSlicer 2.5.0 ...", its notes, and how it was placed.
std::string heading_text(const Measurement& measurement);
/// That, what is laid down under each name, and mass, centre of mass and inertia of the body.
std::string to_text(const Measurement& measurement);
std::string to_json(const Measurement& measurement);

/// What a run of a command found out, whatever the goal.
struct RunReport {
  std::string command;  ///< "float", "spin", "stand", "target" or "verify"
  InputSummary input;
  std::optional<Measurement> print;                          ///< what was judged is a file for a printer, `input` its original
  std::string output;                                        ///< path; empty when nothing was written
  std::vector<std::pair<std::string, std::string>> options;  ///< as they were in force, by name
  std::string changed;                                       ///< of what was asked, as it was allowed; empty: nothing
  /// A heavy core, or balls, written as a mesh of their own.
  struct Insert {
    std::string path;
    MassProperties mass;
    int pieces = 1;
  };
  std::optional<Insert> insert;
  /// What closes the holes again.
  struct Plugs {
    std::string path;  ///< empty: they are in the output
    int pieces = 0;
  };
  std::optional<Plugs> plugs;
  /// The outside that was changed so that the goal can be met: what the output was judged against.
  struct Outside {
    std::string path;
    Figures changes;
    std::string note;
  };
  std::optional<Outside> outside;
  std::string dense_output, sparse_output;  ///< paths of the two phases of infill; empty: not written
  std::vector<std::string> piece_outputs;   ///< paths of the pieces, each lying on its cut; empty: they are in the output alone
  std::vector<double> pauses_mm;            ///< of the print, to put in what is fixed
  std::size_t delivered_triangles = 0;
  std::optional<HollowResult> hollow;                     ///< none: a verify run
  Figures before;                                         ///< of the solid; empty for a verify run
  Verdict after;                                          ///< judged from the file re-read from disk
  std::vector<std::pair<std::string, double>> timings_s;  ///< stage and seconds, in order of first occurrence, then total
  double peak_memory_mb = 0;
};

/// JSON text, schema version 1: numbers with all their digits, lengths in mm, masses in g, angles in rad; infinite and undefined
/// numbers are null.
std::string to_json(const RunReport& report);

/// The same for a terminal: what came in, what came of it in words, then in figures, before and after side by side (of a verify
/// run: after alone), verdict per criterion. @param verbose  also how the solver came to it, proof, stages and timings
std::string to_text(const RunReport& report, bool verbose);

/// How the output is to be printed, in a line or two; empty of a verify run.
std::string printing_text(const RunReport& report);

/// Of `rayrep inspect`. `mass` is null for a mesh that is not usable.
struct Inspection {
  InputSummary input;
  double density_g_cm3 = 1.24;
  double area_mm2 = 0;
  const MassProperties* mass = nullptr;
};
std::string to_json(const Inspection& inspection);
std::string to_text(const Inspection& inspection);

/// The version of the library, e.g. "0.1.0".
std::string version();

}  // namespace rayrep
