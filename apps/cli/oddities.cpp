// SPDX-License-Identifier: Apache-2.0
#include "apps/cli/oddities.h"

#include <map>
#include <utility>

#include <fmt/format.h>

#include "forest/repository/names.h"

#include "apps/cli/console.h"

namespace forest::cli {
namespace {

std::string place_of(const OddFile& file, const io::Warning& w) {
  return file.name + (w.line ? fmt::format(":{}", w.line) : "");
}

}  // namespace

void tell_oddities(const OddFile& file, Console& console) {
  for (const io::Warning& w : *file.oddities)
    console.warn(fmt::format("{}: {}: {}", place_of(file, w), w.code, repository::escaped(w.sentence)));
}

void report_oddities(const std::vector<OddFile>& files, Console& console) {
  struct Kind {
    std::size_t files = 0, times = 0;
    std::string place, sentence, mending;
    const OddFile* last = nullptr;
  };
  std::map<std::string_view, Kind> kinds;
  for (const OddFile& file : files)
    for (const io::Warning& w : *file.oddities) {
      Kind& kind = kinds[w.code];
      if (kind.times == 0) {
        kind.place = place_of(file, w);
        kind.sentence = repository::escaped(w.sentence);
        kind.mending = w.mending.empty() ? "brainforest check --repair writes it so" : w.mending;
      }
      kind.times += w.times;
      kind.files += std::exchange(kind.last, &file) != &file;
    }
  if (kinds.empty()) return;
  std::vector<std::vector<std::string>> lines;
  for (const auto& [code, kind] : kinds)
    lines.push_back({std::string(code), std::to_string(kind.files), std::to_string(kind.times), kind.place,
                     kind.sentence, kind.mending});
  console.table({"what was odd", "files", "times", "first at", "and how it was read", "what you can do"},
                lines);
}

}  // namespace forest::cli
