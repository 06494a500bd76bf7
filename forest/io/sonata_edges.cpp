// SPDX-License-Identifier: Apache-2.0
#include "forest/io/sonata_edges.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <map>
#include <optional>
#include <unordered_map>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/io/hdf5.h"
#include "forest/io/sonata_config.h"
#include "forest/io/sonata_nodes.h"

namespace forest::io {
namespace {

namespace fs = std::filesystem;
using circuit::Sign;
using circuit::Synapse;

using Names = std::initializer_list<const char*>;  // of one attribute, the first that is there counts

// One population of an edges file, seen as a table.
class EdgePopulation {
 public:
  EdgePopulation(const hdf5::File& file, const std::string& name) : file_(file), path_("/edges/" + name) {
    targets = file.integers(path_ + "/target_node_id");
    sources = file.integers(path_ + "/source_node_id");
    const std::size_t count = targets.size();
    same_size("source_node_id", sources.size());
    for (const auto* ids : {&targets, &sources})
      for (const std::int64_t id : *ids)
        if (id < 0)
          file.refuse(fmt::format("{} has an edge of node {}, below zero; the file is damaged", path_, id));
    // Files of a single group may leave the two indices out.
    std::vector<std::int64_t> ids(count, 0), indices(count);
    for (std::size_t i = 0; i < count; ++i) indices[i] = std::int64_t(i);
    for (auto [key, values] : {std::pair{"edge_group_id", &ids}, {"edge_group_index", &indices}}) {
      if (file.kind(path_ + "/" + key) == hdf5::Kind::none) continue;
      *values = file.integers(path_ + "/" + key);
      same_size(key, values->size());
    }
    std::map<std::int64_t, std::uint32_t> number;
    for (std::size_t i = 0; i < count; ++i) {
      const auto [place, fresh] = number.try_emplace(ids[i], std::uint32_t(groups_.size()));
      if (fresh) groups_.push_back({fmt::format("{}/{}", path_, ids[i]), 0});
      if (indices[i] < 0 || indices[i] > std::int64_t(1) << 31)
        file.refuse(fmt::format("{}/edge_group_index of edge {} is {}; it must be an entry of its group",
                                path_, i, indices[i]));
      group_.push_back(place->second), index_.push_back(std::uint32_t(indices[i]));
      Group& group = groups_[place->second];
      group.size = std::max(group.size, std::size_t(indices[i]) + 1);
    }
  }

  std::size_t size() const { return targets.size(); }
  std::vector<std::int64_t> sources, targets;  // nodes

  // Which population the nodes are of: "source" or "target".
  std::string nodes(const char* end) const {
    return file_.text_attribute(fmt::format("{}/{}_node_id", path_, end), "node_population");
  }
  // Of every edge; `otherwise` where its group has none. None when no group has any.
  std::optional<std::vector<float>> reals(Names names, float otherwise) const {
    return values<float>(names, otherwise, [&](const std::string& path) { return file_.reals(path); });
  }
  std::optional<std::vector<std::int64_t>> integers(Names names, std::int64_t otherwise) const {
    return values<std::int64_t>(names, otherwise,
                                [&](const std::string& path) { return file_.integers(path); });
  }
  std::optional<std::array<std::vector<float>, 3>> places(const char* name) const {
    std::array<std::vector<float>, 3> found;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::string one = fmt::format("{}_{}", name, "xyz"[axis]);
      auto values = reals({one.c_str()}, Synapse::nowhere);
      if (!values) return std::nullopt;
      found[axis] = std::move(*values);
    }
    return found;
  }

 private:
  struct Group {
    std::string path;
    std::size_t size = 0;  // entries that edges refer to
  };

  void same_size(const char* array, std::size_t size) const {
    if (size != targets.size())
      file_.refuse(fmt::format("{}/{} has {} entries, but the population has {} edges; they must be as many",
                               path_, array, size, targets.size()));
  }

  template <class T>
  std::optional<std::vector<T>> values(Names names, T otherwise, auto&& read) const {
    std::vector<std::vector<T>> of_group(groups_.size());
    bool any = false;
    for (std::size_t g = 0; g < groups_.size(); ++g)
      for (const char* name : names) {
        const std::string path = groups_[g].path + "/" + name;
        if (file_.kind(path) == hdf5::Kind::none) continue;
        of_group[g] = read(path);
        if (of_group[g].size() < groups_[g].size)
          file_.refuse(
              fmt::format("array {} has {} entries, but edges refer to entry {}; the file is not complete",
                          path, of_group[g].size(), groups_[g].size - 1));
        any = true;
        break;
      }
    if (!any) return std::nullopt;
    std::vector<T> result(size(), otherwise);
    for (std::size_t i = 0; i < size(); ++i)
      if (const auto& group = of_group[group_[i]]; !group.empty()) result[i] = group[index_[i]];
    return result;
  }

