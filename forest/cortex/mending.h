// SPDX-License-Identifier: Apache-2.0
// What is done for elements that are not proven to be valid, or are badly shaped, when all the others are as they should be.
#pragma once

#include <cstdint>
#include <span>

#include "forest/cortex/elements.h"
#include "forest/cortex/shape.h"

namespace forest::cortex {

struct Mending {
  std::size_t before = 0, after = 0;  // elements not certified
};
/// Makes elements valid that are not, by straightening their sides first and then moving their corners towards the middle
/// of those around; what lies on a surface stays on it.
Mending mend(Elements& elements, const SurfaceTrees& surfaces, Progress& progress);

/// Within so many rings of elements around those that are given every corner goes to the middle of its neighbours, off the
/// surfaces, and sides are straight; the rim stays. A start for shaping.
void even_out(Elements& elements, std::span<const std::uint32_t> heap, int rings);

enum class Rings : unsigned char { few, many };  // many leave the surfaces farther

/// Heaps of elements that are not valid, or whose scaled Jacobian is less than `least` somewhere, begin anew: they are shaped with
/// what is around them, from where they are and from even_out over ever other rings. Each heap keeps of every try what leaves fewer
/// elements of it not valid, or as many and the rest better shaped.
void begin_anew(Elements& elements, const SurfaceTrees& surfaces, const Shaping& shaping, double least,
                Progress& progress, Rings rings = Rings::few);

struct LeftOut {
  std::size_t elements = 0;
  double volume = 0.;  // µm³
};
/// By the wall, where the surfaces meet at an edge, there may be no room for an element, and none where they touch: elements
/// there that are not valid, or whose scaled Jacobian is less than `least` somewhere, go to the wall.
LeftOut leave_out(Elements& elements, double least);

}  // namespace forest::cortex
