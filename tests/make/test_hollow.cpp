#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <filesystem>
#include <ostream>

#include "places.h"
#include "rayrep/base/error.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/judge/verify.h"
#include "rayrep/make/hollow.h"
#include "rayrep/make/waterline.h"
#include "rayrep/mesh/mesh_check.h"
#include "runs.h"
#include "solids.h"

namespace rayrep {
namespace {

using namespace test;

/// Runs hollow_float with float32 storage and judges the result; a mesh that fails stays in the temporary folder.
void expect_floats(const Mesh& solid, const Job<FloatSpec>& options, const std::string& name) {
  Job<FloatSpec> stored = options;
  stored.hollow.as_stored = [](const Mesh& mesh) { return as_stored("x.stl", mesh); };
  const Outcome<FloatSpec> result = hollowed(solid, stored);
  EXPECT_EQ(result.cast.bad, 0u);
  EXPECT_EQ(result.solve.status, SolveStatus::converged) << result.solve.solver_status;
  ASSERT_TRUE(result.duality_gap);
  EXPECT_LT(*result.duality_gap, 1e-6);
  EXPECT_GT(*result.duality_gap, -1e-7);
  const auto path = own_file(name + ".stl");
  write_mesh(path, result.delivery.body());
  const FloatVerdict verdict = verify(read_mesh(path).mesh, &solid, result.found);
  for (const Criterion& c : verdict.criteria)
    EXPECT_TRUE(c.pass()) << path << ": " << c.name << " " << c.value << " limit " << c.limit;
  EXPECT_LT(verdict.state.mass_error, 1e-4);
  EXPECT_LT(verdict.state.horizontal_offset_mm, 1e-3);
  if (verdict.pass()) std::filesystem::remove(path);
}

Job<FloatSpec> coarse() {
  Job<FloatSpec> options;
  options.hollow.resolution = 60;
  return options;
}

TEST(HollowFloat, AnEllipsoidOffItsAxes) {
  expect_floats(
      rotated(uv_ellipsoid(30, 22, 16, 32), Eigen::AngleAxisd(0.2, Eigen::Vector3d(1, 2, 0).normalized()).toRotationMatrix()),
      coarse(), "ellipsoid");
}

TEST(HollowFloat, AtAGivenWaterlineInOtherFluidsAndMaterials) {
  const Mesh solid = moved(
      rotated(uv_ellipsoid(30, 22, 16, 32), Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitX()).toRotationMatrix()), {100, -50, 30});
  Job<FloatSpec> options = coarse();
  options.spec.submerged_fraction = 0.5;
  expect_floats(solid, options, "half");
  options.spec.fluid_g_cm3 = 1.025;
  options.spec.print.density_g_cm3 = 1.14;
  expect_floats(solid, options, "sea");
}

TEST(HollowFloat, AlongAnyUpDirection) {
  const Mesh solid = uv_ellipsoid(30, 22, 16, 32);
  for (const Eigen::Vector3d& up : {Eigen::Vector3d(0, 0, -1), Eigen::Vector3d(0.2, 0.1, -2)}) {
    Job<FloatSpec> options = coarse();
    options.spec.up = up;
    options.spec.submerged_fraction = 0.5;
    expect_floats(solid, options, "up");
  }
}

TEST(HollowFloat, OverlappingComponents) {
  const Mesh catamaran =
      merged({uv_ellipsoid(40, 10, 10, 24, {0, -14, 0}), uv_ellipsoid(40, 10, 10, 24, {0, 14, 0}), box({-8, -16, -3}, {8, 16, 3})});
  Job<FloatSpec> options = coarse();
  options.hollow.resolution = 100;
  expect_floats(catamaran, options, "catamaran");
}

TEST(HollowFloat, AllResolutions) {
  const Mesh solid = uv_ellipsoid(30, 22, 16, 32);
  for (const int resolution : {20, 50, 120, 300}) {
    Job<FloatSpec> options;
    options.hollow.resolution = resolution;
    options.spec.submerged_fraction = 0.55;
    expect_floats(solid, options, "n" + std::to_string(resolution));
  }
}

TEST(HollowFloat, TheWaterlineFoundHasTheLargestMetacentricHeight) {
  const Mesh solid = rotated(uv_ellipsoid(30, 22, 16, 32), Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitX()).toRotationMatrix());
  const Outcome<FloatSpec> best = hollowed(solid, coarse());
  EXPECT_TRUE(best.found.waterline_searched);
  const auto height = [&](double waterline) {
    Job<FloatSpec> options = coarse();
    options.spec.waterline_mm = waterline;
    const Outcome<FloatSpec> result = hollowed(solid, options);
    return float_state(result.delivery.body(), result.found, {}, false).metacentric_height_mm;
  };
  const double at_best = height(*best.found.waterline_mm);
  for (const double step : {1.0, 2.0, 4.0}) EXPECT_GT(at_best, height(*best.found.waterline_mm + step)) << step;
}

