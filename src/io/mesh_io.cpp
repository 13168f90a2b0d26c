#include "rayrep/io/mesh_io.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

#include "io/descriptor.h"
#include "io/mesh_io_detail.h"
#include "mesh/float32.h"
#include "rayrep/base/error.h"
#include "rayrep/mesh/assembly.h"

// The readers are our own because those of assimp 5.2.5 are measured to fall short on ../shared/meshes (33 files that are not
// 3MF): its counts agree, but its vertices are float32, which moves volumes of text files by up to 1e-7 and would break the
// promise that OBJ and PLY restore every double. Two million triangles take it 1.08 s from OBJ (ours 0.22 s), 0.38 s from
// PLY (0.20 s), 0.14 s from STL (0.12 s). It also refuses trailing bytes and upper case ASCII STL.

namespace rayrep {

// Readers fill mesh (in file units), format, polygons and notes; 3MF also mm_per_unit. Encoders give the bytes of the file.
namespace detail {
bool has_exact_binary_stl_size(std::string_view bytes);
MeshFile read_stl(const FileBytes& file, const ReadOptions& options);
std::string encode_stl(const Mesh& mesh);
MeshFile read_obj(const FileBytes& file, const ReadOptions& options);
std::string encode_obj(const Mesh& mesh);
bool is_ply(std::string_view bytes);
MeshFile read_ply(const FileBytes& file, const ReadOptions& options);
std::string encode_ply(const Mesh& mesh);
bool is_off(std::string_view bytes);
MeshFile read_off(const FileBytes& file, const ReadOptions& options);
bool is_3mf(std::string_view bytes);
MeshFile read_3mf(const FileBytes& file, const ReadOptions& options);
std::string encode_3mf(const Mesh& mesh);
std::string encode_3mf(const Mesh& mesh, const std::string& thumbnail_png);
std::string encode_3mf(const Delivery& delivery, ThreeMfFlavor flavor);
}  // namespace detail

namespace {

namespace fs = std::filesystem;
using detail::Descriptor;
using detail::fail_read;
using detail::FileBytes;
using detail::reason;

std::string ending_of(const fs::path& path) { return detail::lower_case(path.extension().string()); }

/// One kind of mesh file. A kind is added with its row in kFormats, its own source and its own test.
struct Format {
  const char* ending;                     ///< in lower case
  bool (*is_it)(std::string_view bytes);  ///< certain from the content alone; null: only the ending tells
  MeshFile (*read)(const FileBytes& file, const ReadOptions& options);
  std::string (*encode)(const Mesh& mesh);  ///< null: not written
  bool is_float32 = false;                  ///< what is written rounds coordinates to float32
  bool has_unit = false;                    ///< its reader sets mm_per_unit
};

constexpr std::array<Format, 5> kFormats = {{
    {".stl", detail::has_exact_binary_stl_size, detail::read_stl, detail::encode_stl, true},
    {".obj", nullptr, detail::read_obj, detail::encode_obj},
    {".ply", detail::is_ply, detail::read_ply, detail::encode_ply},
    {".off", detail::is_off, detail::read_off, nullptr},
    {".3mf", detail::is_3mf, detail::read_3mf, detail::encode_3mf, false, true},
}};

/// ".stl, .obj or .3mf": the endings of all kinds that pass.
template <class Passes>
std::string endings(const Passes& passes) {
  std::vector<std::string> found;
  for (const Format& format : kFormats)
    if (passes(format)) found.emplace_back(format.ending);
  std::string text;
  for (std::size_t i = 0; i < found.size(); ++i) text += (i == 0 ? "" : i + 1 < found.size() ? ", " : " or ") + found[i];
  return text;
}

const Format* format_of_ending(std::string_view ending) {
  for (const Format& format : kFormats)
    if (format.ending == ending) return &format;
  return nullptr;
}

/// By the content where it is certain, also that of the ending first; else by the ending. Null: neither is known.
const Format* format_of(std::string_view bytes, const Format* by_ending) {
  if (by_ending != nullptr && by_ending->is_it != nullptr && by_ending->is_it(bytes)) return by_ending;
  for (const Format& format : kFormats)
    if (format.is_it != nullptr && format.is_it(bytes)) return &format;
  return by_ending;
}

}  // namespace

std::string detail::load(const fs::path& path, const ReadOptions& options) {
  const FileBytes nothing{{}, path.string()};
  // Not blocking, so that a named pipe is refused below rather than waited for.
  const Descriptor fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  struct stat info {};
  if (fd.get() < 0 || ::fstat(fd.get(), &info) != 0)
    fail_read(nothing, "", concat(reason(errno), ". Check the name and the folder."));
  if (S_ISDIR(info.st_mode)) fail_read(nothing, "", "it is a folder. Name a mesh file in it.");
  if (!S_ISREG(info.st_mode)) fail_read(nothing, "", "it is not a regular file. Save the mesh to a file first.");
  if (info.st_size == 0) fail_read(nothing, "", "the file is empty. Export or download it again.");
  if (static_cast<std::uintmax_t>(info.st_size) > options.memory_bytes)
    fail_read(nothing, "",
              concat("the file has ", info.st_size, " bytes; at most ", options.memory_bytes,
                     " are allowed. Reduce the number of triangles."));
  std::string bytes(static_cast<std::size_t>(info.st_size), '\0');
  std::size_t filled = 0;
  while (filled < bytes.size()) {
    const ssize_t got = ::read(fd.get(), bytes.data() + filled, bytes.size() - filled);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) fail_read(nothing, concat("byte ", filled), concat(reason(errno), "."));
    if (got == 0) break;  // it has shrunk meanwhile
    filled += static_cast<std::size_t>(got);
  }
  bytes.resize(filled);
  return bytes;
}

