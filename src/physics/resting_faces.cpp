#include "rayrep/physics/resting_faces.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "base/rotation.h"
#include "mesh/convex_hull.h"
#include "rayrep/base/error.h"

namespace rayrep {
namespace {

using Eigen::Vector3d;

constexpr double kTolerance = 1e-5;  ///< over the diagonal
constexpr double kSameSide = 10 * std::numbers::pi / 180;

double det(const Vector3d& a, const Vector3d& b, const Vector3d& c) { return a.dot(b.cross(c)); }

/// Of the spherical triangle with these unit vectors as corners, all within less than a quarter of a circle of `a`; positive if
/// they run counter-clockwise seen from outside.
double solid_angle(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  return 2 * std::atan2(det(a, b, c), 1 + a.dot(b) + b.dot(c) + c.dot(a));
}

/// Where the great circle through `pole` and `p` meets the arc from `a` to `b`, which is shorter than half a circle; the nearer end
/// where it passes by.
Vector3d on_arc(const Vector3d& pole, const Vector3d& p, const Vector3d& a, const Vector3d& b) {
  const Vector3d m = a.cross(b);
  Vector3d y = pole.dot(m) * p - p.dot(m) * pole;
  if (y.dot(a + b) < 0) y = -y;
  const double from_a = m.dot(a.cross(y));
  const double to_b = m.dot(y.cross(b));
  if (!(from_a > 0)) return a;
  if (!(to_b > 0)) return b;
  return y.normalized();
}

/// A stretch of arcs that ends where the next one begins: all from there rolls to the face `to`.
struct Stretch {
  Vector3d begin;
  int to;
};

}  // namespace

/// Around each corner of the hull, counter-clockwise seen from outside: its edges. On the sphere of directions that point down they
/// are the sides of the region in which it touches the ground alone, from the normal of one face to that of the next.
struct Tumbler::Around {
  struct Side {
    int edge;
    bool begins;  ///< the edge at this corner
  };
  std::vector<std::vector<Side>> corners;

  explicit Around(const ConvexPolytope& hull) : corners(hull.vertices.size()) {
    // The edge at which the face on its right begins comes next after the one at which it ends.
    std::vector<std::vector<Side>> unsorted(hull.vertices.size());
    for (std::size_t e = 0; e < hull.edges.size(); ++e) {
      unsorted[static_cast<std::size_t>(hull.edges[e].from)].push_back({static_cast<int>(e), true});
      unsorted[static_cast<std::size_t>(hull.edges[e].to)].push_back({static_cast<int>(e), false});
    }
    const auto face_before = [&hull](const Side& s) {
      const auto& edge = hull.edges[static_cast<std::size_t>(s.edge)];
      return s.begins ? edge.right : edge.left;
    };
    const auto face_after = [&hull](const Side& s) {
      const auto& edge = hull.edges[static_cast<std::size_t>(s.edge)];
      return s.begins ? edge.left : edge.right;
    };
    for (std::size_t v = 0; v < corners.size(); ++v) {
      auto& all = unsorted[v];
      std::vector<Side>& sorted = corners[v];
      sorted.push_back(all.front());
      while (sorted.size() < all.size()) {
        const auto next =
            std::find_if(all.begin(), all.end(), [&](const Side& s) { return face_before(s) == face_after(sorted.back()); });
        if (next == all.end() || next->edge == all.front().edge) break;
        sorted.push_back(*next);
      }
    }
  }
};

/// One centre of mass.
class Tumbler::Rolling {
public:
  Rolling(const Tumbler& body, const Vector3d& centre)
      : hull_(*body.hull_), around_(*body.around_), centre_(centre), shake_(body.shake_rad_) {
    look_at_edges();
    look_at_faces();
    follow_faces();
    add_up();
    shake();
  }

  struct Face {
    double height = 0;
    double inside = std::numeric_limits<double>::infinity();  ///< how far the foot of the centre lies within its nearest edge;
                                                              ///< negative beside it
    bool rests = false;
    int to = -1;  ///< the face to which it rolls in the end
    double share = 0;
    std::vector<int> edges;
    double holds_rad() const { return std::atan2(inside, height); }
  };
  std::vector<Face> faces;

private:
  using Side = Around::Side;
  struct Edge {
    double along = 0;                          ///< of the centre of mass, over its length
    Vector3d top;                              ///< the direction down in which it is balanced on it
    double inside_left = 0, inside_right = 0;  ///< of the two faces, how far the foot of the centre lies within it
    std::vector<Stretch> stretches;            ///< for one that is rolled over from corner to corner: from where it comes
  };

