// SPDX-License-Identifier: Apache-2.0
#include "forest/circuit/plant.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <unordered_set>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/parallel.h"
#include "forest/core/random.h"

namespace forest::circuit {
namespace {

// Streams of a neuron's random numbers, far from those of growing so that one seed may serve both.
enum Stream : std::uint32_t { morphology_stream = 0x706c0000, rotation_stream, position_stream };

constexpr int most_trials = 1000000;  // for one soma, before its layer is called full
constexpr double densest =
    .6;  // share of a layer, and of what its somata may stick out, that somata never fill

/// Spheres in a grid. A sphere is entered in every cell that its box touches, so two that overlap share a
/// cell.
class Spheres {
 public:
  Spheres(const Bounds& bounds, float cell, std::size_t count) : low_(bounds.low), scale_(1.f / cell) {
    for (int axis = 0; axis < 3; ++axis)
      size_[axis] = std::max(1, int(std::ceil(bounds.extent()[axis] * scale_)));
    first_.assign(std::size_t(size_[0]) * std::size_t(size_[1]) * std::size_t(size_[2]), none);
    spheres_.reserve(count);
    entries_.reserve(2 * count);
  }

  /// Whether a sphere here would keep `gap` to all others.
  bool free(const Vec3& centre, float radius, float gap) const {
    bool clear = true;
    for_cells(centre, radius + gap, [&](std::size_t cell) {
      for (std::uint32_t e = first_[cell]; clear && e != none; e = entries_[e].next) {
        const Vec4& other = spheres_[entries_[e].sphere];
        const float reach = radius + other.w() + gap;
        clear = (other.head<3>() - centre).squaredNorm() >= reach * reach;
      }
      return clear;
    });
    return clear;
  }

  void add(const Vec3& centre, float radius) {
    const auto sphere = std::uint32_t(spheres_.size());
    spheres_.emplace_back(centre.x(), centre.y(), centre.z(), radius);
    for_cells(centre, radius, [&](std::size_t cell) {
      entries_.push_back({sphere, first_[cell]});
      first_[cell] = std::uint32_t(entries_.size() - 1);
      return true;
    });
  }

 private:
  static constexpr std::uint32_t none = 0xffffffffu;
  struct Entry {
    std::uint32_t sphere, next;
  };

  template <class Visit>
  void for_cells(const Vec3& centre, float reach, Visit&& visit) const {
    std::array<int, 3> from, to;
    for (int axis = 0; axis < 3; ++axis) {
      const auto last = float(size_[axis] - 1);
      const auto cell = [&](float x) {
        return int(std::clamp(std::floor((x - low_[axis]) * scale_), 0.f, last));
      };
      from[std::size_t(axis)] = cell(centre[axis] - reach);
      to[std::size_t(axis)] = cell(centre[axis] + reach);
    }
    for (int z = from[2]; z <= to[2]; ++z)
      for (int y = from[1]; y <= to[1]; ++y)
        for (int x = from[0]; x <= to[0]; ++x)
          if (!visit((std::size_t(z) * std::size_t(size_[1]) + std::size_t(y)) * std::size_t(size_[0]) +
                     std::size_t(x)))
            return;
  }

