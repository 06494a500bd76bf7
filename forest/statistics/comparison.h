// SPDX-License-Identifier: Apache-2.0
// Two populations side by side: can they be told apart, by what, and how surely?
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "forest/core/progress.h"
#include "forest/statistics/bands.h"
#include "forest/statistics/discriminator.h"
#include "forest/statistics/features.h"
#include "forest/statistics/sample_distance.h"
#include "forest/statistics/two_samples.h"

namespace forest::statistics {

/// One feature in both populations.
struct Difference {
  Feature feature;
  std::size_t cells_a = 0, cells_b = 0;                   // where it is defined
  double mean_a = 0., mean_b = 0., sd_a = 0., sd_b = 0.;  // of these
  Estimate delta{0., 0., 0.};                             // Cliff's; positive where b is larger
  double cohens_d = 0.;
  KolmogorovSmirnov ks{0., 1., true};
  double p_holm = 1.;  // of Kolmogorov–Smirnov, over all features that can be compared
  double mvs = 0.;
  double importance = 0.;  // in a random forest on all features

  /// Where only one population has it nothing is compared: that it is defined is a feature of its own.
  bool compared() const { return cells_a > 0 && cells_b > 0; }
};

struct ComparisonOptions {
  std::size_t repeats = 50, trees = 100, permutations = 199;
  std::size_t dealings = 1999;
  std::uint64_t seed = 0;
};

struct Comparison {
  std::size_t cells_a = 0, cells_b = 0;
  std::vector<Difference> differences;  // those that differ after Holm first, then by |delta|
  Discrimination forest, logistic;      // on all features, with permutations
  Discrimination structure;             // random forest without what depends on diameters
  Discrimination branching;  // … nor on how densely branches were traced or how cells lay; of no features: .5
  DistanceTest energy, mmd;
  DistanceTest barcodes;  // of mean persistence images
  Band sholl;             // around the mean of a, as wide as a sample like b may be by chance
  Curve sholl_b;
  double sholl_inside = 1.;
  double detectable_auc = 1., detectable_effect = 0.;  // in four of five cases
  double p =
      1.;  // that one population looks as different: five times the smallest p of forest, energy, mmd, barcodes and features

  bool told_apart() const { return p <= .05; }
  std::size_t compared() const {
    return std::size_t(std::ranges::count_if(differences, &Difference::compared));
  }
};

/// Throws Error when a population has fewer than four cells.
Comparison compare(const FeatureTable& a, const FeatureTable& b, const ComparisonOptions& options,
                   Progress& progress = Progress::none());

/// The answer in one or two plain sentences.
std::string sentence(const Comparison& comparison, const std::string& a, const std::string& b);

}  // namespace forest::statistics