  const ConvexPolytope::Edge& hull_edge(int e) const { return hull_.edges[static_cast<std::size_t>(e)]; }
  const Vector3d& vertex(int v) const { return hull_.vertices[static_cast<std::size_t>(v)]; }
  const Vector3d& normal(int f) const { return hull_.faces[static_cast<std::size_t>(f)].normal; }
  Face& face(int f) { return faces[static_cast<std::size_t>(f)]; }
  Edge& edge(int e) { return edges_[static_cast<std::size_t>(e)]; }
  const std::vector<Side>& sides(int v) const { return around_.corners[static_cast<std::size_t>(v)]; }

  int other_end(const Side& s) const { return s.begins ? hull_edge(s.edge).to : hull_edge(s.edge).from; }
  int face_before(const Side& s) const { return s.begins ? hull_edge(s.edge).right : hull_edge(s.edge).left; }
  int face_after(const Side& s) const { return s.begins ? hull_edge(s.edge).left : hull_edge(s.edge).right; }
  /// How far along the edge from this corner the centre of mass lies, over its length. From this corner it rolls to the edge where
  /// that is positive, and on to the other corner's region where it is 1 or more.
  double along(const Side& s) { return s.begins ? edge(s.edge).along : 1 - edge(s.edge).along; }

  /// The direction down in which it is balanced on a corner: there it rolls away from.
  Vector3d top(int v) const { return (vertex(v) - centre_).normalized(); }

  void look_at_edges() {
    edges_.resize(hull_.edges.size());
    for (std::size_t e = 0; e < edges_.size(); ++e) {
      const Vector3d& a = vertex(hull_.edges[e].from);
      const Vector3d run = vertex(hull_.edges[e].to) - a;
      edges_[e].along = (centre_ - a).dot(run) / run.squaredNorm();
      edges_[e].top = (a + edges_[e].along * run - centre_).normalized();
    }
  }

  void look_at_faces() {
    faces.resize(hull_.faces.size());
    for (std::size_t f = 0; f < faces.size(); ++f) {
      const auto& corners = hull_.faces[f].corners;
      for (const int v : corners)
        faces[f].height += normal(static_cast<int>(f)).dot(vertex(v) - centre_) / static_cast<double>(corners.size());
      if (!(faces[f].height > 0))
        throw Error(ErrorCode::input, "The centre of mass lies outside of the convex hull: that of no body does.");
    }
    for (std::size_t e = 0; e < edges_.size(); ++e) {
      const auto& [from, to, left, right] = hull_.edges[e];
      const Vector3d run = (vertex(to) - vertex(from)).normalized();
      const Vector3d r = centre_ - vertex(from);
      edges_[e].inside_left = det(normal(left), run, r);
      edges_[e].inside_right = -det(normal(right), run, r);
      face(left).inside = std::min(face(left).inside, edges_[e].inside_left);
      face(right).inside = std::min(face(right).inside, edges_[e].inside_right);
    }
  }

  /// Where it rolls to from a face, lower ones first: they lead to faces that are lower still.
  void follow_faces() {
    for (std::size_t e = 0; e < hull_.edges.size(); ++e)
      for (const int f : {hull_.edges[e].left, hull_.edges[e].right}) face(f).edges.push_back(static_cast<int>(e));
    order_.resize(faces.size());
    std::iota(order_.begin(), order_.end(), 0);
    std::stable_sort(order_.begin(), order_.end(), [this](int a, int b) { return face(a).height < face(b).height; });
    for (const int f : order_) face(f).to = end_of(f);
  }

  int beyond(int e, int f) const { return hull_edge(e).left == f ? hull_edge(e).right : hull_edge(e).left; }
  double inside(int e, int f) { return hull_edge(e).left == f ? edge(e).inside_left : edge(e).inside_right; }

