#include "mesh/decimate.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <numeric>
#include <utility>

#include "mesh/crossing.h"
#include "mesh/edge_collapse.h"
#include "mesh/float32.h"
#include "mesh/mesh_edges.h"
#include "mesh/predicates.h"

namespace rayrep {
namespace {

using Eigen::Vector3d;

double squared_distance_to_sides(const Facet& facet, const Vector3d& p) {
  const auto to_side2 = [](const Vector3d& q, const Vector3d& side) {
    const double length2 = side.squaredNorm();
    const double share = length2 > 0 ? std::clamp(q.dot(side) / length2, 0.0, 1.0) : 0;
    return (q - share * side).squaredNorm();
  };
  const Vector3d q = p - facet.corner;
  return std::min(
      {to_side2(q, facet.side), to_side2(q, facet.other_side), to_side2(q - facet.side, facet.other_side - facet.side)});
}

/// A triangle, for the distances of many points.
class Patch {
public:
  explicit Patch(const Facet& facet)
      : facet_(facet),
        area2_(facet.normal.squaredNorm()),
        along_side_(facet.other_side.cross(facet.normal)),
        along_other_(facet.normal.cross(facet.side)) {}

  /// Whether p is above or below it, no farther than the root of a limit.
  bool is_below(const Vector3d& p, double limit2) const {
    const Vector3d q = p - facet_.corner;
    const double height = facet_.normal.dot(q);
    const double s = along_side_.dot(q);
    const double t = along_other_.dot(q);
    return s >= 0 && t >= 0 && s + t <= area2_ && height * height <= limit2 * area2_ && area2_ > 0;
  }

  const Facet& facet() const { return facet_; }

private:
  const Facet facet_;
  const double area2_;
  const Vector3d along_side_, along_other_;
};

/// The first of these from which p is no farther than the root of a limit; their number if there is none.
std::size_t first_within(const std::vector<Patch>& patches, const Vector3d& p, double limit2) {
  for (std::size_t k = 0; k < patches.size(); ++k)
    if (patches[k].is_below(p, limit2)) return k;
  for (std::size_t k = 0; k < patches.size(); ++k)
    if (squared_distance_to_sides(patches[k].facet(), p) <= limit2) return k;
  return patches.size();
}

/// Vertices by what their cheapest collapse costs, to a factor of two; those of like cost in the order in which they came.
class CostQueue {
public:
  /// @param next     for each vertex room for one that comes after it; a vertex is in one queue at a time
  /// @param nothing  up to this the order does not matter
  CostQueue(std::vector<int>& next, float nothing)
      : at_(bucket_of(nothing)), next_(next), first_(kBuckets, -1), last_(kBuckets, -1) {}

  /// Whether it is the turn of such a cost, or nearly so.
  bool due(float cost) const { return bucket_of(cost) <= at_ + 1; }

  /// A vertex that is not there. Behind all of like cost, and of those that are gone.
  void push(int vertex, float cost) {
    const int bucket = std::max(at_, bucket_of(cost));
    next_[vertex] = -1;
    (first_[bucket] < 0 ? first_[bucket] : next_[last_[bucket]]) = vertex;
    last_[bucket] = vertex;
  }

  /// -1 when none is left.
  int pop() {
    while (at_ < kBuckets && first_[at_] < 0) ++at_;
    if (at_ == kBuckets) return -1;
    const int vertex = first_[at_];
    first_[at_] = next_[vertex];
    return vertex;
  }

private:
  static constexpr int kBuckets = 256;
  static int bucket_of(float cost) { return static_cast<int>(std::bit_cast<std::uint32_t>(cost) >> 23); }  // its exponent

  int at_;
  std::vector<int>& next_;
  std::vector<int> first_, last_;
};

/// How far each vertex may lie from what comes of it.
class ChordErrors {
public:
  ChordErrors(std::size_t vertices, double error_mm)
      : least2_(std::pow(error_mm / 16, 2)), squared_(vertices, error_mm * error_mm) {}

