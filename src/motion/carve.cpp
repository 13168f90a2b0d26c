#include "rayrep/motion/carve.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/text.h"
#include "motion/sweep.h"
#include "rayrep/base/error.h"
#include "rayrep/mesh/block_field.h"
#include "rayrep/mesh/bodies.h"
#include "rayrep/mesh/boolean.h"
#include "rayrep/mesh/level_set.h"
#include "rayrep/physics/moments.h"

namespace rayrep {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;
using Eigen::Vector3i;

constexpr int kSide = BlockField::kSide;
const double kSqrt3 = std::sqrt(3.0);

/// The offset of a sweep in a box as a field: its distance less the offset, cut off at the box. 1-Lipschitz but for the sweep's
/// accuracy.
class OffsetField {
public:
  OffsetField(const Sweep& sweep, const AlignedBox3d& box, double offset_mm, double spacing_mm)
      : sweep_(sweep), box_(box), offset_(offset_mm) {
    field_.spacing_mm = spacing_mm;
    field_.origin_mm = box.min() - 2 * spacing_mm * Vector3d::Ones();
    for (int k = 0; k < 3; ++k)
      field_.blocks[k] = static_cast<int>((box.max()[k] + 2 * spacing_mm - field_.origin_mm[k]) / spacing_mm) / kSide + 1;
  }

  BlockField sampled(const Progress& progress) {
    field_.state.assign(field_.block_index(field_.blocks.x() - 1, field_.blocks.y() - 1, field_.blocks.z() - 1) + 1,
                        BlockField::kOutside);
    int whole = 1;
    while (whole < field_.blocks.maxCoeff()) whole *= 2;
    divide(Vector3i::Zero(), whole, progress);
    constexpr std::size_t kAtOnce = 256;
    std::vector<BlockField::Block> samples(kAtOnce);
    std::vector<std::int32_t> states(kAtOnce);
    for (std::size_t first = 0; first < near_.size(); first += kAtOnce) {
      progress.check();
      const std::size_t count = std::min(kAtOnce, near_.size() - first);
      tbb::parallel_for(std::size_t{0}, count, [&](std::size_t n) {
        const Vector3i block = near_[first + n];
        states[n] = descend(kSide * block, kSide, {0, samples[n]});
      });
      for (std::size_t n = 0; n < count; ++n) {
        const Vector3i& b = near_[first + n];
        std::int32_t& state = field_.state[field_.block_index(b.x(), b.y(), b.z())];
        state = states[n];
        if (state < 0) continue;
        state = static_cast<std::int32_t>(field_.samples.size());
        field_.samples.push_back(samples[n]);
      }
    }
    return std::move(field_);
  }

private:
  struct Filled {
    std::size_t hint;
    BlockField::Block& block;
  };

  /// Beyond `reach` either way only the sign is right.
  double value(const Vector3d& p, double reach, std::size_t& hint) const {
    const double beyond = -(p - box_.min()).cwiseMin(box_.max() - p).minCoeff();
    if (beyond > reach) return beyond;
    const double distance = sweep_.distance_mm(p, offset_ - 2 * reach, offset_ + 2 * reach, hint);
    return std::max(beyond, distance - offset_);
  }

  double reach_of(int samples) const { return (kSqrt3 * samples / 2 + 1) * field_.spacing_mm + sweep_.accuracy_mm(); }

  /// Finds the blocks in which samples of both signs may be, and marks the others.
  void divide(const Vector3i& corner, int size, const Progress& progress) {
    if ((corner.array() >= field_.blocks.array()).any()) return;
    progress.check();
    if (size == 1) {
      near_.push_back(corner);
      return;
    }
    const Vector3i middle = kSide * corner + Vector3i::Constant(kSide * size / 2);
    const double reach = reach_of(kSide * size);
    std::size_t hint = 0;
    const double there = value(field_.position(middle.x(), middle.y(), middle.z()), reach, hint);
    if (there > reach) return;
    const int half = size / 2;
    for (int n = 0; n < 8; ++n) divide(corner + half * Vector3i(n >> 2, (n >> 1) & 1, n & 1), half, progress);
  }

  static std::size_t index(const Vector3i& sample) {
    return static_cast<std::size_t>(BlockField::sample_index(sample.x() % kSide, sample.y() % kSide, sample.z() % kSide));
  }

  /// A mark for a cube of samples of one sign, or 0: then they are in the block.
  std::int32_t descend(const Vector3i& corner, int size, Filled filled) const {
    const Vector3i middle = corner.array() + size / 2;
    const double reach = reach_of(size);
    const double there = value(field_.position(middle.x(), middle.y(), middle.z()), reach, filled.hint);
    if (there > reach || there < -reach) {
      if (size < kSide) fill(corner, size, there < 0 ? -field_.far() : field_.far(), filled.block);
      return there < 0 ? BlockField::kInside : BlockField::kOutside;
    }
    if (size == 1) {
      filled.block[index(corner)] = static_cast<float>(there);
      return 0;
    }
    const int half = size / 2;
    for (int n = 0; n < 8; ++n) descend(corner + half * Vector3i(n >> 2, (n >> 1) & 1, n & 1), half, filled);
    return 0;
  }

  static void fill(const Vector3i& corner, int size, float value, BlockField::Block& block) {
    for (int i = 0; i < size; ++i)
      for (int j = 0; j < size; ++j)
        for (int k = 0; k < size; ++k) block[index(corner + Vector3i(i, j, k))] = value;
  }

