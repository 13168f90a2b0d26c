#include "rayrep/draw/body_picture.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "base/text.h"
#include "draw/layout.h"
#include "rayrep/base/error.h"
#include "rayrep/draw/shading.h"
#include "rayrep/mesh/section.h"
#include "rayrep/physics/hydrostatics.h"
#include "rayrep/physics/moments.h"

namespace rayrep {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

const Colour kSurface = colour_of(0x9fb6c8);
const Colour kBefore = colour_of(0xc3c9ce);
constexpr double kSharpness = 2;

/// How far something was moved, 0 to 1 of the most.
Colour moved_colour(double share) {
  static const std::array<Colour, 4> kStops = {colour_of(0xf4f1e8), colour_of(0xf8c768), colour_of(0xe5703a), colour_of(0x97182f)};
  const double at = std::clamp(share, 0.0, 1.0) * (kStops.size() - 1);
  const auto n = std::min(static_cast<std::size_t>(at), kStops.size() - 2);
  return mixed(kStops[n], kStops[n + 1], at - static_cast<double>(n));
}

/// One picture of a row.
struct Panel {
  std::string caption;
  std::vector<ShadedPart> parts;
  bool cut = false;
};

ShadedPart shaded_part(const Mesh& mesh, const Colour& colour, const Colour& cut_colour) {
  return {with_merged_vertices(mesh), colour, cut_colour};
}

std::vector<ShadedPart> parts_of_delivery(const Delivery& delivery) {
  std::vector<ShadedPart> parts = {shaded_part(delivery.body(), kSurface, ink::kMaterial)};
  if (const Mesh mesh = delivery.mesh_of(Part::Role::plug); !mesh.triangles.empty())
    parts.push_back(shaded_part(mesh, kSurface, ink::kMaterial));
  if (const Mesh mesh = delivery.mesh_of(Part::Role::modifier); !mesh.triangles.empty())
    parts.push_back(shaded_part(mesh, ink::kInfill, ink::kInfill));
  if (const Mesh mesh = delivery.mesh_of(Part::Role::insert); !mesh.triangles.empty())
    parts.push_back(shaded_part(mesh, ink::kInsert, ink::kInsert));
  return parts;
}

bool has_inside(const Delivery& delivery) {
  const Mesh body = delivery.body();
  return delivery.has_infill() || delivery.has_inserts() || !delivery.mesh_of(Part::Role::plug).triangles.empty() ||
         outer_hull(body).triangles.size() < body.triangles.size();
}

/// Where the viewer stands, and what is cut away before him.
struct Stage {
  Eigen::Matrix3d to_view;
  ClipPlane cut;
};

Stage stage_for(const SectionPlane& plane, double offset_mm, const Vector3d& up) {
  constexpr double kDegree = std::numbers::pi / 180;
  const SectionView view = view_of(plane, offset_mm, up);
  Stage stage;
  stage.cut = {view.to_view.row(2), view.depth_mm};
  Vector3d seen = up_to_z(up) * stage.cut.normal;
  if (seen.z() < -1e-9) {  // always from above
    stage.cut = {-stage.cut.normal, -stage.cut.offset_mm};
    seen = -seen;
  }
  stage.to_view = view.level ? looking(up, -30 * kDegree, 50 * kDegree)
                             : looking(up, std::atan2(seen.x(), -seen.y()) - 32 * kDegree, 22 * kDegree);
  return stage;
}

/// A camera on all of the meshes, in an image that is so large at most.
Camera camera_on(const std::vector<const Mesh*>& meshes, const Eigen::Matrix3d& to_view, const Vector2d& most_px) {
  Eigen::AlignedBox3d box;
  for (const Mesh* mesh : meshes)
    for (const Vector3d& v : mesh->vertices) box.extend(to_view * v);
  const Vector2d size = 1.04 * box.sizes().head<2>();
  Camera camera;
  camera.to_view = to_view;
  camera.centre_mm = to_view.transpose() * box.center();
  camera.mm_per_px = std::max(size.x() / most_px.x(), size.y() / most_px.y());
  camera.width_px = std::max(1, static_cast<int>(std::ceil(size.x() / camera.mm_per_px)));
  camera.height_px = std::max(1, static_cast<int>(std::ceil(size.y() / camera.mm_per_px)));
  return camera;
}

std::vector<double> moved_mm(const Mesh& before, const Mesh& after) {
  if (before.vertices.size() != after.vertices.size())
    throw Error(ErrorCode::usage, "BodyPicture::deformed has not the vertices of what it was before.");
  std::vector<double> moved;
  for (std::size_t v = 0; v < after.vertices.size(); ++v) moved.push_back((after.vertices[v] - before.vertices[v]).norm());
  return moved;
}

class Sheet {
public:
  explicit Sheet(const BodyPicture& what) : what_(what) {
    const Subject& after = what.after;
    const Mesh body = after.delivery.body();
    const Vector3d centre = after.marks.centre_of_mass_mm.value_or(bounding_box(body).center());
    const SectionPlane plane = what.cut ? *what.cut : plane_through_inside(body, after.marks.up, centre);
    const double offset_mm = plane.offset_mm.value_or(plane.normal.dot(centre));
    stage_ = stage_for(plane, offset_mm, after.marks.up);
    if (what.before) {
      panels_.push_back({"before", {shaded_part(*what.before, kBefore, kBefore)}});
      meshes_.push_back(what.before);
    }
    if (what.deformed) add_deformed();
    const bool cut = what.cut || has_inside(after.delivery);
    const std::vector<ShadedPart> parts = parts_of_delivery(after.delivery);
    if (cut && !what.before) panels_.push_back({"whole", parts});
    panels_.push_back({what.before ? (cut ? "after, cut open" : "after") : cut ? "cut open" : "", parts, cut});
    for (const ShadedPart& part : panels_.back().parts) meshes_.push_back(&part.mesh);
  }

