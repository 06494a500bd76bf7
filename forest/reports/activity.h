// SPDX-License-Identifier: Apache-2.0
// The activity file: a report packed for playing, mapped into memory, of which only what is looked at is touched. Values
// are one byte (code.h). Five levels of detail over the branches, from every compartment to one value a neuron, and four
// over time; each value of a coarser level can be computed from the finer, and tests do so. docs/reports/activity.md has
// the layout and says why it is so.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "forest/core/progress.h"
#include "forest/reports/code.h"
#include "forest/reports/layout.h"

namespace forest::reports {

/// One value each. Sections, branches and neurons have the mean of their compartments, weighted by length (what a branch
/// looks like from far away); `soma` is the compartment at the soma (what a raster shows).
enum class Level : std::uint8_t { compartment, section, branch, neuron, soma };
inline constexpr std::size_t level_count = 5;

/// A row of time level k is the greatest of 4^k steps: a spike lasts a millisecond and must not be lost, as it would in a
/// mean, when a hundred are skipped.
inline constexpr std::size_t time_factor = 4, time_level_count = 4;

/// One neuron of the report. The first entry of each level is counted over all neurons.
struct Row {
  std::uint64_t node_id = 0;
  std::uint32_t population = 0;  // in Facts::populations
  std::uint32_t instance = 0;    // of the circuit, and of its forest file
  std::uint32_t layout = 0;
  std::array<std::uint64_t, level_count> first{};  // its first value in each level
};

/// What a file says of itself.
struct Facts {
  std::string source, circuit;  // the report and the circuit it was packed from
  std::string units = "mV";
  std::vector<std::string> populations;
  std::uint64_t instances = 0;   // of the circuit
  double start = 0., step = 0.;  // ms
  std::uint64_t steps = 0;
  Range range;
  std::uint64_t clamped = 0, not_numbers = 0;  // values beyond the range; values that are none
  std::uint64_t spikes_left_out = 0;           // of neurons without a shape

  /// What colours show when nobody says what: −80…+20 mV, of other units all that is kept.
  Range shown() const { return units == "mV" ? Range{-80.f, 20.f} : range; }
  double time(std::uint64_t i) const { return start + double(i) * step; }  // ms
};

/// A layout as it lies in the file; as Layout.
struct LayoutView {
  std::uint32_t morphology = 0, soma = 0;
  std::span<const Compartment> compartments;
  std::span<const SectionRun> sections;
  std::span<const std::uint32_t> branches;

  /// The compartment whose middle is nearest to a place on a section (soma_run: the soma). None when that section has no
  /// compartment.
  std::optional<std::uint32_t> at(std::uint32_t section, float position) const;
  /// The same for a section as the report counts it, 0 for the soma.
  std::optional<std::uint32_t> at_element(std::uint32_t element, float position) const;
  /// For whoever maps many places: of each of `count` sections of the morphology, its entry in `sections`; all ones for
  /// one without compartments.
  std::vector<std::uint32_t> runs(std::size_t count) const;
  /// The branch of an entry of `sections`: its value in Level::branch, as the entry is its value in Level::section.
  std::uint32_t branch_of(std::size_t run) const {
    return std::uint32_t(std::ranges::upper_bound(branches, std::uint32_t(run)) - branches.begin());
  }
  /// Compartments [first, second) of an entry of `sections`.
  std::pair<std::uint32_t, std::uint32_t> compartments_of(std::size_t run) const {
    return {run ? sections[run - 1].end : 0, sections[run].end};
  }
};

/// The compartment of each place, for whoever colours segments. Where a section was not reported its nearest reported
/// ancestor's end answers for it, else the compartment at the soma: a soma report colours the whole neuron.
/// @param parents  of each section of the morphology; all ones for a root
std::vector<std::uint32_t> compartments_at(const LayoutView& layout, std::span<const std::uint32_t> parents,
                                           std::span<const Place> places);

/// What is wanted of one neuron: its place in Activity::rows(), and how closely it is looked at.
struct Wanted {
  std::uint32_t row = 0;
  Level level = Level::compartment;
};

struct PackOptions {
  Range range;
  std::uint32_t tile = 16384;  // values in a row of a tile, as near as whole neurons allow
};

/// Packs a report into a file, whole or not at all. Memory: the mapping and a few tiles, however long the report is. The
/// same report gives the same bytes at any number of threads. Throws InputError where the report does not fit the circuit.
void pack(const Report& report, const circuit::Circuit& circuit, std::span<const Morphology> morphologies,
          const Nodes& nodes, std::span<const Spikes> spikes, const std::filesystem::path& out,
          const PackOptions& options = {}, Progress& progress = Progress::none());

/// An open activity file; immutable, cheap to copy, safe in any thread. Its tables are checked when it is opened, the
/// values whenever they are touched: damage throws InputError, it is never shown.
class Activity {
 public:
  static Activity open(const std::filesystem::path& path);
  static Activity from_bytes(std::vector<std::byte> bytes, const std::string& name = "activity");

