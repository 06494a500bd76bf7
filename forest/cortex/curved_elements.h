// SPDX-License-Identifier: Apache-2.0
// A made-up sheet of cortex for tests and benchmarks: elements of about 1 mm³ between two wavy surfaces that share faces.
#pragma once

#include <cstddef>
#include <vector>

#include "forest/cortex/hexahedron.h"

namespace forest::cortex {

/// @param across, along  elements in both directions of the sheet
/// Gyri and sulci run along the second direction; the outer surface is that of the given shape, the inner one lies some 2.4 mm below.
std::vector<Hexahedron> folded_sheet(std::size_t across, std::size_t along);

}  // namespace forest::cortex
