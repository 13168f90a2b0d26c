#include "rayrep/draw/shading.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <limits>

namespace rayrep {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kBandRows = 24;       // of samples, which one task fills
constexpr std::int64_t kSub = 256;  // places between samples to which corners are rounded: neighbours leave no gaps

using Corner = Eigen::Matrix<std::int64_t, 2, 1>;

/// What is seen in a sample; z grows towards the viewer, in samples.
struct Sample {
  double z = -std::numeric_limits<double>::infinity();
  Eigen::Vector3f colour = Eigen::Vector3f::Zero();
  int label = 0;  ///< 0: nothing; of part p its surface 2 p + 1, its cut 2 p + 2
};

Eigen::Vector3f vector_of(const Colour& colour) { return Vector3d(colour.red, colour.green, colour.blue).cast<float>(); }

/// Soft light from above and the left, on a surface whose normal is given in the view.
Eigen::Vector3f lit(const Eigen::Vector3f& colour, const Vector3d& normal) {
  static const Vector3d kLight = Vector3d(-0.42, 0.62, 0.66).normalized();
  static const Vector3d kHalf = (kLight + Vector3d::UnitZ()).normalized();
  const double light = 0.66 + 0.15 * normal.y() + 0.30 * std::max(0.0, normal.dot(kLight));
  const double gloss = 0.12 * std::pow(std::max(0.0, normal.dot(kHalf)), 30);
  return (static_cast<float>(light) * colour).array() + static_cast<float>(gloss);
}

/// For each corner of each triangle, 3 t + k: the mean normal of the triangles around the vertex that are turned by less than 40
/// degrees against this one.
std::vector<Vector3d> corner_normals(const Mesh& mesh) {
  constexpr double kSmooth = 0.766;
  const std::size_t count = mesh.triangles.size();
  std::vector<Vector3d> areas(count);
  std::vector<int> first(mesh.vertices.size() + 1, 0);
  for (std::size_t t = 0; t < count; ++t) {
    areas[t] = (mesh.corner(t, 1) - mesh.corner(t, 0)).cross(mesh.corner(t, 2) - mesh.corner(t, 0));
    for (int k = 0; k < 3; ++k) ++first[static_cast<std::size_t>(mesh.triangles[t][k]) + 1];
  }
  for (std::size_t v = 1; v < first.size(); ++v) first[v] += first[v - 1];
  std::vector<int> around(3 * count);
  std::vector<int> next(first.begin(), first.end() - 1);
  for (std::size_t t = 0; t < count; ++t)
    for (int k = 0; k < 3; ++k) around[next[mesh.triangles[t][k]]++] = static_cast<int>(t);
  std::vector<Vector3d> normals(3 * count);
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t t) {
    const Vector3d own = areas[t].normalized();
    for (int k = 0; k < 3; ++k) {
      const int v = mesh.triangles[t][k];
      Vector3d sum = Vector3d::Zero();
      for (int n = first[v]; n < first[v + 1]; ++n)
        if (const Vector3d& other = areas[around[n]]; own.dot(other) > kSmooth * other.norm()) sum += other;
      normals[3 * t + k] = sum.squaredNorm() > 0 ? sum.normalized() : own;
    }
  });
  return normals;
}

/// A part as it is seen: x and y in samples from the lower left, z in samples.
struct Seen {
  const ShadedPart* part;
  std::vector<Corner> corners;  ///< of the vertices, in 1 / kSub samples
  std::vector<double> z;
  std::vector<Vector3d> normals;        ///< of corners of triangles, in the view
  std::vector<std::vector<int>> bands;  ///< triangles that reach into each
};

/// The cut in samples: what has normal . (x, y, z) > offset is away.
struct Cut {
  Vector3d normal = Vector3d::Zero();
  double offset = 0;
  bool away(double x, double y, double z) const { return normal.x() * x + normal.y() * y + normal.z() * z > offset; }
  double z_at(double x, double y) const { return (offset - normal.x() * x - normal.y() * y) / normal.z(); }
};

