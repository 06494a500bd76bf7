// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/gauge.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "forest/core/half.h"
#include "forest/core/parallel.h"

namespace forest::scene {
namespace {

struct Quantity {
  ColourBy by;
  const char *title, *unit;
  bool whole;
  float most;  // share of the length of all branches that lies within the range
  float (*at)(const SectionFacts& section, float position, float radius);
};
constexpr Quantity quantities[] = {
    {ColourBy::order, "branch order", "", true, 1.f,
     [](const SectionFacts& section, float, float) { return float(section.order); }},
    {ColourBy::radius, "radius", "µm", false, .98f,
     [](const SectionFacts&, float, float radius) { return radius; }},
    {ColourBy::distance, "distance from the soma", "µm", false, 1.f,
     [](const SectionFacts& section, float position, float) {
       return std::max(0.f, section.path_distance - (1.f - position) * section.length);
     }},
};

// A neuron's segments, and what the quantity is at the middle of each: negative for the soma.
class Measured {
 public:
  Measured(const Forest& forest, const Neuron& neuron, const Quantity& quantity)
      : facts_(forest.sections().subspan(neuron.first_section, neuron.section_count)),
        places_(forest.places().subspan(neuron.first_segment, end_of(forest, neuron) - neuron.first_segment)),
        originals_(forest.segments().subspan(neuron.first_segment, neuron.original_count)),
        quantity_(quantity),
        begin_(facts_.size()),
        end_(facts_.size()) {
    for (std::uint32_t i = 0; i < originals_.size(); ++i) {
      const std::uint32_t section = places_[i].section;
      if (section >= facts_.size()) continue;
      if (end_[section] == 0) begin_[section] = i;
      end_[section] = i + 1;
    }
  }

  std::size_t size() const { return places_.size(); }
  float operator[](std::size_t segment) const {
    const auto [section, position] = places_[segment];
    return section < facts_.size() ? quantity_.at(facts_[section], position, radius(section, position))
                                   : -1.f;
  }
  /// Of an original one, µm.
  float length(std::size_t segment) const {
    const frame::Segment& s = originals_[segment];
    return std::hypot(s.bx - s.ax, s.by - s.ay, s.bz - s.az);
  }
  std::size_t original_count() const { return originals_.size(); }

 private:
  // Of the original segment whose middle is nearest.
  float radius(std::uint32_t section, float position) const {
    if (begin_[section] == end_[section]) return .5f * facts_[section].diameter_start;
    const auto run = places_.subspan(begin_[section], end_[section] - begin_[section]);
    auto at = std::ranges::lower_bound(run, position, {}, &reports::Place::position);
    if (at == run.end() ||
        (at != run.begin() && position - std::prev(at)->position < at->position - position))
      --at;
    const std::uint32_t radii = originals_[begin_[section] + std::size_t(at - run.begin())].radii;
    return .5f * (from_half(radii & 0xffffu) + from_half(radii >> 16));
  }

