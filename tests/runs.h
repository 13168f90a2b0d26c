#pragma once

#include <string>
#include <vector>

#include "rayrep/judge/verify.h"
#include "rayrep/make/hollow.h"

namespace rayrep::test {

/// A goal and how to make it.
template <typename S>
struct Job {
  S spec;
  HollowOptions hollow;
};

/// What came out, with its spec as that of its goal.
template <typename S>
struct Outcome : HollowResult {
  explicit Outcome(HollowResult result) : HollowResult(std::move(result)), found(std::get<S>(this->spec)) {}
  S found;
};

template <typename S>
Outcome<S> hollowed(const Mesh& solid, const Job<S>& job, const Progress& progress = {}) {
  return Outcome<S>(rayrep::hollow(solid, job.spec, job.hollow, progress));
}

/// With so few rays that it takes no time.
inline HollowOptions coarse(int resolution) {
  HollowOptions options;
  options.resolution = resolution;
  return options;
}

using Names = std::vector<std::string>;

/// The criteria that a verdict does not meet.
inline Names failed(const Verdict& verdict) {
  Names names;
  for (const Criterion& c : verdict.criteria)
    if (!c.pass()) names.push_back(c.name);
  return names;
}

/// Where a top or yo-yo was made to spin.
inline Eigen::Vector3d place_of(const SpinSpec& spec) { return spec.yoyo ? *spec.centre_mm : spec.axis.point_mm; }

}  // namespace rayrep::test
