// SPDX-License-Identifier: Apache-2.0
#include "forest/io/sonata_nodes.h"

#include <algorithm>
#include <limits>
#include <set>
#include <unordered_map>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/number.h"

namespace forest::io {
namespace {

bool absent(std::string_view text) {
  return text.empty() || text == "NULL" || text == "NONE" || text == "None";
}

/// Gives texts numbers in the order of their first use.
class Numbering {
 public:
  explicit Numbering(std::vector<std::string>& values) : values_(values) {
    for (std::size_t i = 0; i < values.size(); ++i) known_.try_emplace(values[i], std::uint32_t(i));
  }
  std::uint32_t operator()(const std::string& text) {
    if (absent(text)) return Categories::none;
    const auto [place, fresh] = known_.try_emplace(text, std::uint32_t(values_.size()));
    if (fresh) values_.push_back(text);
    return place->second;
  }

 private:
  std::vector<std::string>& values_;
  std::unordered_map<std::string, std::uint32_t> known_;
};

}  // namespace

NodePopulation::NodePopulation(const hdf5::File& file, const std::string& name, const Table* types,
                               const std::string& types_file)
    : file_(file), path_("/nodes/" + name), types_(types), types_file_(types_file) {
  type_ids_ = file.integers(path_ + "/node_type_id");
  const std::size_t count = type_ids_.size();

  // Files of a single group may leave the two indices out.
  std::vector<std::int64_t> ids(count, 0), indices(count);
  for (std::size_t i = 0; i < count; ++i) indices[i] = std::int64_t(i);
  for (auto [key, values] : {std::pair{"/node_group_id", &ids}, {"/node_group_index", &indices}}) {
    if (file.kind(path_ + key) == hdf5::Kind::none) continue;
    *values = file.integers(path_ + key);
    if (values->size() != count)
      file.refuse(fmt::format("{}{} has {} entries, but the population has {} nodes; they must be as many",
                              path_, key, values->size(), count));
  }
  std::map<std::int64_t, std::uint32_t> number_of_group;
  for (std::size_t i = 0; i < count; ++i) {
    const auto [place, fresh] = number_of_group.try_emplace(ids[i], std::uint32_t(groups_.size()));
    if (fresh) groups_.push_back({fmt::format("{}/{}", path_, ids[i]), 0});
    if (indices[i] < 0 || indices[i] > std::int64_t(1) << 31)
      file.refuse(fmt::format("{}/node_group_index of node {} is {}; it must be an entry of its group", path_,
                              i, indices[i]));
    group_of_.push_back(place->second);
    index_in_group_.push_back(std::uint32_t(indices[i]));
    Group& group = groups_[place->second];
    group.size = std::max(group.size, std::size_t(indices[i]) + 1);
  }
  if (file.kind(path_ + "/node_group_id") != hdf5::Kind::none)
    for (const Group& group : groups_)
      if (file.kind(group.path) != hdf5::Kind::group)
        file.refuse(
            fmt::format("nodes refer to group {}, which is not there; the file is not complete", group.path));
  if (groups_.empty()) groups_.push_back({path_ + "/0", 0});  // no node, but perhaps a library

  const std::size_t no_row = types ? types->rows.size() : 0;
  row_of_.assign(count, no_row);
  if (!types) return;
  const auto id_column = types->column("node_type_id"), population_column = types->column("population");
  if (!id_column)
    throw InputError(types_file, 1, "the table of node types has no column node_type_id; add it");
  std::unordered_map<std::int64_t, std::size_t> row_of_type;
  for (std::size_t row = 0; row < types->rows.size(); ++row) {
    const auto& cells = types->rows[row];
    if (population_column && !absent(cells[*population_column]) && cells[*population_column] != name)
      continue;
    const auto id = number_of<std::int64_t>(cells[*id_column]);
    if (!id)
      throw InputError(
          types_file, types->lines[row],
          fmt::format("the node_type_id \"{}\" is not a whole number; correct it", cells[*id_column]));
    row_of_type.try_emplace(*id, row);
    type_rows_.push_back(row);
  }
  for (std::size_t i = 0; i < count; ++i) {
    const auto found = row_of_type.find(type_ids_[i]);
    if (found == row_of_type.end())
      throw InputError(types_file, 0,
                       fmt::format("node {} of population {} is of type {}, which has no row here; add it", i,
                                   name, type_ids_[i]));
    row_of_[i] = found->second;
  }
}

std::vector<std::uint64_t> NodePopulation::ids() const {
  std::vector<std::uint64_t> ids(size());
  const bool told = file_.kind(path_ + "/node_id") == hdf5::Kind::integers;
  const std::vector<std::int64_t> own =
      told ? file_.integers(path_ + "/node_id") : std::vector<std::int64_t>();
  if (told && own.size() != size())
    file_.refuse(
        fmt::format("{}/node_id has {} entries, but the population has {} nodes; they must be as many", path_,
                    own.size(), size()));
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (told && own[i] < 0)
      file_.refuse(fmt::format("{}/node_id holds {}, below zero; the file is damaged", path_, own[i]));
    ids[i] = told ? std::uint64_t(own[i]) : i;
  }
  std::vector<std::uint64_t> sorted = ids;
  std::ranges::sort(sorted);
  if (const auto twice = std::ranges::adjacent_find(sorted); twice != sorted.end())
    file_.refuse(
        fmt::format("{}/node_id holds {} twice; give every node a number of its own", path_, *twice));
  return ids;
}