  const Sweep& sweep_;
  AlignedBox3d box_;
  double offset_;
  BlockField field_;
  std::vector<Vector3i> near_;
};

/// Bounds of the distances from a sweep that points of a mesh have, within a box.
struct Distances {
  double at_least = std::numeric_limits<double>::infinity();
  double at_most = 0;
};

/// From the distances d of the corners: d^2 - |x|^2 is concave, theory.md (114).
Distances distances_of(const Mesh& mesh, const Sweep& sweep, const AlignedBox3d& within, double cap_mm, const Progress& progress) {
  std::vector<double> at(mesh.vertices.size());
  constexpr std::size_t kAtOnce = 4096;
  for (std::size_t first = 0; first < at.size(); first += kAtOnce) {
    progress.check();
    tbb::parallel_for(first, std::min(first + kAtOnce, at.size()), [&](std::size_t n) {
      std::size_t hint = 0;
      if (within.contains(mesh.vertices[n]) || within.exteriorDistance(mesh.vertices[n]) < cap_mm)
        at[n] = sweep.distance_mm(mesh.vertices[n], 0, cap_mm, hint);
    });
  }
  Distances found;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    AlignedBox3d box;
    std::array<double, 3> d;
    for (int k = 0; k < 3; ++k) {
      box.extend(mesh.corner(t, k));
      d[static_cast<std::size_t>(k)] = at[static_cast<std::size_t>(mesh.triangles[t][k])];
    }
    if (!within.intersects(box)) continue;
    const Vector3d middle = (mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2)) / 3;
    double radius2 = 0;
    for (int k = 0; k < 3; ++k) radius2 = std::max(radius2, (mesh.corner(t, k) - middle).squaredNorm());
    const auto [least, most] = std::minmax_element(d.begin(), d.end());
    const double nearest = std::max(0.0, *least - sweep.accuracy_mm());
    found.at_least = std::min(found.at_least, std::sqrt(std::max(0.0, nearest * nearest - radius2)));
    found.at_most = std::max(found.at_most, *most + std::sqrt(radius2) + sweep.accuracy_mm());
  }
  return found;
}

void require_sensible(const Scene& scene, std::size_t part, std::size_t by, const CarveOptions& options) {
  if (part == by) throw Error(ErrorCode::usage, "A part cannot be carved by itself: name another one with --by.");
  if (!(options.clearance_mm >= 0) || !(options.tolerance_mm > 0))
    throw Error(ErrorCode::usage, "A clearance must not be negative and a tolerance has to be positive; they are " +
                                      shown(options.clearance_mm) + " mm and " + shown(options.tolerance_mm) + " mm.");
  if (scene.transitions.empty() && scene.states.empty())
    throw Error(ErrorCode::input, "The scene has no states and no transitions: nothing moves in it.");
}

/// Fine enough that no place of the sweep lies between samples, and triangles are small beside the tolerance.
double spacing_of(const CarveOptions& options, const AlignedBox3d& box) {
  const double spacing = std::min(options.tolerance_mm / 1.5, (options.clearance_mm + options.tolerance_mm) / 2.8);
  const double most = 2e9;
  const double samples = (box.sizes() / spacing).prod();
  if (!(samples <= 1e3 * most) || (box.sizes() / spacing).maxCoeff() > 1e5)
    throw Error(ErrorCode::goal, "To carve " + shown(options.clearance_mm) + " mm to " + shown(options.tolerance_mm) +
                                     " mm in a part of " + shown(box.sizes().maxCoeff()) +
                                     " mm takes too many samples: allow a larger --tolerance.");
  return spacing;
}

}  // namespace

Carving carve(const Scene& scene, std::size_t part, std::size_t by, const CarveOptions& options, const Progress& progress) {
  require_sensible(scene, part, by, options);
  const Mesh& mesh = *scene.parts[part].mesh;
  const AlignedBox3d own = bounding_box(mesh);
  const double spacing = spacing_of(options, own);
  AlignedBox3d box = own;
  box.min().array() -= 3 * spacing;
  box.max().array() += 3 * spacing;
  progress.begin("sweep");
  AlignedBox3d asked = box;
  asked.min().array() -= 2 * kSide * spacing;
  asked.max().array() += 2 * kSide * spacing;
  const Sweep sweep(scene, part, by, asked, options.tolerance_mm / 20);
  const double wanted = options.clearance_mm * (1 + 1e-6) + 1e-6 * own.diagonal().norm() / 10;
  double offset = std::max(std::hypot(wanted + sweep.accuracy_mm(), 0.7 * spacing), 1.8 * spacing);
  Carving result;
  for (int round = 0; round < 5; ++round) {
    result.taken = mesh_zero_set(OffsetField(sweep, box, offset, spacing).sampled(progress));
    const Distances found = distances_of(result.taken, sweep, own, offset + 4 * spacing, progress);
    result.at_least_mm = found.at_least;
    result.at_most_mm = found.at_most;
    if (found.at_least >= wanted) break;
    offset += 1.05 * (wanted - found.at_least);
  }
  progress.begin("subtract");
  const std::array<Mesh, 2> operands = {mesh, result.taken};
  result.left = combined(operands, {.operation = BooleanOperation::subtract, .float32 = options.float32}, progress).mesh;
  result.removed_mm3 = mesh_moments(mesh)[M1] - mesh_moments(result.left)[M1];
  result.bodies = result.left.triangles.empty() ? 0 : static_cast<std::size_t>(bodies_of(result.left, progress).count);
  if (result.at_least_mm < wanted)
    throw Error(ErrorCode::internal, "The room that was carved is nearer than it has to be, " + shown(result.at_least_mm) + " mm.");
  return result;
}

}  // namespace rayrep
