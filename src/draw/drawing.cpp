#include "rayrep/draw/drawing.h"

#include <cmath>

#include "base/text.h"

namespace rayrep {
namespace {

std::string hex_of(const Colour& colour) {
  constexpr const char* kDigits = "0123456789abcdef";
  std::string text = "#";
  for (const double part : {colour.red, colour.green, colour.blue}) {
    const int value = static_cast<int>(std::lround(255 * part));
    text += kDigits[value / 16];
    text += kDigits[value % 16];
  }
  return text;
}

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : displayable(text)) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else if (c == '"')
      out += "&quot;";
    else
      out += c;
  }
  return out;
}

std::string exact(double value) {
  std::string text;
  append_number(text, value + 0.0);
  return text;
}

std::string base64(const std::string& bytes) {
  constexpr const char* kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (std::size_t n = 0; n < bytes.size(); n += 3) {
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k) bits = bits << 8 | (n + k < bytes.size() ? static_cast<unsigned char>(bytes[n + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k) out += n + k <= bytes.size() ? kDigits[bits >> (18 - 6 * k) & 63U] : '=';
  }
  return out;
}

/// How many digits of coordinates in mm, and in pixels.
constexpr int kDigitsMm = 10;
constexpr int kDigitsPx = 7;

std::string path_of(const Outline& outline) {
  std::string text;
  const int digits = outline.in_mm ? kDigitsMm : kDigitsPx;
  for (const SectionLoop& loop : outline.loops) {
    const char* command = "M";
    for (const Eigen::Vector2d& p : loop) {
      text += concat(command, shown(p.x() + 0.0, digits), " ", shown(p.y() + 0.0, digits));
      command = "L";
    }
    if (outline.closed) text += "Z";
  }
  return text;
}

std::string attribute(const char* name, const std::string& value) { return concat(" ", name, "=\"", value, "\""); }

std::string opacity(const char* name, const Colour& colour) {
  return colour.opacity < 1 ? attribute(name, shown(colour.opacity, 3)) : "";
}

std::string element(const Drawing& drawing, const Outline& outline) {
  std::string text = "<path";
  if (!outline.id.empty()) text += attribute("id", escaped(outline.id));
  text += attribute("fill-rule", "nonzero");
  text += attribute("fill", outline.fill ? hex_of(*outline.fill) : "none");
  if (outline.fill) text += opacity("fill-opacity", *outline.fill);
  const double unit = outline.in_mm ? drawing.scale : 1;
  if (outline.stroke) {
    const Stroke& stroke = *outline.stroke;
    text += attribute("stroke", hex_of(stroke.colour)) + opacity("stroke-opacity", stroke.colour) +
            attribute("stroke-width", shown(stroke.width_px / unit)) + attribute("stroke-linejoin", "round");
    std::string dashes;
    for (const double dash : stroke.dashes_px) dashes += (dashes.empty() ? "" : " ") + shown(dash / unit);
    if (!dashes.empty()) text += attribute("stroke-dasharray", dashes);
  }
  text += attribute("d", path_of(outline)) + "/>\n";
  if (!outline.in_mm) return text;
  return concat("<g transform=\"matrix(", exact(drawing.scale), " 0 0 ", exact(-drawing.scale), " ", exact(drawing.origin_px.x()),
                " ", exact(drawing.origin_px.y()), ")\">", text.substr(0, text.size() - 1), "</g>\n");
}

std::string element(const Drawing& /*drawing*/, const Label& label) {
  static constexpr const char* kAnchors[] = {"start", "middle", "end"};
  const std::string x = shown(label.at_px.x(), kDigitsPx);
  const std::string y = shown(label.at_px.y(), kDigitsPx);
  std::string text = "<text" + attribute("x", x) + attribute("y", y) + attribute("font-size", shown(label.size_px)) +
                     attribute("text-anchor", kAnchors[static_cast<std::size_t>(label.anchor)]) +
                     attribute("fill", hex_of(label.colour));
  if (label.bold) text += attribute("font-weight", "bold");
  if (!label.upright) text += attribute("transform", concat("rotate(-90 ", x, " ", y, ")"));
  return text + ">" + escaped(label.text) + "</text>\n";
}

std::string element(const Drawing& /*drawing*/, const PlacedImage& placed) {
  return "<image" + attribute("x", shown(placed.at_px.x(), kDigitsPx)) + attribute("y", shown(placed.at_px.y(), kDigitsPx)) +
         attribute("width", shown(placed.scale * placed.image.width, kDigitsPx)) +
         attribute("height", shown(placed.scale * placed.image.height, kDigitsPx)) +
         attribute("href", "data:image/png;base64," + base64(to_png(placed.image))) + "/>\n";
}

/// How many bytes of UTF-8 begin at `n`; 0: none that may stand in XML.
std::size_t character_length(const std::string& text, std::size_t n) {
  const auto byte = [&](std::size_t k) { return k < text.size() ? static_cast<unsigned char>(text[k]) : 0U; };
  const unsigned first = byte(n);
  if (first < 0x80) return first >= 0x20 && first != 0x7F ? 1 : 0;
  const std::size_t length = first >= 0xF5 ? 0 : first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : first >= 0xC2 ? 2 : 0;
  for (std::size_t k = 1; k < length; ++k)
    if ((byte(n + k) & 0xC0U) != 0x80) return 0;
  const unsigned second = byte(n + 1);
  const bool too_long = (first == 0xE0 && second < 0xA0) || (first == 0xF0 && second < 0x90);
  const bool no_character = (first == 0xED && second >= 0xA0) || (first == 0xF4 && second >= 0x90) ||
                            (first == 0xC2 && second < 0xA0) || (first == 0xEF && second == 0xBF && byte(n + 2) >= 0xBE);
  return too_long || no_character ? 0 : length;
}

}  // namespace

