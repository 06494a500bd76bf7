// SPDX-License-Identifier: Apache-2.0
// What differs between the databases a repository can live in: opening, transactions, a few words of SQL, errors. A
// database is one file and one row in database.cpp; no public header includes this one.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <soci/soci.h>

#include "forest/repository/answer.h"

namespace forest::repository {

struct InsertColumn;
class InsertStatement;

/// One open connection.
class Database {
 public:
  virtual ~Database() = default;

  soci::session& sql() { return sql_; }

  virtual void begin_reading() = 0;  // what is read until the end of the transaction was there at one moment
  virtual void begin_writing() = 0;
  /// Whether the transaction that was begun has come to nothing by an error, a question's too.
  virtual bool is_undone() = 0;
  /// SQL of schema.h, whose words in @ this database has other names for.
  virtual std::string dialect(std::string_view sql) const = 0;
  /// A number for a new row of a table: never one that is taken, also when others write too.
  virtual int next_id(const std::string& table) = 0;
  /// Whether bytes are asked for as hexadecimal text.
  virtual bool as_text() const = 0;
  /// See insert.h. The columns must outlive the statement.
  virtual std::unique_ptr<InsertStatement> prepare_insert(const std::string& table,
                                                          std::span<const InsertColumn> columns) = 0;
  /// Sentences on what is wrong with the database itself.
  virtual std::vector<std::string> examine_structure() { return {}; }
  /// From now on nothing can be written through this connection, whatever it is asked.
  virtual void forbid_writing() = 0;
  /// One question of a person, in SQL: row after row, whose values may be taken. Returns the names of the columns. Throws
  /// Error that says what the database does not understand.
  using Take = std::function<void(std::span<Answer::Value> row)>;
  virtual std::vector<std::string> each(const std::string& question, const Take& take) = 0;
  Answer ask(const std::string& question);
  /// Inside a catch block: throws what is being handled again, errors of the database as InputError with a sentence.
  [[noreturn]] virtual void rethrow(const std::string& place) const = 0;

 protected:
  soci::session sql_;
};

/// Brings what version `from` stored into the new tables, in the transaction that makes them.
using Refill = void (*)(Database& database, int from);

/// Opens `place`, which must be a repository this program can read, and brings it to the newest schema; with `write` it is
/// made when there is none, so that whoever looks sees none or a whole one. Throws InputError.
std::unique_ptr<Database> connect(const std::string& place, bool write, Refill refill);

std::unique_ptr<Database> connect_sqlite(const std::string& place, bool write, Refill refill);
std::unique_ptr<Database> connect_postgresql(const std::string& place, bool write, Refill refill);
bool is_postgresql(std::string_view place);
/// Whether a place that is none of a server was meant for one: another spelling of an address, or the keywords and values of
/// one. It may hold a password, so it is not to be printed or made the name of a file.
bool is_meant_for_a_server(std::string_view place);

/// Runs what schema.h asks for after version `from`, in the open transaction, then `refill`; `from` 0: everything, and there
/// is nothing to refill.
void migrate(Database& database, int from, Refill refill);

template <class T>
T value(soci::session& sql, const std::string& query) {
  T result{};
  sql << query, soci::into(result);
  return result;
}

}  // namespace forest::repository
