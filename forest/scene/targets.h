// SPDX-License-Identifier: Apache-2.0
// Targets: named sets of the neurons of a forest. Types, layers, populations, "excitatory", "inhibitory", "glia" and "all" are
// targets by themselves; SONATA's node sets (circuit/node_sets.h) add others, and "L5 and not inhibitory" is one too.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "forest/circuit/node_sets.h"
#include "forest/scene/forest.h"

namespace forest::scene {

/// What a list of targets tells of one.
struct TargetFacts {
  std::string name;
  std::string origin;     // "node set", "type", "layer", "population", "sign" or "all"
  std::size_t count = 0;  // neurons
  std::string problem;    // why it cannot be used; "" when it can
};

/// What is known of the neurons of a forest by the names that node sets use: population, node_id, layer, mtype (also
/// pop_name, model_name), morphology, synapse_class, ei, source_population, model_type, and x, y, z of the soma in µm.
circuit::NodeTable node_table(const Forest& forest);

/// Not for several threads at once: it remembers what was asked for.
class Targets {
 public:
  explicit Targets(Forest forest, circuit::NodeSets sets = {});

  const Forest& forest() const { return forest_; }
  const circuit::NodeSets& sets() const { return sets_; }
  /// Replaces the node sets.
  void use(circuit::NodeSets sets);

  /// The neurons of a name or an expression (circuit::evaluate). A node set comes before what has its name by itself;
  /// "type:L5", "layer:L5", "population:L5", "set:L5" and "all:all" are never mistaken. Throws Error with one sentence.
  const circuit::Members& find(const std::string& expression) const;
  /// In the order of the file, then those that a forest has by itself.
  std::vector<TargetFacts> list() const;

 private:
  circuit::Members named(const std::string& name) const;
  std::string some_names() const;

  Forest forest_;
  circuit::NodeTable table_;
  circuit::NodeSets sets_;
  mutable circuit::KnownSets known_sets_;
  mutable std::map<std::string, circuit::Members> known_;  // expressions
};

}  // namespace forest::scene