  const hdf5::File& file_;
  std::string path_;
  std::vector<Group> groups_;
  std::vector<std::uint32_t> group_, index_;  // of every edge
};

class Reader {
 public:
  Reader(const SonataConfig& config, const circuit::Circuit& circuit, const reports::Nodes& nodes)
      : config_(config), circuit_(circuit), nodes_(nodes), instances_(nodes.populations.size()) {
    for (std::uint32_t i = 0; i < nodes.of_instance.size(); ++i) {
      const reports::Node& node = nodes.of_instance[i];
      instances_[node.population].try_emplace(node.id, i);
    }
  }

  SonataEdges run() {
    const Json* networks = SonataConfig::find(config_.json(), "networks");
    const Json* edges = SonataConfig::find(*networks, "edges");
    if (edges && !edges->is_array()) config_.refuse("\"edges\" must be a list of files");
    if (edges)
      for (const Json& entry : *edges) but_for_damage([&] { add_file(entry); });
    return std::move(result_);
  }

 private:
  void warn(std::string_view code, std::string sentence) {
    result_.warnings.push_back({0, code, std::move(sentence)});
  }

  void but_for_damage(const auto& read) {
    try {
      read();
    } catch (const Error& error) {
      result_.damaged.push_back(fmt::format("{}; these synapses were left out", error.what()));
    }
  }

  void add_file(const Json& entry) {
    const auto path = config_.path(entry, "edges_file");
    if (!path) config_.refuse("an entry of \"edges\" has no \"edges_file\"; add it");
    const hdf5::File file(*path);
    const Json* populations = SonataConfig::find(entry, "populations");
    if (!populations || !populations->is_object()) {
      for (const std::string& name : file.members("/edges"))
        but_for_damage([&] { add_population(file, name); });
      return;
    }
    for (const auto& [name, description] : populations->items()) {
      const Json* type = SonataConfig::find(description, "type");
      if (type && *type != "chemical")
        warn("not-synapses",
             fmt::format("edges {} are {}, no synapses; they were left out", name, type->dump()));
      else
        but_for_damage([&] { add_population(file, name); });
    }
  }

  void add_population(const hdf5::File& file, const std::string& name) {
    const EdgePopulation edges(file, name);
    circuit::Projection projection{name, edges.nodes("source"), edges.nodes("target"), {}};
    const auto* targets = instances_of(projection.target);
    if (!targets) {
      warn(
          "no-target",
          projection.target.empty()
              ? fmt::format("edges {} do not say on which population they end (the attribute node_population "
                            "of target_node_id); they were left out",
                            name)
              : fmt::format(
                    "edges {} end on population {}, of which no neuron is planted; they were left out", name,
                    projection.target));
      return;
    }
    const auto* sources = instances_of(projection.source);
    const auto sections = edges.integers({"afferent_section_id", "sec_id"}, Synapse::no_section);
    const auto positions = edges.reals({"afferent_section_pos", "sec_x"}, Synapse::nowhere);
    const auto centres = edges.places("afferent_center"), surfaces = edges.places("afferent_surface");
    const auto types = edges.integers({"syn_type_id"}, -1);
    const std::unordered_map<std::uint64_t, Sign> virtual_signs =
        sources ? std::unordered_map<std::uint64_t, Sign>() : signs_of(projection.source);
    const auto place = [](const auto& all, std::size_t i) {
      return all ? Vec3((*all)[0][i], (*all)[1][i], (*all)[2][i]) : Vec3(Vec3::Constant(Synapse::nowhere));
    };
    std::size_t elsewhere = 0, not_placed = 0;
    for (std::size_t i = 0; i < edges.size(); ++i) {
      const auto target = targets->find(std::uint64_t(edges.targets[i]));
      if (target == targets->end()) {
        ++elsewhere;
        continue;
      }
      Synapse s{.target = target->second, .source = std::uint64_t(edges.sources[i])};
      const bool on_section = sections && positions && (*sections)[i] >= 0 && (*sections)[i] <= 0x7fffffff &&
                              (*positions)[i] >= 0.f && (*positions)[i] <= 1.f;
      if (on_section) s.element = std::int32_t((*sections)[i]), s.position = (*positions)[i];
      s.centre = place(centres, i), s.surface = place(surfaces, i);
      if (!on_section && !s.centre.allFinite()) {
        ++not_placed;
        continue;
      }
      if (sources)
        if (const auto from = sources->find(s.source); from != sources->end()) {
          s.neuron = from->second;
          s.sign = circuit_.types[circuit_.instances[s.neuron].type].excitatory ? Sign::excitatory
                                                                                : Sign::inhibitory;
        }
      if (const auto known = virtual_signs.find(s.source); known != virtual_signs.end())
        s.sign = known->second;
      if (s.sign == Sign::unknown && types && (*types)[i] >= 0)
        s.sign = (*types)[i] >= 100 ? Sign::excitatory : Sign::inhibitory;
      projection.synapses.push_back(s);
    }
    if (elsewhere)
      warn("no-target", fmt::format("{} edges of {} end on neurons that are not planted; they were left out",
                                    elsewhere, name));
    if (not_placed)
      warn("no-place",
           fmt::format(
               "{} edges of {} say neither section and position (0 to 1) nor place; they were left out",
               not_placed, name));
    if (!projection.synapses.empty()) result_.projections.push_back(std::move(projection));
  }

