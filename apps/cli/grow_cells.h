// SPDX-License-Identifier: Apache-2.0
// Neurons grown into one file of cells (io/cells.h): as many as one likes in little memory, gone on with after the program
// was killed, by one program or by all that mpirun started (ranks.h). The bytes are the same in every case.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>

#include "forest/io/cells.h"
#include "forest/lsystem/grammar.h"

namespace forest::cli {

class Console;
class Ranks;

struct CellsJob {
  std::filesystem::path place;
  std::size_t count = 1;
  std::uint64_t seed = 0;
  bool force = false;  // to replace what lies there and is something else
};

struct CellsGrown {
  lsystem::Grammar grammar;
  io::CellsTotal total;
  std::size_t there = 0;    // cells that were there before
  std::uint64_t bytes = 0;  // of the file
};

/// The name of grown neuron number `index`.
std::string grown_name(const lsystem::Grammar& grammar, std::uint64_t seed, std::size_t index);

/// @param grammar  reads it; asked of the first rank alone
/// Throws Error when something else lies there, the grammar fails or the disk is full. Where there are other ranks it does not
/// return then: the first one says why and ends them all. What it returns is right in the first rank.
CellsGrown grow_cells(const std::function<lsystem::Grammar()>& grammar, const CellsJob& job, Ranks& ranks,
                      Console& console);

}  // namespace forest::cli