  Vec3 low_;
  float scale_;
  Eigen::Vector3i size_;
  std::vector<std::uint32_t> first_;
  std::vector<Vec4> spheres_;
  std::vector<Entry> entries_;
};

double sphere_volume(double radius) { return 4. / 3. * std::numbers::pi * radius * radius * radius; }

/// As wide as a common soma, yet not so narrow that a sparse tissue has many more cells than neurons.
float cell_width(const cortex::Column& column, std::vector<float> radii, float gap) {
  std::ranges::nth_element(radii, radii.begin() + std::ptrdiff_t(radii.size() / 2));
  const Vec3 extent = column.bounds().extent();
  const double room = double(extent.x()) * double(extent.y()) * double(extent.z()) / double(radii.size());
  return std::max(2.f * radii[radii.size() / 2] + gap, float(std::cbrt(room)));
}

/// µm³ of a layer's somata, with half the gap around each.
double filled(const Recipe& recipe, std::uint32_t layer, std::span<const Instance> instances,
              std::span<const float> radii) {
  double sum = 0.;
  for (std::size_t i = 0; i < instances.size(); ++i)
    if (instances[i].layer == layer) sum += sphere_volume(double(radii[i] + recipe.soma_gap / 2.f));
  return sum;
}

[[noreturn]] void refuse_layer(const Recipe& recipe, const cortex::Column& column, std::uint32_t layer,
                               std::span<const Instance> instances, std::span<const float> radii) {
  throw Error(fmt::format(
      "the {} somata of layer {} do not fit without overlap: with their gaps they would fill {:.0f} % of it, "
      "and random packing stops at about 38 %; lower its density or the gap, or plant neurons with smaller "
      "somata",
      std::ranges::count(instances, layer, &Instance::layer), recipe.layers[layer].name,
      100. * filled(recipe, layer, instances, radii) / column.volume(layer)));
}

/// What can never fit is refused before the first soma is tried: the last ones of a full layer take minutes.
void refuse_overfull(const Recipe& recipe, const cortex::Column& column, std::span<const Instance> instances,
                     std::span<const float> radii) {
  const double widest = double(std::ranges::max(radii)), radius = double(recipe.radius) + widest;
  for (std::uint32_t layer = 0; layer < column.layers().size(); ++layer) {
    const cortex::Slab& slab = column.layers()[layer];
    const double room =
        std::numbers::pi * radius * radius * (double(slab.top) - double(slab.bottom) + 2. * widest);
    if (filled(recipe, layer, instances, radii) > densest * room)
      refuse_layer(recipe, column, layer, instances, radii);
  }
}

/// The share of a layer's depth, from below, in which a neuron of this height ends under the pia.
float share_that_fits(const cortex::Column& column, std::uint32_t layer, float height) {
  const cortex::Slab& slab = column.layers()[layer];
  const float ceiling = column.layers().front().top + pia_slack - height;
  return std::clamp((ceiling - slab.bottom) / (slab.top - slab.bottom), 0.f, 1.f);
}

/// The candidates of one type in one layer, with the chance of each.
class Lot {
 public:
  Lot(std::span<const std::uint32_t> choice, std::span<const Candidate> candidates,
      const cortex::Column& column, std::uint32_t layer)
      : choice_(choice) {
    double sum = 0.;
    for (const std::uint32_t c : choice) {
      share_.push_back(share_that_fits(column, layer, candidates[c].height));
      bounds_.push_back(sum += double(share_.back()));
    }
    if (choice.empty() || sum > 0.) return;
    const auto lowest =
        std::ranges::min_element(choice, {}, [&](std::uint32_t c) { return candidates[c].height; });
    for (std::size_t i = std::size_t(lowest - choice.begin()); i < bounds_.size(); ++i) bounds_[i] = 1.;
  }

  struct Draw {
    std::uint32_t candidate;
    float share;  // of the layer's depth in which it may stand
  };
  Draw draw(Random random) const {
    const auto chosen = std::ranges::upper_bound(bounds_, random.uniform(0., bounds_.back()));
    const auto i = std::size_t(std::min(chosen, bounds_.end() - 1) - bounds_.begin());
    return {choice_[i], share_[i]};
  }

