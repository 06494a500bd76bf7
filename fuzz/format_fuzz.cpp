// SPDX-License-Identifier: Apache-2.0
// Any bytes are an error with a sentence or a neuron; what is written of that neuron reads back to the same bytes.
#include <cstdint>
#include <cstdlib>

#include "forest/core/error.h"
#include "forest/io/format.h"
#include "forest/morphology/measure.h"
#include "forest/morphology/validate.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace forest;
  static const io::Format& format = *io::find_format(FOREST_FORMAT);
  try {
    const Morphology m = format.read({reinterpret_cast<const char*>(data), size}, "input").morphology;
    if (!(total_length(m) >= 0.)) std::abort();
    (void)validate(m);
    if (!format.write) return 0;
    const std::string written = format.write(m);
    const Morphology again = format.read(written, "written").morphology;
    const Morphology left = as_kept(m, format.keeps);
    if (again.sections().size() != left.sections().size() || format.write(again) != written) std::abort();
  } catch (const InputError& error) {
    if (error.file() != "input") std::abort();  // what we wrote must be read
  }
  return 0;
}
