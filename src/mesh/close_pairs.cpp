#include "mesh/close_pairs.h"

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

#include "mesh/cell_boxes.h"
#include "mesh/mesh_edges.h"

// A tree of boxes over the triangles in the order of a curve that fills space: groups of eight neighbours on the curve, eight
// groups to a node, and so on. The order decides how fast this is, never what is found.

namespace rayrep {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

constexpr int kSpan = 4;  // a triangle that would make its group's box longer than so many times itself begins a new one

struct Corners {
  const Vector3i& numbers;
  std::array<const Vector3d*, 3> points;

  Corners(const Mesh& mesh, int triangle) : numbers(mesh.triangles[triangle]) {
    for (int k = 0; k < 3; ++k) points[k] = &mesh.vertices[numbers[k]];
  }
};

/// True when a plane across the line between the middles of two triangles keeps them apart.
bool apart(const Corners& s, const Corners& t, double clear_mm) {
  const Vector3d& origin = *s.points[0];
  const Vector3d direction = *t.points[0] + *t.points[1] + *t.points[2] - *s.points[0] - *s.points[1] - *s.points[2];
  const auto along = [&](const Corners& c, int k) { return direction.dot(*c.points[k] - origin); };
  const double gap = std::min({along(t, 0), along(t, 1), along(t, 2)}) - std::max({0.0, along(s, 1), along(s, 2)});
  return gap > 0 && gap * gap > clear_mm * clear_mm * direction.squaredNorm();
}

/// A triangle with planes that may keep others away from it: its own, and those upright on it along its sides.
class Prism {
public:
  Prism(const Corners& corners, double clear_mm) : corners_(corners) {
    std::array<Vector3d, 3> sides;
    double longest2 = 0;
    for (int k = 0; k < 3; ++k) {
      sides[k] = *corners.points[(k + 1) % 3] - *corners.points[k];
      longest2 = std::max(longest2, sides[k].squaredNorm());
    }
    normal_ = sides[0].cross(sides[1]);
    const double area2 = normal_.squaredNorm();
    // No plane is to be trusted when rounding may have tilted it by more than 1e-10.
    clear2_ = area2 > 1e-10 * longest2 * longest2 ? clear_mm * clear_mm * area2 : std::numeric_limits<double>::infinity();
    for (int k = 0; k < 3; ++k) {
      outward_[k] = sides[k].cross(normal_);
      outward_clear2_[k] = clear2_ * sides[k].squaredNorm();
    }
  }

  /// True when one of the planes keeps `other` away but for what the two share.
  bool keeps_away(const Corners& other) const {
    int at[3];  // which of the own corners each of the other's is
    bool above = true;
    bool below = true;
    for (int k = 0; k < 3; ++k) {
      const int v = other.numbers[k];
      const Vector3i& own = corners_.numbers;
      at[k] = v == own[0] ? 0 : v == own[1] ? 1 : v == own[2] ? 2 : -1;
      if (at[k] >= 0) continue;
      const double height = normal_.dot(*other.points[k] - *corners_.points[0]);
      const bool clear = height * height > clear2_;
      above = above && clear && height > 0;
      below = below && clear && height < 0;
    }
    if (above != below) return true;
    for (int side = 0; side < 3; ++side) {
      bool beyond = true;
      for (int k = 0; k < 3 && beyond; ++k) {
        if (at[k] == side || at[k] == (side + 1) % 3) continue;
        const double distance = at[k] >= 0 ? 0 : outward_[side].dot(*other.points[k] - *corners_.points[side]);
        beyond = distance > 0 && distance * distance > outward_clear2_[side];
      }
      if (beyond) return true;
    }
    return false;
  }

private:
  const Corners& corners_;
  Vector3d normal_;
  std::array<Vector3d, 3> outward_;
  double clear2_;  ///< squares of products with the normal beyond this are no rounding errors
  std::array<double, 3> outward_clear2_;
};

constexpr std::ptrdiff_t kSmallFan = 16;  // at most so many triangles

/// A triangle as seen from one of its corners.
struct Sector {
  int triangle;
  int from, to;  // the other corners, counter-clockwise
  Vector3d a, b, normal;

  Sector() = default;
  Sector(const Mesh& mesh, int corner) : triangle(corner / 3) {
    const Vector3i& t = mesh.triangles[triangle];
    const Vector3d& v = mesh.vertices[t[corner % 3]];
    from = t[(corner % 3 + 1) % 3];
    to = t[(corner % 3 + 2) % 3];
    a = mesh.vertices[from] - v;
    b = mesh.vertices[to] - v;
    normal = a.cross(b);
  }

