#include "make/carriers.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <queue>

#include "mesh/revolved.h"
#include "rays/positive_part.h"

namespace rayrep::detail {
namespace {

/// Cones are that much steeper than they have to be: facets of a cavity are tilted by what its mesh may be off.
constexpr double kSpare_rad = 2 * std::numbers::pi / 180;
/// So much more within two radii of the pillar, where a cone is bent most and chords along it are flatter than it.
constexpr double kSpareBelow_rad = 8 * std::numbers::pi / 180;
constexpr int kSides = 16;
/// By so much more pillars keep away from holes that are planned than from those that are drilled, which may lie a little askew.
constexpr double kSpare_mm = 0.3;
/// By so much of half a cell roofs are lower at its corners than planes through its middle, at most, as they are bent.
constexpr double kBent = 0.2;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// What of a roof one ray sees.
struct Roof {
  Eigen::Vector3d at;
  double area_mm2;
  double room_mm;                   ///< so much higher it may come to lie yet
  std::array<double, 4> corner_mm;  ///< how high it is, at least, at the corners of the ray's cell: see corners()
};

/// Of a cell, in half its width.
const std::array<Eigen::Vector2d, 4>& corners() {
  static const std::array<Eigen::Vector2d, 4> all = {{{-1, -1}, {1, -1}, {-1, 1}, {1, 1}}};
  return all;
}

/// A cone on a pillar, as printed.
struct Carrier {
  std::size_t ray = 0;  ///< of its axis
  Eigen::Vector2d axis = Eigen::Vector2d::Zero();
  double foot_mm = 0;  ///< of the pillar
  double neck_mm = 0;  ///< where it widens
  double top_mm = 0;
};

struct Shape {
  double radius_mm;  ///< of pillars
  double slope;      ///< of cones, height over width
  double steep;      ///< of their lower ends
  double half_mm;    ///< half the width of a cell

  double underside_mm(const Carrier& c, double distance_mm) const {
    return distance_mm < radius_mm ? c.foot_mm : c.neck_mm + rise_mm(distance_mm);
  }
  /// Of the underside over the neck.
  double rise_mm(double distance_mm) const {
    const double beside = std::max(0.0, distance_mm - radius_mm);
    return beside * slope + std::min(beside, radius_mm) * (steep - slope);
  }
  /// The highest neck with which a roof is carried, all over its cell: a cone rises more than what it carries, so that is decided
  /// at a corner of the cell.
  double neck_for(const Roof& roof, const Eigen::Vector2d& axis) const {
    double neck_mm = kInfinity;
    for (std::size_t k = 0; k < 4; ++k)
      neck_mm = std::min(neck_mm, roof.corner_mm[k] - rise_mm((roof.at.head<2>() + half_mm * corners()[k] - axis).norm()));
    return neck_mm;
  }
};

Eigen::Vector3d normal_at(const KeptSolid& solid, const Carrying& how, const Eigen::Vector3d& p, bool of_domain) {
  if (!of_domain) return -(how.within->segment<3>(MX) + quadric_hessian(*how.within) * p).normalized();
  const ClosestPoint closest = solid.surface.closest(p, 2 * how.wall_mm);
  return closest.triangle < 0 ? Eigen::Vector3d(0, 0, 0) : Eigen::Vector3d((closest.point_mm - p).normalized());
}

/// Chooses carriers, one after the other.
class Planner {
public:
  Planner(const KeptSolid& solid, const Carrying& how, const Progress& progress)
      : solid_(solid),
        how_(how),
        progress_(progress),
        domain_(inner_domain(solid, {how.wall_mm, how.spacing_mm, how.spacing_mm, 0}, progress).rays),
        cavity_(how.within ? positive_part(domain_, *how.within) : domain_),
        shape_{how.radius_mm(), std::tan(how.angle_rad + kSpare_rad), std::tan(how.angle_rad + kSpare_rad + kSpareBelow_rad),
               0.5 * how.spacing_mm} {
    find_roofs();
    lower_corners();
  }

