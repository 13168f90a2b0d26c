// No bytes whatsoever may make a mesh reader crash, hang, ask for absurd memory or return a mesh whose indices are out of range;
// they end in a mesh or in Error{input}, and a mesh that was read is written and read back the same. The first byte of the input
// picks the kind and how much memory a file may take.

#include <zip.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>

#include "bodies.h"
#include "io/mesh_io_detail.h"
#include "rayrep/base/error.h"

namespace {

using fuzz::require;
using rayrep::Mesh;
using rayrep::MeshFile;

/// A 3MF archive around the XML of a model, not compressed: random changes of a compressed one seldom reach the XML. What begins
/// with "<config" in it becomes the parts in which slicers mark volumes.
std::string archive_around(const std::string& text) {
  const std::size_t end = std::min(text.size(), text.find("<config"));
  const std::string model = text.substr(0, end);
  const std::string marks = text.substr(end);
  zip_error_t error;
  zip_error_init(&error);
  zip_source_t* target = zip_source_buffer_create(nullptr, 0, 0, &error);
  zip_source_keep(target);
  zip_t* archive = zip_open_from_source(target, ZIP_CREATE | ZIP_TRUNCATE, &error);
  require(archive != nullptr, "a zip archive can be made");
  const zip_int64_t index =
      zip_file_add(archive, "3D/3dmodel.model", zip_source_buffer(archive, model.data(), model.size(), 0), ZIP_FL_ENC_UTF_8);
  zip_set_file_compression(archive, static_cast<zip_uint64_t>(index), ZIP_CM_STORE, 0);
  for (const char* name : {"Metadata/Slic3r_PE_model.config", "Metadata/model_settings.config"})
    if (!marks.empty()) zip_file_add(archive, name, zip_source_buffer(archive, marks.data(), marks.size(), 0), ZIP_FL_ENC_UTF_8);
  require(zip_close(archive) == 0, "a zip archive can be closed");
  zip_stat_t stat;
  zip_source_stat(target, &stat);
  std::string bytes(stat.size, '\0');
  zip_source_open(target);
  zip_source_read(target, bytes.data(), bytes.size());
  zip_source_close(target);
  zip_source_free(target);
  return bytes;
}

MeshFile read(const std::string& bytes, const std::string& ending, std::size_t memory_bytes = 100'000'000) {
  rayrep::ReadOptions options;
  options.memory_bytes = memory_bytes;
  return rayrep::detail::read_mesh_bytes({bytes, "input" + ending}, options);
}

bool is_finite(const Mesh& mesh) {
  for (const auto& vertex : mesh.vertices)
    if (!vertex.allFinite()) return false;
  return true;
}

void check_laws(const MeshFile& file) {
  const Mesh& mesh = file.mesh;
  require(!mesh.triangles.empty(), "a mesh that was read has triangles");
  for (const auto& triangle : mesh.triangles)
    for (int k = 0; k < 3; ++k)
      require(triangle[k] >= 0 && static_cast<std::size_t>(triangle[k]) < mesh.vertices.size(), "indices are in range");
  require(file.polygons > 0 && file.polygons <= mesh.triangles.size(), "a polygon has at least one triangle");
  if (!is_finite(mesh) || mesh.triangles.size() > 10000) return;
  for (const char* ending : {".obj", ".ply", ".3mf"}) {
    const Mesh back = read(rayrep::detail::encode_mesh(std::string("a") + ending, mesh), ending).mesh;
    require(back.vertices == mesh.vertices && back.triangles == mesh.triangles, "what is written reads back the same");
  }
  const Mesh stored = rayrep::as_stored("a.stl", mesh);
  if (!is_finite(stored)) return;
  const Mesh back = read(rayrep::detail::encode_mesh("a.stl", mesh), ".stl").mesh;
  require(back.triangles.size() == mesh.triangles.size(), "an STL file has as many triangles as were written");
  for (std::size_t t = 0; t < back.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k)
      require(back.corner(t, k) == stored.corner(t, k), "what an STL file gives back is what as_stored says");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {  // NOLINT(readability-identifier-naming)
  constexpr std::array<const char*, 6> kEndings = {".stl", ".obj", ".ply", ".off", ".3mf", ".model"};
  if (size == 0) return 0;
  const std::string ending = kEndings[data[0] % kEndings.size()];
  const std::size_t memory_bytes = data[0] < 200 ? 100'000'000 : 20'000;
  const std::string bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  try {
    check_laws(ending == ".model" ? read(archive_around(bytes), ".3mf", memory_bytes) : read(bytes, ending, memory_bytes));
  } catch (const rayrep::Error& error) {
    require(error.code() == rayrep::ErrorCode::input, "bad bytes are Error{input}");
  }
  return 0;
}
