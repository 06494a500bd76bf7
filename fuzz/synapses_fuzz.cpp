// SPDX-License-Identifier: Apache-2.0
// Any bytes are refused with a sentence or are synapses of a small forest that can be seen and picked. Checksums are put right
// first, so that what lies behind them is reached.
#include <cstdint>
#include <vector>

#include "forest/core/error.h"
#include "forest/scene/synapses.h"
#include "forest/scene/view.h"

#include "tests/checksums.h"
#include "tests/sample_forest.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace forest;
  static const scene::Forest sample =
      scene::Forest::from_bytes(scene::pack(testing::sample_circuit(4), testing::sample_neurons()), "sample");
  static const scene::Colouring colouring =
      scene::colour(sample, scene::ColourBy::type, scene::Background::dark);
  const auto* first = reinterpret_cast<const std::byte*>(data);
  std::vector<std::byte> bytes(first, first + size);
  testing::put_synapses_right(bytes);
  try {
    const auto synapses = scene::Synapses::from_bytes(std::move(bytes), sample, "input");
    const scene::View view = scene::overview(sample);
    const frame::Viewport viewport{640.f, 360.f};
    for (const std::size_t most : {std::size_t(10), std::size_t(100'000)}) {
      const auto choice = synapses.choose(scene::Eye(view.camera, viewport, view.detail), colouring,
                                          scene::SynapseColour::sign, most);
      (void)scene::pick(choice, view.camera, viewport, {320.f, 180.f});
      for (const std::uint32_t s : choice.synapses)
        (void)synapses.projection(synapses.all()[s]), (void)synapses.section(synapses.all()[s]);
    }
  } catch (const InputError&) {
  }
  return 0;
}
