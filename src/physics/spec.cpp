#include "rayrep/physics/spec.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <numbers>
#include <utility>

#include "base/text.h"
#include "rayrep/base/error.h"
#include "rayrep/physics/materials.h"

namespace rayrep {
namespace {

using For = Setting::For;

[[noreturn]] void usage_error(const std::string& message) { throw Error(ErrorCode::usage, message); }

/// Without those that only the other purpose asks for.
Settings asked_for(Settings settings, For purpose) {
  std::erase_if(settings, [purpose](const Setting& s) { return s.applies != For::all && s.applies != purpose; });
  return settings;
}

std::string names_of(const std::vector<std::string>& all) {
  std::string names;
  for (const std::string& name : all) names += (names.empty() ? "" : " ") + name;
  return names;
}

template <typename Material_>
std::vector<std::string> words_for(const std::vector<Material_>& all) {
  std::vector<std::string> names;
  for (const Material_& m : all) names.push_back(m.name);
  return names;
}

std::string material_names() { return names_of(words_for(materials())); }
std::string core_material_names() { return names_of(words_for(core_materials())); }

std::string shown_point(const Eigen::Vector3d& p) { return shown(p.x(), 9) + "," + shown(p.y(), 9) + "," + shown(p.z(), 9); }

TextPlace optional_direction_place(const char* name, std::optional<Eigen::Vector3d>& direction, const char* unset) {
  return {[&direction, name](const std::string& text) {
            Eigen::Vector3d parsed;
            direction_place(name, parsed).parse(text);
            direction = parsed;
          },
          [&direction, unset]() -> std::string {
            if (!direction) return unset;
            Eigen::Vector3d shown = *direction;
            return direction_place("", shown).show();
          }};
}

/// @param option   that it is the value of, or a part of
/// @param subject  of a complaint
SpinAxis parse_axis(const char* option, const char* subject, const std::string& text) {
  if (text == "lowest") return {};
  if (text == "com") return {.through = SpinAxis::Through::centre_of_mass};
  if (text == "auto") return {.through = SpinAxis::Through::best};
  const bool word = !text.empty() && std::isalpha(static_cast<unsigned char>(text[0])) != 0;
  const std::vector<double> c = word ? std::vector<double>{} : parse_numbers(option, text);
  if (c.size() != 2 && c.size() != 3) usage_error(std::string(subject) + " lowest, com, auto, X,Y or X,Y,Z; it is '" + text + "'.");
  return {.through = SpinAxis::Through::point,
          .point_mm = Eigen::Vector3d(c[0], c[1], c.size() == 3 ? c[2] : 0),
          .leaves_below = c.size() == 2};
}

std::string shown_axis(const SpinAxis& axis) {
  switch (axis.through) {
    case SpinAxis::Through::lowest_point:
      return "lowest";
    case SpinAxis::Through::centre_of_mass:
      return "com";
    case SpinAxis::Through::best:
      return "auto";
    case SpinAxis::Through::point:
      break;
  }
  const std::string text = shown_point(axis.point_mm);
  return axis.leaves_below ? text.substr(0, text.rfind(',')) : text;
}

TextPlace preferred_axis(AxisClass& prefer) {
  static constexpr std::array<const char*, 2> kNames = {"largest", "smallest"};
  return {[&prefer](const std::string& text) {
            prefer = parse_choice("prefer", text, kNames) == 0 ? AxisClass::largest : AxisClass::smallest;
          },
          [&prefer] { return std::string(kNames[prefer == AxisClass::largest ? 0 : 1]); },
          {kNames.begin(), kNames.end()}};
}

/// `--axis auto` and how far it may tilt: one number.
constexpr double kUsualTilt = std::numbers::pi / 12;

TextPlace searched_axis(double& max_tilt_rad) {
  static constexpr std::array<const char*, 2> kNames = {"up", "auto"};
  return {[&max_tilt_rad](const std::string& text) { max_tilt_rad = parse_choice("axis", text, kNames) == 0 ? 0 : kUsualTilt; },
          [&max_tilt_rad] { return std::string(kNames[max_tilt_rad > 0 ? 1 : 0]); },
          {kNames.begin(), kNames.end()}};
}

TextPlace largest_tilt(double& max_tilt_rad) {
  return {[&max_tilt_rad](const std::string& text) {
            if (max_tilt_rad == 0) usage_error("--max-tilt belongs to --axis auto.");
            const std::vector<double> degrees = parse_numbers("max-tilt", text);
            if (degrees.size() != 1 || !(degrees[0] > 0 && degrees[0] <= 90))
              usage_error("--max-tilt must lie between 0 and 90 degrees; it is " + text + ".");
            max_tilt_rad = degrees[0] * std::numbers::pi / 180;
          },
          [&max_tilt_rad] { return shown(max_tilt_rad * 180 / std::numbers::pi); }};
}

/// Some of the ten numbers, from `first` on.
TextPlace wanted_numbers(const char* name, InertialTargets& wanted, MomentIndex first, std::size_t most, const char* takes) {
  return {[=, &wanted](const std::string& text) {
            const auto numbers = parse_open_numbers(name, text);
            if (numbers.size() != 3 && numbers.size() != most)
              usage_error(std::string("--") + name + " takes " + takes + ", with - where it is free; it is '" + text + "'.");
            std::copy(numbers.begin(), numbers.end(), wanted.begin() + first);
          },
          [=, &wanted] {
            std::string text;
            bool any = false;
            for (std::size_t k = 0; k < most; ++k) {
              const std::optional<double>& number = wanted[first + k];
              any = any || number;
              text += (k > 0 ? "," : "") + (number ? shown(*number, 9) : "-");
            }
            return any ? text : "free";
          }};
}

constexpr const char* kSpinRatio = "spin-ratio";

/// "mass=14,com_z=5": bounds of some of the ten numbers.
/// @param ratio  may be null: bounds of this kind have none
TextPlace bounds_place(const char* name, InertialTargets& bounds, std::optional<double>* ratio) {
  return {[=, &bounds](const std::string& text) {
            for (const std::string& part : parts_of(text)) {
              const std::size_t equals = part.find('=');
              if (part.substr(0, equals) == kSpinRatio && equals != std::string::npos) {
                if (!ratio)
                  usage_error(
                      "spin-ratio has a lower bound only, --at-least spin-ratio=1.05: the bodies with no larger one are no convex "
                      "set.");
                *ratio = parse_number(name, part.substr(equals + 1));
                continue;
              }
              int k = M1;
              while (k <= MXZ && part.substr(0, equals) != inertial_name(static_cast<MomentIndex>(k))) ++k;
              if (k > MXZ || equals == std::string::npos)
                usage_error(std::string("--") + name +
                            " takes a list like mass=14,com_z=5 with mass, com_x, com_y, com_z, ixx, iyy, izz, ixy, iyz" +
                            (ratio ? std::string(", ixz and spin-ratio") : std::string(" and ixz")) + "; it has '" + part + "'.");
              bounds[static_cast<std::size_t>(k)] = parse_number(name, part.substr(equals + 1));
            }
          },
          [&bounds, ratio] {
            std::string text;
            for (int k = M1; k <= MXZ; ++k)
              if (const std::optional<double>& bound = bounds[static_cast<std::size_t>(k)])
                text +=
                    (text.empty() ? "" : ",") + std::string(inertial_name(static_cast<MomentIndex>(k))) + "=" + shown(*bound, 9);
            if (ratio && *ratio) text += (text.empty() ? "" : ",") + std::string(kSpinRatio) + "=" + shown(**ratio, 9);
            return text.empty() ? "free" : text;
          }};
}

TextPlace order_of_wishes(std::vector<InertialWish>& order) {
  return {[&order](const std::string& text) {
            std::vector<InertialWish> wishes;
            for (const std::string& part : parts_of(text)) {
              InertialWish wish;
              wish.largest = part.rfind('-', 0) == 0;
              const std::string name = part.substr(wish.largest ? 1 : 0);
              int k = M1;
              while (k <= MXZ && name != inertial_name(static_cast<MomentIndex>(k))) ++k;
              if (k > MXZ)
                usage_error(
                    "--minimise takes a list of mass, com_x, com_y, com_z, ixx, iyy, izz, ixy, iyz and ixz, with - before "
                    "what shall be largest; it has '" +
                    part + "'.");
              wish.number = static_cast<MomentIndex>(k);
              wishes.push_back(wish);
            }
            order = std::move(wishes);
          },
          [&order] {
            std::string text;
            for (const InertialWish& wish : order)
              text += (text.empty() ? "" : ",") + std::string(wish.largest ? "-" : "") + inertial_name(wish.number);
            return text.empty() ? "mass" : text;
          }};
}

/// A density, or the name of a fluid.
TextPlace fluid_place(double& fluid_g_cm3) {
  return {[&fluid_g_cm3](const std::string& text) {
            std::vector<std::string> names;
            for (const Fluid& fluid : fluids()) {
              if (text == fluid.name) {
                fluid_g_cm3 = fluid.density_g_cm3;
                return;
              }
              names.emplace_back(fluid.name);
            }
            if (!text.empty() && std::isalpha(static_cast<unsigned char>(text[0]))) {
              std::string known;
              for (const std::string& name : names) known += (known.empty() ? "" : ", ") + name;
              const std::string meant = nearest_name(text, names);
              usage_error("There is no fluid '" + text + "'." + (meant.empty() ? "" : " Did you mean " + meant + "?") +
                          " Known: " + known + ". Or give its density: --fluid G_CM3.");
            }
            fluid_g_cm3 = parse_number("fluid", text);
          },
          [&fluid_g_cm3] { return shown(fluid_g_cm3); }};
}

/// "0.7", "70%": of the height; "0.7volume", "70%volume": of the volume; "1" and "100%": all of it.
TextPlace submerged_place(FloatSpec& spec) {
  return {[&spec](const std::string& text) {
            std::string number = text;
            const auto take = [&number](const std::string& ending) {
              if (!number.ends_with(ending)) return false;
              number.resize(number.size() - ending.size());
              return true;
            };
            const bool of_volume = take("volume");
            if (!of_volume) take("height");
            const bool percent = take("%");
            const double fraction = parse_number("submerged", number) / (percent ? 100 : 1);
            if (!(fraction > 0 && fraction <= 1)) {
              const bool meant = fraction > 1 && fraction <= 100 && !percent;
              usage_error("--submerged must lie between 0 and 1, or 0% and 100%; it is " + text + "." +
                          (meant ? " Did you mean " + number + "%?" : ""));
            }
            (of_volume ? spec.submerged_volume_fraction : spec.submerged_fraction) = fraction;
          },
          [&spec] {
            if (spec.submerged_volume_fraction) return shown(*spec.submerged_volume_fraction) + "volume";
            return spec.submerged_fraction ? shown(*spec.submerged_fraction) : std::string("auto");
          }};
}

std::string shown_direction(const Eigen::Vector3d& up) {
  for (const char* name : {"x", "y", "z", "-x", "-y", "-z"})
    if ((parse_direction(name) - up.normalized()).norm() < 1e-12) return name;
  return shown_point(up);
}

/// @param option  that it is a part of
Eigen::Vector3d up_of_pose(const char* option, const std::string& text) {
  try {
    return parse_direction(text);
  } catch (const Error&) {
    usage_error("What points up in --" + std::string(option) + " is x, y, z, -x, -y, -z or a vector such as 0,1,0.5; it is '" +
                text + "'.");
  }
}

/// "0,1,1": a direction; "1,2,3:0,1,1", "z:17.5": what else is said of the pose before or after it.
Pose parse_pose(Pose::Kind kind, const std::string& text) {
  Pose pose;
  pose.kind = kind;
  const std::size_t colon = text.find(':');
  const std::string first = text.substr(0, colon);
  const std::string second = colon == std::string::npos ? "" : text.substr(colon + 1);
  switch (kind) {
    case Pose::Kind::stands:
    case Pose::Kind::rights:
      pose.up = up_of_pose(kind == Pose::Kind::stands ? "stand" : "roly-poly", text);
      break;
    case Pose::Kind::hangs: {
      const std::vector<double> c = parse_numbers("hang", first);
      if (c.size() != 3) usage_error("--hang takes X,Y,Z or X,Y,Z:UP; it is '" + text + "'.");
      pose.point_mm = Eigen::Vector3d(c[0], c[1], c[2]);
      if (!second.empty()) pose.up = up_of_pose("hang", second);
      break;
    }
    case Pose::Kind::floats:
      pose.up = up_of_pose("float", first);
      if (!second.empty()) pose.waterline_mm = parse_number("float", second);
      break;
    case Pose::Kind::spins:
      pose.up = up_of_pose("spin", first);
      if (!second.empty()) pose.axis = parse_axis("spin", "The point of --spin is", second);
      break;
  }
  return pose;
}

std::string shown_pose(const Pose& pose, const Eigen::Vector3d& usual_up) {
  const std::string up = shown_direction(pose.up_or(usual_up));
  switch (pose.kind) {
    case Pose::Kind::stands:
    case Pose::Kind::rights:
      return up;
    case Pose::Kind::hangs:
      return shown_point(pose.point_mm) + (pose.up ? ":" + up : "");
    case Pose::Kind::spins:
      return up + (pose.axis.through == SpinAxis::Through::lowest_point ? "" : ":" + shown_axis(pose.axis));
    case Pose::Kind::floats:
      break;
  }
  return up + (pose.waterline_mm ? ":" + shown(*pose.waterline_mm, 9) : "");
}

/// All poses of a kind, with ; between them; each text adds some.
TextPlace poses_place(PoseSpec& spec, Pose::Kind kind) {
  return {[&spec, kind](const std::string& text) {
            for (std::size_t begin = 0; begin <= text.size();) {
              const std::size_t end = std::min(text.find(';', begin), text.size());
              spec.poses.push_back(parse_pose(kind, text.substr(begin, end - begin)));
              begin = end + 1;
            }
          },
          [&spec, kind] {
            std::string text;
            for (const Pose& pose : spec.poses)
              if (pose.kind == kind) text += (text.empty() ? "" : ";") + shown_pose(pose, spec.up);
            return text.empty() ? "none" : text;
          }};
}

/// "z", "0,1,1:0.4", "-x:40%".
TextPlace load_place(std::optional<DiceSpec::Load>& load) {
  return {[&load](const std::string& text) {
            const std::size_t colon = text.find(':');
            DiceSpec::Load parsed{parse_direction(text.substr(0, colon)), std::nullopt};
            if (colon != std::string::npos) {
              std::string number = text.substr(colon + 1);
              const bool percent = number.ends_with('%');
              if (percent) number.pop_back();
              parsed.share = parse_number("load", number) / (percent ? 100 : 1);
              if (!(*parsed.share > 0 && *parsed.share < 1))
                usage_error("The share in --load must lie between 0 and 1, or 0% and 100%; it is " + text.substr(colon + 1) + ".");
            }
            load = parsed;
          },
          [&load] {
            if (!load) return std::string("none");
            return shown_direction(load->up) + (load->share ? ":" + shown(*load->share) : "");
          }};
}

TextPlace faces_place(int& faces) {
  return {[&faces](const std::string& text) {
            const double count = text == "all" ? 0 : parse_number("faces", text);
            if (text != "all" && !(count >= 2 && count <= 1000 && count == std::floor(count)))
              usage_error("--faces takes a whole number from 2 to 1000, or all; it is '" + text + "'.");
            faces = static_cast<int>(count);
          },
          [&faces] { return faces == 0 ? std::string("all") : std::to_string(faces); }};
}

/// "auto", "none", "z=10;1,0,1=4"
TextPlace cut_place(Cut& cut) {
  return {[&cut](const std::string& text) {
            cut.planes.clear();
            cut.where = text == "auto" ? Cut::Where::found : text == "none" ? Cut::Where::none : Cut::Where::given;
            if (cut.where != Cut::Where::given) return;
            for (std::size_t begin = 0; begin <= text.size();) {
              const std::size_t end = std::min(text.find(';', begin), text.size());
              const std::string one = text.substr(begin, end - begin);
              const std::size_t equals = one.find('=');
              if (equals == std::string::npos)
                usage_error("--cut takes auto, none, or planes such as z=10 or 'z=10;1,0,1=4'; it is '" + text + "'.");
              cut.planes.push_back({parse_direction(one.substr(0, equals)), parse_number("cut", one.substr(equals + 1))});
              begin = end + 1;
            }
          },
          [&cut] {
            if (cut.where != Cut::Where::given) return std::string(cut.wanted() ? "auto" : "none");
            std::string text;
            for (const Cut::Plane& plane : cut.planes)
              text += (text.empty() ? "" : ";") + shown_direction(plane.normal) + "=" + shown(plane.offset_mm, 9);
            return text;
          }};
}

constexpr double kWidestGapOfBearing_mm = 5;
constexpr double kNarrowestGap_mm = 0.5;  // no string is thinner
constexpr std::array<const char*, 4> kAxles = {"none", "m4", "8mm", "bearing-608"};

/// Nothing that is printed or floated in is heavier than 25 g/cm3: then kg/m3 was meant.
void check_density(const char* name, double density_g_cm3) {
  if (!Range::positive().contains(density_g_cm3))
    usage_error(std::string("--") + name + " must be a positive number; it is " + shown(density_g_cm3) + ".");
  if (density_g_cm3 > 25)
    usage_error(std::string("--") + name + " is in g/cm3; " + shown(density_g_cm3) + " looks like kg/m3: give " +
                shown(density_g_cm3 / 1000) + ".");
}

Setting up_row(Eigen::Vector3d& up) {
  return {.name = "up",
          .value = "DIR",
          .words = "what points up: x, y, z, -x, -y, -z or X,Y,Z",
          .details = "",
          .place = direction_place("up", up)};
}

void check_up(const Eigen::Vector3d& up) {
  if (!up.allFinite() || !(up.norm() > 0)) usage_error("The up direction must be a vector that is not zero.");
}

void check_infill(const Print& print) {
  const Infill& infill = print.infill;
  if (!infill.wanted()) return;
  if (print.liquid_g_cm3 > 0) usage_error("Resin printers have no infill: leave --infill out, or choose a filament.");
  const auto plain = [](unsigned char c) { return std::isalnum(c) || c == '_' || c == '-' || c == ' '; };
  if (!std::all_of(infill.pattern.begin(), infill.pattern.end(), plain))
    usage_error("--infill-pattern is a slicer's word for it, of letters and digits; it is '" + infill.pattern + "'.");
  if (!is_uniform_infill(infill.pattern))
    usage_error("How much " + infill.pattern +
                " lays down differs from place to place, and what it weighs cannot be planned: choose another pattern, like "
                "--infill-pattern gyroid.");
  const double skin_mm = infill.skin_mm();
  if (!(print.wall_mm >= skin_mm * (1 - 1e-9)))
    usage_error("The slicer makes " + shown(skin_mm, 4) + " mm below the surface solid (" + std::to_string(infill.perimeters) +
                " perimeters of " + shown(infill.extrusion_width_mm) + " mm, " + std::to_string(infill.top_layers) + " and " +
                std::to_string(infill.bottom_layers) + " layers of " + shown(infill.layer_height_mm) +
                " mm): with infill the wall must be at least that, and it is " + shown(print.wall_mm) +
                " mm. Leave --wall out, or say fewer perimeters or layers, here and in the slicer.");
}

void check_core(const Print& print) {
  const Core& core = print.core;
  if (!core.wanted()) {
    if (core.volume_cm3 || core.partition_mm)
      usage_error("Of what is the core? Give --core-material NAME or --core-density G_CM3.");
    return;
  }
  if (core.volume_cm3 && core.partition_mm == 0.0)
    usage_error("With --core-volume the core has a room of its own: leave --core-partition out, or give more than 0.");
  if (print.infill.wanted())
    usage_error("A heavy core stands in a cavity, infill instead of one: leave --infill out, or the core.");
  check_density("core-density", core.density_g_cm3);
  if (!(core.density_g_cm3 > print.density_g_cm3))
    usage_error("A core must be heavier than what is printed (" + shown(print.density_g_cm3) + " g/cm3); it is " +
                shown(core.density_g_cm3) + " g/cm3.");
}

void check_balls(const Print& print) {
  const Balls& balls = print.balls;
  if (!balls.wanted()) return;
  check_density("ball-density", balls.density_g_cm3);
  if (print.infill.wanted()) usage_error("Balls are not placed in infill: leave --infill out, or the balls.");
  if (print.core.wanted()) usage_error("A core or balls: give either --core-material (or --core-density) or --balls.");
  if (!(balls.density_g_cm3 > print.density_g_cm3))
    usage_error("Balls must be heavier than what is printed (" + shown(print.density_g_cm3) + " g/cm3); they are " +
                shown(balls.density_g_cm3) + " g/cm3.");
}

void check_drains(const Print& print, For purpose) {
  const Drains& drains = print.drains;
  if (!drains.wanted()) {
    if (drains.plugged) usage_error("--plug closes holes that drain cavities: say --drain auto, too.");
    if (purpose == For::making && drains.diameter_mm != Drains{}.diameter_mm)
      usage_error("--drain-diameter is of holes that drain cavities: say --drain auto, too.");
    if (purpose == For::making && drains.clearance_mm != Drains{}.clearance_mm)
      usage_error("--plug-clearance is of plugs in holes that drain cavities: say --drain auto --plug, too.");
    return;
  }
  if (drains.plugged && !(drains.diameter_mm > 4 * drains.clearance_mm))
    usage_error("A plug for a hole of " + shown(drains.diameter_mm) + " mm with a clearance of " + shown(drains.clearance_mm) +
                " mm is too thin: choose a wider hole (--drain-diameter) or less clearance (--plug-clearance).");
  if (purpose != For::making) return;
  if (print.infill.wanted())
    usage_error("Sparse infill is open to its own cells only and is not drained: leave --drain out, or --infill.");
  if (print.core.wanted()) usage_error("A core closes the cavity that --drain would open: leave one of them out.");
  if (print.balls.wanted()) usage_error("Where balls lie is found without holes: leave --drain out, or --balls.");
  if (print.cut.wanted()) usage_error("A cut opens every cavity, so that it needs no holes: leave --drain out, or --cut.");
}

/// auto, none, or one more place; several have ; between them.
TextPlace drain_place(Drains& drains) {
  return {[&drains](const std::string& text) {
            if (text == "none") {
              drains = {};
              return;
            }
            if (text == "auto") {
              if (drains.where == Drains::Where::given) usage_error("--drain takes auto or places, not both.");
              drains.where = Drains::Where::found;
              return;
            }
            for (std::size_t begin = 0; begin <= text.size();) {
              const std::size_t end = std::min(text.find(';', begin), text.size());
              const std::vector<double> numbers = parse_numbers("drain", text.substr(begin, end - begin));
              if (numbers.size() != 3) usage_error("--drain takes auto, or X,Y,Z in mm; it is '" + text + "'.");
              if (drains.where != Drains::Where::given) drains.points_mm.clear();
              drains.where = Drains::Where::given;
              drains.points_mm.emplace_back(numbers[0], numbers[1], numbers[2]);
              begin = end + 1;
            }
          },
          [&drains] {
            if (drains.where != Drains::Where::given) return std::string(drains.wanted() ? "auto" : "none");
            std::string text;
            for (const auto& p : drains.points_mm) text += (text.empty() ? "" : ";") + shown_point(p);
            return text;
          }};
}

/// What resin needs, in one word.
Setting resin_row(Print& print) {
  const auto set = [&print](const std::string&) {
    print.density_g_cm3 = material("resin").density_g_cm3;
    print.liquid_g_cm3 = material("resin").liquid_g_cm3;
    if (!print.drains.wanted()) print.drains.where = Drains::Where::found;
    print.drains.plugged = true;
  };
  const auto show = [&print] { return std::string(print.liquid_g_cm3 > 0 && print.drains.plugged ? "yes" : "no"); };
  return {.name = "resin",
          .value = "",
          .words = "what resin needs: --material resin --drain auto --plug",
          .details =
              "For each cavity a hole by which the resin runs out and one for air, with plugs to close them. What stays inside all "
              "the same counts as mass, and fails (trapped_resin) if it is more than 1 % of what the cavities hold.",
          .place = TextPlace{set, show},
          .rare = true,
          .also = "material"};
}

/// Of holes that drain, and how the print is held.
Settings drain_rows(Print& print, For purpose) {
  Drains& drains = print.drains;
  return {
      {.name = "drain",
       .value = "WHERE",
       .words = "holes by which cavities drain: auto, or X,Y,Z (several times)",
       .details =
           purpose == For::judging
               ? "What of the outside is changed is taken to be holes, none wider than --drain-diameter; needs --original. How "
                 "much would stay in the cavities, held as they are printed (--print-direction), is told, with auto at most 1 %."
               : "auto: for each cavity one where it drains and one where air comes in, as it is held when it is printed "
                 "(--print-direction), and more while more than 1 % would stay inside: above the waterline unless they are "
                 "closed again (--plug), not in the support, in opposite pairs or on the axis of what spins. X,Y,Z: through the "
                 "wall at the place of the surface that is nearest to it, in mm, where it is in the body. What holes and plugs "
                 "weigh is made up for inside.",
       .place = drain_place(drains),
       .rare = true,
       .repeated = true},
      {.name = "drain-diameter",
       .value = "MM",
       .words = "of these holes",
       .details = "",
       .place = &drains.diameter_mm,
       .range = {.lo = 0.5, .hi = 50, .open = false},
       .rare = true},
      {.name = "plug",
       .value = "",
       .words = "close them again by plugs that are printed, too",
       .details = purpose == For::judging ? "Every hole must have one (--plugs, or in the 3MF file)."
                                          : "Flush with the outside and the cavity: glue them in, tight. They are objects of "
                                            "their own in a 3MF output, else a file of their own, NAME_plugs.",
       .place = &drains.plugged,
       .rare = true},
      {.name = "plug-clearance",
       .value = "MM",
       .words = "all around a plug",
       .details = "",
       .place = &drains.clearance_mm,
       .range = {.lo = 0, .hi = 1, .open = false},
       .rare = true}};
}

void check_cut(const Print& print) {
  if (!print.cut.wanted()) {
    if (print.cut.pin_diameter_mm != Cut{}.pin_diameter_mm || print.cut.clearance_mm != Cut{}.clearance_mm)
      usage_error("--pin-diameter and --pin-clearance are of pins between the pieces of --cut: say that, too.");
    return;
  }
  const std::string alone = " is not cut into pieces: leave it or --cut out.";
  if (print.infill.wanted()) usage_error("What is filled sparsely" + alone);
  if (print.core.wanted()) usage_error("A body with a heavy core" + alone);
  if (print.balls.wanted()) usage_error("A body with balls in it" + alone);
  if (print.drains.wanted())
    usage_error("The cut opens every cavity, so that nothing stays in it: leave " +
                (print.liquid_g_cm3 > 0 ? "holes out (say --material resin instead of --resin, and no --drain), or --cut."
                                        : std::string("--drain or --cut out.")));
  if (print.self_supporting_deg != 0)
    usage_error(
        "Each piece lies on its cut, another way up than the whole: --self-supporting would carry roofs that are none "
        "then. Leave it out (--cut auto looks for little overhang in the pieces), or --cut.");
  if (print.direction) usage_error("Each piece lies on its cut, however the whole is held: leave --print-direction or --cut out.");
}

void check_self_supporting(const Print& print) {
  if (print.self_supporting_deg == 0) {
    if (print.min_feature_mm) usage_error("--min-feature tells how thick pillars under roofs are: say --self-supporting, too.");
    return;
  }
  if (print.infill.wanted()) usage_error("Infill carries what lies above it: leave --self-supporting out, or the infill.");
  if (print.core.wanted() || print.balls.wanted())
    usage_error("--self-supporting does not know cores and balls: leave it out, or those.");
}

/// Of pieces and the pins between them.
Settings cut_rows(Cut& cut) {
  return {{.name = "cut",
           .value = "PLANES",
           .words = "in pieces that lie on their cuts: auto, or z=10, 'z=10;x=0'",
           .details =
               "auto: as few planes as open every cavity (one for up to three), with little overhang in the pieces lying on their "
               "cuts, a short seam and room for pins. Planes that are given are directions with an offset in mm, ; between them. "
               "All are moved by up to 0.02 mm to pass no vertex. Where there is room both sides of a cut have up to three holes "
               "for pins, the filament's own unless --pin-diameter says otherwise; they count, with the air around them. Writes "
               "3MF: pieces lie on the bed side by side, and verify sees them put together.",
           .place = cut_place(cut),
           .applies = For::making},
          {.name = "pin-diameter",
           .value = "MM",
           .words = "of the pins between pieces, of the density of the print",
           .details = "1.75: pieces of filament.",
           .place = &cut.pin_diameter_mm,
           .range = {.lo = 0.5, .hi = 20, .open = false},
           .applies = For::making,
           .rare = true},
          {.name = "pin-clearance",
           .value = "MM",
           .words = "of their holes, all around",
           .details = "",
           .place = &cut.clearance_mm,
           .range = {.lo = 0, .hi = 1, .open = false},
           .applies = For::making,
           .rare = true}};
}

/// Of what a printer cannot reach from below.
Settings roof_rows(Print& print) {
  return {
      {.name = "print-direction",
       .value = "DIR",
       .words = "of the mesh: upward on the bed (default: as it stands)",
       .details =
           "x, y, z, -x, -y, -z or X,Y,Z: how the mesh is laid on the bed in the slicer. Without it as it is to stand, float "
           "or spin (--up), and in a file for a printer z. Roofs of cavities are those seen along it.",
       .place = optional_direction_place("print-direction", print.direction, "up"),
       .rare = true},
      {.name = "self-supporting",
       .value = "DEG",
       .words = "roofs of cavities rise at least so much; alone 45, 0: any",
       .details =
           "No roof of a cavity rises less than so many degrees from the horizontal along --print-direction, so that it prints "
           "without supports inside: flatter ones are carried by cones on pillars (--min-feature). Alone it means 45. What that "
           "costs of the goal is told. A spin for which no direction is given may be made to be printed lying, if that costs less.",
       .place = &print.self_supporting_deg,
       .range = {.lo = 0, .hi = 75, .open = false},
       .applies = For::making,
       .alone = "45"},
      {.name = "min-feature",
       .value = "MM",
       .words = "so thick are the pillars of --self-supporting (default: the wall)",
       .details =
           "Thinner ones take less of the room inside, thicker ones print more safely: what two perimeters give is the least.",
       .place = &print.min_feature_mm,
       .range = {.lo = 0.2, .hi = 50, .open = false},
       .unset = "wall",
       .applies = For::making,
       .rare = true}};
}

template <typename Spec>
void check_rows(const Spec& spec, For purpose) {
  Spec copy = spec;
  check(settings(copy, purpose));
  check(settings(copy.print, purpose));
  check(settings(copy.print.infill, purpose));
  check(settings(copy.print.core, purpose));
  check(settings(copy.print.balls, purpose));
  if (purpose == For::making) {
    check_infill(spec.print);
    check_core(spec.print);
    check_balls(spec.print);
    check_cut(spec.print);
    check_self_supporting(spec.print);
  }
  check_drains(spec.print, purpose);
  check_up(spec.up);
  check_density("density", spec.print.density_g_cm3);
}

void require_centre_for(MomentIndex number, const InertialTargets& targets) {
  const std::string missing = missing_for(number, targets);
  if (!missing.empty())
    usage_error(std::string("Inertia targets need the centre of mass: ") + inertial_name(number) +
                " is about the centre of mass and can be met only with its coordinates " + missing + " given (--com).");
}

void check_inertia(const InertialTargets& targets) {
  const auto wanted = [&targets](MomentIndex number) { return targets[static_cast<std::size_t>(number)]; };
  if (!wanted(MXX) || !wanted(MYY) || !wanted(MZZ)) return;
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
  inertia.diagonal() << *wanted(MXX), *wanted(MYY), *wanted(MZZ);
  // The diagonal alone must keep the rule, and so must all six together.
  bool physical = is_physical(inertia);
  if (wanted(MXY) && wanted(MYZ) && wanted(MXZ)) {
    inertia(0, 1) = inertia(1, 0) = *wanted(MXY);
    inertia(1, 2) = inertia(2, 1) = *wanted(MYZ);
    inertia(0, 2) = inertia(2, 0) = *wanted(MXZ);
    physical = physical && is_physical(inertia);
  }
  if (!physical)
    usage_error(
        "No body has this inertia: the tensor must be positive definite and no moment larger than the sum of the other two.");
}

}  // namespace

Settings settings(Infill& infill, For purpose) {
  static constexpr std::array<const char*, 2> kCavities = {"void", "infill"};
  constexpr double kUsualPercent = 15;
  return asked_for(
      {{.name = "cavity",
        .value = "KIND",
        .words = "void, or infill: printed sparsely, like --infill 15",
        .details =
            "void: closed cavities, everything else solid. infill: no cavity; the slicer fills so much of the inside with sparse "
            "infill, and makes the rest solid. Nothing hangs over a void then and nothing is sealed in, but it does not get as "
            "light. Needs a 3MF output, in which the sparse region is a modifier.",
        .place = TextPlace{[&infill](const std::string& text) {
                             infill.percent = parse_choice("cavity", text, kCavities) == 0 ? 0 : kUsualPercent;
                           },
                           [&infill] { return std::string(kCavities[infill.wanted() ? 1 : 0]); },
                           {std::begin(kCavities), std::end(kCavities)}},
        .applies = For::making},
       {.name = "infill",
        .value = "PERCENT",
        .words = "of the sparse region, as the slicer calls it",
        .details = "",
        .place = &infill.percent,
        .range = {.lo = 0, .hi = 90, .open = false},
        .applies = For::making},
       {.name = "infill-pattern",
        .value = "NAME",
        .words = "of it, in PrusaSlicer's words (default gyroid)",
        .details = "Measured ones: " + names_of(infill_patterns()) +
                   ". Of others the percentage is taken as it is; see --infill-laid-down.",
        .place = TextPlace{[&infill](const std::string& text) { infill.pattern = text; }, [&infill] { return infill.pattern; }},
        .applies = For::making,
        .rare = true},
       {.name = "infill-laid-down",
        .value = "PERCENT",
        .words = "of the sparse region that becomes material",
        .details = "As measured with your slicer; the usual one is that of PrusaSlicer 2.5 (benchmarks/infill.py).",
        .place = &infill.percent_laid_down,
        .range = {.lo = 0, .hi = 100, .open = false},
        .unset = "as measured",
        .rare = purpose == For::making},
       {.name = "perimeters",
        .value = "N",
        .words = "with infill: loops around every layer",
        .details =
            "What the slicer makes solid below the surface, whatever the infill: perimeters sideways, and so many layers above "
            "and below. The thickest of them is the wall, unless a thicker one is asked for.",
        .place = &infill.perimeters,
        .range = {.lo = 0, .hi = 100, .open = false},
        .applies = For::making,
        .rare = true},
       {.name = "extrusion-width",
        .value = "MM",
        .words = "of a loop",
        .details = "",
        .place = &infill.extrusion_width_mm,
        .range = Range::positive(),
        .applies = For::making,
        .rare = true},
       {.name = "top-layers",
        .value = "N",
        .words = "solid layers below what faces up",
        .details = "",
        .place = &infill.top_layers,
        .range = {.lo = 0, .hi = 1000, .open = false},
        .applies = For::making,
        .rare = true},
       {.name = "bottom-layers",
        .value = "N",
        .words = "and above what faces down",
        .details = "",
        .place = &infill.bottom_layers,
        .range = {.lo = 0, .hi = 1000, .open = false},
        .applies = For::making,
        .rare = true},
       {.name = "layer-height",
        .value = "MM",
        .words = "of them",
        .details = "",
        .place = &infill.layer_height_mm,
        .range = Range::positive(),
        .applies = For::making,
        .rare = true}},
      purpose);
}

Settings settings(Core& core, For purpose) {
  const TextPlace by_name = {[&core](const std::string& name) {
                               core.density_g_cm3 = core_material(name).density_g_cm3;
                               core.material = core_material(name).name;
                             },
                             [&core] { return core.material.empty() ? std::string("none") : core.material; },
                             words_for(core_materials())};
  return asked_for(
      {{.name = "core-material",
        .value = "NAME",
        .words = "a heavy core where mass helps: tin, lead, steel-shot, sand ...",
        .details =
            "One of: " + core_material_names() +
            ". The inside of the body is core or void then, as the goal needs it. Besides the body, with the room for it, the "
            "core is written as a mesh of its own, NAME_core, to cast, cut or pour it after. What is poured counts by its bulk "
            "density, with the air between its grains. Sources: docs/conventions.md.",
        .place = by_name,
        .applies = For::making,
        .also = "core-density"},
       {.name = "core-density",
        .value = "G_CM3",
        .words = "or by its density",
        .details = "",
        .place = &core.density_g_cm3,
        .range = {.lo = 0, .open = false},
        .applies = For::making,
        .rare = true,
        .also = "core-material"},
       {.name = "core-volume",
        .value = "CM3",
        .words = "use no more of it than this",
        .details = "What is scarce is put where it does most; between it and the void is printed material then.",
        .place = &core.volume_cm3,
        .range = Range::positive(),
        .unset = "as much as there is room for",
        .applies = For::making,
        .rare = true},
       {.name = "core-partition",
        .value = "MM",
        .words = "printed wall between the core and the rest of the cavity",
        .details = "Usually the wall's thickness for what is poured, and with --core-volume. Else, of what is cast or cut, 0: then "
                   "the core borders on the void, and is to be glued to the wall.",
        .place = &core.partition_mm,
        .range = {.lo = 0, .open = false},
        .unset = "as the material needs",
        .applies = For::making,
        .rare = true},
       {.name = "core-clearance",
        .value = "MM",
        .words = "room between a core that is put in and the wall",
        .details = "Not of a core with a partition: it fills a room of its own.",
        .place = &core.clearance_mm,
        .range = {.lo = 0, .hi = 1, .open = false},
        .applies = For::making,
        .rare = true}},
      purpose);
}

Settings settings(Balls& balls, For purpose) {
  return asked_for(
      {{.name = "balls",
        .value = "N",
        .words = "put N heavy balls where they do most, in pockets",
        .details =
            "Each has a pocket with a straight shaft upward, as wide as the ball, to a layer at which the print is paused and "
            "the ball put in. The pauses are told, and a 3MF output has them for PrusaSlicer. All balls are written as "
            "one mesh, NAME_balls.",
        .place = &balls.count,
        .range = {.lo = 0, .hi = 100, .open = false},
        .applies = For::making},
       {.name = "ball-diameter",
        .value = "MM",
        .words = "of them",
        .details = "",
        .place = &balls.diameter_mm,
        .range = Range::positive(),
        .applies = For::making,
        .rare = true},
       {.name = "ball-density",
        .value = "G_CM3",
        .words = "of them, steel unless told",
        .details = "",
        .place = &balls.density_g_cm3,
        .range = Range::positive(),
        .applies = For::making,
        .rare = true},
       {.name = "ball-clearance",
        .value = "MM",
        .words = "room around each",
        .details = "",
        .place = &balls.clearance_mm,
        .range = {.lo = 0, .hi = 2, .open = false},
        .applies = For::making,
        .rare = true}},
      purpose);
}

double print_scatter_mm(double diagonal_mm) { return std::max(0.1, 5e-4 * diagonal_mm); }

Phases phases_of(const Print& print) {
  Phases phases{print.infill.share()};
  if (!print.core.wanted()) return phases;
  phases.heavy = print.core.density_g_cm3 / print.density_g_cm3;
  if (print.core.volume_cm3) phases.most_mm3 = 1000 * *print.core.volume_cm3;
  return phases;
}

Settings settings(Print& print, For purpose) {
  // A density says nothing of the material, but of a liquid one it may be the bottle's own.
  const TextPlace by_name = {[&print](const std::string& name) {
                               print.density_g_cm3 = material(name).density_g_cm3;
                               print.liquid_g_cm3 = material(name).liquid_g_cm3;
                             },
                             [&print] {
                               for (const Material& m : materials())
                                 if (m.liquid_g_cm3 > 0 && m.liquid_g_cm3 == print.liquid_g_cm3) return m.name;
                               return std::string("none");
                             },
                             words_for(materials())};
  Settings rows = {
      {.name = "material",
       .value = "NAME",
       .words = "one of: " + material_names(),
       .details =
           "Sets the density to a typical one; the data sheet of the spool or bottle is better (--density, which goes before). "
           "Sources: docs/conventions.md. With resin, what a sealed cavity keeps uncured is weighed, and the mesh fails "
           "(trapped_resin) unless --drained is said.",
       .place = by_name},
      {.name = "density",
       .value = "G_CM3",
       .words = "density of the print (default 1.24, PLA)",
       .details = "",
       .place = &print.density_g_cm3,
       .range = Range::positive()},
      {.name = "drained",
       .value = "",
       .words = "resin: you will drain the cavities, and close them again",
       .details =
           "Says that no uncured resin stays in a sealed cavity: you drill a hole into each, let it run out, and close the hole "
           "with cured resin. What hole and plug change of the mass is not accounted for: --drain makes holes that are.",
       .place = &print.drained,
       .rare = true},
      {.name = "wall",
       .value = "MM",
       .words = "smallest wall thickness",
       .details =
           "Smallest distance between cavity and outer surface. It is kept, and judged, at the cavity's vertices; the middle of a "
           "triangle can be nearer by a few percent along reentrant creases.",
       .place = &print.wall_mm,
       .range = purpose == For::judging ? Range{.lo = 0, .open = false} : Range::positive()},
  };
  if (purpose != For::judging) rows.insert(rows.begin(), resin_row(print));
  for (Settings more : {cut_rows(print.cut), roof_rows(print), drain_rows(print, purpose)})
    for (Setting& row : more) rows.push_back(std::move(row));
  return asked_for(std::move(rows), purpose);
}

Settings settings(FloatSpec& spec, For purpose) {
  Setting up = up_row(spec.up);
  up.details =
      "A heel or a trim that is wanted is said here, by the tangents of both: with 0.087,0.176,1 it comes to rest with its +y side "
      "raised by 10 degrees and its +x side by 5.";
  return asked_for(
      {std::move(up),
       {.name = "fluid",
        .value = "G_CM3",
        .words = "density of the fluid, or water, seawater, ethanol ...",
        .details =
            "Names: water 0.998, seawater 1.025, deadsea 1.24, ethanol 0.789, glycerol 1.261, oliveoil 0.913, mercury 13.55.",
        .place = fluid_place(spec.fluid_g_cm3)},
       {.name = "waterline",
        .value = "MM",
        .words = "height of the waterline above the lowest point",
        .details =
            "With neither this nor --submerged, float searches the waterline of largest metacentric height among those that can "
            "be met (--reserve of the volume stays dry), and verify judges the mesh where it displaces its own mass.",
        .place = &spec.waterline_mm,
        .range = Range::positive(),
        .also = "submerged"},
       {.name = "submerged",
        .value = "FRACTION",
        .words = "or how much is under water: 70% of the height, 70%volume; 1: all",
        .details = "0.7 or 70%: the waterline lies at that fraction of the height. 0.7volume or 70%volume: the body displaces that "
                   "fraction of the volume that its outside encloses, sealed cavities included. 1 or 100%: it hovers upright, "
                   "wholly under water, weighs what it displaces, and its centre of mass is as deep as it can be (lures, divers).",
        .place = submerged_place(spec),
        .also = "waterline"},
       {.name = "reserve",
        .value = "FRACTION",
        .words = "part of the volume that a searched waterline leaves dry",
        .details = "At least: a print that comes out heavier than planned by less than this still floats.",
        .place = &spec.reserve,
        .range = {.lo = 0, .hi = 1, .open = false},
        .applies = For::making}},
      purpose);
}

static Setting centre_row(std::optional<Eigen::Vector3d>& centre_mm) {
  return {.name = "center",
          .value = "X,Y,Z",
          .words = "of a yo-yo (default: middle of the bounding box)",
          .details = "",
          .place = point_place("center", centre_mm, "auto"),
          .rare = true};
}

static Setting axle_row(Axle& axle) {
  return {.name = "axle",
          .value = "NAME",
          .words = "of a yo-yo in two halves: m4, 8mm, bearing-608; none: one piece",
          .details =
              "What the halves are put together with: a rod of steel of 4 or 8 mm that reaches two diameters into each, in blind "
              "holes 0.1 mm wider all around, or an 8 mm rod in a 608 bearing (22 x 7 mm, 12 g) that sits in both. Its steel (7.85 "
              "g/cm3) counts. The rod's length is told: pushed home it keeps the gap. spin --yoyo takes m4 unless told, verify "
              "what the steel in the file tells.",
          .place = choice("axle", axle.kind, kAxles),
          .rare = true};
}

static Setting gap_row(Axle& axle) {
  return {.name = "gap",
          .value = "MM",
          .words = "between the halves, for the string (default 4)",
          .details = "",
          .place = &axle.gap_mm,
          .range = {.lo = 0, .hi = 1000, .open = false},
          .rare = true};
}

static constexpr std::array<const char*, 2> kSpinObjectives = {"rayreps", "spinit"};

Settings settings(SpinSpec& spec, For purpose) {
  const Range weight = {.lo = 0, .open = false};
  return asked_for(
      {up_row(spec.up),
       {.name = "point",
        .value = "P",
        .words = "contact: lowest, com (of the solid), auto, X,Y or X,Y,Z",
        .details =
            "Where the tip touches the ground. lowest: the lowest point, the middle of all points at that height. com: below the "
            "solid's centre of mass, where the vertical through it leaves the mesh. auto: searched, the one about which it "
            "spins best. X,Y: where that vertical leaves the mesh below (up must be z or -z). In the numbers of the file after "
            "--unit and --size. For verify the solid is the --original if there is one, and else the mesh with its sealed "
            "cavities filled: the same options lead to the same contact point as when the mesh was made.",
        .place = TextPlace{[&spec](const std::string& text) { spec.axis = parse_axis("point", "--point takes", text); },
                           [&spec] { return spec.yoyo ? "yo-yo" : shown_axis(spec.axis); }}},
       {.name = "yoyo",
        .value = "",
        .words = "a yo-yo: two halves for an --axle m4, --gap 4; none: one piece",
        .details = "No tip and no gravity; the centre of mass comes to lie at --center. For verify it is a --goal.",
        .place = &spec.yoyo,
        .applies = For::making},
       centre_row(spec.centre_mm),
       axle_row(spec.axle),
       gap_row(spec.axle),
       {.name = "prefer",
        .value = "AXIS",
        .words = "largest or smallest principal moment",
        .details = "Which principal moment the axis shall have. A middle axis always fails.",
        .place = preferred_axis(spec.prefer)},
       {.name = "objective",
        .value = "NAME",
        .words = "rayreps (Wu 2016) or spinit (Baecher 2014)",
        .details =
            "rayreps: weights --lambda and --gamma-i. spinit: weights --gamma-c and --gamma-i. For a yo-yo only --gamma-i counts.",
        .place = choice("objective", spec.objective, kSpinObjectives),
        .applies = For::making,
        .rare = true},
       {.name = "lambda",
        .value = "W",
        .words = "rayreps: weight of the centre of mass's height",
        .details = "",
        .place = &spec.lambda,
        .range = weight,
        .applies = For::making,
        .rare = true},
       {.name = "gamma-c",
        .value = "W",
        .words = "spinit: weight of its static moment squared",
        .details = "",
        .place = &spec.gamma_c,
        .range = weight,
        .applies = For::making,
        .rare = true},
       {.name = "gamma-i",
        .value = "W",
        .words = "weight of the inertia ratio",
        .details = "Of the lateral moments of inertia to the axial one.",
        .place = &spec.gamma_i,
        .range = weight,
        .applies = For::making,
        .rare = true},
       {.name = "axis",
        .value = "A",
        .words = "up, or auto: searched within --max-tilt of it",
        .details =
            "auto: the direction about which it spins best is searched on one set of rays; the contact point follows by --point.",
        .place = searched_axis(spec.max_tilt_rad),
        .applies = For::making},
       {.name = "max-tilt",
        .value = "DEG",
        .words = "for --axis auto (default 15)",
        .details = "",
        .place = largest_tilt(spec.max_tilt_rad),
        .applies = For::making},
       {.name = "certify",
        .value = "",
        .words = "search for the global optimum and prove it",
        .details =
            "Branch and bound over the height of the centre of mass proves that no interior on these rays, whatever its form, is "
            "better by more than 1/10000. For the largest axis with --objective rayreps, and for yo-yos.",
        .place = &spec.certify,
        .applies = For::making}},
      purpose);
}

Settings settings(StandSpec& spec, For purpose) {
  static constexpr std::array<const char*, 2> kObjectives = {"lowest", "tip-angle"};
  return asked_for(
      {up_row(spec.up),
       {.name = "target",
        .value = "X,Y,Z",
        .words = "where the centre of mass shall be, seen from above",
        .details =
            "Above which point of the ground; only its place seen from above counts. Default: the safest point, the centre of the "
            "largest circle in the support polygon; for verify none: its place is then judged by the tipping angle alone.",
        .place = point_place("target", spec.target_mm, purpose == For::judging ? "none" : "auto")},
       {.name = "objective",
        .value = "NAME",
        .words = "lowest centre of mass, or tip-angle: largest smallest tipping angle",
        .details =
            "lowest: the lowest centre of mass above the target. tip-angle: the target is moved to where the smallest tipping "
            "angle is largest.",
        .place = choice("objective", spec.objective, kObjectives),
        .applies = For::making},
       {.name = "max-mass",
        .value = "G",
        .words = "no heavier than this",
        .details = "What stands most safely within that.",
        .place = &spec.most_mass_g,
        .range = Range::positive(),
        .unset = "free"},
       {.name = "contact",
        .value = "MM",
        .words = "height that still counts as touching the ground",
        .details = "What lies no more than this above the lowest point touches the ground. Default: 0.15 mm, the give of a "
                   "printed base, but at most 1/200 and at least 1/10000 of the height.",
        .place = &spec.contact_tolerance_mm,
        .range = Range::positive()},
       {.name = "flatten",
        .value = "MM",
        .words = "what may be cut off below for a base",
        .details =
            "Where the body cannot stand as it is, it is cut off level, as little above its lowest point as makes it stand and "
            "at most this much. The outside is changed there, and the verdict says by how much.",
        .place = &spec.flatten_mm,
        .range = {.lo = 0, .hi = 1e6, .open = false}}},
      purpose);
}

Settings settings(TargetSpec& spec, For purpose) {
  return asked_for(
      {up_row(spec.up),
       {.name = "mass",
        .value = "G",
        .words = "wanted mass",
        .details = "",
        .place = &spec.wanted[M1],
        .range = Range::positive(),
        .unset = "free"},
       {.name = "com",
        .value = "X,Y,Z",
        .words = "wanted centre of mass, mm; 0,0,- leaves z free",
        .details = "In the numbers of the file after --unit and --size; - for a coordinate that is free.",
        .place = wanted_numbers("com", spec.wanted, MX, 3, "X,Y,Z")},
       {.name = "inertia",
        .value = "I",
        .words = "Ixx,Iyy,Izz[,Ixy,Iyz,Ixz] about it, g mm2; - free",
        .details =
            "In the axes of the mesh. The last three are the negative products of inertia, as in URDF and MJCF. The coordinates "
            "of the centre of mass that an entry depends on must be given: y and z for Ixx, x or y for Ixy, and so on.",
        .place = wanted_numbers("inertia", spec.wanted, MXX, 6, "Ixx,Iyy,Izz or Ixx,Iyy,Izz,Ixy,Iyz,Ixz")},
       {.name = "at-least",
        .value = "LIST",
        .words = "bounds of numbers that are not given: mass=14,com_z=5",
        .details =
            "Of mass, com_x, com_y, com_z, and with the coordinates of the centre of mass that they depend on given ixx, iyy, izz, "
            "ixy, iyz and ixz. With all of the centre of mass given also spin-ratio=1.05: of the moment of inertia about --up over "
            "the larger of those across it, at least, as a top or a yo-yo needs it.",
        .place = bounds_place("at-least", spec.at_least, &spec.least_spin_ratio)},
       {.name = "at-most",
        .value = "LIST",
        .words = "and from above",
        .details = "",
        .place = bounds_place("at-most", spec.at_most, nullptr)},
       {.name = "minimise",
        .value = "ORDER",
        .words = "the rest: of mass com_x com_y com_z ixx ... ixz, the first first; -ixx: largest",
        .details =
            "What is minimised while the wanted numbers are met, with - before what shall be largest. What is given already is "
            "skipped; height and the sum of the moments of inertia come after the order. What comes second and third counts "
            "1/100 and 1/10000 (more where the solver needs it), which costs the first a little: the summary tells the best that "
            "is possible beside it. With all ten numbers given nothing is left to minimise: then the wall is made as thick as "
            "they allow.",
        .place = order_of_wishes(spec.order),
        .applies = For::making}},
      purpose);
}

Settings settings(PoseSpec& spec, For purpose) {
  return asked_for(
      {up_row(spec.up),
       {.name = "stand",
        .value = "UP",
        .words = "stands with this up: x, -z, 0,1,1 ...; may be given several times",
        .details =
            "The smallest tipping angle of all poses in which it stands is made as large as it can be. Several poses may also "
            "be given in one, with ; between them, like 'z;0,1,1'.",
        .place = poses_place(spec, Pose::Kind::stands),
        .repeated = true},
       {.name = "hang",
        .value = "X,Y,Z[:UP]",
        .words = "hangs from this point with --up, or UP, up; several times",
        .details =
            "The centre of mass lies on the vertical below the point, which is given in the numbers of the file after --unit and "
            "--size: the middle of a ring or eyelet, or where the string leaves the body. If it stands in no pose, as far "
            "below as it can be brought.",
        .place = poses_place(spec, Pose::Kind::hangs),
        .repeated = true},
       {.name = "float",
        .value = "UP[:MM]",
        .words = "floats with this up, at this waterline if given; several times",
        .details = "Without a waterline (above the lowest point) the mass is free, and what is best for all poses is searched; for "
                   "verify it floats where it displaces its own mass.",
        .place = poses_place(spec, Pose::Kind::floats),
        .repeated = true},
       {.name = "roly-poly",
        .value = "UP",
        .words = "rights itself with this up from any tilt, like a roly-poly",
        .details =
            "Its base must be round: it is let go on level ground in 26 directions and has to come to rest within 5 degrees of "
            "upright from all of them.",
        .place = poses_place(spec, Pose::Kind::rights),
        .repeated = true},
       {.name = "spin",
        .value = "UP[:POINT]",
        .words = "spins as a top with this up, on its lowest point or POINT; once",
        .details =
            "POINT as --point of spin: lowest, com (of the solid), X,Y or X,Y,Z. About its largest axis; its measure is that of "
            "spin, a low centre of mass and a large moment about the axis, made as good as all other poses allow: what stands "
            "keeps --min-tip, what hangs hangs below its point, what floats floats.",
        .place = poses_place(spec, Pose::Kind::spins),
        .repeated = true},
       {.name = "min-tip",
        .value = "DEG",
        .words = "stands at least so safely, and is as light as that allows",
        .details = "The smallest tipping angle of all poses in which it stands, instead of as large as it can be. With --spin what "
                   "it keeps at least (default 3), while it is made as good a top as it can be.",
        .place = &spec.least_tip_deg,
        .range = {.lo = 0, .hi = 89},
        .unset = "as large as it can be",
        .rare = purpose == For::judging},
       {.name = "fluid",
        .value = "G_CM3",
        .words = "density of the fluid, or water, seawater, ethanol ...",
        .details = "",
        .place = fluid_place(spec.fluid_g_cm3)},
       {.name = "contact",
        .value = "MM",
        .words = "height that still counts as touching the ground",
        .details = "As of stand.",
        .place = &spec.contact_tolerance_mm,
        .range = Range::positive()}},
      purpose);
}

Settings settings(DiceSpec& spec, For purpose) {
  const bool judges = purpose == For::judging;  // whose help has no room for them
  return asked_for(
      {up_row(spec.up),
       {.name = "load",
        .value = "UP[:SHARE]",
        .words = "loaded: this up as often as it can, or so often: z:0.4",
        .details = "x, -z, 0,1,1 ...: what points up when it has come to rest, within 10 degrees; what it rests on is "
                   "opposite. SHARE is of all throws: 0.4 or 40%. Without --load the die is fair.",
        .place = load_place(spec.load),
        .rare = judges},
       {.name = "faces",
        .value = "N",
        .words = "of a fair die: so many, those it falls on most often; or all",
        .details = "Of a long prism with N sides its ends need not count. Default: all faces on which it comes to rest.",
        .place = faces_place(spec.faces),
        .rare = judges},
       {.name = "fairness",
        .value = "RATIO",
        .words = "how much more often it may fall on one face than on another",
        .details =
            "The largest share of all throws over the smallest one of the faces that count. Where no inside is so fair the refusal "
            "tells how fair it can be.",
        .place = &spec.fairness,
        .range = {.lo = 1, .hi = 1000},
        .rare = judges},
       {.name = "shake",
        .value = "DEG",
        .words = "what holds it by no more than this is no face: chamfers",
        .details = "A face from which it rolls on, to where it is lower, when it is tilted by so many degrees.",
        .place = &spec.shake_deg,
        .range = {.lo = 0, .hi = 45, .open = false},
        .rare = judges}},
      purpose);
}

namespace {

/// To a thousandth of a mm: "(12.5, 3, 0)", or "(12.5, 3)" where the axis is told by that.
std::string place_words(const SpinAxis& axis) {
  const std::string text = shown_to_thousandths(axis.point_mm);
  return axis.leaves_below ? text.substr(0, text.rfind(',')) + ")" : text;
}

}  // namespace

std::string words_of(const Pose& pose, const Eigen::Vector3d& usual_up) {
  const Eigen::Vector3d up = pose.up_or(usual_up).normalized();
  const std::string name = shown_direction(up);
  const std::string with = " with " + (name.find(',') == std::string::npos ? name : shown(up)) + " up";
  if (pose.kind == Pose::Kind::spins) {
    switch (pose.axis.through) {
      case SpinAxis::Through::lowest_point:
        return "spinning on its lowest point" + with;
      case SpinAxis::Through::point:
        return "spinning on " + place_words(pose.axis) + " mm" + with;
      default:
        return "spinning about the centre of mass of the solid" + with;
    }
  }
  if (pose.kind == Pose::Kind::hangs) return "hanging from " + shown(pose.point_mm) + " mm" + with;
  return (pose.kind == Pose::Kind::stands ? "standing" : pose.kind == Pose::Kind::floats ? "floating" : "righting itself") + with;
}

void check(const FloatSpec& spec, For purpose) {
  check_rows(spec, purpose);
  check_density("fluid", spec.fluid_g_cm3);
  if (spec.waterline_mm.has_value() + spec.submerged_fraction.has_value() + spec.submerged_volume_fraction.has_value() > 1)
    usage_error("Give either --waterline or --submerged, not both.");
  for (const std::optional<double>& fraction : {spec.submerged_fraction, spec.submerged_volume_fraction})
    if (fraction && !(*fraction > 0 && *fraction <= 1))
      usage_error("--submerged must lie between 0 and 1; it is " + shown(*fraction) + ".");
}

bool is_submerged(const FloatSpec& spec) { return spec.submerged_fraction == 1.0 || spec.submerged_volume_fraction == 1.0; }

namespace {

/// @throws Error{usage} for an axis that cannot be one of this up direction
void check_axis(const char* option, const SpinAxis& axis, const Eigen::Vector3d& up) {
  if (axis.leaves_below && std::abs(up.normalized().z()) < 1 - 1e-12)
    usage_error(std::string(option) + "X,Y needs the up direction z or -z; give X,Y,Z.");
  if (!axis.point_mm.allFinite()) usage_error("The contact point must be finite.");
}

/// @throws Error{usage}
void check_spin_ratio(const TargetSpec& spec, For purpose) {
  if (!spec.least_spin_ratio) return;
  if (!(*spec.least_spin_ratio > 0 && *spec.least_spin_ratio < 2))
    usage_error(
        "spin-ratio must lie between 0 and 2, which no body has: a moment of inertia is less than the sum of two others. It is " +
        shown(*spec.least_spin_ratio) + ".");
  if (purpose == For::judging) return;
  if (!std::all_of(spec.wanted.begin() + MX, spec.wanted.begin() + MXX, [](const auto& w) { return w.has_value(); }))
    usage_error(
        "--at-least spin-ratio needs all of the centre of mass, --com X,Y,Z: the moments across the axis are about it, and with "
        "its height left open they are no linear numbers of the body (they hold the square of its static moment over its mass).");
  if (std::all_of(spec.wanted.begin() + MXX, spec.wanted.end(), [](const auto& w) { return w.has_value(); }))
    usage_error("With all of --inertia given the spin-ratio is given, too: leave one of them out.");
}

/// @throws Error{usage} for tops that cannot be among these poses
void check_tops(const PoseSpec& spec) {
  const auto tops = std::count_if(spec.poses.begin(), spec.poses.end(), [](const Pose& p) { return p.kind == Pose::Kind::spins; });
  if (tops > 1) usage_error("It spins in one pose at most: give --spin once.");
  if (tops == 1 && spec.poses.size() == 1)
    usage_error(
        "A top that does nothing else is made by 'rayrep spin'. Give other poses, too: --stand UP, --hang X,Y,Z, --float UP.");
  for (const Pose& pose : spec.poses) {
    if (pose.kind != Pose::Kind::spins) continue;
    if (pose.axis.through == SpinAxis::Through::best)
      usage_error("--spin UP:auto is not searched among poses: 'rayrep spin --point auto' finds a point, which can be given here.");
    check_axis("--spin UP:", pose.axis, pose.up_or(spec.up));
  }
}

}  // namespace

/// @throws Error{usage} for what does not go with a yo-yo in two halves
void check_axle(const SpinSpec& spec, For purpose) {
  const Axle& axle = spec.axle;
  if (axle.kind == Axle::Kind::none) {
    if (axle.gap_mm > 0)
      usage_error("--gap is between the halves of a yo-yo, which --axle holds: give --axle m4, 8mm or bearing-608.");
    return;
  }
  if (!spec.yoyo) usage_error("--axle belongs to --yoyo; a top has a tip.");
  if (!(axle.gap_mm >= kNarrowestGap_mm))
    usage_error("With an axle there is a gap for the string: give --gap at least " + shown(kNarrowestGap_mm) +
                ", or --axle none; it is " + shown(axle.gap_mm) + ".");
  if (axle.kind == Axle::Kind::bearing_608 && axle.gap_mm > kWidestGapOfBearing_mm)
    usage_error("A 608 bearing is 7 mm wide and sits in both halves: --gap must be at most " + shown(kWidestGapOfBearing_mm) +
                " mm; it is " + shown(axle.gap_mm) + ".");
  if (purpose == For::judging) return;
  const Print& print = spec.print;
  const std::string instead = ": leave it out, or say --axle none, which makes the yo-yo in one piece.";
  if (print.infill.wanted()) usage_error("A yo-yo in two halves has no infill" + instead);
  if (print.core.wanted()) usage_error("A yo-yo in two halves has no heavy core" + instead);
  if (print.balls.wanted()) usage_error("A yo-yo in two halves has no balls in it" + instead);
  if (print.drains.wanted())
    usage_error(std::string("A yo-yo in two halves has no ") + (print.liquid_g_cm3 > 0 ? "holes (--resin, --drain)" : "--drain") +
                instead);
  if (print.self_supporting_deg != 0)
    usage_error("The halves of a yo-yo lie on their inner faces, one each way up, and --self-supporting carries roofs of one" +
                instead);
  if (print.direction) usage_error("The halves of a yo-yo lie on their inner faces, and have no --print-direction" + instead);
  if (print.cut.wanted()) usage_error("A yo-yo with an axle is in two halves: leave --cut out, or say --axle none.");
}

void check(const SpinSpec& spec, For purpose) {
  check_rows(spec, purpose);
  check_axle(spec, purpose);
  if (spec.yoyo && spec.axis.through != SpinAxis::Through::lowest_point)
    usage_error("--point belongs to tops; a yo-yo has a --center.");
  if (!spec.yoyo && spec.centre_mm) usage_error("--center belongs to --yoyo; a top has a --point.");
  check_axis("--point ", spec.axis, spec.up);
  if (spec.centre_mm && !spec.centre_mm->allFinite()) usage_error("The centre must be finite.");
  if (spec.prefer == AxisClass::middle) usage_error("--prefer is largest or smallest: a body tumbles about its middle axis.");
  if (purpose == For::judging) {
    if (spec.axis.through == SpinAxis::Through::best)
      usage_error("--point auto searches; to verify, give the point that was found.");
    return;
  }
  if (!(spec.max_tilt_rad >= 0 && spec.max_tilt_rad <= std::numbers::pi / 2))
    usage_error("The axis can be searched within 0 to 90 degrees of the up direction.");
  if (spec.certify && (spec.prefer != AxisClass::largest || (spec.objective == SpinSpec::Objective::spinit && !spec.yoyo)))
    usage_error("--certify proves optima for --prefer largest and --objective rayreps, and of yo-yos.");
}

void check(const StandSpec& spec, For purpose) {
  check_rows(spec, purpose);
  if (spec.target_mm && !spec.target_mm->allFinite()) usage_error("The target must be finite.");
}

void check_bounds(const TargetSpec& spec, For purpose) {
  for (int k = M1; k <= MXZ; ++k) {
    const auto number = static_cast<MomentIndex>(k);
    const auto at = static_cast<std::size_t>(k);
    const std::string name = inertial_name(number);
    for (const std::optional<double>& bound : {spec.at_least[at], spec.at_most[at]}) {
      if (!bound) continue;
      if (spec.wanted[at]) usage_error("For " + name + " a number is given: leave its bounds out.");
      if (!std::isfinite(*bound)) usage_error("The bounds of " + name + " must be finite.");
      if ((number == M1 || (number >= MXX && number <= MZZ)) && !(*bound > 0))
        usage_error("The bounds of " + name + " must be positive; one is " + shown(*bound) + ".");
      if (purpose != For::judging) require_centre_for(number, spec.wanted);
    }
    if (spec.at_least[at] && spec.at_most[at] && !(*spec.at_least[at] < *spec.at_most[at]))
      usage_error("Between its bounds " + name + " has no room: it shall be at least " + shown(*spec.at_least[at]) +
                  " and at most " + shown(*spec.at_most[at]) + ".");
  }
}

/// @throws Error{usage} for what plans for itself, where the wall alone is left to meet what is wanted
static void check_all_ten(const TargetSpec& spec) {
  if (!std::all_of(spec.wanted.begin(), spec.wanted.end(), [](const auto& w) { return w.has_value(); })) return;
  const bool cones = spec.print.self_supporting_deg > 0;
  if (!cones && !spec.print.balls.wanted()) return;
  const std::string what = cones ? "cones under roofs (--self-supporting)" : "balls (--balls)";
  usage_error("With all ten numbers given (--mass, --com, --inertia) the wall alone is left to meet them, and " + what +
              " need room of their own: leave one of the numbers open, or " + (cones ? "--self-supporting" : "--balls") + " out.");
}

void check(const TargetSpec& spec, For purpose) {
  check_rows(spec, purpose);
  const auto says_nothing = [](const InertialTargets& numbers) {
    return std::none_of(numbers.begin(), numbers.end(), [](const auto& w) { return w.has_value(); });
  };
  check_spin_ratio(spec, purpose);
  if (says_nothing(spec.wanted) && says_nothing(spec.at_least) && says_nothing(spec.at_most) && !spec.least_spin_ratio)
    usage_error("Say which numbers are wanted: --mass, --com or --inertia, or within which bounds: --at-least, --at-most.");
  for (int k = M1; k <= MXZ; ++k) {
    const auto number = static_cast<MomentIndex>(k);
    const std::optional<double>& wanted = spec.wanted[static_cast<std::size_t>(k)];
    if (!wanted) continue;
    if (!std::isfinite(*wanted)) usage_error(std::string("The wanted ") + inertial_name(number) + " must be finite.");
    if ((number == M1 || (number >= MXX && number <= MZZ)) && !(*wanted > 0))
      usage_error(std::string("The wanted ") + inertial_name(number) + " must be positive; it is " + shown(*wanted) + ".");
    if (purpose != For::judging) require_centre_for(number, spec.wanted);
  }
  check_bounds(spec, purpose);
  if (purpose == For::judging) return;
  check_inertia(spec.wanted);
  check_all_ten(spec);
  for (const InertialWish& wish : spec.order) {
    if (wish.number >= MX && wish.number <= MZ && !spec.wanted[M1])
      usage_error(std::string("To minimise ") + inertial_name(wish.number) +
                  " the mass must be given (--mass): a ratio of two free numbers is not linear.");
    require_centre_for(wish.number, spec.wanted);
  }
}

void check(const PoseSpec& spec, For purpose) {
  check_rows(spec, purpose);
  check_density("fluid", spec.fluid_g_cm3);
  if (spec.poses.empty())
    usage_error(
        "Say in which poses: --stand UP, --hang X,Y,Z, --float UP or --roly-poly UP, each of them as often as you like, and "
        "once --spin UP.");
  check_tops(spec);
  const bool stands = std::any_of(spec.poses.begin(), spec.poses.end(), [](const Pose& p) { return p.kind == Pose::Kind::stands; });
  if (spec.least_tip_deg && !stands) usage_error("--min-tip is of poses in which it stands: give --stand UP, too.");
  const bool floats = std::any_of(spec.poses.begin(), spec.poses.end(), [](const Pose& p) { return p.kind == Pose::Kind::floats; });
  const bool spins = std::any_of(spec.poses.begin(), spec.poses.end(), [](const Pose& p) { return p.kind == Pose::Kind::spins; });
  if (spec.least_tip_deg && floats && !spins && purpose == For::making)
    usage_error("What floats has its mass from the water: leave --min-tip out, and it stands as safely as that allows.");
  for (const Pose& pose : spec.poses) {
    check_up(pose.up_or(spec.up));
    if (!pose.point_mm.allFinite()) usage_error("The point it hangs from must be finite.");
    if (pose.waterline_mm && !Range::positive().contains(*pose.waterline_mm))
      usage_error("The waterline of --float must be a positive number; it is " + shown(*pose.waterline_mm) + ".");
  }
}

void check(const DiceSpec& spec, For purpose) {
  check_rows(spec, purpose);
  if (spec.faces != 0 && spec.faces < 2) usage_error("A die has at least two faces: --faces " + std::to_string(spec.faces) + ".");
  if (!spec.load) return;
  check_up(spec.load->up);
  if (spec.faces != 0) usage_error("--faces is of fair dice: leave it out, or --load.");
  if (spec.load->share && !(*spec.load->share > 0 && *spec.load->share < 1))
    usage_error("The share in --load must lie between 0 and 1; it is " + shown(*spec.load->share) + ".");
}

Print& print_of(Spec& spec) {
  return std::visit([](auto& s) -> Print& { return s.print; }, spec);
}

const Print& print_of(const Spec& spec) {
  return std::visit([](const auto& s) -> const Print& { return s.print; }, spec);
}

const Eigen::Vector3d& up_of(const Spec& spec) {
  return std::visit([](const auto& s) -> const Eigen::Vector3d& { return s.up; }, spec);
}

}  // namespace rayrep
