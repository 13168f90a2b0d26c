#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <filesystem>
#include <pugixml.hpp>
#include <sstream>

#include "places.h"
#include "rayrep/base/error.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/judge/verify.h"
#include "rayrep/make/hollow.h"
#include "rayrep/mesh/mesh_check.h"
#include "rayrep/physics/inertial.h"
#include "rayrep/rays/ray_cast.h"
#include "rayrep/rays/ray_interior.h"
#include "rayrep/solve/quadric.h"
#include "rayrep/solve/solve_target.h"
#include "runs.h"
#include "solids.h"

namespace rayrep {
namespace {

using namespace test;

constexpr double kDensity = 1.24;

MomentIndex index(int k) { return static_cast<MomentIndex>(k); }
std::optional<double>& at(InertialTargets& targets, int k) { return targets[static_cast<std::size_t>(k)]; }

/// Those of the ten numbers of a body that are named.
InertialTargets numbers_of(const MassProperties& body, std::initializer_list<int> which) {
  InertialTargets targets;
  for (const int k : which) at(targets, k) = inertial_number(body, index(k));
  return targets;
}

// ------------------------------------------------------------------------------------------------------------ the ten numbers

TEST(Inertial, TheTenNumbersOfABoxByHand) {
  const MassProperties body = mass_properties(box_moments({0, 0, 0}, {10, 20, 30}), 2);
  const double expected[] = {12, 5, 10, 15, 1300, 1000, 500, 0, 0, 0};
  for (int k = M1; k <= MXZ; ++k) EXPECT_NEAR(inertial_number(body, index(k)), expected[k], 1e-9) << inertial_name(index(k));
  EXPECT_STREQ(inertial_name(M1), "mass");
  EXPECT_STREQ(inertial_name(MZ), "com_z");
  EXPECT_STREQ(inertial_name(MYZ), "iyz");

  // A tetrahedron has the tensor -1/480 of its volume off the diagonal about its centre: the negative product of inertia is +.
  const MassProperties tetrahedron = mass_properties(mesh_moments(unit_tetrahedron()), 1000);
  for (const int k : {MXY, MYZ, MXZ}) EXPECT_NEAR(inertial_number(tetrahedron, index(k)), 1.0 / 480, 1e-12);

  InertialTargets wanted;
  wanted[M1] = 10;
  wanted[MY] = 10.5;
  wanted[MXX] = 1000;
  wanted[MXY] = 10;
  const auto deviations = inertial_deviations(wanted, body, 50);
  ASSERT_EQ(deviations.size(), 4u);
  const double relative[] = {0.2, 0.01, 0.3, 10 / std::sqrt(1300.0 * 1000)};
  for (std::size_t n = 0; n < 4; ++n) EXPECT_NEAR(deviations[n].relative, relative[n], 1e-12) << n;
  EXPECT_EQ(deviations[1].number, MY);
  EXPECT_EQ(deviations[1].wanted, 10.5);
  EXPECT_NEAR(deviations[1].found, 10, 1e-12);
}

TEST(Inertial, KnowsWhatABodyCanHave) {
  EXPECT_TRUE(is_physical(Eigen::Vector3d(3, 4, 5).asDiagonal()));
  EXPECT_TRUE(is_physical(Eigen::Vector3d(1, 1, 2).asDiagonal()));  // a flat plate
  EXPECT_FALSE(is_physical(Eigen::Vector3d(1, 1, 2.001).asDiagonal()));
  EXPECT_FALSE(is_physical(Eigen::Vector3d(-1, 4, 4).asDiagonal()));
  EXPECT_FALSE(is_physical(Eigen::Vector3d(NAN, 4, 4).asDiagonal()));
  const Eigen::Matrix3d R = random_rotation(4);
  EXPECT_TRUE(is_physical(R * Eigen::Vector3d(3, 4, 5).asDiagonal() * R.transpose()));
  EXPECT_FALSE(is_physical(R * Eigen::Vector3d(3, 4, 8).asDiagonal() * R.transpose()));
}

/// Numbers separated by blanks.
std::vector<double> numbers_in(const char* text) {
  std::istringstream in(text);
  return {std::istream_iterator<double>(in), {}};
}

struct Parsed {
  double mass_kg = 0;
  Eigen::Vector3d centre_m;
  Eigen::Matrix3d inertia_kg_m2;
};

Parsed parsed_urdf(const std::string& text) {
  pugi::xml_document document;
  EXPECT_TRUE(document.load_string(text.c_str()));
  const pugi::xml_node inertial = document.child("inertial");
  EXPECT_EQ(numbers_in(inertial.child("origin").attribute("rpy").value()), (std::vector<double>{0, 0, 0}));
  const auto xyz = numbers_in(inertial.child("origin").attribute("xyz").value());
  const auto I = [&](const char* name) { return inertial.child("inertia").attribute(name).as_double(NAN); };
  Parsed parsed;
  parsed.mass_kg = inertial.child("mass").attribute("value").as_double(NAN);
  parsed.centre_m << xyz.at(0), xyz.at(1), xyz.at(2);
  parsed.inertia_kg_m2 << I("ixx"), I("ixy"), I("ixz"), I("ixy"), I("iyy"), I("iyz"), I("ixz"), I("iyz"), I("izz");
  return parsed;
}

Parsed parsed_mjcf(const std::string& text) {
  pugi::xml_document document;
  EXPECT_TRUE(document.load_string(text.c_str()));
  const pugi::xml_node inertial = document.child("inertial");
  const auto pos = numbers_in(inertial.attribute("pos").value());
  const auto I = numbers_in(inertial.attribute("fullinertia").value());  // xx yy zz xy xz yz
  Parsed parsed;
  parsed.mass_kg = inertial.attribute("mass").as_double(NAN);
  parsed.centre_m << pos.at(0), pos.at(1), pos.at(2);
  EXPECT_EQ(I.size(), 6u);
  parsed.inertia_kg_m2 << I.at(0), I.at(3), I.at(4), I.at(3), I.at(1), I.at(5), I.at(4), I.at(5), I.at(2);
  return parsed;
}

void expect_same(const Parsed& parsed, const MassProperties& body) {
  EXPECT_NEAR(parsed.mass_kg * 1e3, body.mass_g, 1e-14 * body.mass_g);
  EXPECT_TRUE(near(parsed.centre_m * 1e3, body.centre_of_mass_mm, 1e-13 * (1 + body.centre_of_mass_mm.norm())));
  EXPECT_TRUE(near(parsed.inertia_kg_m2 * 1e9, body.inertia_g_mm2, 1e-14 * body.inertia_g_mm2.norm()));
}

TEST(Inertial, UrdfAndMjcfHoldTheNumbersOfTheBody) {
  const MassProperties body = mass_properties(mesh_moments(moved(rotated(l_shape(7), random_rotation(2)), {3, -40, 11})), kDensity);
  ASSERT_GT(std::abs(body.inertia_g_mm2(0, 1) - body.inertia_g_mm2(0, 2)), 0.5);  // so that places cannot be mixed up
  expect_same(parsed_urdf(urdf_inertial(body)), body);
  expect_same(parsed_mjcf(mjcf_inertial(body)), body);
  MassProperties bad = body;
  bad.inertia_g_mm2(0, 0) *= 10;
  EXPECT_THROW(urdf_inertial(bad), Error);
  EXPECT_THROW(mjcf_inertial(bad), Error);
}

// -------------------------------------------------------------------------------------------------------------------- the goal

/// Rays of a body about its own centre of mass, and random bodies on them.
struct Rays {
  RayRep domain;
  Moments solid;
  Moments shell;
  double diagonal_mm;
  RayIntegrals integrals;

