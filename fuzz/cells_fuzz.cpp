// SPDX-License-Identifier: Apache-2.0
// Any bytes are refused with a sentence or are a file of cells; each of its cells is refused or a neuron that is written and
// read back. Checksums are put right first, so that what lies behind them is reached.
#include <cstdint>
#include <cstdlib>
#include <string>

#include "forest/core/error.h"
#include "forest/io/cells.h"
#include "forest/morphology/measure.h"
#include "forest/morphology/validate.h"

#include "tests/cells_sums.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace forest;
  std::string bytes(reinterpret_cast<const char*>(data), size);
  testing::put_cells_right(bytes);
  try {
    const io::CellsFile file(bytes, "input");
    for (std::size_t i = 0; i < file.size() && i < 200; ++i) {
      try {
        const io::Cell cell = file.read(i);
        if (cell.name != file.name(i) || !(total_length(cell.read.morphology) >= 0.)) std::abort();
        (void)validate(cell.read.morphology);
        const std::string written = io::write_cells(cell.read.morphology);
        if (io::write_cells(io::read_cells(written, "written").morphology) != written) std::abort();
      } catch (const InputError& error) {
        if (error.file() != "input") std::abort();  // what we wrote must be read
      }
    }
  } catch (const InputError&) {
  }
  return 0;
}
