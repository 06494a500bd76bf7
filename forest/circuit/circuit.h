// SPDX-License-Identifier: Apache-2.0
// A planted tissue as plain data: which neuron stands where. At rest it is a SONATA circuit (io/sonata.h).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "forest/core/vec.h"

namespace forest::circuit {

/// One row of node_types.csv: what the instances of a type share.
struct CellType {
  std::string name;        // for example "L5 pyramidal"
  std::string population;  // of the repository, where its neurons come from
  bool excitatory = true;  // of glia without meaning
  bool glia = false;       // astrocytes, microglia, …: no neurons, they make no synapses

  bool operator==(const CellType&) const = default;
};

/// A layer of the tissue, from the pia downwards. y is 0 at the white matter and grows towards the pia.
struct Layer {
  std::string name;               // "L2/3"
  float bottom = 0.f, top = 0.f;  // y of its limits, µm

  bool operator==(const Layer&) const = default;
};

/// One planted neuron. A point p of its morphology (soma centre at the origin) stands at position +
/// orientation * p.
struct Instance {
  Vec3 position = Vec3::Zero();  // of the soma, µm
  Quat orientation = Quat::Identity();
  std::uint32_t morphology = 0;  // index in Circuit::morphologies
  std::uint32_t type = 0;        // index in Circuit::types
  std::uint32_t layer = 0;       // index in Circuit::layers

  bool operator==(const Instance&) const = default;
};

/// Where in the finite elements of a cortex (cortex/elements.h) a soma has its centre.
struct InElement {
  std::uint32_t element = 0;  // its number in the file of elements
  Vec3 uvw = Vec3::Zero();    // 0 to 1
  float depth = 0.f;          // below the pia, µm along w

  bool operator==(const InElement&) const = default;
};

struct Circuit {
  std::string name = "column";
  std::vector<Layer> layers;
  std::vector<CellType> types;
  std::vector<std::string> morphologies;  // names; the neurons themselves travel beside the circuit
  std::vector<Instance> instances;
  float radius = 0.f;  // of the column about the y axis, µm; 0 when the tissue is no column
  std::vector<InElement> in_elements = {};  // of each instance; empty: the tissue has no elements
  std::vector<std::vector<Vec3>> outline =
      {};                   // lines that bound elements, µm; of a column radius and layers say it
  Vec3 up = Vec3::UnitY();  // towards the pia, in the mean

  bool operator==(const Circuit&) const = default;
};

/// Throws Error that names the first layer, type, morphology or instance that is wrong: a layer without
/// thickness, a name that is empty or used twice, an index beyond its list, a position that is not finite, an
/// orientation that is no rotation, a line of the outline or a way up that is not finite.
void check(const Circuit& circuit);

/// How many neurons of one type stand in one layer.
struct Tally {
  std::uint32_t layer = 0, type = 0;  // indices
  std::size_t count = 0;              // > 0
  double density = 0.;                // per mm³ of the layer; 0 when the tissue is no column

  bool operator==(const Tally&) const = default;
};

/// In the order of layers, then types; what does not occur is left out.
std::vector<Tally> tally(const Circuit& circuit);

}  // namespace forest::circuit