  const std::vector<double>& squared() const { return squared_; }
  /// To a quarter; from 1/16 of what it was in the beginning to nothing.
  void lower(int vertex) { squared_[vertex] = squared_[vertex] > least2_ ? squared_[vertex] / 16 : 0; }
  void forbid(int vertex) { squared_[vertex] = 0; }

private:
  double least2_;
  std::vector<double> squared_;
};

constexpr float kNever = std::numeric_limits<float>::infinity();

double area_of(const Mesh& mesh) {
  return tbb::parallel_deterministic_reduce(
      tbb::blocked_range<std::size_t>(0, mesh.triangles.size(), 4096), 0.0,
      [&mesh](const auto& range, double area) {
        for (std::size_t t = range.begin(); t < range.end(); ++t)
          area += 0.5 * (mesh.corner(t, 1) - mesh.corner(t, 0)).cross(mesh.corner(t, 2) - mesh.corner(t, 0)).norm();
        return area;
      },
      std::plus<>());
}

/// What is left of a mesh, and where the vertices went that are gone.
struct Remains {
  const Mesh& given;
  const VertexCorners& at;
  double error2;
  double area_mm2;                    ///< of what was given
  const std::vector<double>& limit2;  ///< for each vertex how far it may lie from what comes of it, squared
  HalfEdges surface;
  std::vector<float> tried;  ///< of each vertex: what its collapses cost that were tried in vain with all around it as it is
  std::vector<char> waits;   ///< for that to change
  std::vector<int> first_gone, next_gone;  ///< of each triangle the vertices that went into it, as a list

  Remains(const Mesh& mesh, const VertexCorners& corners, double error_mm, const std::vector<double>& limits2)
      : given(mesh),
        at(corners),
        error2(error_mm * error_mm),
        area_mm2(area_of(mesh)),
        limit2(limits2),
        surface(mesh, corners),
        tried(mesh.vertices.size(), -1),
        waits(mesh.vertices.size(), 0),
        first_gone(mesh.triangles.size(), -1),
        next_gone(mesh.vertices.size(), -1) {}

  DecimatedMesh result() const;

  /// The vertices that are corners of, or went into, the `chosen` triangles of the result and those in so many rings around them.
  std::vector<int> vertices_around(const DecimatedMesh& result, std::vector<int> chosen, int rings) const;
};

/// Takes vertices out of a part of a mesh.
class Decimator {
public:
  /// @param inner  for each vertex: it is in this part with all of its neighbours, and may be taken out
  /// @param next   memory for the queue
  Decimator(Remains& remains, const std::vector<char>& inner, std::vector<int>& next)
      : remains_(remains),
        inner_(inner),
        edges_(remains.surface, remains.given.vertices, {.least_cos_of_turn = 0.5, .least_slenderness = 0.05}),
        queue_(next, nothing(remains)) {}

  /// @param begin, end  vertices of this part, of which only the inner ones are taken out
  /// @param check  called now and then
  void run(const int* begin, const int* end, const std::function<void()>& check);

private:
  /// A tenth of what it costs to move the triangles that belong to a vertex by the error.
  static float nothing(const Remains& remains) {
    return static_cast<float>(0.1 * remains.error2 * remains.area_mm2 / static_cast<double>(remains.given.vertices.size()));
  }
  void find_costs();
  void visit(int v);
  bool try_collapse(std::size_t n);
  bool place(int vertex);
  bool edges_are_near();
  bool is_near_given(const Vector3d& p, int vertex) const;

