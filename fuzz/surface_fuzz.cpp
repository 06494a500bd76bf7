// SPDX-License-Identifier: Apache-2.0
// Any bytes are an error with a sentence, or a surface whose triangles have corners, or values.
#include <cstdint>
#include <cstdlib>

#include "forest/core/error.h"
#include "forest/io/surface.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace forest;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  try {
    const Mesh mesh = io::read_surface(bytes, "input");
    if (!io::may_be_surface(bytes)) std::abort();
    for (const Triangle& triangle : mesh.triangles)
      for (const std::uint32_t corner : triangle)
        if (!mesh.positions.at(corner).allFinite()) std::abort();
  } catch (const InputError&) {
  }
  try {
    if (io::read_surface_values(bytes, "input").values.empty()) std::abort();
  } catch (const InputError&) {
  }
  return 0;
}