  Carriers plan() {
    Carriers result;
    result.surface_mm2 = 2 * static_cast<double>(cavity_.intervals.size()) * cavity_.grid.cell_area_mm2();
    for (const Roof& roof : roofs_) result.roof_mm2 += roof.area_mm2;
    left_.resize(cavity_.grid.size());
    for (std::size_t ray = 0; ray < left_.size(); ++ray)
      left_[ray].assign(domain_.intervals.begin() + domain_.first[ray], domain_.intervals.begin() + domain_.first[ray + 1]);
    carried_.assign(roofs_.size(), 0);
    choose();
    raise();
    for (const Carrier& carrier : chosen_) result.bones.push_back(bone(carrier));
    return result;
  }

private:
  void find_roofs() {
    std::vector<std::vector<Roof>> rows(static_cast<std::size_t>(cavity_.grid.ny));
    const auto columns = static_cast<std::size_t>(cavity_.grid.nx);
    std::vector<std::uint32_t> count(cavity_.grid.size(), 0);
    tbb::parallel_for(std::size_t{0}, rows.size(), [&](std::size_t j) {
      for (std::size_t ray = j * columns; ray < (j + 1) * columns; ++ray)
        for (std::uint32_t n = cavity_.first[ray]; n < cavity_.first[ray + 1]; ++n) {
          const double top_mm = cavity_.intervals[n].hi;
          const Eigen::Vector2d xy = cavity_.grid.at(ray);
          const Eigen::Vector3d at(xy.x(), xy.y(), top_mm);
          const bool of_domain =
              std::any_of(domain_.intervals.begin() + domain_.first[ray], domain_.intervals.begin() + domain_.first[ray + 1],
                          [top_mm](const Interval& whole) { return whole.hi == top_mm; });
          const Eigen::Vector3d normal = normal_at(solid_, how_, at, of_domain);
          const double up = normal.z();
          if (up <= std::cos(how_.angle_rad) * (1 + 1e-4)) continue;
          rows[j].push_back({at, cavity_.grid.cell_area_mm2() / up, of_domain ? 0 : how_.room_mm, {}});
          for (std::size_t k = 0; k < 4; ++k)
            rows[j].back().corner_mm[k] =
                top_mm - shape_.half_mm * (normal.head<2>().dot(corners()[k]) / up + kBent * std::tan(how_.angle_rad));
          ++count[ray];
        }
    });
    first_.assign(1, 0);
    for (const std::uint32_t n : count) first_.push_back(first_.back() + n);
    for (const auto& row : rows) roofs_.insert(roofs_.end(), row.begin(), row.end());
  }

  /// Where the planes of roofs side by side are not equally high at the corner that they share, it is as high as the lowest.
  void lower_corners() {
    std::vector<std::array<double, 4>> lowest;
    for (const Roof& roof : roofs_) lowest.push_back(roof.corner_mm);
    const double near_mm = 4 * shape_.half_mm * std::tan(how_.angle_rad);
    const std::size_t columns = static_cast<std::size_t>(cavity_.grid.nx);
    for (const std::size_t step : {std::size_t{1}, columns, columns + 1, columns - 1})
      for (std::size_t ray = 0; ray + step + 1 < first_.size(); ++ray)
        for (std::uint32_t a = first_[ray]; a < first_[ray + 1]; ++a)
          for (std::uint32_t b = first_[ray + step]; b < first_[ray + step + 1]; ++b) share_corners(a, b, near_mm, lowest);
    for (std::size_t n = 0; n < roofs_.size(); ++n) roofs_[n].corner_mm = lowest[n];
  }

