// SPDX-License-Identifier: Apache-2.0
#include "forest/lsystem/grow.h"

#include <fmt/format.h>

#include "forest/core/parallel.h"
#include "forest/lsystem/derive.h"
#include "forest/lsystem/turtle.h"

namespace forest::lsystem {

namespace {

Annotations source(const Grammar& grammar, std::uint64_t seed, std::uint64_t index,
                   const cortex::Site& site) {
  Annotations list{
      {"grammar", grammar.name}, {"seed", std::to_string(seed)}, {"index", std::to_string(index)}};
  if (site.environment)
    list.emplace_back("grown_at", fmt::format("{}, {}, {}", site.at.x(), site.at.y(), site.at.z()));
  return list;
}

}  // namespace

Morphology grow(Deriver& deriver, const Grammar& grammar, std::uint64_t seed, std::uint64_t index) {
  return interpret(deriver.derive(seed, index), grammar, source(grammar, seed, index, deriver.site()),
                   deriver.site());
}

Morphology grow(const Grammar& grammar, std::uint64_t seed, std::uint64_t index, const cortex::Site& site) {
  Deriver deriver(grammar, site);
  return grow(deriver, grammar, seed, index);
}

Morphology grow_to(Deriver& deriver, const Grammar& grammar, std::uint64_t seed, std::uint64_t index,
                   int steps) {
  Annotations annotations = source(grammar, seed, index, deriver.site());
  annotations.emplace_back("step", std::to_string(steps));
  return interpret(deriver.derive(seed, index, steps), grammar, annotations, deriver.site());
}

std::vector<Morphology> grow_population(const Grammar& grammar, std::size_t count, std::uint64_t seed,
                                        Progress& progress, std::uint64_t first, const cortex::Site& site) {
  std::vector<Morphology> neurons(count);
  progress.begin("growing", count);
  parallel_ranges(count, 1, [&](std::size_t begin, std::size_t end) {
    Deriver deriver(grammar, site);
    for (std::size_t i = begin; i < end; ++i) {
      neurons[i] = grow(deriver, grammar, seed, first + i);
      progress.advance();
    }
  });
  progress.end();
  return neurons;
}

}  // namespace forest::lsystem
