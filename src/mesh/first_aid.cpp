#include "mesh/first_aid.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "base/text.h"
#include "mesh/holes.h"
#include "mesh/orientation.h"
#include "mesh/rims.h"
#include "mesh/sheets.h"
#include "mesh/shells.h"

namespace rayrep {
namespace {

using Eigen::Vector3d;

// All of the diagonal.
constexpr double kLeastTolerance = 1e-9;
constexpr double kTolerance = 1e-5;        ///< what is nearer than this nobody means to be apart
constexpr double kMostTolerance = 1e-4;    ///< nor this, where joining it costs no triangle
constexpr double kRepairTolerance = 1e-3;  ///< a guess
constexpr double kSmallHole = 2e-2;
constexpr double kThinnest = 1e-5;  ///< what is thinner on the mean than this after its holes were closed has no volume

constexpr double kFlatHole = 1e-3;  ///< of its size

double volume_from(const Vector3d& origin, const Mesh& mesh) {
  double six = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    six += (mesh.corner(t, 0) - origin).dot((mesh.corner(t, 1) - origin).cross(mesh.corner(t, 2) - origin));
  return six / 6;
}

class Aid {
public:
  Aid(const Mesh& mesh, const Progress& progress) : progress_(progress), mesh_(mesh), rims_(rims_of(mesh)) {
    diagonal_ = bounding_box(mesh).diagonal().norm();
  }

  /// With the smallest tolerances that help. Corners that are farther apart than T-junctions may be off their sides are joined
  /// before these are split, if that leaves less open: one corner beside another is no T-junction.
  void join_rims(bool repair) {
    const Mesh given = mesh_;
    const Rims given_rims = rims_;
    at_tolerances(kLeastTolerance, kTolerance, [this](double relative) {
      const std::size_t before = rims_.edges.size();
      weld(relative, false);
      const bool under_way = rims_.edges.size() < before && 2 * rims_.edges.size() > before;
      if (!under_way) split(relative, 0.5);
    });
    at_tolerances(kLeastTolerance, kTolerance, [this](double relative) { split(relative, 1); });
    if (rims_.closed()) return;
    const Mesh near = std::exchange(mesh_, given);
    const Rims near_rims = std::exchange(rims_, given_rims);
    const FirstAidReport near_report = std::exchange(result_.report, {});
    at_tolerances(kLeastTolerance, kTolerance, [this](double relative) { weld(relative, false); });
    at_tolerances(kMostTolerance, repair ? kRepairTolerance : kMostTolerance, [this](double relative) { weld(relative, true); });
    at_tolerances(kLeastTolerance, kTolerance, [this](double relative) { split(relative, 1); });
    if (rims_.edges.size() < near_rims.edges.size()) return;
    mesh_ = near;
    rims_ = near_rims;
    result_.report = near_report;
  }

  void drop_sheets(bool repair) {
    if (rims_.closed()) return;
    SheetsDropped dropped = without_sheets(mesh_, {kTolerance * diagonal_, repair}, progress_);
    if (dropped.triangles == 0 || dropped.mesh.triangles.empty() || !take(dropped.mesh, 1)) return;
    inside_ = dropped.inside;
    result_.report.sheets_dropped = dropped.strays + dropped.fins + dropped.walls;
    result_.report.triangles_dropped = dropped.triangles;
    area_changed_ += dropped.area;
    std::string what;
    const auto add = [&what](std::size_t count, const char* one, const char* many) {
      if (count > 0) what += (what.empty() ? "" : ", ") + plural(count, one, many);
    };
    add(dropped.strays, "stray piece that hangs on nothing", "stray pieces that hang on nothing");
    add(dropped.fins, "flat sheet without thickness", "flat sheets without thickness");
    add(dropped.walls, "wall inside the material", "walls inside the material");
    dropped_words_ = concat("what bounds nothing was left out: ", what, " (", plural(dropped.triangles, "triangle", "triangles"),
                            "), the first near ", shown(dropped.first), ".");
  }

