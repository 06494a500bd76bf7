// SPDX-License-Identifier: Apache-2.0
#include "apps/cli/files.h"

#include <algorithm>
#include <cctype>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/io/format.h"
#include "forest/repository/names.h"

#include "apps/cli/console.h"

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

std::vector<fs::path> neuron_files(const std::vector<std::string>& names, Console& console) {
  std::vector<fs::path> files;
  std::size_t skipped = 0;
  std::error_code none;
  for (const std::string& name : names) {
    if (!fs::is_directory(name, none)) {
      files.emplace_back(name);
      continue;
    }
    const auto first = std::ptrdiff_t(files.size());
    for (const auto& entry : fs::recursive_directory_iterator(name)) {
      if (entry.is_directory(none)) continue;
      if (known(entry.path()))
        files.push_back(entry.path());
      else
        ++skipped;
    }
    if (first == std::ptrdiff_t(files.size()))
      throw InputError(name, 0, "holds no file of a known format; name the files themselves");
    std::sort(files.begin() + first, files.end());
  }
  if (skipped)
    console.warn(
        fmt::format("{} of other formats {} skipped", counted(skipped, "file"), skipped == 1 ? "is" : "are"));
  return files;
}

void Overwrites::look(const fs::path& to, std::string_view bytes) {
  std::error_code none;
  if (!fs::is_regular_file(to, none)) return;
  bool same = false;
  try {
    same = MappedFile(to).text() == bytes;
  } catch (const InputError&) {  // what cannot be read is not known to be the same
  }
  if (same) return;
  const std::lock_guard lock(mutex_);
  found_.insert(to);
}

void Overwrites::refuse() const {
  if (found_.empty()) return;
  const std::size_t more = found_.size() - 1;
  throw Error(
      fmt::format("{} is there and holds something else{}, so nothing was written; choose another place, or "
                  "replace with --force",
                  repository::escaped(found_.begin()->string()),
                  more ? fmt::format(", as do {}", counted(more, "more file")) : ""));
}

bool holds_files(const fs::path& folder) {
  std::error_code none;
  return fs::is_directory(folder, none) && !fs::is_empty(folder, none);
}

}  // namespace forest::cli
