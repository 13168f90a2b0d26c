#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "base/linear_algebra.h"
#include "physics/clipped_hull.h"
#include "rayrep/physics/hydrostatics.h"
#include "shape/wish.h"

namespace rayrep::detail {
namespace {

/// A function a + b.p over the wet surface and, over the rim of the waterplane, c times the square of the distance from an axis.
struct WetFunctional {
  double constant = 0;
  Eigen::Vector3d linear = Eigen::Vector3d::Zero();
  double of_rim = 0;
};

/// Wet surface and waterplane of a body by its own triangles. (Dry pockets are not known here: a cockpit counts as flooded.)
class Wet {
public:
  Wet(const Mesh& mesh, double plane_mm) : mesh_(mesh), plane_mm_(plane_mm) {
    Integrals sum;
    for_each_rim([&](std::size_t, const std::array<Eigen::Vector3d, 2>& ends, const auto&) {
      sum.add_rim(ends[0].head<2>(), ends[1].head<2>());
    });
    if (!(sum.area > 0)) return;
    centre_ = sum.area_first / sum.area;
    const SymmetricEigen second = symmetric_eigen(central_second_moments(sum));
    axis_ = second.vectors.col(0);
    second_moment_mm4_ = second.values[0];
    area_mm2_ = sum.area;
  }

  double area_mm2() const { return area_mm2_; }
  const Eigen::Vector2d& centre() const { return centre_; }
  double second_moment_mm4() const { return second_moment_mm4_; }

  /// Adds the change of the integrals of f with the surface, the plane at rest.
  void add(const WetFunctional& f, VertexGradient& gradient) const {
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) add_triangle(t, f, gradient);
    if (f.of_rim == 0) return;
    for_each_rim([&](std::size_t t, const std::array<Eigen::Vector3d, 2>& ends, const std::array<Eigen::Vector3d, 2>& weights) {
      const Eigen::Vector3d normal = normal_of(t);
      const double length = (ends[1] - ends[0]).norm() / normal.head<2>().norm();
      for (const auto& [at, share] : kGauss) {
        const Eigen::Vector3d p = (1 - at) * ends[0] + at * ends[1];
        const Eigen::Vector3d w = (1 - at) * weights[0] + at * weights[1];
        const double value = f.of_rim * share * length * std::pow(axis_.dot(p.head<2>() - centre_), 2);
        for (int k = 0; k < 3; ++k) gradient[static_cast<std::size_t>(mesh_.triangles[t][k])] += value * w[k] * normal;
      }
    });
  }

  /// And with the height of the plane.
  double per_height(const WetFunctional& f) const {
    double sum = area_mm2_ * (f.constant + f.linear.dot(Eigen::Vector3d(centre_.x(), centre_.y(), plane_mm_)));
    for_each_rim([&](std::size_t t, const std::array<Eigen::Vector3d, 2>& ends, const auto&) {
      const Eigen::Vector3d normal = normal_of(t);
      const double length = (ends[1] - ends[0]).norm() / normal.head<2>().norm();
      for (const auto& [at, share] : kGauss) {
        const Eigen::Vector3d p = (1 - at) * ends[0] + at * ends[1];
        sum -= f.of_rim * share * length * normal.z() * std::pow(axis_.dot(p.head<2>() - centre_), 2);
      }
    });
    return sum;
  }

private:
  static constexpr double kRoot = 0.7745966692414834;  // of 3/5
  static constexpr std::array<std::pair<double, double>, 3> kGauss = {
      std::pair{0.5 - 0.5 * kRoot, 5.0 / 18}, std::pair{0.5, 8.0 / 18}, std::pair{0.5 + 0.5 * kRoot, 5.0 / 18}};

  Eigen::Vector3d normal_of(std::size_t t) const {
    return (mesh_.corner(t, 1) - mesh_.corner(t, 0)).cross(mesh_.corner(t, 2) - mesh_.corner(t, 0)).normalized();
  }

  bool wet(std::size_t t, int k) const { return mesh_.corner(t, k).z() < plane_mm_; }

  /// Where the plane crosses the edge from corner k on, as weights of the corners.
  Eigen::Vector3d crossing(std::size_t t, int k) const {
    const int next = (k + 1) % 3;
    const double a = mesh_.corner(t, k).z() - plane_mm_;
    const double b = mesh_.corner(t, next).z() - plane_mm_;
    Eigen::Vector3d weights = Eigen::Vector3d::Zero();
    weights[k] = b / (b - a);
    weights[next] = a / (a - b);
    return weights;
  }

