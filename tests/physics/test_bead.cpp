// Moments of beads: closed forms, and what they are integrals of.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "rayrep/mesh/mesh.h"
#include "rayrep/physics/bead.h"
#include "solids.h"

namespace rayrep::test {
namespace {

double deviation(const Moments& a, const Moments& b) { return (a - b).cwiseAbs().maxCoeff() / b.cwiseAbs().maxCoeff(); }

/// A box about its centre, turned about z.
Moments turned_box(const Eigen::Vector3d& centre, const Eigen::Vector3d& sizes, double turned_rad) {
  Moments s = Moments::Zero();
  s[M1] = sizes.prod();
  for (int k = 0; k < 3; ++k) s[MXX + k] = s[M1] * sizes[k] * sizes[k] / 12;
  const Eigen::Affine3d motion = Eigen::Translation3d(centre) * Eigen::AngleAxisd(turned_rad, Eigen::Vector3d::UnitZ());
  return moment_map(motion) * s;
}

TEST(Bead, IsABoxUnderTheNozzlesPath) {
  const double angle = 0.7;
  const Eigen::Vector3d from(12, -3, 4.2);
  const Eigen::Vector3d to = from + 25 * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0);
  const Bead bead{from, to, 25 * 0.45 * 0.2, 0.45, 0.2};
  const Moments box = turned_box(0.5 * (from + to) - Eigen::Vector3d(0, 0, 0.1), {25, 0.45, 0.2}, angle);
  EXPECT_LT(deviation(bead_moments(bead), box), 1e-14);
}

TEST(Bead, PiecesOfABeadAddUpToIt) {
  const Eigen::Vector3d a(1, 2, 3);
  const Eigen::Vector3d b(8, -4, 3.5);  // rises, as in a vase
  Moments sum = Moments::Zero();
  constexpr int pieces = 7;
  for (int n = 0; n < pieces; ++n)
    sum += bead_moments(Bead{a + (b - a) * n / pieces, a + (b - a) * (n + 1) / pieces, 2.0 / pieces, 0.5, 0.25});
  EXPECT_LT(deviation(sum, bead_moments(Bead{a, b, 2.0, 0.5, 0.25})), 1e-14);
}

TEST(Bead, ASquareRingIsABoxLessABox) {
  // Four beads round a square, each from corner to corner less one width, so that none overlaps.
  const double side = 20, w = 0.4, h = 0.2, z = 0.2;
  const double half = side / 2;
  Moments sum = Moments::Zero();
  const Eigen::Matrix3d quarter = Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  Eigen::Vector3d from(-half + w / 2, -half, z);
  Eigen::Vector3d to(half + w / 2, -half, z);
  for (int k = 0; k < 4; ++k) {
    sum += bead_moments(Bead{from, to, side * w * h, w, h});
    from = quarter * from;
    to = quarter * to;
  }
  const Eigen::Vector3d centre(0, 0, z - h / 2);
  const Moments ring = turned_box(centre, {side + w, side + w, h}, 0) - turned_box(centre, {side - w, side - w, h}, 0);
  EXPECT_LT(deviation(sum, ring), 1e-12);
}

TEST(Bead, ConcentricArcsMakeADisc) {
  const double w = 0.5, h = 0.3, top = 7.3;
  const Eigen::Vector2d centre(30, -12);
  constexpr int rings = 16;
  Moments sum = Moments::Zero();
  for (int n = 0; n < rings; ++n) {
    const double radius = (n + 0.5) * w;
    const double volume = 2 * std::numbers::pi * radius * w * h;
    // Some in two arcs, one way or the other.
    const double first = 1.1 * n;
    const double sweep = n % 2 ? 2 * std::numbers::pi : -2 * std::numbers::pi;
    sum += bead_moments(ArcBead{centre, radius, first, 0.3 * sweep, top, top, 0.3 * volume, w, h});
    sum += bead_moments(ArcBead{centre, radius, first + 0.3 * sweep, 0.7 * sweep, top, top, 0.7 * volume, w, h});
  }
  const double R = rings * w;
  Moments disc = Moments::Zero();
  disc[M1] = std::numbers::pi * R * R * h;
  disc[MXX] = disc[MYY] = disc[M1] * R * R / 4;
  disc[MZZ] = disc[M1] * h * h / 12;
  EXPECT_LT(deviation(sum, translated(disc, {centre.x(), centre.y(), top - h / 2})), 1e-12);
}

TEST(Bead, ArcIsTheLimitOfChords) {
  ArcBead arc{{3, 4}, 9, 0.4, 1.9, 2.0, 3.4, 5.0, 0.6, 0.2};
  double before = 0;
  for (const int pieces : {50, 100, 200}) {
    Moments sum = Moments::Zero();
    const auto at = [&](double t) {
      const double a = arc.from_rad + t * arc.sweep_rad;
      return Eigen::Vector3d(arc.centre_mm.x() + arc.radius_mm * std::cos(a), arc.centre_mm.y() + arc.radius_mm * std::sin(a),
                             arc.from_z_mm + t * (arc.to_z_mm - arc.from_z_mm));
    };
    for (int n = 0; n < pieces; ++n)
      sum += bead_moments(
          Bead{at(double(n) / pieces), at(double(n + 1) / pieces), arc.volume_mm3 / pieces, arc.width_mm, arc.height_mm});
    // A chord knows nothing of the annulus being longer outside: of the width's square over the radius, below 1e-3.
    const double off = deviation(sum, bead_moments(arc));
    EXPECT_LT(off, 1e-3);
    if (before > 0) {
      EXPECT_LT(off, 1.01 * before);
    }
    before = off;
  }
  arc.width_mm = 1e-6;
  Moments sum = Moments::Zero();
  constexpr int many = 4000;
  for (int n = 0; n < many; ++n) {
    const auto at = [&](int k) {
      const double a = arc.from_rad + arc.sweep_rad * k / many;
      return Eigen::Vector3d(3 + 9 * std::cos(a), 4 + 9 * std::sin(a), 2.0 + 1.4 * k / many);
    };
    sum += bead_moments(Bead{at(n), at(n + 1), arc.volume_mm3 / many, arc.width_mm, arc.height_mm});
  }
  EXPECT_LT(deviation(sum, bead_moments(arc)), 1e-7);
}

}  // namespace
}  // namespace rayrep::test