  /// True when it faces a direction and is wider than rounding.
  bool faces(const Vector3d& direction) const {
    const double facing = normal.dot(direction);
    return facing > 0 && facing * facing > 1e-12 * direction.squaredNorm() * a.squaredNorm() * b.squaredNorm();
  }
};

/// See open_fans.
/// @param begin, end  the corners at a vertex
bool is_open_fan(const Mesh& mesh, const int* begin, const int* end) {
  const std::ptrdiff_t count = end - begin;
  if (count < 3 || count > kSmallFan) return false;
  std::array<Sector, kSmallFan> sectors;
  Vector3d sum = Vector3d::Zero();
  for (std::ptrdiff_t n = 0; n < count; ++n) {
    sectors[n] = Sector(mesh, begin[n]);
    sum += sectors[n].normal;
  }
  // Each begins where the one before it ends.
  std::ptrdiff_t at = 0;
  for (std::ptrdiff_t n = 0; n < count; ++n) {
    if (!sectors[n].faces(sum)) return false;
    const int next = sectors[at].to;
    at = 0;
    while (at < count && sectors[at].from != next) ++at;
    if (at == count || (at == 0 && n + 1 < count)) return false;
  }
  if (at != 0) return false;
  // How often they go round: as often as the plane upright on `across` is crossed on the same side.
  int axis = 0;
  sum.cwiseAbs().minCoeff(&axis);
  const Vector3d across = sum.cross(Vector3d::Unit(axis));
  int turns = 0;
  for (std::ptrdiff_t n = 0; n < count; ++n) turns += across.dot(sectors[n].a) < 0 && across.dot(sectors[n].b) >= 0;
  return turns == 1;
}

/// For each vertex whether the triangles around it meet nowhere else than in their common sides: seen along one direction they all
/// face the viewer and go round the vertex once.
std::vector<char> open_fans(const Mesh& mesh, const VertexCorners& at) {
  std::vector<char> open(mesh.vertices.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, open.size(), 1024), [&](const tbb::blocked_range<std::size_t>& range) {
    for (std::size_t v = range.begin(); v < range.end(); ++v)
      open[v] = is_open_fan(mesh, at.corners.data() + at.first[v], at.corners.data() + at.first[v + 1]);
  });
  return open;
}

/// The longest row of sectors each of which begins where the one before it ends; empty where two begin alike.
std::vector<Sector> longest_row(std::vector<Sector> sectors) {
  std::sort(sectors.begin(), sectors.end(), [](const Sector& a, const Sector& b) { return a.from < b.from; });
  const auto alike = [](const Sector& a, const Sector& b) { return a.from == b.from; };
  if (std::adjacent_find(sectors.begin(), sectors.end(), alike) != sectors.end()) return {};
  constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
  const auto after = [&sectors](const Sector& s) {
    const auto next =
        std::lower_bound(sectors.begin(), sectors.end(), s.to, [](const Sector& other, int vertex) { return other.from < vertex; });
    return next != sectors.end() && next->from == s.to ? static_cast<std::size_t>(next - sectors.begin()) : kNone;
  };
  std::vector<char> is_after(sectors.size(), 0);
  for (const Sector& s : sectors)
    if (const std::size_t next = after(s); next != kNone) is_after[next] = 1;
  std::vector<char> visited(sectors.size(), 0);
  std::vector<Sector> longest;
  const auto follow = [&](std::size_t n) {
    std::vector<Sector> row;
    for (; n != kNone && !visited[n]; n = after(sectors[n])) {
      visited[n] = 1;
      row.push_back(sectors[n]);
    }
    if (row.size() > longest.size()) longest = std::move(row);
  };
  for (std::size_t n = 0; n < sectors.size(); ++n)  // rows that begin somewhere, then those that close
    if (!is_after[n]) follow(n);
  for (std::size_t n = 0; n < sectors.size(); ++n) follow(n);
  return longest;
}

/// How far a row of sectors turns, seen against a direction that all of them face.
double turned(const std::vector<Sector>& row, const Vector3d& direction) {
  const Vector3d up = direction.normalized();
  double angle = 0;
  for (const Sector& s : row) angle += std::atan2(up.dot(s.normal), s.a.dot(s.b) - up.dot(s.a) * up.dot(s.b));
  return angle;
}

