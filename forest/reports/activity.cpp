// SPDX-License-Identifier: Apache-2.0
#include "forest/reports/activity.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstring>
#include <optional>
#include <unistd.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/mman.h>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/hash.h"
#include "forest/core/parallel.h"

namespace forest::reports {
namespace {

static_assert(std::endian::native == std::endian::little, "the activity file is little-endian");

constexpr std::array<char, 8> magic{'B', 'F', 'A', 'C', 'T', 'I', 'V', '\n'};
constexpr std::uint32_t version = 1;
constexpr std::size_t alignment = 64;

// A tile holds some columns of 64 steps: their rows, then those of every coarser time level.
constexpr std::size_t tile_steps = 64;
constexpr std::array<std::size_t, time_level_count> level_rows{64, 16, 4, 1};
constexpr std::array<std::size_t, time_level_count> level_slot{0, 64, 80, 84};
constexpr std::size_t slots = 85;
static_assert(level_rows[0] == tile_steps && level_slot.back() + level_rows.back() == slots);

struct Head {
  std::array<char, 8> magic;
  std::uint32_t version, zero;
};

struct Tile {
  std::uint64_t offset, size;
};
struct Slot {
  std::uint32_t size, hash;  // of one packed row
};
struct FileRow {
  std::uint64_t node_id;
  std::uint32_t population, instance, layout, zero;
};
struct FileLayout {
  std::uint32_t morphology, soma;
  std::uint64_t compartments, sections, branches;  // how many
};
static_assert(sizeof(FileRow) == 24 && sizeof(FileLayout) == 32 && sizeof(Compartment) == 12 &&
              sizeof(SectionRun) == 12 && sizeof(Spike) == 16);

// In the order of the file, behind the tiles.
enum Part : std::uint32_t {
  tile_part,
  slot_part,
  column_part,  // the first neuron of every column of tiles, level after level
  row_part,
  layout_part,
  compartment_part,
  section_part,
  branch_part,
  spike_part,
  text_part,
  part_count
};
constexpr std::array<std::uint32_t, part_count> element_sizes{
    sizeof(Tile),        sizeof(Slot),       4, sizeof(FileRow), sizeof(FileLayout),
    sizeof(Compartment), sizeof(SectionRun), 4, sizeof(Spike),   1};

struct Entry {
  std::uint32_t part, element_size;
  std::uint64_t offset, count, hash;
};
struct Foot {  // the last bytes, as sizes are known only when all is packed
  std::array<Entry, part_count> table;
  std::uint64_t file_size, table_hash;
  std::array<char, 8> magic;
};
static_assert(sizeof(Foot) == 32 * part_count + 24);

using Json = nlohmann::ordered_json;

Json describe(const Facts& f) {
  return {{"source", f.source},
          {"circuit", f.circuit},
          {"units", f.units},
          {"populations", f.populations},
          {"instances", f.instances},
          {"start", f.start},
          {"step", f.step},
          {"steps", f.steps},
          {"low", f.range.low},
          {"high", f.range.high},
          {"clamped", f.clamped},
          {"not_numbers", f.not_numbers},
          {"spikes_left_out", f.spikes_left_out}};
}

Facts understand(const Json& json) {
  Facts f;
  f.source = json.at("source"), f.circuit = json.at("circuit"), f.units = json.at("units");
  f.populations = json.at("populations");
  f.instances = json.at("instances"), f.steps = json.at("steps");
  f.start = json.at("start"), f.step = json.at("step");
  f.range = {json.at("low"), json.at("high")};
  f.clamped = json.at("clamped"), f.not_numbers = json.at("not_numbers");
  f.spikes_left_out = json.at("spikes_left_out");
  return f;
}

std::uint64_t values_of(const FileLayout& layout, std::size_t level) {
  return level == 0 ? layout.compartments : level == 1 ? layout.sections : level == 2 ? layout.branches : 1;
}

/// The columns of tiles of one level: runs of neurons. Those of coarser levels are unions of the finest ones.
struct Columns {
  std::vector<std::uint32_t> first;  // neuron; one more than columns
  std::vector<std::uint64_t> value;  // the first value of each; one more, too
  std::size_t size() const { return first.size() - 1; }
};

std::size_t rows_in(std::size_t steps, std::size_t time_level) {
  const std::size_t factor = std::size_t(1) << (2 * time_level);
  return (steps + factor - 1) / factor;
}

std::uint32_t row_hash(std::span<const std::byte> row, std::uint64_t tile, std::size_t slot) {
  return std::uint32_t(hash64(row, tile * slots + slot));
}

/// Rows of one width, all of one tile, being packed: `codes` holds the steps one after the other.
struct PackedTile {
  std::vector<std::byte> bytes;
  std::array<Slot, slots> slot{};
};

PackedTile pack_tile(std::vector<Code> codes, std::size_t width, std::size_t steps, std::uint64_t tile) {
  PackedTile packed;
  packed.bytes.reserve(codes.size() / 2);
  for (std::size_t k = 0, rows = steps; k < time_level_count; ++k) {
    for (std::size_t r = 0; r < rows; ++r) {
      const std::size_t begin = packed.bytes.size();
      pack_row({&codes[r * width], width}, packed.bytes);
      const auto row = std::span<const std::byte>(packed.bytes).subspan(begin);
      packed.slot[level_slot[k] + r] = {std::uint32_t(row.size()), row_hash(row, tile, level_slot[k] + r)};
    }
    const std::size_t coarser = (rows + time_factor - 1) / time_factor;
    for (std::size_t r = 0; r < coarser; ++r) {  // in place: row r is read before it is written
      const std::span<Code> to(&codes[r * width], width);
      std::memmove(to.data(), &codes[r * time_factor * width], width);
      for (std::size_t i = r * time_factor + 1; i < std::min(rows, (r + 1) * time_factor); ++i)
        raise(to, {&codes[i * width], width});
    }
    rows = coarser;
  }
  return packed;
}

/// What packing needs of a layout, ready for use.
struct Kernel {
  std::vector<std::uint32_t> weights;
  std::vector<std::uint64_t> section_weight;
  bool in_order = true;  // columns need not be moved
};

struct Mean {
  std::uint64_t sum = 0, weight = 0;
  void add(const Mean& other) { sum += other.sum, weight += other.weight; }
  Code code() const { return weight ? Code((2 * sum + weight) / (2 * weight)) : no_value; }
};

/// The coarser levels of one neuron at one step.
void coarsen(const Layout& layout, const Kernel& kernel, const Code* codes,
             const std::array<Code*, level_count>& out) {
  bool whole = true;
  for (std::size_t c = 0; c < layout.compartments.size(); ++c) whole &= codes[c] != no_value;
  Mean neuron;
  std::size_t section = 0;
  std::uint32_t c = 0;
  for (std::size_t b = 0; b < layout.branches.size(); ++b) {
    Mean branch;
    for (; section < layout.branches[b]; ++section) {
      Mean mean;
      const std::uint32_t end = layout.sections[section].end;
      if (whole) {
        std::uint32_t sum = 0;  // 65535 · 254 · 258 compartments; longer sections in parts
        for (; c < end;) {
          const std::uint32_t stop = std::min(end, c + 256);
          sum = 0;
          for (; c < stop; ++c) sum += kernel.weights[c] * codes[c];
          mean.sum += sum;
        }
        mean.weight = kernel.section_weight[section];
      } else {
        for (; c < end; ++c)
          if (codes[c] != no_value)
            mean.add({std::uint64_t(kernel.weights[c]) * codes[c], kernel.weights[c]});
      }
      out[1][section] = mean.code();
      branch.add(mean);
    }
    out[2][b] = branch.code();
    neuron.add(branch);
  }
  *out[3] = neuron.code();
  *out[4] = codes[layout.soma];
}

class Packer {
 public:
  Packer(const Report& report, const Match& match, std::span<const Spike> spikes, const PackOptions& options,
         NewFile& file)
      : report_(report), match_(match), spikes_(spikes), options_(options), file_(file) {
    for (const Layout& layout : match.layouts) {
      Kernel kernel;
      for (std::uint32_t c = 0, s = 0; c < layout.compartments.size(); ++c) {
        if (c == 0 || c == layout.sections[s].end) s += c != 0, kernel.section_weight.push_back(0);
        kernel.weights.push_back(layout.compartments[c].weight);
        kernel.section_weight.back() += layout.compartments[c].weight;
        kernel.in_order &= layout.compartments[c].column == c;
      }
      kernels_.push_back(std::move(kernel));
      file_layouts_.push_back({layout.morphology, layout.soma, layout.compartments.size(),
                               layout.sections.size(), layout.branches.size()});
    }
    cut_columns();
    time_tiles_ = (report.steps + tile_steps - 1) / tile_steps;
    std::uint64_t tiles = 0;
    for (std::size_t l = 0; l < level_count; ++l) base_[l] = tiles, tiles += columns_[l].size() * time_tiles_;
    tiles_.resize(tiles), slots_.resize(tiles * slots);
  }

