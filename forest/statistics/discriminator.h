// SPDX-License-Identifier: Apache-2.0
// Can a trained eye tell two samples apart? A classifier learns from most cells of both and scores the rest; the area
// under the curve (AUC) is the chance that it ranks a cell of the second above one of the first: 1 for surely told
// apart, 0.5 for guessing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "forest/core/progress.h"
#include "forest/statistics/two_samples.h"

namespace forest::statistics {

enum class Classifier : std::uint8_t { random_forest, logistic };

struct DiscriminatorOptions {
  std::size_t repeats = 50;  // cross-validations, each with folds of its own
  std::size_t folds =
      5;  // fewer where a sample is so small that a fold would hold less than two of its cells
  std::size_t trees = 200;            // of a random forest
  double ridge = 30.;                 // of a logistic regression; scikit-learn's C is its inverse
  std::size_t permutations = 0;       // cross-validations with kinds dealt anew: what guessing reaches
  std::size_t first = 0, second = 0;  // cells of each that a repeat draws, without repetition; 0 for all
  std::vector<std::vector<std::uint32_t>> draws =
      {};  // or else rows of the first sample, by turns; all as many
  std::uint64_t seed = 0;
  std::vector<std::uint32_t> slices =
      {};  // of the cells, first sample first (dealing.h): a slice is never trained on and tested
};

struct Discrimination {
  /// Mean over repeats and folds. The interval is that of the cells (area_interval of what each contributed), and of what others would have taught
  /// the classifier: no narrower than as permutations differ, or without them than was measured of samples of one population.
  Estimate auc{.5, 0., 1.};
  std::vector<double> repeats;  // the AUC of each
  std::vector<double> null;     // of each permutation, sorted
  // Share of permutations, with what was found, that reach it; 1 without permutations. Each is one cross-validation and what was found
  // the mean of many, so that it is rather too large than too small.
  double p = 1.;
  std::vector<double>
      scores;  // of each cell, first sample first: mean over repeats where it was among the tested
};

/// Rows are cells, columns standardised features. Throws Error when a sample has fewer than four cells.
Discrimination discriminate(const Eigen::MatrixXd& first, const Eigen::MatrixXd& second,
                            Classifier classifier, const DiscriminatorOptions& options,
                            Progress& progress = Progress::none());

/// The smallest AUC above 0.5 that samples of these sizes tell from guessing in four of five cases, one-sided (Hanley & McNeil 1982).
/// @param level  of the test
/// @param null   AUCs of guessing, as Discrimination::null; of 20 and more the variance counts, where it is larger
double detectable_auc(std::size_t first, std::size_t second, double level = .05,
                      const std::vector<double>& null = {});

/// The smallest |Cohen's d| of one normal feature among `features` that Kolmogorov–Smirnov's test finds in four of five cases, at a level
/// of 5 % over all of them (Bonferroni's bound). By samples drawn at random, the same each time: to some percent.
double detectable_effect(std::size_t first, std::size_t second, std::size_t features);

}  // namespace forest::statistics
