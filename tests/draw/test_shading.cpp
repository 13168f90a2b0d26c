// Shaded pictures: silhouettes and cuts have the areas that they have in space, whatever the number of threads.

#include <cairo.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "rayrep/draw/bead_bars.h"
#include "rayrep/draw/body_picture.h"
#include "rayrep/draw/shading.h"
#include "solids.h"

namespace rayrep {
namespace {

using Eigen::Vector3d;

const Colour kRed = colour_of(0xff0000);
const Colour kGreen = colour_of(0x00ff00);
const Colour kBlue = colour_of(0x0000ff);

ShadedPart part(const Mesh& mesh, const Colour& cut = kGreen) { return {mesh, kRed, cut}; }

Camera camera(const Eigen::Matrix3d& to_view, double mm_per_px, int pixels) {
  Camera result;
  result.to_view = to_view;
  result.mm_per_px = mm_per_px;
  result.width_px = result.height_px = pixels;
  return result;
}

double covered_mm2(const Image& image, double mm_per_px) {
  double sum = 0;
  for (std::size_t n = 3; n < image.rgba.size(); n += 4) sum += image.rgba[n] / 255.0;
  return sum * mm_per_px * mm_per_px;
}

/// Area in which one of the colours outweighs the others.
double area_mm2(const Image& image, int channel, double mm_per_px) {
  double sum = 0;
  for (std::size_t n = 0; n < image.rgba.size(); n += 4) {
    const std::uint8_t* p = &image.rgba[n];
    if (p[3] > 0 && p[channel] > p[(channel + 1) % 3] && p[channel] > p[(channel + 2) % 3]) sum += p[3] / 255.0;
  }
  return sum * mm_per_px * mm_per_px;
}

// Half of the sum of the areas of its sides as they are seen is what a convex body covers.
double projected_mm2(const Mesh& mesh, const Vector3d& to_viewer) {
  double sum = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    sum += 0.25 * std::abs((mesh.corner(t, 1) - mesh.corner(t, 0)).cross(mesh.corner(t, 2) - mesh.corner(t, 0)).dot(to_viewer));
  return sum;
}

TEST(Shading, SilhouettesConvergeToTheProjectedArea) {
  for (const Mesh& mesh : {test::icosphere(9, 4), test::box({-6, -5, -4}, {6, 5, 4}), test::cone(8, 9, 40)}) {
    const Eigen::Matrix3d to_view = looking(Vector3d(0.2, 0.1, 1), 0.5, 0.4);
    const double exact = projected_mm2(mesh, to_view.row(2));
    for (const int pixels : {60, 240}) {
      const double mm_per_px = 24.0 / pixels;
      const Image image = shaded({part(mesh)}, camera(to_view, mm_per_px, pixels));
      EXPECT_NEAR(covered_mm2(image, mm_per_px), exact, (pixels == 60 ? 4e-3 : 1e-3) * exact);
    }
  }
}

TEST(Shading, NeighboursLeaveNoGaps) {
  const Image image = shaded({part(test::icosphere(40, 5))}, camera(looking(Vector3d::UnitZ(), 0.3, 0.2), 0.1, 200));
  for (std::size_t n = 3; n < image.rgba.size(); n += 4) ASSERT_EQ(image.rgba[n], 255) << "pixel " << n / 4;
}

TEST(Shading, ACutShowsTheMaterialInItsPlane) {
  const Mesh shell = test::hollow(test::icosphere(10, 5), test::icosphere(6, 5));
  const double mm_per_px = 0.1;
  const Camera front = camera(looking(Vector3d::UnitZ(), 0, 0), mm_per_px, 220);  // against y
  for (const double y : {-3.0, 0.0, 4.0}) {
    const Image image = shaded({part(shell)}, front, ClipPlane{-Vector3d::UnitY(), -y});
    EXPECT_NEAR(area_mm2(image, 1, mm_per_px), test::kPi * (100 - 36), 0.02 * test::kPi * 64) << "a ring of any height is as large";
    EXPECT_NEAR(covered_mm2(image, mm_per_px), test::kPi * 100, (y <= 0 ? 0.01 : 0.2) * test::kPi * 100);
  }
  const Mesh boxes = test::merged({test::box({-8, -8, -8}, {2, 8, 8}), test::box({-2, -8, -8}, {8, 8, 8})});
  const Image united = shaded({part(boxes)}, front, ClipPlane{-Vector3d::UnitY(), 0});
  EXPECT_NEAR(area_mm2(united, 1, mm_per_px), 256, 3) << "where bodies overlap there is material, too";
  EXPECT_EQ(area_mm2(united, 0, mm_per_px), 0);
}

TEST(Shading, TheLaterPartIsSeenWhereBothAreCut) {
  const double mm_per_px = 0.1;
  const Camera front = camera(looking(Vector3d::UnitZ(), 0, 0), mm_per_px, 220);
  const Image image =
      shaded({part(test::icosphere(10, 5)), part(test::icosphere(5, 5), kBlue)}, front, ClipPlane{-Vector3d::UnitY(), 0});
  EXPECT_NEAR(area_mm2(image, 2, mm_per_px), test::kPi * 25, 2);
  EXPECT_NEAR(area_mm2(image, 1, mm_per_px), test::kPi * 75, 3);
}

TEST(Shading, TheNearerIsSeen) {
  const double mm_per_px = 0.1;
  const Camera front = camera(looking(Vector3d::UnitZ(), 0, 0), mm_per_px, 220);
  const ShadedPart near{test::box({-5, -9, -5}, {5, -8, 5}), kBlue, kBlue};
  for (const bool first : {true, false}) {
    const std::vector<ShadedPart> parts =
        first ? std::vector{near, part(test::icosphere(8, 4))} : std::vector{part(test::icosphere(8, 4)), near};
    EXPECT_NEAR(area_mm2(shaded(parts, front), 2, mm_per_px), 100, 3);
  }
}

TEST(Shading, BytesDoNotDependOnTheNumberOfThreads) {
  const Mesh shell = test::hollow(test::torus(20, 8, 200, 100), test::torus(20, 5, 100, 50));
  const Delivery body = test::delivery(shell);
  std::vector<std::string> all;
  for (const std::size_t threads : {1, 2, 7}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    all.push_back(thumbnail_png(body, Vector3d(0, 1, 2)) + to_png(body_drawing({{body, {}, "ring"}, &shell})));
  }
  EXPECT_EQ(all[0], all[1]);
  EXPECT_EQ(all[0], all[2]);
}

/// Pixels of a PNG, as cairo has them: blue, green, red, opacity.
struct Decoded {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> bytes;
};

Decoded decoded(const std::string& png) {
  struct Source {
    const std::string& text;
    std::size_t at = 0;
  } source{png};
  const auto read = [](void* from, unsigned char* to, unsigned length) {
    auto* s = static_cast<Source*>(from);
    if (s->at + length > s->text.size()) return CAIRO_STATUS_READ_ERROR;
    std::copy_n(s->text.begin() + static_cast<std::ptrdiff_t>(s->at), length, to);
    s->at += length;
    return CAIRO_STATUS_SUCCESS;
  };
  cairo_surface_t* surface = cairo_image_surface_create_from_png_stream(read, &source);
  EXPECT_EQ(cairo_surface_status(surface), CAIRO_STATUS_SUCCESS);
  Decoded image{cairo_image_surface_get_width(surface), cairo_image_surface_get_height(surface), {}};
  const unsigned char* data = cairo_image_surface_get_data(surface);
  const int stride = cairo_image_surface_get_stride(surface);
  for (int y = 0; y < image.height; ++y)
    image.bytes.insert(image.bytes.end(), data + static_cast<std::ptrdiff_t>(y) * stride,
                       data + static_cast<std::ptrdiff_t>(y) * stride + 4L * image.width);
  cairo_surface_destroy(surface);
  return image;
}

TEST(Thumbnail, ShowsTheCutInASquare) {
  const Delivery body = test::delivery(test::hollow(test::icosphere(10, 4), test::icosphere(7, 4)));
  const Decoded image = decoded(thumbnail_png(body, Vector3d::UnitZ(), 128));
  ASSERT_EQ(image.width, 128);
  ASSERT_EQ(image.height, 128);
  std::size_t clear = 0, filled = 0, cut = 0;
  for (std::size_t n = 0; n < image.bytes.size(); n += 4) {
    const std::uint8_t* p = &image.bytes[n];
    clear += p[3] == 0;
    filled += p[3] == 255;
    cut += p[3] == 255 && p[2] == 0xed && p[1] == 0xb4 && p[0] == 0x5e;
  }
  EXPECT_GT(clear, 128U * 128 / 10);
  EXPECT_GT(filled, 128U * 128 / 2);
  EXPECT_GT(cut, 500U);
  EXPECT_LT(cut, filled / 2);
}

TEST(BeadBars, HaveTheMomentsOfTheirBeads) {
  const std::vector<Bead> beads = {
      {{1, 2, 0.3}, {8, 5, 0.3}, 0, 0.5, 0.2}, {{8, 5, 0.3}, {3, -4, 0.9}, 0, 0.45, 0.3}, {{0, 0, 1}, {0, 0, 1}, 0, 0.6, 0.2}};
  for (Bead bead : beads) {
    const double length = (bead.to_mm - bead.from_mm).head<2>().norm();
    bead.volume_mm3 = (length > 0 ? length : bead.width_mm) * bead.width_mm * bead.height_mm;
    const Mesh bar = bead_bars({bead});
    EXPECT_TRUE(test::is_closed_solid(bar));
    test::expect_moments_near(mesh_moments(bar), bead_moments(bead), 1e-9, 10);
  }
  EXPECT_EQ(bead_bars(beads).triangles.size(), 36U);
}

// The areas of a PNG are those that were drawn.
TEST(SectionPng, MaterialCoversItsArea) {
  const Delivery body = test::delivery(test::hollow(test::icosphere(10, 5), test::icosphere(6, 5)));
  const Drawing drawing = section_drawing({body, {}, "ball"}, parse_section_plane("y=1"));
  const Decoded image = decoded(to_png(drawing, 2));
  ASSERT_EQ(image.width, std::ceil(2 * drawing.width_px));
  ASSERT_EQ(image.height, std::ceil(2 * drawing.height_px));
  double cut = 0;
  for (std::size_t n = 0; n < image.bytes.size(); n += 4)
    cut += image.bytes[n + 2] == 0xed && image.bytes[n + 1] == 0xb4 && image.bytes[n] == 0x5e;
  const double px2_per_mm2 = 4 * drawing.scale * drawing.scale;
  EXPECT_NEAR(cut / px2_per_mm2, test::kPi * 64, 0.03 * test::kPi * 64) << "all but its edge and the legend";
}

TEST(BodyDrawing, ShowsHowFarTheOutsideWasMoved) {
  const Mesh before = test::icosphere(10, 3);
  Mesh after = before;
  for (Vector3d& v : after.vertices)
    if (v.x() > 0) v.x() *= 1.25;
  const Delivery body = test::delivery(after);
  BodyPicture what{{body, {}, "egg"}, &before, &after};
  const Drawing drawing = body_drawing(what);
  int images = 0;
  std::string words;
  for (const auto& item : drawing.items) {
    images += std::holds_alternative<PlacedImage>(item);
    if (const Label* label = std::get_if<Label>(&item)) words += label->text + "\n";
  }
  EXPECT_EQ(images, 3);
  EXPECT_TRUE(test::mentions(words, {"egg", "before", "how far it was moved", "moved by 0", "2.5 mm", "after"}));
  what.deformed = nullptr;
  what.before = nullptr;
  const auto count = [&what] {
    int found = 0;
    for (const auto& item : body_drawing(what).items) found += std::holds_alternative<PlacedImage>(item);
    return found;
  };
  EXPECT_EQ(count(), 1);
  what.cut = parse_section_plane("y=0");
  EXPECT_EQ(count(), 2) << "whole and cut";
}

// Whichever way a plane leans, the viewer stands where its cut is seen.
TEST(BodyDrawing, ThePlaneCutsWhatIsInside) {
  const Vector3d up = Vector3d::UnitZ();
  const auto plane_of = [&](const Mesh& mesh) { return plane_through_inside(mesh, up, bounding_box(mesh).center()); };
  const auto with = [](const Vector3d& lo, const Vector3d& hi) {
    return test::hollow(test::box({-30, -10, -12}, {30, 10, 12}), test::box(lo, hi));
  };
  // Along the longer side; across it where that misses; then level; and where all do, through the cavity.
  EXPECT_EQ(plane_of(with({-20, -5, -5}, {20, 5, 5})).normal, Vector3d::UnitY());
  EXPECT_EQ(plane_of(with({-20, 2, -5}, {20, 8, 5})).normal, Vector3d::UnitX());
  EXPECT_EQ(plane_of(with({2, 2, -5}, {20, 8, 5})).normal, Vector3d::UnitZ());
  const SectionPlane beside = plane_of(with({2, 2, 1}, {20, 8, 7}));
  EXPECT_EQ(beside.normal, Vector3d::UnitY());
  EXPECT_NEAR(beside.offset_mm.value(), 5, 1e-9);
  // Two halves with a gap where the usual plane is, and a body with nothing inside.
  const Mesh half = test::hollow(test::box({-30, 2, -30}, {30, 20, 30}), test::box({-25, 5, -25}, {25, 15, 25}));
  EXPECT_EQ(plane_of(test::merged({half, test::moved(half, {0, -22, 0})})).normal, Vector3d::UnitX());
  EXPECT_EQ(plane_of(test::box({0, 0, 0}, {3, 2, 1})).normal, usual_plane(test::box({0, 0, 0}, {3, 2, 1}), up).normal);
}

TEST(BodyDrawing, EveryCutIsSeen) {
  const Delivery body = test::delivery(test::icosphere(10, 3));
  std::vector<Vector3d> normals = {{0.2, 0, -1}, {-0.2, 0, 1}, {0, 0.06, -1}, {0, 0, 1}, {0, 0, -1}, {1, 0, 0}, {-1, 1, -3}};
  for (std::uint64_t seed = 1; seed < 20; ++seed) normals.emplace_back(test::random_rotation(seed).row(0));
  for (const Vector3d& normal : normals)
    for (const Vector3d& up : {Vector3d(0, 0, 1), Vector3d(0, -1, 0), Vector3d(1, 2, -1)}) {
      Subject subject{body, {}, "ball"};
      subject.marks.up = up.normalized();
      const Drawing drawing = body_drawing({subject, nullptr, nullptr, SectionPlane{normal.normalized(), 1.0, "n"}});
      double cut = 0;
      for (const auto& item : drawing.items)
        if (const PlacedImage* placed = std::get_if<PlacedImage>(&item))
          for (std::size_t n = 0; n < placed->image.rgba.size(); n += 4) {
            const std::uint8_t* p = &placed->image.rgba[n];
            cut += p[0] == 0xed && p[1] == 0xb4 && p[2] == 0x5e;
          }
      const double px_per_mm = 2 * drawing.scale;
      EXPECT_GT(cut, 0.3 * test::kPi * 99 * px_per_mm * px_per_mm) << normal.transpose() << " with up " << up.transpose();
    }
}

}  // namespace
}  // namespace rayrep
