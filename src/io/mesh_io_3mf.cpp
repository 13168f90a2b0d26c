#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <memory>
#include <pugixml.hpp>
#include <span>

#include "io/archive.h"
#include "io/mesh_io_detail.h"
#include "io/subtract.h"
#include "rayrep/base/error.h"
#include "rayrep/mesh/assembly.h"

namespace rayrep::detail {
namespace {

// Limits that no honest file comes near and that keep a zip bomb, or components of components, from filling the memory.
constexpr std::size_t kMaxTriangles = 20'000'000;
constexpr std::size_t kMaxInstances = 100'000;
constexpr int kMaxDepth = 64;

constexpr const char* kModelRelationship = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel";
constexpr const char* kThumbnailRelationship = "http://schemas.openxmlformats.org/package/2006/relationships/metadata/thumbnail";
constexpr const char* kThumbnail = "Metadata/thumbnail.png";
constexpr const char* kDefaultModel = "3D/3dmodel.model";
constexpr const char* kPrusaConfig = "Metadata/Slic3r_PE_model.config";
constexpr const char* kPrusaPauses = "Metadata/Prusa_Slicer_custom_gcode_per_print_z.xml";
constexpr const char* kBambuConfig = "Metadata/model_settings.config";

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

/// What may still be taken of the memory that a file is allowed.
class MemoryBudget {
public:
  MemoryBudget(const FileBytes& file, std::size_t bytes) : file_(file), limit_(bytes), left_(bytes - file.bytes.size()) {}

  std::size_t left() const { return left_; }
  void take(std::size_t bytes) {
    require(bytes);
    left_ -= bytes;
  }
  void require(std::size_t bytes) const {
    if (bytes > left_)
      fail_read(file_, "",
                concat("unpacked it takes more memory than the ", limit_ / 1'000'000,
                       " MB that a file is allowed. Reduce the number of triangles, or save the model as STL."));
  }

private:
  const FileBytes& file_;
  std::size_t limit_;
  std::size_t left_;
};

struct XmlPart {
  std::string text;
  pugi::xml_document document;  // points into text
};

/// At least the memory that parsing takes: a node for each tag or text, and one for each attribute.
std::size_t memory_to_parse(std::string_view text) {
  constexpr std::size_t kNode = 64;
  constexpr std::size_t kAttribute = 40;
  std::size_t nodes = 0;
  std::size_t attributes = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    attributes += text[i] == '=';
    nodes += text[i] == '<' && i + 1 < text.size() && text[i + 1] != '/';
    nodes += text[i] == '>' && i + 1 < text.size() && text[i + 1] > ' ' && text[i + 1] != '<';
  }
  return kNode * nodes + kAttribute * attributes;
}

std::unique_ptr<XmlPart> parse_part(const Archive& package, const std::string& name, const MemoryBudget& budget) {
  auto part = std::make_unique<XmlPart>();
  part->text = package.read(name, budget.left());
  budget.require(part->text.size() + memory_to_parse(part->text));
  const auto parsed = part->document.load_buffer_inplace(part->text.data(), part->text.size(),
                                                         pugi::parse_minimal | pugi::parse_escapes | pugi::parse_wconv_attribute);
  if (!parsed)
    fail_read(package.file(), concat("part '", name, "', byte ", parsed.offset),
              concat("the XML is damaged (", parsed.description(), "). Export or download the file again."));
  return part;
}

/// A build item or a component: an object in its place.
struct Reference {
  std::string id;
  std::string part;
  Eigen::Affine3d transform = Eigen::Affine3d::Identity();
};

struct Object {
  std::string type;
  std::optional<SparseInfill> infill;  ///< of a sparse region, by its name
  std::string not_only_triangles;      ///< what else its shape is made of
  std::string name;
  std::string part_number;
  Mesh mesh;  ///< in units of the file
  std::vector<Reference> components;
};

struct ModelPart {
  double mm_per_unit = 1;
  std::vector<Reference> items;
  std::size_t not_printable = 0;
  std::map<std::string, Object, std::less<>> objects;  // by id
};

/// Slicers keep modifiers, negative volumes and support blockers as triangles like any others and tell them apart in a part of
/// their own: PrusaSlicer by ranges of the triangles of an object, Bambu Studio and OrcaSlicer by the components of one.
struct SlicerMarks {
  struct Mark {
    std::string kind;
    std::optional<SparseInfill> infill = {};  ///< of a modifier that sets it
  };
  struct Range {
    std::size_t first = 0;
    std::size_t last = 0;  ///< inclusive
    Mark mark;
  };
  struct Volumes {
    std::vector<Range> special;
    std::size_t bodies = 0;
  };
  std::map<std::string, Volumes, std::less<>> volumes;        // by object
  std::map<std::pair<std::string, std::string>, Mark> marks;  // by object and component
};

/// What slicers call the settings of infill.
struct InfillKeys {
  const char* density;
  const char* pattern;
  std::array<const char*, 3> none;  ///< 0 in a sparse region: layers that would be solid in it, and areas
};
constexpr InfillKeys kPrusaKeys = {
    "fill_density", "fill_pattern", {"top_solid_layers", "bottom_solid_layers", "solid_infill_below_area"}};
constexpr InfillKeys kBambuKeys = {
    "sparse_infill_density", "sparse_infill_pattern", {"top_shell_layers", "bottom_shell_layers", "minimum_sparse_infill_area"}};

/// What names of sparse regions begin with, before percentage and pattern.
constexpr const char* kSparseName = "rayrep sparse infill % ";

/// The part number of what closes a hole: its triangles are where it is in the body, whatever its place on the bed.
constexpr const char* kPlugNumber = "rayrep plug";
// Part numbers that tell what is a piece of a body, and what is put into it, before its density.
constexpr const char* kPieceNumber = "rayrep piece";
constexpr const char* kInsertNumber = "rayrep insert ";

/// Of a name that is one of those; else none.
std::optional<SparseInfill> infill_named(std::string_view name) {
  if (!name.starts_with(kSparseName)) return std::nullopt;
  name.remove_prefix(std::string_view(kSparseName).size());
  const std::size_t space = std::min(name.find(' '), name.size());
  SparseInfill infill;
  if (!parse_number(name.substr(0, space), infill.percent) || !(infill.percent >= 0 && infill.percent <= 100)) return std::nullopt;
  infill.pattern = trimmed(name.substr(space));
  infill.share = infill.percent / 100;
  return infill;
}

/// "15%" and a pattern; none if no density is told.
std::optional<SparseInfill> infill_told(const pugi::xml_node& volume, const InfillKeys& keys) {
  SparseInfill infill;
  bool told = false;
  for (const auto& metadata : volume.children()) {
    std::string_view value = attribute(metadata, "value");
    if (attribute(metadata, "key") == keys.pattern) infill.pattern = value;
    if (attribute(metadata, "key") != keys.density) continue;
    if (value.ends_with('%')) value.remove_suffix(1);
    told = parse_number(value, infill.percent) && infill.percent >= 0 && infill.percent <= 100;
  }
  infill.share = infill.percent / 100;
  return told ? std::optional(infill) : std::nullopt;
}

enum class Role { material, negative, modifier, none };

Role role_of(std::string_view kind) {
  if (kind == "NegativeVolume" || kind == "negative_part") return Role::negative;
  if (kind.empty() || kind == "ModelPart" || kind == "normal_part") return Role::material;
  if (kind == "ParameterModifier" || kind == "modifier_part") return Role::modifier;
  return Role::none;
}

/// One build item as placed.
struct Placed {
  Mesh material;
  std::size_t bodies = 0;  ///< that the material is made of
  Mesh negative;
};

class ModelReader {
public:
  ModelReader(const FileBytes& file, const ReadOptions& options)
      : package_(file), file_(file), budget_(file, options.memory_bytes) {}

