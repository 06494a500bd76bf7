// SPDX-License-Identifier: Apache-2.0
// What is drawn given something else (the order of a branch, its path distance, its radius), without a family: values by
// bins, as in L-NDED (Donohue & Ascoli 2008), whose bins hold at least 85 values.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "forest/core/random.h"
#include "forest/statistics/fit_distribution.h"

namespace forest::statistics {

struct Binning {
  std::size_t least = 85;  // values a bin; fewer only when there are fewer in all
  std::size_t most = 24;   // bins
};

/// The upper edges of bins, rising, the last one the largest of `given`: a value belongs to the first bin whose edge is not
/// below it, beyond the last to the last (as tables of the notation). Equal values are never parted. NaN is passed over;
/// empty when there is nothing else.
std::vector<double> bin_edges(std::span<const double> given, const Binning& binning = {});
std::size_t bin_of(std::span<const double> edges, double given);  // edges not empty

/// How often something happens, by bins.
struct ChanceBin {
  double upper;
  std::size_t count;
  ParameterEstimate chance;
};
/// @param happened  one an entry of `given`
std::vector<ChanceBin> chance_by(std::span<const char> happened, std::span<const double> given,
                                 const Binning& binning = {});
/// "table fork = 0: 0.92, 1: 0.7": what the notation reads.
std::string table_text(std::string_view name, std::span<const ChanceBin> bins);

/// The quantiles of each bin, between which it is linear.
struct Conditional {
  struct Bin {
    double upper;
    std::size_t count;
    std::vector<double> quantiles;  // at 0, 1/n, 2/n … 1
  };
  std::vector<Bin> bins;

  double quantile(double given, double p) const;
  double cdf(double given, double value) const;
  double draw(double given, Random& random) const { return quantile(given, random.uniform()); }
  /// Declarations of the notation, the last `distribution NAME(variable) = …`.
  std::string text(std::string_view name, std::string_view variable) const;
};

/// Entries of which one is NaN are passed over. Throws Error when none is left.
/// @param steps  between the quantiles of a bin
Conditional conditional(std::span<const double> values, std::span<const double> given,
                        const Binning& binning = {}, std::size_t steps = 16);

}  // namespace forest::statistics
