#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "rayrep/draw/drawing.h"
#include "rayrep/mesh/clip.h"
#include "rayrep/mesh/mesh.h"

namespace rayrep {

/// A closed mesh as it is shaded; vertices merged, or it looks faceted.
struct ShadedPart {
  Mesh mesh;
  Colour colour;
  Colour cut_colour;                   ///< of where it is cut
  std::vector<Colour> of_vertex = {};  ///< wins over colour; empty: none
};

/// From where, and how large: orthographic.
struct Camera {
  Eigen::Matrix3d to_view = Eigen::Matrix3d::Identity();  ///< rows: what points right, up and to the viewer
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();    ///< in the middle of the image; frame of the mesh
  double mm_per_px = 1;
  int width_px = 0;
  int height_px = 0;
  int samples = 3;  ///< along each side of a pixel
};

/// Looking at a body with `up` upright, from `azimuth_rad` (0: against the y axis of the frame with up = +z, growing against the
/// clock seen from above) and `elevation_rad` above the ground.
Eigen::Matrix3d looking(const Eigen::Vector3d& up, double azimuth_rad, double elevation_rad);

/// Parts by a z-buffer over their triangles, several samples for each pixel: soft light from above and the left, hollows darker,
/// contours drawn. With a cut, what of the parts lies where its normal points is away, and where that cuts material, found by the
/// winding number on the plane, the cut colour is seen; of parts that both have material there the later one's. The normal of a cut
/// must point to the viewer (asserted). Empty pixels have no opacity. The same bytes for any number of threads.
Image shaded(const std::vector<ShadedPart>& parts, const Camera& camera, const std::optional<ClipPlane>& cut = {});

}  // namespace rayrep
