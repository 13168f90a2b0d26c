#pragma once

#include <Eigen/Core>
#include <vector>

#include "make/body.h"

namespace rayrep::detail {

/// By how much a number changes per mm that each vertex of a mesh moves.
using VertexGradient = std::vector<Eigen::Vector3d>;

/// What of a surface bounds the solid: of overlapping components not the triangles that lie in another one.
std::vector<char> outer_triangles(const Mesh& mesh);

/// Adds the change of q . moments of the solid.
void add_outer(const Mesh& mesh, const std::vector<char>& outer, const Moments& q, VertexGradient& gradient);

/// The surface around a body's inner domain, where the distance to the outside is the wall: samples, each with the place of the
/// outside that is nearest.
class WallSamples {
public:
  /// Of rays and field of the body.
  WallSamples(const Body& body, double wall_mm);

  /// Adds the change of min over all interiors of q . moments that comes from the motion of this surface with the outside.
  void add(const Mesh& mesh, const Phases& phases, const Moments& q, VertexGradient& gradient) const;

private:
  struct Sample {
    Eigen::Vector3d at;
    Eigen::Vector3d outward;  ///< times its area, to the nearest place
    int triangle;
    Eigen::Vector3d weights;  ///< of the triangle's corners
  };
  std::vector<Sample> samples_;
};

/// Of a point in a triangle.
Eigen::Vector3d corner_weights(const Mesh& mesh, int triangle, const Eigen::Vector3d& p);

}  // namespace rayrep::detail
