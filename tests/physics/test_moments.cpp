#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "rayrep/base/error.h"
#include "rayrep/physics/moments.h"
#include "solids.h"

namespace rayrep {
namespace {

using test::expect_moments_near;
using test::kPi;

// Second moments as a matrix: the integral of p p^T.
Eigen::Matrix3d second(const Moments& s) {
  Eigen::Matrix3d m;
  m << s[MXX], s[MXY], s[MXZ], s[MXY], s[MYY], s[MYZ], s[MXZ], s[MYZ], s[MZZ];
  return m;
}

// A body without any symmetry, with a cavity.
Mesh odd_body() {
  return test::hollow(test::rotated(test::uv_ellipsoid(5, 4, 3, 12, {1, 2, 3}), test::random_rotation(5)),
                      test::rotated(test::box({0, 1, 2}, {1.5, 3, 4}), test::random_rotation(5)));
}

// Least-squares slope of log(error) over log(h).
double slope(const std::vector<double>& h, const std::vector<double>& error) {
  const int n = static_cast<int>(h.size());
  Eigen::MatrixXd A(n, 2);
  Eigen::VectorXd b(n);
  for (int i = 0; i < n; ++i) {
    A.row(i) << std::log(h[i]), 1;
    b[i] = std::log(error[i]);
  }
  return A.colPivHouseholderQr().solve(b)[0];
}

TEST(Solids, AreClosedAndFaceOutward) {
  for (const Mesh& mesh :
       {test::box({-1, 2, 3}, {1, 5, 4}), test::unit_tetrahedron(), test::icosphere(2, 3, {1, 1, 1}),
        test::uv_ellipsoid(1, 2, 3, 7), test::torus(3, 1, 9, 7), test::cylinder(2, 3, 11), test::cone(2, 3, 11),
        test::frustum(1, 2, 3, 5), test::l_shape(2), test::staircase(4), odd_body(), test::soup(test::icosphere(1, 1)),
        test::merged({test::box({0, 0, 0}, {1, 1, 1}), test::icosphere(1, 1)})})
    EXPECT_TRUE(test::is_closed_solid(mesh));
}

TEST(Solids, TheMatcherSeesDefects) {
  Mesh open = test::icosphere(1, 1);
  open.triangles.pop_back();
  EXPECT_FALSE(test::is_closed_solid(open));
  EXPECT_FALSE(test::is_closed_solid(test::flipped(test::icosphere(1, 1))));
  Mesh turned = test::icosphere(1, 1);
  std::swap(turned.triangles[3][0], turned.triangles[3][1]);
  EXPECT_FALSE(test::is_closed_solid(turned));
  Moments s = Moments::Ones();
  s[MXY] += 1e-6;
  EXPECT_FALSE(test::moments_near(s, Moments::Ones(), 1e-7, 1));
}

TEST(Monomials, AreTheTenProductsInOrder) {
  Moments expected;
  expected << 1, 2, 3, 5, 4, 9, 25, 6, 15, 10;
  EXPECT_EQ(monomials({2, 3, 5}), expected);
}

TEST(Monomials, AQuadricIsItsTaylorSeries) {
  Moments q;
  q << 3, -1, 4, 1, -5, 9, 2, -6, 5, 3.5;
  const Eigen::Vector3d p(0.3, -1.2, 2.5);
  const Eigen::Vector3d d(-0.7, 0.4, 1.1);
  EXPECT_NEAR(quadric_value(q, Eigen::Vector3d::UnitX() * 2), 3 - 1 * 2 - 5 * 4, 1e-13);
  EXPECT_NEAR(quadric_value(q, p + d), quadric_value(q, p) + quadric_gradient(q, p).dot(d) + 0.5 * d.dot(quadric_hessian(q) * d),
              1e-12);
}

TEST(MeshMoments, UnitTetrahedron) {
  Moments expected;
  expected << 1. / 6, 1. / 24, 1. / 24, 1. / 24, 1. / 60, 1. / 60, 1. / 60, 1. / 120, 1. / 120, 1. / 120;
  expect_moments_near(mesh_moments(test::unit_tetrahedron()), expected, 1e-14, 1);
}

TEST(MassProperties, UnitTetrahedron) {
  const MassProperties body = mass_properties(mesh_moments(test::unit_tetrahedron()), 1000);  // 1 g/mm3
  EXPECT_NEAR(body.volume_mm3, 1. / 6, 1e-15);
  EXPECT_NEAR(body.mass_g, 1. / 6, 1e-15);
  EXPECT_TRUE(test::near(body.centre_of_mass_mm, Eigen::Vector3d::Constant(0.25), 1e-15));
  // The integral of y^2 + z^2 is 1/30; about the centre 1/30 - (1/6)(1/16 + 1/16) = 1/80. The integral of x y is 1/120; about
  // the centre 1/120 - 1/96 = -1/480, and the tensor holds its negative.
  Eigen::Matrix3d expected = Eigen::Matrix3d::Constant(1. / 480);
  expected.diagonal().setConstant(1. / 80);
  EXPECT_TRUE(test::near(body.inertia_g_mm2, expected, 1e-15));
  EXPECT_TRUE(test::near(body.principal_moments_g_mm2, Eigen::Vector3d(5. / 480, 5. / 480, 8. / 480), 1e-15));
}

TEST(MeshMoments, Box) {
  const Eigen::Vector3d min(-1, 2, -3);
  const Eigen::Vector3d max(3, 2.5, 4);
  expect_moments_near(mesh_moments(test::box(min, max)), test::box_moments(min, max), 1e-14, 8);
}

TEST(MeshMoments, EllipsoidConvergesWithTheSquareOfTheEdgeLength) {
  const Eigen::Vector3d centre(1, -2, 3);
  const Moments exact = test::ellipsoid_moments(2, 3, 4, centre);
  std::vector<std::vector<double>> errors(10);
  std::vector<double> h;
  for (const int n : {16, 32, 64, 128}) {
    h.push_back(1. / n);
    const Moments s = mesh_moments(test::uv_ellipsoid(2, 3, 4, n, centre));
    for (int k = 0; k < 10; ++k) errors[k].push_back(std::abs(s[k] - exact[k]) / std::abs(exact[k]));
  }
  for (int k = 0; k < 10; ++k) {
    EXPECT_NEAR(slope(h, errors[k]), 2, 0.02) << "moment " << k;
    EXPECT_LT(errors[k].back(), 1e-3) << "moment " << k;
  }
}

TEST(MeshMoments, TorusConvergesWithTheSquareOfTheEdgeLength) {
  const Moments exact = test::torus_moments(5, 2);
  std::vector<double> h;
  std::vector<std::vector<double>> errors(10);
  for (const int n : {16, 32, 64, 128}) {
    h.push_back(1. / n);
    const Moments s = mesh_moments(test::torus(5, 2, 2 * n, n));
    for (int k = 0; k < 10; ++k) errors[k].push_back(std::abs(s[k] - exact[k]));
  }
  for (const int k : {M1, MXX, MYY, MZZ}) EXPECT_NEAR(slope(h, errors[k]), 2, 0.02) << "moment " << k;
  for (const int k : {MX, MY, MZ, MXY, MYZ, MXZ}) EXPECT_LT(errors[k].back(), 1e-10 * exact[M1]) << "moment " << k;
}

TEST(MeshMoments, AddOverBodies) {
  const Mesh a = odd_body();
  const Mesh b = test::moved(test::torus(2, 0.5, 12, 8), {20, 0, 1});
  const Mesh c = test::icosphere(1, 2, {-4, 30, 2});
  expect_moments_near(mesh_moments(test::merged({a, b, c})), mesh_moments(a) + mesh_moments(b) + mesh_moments(c), 1e-13, 30);
}

TEST(MeshMoments, FlippedIsNegative) {
  const Mesh mesh = odd_body();
  EXPECT_TRUE(test::moments_near(mesh_moments(test::flipped(mesh)), -mesh_moments(mesh), 1e-14, 5));
}

TEST(MeshMoments, ScaleWithTheThirdFourthAndFifthPower) {
  const Mesh mesh = odd_body();
  const double s = 7.3;
  Moments expected = mesh_moments(mesh);
  expected *= s * s * s;
  expected.segment<3>(MX) *= s;
  expected.segment<6>(MXX) *= s * s;
  expect_moments_near(mesh_moments(test::scaled(mesh, s)), expected, 1e-14, 7 * s);
}

TEST(MeshMoments, RotateAsTensors) {
  const Mesh mesh = odd_body();
  const Moments s = mesh_moments(mesh);
  for (int seed = 1; seed <= 20; ++seed) {
    const Eigen::Matrix3d R = test::random_rotation(seed);
    const Moments r = mesh_moments(test::rotated(mesh, R));
    EXPECT_NEAR(r[M1], s[M1], 1e-13 * s[M1]);
    EXPECT_TRUE(test::near(r.segment<3>(MX), R * s.segment<3>(MX), 1e-12 * s[M1]));
    EXPECT_TRUE(test::near(second(r), R * second(s) * R.transpose(), 1e-11 * s[M1]));
    EXPECT_TRUE(test::near(mass_properties(r, 1.24).inertia_g_mm2, R * mass_properties(s, 1.24).inertia_g_mm2 * R.transpose(),
                           1e-12 * s[M1]));
  }
}

TEST(MeshMoments, TranslatedAgreesWithMovingTheMesh) {
  const Mesh mesh = odd_body();
  const Eigen::Vector3d t(3, -5, 7);
  expect_moments_near(mesh_moments(test::moved(mesh, t)), translated(mesh_moments(mesh), t), 1e-13, 12);
  expect_moments_near(translated(translated(mesh_moments(mesh), t), -t), mesh_moments(mesh), 1e-13, 12);
}

TEST(MassProperties, ObeyTheParallelAxisTheorem) {
  const Moments s = mesh_moments(odd_body());
  const MassProperties here = mass_properties(s, 1.24);
  const Eigen::Vector3d t(3, -5, 7);
  const MassProperties there = mass_properties(translated(s, t), 1.24);
  EXPECT_TRUE(test::near(there.centre_of_mass_mm, here.centre_of_mass_mm + t, 1e-13));
  EXPECT_TRUE(test::near(there.inertia_g_mm2, here.inertia_g_mm2, 1e-11 * here.inertia_g_mm2.norm()));
  // About the origin: I_0 = I_c + m (|c|^2 1 - c c^T), against the moments themselves.
  const Eigen::Vector3d c = here.centre_of_mass_mm;
  const Eigen::Matrix3d about_origin = 1.24e-3 * (second(s).trace() * Eigen::Matrix3d::Identity() - second(s));
  EXPECT_TRUE(test::near(about_origin,
                         here.inertia_g_mm2 + here.mass_g * (c.squaredNorm() * Eigen::Matrix3d::Identity() - c * c.transpose()),
                         1e-13 * about_origin.norm()));
}

TEST(MassProperties, PrincipalAxesDiagonaliseTheTensor) {
  for (int seed = 1; seed <= 20; ++seed) {
    const Eigen::Matrix3d R = test::random_rotation(seed);
    const MassProperties body = mass_properties(mesh_moments(test::rotated(test::box({-1, -2, -3}, {1, 2, 3}), R)), 2);
    const Eigen::Matrix3d Q = body.principal_axes;
    const double m = 2e-3 * 48;
    EXPECT_NEAR(body.mass_g, m, 1e-15);
    EXPECT_TRUE(test::near(body.principal_moments_g_mm2, m / 12 * Eigen::Vector3d(16 + 4, 36 + 4, 36 + 16), 1e-13));
    EXPECT_TRUE(
        test::near(Q.transpose() * body.inertia_g_mm2 * Q, Eigen::Matrix3d(body.principal_moments_g_mm2.asDiagonal()), 1e-13));
    EXPECT_NEAR(Q.determinant(), 1, 1e-13);
    EXPECT_NEAR(std::abs(Q.col(0).dot(R.col(2))), 1, 1e-13);  // the longest side has the smallest moment
    for (int k = 0; k < 2; ++k) {
      int largest = 0;
      Q.col(k).cwiseAbs().maxCoeff(&largest);
      EXPECT_GT(Q(largest, k), 0);
    }
  }
}

TEST(MeshMoments, FarFromTheOriginTheVolumeKeepsItsDigits) {
  const Mesh mesh = test::icosphere(1, 3);
  const Eigen::Vector3d t(1e6, -2e6, 3e6);
  const Mesh far = test::moved(mesh, t);  // coordinates are rounded to 5e-10 here: that is the accuracy to expect
  const Moments near = mesh_moments(mesh);
  const Moments s = mesh_moments(far);
  EXPECT_NEAR(s[M1] / near[M1], 1, 1e-9);
  EXPECT_TRUE(test::near(s.segment<3>(MX) / s[M1], t, 1e-9));
}

TEST(MassProperties, OfAMeshKeepTheirDigitsFarFromTheOrigin) {
  // A cube of 20 mm, 1 g/cm3: 8 g and 8 (20^2 + 20^2) / 12 g mm2, wherever its corners are held exactly.
  for (const double far : {0.0, 1e4, 1e6, 1e8, 1e12}) {
    const Eigen::Vector3d t(far, -far, 2 * far);
    const MassProperties body = mass_properties(test::box(t, t + Eigen::Vector3d(20, 20, 20)), 1);
    EXPECT_NEAR(body.mass_g, 8, 1e-12);
    EXPECT_TRUE(test::near(body.inertia_g_mm2, 8 * 800 / 12.0 * Eigen::Matrix3d::Identity(), 1e-10)) << far;
    EXPECT_TRUE(test::near(body.centre_of_mass_mm, t + Eigen::Vector3d(10, 10, 10), 1e-9)) << far;
  }
  const Mesh body = odd_body();
  const MassProperties direct = mass_properties(body, 1.24);
  const MassProperties by_moments = mass_properties(mesh_moments(body), 1.24);
  EXPECT_NEAR(direct.mass_g, by_moments.mass_g, 1e-12 * direct.mass_g);
  EXPECT_TRUE(test::near(direct.inertia_g_mm2, by_moments.inertia_g_mm2, 1e-10 * direct.inertia_g_mm2.norm()));
  EXPECT_THROW(mass_properties(Mesh(), 1), Error);
  EXPECT_THROW(mass_properties(test::flipped(body), 1), Error);
}

TEST(MeshMoments, CountsOverlapsTwiceAndNothingForNothing) {
  const Mesh cube = test::box({0, 0, 0}, {1, 1, 1});
  EXPECT_NEAR(mesh_moments(test::merged({cube, cube}))[M1], 2, 1e-15);
  EXPECT_EQ(mesh_moments(Mesh()), Moments::Zero());
}

TEST(MassProperties, RefuseWhatIsNotASolid) {
  const Moments s = mesh_moments(odd_body());
  Moments broken = s;
  broken[MXY] = std::numeric_limits<double>::quiet_NaN();
  for (const Moments& bad : {Moments(-s), Moments(Moments::Zero()), broken}) {
    try {
      mass_properties(bad, 1);
      ADD_FAILURE() << "no error";
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::input);
      EXPECT_NE(std::string(e.what()).find("mm3"), std::string::npos);
    }
  }
}

}  // namespace
}  // namespace rayrep