  MeshFile read() {
    result_.format = "3MF";
    root_ = root_model();
    read_prusa_marks(kPrusaConfig);
    read_bambu_marks(kBambuConfig);
    const ModelPart& root = part(root_);
    result_.mm_per_unit = root.mm_per_unit;
    const bool whole = take_pieces(root);
    std::size_t plugs = 0;
    if (!whole)
      for (const Reference& item : root.items) {
        if (take_plug(root, item))
          ++plugs;
        else
          append_item(item);
      }
    if (root.items.empty())
      fail_read(file_, "",
                "the build section of the 3MF file places no object. Put an object on the build plate and export again.");
    if (whole)
      result_.notes.push_back(concat("Its ", root.items.size(), " pieces are taken as they are when put together."));
    else if (root.items.size() > plugs + 1)
      result_.notes.push_back(concat("The ", root.items.size() - plugs, " objects on the build plate were joined into one mesh."));
    if (root.not_printable > 0)
      result_.notes.push_back(plural(root.not_printable, "object", "objects") + " marked as not printable left out.");
    if (supports_ > 0) result_.notes.push_back(plural(supports_, "support object", "support objects") + " left out.");
    for (const auto& [what, count] : left_out_)
      result_.notes.push_back(concat(plural(count, "volume", "volumes"), " marked '", what, "' left out: no material of its own."));
    if (plugs > 0) result_.notes.push_back(plural(plugs, "plug", "plugs") + " that close holes of it.");
    if (const std::size_t count = result_.modifiers.size() - plugs; count > 0)
      result_.notes.push_back(concat(plural(count, "modifier", "modifiers"), " with infill of another density."));
    if (negatives_ > 0) result_.notes.push_back(plural(negatives_, "negative volume", "negative volumes") + " subtracted.");
    result_.polygons = result_.mesh.triangles.size();
    return std::move(result_);
  }

private:
  std::string root_model() const {
    if (package_.has("_rels/.rels")) {
      const auto rels = parse_part(package_, "_rels/.rels", budget_);
      for (const auto& relationship : child(rels->document, "Relationships").children())
        if (attribute(relationship, "Type") == kModelRelationship) return without_slash(attribute(relationship, "Target"));
    }
    return kDefaultModel;
  }

