// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/discriminator.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numeric>

#include <boost/math/distributions/normal.hpp>

#include "forest/core/error.h"
#include "forest/core/parallel.h"
#include "forest/core/random.h"
#include "forest/statistics/dealing.h"
#include "forest/statistics/logistic.h"
#include "forest/statistics/random_forest.h"
#include "forest/statistics/summary.h"

namespace forest::statistics {
namespace {

using Rows = std::vector<std::uint32_t>;
using Labels = std::vector<std::uint8_t>;
constexpr std::uint32_t deal_stream = 0x6465616c, fold_stream = 0x666f6c64;

void shuffle(Rows& rows, Random& random) {
  for (std::uint32_t i = std::uint32_t(rows.size()); i > 1; --i)
    std::swap(rows[i - 1], rows[random.below(i)]);
}

/// What one cross-validation tells: every row that was drawn, its fold and its score.
struct Scored {
  Rows rows;
  std::vector<std::uint32_t> folds;
  std::vector<double> scores;
};

class CrossValidation {
 public:
  CrossValidation(const Eigen::MatrixXd& first, const Eigen::MatrixXd& second, Classifier classifier,
                  const DiscriminatorOptions& options)
      : options_(options),
        classifier_(classifier),
        sizes_{std::size_t(first.rows()), std::size_t(second.rows())},
        drawn_{options.draws.empty() ? pick(options.first, sizes_[0]) : options.draws.front().size(),
               pick(options.second, sizes_[1])},
        features_(classifier == Classifier::random_forest
                      ? stack(first, second)
                      : Eigen::MatrixXd(first.rows() + second.rows(), 0)) {
    const std::size_t least = std::min(drawn_[0], drawn_[1]);
    if (least < 4)
      throw Error(
          "a population of fewer than four cells cannot be told from another by cross-validation; add cells");
    folds_ = std::clamp<std::size_t>(least / 2, 2, std::max<std::size_t>(2, options.folds));
    if (classifier == Classifier::logistic) {
      const Eigen::MatrixXd X = stack(first, second);
      products_ = X * X.transpose();
    }
    labels_.assign(sizes_[0], 0);
    labels_.resize(sizes_[0] + sizes_[1], 1);
  }

  const Labels& labels() const { return labels_; }
  double drawn(int sample) const { return double(drawn_[sample]); }

  /// @param item  of the random numbers, and of the draws
  Scored run(const Labels& labels, std::uint64_t item) const {
    Random random(options_.seed, item, fold_stream);
    Scored out;
    for (std::uint8_t sample = 0; sample < 2; ++sample) {
      Rows rows;
      if (sample == 0 && !options_.draws.empty())
        rows = options_.draws[item % options_.draws.size()];
      else
        for (std::uint32_t i = 0; i < labels.size(); ++i)
          if (labels[i] == sample) rows.push_back(i);
      shuffle(rows, random);
      rows.resize(drawn_[sample]);
      for (const std::uint32_t row : rows) out.rows.push_back(row);
    }
    out.folds = folds_of(out.rows, labels, random);
    out.scores.resize(out.rows.size());
    for (std::uint32_t fold = 0; fold < folds_; ++fold) {
      Rows train, test, places;
      for (std::uint32_t i = 0; i < out.rows.size(); ++i)
        if (out.folds[i] == fold)
          test.push_back(out.rows[i]), places.push_back(i);
        else
          train.push_back(out.rows[i]);
      const std::vector<double> scores =
          classifier_ == Classifier::logistic
              ? logistic(labels, train, test)
              : forest_scores(features_, labels, train, test, {.trees = options_.trees}, options_.seed,
                              item * 64 + fold);
      for (std::size_t i = 0; i < test.size(); ++i) out.scores[places[i]] = scores[i];
    }
    return out;
  }

 private:
  static std::size_t pick(std::size_t wanted, std::size_t there) {
    return wanted ? std::min(wanted, there) : there;
  }
  static Eigen::MatrixXd stack(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
    Eigen::MatrixXd all(a.rows() + b.rows(), a.cols());
    all << a, b;
    return all;
  }

