// SPDX-License-Identifier: Apache-2.0
// What N++ fitted to a population, under its names, three families of conditional distributions: the nontermination of
// segments, their trajectory and length, and the rotations at bifurcations. The calibre (diameters) stands beside them.
// A segment of N++ is a section here.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "forest/core/progress.h"
#include "forest/statistics/arbors.h"
#include "forest/statistics/conditional.h"

namespace forest::statistics {

/// What a distribution may be asked for. Of a section's length and trajectory they are meant at its beginning, of its end
/// and of the bifurcation there at its end.
enum class Given : std::uint8_t { nothing, order, path, radius, height };
std::string_view name_of(Given given);  // "order", the name of the parameter in texts
std::string_view unit_of(Given given);
std::optional<Given> given_of(std::string_view word);

/// Values of one thing over a population, with what they may depend on.
struct Quantity {
  enum Family : std::uint8_t { trajectory, rotations, calibre } family;
  std::string_view name, unit, meaning;
  bool angles = false;
  std::optional<double> least = {}, most = {};  // beyond which there is none
  std::vector<double> values;                   // NaN is left out
  std::vector<std::array<double, 4>>
      places;  // of each value: order, path (µm), radius (µm), height (µm, above the soma)
};
std::string_view name_of(Quantity::Family family);

/// What the sections of a population are, before anything is fitted.
struct SegmentValues {
  std::size_t cells = 0;
  std::vector<char> forks;                    // of each section: 1 where it forks, 0 where it ends
  std::vector<std::array<double, 4>> places;  // of its end
  std::vector<Quantity> quantities;
};
SegmentValues segment_values(std::span<const Morphology> cells, KindSet kinds = dendrites);

struct FamilyOptions {
  KindSet kinds = dendrites;
  Given given = Given::nothing;  // what trajectories and rotations are fitted by, besides at once
  Binning binning = {};
  FitOptions fit = {};
};

struct FittedQuantity {
  Quantity::Family family;
  std::string_view name, unit, meaning;
  DistributionFit fit;
  struct Bin {
    double upper;
    DistributionFit fit;  // of one family, with its atoms
  };
  std::vector<Bin> bins;     // by FamilyOptions::given
  std::string distribution;  // its text in the notation, without a family where `given` is something
};

struct SegmentFamilies {
  std::size_t cells = 0, sections = 0;
  ParameterEstimate nontermination;  // the chance that a section forks
  struct Table {
    Given given;
    std::vector<ChanceBin> bins;
  };
  std::vector<Table> tables;  // by order, path, radius and height
  std::vector<FittedQuantity> quantities;

  /// Each by its name as declarations that stand alone, as a repository keeps them: "nontermination_by_order", …
  std::vector<std::pair<std::string, std::string>> texts() const;
};

/// All families of a population. What cannot be said (no bifurcation, no radius) has a count of 0.
SegmentFamilies segment_families(std::span<const Morphology> cells, const FamilyOptions& options = {},
                                 Progress& progress = Progress::none());

}  // namespace forest::statistics
