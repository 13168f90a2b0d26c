#include "judge/overhang.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <queue>
#include <span>
#include <utility>
#include <vector>

#include "base/rotation.h"
#include "base/union_find.h"
#include "judge/figures.h"
#include "mesh/shells.h"
#include "rayrep/mesh/section.h"
#include "rayrep/mesh/surface_query.h"
#include "rayrep/physics/moments.h"

namespace rayrep::verify_detail {
namespace {

using Loops = std::vector<SectionLoop>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// The outline of what is in a layer, in cells of a grid.
class Outline {
public:
  explicit Outline(const Loops& loops) {
    std::size_t count = 0;
    for (const SectionLoop& loop : loops) {
      count += loop.size();
      for (const Eigen::Vector2d& p : loop) box_.extend(p);
    }
    if (box_.isEmpty()) return;
    cell_mm_ = std::max(box_.sizes().maxCoeff() / std::clamp(std::sqrt(static_cast<double>(count)), 1.0, 256.0), 1e-9);
    size_ = cell_of(box_.max()).array() + 1;
    sides_.reserve(count);
    for (const SectionLoop& loop : loops)
      for (std::size_t i = 0, j = loop.size() - 1; i < loop.size(); j = i++) sides_.push_back({loop[i], loop[j]});
    rows_ = Bins(static_cast<std::size_t>(size_.y()), [this](const auto& put) { put_in_rows(put); });
    cells_ = Bins(static_cast<std::size_t>(size_.prod()), [this](const auto& put) { put_in_cells(put); });
  }

  const Eigen::AlignedBox2d& box() const { return box_; }

  bool contains(const Eigen::Vector2d& p) const {
    if (box_.isEmpty() || !box_.contains(p)) return false;
    bool inside = false;
    for (const int n : rows_.at(cell_of(p).y())) inside ^= sides_[static_cast<std::size_t>(n)].crosses_right_of(p);
    return inside;
  }

  /// How far p is from it; where that is `least_mm` or more, no less than that.
  double distance_mm(const Eigen::Vector2d& p, double least_mm = kInfinity) const {
    if (box_.isEmpty()) return kInfinity;
    const Eigen::Vector2i centre = cell_of(p);
    double squared = kInfinity;
    // Rings of cells, from the first one that meets the grid until none can hold a nearer side.
    const int far = std::max({centre.x(), centre.y(), size_.x() - 1 - centre.x(), size_.y() - 1 - centre.y()});
    const int near = std::max({0, -centre.x(), -centre.y(), centre.x() - size_.x() + 1, centre.y() - size_.y() + 1});
    for (int ring = near; ring <= far && std::max(0, ring - 1) * cell_mm_ < std::min(std::sqrt(squared), least_mm); ++ring)
      squared = std::min(squared, nearest_in_ring(p, centre, ring));
    return std::sqrt(squared);
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

  /// Numbers of sides, by place.
  class Bins {
  public:
    Bins() = default;
    /// @param for_all  calls what it is given with each place and number
    template <typename ForAll>
    Bins(std::size_t places, const ForAll& for_all) : first_(places + 1, 0) {
      for_all([this](int place, int) { ++first_[static_cast<std::size_t>(place) + 1]; });
      std::partial_sum(first_.begin(), first_.end(), first_.begin());
      numbers_.resize(static_cast<std::size_t>(first_.back()));
      std::vector<int> next = first_;
      for_all([&](int place, int number) { numbers_[static_cast<std::size_t>(next[static_cast<std::size_t>(place)]++)] = number; });
    }
    std::span<const int> at(int place) const {
      const auto n = static_cast<std::size_t>(place);
      return {numbers_.data() + first_[n], numbers_.data() + first_[n + 1]};
    }

  private:
    std::vector<int> first_, numbers_;
  };

  template <typename Put>
  void put_in_rows(const Put& put) const {
    for (std::size_t n = 0; n < sides_.size(); ++n) {
      const auto [low, high] = std::minmax({cell_of(sides_[n].a).y(), cell_of(sides_[n].b).y()});
      for (int j = low; j <= high; ++j) put(j, static_cast<int>(n));
    }
  }

  template <typename Put>
  void put_in_cells(const Put& put) const {
    for (std::size_t n = 0; n < sides_.size(); ++n) {
      const Eigen::Vector2i low = cell_of(sides_[n].a.cwiseMin(sides_[n].b));
      const Eigen::Vector2i high = cell_of(sides_[n].a.cwiseMax(sides_[n].b));
      for (int j = low.y(); j <= high.y(); ++j)
        for (int i = low.x(); i <= high.x(); ++i) put(j * size_.x() + i, static_cast<int>(n));
    }
  }

  double nearest_in_ring(const Eigen::Vector2d& p, const Eigen::Vector2i& centre, int ring) const {
    double squared = kInfinity;
    for (int j = std::max(0, centre.y() - ring); j <= std::min(size_.y() - 1, centre.y() + ring); ++j) {
      const bool whole = std::abs(j - centre.y()) == ring;
      for (int i = centre.x() - ring; i <= centre.x() + ring; i += whole || ring == 0 ? 1 : 2 * ring)
        if (i >= 0 && i < size_.x())
          for (const int n : cells_.at(j * size_.x() + i))
            squared = std::min(squared, sides_[static_cast<std::size_t>(n)].squared_distance(p));
    }
    return squared;
  }

  Eigen::AlignedBox2d box_;
  double cell_mm_ = 1;
  Eigen::Vector2i size_ = Eigen::Vector2i::Zero();
  std::vector<Side> sides_;
  Bins cells_, rows_;
};

/// A layer: its rooms and its material. Where all rooms are closed, what is in none is material as far as it matters.
class LayerShape {
public:
  explicit LayerShape(const Loops& rooms, const Loops* material = nullptr) : rooms_(rooms) {
    if (material) material_.emplace(*material);
  }

