#include "rayrep/mesh/section.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>
#include <numeric>
#include <utility>

#include "mesh/mesh_edges.h"

namespace rayrep {
namespace {

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

Eigen::AlignedBox2d box_of(const SectionLoop& loop) {
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& p : loop) box.extend(p);
  return box;
}

/// A piece of the section across one triangle, from edge to edge. An edge is run the same way by both of its triangles' pieces: one
/// ends there, the other begins.
struct Piece {
  std::uint64_t from;
  std::uint64_t to;
};

Eigen::Vector2d point_on(const Mesh& mesh, std::uint64_t edge, double height_mm) {
  const Eigen::Vector3d& a = mesh.vertices[edge >> 32];
  const Eigen::Vector3d& b = mesh.vertices[edge & 0xffffffffU];
  const double t = (height_mm - a.z()) / (b.z() - a.z());
  return (a + t * (b - a)).head<2>();
}

/// Pieces joined to loops. Where an edge has several pieces that begin, any of them makes loops of the same section.
std::vector<SectionLoop> joined(const Mesh& mesh, const std::vector<Piece>& pieces, double height_mm) {
  using Begin = std::pair<std::uint64_t, std::size_t>;
  std::vector<Begin> begins;
  for (std::size_t n = 0; n < pieces.size(); ++n) begins.emplace_back(pieces[n].from, n);
  std::sort(begins.begin(), begins.end());
  std::vector<bool> used(pieces.size(), false);
  std::vector<SectionLoop> loops;
  for (std::size_t first = 0; first < pieces.size(); ++first) {
    if (used[first]) continue;
    SectionLoop loop;
    std::size_t n = first;
    bool closes = false;
    while (true) {
      used[n] = true;
      loop.push_back(point_on(mesh, pieces[n].from, height_mm));
      closes = pieces[n].to == pieces[first].from;
      if (closes) break;
      const std::uint64_t edge = pieces[n].to;
      auto next = std::lower_bound(begins.begin(), begins.end(), Begin(edge, 0));
      while (next != begins.end() && next->first == edge && used[next->second]) ++next;
      if (next == begins.end() || next->first != edge) break;
      n = next->second;
    }
    if (closes && loop.size() >= 3) loops.push_back(std::move(loop));
  }
  return loops;
}

}  // namespace

MeshSections::MeshSections(const Mesh& mesh) : mesh_(mesh), by_bottom_(mesh.triangles.size()) {
  const auto bottom = [&mesh](int t) { return std::min({mesh.corner(t, 0).z(), mesh.corner(t, 1).z(), mesh.corner(t, 2).z()}); };
  std::iota(by_bottom_.begin(), by_bottom_.end(), 0);
  std::vector<double> bottoms(by_bottom_.size());
  for (std::size_t t = 0; t < bottoms.size(); ++t) {
    bottoms[t] = bottom(static_cast<int>(t));
    tallest_mm_ =
        std::max(tallest_mm_, std::max({mesh.corner(t, 0).z(), mesh.corner(t, 1).z(), mesh.corner(t, 2).z()}) - bottoms[t]);
  }
  std::stable_sort(by_bottom_.begin(), by_bottom_.end(), [&bottoms](int a, int b) { return bottoms[a] < bottoms[b]; });
  for (const int t : by_bottom_) bottom_mm_.push_back(bottoms[t]);
}

std::vector<SectionLoop> MeshSections::at(double height_mm) const {
  std::vector<Piece> pieces;
  const auto begin = std::lower_bound(bottom_mm_.begin(), bottom_mm_.end(), height_mm - tallest_mm_) - bottom_mm_.begin();
  const auto end = std::lower_bound(bottom_mm_.begin(), bottom_mm_.end(), height_mm) - bottom_mm_.begin();
  for (auto n = begin; n < end; ++n) {
    const Eigen::Vector3i& t = mesh_.triangles[by_bottom_[n]];
    const auto above = [&](int k) { return mesh_.vertices[t[k]].z() >= height_mm; };
    for (int k = 0; k < 3; ++k) {
      const int a = k;
      const int b = (k + 1) % 3;
      const int c = (k + 2) % 3;
      // The corner that is alone on its side. The piece runs so that the material is to the left.
      if (above(a) == above(b) || above(a) == above(c)) continue;
      const std::uint64_t ab = edge_key(t[a], t[b]);
      const std::uint64_t ac = edge_key(t[a], t[c]);
      pieces.push_back(above(a) ? Piece{ab, ac} : Piece{ac, ab});
    }
  }
  return joined(mesh_, pieces, height_mm);
}

std::vector<SectionLoop> section(const Mesh& mesh, double height_mm) { return MeshSections(mesh).at(height_mm); }

LoopMoments loop_moments(const SectionLoop& loop) {
  LoopMoments moments;
  if (loop.empty()) return moments;
  const Eigen::Vector2d origin = loop.front();
  Eigen::Vector2d six = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const Eigen::Vector2d a = loop[i] - origin;
    const Eigen::Vector2d b = loop[(i + 1) % loop.size()] - origin;
    moments.area_mm2 += 0.5 * cross(a, b);
    six += cross(a, b) * (a + b);
  }
  moments.moment_mm3 = six / 6 + moments.area_mm2 * origin;
  return moments;
}

bool contains(const SectionLoop& loop, const Eigen::Vector2d& p) {
  bool inside = false;
  for (std::size_t i = 0, j = loop.size() - 1; i < loop.size(); j = i++) {
    const Eigen::Vector2d& a = loop[i];
    const Eigen::Vector2d& b = loop[j];
    if ((a.y() > p.y()) != (b.y() > p.y()) && p.x() < (b.x() - a.x()) * (p.y() - a.y()) / (b.y() - a.y()) + a.x()) inside = !inside;
  }
  return inside;
}

std::vector<std::size_t> outermost(const std::vector<SectionLoop>& loops) {
  std::vector<double> area;
  std::vector<Eigen::AlignedBox2d> boxes;
  for (const SectionLoop& loop : loops) {
    area.push_back(std::abs(loop_moments(loop).area_mm2));
    boxes.push_back(box_of(loop));
  }
  std::vector<std::size_t> order(loops.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&area](std::size_t a, std::size_t b) { return area[a] > area[b]; });
  std::vector<std::size_t> outer;
  for (const std::size_t n : order) {
    const Eigen::Vector2d& p = loops[n].front();
    if (std::none_of(outer.begin(), outer.end(),
                     [&](std::size_t other) { return boxes[other].contains(p) && contains(loops[other], p); }))
      outer.push_back(n);
  }
  return outer;
}

}  // namespace rayrep