  Remains& remains_;
  const std::vector<char>& inner_;
  EdgeCollapse edges_;
  CostQueue queue_;
  std::vector<float> costs_;
  std::vector<Patch> patches_;
  struct Placed {
    int vertex;
    std::size_t patch;
  };
  std::vector<Placed> placed_;
  struct Nearest {
    double distance2;
    int vertex;
  };
  std::vector<Vector3d> middles_;
  std::vector<Nearest> nearest_;
};

void Decimator::run(const int* begin, const int* end, const std::function<void()>& check) {
  constexpr int kBetweenChecks = 4096;
  for (const int* v = begin; v != end; ++v)
    if (inner_[*v] && !remains_.waits[*v]) queue_.push(*v, 0);
  for (int n = 0, v = queue_.pop(); v >= 0; ++n, v = queue_.pop()) {
    if (n % kBetweenChecks == 0) check();
    if (!remains_.surface.removed(v)) visit(v);
  }
}

/// theory.md (81)
void Decimator::find_costs() {
  constexpr double kHopeless = 4;  // times the error, as the root of a mean over the triangles around
  constexpr double kShortFirst = 0.1;
  constexpr int kShares[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};
  std::array<double, 6> quadric{};
  double area2 = 0;
  for (const Vector3d& normal : edges_.normals()) {
    const double length = normal.norm();
    if (!(length > 0)) continue;
    area2 += length;
    const double scale = 1 / length;
    for (std::size_t n = 0; n < 6; ++n) quadric[n] += scale * normal[kShares[n][0]] * normal[kShares[n][1]];
  }
  const double most = kHopeless * kHopeless * remains_.error2 * area2;
  for (std::size_t n = 0; n < 3; ++n) quadric[n] += kShortFirst * kShortFirst * remains_.error2;
  for (std::size_t n = 3; n < 6; ++n) quadric[n] *= 2;
  costs_.clear();
  for (const Vector3d& spoke : edges_.spokes()) {
    double cost = 0;
    for (std::size_t n = 0; n < 6; ++n) cost += quadric[n] * spoke[kShares[n][0]] * spoke[kShares[n][1]];
    cost = std::max(0.0, cost);
    costs_.push_back(cost <= most ? static_cast<float>(cost) : kNever);
  }
}

void Decimator::visit(int v) {
  edges_.look_at(v);
  find_costs();
  for (float& cost : costs_)
    if (cost <= remains_.tried[v]) cost = kNever;
  for (;;) {
    const auto cheapest = std::min_element(costs_.begin(), costs_.end());
    if (*cheapest == kNever) {
      remains_.waits[v] = 1;
      return;
    }
    if (!queue_.due(*cheapest)) return queue_.push(v, *cheapest);
    if (try_collapse(static_cast<std::size_t>(cheapest - costs_.begin()))) return;
    remains_.tried[v] = *cheapest;
    *cheapest = kNever;
  }
}

bool Decimator::try_collapse(std::size_t n) {
  if (!edges_.prepare(n)) return false;
  placed_.clear();
  patches_.clear();
  for (const Facet& facet : edges_.facets()) patches_.emplace_back(facet);
  if (!place(edges_.vertex())) return false;
  for (const int h : edges_.half_edges())
    for (int v = remains_.first_gone[h / 3]; v >= 0; v = remains_.next_gone[v])
      if (!place(v)) return false;
  if (!edges_are_near()) return false;
  for (const int h : edges_.half_edges()) remains_.first_gone[h / 3] = -1;
  for (const Placed& placed : placed_) {
    int& first = remains_.first_gone[edges_.facet_numbers()[placed.patch]];
    remains_.next_gone[placed.vertex] = std::exchange(first, placed.vertex);
  }
  edges_.collapse();
  for (const int neighbour : edges_.neighbours()) {
    remains_.tried[neighbour] = -1;
    if (!remains_.waits[neighbour]) continue;
    remains_.waits[neighbour] = 0;
    if (inner_[neighbour]) queue_.push(neighbour, 0);
  }
  return true;
}

bool Decimator::place(int vertex) {
  placed_.push_back({vertex, first_within(patches_, remains_.given.vertices[vertex], remains_.limit2[vertex])});
  return placed_.back().patch < patches_.size();
}

/// Whether the middles of the edges between the new triangles are near to the given surface: to one of its triangles at the vertex
/// nearest to them of those that are gone into these two.
bool Decimator::edges_are_near() {
  const std::size_t count = patches_.size() - 1;
  middles_.clear();
  nearest_.clear();
  for (std::size_t k = 0; k < count; ++k) {
    const Facet& facet = edges_.facets()[k];
    middles_.push_back(facet.corner + 0.5 * facet.other_side);
    nearest_.push_back({0.25 * facet.other_side.squaredNorm(), edges_.facet_end(k)});
  }
  const auto look_at = [this](std::size_t k, int vertex) {
    const double distance2 = (remains_.given.vertices[vertex] - middles_[k]).squaredNorm();
    if (distance2 < nearest_[k].distance2) nearest_[k] = {distance2, vertex};
  };
  for (const Placed& placed : placed_) {
    if (placed.patch > 0) look_at(placed.patch - 1, placed.vertex);
    if (placed.patch < count) look_at(placed.patch, placed.vertex);
  }
  for (std::size_t k = 0; k < count; ++k)
    if (!is_near_given(middles_[k], nearest_[k].vertex)) return false;
  return true;
}

/// Whether p is above or below a triangle, no farther than the root of a limit: as Patch, for one point.
bool is_over(const Facet& facet, const Vector3d& p, double limit2) {
  const Vector3d q = p - facet.corner;
  const double area2 = facet.normal.squaredNorm();
  const double height = facet.normal.dot(q);
  if (!(height * height <= limit2 * area2 && area2 > 0)) return false;
  const double s = facet.normal.dot(q.cross(facet.other_side));
  if (s < 0) return false;
  const double t = facet.normal.dot(facet.side.cross(q));
  return t >= 0 && s + t <= area2;
}

/// Whether p is near to one of the given triangles at a vertex.
bool Decimator::is_near_given(const Vector3d& p, int vertex) const {
  const auto any = [&](const auto& holds) {
    return std::any_of(&remains_.at.corners[remains_.at.first[vertex]], &remains_.at.corners[remains_.at.first[vertex + 1]],
                       [&](int corner) {
                         const auto t = static_cast<std::size_t>(corner / 3);
                         return holds(Facet(remains_.given.corner(t, 0), remains_.given.corner(t, 1), remains_.given.corner(t, 2)));
                       });
  };
  const double limit2 = remains_.limit2[vertex];
  return any([&](const Facet& facet) { return is_over(facet, p, limit2); }) ||
         any([&](const Facet& facet) { return squared_distance_to_sides(facet, p) <= limit2; });
}

/// The vertices of a mesh in cubes of a grid.
class Parts {
public:
  /// All in one.
  explicit Parts(const Mesh& mesh) : of_(mesh.vertices.size(), 0) { sort(1); }

