#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "measure.h"
#include "options.h"
#include "rayrep/rayrep.h"

// Meshes as a command reads them.

namespace rayrep::tool {

struct ReadMesh {
  CheckedMesh checked;
  std::vector<Part> modifiers = {};
  std::vector<Part> pieces = {};   ///< of a body that is printed in pieces; `checked` is what they are together
  std::vector<Part> inserts = {};  ///< and what is put into it
  InputSummary summary;

  /// As it stands in its file, but for what checking has mended.
  MeshFile as_file() const {
    return {.mesh = checked.mesh, .format = "", .notes = {}, .modifiers = modifiers, .pieces = pieces, .inserts = inserts};
  }
};

/// Reads and checks in the file's own numbers, so that places are told in them, then scales to millimetres and to --size.
ReadMesh read(const std::filesystem::path& path, const Options& options, CheckOptions check, const Progress& progress);

/// @throws Error{input} for one that is not closed
void refuse_unusable(const ReadMesh& mesh);

/// @throws Error{input} for a mesh of several bodies, unless something is said to hold them together
void refuse_loose_bodies(const Options& options, ReadMesh& mesh, const Progress& progress);

/// Those of the command line, with what they name read. Keeps a reference to them.
HollowOptions hollow_options(const Options& options, const Progress& progress, Notes* notes = nullptr);

/// Of a mesh that is only looked at: nothing where it is not closed.
struct LookedAt {
  std::optional<MassProperties> mass;
  double area_mm2 = 0;
};
LookedAt look_at(const Options& options, const ReadMesh& input, const Progress& progress);

/// Keeps a reference to what was found.
Inspection inspection_of(const Options& options, const ReadMesh& input, const LookedAt& found);

}  // namespace rayrep::tool
