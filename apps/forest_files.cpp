// SPDX-License-Identifier: Apache-2.0
#include "apps/forest_files.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/lower.h"
#include "forest/io/format.h"
#include "forest/scene/gallery.h"

namespace forest {
namespace {

constexpr std::size_t most = 100;

struct Cells {
  std::vector<Morphology> neurons;
  std::vector<std::string> names;

  void add(const std::filesystem::path& file) {
    const MappedFile bytes(file);
    const io::CellReader cells =
        io::read_each(io::format_of(file, bytes.text()), bytes.text(), file.string());
    if (neurons.size() + cells.count > most)
      throw InputError(file.string(), 0,
                       fmt::format("makes {} neurons, and at most {} are shown side by side; plant them by a "
                                   "recipe and give the forest of 'brainforest pack'",
                                   neurons.size() + cells.count, most));
    for (std::size_t i = 0; i < cells.count; ++i) {
      io::Cell cell = cells.read(i);
      const std::string name = cell.name.empty() ? file.stem().string() : cell.name;
      std::string own = name;
      for (std::size_t k = 2; std::ranges::find(names, own) != names.end(); ++k)
        own = fmt::format("{} ({})", name, k);
      names.push_back(std::move(own)), neurons.push_back(std::move(cell.read.morphology));
    }
  }
};

// Those that lie in it, by name.
std::vector<std::filesystem::path> cells_in(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    if (entry.is_regular_file() && holds_cells(entry.path())) files.push_back(entry.path());
  std::ranges::sort(files);
  if (files.empty())
    throw InputError(folder.string(), 0, "holds no file of neurons; give one that does, or a forest file");
  return files;
}

}  // namespace

bool holds_cells(const std::filesystem::path& file) {
  const std::string ending = lower(file.extension().string());
  return std::ranges::any_of(io::formats(), [&](const io::Format& format) {
    return format.read && std::ranges::find(format.extensions, ending) != format.extensions.end();
  });
}

bool are_cells(std::span<const std::filesystem::path> files) {
  std::error_code none;
  if (files.size() == 1 && std::filesystem::exists(files.front() / "circuit_config.json", none))
    return false;  // a circuit, which Forest::open knows what to say of
  return files.size() > 1 || std::filesystem::is_directory(files.front(), none) || holds_cells(files.front());
}

scene::Forest open_forest(std::span<const std::filesystem::path> files, float aspect) {
  if (!are_cells(files)) return scene::Forest::open(files.front());
  Cells cells;
  std::error_code none;
  for (const std::filesystem::path& file : files)
    if (std::filesystem::is_directory(file, none))
      for (const std::filesystem::path& one : cells_in(file)) cells.add(one);
    else if (holds_cells(file) || !std::filesystem::exists(file, none))
      cells.add(file);
    else
      throw InputError(file.string(), 0, "is no file of neurons; only such are shown beside one another");
  return scene::gallery(cells.neurons, std::move(cells.names), aspect);
}

scene::Forest open_forest(const std::filesystem::path& file) { return open_forest(std::span(&file, 1)); }

}  // namespace forest
