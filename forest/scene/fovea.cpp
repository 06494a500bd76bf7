// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/fovea.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>

#include "forest/core/clones.h"
#include "forest/core/parallel.h"

namespace forest::scene {
namespace {

constexpr std::uint32_t coarsest = 8;
constexpr float least_step =
    2.f;  // from the finest layer to the next: to look at a branch twice costs more than a few pixels
constexpr std::uint32_t coarse_samples = 4;
constexpr float fade = .2f;  // of the eccentricity at which a layer ends: how far it reaches into the next
constexpr float least_fade = .5f;  // degrees
constexpr float margin = 4.f;      // pixels of a layer around what is shown of it: rims look two pixels far
constexpr std::size_t rows_at_once = 8;

// The thinnest lines of the coarser layers, in those of the picture without a gaze: fewer, and as bright together.
constexpr float wider = 1.6f;
// … and never less than this: what is much thinner falls between the samples and is seen as a row of beads.
constexpr float least_thinnest = .25f;  // pixels of the layer

// A cluster of which less than this share of a square of pixels would show is left out of the coarser layers: its neighbours,
// farther or nearer, stand for it.
constexpr float seldom = .5f;

float thinnest_in(const View& view, const Layer& layer) {
  const bool finest = layer.scale <= view.detail.pixel;
  return finest ? thinnest_of(view) : std::max(wider * thinnest_of(view), least_thinnest);
}

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

// Of every square of a layer's pixels whether nothing of it is shown: all within `inner` degrees of the gaze is in a finer layer,
// and all beyond `outer` in a coarser one.
std::vector<std::uint8_t> unwanted_of(const Gaze& gaze, float inner, float outer, const Layer& layer,
                                      float width, float height) {
  constexpr auto side = std::uint32_t(FOREST_TILE);
  const std::uint32_t wide = (layer.width + side - 1) / side, high = (layer.height + side - 1) / side;
  std::vector<std::uint8_t> unwanted(std::size_t(wide) * high, 1);
  // From the middle of a square to its farthest pixel, and what is looked at around that.
  const float reach = gaze.angle((.5f * float(side) + margin) * std::numbers::sqrt2_v<float> * layer.scale);
  const auto cosine = [](float degrees) { return std::cos(radians(std::clamp(degrees, 0.f, 180.f))); };
  const float within = inner > reach ? cosine(inner - reach) : 2.f,
              beyond = std::isinf(outer) ? -2.f : cosine(outer + reach);
  const Vec3 ahead = gaze.direction();
  const std::uint32_t left = layer.area.left / side, right = (layer.area.right + side - 1) / side;
  for (std::uint32_t y = layer.area.top / side; y < (layer.area.bottom + side - 1) / side; ++y)
    for (std::uint32_t x = left; x < right; ++x) {
      const auto in_picture = [&](std::uint32_t square, float size, std::uint32_t layer_size) {
        return ((float(square) + .5f) * float(side) - .5f * float(layer_size)) * layer.scale + .5f * size;
      };
      const Vec3 way = gaze.way_to({in_picture(x, width, layer.width), in_picture(y, height, layer.height)});
      const float along = way.dot(ahead), distance = way.norm();
      unwanted[std::size_t(y) * wide + x] = along > within * distance || along < beyond * distance;
    }
  return unwanted;
}

constexpr std::uint8_t whole_share = 128;  // of what is mixed

// How columns (or rows) of the picture lie between those of a layer.
struct Between {
  std::vector<std::uint32_t> first;  // of two neighbours
  std::vector<std::uint8_t> share;   // of the second
  std::vector<std::uint32_t>
      starts;  // of each of the layer's: where it begins to be the first, and where the last one ends
  Between(std::uint32_t size, const Layer& layer, std::uint32_t layer_size, std::uint32_t low,
          std::uint32_t high)
      : first(size), share(size) {
    for (std::uint32_t i = 0; i < size; ++i) {
      const float at = std::clamp(in_layer(float(i) + .5f, float(size), float(layer_size), layer.scale) - .5f,
                                  float(low), std::max(float(low), float(high) - 1.f));
      first[i] = std::min(std::uint32_t(at), std::max(low, high >= 2 ? high - 2 : 0));
      share[i] = std::uint8_t(std::clamp(at - float(first[i]), 0.f, 1.f) * float(whole_share) + .5f);
    }
    for (std::uint32_t i = 0; i < size; ++i) starts.resize(first[i] + 1u, i);
    starts.resize(layer_size + 1u, size);
  }
};

// Of each of the picture's pixels [left, right) its two neighbours in a row of a layer that begins with its pixel `first`.
struct Neighbours {
  const std::uint32_t* row;
  const std::uint32_t* starts;  // as Between has them, from `first` on
  std::size_t count;            // in the row
  std::uint32_t left, right;
};
constexpr std::size_t at_once = 8;  // copies of a pixel that are written: those too many are written over
FOREST_CLONES void repeat(const Neighbours& n, std::uint32_t* __restrict lefts,
                          std::uint32_t* __restrict rights) {
  for (std::size_t at = 0; at < n.count; ++at) {
    const std::uint32_t begin = std::max(n.starts[at], n.left), end = std::min(n.starts[at + 1], n.right);
    const std::uint32_t one = n.row[at], next = n.row[at + 1 < n.count ? at + 1 : at];
    for (std::uint32_t i = begin; i < end; i += at_once) {
      FOREST_LANES
      for (std::size_t k = 0; k < at_once; ++k) lefts[i - n.left + k] = one;
      FOREST_LANES
      for (std::size_t k = 0; k < at_once; ++k) rights[i - n.left + k] = next;
    }
  }
}

// a + share × (b - a), byte by byte: of all the same share, or of each its own. Flat loops become vector instructions.
FOREST_CLONES void mix(const std::uint8_t* a, const std::uint8_t* b, std::uint8_t share, std::size_t count,
                       std::uint8_t* out) {
  const auto other = std::uint16_t(whole_share - share);
  for (std::size_t i = 0; i < count; ++i)
    out[i] = std::uint8_t(std::uint16_t(a[i] * other + b[i] * share + whole_share / 2) / whole_share);
}
FOREST_CLONES void mix(const std::uint8_t* a, const std::uint8_t* b, const std::uint8_t* shares,
                       std::size_t count, std::uint8_t* out) {
  for (std::size_t i = 0; i < count; ++i)
    out[i] = std::uint8_t(
        std::uint16_t(a[i] * std::uint16_t(whole_share - shares[i]) + b[i] * shares[i] + whole_share / 2) /
        whole_share);
}

// How much shows of a layer that fades between two cosines of the eccentricity, at pixels of a row: `way` leads to the first of them,
// the next are one farther to the right each. Four bytes a pixel.
FOREST_CLONES void shares_of(const Vec3& way, const Vec3& ahead, float none, float full, std::size_t count,
                             std::uint8_t* out) {
  const float x = way.x(), side = way.y() * way.y() + way.z() * way.z(),
              along = way.y() * ahead.y() + way.z() * ahead.z(), ahead_x = ahead.x();
  const float scale = float(whole_share) / (full - none);
  for (std::size_t i = 0; i < count; ++i) {
    const float at = x + float(std::int32_t(i));
    const float share = ((at * ahead_x + along) / std::sqrt(at * at + side) - none) * scale;
    const float within = share < 0.f ? 0.f : share > float(whole_share) ? float(whole_share) : share;
    const auto all = std::uint32_t(std::int32_t(within + .5f)) * 0x01010101u;
    std::memcpy(out + 4 * i, &all, 4);
  }
}

// The mean light of the half cylinder that one sees of a line, as renderers have it (render/cpu/run.cpp).
float light_on(const Vec3& a, const Vec3& b, const Vec3& light, bool parallel) {
  const Vec3 way = (b - a).normalized();
  const Vec3 back = parallel ? Vec3(0.f, 0.f, -1.f) : Vec3(-(a + b).normalized());
  const float along = way.dot(light), end_on = way.dot(back);
  const float over = (back.dot(light) - end_on * along) / std::sqrt(std::max(1.f - end_on * end_on, 1e-4f));
  const float beside = std::max(0.f, 1.f - along * along - over * over);
  const float shade =
      .5f * std::sqrt(std::max(0.f, 1.f + .5f * pi * over + (beside + 2.f * over * over) / 3.f));
  return .16f + 1.05f * shade * shade;
}

}  // namespace

std::vector<Layer> layers_of(const View& view, std::uint32_t width, std::uint32_t height) {
  const float w = float(width), h = float(height);
  const auto layer_of = [&](float pixel) {
    Layer layer;
    layer.height = std::uint32_t(std::ceil(h / pixel));
    layer.scale = h / float(layer.height);
    layer.width = std::uint32_t(std::ceil(w / layer.scale));
    layer.area = {0, 0, layer.width, layer.height};
    layer.until = layer.gone = INFINITY;
    return layer;
  };
  std::vector<Layer> layers{layer_of(view.detail.pixel)};
  if (!view.detail.gaze) return layers;
  const Detail& detail = view.detail;
  const Gaze gaze(view.camera, {w, h}, detail_for(view, width, height));
  float farthest = 0.f;
  for (const Vec2& corner : {Vec2(0, 0), Vec2(w, 0), Vec2(0, h), Vec2(w, h)})
    farthest = std::max(farthest, gaze.eccentricity(corner));
  for (std::uint32_t k = 2; k <= coarsest && height / k >= 16; k *= 2) {
    if (float(k) < least_step * view.detail.pixel) continue;
    // From here on the eye resolves nothing smaller than k pixels.
    const float from =
        std::max(gaze.where_resolved(float(k), detail), layers.size() == 1 ? detail.fovea : 0.f);
    if (!(from < farthest)) break;
    layers.back().until = from;
    layers.back().gone = from + std::max(least_fade, fade * from);
    layers.push_back(layer_of(float(k)));
  }
  for (Layer& layer : layers) {
    if (&layer != layers.data()) {
      layer.gaps = seldom;
      layer.hole = hole_of(gaze, (&layer - 1)->until, layer, w, h);
    }
    const float inner = &layer == layers.data() ? 0.f : (&layer - 1)->until;
    if (std::isinf(layer.gone)) {
      layer.unwanted = unwanted_of(gaze, inner, INFINITY, layer, w, h);
      continue;
    }
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
    layer.unwanted = unwanted_of(gaze, inner, layer.gone, layer, w, h);
  }
  return layers;
}

Detail detail_for(const View& view, const Layer& layer, std::uint32_t width, std::uint32_t height) {
  Detail detail = view.detail;
  detail.fog = fog_strength(view);
  detail.thinnest = thinnest_in(view, layer);
  detail.area = layer.area;
  if (layer.hole != frame::Area{}) detail.hole = layer.hole;
  if (detail.gaze)
    detail.gaze =
        Vec2(in_layer(detail.gaze->x() * float(width), float(width), float(layer.width), layer.scale),
             in_layer(detail.gaze->y() * float(height), float(height), float(layer.height), layer.scale));
  return detail;
}

View view_for(const View& view, const Layer& layer) {
  View shown = view;
  if (layer.scale <= 1.f) return shown;
  shown.halo /= layer.scale;
  if (shown.least_width) *shown.least_width /= layer.scale;
  shown.detail.thinnest = thinnest_in(view, layer);
  if (shown.samples == 1 && layer.scale > view.detail.pixel) shown.samples = coarse_samples;
  return shown;
}

void unite(const View& view, std::span<const Layer> layers, std::span<const frame::Image* const> pictures,
           std::uint32_t width, std::uint32_t height, frame::Image& whole) {
  whole.width = width, whole.height = height;
  whole.pixels.resize(std::size_t(width) * height * 4);
  const Gaze gaze(view.camera, {float(width), float(height)}, detail_for(view, width, height));
  // Of the picture, what shows anything of a layer, and how.
  struct Source {
    const frame::Image& picture;
    Between columns, rows;
    std::vector<std::uint8_t> shares;  // of the columns, four a pixel
    std::uint32_t left, right, top, bottom;
    float full, none;  // cosines of the eccentricities between which it fades
  };
  std::vector<Source> sources;
  for (std::size_t i = layers.size(); i-- > 0;) {  // the coarsest first, the others over it
    const Layer& layer = layers[i];
    const frame::Area& a = layer.area;
    const frame::Area part = std::isinf(layer.gone) ? frame::Area{0, 0, width, height}
                                                    : within(gaze, layer.gone, float(width), float(height));
    if (part.left >= part.right || part.top >= part.bottom) continue;
    const auto cosine = [](float eccentricity) {
      return std::isinf(eccentricity) ? -2.f : std::cos(radians(std::min(eccentricity, 179.f)));
    };
    Source& s = sources.emplace_back(Source{*pictures[i],
                                            Between(width, layer, layer.width, a.left, a.right),
                                            Between(height, layer, layer.height, a.top, a.bottom),
                                            {},
                                            part.left,
                                            part.right,
                                            part.top,
                                            part.bottom,
                                            cosine(layer.until),
                                            cosine(layer.gone)});
    for (const std::uint8_t share : s.columns.share) s.shares.insert(s.shares.end(), 4, share);
  }
  const Vec3 ahead = gaze.direction();
  std::atomic<std::uint64_t> covered = 0;
  parallel_ranges(height, rows_at_once, [&](std::size_t begin, std::size_t end) {
    // A row of a layer, its pixels that are the neighbours of the picture's, those mixed, and how much of each shows.
    std::vector<std::uint8_t> shares(4 * std::size_t(width)), colours(4 * std::size_t(width));
    std::vector<std::uint32_t> mixed, lefts(width + at_once), rights(width + at_once);
    const auto bytes = [](const std::vector<std::uint32_t>& pixels) {
      return reinterpret_cast<const std::uint8_t*>(pixels.data());
    };
    for (std::size_t y = begin; y < end; ++y) {
      std::uint8_t* row = &whole.pixels[4 * y * width];
      for (const Source& s : sources) {
        if (y < s.top || y >= s.bottom) continue;
        const std::size_t count = s.right - s.left;
        // The layer's two rows mixed, then its columns.
        const std::uint32_t first = s.columns.first[s.left],
                            last = std::min(s.columns.first[s.right - 1] + 2, s.picture.width);
        mixed.resize(last - first);
        const std::size_t upper = s.rows.first[y],
                          lower = std::min<std::size_t>(upper + 1, s.picture.height - 1);
        const std::size_t pitch = 4 * std::size_t(s.picture.width);
        const std::uint8_t* source = s.picture.pixels.data() + 4 * std::size_t(first);
        mix(source + upper * pitch, source + lower * pitch, s.rows.share[y], 4 * mixed.size(),
            reinterpret_cast<std::uint8_t*>(mixed.data()));
        repeat({mixed.data(), &s.columns.starts[first], mixed.size(), s.left, s.right}, lefts.data(),
               rights.data());
        std::uint8_t* to = row + 4 * std::size_t(s.left);
        const bool fades = s.none >= -1.f;
        mix(bytes(lefts), bytes(rights), &s.shares[4 * std::size_t(s.left)], 4 * count,
            fades ? colours.data() : to);
        if (!fades) continue;
        shares_of(gaze.way_to({float(s.left) + .5f, float(y) + .5f}), ahead, s.none, s.full, count,
                  shares.data());
        mix(to, colours.data(), shares.data(), 4 * count, to);
      }
      std::uint64_t alpha = 0;
      for (std::size_t x = 0; x < width; ++x) alpha += row[4 * x + 3];
      covered += alpha;
    }
  });
  whole.covered = double(covered) / 255. / (double(width) * double(height));
}

void trace_lines(const View& view, std::span<const Layer> layers, std::span<const frame::Overlay> lines,
                 const frame::Frame& like, float middle, frame::Image& whole) {
  if (layers.size() < 2) return;
  const frame::Camera& camera = like.camera;
  const float width = float(whole.width), height = float(whole.height);
  const Gaze gaze(view.camera, {width, height}, detail_for(view, whole.width, whole.height));
  const Vec3 ahead = gaze.direction(), light = frame::light_direction();
  const float full = std::cos(radians(std::min(layers.front().until, 179.f))),
              none = std::cos(radians(std::min(layers.front().gone, 179.f)));
  const Mat3 axes = camera.axes();
  const auto in_camera = [&](const Vec3& p) -> Vec3 {  // x right, y up, z along the view
    const Vec3 at = axes.transpose() * (p - camera.eye);
    return {at.x(), at.y(), -at.z()};
  };
  const float focal = camera.focal(height);
  const auto scale = [&](float z) { return camera.orthographic() ? focal : focal / z; };
  // Seldom more than a few thousand pixels: lines are walked one after the other, so that each pixel's order is theirs.
  for (const frame::Overlay& line : lines) {
    Vec3 a = in_camera(line.a), b = in_camera(line.b);
    if (a.z() < camera.near && b.z() < camera.near) continue;
    if (a.z() < camera.near) a += (camera.near - a.z()) / (b.z() - a.z()) * (b - a);
    if (b.z() < camera.near) b += (camera.near - b.z()) / (a.z() - b.z()) * (a - b);
    const auto place = [&](const Vec3& p) {
      return Vec2(.5f * width + scale(p.z()) * p.x(), .5f * height - scale(p.z()) * p.y());
    };
    Vec2 from = place(a), to = place(b);
    const Vec2 way = to - from;
    const bool steep = std::abs(way.y()) > std::abs(way.x());
    const int major = steep ? 1 : 0, minor = 1 - major;
    if (!(std::abs(way[major]) > 0.f)) continue;
    if (to[major] < from[major]) std::swap(from, to), std::swap(a, b);
    const float straight =
        std::abs(way[major]) / way.norm();  // a step along the axis leads so far along the line
    const Vec3 base = like.palette[line.colour] * light_on(a, b, light, camera.orthographic());
    const float last = std::min(std::ceil(to[major] - .5f), major ? height : width);
    for (float at = std::max(0.f, std::ceil(from[major] - .5f)); at < last; at += 1.f) {
      const float t = (at + .5f - from[major]) / (to[major] - from[major]);
      const float z = camera.orthographic() ? a.z() + t * (b.z() - a.z())
                                            : 1.f / (1.f / a.z() + t * (1.f / b.z() - 1.f / a.z()));
      const float beside = from[minor] + t * (to[minor] - from[minor]);
      const float radius = std::max(1.f, line.radius * scale(z));
      const float fog = 1.f - std::exp(-std::max(0.f, z - like.style.fog_start) / like.style.fog_length);
      const Vec3 colour = 255.f * screen_of(Vec3(base + fog * (like.style.fog_colour - base)));
      const float reach = (radius + .5f) / straight, limit = minor ? height : width;
      for (float other = std::max(0.f, std::ceil(beside - reach - .5f));
           other < std::min(limit, beside + reach); other += 1.f) {
        Vec2 pixel;
        pixel[major] = at + .5f, pixel[minor] = other + .5f;
        const Vec3 look = gaze.way_to(pixel);
        const float shown = std::clamp((look.normalized().dot(ahead) - none) / (full - none), 0.f, 1.f);
        std::uint8_t* to_pixel =
            &whole.pixels[4 * (std::size_t(pixel.y()) * whole.width + std::size_t(pixel.x()))];
        const float gaps = z < middle ? 1.f : 1.f - float(to_pixel[3]) / 255.f;
        const float distance = std::abs(other + .5f - beside) * straight;
        const float share = std::clamp(radius + .5f - distance, 0.f, 1.f) * (1.f - shown) * gaps;
        for (int c = 0; c < 3; ++c)
          to_pixel[c] = std::uint8_t(float(to_pixel[c]) + share * (colour[c] - float(to_pixel[c])) + .5f);
      }
    }
  }
}

}  // namespace forest::scene
