// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/synapses.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <functional>
#include <numbers>
#include <numeric>
#include <optional>
#include <unordered_map>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/half.h"
#include "forest/core/hash.h"
#include "forest/core/json.h"
#include "forest/core/parallel.h"
#include "forest/core/random.h"
#include "forest/scene/closeness.h"
#include "forest/scene/grove.h"
#include "forest/scene/pick.h"
#include "forest/scene/placed.h"
#include "forest/scene/synapses_layout.h"

namespace forest::scene {
namespace {

using Json = nlohmann::ordered_json;

using namespace synapses_layout;

constexpr std::uint32_t bundle_size = 64, fan = 8;
constexpr float usual_radius = .4f;   // µm: bouton and head of the spine together
constexpr float whole_pixels = .75f;  // radius from which on every synapse is drawn as it is
constexpr std::size_t at_once = 16;   // bundles; fixed, so that the result does not depend on threads

std::uint64_t mark_of(const Forest& forest) {
  return block_hash(std::as_bytes(forest.instances())) ^ (forest.section_of_segment().size() << 20) ^
         forest.sections().size();
}

// The segments of every section of a neuron, and which section SONATA means by an element.
class Sections {
 public:
  Sections(const Forest& forest, const Neuron& neuron)
      : segments_(forest.segments().subspan(neuron.first_segment, neuron.original_count)),
        of_(forest.section_of_segment().subspan(neuron.first_original, neuron.original_count)),
        elements_(neuron.section_count),
        runs_(neuron.section_count) {
    const auto facts = forest.sections().subspan(neuron.first_section, neuron.section_count);
    std::iota(elements_.begin(), elements_.end(), 0u);
    std::ranges::stable_sort(
        elements_, {}, [&](std::uint32_t s) { return circuit::element_rank(SectionKind(facts[s].kind)); });
    for (std::uint32_t k = 0; k < of_.size(); ++k) {
      if (of_[k] == soma_section) continue;
      Run& run = runs_[of_[k]];
      if (run.count == 0) run.first = k;
      run.count = k + 1 - run.first;
      run.length += length(k);
    }
  }

  struct Place {
    std::uint32_t segment = 0;
    float along = 0.f;     // the segment, 0 to 1
    float position = .5f;  // along its section
  };
  std::size_t size() const { return elements_.size(); }
  bool has_soma() const { return !of_.empty() && of_[0] == soma_section; }
  // None where the section has no segment.
  std::optional<Place> at(std::int32_t element, float position) const {
    if (element == 0) return has_soma() ? std::optional(Place{}) : std::nullopt;
    const Run& run = runs_[elements_[std::size_t(element) - 1]];
    if (run.count == 0) return std::nullopt;
    double way = double(position) * run.length;
    std::uint32_t k = run.first;
    for (; k + 1 < run.first + run.count && way > length(k); ++k) way -= length(k);
    return Place{k, float(std::clamp(way / std::max(length(k), 1e-9), 0., 1.)), position};
  }
  // The segment nearest to a point of the neuron's own coordinates.
  std::optional<Place> nearest(const Vec3& p) const {
    std::optional<Place> best;
    float least = INFINITY;
    for (std::uint32_t k = 0; k < segments_.size(); ++k) {
      const Vec3 a = from(k), b = to(k), way = b - a;
      const float square = way.squaredNorm(),
                  t = square > 0.f ? std::clamp((p - a).dot(way) / square, 0.f, 1.f) : 0.f;
      const float away = (p - a - t * way).norm() - radius(k, t);
      if (away < least) least = away, best = Place{k, t, .5f};
    }
    if (!best || of_[best->segment] == soma_section) return best;
    const Run& run = runs_[of_[best->segment]];
    double before = double(best->along) * length(best->segment);
    for (std::uint32_t k = run.first; k < best->segment; ++k) before += length(k);
    best->position = float(std::clamp(before / std::max(run.length, 1e-9), 0., 1.));
    return best;
  }
  Vec3 axis(const Place& p) const { return from(p.segment) + p.along * (to(p.segment) - from(p.segment)); }
  // On the surface, on a side that two numbers in [0, 1) say.
  Vec3 surface(const Place& p, double turn, double height) const {
    const Vec3 way = to(p.segment) - from(p.segment);
    const float angle = float(2. * std::numbers::pi * turn), r = radius(p.segment, p.along);
    if (!(way.norm() > 0.f)) {  // a soma: all sides are alike
      const float y = float(2. * height - 1.), across = std::sqrt(std::max(0.f, 1.f - y * y));
      return axis(p) + r * Vec3(across * std::cos(angle), y, across * std::sin(angle));
    }
    const Vec3 side = way.unitOrthogonal();
    return axis(p) + r * (std::cos(angle) * side + std::sin(angle) * way.normalized().cross(side));
  }

