#include "shape/cage.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "base/union_find.h"
#include "rayrep/rays/ray_cast.h"

namespace rayrep::detail {
namespace {

/// The four cubic B-splines that reach into a cell, at t in it, with their first and second derivatives by t.
using Spline = std::array<std::array<double, 4>, 3>;
Spline splines_at(double t) {
  const double s = 1 - t;
  return {{{s * s * s / 6, (3 * t * t * t - 6 * t * t + 4) / 6, (3 * s * s * s - 6 * s * s + 4) / 6, t * t * t / 6},
           {-s * s / 2, (3 * t * t - 4 * t) / 2, (4 * s - 3 * s * s) / 2, t * t / 2},
           {s, 3 * t - 2, 3 * s - 2, t}}};
}

std::vector<double> vertex_areas(const Mesh& mesh) {
  std::vector<double> area(mesh.vertices.size(), 0);
  double all = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Eigen::Vector3d& a = mesh.corner(t, 0);
    const double size = 0.5 * (mesh.corner(t, 1) - a).cross(mesh.corner(t, 2) - a).norm();
    all += size;
    for (int k = 0; k < 3; ++k) area[static_cast<std::size_t>(mesh.triangles[t][k])] += size / 3;
  }
  for (double& one : area) one /= all;
  return area;
}

}  // namespace

/// Pairs of vertices that hang together, over an edge of the surface or through the solid between its two sides; and those that
/// face each other across a gap.
class Cage::Links {
public:
  /// @param widest_mm  of gaps
  Links(const Mesh& mesh, double spacing_mm, double widest_mm) {
    std::vector<std::pair<int, int>> pairs;
    for (const auto& t : mesh.triangles)
      for (int k = 0; k < 3; ++k) pairs.emplace_back(t[k], t[(k + 1) % 3]);
    for (int axis = 0; axis < 3; ++axis) cast(mesh, axis, spacing_mm, widest_mm, pairs);
    first_.assign(mesh.vertices.size() + 1, 0);
    for (const auto& [a, b] : pairs) ++first_[static_cast<std::size_t>(a) + 1];
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) first_[v + 1] += first_[v];
    to_.resize(pairs.size());
    std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
    for (const auto& [a, b] : pairs) to_[next[static_cast<std::size_t>(a)]++] = b;
  }

  const std::vector<Gap>& gaps() const { return gaps_; }

  template <typename Visit>
  void for_each(int vertex, const Visit& visit) const {
    for (std::size_t n = first_[static_cast<std::size_t>(vertex)]; n < first_[static_cast<std::size_t>(vertex) + 1]; ++n)
      visit(to_[n]);
  }

private:
  /// Rays along an axis, from one crossing of the surface to the next.
  void cast(const Mesh& mesh, int axis, double spacing_mm, double widest_mm, std::vector<std::pair<int, int>>& pairs) {
    Mesh turned = mesh;
    for (auto& v : turned.vertices) v = Eigen::Vector3d(v[(axis + 1) % 3], v[(axis + 2) % 3], v[axis]);
    const SurfaceQuery surface(turned);
    const RayGrid grid = covering_grid(bounding_box(turned), spacing_mm);
    std::vector<LineHit> hits;
    for (std::size_t ray = 0; ray < grid.size(); ++ray) {
      const Eigen::Vector2d xy = grid.at(ray);
      if (!closed_line_hits(surface, xy, hits)) continue;
      const auto nearest = [&](const LineHit& hit) {
        const Eigen::Vector3i& corners = mesh.triangles[static_cast<std::size_t>(hit.triangle)];
        const Eigen::Vector3d p(xy.x(), xy.y(), hit.z_mm);
        int best = 0;
        for (int k = 1; k < 3; ++k)
          if ((turned.corner(static_cast<std::size_t>(hit.triangle), k) - p).norm() <
              (turned.corner(static_cast<std::size_t>(hit.triangle), best) - p).norm())
            best = k;
        return corners[best];
      };
      for (std::size_t n = 0; n + 1 < hits.size(); ++n) {
        const double length_mm = hits[n + 1].z_mm - hits[n].z_mm;
        const int winding = winding_below(hits, 0.5 * (hits[n].z_mm + hits[n + 1].z_mm));
        const int from = nearest(hits[n]);
        const int to = nearest(hits[n + 1]);
        if (winding > 0)
          pairs.emplace_back(from, to);
        else if (winding == 0 && length_mm > 0 && length_mm < widest_mm && from != to)
          gaps_.push_back({axis, from, to, spacing_mm * spacing_mm, length_mm});
      }
    }
  }

  std::vector<std::size_t> first_;
  std::vector<int> to_;
  std::vector<Gap> gaps_;
};