std::string NodePopulation::type_cell(std::size_t row, std::string_view column) const {
  const auto place = types_->column(column);
  return place && !absent(types_->rows[row][*place]) ? types_->rows[row][*place] : "";
}

const std::string* NodePopulation::cell(std::size_t node, std::optional<std::size_t> column) const {
  return column && row_of_[node] < types_->rows.size() ? &types_->rows[row_of_[node]][*column] : nullptr;
}

void NodePopulation::check_size(const std::string& path, std::size_t size, const Group& group) const {
  if (size < group.size)
    file_.refuse(fmt::format("array {} has {} entries, but nodes refer to entry {}; the file is not complete",
                             path, size, group.size - 1));
}

std::optional<std::vector<float>> NodePopulation::reals(const std::string& attribute, float otherwise) const {
  std::vector<std::vector<float>> of_group(groups_.size());
  bool any = false;
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    const std::string path = groups_[g].path + "/" + attribute;
    if (file_.kind(path) == hdf5::Kind::none) continue;
    of_group[g] = file_.reals(path);
    check_size(path, of_group[g].size(), groups_[g]);
    any = true;
  }
  const auto column = types_ ? types_->column(attribute) : std::nullopt;
  if (!any && !column) return std::nullopt;

  std::vector<float> values(size(), otherwise);
  for (std::size_t i = 0; i < size(); ++i) {
    if (const auto& group = of_group[group_of_[i]]; !group.empty()) {
      values[i] = group[index_in_group_[i]];
    } else if (const std::string* text = cell(i, column); text && !absent(*text)) {
      const auto value = number_of<float>(*text);
      if (!value)
        throw InputError(types_file_, types_->lines[row_of_[i]],
                         fmt::format("{} is \"{}\", not a number; correct it", attribute, *text));
      values[i] = *value;
    }
  }
  return values;
}

std::vector<std::string> NodePopulation::attributes() const {
  std::set<std::string> names;
  for (const Group& group : groups_) {
    if (file_.kind(group.path) != hdf5::Kind::group) continue;
    for (const std::string& name : file_.members(group.path))
      if (file_.kind(group.path + "/" + name) != hdf5::Kind::group) names.insert(name);
  }
  if (types_) names.insert(types_->columns.begin(), types_->columns.end());
  return {names.begin(), names.end()};
}

