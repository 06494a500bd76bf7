// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/leave_one_out.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <vector>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/parallel.h"
#include "forest/core/random.h"
#include "forest/statistics/dealing.h"
#include "forest/statistics/discriminator.h"
#include "forest/statistics/random_forest.h"
#include "forest/statistics/sample_distance.h"

namespace forest::statistics {
namespace {

constexpr double level = .05;
constexpr std::size_t least_traced = 3, least_grown = 19;
constexpr std::size_t ranked_at_level = 59;  // grown cells: typicality's smallest p is 3 / (n + 1)

/// A left-out cell, those that the model saw, and those that it grew, one below the other.
struct Beside {
  std::size_t known;  // rows from 0; the left-out cell is row `known`, grown ones follow
  FeatureTable table;
  std::size_t grown() const { return table.size() - known - 1; }
};

Beside beside(const FeatureTable& traced, std::span<const std::uint32_t> slices, std::size_t left_out,
              const FeatureTable& grown, bool structure) {
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < traced.size(); ++i)
    if (i != left_out && (slices.empty() || slices[i] != slices[left_out])) rows.push_back(i);
  if (rows.size() + 1 < least_traced)
    throw Error(fmt::format(
        "without {} and its sisters fewer than two traced cells are left; add cells of other slices",
        traced.cells[left_out]));
  const std::size_t known = rows.size();
  rows.push_back(left_out);
  FeatureTable real = rows_of(traced, rows);
  real.slices.clear();
  const FeatureTable both = stacked(std::array{std::move(real), grown});
  return {known, completed(structure ? structure_of(both) : both)};
}

/// Share of grown cells that forests rank as more grown than the left-out cell; neither is among those that they learn from.
/// @param of_grown  is given that share for each grown cell: 1, ½ or 0, in the mean over repeats
double paired(const Beside& b, const LeaveOneOutOptions& options, std::uint64_t item,
              std::vector<double>& of_grown) {
  const SortedFeatures data(b.table.values);
  std::vector<std::uint8_t> second(b.table.size(), 1);
  std::fill_n(second.begin(), b.known + 1, std::uint8_t(0));
  const std::size_t learned =
      std::min(b.known, b.grown() / 2);  // as many grown ones as known ones, where there are
  std::vector<double> won(b.grown(), 0.), asked(b.grown(), 0.);
  for (std::size_t repeat = 0; repeat < options.repeats; ++repeat) {
    const std::uint64_t draw = item * options.repeats + repeat;
    Random random(options.seed, draw, 0x6c6f6f20);  // "loo "
    std::vector<std::uint32_t> grown = dealt(b.grown(), {}, random), train(b.known);
    std::iota(train.begin(), train.end(), 0u);
    for (std::uint32_t& g : grown) g += std::uint32_t(b.known) + 1;
    train.insert(train.end(), grown.begin(), grown.begin() + std::ptrdiff_t(learned));
    std::vector<std::uint32_t> test{std::uint32_t(b.known)};
    test.insert(test.end(), grown.begin() + std::ptrdiff_t(learned), grown.end());
    const std::vector<double> scores =
        forest_scores(data, second, train, test, {.trees = options.trees}, options.seed, draw);
    for (std::size_t k = 1; k < test.size(); ++k) {
      const std::size_t g = test[k] - b.known - 1;
      won[g] += scores[k] > scores[0] ? 1. : scores[k] == scores[0] ? .5 : 0.;
      asked[g] += 1.;
    }
  }
  double sum = 0., count = 0.;
  for (std::size_t g = 0; g < won.size(); ++g)
    if (asked[g] > 0.) of_grown.push_back(won[g] / asked[g]), sum += of_grown.back(), count += 1.;
  return sum / count;
}

std::size_t doubled_rank(double rank, std::size_t count, std::size_t most) {
  return std::size_t(std::llround(2. * double(most) * rank / double(count)));
}

/// How likely each sum is of the ranks of cells among so many others each, all ranks equally likely. Ranks count from 0 to 2 `most`,
/// whatever there are of others, so that half a rank is a whole one.
std::vector<double> sums_of_ranks(std::span<const std::size_t> others, std::size_t most) {
  std::vector<double> ways{1.};
  for (const std::size_t count : others) {
    std::vector<double> more(ways.size() + 2 * most, 0.);
    for (std::size_t rank = 0; rank <= count; ++rank) {
      const std::size_t at = doubled_rank(double(rank), count, most);
      for (std::size_t k = 0; k < ways.size(); ++k) more[k + at] += ways[k] / double(count + 1);
    }
    ways = std::move(more);
  }
  return ways;
}

/// Chance of what is as far from the middle as `sum`. Exact.
double chance_of(std::size_t sum, std::span<const double> ways) {
  const double middle = .5 * double(ways.size() - 1), far = std::abs(double(sum) - middle);
  // Both tails are alike, and the lower one is summed up without anything being taken away.
  double tail = 0.;
  for (std::size_t k = 0; k < ways.size() && double(k) <= middle - far + 1e-9; ++k) tail += ways[k];
  return std::min(1., 2. * tail);
}

/// Chance that so many of `cells` are below a level that one of twenty is.
double chance_of_so_many(std::size_t strange, std::size_t cells) {
  double p = 0.;
  for (std::size_t k = strange; k <= cells; ++k)
    p += std::exp(std::lgamma(double(cells + 1)) - std::lgamma(double(k + 1)) -
                  std::lgamma(double(cells - k + 1)) + double(k) * std::log(level) +
                  double(cells - k) * std::log(1. - level));
  return std::min(1., p);
}

std::vector<PairedFeature> ranked_features(const FeatureTable& traced, std::span<const FeatureTable> grown) {
  std::vector<PairedFeature> out(traced.features.size());
  std::vector<std::size_t> sums(out.size(), 0);
  std::vector<std::vector<std::size_t>> others(out.size());  // of each cell in which it is defined
  std::size_t most = 0;
  for (const FeatureTable& g : grown) most = std::max(most, g.size());
  parallel_for(out.size(), 8, [&](std::size_t f) {
    PairedFeature& feature = out[f];
    feature.feature = traced.features[f];
    const auto c = Eigen::Index(f);
    double above = 0.;
    bool same = true;
    for (std::size_t i = 0; i < traced.size(); ++i) {
      const double x = traced.values(Eigen::Index(i), c);
      if (!std::isfinite(x)) continue;
      double below = 0.;
      std::size_t count = 0;
      for (const double y : grown[i].values.col(c))
        if (std::isfinite(y)) below += y < x ? 1. : y == x ? .5 : 0., ++count, same = same && y == x;
      if (count < least_grown) continue;
      sums[f] += doubled_rank(below, count, most), above += 1. - below / double(count);
      others[f].push_back(count);
    }
    if (others[f].empty() || same) return others[f].clear();
    feature.cells = others[f].size();
    feature.auc = above / double(feature.cells);
  });
  std::map<std::vector<std::size_t>, std::vector<double>> ways;  // most features are defined in all cells
  for (std::size_t f = 0; f < out.size(); ++f) {
    if (others[f].empty()) continue;
    auto& known = ways[others[f]];
    if (known.empty()) known = sums_of_ranks(others[f], most);
    out[f].p = chance_of(sums[f], known);
  }
  std::vector<FeatureTable> all{traced};  // what repeats another, or is the same in all, is not asked
  all.insert(all.end(), grown.begin(), grown.end());
  const std::vector<Feature> told = distinct(stacked(all)).features;
  std::erase_if(out, [&](const PairedFeature& f) {
    return f.cells == 0 || std::ranges::find(told, f.feature) == told.end();
  });
  std::vector<double> p;
  for (const PairedFeature& f : out) p.push_back(f.p);
  const std::vector<double> adjusted = holm(p);
  for (std::size_t f = 0; f < out.size(); ++f) out[f].p_holm = adjusted[f];
  std::ranges::stable_sort(out, [](const PairedFeature& a, const PairedFeature& b) {
    return a.p != b.p ? a.p < b.p : std::abs(a.auc - .5) > std::abs(b.auc - .5);
  });
  return out;
}

}  // namespace

