// SPDX-License-Identifier: Apache-2.0
#include "forest/repository/repository.h"

#include <array>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <unistd.h>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/hash.h"
#include "forest/core/random.h"
#include "forest/morphology/measure.h"
#include "forest/repository/names.h"
#include "forest/repository/schema.h"
#include "forest/statistics/metric.h"

#include "tests/every_database.h"

namespace forest::repository {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using namespace std::string_literals;

INSTANTIATE_TEST_SUITE_P(Databases, EveryDatabase, testing::Values("sqlite", "postgresql"),
                         [](const auto& row) { return row.param; });

TEST_P(EveryDatabase, GivesBackExactlyWhatWasStored) {
  std::vector<Morphology> neurons;
  for (std::size_t i = 0; i < 24; ++i) neurons.push_back(neuron(i, i * i));
  {
    Repository repository = Repository::open(place_, Access::write);
    for (std::size_t i = 0; i < neurons.size(); ++i) {
      const Added added = repository.add(neurons[i], called(fmt::format("n{}", i)));
      EXPECT_EQ(added.id.value(), i + 1);
      EXPECT_FALSE(added.already_there);
    }
  }
  const Repository repository = Repository::open(place_, Access::read);
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

TEST_P(EveryDatabase, KeepsWhereANeuronComesFrom) {
  Repository repository = Repository::open(place_, Access::write);
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

TEST_P(EveryDatabase, ANameTakenByAnotherNeuronIsRefusedOrNumbered) {
  Repository repository = Repository::open(place_, Access::write);
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

TEST_P(EveryDatabase, TheNumberOfANameIsTheLeastThatIsFree) {
  Repository repository = Repository::open(place_, Access::write);
  std::uint64_t next = 0;
  const auto add = [&] {
    NewNeuron cell = called("cell");
    cell.provenance = Traced{"cell.swc", std::to_string(++next)};
    cell.number_if_taken = true;
    return repository.add(neuron(next, 3), cell);
  };
  repository.add(neuron(50, 3), called("cell-4"));
  repository.add(neuron(51, 3), called("cell-x"));
  auto transaction = repository.begin();
  const char* names[] = {"cell", "cell-2", "cell-3", "cell-5", "cell-6"};
  std::vector<NeuronId> ids;
  for (const char* name : names) {
    const Added added = add();
    EXPECT_EQ(added.name, name);
    ids.push_back(added.id);
  }
  repository.remove(ids[2]);
  EXPECT_EQ(add().name, "cell-3");
  EXPECT_EQ(add().name, "cell-7");
  transaction.commit();
  Repository::open(place_, Access::write).remove(ids[1]);
  EXPECT_EQ(add().name, "cell-2") << "another program has removed it";
  EXPECT_EQ(add().name, "cell-8");
}

TEST_P(EveryDatabase, HostileNamesAreJustNames) {
  Repository repository = Repository::open(place_, Access::write);
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
                                       std::string(max_name, 'x')};
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
        std::string(max_name + 1, 'x'), std::string(10'000'000, 'x')}) {
    const std::string sentence = message([&] { repository.add(neuron(1), called(name)); });
    EXPECT_THAT(sentence, HasSubstr("is no name for a neuron"));
    EXPECT_LT(sentence.size(), 500u);
    EXPECT_THAT(message([&] { repository.add(neuron(1), called("good", name)); }),
                HasSubstr("is no name for a population"));
    EXPECT_TRUE(repository.find(name).empty());
    EXPECT_TRUE(name.empty() || repository.neurons(name).empty());
  }
  EXPECT_EQ(repository.neurons().size(), before);
  EXPECT_THAT(repository.check(), testing::IsEmpty());
}

TEST_P(EveryDatabase, ATransactionIsAllOrNothing) {
  Repository repository = Repository::open(place_, Access::write);
  const std::string before = is_file() ? bytes_of(place_) : "";
  {
    auto transaction = repository.begin();
    repository.add(neuron(1), called("one"));
    repository.add(neuron(2), called("two"));
    EXPECT_EQ(repository.neurons().size(), 2u) << "seen inside it";
    EXPECT_EQ(Repository::open(place_, Access::read).neurons().size(), 0u) << "but not by others";
  }
  if (is_file()) {
    EXPECT_EQ(bytes_of(place_), before);
  }
  EXPECT_TRUE(repository.neurons().empty());
  auto transaction = repository.begin();
  repository.add(neuron(1), called("one"));
  EXPECT_THROW(repository.add(neuron(2), called("")), Error);
  transaction.commit();
  EXPECT_EQ(repository.neurons().size(), 1u) << "a refused neuron does not spoil the others";
}

TEST_P(EveryDatabase, WhatIsRefusedInATransactionChangesNothing) {
  Repository repository = Repository::open(place_, Access::write);
  const NeuronId id = repository.add(neuron(1), called("one")).id;
  auto transaction = repository.begin();
  EXPECT_THROW(repository.add(neuron(2), {.name = "two",
                                          .population = "grown",
                                          .provenance = Grown{"bush", std::string(32, '0'), 1, 2}}),
               Error);
  const std::pair<const statistics::Metric*, double> values[] = {
      {statistics::find_metric("total_length"), 12345.}, {statistics::find_metric("type"), 1.}};
  EXPECT_THROW(repository.store_metrics(id, values), Error);
  transaction.commit();
  EXPECT_EQ(repository.populations().size(), 1u);
  EXPECT_TRUE(repository.neurons_where("total_length = 12345").empty());
}

TEST_P(EveryDatabase, ATransactionInWhichAQuestionFailedIsStoredOrSaysThatItIsNot) {
  Repository repository = Repository::open(place_, Access::write);
  std::string error;
  {
    auto transaction = repository.begin();
    repository.add(neuron(1), called("one"));
    EXPECT_THROW(repository.neurons_where("no_column = 1"), Error);
    error = message([&] { transaction.commit(); });
  }
  if (is_file())
    EXPECT_EQ(error, "no error");
  else
    EXPECT_THAT(error, HasSubstr("has failed and is undone"));
  EXPECT_EQ(repository.neurons().size(), is_file() ? 1u : 0u);
}

TEST_P(EveryDatabase, WhatIsBeingStoredIsNoTableForQuestions) {
  Repository repository = Repository::open(place_, Access::write);
  repository.add(neuron(4), called("four"));
  std::size_t answered = 0;
  for (int number = 1; number < 12; ++number) try {
      EXPECT_TRUE(repository.query(fmt::format("select * from rows_{}", number)).rows.empty());
      ++answered;
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), HasSubstr("not understood"));
    }
  EXPECT_EQ(answered > 0, is_file()) << "else this has tested nothing";
}