  static std::string without_slash(std::string_view path) {
    while (path.starts_with('/')) path.remove_prefix(1);
    return std::string(path);
  }

  void read_prusa_marks(const std::string& name) {
    if (!package_.has(name)) return;
    const auto xml = parse_part(package_, name, budget_);
    for (const auto& object : child(xml->document, "config").children()) {
      const std::string id(attribute(object, "id"));
      for (const auto& volume : object.children()) {
        if (local_name(volume.name()) != "volume") continue;
        std::string_view kind;
        bool modifier = false;  // as old versions say it
        for (const auto& metadata : volume.children()) {
          if (attribute(metadata, "key") == "volume_type") kind = attribute(metadata, "value");
          modifier |= attribute(metadata, "key") == "modifier" && attribute(metadata, "value") == "1";
        }
        if (kind.empty() && modifier) kind = "ParameterModifier";
        if (role_of(kind) == Role::material) {
          ++marks_.volumes[id].bodies;
        } else {
          marks_.volumes[id].special.push_back({triangle_id(volume, "firstid", id),
                                                triangle_id(volume, "lastid", id),
                                                {std::string(kind), infill_told(volume, kPrusaKeys)}});
        }
      }
    }
  }

  std::size_t triangle_id(const pugi::xml_node& volume, std::string_view name, const std::string& object) const {
    long long value = 0;
    const std::string_view text = attribute(volume, name);
    if (!parse_integer(text, value) || value < 0)
      fail_read(file_, concat("object ", object),
                concat("the slicer's settings give '", text.substr(0, 40), "' as the ", name,
                       " of one of its volumes, which is no number of a triangle. Export the model again."));
    return static_cast<std::size_t>(value);
  }

  void read_bambu_marks(const std::string& name) {
    if (!package_.has(name)) return;
    const auto xml = parse_part(package_, name, budget_);
    for (const auto& object : child(xml->document, "config").children())
      for (const auto& component : object.children())
        if (local_name(component.name()) == "part")
          marks_.marks[{std::string(attribute(object, "id")), std::string(attribute(component, "id"))}] = {
              std::string(attribute(component, "subtype")), infill_told(component, kBambuKeys)};
  }

  /// A model part, read on first use.
  const ModelPart& part(const std::string& name) {
    const auto [found, is_new] = parts_.try_emplace(name);
    ModelPart& result = found->second;
    if (!is_new) return result;
    const auto xml = parse_part(package_, name, budget_);
    const pugi::xml_node model = child(xml->document, "model");
    if (!model) fail_read(file_, concat("part '", name, "'"), "it has no <model> element. Export the model again.");
    result.mm_per_unit = unit(name, attribute(model, "unit"));
    require_known_extensions(name, model);
    for (const auto& item : child(model, "build").children()) {
      if (local_name(item.name()) != "item") continue;
      if (attribute(item, "printable") == "0") {  // how slicers switch an item off
        ++result.not_printable;
      } else {
        result.items.push_back(reference(item, name));
      }
    }
    for (const auto& node : child(model, "resources").children()) {
      if (local_name(node.name()) != "object") continue;
      const std::string id(attribute(node, "id"));
      const auto [object, is_first] = result.objects.try_emplace(id);
      if (!is_first)
        fail_read(file_, concat("part '", name, "'"), concat("two objects have the id '", id, "'. Export the model again."));
      read_object(node, name, object->second);
    }
    return result;
  }

  Reference reference(const pugi::xml_node& node, const std::string& part_name) {
    budget_.take(sizeof(Reference));
    Reference result;
    result.id = attribute(node, "objectid");
    const std::string_view path = attribute(node, "path");  // of the production extension
    result.part = path.empty() ? part_name : without_slash(path);
    result.transform = transform(node, named(result.id));
    return result;
  }

  static std::string named(const std::string& id) { return concat("object ", id.empty() ? "(no objectid)" : id); }

