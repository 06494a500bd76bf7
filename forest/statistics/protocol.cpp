// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/protocol.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iterator>
#include <numeric>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "forest/core/error.h"
#include "forest/core/parallel.h"
#include "forest/core/random.h"
#include "forest/statistics/dealing.h"
#include "forest/statistics/sample_distance.h"
#include "forest/statistics/summary.h"

namespace forest::statistics {
namespace {

// The limits of the protocol.
constexpr double most_auc = .60, most_auc_diameters = .65, most_beside_control = .05;
constexpr double least_p = .05, level = .05;
constexpr double most_mvs = .10;
constexpr double least_inside = .95;
constexpr double least_neighbour_ratio = .9;
constexpr std::size_t most_run = 3;

/// What is judged: cells, and the samples of them of which each criterion is asked, all of the same size.
struct Drawn {
  FeatureTable cells;
  std::vector<std::vector<std::uint32_t>> samples;  // rows

  std::size_t size() const { return samples.front().size(); }
};

/// Populations as they were grown, but for what is beyond `count`.
Drawn drawn_from(std::span<const FeatureTable> populations, std::size_t count) {
  Drawn out{.cells = stacked(populations), .samples = {}};
  std::uint32_t first = 0;
  for (const FeatureTable& population : populations) {
    std::vector<std::uint32_t>& rows = out.samples.emplace_back(count);
    std::iota(rows.begin(), rows.end(), first);
    first += std::uint32_t(population.size());
  }
  return out;
}

/// Samples by chance of cells that were not grown, without repetition; one where all are taken.
Drawn drawn_from(const FeatureTable& cells, std::size_t count, std::size_t samples, std::uint64_t seed) {
  Drawn out{.cells = cells, .samples = {}};
  count = std::min(count, cells.size());
  for (std::size_t k = 0; k < (count < cells.size() ? samples : 1); ++k) {
    Random random(seed, k, 0x6472776e);  // "drwn"
    out.samples.push_back(statistics::dealt(cells.size(), {}, random));
    out.samples.back().resize(count);
  }
  return out;
}

/// The three samples in one matrix, and where each lies.
struct Samples {
  Eigen::MatrixXd values;
  Eigen::Index train, held_out;
  std::vector<std::uint32_t> slices;  // of the rows

