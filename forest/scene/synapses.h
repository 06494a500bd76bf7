// SPDX-License-Identifier: Apache-2.0
// Synapses of a forest: small spheres on the branches that they contact. They lie in a file of their own beside the forest
// file, mapped into memory, as a tree of bundles in space (docs/scene/synapses.md).
//
// Which of them are drawn is "stochastic simplification" (Cook, Halstead, Planck & Ryu 2007) with a tree. Each synapse has a
// rank, drawn by lot, in [0, 1). One of r pixels is shown where its rank is below f = 2 (r / 0.75)²: all from three quarters
// of a pixel on, farther away ever fewer, whose areas grow so that on the mean all of it is kept. The area of one that
// is about to leave falls to nothing, so none is seen to go. An inner bundle holds the lowest ranks of all below it; where f
// is less than the last of them nothing below is looked at. What is far costs little, whatever the number of synapses.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "forest/circuit/synapses.h"
#include "forest/core/progress.h"
#include "forest/scene/colouring.h"
#include "forest/scene/forest.h"
#include "forest/scene/level.h"

namespace forest::scene {

/// A contact, laid out for the file.
struct Synapse {
  static constexpr std::uint8_t sign_mask = 3, outside = 4;  // of flags

  float x = 0.f, y = 0.f, z = 0.f;  // its centre in the world, µm
  std::uint32_t target = 0;         // instance
  std::uint32_t segment = 0;  // original segment of the target that it is on, counted from the neuron's first
  std::uint32_t source = 0;   // instance; or, outside, a node of the projection's source population
  std::uint32_t id = 0;       // projections count theirs one after the other; makes the rank
  std::uint16_t position = 0;  // along its section, in 65535ths
  std::uint8_t radius = 0;     // in 64ths of a µm
  std::uint8_t flags = 0;      // circuit::Sign, outside

  Vec3 centre() const { return {x, y, z}; }
  circuit::Sign sign() const { return circuit::Sign(flags & sign_mask); }
  float radius_um() const { return float(radius) / 64.f; }
  double rank() const { return double(frame::forest_mixed(id)) * 0x1p-32; }  // in [0, 1)
};
static_assert(sizeof(Synapse) == 32);

/// Synapses that lie near one another, and a sphere around them.
struct Bundle {
  float x = 0.f, y = 0.f, z = 0.f, radius = 0.f;  // µm
  std::uint32_t first = 0, count = 0;             // of a leaf into synapses, else into samples; by rank
  std::uint32_t first_child = 0, children = 0;    // bundles; none: a leaf
  float largest = 0.f;                            // radius of a synapse, µm
  std::uint32_t zero = 0;

  Sphere sphere() const { return {{x, y, z}, radius}; }
};
static_assert(sizeof(Bundle) == 40);

/// One population of synapses, as the file names it.
struct ProjectionFacts {
  std::string name, source, target;    // of the edges, and the populations of nodes
  std::uint32_t first = 0, count = 0;  // Synapse::id of its own
};

/// Share of its area that a synapse is drawn with: none from rank >= f on, more than 1 where it stands for others. The
/// mean over all ranks is 1 for every f > 0.
float synapse_weight(double rank, double f);

/// The synapses of one forest, from an open file; immutable.
class Synapses {
 public:
  /// Attaches synapses to the branches of a forest. Those said by section and position lie on the surface there, on a side
  /// drawn by lot unless the side is said, too; others at their place, on the segment of their target nearest to it.
  /// The same input gives the same bytes.
  /// Throws InputError (the projection) for a neuron or section that the forest does not have, a position that is none.
  static std::vector<std::byte> make(const Forest& forest, std::span<const circuit::Projection> projections,
                                     Progress& progress = Progress::none());

  /// Throws InputError with one sentence: damaged, of another version, made for another forest.
  static Synapses open(const std::filesystem::path& path, const Forest& forest);
  static Synapses from_bytes(std::vector<std::byte> bytes, const Forest& forest,
                             const std::string& name = "synapses");
  /// Where the synapses of a forest file are looked for: column.forest has column.synapses.
  static std::filesystem::path beside(const std::filesystem::path& forest_file);

  std::span<const Synapse> all() const;
  std::span<const Bundle> bundles() const;  // the root is the last
  const std::vector<ProjectionFacts>& projections() const;
  const Forest& forest() const;
  /// Which projection a synapse is of.
  const ProjectionFacts& projection(const Synapse& synapse) const;
  /// Section of the target, or soma_section.
  std::uint32_t section(const Synapse& synapse) const;

  struct Choice {
    std::vector<frame::Ball> balls;
    std::vector<std::uint32_t> synapses;  // of each ball: its index in all()
  };
  /// Those that a picture shows. None of a neuron or branch that is hidden, or that shows its soma alone; of a branch that
  /// a picture of one sample leaves out for its like (Detail::thinnest) none either. Pure, the same at any number of threads.
  /// @param colour  by sign, or as the branch that they are on
  /// @param most  about: where more would be in sight each stands for more others
  Choice choose(const Eye& eye, const Colouring& colouring, SynapseColour colour,
                std::size_t most = 400'000) const;

 private:
  struct Data;
  explicit Synapses(std::shared_ptr<const Data> data) : data_(std::move(data)) {}
  static Synapses check(std::shared_ptr<Data> data, std::span<const std::byte> bytes,
                        const std::string& name);
  std::shared_ptr<const Data> data_;
};

/// Their colours on a background: entries from synapse_entry on, in the order of circuit::Sign.
void paint_synapses(frame::Palette& palette, Background background);
/// What they mean.
std::vector<LegendEntry> synapse_legend(Background background);

/// The synapse whose ball lies under a place of the picture, to `reach` pixels beside it: the nearest to the eye. Whether
/// branches hide it is not asked.
struct SynapsePick {
  std::uint32_t synapse = 0;  // in Synapses::all()
  double distance = 0.;       // along the ray, µm
};
std::optional<SynapsePick> pick(const Synapses::Choice& choice, const frame::Camera& camera,
                                const frame::Viewport& viewport, const Vec2& place, float reach = .5f);

}  // namespace forest::scene
