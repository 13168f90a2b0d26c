#pragma once

#include <string>
#include <utility>
#include <vector>

#include "rayrep/base/progress.h"
#include "rayrep/make/hollow.h"
#include "rayrep/mesh/mesh.h"
#include "rayrep/physics/spec.h"

namespace rayrep {

/// A change of what was asked with which the goal is met: the body was made so and its judge found every criterion to pass.
struct Suggestion {
  std::string change;  ///< for people: "a wall of 0.8 mm"
  std::vector<std::pair<std::string, std::string>>
      options;  ///< names of settings and values: {"wall", "0.8"}; "size": longest side, mm
};

struct Advice {
  std::vector<Suggestion> suggestions;  ///< from what changes least to what changes most
  std::string tried;                    ///< for people: what was looked at, "walls down to 0.2 mm, ..."
};

/// What would do when a goal cannot be met as asked: other walls, sizes, materials, attitudes, and as the goal has it waterlines,
/// spin axes, contact points, contact tolerances and targets; one of them at a time and, where no single one does, two together.
/// They are looked for on few rays and then tried in full, as `hollow` and `verify` would be called, both a limited number of
/// times. What is found need not be all there is: along each change the least one of a ladder is taken.
/// @param mesh     as for hollow, millimetres
/// @param found    called for each suggestion as soon as it is known; may be empty
/// @throws Error{interrupted}; Error{usage} as hollow does
Advice suggest(const Mesh& mesh, const Spec& asked, const HollowOptions& options, const Progress& progress = {},
               const std::function<void(const Suggestion&)>& found = {});

}  // namespace rayrep
