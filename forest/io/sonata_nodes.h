// SPDX-License-Identifier: Apache-2.0
// One population of a SONATA nodes file, seen as a table: an attribute of a node is looked up in the node's group, then
// in the row of its type. Internal to io/sonata.cpp.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "forest/io/hdf5.h"
#include "forest/io/node_types.h"

namespace forest::io {

/// One text a node, each different text stored once.
struct Categories {
  static constexpr std::uint32_t none = 0xffffffffu;

  std::vector<std::string> values;  // in the order of the file's library, or of first use
  std::vector<std::uint32_t>
      index;  // for each node, into values; none when it has no such attribute, or NULL
};

class NodePopulation {
 public:
  /// Throws InputError when the population is not laid out as published.
  /// @param types  of the whole file, or null
  NodePopulation(const hdf5::File& file, const std::string& name, const Table* types,
                 const std::string& types_file);

  std::size_t size() const { return type_ids_.size(); }

  /// The number of each node: its row, unless the file says otherwise.
  std::vector<std::uint64_t> ids() const;

  /// None when no node has the attribute; missing ones of some nodes are `otherwise`.
  std::optional<std::vector<float>> reals(const std::string& attribute, float otherwise) const;

  /// The whole numbers of an attribute that all nodes have in their groups; none when some have not, or have other than numbers.
  std::optional<std::vector<std::int64_t>> integers(const std::string& attribute) const;

  /// All indices none when no node has the attribute. Whole numbers are read as their digits, or by their library.
  Categories texts(const std::string& attribute) const;

  /// All that is told of the nodes under a name: arrays of their groups and columns of their types; sorted.
  std::vector<std::string> attributes() const;
  /// Numbers, NaN where a node has none; none when any of them is a word.
  std::optional<std::vector<double>> numbers(const std::string& attribute) const;

  /// Rows of the table of types that belong to this population, in its order; and what stands in them ("": NULL, or
  /// no such column).
  const std::vector<std::size_t>& type_rows() const { return type_rows_; }
  std::string type_cell(std::size_t row, std::string_view column) const;

 private:
  struct Group {
    std::string path;      // "/nodes/column/0"
    std::size_t size = 0;  // entries of each of its arrays that are used
  };

  const std::string* cell(std::size_t node, std::optional<std::size_t> column) const;
  void check_size(const std::string& path, std::size_t size, const Group& group) const;

  const hdf5::File& file_;
  std::string path_;
  const Table* types_;
  std::string types_file_;
  std::vector<std::int64_t> type_ids_;
  std::vector<Group> groups_;
  std::vector<std::uint32_t> group_of_, index_in_group_;  // by node
  std::vector<std::size_t> type_rows_, row_of_;  // row_of_: by node; types_->rows.size() when it has none
};

}  // namespace forest::io
