#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "base/text.h"
#include "io/archive.h"
#include "io/gcode_text.h"
#include "io/layer_scan.h"
#include "io/png_rows.h"
#include "io/read_sl1.h"
#include "rayrep/physics/materials.h"

namespace rayrep::detail {
namespace {

constexpr const char* kJob = "config.ini";
constexpr const char* kProfile = "prusaslicer.ini";
constexpr double kLargestDisplayMm = 1e4;
constexpr double kMostPixels = 5e8;  // of a display; the finest on sale have 1e8
constexpr double kLongestSidePixels = 1e5;
constexpr double kThickestLayerMm = 10;
constexpr std::size_t kLayersAtOnce = 32;
constexpr std::size_t kBytesAtOnce = std::size_t{64} << 20;

/// "key = value" in lines.
class Ini {
public:
  Ini(const Archive& archive, const char* part, std::size_t most_bytes) : file_(archive.file()), part_(part) {
    if (!archive.has(part))
      fail_read(
          file_, "",
          concat("the archive holds no '", part, "'. Is it a resin archive (.sl1) of PrusaSlicer? Slice it again, for an SL1."));
    const std::string text = archive.read(part, std::min(most_bytes, std::size_t{1} << 24));
    std::string_view rest = text;
    while (!rest.empty()) {
      const std::string_view line = next_line(rest);
      const std::size_t sign = line.find('=');
      if (sign == std::string_view::npos) continue;
      values_.try_emplace(std::string(*after(line.substr(0, sign), "")), *after(line.substr(sign + 1), ""));
    }
  }

  std::string text(const char* key) const {
    const auto found = values_.find(key);
    return found == values_.end() ? "" : found->second;
  }

  /// None where the key is missing; of several, as "1,1" has, all.
  std::vector<double> numbers(const char* key) const {
    const std::string value = text(key);
    std::vector<double> read = numbers_in(value, ",;");
    if (read.empty() && !value.empty()) fail(concat("'", key, "' is '", value, "', which is no number. Slice it again."));
    return read;
  }

  std::optional<double> number(const char* key) const {
    const std::vector<double> all = numbers(key);
    return all.empty() ? std::nullopt : std::optional<double>(all.front());
  }

  /// Above 0, at most `most`.
  double positive(const char* key, double most) const {
    const auto value = number(key);
    if (!value) fail(concat("it does not say '", key, "'. Slice it again."));
    if (!(*value > 0 && *value <= most))
      fail(concat("'", key, "' is ", *value, ", and has to be above 0 and at most ", most, ". Is the file damaged?"));
    return *value;
  }

  bool is_on(const char* key, bool where_missing) const { return number(key).value_or(where_missing ? 1 : 0) != 0; }

