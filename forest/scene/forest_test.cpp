// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/forest.h"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <unistd.h>

#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/parallel.h"
#include "forest/scene/cut.h"
#include "forest/scene/pick.h"
#include "forest/scene/view.h"

#include "tests/checksums.h"
#include "tests/refused.h"
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

class PackedFile : public ::testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directories(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::ptrdiff_t entries() const { return std::distance(std::filesystem::directory_iterator(folder_), {}); }
  const std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("forest_pack_test." + std::to_string(::getpid()));
  const std::filesystem::path file_ = folder_ / "a.forest";
};

// Enough that every part that waits goes to the disk on its way.
circuit::Circuit many(std::size_t count) {
  circuit::Circuit c = sample_circuit(3 * count);
  c.morphologies.clear();
  for (std::size_t i = 0; i < count; ++i) c.morphologies.push_back("neuron " + std::to_string(i));
  for (std::size_t i = 0; i < c.instances.size(); ++i) c.instances[i].morphology = std::uint32_t(i % count);
  return c;
}
Morphology one_of_many(std::size_t index) { return testing::random_tree(index, int(index % 400)); }

TEST_F(PackedFile, IsThatOfMemoryByteForByteAtAnyNumberOfThreads) {
  constexpr std::size_t count = 300;
  const circuit::Circuit circuit = many(count);
  std::vector<Morphology> neurons;
  for (std::size_t i = 0; i < count; ++i) neurons.push_back(one_of_many(i));
  const auto memory = pack(circuit, neurons);
  const Forest forest = Forest::from_bytes(memory);
  ASSERT_GT(std::as_bytes(forest.places()).size(), 2u << 20);
  for (const unsigned threads : {1u, 2u, 7u}) {
    const ThreadLimit limit(threads);
    const PackFigures figures = pack(circuit, one_of_many, file_);
    const MappedFile file(file_);
    EXPECT_TRUE(std::ranges::equal(file.bytes(), memory)) << threads;
    EXPECT_EQ(figures.bytes, memory.size());
    EXPECT_EQ(figures.segments, forest.section_of_segment().size());
    EXPECT_EQ(figures.segment_total, forest.segment_total());
    EXPECT_EQ(entries(), 1);
  }
}

TEST_F(PackedFile, MayHoldNothing) {
  const PackFigures figures = pack(circuit::Circuit{}, one_of_many, file_);
  EXPECT_EQ(figures.bytes, std::filesystem::file_size(file_));
  EXPECT_EQ(Forest::open(file_).segment_total(), 0u);
}

TEST_F(PackedFile, NeuronsAreAskedForOnceEachAndNoneLongBeforeItsTurn) {
  constexpr std::size_t count = 2000;
  std::vector<std::atomic<int>> asked(count);
  struct : Progress {
    void begin(std::string_view, std::size_t) override {}
    void advance(std::size_t steps) override { written += steps; }
    void end() override {}
    std::atomic<std::size_t> written = 0;
  } progress;
  std::atomic<std::size_t> ahead = 0;
  pack(
      many(count),
      [&](std::size_t i) {
        ++asked[i];
        const std::size_t written = progress.written;
        for (std::size_t most = ahead;
             i > written + most && !ahead.compare_exchange_weak(most, i - written);) {
        }
        return testing::random_tree(i, 3);
      },
      file_, progress);
  for (const auto& times : asked) EXPECT_EQ(times, 1);
  EXPECT_LT(ahead, 128u);
}

