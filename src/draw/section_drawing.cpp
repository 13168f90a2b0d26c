#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/text.h"
#include "draw/layout.h"
#include "rayrep/base/error.h"
#include "rayrep/draw/section_picture.h"
#include "rayrep/draw/shading.h"
#include "rayrep/mesh/mesh.h"

namespace rayrep {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kLeft_px = 70;
constexpr double kRight_px = 22;
constexpr double kTop_px = 70;
constexpr double kMostHeight_px = 500;
constexpr double kLeastHeight_px = 130;
constexpr double kBelow_px = 56;  // numbers, name of the axis and scale bar

/// The chains of loops that lie below a level and lead from right to left: with the straight line along the level they enclose what
/// is open above but not to the side.
std::vector<SectionLoop> open_above(const std::vector<SectionLoop>& loops, double level) {
  std::vector<SectionLoop> found;
  for (const SectionLoop& loop : loops) {
    const std::size_t n = loop.size();
    const auto below = [&](std::size_t k) { return loop[k % n].y() < level; };
    const auto crossing = [&](std::size_t k) {
      const Vector2d& a = loop[k % n];
      const Vector2d& b = loop[(k + 1) % n];
      return Vector2d(a + (level - a.y()) / (b.y() - a.y()) * (b - a));
    };
    for (std::size_t begin = 0; begin < n; ++begin) {
      if (below(begin) || !below(begin + 1)) continue;
      SectionLoop chain = {crossing(begin)};
      std::size_t k = begin + 1;
      for (; below(k); ++k) chain.push_back(loop[k % n]);
      chain.push_back(crossing(k - 1));
      if (chain.back().x() < chain.front().x()) found.push_back(std::move(chain));
    }
  }
  return found;
}

/// Lines at 45 degrees across an area, so far apart.
Outline hatching(const std::vector<SectionLoop>& loops, double spacing_mm, const Stroke& stroke) {
  std::vector<std::vector<double>> along;  // by line x - y = spacing k: where x + y crosses a loop
  double lowest = std::numeric_limits<double>::infinity();
  double highest = -lowest;
  for (const SectionLoop& loop : loops)
    for (const Vector2d& p : loop) {
      lowest = std::min(lowest, p.x() - p.y());
      highest = std::max(highest, p.x() - p.y());
    }
  Outline lines{.closed = false, .in_mm = true, .stroke = stroke};
  if (!(lowest < highest)) return lines;
  const auto first = static_cast<long long>(std::ceil(lowest / spacing_mm));
  along.resize(static_cast<std::size_t>(std::max(0LL, static_cast<long long>(std::floor(highest / spacing_mm)) - first + 1)));
  for (const SectionLoop& loop : loops)
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Vector2d& a = loop[i];
      const Vector2d& b = loop[(i + 1) % loop.size()];
      const double from = (a.x() - a.y()) / spacing_mm;
      const double to = (b.x() - b.y()) / spacing_mm;
      for (auto k = static_cast<long long>(std::ceil(std::min(from, to))); static_cast<double>(k) < std::max(from, to); ++k) {
        const Vector2d p = a + (static_cast<double>(k) - from) / (to - from) * (b - a);
        along[static_cast<std::size_t>(k - first)].push_back(p.x() + p.y());
      }
    }
  for (std::size_t n = 0; n < along.size(); ++n) {
    std::sort(along[n].begin(), along[n].end());
    const double difference = spacing_mm * static_cast<double>(first + static_cast<long long>(n));
    for (std::size_t k = 0; k + 1 < along[n].size(); k += 2) {
      const auto at = [&](double sum) { return Vector2d(0.5 * (sum + difference), 0.5 * (sum - difference)); };
      lines.loops.push_back({at(along[n][k]), at(along[n][k + 1])});
    }
  }
  return lines;
}

/// An axis of the picture in the words of the mesh: "x", or "-z" with its sign, or a direction.
struct Axis {
  std::string name;
  double sign = 1;
};

Axis axis_of(const Vector3d& direction) {
  for (int k = 0; k < 3; ++k)
    if (std::abs(direction[k]) == 1) return {std::string(1, "xyz"[k]), direction[k]};
  return {concat("along (", shown(direction.x() + 0.0, 3), ", ", shown(direction.y() + 0.0, 3), ", ", shown(direction.z() + 0.0, 3),
                 ")")};
}