  void share_corners(std::uint32_t a, std::uint32_t b, double near_mm, std::vector<std::array<double, 4>>& lowest) const {
    if (std::abs(roofs_[a].at.z() - roofs_[b].at.z()) > near_mm) return;
    const Eigen::Vector2d apart = (roofs_[b].at - roofs_[a].at).head<2>() / shape_.half_mm;
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t j = 0; j < 4; ++j)
        if ((corners()[i] - corners()[j] - apart).squaredNorm() < 0.1) {
          const double low = std::min(roofs_[a].corner_mm[i], roofs_[b].corner_mm[j]);
          lowest[a][i] = std::min(lowest[a][i], low);
          lowest[b][j] = std::min(lowest[b][j], low);
        }
  }

  /// Calls visit(ray, distance) for the rays within a radius of an axis.
  template <typename Visit>
  void around(const Eigen::Vector2d& axis, double radius_mm, const Visit& visit) const {
    const RayGrid& grid = cavity_.grid;
    const Eigen::Array2d low = ((axis - grid.origin_mm).array() - radius_mm) / grid.spacing_mm;
    const Eigen::Array2d high = ((axis - grid.origin_mm).array() + radius_mm) / grid.spacing_mm;
    for (int j = std::max(0, static_cast<int>(std::ceil(low.y()))); j <= std::min(grid.ny - 1, static_cast<int>(high.y())); ++j)
      for (int i = std::max(0, static_cast<int>(std::ceil(low.x()))); i <= std::min(grid.nx - 1, static_cast<int>(high.x())); ++i) {
        const std::size_t ray = static_cast<std::size_t>(j) * static_cast<std::size_t>(grid.nx) + static_cast<std::size_t>(i);
        const double distance_mm = (grid.at(ray) - axis).norm();
        if (distance_mm <= radius_mm) visit(ray, distance_mm);
      }
  }

  bool carries(const Carrier& c, const Roof& roof, double distance_mm) const {
    if (roof.at.z() - shape_.rise_mm(distance_mm) < c.neck_mm) return false;  // not even at the ray
    return shape_.neck_for(roof, c.axis) >= c.neck_mm;
  }

  /// Calls visit(roof) for those that the carrier carries, if its top is not too low for them.
  template <typename Visit>
  void each_carried(const Carrier& c, double reach_mm, const Visit& visit) const {
    // What is much higher, on another floor, is for others.
    const double highest_mm = c.neck_mm + 1.5 * shape_.rise_mm(reach_mm);
    around(c.axis, reach_mm, [&](std::size_t ray, double distance_mm) {
      for (std::uint32_t n = first_[ray]; n < first_[ray + 1]; ++n)
        if (!carried_[n] && roofs_[n].at.z() <= highest_mm && carries(c, roofs_[n], distance_mm)) visit(n);
    });
  }

  double reach_of(const Carrier& c) const { return shape_.radius_mm + std::max(0.0, c.top_mm - c.neck_mm) / shape_.slope; }

  /// Sets its foot: where material begins below its neck, or there, where that is outside of the body.
  void set_foot(Carrier& c) const {
    std::vector<LineHit> hits;
    closed_line_hits(solid_.surface, c.axis, hits);
    c.foot_mm = c.neck_mm;
    int winding = 0;
    double entered = c.neck_mm;
    for (const LineHit& hit : hits) {
      if (hit.z_mm >= c.neck_mm) break;
      if (hit.triangle >= solid_.kept_from) continue;
      if (winding == 0 && hit.sign > 0) entered = hit.z_mm;
      winding += hit.sign;
    }
    if (winding > 0) c.foot_mm = entered;
  }

  /// Whether its pillar is out of the way of all holes. theory.md (142)
  bool stands_clear(const Carrier& c) const {
    const Rod pillar{{c.axis.x(), c.axis.y(), c.foot_mm}, {c.axis.x(), c.axis.y(), c.neck_mm}, shape_.radius_mm};
    return std::all_of(how_.holes.begin(), how_.holes.end(),
                       [&](const Rod& hole) { return gap_mm(pillar, hole) >= kClearOfPillars_mm + kSpare_mm; });
  }

