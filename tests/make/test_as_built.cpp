#include <gtest/gtest.h>

#include <cmath>

#include "make/as_built.h"
#include "make/cavity_maker.h"
#include "make/plan.h"
#include "runs.h"
#include "solids.h"

namespace rayrep::test {
namespace {

using namespace detail;

/// Cuts made anew scatter by where they are cut, and follow for short ways only.
class Scattering final : public Maker {
public:
  Scattering(std::unique_ptr<Maker> cavities, double scatter, double volume_mm3)
      : cavities_(std::move(cavities)), scatter_mm3_(scatter * volume_mm3) {}

  void make(const Switching& switching) override {
    const double height = height_of(switching.q);
    adapted_ = std::abs(height - height_) < 0.02;
    if (!adapted_) return make_anew(switching);
    cavities_->make(switching);
    height_ = height;
  }
  void make_anew(const Switching& switching) override {
    adapted_ = false;
    cavities_->make_anew(switching);
    height_ = height_of(switching.q);
    const auto place = static_cast<long>(std::floor(height_ / 0.05));
    off_mm3_ = place % 2 == 0 ? scatter_mm3_ : 0;
  }
  bool refine() override { return false; }
  bool adapted() const override { return adapted_; }
  bool spoilt() const override { return false; }
  const Moments& moments() const override {
    moments_ = cavities_->moments();
    moments_[M1] += off_mm3_;
    return moments_;
  }
  Made made() const override { return cavities_->made(); }

private:
  static double height_of(const Moments& q) { return -q[M1] / q[MZ]; }

  std::unique_ptr<Maker> cavities_;
  double scatter_mm3_;
  double height_ = HUGE_VAL;
  double off_mm3_ = 0;
  bool adapted_ = false;
  mutable Moments moments_;
};

TEST(AsBuilt, SettlesThoughCutsThatAreMadeAnewScatter) {
  const Mesh solid = uv_ellipsoid(24, 18, 20, 32);
  HollowOptions options = coarse(40);
  for (const double scatter : {0.0, 2e-4, 1e-3, 3e-3, -1e-3}) {
    FloatSpec spec;
    spec.waterline_mm = 20;
    Plan plan = detail::plan(solid, spec, options, {});
    const AsBuilt problem{
        plan.body->shell, moment_units(plan.body->solid[M1], plan.body->diagonal_mm), plan.error, plan.start, 18, 1e-6};
    const InteriorSolver solver(plan.goal, plan.body->inner.rays, *plan.body->integrals, plan.setup);
    Scattering maker(std::make_unique<CavityMaker>(*plan.body, print_of(plan.spec), options, Progress{}), scatter,
                     plan.body->solid[M1]);
    HollowResult result;
    solve_as_built(problem, solver, maker, result, {});
    EXPECT_LE(result.as_built_error, 1e-6) << scatter;
  }
}

}  // namespace
}  // namespace rayrep::test
