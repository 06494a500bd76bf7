// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/forest.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/hash.h"
#include "forest/core/parallel.h"
#include "forest/morphology/measure.h"

namespace forest::scene {
namespace {

static_assert(std::endian::native == std::endian::little,
              "the forest file is little-endian, as the graphics card is");

constexpr std::array<char, 8> magic{'B', 'F', 'O', 'R', 'E', 'S', 'T', '\n'};
constexpr std::uint32_t version = 2;
constexpr std::size_t alignment = 64;

// In the order of the file.
enum Part : std::uint32_t {
  segments,
  instances,
  clusters,
  neurons,
  section_of_segment,
  sections,
  types,
  layers,
  text,
  places,
  part_count
};
constexpr std::array<std::uint32_t, part_count> element_sizes{sizeof(frame::Segment),
                                                              sizeof(frame::Instance),
                                                              sizeof(Cluster),
                                                              sizeof(Neuron),
                                                              4,
                                                              sizeof(SectionFacts),
                                                              4,
                                                              4,
                                                              1,
                                                              sizeof(reports::Place)};

struct Entry {
  std::uint32_t part, element_size;
  std::uint64_t offset, count, hash;
};
struct Header {
  std::array<char, 8> magic;
  std::uint32_t version, parts;
  std::uint64_t file_size, table_hash;
  std::array<Entry, part_count> table;
};
static_assert(sizeof(Entry) == 32 && sizeof(Header) == 32 + 32 * part_count);

using Json = nlohmann::ordered_json;

std::string describe(const circuit::Circuit& c, const circuit::NodeNames& nodes) {
  Json json{{"name", c.name}, {"radius", c.radius}, {"morphologies", c.morphologies}};
  for (const auto& layer : c.layers)
    json["layers"].push_back({{"name", layer.name}, {"bottom", layer.bottom}, {"top", layer.top}});
  for (const auto& type : c.types)
    json["types"].push_back(
        {{"name", type.name}, {"population", type.population}, {"excitatory", type.excitatory}});
  if (!nodes.runs.empty()) json["populations"] = nodes.populations;
  for (const circuit::NodeRun& run : nodes.runs)
    json["nodes"].push_back({run.population, run.first_node, run.count});
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

circuit::Circuit understand(std::string_view text, circuit::NodeNames& nodes) {
  const Json json = Json::parse(text);
  circuit::Circuit c;
  c.name = json.at("name");
  c.radius = json.at("radius");
  c.morphologies = json.at("morphologies");
  if (json.contains("layers"))
    for (const auto& l : json["layers"]) c.layers.push_back({l.at("name"), l.at("bottom"), l.at("top")});
  if (json.contains("types"))
    for (const auto& t : json["types"])
      c.types.push_back({t.at("name"), t.at("population"), t.at("excitatory")});
  if (json.contains("nodes")) {
    nodes.populations = json.at("populations");
    for (const auto& run : json["nodes"])
      nodes.runs.push_back(
          {.population = run.at(0), .first_instance = 0, .first_node = run.at(1), .count = run.at(2)});
  }
  return c;
}

std::vector<SectionFacts> facts_of(const Morphology& m) {
  std::vector<SectionFacts> facts;
  const auto distances = path_distances(m);
  for (std::size_t i = 0; i < m.sections().size(); ++i) {
    const SectionId id(i);
    const auto points = m.points(id);
    const Section& s = m.section(id);
    facts.push_back({s.parent.valid() ? s.parent.value() : 0xffffffffu, std::uint32_t(s.kind),
                     std::uint32_t(m.order(id)), std::uint32_t(m.children(id).size()),
                     float(section_length(m, id)), 2.f * points.front().radius, 2.f * points.back().radius,
                     float(distances[i])});
  }
  return facts;
}

}  // namespace

std::vector<std::byte> pack(const circuit::Circuit& c, std::span<const Morphology> morphologies,
                            Progress& progress, const circuit::NodeNames& nodes) {
  circuit::check(c);
  if (morphologies.size() != c.morphologies.size())
    throw Error(fmt::format("the circuit names {} morphologies and {} came with it", c.morphologies.size(),
                            morphologies.size()));
  progress.begin("packing", morphologies.size());
  std::vector<ClusterTree> trees(morphologies.size());
  parallel_for(trees.size(), 1, [&](std::size_t i) {
    trees[i] = build_clusters(morphologies[i]);
    progress.advance();
  });

  std::vector<frame::Segment> all_segments;
  std::vector<Cluster> all_clusters;
  std::vector<Neuron> all_neurons;
  std::vector<std::uint32_t> all_section_of_segment, all_types, all_layers;
  std::vector<SectionFacts> all_sections;
  std::vector<reports::Place> all_places;
  for (std::size_t i = 0; i < trees.size(); ++i) {
    const ClusterTree& tree = trees[i];
    const auto facts = facts_of(morphologies[i]);
    const Neuron n{.first_cluster = std::uint32_t(all_clusters.size()),
                   .cluster_count = std::uint32_t(tree.clusters.size()),
                   .first_segment = std::uint32_t(all_segments.size()),
                   .original_count = tree.original_count,
                   .first_original = std::uint32_t(all_section_of_segment.size()),
                   .first_section = std::uint32_t(all_sections.size()),
                   .section_count = std::uint32_t(facts.size()),
                   .soma_radius = tree.soma_radius};
    for (Cluster cluster : tree.clusters) {
      cluster.first_segment += n.first_segment;
      cluster.leaf_first += n.first_segment;
      if (!cluster.is_leaf())
        for (auto& child : cluster.children) child += n.first_cluster;
      all_clusters.push_back(cluster);
    }
    all_segments.insert(all_segments.end(), tree.segments.begin(), tree.segments.end());
    all_places.insert(all_places.end(), tree.places.begin(), tree.places.end());
    all_section_of_segment.insert(all_section_of_segment.end(), tree.section.begin(), tree.section.end());
    all_sections.insert(all_sections.end(), facts.begin(), facts.end());
    all_neurons.push_back(n);
  }
  if (all_segments.size() > 0xffffffffull)
    throw LimitError(
        "a forest file holds at most 4,294,967,295 distinct segments; plant fewer distinct neurons");
  std::vector<frame::Instance> all_instances;
  for (const circuit::Instance& i : c.instances) {
    const Quat q = i.orientation;
    all_instances.push_back(
        {i.position.x(), i.position.y(), i.position.z(), i.morphology, q.x(), q.y(), q.z(), q.w()});
    all_types.push_back(i.type);
    all_layers.push_back(i.layer);
  }
  const std::string description = describe(c, nodes);
  const std::array<std::span<const std::byte>, part_count> parts{
      std::as_bytes(std::span(all_segments)),
      std::as_bytes(std::span(all_instances)),
      std::as_bytes(std::span(all_clusters)),
      std::as_bytes(std::span(all_neurons)),
      std::as_bytes(std::span(all_section_of_segment)),
      std::as_bytes(std::span(all_sections)),
      std::as_bytes(std::span(all_types)),
      std::as_bytes(std::span(all_layers)),
      std::as_bytes(std::span(description)),
      std::as_bytes(std::span(all_places))};
  Header header{
      .magic = magic, .version = version, .parts = part_count, .file_size = 0, .table_hash = 0, .table = {}};
  std::uint64_t at = sizeof(Header);
  for (std::uint32_t p = 0; p < part_count; ++p) {
    at = (at + alignment - 1) / alignment * alignment;
    header.table[p] = {p, element_sizes[p], at, parts[p].size() / element_sizes[p], hash64(parts[p])};
    at += parts[p].size();
  }
  header.file_size = at;
  header.table_hash = hash64(std::as_bytes(std::span(header.table)), at);
  std::vector<std::byte> bytes(at);
  std::memcpy(bytes.data(), &header, sizeof header);
  for (std::uint32_t p = 0; p < part_count; ++p)
    if (!parts[p].empty())
      std::memcpy(bytes.data() + header.table[p].offset, parts[p].data(), parts[p].size());
  progress.end();
  return bytes;
}

struct Forest::Data {
  std::optional<MappedFile> file;
  std::vector<std::byte> memory;
  std::array<std::span<const std::byte>, part_count> parts;
  circuit::Circuit circuit;
  circuit::NodeNames nodes;
  Bounds soma_bounds;
  std::uint64_t segment_total = 0, bytes = 0;