MeshFile detail::read_mesh_bytes(const FileBytes& file, const ReadOptions& options) {
  if (file.bytes.empty()) fail_read(file, "", "the file is empty. Export or download it again.");
  if (file.bytes.starts_with("version https://git-lfs"))
    fail_read(file, "", "it is a Git LFS pointer, not the mesh itself. Run 'git lfs pull' first.");
  if (file.bytes.size() > options.memory_bytes)
    fail_read(file, "",
              concat("the file has ", file.bytes.size(), " bytes; at most ", options.memory_bytes,
                     " are allowed. Reduce the number of triangles."));
  FileBytes content = file;
  if (content.bytes.starts_with("\xEF\xBB\xBF")) content.bytes.remove_prefix(3);
  const std::string ending = ending_of(file.name);
  const Format* by_ending = format_of_ending(ending);
  const Format* format = format_of(content.bytes, by_ending);
  if (format == nullptr)
    fail_read(file, "",
              concat("'", ending, "' is not a kind of mesh that rayrep reads. Save it as ",
                     endings([](const Format&) { return true; }), "."));
  MeshFile result = format->read(content, options);
  if (result.mesh.triangles.empty())
    fail_read(file, "", concat("it is ", result.format, " but holds no triangles. Check what was exported."));
  if (format != by_ending)
    result.notes.push_back(concat("Read as ", result.format, ", as its content says, in spite of the ending '", ending, "'."));
  if (!format->has_unit) result.mm_per_unit = millimetres(options.unit);
  if (result.mm_per_unit != 1) {
    for (auto& vertex : result.mesh.vertices) vertex *= result.mm_per_unit;
    for (std::vector<Part>* parts : {&result.modifiers, &result.pieces, &result.inserts})
      for (Part& part : *parts) {
        for (auto& vertex : part.mesh.vertices) vertex *= result.mm_per_unit;
        part.to_bed.translation() *= result.mm_per_unit;
      }
  }
  return result;
}

double millimetres(LengthUnit unit) {
  switch (unit) {
    case LengthUnit::millimetre:
      return 1;
    case LengthUnit::centimetre:
      return 10;
    case LengthUnit::metre:
      return 1000;
    case LengthUnit::inch:
      break;
  }
  return 25.4;
}

LengthUnit parse_length_unit(const std::string& text) {
  if (text == "mm") return LengthUnit::millimetre;
  if (text == "cm") return LengthUnit::centimetre;
  if (text == "m") return LengthUnit::metre;
  if (text == "in") return LengthUnit::inch;
  throw Error(ErrorCode::usage, concat("'", text, "' is not a unit of length. Use mm, cm, m or in."));
}

MeshFile read_mesh(const fs::path& path, const ReadOptions& options) {
  const std::string bytes = detail::load(path, options);
  return detail::read_mesh_bytes({bytes, path.string()}, options);
}

bool can_write(const fs::path& path) {
  const Format* format = format_of_ending(ending_of(path));
  return format != nullptr && format->encode != nullptr;
}

bool can_write_infill(const fs::path& path) { return ending_of(path) == ".3mf"; }

namespace {

/// @throws Error for what write_mesh does not write
const Format& format_for(const fs::path& path, const Mesh& mesh) {
  const std::string ending = ending_of(path);
  if (!can_write(path))
    throw Error(ErrorCode::usage, concat("Cannot write '", path.string(), "': the ending '", ending,
                                         "' is not a kind of mesh that rayrep writes. Use ",
                                         endings([](const Format& format) { return format.encode != nullptr; }), "."));
  const auto refuse = [&](const char* what) {
    throw Error(ErrorCode::write, concat("Cannot write '", path.string(), "': ", what));
  };
  if (mesh.triangles.empty()) refuse("the mesh has no triangles.");
  for (const auto& vertex : as_stored(path, mesh).vertices)
    if (!vertex.allFinite()) refuse("a coordinate is infinite, not a number, or too large for this kind of file.");
  return *format_of_ending(ending);
}

}  // namespace

std::string detail::encode_mesh(const fs::path& path, const Mesh& mesh) { return format_for(path, mesh).encode(mesh); }

std::string detail::encode_delivery(const fs::path& path, const Delivery& delivery, ThreeMfFlavor flavor) {
  const Mesh solid = delivery.solid();
  const Format& format = format_for(path, solid);
  if (in_pieces(delivery)) {
    if (can_write_infill(path)) return encode_3mf(delivery, flavor);
    throw Error(ErrorCode::usage, concat("Cannot write '", path.string(), "': pieces are told apart in 3MF only. End it in .3mf."));
  }
  const bool plugged = !delivery.mesh_of(Part::Role::plug).triangles.empty();
  const bool says_more = delivery.has_infill() || !delivery.pauses_mm.empty() || plugged;
  if (!says_more && can_write_infill(path)) return encode_3mf(solid, delivery.thumbnail_png);
  if (!says_more || (!delivery.has_infill() && !can_write_infill(path))) return format.encode(solid);
  if (!can_write_infill(path))
    throw Error(ErrorCode::usage,
                concat("Cannot write '", path.string(),
                       "': where to print sparsely is told by a modifier, which only 3MF holds. End it in .3mf."));
  return encode_3mf(delivery, flavor);
}

void write_delivery(const fs::path& path, const Delivery& delivery, ThreeMfFlavor flavor) {
  write_text_file(path, detail::encode_delivery(path, delivery, flavor));
}

void write_mesh(const fs::path& path, const Mesh& mesh) { write_text_file(path, detail::encode_mesh(path, mesh)); }

Mesh as_stored(const fs::path& path, const Mesh& mesh) {
  const Format* format = format_of_ending(ending_of(path));
  return format != nullptr && format->is_float32 ? as_float32(mesh) : mesh;
}

}  // namespace rayrep
