// SPDX-License-Identifier: Apache-2.0
// What lies under a pixel, at full detail, on the CPU: exact, and the same without any graphics card.
//
// A branch is mostly thinner than a pixel, and a ray through the middle of one hits it by luck. So every branch is taken to
// be wider on each side by a `reach` in pixels, half a pixel unless told otherwise: what a pixel's square would touch. Under
// a place of the picture lies the original segment whose tapered capsule, widened so at each end by the size of a pixel at
// that end's depth and cut at the near distance as the renderers cut it, is entered first by the ray through the place. Of
// several entered at one point (segments share the sphere at their joint) it is the one of the smallest neuron and number.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "forest/scene/cut.h"
#include "forest/scene/forest.h"

namespace forest::scene {

struct Pick {
  std::uint32_t instance = 0;
  std::uint32_t segment = 0;  // in Forest::segments()
  std::uint32_t section = 0;  // within its neuron, or soma_section
  double distance = 0.;       // along the ray, from the eye or the plane of an orthographic one, µm
};

/// @param place  x to the right, y down, in pixels: the middle of the pixel in column i and row j is (i + ½, j + ½)
/// @param reach  pixels that branches are widened by on each side
/// @param shown  neurons and branches that are not visible are not met, of those that show their somata alone the rest is not
std::optional<Pick> pick(const Forest& forest, const frame::Camera& camera, const frame::Viewport& viewport,
                         const Vec2& place, float reach = .5f, const Shown& shown = {});

/// The same for many places, found in another way: each of them against each original segment of each neuron, without
/// trees or bounds, as the union of spheres along the segment's axis. Slow; what `pick` is compared with.
std::vector<std::optional<Pick>> plain_picks(const Forest& forest, const frame::Camera& camera,
                                             const frame::Viewport& viewport, std::span<const Vec2> places,
                                             float reach = .5f, const Shown& shown = {});

/// A segment of an instance in the world.
RoundCone in_world(const Forest& forest, std::uint32_t instance, std::uint32_t segment);

/// The original segments of a section and of all that grows out of it (the subarbor); of the soma: the whole neuron.
std::vector<std::uint32_t> subarbor(const Forest& forest, std::uint32_t instance, std::uint32_t section);

}  // namespace forest::scene