 private:
  struct Run {
    std::uint32_t first = 0, count = 0;
    double length = 0.;
  };
  Vec3 from(std::uint32_t k) const { return {segments_[k].ax, segments_[k].ay, segments_[k].az}; }
  Vec3 to(std::uint32_t k) const { return {segments_[k].bx, segments_[k].by, segments_[k].bz}; }
  double length(std::uint32_t k) const { return double((to(k) - from(k)).norm()); }
  float radius(std::uint32_t k, float t) const {
    const float a = from_half(segments_[k].radii & 0xffff), b = from_half(segments_[k].radii >> 16);
    return a + t * (b - a);
  }

  std::span<const frame::Segment> segments_;
  std::span<const std::uint32_t> of_;
  std::vector<std::uint32_t> elements_;
  std::vector<Run> runs_;
};

bool before(const Synapse& a, const Synapse& b) {
  return std::pair(a.rank(), a.id) < std::pair(b.rank(), b.id);
}

struct Tree {
  std::vector<Bundle> bundles;
  std::vector<std::uint32_t> samples;
};

// Puts the synapses in the order of the file.
Tree grow(std::vector<Synapse>& list, const Bounds& bounds) {
  std::vector<Keyed> order(list.size());
  parallel_for(list.size(), 4096, [&](std::size_t i) {
    order[i] = {morton_code(list[i].centre(), bounds), i};
  });
  parallel_sort(order);
  std::vector<Synapse> sorted(list.size());
  parallel_for(list.size(), 4096, [&](std::size_t i) { sorted[i] = list[order[i].second]; });
  list = std::move(sorted);

  Tree tree;
  const std::size_t leaves = (list.size() + bundle_size - 1) / bundle_size;
  tree.bundles.resize(leaves);
  std::vector<Bounds> boxes(leaves);
  parallel_for(leaves, 64, [&](std::size_t n) {
    Bundle& b = tree.bundles[n];
    b.first = std::uint32_t(n) * bundle_size;
    b.count = std::min(bundle_size, std::uint32_t(list.size()) - b.first);
    const auto own = std::span(list).subspan(b.first, b.count);
    std::ranges::sort(own, before);
    for (const Synapse& s : own)
      boxes[n].add(s.centre(), s.radius_um()), b.largest = std::max(b.largest, s.radius_um());
  });
  // Inner ones, level by level: each takes the lowest ranks of its children.
  for (std::size_t from = 0, until = leaves; until - from > 1;) {
    for (std::size_t first = from; first < until; first += fan) {
      Bundle b{.first = std::uint32_t(tree.samples.size()),
               .first_child = std::uint32_t(first),
               .children = std::uint32_t(std::min<std::size_t>(fan, until - first))};
      Bounds box;
      std::vector<std::uint32_t> lowest;
      for (std::size_t c = first; c < first + b.children; ++c) {
        const Bundle& child = tree.bundles[c];
        for (std::uint32_t k = 0; k < child.count; ++k)
          lowest.push_back(child.children ? tree.samples[child.first + k] : child.first + k);
        box.add(boxes[c]);
        b.largest = std::max(b.largest, child.largest);
      }
      std::ranges::sort(lowest, [&](std::uint32_t a, std::uint32_t c) { return before(list[a], list[c]); });
      lowest.resize(std::min<std::size_t>(lowest.size(), bundle_size));
      b.count = std::uint32_t(lowest.size());
      tree.samples.insert(tree.samples.end(), lowest.begin(), lowest.end());
      tree.bundles.push_back(b);
      boxes.push_back(box);
    }
    from = until, until = tree.bundles.size();
  }
  for (std::size_t n = 0; n < tree.bundles.size(); ++n) {
    const Sphere s = around(boxes[n]);
    Bundle& b = tree.bundles[n];
    b.x = s.centre.x(), b.y = s.centre.y(), b.z = s.centre.z(), b.radius = s.radius;
  }
  return tree;
}

}  // namespace

struct Synapses::Data {
  std::optional<MappedFile> file;
  std::vector<std::byte> memory;
  std::array<std::span<const std::byte>, part_count> parts;
  std::vector<ProjectionFacts> projections;
  Forest forest;
  std::vector<std::uint32_t> standing;  // of every instance: its number in Forest::standing()

