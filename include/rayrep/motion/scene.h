#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "rayrep/base/progress.h"
#include "rayrep/mesh/mesh.h"
#include "rayrep/physics/mechanism.h"
#include "rayrep/physics/spec.h"

// Things whose parts move: parts, the states that they can be left in, and the ways between those (docs/scene.md).

namespace rayrep {

/// Where a part is: it is turned about its pivot, then moved: p -> R (p - pivot) + pivot + x, theory.md (108).
struct PartPose {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation_mm = Eigen::Vector3d::Zero();

  Eigen::Isometry3d about(const Eigen::Vector3d& pivot_mm) const;
};

/// One rigid body.
struct ScenePart {
  std::string name;
  std::filesystem::path file;  ///< of the mesh; empty where there is none
  /// In mm, closed. Two scenes share it where it is the same: what is known of it is then not found out again.
  std::shared_ptr<const Mesh> mesh;
  Eigen::Vector3d pivot_mm =
      Eigen::Vector3d::Zero();  ///< about which it is turned, in its mesh's coordinates: a point of its hinge
  bool printed = true;          ///< its inside may be chosen
  Print print;                  ///< density and wall
};

/// A place on the way with its two handles: between two of them the way is the cubic Bezier curve of at, out, in of the next, at of
/// the next.
struct TranslationKey {
  double time = 0;  ///< 0 to 1
  Eigen::Vector3d at_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d in_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d out_mm = Eigen::Vector3d::Zero();
};

/// An attitude on the way; between two of them it turns evenly about one axis, the shorter way (slerp).
struct RotationKey {
  double time = 0;  ///< 0 to 1
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
};

/// How a part moves during a transition: each list begins at 0 and ends at 1, its times ascend.
struct Motion {
  std::vector<TranslationKey> translation;
  std::vector<RotationKey> rotation;

  PartPose at(double time) const;
};

/// From one pose to another, straight and evenly.
Motion straight_motion(const PartPose& from, const PartPose& to);

/// Puts the handles of the translation's keys on the straight lines between them, a third of the way: each part of the way is then
/// gone evenly.
void straighten(Motion& motion);

struct SceneState {
  std::string name;
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< of the scene, in this state
  std::vector<PartPose> poses;                    ///< of each part
  std::optional<Pose> rests = {};                 ///< how all of it together rests then; none: it need not
  std::vector<HingeBalance> hinges = {};          ///< what shall stay where it is left
};

struct Transition {
  std::string name;
  std::size_t from = 0, to = 0;  ///< states
  std::vector<Motion> motions;   ///< of each part
};

/// Two parts that are near to each other on purpose, as at a hinge.
struct ScenePair {
  std::size_t first = 0, second = 0;   ///< parts
  std::optional<double> clearance_mm;  ///< how near they may come; none: they may touch, and are not tested
};

struct Scene {
  std::vector<ScenePart> parts;
  std::vector<SceneState> states;
  std::vector<Transition> transitions;
  std::vector<ScenePair> pairs;
  double fluid_g_cm3 = 1.0;                 ///< of states that float
  std::optional<double> least_tip_deg;      ///< of states that stand, as in Mechanism
  double clearance_mm = 0;                  ///< how near all other parts may come to each other
  std::optional<Eigen::AlignedBox3d> room;  ///< all parts stay in it

  /// Of that name. @throws Error{input} that lists those there are
  std::size_t part(const std::string& name) const;
};

/// The thing that shall rest in its states: those of the scene that say how. @throws Error{usage} where none does
Mechanism mechanism_of(const Scene& scene);

/// Something that is wrong with a scene.
struct SceneProblem {
  enum class Kind {
    form,       ///< of the file: a name that is missing or not known, a value that makes no sense
    not_solid,  ///< a mesh that cannot be read or is not closed
    no_part,    ///< a state, motion or pair names a part that there is not, or a transition such a state
    leaves,     ///< a motion that does not begin or end in its states, or has times beyond 0 to 1, or a part that leaves the room
    overlap     ///< two bodies in one place, in a state
  } kind = Kind::form;
  std::string part = {}, other = {};  ///< empty: it is not about one
  std::string where = {};             ///< in the file: "states, open, lid"
  std::optional<Eigen::Vector3d> place_mm = {};
  std::string message = {};  ///< a sentence for people, with all of these
};

/// A scene as it stands in its file. With problems parts of it may be missing.
struct SceneFile {
  Scene scene;
  std::vector<SceneProblem> problems;
  std::vector<std::string> notes;  ///< what was mended of the meshes
};

/// Reads a scene (docs/scene.schema.json) and the meshes it names, which lie beside it.
/// @throws Error{input} for a file that cannot be read or is no JSON; Error{interrupted}
SceneFile read_scene(const std::filesystem::path& path, const Progress& progress = {});

/// The scene as a file at `path`: meshes are named, not written, relative to its folder.
std::string scene_text(const Scene& scene, const std::filesystem::path& path);

/// What is wrong with the bodies in their places: parts that overlap in a state (by more than they touch, see check_motion), that
/// are outside of the room there or leave it on the way. Pairs that may touch are not looked at.
/// @throws Error{interrupted}
std::vector<SceneProblem> misplaced(const Scene& scene, const Progress& progress = {});

/// @throws Error{input} with all problems, if there are any
void require_scene(const SceneFile& file, const std::string& name);

}  // namespace rayrep
