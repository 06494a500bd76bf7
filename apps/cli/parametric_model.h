// SPDX-License-Identifier: Apache-2.0
// Models of a published form, fitted to neurons: what `fit` and `distributions` share.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>

#include "forest/morphology/morphology.h"
#include "forest/statistics/arbors.h"

namespace forest::cli {

class Console;

inline const std::array<std::string, 2> parametric_forms{"burke", "hillman"};

/// The grammar of such a form. Warns where what grows has far more or fewer tips than what was traced.
/// @param form  one of parametric_forms
std::string parametric_grammar(const std::string& form, std::span<const Morphology> cells,
                               const std::string& name, statistics::KindSet kinds, std::uint64_t seed,
                               Console& console);

}  // namespace forest::cli
