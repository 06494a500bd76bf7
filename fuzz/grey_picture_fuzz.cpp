// SPDX-License-Identifier: Apache-2.0
// Any bytes are an error with a sentence, or pages with as many values as they say.
#include <algorithm>
#include <cstdint>
#include <cstdlib>

#include "forest/core/error.h"
#include "forest/io/grey_picture.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace forest;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  try {
    io::GreyFile file(bytes, "input");
    const std::size_t pages = std::min<std::size_t>(file.pages(), 3);
    for (std::size_t page = 0; page < pages; ++page) {
      const io::GreyPicture picture = file.read(page);
      if (picture.values.size() != std::size_t(picture.width) * picture.height) std::abort();
    }
  } catch (const InputError&) {
  }
  return 0;
}
