// SPDX-License-Identifier: Apache-2.0
// How close the branches of neurons are: what decides which thin ones are drawn for their like.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "forest/scene/forest.h"
#include "forest/scene/level.h"
#include "forest/scene/placed.h"

namespace forest::scene {

/// The closeness (Seen::closeness) of clusters, or that of something they grow into, where that is closer. So nothing that is
/// drawn ends where a branch goes into the depth and gets thin there. It depends on the picture alone, not on what is chosen or
/// hidden, and is worked out once for all that ask as long as the picture stays; any number of threads may ask at a time.
class Closeness {
 public:
  explicit Closeness(Forest forest);

  /// From where they are seen from now on; not while anybody asks.
  void seen_by(const Eye& eye);

  class OfNeuron {
   public:
    /// @param cluster  of the neuron, from 0 on
    float operator()(std::uint32_t cluster) const { return each_ ? each_[cluster] : whole_; }

   private:
    friend class Closeness;
    float whole_ = 0.f;
    const float* each_ = nullptr;  // null: all are as close as the neuron is
  };
  /// @param standing  its number in Forest::standing()
  /// @param placed    where it stands
  OfNeuron of(std::uint32_t standing, const Placed& placed);

 private:
  float* reserve(std::uint32_t standing, std::size_t count);

  Forest forest_;
  std::optional<Eye> eye_;
  std::unique_ptr<std::atomic<const float*>[]> known_;  // by standing
  std::mutex reserving_;
  std::vector<std::uint32_t> standing_;     // whose are known
  std::vector<std::vector<float>> blocks_;  // each of the size that it was made with
  std::size_t block_ = 0, used_ = 0;        // where the next one goes
};

}  // namespace forest::scene
