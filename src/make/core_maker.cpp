#include "make/core_maker.h"

#include "make/cavity_maker.h"

namespace rayrep::detail {
namespace {

/// Leaves out what touches the wall nowhere: a core that nothing holds, or a bubble in one.
void drop_loose(CavityMesh& region, const SurfaceQuery& surface, double reach_mm) {
  Mesh kept;
  for (const Mesh& shell : split(region.mesh, connected_components(region.mesh))) {
    bool held = false;
    for (std::size_t n = 0; n < shell.vertices.size() && !held; ++n)
      held = surface.closest(shell.vertices[n], reach_mm).triangle >= 0;
    if (held)
      append(kept, shell);
    else
      --region.cavities;
  }
  region.mesh = std::move(kept);
}

}  // namespace

Moments CoreMaker::Region::switching(const Switching& switching) const {
  Moments one = Moments::Zero();
  one[M1] = 1;
  switch (where) {
    case Where::everywhere:
      return one;
    case Where::cavity:
      return switching.q;
    case Where::core:
      return -(switching.q + switching.price * one);
  }
  return one;
}

CoreMaker::CoreMaker(Body& body, const Print& print, const HollowOptions& options, const Progress& progress)
    : body_(body), print_(print), options_(options), progress_(progress) {
  const double partition_mm = print.core.partition(print.wall_mm);
  room_ = {partition_mm > 0 ? Region::Where::cavity : Region::Where::everywhere, 0.5 * partition_mm, 0};
  core_ = {Region::Where::core, 0.5 * partition_mm, partition_mm > 0 ? 0 : print.core.clearance_mm};
}

CavityOptions CoreMaker::options_of(const Region& region) const {
  CavityOptions options = cavity_options(body_, print_, options_);
  options.inset_mm = region.inset_mm;
  options.clearance_mm = region.clearance_mm;
  return options;
}

void CoreMaker::make(const Switching& switching) {
  if (core_.mesh.mesh.vertices.empty()) return make_anew(switching);
  for (Region* region : {&room_, &core_})
    if (region->where != Region::Where::everywhere &&
        !follow_quadric(region->mesh, body_.inner.field, body_.surface, region->switching(switching), options_of(*region)))
      return make_anew(switching);
  followed_ = true;
  measure();
}

void CoreMaker::make_anew(const Switching& switching) {
  for (Region* region : {&room_, &core_}) {
    if (region->where == Region::Where::everywhere && !region->mesh.mesh.vertices.empty()) continue;  // it does not change
    region->mesh = mesh_cavity(body_.inner.field, body_.surface, region->switching(switching), options_of(*region));
    region->crossing_anew = region->mesh.crossing;
    drop_loose(region->mesh, body_.surface, print_.wall_mm + body_.inner.field.spacing_mm);
  }
  followed_ = false;
  measure();
}

void CoreMaker::measure() {
  const CavityOptions options = cavity_options(body_, print_, options_);
  core_shells_ = options.as_delivered(core_.mesh.mesh);
  shells_ = options.as_delivered(room_.mesh.mesh);
  if (room_.where == Region::Where::cavity) append(shells_, core_shells_);
  // Shells face inward: their moments are negative.
  moments_ = body_.solid + mesh_moments(transformed(shells_, body_.to_working)) -
             phases_of(print_).heavy * mesh_moments(transformed(core_shells_, body_.to_working));
}

bool CoreMaker::refine() {
  if (!body_.refine(discretisation(print_, options_), progress_)) return false;
  room_.mesh = {};
  core_.mesh = {};
  return true;
}

bool CoreMaker::spoilt() const {
  return followed_ && (room_.mesh.crossing > room_.crossing_anew || core_.mesh.crossing > core_.crossing_anew);
}

Made CoreMaker::made() const {
  Made made;
  Mesh mesh = body_.outer;
  append(mesh, shells_);
  made.delivery.parts.push_back({.mesh = std::move(mesh), .density_g_cm3 = print_.density_g_cm3});
  // The core comes last of what is put in.
  for (const FixedBody& fixed : options_.fixed) made.delivery.parts.push_back(fixed.part);
  if (!core_shells_.triangles.empty()) {
    Mesh core = core_shells_;
    flip(core);
    made.delivery.parts.push_back(
        {.mesh = std::move(core), .role = Part::Role::insert, .density_g_cm3 = print_.core.density_g_cm3});
  }
  made.delivery.pauses_mm = options_.pauses_mm;
  made.cavities = room_.mesh.cavities;
  made.filled_cavities = room_.mesh.filled;
  made.filled_mm3 = room_.mesh.filled_mm3;
  made.removed_islands = room_.mesh.removed_islands;
  return made;
}

}  // namespace rayrep::detail