  void run(Facts facts, Progress& progress) {
    write(Head{magic, version, 0});
    const std::size_t columns = columns_[0].size(), jobs = columns * time_tiles_;
    progress.begin("packing", jobs);
    parallel_in_order(
        jobs, [&](std::size_t i) { return make(i / columns, i % columns); },
        [&](std::size_t i, Piece piece) {
          take(i / columns, i % columns, std::move(piece), facts);
          progress.advance();
        });
    finish(facts);
    progress.end();
  }

 private:
  /// A finest tile, and the codes of the coarser levels of the same neurons.
  struct Piece {
    PackedTile tile;
    std::array<std::vector<Code>, level_count> codes;
    std::uint64_t clamped = 0, not_numbers = 0;
  };

  std::uint64_t values(std::size_t neuron, std::size_t level) const {
    return values_of(file_layouts_[match_.layout[neuron]], level);
  }

  void cut_columns() {
    for (std::size_t l = 0; l < level_count; ++l) {
      Columns& columns = columns_[l];
      std::uint64_t at = 0, begin = 0;
      std::size_t next_finest = 0;
      for (std::uint32_t n = 0; n < match_.layout.size(); ++n) {
        const bool may_begin = l == 0 || columns_[0].first[next_finest] == n;
        if (l && may_begin) ++next_finest;
        // A column of a coarser level ends where its next finest one would be too much.
        std::uint64_t more = 0;
        if (may_begin) {
          const std::uint32_t end = l == 0 ? n + 1 : columns_[0].first[next_finest];
          for (std::uint32_t m = n; m < end; ++m) more += values(m, l);
        }
        if (n == 0 || (may_begin && at - begin + more > options_.tile))
          columns.first.push_back(n), columns.value.push_back(at), begin = at;
        at += values(n, l);
      }
      columns.first.push_back(std::uint32_t(match_.layout.size())), columns.value.push_back(at);
    }
  }

