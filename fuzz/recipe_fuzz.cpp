// SPDX-License-Identifier: Apache-2.0
// Any text is a recipe whose numbers of neurons can be shared out, or an error with a sentence.
#include <cstdint>
#include <string_view>

#include "forest/circuit/recipe.h"
#include "forest/core/error.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace forest;
  try {
    const circuit::Recipe recipe =
        circuit::parse_recipe({reinterpret_cast<const char*>(data), size}, "input");
    circuit::check(recipe);
    (void)circuit::counts(recipe);
  } catch (const Error&) {
  }
  return 0;
}
