// SPDX-License-Identifier: Apache-2.0
// Golden images: a small forest drawn from outside and from within, compared with pictures that were looked at.
// Tolerance: mean difference of a channel at most 2 of 255, and at most 2 % of the pixels further off than 32; drivers may
// round differently. After an intended change run with FOREST_UPDATE_GOLDEN=1, and look at what is written.
#include <cstdlib>

#include <gtest/gtest.h>

#include "forest/io/png.h"
#include "forest/render/null/null_renderer.h"
#include "forest/render/opengl/context.h"
#include "forest/render/opengl/opengl_renderer.h"
#include "forest/scene/path.h"
#include "forest/scene/view.h"

#include "tests/sample_forest.h"

namespace forest {
namespace {

constexpr std::uint32_t width = 320, height = 200;

struct Golden {
  const char* name;
  float time;  // on the walk
  scene::ColourBy colour_by;
  scene::Background background;
};
constexpr Golden goldens[] = {{"outside", 0.f, scene::ColourBy::type, scene::Background::dark},
                              {"edge", .5f, scene::ColourBy::kind, scene::Background::light},
                              {"inside", 1.f, scene::ColourBy::neuron, scene::Background::dark}};

class Picture : public ::testing::TestWithParam<Golden> {};

TEST_P(Picture, LooksAsItDid) {
  const Golden& golden = GetParam();
  const scene::Forest forest =
      scene::Forest::from_bytes(scene::pack(testing::sample_circuit(150), testing::sample_neurons()));
  scene::View view = scene::walk(forest).at(golden.time);
  view.colour_by = golden.colour_by, view.background = golden.background, view.samples = 16;
  const scene::Colouring colouring = scene::colour(forest, view.colour_by, view.background);
  const frame::Viewport viewport{float(width), float(height)};
  const scene::Cut cut = scene::choose(forest, scene::Eye(view.camera, viewport, view.detail), viewport);
  const auto lines = scene::outline(forest);
  const frame::Frame frame = scene::compose(forest, view, colouring, cut, width, height, lines);

  render::NullRenderer null;  // the contract first
  null.load(forest.geometry());
  ASSERT_NO_THROW(null.draw(frame));

  const render::OffscreenContext context;
  render::OpenGLRenderer renderer;
  renderer.load(forest.geometry());
  renderer.draw(frame);
  const frame::Image image = renderer.read();
  EXPECT_GT(image.covered, .03);

  const std::filesystem::path file =
      std::filesystem::path(FOREST_SOURCE_DIR) / "tests" / "golden" / (std::string(golden.name) + ".png");
  if (std::getenv("FOREST_UPDATE_GOLDEN")) io::write_png(file, width, height, image.pixels);
  const io::Picture expected = io::read_png(file);
  ASSERT_EQ(expected.pixels.size(), image.pixels.size());
  double sum = 0.;
  std::size_t far = 0;
  for (std::size_t i = 0; i < image.pixels.size(); i += 4) {
    int worst = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      const int difference = std::abs(int(image.pixels[i + c]) - int(expected.pixels[i + c]));
      sum += difference;
      worst = std::max(worst, difference);
    }
    far += worst > 32;
  }
  EXPECT_LT(sum / (3. * width * height), 2.);
  EXPECT_LT(far, width * height / 50);
}

INSTANTIATE_TEST_SUITE_P(Golden, Picture, ::testing::ValuesIn(goldens),
                         [](const auto& golden) { return std::string(golden.param.name); });

}  // namespace
}  // namespace forest
