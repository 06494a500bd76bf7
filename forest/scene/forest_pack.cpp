// SPDX-License-Identifier: Apache-2.0
// Packing. Neurons are clustered on all cores and written in their order; segments, two thirds of the file, go to where
// they stay, the other parts into scratch files that are joined at the end.
#include <algorithm>
#include <array>
#include <cstring>
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/hash.h"
#include "forest/core/parallel.h"
#include "forest/morphology/measure.h"
#include "forest/scene/forest_layout.h"

namespace forest::scene {
namespace {

using namespace layout;
using Json = nlohmann::ordered_json;
using Bytes = std::span<const std::byte>;

// What a part may hold too many of, and what to do then.
constexpr std::array<const char*, part_count> too_many{
    "distinct segments; plant fewer distinct neurons",
    "neurons; plant fewer",
    "clusters of segments; plant fewer distinct neurons",
    "distinct neurons; plant fewer",
    "distinct segments; plant fewer distinct neurons",
    "distinct sections; plant fewer distinct neurons",
    "neurons; plant fewer",
    "neurons; plant fewer",
    "bytes of names and node sets; leave some out",
    "distinct segments; plant fewer distinct neurons",
    "bricks of straws; plant fewer neurons",
    "straws; plant fewer neurons",
    "numbers in the attributes of its nodes; leave some attributes out"};

Json list_of(const Vec3& p) { return Json{p.x(), p.y(), p.z()}; }

std::string describe(const circuit::Circuit& c, const circuit::NodeNames& nodes) {
  Json json{{"name", c.name}, {"radius", c.radius}, {"morphologies", c.morphologies}};
  for (const auto& layer : c.layers)
    json["layers"].push_back({{"name", layer.name}, {"bottom", layer.bottom}, {"top", layer.top}});
  if (c.up != circuit::Circuit().up) json["up"] = list_of(c.up);
  for (const auto& line : c.outline) {
    Json& points = json["outline"].emplace_back(Json::array());
    for (const Vec3& p : line) points.push_back(list_of(p));
  }
  for (const auto& type : c.types) {
    Json& row = json["types"].emplace_back(
        Json{{"name", type.name}, {"population", type.population}, {"excitatory", type.excitatory}});
    if (type.glia) row["glia"] = true;
  }
  if (!nodes.runs.empty()) json["populations"] = nodes.populations;
  for (const circuit::NodeRun& run : nodes.runs)
    json["nodes"].push_back({run.population, run.first_node, run.count});
  if (!nodes.sets.empty()) json["node_sets"] = nodes.sets;
  for (const circuit::NodeAttribute& attribute : nodes.attributes) {
    Json& row = json["attributes"].emplace_back(Json{{"name", attribute.name}});
    if (!attribute.of.words.empty()) row["words"] = attribute.of.words;
  }
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::vector<SectionFacts> facts_of(const Morphology& m) {
  std::vector<SectionFacts> facts;
  std::vector<double> distances;  // from the soma to the ends, as path_distances has them
  distances.reserve(m.sections().size());
  facts.reserve(m.sections().size());
  for (std::size_t i = 0; i < m.sections().size(); ++i) {
    const SectionId id(i);
    const auto points = m.points(id);
    const Section& s = m.section(id);
    const double length = section_length(m, id);
    const double before = s.parent.valid() ? distances[s.parent.value()] : 0.;
    distances.push_back(before + length);
    facts.push_back({s.parent.valid() ? s.parent.value() : 0xffffffffu, std::uint32_t(s.kind),
                     std::uint32_t(m.order(id)), std::uint32_t(m.children(id).size()), float(length),
                     2.f * points.front().radius, 2.f * points.back().radius, float(distances.back())});
  }
  return facts;
}

constexpr std::size_t pieces_in_all = 1 << 20;  // 40 MB stay in memory until all neurons are known

/// One neuron on its way: all that is said of it, numbers counted from its own beginning.
struct Made {
  ClusterTree tree;
  std::vector<SectionFacts> facts;
  Pieces pieces;
};

/// Where the file goes: into memory or on a disk.
class Output {
 public:
  explicit Output(NewFile* file) : file_(file) {}

  NewFile* file() const { return file_; }  // null: into memory
  std::uint64_t size() const { return size_; }
  void write(Bytes bytes) {
    size_ += bytes.size();
    if (file_) return file_->write(bytes);
    memory_.insert(memory_.end(), bytes.begin(), bytes.end());
  }
  /// Makes room for what put() brings; zeros where it brings nothing.
  void extend(std::uint64_t size) {
    if (!file_)
      memory_.resize(std::size_t(size));
    else if (size > size_)
      file_->overwrite(size - 1, std::array<std::byte, 1>{});
    size_ = size;
  }
  void put(std::uint64_t at, Bytes bytes) {  // by any thread, into what is there
    if (file_) return file_->overwrite(at, bytes);
    std::ranges::copy(bytes, memory_.begin() + std::ptrdiff_t(at));
  }
  std::vector<std::byte> memory() { return std::move(memory_); }

 private:
  NewFile* file_;
  std::vector<std::byte> memory_;
  std::uint64_t size_ = 0;
};

/// A part that waits for its place while it grows: on the disk but for its last megabyte, when the file goes there too.
class Waiting {
 public:
  void add(Bytes bytes, NewFile* file) {
    size_ += bytes.size();
    memory_.insert(memory_.end(), bytes.begin(), bytes.end());
    if (!file || memory_.size() < piece) return;
    if (!scratch_) scratch_.emplace(*file);
    scratch_->write(memory_);
    memory_.clear();
  }
  std::uint64_t size() const { return size_; }
  /// Calls body(at, bytes) for all of it, piece by piece, and forgets it.
  template <class Body>
  void pour(Body&& body) {
    constexpr std::uint64_t window = 4 * piece;
    const std::uint64_t on_disk = size_ - memory_.size();
    for (std::uint64_t begin = 0; begin < on_disk; begin += window) {
      const Bytes here = scratch_->take(begin, std::size_t(std::min(window, on_disk - begin)));
      for (std::size_t at = 0; at < here.size(); at += piece)
        body(begin + at, here.subspan(at, std::min(piece, here.size() - at)));
    }
    body(on_disk, Bytes(memory_));
    scratch_.reset();
    memory_ = {};
  }

 private:
  static constexpr std::size_t piece = 1 << 20;
  std::vector<std::byte> memory_;
  std::optional<ScratchFile> scratch_;
  std::uint64_t size_ = 0;
};

constexpr std::uint64_t aligned(std::uint64_t size) { return (size + alignment - 1) / alignment * alignment; }

class Packer {
 public:
  explicit Packer(Output& out) : out_(out) {
    const std::array<std::byte, aligned(sizeof(Header))> later{};
    out_.write(later);
    offsets_[Part::segments] = out_.size();
  }

  void add(Made made) {
    ClusterTree& tree = made.tree;
    const Neuron n{.first_cluster = next(Part::clusters),
                   .cluster_count = std::uint32_t(tree.clusters.size()),
                   .first_segment = next(Part::segments),
                   .original_count = tree.original_count,
                   .first_original = next(Part::section_of_segment),
                   .first_section = next(Part::sections),
                   .section_count = std::uint32_t(made.facts.size()),
                   .soma_radius = tree.soma_radius};
    for (Cluster& cluster : tree.clusters) {
      cluster.first_segment += n.first_segment;
      cluster.leaf_first += n.first_segment;
      if (!cluster.is_leaf())
        for (auto& child : cluster.children) child += n.first_cluster;
    }
    add(Part::segments, tree.segments);
    add(Part::clusters, tree.clusters);
    add(Part::neurons, n);
    add(Part::section_of_segment, tree.section);
    add(Part::sections, made.facts);
    add(Part::places, tree.places);
    originals_.push_back(n.original_count);
    first_segments_.push_back(n.first_segment);
    pieces_.push_back(std::move(made.pieces));
  }

  PackFigures finish(const circuit::Circuit& c, const circuit::NodeNames& nodes) {
    PackFigures figures;
    for (const std::uint32_t count : originals_) figures.segments += count;
    std::vector<frame::Instance> instances;
    instances.reserve(c.instances.size());
    for (const circuit::Instance& i : c.instances) {
      const Quat q = i.orientation;
      instances.push_back(
          {i.position.x(), i.position.y(), i.position.z(), i.morphology, q.x(), q.y(), q.z(), q.w()});
      add(Part::types, i.type);
      add(Part::layers, i.layer);
      figures.segment_total += originals_[i.morphology];
    }
    const Bricks bricks = build_bricks(instances, pieces_, first_segments_, next(Part::segments));
    add(Part::instances, instances);
    add(Part::segments, bricks.straws);
    add(Part::bricks, bricks.bricks);
    add(Part::owners, bricks.owners);
    for (const auto& [name, of] : nodes.attributes) {
      if ((of.words.empty() ? of.numbers.size() : of.index.size()) != c.instances.size())
        throw Error(fmt::format("the attribute {} is not of all {} neurons", name, c.instances.size()));
      if (of.words.empty())
        add(Part::attributes, of.numbers);
      else
        add(Part::attributes, of.index);
    }
    const std::string description = describe(c, nodes);
    add(Part::text, description);
    for (std::uint32_t p = 0; p < part_count; ++p) {
      if (p != Part::segments) {
        const std::uint64_t offset = offsets_[p] = aligned(out_.size());
        out_.extend(offset + waiting_[p].size());
        waiting_[p].pour([&](std::uint64_t at, Bytes bytes) { out_.put(offset + at, bytes); });
      }
      header_.table[p] = {p, element_sizes[p], offsets_[p], counts_[p], hashes_[p].value()};
    }
    header_.file_size = figures.bytes = out_.size();
    header_.table_hash = hash64(std::as_bytes(std::span(header_.table)), header_.file_size);
    out_.put(0, std::as_bytes(std::span(&header_, 1)));
    return figures;
  }

 private:
  std::uint32_t next(Part part) const { return std::uint32_t(counts_[part]); }
  template <class T>
  void add(Part part, const T& one) {
    add(part, std::span(&one, 1));
  }
  template <std::ranges::contiguous_range Range>
  void add(Part part, const Range& elements) {
    const Bytes bytes = std::as_bytes(std::span(elements));
    if ((counts_[part] += bytes.size() / element_sizes[part]) > 0xffffffffull)
      throw LimitError(fmt::format("a forest file holds at most 4,294,967,295 {}", too_many[part]));
    hashes_[part].add(bytes);
    if (part == Part::segments)
      out_.write(bytes);
    else
      waiting_[part].add(bytes, out_.file());
  }
  Output& out_;
  Header header_{
      .magic = magic, .version = version, .parts = part_count, .file_size = 0, .table_hash = 0, .table = {}};
  std::array<std::uint64_t, part_count> offsets_{}, counts_{};
  std::array<BlockHash, part_count> hashes_;
  std::array<Waiting, part_count> waiting_;
  std::vector<std::uint32_t> originals_,
      first_segments_;  // how many original segments each neuron has, and which
  std::vector<Pieces> pieces_;
};

constexpr float farthest = 1e7f;  // µm from the middle of a neuron: a whale's spinal cord

PackFigures pack_into(Output& out, const circuit::Circuit& c, const NeuronSource& source, Progress& progress,
                      const circuit::NodeNames& nodes) {
  circuit::check(c);
  progress.begin("packing", c.morphologies.size());
  Packer packer(out);
  const std::size_t pieces =
      std::clamp<std::size_t>(pieces_in_all / std::max<std::size_t>(c.morphologies.size(), 1), 16, 256);
  parallel_in_order(
      c.morphologies.size(),
      [&](std::size_t i) {
        const Morphology m = source(i);
        Made made{build_clusters(m), facts_of(m), {}};
        if (!made.tree.clusters.empty() && !(made.tree.clusters.front().radius < farthest))
          throw Error(
              fmt::format("the neuron {} reaches {:.3g} µm, farther than any does; mend its points, which "
                          "'brainforest check' looks at",
                          c.morphologies[i], made.tree.clusters.front().radius));
        made.pieces = pieces_of(std::span(made.tree.segments).first(made.tree.original_count), pieces);
        if (!made.tree.clusters.empty()) {
          const Cluster& root = made.tree.clusters.front();
          made.pieces.sphere = {{root.x, root.y, root.z}, root.radius};
        }
        return made;
      },
      [&](std::size_t, Made made) {
        packer.add(std::move(made));
        progress.advance();
      });
  const PackFigures figures = packer.finish(c, nodes);
  progress.end();
  return figures;
}

}  // namespace

std::vector<std::byte> pack(const circuit::Circuit& c, std::span<const Morphology> morphologies,
                            Progress& progress, const circuit::NodeNames& nodes) {
  if (morphologies.size() != c.morphologies.size())
    throw Error(fmt::format("the circuit names {} morphologies and {} came with it", c.morphologies.size(),
                            morphologies.size()));
  Output out(nullptr);
  pack_into(
      out, c, [&](std::size_t i) { return morphologies[i]; }, progress, nodes);
  return out.memory();
}

PackFigures pack(const circuit::Circuit& c, const NeuronSource& source, const std::filesystem::path& path,
                 Progress& progress, const circuit::NodeNames& nodes) {
  NewFile file(path);
  Output out(&file);
  const PackFigures figures = pack_into(out, c, source, progress, nodes);
  file.commit();
  return figures;
}

}  // namespace forest::scene
