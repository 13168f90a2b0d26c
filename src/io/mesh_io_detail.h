#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/text.h"
#include "rayrep/io/mesh_io.h"

/// What the format readers and writers of mesh_io share. Private to src/mesh_io*.cpp, its test and its fuzzer.
namespace rayrep::detail {

/// A file in memory, and the name to call it by in messages (its ending also decides the kind).
struct FileBytes {
  std::string_view bytes;
  std::string name;
};

/// Throws Error{input}: "Cannot read <name>, <where>: <what>"; `where` may be empty.
[[noreturn]] void fail_read(const FileBytes& file, const std::string& where, const std::string& what);

/// All bytes of a file. @throws Error{input} if it cannot be read, is empty, or larger than the memory allowed
std::string load(const std::filesystem::path& path, const ReadOptions& options);

/// Reads any supported kind from memory, exactly as read_mesh does after it has loaded the file.
MeshFile read_mesh_bytes(const FileBytes& file, const ReadOptions& options);

/// The bytes that write_mesh writes. @throws Error as write_mesh does, but for the file itself.
std::string encode_mesh(const std::filesystem::path& path, const Mesh& mesh);
/// The bytes that write_delivery writes.
std::string encode_delivery(const std::filesystem::path& path, const Delivery& delivery, ThreeMfFlavor flavor);

/// True if the bytes begin with `word` and it ends there.
bool begins_with_word(std::string_view bytes, std::string_view word);

/// The line, counted from 1, that holds the byte at `offset`. Takes time in `offset`.
std::size_t line_of(std::string_view bytes, std::size_t offset);

/// ASCII lower case, for keywords and file endings.
std::string lower_case(std::string_view text);

/// Takes a text file apart into words separated by blanks. Lines end in LF, CRLF or CR.
class TextScanner {
public:
  TextScanner(const FileBytes& file, std::size_t offset);

  /// The next word, on whatever line; empty at the end of the file.
  std::string_view word();
  /// The next word of the current line; empty at its end.
  std::string_view word_in_line();
  /// Moves to the start of the next line.
  void skip_line();
  bool at_end() const { return position_ >= file_.bytes.size(); }
  std::size_t offset() const { return position_; }
  std::size_t remaining() const { return file_.bytes.size() - position_; }

  /// The word returned last as a number. @throws Error{input} saying that `what` was expected.
  double to_number(std::string_view word, std::string_view what) const;
  /// Where the word returned last starts, in bytes.
  std::size_t word_offset() const { return word_start_; }
  /// The line, counted from 1, of the word returned last. Takes time in the size of the file.
  std::size_t line() const;
  /// fail_read at line().
  [[noreturn]] void fail(const std::string& what) const;

private:
  const FileBytes& file_;
  std::size_t position_;
  std::size_t word_start_;
};

/// Polygons over shared vertices, as OBJ, PLY and OFF store them.
struct PolygonSoup {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<int> corners;       ///< vertex indices of all polygons, one after the other
  std::vector<std::size_t> ends;  ///< one past the last corner of each polygon
  std::size_t dropped = 0;        ///< faces of fewer than three corners, which bound nothing

  /// Closes the polygon made of the corners pushed since the last call, or drops it if it has fewer than three.
  void end_polygon();
};

/// The soup as triangles, with `polygons` and a note about dropped faces filled in.
MeshFile triangulated(const FileBytes& file, PolygonSoup&& soup, std::string format);

}  // namespace rayrep::detail
