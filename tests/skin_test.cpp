// SPDX-License-Identifier: Apache-2.0
// What the skin of neurons near the eye changes in pictures: much when one is near, nothing at once.
#include "forest/scene/skin.h"

#include <cmath>

#include <gtest/gtest.h>

#include "forest/frame/similarity.h"
#include "forest/render/cpu/cpu_renderer.h"
#include "forest/scene/view.h"

#include "tests/sample_forest.h"

namespace forest {
namespace {

TEST(SkinInPictures, ComesWithoutAJump) {
  circuit::Circuit circuit = testing::sample_circuit(6);
  for (auto& instance : circuit.instances) instance.type = 0;  // with spines
  const scene::Forest forest = scene::Forest::from_bytes(scene::pack(circuit, testing::sample_neurons()));
  const scene::Targets targets(forest);
  scene::View view;
  view.samples = 16;
  view.camera.near = .05f;
  // Towards a point of a dendrite.
  const frame::Instance& i = forest.instances()[0];
  const frame::Segment& s = forest.segments()[forest.neurons()[i.morphology].first_segment + 12];
  view.camera.target = Vec3(i.x, i.y, i.z) + Quat(i.qw, i.qx, i.qy, i.qz) * Vec3(s.ax, s.ay, s.az);
  const scene::Colouring colouring = scene::colour(targets, view);
  scene::Skin skin(forest);
  render::CpuRenderer renderer;
  renderer.load(forest.geometry());
  const frame::Viewport viewport{320.f, 240.f};
  const auto picture = [&](bool with_skin) {
    const scene::Eye eye(view.camera, viewport, scene::detail_for(view, 320, 240));
    const scene::Cut cut = scene::choose(forest, eye, colouring.shown());
    frame::Frame frame = scene::compose(forest, view, colouring, cut, 320, 240);
    if (with_skin) skin.show(frame, cut, eye, colouring);
    renderer.draw(frame);
    return renderer.read();
  };
  double before = 0., most = 0.;
  frame::Image bare;
  // Nearer than 15 µm pieces still change by two grey levels from one step to the next: docs/scene/surfaces.md.
  for (float distance = 120.f; distance > 15.3f; distance *= .97f) {
    view.camera.eye = view.camera.target + distance * Vec3(.3f, .2f, 1.f).normalized();
    frame::Image here = picture(false);
    const double now = frame::change(picture(true), here);  // grey levels of 255
    if (distance == 120.f) {
      EXPECT_LT(now, .5);
    } else {
      // What comes with the skin from one step to the next is little beside what the step itself changes.
      EXPECT_LT(std::abs(now - before), .5 + .2 * frame::change(here, bare)) << distance;
    }
    before = now, most = std::max(most, now), bare = std::move(here);
  }
  EXPECT_GT(most, .5);
}

}  // namespace
}  // namespace forest
