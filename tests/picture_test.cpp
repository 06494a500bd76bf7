// SPDX-License-Identifier: Apache-2.0
// Golden images: a small forest drawn from outside and from within, compared with pictures that were looked at.
// Tolerance: mean difference of a channel at most 2 of 255, and at most 2 % of the pixels further off than 32; drivers may
// round differently. After an intended change run with FOREST_UPDATE_GOLDEN=1, and look at what is written.
#include <algorithm>
#include <cstdlib>

#include <gtest/gtest.h>

#include "forest/core/random.h"
#include "forest/io/png.h"
#include "forest/render/cpu/cpu_renderer.h"
#include "forest/render/null/null_renderer.h"
#include "forest/render/opengl/context.h"
#include "forest/render/opengl/opengl_renderer.h"
#include "forest/scene/chooser.h"
#include "forest/scene/path.h"
#include "forest/scene/pick.h"
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
  const scene::Cut cut = scene::choose(forest, scene::Eye(view.camera, viewport, view.detail));
  const auto lines = scene::outline(forest);
  const frame::Frame frame = scene::compose(forest, view, colouring, cut, width, height, lines);

  render::NullRenderer null;  // the contract first
  null.load(forest.geometry());
  ASSERT_NO_THROW(null.draw(frame));

  const render::OffscreenContext context;
  render::OpenGLRenderer card;
  render::CpuRenderer processor;
  const auto drawn_by = [&](render::Renderer& renderer) {
    renderer.load(forest.geometry());
    renderer.draw(frame);
    return renderer.read();
  };
  const frame::Image image = drawn_by(card), other = drawn_by(processor);
  EXPECT_GT(image.covered, .03);
  EXPECT_NEAR(other.covered, image.covered, .001);

  const std::filesystem::path file =
      std::filesystem::path(FOREST_SOURCE_DIR) / "tests" / "golden" / (std::string(golden.name) + ".png");
  if (std::getenv("FOREST_UPDATE_GOLDEN")) io::write_png(file, width, height, image.pixels);
  const io::Picture expected = io::read_png(file);
  for (const frame::Image* seen : {&image, &other}) {
    SCOPED_TRACE(seen == &image ? card.name() : processor.name());
    ASSERT_EQ(expected.pixels.size(), seen->pixels.size());
    double sum = 0.;
    std::size_t far = 0;
    for (std::size_t i = 0; i < seen->pixels.size(); i += 4) {
      int worst = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        const int difference = std::abs(int(seen->pixels[i + c]) - int(expected.pixels[i + c]));
        sum += difference;
        worst = std::max(worst, difference);
      }
      far += worst > 32;
    }
    EXPECT_LT(sum / (3. * width * height), 2.);
    EXPECT_LT(far, width * height / 50);
  }
}

INSTANTIATE_TEST_SUITE_P(Golden, Picture, ::testing::ValuesIn(goldens),
                         [](const auto& golden) { return std::string(golden.param.name); });

// Draws views with a memory of what was hidden in those before, and compares each with one drawn without.
class Remembered {
 public:
  Remembered() { renderer_.load(forest.geometry()); }
  struct Both {
    std::vector<std::uint8_t> with, without;
  };
  Both draw(const scene::View& view, const scene::Colouring& colouring) {
    const frame::Viewport viewport{float(width), float(height)};
    const scene::Eye eye(view.camera, viewport, scene::detail_for(view, width, height));
    const scene::Cut cut = scene::choose(forest, eye, colouring.shown());
    renderer_.draw(scene::compose(forest, view, colouring, cut, width, height));
    Both both{{}, renderer_.read().pixels};
    segments = cut.segments;
    const scene::Cut& guessed = chooser_.choose(eye, colouring.shown());
    frame::Frame frame = scene::compose(forest, view, colouring, guessed, width, height);
    chooser_.complete(frame);
    renderer_.draw(frame);
    chooser_.remember(renderer_.seen(), renderer_.reached());
    both.with = renderer_.read().pixels;
    left_out += guessed.left_out.size();
    revealed += chooser_.segments() - guessed.segments;
    chosen = guessed.segments + guessed.left_out.size();
    return both;
  }
  void expect_the_same(const scene::View& view, const scene::Colouring& colouring) {
    const Both both = draw(view, colouring);
    EXPECT_EQ(both.with, both.without);
  }
  std::span<const std::uint8_t> reached() const { return renderer_.reached(); }

