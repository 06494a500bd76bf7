// SPDX-License-Identifier: Apache-2.0
// Planting in curved elements: a hemisphere as a rule rather than a list. The neurons of an element follow from (element, recipe,
// candidates, seed) alone, whichever others are asked for and in whatever order.
//
// Layers are slices of the element: a layer of a tenth of the recipe's thickness takes a tenth of the depth, which is a share
// of volume (cortex/depth.h); or they end where they were measured (cortex/borders.h). A recipe's densities hold per mm³ of tissue; in a recipe with counts they are those of its column.
//
// Places come from packings (cortex/packing.h), one for each layer, that fill all space whether there is tissue or not: an element
// has those that lie in it, a few more than it needs, and takes as many as are wanted by lot. So somata do not overlap in an
// element nor across the faces of neighbours, and no face shows as a sheet without somata (a margin of a radius on both sides of
// every face would be simpler, and could be seen). Where two layers meet only cells with narrow somata stand, and the denser layer
// leaves out what would touch any place of the sparser one, also one not taken: this rarefies it within a soma's width of the border.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "forest/circuit/plant.h"
#include "forest/circuit/recipe.h"
#include "forest/core/random.h"
#include "forest/cortex/borders.h"
#include "forest/cortex/depth.h"
#include "forest/cortex/hexahedron.h"
#include "forest/cortex/packing.h"

namespace forest::circuit {

struct ElementPlanting {
  double scale = 1.;     // of all densities
  double element = 1e9;  // µm³, an element's usual volume: smaller layers get more places to choose from
  bool bent =
      false;  // arbors will be bent by the grid: what is above a soma is stretched as the grid is there
};

/// A neuron in an element. `turn` is its angle about its own axis, as in cortex::Seat.
struct Rooted {
  Eigen::Vector3d uvw = Eigen::Vector3d::Zero();
  double turn = 0.;
  Vec3 position = Vec3::Zero();  // of the soma, µm
  float depth = 0.f;             // of the soma below the pia, µm along w
  Quat orientation = Quat::Identity();
  std::uint32_t candidate = 0, type = 0, layer = 0;
};

/// Neurons/mm³ over all layers of a recipe: by their thickness, or where they have volumes of their own.
double mean_density(const Recipe& recipe);
double mean_density(const Recipe& recipe, std::span<const double> volumes);

class ElementPlanter {
 public:
  /// The candidates must outlive it. Somata are taken as wide as the widest of their layer; candidates whose somata are too wide for
  /// a layer's density are left out there, as long as others of their type are not.
  /// Throws Error when a population has no candidate, and when somata of a layer do not fit at its density.
  ElementPlanter(const Recipe& recipe, std::span<const Candidate> candidates, std::uint64_t seed,
                 const ElementPlanting& options = {});

  /// Depths where the layers end; the first begins at 0 and the last ends at 1.
  std::span<const double> depths() const { return depths_; }
  /// Candidates with somata too wide.
  std::size_t left_out(std::size_t layer) const { return left_out_[layer]; }
  double widest(std::size_t layer) const { return radii_[layer]; }       // soma, radius in µm
  double density(std::size_t layer) const { return densities_[layer]; }  // neurons/mm³, scaled

  /// How many neurons an element has, [layer][type]: each number is within one of what the densities say, and which ones are rounded up is
  /// drawn for every element, so that many elements together have what the densities say of each layer and type, however rare.
  /// @param number  of the element
  std::vector<std::vector<std::uint32_t>> counts(const cortex::Hexahedron& element, std::size_t number,
                                                 const cortex::Borders& borders) const;
  std::vector<std::vector<std::uint32_t>> counts(const cortex::Hexahedron& element, std::size_t number,
                                                 const cortex::Layers& layers = {}) const {
    return counts(element, number, by_volume(layers));
  }

  /// In the order of layers, then types. A neuron is one of its type's that end under the pia at its place, or the lowest one.
  /// A layer that has room for fewer somata than counts() says, as where an element is thin, has those that fit, of each type its share.
  /// @param number  of the element
  std::vector<Rooted> plant(const cortex::Hexahedron& element, std::size_t number,
                            const cortex::Borders& borders) const;
  std::vector<Rooted> plant(const cortex::Hexahedron& element, std::size_t number,
                            const cortex::Layers& layers = {}) const {
    return plant(element, number, by_volume(layers));
  }

  /// The recipe's layers by shares of volume.
  cortex::Borders by_volume(const cortex::Layers& layers) const { return {layers, depths_}; }

 private:
  struct Spot;
  double room_for_soma(std::size_t layer, const Spot& spot) const;
  std::uint32_t choose(std::span<const std::uint32_t> choice, double height, double radius,
                       Random& random) const;

  Recipe recipe_;
  std::span<const Candidate> candidates_;
  std::uint64_t seed_;
  bool bent_;
  std::vector<double> depths_, densities_;  // of layers
  std::vector<double> radii_,
      narrow_;  // of their widest somata, and of those that stand by their borders, µm
  std::vector<std::vector<std::vector<std::uint32_t>>>
      choices_;  // of layers and types: candidates, the lowest first
  std::vector<std::size_t> left_out_;
  std::vector<std::optional<cortex::Packing>> packings_;  // of layers; none where nothing grows
  std::vector<std::vector<std::uint32_t>> sparser_;       // of layers: those that they leave room for
};

/// The neurons of some elements as one circuit, in their order. Layers are curved; they reach from where their lowest soma is to
/// where their highest one is.
/// @param elements  their numbers
/// @param first     the first neuron of each among `rooted`, and how many there are in all
/// @param candidates, rooted  those of an ElementPlanter, and what it planted
Circuit circuit_of(const Recipe& recipe, std::span<const Candidate> candidates,
                   std::span<const std::uint32_t> elements, std::span<const std::size_t> first,
                   std::span<const Rooted> rooted);

}  // namespace forest::circuit