TEST_P(EveryDatabase, RemovingLeavesNothingOfANeuron) {
  Repository repository = Repository::open(place_, Access::write);
  for (std::size_t i = 0; i < 3; ++i) repository.add(neuron(i + 1), called(fmt::format("n{}", i)));
  EXPECT_TRUE(repository.remove(NeuronId(2)));
  EXPECT_FALSE(repository.remove(NeuronId(2)));
  EXPECT_EQ(repository.neuron(NeuronId(2)), std::nullopt);
  EXPECT_TRUE(repository.arbors(NeuronId(2)).empty());
  EXPECT_THAT(message([&] { repository.morphology(NeuronId(2)); }), HasSubstr("there is no neuron 2"));
  EXPECT_EQ(repository.morphology(NeuronId(3)), neuron(3));
  EXPECT_THAT(repository.check(), testing::IsEmpty());
}

TEST_P(EveryDatabase, ARevisedNeuronIsThatNeuron) {
  Repository repository = Repository::open(place_, Access::write);
  const std::string hash = repository.add_grammar("grammar", "text");
  const NeuronId a =
      repository.add(neuron(1), {.name = "a", .species = "rat", .provenance = Traced{"a.swc", "h"}}).id;
  const NeuronId b = repository.add(neuron(2), {.name = "b", .provenance = Grown{"grammar", hash, 5, 6}}).id;
  const NeuronId c = repository.add(neuron(3), {.name = "c"}).id;
  const auto before = repository.versions(std::vector{a, b, c, NeuronId(99)});
  EXPECT_EQ(before[3], "");
  EXPECT_NE(before[0], before[1]);
  const NeuronRow grown = *repository.neuron(b);
  repository.revise(std::vector<Revision>{
      {.id = a, .version = before[0], .name = "b", .species = "back\\slash \xff", .layer = "2/3"},
      {.id = b, .version = before[1], .name = "a", .morphology = neuron(4)}});
  const auto after = repository.versions(std::vector{a, b, c});
  EXPECT_NE(after[0], before[0]);
  EXPECT_NE(after[1], before[1]);
  EXPECT_EQ(after[2], before[2]);
  const NeuronRow first = *repository.neuron(a), second = *repository.neuron(b);
  EXPECT_EQ(first.name, "b");
  EXPECT_EQ(first.species, "back\\slash \xff");
  EXPECT_EQ(first.layer, "2/3");
  EXPECT_EQ(first.provenance, (Provenance{Traced{"a.swc", "h"}}));
  EXPECT_EQ(repository.morphology(a), neuron(1));
  EXPECT_EQ(second.name, "a");
  EXPECT_EQ(second.provenance, grown.provenance);
  EXPECT_EQ(second.points, neuron(4).points().size());
  EXPECT_EQ(repository.morphology(b), neuron(4));
  EXPECT_EQ(repository.morphology(b).annotations(), neuron(4).annotations());
  // Metrics, sections and arbors are those of a neuron that was stored so.
  const NeuronId fresh = repository.add(neuron(4), {.name = "fresh", .population = "other"}).id;
  EXPECT_EQ(repository.arbors(b).size(), repository.arbors(fresh).size());
  EXPECT_TRUE(
      repository.add(neuron(2), {.name = "b", .provenance = Grown{"grammar", hash, 5, 6}}).already_there);
  EXPECT_TRUE(repository.check().empty());
  const auto of = [&](const char* view, NeuronId id) {
    return repository.query(fmt::format("select * from {} where neuron = {}", view, id.value()));
  };
  for (const char* view : {"section", "junction", "metric"}) {
    const Answer is = of(view, b), expected = of(view, fresh);
    ASSERT_EQ(is.rows.size(), expected.rows.size()) << view;
    EXPECT_EQ(is.rows.back().back(), expected.rows.back().back()) << view;
  }
}

