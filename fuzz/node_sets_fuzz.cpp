// SPDX-License-Identifier: Apache-2.0
// Any text is refused with a sentence, or is node sets that come back as they were written and can all be resolved or are refused.
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "forest/core/error.h"
#include "forest/io/node_sets.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace forest;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const circuit::NodeTable table{3,
                                 [](std::string_view name) -> std::optional<circuit::Attribute> {
                                   if (name == "layer") return circuit::Attribute{{"2", "L5"}, {0, 1, 1}, {}};
                                   if (name == "y") return circuit::Attribute{{}, {}, {0., 1., 2.}};
                                   return std::nullopt;
                                 },
                                 "layer, y"};
  try {
    (void)circuit::evaluate(
        text, [](const std::string&) { return circuit::Members{1}; }, 3);
  } catch (const Error&) {
  }
  try {
    const circuit::NodeSets sets = io::parse_node_sets(text, "input");
    if (io::to_json(io::parse_node_sets(io::to_json(sets), "again")) != io::to_json(sets)) std::abort();
    for (const circuit::NodeSet& set : sets.sets) try {
        (void)circuit::members(sets, set.name, table);
      } catch (const InputError&) {
      }
  } catch (const InputError&) {
  }
  return 0;
}
