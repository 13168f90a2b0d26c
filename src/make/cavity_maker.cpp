#include "make/cavity_maker.h"

namespace rayrep::detail {

CavityOptions cavity_options(const Body& body, const Print& print, const HollowOptions& options) {
  CavityOptions result;
  result.wall_mm = print.wall_mm;
  result.min_cavity_mm3 = discretisation(print, options).min_cavity_mm3;
  // A core would reach over ridges of its room that are sharpened otherwise than its own.
  result.sharp_ridges = !print.core.wanted() && (!options.keep_solid.empty() || !options.pillars.empty());
  result.as_delivered = [&body, &options](const Mesh& mesh) {
    const Mesh turned = transformed(mesh, body.to_working.inverse());
    return options.as_stored ? options.as_stored(turned) : turned;
  };
  return result;
}

CavityMaker::CavityMaker(Body& body, const Print& print, const HollowOptions& options, const Progress& progress, By by)
    : body_(body),
      print_(print),
      options_(options),
      progress_(progress),
      by_(by),
      cavity_options_(cavity_options(body, print, options)),
      cuts_(by == By::cut) {}

void CavityMaker::make(const Switching& switching) {
  followed_ = follow(switching);
  if (!followed_) return make_anew(switching);
  measure();
}

bool CavityMaker::follow(const Switching& switching) {
  if (!cuts_)
    return !cavity_.mesh.vertices.empty() &&
           follow_quadric(cavity_, body_.inner.field, body_.surface, switching.q, cavity_options_);
  if (!clipped_) return false;
  std::optional<CavityMesh> followed = clipped_->follow(switching.q);
  if (followed) cavity_ = std::move(*followed);
  return followed.has_value();
}

void CavityMaker::make_anew(const Switching& switching) {
  followed_ = false;
  if (cuts_ && !clipped_) clipped_.emplace(body_.inner.field, body_.surface, cavity_options_, switching.q);
  std::optional<CavityMesh> cut = cuts_ ? clipped_->cut(switching.q) : std::nullopt;
  cuts_ = cut.has_value();
  if (!cuts_) clipped_.reset();
  cavity_ = cuts_ ? std::move(*cut) : mesh_cavity(body_.inner.field, body_.surface, switching.q, cavity_options_);
  crossing_anew_ = cavity_.crossing;
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
  clipped_.reset();
  cuts_ = by_ == By::cut;
  return true;
}

/// Chords of cuts lie inside of the wall's surface.
bool CavityMaker::take_all() {
  if (!cuts_) return false;
  cavity_ = {};
  clipped_.reset();
  cuts_ = false;
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
