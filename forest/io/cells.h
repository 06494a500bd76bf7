// SPDX-License-Identifier: Apache-2.0
// Cells by the million in one file of our own, which is written as they come and read at any place:
//
//   head     how many cells, how many in a block, what is said of all of them (keys and values)
//   blocks   64 cells each: sizes, then names, somata, sections, packed points (morphology/packing.h), spines, annotations
//   index    where each block begins
//   foot     where the index begins
//
// Each of the four has a checksum. The bytes follow from the cells alone, so a file that was cut off goes on behind its last
// whole block. docs/formats/cells.md has every byte. HDF5 (h5.h) was looked at first: such a container is not whole
// until it is closed, is written by one thread at a time, and its groups cost 2.6 kB a cell.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "forest/core/file.h"
#include "forest/core/progress.h"
#include "forest/io/format.h"

namespace forest::io {

inline constexpr std::size_t cells_per_block = 64;

/// What a file says before its first cell. Two of the same head are to hold the same cells.
struct CellsHead {
  std::uint64_t cells = 0;  // that are in it when it is whole
  Annotations about;        // of all: grammar, seed, …
  std::size_t blocks() const { return std::size_t(cells / cells_per_block + (cells % cells_per_block != 0)); }
};

/// Sums over the cells of a block or a file.
struct CellsTotal {
  std::uint64_t segments = 0;
  double length = 0.;  // µm
};

/// The cells from number `first` on, of which there are cells_per_block but in the last block of a file. A pure function, so
/// blocks may be made by any thread or machine.
std::string pack_block(std::uint64_t first, std::span<const NamedMorphology> cells);

/// A file of cells in memory. Cells are read one by one when they are asked for; a block's checksum is looked at when the
/// first of its cells is read. Every function throws InputError (file, sentence) where the bytes are damaged.
class CellsFile {
 public:
  /// The bytes must outlive it.
  CellsFile(std::string_view bytes, const std::string& name);

  std::size_t size() const { return std::size_t(head_.cells); }
  const CellsHead& head() const { return head_; }
  std::string_view block(std::size_t number) const;  // its bytes, as pack_block made them
  const CellsTotal& total() const { return total_; }
  Cell read(std::size_t number) const;         // by any thread
  std::string name(std::size_t number) const;  // without reading the rest

 private:
  template <class Read>
  auto at(std::size_t number, const Read& read) const;
  [[noreturn]] void refuse(const std::string& sentence) const;

  std::string_view bytes_;
  std::string name_;
  CellsHead head_;
  CellsTotal total_;
  std::vector<std::uint64_t> begins_;               // of the blocks, and of the index
  std::unique_ptr<std::atomic<bool>[]> looked_at_;  // whose checksum is right
};

/// A file of cells on its way. It lies beside its place, with .part behind its name, until it is whole; a program that was
/// killed leaves it there, and who asks for the same head goes on behind its last whole block.
class CellsWriter {
 public:
  /// @param replace  what has another head and lies there
  /// Throws Error when it is not to be replaced, or when another program is writing there.
  CellsWriter(const std::filesystem::path& place, const CellsHead& head, bool replace = false,
              Progress& progress = Progress::none());

  const std::filesystem::path& path() const { return part_.path(); }
  std::size_t blocks() const { return begins_.size(); }  // that are in it
  std::string last_block() const;                        // empty: none
  CellsTotal total() const { return total_; }

  void add(std::string_view block);    // the next one, as pack_block made it
  void restart();                      // from no block
  void discard() { part_.discard(); }  // what cannot be ended is taken away
  /// Ends the file, which gets its name. All blocks must be in it.
  void finish();

 private:
  void append(std::string_view bytes);

  std::string head_bytes_;
  std::size_t all_ = 0;  // blocks
  PartFile part_;
  std::vector<std::uint64_t> begins_;
  std::uint64_t end_ = 0;
  CellsTotal total_;
};

// As the table of formats has it (format.h).
bool recognises_cells(std::string_view bytes);
ReadResult read_cells(std::string_view bytes, const std::string& name);  // the first one
std::vector<Cell> read_all_cells(std::string_view bytes, const std::string& name);
CellReader read_each_cells(std::string_view bytes, const std::string& name);
std::string write_cells(const Morphology& morphology);

/// A whole file in memory.
std::string write_cells(std::span<const NamedMorphology> cells, const Annotations& about = {});

}  // namespace forest::io
