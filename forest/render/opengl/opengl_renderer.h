// SPDX-License-Identifier: Apache-2.0
// Draws frames with compute shaders alone (OpenGL 4.5 core): each thread splats a segment into a buffer of 32-bit keys
// (depth, colour, shade) with atomicMin; a last pass turns keys into colour. The same code runs on graphics cards and
// on llvmpipe, and the picture does not depend on the order in which threads run.
#pragma once

#include <cstdint>
#include <memory>

#include "forest/render/renderer.h"

namespace forest::render {

/// How work is cut: as suits the driver, or one of the two kinds whatever it is. The pictures are the same.
enum class Habit : std::uint8_t { of_driver, of_cards, of_processors };

/// Needs a current OpenGL 4.5 context, at construction and at every call (OffscreenContext, or a window's).
class OpenGLRenderer final : public Renderer {
 public:
  explicit OpenGLRenderer(Habit habit = Habit::of_driver);
  ~OpenGLRenderer() override;

  void load(const frame::Geometry& geometry) override;
  frame::Timing draw(const frame::Frame& frame) override;
  frame::Image read() override;
  double covered() override;
  const frame::DepthMap& seen() const override;
  std::string name() const override;
  /// Whether the driver is a program that draws on the processor, as Mesa's llvmpipe is.
  bool on_processor() const;

  /// Copies the last frame into the bottom left corner of the framebuffer object `target` (a window's), without
  /// leaving the graphics card.
  void show(unsigned target);

 private:
  struct Device;
  std::unique_ptr<Device> device_;
};

}  // namespace forest::render
