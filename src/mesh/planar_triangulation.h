#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <span>
#include <vector>

namespace rayrep {

/// A triangulation of points in the plane that grows, with edges that stay. All decisions on which side of a line a point lies are
/// exact (orient2d), so that it stays a triangulation whatever the points are.
class PlanarTriangulation {
public:
  struct Triangle {
    std::array<int, 3> corner;     ///< counter-clockwise
    std::array<int, 3> neighbour;  ///< across the side opposite each corner; -1: none
    std::array<bool, 3> fixed;     ///< that side stays
  };
  /// Whether the side opposite corner k of triangle t, whose two triangles form a convex quadrilateral, is better flipped.
  using Improves = std::function<bool(const PlanarTriangulation&, int t, int k)>;

  /// @param low, high  of the points that will come
  PlanarTriangulation(const Eigen::Vector2d& low, const Eigen::Vector2d& high);

  /// Which sides are flipped from now on; to begin with those that are not Delaunay.
  void flip_where(Improves improves) { improves_ = std::move(improves); }

  /// Adds a point. @param near  a point close to it, or -1. @returns its number, or -1 where there is one already
  int add(const Eigen::Vector2d& p, int near);
  /// The same within a side that does not stay or a triangle that `accepts`; -1 elsewhere.
  int add_where(const Eigen::Vector2d& p, int near, const std::function<bool(int triangle)>& accepts);
  /// Makes a side from a to b that stays. @returns false where a point or another such side is in its way
  bool fix(int a, int b);
  /// Flips what is better flipped, everywhere.
  void improve();
  /// Triangles that can be reached from the left of these directed sides without going over one that stays. Empty where one can so
  /// come to the right of one of them, or to the end of the plane.
  std::vector<char> left_of(std::span<const std::array<int, 2>> sides) const;

  const std::vector<Triangle>& triangles() const { return triangles_; }
  const Eigen::Vector2d& point(int n) const { return points_[n]; }
  static constexpr int kFirst = 3;  ///< number of the first point added: those before are far away

  /// The corner of t's neighbour that t does not have, across the side opposite corner k.
  int apex(int t, int k) const;

private:
  struct Place {
    int triangle = -1;
    int on_side = -1;  ///< the point lies on the side opposite this corner
    bool on_corner = false;
  };
  /// The first side, from corner `first` on, beyond which p lies; -1 where it lies in the triangle: there.
  int way_out(int t, const Eigen::Vector2d& p, int first, Place& place) const;
  Place locate(const Eigen::Vector2d& p, int start) const;
  int side_to(int t, int neighbour) const;
  int corner_of(int t, int v) const;
  void attach(int t, int k, int neighbour, int their_side);
  void split_triangle(int t, int n);
  void split_side(int t, int k, int n);
  bool is_convex(int t, int k) const;
  void flip(int t, int k);
  void settle();
  int insert(const Eigen::Vector2d& p, const Place& place);
  bool find_side(int a, int b, int& t, int& k) const;
  /// The sides that a segment crosses, as pairs of points. @returns false where it meets a point
  bool crossed(int a, int b, std::vector<std::array<int, 2>>& sides) const;
  std::vector<int> around(int v) const;

  std::vector<Eigen::Vector2d> points_;
  std::vector<Triangle> triangles_;
  std::vector<int> at_;                       ///< a triangle at each point
  std::vector<std::array<int, 2>> doubtful_;  ///< sides to look at, as triangle and corner
  Improves improves_;
};

}  // namespace rayrep
