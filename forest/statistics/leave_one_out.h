// SPDX-License-Identifier: Apache-2.0
// Few cells, grown ones on trial: every traced cell is set beside cells of a model that never saw it. So few cells cannot show that
// traced and grown are alike; what is asked is whether they can be shown to differ, and what could have been seen at all.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "forest/core/progress.h"
#include "forest/statistics/features.h"
#include "forest/statistics/two_samples.h"
#include "forest/statistics/typical.h"

namespace forest::statistics {

struct LeaveOneOutOptions {
  std::size_t repeats = 50;  // forests of each cell, each with grown cells of its own to learn from
  std::size_t trees = 100;   // of each forest
  std::uint64_t seed = 0;
};

/// A traced cell among those grown without it.
struct LeftOut {
  std::string cell;
  Typicality typicality;              // conformal p among the grown cells
  double structure = .5, whole = .5;  // share of grown cells that a forest ranks as more grown than this one
};

/// A feature in all pairs of a traced cell and a cell grown without it.
struct PairedFeature {
  Feature feature;
  double auc = .5;  // share of pairs in which the grown cell has the larger value
  double p = 1.;    // that the ranks of the traced cells are as much to one side by chance: exact, two-sided
  double p_holm = 1.;     // over all features
  std::size_t cells = 0;  // traced cells in which it is defined
};

struct LeaveOneOut {
  std::size_t traced = 0, grown = 0;  // grown: for each traced cell, the fewest
  std::vector<LeftOut> cells;
  std::size_t strange = 0;                            // cells of p ≤ .05 among those grown without them
  double strange_p = 1.;                              // that as many are by chance
  Estimate structure{.5, 0., 1.}, whole{.5, 0., 1.};  // AUC in all pairs: mean over cells
  std::vector<PairedFeature> features;                // smallest p first
  std::size_t rejections = 0;                         // of p_holm ≤ .05
  double neighbour_ratio =
      0.;  // median distance to the nearest cell that the model saw: of grown over left-out cells
  double detectable_auc = 1.;  // the smallest that so many cells would show in four of five cases

  /// By the cells, the pairs or a feature.
  bool told_apart() const;
};

/// Throws Error for fewer traced cells than can be left out one by one: to be asked before any is grown.
void must_be_enough(std::size_t traced);

/// @param traced  three or more cells; cells of one slice (dealing.h) are left out together
/// @param grown   of each traced cell those of a model that saw neither it nor its sisters, at least 19
/// Throws Error when there are fewer, or the tables differ in their features.
LeaveOneOut leave_one_out(const FeatureTable& traced, std::span<const FeatureTable> grown,
                          const LeaveOneOutOptions& options, Progress& progress = Progress::none());

/// The answer in plain words, with what so few cells cannot show.
std::string sentence(const LeaveOneOut& result);

}  // namespace forest::statistics