/// Many triangles in a row around a vertex, such as the end of a cylinder: for each triangle the vertex, or -1. Those of the same
/// vertex meet nowhere else than in their common sides: seen along one direction they all face the viewer and go round the vertex
/// once at most.
std::vector<int> large_fans(const Mesh& mesh, const VertexCorners& at) {
  constexpr double kFull = 2 * std::numbers::pi;
  constexpr double kRounding = 1e-6;
  std::vector<int> fan_of(mesh.triangles.size(), -1);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    if (at.first[v + 1] - at.first[v] <= kSmallFan) continue;
    std::vector<Sector> sectors;
    Vector3d sum = Vector3d::Zero();
    for (int n = at.first[v]; n < at.first[v + 1]; ++n) {
      sectors.emplace_back(mesh, at.corners[n]);
      sum += sectors.back().normal;
    }
    std::erase_if(sectors, [&sum](const Sector& s) { return !s.faces(sum); });
    const std::vector<Sector> row = longest_row(std::move(sectors));
    if (row.size() <= kSmallFan) continue;
    const double angle = turned(row, sum);
    const bool closes = row.back().to == row.front().from;
    if (closes ? std::abs(angle - kFull) > kRounding : angle > kFull - kRounding) continue;
    for (const Sector& s : row)
      if (fan_of[s.triangle] < 0) fan_of[s.triangle] = static_cast<int>(v);
  }
  return fan_of;
}

struct Group {
  EightBoxes boxes;
  std::array<int, kEight> triangles{};

  void add(std::size_t k, int triangle, const CellBox& box) {
    triangles[k] = triangle;
    boxes.set(k, box);
  }
};

class PairSearch {
public:
  explicit PairSearch(const Mesh& mesh) : mesh_(mesh), clear_mm_(1e-9 * bounding_box(mesh).diagonal().norm()) {
    const VertexCorners at(mesh);
    open_fan_ = open_fans(mesh, at);
    large_fan_ = large_fans(mesh, at);
    build(CellGrid(mesh).boxes_of_triangles(mesh));
  }

  std::vector<std::pair<int, int>> run(const Progress& progress) const {
    constexpr std::size_t kBatch = 512;  // between two looks at the progress
    tbb::enumerable_thread_specific<std::vector<std::pair<int, int>>> found;
    for (std::size_t begin = 0; begin < levels_[0].size(); begin += kBatch) {
      progress.check();
      const tbb::blocked_range<std::size_t> eights(begin, std::min(begin + kBatch, levels_[0].size()), 16);
      tbb::parallel_for(eights, [&](const tbb::blocked_range<std::size_t>& range) {
        std::vector<std::size_t> near;
        auto& pairs = found.local();
        for (std::size_t eight = range.begin(); eight < range.end(); ++eight) search(eight, near, pairs);
      });
    }
    progress.check();
    std::vector<std::pair<int, int>> pairs;
    for (const auto& part : found) pairs.insert(pairs.end(), part.begin(), part.end());
    std::sort(pairs.begin(), pairs.end());
    return pairs;
  }

private:
  void build(const std::vector<CellBox>& boxes) {
    std::vector<Place> places(boxes.size());
    tbb::parallel_for(std::size_t{0}, boxes.size(), [&](std::size_t t) {
      // Those of a large fan together: none of them is looked at with the others.
      const auto fan = static_cast<std::uint64_t>(large_fan_[t] + 1);
      places[t] = {fan << kPlaceBits | place_of(boxes[t]), static_cast<int>(t)};
    });
    const int highest = *std::max_element(large_fan_.begin(), large_fan_.end());
    sort_by_key(places, kPlaceBits + std::bit_width(static_cast<unsigned>(highest + 1)));

    // Where the curve jumps a group ends early.
    std::vector<CellBox> wholes;
    std::vector<int> fans;  // of the groups
    int room = 0;           // left in the last group
    for (const Place& place : places) {
      const CellBox& box = boxes[place.triangle];
      CellBox extended = wholes.empty() ? box : wholes.back();
      extended.extend(box);
      const int fan = large_fan_[place.triangle];
      if (room == 0 || fans.back() != fan || extended.longest_side() > kSpan * box.longest_side()) {
        groups_.emplace_back();
        wholes.push_back(box);
        fans.push_back(fan);
        room = kEight;
      } else {
        wholes.back() = extended;
      }
      groups_.back().add(kEight - room--, place.triangle, box);
    }
    wholes_ = wholes;
    do {
      fans_.push_back(fans);
      std::vector<EightBoxes>& level = levels_.emplace_back((wholes.size() + kEight - 1) / kEight);
      std::vector<CellBox> next(level.size());
      std::vector<int> next_fans(level.size());
      for (std::size_t n = 0; n < wholes.size(); ++n) {
        level[n / kEight].set(n % kEight, wholes[n]);
        next[n / kEight].extend(wholes[n]);
        int& fan = next_fans[n / kEight];
        fan = n % kEight == 0 || fan == fans[n] ? fans[n] : -1;
      }
      wholes = std::move(next);
      fans = std::move(next_fans);
    } while (wholes.size() > 1);
    fans_.push_back(fans);
  }