  Piece make(std::size_t t, std::size_t c) const {
    const std::uint32_t begin = columns_[0].first[c], end = columns_[0].first[c + 1];
    const std::size_t steps = std::min(tile_steps, report_.steps - t * tile_steps);
    const std::uint64_t first = report_.first_column[begin], width = report_.first_column[end] - first;
    Piece piece;
    std::vector<float> row_values(steps * width);
    report_.read(t * tile_steps, steps, first, width, row_values.data());
    std::vector<Code> codes(steps * width), moved;
    const Range& range = options_.range;
    options_.range.encode(row_values, codes.data());
    for (const float v : row_values) piece.clamped += (v < range.low) | (v > range.high);
    for (const Code code : codes) piece.not_numbers += code == no_value;
    row_values = {};

    std::array<std::size_t, level_count> widths{};
    for (std::size_t l = 1; l < level_count; ++l) {
      for (std::uint32_t n = begin; n < end; ++n) widths[l] += values(n, l);
      piece.codes[l].resize(widths[l] * steps);
    }
    for (std::size_t s = 0; s < steps; ++s) {
      std::array<Code*, level_count> out{};
      for (std::size_t l = 1; l < level_count; ++l) out[l] = &piece.codes[l][s * widths[l]];
      for (std::uint32_t n = begin; n < end; ++n) {
        const Layout& layout = match_.layouts[match_.layout[n]];
        const Kernel& kernel = kernels_[match_.layout[n]];
        Code* const own = &codes[s * width + report_.first_column[n] - first];
        if (!kernel.in_order) {
          moved.assign(own, own + layout.compartments.size());
          for (std::size_t i = 0; i < moved.size(); ++i) own[i] = moved[layout.compartments[i].column];
        }
        coarsen(layout, kernel, own, out);
        for (std::size_t l = 1; l < level_count; ++l) out[l] += values(n, l);
      }
    }
    piece.tile = pack_tile(std::move(codes), width, steps, number(0, t, c));
    return piece;
  }

  std::uint64_t number(std::size_t level, std::size_t t, std::size_t c) const {
    return base_[level] + t * columns_[level].size() + c;
  }

  void take(std::size_t t, std::size_t c, Piece piece, Facts& facts) {
    facts.clamped += piece.clamped, facts.not_numbers += piece.not_numbers;
    append(number(0, t, c), piece.tile);
    const std::size_t steps = std::min(tile_steps, report_.steps - t * tile_steps);
    for (std::size_t l = 1; l < level_count; ++l) {
      waiting_[l].push_back(std::move(piece.codes[l]));
      const auto end = std::ranges::lower_bound(columns_[l].first, columns_[0].first[c + 1]);
      if (*end != columns_[0].first[c + 1]) continue;
      const std::size_t column = std::size_t(end - columns_[l].first.begin()) - 1;
      const std::size_t width = columns_[l].value[column + 1] - columns_[l].value[column];
      std::vector<Code> codes;
      codes.reserve(width * steps);
      for (std::size_t s = 0; s < steps; ++s)
        for (const std::vector<Code>& part : waiting_[l]) {
          const std::size_t own = part.size() / steps;
          codes.insert(codes.end(), part.begin() + std::ptrdiff_t(s * own),
                       part.begin() + std::ptrdiff_t((s + 1) * own));
        }
      waiting_[l].clear();
      append(number(l, t, column), pack_tile(std::move(codes), width, steps, number(l, t, column)));
    }
  }

  void append(std::uint64_t tile, const PackedTile& packed) {
    tiles_[tile] = {at_, packed.bytes.size()};
    std::ranges::copy(packed.slot, slots_.begin() + std::ptrdiff_t(tile * slots));
    write_bytes(packed.bytes);
  }

  void finish(const Facts& facts) {
    std::vector<std::uint32_t> firsts;
    Json json = describe(facts);
    for (const Columns& columns : columns_) {
      firsts.insert(firsts.end(), columns.first.begin(), columns.first.end() - 1);
      json["columns"].push_back(columns.size());
    }
    std::vector<FileRow> rows;
    for (std::size_t n = 0; n < match_.layout.size(); ++n)
      rows.push_back(
          {report_.nodes[n].id, report_.nodes[n].population, match_.instance[n], match_.layout[n], 0});
    std::vector<Compartment> compartments;
    std::vector<SectionRun> sections;
    std::vector<std::uint32_t> branches;
    for (const Layout& layout : match_.layouts) {
      compartments.insert(compartments.end(), layout.compartments.begin(), layout.compartments.end());
      sections.insert(sections.end(), layout.sections.begin(), layout.sections.end());
      branches.insert(branches.end(), layout.branches.begin(), layout.branches.end());
    }
    const std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
    const std::array<std::span<const std::byte>, part_count> parts{std::as_bytes(std::span(tiles_)),
                                                                   std::as_bytes(std::span(slots_)),
                                                                   std::as_bytes(std::span(firsts)),
                                                                   std::as_bytes(std::span(rows)),
                                                                   std::as_bytes(std::span(file_layouts_)),
                                                                   std::as_bytes(std::span(compartments)),
                                                                   std::as_bytes(std::span(sections)),
                                                                   std::as_bytes(std::span(branches)),
                                                                   std::as_bytes(spikes_),
                                                                   std::as_bytes(std::span(text))};
    Foot foot{.table = {}, .file_size = 0, .table_hash = 0, .magic = magic};
    constexpr std::array<std::byte, alignment> zeros{};
    for (std::uint32_t p = 0; p < part_count; ++p) {
      write_bytes(std::span(zeros).first((alignment - at_ % alignment) % alignment));
      foot.table[p] = {p, element_sizes[p], at_, parts[p].size() / element_sizes[p], hash64(parts[p])};
      write_bytes(parts[p]);
    }
    foot.file_size = at_ + sizeof foot;
    foot.table_hash = hash64(std::as_bytes(std::span(foot.table)), foot.file_size);
    write(foot);
  }

