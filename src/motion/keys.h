#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace rayrep {

/// The piece of a list of two keys or more that a time is in: the number of its first key, and how far through it.
template <typename Key>
std::pair<std::size_t, double> piece_at(const std::vector<Key>& keys, double time) {
  const auto after = std::upper_bound(keys.begin() + 1, keys.end() - 1, time, [](double t, const Key& k) { return t < k.time; });
  const auto n = static_cast<std::size_t>(after - keys.begin()) - 1;
  const double length = keys[n + 1].time - keys[n].time;
  return {n, length > 0 ? std::clamp((time - keys[n].time) / length, 0.0, 1.0) : 1};
}

}  // namespace rayrep
