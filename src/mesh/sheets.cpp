#include "mesh/sheets.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "base/union_find.h"
#include "mesh/mesh_edges.h"
#include "mesh/orientation.h"
#include "mesh/point_tree.h"
#include "mesh/shells.h"

namespace rayrep {
namespace {

using Eigen::Vector3d;

/// Strays nearer to each other than this times the diagonal may belong together.
constexpr double kNear = 1e-3;
/// Strays that are more of the surface than this are not strays.
constexpr double kMostOfSurface = 0.1;

/// Sheets that meet at less of an angle than this, rad, go straight on.
constexpr double kStraight = 1e-3;
/// So many planes bound no body.
constexpr std::size_t kTooFewPlanes = 3;

/// A patch of triangles, and how it hangs on others.
struct Sheet {
  std::vector<int> triangles;
  double area = 0;
  int largest = -1;  ///< triangle
  double largest_area = 0;
  bool removable = true;    ///< without it all edges around it are balanced
  bool unbalanced = false;  ///< with it they are not
  bool attached = false;    ///< some of these edges have triangles of others
  bool rim = false;         ///< some have none
  double inside = 0;        ///< length of edges at which it lies inside material, less that at which it lies outside

  bool superfluous() const { return removable && unbalanced; }
};

/// Angle of a triangle around an edge, in a frame of the edge's own.
class Around {
public:
  Around(const Vector3d& low, const Vector3d& high) : origin_(low), axis_((high - low).normalized()) {
    x_ = axis_.unitOrthogonal();
    y_ = axis_.cross(x_);
  }
  double angle(const Vector3d& p) const { return std::atan2(y_.dot(p - origin_), x_.dot(p - origin_)); }

private:
  Vector3d origin_, axis_, x_, y_;
};

double turned_by(double from, double to) {
  const double full = 2 * std::numbers::pi;
  const double angle = std::fmod(to - from, full);
  return angle < 0 ? angle + full : angle;
}

class Sheets {
public:
  explicit Sheets(const Mesh& mesh) : mesh_(mesh) {
    join_patches();
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      Sheet& sheet = sheets_[patch_[t]];
      const double area = 0.5 * (mesh.corner(t, 1) - mesh.corner(t, 0)).cross(mesh.corner(t, 2) - mesh.corner(t, 0)).norm();
      sheet.area += area;
      if (sheet.largest < 0 || area > sheet.largest_area) {
        sheet.largest = static_cast<int>(t);
        sheet.largest_area = area;
      }
      sheet.triangles.push_back(static_cast<int>(t));
    }
    for_each_edge(mesh, [this](auto begin, auto end) {
      if (end - begin != 2) look_at(begin, end);
    });
  }

  const std::vector<Sheet>& all() const { return sheets_; }
  const std::vector<int>& patch() const { return patch_; }

  bool is_flat(const std::vector<const Sheet*>& group, double tolerance) const {
    const Sheet* largest = *std::max_element(group.begin(), group.end(),
                                             [](const Sheet* a, const Sheet* b) { return a->largest_area < b->largest_area; });
    const auto t = static_cast<std::size_t>(largest->largest);
    const Vector3d& a = mesh_.corner(t, 0);
    const Vector3d normal = (mesh_.corner(t, 1) - a).cross(mesh_.corner(t, 2) - a).normalized();
    for (const Sheet* sheet : group)
      for (const int n : sheet->triangles)
        for (int k = 0; k < 3; ++k)
          if (!(std::abs(normal.dot(mesh_.corner(static_cast<std::size_t>(n), k) - a)) <= tolerance)) return false;
    return true;
  }

private:
  /// Patches, joined where they go straight on across others: walls that cross.
  void join_patches() {
    Mesh oriented = mesh_;
    const Orientation orientation = orient_neighbours(oriented);
    UnionFind joined(orientation.patches);
    for_each_edge(mesh_, [&](auto begin, auto end) {
      if (end - begin < 4 || edge_balance(begin, end) != 0) return;
      const Around around(mesh_.vertices[begin->low], mesh_.vertices[begin->high]);
      for (auto use = begin; use != end; ++use)
        for (auto other = use + 1; other != end; ++other) {
          const double turn = turned_by(around.angle(third(*use)), around.angle(third(*other)));
          if (use->direction != other->direction && std::abs(turn - std::numbers::pi) < kStraight)
            joined.unite(orientation.patch[use->triangle], orientation.patch[other->triangle]);
        }
    });
    std::vector<int> number(static_cast<std::size_t>(orientation.patches), -1);
    int count = 0;
    for (const int patch : orientation.patch) {
      int& n = number[joined.root(patch)];
      if (n < 0) n = count++;
      patch_.push_back(n);
    }
    sheets_.resize(static_cast<std::size_t>(count));
  }

