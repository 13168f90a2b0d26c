#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "rayrep/mesh/section.h"

namespace rayrep {

/// sRGB and opacity, 0 to 1.
struct Colour {
  double red = 0;
  double green = 0;
  double blue = 0;
  double opacity = 1;
};

/// 0xRRGGBB.
Colour colour_of(std::uint32_t hex, double opacity = 1);
/// Between two, 0 to 1.
Colour mixed(const Colour& a, const Colour& b, double share);

struct Stroke {
  Colour colour;
  double width_px = 1;
  std::vector<double> dashes_px = {};  ///< on, off, ...; empty: none
};

/// Lines, or an area with holes: where its loops wind around a point, it is filled, so that loops as `section` gives them fill what
/// is material, also where bodies overlap.
struct Outline {
  std::vector<SectionLoop> loops = {};
  bool closed = true;
  bool in_mm = false;  ///< of Drawing::scale and Drawing::origin_px, y upward; else pixels, y downward
  std::optional<Colour> fill = {};
  std::optional<Stroke> stroke = {};
  std::string id = {};  ///< of the element in SVG; empty: none
};

/// One line of text.
struct Label {
  enum class Anchor { start, middle, end };
  std::string text;                                 ///< UTF-8; what is not, and control characters, are shown as '?'
  Eigen::Vector2d at_px = Eigen::Vector2d::Zero();  ///< on its baseline
  double size_px = 13;
  Anchor anchor = Anchor::start;
  bool bold = false;
  bool upright = true;  ///< else it runs upward
  Colour colour = {};
};

/// Pixels, row by row from the top: red, green, blue, opacity, 0 to 255, colours not multiplied by opacity.
struct Image {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgba = {};
};

struct PlacedImage {
  Image image;
  Eigen::Vector2d at_px = Eigen::Vector2d::Zero();  ///< its upper left corner
  double scale = 1;                                 ///< pixels of the drawing per one of the image
};

/// What is drawn, one thing over the other, on white: written as SVG or PNG.
struct Drawing {
  double width_px = 720;
  double height_px = 540;
  std::string title;                                    ///< for screen readers and tabs
  double scale = 1;                                     ///< pixels per mm
  Eigen::Vector2d origin_px = Eigen::Vector2d::Zero();  ///< where (0, 0) mm is
  std::vector<std::variant<Outline, Label, PlacedImage>> items = {};

  Eigen::Vector2d to_px(const Eigen::Vector2d& mm) const { return origin_px + scale * Eigen::Vector2d(mm.x(), -mm.y()); }
};

/// An SVG document. Coordinates in mm keep ten digits, and their outlines are paths with fill-rule nonzero in a group whose
/// transform makes pixels of them: what is read from there is what was drawn. Images are embedded.
std::string to_svg(const Drawing& drawing);

/// A PNG image, `sharpness` pixels for one of the drawing. Text is set in the system's sans-serif font.
std::string to_png(const Drawing& drawing, double sharpness = 2);

/// The image by itself, as PNG.
std::string to_png(const Image& image);

/// About how wide a text is.
double text_width_px(const std::string& text, double size_px);

/// Text as pictures may hold it: what is no UTF-8, control characters and what XML does not allow become '?'.
std::string displayable(const std::string& text);

}  // namespace rayrep
