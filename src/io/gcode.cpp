#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <map>
#include <numbers>
#include <set>
#include <string>
#include <utility>

#include "base/text.h"
#include "io/gcode_text.h"
#include "io/mesh_io_detail.h"
#include "io/printed_outline.h"
#include "io/read_gcode.h"
#include "rayrep/base/error.h"
#include "rayrep/io/printed.h"
#include "rayrep/physics/bead.h"

namespace rayrep::detail {
namespace {

constexpr double kUsualDiameterMm = 1.75;
constexpr double kOtherDiameterMm = 2.85;
/// Beads are as wide as the nozzle or wider, and nozzles of less than that are hardly used.
constexpr double kNarrowestBeadMm = 0.2;
constexpr double kUsualHeightMm = 0.2;  // of a layer, where a file begins at 0
constexpr double kFarthestMm = 1e5;
constexpr double kMostMm3 = 1e9;
constexpr const char* kStartCode = "start and end code";

/// Follows the nozzle and adds up what it lays down.
class GcodeReader {
public:
  GcodeReader(const FileBytes& file, const PrintedOptions& options)
      : file_(file), options_(options), header_(gcode_header(file.bytes)) {}

  Printed read() {
    result_.format = "G-code";
    result_.slicer = header_.slicer;
    choose_feature(header_.has_features ? kStartCode : "all that is extruded");
    std::string_view rest = file_.bytes;
    GcodeLine line;
    while (!rest.empty()) {
      ++line_;
      const std::string_view text = next_line(rest);
      if (!parse_gcode_line(text, line)) fail("a number cannot be read. Export the G-code again.");
      if (!line.comment.empty()) comment(line);
      if (line.letter == 'G' && line.whole) motion(line);
      if (line.letter == 'M' && line.whole) setting(line);
      if (line.letter == 'T' && line.whole && line.code >= 0 && line.code < 64) tool_ = static_cast<std::size_t>(line.code);
      // Klipper's way to name objects.
      if (const auto name = after(text, "EXCLUDE_OBJECT_START NAME=")) object(*name);
    }
    end_layer();
    finish();
    return std::move(result_);
  }

  /// The file does not say how thick the filament is, and the usual one makes no beads that a nozzle could lay.
  bool thicker_filament() const { return usual_diameter_ && laid_down_mm3_ < kNarrowestBeadMm * laid_down_mm2_; }

private:
  const FileBytes& file_;
  const PrintedOptions& options_;
  const GcodeHeader header_;
  Printed result_;
  PrintedOutline outline_;
  std::size_t line_ = 0;
  std::map<std::string, std::size_t> number_of_feature_;
  std::set<std::string> objects_;

  // The machine.
  Eigen::Vector3d at_ = Eigen::Vector3d::Zero();      // mm, in the coordinates of the commands
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();  // of these, in those of the printer
  double e_ = 0;
  bool relative_ = false;
  bool e_relative_ = false;
  double mm_ = 1;
  double flow_ = 1;
  std::size_t tool_ = 0;
  std::optional<double> m200_diameter_mm_;
  bool bed_plane_ = true;
  // What the comments say.
  std::size_t feature_ = 0;
  bool perimeter_ = false;
  std::optional<double> width_mm_;
  std::optional<double> height_mm_;
  // The layer.
  double layer_top_mm_ = 0;
  double below_mm_ = 0;
  double outline_top_mm_ = 0;
  double outline_height_mm_ = 0;
  bool begins_again_ = false;  // lower down, after a layer of the body
  bool usual_diameter_ = false;
  double laid_down_mm3_ = 0;  // of the body
  double laid_down_mm2_ = 0;  // of its beads' sides: length times height
  std::map<std::size_t, double> of_tool_mm3_;
  double lowest_top_mm_ = std::numeric_limits<double>::infinity();
  double lowest_height_mm_ = 0;

  [[noreturn]] void fail(const std::string& what) const { fail_read(file_, concat("line ", line_), what); }

