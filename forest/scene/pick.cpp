// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/pick.h"

#include <cmath>
#include <tuple>

#include "forest/core/parallel.h"

namespace forest::scene {
namespace {

float half_to_float(std::uint32_t bits) {
  return float(Eigen::numext::bit_cast<Eigen::half>(std::uint16_t(bits)));
}

// Whether the ray, a cone of half angle `tolerance`, comes within the sphere before `limit`.
bool meets(const Ray& ray, const Sphere& sphere, float tolerance, float limit) {
  const Vec3 to = sphere.centre - ray.origin;
  const float along = to.dot(ray.direction);
  if (along < -sphere.radius || along - sphere.radius > limit) return false;
  const float reach = sphere.radius + tolerance * std::max(0.f, along + sphere.radius);
  return (to - along * ray.direction).squaredNorm() <= reach * reach;
}

}  // namespace

RoundCone in_world(const Forest& forest, std::uint32_t instance, std::uint32_t segment) {
  const frame::Instance& i = forest.instances()[instance];
  const frame::Segment& s = forest.segments()[segment];
  const Quat turn(i.qw, i.qx, i.qy, i.qz);
  const Vec3 at(i.x, i.y, i.z);
  return {at + turn * Vec3(s.ax, s.ay, s.az), at + turn * Vec3(s.bx, s.by, s.bz),
          half_to_float(s.radii & 0xffff), half_to_float(s.radii >> 16)};
}

std::optional<Pick> pick(const Forest& forest, const Ray& ray, float tolerance, float near,
                         std::span<const frame::State> states) {
  std::optional<Pick> best;
  std::vector<std::uint32_t> open;
  for (std::uint32_t index = 0; index < forest.instances().size(); ++index) {
    const frame::Instance& instance = forest.instances()[index];
    const Neuron& neuron = forest.neurons()[instance.morphology];
    if (!neuron.cluster_count) continue;
    if (!states.empty() && !states[index].is(frame::State::visible)) continue;
    const bool soma_alone = !states.empty() && states[index].kind == frame::Kind::somata;
    const Quat turn(instance.qw, instance.qx, instance.qy, instance.qz);
    const Vec3 at(instance.x, instance.y, instance.z);
    open.assign(1, neuron.first_cluster);
    while (!open.empty()) {
      const Cluster& c = forest.clusters()[open.back()];
      open.pop_back();
      if (!meets(ray, {at + turn * Vec3(c.x, c.y, c.z), c.radius}, tolerance,
                 best ? best->distance : INFINITY))
        continue;
      if (!c.is_leaf()) {
        open.insert(open.end(), std::begin(c.children), std::end(c.children));
        continue;
      }
      for (std::uint32_t s = c.first_segment; s < c.first_segment + c.segment_count; ++s) {
        const std::uint32_t section =
            forest.section_of_segment()[neuron.first_original + s - neuron.first_segment];
        if (soma_alone && section != soma_section) continue;
        RoundCone cone = in_world(forest, index, s);
        const float depth = (.5f * (cone.a + cone.b) - ray.origin).dot(ray.direction);
        cone.radius_a += tolerance * std::max(0.f, depth);
        cone.radius_b += tolerance * std::max(0.f, depth);
        const auto t = intersect(ray, cone);
        if (!t || *t < near) continue;
        // At a joint two segments are met at once: the first of them is meant, whatever the order of the walk.
        if (best && std::tuple(*t, index, s) >= std::tuple(best->distance, best->instance, best->segment))
          continue;
        best = Pick{index, s, section, *t};
      }
    }
  }
  return best;
}

std::vector<std::uint32_t> subarbor(const Forest& forest, std::uint32_t instance, std::uint32_t section) {
  const Neuron& neuron = forest.neurons()[forest.instances()[instance].morphology];
  std::vector<bool> inside(neuron.section_count, section == soma_section);
  for (std::uint32_t s = 0; s < neuron.section_count; ++s) {  // parents come first
    const std::uint32_t parent = forest.sections()[neuron.first_section + s].parent;
    if (s == section || (parent != 0xffffffffu && inside[parent])) inside[s] = true;
  }
  std::vector<std::uint32_t> segments;
  for (std::uint32_t i = 0; i < neuron.original_count; ++i) {
    const std::uint32_t of = forest.section_of_segment()[neuron.first_original + i];
    if (of == soma_section ? section == soma_section : inside[of])
      segments.push_back(neuron.first_segment + i);
  }
  return segments;
}

}  // namespace forest::scene
