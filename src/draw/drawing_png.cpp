#include <cairo.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <new>
#include <numbers>

#include "rayrep/base/error.h"
#include "rayrep/draw/drawing.h"

namespace rayrep {
namespace {

struct Destroy {
  void operator()(cairo_t* context) const { cairo_destroy(context); }
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
};
using Context = std::unique_ptr<cairo_t, Destroy>;
using Surface = std::unique_ptr<cairo_surface_t, Destroy>;

void require(cairo_status_t status) {
  if (status == CAIRO_STATUS_NO_MEMORY) throw std::bad_alloc();
  if (status != CAIRO_STATUS_SUCCESS)
    throw Error(ErrorCode::write, std::string("A picture cannot be drawn: ") + cairo_status_to_string(status) + ".");
}

Surface new_surface(int width, int height) {
  Surface surface(cairo_image_surface_create(CAIRO_FORMAT_ARGB32, width, height));
  require(cairo_surface_status(surface.get()));
  return surface;
}

void use(cairo_t* context, const Colour& colour) {
  cairo_set_source_rgba(context, colour.red, colour.green, colour.blue, colour.opacity);
}

void trace(cairo_t* context, const Drawing& drawing, const Outline& outline) {
  cairo_new_path(context);
  for (const SectionLoop& loop : outline.loops) {
    cairo_new_sub_path(context);
    for (const Eigen::Vector2d& point : loop) {
      const Eigen::Vector2d p = outline.in_mm ? drawing.to_px(point) : point;
      cairo_line_to(context, p.x(), p.y());
    }
    if (outline.closed) cairo_close_path(context);
  }
}

void paint(cairo_t* context, const Drawing& drawing, const Outline& outline) {
  trace(context, drawing, outline);
  if (outline.fill) {
    use(context, *outline.fill);
    cairo_set_fill_rule(context, CAIRO_FILL_RULE_WINDING);
    cairo_fill_preserve(context);
  }
  if (!outline.stroke) return;
  const Stroke& stroke = *outline.stroke;
  use(context, stroke.colour);
  cairo_set_line_width(context, stroke.width_px);
  cairo_set_line_join(context, CAIRO_LINE_JOIN_ROUND);
  cairo_set_dash(context, stroke.dashes_px.data(), static_cast<int>(stroke.dashes_px.size()), 0);
  cairo_stroke(context);
}

void paint(cairo_t* context, const Drawing& /*drawing*/, const Label& label) {
  const std::string text = displayable(label.text);
  cairo_save(context);
  use(context, label.colour);
  cairo_select_font_face(context, "DejaVu Sans", CAIRO_FONT_SLANT_NORMAL,
                         label.bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(context, label.size_px);
  cairo_text_extents_t extents;
  cairo_text_extents(context, text.c_str(), &extents);
  cairo_translate(context, label.at_px.x(), label.at_px.y());
  if (!label.upright) cairo_rotate(context, -std::numbers::pi / 2);
  const double shift = label.anchor == Label::Anchor::start ? 0 : label.anchor == Label::Anchor::middle ? 0.5 : 1;
  cairo_move_to(context, -shift * extents.x_advance, 0);
  cairo_show_text(context, text.c_str());
  cairo_restore(context);
}

Surface surface_of(const Image& image) {
  Surface surface = new_surface(image.width, image.height);
  cairo_surface_flush(surface.get());
  const int stride = cairo_image_surface_get_stride(surface.get());
  unsigned char* bytes = cairo_image_surface_get_data(surface.get());
  for (int y = 0; y < image.height; ++y) {
    auto* row = reinterpret_cast<std::uint32_t*>(bytes + static_cast<std::ptrdiff_t>(y) * stride);
    for (int x = 0; x < image.width; ++x) {
      const std::uint8_t* p = &image.rgba[4 * (static_cast<std::size_t>(y) * image.width + x)];
      const std::uint32_t opacity = p[3];
      const auto times = [opacity](std::uint32_t part) { return (part * opacity + 127) / 255; };
      row[x] = opacity << 24 | times(p[0]) << 16 | times(p[1]) << 8 | times(p[2]);
    }
  }
  cairo_surface_mark_dirty(surface.get());
  return surface;
}

void paint(cairo_t* context, const Drawing& /*drawing*/, const PlacedImage& placed) {
  const Surface surface = surface_of(placed.image);
  cairo_save(context);
  cairo_translate(context, placed.at_px.x(), placed.at_px.y());
  cairo_scale(context, placed.scale, placed.scale);
  cairo_set_source_surface(context, surface.get(), 0, 0);
  cairo_paint(context);
  cairo_restore(context);
}

cairo_status_t append(void* to, const unsigned char* bytes, unsigned length) {
  static_cast<std::string*>(to)->append(reinterpret_cast<const char*>(bytes), length);
  return CAIRO_STATUS_SUCCESS;
}

std::string encoded(cairo_surface_t* surface) {
  std::string bytes;
  require(cairo_surface_write_to_png_stream(surface, append, &bytes));
  return bytes;
}

}  // namespace

std::string to_png(const Drawing& drawing, double sharpness) {
  const Surface surface = new_surface(static_cast<int>(std::ceil(sharpness * drawing.width_px)),
                                      static_cast<int>(std::ceil(sharpness * drawing.height_px)));
  const Context context(cairo_create(surface.get()));
  cairo_set_source_rgb(context.get(), 1, 1, 1);
  cairo_paint(context.get());
  cairo_scale(context.get(), sharpness, sharpness);
  for (const auto& item : drawing.items) std::visit([&](const auto& what) { paint(context.get(), drawing, what); }, item);
  require(cairo_status(context.get()));
  return encoded(surface.get());
}

std::string to_png(const Image& image) { return encoded(surface_of(image).get()); }

}  // namespace rayrep
