#include "mesh/predicates.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace rayrep {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kHalfUlp = 1.1102230246251565e-16;  // 2^-53

/// A number as an unrounded sum of at most N doubles that do not overlap, the smallest first (Shewchuk 1997, Sec. 2).
template <int N>
struct Expansion {
  std::array<double, N> term;
  int size = 0;

  void push(double x) {
    if (x != 0) term[size++] = x;
  }
  int sign() const { return size == 0 ? 0 : (term[size - 1] > 0 ? 1 : -1); }
};

struct TwoTerms {
  double high, low;
};

TwoTerms two_sum(double a, double b) {
  const double x = a + b;
  const double b_virtual = x - a;
  return {x, (a - (x - b_virtual)) + (b - b_virtual)};
}

TwoTerms two_product(double a, double b) {
  const double x = a * b;
  return {x, std::fma(a, b, -x)};
}

Expansion<2> difference(double a, double b) {
  const TwoTerms d = two_sum(a, -b);
  Expansion<2> result;
  result.push(d.low);
  result.push(d.high);
  return result;
}

/// a + b: the terms of b are added one by one (GROW-EXPANSION).
template <int N, int M>
Expansion<N + M> operator+(const Expansion<N>& a, const Expansion<M>& b) {
  Expansion<N + M> sum;
  for (int i = 0; i < a.size; ++i) sum.term[i] = a.term[i];
  sum.size = a.size;
  for (int j = 0; j < b.size; ++j) {
    double carry = b.term[j];
    const int n = sum.size;
    sum.size = 0;
    for (int i = 0; i < n; ++i) {
      const TwoTerms s = two_sum(carry, sum.term[i]);
      carry = s.high;
      sum.push(s.low);
    }
    sum.push(carry);
  }
  return sum;
}

template <int N>
Expansion<N> operator-(Expansion<N> a) {
  for (int i = 0; i < a.size; ++i) a.term[i] = -a.term[i];
  return a;
}

/// a times one double (SCALE-EXPANSION).
template <int N>
Expansion<2 * N> scaled(const Expansion<N>& a, double b) {
  Expansion<2 * N> result;
  if (a.size == 0) return result;
  TwoTerms q = two_product(a.term[0], b);
  result.push(q.low);
  for (int i = 1; i < a.size; ++i) {
    const TwoTerms t = two_product(a.term[i], b);
    const TwoTerms s = two_sum(q.high, t.low);
    result.push(s.low);
    q = two_sum(t.high, s.high);
    result.push(q.low);
  }
  result.push(q.high);
  return result;
}

template <int N>
Expansion<4 * N> operator*(const Expansion<N>& a, const Expansion<2>& b) {
  Expansion<4 * N> result;
  if (b.size == 0) return result;
  if (b.size == 1) {
    const auto product = scaled(a, b.term[0]);
    for (int i = 0; i < product.size; ++i) result.push(product.term[i]);
    return result;
  }
  return scaled(a, b.term[0]) + scaled(a, b.term[1]);
}

using Difference = Expansion<2>;

Expansion<16> exact_minor(const Difference& a, const Difference& b, const Difference& c, const Difference& d) {
  return a * d + -(b * c);
}

int exact_orient3d(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
  Difference u[3], v[3], w[3];
  for (int k = 0; k < 3; ++k) {
    u[k] = difference(b[k], a[k]);
    v[k] = difference(c[k], a[k]);
    w[k] = difference(d[k], a[k]);
  }
  const auto x = exact_minor(u[1], u[2], v[1], v[2]) * w[0];
  const auto y = exact_minor(u[2], u[0], v[2], v[0]) * w[1];
  const auto z = exact_minor(u[0], u[1], v[0], v[1]) * w[2];
  return (x + y + z).sign();
}

int sign_of(double x) { return (x > 0) - (x < 0); }

Vector2d without(const Vector3d& p, int axis) { return {p[(axis + 1) % 3], p[(axis + 2) % 3]}; }

