// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/cut.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "forest/core/parallel.h"

namespace forest::scene {
namespace {

constexpr float dot_limit = 24.f;  // a soma of a larger radius, in pixels, is drawn as a capsule
constexpr std::size_t chunk = 64;  // neurons; fixed, so that the result does not depend on threads

struct Placed {
  Vec3 position;
  Quat turn;
  Sphere operator()(const Cluster& c) const { return {position + turn * Vec3(c.x, c.y, c.z), c.radius}; }
};

frame::Item item(std::uint32_t instance, std::uint32_t first, std::uint32_t count, const Sphere& sphere) {
  return {instance, first, count, 0, sphere.centre.x(), sphere.centre.y(), sphere.centre.z(), sphere.radius};
}

void choose_neuron(const Forest& forest, const Eye& eye, const frame::Frustum& frustum, std::uint32_t index,
                   Cut& cut) {
  const frame::Instance& instance = forest.instances()[index];
  const Neuron& neuron = forest.neurons()[instance.morphology];
  if (!neuron.cluster_count) return;
  const Placed placed{{instance.x, instance.y, instance.z},
                      Quat(instance.qw, instance.qx, instance.qy, instance.qz)};
  const auto clusters = forest.clusters();
  const Detail& detail = eye.detail();
  std::uint32_t open[64];
  int depth = 0;
  open[depth++] = neuron.first_cluster;
  const std::uint64_t before = cut.segments;
  while (depth) {
    const Cluster& c = clusters[open[--depth]];
    const Sphere sphere = placed(c);
    if (!frustum.may_see(sphere)) continue;
    if (!c.is_leaf() && depth + 2 <= 64 && !eye.good_enough(sphere, c.error)) {
      open[depth++] = c.children[1];
      open[depth++] = c.children[0];
      continue;
    }
    const float width = 2.f * c.thickness * eye.magnification(sphere);
    const std::uint32_t count = detail.thin ? c.visible_at(eye.magnification(sphere)) : c.segment_count;
    if (!count) continue;
    (width <= detail.surface_width ? cut.lines : cut.capsules)
        .push_back(item(index, c.first_segment, count, sphere));
    cut.segments += count;
  }
  if (neuron.soma_radius > 0.f) {
    const Sphere soma{placed.position, neuron.soma_radius};
    if (frustum.may_see(soma)) {
      const bool large = neuron.soma_radius * eye.magnification(soma) > dot_limit;
      (large ? cut.capsules : cut.dots).push_back(item(index, neuron.first_segment, 1, soma));
      ++cut.segments;
    }
  }
  cut.neurons += cut.segments > before;
}

void append(std::vector<frame::Item>& to, const std::vector<frame::Item>& from) {
  to.insert(to.end(), from.begin(), from.end());
}

// Sorts a list from near to far, in steps of a 1/64 octave, and returns where each step begins.
constexpr std::size_t steps = 64 * 24;
using Starts = std::array<std::uint32_t, steps + 1>;

// By the centre: a large sphere around the eye says little of where its branches are.
std::size_t step_of(const frame::Item& item, const Eye& eye) {
  const float depth = eye.nearest_depth({{item.x, item.y, item.z}, 0.f});
  return std::size_t(std::clamp(64.f * std::log2(depth / eye.camera().near), 0.f, float(steps - 1)));
}

Starts sort_near_to_far(std::vector<frame::Item>& list, const Eye& eye) {
  std::vector<std::uint16_t> step(list.size());
  parallel_for(list.size(), 4096, [&](std::size_t i) { step[i] = std::uint16_t(step_of(list[i], eye)); });
  Starts starts{};
  for (const std::uint16_t s : step) ++starts[s + 1u];
  std::partial_sum(starts.begin(), starts.end(), starts.begin());
  Starts next = starts;
  std::vector<frame::Item> sorted(list.size());
  for (std::size_t i = 0; i < list.size(); ++i) sorted[next[step[i]]++] = list[i];
  list = std::move(sorted);
  return starts;
}

// Bands grow by half each: what the near ones hide is then left out of the far ones.
std::vector<frame::Band> bands_of(const Starts& dots, const Starts& lines, const Starts& capsules) {
  const auto items_before = [&](std::size_t s) { return std::size_t(dots[s]) / 16 + lines[s] + capsules[s]; };
  const std::size_t total = items_before(steps);
  std::vector<frame::Band> bands;
  std::size_t next = std::max<std::size_t>(total / 24, 64);
  for (std::size_t s = 1; s <= steps; ++s) {
    if (s < steps && items_before(s) < next) continue;
    bands.push_back({dots[s], lines[s], capsules[s]});
    next = std::max(next + next / 2, items_before(s) + total / 24);
  }
  return bands;
}

}  // namespace

Cut choose(const Forest& forest, const Eye& eye, const frame::Viewport& viewport) {
  const frame::Frustum frustum(eye.camera(), viewport);
  const std::size_t count = forest.instances().size();
  std::vector<Cut> parts((count + chunk - 1) / chunk);
  parallel_for(parts.size(), 1, [&](std::size_t p) {
    for (std::size_t i = p * chunk; i < std::min(count, (p + 1) * chunk); ++i)
      choose_neuron(forest, eye, frustum, std::uint32_t(i), parts[p]);
  });
  Cut whole;
  for (const Cut& part : parts) {
    append(whole.dots, part.dots);
    append(whole.lines, part.lines);
    append(whole.capsules, part.capsules);
    whole.segments += part.segments;
    whole.neurons += part.neurons;
  }
  const Starts dots = sort_near_to_far(whole.dots, eye), lines = sort_near_to_far(whole.lines, eye),
               capsules = sort_near_to_far(whole.capsules, eye);
  whole.bands = bands_of(dots, lines, capsules);
  return whole;
}

}  // namespace forest::scene
