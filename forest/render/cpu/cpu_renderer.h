// SPDX-License-Identifier: Apache-2.0
// Draws frames on the processor alone, with the keys and the look of render/opengl. Mesa's llvmpipe runs that renderer's
// shaders without a graphics card too, at a third of the speed or less: it executes both sides of every branch for eight
// threads at once and reads memory one value after the other (bench/README.md). Programs take this renderer where there
// is no graphics card; it needs no OpenGL and no display.
#pragma once

#include <memory>

#include "forest/render/renderer.h"

namespace forest::render {

class CpuRenderer final : public Renderer {
 public:
  CpuRenderer();
  ~CpuRenderer() override;

  void load(const frame::Geometry& geometry) override;
  frame::Timing draw(const frame::Frame& frame) override;
  frame::Image read() override;
  double covered() override;
  const frame::Image* image() const override;
  const frame::DepthMap& seen() const override;
  std::span<const std::uint8_t> reached() const override;
  bool concurrent() const override { return true; }
  std::string name() const override;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace forest::render