  Rays(const Mesh& body, double spacing_mm) : Rays(moved(body, -centre_of(body)), spacing_mm, 0) {}

  /// What a random quadric leaves.
  Moments random_body(Random& random) const {
    Moments q;
    for (int k = 0; k < 10; ++k) q[k] = random.uniform(-1, 1) / std::pow(diagonal_mm / 4, k == M1 ? 0 : k <= MZ ? 1 : 2);
    return shell + integrals.moments(q);
  }

private:
  static Eigen::Vector3d centre_of(const Mesh& body) {
    const Moments s = mesh_moments(body);
    return s.segment<3>(MX) / s[M1];
  }
  Rays(const Mesh& body, double spacing_mm, int)
      : domain(
            cast_rays(SurfaceQuery(scaled(body, 0.9)), covering_grid(bounding_box(scaled(body, 0.9)), spacing_mm), Region::solid)),
        solid(mesh_moments(body)),
        shell(solid - ray_moments(domain)),
        diagonal_mm(bounding_box(body).diagonal().norm()),
        integrals(domain) {}
};

/// The same rays in a frame moved to `origin_mm`.
RayRep moved_rays(RayRep rays, const Eigen::Vector3d& origin_mm) {
  rays.grid.origin_mm -= origin_mm.head<2>();
  for (Interval& interval : rays.intervals) interval = {interval.lo - origin_mm.z(), interval.hi - origin_mm.z()};
  return rays;
}

/// A random subset of a body's numbers for which the goal is linear.
InertialTargets random_subset(const MassProperties& body, Random& random) {
  InertialTargets wanted;
  const auto take = [&](int k) { at(wanted, k) = inertial_number(body, index(k)); };
  do {
    if (random.uniform() < 0.5) take(M1);
    for (int k = MX; k <= MZ; ++k)
      if (random.uniform() < 0.6) take(k);
    const bool x = wanted[MX].has_value();
    const bool y = wanted[MY].has_value();
    const bool z = wanted[MZ].has_value();
    const bool linear[] = {y && z, x && z, x && y, x || y, y || z, x || z};
    for (int k = MXX; k <= MXZ; ++k)
      if (linear[k - MXX] && random.uniform() < 0.5) take(k);
  } while (std::none_of(wanted.begin(), wanted.end(), [](const auto& w) { return w.has_value(); }));
  return wanted;
}

/// The problem of giving a body on these rays the wanted numbers.
struct Problem {
  RayIntegrals integrals;
  Moments shell;
  TargetGoal::Setup setup;

