// SPDX-License-Identifier: Apache-2.0
#include "apps/cli/files.h"

#include <algorithm>
#include <cctype>

#include "forest/core/error.h"
#include "forest/io/format.h"

namespace forest::cli {
namespace fs = std::filesystem;
namespace {

bool known(const fs::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = char(std::tolower(static_cast<unsigned char>(c)));
  return std::ranges::any_of(io::formats(), [&](const io::Format& f) {
    return f.read && std::ranges::find(f.extensions, extension) != f.extensions.end();
  });
}

}  // namespace

std::vector<fs::path> neuron_files(const std::vector<std::string>& names) {
  std::vector<fs::path> files;
  for (const std::string& name : names) {
    if (!fs::is_directory(name)) {
      files.emplace_back(name);
      continue;
    }
    const auto first = std::ptrdiff_t(files.size());
    for (const auto& entry : fs::recursive_directory_iterator(name))
      if (known(entry.path()) && !entry.is_directory()) files.push_back(entry.path());
    if (first == std::ptrdiff_t(files.size()))
      throw InputError(name, 0, "holds no file of a known format; name the files themselves");
    std::sort(files.begin() + first, files.end());
  }
  return files;
}

}  // namespace forest::cli
