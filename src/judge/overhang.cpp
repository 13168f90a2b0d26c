#include "judge/overhang.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <queue>
#include <vector>

#include "base/rotation.h"
#include "base/union_find.h"
#include "judge/figures.h"
#include "rayrep/mesh/section.h"
#include "rayrep/physics/moments.h"

namespace rayrep::verify_detail {
namespace {

using Loops = std::vector<SectionLoop>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A point of a layer: how far from the outline of the void, and whether in the void.
struct InLayer {
  double distance_mm = kInfinity;
  bool is_void = false;
};

/// The outline of the void in a layer, in cells of a grid.
class Outline {
public:
  explicit Outline(Loops loops) : loops_(std::move(loops)) {
    std::size_t count = 0;
    for (const SectionLoop& loop : loops_) {
      count += loop.size();
      for (const Eigen::Vector2d& p : loop) box_.extend(p);
    }
    if (box_.isEmpty()) return;
    cell_mm_ = std::max(box_.sizes().maxCoeff() / std::clamp(std::sqrt(static_cast<double>(count)), 1.0, 256.0), 1e-9);
    size_ = cell_of(box_.max()).array() + 1;
    cells_.resize(static_cast<std::size_t>(size_.prod()));
    rows_.resize(static_cast<std::size_t>(size_.y()));
    for (const SectionLoop& loop : loops_)
      for (std::size_t i = 0, j = loop.size() - 1; i < loop.size(); j = i++) add({loop[i], loop[j]});
  }

  const Loops& loops() const { return loops_; }
  const Eigen::AlignedBox2d& box() const { return box_; }

  InLayer at(const Eigen::Vector2d& p) const {
    InLayer found;
    if (box_.isEmpty()) return found;
    const Eigen::Vector2i centre = cell_of(p);
    if (centre.y() >= 0 && centre.y() < size_.y())
      for (const Side& side : rows_[static_cast<std::size_t>(centre.y())]) found.is_void ^= side.crosses_right_of(p);
    double squared = kInfinity;
    // Rings of cells, from the first one that meets the grid until none can hold a nearer side.
    const int far = std::max({centre.x(), centre.y(), size_.x() - 1 - centre.x(), size_.y() - 1 - centre.y()});
    const int near = std::max({0, -centre.x(), -centre.y(), centre.x() - size_.x() + 1, centre.y() - size_.y() + 1});
    for (int ring = near; ring <= far && std::max(0, ring - 1) * cell_mm_ <= std::sqrt(squared); ++ring)
      squared = std::min(squared, nearest_in_ring(p, centre, ring));
    found.distance_mm = std::sqrt(squared);
    return found;
  }

private:
  struct Side {
    Eigen::Vector2d a, b;
    double squared_distance(const Eigen::Vector2d& p) const {
      const Eigen::Vector2d along = b - a;
      const double length = along.squaredNorm();
      const double part = length > 0 ? std::clamp((p - a).dot(along) / length, 0.0, 1.0) : 0.0;
      return (p - a - part * along).squaredNorm();
    }
    bool crosses_right_of(const Eigen::Vector2d& p) const {
      return (a.y() > p.y()) != (b.y() > p.y()) && p.x() < (b.x() - a.x()) * (p.y() - a.y()) / (b.y() - a.y()) + a.x();
    }
  };

  Eigen::Vector2i cell_of(const Eigen::Vector2d& p) const { return ((p - box_.min()) / cell_mm_).array().floor().cast<int>(); }

  void add(const Side& side) {
    const Eigen::Vector2i low = cell_of(side.a.cwiseMin(side.b));
    const Eigen::Vector2i high = cell_of(side.a.cwiseMax(side.b));
    for (int j = low.y(); j <= high.y(); ++j) {
      rows_[static_cast<std::size_t>(j)].push_back(side);
      for (int i = low.x(); i <= high.x(); ++i) cells_[static_cast<std::size_t>(j * size_.x() + i)].push_back(side);
    }
  }

  double nearest_in_ring(const Eigen::Vector2d& p, const Eigen::Vector2i& centre, int ring) const {
    double squared = kInfinity;
    for (int j = std::max(0, centre.y() - ring); j <= std::min(size_.y() - 1, centre.y() + ring); ++j) {
      const bool whole = std::abs(j - centre.y()) == ring;
      for (int i = centre.x() - ring; i <= centre.x() + ring; i += whole || ring == 0 ? 1 : 2 * ring)
        if (i >= 0 && i < size_.x())
          for (const Side& side : cells_[static_cast<std::size_t>(j * size_.x() + i)])
            squared = std::min(squared, side.squared_distance(p));
    }
    return squared;
  }

