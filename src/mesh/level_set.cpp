#include "rayrep/mesh/level_set.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/VolumeToMesh.h>
#include <tbb/parallel_for.h>

#include <mutex>

namespace rayrep {
namespace {

using Grid = openvdb::FloatGrid;
using Leaf = Grid::TreeType::LeafNodeType;
static_assert(Leaf::DIM == BlockField::kSide, "a block of the field is a leaf of the tree");

void initialise_openvdb() {
  static std::once_flag once;
  std::call_once(once, [] { openvdb::initialize(); });
}

/// Sample (i, j, k) of the field at index coordinates (i, j, k).
Grid::Ptr to_grid(const BlockField& field) {
  Grid::Ptr grid = Grid::create(field.far());
  auto& tree = grid->tree();
  for (int a = 0; a < field.blocks.x(); ++a)
    for (int b = 0; b < field.blocks.y(); ++b)
      for (int c = 0; c < field.blocks.z(); ++c) {
        const std::int32_t state = field.state[field.block_index(a, b, c)];
        if (state == BlockField::kOutside) continue;
        const openvdb::Coord origin(a * BlockField::kSide, b * BlockField::kSide, c * BlockField::kSide);
        if (state == BlockField::kInside) {
          tree.addTile(1, origin, -field.far(), false);
          continue;
        }
        Leaf* leaf = new Leaf(origin, field.far(), true);
        const BlockField::Block& block = field.samples[static_cast<std::size_t>(state)];
        // Both orders are x-major with z fastest.
        for (openvdb::Index n = 0; n < Leaf::SIZE; ++n) leaf->setValueOnly(n, block[n]);
        tree.addLeaf(leaf);
      }
  return grid;
}

}  // namespace

Mesh mesh_zero_set(const BlockField& field) {
  initialise_openvdb();
  const Grid::Ptr grid = to_grid(field);
  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec3I> triangles;
  std::vector<openvdb::Vec4I> quads;
  openvdb::tools::volumeToMesh(*grid, points, triangles, quads, 0.0, 0.0);

  Mesh mesh;
  mesh.vertices.reserve(points.size());
  for (const auto& p : points) mesh.vertices.push_back(field.origin_mm + field.spacing_mm * Eigen::Vector3d(p.x(), p.y(), p.z()));
  mesh.triangles.reserve(triangles.size() + 2 * quads.size());
  // In index coordinates OpenVDB's polygons face away from the region of negative values, as ours do.
  const auto add = [&mesh](openvdb::Index32 a, openvdb::Index32 b, openvdb::Index32 c) {
    mesh.triangles.emplace_back(static_cast<int>(a), static_cast<int>(b), static_cast<int>(c));
  };
  for (const auto& t : triangles) add(t[0], t[1], t[2]);
  for (const auto& q : quads) {
    // The shorter diagonal gives the rounder triangles.
    const auto d02 = (points[q[0]] - points[q[2]]).lengthSqr();
    const auto d13 = (points[q[1]] - points[q[3]]).lengthSqr();
    if (d02 <= d13) {
      add(q[0], q[1], q[2]);
      add(q[0], q[2], q[3]);
    } else {
      add(q[0], q[1], q[3]);
      add(q[1], q[2], q[3]);
    }
  }
  return mesh;
}

Mesh mesh_implicit(const std::function<double(const Eigen::Vector3d&)>& f, const Eigen::AlignedBox3d& box, double spacing_mm) {
  constexpr int side = BlockField::kSide;
  BlockField field;
  field.origin_mm = box.min();
  field.spacing_mm = spacing_mm;
  for (int k = 0; k < 3; ++k) field.blocks[k] = static_cast<int>(box.sizes()[k] / spacing_mm) / side + 1;
  const auto count = static_cast<std::size_t>(field.blocks.prod());
  std::vector<BlockField::Block> all(count);
  std::vector<std::int32_t> sign(count);
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t index) {
    const int c = static_cast<int>(index % static_cast<std::size_t>(field.blocks.z()));
    const int b = static_cast<int>(index / static_cast<std::size_t>(field.blocks.z()) % static_cast<std::size_t>(field.blocks.y()));
    const int a = static_cast<int>(index / static_cast<std::size_t>(field.blocks.z()) / static_cast<std::size_t>(field.blocks.y()));
    bool any_negative = false;
    bool any_positive = false;
    for (int i = 0; i < side; ++i)
      for (int j = 0; j < side; ++j)
        for (int k = 0; k < side; ++k) {
          const auto value = static_cast<float>(f(field.position(a * side + i, b * side + j, c * side + k)));
          all[index][static_cast<std::size_t>(BlockField::sample_index(i, j, k))] = value;
          (value < 0 ? any_negative : any_positive) = true;
        }
    sign[index] = any_negative && any_positive ? 0 : any_negative ? BlockField::kInside : BlockField::kOutside;
  });
  // A block of one sign is kept when a neighbour has the other: the zero set may run between them.
  field.state.assign(count, 0);
  for (int a = 0; a < field.blocks.x(); ++a)
    for (int b = 0; b < field.blocks.y(); ++b)
      for (int c = 0; c < field.blocks.z(); ++c) {
        const std::size_t index = field.block_index(a, b, c);
        bool uniform = sign[index] != 0;
        for (int da = -1; da <= 1; ++da)
          for (int db = -1; db <= 1; ++db)
            for (int dc = -1; dc <= 1; ++dc) {
              const Eigen::Vector3i n(a + da, b + db, c + dc);
              if ((n.array() < 0).any() || (n.array() >= field.blocks.array()).any()) continue;
              uniform = uniform && sign[field.block_index(n.x(), n.y(), n.z())] == sign[index];
            }
        if (uniform) {
          field.state[index] = sign[index];
        } else {
          field.state[index] = static_cast<std::int32_t>(field.samples.size());
          field.samples.push_back(all[index]);
        }
      }
  return mesh_zero_set(field);
}

}  // namespace rayrep
