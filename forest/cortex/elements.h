// SPDX-License-Identifier: Apache-2.0
// The finite elements of a cortex: curved hexahedra with four corners on the outer surface and four on the inner one, which
// share their faces and fill the ribbon. An element is a 4×4 array of w-curves, each of them known at four depths; the
// tricubic map goes through all 64 places.
//
//       ●──○──○──●      ● curves of corners, shared by the elements around
//       ○  ·  ·  ○      ○ of sides, shared by two
//       ○  ·  ·  ○      · its own
//       ●──○──○──●      each at w = 0 (outer), 1/3, 2/3 and 1 (inner), about thirds of the volume
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "forest/cortex/depth.h"
#include "forest/cortex/hexahedron.h"
#include "forest/cortex/quads.h"
#include "forest/cortex/w_curve.h"

namespace forest::cortex {

using Depths = std::array<Place, 4>;  // of a curve at w = 0, 1/3, 2/3, 1; µm

struct Elements {
  std::vector<Depths> curves;
  std::uint32_t corners = 0;                            // the first so many curves are corners
  std::vector<std::array<std::uint32_t, 16>> elements;  // curves; u runs fastest, then v
  std::vector<std::uint8_t> on_valley;                  // of every corner
  Depth depth;                                          // by volume, of w
  std::size_t not_arrived = 0;                          // curves that took the straight way

  std::size_t size() const { return elements.size(); }
  Hexahedron hexahedron(std::size_t element) const;
  /// The four curves at the corners of an element: (u, v) = (0, 0), (1, 0), (0, 1), (1, 1).
  std::array<std::uint32_t, 4> corners_of(std::size_t element) const {
    const auto& e = elements[element];
    return {e[0], e[3], e[12], e[15]};
  }
};

/// Elements over the quadrilaterals, v along the fold and u across it where the ribbon is bent.
Elements make_elements(const Ribbon& ribbon, const Quads& quads, std::span<const Curvature> curvatures,
                       const WCurves& curves, Progress& progress);

/// Which elements are not proven to be valid.
std::vector<std::uint32_t> uncertified(const Elements& elements, std::span<const std::uint32_t> of);
std::vector<std::uint32_t> uncertified(const Elements& elements);

}  // namespace forest::cortex
