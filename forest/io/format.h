// SPDX-License-Identifier: Apache-2.0
// The table of file formats for neurons. A format is one pair of files and one row here; command line,
// documentation and the shared hostile test (format_test.cpp) walk over the rows.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "forest/core/error.h"
#include "forest/io/keeps.h"
#include "forest/morphology/morphology.h"

namespace forest::io {

/// A file that may be sound but holds no neuron (a circuit in HDF5, channels in NeuroML). Named by a person it is refused
/// like any other; found in a folder it is skipped and told.
class NotANeuron : public InputError {
 public:
  using InputError::InputError;
};

/// A kind of deviation: a format that reads dialects has a table of these.
struct Oddity {
  std::string_view code;
  bool every_line = true;         // each line is told (up to a limit, then counted), or only the first one
  std::string_view reading;       // how it is read, the second half of the sentence
  std::string_view mending = {};  // what a person can do, where writing the file anew does not mend it
  bool lost = false;              // something that is said of the cell is not kept
};

struct ReadResult {
  Morphology morphology;
  std::vector<Warning> warnings;  // in the order of lines
};

/// A neuron of a file that holds several.
struct Cell {
  std::string name;  // as the file has it
  ReadResult read;
};

/// The cells of a file, one at a time: those of a format that holds millions are read when they are asked for.
struct CellReader {
  std::size_t count = 0;
  std::function<Cell(std::size_t)> read;         // by any thread; throws InputError
  std::function<std::string(std::size_t)> name;  // of a cell, without reading the rest; as read
};

/// A neuron on its way into a file that holds several.
struct NamedMorphology {
  std::string name;
  Morphology morphology;
};

struct Format {
  std::string_view name;                         // "swc"
  std::string_view title;                        // "SWC (INCF v1 and its dialects)"
  std::span<const std::string_view> extensions;  // with the dot, lower case; the first one is written
  /// Whether these bytes look like this format. Asked where formats share an extension, or none has it. Null when the
  /// format is only written.
  bool (*recognises)(std::string_view bytes);
  /// Throws InputError (file `name`, line, remedy) when nothing sensible can be read. Of a file with several cells the
  /// first, with a warning. Null when the format is only written.
  ReadResult (*read)(std::string_view bytes, const std::string& name);
  /// All cells of a file; null when a file of this format holds one.
  std::vector<Cell> (*read_all)(std::string_view bytes, const std::string& name);
  /// The same, for files of so many cells that they do not fit into memory; null where all are read at once.
  CellReader (*read_each)(std::string_view bytes, const std::string& name) = nullptr;
  /// The same neuron gives the same bytes. Null when the format is only read.
  std::string (*write)(const Morphology& morphology);
  /// Cells of different names in one file, under them; throws Error when a name will not do. Null where files hold one.
  std::string (*write_all)(std::span<const NamedMorphology> cells) = nullptr;
  Keeps keeps;
};

std::span<const Format> formats();
const Format* find_format(std::string_view name);  // null when unknown

/// By extension, for writing; throws InputError naming the known ones, and with them those `others` that the caller knows.
const Format& format_of(const std::filesystem::path& path, std::span<const std::string_view> others = {});
/// For reading: by extension and, where that does not decide, by content; throws InputError.
const Format& format_of(const std::filesystem::path& path, std::string_view bytes);

ReadResult read(const std::filesystem::path& path);  // throws InputError
/// Never empty; the only cell of a file has no name. Throws InputError; where the bytes are those of another kind of file (an
/// archive, a web page, another format of neurons) its sentence says so.
std::vector<Cell> read_all(const Format& format, std::string_view bytes, const std::string& name);

/// As read_all. The bytes must outlive it.
CellReader read_each(const Format& format, std::string_view bytes, const std::string& name);

/// Whole or not at all. Returns what was lost.
std::vector<Warning> write(const std::filesystem::path& path, const Morphology& m);

}  // namespace forest::io
