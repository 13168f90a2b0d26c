#pragma once

#include <algorithm>
#include <numeric>
#include <vector>

namespace rayrep {

/// Which of 0 ... n - 1 have been joined to each other. The root of a set is its least member.
class UnionFind {
public:
  explicit UnionFind(int n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0); }
  int root(int i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void unite(int a, int b) {
    a = root(a);
    b = root(b);
    if (a != b) parent_[std::max(a, b)] = std::min(a, b);
  }

private:
  std::vector<int> parent_;
};

}  // namespace rayrep
