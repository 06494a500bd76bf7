// SPDX-License-Identifier: Apache-2.0
// brainforest show: all that is known of a neuron.
#include <algorithm>
#include <map>
#include <memory>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/morphology/measure.h"
#include "forest/repository/names.h"
#include "forest/repository/rows.h"

#include "apps/cli/console.h"
#include "apps/cli/neurons.h"
#include "apps/cli/verb.h"

namespace forest::cli {
namespace {

using namespace repository;
using Json = nlohmann::ordered_json;

struct Options {
  std::vector<std::string> names;
  std::string repo, population;
  bool sections = false;
};

/// Of all sections of a kind.
struct KindSum {
  std::size_t sections = 0;
  double length = 0., area = 0., volume = 0.;
};

std::map<SectionKind, KindSum> kinds_of(const Morphology& m) {
  std::map<SectionKind, KindSum> kinds;
  for (std::size_t i = 0; i < m.sections().size(); ++i) {
    const SectionId id(i);
    KindSum& sum = kinds[m.section(id).kind];
    ++sum.sections;
    sum.length += section_length(m, id);
    sum.area += section_area(m, id);
    sum.volume += section_volume(m, id);
  }
  return kinds;
}

std::string number(double value) { return fmt::format("{:.2f}", value); }

void show_neuron(const NeuronRow& row, const Morphology& m, const std::vector<ArborRow>& arbors,
                 bool sections, Console& console, Json& out) {
  Json neuron = json_of(row);
  std::vector<std::vector<std::string>> facts{{"neuron", fmt::format("{} (id {})", row.name, row.id.value())},
                                              {"population", row.population}};
  for (const auto& [key, value] : {std::pair{"species", &row.species}, std::pair{"region", &row.region},
                                   std::pair{"layer", &row.layer}, std::pair{"type", &row.type}})
    if (!value->empty()) facts.push_back({key, escaped(*value)});
  if (const auto* traced = std::get_if<Traced>(&row.provenance)) {
    facts.push_back({"traced", source_of(row)});
    if (!traced->hash.empty()) facts.push_back({"hash of the file", traced->hash});
  } else {
    facts.push_back({"grown", source_of(row)});
    facts.push_back({"hash of the grammar", std::get<Grown>(row.provenance).grammar_hash});
  }
  facts.push_back({"stored by", "brainforest " + row.program});

  const Soma& soma = m.soma();
  const Point centre = soma.sphere();
  facts.push_back({"soma", std::string(name_of(soma.kind))});
  neuron["soma"] = {{"kind", name_of(soma.kind)}, {"points", soma.points.size()}};
  if (soma.kind != SomaKind::none) {
    facts.push_back(
        {"soma centre (µm)", fmt::format("{:.2f}, {:.2f}, {:.2f}", centre.x, centre.y, centre.z)});
    facts.push_back({"soma radius (µm)", number(centre.radius)});
    facts.push_back({"soma area (µm²)", number(soma.area())});
    neuron["soma"].update(
        {{"centre", {centre.x, centre.y, centre.z}}, {"radius", centre.radius}, {"area", soma.area()}});
  }
  std::size_t terminals = 0;
  int order = 0;
  for (const ArborRow& arbor : arbors) terminals += arbor.terminals, order = std::max(order, arbor.order);
  const std::pair<const char*, std::size_t> counts[]{
      {"stems", row.stems},     {"sections", row.sections},
      {"terminals", terminals}, {"segments", m.segment_count()},
      {"points", row.points},   {"highest order", std::size_t(order)},
      {"spines", row.spines}};
  for (const auto& [name, count] : counts) facts.push_back({name, std::to_string(count)});
  neuron.update({{"terminals", terminals}, {"segments", m.segment_count()}, {"order", order}});
  if (const Bounds bounds = m.bounds(); !bounds.empty()) {
    const Vec3 extent = bounds.extent();
    facts.push_back(
        {"extent (µm)", fmt::format("{:.1f} × {:.1f} × {:.1f}", extent.x(), extent.y(), extent.z())});
    neuron["extent"] = {extent.x(), extent.y(), extent.z()};
  }
  for (const auto& [key, value] : m.annotations()) {
    facts.push_back({escaped(key), escaped(value)});
    neuron["annotations"].push_back({escaped(key), escaped(value)});
  }
  console.table(facts.front(), {facts.begin() + 1, facts.end()});

  std::vector<std::vector<std::string>> lines;
  for (const auto& [kind, sum] : kinds_of(m)) {
    lines.push_back({std::string(name_of(kind)), std::to_string(sum.sections), number(sum.length),
                     number(sum.area), number(sum.volume)});
    neuron["kinds"].push_back({{"kind", name_of(kind)},
                               {"sections", sum.sections},
                               {"length", sum.length},
                               {"area", sum.area},
                               {"volume", sum.volume}});
  }
  console.say("");
  console.table({"kind", "sections", "length (µm)", "area (µm²)", "volume (µm³)"}, lines);

  lines.clear();
  for (const ArborRow& arbor : arbors) {
    lines.push_back({std::to_string(lines.size()), std::string(name_of(arbor.kind)),
                     std::to_string(arbor.root.value()), std::to_string(arbor.sections),
                     std::to_string(arbor.terminals), std::to_string(arbor.order), number(arbor.length)});
    neuron["arbors"].push_back({{"root", arbor.root.value()},
                                {"kind", name_of(arbor.kind)},
                                {"sections", arbor.sections},
                                {"terminals", arbor.terminals},
                                {"order", arbor.order},
                                {"length", arbor.length}});
  }
  console.say("");
  console.table({"arbor", "kind", "root section", "sections", "terminals", "highest order", "length (µm)"},
                lines);

  lines.clear();
  for (std::size_t i = 0; sections && i < m.sections().size(); ++i) {
    const SectionId id(i);
    const Section& s = m.section(id);
    const auto points = m.points(id);
    const double length = section_length(m, id);
    const Json parent = s.parent.valid() ? Json(s.parent.value()) : Json();
    lines.push_back({std::to_string(i), s.parent.valid() ? std::to_string(s.parent.value()) : "-",
                     std::string(name_of(s.kind)), std::to_string(s.tag), std::to_string(m.order(id)),
                     std::to_string(points.size()), number(length), number(2. * points.front().radius),
                     number(2. * points.back().radius), std::to_string(m.children(id).size())});
    neuron["section_list"].push_back({{"section", i},
                                      {"parent", parent},
                                      {"kind", name_of(s.kind)},
                                      {"tag", s.tag},
                                      {"order", m.order(id)},
                                      {"points", points.size()},
                                      {"length", length},
                                      {"children", m.children(id).size()}});
  }
  if (sections) {
    console.say("");
    console.table({"section", "parent", "kind", "tag", "order", "points", "length (µm)",
                   "first diameter (µm)", "last diameter (µm)", "daughters"},
                  lines);
  }
  out.push_back(std::move(neuron));
}

void run(const Options& options, Console& console) {
  const Repository repository = Repository::open(options.repo, Access::read);
  Json out = Json::array();
  bool first = true;
  for (const NeuronRow& row : pick_neurons(repository, options.names, options.population)) {
    if (!std::exchange(first, false)) console.say("");
    show_neuron(row, repository.morphology(row.id), repository.arbors(row.id), options.sections, console,
                out);
  }
  console.print(out);
}

}  // namespace

std::function<void()> show(CLI::App& command, Console& console) {
  const auto options = std::make_shared<Options>();
  CLI::Option* names = command.add_option("neurons", options->names,
                                          "Neurons, by name, or by the id that list shows: 12 or '#12'");
  command.add_option("--repo", options->repo, "The repository")->required()->type_name("REPO");
  CLI::Option* population = command.add_option("--population", options->population,
                                               "Of this population; all of it when no neuron is named");
  must_be_name(*population);
  command.add_flag("--sections", options->sections, "Show every section too");
  command.parse_complete_callback([names, population] {
    if (names->empty() && population->empty()) throw CLI::RequiredError("neurons or --population");
  });
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
