// SPDX-License-Identifier: Apache-2.0
// What a ray from the eye meets first, at full detail, on the CPU: exact, and the same without any graphics card.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "forest/scene/forest.h"

namespace forest::scene {

struct Pick {
  std::uint32_t instance = 0;
  std::uint32_t segment = 0;  // in Forest::segments()
  std::uint32_t section = 0;  // within its neuron, or soma_section
  float distance = 0.f;       // from the eye, µm
};

/// @param tolerance  radius of the ray at unit distance (µm a µm): half a pixel's slope makes thin branches pickable
/// @param states  one an instance: those that are not visible are not met, of those that show their somata alone the rest
///                is not. None: all are
std::optional<Pick> pick(const Forest& forest, const Ray& ray, float tolerance = 0.f, float near = 0.f,
                         std::span<const frame::State> states = {});

/// A segment of an instance in the world.
RoundCone in_world(const Forest& forest, std::uint32_t instance, std::uint32_t segment);

/// The original segments of a section and of all that grows out of it (the subarbor); of the soma: the whole neuron.
std::vector<std::uint32_t> subarbor(const Forest& forest, std::uint32_t instance, std::uint32_t section);

}  // namespace forest::scene
