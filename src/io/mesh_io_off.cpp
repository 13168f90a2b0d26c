#include <limits>

#include "io/mesh_io_detail.h"

namespace rayrep::detail {
namespace {

/// The next word that is not part of a comment, on whatever line; empty at the end of the file.
std::string_view word_after_comments(TextScanner& scan) {
  while (true) {
    const std::string_view text = scan.word();
    if (text.empty() || text[0] != '#') return text;
    scan.skip_line();
  }
}

/// A count, an index or a number of corners: an integer from 0 to `limit` - 1.
std::size_t to_index(const TextScanner& scan, std::string_view word, std::size_t limit, std::string_view what) {
  long long value = 0;
  if (word.empty()) scan.to_number(word, what);  // throws
  if (!parse_integer(word, value)) scan.fail(concat("'", word.substr(0, 40), "' is not ", what, ". Export the mesh again."));
  if (value < 0 || static_cast<unsigned long long>(value) >= limit)
    scan.fail(concat(value, " is out of range for ", what, ", which may be 0 to ", static_cast<long long>(limit) - 1,
                     " here. The file is damaged or cut off; export it again."));
  return static_cast<std::size_t>(value);
}

}  // namespace

bool is_off(std::string_view bytes) {
  for (const char* word : {"OFF", "COFF", "NOFF", "CNOFF", "STOFF", "STCOFF", "STNOFF", "STCNOFF", "4OFF", "nOFF"})
    if (begins_with_word(bytes, word)) return true;
  return false;
}

MeshFile read_off(const FileBytes& file, const ReadOptions&) {
  TextScanner scan(file, 0);
  std::string_view word = word_after_comments(scan);
  if (word.ends_with("OFF")) {  // which is optional, as are the letters before it
    const std::string_view prefix = word.substr(0, word.size() - 3);
    if (prefix.find_first_of("4n") != std::string_view::npos)
      scan.fail(
          concat("'", word.substr(0, 40), "' announces points of another dimension than three. Export the mesh as plain OFF."));
    word = word_after_comments(scan);
  }
  if (word == "BINARY")
    scan.fail("this is a binary OFF file, which rayrep does not read. Export the mesh as text, or as STL, OBJ, PLY or 3MF.");
  // No vertex or face takes fewer than two bytes, so no honest count exceeds the bytes that follow.
  const std::size_t vertex_count = to_index(scan, word, scan.remaining() + 1, "the number of vertices");
  const std::size_t face_count = to_index(scan, word_after_comments(scan), scan.remaining() + 1, "the number of faces");
  scan.skip_line();  // the number of edges is not used

  PolygonSoup soup;
  soup.vertices.reserve(vertex_count);
  for (std::size_t i = 0; i < vertex_count; ++i, scan.skip_line()) {
    Eigen::Vector3d vertex;
    vertex[0] = scan.to_number(word_after_comments(scan), "a coordinate");
    for (int k = 1; k < 3; ++k) vertex[k] = scan.to_number(scan.word_in_line(), "a coordinate");
    soup.vertices.push_back(vertex);  // normals and colours may follow on the line
  }
  for (std::size_t i = 0; i < face_count; ++i, scan.skip_line()) {
    const std::size_t corners = to_index(scan, word_after_comments(scan), scan.remaining() + 1, "the number of corners of a face");
    for (std::size_t k = 0; k < corners; ++k)
      soup.corners.push_back(static_cast<int>(to_index(scan, scan.word_in_line(), vertex_count, "a vertex index")));
    soup.end_polygon();  // a colour may follow on the line
  }
  MeshFile result = triangulated(file, std::move(soup), "OFF");
  if (!word_after_comments(scan).empty())
    result.notes.push_back(
        concat("Ignored everything from line ", scan.line(), " on: it follows the last of the ", face_count, " faces."));
  return result;
}

}  // namespace rayrep::detail
