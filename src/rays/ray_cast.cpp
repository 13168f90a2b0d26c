#include "rayrep/rays/ray_cast.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "rays/kept_solid.h"

namespace rayrep {
namespace {

/// Puts entering hits first among those that coincide but for rounding and gives them one height: touching parts do not open a gap,
/// and a line that grazes an edge does not seem to leave before it enters.
void join_coincident(std::vector<LineHit>& hits, double tolerance_mm) {
  for (auto first = hits.begin(); first != hits.end();) {
    auto last = first + 1;
    while (last != hits.end() && last->z_mm - (last - 1)->z_mm <= tolerance_mm) ++last;
    const double z = first->z_mm;
    std::stable_sort(first, last, [](const LineHit& a, const LineHit& b) { return a.sign > b.sign; });
    for (; first != last; ++first) first->z_mm = z;
  }
}

/// Winding numbers along a ray: of the solid, and of what is kept of it.
class Windings {
public:
  explicit Windings(int kept_from) : kept_from_(kept_from) {}
  void pass(const LineHit& hit) { (hit.triangle < kept_from_ ? solid_ : kept_) += hit.sign; }
  bool negative() const { return solid_ < 0 || kept_ < 0; }
  bool none() const { return solid_ == 0 && kept_ == 0; }
  bool in(Region region) const { return kept_ == 0 && (region == Region::solid ? solid_ > 0 : solid_ == 1); }

private:
  int kept_from_;
  int solid_ = 0;
  int kept_ = 0;
};

/// True when no winding number along the ray ever falls below 0 and all end at 0.
bool closes(const std::vector<LineHit>& hits, int kept_from) {
  Windings windings(kept_from);
  for (const LineHit& hit : hits) {
    windings.pass(hit);
    if (windings.negative()) return false;
  }
  return windings.none();
}

void append_intervals(const std::vector<LineHit>& hits, Windings windings, Region region, std::vector<Interval>& intervals) {
  bool inside = false;
  for (const LineHit& hit : hits) {
    windings.pass(hit);
    const bool now = windings.in(region);
    if (now == inside) continue;
    inside = now;
    if (inside) {
      // Coincident hits may leave the region and enter it again at once.
      if (!intervals.empty() && intervals.back().hi == hit.z_mm) continue;
      intervals.push_back({hit.z_mm, hit.z_mm});
    } else {
      intervals.back().hi = hit.z_mm;
      if (intervals.back().length() <= 0) intervals.pop_back();
    }
  }
}

RayRep cast(const detail::KeptSolid& solid, const RayGrid& grid, Region region, CastReport* report, const Progress& progress) {
  const auto& [surface, kept_from] = solid;
  const Eigen::AlignedBox3d box = bounding_box(surface.mesh());
  const double tolerance_mm = box.isEmpty() ? 0 : 1e-9 * box.diagonal().norm();
  const auto rows = static_cast<std::size_t>(grid.ny);
  const auto columns = static_cast<std::size_t>(grid.nx);
  std::vector<std::vector<Interval>> row_intervals(rows);
  std::vector<char> open(grid.size(), 0);
  RayRep rays;
  rays.grid = grid;
  rays.first.assign(grid.size() + 1, 0);

  // In slices, so that a cancellation is seen by the calling thread.
  constexpr std::size_t slice = 64;
  for (std::size_t begin = 0; begin < rows; begin += slice) {
    progress.check();
    tbb::parallel_for(begin, std::min(begin + slice, rows), [&](std::size_t j) {
      std::vector<LineHit> hits;
      std::vector<Interval> of_ray;
      for (std::size_t i = 0; i < columns; ++i) {
        const std::size_t ray = j * columns + i;
        surface.line_hits(grid.at(ray), hits);
        join_coincident(hits, tolerance_mm);
        open[ray] = !closes(hits, kept_from);
        of_ray.clear();
        if (!open[ray]) append_intervals(hits, Windings(kept_from), region, of_ray);
        rays.first[ray + 1] = static_cast<std::uint32_t>(of_ray.size());
        row_intervals[j].insert(row_intervals[j].end(), of_ray.begin(), of_ray.end());
      }
    });
  }

  for (std::size_t ray = 0; ray < grid.size(); ++ray) rays.first[ray + 1] += rays.first[ray];
  rays.intervals.reserve(rays.first.back());
  for (const auto& row : row_intervals) rays.intervals.insert(rays.intervals.end(), row.begin(), row.end());
  if (report) {
    *report = {};
    report->rays = grid.size();
    for (std::size_t ray = 0; ray < grid.size(); ++ray)
      if (open[ray] && report->bad++ == 0) report->first_bad_mm = grid.at(ray);
  }
  return rays;
}

}  // namespace

RayRep cast_rays(const SurfaceQuery& surface, const RayGrid& grid, Region region, CastReport* report, const Progress& progress) {
  return cast({surface}, grid, region, report, progress);
}

RayRep detail::cast_rays(const KeptSolid& solid, const RayGrid& grid, CastReport* report, const Progress& progress) {
  return cast(solid, grid, Region::single_layer, report, progress);
}

RayGrid covering_grid(const Eigen::AlignedBox3d& box, double spacing_mm) {
  // Fractions of a cell off its centre: sqrt(2) and sqrt(3) less 1, divided by 100.
  const Eigen::Vector2d offset(0.5 + 0.0041421356237309, 0.5 + 0.0073205080756888);
  RayGrid grid;
  grid.spacing_mm = spacing_mm;
  grid.nx = std::max(1, static_cast<int>(std::ceil(box.sizes().x() / spacing_mm)));
  grid.ny = std::max(1, static_cast<int>(std::ceil(box.sizes().y() / spacing_mm)));
  const Eigen::Vector2d covered = spacing_mm * Eigen::Vector2d(grid.nx, grid.ny);
  grid.origin_mm = box.center().head<2>() - 0.5 * covered + spacing_mm * offset;
  return grid;
}

}  // namespace rayrep
