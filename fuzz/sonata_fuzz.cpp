// SPDX-License-Identifier: Apache-2.0
// Any configuration and table of types beside sound neurons are a circuit or an error with a sentence. The input is the
// configuration, a zero byte, and the table.
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <unistd.h>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/io/sonata.h"

#include "tests/sample_forest.h"

namespace {

struct Folder {
  std::filesystem::path path =
      std::filesystem::temp_directory_path() / ("forest-sonata-fuzz." + std::to_string(::getpid()));
  Folder() {
    forest::io::write_sonata(path, forest::testing::sample_circuit(4), forest::testing::sample_neurons());
  }
  ~Folder() { std::filesystem::remove_all(path); }
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace forest;
  static const Folder folder;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const std::size_t zero = text.find('\0');
  write_file(folder.path / "circuit_config.json", text.substr(0, zero));
  if (zero != text.npos) write_file(folder.path / "node_types.csv", text.substr(zero + 1));
  try {
    (void)io::read_sonata(folder.path);
  } catch (const InputError&) {
  }
  return 0;
}