  const scene::Forest forest =
      scene::Forest::from_bytes(scene::pack(testing::sample_circuit(300), testing::sample_neurons()));
  std::size_t left_out = 0, revealed = 0;  // in all pictures
  std::size_t segments = 0, chosen = 0;    // of the last one, without and with

 private:
  scene::Chooser chooser_{forest};
  render::CpuRenderer renderer_;
};

TEST(Chooser, ItsMemoryChangesNoPixel) {
  Remembered pictures;
  const scene::CameraPath path = scene::walk(pictures.forest);
  const scene::Colouring colouring =
      scene::colour(pictures.forest, scene::ColourBy::type, scene::Background::dark);
  for (const float t : {.5f, .505f, .51f, .52f, .9f, .91f, .1f})  // with a leap
    for (const std::uint32_t samples : {1u, 3u}) {
      SCOPED_TRACE(t);
      scene::View view = path.at(t);
      view.samples = samples;
      pictures.expect_the_same(view, colouring);
    }
  EXPECT_GT(pictures.left_out, 50u);
  EXPECT_GT(pictures.revealed, 0u);
}

// Where neurons are looked at in turn, what comes into sight is late by a few pictures at most, and nothing that was seen is lost.
TEST(Chooser, InTurnsItIsLateAndNoMore) {
  constexpr std::uint32_t turns = 3;
  Remembered pictures;
  const scene::CameraPath path = scene::walk(pictures.forest);
  const scene::Colouring colouring =
      scene::colour(pictures.forest, scene::ColourBy::type, scene::Background::dark);
  const auto at = [&](float t) {
    scene::View view = path.at(t);
    view.samples = 1, view.detail.turns = turns;
    return view;
  };
  pictures.expect_the_same(at(.6f), colouring);  // the first one knows nothing
  std::size_t late = 0, fewer = 0;
  for (int i = 1; i <= 40; ++i) {
    const auto [with, without] = pictures.draw(at(.6f + .001f * float(i)), colouring);
    for (std::size_t p = 0; p < with.size(); p += 4) late += !std::equal(&with[p], &with[p] + 3, &without[p]);
    fewer += pictures.chosen < pictures.segments;
  }
  EXPECT_LT(double(late), .01 * 40. * width * height);
  EXPECT_GT(fewer, 30u);
  for (std::uint32_t i = 0; i < turns; ++i) (void)pictures.draw(at(.8f), colouring);  // a leap
  for (int i = 0; i < 4; ++i) pictures.expect_the_same(at(.8f), colouring);
}

TEST(CpuRenderer, TellsWhichNeuronsItReached) {
  Remembered pictures;
  const scene::View view = scene::walk(pictures.forest).at(.7f);
  (void)pictures.draw(view, scene::colour(pictures.forest, scene::ColourBy::type, scene::Background::dark));
  Random random(4);
  std::vector<Vec2> pixels;
  for (int i = 0; i < 400; ++i)
    pixels.emplace_back(float(random.below(width)) + .5f, float(random.below(height)) + .5f);
  std::size_t seen = 0;
  for (const auto& pick :
       scene::plain_picks(pictures.forest, view.camera, {float(width), float(height)}, pixels, 0.f))
    if (pick) {
      ++seen;
      EXPECT_TRUE(pictures.reached()[pick->instance]);
    }
  EXPECT_GT(seen, 100u);
  EXPECT_TRUE(std::ranges::count(pictures.reached(), 0) > 0);
}

// Nor when neurons come, go and become transparent: what stood before others may be gone in the next picture.
TEST(Chooser, ItsMemoryChangesNoPixelWhateverIsShown) {
  Remembered pictures;
  const scene::Targets targets(pictures.forest);
  for (const char* shown :
       {R"([])", R"([{"name":"first","visible":false}])", R"([{"name":"all","opacity":0.3}])",
        R"([{"name":"first","opacity":{"basal":0.1}},{"name":"lower","kind":"dots"}])",
        R"([{"name":"second","visible":false},{"neuron":3,"section":2,"opacity":0.5,"colour":"#00ff00"}])",
        R"([{"name":"all","kind":"somata"}])", R"([])"})
    for (const std::uint32_t samples : {1u, 3u, 17u}) {
      SCOPED_TRACE(shown);
      scene::View view = scene::walk(pictures.forest).at(.5f);
      view.targets =
          scene::parse_view(std::string(R"({"eye":[0,0,1],"target":[0,0,0],"targets":)") + shown + "}")
              .targets;
      view.samples = samples;
      pictures.expect_the_same(view, scene::colour(targets, view));
    }
  EXPECT_GT(pictures.left_out, 50u);
}

}  // namespace
}  // namespace forest
