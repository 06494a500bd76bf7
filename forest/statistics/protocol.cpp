// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/protocol.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/parallel.h"
#include "forest/core/random.h"
#include "forest/statistics/dealing.h"
#include "forest/statistics/sample_distance.h"
#include "forest/statistics/summary.h"

namespace forest::statistics {
namespace {

// The limits of the protocol.
constexpr double most_auc = .60, most_auc_diameters = .65, most_above_control = .05;
constexpr double least_p = .05, level = .05;
constexpr double most_mvs = .10;
constexpr double least_inside = .95;
constexpr double least_neighbour_ratio = .9;
constexpr std::size_t most_run = 3;

FeatureTable first_rows(const FeatureTable& table, std::size_t count) {
  std::vector<std::size_t> rows(std::min(count, table.size()));
  std::iota(rows.begin(), rows.end(), std::size_t(0));
  return rows_of(table, rows);
}

/// The three samples in one matrix, and where each lies.
struct Samples {
  Eigen::MatrixXd values;
  Eigen::Index train, held_out, grown;
  std::vector<std::uint32_t> slices;  // of the rows

  std::vector<std::uint32_t> slices_of(Eigen::Index first, Eigen::Index first_rows, Eigen::Index second,
                                       Eigen::Index second_rows) const {
    std::vector<std::uint32_t> out;
    if (slices.empty()) return out;
    out.insert(out.end(), slices.begin() + first, slices.begin() + first + first_rows);
    out.insert(out.end(), slices.begin() + second, slices.begin() + second + second_rows);
    return out;
  }
  std::vector<std::uint32_t> grown_and_held_out() const {
    return slices_of(train + held_out, grown, train, held_out);
  }
  std::vector<std::uint32_t> train_and_held_out() const { return slices_of(0, train, train, held_out); }
  auto of_train() const { return values.topRows(train); }
  auto of_held_out() const { return values.middleRows(train, held_out); }
  auto of_grown() const { return values.bottomRows(grown); }
};

Samples samples_of(const std::array<FeatureTable, 3>& tables, bool structure) {
  const FeatureTable all = stacked(tables);
  return {standardised(completed(structure ? structure_of(all) : all)), tables[0].values.rows(),
          tables[1].values.rows(), tables[2].values.rows(), numbered(all.slices)};
}

std::vector<double> column(const Eigen::MatrixXd& values, Eigen::Index c,
                           std::span<const std::uint32_t> rows) {
  std::vector<double> out;
  for (const std::uint32_t r : rows)
    if (std::isfinite(values(r, c))) out.push_back(values(r, c));
  return out;
}

/// Kolmogorov–Smirnov and spreads of medians, feature by feature, where values are missing without them.
void ask_each_feature(const std::array<FeatureTable, 3>& tables, const ProtocolOptions& options,
                      Judgement& j) {
  const FeatureTable all = distinct(stacked(tables));
  const Eigen::Index features = all.values.cols();
  std::vector<std::uint32_t> real(tables[0].size() + tables[1].size()), grown(tables[2].size());
  std::iota(real.begin(), real.end(), 0u);
  std::iota(grown.begin(), grown.end(), std::uint32_t(real.size()));
  const std::span<const std::uint32_t> held_out(real.data() + tables[0].size(), tables[1].size());

  std::vector<double> p(std::size_t(features), 1.), spread(std::size_t(features), 0.),
      usual(std::size_t(features), 0.);
  std::vector<std::vector<double>> real_spread(static_cast<std::size_t>(features));
  // Real cells dealt to two samples of the same sizes, as far as there are enough; the same dealings for all features.
  const std::size_t n_held = held_out.size(), n_grown = std::min(grown.size(), real.size() - n_held);
  const std::vector<std::uint32_t> slices =
      numbered(std::span(all.slices).first(std::min(all.slices.size(), real.size())));
  std::vector<std::vector<std::uint8_t>> dealt(
      options.resamples);  // of each real cell: 1 or 2, 0 for neither
  parallel_for(dealt.size(), 16, [&](std::size_t k) {
    Random random(options.seed, k, 0x6d767320);  // "mvs "
    const std::vector<std::uint32_t> deal = statistics::dealt(real.size(), slices, random);
    dealt[k].assign(real.size(), 0);
    for (std::size_t i = 0; i < n_held + n_grown; ++i) dealt[k][deal[i]] = i < n_held ? 1 : 2;
  });
  parallel_for(std::size_t(features), 1, [&](std::size_t f) {
    const auto c = Eigen::Index(f);
    const std::vector<double> a = column(all.values, c, held_out), b = column(all.values, c, grown);
    if (a.empty() || b.empty()) return;  // "… is defined" tells
    p[f] = kolmogorov_smirnov(a, b).p;
    if (all.features[f].name.ends_with(" is defined")) return;  // the median of 0 and 1 jumps
    spread[f] = median_visible_spread(a, b);
    std::vector<std::uint32_t> rising;
    for (const std::uint32_t row : real)
      if (std::isfinite(all.values(row, c))) rising.push_back(row);
    std::ranges::stable_sort(rising, {}, [&](std::uint32_t row) { return all.values(row, c); });
    std::vector<double> one, two;
    for (const auto& deal : dealt) {
      one.clear(), two.clear();
      for (const std::uint32_t row : rising)
        if (deal[row]) (deal[row] == 1 ? one : two).push_back(all.values(row, c));
      real_spread[f].push_back(one.empty() || two.empty() ? 0. : median_visible_spread_of_sorted(one, two));
    }
    usual[f] = std::max(.02, quantile(real_spread[f], .95));  // medians of counts may hardly ever differ
  });

  const std::vector<double> adjusted = holm(p);
  std::vector<double> of_features;
  std::vector<double> worst(options.resamples, 0.);
  for (std::size_t f = 0; f < std::size_t(features); ++f) {
    const std::string& name = all.features[f].name;
    if (adjusted[f] < level) j.ks_rejections.push_back(name);
    if (real_spread[f].empty()) continue;
    of_features.push_back(spread[f]);
    j.mvs_max = std::max(j.mvs_max, spread[f]);
    if (spread[f] / usual[f] > j.mvs_ratio) j.mvs_ratio = spread[f] / usual[f], j.mvs_feature = name;
    for (std::size_t k = 0; k < worst.size(); ++k)
      worst[k] = std::max(worst[k], real_spread[f][k] / usual[f]);
  }
  j.features = std::size_t(features);
  j.mvs_median = of_features.empty() ? 0. : quantile(of_features, .5);
  j.mvs_limit = worst.empty() ? 0. : quantile(worst, .95);
}

/// How near cells are to the nearest training cell: the median over cells.
double nearest(const Eigen::MatrixXd& cells, const Eigen::MatrixXd& train) {
  const Eigen::VectorXd least = distances(cells, train).rowwise().minCoeff();
  return quantile(std::span(least.data(), std::size_t(least.size())), .5);
}

DiscriminatorOptions discriminator_options(const ProtocolOptions& options, std::size_t first,
                                           std::vector<std::uint32_t> slices) {
  return {.repeats = options.repeats,
          .trees = options.trees,
          .permutations = 0,
          .first = first,
          .seed = options.seed,
          .slices = std::move(slices)};
}

void ask(Judgement& j, std::string name, bool pass, std::string reason) {
  j.criteria.push_back({std::move(name), pass, std::move(reason)});
}

void ask_auc(Judgement& j, const char* name, const char* what, const Estimate& auc, const Estimate& control,
             double most) {
  const double beside = std::max(.5, control.value) + most_above_control;
  ask(j, name, auc.value <= std::min(most, beside),
      fmt::format("a random forest tells grown from held-out cells by {} with AUC {:.3f} ({:.3f}–{:.3f}); at "
                  "most {:.2f} "
                  "is asked, and {:.3f} where it tells real training cells with {:.3f}",
                  what, auc.value, auc.lower, auc.upper, most, beside, control.value));
}

/// All criteria but those on the controls. With a `control` structure alone is asked, as what is wrong with it is known.
Judgement judge_one(const FeatureTable& train, const FeatureTable& held_out, const FeatureTable& grown,
                    const Estimate* real_control, const ProtocolOptions& options, Progress& progress) {
  Judgement j;
  j.train = train.size(), j.held_out = held_out.size(), j.grown = grown.size();
  j.compared = std::min(train.size(), grown.size());
  j.longest_run = options.longest_run;
  const std::array<FeatureTable, 3> tables{train, held_out, first_rows(grown, j.compared)};
  const bool full = real_control == nullptr;

  const Samples structure = samples_of(tables, true), whole = samples_of(tables, false);
  const auto tell = [&](const Samples& of, bool real, Classifier by) {
    return real ? discriminate(of.of_train(), of.of_held_out(), by,
                               discriminator_options(options, j.compared, of.train_and_held_out()), progress)
                      .auc
                : discriminate(of.of_grown(), of.of_held_out(), by,
                               discriminator_options(options, 0, of.grown_and_held_out()), progress)
                      .auc;
  };
  constexpr auto forest = Classifier::random_forest;
  j.auc.structure = tell(structure, false, forest);
  j.auc.real_control = full ? tell(structure, true, forest) : *real_control;
  ask_auc(j, "auc.structure", "structure", j.auc.structure, j.auc.real_control, most_auc);
  if (full) {
    j.auc.logistic = tell(structure, false, Classifier::logistic);
    j.auc.diameters = tell(whole, false, forest);
    j.auc.real_control_diameters = tell(whole, true, forest);
    ask_auc(j, "auc.diameters", "structure and diameters", j.auc.diameters, j.auc.real_control_diameters,
            most_auc_diameters);
  }
  j.detectable_auc = detectable_auc(j.compared, j.held_out);

  j.energy_p = energy_distance(whole.of_grown(), whole.of_held_out(), options.dealings, options.seed,
                               whole.grown_and_held_out())
                   .p;
  ask(j, "energy_p", j.energy_p > least_p,
      fmt::format("energy distance of grown and held-out cells: p = {:.4f}; more than {} is asked",
                  j.energy_p, least_p));
  j.mmd_p = mean_discrepancy(whole.of_grown(), whole.of_held_out(), options.dealings, options.seed,
                             whole.grown_and_held_out())
                .p;
  ask(j, "mmd_p", j.mmd_p > least_p,
      fmt::format("maximum mean discrepancy: p = {:.4f}; more than {} is asked", j.mmd_p, least_p));

  ask_each_feature(tables, options, j);
  ask(j, "ks_rejections", j.ks_rejections.empty(),
      fmt::format("Kolmogorov–Smirnov rejects {} of {} features after Holm's correction{}",
                  j.ks_rejections.size(), j.features,
                  j.ks_rejections.empty() ? "" : ", the first: " + j.ks_rejections.front()));
  ask(j, "mvs_median", j.mvs_median <= most_mvs,
      fmt::format("median visible spread of half of the features is at most {:.3f}; {} is asked",
                  j.mvs_median, most_mvs));
  ask(j, "mvs_max", j.mvs_ratio <= j.mvs_limit,
      fmt::format(
          "the worst feature, {}, has {:.2f} times the spread that real samples stay below in 95 of 100; the "
          "worst of real samples has up to {:.2f} times",
          j.mvs_feature.empty() ? "none" : j.mvs_feature, j.mvs_ratio, j.mvs_limit));

  j.sholl = band_of(held_out.sholl, train.sholl, j.compared, options.resamples, options.seed);
  j.sholl_grown = mean_curve(tables[2].sholl);
  j.sholl_inside = share_inside(j.sholl_grown, j.sholl);
  ask(j, "sholl_inside", j.sholl_inside >= least_inside,
      fmt::format("the mean of Sholl's crossings is in the band of real cells at {:.1f} % of radii; {:.0f} % "
                  "is asked",
                  100. * j.sholl_inside, 100. * least_inside));
  if (!full) return j;

  const double real = nearest(whole.of_held_out(), whole.of_train());
  j.neighbour_ratio = real > 0. ? nearest(whole.of_grown(), whole.of_train()) / real : 0.;
  ask(j, "copying.neighbour_ratio", j.neighbour_ratio >= least_neighbour_ratio,
      fmt::format("the nearest training cell is {:.3f} times as far from grown as from held-out cells; at "
                  "least {} is "
                  "asked",
                  j.neighbour_ratio, least_neighbour_ratio));
  if (j.longest_run)
    ask(j, "copying.longest_run", *j.longest_run <= most_run,
        fmt::format("at most {} consecutive branches come from one traced cell; {} are allowed",
                    *j.longest_run, most_run));
  return j;
}

}  // namespace

Judgement judge(const FeatureTable& train, const FeatureTable& held_out, const FeatureTable& grown,
                std::span<const Control> controls, const ProtocolOptions& options, Progress& progress) {
  for (const auto& [table, name] :
       {std::pair{&train, "training"}, {&held_out, "held-out"}, {&grown, "grown"}})
    if (table->size() < 4)
      throw Error(fmt::format("{} {} cells are too few to judge; give at least four", table->size(), name));
  Judgement j = judge_one(train, held_out, grown, nullptr, options, progress);
  for (const Control& control : controls) {
    const Judgement c = judge_one(train, held_out, first_rows(control.cells, j.compared), &j.auc.real_control,
                                  options, progress);
    ControlResult result{.name = control.name, .auc = c.auc.structure, .rejected = false, .reasons = {}};
    for (const Criterion& criterion : c.criteria)
      if (!criterion.pass) result.reasons.push_back(criterion.reason);
    result.rejected = !result.reasons.empty();
    ask(j, "controls." + control.name, result.rejected,
        result.rejected ? fmt::format("the control '{}' is rejected, as it must be (AUC {:.3f})",
                                      control.name, result.auc.value)
                        : fmt::format("the control '{}' is not told from real cells (AUC {:.3f}): these "
                                      "cells are too few to judge by",
                                      control.name, result.auc.value));
    j.controls.push_back(std::move(result));
  }
  j.pass = std::ranges::all_of(j.criteria, &Criterion::pass);
  return j;
}

}  // namespace forest::statistics
