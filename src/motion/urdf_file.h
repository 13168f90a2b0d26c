#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace rayrep {

/// A shape in the frame of its link.
struct RobotShape {
  enum class Kind { mesh, box, cylinder, sphere } kind = Kind::mesh;
  Eigen::Isometry3d origin = Eigen::Isometry3d::Identity();  ///< translation in mm
  Eigen::Vector3d size = Eigen::Vector3d::Ones();            ///< of a mesh its scale; of a box its sides, mm
  double radius_mm = 0, length_mm = 0;
  std::string name;            ///< of a mesh, as it is written
  std::filesystem::path file;  ///< where that was found, or looked for
};

struct RobotLink {
  std::string name;
  std::vector<RobotShape> visual, collision;
};

struct RobotJoint {
  enum class Kind { fixed, revolute, continuous, prismatic, unsupported } kind = Kind::fixed;
  std::string name, type;
  std::size_t parent = 0, child = 0;                         ///< links
  Eigen::Isometry3d origin = Eigen::Isometry3d::Identity();  ///< of the child in the parent, all at 0; translation in mm
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();           ///< in the child, of length 1
  double lower = -std::numeric_limits<double>::infinity();   ///< rad or m
  double upper = std::numeric_limits<double>::infinity();
  struct Mimic {
    std::size_t joint;
    double multiplier = 1, offset = 0;
  };
  std::optional<Mimic> mimic;
};

/// A tree of links.
struct Robot {
  std::string name;
  std::vector<RobotLink> links;
  std::vector<RobotJoint> joints;  ///< each after the one that carries its parent
};

/// @throws Error{input} with all that is wrong with the file
Robot read_urdf(const std::filesystem::path& path);

}  // namespace rayrep
