#include "second_opinion.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <set>
#include <utility>
#include <variant>
#include <vector>

#include "plain.h"

namespace fuzz {
namespace {

using namespace plain;
using rayrep::Limits;
using rayrep::Mesh;
using rayrep::Print;

using Objection = std::optional<std::string>;
using Key = std::array<Real, 9>;

/// The same for a triangle whichever corner it starts with.
Key key_of(Triangle t) {
  const auto less = [](const Point& a, const Point& b) { return std::array{a.x, a.y, a.z} < std::array{b.x, b.y, b.z}; };
  std::rotate(t.begin(), std::min_element(t.begin(), t.end(), less), t.end());
  Key key;
  for (std::size_t k = 0; k < 3; ++k) {
    key[3 * k] = t[k].x + 0;
    key[3 * k + 1] = t[k].y + 0;
    key[3 * k + 2] = t[k].z + 0;
  }
  return key;
}

std::multiset<Key> keys_of(const Surface& surface) {
  std::multiset<Key> keys;
  for (const Triangle& t : surface) keys.insert(key_of(t));
  return keys;
}

/// Calls `look` with every two triangles of the two whose boxes come within a distance; true as soon as it says true.
template <typename Look>
bool any_near(const Surface& first, const Surface& second, Real within, const Look& look) {
  std::vector<Box> boxes;
  std::vector<std::size_t> order(second.size());
  for (std::size_t t = 0; t < second.size(); ++t) {
    boxes.push_back(box_of({second[t]}));
    order[t] = t;
  }
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return boxes[a].lo.x < boxes[b].lo.x; });
  for (const Triangle& t : first) {
    const Box box = box_of({t});
    for (const std::size_t k : order) {
      const Box& other = boxes[k];
      if (other.lo.x > box.hi.x + within) break;
      if (other.hi.x < box.lo.x - within || other.lo.y > box.hi.y + within || other.hi.y < box.lo.y - within ||
          other.lo.z > box.hi.z + within || other.hi.z < box.lo.z - within)
        continue;
      if (look(t, second[k])) return true;
    }
  }
  return false;
}

/// Whether some triangle has its corners where the other surface has triangles.
bool lies_on(const Surface& surface, const Surface& other, Real within) {
  return std::any_of(surface.begin(), surface.end(), [&](const Triangle& t) {
    return std::all_of(t.begin(), t.end(), [&](const Point& p) {
      return std::any_of(other.begin(), other.end(), [&](const Triangle& u) { return distance(p, u) <= within; });
    });
  });
}

/// A delivered mesh taken apart: parts that hold none of the original's triangles were added by a maker.
struct Delivered {
  Surface all, outer;
  std::vector<Surface> added;
  std::vector<Surface> solids;  ///< without an original: what faces outward
  Real diagonal = 0;

  Delivered(const Mesh& mesh, const Mesh* original) : all(surface_of(mesh)), diagonal(box_of(all).diagonal()) {
    const std::multiset<Key> given = original ? keys_of(surface_of(*original)) : std::multiset<Key>();
    for (Surface& part : parts_of(all)) {
      const bool holds_original =
          std::any_of(part.begin(), part.end(), [&](const Triangle& t) { return given.contains(key_of(t)); });
      // A body that was moved by no more than rounding is no cavity either.
      const bool is_original =
          holds_original || (original && volume(part) > 0 && lies_on(part, surface_of(*original), 2e-7L * diagonal));
      if (!original && volume(part) > 0) solids.push_back(part);
      if (original ? is_original : volume(part) > 0)
        outer.insert(outer.end(), part.begin(), part.end());
      else
        added.push_back(std::move(part));
    }
  }
};

/// Some triangles spread over all: every k-th.
template <typename Look>
void for_some(const Surface& surface, std::size_t at_most, const Look& look) {
  const std::size_t step = 1 + surface.size() / at_most;
  for (std::size_t t = 0; t < surface.size(); t += step) look(surface[t]);
}

/// Winding numbers just below and above a triangle's middle; none where something else is too near to tell.
std::optional<std::pair<Real, Real>> windings_beside(const Surface& all, const Triangle& triangle, Real diagonal) {
  const Point middle = (1.0L / 3) * (triangle[0] + triangle[1] + triangle[2]);
  const Point n = cross(triangle[1] - triangle[0], triangle[2] - triangle[0]);
  Real nearest = diagonal;
  bool itself = false;
  const Key key = key_of(triangle);
  for (const Triangle& other : all) {
    if (!itself && key_of(other) == key) {
      itself = true;
      continue;
    }
    nearest = std::min(nearest, distance(middle, other));
  }
  const Real step = 0.1L * nearest;
  if (!(step > 1e-11L * diagonal) || !(norm(n) > 1e-12L * diagonal * diagonal)) return {};
  const Point move = (step / norm(n)) * n;
  return std::pair(winding(all, middle - move), winding(all, middle + move));
}

