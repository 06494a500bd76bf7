// SPDX-License-Identifier: Apache-2.0
// What the tests of a repository share: a place of each database, neurons, and other processes that can be killed.
#pragma once

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <string>
#include <unistd.h>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/random.h"
#include "forest/repository/repository.h"

#include "tests/postgresql.h"

namespace forest::repository {

/// A folder of its own for each test.
class RepositoryTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / fmt::format("forest-repository-{}", ::getpid());
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
    file_ = (folder_ / "cells.db").string();
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path folder_;
  std::string file_;
};

/// The same of every database: place_ names a repository that does not exist yet.
class EveryDatabase : public RepositoryTest, public testing::WithParamInterface<std::string> {
 protected:
  void SetUp() override {
    RepositoryTest::SetUp();
    place_ = file_;
    if (GetParam() == "sqlite") return;
    const auto& server = PostgresqlServer::get();
    FOREST_POSTGRESQL(server);
    ASSERT_NO_FATAL_FAILURE(renew());
  }
  bool is_file() const { return GetParam() == "sqlite"; }
  /// From here on place_ names a repository that does not exist yet; of PostgreSQL with the tables of `like`.
  void renew(const std::string& like = "template1") {
    if (is_file()) {
      std::filesystem::remove(place_);
      return;
    }
    static int count = 0;
    name_ = fmt::format("cells{}", ++count);
    ASSERT_TRUE(PostgresqlServer::get().run(fmt::format("create database {} template {}", name_, like)));
    place_ = PostgresqlServer::get().address(name_);
  }

  std::string place_, name_;  // of the database on the server
};

inline std::string bytes_of(const std::filesystem::path& path) {
  return std::string(MappedFile(path).text());
}

inline std::string message(const std::function<void()>& body) {
  try {
    body();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

/// A random neuron that uses everything a Morphology has.
inline Morphology neuron(std::uint64_t number, std::size_t sections = 40, std::size_t points = 6) {
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
                         .head = {value(), s % 2 ? -0.f : 0.f, value()},
                         .head_diameter = 0.3f,
                         .neck_diameter = 0.1f,
                         .shape = SpineShape(s % 6)});
  }
  builder.annotate("species", "rat");
  using namespace std::string_literals;
  builder.annotate("comment \xe9 \\x41 \\", "Latin-1 \xb5m, a zero \0, a newline \n"s);
  builder.annotate("", "");
  return builder.build();
}

inline NewNeuron called(std::string name, std::string population = "default") {
  return {.name = name,
          .population = std::move(population),
          .provenance = Traced{name + ".swc", "hash of " + name}};
}

/// Runs `body` in another process and returns its pid.
inline pid_t in_child(const std::function<void()>& body) {
  const pid_t pid = ::fork();
  if (pid != 0) return pid;
  try {
    body();
  } catch (const std::exception& error) {
    fmt::print(stderr, "child: {}\n", error.what());
    ::_exit(1);
  }
  ::_exit(0);
}

/// The exit status of a child; -1 when a signal ended it.
inline int wait_for(pid_t pid) {
  int status = 0;
  ::waitpid(pid, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

/// Every neuron in the file is whole and the one its name says; returns how many there are.
inline std::size_t whole_neurons(const std::string& file, const std::vector<Morphology>& source) {
  const Repository repository = Repository::open(file, Access::read);
  EXPECT_THAT(repository.check(), testing::IsEmpty());
  const auto rows = repository.neurons();
  for (const NeuronRow& row : rows) EXPECT_EQ(repository.morphology(row.id), source.at(std::stoul(row.name)));
  return rows.size();
}

}  // namespace forest::repository
