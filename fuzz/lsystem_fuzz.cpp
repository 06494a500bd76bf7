// SPDX-License-Identifier: Apache-2.0
// Any bytes are a grammar, a neuron as a string, or an error with a sentence. What is a grammar grows for a few steps.
#include <cstdint>
#include <cstdlib>
#include <string>

#include "forest/core/error.h"
#include "forest/lsystem/derive.h"
#include "forest/lsystem/morphology_string.h"
#include "forest/lsystem/turtle.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace forest;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  try {
    lsystem::Grammar grammar = lsystem::parse(text, "input");
    grammar.limit = 1000;
    (void)lsystem::interpret(lsystem::derive(grammar, 1, 0, 6), grammar);
  } catch (const Error&) {
  }
  try {
    const std::string written = lsystem::to_string(lsystem::morphology_from_string(text));
    if (lsystem::to_string(lsystem::morphology_from_string(written)) != written) std::abort();
  } catch (const InputError&) {
  }
  return 0;
}
