#pragma once

#include <Eigen/Geometry>
#include <memory>

#include "rayrep/base/progress.h"
#include "rayrep/make/hollow.h"
#include "rayrep/mesh/mesh.h"
#include "rayrep/physics/moments.h"
#include "rayrep/physics/spec.h"
#include "rayrep/rays/ray_rep.h"

namespace rayrep {

/// What hollow() would find, as far as that can be told without meshing anything.
struct Preview {
  Spec spec;  ///< as HollowResult::spec
  /// Of the whole body as the solver has it, unit density of the print, in the frame of the mesh that was given. It differs from
  /// what is delivered by the error of the rays, which as-built passes make up for (theory.md (16d)).
  Moments moments = Moments::Zero();
  Mesh outside;  ///< as it will be stored, without what is cut off below; in the frame of the mesh that was given
  Eigen::Affine3d to_working = Eigen::Affine3d::Identity();  ///< as HollowResult::to_working
  RayRep voids;                                              ///< working frame: what is left out of the rays, or printed sparsely
};

/// Looks at what is in reach of one body, over and over with other settings: what a setting does not change (the outside and its
/// search tree, the inner domain, its integrals) is kept from one look to the next. Not for several threads at once.
class Previewer {
public:
  /// @param solid  as for hollow()
  explicit Previewer(Mesh solid);
  ~Previewer();
  Previewer(const Previewer&) = delete;
  Previewer& operator=(const Previewer&) = delete;

  /// On the rays of `options.resolution` (60 is enough to look at), by the exact solver whatever `options.solver` says. The same
  /// for any looks before.
  /// @throws Error as hollow() does; Error{usage} for what only a whole run finds: places of balls, and targets with all ten
  /// numbers
  Preview look(const Spec& spec, HollowOptions options, const Progress& progress = {});

private:
  Mesh solid_;
  std::shared_ptr<detail::KeptBodies> kept_;
};

}  // namespace rayrep
