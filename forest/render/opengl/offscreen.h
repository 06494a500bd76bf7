// SPDX-License-Identifier: Apache-2.0
// The OpenGL renderer with a context of its own, for pictures that no window shows.
#pragma once

#include "forest/render/opengl/context.h"
#include "forest/render/opengl/opengl_renderer.h"

namespace forest::render {

/// Throws Error where there is no OpenGL 4.5.
class OffscreenRenderer final : public Renderer {
 public:
  void load(const frame::Geometry& geometry) override { renderer_.load(geometry); }
  frame::Timing draw(const frame::Frame& frame) override { return renderer_.draw(frame); }
  frame::Image read() override { return renderer_.read(); }
  const frame::DepthMap& seen() const override { return renderer_.seen(); }
  std::string name() const override { return renderer_.name(); }
  bool on_processor() const { return renderer_.on_processor(); }

 private:
  OffscreenContext context_;
  OpenGLRenderer renderer_;
};

}  // namespace forest::render
