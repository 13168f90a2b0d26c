#include "mesh/cell_boxes.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace rayrep {
namespace {

constexpr std::int16_t kBit[kEight] = {1, 2, 4, 8, 16, 32, 64, 128};

/// The lowest ten bits of n, two zeros between each.
std::uint32_t spread(std::uint32_t n) {
  n = (n | n << 16) & 0x030000FF;
  n = (n | n << 8) & 0x0300F00F;
  n = (n | n << 4) & 0x030C30C3;
  return (n | n << 2) & 0x09249249;
}

}  // namespace

void CellBox::extend(const CellBox& other) {
  for (int axis = 0; axis < 3; ++axis) {
    low[axis] = std::min(low[axis], other.low[axis]);
    high[axis] = std::max(high[axis], other.high[axis]);
  }
}

int CellBox::longest_side() const { return std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]}); }

CellBox intersection(const CellBox& a, const CellBox& b) {
  CellBox box;
  for (int axis = 0; axis < 3; ++axis) {
    box.low[axis] = std::max(a.low[axis], b.low[axis]);
    box.high[axis] = std::min(a.high[axis], b.high[axis]);
  }
  return box;
}

EightBoxes::EightBoxes() {
  std::fill_n(&low[0][0], 3 * kEight, INT16_MAX);
  std::fill_n(&high[0][0], 3 * kEight, INT16_MIN);
}

void EightBoxes::set(std::size_t k, const CellBox& box) {
  for (int axis = 0; axis < 3; ++axis) {
    low[axis][k] = box.low[axis];
    high[axis][k] = box.high[axis];
  }
}

/// Not inlined: GCC would unroll the loop before it looks for vector instructions.
[[gnu::noinline]] std::uint32_t meeting(const EightBoxes& boxes, const CellBox& box) {
  const std::int16_t x0 = box.low[0], y0 = box.low[1], z0 = box.low[2];
  const std::int16_t x1 = box.high[0], y1 = box.high[1], z1 = box.high[2];
  std::int16_t bits = 0;
  for (std::size_t k = 0; k < kEight; ++k) {
    const bool apart = (boxes.low[0][k] > x1) | (boxes.low[1][k] > y1) | (boxes.low[2][k] > z1) | (boxes.high[0][k] < x0) |
                       (boxes.high[1][k] < y0) | (boxes.high[2][k] < z0);
    bits |= apart ? std::int16_t{0} : kBit[k];
  }
  return static_cast<std::uint32_t>(bits);
}

CellGrid::CellGrid(const Mesh& mesh) {
  const Eigen::AlignedBox3d box = bounding_box(mesh);
  if (box.isEmpty()) return;
  origin_ = box.min();
  const double longest = box.sizes().maxCoeff();
  cells_per_mm_ = longest > 0 ? 65000 / longest : 0;
}

std::vector<CellBox> CellGrid::boxes_of_triangles(const Mesh& mesh) const {
  using Cell = std::array<std::int16_t, 3>;
  std::vector<Cell> cells(mesh.vertices.size());
  tbb::parallel_for(std::size_t{0}, cells.size(), [&](std::size_t v) {
    for (int axis = 0; axis < 3; ++axis)
      cells[v][axis] =
          static_cast<std::int16_t>(static_cast<int>(cells_per_mm_ * (mesh.vertices[v][axis] - origin_[axis])) - 32500);
  });
  std::vector<CellBox> boxes(mesh.triangles.size());
  tbb::parallel_for(std::size_t{0}, boxes.size(), [&](std::size_t t) {
    for (int axis = 0; axis < 3; ++axis) {
      const auto [low, high] =
          std::minmax({cells[mesh.triangles[t][0]][axis], cells[mesh.triangles[t][1]][axis], cells[mesh.triangles[t][2]][axis]});
      boxes[t].low[axis] = static_cast<std::int16_t>(low - 1);
      boxes[t].high[axis] = static_cast<std::int16_t>(high + 1);
    }
  });
  return boxes;
}

CellBox CellGrid::around(const Eigen::AlignedBox3d& box) const {
  CellBox cells;
  // What is beyond all numbers still does not meet boxes as made.
  const auto cell = [](double at) { return static_cast<std::int16_t>(std::clamp(at - 32500, -32767.0, 32766.0)); };
  for (int axis = 0; axis < 3; ++axis) {
    cells.low[axis] = cell(std::floor(cells_per_mm_ * (box.min()[axis] - origin_[axis])) - 1);
    cells.high[axis] = cell(std::floor(cells_per_mm_ * (box.max()[axis] - origin_[axis])) + 1);
  }
  return cells;
}

std::uint64_t place_of(const CellBox& box) {
  constexpr int kBits = 10;  // of a coordinate on the curve
  std::uint64_t place = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto twice_middle = static_cast<std::uint32_t>(box.low[axis] + box.high[axis] + 65536);
    place |= static_cast<std::uint64_t>(spread(twice_middle >> (17 - kBits))) << axis;
  }
  const auto size = static_cast<std::uint64_t>(std::bit_width(static_cast<unsigned>(box.longest_side())) / 2);
  return size << 3 * kBits | place;
}

void sort_by_key(std::vector<Place>& places, int bits) {
  constexpr int kDigit = 11;
  std::vector<Place> sorted(places.size());
  for (int shift = 0; shift < bits; shift += kDigit) {
    const auto digit = [shift](const Place& place) { return place.key >> shift & ((1u << kDigit) - 1); };
    std::vector<std::size_t> next((1u << kDigit) + 1);
    for (const Place& place : places) ++next[digit(place) + 1];
    for (std::size_t n = 1; n < next.size(); ++n) next[n] += next[n - 1];
    for (const Place& place : places) sorted[next[digit(place)]++] = place;
    places.swap(sorted);
  }
}

BoxesInEights::BoxesInEights(const CellGrid& grid, const Mesh& mesh) {
  std::vector<CellBox> boxes = grid.boxes_of_triangles(mesh);
  std::vector<Place> places(boxes.size());
  tbb::parallel_for(std::size_t{0}, boxes.size(), [&](std::size_t t) { places[t] = {place_of(boxes[t]), static_cast<int>(t)}; });
  sort_by_key(places, kPlaceBits);
  std::vector<CellBox> whole;
  for (const Place& place : places) {
    triangles_.push_back(place.triangle);
    whole.push_back(boxes[static_cast<std::size_t>(place.triangle)]);
  }
  do {
    std::vector<EightBoxes>& level = levels_.emplace_back((whole.size() + kEight - 1) / kEight);
    std::vector<CellBox> next(level.size());
    for (std::size_t n = 0; n < whole.size(); ++n) {
      level[n / kEight].set(n % kEight, whole[n]);
      next[n / kEight].extend(whole[n]);
    }
    whole = std::move(next);
  } while (whole.size() > 1);
}

void BoxesInEights::meeting(const CellBox& box, std::vector<int>& found) const {
  found.clear();
  if (triangles_.empty()) return;
  struct Node {
    std::size_t level, index;
  };
  std::array<Node, kEight * 24> stack;  // eight nodes a level, and more levels than can be
  std::size_t size = 0;
  stack[size++] = {levels_.size() - 1, 0};
  while (size > 0) {
    const Node node = stack[--size];
    for (std::uint32_t bits = rayrep::meeting(levels_[node.level][node.index], box); bits != 0; bits &= bits - 1) {
      const std::size_t below = node.index * kEight + static_cast<std::size_t>(std::countr_zero(bits));
      if (node.level == 0)
        found.push_back(triangles_[below]);
      else
        stack[size++] = {node.level - 1, below};
    }
  }
}

}  // namespace rayrep