bool LeaveOneOut::told_apart() const {
  const bool ranked = structure.lower > .5 ||
                      structure.upper < .5;  // both sides: a model may also be too near to what it saw
  return 3. * strange_p <= level || ranked || rejections > 0;
}

void must_be_enough(std::size_t traced) {
  if (traced < least_traced)
    throw Error(
        fmt::format("{} traced cells cannot be left out one by one; give at least {}", traced, least_traced));
}

LeaveOneOut leave_one_out(const FeatureTable& traced, std::span<const FeatureTable> grown,
                          const LeaveOneOutOptions& options, Progress& progress) {
  must_be_enough(traced.size());
  if (grown.size() != traced.size()) throw Error("there are not grown cells for each traced one");
  LeaveOneOut out;
  out.traced = traced.size();
  for (const FeatureTable& g : grown) {
    if (g.features != traced.features)
      throw Error("the grown cells were not measured as the traced ones were");
    if (g.size() < least_grown)
      throw Error(
          fmt::format("{} cells grown for each traced one are too few to rank it among; grow at least {}",
                      g.size(), least_grown));
    out.grown = out.grown ? std::min(out.grown, g.size()) : g.size();
  }
  const std::vector<std::uint32_t> slices = numbered(traced.slices);
  const std::size_t n = traced.size();
  out.cells.resize(n);
  std::vector<std::array<std::vector<double>, 2>> of_grown(n);
  std::vector<std::vector<double>> near_grown(n);
  std::vector<double> near_left_out(n);
  progress.begin("leaving cells out", n);
  parallel_for(n, 1, [&](std::size_t i) {
    LeftOut& cell = out.cells[i];
    cell.cell = traced.cells[i];
    FeatureTable asked = rows_of(traced, std::array{i});
    asked.slices.clear();
    cell.typicality = typicality(grown[i], asked);
    const Beside structure = beside(traced, slices, i, grown[i], true),
                 whole = beside(traced, slices, i, grown[i], false);
    cell.structure = paired(structure, options, i, of_grown[i][0]);
    cell.whole = paired(whole, options, n + i, of_grown[i][1]);
    const Eigen::MatrixXd X = standardised(whole.table);
    const auto known = Eigen::Index(whole.known);
    const Eigen::VectorXd nearest =
        distances(X.bottomRows(X.rows() - known), X.topRows(known)).rowwise().minCoeff();
    near_left_out[i] = nearest(0);
    near_grown[i].assign(nearest.data() + 1, nearest.data() + nearest.size());
    progress.advance();
  });
  progress.end();

  std::array<std::vector<double>, 2> first, second;
  std::vector<double> near;
  for (std::size_t i = 0; i < n; ++i) {
    const LeftOut& cell = out.cells[i];
    out.strange += cell.typicality.p <= level;
    first[0].push_back(cell.structure), first[1].push_back(cell.whole);
    for (std::size_t k = 0; k < 2; ++k)
      second[k].insert(second[k].end(), of_grown[i][k].begin(), of_grown[i][k].end());
    near.insert(near.end(), near_grown[i].begin(), near_grown[i].end());
  }
  const auto area = [&](std::size_t k) {
    const double mean = std::accumulate(first[k].begin(), first[k].end(), 0.) / double(n);
    return area_interval(mean, first[k], second[k], double(n), double(out.grown));
  };
  out.structure = area(0), out.whole = area(1);
  out.strange_p = chance_of_so_many(out.strange, n);
  out.features = ranked_features(traced, grown);
  out.rejections = std::size_t(
      std::ranges::count_if(out.features, [](const PairedFeature& f) { return f.p_holm <= level; }));
  const double real = quantile(near_left_out, .5);
  out.neighbour_ratio = real > 0. ? quantile(near, .5) / real : 0.;
  out.detectable_auc = detectable_auc(n, out.grown);
  return out;
}

std::string sentence(const LeaveOneOut& r) {
  std::string out = fmt::format(
      "{} cells cannot show that grown cells equal traced ones: with so few, a difference is only found, in "
      "four of five "
      "cases, from an AUC of {:.2f} on. ",
      r.traced, r.detectable_auc);
  out += r.told_apart() ? "Even so they are told apart: " : "They are not told apart, which says little: ";
  out += fmt::format(
      "in all pairs of a left-out and a grown cell a random forest knows which is which with AUC {:.2f} "
      "({:.2f}–{:.2f}) by structure, {} of {} features lie to one side{}, and ",
      r.structure.value, r.structure.lower, r.structure.upper, r.rejections, r.features.size(),
      r.rejections ? ", above all " + r.features.front().feature.name : "");
  return out +
         (r.grown < ranked_at_level
              ? fmt::format("whether a cell is strange could be told among {} grown ones, not among {}.",
                            ranked_at_level, r.grown)
              : fmt::format(
                    "{} of {} cells {} strange among {} grown without them ({:.2g} would be by chance).",
                    r.strange, r.traced, r.strange == 1 ? "is" : "are", r.grown, level * double(r.traced)));
}

}  // namespace forest::statistics
