#include "rayrep/rays/inner_domain.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>

#include "base/union_find.h"
#include "rays/kept_solid.h"

namespace rayrep {
namespace {

constexpr int kSide = BlockField::kSide;
const double kSqrt3 = std::sqrt(3.0);

/// wall - signed distance of the solid at points of one grid, by closest-point queries. 1-Lipschitz; negative in the inner domain.
class OffsetSampler {
public:
  OffsetSampler(const SurfaceQuery& surface, const RayRep& columns, const BlockField& field, double wall_mm)
      : surface_(surface), columns_(columns), field_(field), wall_(wall_mm) {}

  /// The block (a, b, c): a mark, or its samples in `block`.
  std::int32_t sample_block(int a, int b, int c, BlockField::Block& block) const {
    const Eigen::Vector3i corner = kSide * Eigen::Vector3i(a, b, c);
    const Uniform uniform = descend(corner, kSide, -1, block);
    return uniform == Uniform::inside ? BlockField::kInside : uniform == Uniform::outside ? BlockField::kOutside : 0;
  }

private:
  enum class Uniform { no, inside, outside };

  bool in_solid(int i, int j, double z) const {
    const std::size_t ray = static_cast<std::size_t>(j) * static_cast<std::size_t>(columns_.grid.nx) + static_cast<std::size_t>(i);
    for (std::uint32_t n = columns_.first[ray]; n < columns_.first[ray + 1]; ++n)
      if (z >= columns_.intervals[n].lo && z <= columns_.intervals[n].hi) return true;
    return false;
  }

  /// Decides whether the cube of `size`^3 samples has one sign, with a margin of one step; otherwise writes its samples.
  Uniform descend(const Eigen::Vector3i& corner, int size, int hint, BlockField::Block& block) const {
    const Eigen::Vector3i middle = corner.array() + size / 2;
    const Eigen::Vector3d p = field_.position(middle.x(), middle.y(), middle.z());
    const bool solid = in_solid(middle.x(), middle.y(), p.z());
    // Beyond this far from zero, every sample of the cube and its neighbours have the sign of the middle one.
    const double reach = (kSqrt3 * (size / 2) + 1) * field_.spacing_mm;
    double value = std::numeric_limits<double>::infinity();
    if (solid) {
      const ClosestPoint closest = surface_.closest(p, wall_ + reach, hint);
      value = wall_ - closest.distance_mm;
      hint = closest.triangle;
    } else if (const double kept = surface_.farther().by_mm; reach > wall_ - kept) {
      // No more than the distance of the inner domain, be it the surface or what is kept solid that p lies behind.
      const ClosestPoint closest = surface_.closest(p, reach - wall_ + 2 * kept, hint);
      value = wall_ - kept + std::max(0.0, closest.distance_mm - kept);
      hint = closest.triangle;
    }
    if (value < -reach || value > reach) {
      const Uniform uniform = value < 0 ? Uniform::inside : Uniform::outside;
      if (size < kSide) fill(corner, size, value < 0 ? -field_.far() : field_.far(), block);
      return uniform;
    }
    if (size == 1) {
      block[index(corner)] = static_cast<float>(value);
      return Uniform::no;
    }
    const int half = size / 2;
    for (int n = 0; n < 8; ++n) {
      const Eigen::Vector3i child = corner + half * Eigen::Vector3i(n >> 2, (n >> 1) & 1, n & 1);
      if (size == 2 && n == 7)
        block[index(child)] = static_cast<float>(value);  // the middle sample itself
      else
        descend(child, half, hint, block);
    }
    return Uniform::no;
  }

  static std::size_t index(const Eigen::Vector3i& sample) {
    return static_cast<std::size_t>(BlockField::sample_index(sample.x() % kSide, sample.y() % kSide, sample.z() % kSide));
  }

  static void fill(const Eigen::Vector3i& corner, int size, float value, BlockField::Block& block) {
    for (int i = 0; i < size; ++i)
      for (int j = 0; j < size; ++j)
        for (int k = 0; k < size; ++k) block[index(corner + Eigen::Vector3i(i, j, k))] = value;
  }

