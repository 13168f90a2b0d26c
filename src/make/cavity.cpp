#include "rayrep/make/cavity.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "make/cavity_mender.h"
#include "make/clipped_cavity.h"
#include "make/ridges.h"
#include "make/take_back.h"
#include "mesh/crossing.h"
#include "mesh/decimate.h"
#include "mesh/part.h"
#include "mesh/shells.h"
#include "rayrep/mesh/level_set.h"

namespace rayrep {
namespace {

constexpr int kSide = BlockField::kSide;

/// q.phi as a function of the point.
class FieldQuadric {
public:
  FieldQuadric(const Moments& q, double inset_mm)
      : q_(q), hessian_(quadric_hessian(q)), curvature_(hessian_.norm()), inset_(inset_mm) {}

  double value(const Eigen::Vector3d& p) const { return quadric_value(q_, p); }
  Eigen::Vector3d gradient(const Eigen::Vector3d& p) const { return q_.segment<3>(MX) + hessian_ * p; }

  /// First-order signed distance to the zero set, negative where the cavity is. With an inset no more than the distance, see
  /// mesh_cavity, less the inset.
  double signed_distance(const Eigen::Vector3d& p) const {
    const double slope = gradient(p).norm();
    const double v = value(p);
    if (inset_ > 0 && v > 0) return inset_ - 2 * v / (slope + std::sqrt(slope * slope + 2 * curvature_ * v));
    if (inset_ > 0) return slope > 0 ? inset_ - v / slope : HUGE_VAL;
    return slope > 0 ? -v / slope : v > 0 ? -HUGE_VAL : HUGE_VAL;
  }

  /// +1 when the whole ball is cavity, -1 when nothing of it is, 0 when that may change.
  int sign_in_ball(const Eigen::Vector3d& centre, double radius) const {
    const double v = value(centre);
    const double slope = gradient(centre).norm();
    const auto change = [&](double r) { return (slope + 0.5 * curvature_ * r) * r; };
    return v > change(radius + inset_) ? 1 : v < -change(radius) ? -1 : 0;
  }

private:
  Moments q_;
  Eigen::Matrix3d hessian_;
  double curvature_;
  double inset_;
};

/// max(wall + clearance - distance, signed distance of the quadric) on the grid of `wall`.
BlockField intersect(const BlockField& wall, const FieldQuadric& quadric, double clearance_mm) {
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
        for (float& sample : block) sample = std::min(sample + static_cast<float>(clearance_mm), static_cast<float>(wall.far()));
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

/// Of the triangles around each vertex, by their areas.
std::vector<double> averages_at_vertices(const Mesh& mesh, const std::vector<double>& of_triangles) {
  std::vector<double> sum(mesh.vertices.size(), 0);
  std::vector<double> area(mesh.vertices.size(), 0);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const double a = (mesh.corner(t, 1) - mesh.corner(t, 0)).cross(mesh.corner(t, 2) - mesh.corner(t, 0)).norm();
    for (const int v : mesh.triangles[t]) {
      area[v] += a;
      sum[v] += a * of_triangles[t];
    }
  }
  for (std::size_t n = 0; n < sum.size(); ++n) sum[n] = area[n] > 0 ? sum[n] / area[n] : 0;
  return sum;
}

/// Takes back moves that turn triangles: onto a surface with edges what contouring has cut off of one would come to lie over what
/// is there.
void take_back_turned(const Mesh& before, Mesh& mesh) {
  const auto turned = [&](std::size_t t) {
    constexpr double kLeast = 0.3;  // cosine between then and now
    const Eigen::Vector3d then = detail::twice_area(before, t), now = detail::twice_area(mesh, t);
    return !(now.dot(then) > kLeast * now.norm() * then.norm());
  };
  detail::take_back_where(turned, before, mesh);
}

/// Moves the vertices of a cavity onto its surfaces.
class Fitter {
public:
  Fitter(const SurfaceQuery& surface, const FieldQuadric& quadric, double wall_mm, double h)
      : surface_(surface), quadric_(quadric), wall_(wall_mm), h_(h) {}

