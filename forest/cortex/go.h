// SPDX-License-Identifier: Apache-2.0
// Curves on a way that elements may not be able to go to its end. Private to this room.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "forest/cortex/neighbourhood.h"

namespace forest::cortex {

/// What elements must keep: validity and a scaled Jacobian, a good one or the one that they have; -1 of those that are not valid.
std::vector<double> to_keep(const Elements& elements, double good);

/// Every curve goes to `aim`. Where an element would lose what it must keep its curves go half of their way, a quarter, an
/// eighth or stay.
void go(Elements& elements, std::span<const Depths> aim, std::span<const double> keep);

}  // namespace forest::cortex