TEST(HollowFloat, LowersTheCentreOfMassBelowThatOfAnyUniformFilling) {
  // Compare with the same body, equally heavy, of one lighter material.
  const Mesh solid = uv_ellipsoid(30, 22, 16, 32);
  Job<FloatSpec> options = coarse();
  options.spec.submerged_fraction = 0.5;
  const Outcome<FloatSpec> result = hollowed(solid, options);
  const Moments s = mesh_moments(result.delivery.body());
  EXPECT_LT(s[MZ] / s[M1], -2);
}

TEST(HollowFloat, IsTheSameForAnyNumberOfThreads) {
  const Mesh solid = uv_ellipsoid(30, 22, 16, 24);
  const auto run = [&](std::size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    Job<FloatSpec> options = coarse();
    options.spec.submerged_fraction = 0.5;
    return hollowed(solid, options).delivery.body();
  };
  const Mesh one = run(1);
  const Mesh two = run(2);
  EXPECT_EQ(one.vertices, two.vertices);
  EXPECT_EQ(one.triangles, two.triangles);
}

TEST(HollowFloat, UnderWaterItHoversWithTheLowestCentreOfMass) {
  const Mesh solid =
      moved(rotated(uv_ellipsoid(30, 22, 16, 32), Eigen::AngleAxisd(0.2, Eigen::Vector3d(1, 2, 0).normalized()).toRotationMatrix()),
            {10, -50, 30});
  Job<FloatSpec> options = coarse();
  options.spec.submerged_fraction = 1;
  expect_floats(solid, options, "submerged");
  const Outcome<FloatSpec> result = hollowed(solid, options);
  EXPECT_TRUE(is_submerged(result.found));
  EXPECT_FALSE(result.found.waterline_mm);
  // All that is left out is as high as it can be.
  const FloatVerdict verdict = verify(result.delivery.body(), &solid, result.found);
  EXPECT_EQ(failed(verdict), Names());
  EXPECT_GT(verdict.state.metacentric_height_mm, 1);
  options.spec.submerged_fraction.reset();
  options.spec.submerged_volume_fraction = 1;
  EXPECT_EQ(hollowed(solid, options).delivery.body().vertices, result.delivery.body().vertices);
  // In a fluid in which it weighs what it displaces when it is lighter.
  options.spec.fluid_g_cm3 = 0.913;
  expect_floats(solid, options, "in_oil");
}

TEST(HollowFloat, SaysWhyItCannotHover) {
  Job<FloatSpec> options = coarse();
  options.spec.submerged_fraction = 1;
  const auto why = [&](const Mesh& solid) { return message_of([&] { hollowed(solid, options); }, ErrorCode::goal); };
  const Mesh egg = uv_ellipsoid(30, 22, 16, 32);
  options.spec.print.density_g_cm3 = 0.95;
  EXPECT_TRUE(mentions(why(egg), {"It rises", "completely solid", "heavier than"}));
  options.spec.print.density_g_cm3 = 8.5;
  EXPECT_TRUE(mentions(why(egg), {"It sinks", "shell alone", "lighter than"}));
  // A plate too thin for a cavity on a block: what is left out lies below the centre of buoyancy.
  std::vector<Eigen::Vector3i> cells;
  for (int x = 0; x < 30; ++x)
    for (int y = 0; y < 30; ++y) {
      cells.emplace_back(x, y, 10);
      if (x >= 10 && x < 20 && y >= 10 && y < 20)
        for (int z = 0; z < 10; ++z) cells.emplace_back(x, y, z);
    }
  options.spec.print.density_g_cm3 = 1.4;
  EXPECT_TRUE(mentions(why(polycubes(cells, 2)), {"cannot hang upright", "above the centre of buoyancy"}));
  // Beside it no mass is a balance.
  std::vector<Eigen::Vector3i> beside = cells;
  for (Eigen::Vector3i& cell : beside)
    if (cell.z() < 10) cell.x() -= 10;
  EXPECT_TRUE(mentions(why(polycubes(beside, 2)), {"cannot be balanced", "wholly under water"}));
  options.spec.submerged_fraction.reset();
  options.spec.waterline_mm = 500;
  EXPECT_TRUE(mentions(message_of([&] { hollowed(egg, options); }, ErrorCode::usage), {"--submerged 1"}));
}