class SectionSheet {
public:
  SectionSheet(const Subject& subject, const SectionPlane& plane) : subject_(subject), marks_(subject.marks), plane_(plane) {
    Eigen::AlignedBox3d box;
    for (const Part& part : subject.delivery.parts) box.extend(bounding_box(part.mesh));
    offset_mm_ = plane.offset_mm.value_or(plane.normal.dot(marks_.centre_of_mass_mm.value_or(box.center())));
    view_ = view_of(plane, offset_mm_, marks_.up);
    areas_ = section_areas(subject.delivery, view_);
    require_something();
    lay_out();
  }

  Drawing draw() {
    draw_water();
    draw_grid();
    draw_behind();
    draw_water_line({ink::kWater, 2.2});
    draw_parts();
    draw_water_line({ink::kWater, 1, {5, 4}});  // where it would be in the body
    draw_ground();
    draw_support();
    draw_spin_axis();
    draw_centres();
    draw_axes();
    draw_words();
    return std::move(drawing_);
  }

private:
  void require_something() const {
    for (const SectionArea& area : areas_)
      if (!area.loops.empty()) return;
    SectionPlane here = plane_;
    here.offset_mm = offset_mm_;
    require_plane_meets(here, subject_.delivery.body());
    throw Error(ErrorCode::usage, concat("The plane ", plane_.words(offset_mm_), " of --section meets nothing of the body."));
  }

  void lay_out() {
    Eigen::AlignedBox2d box;
    for (const Part& part : subject_.delivery.parts)
      for (const Vector3d& v : part.mesh.vertices) box.extend(view_.seen(v));
    const double height_mm = box.sizes().y();
    for (const auto& centre : {marks_.centre_of_mass_mm, marks_.centre_before_mm, marks_.contact_mm, marks_.hook_mm})
      if (centre) box.extend(view_.seen(*centre));
    if (marks_.water && marks_.water->metacentre_mm) {
      const Vector2d seen = view_.seen(*marks_.water->metacentre_mm);
      if (seen.y() < box.max().y() + 0.3 * height_mm) box.extend(seen);
    }
    const double margin_mm = 0.06 * box.sizes().maxCoeff();
    box.min().array() -= margin_mm;
    box.max().array() += margin_mm;
    const double width_px = drawing_.width_px - kLeft_px - kRight_px;
    drawing_.scale = std::min(width_px / box.sizes().x(), kMostHeight_px / box.sizes().y());
    const double plot_px = std::max(kLeastHeight_px, drawing_.scale * box.sizes().y());
    frame_ = {Vector2d(kLeft_px, kTop_px), Vector2d(kLeft_px + width_px, kTop_px + plot_px)};
    const Vector2d middle = box.center();
    drawing_.origin_px = frame_.center() - drawing_.scale * Vector2d(middle.x(), -middle.y());
  }

  /// Of what is level at that height along up, its height in the view.
  double level_of(double height_mm) const {
    const Vector3d up = view_.to_view * marks_.up;
    return (height_mm - view_.depth_mm * up.z()) / up.y();
  }
  double level_px(double height_mm) const { return drawing_.to_px({0, level_of(height_mm)}).y(); }
  Vector2d px(const Vector3d& p) const { return drawing_.to_px(view_.seen(p)); }
  bool in_frame(const Vector2d& p) const { return frame_.contains(p); }
  bool has_water_line() const {
    if (view_.level || !marks_.water) return false;
    const double y = level_px(marks_.water->offset_mm);
    return y > frame_.min().y() && y < frame_.max().y();
  }

  void add(Outline outline) { drawing_.items.emplace_back(std::move(outline)); }

  void draw_water() {
    if (view_.level || !marks_.water) return;
    const double y = std::max(frame_.min().y(), level_px(marks_.water->offset_mm));
    if (y < frame_.max().y()) add(rectangle_px({Vector2d(frame_.min().x(), y), frame_.max()}, ink::kWaterTint));
  }

  void draw_grid() {
    const Stroke line{ink::kGrid, 1};
    for (const double x : ticks(0)) {
      const double at = drawing_.to_px({x, 0}).x();
      add(line_px({at, frame_.min().y()}, {at, frame_.max().y()}, line));
    }
    for (const double y : ticks(1)) {
      const double at = drawing_.to_px({0, y}).y();
      add(line_px({frame_.min().x(), at}, {frame_.max().x(), at}, line));
    }
  }

