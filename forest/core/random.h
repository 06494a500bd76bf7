// SPDX-License-Identifier: Apache-2.0
// Counter-based random numbers: Philox 4x32-10 (Salmon et al. 2011, "Parallel random numbers: as easy as 1,
// 2, 3"), from Random123. A sequence is a pure function of (seed, item, stream), so a forest is the same at
// any number of threads. The distributions are ours, because those of the standard library differ between
// implementations.
#pragma once

#include <array>
#include <cstdint>

namespace forest {

class Random {
 public:
  using result_type = std::uint32_t;

  /// @param item    what is drawn for, for example the index of a neuron
  /// @param stream  independent sequences of one item, for example 0 topology, 1 geometry, 2 placement
  explicit Random(std::uint64_t seed, std::uint64_t item = 0, std::uint32_t stream = 0)
      : seed_(seed), item_(item), stream_(stream) {}

  std::uint64_t seed() const { return seed_; }
  std::uint64_t item() const { return item_; }

  std::uint32_t operator()();  // 32 uniform bits
  static constexpr result_type min() { return 0; }
  static constexpr result_type max() { return 0xffffffffu; }

  double uniform();                                 // in [0, 1), 53 bits
  double uniform(double low, double high);          // in [low, high)
  std::uint32_t below(std::uint32_t count);         // in [0, count), unbiased; count > 0
  double normal(double mean = 0., double sd = 1.);  // Box–Muller
  double truncated_normal(double mean, double sd, double low, double high);  // by inversion, low <= high
  double exponential(double mean);
  double gamma(double shape, double scale);  // Marsaglia & Tsang 2000
  /// Degrees in (-180, 180] about `mean`. Best & Fisher 1979.
  double von_mises(double mean, double concentration);

 private:
  std::uint64_t seed_, item_;
  std::uint32_t stream_, block_ = 0;
  unsigned used_ = 4;
  std::array<std::uint32_t, 4> words_{};
};

}  // namespace forest
