#pragma once

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

/// Where a top or yo-yo was made to spin.
inline Eigen::Vector3d place_of(const SpinSpec& spec) { return spec.yoyo ? *spec.centre_mm : spec.axis.point_mm; }

}  // namespace rayrep::test
