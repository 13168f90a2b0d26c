#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "rayrep/mesh/delivery.h"

namespace rayrep {

/// Finds out before the work whether a regular file can be written at `path`: its folder exists and may be written to, the name is
/// not too long for it, and what already stands there is a regular file that may be written to. A symbolic link is followed, also
/// one to a file that does not exist yet. Creates nothing. Room on the disk is not checked.
/// @throws Error{write} with the system's reason and what to do
void require_writable(const std::filesystem::path& path);

/// Writes text to a temporary file in the same folder, then renames: an existing file survives any failure. A symbolic link stays
/// one, what it points to is replaced; permissions stay those of an existing file, also of a read-only one, which is refused.
/// What is_stream is written to, not replaced. @throws Error{write}
void write_text_file(const std::filesystem::path& path, const std::string& text);

/// Whether what is written to `path` is not to be replaced: a device, a pipe, or a file that this process has open, by the names
/// /dev/stdout, /dev/stderr, /dev/fd/N and /proc/self/fd/N.
bool is_stream(const std::filesystem::path& path);

/// Removes the hidden files that PendingFile and write_text_file of this process have not finished in the folder of `target`: for
/// one that ends at once. Errors are none.
void remove_unfinished(const std::filesystem::path& target);

/// Removes those of other processes that were killed: of the same user, last changed before `before` (seconds since 1970), and
/// without a process of their number. Errors are none.
void remove_abandoned(const std::filesystem::path& target, std::int64_t before);

/// A folder of its own below the system's temporary one, removed with all that is in it.
class TemporaryFolder {
public:
  TemporaryFolder();  ///< @throws Error{write}
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

private:
  std::filesystem::path path_;
};

/// Whose way of telling modifiers a 3MF file speaks: no single file serves all. core: nobody's, body and sparse regions are meshes
/// of their own whose names say what they are.
enum class ThreeMfFlavor { prusa, bambu, core };
inline constexpr const char* kThreeMfFlavorNames[] = {"prusa", "bambu", "core"};

/// A mesh file that is written beside its place, to be judged as it stands on the disk, and gets its name only with commit().
/// Without it nothing is left behind. Links and permissions as for write_text_file; devices and pipes are refused.
class PendingFile {
public:
  /// @throws Error{write} as require_writable does
  explicit PendingFile(const std::filesystem::path& target);
  ~PendingFile();
  PendingFile(const PendingFile&) = delete;
  PendingFile& operator=(const PendingFile&) = delete;

  /// Where the mesh stands until commit(): in the target's folder, hidden, with the target's ending.
  const std::filesystem::path& path() const { return path_; }

  /// As write_delivery, to path(). @throws Error that speaks of the target
  void write(const Delivery& delivery, ThreeMfFlavor flavor = ThreeMfFlavor::prusa);

  /// Puts what was written in place. @throws Error{write}
  void commit();

private:
  std::filesystem::path target_;    ///< as the user named it
  std::filesystem::path resolved_;  ///< without symbolic links at its end
  std::filesystem::path path_;
};

}  // namespace rayrep
