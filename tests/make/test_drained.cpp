// Holes by which cavities are drained, and their plugs: where they may be, what they weigh, and what a judge holds them to.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <set>

#include "mesh/revolved.h"
#include "rayrep/base/error.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/judge/kept_solid.h"
#include "rayrep/judge/verify.h"
#include "rayrep/make/hollow.h"
#include "rayrep/mesh/boolean.h"
#include "rayrep/mesh/mesh_check.h"
#include "runs.h"
#include "solids.h"

namespace rayrep::test {
namespace {

const Mesh& egg() {
  static const Mesh mesh = uv_ellipsoid(30, 22, 26, 24);
  return mesh;
}

/// As it will be read from STL, so that it holds what was judged.
HollowOptions as_stl(int resolution = 40) {
  HollowOptions options = coarse(resolution);
  options.as_stored = [](const Mesh& mesh) { return as_stored("body.stl", mesh); };
  return options;
}

template <typename S>
S drained(bool plugged) {
  S spec;
  spec.print.wall_mm = 1.5;
  spec.print.drains.where = Drains::Where::found;
  spec.print.drains.plugged = plugged;
  return spec;
}

/// 1 - (V - E + F) / 2 of a closed surface in one piece.
long genus(const Mesh& given) {
  const Mesh mesh = with_merged_vertices(given);
  EXPECT_EQ(connected_components(mesh).count, 1);
  std::set<std::pair<int, int>> edges;
  for (const auto& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) edges.insert(std::minmax(t[k], t[(k + 1) % 3]));
  return 1 -
         (static_cast<long>(mesh.vertices.size()) - static_cast<long>(edges.size()) + static_cast<long>(mesh.triangles.size())) / 2;
}

double value_of(const Verdict& verdict, const std::string& name) {
  for (const Criterion& c : verdict.criteria)
    if (c.name == name) return c.value;
  ADD_FAILURE() << name;
  return 0;
}

const std::vector<Record>& holes_of(const Verdict& verdict) {
  for (const Figure& figure : verdict.figures)
    if (figure.name == "holes") return std::get<std::vector<Record>>(figure.value);
  throw std::out_of_range("holes");
}

double number_of(const Record& record, const std::string& name) {
  for (const auto& [key, value] : record)
    if (key == name) return std::get<double>(value);
  throw std::out_of_range(name);
}

TEST(Drained, FloatsPluggedByNumbersWithHolesAndPlugsCounted) {
  const HollowResult made = hollow(egg(), drained<FloatSpec>(true), as_stl());
  EXPECT_LT(made.as_built_error, 1e-6);
  const Verdict verdict = verify(made.delivery, &egg(), made.spec);
  EXPECT_TRUE(verdict.pass()) << ::testing::PrintToString(failed(verdict));
  EXPECT_LT(value_of(verdict, "mass_error"), 2e-6);
  EXPECT_LT(value_of(verdict, "drains"), 0.01);
  EXPECT_EQ(holes_of(verdict).size(), 2u);
  // Two holes into one cavity: one surface, as of a ring.
  EXPECT_TRUE(is_closed_solid(made.delivery.body()));
  EXPECT_EQ(genus(made.delivery.body()), 1);
  // What closes them takes up what was drilled, but for the clearance: the wall, and of the floor no more than a radius.
  std::size_t plugs = 0;
  for (const Part& part : made.delivery.parts) {
    if (part.role != Part::Role::plug) continue;
    ++plugs;
    EXPECT_TRUE(is_closed_solid(part.mesh));
    EXPECT_EQ(genus(part.mesh), 0);
    const double across = kPi * 1.9 * 1.9;
    EXPECT_GT(mesh_moments(part.mesh)[M1], 0.95 * across * 1.5);
    EXPECT_LT(mesh_moments(part.mesh)[M1], 1.05 * across * (1.5 + 2));
  }
  EXPECT_EQ(plugs, 2u);
}

TEST(Drained, OneHoleJoinsTheCavityToTheOutside) {
  FloatSpec spec = drained<FloatSpec>(false);
  spec.print.drains.where = Drains::Where::given;
  spec.print.drains.points_mm = {{1, 2, 40}};
  spec.waterline_mm = 22;
  const HollowResult made = hollow(egg(), spec, as_stl());
  EXPECT_EQ(genus(made.delivery.body()), 0);
  const Verdict verdict = verify(made.delivery, &egg(), made.spec);
  EXPECT_TRUE(verdict.pass()) << ::testing::PrintToString(failed(verdict));
  ASSERT_EQ(holes_of(verdict).size(), 1u);
  EXPECT_NEAR(number_of(holes_of(verdict)[0], "diameter_mm"), 4, 1e-5);
  // At the place of the outside that is nearest to what was asked for.
  EXPECT_GT(number_of(holes_of(verdict)[0], "z_mm"), 25.5);
}

TEST(Drained, StaysAboveTheWaterUnlessPlugged) {
  EXPECT_TRUE(mentions(message_of([] { hollow(egg(), drained<FloatSpec>(false), as_stl()); }, ErrorCode::goal),
                       {"would stay in the cavities", "--plug", "--print-direction"}));
  FloatSpec turned = drained<FloatSpec>(false);
  turned.print.direction = -Eigen::Vector3d::UnitZ();
  const HollowResult made = hollow(egg(), turned, as_stl());
  const Verdict verdict = verify(made.delivery, &egg(), made.spec);
  EXPECT_TRUE(verdict.pass()) << ::testing::PrintToString(failed(verdict));
  for (const Record& hole : holes_of(verdict))
    EXPECT_GT(number_of(hole, "z_mm") + 26, *std::get<FloatSpec>(made.spec).waterline_mm + 0.03 * 52);
  FloatSpec below = drained<FloatSpec>(false);
  below.print.drains.where = Drains::Where::given;
  below.print.drains.points_mm = {{30, 0, -3}};
  EXPECT_TRUE(mentions(message_of([&] { hollow(egg(), below, as_stl()); }, ErrorCode::usage),
                       {"above the waterline", "closed again (--plug)", "too low"}));
  below.print.drains.plugged = true;
  EXPECT_LT(hollow(egg(), below, as_stl()).as_built_error, 1e-6);
}

TEST(Drained, TopsKeepTheirBalance) {
  SpinSpec spec = drained<SpinSpec>(false);
  const Mesh top = moved(uv_ellipsoid(30, 30, 18, 40), {0, 0, 18});
  const HollowResult made = hollow(top, spec, as_stl());
  EXPECT_LT(made.as_built_error, 1e-6);
  const Verdict verdict = verify(made.delivery, &top, made.spec);
  EXPECT_TRUE(verdict.pass()) << ::testing::PrintToString(failed(verdict));
  EXPECT_LT(value_of(verdict, "offset"), 2e-6);
  // On the axis, or opposite to another one.
  for (const Record& hole : holes_of(verdict)) {
    const Eigen::Vector2d p(number_of(hole, "x_mm"), number_of(hole, "y_mm"));
    double nearest = p.norm();
    for (const Record& other : holes_of(verdict))
      nearest = std::min(nearest, (p + Eigen::Vector2d(number_of(other, "x_mm"), number_of(other, "y_mm"))).norm());
    EXPECT_LT(nearest, 3);
  }
}

TEST(Drained, LeavesTheSupportAsItIs) {
  const Mesh block = subdivided(box({-25, -15, 0}, {25, 15, 40}), 3);
  const HollowResult made = hollow(block, drained<StandSpec>(true), as_stl());
  const Verdict verdict = verify(made.delivery, &block, made.spec);
  EXPECT_TRUE(verdict.pass()) << ::testing::PrintToString(failed(verdict));
  for (const Record& hole : holes_of(verdict)) EXPECT_GT(number_of(hole, "z_mm"), 2);
}

/// Written and read again.
Delivery from_file(const Delivery& delivery) {
  const std::filesystem::path path = own_file("resin.3mf");
  write_delivery(path, delivery);
  MeshFile file = read_mesh(path);
  std::filesystem::remove(path);
  Delivery read{{{.mesh = std::move(file.mesh)}}};
  for (Part& part : file.modifiers) read.parts.push_back(std::move(part));
  return read;
}

TEST(Drained, ResinThatStaysWeighs) {
  FloatSpec spec = drained<FloatSpec>(true);
  spec.print.density_g_cm3 = 1.14;
  spec.print.liquid_g_cm3 = 1.09;
  spec.print.direction = Eigen::Vector3d::UnitX();  // a pool in the end of the egg
  spec.print.drains.where = Drains::Where::given;
  for (const double x : {-27.0, -25.0}) {
    spec.print.drains.points_mm = {{x, 0, 13}, {0, 0, 26}};
    const HollowResult made = hollow(egg(), spec, as_stl());
    const Verdict verdict = verify(made.delivery, &egg(), made.spec);
    EXPECT_GT(verdict.trapped_resin_g, 0.2);
    EXPECT_EQ(failed(verdict), x < -26 ? Names() : Names({"trapped_resin"})) << verdict.trapped_resin_g;
    // It floats by numbers with it inside.
    EXPECT_LT(value_of(verdict, "mass_error"), 2e-6);
    EXPECT_LT(value_of(verdict, "offset"), 2e-6);
    const double printed_mm3 = mesh_moments(made.delivery.body())[M1] + mesh_moments(made.delivery.mesh_of(Part::Role::plug))[M1];
    EXPECT_NEAR(verdict.body.mass_g, 1.14e-3 * printed_mm3 + verdict.trapped_resin_g, 1e-6);
    const Verdict delivered = verify(from_file(made.delivery), &egg(), made.spec);
    EXPECT_EQ(failed(delivered), failed(verdict));
    EXPECT_NEAR(delivered.trapped_resin_g, verdict.trapped_resin_g, 1e-6);
    EXPECT_LT(value_of(delivered, "mass_error"), 2e-6);
    EXPECT_LT(value_of(delivered, "offset"), 2e-6);
  }
}

/// What leans a level floor by little makes a pool on it, which takes the place of what the lean takes away.
TEST(Drained, LevelFloorsLeanAsFarAsTheirPoolsAskFor) {
  for (const Eigen::Vector3d& sizes : {Eigen::Vector3d(60, 60, 60), Eigen::Vector3d(80, 50, 40)}) {
    FloatSpec spec = drained<FloatSpec>(true);
    spec.print.density_g_cm3 = 1.14;
    spec.print.liquid_g_cm3 = 1.09;
    const Mesh block = box(-0.5 * sizes, 0.5 * sizes);
    const HollowResult made = hollow(block, spec, as_stl(50));
    EXPECT_LE(made.as_built_error, 1e-6) << sizes.transpose();
    const Verdict verdict = verify(made.delivery, &block, made.spec);
    EXPECT_TRUE(verdict.pass()) << ::testing::PrintToString(failed(verdict));
    EXPECT_GT(verdict.trapped_resin_g, 0.01);
    EXPECT_LT(value_of(verdict, "mass_error"), 2e-6);
    EXPECT_LT(value_of(verdict, "offset"), 2e-6);
  }
}

TEST(Drained, NoResinStaysWhereSomethingIsPutIn) {
  FloatSpec spec = drained<FloatSpec>(true);
  spec.print.density_g_cm3 = 1.14;
  spec.print.liquid_g_cm3 = 1.09;
  HollowOptions options = as_stl();
  options.fixed = {{{.mesh = icosphere(4, 3, {2, 0, -15}), .role = Part::Role::insert, .density_g_cm3 = 7.5}}};
  const HollowResult made = hollow(egg(), spec, options);
  const Verdict verdict = verify(made.delivery, &egg(), made.spec);
  EXPECT_TRUE(verdict.pass()) << ::testing::PrintToString(failed(verdict));
  EXPECT_LT(value_of(verdict, "mass_error"), 1e-4);
  EXPECT_LT(verdict.trapped_resin_g, 0.1);  // the room would hold 0.3
  for (const std::string& sentence : verdict.meaning) EXPECT_FALSE(mentions(sentence, {"no hole"})) << sentence;
}

TEST(Drained, CavitiesThatWereThereBeforeKeepWhatIsInThem) {
  Mesh had = egg();
  append(had, flipped(icosphere(5, 3, {0, 0, 12})));
  FloatSpec spec = drained<FloatSpec>(true);
  EXPECT_TRUE(mentions(message_of([&] { hollow(had, spec, as_stl()); }, ErrorCode::usage), {"sealed cavities of its own", "0.5"}));
  // Nor does the judge overlook one: as if it had been there when the holes were drilled.
  const HollowResult made = hollow(egg(), spec, as_stl());
  const double before_mm3 = value_of(verify(made.delivery, &egg(), made.spec), "drains");
  Delivery delivered = made.delivery;
  const Eigen::Vector3d below(0, 0, -15);  // in the floor
  append(delivered.parts.front().mesh, flipped(icosphere(4, 3, below)));
  Mesh original = egg();
  append(original, flipped(icosphere(4, 3, below)));
  EXPECT_GT(value_of(verify(delivered, &original, made.spec), "drains"), before_mm3 + 0.002);
}

double figure_of(const Verdict& verdict, const std::string& name) {
  for (const Figure& figure : verdict.figures)
    if (const double* value = std::get_if<double>(&figure.value); value && figure.name == name) return *value;
  ADD_FAILURE() << name;
  return -1;
}

/// Drilled and self-supporting: it meets its goal, and no hole takes the ground from under a pillar.
void expect_carried(const Mesh& solid, Spec spec) {
  print_of(spec).self_supporting_deg = 45;
  const HollowResult made = hollow(solid, spec, as_stl(40));
  EXPECT_LE(made.as_built_error, 1e-6);
  const Verdict verdict = verify(made.delivery, &solid, made.spec);
  EXPECT_TRUE(verdict.pass()) << ::testing::PrintToString(failed(verdict));
  EXPECT_GE(holes_of(verdict).size(), 1u);
  EXPECT_EQ(figure_of(verdict, "hanging_islands"), 0);
  EXPECT_LT(figure_of(verdict, "roof_share"), 0.02);
  EXPECT_LE(figure_of(verdict, "widest_bridge_mm"), 1.02 * print_of(spec).drains.diameter_mm);
  EXPECT_GT(figure_of(verdict, "thinnest_pillar_mm"), 0.99 * print_of(spec).wall_mm);
}

TEST(Drained, HolesKeepClearOfPillars) {
  FloatSpec floating = drained<FloatSpec>(true);
  floating.print.wall_mm = 1.2;
  floating.print.direction = Eigen::Vector3d::UnitX();
  expect_carried(uv_ellipsoid(22, 17, 19, 32), floating);
  StandSpec standing = drained<StandSpec>(false);
  standing.print.wall_mm = 1.2;
  standing.print.direction = Eigen::Vector3d::UnitY();
  expect_carried(subdivided(box({-15, -12, 0}, {15, 12, 22}), 2), standing);
}

/// The lowest part of what is printed lying lies under water where it floats.
TEST(Drained, RefusalsAmongPillarsSayWhatWasTried) {
  FloatSpec lying = drained<FloatSpec>(false);
  lying.print.wall_mm = 1.2;
  lying.print.self_supporting_deg = 45;
  const Mesh solid = uv_ellipsoid(22, 17, 19, 32);
  const std::string why = message_of([&] { hollow(solid, lying, as_stl()); }, ErrorCode::goal);
  EXPECT_TRUE(mentions(why, {"would stay in the cavities", "holes that cannot be", "was tried", "(--plug)"})) << why;
  EXPECT_FALSE(mentions(why, {"leave the cones out"})) << why;  // without cones they cannot, either
  lying.print.drains.plugged = true;
  EXPECT_LE(hollow(solid, lying, as_stl()).as_built_error, 1e-6);
}

/// Printed the way its cones ask for, which nobody said.
TEST(Drained, TopsWithConesAreDrainedAsTheyArePrinted) {
  SpinSpec spec = drained<SpinSpec>(true);
  spec.print.drains.diameter_mm = 3;
  const Mesh top = moved(uv_ellipsoid(15, 15, 11, 24), {0, 0, 11});
  spec.print.self_supporting_deg = 45;
  const HollowResult made = hollow(top, spec, as_stl(30));
  ASSERT_TRUE(print_of(made.spec).direction);
  EXPECT_LE(made.as_built_error, 1e-6);
  const Verdict verdict = verify(made.delivery, &top, made.spec);
  EXPECT_TRUE(verdict.pass()) << ::testing::PrintToString(failed(verdict));
  EXPECT_GE(holes_of(verdict).size(), 1u);
}

TEST(Drained, PillarsStandBesideHolesThatAreGiven) {
  FloatSpec floating = drained<FloatSpec>(true);
  floating.print.wall_mm = 1.2;
  floating.print.drains.where = Drains::Where::given;
  floating.print.drains.points_mm = {{0, 0, 19}, {8, 2, 17}};
  expect_carried(uv_ellipsoid(22, 17, 19, 32), floating);
}

TEST(Drained, HolesKeepAwayFromWhatIsKeptSolid) {
  const FloatSpec spec = drained<FloatSpec>(true);
  const HollowResult made = hollow(egg(), spec, as_stl());
  const Record hole = holes_of(verify(made.delivery, &egg(), made.spec)).at(0);
  const Eigen::Vector3d at(number_of(hole, "x_mm"), number_of(hole, "y_mm"), number_of(hole, "z_mm"));
  const std::vector<Mesh> regions = {box(at.array() - 3, at.array() + 3)};
  const auto kept_mm = [&](const HollowResult& result) {
    Verdict verdict;
    judge_kept_solid(
        result.delivery.solid(),
        {.regions = regions, .wall_mm = spec.print.wall_mm, .original = &egg(), .drains = &print_of(result.spec).drains}, verdict);
    EXPECT_EQ(verdict.criteria.size(), 1u);
    return value_of(verdict, "kept_solid") * spec.print.wall_mm;
  };
  EXPECT_LT(kept_mm(made), -1);
  HollowOptions options = as_stl();
  options.keep_solid = regions;
  EXPECT_GE(kept_mm(hollow(egg(), spec, options)), 0.98 * spec.print.wall_mm);
}

TEST(Drained, NoPassageLeadsThroughWhatIsKeptSolid) {
  // A bowl right across parts the room in two, and the upper one would drain into the lower one, right through the bowl.
  const Mesh solid = box({-20, -20, 0}, {20, 20, 40});
  StandSpec spec = drained<StandSpec>(true);
  spec.print.wall_mm = 1.2;
  HollowOptions options = as_stl();
  options.keep_solid = {detail::revolved({{0, 20}, {45, 20}, {45, 27}, {0, 21}}, 64)};
  EXPECT_TRUE(mentions(message_of([&] { hollow(solid, spec, options); }, ErrorCode::goal),
                       {"no hole can be lower", "(--keep-solid)", "(--drain-diameter)"}));
}

TEST(Drained, RefusesWhatItCannotDo) {
  FloatSpec spec = drained<FloatSpec>(true);
  spec.print.drains.where = Drains::Where::given;
  spec.print.drains.points_mm = {{0, 0, -30}};  // solid below
  EXPECT_TRUE(mentions(message_of([&] { hollow(egg(), spec, as_stl()); }, ErrorCode::usage),
                       {"behind it is no cavity", "mm long at most", "--drain"}));
  for (const double far_mm : {1000.0, 1e308}) {
    spec.print.drains.points_mm = {{far_mm, far_mm, far_mm}};
    EXPECT_TRUE(
        mentions(message_of([&] { hollow(egg(), spec, as_stl()); }, ErrorCode::usage), {"away from the outside", "--drain"}));
  }
  spec = drained<FloatSpec>(true);
  spec.print.infill.percent = 15;
  spec.print.wall_mm = 2;
  EXPECT_TRUE(mentions(message_of([&] { hollow(egg(), spec, as_stl()); }, ErrorCode::usage), {"--drain"}));
  spec = drained<FloatSpec>(true);
  spec.print.cut.where = Cut::Where::found;
  EXPECT_TRUE(mentions(message_of([&] { hollow(egg(), spec, as_stl()); }, ErrorCode::usage), {"--cut"}));
  spec = drained<FloatSpec>(true);
  spec.print.drains.diameter_mm = 25;  // wider than there is room for, in the inner domain and in the cavity
  EXPECT_TRUE(
      mentions(message_of([&] { hollow(egg(), spec, as_stl()); }, ErrorCode::goal), {"holes of 25.00 mm", "--drain-diameter"}));
  spec.print.drains.diameter_mm = 28;
  EXPECT_TRUE(
      mentions(message_of([&] { hollow(egg(), spec, as_stl()); }, ErrorCode::goal), {"holes of 28.00 mm", "--drain-diameter"}));
  spec = drained<FloatSpec>(false);
  spec.print.drains = {.diameter_mm = 3};
  EXPECT_TRUE(mentions(message_of([&] { hollow(egg(), spec, as_stl()); }, ErrorCode::usage), {"--drain-diameter", "--drain auto"}));
  spec = drained<FloatSpec>(false);
  spec.submerged_fraction = 1;
  EXPECT_TRUE(mentions(message_of([&] { hollow(egg(), spec, as_stl()); }, ErrorCode::goal), {"--plug"}));
}

TEST(Drained, JudgeAllowsHolesAlone) {
  const HollowResult made = hollow(egg(), drained<FloatSpec>(true), as_stl());
  const auto judged = [&](const Delivery& delivery, const Spec& spec) { return failed(verify(delivery, &egg(), spec)); };
  const auto has = [](const Names& names, const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  ASSERT_EQ(judged(made.delivery, made.spec), Names());

  // Wider than asked for, or none asked for.
  Spec narrow = made.spec;
  print_of(narrow).drains.diameter_mm = 3.9;
  EXPECT_TRUE(has(judged(made.delivery, narrow), "outer_unchanged"));
  Spec none = made.spec;
  print_of(none).drains = {};
  EXPECT_TRUE(has(judged(made.delivery, none), "outer_unchanged"));
  // Where water comes in there is no waterline: the cause is told.
  std::get<FloatSpec>(none).waterline_mm.reset();
  const Delivery open{{{.mesh = made.delivery.body()}}};
  EXPECT_TRUE(mentions(message_of([&] { verify(open, &egg(), none); }, ErrorCode::goal), {"it sinks", "--drain auto", "--plug"}));

  // A dent, as deep as a hole but square, and a vertex that was moved.
  Delivery dented = made.delivery;
  const std::vector<Mesh> cut = {dented.parts[0].mesh, box({-3, 21.5, -3}, {3, 23, 3})};
  dented.parts[0].mesh = combined(cut, {BooleanOperation::subtract}).mesh;
  EXPECT_TRUE(has(judged(dented, made.spec), "outer_unchanged"));
  Delivery moved_vertex = made.delivery;
  for (auto& v : moved_vertex.parts[0].mesh.vertices)
    if (v.y() < -21.99) v.y() -= 0.01;
  EXPECT_TRUE(has(judged(moved_vertex, made.spec), "outer_unchanged"));

  // Plugs that are missing, or not in their places.
  Delivery unplugged = made.delivery;
  unplugged.parts.pop_back();
  EXPECT_TRUE(has(judged(unplugged, made.spec), "plugged"));
  std::erase_if(unplugged.parts, [](const Part& part) { return part.role == Part::Role::plug; });
  EXPECT_TRUE(mentions(verify(unplugged, &egg(), made.spec).notes.back(), {"no plugs", "--plugs"}));
  Delivery beside = made.delivery;
  const auto outward_of = [](const Mesh& plug) {
    const Moments s = mesh_moments(plug);
    return Eigen::Vector3d((s.segment<3>(MX) / s[M1]).normalized());
  };
  const Eigen::Vector3d across = outward_of(beside.parts.back().mesh).unitOrthogonal();
  for (auto& v : beside.parts.back().mesh.vertices) v += 0.09 * across;
  EXPECT_TRUE(has(judged(beside, made.spec), "plug_clearance"));
  Delivery out = made.delivery;
  for (Part& part : out.parts)
    if (part.role == Part::Role::plug) {
      const Eigen::Vector3d outward = outward_of(part.mesh);
      for (auto& v : part.mesh.vertices) v += 0.5 * outward;
    }
  EXPECT_TRUE(has(judged(out, made.spec), "plugs_flush"));
  EXPECT_TRUE(mentions(message_of([&] { verify(made.delivery, nullptr, made.spec); }, ErrorCode::usage), {"--original"}));
}

TEST(Drained, FilesHoldThePlugsInTheirPlaces) {
  const HollowResult made = hollow(egg(), drained<FloatSpec>(true), coarse(40));
  const std::filesystem::path path = own_file("plugs.3mf");
  write_delivery(path, made.delivery);
  const MeshFile file = read_mesh(path);
  std::filesystem::remove(path);
  EXPECT_EQ(mesh_moments(file.mesh), mesh_moments(made.delivery.body()));
  ASSERT_EQ(file.modifiers.size(), 2u);
  double right = bounding_box(file.mesh).max().x();
  for (std::size_t n = 0; n < 2; ++n) {
    const Part& read = file.modifiers[n];
    const Part& written = made.delivery.parts[made.delivery.parts.size() - 2 + n];
    EXPECT_EQ(read.role, Part::Role::plug);
    EXPECT_EQ(mesh_moments(read.mesh), mesh_moments(written.mesh));
    // Printed beside the body, on its level.
    const Eigen::AlignedBox3d bed = bounding_box(transformed(read.mesh, read.to_bed));
    EXPECT_GT(bed.min().x(), right);
    EXPECT_NEAR(bed.min().z(), bounding_box(file.mesh).min().z(), 1e-9);
    right = bed.max().x();
  }
}

}  // namespace
}  // namespace rayrep::test