  std::span<const SectionFacts> facts_;
  std::span<const reports::Place> places_;
  std::span<const frame::Segment> originals_;
  const Quantity& quantity_;
  std::vector<std::uint32_t> begin_, end_;  // of each section, its original segments
};

// The least number of two digits that is no less.
float rounded_up(float value) {
  const double step = std::pow(10., std::floor(std::log10(double(value))) - 1.);
  return float(step * std::ceil(double(value) / step * (1. - 1e-6)));
}

// Below which a share of all the lengths lies.
float quantile(std::span<const std::pair<float, float>> values_and_lengths, float share) {
  constexpr std::size_t bins = 4096;
  float most = 0.f;
  double all = 0., below = 0.;
  for (const auto& [value, length] : values_and_lengths) most = std::max(most, value), all += double(length);
  if (share >= 1.f || !(most > 0.f)) return most;
  std::array<double, bins> lengths{};
  for (const auto& [value, length] : values_and_lengths)
    lengths[std::min(bins - 1, std::size_t(std::max(0.f, value) / most * float(bins)))] += double(length);
  for (std::size_t i = 0; i < bins; ++i)
    if ((below += lengths[i]) >= double(share) * all) return most * float(i + 1) / float(bins);
  return most;
}

}  // namespace

bool is_gauged(ColourBy by) { return std::ranges::count(quantities, by, &Quantity::by) > 0; }

Gauge gauge_of(const Forest& forest, ColourBy by) {
  const Quantity& quantity = *std::ranges::find(quantities, by, &Quantity::by);
  Gauge gauge{quantity.by, quantity.title, quantity.unit, quantity.whole, 1.f, false, {}};
  const auto neurons = forest.neurons();
  std::vector<float> value(forest.places().size(), -1.f);
  std::vector<std::vector<std::pair<float, float>>> of_neurons(neurons.size());
  parallel_for(neurons.size(), 1, [&](std::size_t n) {
    const Measured measured(forest, neurons[n], quantity);
    for (std::size_t i = 0; i < measured.size(); ++i) value[neurons[n].first_segment + i] = measured[i];
    for (std::size_t i = 0; i < measured.original_count(); ++i)
      if (const float v = measured[i]; v >= 0.f) of_neurons[n].emplace_back(v, measured.length(i));
  });
  std::vector<std::pair<float, float>> all;
  for (const auto& of : of_neurons) all.insert(all.end(), of.begin(), of.end());
  const float most = quantile(all, 1.f), high = quantile(all, quantity.most);
  if (high > 0.f) gauge.high = quantity.whole ? high : rounded_up(high);
  gauge.above = most > gauge.high;
  gauge.step.resize(value.size(), Gauge::none);
  for (std::size_t i = 0; i < value.size(); ++i)
    if (value[i] >= 0.f)
      gauge.step[i] =
          std::uint8_t(std::lround(std::min(value[i] / gauge.high, 1.f) * float(Gauge::steps - 1)));
  return gauge;
}

const ColourMap& gauge_map(Background background) {
  constexpr std::size_t count = 17;
  struct Cropped {
    std::array<std::uint32_t, count> points{};
    ColourMap map{"", "", {}};

    Cropped(float from, float to) {
      const ColourMap& whole = *find_colour_map("viridis");
      for (std::size_t i = 0; i < count; ++i) {
        const Vec3 c = 255.f * whole.screen(from + (to - from) * float(i) / float(count - 1));
        points[i] = std::uint32_t(std::lround(c.x())) << 16 | std::uint32_t(std::lround(c.y())) << 8 |
                    std::uint32_t(std::lround(c.z()));
      }
      map = {whole.name, whole.source, points};
    }
  };
  static const Cropped on_dark(.2f, 1.f), on_light(0.f, .86f);
  return background == Background::dark ? on_dark.map : on_light.map;
}

Vec3 gauge_soma(Background background) {
  return light_of(background == Background::dark ? 0xC9CFD8 : 0x6B7480);
}

void paint(const Forest& forest, const Colouring& colouring, Cut& cut) {
  const frame::Geometry geometry = forest.geometry();
  Cut::Entries& entries = cut.entries.emplace();
  const auto paint_list = [&](std::span<const frame::Item> list, std::size_t each,
                              std::vector<std::uint8_t>& out) {
    out.assign(list.size() * each, 0);
    parallel_for(list.size(), 512, [&](std::size_t i) {
      const frame::Item& item = list[i];
      const bool straws = geometry.straw(item);
      for (std::uint32_t drawn = item.drawn; drawn; drawn &= drawn - 1) {
        const auto at = std::uint32_t(std::countr_zero(drawn)), segment = item.first_segment + at;
        const frame::Owner owner = straws ? geometry.owner(segment) : frame::Owner{item.instance, segment};
        const frame::State state =
            item.state ? frame::unpacked(item.state) : colouring.states[owner.instance];
        out[i * each + (each == 1 ? 0 : at)] =
            colouring.entry(state, owner.segment, geometry.segments[segment].meta & 7u);
      }
    });
  };
  paint_list(cut.dots, 1, entries.dots);
  paint_list(cut.lines, frame::cluster_size, entries.lines);
  paint_list(cut.capsules, frame::cluster_size, entries.capsules);
}

}  // namespace forest::scene