  [[noreturn]] void fail(const std::string& what) const { fail_read(file_, concat("part '", part_, "'"), what); }

private:
  const FileBytes& file_;
  const char* part_;
  std::map<std::string, std::string, std::less<>> values_;
};

/// How the pixels of an image lie on the bed.
struct Display {
  std::size_t width = 0;  ///< of the images, pixels
  std::size_t height = 0;
  Eigen::Affine2d to_bed = Eigen::Affine2d::Identity();  ///< from pixels, mm
  bool turned_oblong = false;                            ///< pixels that are not square, and images that are turned
};

/// What the images are larger by than what is to come of them, as printers and resins shrink.
Eigen::Vector3d correction(const Ini& profile) {
  constexpr double most = 10;
  Eigen::Vector3d all = Eigen::Vector3d::Ones();
  for (const std::string name : {"relative_correction", "material_correction"}) {
    if (profile.number((name + "_x").c_str())) {
      for (int k = 0; k < 3; ++k) all[k] *= profile.positive((name + "_" + "xyz"[k]).c_str(), most);
      continue;
    }
    // As older versions have it: in the plane, and in z.
    const std::vector<double> pair = profile.numbers(name.c_str());
    if (pair.empty()) continue;
    if (!(*std::min_element(pair.begin(), pair.end()) > 0 && *std::max_element(pair.begin(), pair.end()) <= most))
      profile.fail(concat("'", name, "' has to be above 0 and at most ", most, ". Is the file damaged?"));
    all.head<2>() *= pair.front();
    all.z() *= pair.back();
  }
  return all;
}

Display display_of(const Ini& profile, const Eigen::Vector3d& larger) {
  const double across_mm = profile.positive("display_width", kLargestDisplayMm);
  const double along_mm = profile.positive("display_height", kLargestDisplayMm);
  const double pixels_x = std::round(profile.positive("display_pixels_x", kLongestSidePixels));
  const double pixels_y = std::round(profile.positive("display_pixels_y", kLongestSidePixels));
  if (!(pixels_x >= 1 && pixels_y >= 1 && pixels_x * pixels_y <= kMostPixels))
    profile.fail(
        concat("the display has ", pixels_x, " x ", pixels_y, " pixels; at most ", kMostPixels, " are read. Is the file damaged?"));
  const std::string orientation = profile.text("display_orientation");
  if (!orientation.empty() && orientation != "portrait" && orientation != "landscape")
    profile.fail(concat("'display_orientation' is '", orientation, "', and has to be portrait or landscape."));
  const bool portrait = orientation != "landscape";

  Display display;
  display.width = static_cast<std::size_t>(portrait ? pixels_y : pixels_x);
  display.height = static_cast<std::size_t>(portrait ? pixels_x : pixels_y);
  const Eigen::Vector2d pixel(across_mm / pixels_x, along_mm / pixels_y);
  display.turned_oblong = portrait && std::abs(pixel.x() - pixel.y()) > 1e-3 * pixel.minCoeff();
  // An image that is not mirrored shows the bed from above, x to the right; turned, x up and y to the left. Mirroring is that of
  // the image, and the SL1's, as its display is seen from below.
  const bool mirror_u = profile.is_on("display_mirror_x", true);
  const bool mirror_v = profile.is_on("display_mirror_y", false);
  const Eigen::Vector2d size(static_cast<double>(display.width), static_cast<double>(display.height));
  Eigen::Matrix2d sides;  // columns: a pixel to the right, and down, on the bed
  Eigen::Vector2d corner = Eigen::Vector2d::Zero();
  sides.col(0) = portrait ? Eigen::Vector2d(0, -pixel.y()) : Eigen::Vector2d(pixel.x(), 0);
  sides.col(1) = portrait ? Eigen::Vector2d(-pixel.x(), 0) : Eigen::Vector2d(0, -pixel.y());
  if (mirror_u) sides.col(0) *= -1;
  if (mirror_v) sides.col(1) *= -1;
  // All of the display lies at coordinates above 0.
  for (int k = 0; k < 2; ++k) corner -= size[k] * sides.col(k).cwiseMin(0);
  const Eigen::Matrix2d shrinking = larger.head<2>().cwiseInverse().asDiagonal();
  display.to_bed.linear() = shrinking * sides;
  display.to_bed.translation() = shrinking * corner;
  return display;
}

/// By the value of a pixel, the part of it that is covered.
std::array<double, 256> coverage_of(const Ini& profile) {
  const double gamma = profile.number("gamma_correction").value_or(1);
  std::array<double, 256> coverage{};
  for (std::size_t value = 0; value < coverage.size(); ++value) {
    const double grey = static_cast<double>(value) / 255;
    // Of 0 there is no grey.
    coverage[value] = gamma > 0 && gamma != 1 ? std::pow(grey, 1 / gamma) : grey;
  }
  return coverage;
}

/// Moments of a layer as a slab. theory.md (4)
Moments slab(const LayerSums& sums, const Eigen::Affine2d& to_bed, double bottom_mm, double height_mm) {
  const Eigen::Matrix2d A = to_bed.linear();
  const Eigen::Vector2d o = to_bed.translation();
  const double volume_scale = std::abs(A.determinant()) * height_mm;
  const Eigen::Vector2d turned = A * sums.first;
  const Eigen::Vector2d first = sums.area * o + turned;
  const Eigen::Matrix2d second =
      sums.area * o * o.transpose() + o * turned.transpose() + turned * o.transpose() + A * sums.second * A.transpose();
  const double z = bottom_mm + 0.5 * height_mm;
  Moments s;
  s[M1] = sums.area;
  s[MX] = first.x();
  s[MY] = first.y();
  s[MZ] = sums.area * z;
  s[MXX] = second(0, 0);
  s[MYY] = second(1, 1);
  s[MZZ] = sums.area * (z * z + height_mm * height_mm / 12);
  s[MXY] = second(0, 1);
  s[MYZ] = first.y() * z;
  s[MXZ] = first.x() * z;
  return volume_scale * s;
}

/// Reads some layers after the others.
class Sl1Reader {
public:
  Sl1Reader(const FileBytes& file, const PrintedOptions& options)
      : file_(file),
        most_bytes_(options.file.memory_bytes),
        archive_(file, "SL1"),
        job_(archive_, kJob, most_bytes_),
        profile_(archive_, kProfile, most_bytes_),
        larger_(correction(profile_)),
        display_(display_of(profile_, larger_)),
        coverage_(coverage_of(profile_)) {}

