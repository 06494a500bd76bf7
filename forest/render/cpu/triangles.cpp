// SPDX-License-Identifier: Apache-2.0
// Triangles in homogeneous coordinates (Olano & Greer 1997, "Triangle scan conversion using 2D homogeneous coordinates"):
// three planes through the eye bound what a triangle covers, so that nothing is clipped, also where it passes the eye. In
// double precision, for a cortex is seen from far away in triangles of a pixel.
#include "forest/render/cpu/triangles.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "forest/core/parallel.h"

namespace forest::render::cpu {
namespace {

using Corner = SurfaceDrawer::Corner;
using Vec3d = Eigen::Vector3d;
using Corners = std::array<const Corner*, 3>;

constexpr std::size_t triangles_a_chunk = 8192;

// Pixels around what of a triangle lies before the near distance, and its nearest depth; left > right when nothing does.
struct Seen {
  float left = INFINITY, top = INFINITY, right = -INFINITY, bottom = -INFINITY, nearest = INFINITY;

  Seen(const frame::Constants& c, float spread, const Corners& corners) {
    const auto add = [&](const Vec3& p) {
      const float scale = c.focal / lens(c, p.z());
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
    // Samples beside the middle of their pixel, and a thousandth for what was rounded.
    const float reach = spread + .001f;
    left -= reach, top -= reach, right += reach, bottom += reach;
  }
};

// Where the samples of a pixel look.
struct Places {
  int count;
  std::array<double, most_samples> x{}, y{};  // slopes beside the middle's
  std::array<float, most_samples> turn{};     // of the noise
  std::array<std::uint32_t, most_samples> subframe{};

  Places(const frame::Constants& c, int samples) : count(samples) {
    for (int k = 0; k < samples; ++k) {
      const auto i = std::size_t(k);
      const Vec2 place = frame::sample_place(c.subframe + std::uint32_t(k), c.subframes);
      x[i] = -double(place.x()) / double(c.focal), y[i] = double(place.y()) / double(c.focal);
      turn[i] = golden * float(k);
      subframe[i] = c.subframe + std::uint32_t(k);
    }
  }
};

// One surface in one square.
struct Drawing {
  const Picture& picture;
  const Places& places;
  const Square& square;
  Canvas& canvas;
  std::uint32_t key;  // of its door

  void draw(const Corners& corners) const {
    const frame::Constants& c = picture.constants;
    const Seen seen(c, picture.spread, corners);
    const auto whole = [](float x, std::int32_t low, std::int32_t high) {
      return std::int32_t(std::clamp(x, float(low), float(high)));
    };
    const std::int32_t left = whole(std::ceil(seen.left - .5f), square.left, square.right),
                       right = whole(std::floor(seen.right + .5f), square.left, square.right),
                       top = whole(std::ceil(seen.top - .5f), square.top, square.bottom),
                       bottom = whole(std::floor(seen.bottom + .5f), square.top, square.bottom);
    if (left >= right || top >= bottom ||
        canvas.hidden(square, float(left), float(top), float(right), float(bottom), depth_code(seen.nearest)))
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
    std::array<std::array<double, most_samples>, 3> beside;
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t k = 0; k < std::size_t(places.count); ++k)
        beside[i][k] = inside[i].x() * places.x[k] + inside[i].y() * places.y[k];
    for (std::int32_t y = top; y < bottom; ++y) {
      const double up = (double(c.centre_y) - y - .5) / double(c.focal);
      std::array<double, 3> row;
      for (std::size_t i = 0; i < 3; ++i) row[i] = inside[i].y() * up + inside[i].z();
      for (std::int32_t x = left; x < right; ++x) {
        const double across = (x + .5 - double(c.centre_x)) / double(c.focal);
        std::array<double, 3> at;
        for (std::size_t i = 0; i < 3; ++i) at[i] = inside[i].x() * across + row[i];
        std::uint32_t* pixel = canvas.at(x, y);
        for (std::size_t k = 0; k < std::size_t(places.count); ++k) {
          const double a = at[0] + beside[0][k], b = at[1] + beside[1][k], d = at[2] + beside[2][k],
                       sum = a + b + d;
          if (a < 0. || b < 0. || d < 0. || !(sum > 0.)) continue;
          put(x, y, k, corners, front, float(a / sum), float(b / sum), pixel[k]);
        }
      }
    }
  }

