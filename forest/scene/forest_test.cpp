// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/forest.h"

#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/parallel.h"

#include "tests/sample_forest.h"

namespace forest::scene {
namespace {

using testing::sample_circuit;
using testing::sample_neurons;

TEST(ForestFile, HoldsWhatWasPacked) {
  const auto circuit = sample_circuit();
  const auto neurons = sample_neurons();
  const Forest f = Forest::from_bytes(pack(circuit, neurons));
  ASSERT_EQ(f.instances().size(), circuit.instances.size());
  EXPECT_EQ(f.circuit().morphologies, circuit.morphologies);
  EXPECT_EQ(f.circuit().layers, circuit.layers);
  EXPECT_EQ(f.circuit().types, circuit.types);
  for (std::size_t i = 0; i < circuit.instances.size(); ++i) {
    EXPECT_EQ(f.instances()[i].x, circuit.instances[i].position.x());
    EXPECT_EQ(f.types()[i], circuit.instances[i].type);
    EXPECT_EQ(f.layers()[i], circuit.instances[i].layer);
  }
  for (std::size_t n = 0; n < neurons.size(); ++n) {
    ASSERT_EQ(f.neurons()[n].section_count, neurons[n].sections().size());
    for (std::size_t s = 0; s < neurons[n].sections().size(); ++s)
      EXPECT_EQ(f.sections()[f.neurons()[n].first_section + s].kind,
                std::uint32_t(neurons[n].sections()[s].kind));
  }
}

TEST(ForestFile, IsTheSameAtAnyNumberOfThreads) {
  const auto circuit = sample_circuit();
  const auto neurons = sample_neurons();
  const auto all = pack(circuit, neurons);
  const ThreadLimit one(1);
  EXPECT_EQ(all, pack(circuit, neurons));
}

TEST(ForestFile, CutShortAtAnyByteIsRefused) {
  const auto bytes = pack(sample_circuit(3),
                          std::vector<Morphology>{testing::random_tree(1, 5), Morphology(), Morphology()});
  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_THROW(Forest::from_bytes({bytes.begin(), bytes.begin() + std::ptrdiff_t(size)}), InputError)
        << size;
  EXPECT_NO_THROW(Forest::from_bytes(bytes));
}

TEST(ForestFile, AnyChangedByteIsRefused) {
  const auto bytes = pack(sample_circuit(3),
                          std::vector<Morphology>{testing::random_tree(1, 5), Morphology(), Morphology()});
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    auto damaged = bytes;
    damaged[i] ^= std::byte{0x41};
    EXPECT_THROW(Forest::from_bytes(std::move(damaged)), InputError) << i;
  }
}

TEST(ForestFile, RefusesACircuitThatDoesNotFitItsNeurons) {
  EXPECT_THROW(pack(sample_circuit(), std::vector<Morphology>{Morphology()}), Error);
  auto circuit = sample_circuit();
  circuit.instances[2].morphology = 99;
  EXPECT_THROW(pack(circuit, sample_neurons()), Error);
}

TEST(ForestFile, AnEmptyCircuitIsAForest) {
  circuit::Circuit empty;
  const Forest f = Forest::from_bytes(pack(empty, {}));
  EXPECT_TRUE(f.instances().empty());
  EXPECT_EQ(f.segment_total(), 0u);
}

}  // namespace
}  // namespace forest::scene
