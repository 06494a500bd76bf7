// SPDX-License-Identifier: Apache-2.0
#include "apps/cli/filed_neurons.h"

#include <algorithm>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/parallel.h"
#include "forest/repository/names.h"

#include "apps/cli/console.h"
#include "apps/cli/files.h"

namespace forest::cli {

OpenFile::OpenFile(const std::filesystem::path& path)
    : file(path),
      format(io::format_of(path, file.text())),
      cells(io::read_each(format, file.text(), repository::escaped(path.string()))) {}

FiledNeurons::FiledNeurons(std::vector<std::filesystem::path> files)
    : files_(std::move(files)), mapped_(files_.size()), cells_(files_.size()) {
  parallel_for(files_.size(), 1, [&](std::size_t f) {
    try {
      auto mapped = std::make_unique<MappedFile>(files_[f]);
      const io::Format& format = io::format_of(files_[f], mapped->text());
      if (!format.read_all) return;
      io::CellReader cells = io::read_each(format, mapped->text(), repository::escaped(files_[f].string()));
      // Where there is one cell it is read when its turn comes, as of a format that holds one.
      if (cells.count != 1 || format.read_each) mapped_[f] = std::move(mapped), cells_[f] = std::move(cells);
    } catch (const Error&) {  // told when it is read
    }
  });
  for (std::size_t f = 0; f < files_.size(); ++f)
    for (std::size_t c = 0, count = cells_[f] ? cells_[f]->count : 1; c < count; ++c)
      neurons_.emplace_back(f, c);
}

std::vector<std::filesystem::path> FiledNeurons::each() const {
  std::vector<std::filesystem::path> result;
  for (const auto& [f, c] : neurons_) result.push_back(files_[f]);
  return result;
}

std::string FiledNeurons::cell(std::size_t i) const {
  const auto [f, c] = neurons_[i];
  try {
    return cells_[f] ? cells_[f]->name(c) : "";
  } catch (const InputError&) {  // so is this
    return "";
  }
}

Morphology FiledNeurons::read(std::size_t i) const {
  const auto [f, c] = neurons_[i];
  io::ReadResult read = cells_[f] ? cells_[f]->read(c).read : io::read(files_[f]);
  remember(i, read.warnings);
  return std::move(read.morphology);
}

void FiledNeurons::remember(std::size_t i, const std::vector<io::Warning>& warnings) const {
  // What has a mending of its own no program can mend.
  const auto guess =
      std::ranges::find_if(warnings, [](const io::Warning& w) { return !w.mending.empty() && !w.lost; });
  if (guess == warnings.end()) return;
  const std::lock_guard lock(mutex_);
  guessed_[i] = guess->line ? fmt::format("{}:{}: {}", file(i).string(), guess->line, guess->sentence)
                            : fmt::format("{}: {}", file(i).string(), guess->sentence);
}

std::string FiledNeurons::guesses() const {
  if (guessed_.empty()) return {};
  return fmt::format(
      "{} of {} {} something odd that only the tracing can mend, first {}; 'brainforest check' tells all",
      guessed_.size(), counted(size(), "neuron"), guessed_.size() == 1 ? "holds" : "hold",
      repository::escaped(guessed_.begin()->second));
}

}  // namespace forest::cli