  template <class T>
  std::span<const T> as(FilePart part) const {
    return {reinterpret_cast<const T*>(parts[part].data()), parts[part].size() / sizeof(T)};
  }
};

std::span<const Synapse> Synapses::all() const { return data_->as<Synapse>(FilePart::synapses); }
std::span<const Bundle> Synapses::bundles() const { return data_->as<Bundle>(FilePart::bundles); }
const std::vector<ProjectionFacts>& Synapses::projections() const { return data_->projections; }
const Forest& Synapses::forest() const { return data_->forest; }

const ProjectionFacts& Synapses::projection(const Synapse& s) const {
  const auto after = std::ranges::upper_bound(data_->projections, s.id, {}, &ProjectionFacts::first);
  return *(after - 1);
}

std::uint32_t Synapses::section(const Synapse& s) const {
  const Neuron& neuron = data_->forest.neurons()[data_->forest.instances()[s.target].morphology];
  return data_->forest.section_of_segment()[neuron.first_original + s.segment];
}

std::filesystem::path Synapses::beside(const std::filesystem::path& forest_file) {
  return std::filesystem::path(forest_file).replace_extension(".synapses");
}

std::vector<std::byte> Synapses::make(const Forest& forest, std::span<const circuit::Projection> projections,
                                      Progress& progress) {
  Json facts = Json::array();
  std::size_t count = 0;
  for (const circuit::Projection& p : projections) {
    if (p.synapses.empty()) continue;
    facts.push_back({{"name", p.name},
                     {"source", p.source},
                     {"target", p.target},
                     {"first", count},
                     {"count", p.synapses.size()}});
    count += p.synapses.size();
  }
  if (count > 0x7fffffff)
    throw LimitError(fmt::format("{} synapses are more than the 2,147,483,647 that a file holds", count));
  std::vector<Sections> sections;
  sections.reserve(forest.neurons().size());
  for (const Neuron& neuron : forest.neurons()) sections.emplace_back(forest, neuron);

  std::vector<Synapse> list(count);
  progress.begin("attaching synapses", count);
  std::size_t first = 0;
  for (const circuit::Projection& p : projections) {
    parallel_for(p.synapses.size(), 512, [&](std::size_t i) {
      const circuit::Synapse& s = p.synapses[i];
      const auto refuse = [&](const std::string& sentence) {
        throw InputError(p.name, 0, fmt::format("synapse {} {}", i, sentence));
      };
      if (s.target >= forest.instances().size() ||
          (s.neuron != circuit::Synapse::not_planted && s.neuron >= forest.instances().size()))
        refuse("names a neuron that is not in the forest; pack the circuit again");
      const frame::Instance& instance = forest.instances()[s.target];
      const Sections& of = sections[instance.morphology];
      const Vec3 at(instance.x, instance.y, instance.z);
      const Quat turn(instance.qw, instance.qx, instance.qy, instance.qz);
      std::optional<Sections::Place> place;
      const bool said = s.element != circuit::Synapse::no_section;
      if (said) {
        if (s.element < 0 || std::size_t(s.element) > of.size())
          refuse(
              fmt::format("is on section {} of its target, which has 0 (the soma) to {}; name the circuit "
                          "that the edges belong to",
                          s.element, of.size()));
        if (!(s.position >= 0.f && s.position <= 1.f))
          refuse(fmt::format("is at {} of its section; positions are from 0 to 1", s.position));
        place = of.at(s.element, s.position);
      } else if (!s.centre.allFinite()) {
        refuse("says neither section nor place; one of them is needed");
      }
      const auto own = std::uint32_t(first + i);
      if (!place)
        place =
            of.nearest(s.centre.allFinite() ? Vec3(turn.conjugate() * (s.centre - at)) : Vec3(Vec3::Zero()));
      if (!place) refuse("is on a neuron without any branch or soma");
      Random random(0x5e1ec7ed, own);
      const double around = random.uniform(), height = random.uniform();
      Vec3 centre = at + turn * of.surface(*place, around, height);
      if (!said) {
        centre = s.surface.allFinite() ? s.surface : s.centre;
      } else if (s.surface.allFinite()) {
        // Programs differ in what they take for the middle of a soma, so that both places may be off by as much.
        const Vec3 out = s.surface - s.centre;
        centre = s.centre.allFinite() ? Vec3(at + turn * of.axis(*place) + out) : s.surface;
      }
      const bool outside = s.neuron == circuit::Synapse::not_planted;
      list[own] = {
          .x = centre.x(),
          .y = centre.y(),
          .z = centre.z(),
          .target = s.target,
          .segment = place->segment,
          .source = outside ? std::uint32_t(std::min<std::uint64_t>(s.source, 0xffffffffu)) : s.neuron,
          .id = own,
          .position = std::uint16_t(std::lround(place->position * 65535.f)),
          .radius = std::uint8_t(std::lround(usual_radius * 64.f)),
          .flags = std::uint8_t(std::uint8_t(s.sign) | (outside ? Synapse::outside : 0))};
      progress.advance();
    });
    first += p.synapses.size();
  }
  progress.end();
  Bounds bounds;
  for (const Synapse& s : list) bounds.add(s.centre());
  const Tree tree = grow(list, bounds);

  const std::string description =
      Json{{"projections", facts}}.dump(-1, ' ', false, Json::error_handler_t::replace);
  Header header{.magic = magic,
                .version = version,
                .zero = 0,
                .file_size = 0,
                .forest = mark_of(forest),
                .table = {},
                .hash = 0};
  const std::array<std::span<const std::byte>, part_count> parts{
      std::as_bytes(std::span(std::as_const(list))), std::as_bytes(std::span(tree.bundles)),
      std::as_bytes(std::span(tree.samples)), std::as_bytes(std::span(description))};
  std::vector<std::byte> bytes(sizeof header);
  for (std::size_t p = 0; p < part_count; ++p) {
    bytes.resize((bytes.size() + alignment - 1) / alignment * alignment);
    header.table[p] = {bytes.size(), parts[p].size() / element_sizes[p], block_hash(parts[p])};
    bytes.insert(bytes.end(), parts[p].begin(), parts[p].end());
  }
  header.file_size = bytes.size();
  header.hash = hash64(std::as_bytes(std::span(&header, 1)).first(offsetof(Header, hash)));
  std::memcpy(bytes.data(), &header, sizeof header);
  return bytes;
}

Synapses Synapses::open(const std::filesystem::path& path, const Forest& forest) {
  auto data = std::make_shared<Data>(
      Data{.file = {}, .memory = {}, .parts = {}, .projections = {}, .forest = forest, .standing = {}});
  data->file.emplace(path);
  const auto bytes = data->file->bytes();
  return check(std::move(data), bytes, path.string());
}

Synapses Synapses::from_bytes(std::vector<std::byte> memory, const Forest& forest, const std::string& name) {
  auto data = std::make_shared<Data>(Data{.file = {},
                                          .memory = std::move(memory),
                                          .parts = {},
                                          .projections = {},
                                          .forest = forest,
                                          .standing = {}});
  const std::span<const std::byte> bytes = data->memory;
  return check(std::move(data), bytes, name);
}

Synapses Synapses::check(std::shared_ptr<Data> data, std::span<const std::byte> bytes,
                         const std::string& name) {
  const std::string again = "; pack the circuit again";
  const auto require = [&](bool good, const std::string& sentence) {
    if (!good) throw InputError(name, 0, sentence + again);
  };
  Header header;
  require(bytes.size() >= sizeof header, "is too short to be a file of synapses");
  std::memcpy(&header, bytes.data(), sizeof header);
  require(header.magic == magic, "is no file of synapses");
  require(header.version == version,
          fmt::format("has version {} of the file of synapses and this program reads version {}",
                      header.version, version));
  require(header.file_size == bytes.size(),
          fmt::format("is cut short or has grown: {} bytes instead of {}", bytes.size(), header.file_size));
  require(hash64(std::as_bytes(std::span(&header, 1)).first(offsetof(Header, hash))) == header.hash,
          "has a damaged table of contents");
  for (std::uint32_t p = 0; p < part_count; ++p) {
    const auto& e = header.table[p];
    require(e.offset % alignment == 0 && e.offset <= bytes.size() &&
                e.count <= (bytes.size() - e.offset) / element_sizes[p],
            "has a wrong table of contents");
    data->parts[p] = bytes.subspan(e.offset, e.count * element_sizes[p]);
    require(block_hash(data->parts[p]) == e.hash,
            fmt::format("is damaged: part {} does not match its checksum", p));
  }
  const Forest& forest = data->forest;
  require(header.forest == mark_of(forest), "was made for another forest");
  const std::string wrong = "names things that are not there";
  const auto all = data->as<Synapse>(FilePart::synapses);
  try {
    const auto text = data->as<char>(FilePart::text);
    const auto description = parse_json<Json>({text.data(), text.size()}, name, "pack the circuit again");
    for (const Json& p : description.at("projections")) {
      ProjectionFacts facts{p.at("name"), p.at("source"), p.at("target"), p.at("first"), p.at("count")};
      const std::uint64_t next =
          data->projections.empty()
              ? 0
              : data->projections.back().first + std::uint64_t(data->projections.back().count);
      require(facts.first == next && facts.count > 0, wrong);
      data->projections.push_back(std::move(facts));
    }
  } catch (const nlohmann::json::exception&) {
    throw InputError(name, 0, "has a damaged description" + again);
  }
  const std::uint64_t ids = data->projections.empty() ? 0
                                                      : data->projections.back().first +
                                                            std::uint64_t(data->projections.back().count);
  const auto instances = forest.instances();
  const auto neurons = forest.neurons();
  require(ids == all.size(), wrong);
  parallel_for(all.size(), 4096, [&](std::size_t i) {
    const Synapse& s = all[i];
    require(s.id < ids && s.target < instances.size() &&
                s.segment < neurons[instances[s.target].morphology].original_count &&
                ((s.flags & Synapse::outside) || s.source < instances.size()) && s.flags < 7 &&
                (s.flags & Synapse::sign_mask) < 3 && s.centre().allFinite(),
            wrong);
  });
  data->standing.resize(instances.size());
  for (std::uint32_t i = 0; i < instances.size(); ++i) data->standing[forest.standing()[i].index] = i;
  // Every bundle but the last has one parent, which comes later: so a walk ends.
  const auto bundles = data->as<Bundle>(FilePart::bundles);
  const auto list = data->as<std::uint32_t>(FilePart::samples);
  std::uint64_t next_child = 0, next_synapse = 0, next_sample = 0;
  for (std::size_t n = 0; n < bundles.size(); ++n) {
    const Bundle& b = bundles[n];
    require(b.count > 0 && b.count <= bundle_size && std::isfinite(b.x + b.y + b.z + b.radius + b.largest) &&
                b.radius >= 0.f && b.largest >= 0.f,
            wrong);
    if (b.children) {
      require(b.first_child == next_child && next_child + b.children <= n && b.first == next_sample, wrong);
      next_child += b.children, next_sample += b.count;
    } else {
      require(b.first == next_synapse, wrong);
      next_synapse += b.count;
    }
  }
  require(next_synapse == all.size() && next_sample == list.size() &&
              (bundles.empty() ? all.empty() : next_child == bundles.size() - 1) &&
              std::ranges::all_of(list, [&](std::uint32_t s) { return s < all.size(); }),
          wrong);
  return Synapses(std::move(data));
}

float synapse_weight(double rank, double f) {
  if (!(rank < f)) return 0.f;
  if (f >= 2.) return 1.f;
  const double mean = f <= 1. ? .75 * f : 2. - .25 * f - 1. / f;  // of the ramp below, over ranks in [0, 1)
  return float(std::min(1., 2. * (1. - rank / f)) / mean);
}

namespace {

// Which segments a picture draws where thin branches are left to others of their like, as a cut of leaves has it (cut.h).
class Thinned {
 public:
  Thinned(const Forest& forest, const Eye& eye) : forest_(forest), eye_(eye), closeness_(forest) {
    closeness_.seen_by(eye);
  }
  Closeness::OfNeuron closeness(std::uint32_t standing) {
    return closeness_.of(standing, Placed(forest_.standing()[standing].instance));
  }
  // A neuron's leaves are its last clusters, the last of them first.
  bool draws(std::uint32_t instance, const Neuron& neuron, std::uint32_t segment,
             const Closeness::OfNeuron& closeness) const {
    const auto clusters = forest_.clusters().subspan(neuron.first_cluster, neuron.cluster_count);
    const auto leaves = clusters.subspan(clusters.size() / 2);
    const auto leaf =
        std::ranges::lower_bound(leaves, segment, std::ranges::greater(), &Cluster::first_segment);
    if (leaf == leaves.end()) return false;
    const auto at = std::uint32_t(clusters.size() / 2 + std::size_t(leaf - leaves.begin()));
    const std::uint32_t shown =
        leaf->visible_at(eye_.magnification(closeness(at)) / eye_.detail().thinnest, order_of(instance));
    const std::uint32_t place = segment - leaf->first_segment;
    return place < frame::cluster_size && (shown >> place & 1u);
  }

