// SPDX-License-Identifier: Apache-2.0
#include "forest/reports/layout.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <unordered_map>

#include <fmt/format.h>

#include "forest/circuit/synapses.h"
#include "forest/core/error.h"
#include "forest/core/hash.h"
#include "forest/morphology/measure.h"

namespace forest::reports {
namespace {

/// Sections in the order of branches; `starts` tells where a branch begins in it.
struct BranchOrder {
  std::vector<std::uint32_t> sections, starts;
};

BranchOrder branch_order(const Morphology& m) {
  const std::size_t count = m.sections().size();
  std::vector<double> reach(count);  // from the start of a section to its farthest tip, µm
  for (std::size_t i = count; i-- > 0;) {
    reach[i] += section_length(m, SectionId(i));
    if (const SectionId parent = m.sections()[i].parent; parent.valid())
      reach[parent.value()] = std::max(reach[parent.value()], reach[i]);
  }
  BranchOrder order;
  std::vector<SectionId> open(m.roots().rbegin(), m.roots().rend());
  while (!open.empty()) {
    SectionId at = open.back();
    open.pop_back();
    order.starts.push_back(std::uint32_t(order.sections.size()));
    for (;;) {
      order.sections.push_back(at.value());
      const auto children = m.children(at);
      if (children.empty()) break;
      const auto longest =
          std::ranges::max_element(children, {}, [&](SectionId id) { return reach[id.value()]; });
      for (std::size_t i = children.size(); i-- > 0;)
        if (children[i] != *longest) open.push_back(children[i]);
      at = *longest;
    }
  }
  order.starts.push_back(std::uint32_t(count));
  return order;
}

/// What is computed once a morphology.
struct Shape {
  std::vector<SectionId> of_element;
  std::vector<std::uint32_t> element;  // of each section
  BranchOrder order;
};

bool is_shapeless(const Nodes& nodes, const std::string& population) {
  return std::ranges::find(nodes.shapeless, population) != nodes.shapeless.end();
}

std::uint32_t population_of(const Nodes& nodes, const std::string& name, const std::string& source) {
  const auto found = std::ranges::find(nodes.populations, name);
  if (is_shapeless(nodes, name))
    throw InputError(
        source, 0,
        fmt::format("population {} is virtual, so that its nodes have no shape to show values on; "
                    "choose another population, one of {}",
                    name, fmt::join(nodes.populations, ", ")));
  if (found == nodes.populations.end())
    throw InputError(
        source, 0,
        fmt::format("population {} is not in the circuit, which has {}; name the circuit that was simulated",
                    name, fmt::join(nodes.populations, ", ")));
  return std::uint32_t(found - nodes.populations.begin());
}

std::uint32_t weight_of(double length) {
  return std::uint32_t(std::clamp(std::round(length * 10.), 1., 65535.));
}

class Matcher {
 public:
  Matcher(const Report& report, const circuit::Circuit& circuit, std::span<const Morphology> morphologies,
          const Nodes& nodes)
      : report_(report), circuit_(circuit), morphologies_(morphologies) {
    if (nodes.of_instance.size() != circuit.instances.size())
      throw Error(fmt::format("{} nodes are named for {} neurons of the circuit", nodes.of_instance.size(),
                              circuit.instances.size()));
    for (const std::string& name : report.populations)
      population_.push_back(population_of(nodes, name, report.source));
    for (std::size_t i = 0; i < nodes.of_instance.size(); ++i) instance_.emplace(nodes.of_instance[i], i);
    shapes_.resize(morphologies.size());
  }

  Match run() {
    for (std::size_t n = 0; n < report_.nodes.size(); ++n) {
      const std::uint32_t instance = instance_of(n);
      match_.instance.push_back(instance);
      match_.layout.push_back(layout_of(n, circuit_.instances[instance].morphology));
    }
    return std::move(match_);
  }

 private:
  [[noreturn]] void refuse(const std::string& sentence) const {
    throw InputError(report_.source, 0, sentence);
  }

  std::string name_of(std::size_t n) const {
    return fmt::format("node {} of population {}", report_.nodes[n].id,
                       report_.populations[report_.nodes[n].population]);
  }

