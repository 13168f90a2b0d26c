#include "make/cut_search.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>
#include <string>

#include "mesh/prism.h"
#include "mesh/shells.h"
#include "mesh/surface_gap.h"
#include "rayrep/base/error.h"
#include "rayrep/mesh/assembly.h"
#include "rayrep/mesh/surface_query.h"

namespace rayrep::detail {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::size_t kMostCavities = 64;
constexpr int kOffsets = 48;  // along each normal

using Opened = std::uint64_t;  // a bit for each cavity

/// A plane that is looked at.
struct Candidate {
  Cut::Plane plane;
  Opened opens = 0;
  double cost = kInfinity;  ///< theory.md (106), but for pins and pieces
};

/// A mesh whose shells are told apart.
struct Shelled {
  const Mesh& mesh;
  std::vector<int> cavity;  ///< of each triangle, -1: outer surface
  std::vector<double> volumes_mm3;
  std::vector<Eigen::Vector3d> middles;  ///< of each cavity
  double outer_area_mm2 = 0;
  double area_mm2 = 0;

  explicit Shelled(const Mesh& closed) : mesh(closed), cavity(closed.triangles.size(), -1) {
    const Components shells = connected_components(mesh);
    const std::vector<double> volumes = shell_volumes(mesh, shells.of_triangle, shells.count);
    std::vector<int> number(volumes.size(), -1);
    for (std::size_t s = 0; s < volumes.size(); ++s)
      if (volumes[s] < 0) {
        number[s] = static_cast<int>(volumes_mm3.size());
        volumes_mm3.push_back(-volumes[s]);
      }
    middles.assign(volumes_mm3.size(), Eigen::Vector3d::Zero());
    std::vector<double> areas(volumes_mm3.size(), 0);
    for (std::size_t t = 0; t < cavity.size(); ++t) {
      cavity[t] = number[static_cast<std::size_t>(shells.of_triangle[t])];
      const double area = 0.5 * (mesh.corner(t, 1) - mesh.corner(t, 0)).cross(mesh.corner(t, 2) - mesh.corner(t, 0)).norm();
      area_mm2 += area;
      if (cavity[t] < 0) {
        outer_area_mm2 += area;
        continue;
      }
      const auto c = static_cast<std::size_t>(cavity[t]);
      middles[c] += area / 3 * (mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2));
      areas[c] += area;
    }
    for (std::size_t c = 0; c < middles.size(); ++c) middles[c] /= areas[c];
  }

  Opened all() const { return volumes_mm3.size() == kMostCavities ? ~Opened{0} : (Opened{1} << volumes_mm3.size()) - 1; }
};

/// What all planes across one direction come to, found in one run over the triangles.
class Sweep {
public:
  Sweep(const Shelled& body, const Eigen::Vector3d& normal) : body_(body), normal_(normal) {
    lo_ = kInfinity;
    double hi = -kInfinity;
    for (const Eigen::Vector3d& v : body.mesh.vertices) {
      lo_ = std::min(lo_, normal.dot(v));
      hi = std::max(hi, normal.dot(v));
    }
    step_ = (hi - lo_) / kOffsets;
    opened_.assign(body.volumes_mm3.size(), {});
    for (std::size_t t = 0; t < body.mesh.triangles.size(); ++t) add(t);
    for (int j = kOffsets - 2; j >= 0; --j) falls_[at(j)] += falls_[at(j + 1)];
    for (int j = 1; j < kOffsets; ++j) rises_[at(j)] += rises_[at(j - 1)];
  }

