#pragma once

#include <deque>
#include <memory>

#include "make/body.h"

namespace rayrep::detail {

/// The last bodies that were built, each with all that it depends on. Only for looks: whoever carries a plan out changes its body.
/// Not for several threads at once.
class KeptBodies {
public:
  /// The same as a new one. What has the mesh and frame of one of those kept takes its outside over.
  std::shared_ptr<Body> body(const Eigen::Affine3d& frame, const Mesh& mesh, const Discretisation& options,
                             const Progress& progress);

private:
  struct Kept {
    std::shared_ptr<Body> body;
    Discretisation options;
  };
  std::deque<Kept> kept_;  ///< the last one used first
};

}  // namespace rayrep::detail
