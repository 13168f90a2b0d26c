#include "make/cut_maker.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "base/text.h"
#include "make/cut_search.h"
#include "make/pieces.h"
#include "mesh/prism.h"
#include "mesh/surface_gap.h"
#include "rayrep/base/error.h"
#include "rayrep/mesh/assembly.h"
#include "rayrep/mesh/bodies.h"
#include "rayrep/mesh/mesh_check.h"

namespace rayrep::detail {
namespace {

/// Of a piece, and more than twice as much as clear_of_vertices moves planes.
constexpr double kThinnest_mm = 0.2;

std::string words_of(Cut::Plane plane) { return direction_place("cut", plane.normal).show() + "=" + shown(plane.offset_mm, 6); }

/// Of two planes in a box, whichever way they are turned.
double most_apart_mm(const Eigen::AlignedBox3d& box, const Cut::Plane& a, const Cut::Plane& b) {
  const double side = a.normal.dot(b.normal) < 0 ? -1 : 1;
  const Eigen::Vector3d turned = a.normal - side * b.normal;
  const double middle_mm = turned.dot(box.center()) - (a.offset_mm - side * b.offset_mm);
  return std::abs(middle_mm) + 0.5 * turned.cwiseAbs().dot(box.sizes());
}

/// @throws Error{usage} where a plane leaves nothing to print on one of its sides
void require_thickness(const Mesh& whole, const Cut::Plane& plane) {
  const auto [lowest, highest] =
      std::minmax_element(whole.vertices.begin(), whole.vertices.end(),
                          [&](const auto& a, const auto& b) { return plane.normal.dot(a) < plane.normal.dot(b); });
  const double lo = plane.normal.dot(*lowest);
  const double hi = plane.normal.dot(*highest);
  if (lo + kThinnest_mm <= plane.offset_mm && plane.offset_mm <= hi - kThinnest_mm) return;
  const bool meets = lo < plane.offset_mm && plane.offset_mm < hi;
  throw Error(ErrorCode::usage,
              concat("The plane ", words_of(plane), " of --cut ",
                     meets ? concat("passes less than ", shown(kThinnest_mm), " mm, a layer, from the end of the body")
                           : std::string("does not meet the body"),
                     ", which lies between ", shown(lo, 4), " and ", shown(hi, 4), " mm there."));
}

/// A pin across a cut and the room for it: a hole in each side.
struct Pin {
  Mesh body;
  Mesh room;
};

class CutMaker final : public Maker {
public:
  CutMaker(std::unique_ptr<Maker> maker, const Body& body, Print& print, const Progress& progress)
      : maker_(std::move(maker)), body_(body), print_(print), cut_(print.cut), progress_(progress) {
    overlaps_ = body.hull.triangles.size() != outer_hull(body.working).triangles.size();
    hole_.radius_mm = 0.5 * cut_.pin_diameter_mm + cut_.clearance_mm;
    hole_.depth_mm = half_length_mm(2.5) + kEndRoom_mm;
    hole_.wall_mm = print.wall_mm;
  }

  void make(const Switching& switching) override {
    maker_->make(switching);
    settle();
  }
  void make_anew(const Switching& switching) override {
    maker_->make_anew(switching);
    settle();
  }
  bool refine() override { return maker_->refine(); }
  bool take_all() override { return maker_->take_all(); }
  bool adapted() const override { return maker_->adapted(); }
  bool spoilt() const override { return maker_->spoilt(); }
  const Moments& moments() const override { return moments_; }
  Made made() const override;

private:
  static constexpr double kEndRoom_mm = 0.5;  ///< behind a pin, so that the halves close

