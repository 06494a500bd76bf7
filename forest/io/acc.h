// SPDX-License-Identifier: Apache-2.0
// Arbor's cable-cell component (ACC): the morphology as an s-expression, written only (Abi Akar et al. 2019, "Arbor", PDP;
// Arbor's documentation, "Cable cell format", version "0.1-dev").
//
//   (arbor-component (meta-data (version "0.1-dev"))
//     (morphology (branch 0 -1 (segment 0 (point x y z radius) (point x y z radius) tag) …) …))
#pragma once

#include <string>

#include "forest/io/keeps.h"

namespace forest::io {

/// Branches without parent all begin at the root of an Arbor cell, so that none stays apart. Annotations are comments.
inline constexpr Keeps acc_keeps{
    .contours = false, .loose_roots = false, .lengthless = false, .zero_radii = false, .spines = false};

/// A branch for each section, with SWC's numbers as tags. A sphere is two halves of a cylinder as long as wide, and neurites
/// leave from between them.
std::string write_acc(const Morphology& morphology);

}  // namespace forest::io
