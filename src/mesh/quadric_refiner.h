#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include "mesh/quadric_landing.h"
#include "rayrep/mesh/mesh.h"

namespace rayrep {

/// f along a segment from a to b: at_a + t slope + t^2 bend.
struct QuadricAlong {
  double at_a, slope, bend;

  QuadricAlong(const Quadric& f, const Eigen::Vector3d& a, const Eigen::Vector3d& b, double fa, double fb);
  /// Where it changes its sign, once.
  double root() const;
};

/// Splits edges and triangles of a mesh until f changes its sign at most once along each, and the chords of the curve f = 0 follow
/// it. What is new is put on the surface that the mesh stands for. theory.md (87), (130)
class QuadricRefiner {
public:
  /// Keeps references to all.
  QuadricRefiner(Mesh& mesh, const Quadric& f, const QuadricClipOptions& options);

  void run();
  /// Splits some triangles more: at ridges of the surface that they cut off, else in halves.
  /// @returns false where none of them can be
  bool split(const std::vector<std::size_t>& triangles);

  /// Moves corners of triangles onto the surface where that takes them to the other side of f = 0 and nothing crosses by that.
  /// theory.md (138) @returns whether any
  bool land(const std::vector<std::size_t>& triangles);

  /// f at the vertices.
  const std::vector<double>& values() const { return value_; }
  /// Of the vertices, whether they were added or moved, and whether they were moved.
  const std::vector<char>& is_new() const { return is_new_; }
  const std::vector<char>& is_moved() const { return is_moved_; }

private:
  /// Where an edge is split.
  struct Middle {
    int vertex;
    Eigen::Vector3d on_edge;  ///< where it would be on the mesh
    bool is_needed;           ///< for signs; else no split is better than one that is not on the surface
  };
  /// A triangle some of whose sides are split: by vertices, -1 where one is not.
  struct Cut {
    std::size_t triangle;
    std::array<int, 3> middle;
  };

  bool above(int vertex) const { return options_.is_above(value_[vertex]); }
  double length(int a, int b) const { return (mesh_.vertices[a] - mesh_.vertices[b]).norm(); }
  Eigen::Vector3d middle(int a, int b) const { return 0.5 * (mesh_.vertices[a] + mesh_.vertices[b]); }
  Eigen::Vector3d area(const Eigen::Vector3i& v) const;
  int add(const Eigen::Vector3d& p);
  void move(int n, const Eigen::Vector3d& p);

  void begin();
  void refine();
  void look_at(std::size_t t);
  bool split_twice_crossed(int a, int b);
  void split_around_extreme(std::size_t t);
  void split_long_chord(const Eigen::Vector3i& v);
  bool split_at_ridge(int a, int b);
  bool may_halve(int a, int b) const;
  void split_needed(int a, int b, const Eigen::Vector3d& p);

  void split_all();
  void split_inner();
  std::vector<std::size_t> touched() const;
  std::vector<Cut> cuts(const std::vector<std::size_t>& triangles) const;
  bool undo_folds(const std::vector<Cut>& cuts);
  bool undo_crossings(const std::vector<Cut>& cuts);
  bool undo_crossings(std::unordered_map<int, Eigen::Vector3d>& before);
  bool undo(const Cut& cut);
  bool is_folded(const Eigen::Vector3i& v, const std::vector<Eigen::Vector3i>& pieces) const;
  std::vector<Eigen::Vector3i> around(const std::vector<Cut>& cuts) const;
  Eigen::AlignedBox3d box_of(const Eigen::Vector3i& v) const;
  std::vector<Eigen::Vector3i> pieces(const Cut& cut) const;
  void replace(std::size_t t, const std::vector<Eigen::Vector3i>& pieces);

  Mesh& mesh_;
  const Quadric& f_;
  const QuadricClipOptions& options_;
  QuadricLanding land_;
  std::vector<double> value_;
  std::vector<char> is_new_, is_moved_;
  std::unordered_set<int> stays_;                     ///< vertices whose way onto the surface was undone
  std::unordered_map<std::uint64_t, Middle> middle_;  ///< of edges that are split
  std::unordered_set<std::uint64_t> whole_;           ///< edges whose split was undone
  std::vector<std::pair<std::size_t, Eigen::Vector3d>> inner_;
  std::vector<std::size_t> new_;  ///< triangles that were not looked at yet
};

}  // namespace rayrep
