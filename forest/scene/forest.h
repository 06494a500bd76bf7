// SPDX-License-Identifier: Apache-2.0
// The forest file: a planted circuit packed for drawing, mapped into memory and used as it lies there. Distinct neurons
// are stored once, as cluster trees; planted ones are a place, a turn and a number. Layout: docs/scene/forest_file.md.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "forest/circuit/circuit.h"
#include "forest/circuit/node_sets.h"
#include "forest/core/progress.h"
#include "forest/frame/frame.h"
#include "forest/morphology/morphology.h"
#include "forest/scene/brick.h"
#include "forest/scene/cluster.h"
#include "forest/scene/grove.h"

namespace forest::scene {

/// One distinct neuron. Indices are into the arrays of the whole forest.
struct Neuron {
  std::uint32_t first_cluster = 0, cluster_count = 0;
  std::uint32_t first_segment = 0,
                original_count = 0;  // the original segments; segment 0 of a neuron with soma is it
  std::uint32_t first_original = 0;  // of them, in section_of_segment
  std::uint32_t first_section = 0, section_count = 0;
  float soma_radius = 0.f;  // µm
};

/// What is told of a section when it is picked, and shown in colours (gauge.h).
struct SectionFacts {
  std::uint32_t parent = 0xffffffffu;  // within its neuron; all ones for a stem
  std::uint32_t kind = 0;              // as SectionKind
  std::uint32_t order = 0;
  std::uint32_t daughters = 0;
  float length = 0.f;                              // µm
  float diameter_start = 0.f, diameter_end = 0.f;  // µm
  float path_distance = 0.f;                       // from the soma to its end, µm
};

static_assert(sizeof(Neuron) == 32 && sizeof(SectionFacts) == 32);

/// A planted neuron, with what is asked of it first.
struct Standing {
  Sphere sphere;  // around all that belongs to it
  frame::Instance instance;
  std::uint32_t index;  // of the instance
};

/// Packs a circuit. `neurons[i]` is the one named circuit.morphologies[i]. The same input gives the same bytes.
/// @param nodes  what SONATA calls the instances; without runs: 0, 1, 2, … of a population named as the circuit
std::vector<std::byte> pack(const circuit::Circuit& circuit, std::span<const Morphology> neurons,
                            Progress& progress = Progress::none(), const circuit::NodeNames& nodes = {});

/// Gives the distinct neuron named circuit.morphologies[index]. Asked once for each, by several threads at a time.
using NeuronSource = std::function<Morphology(std::size_t index)>;

struct PackFigures {
  std::uint64_t segments = 0;       // original ones of the distinct neurons
  std::uint64_t segment_total = 0;  // of all instances, as if each were stored
  std::uint64_t bytes = 0;          // of the file
};

/// The same, bytes and all, into a file and with neurons that need not fit into memory: each is asked for when its turn
/// comes, and a few dozen are there at a time. The file is there whole or not at all (core/file.h).
PackFigures pack(const circuit::Circuit& circuit, const NeuronSource& source,
                 const std::filesystem::path& out, Progress& progress = Progress::none(),
                 const circuit::NodeNames& nodes = {});

/// An open forest file; immutable, cheap to copy.
class Forest {
 public:
  /// Checks length, version, checksums and every index; throws InputError with one sentence.
  static Forest open(const std::filesystem::path& path);
  /// The same over bytes in memory. `name` stands for the file in errors.
  static Forest from_bytes(std::vector<std::byte> bytes, const std::string& name = "forest");

  std::span<const frame::Segment> segments() const;
  std::span<const frame::Instance> instances() const;
  std::span<const Cluster> clusters() const;
  std::span<const Neuron> neurons() const;
  std::span<const std::uint32_t> section_of_segment() const;
  std::span<const SectionFacts> sections() const;
  std::span<const reports::Place> places()
      const;  // of every segment that is no straw: the middle of what it stands for
  std::span<const Brick> bricks() const;  // the one around all first; none in a forest without branches
  std::span<const frame::Owner> owners() const;   // of the straws, which are the last segments
  std::span<const std::uint32_t> types() const;   // of every instance: index in circuit().types
  std::span<const std::uint32_t> layers() const;  // of every instance: index in circuit().layers

  /// Names, types, layers and radius; its instances are left empty, they are above.
  const circuit::Circuit& circuit() const;
  const circuit::NodeNames& nodes() const;  // of all instances, in their order
  const Bounds& soma_bounds() const;        // of all soma centres
  const Mat3& soma_spread() const;          // their covariance, µm²
  float mean_reach() const;                 // µm, of the neurons: of the radii of spheres()
  /// circuit()'s layers that have a height, where the somata lie among them: in curved tissue they do not.
  std::vector<circuit::Layer> layers_in_place() const;
  std::span<const Sphere> spheres() const;  // of every instance: around all that belongs to it
  const Groves& groves() const;             // of these spheres
  std::span<const Standing> standing()
      const;                            // of every member of the groves: neighbours lie together in memory
  std::uint64_t segment_total() const;  // original segments of all instances, as if each were stored
  std::uint64_t bytes() const;          // of the file
  frame::Geometry geometry() const { return {segments(), instances(), owners()}; }

 private:
  struct Data;
  explicit Forest(std::shared_ptr<const Data> data) : data_(std::move(data)) {}
  static Forest check(std::shared_ptr<Data> data, std::span<const std::byte> bytes, const std::string& name);
  std::shared_ptr<const Data> data_;
};

/// One past the last segment that a neuron's clusters draw.
std::uint32_t end_of(const Forest& forest, const Neuron& neuron);

}  // namespace forest::scene