  const std::unordered_map<std::uint64_t, std::uint32_t>* instances_of(const std::string& population) const {
    const auto found = std::ranges::find(nodes_.populations, population);
    if (found == nodes_.populations.end()) return nullptr;
    const auto& all = instances_[std::size_t(found - nodes_.populations.begin())];
    return all.empty() ? nullptr : &all;
  }

  // Of the nodes of a population that has no shapes.
  std::unordered_map<std::uint64_t, Sign> signs_of(const std::string& population) const {
    if (population.empty()) return {};
    const Json* networks = SonataConfig::find(config_.json(), "networks");
    const Json* nodes = SonataConfig::find(*networks, "nodes");
    for (const Json& entry : nodes && nodes->is_array() ? *nodes : Json::array()) {
      const auto path = config_.path(entry, "nodes_file");
      if (!path || !fs::exists(*path)) continue;
      const hdf5::File file(*path);
      if (file.kind("/nodes/" + population) != hdf5::Kind::group) continue;
      std::optional<Table> types;
      const auto types_file = config_.path(entry, "node_types_file");
      if (types_file && types_file->has_filename())
        types = parse_table(MappedFile(*types_file).text(), types_file->string());
      const NodePopulation table(file, population, types ? &*types : nullptr,
                                 types_file.value_or("").string());
      const std::vector<std::uint64_t> ids = table.ids();
      const Categories ei = table.texts("ei"), words = table.texts("synapse_class");
      std::unordered_map<std::uint64_t, Sign> signs;
      for (std::size_t i = 0; i < ids.size(); ++i)
        for (const Categories* told : {&ei, &words}) {
          if (told->index[i] == Categories::none) continue;
          const std::string& word = told->values[told->index[i]];
          if (word == "i" || word == "INH") signs[ids[i]] = Sign::inhibitory;
          if (word == "e" || word == "EXC") signs[ids[i]] = Sign::excitatory;
        }
      return signs;
    }
    return {};
  }

  const SonataConfig& config_;
  const circuit::Circuit& circuit_;
  const reports::Nodes& nodes_;
  std::vector<std::unordered_map<std::uint64_t, std::uint32_t>> instances_;  // by population, node
  SonataEdges result_;
};

}  // namespace

SonataEdges read_edges(const fs::path& place, const circuit::Circuit& circuit, const reports::Nodes& nodes) {
  const SonataConfig config(place);
  return Reader(config, circuit, nodes).run();
}

void write_edges(const fs::path& path, const fs::path& named,
                 std::span<const circuit::Projection> projections) {
  hdf5::NewFile file(path, named);
  file.attribute("/", "version", std::array<std::uint32_t, 2>{0, 1});
  file.attribute("/", "magic", sonata_magic);
  file.group("/edges");
  for (const circuit::Projection& p : projections) {
    const std::string base = "/edges/" + p.name, group = base + "/0";
    file.group(group);
    const auto column = [&]<class Of>(const std::string& name, Of of) {
      std::vector<std::invoke_result_t<Of, const Synapse&, std::size_t>> values;
      values.reserve(p.synapses.size());
      for (std::size_t i = 0; i < p.synapses.size(); ++i) values.push_back(of(p.synapses[i], i));
      file.write(name, std::span(std::as_const(values)));
    };
    column(base + "/source_node_id", [](const Synapse& s, std::size_t) { return s.source; });
    column(base + "/target_node_id", [](const Synapse& s, std::size_t) { return std::uint64_t(s.target); });
    file.attribute(base + "/source_node_id", "node_population", p.source);
    file.attribute(base + "/target_node_id", "node_population", p.target);
    column(base + "/edge_type_id", [](const Synapse&, std::size_t) { return std::uint32_t(0); });
    column(base + "/edge_group_id", [](const Synapse&, std::size_t) { return std::uint32_t(0); });
    column(base + "/edge_group_index", [](const Synapse&, std::size_t i) { return std::uint64_t(i); });
    column(group + "/afferent_section_id", [](const Synapse& s, std::size_t) { return s.element; });
    column(group + "/afferent_section_pos", [](const Synapse& s, std::size_t) { return s.position; });
    for (const auto& [word, of] : {std::pair{"center", &Synapse::centre}, {"surface", &Synapse::surface}})
      if (std::ranges::any_of(p.synapses, [of = of](const Synapse& s) { return (s.*of).allFinite(); }))
        for (int axis = 0; axis < 3; ++axis)
          column(fmt::format("{}/afferent_{}_{}", group, word, "xyz"[axis]),
                 [of = of, axis](const Synapse& s, std::size_t) { return (s.*of)[axis]; });
  }
  file.close();
}

}  // namespace forest::io
