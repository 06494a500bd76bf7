// SPDX-License-Identifier: Apache-2.0
#include "apps/cli/parametric_model.h"

#include <fmt/format.h>

#include "forest/fitting/burke.h"
#include "forest/fitting/hillman.h"

#include "apps/cli/console.h"

namespace forest::cli {

std::string parametric_grammar(const std::string& form, std::span<const Morphology> cells,
                               const std::string& name, statistics::KindSet kinds, std::uint64_t seed,
                               Console& console) {
  const auto tell = [&](const fitting::Corrected& c) {
    constexpr double alike = 1.25;
    if (c.grown < alike * c.traced && c.traced < alike * c.grown) return;
    console.warn(
        fmt::format("what grows of kind {} by these rules has {:.3g} tips in the mean, where the traced ones "
                    "have {:.3g}; "
                    "'brainforest fit' without a --form keeps how many a neuron has",
                    name_of(c.kind), c.grown, c.traced));
  };
  const auto write = form == "burke" ? fitting::burke_grammar : fitting::hillman_grammar;
  return write(cells, name, {.kinds = kinds, .seed = seed, .tell = tell});
}

}  // namespace forest::cli
