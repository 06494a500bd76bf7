// SPDX-License-Identifier: Apache-2.0
// Programs that are killed, servers that stop, readers beside writers: what is stored is whole, and what was said to be
// stored is there.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <fstream>
#include <span>
#include <thread>

#include "forest/core/hash.h"
#include "forest/repository/schema.h"

#include "tests/effort.h"
#include "tests/every_database.h"

namespace forest::repository {
namespace {

using testing::HasSubstr;

/// Whether the process has ended, though nobody has waited for it yet.
bool has_ended(pid_t process) {
  siginfo_t end{};
  return ::waitid(P_PID, id_t(process), &end, WEXITED | WNOHANG | WNOWAIT) != 0 || end.si_pid == process;
}

bool at_once() { return true; }

/// Starts `body` in another process, which gives a sign after each step, kills it within `microseconds` of the first
/// moment after the sign number `signs` at which it is `time`, and returns how many signs it had given.
std::size_t killed_after(std::size_t signs, double microseconds,
                         const std::function<void(const std::function<void()>& sign)>& body,
                         const std::function<bool()>& time = at_once) {
  int pipe[2];
  if (::pipe(pipe) != 0) throw Error("no pipe");
  const pid_t child = in_child([&] {
    ::close(pipe[0]);
    body([&] {
      if (::write(pipe[1], "+", 1) != 1) ::_exit(1);
    });
  });
  ::close(pipe[1]);
  std::size_t said = 0;
  char byte = 0;
  while (said < signs && ::read(pipe[0], &byte, 1) == 1) ++said;
  while (!time() && !has_ended(child)) continue;
  ::usleep(std::uint32_t(microseconds));
  ::kill(child, SIGKILL);
  wait_for(child);
  while (::read(pipe[0], &byte, 1) == 1) ++said;
  ::close(pipe[0]);
  return said;
}

/// Rows of every table that belong to no neuron.
std::int64_t strays(const std::string& place) {
  Repository repository = Repository::open(place, Access::read);
  std::string sum =
      "select (select count(*) from sections where not exists (select 1 from neurons n where n.id = "
      "sections.id >> 24))";
  for (const char* table :
       {"provenance", "somata", "arbors", "points", "spines", "annotations", "neuron_metrics"})
    sum += fmt::format(
        " + (select count(*) from {0} where not exists (select 1 from neurons n where n.id = {0}.neuron))",
        table);
  return std::get<std::int64_t>(repository.query(sum).rows.at(0).at(0));
}

TEST_P(EveryDatabase, AKilledProgramLeavesWholeNeuronsAndAllItSaidItHadStored) {
  std::vector<Morphology> source;
  for (std::size_t i = 0; i < 40; ++i) source.push_back(neuron(i, 50 + i % 7 * 150, 10));
  Random random(1);
  std::size_t before = 0, interrupted = 0, partly = 0;
  for (int round = 0; round < (is_file() ? 100 : 40); ++round) {
    if (round && round % 8 == 0) renew(), before = 0;
    const auto writing = [&] { return std::filesystem::exists(file_ + "-journal"); };
    const bool while_writing =
        is_file() && round % 2;  // or at any moment: how long a step takes is not known
    const std::size_t said = killed_after(
        before + random.below(4),
        while_writing ? random.uniform(0., 400.) : random.uniform(0., is_file() ? 4000. : 20'000.),
        [&](const auto& sign) {
          Repository repository = Repository::open(place_, Access::write);
          for (std::size_t i = 0; i < source.size(); ++i) {
            repository.add(source[i], called(std::to_string(i)));
            sign();
          }
        },
        while_writing ? std::function<bool()>(writing) : at_once);
    interrupted += is_file() && writing();
    std::size_t now = 0;
    const std::string sentence = message([&] { now = whole_neurons(place_, source); });
    if (sentence != "no error") {
      EXPECT_THAT(sentence, HasSubstr(is_file() ? "there is no such repository" : "holds no repository"));
      EXPECT_EQ(said + before, 0u);
      continue;
    }
    EXPECT_EQ(strays(place_), 0);
    EXPECT_GE(now, said);
    EXPECT_GE(now, before);
    partly += now < source.size();
    before = now;
  }
  EXPECT_GT(partly, 0u);
  if (is_file()) {
    EXPECT_GT(interrupted, 0u) << "none was killed while it wrote, so this has tested nothing";
  }
}

TEST_P(EveryDatabase, AKilledBatchIsStoredWholeOrNotAtAll) {
  std::vector<Morphology> source;
  for (std::size_t i = 0; i < 20; ++i) source.push_back(neuron(i, 200));
  Random random(5);
  std::size_t without = 0;
  for (int round = 0; round < 16; ++round) {
    renew();
    Repository::open(place_, Access::write).add(source[0], called("0"));
    const std::size_t said = killed_after(random.below(21), random.uniform(0., 2000.), [&](const auto& sign) {
      Repository repository = Repository::open(place_, Access::write);
      auto transaction = repository.begin();
      repository.add_model({.name = "bush", .text = "text", .distributions = {{"ratio", "text"}}});
      for (std::size_t i = 1; i < source.size(); ++i)
        repository.add(source[i], called(std::to_string(i))), sign();
      transaction.commit();
      sign();
    });
    const std::size_t now = whole_neurons(place_, source);
    EXPECT_TRUE(now == 1 || now == source.size()) << now;
    EXPECT_EQ(Repository::open(place_, Access::read).models().size(), now == 1 ? 0u : 1u);
    EXPECT_EQ(Repository::open(place_, Access::read).distributions().size(), now == 1 ? 0u : 1u);
    EXPECT_TRUE(said < source.size() || now == source.size());
    EXPECT_EQ(strays(place_), 0);
    without += now == 1 && said > 0;
  }
  EXPECT_GT(without, 0u) << "none was killed within its batch";
}

TEST_P(EveryDatabase, AKilledRemovalTakesAllOfANeuronOrNothing) {
  std::vector<Morphology> source;
  for (std::size_t i = 0; i < 24; ++i) source.push_back(neuron(i, 400, 10));
  Repository::open(place_, Access::write).populations();
  Random random(6);
  std::size_t partly = 0;
  for (int round = 0; round < (is_file() ? 24 : 12); ++round) {
    {
      Repository repository = Repository::open(place_, Access::write);
      for (std::size_t i = 0; i < source.size(); ++i) repository.add(source[i], called(std::to_string(i)));
    }
    std::vector<NeuronId> ids;
    for (const NeuronRow& row : Repository::open(place_, Access::read).neurons()) ids.push_back(row.id);
    ASSERT_EQ(ids.size(), source.size());
    const std::size_t said = killed_after(random.below(12), random.uniform(0., 4000.), [&](const auto& sign) {
      Repository repository = Repository::open(place_, Access::write);
      for (const NeuronId id : ids) {
        if (!repository.remove(id)) ::_exit(1);
        sign();
      }
    });
    const std::size_t left = whole_neurons(place_, source);
    EXPECT_LE(left, source.size() - said);
    EXPECT_GE(left + said + 1, source.size()) << "one at most was removed and not yet said to be";
    EXPECT_EQ(strays(place_), 0);
    partly += left > 0 && left < source.size();
  }
  EXPECT_GT(partly, 0u);
}

std::size_t terminals(const Morphology& m) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < m.sections().size(); ++i) count += m.is_terminal(SectionId(i));
  return count;
}

const std::string grammar_text = "axiom: A\nA -> \\(90) F(1) A\n";

/// What makes the tables those of an older version, in either database.
std::string as_version(int version) {
  if (version == 7)  // fewer metrics, and one that was measured otherwise
    return "delete from neuron_metrics where metric > 47; delete from metrics where id > 47; "
           "update neuron_metrics set value = 2 * value where metric = "
           "(select id from metrics where name = 'section_radial_distances'); ";
  std::string sql = "drop view section; drop view junction; ";
  for (const char* column : {"length", "area", "start_diameter", "end_diameter", "end_x", "end_y", "end_z"})
    sql += fmt::format(
        "alter table sections rename column {0}_{1} to {0}; update sections set {0} = {0} / 1e6; ", column,
        column == std::string_view("area") ? "nm2" : "pm");
  const char* views = "create view section as select 1 as one; create view junction as select 1 as one; ";
  if (version >= 5) return sql + views;
  sql +=
      "drop view metric; alter table neuron_metrics rename to later_metrics; "
      "create table neuron_metrics (metric integer not null, neuron integer not null, value double precision "
      "not null, primary key (metric, value, neuron)); "
      "create unique index metrics_of_neuron on neuron_metrics (neuron, metric); "
      "insert into neuron_metrics select metric, neuron, value from later_metrics; drop table later_metrics; "
      "create view metric as select 1 as one; ";
  if (version == 4) return sql + views;
  sql +=
      "drop view model; drop view distribution; drop index distributions_by_name; "
      "drop table model_distributions; drop table models; "
      "update grammars set text = 'axiom: A\\x0AA -> \\\\(90) F(1) A\\x0A'; ";
  if (version == 3) return sql + views;
  sql +=
      "alter table sections rename to later; "
      "create table sections (neuron integer not null, number integer not null, parent integer, arbor "
      "integer not null, "
      "branch_order integer not null, length double precision not null, kind integer not null, tag integer "
      "not null, "
      "soma_point integer not null, first_point integer not null, point_count integer not null, "
      "daughters integer not null default 0, area double precision not null default 0, primary key (neuron, "
      "number)); "
      "insert into sections select cast(id >> 24 as integer), cast(id & 16777215 as integer), parent, arbor, "
      "branch_order, "
      "length, kind, tag, soma_point, "
      "cast(sum(points) over (partition by id >> 24 order by id) - points as integer), points, daughters, "
      "area from later; "
      "drop table later; ";
  if (version == 2) return sql + views;
  return sql +
         "drop view neuron; drop view metric; drop table neuron_metrics; drop table metrics; drop table "
         "distributions; "
         "alter table points drop column packing; alter table sections drop column daughters; "
         "alter table sections drop column area; ";
}

/// Stores the points of neurons 1, 2, … as they are, since no older version packed them in today's way.
std::string not_packed(std::span<const Morphology> neurons, bool is_file) {
  std::string sql;
  for (std::size_t i = 0; i < neurons.size(); ++i) {
    sql += fmt::format("update points set packing = 0, data = {}", is_file ? "x'" : "'\\x");
    for (const std::byte byte : std::as_bytes(neurons[i].points())) sql += fmt::format("{:02x}", int(byte));
    sql += fmt::format("' where neuron = {};\n", i + 1);
  }
  return sql;
}

/// Makes the tables of a file, or of a database on the server, those of an older version, which holds these neurons.
bool made_older(const std::string& file, const std::string& name, int version,
                std::span<const Morphology> neurons, const std::string& besides = "") {
  const auto script = std::filesystem::temp_directory_path() / fmt::format("forest-older-{}.sql", ::getpid());
  const bool is_file = name.empty();
  const std::string sql = not_packed(neurons, is_file) + besides + as_version(version);
  write_file(script, is_file
                         ? fmt::format("begin;\n{}\npragma user_version = {};\ncommit;\n", sql, version)
                         : fmt::format("{}\nupdate brainforest_schema set version = {};\n", sql, version));
  const bool made =
      is_file ? std::system(fmt::format("sqlite3 -bail '{}' <'{}'", file, script.string()).c_str()) == 0
              : PostgresqlServer::get().run_file(script, name);
  std::filesystem::remove(script);
  return made;
}

TEST_P(EveryDatabase, AnOlderRepositoryIsBroughtUpToDateWholeOrNotAtAll) {
  constexpr int rounds = sanitized ? 2 : 8;
  const auto& server = PostgresqlServer::get();
  std::vector<Morphology> source;
  for (std::size_t i = 0; i < 30; ++i) source.push_back(neuron(i, 60));
  std::vector<NeuronRow> rows;
  std::string hash;
  {
    Repository repository = Repository::open(place_, Access::write);
    hash = repository.add_grammar("bush", grammar_text);
    for (std::size_t i = 0; i < source.size(); ++i) repository.add(source[i], called(std::to_string(i)));
    rows = repository.neurons();
  }
  const std::string newest = name_, new_bytes = is_file() ? bytes_of(file_) : "";
  Random random(3);
  std::size_t unfinished = 0;
  for (const int version : {1, 2, 3, 4, 5, 6, 7}) {
    std::string old_bytes, old_name;
    is_file() ? write_file(file_, new_bytes) : renew(newest);
    ASSERT_TRUE(made_older(file_, name_, version, source));
    if (is_file()) old_bytes = bytes_of(file_);
    old_name = name_;
    for (int round = 0; round < rounds; ++round) {
      is_file() ? write_file(file_, old_bytes) : renew(old_name);
      killed_after(0, random.uniform(0., is_file() ? 30'000. : 150'000.),
                   [&](const auto&) { Repository::open(place_, Access::read); });
      if (is_file()) {
        unfinished += bytes_of(file_) == old_bytes || std::filesystem::exists(file_ + "-journal");
      } else {
        unfinished += server.run(
            fmt::format("select 1 / (case version when {} then 1 else 0 end) from brainforest_schema",
                        version),
            name_);
      }
      EXPECT_EQ(whole_neurons(place_, source), source.size()) << "opening it again ends what was begun";
    }
    Repository repository = Repository::open(place_, Access::read);
    EXPECT_EQ(repository.neurons_where("total_length > 0 and sholl_maximum > 0").size(), source.size());
    EXPECT_THAT(repository.check(), testing::IsEmpty()) << "all metrics are those of the neurons";
    EXPECT_EQ(repository.grammar(hash), grammar_text);
    const auto count = [&](const char* question) {
      return std::get<std::int64_t>(repository.query(question).rows[0][0]);
    };
    EXPECT_EQ(count("select count(*) from junction where junction = 'terminal' and neuron = 5"),
              std::int64_t(terminals(source[4])));
    EXPECT_EQ(count(is_file() ? "select count(*) from sqlite_master where name like 'old%'"
                              : "select count(*) from pg_class where relname like 'old%'"),
              0);
    EXPECT_EQ(repository.query("select text from model where name = 'bush' and version = 1").rows[0][0],
              Answer::Value(grammar_text));
    const auto lengths = repository.query("select sum(length) from section where neuron = 9").rows[0][0];
    EXPECT_NEAR(std::get<double>(lengths), rows[8].length, 1e-6 * rows[8].length);
    EXPECT_EQ(Repository::open(place_, Access::write).add_distribution("ratio", "default", "text"), 1);
    EXPECT_EQ(Repository::open(place_, Access::write).add(neuron(99), called("another")).already_there,
              false);
  }
  EXPECT_GT(unfinished, 0u) << "none was killed before it was done, so this has tested nothing";
}

TEST_P(EveryDatabase, ADamagedNeuronOfAnOlderRepositoryGetsNoMetrics) {
  const std::vector source{neuron(1), neuron(2)};
  {
    Repository repository = Repository::open(place_, Access::write);
    for (std::size_t i = 0; i < 2; ++i) repository.add(source[i], called(std::to_string(i)));
  }
  ASSERT_TRUE(made_older(file_, name_, 7, source, "delete from somata where neuron = 2;\n"));
  Repository repository = Repository::open(place_, Access::read);
  const auto rows = repository
                        .query(
                            "select neuron, count(*) from neuron_metrics where metric > 47 group by neuron "
                            "order by neuron")
                        .rows;
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0][0], Answer::Value(std::int64_t(1)));
}