  Problem(const Rays& rays, const InertialTargets& wanted) : Problem(rays, wanted, origin(wanted)) {}

private:
  static Eigen::Vector3d origin(const InertialTargets& wanted) {
    return {wanted[MX].value_or(0), wanted[MY].value_or(0), wanted[MZ].value_or(0)};
  }
  Problem(const Rays& rays, const InertialTargets& wanted, const Eigen::Vector3d& origin_mm)
      : integrals(moved_rays(rays.domain, origin_mm)), shell(translated(rays.shell, -origin_mm)) {
    setup.wanted = wanted;
    setup.density_g_cm3 = kDensity;
    setup.volume_mm3 = rays.solid[M1];
    setup.length_mm = rays.diagonal_mm;
  }
};

TEST(TargetGoal, ConstraintsVanishForABodyWithTheseNumbersAndOnlyForThat) {
  Random random(3);
  for (int n = 0; n < 50; ++n) {
    // A body in the mesh's frame, and the working frame turned against it with its origin at the centre of mass.
    const Eigen::Vector3d half(4 + random.uniform(), 7 + random.uniform(), 12);
    const Mesh mesh = moved(rotated(box(-half, half), random_rotation(10 + static_cast<std::uint64_t>(n))), random.in_box(20));
    const MassProperties body = mass_properties(mesh_moments(mesh), kDensity);
    Eigen::Affine3d frame = Eigen::Affine3d::Identity();
    frame.linear() = random_rotation(100 + static_cast<std::uint64_t>(n));
    frame.translation() = -(frame.linear() * body.centre_of_mass_mm);
    const Moments s = mesh_moments(transformed(mesh, frame));

    TargetGoal::Setup setup;
    setup.wanted = numbers_of(body, {M1, MX, MY, MZ, MXX, MYY, MZZ, MXY, MYZ, MXZ});
    setup.density_g_cm3 = kDensity;
    setup.axes = frame.linear();
    setup.volume_mm3 = s[M1];
    setup.length_mm = 40;
    const TargetGoal goal(setup);
    EXPECT_TRUE(goal.determined());
    ASSERT_EQ(goal.constraints(), 10);
    EXPECT_LT(goal.constraint_values(s).cwiseAbs().maxCoeff(), 1e-11);
    // Ten independent linear conditions have one solution.
    EXPECT_EQ(Eigen::FullPivLU<Eigen::MatrixXd>(goal.J * s.cwiseAbs().cwiseMax(1).asDiagonal()).rank(), 10);
    for (int k = M1; k <= MXZ; ++k) {
      if (k >= MX && k <= MZ) {
        // The origin stands for the wanted centre of mass: move the body.
        const Eigen::VectorXd c = goal.constraint_values(translated(s, frame.linear().col(k - MX)));
        EXPECT_NEAR(c[k], 1.0 / 40, 1e-12) << inertial_name(index(k));
        EXPECT_LT((c.segment<3>(MX) - c[k] * Eigen::Vector3d::Unit(k - MX)).norm(), 1e-12) << inertial_name(index(k));
        continue;
      }
      TargetGoal::Setup other = setup;
      *at(other.wanted, k) += 1;
      const Eigen::VectorXd c = TargetGoal(other).constraint_values(s);
      EXPECT_GT(std::abs(c[k]), 1e-6) << inertial_name(index(k));
      EXPECT_LT((c - c[k] * Eigen::VectorXd::Unit(10, k)).norm(), 1e-11) << inertial_name(index(k));
    }
    Moments d;
    for (int k = 0; k < 10; ++k) d[k] = random.uniform(-1, 1);
    EXPECT_LT((goal.constraint_values(s + d) - goal.constraint_values(s) - goal.J * d).norm(), 1e-10);
  }
}

TEST(TargetGoal, MinimisesTheFirstThatIsFree) {
  TargetGoal::Setup setup;
  setup.order = {{MXX, true}};
  setup.wanted[MX] = setup.wanted[MY] = setup.wanted[MZ] = 0;
  EXPECT_EQ(TargetGoal(setup).first()->number, MXX);
  EXPECT_TRUE(TargetGoal(setup).first()->largest);
  EXPECT_EQ(TargetGoal(setup).first_gradient()[MYY], -1);
  setup.wanted[MXX] = 100;
  EXPECT_EQ(TargetGoal(setup).first()->number, M1);
  setup.wanted[M1] = 1;
  EXPECT_FALSE(TargetGoal(setup).first().has_value());  // the sum of the moments of inertia
  setup.wanted[MYY] = setup.wanted[MZZ] = 100;
  EXPECT_EQ(TargetGoal(setup).first()->number, MXY);
  setup.wanted[MXY] = setup.wanted[MYZ] = 0;
  EXPECT_EQ(TargetGoal(setup).first()->number, MXZ);
  setup.wanted[MXZ] = 0;
  EXPECT_TRUE(TargetGoal(setup).determined());
}

std::vector<Mesh> bodies() {
  return {box({0, 0, 0}, {40, 30, 20}), rotated(uv_ellipsoid(30, 22, 16, 20), random_rotation(3)), torus(20, 8, 32, 16),
          l_shape(20)};
}

TEST(SolveTarget, MeetsWhatIsAttainable) {
  // Attainable since some body on these rays has these numbers; or the mean of two has, and the attainable moments are convex.
  Random random(11);
  int solved = 0;
  for (const Mesh& mesh : bodies()) {
    const Rays rays(mesh, bounding_box(mesh).sizes().maxCoeff() / 40);
    for (int n = 0; n < 90; ++n) {
      const Moments s = n % 2 ? rays.random_body(random) : Moments(0.5 * (rays.random_body(random) + rays.random_body(random)));
      Problem p(rays, random_subset(mass_properties(s, kDensity), random));
      if (n % 3 == 1) p.setup.order = {{index(static_cast<int>(10 * random.uniform())), random.uniform() < 0.5}};
      if (TargetGoal(p.setup).determined()) continue;
      const TargetSolution found = solve_target(p.setup, p.integrals, p.shell);
      ASSERT_TRUE(found.solution.converged) << n << ": residual " << found.solution.residual;
      ++solved;
      EXPECT_LT(found.goal.constraint_values(found.solution.moments).cwiseAbs().maxCoeff(), 1e-9);
      EXPECT_NEAR(found.solution.objective, found.solution.lower_bound, 1e-8);
    }
  }
  EXPECT_GT(solved, 300);
}

TEST(SolveTarget, ProvesThatOthersAreNot) {
  Random random(12);
  int proven = 0;
  for (const Mesh& mesh : bodies()) {
    const Rays rays(mesh, bounding_box(mesh).sizes().maxCoeff() / 40);
    for (int n = 0; n < 15; ++n) {
      // Beyond what the rays can do along a random direction of the moments: a little more than the most.
      InertialTargets wanted = numbers_of(mass_properties(rays.random_body(random), kDensity), {M1, MX, MY, MZ});
      const int k = MX + static_cast<int>(3 * random.uniform());
      *at(wanted, k) += (random.uniform() < 0.5 ? -1 : 1) * 0.2 * rays.diagonal_mm;
      const Problem p(rays, wanted);
      const TargetSolution found = solve_target(p.setup, p.integrals, p.shell);
      const NearestSolution nearest = nearest_attainable(found.goal, p.integrals, p.shell, 1e-9);
      ASSERT_EQ(found.solution.infeasible, !nearest.attainable) << n;
      if (!found.solution.infeasible) continue;
      ++proven;
      EXPECT_FALSE(found.solution.converged);
      EXPECT_GT(separation_margin(found.goal, found.solution.separation, p.integrals, p.shell), 0);
    }
  }
  EXPECT_GT(proven, 40);
}

// ----------------------------------------------------------------------------------------------------------------- whole bodies

Job<TargetSpec> coarse(const InertialTargets& wanted) {
  Job<TargetSpec> options;
  options.hollow.resolution = 40;
  options.spec.print.wall_mm = 2.5;
  options.spec.print.density_g_cm3 = kDensity;
  options.hollow.as_stored = [](const Mesh& mesh) { return as_stored("x.stl", mesh); };
  options.spec.wanted = wanted;
  return options;
}

/// Runs hollow_target, judges the file and returns the verdict; a mesh that fails stays in the temporary folder.
TargetVerdict expect_met(const Mesh& solid, const Job<TargetSpec>& options, double tolerance = 1e-5) {
  const Outcome<TargetSpec> result = hollowed(solid, options);
  const auto path = own_file("target.stl");
  write_mesh(path, result.delivery.body());
  TargetSpec goal;
  goal.wanted = options.spec.wanted;
  goal.at_least = options.spec.at_least;
  goal.at_most = options.spec.at_most;
  goal.least_spin_ratio = options.spec.least_spin_ratio;
  goal.up = options.spec.up;
  goal.print.density_g_cm3 = options.spec.print.density_g_cm3;
  goal.print.wall_mm = options.spec.print.wall_mm;
  const TargetVerdict verdict = verify(read_mesh(path).mesh, &solid, goal);
  for (const Criterion& c : verdict.criteria)
    EXPECT_TRUE(c.pass()) << path << ": " << c.name << " " << c.value << " limit " << c.limit;
  for (const InertialDeviation& d : verdict.state.deviations) EXPECT_LT(d.relative, tolerance) << inertial_name(d.number);
  if (verdict.pass()) std::filesystem::remove(path);
  if (result.extreme) {
    // Nothing beats the proven bound, and the weights cost little.
    const double over = (result.extreme->wish.largest ? -1 : 1) * (result.extreme->found - result.extreme->bound);
    EXPECT_GT(over, -1e-6 * std::abs(result.extreme->bound));
    EXPECT_LT(over, 0.01 * std::abs(result.extreme->bound));
    EXPECT_NEAR(inertial_number(verdict.state.body, result.extreme->wish.number), result.extreme->found,
                0.01 * std::abs(result.extreme->found));
  }
  return verdict;
}

TEST(HollowTarget, TheLightestCylinderWithAGivenMomentOfInertiaHasARoundBore) {
  // Material counts by its distance from the axis, so the lightest body leaves out all that is nearer than some radius r.
  const double R = 20;
  const double h = 24;
  const double r = 11;
  const double wall = 2.5;
  const int n = 96;
  const Mesh solid = cylinder(R, h, n);
  const Moments cavity_of_unit_height = mesh_moments(cylinder(r, 1, 96));
  const Moments full = mesh_moments(solid);
  const double izz =
      1e-3 * kDensity * (full[MXX] + full[MYY] - (h - 2 * wall) * (cavity_of_unit_height[MXX] + cavity_of_unit_height[MYY]));
  const double lightest = 1e-3 * kDensity * (full[M1] - (h - 2 * wall) * cavity_of_unit_height[M1]);
  InertialTargets wanted;
  wanted[MX] = wanted[MY] = 0;
  wanted[MZZ] = izz;
  const Job<TargetSpec> options = coarse(wanted);
  const Outcome<TargetSpec> result = hollowed(solid, options);
  EXPECT_NEAR(result.extreme->bound, lightest, 2e-3 * lightest);
  const TargetVerdict verdict = expect_met(solid, options);
  EXPECT_NEAR(verdict.state.body.mass_g, lightest, 3e-3 * lightest);
}

/// A cylinder about its middle with a cavity where (1 - ratio/2) rho^2 - ratio z^2 < level, a wall all around: by its slices.
struct Hyperboloid {
  double R = 20;
  double h = 24;
  double wall = 2.5;
  double ratio;

