#include "io/layer_scan.h"

#include <algorithm>
#include <cstring>
#include <utility>

namespace rayrep::detail {
namespace {

constexpr int kExposed = -1;  // no spot
constexpr int kOutside = 0;
constexpr std::uint8_t kHalf = 128;

bool is_blank(std::span<const std::uint8_t> row) {
  return row.empty() || (row[0] == 0 && std::memcmp(row.data(), row.data() + 1, row.size() - 1) == 0);
}

}  // namespace

LayerScan::LayerScan(std::size_t width, const std::array<double, 256>& coverage)
    : coverage_(coverage), width_(width), most_(width), spot_(width + 2, kOutside), pending_(width + 2), spots_{{kOutside}} {}

void LayerScan::add(std::span<const std::uint8_t> row) {
  std::size_t first = 0;
  std::size_t last = 0;
  if (!is_blank(row)) {
    last = width_;
    while (row[first] == 0) ++first;
    while (row[last - 1] == 0) --last;
    add_exposed(row, first, last);
  }
  if (first < last || first_ < last_) follow_spots(row, first, last);
  ++row_;
}

void LayerScan::add_exposed(std::span<const std::uint8_t> row, std::size_t first, std::size_t last) {
  double s0 = 0;
  double s1 = 0;
  double s2 = 0;
  std::uint8_t most = 0;
  for (std::size_t u = first; u < last;) {
    const std::uint8_t value = row[u];
    std::size_t end = u + 1;
    while (end < last && row[end] == value) ++end;
    if (value > 0) {
      const auto a = static_cast<double>(u);
      const auto b = static_cast<double>(end);
      s0 += coverage_[value] * (b - a);
      s1 += coverage_[value] * (b * b - a * a) / 2;
      s2 += coverage_[value] * (b * b * b - a * a * a) / 3;
      most = std::max(most, value);
      for (std::size_t k = u; k < end; ++k) most_[k] = std::max(most_[k], value);
    }
    u = end;
  }
  const auto top = static_cast<double>(row_);
  const double v = top + 0.5;
  if (sums_.area == 0) sums_.box.min().y() = top + 1 - coverage_[most];
  sums_.box.max().y() = top + coverage_[most];
  sums_.area += s0;
  sums_.first += Eigen::Vector2d(s1, s0 * v);
  sums_.second(0, 0) += s2;
  sums_.second(0, 1) += s1 * v;
  sums_.second(1, 1) += s0 * (v * v + 1.0 / 12);
}

void LayerScan::follow_spots(std::span<const std::uint8_t> row, std::size_t first, std::size_t last) {
  const std::size_t from = first_ == last_ ? first : first == last ? first_ : std::min(first, first_);
  const std::size_t to = std::max(last, last_);
  // One column more, in which a spot that ends the row meets the outside.
  for (std::size_t u = from; u <= to; ++u) {
    const std::uint8_t value = u < width_ ? row[u] : std::uint8_t{0};
    const double open = 1 - coverage_[value];
    const int left = spot_[u];
    int& here = spot_[u + 1];  // as yet of the pixel above
    double& pending = pending_[u + 1];
    if (value >= kHalf) {
      const int known = left != kExposed ? left : here;
      pending = known == kExposed ? open : 0;
      if (known != kExposed) add_to_spot(known, open, u, row_);
      here = kExposed;
      continue;
    }
    const int above = here;
    if (above != kExposed && left != kExposed)
      here = united(above, left);
    else if (left != kExposed)
      here = left;
    else if (above == kExposed) {
      here = static_cast<int>(spots_.size());
      spots_.push_back({here});
    }
    add_to_spot(here, open, u, row_);
    if (left == kExposed) add_to_spot(here, std::exchange(pending_[u], 0), u - 1, row_);
    if (above == kExposed) add_to_spot(here, pending, u, row_ - 1);
    pending = 0;
  }
  // What lies beyond the row's own pixels has met the outside.
  const auto forget = [this](std::size_t begin, std::size_t end) {
    std::fill(spot_.begin() + static_cast<std::ptrdiff_t>(begin) + 1, spot_.begin() + static_cast<std::ptrdiff_t>(end) + 1,
              kOutside);
  };
  if (first == last) {
    forget(from, std::min(to + 1, width_ + 1));
  } else {
    forget(from, first);
    forget(last, std::min(to + 1, width_ + 1));
  }
  first_ = first;
  last_ = last;
  // Without end a pattern of dots would take as much memory as it has pixels.
  if (spots_.size() > 4 * width_ + 64) drop_closed_spots();
}

int LayerScan::root(int spot) {
  while (spots_[spot].parent != spot) spot = spots_[spot].parent = spots_[spots_[spot].parent].parent;
  return spot;
}

int LayerScan::united(int a, int b) {
  a = root(a);
  b = root(b);
  if (a == b) return a;
  if (b < a) std::swap(a, b);
  spots_[b].parent = a;
  spots_[a].area += spots_[b].area;
  spots_[a].first += spots_[b].first;
  return a;
}

void LayerScan::add_to_spot(int spot, double area, std::size_t column, std::size_t row) {
  spot = root(spot);
  if (spot == kOutside) return;
  Spot& to = spots_[spot];
  to.area += area;
  to.first += area * Eigen::Vector2d(static_cast<double>(column) + 0.5, static_cast<double>(row) + 0.5);
}

/// Those that the row before does not reach any more are holes.
void LayerScan::drop_closed_spots() {
  std::vector<int> renamed(spots_.size(), kExposed);
  renamed[kOutside] = kOutside;
  std::vector<Spot> open = {{kOutside}};
  for (std::size_t u = first_; u < last_; ++u) {
    int& spot = spot_[u + 1];
    if (spot == kExposed) continue;
    int& name = renamed[root(spot)];
    if (name == kExposed) {
      name = static_cast<int>(open.size());
      open.push_back(spots_[root(spot)]);
      open.back().parent = name;
    }
    spot = name;
  }
  for (std::size_t n = 1; n < spots_.size(); ++n) {
    if (spots_[n].parent != static_cast<int>(n) || renamed[n] != kExposed) continue;
    sums_.outline_area += spots_[n].area;
    sums_.outline_first += spots_[n].first;
  }
  spots_ = std::move(open);
}

LayerSums LayerScan::finish() {
  if (first_ < last_) follow_spots(std::vector<std::uint8_t>(width_), 0, 0);
  drop_closed_spots();
  LayerSums& sums = sums_;
  sums.second(1, 0) = sums.second(0, 1);
  sums.outline_area += sums.area;
  sums.outline_first += sums.first;
  if (sums.area > 0) {
    const auto exposed = [](std::uint8_t value) { return value > 0; };
    const auto left = std::find_if(most_.begin(), most_.end(), exposed);
    const auto right = std::find_if(most_.rbegin(), most_.rend(), exposed);
    sums.box.min().x() = static_cast<double>(left - most_.begin()) + 1 - coverage_[*left];
    sums.box.max().x() = static_cast<double>(most_.rend() - right) - 1 + coverage_[*right];
  }
  return sums;
}

}  // namespace rayrep::detail
