#pragma once

#include <Eigen/Geometry>
#include <vector>

namespace rayrep {

/// A tree of boxes, to find those that a line along a coordinate axis meets, or to be descended into by its nodes.
class BoxTree {
public:
  explicit BoxTree(std::vector<Eigen::AlignedBox3d> boxes);

  /// Around all of them.
  const Eigen::AlignedBox3d& box() const { return nodes_.front().box; }

  /// A node: a part of the boxes. That of number 0 is all of them.
  struct Node {
    Eigen::AlignedBox3d box;
    std::size_t begin = 0, end = 0;  ///< of the members, see `member`
    int right = -1;                  ///< the left child follows its parent; -1: a leaf, of four boxes at most
    bool is_leaf() const { return right < 0; }
  };
  const Node& node(int number) const { return nodes_[static_cast<std::size_t>(number)]; }
  /// Number of the n-th box in the order of the leaves.
  int member(std::size_t n) const { return members_[n]; }
  const Eigen::AlignedBox3d& box_of(int number) const { return boxes_[static_cast<std::size_t>(number)]; }

  /// Calls visit(number) for every box that comes within `margin` of the part of the line along `axis` through p that ends at p, in
  /// an order that depends on the boxes alone.
  template <typename Visit>
  void below(const Eigen::Vector3d& p, int axis, double margin, const Visit& visit) const {
    int stack[64];  // a tree is halved at every level
    int size = 0;
    stack[size++] = 0;
    while (size > 0) {
      const Node& node = nodes_[static_cast<std::size_t>(stack[--size])];
      if (!meets(node.box, p, axis, margin)) continue;
      if (node.right >= 0) {
        stack[size++] = node.right;
        stack[size++] = static_cast<int>(&node - nodes_.data()) + 1;
        continue;
      }
      for (std::size_t i = node.begin; i < node.end; ++i)
        if (meets(boxes_[static_cast<std::size_t>(members_[i])], p, axis, margin)) visit(members_[i]);
    }
  }

private:
  static bool meets(const Eigen::AlignedBox3d& box, const Eigen::Vector3d& p, int axis, double margin) {
    const int i = (axis + 1) % 3, j = (axis + 2) % 3;
    return box.min()[axis] <= p[axis] + margin && box.min()[i] <= p[i] + margin && p[i] <= box.max()[i] + margin &&
           box.min()[j] <= p[j] + margin && p[j] <= box.max()[j] + margin;
  }
  void build(std::size_t begin, std::size_t end);

  std::vector<Eigen::AlignedBox3d> boxes_;
  std::vector<int> members_;
  std::vector<Node> nodes_;
};

}  // namespace rayrep