  struct Body {
    double volume, spin_ratio;
  };
  Body at(double level) const {
    constexpr int slices = 4000;
    double volume = kPi * R * R * h;
    double axial = 0.5 * kPi * std::pow(R, 4) * h;
    double upright = kPi * R * R * std::pow(h, 3) / 12;
    const double dz = (h - 2 * wall) / slices;
    for (int n = 0; n < slices; ++n) {
      const double z = -0.5 * h + wall + (n + 0.5) * dz;
      const double square = std::clamp((level + ratio * z * z) / (1 - ratio / 2), 0.0, std::pow(R - wall, 2));
      volume -= kPi * square * dz;
      axial -= 0.5 * kPi * square * square * dz;
      upright -= kPi * square * z * z * dz;
    }
    return {volume, axial / (axial / 2 + upright)};
  }
};

/// With its middle at the origin.
Job<TargetSpec> centred_spin(double ratio) {
  InertialTargets wanted;
  wanted[MX] = wanted[MY] = wanted[MZ] = 0;
  Job<TargetSpec> options = coarse(wanted);
  options.spec.least_spin_ratio = ratio;
  return options;
}

TEST(HollowTarget, TheLightestCylinderThatSpinsSoWellHasAWaist) {
  // What counts for it is the distance from the axis, and against it that from the middle plane: between a hyperboloid and the
  // wall.
  Hyperboloid ideal{.ratio = 1.38};
  double lo = 30;  // the ratio falls from here on
  double hi = 300;
  for (int n = 0; n < 60; ++n) {
    const double level = 0.5 * (lo + hi);
    (ideal.at(level).spin_ratio > ideal.ratio ? lo : hi) = level;
  }
  const double lightest = 1e-3 * kDensity * ideal.at(hi).volume;
  const Mesh solid = moved(cylinder(ideal.R, ideal.h, 96), {0, 0, -0.5 * ideal.h});
  const Job<TargetSpec> options = centred_spin(ideal.ratio);
  const TargetVerdict verdict = expect_met(solid, options);
  EXPECT_NEAR(verdict.state.body.mass_g, lightest, 8e-3 * lightest);
  EXPECT_NEAR(verdict.state.spin_ratio, ideal.ratio, 1e-5);
  EXPECT_EQ(verdict.criteria.back().name, "spin_ratio_at_least");
  // About any axis of the mesh.
  const Eigen::Matrix3d R = random_rotation(11);
  Job<TargetSpec> turned = options;
  turned.spec.up = R.col(2);
  const TargetVerdict other = expect_met(rotated(solid, R), turned);
  EXPECT_NEAR(other.state.body.mass_g, lightest, 8e-3 * lightest);
  EXPECT_NEAR(other.state.spin_ratio, ideal.ratio, 1e-5);
}

TEST(HollowTarget, ABoxSpinsAboutItsAxisAsWellAsWasAsked) {
  // Its larger lateral moment is another one before than it is at the end.
  const Mesh solid = box({-20, -19, -11}, {20, 19, 11});
  double before = 0;
  for (const double ratio : {1.5, 1.53, 1.55}) {  // a box without an inside has 1.41
    const TargetVerdict verdict = expect_met(solid, centred_spin(ratio), 5e-5);
    EXPECT_NEAR(verdict.state.spin_ratio, ratio, 2e-5);
    EXPECT_GT(verdict.state.body.mass_g, before);
    before = verdict.state.body.mass_g;
  }
}

TEST(HollowTarget, AMissedSpinRatioFails) {
  const Mesh solid = box({-20, -19, -11}, {20, 19, 11});
  TargetSpec goal;
  goal.wanted[MX] = goal.wanted[MY] = goal.wanted[MZ] = 0;
  const MassProperties body = mass_properties(mesh_moments(solid), 1.24);
  const double ratio = body.inertia_g_mm2(2, 2) / std::max(body.inertia_g_mm2(0, 0), body.inertia_g_mm2(1, 1));
  for (const double factor : {0.9, 0.9995, 1.0005, 1.002, 1.2}) {
    goal.least_spin_ratio = factor * ratio;
    const TargetVerdict verdict = verify(solid, &solid, goal);
    EXPECT_EQ(verdict.pass(), factor < 1.001) << factor;
    EXPECT_NEAR(verdict.state.spin_ratio, ratio, 1e-9);
    EXPECT_EQ(verdict.criteria.back().name, "spin_ratio_at_least");
  }
}

TEST(HollowTarget, ASpinRatioOutOfReachIsToldWithTheLargest) {
  // Dinkelbach's iteration for a cylinder about its middle.
  Hyperboloid ideal{.ratio = 1.3};
  for (int n = 0; n < 50; ++n) ideal.ratio = ideal.at(0).spin_ratio;
  const Mesh solid = moved(cylinder(ideal.R, ideal.h, 96), {0, 0, -0.5 * ideal.h});
  const std::string text = message_of([&] { hollowed(solid, centred_spin(1.6)); }, ErrorCode::goal);
  ASSERT_TRUE(mentions(text, {"The largest spin-ratio with these numbers is ", "without spin-ratio at least"})) << text;
  const std::string words = "The largest spin-ratio with these numbers is ";
  EXPECT_NEAR(std::stod(text.substr(text.find(words) + words.size())), ideal.ratio, 3e-3) << text;

  const auto usage = [&](Job<TargetSpec> options) { return message_of([&] { hollowed(solid, options); }, ErrorCode::usage); };
  EXPECT_TRUE(mentions(usage(centred_spin(2.5)), {"between 0 and 2"}));
  Job<TargetSpec> open = centred_spin(1.1);
  open.spec.wanted[MZ].reset();
  EXPECT_TRUE(mentions(usage(open), {"--com X,Y,Z", "static moment"}));
}

struct Subset {
  std::vector<int> numbers;
  Eigen::Vector3d up;
};

void PrintTo(const Subset& subset, std::ostream* out) {
  for (const int k : subset.numbers) *out << inertial_name(index(k)) << " ";
}

class AnySubset : public ::testing::TestWithParam<Subset> {};

TEST_P(AnySubset, IsMetInAnyAttitude) {
  // The numbers are those of the solid with a box-shaped cavity, so they are attainable, and in the axes of the mesh.
  const Mesh solid = moved(rotated(box({-20, -15, -12}, {20, 15, 12}), random_rotation(5)), {50, -20, 7});
  const Mesh inner = moved(rotated(box({-14, -10, -9}, {12, 9, 8}), random_rotation(5)), {50, -20, 7});
  const MassProperties body = mass_properties(mesh_moments(hollow(solid, inner)), kDensity);
  InertialTargets wanted;
  for (const int k : GetParam().numbers) at(wanted, k) = inertial_number(body, index(k));
  Job<TargetSpec> options = coarse(wanted);
  options.spec.up = GetParam().up;
  // Where the rest is next to nothing, as in the last, thin wisps of the cavity do not follow the corrections to the end.
  expect_met(solid, options, 3e-4);
}

INSTANTIATE_TEST_SUITE_P(HollowTarget, AnySubset,
                         ::testing::Values(Subset{{M1}, {0, 0, 1}}, Subset{{MZ}, {0.3, -1, 0.2}},
                                           Subset{{M1, MX, MY, MZ}, {1, 0, 0}}, Subset{{MX, MY, MZ, MXX}, {0, 0, 1}},
                                           Subset{{M1, MX, MY, MZ, MXX, MYY, MZZ}, {0.3, -1, 0.2}},
                                           Subset{{M1, MY, MXY, MYZ}, {1, 0, 0}}));

class Order : public ::testing::TestWithParam<MomentIndex> {};

TEST_P(Order, DecidesWhatIsSmall) {
  const Mesh solid = box({0, 0, 0}, {40, 30, 20});
  InertialTargets wanted;
  wanted[M1] = 20;
  wanted[MX] = 20;
  const auto with = [&](bool largest) {
    Job<TargetSpec> options = coarse(wanted);
    options.spec.order = {{GetParam(), largest}};
    return inertial_number(expect_met(solid, options).state.body, GetParam());
  };
  const double middle = mesh_moments(solid)[GetParam()] / mesh_moments(solid)[M1];
  EXPECT_LT(with(false), middle - 1);
  EXPECT_GT(with(true), middle + 1);
}

INSTANTIATE_TEST_SUITE_P(HollowTarget, Order, ::testing::Values(MY, MZ));

TEST(HollowTarget, AllTenNumbers) {
  const Mesh solid = box({-20, -15, -12}, {20, 15, 12});
  const MassProperties body = mass_properties(mesh_moments(hollow(solid, box({-15, -9, -9}, {13, 10, 8}))), kDensity);
  Job<TargetSpec> options = coarse(numbers_of(body, {M1, MX, MY, MZ, MXX, MYY, MZZ, MXY, MYZ, MXZ}));
  options.hollow.resolution = 40;
  const TargetVerdict verdict = expect_met(solid, options, 2e-6);
  EXPECT_EQ(verdict.state.deviations.size(), 10u);
  EXPECT_GT(verdict.smallest_wall_mm, 2.6);
}

/// The Error that f throws, which must have the given code.
template <typename F>
Error error_of(const F& f, ErrorCode code) {
  try {
    f();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), code) << error.what();
    return error;
  }
  ADD_FAILURE() << "no error";
  return {code, ""};
}