  template <class T>
  void write(const T& value) {
    write_bytes(std::as_bytes(std::span(&value, 1)));
  }
  void write_bytes(std::span<const std::byte> bytes) {
    file_.write(bytes);
    at_ += bytes.size();
  }

  const Report& report_;
  const Match& match_;
  const std::span<const Spike> spikes_;
  const PackOptions& options_;
  NewFile& file_;
  std::vector<Kernel> kernels_;
  std::vector<FileLayout> file_layouts_;
  std::array<Columns, level_count> columns_;
  std::array<std::uint64_t, level_count> base_{};
  std::size_t time_tiles_ = 0;
  std::vector<Tile> tiles_;
  std::vector<Slot> slots_;
  std::array<std::vector<std::vector<Code>>, level_count> waiting_;  // pieces of a coarser tile
  std::uint64_t at_ = 0;
};

std::optional<std::uint32_t> nearest(const LayoutView& layout, std::uint32_t SectionRun::*of,
                                     std::uint32_t wanted, float position) {
  const auto found = std::ranges::find(layout.sections, wanted, of);
  if (found == layout.sections.end()) return std::nullopt;
  const auto [begin, end] = layout.compartments_of(std::size_t(found - layout.sections.begin()));
  const auto run = layout.compartments.subspan(begin, end - begin);
  const auto best = std::ranges::min_element(
      run, {}, [&](const Compartment& c) { return std::abs(c.position - position); });
  return begin + std::uint32_t(best - run.begin());
}

}  // namespace

std::optional<std::uint32_t> LayoutView::at(std::uint32_t section, float position) const {
  return nearest(*this, &SectionRun::section, section, position);
}

std::optional<std::uint32_t> LayoutView::at_element(std::uint32_t element, float position) const {
  return nearest(*this, &SectionRun::element, element, position);
}

std::vector<std::uint32_t> LayoutView::runs(std::size_t count) const {
  std::vector<std::uint32_t> runs(count, 0xffffffffu);
  for (std::size_t i = 0; i < sections.size(); ++i)
    if (sections[i].section < count) runs[sections[i].section] = std::uint32_t(i);
  return runs;
}

std::vector<std::uint32_t> compartments_at(const LayoutView& layout, std::span<const std::uint32_t> parents,
                                           std::span<const Place> places) {
  constexpr std::uint32_t none = 0xffffffffu;
  const auto runs = layout.runs(parents.size());
  std::vector<std::uint32_t> result;
  result.reserve(places.size());
  for (const Place& place : places) {
    std::uint32_t section = place.section;
    float position = place.position;
    // Parents come before their children, so this ends.
    while (section < parents.size() && runs[section] == none) {
      section = parents[section] < section ? parents[section] : none;
      position = 1.f;
    }
    if (section >= parents.size()) {
      result.push_back(place.section == soma_run ? layout.at(soma_run, position).value_or(layout.soma)
                                                 : layout.soma);
      continue;
    }
    const auto [begin, end] = layout.compartments_of(runs[section]);
    // Compartments of a section lie in the order of their places.
    const auto run = layout.compartments.subspan(begin, end - begin);
    auto best = std::ranges::lower_bound(run, position, {}, &Compartment::position);
    if (best == run.end() ||
        (best != run.begin() && position - (best - 1)->position <= best->position - position))
      --best;
    result.push_back(begin + std::uint32_t(best - run.begin()));
  }
  return result;
}

void pack(const Report& report, const circuit::Circuit& circuit, std::span<const Morphology> morphologies,
          const Nodes& nodes, std::span<const Spikes> spikes, const std::filesystem::path& out,
          const PackOptions& options, Progress& progress) {
  if (!(options.range.low < options.range.high) || !std::isfinite(options.range.low) ||
      !std::isfinite(options.range.high))
    throw Error(fmt::format("a range from {} to {} holds no value; give its lower end first",
                            options.range.low, options.range.high));
  if (options.tile == 0 || options.tile > (1u << 24))
    throw Error(fmt::format("tiles of {} values are no good; give 1 to {}", options.tile, 1u << 24));
  const Match matched = match(report, circuit, morphologies, nodes);
  const PlacedSpikes placed = place(spikes, nodes);
  NewFile file(out);
  Facts facts{.source = report.source,
              .circuit = circuit.name,
              .units = report.units,
              .populations = report.populations,
              .instances = circuit.instances.size(),
              .start = report.start,
              .step = report.step,
              .steps = report.steps,
              .range = options.range,
              .spikes_left_out = placed.left_out};
  Packer(report, matched, placed.spikes, options, file).run(std::move(facts), progress);
  file.commit();
}

struct Activity::Data {
  std::string name;
  std::optional<MappedFile> file;
  std::vector<std::byte> memory;
  std::span<const std::byte> bytes;
  std::array<std::span<const std::byte>, part_count> parts;
  Facts facts;
  std::vector<Row> rows;
  std::vector<LayoutView> layouts;
  std::array<Columns, level_count> columns;
  std::array<std::uint64_t, level_count> base{}, width{};
  std::vector<std::pair<std::uint32_t, std::uint32_t>> row_of_instance;  // sorted
  std::size_t time_tiles = 0;
  mutable std::atomic<std::uint64_t> touched{0};

