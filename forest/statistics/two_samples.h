// SPDX-License-Identifier: Apache-2.0
// Two samples of one feature: are they of one distribution, and how far apart are they? Values that are NaN are left
// out everywhere; where nothing is left a statistic is NaN and a p is 1.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace forest::statistics {

/// A value with the 95 % interval that its sample allows.
struct Estimate {
  double value, lower, upper;
};

struct KolmogorovSmirnov {
  double statistic;  // largest distance between the two empirical distribution functions
  double p;          // two-sided
  bool exact;        // over all ways to deal the pooled values, ties as they are; else Kolmogorov's limit
};

/// Exact up to a million pairs (Hodges 1958, with ties as in Schröer & Trenkler 1995), beyond that by the series of
/// Kolmogorov 1933 with Stephens' correction.
KolmogorovSmirnov kolmogorov_smirnov(std::span<const double> a, std::span<const double> b);

/// Each p multiplied so that the chance of one false rejection among all of them stays below the level that it is
/// compared with (Holm 1979). In the order given.
std::vector<double> holm(std::span<const double> p);

/// Difference of means (b - a) over the pooled standard deviation.
double cohens_d(std::span<const double> a, std::span<const double> b);

/// Chance that a value of b is larger than one of a, ties counting half: the area under the curve of the feature. The
/// interval is DeLong's (1988) on the logit, never narrower than Hanley & McNeil's (1982) one step from the end, so that
/// full separation of few cells does not look certain.
Estimate area_under_curve(std::span<const double> a, std::span<const double> b);

/// Chance of larger minus chance of smaller: 2 area_under_curve - 1 (Cliff 1993); -1 … 1.
Estimate cliffs_delta(std::span<const double> a, std::span<const double> b);

/// Median visible spread: |median a - median b| over (larger 95th percentile - smaller 5th percentile), as in
/// BlueBrain's synthesis-workflow; 0 … 1. 0 where the medians are the same.
double median_visible_spread(std::span<const double> a, std::span<const double> b);
/// The same for values in rising order, none NaN.
double median_visible_spread_of_sorted(std::span<const double> a, std::span<const double> b);

/// Interpolated linearly between order statistics; `share` in [0, 1]. NaN when there is no value.
double quantile(std::span<const double> values, double share);

/// DeLong's interval of an area from what each cell of both samples contributes: its mean chance to be ordered rightly
/// against the cells of the other.
/// @param learned  of an area by a classifier, how many times the variance of ranks among given cells (Hanley & McNeil) it has at least,
///                 since other cells would have taught it otherwise; 0: of given numbers
Estimate area_interval(double area, std::span<const double> first, std::span<const double> second,
                       double n_first, double n_second, double learned = 0.);

/// Of the area under the curve of samples of these sizes, in which it is so large (Hanley & McNeil 1982).
double area_variance(double area, double n_first, double n_second);

}  // namespace forest::statistics
