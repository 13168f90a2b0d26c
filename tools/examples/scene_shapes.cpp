#include "scene_shapes.h"

#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "rayrep/mesh/boolean.h"

namespace rayrep {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Upright, over a convex outline that runs counter-clockwise seen from above.
Mesh prism(const std::vector<Vector2d>& outline, double from, double to) {
  const int n = static_cast<int>(outline.size());
  Mesh mesh;
  for (const double z : {from, to})
    for (const Vector2d& p : outline) mesh.vertices.emplace_back(p.x(), p.y(), z);
  for (int k = 1; k + 1 < n; ++k) {
    mesh.triangles.emplace_back(0, k + 1, k);
    mesh.triangles.emplace_back(n, n + k, n + k + 1);
  }
  for (int k = 0; k < n; ++k) {
    const int next = (k + 1) % n;
    mesh.triangles.emplace_back(k, next, n + next);
    mesh.triangles.emplace_back(k, n + next, n + k);
  }
  return mesh;
}

Mesh box(const Vector3d& min, const Vector3d& max) {
  return prism({{min.x(), min.y()}, {max.x(), min.y()}, {max.x(), max.y()}, {min.x(), max.y()}}, min.z(), max.z());
}

Mesh cylinder(double radius, double from, double to) {
  constexpr int kSides = 96;
  std::vector<Vector2d> outline;
  for (int k = 0; k < kSides; ++k) {
    const double angle = 2 * std::numbers::pi * k / kSides;
    outline.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
  }
  return prism(outline, from, to);
}

Mesh united(const std::vector<Mesh>& meshes) {
  return combined(meshes, {.operation = BooleanOperation::unite, .float32 = true}).mesh;
}

Mesh without(Mesh mesh, const std::vector<Mesh>& others) {
  std::vector<Mesh> all = {std::move(mesh)};
  all.insert(all.end(), others.begin(), others.end());
  return combined(all, {.operation = BooleanOperation::subtract, .float32 = true}).mesh;
}

/// A settle: its back swings forward about a pin behind the arms and lies on them as a table top.
void add_bench(std::vector<SceneShape>& shapes) {
  const Mesh seat = box({-45, -18, 22}, {45, 18, 30});
  const Mesh left = box({-45, -18, 0}, {-37, 24, 44});
  const Mesh right = box({37, -18, 0}, {45, 24, 44});
  shapes.push_back({"bench_seat", united({seat, left, right})});
  shapes.push_back({"bench_top", box({-45, -3, -3}, {45, 3, 40})});
}

/// Two hulls with a hinge between their decks.
void add_boat(std::vector<SceneShape>& shapes) {
  constexpr double kGap = 0.3;
  const std::vector<Vector2d> port = {{-50, kGap}, {52, kGap}, {44, 12}, {24, 24}, {-44, 24}, {-50, 18}};
  std::vector<Vector2d> starboard;
  for (auto p = port.rbegin(); p != port.rend(); ++p) starboard.emplace_back(p->x(), -p->y());
  shapes.push_back({"boat_port", prism(port, 0, 18)});
  shapes.push_back({"boat_starboard", prism(starboard, 0, 18)});
}

using Cell = std::array<int, 3>;

/// Cells of a grid, less what others take and a gap around that.
Mesh cells(const std::vector<Cell>& own, const std::vector<Cell>& others) {
  static constexpr double kSize = 12;
  constexpr double kGap = 0.3;
  const auto at = [](const Cell& c, double wider) {
    const Vector3d low(c[0], c[1], c[2]);
    return box(kSize * low - Vector3d::Constant(wider), kSize * (low + Vector3d::Ones()) + Vector3d::Constant(wider));
  };
  std::vector<Mesh> mine;
  std::vector<Mesh> theirs;
  for (const Cell& c : own) mine.push_back(at(c, 0));
  for (const Cell& c : others) theirs.push_back(at(c, kGap));
  return without(united(mine), theirs);
}

/// A slide in a groove, which a key through both holds.
void add_burr(std::vector<SceneShape>& shapes) {
  std::vector<Cell> frame;
  std::vector<Cell> slide;
  std::vector<Cell> key;
  for (int x = 0; x < 3; ++x)
    for (int y = 0; y < 5; ++y)
      for (int z = 0; z < 3; ++z) {
        const bool in_groove = (z == 1 && y > 0 && y < 4) || (z == 2 && y == 2);
        if (x == 1 && y == 2)
          key.push_back({x, y, z});
        else
          (in_groove ? slide : frame).push_back({x, y, z});
      }
  // A cell of the key's reaches out, to pull it by.
  key.push_back({1, 2, 3});
  const auto both = [](std::vector<Cell> a, const std::vector<Cell>& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
  };
  // Gaps on one side of each pair only.
  shapes.push_back({"burr_frame", cells(frame, both(slide, key))});
  shapes.push_back({"burr_slide", cells(slide, key)});
  shapes.push_back({"burr_key", cells(key, {})});
}

/// A flask goes into a cabinet and down into its lining.
void add_cabinet(std::vector<SceneShape>& shapes) {
  shapes.push_back({"cabinet_case", without(box({-35, -25, 0}, {35, 25, 100}), {box({-31, -30, 4}, {31, 21, 96})})});
  shapes.push_back({"cabinet_lining", box({-30.6, -24, 4.4}, {30.6, 20.6, 40})});
  shapes.push_back({"cabinet_flask", united({cylinder(12, 0, 30), cylinder(5, 28, 42)})});
}

/// It stands with its neck upright and reaching out.
void add_giraffe(std::vector<SceneShape>& shapes) {
  std::vector<Mesh> body = {box({-34, -13, 28}, {20, 13, 50})};
  for (const double x : {-34.0, 10.0})
    for (const double y : {-13.0, 3.0}) body.push_back(box({x, y, 0}, {x + 10, y + 10, 30}));
  shapes.push_back({"giraffe_body", united(body)});
  shapes.push_back({"giraffe_neck", united({box({-6, -6, -6}, {6, 6, 50}), box({-6, -6, 44}, {20, 6, 56})})});
}

}  // namespace

std::vector<SceneShape> scene_shapes() {
  std::vector<SceneShape> shapes;
  add_bench(shapes);
  add_boat(shapes);
  add_burr(shapes);
  add_cabinet(shapes);
  add_giraffe(shapes);
  return shapes;
}

}  // namespace rayrep
