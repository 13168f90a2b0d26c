#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace rayrep::detail {

/// One layer in pixels: u to the right and v down from the upper left corner of its image.
struct LayerSums {
  /// Integrals over what is exposed of 1, (u, v), and (uu uv; uv vv). A pixel is a square of one density.
  double area = 0;
  Eigen::Vector2d first = Eigen::Vector2d::Zero();
  Eigen::Matrix2d second = Eigen::Matrix2d::Zero();
  /// The outline: what is exposed and what that encloses.
  double outline_area = 0;
  Eigen::Vector2d outline_first = Eigen::Vector2d::Zero();
  Eigen::AlignedBox2d box;  ///< of what is exposed; pixels that are exposed in part count in part
};

/// Adds up an image row by row, in memory of the order of one row. Holes are spots that are less than half exposed, joined over
/// the sides of pixels, and that rows and columns of the image's edge do not reach.
class LayerScan {
public:
  /// @param coverage  by the value of a pixel: the part of it that is exposed, 0 ... 1, from nothing for 0 to all for 255
  LayerScan(std::size_t width, const std::array<double, 256>& coverage);

  /// The next row, `width` pixels.
  void add(std::span<const std::uint8_t> row);
  /// The sums of all rows. Call it once.
  LayerSums finish();

private:
  /// Where less than half is exposed, joined over the rows so far.
  struct Spot {
    int parent;
    double area = 0;  ///< not exposed
    Eigen::Vector2d first = Eigen::Vector2d::Zero();
  };

  void add_exposed(std::span<const std::uint8_t> row, std::size_t first, std::size_t last);
  void follow_spots(std::span<const std::uint8_t> row, std::size_t first, std::size_t last);
  int root(int spot);
  int united(int a, int b);
  void add_to_spot(int spot, double area, std::size_t column, std::size_t row);
  void drop_closed_spots();

  const std::array<double, 256>& coverage_;
  std::size_t width_;
  std::size_t row_ = 0;
  LayerSums sums_;
  std::vector<std::uint8_t> most_;  // of each column
  // Of the row before, with a column more at either side: the spot of a pixel, or none; what of a pixel that is more than half
  // exposed is not, as long as no spot beside it is known. Outside first_ ... last_ all is the outside.
  std::vector<int> spot_;
  std::vector<double> pending_;
  std::size_t first_ = 0;
  std::size_t last_ = 0;  // one past
  std::vector<Spot> spots_;
};

}  // namespace rayrep::detail
