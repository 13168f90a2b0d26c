// Bodies in pieces: planes that open cavities, pins, and how they are judged.

#include <gtest/gtest.h>

#include <algorithm>

#include "make/cut_search.h"
#include "mesh/prism.h"
#include "mesh/shells.h"
#include "rayrep/base/error.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/judge/kept_solid.h"
#include "rayrep/judge/verify.h"
#include "rayrep/make/hollow.h"
#include "rayrep/mesh/assembly.h"
#include "runs.h"
#include "solids.h"

namespace rayrep::test {
namespace {

std::size_t inward_shells(const Mesh& mesh) {
  const Components shells = connected_components(mesh);
  std::size_t count = 0;
  for (const double volume : shell_volumes(mesh, shells.of_triangle, shells.count)) count += volume < 0;
  return count;
}

std::vector<const Part*> parts_of(const Delivery& delivery, Part::Role role) {
  std::vector<const Part*> parts;
  for (const Part& part : delivery.parts)
    if (part.role == role) parts.push_back(&part);
  return parts;
}

Job<FloatSpec> afloat_in_pieces() {
  Job<FloatSpec> job{.spec = {}, .hollow = coarse(40)};
  job.spec.waterline_mm = 18;
  job.spec.print.wall_mm = 2;
  job.spec.print.cut.where = Cut::Where::found;
  return job;
}

Mesh egg() { return uv_ellipsoid(30, 24, 18, 24); }

/// What was made of an egg, once for all tests.
const Outcome<FloatSpec>& made() {
  static const Outcome<FloatSpec> outcome = hollowed(egg(), afloat_in_pieces());
  return outcome;
}

/// But for how it comes to rest, which takes long.
Verdict judged(const Delivery& delivered, const Spec& spec, const Mesh& original) {
  Limits limits;
  limits.release_directions = 0;
  return verify(delivered, &original, spec, limits);
}

TEST(Cut, OnePlaneOpensUpToThreeCavitiesAndTwoOpenFive) {
  const Mesh outer = box({-40, -30, -20}, {40, 30, 20});
  for (std::uint64_t seed = 0; seed < 5; ++seed)
    for (std::size_t count = 1; count <= 5; ++count) {
      SCOPED_TRACE(seed * 10 + count);
      Random random(seed);
      std::vector<Eigen::Vector3d> middles;
      Mesh body = outer;
      while (middles.size() < count) {
        const Eigen::Vector3d p(random.uniform(-30, 30), random.uniform(-20, 20), random.uniform(-10, 10));
        if (std::any_of(middles.begin(), middles.end(), [&](const auto& q) { return (p - q).norm() < 14; })) continue;
        middles.push_back(p);
        append(body, flipped(icosphere(6, 2, p)));
      }
      const detail::CutWishes wishes{{Eigen::Vector3d::UnitZ()}, {}};
      const std::vector<Cut::Plane> planes = detail::cut_planes(body, wishes, {});
      EXPECT_LE(planes.size(), count <= 3 ? 1u : 2u);
      for (const Eigen::Vector3d& p : middles)
        EXPECT_TRUE(std::any_of(planes.begin(), planes.end(),
                                [&](const Cut::Plane& plane) { return std::abs(plane.normal.dot(p) - plane.offset_mm) < 6; }));
      std::vector<Mesh> pieces = {body};
      for (const Cut::Plane& plane : planes) {
        std::vector<Mesh> next;
        for (const Mesh& piece : pieces) {
          const Halves two = halves(piece, {plane.normal, plane.offset_mm});
          next.push_back(two.above);
          next.push_back(two.below);
        }
        pieces = next;
      }
      for (const Mesh& piece : pieces) EXPECT_EQ(inward_shells(piece), 0u);
    }
}

TEST(Cut, ASphereIsCutThroughItsMiddle) {
  const Mesh body = hollow(icosphere(20, 4), icosphere(15, 4));
  const std::vector<Cut::Plane> planes = detail::cut_planes(body, {{Eigen::Vector3d::UnitZ()}, {}}, {});
  ASSERT_EQ(planes.size(), 1u);
  EXPECT_EQ(planes.front().normal, Eigen::Vector3d::UnitZ());
  EXPECT_NEAR(planes.front().offset_mm, 0, 1);  // the grid of offsets
}

TEST(Cut, PinsHaveTheirWallAllAround) {
  // A ring of material 8 mm wide: with a wall of 2 mm there is room for holes of up to 4 mm.
  const Mesh body = hollow(box({-30, -30, -30}, {30, 30, 30}), box({-22, -22, -22}, {22, 22, 22}));
  const std::vector<Cut::Plane> planes = {{Eigen::Vector3d::UnitZ(), 0.3}};
  const std::vector<Eigen::Vector3d> places = detail::pin_places(body, planes, 0, {1.5, 5, 2}, {});
  ASSERT_EQ(places.size(), 3u);
  for (const Eigen::Vector3d& p : places) {
    EXPECT_NEAR(p.z(), 0.3, 1e-12);
    const double out = p.head<2>().cwiseAbs().maxCoeff();
    EXPECT_GE(out, 22 + 3.5 - 1e-9);
    EXPECT_LE(out, 30 - 3.5 + 1e-9);
  }
  EXPECT_GT((places[0] - places[1]).norm(), 40);
  EXPECT_TRUE(detail::pin_places(body, planes, 0, {2.5, 5, 2}, {}).empty());
  EXPECT_TRUE(detail::pin_places(body, {planes[0], {Eigen::Vector3d::UnitZ(), 2}}, 0, {1.5, 5, 2}, {}).empty());
}

TEST(Cut, PlanesAreMovedOffVertices) {
  const Mesh body = uv_ellipsoid(30, 20, 10, 24);  // with a ring of vertices in z = 0
  const Cut::Plane plane = detail::clear_of_vertices(body, {Eigen::Vector3d::UnitZ(), 0});
  EXPECT_LE(std::abs(plane.offset_mm), 0.02);
  for (const Eigen::Vector3d& v : body.vertices) EXPECT_GE(std::abs(v.z() - plane.offset_mm), 0.019);
}

TEST(Cut, AFloatInPiecesIsAsItWasWantedWithPinsAndHolesCounted) {
  const HollowResult& result = made();
  EXPECT_LE(result.as_built_error, 1e-6);
  EXPECT_EQ(parts_of(result.delivery, Part::Role::body).size(), 2u);
  EXPECT_GE(parts_of(result.delivery, Part::Role::insert).size(), 2u);
  EXPECT_EQ(print_of(result.spec).cut.planes.size(), 1u);
  const Mesh solid = egg();
  const Verdict verdict = verify(result.delivery, &solid, result.spec);
  EXPECT_EQ(failed(verdict), Names{});
  for (const char* name : {"pieces_closed", "pieces_add_up", "pieces_on_bed", "pieces_lie_flat", "pieces_apart", "cavities_opened",
                           "wall_at_pins", "inserts_fit", "outer_unchanged"})
    EXPECT_TRUE(std::any_of(verdict.criteria.begin(), verdict.criteria.end(), [&](const auto& c) { return c.name == name; }))
        << name;
  for (const Part* piece : parts_of(result.delivery, Part::Role::body)) {
    EXPECT_TRUE(is_closed_solid(piece->mesh));
    EXPECT_EQ(bounding_box(transformed(piece->mesh, piece->to_bed)).min().z(), 0);
  }
}

TEST(Cut, PiecesWeighWhatThePrintIsMadeOf) {
  Spec light = made().spec;
  print_of(light).density_g_cm3 = 0.9;
  const Verdict verdict = judged(made().delivery, light, egg());
  double told_g = 0;
  for (const Figure& figure : verdict.figures)
    if (figure.name == "pieces")
      for (const Record& piece : std::get<std::vector<Record>>(figure.value))
        for (const auto& [name, value] : piece)
          if (name == "mass_g") told_g += std::get<double>(value);
  double mm3 = 0;
  for (const Part* piece : parts_of(made().delivery, Part::Role::body)) mm3 += mesh_moments(piece->mesh)[M1];
  EXPECT_NEAR(told_g, 0.9e-3 * mm3, 1e-9);
}

double figure(const Verdict& verdict, const char* name) {
  for (const Figure& figure : verdict.figures)
    if (figure.name == name) return std::get<double>(figure.value);
  return -1;
}

TEST(Cut, PinsKeepAwayFromWhatIsKeptSolid) {
  // Where the first pin is without it.
  const Part* pin = parts_of(made().delivery, Part::Role::insert).front();
  const Eigen::AlignedBox3d around = bounding_box(pin->mesh);
  const std::vector<Mesh> regions = {box(around.min().array() - 1, around.max().array() + 1)};
  const auto kept_mm = [&](const HollowResult& result) {
    Verdict verdict;
    judge_kept_solid(result.delivery.solid(), {.regions = regions, .wall_mm = 2}, verdict);
    return 2 * verdict.criteria.at(0).value;
  };
  EXPECT_LT(kept_mm(made()), 0);
  Job<FloatSpec> job = afloat_in_pieces();
  job.hollow.keep_solid = regions;
  EXPECT_GE(kept_mm(hollowed(egg(), job)), 0.98 * 2);
}

TEST(Cut, RoofsAreToldOfEachPieceAndOfAllTogether) {
  const Verdict verdict = judged(made().delivery, made().spec, egg());
  double roofs_mm2 = 0;
  double widest_mm = 0;
  for (const Figure& of : verdict.figures)
    if (of.name == "pieces")
      for (const Record& piece : std::get<std::vector<Record>>(of.value))
        for (const auto& [name, value] : piece) {
          if (name == "roof_mm2") roofs_mm2 += std::get<double>(value);
          if (name == "widest_bridge_mm") widest_mm = std::max(widest_mm, std::get<double>(value));
        }
  EXPECT_GT(roofs_mm2, 0);
  EXPECT_EQ(figure(verdict, "roof_mm2"), roofs_mm2);
  EXPECT_EQ(figure(verdict, "widest_bridge_mm"), widest_mm);
  EXPECT_EQ(figure(verdict, "sealed_mm3"), 0);
  EXPECT_TRUE(std::any_of(verdict.meaning.begin(), verdict.meaning.end(), [](const std::string& text) {
    return bool(mentions(text, {"piece", "the widest bridge"}));
  }));
}

TEST(Cut, BodiesThatOverlapAreOneInPieces) {
  Mesh knobbed = egg();
  append(knobbed, box({-5, -4, 12}, {6, 4, 23}));
  const Outcome<FloatSpec> outcome = hollowed(knobbed, afloat_in_pieces());
  const HollowResult& result = outcome;
  EXPECT_EQ(failed(judged(result.delivery, result.spec, knobbed)), Names{});
  for (const Part* piece : parts_of(result.delivery, Part::Role::body)) EXPECT_TRUE(is_closed_solid(piece->mesh));
}

TEST(Cut, PiecesLieOnTheirCutsWhateverElseIsSaid) {
  const auto refused = [](const auto& change) {
    Job<FloatSpec> job = afloat_in_pieces();
    change(job.spec.print);
    return message_of([&] { hollowed(egg(), job); }, ErrorCode::usage);
  };
  EXPECT_TRUE(mentions(refused([](Print& p) { p.self_supporting_deg = 45; }), {"--self-supporting", "--cut"}));
  EXPECT_TRUE(mentions(refused([](Print& p) { p.direction = Eigen::Vector3d::UnitX(); }), {"--print-direction", "--cut"}));
  EXPECT_TRUE(mentions(refused([](Print& p) { p.drains.where = Drains::Where::found; }), {"--drain", "--cut"}));
}

TEST(Cut, ThePiecesAreTheWholeButForTheHoles) {
  Moments holes = Moments::Zero();
  Moments pieces = Moments::Zero();
  for (const Part* part : parts_of(made().delivery, Part::Role::body)) pieces += mesh_moments(part->mesh);
  const Mesh body = made().delivery.body();
  std::size_t rooms = 0;
  Mesh whole;
  for (const Mesh& shell : split(body, connected_components(body))) {
    const Moments s = mesh_moments(shell);
    const bool is_room = s[M1] < 0 && -s[M1] < 100;  // a hole of 2 mm is 12 mm long
    rooms += is_room;
    if (is_room)
      holes += s;
    else
      append(whole, shell);
  }
  EXPECT_EQ(rooms, parts_of(made().delivery, Part::Role::insert).size());
  EXPECT_TRUE(moments_near(pieces, mesh_moments(whole) + holes, 1e-12, 60));
  EXPECT_NEAR(surface_area(body), surface_area(whole) + surface_area(body, 0) - surface_area(whole), 1e-9);
}

TEST(Cut, AFileHoldsPiecesAndWhatTheyAreTogether) {
  const std::filesystem::path path = own_file("pieces.3mf");
  write_delivery(path, made().delivery);
  const MeshFile file = read_mesh(path);
  const std::vector<const Part*> pieces = parts_of(made().delivery, Part::Role::body);
  const std::vector<const Part*> inserts = parts_of(made().delivery, Part::Role::insert);
  ASSERT_EQ(file.pieces.size(), pieces.size());
  ASSERT_EQ(file.inserts.size(), inserts.size());
  for (std::size_t n = 0; n < pieces.size(); ++n) {
    EXPECT_EQ(file.pieces[n].mesh.vertices, pieces[n]->mesh.vertices);
    EXPECT_EQ(file.pieces[n].mesh.triangles, pieces[n]->mesh.triangles);
    EXPECT_EQ(file.pieces[n].name, pieces[n]->name);
    EXPECT_EQ(file.pieces[n].to_bed.matrix(), pieces[n]->to_bed.matrix());
  }
  EXPECT_EQ(file.inserts.front().density_g_cm3, inserts.front()->density_g_cm3);
  EXPECT_TRUE(is_closed_solid(file.mesh));
  EXPECT_TRUE(moments_near(mesh_moments(file.mesh), mesh_moments(made().delivery.body()), 1e-12, 60));
  Delivery delivered{file.pieces};
  delivered.parts.insert(delivered.parts.end(), file.inserts.begin(), file.inserts.end());
  EXPECT_EQ(failed(judged(delivered, made().spec, egg())), Names{});
  EXPECT_THROW(write_delivery(own_file("pieces.stl"), made().delivery), Error);
}

TEST(Cut, TheJudgeSeesWhatIsWrongWithPieces) {
  const auto spoilt = [](const auto& spoil) {
    Delivery delivery = made().delivery;
    spoil(delivery);
    return failed(judged(delivery, made().spec, egg()));
  };
  const auto has = [](const Names& names, const char* name) { return std::find(names.begin(), names.end(), name) != names.end(); };
  EXPECT_TRUE(has(spoilt([](Delivery& d) { d.parts[0].mesh.triangles.pop_back(); }), "pieces_closed"));
  EXPECT_TRUE(has(spoilt([](Delivery& d) { d.parts[0].to_bed.translation().z() += 0.1; }), "pieces_on_bed"));
  EXPECT_TRUE(has(spoilt([](Delivery& d) { d.parts[0].to_bed.linear() *= 1.01; }), "pieces_on_bed"));
  EXPECT_TRUE(has(spoilt([](Delivery& d) { d.parts[1].to_bed = d.parts[0].to_bed; }), "pieces_apart"));
  EXPECT_TRUE(has(spoilt([](Delivery& d) {
                    d.parts[0].to_bed = Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitX()) * d.parts[0].to_bed;
                    const double low = bounding_box(transformed(d.parts[0].mesh, d.parts[0].to_bed)).min().z();
                    d.parts[0].to_bed.translation().z() -= low;
                  }),
                  "pieces_lie_flat"));
  // A piece that reaches into the other one.
  EXPECT_TRUE(has(spoilt([](Delivery& d) {
                    const Eigen::Vector3d up = d.parts[0].to_bed.linear().row(2);
                    for (Eigen::Vector3d& v : d.parts[0].mesh.vertices) v -= 0.5 * up;
                  }),
                  "pieces_add_up"));
  // One that is all in one piece opens nothing.
  const Names closed = spoilt([](Delivery& d) {
    Part whole = d.parts[0];
    whole.mesh = d.body();
    std::erase_if(d.parts, [](const Part& part) { return part.role == Part::Role::body; });
    d.parts.push_back(whole);
  });
  EXPECT_TRUE(has(closed, "cavities_opened"));
  EXPECT_TRUE(has(closed, "in_pieces"));
}

TEST(Cut, PinsTooNearToACavityAreSeen) {
  const Mesh outer = box({0, 0, 0}, {40, 40, 40});
  const auto with_pin_at = [&](double x, bool has_room = true) {
    const Prism hole{{x, 20, 20.01}, Eigen::Vector3d::UnitZ(), 1, -4, 4, 16};
    Prism pin = hole;
    pin.radius_mm = 0.8;
    Mesh body = merged({outer, flipped(box({10, 10, 10}, {30, 30, 30}))});
    if (has_room) append(body, flipped(surface_of(hole)));
    const Halves two = halves(body, {Eigen::Vector3d::UnitZ(), 20.01});
    Delivery delivery{{{.mesh = two.above, .name = "a"}, {.mesh = two.below, .name = "b"}}};
    delivery.parts.push_back({.mesh = surface_of(pin), .role = Part::Role::insert});
    return failed(verify(delivery, &outer, Spec(StandSpec{})));
  };
  const auto has = [](const Names& names) { return std::find(names.begin(), names.end(), "wall_at_pins") != names.end(); };
  EXPECT_FALSE(has(with_pin_at(5)));
  EXPECT_TRUE(has(with_pin_at(8.5)));
  EXPECT_TRUE(has(with_pin_at(20, false)));  // in the cavity, where nothing holds it
}

TEST(Cut, PlanesThatAreGivenAreTaken) {
  Job<FloatSpec> job = afloat_in_pieces();
  job.spec.print.cut.where = Cut::Where::given;
  job.spec.print.cut.planes = {{Eigen::Vector3d::UnitX(), 3}, {Eigen::Vector3d::UnitY(), 1}};
  const HollowResult result = hollowed(egg(), job);
  EXPECT_EQ(parts_of(result.delivery, Part::Role::body).size(), 4u);
  EXPECT_EQ(failed(judged(result.delivery, result.spec, egg())), Names{});
  job.spec.print.cut.planes = {{Eigen::Vector3d::UnitX(), 31}};
  const auto refused = [&job] { return message_of([&job] { hollowed(egg(), job); }, ErrorCode::usage); };
  EXPECT_TRUE(mentions(refused(), {"x=31", "does not meet the body", "-30", "30"}));
  // Nor where it leaves a piece that is thinner than a layer, or would be moved out of the body.
  for (const double offset_mm : {29.9, -29.9999}) {
    job.spec.print.cut.planes = {{Eigen::Vector3d::UnitX(), offset_mm}};
    EXPECT_TRUE(mentions(refused(), {"less than 0.2 mm", "-30", "30"}));
  }
}

TEST(Cut, ThePlaneThatIsGivenTwiceIsRefusedWhicheverWayItIsTurned) {
  Job<FloatSpec> job = afloat_in_pieces();
  job.spec.print.cut.where = Cut::Where::given;
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX();
  const std::vector<std::vector<Cut::Plane>> twins = {
      {{x, 3}, {x, 3}}, {{x, 3}, {-x, -3}}, {{x, 3}, {-x, -3.1}}, {{x, 3}, {Eigen::Vector3d(1, 0.001, 0).normalized(), 3}}};
  for (const auto& planes : twins) {
    job.spec.print.cut.planes = planes;
    EXPECT_TRUE(mentions(message_of([&] { hollowed(egg(), job); }, ErrorCode::usage),
                         {"Two planes of --cut", "x=3", "leave one of them out"}));
  }
}

TEST(Cut, AWallAloneHasNoRoomForPinsHoweverThickItIs) {
  for (const double wall_mm : {2.0, 8.0, 20.0}) {
    const double inner = 30 - wall_mm;
    const Mesh body = hollow(box({-30, -30, -30}, {30, 30, 30}), box({-inner, -inner, -inner}, {inner, inner, inner}));
    EXPECT_TRUE(detail::pin_places(body, {{Eigen::Vector3d::UnitZ(), 0.3}}, 0, {0.3, 3.5, wall_mm}, {}).empty()) << wall_mm;
  }
}

TEST(Cut, WhatDoesNotGoWithItIsRefused) {
  const auto refused = [](const auto& change) {
    Job<FloatSpec> job = afloat_in_pieces();
    change(job);
    try {
      hollowed(egg(), job);
    } catch (const Error& error) {
      return error.code() == ErrorCode::usage;
    }
    return false;
  };
  EXPECT_TRUE(refused([](auto& job) {
    job.spec.print.infill.percent = 15;
    job.spec.print.wall_mm = 3;
  }));
  EXPECT_TRUE(refused([](auto& job) { job.spec.print.core.density_g_cm3 = 7; }));
  EXPECT_TRUE(refused([](auto& job) { job.spec.print.balls.count = 1; }));
  EXPECT_TRUE(refused([](auto& job) { job.spec.print.drains.where = Drains::Where::found; }));
  EXPECT_TRUE(refused([](auto& job) { job.hollow.fixed = {{{.mesh = icosphere(2, 1), .role = Part::Role::insert}}}; }));
  EXPECT_TRUE(refused([](auto& job) { job.hollow.as_printed = [](const Delivery& d) { return mesh_moments(d.body()); }; }));
}

}  // namespace
}  // namespace rayrep::test