::testing::AssertionResult mentions(const std::string& text, std::initializer_list<const char*> words) {
  for (const char* word : words)
    if (text.find(word) == std::string::npos) return ::testing::AssertionFailure() << "no '" << word << "' in: " << text;
  return ::testing::AssertionSuccess();
}

TEST(HollowTarget, KeepsWithinBounds) {
  const Mesh solid = box({0, 0, 0}, {20, 20, 40});
  InertialTargets wanted;
  wanted[MX] = wanted[MY] = 10;
  Job<TargetSpec> options = coarse(wanted);
  const double lightest_g = expect_met(solid, options).body.mass_g;
  // A bound that is kept anyway changes nothing, one that is not is met as an equation.
  options.spec.at_most[MZ] = 21;
  EXPECT_NEAR(expect_met(solid, options).body.mass_g, lightest_g, 1e-3 * lightest_g);
  options.spec.at_most[MZ] = 18.5;
  const TargetVerdict low = expect_met(solid, options);
  EXPECT_EQ(low.criteria.back().name, "com_z_at_most");
  EXPECT_NEAR(low.body.centre_of_mass_mm.z(), 18.5, 1e-3);
  EXPECT_GT(low.body.mass_g, 1.02 * lightest_g);
  options.spec.at_least[M1] = 14;
  const TargetVerdict heavy = expect_met(solid, options);
  EXPECT_NEAR(heavy.body.mass_g, 14, 2e-3);
  EXPECT_LT(heavy.body.centre_of_mass_mm.z(), 18.5 + 1e-3);
  // And in another frame, where neither origin nor axes are those of the mesh.
  Job<TargetSpec> up_x = options;
  up_x.spec.up = Eigen::Vector3d::UnitX();
  EXPECT_NEAR(expect_met(solid, up_x).body.mass_g, 14, 2e-3);
  options.spec.at_most[MZ] = 10;
  const Error out_of_reach = error_of([&] { hollowed(solid, options); }, ErrorCode::goal);
  EXPECT_TRUE(mentions(out_of_reach.what(), {"without com_z at most"})) << out_of_reach.what();
}