  void choose_feature(std::string_view name) {
    const auto [entry, is_new] = number_of_feature_.try_emplace(std::string(name), result_.features.size());
    feature_ = entry->second;
    if (is_new) {
      PrintedFeature& feature = result_.features.emplace_back();
      feature.name = std::string(name);
      feature.of_body = is_of_body(name) && name != kStartCode;
    }
    const bool perimeter = !header_.has_features || is_perimeter(name);
    if (!perimeter) outline_.end_path();
    perimeter_ = perimeter;
  }

  void object(std::string_view name) {
    if (objects_.emplace(name).second) result_.objects.emplace_back(name);
  }

  void comment(const GcodeLine& line) {
    const std::string_view text = line.comment;
    const auto positive = [](std::string_view number) -> std::optional<double> {
      double value = 0;
      return parse_number(number, value) && value > 0 && value <= kFarthestMm ? std::optional<double>(value) : std::nullopt;
    };
    // Slic3r's family and Cura, Bambu Studio, Simplify3D.
    const auto behind = [text](std::initializer_list<const char*> starts) -> std::optional<std::string_view> {
      for (const char* start : starts)
        if (const auto found = after(text, start)) return found;
      return std::nullopt;
    };
    if (const auto feature = behind({"TYPE:", "FEATURE:", "feature "}))
      choose_feature(*feature);
    else if (const auto width = behind({"WIDTH:", "LINE_WIDTH:"}))
      width_mm_ = positive(*width);
    else if (const auto height = behind({"HEIGHT:", "LAYER_HEIGHT:"}))
      height_mm_ = positive(*height);
    else if (const auto name = behind({"printing object ", "start printing object", "MESH:"})) {
      if (*name != "NONMESH") object(*name);
    } else if (text.starts_with("LAYER_CHANGE") || text.starts_with("CHANGE_LAYER"))
      end_layer();
    else if (const auto number = after(text, "LAYER:")) {
      end_layer();
      if (number->starts_with('-')) choose_feature("raft");
    } else if (!header_.has_features && line.letter == 'G')
      for (const char* other : {"skirt", "brim", "support", "perimeter", "infill"})  // Slic3r's verbose G-code
        if (text.starts_with(other)) choose_feature(text);
  }

  void motion(const GcodeLine& line) {
    switch (line.code) {
      case 0:
      case 1:
        move(line);
        return;
      case 2:
      case 3:
        arc(line);
        return;
      case 5:
        fail("it draws a spline (G5), which rayrep does not read. Export the G-code without curves.");
      case 17:
        bed_plane_ = true;
        return;
      case 18:
      case 19:
        bed_plane_ = false;
        return;
      case 20:
        mm_ = 25.4;
        return;
      case 21:
        mm_ = 1;
        return;
      case 90:
        relative_ = false;
        return;
      case 91:
        relative_ = true;
        return;
      case 92:
        rename_place(line);
        return;
      default:
        return;
    }
  }

  void setting(const GcodeLine& line) {
    if (line.code == 82) e_relative_ = false;
    if (line.code == 83) e_relative_ = true;
    if (line.code == 221 && line['S']) flow_ = *line['S'] / 100;
    if (line.code == 200 && line['D']) m200_diameter_mm_ = *line['D'] * mm_;
    if (line.code == 486 && line['S'] && *line['S'] >= 0) object(concat("object ", *line['S']));
  }

  /// G92: the place the machine is at gets another name.
  void rename_place(const GcodeLine& line) {
    const bool all = !line['X'] && !line['Y'] && !line['Z'] && !line['E'];
    for (int k = 0; k < 3; ++k) {
      const auto value = line[static_cast<char>('X' + k)];
      if (!value && !all) continue;
      const double named = value.value_or(0) * mm_;
      origin_[k] += at_[k] - named;
      at_[k] = named;
    }
    if (line['E'] || all) e_ = line['E'].value_or(0) * mm_;
  }

  Eigen::Vector3d place_in(const GcodeLine& line) const {
    Eigen::Vector3d to = at_;
    for (int k = 0; k < 3; ++k)
      if (const auto value = line[static_cast<char>('X' + k)]) to[k] = (relative_ ? at_[k] : 0) + *value * mm_;
    if (!(to.cwiseAbs().maxCoeff() <= kFarthestMm)) fail("it goes farther than 100 m. Is the file damaged?");
    return to;
  }

