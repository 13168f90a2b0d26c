#include "rayrep/mesh/bodies.h"

#include "base/union_find.h"
#include "mesh/close_pairs.h"
#include "mesh/predicates.h"
#include "mesh/shells.h"

namespace rayrep {
namespace {

bool is_flat(const Mesh& mesh, int t) {
  const auto n = static_cast<std::size_t>(t);
  return collinear(mesh.corner(n, 0), mesh.corner(n, 1), mesh.corner(n, 2));
}

bool meet(const Mesh& mesh, int s, int t) {
  if (is_flat(mesh, s) || is_flat(mesh, t)) return false;
  const auto corners = [&mesh](int n, Eigen::Vector3d(&p)[3]) {
    for (int k = 0; k < 3; ++k) p[k] = mesh.corner(static_cast<std::size_t>(n), k);
  };
  Eigen::Vector3d p[3];
  Eigen::Vector3d q[3];
  corners(s, p);
  corners(t, q);
  return triangles_intersect(p, mesh.triangles[s], q, mesh.triangles[t]);
}

}  // namespace

Components bodies_of(const Mesh& mesh, const Progress& progress) {
  const Components parts = connected_components(mesh);
  if (parts.count < 2) return parts;
  UnionFind bodies(parts.count);
  std::size_t looked_at = 0;
  for (const auto& [s, t] : close_pairs(mesh, progress)) {
    if (++looked_at % 4096 == 0) progress.check();
    const int a = parts.of_triangle[s];
    const int b = parts.of_triangle[t];
    if (bodies.root(a) != bodies.root(b) && meet(mesh, s, t)) bodies.unite(a, b);
  }
  ShellNesting nesting(mesh, parts.of_triangle);
  std::vector<bool> seen(static_cast<std::size_t>(parts.count), false);
  Surroundings around;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const int part = parts.of_triangle[t];
    if (seen[static_cast<std::size_t>(part)]) continue;
    seen[static_cast<std::size_t>(part)] = true;
    progress.check();
    nesting.around(mesh.corner(t, 0), part, around);
    for (const Surroundings::Around& other : around.shells) bodies.unite(part, other.shell);
  }
  Components result;
  std::vector<int> number(static_cast<std::size_t>(parts.count), -1);
  for (const int part : parts.of_triangle) {
    int& body = number[static_cast<std::size_t>(bodies.root(part))];
    if (body < 0) body = result.count++;
    result.of_triangle.push_back(body);
  }
  return result;
}

}  // namespace rayrep
