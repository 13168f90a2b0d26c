#include "mesh/quadric_cap.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "mesh/planar_triangulation.h"
#include "mesh/predicates.h"
#include "mesh/quadric_chart.h"

namespace rayrep {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Loops = std::vector<std::vector<int>>;

/// A cap in one chart.
class Cap {
public:
  /// @param turn  of the chart: -1 where it has to be seen in a mirror
  Cap(const Quadric& f, const QuadricChart& chart, int turn, double error_mm)
      : f_(f), chart_(chart), turn_(turn), error_(error_mm) {}

  /// @returns false where the loops cross in this chart, do not bound a part of it, or what they bound is not f = 0
  bool make(const Mesh& mesh, const Loops& loops) {
    if (!place(mesh, loops)) return false;
    plane_->improve();
    if (!refine()) return false;
    plane_->flip_where([this](const PlanarTriangulation&, int t, int k) { return is_better_flipped(t, k); });
    plane_->improve();
    return is_sound();
  }

  /// Vertices at which the loops cross in this chart.
  const std::vector<int>& tangled() const { return tangled_; }

  void append_to(Mesh& mesh) const {
    std::vector<int> number = number_;
    for (std::size_t n = 0; n < number.size(); ++n)
      if (number[n] < 0 && n >= PlanarTriangulation::kFirst) {
        number[n] = static_cast<int>(mesh.vertices.size());
        mesh.vertices.push_back(position_[n]);
      }
    for (std::size_t t = 0; t < inside_.size(); ++t) {
      const auto& corner = plane_->triangles()[t].corner;
      if (inside_[t]) mesh.triangles.emplace_back(number[corner[0]], number[corner[1]], number[corner[2]]);
    }
  }

private:
  Vector2d map(const Vector3d& p) const {
    const Vector2d q = chart_.at(p);
    return {q.x(), turn_ * q.y()};
  }

  void keep(const Vector3d& p, int number) {
    position_.push_back(p);
    number_.push_back(number);
  }

  /// The loops in the plane, as sides that stay.
  bool place(const Mesh& mesh, const Loops& loops) {
    Eigen::AlignedBox2d box;
    for (const auto& loop : loops)
      for (const int v : loop) box.extend(map(mesh.vertices[v]));
    if (!box.min().allFinite() || !box.max().allFinite()) return false;
    plane_.emplace(box.min(), box.max());
    position_.assign(PlanarTriangulation::kFirst, Vector3d::Zero());
    number_.assign(PlanarTriangulation::kFirst, -1);
    std::vector<std::vector<int>> places;
    for (const auto& loop : loops) {
      places.emplace_back(loop.size(), -1);
      if (!add(mesh, loop, places.back())) return false;
    }
    for (const auto& loop : places)
      for (std::size_t n = 0; n < loop.size(); ++n) sides_.push_back({loop[n], loop[(n + 1) % loop.size()]});
    for (const auto& side : sides_)
      if (!plane_->fix(side[0], side[1])) note_tangle(side);
    if (!tangled_.empty()) return false;
    if (look_inside()) return true;
    for (const auto& loop : places) note_reversed(loop, places);
    return false;
  }

  /// A loop that runs round clockwise and lies in no other one, or counter-clockwise in one.
  void note_reversed(const std::vector<int>& loop, const std::vector<std::vector<int>>& loops) {
    double area = 0;
    for (std::size_t n = 0; n < loop.size(); ++n) {
      const Vector2d& a = plane_->point(loop[n]);
      const Vector2d& b = plane_->point(loop[(n + 1) % loop.size()]);
      area += a.x() * b.y() - a.y() * b.x();
    }
    bool is_within = false;
    for (const auto& other : loops)
      if (other[0] != loop[0]) is_within = is_within != holds(other, plane_->point(loop[0]));
    if ((area > 0) != is_within) return;
    for (const int n : loop) tangled_.push_back(number_[n]);
  }

  bool holds(const std::vector<int>& loop, const Vector2d& p) const {
    bool is_in = false;
    for (std::size_t n = 0; n < loop.size(); ++n) {
      const Vector2d& a = plane_->point(loop[n]);
      const Vector2d& b = plane_->point(loop[(n + 1) % loop.size()]);
      if ((a.y() > p.y()) == (b.y() > p.y())) continue;
      const bool is_left = orient2d(a, b, p) > 0;
      is_in = is_in != (is_left == (b.y() > a.y()));
    }
    return is_in;
  }

  /// A side that cannot be, and those that are in its way.
  void note_tangle(const std::array<int, 2>& side) {
    const auto turn = [this](int a, int b, int c) { return orient2d(plane_->point(a), plane_->point(b), plane_->point(c)); };
    const auto [a, b] = side;
    tangled_.insert(tangled_.end(), {number_[a], number_[b]});
    for (const auto& [c, d] : sides_)
      if (c != b && d != a && turn(a, b, c) * turn(a, b, d) <= 0 && turn(c, d, a) * turn(c, d, b) <= 0)
        tangled_.insert(tangled_.end(), {number_[c], number_[d]});
  }

