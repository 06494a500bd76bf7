// SPDX-License-Identifier: Apache-2.0
// Are grown cells statistically indistinguishable from traced ones? The acceptance test, on tables of features alone: cells
// that a model was fitted to, cells of the same population that it never saw, cells that it grew. Every criterion has its
// limit from what real cells do among themselves, wherever that can be asked.
//
// A model is judged and not a draw of it: of few cells one draw differs from the next by more than models do. So it may grow
// several populations. Every criterion is asked of each, and the median counts; each cross-validation has another of them, as
// that of real cells has other training cells, and the mean counts. Controls are dealt to as many samples and judged alike.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "forest/core/progress.h"
#include "forest/statistics/bands.h"
#include "forest/statistics/discriminator.h"
#include "forest/statistics/features.h"

namespace forest::statistics {

struct ProtocolOptions {
  std::size_t repeats = 50;      // cross-validations of each AUC
  std::size_t trees = 100;       // of each random forest
  std::size_t dealings = 1999;   // of energy distance and mean discrepancy
  std::size_t resamples = 1000;  // of real cells, for spreads of medians and Sholl's band
  std::uint64_t seed = 0;
  std::optional<std::size_t> longest_run =
      {};  // consecutive branches from one traced cell, where the model knows
};

/// One thing that is asked of the grown cells.
struct Criterion {
  enum class Asked : std::uint8_t { at_most, at_least, more_than };

  std::string name;  // "auc.structure"
  bool pass = false;
  double value = 0.;  // what was found; of a control, how many criteria it misses
  Asked asked = Asked::at_most;
  double limit = 0.;
  std::string reason;  // a sentence with the value and the limit
};

/// Cells that are known to be wrong, which the protocol must tell from real ones.
struct Control {
  std::string name;  // "stretched"
  FeatureTable cells;
};

struct ControlResult {
  std::string name;
  Estimate auc;           // against held-out cells, on structure
  bool rejected = false;  // by any criterion but copying, as the grown cells would be
  std::vector<Criterion> missed;
};

struct Judgement {
  bool pass = false;  // every criterion, and every control was rejected
  std::vector<Criterion> criteria;
  std::size_t train = 0, held_out = 0, grown = 0;  // cells; grown: of each population
  std::size_t populations = 0;
  std::size_t compared = 0;  // grown cells of a population that are judged, and training cells that stand
                             // beside them: the smaller number

  struct Areas {
    // Grown against held-out cells, by forests.
    Estimate structure{}, diameters{};
    // Training against held-out cells of the same numbers.
    Estimate real_control{}, real_control_diameters{};
    // No criteria: on structure by regression, and by a forest on how steep branches are in the slice.
    Estimate logistic{}, slopes{}, real_control_slopes{};
  } auc;
  /// One number without a forest: the chance that a cell has more of it than a held-out one.
  struct Alone {
    std::string name;  // that of Feature
    Estimate grown, real;
  };
  std::vector<Alone> alone;
  double detectable_auc = 1.;  // in four of five cases, by these numbers
  double energy_p = 1., mmd_p = 1.;
  std::vector<std::string>
      ks_rejections;                     // features, after Holm's correction at 5 %, in the median population
  std::size_t features = 0;              // that were asked
  double mvs_median = 0., mvs_max = 0.;  // over features
  std::string mvs_feature;               // of the worst, by its 95th percentile of real against real
  double mvs_ratio = 0.,
         mvs_limit = 0.;     // of the worst to that percentile, and what 95 % of real samples stay below
  double sholl_inside = 0.;  // share of radii
  Band sholl;                // of the held-out cells
  Curve sholl_grown;         // of all populations
  double neighbour_ratio =
      0.;  // median distance to the nearest training cell, of grown over that of held-out cells
  std::optional<std::size_t> longest_run;
  std::vector<ControlResult> controls;
};

/// @param grown  populations that the model grew, one or more
/// Throws Error when a table has fewer than four cells, tables differ in their features, or nothing is grown.
Judgement judge(const FeatureTable& train, const FeatureTable& held_out, std::span<const FeatureTable> grown,
                std::span<const Control> controls, const ProtocolOptions& options,
                Progress& progress = Progress::none());

}  // namespace forest::statistics