  /// What is extruded on the way, mm^3; negative when it is drawn back.
  double extruded_mm3(const GcodeLine& line) {
    const auto value = line['E'];
    if (!value) return 0;
    const bool relative = relative_ || e_relative_;
    const double length = relative ? *value * mm_ : *value * mm_ - e_;
    if (!(std::abs(length) <= kFarthestMm)) fail("it extrudes more than 100 m at once. Is the file damaged?");
    e_ = relative ? e_ + length : *value * mm_;
    if (m200_diameter_mm_ ? *m200_diameter_mm_ > 0 : header_.volumetric) return length * mm_ * mm_ * flow_;
    const double d = diameter_mm();
    return length * flow_ * std::numbers::pi * d * d / 4;
  }

  double diameter_mm() {
    if (options_.filament_diameter_mm) return *options_.filament_diameter_mm;
    const auto& told = header_.filament_diameters_mm;
    if (!told.empty()) return told[std::min(tool_, told.size() - 1)];
    usual_diameter_ = true;
    return kUsualDiameterMm;
  }

  /// The height of what is laid down with the nozzle at z.
  double height_at(double z_mm) {
    if (z_mm > layer_top_mm_ + 1e-6) {
      below_mm_ = layer_top_mm_;
      layer_top_mm_ = z_mm;
    } else if (z_mm < layer_top_mm_ - 1e-6) {
      if (z_mm <= below_mm_) {  // the next object; else it is pressed into what is below, as on a raft
        below_mm_ = 0;
        begins_again_ |= result_.features[feature_].of_body;
      }
      layer_top_mm_ = z_mm;
    }
    if (height_mm_) return *height_mm_;
    const double height = layer_top_mm_ - below_mm_;
    const auto& usual = header_.layer_height_mm;
    if (!usual || *usual == 0) return height > 0 ? height : kUsualHeightMm;
    return height >= 0.5 * *usual && height <= 2 * *usual ? height : *usual;
  }

  static bool is_material(double volume_mm3, double length_mm) { return volume_mm3 > 0 && length_mm > 0; }

  /// @param height_mm  of the bead
  void lay_down(const Moments& s, double length_mm, double top_mm, double height_mm) {
    if (!(s[M1] <= kMostMm3)) fail("it lays down more than a cubic metre at once. Is the file damaged?");
    PrintedFeature& feature = result_.features[feature_];
    feature.s += s;
    ++feature.beads;
    if (!feature.of_body) return;
    laid_down_mm3_ += s[M1];
    laid_down_mm2_ += length_mm * height_mm;
    of_tool_mm3_[tool_] += s[M1];
    // Bridges are as thick as the nozzle is wide: the least height at the lowest place is the layer's.
    if (top_mm < lowest_top_mm_ - 1e-6) {
      lowest_top_mm_ = top_mm;
      lowest_height_mm_ = height_mm;
    } else if (top_mm < lowest_top_mm_ + 1e-6) {
      lowest_height_mm_ = std::min(lowest_height_mm_, height_mm);
    }
  }

  /// A piece of a path for the outline.
  void outline(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double width_mm, double height_mm) {
    if (!perimeter_ || !result_.features[feature_].of_body) return;
    if (!header_.has_layers && outline_height_mm_ > 0 && std::abs(to.z() - outline_top_mm_) > 1e-6) end_layer();
    // Bridges are as thick as the nozzle is wide: the least is the layer's.
    if (outline_height_mm_ == 0 || height_mm < outline_height_mm_) outline_height_mm_ = height_mm;
    outline_top_mm_ = to.z();
    outline_.add(from.head<2>(), to.head<2>(), width_mm);
  }

  /// A straight piece, or a chord of an arc.
  void keep(const Bead& bead) {
    if (options_.keep_beads && result_.features[feature_].of_body) result_.beads.push_back(bead);
  }

  void end_layer() {
    outline_.end_layer(outline_top_mm_, outline_height_mm_, result_.layers);
    outline_height_mm_ = 0;
  }