  const SurfaceQuery& surface() const { return surface_; }
  const FieldQuadric& quadric() const { return quadric_; }

  /// Moves the vertices that are `chosen`, each within a cell of the true surface, onto it, and where triangles between them would
  /// cut into the wall a little beyond it.
  template <typename Chosen>
  void fit(Mesh& mesh, const Chosen& chosen) const {
    std::vector<ClosestPoint> wall(mesh.vertices.size());
    tbb::parallel_for(std::size_t{0}, mesh.vertices.size(), [&](std::size_t n) {
      if (chosen(mesh.vertices[n])) wall[n] = land(mesh.vertices[n], wall_, 1e-6 * h_);
    });
    const std::vector<double> needed = distances_needed(mesh, wall);
    tbb::parallel_for(std::size_t{0}, mesh.vertices.size(), [&](std::size_t n) {
      if (needed[n] > 0) land(mesh.vertices[n], needed[n], 1e-6 * h_);
    });
  }

  /// Moves the vertices of a mesh with large triangles onto the surface at the wall's distance, and then as much closer to the
  /// body, `most_mm` at most, as the triangles around them are farther from it on average, so that they are as far as that surface:
  /// where it bends evenly away from a triangle, that is 3/4 of what it is in the middle. Where that turns something over they
  /// stay.
  void fit_on_average(Mesh& mesh, double most_mm) const {
    const Mesh before = mesh;
    std::vector<ClosestPoint> wall(mesh.vertices.size());
    tbb::parallel_for(std::size_t{0}, wall.size(), [&](std::size_t n) { wall[n] = land(mesh.vertices[n], wall_, 0.01 * most_mm); });
    take_back_turned(before, mesh);
    std::vector<double> farther(mesh.triangles.size());
    tbb::parallel_for(std::size_t{0}, farther.size(), [&](std::size_t t) {
      const Eigen::Vector3d middle = (mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2)) / 3;
      const ClosestPoint closest = surface_.closest(middle, wall_ + 2 * h_, wall[mesh.triangles[t][0]].triangle);
      if (closest.triangle >= 0) farther[t] = 0.75 * (closest.distance_mm - wall_);
    });
    const std::vector<double> closer = averages_at_vertices(mesh, farther);
    for (std::size_t n = 0; n < wall.size(); ++n)
      if (wall[n].triangle >= 0 && wall[n].distance_mm > 0)
        mesh.vertices[n] += std::clamp(closer[n], 0.0, most_mm) / wall[n].distance_mm * (wall[n].point_mm - mesh.vertices[n]);
    take_back_turned(before, mesh);
  }

  /// Moves vertices that are within a cell of the surface at the wall's distance to within a hundredth of one, where that turns
  /// nothing over.
  void approach(Mesh& mesh) const {
    const Mesh before = mesh;
    tbb::parallel_for(std::size_t{0}, mesh.vertices.size(), [&](std::size_t n) {
      Eigen::Vector3d& p = mesh.vertices[n];
      const ClosestPoint closest = surface_.closest(p, wall_ + 2 * h_);
      if (closest.triangle >= 0 && closest.distance_mm > 0 && std::abs(wall_ - closest.distance_mm) <= h_)
        p += (wall_ / closest.distance_mm - 1) * (p - closest.point_mm);
    });
    take_back_turned(before, mesh);
  }

private:
  /// Moves p to where it is `distance_mm` from the surface, or on the quadric where that is farther inside the cavity, but for
  /// `error_mm`.
  /// @returns the surface's point closest to p; no triangle where it is out of reach or p was left where it was
  ClosestPoint land(Eigen::Vector3d& p, double distance_mm, double error_mm) const {
    const Eigen::Vector3d start = p;
    ClosestPoint closest;
    for (int iteration = 0; iteration < 12; ++iteration) {
      closest = surface_.closest(p, distance_mm + 2 * h_, closest.triangle);
      const double to_wall = closest.triangle < 0 ? -HUGE_VAL : distance_mm - closest.distance_mm;
      const double to_quadric = quadric_.signed_distance(p);
      const double worst = std::max(to_wall, to_quadric);
      if (iteration == 0 && worst < -h_) return {};  // where the cavity was closed by hand, neither surface is near
      if (std::abs(worst) < error_mm) break;
      if (to_wall >= to_quadric) {
        if (closest.distance_mm <= 0) break;
        p += (to_wall / closest.distance_mm) * (p - closest.point_mm);
      } else {
        p += to_quadric * quadric_.gradient(p).normalized();
      }
    }
    if ((p - start).norm() <= 2 * h_) return closest;
    p = start;
    return {};
  }

