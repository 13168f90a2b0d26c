#include "make/yoyo.h"

#include <algorithm>
#include <string>

#include "base/text.h"
#include "make/pieces.h"
#include "mesh/reach.h"
#include "mesh/surface_gap.h"
#include "rayrep/base/error.h"
#include "rayrep/mesh/assembly.h"
#include "rayrep/mesh/bodies.h"
#include "rayrep/mesh/boolean.h"
#include "rayrep/mesh/mesh_check.h"
#include "rayrep/mesh/surface_query.h"
#include "rayrep/physics/axle.h"
#include "rayrep/physics/core.h"

namespace rayrep::detail {
namespace {

constexpr double kLeastGap_mm = 0.5;  // that --gap may be
constexpr const char* kInOnePiece = " --axle none makes it in one piece.";

AxleFit fitted(const SpinSpec& spec, double reach) { return fit(spec.axle, *spec.centre_mm, spec.up.normalized(), reach); }

/// How far what is put in lies from the surface; 0 where it comes out of it.
double room_mm(const SurfaceQuery& surface, const AxleFit& axle, const Progress& progress) {
  double gap_mm = smallest_gap(axle.bore, surface, progress);
  for (std::size_t n = 2; n < axle.taken.size(); ++n) gap_mm = std::min(gap_mm, smallest_gap(axle.taken[n], surface, progress));
  return is_inside(surface, axle.bore.vertices.front()) ? std::max(gap_mm, 0.0) : 0;
}

/// Of what would be another axle, if it has room.
std::string where_it_fits(const char* words, SpinSpec other, const SurfaceQuery& surface, const Progress& progress) {
  return room_mm(surface, fitted(other, 1), progress) >= other.print.wall_mm ? words : "";
}

/// @throws Error{goal} where what is put in is not in the body, or nearer to its surface than the wall
void require_room(const Mesh& outer, const AxleFit& axle, const SpinSpec& spec, const Progress& progress) {
  const SurfaceQuery surface(outer);
  const double gap_mm = room_mm(surface, axle, progress);
  if (gap_mm > 0 && gap_mm >= spec.print.wall_mm) return;
  SpinSpec thinner = spec;
  thinner.axle.kind = Axle::Kind::m4;
  SpinSpec nearer = spec;
  nearer.axle.gap_mm = std::min(spec.axle.gap_mm, kLeastGap_mm);
  const std::string what = std::string("The axle, ") + words_of(spec.axle.kind) + " " + number(axle.rod_length_mm, 1) + " mm long" +
                           (axle.across_mm > axle.rod_diameter_mm ? " and " + number(axle.across_mm, 0) + " mm across" : "");
  const std::string instead = " Choose " + where_it_fits("a thinner one (--axle m4), ", thinner, surface, progress) +
                              where_it_fits("a smaller gap (--gap), ", nearer, surface, progress) +
                              "another centre (--center) or a larger body (--size)." + kInOnePiece;
  if (!(gap_mm > 0)) throw Error(ErrorCode::goal, what + ", has no room in the body: it comes out of it." + instead);
  throw Error(ErrorCode::goal, what + ", comes within " + number(gap_mm, 2) + " mm of the surface, less than the wall of " +
                                   number(spec.print.wall_mm, 2) + " mm." + instead);
}

/// Hands everything on, and takes what was made apart.
class YoyoMaker final : public Maker {
public:
  YoyoMaker(std::unique_ptr<Maker> maker, const SpinSpec& spec) : maker_(std::move(maker)), spec_(spec), axle_(fitted(spec, 1)) {}

  void make(const Switching& switching) override { maker_->make(switching); }
  void make_anew(const Switching& switching) override { maker_->make_anew(switching); }
  bool refine() override { return maker_->refine(); }
  bool take_all() override { return maker_->take_all(); }
  bool adapted() const override { return maker_->adapted(); }
  bool spoilt() const override { return maker_->spoilt(); }
  const Moments& moments() const override { return maker_->moments(); }

  Made made() const override {
    Made made = maker_->made();
    const Part whole = std::move(made.delivery.parts.front());
    const Eigen::Vector3d up = spec_.up.normalized();
    const Halves sides = halves(with_merged_vertices(whole.mesh), {up, up.dot(*spec_.centre_mm)});
    std::vector<Part> pieces(2, whole);
    pieces[0].mesh = sides.above;
    pieces[1].mesh = sides.below;
    pieces[0].name = "half 1";
    pieces[1].name = "half 2";
    lay_down(pieces[0], up);
    lay_down(pieces[1], -up);
    lay_side_by_side(pieces);
    made.delivery.parts = std::move(pieces);
    made.delivery.parts.insert(made.delivery.parts.end(), axle_.steel.begin(), axle_.steel.end());
    return made;
  }

private:
  std::unique_ptr<Maker> maker_;
  const SpinSpec& spec_;
  AxleFit axle_;
};

}  // namespace

Mesh outside_of_halves(const Mesh& outer, const SpinSpec& spec, const Progress& progress) {
  const AxleFit axle = fitted(spec, 2 * std::max(1.0, reach_mm(outer, *spec.centre_mm)));
  require_room(boundary_of_union(outer, progress), axle, spec, progress);
  std::vector<Mesh> operands = {outer};
  operands.insert(operands.end(), axle.taken.begin(), axle.taken.end());
  Mesh mesh = combined(operands, {.operation = BooleanOperation::subtract}, progress).mesh;
  if (const int bodies = bodies_of(mesh, progress).count; bodies != 2)
    throw Error(ErrorCode::goal, "The gap for the string would leave " + std::to_string(bodies) +
                                     " pieces of it, and the axle holds two: choose another centre (--center), another axis (--up) "
                                     "or a smaller gap (--gap)." +
                                     kInOnePiece);
  return mesh;
}

Moments axle_moments(const SpinSpec& spec) { return insert_moments(Delivery{fitted(spec, 1).steel}, spec.print.density_g_cm3); }

std::unique_ptr<Maker> yoyo_maker(std::unique_ptr<Maker> maker, const SpinSpec& spec) {
  return std::make_unique<YoyoMaker>(std::move(maker), spec);
}

}  // namespace rayrep::detail
