// SPDX-License-Identifier: Apache-2.0
// Any bytes are a grammar, a neuron as a string, or an error with a sentence. What is a grammar grows for a few steps, alone
// and among somata below a pia.
#include <algorithm>
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
    for (std::size_t i = 0; i < std::min<std::size_t>(grammar.declarations.size(), 8); ++i)
      try {  // what was read is read again, alone
        (void)lsystem::parse(text_of(grammar.declarations[i], grammar) + "axiom: F\ngrow: F -> F\n", "alone");
      } catch (const Error&) {
        std::abort();
      }
    (void)lsystem::interpret(lsystem::derive(grammar, 1, 0, 6), grammar);
    static const cortex::Environment around({{"L1", 90.f, 120.f}}, {{{3, 8, 0}, 4.f}, {{-5, 12, 2}, 6.f}},
                                            {{{40, 0, 0}, 1.f, 20.f}});
    const cortex::Site site{&around, {0, 0, 0}};
    (void)lsystem::interpret(lsystem::derive(grammar, 1, 0, 6, site), grammar, {}, site);
  } catch (const Error&) {
  }
  try {
    const std::string written = lsystem::to_string(lsystem::morphology_from_string(text));
    if (lsystem::to_string(lsystem::morphology_from_string(written)) != written) std::abort();
  } catch (const InputError&) {
  }
  return 0;
}