TEST(VerifyTarget, ABoundIsFailedOnItsOtherSideAlone) {
  const Mesh solid = box({0, 0, 0}, {20, 20, 40});  // 19.84 g, centre at 20
  for (const double bound : {10.0, 19.0, 19.9, 30.0}) {
    TargetSpec spec;
    spec.at_most[M1] = bound;
    EXPECT_EQ(failed(verify(solid, nullptr, spec)), bound < 19.84 ? Names{"mass_at_most"} : Names{}) << bound;
    spec = {};
    spec.at_least[M1] = bound;
    EXPECT_EQ(failed(verify(solid, nullptr, spec)), bound > 19.86 ? Names{"mass_at_least"} : Names{}) << bound;
    spec = {};
    spec.at_most[MZ] = bound;
    EXPECT_EQ(failed(verify(solid, nullptr, spec)), bound < 19.95 ? Names{"com_z_at_most"} : Names{}) << bound;
  }
}

TEST(HollowTarget, SaysHowNearItComes) {
  const Mesh solid = box({0, 0, 0}, {40, 30, 20});
  InertialTargets wanted;
  wanted[M1] = 12.3;
  wanted[MX] = 20;
  const Error light = error_of([&] { hollowed(solid, coarse(wanted)); }, ErrorCode::goal);
  EXPECT_TRUE(mentions(light.what(), {"The shell alone weighs",
                                      "The nearest any interior comes (least squares of mass, static moments and inertia) is: mass",
                                      "instead of 12.3 g"}));

  wanted[M1] = 28;
  wanted[MZ] = 10.9;
  const Error high = error_of([&] { hollowed(solid, coarse(wanted)); }, ErrorCode::goal);
  EXPECT_TRUE(mentions(high.what(), {"cannot be met together", "com_z", "instead of 10.9 mm",
                                     "All the others can be met without mass", "or without com_z"}));
  wanted[M1] = 31;
  const Error heavy = error_of([&] { hollowed(solid, coarse(wanted)); }, ErrorCode::goal);
  EXPECT_TRUE(mentions(heavy.what(), {"completely solid", "29.76 g", "heavier than 1.292"}));
}