TEST_F(PackedFile, ASourceThatFailsLeavesWhatWasThere) {
  const auto fails = [](std::size_t i) {
    if (i == 150) throw InputError("bad.swc", 7, "is no neuron");
    return one_of_many(i);
  };
  EXPECT_THROW(pack(many(300), fails, file_), InputError);
  EXPECT_EQ(entries(), 0);
  write_file(file_, "what was there");
  EXPECT_THROW(pack(many(300), fails, file_), InputError);
  EXPECT_EQ(MappedFile(file_).text(), "what was there");
  EXPECT_EQ(entries(), 1);
  auto wrong = many(3);
  wrong.instances[2].morphology = 99;
  EXPECT_THROW(pack(wrong, one_of_many, file_), Error);
  EXPECT_THROW(pack(many(3), one_of_many, folder_ / "no" / "where.forest"), Error);
  EXPECT_EQ(MappedFile(file_).text(), "what was there");
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

// The walk over a neuron relies on it.
TEST(ForestFile, ATreeOfClustersThatIsNoTreeOfItsNeuronIsRefused) {
  const auto bytes = pack(sample_circuit(), sample_neurons());
  layout::Header header;
  std::memcpy(&header, bytes.data(), sizeof header);
  const layout::Entry& part = header.table[layout::clusters];
  const Forest whole = Forest::from_bytes(bytes);
  const Neuron& first = whole.neurons()[0];
  ASSERT_GT(first.cluster_count, 4u);
  const auto refused = [&](std::uint32_t cluster, auto&& change) {
    auto changed = bytes;
    Cluster c = whole.clusters()[cluster];
    change(c);
    std::memcpy(&changed[part.offset + cluster * sizeof c], &c, sizeof c);
    testing::put_forest_right(changed);
    return !forest::refused([&] { Forest::from_bytes(std::move(changed)); }).empty();
  };
  const auto refused_with = [&](std::uint32_t cluster, std::uint32_t a, std::uint32_t b) {
    return refused(cluster, [&](Cluster& c) { c.children[0] = a, c.children[1] = b; });
  };
  const auto [a, b] = whole.clusters()[0].children;
  EXPECT_FALSE(refused_with(0, a, b));
  EXPECT_TRUE(refused_with(0, a, first.cluster_count));  // the next neuron's first
  EXPECT_TRUE(refused_with(0, 0, 0));                    // a leaf before the others
  const std::uint32_t last = first.cluster_count - 1;
  EXPECT_TRUE(refused_with(last - 2, last - 1, last));  // a leaf with children
  EXPECT_TRUE(refused_with(0, a, a));                   // twice
  EXPECT_TRUE(refused_with(0, a, last));                // of two parents
  const auto first_segment = [&](std::uint32_t segment) {
    return refused(last, [&](Cluster& c) { c.first_segment = segment; });
  };
  EXPECT_FALSE(first_segment(first.first_segment));
  EXPECT_TRUE(first_segment(first.first_segment + first.original_count));  // a coarser one's
  EXPECT_TRUE(first_segment(whole.neurons()[1].first_segment));            // the next neuron's
  const std::uint32_t own = first.cluster_count;
  EXPECT_TRUE(refused(own + whole.neurons()[1].cluster_count - 1,
                      [&](Cluster& c) { c.first_segment = first.first_segment; }));
}

// Checksums tell of accidents, not of intent.
TEST(ForestFile, WhatIsChangedBehindRightChecksumsIsRefusedOrCanBeSeen) {
  const auto bytes = pack(sample_circuit(3),
                          std::vector<Morphology>{testing::random_tree(1, 5), Morphology(), Morphology()});
  auto same = bytes;
  testing::put_forest_right(same);
  EXPECT_EQ(same, bytes);
  std::size_t refused = 0, seen = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i)
    for (const std::byte change : {std::byte{1}, std::byte{0xff}}) {
      auto changed = bytes;
      changed[i] ^= change;
      testing::put_forest_right(changed);
      try {
        const Forest f = Forest::from_bytes(std::move(changed));
        View view = overview(f);
        for (const float thinnest : {0.f, 2.f}) {
          view.detail.thinnest = thinnest;
          (void)choose(f, Eye(view.camera, {320, 200}, view.detail));
        }
        (void)pick(f, view.camera, {320, 200}, {160, 100});
        ++seen;
      } catch (const InputError&) {
        ++refused;
      }
    }
  EXPECT_GT(refused, 100u);
  EXPECT_GT(seen, 100u);
}

TEST(ForestFile, BracketsWithinBracketsAreRefusedAndNotFollowed) {
  auto bytes = pack(sample_circuit(), sample_neurons());
  layout::Header header;
  std::memcpy(&header, bytes.data(), sizeof header);
  const layout::Entry& text = header.table[layout::text];
  std::memset(&bytes[text.offset], '[', text.count);
  testing::put_forest_right(bytes);
  EXPECT_NE(forest::refused([&] { Forest::from_bytes(std::move(bytes)); }).find("brackets"),
            std::string::npos);
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
