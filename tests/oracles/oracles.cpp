// Programs of others on what rayrep delivers: MuJoCo reads mass, centre of mass and inertia from the STL, PrusaSlicer's SLA mode
// says how much of a material it would print. Skipped where they are missing; `tools/setup.sh test` installs both.

#include <gtest/gtest.h>
#include <unistd.h>
#include <zip.h>

#include <cstdlib>
#include <fstream>
#include <string>

#include "rayrep/io/mesh_io.h"
#include "rayrep/physics/moments.h"
#include "solids.h"

#ifdef RAYREP_HAVE_MUJOCO
#include <mujoco/mujoco.h>
#endif

namespace rayrep {
namespace {

using namespace test;
namespace fs = std::filesystem;

constexpr double kDensity = 1.24;  // g/cm3, the default

struct Delivery {
  const char* name;
  const char* arguments;
};

void PrintTo(const Delivery& d, std::ostream* out) { *out << d.arguments; }

/// What a shell command returns, 127 where there is no such command.
int run(const std::string& command) {
  const int status = std::system((command + " >/dev/null 2>&1").c_str());
  return status < 0 ? -1 : WEXITSTATUS(status);
}

class Oracle : public ::testing::TestWithParam<Delivery> {
protected:
  void SetUp() override {
    folder_ = own_file(std::string("oracle_") + GetParam().name);
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  /// The example hollowed as asked, in a file of that name.
  fs::path delivered(const char* name) const {
    const fs::path file = folder_ / name;
    const int code = run("cd '" RAYREP_SOURCE_DIR "/examples' && '" RAYREP_TOOL "' " + std::string(GetParam().arguments) +
                         " --resolution 40 --no-advice --quiet -o '" + file.string() + "'");
    EXPECT_EQ(code, 0) << GetParam().arguments;
    return file;
  }

  fs::path folder_;
};

#ifdef RAYREP_HAVE_MUJOCO
TEST_P(Oracle, MuJoCoFindsTheSameMassCentreAndInertia) {
  const fs::path stl = delivered("body.stl");
  const fs::path xml = folder_ / "body.xml";
  std::ofstream(xml) << "<mujoco><compiler exactmeshinertia='true'/><asset><mesh name='body' file='" << stl.string()
                     << "' scale='0.001 0.001 0.001'/></asset><worldbody><body><freejoint/><geom type='mesh' mesh='body' density='"
                     << 1000 * kDensity << "' contype='0' conaffinity='0'/></body></worldbody></mujoco>";
  char error[1000] = "";
  mjModel* model = mj_loadXML(xml.c_str(), nullptr, error, sizeof error);
  ASSERT_NE(model, nullptr) << error;
  // In kg and m, in the principal frame.
  const double mass_g = 1e3 * model->body_mass[1];
  const Eigen::Vector3d centre_mm = 1e3 * Eigen::Map<const Eigen::Vector3d>(model->body_ipos + 3);
  const mjtNum* q = model->body_iquat + 4;
  const Eigen::Matrix3d R = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix();
  const Eigen::Matrix3d inertia_g_mm2 =
      1e9 * R * Eigen::Map<const Eigen::Vector3d>(model->body_inertia + 3).asDiagonal() * R.transpose();
  mj_deleteModel(model);

  const Mesh mesh = read_mesh(stl).mesh;
  const MassProperties ours = mass_properties(mesh, kDensity);
  EXPECT_NEAR(mass_g, ours.mass_g, 1e-6 * ours.mass_g);
  EXPECT_TRUE(near(centre_mm, ours.centre_of_mass_mm, 1e-6 * bounding_box(mesh).diagonal().norm()));
  EXPECT_TRUE(near(inertia_g_mm2, ours.inertia_g_mm2, 1e-6 * ours.inertia_g_mm2.norm()));
}
#else
TEST_P(Oracle, MuJoCoFindsTheSameMassCentreAndInertia) { GTEST_SKIP() << "built without MuJoCo (package libmujoco-dev)"; }
#endif

/// The number after `name = ` in config.ini of an .sl1 file.
double from_config(const fs::path& file, const std::string& name) {
  zip_t* archive = zip_open(file.c_str(), ZIP_RDONLY, nullptr);
  if (!archive) return 0;
  std::string text(100000, '\0');
  if (zip_file_t* part = zip_fopen(archive, "config.ini", 0)) {
    const auto size = zip_fread(part, text.data(), text.size());
    text.resize(size > 0 ? static_cast<std::size_t>(size) : 0);
    zip_fclose(part);
  }
  zip_discard(archive);
  const std::size_t at = text.find(name + " = ");
  return at == std::string::npos ? 0 : std::strtod(text.c_str() + at + name.size() + 3, nullptr);
}

TEST_P(Oracle, PrusaSlicerPrintsTheSameVolume) {
  if (run("command -v prusa-slicer") != 0) GTEST_SKIP() << "no prusa-slicer (package prusa-slicer)";
  // A cavity that faces the wrong way is filled: the volume tells. Tilted, so that no flat floor falls between two layers.
  const char* name = std::string(GetParam().name).starts_with("float") ? "body.3mf" : "body.stl";
  const fs::path file = delivered(name);
  const fs::path sliced = folder_ / "body.sl1";
  ASSERT_EQ(run("prusa-slicer --datadir '" + folder_.string() +
                "' --export-sla --printer-technology SLA --layer-height 0.1 --initial-layer-height 0.1 --supports-enable=0 "
                "--pad-enable=0 --display-width 1000 --display-height 1000 --display-pixels-x 100 --display-pixels-y 100 "
                "--bed-shape 0x0,1000x0,1000x1000,0x1000 --max-print-height 1000 --rotate-x 17 --rotate-y 11 -o '" +
                sliced.string() + "' '" + file.string() + "'"),
            0);
  const double volume_cm3 = mesh_moments(read_mesh(file).mesh)[M1] / 1000;
  EXPECT_NEAR(from_config(sliced, "usedMaterial"), volume_cm3, 1e-4 * volume_cm3) << name;
}

class PiecesOracle : public Oracle {};

TEST_P(PiecesOracle, PrusaSlicerLaysThemOnItsBed) {
  if (run("command -v prusa-slicer") != 0) GTEST_SKIP() << "no prusa-slicer (package prusa-slicer)";
  const fs::path file = delivered("pieces.3mf");
  const fs::path placed = folder_ / "placed.stl";
  ASSERT_EQ(run("prusa-slicer --datadir '" + folder_.string() + "' --export-stl --dont-arrange -o '" + placed.string() + "' '" +
                file.string() + "'"),
            0);
  Mesh ours;
  for (const Part& piece : read_mesh(file).pieces) append(ours, transformed(piece.mesh, piece.to_bed));
  const Mesh theirs = read_mesh(placed).mesh;
  ASSERT_FALSE(ours.triangles.empty());
  const double size = bounding_box(ours).diagonal().norm();
  EXPECT_TRUE(near(bounding_box(theirs).min(), bounding_box(ours).min(), 1e-6 * size));
  EXPECT_TRUE(near(bounding_box(theirs).max(), bounding_box(ours).max(), 1e-6 * size));
  EXPECT_TRUE(moments_near(mesh_moments(theirs), mesh_moments(ours), 1e-5, size));
  EXPECT_EQ(bounding_box(ours).min().z(), 0);
}

INSTANTIATE_TEST_SUITE_P(Examples, PiecesOracle,
                         ::testing::Values(Delivery{"pieces_duck", "float --cut auto duck.stl"},
                                           Delivery{"pieces_heart", "spin --yoyo --up y heart.stl"}),
                         [](const auto& one) { return std::string(one.param.name); });

// Every example, for whatever can be had of it.
INSTANTIATE_TEST_SUITE_P(
    Examples, Oracle,
    ::testing::Values(Delivery{"float_duck", "float duck.stl"}, Delivery{"float_bird", "float bird.stl"},
                      Delivery{"float_three_spheres", "float three_spheres.stl"},
                      Delivery{"float_tilted_ellipsoid", "float tilted_ellipsoid.stl"},
                      Delivery{"float_ellipsoid", "float ellipsoid.stl"}, Delivery{"float_heart", "float heart.stl"},
                      Delivery{"float_teapot", "float teapot.stl"}, Delivery{"float_robin", "float robin.stl"},
                      Delivery{"spin_bird", "spin bird.stl"}, Delivery{"spin_tilted_ellipsoid", "spin tilted_ellipsoid.stl"},
                      Delivery{"spin_ellipsoid", "spin ellipsoid.stl"}, Delivery{"spin_heart", "spin heart.stl"},
                      Delivery{"spin_robin", "spin robin.stl"}, Delivery{"yoyo_teapot", "spin --yoyo --axle none teapot.stl"},
                      Delivery{"stand_duck", "stand duck.stl"}, Delivery{"stand_heart", "stand heart.stl"},
                      Delivery{"stand_teapot", "stand teapot.stl"}, Delivery{"target_robin", "target --mass 30 robin.stl"}),
    [](const auto& one) { return std::string(one.param.name); });

}  // namespace
}  // namespace rayrep
