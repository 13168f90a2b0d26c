#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <limits>
#include <set>
#include <utility>

#include "io/mesh_io_detail.h"

namespace rayrep::detail {
namespace {

enum class Scalar { i8, u8, i16, u16, i32, u32, f32, f64 };

struct ScalarName {
  std::string_view name;
  Scalar type;
};

constexpr std::array<ScalarName, 16> kScalarNames = {{{"char", Scalar::i8},
                                                      {"int8", Scalar::i8},
                                                      {"uchar", Scalar::u8},
                                                      {"uint8", Scalar::u8},
                                                      {"short", Scalar::i16},
                                                      {"int16", Scalar::i16},
                                                      {"ushort", Scalar::u16},
                                                      {"uint16", Scalar::u16},
                                                      {"int", Scalar::i32},
                                                      {"int32", Scalar::i32},
                                                      {"uint", Scalar::u32},
                                                      {"uint32", Scalar::u32},
                                                      {"float", Scalar::f32},
                                                      {"float32", Scalar::f32},
                                                      {"double", Scalar::f64},
                                                      {"float64", Scalar::f64}}};

constexpr std::size_t size_of(Scalar type) {
  constexpr std::array<std::size_t, 8> kSizes = {1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<std::size_t>(type)];
}

struct Property {
  std::string name;
  Scalar type = Scalar::f32;
  std::optional<Scalar> list_count;  ///< the type of the count before each list; none for a single value
};

struct Element {
  std::string name;
  std::size_t count = 0;
  std::vector<Property> properties;
};

enum class Encoding { ascii, little_endian, big_endian };

struct Header {
  Encoding encoding = Encoding::ascii;
  std::vector<Element> elements;
  std::size_t bytes = 0;
};

Scalar scalar_type(const TextScanner& scan, std::string_view name) {
  for (const auto& known : kScalarNames)
    if (known.name == name) return known.type;
  scan.fail(concat("'", name.substr(0, 40), "' is not a PLY type such as float, double, int or uchar. Export the mesh again."));
}

Encoding encoding_of(const TextScanner& scan, std::string_view name) {
  if (name == "ascii") return Encoding::ascii;
  if (name == "binary_little_endian") return Encoding::little_endian;
  if (name == "binary_big_endian") return Encoding::big_endian;
  scan.fail(concat("'", name.substr(0, 40), "' is not ascii, binary_little_endian or binary_big_endian. Export the mesh again."));
}

Header read_header(const FileBytes& file) {
  Header header;
  bool has_format = false;
  std::set<std::string> names;
  TextScanner scan(file, 0);
  if (scan.word_in_line() != "ply")
    scan.fail("a PLY file must begin with a line 'ply'. This is another kind of file, or a damaged one.");
  scan.skip_line();
  for (; !scan.at_end(); scan.skip_line()) {
    const std::string_view keyword = scan.word_in_line();
    if (keyword == "format") {
      header.encoding = encoding_of(scan, scan.word_in_line());
      has_format = true;
    } else if (keyword == "element") {
      Element element;
      element.name = scan.word_in_line();
      if (!names.insert(element.name).second)
        scan.fail(concat("element '", element.name, "' is declared twice. Export the mesh again."));
      const std::string_view count = scan.word_in_line();
      long long value = 0;
      if (!parse_integer(count, value) || value < 0)
        scan.fail(concat("'", count.substr(0, 40), "' is not a number of elements. Export the mesh again."));
      element.count = static_cast<std::size_t>(value);
      header.elements.push_back(std::move(element));
    } else if (keyword == "property") {
      if (header.elements.empty()) scan.fail("a property is declared before any element. Export the mesh again.");
      Property property;
      std::string_view type = scan.word_in_line();
      if (type == "list") {
        property.list_count = scalar_type(scan, scan.word_in_line());
        if (*property.list_count == Scalar::f32 || *property.list_count == Scalar::f64)
          scan.fail("the length of a list is declared as a real number. Export the mesh again.");
        type = scan.word_in_line();
      }
      property.type = scalar_type(scan, type);
      property.name = scan.word_in_line();
      header.elements.back().properties.push_back(std::move(property));
    } else if (keyword == "end_header") {
      if (!has_format) scan.fail("the header has no 'format' line. Export the mesh again.");
      scan.skip_line();
      header.bytes = scan.offset();
      return header;
    } else if (!keyword.empty() && keyword != "comment" && keyword != "obj_info") {
      scan.fail(concat("'", keyword.substr(0, 40), "' is not a keyword of a PLY header. Export the mesh again."));
    }
  }
  scan.fail("the header has no 'end_header'. The file is cut off; export or download it again.");
}

/// The values after an ASCII header, one after the other.
class AsciiValues {
public:
  AsciiValues(const FileBytes& file, std::size_t offset) : scan_(file, offset) {}

