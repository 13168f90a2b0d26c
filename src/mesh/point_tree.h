#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <vector>

namespace rayrep {

/// A tree of boxes over points, to find those near a segment.
class PointTree {
public:
  /// Keeps a reference to the points.
  /// @param members  which of them are to be found
  PointTree(const std::vector<Eigen::Vector3d>& points, std::vector<int> members);

  /// The members within `reach` of the segment from a to b, ascending.
  void near_segment(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double reach, std::vector<int>& found) const;

private:
  struct Node {
    Eigen::AlignedBox3d box;
    std::size_t begin = 0, end = 0;  ///< of members_
    int right = -1;                  ///< the left child follows its parent; -1: a leaf
  };
  void build(std::size_t begin, std::size_t end);
  void search(int node, const Eigen::Vector3d& a, const Eigen::Vector3d& b, double reach, std::vector<int>& found) const;

  const std::vector<Eigen::Vector3d>& points_;
  std::vector<int> members_;
  std::vector<Node> nodes_;
};

/// Distance of p from the segment, and how far along it from a (0 to its length) the nearest point lies.
struct OnSegment {
  double distance = 0;
  double along = 0;
};
OnSegment on_segment(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b);

}  // namespace rayrep