/// The coordinate along which a triangle of nonzero area can be projected without becoming a segment.
int projection_axis(const Vector3d p[3]) {
  const Vector3d n = (p[1] - p[0]).cross(p[2] - p[0]).cwiseAbs();
  int axis = 0;
  n.maxCoeff(&axis);
  for (int k = 0; k < 3; ++k, axis = (axis + 1) % 3)
    if (orient2d(without(p[0], axis), without(p[1], axis), without(p[2], axis)) != 0) return axis;
  return 0;
}

bool in_box(const Vector2d& p, const Vector2d& a, const Vector2d& b) {
  return std::min(a.x(), b.x()) <= p.x() && p.x() <= std::max(a.x(), b.x()) && std::min(a.y(), b.y()) <= p.y() &&
         p.y() <= std::max(a.y(), b.y());
}

/// Closed segments ab and cd.
bool segments_meet(const Vector2d& a, const Vector2d& b, const Vector2d& c, const Vector2d& d) {
  const int sc = orient2d(a, b, c);
  const int sd = orient2d(a, b, d);
  const int sa = orient2d(c, d, a);
  const int sb = orient2d(c, d, b);
  if (sc * sd < 0 && sa * sb < 0) return true;
  return (sc == 0 && in_box(c, a, b)) || (sd == 0 && in_box(d, a, b)) || (sa == 0 && in_box(a, c, d)) ||
         (sb == 0 && in_box(b, c, d));
}

bool contains(const Vector2d t[3], const Vector2d& p) {
  const int s0 = orient2d(t[0], t[1], p);
  const int s1 = orient2d(t[1], t[2], p);
  const int s2 = orient2d(t[2], t[0], p);
  return (s0 >= 0 && s1 >= 0 && s2 >= 0) || (s0 <= 0 && s1 <= 0 && s2 <= 0);
}

bool coplanar_segment_meets(const Vector3d& a, const Vector3d& b, const Vector3d t[3], int axis) {
  const Vector2d p = without(a, axis);
  const Vector2d q = without(b, axis);
  const Vector2d u[3] = {without(t[0], axis), without(t[1], axis), without(t[2], axis)};
  if (contains(u, p) || contains(u, q)) return true;
  for (int k = 0; k < 3; ++k)
    if (segments_meet(p, q, u[k], u[(k + 1) % 3])) return true;
  return false;
}

/// Closed segment ab and closed triangle t; sa and sb are the sides of t's plane on which a and b lie.
bool segment_meets(const Vector3d& a, int sa, const Vector3d& b, int sb, const Vector3d t[3]) {
  if (sa * sb > 0) return false;
  if (sa == 0 && sb == 0) return coplanar_segment_meets(a, b, t, projection_axis(t));
  int low = 0, high = 0;
  for (int k = 0; k < 3; ++k) {
    const int s = orient3d(a, b, t[k], t[(k + 1) % 3]);
    low = std::min(low, s);
    high = std::max(high, s);
    if (low < 0 && high > 0) return false;
  }
  return true;
}

/// Sides of the plane of t on which the corners of p lie; a corner with `known_zero` is a corner of t.
std::array<int, 3> sides(const Vector3d p[3], const Vector3d t[3], const std::array<bool, 3>& known_zero) {
  std::array<int, 3> s;
  for (int k = 0; k < 3; ++k) s[k] = known_zero[k] ? 0 : orient3d(t[0], t[1], t[2], p[k]);
  return s;
}

bool all_on_one_side(const std::array<int, 3>& s) {
  return (s[0] > 0 && s[1] > 0 && s[2] > 0) || (s[0] < 0 && s[1] < 0 && s[2] < 0);
}

}  // namespace

int orient2d(const Vector2d& a, const Vector2d& b, const Vector2d& c) {
  const double left = (b.x() - a.x()) * (c.y() - a.y());
  const double right = (b.y() - a.y()) * (c.x() - a.x());
  const double det = left - right;
  // Shewchuk's bound A (Sec. 4.2) for three rounded operations along each path.
  const double bound = (3 + 16 * kHalfUlp) * kHalfUlp * (std::abs(left) + std::abs(right));
  if (std::abs(det) > bound) return sign_of(det);
  const auto exact =
      exact_minor(difference(b.x(), a.x()), difference(b.y(), a.y()), difference(c.x(), a.x()), difference(c.y(), a.y()));
  return exact.sign();
}