  double next(Scalar) { return scan_.to_number(scan_.word(), "a value"); }
  void skip(Scalar, std::size_t count) {
    while (count-- > 0)
      if (scan_.word().empty()) scan_.to_number({}, "a value");
  }
  /// The bytes that one value takes at least: a digit and a blank, which the last value does without.
  std::size_t smallest(Scalar) const { return 2; }
  std::size_t room() const { return scan_.remaining() + 1; }
  std::string where() const { return concat("line ", scan_.line()); }
  /// The bytes left over when all elements are read, white space apart.
  std::size_t left_over() { return scan_.word().size() + scan_.remaining(); }

private:
  TextScanner scan_;
};

/// The values after a binary header.
class BinaryValues {
public:
  BinaryValues(const FileBytes& file, std::size_t offset, bool swap) : file_(file), offset_(offset), swap_(swap) {}

  double next(Scalar type) {
    const std::size_t size = size_of(type);
    if (room() < size) fail_cut_off();
    std::array<char, 8> raw{};
    std::memcpy(raw.data(), file_.bytes.data() + offset_, size);
    if (swap_) std::reverse(raw.begin(), raw.begin() + size);
    offset_ += size;
    switch (type) {
      case Scalar::i8:
        return as<std::int8_t>(raw);
      case Scalar::u8:
        return as<std::uint8_t>(raw);
      case Scalar::i16:
        return as<std::int16_t>(raw);
      case Scalar::u16:
        return as<std::uint16_t>(raw);
      case Scalar::i32:
        return as<std::int32_t>(raw);
      case Scalar::u32:
        return as<std::uint32_t>(raw);
      case Scalar::f32:
        return as<float>(raw);
      case Scalar::f64:
        break;
    }
    return as<double>(raw);
  }
  void skip(Scalar type, std::size_t count) {
    if (room() / size_of(type) < count) fail_cut_off();
    offset_ += count * size_of(type);
  }
  std::size_t smallest(Scalar type) const { return size_of(type); }
  std::size_t room() const { return file_.bytes.size() - offset_; }
  std::string where() const { return concat("byte ", offset_); }
  std::size_t left_over() const { return file_.bytes.size() - offset_; }

private:
  template <class T>
  static double as(const std::array<char, 8>& raw) {
    T value;
    std::memcpy(&value, raw.data(), sizeof value);
    return static_cast<double>(value);
  }
  [[noreturn]] void fail_cut_off() const {
    fail_read(file_, where(),
              "the file ends before the elements that its header announces. It is cut off; export or download it again.");
  }

  const FileBytes& file_;
  std::size_t offset_;
  bool swap_;
};

int find_property(const Element& element, std::initializer_list<std::string_view> names, bool list) {
  for (std::size_t i = 0; i < element.properties.size(); ++i)
    for (const auto name : names)
      if (element.properties[i].name == name && element.properties[i].list_count.has_value() == list) return static_cast<int>(i);
  return -1;
}

template <class Values>
class BodyReader {
public:
  BodyReader(const FileBytes& file, Values values) : file_(file), values_(std::move(values)) {}

