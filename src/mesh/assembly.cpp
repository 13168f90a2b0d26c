#include "rayrep/mesh/assembly.h"

#include <algorithm>
#include <array>
#include <tuple>
#include <unordered_map>
#include <vector>

#include "mesh/cut_corners.h"
#include "mesh/holes.h"
#include "mesh/mesh_edges.h"
#include "mesh/part.h"
#include "mesh/rims.h"

namespace rayrep {
namespace {

/// A triangle by its corners in ascending order, and whether it runs through them that way.
struct Facing {
  std::array<int, 3> corners;
  bool ascending;
  std::size_t triangle;
};

Facing facing(const Eigen::Vector3i& t, std::size_t triangle) {
  std::array<int, 3> corners{t[0], t[1], t[2]};
  std::sort(corners.begin(), corners.end());
  const int first = static_cast<int>(std::find(t.begin(), t.end(), corners[0]) - t.begin());
  return {corners, t[(first + 1) % 3] == corners[1], triangle};
}

/// Vertices merged, without triangles that have shrunk to a line by it: a cut through triangles of no area leaves such.
Mesh tidied(const Mesh& mesh) {
  const Mesh merged = with_merged_vertices(mesh);
  std::vector<int> kept;
  for (std::size_t t = 0; t < merged.triangles.size(); ++t) {
    const Eigen::Vector3i& v = merged.triangles[t];
    if (v[0] != v[1] && v[1] != v[2] && v[2] != v[0]) kept.push_back(static_cast<int>(t));
  }
  return part(merged, kept);
}

/// Cuts the triangles of a mesh at a plane, edge by edge. What lies in the plane counts as above it.
class Splitter {
public:
  Splitter(const Mesh& mesh, const ClipPlane& plane)
      : mesh_(mesh),
        plane_(plane),
        above_{{}, std::vector<int>(mesh.vertices.size(), -1)},
        below_{{}, std::vector<int>(mesh.vertices.size(), -1)} {
    height_.reserve(mesh.vertices.size());
    for (const Eigen::Vector3d& v : mesh.vertices) height_.push_back(plane.normal.dot(v) - plane.offset_mm);
  }

  Halves run(const Progress& progress) {
    for (const Eigen::Vector3i& triangle : mesh_.triangles) {
      add(triangle, above_, true);
      add(triangle, below_, false);
    }
    progress.check();
    cap(progress);
    // Where the surface lies in the plane and material below it, nothing is left above but two sheets on each other.
    const bool flaps = std::find(height_.begin(), height_.end(), 0.0) != height_.end();
    return {flaps ? glued(above_.mesh) : tidied(above_.mesh), tidied(below_.mesh)};
  }

private:
  struct Side {
    Mesh mesh;
    std::vector<int> number;                             ///< of the vertices there
    std::unordered_map<std::uint64_t, int> on_cut = {};  ///< of the points where edges cross the plane
  };

  void add(const Eigen::Vector3i& triangle, Side& side, bool above) {
    CutCorners corners = cut_corners(
        triangle, height_, above, [&](int v) { return vertex(v, side); }, [&](int a, int b) { return crossing(a, b, side); });
    if (corners.count < 3) return;
    // Of four corners the diagonal is that from the least one, whichever way they run.
    const auto least = [&side](int v, int w) {
      const Eigen::Vector3d& p = side.mesh.vertices[v];
      const Eigen::Vector3d& q = side.mesh.vertices[w];
      return std::lexicographical_compare(p.begin(), p.end(), q.begin(), q.end());
    };
    const auto begin = corners.v.begin();
    std::rotate(begin, std::min_element(begin, begin + corners.count, least), begin + corners.count);
    for (int k = 2; k < corners.count; ++k) side.mesh.triangles.emplace_back(corners.v[0], corners.v[k - 1], corners.v[k]);
  }

  int vertex(int v, Side& side) const {
    int& number = side.number[v];
    if (number < 0) {
      number = static_cast<int>(side.mesh.vertices.size());
      side.mesh.vertices.push_back(mesh_.vertices[v]);
    }
    return number;
  }

  /// Where the edge crosses the plane: at the same point for both sides.
  int crossing(int a, int b, Side& side) {
    const int low = height_[a] < height_[b] ? a : b;
    const int high = low == a ? b : a;
    if (height_[high] == 0) {
      const int v = vertex(high, side);
      side.on_cut[edge_key(high, high)] = v;
      return v;
    }
    const auto [place, is_new] = side.on_cut.try_emplace(edge_key(low, high), static_cast<int>(side.mesh.vertices.size()));
    if (is_new) {
      const double t = height_[low] / (height_[low] - height_[high]);
      Eigen::Vector3d p = mesh_.vertices[low] + t * (mesh_.vertices[high] - mesh_.vertices[low]);
      p -= (plane_.normal.dot(p) - plane_.offset_mm) * plane_.normal;
      side.mesh.vertices.push_back(p);
    }
    return place->second;
  }

  /// Closes the upper side, and the lower one with the same triangles, turned round.
  void cap(const Progress& progress) {
    const Rims rims = rims_of(above_.mesh);
    if (rims.closed()) return;
    const std::size_t before = above_.mesh.triangles.size();
    close_flat(holes_of(above_.mesh, rims), 1e-9 * bounding_box(mesh_).diagonal().norm(), above_.mesh, progress);
    std::vector<int> twin(above_.mesh.vertices.size(), -1);
    for (const auto& [edge, v] : above_.on_cut) twin[v] = below_.on_cut.at(edge);
    for (std::size_t t = before; t < above_.mesh.triangles.size(); ++t) {
      const Eigen::Vector3i& v = above_.mesh.triangles[t];
      below_.mesh.triangles.emplace_back(twin[v[0]], twin[v[2]], twin[v[1]]);
    }
  }

  const Mesh& mesh_;
  const ClipPlane& plane_;
  std::vector<double> height_;  ///< of each vertex above the plane
  Side above_;
  Side below_;
};

}  // namespace

bool in_pieces(const Delivery& delivery) {
  return std::any_of(delivery.parts.begin(), delivery.parts.end(),
                     [](const Part& part) { return part.role == Part::Role::body && !part.name.empty(); });
}

Mesh glued(const Mesh& mesh) {
  const Mesh merged = tidied(mesh);
  std::vector<Facing> all;
  all.reserve(merged.triangles.size());
  for (std::size_t t = 0; t < merged.triangles.size(); ++t) all.push_back(facing(merged.triangles[t], t));
  std::sort(all.begin(), all.end(), [](const Facing& a, const Facing& b) {
    return std::tie(a.corners, a.ascending, a.triangle) < std::tie(b.corners, b.ascending, b.triangle);
  });
  std::vector<int> kept;
  for (auto begin = all.begin(); begin != all.end();) {
    auto turn = begin;
    while (turn != all.end() && turn->corners == begin->corners && !turn->ascending) ++turn;
    auto end = turn;
    while (end != all.end() && end->corners == begin->corners) ++end;
    const auto pairs = std::min(turn - begin, end - turn);
    for (auto one = begin + pairs; one != turn; ++one) kept.push_back(static_cast<int>(one->triangle));
    for (auto one = turn + pairs; one != end; ++one) kept.push_back(static_cast<int>(one->triangle));
    begin = end;
  }
  std::sort(kept.begin(), kept.end());
  return part(merged, kept);
}

Halves halves(const Mesh& mesh, const ClipPlane& plane, const Progress& progress) { return Splitter(mesh, plane).run(progress); }

}  // namespace rayrep
