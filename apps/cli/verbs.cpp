// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "apps/cli/verb.h"

namespace forest::cli {

// One declaration and one row a verb, in the order of --help.
std::function<void()> measure(CLI::App&, Console&);

std::span<const Verb> verbs() {
  static constexpr auto table = std::to_array<Verb>({
      {"measure", "Measure neurons: lengths, counts, angles, asymmetry, Sholl and more",
       "brainforest measure cells/*.swc --kind dendrite --csv cells.csv", measure},
  });
  return table;
}

}  // namespace forest::cli
