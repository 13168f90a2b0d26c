#include <zip.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <pugixml.hpp>

#include "io/mesh_io_detail.h"
#include "rayrep/base/error.h"

namespace rayrep::detail {
namespace {

// Limits that no honest file comes near and that keep a zip bomb, or components of components, from filling the memory.
constexpr std::size_t kMaxPartBytes = std::size_t{512} << 20;
constexpr std::size_t kMaxExpansion = 200;  // bytes out per byte in, where more than kFreeExpansionBytes come out
constexpr std::size_t kFreeExpansionBytes = std::size_t{16} << 20;
constexpr std::size_t kMaxTriangles = 20'000'000;
constexpr std::size_t kMaxInstances = 100'000;
constexpr int kMaxDepth = 64;

constexpr const char* kModelRelationship = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel";
constexpr const char* kDefaultModel = "3D/3dmodel.model";

struct ZipError {
  ZipError() { zip_error_init(&error); }
  ~ZipError() { zip_error_fini(&error); }
  ZipError(const ZipError&) = delete;
  ZipError& operator=(const ZipError&) = delete;
  std::string text() { return zip_error_strerror(&error); }
  zip_error_t error;
};

/// A 3MF file is a zip archive of named parts, most of them XML.
class Package {
public:
  explicit Package(const FileBytes& file) : file_(file) {
    ZipError error;
    zip_source_t* source = zip_source_buffer_create(file.bytes.data(), file.bytes.size(), 0, &error.error);
    if (source != nullptr) {
      archive_.reset(zip_open_from_source(source, ZIP_RDONLY, &error.error));
      if (!archive_) zip_source_free(source);
    }
    if (!archive_)
      fail_read(file, "",
                concat("a 3MF file is a zip archive, and this one cannot be opened (", error.text(),
                       "). It is cut off or damaged; export or download it again."));
  }

  bool has(const std::string& part) const { return locate(part) >= 0; }

  /// The unpacked bytes of a part. @throws Error{input} if it is missing, damaged, encrypted or far too large.
  std::string read(const std::string& part) const {
    const zip_int64_t index = locate(part);
    if (index < 0) fail_read(file_, "", concat("the 3MF archive has no part '", part, "'. Export the model again."));
    zip_stat_t stat;
    zip_stat_init(&stat);
    zip_stat_index(archive_.get(), static_cast<zip_uint64_t>(index), 0, &stat);
    const std::size_t packed = (stat.valid & ZIP_STAT_COMP_SIZE) != 0 ? stat.comp_size : file_.bytes.size();
    const std::size_t limit =
        std::min(kMaxPartBytes, std::max(kFreeExpansionBytes, kMaxExpansion * std::min(packed, kMaxPartBytes)));
    std::unique_ptr<zip_file_t, int (*)(zip_file_t*)> in(zip_fopen_index(archive_.get(), static_cast<zip_uint64_t>(index), 0),
                                                         zip_fclose);
    if (!in) fail_damaged(part, zip_strerror(archive_.get()));
    std::string bytes;
    std::vector<char> chunk(1 << 16);
    while (true) {
      const zip_int64_t got = zip_fread(in.get(), chunk.data(), chunk.size());
      if (got < 0) fail_damaged(part, zip_file_strerror(in.get()));
      if (got == 0) return bytes;
      bytes.append(chunk.data(), static_cast<std::size_t>(got));
      if (bytes.size() > limit)
        fail_read(file_, concat("part '", part, "'"),
                  concat("it unpacks to more than ", limit >> 20, " MiB from ", packed,
                         " bytes, which is more than rayrep accepts. Reduce the number of triangles, or save the model as STL."));
    }
  }

  const FileBytes& file() const { return file_; }

private:
  zip_int64_t locate(const std::string& part) const { return zip_name_locate(archive_.get(), part.c_str(), ZIP_FL_NOCASE); }

  [[noreturn]] void fail_damaged(const std::string& part, const char* reason) const {
    fail_read(file_, concat("part '", part, "'"),
              concat("it cannot be unpacked (", reason, "). The file is damaged or encrypted; export or download it again."));
  }

