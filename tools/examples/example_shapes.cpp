#include "example_shapes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "rayrep/mesh/level_set.h"

namespace rayrep {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kDegree = 3.14159265358979323846 / 180;

// ---- Solids as fields: negative inside, exact or first-order distances (mm). ----

double sphere(const Vector3d& p, const Vector3d& centre, double radius) { return (p - centre).norm() - radius; }

/// Ellipsoid about the origin with axes along x, y, z: g / |grad g| for g = |p / r| - 1.
double ellipsoid(const Vector3d& p, const Vector3d& radii) {
  const double x = p.x() / radii.x();
  const double y = p.y() / radii.y();
  const double z = p.z() / radii.z();
  const double gx = x / radii.x();
  const double gy = y / radii.y();
  const double gz = z / radii.z();
  const double k = std::sqrt(x * x + y * y + z * z);
  const double gradient = std::sqrt(gx * gx + gy * gy + gz * gz);
  return gradient > 1e-9 ? k * (k - 1) / gradient : -radii.minCoeff();
}

/// The distance to a segment is the least of |p - point(t)| - radius(t): a round-ended cone, to first order in its taper.
double round_cone(const Vector3d& p, const Vector3d& a, double radius_a, const Vector3d& b, double radius_b) {
  const Vector3d ab = b - a;
  const double t = std::clamp((p - a).dot(ab) / ab.squaredNorm(), 0.0, 1.0);
  return (p - a - t * ab).norm() - (radius_a + t * (radius_b - radius_a));
}

double torus(const Vector3d& p, const Vector3d& centre, double major, double minor) {
  const Vector3d q = p - centre;
  return Vector2d(q.head<2>().norm() - major, q.z()).norm() - minor;
}

/// A round tube along a cubic Bezier curve, as a chain of round cones; its radius goes linearly with the curve's parameter.
class Tube {
public:
  Tube(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d, double radius_a, double radius_d)
      : ball_centre_(0.5 * (a + d)) {
    const auto curve = [&](double t) {
      const double s = 1 - t;
      return Vector3d(s * s * s * a + 3 * s * s * t * b + 3 * s * t * t * c + t * t * t * d);
    };
    for (int i = 0; i < kPieces; ++i) {
      const double t = static_cast<double>(i) / kPieces;
      const Vector3d start = curve(t);
      const Vector3d along = curve(static_cast<double>(i + 1) / kPieces) - start;
      pieces_.push_back({start.x(), start.y(), start.z(), along.x(), along.y(), along.z(), 1 / along.squaredNorm(),
                         radius_a + t * (radius_d - radius_a), (radius_d - radius_a) / kPieces});
      ball_radius_ = std::max(ball_radius_, (start - ball_centre_).norm() + std::max(radius_a, radius_d));
    }
  }

