// SPDX-License-Identifier: Apache-2.0
// What a picture should look like: every segment of every item as an exact tapered capsule, met by one ray a sample, on
// the CPU. It is slow and plain, so that it is right; pictures drawn quickly are compared with it (brainforest bench seam).
#pragma once

#include <vector>

#include "forest/render/renderer.h"

namespace forest::render {

/// Dots, lines and capsules of a frame are all drawn as capsules, and thin branches by the share of samples that meet
/// them, surfaces by one ray a sample: nothing is stochastic, nothing is left out, nothing is rounded but the last 8 bits. Camera, light, fog, halo and
/// colours are those of the contract; bands are not needed. Samples lie where frame::sample_place says, and every sample
/// has its own halo, as every subframe of the other renderers has.
class ReferenceRenderer final : public Renderer {
 public:
  void load(const frame::Geometry& geometry) override { geometry_ = geometry; }
  frame::Timing draw(const frame::Frame& frame) override;
  frame::Image read() override;
  const frame::DepthMap& seen() const override { return seen_; }  // empty: nothing is guessed to be hidden
  std::string name() const override { return "reference"; }

 private:
  frame::Geometry geometry_;
  frame::DepthMap seen_;
  std::uint32_t width_ = 0, height_ = 0, samples_ = 0;  // samples_: summed so far
  float exposure_ = 1.f;
  std::vector<Vec4> sums_;  // linear light and coverage, one a pixel
};

}  // namespace forest::render