TEST_P(EveryDatabase, WhatWasGrownBeforeVersion7IsKnownAgainThoughItWasCorrectedSince) {
  const auto value = [&](const char* question) {
    return Repository::open(place_, Access::read).query(question).rows.at(0).at(0);
  };
  Grown grown{"bush", "", 5, 6};
  NeuronId id;
  std::string fingerprint;
  {
    Repository repository = Repository::open(place_, Access::write);
    grown.grammar_hash = repository.add_grammar("bush", grammar_text);
    id = repository.add(neuron(1), {.name = "a", .provenance = grown}).id;
    const auto sum = std::uint64_t(std::get<std::int64_t>(value("select checksum from neurons")));
    const std::string facts = fmt::format("{} 5 6 {}", grown.grammar_hash, sum);
    fingerprint = hash_hex(std::as_bytes(std::span(facts)));
    repository.revise(std::vector<Revision>{{.id = id,
                                             .version = repository.versions(std::vector{id})[0],
                                             .name = "b",
                                             .morphology = neuron(2)}});
  }
  ASSERT_TRUE(made_older(file_, name_, 6, std::vector{neuron(2)},
                         fmt::format("update neurons set fingerprint = '{}';\n", fingerprint)));
  Repository repository = Repository::open(place_, Access::write);
  EXPECT_EQ(value("select fingerprint from neurons"), Answer::Value(fingerprint));
  const Added again = repository.add(neuron(1), {.name = "a", .provenance = grown});
  EXPECT_TRUE(again.already_there);
  EXPECT_EQ(again.id, id);
  EXPECT_EQ(again.name, "b");
  EXPECT_EQ(repository.morphology(id), neuron(2));
  grown.index = 7;
  EXPECT_FALSE(repository.add(neuron(1), {.name = "c", .provenance = grown}).already_there);
  EXPECT_TRUE(repository.add(neuron(1), {.name = "c", .provenance = grown}).already_there);
  EXPECT_THAT(repository.check(), testing::IsEmpty());
}

