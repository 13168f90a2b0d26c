#include "make/body.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/text.h"
#include "make/fixed.h"
#include "make/kept_bodies.h"
#include "rayrep/base/error.h"
#include "rayrep/mesh/boolean.h"
#include "rayrep/mesh/mesh_check.h"
#include "rayrep/physics/hydrostatics.h"
#include "rays/kept_solid.h"

namespace rayrep::detail {
namespace {

/// The grid on which the cavity is meshed: as fine as the rays, but not finer than a printer of such walls sees, nor so coarse that
/// the wall's own shape is lost.
double field_spacing(double ray_spacing_mm, double wall_mm, double size_mm) {
  const double printer_mm = std::min(0.25 * wall_mm, size_mm / 100);
  return std::min(std::max(ray_spacing_mm, printer_mm), 0.5 * wall_mm);
}

/// Cells of the field over the clearance of pillars: they must not fall between samples.
constexpr double kOfClearance = 0.6;
/// Cells of the field over the longest side: finer ones take too much memory.
constexpr double kFinest = 1e-3;

InnerDomainOptions inner_options(const Discretisation& options, double size_mm) {
  InnerDomainOptions inside;
  inside.wall_mm = options.wall_mm;
  inside.ray_spacing_mm = size_mm / options.resolution;
  inside.field_spacing_mm = field_spacing(inside.ray_spacing_mm, options.wall_mm, size_mm);
  if (options.look_only) inside.field_spacing_mm = std::max(inside.field_spacing_mm, 0.5 * inside.ray_spacing_mm);
  if (!options.pillars.empty())
    inside.field_spacing_mm = std::min(inside.field_spacing_mm, kOfClearance * options.pillar_clearance_mm);
  inside.min_component_mm3 = options.min_cavity_mm3;
  return inside;
}

/// Volume of the inner domain as the field has it: of each sample the part of its cell that a plane at its distance leaves inside.
double volume_mm3(const BlockField& field) {
  const double cell = std::pow(field.spacing_mm, 3);
  double cells = 0;
  for (const std::int32_t state : field.state)
    if (state == BlockField::kInside) cells += std::pow(BlockField::kSide, 3);
  for (const BlockField::Block& block : field.samples)
    for (const float value : block) cells += std::clamp(0.5 - static_cast<double>(value) / field.spacing_mm, 0.0, 1.0);
  return cells * cell;
}

/// With rods where posts are to stand, and what is kept solid.
std::shared_ptr<const SurfaceQuery> with_posts(const Mesh& working, const Eigen::Affine3d& to_working,
                                               const Discretisation& options) {
  std::vector<Mesh> rooms;
  for (const Mesh& room : options.rooms) rooms.push_back(transformed(room, to_working));
  Mesh mesh = working;
  append(mesh, posts_below(rooms, working, options.wall_mm));
  for (const Mesh& kept : options.keep_solid) append(mesh, transformed(kept, to_working));
  SurfaceQuery::Farther farther;
  if (!options.pillars.empty())
    farther = {static_cast<int>(mesh.triangles.size()), std::max(0.0, options.wall_mm - options.pillar_clearance_mm)};
  for (const Mesh& pillar : options.pillars) append(mesh, transformed(pillar, to_working));
  return std::make_shared<const SurfaceQuery>(mesh, farther);
}

bool lies_in_several(const SurfaceQuery& surface, const Eigen::Vector3d& p) { return winding_at(surface, p) > 1; }

/// Built, or kept from before.
std::shared_ptr<Body> body_in(const Eigen::Affine3d& frame, Mesh mesh, const Discretisation& options, const Progress& progress) {
  if (options.kept) return options.kept->body(frame, mesh, options, progress);
  return std::make_shared<Body>(std::move(mesh), frame, options, progress);
}

/// @throws Error{usage} where what is kept solid takes all of a body
void require_left(const Mesh& outer, const Discretisation& options, const Progress& progress) {
  if (options.keep_solid.empty()) return;
  std::vector<Mesh> operands = {outer};
  operands.insert(operands.end(), options.keep_solid.begin(), options.keep_solid.end());
  const double left_mm3 = mesh_moments(combined(operands, {.operation = BooleanOperation::subtract}, progress).mesh)[M1];
  if (left_mm3 > 1e-6 * mesh_moments(outer)[M1]) return;
  Eigen::AlignedBox3d box;
  for (const Mesh& region : options.keep_solid) box.extend(bounding_box(region));
  throw Error(ErrorCode::usage,
              concat("Nothing remains inside: what is kept solid (--keep-solid) takes all of the body. It reaches from ",
                     shown_to_thousandths(box.min()), " to ", shown_to_thousandths(box.max()), " mm, the body from ",
                     shown_to_thousandths(bounding_box(outer).min()), " to ", shown_to_thousandths(bounding_box(outer).max()),
                     ". Its mesh is taken in mm, where it is in the body after --unit and --size: keep less of it solid."));
}

}  // namespace

Discretisation discretisation(const Print& print, const HollowOptions& options) {
  // Slicers do not see less: the lines of infill are as far apart.
  constexpr double kSmallestSparse_mm3 = 100;
  constexpr double kSmallestDrained = 1.5;
  const bool sparse = print.infill.wanted();
  Discretisation result;
  result.wall_mm = print.wall_mm;
  result.resolution = options.resolution;
  result.min_cavity_mm3 = sparse ? std::max(kSmallestSparse_mm3, options.min_cavity_mm3) : options.min_cavity_mm3;
  // What is too small for its holes is not worth them.
  if (print.drains.where == Drains::Where::found) {
    result.hole_mm = print.drains.diameter_mm;
    result.min_cavity_mm3 = std::max(result.min_cavity_mm3, std::pow(kSmallestDrained * result.hole_mm, 3));
  }
  result.look_only = options.look_only;
  result.phases = phases_of(print);
  result.rooms = rooms_of(options.fixed);
  result.fixed = fixed_moments(options.fixed, print.density_g_cm3);
  result.keep_solid = options.keep_solid;
  result.pillars = options.pillars;
  result.pillar_clearance_mm = options.pillar_clearance_mm;
  result.kept = options.kept;
  return result;
}

double least_pillar_clearance_mm(double size_mm) { return kFinest * size_mm / kOfClearance; }

void check(const HollowOptions& options, const Spec& spec) {
  HollowOptions copy = options;
  rayrep::check(settings(copy, spec));
  if (print_of(spec).core.volume_cm3) {
    if (options.solver != Solver::quadric)
      throw Error(ErrorCode::usage,
                  "Only --solver quadric knows a limit on the core: leave --core-volume out, or the other solver.");
    if (const SpinSpec* spin = std::get_if<SpinSpec>(&spec); spin && spin->certify)
      throw Error(ErrorCode::usage, "--certify does not know a limit on the core: leave it or --core-volume out.");
  }
  if (print_of(spec).drains.wanted() && options.as_printed)
    throw Error(ErrorCode::usage,
                "What a slicer makes of holes and plugs is not fed back: leave the holes out (--drain, --resin), or the slicer.");
  for (const Mesh& kept : options.keep_solid)
    if (!(mesh_moments(kept)[M1] > 0))
      throw Error(ErrorCode::usage, "What is kept solid needs a closed surface that faces outward (--keep-solid).");
  if (options.max_passes < 1) throw Error(ErrorCode::usage, "At least one pass is needed.");
}

Body::Body(Mesh mesh, const Eigen::Affine3d& frame, const Discretisation& options, const Progress& progress)
    : outer(std::move(mesh)),
      to_working(frame),
      working(transformed(outer, to_working)),
      hull(outer_hull(working)),
      query(with_posts(working, to_working, options)),
      phases_(options.phases),
      kept_from_(
          static_cast<int>(surface.mesh().triangles.size() - triangles_of(options.keep_solid) - triangles_of(options.pillars))) {
  const bool has_sealed_cavities = hull.triangles.size() < working.triangles.size();
  hull = boundary_of_union(hull, progress);
  if (options.require) options.require(hull);
  solid = mesh_moments(has_sealed_cavities ? boundary_of_union(working, progress) : hull);
  solid += moment_map(to_working) * options.fixed;
  const Eigen::AlignedBox3d box = bounding_box(working);
  size_mm = box.sizes().maxCoeff();
  diagonal_mm = box.diagonal().norm();
  height_mm = box.sizes().z();
  find_inside(options, progress);
}

Body::Body(const Body& outside, const Discretisation& options, const Progress& progress)
    : outer(outside.outer),
      to_working(outside.to_working),
      working(outside.working),
      hull(outside.hull),
      solid(outside.solid),
      size_mm(outside.size_mm),
      diagonal_mm(outside.diagonal_mm),
      height_mm(outside.height_mm),
      query(outside.query),
      phases_(options.phases),
      kept_from_(outside.kept_from_),
      prepared_(outside.prepared_) {
  if (options.require) options.require(hull);
  find_inside(options, progress);
}

void Body::find_inside(const Discretisation& options, const Progress& progress) {
  const InnerDomainOptions inside = inner_options(options, size_mm);
  if (inside.field_spacing_mm < (1 - 1e-9) * kFinest * size_mm)
    throw Error(ErrorCode::goal, "A wall of " + number(options.wall_mm, 3) + " mm is too thin to be resolved in a body " +
                                     number(size_mm, 1) + " mm long: choose at least " + number(size_mm / 500, 3) +
                                     " mm (--wall). If the body is not meant to be that long, set --unit or --size.");
  inner = domain(inside, progress);
  if (inner.rays.intervals.empty()) throw Error(ErrorCode::goal, nothing_inside(options, progress));
  integrals.emplace(inner.rays);
  shell = lightest(*integrals);
}

InnerDomain Body::domain(const InnerDomainOptions& options, const Progress& progress) const {
  InnerDomain found = detail::inner_domain({surface, kept_from_}, options, progress);
  RayGrid& grid = found.rays.grid;
  grid.weight = phases_.heavy - phases_.light;
  grid.most_mm3 = phases_.most_mm3;
  grid.substitute = (1 - phases_.light) / grid.weight;
  return found;
}

Moments Body::lightest(const RayIntegrals& rays) const { return solid - rays.grid().substitute * rays.full(); }

const PreparedHull& Body::prepared_hull() {
  if (!prepared_) prepared_.emplace(hull);
  return *prepared_;
}

double Body::missed() const {
  const double whole = volume_mm3(inner.field);
  return whole > 0 ? std::abs(inner.rays.volume_mm3() + inner.dropped_mm3 - whole) / whole : 0;
}

std::string scarce_words(const RayGrid& grid) {
  if (!std::isfinite(grid.most_mm3)) return {};
  return " There are no more than " + shown(grid.most_mm3 / 1000) + " cm3 of heavy material to do it with.";
}

std::shared_ptr<Body> resolved_body(Mesh mesh, const Eigen::Affine3d& frame, Discretisation options, const Progress& progress) {
  constexpr double allowed = 0.01;
  const int finest = options.look_only ? options.resolution : std::min(4 * options.resolution, 1600);
  // The slope of lines that meet the rows of a grid most evenly.
  const Eigen::AngleAxisd turn(std::atan(2 - std::numbers::phi), Eigen::Vector3d::UnitZ());
  std::shared_ptr<Body> body = body_in(frame, std::move(mesh), options, progress);
  if (body->missed() <= allowed) return body;
  progress.begin("domain");
  body = body_in(turn * frame, body->outer, options, progress);
  while (body->missed() > allowed && 2 * options.resolution <= finest) {
    options.resolution *= 2;
    body = body_in(turn * frame, body->outer, options, progress);
  }
  return body;
}

bool Body::refine(const Discretisation& options, const Progress& progress) {
  const double finest_mm = std::max(0.25 * options.wall_mm, kFinest * size_mm);
  if (inner.field.spacing_mm < 1.2 * finest_mm) return false;
  progress.begin("domain");
  InnerDomainOptions finer = inner_options(options, size_mm);
  finer.field_spacing_mm = finest_mm;
  inner.field = domain(finer, progress).field;
  return true;
}

std::string Body::nothing_inside(const Discretisation& options, const Progress& progress) const {
  require_left(outer, options, progress);
  const std::string regions = options.keep_solid.empty() ? "" : " and what is kept solid (--keep-solid)";
  const std::string cones = options.pillars.empty() ? "" : " and cones on pillars (--self-supporting)";
  const std::string kept = regions.empty() && cones.empty() ? "" : " around the surface" + regions + cones;
  const std::string wall = "a wall of " + number(options.wall_mm, 2) + " mm" + kept;
  const Eigen::Vector3d size = bounding_box(outer).sizes();
  const std::string measures = " The body measures " + shown(size.x(), 4) + " x " + shown(size.y(), 4) + " x " +
                               shown(size.z(), 4) +
                               " mm: if that is not what you meant, set the unit (--unit) or the size (--size).";
  if (inner.dropped_components > 0)
    return "What is inside " + wall + " is too small " +
           (options.hole_mm > 0 ? "for holes of " + number(options.hole_mm, 2) + " mm (--drain-diameter)" : "to print") + ": " +
           shown(inner.dropped_mm3, 2) + " mm3 in " + plural(inner.dropped_components, "place", "places") + ", and one takes " +
           shown(options.min_cavity_mm3, 3) + " mm3." + measures;
  if (!kept.empty()) return "Nothing remains inside " + wall + ".";
  const ClosestPoint deepest = deepest_point(surface, progress);
  const Eigen::Vector3d p = to_working.inverse() * deepest.point_mm;
  const std::string place = "(" + number(p.x(), 2) + ", " + number(p.y(), 2) + ", " + number(p.z(), 2) + ")";
  if (deepest.distance_mm > options.wall_mm && lies_in_several(surface, deepest.point_mm))
    throw Error(ErrorCode::input,
                "Nothing remains inside: bodies of the mesh lie in each other, and where they do, as at " + place +
                    ", they stay solid. Unite them in the program that they come from, or leave all but one out.");
  return "Nothing remains inside " + wall + ": the deepest point, at " + place + ", is only " + shown(deepest.distance_mm, 3) +
         " mm from the surface" + (deepest.distance_mm > options.wall_mm ? " and the room around it is too small to print." : ".") +
         measures;
}

RayRep Body::inner_with(double wall_mm, double spacing_mm, const Progress& progress) const {
  InnerDomainOptions options;
  options.wall_mm = wall_mm;
  options.ray_spacing_mm = options.field_spacing_mm = spacing_mm;
  const Progress quiet{.stage = {}, .cancelled = progress.cancelled};
  return domain(options, quiet).rays;
}

}  // namespace rayrep::detail
