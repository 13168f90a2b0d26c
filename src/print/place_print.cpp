#include "rayrep/print/place_print.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numbers>
#include <numeric>
#include <vector>

#include "base/text.h"
#include "rayrep/base/error.h"
#include "rayrep/mesh/section.h"

namespace rayrep {
namespace {

/// A layer of the print and the section of the mesh at its middle.
struct Pair {
  const PrintedLayer* print;
  double area_mm2 = 0;
  Eigen::Vector2d centroid_mm = Eigen::Vector2d::Zero();
  Eigen::Vector2d size_mm = Eigen::Vector2d::Zero();
};

Pair section_like(const PrintedLayer& layer, const std::vector<SectionLoop>& loops) {
  Pair pair{&layer};
  Eigen::AlignedBox2d box;
  for (const std::size_t n : outermost(loops)) {
    const LoopMoments moments = loop_moments(loops[n]);
    const double sign = moments.area_mm2 < 0 ? -1 : 1;
    pair.area_mm2 += sign * moments.area_mm2;
    pair.centroid_mm += sign * moments.moment_mm3;
    for (const Eigen::Vector2d& p : loops[n]) box.extend(p);
  }
  if (pair.area_mm2 > 0) {
    pair.centroid_mm /= pair.area_mm2;
    pair.size_mm = box.sizes();
  }
  return pair;
}

double size_error_mm(const Pair& pair) { return (pair.print->size_mm - pair.size_mm).cwiseAbs().maxCoeff(); }

struct Weighted {
  double value;
  double weight;
};

/// The value that `fraction` of the weight is not above.
double quantile(std::vector<Weighted> all, double fraction) {
  std::sort(all.begin(), all.end(), [](const Weighted& a, const Weighted& b) { return a.value < b.value; });
  double total = 0;
  for (const Weighted& w : all) total += w.weight;
  double sum = 0;
  for (const Weighted& w : all)
    if ((sum += w.weight) >= fraction * total) return w.value;
  return 0;
}

template <class Value>
double quantile_of(const std::vector<Pair>& pairs, double fraction, const Value& value) {
  std::vector<Weighted> all;
  for (const Pair& pair : pairs) all.push_back({value(pair), pair.area_mm2});
  return quantile(std::move(all), fraction);
}

/// By how much the print is turned, from the way its centroids run: the rotation that fits them best. None where they run straight
/// up.
std::optional<double> turn_seen(const std::vector<Pair>& pairs) {
  double weight = 0;
  Eigen::Vector2d print_mean = Eigen::Vector2d::Zero();
  Eigen::Vector2d mesh_mean = Eigen::Vector2d::Zero();
  for (const Pair& pair : pairs) {
    weight += pair.area_mm2;
    print_mean += pair.area_mm2 * pair.print->centroid_mm;
    mesh_mean += pair.area_mm2 * pair.centroid_mm;
  }
  double along = 0;
  double across = 0;
  double spread = 0;
  for (const Pair& pair : pairs) {
    const Eigen::Vector2d a = pair.centroid_mm - mesh_mean / weight;
    const Eigen::Vector2d b = pair.print->centroid_mm - print_mean / weight;
    along += pair.area_mm2 * a.dot(b);
    across += pair.area_mm2 * (a.x() * b.y() - a.y() * b.x());
    spread += pair.area_mm2 * a.squaredNorm();
  }
  const double radius = std::hypot(along, across);
  if (!(spread > 0.01 * weight) || radius < 0.9 * spread || radius > 1.1 * spread) return std::nullopt;
  return std::atan2(across, along);
}

constexpr double kMostArea = 0.05;  // relative
constexpr double kMost_mm = 0.5;

/// Where the mesh comes to lie with its plan, and how well it fits there.
void compare(const std::vector<Pair>& pairs, const std::optional<Eigen::Vector2d>& told_mm, Eigen::Vector2d& shift,
             PrintPlacement& placed) {
  for (int k = 0; k < 2 && !told_mm; ++k)
    shift[k] = quantile_of(pairs, 0.5, [k](const Pair& pair) { return pair.print->centroid_mm[k] - pair.centroid_mm[k]; });
  double print_area = 0;
  double difference = 0;
  double mesh_area = 0;
  for (const Pair& pair : pairs) {
    difference += std::abs(pair.print->area_mm2 - pair.area_mm2);
    mesh_area += pair.area_mm2;
    print_area += pair.print->area_mm2;
  }
  placed.layers = pairs.size();
  placed.area_error = difference / std::max(mesh_area, 1e-9 * print_area);
  placed.size_error_mm = quantile_of(pairs, 0.5, size_error_mm);
  placed.centre_error_mm =
      quantile_of(pairs, 0.75, [&shift](const Pair& pair) { return (pair.print->centroid_mm - pair.centroid_mm - shift).norm(); });
}

bool fits(const PrintPlacement& placed) {
  return placed.area_error <= kMostArea && placed.size_error_mm <= kMost_mm && placed.centre_error_mm <= kMost_mm;
}

/// As wide and deep as the mesh there, but enclosing less: its outline goes in through a hole.
bool is_opened(const Pair& pair) {
  return pair.print->area_mm2 < (1 - kMostArea) * pair.area_mm2 && size_error_mm(pair) <= kMost_mm;
}

/// Those that no hole opens; all of them where that would be less than half.
std::vector<Pair> closed_ones(const std::vector<Pair>& pairs) {
  std::vector<Pair> closed;
  std::remove_copy_if(pairs.begin(), pairs.end(), std::back_inserter(closed), is_opened);
  const auto area = [](const std::vector<Pair>& all) {
    return std::accumulate(all.begin(), all.end(), 0.0, [](double sum, const Pair& pair) { return sum + pair.area_mm2; });
  };
  return area(closed) < 0.5 * area(pairs) ? pairs : closed;
}

/// Whether it would fit if holes opened some of its layers.
bool looks_drilled(const std::vector<Pair>& pairs) {
  PrintPlacement placed;
  Eigen::Vector2d shift;
  compare(closed_ones(pairs), {}, shift, placed);
  return placed.layers < pairs.size() && fits(placed);
}

/// @param notes    of the print, which may say why
/// @param degrees  that it was said to be turned by
[[noreturn]] void refuse(const PrintPlacement& placed, const std::vector<Pair>& pairs, const std::vector<std::string>& notes,
                         double degrees) {
  constexpr double degree = std::numbers::pi / 180;
  std::string why;
  if (looks_drilled(pairs)) {
    why = concat(
        " All but ", pairs.size() - closed_ones(pairs).size(),
        " layers fit: in these the outline goes inside, as through a drilled hole. If it has holes, let 'verify' know (--drain "
        "auto), or compare it with the mesh that was sliced, holes and all ('measure --of').");
  } else if (const auto turn = turn_seen(pairs); turn && std::abs(*turn) > degree) {
    const std::string all = number(*turn / degree + degrees, 0);
    why = concat(" It looks turned on the bed by ", all,
                 " degrees: slice it without turning it, or let 'measure' or 'verify' know (--turned ", all, ").");
  } else {
    why =
        " Was another mesh sliced, several of them or pieces of one, or this one turned or scaled in the slicer? Slice it alone "
        "and as it is.";
  }
  for (const std::string& note : notes) why += " " + note;
  throw Error(ErrorCode::input,
              concat("The print does not look like the mesh: over ", placed.layers, " layers their outlines differ by ",
                     number(100 * placed.area_error, 1), " % of the area, by ", number(placed.size_error_mm, 2),
                     " mm in width or depth, and by ", number(placed.centre_error_mm, 2), " mm in their centres.", why));
}

/// What fits, but not quite. @throws Error{input} for a print that ends long before the mesh does
void add_notes(const Printed& printed, double height_mm, PrintPlacement& placed) {
  constexpr double much_mm = 0.1;
  if (placed.size_error_mm > much_mm)
    placed.notes.push_back(
        concat("The print's outlines are ", number(placed.size_error_mm, 2),
               " mm off the mesh's in width or depth: was it scaled, or does the profile shrink or grow outlines? The "
               "outside is taken from the mesh."));
  const PrintedLayer& last = *std::max_element(printed.layers.begin(), printed.layers.end(),
                                               [](const PrintedLayer& a, const PrintedLayer& b) { return a.z_mm < b.z_mm; });
  const double missing_mm = height_mm - (last.z_mm + 0.5 * last.height_mm - printed.bottom_mm);
  if (missing_mm > 0.1 * height_mm)
    throw Error(ErrorCode::input, concat("The print ends ", number(missing_mm, 2), " mm below the top of the mesh, which is ",
                                         number(height_mm, 2), " mm high: is the file cut off? Export it again."));
  if (missing_mm > 3 * last.height_mm)
    placed.notes.push_back(concat("The print ends ", number(missing_mm, 2), " mm below the top of the mesh."));
}

/// A mesh as it lies on the bed, and each layer of a print beside what it cuts out of it.
struct Laid {
  Eigen::Affine3d to_bed;
  Eigen::AlignedBox3d box;
  std::vector<Pair> pairs;
};

double bottom_of(const Printed& printed) { return std::isfinite(printed.bottom_mm) ? printed.bottom_mm : 0; }

Laid laid(const Printed& printed, const Mesh& mesh, const PlacePrintOptions& options) {
  Laid result;
  result.to_bed = Eigen::AngleAxisd(options.turned_rad, Eigen::Vector3d::UnitZ()) * working_frame(mesh, options.print_direction);
  const Mesh standing = transformed(with_merged_vertices(mesh), result.to_bed);
  result.box = bounding_box(standing);
  const MeshSections sections(standing);
  for (const PrintedLayer& layer : printed.layers) {
    // The first is pressed to the bed, and slicers shrink it against that.
    const double height_mm = layer.z_mm - bottom_of(printed);
    if (height_mm >= layer.height_mm) result.pairs.push_back(section_like(layer, sections.at(height_mm)));
  }
  return result;
}

/// With which of its axes upward it would fit, as an option; empty: none.
std::string other_direction(const Printed& printed, const Mesh& mesh, PlacePrintOptions options) {
  constexpr std::array<const char*, 6> kNames = {"z", "x", "y", "-x", "-y", "-z"};
  const std::array<Eigen::Vector3d, 6> directions = {Eigen::Vector3d::UnitZ(),  Eigen::Vector3d::UnitX(),
                                                     Eigen::Vector3d::UnitY(),  -Eigen::Vector3d::UnitX(),
                                                     -Eigen::Vector3d::UnitY(), -Eigen::Vector3d::UnitZ()};
  const Eigen::Vector3d said = options.print_direction.normalized();
  for (std::size_t n = 0; n < directions.size(); ++n) {
    if (directions[n].dot(said) > 1 - 1e-9) continue;
    options.print_direction = directions[n];
    PrintPlacement placed;
    Eigen::Vector2d shift;
    compare(closed_ones(laid(printed, mesh, options).pairs), {}, shift, placed);
    if (fits(placed)) return kNames[n];
  }
  return {};
}

/// What may be the reason why it does not fit, beside what the outlines tell.
std::vector<std::string> reasons(const Printed& printed, const Mesh& mesh, const PlacePrintOptions& options) {
  std::vector<std::string> all = printed.notes;
  if (const std::string direction = other_direction(printed, mesh, options); !direction.empty())
    all.push_back(concat("It fits with ", direction,
                         " upward: turn it in the slicer before slicing, or say how it was sliced (--print-direction ", direction,
                         ")."));
  return all;
}

}  // namespace

PrintPlacement place_print(const Printed& printed, const Mesh& mesh, const PlacePrintOptions& options) {
  Laid mesh_laid = laid(printed, mesh, options);
  std::vector<Pair>& pairs = mesh_laid.pairs;
  if (pairs.empty() && !options.centre_mm)
    throw Error(
        ErrorCode::input,
        "The print shows no closed outlines by which the mesh could be found in it. 'measure' and 'verify' take where on the "
        "bed the middle of the mesh lies: --bed-center X,Y.");
  const std::size_t all = pairs.size();
  if (options.has_holes) pairs = closed_ones(pairs);
  PrintPlacement placed;
  placed.opened = all - pairs.size();
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();
  if (options.centre_mm) shift = *options.centre_mm - mesh_laid.box.center().head<2>();
  if (!pairs.empty()) compare(pairs, options.centre_mm, shift, placed);
  placed.to_mesh = (Eigen::Translation3d(shift.x(), shift.y(), bottom_of(printed)) * mesh_laid.to_bed).inverse(Eigen::Isometry);
  placed.s = moment_map(placed.to_mesh) * printed.body();
  if (pairs.empty()) return placed;
  if (!fits(placed)) refuse(placed, pairs, reasons(printed, mesh, options), options.turned_rad * 180 / std::numbers::pi);
  if (placed.opened > 0)
    placed.notes.push_back(concat("Holes open ", placed.opened, " of ", all, " layers: these were not compared with the mesh."));
  add_notes(printed, mesh_laid.box.sizes().z(), placed);
  return placed;
}

}  // namespace rayrep
