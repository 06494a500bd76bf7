// SPDX-License-Identifier: Apache-2.0
// Any text is an environment that answers, or an error with a sentence.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "forest/circuit/environment.h"
#include "forest/core/error.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace forest;
  try {
    const cortex::Environment e =
        circuit::parse_environment({reinterpret_cast<const char*>(data), size}, "input");
    for (const Eigen::Vector3d& place : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1e5, -1e5, 3)}) {
      const auto nearest = e.nearest_soma(place, {1, 2, 3});
      const auto field = e.field(place);
      if (!std::isfinite(e.depth(place) + nearest.distance + nearest.direction.sum() + field.density +
                         field.direction.sum()))
        std::abort();
    }
  } catch (const Error&) {
  }
  return 0;
}
