// SPDX-License-Identifier: Apache-2.0
#include "forest/fitting/tuning.h"

#include <algorithm>
#include <cmath>

#include "forest/lsystem/grow.h"

namespace forest::fitting {
namespace {

constexpr double most_turned = 1.6;         // and no less than its inverse
constexpr std::uint64_t seed = 0x74756e65;  // "tune": not what neurons are grown with later

void turn(lsystem::Grammar& grammar, const Tuning& tuning) {
  for (std::size_t k = 0; k < knobs.size(); ++k) {
    auto& table = *std::ranges::find(grammar.lookups.tables, knobs[k].name, &lsystem::Table::name);
    std::size_t bin = 0;
    for (const auto& [kind, values] : tuning) table.values[bin++] = values[k];
  }
}

}  // namespace

Tuning untuned(const Traced& traced) {
  Tuning tuning;
  for (const auto& [kind, mean] : traced.means)
    for (std::size_t k = 0; k < knobs.size(); ++k) tuning[kind][k] = knobs[k].first;
  return tuning;
}

Tuning tuned(lsystem::Grammar grammar, const Traced& traced, const Resampling& options, Progress& progress) {
  const std::size_t rounds = options.tuning.rounds,
                    count = std::min(traced.cells.size(), options.tuning.most);
  Tuning tuning = untuned(traced),
         sums;  // sums: of logarithms, over the later half, which chance alone moves
  progress.begin("tuning", rounds * count);
  for (std::size_t round = 0; round < rounds; ++round) {
    const Traced grown = learn(lsystem::grow_population(grammar, count, seed + round), options.kinds);
    for (auto& [kind, values] : tuning) {
      const auto mean = grown.means.find(kind);
      for (std::size_t k = 0; k < knobs.size(); ++k) {
        const Knob& knob = knobs[k];
        const double sd = traced.deviations.at(kind)[knob.style];
        if (sd > 0. && mean != grown.means.end()) {
          const double amiss = (traced.means.at(kind)[knob.style] - mean->second[knob.style]) / sd;
          values[k] = std::clamp(values[k] * std::exp(knob.gain * std::clamp(amiss, -1., 1.)),
                                 knob.first / most_turned, knob.first * most_turned);
        }
        if (2 * round >= rounds) sums[kind][k] += std::log(values[k]);
      }
    }
    turn(grammar, tuning);
    progress.advance(count);
  }
  progress.end();
  for (const auto& [kind, sum] : sums)
    for (std::size_t k = 0; k < knobs.size(); ++k)
      tuning[kind][k] = std::exp(sum[k] / double(rounds - (rounds + 1) / 2));
  return tuning;
}

}  // namespace forest::fitting
