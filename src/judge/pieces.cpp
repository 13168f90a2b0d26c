#include "judge/pieces.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "base/text.h"
#include "judge/overhang.h"
#include "judge/verify_detail.h"
#include "mesh/reach.h"
#include "mesh/shells.h"
#include "mesh/surface_gap.h"
#include "rayrep/mesh/assembly.h"
#include "rayrep/mesh/boolean.h"
#include "rayrep/mesh/surface_query.h"
#include "rayrep/physics/axle.h"

namespace rayrep::verify_detail {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A piece in its place in the whole, and on the bed.
struct Piece {
  const Part& part;
  Mesh mesh;  ///< vertices merged
  Mesh placed;
  Eigen::AlignedBox3d box;  ///< on the bed
  double bed_area_mm2 = 0;  ///< with which it lies there
  Overhang inside = {};     ///< as it lies there

  Eigen::Vector3d up() const { return part.to_bed.linear().row(2).transpose(); }
  double bed_mm() const { return -part.to_bed.translation().z(); }  ///< along up
};

bool is_rigid(const Eigen::Affine3d& motion) {
  const Eigen::Matrix3d turn = motion.linear();
  return (turn.transpose() * turn - Eigen::Matrix3d::Identity()).norm() < 1e-9 && turn.determinant() > 0;
}

double area_on_bed(const Mesh& placed, double rounding_mm) {
  double area = 0;
  for (std::size_t t = 0; t < placed.triangles.size(); ++t) {
    const auto down = [&](int k) { return std::abs(placed.corner(t, k).z()) <= rounding_mm; };
    if (down(0) && down(1) && down(2))
      area -= 0.5 * (placed.corner(t, 1) - placed.corner(t, 0)).cross(placed.corner(t, 2) - placed.corner(t, 0)).z();
  }
  return area;
}

std::vector<Piece> pieces_of(const Delivery& delivered, double rounding_mm) {
  std::vector<Piece> pieces;
  for (const Part& part : delivered.parts) {
    if (part.role != Part::Role::body || part.name.empty()) continue;
    Mesh mesh = merged_mesh(part.mesh);
    Mesh placed = mesh;
    for (Eigen::Vector3d& v : placed.vertices) v = part.to_bed * v;
    const Eigen::AlignedBox3d box = bounding_box(placed);
    const double area = area_on_bed(placed, rounding_mm);
    pieces.push_back({part, std::move(mesh), std::move(placed), box, area});
  }
  return pieces;
}

/// Of what faces inward in a piece.
std::size_t sealed_in(const Mesh& mesh) {
  const Components shells = connected_components(mesh);
  std::size_t count = 0;
  for (const double volume : shell_volumes(mesh, shells.of_triangle, shells.count)) count += volume < 0;
  return count;
}

std::size_t sealed_cavities(const Delivery& delivered) {
  std::size_t count = 0;
  for (const Part& part : delivered.parts)
    if (part.role == Part::Role::body && !part.name.empty()) count += sealed_in(merged_mesh(part.mesh));
  return count;
}

/// The smallest gap between the boxes of two pieces, seen from above; negative where they overlap.
double smallest_gap_on_bed(const std::vector<Piece>& pieces) {
  double smallest = kInfinity;
  for (std::size_t a = 0; a < pieces.size(); ++a)
    for (std::size_t b = a + 1; b < pieces.size(); ++b) {
      const Eigen::Array2d gap =
          (pieces[a].box.min() - pieces[b].box.max()).cwiseMax(pieces[b].box.min() - pieces[a].box.max()).head<2>().array();
      smallest = std::min(smallest, gap.maxCoeff());
    }
  return smallest;
}

/// Whether a room is no larger than a pin in it needs.
bool is_for(const Eigen::AlignedBox3d& pin, const Eigen::AlignedBox3d& room) {
  constexpr double kMost_mm = 2;  // of clearance, and of air behind its ends
  return ((room.sizes() - pin.sizes()).array() <= 2 * kMost_mm).all();
}

/// Between the rooms of pins, of the cavities those that hold something that is put in, and all others. A pin (of what is printed)
/// that stands in a cavity has none.
/// @returns 0 for such a pin
double wall_at_pins(const Delivery& delivered, const Mesh& whole, double density_g_cm3, const Progress& progress) {
  const Components shells = connected_components(whole);
  const std::vector<double> volumes = shell_volumes(whole, shells.of_triangle, shells.count);
  const std::vector<Mesh> parts = split(whole, shells);
  std::vector<char> is_room(parts.size(), 0);
  for (const Part& part : delivered.parts) {
    if (part.role != Part::Role::insert) continue;
    const Eigen::AlignedBox3d box = bounding_box(part.mesh);
    std::size_t smallest = parts.size();
    for (std::size_t s = 0; s < parts.size(); ++s)
      if (volumes[s] < 0 && bounding_box(parts[s]).contains(box) && (smallest == parts.size() || volumes[s] > volumes[smallest]))
        smallest = s;
    if (smallest == parts.size()) continue;
    if (part.density_g_cm3 == density_g_cm3 && !is_for(box, bounding_box(parts[smallest]))) return 0;
    is_room[smallest] = 1;
  }
  Mesh rooms;
  Mesh others;
  for (std::size_t s = 0; s < parts.size(); ++s)
    if (volumes[s] < 0) append(is_room[s] ? rooms : others, parts[s]);
  if (rooms.triangles.empty() || others.triangles.empty()) return kInfinity;
  return smallest_gap(rooms, SurfaceQuery(others), progress);
}

Moments moments_of_all(const std::vector<Piece>& pieces) {
  Moments sum = Moments::Zero();
  for (const Piece& piece : pieces) sum += mesh_moments(piece.mesh);
  return sum;
}

/// "lies on the bed with 12.3 cm2 ..." of each, for JSON.
std::vector<Record> records(const std::vector<Piece>& pieces, double density_g_cm3) {
  std::vector<Record> all;
  for (const Piece& piece : pieces) {
    const MassProperties mass = mass_properties(piece.mesh, density_g_cm3);
    const Eigen::Vector3d size = piece.box.sizes();
    const Eigen::Vector3d up = piece.up();
    all.push_back({{"name", piece.part.name},
                   {"volume_mm3", mass.volume_mm3},
                   {"mass_g", mass.mass_g},
                   {"size_x_mm", size.x()},
                   {"size_y_mm", size.y()},
                   {"size_z_mm", size.z()},
                   {"bed_area_mm2", piece.bed_area_mm2},
                   {"up_x", up.x()},
                   {"up_y", up.y()},
                   {"up_z", up.z()},
                   {"cut_offset_mm", piece.bed_mm()},
                   {"roof_mm2", piece.inside.roof_mm2},
                   {"roof_share", piece.inside.roof_share()},
                   {"widest_bridge_mm", piece.inside.bridge_mm},
                   {"hanging_islands", static_cast<double>(piece.inside.islands)},
                   {"sealed_mm3", piece.inside.sealed_mm3}});
  }
  return all;
}

bool finds_planes(const Spec& spec) { return print_of(spec).cut.where == Cut::Where::found; }

const SpinSpec* with_axle(const Spec& spec) {
  const SpinSpec* spin = std::get_if<SpinSpec>(&spec);
  return spin && has_axle(spin->axle) ? spin : nullptr;
}

AxleFit axle_of(const SpinSpec& spec, const Mesh& body) {
  const Eigen::AlignedBox3d box = bounding_box(body);
  const Eigen::Vector3d centre = spec.centre_mm.value_or(box.center());
  return fit(spec.axle, centre, spec.up.normalized(), 2 * std::max(1.0, reach_mm(body, centre)));
}

/// What is inside when they are put together: cavities, holes of pins, and what was taken for an axle but for the gap.
Mesh rooms_of(const Spec& spec, const Mesh& whole, const Progress& progress) {
  Mesh rooms = cavities_of(whole);
  if (const SpinSpec* spin = with_axle(spec)) {
    const std::vector<Mesh> taken = axle_of(*spin, whole).taken;
    Mesh bore = combined({taken.begin() + 1, taken.end()}, {}, progress).mesh;
    flip(bore);
    append(rooms, bore);
  }
  return with_merged_vertices(rooms);
}

PrintedUp lying(const Piece& piece) { return {.direction = piece.up(), .bed_mm = piece.bed_mm()}; }

/// "Inside them, as they lie there, most roofs flatter than 45 degrees are in piece 1 ..."
std::string roof_words(const std::vector<Piece>& pieces) {
  const auto worst = [&](auto&& less) -> const Piece& {
    return *std::max_element(pieces.begin(), pieces.end(),
                             [&](const Piece& a, const Piece& b) { return less(a.inside, b.inside); });
  };
  const Piece& flattest = worst([](const Overhang& a, const Overhang& b) { return a.roof_mm2 < b.roof_mm2; });
  const Piece& widest = worst([](const Overhang& a, const Overhang& b) { return a.bridge_mm < b.bridge_mm; });
  if (flattest.inside.roof_mm2 == 0) return "Inside them no roof is flatter than 45 degrees as they lie there.";
  const bool same = flattest.inside.bridge_mm >= 0.98 * widest.inside.bridge_mm;  // to which it is known
  return "Inside them, as they lie there, " + flattest.part.name + " has the most roofs flatter than 45 degrees (" +
         number(flattest.inside.roof_mm2, 1) + " mm2) and " + (same ? "" : widest.part.name + " ") + "the widest bridge (" +
         number(widest.inside.bridge_mm, 1) + " mm).";
}

/// "piece 1: 12.3 g, 40 x 30 x 20 mm"
std::string words_of(const Piece& piece, double density_g_cm3) {
  const Eigen::Vector3d size = piece.box.sizes();
  return piece.part.name + " " + number(mass_properties(piece.mesh, density_g_cm3).mass_g, 2) + " g, " + number(size.x(), 1) +
         " x " + number(size.y(), 1) + " x " + number(size.z(), 1) + " mm";
}

/// By its moments of inertia, m r^2 / 2 along and m (3 r^2 + h^2) / 12 across.
double length_of_cylinder(const Mesh& mesh) {
  const MassProperties mass = mass_properties(mesh, 1);
  return std::sqrt(std::max(0.0, (12 * mass.principal_moments_g_mm2[2] - 6 * mass.principal_moments_g_mm2[0]) / mass.mass_g));
}

/// What of all of them hangs in the air while they are printed.
void tell_roofs(const std::vector<Piece>& pieces, Verdict& verdict) {
  Overhang all;
  for (const Piece& piece : pieces) all += piece.inside;
  if (all.surface_mm2 == 0) return;
  verdict.meaning.push_back(roof_words(pieces));
  for (Figure& figure : roof_figures(all)) verdict.figures.push_back(std::move(figure));
}

void say(const std::vector<Piece>& pieces, const Delivery& delivered, const Spec& spec, Verdict& verdict) {
  std::string text = "It is printed in " + plural(pieces.size(), "piece, which lies", "pieces, which lie") + " flat on the bed: ";
  const double density_g_cm3 = print_of(spec).density_g_cm3;
  for (const Piece& piece : pieces) text += (&piece == &pieces.front() ? "" : "; ") + words_of(piece, density_g_cm3);
  verdict.meaning.push_back(text + ".");
  tell_roofs(pieces, verdict);
  if (const SpinSpec* spin = with_axle(spec)) {
    const AxleFit axle = axle_of(*spin, delivered.body());
    verdict.meaning.push_back(std::string("The halves are held by ") + rayrep::words_of(spin->axle.kind) + ", " +
                              number(axle.rod_length_mm, 1) + " mm long, pushed home in both: then they are " +
                              number(spin->axle.gap_mm, 1) + " mm apart.");
    return;
  }
  std::vector<double> lengths;
  for (const Part& part : delivered.parts)
    if (part.role == Part::Role::insert && part.density_g_cm3 == print_of(spec).density_g_cm3)
      lengths.push_back(length_of_cylinder(part.mesh));
  if (lengths.empty()) {
    if (!delivered.has_inserts())
      verdict.notes.push_back(
          "There are no pins between the pieces: glue them seam on seam. A hole for one keeps a wall (--wall) on either side of "
          "it, for which the wall around a cavity alone is never thick enough: where more is solid, thinner pins (--pin-diameter) "
          "or another plane (--cut) may find room.");
    return;
  }
  const auto [shortest, longest] = std::minmax_element(lengths.begin(), lengths.end());
  const std::string range = *longest - *shortest < 0.05 ? number(*longest, 1) : number(*shortest, 1) + " to " + number(*longest, 1);
  verdict.meaning.push_back(plural(lengths.size(), "pin", "pins") + " of the print's density, " + range + " mm long, " +
                            (lengths.size() > 1 ? "hold" : "holds") + " them in place.");
}

/// The steel that is in two halves, which tell how far apart they are; none where it is of no axle.
Axle axle_in(const Delivery& delivered) {
  std::vector<const Part*> halves;
  std::vector<double> put_in_g;
  const auto mass_g = [](const Part& part) { return mass_properties(part.mesh, part.density_g_cm3).mass_g; };
  for (const Part& part : delivered.parts) {
    if (part.role == Part::Role::body && !part.name.empty()) halves.push_back(&part);
    if (part.role == Part::Role::insert) put_in_g.push_back(mass_g(part));
  }
  if (halves.size() != 2) return {};
  const Eigen::Vector3d up = halves[0]->to_bed.linear().row(2);
  const double gap_mm = -halves[0]->to_bed.translation().z() - halves[1]->to_bed.translation().z();
  const auto is_put_in = [&](const Part& steel) {
    return std::any_of(put_in_g.begin(), put_in_g.end(), [&](double g) { return std::abs(g - mass_g(steel)) < 1e-6 * g; });
  };
  for (const Axle::Kind kind : {Axle::Kind::bearing_608, Axle::Kind::m4, Axle::Kind::rod_8mm}) {
    const Axle axle{kind, gap_mm};
    const std::vector<Part> steel = fit(axle, Eigen::Vector3d::Zero(), up, 1).steel;
    if (gap_mm > 0 && std::all_of(steel.begin(), steel.end(), is_put_in)) return axle;
  }
  return {};
}

}  // namespace