  void read_object(const pugi::xml_node& node, const std::string& part_name, Object& object) {
    const std::string where = named(std::string(attribute(node, "id")));
    budget_.take(sizeof(Object));
    object.type = attribute(node, "type");
    object.infill = infill_named(attribute(node, "name"));
    object.name = attribute(node, "name");
    object.part_number = attribute(node, "partnumber");
    if (!attribute(node, "slicestackid").empty()) object.not_only_triangles = "slices";
    for (const auto& content : node.children()) {
      const std::string_view name = local_name(content.name());
      if (name == "mesh") {
        if (child(content, "beamlattice")) object.not_only_triangles = "a lattice of beams";
        read_mesh(content, where, object.mesh);
      } else if (name == "components") {
        for (const auto& component : content.children())
          if (local_name(component.name()) == "component") object.components.push_back(reference(component, part_name));
      } else if (name == "booleanshape" || name == "levelset" || name == "displacementmesh") {
        object.not_only_triangles = concat("a <", name, ">");
      }
    }
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

  bool take_plug(const ModelPart& root, const Reference& item) {
    const auto found = root.objects.find(item.id);
    if (found == root.objects.end() || found->second.part_number != kPlugNumber || item.part != root_) return false;
    Part& plug = result_.modifiers.emplace_back();
    plug.role = Part::Role::plug;
    plug.to_bed = item.transform;
    append_mesh(found->second.mesh, Eigen::Affine3d::Identity(), named(item.id), plug.mesh);
    return true;
  }

  /// Where all that is built are pieces of a body: they, what is put into it, and what it is together. @returns whether they are
  bool take_pieces(const ModelPart& root) {
    const auto object_of = [&root](const Reference& item) {
      const auto found = root.objects.find(item.id);
      return found == root.objects.end() ? nullptr : &found->second;
    };
    const bool all = std::all_of(root.items.begin(), root.items.end(), [&](const Reference& item) {
      const Object* object = object_of(item);
      return object && object->part_number == kPieceNumber && object->components.empty() && object->not_only_triangles.empty();
    });
    if (root.items.empty() || !all) return false;
    Mesh together;
    for (const Reference& item : root.items) {
      Part& piece = result_.pieces.emplace_back();
      piece.name = object_of(item)->name;
      piece.to_bed = item.transform;
      append_mesh(object_of(item)->mesh, Eigen::Affine3d::Identity(), named(item.id), piece.mesh);
      append(together, piece.mesh);
    }
    result_.mesh = glued(together);
    for (const auto& [id, object] : root.objects) take_insert(object, named(id));
    return true;
  }

  void take_insert(const Object& object, const std::string& where) {
    double density = 0;
    if (!object.part_number.starts_with(kInsertNumber)) return;
    if (!parse_number(std::string_view(object.part_number).substr(std::string_view(kInsertNumber).size()), density)) return;
    Part& insert = result_.inserts.emplace_back();
    insert.role = Part::Role::insert;
    insert.density_g_cm3 = density;
    append_mesh(object.mesh, Eigen::Affine3d::Identity(), where, insert.mesh);
  }

  void append_item(const Reference& item) {
    Placed placed;
    append_reference(item, {Eigen::Affine3d::Identity(), {}, 0}, placed);
    if (!placed.negative.triangles.empty() && !placed.material.triangles.empty()) {
      auto rest = without(placed.material, placed.bodies, placed.negative);
      if (!rest)
        fail_read(
            file_, named(item.id),
            "its negative volume cannot be subtracted: it or the model is not closed, or nothing would be left. Subtract it in "
            "the program that made the file, and export the plain model.");
      placed.material = std::move(*rest);
    }
    append(result_.mesh, placed.material);
  }

  /// Where an object stands: in what place, as what a slicer has marked it or its parent, how deep.
  struct Seat {
    Eigen::Affine3d place;
    SlicerMarks::Mark mark;
    int depth = 0;
  };

  /// Appends what a build item or a component refers to.
  void append_reference(const Reference& reference, const Seat& parent, Placed& placed) {
    const std::string where = named(reference.id);
    SlicerMarks::Mark mark = parent.mark;
    if (parent.depth > kMaxDepth)
      fail_read(file_, where,
                concat("components are nested deeper than ", kMaxDepth, " levels or contain themselves. Export the model again."));
    if (++instances_ > kMaxInstances)
      fail_read(file_, where,
                concat("components multiply the objects to more than ", kMaxInstances, " copies. Export fewer copies."));
    const ModelPart& model = part(reference.part);
    if (model.mm_per_unit != result_.mm_per_unit)
      fail_read(file_, concat("part '", reference.part, "'"),
                "its unit differs from that of the main part. Export the model again.");
    const auto found = model.objects.find(reference.id);
    if (found == model.objects.end())
      fail_read(file_, where, concat("it is used, but not defined in part '", reference.part, "'. Export the model again."));
    const Object& object = found->second;
    if (object.type == "support" || object.type == "solidsupport") {
      ++supports_;
      return;
    }
    if (!object.type.empty() && object.type != "model") mark = {object.type};  // "other" or "surface"
    if (object.infill) mark = {"ParameterModifier", object.infill};
    const Role role = role_of(mark.kind);
    if (role == Role::none || (role == Role::modifier && !mark.infill)) {
      ++left_out_[mark.kind];
      return;
    }
    if (!object.not_only_triangles.empty())
      fail_read(
          file_, where,
          concat("its shape is made of ", object.not_only_triangles,
                 ", which rayrep does not read; its triangles alone are another shape. Export it as plain triangles, or as STL."));
    const Eigen::Affine3d here = parent.place * reference.transform;
    const bool is_root = reference.part == root_;
    const auto volumes = is_root ? marks_.volumes.find(reference.id) : marks_.volumes.end();
    if (volumes != marks_.volumes.end() && !volumes->second.special.empty()) {
      append_volumes(object.mesh, volumes->second, here, where, placed);
    } else if (!object.mesh.triangles.empty()) {
      append_as(mark, object.mesh, here, where, placed);
    }
    for (const Reference& component : object.components) {
      const auto own = is_root ? marks_.marks.find({reference.id, component.id}) : marks_.marks.end();
      append_reference(component, {here, own == marks_.marks.end() ? mark : own->second, parent.depth + 1}, placed);
    }
  }

  void append_as(const SlicerMarks::Mark& mark, const Mesh& mesh, const Eigen::Affine3d& here, const std::string& where,
                 Placed& placed) {
    const Role role = role_of(mark.kind);
    if (role == Role::negative) {
      ++negatives_;
      append_mesh(mesh, here, where, placed.negative);
    } else if (role == Role::modifier) {
      Part& part = result_.modifiers.emplace_back();
      part.role = Part::Role::modifier;
      part.infill = mark.infill;
      append_mesh(mesh, here, where, part.mesh);
    } else {
      ++placed.bodies;
      append_mesh(mesh, here, where, placed.material);
    }
  }

  /// The triangles of an object that PrusaSlicer has marked, each in its role.
  void append_volumes(const Mesh& mesh, const SlicerMarks::Volumes& volumes, const Eigen::Affine3d& here, const std::string& where,
                      Placed& placed) {
    std::vector<bool> taken(mesh.triangles.size());
    for (const auto& range : volumes.special) {
      if (range.first > range.last || range.last >= mesh.triangles.size())
        fail_read(file_, where,
                  concat("the slicer's settings mark its triangles ", range.first, " to ", range.last, " as '", range.mark.kind,
                         "', but it has ", mesh.triangles.size(), ". Export the model again."));
      std::vector<bool> in_range(mesh.triangles.size());
      for (std::size_t t = range.first; t <= range.last; ++t) in_range[t] = taken[t] = true;
      const Role role = role_of(range.mark.kind);
      if (role == Role::negative || (role == Role::modifier && range.mark.infill)) {
        append_as(range.mark, only(mesh, in_range), here, where, placed);
      } else {
        ++left_out_[range.mark.kind];
      }
    }
    taken.flip();
    append_as({}, only(mesh, taken), here, where, placed);
    placed.bodies += volumes.bodies;
  }

  /// The chosen triangles and the vertices they use.
  static Mesh only(const Mesh& mesh, const std::vector<bool>& chosen) {
    Mesh result;
    std::vector<int> number(mesh.vertices.size(), -1);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      if (!chosen[t]) continue;
      Eigen::Vector3i corners = mesh.triangles[t];
      for (int& corner : corners) {
        if (number[corner] < 0) {
          number[corner] = static_cast<int>(result.vertices.size());
          result.vertices.push_back(mesh.vertices[corner]);
        }
        corner = number[corner];
      }
      result.triangles.push_back(corners);
    }
    return result;
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

  void read_mesh(const pugi::xml_node& node, const std::string& where, Mesh& mesh) {
    for (const auto& list : node.children()) {
      const std::string_view name = local_name(list.name());
      if (name != "vertices" && name != "triangles") continue;
      const auto size = static_cast<std::size_t>(std::distance(list.begin(), list.end()));
      const bool is_vertices = name == "vertices";
      budget_.take(size * (is_vertices ? sizeof(Eigen::Vector3d) : sizeof(Eigen::Vector3i)));
      is_vertices ? mesh.vertices.reserve(size) : mesh.triangles.reserve(size);
      for (const auto& entry : list.children()) {
        const std::string_view kind = local_name(entry.name());
        if (is_vertices && kind == "vertex") {
          const std::size_t i = mesh.vertices.size();
          mesh.vertices.emplace_back(coordinate(entry, "x", i, where), coordinate(entry, "y", i, where),
                                     coordinate(entry, "z", i, where));
        } else if (!is_vertices && kind == "triangle") {
          const std::size_t i = mesh.triangles.size();
          const std::size_t vertices = mesh.vertices.size();
          mesh.triangles.emplace_back(corner(entry, "v1", i, vertices, where), corner(entry, "v2", i, vertices, where),
                                      corner(entry, "v3", i, vertices, where));
        }
      }
    }
    if (mesh.vertices.size() > kMaxTriangles || mesh.triangles.size() > kMaxTriangles) fail_too_large(where);
  }

  void append_mesh(const Mesh& source, const Eigen::Affine3d& here, const std::string& where, Mesh& mesh) {
    budget_.take(source.vertices.size() * sizeof(Eigen::Vector3d) + source.triangles.size() * sizeof(Eigen::Vector3i));
    vertices_ += source.vertices.size();
    triangles_ += source.triangles.size();
    if (vertices_ > kMaxTriangles || triangles_ > kMaxTriangles) fail_too_large(where);
    const int first = static_cast<int>(mesh.vertices.size());
    const bool moved = !here.matrix().isIdentity(0);
    for (const auto& p : source.vertices) mesh.vertices.push_back(moved ? Eigen::Vector3d(here * p) : p);
    const bool mirrored = here.linear().determinant() < 0;
    for (Eigen::Vector3i corners : source.triangles) {
      if (mirrored) std::swap(corners[1], corners[2]);
      mesh.triangles.push_back(corners.array() + first);
    }
  }

  [[noreturn]] void fail_too_large(const std::string& where) const {
    fail_read(file_, where,
              concat("with it the build holds more than ", kMaxTriangles,
                     " triangles or vertices. Export fewer copies or a coarser mesh."));
  }

  Archive package_;
  const FileBytes& file_;
  MemoryBudget budget_;
  std::string root_;
  SlicerMarks marks_;
  std::map<std::string, ModelPart> parts_;
  MeshFile result_;
  std::size_t instances_ = 0;
  std::size_t vertices_ = 0;
  std::size_t triangles_ = 0;
  std::size_t supports_ = 0;
  std::size_t negatives_ = 0;
  std::map<std::string, std::size_t> left_out_;  // by what it is marked as
};

/// What a package begins with. @param pictured  it has a thumbnail
std::vector<ArchivePart> first_parts(bool pictured) {
  return {
      {"[Content_Types].xml", concat(R"(<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
 <Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>
 <Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>
 <Default Extension="config" ContentType="text/xml"/>
)",
                                     pictured ? " <Default Extension=\"png\" ContentType=\"image/png\"/>\n" : "", "</Types>\n")},
      {"_rels/.rels", concat(R"(<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
 <Relationship Target="/)",
                             kDefaultModel, R"(" Id="rel-1" Type=")", kModelRelationship, "\"/>\n",
                             pictured ? concat(" <Relationship Target=\"/", kThumbnail, "\" Id=\"rel-2\" Type=\"",
                                               kThumbnailRelationship, "\"/>\n")
                                      : std::string(),
                             "</Relationships>\n")}};
}

/// A mesh of the object that is written, and how it is filled if it is a modifier.
struct Volume {
  const Mesh* mesh;
  const SparseInfill* infill = nullptr;
};

/// What is said of an object besides its mesh: nothing of what is empty.
struct ObjectWords {
  std::string name;
  std::string part_number = {};
  std::string type = "model";
};

/// Volumes as the one mesh of an object.
void append_object(std::string& xml, std::size_t id, std::span<const Volume> volumes, const ObjectWords& words) {
  xml +=
      concat("  <object id=\"", id, "\" type=\"", words.type, "\"", words.name.empty() ? "" : concat(" name=\"", words.name, "\""),
             words.part_number.empty() ? "" : concat(" partnumber=\"", words.part_number, "\""), ">\n   <mesh>\n    <vertices>\n");
  for (const Volume& volume : volumes)
    for (const auto& p : volume.mesh->vertices) {
      append_number(xml += "     <vertex x=\"", p.x());
      append_number(xml += "\" y=\"", p.y());
      append_number(xml += "\" z=\"", p.z());
      xml += "\"/>\n";
    }
  xml += "    </vertices>\n    <triangles>\n";
  long long before = 0;
  for (const Volume& volume : volumes) {
    for (const auto& t : volume.mesh->triangles) {
      append_number(xml += "     <triangle v1=\"", before + t[0]);
      append_number(xml += "\" v2=\"", before + t[1]);
      append_number(xml += "\" v3=\"", before + t[2]);
      xml += "\"/>\n";
    }
    before += static_cast<long long>(volume.mesh->vertices.size());
  }
  xml += "    </triangles>\n   </mesh>\n  </object>\n";
}

std::string volume_name(const Volume& volume) {
  if (volume.infill == nullptr) return "body";
  std::string name = kSparseName;
  append_number(name, volume.infill->percent);
  return name + " " + volume.infill->pattern;
}

/// How the volumes are told apart.
enum class Layout {
  one_object,  ///< by triangles
  components,  ///< each is an object, and one more has them as components
  named,       ///< likewise, by their names
};

constexpr const char* kModelStart = R"(<?xml version="1.0" encoding="UTF-8"?>
<model unit="millimeter" xml:lang="en-US" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02" xmlns:slic3rpe="http://schemas.slic3r.org/3mf/2017/06">
 <metadata name="slic3rpe:Version3mf">1</metadata>
 <metadata name="Application">rayrep</metadata>
 <resources>
)";