  void move(const GcodeLine& line) {
    const Eigen::Vector3d from = at_ + origin_;
    at_ = place_in(line);
    const Eigen::Vector3d to = at_ + origin_;
    const double volume = extruded_mm3(line);
    const double length = (to - from).head<2>().norm();
    if (!is_material(volume, length)) {
      if (length > 0) outline_.end_path();
      return;
    }
    const double height = height_at(to.z());
    const double width = width_mm_.value_or(volume / (length * height));
    const Bead bead{from, to, volume, width, height};
    lay_down(bead_moments(bead), length, to.z(), height);
    keep(bead);
    outline(from, to, width, height);
  }

  void arc(const GcodeLine& line) {
    if (!bed_plane_) fail("it draws an arc that does not lie in the plane of the bed. Export the G-code without such arcs.");
    const Eigen::Vector3d from = at_ + origin_;
    at_ = place_in(line);
    const Eigen::Vector3d to = at_ + origin_;
    const double volume = extruded_mm3(line);
    ArcBead bead;
    bead.centre_mm = arc_centre(line, from.head<2>(), to.head<2>());
    const Eigen::Vector2d a = from.head<2>() - bead.centre_mm;
    const Eigen::Vector2d b = to.head<2>() - bead.centre_mm;
    bead.radius_mm = a.norm();
    if (!(bead.radius_mm <= kFarthestMm)) fail("its arc has a radius of more than 100 m. Is the file damaged?");
    bead.from_rad = std::atan2(a.y(), a.x());
    double sweep = std::atan2(b.y(), b.x()) - bead.from_rad;
    const double turn = 2 * std::numbers::pi;
    // A start that is the end is a full circle.
    if (line.code == 3)
      while (sweep <= 1e-9) sweep += turn;
    else
      while (sweep >= -1e-9) sweep -= turn;
    bead.sweep_rad = sweep;
    if (!is_material(volume, bead.radius_mm)) {
      outline_.end_path();
      return;
    }
    bead.from_z_mm = from.z();
    bead.to_z_mm = to.z();
    bead.volume_mm3 = volume;
    bead.height_mm = height_at(to.z());
    bead.width_mm = width_mm_.value_or(volume / (bead.radius_mm * std::abs(sweep) * bead.height_mm));
    lay_down(bead_moments(bead), bead.radius_mm * std::abs(sweep), to.z(), bead.height_mm);

    const int pieces = static_cast<int>(std::ceil(std::abs(sweep) / 0.02));
    Eigen::Vector3d before = from;
    for (int n = 1; n <= pieces; ++n) {
      const double angle = bead.from_rad + sweep * n / pieces;
      Eigen::Vector3d next = to;
      if (n < pieces) next.head<2>() = bead.centre_mm + bead.radius_mm * Eigen::Vector2d(std::cos(angle), std::sin(angle));
      outline(before, next, bead.width_mm, bead.height_mm);
      keep({before, next, volume / pieces, bead.width_mm, bead.height_mm});
      before = next;
    }
  }

  /// By I and J, from the start, or by R: negative for the longer way round.
  Eigen::Vector2d arc_centre(const GcodeLine& line, const Eigen::Vector2d& from, const Eigen::Vector2d& to) const {
    if (line['I'] || line['J']) return from + mm_ * Eigen::Vector2d(line['I'].value_or(0), line['J'].value_or(0));
    const auto radius = line['R'];
    if (!radius || *radius == 0 || from == to)
      fail("an arc has neither a centre (I, J) nor a radius (R). Export the G-code again.");
    const double R = *radius * mm_;
    const Eigen::Vector2d d = to - from;
    const double h2 = R * R - d.squaredNorm() / 4;
    const double side = ((line.code == 3) == (R > 0) ? 1 : -1) * std::sqrt(std::max(0.0, h2)) / d.norm();
    return 0.5 * (from + to) + side * Eigen::Vector2d(-d.y(), d.x());
  }

