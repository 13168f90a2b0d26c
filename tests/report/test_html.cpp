// The page of a report: what is read out of it again, by a reader of its own, is what was put in.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "rayrep/base/error.h"
#include "rayrep/judge/verify.h"
#include "rayrep/mesh/mesh_check.h"
#include "rayrep/report/html.h"
#include "rayrep/report/page_data.h"
#include "report/packed_mesh.h"
#include "solids.h"

namespace rayrep {
namespace {

using namespace test;
using report_detail::kSteps;
using Json = nlohmann::json;

// --------------------------------------------------------------------------------------------------- a reader of its own

/// The text of the block with that id.
std::string block(const std::string& page, const std::string& id) {
  const std::size_t named = page.find("id=\"" + id + "\">");
  if (named == std::string::npos) return {};
  const std::size_t begin = page.find('>', named) + 1;
  return page.substr(begin, page.find("</script>", begin) - begin);
}

Json data_of(const std::string& page) { return Json::parse(block(page, "rayrep-data")); }

std::string from_base64(const std::string& text) {
  static const std::string kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  unsigned bits = 0;
  int count = 0;
  for (const char c : text) {
    if (c == '=') break;
    bits = (bits << 6 | static_cast<unsigned>(kDigits.find(c))) & 0xFFFF;
    count += 6;
    if (count >= 8) bytes += static_cast<char>(bits >> (count -= 8) & 255);
  }
  return bytes;
}

/// What packed() describes, read with the plainest of means.
class Reader {
public:
  explicit Reader(std::string bytes) : bytes_(std::move(bytes)) {}

  /// Vertices in steps.
  Mesh read() {
    const std::uint64_t triangles = next();
    const std::uint64_t vertices = next();
    while (mesh_.triangles.size() < triangles) {
      Eigen::Vector3i corners;
      for (int k = 0; k < 3; ++k) {
        const std::uint64_t known = next();
        corners[k] = known > 0 ? static_cast<int>(known - 1)
                               : vertex(mesh_.vertices.empty() ? Eigen::Vector3d::Zero().eval() : mesh_.vertices.back());
      }
      add(corners,
          {Eigen::Vector3i(corners[2], corners[0], corners[1]), Eigen::Vector3i(corners[1], corners[2], corners[0]), corners});
      while (!edges_.empty()) cross();
    }
    EXPECT_EQ(mesh_.vertices.size(), vertices);
    EXPECT_EQ(at_, bytes_.size()) << "there is more";
    return mesh_;
  }

private:
  std::uint64_t next() {
    std::uint64_t n = 0;
    for (int shift = 0;; shift += 7) {
      const auto byte = static_cast<unsigned char>(bytes_.at(at_++));
      n |= static_cast<std::uint64_t>(byte & 127) << shift;
      if (byte < 128) return n;
    }
  }
  static std::int64_t with_sign(std::uint64_t n) {
    return n % 2 == 0 ? static_cast<std::int64_t>(n / 2) : -static_cast<std::int64_t>(n / 2) - 1;
  }
  int vertex(const Eigen::Vector3d& expected) {
    Eigen::Vector3d p = expected;
    for (int k = 0; k < 3; ++k) p[k] += static_cast<double>(with_sign(next()));
    mesh_.vertices.push_back(p);
    return static_cast<int>(mesh_.vertices.size()) - 1;
  }
  void add(const Eigen::Vector3i& t, const std::vector<Eigen::Vector3i>& open) {
    mesh_.triangles.push_back(t);
    for (int k = 0; k < 3; ++k) run_.insert({t[k], t[(k + 1) % 3]});
    edges_.insert(edges_.end(), open.begin(), open.end());
  }
  void cross() {
    const Eigen::Vector3i edge = edges_.back();
    edges_.pop_back();
    const int a = edge[0], b = edge[1], c = edge[2];
    if (run_.contains({b, a})) return;
    const std::uint64_t code = next();
    if (code == 1) return;
    int d = 0;
    if (code == 0) {
      const auto p = [this](int v) { return mesh_.vertices[static_cast<std::size_t>(v)]; };
      d = vertex(p(a) + p(b) - p(c));
    } else {
      d = named_ += static_cast<int>(with_sign(code - 2));
    }
    add({b, a, d}, {Eigen::Vector3i(d, b, a), Eigen::Vector3i(a, d, b)});
  }

