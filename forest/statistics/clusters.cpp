// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/clusters.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numeric>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/parallel.h"
#include "forest/core/random.h"
#include "forest/statistics/projection.h"
#include "forest/statistics/sample_distance.h"
#include "forest/statistics/summary.h"

namespace forest::statistics {
namespace {

using Matrix = Eigen::MatrixXd;
using Ids = std::vector<std::uint32_t>;
constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr std::size_t references = 99, redeals = 20, sensible = 40;  // … types that are tried

struct Medoids {
  Ids medoids, type;
};

/// BUILD, then SWAP until nothing is gained.
Medoids divide(const Matrix& D, std::size_t k) {
  const auto n = std::uint32_t(D.rows());
  Ids medoids;
  std::vector<double> nearest(n, infinity);
  const auto cost_with = [&](std::uint32_t m) {
    double cost = 0.;
    for (std::uint32_t i = 0; i < n; ++i) cost += std::min(nearest[i], D(i, m));
    return cost;
  };
  while (medoids.size() < std::min<std::size_t>(k, n)) {
    std::uint32_t best = 0;
    double least = infinity;
    for (std::uint32_t m = 0; m < n; ++m)
      if (const double cost = cost_with(m); cost < least && !std::ranges::count(medoids, m))
        least = cost, best = m;
    medoids.push_back(best);
    for (std::uint32_t i = 0; i < n; ++i) nearest[i] = std::min(nearest[i], D(i, best));
  }
  double cost = std::accumulate(nearest.begin(), nearest.end(), 0.);
  for (int round = 0; round < 100; ++round) {
    double least = cost;
    std::size_t out = 0;
    std::uint32_t in = 0;
    for (std::size_t s = 0; s < medoids.size(); ++s) {
      std::ranges::fill(nearest, infinity);  // without this one
      for (std::size_t o = 0; o < medoids.size(); ++o)
        if (o != s)
          for (std::uint32_t i = 0; i < n; ++i) nearest[i] = std::min(nearest[i], D(i, medoids[o]));
      for (std::uint32_t m = 0; m < n; ++m)
        if (const double c = cost_with(m); c < least * (1. - 1e-12)) least = c, out = s, in = m;
    }
    if (least >= cost) break;
    medoids[out] = in, cost = least;
  }
  Medoids result{medoids, Ids(n, 0)};
  for (std::uint32_t i = 0; i < n; ++i)
    for (std::uint32_t s = 1; s < medoids.size(); ++s)
      if (D(i, medoids[s]) < D(i, medoids[result.type[i]])) result.type[i] = s;
  return result;
}

double silhouette(const Matrix& D, const Ids& type, std::size_t k) {
  if (k < 2) return 0.;
  std::vector<double> counts(k, 0.);
  for (const std::uint32_t t : type) ++counts[t];
  double sum = 0.;
  for (std::size_t i = 0; i < type.size(); ++i) {
    std::vector<double> to(k, 0.);
    for (std::size_t j = 0; j < type.size(); ++j) to[type[j]] += D(Eigen::Index(i), Eigen::Index(j));
    if (counts[type[i]] < 2.) continue;  // alone: 0
    const double own = to[type[i]] / (counts[type[i]] - 1.);
    double other = infinity;
    for (std::size_t t = 0; t < k; ++t)
      if (t != type[i] && counts[t] > 0.) other = std::min(other, to[t] / counts[t]);
    if (std::max(own, other) > 0.) sum += (other - own) / std::max(own, other);
  }
  return sum / double(type.size());
}

void largest_first(Medoids& m) {
  std::vector<std::size_t> counts(m.medoids.size(), 0);
  for (const std::uint32_t t : m.type) ++counts[t];
  Ids order(m.medoids.size()), place(m.medoids.size()), medoids;
  std::iota(order.begin(), order.end(), 0u);
  std::ranges::stable_sort(order, std::greater(), [&](std::uint32_t t) { return counts[t]; });
  for (std::uint32_t i = 0; i < order.size(); ++i)
    place[order[i]] = i, medoids.push_back(m.medoids[order[i]]);
  for (std::uint32_t& t : m.type) t = place[t];
  m.medoids = std::move(medoids);
}

// @param table  completed; what was filled in counts for nothing here
// @param known  as measured
std::vector<Trait> traits_of(const FeatureTable& table, const FeatureTable& known, const Ids& type,
                             std::uint32_t which) {
  std::vector<Trait> all;
  const auto values_of = [&](Eigen::Index c, bool inside) {
    const auto same =
        std::ranges::find(known.features, table.features[std::size_t(c)]) - known.features.begin();
    const auto& column = same < known.values.cols() ? known.values.col(same) : table.values.col(c);
    std::vector<double> values;
    for (std::size_t i = 0; i < type.size(); ++i)
      if (const double x = column[Eigen::Index(i)]; (type[i] == which) == inside && std::isfinite(x))
        values.push_back(x);
    return values;
  };
  for (Eigen::Index c = 0; c < table.values.cols(); ++c) {
    const std::vector<double> in = values_of(c, true), out = values_of(c, false);
    if (in.empty() || out.empty()) {  // that it is defined in one only is a feature of its own
      all.push_back({table.features[std::size_t(c)], {0., 0., 0.}});
      continue;
    }
    all.push_back({table.features[std::size_t(c)], cliffs_delta(out, in), mean(in), mean(out)});
  }
  std::vector<std::size_t> order;
  for (std::size_t c = 0; c < all.size(); ++c)
    if (std::abs(all[c].delta.value) >= .33) order.push_back(c);  // a medium effect at least; no NaN
  std::ranges::stable_sort(order, std::greater(),
                           [&](std::size_t c) { return std::abs(all[c].delta.value); });
  std::vector<Trait> chosen;
  for (const std::size_t c : unlike(table, order, 8)) chosen.push_back(all[c]);
  return chosen;
}

}  // namespace

double adjusted_rand(std::span<const std::uint32_t> a, std::span<const std::uint32_t> b) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, double> cells;
  std::map<std::uint32_t, double> rows, columns;
  for (std::size_t i = 0; i < a.size(); ++i) ++cells[{a[i], b[i]}], ++rows[a[i]], ++columns[b[i]];
  const auto pairs = [](const auto& counts) {
    double sum = 0.;
    for (const auto& [key, n] : counts) sum += n * (n - 1.) / 2.;
    return sum;
  };
  const double n = double(a.size()), all = n * (n - 1.) / 2.;
  const double together = pairs(cells), of_rows = pairs(rows), of_columns = pairs(columns);
  const double expected = all > 0. ? of_rows * of_columns / all : 0., most = .5 * (of_rows + of_columns);
  return most == expected ? 1. : (together - expected) / (most - expected);
}