  const FileBytes& file_;
  std::unique_ptr<zip_t, void (*)(zip_t*)> archive_{nullptr, zip_discard};
};

/// The name of an element or attribute without its namespace prefix.
std::string_view local_name(const char* name) {
  const std::string_view text = name;
  return text.substr(text.find(':') + 1);
}

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r\n") - first + 1);
}

pugi::xml_node child(const pugi::xml_node& parent, std::string_view name) {
  for (const auto& node : parent.children())
    if (local_name(node.name()) == name) return node;
  return {};
}

/// The attribute of that name, in whatever namespace; empty if there is none.
std::string_view attribute(const pugi::xml_node& node, std::string_view name) {
  for (const auto& candidate : node.attributes())
    if (local_name(candidate.name()) == name) return trimmed(candidate.value());
  return {};
}

struct XmlPart {
  std::string text;
  pugi::xml_document document;  // points into text
};

std::unique_ptr<XmlPart> parse_part(const Package& package, const std::string& name) {
  auto part = std::make_unique<XmlPart>();
  part->text = package.read(name);
  const auto parsed = part->document.load_buffer_inplace(part->text.data(), part->text.size(),
                                                         pugi::parse_minimal | pugi::parse_escapes | pugi::parse_wconv_attribute);
  if (!parsed)
    fail_read(package.file(), concat("part '", name, "', byte ", parsed.offset),
              concat("the XML is damaged (", parsed.description(), "). Export or download the file again."));
  return part;
}

struct ModelPart {
  std::unique_ptr<XmlPart> xml;
  double mm_per_unit = 1;
  pugi::xml_node build;
  std::map<std::string, pugi::xml_node, std::less<>> objects;  // by id
};

class ModelReader {
public:
  explicit ModelReader(const FileBytes& file) : package_(file), file_(file) {}

  MeshFile read() {
    result_.format = "3MF";
    const std::string root_name = root_model();
    const ModelPart& root = part(root_name);
    result_.mm_per_unit = root.mm_per_unit;
    std::size_t items = 0;
    std::size_t skipped = 0;
    for (const auto& item : root.build.children()) {
      if (local_name(item.name()) != "item") continue;
      if (attribute(item, "printable") == "0") {  // how slicers switch an item off
        ++skipped;
        continue;
      }
      ++items;
      append_reference(item, root_name, Eigen::Affine3d::Identity(), 0);
    }
    if (items == 0)
      fail_read(file_, "",
                "the build section of the 3MF file places no object. Put an object on the build plate and export again.");
    if (items > 1) result_.notes.push_back(concat("The ", items, " objects on the build plate were joined into one mesh."));
    if (skipped > 0) result_.notes.push_back(plural(skipped, "object", "objects") + " marked as not printable left out.");
    if (supports_ > 0) result_.notes.push_back(plural(supports_, "support object", "support objects") + " left out.");
    note_slicer_volumes();
    result_.polygons = result_.mesh.triangles.size();
    return std::move(result_);
  }

private:
  std::string root_model() const {
    if (package_.has("_rels/.rels")) {
      const auto rels = parse_part(package_, "_rels/.rels");
      for (const auto& relationship : child(rels->document, "Relationships").children())
        if (attribute(relationship, "Type") == kModelRelationship) return without_slash(attribute(relationship, "Target"));
    }
    return kDefaultModel;
  }

  static std::string without_slash(std::string_view path) {
    while (path.starts_with('/')) path.remove_prefix(1);
    return std::string(path);
  }

  /// A model part, parsed on first use.
  const ModelPart& part(const std::string& name) {
    ModelPart& result = parts_[name];
    if (result.xml) return result;
    result.xml = parse_part(package_, name);
    const pugi::xml_node model = child(result.xml->document, "model");
    if (!model) fail_read(file_, concat("part '", name, "'"), "it has no <model> element. Export the model again.");
    result.mm_per_unit = unit(name, attribute(model, "unit"));
    require_known_extensions(name, model);
    result.build = child(model, "build");
    for (const auto& object : child(model, "resources").children()) {
      if (local_name(object.name()) != "object") continue;
      if (!result.objects.emplace(attribute(object, "id"), object).second)
        fail_read(file_, concat("part '", name, "'"),
                  concat("two objects have the id '", attribute(object, "id"), "'. Export the model again."));
    }
    return result;
  }

  double unit(const std::string& part_name, std::string_view text) const {
    if (text.empty() || text == "millimeter") return 1;
    if (text == "micron") return 0.001;
    if (text == "centimeter") return 10;
    if (text == "inch") return 25.4;
    if (text == "foot") return 304.8;
    if (text == "meter") return 1000;
    fail_read(file_, concat("part '", part_name, "'"),
              concat("'", text.substr(0, 40),
                     "' is not a 3MF unit (micron, millimeter, centimeter, inch, foot or meter). Export the model again."));
  }

