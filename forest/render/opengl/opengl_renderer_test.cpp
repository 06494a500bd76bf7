// SPDX-License-Identifier: Apache-2.0
#include "forest/render/opengl/offscreen.h"

#include "tests/renderer_laws.h"

namespace forest::render {
namespace {

std::unique_ptr<Renderer> make() { return std::make_unique<OffscreenRenderer>(); }
INSTANTIATE_TEST_SUITE_P(OpenGL, RendererLaws, testing::Values(make));
INSTANTIATE_TEST_SUITE_P(OpenGL, SurfaceLaws, testing::Values(make));

}  // namespace
}  // namespace forest::render
