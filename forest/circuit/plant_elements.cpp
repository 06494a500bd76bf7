// SPDX-License-Identifier: Apache-2.0
#include "forest/circuit/plant_elements.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include <Eigen/LU>
#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/parallel.h"
#include "forest/core/random.h"
#include "forest/cortex/warp.h"

namespace forest::circuit {
namespace {

// Streams of the packings, of which each layer has its own, of the places in them, and of how many an element has.
constexpr std::uint32_t packing_stream = 0x70650000, lot_stream = 0x70651000, cell_stream = 0x70652000,
                        count_stream = 0x70653000;

constexpr double rounding = .02;  // µm that places may be off, as single precision is in a head
constexpr double at_ease =
    .95;  // so many mean distances wide are the widest somata that are taken where narrower ones are at hand
constexpr double few =
    300.;  // an element has at least so many places in a layer, that small ones have some, too
constexpr double evenness = .8;  // at least this times their mean distance keep the places of a packing apart

/// Neurons/mm³ of each layer. Counts hold in the recipe's column.
std::vector<double> densities_of(const Recipe& recipe) {
  const bool counted =
      recipe.neurons || std::ranges::any_of(recipe.layers, [](const auto& l) { return l.count.has_value(); });
  std::vector<double> densities;
  if (!counted) {
    for (const Recipe::Layer& layer : recipe.layers) densities.push_back(layer.density);
    return densities;
  }
  const auto wanted = counts(recipe);
  const cortex::Column tissue = column(recipe);
  for (std::size_t l = 0; l < wanted.size(); ++l)
    densities.push_back(std::accumulate(wanted[l].begin(), wanted[l].end(), 0.) / (tissue.volume(l) * 1e-9));
  return densities;
}

}  // namespace

// A place in an element, and what lies around it.
struct ElementPlanter::Spot {
  const cortex::Hexahedron& element;
  const cortex::Borders& borders;
  const Eigen::Vector3d& uvw;
  cortex::Linear here = linear(element, uvw);
  Eigen::Matrix3d to_uvw = here.jacobian.inverse();

  // How far it is above (> 0) or below a border between layers, µm, if that goes on from here as it does within `near`. Farther
  // ones are not known well. `border(u, v)` is its w.
  template <class Border>
  double above(Border&& border, double near) const {
    const double at = border(uvw[0], uvw[1]), level = (at - uvw[2]) / to_uvw.row(2).norm();
    if (std::abs(level) > 20. * near) return level;
    Eigen::RowVector3d gradient = to_uvw.row(2);
    for (const Eigen::Index a : {0, 1}) {
      const double step = std::min(.2, near * to_uvw.row(a).norm());
      double slope = 0.;
      for (double to : {uvw[a] - step, uvw[a] + step}) {
        to = std::clamp(to, 0., 1.);
        const double here_and_there = border(a == 0 ? to : uvw[0], a == 1 ? to : uvw[1]) - at;
        if (std::abs(here_and_there) > std::abs(slope * (to - uvw[a])))
          slope = here_and_there / (to - uvw[a]);
      }
      gradient -= slope * to_uvw.row(a);
    }
    return (at - uvw[2]) / gradient.norm();
  }

  // Whether something within so many µm may be in another element.
  bool by_a_side(double distance) const {
    for (const Eigen::Index a : {0, 1})
      if (std::min(uvw[a], 1. - uvw[a]) < distance * to_uvw.row(a).norm()) return true;
    return false;
  }

