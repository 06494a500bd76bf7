// SPDX-License-Identifier: Apache-2.0
#include "forest/repository/repository.h"

#include <csignal>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <functional>
#include <thread>
#include <unistd.h>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/hash.h"
#include "forest/core/random.h"
#include "forest/repository/names.h"
#include "forest/repository/schema.h"

namespace forest::repository {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using namespace std::string_literals;

/// A folder of its own for each test.
class RepositoryTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / fmt::format("forest-repository-{}", ::getpid());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    file_ = (folder_ / "cells.db").string();
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path folder_;
  std::string file_;
};

std::string bytes_of(const fs::path& path) { return std::string(MappedFile(path).text()); }

std::string message(const std::function<void()>& body) {
  try {
    body();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

/// A random neuron that uses everything a Morphology has.
Morphology neuron(std::uint64_t number, std::size_t sections = 40, std::size_t points = 6) {
  Random random(7, number);
  const auto value = [&] { return float(random.uniform() * 200. - 100.); };
  const auto point = [&] { return Point{value(), value(), value(), float(random.uniform())}; };
  MorphologyBuilder builder;
  Soma soma;
  soma.kind = SomaKind(number % 4);
  const std::size_t soma_points = std::array<std::size_t, 4>{0, 1, 5, 9}[number % 4];
  for (std::size_t i = 0; i < soma_points; ++i) soma.points.push_back(point());
  if (soma.kind == SomaKind::cylinders) soma.parents = {-1, 0, 0, 1, 3};
  if (soma.kind == SomaKind::contours) soma.contour_starts = {0, 4};
  builder.set_soma(soma);
  for (std::size_t s = 0; s < sections; ++s) {
    std::vector<Point> run(1 + std::size_t(random.uniform() * double(points)));
    for (Point& p : run) p = point();
    const bool root = s == 0 || random.uniform() < 0.1;
    const SectionId parent = root ? SectionId() : SectionId(std::size_t(random.uniform() * double(s)));
    const auto kind =
        std::array{SectionKind::undefined, SectionKind::axon,        SectionKind::basal, SectionKind::apical,
                   SectionKind::custom,    SectionKind::unspecified, SectionKind::glia}[s % 7];
    builder.add_section(parent, kind, run, kind == SectionKind::custom ? 1000 + int(s) : int(kind),
                        root ? int(s) - 1 : -1);
    if (s % 5 == 0)
      builder.add_spine({.section = SectionId(s),
                         .position = value(),
                         .head = {value(), value(), value()},
                         .head_diameter = 0.3f,
                         .neck_diameter = 0.1f,
                         .shape = SpineShape(s % 6)});
  }
  builder.annotate("species", "rat");
  builder.annotate("comment \xe9 \\x41 \\", "Latin-1 \xb5m, a zero \0, a newline \n"s);
  builder.annotate("", "");
  return builder.build();
}

NewNeuron called(std::string name, std::string population = "default") {
  return {.name = name,
          .population = std::move(population),
          .provenance = Traced{name + ".swc", "hash of " + name}};
}

TEST_F(RepositoryTest, GivesBackExactlyWhatWasStored) {
  std::vector<Morphology> neurons;
  for (std::size_t i = 0; i < 24; ++i) neurons.push_back(neuron(i, i * i));
  {
    Repository repository = Repository::open(file_, Access::write);
    for (std::size_t i = 0; i < neurons.size(); ++i) {
      const Added added = repository.add(neurons[i], called(fmt::format("n{}", i)));
      EXPECT_EQ(added.id.value(), i + 1);
      EXPECT_FALSE(added.already_there);
    }
  }
  const Repository repository = Repository::open(file_, Access::read);
  const auto rows = repository.neurons();
  ASSERT_EQ(rows.size(), neurons.size());
  for (std::size_t i = 0; i < neurons.size(); ++i) {
    const Morphology back = repository.morphology(rows[i].id);
    EXPECT_EQ(back, neurons[i]);
    EXPECT_EQ(back.annotations(), neurons[i].annotations());
    EXPECT_EQ(rows[i].sections, neurons[i].sections().size());
    EXPECT_EQ(rows[i].points, neurons[i].points().size());
    EXPECT_EQ(rows[i].spines, neurons[i].spines().size());
    EXPECT_EQ(rows[i].stems, neurons[i].roots().size());
    std::size_t sections = 0;
    double length = 0.;
    for (const ArborRow& arbor : repository.arbors(rows[i].id))
      sections += arbor.sections, length += arbor.length;
    EXPECT_EQ(sections, rows[i].sections);
    EXPECT_DOUBLE_EQ(length, rows[i].length);
  }
  EXPECT_THAT(repository.check(), testing::IsEmpty());
}

TEST_F(RepositoryTest, KeepsWhereANeuronComesFrom) {
  Repository repository = Repository::open(file_, Access::write);
  const Traced traced{"folder/Zelle \xe4 'x'.swc", "00ff"};
  const std::string text = "#axiom\nF(1)\n\xff";
  const Grown grown{"purkinje", repository.add_grammar("purkinje", text), 0xffffffffffffffffu, 41};
  repository.add(
      neuron(1),
      {.name = "a", .species = "rat", .region = "CA1", .layer = "sr", .type = "PV+", .provenance = traced});
  repository.add(neuron(1), {.name = "b", .provenance = grown});
  const auto rows = repository.neurons();
  EXPECT_EQ(std::get<Traced>(rows.at(0).provenance), traced);
  EXPECT_EQ(std::get<Grown>(rows.at(1).provenance), grown);
  EXPECT_EQ(rows[0].species + rows[0].region + rows[0].layer + rows[0].type, "ratCA1srPV+");
  EXPECT_EQ(repository.grammar(grown.grammar_hash), text);
  EXPECT_EQ(repository.grammar("unknown"), std::nullopt);
  EXPECT_THAT(message([&] {
                repository.add(neuron(2), {.name = "c", .provenance = Grown{"other", "unknown", 1, 1}});
              }),
              HasSubstr("add_grammar"));
}

TEST_F(RepositoryTest, TheSameSourceAgainChangesNoByte) {
  const auto store = [&] {
    Repository repository = Repository::open(file_, Access::write);
    const std::string hash = repository.add_grammar("g", "text");
    bool all = true;
    for (std::size_t i = 0; i < 5; ++i) {
      all &= repository.add(neuron(i), called(fmt::format("n{}", i))).already_there;
      all &= repository.add(neuron(i), {.name = fmt::format("g{}", i), .provenance = Grown{"g", hash, 1, i}})
                 .already_there;
    }
    return all;
  };
  EXPECT_FALSE(store());
  const std::string before = bytes_of(file_);
  EXPECT_TRUE(store());
  EXPECT_EQ(bytes_of(file_), before);
  Repository repository = Repository::open(file_, Access::write);
  NewNeuron copy = called("copy");
  copy.provenance = Traced{"elsewhere/copy.swc", "hash of n3"};
  EXPECT_EQ(repository.add(neuron(3), copy).name, "n3")
      << "the same bytes under another name are the same neuron";
  copy.population = "another";
  EXPECT_FALSE(repository.add(neuron(3), copy).already_there);
}

TEST_F(RepositoryTest, TheSameCallsGiveTheSameBytes) {
  const auto store = [&](const std::string& file) {
    Repository repository = Repository::open(file, Access::write);
    for (std::size_t i = 0; i < 30; ++i) repository.add(neuron(i), called(fmt::format("n{}", i)));
    auto transaction = repository.begin();
    for (std::size_t i = 30; i < 60; ++i) repository.add(neuron(i), called(fmt::format("n{}", i), "second"));
    transaction.commit();
    repository.remove(NeuronId(7));
    repository.add(neuron(100, 200), called("last"));
  };
  store(file_);
  store(file_ + "2");
  EXPECT_TRUE(bytes_of(file_) == bytes_of(file_ + "2"));
}

TEST_F(RepositoryTest, ANameTakenByAnotherNeuronIsRefusedOrNumbered) {
  Repository repository = Repository::open(file_, Access::write);
  repository.add(neuron(1), called("cell"));
  NewNeuron other = called("cell");
  other.provenance = Traced{"other/cell.swc", "another hash"};
  EXPECT_THAT(message([&] { repository.add(neuron(2), other); }),
              HasSubstr("another neuron of population 'default' is called 'cell'"));
  other.number_if_taken = true;
  EXPECT_EQ(repository.add(neuron(2), other).name, "cell-2");
  other.provenance = Traced{"third/cell.swc", "a third hash"};
  EXPECT_EQ(repository.add(neuron(3), other).name, "cell-3");
  other.population = "elsewhere";
  EXPECT_EQ(repository.add(neuron(3), other).name, "cell");
  EXPECT_EQ(repository.find("cell").size(), 2u);
  EXPECT_EQ(repository.find("cell", "elsewhere").size(), 1u);
}

TEST_F(RepositoryTest, HostileNamesAreJustNames) {
  Repository repository = Repository::open(file_, Access::write);
  const std::vector<std::string> names{"'",
                                       "\"",
                                       "'); DROP TABLE neurons; --",
                                       "a;b",
                                       "%s%n",
                                       ":id",
                                       "?1",
                                       "../../etc/passwd",
                                       "naïve μ 神経",
                                       " ",
                                       "null",
                                       std::string(1000, 'x')};
  for (std::size_t i = 0; i < names.size(); ++i)
    repository.add(neuron(i), called(names[i], names[names.size() - 1 - i]));
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto found = repository.find(names[i]);
    ASSERT_EQ(found.size(), 1u) << names[i];
    EXPECT_EQ(found[0].name, names[i]);
    EXPECT_EQ(repository.neurons(found[0].population).size(), 1u);
    EXPECT_EQ(repository.morphology(found[0].id), neuron(i));
  }
  const std::size_t before = repository.neurons().size();
  for (const std::string& name :
       {std::string(), std::string("\xff"), "a\0b"s, std::string("a\nb"), std::string("\xed\xa0\x80"),
        std::string(1001, 'x'), std::string(10'000'000, 'x')}) {
    const std::string sentence = message([&] { repository.add(neuron(1), called(name)); });
    EXPECT_THAT(sentence, HasSubstr("is no name for a neuron"));
    EXPECT_LT(sentence.size(), 500u);
    EXPECT_THAT(message([&] { repository.add(neuron(1), called("good", name)); }),
                HasSubstr("is no name for a population"));
  }
  EXPECT_EQ(repository.neurons().size(), before);
  EXPECT_THAT(repository.check(), testing::IsEmpty());
}

TEST_F(RepositoryTest, ATransactionIsAllOrNothing) {
  Repository repository = Repository::open(file_, Access::write);
  const std::string before = bytes_of(file_);
  {
    auto transaction = repository.begin();
    repository.add(neuron(1), called("one"));
    repository.add(neuron(2), called("two"));
    EXPECT_EQ(repository.neurons().size(), 2u) << "seen inside it";
    EXPECT_EQ(Repository::open(file_, Access::read).neurons().size(), 0u) << "but not by others";
  }
  EXPECT_EQ(bytes_of(file_), before);
  auto transaction = repository.begin();
  repository.add(neuron(1), called("one"));
  EXPECT_THROW(repository.add(neuron(2), called("")), Error);
  transaction.commit();
  EXPECT_EQ(repository.neurons().size(), 1u) << "a refused neuron does not spoil the others";
}

TEST_F(RepositoryTest, RemovingLeavesNothingOfANeuron) {
  Repository repository = Repository::open(file_, Access::write);
  for (std::size_t i = 0; i < 3; ++i) repository.add(neuron(i + 1), called(fmt::format("n{}", i)));
  EXPECT_TRUE(repository.remove(NeuronId(2)));
  EXPECT_FALSE(repository.remove(NeuronId(2)));
  EXPECT_EQ(repository.neuron(NeuronId(2)), std::nullopt);
  EXPECT_TRUE(repository.arbors(NeuronId(2)).empty());
  EXPECT_THAT(message([&] { repository.morphology(NeuronId(2)); }), HasSubstr("there is no neuron 2"));
  EXPECT_EQ(repository.morphology(NeuronId(3)), neuron(3));
  EXPECT_THAT(repository.check(), testing::IsEmpty());
}

TEST_F(RepositoryTest, PopulationsAreSummedUp) {
  Repository repository = Repository::open(file_, Access::write);
  EXPECT_TRUE(repository.populations().empty());
  for (std::size_t i = 0; i < 6; ++i)
    repository.add(neuron(i), called(fmt::format("n{}", i), i % 3 ? "many" : "few"));
  const auto populations = repository.populations();
  ASSERT_EQ(populations.size(), 2u);
  EXPECT_EQ(populations[0].name, "few");
  EXPECT_EQ(populations[0].neurons, 2u);
  EXPECT_EQ(populations[1].neurons, 4u);
  std::size_t sections = 0;
  double length = 0.;
  for (const NeuronRow& row : repository.neurons("many")) sections += row.sections, length += row.length;
  EXPECT_EQ(populations[1].sections, sections);
  EXPECT_DOUBLE_EQ(populations[1].length, length);
  EXPECT_TRUE(repository.neurons("none").empty());
}

}  // namespace
}  // namespace forest::repository