  /// An extension that a file declares as required may hold geometry that we do not see: only those that do not, pass.
  void require_known_extensions(const std::string& part_name, const pugi::xml_node& model) const {
    std::string_view required = attribute(model, "requiredextensions");
    while (!(required = trimmed(required)).empty()) {
      const std::string_view prefix = required.substr(0, required.find_first_of(" \t\r\n"));
      required.remove_prefix(prefix.size());
      const std::string_view uri = trimmed(model.attribute(concat("xmlns:", prefix).c_str()).value());
      if (uri.find("/production/2015/") == std::string_view::npos && uri.find("/material/2015/") == std::string_view::npos)
        fail_read(file_, concat("part '", part_name, "'"),
                  concat("the model cannot be understood without the extension '", uri.empty() ? prefix : uri,
                         "', which rayrep does not read. Export it as plain triangles, or as STL."));
    }
  }

  Eigen::Affine3d transform(const pugi::xml_node& node, const std::string& where) const {
    Eigen::Affine3d result = Eigen::Affine3d::Identity();
    std::string_view text = attribute(node, "transform");
    if (text.empty()) return result;
    // 3MF multiplies row vectors from the left: the four rows are the images of the axes and of the origin.
    for (int row = 0; row < 4; ++row)
      for (int column = 0; column < 3; ++column) {
        const std::string_view word = text.substr(0, text.find_first_of(" \t\r\n"));
        text = trimmed(text.substr(word.size()));
        double value = 0;
        if (!parse_number(word, value) || !std::isfinite(value))
          fail_read(file_, where,
                    concat("its transform must hold twelve numbers, but number ", 3 * row + column + 1, " is '", word.substr(0, 40),
                           "'. Export the model again."));
        result.matrix()(column, row) = value;
      }
    if (!text.empty()) fail_read(file_, where, "its transform holds more than twelve numbers. Export the model again.");
    return result;
  }

  /// Appends what a build item or a component refers to, as seen from its parent through `parent`.
  void append_reference(const pugi::xml_node& reference, const std::string& part_name, const Eigen::Affine3d& parent, int depth) {
    const std::string_view id = attribute(reference, "objectid");
    const std::string where = concat("object ", id.empty() ? "(no objectid)" : id);
    if (depth > kMaxDepth)
      fail_read(file_, where,
                concat("components are nested deeper than ", kMaxDepth, " levels or contain themselves. Export the model again."));
    if (++instances_ > kMaxInstances)
      fail_read(file_, where,
                concat("components multiply the objects to more than ", kMaxInstances, " copies. Export fewer copies."));
    const std::string_view path = attribute(reference, "path");  // of the production extension
    const std::string object_part = path.empty() ? part_name : without_slash(path);
    const ModelPart& model = part(object_part);
    if (model.mm_per_unit != result_.mm_per_unit)
      fail_read(file_, concat("part '", object_part, "'"), "its unit differs from that of the main part. Export the model again.");
    const auto found = model.objects.find(id);
    if (found == model.objects.end())
      fail_read(file_, where, concat("it is used, but not defined in part '", object_part, "'. Export the model again."));
    const std::string_view type = attribute(found->second, "type");
    if (type == "support" || type == "solidsupport") {
      ++supports_;
      return;
    }
    const Eigen::Affine3d here = parent * transform(reference, where);
    if (const auto mesh = child(found->second, "mesh")) append_mesh(mesh, here, where);
    for (const auto& component : child(found->second, "components").children())
      if (local_name(component.name()) == "component") append_reference(component, object_part, here, depth + 1);
  }

  double coordinate(const pugi::xml_node& vertex, std::string_view axis, std::size_t index, const std::string& where) const {
    double value = 0;
    const std::string_view text = attribute(vertex, axis);
    if (!parse_number(text, value))
      fail_read(file_, where,
                concat("'", text.substr(0, 40), "' is not a number for ", axis, " of vertex ", index,
                       " (counted from 0). Export the model again."));
    return value;
  }

