#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "physics/clipped_hull.h"
#include "physics/pockets.h"
#include "rayrep/physics/hydrostatics.h"

namespace rayrep {

struct PreparedHull::State {
  explicit State(Mesh m) : mesh(std::move(m)) {}

  const Mesh mesh;
  LazyHullSurface surface;  // of the mesh as it is
  const std::vector<char>& pinched() {
    std::call_once(pinched_once_, [this] { pinched_ = pinched_vertices(mesh.triangles, mesh.vertices.size()); });
    return pinched_;
  }
  const ClippedHull& clipped() {
    std::call_once(clipped_once_, [this] { clipped_.emplace(mesh); });
    return *clipped_;
  }

  /// Of all heights, for one normal: the first that is asked for, that of a body upright. None for others.
  std::shared_ptr<const FloodHeights> floods_along(const Frame& frame) {
    std::call_once(floods_once_, [&] {
      floods_normal_ = frame.n;
      std::vector<double> heights;
      for (const auto& v : mesh.vertices) heights.push_back(frame.n.dot(v));
      floods_ = std::make_shared<FloodHeights>(surface.get(mesh.vertices, mesh.triangles).flood_heights(frame, heights, {}));
    });
    return floods_normal_ == frame.n ? floods_ : nullptr;
  }

  /// Set to the direction of the first that is asked for, with all its pockets: what follows for it is the same as from clipped().
  ClippedHull clipped_along(const Eigen::Vector3d& normal) {
    std::call_once(upright_once_, [&] {
      upright_.emplace(clipped());
      upright_->set_up(normal);
      upright_->find_all_pockets();
    });
    if (upright_->frame().n == normal) return *upright_;
    ClippedHull hull = clipped();
    hull.set_up(normal);
    return hull;
  }

private:
  std::once_flag upright_once_;
  std::optional<ClippedHull> upright_;
  std::once_flag floods_once_;
  Eigen::Vector3d floods_normal_;
  std::shared_ptr<const FloodHeights> floods_;
  std::once_flag pinched_once_;
  std::once_flag clipped_once_;
  std::vector<char> pinched_;
  std::optional<ClippedHull> clipped_;
};

}  // namespace rayrep
