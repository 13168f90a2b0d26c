#include <algorithm>
#include <limits>

#include "io/mesh_io_detail.h"

namespace rayrep::detail {
namespace {

/// Words of one OBJ line, which goes on in the next one where it ends in a backslash.
class ObjLine {
public:
  explicit ObjLine(TextScanner& scan) : scan_(scan) {}

  std::string_view next() {
    std::string_view text = scan_.word_in_line();
    while (text.ends_with('\\')) {
      const bool ends_line = scan_.word_in_line().empty();
      if (!ends_line) scan_.fail("a backslash stands within a line of numbers. Export the mesh again.");
      scan_.skip_line();
      text.remove_suffix(1);
      if (!text.empty()) return text;
      text = scan_.word_in_line();
    }
    return text;
  }

private:
  TextScanner& scan_;
};

constexpr std::array<std::string_view, 22> kIgnored = {
    "vt",  "vn",    "vp",       "g",        "o",          "s",         "usemtl", "mtllib", "usemap", "maplib", "mg",
    "lod", "bevel", "c_interp", "d_interp", "shadow_obj", "trace_obj", "l",      "p",      "deg",    "cstype", "parm"};

}  // namespace

MeshFile read_obj(const FileBytes& file, const ReadOptions&) {
  PolygonSoup soup;
  TextScanner scan(file, 0);
  // A face may name vertices that only follow later; the highest such number is checked at the end.
  long long highest = 0;
  std::size_t highest_offset = 0;
  std::size_t unknown_lines = 0;
  std::size_t first_unknown = 0;
  std::size_t free_form = 0;
  for (; !scan.at_end(); scan.skip_line()) {
    ObjLine line(scan);
    const std::string_view keyword = line.next();
    if (keyword.empty() || keyword[0] == '#') continue;
    if (keyword == "v") {
      Eigen::Vector3d vertex;
      for (int k = 0; k < 3; ++k) vertex[k] = scan.to_number(line.next(), "a coordinate");
      soup.vertices.push_back(vertex);  // weights and colours may follow on the line
    } else if (keyword == "f" || keyword == "fo") {
      const auto count = static_cast<long long>(soup.vertices.size());
      for (std::string_view text = line.next(); !text.empty() && text[0] != '#'; text = line.next()) {
        long long number = 0;  // of "v", "v/vt", "v//vn" or "v/vt/vn" only v matters
        if (!parse_integer(text.substr(0, text.find('/')), number) || number == 0)
          scan.fail(concat("'", text.substr(0, 40), "' is not a corner of a face (vertices count from 1). Export the mesh again."));
        if (number < -count || number > std::numeric_limits<int>::max())
          scan.fail(concat("a face uses vertex ", number, ", but ", count, " vertices precede it. Export the mesh again."));
        if (number < 0) number += count + 1;
        if (number > std::max(count, highest)) {
          highest = number;
          highest_offset = scan.word_offset();
        }
        soup.corners.push_back(static_cast<int>(number - 1));
      }
      soup.end_polygon();
    } else if (keyword == "curv" || keyword == "curv2" || keyword == "surf") {
      ++free_form;
    } else if (std::find(kIgnored.begin(), kIgnored.end(), keyword) == kIgnored.end() && unknown_lines++ == 0) {
      first_unknown = scan.line();
    }
  }
  if (highest > static_cast<long long>(soup.vertices.size()))
    fail_read(file, concat("line ", line_of(file.bytes, highest_offset)),
              concat("a face uses vertex ", highest, ", but the file has ", soup.vertices.size(),
                     ". It is damaged or cut off; export it again."));
  MeshFile result = triangulated(file, std::move(soup), "OBJ");
  if (free_form > 0)
    result.notes.push_back(plural(free_form, "free-form curve or surface was", "free-form curves or surfaces were") +
                           " ignored: only polygons are read.");
  if (unknown_lines > 0)
    result.notes.push_back(concat(plural(unknown_lines, "line was", "lines were"),
                                  " not understood and ignored, the first is line ", first_unknown, "."));
  return result;
}

std::string encode_obj(const Mesh& mesh) {
  std::string text = "# rayrep, millimetres\n";
  for (const auto& vertex : mesh.vertices) {
    text += 'v';
    for (int k = 0; k < 3; ++k) append_number(text += ' ', vertex[k]);
    text += '\n';
  }
  for (const auto& triangle : mesh.triangles) {
    text += 'f';
    for (int k = 0; k < 3; ++k) append_number(text += ' ', triangle[k] + 1LL);
    text += '\n';
  }
  return text;
}

}  // namespace rayrep::detail