  /// What is seen behind the plane, pale.
  void draw_behind() {
    const Colour pale = colour_of(0xdfe5ea);
    Camera camera;
    camera.to_view = view_.to_view;
    const Vector2d middle = (frame_.center() - drawing_.origin_px) / drawing_.scale;
    camera.centre_mm = view_.to_view.transpose() * Vector3d(middle.x(), -middle.y(), view_.depth_mm);
    camera.mm_per_px = 1 / drawing_.scale;
    camera.width_px = static_cast<int>(frame_.sizes().x());
    camera.height_px = static_cast<int>(frame_.sizes().y());
    const ShadedPart part{with_merged_vertices(subject_.delivery.body()), pale, pale};
    Image image = shaded({part}, camera, ClipPlane{view_.to_view.row(2), view_.depth_mm});
    for (std::size_t n = 3; n < image.rgba.size(); n += 4) image.rgba[n] = static_cast<std::uint8_t>(0.55 * image.rgba[n]);
    const Vector2d half(0.5 * camera.width_px, 0.5 * camera.height_px);
    drawing_.items.emplace_back(PlacedImage{std::move(image), frame_.center() - half, 1});
  }

  void draw_parts() {
    for (const SectionArea& area : areas_) {
      Outline outline{.loops = area.loops, .in_mm = true};
      switch (area.kind) {
        case SectionArea::Kind::material:
          clear_inside(area.loops);
          outline.id = "material";
          outline.fill = ink::kMaterial;
          outline.stroke = Stroke{ink::kMaterialEdge, subject_.is_print ? 0.3 : 1.2};
          break;
        case SectionArea::Kind::infill:
          outline.id = "infill";
          outline.fill = ink::kInfill;
          outline.stroke = Stroke{ink::kInfillLines, 1};
          break;
        case SectionArea::Kind::insert:
          outline.id = "insert";
          outline.fill = ink::kInsert;
          outline.stroke = Stroke{ink::kInsertEdge, 1.2};
          break;
      }
      if (area.loops.empty()) continue;
      add(outline);
      if (area.kind == SectionArea::Kind::infill) add(hatching(area.loops, 9 / drawing_.scale, Stroke{ink::kInfillLines, 0.8}));
    }
  }

  /// No water in cavities and dry pockets.
  void clear_inside(const std::vector<SectionLoop>& loops) {
    Outline inside{.in_mm = true, .fill = ink::kWhite};
    for (const std::size_t n : outermost(loops)) inside.loops.push_back(loops[n]);
    if (has_water_line() && marks_.water->dry_pockets)
      for (SectionLoop& pocket : open_above(loops, level_of(marks_.water->offset_mm)))
        add({.loops = {std::move(pocket)}, .in_mm = true, .fill = ink::kWhite});
    add(std::move(inside));
  }

  void draw_water_line(const Stroke& stroke) {
    if (!has_water_line()) return;
    const double y = level_px(marks_.water->offset_mm);
    add(line_px({frame_.min().x(), y}, {frame_.max().x(), y}, stroke));
  }

  void draw_ground() {
    if (view_.level || !marks_.ground_mm) return;
    const double y = level_px(*marks_.ground_mm);
    const Stroke thin{ink::kGround, 0.8};
    for (double x = frame_.min().x() + 8; x <= frame_.max().x(); x += 8) add(line_px({x, y}, {x - 7, y + 7}, thin));
    add(line_px({frame_.min().x(), y}, {frame_.max().x(), y}, {ink::kGround, 1.6}));
  }

  void draw_support() {
    if (marks_.support_mm.empty()) return;
    const Stroke strong{ink::kSupport, 4};
    Eigen::AlignedBox2d extent;
    SectionLoop corners;
    for (const Vector3d& corner : marks_.support_mm) {
      corners.push_back(px(corner));
      extent.extend(corners.back());
    }
    if (view_.level) {
      add({.loops = {corners}, .stroke = Stroke{ink::kSupport, 2}});
      return;
    }
    const double y = level_px(*marks_.ground_mm);
    add(line_px({extent.min().x(), y}, {extent.max().x(), y}, strong));
    if (!marks_.centre_of_mass_mm) return;
    const Vector2d centre = px(*marks_.centre_of_mass_mm);
    for (const double x : {extent.min().x(), extent.max().x()}) add(line_px({x, y}, centre, {ink::kSupport, 1.4, {6, 4}}));
    const auto degrees = [&](double run) { return number(std::atan2(run, y - centre.y()) * 180 / std::numbers::pi, 1); };
    tipping_ =
        concat("tips at ", degrees(centre.x() - extent.min().x()), "° left, ", degrees(extent.max().x() - centre.x()), "° right");
  }

