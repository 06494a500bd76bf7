// SPDX-License-Identifier: Apache-2.0
#include "forest/io/format.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/io/swc.h"

namespace forest::io {
namespace {

constexpr std::array<std::string_view, 2> swc_extensions{".swc", ".eswc"};

constexpr std::array table{
    Format{"swc", "SWC (INCF v1 and its dialects)", swc_extensions, read_swc, write_swc},
};

}  // namespace

std::span<const Format> formats() { return table; }

const Format* find_format(std::string_view name) {
  const auto row = std::ranges::find(table, name, &Format::name);
  return row == table.end() ? nullptr : &*row;
}

const Format& format_of(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = c >= 'A' && c <= 'Z' ? char(c - 'A' + 'a') : c;
  std::string known;
  for (const Format& format : table)
    for (const std::string_view candidate : format.extensions) {
      if (candidate == extension) return format;
      known += known.empty() ? "" : ", ";
      known += candidate;
    }
  throw InputError(
      path.string(), 0,
      fmt::format("the extension '{}' belongs to no known format; known are {}", extension, known));
}

ReadResult read(const std::filesystem::path& path) {
  const Format& format = format_of(path);
  const MappedFile file(path);
  return format.read(file.text(), path.string());
}

void write(const std::filesystem::path& path, const Morphology& m) {
  const Format& format = format_of(path);
  if (!format.write)
    throw InputError(path.string(), 0,
                     fmt::format("{} can be read but not written; choose another extension", format.title));
  write_file(path, format.write(m));
}

}  // namespace forest::io
