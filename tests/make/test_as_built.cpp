#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <utility>

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

/// Lacks a part of its cavities until it is to take all.
class Lacking final : public Maker {
public:
  Lacking(std::unique_ptr<Maker> cavities, const Moments& solid) : cavities_(std::move(cavities)), solid_(solid) {}

  void make(const Switching& switching) override { cavities_->make(switching); }
  void make_anew(const Switching& switching) override { cavities_->make_anew(switching); }
  bool refine() override { return false; }
  bool take_all() override { return std::exchange(lacks_, false); }
  bool adapted() const override { return cavities_->adapted(); }
  bool spoilt() const override { return cavities_->spoilt(); }
  const Moments& moments() const override {
    moments_ = cavities_->moments();
    if (lacks_) moments_ = solid_ + 0.9 * (moments_ - solid_);
    return moments_;
  }
  Made made() const override { return cavities_->made(); }

  bool lacks() const { return lacks_; }

private:
  std::unique_ptr<Maker> cavities_;
  Moments solid_;
  bool lacks_ = true;
  mutable Moments moments_;
};

/// An ellipsoid that floats, and the cavities of it.
struct Floating {
  explicit Floating(double waterline_mm) {
    FloatSpec spec;
    spec.waterline_mm = waterline_mm;
    plan = detail::plan(uv_ellipsoid(24, 18, 20, 32), spec, options, {});
    cavities = std::make_unique<CavityMaker>(*plan.body, print_of(plan.spec), options, Progress{});
  }

  double error_as_built(Maker& maker) const {
    const AsBuilt problem{
        plan.body->shell, moment_units(plan.body->solid[M1], plan.body->diagonal_mm), plan.error, plan.start, 18, 1e-6};
    HollowResult result;
    solve_as_built(problem, {plan.goal, plan.body->inner.rays, *plan.body->integrals, plan.setup}, maker, result, {});
    return result.as_built_error;
  }

  HollowOptions options = coarse(40);
  Plan plan;
  std::unique_ptr<Maker> cavities;
};

TEST(AsBuilt, TakesAllWhereMoreIsAskedForThanTheCavitiesHave) {
  Floating body(13);
  Lacking maker(std::move(body.cavities), body.plan.body->solid);
  EXPECT_LE(body.error_as_built(maker), 1e-6);
  EXPECT_FALSE(maker.lacks());
}

TEST(AsBuilt, LeavesWhatLacksAsItIsWhereItIsEnough) {
  Floating body(20);
  Lacking maker(std::move(body.cavities), body.plan.body->solid);
  EXPECT_LE(body.error_as_built(maker), 1e-6);
  EXPECT_TRUE(maker.lacks());
}

TEST(AsBuilt, SettlesThoughCutsThatAreMadeAnewScatter) {
  for (const double scatter : {0.0, 2e-4, 1e-3, 3e-3, -1e-3}) {
    Floating body(20);
    Scattering maker(std::move(body.cavities), scatter, body.plan.body->solid[M1]);
    EXPECT_LE(body.error_as_built(maker), 1e-6) << scatter;
  }
}

}  // namespace
}  // namespace rayrep::test