TEST(HollowTarget, RefusesNumbersThatMakeNoSense) {
  const Mesh solid = box({0, 0, 0}, {40, 30, 20});
  const auto refused = [&](std::initializer_list<std::pair<int, double>> values, std::vector<TargetGoal::Wish> order = {}) {
    InertialTargets wanted;
    for (const auto& [k, value] : values) at(wanted, k) = value;
    Job<TargetSpec> options = coarse(wanted);
    options.spec.order = std::move(order);
    return std::string(error_of([&] { hollowed(solid, options); }, ErrorCode::usage).what());
  };
  EXPECT_TRUE(mentions(refused({}), {"Say which numbers are wanted"}));
  EXPECT_TRUE(mentions(refused({{M1, -1}}), {"--mass must be a positive number"}));
  EXPECT_TRUE(mentions(refused({{MX, NAN}}), {"com_x must be finite"}));
  EXPECT_TRUE(mentions(refused({{M1, 10}, {MXX, 100}}), {"Inertia targets need", "ixx", "y and z"}));
  EXPECT_TRUE(mentions(refused({{MY, 10}, {MXX, 100}}), {"ixx", "y and z"}));
  EXPECT_TRUE(mentions(refused({{MZ, 10}, {MXY, 0}}), {"ixy", "x or y"}));
  EXPECT_TRUE(mentions(refused({{MX, 0}, {MY, 0}, {MZ, 0}, {MXX, 1}, {MYY, 2}, {MZZ, 4}}), {"No body has this inertia"}));
  EXPECT_TRUE(mentions(refused({{MX, 0}, {MY, 0}, {MZ, 0}, {MXX, 2}, {MYY, 2}, {MZZ, 3}, {MXY, 2}, {MYZ, 0}, {MXZ, 0}}),
                       {"No body has this inertia"}));
  Job<TargetSpec> all = coarse({10, 0, 0, 0, 2, 2, 3, 0, 0, 0});
  all.spec.print.self_supporting_deg = 45;
  EXPECT_TRUE(mentions(error_of([&] { hollowed(solid, all); }, ErrorCode::usage).what(), {"all ten", "--self-supporting out"}));
  EXPECT_TRUE(mentions(refused({{MX, 0}}, {{MZ}}), {"com_z", "--mass"}));
  EXPECT_TRUE(mentions(refused({{M1, 10}}, {{MXX}}), {"ixx", "--com"}));
  InertialTargets mass;
  mass[M1] = 15;
  Job<TargetSpec> rays = coarse(mass);
  rays.hollow.solver = Solver::rays;
  EXPECT_TRUE(mentions(error_of([&] { hollowed(solid, rays); }, ErrorCode::usage).what(), {"quadric"}));
}