/// Cells around the mesh. Control point (i, j, k) lies at the lower corner of cell (i - 1, j - 1, k - 1) and reaches into the cells
/// (i - 3, j - 3, k - 3) to (i, j, k).
struct Cage::Lattice {
  Eigen::Vector3d origin;
  double cell;
  Eigen::Array3i cells;
  std::vector<std::vector<int>> in_cell;  ///< vertices

  Lattice(const Mesh& mesh, double cell_mm) : cell(cell_mm) {
    const Eigen::AlignedBox3d box = bounding_box(mesh);
    cells = (box.sizes() / cell).array().ceil().cast<int>().max(1);
    origin = box.center() - 0.5 * cell * cells.matrix().cast<double>();
    in_cell.resize(static_cast<std::size_t>(cells.prod()));
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) in_cell[index(cell_of(mesh.vertices[v]))].push_back(static_cast<int>(v));
  }
  Eigen::Array3i cell_of(const Eigen::Vector3d& p) const {
    return ((p - origin) / cell).array().floor().cast<int>().max(0).min(cells - 1);
  }
  std::size_t index(const Eigen::Array3i& c) const { return static_cast<std::size_t>((c[0] * cells[1] + c[1]) * cells[2] + c[2]); }
  Eigen::Array3i controls() const { return cells + 3; }
};

Cage::Cage(const Mesh& mesh, Freedom freedom, const Options& options)
    : freedom_(std::move(freedom)), stiffness_mm_(options.stiffness_mm), area_(vertex_areas(mesh)) {
  const Links links(mesh, 0.25 * options.cell_mm, 2 * options.cell_mm);
  find_handles(mesh, Lattice(mesh, options.cell_mm), links);
  const double surface_mm2 = surface_area(mesh);
  gaps_ = links.gaps();
  for (Gap& gap : gaps_) gap.weight *= std::pow(stiffness_mm_ / gap.length_mm, 2) / surface_mm2;
  weigh(std::vector<double>(mesh.vertices.size(), 1));
}