  void draw_spin_axis() {
    const std::optional<Vector3d>& through = marks_.contact_mm ? marks_.contact_mm : marks_.hook_mm;
    if (!through) return;
    const Vector2d at = px(*through);
    if (!view_.level) add(line_px({at.x(), frame_.min().y()}, {at.x(), frame_.max().y()}, {ink::kAxis, 1.4, {12, 4, 2, 4}}));
    add({.loops = {arc_px(at, 4)}, .fill = ink::kAxis, .stroke = Stroke{ink::kWhite, 1}});
  }

  void draw_buoyancy(const Vector2d& at) { draw_buoyancy(drawing_, at); }
  static void draw_buoyancy(Drawing& drawing, const Vector2d& at) {
    drawing.items.emplace_back(Outline{.loops = {arc_px(at, 6)}, .fill = ink::kWhite, .stroke = Stroke{ink::kWater, 2}});
    drawing.items.emplace_back(Outline{.loops = {arc_px(at, 2.4)}, .fill = ink::kWater});
  }
  static void draw_metacentre(Drawing& drawing, const Vector2d& at) {
    const SectionLoop diamond = {at + Vector2d(0, -7), at + Vector2d(7, 0), at + Vector2d(0, 7), at + Vector2d(-7, 0)};
    drawing.items.emplace_back(Outline{.loops = {diamond}, .fill = ink::kWhite, .stroke = Stroke{ink::kWater, 2}});
  }

  void draw_centres() {
    if (marks_.water) {
      draw_buoyancy(px(marks_.water->centre_of_buoyancy_mm));
      if (shows_metacentre()) draw_metacentre(drawing_, px(*marks_.water->metacentre_mm));
    }
    if (marks_.centre_before_mm) draw_centre(drawing_, px(*marks_.centre_before_mm), ink::kFaint);
    if (marks_.centre_of_mass_mm) draw_centre(drawing_, px(*marks_.centre_of_mass_mm), colour_of(0x000000));
  }
  bool shows_metacentre() const {
    return marks_.water && marks_.water->metacentre_mm && in_frame(px(*marks_.water->metacentre_mm)) && !view_.level;
  }

  /// Round numbers in the frame, in coordinates of the view.
  std::vector<double> ticks(int axis) const {
    constexpr double kApart_px = 90;
    const double step = round_step(kApart_px / drawing_.scale);
    const double from = axis == 0 ? (frame_.min().x() - drawing_.origin_px.x()) / drawing_.scale
                                  : (drawing_.origin_px.y() - frame_.max().y()) / drawing_.scale;
    const double length = frame_.sizes()[axis] / drawing_.scale;
    std::vector<double> found;
    for (double k = std::ceil(from / step); k * step <= from + length; ++k) found.push_back(k * step + 0.0);
    return found;
  }

  void draw_axes() {
    const Stroke line{ink::kFaint, 1};
    add({.loops = {{frame_.min(), {frame_.max().x(), frame_.min().y()}, frame_.max(), {frame_.min().x(), frame_.max().y()}}},
         .stroke = line});
    const auto label = [this](const std::string& text, const Vector2d& at, Label::Anchor anchor) {
      drawing_.items.emplace_back(Label{.text = text, .at_px = at, .size_px = 12, .anchor = anchor, .colour = ink::kText});
    };
    const Axis across = axis_of(view_.to_view.row(0));
    const Axis upward = axis_of(view_.to_view.row(1));
    for (const double x : ticks(0)) {
      const double at = drawing_.to_px({x, 0}).x();
      add(line_px({at, frame_.max().y()}, {at, frame_.max().y() + 5}, line));
      label(shown(across.sign * x + 0.0), {at, frame_.max().y() + 19}, Label::Anchor::middle);
    }
    for (const double y : ticks(1)) {
      const double at = drawing_.to_px({0, y}).y();
      add(line_px({frame_.min().x() - 5, at}, {frame_.min().x(), at}, line));
      label(shown(upward.sign * y + 0.0), {frame_.min().x() - 9, at + 4.5}, Label::Anchor::end);
    }
    label(across.name + ", mm", {frame_.center().x(), frame_.max().y() + 40}, Label::Anchor::middle);
    drawing_.items.emplace_back(Label{.text = upward.name + ", mm",
                                      .at_px = {18, frame_.center().y()},
                                      .size_px = 12,
                                      .anchor = Label::Anchor::middle,
                                      .upright = false,
                                      .colour = ink::kText});
    draw_scale_bar(drawing_, {frame_.max().x(), frame_.max().y() + 36}, round_step(0.2 * frame_.sizes().x() / drawing_.scale));
  }

