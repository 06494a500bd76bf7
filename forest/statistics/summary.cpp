// SPDX-License-Identifier: Apache-2.0
// Sums run in eight lanes, which the compiler makes vectors of; so a sum is the same on every processor.
#include "forest/statistics/summary.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "forest/core/clones.h"

namespace forest::statistics {
namespace {

constexpr std::size_t lanes = 8;
constexpr double nan = std::numeric_limits<double>::quiet_NaN(),
                 infinity = std::numeric_limits<double>::infinity();

struct Sums {
  std::array<double, lanes> sum{}, count{};

  double total() const { return fold(sum); }
  double counted() const { return fold(count); }
  static double fold(std::array<double, lanes> s) {
    for (std::size_t half = lanes / 2; half > 0; half /= 2)
      for (std::size_t l = 0; l < half; ++l) s[l] += s[l + half];
    return s[0];
  }
};

FOREST_CLONES void add_defined(const double* values, std::size_t count, Sums& sums) {
  Sums s = sums;
  for (std::size_t i = 0; i < count; i += lanes) FOREST_LANES for (std::size_t l = 0; l < lanes; ++l) {
      const double x = values[i + l];
      s.sum[l] += x == x ? x : 0.;
      s.count[l] += x == x ? 1. : 0.;
    }
  sums = s;
}

FOREST_CLONES void add_squares(const double* values, std::size_t count, double mean, Sums& sums) {
  Sums s = sums;
  for (std::size_t i = 0; i < count; i += lanes) FOREST_LANES for (std::size_t l = 0; l < lanes; ++l) {
      const double x = values[i + l] - mean;
      s.sum[l] += x == x ? x * x : 0.;
    }
  sums = s;
}

/// Of whole groups of lanes, and of the rest with NaN behind it.
template <class Add>
Sums over(std::span<const double> values, Add add) {
  Sums sums;
  const std::size_t whole = values.size() - values.size() % lanes;
  add(values.data(), whole, sums);
  std::array<double, lanes> rest;
  rest.fill(nan);
  std::ranges::copy(values.subspan(whole), rest.begin());
  add(rest.data(), lanes, sums);
  return sums;
}

/// The value of this rank, from 0; reorders them. Of many, only those are looked at that lie where the rank falls when they
/// are counted in even bins.
double ranked(std::vector<double>& values, std::size_t rank, double low, double high) {
  constexpr std::size_t bins = 512;
  const double scale = double(bins) / (high - low);
  const auto at = [&](std::size_t r) { return values.begin() + std::ptrdiff_t(r); };
  if (values.size() < 2 * bins || !(high > low) || !(scale > 0.) || !std::isfinite(scale)) {
    std::ranges::nth_element(values, at(rank));
    return *at(rank);
  }
  std::array<std::uint32_t, bins + 1> counts{};  // the last for the greatest value
  for (const double x : values) ++counts[std::size_t((x - low) * scale)];
  std::size_t bin = 0, before = 0;
  while (before + counts[bin] <= rank) before += counts[bin++];
  std::vector<double> here;
  here.reserve(counts[bin]);
  for (const double x : values)
    if (std::size_t((x - low) * scale) == bin) here.push_back(x);
  const auto place = here.begin() + std::ptrdiff_t(rank - before);
  std::ranges::nth_element(here, place);
  return *place;
}

}  // namespace

Moments moments(std::span<const double> values) {
  const Sums sums = over(values, add_defined);
  const auto n = std::size_t(sums.counted());
  if (n == 0) return {0, nan, nan};
  const double mean = sums.total() / double(n);
  const double squares = over(values, [&](const double* v, std::size_t count, Sums& s) {
                           add_squares(v, count, mean, s);
                         }).total();
  return {n, mean, n > 1 ? std::sqrt(squares / double(n - 1)) : 0.};
}

Summary summarize(std::span<const double> values) {
  const auto [n, mean, sd] = moments(values);
  if (n == 0) return {0, nan, nan, nan, nan, nan};

  std::vector<double> defined;
  defined.reserve(n);
  double low = infinity, high = -infinity;
  for (const double x : values) {
    if (std::isnan(x)) continue;
    defined.push_back(x);
    low = std::min(low, x), high = std::max(high, x);
  }
  double median = ranked(defined, n / 2, low, high);
  if (n % 2 == 0) median = 0.5 * (median + ranked(defined, n / 2 - 1, low, high));
  return {.count = n, .mean = mean, .sd = sd, .min = low, .median = median, .max = high};
}

double mean(std::span<const double> values) {
  const Sums sums = over(values, add_defined);
  const double count = sums.counted();
  return count > 0. ? sums.total() / count : nan;
}

}  // namespace forest::statistics
