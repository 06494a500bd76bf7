// SPDX-License-Identifier: Apache-2.0
#include "forest/render/opengl/offscreen.h"

#include "tests/renderer_laws.h"

namespace forest::render {
namespace {

INSTANTIATE_TEST_SUITE_P(OpenGL, RendererLaws, testing::Values(+[]() -> std::unique_ptr<Renderer> {
                           return std::make_unique<OffscreenRenderer>();
                         }));

}  // namespace
}  // namespace forest::render
