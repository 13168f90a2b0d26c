#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "mesh/float32.h"

namespace rayrep {
namespace {

/// 24 binary digits, by arithmetic.
double rounded(double x) {
  int exponent = 0;
  const double digits = std::frexp(x, &exponent);
  return std::ldexp(std::nearbyint(std::ldexp(digits, 24)), exponent - 24);
}

TEST(Float32, KeepsTwentyFourDigitsOfEveryCoordinate) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> coordinate(-50, 50);
  Mesh mesh;
  for (int n = 0; n < 1000; ++n) {
    const double x = coordinate(random);
    const double y = coordinate(random);
    mesh.vertices.emplace_back(x, y, coordinate(random));
  }
  const Mesh stored = as_float32(mesh);
  for (std::size_t n = 0; n < mesh.vertices.size(); ++n) {
    const Eigen::Vector3d alone = as_float32(mesh.vertices[n]);
    for (int k = 0; k < 3; ++k) {
      const double wanted = rounded(mesh.vertices[n][k]);
      EXPECT_EQ(stored.vertices[n][k], wanted);
      EXPECT_EQ(alone[k], wanted);
      EXPECT_EQ(as_float32(mesh.vertices[n][k]), wanted);
    }
  }
}

}  // namespace
}  // namespace rayrep