  const SurfaceQuery& surface_;
  const RayRep& columns_;
  const BlockField& field_;
  double wall_;
};

/// Of the solid, without what is kept of it.
Eigen::AlignedBox3d box_of(const detail::KeptSolid& solid) {
  const Mesh& mesh = solid.surface.mesh();
  Eigen::AlignedBox3d box;
  for (std::size_t t = 0; t < mesh.triangles.size() && static_cast<int>(t) < solid.kept_from; ++t)
    for (int k = 0; k < 3; ++k) box.extend(mesh.corner(t, k));
  return box;
}

void sample_field(const detail::KeptSolid& solid, const InnerDomainOptions& options, BlockField& field, CastReport& cast,
                  const Progress& progress) {
  const Eigen::AlignedBox3d box = box_of(solid);
  field.spacing_mm = options.field_spacing_mm;
  // Off the box's corner by an irrational fraction: columns avoid the edges of CAD models.
  field.origin_mm = box.min() - field.spacing_mm * Eigen::Vector3d(0.5041421356237309, 0.5073205080756888, 0.5023606797749979);
  for (int k = 0; k < 3; ++k)
    field.blocks[k] = static_cast<int>((box.max()[k] - field.origin_mm[k]) / field.spacing_mm) / kSide + 1;

  RayGrid grid;
  grid.origin_mm = field.origin_mm.head<2>();
  grid.spacing_mm = field.spacing_mm;
  grid.nx = field.blocks.x() * kSide;
  grid.ny = field.blocks.y() * kSide;
  const RayRep columns = detail::cast_rays(solid, grid, &cast, progress);

  const OffsetSampler sampler(solid.surface, columns, field, options.wall_mm);
  field.state.assign(static_cast<std::size_t>(field.blocks.x()) * static_cast<std::size_t>(field.blocks.y()) *
                         static_cast<std::size_t>(field.blocks.z()),
                     BlockField::kOutside);
  const auto stacks = static_cast<std::size_t>(field.blocks.y());
  std::vector<std::vector<BlockField::Block>> found(stacks);
  for (int a = 0; a < field.blocks.x(); ++a) {
    progress.check();
    tbb::parallel_for(std::size_t{0}, stacks, [&](std::size_t b) {
      found[b].clear();
      BlockField::Block block;
      for (int c = 0; c < field.blocks.z(); ++c) {
        const std::int32_t state = sampler.sample_block(a, static_cast<int>(b), c, block);
        field.state[field.block_index(a, static_cast<int>(b), c)] = state;
        if (state >= 0) found[b].push_back(block);
      }
    });
    for (std::size_t b = 0; b < stacks; ++b) {
      std::size_t next = 0;
      for (int c = 0; c < field.blocks.z(); ++c) {
        std::int32_t& state = field.state[field.block_index(a, static_cast<int>(b), c)];
        if (state < 0) continue;
        state = static_cast<std::int32_t>(field.samples.size());
        field.samples.push_back(found[b][next++]);
      }
    }
  }
}

/// Finds where a vertical ray is inside the inner domain.
class RayTrimmer {
public:
  RayTrimmer(const SurfaceQuery& surface, const BlockField& field, double wall_mm)
      : surface_(surface), field_(field), wall_(wall_mm) {}

