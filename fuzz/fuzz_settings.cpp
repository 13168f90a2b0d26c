// Whatever is given as an option ends in a value or in Error{usage}; a value is shown in a way that is read as the same value. The
// first byte of the input picks the goal and the purpose; each line after it is NAME=TEXT.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <variant>

#include "bodies.h"
#include "rayrep/base/error.h"
#include "rayrep/base/setting.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/make/hollow.h"
#include "rayrep/physics/materials.h"
#include "rayrep/physics/spec.h"

namespace {

using fuzz::require;
using rayrep::Setting;
using rayrep::Settings;

/// Runs what may throw Error{usage}; false if it did.
template <typename Work>
bool accepted(const Work& work) {
  try {
    work();
    return true;
  } catch (const rayrep::Error& error) {
    require(error.code() == rayrep::ErrorCode::usage, "what makes no sense is Error{usage}");
    require(std::string(error.what()).size() > 10, "and says why");
    return false;
  }
}

void set(Settings& settings, const std::string& name, const std::string& text) {
  for (Setting& setting : settings) {
    if (setting.name != name) continue;
    const std::string before = shown(setting);
    if (!accepted([&] { parse(setting, text); })) {
      require(shown(setting) == before, "what is refused changes nothing");
      return;
    }
    const std::string told = shown(setting);
    if (told == "inf" || name == "submerged") return;  // for check to refuse; six digits may be those of 1
    // What is not set, or does not apply, has a name of its own.
    if (told == setting.unset || told == "auto" || told == "free" || told == "none" || told == "yo-yo") return;
    require(accepted([&] { parse(setting, told); }), "what is shown can be read");
    // A direction is made a unit vector again, which may turn its last digit.
    if (name != "up") require(shown(setting) == told, "what is shown is read as the same");
    return;
  }
  std::vector<std::string> names;
  for (const Setting& setting : settings) names.push_back(setting.name);
  rayrep::nearest_name(name, names);
  accepted([&] { rayrep::parse_length_unit(name); });
  accepted([&] { rayrep::material(name); });
  accepted([&] { rayrep::parse_direction(text); });
  accepted([&] { rayrep::parse_open_numbers("numbers", text); });
}

template <typename Spec>
void run(Setting::For purpose, const std::string& lines) {
  Spec spec;
  rayrep::HollowOptions options;
  Settings settings = rayrep::settings(spec, purpose);
  for (Setting& row : rayrep::settings(spec.print, purpose)) settings.push_back(std::move(row));
  for (Setting& row : rayrep::settings(options, spec)) settings.push_back(std::move(row));
  for (std::size_t begin = 0; begin < lines.size();) {
    const std::size_t end = std::min(lines.find('\n', begin), lines.size());
    const std::string line = lines.substr(begin, end - begin);
    const std::size_t equals = std::min(line.find('='), line.size());
    set(settings, line.substr(0, equals), equals < line.size() ? line.substr(equals + 1) : "");
    begin = end + 1;
  }
  accepted([&] { check(settings); });
  accepted([&] { check(spec, purpose); });
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {  // NOLINT(readability-identifier-naming)
  if (size == 0 || size > 2000) return 0;
  std::string lines(reinterpret_cast<const char*>(data) + 1, size - 1);
  std::replace(lines.begin(), lines.end(), '\0', ' ');  // no argument of a command holds one
  const Setting::For purpose = data[0] & 4 ? Setting::For::judging : Setting::For::making;
  switch (data[0] % 4) {
    case 0:
      run<rayrep::FloatSpec>(purpose, lines);
      break;
    case 1:
      run<rayrep::SpinSpec>(purpose, lines);
      break;
    case 2:
      run<rayrep::StandSpec>(purpose, lines);
      break;
    default:
      run<rayrep::TargetSpec>(purpose, lines);
  }
  return 0;
}