  template <typename Use>
  void look_at(Use begin, Use end) {
    const int total = edge_balance(begin, end);
    for (auto use = begin; use != end; ++use) {
      const int own = patch_[use->triangle];
      Sheet& sheet = sheets_[own];
      int rest = 0;
      std::vector<EdgeUse> others;
      for (auto other = begin; other != end; ++other) {
        if (patch_[other->triangle] == own) continue;
        rest += other->direction;
        others.push_back(*other);
      }
      sheet.removable = sheet.removable && rest == 0;
      sheet.unbalanced = sheet.unbalanced || total != 0;
      if (total != 0) (others.empty() ? sheet.rim : sheet.attached) = true;
      if (others.size() == 2 && rest == 0) sheet.inside += inside(*use, others);
    }
  }

  Vector3d third(const EdgeUse& use) const {
    for (int k = 0; k < 3; ++k) {
      const int v = mesh_.triangles[use.triangle][k];
      if (v != use.low && v != use.high) return mesh_.vertices[v];
    }
    return mesh_.vertices[use.low];
  }

  /// Plus or minus the length of an edge: does the triangle lie in the material between two others that balance each other? A
  /// triangle that runs from low to high has what is outside it ahead when turning about that axis.
  double inside(const EdgeUse& use, const std::vector<EdgeUse>& others) const {
    const Vector3d& low = mesh_.vertices[use.low];
    const Vector3d& high = mesh_.vertices[use.high];
    const Around around(low, high);
    const bool first_down = others[0].direction < 0;
    const double down = around.angle(third(others[first_down ? 0 : 1]));
    const double up = around.angle(third(others[first_down ? 1 : 0]));
    const bool is_inside = turned_by(down, around.angle(third(use))) < turned_by(down, up);
    return (is_inside ? 1 : -1) * (high - low).norm();
  }

  const Mesh& mesh_;
  std::vector<int> patch_;
  std::vector<Sheet> sheets_;
};

/// Flat sheets that hang on nothing, without those that are no plane together with their neighbours.
std::vector<int> strays(const Mesh& mesh, const Sheets& sheets, const SheetOptions& options) {
  std::vector<int> alone;
  double all = 0;
  for (std::size_t n = 0; n < sheets.all().size(); ++n) {
    const Sheet& sheet = sheets.all()[n];
    all += sheet.area;
    if (sheet.superfluous() && !sheet.attached && sheets.is_flat({&sheet}, options.flat)) alone.push_back(static_cast<int>(n));
  }
  std::vector<int> number(sheets.all().size(), -1);  // among those alone
  for (std::size_t n = 0; n < alone.size(); ++n) number[alone[n]] = static_cast<int>(n);
  std::vector<std::pair<int, int>> at;  // vertex, and the stray it is of
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (number[sheets.patch()[t]] >= 0)
      for (const int v : mesh.triangles[t]) at.emplace_back(v, number[sheets.patch()[t]]);
  std::vector<int> vertices;
  UnionFind near(static_cast<int>(alone.size()));
  std::vector<int> stray_of(mesh.vertices.size(), -1);
  for (const auto& [v, stray] : at) {
    if (stray_of[v] < 0)
      vertices.push_back(v);
    else
      near.unite(stray, stray_of[v]);
    stray_of[v] = stray;
  }
  const PointTree tree(mesh.vertices, vertices);
  const double reach = kNear * bounding_box(mesh).diagonal().norm();
  std::vector<int> found;
  for (std::size_t n = 0; n < alone.size(); ++n)
    for (const int t : sheets.all()[alone[n]].triangles)
      for (int k = 0; k < 3; ++k) {
        tree.near_segment(mesh.corner(static_cast<std::size_t>(t), k), mesh.corner(static_cast<std::size_t>(t), (k + 1) % 3), reach,
                          found);
        for (const int v : found) near.unite(static_cast<int>(n), stray_of[v]);
      }
  std::vector<std::vector<const Sheet*>> groups(alone.size());
  for (std::size_t n = 0; n < alone.size(); ++n) groups[near.root(static_cast<int>(n))].push_back(&sheets.all()[alone[n]]);
  std::vector<int> result;
  double area = 0;
  for (std::size_t n = 0; n < alone.size(); ++n)
    if (options.all_strays || sheets.is_flat(groups[near.root(static_cast<int>(n))], options.flat)) {
      result.push_back(alone[n]);
      area += sheets.all()[alone[n]].area;
    }
  const auto planes = std::count_if(groups.begin(), groups.end(), [](const auto& group) { return !group.empty(); });
  if (static_cast<std::size_t>(planes) > kTooFewPlanes && area > kMostOfSurface * all) result.clear();
  return result;
}

Vector3d middle_of_largest(const Mesh& mesh, const Sheet& sheet) {
  const auto t = static_cast<std::size_t>(sheet.largest);
  return (mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2)) / 3;
}

