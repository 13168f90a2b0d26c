#include "make/kept_bodies.h"

#include <algorithm>

namespace rayrep::detail {
namespace {

bool same(const Mesh& a, const Mesh& b) { return a.vertices == b.vertices && a.triangles == b.triangles; }

bool same_inside(const Discretisation& a, const Discretisation& b) {
  return a.wall_mm == b.wall_mm && a.resolution == b.resolution && a.min_cavity_mm3 == b.min_cavity_mm3 &&
         a.look_only == b.look_only && a.phases.light == b.phases.light && a.phases.heavy == b.phases.heavy &&
         a.phases.most_mm3 == b.phases.most_mm3;
}

}  // namespace

std::shared_ptr<Body> KeptBodies::body(const Eigen::Affine3d& frame, const Mesh& mesh, const Discretisation& options,
                                       const Progress& progress) {
  constexpr std::size_t kMost = 6;  // a pose looks at two, each turned when its rays miss thin parts
  // Posts under rooms depend on the wall, what is fixed weighs by the density, and what is kept solid is not compared: with any of
  // these nothing is taken over.
  if (!options.rooms.empty() || !options.fixed.isZero(0) || !options.keep_solid.empty() || !options.pillars.empty())
    return std::make_shared<Body>(mesh, frame, options, progress);
  const auto alike = std::find_if(kept_.begin(), kept_.end(), [&](const Kept& k) {
    return k.body->to_working.matrix() == frame.matrix() && same(k.body->outer, mesh);
  });
  const auto found = std::find_if(alike, kept_.end(), [&](const Kept& k) {
    return same_inside(k.options, options) && k.body->to_working.matrix() == frame.matrix() && same(k.body->outer, mesh);
  });
  Kept kept;
  if (found != kept_.end()) {
    kept = *found;
    kept_.erase(found);
    if (options.require) options.require(kept.body->hull);
  } else {
    kept = {alike != kept_.end() ? std::make_shared<Body>(*alike->body, options, progress)
                                 : std::make_shared<Body>(mesh, frame, options, progress),
            options};
    kept.options.require = {};
    kept.options.kept = {};  // that would be itself
  }
  kept_.push_front(kept);
  if (kept_.size() > kMost) kept_.pop_back();
  return kept.body;
}

}  // namespace rayrep::detail
