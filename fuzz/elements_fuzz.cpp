// SPDX-License-Identifier: Apache-2.0
// A file of elements whose arrays have any lengths and numbers is an error with a sentence, or elements whose corners are there.
// The file itself is whole: what HDF5 makes of broken ones is the library's matter.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <span>
#include <unistd.h>
#include <vector>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/io/elements_file.h"
#include "forest/io/hdf5.h"

namespace {

// Takes arrays off the front of the input: a byte says how long, the rest are its numbers.
class Input {
 public:
  Input(const std::uint8_t* data, std::size_t size) : bytes_(data, size) {}

  template <class Number, class Of>
  std::vector<Number> numbers(Of&& of) {
    std::vector<Number> numbers(byte());
    for (Number& n : numbers) n = of(byte());
    return numbers;
  }
  std::uint8_t byte() {
    if (bytes_.empty()) return 0;
    const std::uint8_t first = bytes_.front();
    bytes_ = bytes_.subspan(1);
    return first;
  }

 private:
  std::span<const std::uint8_t> bytes_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace forest;
  const std::string path =
      fmt::format("{}/elements_fuzz_{}.h5", std::filesystem::temp_directory_path().string(), getpid());
  Input input(data, size);
  const auto real = [](std::uint8_t byte) { return byte == 255 ? NAN : byte == 254 ? 1e300 : 10. * byte; };
  const auto whole = [](std::uint8_t byte) { return byte > 250 ? 0u - byte : byte; };
  {
    io::hdf5::NewFile file(path);
    file.attribute("/", "magic", std::string("brainforest cortex"));
    file.attribute("/", "version", 1u);
    const auto put = [&]<class Number>(const char* name, const std::vector<Number>& numbers) {
      file.write(name, std::span<const Number>(numbers));
    };
    put("/elements/curves", input.numbers<std::uint32_t>(whole));
    put("/curves/places", input.numbers<double>(real));
    put("/corners/on_valley", input.numbers<std::uint8_t>([](std::uint8_t byte) { return byte; }));
    put("/lines/points", input.numbers<double>(real));
    put("/lines/starts", input.numbers<std::uint32_t>(whole));
    put("/lines/kind", input.numbers<std::uint8_t>([](std::uint8_t byte) { return byte; }));
    put("/lines/strength", input.numbers<double>(real));
    put("/facts", input.numbers<double>(real));
  }
  try {
    const io::ElementsFile read = io::read_elements(path);
    for (std::size_t e = 0; e < read.cortex.elements.size(); ++e) {
      for (const std::uint32_t corner : read.cortex.elements.corners_of(e))
        if (corner >= read.cortex.elements.corners) std::abort();
      if (!std::isfinite(read.cortex.elements.hexahedron(e).volume())) std::abort();
    }
  } catch (const InputError&) {
  }
  return 0;
}
