// SPDX-License-Identifier: Apache-2.0
// Any bytes are an error with a sentence, or contours that can be written and read again.
#include <cstdint>
#include <cstdlib>

#include "forest/core/error.h"
#include "forest/io/contours.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace forest;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  try {
    const io::ReadContours read = io::read_contours(bytes, "input");
    if (io::read_contours(io::write_contours(read.stack), "again").stack != read.stack) std::abort();
  } catch (const InputError&) {
  }
  return 0;
}