  // Whether a place not far away is in a layer.
  bool sees_in(std::size_t layer, const Eigen::Vector3d& place) const {
    Eigen::Vector3d there = uvw + to_uvw * (place - here.at);
    for (int round = 0; round < 2; ++round) {
      const cortex::Linear at = linear(element, there);
      there += at.jacobian.inverse() * (place - at.at);
    }
    const double u = std::clamp(there[0], 0., 1.), v = std::clamp(there[1], 0., 1.);
    return there[2] >= borders.begin(u, v, layer) && there[2] < borders.end(u, v, layer);
  }
};

double mean_density(const Recipe& recipe, std::span<const double> volumes) {
  const auto densities = densities_of(recipe);
  return std::inner_product(densities.begin(), densities.end(), volumes.begin(), 0.) /
         std::accumulate(volumes.begin(), volumes.end(), 0.);
}

double mean_density(const Recipe& recipe) {
  std::vector<double> thickness;
  for (const Recipe::Layer& layer : recipe.layers) thickness.push_back(double(layer.thickness));
  return mean_density(recipe, thickness);
}

ElementPlanter::ElementPlanter(const Recipe& recipe, std::span<const Candidate> candidates,
                               std::uint64_t seed, const ElementPlanting& options)
    : recipe_(recipe), candidates_(candidates), seed_(seed), bent_(options.bent) {
  check(recipe);
  if (!(options.scale > 0. && std::isfinite(options.scale)))
    throw Error(fmt::format("densities cannot be scaled by {}; give a positive number", options.scale));
  const std::size_t layers = recipe.layers.size();
  const double height = double(slabs(recipe).front().top);
  double depth = 0.;
  for (const Recipe::Layer& layer : recipe.layers)
    depths_.push_back(depth += double(layer.thickness) / height);
  depths_.back() = 1.;
  densities_ = densities_of(recipe);
  for (double& density : densities_) density *= options.scale;
  const auto grows = [&](std::size_t layer, std::size_t type) {
    return densities_[layer] > 0. && recipe.layers[layer].mix[type] > 0.;
  };

  const auto of_type = candidates_of(recipe, candidates, [&](std::size_t type) {
    for (std::size_t l = 0; l < layers; ++l)
      if (grows(l, type)) return true;
    return false;
  });
  const auto radius = [&](std::uint32_t c) { return double(candidates[c].soma_radius); };

  // A fifth more places than are wanted, and some standard deviations where they are few; fewer where somata hardly fit.
  double spacing = evenness;
  std::vector<double> supply(layers);  // places/µm³
  radii_.assign(layers, 0.), narrow_.assign(layers, 0.), left_out_.assign(layers, 0);
  choices_.assign(layers, std::vector<std::vector<std::uint32_t>>(recipe.types.size()));
  for (std::size_t l = 0; l < layers; ++l) {
    if (!(densities_[l] > 0.)) continue;
    const double volume = (depths_[l] - (l ? depths_[l - 1] : 0.)) * options.element,
                 density = densities_[l] * 1e-9, usual = density * volume;
    const double gap = double(recipe.soma_gap) + rounding;
    double needed = 0.;  // the widest of the types' narrowest somata
    for (std::size_t t = 0; t < of_type.size(); ++t)
      if (grows(l, t)) needed = std::max(needed, radius(*std::ranges::min_element(of_type[t], {}, radius)));
    narrow_[l] = needed;
    const double most = std::pow(cortex::PackedCube::most_spacing / (2. * needed + gap), 3.);
    supply[l] = std::min(std::max(1.2 * usual + 4. * std::sqrt(usual) + 10., few) / volume, most);
    if (supply[l] < 1.01 * density)
      throw Error(
          fmt::format("{:.0f} somata/mm³ of a radius of {:.3g} µm or more do not fit into layer {} without "
                      "overlap, {:.0f} are the "
                      "most; lower its density or the gap, or plant neurons with smaller somata",
                      densities_[l], needed, recipe.layers[l].name, most * 1e9 / 1.01));
    const double widest = std::max(needed, .5 * (at_ease / std::cbrt(supply[l]) - gap));
    for (std::size_t t = 0; t < of_type.size(); ++t) {
      if (!grows(l, t)) continue;
      for (const std::uint32_t c : of_type[t]) {
        if (radius(c) <= widest)
          choices_[l][t].push_back(c), radii_[l] = std::max(radii_[l], radius(c));
        else
          ++left_out_[l];
      }
    }
    for (auto& choice : choices_[l])
      std::ranges::stable_sort(choice, {}, [&](std::uint32_t c) { return candidates[c].height; });
    spacing = std::max(
        spacing, std::min((2. * radii_[l] + gap) * std::cbrt(supply[l]), cortex::PackedCube::most_spacing));
  }
  const auto cube = std::make_shared<const cortex::PackedCube>(cortex::pack_cube(spacing, seed));
  packings_.resize(layers), sparser_.resize(layers);
  for (std::size_t l = 0; l < layers; ++l) {
    if (!(supply[l] > 0.)) continue;
    packings_[l].emplace(cube, supply[l], seed, packing_stream + std::uint32_t(l));
    for (std::size_t other = 0; other < layers; ++other)
      if (supply[other] > 0. && std::pair(supply[other], other) < std::pair(supply[l], l))
        sparser_[l].push_back(std::uint32_t(other));
  }
}

std::vector<std::vector<std::uint32_t>> ElementPlanter::counts(const cortex::Hexahedron& element,
                                                               std::size_t number,
                                                               const cortex::Borders& borders) const {
  std::vector<double> expected;  // of all types of the first layer, then of the next
  for (std::size_t l = 0; l < depths_.size(); ++l) {
    const double here =
        densities_[l] > 0. ? std::max(0., densities_[l] * 1e-9 * borders.volume(element, l)) : 0.;
    for (const double share : recipe_.layers[l].mix) expected.push_back(here * share);
  }
  const double sum = std::accumulate(expected.begin(), expected.end(), 0.);
  if (!(sum < 4e9))
    throw Error(fmt::format("an element of {:.3g} neurons is too large; lower the densities", sum));
  const auto flat = apportion_by_lot(expected, Random(seed_, number, count_stream).uniform());
  std::vector<std::vector<std::uint32_t>> result;
  auto next = flat.begin();
  for (const Recipe::Layer& layer : recipe_.layers) {
    result.emplace_back(next, next + std::ptrdiff_t(layer.mix.size()));
    next += std::ptrdiff_t(layer.mix.size());
  }
  return result;
}

// How wide a soma may be at a place: below 0 where none may stand. By the borders of layers somata are narrow and keep clear of
// the narrow ones beyond, of any place there, taken or not; wide ones stay away from a border by as much as those may reach across it.
double ElementPlanter::room_for_soma(std::size_t layer, const Spot& spot) const {
  const double narrow = narrow_[layer], below_pia = spot.uvw[2] * spot.here.jacobian.col(2).norm();
  if (below_pia < narrow) return -1.;
  const double gap = double(recipe_.soma_gap) + rounding, reach = *std::ranges::max_element(narrow_) + gap;
  const auto below_begin = [&](std::size_t of) {
    return -spot.above([&](double u, double v) { return spot.borders.begin(u, v, of); }, reach);
  };
  const auto above_end = [&](std::size_t of) {
    return spot.above([&](double u, double v) { return spot.borders.end(u, v, of); }, reach);
  };
  // A border may be nearer than it looks from here, most of all in the next element.
  const double straight = spot.by_a_side(radii_[layer] + reach) ? .6 : .8;
  double room = std::min(radii_[layer], below_pia);
  if (layer > 0) room = std::min(room, straight * below_begin(layer) - reach);
  if (layer + 1 < depths_.size()) room = std::min(room, straight * above_end(layer) - reach);
  for (const std::uint32_t other : sparser_[layer]) {
    const double contact = narrow + narrow_[other] + gap;
    if (straight * (other < layer ? -above_end(other) : -below_begin(other)) >= contact) continue;
    // Where the next element may begin, all places count, in whichever layer they are.
    const bool all = spot.by_a_side(contact);
    bool touched = false;
    packings_[other]->for_near(spot.here.at, contact, [&](std::uint64_t, const Eigen::Vector3d& place) {
      touched = touched || ((place - spot.here.at).squaredNorm() < contact * contact &&
                            (all || spot.sees_in(other, place)));
    });
    if (touched) return -1.;
  }
  return std::max(room, narrow);
}

// Of a type's candidates with a soma that fits one that ends under the pia, or the lowest one.
std::uint32_t ElementPlanter::choose(std::span<const std::uint32_t> choice, double height, double radius,
                                     Random& random) const {
  const auto fits = [&](std::uint32_t c) { return double(candidates_[c].soma_radius) <= radius; };
  const auto end = std::ranges::upper_bound(choice, height, {},
                                            [&](std::uint32_t c) { return double(candidates_[c].height); });
  const auto low = choice.first(std::size_t(end - choice.begin()));
  for (int trial = 0; trial < 16 && !low.empty(); ++trial)
    if (const std::uint32_t c = low[random.below(std::uint32_t(low.size()))]; fits(c)) return c;
  return *std::ranges::find_if(choice, fits);  // the narrowest one fits everywhere
}

std::vector<Rooted> ElementPlanter::plant(const cortex::Hexahedron& element, std::size_t number,
                                          const cortex::Borders& borders) const {
  auto wanted = counts(element, number, borders);
  std::vector<Rooted> rooted;
  for (std::size_t l = 0; l < wanted.size(); ++l) {
    std::size_t count = std::accumulate(wanted[l].begin(), wanted[l].end(), std::size_t(0));
    if (!count) continue;
    const auto [first_w, last_w] = borders.range(l);
    auto places = cortex::places_in(*packings_[l], element, first_w, last_w);
    std::erase_if(places, [&](const cortex::Packed& p) {
      const double u = p.uvw[0], v = p.uvw[1], w = p.uvw[2];
      return w < borders.begin(u, v, l) || w >= borders.end(u, v, l);
    });
    // Places by lot, as many as are wanted; those too near to the pia or to another layer are passed over.
    std::vector<Keyed> lots(places.size());
    parallel_for(places.size(), 1024, [&](std::size_t i) {
      Random random(seed_, places[i].item, lot_stream + std::uint32_t(l));
      const std::uint64_t high = random();
      lots[i] = {high << 31 | random() >> 1, i};
    });
    parallel_sort(lots);
    struct Free {
      std::size_t place;
      double room;  // µm
    };
    std::vector<Free> free;
    for (std::size_t drawn = 0; drawn < lots.size() && free.size() < count;) {
      std::vector<double> rooms(std::min(lots.size() - drawn, (count - free.size()) * 5 / 4 + 8));
      parallel_for(rooms.size(), 256, [&](std::size_t i) {
        rooms[i] = room_for_soma(l, {element, borders, places[lots[drawn + i].second].uvw});
      });
      for (const double room : rooms) {
        if (room >= 0. && free.size() < count) free.push_back({lots[drawn].second, room});
        ++drawn;
      }
    }
    if (free.size() < count) {  // the same share of all types
      std::size_t before = 0;
      for (std::uint32_t& of_type : wanted[l]) {
        const std::size_t from = before * free.size() / count, to = (before + of_type) * free.size() / count;
        before += of_type, of_type = std::uint32_t(to - from);
      }
      count = free.size();
    }
    const std::size_t begin = rooted.size();
    for (std::uint32_t type = 0; type < wanted[l].size(); ++type)
      rooted.resize(rooted.size() + wanted[l][type], Rooted{.type = type, .layer = std::uint32_t(l)});
    parallel_for(count, 1024, [&](std::size_t i) {
      const cortex::Packed& place = places[free[i].place];
      Rooted& neuron = rooted[begin + i];
      const cortex::Linear here = linear(element, place.uvw);
      Random random(seed_, place.item, cell_stream + std::uint32_t(l));
      neuron.uvw = place.uvw;
      neuron.turn = recipe_.rotate ? random.uniform(0., 2. * std::numbers::pi) : 0.;
      neuron.position = here.at.cast<float>();
      neuron.depth = float(cortex::below_outer_face(element, place.uvw));
      neuron.orientation = Eigen::Quaterniond(cortex::axes(here.jacobian, neuron.turn)).cast<float>();
      const double height = bent_ ? place.uvw[2] * here.jacobian.col(2).norm() : double(neuron.depth);
      neuron.candidate = choose(choices_[l][neuron.type], height, free[i].room, random);
    });
  }
  return rooted;
}

Circuit circuit_of(const Recipe& recipe, std::span<const Candidate> candidates,
                   std::span<const std::uint32_t> elements, std::span<const std::size_t> first,
                   std::span<const Rooted> rooted) {
  Circuit circuit;
  circuit.name = recipe.name, circuit.types = recipe.types;
  for (const auto& layer : recipe.layers) circuit.layers.push_back({layer.name, 0.f, 0.f});
  std::vector<std::pair<float, float>> reach(circuit.layers.size(), {INFINITY, -INFINITY});
  for (const Rooted& r : rooted) {
    circuit.instances.push_back({r.position, r.orientation, r.candidate, r.type, r.layer});
    auto& [low, high] = reach[r.layer];
    low = std::min(low, r.position.y()), high = std::max(high, r.position.y());
  }
  name_morphologies(circuit, candidates);
  for (std::size_t e = 0; e < elements.size(); ++e)
    for (std::size_t i = first[e]; i < first[e + 1]; ++i)
      circuit.in_elements.push_back({elements[e], rooted[i].uvw.cast<float>(), rooted[i].depth});
  for (std::size_t l = 0; l < reach.size(); ++l)
    if (reach[l].first <= reach[l].second)
      circuit.layers[l].bottom = reach[l].first, circuit.layers[l].top = reach[l].second;
  return circuit;
}

}  // namespace forest::circuit
