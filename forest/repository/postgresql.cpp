// SPDX-License-Identifier: Apache-2.0
// A repository on a PostgreSQL server: the tables lie in the first schema of the search path, as the server's owner
// has set it.
#include <algorithm>
#include <iterator>
#include <libpq-fe.h>
#include <memory>
#include <string>

#include <fmt/format.h>
#include <soci/postgresql/soci-postgresql.h>

#include "forest/core/error.h"
#include "forest/core/lower.h"
#include "forest/core/number.h"
#include "forest/repository/database.h"
#include "forest/repository/insert.h"
#include "forest/repository/schema.h"

namespace forest::repository {
namespace {

struct Sentence {
  std::string_view state;  // the beginning of the error's number (PostgreSQL manual, appendix A)
  const char* text;
};

// The first row that fits.
constexpr Sentence sentences[] = {
    {"25006", "this connection may only read; ask the owner of the database to grant writing"},
    {"53100", "the server's disk is full and nothing of this was stored; make room and try again"},
    {"53", "the server is short of memory or connections and nothing of this was stored; try again later"},
    {"55P03", "another program has been writing to it for over a minute; try again when it is done"},
    {"40",
     "another program changed the same rows at the same moment and nothing of this was stored; try again"},
    {"42P07", "the database holds other tables of these names; name a database of its own"},
    {"57014", "the server ended the question, which took too long; ask for less"},
    {"57P", "the server is shutting down; try again later"},
    {"08", "the connection to the server is lost and nothing of this was stored; try again"},
    {"3F000", "there is no schema to make tables in; ask the owner of the database to make one"},
};

using Options = std::unique_ptr<PQconninfoOption, void (*)(PQconninfoOption*)>;

/// What libpq makes of an address, or of keywords and values; null when it is none of both.
Options options_of(const std::string& text) {
  char* wrong = nullptr;
  Options options(PQconninfoParse(text.c_str(), &wrong), PQconninfoFree);
  PQfreemem(wrong);
  return options;
}

/// Whether an option is a password, or may hold one that came there by mistake: role%3Apassword@host, role:pass/word@host.
bool may_be_secret(std::string_view keyword, std::string_view value) {
  const auto has = [&](std::string_view what) { return value.find(what) != value.npos; };
  return keyword.ends_with("password") || (keyword == "user" && has(":")) ||
         (keyword == "port" && value.find_first_not_of("0123456789,") != value.npos) ||
         (keyword == "dbname" && (has("@") || has("password=")));
}

/// That a role may not do what it would (42501). @param why  the server's words, which name the table
std::string not_allowed(bool write, std::string_view why) {
  return fmt::format(
      "this role may not {} there ({}); ask the owner of the database to grant it, or name another role",
      write ? "write" : "read", why);
}

/// The address as the keywords and values that SOCI hands on to libpq, which knows the parts of an address best.
std::string keywords_of(const std::string& place) {
  const Options options = options_of(place);
  const std::string shown = place.substr(0, place.find("://") + 3) + "…";  // without what may be secret
  if (!options) throw InputError(shown, 0, "is no address; write it postgresql://role@host:port/database");
  std::string keywords;
  for (const PQconninfoOption* option = options.get(); option->keyword; ++option) {
    if (!option->val) continue;
    if (may_be_secret(option->keyword, option->val))
      throw InputError(
          shown, 0,
          "holds what may be a password, which others on this machine could read; give it in PGPASSWORD or "
          "~/.pgpass, and leave it out of the address");
    keywords += fmt::format("{}{}='", keywords.empty() ? "" : " ", option->keyword);
    for (const char* c = option->val; *c; ++c) {
      if (*c == '\'' || *c == '\\') keywords += '\\';
      keywords += *c;
    }
    keywords += '\'';
  }
  return keywords;
}

/// All rows in one message: an array for each column, as PostgreSQL writes them.
class Arrays final : public InsertStatement {
 public:
  Arrays(soci::session& sql, const std::string& table, std::span<const InsertColumn> columns)
      : columns_(columns), texts_(columns.size()), statement_(sql) {
    std::string names, values, arrays;
    for (std::size_t i = 0; i < columns.size(); ++i) {
      constexpr const char* types[] = {"int[]", "int8[]", "float8[]", "text[]"};
      const InsertColumn& c = columns[i];
      const char* comma = i ? ", " : "";
      names += comma, names += c.name;
      values += fmt::format(fmt::runtime(c.bytes ? "{}decode(c{}, 'hex')" : "{}c{}"), comma, i);
      arrays += fmt::format("{}cast(:c{} as {})", comma, i, types[c.values.index() % 4]);
      statement_.exchange(soci::use(texts_[i]));
    }
    std::string columns_of_rows;
    for (std::size_t i = 0; i < columns.size(); ++i)
      columns_of_rows += fmt::format("{}c{}", i ? ", " : "", i);
    statement_.alloc();
    statement_.prepare(
        fmt::format("insert into {} ({}) select {} from unnest({}) as rows ({}) on conflict do nothing",
                    table, names, values, arrays, columns_of_rows));
    statement_.define_and_bind();
  }

