#include "draw/layout.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/text.h"

namespace rayrep {
namespace {

constexpr double kRow_px = 22;
constexpr double kSign_px = 26;
constexpr double kText_px = 13;

}  // namespace

double round_step(double most) {
  const double power = std::pow(10, std::floor(std::log10(most)));
  for (const double factor : {5.0, 2.0})
    if (factor * power <= most) return factor * power;
  return power;
}

std::string elided(const std::string& text, double size_px, double width_px) {
  const std::string whole = displayable(text);
  if (text_width_px(whole, size_px) <= width_px) return whole;
  const auto begins = [&whole](std::size_t n) { return (static_cast<unsigned char>(whole[n]) & 0xC0U) != 0x80; };
  std::size_t left = whole.size() / 2;
  std::size_t right = left;
  std::string shorter;
  do {
    do --left;
    while (left > 0 && !begins(left));
    ++right;
    while (right < whole.size() && !begins(right)) ++right;
    shorter = whole.substr(0, left) + "..." + whole.substr(right);
  } while (left > 0 && right < whole.size() && text_width_px(shorter, size_px) > width_px);
  return shorter;
}

Outline line_px(const Eigen::Vector2d& from, const Eigen::Vector2d& to, const Stroke& stroke) {
  return {.loops = {{from, to}}, .closed = false, .stroke = stroke};
}

Outline rectangle_px(const Eigen::AlignedBox2d& box, const Colour& fill) {
  const Eigen::Vector2d& a = box.min();
  const Eigen::Vector2d& b = box.max();
  return {.loops = {{a, {b.x(), a.y()}, b, {a.x(), b.y()}}}, .fill = fill};
}

SectionLoop arc_px(const Eigen::Vector2d& centre, double radius_px, double from_turns, double share) {
  constexpr int kPieces = 48;
  SectionLoop loop;
  if (share < 1) loop.push_back(centre);
  const int pieces = static_cast<int>(std::ceil(share * kPieces));
  for (int n = 0; n <= (share < 1 ? pieces : pieces - 1); ++n) {
    const double angle = 2 * std::numbers::pi * (from_turns + share * n / pieces);
    loop.emplace_back(centre + radius_px * Eigen::Vector2d(std::cos(angle), -std::sin(angle)));
  }
  return loop;
}

void draw_centre(Drawing& drawing, const Eigen::Vector2d& at_px, const Colour& dark) {
  constexpr double kRadius_px = 7;
  drawing.items.emplace_back(
      Outline{.loops = {arc_px(at_px, kRadius_px)}, .fill = ink::kWhite, .stroke = Stroke{ink::kWhite, 3.5}});
  drawing.items.emplace_back(
      Outline{.loops = {arc_px(at_px, kRadius_px, 0, 0.25), arc_px(at_px, kRadius_px, 0.5, 0.25)}, .fill = dark});
  drawing.items.emplace_back(Outline{.loops = {arc_px(at_px, kRadius_px)}, .stroke = Stroke{dark, 1.4}});
}

void draw_scale_bar(Drawing& drawing, const Eigen::Vector2d& right_px, double length_mm) {
  const Eigen::Vector2d left = right_px - Eigen::Vector2d(length_mm * drawing.scale, 0);
  const Stroke stroke{ink::kText, 1.6};
  drawing.items.emplace_back(line_px(left, right_px, stroke));
  for (const Eigen::Vector2d& end : {left, right_px})
    drawing.items.emplace_back(line_px(end - Eigen::Vector2d(0, 4), end + Eigen::Vector2d(0, 4), stroke));
  drawing.items.emplace_back(Label{.text = shown(length_mm) + " mm",
                                   .at_px = left - Eigen::Vector2d(8, -4.5),
                                   .size_px = kText_px,
                                   .anchor = Label::Anchor::end,
                                   .colour = ink::kText});
}

void Legend::add_area(const std::string& words, const Colour& fill, const Colour& edge) {
  add(words, [fill, edge](Drawing& drawing, const Eigen::Vector2d& middle) {
    const Eigen::Vector2d half(9, 6);
    Outline area = rectangle_px({middle - half, middle + half}, fill);
    area.stroke = Stroke{edge, 1};
    drawing.items.emplace_back(area);
  });
}

void Legend::add_line(const std::string& words, const Stroke& stroke) {
  add(words, [stroke](Drawing& drawing, const Eigen::Vector2d& middle) {
    const Eigen::Vector2d half(11, 0);
    drawing.items.emplace_back(line_px(middle - half, middle + half, stroke));
  });
}

double Legend::height_px() const { return kRow_px * static_cast<double>((entries_.size() + 1) / 2); }

void Legend::draw(Drawing& drawing, const Eigen::Vector2d& at_px, double width_px) const {
  const std::size_t rows = (entries_.size() + 1) / 2;
  const double column_px = 0.5 * width_px;
  for (std::size_t n = 0; n < entries_.size(); ++n) {
    const Eigen::Vector2d left = at_px + Eigen::Vector2d(n < rows ? 0 : column_px, kRow_px * (static_cast<double>(n % rows) + 0.5));
    entries_[n].sign(drawing, left + Eigen::Vector2d(0.5 * kSign_px, 0));
    drawing.items.emplace_back(Label{.text = elided(entries_[n].words, kText_px, column_px - kSign_px - 16),
                                     .at_px = left + Eigen::Vector2d(kSign_px + 6, 4.5),
                                     .size_px = kText_px,
                                     .colour = ink::kText});
  }
}

}  // namespace rayrep
