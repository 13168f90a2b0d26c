// Heavy cores, and bodies that are fixed inside and not printed: known masses that a maker counts and a judge weighs.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "mesh/surface_gap.h"
#include "places.h"
#include "ray_problems.h"
#include "rayrep/advice/suggest.h"
#include "rayrep/base/error.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/judge/verify.h"
#include "rayrep/make/hollow.h"
#include "rayrep/mesh/mesh_check.h"
#include "rayrep/physics/materials.h"
#include "runs.h"
#include "solids.h"

namespace rayrep::test {
namespace {

Mesh egg() { return rotated(uv_ellipsoid(36, 28, 22, 48), random_rotation(3)); }

/// Higher than wide: hollowed it is heavier about a horizontal axis than about its own.
Mesh tall_egg() { return uv_ellipsoid(24, 24, 26, 48); }

Part insert(Mesh mesh, double density_g_cm3) {
  return {.mesh = std::move(mesh), .role = Part::Role::insert, .density_g_cm3 = density_g_cm3};
}

Mesh core_of(const Delivery& delivery) { return delivery.mesh_of(Part::Role::insert); }

double mass_g(const Delivery& delivery) {
  double sum = 0;
  for (const Part& part : delivery.parts) sum += 1e-3 * part.density_g_cm3 * mesh_moments(part.mesh)[M1];
  return sum;
}

double value_of(const Verdict& verdict, const std::string& name) {
  for (const Criterion& c : verdict.criteria)
    if (c.name == name) return c.value;
  ADD_FAILURE() << name;
  return 0;
}

TEST(Core, HasRoomBesideWhatIsKeptSolid) {
  SpinSpec spec;
  spec.print.core = {7.29, "", {}, 0, 0.1};
  const Mesh bird = read_mesh(source_folder() / "examples" / "bird.stl").mesh;
  HollowOptions options = coarse(40);
  options.keep_solid = {box({-4, -4, 25}, {4, 4, 60})};
  const HollowResult result = hollow(bird, spec, options);
  EXPECT_LT(value_of(verify(result.delivery, &bird, result.spec), "inserts_fit"), 0.05);
}

TEST(Core, IsDeliveredProvenAndWeighed) {
  StandSpec standing;
  standing.contact_tolerance_mm = 2;
  FloatSpec floating;
  floating.fluid_g_cm3 = 2.5;
  SpinSpec spinning;
  spinning.axis.through = SpinAxis::Through::centre_of_mass;
  for (Spec spec : {Spec(standing), Spec(floating), Spec(spinning)}) {
    const bool spins = std::holds_alternative<SpinSpec>(spec);
    const Mesh body = spins ? tall_egg() : egg();
    for (const double partition_mm : {0.0, 1.0}) {
      std::visit([&](auto& s) { s.print.core = {7.29, "", {}, partition_mm, 0.1}; }, spec);
      const HollowResult result = hollow(body, spec, coarse(50));
      EXPECT_LT(result.as_built_error, 1e-6);
      EXPECT_LT(std::abs(result.duality_gap.value_or(0)), 1e-6);
      const Verdict verdict = verify(result.delivery, &body, result.spec);
      EXPECT_EQ(failed(verdict), Names()) << partition_mm;
      EXPECT_NEAR(verdict.body.mass_g, mass_g(result.delivery), 1e-9 * verdict.body.mass_g);
      EXPECT_TRUE(is_closed_solid(core_of(result.delivery)));
      EXPECT_LT(value_of(verdict, "inserts_fit"), partition_mm > 0 ? 1e-9 : 0.03);
      EXPECT_TRUE(mentions(verdict.notes.back(), {"Assumed", "cannot move"}));
    }
  }
}

TEST(Core, MakesATopOfWhatVoidsCannot) {
  SpinSpec spec;
  spec.axis.through = SpinAxis::Through::centre_of_mass;
  const Mesh body = uv_ellipsoid(24, 24, 56, 48);
  EXPECT_TRUE(mentions(message_of([&] { hollow(body, spec, coarse(50)); }, ErrorCode::goal), {"would not spin stably"}));
  spec.print.core.density_g_cm3 = 8.1;
  const HollowResult result = hollow(body, spec, coarse(50));
  EXPECT_EQ(failed(verify(result.delivery, &body, result.spec)), Names());
}

TEST(Core, OfThePrintsOwnDensityIsMaterialLeftIn) {
  StandSpec spec;
  spec.contact_tolerance_mm = 2;
  const HollowResult cavity = hollow(egg(), spec, coarse(50));
  spec.print.core.density_g_cm3 = spec.print.density_g_cm3 * (1 + 1e-12);
  spec.print.core.clearance_mm = 0;
  const HollowResult core = hollow(egg(), spec, coarse(50));
  const Moments a = mesh_moments(cavity.delivery.body());
  const Moments b = mesh_moments(core.delivery.body()) + mesh_moments(core_of(core.delivery));
  // On the grid of such coarse rays two cavities are told apart by this.
  expect_moments_near(b, a, 2e-3, 36);
  EXPECT_NEAR(core.solve.objective, cavity.solve.objective, 2e-3 * std::abs(cavity.solve.objective));
}

TEST(Core, TargetsAndCertificatesHoldWithIt) {
  const Mesh body = egg();
  TargetSpec target;
  target.print.core.density_g_cm3 = 7.29;
  const double solid_g = 1e-3 * target.print.density_g_cm3 * mesh_moments(body)[M1];
  target.wanted[M1] = 1.6 * solid_g;  // more than plastic can weigh
  target.wanted[MX] = 0;
  const HollowResult heavy = hollow(body, target, coarse(50));
  EXPECT_EQ(failed(verify(heavy.delivery, &body, heavy.spec)), Names());
  EXPECT_LT(std::abs(*heavy.duality_gap), 1e-6);
  target.wanted[M1] = 8 * solid_g;
  const std::string refused = message_of([&] { hollow(body, target, coarse(50)); }, ErrorCode::goal);
  EXPECT_TRUE(mentions(refused, {"Even with a core that takes all the room", "it weighs only"}));

  SpinSpec spec;
  spec.axis.through = SpinAxis::Through::centre_of_mass;
  spec.print.core.density_g_cm3 = 8.1;
  spec.certify = true;
  const HollowResult top = hollow(tall_egg(), spec, coarse(50));
  ASSERT_TRUE(top.certificate);
  EXPECT_TRUE(top.certificate->closed);
  EXPECT_LE(top.certificate->lower_bound, top.certificate->best.objective);
  spec.print.core.volume_cm3 = 5;
  EXPECT_TRUE(
      mentions(message_of([&] { hollow(tall_egg(), spec, coarse(50)); }, ErrorCode::usage), {"--certify", "--core-volume"}));
}

TEST(Core, KeepsItsPartitionFromTheVoid) {
  StandSpec spec;
  spec.contact_tolerance_mm = 2;
  spec.print.core = {core_material("steel-shot").density_g_cm3, "steel-shot", {}, {}, 0.1};
  EXPECT_TRUE(spec.print.core.poured());
  const HollowResult result = hollow(egg(), spec, coarse(50));
  const Mesh core = core_of(result.delivery);
  // Every shell of the body is the outside, the core's room, or a void.
  Mesh voids;
  const Mesh body = result.delivery.body();
  for (const Mesh& shell : split(body, connected_components(body))) {
    const double volume = mesh_moments(shell)[M1];
    if (volume < 0 && std::abs(volume + mesh_moments(core)[M1]) > 1e-9 * mesh_moments(core)[M1]) append(voids, shell);
  }
  ASSERT_FALSE(voids.triangles.empty());
  const SurfaceQuery surface(core);
  EXPECT_GT(smallest_gap(voids, surface), 0.97 * spec.print.wall_mm);
  EXPECT_LT(smallest_gap(voids, surface), 1.3 * spec.print.wall_mm);
}

TEST(Core, MustBeHeavierThanThePrintAndGoesWithoutInfill) {
  SpinSpec spec;
  spec.print.core.density_g_cm3 = 1.0;
  EXPECT_TRUE(
      mentions(message_of([&] { hollow(egg(), spec, coarse(50)); }, ErrorCode::usage), {"heavier than what is printed", "1.24"}));
  spec.print.core.density_g_cm3 = 7800;
  EXPECT_TRUE(mentions(message_of([&] { hollow(egg(), spec, coarse(50)); }, ErrorCode::usage), {"--core-density", "kg/m3"}));
  spec.print.core.density_g_cm3 = 7.8;
  spec.print.infill.percent = 15;
  EXPECT_TRUE(mentions(message_of([&] { hollow(egg(), spec, coarse(50)); }, ErrorCode::usage), {"core", "--infill"}));
  for (const CoreMaterial& m : core_materials()) EXPECT_EQ(&core_material(m.name), &m);
  EXPECT_TRUE(
      mentions(message_of([] { core_material("unobtainium"); }, ErrorCode::usage), {"unobtainium", "lead-shot", "--core-density"}));
}

TEST(Suggest, ACoreWhereItHelps) {
  SpinSpec spec;
  spec.axis.through = SpinAxis::Through::centre_of_mass;
  const Advice advice = suggest(uv_ellipsoid(24, 24, 56, 48), spec, coarse(50));
  bool core = false;
  for (const Suggestion& s : advice.suggestions) core = core || s.options.front().first == "core-material";
  EXPECT_TRUE(core);
}

TEST(Fixed, IsAKnownMassWithARoomOfItsOwn) {
  const Mesh body = uv_ellipsoid(36, 28, 22, 48);
  HollowOptions options = coarse(50);
  const Mesh coin = moved(cylinder(8, 2, 48), {10, 3, -9});
  options.fixed = {{insert(coin, 8.9)}};
  FloatSpec floating;
  StandSpec standing;
  standing.contact_tolerance_mm = 2;
  TargetSpec target;
  target.wanted[M1] = 80;
  target.wanted[MX] = 3;
  for (const Spec& spec : {Spec(floating), Spec(standing), Spec(target)}) {
    const HollowResult result = hollow(body, spec, options);
    EXPECT_LT(result.as_built_error, 1e-6);
    const Verdict verdict = verify(result.delivery, &body, result.spec);
    EXPECT_EQ(failed(verdict), Names());
    EXPECT_NEAR(verdict.body.mass_g, mass_g(result.delivery), 1e-9 * verdict.body.mass_g);
    EXPECT_EQ(core_of(result.delivery).vertices, coin.vertices);
    // The body alone would not do: the coin is a part of what was judged.
    const Verdict without = verify(result.delivery.body(), &body, result.spec);
    EXPECT_NE(without.body.mass_g, verdict.body.mass_g);
    // Its room is where it is, and farther from any cavity than the wall.
    const SurfaceQuery surface(coin);
    const Mesh printed = result.delivery.body();
    Mesh others;
    for (const Mesh& shell : split(printed, connected_components(printed)))
      if (std::abs(mesh_moments(shell)[M1] + mesh_moments(coin)[M1]) > 1e-9) append(others, shell);
    EXPECT_GT(smallest_gap(others, surface), 0.98 * print_of(spec).wall_mm);
  }
}

TEST(Fixed, MustLieInsideWithTheWallAroundIt) {
  const Mesh body = box({0, 0, 0}, {40, 40, 30});
  const auto refuses = [&](std::vector<Part> fixed, ErrorCode code, std::initializer_list<const char*> words) {
    HollowOptions options = coarse(50);
    for (Part& part : fixed) options.fixed.push_back({std::move(part)});
    EXPECT_TRUE(mentions(message_of([&] { hollow(body, StandSpec{}, options); }, code), words));
  };
  const Mesh coin = box({10, 10, 10}, {20, 20, 12});
  refuses({insert(moved(coin, {25, 0, 0}), 8)}, ErrorCode::goal, {"Fixed body 1", "does not lie inside"});
  refuses({insert(moved(coin, {100, 0, 0}), 8)}, ErrorCode::goal, {"does not lie inside"});
  refuses({insert(moved(coin, {0, 0, -9.5}), 8)}, ErrorCode::goal, {"0.5", "wall of 1.2", "--wall"});
  refuses({insert(coin, 8), insert(box({12, 12, 10.5}, {14, 14, 11.5}), 8)}, ErrorCode::goal, {"Fixed body 2", "meets another"});
  refuses({insert(coin, 8), insert(moved(coin, {0, 0, 2.5}), 8)}, ErrorCode::goal, {"Fixed body 2", "0.5"});
  refuses({insert(coin, 0)}, ErrorCode::usage, {"Fixed body 1", "density"});
  refuses({insert(flipped(coin), 8)}, ErrorCode::usage, {"faces outward"});
}

TEST(Inserts, ThatHaveNoRoomFail) {
  const Mesh body = box({0, 0, 0}, {40, 40, 30});
  const Mesh room = box({10, 10, 10}, {30, 30, 20});
  const auto judged = [&](const std::vector<Mesh>& inserts) {
    Delivery delivered = delivery(hollow(body, room));
    for (const Mesh& mesh : inserts) delivered.parts.push_back(insert(mesh, 8));
    return verify(delivered, &body, StandSpec{});
  };
  EXPECT_EQ(failed(judged({room})), Names());
  EXPECT_EQ(failed(judged({box({10, 10, 10}, {20, 30, 20}), box({20, 10, 10}, {30, 30, 20})})), Names());
  EXPECT_NEAR(value_of(judged({moved(room, {0, 0, 0.5})}), "inserts_fit"), 0.5, 1e-12);
  EXPECT_EQ(failed(judged({moved(room, {0, 0, 0.5})})), Names({"inserts_fit"}));
  EXPECT_EQ(failed(judged({moved(room, {0, 0, 0.05})})), Names());
  EXPECT_EQ(failed(judged({room, box({12, 12, 12}, {28, 28, 18})})), Names({"inserts_fit"}));
  EXPECT_GT(value_of(judged({moved(room, {100, 0, 0})}), "inserts_fit"), 70);
  // Through a plate, with no corner and no middle of a triangle in it.
  Delivery parted = delivery(hollow(body, merged({box({10, 10, 10}, {30, 30, 14.8}), box({10, 10, 15.2}, {30, 30, 20})})));
  parted.parts.push_back(insert(box({19, 19, 10.5}, {21, 21, 19.5}), 8));
  EXPECT_EQ(failed(verify(parted, &body, StandSpec{})), Names({"inserts_fit"}));
  Mesh open = room;
  open.triangles.pop_back();
  EXPECT_EQ(failed(judged({open})), Names({"inserts_fit"}));
}

TEST(Inserts, AreNotWrittenWithTheBody) {
  Delivery delivered = delivery(box({0, 0, 0}, {40, 40, 30}));
  delivered.parts.push_back(insert(box({10, 10, 10}, {20, 20, 20}), 8));
  for (const char* ending : {".stl", ".3mf"}) {
    const std::filesystem::path path = own_file(std::string("insert") + ending);
    write_delivery(path, delivered);
    EXPECT_EQ(read_mesh(path).mesh.triangles.size(), 12U);
    std::filesystem::remove(path);
  }
}

Mesh balls_of(const HollowResult& result) { return core_of(result.delivery); }

TEST(Balls, LieInPocketsWhereTheyDoMost) {
  const Mesh body = uv_ellipsoid(36, 28, 22, 48);
  StandSpec standing;
  standing.contact_tolerance_mm = 2;
  FloatSpec floating;
  for (Spec spec : {Spec(standing), Spec(floating)}) {
    const HollowResult without = hollow(body, spec, coarse(50));
    std::visit([](auto& s) { s.print.balls = {4, 6, 7.85, 0.1}; }, spec);
    const HollowResult result = hollow(body, spec, coarse(50));
    ASSERT_EQ(result.balls.size(), 4U);
    EXPECT_EQ(failed(verify(result.delivery, &body, result.spec)), Names());
    EXPECT_NEAR(mesh_moments(balls_of(result))[M1], 4 * kPi * 36, 1e-9 * 36);
    const Eigen::Vector3d lowest = bounding_box(body).min();
    double last = 0;
    for (const Ball& ball : result.balls) {
      // Standing and floating take them as low as they go: a pocket and a wall above the bottom, within a ball's size.
      EXPECT_LT(ball.centre_mm.z() - lowest.z(), 10);
      const double shaft_mm = ball.pause_mm - (ball.centre_mm.z() - lowest.z());
      EXPECT_GE(shaft_mm, 3.1 - 1e-9);
      EXPECT_LE(shaft_mm, 3.6 + 1e-9);
      EXPECT_GE(ball.pause_mm, last);
      last = ball.pause_mm;
      for (const Ball& other : result.balls)
        if (&other != &ball) {
          EXPECT_GT((other.centre_mm - ball.centre_mm).norm(), 6.2 + print_of(spec).wall_mm);
        }
    }
    EXPECT_EQ(result.delivery.pauses_mm.back(), last);
    if (std::holds_alternative<StandSpec>(spec)) {
      EXPECT_LT(result.solve.objective, without.solve.objective);
      EXPECT_TRUE(mentions(result.proof.back(), {"balls", "shared out"}));
    }
  }
}

TEST(Balls, ThatHaveNoRoomAreRefused) {
  StandSpec spec;
  spec.print.balls = {40, 8, 7.85, 0.1};
  const std::string message = message_of([&] { hollow(box({0, 0, 0}, {40, 40, 14}), spec, coarse(50)); }, ErrorCode::goal);
  EXPECT_TRUE(mentions(message, {"There is room for", "of the 40 balls", "--ball-diameter"}));
  spec.print.balls.density_g_cm3 = 1;
  EXPECT_TRUE(mentions(message_of([&] { hollow(egg(), spec, coarse(50)); }, ErrorCode::usage), {"heavier than what is printed"}));
  spec.print.balls.density_g_cm3 = 7.85;
  spec.print.core.density_g_cm3 = 8;
  EXPECT_TRUE(mentions(message_of([&] { hollow(egg(), spec, coarse(50)); }, ErrorCode::usage), {"core", "--balls"}));
}

TEST(Core, OfWhichThereIsLittleIsLowAndNoMore) {
  StandSpec spec;
  spec.contact_tolerance_mm = 2;
  spec.print.core = {7.29, "tin", {}, {}, 0.1};
  const HollowResult much = hollow(egg(), spec, coarse(50));
  const double all_cm3 = 1e-3 * mesh_moments(core_of(much.delivery))[M1];
  double last = much.solve.objective;
  for (const double share : {0.6, 0.2}) {
    spec.print.core.volume_cm3 = share * all_cm3;
    const HollowResult result = hollow(egg(), spec, coarse(50));
    const Mesh body = egg();
    EXPECT_EQ(failed(verify(result.delivery, &body, result.spec)), Names()) << share;
    const double volume = 1e-3 * mesh_moments(core_of(result.delivery))[M1];
    EXPECT_LT(volume, share * all_cm3);
    EXPECT_GT(volume, 0.6 * share * all_cm3);  // the partition takes some
    EXPECT_GT(result.price, 0);
    EXPECT_GT(result.solve.objective, last);
    EXPECT_LT(std::abs(*result.duality_gap), 1e-4);
    last = result.solve.objective;
  }
}

}  // namespace
}  // namespace rayrep::test
