// SPDX-License-Identifier: Apache-2.0
#include "apps/cli/planting_elements.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numeric>
#include <set>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "forest/circuit/measured_layers.h"
#include "forest/circuit/plant_elements.h"
#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/parallel.h"
#include "forest/cortex/borders.h"
#include "forest/cortex/locate.h"
#include "forest/cortex/outline.h"
#include "forest/cortex/region.h"
#include "forest/cortex/warp.h"
#include "forest/io/elements_file.h"
#include "forest/io/surface.h"
#include "forest/repository/names.h"

#include "apps/cli/clock.h"
#include "apps/cli/console.h"
#include "apps/cli/layer_maps.h"
#include "apps/cli/options.h"

namespace forest::cli {
namespace {

using Place = Eigen::Vector3d;

// Those with the middle of their outer face in areas that a map of labels names.
std::vector<std::uint32_t> in_areas(const ElementOptions& options,
                                    std::span<const cortex::Hexahedron> elements) {
  const Mesh surface = io::read_surface(MappedFile(options.labels_on).text(), options.labels_on.string());
  const std::string name = options.labels.string();
  const io::SurfaceValues areas = io::read_surface_values(MappedFile(options.labels).text(), name);
  if (areas.labels.empty())
    throw InputError(name, 0, "names no areas; give labels, GIFTI (.label.gii) or FreeSurfer's (.annot)");
  if (areas.values.size() != surface.positions.size())
    throw InputError(
        name, 0,
        fmt::format("has areas of {} vertices and {} has {}; give the surface they were drawn on",
                    areas.values.size(), options.labels_on.string(), surface.positions.size()));
  std::set<std::int32_t> keys;
  for (const std::string& wanted : options.areas) {
    bool known = false;
    for (const io::SurfaceLabel& label : areas.labels)
      if (label.name == wanted) known = true, keys.insert(label.key);
    if (known) continue;
    std::vector<std::string> names;
    for (const io::SurfaceLabel& label : areas.labels) names.push_back(io::printable(label.name));
    throw InputError(name, 0,
                     fmt::format("has no area '{}'; its areas, several of which are parted by blanks, are {}",
                                 wanted, fmt::join(names, ", ")));
  }
  const std::vector<float> of = cortex::values_at(elements, surface, areas.values);
  std::vector<std::uint32_t> chosen;
  for (std::uint32_t e = 0; e < of.size(); ++e)
    if (!std::isnan(of[e]) && keys.contains(std::int32_t(of[e]))) chosen.push_back(e);
  if (chosen.empty())
    throw Error(
        fmt::format("no element of {} lies in {}", options.file.string(), fmt::join(options.areas, ", ")));
  return chosen;
}

std::vector<std::uint32_t> choose(const ElementOptions& options,
                                  std::span<const cortex::Hexahedron> elements) {
  if (!options.elements.empty()) return parse_elements(options.elements, options.file, elements.size());
  if (!options.areas.empty()) return in_areas(options, elements);
  std::vector<std::uint32_t> chosen;
  const std::vector<Place> middles = cortex::middles_of(elements);
  if (!options.near.empty()) {
    const Place near(options.near[0], options.near[1], options.near[2]);
    if (!near.allFinite()) throw Error("--near must be three numbers, µm");
    std::vector<std::pair<double, std::uint32_t>> order;
    for (std::uint32_t e = 0; e < middles.size(); ++e)
      order.emplace_back((middles[e] - near).squaredNorm(), e);
    const auto count = std::min<std::size_t>(options.count, order.size());
    std::partial_sort(order.begin(), order.begin() + std::ptrdiff_t(count), order.end());
    const auto beside = [&](const Place& place) {  // µm from the cortex, about
      const auto nearest =
          std::ranges::min_element(middles, {}, [&](const Place& m) { return (m - place).norm(); });
      const cortex::Hexahedron& element = elements[std::size_t(nearest - middles.begin())];
      double reach = 0.;
      for (const double u : {0., 1.})
        for (const double v : {0., 1.})
          for (const double w : {0., 1.}) reach = std::max(reach, (element.at(u, v, w) - *nearest).norm());
      return (*nearest - place).norm() - reach;
    };
    constexpr double farthest = 1e3;
    if (const double away = beside(near); !(away <= farthest))
      throw Error(fmt::format("({:g}, {:g}, {:g}) µm is {:.3g} mm away from all elements; {}", near.x(),
                              near.y(), near.z(), away / 1e3,
                              beside(1e3 * near) <= farthest
                                  ? fmt::format("in mm it is among them: --near {:g} {:g} {:g}",
                                                1e3 * near.x(), 1e3 * near.y(), 1e3 * near.z())
                                  : fmt::format("the first has its middle at ({:.0f}, {:.0f}, {:.0f}) µm",
                                                middles[0].x(), middles[0].y(), middles[0].z())));
    for (std::size_t i = 0; i < count; ++i) chosen.push_back(order[i].second);
    return chosen;
  }
  if (!options.sphere.empty() && !(options.sphere[3] > 0.))
    throw Error(fmt::format("--sphere has a radius of {:g} µm; give one above 0", options.sphere[3]));
  const auto within = [&](const Place& p) {
    if (!options.sphere.empty())
      return (p - Place(options.sphere[0], options.sphere[1], options.sphere[2])).norm() <= options.sphere[3];
    for (Eigen::Index a = 0; a < 3; ++a)
      if (const auto [low, high] = std::minmax(options.box[std::size_t(a)], options.box[std::size_t(a) + 3]);
          !(p[a] >= low && p[a] <= high))
        return false;
    return true;
  };
  Place low = Place::Constant(INFINITY), high = -low;
  for (std::uint32_t e = 0; e < middles.size(); ++e) {
    low = low.cwiseMin(middles[e]), high = high.cwiseMax(middles[e]);
    if (within(middles[e])) chosen.push_back(e);
  }
  if (chosen.empty())
    throw Error(fmt::format(
        "no element of {} has its middle in that {}; their middles are at ({:.0f}, {:.0f}, {:.0f}) to "
        "({:.0f}, {:.0f}, {:.0f}) µm",
        options.file.string(), options.box.empty() ? "sphere" : "box", low.x(), low.y(), low.z(), high.x(),
        high.y(), high.z()));
  return chosen;
}

// In elements that fold themselves there is no telling where anything is.
void refuse_uncertified(const cortex::Elements& elements, std::span<const std::uint32_t> chosen,
                        const std::filesystem::path& file) {
  const std::vector<std::uint32_t> bad = cortex::uncertified(elements, chosen);
  if (bad.empty()) return;
  const auto first = std::span(bad).first(std::min<std::size_t>(bad.size(), 5));
  throw Error(
      fmt::format("{} of those chosen of {} may fold, the first {}; choose others, or build them anew",
                  counted(bad.size(), "element"), file.string(), fmt::join(first, ", ")));
}

// Each neuron becomes a shape of its own.
void bend(PlantedElements& all, std::span<const circuit::Rooted> rooted, const cortex::Sheet& sheet,
          Progress& progress) {
  circuit::Circuit& circuit = all.planted.circuit;
  std::vector<cortex::Seat> seats;
  std::vector<std::string> names;
  for (std::size_t e = 0; e < all.elements.size(); ++e)
    for (std::size_t i = all.first[e]; i < all.first[e + 1]; ++i) {
      seats.push_back({all.elements[e], rooted[i].uvw, rooted[i].turn});
      names.push_back(
          repository::file_name(fmt::format("e{}-{:05}-{}", all.elements[e], i - all.first[e],
                                            circuit.morphologies[circuit.instances[i].morphology])));
    }
  auto [neurons, bending] = circuit::bend(circuit, all.planted.morphologies, seats, sheet, progress);
  for (std::size_t i = 0; i < circuit.instances.size(); ++i) {
    circuit.instances[i].morphology = std::uint32_t(i);
    circuit.instances[i].orientation = Quat::Identity();
  }
  circuit.morphologies = std::move(names), all.planted.morphologies = std::move(neurons);
  all.bending = bending;
}

// What is only turned upright may be taller than the tissue above its soma.
void tell_too_tall(std::span<const circuit::Rooted> rooted, std::span<const circuit::Candidate> candidates,
                   std::vector<std::string>& sentences) {
  std::size_t count = 0;
  float most = 0.f;  // µm
  for (const circuit::Rooted& r : rooted)
    if (const float above = candidates[r.candidate].height - r.depth; above > circuit::pia_slack)
      ++count, most = std::max(most, above);
  if (count)
    sentences.push_back(fmt::format(
        "{} of {} end above the pia, by up to {:.2f} mm: the tissue above them is thinner than they are "
        "tall; --bend grid bends and shortens them",
        count, counted(rooted.size(), "neuron"), most / 1e3f));
}

// Where layers have room for fewer somata than there should be.
class Shortage {
 public:
  explicit Shortage(std::size_t layers) : layers_(layers) {}
  void expect(const std::vector<std::vector<std::uint32_t>>& counts) {  // [layer][type] of the next element
    for (const auto& layer : counts)
      expected_.push_back(std::accumulate(layer.begin(), layer.end(), std::size_t(0)));
  }
  double expected() const { return std::accumulate(expected_.begin(), expected_.end(), 0.); }
  void see(std::span<const circuit::Rooted> planted) {  // in the next element
    const auto own = std::span(expected_).subspan(seen_++ * layers_, layers_);
    for (const circuit::Rooted& r : planted) --own[r.layer];
  }
  void tell(const circuit::Recipe& recipe, std::vector<std::string>& sentences) const {
    for (std::size_t l = 0; l < layers_; ++l) {
      std::size_t elements = 0, missing = 0;
      for (std::size_t i = l; i < expected_.size(); i += layers_)
        elements += expected_[i] > 0, missing += expected_[i];
      if (missing)
        sentences.push_back(fmt::format(
            "layer {} has no room for {} in {}, which are not planted; lower its density or the gap, or "
            "plant "
            "neurons with smaller somata",
            recipe.layers[l].name, counted(missing, "soma", "somata"), counted(elements, "element")));
    }
  }

