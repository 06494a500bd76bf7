// SPDX-License-Identifier: Apache-2.0
// The OpenGL renderer with a context of its own, for pictures that no window shows.
#pragma once

#include "forest/render/opengl/context.h"
#include "forest/render/opengl/opengl_renderer.h"

namespace forest::render {

/// Throws Error where there is no OpenGL 4.5. Several may be used in turn, by one thread.
class OffscreenRenderer final : public Renderer {
 public:
  explicit OffscreenRenderer(Habit habit = Habit::of_driver) : renderer_(habit) {}
  ~OffscreenRenderer() override { context_.make_current(); }

  void load(const frame::Geometry& geometry) override { here().load(geometry); }
  frame::Timing draw(const frame::Frame& frame) override { return here().draw(frame); }
  frame::Image read() override { return here().read(); }
  double covered() override { return here().covered(); }
  const frame::DepthMap& seen() const override { return renderer_.seen(); }
  std::string name() const override { return renderer_.name(); }
  bool on_processor() const { return renderer_.on_processor(); }

 private:
  OpenGLRenderer& here() {
    context_.make_current();
    return renderer_;
  }

  OffscreenContext context_;
  OpenGLRenderer renderer_;
};

}  // namespace forest::render
