#include "options.h"

#include <algorithm>
#include <array>
#include <boost/program_options.hpp>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <map>
#include <set>

#include "rayrep/base/error.h"
#include "rayrep/mesh/mesh_check.h"
#include "rayrep/physics/axle.h"
#include "rayrep/report/report.h"
#include "spec_file.h"

namespace po = boost::program_options;

namespace rayrep::tool {
namespace {

using For = Setting::For;

[[noreturn]] void usage_error(const std::string& message) { throw Error(ErrorCode::usage, message); }

/// What a body can be for, as it is named on the command line.
struct Goal {
  std::string word;
  Spec spec;
  bool has_command;       ///< hollows, too; a yo-yo is an option of spin
  int resolution;         ///< that is usual for it
  std::string not_asked;  ///< by a judge of this goal, though another goal of the same spec asks for it
};

template <std::size_t... N>
std::vector<Goal> goals_of_specs(std::index_sequence<N...>) {
  return {Goal{std::variant_alternative_t<N, Spec>::kGoal, std::variant_alternative_t<N, Spec>{}, true,
               std::variant_alternative_t<N, Spec>::kUsualResolution, ""}...};
}

/// Each spec's own, and yo-yos, which share theirs with tops.
const std::vector<Goal>& goals() {
  static const std::vector<Goal> table = [] {
    std::vector<Goal> all = goals_of_specs(std::make_index_sequence<std::variant_size_v<Spec>>());
    const auto top = std::find_if(all.begin(), all.end(), [](const Goal& g) { return g.word == SpinSpec::kGoal; });
    top->not_asked = "center";
    Goal yoyo = *top;
    yoyo.word = "yoyo";
    std::get<SpinSpec>(yoyo.spec).yoyo = true;
    yoyo.has_command = false;
    yoyo.not_asked = "point";
    all.insert(top + 1, yoyo);
    return all;
  }();
  return table;
}

std::string goal_words() {
  std::string words;
  for (std::size_t n = 0; n < goals().size(); ++n)
    words += (n == 0 ? "" : n + 1 < goals().size() ? ", " : " or ") + goals()[n].word;
  return words;
}

/// @throws Error{usage} with the goals there are
const Goal& goal_named(const std::string& word) {
  for (const Goal& goal : goals())
    if (word == goal.word) return goal;
  usage_error("--goal is " + goal_words() + "; it is '" + word + "'.");
}

// ------------------------------------------------------------------------------------------------------------- the command's rows

TextPlace path_place(std::filesystem::path& path) {
  return {[&path](const std::string& text) { path = text; }, [&path] { return path.empty() ? "none" : path.string(); }};
}

/// 1 to 1024, or what 0 means.
TextPlace count_place(const char* name, int& count, const char* none) {
  return {
      [name, &count](const std::string& text) {
        Setting row{
            .name = name, .value = "N", .words = "", .details = "", .place = &count, .range = {.lo = 1, .hi = 1024, .open = false}};
        parse(row, text);
        check({row});
      },
      [&count, none] { return count ? std::to_string(count) : std::string(none); }};
}

/// "2GB", "500 MB": powers of ten, as memory_words tells them.
std::size_t parse_memory(const std::string& name, const std::string& text) {
  const std::size_t end = text.find_last_of("0123456789.") + 1;  // 0: there is no digit
  std::size_t begin = end;
  while (begin < text.size() && text[begin] == ' ') ++begin;
  std::string unit = text.substr(begin);
  std::transform(unit.begin(), unit.end(), unit.begin(), [](unsigned char c) { return std::tolower(c); });
  static const std::map<std::string, double> kUnits = {{"kb", 1e3}, {"k", 1e3}, {"mb", 1e6},  {"m", 1e6},
                                                       {"gb", 1e9}, {"g", 1e9}, {"tb", 1e12}, {"t", 1e12}};
  const auto found = kUnits.find(unit);
  if (found == kUnits.end())
    usage_error("--" + name + " takes a number with its unit, such as 500MB or 4GB; it is '" + text + "'.");
  const double bytes = found->second * parse_number(name, text.substr(0, end));
  if (!(bytes >= 1e6 && bytes <= 1e15)) usage_error("--" + name + " must lie between 1MB and 1000TB; it is '" + text + "'.");
  return static_cast<std::size_t>(bytes);
}

std::string memory_words(std::size_t bytes) {
  const bool giga = bytes >= 1'000'000'000;
  char text[32];
  std::snprintf(text, sizeof text, "%.15g%s", static_cast<double>(bytes) / (giga ? 1e9 : 1e6), giga ? "GB" : "MB");
  return text;
}

Settings mesh_rows(Options& options) {
  static constexpr std::array<const char*, 4> kUnits = {"mm", "cm", "m", "in"};
  return {
      {.name = "unit",
       .value = "UNIT",
       .words = "of the file: mm, cm, m, in (a 3MF has its own)",
       .details = "",
       .place = TextPlace{[&options](const std::string& text) { options.unit = parse_length_unit(text); },
                          [&options] { return std::string(kUnits[static_cast<std::size_t>(options.unit)]); }}},
      {.name = "size",
       .value = "MM",
       .words = "scale so that the longest side is MM",
       .details = "",
       .place = &options.size_mm,
       .range = {.lo = kSmallestBody_mm, .hi = kLargestBody_mm, .open = false},
       .unset = "as it is"},
      {.name = "memory",
       .value = "SIZE",
       .words = "take at most SIZE to read a mesh, as 500MB",
       .details =
           "Bounds the file, and what a 3MF file unpacks to with what is made of it. Others take up to five times their size.",
       .place = TextPlace{[&options](const std::string& text) { options.memory_bytes = parse_memory("memory", text); },
                          [&options] { return memory_words(options.memory_bytes); }},
       .rare = true},
      {.name = "repair",
       .value = "",
       .words = "close all holes of the surface, by a guess",
       .details =
           "What can be mended without a guess always is, and told: corners that are equal but for the last digits, T-junctions, "
           "stray triangles, internal walls, flat and small holes. With --repair bent holes are closed too, by small "
           "surfaces; how much of the surface and of the volume that changes is told.",
       .place = &options.repair},
      {.name = "rigid",
       .value = "",
       .words = "bodies of MESH that do not touch are held together",
       .details = "Without it a mesh of several bodies that do not touch each other is refused: each would float, spin or stand by "
                  "itself, as with --each.",
       .place = &options.rigid}};
}

Setting each_row(Options& options, const char* details) {
  return {.name = "each",
          .value = "",
          .words = "bodies of MESH that do not touch are treated one by one",
          .details = details,
          .place = &options.each};
}

/// A number as settings show it.
std::string text_of(double value) { return shown(Setting{.name = "", .value = "", .words = "", .details = "", .place = &value}); }

Setting mass_row(Options& options) {
  return {.name = "measured-mass",
          .value = "G",
          .words = "what the print weighs: tells its density",
          .details =
              "By a kitchen scale, without skirt, brim and supports. The density is then that mass over the volume that the G-code "
              "lays down for the body.",
          .place = &options.measured_mass_g,
          .range = Range::positive(),
          .unset = "not weighed",
          .rare = true};
}

Settings print_rows(Options& options) {
  return {mass_row(options),
          {.name = "filament-diameter",
           .value = "MM",
           .words = "of G-code, whatever the file says",
           .details = "",
           .place = &options.printed.filament_diameter_mm,
           .range = Range::positive(),
           .unset = "as the file says",
           .rare = true},
          {.name = "turned",
           .value = "DEG",
           .words = "the mesh was turned on the bed by",
           .details = "",
           .place = &options.turned_deg,
           .range = {.lo = -720, .hi = 720, .open = false},
           .rare = true},
          {.name = "bed-center",
           .value = "X,Y",
           .words = "of the mesh's box on the bed",
           .details = "The middle of the bounding box, as PrusaSlicer's --center takes it. Otherwise the outlines of the layers "
                      "are laid over the mesh's "
                      "sections, and it is refused when they do not fit.",
           .place = TextPlace{[&options](const std::string& text) {
                                const std::vector<double> numbers = parse_numbers("bed-center", text);
                                if (numbers.size() != 2) usage_error("--bed-center takes X,Y in mm; it is '" + text + "'.");
                                options.placing.centre_mm = Eigen::Vector2d(numbers[0], numbers[1]);
                              },
                              [&options] {
                                const auto& centre = options.placing.centre_mm;
                                return centre ? text_of(centre->x()) + "," + text_of(centre->y()) : std::string("found");
                              }}}};
}

Settings slicer_rows(Options& options) {
  return {
      {.name = "slicer",
       .value = "PROGRAM",
       .words = "make what this slicer prints of it meet the goal",
       .details = "prusa-slicer, or its path: PrusaSlicer or SuperSlicer, at 100 % infill. The G-code is measured, what it has "
                  "more or less than the mesh is "
                  "made up for inside, and it is sliced again, three times at most. Mesh and G-code are written; what is judged is "
                  "the G-code.",
       .place = TextPlace{[&options](const std::string& text) { options.slicer.program = text; },
                          [&options] { return options.slicer.program.empty() ? "none" : options.slicer.program; }}},
      {.name = "profile",
       .value = "FILE",
       .words = "of the slicer: an .ini as it exports it",
       .details =
           "PrusaSlicer: File, Export, Export Config. Its density of the filament counts unless --density or --material is "
           "given, and with --cavity infill so do its infill, perimeters and layers. What is solid, and the place on the bed, "
           "are set by rayrep.",
       .place = path_place(options.slicer.profile)},
      {.name = "as-sliced",
       .value = "FILE",
       .words = "or by hand: the G-code of a mesh made before, --of",
       .details =
           "For slicers that are elsewhere: run the command, slice what it makes, and run the command again with --as-sliced "
           "FILE.gcode --of WHAT_WAS_SLICED.stl: what the print has more or less than that mesh is made up for. Slice what "
           "comes of it with the same profile; 'rayrep verify NEXT.gcode' judges that.",
       .place = path_place(options.as_sliced),
       .rare = true},
      {.name = "of",
       .value = "MESH",
       .words = "what was sliced",
       .details = "",
       .place = path_place(options.sliced_mesh),
       .rare = true},
      mass_row(options),
      {.name = "gcode",
       .value = "FILE",
       .words = "where the G-code goes (default: the output's name)",
       .details = "",
       .place = path_place(options.gcode),
       .rare = true}};
}

Setting fixed_row(Options& options, const char* details) {
  return {.name = "fixed",
          .value = "FILE=G_CM3",
          .words = "a body inside that is not printed, with its density",
          .details = details,
          .place = TextPlace{[&options](const std::string& text) {
                               const std::size_t at = text.rfind('=');
                               if (at == std::string::npos || at == 0)
                                 usage_error("--fixed takes a mesh and its density, like magnet.stl=7.5; it is '" + text + "'.");
                               const double density = parse_number("fixed", text.substr(at + 1));
                               if (!(density > 0 && density <= 25))
                                 usage_error("The density in --fixed must lie between 0 and 25 g/cm3; it is " +
                                             text.substr(at + 1) + ".");
                               options.fixed.push_back({text.substr(0, at), density});
                             },
                             [&options] {
                               std::string text;
                               for (const FixedFile& file : options.fixed)
                                 text += (text.empty() ? "" : ", ") + file.path.string() + "=" + text_of(file.density_g_cm3);
                               return text.empty() ? std::string("none") : text;
                             }},
          .repeated = true};
}

Setting keep_solid_row(Options& options, const char* details) {
  return {.name = "keep-solid",
          .value = "FILE",
          .words = "a mesh: no cavity in it, nor within the wall of it",
          .details = details,
          .place = TextPlace{[&options](const std::string& text) { options.keep_solid.emplace_back(text); },
                             [&options] {
                               std::string text;
                               for (const auto& path : options.keep_solid) text += (text.empty() ? "" : ", ") + path.string();
                               return text.empty() ? std::string("none") : text;
                             }},
          .rare = true,
          .repeated = true};
}

Setting deform_fixed_row(Options& options) {
  const auto add = [&options](const std::string& text) {
    std::error_code ignored;
    if (std::filesystem::exists(text, ignored))
      options.deform_fixed.emplace_back(text);
    else
      options.deform.fixed.push_back(parse_region(text));
  };
  const auto show = [&options] {
    std::string text;
    for (const Region3& region : options.deform.fixed) text += (text.empty() ? "" : "; ") + shown(region);
    for (const auto& path : options.deform_fixed) text += (text.empty() ? "" : "; ") + path.string();
    return text.empty() ? std::string("none") : text;
  };
  return {.name = "deform-fixed",
          .value = "REGION",
          .words = "what does not move: X,Y,Z,X,Y,Z (box), X,Y,Z,R (ball) or a mesh",
          .details =
              "Two opposite corners of a box, the centre and radius of a ball, or a closed mesh that encloses it; in mm, "
              "where it is in the body (--unit and --size do not move it). The motion fades around it. May be given several "
              "times.",
          .place = TextPlace{add, show},
          .rare = true,
          .repeated = true};
}

Settings inertial_files(Options& options) {
  return {
      {.name = "urdf",
       .value = "FILE",
       .words = "write the <inertial> element of URDF, in kg and m",
       .details = "Mass, centre of mass and inertia tensor of the mesh, in the axes of the mesh.",
       .place = path_place(options.urdf)},
      {.name = "mjcf", .value = "FILE", .words = "and that of MuJoCo's MJCF", .details = "", .place = path_place(options.mjcf)}};
}

Setting html_row(Options& options) {
  return {.name = "html",
          .value = "FILE",
          .words = "write a page to look at, with the bodies in 3D",
          .details =
              "One file that needs no network: the verdict in words, all figures, and a view to turn and to cut, in any browser. "
              "Written when the JSON file is.",
          .place = path_place(options.html)};
}

Setting section_row(Options& options) {
  const auto add = [&options](const std::string& text) {
    const std::size_t colon = text.find(':');
    options.sections.push_back({parse_section_plane(text.substr(0, colon)), {}});
    if (colon == std::string::npos) return;
    options.sections.back().path = text.substr(colon + 1);
    if (options.sections.back().path.empty()) usage_error("--section names no file behind its colon: '" + text + "'.");
  };
  const auto show = [&options] {
    std::string text;
    for (const SectionFile& section : options.sections) text += (text.empty() ? "" : ", ") + section.path.string();
    return text.empty() ? std::string("none") : text;
  };
  return {.name = "section",
          .value = "PLANE",
          .words = "draw the section in a plane: y=0, z=12.5, y (through the centre of mass)",
          .details =
              "In coordinates of the mesh; X,Y,Z=OFFSET for any other direction. With up upright, to scale, with the centres, the "
              "waterline, the axis or the support. Writes NAME_section_y0.svg, NAME that of the output; PLANE:FILE "
              "names it, and its ending chooses SVG or PNG. May be given several times.",
          .place = TextPlace{add, show},
          .rare = options.command == Command::hollow || options.command == Command::verify,
          .repeated = true};
}

Settings picture_rows(Options& options) {
  return {
      section_row(options),
      {.name = "picture",
       .value = "FILE",
       .words = "draw it before and after, cut open: .png or .svg",
       .details = "Shaded, seen from above and the side, and cut through the centre of mass or, with --section, in the first of "
                  "its planes. Where the outside was deformed, how far is shown in colour.",
       .place = path_place(options.picture),
       .rare = options.command == Command::hollow || options.command == Command::verify}};
}

Setting picture_up_row(Options& options) {
  return {.name = "up",
          .value = "DIR",
          .words = "of pictures: x, y, z, -x, -y, -z or X,Y,Z",
          .details = "",
          .place = direction_place("up", options.picture_up)};
}

Settings common_rows(Options& options, bool with_report) {
  Settings rows = {
      {.name = "config",
       .value = "FILE",
       .words = "settings from a JSON file, or FILE.json in place of MESH",
       .details =
           "An object like { \"mesh\": \"bird.stl\", \"stand\": [\"z\", [0, 1, 1]], \"wall\": 1.6, \"rigid\": true }: a number or "
           "text for "
           "a value, a list of numbers for a point, true for an option without a value, a list where an option may be given "
           "several "
           "times, an object for a list of numbers with names. Files in it lie beside it (mesh, original, profile, of, as-sliced, "
           "fixed). What the command line says counts instead of what the file says.",
       .place = path_place(options.spec_file),
       .rare = options.goal != PoseSpec::kGoal},
      {.name = "save-config",
       .value = "FILE",
       .words = "write what was said to a JSON file for --config",
       .details = "The mesh and every option that the command line or --config has given, before the work begins.",
       .place = path_place(options.saved_config),
       .rare = true},
      {.name = "report",
       .value = "FILE",
       .words = "write everything to a JSON file",
       .details =
           "Input, options, before, after, criteria with value, limit and pass, solver, timings, peak memory, version. It is "
           "written whenever there is a verdict, also one that fails; not when a goal is refused before.",
       .place = path_place(options.report)},
      {.name = "json",
       .value = "",
       .words = "the same on standard output, and nothing else there",
       .details = "Its form: docs/report.schema.json.",
       .place = &options.json,
       .rare = true},
      html_row(options),
      {.name = "quiet,q",
       .value = "",
       .words = "no summary, no progress",
       .details = "Errors are still printed, and so is what --json asks for.",
       .place = &options.quiet},
      {.name = "verbose,v",
       .value = "",
       .words = "also stages, timings, and how to judge the output again",
       .details = "",
       .place = &options.verbose},
      {.name = "threads",
       .value = "N",
       .words = "use at most N threads (default: all cores)",
       .details = "The result does not depend on it.",
       .place = count_place("threads", options.threads, "all"),
       .rare = true},
      {.name = "help,h", .value = "", .words = "this text", .details = "", .place = TextPlace{}}};
  if (!with_report)
    std::erase_if(rows, [](const Setting& s) { return s.name == "report" || s.name == "json" || s.name == "html"; });
  return rows;
}

std::string change_kinds() {
  std::string names;
  for (const char* name : kChangeKindNames) names += (names.empty() ? "" : ", ") + std::string(name);
  return names;
}

/// @throws Error{usage}
std::vector<ChangeKind> parse_change_kinds(const std::string& text) {
  const std::vector<std::string> known(kChangeKindNames.begin(), kChangeKindNames.end());
  std::vector<ChangeKind> kinds;
  std::istringstream names(text);
  for (std::string name; std::getline(names, name, ',');) {
    const auto found = std::find(known.begin(), known.end(), name);
    if (name == "all") {
      for (std::size_t n = 0; n < known.size(); ++n) kinds.push_back(static_cast<ChangeKind>(n));
    } else if (found != known.end()) {
      kinds.push_back(static_cast<ChangeKind>(found - known.begin()));
    } else {
      const std::string meant = nearest_name(name, known);
      usage_error("--allow does not know '" + name + "'." + (meant.empty() ? "" : " Did you mean " + meant + "?") +
                  " Known: all, " + change_kinds() + ".");
    }
  }
  if (kinds.empty()) usage_error("--allow takes what may be changed, separated by commas: all, " + change_kinds() + ".");
  return kinds;
}

std::string shown_change_kinds(const std::vector<ChangeKind>& kinds) {
  std::string names;
  for (const ChangeKind kind : kinds)
    names += (names.empty() ? "" : ",") + std::string(kChangeKindNames[static_cast<std::size_t>(kind)]);
  return names.empty() ? "none" : names;
}

Settings output_rows(Options& options) {
  return {
      {.name = "output,o",
       .value = "FILE",
       .words = "where to write: .stl .obj .ply .3mf (default MESH_" + options.goal + ".stl)",
       .details =
           "The ending chooses binary STL, OBJ, PLY or 3MF. Default: the input's name with the goal behind it, in the current "
           "folder.",
       .place = path_place(options.output)},
      {.name = "allow",
       .value = "LIST",
       .words = "what may be changed if it cannot be done as asked, or all",
       .details = "The first change that does it is told, made, and noted in the report. In this order, whatever that of LIST: " +
                  change_kinds() +
                  "; where no single one does, two together. Limits: axis and attitude are tilted by up to 30 degrees, the wall "
                  "goes down to 0.4 mm, the size up to 2.5 times that asked, a base gives way by up to 1 mm, up to 5 % of the "
                  "height are cut off below, and the outside is moved by up to a tenth of its diagonal.",
       .place = TextPlace{[&options](const std::string& text) { options.allow = parse_change_kinds(text); },
                          [&options] { return shown_change_kinds(options.allow); }}},
      {.name = "suggest",
       .value = "",
       .words = "if it fails, print the command lines that would do",
       .details =
           "When the goal is out of reach, command lines with which it is met are looked for (another waterline, wall, contact "
           "point, axis, size ...), each of them run and verified. They are told beside the message; with this they are also "
           "printed on standard output, one a line.",
       .place = &options.suggest},
      {.name = "no-advice",
       .value = "",
       .words = "if it fails, say only why",
       .details = "Without looking for what would do, which takes some seconds.",
       .place = &options.no_advice,
       .rare = true}};
}

void append(Settings& settings, const Settings& more) { settings.insert(settings.end(), more.begin(), more.end()); }

Settings spec_rows(Spec& spec, For purpose) {
  return std::visit([purpose](auto& s) { return settings(s, purpose); }, spec);
}

std::string heading_of(const Spec& spec) {
  return std::visit([](const auto& s) { return std::string(s.kGroup); }, spec);
}

/// The up direction is told with the mesh, once, whatever the goal.
void move_up(Settings& from, Settings& to) {
  const auto up = std::find_if(from.begin(), from.end(), [](const Setting& s) { return s.name == "up"; });
  if (up == from.end()) return;
  to.push_back(*up);
  from.erase(up);
}

std::vector<Group> hollow_groups(Options& options) {
  Group mesh{"The mesh", mesh_rows(options)};
  mesh.settings.push_back(
      each_row(options,
               "Each body is hollowed by itself, with a waterline, an axis or a support of its own, and where it "
               "is in MESH. Outputs and reports are numbered in the order of the file: NAME-1.stl, NAME-2.stl ... A "
               "body that cannot be made does not keep the others from it; the exit code is then the largest of "
               "all."));
  Group goal{heading_of(options.spec), spec_rows(options.spec, For::making)};
  move_up(goal.settings, mesh.settings);
  Group making{"Material and discretisation", settings(print_of(options.spec), For::making)};
  append(making.settings, settings(options.hollow, options.spec));
  Group infill{"Infill instead of cavities", settings(print_of(options.spec).infill, For::making)};
  infill.settings.push_back(
      {.name = "3mf-flavor",
       .value = "NAME",
       .words = "whose modifier: prusa (SuperSlicer), bambu (OrcaSlicer), core",
       .details =
           "The 3MF file says 100 % infill for the object and the sparse infill for a modifier volume in "
           "it, which each of them does in its own way. core is for others: body and sparse region are meshes with names, and "
           "you say in the slicer what they are.",
       .place = choice("3mf-flavor", options.flavor, kThreeMfFlavorNames),
       .rare = true});
  infill.settings.push_back(
      {.name = "phases",
       .value = "",
       .words = "write what is dense and what is sparse as closed meshes, too: NAME_dense, NAME_sparse",
       .details = "For slicers and simulations that take a mesh for each material; the judge does not need them.",
       .place = &options.phases,
       .rare = true});
  Group core{"Heavy cores, and what is not printed", settings(print_of(options.spec).core, For::making)};
  append(core.settings, settings(print_of(options.spec).balls, For::making));
  core.settings.push_back(fixed_row(
      options,
      "A magnet, bolt, coin or motor: a mesh in mm, where it is in the finished body (--unit and --size do not move it), "
      "with room for play if it needs any. Its room is kept free, and the wall from the surface and from cavities. May be "
      "given several times."));
  making.settings.push_back(keep_solid_row(
      options,
      "Where a hook, an eye, an insert or a screw shall hold: a closed mesh in mm, where it is in the finished body (--unit and "
      "--size do not move it); it may reach out of it. What it costs is in what is proven. May be given several times."));
  Group outside{"Changing the outside", settings(options.deform)};
  outside.settings.insert(outside.settings.begin() + 1, deform_fixed_row(options));
  Group files{"Files", output_rows(options)};
  append(files.settings, picture_rows(options));
  append(files.settings, common_rows(options, true));
  if (std::holds_alternative<TargetSpec>(options.spec)) append(files.settings, inertial_files(options));
  std::vector<Group> groups = {mesh, goal, making, infill, core, {"The slicer", slicer_rows(options)}, files};
  const bool deforms = std::holds_alternative<FloatSpec>(options.spec) || std::holds_alternative<SpinSpec>(options.spec) ||
                       std::holds_alternative<StandSpec>(options.spec);
  if (deforms) groups.insert(groups.end() - 2, outside);
  return groups;
}

std::vector<Group> verify_groups(Options& options) {
  Group mesh{"The mesh", mesh_rows(options)};
  mesh.settings.push_back(
      each_row(options,
               "Each body is judged by itself, without an --original. Reports are numbered in the order of the file: "
               "NAME-1.json ... The exit code is the largest of all."));
  Settings rows = spec_rows(options.spec, For::judging);
  move_up(rows, mesh.settings);
  const std::string& not_asked = goal_named(options.goal).not_asked;
  std::erase_if(rows, [&](const Setting& s) { return s.name == not_asked; });
  Group judging{"Judging",
                {{.name = "goal",
                  .value = "GOAL",
                  .words = goal_words(),
                  .details = "What is judged. Options of another goal are refused.",
                  .place = TextPlace{[](const std::string&) {}, [&options] { return options.goal; }}}}};
  append(judging.settings, settings(print_of(options.spec), For::judging));
  append(judging.settings, settings(print_of(options.spec).infill, For::judging));
  judging.settings.push_back(fixed_row(options,
                                       "A heavy core, a magnet, a coin: a mesh in mm, where it is in the body. It must have room "
                                       "there, within 0.1 mm. May be given several times."));
  judging.settings.push_back({.name = "plugs",
                              .value = "FILE",
                              .words = "what closes the holes again, as rayrep writes it",
                              .details = "A mesh in mm, each plug where it is in the body. A 3MF file of rayrep has them in it.",
                              .place = path_place(options.plugs),
                              .rare = true});
  judging.settings.push_back(keep_solid_row(
      options, "In mm, where it is in the body. How near cavities come to it is judged (kept_solid). May be given several times."));
  judging.settings.push_back({.name = "original",
                              .value = "FILE",
                              .words = "required outer surface, of --unit and --size",
                              .details = "The surface that must be found unchanged outside.",
                              .place = path_place(options.original)});
  Group files{"Files", picture_rows(options)};
  append(files.settings, common_rows(options, true));
  return {mesh, judging, {"Goal " + options.goal, rows}, {"A print (MESH is a .gcode or .sl1 file)", print_rows(options)}, files};
}

/// Of what is only weighed.
Settings density_rows(Print& print) {
  Settings rows = settings(print, For::judging);
  std::erase_if(rows, [](const Setting& s) { return s.name != "material" && s.name != "density"; });
  return rows;
}

std::vector<Group> measure_groups(Options& options) {
  Group print{"The print", settings(options.print, For::judging)};
  std::erase_if(print.settings,
                [](const Setting& s) { return s.name != "material" && s.name != "density" && s.name != "print-direction"; });
  append(print.settings, print_rows(options));
  Group mesh{"The mesh in it",
             {{.name = "of",
               .value = "MESH",
               .words = "tell it in the coordinates of MESH, which was sliced",
               .details = "MESH may be what was sliced or anything with the same outside.",
               .place = path_place(options.original)}}};
  append(mesh.settings, mesh_rows(options));
  std::erase_if(mesh.settings, [](const Setting& s) { return s.name == "rigid"; });
  Group output{"Output",
               {{.name = "json", .value = "", .words = "JSON on standard output", .details = "", .place = &options.json}}};
  append(output.settings, inertial_files(options));
  append(output.settings, picture_rows(options));
  output.settings.push_back(picture_up_row(options));
  append(output.settings, common_rows(options, false));
  return {print, mesh, output};
}

std::vector<Group> inspect_groups(Options& options) {
  Group output{"Output", density_rows(options.print)};
  output.settings.push_back(
      {.name = "json", .value = "", .words = "JSON on standard output", .details = "", .place = &options.json});
  output.settings.push_back(html_row(options));
  append(output.settings, inertial_files(options));
  append(output.settings, picture_rows(options));
  output.settings.push_back(picture_up_row(options));
  append(output.settings, common_rows(options, false));
  return {{"The mesh", mesh_rows(options)}, output};
}

/// "2/8"
void parse_shard(const std::string& text, BatchOptions& batch) {
  const std::size_t slash = text.find('/');
  const auto refuse = [&text] { usage_error("--shard takes which part of how many, like 2/8; it is '" + text + "'."); };
  if (slash == std::string::npos) refuse();
  const double shard = parse_number("shard", text.substr(0, slash));
  const double shards = parse_number("shard", text.substr(slash + 1));
  if (!(shard >= 1 && shard <= shards && shards <= 1e6) || shard != std::floor(shard) || shards != std::floor(shards)) refuse();
  batch.shard = static_cast<std::size_t>(shard);
  batch.shards = static_cast<std::size_t>(shards);
}

void parse_ending(const std::string& text, BatchOptions& batch) {
  batch.ending = text[0] == '.' ? text : "." + text;
  if (!can_write("x" + batch.ending)) usage_error("--format is stl, obj, ply or 3mf; it is '" + text + "'.");
}

std::vector<Group> batch_groups(Options& options) {
  BatchOptions& batch = options.batch;
  Settings running = {
      {.name = "output,o",
       .value = "FOLDER",
       .words = "gets what they write, a report of each, and results.jsonl",
       .details =
           "Of job ID: ID.stl or what else it makes, ID.json, its report, and lines/ID.json, its line. results.jsonl has all "
           "lines in the order of the jobs: exit code, message, figures, seconds, memory, hash of the mesh, version. What has "
           "its line is not run again, unless a file that it reads, the job, --format or rayrep is another one.",
       .place = path_place(batch.folder)},
      {.name = "shard",
       .value = "I/N",
       .words = "run only every N-th job, from the I-th on",
       .details =
           "For several machines with one folder: each runs a part, and whoever ends last writes the whole of results.jsonl.",
       .place = TextPlace{[&batch](const std::string& text) { parse_shard(text, batch); },
                          [&batch] { return std::to_string(batch.shard) + "/" + std::to_string(batch.shards); }}},
      {.name = "jobs",
       .value = "J",
       .words = "run so many at once (default: as many as there are cores)",
       .details = "Each is a process of its own and takes its share of the cores.",
       .place = count_place("jobs", batch.at_once, "auto")},
      {.name = "timeout",
       .value = "S",
       .words = "stop a job after S seconds",
       .details = "Its line then says so, with exit code 124.",
       .place = &batch.time_limit_s,
       .range = Range::positive(),
       .unset = "none"},
      {.name = "retry", .value = "", .words = "run again what crashed or took too long", .details = "", .place = &batch.retry},
      {.name = "format",
       .value = "KIND",
       .words = "of the meshes: stl, obj, ply, 3mf (default: as usual)",
       .details = "",
       .place = TextPlace{[&batch](const std::string& text) { parse_ending(text, batch); },
                          [&batch] { return batch.ending.empty() ? std::string("auto") : batch.ending.substr(1); }}},
      {.name = "summary",
       .value = "FILE.csv",
       .words = "write all lines as a table, too",
       .details = "With everything done already that is all that happens.",
       .place = path_place(batch.summary)}};
  Settings rest = common_rows(options, false);
  std::erase_if(rest, [](const Setting& s) { return s.name == "threads" || s.name == "config" || s.name == "save-config"; });
  return {{"Running jobs", running}, {"Output", rest}};
}

std::vector<Group> sweep_groups(Options& options) {
  return {{"The study",
           {{.name = "vary",
             .value = "NAME=VALUES",
             .words = "an option and its values: wall=0.8,1.2 or size=60..100/5",
             .details = "May be given several times: all combinations are made. LO..HI/N are N values, evenly; where values hold "
                        "commas, put | between them: up=0,1,1|z.",
             .place = TextPlace{[&options](const std::string& text) { options.vary.push_back(text); },
                                [] { return std::string("none"); }},
             .repeated = true},
            {.name = "output,o",
             .value = "JOBS.jsonl",
             .words = "where to write (default: standard output)",
             .details = "",
             .place = path_place(options.output)},
            {.name = "help,h", .value = "", .words = "this text", .details = "", .place = TextPlace{}}}}};
}

std::vector<Group> view_groups(Options& options) {
  Group mesh{"The mesh", mesh_rows(options)};
  append(mesh.settings, density_rows(options.print));
  mesh.settings.push_back(fixed_row(options, "In mm, where it is in the body. May be given several times."));
  Group pictures{"Pictures", picture_rows(options)};
  pictures.settings.push_back(picture_up_row(options));
  pictures.settings.push_back(html_row(options));
  append(pictures.settings, common_rows(options, false));
  return {mesh, pictures};
}

std::vector<Group> studio_groups(Options& options) {
  StudioOptions& studio = options.studio;
  Settings page = {
      {.name = "port",
       .value = "N",
       .words = "of 127.0.0.1 (default: any that is free)",
       .details = "",
       .place = &studio.port,
       .range = {.lo = 0, .hi = 65535, .open = false}},
      {.name = "no-open",
       .value = "",
       .words = "only print the address, do not open it in the browser",
       .details = "So it is where there is no display, too.",
       .place = &studio.no_open},
      {.name = "max-upload",
       .value = "SIZE",
       .words = "take meshes of at most SIZE, as 500MB",
       .details = "",
       .place = TextPlace{[&studio](const std::string& text) { studio.most_upload_bytes = parse_memory("max-upload", text); },
                          [&studio] { return memory_words(studio.most_upload_bytes); }}}};
  Settings rest = common_rows(options, false);
  std::erase_if(rest, [](const Setting& s) { return s.name != "threads" && s.name != "help,h"; });
  append(page, rest);
  return {{"The page", page}};
}

Settings scene_output_rows(Options& options) {
  Settings rows = {{.name = "json", .value = "", .words = "JSON on standard output", .details = "", .place = &options.json}};
  append(rows, common_rows(options, false));
  std::erase_if(rows, [](const Setting& s) { return s.name == "config" || s.name == "save-config"; });
  return rows;
}

Setting clearance_row(Options& options, const char* words, const char* details) {
  return {.name = "clearance",
          .value = "MM",
          .words = words,
          .details = details,
          .place = &options.scene.clearance_mm,
          .range = {.lo = 0, .hi = 1000, .open = false},
          .unset = "the scene's"};
}

std::vector<Group> scene_groups(Options& options) {
  Settings importing = {
      {.name = "output,o",
       .value = "FILE",
       .words = "what is written (default ROBOT.json, SCENE.glb)",
       .details = "Import: the scene, with its meshes beside it: of each part FILE_PART.stl, in mm. Export: binary glTF.",
       .place = path_place(options.output)},
      {.name = "visual",
       .value = "",
       .words = "import links as they are seen, not their shapes for collisions",
       .details =
           "Without it a link is what it has as <collision>, and where it has none its <visual>; with it the other way round.",
       .place = &options.scene.visual}};
  return {{"Import and export", importing}, {"Output", scene_output_rows(options)}};
}

std::vector<Group> motion_groups(Options& options) {
  Settings checking = {
      {.name = "tolerance",
       .value = "T",
       .words = "miss no overlap longer than this share of its transition",
       .details =
           "What is not told is proven to be clear, but for overlaps that are shorter. The ends of overlaps are found to half of "
           "it.",
       .place = &options.scene.tolerance,
       .range = {.lo = 1e-7, .hi = 0.5, .open = false}},
      clearance_row(options, "parts come no nearer to each other than this",
                    "In place of the scene's \"clearance\". Pairs that have one of their own keep it; pairs that may touch are not "
                    "tested.")};
  Settings resolving = {
      {.name = "hint",
       .value = "",
       .words = "tell for each overlap what one move of what may be moved does",
       .details = "Keys on the way (place, attitude, time) and the place of a part in all states, each alone, by the smallest move "
                  "found that does most. Ways without a key are given one in their middle.",
       .place = &options.scene.hint},
      {.name = "resolve",
       .value = "",
       .words = "move all of them until nothing overlaps, or no step helps",
       .details = "The worst pair first. What was free stays free. Writes the scene with what was moved.",
       .place = &options.scene.resolve},
      {.name = "free",
       .value = "PART",
       .words = "what may be moved then (default: all parts)",
       .details = "May be given several times.",
       .place = TextPlace{[&options](const std::string& text) { options.scene.free.push_back(text); },
                          [&options] {
                            std::string names;
                            for (const std::string& name : options.scene.free) names += (names.empty() ? "" : ", ") + name;
                            return names.empty() ? std::string("all") : names;
                          }},
       .repeated = true},
      {.name = "output,o",
       .value = "FILE",
       .words = "where --resolve writes the scene (default NAME_resolved.json)",
       .details = "",
       .place = path_place(options.output)}};
  Settings files = {
      {.name = "html",
       .value = "FILE",
       .words = "write a page to look at: timeline, states, parts in 3D",
       .details = "One file that needs no network. A click on a collision goes to its worst moment and looks at it from where "
                  "it is seen.",
       .place = path_place(options.html)}};
  append(files, scene_output_rows(options));
  return {{"The check", checking}, {"Out of each other's way", resolving}, {"Output", files}};
}

Setting part_row(const char* name, const char* value, const char* words, std::string& part) {
  return {.name = name,
          .value = value,
          .words = words,
          .details = "",
          .place = TextPlace{[&part](const std::string& text) { part = text; }, [&part] { return part.empty() ? "none" : part; }}};
}

std::vector<Group> carve_groups(Options& options) {
  Settings carving = {part_row("part", "A", "what is carved", options.scene.part),
                      part_row("by", "B", "what makes its way through it", options.scene.by),
                      clearance_row(options, "that is left between them, everywhere on the way",
                                    "Without it the scene's, or 0.3 mm where that has none."),
                      {.name = "tolerance",
                       .value = "MM",
                       .words = "by so much more may be taken away, never less",
                       .details = "Time and triangles grow with its square.",
                       .place = &options.scene.carve_tolerance_mm,
                       .range = {.lo = 1e-3, .hi = 100, .open = false}}};
  Settings files = {{.name = "output,o",
                     .value = "FILE",
                     .words = "what is left of A: .stl .obj .ply .3mf (default A_carved.stl)",
                     .details = "In the coordinates of A's mesh: name it in the scene in place of that.",
                     .place = path_place(options.output)}};
  append(files, scene_output_rows(options));
  return {{"Carving", carving}, {"Output", files}};
}

std::vector<Group> balance_groups(Options& options) {
  Settings making = {{.name = "resolution",
                      .value = "N",
                      .words = "rays along the longest side of each part, 20 to 1000",
                      .details = "",
                      .place = &options.hollow.resolution,
                      .range = {.lo = 20, .hi = 1000, .open = false}},
                     {.name = "as-is",
                      .value = "",
                      .words = "judge the parts as they are: nothing is made",
                      .details = "So is what was written judged again: rayrep balance FOLDER/SCENE --as-is.",
                      .place = &options.scene.as_is}};
  Settings files = {{.name = "output,o",
                     .value = "FOLDER",
                     .words = "gets the parts and the scene that names them (default SCENE_balanced)",
                     .details = "PART.stl of each part that is printed, in the coordinates of its mesh.",
                     .place = path_place(options.output)},
                    {.name = "html",
                     .value = "FILE",
                     .words = "write a page to look at: how it rests in each state, in 3D",
                     .details = "One file that needs no network: what rayrep motion --html shows, and of each state the verdict, "
                                "foot, waterline, point or hinge, and cavities through the outside.",
                     .place = path_place(options.html)}};
  append(files, scene_output_rows(options));
  return {{"The insides", making}, {"Output", files}};
}

}  // namespace

std::string long_name(const Setting& setting) { return setting.name.substr(0, setting.name.find(',')); }

namespace {

// ---------------------------------------------------------------------------------------------------------------------- parsing

/// Of each option its values, in order.
using Given = std::map<std::string, std::vector<std::string>>;

/// What was probably meant by an option that there is not.
std::string hint_for(const std::string& option, const std::vector<std::string>& names) {
  if (option == "--scale") return " --size MM scales to a longest side, --unit says what the file's numbers mean.";
  const std::string meant = nearest_name(option, names);
  return meant.empty() ? "" : " Did you mean " + meant + "?";
}

/// Of an option that may be alone: whether the next word is its value, and no mesh.
bool is_number_like(const std::string& word) {
  const std::string ending = ending_of(word);
  return std::isdigit(static_cast<unsigned char>(word[0])) &&
         !(ending.size() > 1 && std::isalpha(static_cast<unsigned char>(ending[1])));
}

/// The words of the command line as option and value, the mesh under "input". Values that begin with a dash are values.
Given split(int argc, const char* const* argv, const std::vector<Group>& groups) {
  po::options_description accepted;
  std::map<std::string, std::string> takes_value;  ///< and what it is without; empty: it needs one
  std::vector<std::string> names;
  for (const Group& group : groups)
    for (const Setting& s : group.settings) {
      if (accepted.find_nothrow(long_name(s), false)) continue;  // of two goals
      names.push_back("--" + long_name(s));
      if (s.value.empty()) {
        accepted.add_options()(s.name.c_str(), "");
      } else {
        if (s.repeated)
          accepted.add_options()(s.name.c_str(), po::value<std::vector<std::string>>(), "");
        else
          accepted.add_options()(s.name.c_str(), po::value<std::string>(), "");
        takes_value["--" + long_name(s)] = s.alone;
      }
    }
  accepted.add_options()("input", po::value<std::string>());
  po::positional_options_description positional;
  positional.add("input", 1);
  std::vector<std::string> arguments;
  for (int n = 2; n < argc; ++n) {
    arguments.emplace_back(argv[n]);
    const auto option = takes_value.find(arguments.back());
    if (option == takes_value.end()) continue;
    const std::string& alone = option->second;
    const bool follows = n + 1 < argc && std::string(argv[n + 1]).rfind("--", 0) != 0;
    if (follows && (alone.empty() || is_number_like(argv[n + 1])))
      arguments.back() += std::string("=") + argv[++n];
    else if (!alone.empty())
      arguments.back() += "=" + alone;
  }
  Given given;
  try {
    namespace style = po::command_line_style;
    const po::parsed_options parsed = po::command_line_parser(arguments)
                                          .options(accepted)
                                          .positional(positional)
                                          .style(style::unix_style & ~style::allow_guessing)
                                          .run();
    po::variables_map map;  // complains of what was given twice or lacks its value
    po::store(parsed, map);
    for (const auto& option : parsed.options) given[option.string_key].push_back(option.value.empty() ? "" : option.value.front());
  } catch (const po::unknown_option& error) {
    usage_error(std::string(error.what()) + "." + hint_for(error.get_option_name(), names) + " 'rayrep " + argv[1] +
                " --help' lists the options.");
  } catch (const po::too_many_positional_options_error&) {
    usage_error("There is more than one mesh on the command line: rayrep takes one at a time. A name with blanks needs quotes.");
  } catch (const po::error& error) {
    usage_error(std::string(error.what()) + ". 'rayrep " + argv[1] + " --help' lists the options.");
  }
  return given;
}

/// Options that say the same as this one in other words, or belong to it: they do not count beside it.
std::set<std::string> replaced_by(const std::string& name) {
  static const std::map<std::string, std::set<std::string>> all = {{"waterline", {"submerged"}},
                                                                   {"submerged", {"waterline"}},
                                                                   {"material", {"density", "resin"}},
                                                                   {"resin", {"density", "material"}},
                                                                   {"up", {"axis", "max-tilt"}}};
  const auto found = all.find(name);
  return found == all.end() ? std::set<std::string>{} : found->second;
}

/// Adds what a file says, where the command line does not say it. @returns the file
/// @throws Error{usage}
std::optional<SpecFile> add_spec_file(const std::vector<Group>& groups, Given& given, Options& options) {
  if (options.command == Command::batch || options.command == Command::studio || options.takes_scene()) return std::nullopt;
  const auto ends_in_json = [](const std::string& name) { return std::filesystem::path(name).extension() == ".json"; };
  const auto input = given.find("input");
  if (input != given.end() && ends_in_json(input->second.front())) {
    if (given.contains("config")) usage_error("There are two files of settings: '" + input->second.front() + "' and --config.");
    given["config"] = input->second;
    given.erase(input);
  }
  if (!given.contains("config")) return std::nullopt;
  options.spec_file = given.at("config").front();
  Settings known;
  for (const Group& group : groups)
    for (Setting s : group.settings) {
      s.name = long_name(s);
      if (s.name != "config" && s.name != "help") known.push_back(std::move(s));
    }
  SpecFile file = read_spec_file(options.spec_file, known);
  std::set<std::string> said;
  for (const auto& [name, texts] : given) {
    said.insert(name);
    said.merge(replaced_by(name));
  }
  for (const auto& [name, entry] : file.entries) {
    if (name != "mesh" && !said.contains(name)) given[name] = entry.texts;
    if (name == "mesh" && !given.contains("input")) given["input"] = entry.texts;
  }
  std::erase_if(file.entries, [&](const auto& entry) { return said.contains(entry.first == "mesh" ? "input" : entry.first); });
  return file;
}

/// What was said, as a file of settings.
void note_config(const std::vector<Group>& groups, const Given& given, Options& options) {
  if (options.saved_config.empty()) return;
  static const std::set<std::string> kNotSaved = {"config", "save-config", "help", "input"};
  std::map<std::string, std::vector<std::string>> said{{"mesh", {options.input.string()}}};
  for (const Group& group : groups)
    for (const Setting& s : group.settings)
      if (const auto found = given.find(long_name(s)); found != given.end() && !kNotSaved.contains(found->first))
        said[found->first] = found->second;
  if (options.command == Command::verify) said["goal"] = {options.goal};
  options.config = spec_file_text(said, options.saved_config);
}

/// A complaint of options with the place of the first that is from a file.
std::string placed(const std::string& message, const SpecFile& file) {
  if (message.starts_with(file.path.string() + ", line ")) return message;
  std::size_t first = std::string::npos;
  std::string place;
  for (const auto& [name, entry] : file.entries) {
    std::size_t at = message.find("--" + name);
    while (at != std::string::npos && at + 2 + name.size() < message.size() &&
           (std::isalnum(static_cast<unsigned char>(message[at + 2 + name.size()])) || message[at + 2 + name.size()] == '-'))
      at = message.find("--" + name, at + 1);
    if (at >= first) continue;
    first = at;
    place = file.place(name);
  }
  return place + message;
}

/// Every group that some goal of verify asks for: their names alone count.
std::vector<Group> groups_of_all_goals(const Syntax& syntax, Options& options) {
  if (syntax.command != Command::verify) return groups_of(syntax, options);
  std::vector<Group> all;
  std::vector<Options> every = defaults_of_all_goals(syntax);
  for (Options& other : every)
    for (const Group& group : groups_of(syntax, other)) all.push_back(group);
  return all;
}

/// @throws Error{usage} for an option that another goal has
void refuse_other_goals(const Given& given, const Syntax& syntax, const Options& options) {
  const auto asks = [&](const Goal& goal, const std::string& name) {
    Options other = options;
    other.goal = goal.word;
    other.spec = goal.spec;
    for (const Group& group : groups_of(syntax, other))
      for (const Setting& s : group.settings)
        if (long_name(s) == name) return true;
    return false;
  };
  for (const auto& [name, value] : given) {
    if (name == "input" || asks(goal_named(options.goal), name)) continue;
    std::string belongs;
    for (const Goal& goal : goals())
      if (asks(goal, name)) belongs += (belongs.empty() ? "--goal " : " or ") + goal.word;
    usage_error("--" + name + " belongs to " + belongs + "; this is --goal " + options.goal + ".");
  }
}

/// @param file  of which some of the options are; may be null
void apply(const std::vector<Group>& groups, const Given& given, const SpecFile* file, Options& options) {
  const auto read = [file](Setting& s, const std::string& value) {
    try {
      parse(s, value);
    } catch (const Error& error) {
      if (!file || !file->entries.contains(s.name)) throw;
      throw Error(error.code(), file->place(s.name) + error.what());
    }
  };
  for (const Group& group : groups)
    for (Setting s : group.settings) {
      s.name = long_name(s);
      const auto found = given.find(s.name);
      if (found == given.end() || s.name == "help") continue;
      if (!s.also.empty() && given.contains(s.also))
        usage_error("Give either --" + std::min(s.name, s.also) + " or --" + std::max(s.name, s.also) + ", not both.");
      for (const std::string& value : found->second) read(s, value);
    }
  for (const Group& group : groups) check(group.settings);
  if (options.hollow.bounds != SegmentBounds::paper) return;
  // The paper's bounds are those of its own solver.
  if (!given.contains("solver")) options.hollow.solver = Solver::rays;
  if (options.hollow.solver != Solver::rays)
    usage_error("--bounds paper belongs to --solver rays; this is --solver " + given.at("solver").front() + ".");
}

void note_in_force(const std::vector<Group>& groups, Options& options) {
  static const std::set<std::string> kNotTold = {"material", "help",     "quiet",     "verbose", "output", "report",
                                                 "suggest",  "allow",    "no-advice", "json",    "gcode",  "urdf",
                                                 "mjcf",     "original", "section",   "html",    "picture"};
  for (const Group& group : groups)
    for (const Setting& s : group.settings)
      if (!kNotTold.contains(long_name(s))) options.in_force.emplace_back(long_name(s), shown(s));
}

/// @throws Error{usage} for what goes with a file for a printer only, or does not go with one
void check_print(const Given& given, Options& options) {
  const bool print = is_printed(options.input);
  if ((options.command == Command::inspect || options.command == Command::view) && print && !options.html.empty())
    usage_error("A page shows meshes: 'rayrep verify " + options.input.string() +
                " --original MESH --html FILE' shows what was printed.");
  if (options.command == Command::inspect && print) options.command = Command::measure;
  if (options.command == Command::hollow && print)
    usage_error("'" + options.input.string() + "' is a file for a printer. Name the mesh it was made from.");
  if (options.word == "measure" && !print)
    usage_error("'" + options.input.string() + "' is no print by its name (.gcode, .sl1); 'rayrep inspect' measures meshes.");
  if (options.command != Command::verify) return;
  Options none;
  for (const Setting& s : print_rows(none))
    if (!print && given.contains(s.name)) usage_error("--" + s.name + " is for a print: MESH is not a .gcode or .sl1 file.");
  if (!print) return;
  if (options.original.empty())
    usage_error("To judge a print, name the mesh it was made from: --original MESH. Its outside is what touches water and ground.");
  if (print_of(options.spec).drains.plugged && options.plugs.empty())
    usage_error("What closes the holes of a print is not in its file: name it, where it is in the body (--plugs FILE).");
  if (options.each) usage_error("--each is for meshes: judge prints one by one.");
  if (given.contains("flatten"))
    usage_error("A print stands on the base that was cut: name the mesh that was sliced as --original, and leave --flatten out.");
}

/// @throws Error{usage} for what --each does not go with
void check_each(const Options& options) {
  if (!options.each) return;
  if (!options.keep_solid.empty()) usage_error("--keep-solid does not say which body it is in: save each as a file of its own.");
  if (!options.fixed.empty()) usage_error("--fixed does not say which body it is in: save each as a file of its own.");
  if (options.json) usage_error("--json is for one body: --report FILE.json writes FILE-1.json, FILE-2.json ...");
  if (options.rigid) usage_error("--rigid makes one body of all, --each treats them one by one: give either.");
  if (!options.allow.empty())
    usage_error("--allow is for one body: save each as a file of its own, or leave --each or --allow out.");
  if (options.suggest) usage_error("--suggest is for one body: save each as a file of its own, or leave --each or --suggest out.");
  if (!options.original.empty())
    usage_error("--original is for one body: to judge against it, verify one body at a time, against a file with that body alone.");
}

void check_spec(const Options& options) {
  if (options.command != Command::hollow && options.command != Command::verify) return;
  const For purpose = options.command == Command::hollow ? For::making : For::judging;
  std::visit([purpose](const auto& s) { check(s, purpose); }, options.spec);
}

/// The way up on the bed is that of the body, unless its goal has none.
void choose_print_direction(Options& options) {
  std::visit([&options](const auto& s) { options.slicer.print_direction = s.print.direction.value_or(s.up); }, options.spec);
}

/// @throws Error{usage} for what goes with a slicer or with G-code only
void check_slicer(const Given& given, Options& options) {
  if (options.command != Command::hollow) return;
  const bool slices = !options.slicer.program.empty();
  if (options.as_sliced.empty() != options.sliced_mesh.empty())
    usage_error("--as-sliced FILE.gcode and --of MESH, the mesh that was sliced, go together.");
  if (slices && !options.as_sliced.empty())
    usage_error("--slicer slices by itself, --as-sliced takes what you have sliced: give either.");
  if (slices || !options.as_sliced.empty()) {
    if (options.suggest)
      usage_error("What --suggest would print has not been sliced: leave it out, or look for it without a slicer first.");
    options.no_advice = true;
  }
  if (options.each && !options.as_sliced.empty()) usage_error("--as-sliced is for one body: leave --each out.");
  const bool by_profile = print_of(options.spec).infill.wanted();  // see choose_infill
  for (const char* name : {"profile", "gcode"})
    if (!slices && given.contains(name) && !(by_profile && std::string(name) == "profile"))
      usage_error(std::string("--") + name + " goes with a slicer: say --slicer prusa-slicer, too.");
  if (options.measured_mass_g && options.as_sliced.empty())
    usage_error("--measured-mass goes with the G-code of the print that was weighed: say --as-sliced FILE.gcode --of MESH, too.");
  if (options.measured_mass_g && options.density_given)
    usage_error("--measured-mass tells the density: leave --density and --material out.");
  if (!options.as_sliced.empty()) {
    choose_print_direction(options);
    const Printed last = read_printed(options.as_sliced, options.printed);
    if (options.measured_mass_g)
      print_of(options.spec).density_g_cm3 = *options.measured_mass_g / (1e-3 * last.body()[M1]);
    else if (!options.density_given && last.likely_density_g_cm3())
      print_of(options.spec).density_g_cm3 = *last.likely_density_g_cm3();
  }
  if (!slices && options.slicer.profile.empty()) return;
  const SlicerProfile profile = read_slicer_profile(options.slicer.profile);
  if (!options.density_given && options.as_sliced.empty() && profile.density_g_cm3)
    print_of(options.spec).density_g_cm3 = *profile.density_g_cm3;
  if (!slices) return;
  choose_print_direction(options);
  if (options.gcode.empty()) options.gcode = std::filesystem::path(options.output).replace_extension(".gcode");
}

/// What the profile says of the infill, where the command line does not, and the wall that follows.
/// @throws Error{usage} for what goes with infill only
void choose_infill(const Given& given, Options& options) {
  if (options.command != Command::hollow) return;
  Print& print = print_of(options.spec);
  Infill& infill = print.infill;
  if (given.contains("cavity") && given.at("cavity").front() == "void" && infill.wanted())
    usage_error("--cavity void has no infill: leave it or --infill out.");
  if (!infill.wanted()) {
    if (given.contains("cavity") && given.at("cavity").front() == "infill") usage_error("--infill 0 is --cavity void.");
    if (given.contains("infill")) return;  // 0: what else is said of it does not matter
    Infill none;
    for (const Setting& s : settings(none, For::making))
      if (s.name != "cavity" && s.name != "infill" && given.contains(s.name))
        usage_error("--" + s.name + " goes with infill instead of a cavity: say --infill 15, too.");
    if (given.contains("phases")) usage_error("--phases writes what is dense and what is sparse: say --infill 15, too.");
    if (given.contains("3mf-flavor")) usage_error("--3mf-flavor tells whose infill modifier is written: say --infill 15, too.");
    return;
  }
  if (!options.slicer.profile.empty()) {
    const SlicerProfile profile = read_slicer_profile(options.slicer.profile);
    const auto take = [&given](const char* name, const auto& said, auto& value) {
      if (said && !given.contains(name)) value = *said;
    };
    if (!options.slicer.program.empty())
      for (const char* name : {"perimeters", "extrusion-width", "top-layers", "bottom-layers", "layer-height"})
        if (given.contains(name)) usage_error("--" + std::string(name) + " is what the profile says: change it there.");
    if (profile.fill_percent && *profile.fill_percent > 0 && *profile.fill_percent <= 90)
      take("infill", profile.fill_percent, infill.percent);
    take("infill-pattern", profile.fill_pattern, infill.pattern);
    take("perimeters", profile.perimeters, infill.perimeters);
    take("extrusion-width", profile.extrusion_width_mm, infill.extrusion_width_mm);
    take("top-layers", profile.top_layers, infill.top_layers);
    take("bottom-layers", profile.bottom_layers, infill.bottom_layers);
    take("layer-height", profile.layer_height_mm, infill.layer_height_mm);
  }
  if (!given.contains("wall")) print.wall_mm = infill.skin_mm();
}

/// A yo-yo is made in two halves unless it is to be one piece.
void choose_axle(const Given& given, Options& options) {
  SpinSpec* spin = std::get_if<SpinSpec>(&options.spec);
  if (!spin) return;
  if (options.command == Command::hollow && spin->yoyo && !given.contains("axle")) spin->axle.kind = Axle::Kind::m4;
  constexpr double kUsualGap_mm = 4;
  if (has_axle(spin->axle) && !given.contains("gap")) spin->axle.gap_mm = kUsualGap_mm;
}

/// Pieces are told apart, and where they are in the whole, in 3MF only: in other formats each has a file of its own beside that.
void choose_piece_output(Options& options) {
  if (!makes_pieces(options) || can_write_infill(options.output) || !can_write(options.output)) return;
  options.piece_output = options.output;
  options.output.replace_extension(".3mf");
}

void choose_output(Options& options) {
  if (options.command != Command::hollow) return;
  const bool sparse = print_of(options.spec).infill.wanted();
  if (options.output.empty())
    options.output = options.input.stem().string() + "_" + options.goal + (sparse || makes_pieces(options) ? ".3mf" : ".stl");
  choose_piece_output(options);
  if (sparse && !can_write_infill(options.output))
    usage_error("Where to print sparsely is told by a modifier, which only 3MF holds: end '" + options.output.string() +
                "' in .3mf.");
  const auto beside = [&output = options.output](const std::string& what) {
    return output.parent_path() / (output.stem().string() + what + output.extension().string());
  };
  const Print& print = print_of(options.spec);
  if (print.core.wanted() || print.balls.wanted()) options.insert_output = beside(print.core.wanted() ? "_core" : "_balls");
  if (print.drains.plugged && !can_write_infill(options.output)) options.plug_output = beside("_plugs");
  if (options.deform.limit_mm) options.outside_output = beside("_outside");
  if (options.phases) {
    options.dense_output = beside("_dense");
    options.sparse_output = beside("_sparse");
  }
  if (!can_write(options.output))
    usage_error("Cannot tell what to write from the name '" + options.output.string() + "': end it in .stl, .obj, .ply or .3mf.");
}

/// @throws Error{usage} for what goes with import and export only
void choose_import(Options& options) {
  if (options.command != Command::scene) return;
  const std::string& action = options.scene.action;
  if (action == "check" && !options.output.empty())
    usage_error("--output is of import and export: rayrep scene import ROBOT.urdf, rayrep scene export SCENE.");
  if (action != "import" && options.scene.visual) usage_error("--visual is of import: rayrep scene import ROBOT.urdf.");
  if (action == "import" && options.input.extension() == ".json")
    usage_error("'" + options.input.string() +
                "' is no URDF by its name: import makes a scene of a robot, a file that ends in .urdf. "
                "A scene that is there already is checked by 'rayrep scene check'.");
  if (action != "check" && options.output.empty())
    options.output = options.input.stem().string() + (action == "import" ? ".json" : ".glb");
  if (action == "export" && options.output.extension() != ".glb")
    usage_error("What is written is binary glTF: end '" + options.output.string() + "' in .glb.");
}

/// @throws Error{usage} for what goes with --resolve only
void choose_resolving(Options& options) {
  if (options.command != Command::motion) return;
  const bool moves = options.scene.hint || options.scene.resolve;
  if (!options.output.empty() && !options.scene.resolve) usage_error("--output is where --resolve writes: say --resolve, too.");
  if (!options.scene.free.empty() && !moves) usage_error("--free says what --hint and --resolve may move: say one of them, too.");
  if (options.scene.hint && options.scene.resolve) usage_error("--resolve does what --hint only tells: give either.");
  if (options.scene.hint && options.json) usage_error("--hint is told as text: leave --json out.");
  if (options.scene.resolve && options.output.empty()) options.output = options.input.stem().string() + "_resolved.json";
}

/// @throws Error{usage} for parts that are not named, or a file that cannot be written
void choose_carving(Options& options) {
  if (options.command != Command::carve) return;
  if (options.scene.part.empty() || options.scene.by.empty())
    usage_error("Name both parts: rayrep carve " + quoted(options.input.string()) + " --part A --by B.");
  if (options.output.empty()) options.output = options.scene.part + "_carved.stl";
  if (!can_write(options.output))
    usage_error("Cannot tell what to write from the name '" + options.output.string() + "': end it in .stl, .obj, .ply or .3mf.");
}

/// @throws Error{usage} for an output that is missing
void choose_batch(Options& options) {
  if (options.command == Command::batch && options.batch.folder.empty())
    usage_error("Name the folder for what the jobs write: rayrep batch " + quoted(options.input.string()) + " -o FOLDER.");
}

/// Names of pictures that were left open: next to the output, or where a mesh is only read in the current folder.
/// @throws Error{usage}
void choose_pictures(Options& options) {
  const bool writes = options.command == Command::hollow;
  const std::filesystem::path& of = writes ? options.output : options.input;
  const std::filesystem::path folder = writes ? of.parent_path() : std::filesystem::path();
  if (options.command == Command::view && options.sections.empty() && options.picture.empty() && options.html.empty()) {
    options.picture = of.stem().string() + ".png";
    if (!is_printed(options.input)) options.html = of.stem().string() + ".html";
  }
  const auto require_kind = [](const char* name, const std::filesystem::path& path) {
    const std::string ending = ending_of(path);
    if (ending != ".svg" && ending != ".png")
      usage_error(std::string("--") + name + " draws SVG or PNG: end '" + path.string() + "' in .svg or .png.");
  };
  for (SectionFile& section : options.sections) {
    if (section.path.empty()) section.path = folder / (of.stem().string() + "_section_" + section.plane.file_word() + ".svg");
    require_kind("section", section.path);
  }
  if (!options.picture.empty()) require_kind("picture", options.picture);
}

/// @throws Error{usage} with the commands there are
const Syntax& syntax_of(const std::string& word) {
  std::string known;
  for (const Syntax& syntax : commands()) {
    if (word == syntax.word) return syntax;
    known += (known.empty() ? "" : ", ") + syntax.word;
  }
  std::error_code ignored;
  if (std::filesystem::exists(word, ignored))
    usage_error("Say what " + quoted(word) + " shall do, for example: rayrep float " + quoted(word) + ". Commands: " + known + ".");
  std::vector<std::string> words;
  for (const Syntax& syntax : commands()) words.push_back(syntax.word);
  const std::string meant = nearest_name(word, words);
  usage_error("There is no command '" + word + "'." + (meant.empty() ? "" : " Did you mean " + meant + "?") + " Known: " + known +
              "; 'rayrep --help' says more.");
}

/// What is printed and nothing else; none: it is a command.
std::optional<std::string> text_for(const std::string& word, const std::string& second) {
  if (word == "--help" || word == "-h" || (word == "help" && second.empty())) return overview();
  if (word == "help") return help_text(syntax_of(second));
  if (word == "--version" || word == "version") return "rayrep " + version() + "\nbuilt with " RAYREP_LIBRARIES "\n";
  if (word == "--man") return man_page();
  if (word == "--completion") return bash_completion();
  return std::nullopt;
}

}  // namespace

double Options::insert_density() const {
  const Print& made = print_of(spec);
  return made.core.wanted() ? made.core.density_g_cm3 : made.balls.density_g_cm3;
}

std::filesystem::path Options::output_of_piece(std::size_t number) const {
  return piece_output.parent_path() /
         (piece_output.stem().string() + "_" + std::to_string(number) + piece_output.extension().string());
}

std::vector<std::filesystem::path> Options::meshes() const {
  std::vector<std::filesystem::path> written;
  if (command == Command::balance) return written;  // the output is a folder
  for (const auto& mesh : {output, insert_output, plug_output, outside_output, dense_output, sparse_output})
    if (!mesh.empty()) written.push_back(mesh);
  for (std::size_t n = 1; n <= 2 && !piece_output.empty(); ++n) written.push_back(output_of_piece(n));
  return written;
}

namespace {

bool same_file(const std::filesystem::path& a, const std::filesystem::path& b) {
  std::error_code ignored;
  return !a.empty() && !b.empty() && (std::filesystem::equivalent(a, b, ignored) || a.lexically_normal() == b.lexically_normal());
}

std::vector<std::filesystem::path> files_read(const Options& options) {
  std::vector<std::filesystem::path> read = {options.input, options.original, options.spec_file};
  for (const FixedFile& file : options.fixed) read.push_back(file.path);
  read.insert(read.end(), options.keep_solid.begin(), options.keep_solid.end());
  read.insert(read.end(), options.deform_fixed.begin(), options.deform_fixed.end());
  read.push_back(options.plugs);
  return read;
}

}  // namespace

void refuse_overwriting(const Options& options, const std::filesystem::path& output) {
  for (const auto& input : files_read(options))
    if (same_file(output, input))
      usage_error("The output '" + output.string() + "' is " + (input == options.input ? "the input itself" : "read, too") +
                  ": choose another name with --output.");
}

void refuse_overwriting(const Options& options) {
  const std::vector<std::filesystem::path> read = files_read(options);
  const std::vector<std::filesystem::path> written = options.meshes();
  for (const auto& output : written) refuse_overwriting(options, output);
  std::vector<std::pair<const char*, std::filesystem::path>> texts = {
      {"report", options.report}, {"html", options.html},   {"save-config", options.saved_config}, {"urdf", options.urdf},
      {"mjcf", options.mjcf},     {"gcode", options.gcode}, {"picture", options.picture}};
  for (const SectionFile& section : options.sections) texts.emplace_back("section", section.path);
  for (const auto& one : texts) {
    const auto& [name, text] = one;
    std::vector<std::filesystem::path> meshes = read;
    meshes.insert(meshes.end(), written.begin(), written.end());
    for (const auto& mesh : meshes)
      if (same_file(text, mesh))
        usage_error("The " + std::string(name) + " '" + text.string() + "' would overwrite " +
                    (same_file(mesh, options.spec_file) ? "what is read" : "a mesh") + ": choose another name with --" + name +
                    ".");
    for (const auto& [other, path] : texts)
      if (&path != &text && same_file(text, path))
        usage_error("--" + std::string(name) + " and --" + other + " name the same file.");
  }
}

const std::vector<std::string>& scene_actions() {
  static const std::vector<std::string> actions = {"check", "import", "export"};
  return actions;
}

const std::vector<Syntax>& commands() {
  static const std::vector<Syntax> table = [] {
    std::vector<Syntax> all;
    for (const Goal& goal : goals()) {
      if (!goal.has_command) continue;
      const std::string makes = std::visit([](const auto& s) { return std::string(s.kMakes); }, goal.spec);
      all.push_back({goal.word, "rayrep " + goal.word + " MESH [options]: " + makes + ".\n",
                     makes + "; writes MESH_" + goal.word + ".stl", Command::hollow});
    }
    all.push_back({"verify",
                   "rayrep verify MESH [options]: judge from its triangles whether MESH floats, spins, stands ...\n"
                   "Without --waterline or --submerged it floats where it displaces its own mass.\n",
                   "judge a hollowed mesh: does it float upright, spin, stand, fit its target?", Command::verify});
    all.push_back({"measure",
                   "rayrep measure FILE.gcode [options]: mass, centre of mass and inertia of what a printer lays down.\n"
                   "Skirt, brim, raft, supports and wipe tower are listed and not counted.\n"
                   "FILE.sl1: of what a resin printer cures, its supports and pad counted.\n",
                   "mass, centre of mass and inertia of what a .gcode or .sl1 file prints", Command::measure});
    all.push_back({"view",
                   "rayrep view MESH [options]: pictures of MESH, whole and cut, and a page to turn and cut it.\n"
                   "Without --section, --picture and --html it writes NAME.png and NAME.html; of a .gcode file\n"
                   "NAME.png of what the nozzle lays down.\n",
                   "pictures of MESH, whole and cut, and a page to turn and cut it", Command::view});
    all.push_back({"studio",
                   "rayrep studio [MESH] [options]: a page in the browser: drop a mesh, choose a goal, drag, download.\n"
                   "With a scene (.json) instead its ways are edited, and collisions looked for meanwhile.\n"
                   "It is served on 127.0.0.1, to whoever has the address that is printed. Nothing is written but\n"
                   "what you download. Ctrl-C ends it.\n",
                   "a page in the browser: drop a mesh, choose a goal, drag, download", Command::studio, "[MESH]"});
    all.push_back({"inspect",
                   "rayrep inspect MESH [options]: size, volume, mass, centre of mass, inertia and defects of MESH.\n"
                   "Of a .gcode or .sl1 file what measure tells.\n",
                   "size, volume, mass, inertia and defects of MESH", Command::inspect});
    all.push_back({"scene",
                   "rayrep scene check SCENE [options]: what is wrong with a scene, a JSON file of parts that move.\n"
                   "Parts that are no solids, states that name no part, motions that leave the scene, bodies that\n"
                   "overlap in a state. Its form: docs/scene.md. Exit code 0: nothing, 3: something is wrong.\n\n"
                   "rayrep scene import ROBOT.urdf [options]: make a scene of a robot: each joint from rest to its limits.\n"
                   "rayrep scene export SCENE [options]: write it as glTF, with its motions, for other programs.\n",
                   "check a scene of parts that move, import or export one: scene check SCENE", Command::scene, "SCENE"});
    all.push_back({"motion",
                   "rayrep motion SCENE [options]: when, where and how badly parts get into each other on their way.\n"
                   "Exit code 0: they never do, 4: some do.\n",
                   "when, where and how badly parts that move get into each other", Command::motion, "SCENE"});
    all.push_back({"carve",
                   "rayrep carve SCENE --part A --by B [options]: take out of A the way that B makes through it.\n"
                   "The rest of A's surface stays as it is. Afterwards 'rayrep motion' finds them that far apart.\n",
                   "carve out of a part the way that another one makes through it", Command::carve, "SCENE"});
    all.push_back({"balance",
                   "rayrep balance SCENE [options]: hollow the parts of a scene so that it rests in all of its states.\n"
                   "A state says how: \"rests\": \"stands\", \"floats\" or \"hangs\" (docs/scene.md). All printed parts are\n"
                   "hollowed together, and judged state by state from the files. Exit code 4: it cannot be done.\n",
                   "hollow the parts of a scene so that it rests in all of its states", Command::balance, "SCENE"});
    all.push_back({"batch",
                   "rayrep batch JOBS.jsonl -o FOLDER [options]: run many, each as a process of its own.\n"
                   "A job is a line of JSON: {\"command\": \"float\", \"mesh\": \"duck.stl\", \"options\": {\"wall\": 0.8}}\n"
                   "Run it again to go on where it was. Exit code 0: every job has its line, whatever that says.\n",
                   "run many jobs, several at once, and go on where that was interrupted", Command::batch, "JOBS"});
    all.push_back({"sweep", "rayrep sweep COMMAND MESH... [options of COMMAND] --vary NAME=VALUES ...: the jobs of a study.\n",
                   "write the jobs of a parameter study", Command::sweep, "GOAL"});
    return all;
  }();
  return table;
}

std::vector<Group> groups_of(const Syntax& syntax, Options& options) {
  switch (syntax.command) {
    case Command::hollow:
      return hollow_groups(options);
    case Command::verify:
      return verify_groups(options);
    case Command::inspect:
      return inspect_groups(options);
    case Command::measure:
      return measure_groups(options);
    case Command::batch:
      return batch_groups(options);
    case Command::sweep:
      return sweep_groups(options);
    case Command::view:
      return view_groups(options);
    case Command::studio:
      return studio_groups(options);
    case Command::scene:
      return scene_groups(options);
    case Command::motion:
      return motion_groups(options);
    case Command::carve:
      return carve_groups(options);
    case Command::balance:
      return balance_groups(options);
    case Command::text:
      break;
  }
  return {};
}

Options defaults_of(const Syntax& syntax) {
  Options options;
  options.command = syntax.command;
  options.word = syntax.word;
  options.goal = syntax.command == Command::hollow ? syntax.word : "float";
  const Goal& goal = goal_named(options.goal);
  options.spec = goal.spec;
  options.hollow.resolution = goal.resolution;
  return options;
}

std::vector<Options> defaults_of_all_goals(const Syntax& syntax) {
  std::vector<Options> all;
  for (const Goal& goal : goals()) {
    all.push_back(defaults_of(syntax));
    all.back().goal = goal.word;
    all.back().spec = goal.spec;
  }
  return all;
}

bool makes_pieces(const Options& options) {
  const SpinSpec* spin = std::get_if<SpinSpec>(&options.spec);
  return print_of(options.spec).cut.wanted() || (spin && has_axle(spin->axle));
}

std::string ending_of(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
  return ending;
}

std::string quoted(const std::string& word) {
  const auto plain = [](unsigned char c) { return std::isalnum(c) || (c != '\0' && std::strchr(".,/_-=", c) != nullptr); };
  if (!word.empty() && std::all_of(word.begin(), word.end(), plain)) return word;
  if (printable(word) != word || word.find('\n') != std::string::npos) {
    std::string text = "$'";
    for (const char c : word) text += c == '\n' ? "\\n" : c == '\'' || c == '\\' ? std::string{'\\', c} : std::string(1, c);
    return printable(text) + "'";
  }
  std::string text = "'";
  for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return text + "'";
}

std::string printable(const std::string& text) {
  std::string shown;
  const auto escape = [&shown](unsigned char c) {
    constexpr const char* kDigits = "0123456789abcdef";
    shown += std::string("\\x") + kDigits[c / 16] + kDigits[c % 16];
  };
  for (std::size_t n = 0; n < text.size(); ++n) {
    const auto c = static_cast<unsigned char>(text[n]);
    // Of UTF-8 the control characters above ASCII are C2 80 to C2 9F.
    const auto next = static_cast<unsigned char>(n + 1 < text.size() ? text[n + 1] : '\0');
    if (c == 0xC2 && next >= 0x80 && next < 0xA0) {
      escape(c);
      escape(next);
      ++n;
    } else if ((c < 0x20 && c != '\n') || c == 0x7F) {
      escape(c);
    } else {
      shown += text[n];
    }
  }
  return shown;
}

/// Whether the word after an option is its value.
static bool is_value_of(const std::string& option, const std::string& next, const std::vector<Group>& groups) {
  for (const Group& group : groups)
    for (const Setting& s : group.settings)
      if ("--" + long_name(s) == option) return !s.value.empty() && (s.alone.empty() || is_number_like(next));
  return true;
}

std::vector<std::string> suggested(int argc, const char* const* argv, const Suggestion& suggestion) {
  const Syntax& syntax = syntax_of(argv[1]);
  Options options = defaults_of(syntax);
  const std::vector<Group> groups = groups_of_all_goals(syntax, options);
  std::set<std::string> gone{"--allow"};
  std::vector<std::string> more;
  for (const auto& [name, value] : suggestion.options) {
    gone.insert("--" + name);
    for (const std::string& other : replaced_by(name)) gone.insert("--" + other);
    more.push_back("--" + name);
    if (!value.empty()) more.push_back(value);
  }
  std::vector<std::string> words{"rayrep"};
  for (int n = 1; n < argc; ++n) {
    const std::string word = argv[n];
    const auto equals = word.find('=');
    if (word == "--suggest") continue;
    if (gone.count(word.substr(0, equals))) {
      if (equals == std::string::npos && n + 1 < argc && is_value_of(word, argv[n + 1], groups)) ++n;
      continue;
    }
    words.push_back(word);
  }
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

std::string shell_line(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + quoted(word);
  return text;
}

std::string judging_command(const Options& options, const Spec& spec, const std::string& output, bool with_original) {
  const SpinSpec* spin = std::get_if<SpinSpec>(&spec);
  Options judging = options;
  judging.goal = spin && spin->yoyo ? "yoyo" : options.goal;
  judging.spec = spec;
  Options usual = options;
  usual.goal = judging.goal;
  usual.repair = usual.rigid = false;
  usual.spec = goal_named(judging.goal).spec;
  const Syntax& syntax = syntax_of("verify");
  std::string text = "rayrep verify " + quoted(output) + " --goal " + judging.goal;
  const std::vector<Group> now = groups_of(syntax, judging);
  const std::vector<Group> before = groups_of(syntax, usual);
  for (const FixedFile& file : options.fixed) text += " --fixed " + quoted(file.path.string() + "=" + text_of(file.density_g_cm3));
  for (const auto& path : options.keep_solid) text += " --keep-solid " + quoted(path.string());
  if (!options.insert_output.empty())
    text += " --fixed " + quoted(options.insert_output.string() + "=" + text_of(options.insert_density()));
  if (!options.plug_output.empty()) text += " --plugs " + quoted(options.plug_output.string());
  static const std::set<std::string> kOther = {"fixed",   "keep-solid", "plugs",    "unit",    "size",   "memory",
                                               "goal",    "each",       "original", "report",  "html",   "quiet",
                                               "verbose", "threads",    "help",     "section", "picture"};
  for (std::size_t g = 0; g < now.size(); ++g)
    for (std::size_t n = 0; n < now[g].settings.size(); ++n) {
      const Setting& s = now[g].settings[n];
      if (kOther.contains(long_name(s)) || shown(s) == shown(before[g].settings[n])) continue;
      text += " --" + long_name(s) + (s.value.empty() ? "" : " " + quoted(shown(s)));
    }
  if (options.size_mm && with_original) text += " --size " + shown(mesh_rows(judging)[1]);
  // --unit would scale the output, too, which is in mm.
  if (with_original) text += " --original " + quoted(options.input.string());
  return text;
}

namespace {

/// The words of a sweep that are its own, and those of the job it varies, with all its meshes.
struct SweepWords {
  std::vector<const char*> own;
  std::vector<std::string> meshes;
  std::vector<std::pair<std::string, std::string>> options;
};
SweepWords split_sweep(int argc, const char* const* argv, const Syntax& varied) {
  SweepWords words{{argv[0], argv[1]}, {}, {}};
  Options options = defaults_of(varied);
  std::set<std::string> switches;
  std::set<std::string> may_be_alone;
  for (const Group& group : groups_of_all_goals(varied, options))
    for (const Setting& s : group.settings) {
      if (s.value.empty()) switches.insert(long_name(s));
      if (!s.alone.empty()) may_be_alone.insert(long_name(s));
    }
  for (int n = 3; n < argc; ++n) {
    const std::string word = argv[n];
    const std::size_t equals = word.find('=');
    const std::string name = word.substr(0, equals);
    const bool ours = name == "--vary" || name == "--output" || name.starts_with("-o") || name == "--help" || name == "-h";
    const bool alone = equals != std::string::npos || n + 1 == argc ||
                       (word.starts_with("--") && may_be_alone.contains(name.substr(2)) && !is_number_like(argv[n + 1]));
    if (ours) {
      words.own.push_back(argv[n]);
      if (!alone && (name == "--vary" || name == "--output" || name == "-o")) words.own.push_back(argv[++n]);
    } else if (!word.starts_with("--")) {
      words.meshes.push_back(word);
    } else if (equals != std::string::npos) {
      words.options.emplace_back(name.substr(2), word.substr(equals + 1));
    } else {
      words.options.emplace_back(name.substr(2), switches.contains(name.substr(2)) || alone ? "" : argv[++n]);
    }
  }
  return words;
}

Options parse_sweep(int argc, const char* const* argv, const Syntax& syntax) {
  Options options = defaults_of(syntax);
  const std::string word = argc > 2 ? argv[2] : "";
  if (word == "--help" || word == "-h") {
    options.command = Command::text;
    options.text = help_text(syntax);
    return options;
  }
  if (word.empty()) usage_error("Say what is varied: rayrep sweep float duck.stl --vary wall=0.8,1.2.");
  const SweepWords words = split_sweep(argc, argv, syntax_of(word));
  const std::vector<Group> groups = groups_of(syntax, options);
  const Given given = split(static_cast<int>(words.own.size()), words.own.data(), groups);
  if (given.contains("help")) {
    options.command = Command::text;
    options.text = help_text(syntax);
    return options;
  }
  apply(groups, given, nullptr, options);
  if (words.meshes.empty()) usage_error("Name the meshes: rayrep sweep " + word + " MESH ... --vary NAME=VALUES.");
  if (options.vary.empty()) usage_error("Say what is varied: --vary wall=0.8,1.2.");
  std::vector<Varied> varied;
  for (const std::string& text : options.vary) varied.push_back(parse_varied(text));
  options.sweep = sweep({"", word, "", words.options}, words.meshes, varied);
  return options;
}

/// All options as given, read and checked.
/// @param file  of which some of them are; may be null
void take(const Given& given, const Syntax& syntax, const SpecFile* file, Options& options) {
  const bool named = given.contains("input") && !given.at("input").front().empty();
  if (!named && options.scene.action == "import") usage_error("Name the robot: rayrep scene import ROBOT.urdf.");
  if (!named && syntax.command != Command::studio)
    usage_error("Name the " + std::string(options.takes_scene() ? "scene" : "mesh") + ": rayrep " + syntax.word + " " +
                syntax.takes + (options.spec_file.empty() ? "." : ", or in '" + options.spec_file.string() + "' as \"mesh\"."));
  if (named) options.input = given.at("input").front();
  if (syntax.command == Command::verify) {
    if (given.contains("goal")) options.goal = given.at("goal").front();
    options.spec = goal_named(options.goal).spec;
    refuse_other_goals(given, syntax, options);
  }
  const std::vector<Group> groups = groups_of(syntax, options);
  apply(groups, given, file, options);
  options.density_given = given.contains("density") || given.contains("material") || given.contains("resin");
  check_print(given, options);
  choose_infill(given, options);
  choose_axle(given, options);
  check_spec(options);
  check_each(options);
  choose_output(options);
  choose_batch(options);
  choose_import(options);
  choose_resolving(options);
  choose_carving(options);
  if (options.command == Command::balance && options.output.empty())
    options.output = options.input.parent_path() / (options.input.stem().string() + "_balanced");
  choose_pictures(options);
  check_slicer(given, options);
  if (options.command == Command::hollow || options.command == Command::verify) options.quiet = options.quiet || options.json;
  note_in_force(groups, options);
  note_config(groups, given, options);
  refuse_overwriting(options);
}

}  // namespace

namespace {

/// Takes "check" or what else is to be done with a scene out of the words of a command line.
/// @throws Error{usage} for what may be meant as such
void take_scene_action(std::vector<const char*>& words, Options& options) {
  const std::vector<std::string>& actions = scene_actions();
  if (words.size() < 3) return;
  const std::string word = words[2];
  if (std::find(actions.begin(), actions.end(), word) != actions.end()) {
    options.scene.action = word;
    words.erase(words.begin() + 2);
  } else if (word.find('.') == word.npos && words.size() > 3 && words[3][0] != '-') {
    const std::string meant = nearest_name(word, actions);
    usage_error("There is no 'scene " + word + "'." + (meant.empty() ? "" : " Did you mean " + meant + "?") +
                " There are: rayrep scene check SCENE, rayrep scene import ROBOT.urdf, rayrep scene export SCENE.");
  }
}

}  // namespace

Options parse_command_line(int argc, const char* const* argv) {
  const std::string word = argc > 1 ? argv[1] : "";
  if (word.empty()) usage_error("Say what to do.\n\n" + overview());
  if (const auto text = text_for(word, argc > 2 ? argv[2] : "")) {
    Options printed;
    printed.text = *text;
    return printed;
  }
  const Syntax& syntax = syntax_of(word);
  if (syntax.command == Command::sweep) return parse_sweep(argc, argv, syntax);
  Options options = defaults_of(syntax);
  std::vector<const char*> words(argv, argv + argc);
  if (syntax.command == Command::scene) take_scene_action(words, options);
  Given given = split(static_cast<int>(words.size()), words.data(), groups_of_all_goals(syntax, options));
  if (given.contains("help")) {
    options.command = Command::text;
    options.text = help_text(syntax);
    return options;
  }
  const std::optional<SpecFile> file = add_spec_file(groups_of_all_goals(syntax, options), given, options);
  try {
    take(given, syntax, file ? &*file : nullptr, options);
  } catch (const Error& error) {
    if (!file || error.code() != ErrorCode::usage) throw;
    throw Error(ErrorCode::usage, placed(error.what(), *file));
  }
  return options;
}

}  // namespace rayrep::tool