std::string model_xml(std::span<const Volume> volumes, Layout layout) {
  std::string xml = kModelStart;
  std::size_t id = 1;
  if (layout != Layout::one_object) {
    std::string components;
    for (const Volume& volume : volumes) {
      components += concat("    <component objectid=\"", id, "\"/>\n");
      append_object(xml, id++, {&volume, 1}, {layout == Layout::named ? volume_name(volume) : ""});
    }
    xml += concat("  <object id=\"", id, "\" type=\"model\">\n   <components>\n", components, "   </components>\n  </object>\n");
  } else {
    append_object(xml, id, volumes, {""});
  }
  return xml += concat(" </resources>\n <build>\n  <item objectid=\"", id, "\"/>\n </build>\n</model>\n");
}

/// As 3MF has it: the images of the axes and of the origin.
std::string transform_text(const Eigen::Affine3d& transform) {
  std::string text;
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 3; ++column) append_number(text += text.empty() ? "" : " ", transform.matrix()(column, row));
  return text;
}

std::vector<const Part*> parts_in(const Delivery& delivery, Part::Role role) {
  std::vector<const Part*> all;
  for (const Part& part : delivery.parts)
    if (part.role == role) all.push_back(&part);
  return all;
}

/// Adds plugs as objects of their own, where they are in the body, each with the way to its place on the bed.
void add_plugs(std::span<const Part* const> plugs, std::size_t first_id, std::string& xml) {
  std::string objects;
  std::string items;
  for (std::size_t n = 0; n < plugs.size(); ++n) {
    const Volume volume{&plugs[n]->mesh};
    append_object(objects, first_id + n, {&volume, 1}, {concat("plug ", n + 1), kPlugNumber});
    items += concat("  <item objectid=\"", first_id + n, "\" transform=\"", transform_text(plugs[n]->to_bed), "\"/>\n");
  }
  xml.insert(xml.find(" </resources>"), objects);
  xml.insert(xml.rfind(" </build>"), items);
}

