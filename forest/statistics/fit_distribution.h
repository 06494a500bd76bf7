// SPDX-License-Identifier: Apache-2.0
// From values to the distribution that they were drawn from: atoms and steps are found first, every family that the values
// allow is fitted by maximum likelihood, and the one is taken that an information criterion prefers.
//
//   const DistributionFit f = fit_distribution(lengths);
//   f.name == "gamma"; f.distribution.expression() == "gamma(2.1, 14.6)"; f.p == .43
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "forest/statistics/distribution.h"

namespace forest::statistics {

enum class InformationCriterion : std::uint8_t { aicc, bic };

struct FitOptions {
  /// What may be chosen, "gamma" or a mixture of two or three, "normal + normal". Empty: all families that the values
  /// allow, and with 100 values mixtures of two, with 300 of three of one family.
  std::vector<std::string> families = {};
  bool angles = false;  // degrees on the circle: values are brought to (-180, 180]
  /// Beyond which no value can lie. Then families count from there (of both limits from the one nearer to the median), and one that
  /// has more than one of 10,000 values beyond it, or of 1,000 beyond the other, is not chosen unless it is named. What lies on it is
  /// an atom. Where a value lies beyond it there is none; of values in steps only a least of 0 is heeded.
  std::optional<double> least = {}, most = {};
  bool mixtures = true;  // of enough values, unless families are named
  bool atoms = true;     // look for values that come back exactly and for the steps of a tracer
  InformationCriterion criterion = InformationCriterion::bic;
  double confidence = 0.95;
  std::size_t replicates = 99;  // of the parametric bootstrap behind p; 0: p is not worked out
  std::uint64_t seed = 0;       // of the bootstrap
};

/// A parameter with the interval in which it lies by the chosen confidence: from the observed Fisher information, for the
/// limits of uniform and truncnormal from the spacing of values near them, for atoms by Wilson 1927. NaN: not known.
struct ParameterEstimate {
  std::string name;  // "shape"; of a mixture "2 shape", "2 weight"; of an atom "atom at 1"
  double value, lower, upper;
};

struct Candidate {
  std::string name;
  double log_likelihood;
  int parameters;    // a limit, of uniform and truncnormal, counts for two
  double aicc, bic;  // aicc: infinite for fewer values than it needs
};

struct DistributionFit {
  static constexpr double nan = std::numeric_limits<double>::quiet_NaN();

  Distribution distribution;
  std::string name =
      "none";  // of the components: "gamma + gamma", "1 - (gamma + gamma)"; "values": nothing but atoms; "none": there was no value
  std::size_t count = 0;     // values that were used
  std::size_t left_out = 0;  // not numbers, or beyond 1e100
  std::size_t in_atoms = 0;
  std::vector<ParameterEstimate> estimates;
  std::vector<Candidate> candidates;  // all that could be fitted, the chosen one first; of what is no atom
  double kolmogorov = nan;            // largest distance between the two distribution functions, atoms aside
  double anderson_darling = nan;
  /// How often values that were really drawn from the chosen distribution, fitted again, lie as far from it by Anderson
  /// and Darling's measure. Of more than 1000 values it is worked out for 1000 of them, drawn by chance: of many traced
  /// values every family is rejected, and `kolmogorov` says by how much it matters.
  double p = nan;
};

/// Throws Error when a family is not known. Values may be few, all the same or none: then the distribution is made of atoms.
DistributionFit fit_distribution(std::span<const double> values, const FitOptions& options = {});

/// The interval of a chance that was seen `hits` times of `count` (Wilson 1927).
ParameterEstimate chance_of(std::string name, std::size_t hits, std::size_t count, double confidence = 0.95);

}  // namespace forest::statistics
