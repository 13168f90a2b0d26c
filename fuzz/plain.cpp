#include "plain.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <tuple>
#include <utility>

namespace plain {
namespace {

using Place = std::tuple<Real, Real, Real>;

Place place(const Point& p) { return {p.x + 0, p.y + 0, p.z + 0}; }  // -0 becomes 0

/// Six times the volume of a tetrahedron, 0 where rounding may have decided its sign.
Real sure_volume(const Point& a, const Point& b, const Point& c, const Point& d) {
  const Point u = b - a;
  const Point v = c - a;
  const Point w = d - a;
  const Real six = dot(u, cross(v, w));
  return std::abs(six) > 1e-15L * norm(u) * norm(v) * norm(w) ? six : 0;
}

bool surely_pierces(const Point& p, const Point& q, const Triangle& t) {
  const Real above = sure_volume(t[0], t[1], t[2], p);
  const Real below = sure_volume(t[0], t[1], t[2], q);
  if (!(above * below < 0)) return false;
  Real signs[3];
  for (std::size_t k = 0; k < 3; ++k) signs[k] = sure_volume(p, q, t[k], t[(k + 1) % 3]);
  return (signs[0] > 0 && signs[1] > 0 && signs[2] > 0) || (signs[0] < 0 && signs[1] < 0 && signs[2] < 0);
}

Real distance(const Point& p, const Point& a, const Point& b) {
  const Point d = b - a;
  const Real length2 = dot(d, d);
  const Real s = length2 > 0 ? std::clamp<Real>(dot(p - a, d) / length2, 0, 1) : 0;
  return norm(p - (a + s * d));
}

/// Between segments: their ends, and where both are nearest inside.
Real distance(const Point& a, const Point& b, const Point& c, const Point& d) {
  Real nearest = std::min({distance(a, c, d), distance(b, c, d), distance(c, a, b), distance(d, a, b)});
  const Point u = b - a;
  const Point v = d - c;
  const Point n = cross(u, v);
  const Real n2 = dot(n, n);
  if (n2 > 0) {
    const Real s = dot(cross(c - a, v), n) / n2;
    const Real t = dot(cross(c - a, u), n) / n2;
    if (s > 0 && s < 1 && t > 0 && t < 1) nearest = std::min(nearest, norm(a + s * u - (c + t * v)));
  }
  return nearest;
}

}  // namespace

Real norm(const Point& a) { return std::sqrt(dot(a, a)); }

Point point(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

Surface surface_of(const rayrep::Mesh& mesh) {
  Surface surface;
  for (const auto& t : mesh.triangles)
    surface.push_back({point(mesh.vertices[t[0]]), point(mesh.vertices[t[1]]), point(mesh.vertices[t[2]])});
  return surface;
}

Box box_of(const Surface& surface) {
  if (surface.empty()) return {};
  Box box{surface[0][0], surface[0][0]};
  for (const Triangle& t : surface)
    for (const Point& p : t) {
      box.lo = {std::min(box.lo.x, p.x), std::min(box.lo.y, p.y), std::min(box.lo.z, p.z)};
      box.hi = {std::max(box.hi.x, p.x), std::max(box.hi.y, p.y), std::max(box.hi.z, p.z)};
    }
  return box;
}

bool is_closed(const Surface& surface) {
  std::map<std::pair<Place, Place>, int> balance;
  for (const Triangle& t : surface)
    for (std::size_t k = 0; k < 3; ++k) {
      const Place a = place(t[k]);
      const Place b = place(t[(k + 1) % 3]);
      if (a < b) ++balance[{a, b}];
      if (b < a) --balance[{b, a}];
    }
  return std::all_of(balance.begin(), balance.end(), [](const auto& edge) { return edge.second == 0; });
}

std::vector<Surface> parts_of(const Surface& surface) {
  std::vector<std::size_t> parent(surface.size());
  for (std::size_t t = 0; t < parent.size(); ++t) parent[t] = t;
  const auto root = [&](std::size_t t) {
    while (parent[t] != t) t = parent[t] = parent[parent[t]];
    return t;
  };
  std::map<Place, std::size_t> first;
  for (std::size_t t = 0; t < surface.size(); ++t)
    for (const Point& p : surface[t]) {
      const auto [it, added] = first.try_emplace(place(p), t);
      if (!added) parent[root(t)] = root(it->second);
    }
  std::map<std::size_t, Surface> parts;
  for (std::size_t t = 0; t < surface.size(); ++t) parts[root(t)].push_back(surface[t]);
  std::vector<Surface> result;
  for (auto& [r, part] : parts) result.push_back(std::move(part));
  return result;
}

Moments moments(const Surface& surface, const Point& about) {
  Moments sum{};
  for (const Triangle& t : surface) {
    const Point p[4] = {{}, t[0] - about, t[1] - about, t[2] - about};
    const Real v = dot(p[1], cross(p[2], p[3])) / 6;
    // The exact mean of a product of two linear functions over a tetrahedron: (sum of products + product of sums) / 20.
    const auto mean = [&](Real Point::*f, Real Point::*g) {
      Real both = 0;
      Real fs = 0;
      Real gs = 0;
      for (const Point& q : p) {
        both += q.*f * (q.*g);
        fs += q.*f;
        gs += q.*g;
      }
      return (both + fs * gs) / 20;
    };
    const Point middle = 0.25L * (p[1] + p[2] + p[3]);
    const Moments of_one = {1,
                            middle.x,
                            middle.y,
                            middle.z,
                            mean(&Point::x, &Point::x),
                            mean(&Point::y, &Point::y),
                            mean(&Point::z, &Point::z),
                            mean(&Point::x, &Point::y),
                            mean(&Point::y, &Point::z),
                            mean(&Point::x, &Point::z)};
    for (std::size_t k = 0; k < sum.size(); ++k) sum[k] += v * of_one[k];
  }
  return sum;
}

Real volume(const Surface& surface) { return moments(surface, box_of(surface).lo)[0]; }

Body body_of(const Surface& surface) {
  const Point about = box_of(surface).lo;
  const Moments s = moments(surface, about);
  Body body;
  body.volume = s[0];
  const Point c = (1 / s[0]) * Point{s[1], s[2], s[3]};
  body.centre = about + c;
  const Real xx = s[4] - s[0] * c.x * c.x;
  const Real yy = s[5] - s[0] * c.y * c.y;
  const Real zz = s[6] - s[0] * c.z * c.z;
  const Real xy = s[7] - s[0] * c.x * c.y;
  const Real yz = s[8] - s[0] * c.y * c.z;
  const Real xz = s[9] - s[0] * c.x * c.z;
  body.inertia = {{{yy + zz, -xy, -xz}, {-xy, xx + zz, -yz}, {-xz, -yz, xx + yy}}};
  return body;
}

Real winding(const Surface& surface, const Point& p) {
  Real angle = 0;
  for (const Triangle& t : surface) {
    const Point a = t[0] - p;
    const Point b = t[1] - p;
    const Point c = t[2] - p;
    const Real la = norm(a);
    const Real lb = norm(b);
    const Real lc = norm(c);
    angle += 2 * std::atan2(dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
  }
  return angle / (4 * std::numbers::pi_v<Real>);
}

Real distance(const Point& p, const Triangle& t) {
  Real nearest = std::min({distance(p, t[0], t[1]), distance(p, t[1], t[2]), distance(p, t[2], t[0])});
  const Point n = cross(t[1] - t[0], t[2] - t[0]);
  const Real n2 = dot(n, n);
  if (n2 > 0) {
    const Point foot = p - (dot(p - t[0], n) / n2) * n;
    bool inside = true;
    for (std::size_t k = 0; k < 3; ++k) inside = inside && dot(cross(t[(k + 1) % 3] - t[k], foot - t[k]), n) >= 0;
    if (inside) nearest = std::min(nearest, norm(p - foot));
  }
  return nearest;
}

Real distance(const Triangle& a, const Triangle& b) {
  Real nearest = distance(a[0], b);
  for (std::size_t k = 0; k < 3; ++k) {
    nearest = std::min({nearest, distance(a[k], b), distance(b[k], a)});
    for (std::size_t l = 0; l < 3; ++l) nearest = std::min(nearest, distance(a[k], a[(k + 1) % 3], b[l], b[(l + 1) % 3]));
  }
  return nearest;
}

bool surely_cross(const Triangle& a, const Triangle& b) {
  for (std::size_t k = 0; k < 3; ++k)
    if (surely_pierces(a[k], a[(k + 1) % 3], b) || surely_pierces(b[k], b[(k + 1) % 3], a)) return true;
  return false;
}

Frame frame_along(const Point& direction) {
  Frame frame;
  frame.z = (1 / norm(direction)) * direction;
  const Point other = std::abs(frame.z.x) < 0.6L ? Point{1, 0, 0} : Point{0, 1, 0};
  const Point across = cross(frame.z, other);
  frame.x = (1 / norm(across)) * across;
  frame.y = cross(frame.z, frame.x);
  return frame;
}

Wet wet_part(const Surface& hull, const Point& n, Real offset) {
  const Frame frame = frame_along(n);
  const Box box = box_of(hull);
  const Point middle = 0.5L * (box.lo + box.hi);
  const Point origin = middle + (offset - dot(middle, frame.z)) * frame.z;  // on the plane: the waterplane is a base of no height
  Surface wet;
  Real area = 0;
  Real first[2] = {};
  Real second[3] = {};
  for (const Triangle& t : hull) {
    std::vector<Point> corners;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto local = [&](const Point& p) {
        const Point d = p - origin;
        return Point{dot(d, frame.x), dot(d, frame.y), dot(d, frame.z)};
      };
      const Point a = local(t[k]);
      const Point b = local(t[(k + 1) % 3]);
      if (a.z <= 0) corners.push_back(a);
      if ((a.z < 0 && b.z > 0) || (a.z > 0 && b.z < 0)) {
        Point cut = a + (a.z / (a.z - b.z)) * (b - a);
        cut.z = 0;
        corners.push_back(cut);
      }
    }
    for (std::size_t k = 2; k < corners.size(); ++k) {
      const Point& a = corners[0];
      const Point& b = corners[k - 1];
      const Point& c = corners[k];
      wet.push_back({a, b, c});
      // A closed surface has as much area seen from above as from below: the waterplane is what the wet one lacks.
      const Real w = -((b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x)) / 2;
      const Real sx = a.x + b.x + c.x;
      const Real sy = a.y + b.y + c.y;
      area += w;
      first[0] += w * sx / 3;
      first[1] += w * sy / 3;
      second[0] += w * (a.x * a.x + b.x * b.x + c.x * c.x + sx * sx) / 12;
      second[1] += w * (a.x * a.y + b.x * b.y + c.x * c.y + sx * sy) / 12;
      second[2] += w * (a.y * a.y + b.y * b.y + c.y * c.y + sy * sy) / 12;
    }
  }
  Wet result;
  const Moments s = moments(wet, {});
  result.volume = s[0];
  if (s[0] != 0) result.centre = origin + (s[1] / s[0]) * frame.x + (s[2] / s[0]) * frame.y + (s[3] / s[0]) * frame.z;
  if (area > 0) {
    const Real xx = second[0] - first[0] * first[0] / area;
    const Real xy = second[1] - first[0] * first[1] / area;
    const Real yy = second[2] - first[1] * first[1] / area;
    result.smallest_second = (xx + yy) / 2 - std::hypot((xx - yy) / 2, xy);
  }
  return result;
}

Real waterline(const Surface& hull, const Point& n, Real wanted) {
  const Frame frame = frame_along(n);
  Real lo = dot(hull[0][0], frame.z);
  Real hi = lo;
  for (const Triangle& t : hull)
    for (const Point& p : t) {
      lo = std::min(lo, dot(p, frame.z));
      hi = std::max(hi, dot(p, frame.z));
    }
  for (int step = 0; step < 60; ++step) {
    const Real middle = (lo + hi) / 2;
    (wet_part(hull, n, middle).volume < wanted ? lo : hi) = middle;
  }
  return (lo + hi) / 2;
}

}  // namespace plain
