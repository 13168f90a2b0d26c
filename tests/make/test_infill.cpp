// Sparse regions instead of cavities: the same mathematics, with rays that weigh less.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "example_shapes.h"
#include "ray_problems.h"
#include "rayrep/advice/suggest.h"
#include "rayrep/base/error.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/judge/verify.h"
#include "rayrep/make/hollow.h"
#include "rayrep/mesh/mesh_check.h"
#include "rayrep/rays/ray_integrals.h"
#include "rayrep/solve/quadric.h"
#include "runs.h"
#include "solids.h"

namespace rayrep::test {
namespace {

Mesh tilted_ellipsoid() { return rotated(uv_ellipsoid(40, 30, 24, 48), random_rotation(3)); }

FloatSpec afloat(double percent_laid_down) {
  FloatSpec spec;
  spec.print.infill.percent = 20;
  spec.print.infill.percent_laid_down = percent_laid_down;
  return spec;
}

double figure(const Verdict& verdict, const std::string& name) {
  for (const Figure& f : verdict.figures)
    if (f.name == name) return std::get<double>(f.value);
  ADD_FAILURE() << name;
  return 0;
}

TEST(Infill, WeightedRaysAreScaledOnesBitForBit) {
  for (std::uint64_t n = 0; n < 40; ++n) {
    SCOPED_TRACE(n);
    Random random(n);
    RayBody body = random_body(random, 50);
    const RayIntegrals rays(body.domain);
    body.domain.grid.weight = 0.25;
    const RayIntegrals light(body.domain);
    EXPECT_EQ(light.full(), Moments(0.25 * rays.full()));
    const double volume = body.shell[M1] + rays.full()[M1];
    const QuadricSolution a = solve_quadric(stand_goal({0.1, -0.1}, volume, body.length_mm), rays, body.shell);
    const QuadricSolution b = solve_quadric(stand_goal({0.1, -0.1}, 0.25 * volume, body.length_mm), light, 0.25 * body.shell);
    EXPECT_EQ(a.converged, b.converged);
    EXPECT_EQ(a.infeasible, b.infeasible);
    if (!a.converged) continue;
    EXPECT_EQ(Moments(0.25 * a.moments), b.moments);
    EXPECT_EQ(a.evaluations, b.evaluations);
    EXPECT_EQ(a.objective, b.objective);
  }
}

TEST(Infill, WithNothingLaidDownItIsTheCavity) {
  const Mesh body = tilted_ellipsoid();
  HollowOptions options = coarse(50);
  options.min_cavity_mm3 = 100;
  const FloatSpec spec = afloat(0);
  FloatSpec hollowed = spec;
  hollowed.print.infill = {};
  const HollowResult sparse = hollow(body, spec, options);
  const HollowResult cavity = hollow(body, hollowed, options);
  EXPECT_FALSE(cavity.delivery.has_infill());
  ASSERT_TRUE(sparse.delivery.has_infill());
  EXPECT_EQ(sparse.delivery.body().triangles, body.triangles);
  EXPECT_EQ(sparse.delivery.solid().vertices, cavity.delivery.body().vertices);
  EXPECT_EQ(sparse.delivery.solid().triangles, cavity.delivery.body().triangles);
}

TEST(Infill, IsDeliveredProvenAndJudged) {
  const Mesh body = tilted_ellipsoid();
  StandSpec standing;
  standing.contact_tolerance_mm = 2;
  standing.print = afloat(25).print;
  SpinSpec spinning;
  spinning.print = standing.print;
  double last_mm = 0;
  for (const Spec& spec : {Spec(afloat(5)), Spec(afloat(25)), Spec(afloat(45)), Spec(standing), Spec(spinning)}) {
    const HollowResult result = hollow(std::holds_alternative<SpinSpec>(spec) ? icosphere(30, 4) : body, spec, coarse(50));
    EXPECT_LT(result.as_built_error, 1e-6);
    EXPECT_LT(std::abs(result.duality_gap.value_or(0)), 1e-6);
    const Mesh original = result.delivery.body();
    const Verdict verdict = verify(result.delivery, &original, result.spec);
    for (const Criterion& c : verdict.criteria) EXPECT_TRUE(c.pass()) << c.name;
    EXPECT_TRUE(mentions(verdict.notes.back(), {"Assumed", "20.0 %", "of their room"}));
    // By the closed form: all of the solid, less what the region lacks.
    const Part& region = result.delivery.parts.back();
    const double volume = mesh_moments(original)[M1] - (1 - region.infill->share) * mesh_moments(region.mesh)[M1];
    EXPECT_NEAR(verdict.body.mass_g, 1.24e-3 * volume, 1e-12 * verdict.body.mass_g);
    // Of more infill it floats deeper.
    if (std::holds_alternative<FloatSpec>(spec)) {
      EXPECT_GT(*std::get<FloatSpec>(result.spec).waterline_mm, last_mm);
      last_mm = *std::get<FloatSpec>(result.spec).waterline_mm;
      EXPECT_NEAR(figure(verdict, "mass_g") / figure(verdict, "displaced_mass_g"), 1, 1e-6);
    }
  }
}

TEST(Infill, ARegionThatReachesTheSkinOrCrossesAnotherFails) {
  const Mesh body = box({0, 0, 0}, {40, 40, 30});
  StandSpec spec;
  const auto failed = [&](const std::vector<Mesh>& regions) {
    Delivery delivered = delivery(body);
    for (const Mesh& region : regions)
      delivered.parts.push_back({.mesh = region, .role = Part::Role::modifier, .infill = SparseInfill{15, "gyroid", 0.15}});
    std::string names;
    for (const Criterion& c : verify(delivered, &body, spec).criteria)
      if (!c.pass()) names += c.name + " ";
    return names;
  };
  EXPECT_EQ(failed({box({5, 5, 5}, {35, 35, 25})}), "");
  EXPECT_EQ(failed({box({5, 5, 0.5}, {35, 35, 25})}), "wall ");
  EXPECT_EQ(failed({box({5, 5, 5}, {35, 35, 15}), box({8, 8, 10}, {30, 30, 20})}), "closed no_crossings ");
}

/// Vertices may be numbered otherwise.
void expect_same_corners(const Mesh& a, const Mesh& b) {
  ASSERT_EQ(a.triangles.size(), b.triangles.size());
  for (std::size_t t = 0; t < a.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k) EXPECT_EQ(a.corner(t, k), b.corner(t, k));
}

TEST(Infill, WhatIsGuessedOfAPatternIsSaid) {
  const Mesh body = box({0, 0, 0}, {40, 40, 30});
  const auto note = [&](const std::string& pattern) {
    Delivery delivered = delivery(body);
    delivered.parts.push_back(
        {.mesh = box({5, 5, 5}, {35, 35, 25}), .role = Part::Role::modifier, .infill = SparseInfill{15, pattern, 0.15}});
    return verify(delivered, &body, StandSpec{}).notes.back();
  };
  EXPECT_EQ(note("gyroid").find("measured"), std::string::npos);
  EXPECT_TRUE(mentions(note("gyroid"), {"--goal GOAL --original MESH", "--slicer"}));
  EXPECT_TRUE(mentions(note("hilbertcurve"), {"hilbertcurve was not measured"}));
  EXPECT_TRUE(mentions(note(""), {"the pattern was not measured"}));
  EXPECT_TRUE(mentions(note("lightning"), {"other shares at other places"}));
}

TEST(Infill, AThreeMfFileKeepsIt) {
  const Mesh body = box({0, 0, 0}, {40, 40, 30});
  Delivery made = delivery(body);
  made.parts.push_back(
      {.mesh = box({5, 5, 5}, {35, 35, 25}), .role = Part::Role::modifier, .infill = SparseInfill{12.5, "cubic", 0.13}});
  const std::filesystem::path path = own_file("infill.3mf");
  for (const ThreeMfFlavor flavor : {ThreeMfFlavor::prusa, ThreeMfFlavor::bambu, ThreeMfFlavor::core}) {
    write_delivery(path, made, flavor);
    const MeshFile file = read_mesh(path);
    expect_same_corners(file.mesh, body);
    ASSERT_EQ(file.modifiers.size(), 1U);
    expect_same_corners(file.modifiers[0].mesh, made.parts[1].mesh);
    EXPECT_EQ(file.modifiers[0].infill->percent, 12.5);
    EXPECT_EQ(file.modifiers[0].infill->pattern, "cubic");
    ASSERT_EQ(file.notes.size(), 1U);
  }
  try {
    write_delivery(own_file("infill.stl"), made);
    ADD_FAILURE() << "an STL file holds no modifier";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::usage);
  }
}

TEST(Infill, SharesGrowWithThePercentageAndSkinsWithTheLayers) {
  for (const std::string& pattern : infill_patterns()) {
    double last = 0;
    for (double percent = 1; percent <= 100; percent += 0.5) {
      EXPECT_GT(infill_share(pattern, percent), last) << pattern << " " << percent;
      last = infill_share(pattern, percent);
    }
    EXPECT_EQ(last, 1);
  }
  EXPECT_EQ(infill_share("a pattern of tomorrow", 15), 0.15);
  EXPECT_EQ(Infill{}.share(), 0);
  EXPECT_EQ((Infill{.percent = 20, .percent_laid_down = 21.5}).share(), 0.215);
  // A file says what the slicer calls it; what comes of that is said, or known.
  Delivery read = delivery(box({0, 0, 0}, {2, 2, 2}));
  read.parts.push_back({.mesh = {}, .role = Part::Role::modifier, .infill = SparseInfill{15, "gyroid", 0.15}});
  assume_shares(read, 21.5);
  EXPECT_EQ(read.parts[1].infill->share, 0.215);
  assume_shares(read, {});
  EXPECT_EQ(read.parts[1].infill->share, infill_share("gyroid", 15));
  EXPECT_NEAR((Infill{.perimeters = 4, .extrusion_width_mm = 0.5}).skin_mm(), 2, 1e-12);
  EXPECT_NEAR((Infill{.bottom_layers = 12, .layer_height_mm = 0.25}).skin_mm(), 3, 1e-12);
}

TEST(Infill, LessOfItOrACavityIsAdvised) {
  FloatSpec spec = afloat(0);
  spec.print.infill = {.percent = 60};
  spec.waterline_mm = 20;
  std::vector<std::vector<std::pair<std::string, std::string>>> options;
  for (const Suggestion& s : suggest(tilted_ellipsoid(), spec, coarse(50)).suggestions) options.push_back(s.options);
  const std::vector<std::pair<std::string, std::string>> cavity = {{"cavity", "void"}, {"infill", "0"}};
  const bool less = std::any_of(options.begin(), options.end(),
                                [&](const auto& o) { return o == cavity || (o.size() == 1 && o[0].first == "infill"); });
  EXPECT_TRUE(less) << options.size();
}

TEST(Infill, WhatMakesNoSenseIsRefused) {
  FloatSpec spec = afloat(20);
  spec.print.wall_mm = 0.8;
  EXPECT_THROW(check(spec, Setting::For::making), Error);
  spec.print.wall_mm = 1.2;
  EXPECT_NO_THROW(check(spec, Setting::For::making));
  spec.print.infill.pattern = "lightning";
  EXPECT_THROW(check(spec, Setting::For::making), Error);
  spec.print.infill.pattern = "a pattern of tomorrow";
  EXPECT_NO_THROW(check(spec, Setting::For::making));
  spec.print.liquid_g_cm3 = 1.1;
  EXPECT_THROW(check(spec, Setting::For::making), Error);
}

}  // namespace
}  // namespace rayrep::test
