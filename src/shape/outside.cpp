#include "shape/outside.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "make/fixed.h"
#include "shape/region.h"

namespace rayrep::detail {
namespace {

constexpr double kTolerance = 1e-7;  ///< of values, which are of order 1
constexpr std::size_t kMostCuts = 12;

bool less(const Cut& a, const Cut& b) { return a.value < b.value; }

}  // namespace

Outside::Outside(const Problem& problem, const Progress& progress)
    : problem_(problem),
      progress_({.stage = {}, .cancelled = progress.cancelled}),
      discretisation_(discretisation(print_of(problem.spec), problem.options)),
      phases_(phases_of(print_of(problem.spec))),
      outer_(outer_triangles(problem.solid)) {
  discretisation_.resolution = problem.how.resolution;
  first_ = body_of(problem.solid);
  ask(0, 0);
  const Mesh upright = transformed(problem.solid, problem.frame);
  const double cell_mm = bounding_box(upright).sizes().maxCoeff() / problem.how.cells;
  Freedom freedom{std::vector<double>(upright.vertices.size(), 1), std::vector<double>(upright.vertices.size(), 1)};
  wisher_->hold(upright, 0.5 * cell_mm, freedom);
  const std::vector<double> free = freedom_beside(problem.how.fixed, problem.solid, cell_mm);
  for (std::size_t v = 0; v < free.size(); ++v) {
    freedom.across[v] *= free[v];
    freedom.along[v] *= free[v];
  }
  cage_.emplace(upright, std::move(freedom),
                Cage::Options{.cell_mm = cell_mm, .stiffness_mm = problem.how.stiffness * first_->diagonal_mm});
}

std::unique_ptr<Body> Outside::body_of(const Mesh& mesh) const {
  return std::make_unique<Body>(with_rooms(mesh, problem_.options.fixed), problem_.frame, discretisation_, progress_);
}

void Outside::ask(double margin, double room) {
  room_ = room;
  if (const auto* stand = std::get_if<StandSpec>(&problem_.spec)) wisher_ = wisher(*stand, margin, *first_);
  if (const auto* spin = std::get_if<SpinSpec>(&problem_.spec)) wisher_ = wisher(*spin, margin, *first_, outer_);
  if (const auto* floats = std::get_if<FloatSpec>(&problem_.spec)) wisher_ = wisher(*floats, margin, *first_);
}

Eigen::Index Outside::values() const { return wisher_->wish(*first_).wanted.rows.rows(); }

Mesh Outside::deformed(const Handles& handles) const {
  Mesh mesh = problem_.solid;
  const std::vector<Eigen::Vector3d> moved = cage_->displacement(handles);
  const Eigen::Matrix3d back = problem_.frame.linear().transpose();
  for (std::size_t v = 0; v < moved.size(); ++v)
    if (moved[v] != Eigen::Vector3d::Zero()) mesh.vertices[v] += back * moved[v];
  return mesh;
}

Cut Outside::cut_at(const Eigen::VectorXd& normal, const Body& body, const Wish& wish, const WallSamples& wall) const {
  constexpr int most_passes = 6;
  const RayIntegrals& rays = *body.integrals;
  Wanted wanted = wish.wanted;
  Support at = support(wanted, normal, rays, body.shell);
  for (int pass = 0; pass < most_passes && wish.adapt; ++pass) {
    wish.adapt(at.moments, wanted);
    const Support next = support(wanted, normal, rays, body.shell);
    const bool settled = std::abs(next.value - at.value) < kTolerance;
    at = next;
    if (settled) break;
  }
  Cut cut{normal, at.value + room_ * normal.head(wanted.equations).norm(), {}};
  VertexGradient gradient(body.surface.mesh().vertices.size(), Eigen::Vector3d::Zero());
  const Moments q = wanted.rows.transpose() * normal;
  add_outer(body.working, outer_, q, gradient);
  wall.add(body.working, phases_, q, gradient);
  wish.add_explicit(q, normal, at.moments, gradient);
  cut.slope = cage_->pulled_back(gradient);
  return cut;
}

Shortfall Outside::reach_of(const Eigen::VectorXd& shift, const Body& body, const Wish& wish) const {
  constexpr int most_passes = 6;
  Wanted wanted = wish.wanted;
  wanted.offset += shift;
  Shortfall reach = shortfall(wanted, *body.integrals, body.shell, kTolerance);
  for (int pass = 0; pass < most_passes && wish.adapt && reach.distance >= kTolerance; ++pass) {
    wish.adapt(reach.moments, wanted);
    const double before = reach.distance;
    reach = shortfall(wanted, *body.integrals, body.shell, kTolerance);
    if (std::abs(reach.distance - before) < 1e-4 * before) break;
  }
  return reach;
}

Look Outside::look(const Handles& handles, const std::vector<Cut>& before) {
  progress_.check();
  ++looks_;
  Look result;
  result.handles = handles;
  result.mesh = deformed(handles);
  const auto body = body_of(result.mesh);
  const Wish wish = wisher_->wish(*body);
  const WallSamples wall(*body, discretisation_.wall_mm);
  const auto add = [&](const Eigen::VectorXd& normal) { result.cuts.push_back(cut_at(normal, *body, wish, wall)); };
  for (const Cut& cut : before) add(cut.normal);
  Eigen::VectorXd shift = Eigen::VectorXd::Zero(wish.wanted.offset.size());
  const Shortfall reach = reach_of(shift, *body, wish);
  if (reach.distance >= kTolerance) {
    result.distance = reach.distance;
    add(reach.normal);
  } else if (!result.cuts.empty() && wish.wanted.equations > 0) {
    // All of it within reach: what of a ball of the size of the room is not?
    const auto worst = std::max_element(result.cuts.begin(), result.cuts.end(), less);
    shift.head(wish.wanted.equations) = room_ * worst->normal.head(wish.wanted.equations).normalized();
    const Shortfall more = reach_of(shift, *body, wish);
    if (more.distance >= kTolerance) add(more.normal);
  }
  while (result.cuts.size() > kMostCuts) result.cuts.erase(std::min_element(result.cuts.begin(), result.cuts.end() - 1, less));
  for (const Cut& cut : result.cuts) result.worst = std::max(result.worst, cut.value);
  return result;
}

}  // namespace rayrep::detail
