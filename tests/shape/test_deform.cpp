#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "make/plan.h"
#include "make/spin_search.h"
#include "mesh/crossing.h"
#include "places.h"
#include "rayrep/base/error.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/judge/verify.h"
#include "rayrep/mesh/level_set.h"
#include "rayrep/mesh/mesh_check.h"
#include "rayrep/shape/deform.h"
#include "shape/outside.h"

namespace rayrep {
namespace {

using Eigen::Vector3d;

Mesh example(const std::string& name) {
  const auto path = test::source_folder() / "examples" / (name + ".stl");
  return check_mesh(read_mesh(path).mesh, {.self_intersections = false}).mesh;
}

HollowOptions with_rays(int resolution) {
  HollowOptions options;
  options.resolution = resolution;
  return options;
}

/// A smooth blob: an ellipsoid that is pushed out of shape, so that none of its axes is one of symmetry.
Mesh blob(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const Vector3d radii(29 + 3 * uniform(random), 18 + 3 * uniform(random), 22 + 4 * uniform(random));
  const Vector3d bump(14 * uniform(random), 14 * uniform(random), 16 * uniform(random));
  const double size = 9 + 3 * uniform(random);
  const auto field = [=](const Vector3d& p) {
    const double k = p.cwiseQuotient(radii).norm();
    const double ellipsoid = (k - 1) * radii.minCoeff();
    const double sphere = (p - 1.5 * bump).norm() - size;
    const double h = std::max(8 - std::abs(ellipsoid - sphere), 0.0) / 8;
    return std::min(ellipsoid, sphere) - h * h * h * 8 / 6;
  };
  const Eigen::AlignedBox3d box(Vector3d(-50, -50, -50), Vector3d(50, 50, 50));
  return mesh_implicit(field, box, 1.5);
}

Eigen::Affine3d frame_for(const Mesh& mesh, const Spec& spec) {
  Eigen::Affine3d frame = working_frame(mesh, up_of(spec));
  if (const auto* spin = std::get_if<SpinSpec>(&spec)) {
    const detail::SpinFrame axis = detail::spin_frame(mesh, *spin, detail::discretisation(spin->print, {}), {});
    frame.translation() = -(frame.linear() * axis.contact_mm);
  }
  return frame;
}

/// Smooth, and as large as its energy says.
detail::Handles random_motion(const detail::Cage& cage, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  detail::Handles force(cage.handles(), 3);
  for (Eigen::Index i = 0; i < force.size(); ++i) force.data()[i] = uniform(random);
  const detail::Handles motion = cage.compliant(force);
  return motion / std::sqrt(cage.energy(motion));
}

// ---------------------------------------------------------------------------------------------------------------- derivatives

/// Any direction of what is wanted in which a cut can be.
Eigen::VectorXd some_normal(const Spec& spec, Eigen::Index size) {
  Eigen::VectorXd normal = Eigen::VectorXd::Zero(size);
  if (std::holds_alternative<StandSpec>(spec)) {
    normal[0] = 0.8;
    normal[size / 2] = 0.6;
  } else if (std::holds_alternative<SpinSpec>(spec)) {
    // Two products of inertia, two static moments, and a matrix without negative eigenvalues.
    normal.head<4>() << 0.3, -0.5, 0.4, 0.6;
    normal.tail<3>() << 0.7, 0.4, 0.3;
  } else {
    normal << 0.2, 0.5, -0.6, 0.6;
  }
  return normal.normalized();
}

struct Case {
  unsigned body;
  const char* goal;
};

class Derivative : public testing::TestWithParam<Case> {};

TEST_P(Derivative, OfWhatIsAttainableAgreesWithDifferences) {
  const auto& [body, goal] = GetParam();
  Mesh mesh = blob(body);
  Spec spec;
  if (std::string(goal) == "stand") spec = StandSpec{};
  if (std::string(goal) == "spin") {
    SpinSpec spin;
    spin.axis.through = SpinAxis::Through::centre_of_mass;
    spec = spin;
  }
  if (std::string(goal) == "float") {
    FloatSpec floats;
    floats.submerged_volume_fraction = 0.55;
    spec = floats;
  }
  print_of(spec).wall_mm = 2;
  const Eigen::Affine3d frame = frame_for(mesh, spec);
  if (goal == std::string("stand"))  // a foot to stand on
    for (auto& v : mesh.vertices) v.z() = std::max(v.z(), 4 - frame.translation().z());
  HollowOptions options;
  DeformOptions how;
  how.resolution = std::string(goal) == "float" ? 600 : 300;  // the plane that cuts its cavity is seen by fewer rays
  detail::Outside outside({mesh, frame_for(mesh, spec), spec, options, how}, {});
  outside.ask(0.02, 0);
  const detail::Handles rest = detail::Handles::Zero(outside.cage().handles(), 3);
  const Eigen::Index size = outside.values();
  ASSERT_GT(size, 2);
  const detail::Look at_rest = outside.look(rest, {{some_normal(spec, size), 0, {}}});
  const detail::Cut& cut = at_rest.cuts.front();
  // Where it changes fastest, and that mixed with some other motion.
  detail::Handles steepest = outside.cage().compliant(cut.slope);
  steepest /= std::sqrt(outside.cage().energy(steepest));
  const detail::Handles motion = 0.8 * steepest + 0.6 * random_motion(outside.cage(), body);
  const auto difference = [&](double step_mm) {
    const double above = outside.look(rest + step_mm * motion, at_rest.cuts).cuts.front().value;
    const double below = outside.look(rest - step_mm * motion, at_rest.cuts).cuts.front().value;
    return (above - below) / (2 * step_mm);
  };
  const double differences = (4 * difference(0.4) - difference(0.8)) / 3;  // free of third derivatives
  EXPECT_NEAR(cut.slope.cwiseProduct(motion).sum() / differences, 1, 1e-3);
}

std::vector<Case> cases() {
  std::vector<Case> all;
  for (unsigned body = 1; body <= 5; ++body)
    for (const char* goal : {"stand", "spin", "float"}) all.push_back({body, goal});
  return all;
}

INSTANTIATE_TEST_SUITE_P(FiveBodies, Derivative, testing::ValuesIn(cases()),
                         [](const auto& tested) { return tested.param.goal + std::to_string(tested.param.body); });

// ----------------------------------------------------------------------------------------------------------------------- cages

bool same(const Vector3d& a, const Vector3d& b) { return std::memcmp(a.data(), b.data(), sizeof(double) * 3) == 0; }

TEST(Cage, HandlesAtRestLeaveEveryBit) {
  const Mesh mesh = example("bird");
  const Spec spec = SpinSpec{};
  detail::Outside outside({mesh, frame_for(mesh, spec), spec, {}, {}}, {});
  const Mesh moved = outside.deformed(detail::Handles::Zero(outside.cage().handles(), 3));
  ASSERT_EQ(moved.vertices.size(), mesh.vertices.size());
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) ASSERT_TRUE(same(moved.vertices[v], mesh.vertices[v])) << v;
}

TEST(Cage, WhatIsFixedDoesNotMove) {
  const Mesh mesh = example("bird");
  const Spec spec = SpinSpec{};
  Mesh cube = mesh_implicit([](const Vector3d& p) { return (p - Vector3d(0, -40, 28)).cwiseAbs().maxCoeff() - 9.2; },
                            {Vector3d(-20, -60, 10), Vector3d(20, -20, 50)}, 1);
  const Eigen::AlignedBox3d box(Vector3d(-50, 30, 0), Vector3d(50, 60, 60));
  DeformOptions how;
  how.fixed = {box, Ball3{{30, 0, 24}, 10}, cube};
  detail::Outside outside({mesh, frame_for(mesh, spec), spec, {}, how}, {});
  const Mesh moved = outside.deformed(8 * random_motion(outside.cage(), 3));
  std::size_t fixed = 0;
  std::size_t free = 0;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const Vector3d& p = mesh.vertices[v];
    const bool inside =
        box.contains(p) || (p - Vector3d(30, 0, 24)).norm() < 10 || (p - Vector3d(0, -40, 28)).cwiseAbs().maxCoeff() < 9;
    fixed += inside;
    free += !same(moved.vertices[v], p);
    if (inside) {
      EXPECT_TRUE(same(moved.vertices[v], p)) << p.transpose();
    }
  }
  EXPECT_GT(fixed, 100U);
  EXPECT_GT(free, mesh.vertices.size() / 4);
}

