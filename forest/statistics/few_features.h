// SPDX-License-Identifier: Apache-2.0
// Some features of a neuron by their names, for whoever needs no others: a grammar that prefers some neurons to others asks this
// of every neuron that it grows.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <utility>
#include <vector>

#include "forest/morphology/morphology.h"
#include "forest/statistics/arbors.h"

namespace forest::statistics {

struct Metric;

class FewFeatures {
 public:
  /// A metric of the neuron, or the mean, standard deviation or median of one of its parts, of the sections of one kind:
  /// "basal total_length", "dendrite contraction sd". Throws Error that says how features are named.
  void add(std::string_view name);
  std::size_t size() const { return count_; }

  /// In the order in which they were added; the numbers that features.h measures, NaN where not defined.
  std::vector<double> measure(const Morphology& neuron) const;

 private:
  enum class Part : std::uint8_t { whole, mean, sd, median };
  struct One {
    const Metric* metric;
    std::vector<std::pair<Part, std::size_t>> parts;  // with their places
  };
  struct OfKinds {
    KindSet kinds;
    std::vector<One> metrics;
  };
  std::vector<OfKinds> groups_;
  std::size_t count_ = 0;
};

}  // namespace forest::statistics
