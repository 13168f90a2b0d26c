// Sections as they are drawn, held against the area of the cut found in another way: by the vector area of what lies above it.

#include <gtest/gtest.h>

#include <pugixml.hpp>
#include <random>
#include <sstream>

#include "rayrep/draw/section_picture.h"
#include "solids.h"

namespace rayrep {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// The area in which a plane cuts a closed mesh: the surface above the plane is closed by it, so that their vector areas cancel.
double cut_area(const Mesh& mesh, const Vector3d& normal, double offset) {
  Vector3d sum = Vector3d::Zero();
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    std::vector<Vector3d> kept;
    for (int k = 0; k < 3; ++k) {
      const Vector3d& a = mesh.corner(t, k);
      const Vector3d& b = mesh.corner(t, (k + 1) % 3);
      const double ha = normal.dot(a) - offset;
      const double hb = normal.dot(b) - offset;
      if (ha >= 0) kept.push_back(a);
      if ((ha >= 0) != (hb >= 0)) kept.push_back(a + ha / (ha - hb) * (b - a));
    }
    for (std::size_t k = 2; k < kept.size(); ++k) sum += 0.5 * (kept[k - 1] - kept[0]).cross(kept[k] - kept[0]);
  }
  return normal.dot(sum);
}

bool inside(const SectionLoop& loop, const Vector2d& p) { return contains(loop, p); }

/// What a viewer fills of the path with that id, by even-odd: by how many other loops each lies in. In units of the path.
double even_odd_area(const pugi::xml_document& svg, const char* id, double* scale = nullptr) {
  const pugi::xml_node path = svg.select_node((std::string("//*[@id='") + id + "']").c_str()).node();
  std::vector<SectionLoop> loops;
  std::string d = path.attribute("d").value();
  for (char& c : d)
    if (c == 'L') c = ' ';
  std::istringstream parts(d);
  for (std::string part; std::getline(parts, part, 'Z');) {
    loops.emplace_back();
    std::istringstream numbers(part.substr(1));
    for (double x = 0, y = 0; numbers >> x >> y;) loops.back().emplace_back(x, y);
  }
  if (scale) {
    std::istringstream matrix(std::string(path.parent().attribute("transform").value()).substr(7));
    matrix >> *scale;
  }
  double area = 0;
  for (std::size_t n = 0; n < loops.size(); ++n) {
    int depth = 0;
    for (std::size_t m = 0; m < loops.size(); ++m) depth += m != n && inside(loops[m], loops[n].front());
    area += (depth % 2 == 0 ? 1 : -1) * std::abs(loop_moments(loops[n]).area_mm2);
  }
  return area;
}

pugi::xml_document parsed(const std::string& svg) {
  pugi::xml_document document;
  const pugi::xml_parse_result result = document.load_buffer(svg.data(), svg.size(), pugi::parse_full, pugi::encoding_utf8);
  EXPECT_TRUE(result) << result.description() << " at " << result.offset;
  return document;
}

SectionPlane plane_of(const Vector3d& normal, double offset) { return {normal.normalized(), offset, "1,2,3"}; }

Mesh hollow_ring() { return test::hollow(test::torus(20, 8, 80, 40), test::torus(20, 5, 80, 40)); }

TEST(SectionPicture, PathsEncloseTheAreaOfTheCut) {
  const Mesh ring = hollow_ring();
  const Delivery body = test::delivery(ring);
  const Subject subject{body, {}, "ring"};
  std::mt19937 random(7);
  std::uniform_real_distribution<double> spread(-1, 1);
  for (int n = 0; n < 12; ++n) {
    const Vector3d normal =
        n < 3 ? Vector3d(Vector3d::Unit(n)) : Vector3d(spread(random), spread(random), spread(random)).normalized();
    const double offset = 3 * spread(random);
    const Drawing drawing = section_drawing(subject, plane_of(normal, offset));
    double scale = 0;
    const double drawn = even_odd_area(parsed(to_svg(drawing)), "material", &scale);
    EXPECT_NEAR(drawn, cut_area(ring, normal, offset), 1e-9 * drawn) << normal.transpose();
    EXPECT_EQ(scale, drawing.scale);
  }
}

TEST(SectionPicture, OverlappingBodiesAreOneArea) {
  const Delivery body = test::delivery(test::merged({test::box({0, 0, 0}, {10, 10, 10}), test::box({5, 2, 0}, {15, 8, 10})}));
  const Drawing drawing = section_drawing({body, {}, "boxes"}, plane_of({0, 0, 1}, 4));
  const pugi::xml_document svg = parsed(to_svg(drawing));
  EXPECT_STREQ(svg.select_node("//*[@id='material']").node().attribute("fill-rule").value(), "nonzero");
}

