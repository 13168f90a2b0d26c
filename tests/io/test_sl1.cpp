// What the layers of a resin printer cure: archives made here, and the slicer's own.

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <functional>
#include <map>
#include <random>

#include "io/archive.h"
#include "io/read_sl1.h"
#include "rayrep/base/error.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/io/printed.h"
#include "rayrep/print/place_print.h"
#include "solids.h"

namespace rayrep::test {
namespace {

namespace fs = std::filesystem;

struct Image {
  std::size_t width = 0;
  std::size_t height = 0;
  std::vector<std::uint8_t> pixels;  ///< row by row, from the top

  std::uint8_t at(std::size_t column, std::size_t row) const { return pixels[row * width + column]; }
};

std::string big_endian(std::uint32_t value) {
  std::string bytes;
  for (const int shift : {24, 16, 8, 0}) bytes += static_cast<char>(value >> shift & 0xFF);
  return bytes;
}

std::string chunk(const std::string& name, const std::string& data) {
  std::uint32_t crc = 0xFFFFFFFF;
  for (const char c : name + data) {
    crc ^= static_cast<std::uint8_t>(c);
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ ((crc & 1) != 0 ? 0xEDB88320 : 0);
  }
  return big_endian(static_cast<std::uint32_t>(data.size())) + name + data + big_endian(~crc);
}

std::string png_head(std::size_t width, std::size_t height, const std::string& kind = std::string("\x08\0\0\0\0", 5)) {
  return "\x89PNG\r\n\x1A\n" +
         chunk("IHDR", big_endian(static_cast<std::uint32_t>(width)) + big_endian(static_cast<std::uint32_t>(height)) + kind);
}

std::string png(std::size_t width, std::size_t height, const std::string& packed) {
  return png_head(width, height) + chunk("IDAT", packed) + chunk("IEND", "");
}

/// What zlib would make of it, but not compressed.
std::string packed_rows(const Image& image) {
  std::string raw;
  for (std::size_t row = 0; row < image.height; ++row) {
    raw += '\0';
    raw.append(reinterpret_cast<const char*>(&image.pixels[row * image.width]), image.width);
  }
  std::string packed = "\x78\x01";
  for (std::size_t at = 0; at < raw.size(); at += 65535) {
    const std::size_t length = std::min<std::size_t>(65535, raw.size() - at);
    packed += at + length == raw.size() ? '\1' : '\0';
    for (const std::size_t n : {length, ~length})
      for (const int shift : {0, 8}) packed += static_cast<char>(n >> shift & 0xFF);
    packed += raw.substr(at, length);
  }
  std::uint32_t a = 1;
  std::uint32_t b = 0;
  for (const char c : raw) {
    a = (a + static_cast<std::uint8_t>(c)) % 65521;
    b = (b + a) % 65521;
  }
  return packed + big_endian(b << 16 | a);
}

std::string png(const Image& image) { return png(image.width, image.height, packed_rows(image)); }

/// An archive as PrusaSlicer writes it, for a display of 30 x 20 pixels of 0.5 mm by 0.25 mm.
struct Job {
  std::map<std::string, std::string> job = {
      {"jobDir", "part1"}, {"layerHeight", "0.05"}, {"prusaSlicerVersion", "PrusaSlicer-2.5.0"}};
  std::map<std::string, std::string> profile = {{"display_width", "15"},
                                                {"display_height", "5"},
                                                {"display_pixels_x", "30"},
                                                {"display_pixels_y", "20"},
                                                {"display_orientation", "landscape"},
                                                {"display_mirror_x", "0"},
                                                {"display_mirror_y", "0"},
                                                {"initial_layer_height", "0.1"}};
  std::vector<Image> layers;

  bool is(const std::string& key, const std::string& value) const { return profile.at(key) == value; }
  double number(const std::string& key) const { return std::stod(profile.at(key)); }