  std::size_t run(std::size_t count) override {
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      const InsertColumn& c = columns_[i];
      texts_[i] = "{";
      std::visit(
          [&](const auto* values) {
            for (std::size_t row = 0; row < count; ++row) {
              if (row) texts_[i] += ',';
              if (c.is_null && c.is_null(row))
                texts_[i] += "NULL";
              else
                append(texts_[i], c, *values, row);
            }
          },
          c.values);
      texts_[i] += '}';
    }
    statement_.execute(true);
    return std::size_t(statement_.get_affected_rows());
  }

 private:
  template <class T>
  static void append(std::string& array, const InsertColumn& c, const std::vector<T>& values,
                     std::size_t row) {
    append(array, c, values[row], row);
  }
  template <class Number>
  static void append(std::string& array, const InsertColumn&, Number value, std::size_t) {
    fmt::format_to(std::back_inserter(array), "{}", value);
  }
  static void append(std::string& array, const InsertColumn& c, const std::string& value, std::size_t) {
    if (c.bytes) {
      array += value.empty() ? "NULL" : hexadecimal(value);
      return;
    }
    array += '"';
    for (const char ch : value) {
      if (ch == '"' || ch == '\\') array += '\\';
      array += ch;
    }
    array += '"';
  }

  std::span<const InsertColumn> columns_;
  std::vector<std::string> texts_;
  soci::statement statement_;
};

class Postgresql final : public Database {
 public:
  explicit Postgresql(const std::string& place) {
    const std::string keywords = keywords_of(place);
    try {
      sql_.open(soci::postgresql, keywords);
    } catch (const soci::soci_error& error) {
      std::string why = error.what();
      for (const char* lead : {"Cannot establish connection to the database.\n"})
        if (const std::size_t found = why.find(lead); found != why.npos)
          why.erase(0, found + std::string(lead).size());
      std::ranges::replace(why, '\n', ' ');
      while (!why.empty() && why.back() == ' ') why.pop_back();
      throw InputError(
          place, 0,
          fmt::format("the server cannot be reached ({}); check host, port, database and role, and "
                      "PGPASSWORD or ~/.pgpass",
                      why));
    }
    const char* encoding = PQparameterStatus(connection(), "server_encoding");
    if (encoding && std::string_view(encoding) != "UTF8" && std::string_view(encoding) != "SQL_ASCII")
      throw InputError(place, 0,
                       fmt::format("its texts are {}, which has no letters for all names and units; make a "
                                   "database with encoding 'UTF8' template template0 and name that",
                                   encoding));
    sql_ << "set client_min_messages = error";
    sql_ << "set client_encoding = 'UTF8'";
    sql_ << "set lock_timeout = '60s'";
    sql_ << "set extra_float_digits = 1";
    sql_ << "set standard_conforming_strings = on";
  }

  void begin_reading() override {
    writing_ = false;
    sql_ << "begin transaction isolation level repeatable read read only";
  }
  void begin_writing() override {
    writing_ = true;
    sql_ << "begin transaction isolation level read committed";
  }