bool is_about(Real value, Real wanted) { return std::abs(value - wanted) < 0.01L; }

/// Whether the solid is simply what the surface encloses: nothing crosses, nowhere is it there twice.
bool is_simple(const Surface& surface, Real diagonal) {
  if (any_near(surface, surface, 0, surely_cross)) return false;
  bool simple = true;
  for_some(surface, 40, [&](const Triangle& t) {
    const auto beside = windings_beside(surface, t, diagonal);
    simple = simple && beside && is_about(beside->first, 1) && is_about(beside->second, 0);
  });
  return simple;
}

/// Every point of the original is on the delivered outer surface.
Objection outer_surface(const Delivered& delivered, const Mesh& original, Real allowed) {
  const std::multiset<Key> there = keys_of(delivered.all);
  for (const Triangle& t : surface_of(original)) {
    if (there.contains(key_of(t))) continue;
    for (const Point& p : {t[0], t[1], t[2], (1.0L / 3) * (t[0] + t[1] + t[2])}) {
      Real nearest = 2 * delivered.diagonal;
      for (const Triangle& other : delivered.all) nearest = std::min(nearest, distance(p, other));
      if (nearest > allowed) return "the outer surface is not the original's";
    }
  }
  return {};
}

Objection cavities(const Delivered& delivered, const Print& print, const Limits& limits) {
  const Real wall = print.wall_mm;
  for (const Surface& part : delivered.solids) {
    const Point& corner = part[0][0];
    if (!is_about(winding(delivered.all, corner) - winding(part, corner), 0)) continue;
    for (const Surface& around : delivered.solids)
      if (&around != &part && is_about(winding(around, corner), 1)) return "a part is loose";
  }
  for (const Surface& part : delivered.added) {
    if (print.liquid_g_cm3 > 0 && !print.drained && volume(part) < 0) return "a sealed cavity keeps resin";
    const std::multiset<Key> keys = keys_of(part);
    if (std::adjacent_find(keys.begin(), keys.end()) != keys.end()) return "a triangle of a cavity is there twice";
    if (any_near(part, delivered.all, 0, surely_cross)) return "a cavity crosses something";
    bool wrong = false;
    for_some(part, 40, [&](const Triangle& t) {
      if (const auto beside = windings_beside(delivered.all, t, delivered.diagonal))
        wrong = wrong || !is_about(beside->first, 1) || !is_about(beside->second, 0);
    });
    if (wrong) return "a cavity does not lead from material into the empty";
    if (volume(part) > 0) {
      const Point& corner = part[0][0];
      if (std::abs(winding(delivered.all, corner) - winding(part, corner)) < 0.01L) return "a part is loose";
    }
    const Real least = static_cast<Real>(limits.wall_ratio) * wall - 1e-9L * delivered.diagonal;
    if (wall > 0 && volume(part) < 0 &&
        any_near(part, delivered.outer, wall, [least](const Triangle& t, const Triangle& u) { return distance(t, u) < least; }))
      return "a wall is too thin";
  }
  return {};
}

/// What the goals' own objections need.
struct Weighed {
  const Delivered& delivered;
  Body body;
  Real density;  ///< g/mm3
  const Limits& limits;
};

constexpr Real kSlack = 1e-6L;  ///< for rounding of coordinates and of the library's doubles

bool is_convex(const Surface& surface, Real diagonal) {
  for (const Triangle& t : surface) {
    const Point n = cross(t[1] - t[0], t[2] - t[0]);
    for (const Triangle& other : surface)
      for (const Point& p : other)
        if (dot(p - t[0], n) > 1e-9L * norm(n) * diagonal) return false;
  }
  return true;
}

/// Over its weight: the height of the centre of mass above that of buoyancy.
Real energy(const Surface& hull, const Body& body, Real displaced, const Point& n) {
  return dot(body.centre - wet_part(hull, n, waterline(hull, n, displaced)).centre, n);
}

