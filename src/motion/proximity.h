#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <limits>
#include <vector>

#include "mesh/triangle_distance.h"
#include "motion/solid_body.h"

// How near two bodies are, how deep one is in the other, and where their surfaces cross, all in the frame of the first.
// theory.md (110), (111)

namespace rayrep {

struct Nearness {
  double at_least_mm = 0;  ///< the surfaces are not nearer
  double at_most_mm = 0;   ///< some points of them are so near; infinite: further than was asked for
  NearestPair points;
  int first = -1, second = -1;  ///< their triangles
};

/// How much larger than the true distance one may be that is found.
inline constexpr double kLoose = 1.1;

/// Of two surfaces, by descent of their trees: at_most is at_least times `loose`, or 0 where they cross, unless they are farther
/// apart than `cap_mm`: that is then what is told.
/// @param pose  of the second in the frame of the first
Nearness nearness(const SolidBody& first, const SolidBody& second, const Eigen::Isometry3d& pose, double cap_mm,
                  double loose = kLoose);

/// A bound from below of their distance, by their boxes alone.
double apart_by_boxes(const SolidBody& first, const SolidBody& second, const Eigen::Isometry3d& pose);

/// Whether the surfaces stay further apart than `gap_mm` wherever in the convex hull of `offsets_mm`, in the frame of the first,
/// the second is moved to, theory.md (110). True is proven; false may be that it took too long.
bool keeps_apart(const SolidBody& first, const SolidBody& second, const Eigen::Isometry3d& pose,
                 const std::vector<Eigen::Vector3d>& offsets_mm, double gap_mm);

/// Whether a connected part of one of the surfaces lies in the other body, for surfaces that do not cross.
bool one_holds_other(const SolidBody& first, const SolidBody& second, const Eigen::Isometry3d& pose);

struct Depth {
  double at_least_mm = 0;  ///< of the point; 0: none was found
  Eigen::Vector3d place_mm = Eigen::Vector3d::Zero();
};

/// When the deepest point has been looked for long enough.
struct DepthWanted {
  double enough_mm = std::numeric_limits<double>::infinity();  ///< one so deep does
  double least_mm = 0;                                         ///< whether there is a deeper one than this is of interest
  double factor = 2;                                           ///< the deepest is not deeper than this times what was found
  int points = 160;                                            ///< that are looked at, in either body
};

/// How deep a point of one body is inside the other: the deepest of the surfaces', to a factor, unless enough was found or it took
/// too long.
Depth depth_inside(const SolidBody& first, const SolidBody& second, const Eigen::Isometry3d& pose, const DepthWanted& wanted = {});

/// A piece of the curve where the surfaces cross, with how its ends come about: a side of a triangle of one surface meets a
/// triangle of the other.
struct ContourPiece {
  struct End {
    Eigen::Vector3d at_mm;
    Eigen::Vector3d along;   ///< the side's direction
    Eigen::Vector3d normal;  ///< of the triangle
    bool moved_side;         ///< the side is of the second body, the triangle of the first
    int side;                ///< its number in its triangle
  };
  std::array<End, 2> ends;
  int first = -1, second = -1;  ///< triangles
  double length_mm() const { return (ends[1].at_mm - ends[0].at_mm).norm(); }
};

/// Pieces of the curve in which the surfaces cross, at most `most`. Triangles in one plane have none.
std::vector<ContourPiece> contour(const SolidBody& first, const SolidBody& second, const Eigen::Isometry3d& pose,
                                  std::size_t most = std::numeric_limits<std::size_t>::max());

}  // namespace rayrep
