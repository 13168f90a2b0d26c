#include "options.h"

#include <algorithm>
#include <boost/program_options.hpp>
#include <cctype>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <sstream>

#include "rayrep/base/error.h"
#include "rayrep/physics/materials.h"

namespace po = boost::program_options;

namespace rayrep::tool {
namespace {

constexpr const char* kOverview =
    "rayrep computes the inside of a 3D shape so that its print floats upright, spins, stands or has\n"
    "the mass, centre of mass and inertia that you want.\n"
    "\n"
    "  rayrep float MESH     hollow MESH so that it floats upright; writes MESH_float.stl\n"
    "  rayrep spin MESH      hollow MESH so that it spins as a top or a yo-yo; writes MESH_spin.stl\n"
    "  rayrep stand MESH     hollow MESH so that it stands as safely as it can; writes MESH_stand.stl\n"
    "  rayrep target MESH    hollow MESH to a given mass, centre of mass, inertia; writes MESH_target.stl\n"
    "  rayrep verify MESH    judge a hollowed mesh: does it float upright, spin, stand, fit its target?\n"
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
  std::string input, unit, up, material, output, original, report, goal, point, centre, objective, bounds, prefer, target;
  std::string axis;
  double max_tilt = 0;
  std::string solver, com, inertia, minimise, urdf, mjcf;
  double contact = 0, mass = 0;
  double lambda = 0, gamma_c = 0, gamma_i = 0;
  double size = 0, density = 0, fluid = 0, waterline = 0, submerged = 0, wall = 0;
  int resolution = 0, threads = 0;
};

using Given = po::variables_map;

// What can be given. What several commands share is declared once.

po::options_description shape_options(Raw& raw) {
  po::options_description options("The mesh");
  auto add = options.add_options();
  add("unit", po::value(&raw.unit)->value_name("UNIT")->default_value("mm"), "of the file: mm, cm, m, in (a 3MF has its own)");
  add("size", po::value(&raw.size)->value_name("MM"), "scale so that the longest side is MM");
  add("up", po::value(&raw.up)->value_name("DIR")->default_value("z"), "what points up: x, y, z, -x, -y, -z or X,Y,Z");
  return options;
}

void add_density(po::options_description& options, Raw& raw) {
  auto add = options.add_options();
  add("density", po::value(&raw.density)->value_name("G_CM3"), "density of the print (default 1.24, PLA)");
  add("material", po::value(&raw.material)->value_name("NAME"), "or of: abs asa hips nylon pc petg pla pp resin tpu");
}

void add_wall(po::options_description& options, Raw& raw) {
  options.add_options()("wall", po::value(&raw.wall)->value_name("MM")->default_value(1.2, "1.2"), "smallest wall thickness");
}

void add_resolution(po::options_description& options, Raw& raw, int usual) {
  options.add_options()("resolution", po::value(&raw.resolution)->value_name("N")->default_value(usual),
                        "rays along the longest side, 20 to 1000");
}

void add_solver(po::options_description& options, Raw& raw) {
  options.add_options()("solver", po::value(&raw.solver)->value_name("NAME")->default_value("quadric"),
                        "quadric (exact), or by Ipopt: rays (the paper's), voxels, octree");
}

void add_inertial(po::options_description& options, Raw& raw) {
  auto add = options.add_options();
  add("mass", po::value(&raw.mass)->value_name("G"), "wanted mass");
  add("com", po::value(&raw.com)->value_name("X,Y,Z"), "wanted centre of mass, mm; 0,0,- leaves z free");
  add("inertia", po::value(&raw.inertia)->value_name("I"), "Ixx,Iyy,Izz[,Ixy,Iyz,Ixz] about it, g mm2; - free");
}

void add_inertial_files(po::options_description& options, Raw& raw) {
  auto add = options.add_options();
  add("urdf", po::value(&raw.urdf)->value_name("FILE"), "write the <inertial> element of URDF, in kg and m");
  add("mjcf", po::value(&raw.mjcf)->value_name("FILE"), "and that of MuJoCo's MJCF");
}

void add_fluid(po::options_description& options, Raw& raw) {
  auto add = options.add_options();
  add("fluid", po::value(&raw.fluid)->value_name("G_CM3")->default_value(1.0, "1.0"), "density of the fluid");
  add("waterline", po::value(&raw.waterline)->value_name("MM"), "height of the waterline above the lowest point");
  add("submerged", po::value(&raw.submerged)->value_name("FRACTION"), "or the fraction of the height under water, 0 to 1");
}

void add_point(po::options_description& options, Raw& raw) {
  options.add_options()("point", po::value(&raw.point)->value_name("P")->default_value("lowest"),
                        "contact: lowest, com (below the solid's), auto, X,Y (leaves MESH below there), X,Y,Z");
}

void add_centre_and_axis(po::options_description& options, Raw& raw) {
  auto add = options.add_options();
  add("center", po::value(&raw.centre)->value_name("X,Y,Z"), "of a yo-yo (default: middle of the bounding box)");
  add("prefer", po::value(&raw.prefer)->value_name("AXIS")->default_value("largest"), "largest or smallest principal moment");
}

void add_target(po::options_description& options, Raw& raw, const char* unless_given) {
  options.add_options()("target", po::value(&raw.target)->value_name("X,Y,Z"), unless_given);
}

void add_contact(po::options_description& options, Raw& raw) {
  options.add_options()("contact", po::value(&raw.contact)->value_name("MM"), "height that still counts as touching the ground");
}

void add_common(po::options_description& options, Raw& raw, bool with_report) {
  auto add = options.add_options();
  if (with_report) add("report", po::value(&raw.report)->value_name("FILE"), "write everything to a JSON file");
  add("quiet,q", "no summary, no progress");
  add("verbose,v", "also stages and timings");
  add("threads", po::value(&raw.threads)->value_name("N"), "use at most N threads (default: all cores)");
  add("help,h", "this text");
}

/// The files of a command that writes a mesh.
po::options_description output_files(Raw& raw, const char* help) {
  po::options_description files("Files");
  files.add_options()("output,o", po::value(&raw.output)->value_name("FILE"), help);
  files.add_options()("suggest", "if it fails, print command lines that would not");
  add_common(files, raw, true);
  return files;
}

void declare_float(po::options_description& all, Raw& raw) {
  po::options_description options("Floating");
  add_fluid(options, raw);
  add_density(options, raw);
  add_wall(options, raw);
  add_resolution(options, raw, 200);
  add_solver(options, raw);
  all.add(options).add(output_files(raw, "where to write: .stl .obj .ply .3mf (default MESH_float.stl)"));
}

void declare_spin(po::options_description& all, Raw& raw) {
  po::options_description options("Spinning");
  add_point(options, raw);
  options.add_options()("yoyo", "a yo-yo: no tip, the centre of mass at --center");
  add_centre_and_axis(options, raw);
  auto add = options.add_options();
  add("objective", po::value(&raw.objective)->value_name("NAME")->default_value("rayreps"),
      "rayreps (Wu 2016) or spinit (Baecher 2014)");
  add("lambda", po::value(&raw.lambda)->value_name("W")->default_value(0.1, "0.1"),
      "rayreps: weight of the centre of mass's height");
  add("gamma-c", po::value(&raw.gamma_c)->value_name("W")->default_value(1.0, "1"), "spinit: weight of its static moment squared");
  add("gamma-i", po::value(&raw.gamma_i)->value_name("W")->default_value(1.0, "1"), "weight of the inertia ratio");
  add("bounds", po::value(&raw.bounds)->value_name("B")->default_value("complete"),
      "of --solver rays: complete, or the paper's: paper");
  add_density(options, raw);
  add_wall(options, raw);
  add_resolution(options, raw, 100);
  add_solver(options, raw);
  add("axis", po::value(&raw.axis)->value_name("A")->default_value("up"), "up, or auto: searched within --max-tilt of it");
  add("max-tilt", po::value(&raw.max_tilt)->value_name("DEG")->default_value(15.0, "15"), "for --axis auto");
  add("certify", "search for the global optimum and prove it");
  all.add(options).add(output_files(raw, "where to write: .stl .obj .ply .3mf (default MESH_spin.stl)"));
}

void declare_stand(po::options_description& all, Raw& raw) {
  po::options_description options("Standing");
  add_target(options, raw, "where the centre of mass shall be, seen from above (default: the safest point of the support)");
  options.add_options()("objective", po::value(&raw.objective)->value_name("NAME")->default_value("lowest"),
                        "lowest: the lowest centre of mass; tip-angle: the largest smallest tipping angle");
  add_contact(options, raw);
  add_density(options, raw);
  add_wall(options, raw);
  add_resolution(options, raw, 200);
  add_solver(options, raw);
  all.add(options).add(output_files(raw, "where to write: .stl .obj .ply .3mf (default MESH_stand.stl)"));
}

void declare_target(po::options_description& all, Raw& raw) {
  po::options_description options("Wanted (any of the ten numbers)");
  add_inertial(options, raw);
  options.add_options()("minimise", po::value(&raw.minimise)->value_name("ORDER")->default_value("mass"),
                        "the rest: of mass com_x com_y com_z ixx ... ixz, the first first; -ixx: largest");
  add_density(options, raw);
  add_wall(options, raw);
  add_resolution(options, raw, 200);
  po::options_description files = output_files(raw, "where to write: .stl .obj .ply .3mf (default MESH_target.stl)");
  add_inertial_files(files, raw);
  all.add(options).add(files);
}

void declare_verify(po::options_description& all, Raw& raw) {
  po::options_description judging("Judging");
  judging.add_options()("goal", po::value(&raw.goal)->value_name("GOAL")->default_value("float"),
                        "float, spin, yoyo, stand or target");
  add_density(judging, raw);
  add_wall(judging, raw);
  judging.add_options()("original", po::value(&raw.original)->value_name("FILE"), "required outer surface, of --unit and --size");
  po::options_description floating("Goal float");
  add_fluid(floating, raw);
  po::options_description spinning("Goals spin and yoyo");
  add_point(spinning, raw);
  add_centre_and_axis(spinning, raw);
  po::options_description standing("Goal stand; goal target (any of the ten numbers)");
  add_target(standing, raw, "where the centre of mass shall be, seen from above");
  add_contact(standing, raw);
  add_inertial(standing, raw);
  po::options_description files("Files");
  add_common(files, raw, true);
  all.add(judging).add(floating).add(spinning).add(standing).add(files);
}

void declare_inspect(po::options_description& all, Raw& raw) {
  po::options_description output("Output");
  add_density(output, raw);
  output.add_options()("json", "JSON on standard output");
  add_inertial_files(output, raw);
  add_common(output, raw, false);
  all.add(output);
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
    static const std::set<std::string> vectors = {"--up", "--point", "--center", "--target", "--com", "--inertia", "--minimise"};
    if (vectors.contains(name) && n + 1 < argc) arguments.back() += std::string("=") + argv[++n];
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

/// As parse_numbers, with - for a number that is not wanted.
std::vector<std::optional<double>> parse_wanted(const char* name, const std::string& text) {
  std::vector<std::optional<double>> numbers;
  std::istringstream in(text);
  for (std::string part; std::getline(in, part, ',');)
    numbers.push_back(part == "-" ? std::nullopt : std::optional(parse_numbers(name, part).at(0)));
  return numbers;
}

Eigen::Vector3d parse_point(const char* name, const std::string& text) {
  const std::vector<double> c = parse_numbers(name, text);
  if (c.size() != 3) usage_error(std::string("--") + name + " takes X,Y,Z; it is '" + text + "'.");
  return {c[0], c[1], c[2]};
}

/// Whether `text` is the first of the two it may be.
bool is_first(const char* name, const std::string& text, const char* first, const char* second) {
  if (text != first && text != second)
    usage_error(std::string("--") + name + " is " + first + " or " + second + "; it is '" + text + "'.");
  return text == first;
}

void note(Options& options, const char* name, const std::string& value) { options.in_force.emplace_back(name, value); }

// What was given, checked, and noted for the report.

void read_shape(const Raw& raw, const Given& given, Options& options) {
  options.input = raw.input;
  options.unit = parse_length_unit(raw.unit);
  if (given.count("size")) {
    require_positive("size", raw.size);
    options.size_mm = raw.size;
  }
  options.up = parse_direction(raw.up);
  note(options, "unit", raw.unit);
  note(options, "size", options.size_mm ? shown(*options.size_mm) : "as it is");
  note(options, "up", raw.up);
}

void read_density(const Raw& raw, const Given& given, Options& options) {
  if (given.count("density") && given.count("material")) usage_error("Give either --density or --material, not both.");
  if (given.count("material")) options.density_g_cm3 = material(raw.material).density_g_cm3;
  if (given.count("density")) options.density_g_cm3 = raw.density;
  require_positive("density", options.density_g_cm3);
  note(options, "density", shown(options.density_g_cm3));
}

void read_common(const Raw& raw, const Given& given, Options& options) {
  if (given.count("threads")) {
    if (raw.threads < 1 || raw.threads > 1024)
      usage_error("--threads must lie between 1 and 1024; it is " + shown(raw.threads) + ".");
    options.threads = raw.threads;
  }
  options.json = given.count("json") > 0;
  options.quiet = given.count("quiet") > 0;
  options.verbose = given.count("verbose") > 0;
  options.report = raw.report;
  note(options, "threads", options.threads ? shown(options.threads) : "all");
}

void read_wall(const Raw& raw, Options& options) {
  options.wall_mm = raw.wall;
  require_positive("wall", raw.wall);
  note(options, "wall", shown(options.wall_mm));
}

void read_solver(const Raw& raw, const Given& given, Options& options) {
  // The paper's bounds are those of its own solver.
  const bool paper = raw.bounds == "paper";
  const std::string name = paper && given["solver"].defaulted() ? "rays" : raw.solver;
  if (name == "quadric")
    options.solver = Solver::quadric;
  else if (name == "rays")
    options.solver = Solver::rays;
  else if (name == "voxels")
    options.solver = Solver::voxels;
  else if (name == "octree")
    options.solver = Solver::octree;
  else
    usage_error("--solver is quadric, rays, voxels or octree; it is '" + name + "'.");
  if (paper && options.solver != Solver::rays)
    usage_error("--bounds paper belongs to --solver rays; this is --solver " + name + ".");
  note(options, "solver", name);
}

/// The ten numbers that are wanted.
void read_inertial(const Raw& raw, const Given& given, Options& options) {
  if (given.count("mass")) {
    require_positive("mass", raw.mass);
    options.wanted[M1] = raw.mass;
  }
  if (!raw.com.empty()) {
    const auto com = parse_wanted("com", raw.com);
    if (com.size() != 3) usage_error("--com takes X,Y,Z, with - where it is free; it is '" + raw.com + "'.");
    std::copy(com.begin(), com.end(), options.wanted.begin() + MX);
  }
  if (!raw.inertia.empty()) {
    const auto inertia = parse_wanted("inertia", raw.inertia);
    if (inertia.size() != 3 && inertia.size() != 6)
      usage_error("--inertia takes Ixx,Iyy,Izz or Ixx,Iyy,Izz,Ixy,Iyz,Ixz, with - where it is free; it is '" + raw.inertia + "'.");
    std::copy(inertia.begin(), inertia.end(), options.wanted.begin() + MXX);
  }
  if (std::none_of(options.wanted.begin(), options.wanted.end(), [](const auto& w) { return w.has_value(); }))
    usage_error("Say which numbers are wanted: --mass, --com or --inertia.");
  note(options, "mass", options.wanted[M1] ? shown(raw.mass) : "free");
  note(options, "com", raw.com.empty() ? "free" : raw.com);
  note(options, "inertia", raw.inertia.empty() ? "free" : raw.inertia);
}

/// "mass,-ixx"
std::vector<TargetGoal::Wish> parse_order(const std::string& text) {
  std::vector<TargetGoal::Wish> order;
  std::istringstream in(text);
  for (std::string part; std::getline(in, part, ',');) {
    TargetGoal::Wish wish;
    wish.largest = part.rfind('-', 0) == 0;
    const std::string name = part.substr(wish.largest ? 1 : 0);
    int k = M1;
    while (k <= MXZ && name != inertial_name(static_cast<MomentIndex>(k))) ++k;
    if (k > MXZ)
      usage_error(
          "--minimise takes a list of mass, com_x, com_y, com_z, ixx, iyy, izz, ixy, iyz and ixz, with - before what "
          "shall be largest; it has '" +
          part + "'.");
    wish.number = static_cast<MomentIndex>(k);
    order.push_back(wish);
  }
  return order;
}

void read_inertial_files(const Raw& raw, Options& options) {
  options.urdf = raw.urdf;
  options.mjcf = raw.mjcf;
}

/// What every command that hollows takes.
void read_building(const Raw& raw, const Given& given, const char* suffix, Options& options) {
  read_wall(raw, options);
  if (raw.resolution < 20 || raw.resolution > 1000)
    usage_error("--resolution must lie between 20 and 1000; it is " + shown(raw.resolution) + ".");
  options.resolution = raw.resolution;
  note(options, "resolution", shown(options.resolution));
  options.suggest = given.count("suggest") > 0;
  options.output = raw.output.empty() ? options.input.stem().string() + suffix : raw.output;
  if (!can_write(options.output))
    usage_error("Cannot tell what to write from the name '" + options.output.string() + "': end it in .stl, .obj, .ply or .3mf.");
}

void read_fluid(const Raw& raw, const Given& given, Options& options) {
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
  note(options, "fluid", shown(options.fluid_g_cm3));
  note(options, "waterline",
       options.waterline_mm         ? shown(*options.waterline_mm)
       : options.submerged_fraction ? shown(*options.submerged_fraction) + " of the height"
                                    : "auto");
}

void read_point(const Raw& raw, Options& options) {
  SpinAxis& axis = options.axis;
  if (raw.point == "lowest") return;
  if (options.yoyo) usage_error("--point belongs to tops; a yo-yo has a --center.");
  if (raw.point == "com") {
    axis.through = SpinAxis::Through::centre_of_mass;
    return;
  }
  if (raw.point == "auto") {
    if (options.command == Command::verify) usage_error("--point auto searches; to verify, give the point that was found.");
    axis.through = SpinAxis::Through::best;
    return;
  }
  const std::vector<double> c = parse_numbers("point", raw.point);
  if (c.size() != 2 && c.size() != 3) usage_error("--point takes lowest, com, auto, X,Y or X,Y,Z; it is '" + raw.point + "'.");
  axis.through = SpinAxis::Through::point;
  axis.leaves_below = c.size() == 2;
  axis.point_mm = Eigen::Vector3d(c[0], c[1], c.size() == 3 ? c[2] : 0);
  if (axis.leaves_below && std::abs(options.up.normalized().z()) < 1 - 1e-12)
    usage_error("--point X,Y needs the up direction z or -z; give X,Y,Z.");
}

/// Where a top or a yo-yo (options.yoyo) spins and about which axis.
void read_axis(const Raw& raw, Options& options) {
  if (!raw.centre.empty()) {
    if (!options.yoyo) usage_error("--center belongs to --yoyo; a top has a --point.");
    options.centre_mm = parse_point("center", raw.centre);
  }
  read_point(raw, options);
  options.largest = is_first("prefer", raw.prefer, "largest", "smallest");
  note(options, "point", options.yoyo ? "yo-yo" : raw.point);
  note(options, "center", raw.centre.empty() ? "auto" : raw.centre);
  note(options, "prefer", raw.prefer);
}

void read_support(const Raw& raw, const Given& given, Options& options) {
  if (!raw.target.empty()) options.target_mm = parse_point("target", raw.target);
  if (given.count("contact")) {
    require_positive("contact", raw.contact);
    options.contact_mm = raw.contact;
  }
  const char* none_given = options.command == Command::verify ? "none" : "auto";
  note(options, "target", raw.target.empty() ? none_given : raw.target);
  note(options, "contact", options.contact_mm ? shown(*options.contact_mm) : "auto");
}

void read_float(const Raw& raw, const Given& given, Options& options) {
  read_fluid(raw, given, options);
  read_solver(raw, given, options);
  read_building(raw, given, "_float.stl", options);
}

void read_spin(const Raw& raw, const Given& given, Options& options) {
  options.yoyo = given.count("yoyo") > 0;
  read_axis(raw, options);
  options.bounds = is_first("bounds", raw.bounds, "complete", "paper") ? SegmentBounds::complete : SegmentBounds::paper;
  const bool rayreps = is_first("objective", raw.objective, "rayreps", "spinit");
  for (const auto& [name, weight] : {std::pair{"lambda", raw.lambda}, {"gamma-c", raw.gamma_c}, {"gamma-i", raw.gamma_i}})
    if (!(weight >= 0) || !std::isfinite(weight)) usage_error(std::string("--") + name + " must not be negative.");
  SpinGoal::Weights& weights = options.weights;
  weights = {.lambda = rayreps ? raw.lambda : 0, .gamma_c = rayreps ? 0 : raw.gamma_c, .gamma_i = raw.gamma_i};
  if (options.yoyo) weights.lambda = weights.gamma_c = 0;
  note(options, "objective", raw.objective);
  note(options, "lambda", shown(weights.lambda));
  note(options, "gamma-c", shown(weights.gamma_c));
  note(options, "gamma-i", shown(weights.gamma_i));
  note(options, "bounds", raw.bounds);
  const bool search = !is_first("axis", raw.axis, "up", "auto");
  if (search && !(raw.max_tilt > 0 && raw.max_tilt <= 90))
    usage_error("--max-tilt must lie between 0 and 90 degrees; it is " + shown(raw.max_tilt) + ".");
  if (!search && !given["max-tilt"].defaulted()) usage_error("--max-tilt belongs to --axis auto.");
  if (search) options.max_tilt_rad = raw.max_tilt * std::numbers::pi / 180;
  options.certify = given.count("certify") > 0;
  if (options.certify && (!options.largest || weights.gamma_c > 0))
    usage_error("--certify proves optima for --prefer largest and --objective rayreps, and of yo-yos.");
  note(options, "axis", raw.axis);
  note(options, "max-tilt", search ? shown(raw.max_tilt) : "0");
  note(options, "certify", options.certify ? "yes" : "no");
  read_solver(raw, given, options);
  read_building(raw, given, "_spin.stl", options);
}

void read_stand(const Raw& raw, const Given& given, Options& options) {
  options.tip_angle = !is_first("objective", raw.objective, "lowest", "tip-angle");
  read_support(raw, given, options);
  note(options, "objective", raw.objective);
  read_solver(raw, given, options);
  read_building(raw, given, "_stand.stl", options);
}

void read_target(const Raw& raw, const Given& given, Options& options) {
  read_inertial(raw, given, options);
  options.order = parse_order(raw.minimise);
  note(options, "minimise", raw.minimise);
  read_building(raw, given, "_target.stl", options);
  read_inertial_files(raw, options);
}

/// @throws Error{usage} for an option that another goal has
void refuse_other_goals(const Given& given, const std::string& goal) {
  struct Owner {
    const char* option;
    std::vector<std::string> goals;
  };
  const Owner owners[] = {{"fluid", {"float"}}, {"waterline", {"float"}},     {"submerged", {"float"}}, {"point", {"spin"}},
                          {"center", {"yoyo"}}, {"prefer", {"spin", "yoyo"}}, {"target", {"stand"}},    {"contact", {"stand"}},
                          {"mass", {"target"}}, {"com", {"target"}},          {"inertia", {"target"}}};
  for (const Owner& owner : owners) {
    if (!given.count(owner.option) || given[owner.option].defaulted()) continue;
    if (std::find(owner.goals.begin(), owner.goals.end(), goal) != owner.goals.end()) continue;
    std::string belongs = "--goal " + owner.goals.front();
    for (std::size_t n = 1; n < owner.goals.size(); ++n) belongs += " or " + owner.goals[n];
    usage_error(std::string("--") + owner.option + " belongs to " + belongs + "; this is --goal " + goal + ".");
  }
}

void read_verify(const Raw& raw, const Given& given, Options& options) {
  if (raw.goal != "float" && raw.goal != "spin" && raw.goal != "yoyo" && raw.goal != "stand" && raw.goal != "target")
    usage_error("--goal is float, spin, yoyo, stand or target; it is '" + raw.goal + "'.");
  refuse_other_goals(given, raw.goal);
  note(options, "goal", raw.goal);
  if (raw.goal == "float") {
    options.goal = Command::float_upright;
    read_fluid(raw, given, options);
  } else if (raw.goal == "stand") {
    options.goal = Command::stand;
    read_support(raw, given, options);
  } else if (raw.goal == "target") {
    options.goal = Command::target;
    read_inertial(raw, given, options);
  } else {
    options.goal = Command::spin;
    options.yoyo = raw.goal == "yoyo";
    read_axis(raw, options);
  }
  read_wall(raw, options);
  options.original = raw.original;
}

void read_inspect(const Raw& raw, const Given&, Options& options) { read_inertial_files(raw, options); }

/// A command: its word, the first lines of its help, its options beside those of the mesh, and how they are read.
struct Syntax {
  const char* word;
  Command command;
  const char* headline;
  void (*declare)(po::options_description&, Raw&);
  void (*read)(const Raw&, const Given&, Options&);
};

constexpr Syntax kCommands[] = {
    {"float", Command::float_upright, "rayrep float MESH [options]: hollow MESH so that it floats upright.\n", declare_float,
     read_float},
    {"spin", Command::spin, "rayrep spin MESH [options]: hollow MESH so that it spins about the up direction.\n", declare_spin,
     read_spin},
    {"stand", Command::stand, "rayrep stand MESH [options]: hollow MESH so that it stands with the up direction up.\n",
     declare_stand, read_stand},
    {"target", Command::target,
     "rayrep target MESH [options]: hollow MESH to a given mass, centre of mass and inertia, any of them.\n"
     "Inertia needs the centre of mass it is about: Ixx its y and z, Ixy its x or y. Axes of MESH.\n",
     declare_target, read_target},
    {"verify", Command::verify,
     "rayrep verify MESH [options]: judge from its triangles whether MESH floats, spins, stands ...\n"
     "Without --waterline or --submerged it floats where it displaces its own mass. The solid that\n"
     "--point com means is --original; without that, MESH with its cavities filled.\n",
     declare_verify, read_verify},
    {"inspect", Command::inspect,
     "rayrep inspect MESH [options]: size, volume, mass, centre of mass, inertia and defects of MESH.\n", declare_inspect,
     read_inspect},
};

/// @throws Error{usage} with the commands there are
const Syntax& syntax_of(const std::string& word) {
  std::string known;
  for (const Syntax& syntax : kCommands) {
    if (word == syntax.word) return syntax;
    known += (known.empty() ? "" : ", ") + std::string(syntax.word);
  }
  usage_error("There is no command '" + word + "'. Known: " + known + "; 'rayrep --help' says more.");
}

Given parse(int argc, const char* const* argv, const po::options_description& options, Raw& raw) {
  po::options_description accepted;
  accepted.add(options);
  accepted.add_options()("input", po::value(&raw.input));
  po::positional_options_description positional;
  positional.add("input", 1);
  Given given;
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
    usage_error(std::string(error.what()) + ". 'rayrep " + argv[1] + " --help' lists the options.");
  }
  return given;
}

/// @throws Error{usage} when an output would overwrite what is read
void refuse_overwriting(const Options& options) {
  const auto same = [](const std::filesystem::path& a, const std::filesystem::path& b) {
    std::error_code ignored;
    return !a.empty() && !b.empty() && (std::filesystem::equivalent(a, b, ignored) || a.lexically_normal() == b.lexically_normal());
  };
  if (same(options.output, options.input))
    usage_error("The output '" + options.output.string() + "' is the input itself: choose another name with --output.");
  const std::pair<const char*, std::filesystem::path> texts[] = {
      {"report", options.report}, {"urdf", options.urdf}, {"mjcf", options.mjcf}};
  for (const auto& [name, text] : texts) {
    for (const auto& mesh : {options.input, options.original, options.output})
      if (same(text, mesh))
        usage_error("The " + std::string(name) + " '" + text.string() + "' would overwrite a mesh: choose another name with --" +
                    name + ".");
    for (const auto& [other, path] : texts)
      if (name != other && same(text, path)) usage_error("--" + std::string(name) + " and --" + other + " name the same file.");
  }
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

std::string quoted(const std::string& word) {
  const auto plain = [](unsigned char c) { return std::isalnum(c) || c == '.' || c == ',' || c == '/' || c == '_' || c == '-'; };
  if (std::all_of(word.begin(), word.end(), plain)) return word;
  std::string text = "'";
  for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return text + "'";
}

std::string remedied(int argc, const char* const* argv, const std::string& remedy) {
  // An option and those that say the same in other words.
  static const std::map<std::string, std::set<std::string>> replaces = {
      {"--waterline", {"--waterline", "--submerged"}}, {"--density", {"--density", "--material"}}, {"--up", {"--up", "--axis"}}};
  const std::string name = remedy.substr(0, remedy.find(' '));
  const auto found = replaces.find(name);
  const std::set<std::string> gone = found != replaces.end() ? found->second : std::set<std::string>{name};
  std::string text = "rayrep";
  for (int n = 1; n < argc; ++n) {
    const std::string word = argv[n];
    const auto equals = word.find('=');
    if (word == "--suggest") continue;
    if (gone.count(word.substr(0, equals))) {
      if (equals == std::string::npos) ++n;  // its value
      continue;
    }
    text += " " + quoted(word);
  }
  return text + " " + remedy;
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

  const Syntax& syntax = syntax_of(word);
  Raw raw;
  po::options_description all;
  all.add(shape_options(raw));
  syntax.declare(all, raw);
  const Given given = parse(argc, argv, all, raw);
  if (given.count("help")) {
    options.help_text = syntax.headline + text_of(all);
    return options;
  }
  if (raw.input.empty()) usage_error("Name the mesh: rayrep " + word + " MESH.");

  options.command = options.goal = syntax.command;
  read_shape(raw, given, options);
  read_density(raw, given, options);
  syntax.read(raw, given, options);
  read_common(raw, given, options);
  refuse_overwriting(options);
  return options;
}

}  // namespace rayrep::tool
