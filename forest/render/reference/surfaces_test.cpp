// SPDX-License-Identifier: Apache-2.0
#include "forest/render/reference/reference_renderer.h"

#include "tests/renderer_laws.h"

namespace forest::render {
namespace {

GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(RendererLaws);  // they are of what is drawn quickly
INSTANTIATE_TEST_SUITE_P(Reference, SurfaceLaws, testing::Values(+[]() -> std::unique_ptr<Renderer> {
                           return std::make_unique<ReferenceRenderer>();
                         }));

}  // namespace
}  // namespace forest::render
