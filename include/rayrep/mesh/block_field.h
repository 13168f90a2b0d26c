#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace rayrep {

/// A scalar field sampled on a regular grid, stored only where its sign changes: the grid is cut into blocks of 8 x 8 x 8 samples,
/// and a block whose samples are all far from zero is only marked. Sample (i, j, k) lies at origin + spacing (i, j, k). Negative
/// values are inside. Values are in mm; those of samples with no neighbour (one step along an axis) of the other sign only have the
/// right sign.
struct BlockField {
  static constexpr int kSide = 8;
  static constexpr std::int32_t kOutside = -1;
  static constexpr std::int32_t kInside = -2;
  using Block = std::array<float, kSide * kSide * kSide>;  ///< index (i * 8 + j) * 8 + k

  Eigen::Vector3d origin_mm = Eigen::Vector3d::Zero();
  double spacing_mm = 1;
  Eigen::Vector3i blocks = Eigen::Vector3i::Zero();  ///< number of blocks along x, y, z
  std::vector<std::int32_t> state;  ///< kOutside, kInside or an index into `samples`; block (a * nb_y + b) * nb_z + c
  std::vector<Block> samples;

  std::size_t block_index(int a, int b, int c) const {
    return (static_cast<std::size_t>(a) * static_cast<std::size_t>(blocks.y()) + static_cast<std::size_t>(b)) *
               static_cast<std::size_t>(blocks.z()) +
           static_cast<std::size_t>(c);
  }
  static constexpr int sample_index(int i, int j, int k) { return (i * kSide + j) * kSide + k; }
  Eigen::Vector3d position(int i, int j, int k) const { return origin_mm + spacing_mm * Eigen::Vector3d(i, j, k); }

  /// Value of sample (i, j, k); +-`far()` in marked blocks and beyond the grid (outside).
  float at(int i, int j, int k) const;
  /// Sets a sample of the grid to at least `value`; true if that changed its sign. Marked blocks become stored ones as needed.
  bool raise(int i, int j, int k, float value);
  float far() const { return static_cast<float>(4 * spacing_mm); }
};

}  // namespace rayrep
