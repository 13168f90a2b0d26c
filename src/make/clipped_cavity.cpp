#include "make/clipped_cavity.h"

#include <algorithm>
#include <cassert>
#include <utility>

#include "make/cavity_mender.h"
#include "mesh/quadric_clip.h"

namespace rayrep::detail {
namespace {

/// Of chords: 0.02 mm of a wall of 1.2 mm, which leaves 0.98 of it.
constexpr double kError = 1.0 / 60;

Quadric quadric_of(const Moments& q) { return {quadric_hessian(q), q.segment<3>(MX), q[M1]}; }

}  // namespace

ClippedCavity::ClippedCavity(BlockField& field, const SurfaceQuery& surface, const CavityOptions& options, const Moments& q)
    : field_(field), surface_(surface), options_(options), reach_mm_(2 * field.spacing_mm) {
  assert(options.inset_mm == 0);
  mesh_offset(quadric_of(q));
}

void ClippedCavity::mesh_offset(const Quadric& first) {
  const double wall = options_.least_distance_mm();
  // With as much around it as quadrics may move from pass to pass.
  const auto needs = [&](const Eigen::Vector3d& p) { return !(first.distance(p) < -wall); };
  OffsetSurface all = offset_surface(field_, surface_, options_, {kError * wall, needs}, made_);
  offset_ = std::move(all.mesh);
  specks_ = split(all.specks, connected_components(all.specks));
  mended_.resize(offset_.vertices.size());
  std::transform(offset_.vertices.begin(), offset_.vertices.end(), mended_.begin(), needs);
}

/// @returns false where triangles cross for all that
bool ClippedCavity::mend_what_is_left(const Quadric& f) {
  std::vector<char> moved(offset_.vertices.size(), 0);
  bool any = false;
  for (std::size_t n = 0; n < moved.size(); ++n)
    if (!mended_[n] && f.value(offset_.vertices[n]) >= 0) moved[n] = mended_[n] = any = true;
  if (!any) return true;
  note_crossing(offset_, CavityMender(surface_, options_).mend(offset_, std::move(moved), mended_));
  return crossing_.empty();
}

void ClippedCavity::note_crossing(const Mesh& mesh, const std::vector<std::size_t>& triangles) {
  crossing_.clear();
  for (const std::size_t t : triangles)
    for (int k = 0; k < 3; ++k) crossing_.push_back(mesh.corner(t, k));
}

QuadricClipOptions ClippedCavity::clip_options() const {
  const double wall = options_.least_distance_mm();
  QuadricClipOptions clip;
  clip.error_mm = kError * wall;
  clip.surface = [this, wall](const Eigen::Vector3d& p) -> std::optional<LevelAt> {
    const ClosestPoint closest = surface_.closest(p, wall + reach_mm_);
    if (closest.triangle < 0 || closest.distance_mm <= 0) return std::nullopt;
    return LevelAt{wall - closest.distance_mm, (closest.point_mm - p) / closest.distance_mm};
  };
  return clip;
}

std::optional<CavityMesh> ClippedCavity::cut(const Moments& q) {
  const Quadric f = quadric_of(q);
  const std::optional<Followed> far = std::exchange(far_, std::nullopt);
  if (!far || far->q != q) return cut_anew(f);
  std::optional<CavityMesh> cavity = cut_as_it_is(f);
  if (cavity && farthest_mended_mm_ < std::max(far->mended_mm, far_mended_mm())) return cavity;
  last_ = far->cut;
  mending_ = far->mending;
  farthest_mended_mm_ = far->mended_mm;
  return far->cavity;
}

std::optional<CavityMesh> ClippedCavity::cut_anew(const Quadric& f) {
  do {
    if (std::optional<CavityMesh> cavity = cut_as_it_is(f)) return cavity;
  } while (close_where_it_crosses(f));
  return std::nullopt;
}

std::optional<CavityMesh> ClippedCavity::cut_as_it_is(const Quadric& f) {
  last_.reset();
  crossing_.clear();
  if (made_.crossing > 0 || !mend_what_is_left(f)) return std::nullopt;
  QuadricClipOptions clip = clip_options();
  for (const bool keeps_chords : {true, false}) {
    clip.keeps_chords = keeps_chords;
    std::optional<QuadricClipped> cut = clip_by_quadric(offset_, f, clip);
    if (!cut) break;
    Mesh mesh = cut->mesh;
    if (std::optional<CavityMesh> cavity = mended(std::move(*cut), std::move(mesh), f)) return cavity;
  }
  return std::nullopt;
}

/// As the offset surface is where it crosses itself, with what is around in the grid. theory.md (151)
bool ClippedCavity::close_where_it_crosses(const Quadric& f) {
  constexpr int kMostClosings = 4;
  if (crossing_.empty() || closings_++ == kMostClosings) return false;
  std::size_t closed = 0;
  for (const Eigen::Vector3d& p : crossing_) closed += close_around(field_, p);
  if (closed == 0) return false;
  made_.closed_samples += closed;
  mesh_offset(f);
  return true;
}

std::optional<CavityMesh> ClippedCavity::follow(const Moments& q) {
  if (!last_) return std::nullopt;
  const Quadric f = quadric_of(q);
  std::optional<Moved> moved = follow(f, false);
  const bool crosses = !moved || moved->crossing > 0;
  if (crosses)
    if (std::optional<Moved> carried = follow(f, true); carried && (!moved || carried->crossing < moved->crossing))
      moved = std::move(carried);
  if (!moved) return std::nullopt;
  double farthest = 0;
  for (std::size_t n = 0; n < mending_.size(); ++n)
    farthest = std::max(farthest, (moved->cut.mesh.vertices[n] - last_->mesh.vertices[n]).norm());
  // The last steps, which are short, are smooth in q.
  constexpr double kShort = 0.005;  // of the wall: a quarter of what it may lack
  if (farthest <= kShort * options_.least_distance_mm())
    return moved->crossing > 0 ? std::nullopt : std::optional(taken(std::move(moved->mesh), f));
  std::optional<CavityMesh> result = mended(std::move(moved->cut), std::move(moved->mesh), f);
  // A crease that was mended far, or crosses where it has come farther still, is better cut anew: mostly no triangles cross there
  // then. Once, as cuts are not smooth in q.
  constexpr double kFarthest = 0.4;  // of the wall
  const bool is_far = farthest_mended_mm_ > far_mended_mm() || (crosses && farthest > kFarthest * options_.least_distance_mm());
  if (!is_far || was_cut_anew_) return result;
  was_cut_anew_ = true;
  if (result) far_ = Followed{q, *last_, mending_, farthest_mended_mm_, std::move(*result)};
  return std::nullopt;
}

/// The last cut, moved to another quadric, and with what it was mended by.
std::optional<ClippedCavity::Moved> ClippedCavity::follow(const Quadric& f, bool carry) const {
  Moved moved{*last_, {}, 0};
  if (!rayrep::follow(moved.cut, f, clip_options(), carry)) return std::nullopt;
  moved.mesh = moved.cut.mesh;
  for (std::size_t n = 0; n < mending_.size(); ++n) moved.mesh.vertices[n] += mending_[n];
  moved.crossing = CavityMender(surface_, options_).crossing(moved.mesh, moved.cut.is_new).size();
  return moved;
}

/// Sees to the walls and triangles of `mesh`, whose vertices were cut or moved to where they are in `cut`.
std::optional<CavityMesh> ClippedCavity::mended(QuadricClipped cut, Mesh mesh, const Quadric& f) {
  if (const auto crossing = CavityMender(surface_, options_).mend(mesh, cut.is_new); !crossing.empty()) {
    note_crossing(cut.mesh, crossing);
    return std::nullopt;
  }
  mending_.resize(mesh.vertices.size());
  farthest_mended_mm_ = 0;
  for (std::size_t n = 0; n < mending_.size(); ++n) {
    mending_[n] = mesh.vertices[n] - cut.mesh.vertices[n];
    if (cut.on[n] == QuadricClipped::On::crease) farthest_mended_mm_ = std::max(farthest_mended_mm_, mending_[n].norm());
  }
  last_ = std::move(cut);
  return taken(std::move(mesh), f);
}

CavityMesh ClippedCavity::taken(Mesh all, const Quadric& f) const {
  for (const Mesh& speck : specks_)
    if (f.value(speck.vertices.front()) > 0) append(all, speck);
  CavityMesh result;
  result.closed_samples = made_.closed_samples;
  take_shells(all, options_, result);
  return result;
}

}  // namespace rayrep::detail
