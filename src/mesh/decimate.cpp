#include "mesh/decimate.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include "mesh/crossing.h"
#include "mesh/edge_collapse.h"
#include "mesh/mesh_edges.h"
#include "mesh/predicates.h"

namespace rayrep {
namespace {

using Eigen::Vector3d;

/// A triangle, for the distances of many points.
class Patch {
public:
  explicit Patch(const Facet& facet)
      : facet_(facet),
        area2_(facet.normal.squaredNorm()),
        along_side_(facet.other_side.cross(facet.normal)),
        along_other_(facet.normal.cross(facet.side)) {}

  /// Squared height of p over it; infinite where p is not above or below it.
  double squared_height(const Vector3d& p) const {
    const Vector3d q = p - facet_.corner;
    const double s = along_side_.dot(q);
    const double t = along_other_.dot(q);
    if (!(s >= 0 && t >= 0 && s + t <= area2_ && area2_ > 0)) return std::numeric_limits<double>::infinity();
    const double height = facet_.normal.dot(q);
    return height * height / area2_;
  }

  double squared_distance_to_sides(const Vector3d& p) const {
    const Vector3d q = p - facet_.corner;
    return std::min(
        {to_side2(q, facet_.side), to_side2(q, facet_.other_side), to_side2(q - facet_.side, facet_.other_side - facet_.side)});
  }

private:
  static double to_side2(const Vector3d& q, const Vector3d& side) {
    const double length2 = side.squaredNorm();
    const double share = length2 > 0 ? std::clamp(q.dot(side) / length2, 0.0, 1.0) : 0;
    return (q - share * side).squaredNorm();
  }

  const Facet facet_;
  const double area2_;
  const Vector3d along_side_, along_other_;
};

/// The first of these from which p is no farther than the root of a limit; their number if there is none.
std::size_t first_within(const std::vector<Patch>& patches, const Vector3d& p, double limit2) {
  for (std::size_t k = 0; k < patches.size(); ++k)
    if (patches[k].squared_height(p) <= limit2) return k;
  for (std::size_t k = 0; k < patches.size(); ++k)
    if (patches[k].squared_distance_to_sides(p) <= limit2) return k;
  return patches.size();
}

/// Vertices by what their cheapest collapse costs, to a factor of two; those of like cost in the order in which they came.
class CostQueue {
public:
  explicit CostQueue(std::size_t vertices) : next_(vertices, -1), first_(kBuckets, -1), last_(kBuckets, -1) {}

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

  int at_ = 0;
  std::vector<int> next_;
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

class Decimator {
public:
  Decimator(const Mesh& given, const VertexCorners& at, double error_mm)
      : given_(given),
        at_(at),
        error2_(error_mm * error_mm),
        edges_(given, at, {.least_cos_of_turn = 0.5, .least_slenderness = 0.05}),
        queue_(given.vertices.size()),
        tried_(given.vertices.size(), -1),
        waits_(given.vertices.size(), 0),
        first_gone_(given.triangles.size(), -1),
        next_gone_(given.vertices.size(), -1) {}

  /// @param limit2  for each vertex how far it may lie from what comes of it, squared
  void run(const std::vector<double>& limit2, const Progress& progress) {
    constexpr int kBetweenChecks = 4096;
    limit2_ = limit2.data();
    const HalfEdges& surface = edges_.surface();
    for (int v = 0; v < surface.vertices(); ++v)
      if (surface.regular(v)) queue_.push(v, 0);
    for (int n = 0, v = queue_.pop(); v >= 0; ++n, v = queue_.pop()) {
      if (n % kBetweenChecks == 0) progress.check();
      if (!surface.removed(v)) visit(v);
    }
  }

  DecimatedMesh result() const;

  /// The vertices that are corners of, or went into, the `chosen` triangles of the result and those in so many rings around them.
  std::vector<int> vertices_around(const DecimatedMesh& result, std::vector<int> chosen, int rings) const;

private:
  void find_costs();
  void visit(int v);
  bool try_collapse(std::size_t n);
  bool place(int vertex);
  bool edges_are_near();
  bool is_near_given(const Vector3d& p, int vertex) const;