  /// Slices one after the other, the large ones first, each to the fold that has the fewest cells of its kinds.
  std::vector<std::uint32_t> folds_of(const Rows& rows, const Labels& labels, Random& random) const {
    std::map<std::uint32_t, std::vector<std::uint32_t>> slices;
    for (std::uint32_t i = 0; i < rows.size(); ++i)
      slices[options_.slices.empty() ? i : options_.slices[rows[i]]].push_back(i);
    std::vector<const std::vector<std::uint32_t>*> order;
    for (const auto& [slice, cells] : slices) order.push_back(&cells);
    for (auto i = std::uint32_t(order.size()); i > 1; --i) std::swap(order[i - 1], order[random.below(i)]);
    std::ranges::stable_sort(order, std::greater(), [](const auto* cells) { return cells->size(); });
    std::vector<std::array<std::size_t, 2>> counts(folds_, {0, 0});
    std::vector<std::uint32_t> folds(rows.size());
    for (const auto* cells : order) {
      std::size_t best = 0, least = std::size_t(-1);
      for (std::size_t fold = 0; fold < folds_; ++fold) {
        std::size_t already = 0;
        for (const std::uint32_t i : *cells) already += counts[fold][labels[rows[i]]];
        if (already < least) least = already, best = fold;
      }
      for (const std::uint32_t i : *cells) ++counts[best][labels[rows[i]]], folds[i] = std::uint32_t(best);
    }
    return folds;
  }

  std::vector<double> logistic(const Labels& labels, const Rows& train, const Rows& test) const {
    Labels y;
    for (const std::uint32_t row : train) y.push_back(labels[row]);
    const LogisticFit fit = fit_logistic(products_(train, train), y, options_.ridge);
    const Eigen::VectorXd f = products_(test, train) * fit.cells;
    std::vector<double> scores;
    for (const double x : f) scores.push_back(1. / (1. + std::exp(-(x + fit.intercept))));
    return scores;
  }

