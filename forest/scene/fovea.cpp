// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/fovea.h"

#include <algorithm>
#include <cmath>

#include "forest/core/clones.h"
#include "forest/core/parallel.h"

namespace forest::scene {
namespace {

constexpr std::uint32_t coarsest = 8;
constexpr float fade = .2f;  // of the eccentricity at which a layer ends: how far it reaches into the next
constexpr float least_fade = .5f;  // degrees
constexpr float margin = 6.f;      // pixels of a layer around what is shown of it: rims look two pixels far
constexpr std::size_t rows_at_once = 8;

// A cluster of which less than this share of a square of pixels would show is left out of the coarser layers: its neighbours,
// farther or nearer, stand for it.
constexpr float seldom = .2f;

// A pixel of the picture as a layer counts it.
float in_layer(float pixel, float size, float layer_size, float scale) {
  return (pixel - .5f * size) / scale + .5f * layer_size;
}

// The pixels of the picture within so many degrees of the gaze.
frame::Area within(const Gaze& gaze, float eccentricity, float width, float height) {
  Vec2 low = gaze.pixel(), high = low;
  const Vec3 ahead = gaze.direction();
  const Vec3 side = ahead.unitOrthogonal(), other = ahead.cross(side);
  for (int i = 0; i < 64; ++i) {
    const float turn = 2.f * pi * float(i) / 64.f, angle = radians(std::min(eccentricity * 1.01f, 89.f));
    const Vec3 way =
        std::cos(angle) * ahead + std::sin(angle) * (std::cos(turn) * side + std::sin(turn) * other);
    if (way.z() < 1e-3f) return {0, 0, std::uint32_t(width), std::uint32_t(height)};
    const Vec2 at = gaze.pixel_of(way);
    low = low.cwiseMin(at), high = high.cwiseMax(at);
  }
  const auto clamped = [](float x, float limit) { return std::uint32_t(std::clamp(x, 0.f, limit)); };
  return {clamped(std::floor(low.x()), width), clamped(std::floor(low.y()), height),
          clamped(std::ceil(high.x()), width), clamped(std::ceil(high.y()), height)};
}

// The largest square of a layer's pixels, upright about the gaze, that lies within so many degrees, less a margin; empty when
// there is none in the picture.
frame::Area hole_of(const Gaze& gaze, float eccentricity, const Layer& layer, float width, float height) {
  const auto inside = [&](float half) {
    float most = 0.f;
    for (const Vec2& corner : {Vec2(-1, -1), Vec2(1, -1), Vec2(-1, 1), Vec2(1, 1)})
      most = std::max(most, gaze.eccentricity(gaze.pixel() + half * corner));
    return most <= eccentricity;
  };
  float half = 0.f;
  for (float step = std::max(width, height); step > .5f; step *= .5f)
    if (inside(half + step)) half += step;
  half -= margin * layer.scale;
  const auto bound = [&](float at, float size, std::uint32_t layer_size) {
    return std::uint32_t(
        std::clamp(in_layer(at, size, float(layer_size), layer.scale), 0.f, float(layer_size)));
  };
  if (half <= 0.f) return {};
  const Vec2 low = gaze.pixel() - Vec2(half, half), high = gaze.pixel() + Vec2(half, half);
  return {bound(low.x(), width, layer.width), bound(low.y(), height, layer.height),
          bound(high.x(), width, layer.width), bound(high.y(), height, layer.height)};
}

// How columns (or rows) of the picture lie between those of a layer.
struct Between {
  std::vector<std::uint32_t> first;  // of two neighbours
  std::vector<float> share;          // of the second
  Between(std::uint32_t size, const Layer& layer, std::uint32_t layer_size, std::uint32_t low,
          std::uint32_t high)
      : first(size), share(size) {
    for (std::uint32_t i = 0; i < size; ++i) {
      const float at = std::clamp(in_layer(float(i) + .5f, float(size), float(layer_size), layer.scale) - .5f,
                                  float(low), std::max(float(low), float(high) - 1.f));
      first[i] = std::min(std::uint32_t(at), std::max(low, high >= 2 ? high - 2 : 0));
      share[i] = std::clamp(at - float(first[i]), 0.f, 1.f);
    }
  }
};

using Colour = Eigen::Array4f;

// a + share × (b - a), byte by byte; and back to bytes. Flat loops become vector instructions.
FOREST_CLONES void mix(const std::uint8_t* a, const std::uint8_t* b, float share, std::size_t count,
                       float* out) {
  for (std::size_t i = 0; i < count; ++i) out[i] = float(a[i]) + share * (float(b[i]) - float(a[i]));
}
FOREST_CLONES void to_bytes(const float* from, std::size_t count, std::uint8_t* out) {
  for (std::size_t i = 0; i < count; ++i) out[i] = std::uint8_t(std::int32_t(from[i] + .5f));
}

}  // namespace

std::vector<Layer> layers_of(const View& view, std::uint32_t width, std::uint32_t height) {
  const frame::Area all{0, 0, width, height};
  std::vector<Layer> layers{
      {.width = width, .height = height, .area = all, .until = INFINITY, .gone = INFINITY}};
  if (!view.detail.gaze) return layers;
  const float w = float(width), h = float(height);
  const Detail& detail = view.detail;
  const Gaze gaze(view.camera, {w, h}, detail_for(view, width, height));
  float farthest = 0.f;
  for (const Vec2& corner : {Vec2(0, 0), Vec2(w, 0), Vec2(0, h), Vec2(w, h)})
    farthest = std::max(farthest, gaze.eccentricity(corner));
  for (std::uint32_t k = 2; k <= coarsest && height / k >= 16; k *= 2) {
    // From here on the eye resolves nothing smaller than k pixels.
    const float from =
        std::max(gaze.where_resolved(float(k), detail), layers.size() == 1 ? detail.fovea : 0.f);
    if (!(from < farthest)) break;
    layers.back().until = from;
    layers.back().gone = from + std::max(least_fade, fade * from);
    Layer next;
    next.height = (height + k - 1) / k;
    next.scale = h / float(next.height);
    next.width = std::uint32_t(std::ceil(w / next.scale));
    next.until = next.gone = INFINITY;
    layers.push_back(next);
  }
  for (Layer& layer : layers) {
    layer.area = {0, 0, layer.width, layer.height};
    if (&layer != layers.data()) {
      layer.gaps = seldom;
      layer.hole = hole_of(gaze, (&layer - 1)->until, layer, w, h);
    }
    if (std::isinf(layer.gone)) continue;
    const frame::Area part = within(gaze, layer.gone, w, h);
    const auto low = [&](std::uint32_t at, float size, std::uint32_t layer_size) {
      const float place = in_layer(float(at), size, float(layer_size), layer.scale) - margin;
      return std::uint32_t(std::clamp(std::floor(place), 0.f, float(layer_size - 1)));
    };
    const auto high = [&](std::uint32_t at, float size, std::uint32_t layer_size) {
      const float place = in_layer(float(at), size, float(layer_size), layer.scale) + margin;
      return std::uint32_t(std::clamp(std::ceil(place), 1.f, float(layer_size)));
    };
    layer.area = {low(part.left, w, layer.width), low(part.top, h, layer.height),
                  high(part.right, w, layer.width), high(part.bottom, h, layer.height)};
    // A gaze far beside the picture leaves a strip of it.
    layer.area.right = std::max(layer.area.right, layer.area.left + 1);
    layer.area.bottom = std::max(layer.area.bottom, layer.area.top + 1);
  }
  return layers;
}

Detail detail_for(const View& view, const Layer& layer, std::uint32_t width, std::uint32_t height) {
  Detail detail = view.detail;
  detail.thinnest = thinnest_of(view);
  detail.area = layer.area;
  if (detail.gaze)
    detail.gaze =
        Vec2(in_layer(detail.gaze->x() * float(width), float(width), float(layer.width), layer.scale),
             in_layer(detail.gaze->y() * float(height), float(height), float(layer.height), layer.scale));
  return detail;
}

void unite(const View& view, std::span<const Layer> layers, std::span<const frame::Image* const> pictures,
           std::uint32_t width, std::uint32_t height, frame::Image& whole) {
  whole.width = width, whole.height = height;
  whole.pixels.resize(std::size_t(width) * height * 4);
  whole.covered = pictures.back()->covered;
  const Gaze gaze(view.camera, {float(width), float(height)}, detail_for(view, width, height));
  struct Source {
    const frame::Image& picture;
    Between columns, rows;
    std::uint32_t left, right, top, bottom;  // of the picture
    float full, none;                        // cosines of the eccentricities between which it fades
  };
  std::vector<Source> sources;
  for (std::size_t i = layers.size(); i-- > 0;) {  // the coarsest first, the others over it
    const Layer& layer = layers[i];
    const frame::Area& a = layer.area;
    const frame::Area part = std::isinf(layer.gone) ? frame::Area{0, 0, width, height}
                                                    : within(gaze, layer.gone, float(width), float(height));
    const auto cosine = [](float eccentricity) {
      return std::isinf(eccentricity) ? -2.f : std::cos(radians(std::min(eccentricity, 179.f)));
    };
    sources.push_back({*pictures[i], Between(width, layer, layer.width, a.left, a.right),
                       Between(height, layer, layer.height, a.top, a.bottom), part.left, part.right, part.top,
                       part.bottom, cosine(layer.until), cosine(layer.gone)});
  }
  const Vec3 ahead = gaze.direction();
  parallel_ranges(height, rows_at_once, [&](std::size_t begin, std::size_t end) {
    std::vector<Colour> row(width), mixed;
    for (std::size_t y = begin; y < end; ++y) {
      for (const Source& s : sources) {
        if (y < s.top || y >= s.bottom || s.left >= s.right) continue;
        // The layer's two rows mixed, then its columns.
        const std::uint32_t first = s.columns.first[s.left],
                            last = std::min(s.columns.first[s.right - 1] + 2, s.picture.width);
        mixed.resize(s.picture.width);
        const std::size_t upper = s.rows.first[y],
                          lower = std::min<std::size_t>(upper + 1, s.picture.height - 1);
        const float down = s.rows.share[y];
        const std::uint8_t* source = s.picture.pixels.data();
        const std::size_t pitch = 4 * std::size_t(s.picture.width);
        mix(source + upper * pitch + 4 * first, source + lower * pitch + 4 * first, down, 4 * (last - first),
            mixed[first].data());
        const Vec3 middle = gaze.way_to({.5f * float(s.left + s.right), float(y) + .5f});
        const auto colour_at = [&](std::uint32_t x) -> Colour {
          const std::uint32_t i = s.columns.first[x];
          const Colour a = mixed[i], b = mixed[std::min(i + 1, last - 1)];
          return a + s.columns.share[x] * (b - a);
        };
        if (s.none < -1.f) {
          for (std::uint32_t x = s.left; x < s.right; ++x) row[x] = colour_at(x);
          continue;
        }
        const float from = float(s.left + s.right) * .5f - .5f;
        for (std::uint32_t x = s.left; x < s.right; ++x) {
          const Vec3 way(middle.x() + float(x) - from, middle.y(), middle.z());
          const float cosine = way.dot(ahead) / way.norm();
          const float share = std::clamp((cosine - s.none) / (s.full - s.none), 0.f, 1.f);
          if (share > 0.f) row[x] += share * (colour_at(x) - row[x]);
        }
      }
      to_bytes(row[0].data(), 4 * std::size_t(width), &whole.pixels[4 * y * width]);
    }
  });
}

}  // namespace forest::scene