TEST_P(EveryDatabase, RevisionsAreAllStoredOrNone) {
  Repository repository = Repository::open(place_, Access::write);
  const NeuronId a = repository.add(neuron(1), {.name = "a"}).id;
  const NeuronId b = repository.add(neuron(2), {.name = "b"}).id;
  const auto versions = repository.versions(std::vector{a, b});
  const auto fails = [&](const std::vector<Revision>& revisions, const char* words) {
    EXPECT_THAT(message([&] { repository.revise(revisions); }), HasSubstr(words));
    EXPECT_EQ(repository.versions(std::vector{a, b}), versions);
    EXPECT_EQ(repository.morphology(a), neuron(1));
  };
  const Revision good{.id = a, .version = versions[0], .name = "new", .morphology = neuron(5)};
  fails({good, {.id = b, .version = versions[1], .name = "new"}},
        "another neuron of the population is called 'new'");
  fails({good, {.id = b, .version = "v0", .name = "b"}}, "neuron 2 has been changed");
  fails({good, {.id = NeuronId(7), .version = "", .name = "b"}}, "neuron 7 has been removed");
  fails({good, {.id = b, .version = versions[1], .name = "a\nb"}}, "is no name");
  {
    auto transaction = repository.begin();
    EXPECT_THROW(
        repository.revise(std::vector{good, Revision{.id = b, .version = versions[1], .name = "new"}}),
        Error);
    EXPECT_THROW(transaction.commit(), Error);
  }
  EXPECT_EQ(repository.versions(std::vector{a, b}), versions);
  repository.revise(std::vector{good});
  EXPECT_EQ(repository.morphology(a), neuron(5));
}