  template <class T>
  std::span<const T> as(Part part) const {
    return {reinterpret_cast<const T*>(parts[part].data()), parts[part].size() / sizeof(T)};
  }
  [[noreturn]] void refuse(const std::string& sentence) const { throw InputError(name, 0, sentence + again); }
  static constexpr const char* again = "; pack the report again";

  std::uint64_t tile(std::size_t level, std::size_t t, std::size_t c) const {
    return base[level] + t * columns[level].size() + c;
  }
  std::size_t column_of(std::size_t level, std::uint64_t value) const {
    return std::size_t(std::ranges::upper_bound(columns[level].value, value) - columns[level].value.begin()) -
           1;
  }
  /// A packed row as it lies in the file.
  std::span<const std::byte> row(std::uint64_t number, std::size_t slot) const {
    const Slot* own = &as<Slot>(slot_part)[number * slots];
    std::uint64_t at = as<Tile>(tile_part)[number].offset;
    for (std::size_t i = 0; i < slot; ++i) at += own[i].size;
    return bytes.subspan(at, own[slot].size);
  }
  /// The same, looked at and found sound.
  std::span<const std::byte> checked(std::uint64_t number, std::size_t slot, std::size_t count) const {
    const auto packed = row(number, slot);
    touched.fetch_add(packed.size(), std::memory_order_relaxed);
    if (row_hash(packed, number, slot) != as<Slot>(slot_part)[number * slots + slot].hash ||
        !is_row(packed, count))
      refuse("is damaged: values do not match their checksum");
    return packed;
  }
  /// Tells the system that these bytes come next, so that a disk fetches many at once.
  void expect(std::span<const std::byte> range) const {
    if (!file || range.empty()) return;
    static const auto page = std::uintptr_t(::sysconf(_SC_PAGESIZE));
    const auto begin = reinterpret_cast<std::uintptr_t>(range.data()) / page * page;
    ::madvise(reinterpret_cast<void*>(begin),
              reinterpret_cast<std::uintptr_t>(range.data()) + range.size() - begin, MADV_WILLNEED);
  }
};

Activity Activity::open(const std::filesystem::path& path) {
  auto data = std::make_shared<Data>();
  data->file.emplace(path);
  const auto bytes = data->file->bytes();
  return check(std::move(data), bytes, path.string());
}

Activity Activity::from_bytes(std::vector<std::byte> memory, const std::string& name) {
  auto data = std::make_shared<Data>();
  data->memory = std::move(memory);
  const std::span<const std::byte> bytes = data->memory;
  return check(std::move(data), bytes, name);
}

Activity Activity::check(std::shared_ptr<Data> data, std::span<const std::byte> bytes,
                         const std::string& name) {
  Data& d = *data;
  d.name = name, d.bytes = bytes;
  const auto require = [&](bool good, const std::string& sentence) {
    if (!good) d.refuse(sentence);
  };
  Head head;
  require(bytes.size() >= sizeof head, "is too short to be an activity file");
  std::memcpy(&head, bytes.data(), sizeof head);
  if (head.magic != magic)
    throw InputError(name, 0, "is not an activity file; make one with 'brainforest activity'");
  require(head.zero == 0, "is damaged at its beginning");
  require(head.version == version,
          fmt::format("has version {} of the activity file and this program reads version {}", head.version,
                      version));
  Foot foot;
  const std::string cut = "is cut short or has grown";
  require(bytes.size() >= sizeof head + sizeof foot, cut);
  std::memcpy(&foot, bytes.data() + bytes.size() - sizeof foot, sizeof foot);
  require(foot.magic == magic && foot.file_size == bytes.size(), cut);
  require(hash64(std::as_bytes(std::span(foot.table)), foot.file_size) == foot.table_hash,
          "has a damaged table of contents");
  const std::uint64_t foot_at = bytes.size() - sizeof foot, tiles_end = foot.table[0].offset;
  std::uint64_t end = tiles_end;  // of what has been looked at, behind the tiles
  for (std::uint32_t p = 0; p < part_count; ++p) {
    const Entry& e = foot.table[p];
    require(e.part == p && e.element_size == element_sizes[p] && e.offset % alignment == 0 &&
                e.offset <= foot_at && e.offset >= sizeof head &&
                e.count <= (foot_at - e.offset) / e.element_size,
            "has a wrong table of contents");
    require(e.offset >= end && e.offset - end < alignment &&
                std::ranges::all_of(bytes.subspan(end, e.offset - end),
                                    [](std::byte b) { return b == std::byte{0}; }),
            "is damaged between its parts");
    end = e.offset + e.count * e.element_size;
    d.parts[p] = bytes.subspan(e.offset, e.count * e.element_size);
    require(hash64(d.parts[p]) == e.hash, fmt::format("is damaged: part {} does not match its checksum", p));
  }
  require(end == foot_at, cut);

  // A right checksum over wrong numbers is possible too: every number is looked at before it is used.
  const std::string wrong = "names things that are not in it";
  std::vector<std::uint64_t> column_counts;
  try {
    const auto text = d.parts[text_part];
    const Json json = Json::parse(std::string_view(reinterpret_cast<const char*>(text.data()), text.size()));
    d.facts = understand(json);
    column_counts = json.at("columns").get<std::vector<std::uint64_t>>();
  } catch (const nlohmann::json::exception&) {
    d.refuse("has a damaged description");
  }
  const Facts& f = d.facts;
  require(std::isfinite(f.start) && std::isfinite(f.step) && f.step > 0. && std::isfinite(f.range.low) &&
              std::isfinite(f.range.high) && f.range.low < f.range.high && f.steps > 0 &&
              f.steps < (1ull << 40),
          "has a damaged description");

  const auto compartments = d.as<Compartment>(compartment_part);
  const auto sections = d.as<SectionRun>(section_part);
  const auto branches = d.as<std::uint32_t>(branch_part);
  std::uint64_t c = 0, s = 0, b = 0;
  for (const FileLayout& layout : d.as<FileLayout>(layout_part)) {
    require(layout.compartments > 0 && layout.compartments <= compartments.size() - c &&
                layout.sections > 0 && layout.sections <= sections.size() - s && layout.branches > 0 &&
                layout.branches <= branches.size() - b && layout.soma < layout.compartments,
            wrong);
    const LayoutView view{layout.morphology, layout.soma, compartments.subspan(c, layout.compartments),
                          sections.subspan(s, layout.sections), branches.subspan(b, layout.branches)};
    std::uint32_t before = 0;
    for (const SectionRun& run : view.sections) require(run.end > before, wrong), before = run.end;
    require(before == layout.compartments, wrong);
    for (const Compartment& compartment : view.compartments)
      require(compartment.column < layout.compartments && compartment.position >= 0.f &&
                  compartment.position <= 1.f && compartment.weight > 0,
              wrong);
    before = 0;
    for (const std::uint32_t branch : view.branches) require(branch > before, wrong), before = branch;
    require(before == layout.sections, wrong);
    d.layouts.push_back(view);
    c += layout.compartments, s += layout.sections, b += layout.branches;
  }
  require(c == compartments.size() && s == sections.size() && b == branches.size(), wrong);

  require(f.instances < 0xffffffffull, wrong);
  for (const FileRow& row : d.as<FileRow>(row_part)) {
    require(row.layout < d.layouts.size() && row.population < f.populations.size() &&
                row.instance < f.instances && row.zero == 0,
            wrong);
    d.rows.push_back({row.node_id, row.population, row.instance, row.layout, d.width});
    for (std::size_t l = 0; l < level_count; ++l)
      d.width[l] += values_of(d.as<FileLayout>(layout_part)[row.layout], l);
    d.row_of_instance.emplace_back(row.instance, std::uint32_t(d.rows.size() - 1));
  }
  require(!d.rows.empty(), wrong);
  std::ranges::sort(d.row_of_instance);
  require(std::ranges::adjacent_find(d.row_of_instance, {}, [](const auto& p) { return p.first; }) ==
              d.row_of_instance.end(),
          wrong);
  double before = -INFINITY;
  for (const Spike& spike : d.as<Spike>(spike_part)) {
    require(
        spike.time >= before && std::isfinite(spike.time) && spike.instance < f.instances && spike.zero == 0,
        wrong);
    before = spike.time;
  }

  std::uint64_t column_total = 0;
  const auto firsts = d.as<std::uint32_t>(column_part);
  require(column_counts.size() == level_count, wrong);
  for (std::size_t l = 0; l < level_count; ++l) {
    require(column_counts[l] > 0 && column_counts[l] <= firsts.size() - column_total, wrong);
    Columns& columns = d.columns[l];
    for (const std::uint32_t first : firsts.subspan(column_total, column_counts[l])) {
      require(columns.first.empty() ? first == 0 : first > columns.first.back() && first < d.rows.size(),
              wrong);
      require(l == 0 || std::ranges::binary_search(d.columns[0].first, first), wrong);
      columns.first.push_back(first), columns.value.push_back(d.rows[first].first[l]);
    }
    columns.first.push_back(std::uint32_t(d.rows.size())), columns.value.push_back(d.width[l]);
    column_total += column_counts[l];
  }
  require(column_total == firsts.size(), wrong);

  // Tiles lie one behind the other in the order in which they were packed, rows without gaps in them.
  d.time_tiles = std::size_t((f.steps + tile_steps - 1) / tile_steps);
  const auto tiles = d.as<Tile>(tile_part);
  const auto all_slots = d.as<Slot>(slot_part);
  require(tiles.size() % column_total == 0 && tiles.size() / column_total == d.time_tiles &&
              all_slots.size() == tiles.size() * slots,
          wrong);
  std::uint64_t base = 0;
  for (std::size_t l = 0; l < level_count; ++l) d.base[l] = base, base += d.columns[l].size() * d.time_tiles;
  std::uint64_t at = sizeof head;
  const auto next = [&](std::uint64_t number, std::size_t t) {
    const std::size_t steps = std::size_t(std::min<std::uint64_t>(tile_steps, f.steps - t * tile_steps));
    std::uint64_t size = 0;
    for (std::size_t k = 0; k < time_level_count; ++k)
      for (std::size_t r = 0; r < level_rows[k]; ++r) {
        const Slot& slot = all_slots[number * slots + level_slot[k] + r];
        require(r < rows_in(steps, k) || (slot.size == 0 && slot.hash == 0), wrong);
        size += slot.size;
      }
    require(tiles[number].offset == at && tiles[number].size == size && size <= tiles_end - at, wrong);
    at += size;
  };
  for (std::size_t t = 0; t < d.time_tiles; ++t) {
    std::array<std::size_t, level_count> done{};
    for (std::size_t column = 0; column < d.columns[0].size(); ++column) {
      next(d.tile(0, t, column), t);
      for (std::size_t l = 1; l < level_count; ++l)
        if (d.columns[l].first[done[l] + 1] == d.columns[0].first[column + 1])
          next(d.tile(l, t, done[l]++), t);
    }
  }
  require(tiles_end - at < alignment && std::ranges::all_of(bytes.subspan(at, tiles_end - at),
                                                            [](std::byte x) { return x == std::byte{0}; }),
          "is damaged between its parts");
  // Rows are far from one another: what the system would read on its own account around each is not needed.
  if (d.file) ::madvise(const_cast<std::byte*>(bytes.data()), tiles_end, MADV_RANDOM);
  return Activity(std::move(data));
}

const Facts& Activity::facts() const { return data_->facts; }
std::span<const Row> Activity::rows() const { return data_->rows; }
std::size_t Activity::layout_count() const { return data_->layouts.size(); }
LayoutView Activity::layout(std::uint32_t index) const { return data_->layouts[index]; }
std::uint64_t Activity::width(Level level) const { return data_->width[std::size_t(level)]; }
std::uint64_t Activity::row_count(std::size_t time_level) const {
  return rows_in(data_->facts.steps, time_level);
}
std::uint64_t Activity::bytes() const { return data_->bytes.size(); }
std::uint64_t Activity::touched() const { return data_->touched.load(); }

std::optional<std::uint32_t> Activity::row_of_instance(std::uint32_t instance) const {
  const auto& rows = data_->row_of_instance;
  const auto found = std::ranges::lower_bound(rows, std::pair(instance, 0u));
  if (found == rows.end() || found->first != instance) return std::nullopt;
  return found->second;
}

std::uint64_t Activity::count(std::uint32_t row, Level level) const {
  const auto l = std::size_t(level);
  return (row + 1 < data_->rows.size() ? data_->rows[row + 1].first[l] : data_->width[l]) -
         data_->rows[row].first[l];
}

std::span<const Spike> Activity::spikes() const { return data_->as<Spike>(spike_part); }

std::span<const Spike> Activity::spikes(double begin, double end) const {
  const auto all = spikes();
  const auto first = std::ranges::lower_bound(all, begin, {}, &Spike::time);
  return {first, std::ranges::lower_bound(first, all.end(), std::max(begin, end), {}, &Spike::time)};
}

void Activity::values(Level level, std::size_t time_level, std::uint64_t row, std::uint64_t first,
                      std::span<Code> out) const {
  const Data& d = *data_;
  const auto l = std::size_t(level);
  if (time_level >= time_level_count || row >= row_count(time_level) || first > d.width[l] ||
      out.size() > d.width[l] - first)
    throw Error(fmt::format("{}: values {} to {} of row {} are asked for and not in the file", d.name, first,
                            first + out.size(), row));
  if (out.empty()) return;
  const std::size_t t = std::size_t(row / level_rows[time_level]);
  const std::size_t slot = level_slot[time_level] + std::size_t(row % level_rows[time_level]);
  const std::size_t begin = d.column_of(l, first), end = d.column_of(l, first + out.size() - 1) + 1;
  for (std::size_t c = begin; c < end; ++c) d.expect(d.row(d.tile(l, t, c), slot));
  const auto& starts = d.columns[l].value;
  parallel_for(end - begin, 8, [&](std::size_t i) {
    const std::size_t c = begin + i;
    const std::uint64_t from = std::max(first, starts[c]), to = std::min(first + out.size(), starts[c + 1]);
    const std::size_t width = std::size_t(starts[c + 1] - starts[c]);
    unpack(d.checked(d.tile(l, t, c), slot, width), width, std::size_t(from - starts[c]),
           out.subspan(std::size_t(from - first), std::size_t(to - from)));
  });
}

void Activity::gather(std::span<const Wanted> wanted, std::size_t time_level, std::uint64_t row,
                      std::span<Code> out) const {
  const Data& d = *data_;
  if (time_level >= time_level_count || row >= row_count(time_level))
    throw Error(
        fmt::format("{}: row {} of time level {} is asked for and not in the file", d.name, row, time_level));
  const std::size_t t = std::size_t(row / level_rows[time_level]);
  const std::size_t slot = level_slot[time_level] + std::size_t(row % level_rows[time_level]);
  struct Item {
    std::uint64_t tile, to;
    std::uint32_t index;  // in wanted
  };
  std::vector<Item> items(wanted.size());
  std::uint64_t to = 0;
  for (std::uint32_t i = 0; i < wanted.size(); ++i) {
    const auto l = std::size_t(wanted[i].level);
    if (wanted[i].row >= d.rows.size() || l >= level_count)
      throw Error(
          fmt::format("{}: neuron {} is asked for and there are {}", d.name, wanted[i].row, d.rows.size()));
    items[i] = {d.tile(l, t, d.column_of(l, d.rows[wanted[i].row].first[l])), to, i};
    to += count(wanted[i].row, wanted[i].level);
  }
  if (to != out.size())
    throw Error(fmt::format("{}: {} values are asked for and there is room for {}", d.name, to, out.size()));
  std::ranges::sort(items, {}, [](const Item& item) { return std::pair(item.tile, item.index); });
  std::vector<std::size_t> groups;  // where items of another tile begin
  for (std::size_t i = 0; i < items.size(); ++i)
    if (i == 0 || items[i].tile != items[i - 1].tile)
      groups.push_back(i), d.expect(d.row(items[i].tile, slot));
  groups.push_back(items.size());
  parallel_for(groups.size() - 1, 8, [&](std::size_t g) {
    const Wanted& any = wanted[items[groups[g]].index];
    const auto l = std::size_t(any.level);
    const auto& starts = d.columns[l].value;
    const std::size_t c = d.column_of(l, d.rows[any.row].first[l]),
                      width = std::size_t(starts[c + 1] - starts[c]);
    const auto packed = d.checked(items[groups[g]].tile, slot, width);
    for (std::size_t i = groups[g]; i < groups[g + 1]; ++i) {
      const Wanted& own = wanted[items[i].index];
      unpack(packed, width, std::size_t(d.rows[own.row].first[l] - starts[c]),
             out.subspan(std::size_t(items[i].to), std::size_t(count(own.row, own.level))));
    }
  });
}

void Activity::greatest(Level level, std::uint64_t begin, std::uint64_t end, std::uint64_t first,
                        std::span<Code> out) const {
  if (begin >= end || end > data_->facts.steps)
    throw Error(fmt::format("{}: steps {} to {} are asked for and not in the file", data_->name, begin, end));
  std::ranges::fill(out, no_value);
  std::vector<Code> row(out.size());
  for (std::uint64_t at = begin; at < end;) {
    std::size_t k = time_level_count - 1;
    const auto fits = [&](std::size_t level_of_time) {
      const std::uint64_t factor = 1ull << (2 * level_of_time);
      // The last row of a level is shorter where the steps end.
      return at % factor == 0 && std::min(at + factor, data_->facts.steps) <= end;
    };
    while (!fits(k)) --k;
    values(level, k, at >> (2 * k), first, row);
    raise(out, row);
    at += 1ull << (2 * k);
  }
}

std::vector<Code> Activity::history(Level level, std::uint64_t value) const {
  const Data& d = *data_;
  const auto l = std::size_t(level);
  if (value >= d.width[l])
    throw Error(fmt::format("{}: value {} is asked for and there are {}", d.name, value, d.width[l]));
  const std::size_t c = d.column_of(l, value);
  const std::size_t width = std::size_t(d.columns[l].value[c + 1] - d.columns[l].value[c]);
  const auto within = std::size_t(value - d.columns[l].value[c]);
  for (std::size_t t = 0; t < d.time_tiles; ++t) {
    const std::uint64_t number = d.tile(l, t, c);
    const auto first = d.row(number, 0);
    const auto coarser = d.row(number, level_slot[1]);
    d.expect({first.data(), coarser.data()});
  }
  std::vector<Code> history(d.facts.steps);
  parallel_for(d.time_tiles, 4, [&](std::size_t t) {
    for (std::size_t i = t * tile_steps; i < std::min<std::size_t>((t + 1) * tile_steps, history.size()); ++i)
      unpack(d.checked(d.tile(l, t, c), i % tile_steps, width), width, within,
             std::span(history).subspan(i, 1));
  });
  return history;
}

std::vector<Code> Activity::raster(std::size_t time_level) const {
  const std::size_t neurons = data_->rows.size(), times = std::size_t(row_count(time_level));
  std::vector<Code> raster(neurons * times);
  // Some rows at a time, so that each is turned while it is near.
  constexpr std::size_t block = 64;
  parallel_for((times + block - 1) / block, 1, [&](std::size_t part) {
    const std::size_t begin = part * block, end = std::min(times, begin + block);
    std::vector<Code> rows(neurons * (end - begin));
    for (std::size_t i = begin; i < end; ++i)
      values(Level::soma, time_level, i, 0, std::span(rows).subspan((i - begin) * neurons, neurons));
    for (std::size_t n = 0; n < neurons; ++n)
      for (std::size_t i = begin; i < end; ++i) raster[n * times + i] = rows[(i - begin) * neurons + n];
  });
  return raster;
}

std::vector<Code> Activity::raster_picture(std::uint64_t begin, std::uint64_t end, std::uint32_t width,
                                           std::uint32_t height) const {
  if (begin >= end || end > data_->facts.steps || width == 0 || height == 0)
    throw Error(
        fmt::format("{}: a picture of steps {} to {} in {}x{} pixels is asked for; there are {} steps",
                    data_->name, begin, end, width, height, data_->facts.steps));
  const std::size_t neurons = data_->rows.size();
  std::vector<Code> picture(std::size_t(width) * height, no_value);
  parallel_for(width, 4, [&](std::size_t x) {
    const std::uint64_t first = begin + (end - begin) * x / width;
    const std::uint64_t last = std::max(first + 1, begin + (end - begin) * (x + 1) / width);
    std::vector<Code> column(neurons);
    greatest(Level::soma, first, last, 0, column);
    for (std::uint32_t y = 0; y < height; ++y) {
      const std::size_t n = neurons * y / height, stop = std::max(n + 1, neurons * (y + 1) / height);
      for (std::size_t i = n; i < stop; ++i)
        raise({&picture[y * std::size_t(width) + x], 1}, {&column[i], 1});
    }
  });
  return picture;
}

void Activity::verify() const {
  const Data& d = *data_;
  for (std::size_t l = 0; l < level_count; ++l)
    parallel_for(d.columns[l].size() * d.time_tiles, 1, [&](std::size_t i) {
      const std::size_t t = i / d.columns[l].size(), c = i % d.columns[l].size();
      const auto width = std::size_t(d.columns[l].value[c + 1] - d.columns[l].value[c]);
      const std::size_t steps = std::min<std::size_t>(tile_steps, d.facts.steps - t * tile_steps);
      for (std::size_t k = 0; k < time_level_count; ++k)
        for (std::size_t r = 0; r < rows_in(steps, k); ++r)
          (void)d.checked(d.tile(l, t, c), level_slot[k] + r, width);
    });
}

}  // namespace forest::reports
