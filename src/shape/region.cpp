#include "shape/region.h"

#include <algorithm>
#include <limits>
#include <memory>

#include "base/text.h"
#include "rayrep/base/error.h"
#include "rayrep/mesh/surface_query.h"
#include "shape/wish.h"

namespace rayrep {
namespace detail {
namespace {

/// Distance from a region; 0 in it.
class Distance {
public:
  explicit Distance(const Region3& region) : region_(region) {
    if (const Mesh* mesh = std::get_if<Mesh>(&region)) surface_ = std::make_unique<SurfaceQuery>(*mesh);
  }

  double operator()(const Eigen::Vector3d& p) const {
    if (const auto* box = std::get_if<Eigen::AlignedBox3d>(&region_)) return box->exteriorDistance(p);
    if (const auto* ball = std::get_if<Ball3>(&region_)) return std::max(0.0, (p - ball->centre_mm).norm() - ball->radius_mm);
    std::vector<LineHit> hits;
    if (closed_line_hits(*surface_, p.head<2>(), hits) && winding_below(hits, p.z()) > 0) return 0;
    return surface_->closest(p, std::numeric_limits<double>::infinity()).distance_mm;
  }

private:
  const Region3& region_;
  std::unique_ptr<SurfaceQuery> surface_;
};

}  // namespace

std::vector<double> freedom_beside(const std::vector<Region3>& fixed, const Mesh& mesh, double blend_mm) {
  std::vector<double> free(mesh.vertices.size(), 1);
  for (const Region3& region : fixed) {
    const Distance distance(region);
    for (std::size_t v = 0; v < free.size(); ++v) {
      const double d = distance(mesh.vertices[v]);
      free[v] *= d == 0 ? 0 : blend_mm > 0 ? smooth_step(d / blend_mm) : 1;
    }
  }
  return free;
}

}  // namespace detail

Region3 parse_region(const std::string& text) {
  const std::vector<std::string> parts = parts_of(text);
  std::vector<double> numbers;
  for (const std::string& part : parts) numbers.push_back(rayrep::parse_number("deform-fixed", part));
  if (numbers.size() == 4 && numbers[3] > 0) return Ball3{{numbers[0], numbers[1], numbers[2]}, numbers[3]};
  if (numbers.size() == 6) {
    Eigen::AlignedBox3d box(Eigen::Vector3d(numbers[0], numbers[1], numbers[2]));
    box.extend(Eigen::Vector3d(numbers[3], numbers[4], numbers[5]));
    return box;
  }
  throw Error(ErrorCode::usage, "--deform-fixed takes a box X,Y,Z,X,Y,Z, a ball X,Y,Z,R or a mesh; it is '" + text + "'.");
}

std::string shown(const Region3& region) {
  if (const auto* box = std::get_if<Eigen::AlignedBox3d>(&region)) {
    std::string text;
    for (int k = 0; k < 6; ++k) text += (k > 0 ? "," : "") + shown(k < 3 ? box->min()[k] : box->max()[k - 3]);
    return text;
  }
  if (const auto* ball = std::get_if<Ball3>(&region)) {
    std::string text;
    for (int k = 0; k < 3; ++k) text += shown(ball->centre_mm[k]) + ",";
    return text + shown(ball->radius_mm);
  }
  return "a mesh of " + plural(std::get<Mesh>(region).triangles.size(), "triangle", "triangles");
}

}  // namespace rayrep