  double operator()(const Vector3d& p) const {
    // Far away a lower bound will do: no blend is as wide as that.
    const double to_ball = (p - ball_centre_).norm() - ball_radius_;
    if (to_ball > kFar) return to_ball;
    // Plain numbers: an unoptimised build would spend minutes in Eigen here.
    const double x = p.x();
    const double y = p.y();
    const double z = p.z();
    double least = std::numeric_limits<double>::infinity();
    for (const Piece& k : pieces_) {
      double t = ((x - k.x) * k.dx + (y - k.y) * k.dy + (z - k.z) * k.dz) * k.inverse;
      t = t < 0 ? 0 : t > 1 ? 1 : t;
      const double ex = x - k.x - t * k.dx;
      const double ey = y - k.y - t * k.dy;
      const double ez = z - k.z - t * k.dz;
      const double distance = std::sqrt(ex * ex + ey * ey + ez * ez) - (k.radius + t * k.dradius);
      if (distance < least) least = distance;
    }
    return least;
  }

private:
  struct Piece {
    double x, y, z;     // start
    double dx, dy, dz;  // to its end
    double inverse;     // 1 / |d|^2
    double radius, dradius;
  };
  static constexpr int kPieces = 32;
  static constexpr double kFar = 15;
  std::vector<Piece> pieces_;
  Vector3d ball_centre_;
  double ball_radius_ = 0;
};

/// A solid of revolution about z. Its profile is a Catmull-Rom curve through points (distance from the axis, z), from bottom to
/// top; the first and the last lie on the axis.
class Revolution {
public:
  explicit Revolution(const std::vector<Vector2d>& through) {
    // The curve leaves the axis at a right angle: its neighbour beyond an end is the mirror image of the one before it.
    std::vector<Vector2d> p = through;
    p.insert(p.begin(), Vector2d(-through[1].x(), through[1].y()));
    p.push_back(Vector2d(-through[through.size() - 2].x(), through[through.size() - 2].y()));
    std::vector<Vector2d> profile;
    for (std::size_t i = 1; i + 2 < p.size(); ++i)
      for (int k = 0; k < kPieces; ++k) {
        const double t = static_cast<double>(k) / kPieces;
        profile.push_back(0.5 *
                          (2 * p[i] + t * (p[i + 1] - p[i - 1]) + t * t * (2 * p[i - 1] - 5 * p[i] + 4 * p[i + 1] - p[i + 2]) +
                           t * t * t * (3 * p[i] - p[i - 1] - 3 * p[i + 1] + p[i + 2])));
      }
    profile.push_back(through.back());
    for (std::size_t i = 0; i + 1 < profile.size(); ++i) {
      const Vector2d along = profile[i + 1] - profile[i];
      pieces_.push_back({profile[i].x(), profile[i].y(), along.x(), along.y(), 1 / along.squaredNorm(), profile[i + 1].y()});
    }
  }

  double operator()(const Vector3d& p) const {
    const double r = p.head<2>().norm();
    const double z = p.z();
    double least = std::numeric_limits<double>::infinity();
    bool inside = false;
    for (const Piece& k : pieces_) {
      double t = ((r - k.r) * k.dr + (z - k.z) * k.dz) * k.inverse;
      t = t < 0 ? 0 : t > 1 ? 1 : t;
      const double er = r - k.r - t * k.dr;
      const double ez = z - k.z - t * k.dz;
      const double square = er * er + ez * ez;
      if (square < least) least = square;
      // Crossings of the horizontal line from p outwards; the axis closes the profile and is never crossed.
      if ((k.z > z) != (k.z_end > z) && k.r + (z - k.z) / k.dz * k.dr > r) inside = !inside;
    }
    return inside ? -std::sqrt(least) : std::sqrt(least);
  }

private:
  struct Piece {
    double r, z;     // start
    double dr, dz;   // to its end
    double inverse;  // 1 / |d|^2
    double z_end;
  };
  static constexpr int kPieces = 8;
  std::vector<Piece> pieces_;
};

// ---- Ways to join and place them. ----

/// Union whose seam is rounded where |a - b| < width: twice differentiable, never larger than min(a, b).
double blend(double a, double b, double width) {
  const double h = std::max(width - std::abs(a - b), 0.0) / width;
  return std::min(a, b) - h * h * h * width / 6;
}

/// Intersection with a rounded edge.
double blend_cut(double a, double b, double width) { return -blend(-a, -b, width); }

/// A frame at `centre`, turned by yaw about z, then by pitch about its own y (positive: nose down), then by roll about its x
/// (degrees).
class Frame {
public:
  Frame(const Vector3d& centre, double yaw, double pitch, double roll) : centre_(centre) {
    const Eigen::AngleAxisd about_z(yaw * kDegree, Vector3d::UnitZ());
    const Eigen::AngleAxisd about_y(pitch * kDegree, Vector3d::UnitY());
    const Eigen::AngleAxisd about_x(roll * kDegree, Vector3d::UnitX());
    back_ = (about_z * about_y * about_x).toRotationMatrix().transpose();
  }

