// SPDX-License-Identifier: Apache-2.0
// Neurons of every sort through the repository: the zoo, and every real file.
#include "forest/repository/repository.h"

#include <cmath>
#include <filesystem>
#include <unistd.h>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "forest/core/file.h"
#include "forest/io/format.h"
#include "forest/morphology/measure.h"

#include "tests/real_data.h"
#include "tests/zoo.h"

namespace forest::repository {
namespace {

namespace fs = std::filesystem;

class RepositoryOfNeurons : public testing::Test {
 protected:
  void TearDown() override { fs::remove(file_); }
  const std::string file_ =
      (fs::temp_directory_path() / fmt::format("forest-neurons-{}.db", ::getpid())).string();
};

TEST_F(RepositoryOfNeurons, GiveTheZooBack) {
  Repository repository = Repository::open(file_, Access::write);
  for (const Specimen& specimen : zoo()) {
    NewNeuron neuron;
    neuron.name = specimen.name;
    const NeuronId id = repository.add(specimen.morphology, neuron).id;
    EXPECT_EQ(repository.morphology(id), specimen.morphology) << specimen.name;
    EXPECT_EQ(repository.neuron(id)->sections, specimen.sections) << specimen.name;
    std::size_t tips = 0;
    for (const ArborRow& arbor : repository.arbors(id)) tips += arbor.terminals;
    EXPECT_EQ(tips, specimen.tips) << specimen.name;
    if (specimen.length) {
      EXPECT_NEAR(repository.neuron(id)->length, *specimen.length, 1e-3) << specimen.name;
    }
  }
  EXPECT_TRUE(repository.check().empty());
}

/// Tracers write -0.00, which is equal to 0 and has other bits; the checksum is of the bits.
TEST_F(RepositoryOfNeurons, GiveTracedSpinesBackWithTheSignsOfTheirZeros) {
  const Morphology traced = io::find_format("asc")
                                ->read(
                                    "((Dendrite) (0.00 0 0 1) (0.00 10 0 1) "
                                    "<((Color Pink) (-0.00 10.00 -0.00 0.50))> (0.00 20 0 1))",
                                    "spine.asc")
                                .morphology;
  ASSERT_EQ(traced.spines().size(), 1u);
  ASSERT_TRUE(std::signbit(traced.spines()[0].head.x()));
  Repository repository = Repository::open(file_, Access::write);
  const Morphology stored = repository.morphology(repository.add(traced, {.name = "cell"}).id);
  EXPECT_EQ(stored, traced);
  for (int axis = 0; axis < 3; ++axis)
    EXPECT_EQ(std::signbit(stored.spines()[0].head[axis]), std::signbit(traced.spines()[0].head[axis]));
  EXPECT_TRUE(repository.check().empty());
}

/// Out of a repository, into a file and back: the same sections, and length and area to a millionth.
TEST_F(RepositoryOfNeurons, GiveEveryRealFileBack) {
  FOREST_REAL_DATA(folder, "morphologies/real");
  std::vector<fs::path> files;
  for (const char* extension : {".asc", ".swc"}) {
    const auto of_kind = files_below(folder, extension);
    ASSERT_FALSE(of_kind.empty()) << extension;
    files.insert(files.end(), of_kind.begin(), of_kind.end());
  }
  Repository repository = Repository::open(file_, Access::write);
  auto transaction = repository.begin();
  const io::Format& swc = *io::find_format("swc");
  for (std::size_t i = 0; i < files.size(); ++i) {
    const Morphology traced = io::read(files[i]).morphology;
    NewNeuron neuron;
    neuron.name = fmt::format("{} {}", i, files[i].filename().string());
    neuron.provenance = Traced{files[i].string(), std::to_string(i)};
    const Morphology stored = repository.morphology(repository.add(traced, neuron).id);
    ASSERT_EQ(stored, traced) << files[i];
    ASSERT_EQ(stored.annotations(), traced.annotations()) << files[i];
    const Morphology back = swc.read(swc.write(stored), "exported").morphology;
    ASSERT_EQ(back.sections().size(), traced.sections().size()) << files[i];
    for (std::size_t s = 0; s < traced.sections().size(); ++s) {
      const Section& section = traced.sections()[s];
      ASSERT_EQ(back.sections()[s].parent, section.parent) << files[i];
      ASSERT_EQ(back.sections()[s].kind, section.kind) << files[i];
      ASSERT_EQ(back.sections()[s].point_count, section.point_count) << files[i];
    }
    EXPECT_NEAR(total_length(back), total_length(traced), 1e-6 * total_length(traced)) << files[i];
    EXPECT_NEAR(total_area(back), total_area(traced), 1e-6 * total_area(traced)) << files[i];
  }
  transaction.commit();
  EXPECT_EQ(repository.neurons().size(), files.size());
}

}  // namespace
}  // namespace forest::repository
