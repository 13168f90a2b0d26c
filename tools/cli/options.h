#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "rayrep/io/mesh_io.h"
#include "rayrep/make/hollow.h"

namespace rayrep::tool {

enum class Command { float_upright, spin, stand, target, verify, inspect, help, version };

/// The command line, parsed and checked as far as that is possible without the mesh.
struct Options {
  Command command = Command::help;
  Command goal = Command::help;  ///< verify: float_upright, spin (also a yo-yo), stand or target; else the command itself
  std::string help_text;         ///< for Command::help

  std::filesystem::path input;
  LengthUnit unit = LengthUnit::millimetre;
  std::optional<double> size_mm;  ///< longest side
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  double density_g_cm3 = 1.24;
  double wall_mm = 1.2;
  int resolution = 200;
  Solver solver = Solver::quadric;  ///< float, spin, stand

  double fluid_g_cm3 = 1.0;  ///< float
  std::optional<double> waterline_mm;
  std::optional<double> submerged_fraction;

  bool suggest = false;     ///< print command lines that would succeed when this one cannot
  double max_tilt_rad = 0;  ///< spin; 0: the axis is not searched
  bool certify = false;
  SpinAxis axis;  ///< spin; point_mm is in the file's numbers after --unit and --size
  bool yoyo = false;
  std::optional<Eigen::Vector3d> centre_mm;
  bool largest = true;
  SpinGoal::Weights weights;
  SegmentBounds bounds = SegmentBounds::complete;

  std::optional<Eigen::Vector3d> target_mm;  ///< stand
  bool tip_angle = false;
  std::optional<double> contact_mm;

  InertialTargets wanted;  ///< target
  std::vector<TargetGoal::Wish> order;
  std::filesystem::path urdf;  ///< target, inspect; empty: none
  std::filesystem::path mjcf;

  std::filesystem::path output;    ///< empty: the default name
  std::filesystem::path original;  ///< verify: the surface that must be unchanged; may be empty
  std::filesystem::path report;    ///< empty: none
  bool json = false;
  bool quiet = false;
  bool verbose = false;
  int threads = 0;  ///< 0: all cores

  std::vector<std::pair<std::string, std::string>> in_force;  ///< every option of the command with its value, for the report
};

/// @throws Error{usage} that says what is wrong and how to get help
Options parse_command_line(int argc, const char* const* argv);

/// "x", "-z", "0,1,0.5" ... @throws Error{usage}
Eigen::Vector3d parse_direction(const std::string& text);

/// The command line with the options of a remedy (Error::remedies) in place of its own, for a shell.
std::string remedied(int argc, const char* const* argv, const std::string& remedy);

/// As one word for a shell.
std::string quoted(const std::string& word);

}  // namespace rayrep::tool
