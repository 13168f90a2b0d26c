// What G-code lays down: small files by hand, in the dialects of slicers.

#include <gtest/gtest.h>

#include <fstream>
#include <numbers>

#include "io/archive.h"
#include "rayrep/base/error.h"
#include "rayrep/io/printed.h"
#include "rayrep/physics/bead.h"
#include "solids.h"

namespace rayrep::test {
namespace {

constexpr double kFilamentMm2 = std::numbers::pi * 1.75 * 1.75 / 4;

Printed read(const std::string& text, const PrintedOptions& options = {}) {
  const auto path = own_file("print.gcode");
  std::ofstream(path, std::ios::binary) << text;
  return read_printed(path, options);
}

double off(const Moments& a, const Moments& b) { return (a - b).cwiseAbs().maxCoeff() / b.cwiseAbs().maxCoeff(); }

/// A square of side 20 about (100, 100) in one layer, as each way of writing it says: start, then four moves that extrude 1 mm
/// each.
Moments square() {
  Moments s = Moments::Zero();
  const Eigen::Vector3d corners[] = {{90, 90, 0.2}, {110, 90, 0.2}, {110, 110, 0.2}, {90, 110, 0.2}};
  for (int k = 0; k < 4; ++k) s += bead_moments(Bead{corners[k], corners[(k + 1) % 4], kFilamentMm2, 0.45, 0.2});
  return s;
}

const std::string kHead = ";TYPE:External perimeter\n;WIDTH:0.45\n;HEIGHT:0.2\n";

TEST(Printed, WaysToWriteTheSameMoves) {
  const std::string ways[] = {
      "G21\nG90\nM83\n" + kHead + "G1 X90 Y90 Z.2 F3000\nG1 X110 E1\nG1 Y110 E1\nG1 X90 E1\nG1 Y90 E1\n",
      "G21\nG90\nM82\nG92 E5\n" + kHead + "G0 X90 Y90 Z0.2\nG1 X110 E6\nG1 Y110 E7\nG92 E0\nG1 X90 E1\nG1 Y90 E2\n",
      "G91\n" + kHead + "G1 X90 Y90 Z0.2\nG1 X20 E1\nG1 Y20 E1\nG1 X-20 E1\nG1 Y-20 E1\n",
      "G90\nM83\r\n" + kHead +
          "N1 G1X90Y90Z0.2*12\r\nn2 g1 x110 e1 (along x)\r\nN3 G1 Y110 E1 ; up\r\nN4 G01 X90 E1\r\nG1 Y90 E1\r\n",
      "G20\nG90\nM83\n" + kHead +
          "G1 X3.543307086614173 Y3.543307086614173 Z0.007874015748031496\nG1 X4.330708661417323 E0.03937007874015748\nG1 "
          "Y4.330708661417323 E0.03937007874015748\nG1 X3.543307086614173 E0.03937007874015748\nG1 Y3.543307086614173 "
          "E0.03937007874015748\n",
      // Twice the flow, half the feed; retractions, and what is extruded standing still, lay down nothing.
      "G90\nM83\nM221 S200\n" + kHead +
          "G1 X90 Y90 Z0.2\nG1 X110 E.5\nG1 E-2\nG1 E2.5\nG1 Y110 E.5\nG1 X90 E.5\nG1 Y90 E.5\nG1 X80 E-.4\n",
      // The place has another name.
      "G90\nM83\nG1 X10 Y10 Z1\nG92 X0 Y0 Z0\n" + kHead + "G1 X80 Y80 Z-.8\nG1 X100 E1\nG1 Y100 E1\nG1 X80 E1\nG1 Y80 E1\n",
      // E as a volume.
      "; use_volumetric_e = 1\nG90\nM83\n" + kHead +
          "G1 X90 Y90 Z0.2\nG1 X110 E2.405281875404685\nG1 Y110 E2.405281875404685\nG1 X90 E2.405281875404685\nG1 Y90 "
          "E2.405281875404685\n",
      "M200 D1.75\nG90\nM83\n" + kHead +
          "G1 X90 Y90 Z0.2\nG1 X110 E2.405281875404685\nG1 Y110 E2.405281875404685\nG1 X90 E2.405281875404685\nG1 Y90 "
          "E2.405281875404685\n",
      // Bambu Studio's comments.
      "; filament_diameter = 1.75\nG90\nM83\n; FEATURE: Outer wall\n; LINE_WIDTH: 0.45\n; LAYER_HEIGHT: 0.2\nG1 X90 Y90 Z0.2\nG1 "
      "X110 "
      "E1\nG1 Y110 E1\nG1 X90 E1\nG1 Y90 E1\n",
  };
  for (const std::string& way : ways) {
    SCOPED_TRACE(way);
    const Printed printed = read(way);
    EXPECT_LT(off(printed.body(), square()), 1e-12);
    ASSERT_EQ(printed.layers.size(), 1U);
    EXPECT_NEAR(printed.layers[0].z_mm, 0.1, 1e-9);
    EXPECT_NEAR(printed.layers[0].height_mm, 0.2, 1e-12);
    // Round the corners the outline is round.
    EXPECT_NEAR(printed.layers[0].area_mm2, 20 * 20 + 4 * 20 * 0.225 + std::numbers::pi * 0.225 * 0.225, 1e-9);
    EXPECT_NEAR((printed.layers[0].centroid_mm - Eigen::Vector2d(100, 100)).norm(), 0, 1e-9);
  }
}

TEST(Printed, WidthIsWhatTheVolumeMakesOfIt) {
  const Printed printed = read(";TYPE:WALL-OUTER\nG90\nM83\nG1 X0 Y0 Z0.3\nG1 X10 E1\nG1 Z0.5\nG1 X0 E0.5\n");
  const Moments expected = bead_moments(Bead{{0, 0, 0.3}, {10, 0, 0.3}, kFilamentMm2, kFilamentMm2 / 3, 0.3}) +
                           bead_moments(Bead{{10, 0, 0.5}, {0, 0, 0.5}, kFilamentMm2 / 2, kFilamentMm2 / 4, 0.2});
  EXPECT_LT(off(printed.body(), expected), 1e-12);
}

TEST(Printed, ThickFilamentIsSeenByItsBeads) {
  // 0.4 mm wide and 0.2 mm high.
  const auto text = [](double diameter) {
    const double E = 10 * 0.4 * 0.2 / (std::numbers::pi * diameter * diameter / 4);
    return ";TYPE:FILL\nG90\nM83\nG1 X0 Y0 Z0.2\nG1 X10 E" + std::to_string(E) + "\n";
  };
  for (const double diameter : {1.75, 2.85}) {
    const Printed printed = read(text(diameter));
    EXPECT_NEAR(printed.body()[M1], 0.8, 1e-4);
    ASSERT_EQ(printed.notes.size(), 1U);
    EXPECT_TRUE(mentions(printed.notes[0], {diameter == 1.75 ? "1.75 mm is taken" : "2.85 mm is taken", "--filament-diameter"}));
  }
  EXPECT_NEAR(read(text(2.85), {{}, 1.75}).body()[M1], 0.8 * 1.75 * 1.75 / 2.85 / 2.85, 1e-4);
}

TEST(Printed, ArcsByCentreAndByRadiusAreOneArc) {
  const std::string head = "; filament_diameter = 1.75\nG90\nM83\n" + kHead + "G1 X10 Y0 Z0.2\n";
  const Moments quarter = bead_moments(ArcBead{{0, 0}, 10, 0, std::numbers::pi / 2, 0.2, 0.2, kFilamentMm2, 0.45, 0.2});
  EXPECT_LT(off(read(head + "G3 X0 Y10 I-10 J0 E1\n").body(), quarter), 1e-12);
  EXPECT_LT(off(read(head + "G3 X0 Y10 R10 E1\n").body(), quarter), 1e-12);
  const Moments rest = bead_moments(ArcBead{{0, 0}, 10, 0, -1.5 * std::numbers::pi, 0.2, 0.2, kFilamentMm2, 0.45, 0.2});
  EXPECT_LT(off(read(head + "G2 X0 Y10 I-10 E1\n").body(), rest), 1e-12);
  EXPECT_LT(off(read(head + "G2 X0 Y10 R-10 E1\n").body(), rest), 1e-12);
  const Moments circle = bead_moments(ArcBead{{0, 0}, 10, 0, 2 * std::numbers::pi, 0.2, 0.2, kFilamentMm2, 0.45, 0.2});
  const Printed full = read(head + "G3 I-10 E1\n");
  EXPECT_LT(off(full.body(), circle), 1e-12);
  ASSERT_EQ(full.layers.size(), 1U);
  EXPECT_NEAR(full.layers[0].area_mm2, std::numbers::pi * 10.225 * 10.225, 0.03);
}

TEST(Printed, WhatIsNotOfTheBodyIsListedAndNotCounted) {
  const auto one = [](const char* feature, int y) {
    return std::string(";TYPE:") + feature + "\n;WIDTH:0.45\n;HEIGHT:0.2\nG1 X0 Y" + std::to_string(y) + " Z0.2\nG1 X10 E1\n";
  };
  std::string text = "G90\nM83\nG1 X0 Y-5 Z0.2\nG1 X50 E3 ; purge line\n";
  int y = 0;
  for (const char* feature :
       {"Skirt/Brim", "SKIRT", "Support material", "SUPPORT-INTERFACE", "Wipe tower", "PRIME-TOWER", "Custom"})
    text += one(feature, ++y);
  for (const char* feature : {"Perimeter", "WALL-OUTER", "Internal infill", "FILL", "SKIN", "Gap fill", "Ironing"})
    text += one(feature, ++y);
  const Printed printed = read(text);
  EXPECT_NEAR(printed.body()[M1], 7 * kFilamentMm2, 1e-12);
  EXPECT_NEAR(printed.volume_mm3(), 17 * kFilamentMm2, 1e-12);
  EXPECT_EQ(printed.features.size(), 15U);
}

TEST(Printed, ToolsHaveTheirOwnFilament) {
  const Printed printed = read(
      "; filament_diameter = 1.75,2.85\nG90\nM83\n;TYPE:Perimeter\n;WIDTH:0.4\n;HEIGHT:0.2\nT0\nG1 X0 Y0 Z0.2\nG1 X10 E1\nT1\nG1 "
      "X20 "
      "E1\n");
  EXPECT_NEAR(printed.body()[M1], kFilamentMm2 + std::numbers::pi * 2.85 * 2.85 / 4, 1e-12);
}

TEST(Printed, DensityIsThatOfTheToolThatPrints) {
  const std::string head =
      "; filament_density = 1.24,1.04\n; filament used [mm] = 0.00, 1.00\nG90\nM83\n;TYPE:Perimeter\n;WIDTH:0.4\n"
      ";HEIGHT:0.2\nG1 X0 Y0 Z0.2\n; filament_diameter = 1.75,1.75\n";
  const Printed one = read(head + "T1\nG1 X10 E1\n");
  EXPECT_EQ(one.density_g_cm3, 1.04);
  EXPECT_NEAR(*one.told_volume_mm3, kFilamentMm2, 1e-12);
  const Printed both = read(head + "T0\nG1 X10 E1\nT1\nG1 X20 E1\n");
  EXPECT_NEAR(*both.density_g_cm3, 1.14, 1e-12);
  EXPECT_EQ(both.notes.size(), 1U);
}

TEST(Printed, BridgesDoNotLowerTheBottom) {
  const Printed printed = read(
      "G90\nM83\n;TYPE:Perimeter\n;WIDTH:0.4\n;HEIGHT:0.2\nG1 X0 Y0 Z0.2\nG1 X10 E1\n;TYPE:Bridge infill\n;HEIGHT:0.4\nG1 X0 "
      "E1\nG1 "
      "Z0.3\nG1 X10 E1\n");
  EXPECT_NEAR(printed.bottom_mm, 0, 1e-12);
}

TEST(Printed, WhatNoPrinterDoesIsRefusedAndNothingHasNoHeight) {
  const std::string head = ";TYPE:Perimeter\nG90\nM83\n";
  // A first layer at height 0, and no word of how high layers are.
  const Printed flat = read(head + "G1 X0 Y0 Z0\nG1 X10 E1\n");
  EXPECT_TRUE(flat.body().allFinite());
  EXPECT_NEAR(flat.body()[MZ] / flat.body()[M1], -0.1, 1e-12);
  EXPECT_THROW(read("; filament_diameter = 1e75\n" + head + "G1 X0 Y0 Z0.2\nG1 X10 E1\n"), Error);
  EXPECT_THROW(read(head + "G1 X0 Y0 Z0.2\nG2 X10 I1000000000 E1\n"), Error);
}

TEST(Printed, SeveralBodiesAndACutOffFileAreNoted) {
  const std::string head = "; filament_diameter = 1.75\nG90\nM83\n;TYPE:Perimeter\n;WIDTH:0.4\n;HEIGHT:0.2\n";
  const std::string tower = "G1 X0 Y0 Z0.2\nG1 X10 E1\nG1 Z0.4\nG1 X0 E1\n";
  EXPECT_TRUE(read(head + tower).notes.empty());
  const Printed two = read(head + tower + tower);
  ASSERT_EQ(two.notes.size(), 1U);
  EXPECT_TRUE(mentions(two.notes[0], {"one after the other"}));
  const Printed cut = read("; generated by PrusaSlicer 2.5.0 on 2026\n" + head + tower);
  ASSERT_EQ(cut.notes.size(), 1U);
  EXPECT_TRUE(mentions(cut.notes[0], {"PrusaSlicer 2.5.0", "cut off"}));
  EXPECT_TRUE(read("; generated by PrusaSlicer 2.5.0 on 2026\n" + head + tower + "; filament used [mm] = 2.00\n").notes.empty());
}

TEST(Printed, OnlyTheOutermostLoopsAreTheOutline) {
  const auto square = [](double half) {
    const std::string p = std::to_string(100 + half), m = std::to_string(100 - half);
    return "G1 X" + m + " Y" + m + "\nG1 X" + p + " E1\nG1 Y" + p + " E1\nG1 X" + m + " E1\nG1 Y" + m + " E1\n";
  };
  const Printed printed =
      read("G90\nM83\n" + kHead + "G1 Z0.2\n" + square(4) + square(9) + square(10) + ";TYPE:Skirt\n" + square(20));
  ASSERT_EQ(printed.layers.size(), 1U);
  EXPECT_NEAR(printed.layers[0].size_mm.x(), 20.45, 1e-9);
}

TEST(Printed, APlateInAProjectIsRead) {
  const std::string gcode = "G90\nM83\n; FEATURE: Outer wall\n; LINE_WIDTH: 0.4\n; LAYER_HEIGHT: 0.2\nG1 X0 Y0 Z0.2\nG1 X10 E1\n";
  const auto path = own_file("plate.gcode.3mf");
  const auto save = [&path](const std::vector<detail::ArchivePart>& parts) {
    std::ofstream(path, std::ios::binary) << detail::pack(parts);
  };
  save({{"3D/3dmodel.model", "<model/>"}, {"Metadata/plate_1.gcode", gcode}, {"Metadata/plate_1.gcode.md5", "x"}});
  EXPECT_TRUE(is_printed(path));
  EXPECT_LT(off(read_printed(path).body(), read(gcode).body()), 1e-12);
  save({{"3D/3dmodel.model", "<model/>"}});
  EXPECT_THROW(read_printed(path), Error);
  save({{"Metadata/plate_1.gcode", gcode}, {"Metadata/plate_2.gcode", gcode}});
  EXPECT_THROW(read_printed(path), Error);
}

TEST(Printed, RefusalsNameTheLine) {
  const auto refusal = [](const std::string& text) -> std::string {
    try {
      read(text);
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::input);
      return error.what();
    }
    return "";
  };
  EXPECT_TRUE(mentions(refusal("G90\nG1 X1..2 E1\n"), {"line 2", "number"}));
  EXPECT_TRUE(mentions(refusal("G5 X1 Y1 I0 J1 P0 Q1 E1\n"), {"line 1", "spline"}));
  EXPECT_TRUE(mentions(refusal("G18\nG2 X1 Z1 I1 E1\n"), {"line 2", "plane"}));
  EXPECT_TRUE(mentions(refusal("G2 X1 Y1 E1\n"), {"line 1", "centre"}));
  EXPECT_TRUE(mentions(refusal("G28\nM104 S200\n"), {"no material"}));
  EXPECT_TRUE(mentions(refusal("GCDE\1\2\3"), {"binary"}));
  EXPECT_TRUE(mentions(refusal("G1 X1\rG1 X2 E1\r"), {"carriage returns"}));
  EXPECT_TRUE(mentions(refusal("\xFF\xFEG1"), {"UTF-16"}));
  EXPECT_TRUE(mentions(refusal("G90\nG1 X1000000000 E1\n"), {"line 2", "farther"}));
}

TEST(Printed, KeepsItsBeadsOnRequest) {
  const std::string text = "G90\nM83\n" + kHead + "G1 X90 Y90 Z0.2\nG1 X110 E1\nG1 Y110 E1\n;TYPE:Skirt\nG1 X150 E1\n" + kHead +
                           "G1 X140 Y90\nG3 X130 Y100 I-10 J0 E0.5\n";
  EXPECT_TRUE(read(text).beads.empty());
  const Printed kept = read(text, {.file = {}, .filament_diameter_mm = {}, .keep_beads = true});
  ASSERT_GT(kept.beads.size(), 10U) << "of the arc chords";
  Moments sum = Moments::Zero();
  for (const Bead& bead : kept.beads) sum += bead_moments(bead);
  EXPECT_NEAR(sum[M1], kept.body()[M1], 1e-12 * sum[M1]);
  EXPECT_LT(off(sum, kept.body()), 1e-4) << "chords for an arc; the skirt left out";
}

}  // namespace
}  // namespace rayrep::test