  /// A candidate with its top and foot, and what it is worth: roof carried over volume taken.
  double worth(Carrier& c, double reach_mm) const {
    double area_mm2 = 0;
    c.top_mm = c.neck_mm;
    each_carried(c, reach_mm, [&](std::uint32_t n) {
      area_mm2 += roofs_[n].area_mm2;
      c.top_mm = std::max(c.top_mm, roofs_[n].at.z() + roofs_[n].room_mm);
    });
    if (area_mm2 == 0 || !stands_clear(c)) return 0;
    double taken_mm = 0;
    around(c.axis, reach_of(c), [&](std::size_t ray, double distance_mm) {
      const double lo = shape_.underside_mm(c, distance_mm);
      for (const Interval& open : left_[ray])
        taken_mm += std::max(0.0, std::min(open.hi, c.top_mm + how_.clearance_mm()) - std::max(open.lo, lo));
    });
    // So that there are not too many; twice as much or half of it hardly changes what they take in all, and what has few ridges
    // between cones has fewer and better triangles.
    const double alone_mm3 = 40 * std::pow(shape_.radius_mm, 3);
    return area_mm2 / (taken_mm * cavity_.grid.cell_area_mm2() + alone_mm3);
  }

  void take(const Carrier& c) {
    around(c.axis, reach_of(c), [&](std::size_t ray, double distance_mm) {
      const Interval cut{shape_.underside_mm(c, distance_mm), c.top_mm + how_.clearance_mm()};
      std::vector<Interval> rest;
      for (const Interval& open : left_[ray]) {
        if (open.lo < std::min(open.hi, cut.lo)) rest.push_back({open.lo, std::min(open.hi, cut.lo)});
        if (std::max(open.lo, cut.hi) < open.hi) rest.push_back({std::max(open.lo, cut.hi), open.hi});
      }
      left_[ray] = std::move(rest);
    });
    each_carried(c, reach_of(c) + shape_.radius_mm, [&](std::uint32_t n) {
      if (roofs_[n].at.z() <= c.top_mm) carried_[n] = 1;
    });
    chosen_.push_back(c);
  }

  struct Candidate {
    double worth;
    std::size_t place;
    bool operator<(const Candidate& other) const { return worth != other.worth ? worth < other.worth : place > other.place; }
  };

  std::vector<Carrier> candidates(std::vector<double>& reach_mm) const {
    constexpr std::array<double, 7> kReach = {1.6, 2.3, 3.3, 4.8, 7, 10, 14};  // of the radius
    const int step = std::max(1, static_cast<int>(std::lround(2 * shape_.radius_mm / how_.spacing_mm)));
    const auto columns = static_cast<std::size_t>(cavity_.grid.nx);
    std::vector<Carrier> all;
    for (std::size_t ray = 0; ray + 1 < first_.size(); ++ray) {
      if (ray % columns % static_cast<std::size_t>(step) != 0 || ray / columns % static_cast<std::size_t>(step) != 0) continue;
      for (std::uint32_t n = first_[ray]; n < first_[ray + 1]; ++n)
        for (const double reach : kReach) {
          Carrier c;
          c.ray = ray;
          c.axis = cavity_.grid.at(ray);
          c.neck_mm = *std::min_element(roofs_[n].corner_mm.begin(), roofs_[n].corner_mm.end()) -
                      shape_.rise_mm(reach * shape_.radius_mm + shape_.half_mm);
          all.push_back(c);
          reach_mm.push_back(1.5 * reach * shape_.radius_mm);
        }
    }
    return all;
  }