void Cage::find_handles(const Mesh& mesh, const Lattice& lattice, const Links& links) {
  constexpr double negligible = 1e-5;
  const std::size_t count = mesh.vertices.size();
  std::vector<std::array<Spline, 3>> splines(count);
  for (std::size_t v = 0; v < count; ++v) {
    const Eigen::Array3i cell = lattice.cell_of(mesh.vertices[v]);
    for (int k = 0; k < 3; ++k)
      splines[v][static_cast<std::size_t>(k)] = splines_at((mesh.vertices[v][k] - lattice.origin[k]) / lattice.cell - cell[k]);
  }
  struct Found {
    Entry entry;
    Eigen::Matrix<float, 6, 1> bends;
  };
  std::vector<std::vector<Found>> of_vertex(count);
  const double per_square = 1 / (lattice.cell * lattice.cell);
  std::vector<int> place(count, -1);
  std::vector<int> members;
  const Eigen::Array3i controls = lattice.controls();
  for (int i = 0; i < controls[0]; ++i)
    for (int j = 0; j < controls[1]; ++j)
      for (int k = 0; k < controls[2]; ++k) {
        const Eigen::Array3i control(i, j, k);
        members.clear();
        const Eigen::Array3i lowest = (control - 3).max(0);
        const Eigen::Array3i highest = control.min(lattice.cells - 1);
        for (int a = lowest[0]; a <= highest[0]; ++a)
          for (int b = lowest[1]; b <= highest[1]; ++b)
            for (int c = lowest[2]; c <= highest[2]; ++c)
              for (const int v : lattice.in_cell[lattice.index({a, b, c})]) members.push_back(v);
        if (members.empty()) continue;
        for (std::size_t n = 0; n < members.size(); ++n) place[static_cast<std::size_t>(members[n])] = static_cast<int>(n);
        UnionFind joined(static_cast<int>(members.size()));
        for (std::size_t n = 0; n < members.size(); ++n)
          links.for_each(members[n], [&](int other) {
            if (const int m = place[static_cast<std::size_t>(other)]; m >= 0) joined.unite(static_cast<int>(n), m);
          });
        std::vector<Found> found(members.size());
        std::vector<double> largest(members.size(), 0);
        for (std::size_t n = 0; n < members.size(); ++n) {
          const auto v = static_cast<std::size_t>(members[n]);
          const Eigen::Array3i at = control - lattice.cell_of(mesh.vertices[v]);
          const auto value = [&](int axis, std::size_t derivative) {
            return splines[v][static_cast<std::size_t>(axis)][derivative][static_cast<std::size_t>(at[axis])];
          };
          const auto product = [&](std::size_t x, std::size_t y, std::size_t z) { return value(0, x) * value(1, y) * value(2, z); };
          constexpr double r = std::numbers::sqrt2;
          found[n].entry.weight = static_cast<float>(product(0, 0, 0));
          found[n].bends =
              (per_square * Eigen::Matrix<double, 6, 1>(product(2, 0, 0), product(0, 2, 0), product(0, 0, 2), r * product(1, 1, 0),
                                                        r * product(0, 1, 1), r * product(1, 0, 1)))
                  .cast<float>();
          double& most = largest[static_cast<std::size_t>(joined.root(static_cast<int>(n)))];
          most = std::max(most, product(0, 0, 0));
        }
        std::vector<int> handle(members.size(), -1);
        for (std::size_t n = 0; n < members.size(); ++n) {
          const auto root = static_cast<std::size_t>(joined.root(static_cast<int>(n)));
          if (largest[root] < negligible) continue;
          if (handle[root] < 0) handle[root] = static_cast<int>(handles_++);
          found[n].entry.handle = handle[root];
          of_vertex[static_cast<std::size_t>(members[n])].push_back(found[n]);
        }
        for (const int v : members) place[static_cast<std::size_t>(v)] = -1;
      }
  first_.push_back(0);
  for (const auto& entries : of_vertex) {
    for (const Found& one : entries) {
      entries_.push_back(one.entry);
      bends_.push_back(one.bends);
    }
    first_.push_back(entries_.size());
  }
}

void Cage::weigh(const std::vector<double>& weights) {
  weights_ = weights;
  assemble();
}

bool Cage::keep_open(const Handles& handles) {
  const std::vector<Eigen::Vector3d> moved = displacement(handles);
  bool any = false;
  for (Gap& gap : gaps_) {
    if (gap.axis > 2) continue;
    const double change = moved[static_cast<std::size_t>(gap.to)][gap.axis] - moved[static_cast<std::size_t>(gap.from)][gap.axis];
    if (change > -0.5 * gap.length_mm) continue;
    gap.weight *= 4;
    any = true;
  }
  if (any) assemble();
  return any;
}

void Cage::keep_apart(const std::vector<std::pair<int, int>>& pairs, const Mesh& mesh) {
  for (const auto& [a, b] : pairs) {
    const double apart_mm = (mesh.vertices[static_cast<std::size_t>(a)] - mesh.vertices[static_cast<std::size_t>(b)]).norm();
    if (!(apart_mm > 0)) continue;
    const double area = area_[static_cast<std::size_t>(a)] + area_[static_cast<std::size_t>(b)];
    gaps_.push_back({3, a, b, 4 * area * std::pow(stiffness_mm_ / apart_mm, 2), apart_mm});
  }
  assemble();
}

double Cage::freedom(int vertex, int axis) const {
  return (axis < 2 ? freedom_.across : freedom_.along)[static_cast<std::size_t>(vertex)];
}

