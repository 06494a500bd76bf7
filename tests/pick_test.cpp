// SPDX-License-Identifier: Apache-2.0
// What is picked is what is seen: the reference renderer's picture, one ray through the middle of every pixel, shows the
// colour of the neuron that a pick finds there.
#include "forest/scene/pick.h"

#include <gtest/gtest.h>

#include "forest/render/reference/reference_renderer.h"
#include "forest/scene/path.h"
#include "forest/scene/whole.h"

#include "tests/sample_forest.h"

namespace forest {
namespace {

TEST(Pick, IsWhatTheReferenceShows) {
  constexpr std::uint32_t width = 160, height = 90;
  const scene::Forest forest =
      scene::Forest::from_bytes(scene::pack(testing::sample_circuit(), testing::sample_neurons()));
  render::ReferenceRenderer renderer;
  renderer.load(forest.geometry());
  const scene::CameraPath path = scene::walk(forest);
  scene::Colouring colouring = scene::colour(forest, scene::ColourBy::neuron, scene::Background::dark);
  // Eight colours of pure red, green and blue, so that light and shade leave the hue.
  for (std::size_t i = 0; i < colouring.states.size(); ++i)
    colouring.states[i].colour_class = std::uint8_t(i % 7);
  for (std::size_t i = 0; i < colouring.palette.size(); ++i) {
    const std::size_t bits = i / 8 + 1;
    colouring.palette[i] = Vec3(bits & 1 ? 1.f : 0.f, bits & 2 ? 1.f : 0.f, bits & 4 ? 1.f : 0.f);
  }
  for (const auto projection : {frame::Projection::perspective, frame::Projection::orthographic})
    for (const float time : {0.f, .6f, 1.f}) {
      scene::View view = path.at(time);
      view.camera.projection = projection;
      view.samples = 1, view.fog = 0.f, view.halo = 0.f;
      const frame::Viewport viewport{width, height};
      const scene::Cut cut = scene::whole(forest, view.camera, viewport);
      frame::Frame frame = scene::compose(forest, view, colouring, cut, width, height);
      frame.style.background_top = frame.style.background_bottom = Vec3::Zero();
      renderer.draw(frame);
      const frame::Image image = renderer.read();
      std::size_t shown = 0, differ = 0;
      for (std::uint32_t y = 0; y < height; ++y)
        for (std::uint32_t x = 0; x < width; ++x) {
          const std::uint8_t* pixel = &image.pixels[4 * (std::size_t(y) * width + x)];
          const std::size_t bits = (pixel[0] > 8) + 2 * (pixel[1] > 8) + 4 * (pixel[2] > 8);
          const auto picked =
              scene::pick(forest, view.camera, viewport, {float(x) + .5f, float(y) + .5f}, 0.f);
          shown += bits != 0;
          differ += (picked ? colouring.states[picked->instance].colour_class + 1u : 0u) != bits;
        }
      EXPECT_GT(shown, 50u);
      EXPECT_LE(differ, shown / 100 + 2) << "view " << time;  // rays that graze, in single precision
    }
}

}  // namespace
}  // namespace forest