  Drawing draw() {
    const std::string& name = what_.after.name;
    drawing_.title = name;
    const double width_px = drawing_.width_px - 2 * kMargin_px;
    add({.text = elided(name, 17, width_px), .at_px = {kMargin_px, 30}, .size_px = 17, .bold = true, .colour = ink::kText});
    draw_panels();
    double y = bottom_px_ + (panels_.back().caption.empty() ? 4 : 34);
    if (most_moved_mm_ > 0) {
      draw_moved_scale(y);
      y += 34;
    }
    const Legend words = legend();
    words.draw(drawing_, {kMargin_px, y}, width_px);
    draw_scale_bar(drawing_, {drawing_.width_px - kMargin_px, 26}, round_step(0.15 * drawing_.width_px / drawing_.scale));
    drawing_.height_px = y + words.height_px() + 14;
    return std::move(drawing_);
  }

private:
  static constexpr double kMargin_px = 22;
  static constexpr double kGap_px = 14;
  static constexpr double kTop_px = 50;

  void add(Label label) { drawing_.items.emplace_back(std::move(label)); }

  void add_deformed() {
    const std::vector<double> moved = moved_mm(*what_.before, *what_.deformed);
    most_moved_mm_ = *std::max_element(moved.begin(), moved.end());
    ShadedPart part{*what_.deformed, kSurface, kSurface};
    for (const double mm : moved) part.of_vertex.push_back(moved_colour(most_moved_mm_ > 0 ? mm / most_moved_mm_ : 0));
    panels_.push_back({"after: how far it was moved", {std::move(part)}});
    meshes_.push_back(what_.deformed);
  }

  void draw_panels() {
    const auto count = static_cast<double>(panels_.size());
    const double each_px = (drawing_.width_px - 2 * kMargin_px - (count - 1) * kGap_px) / count;
    const double tallest_px = panels_.size() == 1 ? 520 : 460;
    Camera camera = camera_on(meshes_, stage_.to_view, kSharpness * Vector2d(each_px, tallest_px));
    camera.samples = 2;  // of a picture that is twice as sharp as it is shown
    drawing_.scale = 1 / (kSharpness * camera.mm_per_px);
    for (std::size_t n = 0; n < panels_.size(); ++n) {
      const Panel& panel = panels_[n];
      const std::optional<ClipPlane> cut = panel.cut ? std::optional(stage_.cut) : std::nullopt;
      const double left_px = kMargin_px + static_cast<double>(n) * (each_px + kGap_px);
      const double width_px = camera.width_px / kSharpness;
      drawing_.items.emplace_back(
          PlacedImage{shaded(panel.parts, camera, cut), {left_px + 0.5 * (each_px - width_px), kTop_px}, 1 / kSharpness});
      bottom_px_ = kTop_px + camera.height_px / kSharpness;
      add({.text = panel.caption,
           .at_px = {left_px + 0.5 * each_px, bottom_px_ + 20},
           .anchor = Label::Anchor::middle,
           .colour = ink::kText});
    }
  }