  Loops loops_;
  Eigen::AlignedBox2d box_;
  double cell_mm_ = 1;
  Eigen::Vector2i size_ = Eigen::Vector2i::Zero();
  std::vector<std::vector<Side>> cells_;
  std::vector<std::vector<Side>> rows_;
};

/// How far the upper of two layers reaches out over the void of the lower one, if it is more than `least_mm`: the largest distance
/// of a point of its material from that void's outline. Branch and bound, to 2 % or `close_mm`.
double reach_mm(const Outline& lower, const Outline& upper, double least_mm, double close_mm = 0.02) {
  struct Cell {
    double bound;
    double half;
    Eigen::Vector2d centre;
    bool operator<(const Cell& other) const { return bound < other.bound; }
  };
  const Eigen::AlignedBox2d& box = lower.box();
  if (box.isEmpty()) return 0;
  double best = least_mm;
  const auto enough = [&best, close_mm] { return std::max(1.02 * best, best + close_mm); };
  std::priority_queue<Cell> queue;
  const auto visit = [&](const Eigen::Vector2d& centre, double half) {
    const double radius = std::numbers::sqrt2 * half;
    const InLayer below = lower.at(centre);
    const double far = below.is_void ? below.distance_mm : -below.distance_mm;
    if (far + radius <= enough()) return;
    const InLayer here = upper.at(centre);
    if (here.is_void && here.distance_mm > radius) return;  // open all around
    if (!here.is_void) best = std::max(best, far);
    queue.push({far + radius, half, centre});
  };
  visit(box.center(), 0.5 * box.sizes().maxCoeff());
  while (!queue.empty()) {
    const Cell cell = queue.top();
    queue.pop();
    if (cell.bound <= enough()) break;
    const double half = 0.5 * cell.half;
    for (const double x : {-half, half})
      for (const double y : {-half, half}) visit(cell.centre + Eigen::Vector2d(x, y), half);
  }
  return best;
}

/// Whether some corner of another loop lies in this one.
bool any_in(const SectionLoop& loop, const SectionLoop& other) {
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& p : loop) box.extend(p);
  return std::any_of(other.begin(), other.end(), [&](const Eigen::Vector2d& p) { return box.contains(p) && contains(loop, p); });
}

double side_of(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& p) {
  return (b.x() - a.x()) * (p.y() - a.y()) - (b.y() - a.y()) * (p.x() - a.x());
}

/// Whether two loops cross: rods that are turned a little against themselves have no corner in one another.
bool cross(const SectionLoop& one, const SectionLoop& other) {
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& p : one) box.extend(p);
  for (std::size_t i = 0, j = other.size() - 1; i < other.size(); j = i++) {
    const Eigen::Vector2d& c = other[j];
    const Eigen::Vector2d& d = other[i];
    if (!box.intersects(Eigen::AlignedBox2d(c.cwiseMin(d), c.cwiseMax(d)))) continue;
    for (std::size_t k = 0, l = one.size() - 1; k < one.size(); l = k++)
      if (side_of(c, d, one[l]) * side_of(c, d, one[k]) < 0 && side_of(one[l], one[k], c) * side_of(one[l], one[k], d) < 0)
        return true;
  }
  return false;
}

/// Whether a piece has nothing but void in another layer.
bool is_alone(const SectionLoop& piece, const Outline& other) {
  return std::none_of(other.loops().begin(), other.loops().end(),
                      [&](const auto& l) { return any_in(piece, l) || cross(piece, l); }) &&
         std::none_of(piece.begin(), piece.end(), [&](const auto& p) { return !other.at(p).is_void; });
}

/// Twice the area over the circumference: of what is long its width.
double width_mm(const SectionLoop& loop) {
  double around_mm = 0;
  for (std::size_t i = 0, j = loop.size() - 1; i < loop.size(); j = i++) around_mm += (loop[i] - loop[j]).norm();
  return around_mm > 0 ? 2 * loop_moments(loop).area_mm2 / around_mm : 0;
}

/// Pieces of a layer's material that lie within its void, but for slivers that no printer sees; what goes around a void is none.
std::vector<const SectionLoop*> pieces_in(const Outline& layer) {
  std::vector<const SectionLoop*> pieces;
  constexpr double kSliver_mm = 0.005;
  for (const SectionLoop& loop : layer.loops())
    if (width_mm(loop) > kSliver_mm) pieces.push_back(&loop);
  return pieces;
}