  std::string bytes_;
  std::size_t at_ = 0;
  Mesh mesh_;
  std::set<std::pair<int, int>> run_;
  std::vector<Eigen::Vector3i> edges_;
  int named_ = 0;
};

using Corners = std::array<std::array<std::int64_t, 3>, 3>;

/// The triangles by their corners in whole steps, each from its smallest corner on.
std::multiset<Corners> triangles_of(const Mesh& mesh) {
  std::multiset<Corners> all;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    Corners corners;
    for (std::size_t k = 0; k < 3; ++k)
      for (int n = 0; n < 3; ++n) corners[k][static_cast<std::size_t>(n)] = std::llround(mesh.corner(t, static_cast<int>(k))[n]);
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
    all.insert(corners);
  }
  return all;
}

Mesh in_steps(Mesh mesh, const Eigen::AlignedBox3d& box) {
  for (Eigen::Vector3d& v : mesh.vertices)
    for (int k = 0; k < 3; ++k) v[k] = box.sizes()[k] > 0 ? std::round((v[k] - box.min()[k]) / box.sizes()[k] * kSteps) : 0;
  return mesh;
}

void expect_same_triangles(const Mesh& mesh) {
  const Eigen::AlignedBox3d box = bounding_box(mesh);
  const Mesh read = Reader(report_detail::packed(mesh, box)).read();
  EXPECT_EQ(triangles_of(read), triangles_of(in_steps(mesh, box)));
}

Eigen::Vector3d vector_of(const Json& json) { return {json[0].get<double>(), json[1].get<double>(), json[2].get<double>()}; }

/// A body of the page in mm.
Mesh mesh_in(const std::string& page, const std::string& id) {
  const Json view = data_of(page)["view"];
  Mesh mesh = Reader(from_base64(block(page, id))).read();
  for (Eigen::Vector3d& v : mesh.vertices) v = vector_of(view["low_mm"]) + v.cwiseProduct(vector_of(view["size_mm"])) / kSteps;
  return mesh;
}

std::size_t count_of(const std::string& text, const std::string& what) {
  std::size_t count = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++count;
  return count;
}

// ---------------------------------------------------------------------------------------------------------------- bodies

/// An egg with a cavity low down, which floats.
struct Egg {
  Mesh outer = uv_ellipsoid(30, 22, 16, 24);
  Mesh inner = uv_ellipsoid(26, 18, 11, 20, {0, 0, 2});
  Delivery body = delivery(test::hollow(outer, inner));
  RunReport report;

