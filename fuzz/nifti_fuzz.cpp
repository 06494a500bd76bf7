// SPDX-License-Identifier: Apache-2.0
// Any bytes are an error with a sentence, or a volume with as many values as it says.
#include <cstdint>
#include <cstdlib>

#include "forest/core/error.h"
#include "forest/io/nifti.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace forest;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  try {
    const cortex::Volume volume = io::read_nifti(bytes, "input").volume;
    if (!io::may_be_nifti(bytes) || volume.values.size() != volume.size[0] * volume.size[1] * volume.size[2])
      std::abort();
  } catch (const InputError&) {
  }
  return 0;
}
