#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "rayrep/mesh/clip.h"
#include "rayrep/mesh/section.h"
#include "rayrep/physics/moments.h"
#include "solids.h"

namespace rayrep::test {
namespace {

/// What lies above the plane and what lies below it.
std::pair<Mesh, Mesh> halves(const Mesh& mesh, const ClipPlane& plane) {
  return {clipped(mesh, plane), clipped(mesh, {-plane.normal, -plane.offset_mm})};
}

/// Of the triangles in that plane, whichever way they face.
double cap_area(const Mesh& mesh, int axis, double at) {
  double area = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    bool in_plane = true;
    for (int k = 0; k < 3; ++k) in_plane = in_plane && mesh.corner(t, k)[axis] == at;
    if (in_plane) area += 0.5 * (mesh.corner(t, 1) - mesh.corner(t, 0)).cross(mesh.corner(t, 2) - mesh.corner(t, 0)).norm();
  }
  return area;
}

double section_area(const Mesh& mesh, int axis, double at) {
  double area = 0;
  for (const SectionLoop& loop : section(transformed(mesh, Eigen::Affine3d(up_to_z(Eigen::Vector3d::Unit(axis)))), at))
    area += loop_moments(loop).area_mm2;
  return area;
}

TEST(Clip, HalvesAddUpToTheWhole) {
  const Mesh bodies[] = {icosphere(10, 4), torus(10, 3, 40, 20), cone(8, 12, 30),
                         hollow(box({0, 0, 0}, {10, 12, 14}), box({2, 2, 2}, {5, 7, 9})), staircase(5, 3)};
  for (const Mesh& body : bodies)
    for (std::uint64_t seed = 0; seed < 12; ++seed) {
      const Eigen::Vector3d n = random_rotation(seed).col(2);
      const double at_mm = n.dot(bounding_box(body).center()) + 0.37 * std::sin(static_cast<double>(seed)) * 5;
      const auto [above, below] = halves(body, {n, at_mm});
      EXPECT_TRUE(is_closed_solid(above));
      EXPECT_TRUE(is_closed_solid(below));
      EXPECT_TRUE(moments_near(mesh_moments(above) + mesh_moments(below), mesh_moments(body), 1e-12, 20));
      for (const Eigen::Vector3d& v : above.vertices) EXPECT_GE(n.dot(v), at_mm - 1e-12);
    }
}

TEST(Clip, OfASphereIsACap) {
  const double h = 3;
  const Moments cap = mesh_moments(clipped(icosphere(10, 6), {Eigen::Vector3d::UnitZ(), 10 - h}));
  EXPECT_NEAR(cap[M1], std::numbers::pi * h * h * (30 - h) / 3, 2e-3 * cap[M1]);
}

TEST(Clip, AtFacesInThePlaneTheySayWhatIsThere) {
  // Steps of 3: planes at their treads cut nothing but what lies below, and leave no sheet of the treads.
  const Mesh body = staircase(5, 3);
  const Eigen::AlignedBox3d box = bounding_box(body);
  const double whole = mesh_moments(body)[M1];
  for (int axis = 0; axis < 3; ++axis)
    for (double at = box.min()[axis]; at <= box.max()[axis]; at += 3) {
      const auto [above, below] = halves(body, {Eigen::Vector3d::Unit(axis), at});
      EXPECT_NEAR(mesh_moments(above)[M1] + mesh_moments(below)[M1], whole, 1e-9);
      for (const bool half_is_above : {true, false}) {
        const Mesh& half = half_is_above ? above : below;
        if (half.triangles.empty()) continue;
        EXPECT_TRUE(is_closed_solid(half));
        // No sheet without thickness: nothing faces its neighbour in the same plane.
        EXPECT_NEAR(cap_area(half, axis, at), section_area(body, axis, at + (half_is_above ? 1e-6 : -1e-6)), 1e-9);
      }
    }
}

TEST(Clip, KeepsWhatItDoesNotTouch) {
  const Mesh body = box({0, 0, 0}, {1, 2, 3});
  const Mesh all = clipped(body, {Eigen::Vector3d::UnitZ(), -1});
  EXPECT_EQ(all.triangles.size(), body.triangles.size());
  EXPECT_NEAR(mesh_moments(all)[M1], 6, 0);
  EXPECT_TRUE(clipped(body, {Eigen::Vector3d::UnitZ(), 3.5}).triangles.empty());
}

}  // namespace
}  // namespace rayrep::test