 private:
  std::size_t layers_, seen_ = 0;
  std::vector<std::size_t>
      expected_;  // of the layers of one element after the other; of those seen, what is missing
};

// The measured ends of the recipe's layers; nothing where no maps are given.
std::optional<cortex::MeasuredBorders> measured_borders(const ElementOptions& options,
                                                        const circuit::Recipe& recipe,
                                                        const cortex::Elements& elements) {
  if (options.layers.empty()) return std::nullopt;
  const Mesh surface = io::read_surface(MappedFile(options.layers_on).text(), options.layers_on.string());
  const auto maps =
      circuit::maps_of_layers(recipe, read_layer_maps(options.layers, surface.positions.size()));
  return cortex::MeasuredBorders(elements, surface, cortex::shares_of(surface, maps));
}

// @param leeway  how many times too large the number may be, when it is roughly known
void refuse_too_many(std::size_t elements, double neurons, bool bent, double leeway = 1.) {
  constexpr double most = 50e6, most_bent = 200'000;
  if (neurons > leeway * (bent ? most_bent : most))
    throw Error(
        fmt::format("{} would have {:.3g} neurons, and {:.3g} is the most{}; choose fewer elements, "
                    "or lower --scale or --density",
                    counted(elements, "element"), neurons, bent ? most_bent : most,
                    bent ? " of distinct shapes (--bend grid)" : ""));
}

// The usual volume says how many places there are to choose from.
void refuse_wrong_volume(std::span<const cortex::Hexahedron> elements, double volume,
                         const std::filesystem::path& file) {
  constexpr std::size_t most = 500;  // elements that are looked at
  constexpr double wrong = 20.;      // times too large or too small
  const std::size_t stride = (elements.size() + most - 1) / most;
  double sum = 0., count = 0.;
  for (std::size_t e = 0; e < elements.size(); e += stride) sum += elements[e].volume(), ++count;
  if (const double mean = sum / count; !(volume < wrong * mean && volume > mean / wrong))
    throw InputError(
        file.string(), 0,
        fmt::format("says that its elements have {:.3g} mm³, and they have {:.3g}; build them anew",
                    volume / 1e9, mean / 1e9));
}

}  // namespace

std::vector<std::uint32_t> parse_elements(const std::string& text, const std::filesystem::path& file,
                                          std::size_t count) {
  std::vector<std::uint32_t> all(count);
  std::iota(all.begin(), all.end(), 0u);
  if (text == "all") return all;
  std::vector<std::uint32_t> chosen;
  const char *at = text.data(), *const end = at + text.size();
  const auto number = [&] {
    std::uint64_t value = 0;
    const auto [next, error] = std::from_chars(at, end, value);
    if (error != std::errc())
      throw Error(fmt::format("'{}' is no list of elements; give numbers, 7,12,20-29, or all", text));
    if (value >= count)
      throw Error(fmt::format("{} has elements 0 to {}, and no {}", file.string(), count - 1, value));
    at = next;
    return std::uint32_t(value);
  };
  for (;;) {
    const std::uint32_t first = number();
    std::uint32_t last = first;
    if (at != end && *at == '-') ++at, last = number();
    if (last < first)
      throw Error(fmt::format("'{}-{}' runs backwards; write {}-{}", first, last, last, first));
    for (std::uint32_t e = first; e <= last; ++e) chosen.push_back(e);
    if (at == end) break;
    if (*at++ != ',')
      throw Error(fmt::format("'{}' is no list of elements; give numbers, 7,12,20-29, or all", text));
  }
  std::set<std::uint32_t> seen;
  std::erase_if(chosen, [&](std::uint32_t e) { return !seen.insert(e).second; });
  return chosen;
}

PlantedElements plant_in_elements(const ElementOptions& options, const circuit::Recipe& recipe,
                                  const std::string& repo, std::uint64_t seed, Progress& progress) {
  if (options.elements.empty() && options.near.empty() && options.sphere.empty() && options.box.empty() &&
      options.areas.empty())
    throw Error("say which elements are planted: --element, --region, --near, --sphere or --box");
  const io::ElementsFile file = io::read_elements(options.file);
  const bool bent = options.bend == "grid";
  std::vector<cortex::Hexahedron> elements(file.cortex.elements.size());
  parallel_for(elements.size(), 64, [&](std::size_t e) { elements[e] = file.cortex.elements.hexahedron(e); });
  PlantedElements all;
  all.elements = choose(options, elements);
  const std::vector<cortex::Junctions> junctions = cortex::junctions(elements);
  std::optional<cortex::Locator> locator;
  if (bent) locator.emplace(elements);
  const cortex::Sheet sheet{elements, junctions, locator ? &*locator : nullptr};
  if (options.row > 1) {
    if (all.elements.size() != 1)
      throw Error(
          fmt::format("a row goes through one element, and {} are chosen; choose one", all.elements.size()));
    all.elements = cortex::row_through(sheet, all.elements.front(), options.row);
  }
  const std::size_t asked = std::max(options.row, options.near.empty() ? 1u : options.count);
  if (all.elements.size() < asked)
    all.left_out.push_back(
        fmt::format("there are {} and no {} elements in {}", all.elements.size(), asked,
                    options.row > 1 ? "that row, which ends or comes back there" : options.file.string()));

  refuse_uncertified(file.cortex.elements, all.elements, options.file);
  const auto measured = measured_borders(options, recipe, file.cortex.elements);
  double mean = circuit::mean_density(recipe), scale = options.scale;
  if (options.density > 0.) {
    if (measured) {  // the layers of the whole file, so that an element's neurons do not depend on which others are chosen
      constexpr std::size_t most = 2000;  // elements that are looked at
      const std::size_t stride = (elements.size() + most - 1) / most;
      std::vector<double> volumes(recipe.layers.size(), 0.);
      parallel_in_order((elements.size() + stride - 1) / stride,
                        [&](std::size_t i) {
                          const cortex::Borders borders = measured->of(file.cortex.elements, i * stride);
                          std::vector<double> here;
                          for (std::size_t l = 0; l < volumes.size(); ++l)
                            here.push_back(borders.volume(elements[i * stride], l));
                          return here;
                        },
                        [&](std::size_t, const std::vector<double>& here) {
                          for (std::size_t l = 0; l < volumes.size(); ++l) volumes[l] += here[l];
                        });
      mean = circuit::mean_density(recipe, volumes);
    }
    if (!(mean > 0.)) throw Error("no layer that is there has neurons; give one a density");
    scale = options.density / mean;
  }
  // Far too many are told before anything is loaded; how many exactly follows from the borders of layers.
  std::vector<double> volumes(all.elements.size());
  parallel_for(volumes.size(), 64,
               [&](std::size_t i) { volumes[i] = elements[all.elements[i]].volume() * 1e-9; });
  refuse_wrong_volume(elements, file.volume, options.file);
  refuse_too_many(all.elements.size(), scale * mean * std::accumulate(volumes.begin(), volumes.end(), 0.),
                  bent, 1.5);
  std::vector<bool> wanted_types(recipe.types.size());
  for (const auto& layer : recipe.layers)
    for (std::size_t type = 0; type < wanted_types.size(); ++type)
      if (layer.mix[type] > 0. && (layer.count ? *layer.count > 0 : layer.density > 0.))
        wanted_types[type] = true;
  Stock stock = stock_of(recipe, wanted_types, repo, progress);
  all.planted.unflattened = stock.unflattened;
  if (const auto bare = std::ranges::count(stock.candidates, 0.f, &circuit::Candidate::soma_radius))
    all.left_out.push_back(fmt::format("{} to choose from {} no soma of any width, which takes no room",
                                       counted(std::size_t(bare), "neuron"), bare == 1 ? "has" : "have"));
  const auto start = Clock::now();
  const circuit::ElementPlanter planter(recipe, stock.candidates, seed,
                                        {.scale = scale, .element = file.volume, .bent = bent});
  for (std::size_t l = 0; l < recipe.layers.size(); ++l)
    if (planter.left_out(l))
      all.left_out.push_back(fmt::format(
          "somata of {} are too wide for the density of layer {}, and not planted there; those that "
          "are have radii of up to {:.3g} µm",
          counted(planter.left_out(l), "neuron"), recipe.layers[l].name, planter.widest(l)));
  all.measured = measured.has_value();
  if (const std::string doubt =
          measured ? circuit::doubt_of_maps(recipe, options.layers.size()) : std::string();
      !doubt.empty())
    all.left_out.push_back(doubt);
  if (const std::string doubt = doubt_of_order(options.layers); !doubt.empty()) all.left_out.push_back(doubt);
  const auto borders_of = [&](std::uint32_t e) {
    return measured ? measured->of(file.cortex.elements, e)
                    : planter.by_volume(cortex::Layers(file.cortex.elements, e));
  };
  if (measured)
    if (const auto guessed = std::ranges::count_if(
            all.elements, [&](std::uint32_t e) { return !measured->measured(file.cortex.elements, e); }))
      all.left_out.push_back(fmt::format("{} where no layer was measured have those of the nearest place",
                                         counted(std::size_t(guessed), "element")));
  Shortage shortage(recipe.layers.size());
  all.layer_volumes.resize(recipe.layers.size());
  struct Expected {
    std::vector<std::vector<std::uint32_t>> counts;
    std::vector<double> volumes;  // of layers
  };
  parallel_in_order(
      all.elements.size(),
      [&](std::size_t i) {
        const std::uint32_t e = all.elements[i];
        const cortex::Borders borders = borders_of(e);
        Expected here{planter.counts(elements[e], e, borders), {}};
        for (std::size_t l = 0; l < recipe.layers.size(); ++l)
          here.volumes.push_back(borders.volume(elements[e], l));
        return here;
      },
      [&](std::size_t, const Expected& here) {
        shortage.expect(here.counts);
        for (std::size_t l = 0; l < recipe.layers.size(); ++l) all.layer_volumes[l] += here.volumes[l];
      });
  all.volume = std::accumulate(all.layer_volumes.begin(), all.layer_volumes.end(), 0.);
  refuse_too_many(all.elements.size(), shortage.expected(), bent);

  std::vector<circuit::Rooted> rooted;
  progress.begin("planting", all.elements.size());
  parallel_in_order(
      all.elements.size(),
      [&](std::size_t i) {
        const std::uint32_t e = all.elements[i];
        return planter.plant(elements[e], e, borders_of(e));
      },
      [&](std::size_t, const std::vector<circuit::Rooted>& here) {
        all.first.push_back(rooted.size());
        shortage.see(here);
        rooted.insert(rooted.end(), here.begin(), here.end());
        progress.advance();
      });
  progress.end();
  all.first.push_back(rooted.size());
  all.seconds = seconds_since(start);
  shortage.tell(recipe, all.left_out);
  if (!bent) tell_too_tall(rooted, stock.candidates, all.left_out);

  circuit::Circuit& circuit = all.planted.circuit;
  circuit = circuit::circuit_of(recipe, stock.candidates, all.elements, all.first, rooted);
  all.planted.morphologies = planted_of(stock, circuit);
  circuit.outline = cortex::outline(sheet, all.elements, borders_of);
  circuit.up = cortex::towards_pia(elements, all.elements);
  if (bent) bend(all, rooted, sheet, progress);
  mark_glia(all.planted);
  return all;
}

CLI::Option* add_elements(CLI::App& command, ElementOptions& o) {
  CLI::Option* const elements =
      command
          .add_option("--elements", o.file,
                      "Plant in curved elements of this file (cortex build) instead of a column")
          ->type_name("FILE.h5");
  const auto one_of_them = [&](CLI::Option* option) { return option->needs(elements); };
  CLI::Option* const element = one_of_them(
      command.add_option("--element", o.elements, "Which: their numbers in the file, 7,12,20-29, or all")
          ->type_name("LIST"));
  CLI::Option* const near =
      one_of_them(command.add_option("--near", o.near, "… those nearest to a place, µm: X Y Z")
                      ->expected(3)
                      ->type_name("X Y Z"));
  CLI::Option* const count =
      command.add_option("--count", o.count, "… so many of them")->needs(near)->capture_default_str();
  must_be_whole(*count, 1, 1'000'000);
  CLI::Option* const sphere =
      one_of_them(command.add_option("--sphere", o.sphere, "… those with their middle in a sphere, µm")
                      ->expected(4)
                      ->type_name("X Y Z R"));
  CLI::Option* const box =
      one_of_them(command.add_option("--box", o.box, "… or in a box, µm: two opposite corners")
                      ->expected(6)
                      ->type_name("X Y Z X Y Z"));
  CLI::Option* const region =
      one_of_them(command.add_option("--region", o.areas, "… or in areas of a map of labels, by their names")
                      ->type_name("NAME..."));
  CLI::Option* const labels =
      command
          .add_option(
              "--labels", o.labels,
              "… that map: areas of a surface's vertices, GIFTI (.label.gii) or FreeSurfer's (.annot)")
          ->type_name("FILE");
  CLI::Option* const labels_on =
      command
          .add_option("--labels-on", o.labels_on,
                      "… that surface: the outer one that the elements were built from")
          ->type_name("OUTER");
  region->needs(labels), labels->needs(region)->needs(labels_on), labels_on->needs(labels);
  for (CLI::Option* a : {element, region, near, sphere, box})
    for (CLI::Option* b : {element, region, near, sphere, box})
      if (a != b) a->excludes(b);
  CLI::Option* const row =
      command.add_option("--row", o.row, "So many elements in a row across the fold, through the one chosen");
  must_be_whole(*row->needs(elements), 1, 10'000);
  CLI::Option* const scale =
      command.add_option("--scale", o.scale, "Times the recipe's densities")->capture_default_str();
  must_be_within(*scale->needs(elements), 1e-6, 1e6);
  must_be_within(
      *command.add_option("--density", o.density, "Or so many neurons/mm³ in the mean over the layers")
           ->needs(elements)
           ->excludes(scale),
      1e-3, 1e8);
  CLI::Option* const layers =
      command
          .add_option(
              "--layers", o.layers,
              "Thickness of each layer at the vertices of a surface, from the pia inwards: layers end where "
              "they were measured, not by shares of volume")
          ->type_name("FILE...");
  CLI::Option* const on = command
                              .add_option("--layers-on", o.layers_on,
                                          "… that surface: the outer one that the elements were built from")
                              ->type_name("OUTER");
  one_of_them(layers)->needs(on), on->needs(layers);
  command
      .add_option("--bend", o.bend,
                  "grid: neurons are bent as their element is, each a shape of its own; rigid: they are only "
                  "turned upright")
      ->needs(elements)
      ->check(CLI::IsMember({"rigid", "grid"}))
      ->capture_default_str();
  return elements;
}

}  // namespace forest::cli