  /// In which rooms lie; empty also where there is no material by which anything could be held.
  Eigen::AlignedBox2d box() const { return material_ && material_->box().isEmpty() ? Eigen::AlignedBox2d() : rooms_.box(); }
  bool is_room(const Eigen::Vector2d& p) const { return rooms_.contains(p); }
  bool is_material(const Eigen::Vector2d& p) const { return material_ ? material_->contains(p) : !rooms_.contains(p); }
  /// How far p is from the boundary of the material; where that is `least_mm` or more, no less than that.
  double distance_mm(const Eigen::Vector2d& p, double least_mm = kInfinity) const {
    return (material_ ? *material_ : rooms_).distance_mm(p, least_mm);
  }
  /// Whether no room is as near as that. Closed rooms are as near as the boundary of the material.
  bool clear_of_rooms(const Eigen::Vector2d& p, double radius_mm) const {
    return material_ && !rooms_.contains(p) && rooms_.distance_mm(p, radius_mm) >= radius_mm;
  }

private:
  Outline rooms_;
  std::optional<Outline> material_;
};

/// Two layers, of which the upper one reaches out over rooms of the lower one: by the largest distance of a point of its material
/// from the lower one's.
class OverVoid {
public:
  OverVoid(LayerShape lower, LayerShape upper) : lower_(std::move(lower)), upper_(std::move(upper)) {}

  /// At the farthest of these points.
  double reach_mm_at(const std::vector<Eigen::Vector2d>& points) const {
    double reach = 0;
    if (lower_.box().isEmpty()) return reach;
    for (const Eigen::Vector2d& p : points)
      if (lower_.is_room(p) && upper_.is_material(p)) reach = std::max(reach, lower_.distance_mm(p));
    return reach;
  }

  /// Everywhere, if it is more than `least_mm`. Branch and bound, to 2 % or `close_mm`, of what is not narrower than that: along a
  /// boundary of both layers with nothing of the upper one over a room there would be squares to look at without an end.
  double reach_mm(double least_mm, double close_mm) const {
    const Eigen::AlignedBox2d box = lower_.box();
    if (box.isEmpty()) return 0;
    Search search{least_mm, close_mm, {}};
    visit(search, box.center(), 0.5 * box.sizes().maxCoeff());
    while (!search.queue.empty()) {
      const Cell cell = search.queue.top();
      search.queue.pop();
      if (cell.bound <= search.enough()) break;
      const double half = 0.5 * cell.half;
      for (const double x : {-half, half})
        for (const double y : {-half, half}) visit(search, cell.centre + Eigen::Vector2d(x, y), half);
    }
    return search.best;
  }

private:
  struct Cell {
    double bound;
    double half;
    Eigen::Vector2d centre;
    bool operator<(const Cell& other) const { return bound < other.bound; }
  };
  struct Search {
    double best;
    double close_mm;
    std::priority_queue<Cell> queue;
    double enough() const { return std::max(1.02 * best, best + close_mm); }
  };

