#include "mesh/box_tree.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace rayrep {

BoxTree::BoxTree(std::vector<Eigen::AlignedBox3d> boxes) : boxes_(std::move(boxes)), members_(boxes_.size()) {
  std::iota(members_.begin(), members_.end(), 0);
  nodes_.reserve(boxes_.size() + 1);
  build(0, members_.size());
}

void BoxTree::build(std::size_t begin, std::size_t end) {
  constexpr std::size_t leaf = 4;
  const std::size_t number = nodes_.size();
  Node node;
  node.begin = begin;
  node.end = end;
  for (std::size_t i = begin; i < end; ++i) node.box.extend(boxes_[static_cast<std::size_t>(members_[i])]);
  nodes_.push_back(node);
  if (end - begin <= leaf) return;
  int axis = 0;
  node.box.sizes().maxCoeff(&axis);
  const std::size_t middle = begin + (end - begin) / 2;
  const auto at = [this](std::size_t i) { return members_.begin() + static_cast<std::ptrdiff_t>(i); };
  std::nth_element(at(begin), at(middle), at(end), [&](int a, int b) {
    const auto centre = [&](int n) {
      const Eigen::AlignedBox3d& box = boxes_[static_cast<std::size_t>(n)];
      return box.min()[axis] + box.max()[axis];
    };
    return std::pair(centre(a), a) < std::pair(centre(b), b);
  });
  build(begin, middle);
  nodes_[number].right = static_cast<int>(nodes_.size());
  build(middle, end);
}

}  // namespace rayrep