/// Pieces as objects in the places that they have in the whole, each with the way to its place on the bed; after them what is put
/// in, which is not built.
std::string pieces_xml(const Delivery& delivery) {
  std::string xml = kModelStart;
  std::string items;
  std::size_t id = 1;
  for (const Part* piece : parts_in(delivery, Part::Role::body)) {
    const Volume volume{&piece->mesh};
    items += concat("  <item objectid=\"", id, "\" transform=\"", transform_text(piece->to_bed), "\"/>\n");
    append_object(xml, id++, {&volume, 1}, {piece->name, kPieceNumber});
  }
  for (const Part* insert : parts_in(delivery, Part::Role::insert)) {
    const Volume volume{&insert->mesh};
    std::string number = kInsertNumber;
    append_number(number, insert->density_g_cm3);
    append_object(xml, id++, {&volume, 1}, {"not printed", number, "other"});
  }
  return xml += concat(" </resources>\n <build>\n", items, " </build>\n</model>\n");
}

/// The settings of a volume, a line each that begins with `start`.
std::string infill_settings(const std::string& start, const SparseInfill* infill, const InfillKeys& keys) {
  std::string xml;
  if (infill == nullptr) return xml;
  const auto set = [&](const char* key, std::string_view value) {
    xml += concat(start, "key=\"", key, "\" value=\"", value, "\"/>\n");
  };
  std::string percent;
  append_number(percent, infill->percent);
  set(keys.density, percent + "%");
  if (!infill->pattern.empty()) set(keys.pattern, infill->pattern);
  for (const char* key : keys.none) set(key, "0");
  return xml;
}

