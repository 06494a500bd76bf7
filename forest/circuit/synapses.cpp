// SPDX-License-Identifier: Apache-2.0
#include "forest/circuit/synapses.h"

#include <algorithm>
#include <array>
#include <numeric>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/parallel.h"
#include "forest/core/random.h"
#include "forest/morphology/measure.h"

namespace forest::circuit {
namespace {

constexpr std::uint32_t stream = 11;  // of chance
constexpr std::uint64_t most = std::uint64_t(1) << 31;

// Where synapses may sit on one morphology.
class Places {
 public:
  struct Place {
    std::uint32_t section = 0;
    float position = 0.f;  // along it, 0 to 1
    double path = 0.;      // from the soma, µm
    const Spine* spine = nullptr;
  };

  explicit Places(const Morphology& m) : m_(m), element_(m.sections().size()), starts_(m.sections().size()) {
    std::vector<std::uint32_t> order(m.sections().size());
    std::iota(order.begin(), order.end(), 0u);
    std::ranges::stable_sort(order, {}, [&](std::uint32_t s) { return element_rank(m.sections()[s].kind); });
    for (std::size_t i = 0; i < order.size(); ++i) element_[order[i]] = std::int32_t(i + 1);
    const std::vector<double> ends = path_distances(m);
    for (std::uint32_t s = 0; s < order.size(); ++s) {
      const double length = section_length(m, SectionId(s));
      lengths_.push_back(length);
      starts_[s] = ends[s] - length;
      const SectionKind kind = m.sections()[s].kind;
      const bool dendrite = kind != SectionKind::axon && kind != SectionKind::glia;
      total_ += dendrite ? length : 0.;
      until_.push_back(total_);
    }
    for (const Spine& spine : m.spines())
      if (lengths_[spine.section.value()] > 0.) spines_.push_back(&spine);
  }

  bool empty() const { return !(total_ > 0.); }
  std::int32_t element(std::uint32_t section) const { return element_[section]; }

  Place along(Random& random) const {
    const double at = random.uniform() * total_;
    const auto s =
        std::min(std::size_t(std::ranges::upper_bound(until_, at) - until_.begin()), until_.size() - 1);
    const double way = std::clamp(at - (until_[s] - lengths_[s]), 0., lengths_[s]);
    return {std::uint32_t(s), float(way / lengths_[s]), starts_[s] + way, nullptr};
  }
  Place excitatory(Random& random) const {
    if (spines_.empty()) return along(random);
    const Spine& spine = *spines_[random.below(std::uint32_t(spines_.size()))];
    const std::uint32_t s = spine.section.value();
    const float share = std::clamp(float(double(spine.position) / lengths_[s]), 0.f, 1.f);
    return {s, share, starts_[s] + double(spine.position), &spine};
  }
  Place inhibitory(Random& random) const {
    const std::array three{along(random), along(random), along(random)};
    return *std::ranges::min_element(three, {}, &Place::path);
  }

  // The axis there.
  Vec3 point(const Place& place) const {
    const auto points = m_.points(SectionId(place.section));
    double way = double(place.position) * lengths_[place.section];
    for (std::size_t i = 1; i < points.size(); ++i) {
      const double length = segment_length(points[i - 1], points[i]);
      if (way <= length && length > 0.)
        return points[i - 1].position() +
               float(way / length) * (points[i].position() - points[i - 1].position());
      way -= length;
    }
    return points.back().position();
  }

 private:
  const Morphology& m_;
  std::vector<std::int32_t> element_;
  std::vector<double> starts_, lengths_, until_;  // µm from the soma; of each; of all dendrites to its end
  std::vector<const Spine*> spines_;
  double total_ = 0.;
};

}  // namespace

std::string_view name_of(Sign sign) {
  constexpr std::array<std::string_view, 3> names{"unknown", "excitatory", "inhibitory"};
  return names[std::size_t(sign)];
}

Projection made_up_synapses(const Circuit& circuit, std::span<const Morphology> morphologies,
                            const std::string& population, std::uint32_t each, std::uint64_t seed,
                            Progress& progress) {
  const std::size_t count = circuit.instances.size();
  if (morphologies.size() != circuit.morphologies.size())
    throw Error(fmt::format("a circuit of {} morphologies was given {} of them; give one for each name",
                            circuit.morphologies.size(), morphologies.size()));
  if (std::uint64_t(each) * count > most)
    throw LimitError(
        fmt::format("{} synapses on each of {} neurons are more than {}; ask for fewer", each, count, most));
  Projection made{fmt::format("{0}__{0}__{1}", population, made_up_word), population, population, {}};
  const auto is_glia = [&](std::size_t i) { return circuit.types[circuit.instances[i].type].glia; };
  std::vector<std::uint32_t> neurons;
  for (std::uint32_t i = 0; i < count; ++i)
    if (!is_glia(i)) neurons.push_back(i);
  if (neurons.size() < 2 || each == 0) return made;
  std::vector<Places> places;
  places.reserve(morphologies.size());
  for (const Morphology& m : morphologies) places.emplace_back(m);
  std::vector<std::size_t> first(count + 1);
  for (std::size_t i = 0; i < count; ++i)
    first[i + 1] = first[i] + (is_glia(i) || places[circuit.instances[i].morphology].empty() ? 0 : each);
  made.synapses.resize(first.back());
  progress.begin("making up synapses", count);
  parallel_for(count, 64, [&](std::size_t target) {
    const Instance& instance = circuit.instances[target];
    const Places& of = places[instance.morphology];
    Random random(seed, target, stream);
    for (std::size_t i = first[target]; i < first[target + 1]; ++i) {
      std::uint32_t source = neurons[random.below(std::uint32_t(neurons.size() - 1))];
      if (source >= target) source = *std::ranges::upper_bound(neurons, source);  // nobody contacts itself
      const bool excitatory = circuit.types[circuit.instances[source].type].excitatory;
      const Places::Place place = excitatory ? of.excitatory(random) : of.inhibitory(random);
      Synapse& s = made.synapses[i];
      s.target = std::uint32_t(target);
      s.source = s.neuron = source;
      s.element = of.element(place.section);
      s.position = place.position;
      s.sign = excitatory ? Sign::excitatory : Sign::inhibitory;
      if (place.spine)
        s.surface = instance.position + instance.orientation * (of.point(place) + place.spine->head);
    }
    progress.advance();
  });
  progress.end();
  return made;
}

}  // namespace forest::circuit
