// SPDX-License-Identifier: Apache-2.0
// Neurons that lie in files, one by one, however many a file holds.
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "forest/core/file.h"
#include "forest/io/format.h"

namespace forest::cli {

/// A file that is open while its cells are read.
struct OpenFile {
  MappedFile file;
  const io::Format& format;
  io::CellReader cells;

  explicit OpenFile(const std::filesystem::path& path);  // throws InputError
};

/// A file is one neuron, or as many as it holds (io/cells.h, HDF5, NeuroML, GENESIS); those of a file of cells are read when they are
/// asked for.
class FiledNeurons {
 public:
  explicit FiledNeurons(std::vector<std::filesystem::path> files);

  std::size_t size() const { return neurons_.size(); }
  const std::filesystem::path& file(std::size_t i) const { return files_[neurons_[i].first]; }
  std::vector<std::filesystem::path> each() const;  // the file of every neuron
  /// The cell's own name in a file of several; empty in others, and where it cannot be read.
  std::string cell(std::size_t i) const;
  Morphology read(std::size_t i) const;  // by any thread; throws InputError
  /// How many that were read hold something odd that only the tracing can mend (a place that is no number, a lost
  /// parent), in a sentence; nothing where there were none.
  std::string guesses() const;

 private:
  void remember(std::size_t i, const std::vector<io::Warning>& warnings) const;

  std::vector<std::filesystem::path> files_;
  std::vector<std::unique_ptr<MappedFile>> mapped_;           // of files of several cells
  std::vector<std::optional<io::CellReader>> cells_;          // the same
  std::vector<std::pair<std::size_t, std::size_t>> neurons_;  // file and cell
  mutable std::mutex mutex_;
  mutable std::map<std::size_t, std::string> guessed_;  // the first of each neuron
};

}  // namespace forest::cli
