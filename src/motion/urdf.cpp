#include "rayrep/motion/urdf.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "base/text.h"
#include "mesh/reach.h"
#include "mesh/revolved.h"
#include "motion/urdf_file.h"
#include "rayrep/base/error.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/mesh/mesh_check.h"

namespace rayrep {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using Kind = RobotJoint::Kind;

constexpr double kMetre = 1000;
constexpr double kPi = std::numbers::pi;
constexpr std::size_t kNone = static_cast<std::size_t>(-1);

// ------------------------------------------------------------------------------------------------------------------------ shapes

constexpr double kRound_mm = 0.02;  // that flat sides stay below round ones, at most, unless that takes more sides than these
constexpr int kLeastSides = 24, kMostSides = 192;

/// Of a polygon with its corners on a circle.
int sides_of(double radius_mm) {
  const double angle = std::acos(std::max(1 - kRound_mm / radius_mm, -1.0));
  return std::clamp(2 * static_cast<int>(std::ceil(kPi / angle / 2)), kLeastSides, kMostSides);
}

double below_round(double radius_mm) { return radius_mm * (1 - std::cos(kPi / sides_of(radius_mm))); }

Mesh box_mesh(const Vector3d& size) {
  Mesh mesh;
  for (int n = 0; n < 8; ++n)
    mesh.vertices.push_back(size.cwiseProduct(Vector3d(n & 1 ? 0.5 : -0.5, n & 2 ? 0.5 : -0.5, n & 4 ? 0.5 : -0.5)));
  for (const auto& [a, b, c, d] : {std::array{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}) {
    mesh.triangles.emplace_back(a, b, c);
    mesh.triangles.emplace_back(a, c, d);
  }
  return mesh;
}

/// About z.
Mesh cylinder_mesh(double radius, double length) {
  return detail::revolved({{0, -length / 2}, {radius, -length / 2}, {radius, length / 2}, {0, length / 2}}, sides_of(radius));
}

Mesh sphere_mesh(double radius) {
  const int sides = sides_of(radius), rings = sides / 2;
  const auto height_of = [&](int ring) { return -radius * std::cos(kPi * (ring + 0.5) / rings); };
  std::vector<Eigen::Vector2d> profile = {{0, height_of(0)}};
  for (int r = 0; r < rings; ++r) profile.emplace_back(radius * std::sin(kPi * (r + 0.5) / rings), height_of(r));
  profile.emplace_back(0, height_of(rings - 1));
  return detail::revolved(profile, sides);
}

Mesh scaled(Mesh mesh, const Vector3d& scale) {
  for (Vector3d& v : mesh.vertices) v = v.cwiseProduct(scale);
  if (scale.prod() < 0) flip(mesh);
  return mesh;
}

/// Makes meshes of shapes, each file read once.
class Shapes {
public:
  explicit Shapes(const Progress& progress) : progress_(progress) {}

  /// In the link's frame. What is wrong goes to `problems`.
  Mesh mesh_of(const RobotShape& shape, const std::string& link, std::vector<std::string>& problems) {
    progress_.check();
    Mesh mesh;
    try {
      mesh = in_its_frame(shape);
    } catch (const Error& error) {
      if (error.code() == ErrorCode::interrupted) throw;
      problems.push_back("link '" + link + "', " + (shape.name.empty() ? "its shape" : "mesh '" + shape.name + "'") + ": " +
                         error.what());
      return {};
    }
    triangles_ += mesh.triangles.size();
    if (triangles_ > kMostTriangles) throw Error(ErrorCode::input, "The robot's shapes have more than 20 million triangles.");
    return transformed(mesh, Eigen::Affine3d(shape.origin));
  }

  double below_round_mm() const { return below_round_mm_; }  ///< of all so far, at most

private:
  static constexpr std::size_t kMostTriangles = 20'000'000;

  Mesh in_its_frame(const RobotShape& shape) {
    switch (shape.kind) {
      case RobotShape::Kind::box:
        return box_mesh(shape.size);
      case RobotShape::Kind::cylinder:
        below_round_mm_ = std::max(below_round_mm_, below_round(shape.radius_mm));
        return cylinder_mesh(shape.radius_mm, shape.length_mm);
      case RobotShape::Kind::sphere:
        // Flat across both ways.
        below_round_mm_ = std::max(below_round_mm_, 2 * below_round(shape.radius_mm));
        return sphere_mesh(shape.radius_mm);
      case RobotShape::Kind::mesh:
        break;
    }
    return scaled(solid_in(shape), shape.size);
  }

  const Mesh& solid_in(const RobotShape& shape) {
    const auto found = files_.find(shape.file);
    if (found != files_.end()) return found->second;
    std::error_code error;
    if (!std::filesystem::exists(shape.file, error))
      throw Error(ErrorCode::input, "'" + shape.file.string() + "' does not exist. Names are looked for beside the robot's file, " +
                                        "those of a package from there upwards.");
    if (const std::string ending = shape.file.extension().string(); ending == ".dae" || ending == ".DAE")
      throw Error(ErrorCode::input, "rayrep does not read COLLADA: convert it to STL or OBJ, in m, and name that.");
    CheckedMesh checked = check_mesh(read_mesh(shape.file, {.unit = LengthUnit::metre}).mesh,
                                     {.self_intersections = false, .unite = false}, progress_);
    if (!checked.report.usable) throw Error(ErrorCode::input, "it is no solid. " + checked.report.refusal);
    return files_.emplace(shape.file, std::move(checked.mesh)).first->second;
  }

  const Progress& progress_;
  std::map<std::filesystem::path, Mesh> files_;
  std::size_t triangles_ = 0;
  double below_round_mm_ = 0;
};

// ---------------------------------------------------------------------------------------------------------------------- kinematics

/// What a joint does to all that it carries, in the robot at rest: theory.md (124).
struct Screw {
  bool turns = true;
  Vector3d axis = Vector3d::UnitZ();  ///< of length 1
  Vector3d on_axis_mm = Vector3d::Zero();
  double by = 0;  ///< during a transition, rad or mm

  Isometry3d at(double time) const {
    if (!turns) return Isometry3d(Eigen::Translation3d(time * by * axis));
    return Eigen::Translation3d(on_axis_mm) * Eigen::AngleAxisd(time * by, axis) * Eigen::Translation3d(-on_axis_mm);
  }
};
using Screws = std::vector<Screw>;  ///< from the root on

Isometry3d displacement(const Screws& screws, double time) {
  Isometry3d all = Isometry3d::Identity();
  for (const Screw& screw : screws) all = all * screw.at(time);
  return all;
}

/// How many keys keep a body within a deviation, theory.md (125).
class KeyCount {
public:
  /// @param reach_mm  of the body's points from the pivot
  KeyCount(const Screws& screws, const Vector3d& pivot_mm, double reach_mm) : screws_(screws) {
    bound_fourth_derivative(pivot_mm);
    bound_turning();
    int most = 1;
    if (fourth_mm_ > 0) most = pieces(std::pow(fourth_mm_ / (384 * kUrdfDeviation_mm / 2), 0.25));
    moved_ = most;
    // Pieces in which it turns by a radian at most, so that (125) holds, where it does not turn about one axis.
    const double swerve = 1.1 / 8 * swerve_ * reach_mm;
    turned_ = swerve_ > 0 ? pieces(std::max(std::sqrt(swerve / (kUrdfDeviation_mm / 2)), turn_)) : pieces(turn_ / (2 * kPi / 3));
    deviation_mm_ = fourth_mm_ / 384 / std::pow(moved_, 4) + swerve / (turned_ * turned_);
  }

  int moved() const { return moved_; }
  int turned() const { return turned_; }
  double deviation_mm() const { return deviation_mm_; }

private:
  static int pieces(double wanted) {
    constexpr double kMost = 256;
    return static_cast<int>(std::clamp(std::ceil(wanted * (1 - 1e-12)), 1.0, kMost));
  }

  /// Of the pivot's way: each arm from axis to axis, and each push, is turned by all screws before it.
  void bound_fourth_derivative(const Vector3d& pivot_mm) {
    std::vector<double> arms(screws_.size(), 0);
    Vector3d at = pivot_mm;
    for (std::size_t n = screws_.size(); n-- > 0;) {
      const Screw& screw = screws_[n];
      if (!screw.turns) continue;
      const Vector3d foot = screw.on_axis_mm + screw.axis * screw.axis.dot(at - screw.on_axis_mm);
      arms[n] = (at - foot).norm();
      at = foot;
    }
    double turned = 0;
    for (std::size_t n = 0; n < screws_.size(); ++n) {
      const double by = std::abs(screws_[n].by);
      if (!screws_[n].turns) fourth_mm_ += std::pow(turned, 3) * by * (turned + 4);
      if (screws_[n].turns) turned += by;
      // What rounding makes of a pivot on its axis is no arm.
      if (arms[n] > 1e-9 * (1 + pivot_mm.norm())) fourth_mm_ += std::pow(turned, 4) * arms[n];
    }
  }

  void bound_turning() {
    for (std::size_t i = 0; i < screws_.size(); ++i) {
      if (!screws_[i].turns) continue;
      turn_ += std::abs(screws_[i].by);
      double apart = 0;  // sine of the angle between the axes of j and i, at most
      std::size_t last = i;
      for (std::size_t j = i; j-- > 0;) {
        if (!screws_[j].turns) continue;
        const double sine = screws_[j].axis.cross(screws_[last].axis).norm();
        apart = std::min(1.0, apart + (sine > 1e-12 ? sine : 0));
        last = j;
        swerve_ += std::abs(screws_[i].by * screws_[j].by) * apart;
      }
    }
  }

  const Screws& screws_;
  double fourth_mm_ = 0;  ///< of the pivot's place by time
  double turn_ = 0;       ///< rad, all in all
  double swerve_ = 0;     ///< of the angular velocity by time
  int moved_ = 1, turned_ = 1;
  double deviation_mm_ = 0;
};

/// By which the pivot is moved; what rounding makes of 0 is 0.
Vector3d moved_pivot(const Isometry3d& displaced, const Vector3d& pivot_mm) {
  const double rounding = 1e-13 * (1 + pivot_mm.norm());
  return (displaced * pivot_mm - pivot_mm).unaryExpr([rounding](double x) { return std::abs(x) < rounding ? 0 : x; });
}

/// Velocity of the pivot, mm in the whole transition.
Vector3d velocity(const Screws& screws, double time, const Vector3d& pivot_mm) {
  Vector3d at = pivot_mm, v = Vector3d::Zero();
  for (std::size_t n = screws.size(); n-- > 0;) {
    const Screw& screw = screws[n];
    const Isometry3d X = screw.at(time);
    at = X * at;
    v = X.linear() * v + screw.by * (screw.turns ? screw.axis.cross(at - screw.on_axis_mm) : screw.axis);
  }
  return v;
}

/// The displacements as keys: handles along the velocity, so that the way between two keys is Hermite's.
Motion motion_of(const Screws& screws, const Vector3d& pivot_mm, const KeyCount& keys) {
  Motion motion;
  for (int n = 0; n <= keys.moved(); ++n) {
    const double time = static_cast<double>(n) / keys.moved();
    const Vector3d at = moved_pivot(displacement(screws, time), pivot_mm);
    const Vector3d third = velocity(screws, time, pivot_mm) / (3 * keys.moved());
    motion.translation.push_back({time, at, n > 0 ? Vector3d(at - third) : at, n < keys.moved() ? Vector3d(at + third) : at});
  }
  for (int n = 0; n <= keys.turned(); ++n) {
    const double time = static_cast<double>(n) / keys.turned();
    motion.rotation.push_back({time, Eigen::Quaterniond(displacement(screws, time).linear()).normalized()});
  }
  return motion;
}

// ----------------------------------------------------------------------------------------------------------------------- the scene

/// How a joint follows from one that is free: value = factor * value of that + offset.
struct Following {
  std::size_t joint = 0;
  double factor = 1, offset = 0;
};

class Importer {
public:
  Importer(Robot robot, const UrdfOptions& options, const std::filesystem::path& path, const Progress& progress)
      : robot_(std::move(robot)), options_(options), path_(path), shapes_(progress), progress_(progress) {}

  SceneFile import() {
    find_rest();
    make_parts();
    PartPose none;
    scene().states.push_back({"rest", Vector3d::UnitZ(), std::vector<PartPose>(scene().parts.size(), none)});
    for (std::size_t j = 0; j < robot_.joints.size(); ++j)
      if (moves(j) && !robot_.joints[j].mimic) add_ways(j);
    tell_what_deviates();
    return std::move(file_);
  }

private:
  static constexpr std::size_t kMostJoints = 128;

  Scene& scene() { return file_.scene; }
  void note(const std::string& text) { file_.notes.push_back(text); }

  /// A joint that is not always where it is at rest.
  bool moves(std::size_t j) const {
    const RobotJoint& joint = robot_.joints[j];
    return joint.kind != Kind::fixed && joint.kind != Kind::unsupported && (joint.mimic || joint.lower < joint.upper);
  }

  Following followed(std::size_t j) const {
    Following following{j};
    while (robot_.joints[following.joint].mimic) {
      const RobotJoint::Mimic& mimic = *robot_.joints[following.joint].mimic;
      following.offset += following.factor * mimic.offset;
      following.factor *= mimic.multiplier;
      following.joint = mimic.joint;
    }
    return following;
  }

  double free_rest(std::size_t j) const {
    const RobotJoint& joint = robot_.joints[j];
    return joint.kind == Kind::unsupported || joint.kind == Kind::fixed ? 0 : std::clamp(0.0, joint.lower, joint.upper);
  }

  Isometry3d moved_by(const RobotJoint& joint, double value) const {
    if (joint.kind == Kind::prismatic) return Isometry3d(Eigen::Translation3d(kMetre * value * joint.axis));
    if (joint.kind == Kind::revolute || joint.kind == Kind::continuous) return Isometry3d(Eigen::AngleAxisd(value, joint.axis));
    return Isometry3d::Identity();
  }

  /// Where all links are at rest, and which hang together.
  void find_rest() {
    std::size_t movable = 0;
    links_.assign(robot_.links.size(), Isometry3d::Identity());
    carried_by_.assign(robot_.links.size(), kNone);
    group_.resize(robot_.links.size());
    for (std::size_t l = 0; l < group_.size(); ++l) group_[l] = l;
    for (std::size_t j = 0; j < robot_.joints.size(); ++j) {
      const RobotJoint& joint = robot_.joints[j];
      const Following following = followed(j);
      rest_.push_back(following.factor * free_rest(following.joint) + following.offset);
      links_[joint.child] = links_[joint.parent] * joint.origin * moved_by(joint, rest_[j]);
      carried_by_[joint.child] = j;
      if (joint.kind == Kind::fixed) group_[joint.child] = group_[joint.parent];
      movable += moves(j);
      tell_oddities(j, following);
    }
    if (movable > kMostJoints)
      throw Error(ErrorCode::input, concat(path_.string(), ": ", movable, " joints move; rayrep takes at most ", kMostJoints,
                                           ". Make those fixed that need not be looked at."));
  }

  void tell_oddities(std::size_t j, const Following& following) {
    const RobotJoint& joint = robot_.joints[j];
    if (joint.kind == Kind::unsupported)
      note("joint '" + joint.name + "' is " + joint.type + ", which is not supported: it is held where it is at 0");
    else if (joint.kind != Kind::fixed && !moves(j))
      note("joint '" + joint.name + "' does not move: both of its limits are " + shown(joint.lower));
    else if (joint.mimic && !moves(following.joint))
      note("joint '" + joint.name + "' does not move: it mimics '" + robot_.joints[following.joint].name + "', which does not");
    else if (moves(j) && !joint.mimic && rest_[j] != 0)
      note("joint '" + joint.name + "' rests at " + shown(rest_[j]) + ": 0 is beyond its limits");
  }

  const std::vector<RobotShape>& shapes_of(const RobotLink& link) const {
    const bool visual = options_.visual ? !link.visual.empty() : link.collision.empty();
    return visual ? link.visual : link.collision;
  }

  /// One of each group of links that has a shape.
  void make_parts() {
    part_of_.assign(robot_.links.size(), kNone);
    std::vector<std::string> problems;
    std::vector<Mesh> meshes;
    for (std::size_t l : in_order()) {
      const RobotLink& link = robot_.links[l];
      for (const RobotShape& shape : shapes_of(link)) {
        const Mesh mesh = transformed(shapes_.mesh_of(shape, link.name, problems), Eigen::Affine3d(links_[l]));
        std::size_t& part = part_of_[group_[l]];
        if (part == kNone) {
          part = add_part(l);
          meshes.emplace_back();
        }
        append(meshes[part], mesh);
      }
    }
    if (!problems.empty()) {
      std::string text = path_.string() + ": " + plural(problems.size(), "mesh", "meshes") + " cannot be used.";
      for (const std::string& problem : problems) text += "\n  " + problem;
      throw Error(ErrorCode::input, text);
    }
    if (meshes.empty())
      throw Error(ErrorCode::input, path_.string() + ": no link has a shape: give links a <collision> or a <visual>.");
    for (std::size_t p = 0; p < meshes.size(); ++p) {
      require_size(meshes[p], "link '" + scene().parts[p].name + "'");
      scene().parts[p].mesh = std::make_shared<const Mesh>(std::move(meshes[p]));
    }
    tell_merged();
    connect_parts();
  }

  /// Links, each after the one that carries it.
  std::vector<std::size_t> in_order() const {
    std::vector<std::size_t> order;
    for (std::size_t l = 0; l < robot_.links.size(); ++l)
      if (carried_by_[l] == kNone) order.push_back(l);
    for (const RobotJoint& joint : robot_.joints) order.push_back(joint.child);
    return order;
  }

  /// @param link  the first of its group with a shape
  std::size_t add_part(std::size_t link) {
    ScenePart part;
    part.name = robot_.links[link].name;
    const std::size_t top = group_[link];
    if (carried_by_[top] != kNone) part.pivot_mm = links_[top].translation();
    scene().parts.push_back(std::move(part));
    tops_.push_back(top);
    return scene().parts.size() - 1;
  }

  void tell_merged() {
    for (std::size_t p = 0; p < tops_.size(); ++p) {
      std::string names;
      for (std::size_t l = 0; l < group_.size(); ++l)
        if (group_[l] == tops_[p] && robot_.links[l].name != scene().parts[p].name && !shapes_of(robot_.links[l]).empty())
          names += (names.empty() ? "'" : ", '") + robot_.links[l].name + "'";
      if (!names.empty()) note("part '" + scene().parts[p].name + "' is also what is fixed to it: " + names);
    }
  }

  /// Each with the nearest that carries it.
  void connect_parts() {
    for (std::size_t p = 0; p < tops_.size(); ++p)
      for (std::size_t at = tops_[p]; carried_by_[at] != kNone;) {
        at = group_[robot_.joints[carried_by_[at]].parent];
        if (part_of_[at] == kNone) continue;
        scene().pairs.push_back({part_of_[at], p, {}});
        break;
      }
  }

  /// What moves a part while joint j goes from its rest to another value, and those with it that mimic it.
  Screws screws_of(std::size_t part, std::size_t j, double value) const {
    Screws screws;
    for (std::size_t at = tops_[part]; carried_by_[at] != kNone;) {
      const std::size_t k = carried_by_[at];
      const RobotJoint& joint = robot_.joints[k];
      if (const Following following = followed(k); moves(k) && following.joint == j) {
        const Isometry3d& frame = links_[joint.child];
        const bool turns = joint.kind != Kind::prismatic;
        const double by = following.factor * (value - rest_[j]) * (turns ? 1 : kMetre);
        if (by != 0) screws.push_back({turns, (frame.linear() * joint.axis).normalized(), frame.translation(), by});
      }
      at = group_[joint.parent];
    }
    std::reverse(screws.begin(), screws.end());
    return screws;
  }

  void add_ways(std::size_t j) {
    const RobotJoint& joint = robot_.joints[j];
    if (joint.kind == Kind::continuous) return add_way(j, 2 * kPi, joint.name + " round");
    if (joint.lower < rest_[j]) add_way(j, joint.lower, joint.name + " lower");
    if (joint.upper > rest_[j]) add_way(j, joint.upper, joint.name + " upper");
    tell_beyond(j);
  }

  /// Those that mimic joint j beyond their own limits.
  void tell_beyond(std::size_t j) {
    for (std::size_t k = 0; k < robot_.joints.size(); ++k) {
      const RobotJoint& joint = robot_.joints[k];
      const Following following = followed(k);
      if (k == j || following.joint != j) continue;
      const double a = following.factor * robot_.joints[j].lower + following.offset;
      const double b = following.factor * robot_.joints[j].upper + following.offset;
      const double slack = 1e-9 * (1 + std::abs(a) + std::abs(b));
      if (std::min(a, b) < joint.lower - slack || std::max(a, b) > joint.upper + slack)
        note("joint '" + joint.name + "' follows '" + robot_.joints[j].name + "' beyond its own limits, to " +
             shown(std::min(a, b) < joint.lower - slack ? std::min(a, b) : std::max(a, b)));
    }
  }

  void add_way(std::size_t j, double value, const std::string& name) {
    progress_.check();
    SceneState state{name, Vector3d::UnitZ(), {}};
    Transition way{"rest to " + name, 0, 0, {}};
    bool at_rest = true;
    for (std::size_t p = 0; p < scene().parts.size(); ++p) {
      const ScenePart& part = scene().parts[p];
      const Screws screws = screws_of(p, j, value);
      const KeyCount keys(screws, part.pivot_mm, reach_mm(*part.mesh, part.pivot_mm));
      deviation_mm_ = std::max(deviation_mm_, keys.deviation_mm());
      way.motions.push_back(motion_of(screws, part.pivot_mm, keys));
      state.poses.push_back(way.motions.back().at(1));
      const PartPose& end = state.poses.back();
      at_rest = at_rest && end.translation_mm.norm() <= 1e-9 * (1 + part.pivot_mm.norm()) &&
                end.rotation.angularDistance(Eigen::Quaterniond::Identity()) <= 1e-7;
    }
    if (at_rest) {
      way.name = name;
    } else {
      way.to = scene().states.size();
      scene().states.push_back(std::move(state));
    }
    scene().transitions.push_back(std::move(way));
  }

  void tell_what_deviates() {
    if (shapes_.below_round_mm() > 0)
      note("cylinders and spheres have flat sides, up to " + shown(shapes_.below_round_mm(), 2) + " mm below round");
    if (deviation_mm_ > 0) note("between keys a part is where its joints have it to " + shown(1.05 * deviation_mm_, 2) + " mm");
  }

  Robot robot_;
  const UrdfOptions& options_;
  const std::filesystem::path& path_;
  Shapes shapes_;
  const Progress& progress_;
  SceneFile file_;
  std::vector<double> rest_;             ///< of each joint, rad or m
  std::vector<Isometry3d> links_;        ///< at rest
  std::vector<std::size_t> carried_by_;  ///< the joint of each link
  std::vector<std::size_t> group_;       ///< the topmost of the links that fixed joints hold a link to
  std::vector<std::size_t> part_of_;     ///< by the topmost link of its group
  std::vector<std::size_t> tops_;        ///< of each part, the topmost link of its group
  double deviation_mm_ = 0;
};

}  // namespace

SceneFile import_urdf(const std::filesystem::path& path, const UrdfOptions& options, const Progress& progress) {
  return Importer(read_urdf(path), options, path, progress).import();
}

}  // namespace rayrep
