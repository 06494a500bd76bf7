// SPDX-License-Identifier: Apache-2.0
#include "forest/io/format.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/lower.h"
#include "forest/io/acc.h"
#include "forest/io/asc.h"
#include "forest/io/cells.h"
#include "forest/io/genesis.h"
#include "forest/io/h5.h"
#include "forest/io/neuroml.h"
#include "forest/io/neuron.h"
#include "forest/io/nmf.h"
#include "forest/io/nts.h"
#include "forest/io/swc.h"

namespace forest::io {
namespace {

constexpr std::array<std::string_view, 1> swc_extensions{".swc"};
constexpr std::array<std::string_view, 1> eswc_extensions{".eswc"};
constexpr std::array<std::string_view, 2> h5_extensions{".h5", ".hdf5"};
constexpr std::array<std::string_view, 1> cells_extensions{".cells"};
constexpr std::array<std::string_view, 2> neuroml_extensions{".nml", ".xml"};

constexpr std::array<std::string_view, 1> hoc_extensions{".hoc"};
constexpr std::array<std::string_view, 1> python_extensions{".py"};

constexpr std::array<std::string_view, 1> genesis_extensions{".p"};
constexpr std::array<std::string_view, 1> acc_extensions{".acc"};

constexpr std::array<std::string_view, 1> asc_extensions{".asc"};
constexpr std::array<std::string_view, 1> nts_extensions{".nts"};
constexpr std::array<std::string_view, 1> nmf_extensions{".xml"};

constexpr std::array table{
    Format{.name = "swc",
           .title = "SWC (INCF v1 and its dialects)",
           .extensions = swc_extensions,
           .recognises = recognises_swc,
           .read = read_swc,
           .read_all = nullptr,
           .write = write_swc,
           .keeps = swc_keeps},
    Format{.name = "eswc",
           .title = "eSWC (Vaa3D)",
           .extensions = eswc_extensions,
           .recognises = recognises_swc,
           .read = read_swc,
           .read_all = nullptr,
           .write = write_eswc,
           .keeps = swc_keeps},
    Format{.name = "hoc",
           .title = "NEURON cell template (hoc)",
           .extensions = hoc_extensions,
           .recognises = nullptr,
           .read = nullptr,
           .read_all = nullptr,
           .write = write_neuron_hoc,
           .keeps = neuron_keeps},
    Format{.name = "neuron-python",
           .title = "NEURON cell class (Python)",
           .extensions = python_extensions,
           .recognises = nullptr,
           .read = nullptr,
           .read_all = nullptr,
           .write = write_neuron_python,
           .keeps = neuron_keeps},
    Format{.name = "genesis",
           .title = "GENESIS cell parameters (readcell)",
           .extensions = genesis_extensions,
           .recognises = recognises_genesis,
           .read = read_genesis,
           .read_all = read_genesis_cells,
           .write = write_genesis,
           .keeps = genesis_keeps},
    Format{.name = "acc",
           .title = "Arbor component (ACC)",
           .extensions = acc_extensions,
           .recognises = nullptr,
           .read = nullptr,
           .read_all = nullptr,
           .write = write_acc,
           .keeps = acc_keeps},
    Format{.name = "h5",
           .title = "HDF5 morphology (MorphIO 1.0 to 1.3, containers)",
           .extensions = h5_extensions,
           .recognises = recognises_h5,
           .read = read_h5,
           .read_all = read_all_h5,
           .write = write_h5,
           .write_all = write_h5,
           .keeps = {}},
    Format{.name = "cells",
           .title = "Brain Forest cells (millions of them)",
           .extensions = cells_extensions,
           .recognises = recognises_cells,
           .read = read_cells,
           .read_all = read_all_cells,
           .read_each = read_each_cells,
           .write = write_cells,
           .write_all = [](std::span<const NamedMorphology> cells) { return write_cells(cells); },
           .keeps = {}},
    Format{.name = "neuroml",
           .title = "NeuroML 2",
           .extensions = neuroml_extensions,
           .recognises = recognises_neuroml,
           .read = read_neuroml,
           .read_all = read_all_neuroml,
           .write = write_neuroml,
           .keeps = neuroml_keeps},
    Format{.name = "asc",
           .title = "Neurolucida ASC",
           .extensions = asc_extensions,
           .recognises = recognises_asc,
           .read = read_asc,
           .read_all = nullptr,
           .write = write_asc,
           .keeps = asc_keeps},
    Format{.name = "nts",
           .title = "Eutectic NTS",
           .extensions = nts_extensions,
           .recognises = recognises_nts,
           .read = read_nts,
           .read_all = nullptr,
           .write = write_nts,
           .keeps = nts_keeps},
    Format{.name = "nmf",
           .title = "Neurolucida XML (NMF 4)",
           .extensions = nmf_extensions,
           .recognises = recognises_nmf,
           .read = read_nmf,
           .read_all = nullptr,
           .write = nullptr,
           .keeps = {}},
};

std::string lower_extension(const std::filesystem::path& path) { return lower(path.extension().string()); }

bool has(const Format& format, std::string_view extension) {
  return std::ranges::find(format.extensions, extension) != format.extensions.end();
}

[[noreturn]] void refuse_extension(const std::filesystem::path& path, bool written,
                                   std::span<const std::string_view> others = {}) {
  std::string known;
  for (const Format& format : table)
    if (written ? format.write != nullptr : format.read != nullptr)
      for (const std::string_view extension : format.extensions)
        if (known.find(std::string(extension) + ",") == known.npos) known += std::string(extension) + ", ";
  for (const std::string_view other : others) known += std::string(other) + ", ";
  known.resize(known.size() - 2);
  throw InputError(path.string(), 0,
                   fmt::format("the extension '{}' belongs to no known format; known are {}",
                               lower_extension(path), known));
}

const Format* recognised_format(std::string_view bytes) {
  const auto row =
      std::ranges::find_if(table, [&](const Format& f) { return f.read && f.recognises(bytes); });
  return row == table.end() ? nullptr : &*row;
}

// How files begin that come under the name of a neuron's.
struct Beginning {
  std::string_view bytes;  // of letters the small ones
  std::string_view sentence;
};
constexpr std::string_view packed = "is packed; unpack it and give what was in it",
                           web_page = "is a web page, as a failed download leaves; fetch the file again",
                           picture = "is a picture or a document; give the file of the tracing";
constexpr std::array beginnings{
    Beginning{"\x1f\x8b", packed},
    Beginning{"pk\x03\x04", packed},
    Beginning{"\xfd"
              "7zxz",
              packed},
    Beginning{"bzh", packed},
    Beginning{"\x28\xb5\x2f\xfd", packed},
    Beginning{"7z\xbc\xaf", packed},
    Beginning{"<!doctype html", web_page},
    Beginning{"<html", web_page},
    Beginning{"\x89png", picture},
    Beginning{"\xff\xd8\xff", picture},
    Beginning{"ii*", picture},
    Beginning{"%pdf", picture},
};
constexpr std::string_view apple_double("\x00\x05\x16\x07", 4);

/// Throws when the bytes are those of no neuron file at all.
void refuse_other_kinds(std::string_view bytes, const std::string& name) {
  if (bytes.empty()) throw InputError(name, 0, "is empty; copy or export it again");
  if (bytes.starts_with(apple_double))
    throw NotANeuron(name, 0, "holds what macOS notes beside a file, not the file; remove it");
  for (const Beginning& row : beginnings)
    if (lower(bytes.substr(0, row.bytes.size())) == row.bytes)
      throw InputError(name, 0, std::string(row.sentence));
}

/// Reads by `read`; a refusal says what else the file looks like.
template <class Read>
auto guarded(const Format& format, std::string_view bytes, const std::string& name, const Read& read) {
  refuse_other_kinds(bytes, name);
  try {
    return read();
  } catch (const NotANeuron&) {
    throw;
  } catch (const InputError& error) {
    const Format* const other = format.recognises(bytes) ? nullptr : recognised_format(bytes);
    if (!other) throw;
    throw InputError(error.file(), error.line(),
                     fmt::format("{} (the file looks like {}; if it is, name it {})", error.sentence(),
                                 other->title, other->extensions[0]));
  }
}

}  // namespace

std::span<const Format> formats() { return table; }

const Format* find_format(std::string_view name) {
  const auto row = std::ranges::find(table, name, &Format::name);
  return row == table.end() ? nullptr : &*row;
}

const Format& format_of(const std::filesystem::path& path, std::span<const std::string_view> others) {
  const std::string extension = lower_extension(path);
  const Format* only_read = nullptr;
  for (const Format& format : table)
    if (has(format, extension)) {
      if (format.write) return format;
      only_read = &format;
    }
  if (only_read) return *only_read;
  refuse_extension(path, true, others);
}

const Format& format_of(const std::filesystem::path& path, std::string_view bytes) {
  const std::string extension = lower_extension(path);
  std::vector<const Format*> own;
  for (const Format& format : table)
    if (format.read && has(format, extension)) own.push_back(&format);
  if (own.size() > 1)
    for (const Format* format : own)
      if (format->recognises(bytes)) return *format;
  if (!own.empty()) return *own[0];  // it says what is wrong with other bytes
  if (const Format* format = recognised_format(bytes)) return *format;
  for (const Format& format : table)
    if (has(format, extension))
      throw InputError(
          path.string(), 0,
          fmt::format("{} can be written but not read; give the file it was made from", format.title));
  refuse_extension(path, false);
}

ReadResult read(const std::filesystem::path& path) {
  const MappedFile file(path);
  const Format& format = format_of(path, file.text());
  return guarded(format, file.text(), path.string(), [&] { return format.read(file.text(), path.string()); });
}

std::vector<Cell> read_all(const Format& format, std::string_view bytes, const std::string& name) {
  return guarded(format, bytes, name, [&] {
    if (format.read_all) return format.read_all(bytes, name);
    std::vector<Cell> one;
    one.push_back({{}, format.read(bytes, name)});
    return one;
  });
}

CellReader read_each(const Format& format, std::string_view bytes, const std::string& name) {
  if (format.read_each) return guarded(format, bytes, name, [&] { return format.read_each(bytes, name); });
  const auto cells = std::make_shared<std::vector<Cell>>(read_all(format, bytes, name));
  return {cells->size(), [cells](std::size_t i) { return (*cells)[i]; },
          [cells](std::size_t i) { return (*cells)[i].name; }};
}

std::vector<Warning> write(const std::filesystem::path& path, const Morphology& m) {
  const Format& format = format_of(path);
  if (!format.write)
    throw InputError(path.string(), 0,
                     fmt::format("{} can be read but not written; choose another extension", format.title));
  write_file(path, format.write(m));
  return losses(m, format.keeps);
}

}  // namespace forest::io