  void append(std::vector<Candidate>& all) const {
    std::vector<double> widest(opened_.size(), 0);
    for (std::size_t c = 0; c < opened_.size(); ++c)
      for (const double area : opened_[c]) widest[c] = std::max(widest[c], std::abs(area));
    for (int j = 0; j < kOffsets; ++j) {
      Candidate candidate{{normal_, offset(j)}};
      double least = 1;
      for (std::size_t c = 0; c < opened_.size(); ++c) {
        const double area = std::abs(opened_[c][at(j)]);
        if (area < kLeastShare * std::pow(body_.volumes_mm3[c], 2.0 / 3)) continue;
        candidate.opens |= Opened{1} << c;
        least = std::min(least, area / widest[c]);
      }
      if (seam_[at(j)] == 0 || (candidate.opens == 0 && !opened_.empty())) continue;
      candidate.cost =
          (falls_[at(j)] + rises_[at(j)]) / body_.area_mm2 + 0.05 * seam_[at(j)] / std::sqrt(body_.outer_area_mm2) - 0.15 * least;
      all.push_back(candidate);
    }
  }

private:
  /// Of the volume to the power of 2/3: a smaller opening opens nothing.
  static constexpr double kLeastShare = 0.1;

  static std::size_t at(int j) { return static_cast<std::size_t>(j); }
  double offset(int j) const { return lo_ + (j + 0.5) * step_; }

  void add(std::size_t t) {
    std::array<Eigen::Vector3d, 3> p;
    std::array<double, 3> h{};
    for (int k = 0; k < 3; ++k) {
      p[at(k)] = body_.mesh.corner(t, k);
      h[at(k)] = normal_.dot(p[at(k)]);
    }
    const Eigen::Vector3d twice = (p[1] - p[0]).cross(p[2] - p[0]);
    const double facing = normal_.dot(twice);
    constexpr double kSteep = std::numbers::sqrt2 / 2;
    if (std::abs(facing) > kSteep * twice.norm()) {
      // What faces down overhangs in the upper half, for all planes below it; what faces up in the lower one.
      const double place = ((h[0] + h[1] + h[2]) / 3 - lo_) / step_ - 0.5;
      const int below = std::clamp(static_cast<int>(std::floor(place)), -1, kOffsets - 1);
      if (facing < 0 && below >= 0) falls_[at(below)] += 0.5 * twice.norm();
      if (facing > 0 && below + 1 < kOffsets) rises_[at(below + 1)] += 0.5 * twice.norm();
    }
    const double lowest = std::min({h[0], h[1], h[2]});
    const double highest = std::max({h[0], h[1], h[2]});
    const int last = static_cast<int>(std::ceil((highest - lo_) / step_));
    for (int j = std::max(0, static_cast<int>((lowest - lo_) / step_) - 1); j < std::min(kOffsets, last + 1); ++j)
      if (lowest < offset(j) && offset(j) <= highest) cross(t, p, h, j);
  }

  void cross(std::size_t t, const std::array<Eigen::Vector3d, 3>& p, const std::array<double, 3>& h, int j) {
    const double d = offset(j);
    std::array<Eigen::Vector3d, 2> ends;  // where it goes down through the plane, and where up again
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t n = (k + 1) % 3;
      if ((h[k] >= d) != (h[n] >= d)) ends[h[k] >= d ? 0 : 1] = p[k] + (d - h[k]) / (h[n] - h[k]) * (p[n] - p[k]);
    }
    if (body_.cavity[t] < 0)
      seam_[at(j)] += (ends[1] - ends[0]).norm();
    else
      opened_[at(body_.cavity[t])][at(j)] += 0.5 * normal_.dot(ends[0].cross(ends[1]));
  }

  const Shelled& body_;
  Eigen::Vector3d normal_;
  double lo_ = 0;
  double step_ = 1;
  std::array<double, kOffsets> falls_{}, rises_{}, seam_{};  ///< areas that overhang, lengths
  std::vector<std::array<double, kOffsets>> opened_;         ///< areas of each cavity
};

