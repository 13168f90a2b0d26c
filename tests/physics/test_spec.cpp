#include <gtest/gtest.h>

#include <map>
#include <set>

#include "rayrep/base/error.h"
#include "rayrep/physics/materials.h"
#include "rayrep/physics/spec.h"

namespace rayrep {
namespace {

using For = Setting::For;

/// Texts that each row takes, by its name.
const std::map<std::string, std::string> kTexts = {{"up", "-x"},
                                                   {"fluid", "1.025"},
                                                   {"waterline", "12.5"},
                                                   {"submerged", "0.25"},
                                                   {"point", "1,2,3"},
                                                   {"center", "1,2,3"},
                                                   {"axle", "m4"},
                                                   {"gap", "3.5"},
                                                   {"cut", "z=10;x=-2.5"},
                                                   {"pin-diameter", "3"},
                                                   {"pin-clearance", "0.2"},
                                                   {"prefer", "smallest"},
                                                   {"objective", ""},
                                                   {"lambda", "0.5"},
                                                   {"gamma-c", "2"},
                                                   {"gamma-i", "3"},
                                                   {"axis", "auto"},
                                                   {"max-tilt", "20"},
                                                   {"target", "4,5,6"},
                                                   {"contact", "0.1"},
                                                   {"flatten", "0.7"},
                                                   {"mass", "80"},
                                                   {"com", "1,-,3"},
                                                   {"inertia", "1,2,-"},
                                                   {"minimise", "com_z,-ixx"},
                                                   {"reserve", "0.1"},
                                                   {"stand", "z;-y"},
                                                   {"hang", "1,2,3:x"},
                                                   {"float", "-z:12.5;y"},
                                                   {"roly-poly", "y"},
                                                   {"spin", "x:1,2,3"},
                                                   {"min-tip", "20"},
                                                   {"load", "z:0.4"},
                                                   {"faces", "6"},
                                                   {"fairness", "1.1"},
                                                   {"shake", "5"},
                                                   {"max-mass", "50"},
                                                   {"at-least", "mass=3,com_z=-2,spin-ratio=1.25"},
                                                   {"at-most", "mass=9,ixx=4"}};

/// What a row is told is what it shows, and nothing else of the spec changes.
template <typename S>
void expect_rows_keep_what_they_are_told() {
  for (const For purpose : {For::making, For::judging}) {
    S spec;
    Settings rows = settings(spec, purpose);
    std::set<std::string> names;
    for (Setting& row : rows) {
      EXPECT_TRUE(names.insert(row.name).second) << row.name << " is there twice";
      EXPECT_FALSE(row.words.empty()) << row.name;
      if (row.value.empty() || row.name == "objective") continue;
      ASSERT_TRUE(kTexts.contains(row.name)) << row.name;
      std::vector<std::string> before;
      for (const Setting& other : rows) before.push_back(shown(other));
      parse(row, kTexts.at(row.name));
      const std::string told = row.name == "inertia" ? "1,2,-,-,-,-" : kTexts.at(row.name);
      EXPECT_EQ(shown(row), told) << row.name;
      for (std::size_t n = 0; n < rows.size(); ++n) {
        const bool same_number = rows[n].name == "max-tilt" && row.name == "axis";
        if (rows[n].name == row.name || same_number) continue;
        EXPECT_EQ(shown(rows[n]), before[n]) << row.name << " changed " << rows[n].name;
      }
    }
  }
}

TEST(Spec, RowsKeepWhatTheyAreTold) {
  expect_rows_keep_what_they_are_told<FloatSpec>();
  expect_rows_keep_what_they_are_told<SpinSpec>();
  expect_rows_keep_what_they_are_told<StandSpec>();
  expect_rows_keep_what_they_are_told<TargetSpec>();
  expect_rows_keep_what_they_are_told<PoseSpec>();
  expect_rows_keep_what_they_are_told<DiceSpec>();
}

TEST(Spec, JudgesAskForNothingThatMakersAloneUse) {
  SpinSpec spec;
  std::set<std::string> names;
  for (const Setting& row : settings(spec, For::judging)) names.insert(row.name);
  for (const char* name : {"lambda", "certify", "axis", "max-tilt", "yoyo"}) EXPECT_FALSE(names.contains(name)) << name;
  for (const char* name : {"up", "point", "center", "prefer"}) EXPECT_TRUE(names.contains(name)) << name;
}

template <typename S>
std::string refused(const S& spec, For purpose = For::making) {
  try {
    check(spec, purpose);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::usage);
    return error.what();
  }
  return {};
}

TEST(Spec, TheLibraryChecksForCallersWhoAreNotTheCommand) {
  FloatSpec floating;
  EXPECT_EQ(refused(floating), "");
  floating.print.wall_mm = 0;
  EXPECT_EQ(refused(floating), "--wall must be a positive number; it is 0.");
  EXPECT_EQ(refused(floating, For::judging), "") << "a judge need not judge the wall";
  floating.print = {.density_g_cm3 = 1240};
  EXPECT_NE(refused(floating).find("looks like kg/m3: give 1.24"), std::string::npos);
  floating = {};
  floating.waterline_mm = 3;
  floating.submerged_fraction = 0.5;
  EXPECT_NE(refused(floating).find("not both"), std::string::npos);

  SpinSpec spin;
  spin.centre_mm = Eigen::Vector3d::Zero();
  EXPECT_NE(refused(spin).find("--center belongs to --yoyo"), std::string::npos);
  spin.yoyo = true;
  EXPECT_EQ(refused(spin), "");
  spin.axis.through = SpinAxis::Through::centre_of_mass;
  EXPECT_NE(refused(spin).find("--point belongs to tops"), std::string::npos);
  EXPECT_NE(refused(TargetSpec{}).find("Say which numbers are wanted"), std::string::npos);
}

TEST(Spec, AllOfItMaySubmerge) {
  for (const char* text : {"1", "100%", "1volume", "100%volume", "1height"}) {
    FloatSpec spec;
    for (Setting& row : settings(spec, For::making))
      if (row.name == "submerged") parse(row, text);
    EXPECT_TRUE(is_submerged(spec)) << text;
    EXPECT_EQ(refused(spec), "") << text;
  }
  FloatSpec spec;
  EXPECT_FALSE(is_submerged(spec));
  for (const double fraction : {0.999, 1.001}) {
    spec.submerged_fraction = fraction;
    EXPECT_FALSE(is_submerged(spec));
    EXPECT_EQ(refused(spec).empty(), fraction < 1);
  }
}

TEST(Fluids, AreKnownByName) {
  FloatSpec spec;
  for (Setting& row : settings(spec, For::making))
    if (row.name == "fluid")
      for (const Fluid& fluid : fluids()) {
        parse(row, fluid.name);
        EXPECT_EQ(spec.fluid_g_cm3, fluid.density_g_cm3);
        EXPECT_GT(fluid.density_g_cm3, 0.5);
      }
}

}  // namespace
}  // namespace rayrep