  /// The pairs of the triangles of eight groups with each other and with those of later groups.
  /// @param near  memory, to be used again
  void search(std::size_t eight, std::vector<std::size_t>& near, std::vector<std::pair<int, int>>& pairs) const {
    // The eights whose boxes this one's meets: a box there is at every level above.
    struct Node {
      std::size_t level, index;
    };
    CellBox box;
    for (std::size_t k = 0; k < kEight; ++k) box.extend(levels_[0][eight].at(k));
    near.clear();
    const int fan = fans_[1][eight];
    std::array<Node, kEight * 24> stack;  // eight nodes a level, and more levels than can be
    std::size_t size = 0;
    stack[size++] = {levels_.size() - 1, 0};
    while (size > 0) {
      const Node node = stack[--size];
      if (fan >= 0 && fans_[node.level + 1][node.index] == fan) continue;
      if (node.level == 0) {
        near.push_back(node.index);
        continue;
      }
      const std::size_t own = eight >> 3 * (node.level - 1);  // where this one is on the level below
      std::uint32_t bits = meeting(levels_[node.level][node.index], box);
      if (own > node.index * kEight) bits &= ~0u << (own - node.index * kEight);
      for (; bits != 0; bits &= bits - 1)
        stack[size++] = {node.level - 1, node.index * kEight + static_cast<std::size_t>(std::countr_zero(bits))};
    }
    for (std::size_t group = eight * kEight; group < std::min((eight + 1) * kEight, groups_.size()); ++group)
      for (const std::size_t other : near) {
        std::uint32_t bits = meeting(levels_[0][other], wholes_[group]);
        if (other == eight) bits &= ~0u << (group - eight * kEight);
        for (; bits != 0; bits &= bits - 1) search(group, other * kEight + static_cast<std::size_t>(std::countr_zero(bits)), pairs);
      }
  }

  void search(std::size_t group, std::size_t other, std::vector<std::pair<int, int>>& pairs) const {
    if (fans_[0][group] >= 0 && fans_[0][group] == fans_[0][other]) return;
    const Group& here = groups_[group];
    const Group& there = groups_[other];
    const CellBox common = intersection(wholes_[group], wholes_[other]);
    const std::uint32_t reach = meeting(there.boxes, common);
    if (reach == 0) return;
    for (std::uint32_t ours = meeting(here.boxes, common); ours != 0; ours &= ours - 1) {
      const auto k = static_cast<std::uint32_t>(std::countr_zero(ours));
      std::uint32_t theirs = reach & meeting(there.boxes, here.boxes.at(k));
      if (group == other) theirs &= ~1u << k;
      if (theirs == 0) continue;
      const int s = here.triangles[k];
      Vector3i fans = mesh_.triangles[s];  // those of its corners that settle triangles they share
      for (int& v : fans)
        if (!open_fan_[v]) v = -1;
      for (; theirs != 0; theirs &= theirs - 1) {
        const int t = there.triangles[static_cast<std::size_t>(std::countr_zero(theirs))];
        const Vector3i& v = mesh_.triangles[t];
        if ((v[0] == fans[0]) | (v[0] == fans[1]) | (v[0] == fans[2]) | (v[1] == fans[0]) | (v[1] == fans[1]) | (v[1] == fans[2]) |
            (v[2] == fans[0]) | (v[2] == fans[1]) | (v[2] == fans[2]))
          continue;
        const Corners first(mesh_, s);
        const Corners second(mesh_, t);
        if (!apart(first, second, clear_mm_) && !Prism(first, clear_mm_).keeps_away(second) &&
            !Prism(second, clear_mm_).keeps_away(first))
          pairs.emplace_back(std::min(s, t), std::max(s, t));
      }
    }
  }

  const Mesh& mesh_;
  double clear_mm_;             ///< larger distances from a plane are no rounding errors
  std::vector<char> open_fan_;  ///< of the vertices
  std::vector<int> large_fan_;  ///< of the triangles
  std::vector<Group> groups_;
  std::vector<CellBox> wholes_;                  ///< of the groups
  std::vector<std::vector<EightBoxes>> levels_;  ///< of groups, of eight of these, ..., of one
  std::vector<std::vector<int>> fans_;           ///< that all triangles are of, or -1: of groups, of eight of these, ..., of all
};

}  // namespace

std::vector<std::pair<int, int>> close_pairs(const Mesh& mesh, const Progress& progress) {
  if (mesh.triangles.empty()) return {};
  return PairSearch(mesh).run(progress);
}

}  // namespace rayrep
