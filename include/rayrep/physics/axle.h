#pragma once

#include <vector>

#include "rayrep/mesh/delivery.h"
#include "rayrep/physics/cut.h"

namespace rayrep {

/// What the axle of a yo-yo comes to, in the frame of the body.
struct AxleFit {
  std::vector<Part> steel;     ///< of what is put in: a rod, and a bearing
  Mesh bore;                   ///< for the rod, from bottom to bottom; facing outward, as all of these
  std::vector<Mesh> taken;     ///< all that the body loses: the gap for the string, the bore, the seat of a bearing
  double rod_length_mm = 0;    ///< of steel, pushed home on both sides
  double rod_diameter_mm = 0;  ///< of it
  double across_mm = 0;        ///< of the widest that is put in
};

bool has_axle(const Axle& axle);

/// "an M4 rod", "an 8 mm rod", "an 8 mm rod in a 608 bearing"
const char* words_of(Axle::Kind kind);

/// A rod of steel (7.85 g/cm3) that reaches twice its diameter into each half, in a blind hole 0.1 mm wider all around, so that it
/// keeps the halves apart by the gap when it is pushed home. With a bearing 608 (22 mm across, 7 mm wide, 12 g) around its middle,
/// which sits in both halves, and rod holes below its seats.
/// @param centre_mm  of the yo-yo
/// @param axis       of its spin, a unit vector
/// @param reach_mm   more than any point of the body lies from the centre
AxleFit fit(const Axle& axle, const Eigen::Vector3d& centre_mm, const Eigen::Vector3d& axis, double reach_mm);

}  // namespace rayrep