  const Mesh& given_;
  const VertexCorners& at_;
  double error2_;
  const double* limit2_ = nullptr;
  EdgeCollapse edges_;
  CostQueue queue_;
  std::vector<float> tried_;  ///< of each vertex: what its collapses cost that were tried in vain with all around it as it is
  std::vector<char> waits_;   ///< for that to change
  std::vector<int> first_gone_, next_gone_;  ///< of each triangle the vertices that went into it, as a list
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

/// theory.md (81)
void Decimator::find_costs() {
  constexpr double kHopeless = 4;  // times the error, as the root of a mean over the triangles around
  constexpr double kShortFirst = 0.1;
  Eigen::Matrix3d quadric = Eigen::Matrix3d::Zero();
  double area2 = 0;
  for (const Vector3d& normal : edges_.normals()) {
    const double length = normal.norm();
    if (length > 0) quadric += normal * (normal / length).transpose();
    area2 += length;
  }
  const double most = kHopeless * kHopeless * error2_ * area2;
  quadric.diagonal().array() += kShortFirst * kShortFirst * error2_;
  costs_.clear();
  for (const Vector3d& spoke : edges_.spokes()) {
    const double cost = std::max(0.0, spoke.dot(quadric * spoke));
    costs_.push_back(cost <= most ? static_cast<float>(cost) : kNever);
  }
}

void Decimator::visit(int v) {
  edges_.look_at(v);
  find_costs();
  for (float& cost : costs_)
    if (cost <= tried_[v]) cost = kNever;
  for (;;) {
    const auto cheapest = std::min_element(costs_.begin(), costs_.end());
    if (*cheapest == kNever) {
      waits_[v] = 1;
      return;
    }
    if (!queue_.due(*cheapest)) return queue_.push(v, *cheapest);
    if (try_collapse(static_cast<std::size_t>(cheapest - costs_.begin()))) return;
    tried_[v] = *cheapest;
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
    for (int v = first_gone_[h / 3]; v >= 0; v = next_gone_[v])
      if (!place(v)) return false;
  if (!edges_are_near()) return false;
  for (const int h : edges_.half_edges()) first_gone_[h / 3] = -1;
  for (const Placed& placed : placed_) {
    int& first = first_gone_[edges_.facet_numbers()[placed.patch]];
    next_gone_[placed.vertex] = std::exchange(first, placed.vertex);
  }
  edges_.collapse();
  for (const int neighbour : edges_.neighbours()) {
    tried_[neighbour] = -1;
    if (!waits_[neighbour]) continue;
    waits_[neighbour] = 0;
    queue_.push(neighbour, 0);
  }
  return true;
}

bool Decimator::place(int vertex) {
  placed_.push_back({vertex, first_within(patches_, given_.vertices[vertex], limit2_[vertex])});
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
    const double distance2 = (given_.vertices[vertex] - middles_[k]).squaredNorm();
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

/// Whether p is near to one of the given triangles at a vertex.
bool Decimator::is_near_given(const Vector3d& p, int vertex) const {
  const auto any = [&](const auto& holds) {
    return std::any_of(&at_.corners[at_.first[vertex]], &at_.corners[at_.first[vertex + 1]], [&](int corner) {
      const auto t = static_cast<std::size_t>(corner / 3);
      return holds(Patch(Facet(given_.corner(t, 0), given_.corner(t, 1), given_.corner(t, 2))));
    });
  };
  const double limit2 = limit2_[vertex];
  return any([&](const Patch& patch) { return patch.squared_height(p) <= limit2; }) ||
         any([&](const Patch& patch) { return patch.squared_distance_to_sides(p) <= limit2; });
}

DecimatedMesh Decimator::result() const {
  DecimatedMesh result;
  result.mesh = edges_.remaining(result.kept);
  for (const int t : edges_.surface().remaining_triangles()) {
    const auto n = result.in_front_mm.size();
    const Facet facet(result.mesh.corner(n, 0), result.mesh.corner(n, 1), result.mesh.corner(n, 2));
    const double length = facet.normal.norm();
    double highest = 0;
    double lowest = 0;
    for (int v = first_gone_[t]; v >= 0 && length > 0; v = next_gone_[v]) {
      const double height = facet.normal.dot(given_.vertices[v] - facet.corner) / length;
      highest = std::max(highest, height);
      lowest = std::min(lowest, height);
    }
    result.in_front_mm.push_back(highest);
    result.behind_mm.push_back(-lowest);
  }
  return result;
}

std::vector<int> Decimator::vertices_around(const DecimatedMesh& result, std::vector<int> chosen, int rings) const {
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
  const std::vector<int> numbers = edges_.surface().remaining_triangles();
  for (const int t : chosen)
    for (int v = first_gone_[numbers[t]]; v >= 0; v = next_gone_[v]) around.push_back(v);
  return around;
}

Mesh rounded(Mesh mesh) {
  for (Vector3d& v : mesh.vertices) v = v.cast<float>().cast<double>();
  return mesh;
}

/// Triangles that cross others as delivered, or have no area then.
std::vector<int> spoilt_triangles(const Mesh& mesh, const DecimateOptions& options, const Progress& progress) {
  const Mesh delivered = options.as_delivered ? options.as_delivered(mesh) : rounded(mesh);
  std::vector<int> spoilt;
  for (const auto& [s, t] : crossing_pairs(delivered, close_pairs(delivered, progress))) spoilt.insert(spoilt.end(), {s, t});
  for (std::size_t t = 0; t < delivered.triangles.size(); ++t)
    if (collinear(delivered.corner(t, 0), delivered.corner(t, 1), delivered.corner(t, 2))) spoilt.push_back(static_cast<int>(t));
  std::sort(spoilt.begin(), spoilt.end());
  spoilt.erase(std::unique(spoilt.begin(), spoilt.end()), spoilt.end());
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
    Decimator decimator(mesh, at, options.chord_error_mm);
    decimator.run(errors.squared(), progress);
    DecimatedMesh result = decimator.result();
    std::vector<int> spoilt = spoilt_triangles(result.mesh, options, progress);
    result.crossing = spoilt.size();
    if (spoilt.empty()) return result;
    if (spoilt_before.empty()) {
      spoilt_before.assign(mesh.vertices.size(), 0);
      for (const int t : spoilt_triangles(mesh, options, progress))
        for (const int v : mesh.triangles[t]) {
          errors.forbid(v);
          spoilt_before[v] = 1;
        }
    }
    std::erase_if(spoilt, [&](int t) {
      const Eigen::Vector3i& corners = result.mesh.triangles[t];
      return std::any_of(corners.begin(), corners.end(), [&](int v) { return spoilt_before[result.kept[v]] != 0; });
    });
    if (spoilt.empty()) return result;
    const bool few = spoilt.size() <= kFew;
    for (const int v : decimator.vertices_around(result, spoilt, round)) few ? errors.forbid(v) : errors.lower(v);
  }
  DecimatedMesh as_given = Decimator(mesh, at, 0).result();
  as_given.crossing = spoilt_triangles(as_given.mesh, options, progress).size();
  return as_given;
}

}  // namespace rayrep
