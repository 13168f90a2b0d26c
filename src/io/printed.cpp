#include "rayrep/io/printed.h"

#include "io/archive.h"
#include "io/read_gcode.h"
#include "io/read_sl1.h"

namespace rayrep {

Moments Printed::body() const {
  Moments sum = Moments::Zero();
  for (const PrintedFeature& feature : features)
    if (feature.of_body) sum += feature.s;
  return sum;
}

double Printed::volume_mm3() const {
  double sum = 0;
  for (const PrintedFeature& feature : features) sum += feature.s[M1];
  return sum;
}

namespace {

/// Layers for a resin printer.
bool is_resin(const std::filesystem::path& path) {
  const std::string ending = detail::lower_case(path.extension().string());
  return ending == ".sl1" || ending == ".sl1s";
}

/// A sliced project of Bambu Studio or OrcaSlicer.
bool is_project(const std::filesystem::path& path) { return detail::lower_case(path.filename().string()).ends_with(".gcode.3mf"); }

/// The G-code of its plate.
std::string plate_of(const detail::FileBytes& file, std::size_t most_bytes) {
  const detail::Archive archive(file);
  std::vector<std::string> plates;
  for (const std::string& name : archive.names())
    if (name.starts_with("Metadata/") && name.ends_with(".gcode")) plates.push_back(name);
  if (plates.empty()) detail::fail_read(file, "", "the project holds no G-code. Slice it, and export the plate as a sliced file.");
  if (plates.size() > 1)
    detail::fail_read(file, "", concat("it holds the G-code of ", plates.size(), " plates. Export each plate by itself."));
  std::string bytes = archive.read(plates.front(), most_bytes);
  if (bytes.size() > most_bytes)
    detail::fail_read(file, "", concat("unpacked it is longer than the ", most_bytes / 1'000'000, " MB that a file is allowed."));
  return bytes;
}

}  // namespace

bool is_printed(const std::filesystem::path& path) {
  if (is_resin(path)) return true;
  const std::string ending = detail::lower_case(path.extension().string());
  return ending == ".gcode" || ending == ".gco" || ending == ".g" || is_project(path);
}

Printed read_printed(const std::filesystem::path& path, const PrintedOptions& options) {
  const std::string bytes = detail::load(path, options.file);
  if (is_resin(path)) return detail::read_sl1({bytes, path.string()}, options);
  if (is_project(path)) {
    const std::string plate = plate_of({bytes, path.string()}, options.file.memory_bytes);
    return detail::read_gcode({plate, path.string()}, options);
  }
  return detail::read_gcode({bytes, path.string()}, options);
}

}  // namespace rayrep