  void read(const Element& element, std::size_t vertex_count) {
    if (element.count == 0) return;
    check_room(element);
    if (element.name == "vertex") {
      read_vertices(element);
    } else if (element.name == "face") {
      read_faces(element, vertex_count);
    } else if (element.name == "tristrips") {
      read_strips(element, vertex_count);
    } else if (!element.properties.empty()) {  // otherwise any number of them takes no room
      for (std::size_t i = 0; i < element.count; ++i)
        for (const auto& property : element.properties) skip(property);
    }
  }

  std::size_t left_over() { return values_.left_over(); }
  PolygonSoup& soup() { return soup_; }

private:
  /// Refuses counts that the rest of the file cannot hold, so that no memory is asked for on the word of a header.
  void check_room(const Element& element) {
    std::size_t smallest = 0;
    for (const auto& property : element.properties) smallest += values_.smallest(property.list_count.value_or(property.type));
    if (smallest == 0) return;
    const std::size_t room = values_.room() / smallest;
    if (element.count > room)
      fail_read(file_, values_.where(),
                concat("the header announces ", element.count, " elements '", element.name,
                       "', but the rest of the file has no room for more than ", room,
                       ". It is damaged or cut off; export or download it again."));
  }

  std::size_t list_length(const Property& property) {
    const double count = values_.next(*property.list_count);
    const std::size_t room = values_.room() / values_.smallest(property.type);
    if (!(count >= 0) || count > static_cast<double>(room) || count != std::floor(count))
      fail_read(file_, values_.where(),
                concat("a list '", property.name, "' announces ", count,
                       " entries, which the rest of the file cannot hold. It is damaged or cut off; export or download it again."));
    return static_cast<std::size_t>(count);
  }

  void skip(const Property& property) { values_.skip(property.type, property.list_count ? list_length(property) : 1); }

  void read_vertices(const Element& element) {
    const std::array<int, 3> xyz = {find_property(element, {"x"}, false), find_property(element, {"y"}, false),
                                    find_property(element, {"z"}, false)};
    if (*std::min_element(xyz.begin(), xyz.end()) < 0)
      fail_read(file_, "header", "the vertices have no properties x, y and z. Export the mesh again.");
    soup_.vertices.reserve(element.count);
    for (std::size_t i = 0; i < element.count; ++i) {
      Eigen::Vector3d vertex;
      for (int k = 0; k < static_cast<int>(element.properties.size()); ++k) {
        const Property& property = element.properties[k];
        const auto axis = std::find(xyz.begin(), xyz.end(), k) - xyz.begin();
        if (axis < 3) {
          vertex[axis] = values_.next(property.type);
        } else {
          skip(property);
        }
      }
      soup_.vertices.push_back(vertex);
    }
  }

  void read_faces(const Element& element, std::size_t vertex_count) {
    const int corners = find_property(element, {"vertex_indices", "vertex_index"}, true);
    if (corners < 0) fail_read(file_, "header", "the faces have no list 'vertex_indices'. Export the mesh again.");
    for (std::size_t i = 0; i < element.count; ++i) {
      for (int k = 0; k < static_cast<int>(element.properties.size()); ++k) {
        const Property& property = element.properties[k];
        if (k != corners) {
          skip(property);
          continue;
        }
        for (std::size_t left = list_length(property); left > 0; --left)
          soup_.corners.push_back(to_vertex(values_.next(property.type), "face ", i, vertex_count));
        soup_.end_polygon();
      }
    }
  }