  void visit(Search& search, const Eigen::Vector2d& centre, double half) const {
    const double radius = std::numbers::sqrt2 * half;
    const bool held = lower_.is_material(centre);
    const double within = radius - search.enough();
    if (held && lower_.distance_mm(centre, within) >= within) return;
    const bool is_open = !upper_.is_material(centre);
    if (is_open && upper_.distance_mm(centre, radius) >= radius) return;
    if (lower_.clear_of_rooms(centre, radius)) return;
    const double far = (held ? -1 : 1) * lower_.distance_mm(centre);
    if (!is_open && lower_.is_room(centre)) search.best = std::max(search.best, far);
    if (radius > search.close_mm && far + radius > search.enough()) search.queue.push({far + radius, half, centre});
  }

  LayerShape lower_, upper_;
};

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

/// The outline of a layer, made once it is asked for.
class LazyOutline {
public:
  explicit LazyOutline(const Loops& loops) : loops_(loops) {}

  const Loops& loops() const { return loops_; }

  bool contains(const Eigen::Vector2d& p) {
    if (!outline_) outline_.emplace(loops_);
    return outline_->contains(p);
  }

private:
  const Loops& loops_;
  std::optional<Outline> outline_;
};

/// Whether none of these loops reaches into a piece.
bool is_clear_of(const SectionLoop& piece, const Loops& loops) {
  return std::none_of(loops.begin(), loops.end(), [&](const auto& l) { return any_in(piece, l) || cross(piece, l); });
}

/// Whether a piece has nothing but void in another layer.
bool is_alone(const SectionLoop& piece, LazyOutline& other) {
  return is_clear_of(piece, other.loops()) &&
         std::all_of(piece.begin(), piece.end(), [&](const auto& p) { return other.contains(p); });
}

/// Twice the area over the circumference: of what is long its width.
double width_mm(const SectionLoop& loop) {
  double around_mm = 0;
  for (std::size_t i = 0, j = loop.size() - 1; i < loop.size(); j = i++) around_mm += (loop[i] - loop[j]).norm();
  return around_mm > 0 ? 2 * loop_moments(loop).area_mm2 / around_mm : 0;
}

/// Pieces of a layer's material that lie within its void, but for slivers that no printer sees; what goes around a void is none.
std::vector<const SectionLoop*> pieces_in(const Loops& layer) {
  std::vector<const SectionLoop*> pieces;
  constexpr double kSliver_mm = 0.005;
  for (const SectionLoop& loop : layer)
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

double widest_circle_mm(const SectionLoop& piece) {
  return 2 * OverVoid(LayerShape({piece}), LayerShape(Loops())).reach_mm(0, 1e-3);
}

Between between(const Loops& lower, const Loops& upper) {
  Between found;
  LazyOutline all_below(lower), all_above(upper);
  const std::vector<const SectionLoop*> below = pieces_in(lower);
  for (const SectionLoop* piece : pieces_in(upper)) {
    found.upper.push_back({widest_circle_mm(*piece), is_alone(*piece, all_below), {}});
    for (std::size_t n = 0; n < below.size(); ++n)
      if (any_in(*piece, *below[n]) || any_in(*below[n], *piece) || cross(*piece, *below[n])) found.upper.back().below.push_back(n);
  }
  for (const SectionLoop* piece : below) found.ends.push_back(is_alone(*piece, all_above));
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

Layers layers_up_to(double highest_mm, const PrintedUp& print) {
  return {print.bed_mm, std::max(print.layer_mm, (highest_mm - print.bed_mm) / PrintedUp::kMostLayers)};
}

/// A flat roof: lowest and highest.
struct FlatRoof {
  double lo, hi;
  double area_mm2;
  Eigen::Vector3d middle;
};

/// Areas, and the roofs that sag. @param shells  z up
std::vector<FlatRoof> find_roofs(const Mesh& shells, double angle_rad, Overhang& found) {
  // Roofs that are made at just this angle may be off by rounding.
  const double steepest = std::cos(angle_rad) * (1 + 1e-4);
  std::vector<FlatRoof> roofs;
  for (std::size_t t = 0; t < shells.triangles.size(); ++t) {
    const Eigen::Vector3d& a = shells.corner(t, 0);
    const Eigen::Vector3d& b = shells.corner(t, 1);
    const Eigen::Vector3d& c = shells.corner(t, 2);
    const Eigen::Vector3d twice = (b - a).cross(c - a);
    found.surface_mm2 += 0.5 * twice.norm();
    if (-twice.z() <= steepest * twice.norm()) continue;
    found.roof_mm2 += 0.5 * twice.norm();
    roofs.push_back({std::min({a.z(), b.z(), c.z()}), std::max({a.z(), b.z(), c.z()}), 0.5 * twice.norm(), (a + b + c) / 3});
  }
  return roofs;
}

/// A layer between which and the next one flat roofs may lie.
struct FlatLayer {
  std::size_t place = 0;  ///< among the layers
  double roofs_mm2 = 0;
  std::vector<Eigen::Vector2d> points;  ///< of these roofs
};

/// Those from `first` to `last`, with the most roofs first: they bridge most, and what bridges less is quickly passed over then.
std::vector<FlatLayer> layers_under(const std::vector<FlatRoof>& roofs, const Layers& layers, int first, int last) {
  std::vector<FlatLayer> all(static_cast<std::size_t>(std::max(0, last - first + 1)));
  for (const FlatRoof& roof : roofs)
    for (int n = std::max(first, layers.last_below(roof.lo)); n <= std::min(last, layers.last_below(roof.hi)); ++n) {
      const auto place = static_cast<std::size_t>(n - first);
      FlatLayer& layer = all[place];
      layer.place = place;
      layer.roofs_mm2 += roof.area_mm2;
      if (n == layers.last_below(roof.middle.z())) layer.points.emplace_back(roof.middle.head<2>());
    }
  std::erase_if(all, [](const FlatLayer& layer) { return layer.roofs_mm2 == 0; });
  std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.roofs_mm2 > b.roofs_mm2; });
  return all;
}

/// The middle of each layer from `first` to `last`.
std::vector<Loops> sections_of(const Mesh& shells, const Layers& layers, int first, int last, const Progress& progress) {
  constexpr int at_once = 32;
  const MeshSections sections(shells);
  std::vector<Loops> loops(static_cast<std::size_t>(std::max(0, last + 1 - first)));
  for (int begin = first; begin <= last; begin += at_once) {
    progress.check();
    tbb::parallel_for(begin, std::min(begin + at_once, last + 1),
                      [&](int n) { loops[static_cast<std::size_t>(n - first)] = sections.at(layers.middle_mm(n)); });
  }
  return loops;
}

/// What each of these layers but the last has to do with the next one.
std::vector<Between> pieces_of(const std::vector<Loops>& loops, const Progress& progress) {
  constexpr std::size_t at_once = 32;
  std::vector<Between> pieces(loops.size() - 1);
  for (std::size_t begin = 0; begin < pieces.size(); begin += at_once) {
    progress.check();
    tbb::parallel_for(begin, std::min(begin + at_once, pieces.size()),
                      [&](std::size_t n) { pieces[n] = between(loops[n], loops[n + 1]); });
  }
  return pieces;
}

/// Layers one upon the other; `material` is empty where all rooms are closed.
struct Stack {
  std::vector<Loops> rooms;
  std::vector<Loops> material;
  double layer_mm;
  LayerShape shape(std::size_t n) const { return LayerShape(rooms[n], material.empty() ? nullptr : &material[n]); }
};

/// The largest reach_mm of these layers and the next ones.
double farthest_reach_mm(const Stack& stack, const std::vector<FlatLayer>& under, double least_mm, const Progress& progress) {
  constexpr std::size_t at_once = 32;
  std::vector<std::optional<OverVoid>> pairs(at_once);
  std::vector<double> reach(at_once, 0);
  double best = under.empty() ? 0 : least_mm;
  for (std::size_t begin = 0; begin < under.size(); begin += at_once) {
    progress.check();
    const std::size_t count = std::min(at_once, under.size() - begin);
    const auto for_all = [&](const auto& reach_of) {
      tbb::parallel_for(std::size_t{0}, count, [&](std::size_t n) { reach[n] = reach_of(under[begin + n], pairs[n]); });
      best = std::max(best, *std::max_element(reach.begin(), reach.begin() + static_cast<std::ptrdiff_t>(count)));
    };
    for_all([&](const FlatLayer& layer, std::optional<OverVoid>& pair) {
      pair.emplace(stack.shape(layer.place), stack.shape(layer.place + 1));
      return pair->reach_mm_at(layer.points);
    });
    for_all([&](const FlatLayer&, const std::optional<OverVoid>& pair) { return pair->reach_mm(best, stack.layer_mm / 10); });
  }
  return best;
}

/// Half the widest bridge under these roofs.
double bridged_mm(const Stack& stack, const std::vector<FlatLayer>& under, const PrintedUp& print, const Progress& progress) {
  return farthest_reach_mm(stack, under, stack.layer_mm / std::tan(print.angle_rad), progress);
}

/// Pieces of a layer's material that lie over rooms alone.
std::size_t hanging_over_rooms(const Loops& rooms, const Loops& material, const Loops& above) {
  LazyOutline room(rooms), held(material);
  const std::vector<const SectionLoop*> pieces = pieces_in(above);
  return static_cast<std::size_t>(std::count_if(pieces.begin(), pieces.end(), [&](const SectionLoop* piece) {
    return std::any_of(piece->begin(), piece->end(), [&](const auto& p) { return room.contains(p); }) &&
           std::none_of(piece->begin(), piece->end(), [&](const auto& p) { return held.contains(p); }) &&
           is_clear_of(*piece, material);
  }));
}

/// Of a surface that is turned with it.
Mesh upright(Mesh mesh, const PrintedUp& print) {
  const Eigen::Quaterniond turn = rotation_between(print.direction, Eigen::Vector3d::UnitZ());
  for (Eigen::Vector3d& v : mesh.vertices) v = turn * v;
  return mesh;
}

/// The triangles of a piece that lie on rooms.
Mesh inside_of(const Mesh& piece, const Mesh& rooms) {
  const double rounding_mm = 1e-6 * bounding_box(piece).diagonal().norm();
  const SurfaceQuery surface(rooms);
  Mesh inside;
  inside.vertices = piece.vertices;
  for (std::size_t t = 0; t < piece.triangles.size(); ++t)
    if (surface.closest((piece.corner(t, 0) + piece.corner(t, 1) + piece.corner(t, 2)) / 3, rounding_mm).triangle >= 0)
      inside.triangles.push_back(piece.triangles[t]);
  return inside;
}

/// Of its triangles, whatever vertices it has.
std::pair<double, double> heights_of(const Mesh& mesh) {
  std::pair<double, double> heights{kInfinity, -kInfinity};
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k) {
      heights.first = std::min(heights.first, mesh.corner(t, k).z());
      heights.second = std::max(heights.second, mesh.corner(t, k).z());
    }
  return heights;
}

/// What its shells that face inward enclose.
double sealed_mm3(const Mesh& mesh) {
  const Components shells = connected_components(mesh);
  double sealed = 0;
  for (const double volume : shell_volumes(mesh, shells.of_triangle, shells.count)) sealed += std::max(0.0, -volume);
  return sealed;
}

}  // namespace

Overhang overhang(const Mesh& cavities, const PrintedUp& print, const Progress& progress) {
  Overhang found;
  const Mesh shells = upright(cavities, print);
  const std::vector<FlatRoof> roofs = find_roofs(shells, print.angle_rad, found);
  found.sealed_mm3 = -mesh_moments(shells)[M1];
  if (shells.triangles.empty()) return found;

  const Eigen::AlignedBox3d box = bounding_box(shells);
  const Layers layers = layers_up_to(box.max().z(), print);
  found.layer_mm = layers.layer_mm;
  const int first = layers.last_below(box.min().z());
  const int last = layers.last_below(box.max().z());
  const Stack stack{sections_of(shells, layers, first, last + 1, progress), {}, layers.layer_mm};
  const std::vector<Between> pieces = pieces_of(stack.rooms, progress);
  for (const Between& layer : pieces)
    found.islands += static_cast<std::size_t>(
        std::count_if(layer.upper.begin(), layer.upper.end(), [](const Piece& piece) { return piece.hangs; }));
  found.pillar_mm = thinnest_pillar_mm(pieces);
  found.bridge_mm = 2 * bridged_mm(stack, layers_under(roofs, layers, first, last), print, progress);
  return found;
}

Overhang overhang_in_piece(const Mesh& piece, const Mesh& rooms, const PrintedUp& print, const Progress& progress) {
  Overhang found;
  found.sealed_mm3 = sealed_mm3(piece);
  if (rooms.triangles.empty()) return found;
  const Mesh standing = upright(piece, print);
  const Mesh voids = upright(rooms, print);
  const Mesh inside = inside_of(standing, voids);
  const std::vector<FlatRoof> roofs = find_roofs(inside, print.angle_rad, found);
  if (inside.triangles.empty()) return found;

  const auto [lowest_mm, highest_mm] = heights_of(inside);
  const Layers layers = layers_up_to(highest_mm, print);
  found.layer_mm = layers.layer_mm;
  const int first = std::max(0, layers.last_below(lowest_mm));  // what is on the bed is held by it
  const int last = layers.last_below(highest_mm);
  if (last < first) return found;
  const Stack stack{sections_of(voids, layers, first, last + 1, progress), sections_of(standing, layers, first, last + 1, progress),
                    layers.layer_mm};
  const auto pairs = stack.rooms.size() - 1;
  std::vector<std::size_t> islands(pairs, 0);
  tbb::parallel_for(std::size_t{0}, pairs, [&](std::size_t n) {
    islands[n] = hanging_over_rooms(stack.rooms[n], stack.material[n], stack.material[n + 1]);
  });
  found.islands = std::accumulate(islands.begin(), islands.end(), std::size_t{0});
  found.bridge_mm = 2 * bridged_mm(stack, layers_under(roofs, layers, first, last), print, progress);
  return found;
}

double Overhang::roof_share() const { return surface_mm2 > 0 ? roof_mm2 / surface_mm2 : 0; }

Overhang& Overhang::operator+=(const Overhang& other) {
  layer_mm = std::max(layer_mm, other.layer_mm);
  surface_mm2 += other.surface_mm2;
  roof_mm2 += other.roof_mm2;
  bridge_mm = std::max(bridge_mm, other.bridge_mm);
  islands += other.islands;
  sealed_mm3 += other.sealed_mm3;
  if (other.pillar_mm) pillar_mm = std::min(pillar_mm.value_or(kInfinity), *other.pillar_mm);
  return *this;
}

Figures roof_figures(const Overhang& overhang, const PrintedUp& print) {
  const bool begins = overhang.islands > 0;
  const bool thick = overhang.layer_mm > print.layer_mm;
  Figures figures = {{.name = "roof_angle_rad", .words = "", .unit = Unit::rad, .value = print.angle_rad},
                     {.name = "layer_mm",
                      .words = thick ? "height of the layers that were looked at" : "",
                      .unit = Unit::mm,
                      .value = std::max(overhang.layer_mm, print.layer_mm),
                      .digits = 2},
                     {.name = "roof_mm2",
                      .words = "cavity roofs flatter than 45 degrees",
                      .unit = Unit::mm2,
                      .value = overhang.roof_mm2,
                      .digits = 1},
                     {.name = "roof_share", .words = "of the cavities' surface", .value = overhang.roof_share()},
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

Figures figures_of(const Overhang& overhang, const PrintedUp& print) {
  Figures figures = {{.name = "print_direction", .words = "", .value = list(Eigen::Vector3d(print.direction.normalized()))}};
  for (Figure& figure : roof_figures(overhang, print)) figures.push_back(std::move(figure));
  return figures;
}

}  // namespace rayrep::verify_detail