  int end_of(int f) {
    face(f).rests = face(f).inside > 0;
    if (face(f).rests) return f;
    int nearest = -1;
    double distance = std::numeric_limits<double>::infinity();
    for (const int e : face(f).edges) {
      const auto& [from, to, left, right] = hull_edge(e);
      const double beside = std::max(-edge(e).along, edge(e).along - 1) * (vertex(to) - vertex(from)).norm();
      const double d = std::hypot(inside(e, f), std::max(0.0, beside));
      if (d >= distance) continue;
      distance = d;
      nearest = e;
    }
    const double t = edge(nearest).along;
    int reached = beyond(nearest, f);
    if (t <= 0 || t >= 1) reached = rolled(t <= 0 ? hull_edge(nearest).from : hull_edge(nearest).to, normal(f));
    // Rounding alone leads up.
    const bool down = reached >= 0 && face(reached).to >= 0;
    face(f).rests = !down;
    return down ? face(reached).to : f;
  }

  /// What holds it by no more than it is shaken does not keep it: over each of the edges that do it leaves as often, where it is
  /// lower beyond. Higher faces first.
  void shake() {
    for (auto it = order_.rbegin(); it != order_.rend(); ++it) {
      Face& f = face(*it);
      if (!f.rests || f.holds_rad() > shake_) continue;
      std::vector<int> lower;
      for (const int e : f.edges) {
        const int other = beyond(e, *it);
        if (std::atan2(inside(e, *it), f.height) <= shake_ && face(other).height < f.height * (1 - 1e-9)) lower.push_back(other);
      }
      if (lower.empty()) continue;
      for (const int other : lower) face(face(other).to).share += f.share / static_cast<double>(lower.size());
      f.rests = false;
      f.share = 0;
    }
  }

  /// The face that it comes to on its way from a direction in which it touches with the corner v alone; -1: none.
  int rolled(int v, Vector3d down) {
    for (;;) {
      const Side* out = nullptr;
      double best = -std::numeric_limits<double>::infinity();
      const Vector3d pole = top(v);
      for (const Side& s : sides(v)) {
        if (!(along(s) > 0)) continue;
        const double within = std::min(det(pole, normal(face_before(s)), down), det(pole, down, normal(face_after(s))));
        if (within <= best) continue;
        best = within;
        out = &s;
      }
      if (!out) return -1;
      const Vector3d& a = normal(face_before(*out));
      const Vector3d& b = normal(face_after(*out));
      down = on_arc(pole, down, a, b);
      if (along(*out) < 1) return on_its_way(out->edge, down);
      v = other_end(*out);
    }
  }

  /// Which of its two faces it comes to when it rolls over an edge.
  int on_its_way(int e, const Vector3d& down) {
    const auto& [from, to, left, right] = hull_edge(e);
    if (!is_balanced(e)) return downhill(e);
    const Vector3d m = normal(right).cross(normal(left));
    return m.dot(edge(e).top.cross(down)) > 0 ? left : right;
  }

  /// Whether it can be balanced on an edge; else it rolls over it to one face.
  bool is_balanced(int e) { return edge(e).inside_left > 0 && edge(e).inside_right > 0; }
  int downhill(int e) {
    const auto& [from, to, left, right] = hull_edge(e);
    return face(left).height < face(right).height ? left : right;
  }

  /// All corners, the nearest to the centre of mass first: what leads from one to another leads to one that is nearer.
  void add_up() {
    std::vector<int> order(hull_.vertices.size());
    std::iota(order.begin(), order.end(), 0);
    std::vector<double> distance;
    for (const Vector3d& v : hull_.vertices) distance.push_back((v - centre_).squaredNorm());
    std::stable_sort(order.begin(), order.end(),
                     [&](int a, int b) { return distance[static_cast<std::size_t>(a)] < distance[static_cast<std::size_t>(b)]; });
    for (const int v : order) add_corner(v);
    double whole = 0;
    for (const Face& f : faces) whole += f.share;
    for (Face& f : faces) f.share /= whole;
  }

  /// How the region of a corner rolls out of it: along great circles through its top, so that all depends on where they leave.
  void add_corner(int v) {
    const auto& all = sides(v);
    const std::size_t n = all.size();
    std::size_t first = 0;
    while (first < n && !(along(all[first]) > 0 && !(along(all[(first + n - 1) % n]) > 0))) ++first;
    const bool closed = first == n;  // it rolls out on all sides
    if (closed) first = 0;
    const Vector3d pole = top(v);
    std::vector<Stretch> out;  // counter-clockwise around the top
    std::size_t last = first;
    for (; last < first + n && along(all[last % n]) > 0; ++last) append_way_out(all[last % n], pole, out);
    if (closed || out.empty()) return;
    std::size_t at = 0;
    for (std::size_t k = first + n; k-- > last;) come_in(all[k % n], pole, out, at);
  }

