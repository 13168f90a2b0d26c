#include "overhang.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "judge/overhang.h"
#include "judge/verify_detail.h"
#include "problem.h"
#include "rayrep/base/error.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/judge/verify.h"
#include "rayrep/make/hollow.h"

namespace rayrep::bench {
namespace {

using Eigen::Vector3d;

constexpr double kDegree = 3.14159265358979323846 / 180;
constexpr double kAngle_deg = 45;

struct Task {
  const char* file;
  const char* goal;
};
constexpr std::array<Task, 10> kTasks = {{{"duck.stl", "float"},
                                          {"heart.stl", "float"},
                                          {"three_spheres.stl", "float"},
                                          {"ellipsoid.stl", "float"},
                                          {"teapot.stl", "stand"},
                                          {"robin.stl", "flattened"},
                                          {"sumo.stl", "flattened"},
                                          {"die.stl", "dice"},
                                          {"bird.stl", "spin"},
                                          {"ellipsoid.stl", "spin"}}};

struct Direction {
  const char* name;
  Vector3d up;
};
const std::array<Direction, 3>& directions() {
  static const std::array<Direction, 3> all = {{{"z", {0, 0, 1}}, {"y", {0, 1, 0}}, {"1,0,1", {1, 0, 1}}}};
  return all;
}

Spec spec_of(const std::string& goal) {
  Spec spec = FloatSpec{};
  if (goal == "spin") spec = SpinSpec{};
  if (goal == "stand") spec = StandSpec{};
  if (goal == "flattened") {
    StandSpec stand;
    stand.flatten_mm = 3;
    spec = stand;
  }
  if (goal == "dice") spec = DiceSpec{};
  return spec;
}

Spec self_supporting(Spec spec, const std::optional<Vector3d>& direction) {
  Print& print = print_of(spec);
  print.self_supporting_deg = kAngle_deg;
  print.direction = direction;
  return spec;
}

void take_price(const HollowResult& result, Record& r) {
  for (const Figure& figure : result.proof_figures)
    if (figure.name == "self_supporting")
      for (const auto& [name, value] : std::get<rayrep::Record>(figure.value))
        if (const double* number = std::get_if<double>(&value)) r.more[name] = *number;
}

HollowResult made(const Mesh& solid, const Spec& spec, int resolution, double& seconds) {
  HollowOptions options;
  options.resolution = resolution;
  options.as_stored = [](const Mesh& mesh) { return as_stored("body.stl", mesh); };
  const double begin = now_s();
  HollowResult result = hollow(solid, spec, options);
  seconds = now_s() - begin;
  return result;
}

/// As it is read back.
Verdict judged(const Mesh& solid, const HollowResult& result) {
  Delivery delivery = result.delivery;
  for (auto& part : delivery.parts) part.mesh = as_stored("body.stl", part.mesh);
  return verify(delivery, &solid, result.spec);
}

void measure(const Mesh& solid, const Spec& spec, Record& r) {
  double seconds = 0;
  const HollowResult result = made(solid, spec, r.resolution, seconds);
  r.seconds = spread({seconds});
  const Mesh body = result.delivery.body();
  r.status = judged(solid, result).pass() ? "converged" : "judged to fail";
  r.more["as built"] = result.as_built_error;
  take_price(result, r);
  verify_detail::PrintedUp print{.direction = print_of(result.spec).direction.value_or(up_of(result.spec)),
                                 .angle_rad = (kAngle_deg - 2) * kDegree};
  print.bed_mm = verify_detail::lowest_along(body, print.direction.normalized());
  const verify_detail::Overhang found = verify_detail::overhang(verify_detail::cavities_of(body), print);
  r.more["roof share"] = found.roof_share();
  r.more["islands"] = static_cast<double>(found.islands);
  r.more["bridge_mm"] = found.bridge_mm;
  r.more["pillar_mm"] = found.pillar_mm.value_or(kUnknown);
}

double value_of(const Figures& figures, const std::string& name) {
  for (const Figure& figure : figures)
    if (const double* value = figure.name == name ? std::get_if<double>(&figure.value) : nullptr) return *value;
  return kUnknown;
}

/// What the goal is about, the more of it the better; unknown of those that are met or not.
double goal_figure(const Figures& figures) {
  if (const double gm_mm = value_of(figures, "metacentric_height_mm"); std::isfinite(gm_mm)) return gm_mm;
  if (const double tips_rad = value_of(figures, "smallest_tipping_angle_rad"); std::isfinite(tips_rad)) return tips_rad / kDegree;
  return value_of(figures, "ratio_to_larger_lateral");
}

/// What one of a pair comes to. @param when  "before " or "after "
void take_roofs(const Mesh& solid, const HollowResult& result, double seconds, const std::string& when, Record& r) {
  const Verdict verdict = judged(solid, result);
  if (!verdict.pass()) r.status = when + "judged to fail";
  r.more[when + "share"] = value_of(verdict.figures, "roof_share");
  r.more[when + "bridge"] = value_of(verdict.figures, "widest_bridge_mm");
  r.more[when + "islands"] = value_of(verdict.figures, "hanging_islands");
  r.more[when + "triangles"] = static_cast<double>(result.delivery.body().triangles.size() - solid.triangles.size());
  r.more[when + "seconds"] = seconds;
  r.more[when + "goal"] = goal_figure(verdict.figures);
  r.more[when + "as built"] = result.as_built_error;
}

void measure_pair(const Mesh& solid, const Spec& spec, Record& r) {
  r.status = "converged";
  double seconds = 0;
  HollowResult before = made(solid, spec, r.resolution, seconds);
  const double before_s = seconds;
  try {
    const HollowResult after = made(solid, self_supporting(spec, {}), r.resolution, seconds);
    take_roofs(solid, after, seconds, "after ", r);
    take_price(after, r);
    print_of(before.spec).direction = print_of(after.spec).direction;
  } catch (const Error& error) {
    r.note = error.what();
  }
  take_roofs(solid, before, before_s, "before ", r);
}

struct Body {
  Shape shape;
  std::string goal;
};

std::vector<Body> bodies(const TableOptions& options) {
  std::vector<Body> all;
  for (const Task& task : kTasks) all.push_back({{options.examples / task.file}, task.goal});
  if (options.quick) all.resize(1);
  for (const std::filesystem::path& file : meshes_in(options.meshes)) all.push_back({{file, Vector3d::UnitZ(), 80}, "float"});
  return all;
}

}  // namespace

std::vector<Record> measure_roofs(const TableOptions& options) {
  std::vector<Record> records;
  for (const Body& body : bodies(options)) {
    const std::optional<Mesh> solid = closed(body.shape);
    if (!solid) continue;
    Record r;
    r.table = "roofs";
    r.mesh = body.shape.path.filename();
    r.goal = body.goal;
    r.solver = "without and with";
    r.resolution = options.quick ? 40 : 100;
    try {
      measure_pair(*solid, spec_of(body.goal), r);
    } catch (const Error& error) {
      refused(error, r);
    }
    if (options.each) options.each(r);
    records.push_back(std::move(r));
  }
  return records;
}

std::vector<Record> measure_overhang(const TableOptions& options) {
  std::vector<Record> records;
  for (const Task& task : kTasks) {
    const Mesh solid = load({options.examples / task.file});
    for (const Direction& direction : directions()) {
      Record r;
      r.table = "overhang";
      r.mesh = task.file;
      r.goal = task.goal;
      r.solver = direction.name;
      r.resolution = options.quick ? 40 : 100;
      try {
        measure(solid, self_supporting(spec_of(task.goal), direction.up), r);
      } catch (const Error& error) {
        r.status = "refused";
        r.note = error.what();
      }
      if (options.each) options.each(r);
      records.push_back(std::move(r));
      if (options.quick) return records;
    }
  }
  return records;
}

}  // namespace rayrep::bench
