// Pairs of closed meshes with what rayrep makes of them, one JSON object a line, for tests/oracles/manifold.mjs to compare:
//   boolean_pairs FIRST COUNT      pairs of boolean_cases.h
//   boolean_pairs FILE FILE        meshes in boxes of side 1, and the second moved a little

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "boolean_cases.h"
#include "mesh/float32.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/mesh/boolean.h"
#include "rayrep/mesh/mesh_check.h"

namespace {

using namespace rayrep;

double volume(const Mesh& mesh) {
  double six = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) six += mesh.corner(t, 0).dot(mesh.corner(t, 1).cross(mesh.corner(t, 2)));
  return six / 6;
}

void print(const char* name, const Mesh& mesh) {
  std::printf("\"%s\":{\"points\":[", name);
  for (std::size_t n = 0; n < mesh.vertices.size(); ++n)
    std::printf("%s%.9g,%.9g,%.9g", n ? "," : "", mesh.vertices[n].x(), mesh.vertices[n].y(), mesh.vertices[n].z());
  std::printf("],\"triangles\":[");
  for (std::size_t n = 0; n < mesh.triangles.size(); ++n)
    std::printf("%s%d,%d,%d", n ? "," : "", mesh.triangles[n][0], mesh.triangles[n][1], mesh.triangles[n][2]);
  std::printf("]},");
}

void compare(const std::string& name, const Mesh& first, const Mesh& second) {
  const std::vector<Mesh> pair{with_merged_vertices(as_float32(first)), with_merged_vertices(as_float32(second))};
  std::printf("{\"name\":\"%s\",", name.c_str());
  print("a", pair[0]);
  print("b", pair[1]);
  const auto start = std::chrono::steady_clock::now();
  for (const auto& [operation, word] :
       {std::pair(BooleanOperation::unite, "add"), std::pair(BooleanOperation::intersect, "intersect"),
        std::pair(BooleanOperation::subtract, "subtract")}) {
    const Mesh mesh = combined(pair, {.operation = operation}).mesh;
    std::printf("\"%s\":[%.17g,%.17g],", word, volume(mesh), surface_area(mesh));
  }
  std::printf("\"seconds\":%.3f}\n", std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
}

Mesh in_unit_box(const std::string& file) {
  CheckOptions quick;
  quick.self_intersections = false;
  const Mesh mesh = require_solid(read_mesh(file).mesh, file, quick).mesh;
  const Eigen::AlignedBox3d box = bounding_box(mesh);
  return transformed(mesh, Eigen::Scaling(1 / box.sizes().maxCoeff()) * Eigen::Translation3d(-box.center()));
}

}  // namespace

int main(int, char** arguments) {
  if (!arguments[1] || !arguments[2]) return 2;
  char* end = nullptr;
  const unsigned long long first = std::strtoull(arguments[1], &end, 10);
  if (*end) {
    compare(std::string(arguments[1]) + " " + arguments[2], in_unit_box(arguments[1]),
            test::moved(in_unit_box(arguments[2]), {0.05, 0.03, 0.02}));
    return 0;
  }
  for (unsigned long long n = first; n < first + std::strtoull(arguments[2], nullptr, 10); ++n) {
    const auto [a, b] = test::boolean_pair(n);
    compare(std::to_string(n), a, b);
  }
}