int orient3d(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
  const Vector3d u = b - a;
  const Vector3d v = c - a;
  const Vector3d w = d - a;
  const double yz = u.y() * v.z(), zy = u.z() * v.y();
  const double zx = u.z() * v.x(), xz = u.x() * v.z();
  const double xy = u.x() * v.y(), yx = u.y() * v.x();
  const double det = (yz - zy) * w.x() + (zx - xz) * w.y() + (xy - yx) * w.z();
  const double permanent = (std::abs(yz) + std::abs(zy)) * std::abs(w.x()) + (std::abs(zx) + std::abs(xz)) * std::abs(w.y()) +
                           (std::abs(xy) + std::abs(yx)) * std::abs(w.z());
  // Shewchuk's bound A (Sec. 4.3), with a little more for the other order of summation.
  const double bound = (8 + 64 * kHalfUlp) * kHalfUlp * permanent;
  if (std::abs(det) > bound) return sign_of(det);
  return exact_orient3d(a, b, c, d);
}

bool collinear(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  for (int axis = 0; axis < 3; ++axis)
    if (orient2d(without(a, axis), without(b, axis), without(c, axis)) != 0) return false;
  return true;
}

bool triangles_intersect(const Vector3d p[3], const Eigen::Vector3i& ip, const Vector3d q[3], const Eigen::Vector3i& iq) {
  std::array<bool, 3> p_shared{}, q_shared{};
  int shared = 0;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      if (ip[i] == iq[j]) {
        p_shared[i] = q_shared[j] = true;
        ++shared;
      }

  if (shared == 3) return false;
  for (int axis = 0; axis < 3; ++axis) {  // boxes apart
    const auto [p_low, p_high] = std::minmax({p[0][axis], p[1][axis], p[2][axis]});
    const auto [q_low, q_high] = std::minmax({q[0][axis], q[1][axis], q[2][axis]});
    if (p_high < q_low || q_high < p_low) return false;
  }

  if (shared == 2) {  // they overlap only when folded flat onto each other
    const int i = static_cast<int>(std::find(p_shared.begin(), p_shared.end(), false) - p_shared.begin());
    const int j = static_cast<int>(std::find(q_shared.begin(), q_shared.end(), false) - q_shared.begin());
    if (orient3d(p[0], p[1], p[2], q[j]) != 0) return false;
    const int axis = projection_axis(p);
    const Vector2d a = without(p[(i + 1) % 3], axis);
    const Vector2d b = without(p[(i + 2) % 3], axis);
    return orient2d(a, b, without(p[i], axis)) == orient2d(a, b, without(q[j], axis));
  }

  const auto sp = sides(p, q, p_shared);
  if (all_on_one_side(sp)) return false;

  if (shared == 1) {  // beyond the shared corner they meet along a segment, which ends on an edge opposite to it
    const int i = static_cast<int>(std::find(p_shared.begin(), p_shared.end(), true) - p_shared.begin());
    const int j = static_cast<int>(std::find(q_shared.begin(), q_shared.end(), true) - q_shared.begin());
    const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
    if (sp[i1] * sp[i2] > 0) return false;
    const auto sq = sides(q, p, q_shared);
    if (sq[j1] * sq[j2] > 0) return false;
    return segment_meets(p[i1], sp[i1], p[i2], sp[i2], q) || segment_meets(q[j1], sq[j1], q[j2], sq[j2], p);
  }

  const auto sq = sides(q, p, q_shared);
  if (all_on_one_side(sq)) return false;
  for (int k = 0; k < 3; ++k) {
    const int l = (k + 1) % 3;
    if (segment_meets(p[k], sp[k], p[l], sp[l], q)) return true;
    if (segment_meets(q[k], sq[k], q[l], sq[l], p)) return true;
  }
  return false;
}

}  // namespace rayrep
