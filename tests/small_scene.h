// SPDX-License-Identifier: Apache-2.0
// What tests of renderers draw: one red neuron at the origin on black, seen from z = 100 µm, where 1 µm is about 2.75 pixels.
#pragma once

#include <cstdint>
#include <vector>

#include "forest/core/half.h"
#include "forest/render/renderer.h"

namespace forest::render {

struct SmallScene {
  std::vector<frame::Segment> segments;
  std::vector<frame::Instance> instances{{0, 0, 0, 0, 0, 0, 0, 1}};
  std::vector<frame::State> states{{}};
  std::vector<frame::Item> items;
  frame::Frame frame;

  SmallScene() {
    frame.camera = {.eye = {0, 0, 100}, .target = {0, 0, 0}, .field_of_view = 40.f};
    frame.width = frame.height = 200;
    frame.palette.fill(Vec3(1, 0, 0));
    frame.states = states;
    frame.style.background_top = frame.style.background_bottom = Vec3::Zero();
    frame.style.halo = 0.f;
  }
  SmallScene(const SmallScene&) = delete;  // the frame points into it
  SmallScene& operator=(const SmallScene&) = delete;

  /// A segment of a basal dendrite. @param ra, rb  its radii where it begins and ends, which become halfs
  void add_segment(const Vec3& a, const Vec3& b, float ra, float rb) {
    segments.push_back({a.x(), a.y(), a.z(), to_half(ra) | to_half(rb) << 16, b.x(), b.y(), b.z(), 3});
  }
  frame::Image drawn_by(Renderer& renderer) const {
    renderer.load({segments, instances});
    renderer.draw(frame);
    return renderer.read();
  }
};

}  // namespace forest::render
