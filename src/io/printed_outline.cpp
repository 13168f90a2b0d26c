#include "io/printed_outline.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace rayrep::detail {
namespace {

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

}  // namespace

void PrintedOutline::add(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double width_mm) {
  if (from == to) return;
  if (points_.empty() || points_.back() != from) {
    end_path();
    points_.push_back(from);
  }
  points_.push_back(to);
  widths_.push_back(width_mm);
}

void PrintedOutline::end_path() {
  std::vector<Eigen::Vector2d> points = std::move(points_);
  std::vector<double> widths = std::move(widths_);
  points_.clear();
  widths_.clear();
  if (points.size() < 4) return;
  // A slicer leaves a gap of a part of the nozzle at the seam.
  const double gap = (points.back() - points.front()).norm();
  if (gap > 1.5 * widths.back()) return;
  if (gap < 1e-9)
    points.pop_back();
  else
    widths.push_back(widths.back());

  LoopMoments area = loop_moments(points);
  if (area.area_mm2 == 0) return;
  const double sign = area.area_mm2 < 0 ? -1 : 1;
  area = {sign * area.area_mm2, sign * area.moment_mm3};
  // The strip outside, half a bead wide, with a sector at each corner that turns outward.
  const std::size_t n = points.size();
  Eigen::AlignedBox2d box;
  for (std::size_t i = 0; i < n; ++i) {
    const Eigen::Vector2d& corner = points[(i + 1) % n];
    const Eigen::Vector2d d = corner - points[i];
    const double half = 0.5 * widths[i];
    const double length = d.norm();
    const Eigen::Vector2d outward = sign * Eigen::Vector2d(d.y(), -d.x()) / length;
    box.extend(corner - Eigen::Vector2d::Constant(half));
    box.extend(corner + Eigen::Vector2d::Constant(half));
    area.area_mm2 += length * half;
    area.moment_mm3 += length * half * (0.5 * (points[i] + corner) + 0.5 * half * outward);
    const Eigen::Vector2d next = points[(i + 2) % n] - corner;
    // Negative where strips overlap.
    const double sector = 0.5 * half * half * sign * std::atan2(cross(d, next), d.dot(next));
    area.area_mm2 += sector;
    area.moment_mm3 += sector * corner;
  }
  loops_.push_back(std::move(points));
  areas_.push_back(area);
  boxes_.push_back(box);
}

void PrintedOutline::end_layer(double top_mm, double height_mm, std::vector<PrintedLayer>& layers) {
  end_path();
  PrintedLayer layer;
  layer.z_mm = top_mm - 0.5 * height_mm;
  layer.height_mm = height_mm;
  Eigen::AlignedBox2d box;
  for (const std::size_t n : outermost(loops_)) {
    layer.area_mm2 += areas_[n].area_mm2;
    layer.centroid_mm += areas_[n].moment_mm3;
    box.extend(boxes_[n]);
  }
  if (layer.area_mm2 > 0) {
    layer.centroid_mm /= layer.area_mm2;
    layer.size_mm = box.sizes();
    layers.push_back(layer);
  }
  loops_.clear();
  areas_.clear();
  boxes_.clear();
}

}  // namespace rayrep::detail