  bool is_undone() override { return PQtransactionStatus(connection()) == PQTRANS_INERROR; }

  std::string dialect(std::string_view text) const override {
    constexpr std::pair<std::string_view, std::string_view> words[] = {
        {"@id", "integer primary key generated by default as identity"},
        {"@long_id", "bigint primary key"},
        {"@bytes", "bytea"},
        {"@by_key", ""},
        {"@on_a_server", ""}};
    std::string sql(text);
    for (const auto& [word, ours] : words)
      for (std::size_t at; (at = sql.find(word)) != sql.npos;) sql.replace(at, word.size(), ours);
    return sql;
  }

  int next_id(const std::string& table) override {
    return value<int>(sql_, fmt::format("select nextval(pg_get_serial_sequence('{}', 'id'))", table));
  }
  bool as_text() const override { return true; }

  std::unique_ptr<InsertStatement> prepare_insert(const std::string& table,
                                                  std::span<const InsertColumn> columns) override {
    return std::make_unique<Arrays>(sql_, table, columns);
  }

  void forbid_writing() override { sql_ << "set session characteristics as transaction read only"; }

  std::vector<std::string> each(const std::string& question, const Take& take) override {
    PGconn* const connection = this->connection();
    using Result = std::unique_ptr<PGresult, void (*)(PGresult*)>;
    const auto send = [&](const std::string& text) {
      return Result(PQexecParams(connection, text.c_str(), 0, nullptr, nullptr, nullptr, nullptr, 0),
                    PQclear);
    };
    struct End {
      PGconn* connection;
      bool alone;  // not inside another transaction
      ~End() { PQclear(PQexec(connection, alone ? "rollback" : "close question")); }
    };
    const bool alone = PQtransactionStatus(connection) == PQTRANS_IDLE;
    const End end{connection, alone};
    if (alone) begin_reading();
    // A cursor is declared for a question and nothing else: no copy to a file, no other command, no second one.
    Result result = send("declare question no scroll cursor for " + question);
    if (PQresultStatus(result.get()) == PGRES_COMMAND_OK) result = send("fetch all from question");
    if (PQresultStatus(result.get()) != PGRES_TUPLES_OK) {
      const char* number = PQresultErrorField(result.get(), PG_DIAG_SQLSTATE);
      const std::string state = number ? number : "08000";
      const char* text = PQresultErrorField(result.get(), PG_DIAG_MESSAGE_PRIMARY);
      const std::string why = text ? text : "the connection is lost";
      const std::size_t word = std::min(question.find_first_not_of(" \t\r\n("), question.size());
      const std::string first = lower(question.substr(word, question.find_first_of(" \t\r\n(", word) - word));
      if (state == "25006" || (state == "42601" && first != "select" && first != "with"))
        throw Error("a question can read and not write; ask with select");
      if (state == "42501") throw Error(not_allowed(false, why));
      if (state.starts_with("42"))
        throw Error(fmt::format(
            "the question is not understood ({}); docs/repository/schema.md has the tables and views", why));
      throw Error(fmt::format("the question cannot be answered ({})", why));
    }
    std::vector<std::string> names;
    std::vector<Answer::Value> row;
    const int columns = PQnfields(result.get());
    for (int c = 0; c < columns; ++c) names.emplace_back(PQfname(result.get(), c));
    for (int r = 0; r < PQntuples(result.get()); ++r) {
      row.clear();
      for (int c = 0; c < columns; ++c) {
        const std::string text(PQgetvalue(result.get(), r, c), std::size_t(PQgetlength(result.get(), r, c)));
        switch (PQgetisnull(result.get(), r, c) ? 0 : int(PQftype(result.get(), c))) {
          case 0:
            row.emplace_back();
            break;
          case 20:  // int8, int2, int4: pg_type.dat
          case 21:
          case 23:
            row.emplace_back(std::int64_t(std::stoll(text)));
            break;
          case 700:  // float4, float8, numeric
          case 701:
          case 1700:
            row.emplace_back(number_of<double>(text).value_or(NAN));
            break;
          default:
            row.emplace_back(text);
        }
      }
      take(row);
    }
    return names;
  }

