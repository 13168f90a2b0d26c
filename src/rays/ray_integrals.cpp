#include "rayrep/rays/ray_integrals.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <cmath>

#include "rayrep/rays/ray_interior.h"

// Clones for wide vectors are chosen when the program starts. Lanes are fixed, so all of them give the same bytes.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__)
#define RAYREP_CLONES __attribute__((target_clones("default", "arch=haswell", "arch=skylake-avx512")))
#else
#define RAYREP_CLONES
#endif

namespace rayrep {
namespace {

constexpr std::uint32_t kLanes = 8;
constexpr std::uint32_t kChunk = 8192;  ///< intervals that one task sums

/// Sums along a row of constant y: integrals of x^a z^b over the material, in the order 00, 10, 20, 01, 11, 02.
constexpr int kRowSums = 6;
/// Sums of w x^a z^b over the free ends, b = 0 ... 4, a = 0 ... 4 - b.
constexpr int kEndSums = 15;

/// q.phi on a row: a z^2 + (b0 + b1 x) z + c0 + c1 x + c2 x^2, with a > 0.
struct RowParabola {
  double a, b0, b1, c0, c1, c2;
  double blur;  ///< of the discriminant, in the spread
};

/// The intervals of a row: where they are and their ends.
struct RowIntervals {
  const double* x;
  const double* lo;
  const double* hi;
  std::uint32_t count;  ///< a multiple of kLanes
};

template <bool kWithSpread>
inline __attribute__((always_inline)) void sum_block(const double* __restrict x, const double* __restrict lo,
                                                     const double* __restrict hi, const RowParabola& p,
                                                     double (*__restrict sums)[kLanes], double (*__restrict ends)[kLanes]) {
  for (std::uint32_t l = 0; l < kLanes; ++l) {
    const double b = p.b0 + p.b1 * x[l];
    const double c = p.c0 + x[l] * (p.c1 + p.c2 * x[l]);
    const double discriminant = b * b - 4 * p.a * c;
    const bool real = discriminant > 0;
    const double root = std::sqrt(real ? discriminant : 1.0);
    const double t = -0.5 * (b + std::copysign(root, b));
    const double r1 = t / p.a;
    const double r2 = c / t;
    const double z0 = real ? std::min(r1, r2) : lo[l];
    const double z1 = real ? std::max(r1, r2) : lo[l];
    const double u0 = std::min(std::max(z0, lo[l]), hi[l]);
    const double u1 = std::min(std::max(z1, lo[l]), hi[l]);
    const double i0 = u1 - u0;
    const double i1 = 0.5 * i0 * (u0 + u1);
    const double i2 = i0 * (u0 * u0 + u0 * u1 + u1 * u1) * (1.0 / 3);
    sums[0][l] += i0;
    sums[1][l] += x[l] * i0;
    sums[2][l] += x[l] * (x[l] * i0);
    sums[3][l] += i1;
    sums[4][l] += x[l] * i1;
    sums[5][l] += i2;
    if constexpr (kWithSpread) {
      // d(length)/d(discriminant) is 1 / (2 a root), or its mean over the blur.
      const double above = discriminant + p.blur;
      const double below = discriminant - p.blur;
      const double root_above = std::sqrt(above > 0 ? above : 0.0);
      const double root_below = std::sqrt(below > 0 ? below : 0.0);
      // (root_above - root_below) / blur, without the cancellation.
      const double w = above > 0 ? (below > 0 ? 2.0 : above / p.blur) / (root_above + root_below) : 0.0;
      const double e0 = real ? z0 : -0.5 * b / p.a;
      const double e1 = real ? z1 : e0;
      double w0 = e0 > lo[l] && e0 < hi[l] ? w : 0.0;
      double w1 = e1 > lo[l] && e1 < hi[l] ? w : 0.0;
      double v0 = std::min(std::max(e0, lo[l]), hi[l]);
      double v1 = std::min(std::max(e1, lo[l]), hi[l]);
      const double x1 = x[l];
      const double x2 = x1 * x1;
      const double power_of_x[5] = {1, x1, x2, x2 * x1, x2 * x2};
      int k = 0;
      for (int by_z = 0; by_z <= 4; ++by_z) {
        const double both = w0 + w1;
        for (int by_x = 0; by_x <= 4 - by_z; ++by_x) ends[k++][l] += both * power_of_x[by_x];
        w0 *= v0;
        w1 *= v1;
      }
    }
  }
}

double lane_sum(const double (&lanes)[kLanes]) {
  return ((lanes[0] + lanes[4]) + (lanes[1] + lanes[5])) + ((lanes[2] + lanes[6]) + (lanes[3] + lanes[7]));
}

/// The row's sums.
RAYREP_CLONES void sum_row(const RowIntervals& row, const RowParabola& p, double* result) {
  double sums[kRowSums][kLanes] = {};
  for (std::uint32_t n = 0; n < row.count; n += kLanes) sum_block<false>(row.x + n, row.lo + n, row.hi + n, p, sums, nullptr);
  for (int k = 0; k < kRowSums; ++k) result[k] = lane_sum(sums[k]);
}

/// The row's sums, then those of its free ends.
RAYREP_CLONES void sum_row_and_ends(const RowIntervals& row, const RowParabola& p, double* result) {
  double sums[kRowSums][kLanes] = {};
  double ends[kEndSums][kLanes] = {};
  for (std::uint32_t n = 0; n < row.count; n += kLanes) sum_block<true>(row.x + n, row.lo + n, row.hi + n, p, sums, ends);
  for (int k = 0; k < kRowSums; ++k) result[k] = lane_sum(sums[k]);
  for (int k = 0; k < kEndSums; ++k) result[kRowSums + k] = lane_sum(ends[k]);
}

/// Exponents of x, y, z in phi.
constexpr int kPowers[10][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {2, 0, 0},
                                {0, 2, 0}, {0, 0, 2}, {1, 1, 0}, {0, 1, 1}, {1, 0, 1}};

/// Place of x^a z^b among the sums of free ends.
constexpr int end_sum(int a, int b) { return b * 5 - b * (b - 1) / 2 + a; }

}  // namespace

RayIntegrals::RayIntegrals(const RayRep& domain)
    : grid_(domain.grid), area_(domain.grid.weighted_area_mm2()), intervals_(domain.intervals.size()) {
  const auto nx = static_cast<std::size_t>(domain.grid.nx);
  double largest = 0;
  for (std::size_t ray = 0; ray < domain.grid.size(); ++ray)
    for (std::uint32_t n = domain.first[ray]; n < domain.first[ray + 1]; ++n)
      largest = std::max(
          {largest, domain.grid.at(ray).cwiseAbs().maxCoeff(), std::abs(domain.intervals[n].lo), std::abs(domain.intervals[n].hi)});
  if (largest > 0) length_ = largest;
  for (int k = 0; k < 10; ++k) unit_[k] = area_ * length_ * std::pow(length_, kPowers[k][0] + kPowers[k][1] + kPowers[k][2]);

  x_.reserve(intervals_);
  lo_.reserve(intervals_);
  hi_.reserve(intervals_);
  for (int j = 0; j < domain.grid.ny; ++j) {
    const std::size_t ray = static_cast<std::size_t>(j) * nx;
    const auto first = static_cast<std::uint32_t>(x_.size());
    for (std::size_t r = ray; r < ray + nx; ++r)
      for (std::uint32_t n = domain.first[r]; n < domain.first[r + 1]; ++n) {
        x_.push_back(domain.grid.at(r).x() / length_);
        lo_.push_back(domain.intervals[n].lo / length_);
        hi_.push_back(domain.intervals[n].hi / length_);
      }
    if (x_.size() == first) continue;
    while (x_.size() % kLanes != 0) {
      x_.push_back(0);
      lo_.push_back(0);
      hi_.push_back(0);
    }
    if (chunks_.empty() || first - rows_[chunks_.back()].first >= kChunk)
      chunks_.push_back(static_cast<std::uint32_t>(rows_.size()));
    rows_.push_back({domain.grid.at(ray).y() / length_, first, static_cast<std::uint32_t>(x_.size())});
  }
  chunks_.push_back(static_cast<std::uint32_t>(rows_.size()));
  full_ = ray_moments(domain);
}

template <bool kWithSpread>
RayIntegrals::Pass RayIntegrals::sum(const Moments& q, double blur) const {
  Pass pass;
  if (rows_.empty()) return pass;
  Moments scaled = q.cwiseProduct(unit_);
  const double size = scaled.cwiseAbs().maxCoeff();
  assert(size > 0 && std::isfinite(size));
  scaled /= size;
  // Where the parabolas open downward, the void is what lies between the roots.
  const bool between_is_void = scaled[MZZ] < 0;
  if (between_is_void) scaled = -scaled;
  // A parabola that is a line, or constant, has its other root, or both, far away.
  const double a = std::max(scaled[MZZ], 1e-60);

  // Over y: x^a y^b z^c is the row's sum of x^a z^c times y^b, in a chunk summed over its rows.
  struct Sums {
    Moments moments = Moments::Zero();
    double ends[kEndSums][5] = {};  ///< by x^a z^c, then by the power of y
  };
  std::vector<Sums> parts(chunks_.size() - 1);
  tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t chunk) {
    Sums& part = parts[chunk];
    for (std::uint32_t r = chunks_[chunk]; r < chunks_[chunk + 1]; ++r) {
      const Row& row = rows_[r];
      const double y = row.y;
      const RowParabola p{a,
                          scaled[MZ] + y * scaled[MYZ],
                          scaled[MXZ],
                          scaled[M1] + y * (scaled[MY] + y * scaled[MYY]),
                          scaled[MX] + y * scaled[MXY],
                          scaled[MXX],
                          a > 1e-60 ? std::max(blur, 1e-14) : 0.0};
      double s[kRowSums + kEndSums];
      const RowIntervals intervals{&x_[row.first], &lo_[row.first], &hi_[row.first], row.last - row.first};
      if constexpr (kWithSpread)
        sum_row_and_ends(intervals, p, s);
      else
        sum_row(intervals, p, s);
      Moments m;
      m << s[0], s[1], y * s[0], s[3], s[2], y * y * s[0], s[5], y * s[1], y * s[3], s[4];
      part.moments += m;
      if constexpr (kWithSpread)
        for (int by_z = 0; by_z <= 4; ++by_z)
          for (int by_x = 0; by_x <= 4 - by_z; ++by_x) {
            const int k = end_sum(by_x, by_z);
            double value = s[kRowSums + k];
            for (int by_y = 0; by_y <= 4 - by_z - by_x; ++by_y, value *= y) part.ends[k][by_y] += value;
          }
    }
  });
  Sums total;
  for (const Sums& part : parts) {
    total.moments += part.moments;
    if constexpr (kWithSpread)
      for (int k = 0; k < kEndSums; ++k)
        for (int by_y = 0; by_y < 5; ++by_y) total.ends[k][by_y] += part.ends[k][by_y];
  }
  pass.moments = total.moments.cwiseProduct(unit_);
  if (between_is_void) pass.moments = full_ - pass.moments;
  if constexpr (kWithSpread)
    for (int i = 0; i < 10; ++i)
      for (int j = 0; j < 10; ++j)
        pass.spread(i, j) =
            total.ends[end_sum(kPowers[i][0] + kPowers[j][0], kPowers[i][2] + kPowers[j][2])][kPowers[i][1] + kPowers[j][1]] *
            (unit_[i] * unit_[j] / size);
  return pass;
}

RayIntegrals::Pass RayIntegrals::pass(const Moments& q, double blur) const { return sum<true>(q, blur); }

RayIntegrals::Priced RayIntegrals::priced(const Moments& q, double price, double blur) const {
  Priced result{pass(q, blur)};
  if (price == 0) {
    result.filled_mm3 = result.pass.moments[M1] / grid_.weight;
    return result;
  }
  Moments dear = q;
  dear[M1] += price;
  const Pass filled = pass(dear, blur);
  const double more = 1 - grid_.substitute;
  result.pass.moments = grid_.substitute * result.pass.moments + more * filled.moments;
  result.pass.spread = grid_.substitute * result.pass.spread + more * filled.spread;
  result.filled_mm3 = filled.moments[M1] / grid_.weight;
  result.cost = price * more * filled.moments[M1];
  return result;
}

double RayIntegrals::least(const Moments& q, double price) const {
  const Priced best = priced(q, price);
  const double allowed = price > 0 ? price * (1 - grid_.substitute) * grid_.weight * grid_.most_mm3 : 0;
  return q.dot(best.pass.moments) + best.cost - allowed;
}

Moments RayIntegrals::moments(const Moments& q) const { return sum<false>(q, 0).moments; }

}  // namespace rayrep