  void draw_moved_scale(double y) {
    constexpr double kLength_px = 240;
    constexpr int kSteps = 60;
    const double left_px = 0.5 * (drawing_.width_px - kLength_px);
    for (int n = 0; n < kSteps; ++n) {
      const double x = left_px + n * kLength_px / kSteps;
      drawing_.items.emplace_back(
          rectangle_px({Vector2d(x, y), Vector2d(x + kLength_px / kSteps + 0.5, y + 12)}, moved_colour((n + 0.5) / kSteps)));
    }
    const auto label = [&](const std::string& text, double x, Label::Anchor anchor) {
      add({.text = text, .at_px = {x, y + 11}, .anchor = anchor, .colour = ink::kText});
    };
    label("moved by 0", left_px - 8, Label::Anchor::end);
    label(shown(most_moved_mm_, 3) + " mm", left_px + kLength_px + 8, Label::Anchor::start);
  }

  Legend legend() const {
    Legend legend;
    const Panel& last = panels_.back();
    if (!last.cut) return legend;
    legend.add_area(what_.after.is_print ? "laid down by the nozzle, cut" : "printed solid, cut", ink::kMaterial,
                    ink::kMaterialEdge);
    if (what_.after.delivery.has_infill()) legend.add_area("printed with infill, cut", ink::kInfill, ink::kInfillLines);
    if (what_.after.delivery.has_inserts()) legend.add_area("put in: not printed", ink::kInsert, ink::kInsertEdge);
    return legend;
  }

  const BodyPicture& what_;
  Stage stage_;
  std::vector<Panel> panels_;
  std::vector<const Mesh*> meshes_;
  double most_moved_mm_ = 0;
  double bottom_px_ = kTop_px;
  Drawing drawing_;
};

struct Cavity {
  double mm3 = 0;
  Vector3d middle_mm = Vector3d::Zero();
};

/// @param mesh  vertices merged
Cavity largest_cavity(const Mesh& mesh) {
  Moments largest = Moments::Zero();
  for (const Mesh& shell : split(mesh, connected_components(mesh)))
    if (const Moments s = mesh_moments(shell); s[M1] < largest[M1]) largest = s;
  if (!(largest[M1] < 0)) return {};
  return {-largest[M1], largest.segment<3>(MX) / largest[M1]};
}

/// What a plane cuts out of cavities. @param mesh  vertices merged
double room_mm2(const Mesh& mesh, const SectionPlane& plane) {
  const SectionView view = view_of(plane, *plane.offset_mm, Vector3d::UnitZ());
  double room = 0;
  for (const SectionLoop& loop : section(transformed(mesh, Eigen::Affine3d(view.to_view)), view.depth_mm))
    room += std::max(0.0, -loop_moments(loop).area_mm2);
  return room;
}

/// The three directions that are natural to a body: across its longer side on the ground, across the shorter one, and up.
std::array<Vector3d, 3> usual_normals(const Mesh& mesh, const Vector3d& up) {
  const Eigen::Matrix3d to_ground = up_to_z(up);
  const Vector3d size = bounding_box(transformed(mesh, Eigen::Affine3d(to_ground))).sizes();
  const Eigen::Index along = size.x() >= size.y() ? 1 : 0;
  return {to_ground.row(along), to_ground.row(1 - along), to_ground.row(2)};
}

}  // namespace

SectionPlane usual_plane(const Mesh& mesh, const Vector3d& up) { return {usual_normals(mesh, up)[0]}; }

SectionPlane plane_through_inside(const Mesh& mesh, const Vector3d& up, const Vector3d& centre) {
  const Mesh merged = with_merged_vertices(mesh);
  const Cavity cavity = largest_cavity(merged);
  const std::array<Vector3d, 3> normals = usual_normals(merged, up);
  const SectionPlane usual{normals[0], normals[0].dot(centre)};
  if (cavity.mm3 == 0) return usual;
  constexpr double kNick = 0.1;  // less is none, theory.md (105)
  for (const Vector3d& through : {centre, cavity.middle_mm})
    for (const Vector3d& normal : normals)
      if (const SectionPlane plane{normal, normal.dot(through)}; room_mm2(merged, plane) >= kNick * std::pow(cavity.mm3, 2.0 / 3))
        return plane;
  return usual;
}

Drawing body_drawing(const BodyPicture& what) { return Sheet(what).draw(); }

std::string thumbnail_png(const Delivery& delivery, const Vector3d& up, int pixels) {
  const Mesh body = delivery.body();
  const SectionPlane plane = plane_through_inside(body, up, bounding_box(body).center());
  const Stage stage = stage_for(plane, *plane.offset_mm, up);
  Camera camera = camera_on({&body}, stage.to_view, Vector2d(pixels, pixels));
  camera.width_px = camera.height_px = pixels;
  const std::optional<ClipPlane> cut = has_inside(delivery) ? std::optional(stage.cut) : std::nullopt;
  return to_png(shaded(parts_of_delivery(delivery), camera, cut));
}

}  // namespace rayrep
