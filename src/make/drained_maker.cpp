#include "make/drained_maker.h"

#include <algorithm>

#include "base/text.h"
#include "make/fixed.h"
#include "physics/trapped.h"
#include "rayrep/base/error.h"
#include "rayrep/mesh/boolean.h"

namespace rayrep::detail {
namespace {

constexpr double kApart_mm = 5;  // on the bed
constexpr int kMostFinds = 3;

std::vector<Rod> pillars_of(const HollowOptions& options) {
  std::vector<Rod> pillars;
  for (const Mesh& bone : options.pillars) pillars.push_back(pillar_of(bone, options.pillar_clearance_mm));
  return pillars;
}

}  // namespace

DrainedMaker::DrainedMaker(std::unique_ptr<Maker> cavities, const Body& body, const Spec& spec, const HollowOptions& options,
                           const Progress& progress)
    : cavities_(std::move(cavities)),
      body_(body),
      print_(print_of(spec)),
      options_(options),
      progress_(progress),
      float32_(is_float32(body.outer)),
      places_(body, spec, triangles_of(rooms_of(options.fixed)), pillars_of(options), options.keep_solid),
      fixed_(moment_map(body.to_working) * fixed_moments(options.fixed, print_of(spec).density_g_cm3)) {}

void DrainedMaker::make(const Switching& switching) {
  cavities_->make(switching);
  drill_all();
}

void DrainedMaker::make_anew(const Switching& switching) {
  cavities_->make_anew(switching);
  drill_all();
}

void DrainedMaker::drill_all() {
  const Made made = cavities_->made();
  if (made.cavities == 0 && made.filled_cavities > 0 && print_.drains.where == Drains::Where::found)
    throw Error(ErrorCode::goal, "No cavity has room for holes of " + number(print_.drains.diameter_mm, 2) + " mm: they hold " +
                                     number(made.filled_mm3 / 1000, 2) +
                                     " cm3 together. Narrower holes may do (--drain-diameter).");
  const Mesh whole = made.delivery.body();
  Mesh shells;
  shells.vertices = whole.vertices;
  shells.triangles.assign(whole.triangles.begin() + static_cast<std::ptrdiff_t>(body_.outer.triangles.size()),
                          whole.triangles.end());
  renewed_ = false;
  if (holes_) mesh_ = drilled(whole, *holes_);
  // What a pass has moved a floor by may leave a pool behind its hole.
  if (!holes_ || (found_ < kMostFinds && !places_.still_drain(mesh_, shells))) {
    holes_ = places_.find(shells, [&](const std::vector<DrainHole>& holes) { return drilled(whole, holes); });
    renewed_ = found_++ > 0;
    mesh_ = drilled(whole, *holes_);
  }
  plugs_ = print_.drains.plugged ? plugs_in(whole) : std::vector<Mesh>();
  const Moments stays = liquid();
  constexpr double kWeighs = 1e-6;  // of the body
  floods_ |= stays[M1] > kWeighs * body_.solid[M1];
  moments_ = fixed_ + mesh_moments(transformed(mesh_, body_.to_working)) + stays;
  for (const Mesh& plug : plugs_) moments_ += mesh_moments(transformed(plug, body_.to_working));
}

/// Of resin that stays in the cavities, which weighs, in volumes of what is printed.
Moments DrainedMaker::liquid() const {
  if (!(print_.liquid_g_cm3 > 0) || print_.drained) return Moments::Zero();
  const Eigen::Vector3d& up = places_.print_up();
  const Moments stays = total(pools_in(mesh_, up)) - total(pools_in(body_.outer, up));
  return print_.liquid_g_cm3 / print_.density_g_cm3 * (moment_map(body_.to_working) * stays);
}

Mesh DrainedMaker::stored(const CombinedMesh& mesh) const { return options_.as_stored ? options_.as_stored(mesh.mesh) : mesh.mesh; }

Mesh DrainedMaker::drilled(const Mesh& mesh, const std::vector<DrainHole>& holes) const {
  std::vector<Mesh> operands = {mesh};
  for (const DrainHole& hole : holes) operands.push_back(drill(hole, 0.5 * print_.drains.diameter_mm));
  return stored(combined(operands, {BooleanOperation::subtract, float32_}, progress_));
}

/// What the drills take out of the material, less the clearance around.
std::vector<Mesh> DrainedMaker::plugs_in(const Mesh& mesh) const {
  Mesh all;
  for (DrainHole hole : *holes_) {
    hole.length_mm -= print_.drains.clearance_mm;  // it may end in the material
    if (!hole.inside) append(all, drill(hole, 0.5 * print_.drains.diameter_mm - print_.drains.clearance_mm));
  }
  const std::vector<Mesh> operands = {mesh, all};
  const Mesh plugs = with_merged_vertices(stored(combined(operands, {BooleanOperation::intersect, float32_}, progress_)));
  std::vector<Mesh> pieces = split(plugs, connected_components(plugs));
  // Where a hole ends in the material a bit may be apart from the rest.
  std::erase_if(pieces, [&](const Mesh& piece) {
    const SurfaceQuery surface(piece);
    return std::none_of(holes_->begin(), holes_->end(), [&](const DrainHole& hole) {
      return surface.closest(hole.mouth_mm, 0.1 * print_.drains.diameter_mm).triangle >= 0;
    });
  });
  return pieces;
}

Made DrainedMaker::made() const {
  Made made = cavities_->made();
  for (Part& part : made.delivery.parts)
    if (part.role == Part::Role::body) part.mesh = mesh_;
  double beside_mm = bounding_box(mesh_).max().x();
  for (const Mesh& plug : plugs_) {
    made.delivery.parts.push_back({.mesh = plug, .role = Part::Role::plug, .density_g_cm3 = print_.density_g_cm3});
    made.delivery.parts.back().to_bed = beside_the_body(plug, beside_mm);
    beside_mm += bounding_box(transformed(plug, made.delivery.parts.back().to_bed)).sizes().x() + kApart_mm;
  }
  return made;
}

/// Upright, its outer end above, on the level of the body.
Eigen::Affine3d DrainedMaker::beside_the_body(const Mesh& plug, double beside_mm) const {
  const Eigen::Vector3d& p = plug.vertices.front();
  const auto nearest = std::min_element(holes_->begin(), holes_->end(), [&p](const DrainHole& a, const DrainHole& b) {
    return (a.mouth_mm - p).norm() < (b.mouth_mm - p).norm();
  });
  Eigen::Affine3d place(up_to_z(nearest->outward));
  const Eigen::AlignedBox3d body = bounding_box(mesh_);
  const Eigen::AlignedBox3d box = bounding_box(transformed(plug, place));
  place.pretranslate(
      Eigen::Vector3d(beside_mm + kApart_mm - box.min().x(), body.center().y() - box.center().y(), body.min().z() - box.min().z()));
  return place;
}

std::vector<Eigen::Vector3d> DrainedMaker::mouths() const {
  std::vector<Eigen::Vector3d> all;
  if (holes_)
    for (const DrainHole& hole : *holes_)
      if (!hole.inside) all.push_back(hole.mouth_mm);
  return all;
}

}  // namespace rayrep::detail
