// SPDX-License-Identifier: Apache-2.0
// What files said otherwise than their formats, and how it was read: one by one, or as a table of the kinds.
#pragma once

#include <string>
#include <vector>

#include "forest/io/format.h"

namespace forest::cli {

class Console;

struct OddFile {
  std::string name;                          // as shown to people
  const std::vector<io::Warning>* oddities;  // of it
};

/// A warning each: file, line, word, what stands there and how it was read.
void tell_oddities(const OddFile& file, Console& console);

/// A line a kind: in how many files, how often, where first, how it was read, and what can be done. Nothing when there
/// are none.
void report_oddities(const std::vector<OddFile>& files, Console& console);

}  // namespace forest::cli
