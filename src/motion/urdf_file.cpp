#include "motion/urdf_file.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>
#include <iterator>
#include <map>
#include <pugixml.hpp>
#include <string_view>

#include "base/text.h"
#include "rayrep/base/error.h"
#include "rayrep/base/setting.h"
#include "rayrep/mesh/mesh_check.h"

namespace rayrep {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using Kind = RobotJoint::Kind;
namespace fs = std::filesystem;

constexpr double kMetre = 1000;

// Far beyond any robot; they bound what a hostile file makes of memory and time.
constexpr std::size_t kMostBytes = 16 << 20;
constexpr std::size_t kMostOfAKind = 2000;  // links, joints
constexpr std::size_t kMostShapes = 20'000;
constexpr std::size_t kLongestName = 200;
constexpr std::size_t kMostTold = 20;

std::string text_in(const fs::path& path) {
  std::error_code ignored;
  std::ifstream in(path, std::ios::binary);
  if (!in.is_open() || fs::is_directory(path, ignored)) throw Error(ErrorCode::input, "Cannot read '" + path.string() + "'.");
  std::string text(kMostBytes + 1, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (in.bad()) throw Error(ErrorCode::input, "Cannot read '" + path.string() + "'.");
  text.resize(static_cast<std::size_t>(in.gcount()));
  if (text.size() > kMostBytes)
    throw Error(ErrorCode::input, "'" + path.string() + "' is larger than the 16 MB that a robot's description may have.");
  return text;
}

/// What a file is that is no URDF, and what to do.
std::string other_kind(const std::string& root) {
  if (root == "sdf") return "it is SDF, not URDF: export the model as URDF";
  if (root == "mujoco") return "it is MJCF, not URDF: export the model as URDF";
  if (root == "COLLADA") return "it is a COLLADA mesh, not a robot";
  return "it begins with <" + root + ">, and URDF with <robot>";
}

std::vector<std::string> words_in(const std::string& text) {
  std::vector<std::string> words;
  const char* const space = " \t\r\n";
  for (std::size_t at = text.find_first_not_of(space); at != text.npos; at = text.find_first_not_of(space, at)) {
    const std::size_t end = std::min(text.find_first_of(space, at), text.size());
    words.push_back(text.substr(at, end - at));
    at = end;
  }
  return words;
}

/// Where a mesh is, next to the file that names it: "package://NAME/PATH" is looked for from its folder upwards, as NAME/PATH and
/// as PATH, "file://PATH" as PATH, all else from its folder. @returns where it would be, if it is nowhere
fs::path mesh_path(const std::string& name, const fs::path& folder) {
  constexpr std::string_view kFile = "file://";
  if (name.starts_with(kFile)) return fs::path(name.substr(kFile.size()));
  std::size_t begin = std::string::npos;
  for (const std::string_view scheme : {"package://", "model://"})
    if (name.starts_with(scheme)) begin = scheme.size();
  if (begin == std::string::npos) return folder / name;
  const std::string with_package = name.substr(begin);
  const std::string within = with_package.substr(std::min(with_package.find('/') + 1, with_package.size()));
  std::error_code error;
  const fs::path from = fs::absolute(folder, error).lexically_normal();
  for (fs::path at = from.has_filename() ? from : from.parent_path();; at = at.parent_path()) {
    for (const fs::path& candidate : {at / with_package, at / within})
      if (fs::is_regular_file(candidate, error)) return candidate;
    if (!at.has_relative_path()) return folder / with_package;
  }
}

class UrdfReader {
public:
  explicit UrdfReader(const fs::path& path) : path_(path), text_(text_in(path)) {}

  Robot read() {
    const bool has_tags = text_.find('<') < text_.find_first_of("{[");
    pugi::xml_document document;
    // Without parse_doctype: what a document type declares is not looked at, so that entities cannot grow.
    const auto parsed = document.load_buffer_inplace(text_.data(), text_.size(),
                                                     pugi::parse_minimal | pugi::parse_escapes | pugi::parse_wconv_attribute);
    if (!parsed && !has_tags) throw Error(ErrorCode::input, path_.string() + " is no URDF: it is not XML.");
    if (!parsed)
      throw Error(ErrorCode::input, concat(path_.string(), ", byte ", static_cast<std::size_t>(parsed.offset),
                                           ": the XML is damaged (", parsed.description(), ")."));
    const pugi::xml_node root = document.document_element();
    if (std::string(root.name()) != "robot")
      throw Error(ErrorCode::input, path_.string() + " is no URDF: " + other_kind(root.name()) + ".");
    robot_.name = root.attribute("name").value();
    refuse_macros(root);
    for (const char* kind : {"link", "joint"}) require_number_of(root, kind);
    for (const auto& node : root.children("link")) read_link(node);
    if (robot_.links.empty()) complain("it has no <link>");
    for (const auto& node : root.children("joint")) read_joint(node);
    for (std::size_t n = 0; n < mimicked_.size(); ++n) find_mimicked(n);
    if (problems_.empty()) order_as_tree();
    if (problems_.empty()) refuse_circles_of_mimics();
    tell_problems();
    return std::move(robot_);
  }

private:
  void complain(const std::string& what) { problems_.push_back(what); }

  void tell_problems() const {
    if (problems_.empty()) return;
    std::string text = path_.string() + ": " + plural(problems_.size(), "thing is wrong", "things are wrong") + ".";
    for (std::size_t n = 0; n < std::min(problems_.size(), kMostTold); ++n) text += "\n  " + problems_[n] + ".";
    if (problems_.size() > kMostTold) text += "\n  And " + std::to_string(problems_.size() - kMostTold) + " more.";
    throw Error(ErrorCode::input, text);
  }

  void require_number_of(const pugi::xml_node& parent, const char* kind) const {
    const auto all = parent.children(kind);
    if (static_cast<std::size_t>(std::distance(all.begin(), all.end())) > kMostOfAKind)
      throw Error(ErrorCode::input,
                  concat(path_.string(), " has more than ", kMostOfAKind, " <", kind, ">: that is no robot that rayrep can take."));
  }

  std::string name_of(const pugi::xml_node& node, const std::string& kind, std::size_t number) {
    const std::string name = node.attribute("name").value();
    const std::string where = concat(kind, " ", number);
    if (name.empty()) complain(where + " has no name");
    if (name.size() > kLongestName) throw Error(ErrorCode::input, concat(path_.string(), ": ", where, " has a name without end."));
    return name;
  }

  void refuse_macros(const pugi::xml_node& root) const {
    for (const auto& node : root.children())
      if (std::string_view(node.name()).starts_with("xacro:"))
        throw Error(ErrorCode::input, path_.string() + " is written with macros (<" + node.name() +
                                          ">): let xacro make URDF of it first, xacro FILE.xacro > FILE.urdf.");
  }

  /// Numbers of an attribute; `usual` where there is none.
  Vector3d numbers(const pugi::xml_node& node, const char* name, const std::string& where, const Vector3d& usual) {
    const pugi::xml_attribute given = node.attribute(name);
    if (!given) return usual;
    const std::vector<std::string> words = words_in(given.value());
    Vector3d v = usual;
    bool good = words.size() == 3;
    for (std::size_t k = 0; good && k < 3; ++k) {
      double& value = v[static_cast<Eigen::Index>(k)];
      good = parse_number(words[k], value) && std::abs(value) <= kLargestBody_mm;
    }
    if (good) return v;
    complain(where + ": " + name + " takes three numbers, not '" + given.value() + "'");
    return usual;
  }

  double number(const pugi::xml_node& node, const char* name, const std::string& where, double usual) {
    const pugi::xml_attribute given = node.attribute(name);
    if (!given) return usual;
    const std::vector<std::string> words = words_in(given.value());
    double value = usual;
    if (words.size() == 1 && parse_number(words[0], value) && std::abs(value) <= kLargestBody_mm) return value;
    complain(where + ": " + name + " takes a number, not '" + given.value() + "'");
    return usual;
  }

  Isometry3d origin(const pugi::xml_node& of, const std::string& where) {
    const pugi::xml_node node = of.child("origin");
    const Vector3d xyz = numbers(node, "xyz", where + ", origin", Vector3d::Zero());
    const Vector3d rpy = numbers(node, "rpy", where + ", origin", Vector3d::Zero());
    return Eigen::Translation3d(kMetre * xyz) * Eigen::AngleAxisd(rpy.z(), Vector3d::UnitZ()) *
           Eigen::AngleAxisd(rpy.y(), Vector3d::UnitY()) * Eigen::AngleAxisd(rpy.x(), Vector3d::UnitX());
  }

  /// A length that has to be there, in mm.
  double length(const pugi::xml_node& node, const char* name, const std::string& where) {
    const double metres = number(node, name, where, 0);
    if (!(metres > 0)) complain(where + ": " + name + " has to be a length in m");
    return kMetre * metres;
  }

  void read_shape(const pugi::xml_node& of, const std::string& where, std::vector<RobotShape>& shapes) {
    if (++shapes_ > kMostShapes) throw Error(ErrorCode::input, concat(path_.string(), " has more than ", kMostShapes, " shapes."));
    RobotShape shape;
    shape.origin = origin(of, where);
    const pugi::xml_node geometry = of.child("geometry");
    const auto child = geometry.children().begin();
    const std::string kind = child == geometry.children().end() ? "" : child->name();
    const std::string here = where + ", " + kind;
    if (kind == "mesh") {
      shape.name = child->attribute("filename").value();
      shape.size = numbers(*child, "scale", here, Vector3d::Ones());
      if (shape.name.empty()) complain(here + ": filename has to name its file");
      if (shape.size.prod() == 0) complain(here + ": a scale of 0 leaves nothing of it");
      shape.file = mesh_path(shape.name, path_.parent_path());
    } else if (kind == "box") {
      shape.kind = RobotShape::Kind::box;
      shape.size = kMetre * numbers(*child, "size", here, Vector3d::Zero());
      if (!(shape.size.minCoeff() > 0)) complain(here + ": size has to be three lengths in m");
    } else if (kind == "cylinder" || kind == "sphere") {
      shape.kind = kind == "sphere" ? RobotShape::Kind::sphere : RobotShape::Kind::cylinder;
      shape.radius_mm = length(*child, "radius", here);
      if (kind == "cylinder") shape.length_mm = length(*child, "length", here);
    } else {
      complain(where + (kind.empty() ? ": its <geometry> is empty" : ": '" + kind + "' is none of mesh, box, cylinder, sphere"));
    }
    shapes.push_back(std::move(shape));
  }

  void read_link(const pugi::xml_node& node) {
    RobotLink link;
    link.name = name_of(node, "link", robot_.links.size() + 1);
    if (!link_of_.emplace(link.name, robot_.links.size()).second) complain("there are two links '" + link.name + "'");
    for (const auto& shape : node.children("visual")) read_shape(shape, "link '" + link.name + "', visual", link.visual);
    for (const auto& shape : node.children("collision")) read_shape(shape, "link '" + link.name + "', collision", link.collision);
    robot_.links.push_back(std::move(link));
  }

  std::size_t link_named(const pugi::xml_node& joint, const char* end, const std::string& where) {
    const std::string name = std::string(joint.child(end).attribute("link").value()).substr(0, kLongestName);
    const auto found = link_of_.find(name);
    if (found != link_of_.end()) return found->second;
    std::vector<std::string> names;
    for (const RobotLink& link : robot_.links) names.push_back(link.name);
    const std::string meant = problems_.size() < kMostTold ? nearest_name(name, names) : "";
    complain(where + (name.empty() ? std::string(": <") + end + " link=\"...\"/> is missing"
                                   : std::string(": its ") + end + " '" + name + "' is no link" +
                                         (meant.empty() ? "" : " (is it '" + meant + "'?)")));
    return 0;
  }

  void read_limits(const pugi::xml_node& node, const std::string& where, RobotJoint& joint) {
    const pugi::xml_node limit = node.child("limit");
    if (!limit) {
      complain(where + ": a " + joint.type + " joint needs its <limit lower=\"...\" upper=\"...\"/>" +
               (joint.kind == Kind::revolute ? "; one without limits is continuous" : ""));
      return;
    }
    joint.lower = number(limit, "lower", where + ", limit", 0);
    joint.upper = number(limit, "upper", where + ", limit", 0);
    if (joint.lower > joint.upper)
      complain(where + ": its lower limit " + shown(joint.lower) + " is above its upper one, " + shown(joint.upper));
  }

  void read_joint(const pugi::xml_node& node) {
    static const std::map<std::string, Kind> kKinds = {{"fixed", Kind::fixed},           {"revolute", Kind::revolute},
                                                       {"continuous", Kind::continuous}, {"prismatic", Kind::prismatic},
                                                       {"floating", Kind::unsupported},  {"planar", Kind::unsupported}};
    RobotJoint joint;
    joint.name = name_of(node, "joint", robot_.joints.size() + 1);
    joint.type = node.attribute("type").value();
    const std::string where = "joint '" + joint.name + "'";
    if (!joint_of_.emplace(joint.name, robot_.joints.size()).second) complain("there are two joints '" + joint.name + "'");
    const auto kind = kKinds.find(joint.type);
    if (kind == kKinds.end())
      complain(where + ": its type '" + joint.type + "' is none of revolute, continuous, prismatic, fixed, floating, planar");
    else
      joint.kind = kind->second;
    joint.parent = link_named(node, "parent", where);
    joint.child = link_named(node, "child", where);
    joint.origin = origin(node, where);
    const Vector3d axis = numbers(node.child("axis"), "xyz", where + ", axis", Vector3d::UnitX());
    const bool moves = joint.kind != Kind::fixed && joint.kind != Kind::unsupported;
    if (moves && !(axis.norm() > 0)) complain(where + ": its axis has no direction");
    joint.axis = axis.normalized();
    if (joint.kind == Kind::revolute || joint.kind == Kind::prismatic) read_limits(node, where, joint);
    if (const pugi::xml_node mimic = node.child("mimic"); mimic && moves) {
      joint.mimic = {0, number(mimic, "multiplier", where + ", mimic", 1), number(mimic, "offset", where + ", mimic", 0)};
      mimicked_.emplace_back(robot_.joints.size(), mimic.attribute("joint").value());
    }
    robot_.joints.push_back(std::move(joint));
  }

  void find_mimicked(std::size_t n) {
    const auto& [joint, name] = mimicked_[n];
    const auto found = joint_of_.find(name);
    if (found == joint_of_.end())
      complain("joint '" + robot_.joints[joint].name + "': it mimics '" + name + "', which is no joint");
    else
      robot_.joints[joint].mimic->joint = found->second;
  }

  /// Sorts the joints, each after the one that carries its parent.
  void order_as_tree() {
    std::vector<std::optional<std::size_t>> carries(robot_.links.size());  // the joint that does
    std::vector<std::vector<std::size_t>> below(robot_.links.size());
    for (std::size_t j = 0; j < robot_.joints.size(); ++j) {
      const RobotJoint& joint = robot_.joints[j];
      std::optional<std::size_t>& carrier = carries[joint.child];
      if (carrier)
        complain("link '" + robot_.links[joint.child].name + "' is the child of two joints, '" + robot_.joints[*carrier].name +
                 "' and '" + joint.name + "': links have to be a tree, so a loop has to be cut open");
      carrier = j;
      below[joint.parent].push_back(j);
    }
    std::vector<std::size_t> order;
    std::vector<std::size_t> roots;
    for (std::size_t l = 0; l < robot_.links.size(); ++l)
      if (!carries[l]) roots.push_back(l);
    for (const std::size_t root : roots) order.insert(order.end(), below[root].begin(), below[root].end());
    for (std::size_t n = 0; n < order.size() && problems_.empty(); ++n) {
      const std::vector<std::size_t>& next = below[robot_.joints[order[n]].child];
      order.insert(order.end(), next.begin(), next.end());
    }
    if (roots.size() > 1) complain(words_of_roots(roots));
    if (!problems_.empty()) return;
    if (order.size() == robot_.joints.size())
      sort_joints(order);
    else
      complain(words_of_circle(carries));
  }

  std::string words_of_roots(const std::vector<std::size_t>& roots) const {
    std::string names;
    for (std::size_t n = 0; n < std::min(roots.size(), std::size_t{5}); ++n)
      names += (n > 0 ? ", '" : "'") + robot_.links[roots[n]].name + "'";
    return plural(roots.size(), "link", "links") + " are no joint's child (" + names + (roots.size() > 5 ? ", ..." : "") +
           "), and a robot has one: connect the others with fixed joints, or take them out";
  }

  /// From any link that hangs on none, upwards until one comes again.
  std::string words_of_circle(const std::vector<std::optional<std::size_t>>& carries) const {
    std::vector<bool> free(robot_.links.size(), false);
    std::size_t at = 0;
    for (std::size_t l = 0; l < robot_.links.size(); ++l) {
      std::size_t up = l, steps = 0;
      while (carries[up] && !free[up] && steps++ <= robot_.links.size()) up = robot_.joints[*carries[up]].parent;
      free[l] = !carries[up] || free[up];
      if (!free[l]) at = l;
    }
    for (std::size_t steps = 0; steps < robot_.links.size(); ++steps) at = robot_.joints[*carries[at]].parent;
    std::string names = "'" + robot_.links[at].name + "'";
    for (std::size_t up = robot_.joints[*carries[at]].parent; up != at; up = robot_.joints[*carries[up]].parent)
      names += ", '" + robot_.links[up].name + "'";
    return "links carry each other in a circle: " + names + "; they have to be a tree";
  }

  void sort_joints(const std::vector<std::size_t>& order) {
    std::vector<std::size_t> place(robot_.joints.size());
    for (std::size_t n = 0; n < order.size(); ++n) place[order[n]] = n;
    std::vector<RobotJoint> sorted;
    for (const std::size_t n : order) sorted.push_back(std::move(robot_.joints[n]));
    robot_.joints = std::move(sorted);
    for (RobotJoint& joint : robot_.joints)
      if (joint.mimic) joint.mimic->joint = place[joint.mimic->joint];
  }

  void refuse_circles_of_mimics() {
    for (std::size_t j = 0; j < robot_.joints.size(); ++j) {
      std::size_t at = j, steps = 0;
      while (robot_.joints[at].mimic && steps++ <= robot_.joints.size()) at = robot_.joints[at].mimic->joint;
      if (!robot_.joints[at].mimic) continue;
      complain("joint '" + robot_.joints[j].name + "': it mimics itself, by way of those that it mimics");
      return;
    }
  }

  fs::path path_;
  std::string text_;
  Robot robot_;
  std::map<std::string, std::size_t> link_of_, joint_of_;
  std::vector<std::pair<std::size_t, std::string>> mimicked_;
  std::vector<std::string> problems_;
  std::size_t shapes_ = 0;
};

}  // namespace

Robot read_urdf(const std::filesystem::path& path) { return UrdfReader(path).read(); }

}  // namespace rayrep