  int corner(const pugi::xml_node& triangle, std::string_view name, std::size_t index, std::size_t vertices,
             const std::string& where) const {
    long long value = 0;
    const std::string_view text = attribute(triangle, name);
    if (!parse_integer(text, value) || value < 0 || value >= static_cast<long long>(vertices))
      fail_read(file_, where,
                concat("triangle ", index, " (counted from 0) has ", name, " = '", text.substr(0, 40), "', but the object has ",
                       vertices, " vertices. Export the model again."));
    return static_cast<int>(value);
  }

  void append_mesh(const pugi::xml_node& node, const Eigen::Affine3d& here, const std::string& where) {
    Mesh& mesh = result_.mesh;
    const std::size_t first = mesh.vertices.size();
    const bool moved = !here.matrix().isIdentity(0);
    std::size_t count = 0;
    for (const auto& vertex : child(node, "vertices").children()) {
      if (local_name(vertex.name()) != "vertex") continue;
      Eigen::Vector3d p(coordinate(vertex, "x", count, where), coordinate(vertex, "y", count, where),
                        coordinate(vertex, "z", count, where));
      ++count;
      if (moved) p = here * p;
      mesh.vertices.push_back(p);
      if (mesh.vertices.size() > kMaxTriangles) fail_too_large(where);
    }
    const bool mirrored = here.linear().determinant() < 0;
    std::size_t index = 0;
    for (const auto& triangle : child(node, "triangles").children()) {
      if (local_name(triangle.name()) != "triangle") continue;
      Eigen::Vector3i corners(corner(triangle, "v1", index, count, where), corner(triangle, "v2", index, count, where),
                              corner(triangle, "v3", index, count, where));
      ++index;
      if (mirrored) std::swap(corners[1], corners[2]);
      mesh.triangles.push_back(corners.array() + static_cast<int>(first));
      if (mesh.triangles.size() > kMaxTriangles) fail_too_large(where);
    }
  }

  [[noreturn]] void fail_too_large(const std::string& where) const {
    fail_read(file_, where,
              concat("with it the build holds more than ", kMaxTriangles,
                     " triangles or vertices. Export fewer copies or a coarser mesh."));
  }

  /// Slicers keep modifiers and negative volumes as triangles like any others and tell them apart in a part of their own.
  void note_slicer_volumes() {
    for (const char* name : {"Metadata/Slic3r_PE_model.config", "Metadata/model_settings.config"}) {
      if (!package_.has(name)) continue;
      const std::string config = package_.read(name);
      for (const char* kind : {"NegativeVolume", "ParameterModifier", "SupportBlocker", "SupportEnforcer", "negative_part",
                               "modifier_part", "support_blocker", "support_enforcer"}) {
        if (config.find(concat('"', kind, '"')) == std::string::npos) continue;
        result_.notes.push_back(concat("A slicer marked some of the triangles as '", kind,
                                       "'; they were read as ordinary triangles. Export the plain model if that is not meant."));
        break;
      }
    }
  }

  Package package_;
  const FileBytes& file_;
  std::map<std::string, ModelPart> parts_;
  MeshFile result_;
  std::size_t instances_ = 0;
  std::size_t supports_ = 0;
};

struct PartText {
  const char* name;
  std::string text;
};

constexpr const char* kContentTypes = R"(<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
 <Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>
 <Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>
 <Default Extension="config" ContentType="text/xml"/>
</Types>
)";

std::string relationships_xml() {
  return concat(R"(<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
 <Relationship Target="/)",
                kDefaultModel, R"(" Id="rel-1" Type=")", kModelRelationship, R"("/>
</Relationships>
)");
}

std::string model_xml(const Mesh& mesh) {
  std::string xml = R"(<?xml version="1.0" encoding="UTF-8"?>
<model unit="millimeter" xml:lang="en-US" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02" xmlns:slic3rpe="http://schemas.slic3r.org/3mf/2017/06">
 <metadata name="slic3rpe:Version3mf">1</metadata>
 <metadata name="Application">rayrep</metadata>
 <resources>
  <object id="1" type="model">
   <mesh>
    <vertices>
)";
  for (const auto& p : mesh.vertices) {
    append_number(xml += "     <vertex x=\"", p.x());
    append_number(xml += "\" y=\"", p.y());
    append_number(xml += "\" z=\"", p.z());
    xml += "\"/>\n";
  }
  xml += "    </vertices>\n    <triangles>\n";
  for (const auto& t : mesh.triangles) {
    append_number(xml += "     <triangle v1=\"", static_cast<long long>(t[0]));
    append_number(xml += "\" v2=\"", static_cast<long long>(t[1]));
    append_number(xml += "\" v3=\"", static_cast<long long>(t[2]));
    xml += "\"/>\n";
  }
  return xml += R"(    </triangles>
   </mesh>
  </object>
 </resources>
 <build>
  <item objectid="1"/>
 </build>