/// PrusaSlicer's own part: without 100 % infill the user's profile makes a hollow body heavier than a solid one, and automatic
/// supports fill its cavity unless they must start on the build plate.
std::string prusa_object_xml(std::size_t id, std::string_view name, std::span<const Volume> volumes) {
  std::string xml =
      concat(" <object id=\"", id, "\" instances_count=\"1\">\n  <metadata type=\"object\" key=\"name\" value=\"", name,
             R"("/>
  <metadata type="object" key="fill_density" value="100%"/>
  <metadata type="object" key="fill_pattern" value="rectilinear"/>
  <metadata type="object" key="support_material_buildplate_only" value="1"/>
)");
  const std::string start = "   <metadata type=\"volume\" ";
  std::size_t first = 0;
  for (const Volume& volume : volumes) {
    const std::size_t next = first + volume.mesh->triangles.size();
    const bool sparse = volume.infill != nullptr;
    xml += concat("  <volume firstid=\"", first, "\" lastid=\"", next - 1, "\">\n",                             //
                  start, "key=\"name\" value=\"", sparse ? "sparse" : "body", "\"/>\n",                         //
                  start, "key=\"volume_type\" value=\"", sparse ? "ParameterModifier" : "ModelPart", "\"/>\n",  //
                  start, "key=\"matrix\" value=\"1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\"/>\n",                        //
                  sparse ? start + "key=\"modifier\" value=\"1\"/>\n" : std::string(),                          //
                  infill_settings(start, volume.infill, kPrusaKeys), "  </volume>\n");
    first = next;
  }
  return xml += " </object>\n";
}

/// The same for Bambu Studio and OrcaSlicer. @param id  of the first part
std::string bambu_object_xml(std::size_t object, std::size_t id, std::string_view name, std::span<const Volume> volumes) {
  std::string xml = concat(" <object id=\"", object, "\">\n  <metadata key=\"name\" value=\"", name, R"("/>
  <metadata key="sparse_infill_density" value="100%"/>
  <metadata key="support_on_build_plate_only" value="1"/>
)");
  const std::string start = "   <metadata ";
  for (const Volume& volume : volumes) {
    const bool sparse = volume.infill != nullptr;
    xml += concat("  <part id=\"", id++, "\" subtype=\"", sparse ? "modifier_part" : "normal_part", "\">\n",  //
                  start, "key=\"name\" value=\"", sparse ? "sparse" : "body", "\"/>\n",                       //
                  start, "key=\"matrix\" value=\"1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\"/>\n",                      //
                  infill_settings(start, volume.infill, kBambuKeys), "  </part>\n");
  }
  return xml += " </object>\n";
}

