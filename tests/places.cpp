#include "places.h"

namespace rayrep::test {

std::filesystem::path source_folder() { return RAYREP_SOURCE_DIR; }

std::filesystem::path shared_meshes() { return RAYREP_SHARED_MESHES; }

const std::string& tool() {
  static const std::string path = RAYREP_TOOL;
  return path;
}

}  // namespace rayrep::test
