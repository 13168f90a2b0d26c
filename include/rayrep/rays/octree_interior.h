#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "rayrep/rays/voxel_interior.h"

namespace rayrep {

/// A cube of an octree over a domain, 2^level ray spacings wide. Cells one spacing wide are counted (i, j, k) from the first ray
/// and the lowest end of the domain; their Morton codes interleave the bits of i, j, k, i lowest. A leaf holds the codes from
/// `code`, a multiple of 8^level, to below code + 8^level.
struct OctreeLeaf {
  std::uint64_t code = 0;
  int level = 0;
  bool operator==(const OctreeLeaf&) const = default;
};

/// All cubes of one level that meet the domain, by ascending codes.
std::vector<OctreeLeaf> uniform_leaves(const RayRep& domain, int level);

/// Fill fractions of the leaves of an octree (Spin-It, Sec. 5.2-5.4), with the part of the domain in each leaf, exact on the
/// ray-rep as in VoxelInterior. With uniform leaves of level l it is VoxelInterior with k = 2^l in another order.
class OctreeInterior final : public FillInterior {
public:
  /// @param leaves            disjoint, ascending, covering the domain; those that do not meet it are dropped
  /// @param laplacian_weight  gamma of Spin-It's regulariser gamma / 2 rho^T L rho, where L is the uniform Laplacian of the leaves
  ///                          that share (a part of) a face
  OctreeInterior(const RayRep& domain, const std::vector<OctreeLeaf>& leaves, double laplacian_weight = 0);

  const std::vector<OctreeLeaf>& leaves() const { return leaves_; }
  /// Places in leaves() of every two that share a part of a face, each pair once.
  const std::vector<std::pair<int, int>>& neighbours() const { return neighbours_; }
  std::vector<Coupling> couplings() const override;

  struct Refinement {
    std::vector<OctreeLeaf> leaves;
    std::size_t splits = 0;
  };
  /// Spin-It's split-and-merge: leaves with a fraction in [epsilon, 1 - epsilon] are cut into eight unless they are of level 0;
  /// where all leaves of a cube are full, or all void, the cube takes their place, as large as possible.
  /// @param at_fill_changes  counts leaves with a neighbour on the other side of 1/2 as fractional too. Spin-It wants the finest
  ///                         cells at the surface between void and solid, but where the optimum is a vertex of the box, as it is
  ///                         for linear goals, no more fractions than constraints lie strictly between 0 and 1 there.
  Refinement split_and_merge(const Eigen::VectorXd& fill, double epsilon, bool at_fill_changes) const;

private:
  std::size_t leaf_with(std::uint64_t code) const;

  std::vector<OctreeLeaf> leaves_;
  std::vector<std::pair<int, int>> neighbours_;
  double laplacian_weight_;
};

}  // namespace rayrep