TEST_P(EveryDatabase, PopulationsAreSummedUp) {
  Repository repository = Repository::open(place_, Access::write);
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

TEST_F(RepositoryTest, TheJournalOfARepositoryThatIsGoneDoesNoHarm) {
  std::vector<Morphology> source;
  for (std::size_t i = 0; i < 3; ++i) source.push_back(neuron(i, 3000));
  const std::string journal = file_ + "-journal";
  Repository::open(file_, Access::write).add(source[0], called("0"));
  const std::string stored = bytes_of(file_);
  std::string hot;  // as a program leaves it that is killed while it changes the file
  for (int delay = 0; hot.size() < 600 && delay < 400; ++delay) {
    write_file(file_, stored);
    const pid_t child = in_child([&] {
      for (;;) {
        Repository repository = Repository::open(file_, Access::write);
        repository.remove(NeuronId(1));
        repository.add(source[0], called("0"));
      }
    });
    ::usleep(useconds_t(5000 + 1000 * (delay % 40)));  // on a busy machine it begins later
    ::kill(child, SIGKILL);
    wait_for(child);
    if (fs::exists(journal)) hot = bytes_of(journal);
    fs::remove(journal);
  }
  ASSERT_GE(hot.size(), 600u);
  fs::remove(file_);
  write_file(journal, hot);
  Repository::open(file_, Access::write).add(source[1], called("1"));
  EXPECT_EQ(whole_neurons(file_, source), 1u);
}

// Two containers may have programs of one number.
TEST_F(RepositoryTest, ANewOneTouchesNoFileOfAnotherThatIsBeingMade) {
  const std::string other = fmt::format("{}.new-{}", file_, ::getpid());
  write_file(other, std::string_view("another program's"));
  Repository::open(file_, Access::write).add(neuron(1), called("a"));
  EXPECT_EQ(bytes_of(other), "another program's");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 2);
}

TEST_F(RepositoryTest, AFullDiskIsASentenceAndLosesNothing) {
  std::vector<Morphology> source;
  for (std::size_t i = 0; i < 60; ++i) source.push_back(neuron(i, 100));
  Repository::open(file_, Access::write);
  const std::size_t empty = fs::file_size(file_);
  for (const std::size_t limit : {std::size_t(0), std::size_t(4000), empty / 2, empty, empty + 50'000,
                                  empty + 72'222, empty + 250'000}) {
    fs::remove(file_);
    const pid_t child = in_child([&] {
      std::signal(SIGXFSZ, SIG_IGN);
      const rlimit bytes{limit, limit};
      ::setrlimit(RLIMIT_FSIZE, &bytes);
      std::size_t stored = 0;
      const std::string sentence = message([&] {
        Repository repository = Repository::open(file_, Access::write);
        for (; stored < source.size(); ++stored)
          repository.add(source[stored], called(std::to_string(stored)));
      });
      if (sentence.find("disk is full") == std::string::npos) throw Error("not the sentence: " + sentence);
      if (stored && whole_neurons(file_, source) != stored) throw Error("lost a neuron");
      const std::string again = message([&] {  // a batch that does not fit leaves what was there
        Repository repository = Repository::open(file_, Access::write);
        auto transaction = repository.begin();
        for (std::size_t i = 0; i < source.size(); ++i) repository.add(source[i], called(std::to_string(i)));
        transaction.commit();
      });
      if (again.find("disk is full") == std::string::npos)
        throw Error("not the sentence of a batch: " + again);
      if (stored && whole_neurons(file_, source) != stored) throw Error("lost a neuron to a batch");
      if (!stored && fs::exists(file_) && whole_neurons(file_, source) != 0)
        throw Error("stored a part of a batch");
    });
    EXPECT_EQ(wait_for(child), 0) << limit;
    EXPECT_TRUE(testing::Test::HasFailure() || fs::exists(file_) || limit <= empty) << limit;
    for (const auto& entry : fs::directory_iterator(folder_)) EXPECT_EQ(entry.path(), file_) << limit;
  }
}