  Printed read() {
    result_.format = "SL1 archive";
    result_.slicer = job_.text("prusaSlicerVersion");
    result_.features.emplace_back();
    result_.bottom_mm = std::numeric_limits<double>::infinity();
    const double usual = job_.positive("layerHeight", kThickestLayerMm) / larger_.z();
    const double lowest =
        profile_.number("initial_layer_height") ? profile_.positive("initial_layer_height", kThickestLayerMm) / larger_.z() : usual;
    const std::vector<std::string> names = layers();
    double bottom = 0;
    for (std::size_t n = 0; n < names.size();)
      for (const LayerSums& sums : next_sums(names, n)) {
        const double height = bottom == 0 ? lowest : usual;
        layer(sums, bottom, height);
        bottom += height;
      }
    if (result_.features.front().beads == 0) fail_read(file_, "", "all its layers are black: nothing is cured. Slice it again.");
    tell();
    return std::move(result_);
  }

private:
  const FileBytes& file_;
  const std::size_t most_bytes_;
  const Archive archive_;
  const Ini job_;
  const Ini profile_;
  const Eigen::Vector3d larger_;
  const Display display_;
  const std::array<double, 256> coverage_;
  Printed result_;

  /// The number at the end of a layer's name, "JOB00012.png"; none for other parts, such as thumbnails.
  std::optional<std::size_t> number_of(const std::string& name) const {
    if (name.find('/') != std::string::npos || !lower_case(name).ends_with(".png")) return std::nullopt;
    const std::string stem = name.substr(0, name.size() - 4);
    const auto not_digit = [](char c) { return c < '0' || c > '9'; };
    std::size_t begin = stem.size();
    while (begin > 0 && !not_digit(stem[begin - 1])) --begin;
    // A job's name may end in digits, too, and another program may have changed it.
    const std::string job = job_.text("jobDir");
    if (stem.starts_with(job) && job.size() >= begin)
      begin = job.size();
    else if (stem.size() - begin > 5)
      begin = stem.size() - 5;
    double number = 0;
    if (!parse_number(stem.substr(begin), number) || number > 1e6) return std::nullopt;
    return static_cast<std::size_t>(number);
  }

  /// The names of the layers, lowest first.
  std::vector<std::string> layers() const {
    std::map<std::size_t, std::string> by_number;
    for (const std::string& name : archive_.names())
      if (const auto number = number_of(name))
        if (!by_number.emplace(*number, name).second)
          fail_read(file_, concat("part '", name, "'"), concat("there are two layers ", *number, ". Slice it again."));
    if (by_number.empty()) fail_read(file_, "", "it holds no layers (PNG images). Slice it again, for an SL1 or SL1S.");
    std::vector<std::string> names;
    for (const auto& [number, name] : by_number) {
      if (number != names.size())
        fail_read(file_, "", concat("layer ", names.size(), " is missing. The file is damaged; slice or download it again."));
      names.push_back(name);
    }
    const double told = job_.number("numFast").value_or(0) + job_.number("numSlow").value_or(0);
    if (static_cast<double>(names.size()) < told)
      fail_read(file_, "",
                concat("it says that it has ", told, " layers and holds ", names.size(),
                       ". The file is damaged; slice or download it again."));
    return names;
  }

