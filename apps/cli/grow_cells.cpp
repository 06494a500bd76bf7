// SPDX-License-Identifier: Apache-2.0
// Rank r of R grows blocks s + r, s + r + R, … where s is the first that is missing. The first rank writes all of them: its
// own, and those the others give it, in their order. So any number of ranks writes the same file and goes on with what any
// other number left, and the disk need not be shared.
#include "apps/cli/grow_cells.h"

#include <algorithm>
#include <charconv>
#include <exception>
#include <optional>
#include <thread>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/hash.h"
#include "forest/core/parallel.h"
#include "forest/lsystem/derive.h"
#include "forest/lsystem/grow.h"
#include "forest/repository/names.h"

#include "apps/cli/console.h"
#include "apps/cli/ranks.h"

namespace forest::cli {
namespace {

namespace fs = std::filesystem;
using repository::escaped;

/// Growth failed, as it will again: another grammar is needed.
class GrowthError : public Error {
 public:
  using Error::Error;
};

io::CellsHead head_of(const lsystem::Grammar& grammar, const CellsJob& job) {
  return {.cells = job.count,
          .about = {{"program", "brainforest " FOREST_VERSION},
                    {"grammar", grammar.name},
                    {"grammar hash", hash_hex(std::as_bytes(std::span(grammar.text)))},
                    {"seed", std::to_string(job.seed)}}};
}

std::size_t cells_before(std::size_t block, const CellsJob& job) {
  return std::min(job.count, block * io::cells_per_block);
}

std::string grow_block(const lsystem::Grammar& grammar, const CellsJob& job, std::size_t block) {
  const std::size_t first = cells_before(block, job), end = cells_before(block + 1, job);
  lsystem::Deriver deriver(grammar);
  std::vector<io::NamedMorphology> cells;
  cells.reserve(end - first);
  for (std::size_t i = first; i < end; ++i)
    cells.push_back({grown_name(grammar, job.seed, i), lsystem::grow(deriver, grammar, job.seed, i)});
  return io::pack_block(first, cells);
}

/// A block on its way, or why there is none: then growing ends with it, whichever rank it is of.
struct Piece {
  std::string bytes;
  bool failed = false;