/// A piece of the upper of two layers.
struct Piece {
  double thick_mm;
  bool hangs;                      ///< there is nothing below it
  std::vector<std::size_t> below;  ///< pieces of the lower layer that it stands on
};

/// What two layers have to do with each other.
struct Between {
  std::vector<Piece> upper;
  std::vector<char> ends;  ///< of each piece of the lower layer: there is nothing above it
};

Between between(const Outline& lower, const Outline& upper) {
  Between found;
  const std::vector<const SectionLoop*> below = pieces_in(lower);
  for (const SectionLoop* piece : pieces_in(upper)) {
    found.upper.push_back({2 * reach_mm(Outline(Loops{*piece}), Outline(Loops{}), 0, 1e-3), is_alone(*piece, lower), {}});
    for (std::size_t n = 0; n < below.size(); ++n)
      if (any_in(*piece, *below[n]) || any_in(*below[n], *piece) || cross(*piece, *below[n])) found.upper.back().below.push_back(n);
  }
  for (const SectionLoop* piece : below) found.ends.push_back(is_alone(*piece, upper));
  return found;
}

/// The least thickness of what stands on something below and has something above, from piece to piece, and is no mere ripple.
std::optional<double> thinnest_pillar_mm(const std::vector<Between>& layers) {
  std::vector<int> first(1, 0);  // number of each layer's first piece
  for (const Between& layer : layers) first.push_back(first.back() + static_cast<int>(layer.upper.size()));
  UnionFind joined(first.back());
  for (std::size_t n = 1; n < layers.size(); ++n)
    for (std::size_t k = 0; k < layers[n].upper.size(); ++k)
      for (const std::size_t below : layers[n].upper[k].below)
        joined.unite(first[n] + static_cast<int>(k), first[n - 1] + static_cast<int>(below));
  std::vector<char> loose(static_cast<std::size_t>(first.back()), 0);
  const auto whole = [&](std::size_t layer, std::size_t k) {
    return static_cast<std::size_t>(joined.root(first[layer] + static_cast<int>(k)));
  };
  for (std::size_t n = 0; n < layers.size(); ++n) {
    for (std::size_t k = 0; k < layers[n].upper.size(); ++k) loose[whole(n, k)] |= static_cast<char>(layers[n].upper[k].hangs);
    for (std::size_t k = 0; k < layers[n].ends.size(); ++k) loose[whole(n - 1, k)] |= layers[n].ends[k];
  }
  // Of a pillar that forks the thickest piece in each layer: beside its ends there are slivers of what it merges with.
  std::vector<double> thinnest(loose.size(), kInfinity);
  std::vector<std::size_t> height(loose.size(), 0);
  for (std::size_t n = 0; n < layers.size(); ++n) {
    std::map<std::size_t, double> here;
    for (std::size_t k = 0; k < layers[n].upper.size(); ++k)
      here[whole(n, k)] = std::max(here[whole(n, k)], layers[n].upper[k].thick_mm);
    for (const auto& [pillar, thick_mm] : here) {
      thinnest[pillar] = std::min(thinnest[pillar], thick_mm);
      ++height[pillar];
    }
  }
  constexpr std::size_t kFewestLayers = 5;
  std::optional<double> least;
  for (std::size_t n = 0; n < loose.size(); ++n)
    if (!loose[n] && height[n] >= kFewestLayers) least = std::min(least.value_or(kInfinity), thinnest[n]);
  return least;
}

/// The layers of a print, by number: the middle of the first one lies half a layer above the bed.
struct Layers {
  double bed_mm;
  double layer_mm;
  double middle_mm(int n) const { return bed_mm + (n + 0.5) * layer_mm; }
  int last_below(double z) const { return static_cast<int>(std::floor((z - bed_mm) / layer_mm - 0.5)); }
};

/// A flat roof's height, lowest and highest.
struct FlatRoof {
  double lo, hi;
};

/// Areas, and the roofs that sag. @param shells  z up
std::vector<FlatRoof> find_roofs(const Mesh& shells, double angle_rad, Overhang& found) {
  // Roofs that are made at just this angle may be off by rounding.
  const double steepest = std::cos(angle_rad) * (1 + 1e-4);
  std::vector<FlatRoof> roofs;
  double area_mm2 = 0;
  for (std::size_t t = 0; t < shells.triangles.size(); ++t) {
    const Eigen::Vector3d& a = shells.corner(t, 0);
    const Eigen::Vector3d& b = shells.corner(t, 1);
    const Eigen::Vector3d& c = shells.corner(t, 2);
    const Eigen::Vector3d twice = (b - a).cross(c - a);
    area_mm2 += 0.5 * twice.norm();
    if (-twice.z() <= steepest * twice.norm()) continue;
    found.roof_mm2 += 0.5 * twice.norm();
    roofs.push_back({std::min({a.z(), b.z(), c.z()}), std::max({a.z(), b.z(), c.z()})});
  }
  found.roof_share = area_mm2 > 0 ? found.roof_mm2 / area_mm2 : 0;
  return roofs;
}

