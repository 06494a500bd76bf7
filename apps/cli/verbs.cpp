// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "apps/cli/verb.h"

namespace forest::cli {

// One declaration and one row a verb, in the order of --help.

std::span<const Verb> verbs() {
  static constexpr std::array<Verb, 0> table{};
  return table;
}

}  // namespace forest::cli
