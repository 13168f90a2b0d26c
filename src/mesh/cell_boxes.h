#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "rayrep/mesh/mesh.h"

// Boxes on a grid, eight of which are looked at at once.

namespace rayrep {

/// A box on a grid of 65000 cells along the longest side. One as made meets nothing.
struct CellBox {
  std::array<std::int16_t, 3> low{INT16_MAX, INT16_MAX, INT16_MAX};
  std::array<std::int16_t, 3> high{INT16_MIN, INT16_MIN, INT16_MIN};

  void extend(const CellBox& other);
  int longest_side() const;
};

CellBox intersection(const CellBox& a, const CellBox& b);

constexpr std::size_t kEight = 8;

struct EightBoxes {
  std::int16_t low[3][kEight];
  std::int16_t high[3][kEight];

  EightBoxes();
  void set(std::size_t k, const CellBox& box);
  CellBox at(std::size_t k) const { return {{low[0][k], low[1][k], low[2][k]}, {high[0][k], high[1][k], high[2][k]}}; }
};

/// A bit for each of the boxes that meet another one.
std::uint32_t meeting(const EightBoxes& boxes, const CellBox& box);

/// The cells of a mesh's bounding box.
class CellGrid {
public:
  explicit CellGrid(const Mesh& mesh);

  /// Those of its triangles, a cell larger on every side: those of triangles that nearly touch meet.
  std::vector<CellBox> boxes_of_triangles(const Mesh& mesh) const;
  /// Around any other box, a cell larger on every side, as far as there are numbers for it.
  CellBox around(const Eigen::AlignedBox3d& box) const;

private:
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
  double cells_per_mm_ = 0;
};

/// A triangle with its place in an order.
struct Place {
  std::uint64_t key;
  int triangle;
};

constexpr int kPlaceBits = 34;
/// Along a curve that fills space, those of boxes of like size together: a large one among small ones would make their box large.
std::uint64_t place_of(const CellBox& box);
/// By the lowest `bits` of the key, places with the same one in the order they had.
void sort_by_key(std::vector<Place>& places, int bits);

/// A tree over the boxes of a mesh's triangles: groups of eight neighbours on the curve, eight groups to a node, and so on.
class BoxesInEights {
public:
  BoxesInEights(const CellGrid& grid, const Mesh& mesh);

  /// The triangles whose boxes meet this one; in an order that depends on the mesh alone.
  void meeting(const CellBox& box, std::vector<int>& found) const;

private:
  std::vector<int> triangles_;
  std::vector<std::vector<EightBoxes>> levels_;  ///< of triangles, of eight of these, ..., of all
};

}  // namespace rayrep