Colour colour_of(std::uint32_t hex, double opacity) {
  return {static_cast<double>(hex >> 16 & 255U) / 255, static_cast<double>(hex >> 8 & 255U) / 255,
          static_cast<double>(hex & 255U) / 255, opacity};
}

Colour mixed(const Colour& a, const Colour& b, double share) {
  const auto mix = [share](double from, double to) { return from + share * (to - from); };
  return {mix(a.red, b.red), mix(a.green, b.green), mix(a.blue, b.blue), mix(a.opacity, b.opacity)};
}

std::string displayable(const std::string& text) {
  std::string out;
  for (std::size_t n = 0; n < text.size();) {
    const std::size_t length = character_length(text, n);
    out += length > 0 ? text.substr(n, length) : "?";
    n += length > 0 ? length : 1;
  }
  return out;
}

double text_width_px(const std::string& text, double size_px) {
  std::size_t characters = 0;
  for (const char c : text) characters += (static_cast<unsigned char>(c) & 0xC0U) != 0x80;
  return 0.57 * size_px * static_cast<double>(characters);
}

std::string to_svg(const Drawing& drawing) {
  const std::string width = shown(drawing.width_px);
  const std::string height = shown(drawing.height_px);
  std::string text =
      concat(R"(<?xml version="1.0" encoding="UTF-8"?>)", "\n<svg xmlns=\"http://www.w3.org/2000/svg\"", attribute("width", width),
             attribute("height", height), attribute("viewBox", concat("0 0 ", width, " ", height)), attribute("role", "img"),
             attribute("font-family", "DejaVu Sans, Verdana, Helvetica, Arial, sans-serif"), ">\n<title>", escaped(drawing.title),
             "</title>\n<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n");
  for (const auto& item : drawing.items) text += std::visit([&drawing](const auto& what) { return element(drawing, what); }, item);
  return text + "</svg>\n";
}

}  // namespace rayrep