  /// Of the layers from the n-th on, some; n is then the one after them.
  std::vector<LayerSums> next_sums(const std::vector<std::string>& names, std::size_t& n) const {
    const std::size_t first = n;
    std::vector<std::string> images;
    for (std::size_t bytes = 0; n < names.size() && images.size() < kLayersAtOnce && bytes < kBytesAtOnce; ++n) {
      images.push_back(archive_.read(names[n], most_bytes_));
      bytes += images.back().size();
      if (images.back().size() > most_bytes_)
        fail_read(file_, concat("part '", names[n], "'"),
                  concat("unpacked it is longer than the ", most_bytes_ / 1'000'000, " MB that a file is allowed."));
    }
    std::vector<LayerSums> sums(images.size());
    std::vector<std::exception_ptr> failed(images.size());
    tbb::parallel_for(std::size_t{0}, images.size(), [&](std::size_t k) {
      try {
        sums[k] = sums_of(names[first + k], images[k]);
      } catch (...) {
        failed[k] = std::current_exception();
      }
    });
    for (const std::exception_ptr& error : failed)  // the lowest one is told, whoever was first
      if (error) std::rethrow_exception(error);
    return sums;
  }

  LayerSums sums_of(const std::string& name, std::string_view bytes) const {
    PngRows image(file_, name, bytes);
    if (image.width() != display_.width || image.height() != display_.height)
      fail_read(file_, concat("part '", name, "'"),
                concat("the image has ", image.width(), " x ", image.height(), " pixels, and the display of ", kProfile, " ",
                       display_.width, " x ", display_.height, ". Slice it again."));
    LayerScan scan(display_.width, coverage_);
    for (std::size_t row = 0; row < display_.height; ++row) scan.add(image.next());
    return scan.finish();
  }

  void layer(const LayerSums& sums, double bottom_mm, double height_mm) {
    if (!(sums.area > 0)) return;
    PrintedFeature& feature = result_.features.front();
    feature.s += slab(sums, display_.to_bed, bottom_mm, height_mm);
    ++feature.beads;
    result_.bottom_mm = std::min(result_.bottom_mm, bottom_mm);
    PrintedLayer& outline = result_.layers.emplace_back();
    outline.z_mm = bottom_mm + 0.5 * height_mm;
    outline.height_mm = height_mm;
    outline.area_mm2 = std::abs(display_.to_bed.linear().determinant()) * sums.outline_area;
    outline.centroid_mm = display_.to_bed * (sums.outline_first / sums.outline_area).eval();
    outline.size_mm = (display_.to_bed.linear() * sums.box.sizes()).cwiseAbs();
  }

  void note(const std::string& text) { result_.notes.push_back(text); }

  void tell() {
    const double shrinks = 1 / larger_.prod();
    if (const double ml = job_.number("usedMaterial").value_or(0); ml > 0) {
      result_.told_volume_mm3 = 1000 * ml * shrinks;
      result_.told = concat("usedMaterial = ", job_.text("usedMaterial"));
    }
    result_.usual_density_g_cm3 = material("resin").density_g_cm3;
    // 1 is what the slicer writes where nobody has entered a density, and no resin has it.
    const auto density = profile_.number("material_density");
    if (density && *density > 0 && *density != 1) result_.density_g_cm3 = *density;
    tell_supports();
    if ((larger_ - Eigen::Vector3d::Ones()).cwiseAbs().maxCoeff() > 1e-9)
      note(concat("The profile enlarges what is exposed by ", larger_.x(), " x ", larger_.y(), " x ", larger_.z(),
                  " (relative_correction, material_correction), as printer and resin shrink: it is told as it comes out then."));
    const double grown = profile_.number("absolute_correction").value_or(0);
    if (grown != 0)
      note(concat("The profile changes outlines by ", grown,
                  " mm (absolute_correction), against light that spreads: what is exposed is counted, not what cures beside it."));
    if (display_.turned_oblong)
      note(
          "The pixels are not square and the display is turned (portrait): PrusaSlicer 2.5 confuses their sides then, and what is "
          "printed is out of shape, as told here.");
  }

  /// What else than the body is cured with it.
  void tell_supports() {
    const bool supports = profile_.is_on("supports_enable", false);
    const bool pad = profile_.is_on("pad_enable", false);
    const std::string what = supports && pad ? "supports and pad" : supports ? "supports" : "pad";
    result_.features.front().name = supports || pad ? concat("cured resin, with ", what) : "cured resin";
    if (supports || pad)
      note(concat("It is sliced with ", what,
                  ", which cannot be told from the body in the layers and are counted with it. To measure the body alone, slice it "
                  "without."));
  }
};

}  // namespace

Printed read_sl1(const FileBytes& file, const PrintedOptions& options) { return Sl1Reader(file, options).read(); }

}  // namespace rayrep::detail