  explicit Egg(const Spec& spec = FloatSpec{}) {
    report.command = "verify";
    report.input.path = "egg.stl";
    report.after = verify(body, &outer, spec);
  }
};

TEST(PackedMesh, HoldsTheTrianglesOfAnyMesh) {
  expect_same_triangles(icosphere(10, 3));
  expect_same_triangles(torus(20, 6, 24, 12));
  expect_same_triangles(l_shape(3));
  expect_same_triangles(test::hollow(icosphere(10, 2), icosphere(6, 2)));
  expect_same_triangles(soup(icosphere(10, 1)));
  Mesh open = torus(20, 6, 24, 12);
  open.triangles.resize(open.triangles.size() / 3);
  expect_same_triangles(open);
  expect_same_triangles(
      Mesh{{Eigen::Vector3d(1, 2, 3), Eigen::Vector3d(4, 2, 3), Eigen::Vector3d(1, 5, 3)}, {Eigen::Vector3i(0, 1, 2)}});
  expect_same_triangles(Mesh{});
}

TEST(PackedMesh, HoldsTrianglesThatShareEdgesInAnyWay) {
  Random random(7);
  for (int round = 0; round < 200; ++round) {
    Mesh mesh;
    const int vertices = 4 + round % 9;
    for (int v = 0; v < vertices; ++v) mesh.vertices.emplace_back(random.uniform(), random.uniform(), random.uniform());
    for (int t = 0; t < 3 * vertices; ++t) {
      const auto any = [&] { return static_cast<int>(random.uniform() * vertices); };
      const Eigen::Vector3i corners(any(), any(), any());
      if (corners[0] != corners[1] && corners[1] != corners[2] && corners[2] != corners[0]) mesh.triangles.push_back(corners);
    }
    expect_same_triangles(mesh);
  }
}

TEST(PackedMesh, IsSmall) {
  const Mesh ball = icosphere(40, 5);  // 20,480 triangles
  EXPECT_LT(report_detail::packed(ball, bounding_box(ball)).size(), 6 * ball.triangles.size());
}

TEST(Base64, IsThatOfTheStandard) {
  // RFC 4648, section 10.
  const std::pair<const char*, const char*> vectors[] = {{"", ""},
                                                         {"f", "Zg=="},
                                                         {"fo", "Zm8="},
                                                         {"foo", "Zm9v"},
                                                         {"foob", "Zm9vYg=="},
                                                         {"fooba", "Zm9vYmE="},
                                                         {"foobar", "Zm9vYmFy"}};
  for (const auto& [bytes, text] : vectors) EXPECT_EQ(report_detail::base64(bytes), text);
  std::string all;
  for (int n = 0; n < 256; ++n) all += static_cast<char>(n);
  EXPECT_EQ(from_base64(report_detail::base64(all)), all);
}

TEST(IsClosed, CountsEdgesBothWays) {
  EXPECT_TRUE(report_detail::is_closed(torus(20, 6, 24, 12)));
  Mesh open = icosphere(10, 2);
  open.triangles.pop_back();
  EXPECT_FALSE(report_detail::is_closed(open));
  Mesh turned = icosphere(10, 2);
  std::swap(turned.triangles[5][0], turned.triangles[5][1]);
  EXPECT_FALSE(report_detail::is_closed(turned));
}

TEST(Coarsened, StaysClosedAndKeepsItsShape) {
  const Mesh ball = icosphere(40, 5);
  const Mesh coarse = report_detail::coarsened(ball, 4000);
  EXPECT_LE(coarse.triangles.size(), 4000u);
  EXPECT_GE(coarse.triangles.size(), 1000u);
  EXPECT_TRUE(report_detail::is_closed(coarse));
  EXPECT_NEAR(mesh_moments(coarse)[M1] / mesh_moments(ball)[M1], 1, 0.02);
  // It lies inside, nowhere by more than two cells.
  for (const Eigen::Vector3d& v : coarse.vertices) EXPECT_NEAR(v.norm(), 40, 2.5);
  EXPECT_EQ(report_detail::coarsened(ball, ball.triangles.size()).triangles, ball.triangles);
}

TEST(Html, HoldsTheMeshesWithinTheRoundingItTells) {
  const Egg egg;
  const std::string page = to_html(egg.report, egg.body);
  const Json view = data_of(page)["view"];
  ASSERT_EQ(view["meshes"].size(), 2u);
  EXPECT_EQ(view["meshes"][0]["what"], "shell");
  EXPECT_EQ(view["meshes"][1]["what"], "cavity");
  const double rounding_mm = view["rounding_mm"];
  EXPECT_NEAR(rounding_mm, 60.0 / 65535 / 2, 1e-12);
  double volume_mm3 = 0;
  const Mesh* given[] = {&egg.outer, &egg.inner};
  for (std::size_t n = 0; n < 2; ++n) {
    const Json& told = view["meshes"][n];
    const Mesh mesh = mesh_in(page, told["id"]);
    EXPECT_TRUE(told["closed"]);
    EXPECT_EQ(told["triangles"], given[n]->triangles.size());
    EXPECT_EQ(told["shown"], mesh.triangles.size());
    EXPECT_EQ(mesh.vertices.size(), given[n]->vertices.size());
    for (const Eigen::Vector3d& v : mesh.vertices) {
      double nearest = 1e9;
      for (const Eigen::Vector3d& w : given[n]->vertices) nearest = std::min(nearest, (v - w).cwiseAbs().maxCoeff());
      EXPECT_LE(nearest, rounding_mm * (1 + 1e-9));
    }
    volume_mm3 += mesh_moments(mesh)[M1];
  }
  // The surface moves by no more than the rounding along each axis.
  const double area_mm2 = 4 * kPi * (30 * 22 + 26 * 18);
  EXPECT_NEAR(volume_mm3, mesh_moments(egg.body.body())[M1], area_mm2 * std::sqrt(3.0) * rounding_mm);
}

TEST(Html, HoldsTheReport) {
  const Egg egg;
  const Json data = data_of(to_html(egg.report, egg.body));
  EXPECT_EQ(data["report"], Json::parse(to_json(egg.report)));
  EXPECT_EQ(data["told"]["meaning"], Json(egg.report.after.meaning));
  ASSERT_EQ(data["told"]["criteria"].size(), egg.report.after.criteria.size());
  for (std::size_t n = 0; n < egg.report.after.criteria.size(); ++n) {
    EXPECT_EQ(data["told"]["criteria"][n]["name"], egg.report.after.criteria[n].name);
    EXPECT_EQ(data["told"]["criteria"][n]["pass"], egg.report.after.criteria[n].pass());
  }
  // The figures are told as the text tells them.
  const std::string text = to_text(egg.report, false);
  ASSERT_GT(data["told"]["figures"]["table"].size(), 4u);
  for (const Json& row : data["told"]["figures"]["table"]) {
    const std::string words = row[0], value = row[2];
    const std::size_t at = text.find("\n  " + words + " ");
    ASSERT_NE(at, std::string::npos) << words;
    const std::string line = text.substr(at + 1, text.find('\n', at + 1) - at - 1);
    EXPECT_TRUE(line.ends_with(" " + value)) << line << " / " << value;
  }
  // The same as text, for those who let no page run anything.
  const std::string page = to_html(egg.report, egg.body);
  const std::size_t begin = page.find("<noscript>"), end = page.find("</noscript>");
  ASSERT_LT(begin, end);
  EXPECT_TRUE(mentions(page.substr(begin, end - begin), {"metacentric height, mm", "thinnest wall, over the wall asked for"}));
  EXPECT_EQ(to_html(egg.report, egg.body), page);
}

TEST(Html, NothingOfAFileNameIsRun) {
  Egg egg;
  const std::string plain = to_html(egg.report, egg.body);
  const std::string name =
      "</script><script>alert(1)</script><!-- ' \" & \xE2\x80\xA8\xE2\x80\xA9 \xFF\x01 ]]> rayrep:plain-text "
      "<!--rayrep:data-->.stl";
  egg.report.input.path = egg.report.output = name;
  egg.report.options = {{name, name}};
  egg.report.after.notes = {name};
  egg.report.after.headline = name;
  const std::string page = to_html(egg.report, egg.body);
  for (const char* mark : {"<script", "</script", "<!--", "<style", "<title", "alert(1)</"})
    EXPECT_EQ(count_of(page, mark), count_of(plain, mark)) << mark;
  const std::string data = block(page, "rayrep-data");
  for (const char* mark : {"<", ">", "&", "\xE2\x80\xA8", "\xE2\x80\xA9"}) EXPECT_EQ(data.find(mark), std::string::npos) << mark;
  const Json json = data_of(page);
  EXPECT_EQ(json["report"], Json::parse(to_json(egg.report)));
  EXPECT_EQ(json["told"]["notes"][0], json["report"]["notes"][0]);
  EXPECT_NE(json["title"].get<std::string>().find("</script><script>alert(1)</script><!-- ' \" & "), std::string::npos);
  const std::string title = page.substr(page.find("<title>") + 7, page.find("</title>") - page.find("<title>") - 7);
  EXPECT_EQ(title.find_first_of("<>\"'\x01"), std::string::npos) << title;
  EXPECT_EQ(mesh_in(page, "rayrep-mesh-0").triangles.size(), egg.outer.triangles.size());
}

TEST(Html, NeedsNothingElse) {
  const Egg egg;
  const std::string page = to_html(egg.report, egg.body);
  EXPECT_NE(page.find("content=\"default-src 'none'; script-src 'sha256-"), std::string::npos);
  const std::string policy = page.substr(page.find("default-src"), page.find("form-action") - page.find("default-src"));
  for (const char* open : {"http", "*", "unsafe", "connect-src", "'self'"}) EXPECT_EQ(policy.find(open), std::string::npos) << open;
  for (const char* load : {" src=", " href=", "@import", "url("}) EXPECT_EQ(page.find(load), std::string::npos) << load;
  EXPECT_NE(page.find("Permission is hereby granted, free of charge"), std::string::npos) << "the licence of three.js";
}

TEST(Html, StaysBelowThreeMegabytes) {
  // 25,088 triangles outside, and many more inside.
  const Mesh outer = uv_ellipsoid(30, 22, 16, 80);
  const Mesh fine = uv_ellipsoid(28, 20, 14, 320);  // 408,320 triangles
  RunReport report;
  report.command = "verify";
  const Mesh both = test::hollow(outer, fine);
  ASSERT_GE(outer.triangles.size(), 25'000u);
  const std::string page = to_html(report, delivery(both));
  EXPECT_LT(page.size(), 3'000'000u);
  const Json meshes = data_of(page)["view"]["meshes"];
  EXPECT_EQ(meshes[0]["shown"], outer.triangles.size()) << "the outside is shown as it is";
  EXPECT_EQ(meshes[1]["triangles"], fine.triangles.size());
  EXPECT_LE(meshes[1]["shown"].get<std::size_t>(), 300'000u);
  const Mesh shown = mesh_in(page, "rayrep-mesh-1");
  EXPECT_EQ(meshes[1]["shown"], shown.triangles.size());
  EXPECT_NEAR(mesh_moments(shown)[M1], -mesh_moments(fine)[M1], 0.01 * mesh_moments(fine)[M1]);
}

TEST(Html, ShowsAnOutsideOfManyTrianglesCoarser) {
  const Mesh fine = uv_ellipsoid(30, 22, 16, 720);
  const Json meshes = data_of(to_html(RunReport{}, delivery(fine)))["view"]["meshes"];
  EXPECT_EQ(meshes[0]["triangles"], 4 * 720 * 719);
  EXPECT_LE(meshes[0]["shown"].get<std::size_t>(), 2'000'000u);
  EXPECT_GT(meshes[0]["shown"].get<std::size_t>(), 500'000u);
}

TEST(Html, TellsWhereABodyFloats) {
  FloatSpec spec;
  spec.up = {1, 2, 2};
  spec.waterline_mm = 12;
  const Egg egg{spec};
  const Json attitude = data_of(to_html(egg.report, egg.body))["view"]["attitudes"][0];
  EXPECT_EQ(attitude["kind"], "floats");
  EXPECT_EQ(attitude["waterline_mm"], 12);
  const Eigen::Vector3d up = vector_of(attitude["up"]);
  EXPECT_NEAR((up - Eigen::Vector3d(1, 2, 2) / 3).norm(), 0, 1e-15);
  double lowest = 1e9, highest = -1e9;
  for (const Eigen::Vector3d& v : egg.outer.vertices) {
    lowest = std::min(lowest, up.dot(v));
    highest = std::max(highest, up.dot(v));
  }
  EXPECT_NEAR(attitude["lowest_mm"].get<double>(), lowest, 1e-9);
  EXPECT_NEAR(attitude["highest_mm"].get<double>(), highest, 1e-9);
}

TEST(Html, TellsWhereABodyStands) {
  StandSpec spec;
  spec.up = {0, 1, 0};
  const Mesh brick = test::box({1, 2, 3}, {31, 12, 23});
  RunReport report;
  report.command = "verify";
  report.after = verify(brick, nullptr, Spec(spec));
  const Json data = data_of(to_html(report, delivery(brick)));
  const Json& attitude = data["view"]["attitudes"][0];
  EXPECT_EQ(attitude["kind"], "stands");
  // The corners of the foot, brought back into the body's frame, are those of its base.
  Eigen::Matrix3d to_ground;
  for (int n = 0; n < 3; ++n) to_ground.row(n) = vector_of(attitude["to_ground"][static_cast<std::size_t>(n)]);
  const Json& corners = data["report"]["after"]["support_polygon_mm"];
  ASSERT_EQ(corners.size(), 4u);
  for (const Json& corner : corners) {
    const Eigen::Vector3d p = to_ground.transpose() * Eigen::Vector3d(corner[0], corner[1], attitude["lowest_mm"].get<double>());
    EXPECT_NEAR(p.y(), 2, 1e-9);
    EXPECT_NEAR(std::min(std::abs(p.x() - 1), std::abs(p.x() - 31)), 0, 1e-9);
    EXPECT_NEAR(std::min(std::abs(p.z() - 3), std::abs(p.z() - 23)), 0, 1e-9);
  }
}

TEST(Html, TellsTheAxisOfASpin) {
  const Egg egg{SpinSpec{}};
  const Json attitude = data_of(to_html(egg.report, egg.body))["view"]["attitudes"][0];
  EXPECT_EQ(attitude["kind"], "spins");
  EXPECT_NEAR((vector_of(attitude["point_mm"]) - Eigen::Vector3d(0, 0, -16)).norm(), 0, 1e-9);
}

TEST(Html, TellsEveryPose) {
  PoseSpec spec;
  spec.poses = {{.kind = Pose::Kind::hangs, .point_mm = {1, 2, 40}},
                {.kind = Pose::Kind::floats, .up = Eigen::Vector3d(0, 1, 0)},
                {.kind = Pose::Kind::rights},
                {.kind = Pose::Kind::spins}};
  const Egg egg{spec};
  const Json attitudes = data_of(to_html(egg.report, egg.body))["view"]["attitudes"];
  ASSERT_EQ(attitudes.size(), 4u);
  EXPECT_EQ(attitudes[0]["kind"], "hangs");
  EXPECT_EQ(vector_of(attitudes[0]["point_mm"]), Eigen::Vector3d(1, 2, 40));
  EXPECT_EQ(attitudes[0]["prefix"], "pose_1_");
  EXPECT_EQ(attitudes[1]["kind"], "floats");
  EXPECT_EQ(vector_of(attitudes[1]["up"]), Eigen::Vector3d(0, 1, 0));
  EXPECT_EQ(attitudes[2]["kind"], "rights itself");
  EXPECT_NE(attitudes[2]["words"].get<std::string>(), "");
  EXPECT_EQ(attitudes[3]["kind"], "spins");
  EXPECT_NEAR((vector_of(attitudes[3]["point_mm"]) - Eigen::Vector3d(0, 0, -16)).norm(), 0, 1e-9);
  // Where nobody has said at which waterline it floats, that at which it was judged.
  EXPECT_GT(attitudes[1]["waterline_mm"].get<double>(), 0);
}

TEST(Html, ShowsWhatIsPutInAndWhatIsSparse) {
  Egg egg;
  egg.body.parts.push_back({.mesh = icosphere(2, 2, {0, 0, -12}), .role = Part::Role::insert, .density_g_cm3 = 7.5});
  egg.body.parts.push_back({.mesh = icosphere(3, 2, {20, 0, 0}),
                            .role = Part::Role::modifier,
                            .infill = SparseInfill{.percent = 15, .pattern = "gyroid", .share = 0.15}});
  const Json meshes = data_of(to_html(egg.report, egg.body))["view"]["meshes"];
  ASSERT_EQ(meshes.size(), 4u);
  EXPECT_EQ(meshes[2]["what"], "insert");
  EXPECT_EQ(meshes[2]["words"], "7.5 g/cm3");
  EXPECT_EQ(meshes[3]["what"], "sparse");
  EXPECT_EQ(meshes[3]["words"], "15 % infill, gyroid");
}

TEST(Html, ShowsAMeshThatCannotBeUsed) {
  Mesh torn = icosphere(20, 2);
  torn.triangles.resize(torn.triangles.size() - 60);
  const CheckedMesh checked = check_mesh(torn);
  ASSERT_FALSE(checked.report.usable);
  InputSummary input;
  input.path = "torn.obj";
  input.mm_per_unit = 25.4;
  input.check = checked.report;
  Mesh in_mm = checked.mesh;
  for (Eigen::Vector3d& v : in_mm.vertices) v *= 25.4;
  const Inspection inspection{input, 1.24, 0, nullptr};
  const std::string page = to_html(inspection, delivery(in_mm));
  const Json data = data_of(page);
  EXPECT_EQ(data["report"], Json::parse(to_json(inspection)));
  EXPECT_EQ(data["told"]["meaning"][0], checked.report.refusal);
  EXPECT_FALSE(data["view"]["meshes"][0]["closed"]);
  const Json& mark = data["view"]["marks"][0];
  EXPECT_EQ(mark["words"], "open edge");
  EXPECT_EQ(mark["count"], checked.report.open_edges.count);
  EXPECT_NEAR((vector_of(mark["at_mm"]) - 25.4 * checked.report.open_edges.first_mm).norm(), 0, 1e-12);
}

TEST(Html, ShowsAMeshThatIsEmpty) {
  const CheckedMesh checked = check_mesh(Mesh{});
  InputSummary input;
  input.check = checked.report;
  const Json data = data_of(to_html(Inspection{input, 1.24, 0, nullptr}, delivery(checked.mesh)));
  EXPECT_EQ(data["view"]["meshes"][0]["triangles"], 0);
  EXPECT_TRUE(data["view"]["attitudes"][0]["lowest_mm"].is_null());
}

TEST(PageData, IsWhatThePageHolds) {
  Egg egg;
  egg.report.input.path = "</script> <b>&.stl";
  const PageData data = page_data(egg.report, egg.body);
  const PageData read = page_data(to_html(egg.report, egg.body));
  EXPECT_EQ(Json::parse(data.json), Json::parse(read.json));
  EXPECT_EQ(data.meshes, read.meshes);
  ASSERT_EQ(data.meshes.size(), 2u);
  for (const auto& [id, packed] : data.meshes) EXPECT_EQ(packed, block(to_html(egg.report, egg.body), id));
  for (const char* other : {"", "<html></html>", "<script type=\"application/json\" id=\"rayrep-data\">{}"})
    EXPECT_THROW(page_data(std::string(other)), Error) << other;
}

TEST(PageData, OfAVerdictAloneIsThatOfItsReport) {
  const Egg egg;
  const Json whole = Json::parse(page_data(egg.report, egg.body).json);
  const Json alone = Json::parse(page_json(egg.report.after, egg.outer));
  EXPECT_EQ(alone["told"], whole["told"]["meaning"]);
  EXPECT_EQ(alone["rows"], whole["told"]["figures"]);
  EXPECT_EQ(alone["criteria"], whole["told"]["criteria"]);
  EXPECT_EQ(alone["after"], whole["report"]["after"]);
  EXPECT_EQ(alone["attitudes"], whole["view"]["attitudes"]);
  std::set<std::string> names;
  for (const Json& figure : alone["figures"]) {
    names.insert(figure[3]);
    EXPECT_EQ(figure[2], whole["report"]["after"][figure[3].get<std::string>()]) << figure;
  }
  for (const char* name : {"mass_g", "metacentric_height_mm", "centre_of_mass_mm", "centre_of_buoyancy_mm"})
    EXPECT_TRUE(names.contains(name)) << name;
}

TEST(LivePage, SaysItsPolicyBesideItself) {
  const Egg egg;
  const std::string page = to_html(egg.report, egg.body);
  const LivePage live = live_page(R"({"name": "</script><!-- &"})");
  EXPECT_NE(page.find("content=\"" + live.policy + "\""), std::string::npos);
  EXPECT_EQ(live.html.find("http-equiv"), std::string::npos);
  EXPECT_EQ(Json::parse(block(live.html, "rayrep-studio"))["name"], "</script><!-- &");
  EXPECT_EQ(count_of(live.html, "id=\"rayrep-data\""), 0u);
  const auto script = [](const std::string& html) { return html.substr(html.rfind("<script>")); };
  EXPECT_EQ(script(live.html), script(page));  // of which the policy has the hash
}

}  // namespace
}  // namespace rayrep
