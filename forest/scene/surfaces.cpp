// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/surfaces.h"

#include <algorithm>
#include <atomic>
#include <bitset>
#include <cmath>
#include <set>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/parallel.h"
#include "forest/core/round_numbers.h"
#include "forest/geometry/split_areas.h"
#include "forest/scene/colouring.h"
#include "forest/scene/view.h"

namespace forest::scene {
namespace {

constexpr float smoothing = .055f;  // of the extent of a hemisphere: about the width of a sulcus
constexpr int most_steps = 240;
constexpr std::size_t map_colours = 64;
constexpr float nearly_none = .002f;    // of the largest: so far below 0 are what is none, too
constexpr float shade_of_values = .5f;  // how much less light sulci get where there are values
constexpr double share_of_zeros = .01;  // of vertices: from there on they stand for "none"
const Vec3 plain = light_of(0xD9CDBF);

// The neighbours of every vertex: those of i are list[starts[i]] up to list[starts[i + 1]].
struct Neighbours {
  std::vector<std::uint32_t> starts, list;

  explicit Neighbours(const Mesh& mesh) : starts(mesh.positions.size() + 1) {
    for (const Triangle& t : mesh.triangles)
      for (const std::uint32_t corner : t) starts[corner + 1] += 2;
    for (std::size_t i = 1; i < starts.size(); ++i) starts[i] += starts[i - 1];
    list.resize(starts.back());
    std::vector<std::uint32_t> next(starts.begin(), starts.end() - 1);
    for (const Triangle& t : mesh.triangles)
      for (std::size_t k = 0; k < 3; ++k)  // within a surface every neighbour comes twice
        list[next[t[k]]++] = t[(k + 1) % 3], list[next[t[k]]++] = t[(k + 2) % 3];
  }
};

// What no neuron is drawn with.
std::vector<std::uint8_t> free_entries(const Colouring& colouring, bool playing) {
  std::vector<std::uint8_t> list;
  std::bitset<16> used;
  for (const frame::State& state : colouring.states) used.set(state.colour_class & 15);
  for (const Part& part : colouring.parts) used.set(part.state.colour_class & 15);
  for (std::uint32_t c = 0; c < gauge_classes && colouring.gauge; ++c) used.set(gauge_entry / 8 + c);
  for (std::uint32_t entry = 0; entry < synapse_entry; ++entry)
    if (playing ? entry >= flash_entry + flash_steps : !used[entry / 8]) list.push_back(std::uint8_t(entry));
  return list;
}

}  // namespace

std::uint64_t next_version() {
  static std::atomic<std::uint64_t> last = 0;  // a number for each surface that ever was
  return ++last;
}

std::vector<float> depth_below_smoothed(const Mesh& mesh, std::span<const Vec3> normals, float width) {
  const Neighbours near(mesh);
  const float edge = float(mean_edge(mesh));
  if (!(width > 0.f) || !(edge > 0.f)) return std::vector<float>(mesh.positions.size());
  // A step spreads by the variance of an edge in one direction of the surface, halved.
  const int steps = std::clamp(int(std::lround(4.f * (width / edge) * (width / edge))), 1, most_steps);
  std::vector<Vec3> now = mesh.positions, next(now.size());
  for (int step = 0; step < steps; ++step) {
    parallel_for(now.size(), 4096, [&](std::size_t i) {
      const std::uint32_t begin = near.starts[i], end = near.starts[i + 1];
      Vec3 sum = Vec3::Zero();
      for (std::uint32_t k = begin; k < end; ++k) sum += now[near.list[k]];
      next[i] = begin == end ? now[i] : Vec3(.5f * now[i] + .5f / float(end - begin) * sum);
    });
    now.swap(next);
  }
  std::vector<float> depth(now.size());
  for (std::size_t i = 0; i < now.size(); ++i)
    depth[i] = (now[i] - mesh.positions[i]).dot(normals[i]) / width;
  return depth;
}

void Surfaces::add(Mesh mesh, float opacity) {
  Shape shape{.mesh = {}, .normals = vertex_normals(mesh), .openness = {}};
  Bounds extent;
  for (const Vec3& p : mesh.positions) extent.add(p);
  if (!extent.empty()) bounds_.add(extent.low), bounds_.add(extent.high);
  const float width = extent.empty() ? 0.f : smoothing * extent.extent().maxCoeff() * .5f;
  for (const float depth : depth_below_smoothed(mesh, shape.normals, width)) {
    // Bright on gyri, falling within half the smoothing to a third in the depth of sulci.
    const float t = std::clamp(.45f + .9f * depth, 0.f, 1.f);
    shape.openness.push_back(std::uint8_t(255.f * (1.f - .62f * t * t * (3.f - 2.f * t))));
  }
  shape.mesh = std::move(mesh);
  list_.push_back({.given = std::move(shape), .opacity = opacity});
}

void Surfaces::colour(std::span<const float> values) {
  One& one = list_.back();
  if (values.size() != one.given.mesh.positions.size())
    throw Error(
        fmt::format("there are {} values and the surface has {} vertices; give the values of this surface",
                    values.size(), one.given.mesh.positions.size()));
  one.values.assign(values.begin(), values.end()), one.split.reset(), one.openness.clear();
  for (const std::uint8_t open : one.given.openness)
    one.openness.push_back(std::uint8_t(255.f - shade_of_values * float(255 - open)));
  one.version = next_version();
  learn_values();
}

void Surfaces::colour(std::span<const float> keys, std::span<const AreaColour> areas) {
  colour(keys);
  One& one = list_.back();
  one.values.clear();
  learn_values();
  std::vector<std::pair<std::int32_t, std::uint16_t>> places;
  for (const AreaColour& area : areas) {
    const auto known = std::ranges::find(area_colours_, area.colour);
    const auto at = std::size_t(known - area_colours_.begin());
    if (known == area_colours_.end()) area_colours_.push_back(area.colour);
    places.emplace_back(area.key, std::uint16_t(1 + std::min<std::size_t>(at, 0xfffe)));
  }
  std::ranges::sort(places);
  std::set<float> met;
  for (const float key : keys)
    if (!std::isnan(key)) met.insert(key);
  for (const AreaColour& area : areas)
    if (!area.name.empty() && met.contains(float(area.key)) &&
        std::ranges::find(legend_, area.name, &LegendEntry::name) == legend_.end())  // of both hemispheres
      legend_.push_back({area.name, {area.colour}});
  std::vector<std::uint16_t> of;
  for (const float key : keys) {
    const auto found =
        std::ranges::lower_bound(places, key, {}, [](const auto& p) { return float(p.first); });
    of.push_back(found != places.end() && float(found->first) == key ? found->second : std::uint16_t(0));
  }
  const Shape& given = one.given;
  SplitAreas parts = split_areas(given.mesh.triangles, of);
  Shape& split = one.split.emplace();
  split.mesh.positions = parts.carried(std::span(given.mesh.positions));
  split.normals = parts.carried(std::span(given.normals));
  for (Vec3& normal : split.normals) normal = normal.norm() > 0.f ? Vec3(normal.normalized()) : Vec3::UnitY();
  split.openness = parts.carried(std::span(given.openness));
  split.mesh.triangles = std::move(parts.triangles), split.areas = std::move(parts.areas);
}

bool Surfaces::has_values() const {
  return std::ranges::any_of(list_, [](const One& one) { return !one.values.empty(); });
}

std::size_t Surfaces::triangles() const {
  std::size_t sum = 0;
  for (const One& one : list_) sum += one.given.mesh.triangles.size();
  return sum;
}

Side Surfaces::outside() const {
  const float middle = bounds_.empty() ? 0.f : bounds_.centre().x(),
              half = bounds_.empty() ? 0.f : .5f * bounds_.extent().x();
  if (std::abs(middle) <= .4f * half) return Side::above;
  return middle < 0.f ? Side::left : Side::right;
}

frame::Camera Surfaces::camera(Side side, float aspect) const {
  static constexpr struct {
    float from[3], up[3];
  } sides[] = {{{-1, 0, 0}, {0, 0, 1}}, {{1, 0, 0}, {0, 0, 1}}, {{0, 1, 0}, {0, 0, 1}},
               {{0, -1, 0}, {0, 0, 1}}, {{0, 0, 1}, {0, 1, 0}}, {{0, 0, -1}, {0, 1, 0}}};
  frame::Camera camera;
  if (bounds_.empty()) return camera;
  const auto& row = sides[std::size_t(side)];
  camera.field_of_view = 25.f;
  camera.up = Vec3::Map(row.up);
  const Vec3 out = Vec3::Map(row.from), right = camera.up.cross(out);
  const float high = std::tan(.5f * radians(camera.field_of_view)) * .94f, wide = high * aspect;
  // In the middle of what is seen, and as near as all vertices allow.
  const Vec3 centre = bounds_.centre();
  float distance = 0.f;
  for (const One& one : list_)
    for (const Vec3& position : one.given.mesh.positions) {
      const Vec3 at = position - centre;
      distance = std::max(distance, out.dot(at) + std::max(std::abs(right.dot(at)) / wide,
                                                           std::abs(camera.up.dot(at)) / high));
    }
  camera.target = centre;
  camera.eye = centre + std::max(distance, 1.f) * out;
  camera.near = std::max(.5f, 1e-3f * distance);
  return camera;
}

bool zero_means_none(std::span<const float> values) {
  float least = 0.f, most = 0.f;
  for (const float value : values) least = std::fmin(least, value), most = std::fmax(most, value);
  if (-least > nearly_none * most) return false;
  const auto zeros = std::ranges::count(values, 0.f);
  return double(zeros) >= share_of_zeros * double(values.size()) && zeros > 0 &&
         std::ranges::any_of(values, [](float value) { return value > 0.f; });
}

void Surfaces::learn_values() {
  std::vector<float> all;
  for (const One& one : list_) {
    const bool without_zero = zero_means_none(one.values);
    for (const float value : one.values)
      if (std::isfinite(value) && !(without_zero && value <= 0.f)) all.push_back(value);
  }
  values_.reset();
  if (all.empty()) return;
  const auto [least, most] = std::ranges::minmax(all);
  const auto at = [&](double share) {
    const auto place = all.begin() + std::ptrdiff_t(share * double(all.size() - 1));
    std::ranges::nth_element(all, place);
    return *place;
  };
  // What a normal distribution has is within; the values between the wall's zeros and those of the cortex are not.
  constexpr float far = 2.5f;
  const float middle = at(.5);
  const float low = std::max(at(.02), middle - far * (middle - at(.16))),
              high = std::min(at(.98), middle + far * (at(.84) - middle));
  values_ = {least, most, {low, high > low ? high : low + 1.f}};
}

std::pair<bool, bool> Surfaces::beyond_range() const {
  if (!values_) return {false, false};
  const auto [low, high] = shown_range();
  return {values_->least<low, values_->most> high};
}

std::pair<float, float> Surfaces::shown_range() const {
  if (range) return *range;
  if (!values_) return {0.f, 1.f};
  auto [low, high] = values_->usual;
  if (map->diverging && low < 0.f && high > 0.f) high = std::max(-low, high), low = -high;
  const auto step = float(round_below(double(high - low) / 16.));
  return {step * std::floor(low / step), step * std::ceil(high / step)};
}

void Surfaces::show(frame::Frame& frame, const Colouring& colouring, bool playing) {
  if (list_.empty() || !(visibility > 0.f)) return;
  const std::vector<std::uint8_t> free = free_entries(colouring, playing);
  // One for what is plain, then the areas, then as many steps of the map as there are left.
  const bool mapped = std::ranges::any_of(list_, [](const One& one) { return !one.values.empty(); });
  const std::size_t areas = area_colours_.size();
  if (free.size() < 1 + areas + (mapped ? 2 : 0))
    throw Error(fmt::format(
        "the areas of the surfaces have {} colours and {} are left beside those of the neurons; show "
        "fewer areas, or colour the neurons alike",
        areas, free.size() - 1));
  const std::size_t steps = std::min(map_colours, free.size() - 1 - areas);
  frame.palette[free[0]] = plain;
  for (std::size_t i = 0; i < areas; ++i) frame.palette[free[1 + i]] = area_colours_[i];
  const auto entry_of_step = [&](std::size_t step) { return free[1 + areas + step]; };
  if (mapped)
    for (std::size_t i = 0; i < steps; ++i)
      frame.palette[entry_of_step(i)] = (*map)(float(i) / float(steps - 1));
  const auto [low, high] = shown_range();
  shown_.clear();
  for (One& one : list_) {
    const Shape& shape = one.shown();
    one.entries.assign(shape.mesh.positions.size(), free[0]);
    for (std::size_t i = 0; i < shape.areas.size(); ++i)
      if (shape.areas[i]) one.entries[i] = free[shape.areas[i]];
    for (std::size_t i = 0; i < one.values.size(); ++i) {
      if (!std::isfinite(one.values[i])) continue;
      const float t = std::clamp((one.values[i] - low) / (high - low), 0.f, 1.f);
      one.entries[i] = entry_of_step(std::size_t(t * float(steps - 1) + .5f));
    }
    frame::Surface& s = shown_.emplace_back();
    s.positions = shape.mesh.positions, s.normals = shape.normals;
    s.entries = one.entries, s.openness = one.values.empty() ? shape.openness : one.openness,
    s.triangles = shape.mesh.triangles;
    s.opacity = std::uint8_t(std::lround(255.f * std::clamp(one.opacity * visibility, 0.f, 1.f)));
    s.version = one.version;
  }
  frame.surfaces = shown_;
}

}  // namespace forest::scene
