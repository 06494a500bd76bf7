// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/typical.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "forest/core/error.h"
#include "forest/statistics/sample_distance.h"
#include "forest/statistics/two_samples.h"

namespace forest::statistics {
namespace {

constexpr std::size_t neighbours = 5;

/// Share of all cells, the last one included, that score as high as the last.
double conformal_p(std::span<const double> scores) {
  const double own = scores.back();
  const auto as_high = std::ranges::count_if(scores, [&](double s) { return s >= own * (1. - 1e-12); });
  return double(as_high) / double(scores.size());
}

/// Which of the values lie outside the range of all others: the first and the last, unless another has the same.
std::vector<std::size_t> outermost(std::span<const double> values) {
  const auto [low, high] = std::ranges::minmax_element(values);
  std::vector<std::size_t> out;
  for (const auto at : {low, high})
    if (std::ranges::count(values, *at) == 1) out.push_back(std::size_t(at - values.begin()));
  return out;
}

bool same_cell(const FeatureTable& a, Eigen::Index row, const FeatureTable& b) {
  for (Eigen::Index c = 0; c < a.values.cols(); ++c) {
    const double x = a.values(row, c), y = b.values(0, c);
    if (x != y && !(std::isnan(x) && std::isnan(y))) return false;
  }
  return true;
}

}  // namespace

Typicality typicality(const FeatureTable& population, const FeatureTable& cell) {
  if (population.features != cell.features) throw Error("the cell was not measured as the population was");
  std::vector<std::size_t> others;
  for (std::size_t i = 0; i < population.size(); ++i)
    if (!same_cell(population, Eigen::Index(i), cell)) others.push_back(i);
  if (others.size() < 5)
    throw Error("a population of fewer than five other cells does not say what is typical; add cells");
  const std::array<FeatureTable, 2> both{rows_of(population, others), cell};
  const FeatureTable table = completed(stacked(both));
  const Eigen::Index n = table.values.rows(), last = n - 1;

  Typicality out;
  out.cells = others.size();
  const Eigen::MatrixXd X = standardised(table), D = distances(X, X);
  std::vector<double> whole;
  for (Eigen::Index i = 0; i < n; ++i) {
    std::vector<double> from(D.col(i).data(), D.col(i).data() + n);
    from.erase(from.begin() + i);
    const auto k = std::ptrdiff_t(std::min(neighbours, from.size()));
    std::partial_sort(from.begin(), from.begin() + k, from.end());
    double sum = 0.;
    for (auto d = from.begin(); d != from.begin() + k; ++d) sum += *d;
    whole.push_back(sum);
  }
  out.p_whole = conformal_p(whole);

  // Metric by metric, beside the cells that have it: a value that was filled in says nothing of how far values go.
  const FeatureTable raw = stacked(both);
  std::vector<double> strangest(std::size_t(n), 0.), outside(std::size_t(last), 0.);
  for (Eigen::Index c = 0; c < table.values.cols(); ++c) {
    const auto same = std::ranges::find(raw.features, table.features[std::size_t(c)]) - raw.features.begin();
    const auto& column = same < raw.values.cols() ? raw.values.col(same) : table.values.col(c);
    std::vector<Eigen::Index> having;
    std::vector<double> values;
    for (Eigen::Index i = 0; i < n; ++i)
      if (std::isfinite(column[i])) having.push_back(i), values.push_back(column[i]);
    const bool asked = !having.empty() && having.back() == last;
    if (values.size() < 5u + asked) continue;
    const double middle = quantile(values, .5);
    std::vector<double> away;
    for (const double x : values) away.push_back(std::abs(x - middle));
    const double edge = quantile(away, .95);
    const auto strangeness = [&](double x) {
      if (x <= 0.) return 0.;
      if (edge > 0.) return x / edge;
      return .05 * double(away.size()) /
             double(std::ranges::count_if(away, [&](double other) { return other >= x; }));
    };
    for (std::size_t k = 0; k < having.size(); ++k) {
      double& most = strangest[std::size_t(having[k])];
      most = std::max(most, strangeness(away[k]));
    }
    if (!asked) continue;
    const auto known = std::span(values).first(values.size() - 1);
    const auto [lowest, highest] = std::ranges::minmax(known);
    out.oddities.push_back({.feature = table.features[std::size_t(c)],
                            .value = values.back(),
                            .median = quantile(known, .5),
                            .low = quantile(known, .05),
                            .high = quantile(known, .95),
                            .strangeness = strangeness(away.back()),
                            .p = conformal_p(away),
                            .outside = values.back() < lowest || values.back() > highest});
    if (same == raw.values.cols()) continue;  // "… is defined" is no metric
    ++out.metrics;
    out.outside += out.oddities.back().outside;
    for (const std::size_t k : outermost(known)) ++outside[std::size_t(having[k])];
  }
  out.p_feature = conformal_p(strangest);
  out.outside_usual = quantile(outside, .5);
  out.outside_most = std::size_t(std::ranges::max(outside));
  out.as_much_outside = std::size_t(
      std::ranges::count_if(outside, [&](double metrics) { return metrics >= double(out.outside); }));
  std::vector<double> missing;
  for (Eigen::Index i = 0; i < n; ++i) missing.push_back(double(raw.values.row(i).array().isNaN().count()));
  out.p_missing = conformal_p(missing);
  out.p = std::min(1., 3. * std::min({out.p_whole, out.p_feature, out.p_missing}));
  const double usual = quantile(std::span(strangest).first(std::size_t(last)), .95);
  for (Oddity& o : out.oddities) o.abnormal = o.strangeness > usual;
  std::ranges::stable_sort(out.oddities, std::greater(), &Oddity::strangeness);
  return out;
}

}  // namespace forest::statistics
