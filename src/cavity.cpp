#include "rayrep/cavity.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "predicates.h"
#include "rayrep/level_set.h"

namespace rayrep {
namespace {

constexpr int kSide = BlockField::kSide;

/// q.phi as a function of the point.
class Quadric {
public:
  explicit Quadric(const Moments& q) : q_(q) {
    hessian_ << 2 * q[MXX], q[MXY], q[MXZ], q[MXY], 2 * q[MYY], q[MYZ], q[MXZ], q[MYZ], 2 * q[MZZ];
    curvature_ = hessian_.norm();
  }

  double value(const Eigen::Vector3d& p) const { return q_.dot(monomials(p)); }
  Eigen::Vector3d gradient(const Eigen::Vector3d& p) const { return q_.segment<3>(MX) + hessian_ * p; }

  /// First-order signed distance to the zero set, negative where the cavity is.
  double signed_distance(const Eigen::Vector3d& p) const {
    const double slope = gradient(p).norm();
    const double v = value(p);
    return slope > 0 ? -v / slope : v > 0 ? -HUGE_VAL : HUGE_VAL;
  }

  /// +1 when q.phi > 0 in the whole ball, -1 when negative, 0 when it may change.
  int sign_in_ball(const Eigen::Vector3d& centre, double radius) const {
    const double v = value(centre);
    const double change = (gradient(centre).norm() + 0.5 * curvature_ * radius) * radius;
    return v > change ? 1 : v < -change ? -1 : 0;
  }

private:
  Moments q_;
  Eigen::Matrix3d hessian_;
  double curvature_;
};

/// max(wall - distance, signed distance of the quadric) on the grid of `wall`.
BlockField intersect(const BlockField& wall, const Quadric& quadric) {
  BlockField field = wall;
  field.samples.clear();
  // The ball around a block that holds its samples and their neighbours.
  const double radius = std::sqrt(3.0) * (kSide / 2 + 1) * wall.spacing_mm;
  for (int a = 0; a < wall.blocks.x(); ++a)
    for (int b = 0; b < wall.blocks.y(); ++b)
      for (int c = 0; c < wall.blocks.z(); ++c) {
        std::int32_t& state = field.state[field.block_index(a, b, c)];
        if (state == BlockField::kOutside) continue;
        const Eigen::Vector3d centre = wall.position(a * kSide + kSide / 2, b * kSide + kSide / 2, c * kSide + kSide / 2);
        const int sign = quadric.sign_in_ball(centre, radius);
        if (sign < 0) {
          state = BlockField::kOutside;
          continue;
        }
        if (sign > 0 && state == BlockField::kInside) continue;
        BlockField::Block block;
        if (state == BlockField::kInside)
          block.fill(-wall.far());
        else
          block = wall.samples[static_cast<std::size_t>(state)];
        if (sign == 0)
          for (int i = 0; i < kSide; ++i)
            for (int j = 0; j < kSide; ++j)
              for (int k = 0; k < kSide; ++k) {
                float& sample = block[static_cast<std::size_t>(BlockField::sample_index(i, j, k))];
                const double v = quadric.signed_distance(wall.position(a * kSide + i, b * kSide + j, c * kSide + k));
                sample = std::max(sample, static_cast<float>(std::clamp(v, -1.0 * wall.far(), 1.0 * wall.far())));
              }
        state = static_cast<std::int32_t>(field.samples.size());
        field.samples.push_back(block);
      }
  return field;
}

/// Moves a vertex of the meshed grid, within a cell of the true surface, onto it.
Eigen::Vector3d onto_surface(Eigen::Vector3d p, const SurfaceQuery& surface, const Quadric& quadric, double wall_mm, double h) {
  const Eigen::Vector3d start = p;
  int hint = -1;
  for (int iteration = 0; iteration < 12; ++iteration) {
    const ClosestPoint closest = surface.closest(p, wall_mm + 2 * h, hint);
    hint = closest.triangle;
    const double to_wall = closest.triangle < 0 ? -HUGE_VAL : wall_mm - closest.distance_mm;
    const double to_quadric = quadric.signed_distance(p);
    const double worst = std::max(to_wall, to_quadric);
    if (iteration == 0 && worst < -h) return p;  // where the cavity was closed by hand, neither surface is near
    if (std::abs(worst) < 1e-6 * h) break;
    if (to_wall >= to_quadric) {
      if (closest.distance_mm <= 0) break;
      p += (to_wall / closest.distance_mm) * (p - closest.point_mm);
    } else {
      p += to_quadric * quadric.gradient(p).normalized();
    }
  }
  return (p - start).norm() <= 2 * h ? p : start;
}

/// Closes the cavity around a point: all samples within a step of it along each axis. Returns how many were inside.
std::size_t close_around(BlockField& field, const Eigen::Vector3d& p) {
  const Eigen::Vector3d at = (p - field.origin_mm) / field.spacing_mm;
  const Eigen::Vector3i low = at.array().floor().cast<int>();
  const Eigen::Vector3i samples = BlockField::kSide * field.blocks;
  std::size_t closed = 0;
  for (int i = std::max(0, low.x()); i <= std::min(low.x() + 1, samples.x() - 1); ++i)
    for (int j = std::max(0, low.y()); j <= std::min(low.y() + 1, samples.y() - 1); ++j)
      for (int k = std::max(0, low.z()); k <= std::min(low.z() + 1, samples.z() - 1); ++k)
        closed += field.raise(i, j, k, static_cast<float>(0.5 * field.spacing_mm));
  return closed;
}

double signed_volume(const Mesh& shell) { return mesh_moments(shell)[M1]; }

/// Triangles that have one in reach whose normal differs by a right angle or may do so, ascending. All others belong to one sheet
/// that is flat as far as they reach: two sheets that meet face each other, or there is a third between them that does.
std::vector<std::size_t> where_it_bends(const Mesh& mesh) {
  const std::size_t count = mesh.triangles.size();
  std::vector<Eigen::Vector3d> normals(count);
  double longest2 = 0;
  for (std::size_t t = 0; t < count; ++t) {
    const Eigen::Vector3d ab = mesh.corner(t, 1) - mesh.corner(t, 0);
    const Eigen::Vector3d ac = mesh.corner(t, 2) - mesh.corner(t, 0);
    normals[t] = ab.cross(ac).normalized();
    longest2 = std::max({longest2, ab.squaredNorm(), ac.squaredNorm(), (ac - ab).squaredNorm()});
  }
  // Centres of triangles that meet are no farther apart than 2/3 of the longest edge, twice: they lie in neighbouring cells.
  const double cell = 1.34 * std::sqrt(longest2);
  const Eigen::AlignedBox3d box = bounding_box(mesh);
  if (!(cell > 0)) return {};
  const Eigen::Vector3i cells = (box.sizes() / cell).array().floor().cast<int>() + 1;
  const auto key = [&cells](const Eigen::Vector3i& c) {
    return (static_cast<std::uint64_t>(c.x()) * static_cast<std::uint64_t>(cells.y()) + static_cast<std::uint64_t>(c.y())) *
               static_cast<std::uint64_t>(cells.z()) +
           static_cast<std::uint64_t>(c.z());
  };
  struct Place {
    std::uint64_t key;
    std::uint32_t triangle;
    Eigen::Vector3i cell;
    bool operator<(const Place& other) const { return std::pair(key, triangle) < std::pair(other.key, other.triangle); }
  };
  std::vector<Place> places(count);
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t t) {
    const Eigen::Vector3d centre = (mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2)) / 3 - box.min();
    const Eigen::Vector3i c = (centre / cell).array().floor().cast<int>().max(0).min(cells.array() - 1);
    places[t] = {key(c), static_cast<std::uint32_t>(t), c};
  });
  tbb::parallel_sort(places.begin(), places.end());
  std::vector<std::size_t> first;  // places where a cell begins
  for (std::size_t n = 0; n < count; ++n)
    if (n == 0 || places[n].key != places[n - 1].key) first.push_back(n);
  first.push_back(count);

  std::vector<char> bends(count);
  tbb::parallel_for(std::size_t{0}, first.size() - 1, [&](std::size_t n) {
    const Eigen::Vector3i c = places[first[n]].cell;
    // The neighbours along z are one run of places.
    std::array<std::pair<std::size_t, std::size_t>, 9> runs;
    std::size_t used = 0;
    for (int a = std::max(0, c.x() - 1); a <= std::min(c.x() + 1, cells.x() - 1); ++a)
      for (int b = std::max(0, c.y() - 1); b <= std::min(c.y() + 1, cells.y() - 1); ++b) {
        const Place lo{key({a, b, std::max(0, c.z() - 1)}), 0, {}};
        const Place hi{key({a, b, std::min(c.z() + 1, cells.z() - 1)}) + 1, 0, {}};
        const auto begin = std::lower_bound(places.begin(), places.end(), lo);
        const auto end = std::lower_bound(begin, places.end(), hi);
        runs[used++] = {static_cast<std::size_t>(begin - places.begin()), static_cast<std::size_t>(end - places.begin())};
      }
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (std::size_t r = 0; r < used; ++r)
      for (std::size_t m = runs[r].first; m < runs[r].second; ++m) mean += normals[places[m].triangle];
    const double least = mean.norm() * std::numbers::sqrt2 / 2;  // all within 45 degrees of the mean: none a right angle apart
    bool flat = least > 0;
    for (std::size_t r = 0; r < used && flat; ++r)
      for (std::size_t m = runs[r].first; m < runs[r].second && flat; ++m) flat = normals[places[m].triangle].dot(mean) > least;
    if (!flat)
      for (std::size_t m = first[n]; m < first[n + 1]; ++m) bends[places[m].triangle] = 1;
  });
  std::vector<std::size_t> result;
  for (std::size_t t = 0; t < count; ++t)
    if (bends[t]) result.push_back(t);
  return result;
}

}  // namespace