  /// The slices of rows of the judged cells, or of training cells, and of the held-out cells behind them.
  std::vector<std::uint32_t> slices_of(std::span<const std::uint32_t> rows, Eigen::Index first) const {
    std::vector<std::uint32_t> out;
    if (slices.empty()) return out;
    for (const std::uint32_t row : rows) out.push_back(slices[std::size_t(first) + row]);
    out.insert(out.end(), slices.begin() + train, slices.begin() + train + held_out);
    return out;
  }
  std::vector<std::uint32_t> slices_of_judged(std::span<const std::uint32_t> rows) const {
    return slices_of(rows, train + held_out);
  }
  auto of_train() const { return values.topRows(train); }
  auto of_held_out() const { return values.middleRows(train, held_out); }
  auto of_judged() const { return values.bottomRows(values.rows() - train - held_out); }
  Eigen::MatrixXd of_judged(const std::vector<std::uint32_t>& rows) const {
    return of_judged()(rows, Eigen::all);
  }
};

FeatureTable whole_of(const FeatureTable& table) { return table; }

/// @param part  structure_of, slopes_of or whole_of
Samples samples_of(const std::array<FeatureTable, 3>& tables, FeatureTable (*part)(const FeatureTable&)) {
  const FeatureTable all = stacked(tables);
  return {standardised(completed(part(all))), tables[0].values.rows(), tables[1].values.rows(),
          numbered(all.slices)};
}

std::vector<std::uint32_t> all_rows(Eigen::Index count) {
  std::vector<std::uint32_t> out(static_cast<std::size_t>(count));
  std::iota(out.begin(), out.end(), 0u);
  return out;
}

std::vector<double> column(const Eigen::MatrixXd& values, Eigen::Index c, std::span<const std::uint32_t> rows,
                           std::size_t first = 0) {
  std::vector<double> out;
  for (const std::uint32_t r : rows)
    if (const double x = values(Eigen::Index(first + r), c); std::isfinite(x)) out.push_back(x);
  return out;
}

/// What is found of one sample of the judged cells.
struct Found {
  double energy_p = 1., mmd_p = 1.;
  std::vector<std::string> ks_rejections;
  double mvs_median = 0., mvs_max = 0., mvs_ratio = 0.;
  std::string mvs_feature;
  double sholl_inside = 0., neighbour_ratio = 0.;
};

/// The sample in the middle when they are in the order of what `value` says, greatest first where that is good: of two in
/// the middle the worse one.
template <class Value>
const Found& middle(std::span<const Found> found, bool greater_is_better, Value&& value) {
  std::vector<const Found*> order;
  for (const Found& f : found) order.push_back(&f);
  std::ranges::stable_sort(order, [&](const Found* a, const Found* b) {
    return greater_is_better ? value(*a) > value(*b) : value(*a) < value(*b);
  });
  return *order[order.size() / 2];
}

/// Kolmogorov–Smirnov and spreads of medians, feature by feature, where values are missing without them.
void find_of_each_feature(const std::array<FeatureTable, 3>& tables, const Drawn& judged,
                          const ProtocolOptions& options, std::span<Found> found, Judgement& j) {
  const FeatureTable all = distinct(stacked(tables));
  const auto features = std::size_t(all.values.cols());
  const std::size_t n_train = tables[0].size(), n_held = tables[1].size(), n_real = n_train + n_held;
  const std::vector<std::uint32_t> real = all_rows(Eigen::Index(n_real));
  const std::span<const std::uint32_t> held_out = std::span(real).subspan(n_train);

  // Real cells dealt to two samples of the same sizes (none has more cells than were fitted to); the same dealings for all features.
  const std::vector<std::uint32_t> slices =
      numbered(std::span(all.slices).first(std::min(all.slices.size(), n_real)));
  std::vector<std::vector<std::uint8_t>> dealt(
      options.resamples);  // of each real cell: 1 or 2, 0 for neither
  parallel_for(dealt.size(), 16, [&](std::size_t k) {
    Random random(options.seed, k, 0x6d767320);  // "mvs "
    const std::vector<std::uint32_t> deal = statistics::dealt(n_real, slices, random);
    dealt[k].assign(n_real, 0);
    for (std::size_t i = 0; i < n_held + judged.size(); ++i) dealt[k][deal[i]] = i < n_held ? 1 : 2;
  });

  struct OfFeature {
    std::vector<double> p, spread;    // of each sample that is judged
    std::vector<double> real_spread;  // of each dealing; none where medians say nothing
    double usual = 0.;
  };
  std::vector<OfFeature> of(features);
  parallel_for(features, 1, [&](std::size_t f) {
    const auto c = Eigen::Index(f);
    of[f].p.assign(found.size(), 1.), of[f].spread.assign(found.size(), 0.);
    const std::vector<double> a = column(all.values, c, held_out);
    const bool median_says = !all.features[f].name.ends_with(" is defined");  // that of 0 and 1 jumps
    bool any = false;
    for (std::size_t k = 0; k < found.size(); ++k) {
      const std::vector<double> b = column(all.values, c, judged.samples[k], n_real);
      if (a.empty() || b.empty()) continue;  // "… is defined" tells
      any = true;
      of[f].p[k] = kolmogorov_smirnov(a, b).p;
      if (median_says) of[f].spread[k] = median_visible_spread(a, b);
    }
    if (!any || !median_says) return;
    std::vector<std::uint32_t> rising;
    for (const std::uint32_t row : real)
      if (std::isfinite(all.values(row, c))) rising.push_back(row);
    std::ranges::stable_sort(rising, {}, [&](std::uint32_t row) { return all.values(row, c); });
    std::vector<double> one, two;
    for (const auto& deal : dealt) {
      one.clear(), two.clear();
      for (const std::uint32_t row : rising)
        if (deal[row]) (deal[row] == 1 ? one : two).push_back(all.values(row, c));
      of[f].real_spread.push_back(one.empty() || two.empty() ? 0.
                                                             : median_visible_spread_of_sorted(one, two));
    }
    of[f].usual = std::max(.02, quantile(of[f].real_spread, .95));  // medians of counts may hardly differ
  });

  std::vector<double> worst(options.resamples, 0.);
  for (const OfFeature& feature : of)
    for (std::size_t k = 0; k < feature.real_spread.size(); ++k)
      worst[k] = std::max(worst[k], feature.real_spread[k] / feature.usual);
  j.features = features;
  j.mvs_limit = worst.empty() ? 0. : quantile(worst, .95);

  for (std::size_t k = 0; k < found.size(); ++k) {
    std::vector<double> p, spreads;
    for (const OfFeature& feature : of) p.push_back(feature.p[k]);
    const std::vector<double> adjusted = holm(p);
    for (std::size_t f = 0; f < features; ++f) {
      const std::string& name = all.features[f].name;
      if (adjusted[f] < level) found[k].ks_rejections.push_back(name);
      if (of[f].real_spread.empty()) continue;
      const double spread = of[f].spread[k], ratio = spread / of[f].usual;
      spreads.push_back(spread);
      found[k].mvs_max = std::max(found[k].mvs_max, spread);
      if (ratio > found[k].mvs_ratio) found[k].mvs_ratio = ratio, found[k].mvs_feature = name;
    }
    found[k].mvs_median = spreads.empty() ? 0. : quantile(spreads, .5);
  }
}

/// How near cells are to the nearest training cell: the median over cells.
double nearest(const Eigen::MatrixXd& cells, const Eigen::MatrixXd& train) {
  const Eigen::VectorXd least = distances(cells, train).rowwise().minCoeff();
  return quantile(std::span(least.data(), std::size_t(least.size())), .5);
}

using Asked = Criterion::Asked;

void ask(Judgement& j, std::string name, double value, Asked asked, double limit, std::string reason) {
  const bool pass = asked == Asked::at_most    ? value <= limit
                    : asked == Asked::at_least ? value >= limit
                                               : value > limit;
  j.criteria.push_back({std::move(name), pass, value, asked, limit, std::move(reason)});
}

void ask_auc(Judgement& j, const char* name, const char* what, const Estimate& auc, const Estimate& control,
             double most) {
  const double beside = std::max(.5, control.value) + most_beside_control;
  ask(j, name, auc.value, Asked::at_most, std::min(most, beside),
      fmt::format(
          "{} grown from held-out cells with AUC {:.3f} ({:.3f}–{:.3f}); at most {:.2f} is asked, and "
          "{:.3f} where real training cells are told with {:.3f}",
          what, auc.value, auc.lower, auc.upper, most, beside, control.value));
}

/// What is asked of features one by one. Nothing is learned, so that all cells count, however many; and an area has a sign: how much
/// nearer chance has brought the held-out cells to the training cells or to wrong ones is the same for both, and falls out.
/// @param drawn  independent cells that the model is judged by: few differ from training cells by chance
void ask_of_each_alone(Judgement& j, const std::array<FeatureTable, 3>& tables, std::size_t drawn) {
  const double limit = std::max(most_beside_control, 1.96 * std::sqrt(1. / 12. / double(drawn)));
  for (std::size_t f = 0; f < tables[0].features.size(); ++f) {
    const Feature& feature = tables[0].features[f];
    if (feature.alone.empty()) continue;
    const auto above =
        [&](const FeatureTable& cells) {  // the chance that one of them has more than a held-out cell
          const auto of = [&](const FeatureTable& table) {
            return column(table.values, Eigen::Index(f), all_rows(table.values.rows()));
          };
          const Estimate area = area_under_curve(of(tables[1]), of(cells));
          return std::isnan(area.value) ? Estimate{.5, 0., 1.} : area;
        };
    const Judgement::Alone& found = j.alone.emplace_back(
        Judgement::Alone{std::string(feature.alone), above(tables[2]), above(tables[0])});
    ask(j, "auc." + found.name, std::abs(found.grown.value - found.real.value), Asked::at_most, limit,
        fmt::format("by '{}' alone, grown cells have more than held-out ones with AUC {:.3f}, training cells "
                    "with {:.3f}; at most {:.3f} between the two is asked",
                    feature.name, found.grown.value, found.real.value, limit));
  }
}

/// All criteria but those on the controls. With what is known of grown cells what is judged is a control: of it nothing is asked that
/// has to do with diameters, which are right, or with copying, which it is.
Judgement judge_one(const FeatureTable& train, const FeatureTable& held_out, const Drawn& judged,
                    const Judgement* known, const ProtocolOptions& options, Progress& progress) {
  Judgement j;
  j.train = train.size(), j.held_out = held_out.size();
  j.populations = judged.samples.size(), j.compared = judged.size();
  j.longest_run = options.longest_run;
  const std::array<FeatureTable, 3> tables{train, held_out, judged.cells};
  const bool full = known == nullptr;

  const Samples structure = samples_of(tables, structure_of), whole = samples_of(tables, whole_of);
  const auto tell = [&](const Samples& of, bool real, Classifier by) {
    const std::vector<std::uint32_t> rows = all_rows(real ? of.train : of.of_judged().rows());
    DiscriminatorOptions how{.repeats = options.repeats,
                             .trees = options.trees,
                             .permutations = 0,
                             .first = j.compared,
                             .seed = options.seed,
                             .slices = real ? of.slices_of(rows, 0) : of.slices_of_judged(rows)};
    if (!real) how.draws = judged.samples;
    return real ? discriminate(of.of_train(), of.of_held_out(), by, how, progress).auc
                : discriminate(of.of_judged(), of.of_held_out(), by, how, progress).auc;
  };
  constexpr auto forest = Classifier::random_forest;
  j.auc.structure = tell(structure, false, forest);
  j.auc.real_control = full ? tell(structure, true, forest) : known->auc.real_control;
  ask_auc(j, "auc.structure", "by structure a random forest tells", j.auc.structure, j.auc.real_control,
          most_auc);
  ask_of_each_alone(j, tables, (full ? j : *known).populations * j.compared);
  if (full) {
    if (const Samples slopes = samples_of(tables, slopes_of); slopes.values.cols() > 0) {
      j.auc.slopes = tell(slopes, false, forest);
      j.auc.real_control_slopes = tell(slopes, true, forest);
    }
    j.auc.logistic = tell(structure, false, Classifier::logistic);
    j.auc.diameters = tell(whole, false, forest);
    j.auc.real_control_diameters = tell(whole, true, forest);
    ask_auc(j, "auc.diameters", "by structure and diameters a random forest tells", j.auc.diameters,
            j.auc.real_control_diameters, most_auc_diameters);
  }
  j.detectable_auc = detectable_auc(j.compared, j.held_out);

  std::vector<Found> found(judged.samples.size());
  find_of_each_feature(tables, judged, options, found, j);
  j.sholl = band_of(held_out.sholl, train.sholl, j.compared, options.resamples, options.seed);
  j.sholl_grown = mean_curve(judged.cells.sholl);
  const double usual = full ? nearest(whole.of_held_out(), whole.of_train()) : 0.;
  progress.begin("comparing samples", found.size());
  for (std::size_t k = 0; k < found.size(); ++k) {
    const std::vector<std::uint32_t>& rows = judged.samples[k];
    const Eigen::MatrixXd cells = whole.of_judged(rows);
    const std::vector<std::uint32_t> slices = whole.slices_of_judged(rows);
    found[k].energy_p = energy_distance(cells, whole.of_held_out(), options.dealings, options.seed, slices).p;
    found[k].mmd_p = mean_discrepancy(cells, whole.of_held_out(), options.dealings, options.seed, slices).p;
    std::vector<Curve> curves;
    for (const std::uint32_t row : rows) curves.push_back(judged.cells.sholl[row]);
    found[k].sholl_inside = share_inside(mean_curve(curves), j.sholl);
    if (usual > 0.) found[k].neighbour_ratio = nearest(cells, whole.of_train()) / usual;
    progress.advance();
  }
  progress.end();

  j.energy_p = middle(found, true, [](const Found& f) { return f.energy_p; }).energy_p;
  ask(j, "energy_p", j.energy_p, Asked::more_than, least_p,
      fmt::format("energy distance of grown and held-out cells: p = {:.4f}; more than {} is asked",
                  j.energy_p, least_p));
  j.mmd_p = middle(found, true, [](const Found& f) { return f.mmd_p; }).mmd_p;
  ask(j, "mmd_p", j.mmd_p, Asked::more_than, least_p,
      fmt::format("maximum mean discrepancy: p = {:.4f}; more than {} is asked", j.mmd_p, least_p));
  j.ks_rejections = middle(found, false, [](const Found& f) { return f.ks_rejections.size(); }).ks_rejections;
  ask(j, "ks_rejections", double(j.ks_rejections.size()), Asked::at_most, 0.,
      fmt::format("Kolmogorov–Smirnov rejects {} of {} features after Holm's correction{}",
                  j.ks_rejections.size(), j.features,
                  j.ks_rejections.empty() ? "" : ", the first: " + j.ks_rejections.front()));
  j.mvs_median = middle(found, false, [](const Found& f) { return f.mvs_median; }).mvs_median;
  ask(j, "mvs_median", j.mvs_median, Asked::at_most, most_mvs,
      fmt::format("median visible spread of half of the features is at most {:.3f}; {} is asked",
                  j.mvs_median, most_mvs));
  const Found& spread = middle(found, false, [](const Found& f) { return f.mvs_ratio; });
  j.mvs_ratio = spread.mvs_ratio, j.mvs_max = spread.mvs_max, j.mvs_feature = spread.mvs_feature;
  ask(j, "mvs_max", j.mvs_ratio, Asked::at_most, j.mvs_limit,
      fmt::format("the worst feature, {}, has {:.2f} times the spread that real samples stay below in 95 "
                  "of 100; the "
                  "worst of real samples has up to {:.2f} times",
                  j.mvs_feature.empty() ? "none" : j.mvs_feature, j.mvs_ratio, j.mvs_limit));
  j.sholl_inside = middle(found, true, [](const Found& f) { return f.sholl_inside; }).sholl_inside;
  ask(j, "sholl_inside", j.sholl_inside, Asked::at_least, least_inside,
      fmt::format("the mean of Sholl's crossings is in the band of real cells at {:.1f} % of radii; {:.0f} % "
                  "is asked",
                  100. * j.sholl_inside, 100. * least_inside));
  if (!full) return j;

  j.neighbour_ratio = middle(found, true, [](const Found& f) { return f.neighbour_ratio; }).neighbour_ratio;
  ask(j, "copying.neighbour_ratio", j.neighbour_ratio, Asked::at_least, least_neighbour_ratio,
      fmt::format("the nearest training cell is {:.3f} times as far from grown as from held-out cells; at "
                  "least {} is asked",
                  j.neighbour_ratio, least_neighbour_ratio));
  if (j.longest_run)
    ask(j, "copying.longest_run", double(*j.longest_run), Asked::at_most, double(most_run),
        fmt::format("at most {} consecutive branches come from one traced cell; {} are allowed",
                    *j.longest_run, most_run));
  return j;
}

}  // namespace

Judgement judge(const FeatureTable& train, const FeatureTable& held_out, std::span<const FeatureTable> grown,
                std::span<const Control> controls, const ProtocolOptions& options, Progress& progress) {
  if (grown.empty()) throw Error("there are no grown cells to judge; give a population of them");
  std::size_t compared = train.size();
  const auto must_suffice = [](const FeatureTable& table, const char* name) {
    if (table.size() < 4)
      throw Error(fmt::format("{} {} cells are too few to judge; give at least four", table.size(), name));
  };
  must_suffice(train, "training"), must_suffice(held_out, "held-out");
  for (const FeatureTable& population : grown) {
    must_suffice(population, "grown");
    compared = std::min(compared, population.size());
  }
  Judgement j = judge_one(train, held_out, drawn_from(grown, compared), nullptr, options, progress);
  j.grown = grown.front().size();
  for (const Control& control : controls) {
    const Judgement c =
        judge_one(train, held_out, drawn_from(control.cells, compared, grown.size(), options.seed), &j,
                  options, progress);
    ControlResult result{.name = control.name, .auc = c.auc.structure, .rejected = false, .missed = {}};
    std::ranges::copy_if(c.criteria, std::back_inserter(result.missed), std::logical_not{}, &Criterion::pass);
    std::vector<std::string_view> names;
    for (const Criterion& criterion : result.missed) names.push_back(criterion.name);
    result.rejected = !result.missed.empty();
    ask(j, "controls." + control.name, double(result.missed.size()), Asked::at_least, 1.,
        result.rejected
            ? fmt::format("the control '{}' is rejected, as it must be, by {} (on structure AUC {:.3f})",
                          control.name, fmt::join(names, ", "), result.auc.value)
            : fmt::format("the control '{}' is not told from real cells (AUC {:.3f}): these "
                          "cells are too few to judge by, or nothing in them is changed by it",
                          control.name, result.auc.value));
    j.controls.push_back(std::move(result));
  }
  j.pass = std::ranges::all_of(j.criteria, &Criterion::pass);
  return j;
}

}  // namespace forest::statistics
