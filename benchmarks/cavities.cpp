#include "cavities.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "mesh/surface_gap.h"
#include "problem.h"
#include "rayrep/base/error.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/make/cavity.h"
#include "rayrep/make/hollow.h"
#include "rayrep/mesh/quadric.h"

namespace rayrep::bench {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;

/// How far a point near the curve d = wall, f = 0 is from it, to first order: theory.md (87).
double distance_to_curve(const Vector3d& p, const SurfaceQuery& surface, double wall_mm, const Quadric& f) {
  const ClosestPoint closest = surface.closest(p, 10 * wall_mm);
  const double g = wall_mm - closest.distance_mm;
  const double d = f.distance(p);
  const Vector3d n = (closest.point_mm - p).normalized();
  const double cosine = f.gradient(p).normalized().dot(n);
  return std::sqrt(std::max(0.0, (g * g + d * d - 2 * cosine * g * d) / (1 - cosine * cosine)));
}

/// The two surfaces of a cavity, seen from its mesh.
struct Surfaces {
  const Mesh& cavity;
  const SurfaceQuery& outside;
  double wall_mm;
  const Quadric& f;
};

/// Whether a triangle is one of f = 0: its corners are nearer to it than to d = wall, taken together. Where they are near both it
/// also faces as f = 0 does rather than as d = wall does there; one without a normal may be either.
bool is_cap(const Eigen::Vector3i& t, const Surfaces& of, const std::vector<double>& off_wall_mm) {
  double off_f_mm = 0;
  double off_d_mm = 0;
  for (const int v : t) {
    off_f_mm += std::abs(of.f.distance(of.cavity.vertices[v]));
    off_d_mm += off_wall_mm[v];
  }
  if (off_f_mm >= off_d_mm) return false;
  if (off_d_mm > of.wall_mm) return true;
  const Vector3d& a = of.cavity.vertices[t[0]];
  const Vector3d& b = of.cavity.vertices[t[1]];
  const Vector3d& c = of.cavity.vertices[t[2]];
  const Vector3d area = (b - a).cross(c - a);
  if (area.norm() < 1e-3 * (b - a).norm() * (c - a).norm()) return true;
  const Vector3d middle = (a + b + c) / 3;
  const Vector3d to_outside = of.outside.closest(middle, 1e3).point_mm - middle;
  return std::abs(area.dot(of.f.gradient(middle).normalized())) > std::abs(area.dot(to_outside.normalized()));
}

/// Of the corners at which triangles on f = 0 meet others, ascending.
std::vector<double> crease_distances(const Surfaces& of) {
  const std::vector<Vector3d>& vertices = of.cavity.vertices;
  std::vector<double> off_wall_mm;
  for (const Vector3d& p : vertices) off_wall_mm.push_back(std::abs(of.outside.closest(p, 1e3).distance_mm - of.wall_mm));
  std::vector<char> of_cap(vertices.size(), 0);
  std::vector<char> of_wall(vertices.size(), 0);
  for (const Eigen::Vector3i& t : of.cavity.triangles)
    for (const int v : t) (is_cap(t, of, off_wall_mm) ? of_cap : of_wall)[v] = 1;
  std::vector<double> distances;
  for (std::size_t v = 0; v < of_cap.size(); ++v)
    if (of_cap[v] && of_wall[v]) distances.push_back(distance_to_curve(vertices[v], of.outside, of.wall_mm, of.f));
  std::erase_if(distances, [](double d) { return !std::isfinite(d); });
  std::sort(distances.begin(), distances.end());
  return distances;
}

void measure(const Mesh& solid, const Spec& spec, Record& r) {
  HollowOptions options;
  options.resolution = r.resolution;
  options.as_stored = [](const Mesh& mesh) { return as_stored("cavity.stl", mesh); };
  const double begin = now_s();
  const HollowResult result = hollow(solid, spec, options);
  r.seconds = spread({now_s() - begin});
  Mesh cavity = result.delivery.parts.front().mesh;
  cavity.triangles.erase(cavity.triangles.begin(), cavity.triangles.begin() + static_cast<std::ptrdiff_t>(solid.triangles.size()));
  const std::size_t crossing_as_delivered = crossing_triangles(cavity).size();
  cavity = transformed(cavity, result.to_working);
  const SurfaceQuery surface(transformed(solid, result.to_working));
  const double wall_mm = std::visit([](const auto& s) { return s.print.wall_mm; }, spec);
  r.status = "converged";
  r.more["outside"] = static_cast<double>(solid.triangles.size());
  r.more["cavity"] = static_cast<double>(cavity.triangles.size());
  r.more["passes"] = result.passes;
  r.more["as built"] = result.as_built_error;
  r.more["wall"] = smallest_gap(cavity, surface) / wall_mm;
  r.more["crossing"] = static_cast<double>(crossing_as_delivered);
  const Quadric f{quadric_hessian(result.q), result.q.segment<3>(MX), result.q[M1]};
  const std::vector<double> distances = crease_distances({cavity, surface, wall_mm, f});
  if (distances.empty()) return;
  double sum2 = 0;
  for (const double d : distances) sum2 += d * d;
  r.more["crease rms"] = std::sqrt(sum2 / static_cast<double>(distances.size()));
  r.more["crease p99"] = distances[(distances.size() - 1) * 99 / 100];
  r.more["crease max"] = distances.back();
}

struct Task {
  Shape shape;
  std::string goal;
};

std::vector<Task> tasks_of(const TableOptions& options) {
  std::vector<Task> tasks;
  for (const auto& [file, goal] :
       {std::pair{"duck.stl", "float"}, {"bird.stl", "spin"}, {"heart.stl", "float"}, {"teapot.stl", "stand"}})
    tasks.push_back({{options.examples / file}, goal});
  if (options.quick) tasks.resize(1);
  for (const fs::path& file : meshes_in(options.meshes)) tasks.push_back({{file, Vector3d::UnitZ(), 80}, "float"});
  return tasks;
}

Spec spec_of(const std::string& goal) {
  if (goal == "spin") return SpinSpec{};
  if (goal == "stand") return StandSpec{};
  return FloatSpec{};
}

}  // namespace

std::vector<Record> measure_cavities(const TableOptions& options) {
  std::vector<Record> records;
  for (const Task& task : tasks_of(options)) {
    const std::optional<Mesh> solid = closed(task.shape);
    for (const int n : options.quick ? std::vector{40} : std::vector{100, 200}) {
      if (!solid) continue;
      Record r;
      r.table = "cavities";
      r.mesh = task.shape.path.filename();
      r.goal = task.goal;
      r.solver = "whole run";
      r.resolution = n;
      try {
        measure(*solid, spec_of(task.goal), r);
      } catch (const Error& error) {
        refused(error, r);
      }
      if (options.each) options.each(r);
      records.push_back(std::move(r));
    }
  }
  return records;
}

}  // namespace rayrep::bench
