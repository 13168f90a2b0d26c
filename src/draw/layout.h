#pragma once

#include <Eigen/Geometry>
#include <functional>
#include <string>
#include <vector>

#include "rayrep/draw/drawing.h"

// What the pictures have in common: colours, signs, a legend, round numbers.

namespace rayrep {

namespace ink {
inline const Colour kText = colour_of(0x26323d);
inline const Colour kFaint = colour_of(0x7a8792);
inline const Colour kGrid = colour_of(0xe6eaee);
inline const Colour kWhite = colour_of(0xffffff);
inline const Colour kMaterial = colour_of(0xedb45e);
inline const Colour kMaterialEdge = colour_of(0x7a5014);
inline const Colour kInfill = colour_of(0xfdf1da);
inline const Colour kInfillLines = colour_of(0xd39a45);
inline const Colour kInsert = colour_of(0x7a63b0);
inline const Colour kInsertEdge = colour_of(0x3c2d66);
inline const Colour kWater = colour_of(0x1769aa);
inline const Colour kWaterTint = colour_of(0xdcecf8);
inline const Colour kAxis = colour_of(0xb3202c);
inline const Colour kGround = colour_of(0x4b5a45);
inline const Colour kSupport = colour_of(0x2b7d3c);
}  // namespace ink

/// The largest of 1, 2, 5, 10, 20 ... times a power of ten that is no more than `most`, which is positive.
double round_step(double most);

/// The text, shortened in its middle so that it is no wider.
std::string elided(const std::string& text, double size_px, double width_px);

Outline line_px(const Eigen::Vector2d& from, const Eigen::Vector2d& to, const Stroke& stroke);
Outline rectangle_px(const Eigen::AlignedBox2d& box, const Colour& fill);
/// A circle as a polygon. @param share  of it, from the right against the clock, as a sector where it is less than 1
SectionLoop arc_px(const Eigen::Vector2d& centre, double radius_px, double from_turns = 0, double share = 1);

/// The sign of a centre of mass: a circle of which two quarters are dark.
void draw_centre(Drawing& drawing, const Eigen::Vector2d& at_px, const Colour& dark);
/// A bar that is so long, with its length above it, which ends at `right_px`.
void draw_scale_bar(Drawing& drawing, const Eigen::Vector2d& right_px, double length_mm);

/// What a picture says below: signs and words in two columns.
class Legend {
public:
  using Sign = std::function<void(Drawing&, const Eigen::Vector2d& middle_px)>;
  void add(const std::string& words, Sign sign) { entries_.push_back({words, std::move(sign)}); }
  void add_area(const std::string& words, const Colour& fill, const Colour& edge);
  void add_line(const std::string& words, const Stroke& stroke);
  double height_px() const;
  void draw(Drawing& drawing, const Eigen::Vector2d& at_px, double width_px) const;

private:
  struct Entry {
    std::string words;
    Sign sign;
  };
  std::vector<Entry> entries_;
};

}  // namespace rayrep
