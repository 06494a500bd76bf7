// SPDX-License-Identifier: Apache-2.0
// Opening; forest_pack.cpp packs.
#include "forest/scene/forest.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/hash.h"
#include "forest/core/json.h"
#include "forest/core/parallel.h"
#include "forest/scene/forest_layout.h"
#include "forest/scene/placed.h"

namespace forest::scene {
namespace {

using namespace layout;
using Json = nlohmann::ordered_json;

Vec3 vector_of(const Json& json) {
  return {json.at(0).get<float>(), json.at(1).get<float>(), json.at(2).get<float>()};
}

circuit::Circuit understand(const Json& json, circuit::NodeNames& nodes) {
  circuit::Circuit c;
  c.name = json.at("name");
  c.radius = json.at("radius");
  c.morphologies = json.at("morphologies");
  if (json.contains("layers"))
    for (const auto& l : json["layers"]) c.layers.push_back({l.at("name"), l.at("bottom"), l.at("top")});
  if (json.contains("types"))
    for (const auto& t : json["types"])
      c.types.push_back({t.at("name"), t.at("population"), t.at("excitatory"), t.value("glia", false)});
  if (json.contains("up")) c.up = vector_of(json["up"]);
  if (json.contains("outline"))
    for (const auto& line : json["outline"]) {
      auto& points = c.outline.emplace_back();
      for (const auto& p : line) points.push_back(vector_of(p));
    }
  if (json.contains("node_sets")) nodes.sets = json.at("node_sets");
  if (json.contains("attributes"))
    for (const auto& a : json["attributes"]) {
      nodes.attributes.push_back({a.at("name"), {}});
      if (a.contains("words")) nodes.attributes.back().of.words = a["words"];
    }
  if (json.contains("nodes")) {
    nodes.populations = json.at("populations");
    for (const auto& run : json["nodes"])
      nodes.runs.push_back(
          {.population = run.at(0), .first_instance = 0, .first_node = run.at(1), .count = run.at(2)});
  }
  return c;
}

}  // namespace

namespace {

constexpr const char* again = "; pack the circuit again";

// What a file is refused with.
struct Refuse {
  const std::string& name;  // of the file

  void unless(bool good, const char* sentence) const {
    if (!good) throw InputError(name, 0, std::string(sentence) + again);
  }
  // A right checksum over wrong numbers is possible: every index is looked at before it is used.
  void unless(bool good) const { unless(good, "names things that are not in it"); }
};

// The children in a tree. One of two parents would be walked twice, and what is below it four times.
class Family {
 public:
  explicit Family(std::size_t all) : has_parent_(all) {}
  bool take(std::size_t child) {  // whether it is one of all, and had none yet
    if (child >= has_parent_.size()) return false;
    const bool fresh = !has_parent_[child];
    has_parent_[child] = true, count_ += fresh;
    return fresh;
  }
  bool complete() const { return has_parent_.empty() || count_ + 1 == has_parent_.size(); }

 private:
  std::vector<bool> has_parent_;
  std::size_t count_ = 0;
};

bool within(std::uint64_t first, std::uint64_t count, std::size_t size) { return first + count <= size; }

}  // namespace

struct Forest::Data {
  std::optional<MappedFile> file;
  std::vector<std::byte> memory;
  std::array<std::span<const std::byte>, part_count> parts;
  circuit::Circuit circuit;
  circuit::NodeNames nodes;
  Bounds soma_bounds;
  Mat3 soma_spread = Mat3::Zero();
  float mean_reach = 0.f;
  std::vector<Sphere> spheres;
  Groves groves;
  std::vector<Standing> standing;
  std::uint64_t segment_total = 0, bytes = 0;

  template <class T>
  std::span<const T> as(Part part) const {
    return {reinterpret_cast<const T*>(parts[part].data()), parts[part].size() / sizeof(T)};
  }
  std::size_t original_and_coarser() const {
    return as<reports::Place>(Part::places).size();
  }  // segments, straws aside