TEST_P(EveryDatabase, TwoProgramsStoreAtOnce) {
  std::vector<Morphology> source;
  for (std::size_t i = 0; i < 80; ++i) source.push_back(neuron(i));
  std::array<pid_t, 3> children{};
  for (std::size_t c = 0; c < children.size(); ++c)
    children[c] = in_child([&] {
      Repository repository = Repository::open(place_, Access::write);  // all three make the file
      for (std::size_t i = 0; i < source.size(); ++i)
        if (c == 2 || i % 2 == c)
          repository.add(source[i], called(std::to_string(i)));  // the third stores what the others do
    });
  for (const pid_t child : children) EXPECT_EQ(wait_for(child), 0);
  EXPECT_EQ(whole_neurons(place_, source), source.size());
}

TEST_P(EveryDatabase, IsSearchedByWhatIsKnownAndMeasured) {
  Repository repository = Repository::open(place_, Access::write);
  std::vector<double> lengths;
  for (std::size_t i = 0; i < 20; ++i) {
    NewNeuron about = called(fmt::format("n{}", i), i % 2 ? "odd" : "even");
    about.type = i % 4 ? "L5 pyramidal" : "a 'basket' cell";
    repository.add(neuron(i, 10 + 7 * i), about);
    lengths.push_back(total_length(neuron(i, 10 + 7 * i)));
  }
  const auto found = repository.neurons_where("total_length > 9000 and type = 'L5 pyramidal'");
  std::size_t expected = 0;
  for (std::size_t i = 0; i < 20; ++i) expected += lengths[i] > 9000. && i % 4;
  ASSERT_GT(expected, 0u);
  ASSERT_LT(expected, 15u);
  EXPECT_EQ(found.size(), expected);
  for (const NeuronRow& row : found) EXPECT_GT(row.length, 9000.);
  EXPECT_EQ(repository.neurons_where("type = 'a ''basket'' cell'").size(), 5u);
  EXPECT_EQ(repository.neurons_where("name in ('n3', 'n4')", "odd").size(), 1u);
  EXPECT_EQ(
      repository.neurons_where("total_length / sections > 0 and max_branch_order >= 0 or name = 'x'").size(),
      20u);
  EXPECT_EQ(repository.neurons_where("type = 'total_length'").size(), 0u) << "a text is no metric";
  EXPECT_THAT(message([&] { repository.neurons_where("colour = 'red'"); }), HasSubstr("not understood"));
  const std::string metric = message([&] { repository.neurons_where("type <> 'x' and circularity > 0.5"); });
  EXPECT_THAT(metric, HasSubstr("the metric circularity is not stored"));
  EXPECT_THAT(metric, HasSubstr(fmt::format("--repo {} --metric circularity --store", place_)));
  const std::pair<const statistics::Metric*, double> value{statistics::find_metric("circularity"), 0.75};
  repository.store_metrics(NeuronId(2), std::span(&value, 1));
  EXPECT_EQ(repository.neurons_where("circularity > 0.5").size(), 1u);
  EXPECT_THAT(message([&] { repository.neurons_where("1 = 1); delete from neurons; --"); }),
              testing::Ne("no error"));
  EXPECT_EQ(repository.neurons().size(), 20u);
}