  /// Appends the parts of the solid interval that lie in the inner domain.
  void trim(const Eigen::Vector2d& xy, const Interval& solid, std::vector<Interval>& inner) const {
    const double h = field_.spacing_mm;
    const Eigen::Vector2d scaled = (xy - field_.origin_mm.head<2>()) / h;
    const int i = static_cast<int>(std::floor(scaled.x()));
    const int j = static_cast<int>(std::floor(scaled.y()));
    const Eigen::Vector2d fraction = scaled - Eigen::Vector2d(i, j);
    const int first = static_cast<int>(std::ceil((solid.lo - field_.origin_mm.z()) / h));
    const int last = static_cast<int>(std::floor((solid.hi - field_.origin_mm.z()) / h));

    double previous_z = solid.lo;
    double previous = wall_;  // on the surface itself
    bool inside = false;
    int hint = -1;
    for (int k = first; k <= last; ++k) {
      const double z = field_.origin_mm.z() + h * k;
      double value = 0;
      if (const int mark = uniform_mark(i, j, k); mark != 0) {
        value = mark * static_cast<double>(field_.far());
        // Nothing changes up to the last sample of this block.
        if ((value < 0) == inside) {
          k = std::min(last, (k / kSide + 1) * kSide - 1);
          previous_z = field_.origin_mm.z() + h * k;
          previous = value;
          continue;
        }
      } else {
        value = interpolate(i, j, k, fraction);
      }
      if ((value < 0) != inside) {
        const double end = refine(xy, solid, {{previous_z, z}, previous, value}, hint);
        inside = !inside;
        if (inside)
          inner.push_back({end, end});
        else
          inner.back().hi = end;
      }
      previous_z = z;
      previous = value;
    }
    if (inside) inner.back().hi = refine(xy, solid, {{previous_z, solid.hi}, previous, wall_}, hint);
  }

  /// Of the intervals from `start` on, drops those that are not inside after all (near a ridge of the distance the samples may
  /// suggest an inside that is none) and joins those that overlap.
  void tidy(const Eigen::Vector2d& xy, std::vector<Interval>& intervals, std::size_t start) const {
    const double h = field_.spacing_mm;
    std::size_t kept = start;
    for (std::size_t n = start; n < intervals.size(); ++n) {
      const Interval interval = intervals[n];
      if (interval.length() <= 0) continue;
      if (interval.length() < 2 * h && surface_.closest({xy.x(), xy.y(), interval.middle()}, wall_).distance_mm < wall_) continue;
      if (kept > start && interval.lo <= intervals[kept - 1].hi)
        intervals[kept - 1].hi = std::max(intervals[kept - 1].hi, interval.hi);
      else
        intervals[kept++] = interval;
    }
    intervals.resize(kept);
  }

private:
  /// -1 or +1 when the four columns around (i, j) have marked blocks of one sign at level k, else 0.
  int uniform_mark(int i, int j, int k) const {
    int mark = 0;
    for (int n = 0; n < 4; ++n) {
      const int a = (i + (n >> 1)) / kSide;
      const int b = (j + (n & 1)) / kSide;
      const int c = k / kSide;
      int of_block = 1;
      if (i >= 0 && j >= 0 && k >= 0 && a < field_.blocks.x() && b < field_.blocks.y() && c < field_.blocks.z()) {
        const std::int32_t state = field_.state[field_.block_index(a, b, c)];
        if (state >= 0) return 0;
        of_block = state == BlockField::kInside ? -1 : 1;
      }
      if (mark != 0 && mark != of_block) return 0;
      mark = of_block;
    }
    return mark;
  }

  double interpolate(int i, int j, int k, const Eigen::Vector2d& fraction) const {
    const double u = fraction.x();
    const double v = fraction.y();
    return (1 - u) * ((1 - v) * field_.at(i, j, k) + v * field_.at(i, j + 1, k)) +
           u * ((1 - v) * field_.at(i + 1, j, k) + v * field_.at(i + 1, j + 1, k));
  }

  /// Heights between which the ray enters or leaves the inner domain, and estimates of wall - distance there, of opposite sign.
  struct Bracket {
    Interval z;
    double at_lo, at_hi;
  };

