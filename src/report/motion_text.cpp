#include <cmath>
#include <numbers>

#include "base/text.h"
#include "rayrep/report/motion_report.h"

namespace rayrep {
namespace {

std::string words_of(const CollisionInterval& interval, double clearance_mm) {
  using Kind = CollisionInterval::Kind;
  const std::string when = number(interval.from, 4) + " to " + number(interval.to, 4);
  if (interval.kind == Kind::undecided) return "not looked at closely yet from " + when;
  const std::string where = " around " + shown_to_thousandths(interval.worst_box_mm.center());
  if (interval.kind == Kind::contact)
    return (interval.to - interval.from < 1e-3 ? "touch at " + number(interval.from, 4) : "touch from " + when) + where;
  const std::string worst = "; worst at " + number(interval.worst_time, 3) + ": ";
  if (interval.only_near(clearance_mm))
    return "nearer than " + shown(clearance_mm) + " mm from " + when + worst + number(interval.distance_mm, 3) + " mm apart" +
           where;
  std::string text = "overlap from " + when + worst + number(interval.depth_mm, 2) + " mm deep or more";
  text += interval.contour_length_mm > 0 ? ", their surfaces cross along " + number(interval.contour_length_mm, 1) + " mm"
                                         : ", one inside the other";
  return text + where;
}

std::string words_of(const Scene& scene, const PairMotion& pair) {
  std::string text;
  const std::string names = scene.parts[pair.first].name + " and " + scene.parts[pair.second].name;
  for (const CollisionInterval& interval : pair.intervals)
    text += "  " + names + " " + words_of(interval, pair.clearance_mm) + "\n";
  return text;
}

std::string words_of(const Scene& scene, const Hint& hint) {
  using Kind = Freedom::Kind;
  std::string text = "    " + words_of(scene, hint.freedom) + ": ";
  const double length = hint.amount.norm();
  switch (hint.freedom.kind) {
    case Kind::translation:
    case Kind::rest:
      text += "move it by " + shown_to_thousandths(hint.amount) + " mm";
      break;
    case Kind::rotation:
      text += "turn it by " + number(length * 180 / std::numbers::pi, 1) + " degrees about " +
              shown_to_thousandths(length > 0 ? Eigen::Vector3d(hint.amount / length) : hint.amount);
      break;
    case Kind::time:
    case Kind::turn_time:
      text += number(std::abs(hint.amount[0]), 3) + (hint.amount[0] < 0 ? " earlier" : " later");
      break;
  }
  if (hint.frees) return text + " (clear then)\n";
  return text + " (" + number(100 * (1 - hint.after_mm / hint.before_mm), 0) + " % less)\n";
}

}  // namespace

std::string to_text(const Scene& scene, const std::vector<Hint>& hints) {
  std::string text;
  const Hint* before = nullptr;
  for (const Hint& hint : hints) {
    if (!before || before->transition != hint.transition || before->first != hint.first || before->second != hint.second)
      text += "  For " + scene.parts[hint.first].name + " and " + scene.parts[hint.second].name + " on the way " +
              scene.transitions[hint.transition].name + " any of these:\n";
    text += words_of(scene, hint);
    before = &hint;
  }
  return text.empty() ? "  No move of what may be moved helps.\n" : text;
}

std::string to_text(const Scene& scene, const MotionReport& report) {
  std::string text;
  for (std::size_t t = 0; t < scene.transitions.size(); ++t) {
    text += scene.transitions[t].name + "\n";
    std::size_t clear = 0;
    for (const PairMotion& pair : report.pairs) {
      if (pair.transition != t) continue;
      if (pair.intervals.empty()) ++clear;
      text += words_of(scene, pair);
    }
    text += "  clear all the way: " + plural(clear, "pair", "pairs") + "\n";
  }
  return text;
}

std::string to_text(const SceneFile& file, const std::string& name) {
  const Scene& scene = file.scene;
  std::string text = name + ": " + plural(scene.parts.size(), "part", "parts") + ", " +
                     plural(scene.states.size(), "state", "states") + ", " +
                     plural(scene.transitions.size(), "transition", "transitions") + "\n";
  for (const ScenePart& part : scene.parts) {
    if (!part.mesh) continue;
    text += "  " + part.name + ": " + plural(part.mesh->triangles.size(), "triangle", "triangles") + ", " +
            shown(part.print.density_g_cm3, 3) + " g/cm3, " +
            (part.printed ? "printed with a wall of " + shown(part.print.wall_mm) + " mm" : "not printed") + "\n";
  }
  for (const std::string& note : file.notes) text += "note: " + note + "\n";
  for (const SceneProblem& problem : file.problems) text += "wrong: " + problem.message + "\n";
  if (file.problems.empty()) text += "Nothing is wrong with it.\n";
  return text;
}

std::string to_text(const std::string& part, const std::string& by, const std::string& output, const Carving& carving) {
  if (!(carving.removed_mm3 > 0)) return by + " never comes near " + part + ": " + output + " is " + part + " as it was.\n";
  std::string text = output + ": " + part + " without " + number(carving.removed_mm3 / 1000, 2) + " cm3 that " + by +
                     " needs to get by, at least " + number(carving.at_least_mm, 3) + " mm and at most " +
                     number(carving.at_most_mm, 3) + " mm from it.\n";
  if (carving.bodies > 1)
    text += "note: It falls into " + std::to_string(carving.bodies) + " bodies that do not touch each other.\n";
  return text;
}

}  // namespace rayrep
