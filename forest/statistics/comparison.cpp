// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/comparison.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "forest/core/parallel.h"
#include "forest/statistics/dealing.h"
#include "forest/statistics/persistence_image.h"
#include "forest/statistics/random_forest.h"
#include "forest/statistics/summary.h"

namespace forest::statistics {
namespace {

constexpr double tests = 5.;  // whose smallest p decides

std::vector<Difference> differences(const FeatureTable& all, Eigen::Index of_a) {
  const auto features = std::size_t(all.values.cols());
  std::vector<Difference> rows(features);
  parallel_for(features, 4, [&](std::size_t f) {
    const auto c = Eigen::Index(f);
    const std::span values(all.values.col(c).data(), all.size());
    const auto a = values.first(std::size_t(of_a)), b = values.subspan(std::size_t(of_a));
    const Summary s = summarize(a), t = summarize(b);
    Difference& d = rows[f];
    d = {.feature = all.features[f],
         .cells_a = s.count,
         .cells_b = t.count,
         .mean_a = s.mean,
         .mean_b = t.mean,
         .sd_a = s.sd,
         .sd_b = t.sd};
    if (!d.compared()) return;
    d.delta = cliffs_delta(a, b);
    d.cohens_d = cohens_d(a, b);
    d.ks = kolmogorov_smirnov(a, b);
    d.mvs = median_visible_spread(a, b);
  });
  std::vector<double> p;
  for (const Difference& d : rows)
    if (d.compared()) p.push_back(d.ks.p);
  const std::vector<double> adjusted = holm(p);
  for (auto next = adjusted.begin(); Difference & d : rows)
    if (d.compared()) d.p_holm = *next++;
  return rows;
}

std::string percent(double share) { return fmt::format("{:.0f} %", 100. * share); }

}  // namespace

Comparison compare(const FeatureTable& a, const FeatureTable& b, const ComparisonOptions& options,
                   Progress& progress) {
  const std::array<FeatureTable, 2> both{a, b};
  const FeatureTable all = stacked(both), whole = completed(all), structure = completed(structure_of(all)),
                     branching = completed(branching_of(all));
  const auto of_a = Eigen::Index(a.size()), of_b = Eigen::Index(b.size());
  Comparison c;
  c.cells_a = a.size(), c.cells_b = b.size();

  const std::vector<std::uint32_t> slices = numbered(all.slices);
  const DiscriminatorOptions with{.repeats = options.repeats,
                                  .trees = options.trees,
                                  .permutations = options.permutations,
                                  .seed = options.seed,
                                  .slices = slices};
  DiscriminatorOptions without = with;
  without.permutations = 0;
  const Eigen::MatrixXd X = standardised(whole), S = standardised(structure);
  c.forest = discriminate(X.topRows(of_a), X.bottomRows(of_b), Classifier::random_forest, with, progress);
  c.logistic = discriminate(X.topRows(of_a), X.bottomRows(of_b), Classifier::logistic, with, progress);
  c.structure =
      discriminate(S.topRows(of_a), S.bottomRows(of_b), Classifier::random_forest, without, progress);
  if (branching.features.size() > 0) {
    const Eigen::MatrixXd B = standardised(branching);
    c.branching =
        discriminate(B.topRows(of_a), B.bottomRows(of_b), Classifier::random_forest, without, progress);
  }
  c.energy = energy_distance(X.topRows(of_a), X.bottomRows(of_b), options.dealings, options.seed, slices);
  c.mmd = mean_discrepancy(X.topRows(of_a), X.bottomRows(of_b), options.dealings, options.seed, slices);

  if (all.bars.size() == all.size())
    c.barcodes =
        barcode_distance(persistence_images(all.bars), a.size(), options.dealings, options.seed, slices);

  std::vector<std::uint8_t> second(a.size(), 0);
  second.resize(a.size() + b.size(), 1);
  const std::vector<double> importances =
      forest_importances(SortedFeatures(X), second, {.trees = 500}, options.seed);
  const FeatureTable varied = distinct(all);  // the columns of `whole`, with what is missing
  c.differences = differences(varied, of_a);
  for (std::size_t f = 0; f < importances.size(); ++f) c.differences[f].importance = importances[f];
  std::ranges::stable_sort(c.differences, std::greater(), [](const Difference& d) {
    return std::pair(d.p_holm <= .05, std::abs(d.delta.value));
  });

  c.sholl = band_of(a.sholl, b.sholl, b.size(), 1000, options.seed);
  c.sholl_b = mean_curve(b.sholl);
  c.sholl_inside = share_inside(c.sholl_b, c.sholl);
  c.detectable_auc = detectable_auc(a.size(), b.size(), .05 / tests, c.forest.null);
  c.detectable_effect = detectable_effect(a.size(), b.size(), std::max<std::size_t>(c.compared(), 1));

  double least = std::min({c.forest.p, c.energy.p, c.mmd.p, c.barcodes.p});
  for (const Difference& d : c.differences) least = std::min(least, d.p_holm);
  c.p = std::min(1., tests * least);
  return c;
}

std::string sentence(const Comparison& c, const std::string& a, const std::string& b) {
  const auto differ =
      std::ranges::count_if(c.differences, [](const Difference& d) { return d.p_holm <= .05; });
  const Estimate& auc = c.forest.auc;
  const std::string ranks = fmt::format(
      "a random forest ranks a cell of {} above one of {} in {} of pairs (95 % interval "
      "{}–{}{})",
      b, a, percent(auc.value), percent(auc.lower), percent(auc.upper),
      auc.value < .5 ? "; below half is chance, too" : "");
  if (!c.told_apart())
    return fmt::format(
        "{} and {} cannot be told apart by these cells (p = {:.2g}): {}, and {} of {} features differ after "
        "Holm's "
        "correction. Of {} and {} cells a difference by which {} of pairs are ranked rightly would have been "
        "seen in four "
        "of five cases.",
        a, b, c.p, ranks, differ, c.compared(), c.cells_a, c.cells_b, percent(c.detectable_auc));
  const std::size_t of_one = c.differences.size() - c.compared();
  const std::string alone =
      of_one ? fmt::format(" {} more {} defined in one of the two alone.", of_one, of_one == 1 ? "is" : "are")
             : std::string();
  // What a tracer's habits and the lie of a slice do, which no cell is to blame for.
  const double beyond = c.branching.auc.value;
  const std::string traced = beyond >= c.detectable_auc
                                 ? fmt::format(
                                       " By branching alone, whatever diameters were given, however densely "
                                       "points were set and however the cells lay, it is {}.",
                                       percent(beyond))
                                 : fmt::format(
                                       " That may be how they were traced: without diameters, and without "
                                       "what depends on how densely "
                                       "points were set and how the cells lay, it is {}.",
                                       percent(beyond));
  const char* how = auc.value >= .95   ? "almost always"
                    : auc.value >= .8  ? "mostly"
                    : auc.value >= .65 ? "more often than not"
                                       : "as populations, though hardly cell by cell";
  std::string by;
  for (std::size_t i = 0, said = 0; i < c.differences.size() && said < 3; ++i) {
    const Difference& d = c.differences[i];
    if (d.p_holm > .05) continue;
    by += fmt::format("{}{} ({} in {})", said++ ? ", " : "", d.feature.name,
                      d.delta.value > 0. ? "larger" : "smaller", b);
  }
  return fmt::format(
      "{} and {} can be told apart {} (p ≤ {:.2g}): {}; {} of {} features differ after Holm's "
      "correction{}.{}{}",
      a, b, how, c.p, ranks, differ, c.compared(), by.empty() ? "" : ", led by " + by, alone, traced);
}

}  // namespace forest::statistics