  void finish() {
    std::erase_if(result_.features, [](const PrintedFeature& f) { return f.beads == 0; });
    if (result_.features.empty())
      fail_read(file_, "", "it lays down no material: no move extrudes. Is it the G-code of a printer?");
    result_.bottom_mm = lowest_top_mm_ - lowest_height_mm_;
    tell_density();
    tell_filament();
    if (flow_ != 1)
      result_.notes.push_back(concat("A flow of ", 100 * flow_, " % is set at the printer's side (M221), and counted."));
    if (usual_diameter_)
      result_.notes.push_back(concat("The file does not say how thick the filament is: ", kUsualDiameterMm,
                                     " mm is taken. If it is another, say --filament-diameter."));
    if (!header_.has_features && result_.features.size() == 1)
      result_.notes.push_back(
          "The file does not say what is skirt, support or body: all that is extruded is taken for the body. Export it without "
          "skirt and supports, or with comments.");
    if (result_.objects.size() > 1)
      result_.notes.push_back(concat("There are ", result_.objects.size(), " objects on the bed; they are taken as one body."));
    else if (begins_again_)
      result_.notes.push_back(
          "The printer begins again lower down: objects are printed one after the other; they are taken as one body.");
    if (header_.told_mm.empty() && header_.slicer.find("Slic") != std::string::npos)
      result_.notes.push_back(
          concat(header_.slicer, " ends its files with the filament used, and this one does not: is it cut off?"));
  }

  /// The density of what the body is printed with; of several materials the mean.
  void tell_density() {
    const auto& told = header_.densities_g_cm3;
    if (told.empty() || of_tool_mm3_.empty()) return;
    double mass = 0;
    double volume = 0;
    bool differ = false;
    const double first = told[std::min(of_tool_mm3_.begin()->first, told.size() - 1)];
    for (const auto& [tool, mm3] : of_tool_mm3_) {
      const double density = told[std::min(tool, told.size() - 1)];
      differ |= density != first;
      mass += density * mm3;
      volume += mm3;
    }
    result_.density_g_cm3 = differ ? mass / volume : first;
    if (differ)
      result_.notes.push_back(
          "Several materials of different density are printed: the mass is right, centre and inertia take their mean everywhere.");
  }

  void tell_filament() {
    result_.told = header_.told;
    double told_mm3 = 0;
    for (std::size_t tool = 0; tool < header_.told_mm.size(); ++tool) {
      const auto& diameters = header_.filament_diameters_mm;
      const double d = options_.filament_diameter_mm.value_or(diameters.empty() ? kUsualDiameterMm
                                                                                : diameters[std::min(tool, diameters.size() - 1)]);
      told_mm3 += header_.told_mm[tool] * std::numbers::pi * d * d / 4;
    }
    if (told_mm3 > 0) result_.told_volume_mm3 = told_mm3;
  }
};

}  // namespace

Printed read_gcode(const FileBytes& given, const PrintedOptions& options) {
  FileBytes file = given;
  if (file.bytes.starts_with("\xEF\xBB\xBF")) file.bytes.remove_prefix(3);
  if (file.bytes.starts_with("GCDE"))
    fail_read(file, "",
              "it is binary G-code. Switch that off in the slicer (PrusaSlicer: Printer settings, 'Supports binary G-code') and "
              "export it again.");
  if (file.bytes.starts_with("\xFF\xFE") || file.bytes.starts_with("\xFE\xFF"))
    fail_read(file, "", "it is text in UTF-16. Save it as plain text (UTF-8 or ASCII).");
  if (file.bytes.find('\n') == std::string_view::npos && file.bytes.find('\r') != std::string_view::npos)
    fail_read(file, "", "its lines end in carriage returns only. Save it with the line ends of Unix or Windows.");
  GcodeReader reader(file, options);
  Printed printed = reader.read();
  if (!reader.thicker_filament()) return printed;
  PrintedOptions thicker = options;
  thicker.filament_diameter_mm = kOtherDiameterMm;
  printed = GcodeReader(file, thicker).read();
  printed.notes.push_back(concat("The file does not say how thick the filament is: ", kOtherDiameterMm, " mm is taken, as with ",
                                 kUsualDiameterMm, " mm its beads would be narrower than ", kNarrowestBeadMm,
                                 " mm. If it is another, say --filament-diameter."));
  return printed;
}

}  // namespace rayrep::detail
