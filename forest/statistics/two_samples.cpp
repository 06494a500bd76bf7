// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/two_samples.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "forest/statistics/summary.h"

namespace forest::statistics {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double most_pairs = 1e6;  // of an exact p, which takes their number in steps

std::vector<double> sorted(std::span<const double> values) {
  std::vector<double> v;
  std::ranges::copy_if(values, std::back_inserter(v), [](double x) { return !std::isnan(x); });
  std::ranges::sort(v);
  return v;
}

double quantile_of(std::span<const double> sorted, double share) {
  if (sorted.empty()) return nan;
  const double at = share * double(sorted.size() - 1);
  const auto low = std::size_t(at);
  const std::size_t high = std::min(low + 1, sorted.size() - 1);
  return sorted[low] + (at - double(low)) * (sorted[high] - sorted[low]);
}

// Chance that a random walk from (0, 0) to (m, n), each step one value of a or b in the order of size, is at least as far
// from the diagonal as `d` where a run of equal values ends. Of all walks, those that have not been so far yet when they
// pass (i, j) are followed back: exceeded(i, j) = share of walks from (0, 0) to (i, j) that were.
double exact_p(const std::vector<double>& a, const std::vector<double>& b, double d) {
  const std::size_t m = a.size(), n = b.size();
  std::vector<double> pooled(m + n);
  std::ranges::merge(a, b, pooled.begin());
  std::vector<bool> ends(m + n + 1, true);  // after k values: the next one is larger
  for (std::size_t k = 1; k < m + n; ++k) ends[k] = pooled[k - 1] != pooled[k];
  const double limit = d - 1e-9 / double(std::max(m, n));
  const auto far = [&](std::size_t i, std::size_t j) {
    return ends[i + j] && std::abs(double(i) / double(m) - double(j) / double(n)) >= limit;
  };
  std::vector<double> exceeded(n + 1, 0.);
  for (std::size_t j = 1; j <= n; ++j) exceeded[j] = far(0, j) ? 1. : exceeded[j - 1];
  for (std::size_t i = 1; i <= m; ++i) {
    if (far(i, 0)) exceeded[0] = 1.;
    for (std::size_t j = 1; j <= n; ++j)
      exceeded[j] = far(i, j) ? 1. : (double(i) * exceeded[j] + double(j) * exceeded[j - 1]) / double(i + j);
  }
  return std::min(1., exceeded[n]);
}

double limit_p(double d, double m, double n) {
  const double root = std::sqrt(m * n / (m + n)), t = (root + .12 + .11 / root) * d;
  double sum = 0., sign = 1.;
  for (int k = 1; k <= 100; ++k, sign = -sign) {
    const double term = std::exp(-2. * k * k * t * t);
    sum += sign * term;
    if (term < 1e-16) return std::clamp(2. * sum, 0., 1.);
  }
  return 1.;  // the series does not settle where the distance is next to nothing
}

// For each value of `of` the share of `against` that lies below it, ties half.
std::vector<double> placements(const std::vector<double>& of, const std::vector<double>& against) {
  std::vector<double> shares;
  for (const double x : of) {
    const auto [low, high] = std::ranges::equal_range(against, x);
    shares.push_back((double(low - against.begin()) + .5 * double(high - low)) / double(against.size()));
  }
  return shares;
}

double variance(std::span<const double> values) {
  const double sd = summarize(values).sd;
  return sd * sd;
}

}  // namespace

KolmogorovSmirnov kolmogorov_smirnov(std::span<const double> first, std::span<const double> second) {
  const std::vector<double> a = sorted(first), b = sorted(second);
  if (a.empty() || b.empty()) return {nan, 1., false};
  double d = 0.;
  for (std::size_t i = 0, j = 0; i < a.size() && j < b.size();) {
    const double x = std::min(a[i], b[j]);
    while (i < a.size() && a[i] == x) ++i;
    while (j < b.size() && b[j] == x) ++j;
    d = std::max(d, std::abs(double(i) / double(a.size()) - double(j) / double(b.size())));
  }
  if (d == 0.) return {0., 1., true};
  const double m = double(a.size()), n = double(b.size());
  const bool exact = m * n <= most_pairs;
  return {d, exact ? exact_p(a, b, d) : limit_p(d, m, n), exact};
}