class Raster {
public:
  Raster(const std::vector<ShadedPart>& parts, const Camera& camera, const std::optional<ClipPlane>& cut)
      : camera_(camera), width_(camera.samples * camera.width_px), height_(camera.samples * camera.height_px) {
    if (cut) {
      cut_.emplace();
      cut_->normal = camera.to_view * cut->normal;
      assert(cut_->normal.z() > 0);
      // normal . p = offset for p = centre + to_view^T (x - w/2, y - h/2, z) / samples_per_mm()
      cut_->offset = (cut->offset_mm - cut->normal.dot(camera.centre_mm)) * samples_per_mm() + cut_->normal.x() * 0.5 * width_ +
                     cut_->normal.y() * 0.5 * height_;
    }
    for (const ShadedPart& part : parts) seen_.push_back(see(part));
    samples_.resize(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  }

  Image image() {
    tbb::parallel_for(0, bands(), [this](int band) { fill(band); });
    Image result{camera_.width_px, camera_.height_px};
    result.rgba.resize(4 * static_cast<std::size_t>(result.width) * static_cast<std::size_t>(result.height));
    tbb::parallel_for(0, result.height, [&](int row) {
      for (int column = 0; column < result.width; ++column) mix(column, row, result);
    });
    return result;
  }

private:
  double samples_per_mm() const { return camera_.samples / camera_.mm_per_px; }
  int bands() const { return (height_ + kBandRows - 1) / kBandRows; }
  std::size_t place(int x, int y) const { return static_cast<std::size_t>(y) * width_ + x; }

  Seen see(const ShadedPart& part) const {
    Seen seen{&part, {}, {}, {}, {}};
    for (const Vector3d& vertex : part.mesh.vertices) {
      const Vector3d v = samples_per_mm() * (camera_.to_view * (vertex - camera_.centre_mm));
      seen.corners.emplace_back(std::llround(kSub * (v.x() + 0.5 * width_)), std::llround(kSub * (v.y() + 0.5 * height_)));
      seen.z.push_back(v.z());
    }
    seen.normals = corner_normals(part.mesh);
    for (Vector3d& normal : seen.normals) normal = camera_.to_view * normal;
    seen.bands.resize(static_cast<std::size_t>(bands()));
    for (std::size_t t = 0; t < part.mesh.triangles.size(); ++t) {
      const Eigen::Vector3i& v = part.mesh.triangles[t];
      const auto [low, high] = std::minmax({seen.corners[v[0]].y(), seen.corners[v[1]].y(), seen.corners[v[2]].y()});
      const std::int64_t from = std::max<std::int64_t>(0, low / kSub / kBandRows - (low < 0));
      const std::int64_t to = std::min<std::int64_t>(bands() - 1, high / kSub / kBandRows);
      for (std::int64_t band = from; band <= to && high >= 0; ++band)
        seen.bands[static_cast<std::size_t>(band)].push_back(static_cast<int>(t));
    }
    return seen;
  }

  /// One part in one band.
  struct Band {
    int from_y;
    int to_y;
    std::vector<Sample> samples;
    std::vector<int> winding;  ///< on the cut, of what lies behind it
  };

  void fill(int number) {
    Band band{number * kBandRows, std::min(height_, (number + 1) * kBandRows), {}, {}};
    const std::size_t size = static_cast<std::size_t>(band.to_y - band.from_y) * width_;
    for (std::size_t p = 0; p < seen_.size(); ++p) {
      band.samples.assign(size, {});
      band.winding.assign(size, 0);
      for (const int t : seen_[p].bands[number]) fill_triangle(seen_[p], t, static_cast<int>(2 * p + 1), band);
      merge(band, *seen_[p].part, static_cast<int>(2 * p + 2));
    }
  }

  /// Puts a part over those before it.
  void merge(const Band& band, const ShadedPart& part, int cut_label) {
    for (int y = band.from_y; y < band.to_y; ++y)
      for (int x = 0; x < width_; ++x) {
        const std::size_t n = static_cast<std::size_t>(y - band.from_y) * width_ + x;
        Sample& there = samples_[place(x, y)];
        Sample here = band.samples[n];
        if (cut_ && band.winding[n] > 0) here = {cut_->z_at(x + 0.5, y + 0.5), vector_of(part.cut_colour), cut_label};
        if (here.label != 0 && here.z >= there.z) there = here;
      }
  }

  void fill_triangle(const Seen& seen, int t, int label, Band& band) const {
    std::array<int, 3> k = {0, 1, 2};
    const Eigen::Vector3i& v = seen.part->mesh.triangles[t];
    const auto cross = [](const Corner& a, const Corner& b) { return a.x() * b.y() - a.y() * b.x(); };
    std::int64_t area = cross(seen.corners[v[1]] - seen.corners[v[0]], seen.corners[v[2]] - seen.corners[v[0]]);
    if (area == 0) return;
    const bool front = area > 0;
    if (!front) {
      std::swap(k[1], k[2]);
      area = -area;
    }
    const std::array<Corner, 3> p = {seen.corners[v[k[0]]], seen.corners[v[k[1]]], seen.corners[v[k[2]]]};
    const auto [low_x, high_x] = std::minmax({p[0].x(), p[1].x(), p[2].x()});
    const auto [low_y, high_y] = std::minmax({p[0].y(), p[1].y(), p[2].y()});
    const auto first = [](std::int64_t low, int least) { return static_cast<int>(std::max<std::int64_t>(least, low / kSub - 1)); };
    const auto past = [](std::int64_t high, int most) { return static_cast<int>(std::min<std::int64_t>(most, high / kSub + 2)); };
    for (int y = first(low_y, band.from_y); y < past(high_y, band.to_y); ++y)
      for (int x = first(low_x, 0); x < past(high_x, width_); ++x) {
        const Corner at(kSub * x + kSub / 2, kSub * y + kSub / 2);
        std::array<std::int64_t, 3> weight{};
        bool inside = true;
        for (int n = 0; n < 3 && inside; ++n) {
          const Corner& a = p[(n + 1) % 3];
          const Corner along = p[(n + 2) % 3] - a;
          weight[n] = cross(along, at - a);
          // Of a side that two triangles share, what lies on it belongs to one.
          const bool owns = along.y() < 0 || (along.y() == 0 && along.x() < 0);
          inside = weight[n] > 0 || (weight[n] == 0 && owns);
        }
        if (!inside) continue;
        Vector3d share;
        for (int n = 0; n < 3; ++n) share[k[n]] = static_cast<double>(weight[n]) / static_cast<double>(area);
        put(seen, t, {x, y, label, front, share}, band);
      }
  }

  struct Fragment {
    int x;
    int y;
    int label;
    bool front;
    Vector3d share;  ///< of each corner
  };

  void put(const Seen& seen, int t, const Fragment& f, Band& band) const {
    const Eigen::Vector3i& v = seen.part->mesh.triangles[t];
    const double z = f.share.dot(Vector3d(seen.z[v[0]], seen.z[v[1]], seen.z[v[2]]));
    if (cut_ && cut_->away(f.x + 0.5, f.y + 0.5, z)) return;
    const std::size_t n = static_cast<std::size_t>(f.y - band.from_y) * width_ + f.x;
    band.winding[n] += f.front ? -1 : 1;
    Sample& sample = band.samples[n];
    if (z <= sample.z) return;
    Vector3d normal = Vector3d::Zero();
    Eigen::Vector3f colour = vector_of(seen.part->colour);
    for (int c = 0; c < 3; ++c) normal += f.share[c] * seen.normals[3 * static_cast<std::size_t>(t) + c];
    if (!seen.part->of_vertex.empty()) {
      colour.setZero();
      for (int c = 0; c < 3; ++c) colour += static_cast<float>(f.share[c]) * vector_of(seen.part->of_vertex[v[c]]);
    }
    normal.normalize();
    if (normal.z() < 0) normal.z() = -normal.z();
    sample = {z, lit(colour, normal), f.label};
  }

  const Sample* at(int x, int y) const { return x < 0 || y < 0 || x >= width_ || y >= height_ ? nullptr : &samples_[place(x, y)]; }

  /// Part of the light that neighbours keep away, 0 to 1.
  double hidden(int x, int y) const {
    static constexpr std::array<std::array<int, 2>, 8> kWays = {
        {{1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, 0}, {-1, -1}, {0, -1}, {1, -1}}};
    const double z = samples_[place(x, y)].z;
    double sum = 0;
    for (const int reach : {4, 9, 20})
      for (const auto& way : kWays) {
        const Sample* other = at(x + reach * way[0], y + reach * way[1]);
        if (other == nullptr || other->label == 0) continue;
        const double rise = (other->z - z) / reach - 0.2;
        sum += rise > 6 ? 0.3 : std::clamp(rise, 0.0, 1.0);
      }
    return sum / 24;
  }

  /// A contour runs here: the edge of a part or of its cut, or a step in depth.
  bool on_contour(int x, int y) const {
    constexpr double kStep = 9;
    const Sample& own = samples_[place(x, y)];
    for (const auto& [dx, dy] : {std::array{1, 0}, std::array{0, 1}}) {
      const Sample* before = at(x - dx, y - dy);
      const Sample* after = at(x + dx, y + dy);
      if (before == nullptr || after == nullptr) continue;
      if (before->label != own.label || after->label != own.label) return true;
      if (own.label % 2 == 1 && std::abs(before->z + after->z - 2 * own.z) > kStep) return true;
    }
    return false;
  }

  Eigen::Vector3f drawn(int x, int y) const {
    const Sample& own = samples_[place(x, y)];
    if (own.label == 0) return own.colour;
    Eigen::Vector3f colour = own.colour;
    if (own.label % 2 == 1) colour *= static_cast<float>(1 - 0.6 * hidden(x, y));
    if (on_contour(x, y)) colour *= 0.38F;
    return colour;
  }

  void mix(int column, int row, Image& image) const {
    const int samples = camera_.samples;
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    int filled = 0;
    for (int dy = 0; dy < samples; ++dy)
      for (int dx = 0; dx < samples; ++dx) {
        const int x = samples * column + dx;
        const int y = height_ - 1 - (samples * row + dy);
        if (samples_[place(x, y)].label == 0) continue;
        sum += drawn(x, y);
        ++filled;
      }
    std::uint8_t* rgba = &image.rgba[4 * (static_cast<std::size_t>(row) * image.width + column)];
    if (filled == 0) return;
    for (int c = 0; c < 3; ++c)
      rgba[c] = static_cast<std::uint8_t>(std::lround(255 * std::clamp(static_cast<double>(sum[c]) / filled, 0.0, 1.0)));
    rgba[3] = static_cast<std::uint8_t>(std::lround(255.0 * filled / (samples * samples)));
  }

  const Camera& camera_;
  int width_;
  int height_;
  std::optional<Cut> cut_;
  std::vector<Seen> seen_;
  std::vector<Sample> samples_;
};

}  // namespace

Eigen::Matrix3d looking(const Vector3d& up, double azimuth_rad, double elevation_rad) {
  const Vector3d right(std::cos(azimuth_rad), std::sin(azimuth_rad), 0);
  const Vector3d to_viewer = std::cos(elevation_rad) * Vector3d(std::sin(azimuth_rad), -std::cos(azimuth_rad), 0) +
                             std::sin(elevation_rad) * Vector3d::UnitZ();
  Eigen::Matrix3d rows;
  rows.row(0) = right;
  rows.row(1) = to_viewer.cross(right);
  rows.row(2) = to_viewer;
  return rows * up_to_z(up);
}

Image shaded(const std::vector<ShadedPart>& parts, const Camera& camera, const std::optional<ClipPlane>& cut) {
  return Raster(parts, camera, cut).image();
}

}  // namespace rayrep