void Cage::add_gap(const Gap& gap, int axis) {
  Eigen::MatrixXd& energy = energy_[static_cast<std::size_t>(axis)];
  std::vector<std::pair<int, double>> row;
  for (const int v : {gap.from, gap.to})
    for (std::size_t n = first_[static_cast<std::size_t>(v)]; n < first_[static_cast<std::size_t>(v) + 1]; ++n)
      row.emplace_back(entries_[n].handle, (v == gap.to ? 1 : -1) * freedom(v, axis) * static_cast<double>(entries_[n].weight));
  for (const auto& [i, a] : row)
    for (const auto& [j, b] : row)
      if (j <= i) energy(i, j) += gap.weight * a * b;
}

void Cage::assemble() {
  constexpr std::size_t enough = 4000;  // vertices, to integrate over the surface
  const std::size_t step = std::max<std::size_t>(1, area_.size() / enough);
  const bool first = bending_.size() == 0;
  const Eigen::Index n = handles_;
  if (first) bending_ = Eigen::MatrixXd::Zero(n, n);
  Eigen::MatrixXd across = Eigen::MatrixXd::Zero(n, n);
  Eigen::MatrixXd along = Eigen::MatrixXd::Zero(n, n);
  const double fourth = std::pow(stiffness_mm_, 4);
  const auto share = static_cast<double>(step);
  for (std::size_t v = 0; v < area_.size(); v += step)
    for (std::size_t a = first_[v]; a < first_[v + 1]; ++a)
      for (std::size_t b = first_[v]; b <= a; ++b) {
        const Eigen::Index i = std::max(entries_[a].handle, entries_[b].handle);
        const Eigen::Index j = std::min(entries_[a].handle, entries_[b].handle);
        const double both = share * area_[v] * entries_[a].weight * entries_[b].weight * weights_[v];
        across(i, j) += both * freedom_.across[v] * freedom_.across[v];
        along(i, j) += both * freedom_.along[v] * freedom_.along[v];
        if (first) bending_(i, j) += share * area_[v] * fourth * static_cast<double>(bends_[a].dot(bends_[b]));
      }
  energy_ = {across + bending_, across + bending_, along + bending_};
  for (const Gap& gap : gaps_)
    for (int axis = 0; axis < 3; ++axis)
      if (gap.axis == axis || gap.axis == 3) add_gap(gap, axis);
  // What hardly any vertex hangs on would be free to go anywhere.
  const double least = 1e-6 * energy_[0].diagonal().mean();
  for (std::size_t k = 0; k < 3; ++k) {
    energy_[k].diagonal().array() += least;
    solve_[k].compute(energy_[k]);
  }
}

std::vector<Eigen::Vector3d> Cage::displacement(const Handles& handles) const {
  std::vector<Eigen::Vector3d> moved(area_.size());
  for (std::size_t v = 0; v < moved.size(); ++v) {
    Eigen::Vector3d u = Eigen::Vector3d::Zero();
    for (std::size_t n = first_[v]; n < first_[v + 1]; ++n)
      u += static_cast<double>(entries_[n].weight) * handles.row(entries_[n].handle).transpose();
    moved[v] = u.cwiseProduct(Eigen::Vector3d(freedom_.across[v], freedom_.across[v], freedom_.along[v]));
  }
  return moved;
}

Handles Cage::pulled_back(const VertexGradient& gradient) const {
  Handles result = Handles::Zero(handles_, 3);
  for (std::size_t v = 0; v < area_.size(); ++v) {
    const Eigen::Vector3d g = gradient[v].cwiseProduct(Eigen::Vector3d(freedom_.across[v], freedom_.across[v], freedom_.along[v]));
    for (std::size_t n = first_[v]; n < first_[v + 1]; ++n)
      result.row(entries_[n].handle) += static_cast<double>(entries_[n].weight) * g.transpose();
  }
  return result;
}

double Cage::energy(const Handles& handles) const {
  double sum = 0;
  for (int k = 0; k < 3; ++k) {
    const Eigen::VectorXd h = handles.col(k);
    sum += h.dot(energy_[static_cast<std::size_t>(k)].selfadjointView<Eigen::Lower>() * h);
  }
  return sum;
}

Handles Cage::compliant(const Handles& force) const {
  Handles result(handles_, 3);
  for (int k = 0; k < 3; ++k) result.col(k) = solve_[static_cast<std::size_t>(k)].solve(force.col(k));
  return result;
}

}  // namespace rayrep::detail
