// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <utility>

#include <epoxy/gl.h>

#include "forest/render/opengl/offscreen.h"

#include "tests/refused.h"
#include "tests/renderer_laws.h"

namespace forest::render {
namespace {

std::unique_ptr<Renderer> make() { return std::make_unique<OffscreenRenderer>(); }
INSTANTIATE_TEST_SUITE_P(OpenGL, RendererLaws, testing::Values(make));
INSTANTIATE_TEST_SUITE_P(OpenGL, SurfaceLaws, testing::Values(make));

// Sets what a driver answers, and puts it right again.
template <class Function>
class Answer {
 public:
  Answer(Function& of, Function instead) : of_(of), before_(std::exchange(of, instead)) {}
  ~Answer() { of_ = before_; }

 private:
  Function& of_;
  Function before_;
};

TEST(OpenGL, ACardThatWasResetIsToldAndDrawsNoBlackPicture) {
  Fixture f(make);
  f.add({-20, 3, 0}, {15, -8, 0}, 6.f);
  f.frame.capsules = f.items;
  EXPECT_GT(f.draw().covered, 0.);
  {
    const Answer lost(
        epoxy_glGetGraphicsResetStatus, +[]() -> GLenum { return GL_UNKNOWN_CONTEXT_RESET; });
    EXPECT_NE(refused([&] { f.renderer->draw(f.frame); }).find("graphics card was reset"), std::string::npos);
    EXPECT_NE(refused([&] { (void)f.renderer->read(); }).find("graphics card was reset"), std::string::npos);
  }
  EXPECT_GT(f.draw().covered, 0.);
}

TEST(OpenGL, WhatADriverWouldReadInPartIsRefused) {
  Fixture f(make);
  f.add({-20, 3, 0}, {15, -8, 0}, 6.f);
  f.frame.capsules = f.items;
  {
    const Answer small(
        epoxy_glGetIntegerv, +[](GLenum name, GLint* value) {
          if (name == GL_MAX_TEXTURE_BUFFER_SIZE) *value = 1000;
        });
    EXPECT_NE(refused([&] { f.draw(); }).find("too large for the graphics driver"), std::string::npos);
  }
  EXPECT_GT(f.draw().covered, 0.);
}

}  // namespace
}  // namespace forest::render