  template <class T>
  std::span<const T> as(Part part) const {
    return {reinterpret_cast<const T*>(parts[part].data()), parts[part].size() / sizeof(T)};
  }
};

std::span<const frame::Segment> Forest::segments() const { return data_->as<frame::Segment>(Part::segments); }
std::span<const frame::Instance> Forest::instances() const {
  return data_->as<frame::Instance>(Part::instances);
}
std::span<const Cluster> Forest::clusters() const { return data_->as<Cluster>(Part::clusters); }
std::span<const Neuron> Forest::neurons() const { return data_->as<Neuron>(Part::neurons); }
std::span<const std::uint32_t> Forest::section_of_segment() const {
  return data_->as<std::uint32_t>(Part::section_of_segment);
}
std::span<const SectionFacts> Forest::sections() const { return data_->as<SectionFacts>(Part::sections); }
std::span<const reports::Place> Forest::places() const { return data_->as<reports::Place>(Part::places); }
std::span<const std::uint32_t> Forest::types() const { return data_->as<std::uint32_t>(Part::types); }
std::span<const std::uint32_t> Forest::layers() const { return data_->as<std::uint32_t>(Part::layers); }
const circuit::Circuit& Forest::circuit() const { return data_->circuit; }
const circuit::NodeNames& Forest::nodes() const { return data_->nodes; }
const Bounds& Forest::soma_bounds() const { return data_->soma_bounds; }
std::uint64_t Forest::segment_total() const { return data_->segment_total; }
std::uint64_t Forest::bytes() const { return data_->bytes; }

Forest Forest::open(const std::filesystem::path& path) {
  auto data = std::make_shared<Data>();
  data->file.emplace(path);
  const auto bytes = data->file->bytes();
  return check(std::move(data), bytes, path.string());
}

Forest Forest::from_bytes(std::vector<std::byte> memory, const std::string& name) {
  auto data = std::make_shared<Data>();
  data->memory = std::move(memory);
  const std::span<const std::byte> bytes = data->memory;
  return check(std::move(data), bytes, name);
}

Forest Forest::check(std::shared_ptr<Data> data, std::span<const std::byte> bytes, const std::string& name) {
  const auto require = [&](bool good, const std::string& sentence) {
    if (!good) throw InputError(name, 0, sentence);
  };
  const std::string again = "; pack the circuit again";
  Header header;
  require(bytes.size() >= sizeof header, "is too short to be a forest file" + again);
  std::memcpy(&header, bytes.data(), sizeof header);
  require(header.magic == magic, "is not a forest file; make one with 'brainforest pack'");
  require(header.version == version && header.parts == part_count,
          fmt::format("has version {} of the forest file and this program reads version {}", header.version,
                      version) +
              again);
  require(header.file_size == bytes.size(),
          fmt::format("is cut short or has grown: {} bytes instead of {}", bytes.size(), header.file_size) +
              again);
  require(hash64(std::as_bytes(std::span(header.table)), header.file_size) == header.table_hash,
          "has a damaged table of contents" + again);
  std::uint64_t end =
      sizeof header;  // of what has been looked at; gaps hold zeros, so that no byte goes unchecked
  for (std::uint32_t p = 0; p < part_count; ++p) {
    const Entry& e = header.table[p];
    require(e.part == p && e.element_size == element_sizes[p] && e.offset % alignment == 0 &&
                e.offset <= bytes.size() && e.count <= (bytes.size() - e.offset) / e.element_size,
            "has a wrong table of contents" + again);
    require(e.offset >= end && e.offset - end < alignment &&
                std::ranges::all_of(bytes.subspan(end, e.offset - end),
                                    [](std::byte b) { return b == std::byte{0}; }),
            "is damaged between its parts" + again);
    end = e.offset + e.count * e.element_size;
    data->parts[p] = bytes.subspan(e.offset, e.count * e.element_size);
    require(hash64(data->parts[p]) == e.hash,
            fmt::format("is damaged: part {} does not match its checksum", p) + again);
  }
  // A right checksum over wrong numbers is possible too: every index is looked at before it is used.
  const std::string wrong = "names things that are not in it" + again;
  const auto within = [](std::uint64_t first, std::uint64_t count, std::size_t size) {
    return first + count <= size;
  };
  const Forest f(data);
  try {
    const auto text = data->parts[Part::text];
    data->circuit = understand({reinterpret_cast<const char*>(text.data()), text.size()}, data->nodes);
  } catch (const nlohmann::json::exception&) {
    throw InputError(name, 0, "has a damaged description" + again);
  }
  require(f.neurons().size() == data->circuit.morphologies.size() &&
              f.places().size() == f.segments().size() && f.types().size() == f.instances().size() &&
              f.layers().size() == f.instances().size(),
          wrong);
  for (const Cluster& c : f.clusters()) {
    require(c.segment_count <= frame::cluster_size &&
                within(c.first_segment, c.segment_count, f.segments().size()) &&
                within(c.leaf_first, c.leaf_count, f.segments().size()),
            wrong);
    const std::size_t own = std::size_t(&c - f.clusters().data());
    for (const auto child : c.children)  // children come later, so a walk ends
      require(c.is_leaf() ? child == 0 : child > own && child < f.clusters().size(), wrong);
    require(std::isfinite(c.x + c.y + c.z + c.radius + c.error) && c.radius >= 0.f, wrong);
  }
  for (const Neuron& n : f.neurons())
    require(within(n.first_cluster, n.cluster_count, f.clusters().size()) &&
                within(n.first_segment, n.original_count, f.segments().size()) &&
                within(n.first_original, n.original_count, f.section_of_segment().size()) &&
                within(n.first_section, n.section_count, f.sections().size()) && std::isfinite(n.soma_radius),
            wrong);
  for (const Neuron& n : f.neurons())
    for (std::uint32_t i = n.first_original; i < n.first_original + n.original_count; ++i)
      require(f.section_of_segment()[i] == soma_section || f.section_of_segment()[i] < n.section_count,
              wrong);
  for (const Neuron& n : f.neurons())
    for (const Cluster& c : f.clusters().subspan(n.first_cluster, n.cluster_count))
      for (const reports::Place& p : f.places().subspan(c.first_segment, c.segment_count))
        require((p.section == soma_section || p.section < n.section_count) && p.position >= 0.f &&
                    p.position <= 1.f,
                wrong);
  for (const Neuron& n : f.neurons())
    for (std::uint32_t i = 0; i < n.section_count; ++i) {
      const std::uint32_t parent = f.sections()[n.first_section + i].parent;
      require(parent == 0xffffffffu || parent < i, wrong);
    }
  for (std::size_t i = 0; i < f.instances().size(); ++i) {
    const frame::Instance& instance = f.instances()[i];
    require(instance.morphology < f.neurons().size() && f.types()[i] < data->circuit.types.size() &&
                f.layers()[i] < data->circuit.layers.size() &&
                std::isfinite(instance.x + instance.y + instance.z) &&
                std::isfinite(instance.qx + instance.qy + instance.qz + instance.qw),
            wrong);
    data->soma_bounds.add({instance.x, instance.y, instance.z});
    data->segment_total += f.neurons()[instance.morphology].original_count;
  }
  circuit::NodeNames& nodes = data->nodes;
  if (nodes.runs.empty()) nodes = {{data->circuit.name}, {{0, 0, 0, std::uint32_t(f.instances().size())}}};
  std::uint64_t named = 0;
  for (circuit::NodeRun& run : nodes.runs) {
    require(run.population < nodes.populations.size() && run.count <= f.instances().size() - named, wrong);
    run.first_instance = std::uint32_t(named);
    named += run.count;
  }
  require(named == f.instances().size(), wrong);
  data->bytes = bytes.size();
  return f;
}

}  // namespace forest::scene