  /// Of the pixel in the middle of the bed's own row of pixels: where PrusaSlicer 2.5 was seen to put what lies there.
  Eigen::Vector2d middle(std::size_t column, std::size_t row) const {
    const bool portrait = is("display_orientation", "portrait");
    const double dx = number("display_width") / number("display_pixels_x");
    const double dy = number("display_height") / number("display_pixels_y");
    const double right = static_cast<double>(column) + 0.5;
    const double down = static_cast<double>(row) + 0.5;
    const double left = (portrait ? number("display_pixels_y") : number("display_pixels_x")) - right;
    const double up = (portrait ? number("display_pixels_x") : number("display_pixels_y")) - down;
    const bool mirror_x = is("display_mirror_x", "1");
    const bool mirror_y = is("display_mirror_y", "1");
    if (portrait) return {(mirror_y ? down : up) * dx, (mirror_x ? right : left) * dy};
    return {(mirror_x ? left : right) * dx, (mirror_y ? down : up) * dy};
  }

  Image blank() const {
    auto width = static_cast<std::size_t>(number("display_pixels_x"));
    auto height = static_cast<std::size_t>(number("display_pixels_y"));
    if (is("display_orientation", "portrait")) std::swap(width, height);
    return {width, height, std::vector<std::uint8_t>(width * height)};
  }

  /// A layer with the pixels set whose middle `is_in`.
  Image shown(const std::function<std::uint8_t(const Eigen::Vector2d&)>& value) const {
    Image image = blank();
    for (std::size_t row = 0; row < image.height; ++row)
      for (std::size_t column = 0; column < image.width; ++column)
        image.pixels[row * image.width + column] = value(middle(column, row));
    return image;
  }