std::vector<std::size_t> crossing_triangles(const Mesh& mesh) {
  const std::vector<std::size_t> candidates = where_it_bends(mesh);
  Mesh bends;
  bends.vertices = mesh.vertices;
  for (const std::size_t t : candidates) bends.triangles.push_back(mesh.triangles[t]);
  const auto pairs = SurfaceQuery(bends).close_pairs();
  std::vector<char> crosses(pairs.size());
  tbb::parallel_for(std::size_t{0}, pairs.size(), [&](std::size_t n) {
    const auto s = static_cast<std::size_t>(pairs[n].first);
    const auto t = static_cast<std::size_t>(pairs[n].second);
    const Eigen::Vector3d p[3] = {bends.corner(s, 0), bends.corner(s, 1), bends.corner(s, 2)};
    const Eigen::Vector3d q[3] = {bends.corner(t, 0), bends.corner(t, 1), bends.corner(t, 2)};
    crosses[n] = triangles_intersect(p, bends.triangles[s], q, bends.triangles[t]);
  });
  std::vector<std::size_t> triangles;
  for (std::size_t n = 0; n < pairs.size(); ++n)
    if (crosses[n]) {
      triangles.push_back(candidates[static_cast<std::size_t>(pairs[n].first)]);
      triangles.push_back(candidates[static_cast<std::size_t>(pairs[n].second)]);
    }
  std::sort(triangles.begin(), triangles.end());
  triangles.erase(std::unique(triangles.begin(), triangles.end()), triangles.end());
  return triangles;
}

