#include "physics/clipped_hull.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace rayrep {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kAllWet = std::numeric_limits<double>::quiet_NaN();  // a rim that no pocket has

}  // namespace

// The fluxes of (0, 0, h), (0, 0, x h), (0, 0, y h), (0, 0, h^2/2). theory.md (5)-(6).
void Integrals::add_wet_triangle(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const double projected = ((b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x())) / 2;
  const Eigen::Vector3d sum = a + b + c;
  volume += projected * sum.z() / 3;
  const Eigen::Vector3d by_height = a.z() * a + b.z() * b + c.z() * c + sum.z() * sum;  // 12 times the mean of h (x, y, h)
  first.head<2>() += projected / 12 * by_height.head<2>();
  first.z() += projected / 24 * by_height.z();
}

// Green's theorem. theory.md (7).
void Integrals::add_rim(const Eigen::Vector2d& p, const Eigen::Vector2d& q) {
  const double cross = p.x() * q.y() - p.y() * q.x();
  const Eigen::Vector2d sum = p + q;
  area += cross / 2;
  area_first += cross / 6 * sum;
  area_second += cross / 24 * (sum * sum.transpose() + p * p.transpose() + q * q.transpose());
}

Eigen::Matrix2d central_second_moments(const Integrals& sum) {
  if (!(sum.area > 0)) return Eigen::Matrix2d::Zero();
  return sum.area_second - sum.area_first * sum.area_first.transpose() / sum.area;
}

ClippedHull::ClippedHull(const Mesh& mesh) : triangles_(mesh.triangles) {
  std::vector<int> renumbered(mesh.vertices.size(), -1);
  Eigen::AlignedBox3d box;
  for (auto& t : triangles_)
    for (int k = 0; k < 3; ++k) {
      int& index = renumbered[t[k]];
      if (index < 0) {
        index = static_cast<int>(vertices_.size());
        vertices_.push_back(mesh.vertices[t[k]]);
        box.extend(vertices_.back());
      }
      t[k] = index;
    }
  if (vertices_.empty()) return;
  centre_ = box.center();
  diagonal_ = box.diagonal().norm();
  for (auto& v : vertices_) v -= centre_;
  pinched_ = pinched_vertices(triangles_, vertices_.size());
  twice_areas_.reserve(triangles_.size());
  for (const auto& t : triangles_) {
    const Eigen::Vector3d& a = vertices_[t[0]];
    twice_areas_.push_back((vertices_[t[1]] - a).cross(vertices_[t[2]] - a));
    volume_ += twice_areas_.back().dot(a) / 6;
  }
}

void ClippedHull::set_up(const Eigen::Vector3d& up) {
  frame_ = frame_of(up);
  floods_ = {};
  found_below_ = -kInfinity;
  lowest_ = kInfinity;
  highest_ = -lowest_;
  heights_.resize(vertices_.size());
  for (std::size_t i = 0; i < vertices_.size(); ++i) {
    heights_[i] = up.dot(vertices_[i]);
    lowest_ = std::min(lowest_, heights_[i]);
    highest_ = std::max(highest_, heights_[i]);
  }
  projected_.resize(triangles_.size());
  for (std::size_t t = 0; t < triangles_.size(); ++t) projected_[t] = up.dot(twice_areas_[t]) / 2;
}

// Volume below an offset and its derivative, the waterplane's area, from heights alone: minus the sum over triangles of the
// projected area times the mean depth of its wet part. theory.md (8). Pockets with a rim at `rim` or higher are dry.
double ClippedHull::volume_below(double offset, double rim, double* area) const {
  double volume = 0;
  double slope = 0;
  const bool pockets = !floods_.empty();
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    std::array<double, 3> depth;
    for (int k = 0; k < 3; ++k) depth[k] = offset - heights_[triangles_[t][k]];
    const bool wet[3] = {depth[0] > 0, depth[1] > 0, depth[2] > 0};
    const int count = wet[0] + wet[1] + wet[2];
    if (count == 0 || (pockets && floods_.of_triangle[t] >= rim)) continue;
    double mean = (depth[0] + depth[1] + depth[2]) / 3;
    double fraction = 1;
    if (count != 3) {
      int k = 0;
      while (wet[k] != (count == 1)) ++k;
      const double alone = depth[k];
      const double part = alone / (alone - depth[(k + 1) % 3]) * (alone / (alone - depth[(k + 2) % 3]));
      fraction = count == 1 ? part : 1 - part;
      mean = count == 1 ? part * alone / 3 : mean - part * alone / 3;
    }
    volume -= projected_[t] * mean;
    slope -= projected_[t] * fraction;
  }
  *area = slope;
  return volume;
}

// Newton's method, with bisection whenever it leaves the bracket or does not halve the error: the waterplane's area may jump (flat
// faces) or vanish (gaps between parts).
double ClippedHull::offset_between(double lo, double hi, double rim, double volume, double guess) const {
  const double volume_accuracy = 1e-15 * volume_;
  const double offset_accuracy = 1e-15 * (hi - lo);
  double offset = guess > lo && guess < hi ? guess : (lo + hi) / 2;
  double last_error = kInfinity;
  for (int i = 0; i < 200; ++i) {
    double area = 0;
    const double error = volume_below(offset, rim, &area) - volume;
    if (std::abs(error) <= volume_accuracy) break;
    (error > 0 ? hi : lo) = offset;
    double next = offset - error / area;
    if (!(next > lo && next < hi) || std::abs(error) > last_error / 2) next = (lo + hi) / 2;
    last_error = std::abs(error);
    const double turn = std::abs(next - offset);
    offset = next;
    if (turn <= offset_accuracy || hi - lo <= offset_accuracy) break;
  }
  return offset;
}