  void choose() {
    std::vector<double> reach_mm;
    std::vector<Carrier> all = candidates(reach_mm);
    std::vector<Candidate> first(all.size());
    constexpr std::size_t at_once = 1024;
    for (std::size_t begin = 0; begin < all.size(); begin += at_once) {
      progress_.check();
      tbb::parallel_for(begin, std::min(begin + at_once, all.size()), [&](std::size_t n) {
        set_foot(all[n]);
        first[n] = {worth(all[n], reach_mm[n]), n};
      });
    }
    std::priority_queue<Candidate> queue(first.begin(), first.end());
    while (!queue.empty()) {
      progress_.check();
      Candidate best = queue.top();
      queue.pop();
      best.worth = worth(all[best.place], reach_mm[best.place]);
      if (best.worth <= 0) continue;
      if (!queue.empty() && best < queue.top())
        queue.push(best);
      else
        take(all[best.place]);
    }
    for (std::size_t ray = 0; ray + 1 < first_.size(); ++ray)
      for (std::uint32_t n = first_[ray]; n < first_[ray + 1]; ++n)
        if (!carried_[n]) take_alone(ray, roofs_[n]);
  }

  /// For what lies between the candidates.
  void take_alone(std::size_t ray, const Roof& roof) {
    Carrier c;
    c.ray = ray;
    c.axis = cavity_.grid.at(ray);
    const auto stand = [&](const Eigen::Vector2d& axis) {
      c.axis = axis;
      c.neck_mm = shape_.neck_for(roof, axis);
      set_foot(c);
      return stands_clear(c);
    };
    // Above a hole a cone beside it has to be wider.
    const Eigen::Vector2d here = c.axis;
    constexpr int kAround = 12;
    for (int k = 0; !stand(here + beside(k / kAround, k % kAround, kAround)) && k < kAround * kAround;) ++k;
    worth(c, (c.axis - here).norm() + shape_.radius_mm);
    c.top_mm = std::max(c.top_mm, roof.at.z() + roof.room_mm);  // right above a pillar nothing widens that would reach it
    take(c);
  }

  /// On rings around a point, as far apart as pillars are thick.
  Eigen::Vector2d beside(int ring, int place, int places) const {
    const double angle = 2 * std::numbers::pi * place / places;
    return ring * shape_.radius_mm * Eigen::Vector2d(std::cos(angle), std::sin(angle));
  }

  /// The roofs that a carrier carries, whatever others do.
  std::vector<std::uint32_t> all_carried(const Carrier& c) const {
    std::vector<std::uint32_t> found;
    around(c.axis, reach_of(c) + shape_.radius_mm, [&](std::size_t ray, double distance_mm) {
      for (std::uint32_t n = first_[ray]; n < first_[ray + 1]; ++n)
        if (roofs_[n].at.z() + roofs_[n].room_mm <= c.top_mm && carries(c, roofs_[n], distance_mm)) found.push_back(n);
    });
    return found;
  }

  /// With carriers taken later, those taken before may have less to carry than they were meant to: each in turn, the last one
  /// first, is left out or made as small as what it carries alone lets it be.
  void raise() {
    constexpr int kSweeps = 3;
    std::vector<int> by(roofs_.size(), 0);
    std::vector<std::vector<std::uint32_t>> of;
    for (const Carrier& c : chosen_) {
      of.push_back(all_carried(c));
      for (const std::uint32_t n : of.back()) ++by[n];
    }
    for (int sweep = 0; sweep < kSweeps; ++sweep)
      for (std::size_t k = chosen_.size(); k-- > 0;) {
        progress_.check();
        for (const std::uint32_t n : of[k]) --by[n];
        std::erase_if(of[k], [&](std::uint32_t n) { return by[n] > 0; });
        if (of[k].empty()) continue;
        chosen_[k] = smallest(chosen_[k], of[k]);
        of[k] = all_carried(chosen_[k]);
        for (const std::uint32_t n : of[k]) ++by[n];
      }
    std::size_t kept = 0;
    for (std::size_t k = 0; k < chosen_.size(); ++k)
      if (!of[k].empty()) chosen_[kept++] = chosen_[k];
    chosen_.resize(kept);
  }

