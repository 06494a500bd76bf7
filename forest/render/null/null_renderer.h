// SPDX-License-Identifier: Apache-2.0
// Draws nothing and checks everything: every test that makes frames sends them through it.
#pragma once

#include "forest/render/renderer.h"

namespace forest::render {

class NullRenderer final : public Renderer {
 public:
  void load(const frame::Geometry& geometry) override;
  frame::Timing draw(const frame::Frame& frame) override;
  frame::Image read() override;  // black, of the last frame's size
  const frame::DepthMap& seen() const override { return seen_; }
  std::string name() const override { return "null"; }

 private:
  frame::Geometry geometry_;
  frame::DepthMap seen_;
  std::uint32_t width_ = 0, height_ = 0;
};

}  // namespace forest::render