  void close_holes(bool repair) {
    if (rims_.closed()) return;
    const std::vector<Hole> holes = holes_of(mesh_, rims_);
    std::vector<Hole> flat;
    std::vector<Hole> bent;
    std::vector<Hole> left;
    for (const Hole& hole : holes) {
      if (hole.bulge <= std::max(kTolerance * diagonal_, kFlatHole * hole.size) && !hole.normal.isZero())
        flat.push_back(hole);
      else if (repair || hole.size <= kSmallHole * diagonal_)
        bent.push_back(hole);
      else
        left.push_back(hole);
    }
    if (!left.empty()) {
      say_what_is_left(left);
      return;
    }
    Eigen::AlignedBox3d box;
    for (const Eigen::Vector3i& t : mesh_.triangles)
      for (const int v : t) box.extend(mesh_.vertices[v]);
    const double volume_before = volume_from(box.center(), mesh_);
    const std::size_t before = mesh_.triangles.size();
    close_flat(flat, kTolerance * diagonal_, mesh_, progress_);
    bool guessed = false;
    for (const Hole& hole : bent) {
      progress_.check();
      close_bent(hole, mesh_);
      guessed = guessed || hole.size > kSmallHole * diagonal_;
    }
    result_.report.repaired = guessed;
    result_.report.holes_closed = holes.size();
    result_.report.triangles_added = mesh_.triangles.size() - before;
    const double area = surface_area(mesh_, before);
    area_changed_ += area;
    const Hole& longest = longest_of(holes);
    const char* kinds = guessed ? "" : bent.empty() ? "flat " : flat.empty() ? "small " : "flat or small ";
    const std::size_t count = result_.report.triangles_added;
    closed_words_ =
        concat(plural(holes.size(), concat(kinds, "hole was").c_str(), concat(kinds, "holes were").c_str()), " closed by ",
               plural(count, "triangle", "triangles"), ", ", rough_percent(area / surface_area(mesh_)), " of the surface; ",
               holes.size() == 1 ? "it is " : "the longest is ", longest.length, " around, near ", shown(longest.middle), ".");
    const double volume = volume_from(box.center(), mesh_);
    result_.report.volume_change = volume != 0 ? (volume - volume_before) / volume : 0;
    rims_ = rims_of(mesh_);
    if (!has_thickness(before)) result_.left = "closing its holes leaves pieces without thickness";
  }

  FirstAid result(const Mesh& given) {
    if (result_.left.empty() && rims_.closed() && !walls_are_inside())
      result_.left = "sheets hang on it that are not inside the material";
    result_.report.repaired = result_.report.repaired || result_.report.joined_within > 2 * kMostTolerance * diagonal_;
    result_.closed = rims_.closed() && result_.left.empty();
    if (!result_.closed) return {given, false, {}, {}, result_.left};
    FirstAidReport& report = result_.report;
    const double area = surface_area(mesh_);
    report.surface_change = area > 0 ? area_changed_ / area : 0;
    say_what_was_done();
    result_.mesh = std::move(mesh_);
    return std::move(result_);
  }

private:
  /// While the surface is open, at tolerances of the diagonal that rise tenfold.
  template <typename Step>
  void at_tolerances(double least, double most, const Step& step) {
    for (double relative = least; relative < 2 * most && !rims_.closed(); relative *= 10) step(relative);
  }

  /// @param keep_all  only if no triangle is lost
  void weld(double relative, bool keep_all) {
    const Stepped welded = with_welded_rims(mesh_, rims_, relative * diagonal_, progress_);
    const bool loses = welded.mesh.triangles.size() < mesh_.triangles.size();
    if (welded.count == 0 || (keep_all && loses) || !take(welded.mesh, 1)) return;
    result_.report.corners_joined += welded.count;
    result_.report.joined_within = relative * diagonal_;
  }

  void split(double relative, double most_left) {
    if (rims_.closed()) return;
    const Stepped split = with_split_rims(mesh_, rims_, relative * diagonal_, progress_);
    if (split.count > 0 && take(split.mesh, most_left)) result_.report.sides_split += split.count;
  }

