// SPDX-License-Identifier: Apache-2.0
#include "forest/frame/constants.h"

#include <algorithm>
#include <cmath>

#include "forest/core/half.h"

namespace forest::frame {
namespace {

std::uint32_t half_pair(float a, float b) { return to_half(a) | to_half(b) << 16; }

}  // namespace

Constants constants_of(const Frame& f, std::uint32_t subframe) {
  const Mat3 axes = f.camera.axes();
  const Vec3 right = axes.col(0), up = axes.col(1), forward = -axes.col(2), eye = f.camera.eye;
  const Vec3 light = light_direction();
  const Vec2 place = sample_place(subframe, f.subframes);
  const Style& s = f.style;
  Constants c{};
  c.eye_x = eye.x(), c.eye_y = eye.y(), c.eye_z = eye.z(), c.focal = f.camera.focal(float(f.height));
  c.right_x = right.x(), c.right_y = right.y(), c.right_z = right.z();
  c.up_x = up.x(), c.up_y = up.y(), c.up_z = up.z();
  c.forward_x = forward.x(), c.forward_y = forward.y(), c.forward_z = forward.z(), c.near = f.camera.near;
  c.centre_x = .5f * float(f.width) + place.x();
  c.centre_y = .5f * float(f.height) + place.y();
  c.width = f.width, c.height = f.height;
  c.subframe = subframe, c.subframes = f.subframes;
  c.last_subframe = std::min(f.last_subframe, f.subframes);
  c.light_x = light.x(), c.light_y = light.y(), c.light_z = light.z(), c.halo = s.halo;
  c.fog_red = s.fog_colour.x(), c.fog_green = s.fog_colour.y(), c.fog_blue = s.fog_colour.z(),
  c.fog_start = s.fog_start;
  c.top_red = s.background_top.x(), c.top_green = s.background_top.y(), c.top_blue = s.background_top.z();
  c.bottom_red = s.background_bottom.x(), c.bottom_green = s.background_bottom.y(),
  c.bottom_blue = s.background_bottom.z();
  c.thinnest = f.subframes == 1 ? std::max(f.thinnest, 1.f) : f.thinnest;
  c.least_radius = .5f * f.least_width;
  c.fog_length = s.fog_length, c.exposure = s.exposure;
  c.converge = f.camera.orthographic() ? 0.f : 1.f, c.parallel = 1.f - c.converge;
  if (f.glass) {
    const Glass& g = *f.glass;
    const auto seen = [&](const Vec3& way) { return Vec3(right.dot(way), up.dot(way), forward.dot(way)); };
    const Vec3 n = seen(g.plane.normal), r = seen(g.plane.right), u = seen(g.plane.up);
    const Vec3 from = g.plane.origin - eye;
    c.glass_opacity = g.opacity;
    c.glass_x = n.x(), c.glass_y = n.y(), c.glass_z = n.z(), c.glass_at = g.plane.normal.dot(from);
    c.glass_right_x = r.x(), c.glass_right_y = r.y(), c.glass_right_z = r.z();
    c.glass_up_x = u.x(), c.glass_up_y = u.y(), c.glass_up_z = u.z();
    c.glass_left_edge = g.low.x() + g.plane.right.dot(from),
    c.glass_right_edge = g.high.x() + g.plane.right.dot(from);
    c.glass_low_edge = g.low.y() + g.plane.up.dot(from),
    c.glass_high_edge = g.high.y() + g.plane.up.dot(from);
    c.glass_red = g.colour.x(), c.glass_green = g.colour.y(), c.glass_blue = g.colour.z();
  }
  return c;
}

Segment segment_of(const Overlay& o) {
  return {o.a.x(), o.a.y(), o.a.z(), half_pair(o.radius, o.radius),
          o.b.x(), o.b.y(), o.b.z(), o.colour << 16};
}

Segment segment_of(const Ball& b) {
  const Vec3& p = b.centre;
  return {p.x(), p.y(), p.z(), half_pair(b.radius, b.radius),
          p.x(), p.y(), p.z(), std::uint32_t(b.colour) << 16 | std::uint32_t(b.opacity) << 8};
}

float depth_of_code(std::uint32_t code) {
  return std::exp2(float(code) / float(FOREST_DEPTH_STEPS) - float(FOREST_DEPTH_BASE));
}

}  // namespace forest::frame