TEST(SectionPicture, SectionsAddUpToTheVolume) {
  const Mesh ring = test::rotated(hollow_ring(), test::random_rotation(3));
  const Delivery body = test::delivery(ring);
  const double volume = mesh_moments(ring)[M1];
  const Eigen::AlignedBox3d box = bounding_box(ring);
  double before = 0;
  for (const int count : {10, 40, 160}) {
    double sum = 0;
    const double spacing = box.sizes().z() / count;
    for (int n = 0; n < count; ++n) {
      const double z = box.min().z() + spacing * (n + 0.5);
      sum += spacing * section_areas(body, view_of(plane_of({0, 0, 1}, z), z, Vector3d::UnitZ())).front().area_mm2();
    }
    const double error = std::abs(sum - volume) / volume;
    if (before > 0) {
      EXPECT_LT(error, 0.25 * before) << count << ": four times as many sections, an area that has steep ends but no steps";
    }
    before = error;
  }
  EXPECT_LT(before, 2e-4);
}

TEST(SectionPicture, OfABallIsACircle) {
  const Delivery body = test::delivery(test::icosphere(10, 5));
  for (const Vector3d& normal : {Vector3d(0, 1, 0), Vector3d(1, -2, 2)}) {
    const SectionView view = view_of(plane_of(normal, 6), 6, Vector3d::UnitZ());
    const auto areas = section_areas(body, view);
    ASSERT_EQ(areas.size(), 1U);
    ASSERT_EQ(areas[0].loops.size(), 1U);
    EXPECT_GT(areas[0].area_mm2(), 0) << "seen from the side on which it runs against the clock";
    for (const Vector2d& p : areas[0].loops[0]) EXPECT_NEAR(p.norm(), 8, 0.02);
  }
}

TEST(SectionPicture, UpIsUprightAndRightIsPositive) {
  std::mt19937 random(11);
  std::normal_distribution<double> spread;
  for (int n = 0; n < 200; ++n) {
    const Vector3d normal = Vector3d(spread(random), spread(random), spread(random)).normalized();
    const Vector3d up = Vector3d(spread(random), spread(random), spread(random)).normalized();
    const SectionView view = view_of(plane_of(normal, 2), 2, up);
    EXPECT_TRUE(test::near(view.to_view * view.to_view.transpose(), Eigen::Matrix3d::Identity(), 1e-12));
    EXPECT_NEAR(view.to_view.determinant(), 1, 1e-12);
    EXPECT_NEAR((view.to_view * (2 * normal)).z(), view.depth_mm, 1e-12) << "a point of the plane";
    if (view.level) continue;
    EXPECT_NEAR(view.to_view.row(0).dot(up), 0, 1e-12);
    EXPECT_GT(view.to_view.row(1).dot(up), 0);
    Eigen::Index largest = 0;
    view.to_view.row(0).cwiseAbs().maxCoeff(&largest);
    EXPECT_GT(view.to_view(0, largest), 0);
  }
  const SectionView front = view_of(plane_of({0, 1, 0}, 3), 3, Vector3d::UnitZ());
  EXPECT_EQ(front.to_view, (Eigen::Matrix3d() << 1, 0, 0, 0, 0, 1, 0, -1, 0).finished());
  EXPECT_EQ(front.depth_mm, -3);
  const SectionView plan = view_of(plane_of({0, 0, 1}, 3), 3, Vector3d::UnitZ());
  EXPECT_TRUE(plan.level);
  EXPECT_EQ(plan.to_view, Eigen::Matrix3d::Identity());
}

TEST(SectionPicture, PlanesAreReadAsPeopleWriteThem) {
  const SectionPlane y = parse_section_plane("y=0");
  EXPECT_EQ(y.normal, Vector3d(0, 1, 0));
  EXPECT_EQ(y.offset_mm, 0);
  EXPECT_EQ(y.file_word(), "y0");
  EXPECT_EQ(parse_section_plane("x=-12.5").file_word(), "x-12.5");
  EXPECT_FALSE(parse_section_plane("z").offset_mm.has_value());
  EXPECT_EQ(parse_section_plane("z").file_word(), "z");
  const SectionPlane tilted = parse_section_plane("1,0,1=30");
  EXPECT_TRUE(test::near(tilted.normal, Vector3d(1, 0, 1).normalized(), 1e-15));
  EXPECT_EQ(tilted.file_word(), "1_0_1_30");
  for (const char* text : {"", "w=1", "y=", "y=one", "1,0=3", "y=1=2", "=3"}) {
    try {
      parse_section_plane(text);
      ADD_FAILURE() << text;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::usage) << text;
      EXPECT_TRUE(test::mentions(error.what(), {"--section"})) << text;
    }
  }
}

TEST(SectionPicture, PlanesBesideTheBodyAreRefusedWithWhereItIs) {
  const Delivery body = test::delivery(test::box({1, 2, 3}, {4, 6, 8}));
  try {
    section_drawing({body, {}, "box"}, parse_section_plane("y=7"));
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::usage);
    EXPECT_TRUE(test::mentions(error.what(), {"y = 7 mm", "between 2 and 6 mm"}));
  }
}

