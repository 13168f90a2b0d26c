// The meshes of examples/: sound, of the promised size, and exactly what tools/make_examples writes.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <string>

#include "example_shapes.h"
#include "places.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/mesh/mesh_check.h"
#include "rayrep/physics/moments.h"
#include "scene_shapes.h"

namespace rayrep {
namespace {

class Examples : public testing::TestWithParam<ExampleShape> {
protected:
  std::filesystem::path path() const { return test::source_folder() / "examples" / (GetParam().name + ".stl"); }
};

TEST_P(Examples, FileHoldsOneSoundSolid) {
  EXPECT_LT(std::filesystem::file_size(path()), 1'000'000u);
  const CheckedMesh checked = check_mesh(read_mesh(path()).mesh);
  const MeshReport& report = checked.report;
  EXPECT_TRUE(report.usable) << report.refusal;
  EXPECT_EQ(report.components, 1u);
  EXPECT_EQ(report.components_turned, 0u);
  EXPECT_EQ(report.triangles_turned, 0u);
  EXPECT_EQ(report.open_edges.count, 0u);
  EXPECT_EQ(report.non_manifold_edges.count, 0u);
  EXPECT_EQ(report.misoriented_edges.count, 0u);
  EXPECT_EQ(report.degenerate.count, 0u);
  EXPECT_EQ(report.self_intersections.count, 0u) << "first at " << report.self_intersections.first_mm.transpose();
  // Euler: V - E + F = 2 - 2 genus with 2 E = 3 F. Only the teapot and the couple's arms are rings.
  const auto vertices = static_cast<int>(checked.mesh.vertices.size());
  const auto triangles = static_cast<int>(checked.mesh.triangles.size());
  EXPECT_EQ(vertices - triangles / 2, GetParam().name == "teapot" || GetParam().name == "couple" ? 0 : 2);
}

TEST_P(Examples, FileHasThePromisedSizeAndPlace) {
  const Mesh mesh = read_mesh(path()).mesh;
  const Eigen::AlignedBox3d box = bounding_box(mesh);
  const double longest = box.sizes().maxCoeff();
  EXPECT_GE(longest, 60);
  EXPECT_LE(longest, 100);
  EXPECT_EQ(box.min().z(), 0);

  const MassProperties solid = mass_properties(mesh_moments(mesh), 1.0);
  const int across = GetParam().name == "three_spheres" ? 0 : 1;  // normal of the plane of symmetry
  EXPECT_NEAR(solid.centre_of_mass_mm[across], 0, 1e-3 * longest);
  // A top touches the ground on its axis.
  const std::set<std::string> tops = {"bird", "tilted_ellipsoid", "ellipsoid", "robin"};
  if (!tops.contains(GetParam().name)) return;
  for (const Eigen::Vector3d& p : mesh.vertices) {
    if (p.z() < 0.05) {
      EXPECT_LT(p.head<2>().norm(), 1.0) << p.transpose();
    }
  }
}

TEST_P(Examples, FileIsWhatTheGeneratorMakes) {
  const Mesh stored = read_mesh(path()).mesh;
  const Mesh made = as_stored(path(), mesh_example(GetParam()));
  ASSERT_EQ(stored.triangles.size(), made.triangles.size());
  // One step of float32 at 100 mm: another mathematics library may round the last bit differently.
  const double step_mm = std::ldexp(1.0, -17);
  double largest = 0;
  for (std::size_t t = 0; t < made.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k) largest = std::max(largest, (stored.corner(t, k) - made.corner(t, k)).cwiseAbs().maxCoeff());
  EXPECT_LE(largest, step_mm) << "run make_examples again, or undo the change of a shape";
}

INSTANTIATE_TEST_SUITE_P(All, Examples, testing::ValuesIn(example_shapes()),
                         [](const testing::TestParamInfo<ExampleShape>& shape) { return shape.param.name; });

TEST(SceneExamples, FilesAreSoundSolidsAndWhatTheGeneratorMakes) {
  for (const SceneShape& shape : scene_shapes()) {
    SCOPED_TRACE(shape.name);
    const std::filesystem::path path = test::source_folder() / "examples" / "scenes" / (shape.name + ".stl");
    const Mesh stored = read_mesh(path).mesh;
    const MeshReport report = check_mesh(stored).report;
    EXPECT_TRUE(report.usable) << report.refusal;
    EXPECT_EQ(report.components, 1u);
    EXPECT_EQ(report.open_edges.count + report.non_manifold_edges.count + report.self_intersections.count, 0u);
    const Mesh made = as_stored(path, shape.mesh);
    ASSERT_EQ(stored.triangles.size(), made.triangles.size());
    for (std::size_t t = 0; t < made.triangles.size(); ++t)
      for (int k = 0; k < 3; ++k) EXPECT_LE((stored.corner(t, k) - made.corner(t, k)).cwiseAbs().maxCoeff(), std::ldexp(1.0, -17));
  }
}

}  // namespace
}  // namespace rayrep
