// SPDX-License-Identifier: Apache-2.0
// A repository as one SQLite file.

#include <algorithm>
#include <array>
#include <filesystem>
#include <new>
#include <type_traits>
#include <unistd.h>

#include <fmt/format.h>
#include <soci/sqlite3/soci-sqlite3.h>
#include <sys/stat.h>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/repository/database.h"
#include "forest/repository/insert.h"
#include "forest/repository/names.h"
#include "forest/repository/schema.h"

namespace forest::repository {
namespace {

namespace fs = std::filesystem;
namespace sqlite = sqlite_api;

struct Sentence {
  int code;
  const char* text;
};

constexpr std::array<Sentence, 10> sentences{{
    {SQLITE_FULL, "the disk is full and nothing of this was stored; make room and try again"},
    {SQLITE_IOERR, "the disk is full or failing and nothing of this was stored; make room and try again"},
    {SQLITE_BUSY, "another program has been writing to it for over a minute; try again when it is done"},
    {SQLITE_LOCKED, "another program has been writing to it for over a minute; try again when it is done"},
    {SQLITE_READONLY,
     "cannot be written; check the permissions of the file and its folder, and that it was opened for "
     "writing"},
    {SQLITE_PERM, "cannot be opened; check the permissions of the file and its folder"},
    {SQLITE_CANTOPEN, "cannot be opened; check the path and the permissions of the file and its folder"},
    {SQLITE_NOTADB, "is no repository; name another file, or one that does not exist yet"},
    {SQLITE_TOOBIG,
     "one text or number of bytes is larger than a database holds, 1 GB; ask for less at once"},
    {SQLITE_CORRUPT, "is damaged or cut off; restore it from a backup, or make it again from its sources"},
}};

/// SOCI's own connection string knows no quotes in a path and makes a file where there is none; so the file
/// is opened here and handed to a session that was opened on nothing.
void attach(soci::session& sql, const std::string& path, int flags) {
  sql.open(soci::sqlite3, ":memory:");
  auto& backend = static_cast<soci::sqlite3_session_backend&>(*sql.get_backend());
  sqlite::sqlite3* file = nullptr;
  const int result = sqlite::sqlite3_open_v2(path.c_str(), &file, flags | SQLITE_OPEN_NOMUTEX, nullptr);
  if (result != SQLITE_OK) {
    sqlite::sqlite3_close(file);
    throw soci::sqlite3_soci_error("open", result);
  }
  sqlite::sqlite3_close(backend.conn_);
  backend.conn_ = file;
  sqlite::sqlite3_busy_timeout(file, 60'000);
  // Rows are written with the numbers of rows that are there, and removed with what belongs to them; looking each up again
  // would take a third of the time. examine_structure() does look.
  sql << "pragma foreign_keys = off";
  sql << "pragma cache_size = -65536";  // KiB
}

std::string dialect_of(std::string_view text) {
  if (text.find("@on_a_server") != text.npos) return "";
  constexpr std::pair<std::string_view, std::string_view> words[] = {{"@id", "integer primary key"},
                                                                     {"@long_id", "integer primary key"},
                                                                     {"@bytes", "blob"},
                                                                     {"@by_key", "without rowid"}};
  std::string sql(text);
  for (const auto& [word, ours] : words)
    for (std::size_t at; (at = sql.find(word)) != sql.npos;) sql.replace(at, word.size(), ours);
  return sql;
}

// What a person may ask with brainforest query: to read, and nothing else.
int only_reading(void*, int action, const char*, const char*, const char*, const char*) {
  switch (action) {
    case SQLITE_SELECT:
    case SQLITE_READ:
    case SQLITE_FUNCTION:
    case SQLITE_RECURSIVE:
    case SQLITE_TRANSACTION:
      return SQLITE_OK;
    default:
      return SQLITE_DENY;
  }
}

void expect(int result, const char* what) {
  if (result != SQLITE_OK && result != SQLITE_DONE) throw soci::sqlite3_soci_error(what, result);
}

using Statement = std::unique_ptr<sqlite::sqlite3_stmt, int (*)(sqlite::sqlite3_stmt*)>;

/// All rows by one statement, `insert … select`, which reads them out of a virtual table: the columns themselves, as they lie
/// in memory. A statement a row takes two thirds more time, most of it to begin and to end.
class FromColumns final : public InsertStatement {
 public:
  /// `name`: of the virtual table, which no other has on this connection.
  FromColumns(sqlite::sqlite3* database, const std::string& table, std::span<const InsertColumn> columns,
              std::string name)
      : database_(database), columns_(columns), name_(std::move(name)) {
    std::string names;
    for (const InsertColumn& c : columns) names += fmt::format("{}{}", names.empty() ? "" : ", ", c.name);
    declaration_ = fmt::format("create table x ({})", names);
    expect(sqlite::sqlite3_create_module_v2(database, name_.c_str(), &module, this, nullptr), "declare");
    // "or fail": what goes wrong undoes the transaction, so the statement need not keep the pages it changes.
    const std::string text =
        fmt::format("insert or fail into {} ({}) select * from {} where true on conflict do nothing", table,
                    names, name_);
    sqlite::sqlite3_stmt* prepared = nullptr;
    const int result = sqlite::sqlite3_prepare_v3(database, text.c_str(), int(text.size()),
                                                  SQLITE_PREPARE_PERSISTENT, &prepared, nullptr);
    statement_.reset(prepared);
    if (result != SQLITE_OK) forget();
    expect(result, "prepare");
  }
  ~FromColumns() override { forget(); }
  FromColumns(const FromColumns&) = delete;

  std::size_t run(std::size_t count) override {
    const sqlite::sqlite3_int64 before = sqlite::sqlite3_total_changes(database_);
    cells_.clear();
    for (const InsertColumn& c : columns_) cells_.push_back(cell_of(c));
    count_ = count;
    const int result = sqlite::sqlite3_step(statement_.get());
    sqlite::sqlite3_reset(statement_.get());
    count_ = 0;
    expect(result, "insert");
    return std::size_t(sqlite::sqlite3_total_changes(database_) - before);
  }

 private:
  struct Table : sqlite::sqlite3_vtab {
    const FromColumns* of;
  };
  struct Cursor : sqlite::sqlite3_vtab_cursor {
    std::size_t row;
  };
  using Context = sqlite::sqlite3_context;

  static const FromColumns& of(const sqlite::sqlite3_vtab_cursor* cursor) {
    return *static_cast<const Table*>(cursor->pVtab)->of;
  }
  static std::size_t& row(sqlite::sqlite3_vtab_cursor* cursor) { return static_cast<Cursor*>(cursor)->row; }

  static sqlite::sqlite3_module functions() {
    sqlite::sqlite3_module m{};
    m.xConnect = [](sqlite::sqlite3* database, void* self, int, const char* const*,
                    sqlite::sqlite3_vtab** table, char**) {
      const auto* of = static_cast<const FromColumns*>(self);
      *table = new (std::nothrow) Table{{}, of};
      return *table ? sqlite::sqlite3_declare_vtab(database, of->declaration_.c_str()) : SQLITE_NOMEM;
    };
    m.xDisconnect = [](sqlite::sqlite3_vtab* table) {
      delete static_cast<Table*>(table);
      return SQLITE_OK;
    };
    m.xBestIndex = [](sqlite::sqlite3_vtab*, sqlite::sqlite3_index_info*) { return SQLITE_OK; };
    m.xOpen = [](sqlite::sqlite3_vtab*, sqlite::sqlite3_vtab_cursor** cursor) {
      *cursor = new (std::nothrow) Cursor{};
      return *cursor ? SQLITE_OK : SQLITE_NOMEM;
    };
    m.xClose = [](sqlite::sqlite3_vtab_cursor* cursor) {
      delete static_cast<Cursor*>(cursor);
      return SQLITE_OK;
    };
    m.xFilter = [](sqlite::sqlite3_vtab_cursor* cursor, int, const char*, int, sqlite::sqlite3_value**) {
      row(cursor) = 0;
      return SQLITE_OK;
    };
    m.xNext = [](sqlite::sqlite3_vtab_cursor* cursor) {
      ++row(cursor);
      return SQLITE_OK;
    };
    m.xEof = [](sqlite::sqlite3_vtab_cursor* cursor) { return int(row(cursor) >= of(cursor).count_); };
    m.xRowid = [](sqlite::sqlite3_vtab_cursor* cursor, sqlite::sqlite3_int64* id) {
      *id = sqlite::sqlite3_int64(row(cursor));
      return SQLITE_OK;
    };
    m.xColumn = [](sqlite::sqlite3_vtab_cursor* cursor, Context* context, int number) {
      const Cell& cell = of(cursor).cells_[std::size_t(number)];
      if (cell.is_null && (*cell.is_null)(row(cursor)))
        sqlite::sqlite3_result_null(context);
      else
        cell.answer(context, cell, cell.in_each_row ? row(cursor) : 0);
      return SQLITE_OK;
    };
    return m;
  }
  inline static const sqlite::sqlite3_module module = functions();

  /// A column where it stands during one run: looked up once, since each of millions of values passes here.
  struct Cell {
    void (*answer)(Context*, const Cell&, std::size_t row);
    const void* values;
    bool in_each_row, bytes;
    const std::function<bool(std::size_t)>* is_null;  // or null
  };

  static Cell cell_of(const InsertColumn& c) {
    return std::visit(
        [&]<class T>(const T* values) -> Cell {
          const auto cell = [&]<class V>(const V* first, bool in_each_row) -> Cell {
            return {answer<V>, first, in_each_row, c.bytes, c.is_null ? &c.is_null : nullptr};
          };
          if constexpr (requires { typename T::allocator_type; } && !std::is_same_v<T, std::string>)
            return cell(values->data(), true);
          else
            return cell(values, false);
        },
        c.values);
  }

  template <class V>
  static void answer(Context* context, const Cell& cell, std::size_t row) {
    const V& value = static_cast<const V*>(cell.values)[row];
    if constexpr (std::is_same_v<V, int>)
      sqlite::sqlite3_result_int(context, value);
    else if constexpr (std::is_same_v<V, long long>)
      sqlite::sqlite3_result_int64(context, value);
    else if constexpr (std::is_same_v<V, double>)
      sqlite::sqlite3_result_double(context, value);
    else if (!cell.bytes)  // a text stays where it is until the row is stored
      sqlite::sqlite3_result_text(context, value.data(), int(value.size()), SQLITE_STATIC);
    else if (value.empty())
      sqlite::sqlite3_result_null(context);
    else
      sqlite::sqlite3_result_blob64(context, value.data(), value.size(), SQLITE_STATIC);
  }

  void forget() {
    statement_.reset();
    sqlite::sqlite3_create_module_v2(database_, name_.c_str(), nullptr, nullptr, nullptr);
  }

  sqlite::sqlite3* database_;
  std::span<const InsertColumn> columns_;
  std::string name_, declaration_;
  std::vector<Cell> cells_;
  std::size_t count_ = 0;  // none but in run(): a question finds the table empty
  Statement statement_{nullptr, sqlite::sqlite3_finalize};
};

class Sqlite final : public Database {
 public:
  void begin_reading() override { sql_ << "begin"; }
  void begin_writing() override { sql_ << "begin immediate"; }  // waits a minute for other writers
  bool is_undone() override { return sqlite::sqlite3_get_autocommit(handle()); }
  std::string dialect(std::string_view text) const override { return dialect_of(text); }
  int next_id(const std::string& table) override {
    auto& [of, statement] = next_id_;  // kept, since each of many neurons asks
    if (of != table) {
      const std::string text = fmt::format("select coalesce(max(id), 0) + 1 from {}", table);
      sqlite::sqlite3_stmt* prepared = nullptr;
      expect(sqlite::sqlite3_prepare_v2(handle(), text.c_str(), int(text.size()), &prepared, nullptr),
             "next");
      statement.reset(prepared);
      of = table;
    }
    const int result = sqlite::sqlite3_step(statement.get());
    const int id = sqlite::sqlite3_column_int(statement.get(), 0);
    sqlite::sqlite3_reset(statement.get());
    if (result != SQLITE_ROW) throw soci::sqlite3_soci_error("next", result);
    return id;
  }
  bool as_text() const override { return false; }
  std::unique_ptr<InsertStatement> prepare_insert(const std::string& table,
                                                  std::span<const InsertColumn> columns) override {
    return std::make_unique<FromColumns>(handle(), table, columns, fmt::format("rows_{}", ++inserts_));
  }
  std::vector<std::string> each(const std::string& question, const Take& take) override;
  void forbid_writing() override { sqlite::sqlite3_set_authorizer(handle(), only_reading, nullptr); }

  std::vector<std::string> examine_structure() override {
    std::vector<std::string> findings;
    soci::rowset<std::string> lines = (sql_.prepare << "pragma integrity_check");
    for (const std::string& line : lines)
      if (line != "ok") findings.push_back(fmt::format("is damaged ({})", line));
    const int strays =
        value<int>(sql_,
                   "select (select count(*) from pragma_foreign_key_check) + (select count(*) from sections "
                   "where not exists (select 1 from neurons n where n.id = sections.id >> 24)) + (select "
                   "count(*) from neuron_metrics v where not exists (select 1 from neurons n where n.id = "
                   "v.neuron))");
    if (strays) findings.push_back(fmt::format("is damaged ({} rows belong to nothing)", strays));
    return findings;
  }

  void rethrow(const std::string& place) const override;

  void open(const std::string& path, int flags) { attach(sql_, path, flags); }
  sqlite::sqlite3* handle() { return static_cast<soci::sqlite3_session_backend&>(*sql_.get_backend()).conn_; }

 private:
  int inserts_ = 0;  // prepared so far
  std::pair<std::string, Statement> next_id_{"", Statement(nullptr, sqlite::sqlite3_finalize)};
};

std::vector<std::string> Sqlite::each(const std::string& question, const Take& take) {
  sqlite::sqlite3_stmt* prepared = nullptr;
  const char* rest = nullptr;
  const int result =
      sqlite::sqlite3_prepare_v2(handle(), question.c_str(), int(question.size()), &prepared, &rest);
  const Statement statement(prepared, sqlite::sqlite3_finalize);
  const int columns = sqlite::sqlite3_column_count(prepared);
  if (result == SQLITE_AUTH || (prepared && columns == 0))
    throw Error("a question can read and not write; ask with select");
  if (result == SQLITE_ERROR)
    throw Error(
        fmt::format("the question is not understood ({}); docs/repository/schema.md has the tables and views",
                    sqlite::sqlite3_errmsg(handle())));
  if (result != SQLITE_OK) throw soci::sqlite3_soci_error("ask", result);
  if (!statement) throw Error("there is no question; ask with select");
  if (std::string_view(rest).find_first_not_of("; \t\r\n") != std::string_view::npos)
    throw Error("one question at a time; leave out what follows the first semicolon");
  std::vector<std::string> names;
  std::vector<Answer::Value> row;
  for (int c = 0; c < columns; ++c) names.emplace_back(sqlite::sqlite3_column_name(prepared, c));
  int step;
  while ((step = sqlite::sqlite3_step(prepared)) == SQLITE_ROW) {
    row.clear();
    for (int c = 0; c < columns; ++c) {
      const auto text = [&] {
        const auto* bytes = static_cast<const char*>(sqlite::sqlite3_column_blob(prepared, c));
        return std::string(bytes ? bytes : "", std::size_t(sqlite::sqlite3_column_bytes(prepared, c)));
      };
      switch (sqlite::sqlite3_column_type(prepared, c)) {
        case SQLITE_INTEGER:
          row.emplace_back(std::int64_t(sqlite::sqlite3_column_int64(prepared, c)));
          break;
        case SQLITE_FLOAT:
          row.emplace_back(sqlite::sqlite3_column_double(prepared, c));
          break;
        case SQLITE_TEXT:
          row.emplace_back(text());
          break;
        case SQLITE_BLOB:
          row.emplace_back("\\x" + hexadecimal(text()));
          break;
        default:
          row.emplace_back();
      }
    }
    take(row);
  }
  if (step == SQLITE_ERROR)
    throw Error(fmt::format("the question cannot be answered ({})", sqlite::sqlite3_errmsg(handle())));
  if (step != SQLITE_DONE) throw soci::sqlite3_soci_error("ask", step);
  return names;
}

/// Makes a repository without neurons at `path`. It is filled under another name and then linked into place,
/// so that a killed program leaves no half of it and the first of two programs wins.
void create(const std::string& path) {
  NewFile file(path);  // which has a name that no other program has, and is gone under it in the end
  const std::string part = file.path().string();
  try {
    Sqlite database;
    database.open(part, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
    soci::session& sql = database.sql();
    sql << "pragma page_size = 8192";  // a tenth faster to fill than the usual 4096
    database.begin_writing();
    sql << fmt::format("pragma application_id = {}", application_id);
    sql << fmt::format("pragma user_version = {}", schema_version);
    migrate(database, 0, nullptr);
    sql << "commit";
    database
        .begin_writing();  // whoever finds the file now waits, and none believes the journal of an earlier one to be its own
    if (file.commit_new()) ::unlink((path + "-journal").c_str());
    sql << "rollback";
  } catch (...) {
    ::unlink((part + "-journal").c_str());
    throw;
  }
}

[[noreturn]] void refuse_newer(const std::string& place, int version) {
  throw InputError(
      place, 0,
      fmt::format("was made by a newer Brain Forest (its tables are of version {}, this program knows {}); "
                  "use the newer program",
                  version, schema_version));
}

/// The version of its tables. Throws InputError when the open file is not a whole repository of one we know.
int examine(Sqlite& database, const std::string& place, const std::string& path) {
  soci::session& sql = database.sql();
  database.begin_reading();
  value<long long>(sql, "select count(*) from sqlite_master");  // undoes what a killed program left half done
  if (const int id = value<int>(sql, "pragma application_id"); id != application_id)
    throw InputError(
        place, 0,
        "is no repository but another SQLite database; name another file, or one that does not exist yet");
  const int version = value<int>(sql, "pragma user_version");
  if (version > schema_version) refuse_newer(place, version);
  const auto whole = value<long long>(sql, "pragma page_count") * value<long long>(sql, "pragma page_size");
  std::error_code ignored;
  const auto size = fs::file_size(path, ignored);
  if (version < 1 || ignored || size < std::uintmax_t(whole))
    throw soci::sqlite3_soci_error("size", SQLITE_CORRUPT);
  for (const char* table : {"populations", "grammars", "neurons", "provenance", "somata", "section_kinds",
                            "arbors", "sections", "points", "spines", "annotations"})
    value<int>(sql, fmt::format("select 1 from {} where 1 = 0", table));
  sql << "commit";
  return version;
}

/// Brings an older repository to today's tables, whole or not at all.
void bring_up_to_date(Sqlite& database, const std::string& place, Refill refill) {
  database.begin_writing();
  const int from =
      value<int>(database.sql(), "pragma user_version");  // another program may have been quicker
  if (from > schema_version) refuse_newer(place, from);
  migrate(database, from, refill);
  database.sql() << fmt::format("pragma user_version = {}", schema_version);
  database.sql() << "commit";
}

}  // namespace

std::unique_ptr<Database> connect_sqlite(const std::string& place, bool write, Refill refill) {
  if (place.empty() || place.size() > 4000 || place.find('\0') != std::string::npos)
    throw InputError(shown(place), 0, "is no path; name a file");
  auto database = std::make_unique<Sqlite>();
  try {
    std::error_code error;
    const std::string path = fs::absolute(place, error).string();  // so that ":memory:" is a file's name too
    auto status = fs::status(path, error);
    if (status.type() == fs::file_type::not_found) {
      if (!write)
        throw InputError(place, 0,
                         "there is no such repository; check the path, or make it with brainforest import");
      create(path);
      status = fs::status(path, error);
    }
    if (status.type() == fs::file_type::none) throw fs::filesystem_error("status", place, error);
    if (status.type() != fs::file_type::regular)
      throw InputError(place, 0,
                       "is not a regular file that can be read; name a file, not a folder or device");
    if (fs::file_size(path, error) == 0)
      throw InputError(place, 0, "is no repository but an empty file; remove it, or name another");
    database->open(path, SQLITE_OPEN_READWRITE);  // SQLite reads only when that is all the permissions allow
    const int version = examine(*database, place, path);
    const bool fixed = sqlite::sqlite3_db_readonly(database->handle(), "main");
    if (write && fixed) throw soci::sqlite3_soci_error("open", SQLITE_READONLY);
    if (version < schema_version) {
      if (fixed)
        throw InputError(
            place, 0,
            fmt::format("its tables are of version {} and this program reads version {}; open it once "
                        "for writing, with 'brainforest import', where that is allowed",
                        version, schema_version));
      bring_up_to_date(*database, place, refill);
    }
    if (!write) database->sql() << "pragma query_only = on";
  } catch (...) {
    database->rethrow(place);
  }
  return database;
}

void Sqlite::rethrow(const std::string& place) const {
  try {
    throw;
  } catch (const soci::sqlite3_soci_error& error) {
    const int code = error.result() & 0xff;  // the rest of it only says where in SQLite
    if (code == SQLITE_NOMEM) throw std::bad_alloc();
    const auto row = std::ranges::find(sentences, code, &Sentence::code);
    if (row != sentences.end()) throw InputError(place, 0, row->text);
    throw InputError(
        place, 0,
        fmt::format("the database refuses ({}); restore it from a backup if this comes again", error.what()));
  } catch (const soci::soci_error& error) {
    throw InputError(
        place, 0,
        fmt::format("the database holds what it should not ({}); restore it from a backup", error.what()));
  }
}

}  // namespace forest::repository