  /// How far from the surface each vertex has to be so that the triangles around it keep the wall; 0 where the wall is enough.
  /// Between two vertices whose closest points lie nearer together than they do the offset surface bulges into the cavity, by
  /// L (L - L') / 8 wall in the middle of an edge of length L, L' between the closest points, and 4/3 of that inside a triangle.
  std::vector<double> distances_needed(const Mesh& mesh, const std::vector<ClosestPoint>& wall) const {
    std::vector<double> needed(mesh.vertices.size(), 0.0);
    for (const auto& t : mesh.triangles)
      for (int k = 0; k < 3; ++k) {
        const auto a = static_cast<std::size_t>(t[k]);
        const auto b = static_cast<std::size_t>(t[(k + 1) % 3]);
        if (wall[a].triangle < 0 || wall[b].triangle < 0) continue;
        const double length = (mesh.vertices[a] - mesh.vertices[b]).norm();
        const double between = (wall[a].point_mm - wall[b].point_mm).norm();
        const double bulge = length * (length - between) / (6 * wall_);
        const double missing = wall_ + bulge - 0.5 * (wall[a].distance_mm + wall[b].distance_mm);
        if (bulge <= 0 || missing < 1e-3 * wall_) continue;
        for (const std::size_t n : {a, b}) needed[n] = std::max(needed[n], wall[n].distance_mm + missing);
      }
    return needed;
  }

  const SurfaceQuery& surface_;
  const FieldQuadric& quadric_;
  double wall_;
  double h_;
};

/// Takes out what is too small for a cavity, before any of it crosses: where two walls are nearly all that there is room for,
/// needles are left. theory.md (150)
Mesh take_specks(Mesh& all, double min_cavity_mm3) {
  constexpr double kSurely = 0.5;  // what is fitted is larger than what was meshed
  const Components shells = connected_components(all);
  const std::vector<double> volumes = shell_volumes(all, shells.of_triangle, shells.count);
  std::vector<int> kept, small;
  for (int t = 0; t < static_cast<int>(all.triangles.size()); ++t) {
    const double volume = volumes[static_cast<std::size_t>(shells.of_triangle[static_cast<std::size_t>(t)])];
    (volume > 0 && volume < kSurely * min_cavity_mm3 ? small : kept).push_back(t);
  }
  Mesh specks = part(all, small);
  if (!small.empty()) all = part(all, kept);
  return specks;
}

/// The zero set on its surfaces, lighter if there is an error for that, crossing triangles closed in `field` as far as that helps.
detail::OffsetSurface sound_surface(BlockField& field, const Fitter& fitter, const CavityOptions& options,
                                    const detail::Lighter& lighter, CavityMesh& result) {
  constexpr int max_rounds = 8;
  const SurfaceQuery& surface = fitter.surface();
  const double chord_error_mm = lighter.chord_error_mm;
  const detail::CavityMender mender(surface, options);
  detail::OffsetSurface sound;
  Mesh& all = sound.mesh;
  for (int round = 0; round < max_rounds; ++round) {
    all = mesh_zero_set(intersect(field, fitter.quadric(), options.clearance_mm));
    sound.specks = take_specks(all, options.min_cavity_mm3);
    std::vector<Eigen::Vector3d> before = all.vertices;
    if (chord_error_mm > 0) {
      if (options.sharp_ridges) {
        fitter.approach(all);
        detail::sharpen_ridges(all, surface, options.least_distance_mm(), field.spacing_mm);
      }
      DecimatedMesh few = decimated(all, {chord_error_mm, options.as_delivered});
      all = std::move(few.mesh);
      for (std::size_t n = 0; n < few.kept.size(); ++n) before[n] = before[static_cast<std::size_t>(few.kept[n])];
      fitter.fit_on_average(all, 0.5 * chord_error_mm);  // less than what the mender lets the wall lack
    } else {
      fitter.fit(all, [](const Eigen::Vector3d&) { return true; });
      if (options.sharp_ridges) detail::sharpen_ridges(all, surface, options.least_distance_mm(), field.spacing_mm);
    }
    std::vector<char> needed(all.vertices.size());
    std::transform(all.vertices.begin(), all.vertices.end(), needed.begin(), lighter.needs);
    const std::vector<std::size_t> crossing = mender.mend(all, needed, needed);
    result.crossing = crossing.size();
    std::size_t closed = 0;
    for (const std::size_t t : crossing)
      for (int k = 0; k < 3; ++k) closed += detail::close_around(field, before[static_cast<std::size_t>(all.triangles[t][k])]);
    if (closed == 0) break;
    result.closed_samples += closed;
  }
  fitter.fit(sound.specks, [](const Eigen::Vector3d&) { return true; });
  return sound;
}

double signed_volume(const Mesh& shell) { return mesh_moments(shell)[M1]; }

}  // namespace

