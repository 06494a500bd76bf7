// SPDX-License-Identifier: Apache-2.0
// Neurons drawn for reports, flat and all at one scale: what is it that a person sees of them?
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "forest/morphology/morphology.h"
#include "forest/statistics/arbors.h"

namespace forest::cli {

/// Rows of neurons as SVG, seen as they were traced (x to the right, y upwards), apical dendrites darker; with a letter each and one scale bar.
std::string silhouettes(std::span<const Morphology* const> neurons, const statistics::KindSet& kinds);

/// Some traced and as many grown neurons in an order of chance.
struct Riddle {
  std::string drawing;  // silhouettes()
  std::string answer;   // "Traced are A, C, D; grown are B, E, F."
};
Riddle which_is_which(std::span<const Morphology> traced, std::span<const Morphology> grown, std::size_t each,
                      const statistics::KindSet& kinds, std::uint64_t seed);

}  // namespace forest::cli
