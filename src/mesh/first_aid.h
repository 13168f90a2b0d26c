#pragma once

#include <string>
#include <vector>

#include "rayrep/base/progress.h"
#include "rayrep/mesh/mesh.h"
#include "rayrep/mesh/mesh_check.h"

namespace rayrep {

/// A surface that was not closed after first aid.
struct FirstAid {
  Mesh mesh;            ///< closed, neighbours oriented; as it was given where that could not be
  bool closed = false;  ///< now
  FirstAidReport report;
  std::vector<std::string> notes;  ///< what was done, in sentences
  std::string left;                ///< when it could not be closed: what of it is open, as part of a sentence
};

/// Closes what can be closed without a guess, or with `repair` all; see check_mesh. Theory.md (42).
/// @param mesh  vertices merged, no triangle with a corner twice, neighbours oriented
/// @throws Error{interrupted}
FirstAid first_aid(const Mesh& mesh, bool repair, const Progress& progress);

}  // namespace rayrep
