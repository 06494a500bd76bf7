// SPDX-License-Identifier: Apache-2.0
// Private PostgreSQL servers for the tests of one program; the shared one is started when it is first asked for.
#pragma once

#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <unistd.h>

/// At the beginning of a test: leaves it out where there is no PostgreSQL; where BRAINFOREST_REQUIRE_DATA says that all must
/// run, it fails.
#define FOREST_POSTGRESQL(server)                                                         \
  do {                                                                                    \
    if ((server).runs()) break;                                                           \
    if (std::getenv("BRAINFOREST_REQUIRE_DATA")) FAIL() << "there is no PostgreSQL here"; \
    GTEST_SKIP() << "there is no PostgreSQL here";                                        \
  } while (false)

namespace forest {

class PostgresqlServer {
 public:
  /// The one that most tests share.
  static const PostgresqlServer& get() {
    static const PostgresqlServer server("shared");
    return server;
  }
  /// One that may be halted; it does not run on a machine without PostgreSQL.
  explicit PostgresqlServer(const std::string& name)
      : folder_(std::filesystem::temp_directory_path() /
                ("forest-postgresql-" + name + std::to_string(::getpid()))),
        owner_(::getpid()) {
    const auto [said, good] = script("start");
    if (good) port_ = said.substr(0, said.find('\n'));
  }
  PostgresqlServer(const PostgresqlServer&) = delete;
  ~PostgresqlServer() {
    if (runs() && owner_ == ::getpid()) script("stop");
  }

  bool runs() const { return !port_.empty(); }
  /// The address of a database; `role` must exist.
  std::string address(const std::string& database, const std::string& role = "forest") const {
    return "postgresql://" + role + "@127.0.0.1:" + port_ + "/" + database;
  }
  /// SQL as the superuser, by the server's own client.
  bool run(const std::string& sql, const std::string& database = "postgres") const {
    return command(client(database) + " -c \"" + sql + "\" >/dev/null 2>&1").second;
  }
  bool run_file(const std::string& path, const std::string& database) const {
    return command(client(database) + " -1 -f " + path + " >/dev/null").second;
  }
  /// Ends the server, as a failing machine (immediate) or its owner (fast) would.
  bool halt(const std::string& how) const { return script("halt", how).second; }
  bool resume() const { return script("resume", port_).second; }

 private:
  std::pair<std::string, bool> script(const std::string& verb, const std::string& more = "") const {
    return command(FOREST_SOURCE_DIR "/tests/postgresql.sh " + verb + " " + folder_.string() + " " + more);
  }
  std::string client(const std::string& database) const {
    return "psql -X -q -v ON_ERROR_STOP=1 -h 127.0.0.1 -p " + port_ + " -U forest -d " + database;
  }
  static std::pair<std::string, bool> command(const std::string& line) {
    std::string said;
    FILE* pipe = ::popen(line.c_str(), "r");
    std::array<char, 256> buffer;
    while (pipe && std::fgets(buffer.data(), int(buffer.size()), pipe)) said += buffer.data();
    return {said, pipe && ::pclose(pipe) == 0};
  }

  std::filesystem::path folder_;
  pid_t owner_;
  std::string port_;
};

}  // namespace forest