TEST_P(EveryDatabase, TwoProgramsMayBringAnOlderRepositoryUpToDate) {
  std::vector<Morphology> source;
  for (std::size_t i = 0; i < 20; ++i) source.push_back(neuron(i, 60));
  {
    Repository repository = Repository::open(place_, Access::write);
    for (std::size_t i = 0; i < source.size(); ++i) repository.add(source[i], called(std::to_string(i)));
  }
  ASSERT_TRUE(made_older(file_, name_, 2, source));
  std::array<pid_t, 4> children{};
  for (pid_t& child : children)
    child = in_child([&] {
      if (Repository::open(place_, Access::read).neurons().size() != source.size())
        throw Error("neurons are missing");
    });
  for (const pid_t child : children) EXPECT_EQ(wait_for(child), 0);
  EXPECT_EQ(whole_neurons(place_, source), source.size());
}

TEST_P(EveryDatabase, WhoReadsWhileThousandsAreStoredSeesWholeNeurons) {
  constexpr std::size_t count = 3000;
  std::vector<Morphology> source;
  for (std::size_t i = 0; i < count; ++i) source.push_back(neuron(i, 6, 4));
  Repository::open(place_, Access::write);
  const pid_t writer = in_child([&] {
    Repository repository = Repository::open(place_, Access::write);
    for (std::size_t i = 0; i < count;) {
      auto transaction = repository.begin();
      for (const std::size_t end = i + 1 + i % 40; i < end && i < count; ++i)
        repository.add(source[i], called(std::to_string(i)));
      transaction.commit();
      ::usleep(1000);  // as one who has other things to do between two files
    }
  });
  Random random(9);
  Repository repository = Repository::open(place_, Access::read);
  std::size_t before = 0, partly = 0;
  int status = 0;
  for (bool done = false; !done;) {
    done = ::waitpid(writer, &status, WNOHANG) == writer;
    const auto rows = repository.neurons();
    ASSERT_GE(rows.size(), before);
    before = rows.size();
    partly += before > 0 && before < count;
    std::vector<std::size_t> chosen;
    if (!rows.empty()) chosen = {rows.size() - 1, random.below(std::uint32_t(rows.size()))};
    for (const std::size_t i : chosen) {
      ASSERT_EQ(rows[i].name, std::to_string(i)) << "in the order of storing, none left out";
      ASSERT_EQ(repository.morphology(rows[i].id), source[i]);
    }
    if (random.below(8) == 0) {
      ASSERT_GE(repository.neurons_where("number_of_sections = 6").size(), before);
      // One question sees one moment: every table has what belongs to the neurons that are there.
      const auto counts =
          repository
              .query(
                  "select count(*), 6 * count(*), sum(sections), (select count(*) from sections), "
                  "(select count(*) from provenance), (select count(*) from metric where metric = "
                  "'number_of_sections') from neurons")
              .rows.at(0);
      const auto count_of = [&](std::size_t i) { return std::get<std::int64_t>(counts[i]); };
      ASSERT_GE(count_of(0), std::int64_t(before));
      if (count_of(0) > 0) {
        ASSERT_EQ(count_of(2), count_of(1));
      }
      ASSERT_EQ(count_of(3), count_of(1));
      ASSERT_EQ(count_of(4), count_of(0));
      ASSERT_EQ(count_of(5), count_of(0));
    }
  }
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  EXPECT_EQ(before, count);
  EXPECT_GT(partly, 0u) << "it was stored too quickly for a reader to see it grow";
}