CavityMesh mesh_cavity(BlockField& field, const SurfaceQuery& surface, const Moments& q, const CavityOptions& options) {
  constexpr int max_rounds = 8;
  const Quadric quadric(q);
  CavityMesh result;
  Mesh all;
  for (int round = 0; round < max_rounds; ++round) {
    all = mesh_zero_set(intersect(field, quadric));
    const std::vector<Eigen::Vector3d> before = all.vertices;
    tbb::parallel_for(std::size_t{0}, all.vertices.size(), [&](std::size_t n) {
      all.vertices[n] = onto_surface(all.vertices[n], surface, quadric, options.wall_mm, field.spacing_mm);
    });
    std::size_t closed = 0;
    for (const std::size_t t : crossing_triangles(all))
      for (int k = 0; k < 3; ++k) closed += close_around(field, before[static_cast<std::size_t>(all.triangles[t][k])]);
    if (closed == 0) break;
    result.closed_samples += closed;
  }

  for (const Mesh& shell : split(all, connected_components(all))) {
    const double volume = signed_volume(shell);
    if (volume <= 0) {
      ++result.removed_islands;
      result.removed_mm3 -= volume;
    } else if (volume < options.min_cavity_mm3) {
      ++result.filled;
      result.filled_mm3 += volume;
    } else {
      ++result.cavities;
      append(result.mesh, shell);
    }
  }
  flip(result.mesh);
  return result;
}

bool follow_quadric(CavityMesh& cavity, const BlockField& field, const SurfaceQuery& surface, const Moments& q,
                    const CavityOptions& options) {
  const double h = field.spacing_mm;
  const Quadric quadric(q);
  std::vector<Eigen::Vector3d> moved = cavity.mesh.vertices;
  tbb::parallel_for(std::size_t{0}, moved.size(), [&](std::size_t n) {
    if (quadric.signed_distance(moved[n]) > -2 * h) moved[n] = onto_surface(moved[n], surface, quadric, options.wall_mm, h);
  });
  for (std::size_t n = 0; n < moved.size(); ++n)
    if ((moved[n] - cavity.mesh.vertices[n]).norm() > 0.5 * h) return false;
  cavity.mesh.vertices = std::move(moved);
  return true;
}

}  // namespace rayrep