  Eigen::Vector3d at(std::size_t t, const Eigen::Vector3d& weights) const {
    return weights[0] * mesh_.corner(t, 0) + weights[1] * mesh_.corner(t, 1) + weights[2] * mesh_.corner(t, 2);
  }

  /// visit(t, ends, their weights) for each triangle's part of the rim, counter-clockwise seen from above.
  template <typename Visit>
  void for_each_rim(const Visit& visit) const {
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      std::array<Eigen::Vector3d, 2> weights;
      int found = 0;
      for (int k = 0; k < 3; ++k)
        if (wet(t, k) != wet(t, (k + 1) % 3)) {
          weights[wet(t, k) ? 1 : 0] = crossing(t, k);
          ++found;
        }
      if (found == 2) visit(t, std::array{at(t, weights[0]), at(t, weights[1])}, weights);
    }
  }

  void add_triangle(std::size_t t, const WetFunctional& f, VertexGradient& gradient) const {
    std::array<Eigen::Vector3d, 4> polygon;  // weights of the corners
    std::size_t n = 0;
    for (int k = 0; k < 3; ++k) {
      if (wet(t, k)) polygon[n++] = Eigen::Vector3d::Unit(k);
      if (wet(t, k) != wet(t, (k + 1) % 3)) polygon[n++] = crossing(t, k);
    }
    for (std::size_t m = 1; m + 1 < n; ++m) {
      const std::array<Eigen::Vector3d, 3> corner = {polygon[0], polygon[m], polygon[m + 1]};
      const Eigen::Vector3d a = at(t, corner[0]);
      const Eigen::Vector3d area = 0.5 * (at(t, corner[1]) - a).cross(at(t, corner[2]) - a);
      for (std::size_t k = 0; k < 3; ++k) {  // middles of the sides: exact for quadratic functions
        const Eigen::Vector3d w = 0.5 * (corner[k] + corner[(k + 1) % 3]);
        const double value = (f.constant + f.linear.dot(at(t, w))) / 3;
        for (int c = 0; c < 3; ++c) gradient[static_cast<std::size_t>(mesh_.triangles[t][c])] += value * w[c] * area;
      }
    }
  }

  const Mesh& mesh_;
  double plane_mm_;
  double area_mm2_ = 0;
  double second_moment_mm4_ = 0;
  Eigen::Vector2d centre_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d axis_ = Eigen::Vector2d::UnitX();
};

/// It weighs what it displaces, is balanced, and its metacentric height is large enough. theory.md (62c)
class FloatWisher final : public Wisher {
public:
  FloatWisher(const FloatSpec& spec, double margin, const Body& first)
      : spec_(spec),
        volumes_(spec.print.density_g_cm3 / spec.fluid_g_cm3),
        least_height_mm_(margin * first.height_mm),
        volume_mm3_(first.solid[M1]),
        length_mm_(first.diagonal_mm) {}

  Wish wish(const Body& body) const override {
    const PreparedHull hull(body.hull);
    const Plane plane = plane_of(body, hull);
    const Hydrostatics water = hydrostatics(hull, {Eigen::Vector3d::UnitZ(), plane.height_mm});
    Wish wish;
    wish.wanted = wanted(water);
    wish.add_explicit = [this, &body, plane, water](const Moments&, const Eigen::VectorXd& normal, const Moments& s,
                                                    VertexGradient& gradient) {
      const Wet wet(body.working, plane.height_mm);
      const double unit = 1 / (volume_mm3_ * length_mm_);
      const double displaced = water.displaced_volume_mm3;
      const Eigen::Vector3d& b = water.centre_of_buoyancy_mm;
      WetFunctional f;
      f.linear = -unit * s[M1] / displaced * normal.segment<3>(1);
      f.of_rim = f.linear.z();
      f.constant =
          -normal[0] / (volumes_ * volume_mm3_) - f.linear.dot(b) - f.linear.z() * water.smallest_second_moment_mm4 / displaced;
      wet.add(f, gradient);
      plane.add(wet.per_height(f), wet, gradient);
    };
    return wish;
  }

  void hold(const Mesh&, double, Freedom&) const override {}

private:
  struct Plane {
    double height_mm = 0;
    /// Adds what comes of the plane's motion with the outside. @param per_mm  of its height
    std::function<void(double per_mm, const Wet& wet, VertexGradient& gradient)> add;
  };