  DiscriminatorOptions options_;
  Classifier classifier_;
  std::size_t sizes_[2], drawn_[2], folds_ = 2;
  SortedFeatures features_;
  Eigen::MatrixXd products_;
  Labels labels_;
};

/// 1 where the second is ranked above the first, ½ for a tie.
double ranked(double first, double second) { return second > first ? 1. : second == first ? .5 : 0.; }

/// Over pairs in the same fold: scores of different folds come from different classifiers.
template <class Pair>
void each_pair(const Scored& s, const Labels& labels, Pair&& pair) {
  for (std::size_t i = 0; i < s.rows.size(); ++i)
    if (!labels[s.rows[i]])
      for (std::size_t j = 0; j < s.rows.size(); ++j)
        if (labels[s.rows[j]] && s.folds[i] == s.folds[j]) pair(i, j, ranked(s.scores[i], s.scores[j]));
}

constexpr std::size_t enough = 20;        // AUCs, for a variance
constexpr double four_of_five = .841621;  // standard deviations, of the normal distribution's quantile

double null_variance(const std::vector<double>& null) {
  const double sd = summarize(null).sd;
  return sd * sd;
}

double auc_of(const Scored& s, const Labels& labels) {
  double right = 0., pairs = 0.;
  each_pair(s, labels, [&](std::size_t, std::size_t, double r) { right += r, ++pairs; });
  return pairs > 0. ? right / pairs : .5;
}

}  // namespace

Discrimination discriminate(const Eigen::MatrixXd& first, const Eigen::MatrixXd& second,
                            Classifier classifier, const DiscriminatorOptions& options, Progress& progress) {
  const CrossValidation validation(first, second, classifier, options);
  const Labels& labels = validation.labels();
  Discrimination out;

  std::vector<Scored> scored(std::max<std::size_t>(1, options.repeats));
  std::vector<double> null(options.permutations);
  progress.begin("telling apart", scored.size() + null.size());
  parallel_for(scored.size() + null.size(), 1, [&](std::size_t i) {
    if (i < scored.size()) {
      scored[i] = validation.run(labels, i);
    } else {
      const std::size_t k = i - scored.size();
      Random random(options.seed, k, deal_stream);
      const Rows order = dealt(labels.size(), options.slices, random);
      Labels anew(labels.size(), 0);
      for (std::size_t j = std::size_t(first.rows()); j < order.size(); ++j) anew[order[j]] = 1;
      null[k] = auc_of(validation.run(anew, i), anew);
    }
    progress.advance();
  });
  progress.end();

  const std::size_t n = labels.size();
  std::vector<double> right(n), pairs(n), sums(n), times(n);
  for (const Scored& s : scored) {
    out.repeats.push_back(auc_of(s, labels));
    each_pair(s, labels, [&](std::size_t i, std::size_t j, double r) {
      for (const std::size_t k : {i, j}) right[s.rows[k]] += r, ++pairs[s.rows[k]];
    });
    for (std::size_t i = 0; i < s.rows.size(); ++i) sums[s.rows[i]] += s.scores[i], ++times[s.rows[i]];
  }
  std::vector<double> share[2];
  for (std::size_t i = 0; i < n; ++i) {
    if (pairs[i] > 0.) share[labels[i]].push_back(right[i] / pairs[i]);
    out.scores.push_back(times[i] > 0. ? sums[i] / times[i] : .5);
  }
  std::ranges::sort(null);
  const double area = mean(out.repeats);
  const auto reach = null.end() - std::ranges::lower_bound(null, area);
  if (!null.empty()) out.p = (double(reach) + 1.) / (double(null.size()) + 1.);
  const double first_drawn = validation.drawn(0), second_drawn = validation.drawn(1);
  // Where nothing is to be learnt areas of forests had 1.5 times the variance of ranks among given cells, of regressions 1.9 times.
  constexpr double usual = 1.75;
  const double learned =
      null.size() >= enough ? null_variance(null) / area_variance(.5, first_drawn, second_drawn) : usual;
  out.auc = area_interval(area, share[0], share[1], first_drawn, second_drawn, learned);
  out.null = std::move(null);
  return out;
}

double detectable_auc(std::size_t first, std::size_t second, double level, const std::vector<double>& null) {
  const double m = double(first), n = double(second);
  if (m < 1. || n < 1.) return 1.;
  const double chance = (m + n + 1.) / (12. * m * n),
               wider = null.size() >= enough ? std::max(1., null_variance(null) / chance) : 1.,
               reach = boost::math::quantile(complement(boost::math::normal(), level));
  double low = .5, high = 1.;
  for (int i = 0; i < 50; ++i) {
    const double a = .5 * (low + high), spread = area_variance(a, m, n);
    (a - .5 < std::sqrt(wider) * (reach * std::sqrt(chance) + four_of_five * std::sqrt(spread)) ? low
                                                                                                : high) = a;
  }
  return high;
}

double detectable_effect(std::size_t first, std::size_t second, std::size_t features) {
  if (first == 0 || second == 0) return std::numeric_limits<double>::infinity();
  // Of more cells than these effects go with the square root of their number.
  constexpr std::size_t most = 100, draws = 400;
  const double scale = std::max(1., double(std::max(first, second)) / double(most));
  const auto cells = [&](std::size_t n) {
    return std::max<std::size_t>(1, std::size_t(std::lround(double(n) / scale)));
  };
  const double level = .05 / double(std::max<std::size_t>(features, 1));
  std::vector<std::vector<double>> a(draws), b(draws);
  for (std::size_t i = 0; i < draws; ++i) {
    Random random(0, i, 0x706f7765);  // "powe"
    for (std::size_t k = 0; k < cells(first); ++k) a[i].push_back(random.normal(0., 1.));
    for (std::size_t k = 0; k < cells(second); ++k) b[i].push_back(random.normal(0., 1.));
  }
  const auto finds = [&](double d) {
    std::vector<std::uint8_t> found(draws);
    parallel_for(draws, 8, [&](std::size_t i) {
      std::vector<double> moved = b[i];
      for (double& x : moved) x += d;
      found[i] = kolmogorov_smirnov(a[i], moved).p <= level;
    });
    return double(std::ranges::count(found, 1)) >= .8 * double(draws);
  };
  double low = 0., high = 16.;  // normals as far apart do not overlap
  if (!finds(high)) return std::numeric_limits<double>::infinity();
  for (int i = 0; i < 12; ++i) {
    const double d = .5 * (low + high);
    (finds(d) ? high : low) = d;
  }
  return high / std::sqrt(scale);
}

}  // namespace forest::statistics