  /// The z within the bracket where the distance to the surface is the wall. Newton steps on exact distances, kept inside the
  /// bracket by bisection.
  double refine(const Eigen::Vector2d& xy, const Interval& solid, const Bracket& between, int& hint) const {
    const double h = field_.spacing_mm;
    const auto& [first, at_lo, at_hi] = between;
    Interval bracket = first;
    const bool falling = at_lo > at_hi;
    double z = bracket.lo + bracket.length() * std::clamp(at_lo / (at_lo - at_hi), 0.0, 1.0);
    // The estimates may have put the end into the wrong step; leave room to leave it.
    bracket = {std::max(bracket.lo - 0.5 * h, solid.lo), std::min(bracket.hi + 0.5 * h, solid.hi)};
    for (int iteration = 0; iteration < 8; ++iteration) {
      const ClosestPoint closest = surface_.closest({xy.x(), xy.y(), z}, wall_ + 2 * h, hint);
      if (closest.triangle < 0) {  // deep inside: the end lies towards the positive side
        (falling ? bracket.hi : bracket.lo) = z;
        z = 0.5 * (bracket.lo + bracket.hi);
        continue;
      }
      hint = closest.triangle;
      const double value = wall_ - closest.distance_mm;
      ((value > 0) == falling ? bracket.lo : bracket.hi) = z;
      const double slope = closest.distance_mm > 0 ? (closest.point_mm.z() - z) / closest.distance_mm : 0;
      const double step = slope != 0 ? -value / slope : h;
      const double next = z + step;
      if (next < bracket.lo || next > bracket.hi) {
        z = 0.5 * (bracket.lo + bracket.hi);
        continue;
      }
      z = next;
      // Newton's error is of second order: after so small a step it is below a thousandth of the spacing.
      if (std::abs(step) < 0.03 * h) break;
    }
    return z;
  }