 private:
  const Forest& forest_;
  const Eye& eye_;
  Closeness closeness_;
};

}  // namespace

Synapses::Choice Synapses::choose(const Eye& eye, const Colouring& colouring, SynapseColour colour,
                                  std::size_t most) const {
  Choice choice;
  const auto list = bundles();
  if (list.empty() || colour == SynapseColour::none || most == 0) return choice;
  const auto every = all();
  const auto sampled = data_->as<std::uint32_t>(FilePart::samples);
  const auto f_of = [](float pixels, float whole) {
    return 2. * double(pixels / whole) * double(pixels / whole);
  };
  const auto number = [&](const Bundle& b, std::uint32_t k) {
    return b.children ? sampled[b.first + k] : b.first + k;
  };
  const auto whole_at = [&](const Sphere& sphere) {
    return whole_pixels * std::max(1.f, eye.acceptable(sphere));
  };

  // Which bundles are looked at, and how many of the lowest ranks of each; fewer where there would be too many.
  struct Prefix {
    std::uint32_t bundle, count;
  };
  std::vector<Prefix> taken;
  std::vector<std::uint32_t> open;
  float coarser = 1.f;
  for (std::size_t sum = most + 1; sum > most;) {
    sum = 0, taken.clear();
    open.assign(1, std::uint32_t(list.size() - 1));
    while (!open.empty()) {
      const std::uint32_t at = open.back();
      open.pop_back();
      const Bundle& b = list[at];
      const Sphere sphere = b.sphere();
      if (!eye.frustum().may_see(sphere)) continue;
      const double f = f_of(b.largest * eye.magnification(sphere), coarser * whole_at(sphere));
      if (b.children && every[number(b, b.count - 1)].rank() < f) {
        for (std::uint32_t c = b.children; c-- > 0;) open.push_back(b.first_child + c);
        continue;
      }
      const auto below = [&](double limit) {  // of its ranks
        std::uint32_t low = 0, high = b.count;
        while (low < high) {
          const std::uint32_t middle = (low + high) / 2;
          if (every[number(b, middle)].rank() < limit)
            low = middle + 1;
          else
            high = middle;
        }
        return low;
      };
      if (const std::uint32_t count = below(f)) {
        taken.push_back({at, count});
        // Its synapses lie at many depths: about as many of them show as would in its middle, or half way to it.
        const Sphere middle{sphere.centre, 0.f};
        float magnification = eye.magnification(middle);
        if (!eye.camera().orthographic())
          magnification *= std::min(1.f, eye.nearest_depth(middle) / (.5f * sphere.radius + 1e-6f));
        sum += below(f_of(b.largest * magnification, coarser * whole_at(sphere)));
      }
    }
    if (sum > most) coarser *= std::clamp(std::sqrt(float(sum) / float(most)), 1.02f, 2.f);
  }

  const Forest& forest = data_->forest;
  const Shown shown = colouring.shown();
  std::optional<Thinned> thinned;
  if (eye.detail().thinnest > 0.f) thinned.emplace(forest, eye);
  std::vector<Choice> pieces((taken.size() + at_once - 1) / at_once);
  parallel_for(pieces.size(), 1, [&](std::size_t piece) {
    std::unordered_map<std::uint32_t, std::vector<const frame::State*>> parts;
    std::unordered_map<std::uint32_t, Closeness::OfNeuron> close;
    for (std::size_t n = piece * at_once; n < std::min(taken.size(), (piece + 1) * at_once); ++n)
      for (std::uint32_t k = 0; k < taken[n].count; ++k) {
        const std::uint32_t index = number(list[taken[n].bundle], k);
        const Synapse& s = every[index];
        frame::State state = shown.states.empty() ? frame::State{} : shown.states[s.target];
        const frame::Instance& instance = forest.instances()[s.target];
        const Neuron& neuron = forest.neurons()[instance.morphology];
        const std::uint32_t section = forest.section_of_segment()[neuron.first_original + s.segment];
        if (state.is(frame::State::parted)) {
          const auto [known, fresh] = parts.try_emplace(s.target);
          if (fresh) known->second = section_states(forest, shown, s.target);
          if (section != soma_section && known->second[section]) state = *known->second[section];
        }
        if (!state.is(frame::State::visible) ||
            (state.kind == frame::Kind::somata && section != soma_section))
          continue;
        const Sphere sphere{s.centre(), s.radius_um()};
        if (!eye.frustum().may_see(sphere)) continue;
        const float magnification = eye.magnification({sphere.centre, 0.f});
        const frame::Segment& segment = forest.segments()[neuron.first_segment + s.segment];
        const float weight = synapse_weight(
            s.rank(), f_of(sphere.radius * magnification, coarser * whole_at({sphere.centre, 0.f})));
        if (!(weight > 0.f)) continue;
        const std::uint32_t of_branch = state.colour_class * 8u + (segment.meta & 7u);
        const std::uint32_t opacity = (state.opacity * colouring.opacities[of_branch] + 127u) / 255u;
        if (opacity == 0) continue;
        if (thinned) {
          const auto [known, fresh] = close.try_emplace(s.target);
          if (fresh) known->second = thinned->closeness(data_->standing[s.target]);
          if (!thinned->draws(s.target, neuron, neuron.first_segment + s.segment, known->second)) continue;
        }
        pieces[piece].balls.push_back(
            {sphere.centre, sphere.radius * std::sqrt(weight),
             std::uint8_t(colour == SynapseColour::target ? of_branch
                                                          : synapse_entry + std::uint32_t(s.sign())),
             std::uint8_t(opacity)});
        pieces[piece].synapses.push_back(index);
      }
  });
  std::size_t sum = 0;
  for (const Choice& piece : pieces) sum += piece.balls.size();
  choice.balls.reserve(sum), choice.synapses.reserve(sum);
  for (const Choice& piece : pieces) {
    choice.balls.insert(choice.balls.end(), piece.balls.begin(), piece.balls.end());
    choice.synapses.insert(choice.synapses.end(), piece.synapses.begin(), piece.synapses.end());
  }
  return choice;
}

namespace {

// Unknown, excitatory, inhibitory: told apart also by those who do not tell red from green.
std::array<Vec3, 3> colours_on(Background background) {
  return background == Background::dark
             ? std::array{light_of(0xC9CED6), light_of(0xFFE14D), light_of(0x5CD6FF)}
             : std::array{light_of(0x6B7280), light_of(0xC77700), light_of(0x0068B8)};
}

}  // namespace

void paint_synapses(frame::Palette& palette, Background background) {
  std::ranges::copy(colours_on(background), palette.begin() + synapse_entry);
}

std::vector<LegendEntry> synapse_legend(Background background) {
  const auto colours = colours_on(background);
  return {{"excitatory synapses", {colours[1]}}, {"inhibitory synapses", {colours[2]}}};
}

std::optional<SynapsePick> pick(const Synapses::Choice& choice, const frame::Camera& camera,
                                const frame::Viewport& viewport, const Vec2& place, float reach) {
  const Ray ray = ray_through(camera, viewport, place);
  const Vec3 forward = -camera.axes().col(2);
  std::optional<SynapsePick> best;
  for (std::size_t i = 0; i < choice.balls.size(); ++i) {
    const frame::Ball& ball = choice.balls[i];
    const Vec3 to = ball.centre - ray.origin;
    const float depth = forward.dot(ball.centre - camera.eye);
    if (!(depth > camera.near)) continue;
    const float along = to.dot(ray.direction),
                radius = ball.radius + reach * camera.pixel_size(viewport.height, depth);
    const float under = radius * radius - (to - along * ray.direction).squaredNorm();
    if (!(under >= 0.f)) continue;
    const double distance = double(along) - std::sqrt(double(under));
    if (!best || distance < best->distance) best = SynapsePick{choice.synapses[i], distance};
  }
  return best;
}

}  // namespace forest::scene
