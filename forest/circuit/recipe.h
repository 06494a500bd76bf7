// SPDX-License-Identifier: Apache-2.0
// What to plant: a column, its layers, and which cell types stand in them. Written by people in TOML;
// docs/circuit/recipe.md describes the keys, data/recipes/ holds recipes that ship with the project.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "forest/circuit/circuit.h"
#include "forest/cortex/column.h"

namespace forest::circuit {

/// Neurons that were traced in a slice lie as flat in it as it became; they are stretched along z so many times.
struct SliceCorrection {
  static constexpr float most = 5.f;
  float factor = 1.f;     // 1 to `most`
  bool measured = false;  // instead of it what their dendrites say, all neurons of a population together

  bool operator==(const SliceCorrection&) const = default;
};
/// "measured", or a number. Throws Error for anything else.
SliceCorrection parse_slice_correction(std::string_view words);

struct Recipe {
  /// A layer and what stands in it. Its number of neurons is `count`, or else follows from `density`.
  struct Layer {
    std::string name;
    float thickness = 0.f;  // µm, > 0
    double density = 0.;    // neurons/mm³, >= 0
    std::optional<std::uint32_t> count;
    std::vector<double> mix;  // fraction of each of Recipe::types, in their order; sums to 1
  };

  /// How the neurons of a type are come by.
  struct Source {
    std::string
        grammar;  // by it they grow where they stand, among the others; empty: they come from its population
    std::optional<SliceCorrection> slice = {};  // the same of all types of a population
  };

  std::string name = "column";
  float radius = 0.f;  // of the column, µm; 0: of a tissue of which only densities are known
  std::vector<CellType> types;
  std::vector<Source> sources =
      {};  // one for each of `types`; a shorter vector stands for neurons as they are in populations
  std::vector<Layer> layers;  // from the pia downwards
  /// The exact number of neurons in all. Densities then only say how they are shared among the layers without
  /// a count.
  std::optional<std::uint32_t> neurons;
  float soma_gap = 0.f;  // least distance between the surfaces of two somata, µm, >= 0
  bool rotate = true;    // each neuron by a random angle about the vertical axis
};

/// Reads a recipe. Throws InputError (file, line, remedy): not TOML, an unknown or missing key, a number out
/// of range, a type that is not declared, fractions that do not sum to 1.
Recipe parse_recipe(std::string_view text, const std::string& file);
Recipe read_recipe(const std::filesystem::path& path);

/// How the neurons of a type are come by, also where `sources` is shorter.
const Recipe::Source& source_of(const Recipe& recipe, std::size_t type);

/// Throws Error that says which of the sentences above is violated.
void check(const Recipe& recipe);

/// The column a recipe speaks of. Throws Error where it speaks of none.
cortex::Column column(const Recipe& recipe);
/// Its layers, from the pia downwards; y is 0 at their lower end.
std::vector<cortex::Slab> slabs(const Recipe& recipe);

/// The number of neurons to plant, exactly: [layer][type]. Whole numbers by largest remainder, first among
/// the layers, then among the types of a layer. Throws Error when the explicit counts exceed `neurons`, or it speaks of no column.
std::vector<std::vector<std::uint32_t>> counts(const Recipe& recipe);

/// Shares out `total` in proportion to `weights` (>= 0) by Hamilton's method of largest remainders: the sum
/// is exact and no share is a whole unit away from its proportion. Ties go to the first. All weights 0 gives
/// shares of 0.
std::vector<std::uint32_t> apportion(std::uint32_t total, std::span<const double> weights);

/// Whole numbers for expected ones (>= 0): each, and their sum, is the next one below or above, and over many lots the mean is what was
/// expected, so that what is expected to be a tenth is there in one case of ten. Systematic sampling: along a ruler of expected numbers
/// the marks lot, lot + 1, lot + 2, … are counted (Madow & Madow 1944, "On the theory of systematic sampling").
/// @param lot  in [0, 1)
std::vector<std::uint32_t> apportion_by_lot(std::span<const double> expected, double lot);

/// A recipe in which a new type takes `fraction` of every layer whose lower limit is at least `height` µm under the pia,
/// the others making room in proportion.
Recipe with_type(Recipe recipe, CellType type, double fraction, float height = 0.f);

}  // namespace forest::circuit