  void put(std::int32_t x, std::int32_t y, std::size_t k, const Corners& corners, bool front, float a,
           float b, std::uint32_t& pixel) const {
    const frame::Constants& c = picture.constants;
    const Corner &p = *corners[0], &q = *corners[1], &r = *corners[2];
    const float d = 1.f - a - b, z = a * p.at.z() + b * q.at.z() + d * r.at.z();
    if (!(z >= c.near)) return;
    const float code = depth_code(z);
    if (key_of(code, 0) >= pixel) return;
    const auto opacity = std::uint32_t(a * p.opacity + b * q.opacity + d * r.opacity + .5f);
    if (opacity < 255) {
      const auto number = std::uint32_t(y) * std::uint32_t(canvas.width()) + std::uint32_t(x);
      if (!frame::forest_shows(opacity, frame::forest_side_key(key, front, number), places.subframe[k]))
        return;
    }
    const Vec3 normal = a * p.normal + b * q.normal + d * r.normal;
    const float facing = normal.dot(picture.light) / std::max(normal.norm(), 1e-9f);
    const float shade =
        (a * p.openness + b * q.openness + d * r.openness) * (.5f + (front ? .5f : -.5f) * facing);
    const float pick = fraction(noise_at(x + 37, y + 11, c.subframe) + places.turn[k]);
    const std::uint32_t entry = pick < a ? p.entry : pick < a + b ? q.entry : r.entry;
    const float noise = fraction(noise_at(x, y, c.subframe) + places.turn[k]);
    pixel = std::min(pixel, key_of(code, payload_of(entry, shade, noise)));
  }
};

}  // namespace

void SurfaceDrawer::draw(const Picture& picture, std::span<const frame::Surface> surfaces, Canvas& canvas) {
  const frame::Constants& c = picture.constants;
  // Vertices and triangles of all of them have numbers.
  std::vector<std::size_t> first_corner{0}, first_triangle{0};
  for (const frame::Surface& s : surfaces) {
    first_corner.push_back(first_corner.back() + s.positions.size());
    first_triangle.push_back(first_triangle.back() + s.triangles.size());
  }
  corners_.resize(first_corner.back());
  for (std::size_t n = 0; n < surfaces.size(); ++n) {
    const frame::Surface& s = surfaces[n];
    Mat3 turn = picture.to_camera;
    Vec3 at = Vec3::Zero();
    if (s.instance != frame::Surface::in_world) {
      const frame::Instance& i = picture.geometry.instances[s.instance];
      turn = turn * Quat(i.qw, i.qx, i.qy, i.qz).toRotationMatrix();
      at = {i.x, i.y, i.z};
    }
    at = picture.to_camera * (at - picture.eye);
    parallel_for(s.positions.size(), 4096, [&](std::size_t i) {
      corners_[first_corner[n] + i] = {
          turn * s.positions[i] + at, turn * s.normals[i],
          s.openness.empty() ? 1.f : float(s.openness[i]) * (1.f / 255.f),
          float(s.opacity) * (s.presence.empty() ? 1.f : float(s.presence[i]) * (1.f / 255.f)), s.entries[i]};
    });
  }
  const auto corners_of = [&](std::size_t surface, std::size_t triangle) -> Corners {
    const Triangle& t = surfaces[surface].triangles[triangle - first_triangle[surface]];
    const Corner* corners = &corners_[first_corner[surface]];
    return {corners + t[0], corners + t[1], corners + t[2]};
  };
  // Calls take(triangle, surface) in order.
  const auto each = [&](auto&& numbers, auto&& take) {
    std::size_t surface = 0;
    for (const auto number : numbers) {
      while (number >= first_triangle[surface + 1]) ++surface;
      take(std::size_t(number), surface);
    }
  };

  const std::size_t count = first_triangle.back(), squares = canvas.squares(),
                    wide = std::size_t(canvas.squares_wide()),
                    chunks = (count + triangles_a_chunk - 1) / triangles_a_chunk;
  ranges_.resize(count);
  places_.assign(chunks * squares, 0);
  const auto each_square = [&](const Range& r, auto&& take) {
    for (std::int32_t y = r.top; y <= r.bottom; ++y)
      for (std::int32_t x = r.left; x <= r.right; ++x) take(std::size_t(y) * wide + std::size_t(x));
  };
  const auto numbers_of = [&](std::size_t chunk) {
    std::vector<std::uint32_t> numbers;
    for (std::size_t i = chunk * triangles_a_chunk; i < std::min(count, (chunk + 1) * triangles_a_chunk); ++i)
      numbers.push_back(std::uint32_t(i));
    return numbers;
  };
  parallel_for(chunks, 1, [&](std::size_t chunk) {
    each(numbers_of(chunk), [&](std::size_t number, std::size_t surface) {
      const Seen seen(c, picture.spread, corners_of(surface, number));
      Square s{1, 1, 0, 0};
      if (seen.left <= seen.right && surfaces[surface].opacity > 0)
        s = canvas.touched(seen.left, seen.top, seen.right, seen.bottom);
      ranges_[number] = {std::int16_t(s.left), std::int16_t(s.top), std::int16_t(s.right),
                         std::int16_t(s.bottom)};
      each_square(ranges_[number], [&](std::size_t square) { ++places_[chunk * squares + square]; });
    });
  });
  starts_.assign(squares + 1, 0);
  std::uint32_t all = 0;
  for (std::size_t square = 0; square < squares; ++square) {
    starts_[square] = all;
    for (std::size_t chunk = 0; chunk < chunks; ++chunk)
      all += std::exchange(places_[chunk * squares + square], all);
  }
  starts_[squares] = all;
  triangles_.resize(all);
  parallel_for(chunks, 1, [&](std::size_t chunk) {
    each(numbers_of(chunk), [&](std::size_t number, std::size_t) {
      each_square(ranges_[number], [&](std::size_t square) {
        triangles_[places_[chunk * squares + square]++] = std::uint32_t(number);
      });
    });
  });

  const Places places(c, canvas.samples());
  parallel_for(squares, 1, [&](std::size_t n) {
    const Square square = canvas.square(n);
    const auto list = std::span(triangles_).subspan(starts_[n], starts_[n + 1] - starts_[n]);
    if (list.empty()) return;
    each(list, [&](std::size_t number, std::size_t surface) {
      const std::uint32_t key =
          frame::forest_surface_key(frame::door_number(surfaces, surface), surfaces[surface].instance);
      Drawing{picture, places, square, canvas, key}.draw(corners_of(surface, number));
    });
    canvas.look(square);
  });
}

}  // namespace forest::render::cpu
