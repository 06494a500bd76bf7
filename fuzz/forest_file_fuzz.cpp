// SPDX-License-Identifier: Apache-2.0
// Any bytes are refused with a sentence or are a forest that can be seen and picked. Checksums are put right first, so
// that what lies behind them is reached.
#include <cstdint>
#include <vector>

#include "forest/core/error.h"
#include "forest/scene/cut.h"
#include "forest/scene/pick.h"
#include "forest/scene/view.h"

#include "tests/checksums.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace forest;
  const auto* first = reinterpret_cast<const std::byte*>(data);
  std::vector<std::byte> bytes(first, first + size);
  testing::put_forest_right(bytes);
  try {
    const scene::Forest forest = scene::Forest::from_bytes(std::move(bytes), "input");
    scene::View view = scene::overview(forest);
    const frame::Viewport viewport{640.f, 360.f};
    for (const float error : {.1f, 1.f, 50.f}) {
      view.detail.error = view.detail.thinnest = error;
      (void)scene::choose(forest, scene::Eye(view.camera, viewport, view.detail), viewport);
    }
    const auto pick = scene::pick(forest, view.camera, viewport, {320.f, 180.f});
    if (pick) (void)scene::subarbor(forest, pick->instance, pick->section);
  } catch (const InputError&) {
  }
  return 0;
}
