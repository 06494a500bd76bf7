// SPDX-License-Identifier: Apache-2.0
// Triangles in homogeneous coordinates (Olano & Greer 1997, "Triangle scan conversion using 2D homogeneous coordinates"):
// three planes through the eye bound what a triangle covers, so that nothing is clipped, also where it passes the eye. In
// double precision, for a cortex is seen from far away in triangles of a pixel.
#include "forest/render/cpu/triangles.h"

#include <array>
#include <cmath>

#include "forest/core/parallel.h"

namespace forest::render::cpu {
namespace {

using Vec3d = Eigen::Vector3d;

constexpr std::size_t grain = 512;  // triangles a thread takes at once

// A vertex in camera coordinates (x right, y up, z depth).
struct Corner {
  Vec3 at, normal;
  float openness, opacity;
  std::uint32_t entry;
};

// Some pixels: [left, right) × [top, bottom).
struct Box {
  std::int32_t left, top, right, bottom;
};

// Around what of the triangle lies before the near distance; empty when nothing does.
Box box_of(const frame::Constants& c, const std::array<const Corner*, 3>& corners, std::int32_t width,
           std::int32_t height, float& nearest) {
  float left = INFINITY, right = -INFINITY, top = INFINITY, bottom = -INFINITY;
  nearest = INFINITY;
  const auto add = [&](const Vec3& p) {
    const float scale = c.focal / (c.converge * p.z() + c.parallel);
    const float x = c.centre_x + scale * p.x(), y = c.centre_y - scale * p.y();
    left = std::min(left, x), right = std::max(right, x);
    top = std::min(top, y), bottom = std::max(bottom, y);
    nearest = std::min(nearest, p.z());
  };
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3 &p = corners[i]->at, &q = corners[(i + 1) % 3]->at;
    if (p.z() >= c.near) add(p);
    if ((p.z() < c.near) == (q.z() < c.near)) continue;
    Vec3 cut = p + (c.near - p.z()) / (q.z() - p.z()) * (q - p);
    cut.z() = c.near;
    add(cut);
  }
  // A pixel's middle, and a thousandth for what was rounded.
  const auto whole = [](float x, std::int32_t limit) {
    return std::int32_t(std::clamp(x, 0.f, float(limit)));
  };
  if (!(left <= right)) return {0, 0, 0, 0};
  return {whole(std::ceil(left - .501f), width), whole(std::ceil(top - .501f), height),
          whole(std::floor(right + .501f), width), whole(std::floor(bottom + .501f), height)};
}

class Drawing {
 public:
  Drawing(const Picture& picture, const frame::Surface& surface, std::uint32_t number, Canvas& canvas)
      : picture_(picture),
        surface_(surface),
        canvas_(canvas),
        key_(frame::forest_surface_key(number, surface.instance)),
        corners_(surface.positions.size()) {
    Mat3 turn = picture.to_camera;
    Vec3 at = Vec3::Zero();
    if (surface.instance != frame::Surface::in_world) {
      const frame::Instance& i = picture.geometry.instances[surface.instance];
      turn = turn * Quat(i.qw, i.qx, i.qy, i.qz).toRotationMatrix();
      at = {i.x, i.y, i.z};
    }
    at = picture.to_camera * (at - picture.eye);
    parallel_for(corners_.size(), 4096, [&](std::size_t i) {
      corners_[i] = {turn * surface.positions[i] + at, turn * surface.normals[i],
                     surface.openness.empty() ? 1.f : float(surface.openness[i]) * (1.f / 255.f),
                     float(surface.opacity) *
                         (surface.presence.empty() ? 1.f : float(surface.presence[i]) * (1.f / 255.f)),
                     surface.entries[i]};
    });
    parallel_ranges(surface.triangles.size(), grain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) draw(surface.triangles[i]);
    });
  }

 private:
  void draw(const Triangle& triangle) {
    const frame::Constants& c = picture_.constants;
    const std::array<const Corner*, 3> corners{&corners_[triangle[0]], &corners_[triangle[1]], &corners_[triangle[2]]};
    float nearest;
    const Box box = box_of(c, corners, canvas_.width(), canvas_.height(), nearest);
    if (box.left >= box.right || box.top >= box.bottom) return;
    if (canvas_.hidden(float(box.left), float(box.top), float(box.right), float(box.bottom),
                       depth_code(nearest)))
      return;
    // Weights of the corners at a place q = (x, y, 1) of the picture of slopes are inside · q, all of one sign within.
    std::array<Vec3d, 3> h, inside;
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec3d p = corners[i]->at.cast<double>();
      h[i] = {p.x(), p.y(), double(c.converge) * p.z() + double(c.parallel)};
    }
    for (std::size_t i = 0; i < 3; ++i) inside[i] = h[(i + 1) % 3].cross(h[(i + 2) % 3]);
    const double volume = h[0].dot(inside[0]);
    if (volume == 0.) return;  // seen from its edge
    const bool front = volume > 0.;
    if (!front)
      for (Vec3d& plane : inside) plane = -plane;
    const auto rows = [&](std::int32_t y) {
      const double up = (double(c.centre_y) - y - .5) / double(c.focal);
      std::array<double, 3> row;
      for (std::size_t i = 0; i < 3; ++i) row[i] = inside[i].y() * up + inside[i].z();
      for (std::int32_t x = box.left; x < box.right; ++x) {
        const double right = (x + .5 - double(c.centre_x)) / double(c.focal);
        const double a = inside[0].x() * right + row[0], b = inside[1].x() * right + row[1],
                     d = inside[2].x() * right + row[2], sum = a + b + d;
        if (a < 0. || b < 0. || d < 0. || !(sum > 0.)) continue;
        put(x, y, corners, front, float(a / sum), float(b / sum));
      }
    };
    constexpr std::int32_t shared = 128;  // rows from which on other threads help
    if (box.bottom - box.top >= shared)
      parallel_for(std::size_t(box.bottom - box.top), 16,
                   [&](std::size_t k) { rows(box.top + std::int32_t(k)); });
    else
      for (std::int32_t y = box.top; y < box.bottom; ++y) rows(y);
  }

  void put(std::int32_t x, std::int32_t y, const std::array<const Corner*, 3>& corners, bool front, float a,
           float b) {
    const frame::Constants& c = picture_.constants;
    const Corner &p = *corners[0], &q = *corners[1], &r = *corners[2];
    const float d = 1.f - a - b, z = a * p.at.z() + b * q.at.z() + d * r.at.z();
    if (!(z >= c.near)) return;
    const auto opacity = std::uint32_t(a * p.opacity + b * q.opacity + d * r.opacity + .5f);
    if (opacity < 255) {
      const auto pixel = std::uint32_t(y) * std::uint32_t(canvas_.width()) + std::uint32_t(x);
      if (!frame::forest_shows(opacity, frame::forest_side_key(key_, front, pixel), c.subframe))
        return;
    }
    const Vec3 normal = a * p.normal + b * q.normal + d * r.normal;
    const float facing = normal.dot(picture_.light) / std::max(normal.norm(), 1e-9f);
    const float shade =
        (a * p.openness + b * q.openness + d * r.openness) * (.5f + (front ? .5f : -.5f) * facing);
    const float pick = noise_at(x + 37, y + 11, c.subframe);
    const std::uint32_t entry = pick < a ? p.entry : pick < a + b ? q.entry : r.entry;
    canvas_.put(x, y, key_of(depth_code(z), payload_of(entry, shade, noise_at(x, y, c.subframe))));
  }

  const Picture& picture_;
  const frame::Surface& surface_;
  Canvas& canvas_;
  std::uint32_t key_;
  std::vector<Corner> corners_;
};

}  // namespace

void splat(const Picture& picture, std::span<const frame::Surface> surfaces, Canvas& canvas) {
  for (std::size_t i = 0; i < surfaces.size(); ++i)
    if (surfaces[i].opacity > 0) Drawing(picture, surfaces[i], std::uint32_t(i), canvas);
}

}  // namespace forest::render::cpu
