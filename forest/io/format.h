// SPDX-License-Identifier: Apache-2.0
// The table of file formats for neurons. A format is one pair of files and one row here; command line,
// documentation and the shared hostile test (format_test.cpp) walk over the rows.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "forest/morphology/morphology.h"

namespace forest::io {

/// A deviation from a format that was read all the same, and how.
struct Warning {
  std::size_t line = 0;   // 1-based; 0 when the whole file is meant
  std::string_view code;  // a stable word, for example "negative-radius"
  std::string sentence;   // what stands there and how it was read
};

/// A kind of deviation: a format that reads dialects has a table of these.
struct Oddity {
  std::string_view code;
  bool every_line = true;    // each line is told (up to a limit, then counted), or only the first one
  std::string_view reading;  // how it is read, the second half of the sentence
};

struct ReadResult {
  Morphology morphology;
  std::vector<Warning> warnings;  // in the order of lines
};

struct Format {
  std::string_view name;                         // "swc"
  std::string_view title;                        // "SWC (INCF v1 and dialects)"
  std::span<const std::string_view> extensions;  // with the dot, lower case
  /// Throws InputError (file `name`, line, remedy) when nothing sensible can be read.
  ReadResult (*read)(std::string_view bytes, const std::string& name);
  /// The same neuron gives the same bytes. Null when the format is only read.
  std::string (*write)(const Morphology& morphology);
};

std::span<const Format> formats();
const Format* find_format(std::string_view name);  // null when unknown
const Format& format_of(
    const std::filesystem::path& path);  // by extension; throws InputError naming the known ones

ReadResult read(const std::filesystem::path& path);                  // throws InputError
void write(const std::filesystem::path& path, const Morphology& m);  // whole or not at all

}  // namespace forest::io
