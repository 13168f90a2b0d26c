// What is told of a body without meshing its cavity: the same rays, the same solver, and what was kept changes nothing.

#include <gtest/gtest.h>

#include <cmath>

#include "make/plan.h"
#include "rayrep/base/error.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/judge/verify.h"
#include "rayrep/make/preview.h"
#include "rayrep/rays/ray_interior.h"
#include "rays/positive_part.h"
#include "runs.h"
#include "solids.h"

namespace rayrep {
namespace {

using namespace test;

Mesh boat() { return uv_ellipsoid(40, 30, 24, 48); }
Mesh bracket() { return polycubes({{0, 0, 0}, {0, 0, 1}, {0, 0, 2}, {1, 0, 0}}, 14); }

FloatSpec afloat(double waterline_mm, double wall_mm = 1.2) {
  FloatSpec spec;
  spec.waterline_mm = waterline_mm;
  spec.print.wall_mm = wall_mm;
  return spec;
}

SpinSpec top() {
  SpinSpec spec;
  spec.axis = SpinAxis{};
  return spec;
}

TargetSpec heavy() {
  TargetSpec spec;
  spec.wanted[M1] = 90;
  return spec;
}

PoseSpec poses() {
  PoseSpec spec;
  spec.poses = {Pose{.kind = Pose::Kind::stands}, Pose{.kind = Pose::Kind::stands, .up = Eigen::Vector3d::UnitX()}};
  return spec;
}

struct Case {
  const char* name;
  Mesh solid;
  Spec spec;
};

std::vector<Case> cases() {
  FloatSpec sparse = afloat(34);
  sparse.print.infill.percent = 20;
  FloatSpec leaning = afloat(34);
  leaning.up = {0.1, 0.2, 1};
  return {{"float", boat(), afloat(30)}, {"searched", boat(), FloatSpec{}}, {"sparse", boat(), sparse},
          {"leaning", boat(), leaning},  {"spin", boat(), top()},           {"stand", bracket(), StandSpec{}},
          {"target", boat(), heavy()},   {"pose", bracket(), poses()},      {"dice", box({0, 0, 0}, {20, 20, 20}), DiceSpec{}}};
}

/// All that a preview tells.
void expect_same(const Preview& a, const Preview& b) {
  EXPECT_EQ(a.moments, b.moments);
  EXPECT_EQ(a.to_working.matrix(), b.to_working.matrix());
  EXPECT_EQ(a.outside.vertices, b.outside.vertices);
  EXPECT_EQ(a.voids.first, b.voids.first);
  ASSERT_EQ(a.voids.intervals.size(), b.voids.intervals.size());
  for (std::size_t n = 0; n < a.voids.intervals.size(); ++n) {
    EXPECT_EQ(a.voids.intervals[n].lo, b.voids.intervals[n].lo);
    EXPECT_EQ(a.voids.intervals[n].hi, b.voids.intervals[n].hi);
  }
  Spec x = a.spec;
  Spec y = b.spec;
  const auto rows = [](auto& spec) { return settings(spec, Setting::For::making); };
  const Settings of_x = std::visit(rows, x);
  const Settings of_y = std::visit(rows, y);
  for (std::size_t n = 0; n < of_x.size(); ++n) EXPECT_EQ(shown(of_x[n]), shown(of_y[n])) << of_x[n].name;
}

TEST(PositivePart, IsWhereTheQuadricIsPositive) {
  Random random(5);
  RayRep domain;
  domain.grid = {.origin_mm = {-2, -1}, .spacing_mm = 0.5, .nx = 9, .ny = 5};
  domain.first = {0};
  for (std::size_t ray = 0; ray < domain.grid.size(); ++ray) {
    domain.intervals.push_back({random.uniform(-3, -1), random.uniform(-1, 0)});
    domain.intervals.push_back({random.uniform(0, 1), random.uniform(1, 3)});
    domain.first.push_back(static_cast<std::uint32_t>(domain.intervals.size()));
  }
  for (int n = 0; n < 60; ++n) {
    Moments q;
    for (double& value : q) value = random.uniform(-1, 1);
    if (n % 3 == 1) q[MZZ] = 0;  // a plane in z
    if (n % 6 == 4) q[MZ] = q[MXZ] = q[MYZ] = 0;
    const RayRep part = positive_part(domain, q);
    ASSERT_EQ(part.first.size(), domain.first.size());
    for (std::size_t ray = 0; ray < domain.grid.size(); ++ray)
      for (int sample = 0; sample < 25; ++sample) {
        const double z = random.uniform(-3, 3);
        const auto holds = [&](const RayRep& rays) {
          for (std::uint32_t k = rays.first[ray]; k < rays.first[ray + 1]; ++k)
            if (rays.intervals[k].lo <= z && z <= rays.intervals[k].hi) return true;
          return false;
        };
        const Eigen::Vector2d at = domain.grid.at(ray);
        const double value = quadric_value(q, {at.x(), at.y(), z});
        if (std::abs(value) < 1e-9) continue;
        EXPECT_EQ(holds(part), holds(domain) && value > 0) << n << " " << ray << " " << z;
      }
  }
}

TEST(Preview, ItsMomentsAreThoseOfTheSolverOnTheSameRays) {
  for (const Case& c : cases()) {
    SCOPED_TRACE(c.name);
    const HollowOptions options = coarse(40);
    const Preview preview = Previewer(c.solid).look(c.spec, options);
    HollowOptions look = options;
    look.look_only = true;
    const detail::Plan plan = std::visit([&](const auto& s) { return detail::plan(c.solid, s, look, {}); }, c.spec);
    InteriorSolver solver(plan.goal, plan.body->inner.rays, *plan.body->integrals, plan.setup);
    const Moments model = solver.solve(plan.body->shell, {}).model;
    const Moments unit = moment_units(plan.body->solid[M1], plan.body->diagonal_mm);
    EXPECT_LT((moment_map(preview.to_working) * preview.moments - model).cwiseQuotient(unit).norm(), 1e-12);
  }
}

TEST(Preview, TheBodyIsTheSolidWithoutTheStretchesThatAreTold) {
  for (const Case& c : cases()) {
    SCOPED_TRACE(c.name);
    const Preview preview = Previewer(c.solid).look(c.spec, coarse(40));
    const Moments solid = mesh_moments(transformed(preview.outside, preview.to_working));
    const Moments told = solid - ray_moments(preview.voids);  // which weighs what is sparse
    const Moments unit = moment_units(solid[M1], bounding_box(c.solid).diagonal().norm());
    EXPECT_LT((moment_map(preview.to_working) * preview.moments - told).cwiseQuotient(unit).norm(), 1e-6);
    EXPECT_NEAR(preview.moments[M1], solid[M1] - preview.voids.grid.weight * preview.voids.volume_mm3(), 1e-6 * solid[M1]);
    EXPECT_GT(preview.voids.volume_mm3(), 0);
  }
}

TEST(Preview, WhatWasKeptChangesNothing) {
  std::vector<Spec> specs;
  for (const double waterline : {28.0, 30.0, 29.0}) specs.emplace_back(afloat(waterline));
  for (const double wall : {1.0, 1.5, 1.0}) specs.emplace_back(afloat(30, wall));
  FloatSpec leaning = afloat(30);
  leaning.up = {0.1, 0.2, 1};
  specs.emplace_back(leaning);
  specs.emplace_back(top());
  FloatSpec other = afloat(30);
  other.print.density_g_cm3 = 1.1;
  specs.emplace_back(other);
  specs.emplace_back(heavy());
  specs.emplace_back(afloat(30));
  other.print.infill.percent = 10;
  specs.emplace_back(other);
  Previewer kept(boat());
  for (std::size_t n = 0; n < specs.size(); ++n) {
    SCOPED_TRACE(n);
    const HollowOptions options = coarse(n % 4 == 3 ? 30 : 40);
    expect_same(kept.look(specs[n], options), Previewer(boat()).look(specs[n], options));
  }
}

TEST(Preview, WhatWasKeptIsRefusedInTheSameWords) {
  Previewer kept(bracket());
  const auto refusal = [](Previewer& previewer, const Spec& spec) {
    try {
      previewer.look(spec, coarse(40));
      return std::string();
    } catch (const Error& error) {
      return std::string(error.what());
    }
  };
  StandSpec on_edge;
  on_edge.up = {1, 0, 1};
  for (int n = 0; n < 2; ++n) {
    Previewer fresh(bracket());
    const std::string words = refusal(fresh, on_edge);
    EXPECT_NE(words.find("It cannot stand: it touches the ground in an edge only"), std::string::npos) << words;
    EXPECT_EQ(refusal(kept, on_edge), words);
    EXPECT_EQ(refusal(kept, afloat(-3)), refusal(fresh, afloat(-3)));
    EXPECT_EQ(refusal(kept, StandSpec{}), "");
  }
}

TEST(Preview, IsNearWhatIsDelivered) {
  const double diagonal = bounding_box(boat()).diagonal().norm();
  for (const int resolution : {20, 40, 80}) {
    const HollowResult result = hollow(boat(), afloat(30), coarse(resolution));
    const Moments s = mesh_moments(result.delivery.body());
    const Moments p = Previewer(boat()).look(afloat(30), coarse(resolution)).moments;
    EXPECT_NEAR(p[M1] / s[M1], 1, 1e-6);  // what it has to displace
    const double off = (p.segment<3>(MX) / p[M1] - s.segment<3>(MX) / s[M1]).norm() / diagonal;
    EXPECT_LT(off, 1.0 / resolution / resolution) << resolution;
  }
}

TEST(Preview, TheJudgeOfPrintsAgreesWithIt) {
  const Preview preview = Previewer(boat()).look(afloat(30), coarse(60));
  const Verdict verdict = verify_print(preview.outside, preview.moments, preview.spec);
  EXPECT_EQ(failed(verdict), Names{});
}

TEST(Preview, OfABaseThatIsCutIsOfWhatIsLeft) {
  const Mesh egg = uv_ellipsoid(15, 15, 25, 48, {0, 0, 25});
  StandSpec spec;
  spec.flatten_mm = 2;
  const Preview preview = Previewer(egg).look(spec, coarse(40));
  const double cut = std::get<StandSpec>(preview.spec).flatten_mm;
  EXPECT_GT(cut, 0);
  EXPECT_NEAR(bounding_box(preview.outside).min().z(), bounding_box(egg).min().z() + cut, 1e-9);
}

TEST(Preview, SaysWhatOnlyAWholeRunFinds) {
  TargetSpec all;
  for (auto& wanted : all.wanted) wanted = 0;
  for (const MomentIndex number : {M1, MXX, MYY, MZZ}) all.wanted[number] = 100;
  FloatSpec balls = afloat(30);
  balls.print.balls.count = 2;
  balls.print.balls.diameter_mm = 6;
  balls.print.balls.density_g_cm3 = 7.8;
  for (const Spec& spec : {Spec(all), Spec(balls)}) {
    try {
      Previewer(boat()).look(spec, coarse(40));
      ADD_FAILURE();
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::usage);
      EXPECT_NE(std::string(error.what()).find("by a whole run only"), std::string::npos) << error.what();
    }
  }
}

TEST(Preview, StopsWhenItIsTold) {
  const Progress stopped{.stage = {}, .cancelled = [] { return true; }};
  Previewer previewer(boat());
  try {
    previewer.look(afloat(30), coarse(60), stopped);
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::interrupted);
  }
  expect_same(previewer.look(afloat(30), coarse(60)), Previewer(boat()).look(afloat(30), coarse(60)));
}

}  // namespace
}  // namespace rayrep