  std::uint32_t instance_of(std::size_t n) const {
    const auto [report_population, id] = report_.nodes[n];
    const auto found = instance_.find({population_[report_population], id});
    if (found == instance_.end()) {
      const auto first = instance_.lower_bound({population_[report_population], 0});
      std::size_t count = 0;
      std::uint64_t last = 0;
      for (auto at = first; at != instance_.end() && at->first.population == population_[report_population];
           ++at)
        ++count, last = at->first.id;
      refuse(fmt::format(
          "{} is not in the circuit, where {} neurons of it have a shape{}; name the circuit that was "
          "simulated",
          name_of(n), count, count ? fmt::format(", the last of them node {}", last) : ""));
    }
    return std::uint32_t(found->second);
  }

  std::span<const std::uint32_t> elements(std::size_t n) const {
    return std::span(report_.element_ids)
        .subspan(report_.first_column[n], report_.first_column[n + 1] - report_.first_column[n]);
  }
  std::span<const float> positions(std::size_t n) const {
    if (report_.element_positions.empty()) return {};
    return std::span(report_.element_positions)
        .subspan(report_.first_column[n], report_.first_column[n + 1] - report_.first_column[n]);
  }

  std::uint32_t layout_of(std::size_t n, std::uint32_t morphology) {
    const auto ids = elements(n);
    const auto at = positions(n);
    const std::uint64_t key = hash64(std::as_bytes(ids), hash64(std::as_bytes(at), morphology));
    for (auto [i, end] = known_.equal_range(key); i != end; ++i) {
      const auto& [model, layout] = i->second;
      const auto bits = [](std::span<const float> v) { return std::as_bytes(v); };
      if (match_.layouts[layout].morphology == morphology && std::ranges::equal(ids, elements(model)) &&
          std::ranges::equal(bits(at), bits(positions(model))))
        return layout;
    }
    const auto fresh = std::uint32_t(match_.layouts.size());
    match_.layouts.push_back(build(n, morphology, ids, at));
    known_.emplace(key, std::pair(n, fresh));
    return fresh;
  }

  const Shape& shape_of(std::uint32_t morphology) {
    Shape& shape = shapes_[morphology];
    const Morphology& m = morphologies_[morphology];
    if (shape.order.starts.empty()) {
      shape = {sections_of_elements(m), {}, branch_order(m)};
      shape.element.resize(shape.of_element.size());
      for (std::size_t i = 0; i < shape.of_element.size(); ++i)
        shape.element[shape.of_element[i].value()] = std::uint32_t(i + 1);
    }
    return shape;
  }

  Layout build(std::size_t n, std::uint32_t morphology, std::span<const std::uint32_t> ids,
               std::span<const float> at) {
    const Shape& shape = shape_of(morphology);
    const Morphology& m = morphologies_[morphology];
    std::vector<std::vector<std::uint32_t>> columns(m.sections().size() +
                                                    1);  // of each section; the soma's are last
    const std::size_t soma = m.sections().size();
    for (std::size_t c = 0; c < ids.size(); ++c) {
      if (ids[c] > m.sections().size())
        refuse(fmt::format(
            "{} has a compartment in section {}, but its morphology {} has sections 0 (the soma) to {}; "
            "name the circuit that was simulated",
            name_of(n), ids[c], circuit_.morphologies[morphology], m.sections().size()));
      if (!at.empty() && !(at[c] >= 0.f && at[c] <= 1.f))
        refuse(fmt::format("{} has a compartment at {} of section {}; positions are from 0 to 1", name_of(n),
                           at[c], ids[c]));
      columns[ids[c] ? shape.of_element[ids[c] - 1].value() : soma].push_back(std::uint32_t(c));
    }
    Layout layout{.morphology = morphology, .soma = 0, .compartments = {}, .sections = {}, .branches = {}};
    const auto add = [&](std::size_t section, double length) {
      auto& own = columns[section];
      if (own.empty()) return;
      if (!at.empty()) std::ranges::stable_sort(own, {}, [&](std::uint32_t c) { return at[c]; });
      for (std::size_t k = 0; k < own.size(); ++k)
        layout.compartments.push_back({own[k], at.empty() ? (float(k) + .5f) / float(own.size()) : at[own[k]],
                                       weight_of(length / double(own.size()))});
      layout.sections.push_back({section == soma ? soma_run : std::uint32_t(section),
                                 section == soma ? 0 : shape.element[section],
                                 std::uint32_t(layout.compartments.size())});
    };
    const auto end_branch = [&] {
      const auto end = std::uint32_t(layout.sections.size());
      if (end > (layout.branches.empty() ? 0 : layout.branches.back())) layout.branches.push_back(end);
    };
    add(soma, 2. * double(m.soma().sphere().radius));
    layout.soma = std::uint32_t(layout.compartments.size() / 2);
    end_branch();
    for (std::size_t b = 0; b + 1 < shape.order.starts.size(); ++b) {
      for (std::uint32_t i = shape.order.starts[b]; i < shape.order.starts[b + 1]; ++i) {
        const std::uint32_t section = shape.order.sections[i];
        add(section, section_length(m, SectionId(section)));
      }
      end_branch();
    }
    if (layout.sections.front().section != soma_run) layout.soma = nearest_to_soma(m, layout);
    return layout;
  }