Types find_types(const FeatureTable& table, const TypesOptions& options, Progress& progress) {
  const std::size_t n = table.size();
  if (n < 6 || n > 1500)
    throw Error(fmt::format("types are sought among 6 to 1500 cells, not {}; choose others", n));
  if (options.types && (*options.types == 0 || *options.types > n / 2))
    throw Error(
        fmt::format("{} cells cannot be divided into {} types; ask for 1 to {}", n, *options.types, n / 2));
  const FeatureTable full = completed(table);
  if (full.features.empty())
    throw Error(fmt::format(
        "the {} cells are the same in every metric, so there are no types; are they copies of one?", n));
  // No cell counts for more than three standard deviations in any feature: a single odd value makes no type.
  const Matrix X = standardised(full).cwiseMax(-3.).cwiseMin(3.);
  const Projection projection = principal_components(X.rowwise() - X.colwise().mean(), .8, 10);
  Types out{.divisions = {},
            .chosen = 0,
            .traits = {},
            .components = projection.scores,
            .shares = projection.shares};
  const Matrix D = distances(out.components, out.components);
  // Divisions into up to `most` types, and what one cloud of as many cells gives, as long in each component.
  std::vector<std::vector<double>> reference(references, std::vector<double>(1, 0.));
  const auto divide_into = [&](std::size_t most) {
    const std::size_t done = out.divisions.size();
    progress.begin("finding types", references + most - done);
    parallel_for(references, 1, [&](std::size_t r) {
      Random random(options.seed, r, 0x636c6f75);  // "clou"
      Matrix cloud = out.components;
      for (Eigen::Index c = 0; c < cloud.cols(); ++c) {
        const double sd = out.components.col(c).norm() / std::sqrt(double(n - 1));
        for (double& x : cloud.col(c)) x = random.normal(0., sd);
      }
      const Matrix C = distances(cloud, cloud);
      for (std::size_t k = reference[r].size() + 1; k <= most; ++k)
        reference[r].push_back(silhouette(C, divide(C, k).type, k));
      progress.advance();
    });
    out.divisions.resize(most);
    parallel_for(most - done, 1, [&](std::size_t i) {
      const std::size_t at = done + i, k = at + 1;
      Medoids m = divide(D, k);
      largest_first(m);
      std::vector<double> by_chance;
      for (const auto& r : reference) by_chance.push_back(r[at]);
      double agreement = 0.;
      for (std::size_t r = 0; k > 1 && r < redeals; ++r) {
        Random random(options.seed, r * 64 + k, 0x72616e64);
        std::vector<Eigen::Index> rows(n);
        std::iota(rows.begin(), rows.end(), Eigen::Index(0));
        for (std::uint32_t c = 0; c < n; ++c)
          std::swap(rows[c], rows[c + random.below(std::uint32_t(n) - c)]);
        rows.resize(n * 4 / 5);
        const Medoids again = divide(D(rows, rows), k);
        Ids before;
        for (const Eigen::Index row : rows) before.push_back(m.type[std::size_t(row)]);
        agreement += adjusted_rand(before, again.type) / double(redeals);
      }
      out.divisions[at] = {.types = k,
                           .type = m.type,
                           .medoids = m.medoids,
                           .silhouette = silhouette(D, m.type, k),
                           .by_chance = quantile(by_chance, .95),
                           .stability = k > 1 ? agreement : 1.};
      progress.advance();
    });
    progress.end();
  };
  std::size_t most = std::max({std::size_t(1), options.types.value_or(0), std::min(options.most, n / 3)}),
              top = 0;
  for (;;) {
    divide_into(most);
    for (std::size_t at = 1; at < most; ++at)
      if (top == 0 || out.divisions[at].silhouette > out.divisions[top].silhouette) top = at;
    const std::size_t more = std::min({2 * most, n / 3, sensible});
    if (options.types || 2 * (top + 1) <= most || more <= most) break;
    most = more;  // a better one may lie beyond
  }

  // The highest silhouette, if one cloud hardly ever has as high a one for any number of types.
  const auto as_high = std::ranges::count_if(
      reference, [&](const auto& r) { return std::ranges::max(r) >= out.divisions[top].silhouette; });
  out.p = (double(as_high) + 1.) / (double(references) + 1.);
  out.chosen = out.p <= .05 ? top : 0;
  if (options.types) out.chosen = *options.types - 1;
  if (out.division().types > 1)
    for (std::uint32_t t = 0; t < out.division().types; ++t)
      out.traits.push_back(traits_of(full, table, out.division().type, t));
  return out;
}

}  // namespace forest::statistics