  /// The points of a loop: few first, then those between, so that no point is far from one that is there.
  bool add(const Mesh& mesh, const std::vector<int>& loop, std::vector<int>& places) {
    std::size_t stride = 1;
    while (stride < loop.size()) stride *= 2;
    for (; stride > 0; stride /= 2)
      for (std::size_t n = 0; n < loop.size(); n += stride) {
        if (places[n] >= 0) continue;
        places[n] = plane_->add(map(mesh.vertices[loop[n]]), n >= stride ? places[n - stride] : -1);
        if (places[n] < 0) {
          tangled_.push_back(loop[n]);
          return false;
        }
        keep(mesh.vertices[loop[n]], loop[n]);
      }
    return true;
  }

  bool look_inside() {
    inside_ = plane_->left_of(sides_);
    return !inside_.empty();
  }

  /// Where the angles opposite a side add up to more than pi, in space, and the other diagonal is not worse.
  bool is_better_flipped(int t, int k) const {
    const auto& corner = plane_->triangles()[t].corner;
    const int d = plane_->apex(t, k);
    if (d < PlanarTriangulation::kFirst || *std::min_element(corner.begin(), corner.end()) < PlanarTriangulation::kFirst)
      return false;
    const Vector3d& a = position_[corner[(k + 1) % 3]];
    const Vector3d& b = position_[corner[(k + 2) % 3]];
    const Vector3d& c = position_[corner[k]];
    const Vector3d& e = position_[d];
    const auto cotangent = [](const Vector3d& u, const Vector3d& v) {
      return u.dot(v) / std::max(u.cross(v).norm(), 1e-12 * u.norm() * v.norm());
    };
    const double now = cotangent(a - c, b - c) + cotangent(a - e, b - e);
    return now < -1e-6 && now < cotangent(c - a, e - a) + cotangent(c - b, e - b) - 1e-6 &&
           sag(0.5 * (c + e), HUGE_VAL) <= std::max(error_, sag(0.5 * (a + b), HUGE_VAL));
  }

  /// How far a chord is from f = 0 at p.
  double sag(const Vector3d& p, double length) const {
    const double d = std::abs(f_.distance(p));
    return d < length ? d : length;
  }

  /// A point to add: in the plane, and on f = 0.
  struct Split {
    Vector2d at;
    Vector3d position;
  };

  /// Where a triangle is to be split: in the middle of its longest side that is too far from f = 0, or its own.
  /// @returns false where what is to be split is not on f = 0
  bool find_split(int t, std::optional<Split>& split) const {
    const auto& triangle = plane_->triangles()[t];
    double longest = 4 * error_;  // no shorter side is split: at the tip of a cone there would be no end
    double size = longest;
    Split own{Vector2d::Zero(), Vector3d::Zero()};
    for (int k = 0; k < 3; ++k) {
      const int a = triangle.corner[(k + 1) % 3];
      const int b = triangle.corner[(k + 2) % 3];
      own.at += plane_->point(a) / 3;
      own.position += position_[a] / 3;
      const double length = (position_[a] - position_[b]).norm();
      size = std::max(size, length);
      if (triangle.fixed[k] || length <= longest) continue;
      Split side{0.5 * (plane_->point(a) + plane_->point(b)), 0.5 * (position_[a] + position_[b])};
      if (!lift(side, length)) return false;
      if (side.at.allFinite()) {
        longest = length;
        split = side;
      }
    }
    if (!split && size > 4 * error_ && !lift(own, size)) return false;
    if (!split && size > 4 * error_ && own.at.allFinite()) split = own;
    return true;
  }

  /// Lifts a point to f = 0, if its chord is too far from there, else makes it none.
  /// @returns false where there is nothing to lift it to
  bool lift(Split& split, double length) const {
    constexpr double kUneven = 0.25;  // of the length: chart and space then differ too much
    const std::optional<Vector3d> p = chart_.lifted(f_, {split.at.x(), turn_ * split.at.y()}, turn_);
    if (!p) return false;
    if (sag(split.position, length) <= error_ && (*p - split.position).norm() <= kUneven * length)
      split.at.setConstant(NAN);
    else
      split.position = *p;
    return true;
  }

  bool refine() {
    constexpr int kRounds = 60;
    constexpr std::size_t kMost = 200000;
    for (int round = 0; round < kRounds; ++round) {
      const std::size_t before = position_.size();
      const std::size_t triangles = inside_.size();
      const auto is_inside = [this, triangles](int t) { return static_cast<std::size_t>(t) >= triangles || inside_[t]; };
      near_.resize(triangles, kNone);
      for (std::size_t t = 0; t < triangles; ++t) {
        const std::array<int, 3> corner = plane_->triangles()[t].corner;
        std::optional<Split> split;
        if (!inside_[t] || near_[t] == corner) continue;
        if (!find_split(static_cast<int>(t), split)) return false;
        if (!split) near_[t] = corner;
        if (!split) continue;
        keep(split->position, -1);  // flips look at it
        if (plane_->add_where(split->at, plane_->triangles()[t].corner[0], is_inside) >= 0) continue;
        position_.pop_back();
        number_.pop_back();
      }
      if (position_.size() == before) return true;
      if (position_.size() > kMost || !look_inside()) return false;
    }
    return true;
  }