TEST_P(EveryDatabase, AnswersQuestionsInSqlAndLetsNothingBeWritten) {
  Repository::open(place_, Access::write).add(neuron(5), called("five"));
  Repository repository = Repository::open(place_, Access::write);
  const auto one = [&](const std::string& question) { return repository.query(question).rows.at(0).at(0); };
  const Answer row = repository.query("select name, sections, length, species, null as none from neuron");
  EXPECT_THAT(row.columns, testing::ElementsAre("name", "sections", "length", "species", "none"));
  EXPECT_EQ(row.rows.at(0).at(0), Answer::Value("five"));
  EXPECT_EQ(row.rows[0][1], Answer::Value(std::int64_t(40)));
  EXPECT_EQ(std::get<double>(row.rows[0][2]), repository.neurons().at(0).length);
  EXPECT_EQ(row.rows[0][4], Answer::Value());
  EXPECT_EQ(one("select count(*) from section"), Answer::Value(std::int64_t(40)));
  EXPECT_EQ(one("select count(*) from junction where junction = 'terminal'"),
            one("select cast(value as integer) from metric where metric = 'number_of_leaves'"));
  EXPECT_NEAR(std::get<double>(one("select value from metric where metric = 'total_length'")),
              repository.neurons()[0].length, 1e-9 * repository.neurons()[0].length);
  const Morphology m = neuron(5);
  const Answer ends = repository.query("select x, y, z, diameter from junction where section = 7");
  const Point end = m.points(SectionId(7)).back();
  const std::array expected{double(end.x), double(end.y), double(end.z), 2. * double(end.radius)};
  for (std::size_t i = 0; i < expected.size(); ++i)
    EXPECT_NEAR(std::get<double>(ends.rows.at(0).at(i)), expected[i], .5001e-6) << "to a picometre";
  for (const char* question :
       {"delete from neurons", "update neurons set name = 'x'", "drop table neurons",
        "create table t (x integer)", "insert into populations (id, name) values (9, 'x')",
        "pragma query_only = off", "vacuum", "attach database '/tmp/forest-attached.db' as other",
        "select 1; delete from neurons", "", "select * from nowhere", "copy neurons to '/tmp/forest-copied'",
        "with x as (select 1) delete from neurons", "set transaction read write",
        "set session characteristics as transaction read write"})
    message([&] { repository.query(question); });
  for (const char* question :
       {"delete from neurons", "create table t (x integer)", "drop view metric", "vacuum", "begin", "commit"})
    EXPECT_THAT(message([&] { repository.query(question); }), HasSubstr("read and not write")) << question;
  EXPECT_EQ(Repository::open(place_, Access::read).morphology(NeuronId(1)), m);
  EXPECT_FALSE(fs::exists("/tmp/forest-attached.db") || fs::exists("/tmp/forest-copied"));
}

TEST(Postgresql, ARoleThatMayOnlyReadIsToldSo) {
  const auto& server = PostgresqlServer::get();
  FOREST_POSTGRESQL(server);
  ASSERT_TRUE(server.run("create database shared"));
  ASSERT_TRUE(server.run("create role reader login"));
  const std::string mine = server.address("shared"), theirs = server.address("shared", "reader");
  EXPECT_THAT(message([&] { Repository::open(theirs, Access::read); }), HasSubstr("holds no repository"));
  EXPECT_THAT(message([&] { Repository::open(theirs, Access::write); }), HasSubstr("may not write"));
  Repository::open(mine, Access::write).add(neuron(3), called("three"));
  for (const Access access : {Access::read, Access::write})
    EXPECT_THAT(message([&] { Repository::open(theirs, access); }),
                HasSubstr("may not read there (permission denied for table brainforest_schema)"));
  ASSERT_TRUE(server.run("grant select on brainforest_schema, metrics to reader", "shared"));
  {
    Repository reader = Repository::open(theirs, Access::read);
    EXPECT_THAT(message([&] { reader.neurons(); }), HasSubstr("may not read there (permission denied for"));
    EXPECT_THAT(message([&] { reader.query("select * from points"); }),
                HasSubstr("may not read there (permission denied for table points)"));
    EXPECT_THAT(message([&] { reader.morphology(NeuronId(1)); }),
                HasSubstr("may not read there (permission denied for table neurons)"));
  }
  ASSERT_TRUE(server.run("grant select on all tables in schema public to reader", "shared"));
  Repository reader = Repository::open(theirs, Access::read);
  EXPECT_EQ(reader.morphology(NeuronId(1)), neuron(3));
  EXPECT_THAT(message([&] { reader.add(neuron(4), called("four")); }), HasSubstr("may not write"));
  EXPECT_THAT(message([&] { Repository::open(theirs, Access::write); }), HasSubstr("may not write"));
  EXPECT_THAT(message([&] { Repository::open(server.address("nowhere"), Access::read); }),
              HasSubstr("the server cannot be reached"));
}

TEST(Postgresql, ADatabaseThatIsNotUtf8IsToldSo) {
  const auto& server = PostgresqlServer::get();
  FOREST_POSTGRESQL(server);
  ASSERT_TRUE(server.run("create database latin encoding 'LATIN1' locale 'C' template template0"));
  for (const Access access : {Access::read, Access::write})
    EXPECT_THAT(message([&] { Repository::open(server.address("latin"), access); }),
                HasSubstr("its texts are LATIN1"));
}