  const Facts& facts() const;
  std::span<const Row> rows() const;
  std::size_t layout_count() const;
  LayoutView layout(std::uint32_t index) const;
  std::uint64_t width(Level level) const;                     // values a step
  std::uint64_t count(std::uint32_t row, Level level) const;  // values of one neuron
  std::uint64_t row_count(std::size_t time_level) const;
  std::uint64_t bytes() const;
  /// The row of a neuron of the circuit, if it was reported.
  std::optional<std::uint32_t> row_of_instance(std::uint32_t instance) const;

  /// Codes [first, first + out.size()) of one level, at one row of one time level.
  void values(Level level, std::size_t time_level, std::uint64_t row, std::uint64_t first,
              std::span<Code> out) const;
  /// The same at a step of time.
  void values(Level level, std::uint64_t step, std::uint64_t first, std::span<Code> out) const {
    values(level, 0, step, first, out);
  }
  /// What a picture needs: the values of these neurons, one neuron after the other as they are listed, count() each, at one
  /// row of one time level. Only rows of tiles in which one of them lies are touched. `out` must be as long.
  void gather(std::span<const Wanted> wanted, std::size_t time_level, std::uint64_t row,
              std::span<Code> out) const;
  /// The greatest over steps [begin, end), from the coarsest rows that lie within: for pictures that stand for many.
  void greatest(std::span<const Wanted> wanted, std::uint64_t begin, std::uint64_t end,
                std::span<Code> out) const;
  /// … of values [first, first + out.size()) of a level.
  void greatest(Level level, std::uint64_t begin, std::uint64_t end, std::uint64_t first,
                std::span<Code> out) const;

  /// The virtual clamp: one value at every step.
  std::vector<Code> history(std::uint64_t compartment) const {
    return history(Level::compartment, compartment);
  }
  std::vector<Code> history(Level level, std::uint64_t value) const;

  /// All spikes, sorted by time; and those with begin <= time < end, ms.
  std::span<const Spike> spikes() const;
  std::span<const Spike> spikes(double begin, double end) const;

  /// Soma voltages, one line a neuron of rows(), one column a row of the time level: rows().size() × row_count.
  std::vector<Code> raster(std::size_t time_level = 0) const;
  /// The same as a picture, time to the right and neurons downwards, of steps [begin, end): width × height codes, rows from
  /// the top. A pixel that stands for several values has the greatest, so that no spike is lost.
  std::vector<Code> raster_picture(std::uint64_t begin, std::uint64_t end, std::uint32_t width,
                                   std::uint32_t height) const;

  /// Bytes of the file that were looked at since it was opened, its tables aside.
  std::uint64_t touched() const;
  /// Reads all of it. Throws InputError where it is damaged.
  void verify() const;

 private:
  struct Data;
  explicit Activity(std::shared_ptr<const Data> data) : data_(std::move(data)) {}
  void expect_steps(std::uint64_t begin, std::uint64_t end) const;
  static Activity check(std::shared_ptr<Data> data, std::span<const std::byte> bytes,
                        const std::string& name);
  std::shared_ptr<const Data> data_;
};

}  // namespace forest::reports
