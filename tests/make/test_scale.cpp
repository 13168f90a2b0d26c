// Nothing in the chain from a mesh to a cavity knows what a millimetre is: the same shape s times as large, with all lengths that
// are set s times as large, gets the same cavity s times as large.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <string>
#include <variant>

#include "places.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/make/hollow.h"
#include "solids.h"

namespace rayrep {
namespace {

using namespace test;

Mesh example(const std::string& name) { return read_mesh(test::source_folder() / "examples" / (name + ".stl")).mesh; }

struct ScaleCase {
  const char* name;
  const char* mesh;
  Spec spec;
  int resolution = 50;
};

void PrintTo(const ScaleCase& c, std::ostream* out) { *out << c.name; }

/// The same wish for a body s times as large.
Spec at_scale(Spec spec, double s) {
  const auto longer = [s](auto& length) {
    if (length) *length *= s;
  };
  std::visit([s](auto& any) { any.print.wall_mm *= s; }, spec);
  if (auto* floats = std::get_if<FloatSpec>(&spec)) longer(floats->waterline_mm);
  if (auto* spins = std::get_if<SpinSpec>(&spec)) {
    spins->axis.point_mm *= s;
    longer(spins->centre_mm);
  }
  if (auto* stands = std::get_if<StandSpec>(&spec)) {
    longer(stands->target_mm);
    longer(stands->contact_tolerance_mm);
  }
  if (auto* target = std::get_if<TargetSpec>(&spec))
    for (int k = 0; k < 10; ++k)
      if (auto& wanted = target->wanted[static_cast<std::size_t>(k)])
        *wanted *= k == M1 ? s * s * s : k <= MZ ? s : s * s * s * s * s;
  return spec;
}

HollowResult made(const ScaleCase& c, double s) {
  HollowOptions options;
  options.resolution = c.resolution;
  options.min_cavity_mm3 *= s * s * s;
  return hollow(scaled(example(c.mesh), s), at_scale(c.spec, s), options);
}

class Scale : public ::testing::TestWithParam<ScaleCase> {};

void expect_the_same_but_for_exponents(const ScaleCase& c) {
  const HollowResult one = made(c, 1);
  const Mesh& body = one.delivery.body();
  for (const double s : {2.0, 0.25}) {
    const HollowResult other = made(c, s);
    const Mesh& mesh = other.delivery.body();
    ASSERT_EQ(mesh.triangles, body.triangles) << s;
    EXPECT_EQ(other.passes, one.passes);
    std::size_t different = 0;
    for (std::size_t n = 0; n < mesh.vertices.size(); ++n) different += mesh.vertices[n] != s * body.vertices[n];
    EXPECT_EQ(different, 0u) << "of " << mesh.vertices.size();
    EXPECT_EQ(mesh_moments(mesh)[M1], s * s * s * mesh_moments(body)[M1]);
  }
}

TEST_P(Scale, ByAPowerOfTwoChangesNoBitButTheExponents) { expect_the_same_but_for_exponents(GetParam()); }

/// With a wall so thick that the cavity's grid could be as fine as the rays: where it ends is said by the wall, not by millimetres.
TEST(ScaleOfTheGrid, IsThatOfTheWall) {
  FloatSpec thick;
  thick.print.wall_mm = 3;
  expect_the_same_but_for_exponents({"fine", "duck", thick, 320});
}

/// Of the samples on the cavity's grid, which are float32 in mm; the corners of the cavity lie on the true surfaces all the same.
/// Which triangles of the surface at the wall's distance are joined, where two ways are all but equal, changes with rounding, too.
TEST_P(Scale, ByAnyFactorChangesTheMassByItsCubeUpToRounding) {
  const HollowResult one = made(GetParam(), 1);
  const Mesh& body = one.delivery.body();
  for (const double s : {3.7, 0.61}) {
    const HollowResult other = made(GetParam(), s);
    const Mesh& mesh = other.delivery.body();
    const auto count = static_cast<double>(body.triangles.size());
    EXPECT_NEAR(static_cast<double>(mesh.triangles.size()), count, 0.02 * count);
    const Moments expected = mesh_moments(body).cwiseProduct(moment_units(s * s * s, s));
    const double error = mesh_moments(mesh)[M1] / expected[M1] - 1;
    EXPECT_LT(std::abs(error), 2e-4) << s;
    expect_moments_near(mesh_moments(mesh), expected, 2e-4, bounding_box(mesh).diagonal().norm());
  }
}

Spec spin(bool yoyo = false) {
  SpinSpec spec;
  spec.yoyo = yoyo;
  return spec;
}

Spec searched_spin() {
  SpinSpec spec;
  spec.axis.through = SpinAxis::Through::best;
  spec.max_tilt_rad = 0.2;
  return spec;
}

Spec stand() {
  StandSpec spec;
  spec.contact_tolerance_mm = 0.15;
  return spec;
}

Spec target() {
  TargetSpec spec;
  spec.wanted[M1] = 60;
  return spec;
}

INSTANTIATE_TEST_SUITE_P(Goals, Scale,
                         ::testing::Values(ScaleCase{"spin", "bird", spin()},
                                           ScaleCase{"spin_ellipsoid", "tilted_ellipsoid", spin()},
                                           ScaleCase{"yoyo", "robin", spin(true)},
                                           ScaleCase{"searched", "bird", searched_spin(), 40},
                                           ScaleCase{"float", "duck", FloatSpec{}}, ScaleCase{"stand", "teapot", stand()},
                                           ScaleCase{"target", "heart", target()}),
                         [](const auto& one) { return std::string(one.param.name); });

}  // namespace
}  // namespace rayrep