std::optional<std::vector<double>> NodePopulation::numbers(const std::string& attribute) const {
  std::vector<std::vector<double>> of_group(groups_.size());
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    const std::string path = groups_[g].path + "/" + attribute;
    const hdf5::Kind kind = file_.kind(path);
    if (kind == hdf5::Kind::none) continue;
    if ((kind != hdf5::Kind::integers && kind != hdf5::Kind::reals) ||
        file_.kind(groups_[g].path + "/@library/" + attribute) != hdf5::Kind::none)
      return std::nullopt;
    of_group[g] = file_.doubles(path);
    check_size(path, of_group[g].size(), groups_[g]);
  }
  const auto column = types_ ? types_->column(attribute) : std::nullopt;
  std::vector<double> values(size(), std::numeric_limits<double>::quiet_NaN());
  for (std::size_t i = 0; i < size(); ++i) {
    if (const auto& group = of_group[group_of_[i]]; !group.empty()) {
      values[i] = group[index_in_group_[i]];
    } else if (const std::string* text = cell(i, column); text && !absent(*text)) {
      const auto value = number_of<double>(*text);
      if (!value) return std::nullopt;
      values[i] = *value;
    }
  }
  return values;
}

std::optional<std::vector<std::int64_t>> NodePopulation::integers(const std::string& attribute) const {
  std::vector<std::vector<std::int64_t>> of_group;
  for (const Group& group : groups_) {
    const std::string path = group.path + "/" + attribute;
    if (file_.kind(path) != hdf5::Kind::integers) return std::nullopt;
    of_group.push_back(file_.integers(path));
    check_size(path, of_group.back().size(), group);
  }
  std::vector<std::int64_t> values(size());
  for (std::size_t i = 0; i < size(); ++i) values[i] = of_group[group_of_[i]][index_in_group_[i]];
  return values;
}

Categories NodePopulation::texts(const std::string& attribute) const {
  Categories result;
  result.index.assign(size(), Categories::none);
  std::vector<std::vector<std::uint32_t>> of_group(groups_.size());

  for (std::size_t g = 0; g < groups_.size(); ++g) {
    const std::string path = groups_[g].path + "/" + attribute;
    const std::string library_path = groups_[g].path + "/@library/" + attribute;
    const hdf5::Kind kind = file_.kind(path);
    if (kind == hdf5::Kind::none) continue;
    if (kind == hdf5::Kind::integers && file_.kind(library_path) != hdf5::Kind::none) {
      const auto library = file_.texts(library_path);
      // Every entry of the library gets a number, used or not, so that its order is kept.
      Numbering numbering(result.values);
      std::vector<std::uint32_t> number_of;
      for (const std::string& text : library) number_of.push_back(numbering(text));
      for (const std::int64_t entry : file_.integers(path)) {
        if (entry < 0 || std::size_t(entry) >= library.size())
          file_.refuse(fmt::format("array {} holds {}, but its library has {} entries; the file is damaged",
                                   path, entry, library.size()));
        of_group[g].push_back(number_of[std::size_t(entry)]);
      }
    } else if (kind == hdf5::Kind::integers) {
      Numbering numbering(result.values);
      for (const std::int64_t entry : file_.integers(path))
        of_group[g].push_back(numbering(std::to_string(entry)));
    } else {
      Numbering numbering(result.values);
      for (const std::string& text : file_.texts(path)) of_group[g].push_back(numbering(text));
    }
    check_size(path, of_group[g].size(), groups_[g]);
  }

  const auto column = types_ ? types_->column(attribute) : std::nullopt;
  Numbering numbering(result.values);
  for (std::size_t i = 0; i < size(); ++i) {
    if (const auto& group = of_group[group_of_[i]]; !group.empty())
      result.index[i] = group[index_in_group_[i]];
    else if (const std::string* text = cell(i, column))
      result.index[i] = numbering(*text);
  }
  return result;
}

}  // namespace forest::io
