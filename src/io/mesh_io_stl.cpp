#include <bit>
#include <cstdint>
#include <cstring>

#include "io/mesh_io_detail.h"
#include "mesh/float32.h"

namespace rayrep::detail {
namespace {

constexpr std::size_t kHeaderBytes = 80;
constexpr std::size_t kPreambleBytes = kHeaderBytes + 4;  // and the triangle count
constexpr std::size_t kTriangleBytes = 50;                // normal, three corners, two bytes of attributes

static_assert(std::endian::native == std::endian::little, "STL and PLY bytes are copied as they are");

std::uint32_t announced_triangles(std::string_view bytes) {
  std::uint32_t count = 0;
  std::memcpy(&count, bytes.data() + kHeaderBytes, sizeof count);
  return count;
}

/// "solid" begins every ASCII file, but also the header of some binary ones: those have zero bytes early on, in the
/// triangle count, the coordinates or the attributes.
bool is_ascii(std::string_view bytes) {
  const std::string_view start = bytes.substr(0, 4096);
  const std::size_t first = start.find_first_not_of(" \t\r\n");
  return first != std::string_view::npos && lower_case(start.substr(first, 5)) == "solid" &&
         start.find('\0') == std::string_view::npos;
}

void append_corner_triangle(Mesh& mesh) {
  const int n = static_cast<int>(mesh.vertices.size());
  mesh.triangles.emplace_back(n - 3, n - 2, n - 1);
}

MeshFile read_binary(const FileBytes& file) {
  const std::string_view bytes = file.bytes;
  if (bytes.size() < kPreambleBytes)
    fail_read(file, "",
              concat("an STL file is either text that begins with 'solid' or binary with a header of 84 bytes, and this one has ",
                     bytes.size(), " bytes. It is damaged or not an STL file; export or download it again."));
  const std::size_t announced = announced_triangles(bytes);
  const std::size_t body = bytes.size() - kPreambleBytes;
  const std::size_t present = body / kTriangleBytes;
  // A size that is right to the byte is believed rather than the count: some programs never come back to fill it in. If the file is
  // cut off after all, its surface is not closed.
  const bool size_counts = present > 0 && body % kTriangleBytes == 0 && bytes.substr(0, 4096).find('\0') != std::string_view::npos;
  if (announced == 0 && !size_counts)
    fail_read(file, "byte 80", concat("the header announces no triangles, and ", body, " bytes follow it. Export the mesh again."));
  if (announced > present && !size_counts)
    fail_read(file, concat("byte ", kPreambleBytes + present * kTriangleBytes),
              concat("the header announces ", announced, " triangles, but the file ends after ", present,
                     ". It is cut off or not a binary STL file; export or download it again."));
  MeshFile result;
  result.format = "STL binary";
  const std::size_t count = size_counts ? present : announced;
  result.polygons = count;
  Mesh& mesh = result.mesh;
  mesh.vertices.reserve(3 * count);
  mesh.triangles.reserve(count);
  for (std::size_t t = 0; t < count; ++t) {
    std::array<float, 9> corners;
    std::memcpy(corners.data(), bytes.data() + kPreambleBytes + t * kTriangleBytes + 12, sizeof corners);
    for (int k = 0; k < 9; k += 3) mesh.vertices.emplace_back(corners[k], corners[k + 1], corners[k + 2]);
    append_corner_triangle(mesh);
  }
  if (count != announced)
    result.notes.push_back(concat("The header announces ", announced, " triangles, but the file has the size of ", count, ": all ",
                                  count, " were read."));
  if (const std::size_t extra = body - count * kTriangleBytes)
    result.notes.push_back(concat("Ignored ", plural(extra, "byte", "bytes"), " after the last of the ", count, " triangles."));
  return result;
}

MeshFile read_ascii(const FileBytes& file) {
  MeshFile result;
  result.format = "STL ASCII";
  Mesh& mesh = result.mesh;
  TextScanner scan(file, 0);
  const auto keyword = [&] { return lower_case(scan.word()); };
  const auto expect = [&](std::string_view expected) {
    const std::string found = keyword();
    if (found == expected) return;
    if (found.empty())
      scan.fail(concat("the file ends where '", expected, "' was expected. It is cut off; export or download it again."));
    scan.fail(concat("found '", found.substr(0, 40), "' where '", expected, "' was expected. Export the mesh again."));
  };
  bool in_solid = false;
  while (true) {
    const std::string word = keyword();
    if (word.empty()) break;
    if (word == "solid" || word == "endsolid") {
      in_solid = word == "solid";
      scan.skip_line();  // the rest is a name, which may hold any words
    } else if (word == "facet") {
      // The normal is not used and some programs write odd things for it: anything up to "outer".
      for (int words = 0; words <= 4; ++words) {
        const std::string skipped = keyword();
        if (skipped == "outer") break;
        if (skipped.empty() || words == 4) scan.fail("'outer loop' is missing after 'facet normal x y z'. Export the mesh again.");
      }
      expect("loop");
      for (int k = 0; k < 3; ++k) {
        expect("vertex");
        Eigen::Vector3d vertex;
        for (int i = 0; i < 3; ++i) vertex[i] = scan.to_number(scan.word_in_line(), "a coordinate");
        mesh.vertices.push_back(vertex);
      }
      expect("endloop");
      expect("endfacet");
      append_corner_triangle(mesh);
    } else {
      scan.fail(concat("found '", word.substr(0, 40), "' where 'facet' or 'endsolid' was expected. Export the mesh again."));
    }
  }
  if (in_solid) result.notes.push_back("The last solid has no 'endsolid': the file may be cut off.");
  result.polygons = mesh.triangles.size();
  return result;
}

}  // namespace

/// True if the file has exactly the size that the triangle count in its 80 byte + 4 header calls for.
bool has_exact_binary_stl_size(std::string_view bytes) {
  return bytes.size() >= kPreambleBytes && bytes.size() == kPreambleBytes + kTriangleBytes * announced_triangles(bytes);
}

MeshFile read_stl(const FileBytes& file, const ReadOptions&) {
  if (has_exact_binary_stl_size(file.bytes) || !is_ascii(file.bytes)) return read_binary(file);
  return read_ascii(file);
}

std::string encode_stl(const Mesh& mesh) {
  std::string header = "rayrep, binary STL, millimetres";  // must not begin with "solid"
  header.resize(kHeaderBytes, ' ');
  std::string bytes = header;
  bytes.resize(kPreambleBytes + kTriangleBytes * mesh.triangles.size(), '\0');
  const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
  std::memcpy(bytes.data() + kHeaderBytes, &count, sizeof count);
  char* out = bytes.data() + kPreambleBytes;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t, out += kTriangleBytes) {
    const Eigen::Vector3d a = as_float32(mesh.corner(t, 0));
    const Eigen::Vector3d b = as_float32(mesh.corner(t, 1));
    const Eigen::Vector3d c = as_float32(mesh.corner(t, 2));
    const Eigen::Vector3d normal = (b - a).cross(c - a).stableNormalized();  // zero for a triangle without area
    Eigen::Matrix<float, 3, 4> record;
    record << normal.cast<float>(), a.cast<float>(), b.cast<float>(), c.cast<float>();
    std::memcpy(out, record.data(), sizeof(float) * 12);
  }
  return bytes;
}

}  // namespace rayrep::detail