/// The mesh without some sheets.
Mesh without(const std::vector<int>& gone, const Mesh& mesh, const Sheets& sheets) {
  std::vector<bool> is_gone(sheets.all().size(), false);
  for (const int n : gone) is_gone[n] = true;
  Mesh result;
  result.vertices = mesh.vertices;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (!is_gone[sheets.patch()[t]]) result.triangles.push_back(mesh.triangles[t]);
  return result;
}

/// Sheets inside: by the edges around them, and as far as the rest closes along a line by its winding number.
std::vector<int> walls(const Mesh& mesh, const Sheets& sheets) {
  std::vector<int> result;
  for (std::size_t n = 0; n < sheets.all().size(); ++n) {
    const Sheet& sheet = sheets.all()[n];
    if (sheet.superfluous() && sheet.attached && !sheet.rim && sheet.inside > 0) result.push_back(static_cast<int>(n));
  }
  if (result.empty()) return result;
  const Mesh rest = without(result, mesh, sheets);
  const std::vector<int> one(rest.triangles.size(), 0);
  ShellNesting nesting(rest, one);
  Surroundings around;
  std::erase_if(result, [&](int n) {
    nesting.around(middle_of_largest(mesh, sheets.all()[n]), -1, around);
    return around.line_closes && around.winding <= 0;
  });
  return result;
}

/// Takes some sheets out of the mesh and into the account.
void drop(const std::vector<int>& gone, const Sheets& sheets, SheetsDropped& result) {
  if (result.triangles == 0) result.first = middle_of_largest(result.mesh, sheets.all()[gone.front()]);
  for (const int n : gone) {
    result.triangles += sheets.all()[n].triangles.size();
    result.area += sheets.all()[n].area;
  }
  result.mesh = without(gone, result.mesh, sheets);
}

}  // namespace

SheetsDropped without_sheets(const Mesh& mesh, const SheetOptions& options, const Progress& progress) {
  constexpr int kRounds = 8;  // dropping one sheet may join others
  SheetsDropped result;
  result.mesh = mesh;
  for (int round = 0; round < kRounds; ++round) {
    progress.check();
    const Sheets sheets(result.mesh);
    std::vector<int> gone = walls(result.mesh, sheets);
    for (const int n : gone) result.inside.push_back(middle_of_largest(result.mesh, sheets.all()[n]));
    result.walls += gone.size();
    if (gone.empty()) {
      for (std::size_t n = 0; n < sheets.all().size(); ++n) {
        const Sheet& sheet = sheets.all()[n];
        if (sheet.superfluous() && sheet.attached && sheets.is_flat({&sheet}, options.flat)) gone.push_back(static_cast<int>(n));
      }
      result.fins += gone.size();
    }
    if (gone.empty()) {
      gone = strays(result.mesh, sheets, options);
      result.strays += gone.size();
    }
    if (gone.empty()) break;
    drop(gone, sheets, result);
  }
  return result;
}

}  // namespace rayrep