TEST(HollowFloat, SaysThatTheShellIsTooHeavy) {
  Job<FloatSpec> options = coarse();
  options.spec.waterline_mm = 8;
  const std::string text = message_of([&] { hollowed(uv_ellipsoid(30, 22, 16, 32), options); }, ErrorCode::goal);
  EXPECT_TRUE(mentions(text, {"The shell alone weighs", "displaces", "deeper than", "lighter than"}));
}

// A long tail: with 1 % more plastic it would come to rest 10 degrees off. It is refused, or made so that it bears that.
TEST(HollowFloat, WhatASearchFindsBearsALittleMorePlastic) {
  const std::filesystem::path path = test::shared_meshes() / "t-rex.obj";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no shared meshes";
  const Mesh rex = read_mesh(path).mesh;
  const Mesh solid = test::scaled(rex, 80 / bounding_box(rex).sizes().maxCoeff());
  for (const double wall : {1.2, 0.6}) {
    Job<FloatSpec> options;
    options.spec.print.wall_mm = wall;
    try {
      const Outcome<FloatSpec> result = hollowed(solid, options);
      EXPECT_TRUE(verify(result.delivery.body(), &solid, result.found).pass()) << wall;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::goal) << error.what();
    }
  }
}

// Rays beside each other may all miss a slab thinner than their spacing, or all hit it: then their grid is turned.
TEST(HollowFloat, ThinWallsAlongTheRowsOfTheRaysAreSeen) {
  std::vector<Eigen::Vector3i> cells;
  for (int x = 0; x < 30; ++x)
    for (int y = 0; y < 30; ++y)
      for (int z = 0; z < 15; ++z)
        if (x % 29 == 0 || y % 29 == 0 || z == 0) cells.emplace_back(x, y, z);
  const Mesh cup = test::polycubes(cells, 2);
  for (const int resolution : {40, 60, 77}) {
    Job<FloatSpec> options;
    options.hollow.resolution = resolution;
    options.spec.print.wall_mm = 0.6;
    const Outcome<FloatSpec> result = hollowed(cup, options);
    EXPECT_LE(result.as_built_error, 1e-6) << resolution;
    EXPECT_TRUE(verify(result.delivery.body(), &cup, result.found).pass()) << resolution;
  }
}

TEST(HollowFloat, ALittleDeeperThanTheShellItFloats) {
  // "float it deeper than X": a little deeper than X is no longer too heavy.
  const Mesh solid = uv_ellipsoid(30, 22, 16, 32);
  Job<FloatSpec> options = coarse();
  options.spec.waterline_mm = 3;
  const std::string text = message_of([&] { hollowed(solid, options); }, ErrorCode::goal);
  const auto at = text.find("deeper than ");
  ASSERT_NE(at, std::string::npos);
  options.spec.waterline_mm = std::stod(text.substr(at + 12)) + 0.5;
  EXPECT_NO_THROW(hollowed(solid, options));
}

TEST(HollowFloat, SaysThatTheSolidIsTooLight) {
  Job<FloatSpec> options = coarse();
  options.spec.print.density_g_cm3 = 0.5;
  options.spec.submerged_fraction = 0.8;
  const std::string text = message_of([&] { hollowed(uv_ellipsoid(30, 22, 16, 32), options); }, ErrorCode::goal);
  EXPECT_TRUE(mentions(text, {"completely solid", "shallower than", "heavier than"}));
}

