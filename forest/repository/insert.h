// SPDX-License-Identifier: Apache-2.0
// Rows into a table through a statement that is prepared once. Where rows travel best depends on the database: SQLite
// takes them one by one, a server as arrays, all in one message.
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "forest/repository/database.h"

namespace forest::repository {

using Ints = std::vector<int>;
using Reals = std::vector<double>;
using Texts = std::vector<std::string>;

/// One row at a time. The variables must outlive the statement.
class RowInsert {
 public:
  RowInsert(Database& database, std::string table) : database_(&database), table_(std::move(table)) {}

  RowInsert& with(const char* column, int& value, soci::indicator* filled = nullptr);
  RowInsert& with(const char* column, long long& value, soci::indicator* filled = nullptr);
  RowInsert& with(const char* column, double& value);
  RowInsert& with(const char* column, std::string& value, soci::indicator* filled = nullptr);
  RowInsert& with_bytes(const char* column, const std::string& bytes);  // null when there are none

  /// False when the table has such a row already.
  bool run();

 private:
  struct Bytes {
    const std::string* value;
    std::string text;                  // hexadecimal
    std::unique_ptr<soci::blob> blob;  // or as they are
    soci::indicator filled = soci::i_ok;
  };
  void add(const char* column, const char* expression = nullptr);
  void prepare();

  Database* database_;
  std::string table_, columns_, values_;
  std::deque<Bytes> bytes_;
  std::vector<std::function<void(soci::statement&)>> exchanges_;
  std::unique_ptr<soci::statement> statement_;  // after what it uses
};

/// All rows that belong to one neuron at once.
class RowsInsert {
 public:
  RowsInsert(Database& database, std::string table) : database_(&database), table_(std::move(table)) {}

  RowsInsert& with(const char* column, Ints& values, std::vector<soci::indicator>* filled = nullptr);
  RowsInsert& with(const char* column, Reals& values);
  RowsInsert& with(const char* column, Texts& values);

  void run(std::size_t count);  // every vector is that long

 private:
  struct Column {
    const char* name;
    std::variant<Ints*, Reals*, Texts*> values;
    std::vector<soci::indicator>* filled = nullptr;
    std::string text = {};  // an array, as PostgreSQL writes them
  };
  void prepare();

  Database* database_;
  std::string table_;
  std::deque<Column> columns_;
  std::unique_ptr<soci::statement> statement_;
};

std::string hexadecimal(const std::string& bytes);
std::string from_hexadecimal(const std::string& text);

}  // namespace forest::repository