/// For each layer from `first` to `last`: whether a flat roof may lie between it and the next one.
std::vector<char> layers_under(const std::vector<FlatRoof>& roofs, const Layers& layers, int first, int last) {
  std::vector<char> flat(static_cast<std::size_t>(std::max(0, last - first + 1)), 0);
  for (const FlatRoof& roof : roofs)
    for (int n = std::max(first, layers.last_below(roof.lo)); n <= std::min(last, layers.last_below(roof.hi)); ++n)
      flat[static_cast<std::size_t>(n - first)] = 1;
  return flat;
}

}  // namespace

Overhang overhang(const Mesh& cavities, const PrintedUp& print, const Progress& progress) {
  Overhang found;
  Mesh shells = cavities;
  const Eigen::Quaterniond upright = rotation_between(print.direction, Eigen::Vector3d::UnitZ());
  for (Eigen::Vector3d& v : shells.vertices) v = upright * v;
  const std::vector<FlatRoof> roofs = find_roofs(shells, print.angle_rad, found);
  found.sealed_mm3 = -mesh_moments(shells)[M1];
  if (shells.triangles.empty()) return found;

  const Layers layers{print.bed_mm, print.layer_mm};
  const Eigen::AlignedBox3d box = bounding_box(shells);
  const int first = layers.last_below(box.min().z());
  const int last = layers.last_below(box.max().z());
  const std::vector<char> flat = layers_under(roofs, layers, first, last);
  const MeshSections sections(shells);
  std::vector<double> reach(flat.size(), 0);
  std::vector<Between> pieces(flat.size());
  constexpr std::size_t at_once = 32;
  for (std::size_t begin = 0; begin < flat.size(); begin += at_once) {
    progress.check();
    tbb::parallel_for(begin, std::min(begin + at_once, flat.size()), [&](std::size_t n) {
      const int layer = first + static_cast<int>(n);
      const Outline lower(sections.at(layers.middle_mm(layer)));
      const Outline upper(sections.at(layers.middle_mm(layer + 1)));
      pieces[n] = between(lower, upper);
      if (flat[n]) reach[n] = reach_mm(lower, upper, print.layer_mm / std::tan(print.angle_rad));
    });
  }
  for (const Between& layer : pieces)
    found.islands += static_cast<std::size_t>(
        std::count_if(layer.upper.begin(), layer.upper.end(), [](const Piece& piece) { return piece.hangs; }));
  found.pillar_mm = thinnest_pillar_mm(pieces);
  found.bridge_mm = 2 * *std::max_element(reach.begin(), reach.end());
  return found;
}

Figures figures_of(const Overhang& overhang, const PrintedUp& print) {
  const Eigen::Vector3d direction = print.direction.normalized();
  const bool begins = overhang.islands > 0;
  Figures figures = {{.name = "print_direction", .words = "", .value = list(direction)},
                     {.name = "roof_angle_rad", .words = "", .unit = Unit::rad, .value = print.angle_rad},
                     {.name = "layer_mm", .words = "", .unit = Unit::mm, .value = print.layer_mm},
                     {.name = "roof_mm2",
                      .words = "cavity roofs flatter than 45 degrees",
                      .unit = Unit::mm2,
                      .value = overhang.roof_mm2,
                      .digits = 1},
                     {.name = "roof_share", .words = "of the cavities' surface", .value = overhang.roof_share},
                     {.name = "widest_bridge_mm",
                      .words = "widest bridge there in one layer",
                      .unit = Unit::mm,
                      .value = overhang.bridge_mm,
                      .digits = 1},
                     {.name = "hanging_islands",
                      .words = begins ? "pieces of them that begin in mid-air" : "",
                      .value = static_cast<double>(overhang.islands),
                      .digits = 0},
                     {.name = "sealed_mm3", .words = "", .unit = Unit::mm3, .value = overhang.sealed_mm3}};
  if (overhang.pillar_mm)
    figures.push_back({.name = "thinnest_pillar_mm",
                       .words = "thinnest pillar in them",
                       .unit = Unit::mm,
                       .value = *overhang.pillar_mm,
                       .digits = 2});
  return figures;
}

}  // namespace rayrep::verify_detail