  /// p in the frame's own coordinates.
  Vector3d operator()(const Vector3d& p) const { return back_ * (p - centre_); }

private:
  Vector3d centre_;
  Eigen::Matrix3d back_;
};

/// Mirror images on both sides of the xz plane: the field of the side y >= 0 is enough.
Vector3d mirrored(const Vector3d& p) { return Vector3d(p.x(), std::abs(p.y()), p.z()); }

// ---- The shapes. ----

/// A rubber duck, looking along x.
ExampleShape duck() {
  const Tube tail({-20, 0, 21}, {-32, 0, 23}, {-37, 0, 31}, {-41, 0, 42}, 14, 3.4);
  const Frame wing({-8, 23.5, 23}, 8, 12, 20);
  const Frame wing_tip({-21, 20.5, 28}, 18, 32, 20);
  const Frame upper_bill({31, 0, 49.5}, 0, -12, 0);
  const Frame lower_bill({29, 0, 46}, 0, 2, 0);
  const auto field = [=](const Vector3d& p) {
    const Vector3d q = mirrored(p);
    // The tail is 1.5 times as wide as it is thick.
    double f = blend(ellipsoid(p - Vector3d(-3, 0, 18), {36, 28, 21}), tail({p.x(), p.y() / 1.5, p.z()}), 10);
    f = blend(f, blend(ellipsoid(wing(q), {16, 5.5, 9.5}), ellipsoid(wing_tip(q), {9, 4.5, 5}), 6), 4);
    f = blend(f, ellipsoid(p - Vector3d(14, 0, 51), {17.5, 17, 16.5}), 14);
    f = blend(f, blend(ellipsoid(upper_bill(p), {11.5, 10, 3.8}), ellipsoid(lower_bill(p), {9.5, 7.5, 3.6}), 3), 4);
    f = blend(f, sphere(q, {25, 8.3, 57}, 3.7), 1.2);
    return blend_cut(f, -p.z(), 3);
  };
  return {"duck", field, {Vector3d(-54, -40, -4), Vector3d(54, 40, 80)}, 1.5};
}

/// A bird on the wing, looking along x, with a tip under its belly to spin on.
ExampleShape bird() {
  const Frame body({0, 0, 18}, 0, -3, 0);
  const Frame wing({1, 19, 24}, 6, 0, 10);
  const Frame wing_tip({-4, 35.5, 27.5}, 24, 0, 14);
  const Frame tail({-29, 0, 20.5}, 0, 8, 0);
  const Frame side_tail({-28, 5.5, 20.5}, -22, 8, 0);
  const auto field = [=](const Vector3d& p) {
    const Vector3d q = mirrored(p);
    double f = blend(ellipsoid(body(p), {25, 12, 11.5}), sphere(p, {22.5, 0, 25}, 9.5), 12);
    f = blend(f, blend(ellipsoid(wing(q), {14, 18, 4.8}), ellipsoid(wing_tip(q), {9, 15, 4}), 7), 6);
    f = blend(f, blend(ellipsoid(tail(p), {14, 5, 3.6}), ellipsoid(side_tail(q), {13, 4.5, 3.6}), 3), 7);
    f = blend(f, round_cone(p, {29.5, 0, 24}, 4.2, {39, 0, 21.5}, 1.7), 3);
    f = blend(f, sphere(q, {26.9, 6.2, 28}, 2.6), 1.5);
    return blend(f, round_cone(p, {0, 0, 9}, 5, {0, 0, 2.2}, 2.2), 5);
  };
  return {"bird", field, {Vector3d(-54, -60, -4), Vector3d(50, 60, 50)}, 1.13};
}

/// Three spheres in the yz plane, run together where they touch.
ExampleShape three_spheres() {
  const auto field = [](const Vector3d& p) {
    const double f = blend(sphere(p, {0, -22, 25}, 25), sphere(p, {0, 22.5, 31}, 22.5), 14);
    return blend(f, sphere(p, {0, -10, 67}, 19.5), 11);
  };
  return {"three_spheres", field, {Vector3d(-30, -55, -4), Vector3d(30, 55, 95)}, 1.7};
}

/// An ellipsoid whose longest and shortest axes are turned by 15 degrees about y, on a tip below its centre.
ExampleShape tilted_ellipsoid() {
  const Frame body({0, 0, 30}, 0, 15, 0);
  const auto field = [=](const Vector3d& p) {
    return blend(ellipsoid(body(p), {44, 36, 22}), round_cone(p, {0, 0, 12}, 7, {0, 0, 2.5}, 2.5), 7);
  };
  return {"tilted_ellipsoid", field, {Vector3d(-52, -45, -4), Vector3d(52, 45, 65)}, 1.5};
}

/// A plump ellipsoid, nearly round about its longest axis, which is turned by 8 degrees about y; on a small tip below its centre.
ExampleShape plump_ellipsoid() {
  const Frame body({0, 0, 21.1}, 0, 8, 0);
  const auto field = [=](const Vector3d& p) {
    return blend(ellipsoid(body(p), {32.1, 20.8, 19.4}), round_cone(p, {0, 0, 6}, 4, {0, 0, 2}, 2), 3);
  };
  return {"ellipsoid", field, {Vector3d(-36, -25, -4), Vector3d(36, 25, 46)}, 1.07};
}

/// A plump bird at rest with its wings folded, looking along x, with a small tip under its belly to spin on.
ExampleShape robin() {
  const Frame body({-1, 0, 23}, 0, -5, 0);
  const Frame wing({-5, 16.5, 24}, 4, 6, 6);
  const Frame tail({-22, 0, 26}, 0, 8, 0);
  const auto field = [=](const Vector3d& p) {
    const Vector3d q = mirrored(p);
    double f = blend(ellipsoid(body(p), {26, 22.6, 21.4}), sphere(p, {13.5, 0, 33.8}, 14), 10);
    f = blend(f, ellipsoid(wing(q), {20, 7.5, 14}), 3);
    f = blend(f, ellipsoid(tail(p), {11.5, 11, 4}), 5);
    f = blend(f, round_cone(p, {25.5, 0, 33}, 3.4, {31, 0, 31.7}, 1.3), 2);
    f = blend(f, sphere(q, {21.6, 8.6, 38}, 2.7), 1);
    return blend(f, round_cone(p, {0, 0, 6}, 4, {0, 0, 2}, 2), 3);
  };
  return {"robin", field, {Vector3d(-40, -28, -4), Vector3d(40, 28, 52)}, 1.13};
}

/// A wrestler in a squat with raised arms, looking along x, on a tip between the feet: so tall for its girth that no cavity makes
/// it a top, a heavy core does.
ExampleShape sumo() {
  const Frame foot({7, 29, 7}, 0, 0, 0);
  const auto field = [=](const Vector3d& p) {
    const Vector3d q = mirrored(p);
    double f = blend(ellipsoid(p - Vector3d(3, 0, 33), {25, 27, 21}), ellipsoid(p - Vector3d(0, 0, 51), {17, 23, 15}), 14);
    f = blend(f, round_cone(q, {2, 15, 24}, 12, {4, 28, 13}, 8.5), 8);
    f = blend(f, ellipsoid(foot(q), {12, 7, 5}), 6);
    f = blend(f, round_cone(q, {0, 21, 56}, 8, {5, 35, 66}, 6), 6);
    f = blend(f, round_cone(q, {5, 35, 66}, 6, {9, 33, 79}, 5), 3);
    f = blend(f, sphere(p, {4, 0, 74}, 13), 6);
    f = blend(f, ellipsoid(p - Vector3d(-2, 0, 88), {6, 4, 4}), 3);
    return blend(f, round_cone(p, {0, 0, 11}, 7, {0, 0, 2}, 2), 5);
  };
  return {"sumo", field, {Vector3d(-40, -55, -4), Vector3d(45, 55, 98)}, 1.6};
}

/// Two dancers who hold hands and lean apart, the heavier one much farther, with their feet close together: no cavity makes them
/// stand.
ExampleShape couple() {
  const auto field = [](const Vector3d& p) {
    const Vector3d q = mirrored(p);
    double heavy = round_cone(p, {-22, 0, 33}, 7, {-43, 0, 50}, 8);
    heavy = blend(heavy, round_cone(q, {5, 6, 5}, 3.2, {-20, 4.5, 31}, 5), 5);
    heavy = blend(heavy, ellipsoid(q - Vector3d(7, 6, 2), {6, 3.6, 4.5}), 3);
    heavy = blend(heavy, round_cone(p, {-44, 0, 52}, 4.5, {-51, 0, 62}, 4), 4);
    heavy = blend(heavy, sphere(p, {-53, 0, 66}, 7.5), 3);
    heavy = blend(heavy, round_cone(q, {-41, 7, 53}, 3.4, {-2, 6, 55}, 2.6), 4);
    double light = round_cone(p, {22, 0, 33}, 5, {25, 0, 52}, 5.5);
    light = blend(light, round_cone(q, {20, 5.5, 4}, 2.8, {21.5, 3.6, 31}, 3.8), 4);
    light = blend(light, ellipsoid(q - Vector3d(20, 5.5, 2), {5.5, 3.2, 4.5}), 3);
    light = blend(light, round_cone(p, {25, 0, 54}, 3.6, {26, 0, 63}, 3.2), 4);
    light = blend(light, sphere(p, {26.5, 0, 67}, 6), 3);
    light = blend(light, round_cone(q, {24, 5, 53.5}, 2.8, {-2, 6, 55}, 2.6), 3);
    return blend_cut(blend(heavy, light, 2), -p.z(), 0.5);
  };
  return {"couple", field, {Vector3d(-72, -28, -4), Vector3d(40, 28, 90)}, 1.3};
}

/// A die of 60 mm with rounded edges and pips cut in, 1 above 6, 2 before 5, 3 beside 4: its centre of mass is off its middle.
ExampleShape die() {
  const auto field = [](const Vector3d& p) {
    constexpr double half = 30;
    constexpr double rounding = 6;
    constexpr double apart = 14;
    const Vector3d q = p.cwiseAbs() - Vector3d::Constant(half - rounding);
    double solid = q.cwiseMax(0).norm() + std::min(q.maxCoeff(), 0.0) - rounding;
    // Of the side that the point is nearest to, which are the others too far from to matter.
    int axis = 0;
    p.cwiseAbs().maxCoeff(&axis);
    const int pips = (axis == 2 ? 1 : axis == 1 ? 3 : 2);
    const int count = p[axis] > 0 ? pips : 7 - pips;
    const auto cut = [&](int u, int v) {
      Vector3d centre = Vector3d::Zero();
      centre[axis] = std::copysign(half + 2.5, p[axis]);
      centre[(axis + 1) % 3] = apart * u;
      centre[(axis + 2) % 3] = apart * v;
      solid = blend_cut(solid, -sphere(p, centre, 6), 0.6);
    };
    if (count % 2 == 1) cut(0, 0);
    for (const int sign : {-1, 1}) {
      if (count >= 2) cut(sign, sign);
      if (count >= 4) cut(sign, -sign);
      if (count == 6) cut(sign, 0);
    }
    return solid;
  };
  return {"die", field, {Vector3d(-34, -34, -34), Vector3d(34, 34, 34)}, 1.5};
}

/// A heart in the xz plane that stands on its blunted point.
ExampleShape heart() {
  const auto field = [](const Vector3d& p) {
    // The sextic heart of G. Taubin, "Distance approximations for rasterizing implicit curves", ACM TOG 13(1), 1994,
    // (x^2 + 9/4 y^2 + z^2 - 1)^3 = (x^2 + 9/80 y^2) z^3, after a cube root; `blunt` rounds its point and its cleft. Then g / |grad
    // g|.
    const double scale = 32;
    const double blunt = 0.004;
    const double x = p.x() / scale;
    const double y = p.y() / scale;
    const double z = (p.z() - 27) / scale;
    const double w = x * x + 9.0 / 80 * y * y + blunt;
    const double root = std::cbrt(w);
    const double g = x * x + 9.0 / 4 * y * y + z * z - 1 - z * root;
    const double slope = z * root / (3 * w);
    const Vector3d gradient(2 * x * (1 - slope), 2 * y * (9.0 / 4 - 9.0 / 80 * slope), 2 * z - root);
    const double f = scale * g / std::max(gradient.norm(), 0.1);
    return blend_cut(f, -p.z(), 1.8);
  };
  return {"heart", field, {Vector3d(-50, -40, -4), Vector3d(50, 40, 85)}, 1.35};
}

/// A pot with a handle, a spout and a knob on its lid, the spout pointing along x.
ExampleShape teapot() {
  const Revolution pot({{0, 0},
                        {9, 0},
                        {16.5, 0.2},
                        {20.2, 2.4},
                        {25.5, 8},
                        {28.5, 17},
                        {25.5, 27},
                        {20.5, 35},
                        {17, 38.5},
                        {10, 41.5},
                        {4.8, 43.8},
                        {3.6, 46},
                        {5.8, 49.3},
                        {4, 52},
                        {0, 53}});
  const Tube spout({20, 0, 12}, {38, 0, 13}, {33, 0, 31}, {47, 0, 37}, 8.5, 4);
  const Tube handle({-22, 0, 32}, {-46, 0, 38}, {-49, 0, 16}, {-25, 0, 10}, 3.4, 3.4);
  const auto field = [=](const Vector3d& p) {
    double f = blend(pot(p), torus(p, {0, 0, 35}, 20, 2.4), 3);
    f = blend(f, blend_cut(spout(p), p.z() - 37.5, 2.5), 6);
    return blend(f, handle(p), 4);
  };
  return {"teapot", field, {Vector3d(-55, -40, -4), Vector3d(60, 40, 60)}, 1.35};
}

// ---- Meshing. ----

constexpr double kEvenness = 0.1;  ///< weight of a vertex where the surface is flat

/// Forward differences from the known value at p.
Vector3d gradient(const ExampleShape& shape, const Vector3d& p, double value) {
  const double step = 1e-4 * shape.spacing_mm;
  return Vector3d(shape.field(p + step * Vector3d::UnitX()) - value, shape.field(p + step * Vector3d::UnitY()) - value,
                  shape.field(p + step * Vector3d::UnitZ()) - value) /
         step;
}

/// A Newton step of every vertex towards the surface, at most half a sample long; normal[i] becomes the field's direction at vertex
/// i.
void project(const ExampleShape& shape, Mesh& mesh, std::vector<Vector3d>& normal) {
  const double limit = 0.5 * shape.spacing_mm;
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    Vector3d& p = mesh.vertices[i];
    const double value = shape.field(p);
    const Vector3d g = gradient(shape, p, value);
    const double length = g.norm();
    if (length < 1e-6) continue;
    normal[i] = g / length;
    p -= std::clamp(value / length, -limit, limit) * normal[i];
  }
}

