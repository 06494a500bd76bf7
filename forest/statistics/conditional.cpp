// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/conditional.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "forest/core/error.h"

namespace forest::statistics {
namespace {

/// The value at the share p of what is sorted, linear between two.
double share_of(std::span<const double> sorted, double p) {
  const double at = std::clamp(p, 0., 1.) * double(sorted.size() - 1);
  const auto below = std::min(std::size_t(at), sorted.size() - 1),
             above = std::min(below + 1, sorted.size() - 1);
  return sorted[below] + (at - double(below)) * (sorted[above] - sorted[below]);
}

}  // namespace

std::vector<double> bin_edges(std::span<const double> given, const Binning& binning) {
  std::vector<double> sorted;
  std::ranges::copy_if(given, std::back_inserter(sorted), [](double x) { return !std::isnan(x); });
  std::ranges::sort(sorted);
  const std::size_t n = sorted.size(), most = std::max<std::size_t>(binning.most, 1);
  const std::size_t least = std::max({binning.least, (n + most - 1) / most, std::size_t(1)});
  std::vector<double> edges;
  std::size_t held = 0;
  for (std::size_t i = 0; i < n; ++i) {
    ++held;
    const bool parted = i + 1 < n && sorted[i] < sorted[i + 1];
    if (held >= least && parted && n - 1 - i >= least) edges.push_back(sorted[i]), held = 0;
  }
  if (n) edges.push_back(sorted.back());
  return edges;
}

std::size_t bin_of(std::span<const double> edges, double given) {
  return std::min(std::size_t(std::ranges::lower_bound(edges, given) - edges.begin()), edges.size() - 1);
}

std::vector<ChanceBin> chance_by(std::span<const char> happened, std::span<const double> given,
                                 const Binning& binning) {
  const std::vector<double> edges = bin_edges(given, binning);
  std::vector<std::size_t> hits(edges.size()), counts(edges.size());
  for (std::size_t i = 0; i < given.size(); ++i) {
    if (std::isnan(given[i])) continue;
    const std::size_t bin = bin_of(edges, given[i]);
    ++counts[bin], hits[bin] += happened[i] != 0;
  }
  std::vector<ChanceBin> bins;
  for (std::size_t b = 0; b < edges.size(); ++b)
    bins.push_back({edges[b], counts[b], chance_of("chance", hits[b], counts[b])});
  return bins;
}

std::string table_text(std::string_view name, std::span<const ChanceBin> bins) {
  std::string text = fmt::format("table {} = ", name);
  for (std::size_t b = 0; b < bins.size(); ++b)
    text +=
        fmt::format("{}{}: {}", b ? ", " : "", number_text(bins[b].upper), number_text(bins[b].chance.value));
  return text;
}

double Conditional::quantile(double given, double p) const {
  const auto bin = std::ranges::lower_bound(bins, given, {}, &Bin::upper);
  return share_of((bin == bins.end() ? bins.back() : *bin).quantiles, p);
}

double Conditional::cdf(double given, double value) const {
  const auto found = std::ranges::lower_bound(bins, given, {}, &Bin::upper);
  const std::vector<double>& q = (found == bins.end() ? bins.back() : *found).quantiles;
  const auto above = std::ranges::upper_bound(q, value);
  if (above == q.begin()) return 0.;
  if (above == q.end()) return 1.;
  const double from = above[-1], to = *above;
  return (double(above - q.begin() - 1) + (value - from) / (to - from)) / double(q.size() - 1);
}

std::string Conditional::text(std::string_view name, std::string_view variable) const {
  const std::size_t steps = bins.front().quantiles.size() - 1;
  std::string text, choice, end;
  for (std::size_t b = 0; b < bins.size(); ++b) {
    text += fmt::format("# {} values with {} {} {}\ntable {}_{} = ", bins[b].count, variable,
                        b + 1 < bins.size() ? "up to" : "above that, to", number_text(bins[b].upper), name,
                        b + 1);
    for (std::size_t i = 0; i <= steps; ++i)
      text += fmt::format("{}{}: {}", i ? ", " : "", i, number_text(bins[b].quantiles[i]));
    text += fmt::format(
        "\nfunction {0}_{1}_at(u) = {0}_{1}(floor(u)) + ({0}_{1}(floor(u) + 1) - {0}_{1}(floor(u))) * (u - "
        "floor(u))\n",
        name, b + 1);
    const std::string drawn = fmt::format("{}_{}_at(uniform(0, {}))", name, b + 1, steps);
    if (b + 1 < bins.size()) {
      choice += fmt::format("if({} <= {}, {}, ", variable, number_text(bins[b].upper), drawn);
      end += ')';
    } else {
      choice += drawn;
    }
  }
  return fmt::format("{}distribution {}({}) = {}{}\n", text, name, variable, choice, end);
}

Conditional conditional(std::span<const double> values, std::span<const double> given, const Binning& binning,
                        std::size_t steps) {
  std::vector<double> x, y;
  for (std::size_t i = 0; i < std::min(values.size(), given.size()); ++i)
    if (!std::isnan(values[i]) && !std::isnan(given[i])) y.push_back(values[i]), x.push_back(given[i]);
  if (x.empty()) throw Error("there is no value to make bins of; measure some first");
  const std::vector<double> edges = bin_edges(x, binning);
  std::vector<std::vector<double>> held(edges.size());
  for (std::size_t i = 0; i < x.size(); ++i) held[bin_of(edges, x[i])].push_back(y[i]);
  Conditional result;
  for (std::size_t b = 0; b < edges.size(); ++b) {
    std::ranges::sort(held[b]);
    Conditional::Bin& bin = result.bins.emplace_back(Conditional::Bin{edges[b], held[b].size(), {}});
    for (std::size_t i = 0; i <= steps; ++i)
      bin.quantiles.push_back(share_of(held[b], double(i) / double(steps)));
  }
  return result;
}

}  // namespace forest::statistics
