// The loop over slices, with printers made of formulas.

#include <gtest/gtest.h>

#include <cmath>

#include "rayrep/base/error.h"
#include "rayrep/judge/verify.h"
#include "rayrep/make/hollow.h"
#include "rayrep/mesh/mesh_check.h"
#include "runs.h"
#include "solids.h"

namespace rayrep::test {
namespace {

Moments moments_of_body(const Mesh& mesh) { return mesh_moments(mesh); }
Moments moments_of_delivery(const Delivery& delivery) { return mesh_moments(delivery.body()); }

/// Lays down somewhat more than the mesh, as slicers do: everywhere, and near the surface of cavities.
Moments printed(const Mesh& mesh) {
  Moments s = 1.01 * moments_of_body(mesh);
  const Mesh outside = outer_hull(mesh);
  const Moments cavity = moments_of_body(outside) - moments_of_body(mesh);
  return s + translated(0.02 * cavity, {0.5, -0.3, 0.2});
}

Mesh tilted_ellipsoid() { return rotated(uv_ellipsoid(30, 22, 16, 40), random_rotation(3)); }

TEST(AsPrinted, WhatIsPrintedMeetsTheGoal) {
  const Mesh body = tilted_ellipsoid();
  FloatSpec afloat;
  StandSpec standing;
  standing.contact_tolerance_mm = 2;
  for (const Spec& spec : {Spec(afloat), Spec(standing)}) {
    HollowOptions options = coarse(40);
    const HollowResult plain = hollow(body, spec, options);
    options.as_printed = [](const Delivery& delivery) { return printed(delivery.body()); };
    const HollowResult result = hollow(body, spec, options);
    ASSERT_GE(result.slices.size(), 2U);
    EXPECT_GT(result.slices.front().error, 1e-3);
    EXPECT_LT(result.slices[result.best_slice].error, options.as_printed_tolerance);
    EXPECT_FALSE(result.gave_way);
    EXPECT_TRUE(plain.slices.empty());
    const Mesh made = result.delivery.body();
    const Verdict verdict = verify(PrintedDelivery{delivery(made), printed(made)}, &body, result.spec);
    for (const Criterion& c : verdict.criteria) EXPECT_TRUE(c.pass()) << c.name;
    // The mesh itself misses it, for it makes up for the printer.
    EXPECT_GT(std::abs(moments_of_body(made)[M1] / moments_of_body(plain.delivery.body())[M1] - 1), 1e-3);
  }
}

TEST(AsPrinted, APrinterThatLaysDownTheMeshIsAskedOnce) {
  HollowOptions options = coarse(40);
  options.as_printed = moments_of_delivery;
  const HollowResult result = hollow(tilted_ellipsoid(), FloatSpec{}, options);
  EXPECT_EQ(result.slices.size(), 1U);
  options.as_printed = nullptr;
  const HollowResult plain = hollow(tilted_ellipsoid(), FloatSpec{}, options);
  const Mesh a = result.delivery.body();
  const Mesh b = plain.delivery.body();
  EXPECT_EQ(a.vertices, b.vertices);
  EXPECT_EQ(a.triangles, b.triangles);
}

TEST(AsPrinted, APrinterThatJumpsMovesTheWaterlineThatWasLeftOpen) {
  HollowOptions options = coarse(40);
  // Whole layers only: 3 % of the mass.
  options.as_printed = [](const Delivery& delivery) {
    const Mesh mesh = delivery.body();
    const Moments s = moments_of_body(mesh);
    const double layer = 0.03 * moments_of_body(outer_hull(mesh))[M1];
    return Moments(s * (std::ceil(s[M1] / layer) * layer / s[M1]));
  };
  const Mesh body = tilted_ellipsoid();
  const HollowResult result = hollow(body, FloatSpec{}, options);
  EXPECT_EQ(result.slices.size(), static_cast<std::size_t>(options.max_slices));
  EXPECT_TRUE(result.gave_way);
  const Mesh made = result.delivery.body();
  EXPECT_TRUE(verify(PrintedDelivery{result.delivery, options.as_printed(result.delivery)}, &body, result.spec).pass());

  FloatSpec fixed;
  fixed.waterline_mm = *std::get<FloatSpec>(result.spec).waterline_mm + 0.3;
  const HollowResult held = hollow(body, fixed, options);
  EXPECT_FALSE(held.gave_way);
  EXPECT_EQ(std::get<FloatSpec>(held.spec).waterline_mm, fixed.waterline_mm);
}

TEST(AsPrinted, ABodyWithAllTenNumbersIsRefused) {
  HollowOptions options = coarse(40);
  options.as_printed = moments_of_delivery;
  const Mesh body = uv_ellipsoid(30, 22, 16, 40);
  const HollowResult made = hollow(body, FloatSpec{}, coarse(40));
  const MassProperties mass = mass_properties(made.delivery.body(), 1.24);
  TargetSpec all;
  for (int k = M1; k <= MXZ; ++k) all.wanted[static_cast<std::size_t>(k)] = inertial_number(mass, static_cast<MomentIndex>(k));
  try {
    hollow(body, all, options);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::usage);
  }
}

}  // namespace
}  // namespace rayrep::test