  /// Strips, as Stanford's scans have them: each corner makes a triangle with the two before it, every other one turned; -1 starts
  /// a new strip. Repeated corners are turning points and make no triangle.
  void read_strips(const Element& element, std::size_t vertex_count) {
    const int corners = find_property(element, {"vertex_indices", "vertex_index"}, true);
    if (corners < 0) fail_read(file_, "header", "the triangle strips have no list 'vertex_indices'. Export the mesh again.");
    for (std::size_t i = 0; i < element.count; ++i) {
      for (int k = 0; k < static_cast<int>(element.properties.size()); ++k) {
        const Property& property = element.properties[k];
        if (k != corners) {
          skip(property);
          continue;
        }
        std::size_t length = 0;
        int a = 0, b = 0;
        for (std::size_t left = list_length(property); left > 0; --left) {
          const double index = values_.next(property.type);
          if (index == -1 || index == std::numeric_limits<std::uint32_t>::max()) {
            length = 0;
            continue;
          }
          const int c = to_vertex(index, "triangle strip ", i, vertex_count);
          if (++length >= 3 && a != b && b != c && c != a) {
            const bool turned = length % 2 == 0;
            soup_.corners.insert(soup_.corners.end(), {turned ? b : a, turned ? a : b, c});
            soup_.end_polygon();
          }
          a = b;
          b = c;
        }
      }
    }
  }

  int to_vertex(double index, std::string_view what, std::size_t i, std::size_t vertex_count) const {
    if (!(index >= 0) || !(index < static_cast<double>(vertex_count)) || index != std::floor(index))
      fail_read(file_, values_.where(),
                concat(what, i + 1, " uses vertex ", index, " (counted from 0), but the file has ", vertex_count,
                       ". Export the mesh again."));
    return static_cast<int>(index);
  }

  const FileBytes& file_;
  Values values_;
  PolygonSoup soup_;
};

template <class Values>
MeshFile read_body(const FileBytes& file, const Header& header, Values values) {
  std::size_t vertex_count = 0;
  bool has_faces = false;
  for (const auto& element : header.elements) {
    if (element.name == "vertex") vertex_count = element.count;
    has_faces |= (element.name == "face" || element.name == "tristrips") && element.count > 0;
  }
  if (!has_faces) fail_read(file, "header", "there are no faces: this is a cloud of points. Export it as a mesh of polygons.");
  BodyReader<Values> reader(file, std::move(values));
  for (const auto& element : header.elements) reader.read(element, vertex_count);
  const std::size_t extra = reader.left_over();
  MeshFile result = triangulated(file, std::move(reader.soup()), header.encoding == Encoding::ascii ? "PLY ASCII" : "PLY binary");
  if (extra > 0) result.notes.push_back(concat("Ignored ", plural(extra, "byte", "bytes"), " after the last element."));
  return result;
}

}  // namespace

bool is_ply(std::string_view bytes) { return begins_with_word(bytes, "ply"); }

MeshFile read_ply(const FileBytes& file, const ReadOptions&) {
  const Header header = read_header(file);
  if (header.encoding == Encoding::ascii) return read_body(file, header, AsciiValues(file, header.bytes));
  static_assert(std::endian::native == std::endian::little);
  return read_body(file, header, BinaryValues(file, header.bytes, header.encoding == Encoding::big_endian));
}

std::string encode_ply(const Mesh& mesh) {
  std::string bytes = concat("ply\nformat binary_little_endian 1.0\ncomment rayrep, millimetres\nelement vertex ",
                             mesh.vertices.size(), "\nproperty double x\nproperty double y\nproperty double z\nelement face ",
                             mesh.triangles.size(), "\nproperty list uchar int vertex_indices\nend_header\n");
  constexpr std::size_t kVertexBytes = 24;
  constexpr std::size_t kFaceBytes = 13;
  const std::size_t header = bytes.size();
  bytes.resize(header + kVertexBytes * mesh.vertices.size() + kFaceBytes * mesh.triangles.size());
  char* out = bytes.data() + header;
  for (const auto& vertex : mesh.vertices) {
    std::memcpy(out, vertex.data(), kVertexBytes);
    out += kVertexBytes;
  }
  for (const auto& triangle : mesh.triangles) {
    *out = 3;
    std::memcpy(out + 1, triangle.data(), kFaceBytes - 1);
    out += kFaceBytes;
  }
  return bytes;
}

}  // namespace rayrep::detail
