// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/closeness.h"

#include <algorithm>

namespace forest::scene {
namespace {

// Most neurons are so far that one end of them is as close as the other. Radius by distance.
constexpr float flat = .1f, deep = .2f;
constexpr std::size_t block_size = std::size_t(1) << 18;

void look_at_all(std::span<const Cluster> clusters, const Viewer& viewer, const Eye& eye, float whole,
                 float share, float* close) {
  // The leaves lie behind all others, the last of them first.
  const std::size_t count = clusters.size(), leaves = (count + 1) / 2, first_leaf = count - leaves;
  const auto place_of = [&](std::size_t leaf) { return count - 1 - leaf; };
  for (std::size_t begin = first_leaf; begin < count; begin += Spheres::most) {
    const std::size_t some = std::min(Spheres::most, count - begin);
    SeenTogether seen;
    viewer(Spheres(some, [&](std::size_t i) { return clusters[begin + i].sphere(); }), seen);
    const std::uint32_t in_picture = eye.may_be_in_picture(seen);
    for (std::size_t i = 0; i < some; ++i) {
      const float here = 1.f / std::max(seen.z[i], eye.camera().near);
      close[begin + i] = in_picture >> i & 1u ? whole + share * (here - whole) : 0.f;
    }
  }
  thread_local std::vector<std::uint32_t> behind;  // of a leaf, the next that it does not lead to
  behind.resize(leaves);
  for (std::size_t leaf = leaves; leaf-- > 0;) {
    float closest = close[place_of(leaf)];
    const std::size_t end = std::min<std::size_t>(leaf + 1 + clusters[place_of(leaf)].outgrowth, leaves);
    std::size_t next = leaf + 1;
    for (; next < end; next = behind[next]) closest = std::max(closest, close[place_of(next)]);
    behind[leaf] = std::uint32_t(next), close[place_of(leaf)] = closest;
  }
}

}  // namespace

Closeness::Closeness(Forest forest)
    : forest_(std::move(forest)), known_(new std::atomic<const float*>[forest_.standing().size()] {}) {}

void Closeness::seen_by(const Eye& eye) {
  const bool same = eye_ && eye_->sees_the_same(eye);
  eye_ = eye;
  if (same) return;
  for (const std::uint32_t standing : standing_) known_[standing].store(nullptr, std::memory_order_relaxed);
  standing_.clear();
  block_ = used_ = 0;
}

float* Closeness::reserve(std::uint32_t standing, std::size_t count) {
  const std::lock_guard lock(reserving_);
  standing_.push_back(standing);
  for (; block_ < blocks_.size() && count > blocks_[block_].size() - used_; ++block_) used_ = 0;
  if (block_ == blocks_.size()) blocks_.emplace_back(std::max(block_size, count));
  return &blocks_[block_][std::exchange(used_, used_ + count)];
}

Closeness::OfNeuron Closeness::of(std::uint32_t standing, const Placed& placed) {
  OfNeuron result;
  result.each_ = known_[standing].load(std::memory_order_acquire);
  if (result.each_) return result;
  const Neuron& neuron = forest_.neurons()[forest_.standing()[standing].instance.morphology];
  const auto clusters = forest_.clusters().subspan(neuron.first_cluster, neuron.cluster_count);
  const Viewer viewer = eye_->viewer().within(placed.position, placed.turn);
  const Seen seen = viewer(clusters.front().sphere());
  result.whole_ = seen.closeness(eye_->camera().near);
  const float depth = seen.at.z() > seen.radius ? seen.radius / seen.at.z() : 1.f;
  if (seen.orthographic || depth < flat) return result;
  float* close = reserve(standing, clusters.size());
  look_at_all(clusters, viewer, *eye_, result.whole_, std::min(1.f, (depth - flat) / (deep - flat)), close);
  const std::uint32_t first = neuron.first_cluster;
  for (std::size_t at = clusters.size() / 2; at-- > 1;) {
    const auto [a, b] = clusters[at].children;
    close[at] = std::max(close[a - first], close[b - first]);
  }
  close[0] = result.whole_;
  known_[standing].store(close, std::memory_order_release);
  result.each_ = close;
  return result;
}

}  // namespace forest::scene
