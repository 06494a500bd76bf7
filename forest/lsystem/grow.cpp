// SPDX-License-Identifier: Apache-2.0
#include "forest/lsystem/grow.h"

#include "forest/core/parallel.h"
#include "forest/lsystem/derive.h"
#include "forest/lsystem/turtle.h"

namespace forest::lsystem {

Morphology grow(const Grammar& grammar, std::uint64_t seed, std::uint64_t index) {
  return interpret(Deriver(grammar).derive(seed, index), grammar);
}

std::vector<Morphology> grow_population(const Grammar& grammar, std::size_t count, std::uint64_t seed,
                                        Progress& progress) {
  std::vector<Morphology> neurons(count);
  progress.begin("growing", count);
  parallel_ranges(count, 1, [&](std::size_t begin, std::size_t end) {
    Deriver deriver(grammar);
    for (std::size_t i = begin; i < end; ++i) {
      neurons[i] = interpret(deriver.derive(seed, i), grammar);
      progress.advance();
    }
  });
  progress.end();
  return neurons;
}

}  // namespace forest::lsystem
