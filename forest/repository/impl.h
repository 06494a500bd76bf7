// SPDX-License-Identifier: Apache-2.0
// What an open repository is inside, and what its files share: repository.cpp stores, search.cpp finds, knowledge.cpp keeps
// models, revision.cpp corrects, check.cpp compares, refill.cpp brings up what an earlier version stored.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <soci/soci.h>

#include "forest/core/error.h"
#include "forest/repository/database.h"
#include "forest/repository/insert.h"
#include "forest/repository/repository.h"
#include "forest/repository/rows.h"
#include "forest/repository/statements.h"

namespace forest::repository {

using soci::into;
using soci::use;

/// How long the vectors must be that receive `count` rows. SOCI 4.0 leaves a vector of length 1 unfilled when
/// the question has a parameter; it shortens longer ones to the number of rows that came.
inline std::size_t room(std::size_t count) { return count + 2; }

inline int number_of(NeuronId id) { return int(id.value()); }

std::string hash_of(std::string_view text);
void check_name(std::string_view what, std::string_view name);  // throws Error when it is none

// What a column of text, or of whole numbers, answered.
std::string text_of(const Answer::Value& value);
std::int64_t number_in(const Answer::Value& value);

struct Prepared::Data {
  Morphology morphology;
  Rows rows;
  std::string packed_points;
  std::uint64_t sum;
};

struct Repository::Impl {
  std::string place;
  std::shared_ptr<Database> database;
  soci::session& sql;
  std::unique_ptr<Statements> insert;  // prepared on first use
  bool writing = false;                // a transaction is open
  bool failed = false;                 // and cannot be committed any more
  // Those last stored under: thousands of neurons have the same.
  std::pair<std::string, int> known_population, known_grammar;
  std::string known_hash;
  /// The numbers that were given last in the open transaction, by population and name; all before are taken.
  std::map<std::pair<int, std::string>, int> last_numbers;
  std::optional<bool> older_grown;  // what holds_older_grown() found

  Impl(const std::string& at, std::shared_ptr<Database> open)
      : place(at), database(std::move(open)), sql(database->sql()) {}

  /// What an earlier version stored, with what this one knows of it besides.
  static void refill(Database& database, int from);
  void refill_shapes();
  void refill_metrics();
  void refill_grammars();

  int number_of_metric(const statistics::Metric& metric);

  /// Calls `body`; errors of the database become sentences.
  template <class Body>
  auto guarded(Body&& body) const {
    try {
      return body();
    } catch (...) {
      database->rethrow(place);
      throw;  // not reached: compilers do not believe it of a virtual function
    }
  }

  void begin_writing() {
    database->begin_writing();
    writing = true;
    last_numbers.clear();  // another program may have removed neurons
  }
  void undo() noexcept;

  /// Stores what waits to be stored together with more of its kind.
  void settle() const {
    if (insert) insert->finish();
  }

  /// Calls `body` in the open transaction or one of its own; one of its own is committed, or undone when
  /// `body` throws. With `settled`, all that was stored before can be seen by `body`.
  template <class Body>
  auto write(Body&& body, bool settled = true) {
    return guarded([&] {
      if (writing) {
        if (failed || database->is_undone())
          throw Error(place + ": the open transaction has failed before; begin another");
        try {
          if (settled) settle();
          return body();
        } catch (const soci::soci_error&) {
          failed = true;
          throw;
        }
      }
      begin_writing();
      try {
        auto result = body();
        settle();
        sql << "commit";
        writing = false;
        return result;
      } catch (...) {
        undo();
        throw;
      }
    });
  }

  /// Calls `body`, whose questions all see the same state of the database.
  template <class Body>
  auto read(Body&& body) const {
    return guarded([&] {
      struct End {
        soci::session* sql;
        ~End() {
          try {
            if (sql) *sql << "commit";
          } catch (const std::exception&) {
          }
        }
      };
      if (writing)
        settle();
      else
        database->begin_reading();
      const End end{writing ? nullptr : &sql};
      return body();
    });
  }

  template <class T, class... Values>
  std::optional<T> ask(const std::string& query, const Values&... values) const {
    T result{};
    soci::indicator filled = soci::i_ok;
    soci::statement statement(sql);
    statement.exchange(into(result, filled));
    (statement.exchange(use(values)), ...);
    statement.alloc();
    statement.prepare(query);
    statement.define_and_bind();
    if (!statement.execute(true) || filled == soci::i_null) return std::nullopt;
    return result;
  }

  /// Bytes in a column, by a question with one {} for it and one parameter.
  std::string bytes(const char* question, const char* column, int id) const;

  /// The number of a population, which is made when there is none.
  int population(const std::string& name);

  /// The least from 2 with which no neuron of the population is called "name-2".
  int next_number(int population, const std::string& name);

  std::optional<int> grammar(const Grown& grown);

  /// Whether neurons were grown into it before version 7, under other fingerprints.
  bool holds_older_grown();

  int keep_grammar(const std::string& name, std::string_view text);  // its id
  /// The id and version of a distribution of a population, by its id or 0.
  std::pair<int, int> keep_distribution(const std::string& name, int population, std::string_view text);
  struct Version {
    int id, number;
    bool already_there;
  };
  /// A new version, unless the newest (with `anew`) or any has this grammar.
  Version keep_model(const std::string& name, int grammar, int population, const std::string& origin,
                     bool anew);
  /// Links a version to its distributions, if it has none yet.
  void keep_distributions(int model, const std::string& name, const TextsByName& distributions);

  /// The neurons for which a condition on the view `neuron`, called v, holds; more tables may be joined to it.
  std::vector<NeuronRow> rows(const std::string& where, const std::string& joins = "") const;
  /// The rows of one neuron; `points` and `from` tell where its sections stand, which differs between versions.
  Rows stored(NeuronId id, const char* points, const std::string& from) const;
  /// What is wrong with these neurons, at most a sentence each.
  std::vector<std::string> findings(const Repository& repository, std::span<const NeuronRow> neurons) const;
};
}  // namespace forest::repository