  /// Whether it is f = 0 that was triangulated, and faces the right way.
  bool is_sound() const {
    for (std::size_t t = 0; t < inside_.size(); ++t) {
      if (!inside_[t]) continue;
      const auto& corner = plane_->triangles()[t].corner;
      const Vector3d& a = position_[corner[0]];
      const Vector3d& b = position_[corner[1]];
      const Vector3d& c = position_[corner[2]];
      const Vector3d middle = (a + b + c) / 3;
      const Vector3d area = (b - a).cross(c - a);
      if (sag(middle, HUGE_VAL) <= 5 * error_ && area.dot(f_.gradient(middle)) <= 0) continue;
      // Needles face anywhere, and so does what is smaller than the error.
      const double longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
      if (longest > 5 * error_ && area.norm() > error_ * longest) return false;
    }
    return true;
  }

  const Quadric& f_;
  const QuadricChart& chart_;
  int turn_;
  double error_;
  std::optional<PlanarTriangulation> plane_;
  std::vector<Vector3d> position_;  ///< of the plane's points
  std::vector<int> number_;         ///< in the mesh; -1: new
  std::vector<std::array<int, 2>> sides_;
  std::vector<int> tangled_;
  std::vector<char> inside_;
  static constexpr std::array<int, 3> kNone{-1, -1, -1};
  std::vector<std::array<int, 3>> near_;  ///< of each triangle with which corners it was found to be near enough to f = 0
};

/// Which way a chart turns along a loop; 0 where it does both.
int turn_of(const QuadricChart& chart, const Quadric& f, const Mesh& mesh, const std::vector<int>& loop) {
  int turn = 0;
  for (const int v : loop) {
    const int here = chart.orientation(f, mesh.vertices[v]);
    if (here == 0 || here == -turn) return 0;
    turn = here;
  }
  return turn;
}

/// What caps are to be made of.
struct Rim {
  const Quadric& f;
  const Loops& loops;
  double error_mm;
};

/// The sheets of a graph are told apart by the way it turns; other charts have one.
/// @param[out] tangled  vertices at which loops cross
bool make_caps(const Rim& rim, const QuadricChart& chart, Mesh& mesh, std::vector<int>& tangled) {
  Loops sheets[2];
  for (const auto& loop : rim.loops) {
    const int turn = turn_of(chart, rim.f, mesh, loop);
    if (turn == 0) return false;
    sheets[turn > 0].push_back(loop);
  }
  if (chart.kind != QuadricChart::Kind::graph && !sheets[0].empty() && !sheets[1].empty()) return false;
  std::vector<Cap> caps;
  caps.reserve(2);
  bool is_made = true;
  for (int side = 0; side < 2; ++side) {
    if (sheets[side].empty()) continue;
    caps.emplace_back(rim.f, chart, side == 0 ? -1 : 1, rim.error_mm);
    is_made = caps.back().make(mesh, sheets[side]) && is_made;
    tangled.insert(tangled.end(), caps.back().tangled().begin(), caps.back().tangled().end());
  }
  if (!is_made) return false;
  for (const Cap& cap : caps) cap.append_to(mesh);
  return true;
}

}  // namespace

bool comes_first(const Quadric& f) {
  for (const double number : f.hessian.reshaped())
    if (number != 0) return number > 0;
  for (const double number : f.slope)
    if (number != 0) return number > 0;
  return f.constant > 0;
}

bool append_caps(const Quadric& f, const std::vector<std::vector<int>>& loops, double error_mm, Mesh& mesh,
                 std::vector<int>& tangled) {
  tangled.clear();
  if (loops.empty()) return true;
  if (!comes_first(f)) {  // the same from behind
    std::vector<std::vector<int>> back = loops;
    for (auto& loop : back) std::reverse(loop.begin() + 1, loop.end());
    const std::size_t first = mesh.triangles.size();
    const Quadric opposite = -f;
    if (!comes_first(opposite) || !append_caps(opposite, back, error_mm, mesh, tangled)) return false;
    for (std::size_t t = first; t < mesh.triangles.size(); ++t) std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
    return true;
  }
  std::vector<std::vector<Vector3d>> curves;
  for (const auto& loop : loops) {
    curves.emplace_back();
    for (const int v : loop) curves.back().push_back(mesh.vertices[v]);
  }
  for (const QuadricChart& chart : quadric_charts(f, curves, error_mm)) {
    std::vector<int> here;
    if (make_caps({f, loops, error_mm}, chart, mesh, here)) return true;
    if (!here.empty() && (tangled.empty() || here.size() < tangled.size())) tangled = std::move(here);
  }
  return false;
}

}  // namespace rayrep