Objection speaks_against(const rayrep::FloatSpec& spec, const Weighed& weighed) {
  const auto& [delivered, body, density, limits] = weighed;
  // Without its cavities, those it came with included.
  Surface hull;
  for (const Surface& part : parts_of(delivered.outer))
    if (volume(part) > 0) hull.insert(hull.end(), part.begin(), part.end());
  const Point up = frame_along(point(spec.up)).z;
  Real lowest = dot(hull[0][0], up);
  for (const Triangle& t : hull)
    for (const Point& p : t) lowest = std::min(lowest, dot(p, up));
  if (!is_convex(hull, delivered.diagonal)) return {};  // pockets may be dry
  if (!spec.waterline_mm) return "no waterline";
  const Wet wet = wet_part(hull, up, lowest + static_cast<Real>(*spec.waterline_mm));
  const Real fluid = 1e-3L * spec.fluid_g_cm3;
  const Real mass = density * body.volume;
  const Real displaced = fluid * wet.volume;
  if (!(std::abs(mass - displaced) <= (limits.mass_error + kSlack) * displaced)) return "it does not weigh what it displaces";
  const Point arm = body.centre - wet.centre;
  if (!(norm(arm - dot(arm, up) * up) <= (limits.offset_over_diagonal + kSlack) * delivered.diagonal))
    return "the centres are not above each other";
  if (!(wet.smallest_second / wet.volume - dot(arm, up) > 0)) return "the metacentre is too low";
  const Frame frame = frame_along(up);
  for (const Real more : {1.0L, 1.0L + static_cast<Real>(limits.too_heavy[0])}) {
    const Real volume_below = more * mass / fluid;
    if (volume_below > volume(hull)) return "it sinks";
    const Real upright = energy(hull, body, volume_below, up);
    for (int k = 0; k < 4; ++k) {
      const Point towards = k % 2 ? frame.x : frame.y;
      const Real tilt = (k < 2 ? 1 : -1) * static_cast<Real>(limits.release_tilt_rad);
      const Point released = std::cos(tilt) * up + std::sin(tilt) * towards;
      // From there it runs down to within a degree of upright, where the energy is hardly less than upright.
      if (energy(hull, body, volume_below, released) < upright - 5e-5L * delivered.diagonal) return "it does not right itself";
    }
  }
  return {};
}

Objection speaks_against(const rayrep::SpinSpec& spec, const Weighed& weighed) {
  const auto& [delivered, body, density, limits] = weighed;
  const Frame frame = frame_along(point(spec.up));
  const Real most = (limits.offset_over_diagonal + kSlack) * delivered.diagonal;
  if (!spec.yoyo && spec.axis.through != rayrep::SpinAxis::Through::point) return {};  // the judge found the contact point
  if (spec.yoyo && !spec.centre_mm) return {};
  const Point arm = body.centre - point(spec.yoyo ? *spec.centre_mm : spec.axis.point_mm);
  if (!(norm(arm - dot(arm, frame.z) * frame.z) <= most)) return "the centre of mass is beside the axis";
  if (spec.yoyo && !(norm(arm) <= most)) return "the centre of mass is not in the middle";
  const auto inertia = [&body = body](const Point& p, const Point& q) {
    const Real ps[3] = {p.x, p.y, p.z};
    const Real qs[3] = {q.x, q.y, q.z};
    Real sum = 0;
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t l = 0; l < 3; ++l) sum += ps[k] * body.inertia[k][l] * qs[l];
    return sum;
  };
  const Real axial = inertia(frame.z, frame.z);
  const Real xx = inertia(frame.x, frame.x);
  const Real yy = inertia(frame.y, frame.y);
  const Real xy = inertia(frame.x, frame.y);
  const Real larger = (xx + yy) / 2 + std::hypot((xx - yy) / 2, xy);
  const Real smaller = (xx + yy) / 2 - std::hypot((xx - yy) / 2, xy);
  // An axis that is off a principal one by an angle has products of inertia of at most that angle times the largest difference.
  const Real products = std::hypot(inertia(frame.x, frame.z), inertia(frame.y, frame.z));
  const Real spread = std::max({axial, larger}) - std::min({axial, smaller}) + 2 * products;
  if (!(products <= (limits.axis_angle_rad + kSlack) * spread + 1e-9L * axial)) return "the axis is not a principal one";
  if (spec.prefer == rayrep::AxisClass::largest ? !(axial > larger * (1 - kSlack)) : !(axial < smaller * (1 + kSlack)))
    return "the axis is of the wrong class";
  return {};
}