/// Moves every vertex halfway to the weighted mean of its neighbours. The more the surface bends around a vertex the larger its
/// weight, which draws the others near: small features get the smaller triangles.
void relax(Mesh& mesh, const std::vector<Vector3d>& normal) {
  const std::size_t count = mesh.vertices.size();
  std::vector<std::vector<std::size_t>> neighbours(count);
  for (const Eigen::Vector3i& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) neighbours[static_cast<std::size_t>(t[k])].push_back(static_cast<std::size_t>(t[(k + 1) % 3]));
  std::vector<double> weight(count);
  for (std::size_t i = 0; i < count; ++i) {
    double bend = 0;
    for (const std::size_t j : neighbours[i]) bend += (normal[j] - normal[i]).norm();
    weight[i] = kEvenness + bend / static_cast<double>(neighbours[i].size());
  }
  std::vector<Vector3d> moved(count);
  for (std::size_t i = 0; i < count; ++i) {
    Vector3d sum = Vector3d::Zero();
    double total = 0;
    for (const std::size_t j : neighbours[i]) {
      sum += weight[j] * mesh.vertices[j];
      total += weight[j];
    }
    moved[i] = 0.5 * (mesh.vertices[i] + sum / total);
  }
  mesh.vertices = std::move(moved);
}

/// Cosine of the sharpest corner of a triangle (1: degenerate).
double sharpest_cosine(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const Vector3d ab = (b - a).normalized();
  const Vector3d bc = (c - b).normalized();
  const Vector3d ca = (a - c).normalized();
  return std::max({-ab.dot(ca), -ab.dot(bc), -bc.dot(ca)});
}