  /// Goes on with a mesh if less of it is open: of the edges less than a part `most_left`, or all in all a shorter length.
  bool take(const Mesh& next, double most_left) {
    progress_.check();
    Mesh oriented = next;
    orient_neighbours(oriented);
    progress_.check();
    Rims rims = rims_of(oriented);
    const bool fewer = static_cast<double>(rims.edges.size()) < most_left * static_cast<double>(rims_.edges.size());
    const bool shorter = most_left == 1 && rims.length < 0.999 * rims_.length;
    if (!fewer && !shorter) return false;
    mesh_ = std::move(oriented);
    rims_ = std::move(rims);
    return true;
  }

  static const Hole& longest_of(const std::vector<Hole>& holes) {
    return *std::max_element(holes.begin(), holes.end(), [](const Hole& a, const Hole& b) { return a.length < b.length; });
  }

  /// Whether every shell that caps were added to, from triangle `caps` on, encloses something.
  bool has_thickness(std::size_t caps) {
    const Orientation shells = orient_neighbours(mesh_);
    std::vector<double> areas(static_cast<std::size_t>(shells.count), 0);
    std::vector<bool> capped(areas.size(), false);
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      areas[shells.of_triangle[t]] +=
          0.5 * (mesh_.corner(t, 1) - mesh_.corner(t, 0)).cross(mesh_.corner(t, 2) - mesh_.corner(t, 0)).norm();
      if (t >= caps) capped[shells.of_triangle[t]] = true;
    }
    const std::vector<double> volumes = shell_volumes(mesh_, shells.of_triangle, shells.count);
    for (std::size_t n = 0; n < areas.size(); ++n)
      if (capped[n] && !(2 * std::abs(volumes[n]) > kThinnest * diagonal_ * areas[n])) return false;
    return true;
  }

  bool walls_are_inside() const {
    if (inside_.empty()) return true;
    const std::vector<int> one(mesh_.triangles.size(), 0);
    ShellNesting nesting(mesh_, one);
    Surroundings around;
    return std::all_of(inside_.begin(), inside_.end(), [&](const Vector3d& p) {
      progress_.check();
      nesting.around(p, -1, around);
      return around.winding > 0;
    });
  }

  void say_what_is_left(const std::vector<Hole>& left) {
    const Hole& longest = longest_of(left);
    result_.left = concat(plural(left.size(), "hole that is neither flat nor small", "holes that are neither flat nor small"),
                          left.size() == 1 ? ", " : ", the longest ", longest.length, " around, near ", shown(longest.middle));
    const FirstAidReport& report = result_.report;
    if (report.corners_joined > 0)
      result_.left += concat("; besides, ", plural(report.corners_joined, "corner is", "corners are"), " there more than once, ",
                             shown(report.joined_within, 2), " apart or less");
    if (report.sides_split > 0)
      result_.left +=
          concat("; besides, corners lie on ", plural(report.sides_split, "side", "sides"), " of other triangles (T-junctions)");
  }

  void say_what_was_done() {
    const FirstAidReport& report = result_.report;
    const auto add = [this](const std::string& words) {
      if (!words.empty()) result_.notes.push_back("First aid: " + words);
    };
    if (report.corners_joined > 0)
      add(concat(plural(report.corners_joined, "corner was", "corners were"), " joined with others at most ",
                 shown(report.joined_within, 2), " away."));
    if (report.sides_split > 0)
      add(concat(plural(report.sides_split, "side of a triangle was split", "sides of triangles were split"),
                 " at corners of others that lie on ", report.sides_split == 1 ? "it" : "them", " (T-junctions)."));
    add(dropped_words_);
    if (report.repaired && !closed_words_.empty())
      result_.notes.push_back(
          concat("Repair: ", closed_words_, " The volume has changed by ", rough_percent(report.volume_change), "."));
    else
      add(closed_words_);
  }

  const Progress& progress_;
  Mesh mesh_;
  Rims rims_;
  double diagonal_ = 0;
  double area_changed_ = 0;
  std::vector<Vector3d> inside_;
  std::string dropped_words_;
  std::string closed_words_;
  FirstAid result_;
};

}  // namespace

FirstAid first_aid(const Mesh& mesh, bool repair, const Progress& progress) {
  Aid aid(mesh, progress);
  aid.join_rims(repair);
  aid.drop_sheets(repair);
  aid.close_holes(repair);
  return aid.result(mesh);
}

}  // namespace rayrep