// Pockets that begin below this height.
void ClippedHull::find_pockets(double below) {
  if (!pockets_ || below <= found_below_) return;
  floods_ = {};
  found_below_ = below;
  if (!may_have_pockets(triangles_, heights_, projected_, pinched_, below)) return;
  if (!surface_) {
    surface_ = &shared_surface_->get(vertices_, triangles_);
    wet_.assign(surface_->points(), 0);
    for (const Attitude& a : before_surface_)
      for (std::size_t p = 0; p < wet_.size(); ++p)
        if (a.up.dot(vertices_[surface_->vertex(p)]) < a.offset) wet_[p] = 1;
    before_surface_.clear();
  }
  floods_ = surface_->flood_heights(frame_, heights_, wet_, below);
}

// The heights up to `highest` at which pockets flood, ascending; those that stay dry so far flood at `highest`.
std::vector<double> ClippedHull::rims(double highest) const {
  std::vector<double> result{highest};
  for (const double rim : floods_.of_triangle)
    if (rim != kSea && rim < highest) result.push_back(rim);
  std::sort(result.begin(), result.end());
  result.erase(std::unique(result.begin(), result.end()), result.end());
  return result;
}

// An upper bound of what all pockets hold at once: each just before it floods.
double ClippedHull::dry_volume_at_rims(double highest) const {
  double sum = 0;
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    if (floods_.of_triangle[t] == kSea) continue;
    const double offset = std::min(floods_.of_triangle[t], highest);
    std::array<double, 3> depth;
    for (int k = 0; k < 3; ++k) depth[k] = offset - heights_[triangles_[t][k]];
    std::sort(depth.begin(), depth.end());
    if (depth[2] <= 0) continue;
    double mean = (depth[0] + depth[1] + depth[2]) / 3;
    if (depth[1] <= 0)
      mean = depth[2] / (depth[2] - depth[0]) * (depth[2] / (depth[2] - depth[1])) * depth[2] / 3;
    else if (depth[0] < 0)
      mean -= depth[0] / (depth[0] - depth[1]) * (depth[0] / (depth[0] - depth[2])) * depth[0] / 3;
    sum += projected_[t] * mean;
  }
  return std::max(0., sum);
}

std::optional<double> ClippedHull::offset_for_volume(double volume, double guess) {
  if (!(volume > 0)) return lowest_;
  const bool floats_flooded = volume <= volume_;
  double flooded = highest_;
  if (volume < volume_) flooded = offset_between(lowest_, highest_, kAllWet, volume, guess);
  find_pockets(flooded);
  if (!floods_.empty()) {
    // Less than this it does not take, however dry it stays; then from rim to rim.
    const double missing = volume - 1.000001 * dry_volume_at_rims(flooded);
    if (missing > volume_) return std::nullopt;
    const double least = missing > 0 && missing < volume_ ? offset_between(lowest_, highest_, kAllWet, missing, guess) : lowest_;
    double from = lowest_;
    for (const double rim : rims(flooded)) {
      double area = 0;
      if (rim >= least && volume_below(rim, rim, &area) >= volume) return offset_between(from, rim, rim, volume, guess);
      from = rim;
    }
  }
  if (!floats_flooded) return std::nullopt;
  return flooded;
}

double ClippedHull::largest_displacement() {
  find_pockets(highest_);
  double largest = volume_;
  if (floods_.empty()) return largest;
  for (const double rim : rims(highest_)) {
    double area = 0;
    largest = std::max(largest, volume_below(rim, rim, &area));
  }
  return largest;
}

Integrals ClippedHull::integrals(double offset) {
  points_.resize(vertices_.size());
  for (std::size_t i = 0; i < vertices_.size(); ++i)
    points_[i] = {frame_.u.dot(vertices_[i]), frame_.v.dot(vertices_[i]), heights_[i] - offset};
  return integrate(points_, triangles_, [&](std::size_t t) { return !floods_.dry(t, offset); });
}

bool ClippedHull::wet(std::size_t point, double offset) const {
  return heights_[surface_->vertex(point)] < offset && (floods_.empty() || floods_.of_point[point] < offset);
}

std::vector<int> ClippedHull::dry_points(double offset) const {
  std::vector<int> result;
  if (floods_.empty()) return result;
  for (std::size_t p = 0; p < surface_->points(); ++p)
    if (heights_[surface_->vertex(p)] < offset && !wet(p, offset)) result.push_back(static_cast<int>(p));
  return result;
}

std::vector<int> ClippedHull::points_in_pockets(double offset) {
  find_pockets(kInfinity);
  std::vector<int> result;
  if (floods_.empty()) return result;
  for (std::size_t p = 0; p < surface_->points(); ++p)
    if (floods_.of_point[p] >= offset && floods_.of_point[p] > heights_[surface_->vertex(p)]) result.push_back(static_cast<int>(p));
  return result;
}

bool ClippedHull::reaches_any(const std::vector<int>& points, double offset) const {
  return std::any_of(points.begin(), points.end(), [&](int p) { return wet(p, offset); });
}

void ClippedHull::record_wet(double offset) {
  if (!surface_) {
    before_surface_.push_back({frame_.n, offset});
    return;
  }
  for (std::size_t p = 0; p < wet_.size(); ++p)
    if (wet(p, offset)) wet_[p] = 1;
  found_below_ = -kInfinity;
}

}  // namespace rayrep
