#include "overhang.h"

#include <array>
#include <cmath>

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

Spec spec_of(const std::string& goal, const Vector3d& direction) {
  Spec spec = FloatSpec{};
  if (goal == "spin") spec = SpinSpec{};
  if (goal == "stand") spec = StandSpec{};
  if (goal == "flattened") {
    StandSpec stand;
    stand.flatten_mm = 3;
    spec = stand;
  }
  if (goal == "dice") spec = DiceSpec{};
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

void measure(const Mesh& solid, const Spec& spec, Record& r) {
  HollowOptions options;
  options.resolution = r.resolution;
  options.as_stored = [](const Mesh& mesh) { return as_stored("body.stl", mesh); };
  const double begin = now_s();
  const HollowResult result = hollow(solid, spec, options);
  r.seconds = spread({now_s() - begin});
  const Mesh body = result.delivery.body();
  r.status = verify(result.delivery, &solid, result.spec).pass() ? "converged" : "judged to fail";
  r.more["as built"] = result.as_built_error;
  take_price(result, r);
  verify_detail::PrintedUp print{.direction = print_of(result.spec).direction.value_or(up_of(result.spec)),
                                 .angle_rad = (kAngle_deg - 2) * kDegree};
  print.bed_mm = verify_detail::lowest_along(body, print.direction.normalized());
  const verify_detail::Overhang found = verify_detail::overhang(verify_detail::cavities_of(body), print);
  r.more["roof share"] = found.roof_share;
  r.more["islands"] = static_cast<double>(found.islands);
  r.more["bridge_mm"] = found.bridge_mm;
  r.more["pillar_mm"] = found.pillar_mm.value_or(kUnknown);
}

}  // namespace

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
        measure(solid, spec_of(task.goal, direction.up), r);
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
