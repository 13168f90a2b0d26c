#include "options.h"

#include <algorithm>
#include <boost/program_options.hpp>
#include <cmath>
#include <sstream>

#include "rayrep/error.h"
#include "rayrep/materials.h"

namespace po = boost::program_options;

namespace rayrep::tool {
namespace {

constexpr const char* kOverview =
    "rayrep computes the inside of a 3D shape so that its print floats upright, spins or stands.\n"
    "\n"
    "  rayrep float MESH     hollow MESH so that it floats upright; writes MESH_float.stl\n"
    "  rayrep spin MESH      hollow MESH so that it spins as a top or a yo-yo; writes MESH_spin.stl\n"
    "  rayrep stand MESH     hollow MESH so that it stands as safely as it can; writes MESH_stand.stl\n"
    "  rayrep verify MESH    judge a hollowed mesh: does it float upright?\n"
    "  rayrep inspect MESH   size, volume, mass, inertia and defects of MESH\n"
    "\n"
    "  rayrep COMMAND --help lists the options of a command.\n"
    "  rayrep --version\n"
    "\n"
    "Reads STL, OBJ, PLY, OFF and 3MF; writes STL, OBJ, PLY and 3MF.\n"
    "Exit codes: 0 done and verified, 2 usage, 3 input cannot be used, 4 goal cannot be\n"
    "met, 5 solver stopped, 6 cannot write, 130 interrupted, 1 internal error.\n";

[[noreturn]] void usage_error(const std::string& message) { throw Error(ErrorCode::usage, message); }

/// Raw values as given; what is absent has its default.
struct Raw {
  std::string input, unit, up, material, output, original, report, point, centre, objective, bounds, prefer, target;
  double contact = 0;
  double lambda = 0, gamma_c = 0, gamma_i = 0;
  double size = 0, density = 0, fluid = 0, waterline = 0, submerged = 0, wall = 0;
  int resolution = 0, threads = 0;
};

po::options_description shape_options(Raw& raw) {
  po::options_description options("The mesh");
  auto add = options.add_options();
  add("unit", po::value(&raw.unit)->value_name("UNIT")->default_value("mm"),
      "what the file's numbers mean: mm, cm, m, in (a 3MF's own unit wins)");
  add("size", po::value(&raw.size)->value_name("MM"), "scale so that the longest side is MM");
  add("up", po::value(&raw.up)->value_name("DIR")->default_value("z"), "direction that points up: x, y, z, -x, -y, -z or X,Y,Z");
  return options;
}

void add_material_options(po::options_description& options, Raw& raw) {
  auto add = options.add_options();
  add("density", po::value(&raw.density)->value_name("G_CM3"), "density of the print (default 1.24, PLA)");
  add("material", po::value(&raw.material)->value_name("NAME"), "or by name: abs asa hips nylon pc petg pla pp resin tpu");
}

po::options_description float_options(Raw& raw) {
  po::options_description options("Floating");
  auto add = options.add_options();
  add("fluid", po::value(&raw.fluid)->value_name("G_CM3")->default_value(1.0, "1.0"), "density of the fluid");
  add_material_options(options, raw);
  add("waterline", po::value(&raw.waterline)->value_name("MM"), "height of the waterline above the lowest point");
  add("submerged", po::value(&raw.submerged)->value_name("FRACTION"), "or the fraction of the height under water, 0 to 1");
  add("wall", po::value(&raw.wall)->value_name("MM")->default_value(1.2, "1.2"), "smallest wall thickness");
  return options;
}

po::options_description spin_options(Raw& raw) {
  po::options_description options("Spinning");
  auto add = options.add_options();
  add("point", po::value(&raw.point)->value_name("P")->default_value("lowest"),
      "contact point: lowest, com (below the solid's centre of mass), X,Y (where that axis leaves the mesh below) or X,Y,Z");
  add("yoyo", "a yo-yo: no tip, the centre of mass at --center");
  add("center", po::value(&raw.centre)->value_name("X,Y,Z"), "of a yo-yo (default: middle of the bounding box)");
  add("prefer", po::value(&raw.prefer)->value_name("AXIS")->default_value("largest"), "largest or smallest principal moment");
  add("objective", po::value(&raw.objective)->value_name("NAME")->default_value("rayreps"),
      "rayreps (Wu 2016) or spinit (Baecher 2014)");
  add("lambda", po::value(&raw.lambda)->value_name("W")->default_value(0.1, "0.1"),
      "rayreps: weight of the centre of mass's height");
  add("gamma-c", po::value(&raw.gamma_c)->value_name("W")->default_value(1.0, "1"), "spinit: weight of its static moment squared");
  add("gamma-i", po::value(&raw.gamma_i)->value_name("W")->default_value(1.0, "1"), "weight of the inertia ratio");
  add("bounds", po::value(&raw.bounds)->value_name("B")->default_value("complete"),
      "segments on a ray: complete, or paper (around its middle)");
  add_material_options(options, raw);
  add("wall", po::value(&raw.wall)->value_name("MM")->default_value(1.2, "1.2"), "smallest wall thickness");
  add("resolution", po::value(&raw.resolution)->value_name("N")->default_value(100), "rays along the longest side, 20 to 1000");
  return options;
}

po::options_description stand_options(Raw& raw) {
  po::options_description options("Standing");
  auto add = options.add_options();
  add("target", po::value(&raw.target)->value_name("X,Y,Z"),
      "where the centre of mass shall be, seen from above (default: the safest point of the support)");
  add("objective", po::value(&raw.objective)->value_name("NAME")->default_value("lowest"),
      "lowest: the lowest centre of mass; tip-angle: the largest smallest tipping angle");
  add("contact", po::value(&raw.contact)->value_name("MM"),
      "what lies this little above the lowest point touches the ground (default: 0.01 mm or 1e-4 of the height)");
  add_material_options(options, raw);
  add("wall", po::value(&raw.wall)->value_name("MM")->default_value(1.2, "1.2"), "smallest wall thickness");
  add("resolution", po::value(&raw.resolution)->value_name("N")->default_value(200), "rays along the longest side, 20 to 1000");
  return options;
}

void add_common(po::options_description& options, Raw& raw, bool with_report) {
  auto add = options.add_options();
  if (with_report) add("report", po::value(&raw.report)->value_name("FILE"), "write everything to a JSON file");
  add("quiet,q", "no summary, no progress");
  add("verbose,v", "also stages and timings");
  add("threads", po::value(&raw.threads)->value_name("N"), "use at most N threads (default: all cores)");
  add("help,h", "this text");
}

/// The part of a help text that stays below the width of a terminal.
std::string text_of(const po::options_description& options) {
  std::ostringstream out;
  options.print(out);
  return out.str();
}

/// "--up -y" as "--up=-y": the parser would take a value that begins with a dash for an option.
std::vector<std::string> join_vectors(int argc, const char* const* argv, int first) {
  std::vector<std::string> arguments;
  for (int n = first; n < argc; ++n) {
    arguments.emplace_back(argv[n]);
    const std::string& name = arguments.back();
    if ((name == "--up" || name == "--point" || name == "--center" || name == "--target") && n + 1 < argc)
      arguments.back() += std::string("=") + argv[++n];
  }
  return arguments;
}

template <typename T>
std::string shown(const T& value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

void require_positive(const char* name, double value) {
  if (!(value > 0) || !std::isfinite(value))
    usage_error(std::string("--") + name + " must be a positive number; it is " + shown(value) + ".");
}

/// "1,-2" or "1,-2,3.5". @throws Error{usage}
std::vector<double> parse_numbers(const char* name, const std::string& text) {
  std::vector<double> numbers;
  std::istringstream in(text);
  for (std::string part; std::getline(in, part, ',');) {
    std::istringstream one(part);
    double value = 0;
    if (!(one >> value) || one.peek() != EOF || !std::isfinite(value))
      usage_error(std::string("--") + name + " does not take '" + text + "'.");
    numbers.push_back(value);
  }
  return numbers;
}

void read_spin_options(const Raw& raw, bool yoyo, Options& options) {
  options.yoyo = yoyo;
  if (!raw.centre.empty()) {
    if (!yoyo) usage_error("--center belongs to --yoyo; a top has a --point.");
    const std::vector<double> c = parse_numbers("center", raw.centre);
    if (c.size() != 3) usage_error("--center takes X,Y,Z; it is '" + raw.centre + "'.");
    options.centre_mm = Eigen::Vector3d(c[0], c[1], c[2]);
  }
  if (raw.point == "com") {
    options.axis.through = SpinAxis::Through::centre_of_mass;
  } else if (raw.point != "lowest") {
    const std::vector<double> c = parse_numbers("point", raw.point);
    if (c.size() != 2 && c.size() != 3) usage_error("--point takes lowest, com, X,Y or X,Y,Z; it is '" + raw.point + "'.");
    options.axis.through = SpinAxis::Through::point;
    options.axis.leaves_below = c.size() == 2;
    options.axis.point_mm = Eigen::Vector3d(c[0], c[1], c.size() == 3 ? c[2] : 0);
    if (options.axis.leaves_below && std::abs(options.up.normalized().z()) < 1 - 1e-12)
      usage_error("--point X,Y needs the up direction z or -z; give X,Y,Z.");
  }
  const auto choose = [](const char* name, const std::string& text, const char* first, const char* second) {
    if (text != first && text != second)
      usage_error(std::string("--") + name + " is " + first + " or " + second + "; it is '" + text + "'.");
    return text == first;
  };
  options.largest = choose("prefer", raw.prefer, "largest", "smallest");
  options.bounds = choose("bounds", raw.bounds, "complete", "paper") ? SegmentBounds::complete : SegmentBounds::paper;
  const bool rayreps = choose("objective", raw.objective, "rayreps", "spinit");
  for (const auto& [name, weight] : {std::pair{"lambda", raw.lambda}, {"gamma-c", raw.gamma_c}, {"gamma-i", raw.gamma_i}})
    if (!(weight >= 0) || !std::isfinite(weight)) usage_error(std::string("--") + name + " must not be negative.");
  options.weights = {.lambda = rayreps ? raw.lambda : 0, .gamma_c = rayreps ? 0 : raw.gamma_c, .gamma_i = raw.gamma_i};
  if (yoyo) options.weights.lambda = options.weights.gamma_c = 0;
}

}  // namespace

Eigen::Vector3d parse_direction(const std::string& text) {
  const double sign = !text.empty() && text[0] == '-' ? -1 : 1;
  const std::string axis = !text.empty() && (text[0] == '-' || text[0] == '+') ? text.substr(1) : text;
  if (axis == "x" || axis == "X") return sign * Eigen::Vector3d::UnitX();
  if (axis == "y" || axis == "Y") return sign * Eigen::Vector3d::UnitY();
  if (axis == "z" || axis == "Z") return sign * Eigen::Vector3d::UnitZ();
  Eigen::Vector3d v;
  char comma1 = 0;
  char comma2 = 0;
  std::istringstream in(text);
  if (in >> v.x() >> comma1 >> v.y() >> comma2 >> v.z() && comma1 == ',' && comma2 == ',' && in.peek() == EOF && v.allFinite() &&
      v.norm() > 0)
    return v.normalized();
  usage_error("--up takes x, y, z, -x, -y, -z or a vector such as 0,1,0.5; it is '" + text + "'.");
}

Options parse_command_line(int argc, const char* const* argv) {
  Options options;
  const std::string word = argc > 1 ? argv[1] : "";
  if (word.empty()) usage_error(std::string("Say what to do.\n\n") + kOverview);
  if (word == "--help" || word == "-h" || word == "help") {
    options.help_text = kOverview;
    return options;
  }
  if (word == "--version" || word == "version") {
    options.command = Command::version;
    return options;
  }

  Raw raw;
  po::options_description all;
  std::string headline;
  if (word == "float") {
    options.command = Command::float_upright;
    headline = "rayrep float MESH [options]: hollow MESH so that it floats upright.\n\n";
    auto building = float_options(raw);
    auto add = building.add_options();
    add("resolution", po::value(&raw.resolution)->value_name("N")->default_value(200), "rays along the longest side, 20 to 1000");
    po::options_description files("Files");
    files.add_options()("output,o", po::value(&raw.output)->value_name("FILE"),
                        "where to write: .stl .obj .ply .3mf (default MESH_float.stl)");
    add_common(files, raw, true);
    all.add(shape_options(raw)).add(building).add(files);
  } else if (word == "spin") {
    options.command = Command::spin;
    headline = "rayrep spin MESH [options]: hollow MESH so that it spins about the up direction.\n\n";
    po::options_description files("Files");
    files.add_options()("output,o", po::value(&raw.output)->value_name("FILE"),
                        "where to write: .stl .obj .ply .3mf (default MESH_spin.stl)");
    add_common(files, raw, true);
    all.add(shape_options(raw)).add(spin_options(raw)).add(files);
  } else if (word == "stand") {
    options.command = Command::stand;
    headline = "rayrep stand MESH [options]: hollow MESH so that it stands with the up direction up.\n\n";
    po::options_description files("Files");
    files.add_options()("output,o", po::value(&raw.output)->value_name("FILE"),
                        "where to write: .stl .obj .ply .3mf (default MESH_stand.stl)");
    add_common(files, raw, true);
    all.add(shape_options(raw)).add(stand_options(raw)).add(files);
  } else if (word == "verify") {
    options.command = Command::verify;
    headline =
        "rayrep verify MESH [options]: judge from the triangles of MESH whether it floats upright.\n"
        "Without --waterline or --submerged it is judged at the waterline where it displaces its own mass.\n\n";
    po::options_description files("Files");
    files.add_options()("original", po::value(&raw.original)->value_name("FILE"),
                        "the surface that must be unchanged outside (same --unit and --size)");
    add_common(files, raw, true);
    all.add(shape_options(raw)).add(float_options(raw)).add(files);
  } else if (word == "inspect") {
    options.command = Command::inspect;
    headline = "rayrep inspect MESH [options]: size, volume, mass, centre of mass, inertia and defects of MESH.\n\n";
    po::options_description output("Output");
    add_material_options(output, raw);
    output.add_options()("json", "JSON on standard output");
    add_common(output, raw, false);
    all.add(shape_options(raw)).add(output);
  } else {
    usage_error("There is no command '" + word + "'. Known: float, spin, stand, verify, inspect; 'rayrep --help' says more.");
  }

  po::options_description hidden;
  hidden.add_options()("input", po::value(&raw.input));
  po::options_description accepted;
  accepted.add(all).add(hidden);
  po::positional_options_description positional;
  positional.add("input", 1);
  po::variables_map given;
  try {
    namespace style = po::command_line_style;
    po::store(po::command_line_parser(join_vectors(argc, argv, 2))
                  .options(accepted)
                  .positional(positional)
                  .style(style::unix_style & ~style::allow_guessing)
                  .run(),
              given);
    po::notify(given);
  } catch (const po::error& error) {
    usage_error(std::string(error.what()) + ". 'rayrep " + word + " --help' lists the options.");
  }
  if (given.count("help")) {
    options.command = Command::help;
    options.help_text = headline + text_of(all);
    return options;
  }
  if (raw.input.empty()) usage_error("Name the mesh: rayrep " + word + " MESH.");

  options.input = raw.input;
  options.unit = parse_length_unit(raw.unit);
  if (given.count("size")) {
    require_positive("size", raw.size);
    options.size_mm = raw.size;
  }
  options.up = parse_direction(raw.up);
  if (given.count("density") && given.count("material")) usage_error("Give either --density or --material, not both.");
  if (given.count("material")) options.density_g_cm3 = material(raw.material).density_g_cm3;
  if (given.count("density")) options.density_g_cm3 = raw.density;
  require_positive("density", options.density_g_cm3);
  if (given.count("threads")) {
    if (raw.threads < 1 || raw.threads > 1024)
      usage_error("--threads must lie between 1 and 1024; it is " + shown(raw.threads) + ".");
    options.threads = raw.threads;
  }
  options.json = given.count("json") > 0;
  options.quiet = given.count("quiet") > 0;
  options.verbose = given.count("verbose") > 0;
  if (options.command != Command::inspect) {
    options.wall_mm = raw.wall;
    require_positive("wall", raw.wall);
    options.report = raw.report;
  }
  if (options.command == Command::spin) read_spin_options(raw, given.count("yoyo") > 0, options);
  if (options.command == Command::float_upright || options.command == Command::verify) {
    options.fluid_g_cm3 = raw.fluid;
    require_positive("fluid", raw.fluid);
    if (given.count("waterline") && given.count("submerged")) usage_error("Give either --waterline or --submerged, not both.");
    if (given.count("waterline")) {
      require_positive("waterline", raw.waterline);
      options.waterline_mm = raw.waterline;
    }
    if (given.count("submerged")) {
      if (!(raw.submerged > 0 && raw.submerged < 1))
        usage_error("--submerged must lie between 0 and 1; it is " + shown(raw.submerged) + ".");
      options.submerged_fraction = raw.submerged;
    }
  }
  if (options.command == Command::stand) {
    if (raw.objective != "lowest" && raw.objective != "tip-angle")
      usage_error("--objective is lowest or tip-angle; it is '" + raw.objective + "'.");
    options.tip_angle = raw.objective == "tip-angle";
    if (!raw.target.empty()) {
      const std::vector<double> t = parse_numbers("target", raw.target);
      if (t.size() != 3) usage_error("--target takes X,Y,Z; it is '" + raw.target + "'.");
      options.target_mm = Eigen::Vector3d(t[0], t[1], t[2]);
    }
    if (given.count("contact")) {
      require_positive("contact", raw.contact);
      options.contact_mm = raw.contact;
    }
  }
  if (options.command == Command::float_upright || options.command == Command::spin || options.command == Command::stand) {
    if (raw.resolution < 20 || raw.resolution > 1000)
      usage_error("--resolution must lie between 20 and 1000; it is " + shown(raw.resolution) + ".");
    options.resolution = raw.resolution;
    options.output =
        raw.output.empty()
            ? std::filesystem::path(options.input.stem().string() + (options.command == Command::spin    ? "_spin.stl"
                                                                     : options.command == Command::stand ? "_stand.stl"
                                                                                                         : "_float.stl"))
            : std::filesystem::path(raw.output);
    if (!can_write(options.output))
      usage_error("Cannot tell what to write from the name '" + options.output.string() + "': end it in .stl, .obj, .ply or .3mf.");
  }
  options.original = raw.original;
  const auto same = [](const std::filesystem::path& a, const std::filesystem::path& b) {
    std::error_code ignored;
    return !a.empty() && !b.empty() && (std::filesystem::equivalent(a, b, ignored) || a.lexically_normal() == b.lexically_normal());
  };
  if (same(options.output, options.input))
    usage_error("The output '" + options.output.string() + "' is the input itself: choose another name with --output.");
  for (const auto& mesh : {options.input, options.original, options.output})
    if (same(options.report, mesh))
      usage_error("The report '" + options.report.string() + "' would overwrite a mesh: choose another name with --report.");

  const auto note = [&options](const char* name, const std::string& value) { options.in_force.emplace_back(name, value); };
  note("unit", raw.unit);
  note("size", options.size_mm ? shown(*options.size_mm) : "as it is");
  note("up", raw.up);
  note("density", shown(options.density_g_cm3));
  if (options.command == Command::stand) {
    note("target", raw.target.empty() ? "auto" : raw.target);
    note("objective", raw.objective);
    note("contact", options.contact_mm ? shown(*options.contact_mm) : "auto");
    note("wall", shown(options.wall_mm));
    note("resolution", shown(options.resolution));
  }
  if (options.command == Command::spin) {
    note("point", options.yoyo ? "yo-yo" : raw.point);
    note("center", raw.centre.empty() ? "auto" : raw.centre);
    note("prefer", raw.prefer);
    note("objective", raw.objective);
    note("lambda", shown(options.weights.lambda));
    note("gamma-c", shown(options.weights.gamma_c));
    note("gamma-i", shown(options.weights.gamma_i));
    note("bounds", raw.bounds);
    note("wall", shown(options.wall_mm));
    note("resolution", shown(options.resolution));
  }
  if (options.command == Command::float_upright || options.command == Command::verify) {
    note("fluid", shown(options.fluid_g_cm3));
    note("waterline", options.waterline_mm         ? shown(*options.waterline_mm)
                      : options.submerged_fraction ? shown(*options.submerged_fraction) + " of the height"
                                                   : "auto");
    note("wall", shown(options.wall_mm));
  }
  if (options.command == Command::float_upright) note("resolution", shown(options.resolution));
  note("threads", options.threads ? shown(options.threads) : "all");
  return options;
}

}  // namespace rayrep::tool