std::string config_xml(const std::string& objects) {
  return concat("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<config>\n", objects, "</config>\n");
}

/// Where PrusaSlicer pauses the print.
std::string prusa_pauses_xml(std::span<const double> heights_mm) {
  std::string xml = "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<custom_gcodes_per_print_z>\n";
  for (const double z : heights_mm)
    xml += concat(" <code print_z=\"", z,
                  "\" type=\"1\" extruder=\"1\" color=\"\" extra=\"Put in what belongs in the pockets\" "
                  "gcode=\"M601\"/>\n");
  return xml += " <mode value=\"SingleExtruder\"/>\n</custom_gcodes_per_print_z>\n";
}

}  // namespace

bool is_3mf(std::string_view bytes) { return bytes.starts_with("PK\x03\x04"); }

MeshFile read_3mf(const FileBytes& file, const ReadOptions& options) { return ModelReader(file, options).read(); }

std::string encode_3mf(const Mesh& mesh, const std::string& thumbnail_png) {
  const Volume body{&mesh};
  std::vector<ArchivePart> entries = first_parts(!thumbnail_png.empty());
  entries.push_back({kDefaultModel, model_xml({&body, 1}, Layout::one_object)});
  entries.push_back({kPrusaConfig, config_xml(prusa_object_xml(1, "body", {&body, 1}))});
  entries.push_back({kBambuConfig, config_xml(bambu_object_xml(1, 1, "body", {&body, 1}))});
  if (!thumbnail_png.empty()) entries.push_back({kThumbnail, thumbnail_png});
  return pack(entries);
}

std::string encode_3mf(const Mesh& mesh) { return encode_3mf(mesh, std::string()); }

namespace {

std::string encode_pieces(const Delivery& delivery) {
  std::vector<ArchivePart> entries = first_parts(!delivery.thumbnail_png.empty());
  entries.push_back({kDefaultModel, pieces_xml(delivery)});
  std::string prusa;
  std::string bambu;
  std::size_t id = 1;
  for (const Part* piece : parts_in(delivery, Part::Role::body)) {
    const Volume volume{&piece->mesh};
    prusa += prusa_object_xml(id, piece->name, {&volume, 1});
    bambu += bambu_object_xml(id, id, piece->name, {&volume, 1});
    ++id;
  }
  entries.push_back({kPrusaConfig, config_xml(prusa)});
  entries.push_back({kBambuConfig, config_xml(bambu)});
  if (!delivery.thumbnail_png.empty()) entries.push_back({kThumbnail, delivery.thumbnail_png});
  return pack(entries);
}

}  // namespace

std::string encode_3mf(const Delivery& delivery, ThreeMfFlavor flavor) {
  if (in_pieces(delivery)) return encode_pieces(delivery);
  const Mesh body = delivery.body();
  std::vector<Volume> volumes = {{&body}};
  for (const Part& part : delivery.parts)
    if (part.infill) volumes.push_back({&part.mesh, &*part.infill});
  const bool prusa = flavor == ThreeMfFlavor::prusa;
  const Layout layout = prusa ? Layout::one_object : flavor == ThreeMfFlavor::bambu ? Layout::components : Layout::named;
  std::vector<ArchivePart> entries = first_parts(!delivery.thumbnail_png.empty());
  const std::vector<const Part*> plugs = parts_in(delivery, Part::Role::plug);
  const std::size_t body_id = layout == Layout::one_object ? 1 : volumes.size() + 1;
  std::string model = model_xml(volumes, layout);
  add_plugs(plugs, body_id + 1, model);
  entries.push_back({kDefaultModel, std::move(model)});
  std::string prusa_objects = prusa_object_xml(1, "body", volumes);
  std::string bambu_objects = bambu_object_xml(body_id, 1, "body", volumes);
  for (std::size_t n = 0; n < plugs.size(); ++n) {
    const Volume volume{&plugs[n]->mesh};
    const std::size_t id = body_id + 1 + n;
    prusa_objects += prusa_object_xml(id, concat("plug ", n + 1), {&volume, 1});
    bambu_objects += bambu_object_xml(id, id, concat("plug ", n + 1), {&volume, 1});
  }
  if (prusa) entries.push_back({kPrusaConfig, config_xml(prusa_objects)});
  if (layout == Layout::components || !plugs.empty()) entries.push_back({kBambuConfig, config_xml(bambu_objects)});
  if (prusa && !delivery.pauses_mm.empty()) entries.push_back({kPrusaPauses, prusa_pauses_xml(delivery.pauses_mm)});
  if (!delivery.thumbnail_png.empty()) entries.push_back({kThumbnail, delivery.thumbnail_png});
  return pack(entries);
}

}  // namespace rayrep::detail