/// A fork whose two legs are 2 mm apart and joined at the top, 50 mm above their ends.
Mesh fork() {
  const auto field = [](const Vector3d& p) {
    const auto box = [&](const Vector3d& centre, const Vector3d& half) { return ((p - centre).cwiseAbs() - half).maxCoeff(); };
    return std::min({box({-5, 0, 25}, {4, 4, 25}), box({5, 0, 25}, {4, 4, 25}), box({0, 0, 55}, {9, 4, 6})});
  };
  return mesh_implicit(field, {Vector3d(-14, -9, -5), Vector3d(14, 9, 66)}, 0.9);
}

TEST(Cage, LegsThatAreNearButNotJoinedHaveHandlesOfTheirOwn) {
  const Mesh mesh = fork();
  const detail::Freedom free{std::vector<double>(mesh.vertices.size(), 1), std::vector<double>(mesh.vertices.size(), 1)};
  const detail::Cage cage(mesh, free, {.cell_mm = 9, .stiffness_mm = 8});
  int moving = 0;
  for (Eigen::Index h = 0; h < cage.handles(); ++h) {
    detail::Handles one = detail::Handles::Zero(cage.handles(), 3);
    one.row(h).setOnes();
    const std::vector<Vector3d> moved = cage.displacement(one);
    bool left = false;
    bool right = false;
    for (std::size_t v = 0; v < moved.size(); ++v)
      if (mesh.vertices[v].z() < 10 && moved[v].norm() > 0) (mesh.vertices[v].x() < 0 ? left : right) = true;
    EXPECT_FALSE(left && right) << h;
    moving += left || right;
  }
  EXPECT_GT(moving, 20);
  // Together they still are a partition of unity.
  const std::vector<Vector3d> moved = cage.displacement(detail::Handles::Ones(cage.handles(), 3));
  for (const Vector3d& u : moved) EXPECT_LT((u - Vector3d::Ones()).norm(), 1e-3);
}