  // Each throws InputError when the file is not what it should be; in this order.
  void find_parts(std::span<const std::byte> bytes, const Refuse& refuse);
  void read_description(const Refuse& refuse);
  void read_attributes(const Refuse& refuse);
  void check_clusters(const Refuse& refuse) const;
  void check_neurons(const Refuse& refuse) const;
  void check_bricks(const Refuse& refuse) const;
  void take_instances(const Refuse& refuse);
  void number_nodes(const Refuse& refuse);
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
std::span<const Brick> Forest::bricks() const { return data_->as<Brick>(Part::bricks); }
std::span<const frame::Owner> Forest::owners() const { return data_->as<frame::Owner>(Part::owners); }
std::span<const Sphere> Forest::spheres() const { return data_->spheres; }
const Groves& Forest::groves() const { return data_->groves; }
std::span<const Standing> Forest::standing() const { return data_->standing; }
std::span<const std::uint32_t> Forest::types() const { return data_->as<std::uint32_t>(Part::types); }
std::span<const std::uint32_t> Forest::layers() const { return data_->as<std::uint32_t>(Part::layers); }
const circuit::Circuit& Forest::circuit() const { return data_->circuit; }
const circuit::NodeNames& Forest::nodes() const { return data_->nodes; }
const Bounds& Forest::soma_bounds() const { return data_->soma_bounds; }
const Mat3& Forest::soma_spread() const { return data_->soma_spread; }
float Forest::mean_reach() const { return data_->mean_reach; }
std::vector<circuit::Layer> Forest::layers_in_place() const {
  std::vector<circuit::Layer> layers = circuit().layers;
  if (circuit().up != circuit::Circuit().up) layers.clear();  // they are curved
  std::erase_if(layers, [](const circuit::Layer& l) { return !(l.bottom < l.top); });
  float low = INFINITY, high = -INFINITY;
  for (const auto& layer : layers) low = std::min(low, layer.bottom), high = std::max(high, layer.top);
  const float middle = soma_bounds().empty() ? low : soma_bounds().centre().y();
  if (!(low <= middle && middle <= high)) layers.clear();
  return layers;
}
std::uint64_t Forest::segment_total() const { return data_->segment_total; }
std::uint64_t Forest::bytes() const { return data_->bytes; }

Forest Forest::open(const std::filesystem::path& path) {
  if (std::error_code none; std::filesystem::is_directory(path, none))
    throw InputError(path.string(), 0,
                     "is a folder; name a forest file, which 'brainforest pack' makes of a circuit");
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
  const Refuse refuse{name};
  data->find_parts(bytes, refuse);
  data->read_description(refuse);
  data->read_attributes(refuse);
  data->check_clusters(refuse);
  data->check_neurons(refuse);
  data->check_bricks(refuse);
  data->take_instances(refuse);
  data->number_nodes(refuse);
  return Forest(std::move(data));
}

void Forest::Data::find_parts(std::span<const std::byte> whole, const Refuse& refuse) {
  Header header{};
  refuse.unless(!whole.empty(), "is empty; get the file again");
  refuse.unless(whole.size() >= sizeof header, "is too short to be a forest file");
  std::memcpy(&header, whole.data(), sizeof header);
  if (header.magic != magic)
    throw InputError(refuse.name, 0, "is not a forest file; make one with 'brainforest pack'");
  if (header.version != version)
    throw InputError(refuse.name, 0,
                     fmt::format("has version {} of the forest file and this program reads version {}{}",
                                 header.version, version, again));
  refuse.unless(header.parts == part_count, "is damaged: it has a wrong number of parts");
  if (header.file_size != whole.size())
    throw InputError(refuse.name, 0,
                     fmt::format("is cut short or has grown: {} bytes instead of {}{}", whole.size(),
                                 header.file_size, again));
  refuse.unless(hash64(std::as_bytes(std::span(header.table)), header.file_size) == header.table_hash,
                "has a damaged table of contents");
  // Up to where it has been looked at; gaps hold zeros, so that no byte goes unchecked.
  std::uint64_t end = sizeof header;
  for (std::uint32_t p = 0; p < part_count; ++p) {
    const Entry& e = header.table[p];
    refuse.unless(e.part == p && e.element_size == element_sizes[p] && e.offset % alignment == 0 &&
                      e.offset <= whole.size() && e.count <= (whole.size() - e.offset) / e.element_size,
                  "has a wrong table of contents");
    refuse.unless(e.offset >= end && e.offset - end < alignment &&
                      std::ranges::all_of(whole.subspan(end, e.offset - end),
                                          [](std::byte b) { return b == std::byte{0}; }),
                  "is damaged between its parts");
    end = e.offset + e.count * e.element_size;
    parts[p] = whole.subspan(e.offset, e.count * e.element_size);
    if (block_hash(parts[p]) != e.hash)
      throw InputError(refuse.name, 0,
                       fmt::format("is damaged: part {} does not match its checksum{}", p, again));
  }
  bytes = whole.size();
}

void Forest::Data::read_description(const Refuse& refuse) {
  const auto text = parts[Part::text];
  try {
    circuit = understand(parse_json<Json>({reinterpret_cast<const char*>(text.data()), text.size()},
                                          refuse.name, "pack the circuit again"),
                         nodes);
  } catch (const nlohmann::json::exception&) {
    refuse.unless(false, "has a damaged description");
  }
  try {
    circuit::Circuit alone = circuit;
    alone.instances.clear(), alone.in_elements.clear();
    circuit::check(alone);
  } catch (const Error& error) {
    refuse.unless(false, "has a damaged description");
  }
  const std::size_t instances = as<frame::Instance>(Part::instances).size();
  refuse.unless(as<Neuron>(Part::neurons).size() == circuit.morphologies.size() &&
                original_and_coarser() + as<frame::Owner>(Part::owners).size() ==
                    as<frame::Segment>(Part::segments).size() &&
                as<std::uint32_t>(Part::types).size() == instances &&
                as<std::uint32_t>(Part::layers).size() == instances);
}

void Forest::Data::read_attributes(const Refuse& refuse) {
  std::span<const std::byte> told = parts[Part::attributes];
  const std::size_t count = as<frame::Instance>(Part::instances).size();
  const auto take = [&](auto& to) {
    refuse.unless(count <= told.size() / sizeof to[0]);
    to.resize(count);
    if (count) std::memcpy(to.data(), told.data(), count * sizeof to[0]);
    told = told.subspan(count * sizeof to[0]);
  };
  for (auto& [name, of] : nodes.attributes) {
    if (of.words.empty()) {
      take(of.numbers);
      continue;
    }
    take(of.index);
    for (const std::uint32_t i : of.index)
      refuse.unless(i == circuit::Attribute::unknown || i < of.words.size());
  }
  refuse.unless(told.empty());
}

void Forest::Data::check_clusters(const Refuse& refuse) const {
  const auto clusters = as<Cluster>(Part::clusters);
  const std::size_t segments = original_and_coarser();
  parallel_for(clusters.size(), 1024, [&](std::size_t own) {
    const Cluster& c = clusters[own];
    refuse.unless(c.segment_count <= frame::cluster_size &&
                  within(c.first_segment, c.segment_count, segments) &&
                  within(c.leaf_first, c.leaf_count, segments));
    for (const auto child : c.children)  // children come later, so a walk ends
      refuse.unless(c.is_leaf() ? child == 0 : child > own && child < clusters.size());
    refuse.unless(std::isfinite(c.x + c.y + c.z + c.radius + c.error) && c.radius >= 0.f);
  });
}

void Forest::Data::check_neurons(const Refuse& refuse) const {
  const auto neurons = as<Neuron>(Part::neurons);
  const auto clusters = as<Cluster>(Part::clusters);
  const auto originals = as<std::uint32_t>(Part::section_of_segment);
  const auto sections = as<SectionFacts>(Part::sections);
  const auto places = as<reports::Place>(Part::places);
  parallel_for(neurons.size(), 16, [&](std::size_t number) {
    const Neuron& n = neurons[number];
    const Neuron before = number ? neurons[number - 1] : Neuron{};
    refuse.unless(n.first_cluster == before.first_cluster + before.cluster_count &&  // one after the other
                  n.first_original == before.first_original + before.original_count &&
                  n.first_section == before.first_section + before.section_count &&
                  within(n.first_cluster, n.cluster_count, clusters.size()) &&
                  within(n.first_segment, n.original_count, places.size()) &&
                  within(n.first_original, n.original_count, originals.size()) &&
                  within(n.first_section, n.section_count, sections.size()) && std::isfinite(n.soma_radius));
    const auto is_section = [&](std::uint32_t s) { return s == soma_section || s < n.section_count; };
    refuse.unless(std::ranges::all_of(originals.subspan(n.first_original, n.original_count), is_section));
    const std::size_t end = n.first_cluster + n.cluster_count;
    Family family(n.cluster_count);
    for (std::size_t at = n.first_cluster; at < end; ++at) {
      const Cluster& c = clusters[at];
      // The leaves are its last clusters, and the tree is its own.
      refuse.unless(c.is_leaf() == (at - n.first_cluster >= n.cluster_count / 2) &&
                    std::ranges::all_of(c.children, [&](std::uint32_t child) { return child < end; }));
      if (c.is_leaf())
        refuse.unless(c.first_segment >= n.first_segment &&
                      within(c.first_segment - n.first_segment, c.segment_count, n.original_count));
      else
        for (const std::uint32_t child : c.children)
          refuse.unless(child > at && family.take(child - n.first_cluster));
      bool good = true;  // of all, without a branch for each
      for (const reports::Place& p : places.subspan(c.first_segment, c.segment_count))
        good &= is_section(p.section) & (p.position >= 0.f) & (p.position <= 1.f);
      refuse.unless(good);
    }
    refuse.unless(family.complete());
    for (std::uint32_t i = 0; i < n.section_count; ++i) {
      const std::uint32_t parent = sections[n.first_section + i].parent;
      refuse.unless(parent == 0xffffffffu || parent < i);
    }
  });
}

void Forest::Data::check_bricks(const Refuse& refuse) const {
  const auto bricks = as<Brick>(Part::bricks);
  const auto owners = as<frame::Owner>(Part::owners);
  const std::size_t segments = original_and_coarser(), all = as<frame::Segment>(Part::segments).size(),
                    instances = as<frame::Instance>(Part::instances).size();
  parallel_for(bricks.size(), 1024, [&](std::size_t own) {
    const Brick& b = bricks[own];
    refuse.unless(b.segment_count <= Brick::straws && b.first_segment >= segments &&
                  within(b.first_segment, b.segment_count, all) &&
                  within(b.first_child, b.child_count, bricks.size()) &&
                  (b.child_count == 0 || b.first_child > own) && b.child_count <= 8 &&
                  std::isfinite(b.x + b.y + b.z + b.radius + b.width + b.length + b.neurons) &&
                  b.radius >= 0.f && b.width > 0.f && b.length > 0.f);
  });
  Family family(bricks.size());
  for (const Brick& b : bricks)
    for (std::uint32_t c = 0; c < b.child_count; ++c) refuse.unless(family.take(b.first_child + c));
  refuse.unless(family.complete());
  parallel_for(owners.size(), 4096, [&](std::size_t i) {
    refuse.unless(owners[i].instance < instances && owners[i].segment < segments);
  });
}

// Checks the neurons' places, and finds what follows from them.
void Forest::Data::take_instances(const Refuse& refuse) {
  const auto instances = as<frame::Instance>(Part::instances);
  const auto neurons = as<Neuron>(Part::neurons);
  const auto clusters = as<Cluster>(Part::clusters);
  const auto types = as<std::uint32_t>(Part::types), layers = as<std::uint32_t>(Part::layers);
  for (std::size_t i = 0; i < instances.size(); ++i) {
    const frame::Instance& instance = instances[i];
    refuse.unless(instance.morphology < neurons.size() && types[i] < circuit.types.size() &&
                  layers[i] < circuit.layers.size() && std::isfinite(instance.x + instance.y + instance.z) &&
                  std::isfinite(instance.qx + instance.qy + instance.qz + instance.qw));
    soma_bounds.add({instance.x, instance.y, instance.z});
    segment_total += neurons[instance.morphology].original_count;
  }
  if (!instances.empty()) {
    const Eigen::Vector3d centre = soma_bounds.centre().cast<double>();
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
    for (const frame::Instance& instance : instances) {
      const Eigen::Vector3d from = Vec3(instance.x, instance.y, instance.z).cast<double>() - centre;
      sum += from, squares += from * from.transpose();
    }
    const auto n = double(instances.size());
    soma_spread = ((squares - sum * sum.transpose() / n) / n).cast<float>();
  }
  spheres.resize(instances.size());
  parallel_for(instances.size(), 1024, [&](std::size_t i) {
    const Placed placed(instances[i]);
    const Neuron& n = neurons[instances[i].morphology];
    spheres[i] = n.cluster_count ? placed(clusters[n.first_cluster]) : placed(Sphere{});
  });
  double reaches = 0.;
  for (const Sphere& sphere : spheres) reaches += double(sphere.radius);
  mean_reach = float(reaches / double(std::max<std::size_t>(spheres.size(), 1)));
  groves = Groves(spheres);
  standing.resize(instances.size());
  parallel_for(standing.size(), 1024, [&](std::size_t m) {
    const std::uint32_t i = groves.members()[m];
    standing[m] = {spheres[i], instances[i], i};
  });
}

// Runs of nodes cover all neurons, one after the other; a file that names none is one population.
void Forest::Data::number_nodes(const Refuse& refuse) {
  const std::size_t instances = as<frame::Instance>(Part::instances).size();
  if (nodes.runs.empty()) {
    nodes.populations = {circuit.name};
    nodes.runs = {{0, 0, 0, std::uint32_t(instances)}};
  }
  std::uint64_t named = 0;
  for (circuit::NodeRun& run : nodes.runs) {
    refuse.unless(run.population < nodes.populations.size() && run.count <= instances - named);
    run.first_instance = std::uint32_t(named);
    named += run.count;
  }
  refuse.unless(named == instances);
}

std::uint32_t end_of(const Forest& forest, const Neuron& n) {
  std::uint32_t end = n.first_segment + n.original_count;
  for (const Cluster& c : forest.clusters().subspan(n.first_cluster, n.cluster_count))
    end = std::max(end, c.first_segment + c.segment_count);
  return end;
}

}  // namespace forest::scene
