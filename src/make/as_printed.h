#pragma once

#include "make/as_built.h"
#include "make/body.h"

namespace rayrep::detail {

/// What the loop over slices needs to know beside.
struct AsPrinted {
  AsBuilt built;
  const HollowOptions& options;  ///< its as_printed is not empty
  /// Changes what is wanted to what such a print nearly is, and returns the new AsBuilt::error; empty: nothing was left open.
  std::function<std::function<double(const Moments&)>(const Moments& printed)> give_way;
};

/// solve_as_built, until not what is meshed but what a slicer lays down for it meets the goal (HollowOptions::as_printed): what the
/// print has more than the mesh is added to what the maker has made, and the mesh is made anew to make up for it. theory.md (45).
/// Where slicing hardly lowers the error, as it jumps by layers, what was left open gives way, once: with the mass of the print
/// that is there the same layers come again, and only the centre is left to be brought home. Of all slices the one with the
/// smallest error is kept. Fills in HollowResult::slices, too.
/// @returns as solve_as_built
Moments solve_as_printed(AsPrinted problem, const InteriorSolver& solver, Maker& maker, HollowResult& result,
                         const Progress& progress);

}  // namespace rayrep::detail
