#include "rayrep/cavity.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

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

double signed_volume(const Mesh& shell) { return mesh_moments(shell)[M1]; }

}  // namespace

CavityMesh mesh_cavity(const BlockField& field, const SurfaceQuery& surface, const Moments& q, const CavityOptions& options) {
  const Quadric quadric(q);
  Mesh all = mesh_zero_set(intersect(field, quadric));
  tbb::parallel_for(std::size_t{0}, all.vertices.size(), [&](std::size_t n) {
    all.vertices[n] = onto_surface(all.vertices[n], surface, quadric, options.wall_mm, field.spacing_mm);
  });

  CavityMesh result;
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