Spec judged_in_pieces(const Delivery& delivered, const Mesh* original, Spec spec) {
  if (SpinSpec* spin = std::get_if<SpinSpec>(&spec); spin && spin->yoyo && !has_axle(spin->axle)) spin->axle = axle_in(delivered);
  if (SpinSpec* spin = std::get_if<SpinSpec>(&spec); spin && has_axle(spin->axle) && !spin->centre_mm && original)
    spin->centre_mm = bounding_box(*original).center();
  if (sealed_cavities(delivered) == 0) print_of(spec).drained = true;
  return spec;
}

std::vector<Mesh> allowed_to_be_taken(const Spec& spec, const Mesh& body) {
  const SpinSpec* spin = with_axle(spec);
  return spin ? axle_of(*spin, body).taken : std::vector<Mesh>{};
}

Mesh hull_with_axle(const Mesh& hull, const Spec& spec, const Progress& progress) {
  const SpinSpec* spin = with_axle(spec);
  if (!spin) return hull;
  std::vector<Mesh> all = axle_of(*spin, hull).taken;
  all.front() = hull;  // in place of the gap
  return combined(all, {}, progress).mesh;
}

void judge_pieces(const PrintedDelivery& printed, const Spec& spec, const Limits& limits, const Progress& progress,
                  Verdict& verdict) {
  const Delivery& delivered = printed.delivery;
  const Mesh whole = delivered.body();
  const double diagonal_mm = bounding_box(whole).diagonal().norm();
  const double rounding_mm = 1e-6 * diagonal_mm;
  std::vector<Piece> pieces = pieces_of(delivered, rounding_mm);
  const Mesh rooms = rooms_of(spec, whole, progress);
  std::size_t open = 0;
  double off_bed_mm = 0;
  double smallest_area = kInfinity;
  for (Piece& piece : pieces) {
    progress.check();
    const std::size_t unbalanced = unbalanced_edges(piece.mesh);
    open += unbalanced;
    const bool sound = is_rigid(piece.part.to_bed) && mesh_moments(piece.mesh)[M1] > 0;
    off_bed_mm = std::max(off_bed_mm, sound ? std::abs(piece.box.min().z()) : kInfinity);
    smallest_area = std::min(smallest_area, piece.bed_area_mm2);
    if (unbalanced == 0 && sound) piece.inside = overhang_in_piece(piece.mesh, rooms, lying(piece), progress);
  }
  const Moments& s = printed.printed;
  const Moments off = (moments_of_all(pieces) - s).cwiseQuotient(moment_units(std::abs(s[M1]), diagonal_mm));
  auto& criteria = verdict.criteria;
  criteria.push_back(at_least("in_pieces", "pieces", static_cast<double>(pieces.size()), 2));
  criteria.push_back(at_most("pieces_closed", "edges of pieces that are open or face the wrong way", static_cast<double>(open), 0));
  criteria.push_back(
      at_most("pieces_add_up", "moments of the pieces together, against the whole", off.cwiseAbs().maxCoeff(), 1e-9));
  criteria.push_back(at_most("pieces_on_bed", "how far a piece is from lying on the bed, mm", off_bed_mm, rounding_mm));
  criteria.push_back(at_least("pieces_lie_flat", "smallest area with which a piece lies there, mm2", smallest_area, 1));
  criteria.push_back(at_least("pieces_apart", "smallest gap between pieces on the bed, mm", smallest_gap_on_bed(pieces), 0.1));
  const std::size_t sealed = sealed_cavities(delivered);
  if (finds_planes(spec))
    criteria.push_back(at_most("cavities_opened", "cavities that no cut opens", static_cast<double>(sealed), 0));
  else if (sealed > 0 && !with_axle(spec))
    verdict.notes.push_back(plural(sealed, "cavity is", "cavities are") + " opened by no cut: --cut auto opens all.");
  else if (sealed > 0)
    verdict.notes.push_back(plural(sealed, "cavity stays", "cavities stay") +
                            " closed: the halves are whole towards the string. With '--axle none --cut auto' all are open, and the "
                            "pieces are glued.");
  const double wall_mm = print_of(spec).wall_mm;
  if (const double wall = wall_at_pins(delivered, whole, print_of(spec).density_g_cm3, progress);
      wall_mm > 0 && std::isfinite(wall))
    criteria.push_back(at_least("wall_at_pins", "thinnest wall between cavities and pins, over the wall asked for", wall / wall_mm,
                                limits.wall_ratio));
  verdict.figures.push_back({.name = "pieces", .words = "", .value = records(pieces, print_of(spec).density_g_cm3)});
  say(pieces, delivered, spec, verdict);
}

}  // namespace rayrep::verify_detail
