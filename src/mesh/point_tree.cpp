#include "mesh/point_tree.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace rayrep {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kLeaf = 8;

/// Whether a segment comes within `reach` of a box along every axis at once.
bool comes_near(const Eigen::AlignedBox3d& box, const Vector3d& a, const Vector3d& b, double reach) {
  double begin = 0;
  double end = 1;
  for (int k = 0; k < 3; ++k) {
    const double low = box.min()[k] - reach - a[k];
    const double high = box.max()[k] + reach - a[k];
    const double d = b[k] - a[k];
    if (d == 0) {
      if (low > 0 || high < 0) return false;
      continue;
    }
    // A little wider, for rounding.
    begin = std::max(begin, std::min(low / d, high / d) - 1e-12);
    end = std::min(end, std::max(low / d, high / d) + 1e-12);
    if (begin > end) return false;
  }
  return true;
}

}  // namespace

OnSegment on_segment(const Vector3d& p, const Vector3d& a, const Vector3d& b) {
  const Vector3d d = b - a;
  const double length = d.norm();
  if (length == 0) return {(p - a).norm(), 0};
  const double along = std::clamp((p - a).dot(d) / length, 0.0, length);
  return {(p - a - along / length * d).norm(), along};
}

PointTree::PointTree(const std::vector<Vector3d>& points, std::vector<int> members)
    : points_(points), members_(std::move(members)) {
  nodes_.reserve(members_.size() / 2 + 1);
  if (!members_.empty()) build(0, members_.size());
}

void PointTree::build(std::size_t begin, std::size_t end) {
  const std::size_t self = nodes_.size();
  Node& node = nodes_.emplace_back();
  node.begin = begin;
  node.end = end;
  for (std::size_t n = begin; n < end; ++n) node.box.extend(points_[members_[n]]);
  if (end - begin <= kLeaf) return;
  int axis = 0;
  node.box.sizes().maxCoeff(&axis);
  const auto at = [this](std::size_t n) { return members_.begin() + static_cast<std::ptrdiff_t>(n); };
  const std::size_t middle = (begin + end) / 2;
  std::nth_element(at(begin), at(middle), at(end), [this, axis](int i, int j) { return points_[i][axis] < points_[j][axis]; });
  build(begin, middle);
  nodes_[self].right = static_cast<int>(nodes_.size());
  build(middle, end);
}

void PointTree::search(int n, const Vector3d& a, const Vector3d& b, double reach, std::vector<int>& found) const {
  const Node& node = nodes_[n];
  if (!comes_near(node.box, a, b, reach)) return;
  if (node.right >= 0) {
    search(n + 1, a, b, reach, found);
    search(node.right, a, b, reach, found);
    return;
  }
  for (std::size_t i = node.begin; i < node.end; ++i)
    if (on_segment(points_[members_[i]], a, b).distance <= reach) found.push_back(members_[i]);
}

void PointTree::near_segment(const Vector3d& a, const Vector3d& b, double reach, std::vector<int>& found) const {
  found.clear();
  if (nodes_.empty()) return;
  search(0, a, b, reach, found);
  std::sort(found.begin(), found.end());
}

}  // namespace rayrep
