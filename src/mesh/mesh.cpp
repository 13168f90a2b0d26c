#include "rayrep/mesh/mesh.h"

#include <bit>
#include <cassert>
#include <cstdint>
#include <cstring>

#include "base/rotation.h"
#include "base/union_find.h"
#include "mesh/float32.h"

namespace rayrep {
namespace {

bool same_bits(const Eigen::Vector3d& a, const Eigen::Vector3d& b) { return std::memcmp(a.data(), b.data(), sizeof a) == 0; }

}  // namespace

Eigen::AlignedBox3d bounding_box(const Mesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const auto& v : mesh.vertices) box.extend(v);
  return box;
}

double surface_area(const Mesh& mesh, std::size_t first) {
  double twice = 0;
  for (std::size_t t = first; t < mesh.triangles.size(); ++t)
    twice += (mesh.corner(t, 1) - mesh.corner(t, 0)).cross(mesh.corner(t, 2) - mesh.corner(t, 0)).norm();
  return 0.5 * twice;
}

Mesh transformed(const Mesh& mesh, const Eigen::Affine3d& T) {
  assert(T.linear().determinant() > 0);
  Mesh result = mesh;
  for (auto& v : result.vertices) v = T * v;
  return result;
}

Eigen::Matrix3d up_to_z(const Eigen::Vector3d& up) {
  const Eigen::Matrix3d R = rotation_between(up, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const Eigen::Matrix3d rounded = R.array().round();
  return (R - rounded).norm() < 1e-12 ? rounded : R;
}

Eigen::Affine3d working_frame(const Mesh& mesh, const Eigen::Vector3d& up) {
  Eigen::Affine3d T = Eigen::Affine3d::Identity();
  T.linear() = up_to_z(up);
  const Eigen::AlignedBox3d box = bounding_box(transformed(mesh, T));
  T.translation() << -box.center().x(), -box.center().y(), -box.min().z();
  return T;
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
  Mesh result;
  result.triangles.reserve(mesh.triangles.size());
  // A hash table with open addressing, at most half full: numbers of new vertices, or -1.
  std::vector<int> slots(1024, -1);
  const auto slot_of = [&](const Eigen::Vector3d& p) -> int& {
    std::uint64_t hash = 0;
    for (const double x : p) {
      hash = (hash ^ std::bit_cast<std::uint64_t>(x)) * 0x9e3779b97f4a7c15u;
      hash ^= hash >> 32;
    }
    std::size_t n = hash & (slots.size() - 1);
    while (slots[n] >= 0 && !same_bits(result.vertices[slots[n]], p)) n = (n + 1) & (slots.size() - 1);
    return slots[n];
  };
  std::vector<int> numbers(mesh.vertices.size(), -1);  // of the old vertices
  for (const auto& old : mesh.triangles) {
    Eigen::Vector3i triangle;
    for (int k = 0; k < 3; ++k) {
      int& number = numbers[old[k]];
      if (number < 0) {
        const Eigen::Vector3d p = mesh.vertices[old[k]].array() + 0.0;  // -0 becomes 0
        int& slot = slot_of(p);
        number = slot >= 0 ? slot : static_cast<int>(result.vertices.size());
        if (slot < 0) {
          slot = number;
          result.vertices.push_back(p);
          if (2 * result.vertices.size() > slots.size()) {
            slots.assign(2 * slots.size(), -1);
            for (std::size_t n = 0; n < result.vertices.size(); ++n) slot_of(result.vertices[n]) = static_cast<int>(n);
          }
        }
      }
      triangle[k] = number;
    }
    result.triangles.push_back(triangle);
  }
  return result;
}

bool is_float32(const Mesh& mesh) {
  return std::all_of(mesh.vertices.begin(), mesh.vertices.end(), [](const Eigen::Vector3d& v) { return as_float32(v) == v; });
}

double float32_spacing_mm(const Eigen::AlignedBox3d& box) {
  const double largest = box.isEmpty() ? 0 : box.min().cwiseAbs().cwiseMax(box.max().cwiseAbs()).maxCoeff();
  return largest > 0 ? std::ldexp(1.0, std::ilogb(largest) - 23) : 0;
}

bool float32_holds_wall(const Eigen::AlignedBox3d& box, double wall_mm) { return 100 * float32_spacing_mm(box) <= wall_mm; }

Components connected_components(const Mesh& mesh) {
  UnionFind joined(static_cast<int>(mesh.vertices.size()));
  for (const auto& t : mesh.triangles)
    for (int k = 1; k < 3; ++k) joined.unite(t[0], t[k]);
  Components result;
  std::vector<int> number(mesh.vertices.size(), -1);
  result.of_triangle.reserve(mesh.triangles.size());
  for (const auto& t : mesh.triangles) {
    int& n = number[joined.root(t[0])];
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
