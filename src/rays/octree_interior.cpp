#include "rayrep/rays/octree_interior.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <span>

#include "rayrep/rays/ray_interior.h"

namespace rayrep {
namespace {

constexpr int kMaxLevel = 20;  // three coordinates of 21 bits in a code

/// Bits of a coordinate, moved to every third place.
std::uint64_t spread(std::uint64_t bits) {
  std::uint64_t code = 0;
  for (int b = 0; b <= kMaxLevel; ++b) code |= (bits >> b & 1) << 3 * b;
  return code;
}

std::uint64_t gather(std::uint64_t code) {
  std::uint64_t bits = 0;
  for (int b = 0; b <= kMaxLevel; ++b) bits |= (code >> 3 * b & 1) << b;
  return bits;
}

std::uint64_t cells_of_level(int level) { return std::uint64_t{1} << 3 * level; }

/// Calls visit(ray, interval, code of the column at height 0) for every interval.
template <typename Visit>
void for_each_interval(const RayRep& domain, const Visit& visit) {
  const auto nx = static_cast<std::size_t>(domain.grid.nx);
  for (std::size_t ray = 0; ray < domain.grid.size(); ++ray)
    for (std::uint32_t n = domain.first[ray]; n < domain.first[ray + 1]; ++n)
      visit(ray, domain.intervals[n], spread(ray % nx) | spread(ray / nx) << 1);
}

/// Cells of height `side` that an interval reaches: from .first to below .second.
std::pair<std::uint64_t, std::uint64_t> heights(const Interval& interval, double bottom, double side) {
  return {static_cast<std::uint64_t>((interval.lo - bottom) / side),
          static_cast<std::uint64_t>(std::max(0.0, std::ceil((interval.hi - bottom) / side)))};
}

/// split_and_merge on the leaves[first] ... leaves[last] (exclusive), which are all leaves of the cube at `code`.
class Refiner {
public:
  enum Kind : char { kVoid, kFull, kSplit, kKeep };

  Refiner(const std::vector<OctreeLeaf>& leaves, const std::vector<Kind>& kinds, OctreeInterior::Refinement& result)
      : leaves_(leaves), kinds_(kinds), result_(result) {}

  void refine(std::uint64_t code, int level, std::size_t first, std::size_t last) {
    if (first == last) return;
    if (last - first == 1) return refine_leaf(first);
    const Kind kind = kinds_[first];
    const std::span<const Kind> all(kinds_.data() + first, last - first);
    if ((kind == kVoid || kind == kFull) && std::all_of(all.begin(), all.end(), [kind](Kind k) { return k == kind; })) {
      result_.leaves.push_back({code, level});
      return;
    }
    const std::uint64_t child = cells_of_level(level - 1);
    for (int c = 0; c < 8; ++c, code += child) {
      const std::size_t begin = first;
      while (first < last && leaves_[first].code < code + child) ++first;
      refine(code, level - 1, begin, first);
    }
  }

private:
  void refine_leaf(std::size_t n) {
    const OctreeLeaf& leaf = leaves_[n];
    if (kinds_[n] != kSplit) {
      result_.leaves.push_back(leaf);
      return;
    }
    ++result_.splits;
    const std::uint64_t child = cells_of_level(leaf.level - 1);
    for (std::uint64_t c = 0; c < 8; ++c) result_.leaves.push_back({leaf.code + c * child, leaf.level - 1});
  }

