#include "rayrep/io/printed.h"

#include "io/mesh_io_detail.h"

namespace rayrep {

namespace detail {
Printed read_gcode(const FileBytes& file, const PrintedOptions& options);
}  // namespace detail

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

bool is_printed(const std::filesystem::path& path) {
  const std::string ending = detail::lower_case(path.extension().string());
  return ending == ".gcode" || ending == ".gco" || ending == ".g";
}

Printed read_printed(const std::filesystem::path& path, const PrintedOptions& options) {
  const std::string bytes = detail::load(path, options.file);
  return detail::read_gcode({bytes, path.string()}, options);
}

}  // namespace rayrep