TEST(HollowFloat, SaysThatItCannotBeBalanced) {
  // A wedge standing on its point: the centre of buoyancy lies far from any centre of mass at shallow draft.
  Mesh wedge;
  wedge.vertices = {{0, 0, 0}, {60, 0, 40}, {60, 30, 40}, {0, 30, 0}, {0, 0, 40}, {0, 30, 40}};
  wedge.triangles = {{0, 1, 4}, {3, 5, 2}, {0, 4, 5}, {0, 5, 3}, {4, 1, 2}, {4, 2, 5}, {0, 3, 2}, {0, 2, 1}};
  ASSERT_TRUE(is_closed_solid(wedge));
  Job<FloatSpec> options = coarse();
  options.spec.print.wall_mm = 0.6;
  options.spec.waterline_mm = 20;
  const std::string text = message_of([&] { hollowed(wedge, options); }, ErrorCode::goal);
  EXPECT_TRUE(mentions(text, {"cannot be balanced", "no interior brings the centre of mass closer than", "mm"}));
}

TEST(HollowFloat, SaysThatUprightIsNotStable) {
  // A tall thin post of a light material cannot stand upright in water: too little of its weight is at the bottom.
  Job<FloatSpec> options = coarse();
  options.spec.print.wall_mm = 1;
  options.spec.print.density_g_cm3 = 0.7;
  options.spec.submerged_fraction = 0.5;
  const Mesh post = box({-5, -5, 0}, {5, 5, 80});
  EXPECT_TRUE(mentions(message_of([&] { hollowed(post, options); }, ErrorCode::goal), {"metacentric height"}));
  options.spec.submerged_fraction.reset();
  EXPECT_TRUE(mentions(message_of([&] { hollowed(post, options); }, ErrorCode::goal), {"does not float upright at any waterline"}));
}

TEST(HollowFloat, SaysThatItSinks) {
  Job<FloatSpec> options = coarse();
  options.spec.print.density_g_cm3 = 8;
  const std::string text = message_of([&] { hollowed(icosphere(15, 4), options); }, ErrorCode::goal);
  EXPECT_TRUE(mentions(text, {"sinks at any waterline", "the shell alone weighs", "lighter than"}));
}

TEST(HollowFloat, SaysThatNothingRemainsInside) {
  const std::string text = message_of([&] { hollowed(box({0, 0, 0}, {30, 20, 2}), coarse()); }, ErrorCode::goal);
  EXPECT_TRUE(mentions(text, {"Nothing remains inside a wall of 1.20 mm", "1 mm from the surface", "--unit", "--size"}));
}

TEST(HollowFloat, SaysThatBodiesLieInEachOther) {
  Mesh twice = box({0, 0, 0}, {30, 30, 30});
  append(twice, box({0.5, 0.5, 0.5}, {30.5, 30.5, 30.5}));
  const std::string text = message_of([&] { hollowed(twice, coarse()); }, ErrorCode::input);
  EXPECT_TRUE(mentions(text, {"bodies of the mesh lie in each other", "Unite them"}));
}

TEST(HollowFloat, WhatIsKeptSolidLiesInTheBody) {
  Job<FloatSpec> options = coarse();
  const Mesh ball = icosphere(15, 3);
  options.hollow.keep_solid = {icosphere(2, 2, {0, 0, 14}),
                               icosphere(2, 2, {12, 12, 12})};  // the box of the second meets the ball's
  const std::string text = message_of([&] { hollowed(ball, options); }, ErrorCode::usage);
  EXPECT_TRUE(mentions(text, {"Region 2", "--keep-solid", "outside the body", "--size"}));
}

TEST(HollowFloat, RefusesOptionsThatMakeNoSense) {
  const Mesh solid = icosphere(15, 3);
  const auto refused = [&](const std::function<void(Job<FloatSpec>&)>& change) {
    Job<FloatSpec> options = coarse();
    change(options);
    return message_of([&] { hollowed(solid, options); }, ErrorCode::usage);
  };
  EXPECT_TRUE(mentions(refused([](Job<FloatSpec>& o) { o.spec.print.wall_mm = -1; }), {"wall"}));
  EXPECT_TRUE(mentions(refused([](Job<FloatSpec>& o) { o.hollow.resolution = 5; }), {"20", "1000"}));
  EXPECT_TRUE(mentions(refused([](Job<FloatSpec>& o) { o.spec.waterline_mm = 31; }), {"waterline", "30.00"}));
  EXPECT_TRUE(mentions(refused([](Job<FloatSpec>& o) { o.spec.up.setZero(); }), {"up"}));
  EXPECT_TRUE(mentions(refused([](Job<FloatSpec>& o) { o.spec.fluid_g_cm3 = NAN; }), {"fluid"}));
}

