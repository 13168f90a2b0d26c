#include "rayrep/mesh.h"

#include <array>
#include <bit>
#include <cassert>
#include <cstdint>
#include <numeric>
#include <unordered_map>

namespace rayrep {
namespace {

int find_root(std::vector<int>& parent, int i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

}  // namespace

Eigen::AlignedBox3d bounding_box(const Mesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const auto& v : mesh.vertices) box.extend(v);
  return box;
}

Mesh transformed(const Mesh& mesh, const Eigen::Affine3d& T) {
  assert(T.linear().determinant() > 0);
  Mesh result = mesh;
  for (auto& v : result.vertices) v = T * v;
  return result;
}

void append(Mesh& mesh, const Mesh& other) {
  const int offset = static_cast<int>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), other.vertices.begin(), other.vertices.end());
  mesh.triangles.reserve(mesh.triangles.size() + other.triangles.size());
  for (const auto& t : other.triangles) mesh.triangles.push_back(t.array() + offset);
}

void flip(Mesh& mesh) {
  for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
}

Mesh with_merged_vertices(const Mesh& mesh) {
  using Key = std::array<double, 3>;
  struct Hash {
    std::size_t operator()(const Key& key) const {
      std::uint64_t hash = 0;
      for (const double x : key) {
        hash = (hash ^ std::bit_cast<std::uint64_t>(x)) * 0x9e3779b97f4a7c15u;
        hash ^= hash >> 32;
      }
      return hash;
    }
  };
  std::unordered_map<Key, int, Hash> numbers;
  numbers.reserve(mesh.vertices.size());
  Mesh result;
  result.triangles.reserve(mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    Eigen::Vector3i triangle;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d p = mesh.corner(t, k).array() + 0.0;  // -0 becomes 0
      const auto [it, added] = numbers.try_emplace({p.x(), p.y(), p.z()}, static_cast<int>(result.vertices.size()));
      if (added) result.vertices.push_back(p);
      triangle[k] = it->second;
    }
    result.triangles.push_back(triangle);
  }
  return result;
}

Components connected_components(const Mesh& mesh) {
  std::vector<int> parent(mesh.vertices.size());
  std::iota(parent.begin(), parent.end(), 0);
  for (const auto& t : mesh.triangles)
    for (int k = 1; k < 3; ++k) {
      const int a = find_root(parent, t[0]);
      const int b = find_root(parent, t[k]);
      if (a != b) parent[b] = a;
    }
  Components result;
  std::vector<int> number(mesh.vertices.size(), -1);
  result.of_triangle.reserve(mesh.triangles.size());
  for (const auto& t : mesh.triangles) {
    int& n = number[find_root(parent, t[0])];
    if (n < 0) n = result.count++;
    result.of_triangle.push_back(n);
  }
  return result;
}

std::vector<Mesh> split(const Mesh& mesh, const Components& components) {
  std::vector<Mesh> parts(static_cast<std::size_t>(components.count));
  std::vector<int> renumbered(mesh.vertices.size(), -1);  // a vertex belongs to one component
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    Mesh& part = parts[static_cast<std::size_t>(components.of_triangle[t])];
    Eigen::Vector3i triangle;
    for (int k = 0; k < 3; ++k) {
      int& v = renumbered[mesh.triangles[t][k]];
      if (v < 0) {
        v = static_cast<int>(part.vertices.size());
        part.vertices.push_back(mesh.corner(t, k));
      }
      triangle[k] = v;
    }
    part.triangles.push_back(triangle);
  }
  return parts;
}

}  // namespace rayrep
