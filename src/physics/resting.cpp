#include "rayrep/physics/resting.h"

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

namespace rayrep {
namespace {

using Eigen::Vector3d;

constexpr int kMostRolls = 1000;
constexpr double kRounding = 1e-12;  ///< of the size

class Roller {
public:
  Roller(const std::vector<Vector3d>& points, const Vector3d& centre, const Vector3d& up)
      : points_(points), centre_(centre), up_(up.normalized()) {
    double largest = 0;
    for (const Vector3d& p : points) largest = std::max(largest, (p - centre).norm());
    rounding_ = kRounding * largest;
  }

  std::optional<Vector3d> run() {
    if (points_.empty()) return std::nullopt;
    std::size_t a = lowest();
    for (int n = 0; n < kMostRolls; ++n) {
      const std::optional<std::size_t> b = roll_about(a, level(centre_ - points_[a]), {a, a});
      if (!b) return std::nullopt;
      // Over edges, until it rests or rolls on over one point alone.
      std::optional<std::size_t> pivot = over_edges(a, *b);
      if (rests_) return up_;
      if (!pivot) return std::nullopt;
      a = *pivot;
    }
    return std::nullopt;
  }

private:
  struct Ends {
    std::size_t a, b;
  };

  std::size_t lowest() const {
    std::size_t best = 0;
    for (std::size_t n = 1; n < points_.size(); ++n)
      if (up_.dot(points_[n] - points_[best]) < 0) best = n;
    return best;
  }

  Vector3d level(const Vector3d& v) const { return v - up_.dot(v) * up_; }

  /// Turns it about what touches, so that what lies in the direction `towards` comes down, until another point does.
  /// @return that point; of several the farthest; none if nothing lies that way
  std::optional<std::size_t> roll_about(std::size_t a, const Vector3d& towards, const Ends& but) {
    const double far = towards.norm();
    if (!(far > rounding_)) return std::nullopt;
    const Vector3d d = towards / far;
    double least = std::numeric_limits<double>::infinity();
    double reach = 0;
    std::optional<std::size_t> next;
    for (std::size_t n = 0; n < points_.size(); ++n) {
      const Vector3d p = points_[n] - points_[a];
      const double ahead = d.dot(p);
      if (n == but.a || n == but.b || !(ahead > rounding_)) continue;
      const double angle = std::atan2(std::max(0.0, up_.dot(p)), ahead);
      if (angle < least - kRounding || (angle <= least + kRounding && ahead > reach)) {
        least = std::min(least, angle);
        reach = ahead;
        next = n;
      }
    }
    if (next) up_ = (std::cos(least) * up_ - std::sin(least) * d).normalized();
    return next;
  }

  /// Rolls over the edge a-b, and over those of the faces that come. @return the end of an edge over which it rolls on
  std::optional<std::size_t> over_edges(std::size_t a, std::size_t b) {
    for (int n = 0; n < kMostRolls; ++n) {
      const Vector3d edge = level(points_[b] - points_[a]).normalized();
      const Vector3d foot = level(centre_ - points_[a]);
      const double along = edge.dot(foot);
      if (along <= 0) return a;
      if (along >= edge.dot(points_[b] - points_[a])) return b;
      const std::optional<std::size_t> c = roll_about(a, foot - along * edge, {a, b});
      if (!c) return std::nullopt;
      if (!beyond_face(a, b, *c)) {
        rests_ = true;
        return std::nullopt;
      }
    }
    return std::nullopt;
  }

  /// Whether the foot of the centre lies beyond an edge of the face a-b-c that is not a-b; a and b become its ends.
  bool beyond_face(std::size_t& a, std::size_t& b, std::size_t c) const {
    double worst = rounding_;
    const Ends ends{a, b};
    for (const auto& [from, to, inside] : {Side{ends.a, c, ends.b}, Side{c, ends.b, ends.a}}) {
      const Vector3d edge = level(points_[to] - points_[from]);
      const Vector3d across = up_.cross(edge).normalized();
      const double side = across.dot(points_[inside] - points_[from]) > 0 ? 1 : -1;
      const double beside = -side * across.dot(centre_ - points_[from]);
      if (!(beside > worst)) continue;
      worst = beside;
      a = from;
      b = to;
    }
    return worst > rounding_;
  }
  struct Side {
    std::size_t from, to, inside;
  };

  const std::vector<Vector3d>& points_;
  const Vector3d& centre_;
  Vector3d up_;
  double rounding_ = 0;
  bool rests_ = false;
};

}  // namespace

std::optional<Vector3d> rest_attitude(const std::vector<Vector3d>& points, const Vector3d& centre_of_mass_mm, const Vector3d& up) {
  return Roller(points, centre_of_mass_mm, up).run();
}

}  // namespace rayrep