Objection speaks_against(const rayrep::StandSpec& spec, const Weighed& weighed) {
  const auto& [delivered, body, density, limits] = weighed;
  const Frame frame = frame_along(point(spec.up));
  Real lo = dot(delivered.all[0][0], frame.z);
  Real hi = lo;
  for (const Triangle& t : delivered.all)
    for (const Point& p : t) {
      lo = std::min(lo, dot(p, frame.z));
      hi = std::max(hi, dot(p, frame.z));
    }
  const Real height = hi - lo;
  const Real give = spec.contact_tolerance_mm ? static_cast<Real>(*spec.contact_tolerance_mm)
                                              : std::max(1e-4L * height, std::min(0.15L, 5e-3L * height));
  const Real ground = lo + give * (1 + 1e-9L) + 1e-12L * delivered.diagonal;
  // It stands only if the centre of mass is not outside of what touches the ground, in any direction.
  std::vector<std::array<Real, 2>> feet;
  for (const Triangle& t : delivered.all)
    for (std::size_t k = 0; k < 3; ++k) {
      const Point& a = t[k];
      const Point& b = t[(k + 1) % 3];
      const Real above_a = dot(a, frame.z) - ground;
      const Real above_b = dot(b, frame.z) - ground;
      if (above_a <= 0) feet.push_back({dot(a, frame.x), dot(a, frame.y)});
      if ((above_a <= 0) != (above_b <= 0)) {
        const Point cut = a + (above_a / (above_a - above_b)) * (b - a);
        feet.push_back({dot(cut, frame.x), dot(cut, frame.y)});
      }
    }
  const Real x = dot(body.centre, frame.x);
  const Real y = dot(body.centre, frame.y);
  for (int k = 0; k < 180; ++k) {
    const Real c = std::cos(k * 0.0349065850L);
    const Real s = std::sin(k * 0.0349065850L);
    Real farthest = -1e30L;
    for (const auto& foot : feet) farthest = std::max(farthest, c * (foot[0] - x) + s * (foot[1] - y));
    if (!(farthest > -1e-9L * delivered.diagonal)) return "it falls over";
  }
  if (spec.target_mm) {
    const Point off = body.centre - point(*spec.target_mm);
    if (!(std::hypot(dot(off, frame.x), dot(off, frame.y)) <= (limits.offset_over_diagonal + kSlack) * delivered.diagonal))
      return "the centre of mass is not above the target";
  }
  return {};
}

Objection speaks_against(const rayrep::TargetSpec& spec, const Weighed& weighed) {
  const auto& [delivered, body, density, limits] = weighed;
  const auto& I = body.inertia;
  const Real found[10] = {density * body.volume, body.centre.x,     body.centre.y,     body.centre.z,     density * I[0][0],
                          density * I[1][1],     density * I[2][2], density * I[0][1], density * I[1][2], density * I[0][2]};
  for (std::size_t k = 0; k < 10; ++k) {
    if (!spec.wanted[k]) continue;
    const auto wanted = static_cast<Real>(*spec.wanted[k]);
    Real unit = std::abs(wanted);
    if (k >= 1 && k <= 3) unit = delivered.diagonal;
    if (k == 7) unit = std::sqrt(found[4] * found[5]);
    if (k == 8) unit = std::sqrt(found[5] * found[6]);
    if (k == 9) unit = std::sqrt(found[4] * found[6]);
    if (!(std::abs(found[k] - wanted) <= (limits.relative + kSlack) * unit)) return "it does not have the numbers wanted";
  }
  return {};
}

Objection speaks_against(const rayrep::PoseSpec& spec, const Weighed& weighed) {
  for (const rayrep::Pose& pose : spec.poses) {
    const Eigen::Vector3d up = pose.up_or(spec.up);
    if (pose.kind == rayrep::Pose::Kind::stands) {
      rayrep::StandSpec stand;
      stand.up = up;
      stand.contact_tolerance_mm = spec.contact_tolerance_mm;
      if (auto why = speaks_against(stand, weighed)) return why;
    }
    if (pose.kind == rayrep::Pose::Kind::hangs) {
      const Frame frame = frame_along(point(up));
      const Point arm = point(pose.point_mm) - weighed.body.centre;
      const Real most = (weighed.limits.offset_over_diagonal + kSlack) * weighed.delivered.diagonal;
      if (!(norm(arm - dot(arm, frame.z) * frame.z) <= most)) return "the centre of mass is beside the string";
      if (!(dot(arm, frame.z) > 0)) return "it hangs upside down";
    }
  }
  return {};
}

/// Where the centre of mass is, is what decides; of what rolls where there is no second opinion.
Objection speaks_against(const rayrep::DiceSpec&, const Weighed&) { return {}; }

}  // namespace

Objection objection(const Mesh& delivered, const Mesh* original, const rayrep::Spec& spec, const Limits& limits) {
  const Delivered apart(delivered, original);
  if (!is_closed(apart.all)) return "it is not closed";
  Real largest = 0;
  for (const Triangle& t : apart.all)
    for (const Point& p : t) largest = std::max({largest, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  if (original)
    if (auto why = outer_surface(apart, *original, 2e-7L * largest)) return why;
  const Print& print = rayrep::print_of(spec);
  if (auto why = cavities(apart, print, limits)) return why;
  if (!is_simple(apart.all, apart.diagonal)) return {};
  const Weighed weighed{apart, body_of(apart.all), 1e-3L * static_cast<Real>(print.density_g_cm3), limits};
  if (!(weighed.body.volume > 0)) return "it has no volume";
  return std::visit([&](const auto& s) { return speaks_against(s, weighed); }, spec);
}

}  // namespace fuzz