  const SurfaceQuery& surface_;
  const BlockField& field_;
  double wall_;
};

RayRep trim_rays(const SurfaceQuery& surface, const RayRep& solid, const BlockField& field, double wall_mm,
                 const Progress& progress) {
  const RayTrimmer trimmer(surface, field, wall_mm);
  RayRep inner;
  inner.grid = solid.grid;
  inner.first.assign(solid.grid.size() + 1, 0);
  const auto rows = static_cast<std::size_t>(solid.grid.ny);
  const auto columns = static_cast<std::size_t>(solid.grid.nx);
  std::vector<std::vector<Interval>> row_intervals(rows);
  constexpr std::size_t slice = 64;
  for (std::size_t begin = 0; begin < rows; begin += slice) {
    progress.check();
    tbb::parallel_for(begin, std::min(begin + slice, rows), [&](std::size_t j) {
      std::vector<Interval>& intervals = row_intervals[j];
      for (std::size_t ray = j * columns; ray < (j + 1) * columns; ++ray) {
        const std::size_t before = intervals.size();
        for (std::uint32_t n = solid.first[ray]; n < solid.first[ray + 1]; ++n) {
          const std::size_t start = intervals.size();
          trimmer.trim(solid.grid.at(ray), solid.intervals[n], intervals);
          trimmer.tidy(solid.grid.at(ray), intervals, start);
        }
        inner.first[ray + 1] = static_cast<std::uint32_t>(intervals.size() - before);
      }
    });
  }
  for (std::size_t ray = 0; ray < solid.grid.size(); ++ray) inner.first[ray + 1] += inner.first[ray];
  for (const auto& row : row_intervals) inner.intervals.insert(inner.intervals.end(), row.begin(), row.end());
  return inner;
}

/// Removes connected pieces (over neighbouring rays whose intervals overlap) below a volume.
void drop_small_components(InnerDomain& domain, double min_mm3) {
  RayRep& rays = domain.rays;
  const std::size_t count = rays.intervals.size();
  UnionFind joined(static_cast<int>(count));
  const auto root = [&joined](std::uint32_t n) { return static_cast<std::size_t>(joined.root(static_cast<int>(n))); };
  const auto join_rays = [&](std::size_t r, std::size_t q) {
    std::uint32_t m = rays.first[q];
    for (std::uint32_t n = rays.first[r]; n < rays.first[r + 1]; ++n) {
      while (m < rays.first[q + 1] && rays.intervals[m].hi < rays.intervals[n].lo) ++m;
      for (std::uint32_t o = m; o < rays.first[q + 1] && rays.intervals[o].lo <= rays.intervals[n].hi; ++o)
        joined.unite(static_cast<int>(o), static_cast<int>(n));
    }
  };
  const auto columns = static_cast<std::size_t>(rays.grid.nx);
  for (std::size_t ray = 0; ray < rays.grid.size(); ++ray) {
    if (ray % columns + 1 < columns) join_rays(ray, ray + 1);
    if (ray + columns < rays.grid.size()) join_rays(ray, ray + columns);
  }
  std::vector<double> volume(count, 0.0);
  for (std::uint32_t n = 0; n < count; ++n) volume[root(n)] += rays.intervals[n].length() * rays.grid.cell_area_mm2();
  for (std::uint32_t n = 0; n < count; ++n)
    if (root(n) == n && volume[n] < min_mm3) {
      ++domain.dropped_components;
      domain.dropped_mm3 += volume[n];
    }
  if (domain.dropped_components == 0) return;

  RayRep kept;
  kept.grid = rays.grid;
  kept.first.assign(rays.first.size(), 0);
  for (std::size_t ray = 0; ray < rays.grid.size(); ++ray) {
    for (std::uint32_t n = rays.first[ray]; n < rays.first[ray + 1]; ++n)
      if (volume[root(n)] >= min_mm3) kept.intervals.push_back(rays.intervals[n]);
    kept.first[ray + 1] = static_cast<std::uint32_t>(kept.intervals.size());
  }
  rays = std::move(kept);
}

}  // namespace

InnerDomain inner_domain(const SurfaceQuery& surface, const InnerDomainOptions& options, const Progress& progress) {
  return detail::inner_domain({surface}, options, progress);
}

InnerDomain detail::inner_domain(const KeptSolid& solid, const InnerDomainOptions& options, const Progress& progress) {
  InnerDomain domain;
  sample_field(solid, options, domain.field, domain.cast, progress);

  progress.begin("rays");
  CastReport cast;
  const RayGrid grid = covering_grid(box_of(solid), options.ray_spacing_mm);
  const RayRep open = cast_rays(solid, grid, &cast, progress);
  if (domain.cast.bad == 0) domain.cast.first_bad_mm = cast.first_bad_mm;
  domain.cast.rays += cast.rays;
  domain.cast.bad += cast.bad;
  domain.rays = trim_rays(solid.surface, open, domain.field, options.wall_mm, progress);
  drop_small_components(domain, options.min_component_mm3);
  return domain;
}

ClosestPoint deepest_point(const SurfaceQuery& surface, const Progress& progress) {
  constexpr int max_samples = 20000;
  const Eigen::AlignedBox3d box = bounding_box(surface.mesh());
  if (box.isEmpty()) return {};
  struct Cell {
    double bound;  // no point of the cell is deeper
    double half;
    Eigen::Vector3d centre;
    bool operator<(const Cell& other) const { return bound < other.bound; }
  };
  ClosestPoint best;
  best.point_mm = box.center();
  const double diagonal = box.diagonal().norm();
  int samples = 0;
  const auto depth_at = [&](const Eigen::Vector3d& p) {
    ++samples;
    const ClosestPoint closest = surface.closest(p, 2 * diagonal);
    const double depth = is_inside(surface, p) ? closest.distance_mm : -closest.distance_mm;
    if (depth > best.distance_mm) best = {depth, p, closest.triangle};
    return depth;
  };

  std::priority_queue<Cell> queue;
  const auto visit = [&](const Eigen::Vector3d& centre, double half) {
    const double bound = depth_at(centre) + kSqrt3 * half;
    if (bound > best.distance_mm) queue.push({bound, half, centre});
  };
  double half = 0.5 * box.sizes().maxCoeff();
  visit(box.center(), half);
  while (!queue.empty() && samples < max_samples) {
    const Cell cell = queue.top();
    queue.pop();
    if (cell.bound <= best.distance_mm) break;
    progress.check();
    half = 0.5 * cell.half;
    for (int n = 0; n < 8; ++n) visit(cell.centre + half * Eigen::Vector3d(n & 4 ? 1 : -1, n & 2 ? 1 : -1, n & 1 ? 1 : -1), half);
  }
  // The cells narrow the place down to `half`; a search along the axes does the rest.
  for (double step = half; step > 1e-6 * diagonal;) {
    const double before = best.distance_mm;
    const Eigen::Vector3d from = best.point_mm;
    for (int axis = 0; axis < 3; ++axis)
      for (const double sign : {-1.0, 1.0}) depth_at(from + sign * step * Eigen::Vector3d::Unit(axis));
    if (best.distance_mm <= before) step *= 0.5;
  }
  return best;
}

}  // namespace rayrep
