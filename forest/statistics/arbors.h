// SPDX-License-Identifier: Apache-2.0
// What is measured of a neuron: its sections of some kinds, with what many metrics need computed once.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <memory>
#include <span>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "forest/morphology/morphology.h"

namespace forest::statistics {

class KindSet {
 public:
  constexpr KindSet(std::initializer_list<SectionKind> kinds) {
    for (const SectionKind kind : kinds) bits_ |= 1u << unsigned(kind);
  }
  static constexpr KindSet all() {
    KindSet set{};
    set.bits_ = ~0u;
    return set;
  }
  constexpr bool contains(SectionKind kind) const { return (bits_ >> unsigned(kind) & 1u) != 0; }
  constexpr KindSet operator|(KindSet other) const {
    other.bits_ |= bits_;
    return other;
  }
  constexpr bool operator==(const KindSet&) const = default;

 private:
  std::uint32_t bits_ = 0;
};

inline constexpr KindSet dendrites{SectionKind::basal, SectionKind::apical};

/// "all", "dendrite" (basal and apical) or the name of a kind ("axon"). Throws Error that lists these words.
KindSet kind_set(std::string_view word);

/// A section among those selected. Indices are into Arbors::sections().
struct Branch {
  SectionId id;
  std::int32_t parent = -1;     // -1 for a stem: a section whose parent is the soma, missing, or not selected
  std::uint32_t daughters = 0;  // 0 for a terminal
  std::uint32_t degree = 0;     // terminals at or beyond it
  int strahler = 0;             // Horton–Strahler order, 1 for a terminal
  std::uint32_t arbor = 0;      // which of Arbors::stems() it grows from
  std::uint32_t first_row = 0;  // of its points in Columns; there are as many as the section has
  std::uint32_t row_count = 0;
  double length = 0.;         // µm
  double area = 0.;           // µm², lateral
  double volume = 0.;         // µm³
  double path_distance = 0.;  // of its end from the start of its root in the whole neuron, µm

  std::size_t last_row() const { return std::size_t(first_row) + row_count - 1; }
};

/// The points of all sections, section after section, in columns that loops run over quickly. A segment has the row of the
/// point in which it ends.
struct Columns {
  std::vector<double> x, y, z, radius;  // µm
  std::vector<double> length;           // of the segment, µm; 0 at the first point of a section
  std::vector<double> path;             // of the point from the start of its root, µm
  std::vector<double> distance;         // of the point from the origin of the arbors, µm
};

/// A branch point with exactly two daughters.
struct Bifurcation {
  std::uint32_t parent, left, right;
};

/// Sections keep the neuron's order, parents first. Orders and path distances count from the soma whatever is
/// selected, so that an axon on a dendrite is as far from the soma as it is; stems, terminals and
/// bifurcations are those of the selected part, and an arbor is what grows from one stem.
///
/// For one thread at a time, because of once().
class Arbors {
 public:
  explicit Arbors(const Morphology& neuron, KindSet kinds = KindSet::all());

  const Morphology& neuron() const { return neuron_; }
  std::span<const Branch> sections() const { return sections_; }
  std::span<const Bifurcation> bifurcations() const { return bifurcations_; }
  const Branch& section(std::size_t index) const { return sections_[index]; }
  std::span<const std::uint32_t> stems() const { return stems_; }  // one an arbor
  const Columns& columns() const { return columns_; }
  std::span<const Point> points(const Branch& b) const { return neuron_.points(b.id); }

  /// What radial distances are measured from: the centre of the soma; without a soma the start of the first
  /// root.
  Point origin() const { return origin_; }

  /// What f(*this) returns, worked out when it is first asked for and kept, so that metrics can share work.
  template <auto f>
  const auto& once() const {
    static constexpr char key = 0;
    using Value = std::invoke_result_t<decltype(f), const Arbors&>;
    for (const auto& [kept_key, value] : kept_)
      if (kept_key == &key) return *static_cast<const Value*>(value.get());
    const auto value = std::make_shared<const Value>(f(*this));
    kept_.emplace_back(&key, value);
    return *value;
  }

 private:
  void measure(std::size_t rows);

  Morphology neuron_;
  std::vector<Branch> sections_;
  std::vector<Bifurcation> bifurcations_;
  std::vector<std::uint32_t> stems_;
  Columns columns_;
  Point origin_;
  mutable std::vector<std::pair<const void*, std::shared_ptr<const void>>> kept_;
};

}  // namespace forest::statistics
