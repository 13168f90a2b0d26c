#include "rayrep/mesh/block_field.h"

namespace rayrep {

float BlockField::at(int i, int j, int k) const {
  if (i < 0 || j < 0 || k < 0) return far();
  const int a = i / kSide;
  const int b = j / kSide;
  const int c = k / kSide;
  if (a >= blocks.x() || b >= blocks.y() || c >= blocks.z()) return far();
  const std::int32_t s = state[block_index(a, b, c)];
  if (s == kOutside) return far();
  if (s == kInside) return -far();
  return samples[static_cast<std::size_t>(s)][static_cast<std::size_t>(sample_index(i % kSide, j % kSide, k % kSide))];
}

bool BlockField::raise(int i, int j, int k, float value) {
  const float before = at(i, j, k);
  if (before >= value) return false;
  std::int32_t& s = state[block_index(i / kSide, j / kSide, k / kSide)];
  if (s == kInside) {
    s = static_cast<std::int32_t>(samples.size());
    samples.emplace_back().fill(-far());
  }
  samples[static_cast<std::size_t>(s)][static_cast<std::size_t>(sample_index(i % kSide, j % kSide, k % kSide))] = value;
  return before < 0 && value >= 0;
}

}  // namespace rayrep
