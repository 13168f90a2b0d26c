#include "rayrep/io/mesh_io.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>

#include "io/mesh_io_detail.h"
#include "rayrep/base/error.h"

// The readers are our own because those of assimp 5.2.5 are measured to fall short on ../shared/meshes (33 files that are not
// 3MF): its counts agree, but its vertices are float32, which moves volumes of text files by up to 1e-7 and would break the
// promise that OBJ and PLY restore every double. Two million triangles take it 1.08 s from OBJ (ours 0.22 s), 0.38 s from
// PLY (0.20 s), 0.14 s from STL (0.12 s). It also refuses trailing bytes and upper case ASCII STL.

namespace rayrep {
namespace {

namespace fs = std::filesystem;
using detail::fail_read;
using detail::FileBytes;

constexpr std::uintmax_t kMaxFileBytes = std::uintmax_t{4} << 30;  // 80 million triangles of STL; keeps indices within int

std::string reason(int error) { return std::generic_category().message(error); }

std::string ending_of(const fs::path& path) { return detail::lower_case(path.extension().string()); }

/// A file descriptor that closes itself.
class Descriptor {
public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() { close(); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return fd_; }
  /// 0, or errno of the failed close, which is where some file systems first report a full disk.
  int close() {
    const int fd = std::exchange(fd_, -1);
    return fd >= 0 && ::close(fd) != 0 ? errno : 0;
  }

private:
  int fd_;
};

std::string load(const fs::path& path) {
  const FileBytes nothing{{}, path.string()};
  // Not blocking, so that a named pipe is refused below rather than waited for.
  const Descriptor fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  struct stat info {};
  if (fd.get() < 0 || ::fstat(fd.get(), &info) != 0)
    fail_read(nothing, "", concat(reason(errno), ". Check the name and the folder."));
  if (S_ISDIR(info.st_mode)) fail_read(nothing, "", "it is a folder. Name a mesh file in it.");
  if (!S_ISREG(info.st_mode)) fail_read(nothing, "", "it is not a regular file. Save the mesh to a file first.");
  if (info.st_size == 0) fail_read(nothing, "", "the file is empty. Export or download it again.");
  if (static_cast<std::uintmax_t>(info.st_size) > kMaxFileBytes)
    fail_read(nothing, "",
              concat("the file has ", info.st_size, " bytes; at most ", kMaxFileBytes,
                     " are supported. Reduce the number of triangles."));
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

bool begins_with_word(std::string_view bytes, std::string_view word) {
  return bytes.starts_with(word) &&
         (bytes.size() == word.size() || std::string_view(" \t\r\n").find(bytes[word.size()]) != std::string_view::npos);
}

/// The ending that a magic number at the start of the content stands for, or "" without one.
std::string ending_by_content(std::string_view bytes) {
  if (bytes.starts_with("PK\x03\x04")) return ".3mf";
  if (begins_with_word(bytes, "ply")) return ".ply";
  for (const char* off : {"OFF", "COFF", "NOFF", "CNOFF", "STOFF", "STCOFF", "STNOFF", "STCNOFF", "4OFF", "nOFF"})
    if (begins_with_word(bytes, off)) return ".off";
  return "";
}

/// Writes all bytes and brings them to the disk. 0, or errno.
int write_all(int fd, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(fd, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  // Devices and some file systems cannot synchronise, which is no failure to write.
  return ::fsync(fd) == 0 || errno == EINVAL || errno == ENOTSUP || errno == EROFS ? 0 : errno;
}

[[noreturn]] void fail_write(const fs::path& path, int error) {
  throw Error(ErrorCode::write, concat("Cannot write '", path.string(), "': ", reason(error), ". ",
                                       error == ENOENT || error == ENOTDIR  ? "Create its folder first."
                                       : error == ENOSPC || error == EDQUOT ? "Free some space, or write to another disk."
                                       : error == EISDIR                    ? "Name a file in it."
                                                                            : "Choose another name or folder."));
}

/// Creates a file of a name not yet taken next to `path`. The descriptor, or -1 with errno.
int create_beside(const fs::path& path, fs::path& created) {
  // Short, so that it fits wherever the name itself fits.
  for (int attempt = 0; attempt < 1000; ++attempt) {
    created = path.parent_path() / concat(".rayrep-", ::getpid(), "-", attempt, ".tmp");
    const int fd = ::open(created.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (fd >= 0 || errno != EEXIST) return fd;
  }
  return -1;
}

void write_bytes(const fs::path& requested, std::string_view bytes) {
  // A symbolic link stays one: what it points to is replaced.
  std::error_code ignored;
  const fs::path resolved = fs::is_symlink(requested, ignored) ? fs::canonical(requested, ignored) : requested;
  const fs::path& path = resolved.empty() ? requested : resolved;
  struct stat info {};
  const bool exists = ::stat(path.c_str(), &info) == 0;
  if (exists && S_ISDIR(info.st_mode)) fail_write(path, EISDIR);
  if (exists && !S_ISREG(info.st_mode)) {  // a device or pipe is written to, not replaced
    Descriptor device(::open(path.c_str(), O_WRONLY | O_CLOEXEC));
    int error = device.get() < 0 ? errno : write_all(device.get(), bytes);
    if (const int close_error = device.close(); error == 0) error = close_error;
    if (error != 0) fail_write(path, error);
    return;
  }
  if (exists && ::access(path.c_str(), W_OK) != 0) fail_write(path, errno);  // replacing it would be possible, but not meant
  fs::path temporary;
  Descriptor fd(create_beside(path, temporary));
  if (fd.get() < 0) fail_write(path, errno);
  int error = write_all(fd.get(), bytes);
  if (error == 0 && exists && ::fchmod(fd.get(), info.st_mode & 07777) != 0) error = errno;
  if (const int close_error = fd.close(); error == 0) error = close_error;
  if (error == 0 && ::rename(temporary.c_str(), path.c_str()) != 0) error = errno;
  if (error != 0) {
    ::unlink(temporary.c_str());
    fail_write(path, error);
  }
  // The rename itself is safe once the folder is on the disk; a file system that cannot do that has done its best.
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  if (const Descriptor parent(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)); parent.get() >= 0) ::fsync(parent.get());
}

}  // namespace

MeshFile detail::read_mesh_bytes(const FileBytes& file, const ReadOptions& options) {
  if (file.bytes.empty()) fail_read(file, "", "the file is empty. Export or download it again.");
  if (file.bytes.starts_with("version https://git-lfs"))
    fail_read(file, "", "it is a Git LFS pointer, not the mesh itself. Run 'git lfs pull' first.");
  const std::string by_name = ending_of(file.name);
  std::string by_content = by_name == ".stl" && has_exact_binary_stl_size(file.bytes) ? by_name : ending_by_content(file.bytes);
  if (by_content.empty() && (by_name == ".3mf" || by_name == ".ply")) by_content = by_name;  // let its reader say what is wrong
  const std::string kind = by_content.empty() ? by_name : by_content;
  FileBytes text = file;
  if (text.bytes.starts_with("\xEF\xBB\xBF")) text.bytes.remove_prefix(3);
  MeshFile result;
  if (kind == ".stl") {
    result = read_stl(text);
  } else if (kind == ".obj") {
    result = read_obj(text);
  } else if (kind == ".off") {
    result = read_off(text);
  } else if (kind == ".ply") {
    result = read_ply(file);
  } else if (kind == ".3mf") {
    result = read_3mf(file);
  } else {
    fail_read(file, "",
              concat("'", by_name, "' is not a kind of mesh that rayrep reads. Save it as .stl, .obj, .ply, .off or .3mf."));
  }
  if (result.mesh.triangles.empty())
    fail_read(file, "", concat("it is ", result.format, " but holds no triangles. Check what was exported."));
  if (kind != by_name)
    result.notes.push_back(concat("Read as ", result.format, ", as its content says, in spite of the ending '", by_name, "'."));
  if (kind != ".3mf") result.mm_per_unit = millimetres(options.unit);
  if (result.mm_per_unit != 1)
    for (auto& vertex : result.mesh.vertices) vertex *= result.mm_per_unit;
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
  const std::string bytes = load(path);
  return detail::read_mesh_bytes({bytes, path.string()}, options);
}

bool can_write(const fs::path& path) {
  const std::string ending = ending_of(path);
  return ending == ".stl" || ending == ".obj" || ending == ".ply" || ending == ".3mf";
}

void write_mesh(const fs::path& path, const Mesh& mesh) {
  const std::string ending = ending_of(path);
  if (!can_write(path))
    throw Error(ErrorCode::usage, concat("Cannot write '", path.string(), "': the ending '", ending,
                                         "' is not a kind of mesh that rayrep writes. Use .stl, .obj, .ply or .3mf."));
  const auto refuse = [&](const char* what) {
    throw Error(ErrorCode::write, concat("Cannot write '", path.string(), "': ", what));
  };
  if (mesh.triangles.empty()) refuse("the mesh has no triangles.");
  for (const auto& vertex : as_stored(path, mesh).vertices)
    if (!vertex.allFinite()) refuse("a coordinate is infinite, not a number, or too large for this kind of file.");
  write_bytes(path, ending == ".stl"   ? detail::encode_stl(mesh)
                    : ending == ".obj" ? detail::encode_obj(mesh)
                    : ending == ".ply" ? detail::encode_ply(mesh)
                                       : detail::encode_3mf(mesh));
}

Mesh as_stored(const fs::path& path, const Mesh& mesh) {
  Mesh result = mesh;
  if (ending_of(path) == ".stl")
    // By component: Eigen 3.4 leaves entries of a vector unrounded in cast<float>().cast<double>() from -O2 on.
    for (auto& vertex : result.vertices)
      for (double& coordinate : vertex) coordinate = static_cast<float>(coordinate);
  return result;
}

void write_text_file(const fs::path& path, const std::string& text) { write_bytes(path, text); }

}  // namespace rayrep
