// SPDX-License-Identifier: Apache-2.0
// Any bytes are an error with a sentence, or borders whose points lie on the surface that they speak of.
#include <cmath>
#include <cstdint>
#include <cstdlib>

#include "forest/core/error.h"
#include "forest/io/border_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace forest;
  try {
    const io::Borders read = io::read_borders({reinterpret_cast<const char*>(data), size}, "input");
    for (const io::Border& border : read.borders)
      for (const io::BorderPoint& point : border.points)
        for (std::size_t k = 0; k < 3; ++k)
          if (point.vertices[k] >= read.surface_vertices || !std::isfinite(point.weights[k])) std::abort();
  } catch (const InputError&) {
  }
  return 0;
}
