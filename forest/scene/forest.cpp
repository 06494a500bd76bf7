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
#include "forest/core/parallel.h"
#include "forest/scene/forest_layout.h"
#include "forest/scene/placed.h"

namespace forest::scene {
namespace {

using namespace layout;
using Json = nlohmann::ordered_json;

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
      c.types.push_back({t.at("name"), t.at("population"), t.at("excitatory"), t.value("glia", false)});
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

struct Forest::Data {
  std::optional<MappedFile> file;
  std::vector<std::byte> memory;
  std::array<std::span<const std::byte>, part_count> parts;
  circuit::Circuit circuit;
  circuit::NodeNames nodes;
  Bounds soma_bounds;
  std::vector<Sphere> spheres;
  Groves groves;
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
std::span<const Brick> Forest::bricks() const { return data_->as<Brick>(Part::bricks); }
std::span<const frame::Owner> Forest::owners() const { return data_->as<frame::Owner>(Part::owners); }
std::span<const Sphere> Forest::spheres() const { return data_->spheres; }
const Groves& Forest::groves() const { return data_->groves; }
std::span<const std::uint32_t> Forest::types() const { return data_->as<std::uint32_t>(Part::types); }
std::span<const std::uint32_t> Forest::layers() const { return data_->as<std::uint32_t>(Part::layers); }
const circuit::Circuit& Forest::circuit() const { return data_->circuit; }
const circuit::NodeNames& Forest::nodes() const { return data_->nodes; }
const Bounds& Forest::soma_bounds() const { return data_->soma_bounds; }
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
  const auto require = [&](bool good, const std::string& sentence) {
    if (!good) throw InputError(name, 0, sentence);
  };
  const std::string again = "; pack the circuit again";
  Header header{};
  constexpr std::size_t shorter = sizeof header - sizeof(Entry);
  require(bytes.size() >= shorter, "is too short to be a forest file" + again);
  std::memcpy(&header, bytes.data(), std::min(sizeof header, bytes.size()));
  require(header.magic == magic, "is not a forest file; make one with 'brainforest pack'");
  const bool older = header.version == without_attributes && header.parts == part_count - 1;
  require(older || (header.version == version && header.parts == part_count),
          fmt::format("has version {} of the forest file and this program reads version {}", header.version,
                      version) +
              again);
  require(header.file_size == bytes.size(),
          fmt::format("is cut short or has grown: {} bytes instead of {}", bytes.size(), header.file_size) +
              again);
  const auto table = std::span(header.table).first(header.parts);
  require(bytes.size() >= (older ? shorter : sizeof header) &&
              hash64(std::as_bytes(table), header.file_size) == header.table_hash,
          "has a damaged table of contents" + again);
  std::uint64_t end =
      older ? shorter
            : sizeof header;  // of what has been looked at; gaps hold zeros, so that no byte goes unchecked
  for (std::uint32_t p = 0; p < header.parts; ++p) {
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
    require(block_hash(data->parts[p]) == e.hash,
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
              f.places().size() + f.owners().size() == f.segments().size() &&
              f.types().size() == f.instances().size() && f.layers().size() == f.instances().size(),
          wrong);
  std::span<const std::byte> told = data->parts[Part::attributes];
  const auto take = [&](void* to, std::size_t size) {
    require(size <= told.size(), wrong);
    if (size) std::memcpy(to, told.data(), size);
    told = told.subspan(size);
  };
  for (auto& [name_of, of] : data->nodes.attributes) {
    const std::size_t count = f.instances().size();
    require(count <= told.size() / 4, wrong);
    if (of.words.empty()) {
      of.numbers.resize(count);
      take(of.numbers.data(), count * sizeof of.numbers[0]);
    } else {
      of.index.resize(count);
      take(of.index.data(), count * sizeof of.index[0]);
      for (const std::uint32_t i : of.index)
        require(i == circuit::Attribute::unknown || i < of.words.size(), wrong);
    }
  }
  require(told.empty(), wrong);
  const auto clusters = f.clusters();
  parallel_for(clusters.size(), 1024, [&](std::size_t own) {
    const Cluster& c = clusters[own];
    require(c.segment_count <= frame::cluster_size &&
                within(c.first_segment, c.segment_count, f.places().size()) &&
                within(c.leaf_first, c.leaf_count, f.places().size()),
            wrong);
    for (const auto child : c.children)  // children come later, so a walk ends
      require(c.is_leaf() ? child == 0 : child > own && child < clusters.size(), wrong);
    require(std::isfinite(c.x + c.y + c.z + c.radius + c.error) && c.radius >= 0.f, wrong);
  });
  parallel_for(f.neurons().size(), 16, [&](std::size_t number) {
    const Neuron& n = f.neurons()[number];
    const Neuron before = number ? f.neurons()[number - 1] : Neuron{};
    require(n.first_cluster == before.first_cluster + before.cluster_count &&  // one after the other
                n.first_original == before.first_original + before.original_count &&
                n.first_section == before.first_section + before.section_count &&
                within(n.first_cluster, n.cluster_count, clusters.size()) &&
                within(n.first_segment, n.original_count, f.places().size()) &&
                within(n.first_original, n.original_count, f.section_of_segment().size()) &&
                within(n.first_section, n.section_count, f.sections().size()) && std::isfinite(n.soma_radius),
            wrong);
    const auto is_section = [&](std::uint32_t s) { return s == soma_section || s < n.section_count; };
    require(
        std::ranges::all_of(f.section_of_segment().subspan(n.first_original, n.original_count), is_section),
        wrong);
    for (const Cluster& c : clusters.subspan(n.first_cluster, n.cluster_count)) {
      bool good = true;  // of all, without a branch for each
      for (const reports::Place& p : f.places().subspan(c.first_segment, c.segment_count))
        good &= is_section(p.section) & (p.position >= 0.f) & (p.position <= 1.f);
      require(good, wrong);
    }
    for (std::uint32_t i = 0; i < n.section_count; ++i) {
      const std::uint32_t parent = f.sections()[n.first_section + i].parent;
      require(parent == 0xffffffffu || parent < i, wrong);
    }
  });
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
  const auto bricks = f.bricks();
  parallel_for(bricks.size(), 1024, [&](std::size_t own) {
    const Brick& b = bricks[own];
    require(b.segment_count <= Brick::straws && b.first_segment >= f.places().size() &&
                within(b.first_segment, b.segment_count, f.segments().size()) &&
                within(b.first_child, b.child_count, bricks.size()) &&
                (b.child_count == 0 || b.first_child > own) && b.child_count <= 8 &&
                std::isfinite(b.x + b.y + b.z + b.radius + b.width + b.length + b.neurons) &&
                b.radius >= 0.f && b.width > 0.f && b.length > 0.f,
            wrong);
  });
  parallel_for(f.owners().size(), 4096, [&](std::size_t i) {
    require(f.owners()[i].instance < f.instances().size() && f.owners()[i].segment < f.places().size(),
            wrong);
  });
  data->spheres.resize(f.instances().size());
  parallel_for(f.instances().size(), 1024, [&](std::size_t i) {
    const Placed placed(f.instances()[i]);
    const Neuron& n = f.neurons()[f.instances()[i].morphology];
    data->spheres[i] = n.cluster_count ? placed(clusters[n.first_cluster]) : placed(Sphere{});
  });
  data->groves = Groves(data->spheres);
  circuit::NodeNames& nodes = data->nodes;
  if (nodes.runs.empty()) {
    nodes.populations = {data->circuit.name};
    nodes.runs = {{0, 0, 0, std::uint32_t(f.instances().size())}};
  }
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
