#include "judge/righting.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "base/text.h"
#include "judge/figures.h"

namespace rayrep::verify_detail {
namespace {

using End = RightingCurve::End;

const char* name_of(End end) { return end == End::turns_over ? "turns over" : end == End::takes_water ? "takes water" : "never"; }

/// The side of the body that faces a direction: "-y", or "(0.71, 0.71, 0.00)".
std::string side_words(const Eigen::Vector3d& direction) {
  int axis = 0;
  direction.cwiseAbs().maxCoeff(&axis);
  constexpr double nearly = 0.999;  // 2.5 degrees
  if (std::abs(direction[axis]) > nearly) return (direction[axis] < 0 ? "-" : "+") + std::string(1, "xyz"[axis]) + " side";
  return "side that faces (" + number(direction.x(), 2) + ", " + number(direction.y(), 2) + ", " + number(direction.z(), 2) + ")";
}

}  // namespace

void add_righting(const std::optional<RightingCurve>& curve, Figures& figures) {
  const auto value = [&curve](auto of) -> Figure::Value {
    if (!curve) return {};
    return of(*curve);
  };
  const auto add = [&figures](Figure figure) { figures.push_back(std::move(figure)); };
  add({.name = "gz_heel_rad", .words = "", .unit = Unit::rad, .value = value([](const auto& c) { return c.heel_rad; })});
  add({.name = "gz_mm", .words = "", .unit = Unit::mm, .value = value([](const auto& c) { return c.arm_mm; })});
  add({.name = "gz_lowered", .words = "", .value = value([](const auto& c) { return list(c.lowered); })});
  add({.name = "gz_range_rad",
       .words = curve ? "rights itself from a heel of up to" : "",
       .unit = Unit::rad,
       .value = value([](const auto& c) { return c.range_rad; }),
       .digits = 1});
  add({.name = "gz_range_ends", .words = "", .value = value([](const auto& c) { return std::string(name_of(c.end)); })});
  add({.name = "gz_largest_mm", .words = curve ? "largest righting arm" : "", .unit = Unit::mm, .value = value([](const auto& c) {
                                                                                                  return c.arm_mm[c.largest];
                                                                                                })});
  add({.name = "gz_largest_heel_rad", .words = "", .unit = Unit::rad, .value = value([](const auto& c) {
                                                                        return c.heel_rad[c.largest];
                                                                      })});
  add({.name = "gz_area_mm_rad", .words = curve ? "area under the righting arms, mm rad" : "", .value = value([](const auto& c) {
                                                                                                 return c.area_mm_rad;
                                                                                               })});
}

std::string righting_words(const RightingCurve& curve) {
  // A curve that ends so near upside down ends where the other side begins to right it.
  if (curve.end == End::none || (curve.end == End::turns_over && degrees(curve.range_rad, 1) == degrees(std::numbers::pi, 1)))
    return "from any heel.";
  const std::string work = " takes as much work as to lift it by " + number(curve.area_mm_rad, 2) + " mm.";
  if (curve.end == End::takes_water) return "as long as no water comes in. To heel it that far" + work;
  return "from any heel up to " + degrees(curve.range_rad, 1) + "; beyond, with its " + side_words(curve.lowered) +
         " down, it turns over. To turn it over that way" + work;
}

}  // namespace rayrep::verify_detail