/// Directions all over a half sphere, then those that are natural, then across planes through the middles of three cavities.
std::vector<Eigen::Vector3d> directions(const Shelled& body, const CutWishes& wishes) {
  std::vector<Eigen::Vector3d> all;
  for (const Eigen::Vector3d& d : wishes.directions) all.push_back(d.normalized());
  constexpr int kAround = 48;
  for (int k = 0; k < kAround; ++k) {
    const double z = (k + 0.5) / kAround;
    const double angle = 2 * std::numbers::pi * std::numbers::phi * k;
    const double r = std::sqrt(1 - z * z);
    all.emplace_back(r * std::cos(angle), r * std::sin(angle), z);
  }
  constexpr std::size_t kMostInTriples = 8;
  const std::size_t n = std::min(body.middles.size(), kMostInTriples);
  for (std::size_t a = 0; a < n; ++a)
    for (std::size_t b = a + 1; b < n; ++b)
      for (std::size_t c = b + 1; c < n; ++c) {
        const Eigen::Vector3d across = (body.middles[b] - body.middles[a]).cross(body.middles[c] - body.middles[a]);
        if (across.norm() > 0) all.push_back(across.normalized());
      }
  if (n == 2)
    for (int k = 0; k < 12; ++k) {
      const Eigen::Vector3d along = (body.middles[1] - body.middles[0]).normalized();
      all.push_back(Eigen::AngleAxisd(std::numbers::pi * k / 12, along) * along.unitOrthogonal());
    }
  return all;
}

std::vector<Candidate> candidates(const Shelled& body, const CutWishes& wishes, const Progress& progress) {
  const std::vector<Eigen::Vector3d> normals = directions(body, wishes);
  std::vector<std::vector<Candidate>> found(normals.size());
  progress.check();
  tbb::parallel_for(std::size_t{0}, normals.size(), [&](std::size_t n) {
    Sweep(body, normals[n]).append(found[n]);
    // Planes that are natural to the body are easier to see and to describe.
    if (n < wishes.directions.size())
      for (Candidate& candidate : found[n]) candidate.cost -= 0.02;
  });
  progress.check();
  std::vector<Candidate> all;
  for (const auto& some : found) all.insert(all.end(), some.begin(), some.end());
  std::stable_sort(all.begin(), all.end(), [](const Candidate& a, const Candidate& b) { return a.cost < b.cost; });
  return all;
}

/// Pieces of the two halves, but for what lies in a cavity.
int pieces(const Halves& cut) {
  int count = 0;
  for (const Mesh* half : {&cut.above, &cut.below}) {
    const Components parts = connected_components(*half);
    for (const double volume : shell_volumes(*half, parts.of_triangle, parts.count)) count += volume > 0;
  }
  return count;
}

/// The best of the planes that open everything, pins and pieces counted.
std::optional<Cut::Plane> best_alone(const Shelled& body, const std::vector<Candidate>& all, const CutWishes& wishes,
                                     const Progress& progress) {
  constexpr int kLookedAt = 12;
  std::optional<Candidate> best;
  std::vector<Eigen::Vector3d> seen;
  int looked_at = 0;
  for (const Candidate& candidate : all) {
    if (candidate.opens != body.all()) continue;
    // Of one direction the best: its neighbours have the same room.
    if (std::find(seen.begin(), seen.end(), candidate.plane.normal) != seen.end()) continue;
    if (++looked_at > kLookedAt) break;
    seen.push_back(candidate.plane.normal);
    Candidate looked = candidate;
    looked.plane = clear_of_vertices(body.mesh, candidate.plane);
    const std::size_t pins = pin_places(body.mesh, {looked.plane}, 0, wishes.hole, progress).size();
    const Halves cut = halves(body.mesh, {looked.plane.normal, looked.plane.offset_mm}, progress);
    looked.cost += pins == 0 ? 0.1 : pins == 1 ? 0.05 : 0;
    looked.cost += 0.05 * (pieces(cut) - 2);
    if (!best || looked.cost < best->cost) best = looked;
  }
  if (!best) return std::nullopt;
  return best->plane;
}