  void append_way_out(const Side& s, const Vector3d& pole, std::vector<Stretch>& out) {
    const int before = face_before(s);
    const int after = face_after(s);
    std::vector<Stretch> its;
    if (along(s) >= 1) {
      its = edge(s.edge).stretches;
      if (its.empty()) its = {{normal(before), face(downhill(s.edge)).to}};
    } else if (is_balanced(s.edge)) {
      its = {{normal(before), face(before).to}, {edge(s.edge).top, face(after).to}};
    } else {
      its = {{normal(before), face(downhill(s.edge)).to}};
    }
    for (std::size_t k = 0; k < its.size(); ++k) {
      const Vector3d& end = k + 1 < its.size() ? its[k + 1].begin : normal(after);
      face(its[k].to).share += solid_angle(pole, its[k].begin, end);
      if (out.empty() || out.back().to != its[k].to) out.push_back(its[k]);
    }
  }

  /// A side across which it rolls in: where to is seen from the ways out on the same great circles. Sides come counter-clockwise
  /// around the top, and each is run that way, from its end to its begin.
  void come_in(const Side& s, const Vector3d& pole, const std::vector<Stretch>& out, std::size_t& at) {
    const Vector3d& begin = normal(face_after(s));
    const Vector3d& end = normal(face_before(s));
    std::vector<Stretch>& in = edge(s.edge).stretches;
    in = {{begin, out[at].to}};
    while (at + 1 < out.size() && det(pole, out[at + 1].begin, end) > 0) {
      ++at;
      in.push_back({on_arc(pole, out[at].begin, in.back().begin, end), out[at].to});
    }
    for (std::size_t k = 0; k < in.size(); ++k)
      face(in[k].to).share -= solid_angle(pole, in[k].begin, k + 1 < in.size() ? in[k + 1].begin : end);
  }

  const ConvexPolytope& hull_;
  const Around& around_;
  Vector3d centre_;
  double shake_;
  std::vector<Edge> edges_;
  std::vector<int> order_;  ///< of the faces, lower ones first
};

double share_with_up(const std::vector<RestingFace>& rests, const Eigen::Vector3d& up) {
  double share = 0;
  for (const RestingFace& face : rests)
    if (angle_between(face.up, up) <= kSameSide) share += face.share;
  return share;
}

Tumbler::Tumbler(const Mesh& mesh, double shake_rad)
    : hull_(std::make_shared<ConvexPolytope>(convex_hull(mesh.vertices, kTolerance * bounding_box(mesh).diagonal().norm()))),
      around_(std::make_shared<Around>(*hull_)),
      shake_rad_(shake_rad) {}

std::size_t Tumbler::faces() const { return hull_->faces.size(); }
Eigen::Vector3d Tumbler::up(std::size_t face) const { return Vector3d::Zero() - hull_->faces[face].normal; }
const std::vector<Eigen::Vector3d>& Tumbler::corners() const { return hull_->vertices; }

std::vector<double> Tumbler::shares(const Eigen::Vector3d& centre_of_mass_mm) const {
  const Rolling rolling(*this, centre_of_mass_mm);
  std::vector<double> shares;
  for (const Rolling::Face& f : rolling.faces) shares.push_back(f.rests ? std::max(0.0, f.share) : 0);
  return shares;
}

std::vector<RestingFace> Tumbler::rests(const Eigen::Vector3d& centre_of_mass_mm) const {
  const Rolling rolling(*this, centre_of_mass_mm);
  std::vector<RestingFace> rests;
  for (std::size_t f = 0; f < faces(); ++f)
    if (const Rolling::Face& face = rolling.faces[f]; face.rests)
      rests.push_back({up(f), std::max(0.0, face.share), face.height, face.holds_rad()});
  std::stable_sort(rests.begin(), rests.end(), [](const RestingFace& a, const RestingFace& b) { return a.share > b.share; });
  return rests;
}

}  // namespace rayrep