TEST(Postgresql, AServerThatStopsIsASentenceAndLosesNothing) {
  const PostgresqlServer server("halted");
  FOREST_POSTGRESQL(server);
  ASSERT_TRUE(server.run("create database cells"));
  const std::string place = server.address("cells");
  std::vector<Morphology> source;
  for (std::size_t i = 0; i < 400; ++i) source.push_back(neuron(i, 100));
  const auto is_sentence = [&](const std::string& said) {
    EXPECT_THAT(said, testing::StartsWith(place + ": "));
    EXPECT_THAT(said, testing::AnyOf(HasSubstr("the server is shutting down"),
                                     HasSubstr("the connection to the server is lost")));
    EXPECT_EQ(std::ranges::count(said, '\n'), 0);
  };
  std::size_t there = 0;
  for (const char* how : {"fast", "immediate"}) {
    // While nothing is asked, within a batch, and at any moment of many.
    {
      Repository repository = Repository::open(place, Access::write);
      repository.add(source[there], called(std::to_string(there))), ++there;
      ASSERT_TRUE(server.halt(how));
      for (int again = 0; again < 2; ++again) {
        is_sentence(message([&] { repository.add(source[there], called(std::to_string(there))); }));
        is_sentence(message([&] { repository.neurons(); }));
        is_sentence(message([&] { repository.morphology(NeuronId(1)); }));
        is_sentence(message([&] { repository.add_distribution("ratio", "default", "text"); }));
        is_sentence(message([&] { repository.remove(NeuronId(1)); }));
      }
      EXPECT_THAT(message([&] { Repository::open(place, Access::read); }),
                  HasSubstr("the server cannot be reached"));
    }
    ASSERT_TRUE(server.resume());
    EXPECT_EQ(whole_neurons(place, source), there);
    {
      Repository repository = Repository::open(place, Access::write);
      auto transaction = repository.begin();
      for (std::size_t i = there; i < there + 5; ++i) repository.add(source[i], called(std::to_string(i)));
      ASSERT_TRUE(server.halt(how));
      is_sentence(message([&] { transaction.commit(); }));
    }
    ASSERT_TRUE(server.resume());
    EXPECT_EQ(whole_neurons(place, source), there);
    {
      Repository repository = Repository::open(place, Access::write);
      std::thread halting([&] {
        std::this_thread::sleep_for(std::chrono::milliseconds(30));
        server.halt(how);
      });
      std::size_t stored = there;
      const std::string said = message([&] {
        for (; stored < source.size(); ++stored)
          repository.add(source[stored], called(std::to_string(stored)));
      });
      halting.join();
      is_sentence(said);
      ASSERT_TRUE(server.resume());
      const std::size_t now = whole_neurons(place, source);
      EXPECT_TRUE(now == stored || now == stored + 1)
          << now << " where " << stored << " were said to be stored";
      there = now;
    }
    EXPECT_EQ(strays(place), 0);
  }
}

}  // namespace
}  // namespace forest::repository
