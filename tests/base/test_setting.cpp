#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "rayrep/base/error.h"
#include "rayrep/base/setting.h"

namespace rayrep {
namespace {

std::string refusal(const std::function<void()>& call) {
  try {
    call();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::usage);
    return error.what();
  }
  ADD_FAILURE() << "nothing was refused";
  return {};
}

TEST(Range, TakesWhatItSays) {
  const Range open{.lo = 0, .hi = 1};
  EXPECT_FALSE(open.contains(0));
  EXPECT_TRUE(open.contains(0.5));
  EXPECT_FALSE(open.contains(1));
  const Range closed{.lo = 0, .hi = 1, .open = false};
  EXPECT_TRUE(closed.contains(0));
  EXPECT_TRUE(closed.contains(1));
  for (const double value : {double(NAN), double(INFINITY), -double(INFINITY)}) EXPECT_FALSE(Range{}.contains(value)) << value;
}

TEST(Setting, NumbersAreReadWholeWithAHintWhereTheyAreNot) {
  double wall = 1;
  Setting row{.name = "wall", .value = "MM", .words = "", .details = "", .place = &wall, .range = Range::positive()};
  parse(row, "+2.5e-1");
  EXPECT_EQ(wall, 0.25);
  const std::pair<const char*, const char*> cases[] = {
      {"1,2", "1.2"}, {"2mm", "without 'mm'"}, {"50%", "0.5"}, {"", "takes a number"}, {"nan", "takes a number"}};
  for (const auto& [text, hint] : cases) EXPECT_NE(refusal([&, t = text] { parse(row, t); }).find(hint), std::string::npos) << text;
  EXPECT_EQ(wall, 0.25) << "what is refused changes nothing";
  wall = -1;
  EXPECT_EQ(refusal([&] { check(Settings{row}); }), "--wall must be a positive number; it is -1.");
}

TEST(Setting, ListsWithGapsAreUsageErrors) {
  for (const char* list : {"1,,3", ",1", "1,x,3", "1,nan,3", ","}) {
    EXPECT_NE(refusal([&] { parse_numbers("com", list); }).find("--com"), std::string::npos) << list;
    EXPECT_NE(refusal([&] { parse_open_numbers("com", list); }).find("--com"), std::string::npos) << list;
  }
  EXPECT_EQ(parse_open_numbers("com", "1,-,3"), (std::vector<std::optional<double>>{1, std::nullopt, 3}));
}

TEST(Setting, NearestNamesAreNearInLettersOnly) {
  const std::vector<std::string> names = {"--density", "--wall", "--waterline"};
  EXPECT_EQ(nearest_name("--densty", names), "--density");
  EXPECT_EQ(nearest_name("--dnesity", names), "--density");
  EXPECT_EQ(nearest_name("--wal", names), "--wall");
  EXPECT_EQ(nearest_name("--xyzzy-plugh", names), "");
}

TEST(Setting, DirectionsAndPointsComeBackAsTheyWereTold) {
  Eigen::Vector3d up;
  const TextPlace place = direction_place("up", up);
  for (const char* text : {"x", "-y", "z", "0,0.6,0.8"}) {
    place.parse(text);
    EXPECT_EQ(place.show(), text);
  }
  EXPECT_NE(refusal([&] { place.parse("0,0,0"); }).find("is no direction"), std::string::npos);
  std::optional<Eigen::Vector3d> point;
  const TextPlace at = point_place("center", point, "auto");
  EXPECT_EQ(at.show(), "auto");
  at.parse("1,-2,3.5");
  EXPECT_EQ(at.show(), "1,-2,3.5");
  EXPECT_NE(refusal([&] { at.parse("1,2"); }).find("--center takes X,Y,Z"), std::string::npos);
}

}  // namespace
}  // namespace rayrep
