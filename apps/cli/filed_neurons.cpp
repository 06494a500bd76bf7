// SPDX-License-Identifier: Apache-2.0
#include "apps/cli/filed_neurons.h"

#include <algorithm>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/repository/names.h"

#include "apps/cli/console.h"
#include "apps/cli/files.h"

namespace forest::cli {

FiledNeurons::FiledNeurons(std::vector<std::filesystem::path> files)
    : files_(std::move(files)), mapped_(files_.size()), cells_(files_.size()) {
  for (std::size_t f = 0; f < files_.size(); ++f) {
    if (is_cells_file(files_[f])) try {
        mapped_[f] = std::make_unique<MappedFile>(files_[f]);
        const std::string_view text = mapped_[f]->text();
        cells_[f] =
            io::read_each(io::format_of(files_[f], text), text, repository::escaped(files_[f].string()));
      } catch (const InputError&) {  // told when it is read
      }
    for (std::size_t c = 0, count = cells_[f] ? cells_[f]->count : 1; c < count; ++c)
      neurons_.emplace_back(f, c);
  }
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
      "{} of {} hold something odd that only the tracing can mend, first {}; 'brainforest check' tells all",
      guessed_.size(), counted(size(), "neuron"), repository::escaped(guessed_.begin()->second));
}

}  // namespace forest::cli
