// SPDX-License-Identifier: Apache-2.0
// A private PostgreSQL server for the tests of one program, started when it is first asked for.
#pragma once

#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <unistd.h>

namespace forest {

class PostgresqlServer {
 public:
  /// Empty on a machine without PostgreSQL.
  static const PostgresqlServer& get() {
    static const PostgresqlServer server;
    return server;
  }
  bool runs() const { return !port_.empty(); }
  /// The address of a database; `role` must exist.
  std::string address(const std::string& database, const std::string& role = "forest") const {
    return "postgresql://" + role + "@127.0.0.1:" + port_ + "/" + database;
  }
  /// SQL as the superuser, by the server's own client.
  bool run(const std::string& sql, const std::string& database = "postgres") const {
    return command("psql -X -q -v ON_ERROR_STOP=1 -h 127.0.0.1 -p " + port_ + " -U forest -d " + database +
                   " -c \"" + sql + "\" >/dev/null 2>&1")
        .second;
  }

 private:
  PostgresqlServer()
      : folder_(std::filesystem::temp_directory_path() / ("forest-postgresql-" + std::to_string(::getpid()))),
        owner_(::getpid()) {
    const auto [said, good] = command(FOREST_SOURCE_DIR "/tests/postgresql.sh start " + folder_.string());
    if (good) port_ = said.substr(0, said.find('\n'));
  }
  ~PostgresqlServer() {
    if (runs() && owner_ == ::getpid())
      command(FOREST_SOURCE_DIR "/tests/postgresql.sh stop " + folder_.string());
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