  const std::string& block() const {
    if (failed) throw GrowthError(bytes);
    return bytes;
  }
};

Piece make(const lsystem::Grammar& grammar, const CellsJob& job, std::size_t block) {
  try {
    return {grow_block(grammar, job, block)};
  } catch (const Error& error) {
    return {error.what(), true};
  }
}

/// The file is there already, whole and the same. Throws Error when something else is.
std::optional<CellsGrown> there_already(const lsystem::Grammar& grammar, const CellsJob& job,
                                        Progress& progress) {
  std::error_code none;
  if (job.force || !fs::exists(job.place, none)) return {};
  const MappedFile mapped(job.place);
  const io::CellsHead wanted = head_of(grammar, job);
  if (io::recognises_cells(mapped.text())) {
    const io::CellsFile file(mapped.text(), escaped(job.place.string()));
    const std::size_t blocks = wanted.blocks();
    if (file.head().cells == wanted.cells && file.head().about == wanted.about &&
        file.block(blocks - 1) == grow_block(grammar, job, blocks - 1)) {
      progress.begin("checking what is there", blocks);
      parallel_for(blocks, 16, [&](std::size_t b) {
        (void)file.block(b);
        progress.advance();
      });
      progress.end();
      return CellsGrown{grammar, file.total(), job.count, mapped.text().size()};
    }
  }
  throw Error(
      fmt::format("{} is there and holds something else, so nothing was written; choose another place, or "
                  "replace with --force",
                  escaped(job.place.string())));
}

/// The last block that is there must be one that this program grows, not only one of the same name.
void check_last_block(io::CellsWriter& file, const lsystem::Grammar& grammar, const CellsJob& job) {
  if (file.blocks() == 0 || file.last_block() == grow_block(grammar, job, file.blocks() - 1)) return;
  if (!job.force)
    throw Error(fmt::format(
        "{}: holds other cells than this program grows, though of the same grammar and seed; end it "
        "by the program that began it, choose another place, or begin anew with --force",
        escaped(file.path().string())));
  file.restart();
}

void grow_blocks(io::CellsWriter* file, const lsystem::Grammar& grammar, const CellsJob& job,
                 std::size_t start, Ranks& ranks, Progress& progress) {
  const std::size_t blocks = head_of(grammar, job).blocks(), own = std::size_t(ranks.own()),
                    all = std::size_t(ranks.count());
  const std::size_t mine = blocks > start + own ? (blocks - start - own + all - 1) / all : 0;
  const auto write = [&](std::size_t block, const Piece& piece) {
    file->add(piece.block());
    progress.advance(cells_before(block + 1, job) - cells_before(block, job));
  };
  const std::size_t ahead = std::max(4u, 2 * std::thread::hardware_concurrency());
  parallel_in_order(
      mine, [&](std::size_t i) { return make(grammar, job, start + own + i * all); },
      [&](std::size_t i, Piece&& piece) {
        if (!ranks.first()) {
          ranks.give((piece.failed ? '!' : ' ') + piece.bytes);
          return;
        }
        const std::size_t block = start + i * all;
        write(block, piece);
        for (std::size_t r = 1; r < all && block + r < blocks; ++r) {
          std::string taken = ranks.take(int(r));
          const bool failed = taken.at(0) == '!';
          write(block + r, {taken.substr(1), failed});
        }
      },
      ahead);
}

/// What the first rank does and knows.
CellsGrown lead(const std::function<lsystem::Grammar()>& find, const CellsJob& job, Ranks& ranks,
                Console& console) {
  const lsystem::Grammar grammar = find();
  std::optional<io::CellsWriter> file;
  const auto done = there_already(grammar, job, console.progress());
  if (!done) {
    file.emplace(job.place, head_of(grammar, job), job.force, console.progress());
    check_last_block(*file, grammar, job);
  }
  const std::size_t start = file ? file->blocks() : head_of(grammar, job).blocks();
  for (std::string word : {grammar.text, grammar.file, grammar.name, std::to_string(start)})
    ranks.share(word);
  if (done) return *done;

  CellsGrown grown{grammar, {}, cells_before(start, job), 0};
  console.progress().begin("growing", job.count);
  console.progress().advance(grown.there);
  try {
    grow_blocks(&*file, grammar, job, start, ranks, console.progress());
  } catch (const GrowthError&) {
    file->discard();
    throw;
  }
  console.progress().end();
  file->finish();
  grown.total = file->total();
  grown.bytes = fs::file_size(job.place);
  return grown;
}

/// What the others do: they need neither the grammar's file nor the disk.
CellsGrown follow(const CellsJob& job, Ranks& ranks) {
  std::string text, file, name, start;
  for (std::string* word : {&text, &file, &name, &start}) ranks.share(*word);
  lsystem::Grammar grammar = lsystem::parse(text, file);
  grammar.name = name;
  std::size_t first = 0;
  std::from_chars(start.data(), start.data() + start.size(), first);
  grow_blocks(nullptr, grammar, job, first, ranks, Progress::none());
  return {std::move(grammar), {}, 0, 0};
}

}  // namespace

std::string grown_name(const lsystem::Grammar& grammar, std::uint64_t seed, std::size_t index) {
  return fmt::format("{}-{}-{:05}", grammar.name, seed, index);
}

CellsGrown grow_cells(const std::function<lsystem::Grammar()>& grammar, const CellsJob& job, Ranks& ranks,
                      Console& console) {
  try {
    return ranks.first() ? lead(grammar, job, ranks, console) : follow(job, ranks);
  } catch (const std::exception& error) {
    if (ranks.count() == 1) throw;
    console.warn(fmt::format("brainforest: {}", error.what()));
    ranks.end_all();
    throw;
  }
}

}  // namespace forest::cli
