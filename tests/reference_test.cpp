// SPDX-License-Identifier: Apache-2.0
// The OpenGL renderer against the reference renderer, and the rule by which thin branches are left out against what is
// really drawn.
#include <gtest/gtest.h>

#include "forest/core/half.h"
#include "forest/core/random.h"
#include "forest/frame/similarity.h"
#include "forest/render/cpu/cpu_renderer.h"
#include "forest/render/opengl/context.h"
#include "forest/render/opengl/opengl_renderer.h"
#include "forest/render/reference/reference_renderer.h"
#include "forest/scene/path.h"
#include "forest/scene/view.h"
#include "forest/scene/whole.h"

#include "tests/sample_forest.h"

namespace forest {
namespace {

constexpr std::uint32_t width = 320, height = 200;
const frame::Viewport viewport{float(width), float(height)};

TEST(Reference, OpenGLDrawsTheSamePictureOfEverySegment) {
  const scene::Forest forest =
      scene::Forest::from_bytes(scene::pack(testing::sample_circuit(150), testing::sample_neurons()));
  const render::OffscreenContext context;
  render::OpenGLRenderer opengl;
  render::ReferenceRenderer reference;
  opengl.load(forest.geometry());
  reference.load(forest.geometry());
  const scene::Dolly dolly(forest);
  for (const float time : {0.f, .4f, .6f, .8f, 1.f}) {
    scene::View view = dolly.at(time);
    view.samples = 64;
    const scene::Colouring colouring = scene::colour(forest, view.colour_by, view.background);
    const scene::Cut all = scene::whole(forest, view.camera, viewport);
    const frame::Frame frame = scene::compose(forest, view, colouring, all, width, height);
    opengl.draw(frame);
    reference.draw(frame);
    const frame::Image a = opengl.read(), b = reference.read();
    // Near branches are the same; lines, far away, are a little too bright and too soft (docs/scene/seam.md).
    EXPECT_GT(frame::similarity(a, b), time > .5f ? .97 : .92) << time;
    EXPECT_NEAR(a.covered / b.covered, 1., .03) << time;
    const auto la = frame::luminance(a), lb = frame::luminance(b);
    double sum = 0., sum_reference = 0.;
    for (std::size_t i = 0; i < la.size(); ++i) sum += la[i], sum_reference += lb[i];
    EXPECT_NEAR(sum / sum_reference, 1., time > .5f ? .05 : .1) << time;
  }
}

// Which thin branches a picture shows is the cut's choice alone: what it names, renderers draw (scene/connection.h).
TEST(Reference, APictureOfOneSampleHasEverySegmentOfItsCutHoweverThin) {
  const render::OffscreenContext context;
  render::OpenGLRenderer opengl;
  render::CpuRenderer cpu;
  Random random(11);
  const std::vector<frame::State> states{{}};
  int thin = 0, wide = 0;
  for (int i = 0; i < 400; ++i) {
    const auto place = [&] {
      return Vec3(float(random.uniform(-30, 30)), float(random.uniform(-20, 20)),
                  float(random.uniform(-80, 40)));
    };
    const Vec3 a = place(), b = place();
    if ((a - b).head<2>().norm() < 5.f) continue;
    const double radius = std::exp2(random.uniform(-8., 0.)), mean = radius * random.uniform(.5, 2.);
    const std::uint32_t half = to_half(float(radius));
    const std::vector<frame::Segment> segments{{a.x(), a.y(), a.z(), half | half << 16, b.x(), b.y(), b.z(),
                                                3u | random.below(256) << 8 | to_half(float(mean)) << 16}};
    const std::vector<frame::Instance> instances{{0, 0, 0, 0, 0, 0, 0, 1}};
    const std::vector<frame::Item> items{{0, 0, 1, 0, 0, 0, 0, 100}};
    frame::Frame frame;
    frame.camera = {.eye = {0, 0, 100}};
    frame.width = width, frame.height = height;
    frame.thinnest = i % 3 ? 0.f : 5.f;
    frame.palette.fill(Vec3::Ones());
    frame.states = states;
    (i % 2 ? frame.lines : frame.capsules) = items;
    for (render::Renderer* renderer : std::initializer_list<render::Renderer*>{&opengl, &cpu}) {
      renderer->load({segments, instances});
      renderer->draw(frame);
      EXPECT_GT(renderer->read().covered, 0.) << i << " " << renderer->name();
    }
    (radius * frame.camera.focal(float(height)) < 50. ? thin : wide) += 1;
  }
  EXPECT_GT(thin, 50);
  EXPECT_GT(wide, 50);
}

}  // namespace
}  // namespace forest