  const std::vector<OctreeLeaf>& leaves_;
  const std::vector<Kind>& kinds_;
  OctreeInterior::Refinement& result_;
};

}  // namespace

std::vector<OctreeLeaf> uniform_leaves(const RayRep& domain, int level) {
  assert(level >= 0 && level <= kMaxLevel);
  const double bottom = lowest_end_mm(domain);
  const std::uint64_t size = cells_of_level(level);
  std::vector<std::uint64_t> codes;
  for_each_interval(domain, [&](std::size_t, const Interval& interval, std::uint64_t column) {
    const auto [first, last] = heights(interval, bottom, std::ldexp(domain.grid.spacing_mm, level));
    for (std::uint64_t k = first; k < last; ++k) codes.push_back((column | spread(k << level) << 2) / size);
  });
  std::sort(codes.begin(), codes.end());
  codes.erase(std::unique(codes.begin(), codes.end()), codes.end());
  std::vector<OctreeLeaf> leaves;
  leaves.reserve(codes.size());
  for (const std::uint64_t code : codes) leaves.push_back({code * size, level});
  return leaves;
}

OctreeInterior::OctreeInterior(const RayRep& domain, const std::vector<OctreeLeaf>& leaves, double laplacian_weight)
    : leaves_(leaves), laplacian_weight_(laplacian_weight) {
  const double bottom = lowest_end_mm(domain);
  const double spacing = domain.grid.spacing_mm;
  moments_ = Eigen::Matrix<double, 10, Eigen::Dynamic>::Zero(10, static_cast<Eigen::Index>(leaves_.size()));
  for_each_interval(domain, [&](std::size_t ray, const Interval& interval, std::uint64_t column) {
    const Eigen::Vector2d xy = domain.grid.at(ray);
    auto [k, last] = heights(interval, bottom, spacing);
    while (k < last) {
      const std::size_t leaf = leaf_with(column | spread(k) << 2);
      assert(leaf < leaves_.size());
      const int level = leaves_[leaf].level;
      const std::uint64_t above = ((k >> level) + 1) << level;
      const double lo = std::max(interval.lo, bottom + static_cast<double>(k >> level << level) * spacing);
      const double hi = std::min(interval.hi, bottom + static_cast<double>(above) * spacing);
      if (lo < hi) moments_.col(static_cast<Eigen::Index>(leaf)) += domain.grid.weighted_area_mm2() * segment_moments(xy, lo, hi);
      k = above;
    }
  });

  std::size_t kept = 0;
  for (std::size_t n = 0; n < leaves_.size(); ++n)
    if (moments_(M1, static_cast<Eigen::Index>(n)) > 0) {
      leaves_[kept] = leaves_[n];
      moments_.col(static_cast<Eigen::Index>(kept++)) = moments_.col(static_cast<Eigen::Index>(n));
    }
  leaves_.resize(kept);
  moments_.conservativeResize(10, static_cast<Eigen::Index>(kept));

  // Each pair is found from the smaller of the two, or from the lower of two equal ones.
  for (std::size_t n = 0; n < leaves_.size(); ++n) {
    const auto [code, level] = leaves_[n];
    const std::array<std::uint64_t, 3> at = {gather(code), gather(code >> 1), gather(code >> 2)};
    const std::uint64_t side = std::uint64_t{1} << level;
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (const bool up : {false, true}) {
        if (!up && at[axis] == 0) continue;
        std::array<std::uint64_t, 3> beside = at;
        beside[axis] = up ? at[axis] + side : at[axis] - side;
        const std::size_t other = leaf_with(spread(beside[0]) | spread(beside[1]) << 1 | spread(beside[2]) << 2);
        if (other == leaves_.size()) continue;
        if (leaves_[other].level > level || (up && leaves_[other].level == level))
          neighbours_.emplace_back(static_cast<int>(n), static_cast<int>(other));
      }
  }
}

/// Place of the leaf that holds a cell; leaves_.size() when none does.
std::size_t OctreeInterior::leaf_with(std::uint64_t code) const {
  const auto after =
      std::upper_bound(leaves_.begin(), leaves_.end(), code, [](std::uint64_t c, const OctreeLeaf& leaf) { return c < leaf.code; });
  if (after == leaves_.begin()) return leaves_.size();
  const auto leaf = after - 1;
  return code - leaf->code < cells_of_level(leaf->level) ? static_cast<std::size_t>(leaf - leaves_.begin()) : leaves_.size();
}

std::vector<Coupling> OctreeInterior::couplings() const {
  std::vector<Coupling> couplings;
  if (laplacian_weight_ > 0)
    for (const auto& [i, j] : neighbours_) couplings.push_back({i, j, laplacian_weight_});
  return couplings;
}

OctreeInterior::Refinement OctreeInterior::split_and_merge(const Eigen::VectorXd& fill, double epsilon,
                                                           bool at_fill_changes) const {
  assert(fill.size() == variables());
  std::vector<char> mixed(leaves_.size());
  for (std::size_t n = 0; n < leaves_.size(); ++n) {
    const double rho = fill[static_cast<Eigen::Index>(n)];
    mixed[n] = rho >= epsilon && rho <= 1 - epsilon;
  }
  if (at_fill_changes)
    for (const auto& [i, j] : neighbours_)
      if ((fill[i] > 0.5) != (fill[j] > 0.5)) mixed[static_cast<std::size_t>(i)] = mixed[static_cast<std::size_t>(j)] = true;

  std::vector<Refiner::Kind> kinds(leaves_.size());
  for (std::size_t n = 0; n < leaves_.size(); ++n) {
    if (mixed[n])
      kinds[n] = leaves_[n].level > 0 ? Refiner::kSplit : Refiner::kKeep;
    else
      kinds[n] = fill[static_cast<Eigen::Index>(n)] > 0.5 ? Refiner::kFull : Refiner::kVoid;
  }
  Refinement result;
  Refiner(leaves_, kinds, result).refine(0, kMaxLevel, 0, leaves_.size());
  return result;
}

}  // namespace rayrep
