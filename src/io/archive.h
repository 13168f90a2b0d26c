#pragma once

#include <memory>
#include <string>
#include <vector>

#include "io/mesh_io_detail.h"

struct zip;

namespace rayrep::detail {

/// A zip archive of named parts, as 3MF and SL1 files are.
class Archive {
public:
  /// Keeps a reference to the file. @param kind  of file, for messages
  /// @throws Error{input} if it is not a zip archive, or a damaged one
  explicit Archive(const FileBytes& file, std::string kind = "3MF");

  bool has(const std::string& part) const { return locate(part) >= 0; }
  /// The names of all parts, in the order of the archive.
  std::vector<std::string> names() const;

  /// The unpacked bytes of a part. @throws Error{input} if it is missing, damaged, encrypted or far too large.
  /// @param most  bytes: of a longer part a little more than that is given, for the caller to refuse
  std::string read(const std::string& part, std::size_t most) const;

  const FileBytes& file() const { return file_; }

private:
  long long locate(const std::string& part) const;
  [[noreturn]] void fail_damaged(const std::string& part, const char* reason) const;

  const FileBytes& file_;
  std::string kind_;
  std::unique_ptr<zip, void (*)(zip*)> archive_;
};

struct ArchivePart {
  const char* name;
  std::string text;
};

/// The bytes of a zip archive, the same at any time. @throws Error{write}
std::string pack(const std::vector<ArchivePart>& parts);

}  // namespace rayrep::detail