  void draw_words() {
    const double width_px = drawing_.width_px - 2 * 22;
    drawing_.title = concat(subject_.name, ", section ", plane_.words(offset_mm_));
    const auto head = [&](const std::string& text, double y, double size, bool bold) {
      drawing_.items.emplace_back(Label{.text = elided(text, size, width_px),
                                        .at_px = {22, y},
                                        .size_px = size,
                                        .bold = bold,
                                        .colour = bold ? ink::kText : ink::kFaint});
    };
    head(subject_.name, 30, 17, true);
    std::string line = "section " + plane_.words(offset_mm_);
    double solid_mm2 = 0;
    for (const SectionArea& area : areas_)
      if (area.kind != SectionArea::Kind::insert) solid_mm2 += (area.kind == SectionArea::Kind::infill ? -1 : 1) * area.area_mm2();
    if (!subject_.is_print) line += concat(", ", shown(solid_mm2, 4), " mm² printed solid");
    if (marks_.mass_g) line += concat("; mass ", shown(*marks_.mass_g, 4), " g");
    head(line, 52, 13, false);
    const Legend words = legend();
    const double top = frame_.max().y() + kBelow_px;
    words.draw(drawing_, {22, top}, width_px);
    drawing_.height_px = top + words.height_px() + 16;
  }

  Legend legend() const {
    Legend legend;
    for (const SectionArea& area : areas_) {
      if (area.loops.empty()) continue;
      if (area.kind == SectionArea::Kind::material)
        legend.add_area(subject_.is_print ? "laid down by the nozzle" : "printed solid", ink::kMaterial, ink::kMaterialEdge);
      if (area.kind == SectionArea::Kind::infill) legend.add_area("printed with infill", ink::kInfill, ink::kInfillLines);
      if (area.kind == SectionArea::Kind::insert) legend.add_area("put in: not printed", ink::kInsert, ink::kInsertEdge);
    }
    const auto place = [](const Vector3d& p) {
      const auto tenth = [](double x) { return number(std::round(10 * x) / 10 + 0.0, 1); };
      return concat(" (", tenth(p.x()), ", ", tenth(p.y()), ", ", tenth(p.z()), ")");
    };
    if (marks_.centre_of_mass_mm)
      legend.add("centre of mass" + place(*marks_.centre_of_mass_mm),
                 [](Drawing& d, const Vector2d& at) { draw_centre(d, at, colour_of(0x000000)); });
    if (marks_.centre_before_mm)
      legend.add("before" + place(*marks_.centre_before_mm),
                 [](Drawing& d, const Vector2d& at) { draw_centre(d, at, ink::kFaint); });
    if (has_water_line()) legend.add_line("waterline", {ink::kWater, 2.2});
    if (marks_.water)
      legend.add("centre of buoyancy" + place(marks_.water->centre_of_buoyancy_mm),
                 [](Drawing& d, const Vector2d& at) { draw_buoyancy(d, at); });
    if (shows_metacentre()) {
      const double above_mm = marks_.up.dot(*marks_.water->metacentre_mm - marks_.centre_of_mass_mm.value_or(Vector3d::Zero()));
      legend.add(marks_.centre_of_mass_mm ? concat("metacentre, GM = ", shown(above_mm, 3), " mm") : "metacentre", draw_metacentre);
    }
    if (marks_.contact_mm)
      legend.add_line(marks_.yoyo ? "spin axis and centre" : "spin axis and contact point", {ink::kAxis, 1.4, {8, 3, 2, 3}});
    if (marks_.hook_mm) legend.add_line("hangs from here", {ink::kAxis, 1.4, {8, 3, 2, 3}});
    if (!marks_.support_mm.empty())
      legend.add_line(view_.level ? "support polygon" : "support", {ink::kSupport, view_.level ? 2.0 : 4.0});
    if (!tipping_.empty()) legend.add_line(tipping_, {ink::kSupport, 1.4, {6, 4}});
    return legend;
  }

  const Subject& subject_;
  const Marks& marks_;
  const SectionPlane& plane_;
  double offset_mm_ = 0;
  SectionView view_;
  std::vector<SectionArea> areas_;
  Drawing drawing_;
  Eigen::AlignedBox2d frame_;
  std::string tipping_;
};

}  // namespace

Drawing section_drawing(const Subject& subject, const SectionPlane& plane) { return SectionSheet(subject, plane).draw(); }

}  // namespace rayrep
