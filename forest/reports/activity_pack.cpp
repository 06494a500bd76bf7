// SPDX-License-Identifier: Apache-2.0
// Packing an activity file.
#include <algorithm>
#include <cmath>
#include <cstring>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/parallel.h"
#include "forest/reports/activity_layout.h"

namespace forest::reports {

using namespace file;

namespace {

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

}  // namespace

void pack(const Report& report, const circuit::Circuit& circuit, std::span<const Morphology> morphologies,
          const Nodes& nodes, std::span<const Spikes> spikes, const std::filesystem::path& out,
          const PackOptions& options, Progress& progress) {
  if (!(options.range.low < options.range.high) || !std::isfinite(options.range.high - options.range.low))
    throw Error(fmt::format("a range from {} to {} holds no value that can be told; give its lower end first",
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

}  // namespace forest::reports
