#include "rayrep/mesh/clip.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <unordered_map>
#include <vector>

#include "base/text.h"
#include "mesh/cut_corners.h"
#include "mesh/holes.h"
#include "mesh/mesh_edges.h"
#include "mesh/quadric_cap.h"
#include "mesh/quadric_clip.h"
#include "mesh/rims.h"
#include "rayrep/base/error.h"

namespace rayrep {
namespace {

/// Cuts triangles at a plane, edge by edge.
class Clip {
public:
  Clip(const Mesh& mesh, const ClipPlane& plane) : mesh_(mesh), plane_(plane), kept_(mesh.vertices.size(), -1) {
    height_.reserve(mesh.vertices.size());
    for (const Eigen::Vector3d& v : mesh.vertices) height_.push_back(plane.normal.dot(v) - plane.offset_mm);
  }

  Mesh run() {
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) add(mesh_.triangles[t]);
    return std::move(result_);
  }

private:
  void add(const Eigen::Vector3i& triangle) {
    if (height_[triangle[0]] == 0 && height_[triangle[1]] == 0 && height_[triangle[2]] == 0) return;
    const CutCorners corners = cut_corners(
        triangle, height_, true, [&](int v) { return kept(v); }, [&](int a, int b) { return crossing(a, b); });
    for (int k = 2; k < corners.count; ++k) result_.triangles.emplace_back(corners.v[0], corners.v[k - 1], corners.v[k]);
  }

  int kept(int v) {
    if (kept_[v] < 0) {
      kept_[v] = static_cast<int>(result_.vertices.size());
      result_.vertices.push_back(mesh_.vertices[v]);
    }
    return kept_[v];
  }

  /// Where the edge crosses the plane.
  int crossing(int a, int b) {
    const int low = height_[a] < height_[b] ? a : b;
    const int high = low == a ? b : a;
    if (height_[high] == 0) return kept(high);
    const auto [place, is_new] = crossings_.try_emplace(edge_key(low, high), static_cast<int>(result_.vertices.size()));
    if (is_new) {
      const double t = height_[low] / (height_[low] - height_[high]);
      Eigen::Vector3d p = mesh_.vertices[low] + t * (mesh_.vertices[high] - mesh_.vertices[low]);
      p -= (plane_.normal.dot(p) - plane_.offset_mm) * plane_.normal;
      result_.vertices.push_back(p);
    }
    return place->second;
  }

  const Mesh& mesh_;
  const ClipPlane& plane_;
  std::vector<double> height_;  ///< of each vertex above the plane
  std::vector<int> kept_;       ///< its number in the result
  std::unordered_map<std::uint64_t, int> crossings_;
  Mesh result_;
};

/// Of f, at the vertex nearest to f = 0.
double slope_near(const Mesh& mesh, const Quadric& f) {
  double nearest = HUGE_VAL;
  double slope = 0;
  for (const Eigen::Vector3d& v : mesh.vertices) {
    const double distance = std::abs(f.distance(v));
    if (!(distance < nearest)) continue;
    nearest = distance;
    slope = f.gradient(v).norm();
  }
  return slope;
}

}  // namespace

Mesh clipped(const Mesh& mesh, const ClipPlane& plane, const Progress& progress) {
  Mesh result = Clip(mesh, plane).run();
  progress.check();
  const Rims rims = rims_of(result);
  if (!rims.closed()) close_flat(holes_of(result, rims), 1e-9 * bounding_box(mesh).diagonal().norm(), result, progress);
  return result;
}

Mesh clipped(const Mesh& mesh, const Quadric& f, const QuadricCutOptions& options, const Progress& progress) {
  if (f.hessian.isZero(0)) {
    const double slope = f.slope.norm();
    if (slope == 0) return f.constant > 0 ? mesh : Mesh{};
    return clipped(mesh, ClipPlane{f.slope / slope, -f.constant / slope}, progress);
  }
  // All is the same for f and -f, also what is tried.
  const double sign = comes_first(f) ? 1 : -1;
  const double step = 1e-3 * options.error_mm * slope_near(mesh, f);
  for (const double moved : {0., 1., -1., 3., -3.}) {
    progress.check();
    Quadric near = f;
    near.constant += sign * moved * step;
    QuadricClipOptions clip;
    clip.error_mm = options.error_mm;
    clip.zero_is_above = sign > 0;
    if (std::optional<QuadricClipped> result = clip_by_quadric(mesh, near, clip)) return std::move(result->mesh);
  }
  throw Error(ErrorCode::input, "The cut leaves curves on the surface that come nearer to each other than " +
                                    shown(options.error_mm) +
                                    " mm, so that it cannot be closed. Move it by that much, or allow a smaller error.");
}

}  // namespace rayrep