std::vector<double> holm(std::span<const double> p) {
  std::vector<std::size_t> order(p.size());
  std::iota(order.begin(), order.end(), std::size_t(0));
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return p[i]; });
  std::vector<double> adjusted(p.size());
  double so_far = 0.;
  for (std::size_t k = 0; k < order.size(); ++k) {
    so_far = std::max(so_far, std::min(1., double(p.size() - k) * p[order[k]]));
    adjusted[order[k]] = so_far;
  }
  return adjusted;
}

double cohens_d(std::span<const double> a, std::span<const double> b) {
  const Summary s = summarize(a), t = summarize(b);
  const double freedom = double(s.count) + double(t.count) - 2.;
  if (s.count == 0 || t.count == 0 || freedom <= 0.) return nan;
  const double pooled = (double(s.count - 1) * s.sd * s.sd + double(t.count - 1) * t.sd * t.sd) / freedom;
  return s.mean == t.mean ? 0. : (t.mean - s.mean) / std::sqrt(pooled);
}

double area_variance(double area, double n_first, double n_second) {
  const double q1 = area / (2. - area), q2 = 2. * area * area / (1. + area), square = area * area;
  return (area * (1. - area) + (n_first - 1.) * (q1 - square) + (n_second - 1.) * (q2 - square)) /
         (n_first * n_second);
}

Estimate area_interval(double area, std::span<const double> first, std::span<const double> second,
                       double n_first, double n_second, double learned) {
  const double least = .5 / std::max(2., std::min(n_first, n_second));
  const double inside = std::clamp(area, least, 1. - least);
  const double floor = area_variance(inside, n_first, n_second);
  const double delong = variance(first) / n_first + variance(second) / n_second;
  constexpr double few = 8.;  // of so few the variance is no measure; of one it is none
  const double spread =
      std::max(area == inside && std::min(n_first, n_second) >= few ? delong : std::max(delong, floor),
               learned * floor);
  const double logit = std::log(inside / (1. - inside));
  const double reach = 1.959964 * std::sqrt(spread) / (inside * (1. - inside));
  const auto back = [](double x) { return 1. / (1. + std::exp(-x)); };
  return {area, std::min(area, back(logit - reach)), std::max(area, back(logit + reach))};
}

Estimate area_under_curve(std::span<const double> first, std::span<const double> second) {
  const std::vector<double> a = sorted(first), b = sorted(second);
  if (a.empty() || b.empty()) return {nan, nan, nan};
  const std::vector<double> of_b = placements(b, a), of_a = placements(a, b);
  return area_interval(mean(of_b), of_a, of_b, double(a.size()), double(b.size()));
}

Estimate cliffs_delta(std::span<const double> a, std::span<const double> b) {
  const Estimate area = area_under_curve(a, b);
  return {2. * area.value - 1., 2. * area.lower - 1., 2. * area.upper - 1.};
}

double median_visible_spread_of_sorted(std::span<const double> a, std::span<const double> b) {
  const double apart = std::abs(quantile_of(a, .5) - quantile_of(b, .5));
  const double spread =
      std::max(quantile_of(a, .95), quantile_of(b, .95)) - std::min(quantile_of(a, .05), quantile_of(b, .05));
  return apart == 0. ? 0. : apart / spread;
}

double median_visible_spread(std::span<const double> a, std::span<const double> b) {
  return median_visible_spread_of_sorted(sorted(a), sorted(b));
}

double quantile(std::span<const double> values, double share) { return quantile_of(sorted(values), share); }

}  // namespace forest::statistics