  /// With so many vertices on average, on a grid that begins so many of its steps before the mesh.
  /// @param area_mm2  of the mesh
  Parts(const Mesh& mesh, double area_mm2, double vertices, double shift) : of_(mesh.vertices.size()) {
    constexpr double kMost = 64;  // along a side
    const Eigen::AlignedBox3d box = bounding_box(mesh);
    const double step = std::max({std::sqrt(area_mm2 * vertices / static_cast<double>(of_.size())), box.sizes().maxCoeff() / kMost,
                                  std::numeric_limits<double>::min()});
    const auto cell = [&](const Vector3d& p) -> Eigen::Vector3i {
      return ((p - box.min()) / step + Vector3d::Constant(shift)).array().floor().cast<int>();
    };
    const Eigen::Vector3i cells = cell(box.max()) + Eigen::Vector3i::Ones();
    for (std::size_t v = 0; v < of_.size(); ++v) {
      const Eigen::Vector3i at = cell(mesh.vertices[v]);
      of_[v] = at.x() + cells.x() * (at.y() + cells.y() * at.z());
    }
    sort(cells.prod());
  }

  std::size_t count() const { return first_.size() - 1; }
  int of(int vertex) const { return of_[vertex]; }
  const int* begin(std::size_t part) const { return vertices_.data() + first_[part]; }
  const int* end(std::size_t part) const { return vertices_.data() + first_[part + 1]; }

private:
  void sort(int parts) {
    first_.assign(static_cast<std::size_t>(parts) + 1, 0);
    for (const int part : of_) ++first_[part + 1];
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    vertices_.resize(of_.size());
    std::vector<int> next(first_.begin(), first_.end() - 1);
    for (std::size_t v = 0; v < of_.size(); ++v) vertices_[next[of_[v]]++] = static_cast<int>(v);
  }