TEST(HollowFloat, CanBeInterruptedInEveryStage) {
  const Mesh solid = uv_ellipsoid(30, 22, 16, 24);
  for (const std::string stage : {"domain", "rays", "waterline", "solve", "mesh"}) {
    std::string current;
    Progress progress;
    progress.stage = [&current](std::string_view name) { current = name; };
    progress.cancelled = [&] { return current == stage; };
    message_of([&] { hollowed(solid, coarse(), progress); }, ErrorCode::interrupted);
    EXPECT_EQ(current, stage);
  }
}

TEST(HollowFloat, EveryExampleKeepsTheWallInAllTrianglesAndCrossesNowhereAsStored) {
  std::size_t examples = 0;
  for (const auto& entry : std::filesystem::directory_iterator(test::source_folder() / "examples")) {
    if (entry.path().extension() != ".stl") continue;
    ++examples;
    const Mesh solid = require_solid(read_mesh(entry.path()).mesh, "example").mesh;
    Job<FloatSpec> job = coarse();
    job.hollow.as_stored = [](const Mesh& mesh) { return as_stored("x.stl", mesh); };
    const Outcome<FloatSpec> result = hollowed(solid, job);
    EXPECT_LT(result.as_built_error, 1e-6) << entry.path();
    const FloatVerdict verdict = verify(as_stored("x.stl", result.delivery.body()), &solid, result.found);
    EXPECT_GE(verdict.smallest_wall_mm, 0.985 * result.wall_mm) << entry.path();  // 0.99, and short steps after that
    EXPECT_EQ(verdict.crossing_triangles, 0u) << entry.path();
    EXPECT_TRUE(verdict.pass()) << entry.path();
  }
  EXPECT_EQ(examples, 11u);
}

TEST(WorkingFrame, IsExactAlongTheAxes) {
  const Mesh mesh = moved(box({0, 0, 0}, {1, 2, 3}), {5, 6, 7});
  for (const Eigen::Vector3d& up :
       {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 2, 0), Eigen::Vector3d(0, 0, -1), Eigen::Vector3d(0, -1, 0)}) {
    const Eigen::Affine3d T = working_frame(mesh, up);
    EXPECT_TRUE((T.linear().array().abs() == 0 || T.linear().array().abs() == 1).all());
    EXPECT_NEAR(T.linear().determinant(), 1, 1e-15);
    EXPECT_TRUE(near(T.linear() * up.normalized(), Eigen::Vector3d(0, 0, 1), 1e-15));
    const Eigen::AlignedBox3d working = bounding_box(transformed(mesh, T));
    EXPECT_NEAR(working.min().z(), 0, 1e-12);
    EXPECT_NEAR(working.center().head<2>().norm(), 0, 1e-12);
  }
}

struct Shape {
  const char* file;
  char up;
  double size_mm;
  double waterline_mm;  // 0: searched
};

void PrintTo(const Shape& shape, std::ostream* out) { *out << shape.file << " " << shape.up << " " << shape.waterline_mm; }

class SharedShapes : public ::testing::TestWithParam<Shape> {};

TEST_P(SharedShapes, FloatsUpright) {
  const Shape& shape = GetParam();
  const auto path = test::shared_meshes() / shape.file;
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is missing";
  Mesh mesh = read_mesh(path).mesh;
  if (shape.size_mm > 0) mesh = scaled(mesh, shape.size_mm / bounding_box(mesh).sizes().maxCoeff());
  Job<FloatSpec> options;
  options.spec.up = shape.up == 'y' ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitZ();
  options.hollow.resolution = 120;
  if (shape.waterline_mm > 0) options.spec.waterline_mm = shape.waterline_mm;
  expect_floats(require_solid(mesh, shape.file).mesh, options, "shared");
}

INSTANTIATE_TEST_SUITE_P(Issue2, SharedShapes,
                         ::testing::Values(Shape{"duck.obj", 'z', 0, 14}, Shape{"duck.obj", 'z', 0, 18},
                                           Shape{"boat.obj", 'y', 80, 0}, Shape{"utah_teapot_solid.stl", 'z', 80, 0},
                                           Shape{"heart_closed.stl", 'y', 0, 0}, Shape{"cat.obj", 'z', 80, 0},
                                           Shape{"elephant.ply", 'z', 80, 0}, Shape{"t-rex.obj", 'y', 80, 0}));

}  // namespace
}  // namespace rayrep
