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
  const std::string first =
      "# of a daughter's diameter to its parent's\ndistribution ratio = truncnormal(0.75, 0.1, 0.5, 1)\n";
  const std::string second =
      "table mean = 1: 0.9, 2: 0.7\ndistribution ratio(order) = normal(mean(order), 0.1)\n";
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
  EXPECT_THAT(all,
              testing::ElementsAre("/ratio 1 false", "/ratio 2 true", "L23/ratio 1 false", "L5/angle 1 true",
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

TEST_P(EveryDatabase, AVersionThatIsRemovedLeavesTheOthersAndWhatNeuronsGrewFrom) {
  Repository repository = Repository::open(place_, Access::write);
  const auto count = [&](const char* table) {
    const std::string question = fmt::format("select count(*) from {}", table);
    return std::get<std::int64_t>(Repository::open(place_, Access::read).query(question).rows[0][0]);
  };
  const auto add = [&](const std::string& text, const std::string& ratio) {
    return repository.add_model(
        {.name = "bush", .text = text, .distributions = {{"ratio", ratio}, {"turn", "the same"}}});
  };
  add("first", "a"), add("second", "b"), add("first", "a"), add("third", "c");
  const std::string hash = repository.add_grammar("bush", "second");
  repository.add(neuron(0), {.name = "b", .provenance = Grown{"bush", hash, 1, 0}});
  EXPECT_FALSE(repository.remove_model("bush", 5));
  EXPECT_FALSE(repository.remove_model("shrub", 1));

  EXPECT_TRUE(repository.remove_model("bush", 1)) << "version 3 has its text, too";
  EXPECT_FALSE(repository.remove_model("bush", 1));
  EXPECT_EQ(count("grammars"), 3);
  EXPECT_EQ(repository.model("bush", 3)->text, "first");
  EXPECT_TRUE(repository.remove_model("bush", 2)) << "a neuron was grown from it";
  EXPECT_EQ(count("grammars"), 3);
  EXPECT_EQ(repository.grammar(hash), "second");
  EXPECT_TRUE(repository.check(Progress::none()).empty());
  EXPECT_TRUE(repository.remove_model("bush", 4));
  EXPECT_EQ(count("grammars"), 2);
  EXPECT_EQ(repository.models().size(), 1u);
  EXPECT_EQ(repository.distribution("bush.ratio", "")->text, "a");
  EXPECT_EQ(repository.distribution("bush.turn", "")->text, "the same");
  EXPECT_EQ(add("fourth", "d").first, 4) << "counted from the newest that is there";
  EXPECT_TRUE(repository.remove_model("bush", 3) && repository.remove_model("bush", 4));
  EXPECT_TRUE(repository.models().empty());
  EXPECT_EQ(count("distributions"), 0);
  EXPECT_EQ(count("grammars"), 1);
  {
    auto transaction = repository.begin();
    add("fifth", "e");
    transaction.commit();
  }
  {
    auto undone = repository.begin();
    EXPECT_TRUE(repository.remove_model("bush", 1));
  }
  EXPECT_EQ(repository.model("bush")->text, "fifth");
}

TEST_P(EveryDatabase, WhatNeuronsAreGrownFromIsAModel) {
  Repository repository = Repository::open(place_, Access::write);
  const std::string text = "axiom: A\n\tA -> \\(90) F(1) A  # \"turned\", µm\n";
  const std::string hash = repository.add_grammar("bush", text);
  repository.add_grammar("bush", text + "\n");
  repository.add_grammar("alder", text);
  EXPECT_EQ(repository.add_grammar("bush", text), hash);
  for (std::size_t i = 0; i < 3; ++i)
    repository.add(neuron(i), {.name = fmt::format("b{}", i), .provenance = Grown{"bush", hash, 1, i}});
  const auto models = repository.models();
  ASSERT_EQ(models.size(), 3u) << "to grow from an earlier version again makes none";
  EXPECT_EQ(models[0].name + models[1].name + models[2].name, "alderbushbush");
  EXPECT_EQ(models[1].version, 1);
  EXPECT_EQ(models[1].text, text);
  EXPECT_EQ(models[1].hash, hash);
  EXPECT_EQ(models[1].neurons, 3u);
  EXPECT_EQ(models[1].origin, "neurons were grown from it");
  EXPECT_EQ(models[2].version, 2);
  EXPECT_EQ(models[2].neurons, 0u);
  EXPECT_TRUE(models[0].distributions.empty());
  for (int again = 0; again < 2; ++again) repository.add_grammar("alder", text, {{"ratio", "one"}});
  repository.add_model({.name = "bush", .text = text + "\n", .distributions = {{"ratio", "one"}}});
  for (const ModelRow& m : repository.models())
    EXPECT_EQ(m.distributions.size(), m.name == "bush" && m.version == 1 ? 0u : 1u) << "what it had none of";
  const Answer view = repository.query("select text, neurons from model where name = 'bush' and version = 1");
  EXPECT_EQ(view.rows.at(0).at(0), Answer::Value(text)) << "as a person reads it with any client";
  EXPECT_EQ(view.rows[0][1], Answer::Value(std::int64_t(3)));
}

TEST_P(EveryDatabase, AModelHasVersionsOfWhichNoneChanges) {
  using Distributions = std::vector<std::pair<std::string, int>>;
  const std::string first = "axiom: A\nA -> F(1)\n", second = "axiom: A\nA -> F(2)\n";
  NewModel model{.name = "it's",
                 .text = first,
                 .population = "L5 \"thick\"",
                 .origin = "fitted to \xff\n12 cells",
                 .distributions = {{"ratio", "one"}, {"angle", "one"}}};
  const auto stored = [&] { return Repository::open(place_, Access::write).add_model(model); };
  EXPECT_EQ(stored(), std::pair(1, false));
  EXPECT_EQ(stored(), std::pair(1, true)) << "the same text is the same version";
  model.text = second, model.origin = "edited", model.population = "";
  model.distributions = {{"ratio", "two"}, {"angle", "one"}};
  EXPECT_EQ(stored(), std::pair(2, false));
  model.population = "L5 \"thick\"";
  EXPECT_EQ(stored(), std::pair(2, true)) << "whose population was that of the version before";
  model.text = first, model.distributions = {{"ratio", "one"}};
  EXPECT_EQ(stored(), std::pair(3, false)) << "going back is a step too";
  model.population = "L23";
  EXPECT_EQ(stored(), std::pair(4, false)) << "and so is another population";

  const Repository repository = Repository::open(place_, Access::read);
  const auto models = repository.models();
  ASSERT_EQ(models.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(models[i].version, int(i) + 1);
    EXPECT_EQ(models[i].text, i == 1 ? second : first);
    EXPECT_EQ(models[i].population, i < 3 ? "L5 \"thick\"" : "L23");
    EXPECT_FALSE(models[i].program.empty());
  }
  EXPECT_EQ(models[0].origin, "fitted to \xff\n12 cells");
  EXPECT_EQ(models[0].distributions, (Distributions{{"it's.angle", 1}, {"it's.ratio", 1}}));
  EXPECT_EQ(models[1].distributions, (Distributions{{"it's.angle", 1}, {"it's.ratio", 2}}));
  EXPECT_EQ(models[2].distributions, (Distributions{{"it's.ratio", 3}}));
  EXPECT_EQ(models[3].distributions, (Distributions{{"it's.ratio", 1}}));
  EXPECT_EQ(repository.distribution("it's.ratio", "L5 \"thick\"", 2)->text, "two");
  EXPECT_EQ(repository.model("it's")->version, 4);
  EXPECT_EQ(repository.model("it's", 2)->text, second);
  EXPECT_FALSE(repository.model("it's", 5).has_value());
  EXPECT_FALSE(repository.model("its").has_value());
  EXPECT_TRUE(repository.check().empty());

  model.distributions = {{"bad\nname", "t"}};
  EXPECT_THAT(message(stored), HasSubstr("is no name for a distribution"));
  model.distributions.clear(), model.name = "";
  EXPECT_THAT(message(stored), HasSubstr("is no name for a model"));
  EXPECT_EQ(repository.models().size(), 4u);
}

TEST_P(EveryDatabase, AnyTextComesBackAsItWasStored) {
  Repository repository = Repository::open(place_, Access::write);
  std::string bytes;
  for (int i = 0; i < 256; ++i) bytes += char(i);
  const std::vector<std::string> texts{
      "",          bytes,   "'); drop table distributions; --",  "\\x41 \\\\ \\", "a\r\nb\r\n",
      "\\\xff\\n", ":id ?", std::string(3'000'000, 'x') + "\xc3"};
  for (std::size_t i = 0; i < texts.size(); ++i) {
    const std::string name = fmt::format("it's {}", i);
    EXPECT_EQ(repository.add_distribution(name, "po\"p", texts[i]), 1);
    EXPECT_EQ(repository.add_distribution(name, "po\"p", texts[i]), 1);
    EXPECT_EQ(repository.distribution(name, "po\"p")->text, texts[i]);
    EXPECT_EQ(repository.grammar(repository.add_grammar(name, texts[i])), texts[i]);
    EXPECT_EQ(repository.model(name)->text, texts[i]);
  }
  EXPECT_TRUE(repository.check().empty());
  for (const std::string& wrong : {""s, "\xff"s, "a\nb"s, std::string(max_name + 1, 'x')}) {
    EXPECT_THAT(message([&] { repository.add_distribution(wrong, "p", "t"); }),
                HasSubstr("is no name for a distribution"));
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
          repository.add_distribution("ratio", population, fmt::format("{} {}", c, i)),
              repository.add_model({.name = "m", .text = fmt::format("{} {} {}", c, i, population)});
    });
  for (const pid_t child : children) EXPECT_EQ(wait_for(child), 0);
  std::map<std::string, std::pair<std::set<int>, std::set<std::string>>> found;
  std::set<std::string> texts_of_models;
  int models = 0;
  for (const DistributionRow& row : Repository::open(place_, Access::read).distributions())
    found[row.population].first.insert(row.version), found[row.population].second.insert(row.text);
  for (const ModelRow& row : Repository::open(place_, Access::read).models()) {
    EXPECT_EQ(row.version, ++models);
    texts_of_models.insert(row.text);
  }
  EXPECT_EQ(models, 2 * writers * texts);
  EXPECT_EQ(int(texts_of_models.size()), models);
  ASSERT_EQ(found.size(), 2u);
  for (const auto& [population, rows] : found) {
    EXPECT_EQ(rows.first.size(), std::size_t(writers * texts)) << population;
    EXPECT_EQ(*rows.first.rbegin(), writers * texts) << population;
    EXPECT_EQ(rows.second.size(), std::size_t(writers * texts)) << population;
  }
}

TEST_F(RepositoryTest, AGrammarThatWasChangedByHandIsFound) {
  Repository::open(file_, Access::write).add_grammar("bush", "axiom: A\n");
  ASSERT_EQ(std::system(fmt::format("sqlite3 '{}' \"update grammars set text = 'axiom: B'\"", file_).c_str()),
            0);
  EXPECT_THAT(Repository::open(file_, Access::read).check(),
              testing::ElementsAre(HasSubstr("the text of model 'bush' (version 1) is damaged")));
}

}  // namespace
}  // namespace forest::repository
