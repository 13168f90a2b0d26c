// Texts do not depend on the locale that the program has set.

#include <gtest/gtest.h>

#include <clocale>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <locale>
#include <string>
#include <vector>

#include "base/text.h"
#include "rayrep/base/error.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/mesh/mesh_check.h"
#include "rayrep/physics/inertial.h"
#include "rayrep/physics/spin.h"
#include "solids.h"

namespace rayrep {
namespace {

TEST(Text, NumbersAreThoseOfPrintf) {
  for (const double value : {0.0, -0.0, 1.2, -1.25, 123456.0, 1234567.0, 1e-5, 0.0001, 1e300, -1.7976931348623157e308, 2.5,
                             0.1 + 0.2, std::numeric_limits<double>::infinity(), std::nan("")}) {
    char expected[400];
    for (const int digits : {0, 1, 3, 17}) {
      std::snprintf(expected, sizeof expected, "%.*f", digits, value);
      // Numbers of hundreds of digits help nobody.
      EXPECT_EQ(number(value, digits), std::abs(value) < 1e15 || !std::isfinite(value) ? expected : shown(value));
      std::snprintf(expected, sizeof expected, "%.*g", digits, value);
      EXPECT_EQ(shown(value, digits), expected);
    }
  }
}

TEST(Text, CountsPointsAndParts) {
  EXPECT_EQ(plural(1, "edge is", "edges are"), "1 edge is");
  EXPECT_EQ(plural(0, "edge is", "edges are"), "0 edges are");
  EXPECT_EQ(shown(Eigen::Vector3d(-0.0, 1.5, 1234567)), "(0, 1.5, 1.23457e+06)");
  EXPECT_EQ(concat("a", 'b', std::string("c"), 12, -3LL, 0.5), "abc12-30.5");
}

/// A program with a locale in which 1.5 is 1,5 and 1000 is 1.000, for C and C++, until the end of its life.
class GermanProgram {
public:
  GermanProgram() : c_(std::setlocale(LC_ALL, nullptr)), cpp_(std::locale::global(std::locale(std::locale(), new Punctuation))) {
    std::setlocale(LC_ALL, "de_DE.UTF-8");  // where it is installed
  }
  ~GermanProgram() {
    std::locale::global(cpp_);
    std::setlocale(LC_ALL, c_.c_str());
  }

private:
  struct Punctuation : std::numpunct<char> {
    char do_decimal_point() const override { return ','; }
    char do_thousands_sep() const override { return '.'; }
    std::string do_grouping() const override { return "\3"; }
  };
  std::string c_;
  std::locale cpp_;
};

std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::string message_of(const auto& call) {
  try {
    call();
  } catch (const Error& error) {
    return error.what();
  }
  return "nothing was thrown";
}

/// Texts, messages and files of one body, and what is read from the files.
std::vector<std::string> everything_said() {
  Mesh mesh = test::icosphere(2.5, 2);
  for (auto& v : mesh.vertices) v *= 1234.56789;
  const MassProperties body = mass_properties(mesh_moments(mesh), 1.24);
  std::vector<std::string> said = {number(1234567.125, 2),         shown(1234567.125, 9), shown(Eigen::Vector3d(0.5, 1e7, 1234.5)),
                                   plural(12345, "edge", "edges"), urdf_inertial(body),   mjcf_inertial(body)};
  Mesh open = mesh;
  open.triangles.pop_back();
  said.push_back(check_mesh(open).report.refusal);
  said.push_back(message_of([&] { spin_state(body, {0, 0, 0}, {0, 0, 1234.5}, false); }));
  said.push_back(message_of([] { mass_properties(Moments::Constant(-1234.5), 1.24); }));
  for (const char* ending : {".stl", ".obj", ".ply", ".3mf"}) {
    const std::filesystem::path path = test::own_file(std::string("locale") + ending);
    write_mesh(path, mesh);
    said.push_back(bytes_of(path));
    for (const auto& v : read_mesh(path).mesh.vertices)
      for (const double x : v) append_number(said.back() += ' ', x);
    std::filesystem::remove(path);
  }
  const std::filesystem::path text = test::own_file("locale.off");
  std::ofstream(text) << "OFF\n3 1 0\n0.5 0 0\n1.25 0 0\n0 1.75 0\n3 0 1 2\n";
  for (const auto& v : read_mesh(text).mesh.vertices) said.push_back(shown(v));
  std::filesystem::remove(text);
  return said;
}

TEST(Text, IsTheSameForEveryLocaleOfTheProgram) {
  const std::vector<std::string> expected = everything_said();
  const GermanProgram german;
  ASSERT_EQ(std::use_facet<std::numpunct<char>>(std::locale()).decimal_point(), ',');
  EXPECT_EQ(everything_said(), expected);
}

}  // namespace
}  // namespace rayrep