 private:
  std::span<const std::uint32_t> choice_;
  std::vector<float> share_;
  std::vector<double> bounds_;  // sums of the chances
};

void place(const Recipe& recipe, const cortex::Column& column, std::span<const float> radii,
           std::span<const float> shares, std::uint64_t seed, std::span<Instance> instances,
           Progress& progress) {
  if (instances.empty()) return;
  refuse_overfull(recipe, column, instances, radii);
  std::vector<std::uint32_t> order(instances.size());
  std::iota(order.begin(), order.end(), 0u);
  std::ranges::stable_sort(order, std::greater{}, [&](std::uint32_t i) { return radii[i]; });

  Spheres spheres(column.bounds(), cell_width(column, {radii.begin(), radii.end()}, recipe.soma_gap),
                  instances.size());
  progress.begin("planting", instances.size());
  constexpr std::size_t step = 1024;
  for (std::size_t k = 0; k < order.size(); ++k) {
    const std::uint32_t i = order[k];
    Random random(seed, i, position_stream);
    int trial = 0;
    do {
      if (trial++ == most_trials) refuse_layer(recipe, column, instances[i].layer, instances, radii);
      const float bottom = column.layers()[instances[i].layer].bottom;
      Vec3 at = column.sample(instances[i].layer, random);
      at.y() = bottom + (at.y() - bottom) * shares[i];
      instances[i].position = at;
    } while (!spheres.free(instances[i].position, radii[i], recipe.soma_gap));
    spheres.add(instances[i].position, radii[i]);
    if (k % step == step - 1) progress.advance(step);
  }
  progress.advance(order.size() % step);
  progress.end();
}

}  // namespace

void name_morphologies(Circuit& circuit, std::span<const Candidate> candidates) {
  std::vector<std::uint32_t> number(candidates.size(), 0);
  for (const Instance& instance : circuit.instances) number[instance.morphology] = 1;
  for (std::size_t i = 0; i < candidates.size(); ++i)
    if (number[i])
      number[i] = std::uint32_t(circuit.morphologies.size()),
      circuit.morphologies.push_back(candidates[i].name);
  for (Instance& instance : circuit.instances) instance.morphology = number[instance.morphology];
}

std::vector<std::vector<std::uint32_t>> candidates_of(
    const Recipe& recipe, std::span<const Candidate> candidates,
    const std::function<bool(std::size_t type)>& is_planted) {
  std::unordered_set<std::string_view> names;
  for (const Candidate& candidate : candidates) {
    if (!names.insert(candidate.name).second)
      throw Error(fmt::format("two neurons to plant are called {}; rename one of them", candidate.name));
    if (!std::isfinite(candidate.soma_radius) || candidate.soma_radius < 0.f)
      throw Error(fmt::format("the soma of {} has a radius of {} µm; correct the neuron", candidate.name,
                              candidate.soma_radius));
    if (!std::isfinite(candidate.height))
      throw Error(fmt::format("the points of {} are not finite; correct the neuron", candidate.name));
  }
  std::vector<std::vector<std::uint32_t>> result(recipe.types.size());
  for (std::size_t type = 0; type < recipe.types.size(); ++type) {
    for (std::size_t i = 0; i < candidates.size(); ++i)
      if (candidates[i].population == recipe.types[type].population) result[type].push_back(std::uint32_t(i));
    if (result[type].empty() && is_planted(type))
      throw Error(
          fmt::format("neurons of type {} are to be planted, but population {} is empty; grow or import "
                      "neurons into it first",
                      recipe.types[type].name, recipe.types[type].population));
  }
  return result;
}

std::vector<TooTall> too_tall(const Recipe& recipe, std::span<const Candidate> candidates) {
  const auto wanted = counts(recipe);
  const auto choice = candidates_of(recipe, candidates, [](std::size_t) { return false; });
  const cortex::Column tissue = column(recipe);
  std::vector<TooTall> found;
  for (std::uint32_t type = 0; type < choice.size(); ++type) {
    std::vector<std::uint32_t> layers;  // in which it is planted
    for (std::uint32_t layer = 0; layer < wanted.size(); ++layer)
      if (wanted[layer][type]) layers.push_back(layer);
    if (layers.empty()) continue;
    const auto tall = std::ranges::count_if(choice[type], [&](std::uint32_t c) {
      return std::ranges::none_of(layers, [&](std::uint32_t layer) {
        return share_that_fits(tissue, layer, candidates[c].height) > 0.f;
      });
    });
    if (tall) found.push_back({type, std::size_t(tall), choice[type].size()});
  }
  return found;
}

Circuit plant(const Recipe& recipe, std::span<const Candidate> candidates, std::uint64_t seed,
              Progress& progress) {
  check(recipe);
  const auto wanted = counts(recipe);
  const auto choice = candidates_of(recipe, candidates, [&](std::size_t type) {
    return std::ranges::any_of(wanted, [&](const auto& layer) { return layer[type] > 0; });
  });
  const cortex::Column tissue = column(recipe);

  Circuit circuit{.name = recipe.name,
                  .layers = {},
                  .types = recipe.types,
                  .morphologies = {},
                  .instances = {},
                  .radius = recipe.radius};
  for (const cortex::Slab& slab : tissue.layers())
    circuit.layers.push_back({slab.name, slab.bottom, slab.top});
  for (std::uint32_t layer = 0; layer < wanted.size(); ++layer)
    for (std::uint32_t type = 0; type < wanted[layer].size(); ++type)
      circuit.instances.insert(circuit.instances.end(), wanted[layer][type],
                               Instance{.type = type, .layer = layer});

  std::vector<std::vector<Lot>> lots(wanted.size());  // by layer and type
  for (std::uint32_t layer = 0; layer < wanted.size(); ++layer)
    for (std::uint32_t type = 0; type < wanted[layer].size(); ++type)
      lots[layer].emplace_back(choice[type], candidates, tissue, layer);
  std::vector<float> radii(circuit.instances.size()), shares(circuit.instances.size());
  parallel_for(circuit.instances.size(), 4096, [&](std::size_t i) {
    Instance& instance = circuit.instances[i];
    const Lot::Draw draw = lots[instance.layer][instance.type].draw(Random(seed, i, morphology_stream));
    instance.morphology = draw.candidate;
    shares[i] = draw.share > 0.f ? draw.share : 1.f;
    radii[i] = candidates[instance.morphology].soma_radius;
    if (recipe.rotate) {
      const double angle = Random(seed, i, rotation_stream).uniform(0., 2. * std::numbers::pi);
      instance.orientation =
          Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY())).cast<float>();
    }
  });
  place(recipe, tissue, radii, shares, seed, circuit.instances, progress);
  name_morphologies(circuit, candidates);
  return circuit;
}

}  // namespace forest::circuit
