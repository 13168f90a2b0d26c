#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "mesh/box_tree.h"
#include "rayrep/mesh/mesh.h"
#include "rayrep/mesh/surface_query.h"

namespace rayrep {

/// A part of a scene, in its mesh's coordinates, as it is asked for where it is near to others. Its closed mesh is solid where its
/// winding number is positive.
class SolidBody {
public:
  explicit SolidBody(std::shared_ptr<const Mesh> mesh);
  /// To be called before anything is asked that is not of its mesh and box.
  void prepare();
  bool is_prepared() const { return tree_.has_value(); }

  const Mesh& mesh() const { return *mesh_; }
  const Eigen::AlignedBox3d& box() const { return box_; }
  double diagonal_mm() const { return box_.diagonal().norm(); }
  /// The largest distance of a point from `pivot_mm`.
  double reach_mm(const Eigen::Vector3d& pivot_mm) const;

  const SurfaceQuery& surface() const { return *surface_; }
  const BoxTree& tree() const { return *tree_; }  ///< of its triangles
  /// A corner of each connected component, and a point inside near it.
  const std::vector<Eigen::Vector3d>& corners() const { return corners_; }
  const std::vector<Eigen::Vector3d>& inner_points() const { return inner_points_; }

  /// Winding number positive; of points on the surface either.
  bool contains(const Eigen::Vector3d& p) const;
  /// How deep p is inside, negative outside: exact where that is more than `least_mm`, which is not negative, otherwise a bound
  /// from above.
  double depth_mm(const Eigen::Vector3d& p, double least_mm) const;

private:
  std::shared_ptr<const Mesh> mesh_;
  Eigen::AlignedBox3d box_;
  std::optional<SurfaceQuery> surface_;
  std::optional<BoxTree> tree_;
  std::vector<Eigen::Vector3d> corners_, inner_points_;
};

}  // namespace rayrep
