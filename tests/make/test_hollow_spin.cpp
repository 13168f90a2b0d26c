#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <string>

#include "rayrep/base/error.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/judge/verify.h"
#include "rayrep/make/hollow.h"
#include "rayrep/mesh/level_set.h"
#include "runs.h"
#include "solids.h"

namespace rayrep {
namespace {

using namespace test;
using Eigen::Vector3d;
using Through = SpinAxis::Through;

Job<SpinSpec> coarse(Through through = Through::lowest_point) {
  Job<SpinSpec> options;
  options.hollow.resolution = 40;
  options.spec.axis.through = through;
  return options;
}

Job<SpinSpec> about(const Vector3d& contact_mm) {
  Job<SpinSpec> options = coarse(Through::point);
  options.spec.axis.point_mm = contact_mm;
  return options;
}

Job<SpinSpec> yoyo() {
  Job<SpinSpec> options = coarse();
  options.spec.yoyo = true;
  options.spec.lambda = 0;
  return options;
}

Mesh turned(const Mesh& mesh, double degrees) {
  return rotated(mesh, Eigen::AngleAxisd(degrees * kPi / 180, Vector3d(1, 2, 0).normalized()).toRotationMatrix());
}

Mesh tilted_egg() { return turned(uv_ellipsoid(30, 22, 16, 24), 15); }

/// A lens with a ball grown into it off the middle: no plane of symmetry.
Mesh lopsided_lens() {
  const auto distance = [](const Vector3d& p) {
    const double lens = 8 * (Vector3d(p.x() / 24, p.y() / 18, p.z() / 8).norm() - 1);
    return std::min(lens, (p - Vector3d(18, 6, 3)).norm() - 8);
  };
  return mesh_implicit(distance, Eigen::AlignedBox3d(Vector3d(-30, -26, -16), Vector3d(34, 26, 16)), 1.0);
}

/// Runs hollow_spin with float32 storage and judges the file; a mesh that fails stays in the temporary folder.
SpinState expect_spins(const Mesh& solid, const Job<SpinSpec>& options, const std::string& name) {
  Job<SpinSpec> stored = options;
  stored.hollow.as_stored = [](const Mesh& mesh) { return as_stored("x.stl", mesh); };
  const Outcome<SpinSpec> result = hollowed(solid, stored);
  EXPECT_EQ(result.solve.status, SolveStatus::converged) << result.solve.solver_status;
  EXPECT_GE(result.cavities, 1u);
  const auto path = own_file(name + ".stl");
  write_mesh(path, result.delivery.body());
  const SpinVerdict verdict = verify(read_mesh(path).mesh, &solid, result.found);
  for (const Criterion& c : verdict.criteria)
    EXPECT_TRUE(c.pass()) << path << ": " << c.name << " " << c.value << " limit " << c.limit;
  EXPECT_LT(verdict.state.offset_mm, 2e-5 * bounding_box(solid).diagonal().norm() * 1.01);  // HollowOptions::as_built_tolerance
  if (verdict.pass()) std::filesystem::remove(path);
  return verdict.state;
}

/// Objective of the first solve, before anything is fed back from the mesh: then different runs solve the same programme.
double first_objective(const Mesh& solid, Job<SpinSpec> options) {
  options.hollow.resolution = 30;
  options.hollow.max_passes = 1;
  return hollowed(solid, options).solve.objective;
}

TEST(HollowSpin, ATiltedEllipsoidBelowItsCentreOfMass) {
  const SpinState after = expect_spins(tilted_egg(), coarse(Through::centre_of_mass), "egg");
  EXPECT_EQ(after.axis_class, AxisClass::largest);
  const SpinState before = spin_state_of(tilted_egg(), {}, {});
  EXPECT_GT(before.axis_angle_rad, 0.1);
  EXPECT_GT(after.ratio_larger, before.ratio_larger);
}

TEST(HollowSpin, ABoxWithATieBecomesDistinctlyTheLargest) {
  // 20 x 20 x 30 about x: Izz equals one lateral moment, which no spin survives.
  const Mesh solid = box({0, 0, 0}, {20, 20, 30});
  Job<SpinSpec> options = coarse();
  options.spec.up = Vector3d::UnitX();
  SpinSpec goal;
  goal.up = Vector3d::UnitX();
  goal.axis = {.through = Through::point, .point_mm = {0, 10, 15}};
  const SpinState before = spin_state_of(solid, goal);
  EXPECT_NEAR(before.ratio_larger, 1, 1e-9);
  EXPECT_EQ(before.axis_class, AxisClass::middle);
  const SpinState after = expect_spins(solid, options, "box");
  EXPECT_EQ(after.axis_class, AxisClass::largest);
  EXPECT_GT(after.ratio_larger, 1.05);
  EXPECT_TRUE(near(after.body.centre_of_mass_mm.tail<2>(), Eigen::Vector2d(10, 15), 0.002));
}

TEST(HollowSpin, TheContactPoint) {
  // A box's lowest point is the middle of its base; an axis through its centre of mass leaves it there; so does one through a
  // point.
  const Mesh solid = moved(box({-15, -10, 0}, {15, 10, 8}), {100, -50, 30});
  Job<SpinSpec> options = coarse();
  options.hollow.max_passes = 1;
  options.hollow.resolution = 20;
  const Vector3d base(100, -50, 30);
  EXPECT_TRUE(near(place_of(hollowed(solid, options).found), base, 1e-9));
  options.spec.axis.through = Through::centre_of_mass;
  EXPECT_TRUE(near(place_of(hollowed(solid, options).found), base, 1e-9));
  options.spec.axis = {.through = Through::point, .point_mm = {100.25, -50.25, 1000}, .leaves_below = true};
  EXPECT_TRUE(near(place_of(hollowed(solid, options).found), Vector3d(100.25, -50.25, 30), 1e-9));
  options.spec.axis = {.through = Through::point, .point_mm = {100.25, -50.25, 29}, .leaves_below = false};
  EXPECT_TRUE(near(place_of(hollowed(solid, options).found), Vector3d(100.25, -50.25, 29), 1e-12));
  options.spec.axis = {};
  options.spec.up = -Vector3d::UnitZ();
  EXPECT_TRUE(near(place_of(hollowed(solid, options).found), Vector3d(100, -50, 38), 1e-9));
}

TEST(HollowSpin, AnAsymmetricYoyo) {
  const Mesh solid = lopsided_lens();
  ASSERT_TRUE(is_closed_solid(solid));
  const Vector3d centre = bounding_box(solid).center();
  const SpinState after = expect_spins(solid, yoyo(), "yoyo");
  EXPECT_TRUE(near(after.body.centre_of_mass_mm, centre, 0.002));
  EXPECT_GT((mass_properties(mesh_moments(solid), 1).centre_of_mass_mm - centre).norm(), 0.5);
}

TEST(HollowSpin, CompleteBoundsAreNeverWorseThanThePapers) {
  struct Case {
    const char* name;
    Mesh solid;
    Job<SpinSpec> options;
    double least_gain;  // relative
  };
  Job<SpinSpec> about_x = coarse();
  about_x.spec.up = Vector3d::UnitX();
  const Case cases[] = {{"tilted egg", tilted_egg(), coarse(Through::centre_of_mass), 1e-4},
                        {"cone", cone(20, 30, 32), coarse(), 1e-4},
                        {"box", box({0, 0, 0}, {20, 20, 30}), about_x, -1}};
  for (const Case& c : cases) {
    Job<SpinSpec> options = c.options;
    const double exact = first_objective(c.solid, options);
    options.hollow.solver = Solver::rays;
    const double complete = first_objective(c.solid, options);
    EXPECT_NEAR(complete, exact, 1e-6 * exact) << c.name;
    options.hollow.bounds = SegmentBounds::paper;
    const double paper = first_objective(c.solid, options);
    EXPECT_LE(complete, paper + 1e-6) << c.name;
    EXPECT_GE((paper - complete) / paper, c.least_gain) << c.name;
  }
}

TEST(HollowSpin, WhereItStartsDoesNotMatter) {
  double best = std::numeric_limits<double>::infinity();
  double worst = 0;
  double from_solid = 0;
  for (const double fill : {1.0, 0.5, 0.1}) {
    Job<SpinSpec> options = coarse(Through::centre_of_mass);
    options.hollow.solver = Solver::rays;
    options.hollow.start_fill = fill;
    const double objective = first_objective(tilted_egg(), options);
    if (fill == 1) from_solid = objective;
    best = std::min(best, objective);
    worst = std::max(worst, objective);
  }
  EXPECT_LE(from_solid, best * (1 + 1e-3));
  EXPECT_LE(worst, best * (1 + 1e-3));
}

TEST(HollowSpin, IsTheSameForAnyNumberOfThreads) {
  const auto run = [&](std::size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    Job<SpinSpec> options = coarse(Through::centre_of_mass);
    options.hollow.max_passes = 1;
    options.hollow.resolution = 30;
    return hollowed(tilted_egg(), options);
  };
  const Outcome<SpinSpec> one = run(1);
  const Outcome<SpinSpec> two = run(2);
  EXPECT_EQ(one.delivery.body().vertices, two.delivery.body().vertices);
  EXPECT_EQ(one.delivery.body().triangles, two.delivery.body().triangles);
  EXPECT_EQ(one.solve.objective, two.solve.objective);
}

/// Distance from the line (x, 10) of the centre of mass of the 40 x 20 x 20 box below with wall w, at the nearest: by symmetry the
/// best interior is solid up to some x = t and void beyond.
double smallest_offset_of_block(double x, double w) {
  const Moments outer = box_moments({0, 0, 0}, {40, 20, 20});
  const Moments shell = outer - box_moments(Vector3d::Constant(w), Vector3d(40 - w, 20 - w, 20 - w));
  double best = std::numeric_limits<double>::infinity();
  for (double t = w; t <= 40 - w; t += 0.001) {
    const Moments s = shell + box_moments(Vector3d::Constant(w), Vector3d(t, 20 - w, 20 - w));
    best = std::min(best, std::abs(s[MX] / s[M1] - x));
  }
  return best;
}

TEST(HollowSpin, TheSearchedAxisIsThatOfTheEgg) {
  // An egg tilted by 15 degrees: within 20 degrees of the vertical the best axis is near its own, and beats the vertical.
  Job<SpinSpec> options = coarse(Through::centre_of_mass);
  options.hollow.resolution = 40;
  options.hollow.max_passes = 1;
  const Outcome<SpinSpec> vertical = hollowed(tilted_egg(), options);
  options.spec.max_tilt_rad = 20 * kPi / 180;
  const Outcome<SpinSpec> searched = hollowed(tilted_egg(), options);
  EXPECT_LT(searched.solve.objective, vertical.solve.objective);
  EXPECT_LE(std::acos(std::min(1.0, searched.found.up.z())), options.spec.max_tilt_rad + 1e-9);
  EXPECT_NEAR(searched.found.up.norm(), 1, 1e-12);
  // And a searched point beats the one below the centre of mass, or is as good.
  options.spec.max_tilt_rad = 0;
  options.spec.axis.through = Through::best;
  EXPECT_LE(hollowed(tilted_egg(), options).solve.objective, vertical.solve.objective + 1e-6);
}

TEST(HollowSpin, CertifiesTheOptimumItBuilds) {
  Job<SpinSpec> options = coarse(Through::centre_of_mass);
  options.hollow.max_passes = 1;
  options.spec.certify = true;
  const Outcome<SpinSpec> result = hollowed(tilted_egg(), options);
  ASSERT_TRUE(result.certificate);
  EXPECT_TRUE(result.certificate->closed);
  EXPECT_LE(result.certificate->lower_bound, result.solve.objective + 1e-9);
  EXPECT_NEAR(result.certificate->best.objective, result.solve.objective, 1e-9);
  options.spec.prefer = AxisClass::smallest;
  EXPECT_THROW(hollowed(tilted_egg(), options), Error);
}

TEST(HollowSpin, SaysThatItCannotBeBalancedAndHowCloseItComes) {
  const Mesh block = box({0, 0, 0}, {40, 20, 20});
  for (const double x : {3.0, 8.0}) {
    Job<SpinSpec> options = about({x, 10, 0});
    const std::string text = message_of([&] { hollowed(block, options); }, ErrorCode::goal);
    ASSERT_TRUE(mentions(text, {"cannot be balanced", "alone comes to within ", "mm of the axis"}));
    const double offset = std::stod(text.substr(text.find("alone comes to within ") + 22));
    EXPECT_NEAR(offset, smallest_offset_of_block(x, options.spec.print.wall_mm), 0.6);  // rays are 1 mm apart
    EXPECT_LT(offset, 20 - x);                                                          // that of the solid
  }
}

TEST(HollowSpin, AnAxisThatCanBeBalancedIsNotRefused) {
  // The same block: how far off the middle its axis may lie is known.
  for (const double x : {18.0, 14.4}) {
    ASSERT_LT(smallest_offset_of_block(x, 1.2), 0.01);
    EXPECT_NO_THROW(first_objective(box({0, 0, 0}, {40, 20, 20}), about({x, 10, 0}))) << x;
  }
  ASSERT_GT(smallest_offset_of_block(13.9, 1.2), 0.1);
  message_of([] { first_objective(box({0, 0, 0}, {40, 20, 20}), about({13.9, 10, 0})); }, ErrorCode::goal);
}

TEST(HollowSpin, RefusesOptionsThatMakeNoSense) {
  const Mesh solid = icosphere(15, 3);
  const auto refused = [&](const std::function<void(Job<SpinSpec>&)>& change) {
    Job<SpinSpec> options = coarse();
    change(options);
    return message_of([&] { hollowed(solid, options); }, ErrorCode::usage);
  };
  EXPECT_TRUE(mentions(refused([](Job<SpinSpec>& o) {
                         o.spec.axis = {.through = Through::point, .point_mm = {100, 0, 0}, .leaves_below = true};
                       }),
                       {"does not meet the mesh", "--point"}));
  EXPECT_TRUE(mentions(refused([](Job<SpinSpec>& o) { o.spec.lambda = -1; }), {"--lambda must not be negative"}));
  EXPECT_TRUE(mentions(refused([](Job<SpinSpec>& o) { o.spec.gamma_c = -1; }), {"--gamma-c must not be negative"}));
  EXPECT_TRUE(mentions(refused([](Job<SpinSpec>& o) { o.spec.gamma_i = NAN; }), {"--gamma-i"}));
  EXPECT_TRUE(mentions(refused([](Job<SpinSpec>& o) { o.spec.gamma_i = INFINITY; }), {"--gamma-i"}));
  EXPECT_TRUE(mentions(refused([](Job<SpinSpec>& o) { o.spec.print.wall_mm = 0; }), {"wall"}));
  EXPECT_TRUE(mentions(refused([](Job<SpinSpec>& o) { o.spec.up.setZero(); }), {"up"}));
  EXPECT_TRUE(mentions(message_of(
                           [&] {
                             hollowed(box({0, 0, 0}, {30, 20, 2}), coarse());
                           },
                           ErrorCode::goal),
                       {"Nothing remains inside a wall of 1.20 mm"}));
}

TEST(HollowSpin, TheAxisOfATorusRunsThroughItsHole) {
  // The tip is then thought at the level of the lowest point.
  Job<SpinSpec> options = coarse(Through::centre_of_mass);
  options.hollow.max_passes = 1;
  const Outcome<SpinSpec> result = hollowed(torus(20, 8, 32, 16), options);
  EXPECT_TRUE(near(place_of(result.found), Vector3d(0, 0, -8), 1e-9));
}

TEST(HollowSpin, CanBeInterruptedInEveryStage) {
  const Mesh solid = icosphere(15, 3);
  for (const std::string stage : {"domain", "rays", "solve", "mesh"}) {
    std::string current;
    Progress progress;
    progress.stage = [&current](std::string_view name) { current = name; };
    progress.cancelled = [&] { return current == stage; };
    message_of([&] { hollowed(solid, coarse(), progress); }, ErrorCode::interrupted);
    EXPECT_EQ(current, stage);
  }
}

}  // namespace
}  // namespace rayrep