</model>
)";
}

/// PrusaSlicer's own part: without 100 % infill the user's profile makes a hollow body heavier than a solid one.
std::string slicer_config_xml(std::size_t triangles) {
  return concat(R"(<?xml version="1.0" encoding="UTF-8"?>
<config>
 <object id="1" instances_count="1">
  <metadata type="object" key="name" value="body"/>
  <metadata type="object" key="fill_density" value="100%"/>
  <metadata type="object" key="fill_pattern" value="rectilinear"/>
  <volume firstid="0" lastid=")",
                triangles - 1, R"(">
   <metadata type="volume" key="name" value="body"/>
   <metadata type="volume" key="volume_type" value="ModelPart"/>
   <metadata type="volume" key="matrix" value="1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"/>
  </volume>
 </object>
</config>
)");
}

}  // namespace

MeshFile read_3mf(const FileBytes& file) { return ModelReader(file).read(); }

std::string encode_3mf(const Mesh& mesh) {
  const std::array<PartText, 4> parts = {{{"[Content_Types].xml", kContentTypes},
                                          {"_rels/.rels", relationships_xml()},
                                          {kDefaultModel, model_xml(mesh)},
                                          {"Metadata/Slic3r_PE_model.config", slicer_config_xml(mesh.triangles.size())}}};
  ZipError error;
  const auto fail = [](const std::string& reason) {
    throw Error(ErrorCode::write, "Cannot pack the 3MF archive: " + reason + ".");
  };
  // The archive grows in memory; `packed` outlives it because of the extra reference.
  std::unique_ptr<zip_source_t, void (*)(zip_source_t*)> packed(zip_source_buffer_create(nullptr, 0, 0, &error.error),
                                                                zip_source_free);
  if (!packed) fail(error.text());
  zip_source_keep(packed.get());
  std::unique_ptr<zip_t, void (*)(zip_t*)> archive(zip_open_from_source(packed.get(), ZIP_CREATE | ZIP_TRUNCATE, &error.error),
                                                   zip_discard);
  if (!archive) {
    zip_source_free(packed.get());
    fail(error.text());
  }
  for (const auto& part : parts) {
    zip_source_t* source = zip_source_buffer(archive.get(), part.text.data(), part.text.size(), 0);
    const zip_int64_t index = source == nullptr ? -1 : zip_file_add(archive.get(), part.name, source, ZIP_FL_ENC_UTF_8);
    if (index < 0) {
      if (source != nullptr) zip_source_free(source);
      fail(zip_strerror(archive.get()));
    }
    // zlib's usual level: libzip's default of 9 takes 18 s instead of 4 for two million triangles, to save 6 % of the size.
    constexpr zip_uint32_t kLevel = 6;
    // 1980-01-01 00:00, the first moment a zip file can name: the same mesh gives the same bytes at any time.
    constexpr zip_uint16_t kDosDate = (1 << 5) | 1;
    const auto entry = static_cast<zip_uint64_t>(index);
    if (zip_set_file_compression(archive.get(), entry, ZIP_CM_DEFLATE, kLevel) != 0 ||
        zip_file_set_dostime(archive.get(), entry, 0, kDosDate, 0) != 0)
      fail(zip_strerror(archive.get()));
  }
  if (zip_close(archive.get()) != 0) fail(zip_strerror(archive.get()));
  static_cast<void>(archive.release());

  zip_stat_t stat;
  zip_stat_init(&stat);
  if (zip_source_stat(packed.get(), &stat) != 0 || zip_source_open(packed.get()) != 0)
    fail(zip_error_strerror(zip_source_error(packed.get())));
  std::string bytes(stat.size, '\0');
  const zip_int64_t got = zip_source_read(packed.get(), bytes.data(), bytes.size());
  zip_source_close(packed.get());
  if (got != static_cast<zip_int64_t>(bytes.size())) fail("its bytes could not be read back");
  return bytes;
}

}  // namespace rayrep::detail
