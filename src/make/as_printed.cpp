#include "make/as_printed.h"

#include <algorithm>
#include <limits>

#include "rayrep/physics/core.h"

namespace rayrep::detail {
namespace {

constexpr double kMisses = 3e-4;     // a print that misses its goal by more is not what was asked for
constexpr double kHardlyLess = 0.3;  // of the error of the slice before: it will not get there

/// What another maker makes, as it will be printed as far as that is known.
class PrintedMaker final : public Maker {
public:
  explicit PrintedMaker(Maker& inner) : inner_(inner) { measure(); }

  /// @param more  that the print has than the mesh
  void expect(const Moments& more) {
    more_ = more;
    measure();
  }

  void make(const Switching& switching) override {
    inner_.make(switching);
    measure();
  }
  void make_anew(const Switching& switching) override {
    inner_.make_anew(switching);
    measure();
  }
  bool refine() override { return inner_.refine(); }
  bool take_all() override { return inner_.take_all(); }
  bool adapted() const override { return inner_.adapted(); }
  bool spoilt() const override { return inner_.spoilt(); }
  const Moments& moments() const override { return moments_; }
  Made made() const override {
    kept_ = inner_.moments();
    return inner_.made();
  }

  /// Of the mesh that was taken last.
  const Moments& kept() const { return kept_; }

private:
  void measure() { moments_ = inner_.moments() + more_; }

  Maker& inner_;
  Moments more_ = Moments::Zero();
  Moments moments_ = Moments::Zero();
  mutable Moments kept_ = Moments::Zero();
};

}  // namespace

Moments solve_as_printed(AsPrinted problem, const InteriorSolver& solver, Maker& maker, HollowResult& result,
                         const Progress& progress) {
  AsBuilt& built = problem.built;
  PrintedMaker printed(maker);
  HollowResult best;
  Moments best_correction = built.start;
  std::vector<HollowResult::Slice> slices;
  double smallest = std::numeric_limits<double>::infinity();
  double last = smallest;
  for (int n = 0; n < problem.options.max_slices; ++n) {
    HollowResult now = result;
    built.start = solve_as_built(built, solver, printed, now, progress);
    progress.begin("slice");
    const Moments put_in = insert_moments(now.delivery, now.delivery.parts.front().density_g_cm3);
    const Moments s = moment_map(result.to_working) * (problem.options.as_printed(now.delivery) + put_in);
    double error = built.error(s);
    const bool stays = error > kMisses && error > kHardlyLess * last;
    if (problem.give_way && stays) {
      built.error = problem.give_way(s);
      problem.give_way = {};
      error = built.error(s);
      smallest = std::numeric_limits<double>::infinity();  // of another goal
      result.gave_way = true;
    }
    last = error;
    slices.push_back({s[M1] / printed.kept()[M1] - 1, error});
    if (error < smallest) {
      smallest = error;
      best = std::move(now);
      best.best_slice = slices.size() - 1;
      best_correction = built.start;
    }
    if (smallest <= problem.options.as_printed_tolerance) break;
    printed.expect(s - printed.kept());
  }
  best.gave_way = result.gave_way;
  result = std::move(best);
  result.slices = std::move(slices);
  return best_correction;
}

}  // namespace rayrep::detail
