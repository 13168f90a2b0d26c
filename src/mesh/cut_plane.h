#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <utility>
#include <vector>

#include "mesh/exact_point.h"

namespace rayrep {

/// A triangulation of part of a plane, seen against a coordinate axis, into which points and segments are put. Every decision is
/// exact. Faces can be given up: of what comes later only the points on their rims are kept, since faces beside them need those, so
/// that the work goes with what is still wanted.
class CutPlane {
public:
  struct Face {
    std::array<int, 3> vertex{};               ///< counter-clockwise
    std::array<int, 3> neighbour{-1, -1, -1};  ///< across the side opposite to each vertex; -1: none
    std::array<int, 3> line{-1, -1, -1};       ///< of the segment that such a side is a part of; -1: none
    std::array<int, 3> stamp{-1, -1, -1};      ///< of the last segment that ran along it
    bool alive = true;
    bool below = true, above = true;  ///< for the caller, and so is this:
    int cover = 0;
  };
  /// Where the lines of two segments cross.
  using Crossing = std::function<ExactPoint(int line, int other)>;

  /// @param corners  counter-clockwise
  /// @param lines    of the sides opposite to them
  CutPlane(int axis, const std::array<ExactPoint, 3>& corners, const std::array<int, 3>& lines, Crossing crossing);

  /// A point inside or on the rim of the first triangle. @return its number: that of an equal point if there is one
  int insert(ExactPoint point);

  struct Segment {
    int line = -1;  ///< by which `crossing` knows it; all that lie on each other are as good
    int stamp = -1;
  };
  /// From one point to another. It ends up as sides of faces wherever there is a face that has not been given up.
  void insert(int from, int to, const Segment& segment);

  /// Turns sides that are no part of a segment where that makes the faces beside them rounder (Delaunay, by rounded places).
  void improve();

  const std::vector<ExactPoint>& points() const { return points_; }
  std::vector<Face>& faces() { return faces_; }
  const std::vector<Face>& faces() const { return faces_; }

private:
  struct Place {
    int face = 0;
    int side = -1;    ///< on the side opposite to this corner
    int corner = -1;  ///< at this corner
  };
  /// What a walk along a segment meets first.
  struct Step {
    int vertex = -1;                             ///< a point on the segment, or
    int face = -1, side = -1;                    ///< a side that it has to be cut at
    bool alive = true;                           ///< the faces on the way
    std::vector<std::pair<int, int>> crossed{};  ///< sides on the way
  };

  int orient(int a, int b, int c) const;
  Place locate(const ExactPoint& point) const;
  bool place_in(int face, const ExactPoint& point, Place& place, int& outside) const;
  void put(int face, const Face& value);
  void relink(int neighbour, int from, int to);
  void split_face(int face, int point);
  void split_side(int face, int side, int point);
  void flip(int face, int side);
  bool convex(int face, int side) const;
  bool improvable(int face, int side) const;
  void legalise(std::vector<std::pair<int, int>> sides);
  std::pair<int, int> find_side(int a, int b) const;
  Step walk(int from, int to) const;
  Step walk_across(Step step, std::pair<int, int> at, int from, int to) const;
  void force(int from, int to, const std::vector<std::pair<int, int>>& crossed);
  int corner_of(int face, int vertex) const;

  int axis_;
  Crossing crossing_;
  std::vector<ExactPoint> points_;
  std::vector<int> face_at_;  ///< of each point
  std::vector<Face> faces_;
  int hint_ = 0;  ///< near the last point
};

}  // namespace rayrep
