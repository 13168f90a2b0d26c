#pragma once

#include <array>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "rayrep/base/progress.h"
#include "rayrep/make/hollow.h"
#include "rayrep/mesh/mesh.h"
#include "rayrep/physics/spec.h"
#include "rayrep/shape/deform.h"

namespace rayrep {

/// What may be changed of what was asked, from what intrudes least on.
enum class ChangeKind {
  plug,       ///< holes that drain it, closed again
  drain,      ///< holes that drain it, or narrower ones
  roof,       ///< cavities whose roofs are flatter, on thinner pillars or on none
  direction,  ///< of the print: another way up on the bed
  point,      ///< through which point a top's axis goes; above which the body stands
  tilt,       ///< the way up, by a few degrees
  wall,       ///< thinner
  prefer,     ///< the axis of the smallest moment instead of the largest
  waterline,  ///< another one
  size,       ///< larger
  contact,    ///< a base that gives way more
  infill,     ///< less of it, or a cavity instead
  core,       ///< of metal
  balls,      ///< of steel
  flatten,    ///< cut off level below
  up,         ///< another side up
  material,   ///< another density
  deform,     ///< the outside moved
};
inline constexpr std::array<const char*, 18> kChangeKindNames = {
    "plug",   "drain", "self-supporting", "print-direction", "point", "tilt",     "wall",  "prefer", "waterline", "size", "contact",
    "infill", "core",  "balls",           "flatten",         "up",    "material", "deform"};

/// How far each kind of change goes. What is looked for lies within these, whoever looks.
struct ChangeLimits {
  double tilt_deg = 30;
  double thinnest_wall_mm = 0.4;  ///< an extrusion; and 1/500 of the size
  double largest_size = 2.5;      ///< over that asked
  double contact_mm = 1;          ///< and 2 % of the height
  double flatten = 0.05;          ///< of the height
  double deform = 0.1;            ///< of the diagonal, any point
  double least_reserve = 0.015;   ///< of a float: what a print's own scatter would sink is not worth a try
};

/// A change of what was asked with which the goal is met: the body was made so and its judge found every criterion to pass.
struct Suggestion {
  std::string change;  ///< for people: "a wall of 0.8 mm"
  std::vector<std::pair<std::string, std::string>>
      options;  ///< names of settings and values: {"wall", "0.8"}; "size": longest side, mm
  std::vector<ChangeKind> kinds = {};
  std::shared_ptr<const Deformation> outside = {};  ///< that was found, where it is moved
};

struct Advice {
  std::vector<Suggestion> suggestions;  ///< from what changes least to what changes most
  std::string tried;                    ///< for people: what was looked at, "walls down to 0.4 mm, ..."
};

/// What is looked for.
struct Search {
  std::vector<ChangeKind> kinds = {};  ///< that may be changed; empty: all
  bool first_only = false;             ///< stop at what changes least
  ChangeLimits limits = {};
  DeformOptions deform = {};                          ///< but for the limit, which is that of `limits`
  std::function<void(const Suggestion&)> found = {};  ///< called for each suggestion as soon as it is known
  /// Tries a change in full and says whether it does; empty: it is made and judged. With what delivers what is wanted nothing is
  /// made twice.
  std::function<bool(const Suggestion&)> deliver = {};
};

/// What would do when a goal cannot be met as asked: changes of each kind, the least one of it; one kind at a time and, where no
/// single one does, two together. They are looked for on few rays and then tried in full, as `hollow` and `verify` would be
/// called, both a limited number of times. What is found need not be all there is: along each kind the least change of a ladder
/// is taken. The outside is deformed only where it is named among the kinds, or nothing else does: that takes seconds.
/// @param mesh     as for hollow, millimetres
/// @throws Error{interrupted}; Error{usage} as hollow does
Advice suggest(const Mesh& mesh, const Spec& asked, const HollowOptions& options, const Search& search = {},
               const Progress& progress = {});

}  // namespace rayrep
