// SPDX-License-Identifier: Apache-2.0
#include "forest/render/opengl/opengl_renderer.h"

#include "forest/render/opengl/context.h"

#include "tests/renderer_laws.h"

namespace forest::render {
namespace {

// With the context that it needs.
class Offscreen final : public Renderer {
 public:
  void load(const frame::Geometry& geometry) override { renderer_.load(geometry); }
  frame::Timing draw(const frame::Frame& frame) override { return renderer_.draw(frame); }
  frame::Image read() override { return renderer_.read(); }
  const frame::DepthMap& seen() const override { return renderer_.seen(); }
  std::string name() const override { return renderer_.name(); }

 private:
  OffscreenContext context_;
  OpenGLRenderer renderer_;
};

INSTANTIATE_TEST_SUITE_P(OpenGL, RendererLaws, testing::Values(+[]() -> std::unique_ptr<Renderer> {
                           return std::make_unique<Offscreen>();
                         }));

}  // namespace
}  // namespace forest::render