  /// Of a neuron whose soma is not reported.
  static std::uint32_t nearest_to_soma(const Morphology& m, const Layout& layout) {
    const auto distances = path_distances(m);
    std::uint32_t best = 0;
    double least = INFINITY;
    for (std::size_t s = 0, c = 0; s < layout.sections.size(); ++s)
      for (; c < layout.sections[s].end; ++c) {
        const std::uint32_t section = layout.sections[s].section;
        const double distance = distances[section] - (1. - double(layout.compartments[c].position)) *
                                                         section_length(m, SectionId(section));
        if (distance < least) least = distance, best = std::uint32_t(c);
      }
    return best;
  }

  const Report& report_;
  const circuit::Circuit& circuit_;
  std::span<const Morphology> morphologies_;
  std::vector<std::uint32_t> population_;  // in the circuit, of each population of the report
  std::map<Node, std::size_t> instance_;
  std::vector<Shape> shapes_;
  std::unordered_multimap<std::uint64_t, std::pair<std::size_t, std::uint32_t>> known_;  // first node, layout
  Match match_;
};

}  // namespace

std::vector<SectionId> sections_of_elements(const Morphology& m) {
  std::vector<SectionId> ids;
  for (std::size_t i = 0; i < m.sections().size(); ++i) ids.emplace_back(i);
  std::ranges::stable_sort(ids, {}, [&](SectionId id) { return circuit::element_rank(m.section(id).kind); });
  return ids;
}

Match match(const Report& report, const circuit::Circuit& circuit, std::span<const Morphology> morphologies,
            const Nodes& nodes) {
  check(report);
  return Matcher(report, circuit, morphologies, nodes).run();
}

PlacedSpikes place(std::span<const Spikes> spikes, const Nodes& nodes) {
  PlacedSpikes placed;
  for (const Spikes& of : spikes) {
    if (is_shapeless(nodes, of.population)) {
      placed.left_out += of.times.size();
      continue;
    }
    const std::uint32_t population = population_of(nodes, of.population, of.source);
    const auto refuse = [&](const std::string& sentence) { throw InputError(of.source, 0, sentence); };
    std::unordered_map<std::uint64_t, std::uint32_t> instance;
    for (std::size_t i = 0; i < nodes.of_instance.size(); ++i)
      if (nodes.of_instance[i].population == population)
        instance.emplace(nodes.of_instance[i].id, std::uint32_t(i));
    for (std::size_t i = 0; i < of.times.size(); ++i) {
      if (!std::isfinite(of.times[i]))
        refuse(fmt::format("the time of spike {} of population {} is no number; write the file again", i,
                           of.population));
      if (of.nodes[i] >= nodes.ends[population])
        refuse(
            fmt::format("node {} of population {} spikes and is not in the circuit, which has {} nodes, "
                        "numbered from 0; name the "
                        "circuit that was simulated",
                        of.nodes[i], of.population, nodes.ends[population]));
      if (const auto found = instance.find(of.nodes[i]); found != instance.end())
        placed.spikes.push_back({of.times[i], found->second});
      else
        ++placed.left_out;
    }
  }
  std::ranges::sort(placed.spikes, {}, [](const Spike& s) { return std::pair(s.time, s.instance); });
  return placed;
}

}  // namespace forest::reports
