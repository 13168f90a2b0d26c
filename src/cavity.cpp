#include "rayrep/cavity.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

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

/// Triangles that meet another one beyond a shared vertex or edge.
std::vector<std::size_t> crossing_triangles(const Mesh& mesh) {
  const auto pairs = SurfaceQuery(mesh).overlapping_boxes();
  std::vector<char> crosses(pairs.size());
  tbb::parallel_for(std::size_t{0}, pairs.size(), [&](std::size_t n) {
    const auto s = static_cast<std::size_t>(pairs[n].first);
    const auto t = static_cast<std::size_t>(pairs[n].second);
    const Eigen::Vector3d p[3] = {mesh.corner(s, 0), mesh.corner(s, 1), mesh.corner(s, 2)};
    const Eigen::Vector3d q[3] = {mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2)};
    crosses[n] = triangles_intersect(p, mesh.triangles[s], q, mesh.triangles[t]);
  });
  std::vector<std::size_t> triangles;
  for (std::size_t n = 0; n < pairs.size(); ++n)
    if (crosses[n]) {
      triangles.push_back(static_cast<std::size_t>(pairs[n].first));
      triangles.push_back(static_cast<std::size_t>(pairs[n].second));
    }
  std::sort(triangles.begin(), triangles.end());
  triangles.erase(std::unique(triangles.begin(), triangles.end()), triangles.end());
  return triangles;
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

}  // namespace

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

}  // namespace rayrep
