// The arithmetic of the harness: what docs/results.md says rests on it.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "record.h"
#include "statistics.h"
#include "svg.h"

namespace rayrep::bench {
namespace {

TEST(Spread, IsMedianSmallestAndLargest) {
  const Spread odd = spread({3, 1, 2});
  EXPECT_EQ(odd.median, 2);
  EXPECT_EQ(odd.smallest, 1);
  EXPECT_EQ(odd.largest, 3);
  EXPECT_EQ(odd.repeats, 3);
  EXPECT_EQ(spread({4, 1, 100, 2}).median, 3);
  EXPECT_EQ(spread({7}).median, 7);
  EXPECT_EQ(spread({}).repeats, 0);
}

TEST(PowerLaw, IsFoundExactly) {
  std::vector<double> x;
  std::vector<double> y;
  for (const double v : {40.0, 54.0, 64.0, 80.0}) {
    x.push_back(v);
    y.push_back(2.5e-4 * std::pow(v, 2.2));
  }
  const PowerLaw fit = fit_power_law(x, y);
  EXPECT_NEAR(fit.exponent, 2.2, 1e-12);
  EXPECT_NEAR(fit.factor, 2.5e-4, 1e-15);
}

TEST(PowerLaw, IsTheLineOfLeastSquares) {
  // Deviations of one factor of e up, two down, one up over equal steps have no slope of their own.
  const double e = std::exp(1.0);
  const PowerLaw fit = fit_power_law({1, e, e * e}, {1 * e, e / (e * e), e * e * e});
  EXPECT_NEAR(fit.exponent, 1, 1e-12);
  EXPECT_NEAR(fit.factor, 1, 1e-12);
}

TEST(PowerLaw, NeedsTwoPlaces) {
  EXPECT_TRUE(std::isnan(fit_power_law({}, {}).exponent));
  EXPECT_TRUE(std::isnan(fit_power_law({5}, {1}).exponent));
  EXPECT_TRUE(std::isnan(fit_power_law({5, 5}, {1, 2}).exponent));
  EXPECT_TRUE(std::isnan(fit_power_law({5, 6}, {1}).exponent));
}

TEST(Slower, NeedsBothPercentAndMilliseconds) {
  EXPECT_FALSE(slower(1.0, 1.14));      // 140 ms, but 14 %
  EXPECT_TRUE(slower(1.0, 1.16));       // both
  EXPECT_FALSE(slower(0.010, 0.0195));  // 95 %, but 9.5 ms
  EXPECT_TRUE(slower(0.010, 0.0205));   // both
  EXPECT_FALSE(slower(1.0, 0.5));
}

TEST(Significant, KeepsTheDigitsAskedFor) {
  EXPECT_EQ(significant(19.406, 3), "19.4");
  EXPECT_EQ(significant(0.00036789, 2), "0.00037");
  EXPECT_EQ(significant(94975, 3), "94975");
  EXPECT_EQ(significant(1.5e-9, 2), "1.5e-09");
  EXPECT_EQ(significant(0, 3), "0");
  EXPECT_EQ(significant(kUnknown, 3), "-");
}

Record solved(const std::string& solver, double seconds, double objective) {
  Record r;
  r.table = "table2";
  r.mesh = "bird.stl";
  r.goal = "spin";
  r.solver = solver;
  r.resolution = 80;
  r.status = "converged";
  r.seconds = spread({seconds});
  r.objective = objective;
  return r;
}

TEST(Regressions, AreSlowerWorseOrGone) {
  Measurements before;
  before.records = {solved("a", 1, 0.7), solved("b", 1, 0.7), solved("c", 1, 0.7), solved("d", 1, 0.7), solved("e", 1, 0.7)};
  Measurements after;
  after.records = {solved("a", 1.1, 0.7), solved("b", 1.2, 0.7), solved("c", 0.1, 0.71), solved("d", 1, 0.7), solved("new", 9, 9)};
  after.records[3].status = "capped";
  int matched = 0;
  const std::vector<std::string> lines = regressions(before, after, &matched);
  EXPECT_EQ(matched, 4);
  ASSERT_EQ(lines.size(), 3u);
  EXPECT_NE(lines[0].find("b, N = 80: 1.00 s -> 1.20 s"), std::string::npos) << lines[0];
  EXPECT_NE(lines[1].find("objective 0.700000 -> 0.710000"), std::string::npos) << lines[1];
  EXPECT_NE(lines[2].find("was converged, now capped"), std::string::npos) << lines[2];
  EXPECT_TRUE(regressions(before, before).empty());
}

TEST(Measurements, ComesBackFromItsFile) {
  Measurements run = describe_machine("abc");
  run.records = {solved("quadric", 2e-4, 0.61)};
  run.records[0].more["passes"] = 3;
  run.records[0].variables = 100'224;
  const auto path = std::filesystem::temp_directory_path() / "rayrep_test_bench.json";
  std::ofstream(path) << to_json(run);
  const Measurements read = read_run(path);
  EXPECT_EQ(to_json(read), to_json(run));
  EXPECT_EQ(read.commit, "abc");
  ASSERT_EQ(read.records.size(), 1u);
  EXPECT_EQ(read.records[0].variables, 100'224);
  EXPECT_EQ(read.records[0].extra("passes"), 3);
  EXPECT_TRUE(std::isnan(read.records[0].gap));
  std::ofstream(path) << "{}";
  EXPECT_THROW(read_run(path), std::runtime_error);
  std::filesystem::remove(path);
}

TEST(Svg, PutsEqualRatiosAtEqualDistances) {
  const std::string svg = to_svg({"t", "x & y", "y", {{"curve", {1, 10, 100, 0}, {1, 100, 10000, 5}}}});
  std::vector<double> x;
  for (std::size_t at = svg.find("cx=\""); at != std::string::npos; at = svg.find("cx=\"", at + 1))
    x.push_back(std::stod(svg.substr(at + 4)));
  ASSERT_EQ(x.size(), 3u);  // the point at x = 0 has no place on a logarithmic axis
  EXPECT_NEAR(x[1] - x[0], x[2] - x[1], 0.11);
  EXPECT_GT(x[1], x[0]);
  EXPECT_NE(svg.find("x &amp; y"), std::string::npos);
}

}  // namespace
}  // namespace rayrep::bench