  std::map<std::string, std::string> parts() const {
    std::map<std::string, std::string> all;
    for (const auto& [key, value] : job) all["config.ini"] += key + " = " + value + "\n";
    for (const auto& [key, value] : profile) all["prusaslicer.ini"] += key + " = " + value + "\n";
    all["thumbnail/thumbnail400x400.png"] = "not looked at";
    for (std::size_t n = 0; n < layers.size(); ++n) {
      const std::string digits = std::to_string(n);
      all["part1" + std::string(5 - digits.size(), '0') + digits + ".png"] = png(layers[n]);
    }
    return all;
  }
};

std::string packed(const std::map<std::string, std::string>& parts) {
  std::vector<detail::ArchivePart> all;
  for (const auto& [name, text] : parts) all.push_back({name.c_str(), text});
  return detail::pack(all);
}

Printed read_bytes(const std::string& bytes) {
  const fs::path path = own_file("print.sl1");
  std::ofstream(path, std::ios::binary) << bytes;
  return read_printed(path);
}

Printed read(const Job& job) { return read_bytes(packed(job.parts())); }

double off(const Moments& a, const Moments& b) { return (a - b).cwiseAbs().cwiseQuotient(b.cwiseAbs()).maxCoeff(); }

/// In x, y: 2 to 9 by 1 to 3; two layers, 0.1 and 0.05 mm thick, above one that is empty.
void show_box(Job& job) {
  const auto in_box = [](const Eigen::Vector2d& p) {
    return p.x() > 2 && p.x() < 9 && p.y() > 1 && p.y() < 3 ? std::uint8_t{255} : std::uint8_t{0};
  };
  job.layers = {job.shown(in_box), job.shown(in_box)};
}
const Eigen::Vector3d kBoxMin(2, 1, 0);
const Eigen::Vector3d kBoxMax(9, 3, 0.15);

TEST(Sl1, ABoxOfPixelsIsTheBoxHoweverTheDisplayIsTurnedAndMirrored) {
  for (const char* orientation : {"landscape", "portrait"})
    for (const char* mirror_x : {"0", "1"})
      for (const char* mirror_y : {"0", "1"}) {
        SCOPED_TRACE(std::string(orientation) + mirror_x + mirror_y);
        Job job;
        job.profile["display_orientation"] = orientation;
        job.profile["display_mirror_x"] = mirror_x;
        job.profile["display_mirror_y"] = mirror_y;
        show_box(job);
        const Printed printed = read(job);
        EXPECT_LT(off(printed.body(), box_moments(kBoxMin, kBoxMax)), 1e-12);
        ASSERT_EQ(printed.layers.size(), 2U);
        EXPECT_NEAR(printed.layers[0].z_mm, 0.05, 1e-15);
        EXPECT_NEAR(printed.layers[1].z_mm, 0.125, 1e-15);
        EXPECT_NEAR(printed.layers[1].height_mm, 0.05, 1e-15);
        EXPECT_NEAR(printed.layers[1].area_mm2, 14, 1e-12);
        EXPECT_NEAR((printed.layers[1].centroid_mm - Eigen::Vector2d(5.5, 2)).norm(), 0, 1e-12);
        EXPECT_NEAR((printed.layers[1].size_mm - Eigen::Vector2d(7, 2)).norm(), 0, 1e-12);
        EXPECT_EQ(printed.bottom_mm, 0);
        EXPECT_EQ(printed.slicer, "PrusaSlicer-2.5.0");
        // Not square, and turned.
        EXPECT_EQ(printed.notes.size(), orientation == std::string("portrait") ? 1U : 0U);
      }
}

TEST(Sl1, WhereTheProfileDoesNotSayItIsTheDisplayOfAnSl1) {
  Job portrait;
  portrait.profile["display_orientation"] = "portrait";
  portrait.profile["display_mirror_x"] = "1";
  show_box(portrait);
  for (const char* key : {"display_orientation", "display_mirror_x", "display_mirror_y"}) portrait.profile.erase(key);
  EXPECT_LT(off(read(portrait).body(), box_moments(kBoxMin, kBoxMax)), 1e-12);
}

/// Random greys: every pixel is a box of its own.
TEST(Sl1, GreyIsTheShareOfAPixel) {
  std::mt19937 random(3);
  for (const double gamma : {1.0, 0.5, 0.0}) {
    Job job;
    job.profile["gamma_correction"] = std::to_string(gamma);
    job.profile["initial_layer_height"] = "0.05";
    Moments expected = Moments::Zero();
    for (int n = 0; n < 3; ++n) {
      Image image = job.blank();
      for (std::size_t k = 0; k < image.pixels.size(); ++k) {
        image.pixels[k] = random() % 3 == 0 ? static_cast<std::uint8_t>(random() % 256) : random() % 2 == 0 ? 255 : 0;
        const Eigen::Vector2d p = job.middle(k % image.width, k / image.width);
        const Eigen::Vector3d middle(p.x(), p.y(), 0.05 * n + 0.025);
        const Eigen::Vector3d half(0.25, 0.125, 0.025);
        const double share = std::pow(image.pixels[k] / 255.0, gamma > 0 ? 1 / gamma : 1);
        expected += share * box_moments(middle - half, middle + half);
      }
      job.layers.push_back(image);
    }
    EXPECT_LT(off(read(job).body(), expected), 1e-12);
  }
}

TEST(Sl1, HalfACoveredPixelMovesTheOutlineHalfAPixel) {
  Job job;
  job.layers = {job.shown([](const Eigen::Vector2d& p) {
    const bool inside = p.x() > 2 && p.x() < 9 && p.y() > 1 && p.y() < 3;
    return inside ? p.x() < 2.5 ? std::uint8_t{102} : std::uint8_t{255} : std::uint8_t{0};
  })};
  const Printed printed = read(job);
  EXPECT_NEAR(printed.volume_mm3(), (6.5 + 0.4 * 0.5) * 2 * 0.1, 1e-12);
  EXPECT_NEAR(printed.layers[0].size_mm.x(), 6.7, 1e-12);
}

/// The outline as a flood from the edges finds it. What of a pixel is not exposed belongs to the spot at its left, above it, at its
/// right or below, in this order.
double outline_mm2(const Image& image, double pixel_mm2) {
  const auto W = static_cast<int>(image.width);
  const auto H = static_cast<int>(image.height);
  std::vector<bool> outside(static_cast<std::size_t>((W + 2) * (H + 2)));
  const auto index = [W](int x, int y) { return static_cast<std::size_t>((y + 1) * (W + 2) + x + 1); };
  const auto value = [&](int x, int y) {
    return x < 0 || y < 0 || x >= W || y >= H ? 0 : image.at(static_cast<std::size_t>(x), static_cast<std::size_t>(y));
  };
  std::vector<std::pair<int, int>> todo = {{-1, -1}};
  outside[index(-1, -1)] = true;
  const std::pair<int, int> steps[] = {{-1, 0}, {0, -1}, {1, 0}, {0, 1}};
  while (!todo.empty()) {
    const auto [x, y] = todo.back();
    todo.pop_back();
    for (const auto& [dx, dy] : steps) {
      const int u = x + dx;
      const int v = y + dy;
      if (u < -1 || v < -1 || u > W || v > H || outside[index(u, v)] || value(u, v) >= 128) continue;
      outside[index(u, v)] = true;
      todo.emplace_back(u, v);
    }
  }
  double sum = 0;
  for (int y = 0; y < H; ++y)
    for (int x = 0; x < W; ++x) {
      const double exposed = value(x, y) / 255.0;
      bool enclosed = value(x, y) < 128 && !outside[index(x, y)];
      if (value(x, y) >= 128)
        for (const auto& [dx, dy] : steps) {
          if (value(x + dx, y + dy) >= 128) continue;
          enclosed = !outside[index(x + dx, y + dy)];
          break;
        }
      sum += enclosed ? 1 : exposed;
    }
  return sum * pixel_mm2;
}

TEST(Sl1, OutlinesAreFilledAsAFloodFromTheEdgesFindsThem) {
  std::mt19937 random(11);
  for (int round = 0; round < 200; ++round) {
    Job job;
    Image image = job.blank();
    const unsigned dark = 2 + random() % 6;
    for (auto& pixel : image.pixels)
      pixel =
          random() % dark == 0 ? static_cast<std::uint8_t>(random() % 4 * 40) : static_cast<std::uint8_t>(255 - random() % 2 * 60);
    // Empty rows and columns, too.
    if (round % 3 == 0)
      for (std::size_t k = 0; k < image.pixels.size(); ++k)
        if (k / image.width % 7 == 3 || k % image.width < random() % 9) image.pixels[k] = 0;
    job.layers = {image, image};
    const Printed printed = read(job);
    for (const PrintedLayer& layer : printed.layers) EXPECT_NEAR(layer.area_mm2, outline_mm2(image, 0.125), 1e-10);
  }
}

/// More holes than a row can tell apart at once.
TEST(Sl1, AGrateOfManyHolesIsFilled) {
  Job job;
  job.profile["display_pixels_x"] = job.profile["display_pixels_y"] = "401";
  job.profile["display_width"] = job.profile["display_height"] = "401";
  job.layers = {job.shown([](const Eigen::Vector2d& p) {
    const auto x = static_cast<int>(p.x());
    const auto y = static_cast<int>(p.y());
    return x % 2 == 1 && y % 2 == 1 ? std::uint8_t{0} : std::uint8_t{255};
  })};
  const Printed printed = read(job);
  EXPECT_NEAR(printed.layers[0].area_mm2, 401 * 401, 1e-6);
  EXPECT_NEAR((printed.layers[0].centroid_mm - Eigen::Vector2d::Constant(200.5)).norm(), 0, 1e-9);
  EXPECT_NEAR(printed.volume_mm3(), 0.1 * (401 * 401 - 200 * 200), 1e-6);
}

TEST(Sl1, WhatTheProfileEnlargesIsTakenBack) {
  Job job;
  show_box(job);
  job.job["usedMaterial"] = "0.0021";
  job.profile.insert({{"relative_correction_x", "1.25"}, {"relative_correction_y", "2"}, {"material_correction_z", "0.5"}});
  job.profile.insert({{"relative_correction_z", "1"}, {"material_correction_x", "1"}, {"material_correction_y", "1"}});
  const Eigen::Vector3d larger(1.25, 2, 0.5);
  const Printed printed = read(job);
  EXPECT_LT(off(printed.body(), box_moments(kBoxMin.cwiseQuotient(larger), kBoxMax.cwiseQuotient(larger))), 1e-12);
  EXPECT_NEAR(printed.volume_mm3() / *printed.told_volume_mm3, 1, 1e-12);
  EXPECT_NEAR(printed.layers[0].size_mm.x(), 7 / 1.25, 1e-12);
  ASSERT_EQ(printed.notes.size(), 1U);
  EXPECT_TRUE(mentions(printed.notes[0], {"1.25 x 2 x 0.5", "relative_correction"}));

  // As older versions write it.
  Job old;
  show_box(old);
  old.profile["relative_correction"] = "1.25,2";
  EXPECT_NEAR(read(old).volume_mm3(), 2.1 / (1.25 * 1.25 * 2), 1e-12);
}

TEST(Sl1, SupportsDensityAndWhatTheSlicerSaysAreTold) {
  Job job;
  show_box(job);
  job.job["usedMaterial"] = "0.0021";
  job.profile["material_density"] = "1";
  job.profile["supports_enable"] = job.profile["pad_enable"] = "0";
  Printed printed = read(job);
  EXPECT_NEAR(*printed.told_volume_mm3, 2.1, 1e-12);
  EXPECT_EQ(printed.told, "usedMaterial = 0.0021");
  // 1 is what stands where nobody has entered any.
  EXPECT_FALSE(printed.density_g_cm3);
  EXPECT_EQ(printed.likely_density_g_cm3(), 1.14);
  EXPECT_TRUE(printed.notes.empty());
  job.profile["material_density"] = "1.18";
  job.profile["supports_enable"] = job.profile["pad_enable"] = "1";
  printed = read(job);
  EXPECT_EQ(printed.density_g_cm3, 1.18);
  ASSERT_EQ(printed.notes.size(), 1U);
  EXPECT_TRUE(mentions(printed.notes[0], {"supports and pad"}));
  // A refusal says it, too, as it may be why.
  const auto place = [&] { place_print(printed, box({0, 0, 0}, {3, 3, 0.15})); };
  EXPECT_TRUE(mentions(message_of(place, ErrorCode::input), {"does not look like", "supports and pad"}));
}

TEST(Sl1, RefusalsSayWhichPartAndWhy) {
  Job good;
  show_box(good);
  const std::map<std::string, std::string> parts = good.parts();
  const std::string first = "part100000.png";
  const auto refusal = [](const std::map<std::string, std::string>& changed) {
    return message_of([&] { read_bytes(packed(changed)); }, ErrorCode::input);
  };
  const auto with = [&](const std::string& name, const std::string& text) {
    auto changed = parts;
    changed[name] = text;
    return refusal(changed);
  };
  const auto without = [&](const std::string& name) {
    auto changed = parts;
    changed.erase(name);
    return refusal(changed);
  };
  const auto profile = [&](const std::string& key, const std::string& value) {
    Job job = good;
    job.profile[key] = value;
    return refusal(job.parts());
  };
  EXPECT_TRUE(mentions(message_of([] { read_bytes("PK no archive"); }, ErrorCode::input), {"an SL1 file is a zip archive"}));
  EXPECT_TRUE(mentions(without("config.ini"), {"config.ini"}));
  EXPECT_TRUE(mentions(without("prusaslicer.ini"), {"prusaslicer.ini"}));
  EXPECT_TRUE(mentions(without(first), {"layer 0 is missing"}));
  auto no_layers = parts;
  std::erase_if(no_layers, [](const auto& part) { return part.first.starts_with("part1"); });
  EXPECT_TRUE(mentions(refusal(no_layers), {"no layers"}));
  Job more = good;
  more.job["numFast"] = "1";
  more.job["numSlow"] = "2";
  EXPECT_TRUE(mentions(refusal(more.parts()), {"3 layers", "holds 2"}));
  more.job["numSlow"] = "1";
  EXPECT_NO_THROW(read(more));
  auto twice = parts;
  twice["other00001.png"] = parts.at(first);
  EXPECT_TRUE(mentions(refusal(twice), {"two layers 1"}));
  Job no_height = good;
  no_height.job.erase("layerHeight");
  EXPECT_TRUE(mentions(refusal(no_height.parts()), {"config.ini", "layerHeight"}));

  EXPECT_TRUE(mentions(profile("display_width", "0"), {"display_width", "above 0"}));
  EXPECT_TRUE(mentions(profile("display_width", "wide"), {"display_width", "'wide'"}));
  EXPECT_TRUE(mentions(profile("display_pixels_x", "1000000000"), {"display_pixels_x", "at most"}));
  EXPECT_TRUE(mentions(profile("display_pixels_x", "31"), {first.c_str(), "30 x 20", "31 x 20"}));
  EXPECT_TRUE(mentions(profile("display_orientation", "upright"), {"display_orientation", "upright"}));
  EXPECT_TRUE(mentions(profile("initial_layer_height", "-1"), {"initial_layer_height"}));
  EXPECT_TRUE(mentions(profile("relative_correction", "0,1"), {"relative_correction"}));
  Job vast = good;
  vast.profile["display_pixels_x"] = vast.profile["display_pixels_y"] = "99999";
  EXPECT_TRUE(mentions(refusal(vast.parts()), {"99999 x 99999"}));

  const std::string image = parts.at(first);
  EXPECT_TRUE(mentions(with(first, image.substr(0, image.size() / 2)), {first.c_str(), "cut off"}));
  EXPECT_TRUE(mentions(with(first, image.substr(0, image.size() - 12)), {first.c_str(), "cut off"}));
  std::string spoiled = image;
  spoiled[image.size() / 2] ^= 1;
  EXPECT_TRUE(mentions(with(first, spoiled), {first.c_str(), "damaged"}));
  EXPECT_TRUE(mentions(with(first, ""), {first.c_str(), "cut off"}));
  EXPECT_TRUE(mentions(with(first, "no image at all"), {first.c_str(), "PNG"}));
  EXPECT_TRUE(mentions(with(first, png_head(1'000'000'000, 1'000'000'000)), {first.c_str()}));
  for (const std::string& kind : {std::string("\x08\2\0\0\0", 5), std::string("\x10\0\0\0\0", 5), std::string("\x08\0\0\0\1", 5)})
    EXPECT_TRUE(mentions(with(first, png_head(30, 20, kind) + image.substr(33)), {first.c_str(), "8 bits of grey"}));
  Job black = good;
  for (Image& layer : black.layers) layer = black.blank();
  EXPECT_TRUE(mentions(refusal(black.parts()), {"black"}));
}

/// Seeded changes of the parts, and of the archive around them.
TEST(Sl1, NoBytesMakeItCrash) {
  Job job;
  show_box(job);
  const auto good = job.parts();
  const std::string archive = packed(good);
  std::mt19937 random(17);
  const auto spoil = [&random](std::string& bytes) {
    if (bytes.empty()) return;
    for (unsigned k = 0; k <= random() % 4; ++k) {
      const std::size_t at = random() % bytes.size();
      if (random() % 4 == 0)
        bytes.erase(at, random() % 40);
      else
        bytes[at] = static_cast<char>(random());
      if (bytes.empty()) return;
    }
  };
  int refused = 0;
  for (int round = 0; round < 3000; ++round) {
    std::string bytes = archive;
    if (round % 4 == 0) {
      spoil(bytes);
    } else {
      auto parts = good;
      if (round % 4 == 1) {  // behind checksums
        std::string rows = packed_rows(job.layers[0]);
        spoil(rows);
        parts["part100000.png"] = png(30, 20 + round % 3, rows);
      } else {
        auto part = parts.begin();
        std::advance(part, random() % parts.size());
        spoil(part->second);
      }
      bytes = packed(parts);
    }
    try {
      const Printed printed = detail::read_sl1({bytes, "print.sl1"}, {});
      EXPECT_TRUE(printed.body().allFinite() && printed.body()[M1] > 0);
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::input) << error.what();
      ++refused;
    }
  }
  EXPECT_GT(refused, 1000);
}

/// The real one. A body that is not its own mirror image, whose layers are turned on the bed so that edges are grey: mass, centre
/// and inertia are its own, in its own coordinates.
TEST(Sl1, WhatPrusaSlicerWritesIsTheBody) {
  if (std::system("command -v prusa-slicer > /dev/null 2>&1") != 0) GTEST_SKIP() << "prusa-slicer is not installed";
  const Mesh upright = polycubes({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0, 1, 0}, {0, 1, 1}}, 4);
  const Mesh mesh = moved(rotated(upright, Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ()).toRotationMatrix()), {30, 20, 1});
  const fs::path stl = own_file("sl1_body.stl");
  write_mesh(stl, mesh);
  const Moments body = mesh_moments(mesh);
  const double diagonal = 4 * std::sqrt(17.0);
  const std::string all =
      "prusa-slicer --export-sla --printer-technology SLA --layer-height 0.1 --initial-layer-height 0.1"
      " --supports-enable=0 --pad-enable=0 --display-width 96 --display-height 60 --display-pixels-x 960"
      " --display-pixels-y 600 --bed-shape 0x0,96x0,96x60,0x60 --max-print-height 100 --material-density 1.1";
  struct Case {
    const char* options;
    const char* ending;
    double scale = 1;  // of the volume that the slicer tells over the body's
  };
  const Case cases[] = {{" --display-orientation portrait --display-mirror-x=1 --display-mirror-y=0", ".sl1"},
                        {" --display-orientation portrait --display-mirror-x=0 --display-mirror-y=1", ".sl1s"},
                        {" --display-orientation landscape --display-mirror-x=0 --display-mirror-y=0", ".sl1"},
                        {" --display-orientation landscape --display-mirror-x=1 --display-mirror-y=1", ".sl1"},
                        {" --display-orientation portrait --relative-correction-x=1.02 --relative-correction-y=0.98"
                         " --material-correction-x=1.01",
                         ".sl1"}};
  for (const Case& c : cases) {
    SCOPED_TRACE(c.options);
    const fs::path path = own_file("sl1_body").string() + c.ending;
    // In the coordinates of the mesh, and where the slicer likes it.
    for (const char* where : {" --dont-arrange", ""}) {
      const std::string command = all + c.options + where + " -o " + path.string() + " " + stl.string() + " > /dev/null 2>&1";
      ASSERT_EQ(std::system(command.c_str()), 0) << command;
      const Printed printed = read_printed(path);
      EXPECT_EQ(printed.density_g_cm3, 1.1);
      EXPECT_NEAR(printed.volume_mm3() / *printed.told_volume_mm3, 1, 1e-3);
      EXPECT_NEAR(printed.volume_mm3() / body[M1], 1, 1e-3);
      const PrintPlacement placed = place_print(printed, mesh);
      EXPECT_LT(placed.size_error_mm, 0.1);
      EXPECT_LT(placed.area_error, 0.01);
      expect_moments_near(placed.s, body, 2e-3, diagonal);
      if (*where == '\0') continue;
      EXPECT_NEAR((placed.to_mesh.translation() - Eigen::Vector3d(0, 0, 1)).norm(), 0, 0.02);
    }
  }
}

}  // namespace
}  // namespace rayrep::test