  std::vector<int> of_;
  std::vector<int> first_, vertices_;  ///< part after part, ascending in each
};

/// For each vertex that is left whether it and all of its neighbours are in one part, and it may be taken out.
std::vector<char> inner_vertices(const HalfEdges& surface, const Parts& parts) {
  std::vector<char> inner(static_cast<std::size_t>(surface.vertices()));
  for (int v = 0; v < surface.vertices(); ++v) inner[v] = surface.regular(v) && !surface.removed(v);
  for (int h = 0; h < surface.size(); ++h)
    if (surface.from(h) >= 0 && parts.of(surface.from(h)) != parts.of(surface.to(h)))
      inner[surface.from(h)] = inner[surface.to(h)] = 0;
  return inner;
}

/// Takes the inner vertices of all parts out, of many at once. What comes of it does not depend on how many: none changes what
/// another one looks at.
void decimate(Remains& remains, const Parts& parts, const Progress& progress) {
  constexpr std::size_t kAtOnce = 32;
  const std::vector<char> inner = inner_vertices(remains.surface, parts);
  std::vector<int> next(remains.given.vertices.size());
  const auto run = [&](std::size_t part, const std::function<void()>& check) {
    if (parts.begin(part) != parts.end(part)) Decimator(remains, inner, next).run(parts.begin(part), parts.end(part), check);
  };
  if (parts.count() == 1) return run(0, [&] { progress.check(); });
  for (std::size_t first = 0; first < parts.count(); first += kAtOnce) {
    progress.check();
    tbb::parallel_for(first, std::min(first + kAtOnce, parts.count()), [&](std::size_t part) { run(part, [] {}); });
  }
}

/// First in parts, then in others across whose seams the first went, then what is left.
void decimate(Remains& remains, const Progress& progress) {
  constexpr double kVertices = 4096;  // in a part: as much as fits into a processor's cache
  if (static_cast<double>(remains.given.vertices.size()) > 4 * kVertices)
    for (const double shift : {0.25, 0.75}) decimate(remains, Parts(remains.given, remains.area_mm2, kVertices, shift), progress);
  decimate(remains, Parts(remains.given), progress);
}

DecimatedMesh Remains::result() const {
  DecimatedMesh result;
  result.mesh = surface.remaining(given.vertices, result.kept);
  return result;
}

std::vector<int> Remains::vertices_around(const DecimatedMesh& result, std::vector<int> chosen, int rings) const {
  std::vector<char> marked(result.mesh.vertices.size());
  for (int ring = 0; ring <= rings; ++ring) {
    for (const int t : chosen)
      for (const int v : result.mesh.triangles[t]) marked[v] = 1;
    chosen.clear();
    for (std::size_t t = 0; t < result.mesh.triangles.size(); ++t) {
      const Eigen::Vector3i& v = result.mesh.triangles[t];
      if (marked[v[0]] | marked[v[1]] | marked[v[2]]) chosen.push_back(static_cast<int>(t));
    }
  }
  std::vector<int> around;
  for (std::size_t v = 0; v < marked.size(); ++v)
    if (marked[v]) around.push_back(result.kept[v]);
  const std::vector<int> numbers = surface.remaining_triangles();
  for (const int t : chosen)
    for (int v = first_gone[numbers[t]]; v >= 0; v = next_gone[v]) around.push_back(v);
  return around;
}

/// Pairs of triangles that cross as delivered, and triangles that have no area then, each with itself.
TrianglePairs spoilt_pairs(const Mesh& mesh, const DecimateOptions& options, const Progress& progress) {
  const Mesh delivered = options.as_delivered ? options.as_delivered(mesh) : as_float32(mesh);
  TrianglePairs spoilt = crossing_pairs(delivered, close_pairs(delivered, progress));
  for (std::size_t t = 0; t < delivered.triangles.size(); ++t)
    if (collinear(delivered.corner(t, 0), delivered.corner(t, 1), delivered.corner(t, 2)))
      spoilt.emplace_back(static_cast<int>(t), static_cast<int>(t));
  return spoilt;
}

}  // namespace

DecimatedMesh decimated(const Mesh& mesh, const DecimateOptions& options, const Progress& progress) {
  constexpr int kRounds = 12;
  constexpr std::size_t kFew = 64;  // cost few triangles if nothing goes on there
  const VertexCorners at(mesh);
  ChordErrors errors(mesh.vertices.size(), options.chord_error_mm);
  std::vector<char> spoilt_before;  // for each vertex
  for (int round = 0; round < kRounds; ++round) {
    Remains remains(mesh, at, options.chord_error_mm, errors.squared());
    decimate(remains, progress);
    DecimatedMesh result = remains.result();
    TrianglePairs spoilt = spoilt_pairs(result.mesh, options, progress);
    result.crossing = triangles_of(spoilt).size();
    if (spoilt.empty()) return result;
    if (spoilt_before.empty()) {
      spoilt_before.assign(mesh.vertices.size(), 0);
      for (const std::size_t t : triangles_of(spoilt_pairs(mesh, options, progress)))
        for (const int v : mesh.triangles[t]) {
          errors.forbid(v);
          spoilt_before[v] = 1;
        }
    }
    // What crosses triangles that did so before would cross them with any error.
    const auto was_spoilt = [&](int t) {
      const Eigen::Vector3i& corners = result.mesh.triangles[t];
      return std::any_of(corners.begin(), corners.end(), [&](int v) { return spoilt_before[result.kept[v]] != 0; });
    };
    std::erase_if(spoilt, [&](const auto& pair) { return was_spoilt(pair.first) || was_spoilt(pair.second); });
    if (spoilt.empty()) return result;
    const std::vector<std::size_t> triangles = triangles_of(spoilt);
    const bool few = triangles.size() <= kFew;
    for (const int v : remains.vertices_around(result, {triangles.begin(), triangles.end()}, round))
      few ? errors.forbid(v) : errors.lower(v);
  }
  DecimatedMesh as_given = Remains(mesh, at, 0, errors.squared()).result();
  as_given.crossing = triangles_of(spoilt_pairs(as_given.mesh, options, progress)).size();
  return as_given;
}

}  // namespace rayrep
