// SPDX-License-Identifier: Apache-2.0
// What is known of populations: grammars and distributions, kept as texts and versions.
#include <array>
#include <map>
#include <set>

#include "forest/core/hash.h"
#include "forest/repository/names.h"

#include "tests/every_database.h"

namespace forest::repository {
namespace {

using testing::HasSubstr;
using namespace std::string_literals;

TEST_P(EveryDatabase, ADistributionHasVersionsOfWhichNoneChanges) {
  const std::string first = "# of a daughter's diameter to its parent's\ndistribution ratio = truncnormal(0.75, 0.1, 0.5, 1)\n";
  const std::string second = "table mean = 1: 0.9, 2: 0.7\ndistribution ratio(order) = normal(mean(order), 0.1)\n";
  {
    Repository repository = Repository::open(place_, Access::write);
    EXPECT_TRUE(repository.distributions().empty());
    EXPECT_EQ(repository.add_distribution("ratio", "L5", first), 1);
    EXPECT_EQ(repository.add_distribution("ratio", "L5", first), 1) << "the same text is the same version";
    EXPECT_EQ(repository.add_distribution("ratio", "L5", second), 2);
    EXPECT_EQ(repository.add_distribution("ratio", "L5", first), 3) << "going back is a step too";
    EXPECT_EQ(repository.add_distribution("ratio", "L23", second), 1) << "of another population";
    EXPECT_EQ(repository.add_distribution("ratio", "", second), 1) << "of none";
    EXPECT_EQ(repository.add_distribution("ratio", "", second), 1);
    EXPECT_EQ(repository.add_distribution("ratio", "", first), 2);
    EXPECT_EQ(repository.add_distribution("angle", "L5", first), 1);
  }
  Repository repository = Repository::open(place_, Access::read);
  std::vector<std::string> all;
  for (const DistributionRow& row : repository.distributions())
    all.push_back(fmt::format("{}/{} {} {}", row.population, row.name, row.version, row.text == first));
  EXPECT_THAT(all, testing::ElementsAre("/ratio 1 false", "/ratio 2 true", "L23/ratio 1 false", "L5/angle 1 true",
                                        "L5/ratio 1 true", "L5/ratio 2 false", "L5/ratio 3 true"));
  EXPECT_EQ(repository.distribution("ratio", "L5")->version, 3);
  EXPECT_EQ(repository.distribution("ratio", "L5", 2)->text, second);
  EXPECT_EQ(repository.distribution("ratio", "L5", 4), std::nullopt);
  EXPECT_EQ(repository.distribution("ratio", "L6"), std::nullopt);
  EXPECT_EQ(repository.distribution("angle", ""), std::nullopt);
  const Answer view = repository.query(
      "select text from distribution where population = 'L5' and name = 'ratio' and version = 2");
  EXPECT_EQ(view.rows.at(0).at(0), Answer::Value(second)) << "as a person reads it with any client";
}

TEST_P(EveryDatabase, GrammarsAreListedByNameAndVersion) {
  Repository repository = Repository::open(place_, Access::write);
  const std::string text = "axiom: A\n\tA -> \\(90) F(1) A  # \"turned\", µm\n";
  const std::string hash = repository.add_grammar("bush", text);
  repository.add_grammar("bush", text + "\n");
  repository.add_grammar("alder", text);
  EXPECT_EQ(repository.add_grammar("bush", text), hash);
  for (std::size_t i = 0; i < 3; ++i)
    repository.add(neuron(i), {.name = fmt::format("b{}", i), .provenance = Grown{"bush", hash, 1, i}});
  const auto grammars = repository.grammars();
  ASSERT_EQ(grammars.size(), 3u);
  EXPECT_EQ(grammars[0].name + grammars[1].name + grammars[2].name, "alderbushbush");
  EXPECT_EQ(grammars[1].version, 1);
  EXPECT_EQ(grammars[1].text, text);
  EXPECT_EQ(grammars[1].hash, hash);
  EXPECT_EQ(grammars[1].neurons, 3u);
  EXPECT_EQ(grammars[2].version, 2);
  EXPECT_EQ(grammars[2].neurons, 0u);
  const Answer view = repository.query("select text, neurons from grammar where name = 'bush' and version = 1");
  EXPECT_EQ(view.rows.at(0).at(0), Answer::Value(text));
  EXPECT_EQ(view.rows[0][1], Answer::Value(std::int64_t(3)));
}

TEST_P(EveryDatabase, AnyTextComesBackAsItWasStored) {
  Repository repository = Repository::open(place_, Access::write);
  std::string bytes;
  for (int i = 0; i < 256; ++i) bytes += char(i);
  const std::vector<std::string> texts{"",          bytes,  "'); drop table distributions; --", "\\x41 \\\\ \\", "a\r\nb\r\n",
                                       "\\\xff\\n", ":id ?", std::string(3'000'000, 'x') + "\xc3"};
  for (std::size_t i = 0; i < texts.size(); ++i) {
    const std::string name = fmt::format("it's {}", i);
    EXPECT_EQ(repository.add_distribution(name, "po\"p", texts[i]), 1);
    EXPECT_EQ(repository.add_distribution(name, "po\"p", texts[i]), 1);
    EXPECT_EQ(repository.distribution(name, "po\"p")->text, texts[i]);
    EXPECT_EQ(repository.grammar(repository.add_grammar(name, texts[i])), texts[i]);
  }
  EXPECT_TRUE(repository.check().empty());
  for (const std::string& wrong : {""s, "\xff"s, "a\nb"s, std::string(max_name + 1, 'x')}) {
    EXPECT_THAT(message([&] { repository.add_distribution(wrong, "p", "t"); }), HasSubstr("is no name for a distribution"));
    if (!wrong.empty()) {
      EXPECT_THAT(message([&] { repository.add_distribution("d", wrong, "t"); }),
                  HasSubstr("is no name for a population"));
    }
  }
  EXPECT_EQ(repository.distributions().size(), texts.size());
}

TEST_P(EveryDatabase, WhatIsUndoneLeavesNoVersion) {
  Repository repository = Repository::open(place_, Access::write);
  repository.add_distribution("ratio", "L5", "one");
  {
    auto transaction = repository.begin();
    EXPECT_EQ(repository.add_distribution("ratio", "L5", "two"), 2);
    EXPECT_EQ(repository.add_distribution("ratio", "never", "one"), 1);
  }
  EXPECT_EQ(repository.distribution("ratio", "L5")->text, "one");
  EXPECT_EQ(repository.add_distribution("ratio", "L5", "three"), 2);
  EXPECT_EQ(repository.populations().size(), 1u);
}

TEST_P(EveryDatabase, ManyWritersCountTheVersionsTogether) {
  constexpr int writers = 4, texts = 12;
  Repository::open(place_, Access::write);
  std::array<pid_t, writers> children{};
  for (int c = 0; c < writers; ++c)
    children[std::size_t(c)] = in_child([&] {
      Repository repository = Repository::open(place_, Access::write);
      for (int i = 0; i < texts; ++i)
        for (const char* population : {"", "L5"})
          repository.add_distribution("ratio", population, fmt::format("{} {}", c, i));
    });
  for (const pid_t child : children) EXPECT_EQ(wait_for(child), 0);
  std::map<std::string, std::pair<std::set<int>, std::set<std::string>>> found;
  for (const DistributionRow& row : Repository::open(place_, Access::read).distributions())
    found[row.population].first.insert(row.version), found[row.population].second.insert(row.text);
  ASSERT_EQ(found.size(), 2u);
  for (const auto& [population, rows] : found) {
    EXPECT_EQ(rows.first.size(), std::size_t(writers * texts)) << population;
    EXPECT_EQ(*rows.first.rbegin(), writers * texts) << population;
    EXPECT_EQ(rows.second.size(), std::size_t(writers * texts)) << population;
  }
}

TEST_F(RepositoryTest, AGrammarThatWasChangedByHandIsFound) {
  Repository::open(file_, Access::write).add_grammar("bush", "axiom: A\n");
  ASSERT_EQ(std::system(fmt::format("sqlite3 '{}' \"update grammars set text = 'axiom: B'\"", file_).c_str()), 0);
  EXPECT_THAT(Repository::open(file_, Access::read).check(),
              testing::ElementsAre(HasSubstr("the text of grammar 'bush' (version 1) is damaged")));
}

}  // namespace
}  // namespace forest::repository
