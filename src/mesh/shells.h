#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "rayrep/mesh/mesh.h"
#include "rayrep/mesh/surface_query.h"

// Which shell of a mesh lies in which. A shell is any set of triangles; what is said of it means something where it is closed.

namespace rayrep {

/// Signed volume of each shell 0 ... count - 1, negative where it faces inward.
/// @param of_triangle  shell of each triangle; those of negative ones are left aside
std::vector<double> shell_volumes(const Mesh& mesh, const std::vector<int>& of_triangle, int count);

/// What lies around a point of a shell, the shell itself left aside.
struct Surroundings {
  struct Around {
    int shell;
    int winding;
  };
  std::vector<Around> shells;  ///< those with a winding number other than 0 there, ascending
  std::vector<int> touched;    ///< shells that a vertical line meets there, within 1e-9 of the mesh's diagonal
  int winding = 0;             ///< of all of them; > 0: in material
  bool line_closes = true;     ///< the vertical line through the point leaves the mesh as often as it enters it
};

/// Finds what is around points of a mesh by vertical lines.
class ShellNesting {
public:
  /// Keeps references to both.
  /// @param of_triangle  shell of each triangle, any number
  ShellNesting(const Mesh& mesh, const std::vector<int>& of_triangle);

  void around(const Eigen::Vector3d& p, int self, Surroundings& result);

private:
  const Mesh& mesh_;
  const std::vector<int>& of_triangle_;
  double touching_mm_;
  int few_ = 16;                         ///< the first lines look at every triangle: for them a tree does not pay
  std::optional<SurfaceQuery> surface_;  ///< for all others
  std::vector<LineHit> hits_;
  std::vector<Surroundings::Around> below_;
};

}  // namespace rayrep