  Wanted wanted(const Hydrostatics& water) const {
    const double unit = 1 / (volume_mm3_ * length_mm_);
    const Eigen::Vector3d& b = water.centre_of_buoyancy_mm;
    Wanted wanted;
    wanted.equations = 3;
    wanted.rows = Eigen::Matrix<double, Eigen::Dynamic, 10>::Zero(4, 10);
    wanted.offset = Eigen::VectorXd::Zero(4);
    wanted.rows(0, M1) = 1 / volume_mm3_;
    wanted.offset[0] = -water.displaced_volume_mm3 / volumes_ / volume_mm3_;
    for (int k = 0; k < 3; ++k) {
      wanted.rows(1 + k, MX + k) = unit;
      wanted.rows(1 + k, M1) = -unit * b[k];
    }
    wanted.rows(3, M1) -= unit * (water.metacentric_radius_mm() - least_height_mm_);
    return wanted;
  }

  Plane plane_of(const Body& body, const PreparedHull& hull) const {
    const Mesh& mesh = body.working;
    const auto lower = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) { return a.z() < b.z(); };
    const auto [low, high] = std::minmax_element(mesh.vertices.begin(), mesh.vertices.end(), lower);
    const auto lowest = static_cast<std::size_t>(low - mesh.vertices.begin());
    const auto highest = static_cast<std::size_t>(high - mesh.vertices.begin());
    if (spec_.submerged_volume_fraction) {
      const double part = *spec_.submerged_volume_fraction;
      const double height = waterline_for_volume(hull, Eigen::Vector3d::UnitZ(), part * mesh_moments(body.hull)[M1]);
      return {height, [&mesh, part](double per_mm, const Wet& wet, VertexGradient& gradient) {
                const std::vector<char> all(mesh.triangles.size(), 1);
                add_outer(mesh, all, part * per_mm / wet.area_mm2() * Moments::Unit(M1), gradient);
                wet.add({.constant = -per_mm / wet.area_mm2()}, gradient);
              }};
    }
    if (!spec_.waterline_mm && !spec_.submerged_fraction) return {best_plane(body, hull), [](double, const auto&, auto&) {}};
    const double part = spec_.submerged_fraction.value_or(0);
    const double above = spec_.waterline_mm.value_or(0);
    const double height = (1 - part) * low->z() + part * high->z() + above;
    return {height, [lowest, highest, part](double per_mm, const Wet&, VertexGradient& gradient) {
              gradient[lowest].z() += (1 - part) * per_mm;
              gradient[highest].z() += part * per_mm;
            }};
  }

  /// Where least is missing; of several with nothing missing the one in the middle.
  double best_plane(const Body& body, const PreparedHull& hull) const {
    constexpr int steps = 24;
    const Eigen::AlignedBox3d box = bounding_box(body.working);
    const double most = (1 - spec_.reserve) * mesh_moments(body.hull)[M1];
    const auto missing = [&](double height) {
      const Hydrostatics water = hydrostatics(hull, {Eigen::Vector3d::UnitZ(), height});
      if (!(water.displaced_volume_mm3 > 0)) return std::numeric_limits<double>::infinity();
      const double deep = std::max(0.0, water.displaced_volume_mm3 / most - 1);
      return deep + shortfall(wanted(water), *body.integrals, body.shell, 1e-7).distance;
    };
    const auto height = [&](double n) { return box.min().z() + n / steps * box.sizes().z(); };
    std::array<double, steps> found{};
    int best = 1;
    for (int n = 1; n < steps; ++n) {
      found[static_cast<std::size_t>(n)] = missing(height(n));
      if (found[static_cast<std::size_t>(n)] < found[static_cast<std::size_t>(best)]) best = n;
    }
    int last = best;
    while (last + 1 < steps && found[static_cast<std::size_t>(last + 1)] < 1e-7) ++last;
    if (last > best) return height(0.5 * (best + last));
    double step = 0.5;
    double at = best;
    double least = found[static_cast<std::size_t>(best)];
    for (; step > 0.01; step *= 0.5)
      for (const double n : {at - step, at + step})
        if (const double value = missing(height(n)); value < least) {
          least = value;
          at = n;
        }
    return height(at);
  }

  FloatSpec spec_;
  double volumes_;  ///< displaced by one of material
  double least_height_mm_;
  double volume_mm3_;
  double length_mm_;
};

}  // namespace

std::unique_ptr<Wisher> wisher(const FloatSpec& spec, double margin, const Body& first) {
  return std::make_unique<FloatWisher>(spec, margin, first);
}

}  // namespace rayrep::detail