  bool may_stand(Carrier c, const Eigen::Vector2d& beside, double neck_mm) const {
    if (how_.holes.empty()) return true;
    c.axis += beside;
    c.neck_mm = neck_mm;
    set_foot(c);
    return stands_clear(c);
  }

  /// The carrier of these roofs with the highest neck, its axis on a ray not far from where it was.
  Carrier smallest(Carrier c, const std::vector<std::uint32_t>& roofs) const {
    const auto neck_at = [&](const Eigen::Vector2d& axis) {
      double neck_mm = kInfinity;
      for (const std::uint32_t n : roofs) neck_mm = std::min(neck_mm, shape_.neck_for(roofs_[n], axis));
      return neck_mm;
    };
    c.neck_mm = neck_at(c.axis);
    for (double step_mm = 16 * shape_.half_mm; step_mm > shape_.half_mm;) {
      bool any = false;
      for (const Eigen::Vector2d& to :
           {Eigen::Vector2d(1, 0), Eigen::Vector2d(-1, 0), Eigen::Vector2d(0, 1), Eigen::Vector2d(0, -1)})
        if (const double neck_mm = neck_at(c.axis + step_mm * to); neck_mm > c.neck_mm && may_stand(c, step_mm * to, neck_mm)) {
          c.axis += step_mm * to;
          c.neck_mm = neck_mm;
          any = true;
        }
      if (!any) step_mm /= 2;
    }
    c.top_mm = c.neck_mm;
    for (const std::uint32_t n : roofs) c.top_mm = std::max(c.top_mm, roofs_[n].at.z() + roofs_[n].room_mm);
    set_foot(c);
    return c;
  }

  /// What is its clearance away from the carrier's surface; a pillar that begins outside of the body has no foot.
  Mesh bone(const Carrier& c) const {
    const double around = how_.clearance_mm();
    const double radius = shape_.radius_mm - around;
    const double slope = shape_.slope;
    const double steep = shape_.steep;
    const auto off = [around](double s) { return around * std::sqrt(1 + s * s); };
    const double neck = c.neck_mm + off(steep) - around * steep;
    const double kink = 2 * shape_.radius_mm - (off(steep) - off(slope)) / (steep - slope);
    const double kink_height = neck + (kink - radius) * steep;
    const double top = c.top_mm;
    std::vector<Eigen::Vector2d> profile{{0, c.foot_mm}, {radius, c.foot_mm}};
    if (top > neck + 1e-3 * around) {
      const auto radius_at = [&](double z) {
        return z < kink_height ? radius + (z - neck) / steep : kink + (z - kink_height) / slope;
      };
      if (neck > c.foot_mm + 1e-3 * around) profile.emplace_back(radius, neck);
      if (kink_height > profile.back().y() + 1e-3 * around && top > kink_height + 1e-3 * around)
        profile.emplace_back(kink, kink_height);
      profile.emplace_back(radius_at(top), top);
    } else {
      profile.emplace_back(radius, std::max(top, c.foot_mm + 1e-3 * around));
    }
    profile.emplace_back(0, profile.back().y());
    // Around the cone, so that its flattest lines, which become round, are the edges.
    for (Eigen::Vector2d& p : profile) p.x() /= std::cos(std::numbers::pi / kSides);
    Mesh mesh = revolved(profile, kSides);
    for (Eigen::Vector3d& v : mesh.vertices) v.head<2>() += c.axis;
    return mesh;
  }

  const KeptSolid& solid_;
  const Carrying& how_;
  const Progress& progress_;
  RayRep domain_;
  RayRep cavity_;
  Shape shape_;
  std::vector<Roof> roofs_;
  std::vector<std::uint32_t> first_;  ///< of each ray's roofs
  std::vector<std::vector<Interval>> left_;
  std::vector<char> carried_;
  std::vector<Carrier> chosen_;
};

}  // namespace

Carriers carriers(const KeptSolid& solid, const Carrying& how, const Progress& progress) {
  return Planner(solid, how, progress).plan();
}

}  // namespace rayrep::detail