/// All areas of that colour in a drawing, mm^2.
double area_filled(const Drawing& drawing, std::uint32_t hex) {
  double sum = 0;
  const Colour colour = colour_of(hex);
  for (const auto& item : drawing.items)
    if (const Outline* outline = std::get_if<Outline>(&item); outline && outline->in_mm && outline->fill)
      if (outline->fill->red == colour.red && outline->fill->green == colour.green && outline->fill->blue == colour.blue)
        for (const SectionLoop& loop : outline->loops) sum += std::abs(loop_moments(loop).area_mm2);
  return sum;
}

// A cup is dry inside, an arch is not: the water is drawn so.
TEST(SectionPicture, WaterStaysOutOfDryPocketsOnly) {
  const auto cubes = [](bool cup) {
    std::vector<Eigen::Vector3i> cells;
    for (int x = 0; x < 3; ++x)
      for (int y = 0; y < 3; ++y)
        for (int z = 0; z < 3; ++z)
          if ((x != 1 || y != 1 || z == 0) && (cup || y == 1 || x != 1 || z == 0)) cells.emplace_back(x, y, z);
    return test::polycubes(cells, 10);
  };
  for (const bool cup : {true, false}) {
    const Mesh mesh = cubes(cup);
    const Delivery body = test::delivery(mesh);
    FloatSpec spec;
    spec.waterline_mm = 18;
    Subject subject{body, marks_of(mesh, spec, mass_properties(mesh, 1)), "cup"};
    ASSERT_TRUE(subject.marks.water.has_value());
    EXPECT_EQ(subject.marks.water->dry_pockets, cup);
    const Drawing drawing = section_drawing(subject, parse_section_plane("y=14.9"));
    const double outer = area_filled(drawing, 0xedb45e);
    EXPECT_NEAR(area_filled(drawing, 0xffffff) - outer, cup ? 8 * 10 : 0, 1e-9) << cup;
  }
}

TEST(SectionPicture, MarksAreThoseOfPhysics) {
  const Mesh ball = test::icosphere(10, 5, {1, 2, 3});
  const Mesh shell = test::hollow(ball, test::icosphere(5, 4, {1, 2, 3}));
  const MassProperties mass = mass_properties(shell, 0.5);
  const Marks marks = marks_of(shell, FloatSpec{}, mass);
  ASSERT_TRUE(marks.water.has_value());
  // Displaces its own mass, the cavity not flooded: V (h) = pi h^2 (R - h / 3).
  const double depth = marks.water->offset_mm - (3 - 10);
  EXPECT_NEAR(test::kPi * depth * depth * (10 - depth / 3), mass.mass_g * 1000, 0.01 * mass.mass_g * 1000);
  ASSERT_TRUE(marks.water->metacentre_mm.has_value());
  EXPECT_TRUE(test::near(*marks.water->metacentre_mm, Vector3d(1, 2, 3), 0.05)) << "of a ball it is the middle";
  EXPECT_FALSE(marks.ground_mm.has_value());

  StandSpec stand;
  stand.up = Vector3d::UnitX();
  const Mesh box = test::box({0, 0, 0}, {10, 20, 30});
  const Marks stands = marks_of(box, stand, mass_properties(box, 1));
  EXPECT_EQ(stands.support_mm.size(), 4U);
  EXPECT_NEAR(stands.ground_mm.value(), 0, 1e-12);
  for (const Vector3d& corner : stands.support_mm) EXPECT_NEAR(corner.x(), 0, 1e-9);

  FloatSpec heavy;
  EXPECT_FALSE(marks_of(box, heavy, mass_properties(box, 3)).water.has_value()) << "it sinks";
  const Marks spins = marks_of(ball, SpinSpec{}, mass_properties(ball, 1));
  EXPECT_TRUE(test::near(spins.contact_mm.value(), Vector3d(1, 2, -7), 0.1));
}

// What a name holds does no harm to the document.
TEST(SectionPicture, IsWellFormedWhateverTheName) {
  const Delivery body = test::delivery(test::box({0, 0, 0}, {10, 10, 10}));
  const std::string name = "a<b>&\"'\x01\xff\xed\xa0\x80 \xc3\xa9.stl";
  const Drawing drawing = section_drawing({body, {}, name}, parse_section_plane("y"));
  const pugi::xml_document svg = parsed(to_svg(drawing));
  EXPECT_EQ(std::string(svg.child("svg").child("title").text().get()), "a<b>&\"'????? \xc3\xa9.stl, section y = 5 mm");
  EXPECT_GT(to_png(drawing).size(), 1000U);
}

}  // namespace
}  // namespace rayrep
