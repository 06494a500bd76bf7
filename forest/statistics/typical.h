// SPDX-License-Identifier: Apache-2.0
// How typical is a cell of a population? Conformal prediction (Vovk, Gammerman & Shafer 2005): the cell is put among the
// others, each is given a score of strangeness by the same rule, and p is the share of cells at least as strange. For a
// cell of the population every p is equally likely, whatever the distribution and however many the features.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "forest/statistics/features.h"

namespace forest::statistics {

/// One feature of the cell beside the population's.
struct Oddity {
  Feature feature;
  double value = 0.;
  double median = 0., low = 0., high = 0.;  // of the population, with 5th and 95th percentile
  double strangeness =
      0.;  // distance from the median over that which 95 % of cells stay below; 1 is at the edge. Where
           // 95 % are at the median, 0.05 over p.
  double p = 1.;          // of this feature alone, two-sided
  bool abnormal = false;  // stranger than the strangest feature of 95 % of the cells
  bool outside = false;   // less, or more, than in every cell of the population
};

struct Typicality {
  double p = 1.;          // of the three below: three times the smallest (Bonferroni)
  double p_whole = 1.;    // mean distance to the nearest five cells, all features together
  double p_feature = 1.;  // the strangest single feature
  double p_missing =
      1.;  // how many features are not defined: a cell without dendrites is strange in no dendrite's length
  std::size_t cells = 0;         // of the population, without the cell itself
  std::vector<Oddity> oddities;  // the strangest first

  // Of few cells each is the first or the last in many metrics, so that how many says something only beside what is usual.
  std::size_t metrics = 0;       // that the cell and five others have
  std::size_t outside = 0;       // of these: where the cell is outside
  double outside_usual = 0.;     // of these: where a cell of the population is, left out in turn: the median
  std::size_t outside_most = 0;  // and the most
  std::size_t as_much_outside = 0;  // cells of the population that are in as many as the cell, or more

  /// What p is where nothing of the population is as strange: with so few cells it cannot be less.
  double least_p() const { return std::min(1., 3. / double(cells + 1)); }
};

/// @param cell  a table of one row; the same cell among the population is left out
/// Throws Error for a population of fewer than five cells.
Typicality typicality(const FeatureTable& population, const FeatureTable& cell);

}  // namespace forest::statistics
