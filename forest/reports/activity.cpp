// SPDX-License-Identifier: Apache-2.0
#include "forest/reports/activity.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <optional>
#include <unistd.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/mman.h>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/json.h"
#include "forest/core/parallel.h"
#include "forest/reports/activity_layout.h"

namespace forest::reports {

using namespace file;

namespace {

using Json = nlohmann::ordered_json;

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
    const auto json = parse_json<Json>({reinterpret_cast<const char*>(text.data()), text.size()}, d.name,
                                       "pack the report again");
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

namespace {

// Calls visit(time level, row) for the coarsest rows that make up steps [begin, end).
template <class Visit>
void cover(std::uint64_t steps, std::uint64_t begin, std::uint64_t end, Visit&& visit) {
  for (std::uint64_t at = begin; at < end;) {
    std::size_t k = time_level_count - 1;
    const auto fits = [&](std::size_t level) {
      const std::uint64_t factor = 1ull << (2 * level);
      // The last row of a level is shorter where the steps end.
      return at % factor == 0 && std::min(at + factor, steps) <= end;
    };
    while (!fits(k)) --k;
    visit(k, at >> (2 * k));
    at += 1ull << (2 * k);
  }
}

}  // namespace

void Activity::expect_steps(std::uint64_t begin, std::uint64_t end) const {
  if (begin >= end || end > data_->facts.steps)
    throw Error(fmt::format("{}: steps {} to {} are asked for and not in the file", data_->name, begin, end));
}

void Activity::greatest(Level level, std::uint64_t begin, std::uint64_t end, std::uint64_t first,
                        std::span<Code> out) const {
  expect_steps(begin, end);
  std::ranges::fill(out, no_value);
  std::vector<Code> row(out.size());
  cover(data_->facts.steps, begin, end, [&](std::size_t k, std::uint64_t at) {
    values(level, k, at, first, row);
    raise(out, row);
  });
}

void Activity::greatest(std::span<const Wanted> wanted, std::uint64_t begin, std::uint64_t end,
                        std::span<Code> out) const {
  expect_steps(begin, end);
  std::vector<Code> row;
  cover(data_->facts.steps, begin, end, [&](std::size_t k, std::uint64_t at) {
    if (row.empty()) {  // the first, and most often the only one
      gather(wanted, k, at, out);
      row.resize(std::max<std::size_t>(1, out.size()));
    } else {
      const std::span<Code> more = std::span(row).first(out.size());
      gather(wanted, k, at, more);
      raise(out, more);
    }
  });
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
