#include "rayrep/io/write_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <optional>
#include <string_view>
#include <system_error>
#include <vector>

#include "io/descriptor.h"
#include "io/mesh_io_detail.h"
#include "rayrep/base/error.h"

namespace rayrep {
namespace {

namespace fs = std::filesystem;
using detail::Descriptor;

[[noreturn]] void fail_write(const fs::path& path, std::string_view what, std::string_view cure) {
  throw Error(ErrorCode::write, concat("Cannot write '", path.string(), "': ", what, ". ", cure));
}

[[noreturn]] void fail_write(const fs::path& path, int error) {
  fail_write(path, detail::reason(error),
             error == ENOENT || error == ENOTDIR  ? "Create its folder first."
             : error == ENOSPC || error == EDQUOT ? "Free some space, or write to another disk."
             : error == EISDIR                    ? "Name a file in it."
             : error == ENAMETOOLONG              ? "Choose a shorter name."
                                                  : "Choose another name or folder.");
}

fs::path folder_of(const fs::path& path) { return path.has_parent_path() ? path.parent_path() : fs::path("."); }

/// What a path stands for after its symbolic links, which may point to nothing yet.
fs::path without_links(const fs::path& requested) {
  constexpr int kMaxLinks = 40;  // as Linux
  fs::path path = requested;
  for (int links = 0; fs::is_symlink(fs::symlink_status(path)); ++links) {
    if (links == kMaxLinks) fail_write(requested, ELOOP);
    path = path.parent_path() / fs::read_symlink(path);  // an absolute one replaces the folder
  }
  return path;
}

fs::path resolve(const fs::path& requested) {
  try {
    return without_links(requested);
  } catch (const fs::filesystem_error& error) {
    fail_write(requested, error.code().value());
  }
}

/// The descriptor that /dev/stdout and its like name, or none.
std::optional<int> descriptor_named(const fs::path& path) {
  const std::string name = path.lexically_normal().string();
  if (name == "/dev/stdout") return STDOUT_FILENO;
  if (name == "/dev/stderr") return STDERR_FILENO;
  for (const std::string_view folder : {"/dev/fd/", "/proc/self/fd/"})
    if (long long fd = 0; name.starts_with(folder) && parse_integer(name.substr(folder.size()), fd) && fd >= 0 && fd < 1 << 20)
      return static_cast<int>(fd);
  return std::nullopt;
}

/// The process that a hidden file is of, by its name ".rayrep-PROCESS-NUMBER.ending"; none: it is no such file.
std::optional<long long> process_of(std::string_view name) {
  constexpr std::string_view kBegin = ".rayrep-";
  if (!name.starts_with(kBegin)) return std::nullopt;
  name.remove_prefix(kBegin.size());
  name = name.substr(0, name.find('.'));
  const std::size_t dash = name.find('-');
  long long process = 0;
  long long number = 0;
  const bool fits = dash != std::string_view::npos && parse_integer(name.substr(0, dash), process) &&
                    parse_integer(name.substr(dash + 1), number) && process > 0 && number >= 0;
  return fits ? std::optional(process) : std::nullopt;
}

/// Removes hidden files beside `target` that pass.
template <typename Passes>
void remove_hidden(const fs::path& target, const Passes& passes) {
  try {
    std::error_code ignored;
    std::vector<fs::path> found;
    for (fs::directory_iterator entry(folder_of(without_links(target)), ignored), end; !ignored && entry != end;
         entry.increment(ignored)) {
      const auto process = process_of(entry->path().filename().string());
      struct stat info {};
      if (process && ::lstat(entry->path().c_str(), &info) == 0 && S_ISREG(info.st_mode) && passes(*process, info))
        found.push_back(entry->path());
    }
    for (const fs::path& path : found) ::unlink(path.c_str());
  } catch (const std::exception&) {
    // They are in nobody's way.
  }
}

/// What stands at `path`, or nothing. @throws Error{write} if it cannot be replaced
std::optional<struct stat> replaceable(const fs::path& named, const fs::path& path) {
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0) {
    if (errno != ENOENT) fail_write(named, errno);
    return std::nullopt;
  }
  if (S_ISDIR(info.st_mode)) fail_write(named, EISDIR);
  // Replacing a read-only file would be possible, but is not meant.
  if (S_ISREG(info.st_mode) && ::access(path.c_str(), W_OK) != 0) fail_write(named, errno);
  return info;
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

/// Writes to a new file beside `resolved`, readable to nobody who could not read the file it is to replace, and returns its name.
/// @throws Error{write} that speaks of `named`
fs::path write_beside(const fs::path& named, const fs::path& resolved, std::string_view bytes) {
  const auto old = replaceable(named, resolved);
  const std::string ending = named.extension().string();
  fs::path created;
  int descriptor = -1;
  for (int attempt = 0; attempt < 1000; ++attempt) {
    // Short, so that it fits wherever the name itself fits.
    created = resolved.parent_path() / concat(".rayrep-", ::getpid(), "-", attempt, ending.size() <= 16 ? ending : "");
    descriptor = ::open(created.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, old ? 0600 : 0666);
    if (descriptor >= 0 || errno != EEXIST) break;
  }
  Descriptor fd(descriptor);
  if (fd.get() < 0) fail_write(named, errno);
  int error = write_all(fd.get(), bytes);
  if (error == 0 && old && ::fchmod(fd.get(), old->st_mode & 07777) != 0) error = errno;
  if (const int close_error = fd.close(); error == 0) error = close_error;
  if (error == 0) return created;
  ::unlink(created.c_str());
  fail_write(named, error);
}

void put_in_place(const fs::path& named, const fs::path& written, const fs::path& resolved) {
  if (::rename(written.c_str(), resolved.c_str()) != 0) {
    const int error = errno;
    ::unlink(written.c_str());
    fail_write(named, error);
  }
  // The rename itself is safe once the folder is on the disk; a file system that cannot do that has done its best.
  if (const Descriptor parent(::open(folder_of(resolved).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)); parent.get() >= 0)
    ::fsync(parent.get());
}

}  // namespace

void require_writable(const fs::path& path) {
  if (is_stream(path))
    fail_write(path, "it is a device or a pipe, not a file", "A mesh is read back from where it was written: name a file.");
  if (path.filename().empty()) fail_write(path, EISDIR);
  const fs::path resolved = resolve(path);
  const fs::path folder = folder_of(resolved);
  if (::access(folder.c_str(), F_OK) != 0) fail_write(path, errno);
  struct stat info {};
  if (::stat(folder.c_str(), &info) != 0) fail_write(path, errno);
  if (!S_ISDIR(info.st_mode)) fail_write(path, ENOTDIR);
  replaceable(path, resolved);  // also finds a name that is too long
  if (::access(folder.c_str(), W_OK | X_OK) != 0) fail_write(path, errno);
}

bool is_stream(const fs::path& path) {
  struct stat info {};
  return descriptor_named(path) || (::stat(path.c_str(), &info) == 0 && !S_ISREG(info.st_mode) && !S_ISDIR(info.st_mode));
}

void remove_unfinished(const fs::path& target) {
  remove_hidden(target, [own = ::getpid()](long long process, const struct stat&) { return process == own; });
}

void remove_abandoned(const fs::path& target, std::int64_t before) {
  remove_hidden(target, [before](long long process, const struct stat& info) {
    return info.st_uid == ::geteuid() && info.st_mtime < before && ::kill(static_cast<pid_t>(process), 0) != 0 && errno == ESRCH;
  });
}

void write_text_file(const fs::path& path, const std::string& text) {
  if (is_stream(path)) {
    const auto named = descriptor_named(path);
    Descriptor stream(named ? ::dup(*named) : ::open(path.c_str(), O_WRONLY | O_CLOEXEC));
    int error = stream.get() < 0 ? errno : write_all(stream.get(), text);
    if (const int close_error = stream.close(); error == 0) error = close_error;
    if (error != 0) fail_write(path, error);
    return;
  }
  const fs::path resolved = resolve(path);
  put_in_place(path, write_beside(path, resolved, text), resolved);
}

PendingFile::PendingFile(const fs::path& target) : target_(target) {
  require_writable(target);
  resolved_ = resolve(target);
}

PendingFile::~PendingFile() {
  if (!path_.empty()) ::unlink(path_.c_str());
}

void PendingFile::write(const Delivery& delivery, ThreeMfFlavor flavor) {
  const std::string bytes = detail::encode_delivery(target_, delivery, flavor);
  if (!path_.empty()) ::unlink(path_.c_str());
  path_.clear();
  path_ = write_beside(target_, resolved_, bytes);
}

void PendingFile::commit() {
  put_in_place(target_, path_, resolved_);
  path_.clear();
}

TemporaryFolder::TemporaryFolder() {
  std::error_code error;
  std::string name = (fs::temp_directory_path(error) / "rayrep-XXXXXX").string();
  if (error || ::mkdtemp(name.data()) == nullptr)
    throw Error(ErrorCode::write,
                concat("Cannot make a temporary folder '", name, "': ", error ? error.message() : detail::reason(errno), "."));
  path_ = name;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

}  // namespace rayrep
