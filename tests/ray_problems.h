// Inner domains as ray-reps without any casting, random or from a field, with goals for them; and the part of a ray-rep where a
// quadric is negative, by clipping: the twin of RayIntegrals.

#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "rayrep/physics/moments.h"
#include "rayrep/rays/ray_interior.h"
#include "rayrep/rays/ray_rep.h"
#include "rayrep/solve/goals.h"
#include "solids.h"

namespace rayrep::test {

/// Calls intervals_at(xy) for every ray of the grid.
inline RayRep ray_rep(const RayGrid& grid, const std::function<std::vector<Interval>(const Eigen::Vector2d&)>& intervals_at) {
  RayRep rays{grid, {0}, {}};
  for (std::size_t ray = 0; ray < grid.size(); ++ray) {
    for (const Interval& interval : intervals_at(grid.at(ray))) rays.intervals.push_back(interval);
    rays.first.push_back(static_cast<std::uint32_t>(rays.intervals.size()));
  }
  return rays;
}

inline RayRep moved(RayRep rays, const Eigen::Vector3d& t) {
  rays.grid.origin_mm += t.head<2>();
  for (Interval& interval : rays.intervals) interval = {interval.lo + t.z(), interval.hi + t.z()};
  return rays;
}

/// The part of each interval where q.phi < 0: cut at the roots, in extended precision, and kept where the middle is negative.
inline RayRep negative_part(const RayRep& domain, const Moments& q) {
  RayRep part{domain.grid, {0}, {}};
  for (std::size_t ray = 0; ray < domain.grid.size(); ++ray) {
    const long double x = domain.grid.at(ray).x();
    const long double y = domain.grid.at(ray).y();
    const long double a = q[MZZ];
    const long double b = q[MZ] + x * q[MXZ] + y * q[MYZ];
    const long double c = q[M1] + x * (q[MX] + x * q[MXX] + y * q[MXY]) + y * (q[MY] + y * q[MYY]);
    const long double discriminant = b * b - 4 * a * c;
    std::vector<long double> roots;
    if (a != 0 && discriminant > 0)
      for (const int sign : {-1, 1}) roots.push_back((-b + sign * std::sqrt(discriminant)) / (2 * a));
    if (a == 0 && b != 0) roots.push_back(-c / b);
    for (std::uint32_t n = domain.first[ray]; n < domain.first[ray + 1]; ++n) {
      const Interval& interval = domain.intervals[n];
      std::vector<double> cuts = {interval.lo, interval.hi};
      for (const long double root : roots)
        cuts.push_back(static_cast<double>(std::clamp<long double>(root, interval.lo, interval.hi)));
      std::sort(cuts.begin(), cuts.end());
      for (std::size_t k = 0; k + 1 < cuts.size(); ++k) {
        const long double z = 0.5L * (static_cast<long double>(cuts[k]) + cuts[k + 1]);
        if (cuts[k] < cuts[k + 1] && c + z * (b + z * a) < 0) part.intervals.push_back({cuts[k], cuts[k + 1]});
      }
    }
    part.first.push_back(static_cast<std::uint32_t>(part.intervals.size()));
  }
  return part;
}

/// A body about to be hollowed: moments of what is fixed, and where material may go.
struct RayBody {
  RayRep domain;
  Moments shell;         ///< of the rest of the body
  double length_mm = 0;  ///< for scaling
  Moments solid() const { return shell + ray_moments(domain); }
};

/// { field < 0 } with its shell { -wall <= field < 0 }, both on the same rays, `across` of them in each direction over the box.
inline RayBody body_of_field(const std::function<double(const Eigen::Vector3d&)>& field, const Eigen::AlignedBox3d& box,
                             double wall_mm, int across) {
  RayGrid grid;
  grid.nx = grid.ny = across;
  grid.spacing_mm = box.sizes().head<2>().maxCoeff() / across;
  grid.origin_mm = box.center().head<2>().array() - 0.5 * (across - 1) * grid.spacing_mm;
  const auto rays = [&](double offset) {
    return ray_rep(grid, [&](const Eigen::Vector2d& xy) {
      constexpr int samples = 100;
      const auto at = [&](double z) { return field({xy.x(), xy.y(), z}) + offset; };
      std::vector<Interval> intervals;
      double below = box.min().z();
      bool inside = false;
      for (int n = 1; n <= samples; ++n) {
        const double above = box.min().z() + box.sizes().z() * n / samples;
        if ((n < samples && at(above) < 0) != inside) {
          double lo = below;
          double hi = above;
          for (int step = 0; step < 40; ++step) {
            const double middle = 0.5 * (lo + hi);
            ((at(middle) < 0) == inside ? lo : hi) = middle;
          }
          if (inside)
            intervals.back().hi = lo;
          else
            intervals.push_back({hi, hi});
          inside = !inside;
        }
        below = above;
      }
      return intervals;
    });
  };
  RayBody body{rays(wall_mm), Moments::Zero(), box.diagonal().norm()};
  body.shell = ray_moments(rays(0)) - ray_moments(body.domain);
  return body;
}

/// Infill takes a share of where a cavity would be.
inline void lighten(RayBody& body, double share) {
  body.shell += share * ray_moments(body.domain);
  body.domain.grid.weight = 1 - share;
}

/// One to four overlapping ellipsoids with a wall of 0.5 to 4 mm, about 50 mm in size, `across` rays over 104 mm. The origin is the
/// lowest point below the centre of mass, or up to 4 mm beside that, or near the centre of mass.
inline RayBody random_body(Random& random, int across) {
  struct Ellipsoid {
    Eigen::Vector3d centre, half;
    Eigen::Matrix3d axes;
  };
  RayGrid grid;
  grid.nx = grid.ny = across;
  grid.spacing_mm = 104.0 / across;
  grid.origin_mm.setConstant(-52 + 0.5 * grid.spacing_mm);
  for (;;) {
    std::vector<Ellipsoid> ellipsoids(1 + static_cast<std::size_t>(4 * random.uniform()));
    for (Ellipsoid& e : ellipsoids) {
      e.centre = random.in_box(ellipsoids.size() > 1 ? 20 : 0);
      e.half = Eigen::Vector3d::Constant(19) + random.in_box(11);
      e.axes = random_rotation(static_cast<std::uint64_t>(1e9 * random.uniform()));
    }
    const double wall = random.uniform(0.5, 4);
    const auto rays = [&](double smaller) {
      return ray_rep(grid, [&](const Eigen::Vector2d& xy) {
        std::vector<Interval> hits;
        for (const Ellipsoid& e : ellipsoids) {
          const Eigen::Matrix3d to_ball = (e.half.array() - smaller).inverse().matrix().asDiagonal() * e.axes.transpose();
          const Eigen::Vector3d o = to_ball * (Eigen::Vector3d(xy.x(), xy.y(), 0) - e.centre);
          const Eigen::Vector3d d = to_ball.col(2);
          const double discriminant = std::pow(o.dot(d), 2) - d.squaredNorm() * (o.squaredNorm() - 1);
          if (discriminant <= 0) continue;
          const double root = std::sqrt(discriminant);
          hits.push_back({(-o.dot(d) - root) / d.squaredNorm(), (-o.dot(d) + root) / d.squaredNorm()});
        }
        std::sort(hits.begin(), hits.end(), [](const Interval& a, const Interval& b) { return a.lo < b.lo; });
        std::vector<Interval> intervals;
        for (const Interval& hit : hits) {
          if (intervals.empty() || hit.lo > intervals.back().hi)
            intervals.push_back(hit);
          else
            intervals.back().hi = std::max(intervals.back().hi, hit.hi);
        }
        return intervals;
      });
    };
    const RayRep inner = rays(wall);
    if (inner.intervals.size() < 20) continue;
    const RayRep outer = rays(0);
    const Moments solid = ray_moments(outer);
    const Eigen::Vector3d centre = solid.segment<3>(MX) / solid[M1];
    Eigen::Vector3d origin = centre;
    const double choice = random.uniform();
    if (choice < 2.0 / 3)
      for (const Interval& interval : outer.intervals) origin.z() = std::min(origin.z(), interval.lo);
    if (choice > 1.0 / 3)
      origin += choice < 2.0 / 3 ? Eigen::Vector3d(random.in_box(4).cwiseProduct(Eigen::Vector3d(1, 1, 0))) : random.in_box(1);
    return {moved(inner, -origin), translated(solid - ray_moments(inner), -origin), 80};
  }
}

enum class Kind { floating, spin_largest, spin_smallest, spin_it, yoyo, standing };

inline Goal random_goal(Random& random, Kind kind, const RayBody& body) {
  const Moments solid = body.solid();
  const double volume = solid[M1];
  const auto near_the_centre = [&]() -> Eigen::Vector2d {
    return solid.segment<2>(MX) / volume + random.in_box(3 * random.uniform()).head<2>();
  };
  const auto spin = [&](const SpinWeights& weights, bool largest, bool yoyo) {
    return spin_goal(weights, largest, yoyo, volume, body.length_mm);
  };
  switch (kind) {
    case Kind::floating: {
      const double fill = random.uniform();
      return float_goal((1 - fill) * body.shell[M1] + fill * volume, near_the_centre(), body.length_mm);
    }
    case Kind::spin_largest:
      return spin({.lambda = random.uniform(), .gamma_c = 0, .gamma_i = 1}, true, false);
    case Kind::spin_smallest:
      return spin({.lambda = random.uniform(), .gamma_c = 0, .gamma_i = 1}, false, false);
    case Kind::spin_it:
      return spin({.lambda = 0, .gamma_c = 10 * random.uniform(), .gamma_i = 1}, true, false);
    case Kind::yoyo:
      return spin({.lambda = 0, .gamma_c = 0, .gamma_i = 1}, true, true);
    case Kind::standing:
      return stand_goal(near_the_centre(), volume, body.length_mm);
  }
  return {};
}

}  // namespace rayrep::test