std::vector<std::size_t> crossing_triangles(const Mesh& mesh) { return triangles_of(crossing_pairs(mesh, close_pairs(mesh))); }

std::size_t detail::close_around(BlockField& field, const Eigen::Vector3d& p) {
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

detail::OffsetSurface detail::offset_surface(BlockField& field, const SurfaceQuery& surface, const CavityOptions& options,
                                             const Lighter& lighter, CavityMesh& result) {
  Moments everywhere = Moments::Zero();
  everywhere[M1] = 1;
  const FieldQuadric quadric(everywhere, 0);
  return sound_surface(field, {surface, quadric, options.least_distance_mm(), field.spacing_mm}, options, lighter, result);
}

void detail::take_shells(const Mesh& all, const CavityOptions& options, CavityMesh& result) {
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
}

CavityMesh mesh_cavity(BlockField& field, const SurfaceQuery& surface, const Moments& q, const CavityOptions& options) {
  CavityMesh result;
  const FieldQuadric quadric(q, options.inset_mm);
  const Fitter fitter(surface, quadric, options.least_distance_mm(), field.spacing_mm);
  detail::OffsetSurface sound = sound_surface(field, fitter, options, {}, result);
  append(sound.mesh, sound.specks);
  detail::take_shells(sound.mesh, options, result);
  return result;
}

bool follow_quadric(CavityMesh& cavity, const BlockField& field, const SurfaceQuery& surface, const Moments& q,
                    const CavityOptions& options) {
  const double h = field.spacing_mm;
  const FieldQuadric quadric(q, options.inset_mm);
  Mesh moved = cavity.mesh;
  // With one more step around what may move, so that triangles between the moved and the others are looked at too.
  Fitter(surface, quadric, options.least_distance_mm(), h).fit(moved, [&](const Eigen::Vector3d& p) {
    return quadric.signed_distance(p) > -3 * h;
  });
  std::vector<char> changed(moved.vertices.size());
  for (std::size_t n = 0; n < moved.vertices.size(); ++n) {
    const double by = (moved.vertices[n] - cavity.mesh.vertices[n]).norm();
    if (by > 0.5 * h) return false;
    changed[n] = by > 0 || cavity.crossing > 0;
  }
  cavity.crossing = detail::CavityMender(surface, options).mend(moved, std::move(changed)).size();
  cavity.mesh = std::move(moved);
  return true;
}

}  // namespace rayrep
