#pragma once

#include <vector>

#include "rayrep/base/progress.h"
#include "rayrep/judge/verify.h"

namespace rayrep {

/// Regions in which a body shall be solid.
struct KeptSolidTerms {
  const std::vector<Mesh>& regions;  ///< closed, facing outward; they may reach out of the body
  double wall_mm = 1.2;              ///< so far from them all cavities shall end; 0: only in none of them
  double wall_ratio = 0.98;          ///< as Limits::wall_ratio
  const Mesh* original = nullptr;    ///< of a body with holes, by which they are told from its outside
  const Drains* drains = nullptr;    ///< the holes it may have; null: none
};

/// Of a body that is made or judged by a spec. Keeps references to all. @param original  as KeptSolidTerms::original
KeptSolidTerms kept_solid_terms(const std::vector<Mesh>& regions, const Spec& spec, const Mesh* original);

/// Adds to a verdict, from the delivered triangles alone:
///   kept_solid   smallest distance of a cavity, or of a hole into one, from a region over the wall, at least wall_ratio (without a
///                wall: in mm, at least 0); negative where a cavity reaches into one, or a region lies in a cavity
/// and the figure kept_solid_mm, that distance: none without cavities. Without regions nothing.
/// @throws Error{interrupted}
void judge_kept_solid(const Mesh& delivered, const KeptSolidTerms& terms, Verdict& verdict, const Progress& progress = {});

}  // namespace rayrep
