#include <algorithm>
#include <cmath>

#include "rayrep/physics/support_polygon.h"
#include "rayrep/solve/goals.h"
#include "shape/wish.h"

namespace rayrep::detail {

double smooth_step(double t) {
  t = std::clamp(t, 0.0, 1.0);
  return t * t * t * (10 - 15 * t + 6 * t * t);
}

namespace {

/// A place on the surface, by its triangle.
struct Anchor {
  Eigen::Vector3i corners;
  Eigen::Vector3d weights;

  Eigen::Vector3d at(const Mesh& mesh) const {
    Eigen::Vector3d p = Eigen::Vector3d::Zero();
    for (int k = 0; k < 3; ++k) p += weights[k] * mesh.vertices[static_cast<std::size_t>(corners[k])];
    return p;
  }
  void add(const Eigen::Vector3d& change, VertexGradient& gradient) const {
    for (int k = 0; k < 3; ++k) gradient[static_cast<std::size_t>(corners[k])] += weights[k] * change;
  }
};

/// The centre of mass far enough inside the support polygon, theory.md (62a), and above a target that was named. The corners of the
/// polygon are followed as points of the surface, which stay at their height.
class StandWisher final : public Wisher {
public:
  StandWisher(const StandSpec& spec, double margin, const Body& first)
      : slope_(margin),
        tolerance_mm_(spec.contact_tolerance_mm.value_or(contact_tolerance_mm(first.height_mm))),
        volume_mm3_(first.solid[M1]),
        length_mm_(first.diagonal_mm) {
    if (spec.target_mm) target_ = (first.to_working * *spec.target_mm).head<2>();
    const SupportPolygon polygon = support_polygon(first.hull, tolerance_mm_);
    ground_mm_ = polygon.ground_mm;
    if (polygon.corners_mm.size() < 3) return;
    for (const Eigen::Vector2d& corner : polygon.corners_mm) corners_.push_back(anchor(first, corner));
  }

  Wish wish(const Body& body) const override {
    const std::size_t edges = corners_.size();
    std::vector<Eigen::Vector2d> corners;
    for (const Anchor& one : corners_) corners.push_back(one.at(body.working).head<2>());
    Wish wish;
    wish.wanted.equations = target_ ? 2 : 0;
    const auto rows = wish.wanted.equations + static_cast<Eigen::Index>(edges);
    wish.wanted.rows = Eigen::Matrix<double, Eigen::Dynamic, 10>::Zero(rows, 10);
    wish.wanted.offset = Eigen::VectorXd::Zero(rows);
    if (target_) wish.wanted.rows.topRows<2>() = stand_goal(*target_, volume_mm3_, length_mm_).J;
    const double unit = 1 / (volume_mm3_ * length_mm_);
    for (std::size_t k = 0; k < edges; ++k) {
      const Eigen::Vector2d along = (corners[(k + 1) % edges] - corners[k]).normalized();
      const Eigen::Vector2d inward(-along.y(), along.x());
      Moments row = Moments::Zero();
      row[MZ] = slope_;
      row.segment<2>(MX) = -inward;
      row[M1] = inward.dot(corners[k]) - slope_ * ground_mm_;
      wish.wanted.rows.row(wish.wanted.equations + static_cast<Eigen::Index>(k)) = unit * row.transpose();
    }
    wish.add_explicit = [this, corners, unit, first = wish.wanted.equations](const Moments&, const Eigen::VectorXd& normal,
                                                                             const Moments& s, VertexGradient& gradient) {
      const Eigen::Vector2d centre = s.segment<2>(MX) / s[M1];
      for (std::size_t k = 0; k < corners.size(); ++k) {
        const double factor = normal[first + static_cast<Eigen::Index>(k)] * unit * s[M1];
        if (factor == 0) continue;
        const std::size_t next = (k + 1) % corners.size();
        const Eigen::Vector2d edge = corners[next] - corners[k];
        const double t = (centre - corners[k]).dot(edge) / edge.squaredNorm();
        const Eigen::Vector3d inward = Eigen::Vector3d(-edge.y(), edge.x(), 0).normalized();
        corners_[k].add((1 - t) * factor * inward, gradient);
        corners_[next].add(t * factor * inward, gradient);
      }
    };
    return wish;
  }

  void hold(const Mesh& mesh, double blend_mm, Freedom& freedom) const override {
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
      freedom.along[v] *= smooth_step((mesh.vertices[v].z() - ground_mm_ - 2 * tolerance_mm_) / blend_mm);
  }

private:
  /// The place of a polygon's corner on the surface, which is at most the tolerance above the ground there.
  Anchor anchor(const Body& body, const Eigen::Vector2d& corner) const {
    ClosestPoint best;
    best.distance_mm = std::numeric_limits<double>::infinity();
    const SurfaceQuery surface(body.working);
    for (const double height : {0.0, tolerance_mm_}) {
      const ClosestPoint at = surface.closest({corner.x(), corner.y(), ground_mm_ + height}, length_mm_);
      if (at.triangle >= 0 && at.distance_mm < best.distance_mm) best = at;
    }
    return {body.working.triangles[static_cast<std::size_t>(best.triangle)],
            corner_weights(body.working, best.triangle, best.point_mm)};
  }

  double slope_;
  double tolerance_mm_;
  double volume_mm3_;
  double length_mm_;
  double ground_mm_ = 0;
  std::optional<Eigen::Vector2d> target_;
  std::vector<Anchor> corners_;
};

}  // namespace

std::unique_ptr<Wisher> wisher(const StandSpec& spec, double margin, const Body& first) {
  return std::make_unique<StandWisher>(spec, margin, first);
}

}  // namespace rayrep::detail
