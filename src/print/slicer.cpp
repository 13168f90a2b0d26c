#include "rayrep/print/slicer.h"

#include <Eigen/Geometry>
#include <system_error>
#include <vector>

#include "base/text.h"
#include "io/gcode_text.h"
#include "io/mesh_io_detail.h"
#include "rayrep/base/child_process.h"
#include "rayrep/base/error.h"

namespace rayrep {
namespace {

namespace fs = std::filesystem;

/// What went wrong, in words.
[[noreturn]] void fail(const SlicerOptions& options, const Ended& ended) {
  const std::string said = ended.said.empty() ? "" : " It said: " + ended.said;
  switch (ended.how) {
    case Ended::How::not_found:
      throw Error(ErrorCode::usage, concat("There is no program '", options.program, "' that can be run (", ended.said,
                                           "). Install it, or say where it is: --slicer /path/to/prusa-slicer."));
    case Ended::How::took_too_long:
      throw Error(ErrorCode::solver,
                  concat("'", options.program, "' took longer than ", options.time_limit_s, " s and was stopped.", said));
    case Ended::How::killed_by_signal:
      throw Error(ErrorCode::solver, concat("'", options.program, "' was ended by signal ", ended.code, ".", said));
    case Ended::How::exited:
      break;
  }
  throw Error(ErrorCode::solver,
              concat("'", options.program, "' did not slice the mesh (exit code ", ended.code, ").", said,
                     " Does the body fit the bed of the profile, and does the profile work in the slicer itself?"));
}

}  // namespace

SlicerProfile read_slicer_profile(const fs::path& path) {
  SlicerProfile profile;
  if (path.empty()) return profile;
  const std::string bytes = detail::load(path, {});
  std::string_view rest = bytes;
  while (!rest.empty()) {
    const std::string_view line = detail::next_line(rest);
    const auto value_of = [line](std::string_view key) -> std::optional<std::string_view> {
      const auto behind = detail::after(line, key);
      return behind && behind->starts_with('=') ? detail::after(*behind, "=") : std::nullopt;
    };
    if (const auto density = value_of("filament_density"))
      if (const std::vector<double> all = detail::numbers_in(*density, ",;"); !all.empty() && all[0] > 0)
        profile.density_g_cm3 = all[0];
    const auto number_of = [&value_of](std::string_view key, std::optional<double>& to) {
      double number = 0;
      if (auto text = value_of(key)) {
        const bool percent = text->ends_with('%');
        if (percent) text->remove_suffix(1);
        if (parse_number(*text, number) && percent == (key == "fill_density")) to = number;
      }
    };
    const auto count_of = [&number_of](std::string_view key, std::optional<int>& to) {
      std::optional<double> number;
      number_of(key, number);
      if (number && *number >= 0 && *number < 1e6) to = static_cast<int>(*number);
    };
    number_of("fill_density", profile.fill_percent);
    if (const auto pattern = value_of("fill_pattern")) profile.fill_pattern = *pattern;
    count_of("perimeters", profile.perimeters);
    number_of("extrusion_width", profile.extrusion_width_mm);
    if (profile.extrusion_width_mm == 0) profile.extrusion_width_mm.reset();  // automatic
    count_of("top_solid_layers", profile.top_layers);
    count_of("bottom_solid_layers", profile.bottom_layers);
    number_of("layer_height", profile.layer_height_mm);
    if (const auto shape = value_of("bed_shape")) {
      const std::vector<double> all = detail::numbers_in(*shape, ",x");
      Eigen::AlignedBox2d box;
      for (std::size_t n = 0; n + 1 < all.size(); n += 2) box.extend(Eigen::Vector2d(all[n], all[n + 1]));
      if (!box.isEmpty()) profile.bed_centre_mm = box.center();
    }
  }
  return profile;
}

Sliced slice(const Delivery& delivery, const std::string& ending, const fs::path& gcode, const SlicerOptions& options,
             const Progress& progress) {
  const SlicerProfile profile = read_slicer_profile(options.profile);
  const TemporaryFolder folder;
  // Only 3MF tells where to pause.
  const fs::path model = folder.path() / ("body" + (delivery.pauses_mm.empty() ? ending : ".3mf"));
  const fs::path laid_down = folder.path() / "body.gcode";
  const Eigen::Matrix3d upright = up_to_z(options.print_direction);
  Delivery turned = delivery;
  if (!upright.isIdentity())
    for (Part& part : turned.parts) part.mesh = transformed(part.mesh, Eigen::Affine3d(upright));
  write_delivery(model, turned);

  ProgramCall call{options.program, {"--export-gcode"}, folder.path(), folder.path() / "output", {}};
  auto& words = call.arguments;
  if (!options.profile.empty()) words.insert(words.end(), {"--load", fs::absolute(options.profile).string()});
  const Eigen::Vector2d& centre = profile.bed_centre_mm;
  words.insert(words.end(),
               {"--fill-density", "100%", "--fill-pattern", "rectilinear", "--support-material-buildplate-only", "--center",
                shown(centre.x(), 9) + "," + shown(centre.y(), 9), "--output", laid_down.string(), model.string()});
  const Ended ended = run_program(call, options.time_limit_s, progress);
  std::error_code error;
  if (ended.how != Ended::How::exited || ended.code != 0 || !fs::exists(laid_down, error)) fail(options, ended);

  progress.check();
  Sliced sliced;
  sliced.printed = read_printed(laid_down);
  sliced.placed = place_print(sliced.printed, delivery.body(), {options.print_direction, 0, centre});
  fs::copy_file(laid_down, gcode, fs::copy_options::overwrite_existing, error);
  if (error) throw Error(ErrorCode::write, concat("Cannot write '", gcode.string(), "': ", error.message(), "."));
  return sliced;
}

}  // namespace rayrep