TEST_F(RepositoryTest, WhatIsNoRepositoryIsRefusedAndNotTouched) {
  Repository::open(file_, Access::write).add(neuron(1), called("n"));
  const std::string good = bytes_of(file_);
  const auto patched = [&](std::size_t at, std::string_view bytes) {
    std::string changed = good;
    changed.replace(at, bytes.size(), bytes);
    return changed;
  };
  const std::vector<std::pair<std::string, std::string>> wrong{
      {"", "is no repository but an empty file"},
      {"n", "is no repository"},
      {"# a cell\n1 1 0 0 0 1 -1\n", "is no repository"},
      {std::string(100'000, '\0'), "is no repository"},
      {patched(0, "SQLite format 4"), "is no repository"},
      {patched(68, "\0\0\0\0"s), "another SQLite database"},
      {patched(60, "\0\0\0\x63"s), "was made by a newer Brain Forest (its tables are of version 99"},
      {patched(60, "\0\0\0\0"s), "damaged"},
  };
  for (const auto& [bytes, sentence] : wrong)
    for (const Access access : {Access::read, Access::write}) {
      write_file(file_, bytes);
      const std::string said = message([&] { Repository::open(file_, access); });
      EXPECT_THAT(said, HasSubstr(sentence));
      EXPECT_THAT(said, testing::StartsWith(file_ + ": "));
      EXPECT_TRUE(bytes_of(file_) == bytes);
    }
  for (const Access access : {Access::read, Access::write}) {
    EXPECT_THAT(message([&] { Repository::open(folder_.string(), access); }),
                HasSubstr("is not a regular file"));
    EXPECT_THAT(message([&] { Repository::open("", access); }), HasSubstr("is no path"));
    EXPECT_THAT(message([&] { Repository::open(std::string(10'000'000, 'x'), access); }).size(),
                testing::Lt(300u));
    EXPECT_THAT(message([&] { Repository::open("postgresql://127.0.0.1:1/cells", access); }),
                HasSubstr("the server cannot be reached"));
    const fs::path before = fs::current_path();
    fs::current_path(folder_);  // what were taken for a file would lie there
    for (const char* secret : {"postgresql://me:Rosebud@host/cells",
                               "postgresql://host/cells?password=Rosebud",
                               "postgresql://host/cells?sslpassword=Rosebud",
                               "postgresql://me%3ARosebud@host/cells",
                               "postgresql://me:Rose/Rosebud@host/cells",
                               "postgresql://me:12/Rosebud@host/cells",
                               "postgresql://host/password=Rosebud",
                               "POSTGRESQL://me:Rosebud@host/cells",
                               "Postgres://me:Rosebud@host/cells",
                               " postgresql://me:Rosebud@host/cells",
                               "\tpostgres://me:Rosebud@host/cells",
                               "postgresql:/me:Rosebud@host/cells",
                               "postgresql:me:Rosebud@host/cells",
                               "postgresql :// me:Rosebud@host/cells",
                               "postgresql+psycopg2://me:Rosebud@host/cells",
                               "jdbc:postgresql://host/cells?user=me&password=Rosebud",
                               "postgressql://me:Rosebud@host/cells",
                               "mysql://me:Rosebud@host/cells",
                               "//me:Rosebud@host/cells",
                               "me:Rosebud@host/cells",
                               "host=127.0.0.1 password=Rosebud",
                               "password = 'Rosebud' host=/tmp",
                               "HOST=127.0.0.1 PASSWORD=Rosebud",
                               "Server=127.0.0.1;Pwd=Rosebud;",
                               "user=me host=127.0.0.1"}) {
      const std::string said = message([&] { Repository::open(secret, access); });
      EXPECT_THAT(said, HasSubstr("PGPASSWORD")) << secret;
      EXPECT_THAT(said, testing::Not(HasSubstr("Rose"))) << secret;
      EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 1) << secret;
    }
    fs::current_path(before);
  }
  EXPECT_THAT(message([&] { Repository::open(file_ + "x", Access::read); }),
              HasSubstr("there is no such repository"));
  EXPECT_FALSE(fs::exists(file_ + "x"));
  EXPECT_THAT(message([&] { Repository::open(folder_ / "none" / "x", Access::write); }),
              HasSubstr("cannot be created"));
}

TEST_F(RepositoryTest, ReadingAccessDoesNotWrite) {
  Repository::open(file_, Access::write).add(neuron(1), called("n"));
  const std::string before = bytes_of(file_);
  Repository repository = Repository::open(file_, Access::read);
  EXPECT_THAT(message([&] { repository.add(neuron(2), called("m")); }), HasSubstr("opened for writing"));
  EXPECT_THAT(message([&] { repository.remove(NeuronId(1)); }), HasSubstr("opened for writing"));
  EXPECT_EQ(repository.neurons().size(), 1u);
  EXPECT_EQ(bytes_of(file_), before);
}

TEST_F(RepositoryTest, APathMayHoldAnything) {
  for (const char* name : {"with space.db", "two  spaces = '\"quotes\".db", ":memory:", "file:x?mode=memory",
                           "a=b.db", "-rf", "db=x timeout=1", "%20", "\xff.db", "; drop"}) {
    const std::string path = (folder_ / name).string();
    Repository::open(path, Access::write).add(neuron(5), called("n"));
    EXPECT_TRUE(fs::is_regular_file(path)) << name;
    EXPECT_EQ(Repository::open(path, Access::read).morphology(NeuronId(1)), neuron(5)) << name;
  }
}

TEST_F(RepositoryTest, ACutOffFileIsRefusedAtEveryLength) {
  {
    Repository repository = Repository::open(file_, Access::write);
    for (std::size_t i = 0; i < 4; ++i) repository.add(neuron(i), called(std::to_string(i)));
  }
  const std::string whole = bytes_of(file_);
  std::vector<std::size_t> lengths;
  for (std::size_t n = 0; n < whole.size(); n += n < 200 ? 1 : 211) lengths.push_back(n);
  for (std::size_t n = 4096; n <= whole.size(); n += 4096)
    lengths.push_back(n - 1), lengths.push_back(n - 4096);
  for (const std::size_t length : lengths) {
    std::ofstream(file_, std::ios::binary | std::ios::trunc).write(whole.data(), std::streamsize(length));
    EXPECT_THAT(message([&] { Repository::open(file_, Access::read); }), HasSubstr(file_ + ": is "))
        << length;
  }
}

TEST_F(RepositoryTest, ADamagedFileNeverGivesAWrongNeuron) {
  std::vector<Morphology> source;
  for (std::size_t i = 0; i < 4; ++i) source.push_back(neuron(i, 12));
  {
    Repository repository = Repository::open(file_, Access::write);
    for (std::size_t i = 0; i < source.size(); ++i) repository.add(source[i], called(std::to_string(i)));
  }
  const std::string whole = bytes_of(file_);
  Random random(3);
  std::size_t noticed = 0;
  for (int round = 0; round < 1500; ++round) {
    std::string damaged = whole;
    for (std::uint32_t flips = 1 + random.below(3); flips; --flips)
      damaged[random.below(std::uint32_t(whole.size()))] = char(random.below(256));
    std::ofstream(file_, std::ios::binary | std::ios::trunc)
        .write(damaged.data(), std::streamsize(damaged.size()));
    try {
      const Repository repository = Repository::open(file_, Access::read);
      repository.populations();
      for (std::size_t i = 0; i < source.size(); ++i) {
        try {
          const Morphology back = repository.morphology(NeuronId(i + 1));
          EXPECT_EQ(back, source[i]) << round;
          EXPECT_EQ(back.annotations(), source[i].annotations()) << round;
          repository.arbors(NeuronId(i + 1));
        } catch (const Error&) {
          ++noticed;
        }
      }
      for (const NeuronRow& row : repository.neurons()) repository.find(row.name, row.population);
    } catch (const Error&) {
      ++noticed;
    }
  }
  EXPECT_GT(noticed, 0u);
}

}  // namespace
}  // namespace forest::repository
