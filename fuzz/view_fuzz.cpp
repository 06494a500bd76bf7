// SPDX-License-Identifier: Apache-2.0
// Any text is a view that is written and read back the same, or an error with a sentence.
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "forest/core/error.h"
#include "forest/scene/view.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace forest;
  try {
    const scene::View view = scene::parse_view({reinterpret_cast<const char*>(data), size}, "input");
    const std::string written = scene::to_json(view);
    if (scene::to_json(scene::parse_view(written, "written")) != written) std::abort();
  } catch (const InputError& error) {
    if (error.file() != "input") std::abort();  // what we wrote must be read
  }
  return 0;
}