/// Exchanges the diagonal of two neighbouring triangles wherever the middle of the other one is nearer to the surface, so that
/// edges run along ridges and valleys and not across them. Both new triangles must face outward and have no corner sharper than 30
/// degrees.
void flip_edges(const ExampleShape& shape, Mesh& mesh) {
  using Edge = std::pair<int, int>;
  // The triangle on the left of each directed edge, in a fixed order.
  std::map<Edge, int> left;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k) left[{mesh.triangles[t][k], mesh.triangles[t][(k + 1) % 3]}] = static_cast<int>(t);
  std::vector<Edge> edges;
  for (const auto& entry : left)
    if (entry.first.first < entry.first.second) edges.push_back(entry.first);

  const auto vertex = [&mesh](int i) -> const Vector3d& { return mesh.vertices[static_cast<std::size_t>(i)]; };
  const auto opposite = [&mesh](int t, int a, int b) { return mesh.triangles[static_cast<std::size_t>(t)].sum() - a - b; };
  const auto set_triangle = [&](int t, int a, int b, int c) {
    mesh.triangles[static_cast<std::size_t>(t)] = {a, b, c};
    left[{a, b}] = left[{b, c}] = left[{c, a}] = t;
  };
  for (const auto& [a, b] : edges) {
    const int t = left.at({a, b});
    const int u = left.at({b, a});
    const int c = opposite(t, a, b);
    const int d = opposite(u, a, b);
    if (left.count({c, d}) + left.count({d, c}) > 0) continue;
    const Vector3d middle = 0.5 * (vertex(c) + vertex(d));
    const double value = shape.field(middle);
    if (std::abs(value) > 0.9 * std::abs(shape.field(0.5 * (vertex(a) + vertex(b))))) continue;
    const Vector3d outward = gradient(shape, middle, value).normalized();
    const auto good = [&](int i, int j, int k) {
      const Vector3d normal = (vertex(j) - vertex(i)).cross(vertex(k) - vertex(i)).normalized();
      return normal.dot(outward) > 0.5 && sharpest_cosine(vertex(i), vertex(j), vertex(k)) < std::cos(30 * kDegree);
    };
    if (!good(a, d, c) || !good(d, b, c)) continue;
    left.erase({a, b});
    left.erase({b, a});
    set_triangle(t, a, d, c);
    set_triangle(u, d, b, c);
  }
}

}  // namespace

std::vector<ExampleShape> example_shapes() {
  return {duck(),   bird(), three_spheres(), tilted_ellipsoid(), heart(), teapot(), plump_ellipsoid(), robin(), sumo(),
          couple(), die()};
}

Mesh mesh_example(const ExampleShape& shape) {
  // Samples on the planes of symmetry keep the mesh symmetric.
  Eigen::AlignedBox3d box = shape.box;
  for (int k = 0; k < 3; ++k) box.min()[k] = std::floor(box.min()[k] / shape.spacing_mm) * shape.spacing_mm;
  Mesh mesh = mesh_implicit(shape.field, box, shape.spacing_mm);
  std::vector<Vector3d> normal(mesh.vertices.size(), Vector3d::Zero());
  project(shape, mesh, normal);
  for (int pass = 1; pass <= 20; ++pass) {
    relax(mesh, normal);
    project(shape, mesh, normal);
    if (pass % 4 == 0) flip_edges(shape, mesh);
  }
  project(shape, mesh, normal);
  const double lowest = bounding_box(mesh).min().z();
  for (Vector3d& p : mesh.vertices) p.z() -= lowest;
  return mesh;
}

}  // namespace rayrep