TEST(Cage, CompliantMinimisesEnergyLessWork) {
  const Mesh mesh = fork();
  const detail::Freedom free{std::vector<double>(mesh.vertices.size(), 1), std::vector<double>(mesh.vertices.size(), 0.5)};
  detail::Cage cage(mesh, free, {.cell_mm = 12, .stiffness_mm = 8});
  detail::VertexGradient pull(mesh.vertices.size());
  for (std::size_t v = 0; v < pull.size(); ++v) pull[v] = 1e-3 * mesh.vertices[v].cross(Vector3d(1, 2, 3));
  const detail::Handles force = cage.pulled_back(pull);
  const detail::Handles least = cage.compliant(force);
  const auto value = [&](const detail::Handles& h) { return 0.5 * cage.energy(h) - force.cwiseProduct(h).sum(); };
  for (unsigned seed = 2; seed < 8; ++seed) {
    const detail::Handles other = random_motion(cage, seed);
    EXPECT_NEAR((value(least + other) + value(least - other)) / 2 - value(least), 0.5 * cage.energy(other),
                1e-6 * (1 + std::abs(value(least))));
    EXPECT_NEAR(value(least + other), value(least - other), 1e-6 * (1 + std::abs(value(least))));
  }
}

// ------------------------------------------------------------------------------------------------------------------ from end to
// end

TEST(Deform, ThreeSpheresStandOnWhatTheyTouchTheGroundWith) {
  const Mesh solid = example("three_spheres");
  const Spec spec = StandSpec{};
  const HollowOptions options = with_rays(100);
  EXPECT_THROW(hollow(solid, spec, options), Error);
  const Deformation deformation = deform(solid, spec, options, {.limit_mm = 8});
  EXPECT_TRUE(deformation.changed);
  EXPECT_FALSE(deformation.refusal.empty());
  EXPECT_GT(deformation.pressed_mm, 0);
  EXPECT_LE(deformation.largest_mm, 8);
  EXPECT_LT(deformation.rms_mm, 0.02 * deformation.diagonal_mm);
  const HollowResult result = hollow(deformation.mesh, spec, options);
  EXPECT_TRUE(verify(result.delivery, &deformation.mesh, result.spec).pass());
}

TEST(Deform, ADancingCoupleStands) {
  const Mesh solid = example("couple");
  const Spec spec = StandSpec{};
  const HollowOptions options = with_rays(80);
  const Deformation deformation = deform(solid, spec, options, {.limit_mm = 5});
  EXPECT_TRUE(deformation.changed);
  EXPECT_EQ(deformation.pressed_mm, 0);
  EXPECT_LT(deformation.rms_mm, 0.02 * deformation.diagonal_mm);
  EXPECT_TRUE(crossing_pairs(deformation.mesh, close_pairs(deformation.mesh)).empty());
  const HollowResult result = hollow(deformation.mesh, spec, options);
  EXPECT_TRUE(verify(result.delivery, &deformation.mesh, result.spec).pass());
}

TEST(Deform, ALimitThatIsTooSmallIsRefusedWithFigures) {
  try {
    deform(example("couple"), StandSpec{}, with_rays(60), {.limit_mm = 0.1, .resolution = 60});
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::goal);
    EXPECT_NE(std::string(error.what()).find("at most 0.10 mm (--deform-limit)"), std::string::npos) << error.what();
  }
}

TEST(Deform, WhatCanBeMetIsLeftAsItIs) {
  const Mesh solid = example("heart");
  const Deformation deformation = deform(solid, StandSpec{}, with_rays(60));
  EXPECT_FALSE(deformation.changed);
  for (std::size_t v = 0; v < solid.vertices.size(); ++v) ASSERT_TRUE(same(deformation.mesh.vertices[v], solid.vertices[v]));
}

TEST(Deform, WhatItIsNotForIsRefused) {
  FloatSpec hovers;
  hovers.submerged_fraction = 1;
  for (const Spec& spec : {Spec(TargetSpec{}), Spec(PoseSpec{}), Spec(hovers)}) EXPECT_THROW(deform(example("heart"), spec), Error);
  EXPECT_THROW(deform(example("heart"), StandSpec{}, {}, {.limit_mm = -1}), Error);
}

}  // namespace
}  // namespace rayrep