TEST(VerifyTarget, AHollowBlockByHand) {
  const Mesh original = box({0, 0, 0}, {40, 30, 20});
  const Mesh delivered = hollow(original, box({5, 5, 5}, {30, 25, 14}));
  const MassProperties body =
      mass_properties(box_moments({0, 0, 0}, {40, 30, 20}) - box_moments({5, 5, 5}, {30, 25, 14}), kDensity);
  TargetSpec goal;
  goal.print.wall_mm = 4;
  goal.wanted = numbers_of(body, {M1, MX, MY, MZ, MXX, MYY, MZZ, MXY, MYZ, MXZ});
  const TargetVerdict good = verify(delivered, &original, goal);
  EXPECT_TRUE(good.pass());
  ASSERT_EQ(good.criteria.size(), 15u);
  for (std::size_t n = 5; n < 15; ++n) {
    EXPECT_EQ(good.criteria[n].name, inertial_name(index(static_cast<int>(n) - 5)));
    EXPECT_LT(good.criteria[n].value, 1e-10);
  }
  for (int k = M1; k <= MXZ; ++k) {
    // Half a percent off in one number fails in that one alone, and passes with a limit of one percent.
    TargetSpec other = goal;
    const double unit = k >= MX && k <= MZ ? bounding_box(original).diagonal().norm()
                        : k >= MXY         ? body.inertia_g_mm2.trace() / 3
                                           : *at(other.wanted, k);
    *at(other.wanted, k) += 0.005 * unit;
    const TargetVerdict bad = verify(delivered, &original, other);
    for (const Criterion& c : bad.criteria) EXPECT_EQ(c.pass(), c.name != inertial_name(index(k))) << c.name << " " << c.value;
    Limits lax;
    lax.relative = 0.01;
    EXPECT_TRUE(verify(delivered, &original, other, lax).pass()) << inertial_name(index(k));
  }
  EXPECT_NEAR(target_state_of(original, goal).body.mass_g, 29.76, 1e-9);
  EXPECT_THROW(verify(delivered, &original, TargetSpec{}), Error);
}

struct Shape {
  const char* file;
  double mass_fraction;  ///< of the solid's mass
};

void PrintTo(const Shape& shape, std::ostream* out) { *out << shape.file; }

class SharedTargets : public ::testing::TestWithParam<Shape> {};

TEST_P(SharedTargets, MassCentreAndInertiaAreMet) {
  const Shape& shape = GetParam();
  const auto path = test::shared_meshes() / shape.file;
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is missing";
  Mesh mesh = read_mesh(path).mesh;
  mesh = require_solid(scaled(mesh, 80 / bounding_box(mesh).sizes().maxCoeff()), shape.file).mesh;
  // First the mass alone; the body that results says which inertia goes with it.
  InertialTargets wanted;
  const MassProperties solid = mass_properties(mesh_moments(mesh), kDensity);
  wanted[M1] = shape.mass_fraction * solid.mass_g;
  Job<TargetSpec> options = coarse(wanted);
  options.spec.print.wall_mm = 1.5;
  const MassProperties low = expect_met(mesh, options, 3e-4).state.body;
  options.spec.wanted[MX] = low.centre_of_mass_mm.x();
  options.spec.wanted[MY] = low.centre_of_mass_mm.y();
  options.spec.wanted[MZ] = 0.8 * low.centre_of_mass_mm.z() + 0.2 * solid.centre_of_mass_mm.z();
  expect_met(mesh, options, 3e-4);
}

INSTANTIATE_TEST_SUITE_P(Issue4, SharedTargets, ::testing::Values(Shape{"boat.obj", 0.85}, Shape{"t-rex.obj", 0.8}));

}  // namespace
}  // namespace rayrep
