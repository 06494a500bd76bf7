// SPDX-License-Identifier: Apache-2.0
// Rows into a table, through a statement that is prepared once and reads its values from variables it was told of:
//
//   Insert insert(database, "spines");
//   insert.with("neuron", id).with("section", sections).with("shape", shapes);   // a column: a value or a vector of them
//   insert.run(sections.size());                                                 // as often as one likes
//
// How rows travel best depends on the database: SQLite reads the columns as a table, a server gets arrays in one message.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "forest/repository/database.h"

namespace forest::repository {

using Ints = std::vector<int>;
using Longs = std::vector<long long>;
using Reals = std::vector<double>;
using Texts = std::vector<std::string>;

/// Where the values of a column stand. What is no vector is the same in every row.
struct InsertColumn {
  const char* name;
  std::variant<const Ints*, const Longs*, const Reals*, const Texts*, const int*, const long long*,
               const double*, const std::string*>
      values;
  bool bytes = false;                                 // a text that is no text; null when empty
  std::function<bool(std::size_t row)> is_null = {};  // of no row when empty
  bool whole = false;                                 // whole numbers as reals: rounded
};

/// The prepared statement of one database.
class InsertStatement {
 public:
  virtual ~InsertStatement() = default;
  virtual std::size_t run(std::size_t count) = 0;
};

class Insert {
 public:
  Insert(Database& database, std::string table) : database_(&database), table_(std::move(table)) {}

  /// The variable must outlive the last run().
  template <class T>
  Insert& with(const char* column, const T& values, std::function<bool(std::size_t)> is_null = {}) {
    columns_.push_back({column, &values, false, std::move(is_null)});
    return *this;
  }
  Insert& with_whole(const char* column, const Reals& values) {
    columns_.push_back({column, &values, false, {}, true});
    return *this;
  }
  Insert& with_bytes(const char* column, const std::string& bytes) {
    columns_.push_back({column, &bytes, true});
    return *this;
  }

  const std::string& table() const { return table_; }
  const std::vector<InsertColumn>& columns() const { return columns_; }

  /// Stores `count` rows, which every vector must have; returns how many were not there already, by some unique column.
  std::size_t run(std::size_t count = 1);

 private:
  Database* database_;
  std::string table_;
  std::vector<InsertColumn> columns_;
  std::unique_ptr<InsertStatement> statement_;
};

std::string hexadecimal(const std::string& bytes);
std::string from_hexadecimal(const std::string& text);

}  // namespace forest::repository
