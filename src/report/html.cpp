#include "rayrep/report/html.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <variant>

#include "base/text.h"
#include "rayrep/base/error.h"
#include "rayrep/physics/moments.h"
#include "rayrep/report/page_data.h"
#include "report/packed_mesh.h"
#include "report/page.h"
#include "report/words.h"

// What the page is given is written down in tools/report/README.md.

namespace rayrep {
namespace {

using namespace report_detail;
using Json = nlohmann::ordered_json;

constexpr std::size_t kMostOutside = 2'000'000;  ///< triangles of the outer surface that are shown
constexpr std::size_t kMostInside = 300'000;     ///< and of all else

Json vector(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

/// JSON of one line, whatever names of files hold.
std::string dumped(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

/// JSON in which nothing ends a script or opens a comment, nor a line where JSON allows that and scripts do not.
std::string for_script(const std::string& text) {
  std::string safe;
  safe.reserve(text.size());
  for (std::size_t n = 0; n < text.size(); ++n) {
    const char c = text[n];
    if (c == '<' || c == '>' || c == '&') {
      safe += c == '<' ? "\\u003c" : c == '>' ? "\\u003e" : "\\u0026";
    } else if (text.compare(n, 3, "\xE2\x80\xA8") == 0 || text.compare(n, 3, "\xE2\x80\xA9") == 0) {
      safe += text[n + 2] == '\xA8' ? "\\u2028" : "\\u2029";
      n += 2;
    } else {
      safe += c;
    }
  }
  return safe;
}

/// Text as HTML; what is no UTF-8 and control characters but the ends of lines are replaced.
std::string for_html(const std::string& text) {
  const std::string valid = Json::parse(dumped(text)).get<std::string>();
  std::string safe;
  for (const char c : valid) {
    if (c == '<' || c == '>' || c == '&' || c == '"' || c == '\'')
      safe += concat("&#", static_cast<int>(c), ";");
    else
      safe += static_cast<unsigned char>(c) < 0x20 && c != '\n' ? ' ' : c;
  }
  return safe;
}

// ------------------------------------------------------------------------------------------------------------------------ bodies

/// One thing of the view.
struct Shown {
  const char* what;   ///< "shell", "cavity", "sparse", "insert" or "plug"
  std::string words;  ///< of an insert its density, of what is sparse its infill
  Mesh mesh;          ///< vertices merged
};

Mesh part_of(const Mesh& mesh, const std::vector<bool>& of_it) {
  Mesh part{mesh.vertices, {}};
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (of_it[t]) part.triangles.push_back(mesh.triangles[t]);
  return part;
}

/// A body's outside, and the shells in it that face inward.
void add_body(const Mesh& given, std::vector<Shown>& all) {
  const Mesh mesh = with_merged_vertices(given);
  const Components components = connected_components(mesh);
  std::vector<double> volume_mm3;
  for (const Mesh& component : split(mesh, components)) volume_mm3.push_back(mesh_moments(component)[M1]);
  std::vector<bool> outside(mesh.triangles.size());
  for (std::size_t t = 0; t < outside.size(); ++t)
    outside[t] = volume_mm3[static_cast<std::size_t>(components.of_triangle[t])] >= 0;
  all.push_back({"shell", "", part_of(mesh, outside)});
  outside.flip();
  if (std::find(outside.begin(), outside.end(), true) != outside.end()) all.push_back({"cavity", "", part_of(mesh, outside)});
}

std::vector<Shown> bodies_of(const Delivery& delivery) {
  std::vector<Shown> all;
  add_body(delivery.body(), all);
  for (const Part& part : delivery.parts) {
    if (part.role == Part::Role::body) continue;
    const Mesh mesh = with_merged_vertices(part.mesh);
    if (part.infill)
      all.push_back({"sparse",
                     concat(part.infill->percent, " % infill", part.infill->pattern.empty() ? "" : ", ", part.infill->pattern),
                     mesh});
    else if (part.role == Part::Role::insert)
      all.push_back({"insert", concat(part.density_g_cm3, " g/cm3"), mesh});
    else if (part.role == Part::Role::plug)
      all.push_back({"plug", "", mesh});
  }
  return all;
}

Eigen::AlignedBox3d box_of(const std::vector<Shown>& bodies) {
  Eigen::AlignedBox3d box;
  for (const Shown& body : bodies)
    for (const Eigen::Vector3i& t : body.mesh.triangles)
      for (int k = 0; k < 3; ++k) box.extend(body.mesh.vertices[static_cast<std::size_t>(t[k])]);
  if (box.isEmpty()) box.extend(Eigen::Vector3d::Zero());
  return box;
}

/// As blocks of the page, and what the view is told of each.
struct Blocks {
  std::vector<std::pair<std::string, std::string>> packed;  ///< by their ids
  Json meshes = Json::array();
};

Blocks blocks_of(const std::vector<Shown>& bodies, const Eigen::AlignedBox3d& box) {
  std::size_t inside = 0;
  for (std::size_t n = 1; n < bodies.size(); ++n) inside += bodies[n].mesh.triangles.size();
  const double share = std::min(1.0, static_cast<double>(kMostInside) / static_cast<double>(std::max<std::size_t>(inside, 1)));
  Blocks blocks;
  for (std::size_t n = 0; n < bodies.size(); ++n) {
    const auto& [what, words, mesh] = bodies[n];
    const auto most = static_cast<std::size_t>(share * static_cast<double>(mesh.triangles.size()));
    const Mesh shown = coarsened(mesh, n == 0 ? kMostOutside : std::max<std::size_t>(most, 1000));
    const std::string id = concat("rayrep-mesh-", n);
    blocks.meshes.push_back({{"id", id},
                             {"what", what},
                             {"words", words},
                             {"triangles", mesh.triangles.size()},
                             {"shown", shown.triangles.size()},
                             {"closed", is_closed(mesh)}});
    blocks.packed.emplace_back(id, base64(packed(shown, box)));
  }
  return blocks;
}

// --------------------------------------------------------------------------------------------------------------------- attitudes

const Figure* named(const Figures& figures, const std::string& name) {
  const auto found = std::find_if(figures.begin(), figures.end(), [&](const Figure& f) { return f.name == name; });
  return found == figures.end() ? nullptr : &*found;
}

std::optional<Eigen::Vector3d> point_in(const Figures& figures, const std::string& name) {
  const Figure* figure = named(figures, name);
  const auto* list = figure ? std::get_if<std::vector<double>>(&figure->value) : nullptr;
  if (!list || list->size() != 3) return std::nullopt;
  return Eigen::Vector3d((*list)[0], (*list)[1], (*list)[2]);
}

std::optional<double> number_in(const Record& record, const std::string& name) {
  for (const auto& [key, value] : record)
    if (const auto* number = std::get_if<double>(&value); number && key == name) return *number;
  return std::nullopt;
}

std::string text_in(const Record& record, const std::string& name) {
  for (const auto& [key, value] : record)
    if (const auto* text = std::get_if<std::string>(&value); text && key == name) return *text;
  return {};
}

/// How a body is placed in the world.
struct Attitude {
  std::string kind;    ///< "floats", "spins", "stands", "hangs", "rights itself"; empty: none of these
  std::string words;   ///< of a pose
  std::string prefix;  ///< of its figures' names
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  std::optional<Eigen::Vector3d> point_mm = {};
  std::optional<double> waterline_mm = {};  ///< above the lowest point
};

Json json_of(const Attitude& attitude, const Mesh& body) {
  const Eigen::Vector3d up = attitude.up.normalized();
  double lowest = std::numeric_limits<double>::infinity();
  double highest = -lowest;
  for (const Eigen::Vector3i& t : body.triangles)
    for (int k = 0; k < 3; ++k) {
      const double height = up.dot(body.vertices[static_cast<std::size_t>(t[k])]);
      lowest = std::min(lowest, height);
      highest = std::max(highest, height);
    }
  const Eigen::Matrix3d to_ground = up_to_z(attitude.up);
  Json json = {{"kind", attitude.kind},
               {"words", attitude.words},
               {"prefix", attitude.prefix},
               {"up", vector(up)},
               {"to_ground", {vector(to_ground.row(0)), vector(to_ground.row(1)), vector(to_ground.row(2))}},
               {"lowest_mm", body.triangles.empty() ? Json(nullptr) : Json(lowest)},
               {"highest_mm", body.triangles.empty() ? Json(nullptr) : Json(highest)}};
  if (attitude.point_mm) json["point_mm"] = vector(*attitude.point_mm);
  if (attitude.waterline_mm) json["waterline_mm"] = *attitude.waterline_mm;
  return json;
}

Attitude attitude_of(const Record& pose, std::size_t number) {
  Attitude attitude{text_in(pose, "kind"), text_in(pose, "words"), concat("pose_", number, "_")};
  attitude.up = {number_in(pose, "up_x").value_or(0), number_in(pose, "up_y").value_or(0), number_in(pose, "up_z").value_or(1)};
  attitude.waterline_mm = number_in(pose, "waterline_mm");
  if (const auto x = number_in(pose, "point_x_mm"))
    attitude.point_mm = {*x, number_in(pose, "point_y_mm").value_or(0), number_in(pose, "point_z_mm").value_or(0)};
  return attitude;
}

std::vector<Attitude> attitudes_of(const Verdict& verdict) {
  const Figures& wanted = verdict.wanted;
  std::vector<Attitude> all;
  if (const Figure* poses = named(wanted, "poses"))
    if (const auto* records = std::get_if<std::vector<Record>>(&poses->value))
      for (const Record& pose : *records) all.push_back(attitude_of(pose, all.size() + 1));
  if (!all.empty()) return all;
  Attitude attitude{verdict.goal == FloatSpec::kGoal                             ? "floats"
                    : verdict.goal == StandSpec::kGoal                           ? "stands"
                    : verdict.goal == SpinSpec::kGoal || verdict.goal == "yo-yo" ? "spins"
                                                                                 : "",
                    "", ""};
  attitude.up = point_in(wanted, "up").value_or(point_in(wanted, "axis").value_or(Eigen::Vector3d::UnitZ()));
  attitude.point_mm = point_in(wanted, "contact_mm");
  if (!attitude.point_mm) attitude.point_mm = point_in(wanted, "centre_mm");
  if (const Figure* waterline = named(wanted, "waterline_mm"))
    if (const auto* height = std::get_if<double>(&waterline->value)) attitude.waterline_mm = *height;
  return {attitude};
}

// --------------------------------------------------------------------------------------------------------------------------- told

Json json_of(const Rows& rows) {
  Json json = {{"table", Json::array()}, {"lines", Json::array()}};
  for (const Row& row : rows.table) json["table"].push_back({row.words, row.before, row.after});
  for (const Row& row : rows.lines) json["lines"].push_back({row.words, row.after});
  return json;
}

Json criteria_of(const Verdict& verdict) {
  Json criteria = Json::array();
  for (const Criterion& c : verdict.criteria)
    criteria.push_back({{"name", c.name},
                        {"words", words_of(c)},
                        {"value", value_text(c, c.value)},
                        {"bound", c.kind == Criterion::Kind::at_most ? "at most" : "at least"},
                        {"limit", value_text(c, c.limit)},
                        {"pass", c.pass()}});
  return criteria;
}

Json told_of(const RunReport& report) {
  const Verdict& verdict = report.after;
  Json told = {{"meaning", verdict.meaning}, {"asked", verdict.headline}, {"changed", report.changed}};
  if (report.outside) told["outside"] = report.outside->note;
  if (report.print) told["printed"] = heading_text(*report.print);
  told["figures"] = json_of(rows_of(report.hollow ? &report.before : nullptr, verdict.figures));
  told["criteria"] = criteria_of(verdict);
  std::vector<std::string> notes = verdict.notes;
  if (report.hollow) {
    const std::vector<std::string> more = notes_of(report);
    notes.insert(notes.end(), more.begin(), more.end());
    told["proof"] = proof_of(*report.hollow, false);
  }
  told["notes"] = notes;
  // Of what was not written nobody is told how to print it.
  told["print"] = verdict.pass() ? printing_text(report) : "";
  return told;
}

Json told_of(const Inspection& inspection) {
  const MeshReport& check = inspection.input.check;
  return {{"meaning", check.usable ? std::vector<std::string>{} : std::vector<std::string>{check.refusal}},
          {"figures", json_of(rows_of(inspection))},
          {"criteria", Json::array()},
          {"notes", Json::array()},
          {"print", ""}};
}

// --------------------------------------------------------------------------------------------------------------------------- page

constexpr std::string_view kDataBlock = "<script type=\"application/json\" id=\"rayrep-data\">";
constexpr std::string_view kMeshBlock = "<script type=\"application/octet-stream\" id=\"";
constexpr std::string_view kLiveBlock = "<script type=\"application/json\" id=\"rayrep-studio\">";
constexpr std::string_view kBlockEnd = "</script>\n";

/// The data of a page with its view, but for marks.
PageData with_view(Json data, const Delivery& delivered, const std::vector<Attitude>& attitudes) {
  const std::vector<Shown> bodies = bodies_of(delivered);
  const Eigen::AlignedBox3d box = box_of(bodies);
  Blocks blocks = blocks_of(bodies, box);
  Json& view = data["view"];
  view["low_mm"] = vector(box.min());
  view["size_mm"] = vector(box.sizes());
  view["rounding_mm"] = rounding_mm(box);
  view["meshes"] = std::move(blocks.meshes);
  view["attitudes"] = Json::array();
  for (const Attitude& attitude : attitudes) view["attitudes"].push_back(json_of(attitude, bodies.front().mesh));
  return {dumped(data), std::move(blocks.packed)};
}

/// What stands in the page's places, each once and in this order: what is put in is not looked at again.
std::string filled_in(std::string_view rest, const std::string& title, const std::string& plain_text, const std::string& data) {
  std::string html;
  for (const auto& [place, text] :
       {std::pair(kTitle, for_html(title)), std::pair(kPlainText, for_html(plain_text)), std::pair(kData, data)}) {
    const std::size_t at = rest.find(place);
    assert(at != std::string_view::npos);
    html.append(rest.substr(0, at)).append(text);
    rest.remove_prefix(at + place.size());
  }
  return html.append(rest);
}

/// What stands between these, from `at` on, which is moved behind it; none: they are not there.
std::optional<std::string> between(const std::string& text, std::string_view begin, std::string_view end, std::size_t& at) {
  const std::size_t first = text.find(begin, at);
  if (first == std::string::npos) return std::nullopt;
  const std::size_t last = text.find(end, first + begin.size());
  if (last == std::string::npos) return std::nullopt;
  at = last + end.size();
  return text.substr(first + begin.size(), last - first - begin.size());
}

std::string name_of_judged(const RunReport& report) {
  return !report.output.empty() ? report.output : report.print ? report.print->path : report.input.path;
}

const char* unit_word(Unit unit) {
  static constexpr const char* kWords[] = {"", "mm", "mm2", "mm3", "mm4", "g", "g/cm3", "g mm2", "rad", "rpm"};
  return kWords[static_cast<std::size_t>(unit)];
}

}  // namespace

std::string report_detail::written(const std::string& title, const std::string& plain_text, const PageData& data) {
  std::string blocks = concat(kDataBlock, for_script(data.json), kBlockEnd);
  for (const auto& [id, packed] : data.meshes) blocks += concat(kMeshBlock, id, "\">", packed, kBlockEnd);
  return filled_in(report_detail::page(), title, plain_text, blocks);
}

PageData page_data(const RunReport& report, const Delivery& delivered) {
  return with_view({{"contract", 1},
                    {"title", name_of_judged(report)},
                    {"report", Json::parse(to_json(report))},
                    {"told", told_of(report)},
                    {"view", Json::object()}},
                   delivered, attitudes_of(report.after));
}

PageData page_data(const Inspection& inspection, const Delivery& inspected) {
  Json marks = Json::array();
  const MeshReport& check = inspection.input.check;
  // Places are told in the file's own numbers, which the reader of 3MF has brought to mm.
  const double factor = inspection.input.scale * (inspection.input.format == "3MF" ? 1 : inspection.input.mm_per_unit);
  // What was mended is not there any more.
  const auto mark = [&](const char* words, const Defect& defect, bool still_there) {
    if (defect && still_there)
      marks.push_back({{"words", words}, {"count", defect.count}, {"at_mm", vector(factor * defect.first_mm)}});
  };
  mark("open edge", check.open_edges, !check.usable);
  mark("non-manifold edge", check.non_manifold_edges, !check.usable);
  mark("self-intersection", check.self_intersections, true);
  return with_view({{"contract", 1},
                    {"title", inspection.input.path},
                    {"report", Json::parse(to_json(inspection))},
                    {"told", told_of(inspection)},
                    {"view", {{"marks", marks}}}},
                   inspected, {Attitude{}});
}

PageData page_data(const std::string& page) {
  std::size_t at = 0;
  const std::optional<std::string> data = between(page, kDataBlock, kBlockEnd, at);
  if (!data) throw Error(ErrorCode::input, "This is no page that rayrep has written.");
  PageData result{*data, {}};
  while (auto block = between(page, kMeshBlock, kBlockEnd, at)) {
    const std::size_t id = block->find("\">");
    if (id != std::string::npos) result.meshes.emplace_back(block->substr(0, id), block->substr(id + 2));
  }
  return result;
}

std::string page_json(const Verdict& verdict, const Mesh& body) {
  RunReport report;
  report.after = verdict;
  const Json after = Json::parse(to_json(report)).at("after");
  Json figures = Json::array();
  for (const Figure& figure : verdict.figures) {
    const Json& value = after.at(figure.name);
    const bool numbers = value.is_array() && std::all_of(value.begin(), value.end(), [](const Json& v) { return v.is_number(); });
    if (value.is_number() || value.is_null() || numbers)
      figures.push_back({figure.words, unit_word(figure.unit), value, figure.name});
  }
  Json json = {{"told", verdict.meaning},
               {"figures", std::move(figures)},
               {"rows", json_of(rows_of(nullptr, verdict.figures))},
               {"criteria", criteria_of(verdict)},
               {"after", after},
               {"attitudes", Json::array()}};
  for (const Attitude& attitude : attitudes_of(verdict)) json["attitudes"].push_back(json_of(attitude, body));
  return dumped(json);
}

LivePage live_page(const std::string& json) {
  constexpr std::string_view kPolicy = "<meta http-equiv=\"Content-Security-Policy\" content=\"";
  const std::string_view page = report_detail::page();
  const std::size_t begin = page.find(kPolicy);
  const std::size_t end = page.find("\">\n", begin);
  assert(begin != std::string_view::npos && end != std::string_view::npos);
  const std::string policy(page.substr(begin + kPolicy.size(), end - begin - kPolicy.size()));
  const std::string without = concat(page.substr(0, begin), page.substr(end + 3));
  return {filled_in(without, "rayrep studio", "", concat(kLiveBlock, for_script(json), kBlockEnd)), policy};
}

std::string to_html(const RunReport& report, const Delivery& delivered) {
  return written(concat(name_of_judged(report), ": ", report.after.goal), to_text(report, false), page_data(report, delivered));
}

std::string to_html(const Inspection& inspection, const Delivery& inspected) {
  return written(inspection.input.path, to_text(inspection), page_data(inspection, inspected));
}

}  // namespace rayrep