  void rethrow(const std::string& place) const override {
    try {
      throw;
    } catch (const soci::postgresql_soci_error& error) {
      const std::string state = error.sqlstate();
      std::string why = error.what();
      std::ranges::replace(why, '\n', ' ');
      if (state == "42501") {
        const std::size_t begin = std::min(why.find("permission denied"), why.size());
        throw InputError(place, 0, not_allowed(writing_, why.substr(begin, why.find("  ", begin) - begin)));
      }
      for (const Sentence& row : sentences)
        if (state.starts_with(row.state)) throw InputError(place, 0, row.text);
      throw InputError(place, 0, fmt::format("the database refuses ({}); see the server's log", why));
    } catch (const soci::soci_error& error) {
      throw InputError(
          place, 0,
          fmt::format("the database holds what it should not ({}); restore it from a backup", error.what()));
    }
  }

  /// The version of the tables; 0 when there are none.
  int version() {
    int there = 0;
    sql_ << "select count(*) from pg_catalog.pg_class where oid = to_regclass('brainforest_schema')",
        soci::into(there);
    return there ? value<int>(sql_, "select version from brainforest_schema") : 0;
  }

  /// Makes the tables, or brings older ones up to date; of several programs that try, one does.
  void bring_up_to_date(Refill refill) {
    begin_writing();
    sql_ << fmt::format("select pg_advisory_xact_lock({})", application_id);
    const int from = version();
    if (from < schema_version) {
      migrate(*this, from, refill);
      if (from == 0) {
        sql_ << "create table brainforest_schema (version integer not null)";
        sql_ << "insert into brainforest_schema (version) values (0)";
      }
      sql_ << fmt::format("update brainforest_schema set version = {}", schema_version);
    }
    sql_ << "commit";
  }

  bool may_write() {
    return value<int>(sql_, "select case when has_table_privilege('neurons', 'insert') then 1 else 0 end") ==
           1;
  }

 private:
  PGconn* connection() { return static_cast<soci::postgresql_session_backend&>(*sql_.get_backend()).conn_; }

  bool writing_ = false;  // what the transaction that was begun last is for
};

}  // namespace

bool is_meant_for_a_server(std::string_view place) {
  std::string text = lower(place);
  std::erase_if(text, [](char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; });
  for (const char* word : {"password=", "passwd=", "pwd="})
    if (text.find(word) != text.npos) return true;
  if (text.find('=') != text.npos && options_of(std::string(place))) return true;
  const std::string_view scheme =
      std::string_view(text).substr(0, text.find("://"));  // letters, then +driver
  if (scheme.size() < text.size() && !scheme.empty() &&
      scheme.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789+-._:") == scheme.npos)
    return true;
  text.erase(0, text.find_first_not_of('/') < 2 ? 0 : std::min(text.find_first_not_of('/'), text.size()));
  const std::string_view name = std::string_view(text).substr(0, text.find('/'));
  const std::size_t colon = name.find(':');
  return colon != name.npos && (name.substr(0, colon).find("postgres") != name.npos ||  // no name of a file
                                name.find('@', colon) != name.npos);                    // role:password@host
}

std::unique_ptr<Database> connect_postgresql(const std::string& place, bool write, Refill refill) {
  auto database = std::make_unique<Postgresql>(place);
  try {
    int version = database->version();
    if (version == 0 && !write)
      throw InputError(place, 0,
                       "holds no repository; check the address, or make one with brainforest import");
    if (version < schema_version) {
      database->bring_up_to_date(refill);
      version = database->version();
    }
    if (version > schema_version)
      throw InputError(
          place, 0,
          fmt::format(
              "was made by a newer Brain Forest (its tables are of version {}, this program knows {}); "
              "use the newer program",
              version, schema_version));
    if (write && !database->may_write())
      throw InputError(place, 0, not_allowed(true, "it has no right to insert into neurons"));
    if (!write) database->sql() << "set session characteristics as transaction read only";
  } catch (...) {
    database->rethrow(place);
  }
  return database;
}

}  // namespace forest::repository
