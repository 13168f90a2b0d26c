#pragma once

// What a body is, worked out once more from its triangles in plain long double, by other routes than the library's: pyramids over
// clipped polygons, solid angles, every pair of triangles. Slow, for small meshes. It uses nothing of the library but `Mesh`.

#include <array>
#include <cstddef>
#include <vector>

#include "rayrep/mesh/mesh.h"

namespace plain {

using Real = long double;

struct Point {
  Real x = 0, y = 0, z = 0;
};
inline Point operator+(const Point& a, const Point& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Point operator-(const Point& a, const Point& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Point operator*(Real s, const Point& a) { return {s * a.x, s * a.y, s * a.z}; }
inline Real dot(const Point& a, const Point& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Point cross(const Point& a, const Point& b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
Real norm(const Point& a);
Point point(const Eigen::Vector3d& v);

using Triangle = std::array<Point, 3>;
using Surface = std::vector<Triangle>;

Surface surface_of(const rayrep::Mesh& mesh);

struct Box {
  Point lo, hi;
  Real diagonal() const { return norm(hi - lo); }
};
Box box_of(const Surface& surface);

/// Whether each edge, as a pair of places, is run equally often both ways.
bool is_closed(const Surface& surface);

/// Parts that hang together over places.
std::vector<Surface> parts_of(const Surface& surface);

/// Integrals over the enclosed volume about the place `about`: 1, x, y, z, xx, yy, zz, xy, yz, xz.
using Moments = std::array<Real, 10>;
Moments moments(const Surface& surface, const Point& about);
Real volume(const Surface& surface);

/// Mass over density, centre and inertia over density about the centre.
struct Body {
  Real volume = 0;
  Point centre;
  std::array<std::array<Real, 3>, 3> inertia{};
};
Body body_of(const Surface& surface);

/// The winding number, by solid angles; not a whole number where p lies on the surface.
Real winding(const Surface& surface, const Point& p);

Real distance(const Point& p, const Triangle& triangle);
/// Of two triangles that do not cross.
Real distance(const Triangle& a, const Triangle& b);
/// True only if an edge of one surely goes through the inside of the other, with room for rounding.
bool surely_cross(const Triangle& a, const Triangle& b);

/// What is below the plane n . p = offset: of a closed surface without pockets.
struct Wet {
  Real volume = 0;
  Point centre;              ///< of buoyancy
  Real smallest_second = 0;  ///< second moment of the waterplane
};
Wet wet_part(const Surface& hull, const Point& n, Real offset);

/// The offset at which `volume` is below the plane, by bisection.
Real waterline(const Surface& hull, const Point& n, Real volume);

/// A unit vector and two across it.
struct Frame {
  Point x, y, z;
};
Frame frame_along(const Point& direction);

}  // namespace plain
