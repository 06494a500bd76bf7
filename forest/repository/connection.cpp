// SPDX-License-Identifier: Apache-2.0
#include "forest/repository/connection.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <new>
#include <unistd.h>

#include <fmt/format.h>
#include <soci/sqlite3/soci-sqlite3.h>
#include <sys/stat.h>

#include "forest/core/error.h"
#include "forest/morphology/morphology.h"
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

constexpr std::array<Sentence, 9> sentences{{
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
  sql << "pragma foreign_keys = on";
  sql << "pragma cache_size = -65536";  // KiB
}

/// Gives the file `part` the name `path` unless there is such a file; returns 0 or the error's number.
int name_file(const std::string& part, const std::string& path) {
  if (::link(part.c_str(), path.c_str()) == 0) return 0;
  if (errno != EPERM && errno != EOPNOTSUPP && errno != ENOSYS)
    return errno;  // else a file system without links
  return ::renameat2(AT_FDCWD, part.c_str(), AT_FDCWD, path.c_str(), RENAME_NOREPLACE) == 0 ? 0 : errno;
}

/// Makes a repository without neurons at `path`. It is filled under another name and then linked into place,
/// so that a killed program leaves no half of it and the first of two programs wins.
void create(const std::string& path) {
  const std::string part = fmt::format("{}.new-{}", path, ::getpid());
  const auto clean = [&] {
    for (const char* end : {"", "-journal"}) ::unlink((part + end).c_str());
  };
  clean();
  try {
    soci::session sql;
    attach(sql, part, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
    sql << "pragma page_size = 4096";  // not whatever this SQLite was built with
    begin_writing(sql);
    sql << fmt::format("pragma application_id = {}", application_id);
    sql << fmt::format("pragma user_version = {}", schema_version);
    std::string_view rest = schema;
    for (std::size_t end; (end = rest.find(";\n")) != std::string_view::npos; rest.remove_prefix(end + 2))
      sql << std::string(rest.substr(0, end));
    for (int kind = 0; kind < 256; ++kind) {
      const std::string name(forest::name_of(SectionKind(kind)));
      if (forest::section_kind(name) == SectionKind(kind))
        sql << "insert into section_kinds (id, name) values (:kind, :name)", soci::use(kind), soci::use(name);
    }
    sql << "commit";
    begin_writing(
        sql);  // whoever finds the file now waits, and none believes the journal of an earlier one to be its own
    const int failed = name_file(part, path);
    if (failed && failed != EEXIST)
      throw InputError(
          path, 0, fmt::format("cannot be made ({}); check the folder's permissions", std::strerror(failed)));
    if (!failed) ::unlink((path + "-journal").c_str());
    sql << "rollback";
  } catch (...) {
    clean();
    throw;
  }
  clean();
}

template <class T>
T value(soci::session& sql, const std::string& query) {
  T result{};
  sql << query, soci::into(result);
  return result;
}

/// Throws InputError when the open file is not a whole repository of a version we know.
void examine(soci::session& sql, const std::string& place, const std::string& path) {
  begin_reading(sql);
  value<long long>(sql, "select count(*) from sqlite_master");  // undoes what a killed program left half done
  if (const int id = value<int>(sql, "pragma application_id"); id != application_id)
    throw InputError(
        place, 0,
        "is no repository but another SQLite database; name another file, or one that does not exist yet");
  const int version = value<int>(sql, "pragma user_version");
  if (version > schema_version)
    throw InputError(
        place, 0,
        fmt::format("was made by a newer Brain Forest (its tables are of version {}, this program knows {}); "
                    "use the newer program",
                    version, schema_version));
  const auto whole = value<long long>(sql, "pragma page_count") * value<long long>(sql, "pragma page_size");
  std::error_code ignored;
  const auto size = fs::file_size(path, ignored);
  if (version < 1 || ignored || size < std::uintmax_t(whole))
    throw soci::sqlite3_soci_error("size", SQLITE_CORRUPT);
  for (const char* table : {"populations", "grammars", "neurons", "provenance", "somata", "section_kinds",
                            "arbors", "sections", "points", "spines", "annotations"})
    value<int>(sql, fmt::format("select 1 from {} where 1 = 0", table));
  sql << "commit";
}

}  // namespace

void connect(soci::session& sql, const std::string& place, bool write) {
  if (place.starts_with("postgresql://"))
    throw InputError(place, 0,
                     "is a server, and this program knows repositories in SQLite files only; name a file");
  if (place.empty() || place.size() > 4000 || place.find('\0') != std::string::npos)
    throw InputError(shown(place), 0, "is no path; name a file");
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
  if (status.type() != fs::file_type::regular)
    throw InputError(place, 0, "is not a regular file that can be read; name a file, not a folder or device");
  attach(sql, path, SQLITE_OPEN_READWRITE);  // SQLite reads only when that is all the permissions allow
  examine(sql, place, path);
  auto& backend = static_cast<soci::sqlite3_session_backend&>(*sql.get_backend());
  if (write && sqlite::sqlite3_db_readonly(backend.conn_, "main"))
    throw soci::sqlite3_soci_error("open", SQLITE_READONLY);
  if (!write) sql << "pragma query_only = on";
}

void begin_reading(soci::session& sql) { sql << "begin"; }
void begin_writing(soci::session& sql) { sql << "begin immediate"; }

void rethrow(const std::string& place) {
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