  /// Of a pin so many diameters long, in whole mm.
  double half_length_mm(double diameters) const { return std::max(3.0, std::ceil(diameters * cut_.pin_diameter_mm)); }
  /// Without what lies in more than one of its bodies: a cut through that would be closed twice.
  Mesh united(const Mesh& whole) const { return overlaps_ ? boundary_of_union(whole, progress_) : whole; }
  /// Chooses the planes once, and pins as long as those there have room; the moments with them.
  void settle();
  std::vector<Cut::Plane> given_planes(const Mesh& whole) const;
  void place_pins(const Mesh& whole);
  bool pins_have_room(const Mesh& whole) const;
  /// What is kept solid, as if there were nothing in it: no pin goes there.
  Mesh kept_out() const;
  std::vector<Part> pieces_of(Mesh whole, const Part& like) const;
  /// On which of its cuts a piece lies: what points up then.
  Eigen::Vector3d up_of(const Mesh& piece) const;

  std::unique_ptr<Maker> maker_;
  const Body& body_;
  Print& print_;
  Cut cut_;  ///< as asked for
  const Progress& progress_;
  PinHole hole_;
  std::vector<Cut::Plane> planes_;
  std::vector<Pin> pins_;
  bool placed_ = false;
  bool overlaps_ = false;  ///< bodies, in the outside
  Moments moments_ = Moments::Zero();
};

void CutMaker::settle() {
  const Mesh whole = with_merged_vertices(united(maker_->made().delivery.parts.front().mesh));
  if (planes_.empty()) {
    const Eigen::Matrix3d working = body_.to_working.linear();
    CutWishes wishes{{Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitX()}, hole_};
    for (const int k : {2, 1, 0}) wishes.directions.emplace_back(working.row(k).transpose());
    planes_ = cut_.where == Cut::Where::given ? given_planes(whole) : cut_planes(whole, wishes, progress_);
    print_.cut.planes = planes_;
  }
  if (!placed_ || !pins_have_room(whole)) place_pins(whole);
  Moments pins = Moments::Zero();
  for (const Pin& pin : pins_) pins += mesh_moments(pin.body) - mesh_moments(pin.room);
  moments_ = maker_->moments() + moment_map(body_.to_working) * pins;
}

std::vector<Cut::Plane> CutMaker::given_planes(const Mesh& whole) const {
  for (std::size_t n = 0; n < cut_.planes.size(); ++n) {
    require_thickness(whole, cut_.planes[n]);
    for (std::size_t k = 0; k < n; ++k)
      if (most_apart_mm(bounding_box(whole), cut_.planes[k], cut_.planes[n]) < kThinnest_mm)
        throw Error(ErrorCode::usage, concat("Two planes of --cut, ", words_of(cut_.planes[k]), " and ", words_of(cut_.planes[n]),
                                             ", are one and the same, or nowhere in the body ", shown(kThinnest_mm),
                                             " mm apart, a layer: leave one of them out."));
  }
  std::vector<Cut::Plane> planes;
  for (const Cut::Plane& plane : cut_.planes) planes.push_back(clear_of_vertices(whole, plane));
  return planes;
}

void CutMaker::place_pins(const Mesh& whole) {
  placed_ = true;
  pins_.clear();
  Mesh taken = whole;
  append(taken, kept_out());
  for (std::size_t n = 0; n < planes_.size(); ++n) {
    // In later passes the cavity moves a little: room for that, too.
    PinHole hole = hole_;
    hole.wall_mm *= 1.05;
    std::vector<Eigen::Vector3d> places = pin_places(taken, planes_, n, hole, progress_);
    if (places.size() < 2) {
      hole.depth_mm = half_length_mm(1.5) + kEndRoom_mm;
      if (auto more = pin_places(taken, planes_, n, hole, progress_); more.size() > places.size())
        places = std::move(more);
      else
        hole.depth_mm = hole_.depth_mm;
    }
    for (const Eigen::Vector3d& p : places) {
      constexpr int kSides = 32;
      Prism prism{p, planes_[n].normal, hole.radius_mm, -hole.depth_mm, hole.depth_mm, kSides};
      Pin& pin = pins_.emplace_back();
      pin.room = surface_of(prism);
      prism.radius_mm = 0.5 * cut_.pin_diameter_mm;
      prism.lo_mm = -(prism.hi_mm = hole.depth_mm - kEndRoom_mm);
      prism.fit = Prism::Fit::same_area;
      pin.body = surface_of(prism);
      Mesh room = pin.room;
      flip(room);
      append(taken, room);
    }
  }
}

Mesh CutMaker::kept_out() const {
  Mesh kept = body_.query->mesh();
  kept.triangles.erase(kept.triangles.begin(), kept.triangles.begin() + body_.kept_from());
  flip(kept);
  return transformed(kept, body_.to_working.inverse());
}

bool CutMaker::pins_have_room(const Mesh& whole) const {
  const SurfaceQuery surface(whole);
  return std::all_of(pins_.begin(), pins_.end(),
                     [&](const Pin& pin) { return smallest_gap(pin.room, surface, progress_) >= 0.99 * hole_.wall_mm; });
}

Eigen::Vector3d CutMaker::up_of(const Mesh& piece) const {
  const double flat_mm = 1e-9 * body_.diagonal_mm;
  Eigen::Vector3d up = body_.to_working.linear().row(2).transpose();
  double largest = 0;
  for (const Cut::Plane& plane : planes_)
    for (const double side : {1.0, -1.0}) {
      double area = 0;  // of what lies in the plane and faces it from that side
      for (std::size_t t = 0; t < piece.triangles.size(); ++t) {
        const auto in_plane = [&](int k) { return std::abs(plane.normal.dot(piece.corner(t, k)) - plane.offset_mm) < flat_mm; };
        if (!in_plane(0) || !in_plane(1) || !in_plane(2)) continue;
        area -=
            0.5 * side * plane.normal.dot((piece.corner(t, 1) - piece.corner(t, 0)).cross(piece.corner(t, 2) - piece.corner(t, 0)));
      }
      if (area <= largest) continue;
      largest = area;
      up = side * plane.normal;
    }
  return up;
}

std::vector<Part> CutMaker::pieces_of(Mesh whole, const Part& like) const {
  for (const Pin& pin : pins_) {
    Mesh room = pin.room;
    flip(room);
    append(whole, room);
  }
  std::vector<Mesh> meshes = {with_merged_vertices(whole)};
  for (const Cut::Plane& plane : planes_) {
    std::vector<Mesh> cut;
    for (const Mesh& mesh : meshes) {
      Halves two = halves(mesh, {plane.normal, plane.offset_mm}, progress_);
      for (Mesh* half : {&two.above, &two.below})
        if (!half->triangles.empty()) cut.push_back(std::move(*half));
    }
    meshes = std::move(cut);
  }
  std::vector<Part> pieces;
  for (const Mesh& mesh : meshes)
    for (Mesh& body : split(mesh, bodies_of(mesh, progress_))) {
      Part piece = like;
      piece.mesh = std::move(body);
      piece.name = "piece " + std::to_string(pieces.size() + 1);
      lay_down(piece, up_of(piece.mesh));
      pieces.push_back(std::move(piece));
    }
  lay_side_by_side(pieces);
  return pieces;
}

Made CutMaker::made() const {
  Made made = maker_->made();
  const Part whole = std::move(made.delivery.parts.front());
  made.delivery.parts = pieces_of(united(whole.mesh), whole);
  for (const Pin& pin : pins_)
    made.delivery.parts.push_back({.mesh = pin.body, .role = Part::Role::insert, .density_g_cm3 = print_.density_g_cm3});
  return made;
}

}  // namespace

std::unique_ptr<Maker> cut_maker(std::unique_ptr<Maker> maker, const Body& body, Print& print, const Progress& progress) {
  return std::make_unique<CutMaker>(std::move(maker), body, print, progress);
}

}  // namespace rayrep::detail