/// The cheapest two that open everything.
std::vector<Cut::Plane> best_pair(const Shelled& body, const std::vector<Candidate>& all) {
  double least = kInfinity;
  std::vector<Cut::Plane> best;
  for (std::size_t a = 0; a < all.size() && 2 * all[a].cost < least; ++a)
    for (std::size_t b = a + 1; b < all.size() && all[a].cost + all[b].cost < least; ++b)
      if ((all[a].opens | all[b].opens) == body.all()) {
        least = all[a].cost + all[b].cost;
        best = {all[a].plane, all[b].plane};
      }
  return best;
}

/// One after the other, that which opens most of what is left.
std::vector<Cut::Plane> one_by_one(const Shelled& body, const std::vector<Candidate>& all) {
  std::vector<Cut::Plane> planes;
  Opened left = body.all();
  while (left != 0) {
    const Candidate* best = nullptr;
    for (const Candidate& candidate : all)
      if (!best || std::popcount(candidate.opens & left) > std::popcount(best->opens & left)) best = &candidate;
    if (!best || (best->opens & left) == 0) return {};
    planes.push_back(best->plane);
    left &= ~best->opens;
  }
  return planes;
}

/// Points of the outer surface's crossing with a plane, in axes in it.
struct PlaneAxes {
  Eigen::Vector3d x, y, origin;
  Eigen::AlignedBox2d box;

  PlaneAxes(const Mesh& mesh, const Cut::Plane& plane)
      : x(plane.normal.unitOrthogonal()), y(plane.normal.cross(x)), origin(plane.offset_mm * plane.normal) {
    for (const Eigen::Vector3i& t : mesh.triangles)
      for (int k = 0; k < 3; ++k) {
        const Eigen::Vector3d& a = mesh.vertices[t[k]];
        const Eigen::Vector3d& b = mesh.vertices[t[(k + 1) % 3]];
        const double ha = plane.normal.dot(a) - plane.offset_mm;
        const double hb = plane.normal.dot(b) - plane.offset_mm;
        if ((ha >= 0) == (hb >= 0)) continue;
        const Eigen::Vector3d p = a + ha / (ha - hb) * (b - a);
        box.extend(Eigen::Vector2d(x.dot(p), y.dot(p)));
      }
  }
  Eigen::Vector3d at(const Eigen::Vector2d& p) const { return origin + p.x() * x + p.y() * y; }
};

/// Whether a hole there has its wall all around.
bool has_room(const SurfaceQuery& surface, const Eigen::Vector3d& p, const Eigen::Vector3d& axis, const PinHole& hole) {
  const double needed = hole.radius_mm + hole.wall_mm;
  constexpr int kSteps = 6;
  for (const int k : {0, -kSteps, kSteps, -3, 3, -1, 1, -2, 2, -4, 4, -5, 5})
    if (surface.closest(p + k * hole.depth_mm / kSteps * axis, needed).triangle >= 0) return false;
  return is_inside(surface, p);
}

/// The place farthest from those taken, if it is far enough.
std::optional<Eigen::Vector3d> farthest(const std::vector<Eigen::Vector3d>& places, const std::vector<Eigen::Vector3d>& from,
                                        double least_mm) {
  const Eigen::Vector3d* best = nullptr;
  double farthest_mm = least_mm;
  for (const Eigen::Vector3d& p : places) {
    double nearest = kInfinity;
    for (const Eigen::Vector3d& q : from) nearest = std::min(nearest, (p - q).norm());
    if (nearest <= farthest_mm) continue;
    farthest_mm = nearest;
    best = &p;
  }
  return best ? std::optional(*best) : std::nullopt;
}

bool clear_of_others(const Eigen::Vector3d& p, const std::vector<Cut::Plane>& planes, std::size_t own, const PinHole& hole) {
  const double reach = std::hypot(hole.depth_mm, hole.radius_mm) + hole.wall_mm;
  for (std::size_t n = 0; n < planes.size(); ++n)
    if (n != own && std::abs(planes[n].normal.dot(p) - planes[n].offset_mm) < reach) return false;
  return true;
}

}  // namespace

