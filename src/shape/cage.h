#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <array>
#include <utility>
#include <vector>

#include "rayrep/mesh/mesh.h"
#include "shape/sensitivity.h"

namespace rayrep::detail {

/// One row a handle: its displacement, or what pulls at it.
using Handles = Eigen::Matrix<double, Eigen::Dynamic, 3>;

/// How much of the cage's motion each vertex takes part in, 0 to 1.
struct Freedom {
  std::vector<double> across;  ///< in x and y
  std::vector<double> along;   ///< in z
};

/// Moves a mesh smoothly by few handles: cubic B-splines on a lattice of cells around it. A handle is one control point for one
/// connected part of the body in the B-spline's support: legs that are near but joined only farther away have handles of their own.
/// theory.md (63)
class Cage {
public:
  struct Options {
    double cell_mm = 10;       ///< of the lattice
    double stiffness_mm = 10;  ///< l: how bending counts, see energy
  };
  /// @param mesh  closed; z is the direction of Freedom::along
  Cage(const Mesh& mesh, Freedom freedom, const Options& options);

  Eigen::Index handles() const { return handles_; }
  /// Of each vertex.
  std::vector<Eigen::Vector3d> displacement(const Handles& handles) const;
  /// A gradient by vertices as one by handles.
  Handles pulled_back(const VertexGradient& gradient) const;

  /// Mean over the surface of |u|^2 + l^4 |second derivatives of u|^2, and l^2 (change of length / length)^2 of gaps that the
  /// surface faces itself across, in mm^2. theory.md (63)
  double energy(const Handles& handles) const;
  /// The handles h for which energy(h) / 2 - force.h is least.
  Handles compliant(const Handles& force) const;

  /// Lets vertices count more than their area in |u|^2.
  void weigh(const std::vector<double>& weights);
  /// Lets gaps that these handles close by more than half count more. @returns whether there are any
  bool keep_open(const Handles& handles);
  /// Makes these pairs of vertices, so far apart, move alike; the more so the oftener it is asked.
  void keep_apart(const std::vector<std::pair<int, int>>& pairs, const Mesh& mesh);

private:
  struct Entry {
    int handle;
    float weight;
  };
  /// A way through the outside along an axis, or in any direction (3), from one vertex to another.
  struct Gap {
    int axis;
    int from, to;
    double weight;  ///< of the square of the change of its length
    double length_mm;
  };
  struct Lattice;
  class Links;
  void find_handles(const Mesh& mesh, const Lattice& lattice, const Links& links);
  void assemble();
  void add_gap(const Gap& gap, int axis);
  double freedom(int vertex, int axis) const;

  Freedom freedom_;
  double stiffness_mm_;
  std::vector<double> area_;     ///< of each vertex, over that of all
  std::vector<double> weights_;  ///< by which it counts
  std::vector<Gap> gaps_;
  std::vector<std::size_t> first_;                 ///< entries of vertex v: first_[v] to first_[v + 1]
  std::vector<Entry> entries_;                     ///< B-splines,
  std::vector<Eigen::Matrix<float, 6, 1>> bends_;  ///< and their second derivatives: xx, yy, zz, xy, yz, xz times root 2
  Eigen::Index handles_ = 0;
  Eigen::MatrixXd bending_;
  std::array<Eigen::MatrixXd, 3> energy_;  ///< of motion in x, y and z; lower triangles
  std::array<Eigen::LLT<Eigen::MatrixXd>, 3> solve_;
};

}  // namespace rayrep::detail
