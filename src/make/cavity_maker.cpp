#include "make/cavity_maker.h"

namespace rayrep::detail {

CavityOptions cavity_options(const Body& body, const Print& print, const HollowOptions& options) {
  CavityOptions result;
  result.wall_mm = print.wall_mm;
  result.min_cavity_mm3 = discretisation(print, options).min_cavity_mm3;
  result.as_delivered = [&body, &options](const Mesh& mesh) {
    const Mesh turned = transformed(mesh, body.to_working.inverse());
    return options.as_stored ? options.as_stored(turned) : turned;
  };
  return result;
}

CavityMaker::CavityMaker(Body& body, const Print& print, const HollowOptions& options, const Progress& progress)
    : body_(body), print_(print), options_(options), progress_(progress), cavity_options_(cavity_options(body, print, options)) {}

void CavityMaker::make(const Switching& switching) {
  const bool first = cavity_.mesh.vertices.empty();
  if (first || !follow_quadric(cavity_, body_.inner.field, body_.surface, switching.q, cavity_options_))
    return make_anew(switching);
  followed_ = true;
  measure();
}

void CavityMaker::make_anew(const Switching& switching) {
  cavity_ = mesh_cavity(body_.inner.field, body_.surface, switching.q, cavity_options_);
  crossing_anew_ = cavity_.crossing;
  followed_ = false;
  measure();
}

void CavityMaker::measure() {
  shells_ = cavity_options_.as_delivered(cavity_.mesh);
  // Shells face inward: their moments are negative.
  moments_ = body_.solid + (1 - print_.infill.share()) * mesh_moments(transformed(shells_, body_.to_working));
}

bool CavityMaker::refine() {
  if (!body_.refine(discretisation(print_, options_), progress_)) return false;
  cavity_ = {};
  return true;
}

bool CavityMaker::spoilt() const { return followed_ && cavity_.crossing > crossing_anew_; }

Made CavityMaker::made() const {
  Mesh mesh = body_.outer;
  Made made;
  const Infill& infill = print_.infill;
  if (!infill.wanted()) append(mesh, shells_);
  made.delivery.parts.push_back({.mesh = std::move(mesh), .density_g_cm3 = print_.density_g_cm3});
  if (infill.wanted() && !shells_.triangles.empty()) {
    Mesh sparse = shells_;
    flip(sparse);
    made.delivery.parts.push_back({.mesh = std::move(sparse),
                                   .role = Part::Role::modifier,
                                   .density_g_cm3 = print_.density_g_cm3,
                                   .infill = SparseInfill{infill.percent, infill.pattern, infill.share()}});
  }
  for (const FixedBody& fixed : options_.fixed) made.delivery.parts.push_back(fixed.part);
  made.delivery.pauses_mm = options_.pauses_mm;
  made.cavities = cavity_.cavities;
  made.filled_cavities = cavity_.filled;
  made.filled_mm3 = cavity_.filled_mm3;
  made.removed_islands = cavity_.removed_islands;
  return made;
}

}  // namespace rayrep::detail