std::vector<Eigen::Vector3d> pin_places(const Mesh& mesh, const std::vector<Cut::Plane>& planes, std::size_t plane,
                                        const PinHole& hole, const Progress& progress) {
  constexpr int kAcross = 80;  // places that are looked at, along the longer side
  const PlaneAxes axes(mesh, planes[plane]);
  if (axes.box.isEmpty()) return {};
  const SurfaceQuery surface(mesh);
  const double step = std::max(0.25 * hole.radius_mm, axes.box.sizes().maxCoeff() / kAcross);
  const auto nx = static_cast<std::size_t>(axes.box.sizes().x() / step) + 1;
  const auto ny = static_cast<std::size_t>(axes.box.sizes().y() / step) + 1;
  std::vector<char> free(nx * ny, 0);
  const auto place = [&](std::size_t k) {
    return axes.at(axes.box.min() + step * Eigen::Vector2d(static_cast<double>(k % nx), static_cast<double>(k / nx)));
  };
  progress.check();
  tbb::parallel_for(std::size_t{0}, free.size(), [&](std::size_t k) {
    free[k] = clear_of_others(place(k), planes, plane, hole) && has_room(surface, place(k), planes[plane].normal, hole);
  });
  progress.check();
  std::vector<Eigen::Vector3d> places;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < free.size(); ++k)
    if (free[k]) {
      places.push_back(place(k));
      middle += places.back();
    }
  std::vector<Eigen::Vector3d> taken;
  if (places.empty()) return taken;
  middle /= static_cast<double>(places.size());
  const double apart_mm = 4 * hole.radius_mm + hole.wall_mm;
  taken.push_back(farthest(places, {middle}, -1).value());
  for (int n = 1; n < 3; ++n)
    if (const auto next = farthest(places, taken, apart_mm)) taken.push_back(*next);
  return taken;
}

Cut::Plane clear_of_vertices(const Mesh& mesh, Cut::Plane plane) {
  constexpr double kReach_mm = 0.02;
  constexpr int kSteps = 20;
  std::vector<double> near;
  for (const Eigen::Vector3d& v : mesh.vertices)
    if (const double h = plane.normal.dot(v) - plane.offset_mm; std::abs(h) < 2 * kReach_mm) near.push_back(h);
  std::sort(near.begin(), near.end());
  double best = -1;
  double move = 0;
  for (int k = 0; k <= 2 * kSteps; ++k) {
    const double d = (k % 2 == 0 ? 1 : -1) * ((k + 1) / 2) * kReach_mm / kSteps;
    const auto next = std::lower_bound(near.begin(), near.end(), d);
    double clear = kReach_mm;
    if (next != near.end()) clear = std::min(clear, *next - d);
    if (next != near.begin()) clear = std::min(clear, d - *std::prev(next));
    if (clear <= best * (1 + 1e-9)) continue;
    best = clear;
    move = d;
  }
  plane.offset_mm += move;
  return plane;
}

std::vector<Cut::Plane> cut_planes(const Mesh& mesh, const CutWishes& wishes, const Progress& progress) {
  const Shelled body(mesh);
  const std::size_t count = body.volumes_mm3.size();
  if (count > kMostCavities)
    throw Error(ErrorCode::goal, "There are " + std::to_string(count) + " cavities; planes are looked for that open at most " +
                                     std::to_string(kMostCavities) + ". Choose a thicker wall (--wall), or give planes (--cut).");
  const std::vector<Candidate> all = candidates(body, wishes, progress);
  if (const auto plane = best_alone(body, all, wishes, progress)) return {*plane};
  std::vector<Cut::Plane> planes = best_pair(body, all);
  if (planes.empty()) planes = one_by_one(body, all);
  if (planes.empty())
    throw Error(ErrorCode::goal, "No plane was found that opens each of its " + std::to_string(count) +
                                     " cavities. Give planes of your own: --cut z=10 or --cut 'z=10;x=0'.");
  for (Cut::Plane& plane : planes) plane = clear_of_vertices(mesh, plane);
  return planes;
}

}  // namespace rayrep::detail
