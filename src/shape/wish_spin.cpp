#include <numbers>
#include <utility>

#include "make/plan.h"
#include "rayrep/solve/goals.h"
#include "shape/wish.h"

namespace rayrep::detail {
namespace {

/// Where the spin axis goes through a body, and how that changes with each vertex.
struct Hub {
  Eigen::Vector3d at = Eigen::Vector3d::Zero();  ///< z: of a yo-yo alone
  std::function<void(const Eigen::Vector3d& per_mm, VertexGradient& gradient)> add;
};

/// A balanced axis, and a ratio of moments that is far enough from 1. theory.md (62b)
class SpinWisher final : public Wisher {
public:
  SpinWisher(const SpinSpec& spec, double margin, const Body& first, std::vector<char> outer)
      : spec_(spec),
        largest_(spec.prefer == AxisClass::largest),
        bound_(largest_ ? 1 + margin : 1 - margin),
        outer_(std::move(outer)),
        volume_mm3_(first.solid[M1]),
        length_mm_(first.diagonal_mm) {}

  Wish wish(const Body& body) const override {
    const Hub hub = hub_of(body);
    const Matrix10 to_hub = moment_map(Eigen::Affine3d(Eigen::Translation3d(-hub.at)));
    const auto adapt = [this, to_hub](const Moments& s, Wanted& wanted) {
      wanted.rows = (rows_for(s[MZ] / s[M1]) * to_hub).eval();
    };
    Wish wish;
    wish.wanted.equations = spec_.yoyo ? 5 : 4;
    wish.wanted.matrix = true;
    wish.wanted.offset = Eigen::VectorXd::Zero(wish.wanted.equations + 3);
    adapt(to_hub * body.solid, wish.wanted);
    wish.adapt = [to_hub, adapt](const Moments& s, Wanted& wanted) { adapt(to_hub * s, wanted); };
    // Moving the hub moves the body the other way.
    wish.add_explicit = [hub](const Moments& q, const Eigen::VectorXd&, const Moments& s, VertexGradient& gradient) {
      hub.add(-s[M1] * quadric_gradient(q, s.segment<3>(MX) / s[M1]), gradient);
    };
    return wish;
  }

  void hold(const Mesh& mesh, double blend_mm, Freedom& freedom) const override {
    if (spec_.yoyo || spec_.axis.through != SpinAxis::Through::lowest_point) return;
    const double lowest = bounding_box(mesh).min().z();
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
      freedom.along[v] *= smooth_step((mesh.vertices[v].z() - lowest) / blend_mm);
  }

private:
  /// With lateral moments about this height: bound times the lateral tensor J less Izz, for a largest axis, must have no positive
  /// eigenvalue. About the height of the centre of mass J is least.
  Eigen::Matrix<double, Eigen::Dynamic, 10> rows_for(double height) const {
    const Goal goal = spin_goal(weights_of(spec_), largest_, spec_.yoyo, volume_mm3_, length_mm_);
    const Eigen::Index equations = goal.constraints();
    Eigen::Matrix<double, Eigen::Dynamic, 10> rows = Eigen::Matrix<double, Eigen::Dynamic, 10>::Zero(equations + 3, 10);
    rows.topRows(equations) = goal.J;
    Moments axial = Moments::Zero();
    axial[MXX] = axial[MYY] = 1;
    Moments upright = Moments::Zero();  // (z - height)^2
    upright[MZZ] = 1;
    upright[MZ] = -2 * height;
    upright[M1] = height * height;
    rows.row(equations) = (bound_ * (Moments::Unit(MXX) + upright) - axial).transpose();
    rows.row(equations + 1) = (bound_ * (Moments::Unit(MYY) + upright) - axial).transpose();
    rows.row(equations + 2) = bound_ * std::numbers::sqrt2 * Moments::Unit(MXY).transpose();
    rows.bottomRows<3>() *= (largest_ ? 1 : -1) / (volume_mm3_ * length_mm_ * length_mm_);
    return rows;
  }

  Hub hub_of(const Body& body) const {
    const Mesh& mesh = body.working;
    if (spec_.yoyo) return spec_.centre_mm ? Hub{Eigen::Vector3d::Zero(), [](const auto&, auto&) {}} : box_centre(mesh);
    switch (spec_.axis.through) {
      case SpinAxis::Through::lowest_point:
        return lowest_point(mesh);
      case SpinAxis::Through::centre_of_mass:
        return centre_of_mass(body);
      case SpinAxis::Through::point:
      case SpinAxis::Through::best:
        break;
    }
    return {Eigen::Vector3d::Zero(), [](const auto&, auto&) {}};
  }

  static Hub lowest_point(const Mesh& mesh) {
    std::size_t lowest = 0;
    for (std::size_t v = 1; v < mesh.vertices.size(); ++v)
      if (mesh.vertices[v].z() < mesh.vertices[lowest].z()) lowest = v;
    const Eigen::Vector3d& p = mesh.vertices[lowest];
    return {{p.x(), p.y(), 0}, [lowest](const Eigen::Vector3d& per_mm, VertexGradient& gradient) {
              gradient[lowest] += Eigen::Vector3d(per_mm.x(), per_mm.y(), 0);
            }};
  }

  Hub centre_of_mass(const Body& body) const {
    const Eigen::Vector3d centre = body.solid.segment<3>(MX) / body.solid[M1];
    const double volume = body.solid[M1];
    return {{centre.x(), centre.y(), 0},
            [this, &mesh = body.working, centre, volume](const Eigen::Vector3d& per_mm, VertexGradient& gradient) {
              Moments q = Moments::Zero();
              q.segment<2>(MX) = per_mm.head<2>() / volume;
              q[M1] = -per_mm.head<2>().dot(centre.head<2>()) / volume;
              add_outer(mesh, outer_, q, gradient);
            }};
  }

  static Hub box_centre(const Mesh& mesh) {
    Eigen::Array3i least = Eigen::Array3i::Zero();
    Eigen::Array3i most = Eigen::Array3i::Zero();
    for (std::size_t v = 1; v < mesh.vertices.size(); ++v)
      for (int k = 0; k < 3; ++k) {
        if (mesh.vertices[v][k] < mesh.vertices[static_cast<std::size_t>(least[k])][k]) least[k] = static_cast<int>(v);
        if (mesh.vertices[v][k] > mesh.vertices[static_cast<std::size_t>(most[k])][k]) most[k] = static_cast<int>(v);
      }
    return {bounding_box(mesh).center(), [least, most](const Eigen::Vector3d& per_mm, VertexGradient& gradient) {
              for (int k = 0; k < 3; ++k) {
                gradient[static_cast<std::size_t>(least[k])][k] += 0.5 * per_mm[k];
                gradient[static_cast<std::size_t>(most[k])][k] += 0.5 * per_mm[k];
              }
            }};
  }

  SpinSpec spec_;
  bool largest_;
  double bound_;
  std::vector<char> outer_;
  double volume_mm3_;
  double length_mm_;
};

}  // namespace

std::unique_ptr<Wisher> wisher(const SpinSpec& spec, double margin, const Body& first, const std::vector<char>& outer) {
  return std::make_unique<SpinWisher>(spec, margin, first, outer);
}

}  // namespace rayrep::detail
