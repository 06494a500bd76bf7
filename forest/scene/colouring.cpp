// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/colouring.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>
#include <span>
#include <string_view>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/srgb.h"
#include "forest/scene/gallery.h"
#include "forest/scene/gauge.h"
#include "forest/scene/view.h"

namespace forest::scene {
namespace {

constexpr std::size_t most_hues = 60'000, most_rows = 250;
constexpr std::size_t depth_steps = 10;
constexpr std::uint32_t grey = 0xBBBBBB;

// Okabe & Ito (2008), safe for colour-blind eyes, ordered so that neighbours contrast; then lighter companions.
constexpr std::array<std::uint32_t, 14> categorical{0xE69F00, 0x56B4E9, 0x009E73, 0xF0E442, 0xCC79A7,
                                                    0x0072B2, 0xD55E00, 0xFFD180, 0xA6DCFF, 0x7FD8B8,
                                                    0xE8B4D2, 0x7FB3DF, 0xF7A072, 0xBBBBBB};
// Ramps from the pia down, one a type: warm, blue, green, violet, grey. Each keeps to one family of hues and grows darker,
// so that types and layers can both be told, by colour-blind eyes too.
constexpr std::array<std::array<std::uint32_t, 3>, 5> ramps{{{0xFFE08A, 0xF28E2B, 0xC8385A},
                                                             {0x86C5F4, 0x4A9DE6, 0x2F6FD0},
                                                             {0x86D9B6, 0x2FBF8F, 0x0E8F6E},
                                                             {0xF4F1FF, 0xDCCBFA, 0xB9A2EE},
                                                             {0xE8E8E8, 0xBBBBBB, 0x909090}}};
// Of glia, which no neuron has: olive, rose, tan.
constexpr std::array<std::array<std::uint32_t, 3>, 3> glial{
    {{0xE3EDA4, 0xB4CC5C, 0x84A03C}, {0xF6CFE0, 0xD98CB3, 0xA8557F}, {0xE6D3B8, 0xC2A27A, 0x8C6B46}}};
// Layers from the pia down: seven steps of viridis (Smith & van der Walt 2015), perceptually even.
constexpr std::array<std::uint32_t, 7> layered{0xFDE725, 0x90D743, 0x35B779, 0x21918C,
                                               0x31688E, 0x5A5AA8, 0x8E4A9E};

// The colours neuroanatomists know: soma black or white, axon blue, basal red, apical magenta.
constexpr std::array<std::uint32_t, 8> anatomical{0x999999, 0xF0E442, 0x4A9DE6, 0xD55E00,
                                                  0xCC79A7, 0x009E73, 0xA6DCFF, 0x7FD8B8};

// How a section kind changes the colour of its neuron: somata brighter, axons cooler and dimmer.
Vec3 of_kind(const Vec3& base, std::uint32_t kind, float lift) {
  switch (kind) {
    case 1:
      return (base * 1.35f + Vec3::Constant(.10f * lift)).cwiseMin(1.f);
    case std::uint32_t(SectionKind::axon):
      return .55f * (.6f * base + .4f * light_of(0x6C9BD2));
    case std::uint32_t(SectionKind::apical):
      return base;
    default:
      return .85f * base;
  }
}

Vec3 along(const std::array<std::uint32_t, 3>& ramp, float t) {
  const float at = 2.f * std::clamp(t, 0.f, 1.f);
  const std::size_t i = at < 1.f ? 0 : 1;
  return light_of(ramp[i]) + (light_of(ramp[i + 1]) - light_of(ramp[i])) * (at - float(i));
}

// "L4 pyramidal cell" and "L23_PC" without the layer: types whose names differ in nothing else are one family.
std::string_view family_of(std::string_view type) {
  if (type.size() < 2 || type[0] != 'L' || type[1] < '0' || type[1] > '9') return type;
  std::size_t i = type.find_first_not_of("0123456789/-", 1);
  if (i != type.npos && std::string_view("abAB").find(type[i]) != std::string_view::npos) ++i;
  return i < type.size() && (type[i] == ' ' || type[i] == '_') && i + 1 < type.size() ? type.substr(i + 1)
                                                                                      : type;
}

/// Of `count` things from the pia downwards: yellow to violet, between the colours of the table where there are more than it has.
Vec3 layered_light(std::size_t i, std::size_t count) {
  if (count <= layered.size()) return light_of(layered[i]);
  const float at = float(i) / float(count - 1) * float(layered.size() - 1);
  const std::size_t k = std::min(std::size_t(at), layered.size() - 2);
  return light_of(layered[k]) + (light_of(layered[k + 1]) - light_of(layered[k])) * (at - float(k));
}

// What a colour class shows, before it is known which class.
struct Hue {
  struct Name {
    std::string name;
    Vec3 colour;
    std::string step = {};  // of several that have one name
  };
  std::array<Vec3, 8> kinds;
  std::vector<Name> legend;
  bool gauged = false;  // branches are in the colours of the gauge
};
using OpacityRow = std::array<std::uint8_t, 8>;

std::uint8_t byte_of(float share) { return std::uint8_t(std::lround(255.f * std::clamp(share, 0.f, 1.f))); }

// Works out how each neuron is shown, in hues of which there may be any number, then gives them classes.
class Painter {
 public:
  Painter(const Targets& targets, const View& view)
      : targets_(targets),
        view_(view),
        forest_(targets.forest()),
        light_(view.background != Background::dark),
        looks_(forest_.instances().size()) {}

  Colouring paint() {
    const auto& base = scheme(view_.colour_by);
    for (std::uint32_t i = 0; i < looks_.size(); ++i) looks_[i].hue = base(i);
    for (const Appearance& a : view_.targets) apply(a);
    return in_classes();
  }

 private:
  // Before classes: 8 bytes a neuron.
  struct Look {
    std::uint16_t hue = 0;
    std::uint8_t row = 0;  // of opacities by kind
    frame::Kind kind = frame::Kind::any;
    std::uint8_t opacity = 255;
    std::uint8_t flags = frame::State::visible | frame::State::simulated;
  };
  struct PartLook {
    std::uint32_t instance, section;
    Look look;
  };
  using HueOf = std::function<std::uint16_t(std::uint32_t)>;

  /// @param flat  somata and axons have the same colour
  std::uint16_t add_hue(const Vec3& base, const std::string& name, bool flat = false,
                        const std::string& step = {}) {
    Hue hue{{}, {}};
    for (std::uint32_t kind = 0; kind < 8; ++kind)
      hue.kinds[kind] = flat ? base : of_kind(base, kind, light_ ? 0.f : 1.f);
    if (!name.empty()) hue.legend.push_back({name, base, step});
    return add_hue(std::move(hue));
  }
  /// Where it is: the last one where there is no room.
  std::uint16_t add_hue(Hue hue) {
    if (hues_.size() < most_hues) hues_.push_back(std::move(hue));
    return std::uint16_t(hues_.size() - 1);
  }
  /// Of a scheme whose hues began with `first`.
  std::uint16_t hue_at(std::size_t first, std::size_t i) const {
    return std::uint16_t(std::min(first + i, hues_.size() - 1));
  }
  Vec3 on_background(const Vec3& light) const { return light * (light_ ? .8f : 1.f); }
  Vec3 on_background(std::uint32_t rgb) const { return on_background(light_of(rgb)); }

  const HueOf& scheme(ColourBy by) {
    auto& known = schemes_[std::size_t(by)];
    if (!known) known = make_scheme(by);
    return known;
  }

  bool is_glia(std::uint32_t instance) const {
    return forest_.circuit().types[forest_.types()[instance]].glia;
  }
  // Which kinds of sections its neurons have that are no glia, the soma being 1; of very many distinct ones those of the first.
  std::array<bool, 8> kinds() const {
    std::array<bool, 8> result{};
    std::size_t left = 10'000;
    std::vector<bool> seen(forest_.neurons().size());
    for (std::uint32_t i = 0; i < looks_.size() && left > 0; ++i) {
      const std::uint32_t own = forest_.instances()[i].morphology;
      if (seen[own] || is_glia(i)) continue;
      seen[own] = true, --left;
      const Neuron& neuron = forest_.neurons()[own];
      result[1] = result[1] || neuron.soma_radius > 0.f;
      for (const SectionFacts& section :
           forest_.sections().subspan(neuron.first_section, neuron.section_count))
        result[section.kind & 7u] = true;
    }
    return result;
  }
  struct Family {
    std::string name;
    bool glia;

    bool operator==(const Family&) const = default;
  };
  struct Families {
    std::vector<Family> all;
    std::vector<std::size_t> of_type;
  };
  Families families() const {
    Families result;
    for (const circuit::CellType& type : forest_.circuit().types) {
      const Family own{std::string(family_of(type.name)), type.glia};
      const auto found = std::ranges::find(result.all, own);
      result.of_type.push_back(std::size_t(found - result.all.begin()));
      if (found == result.all.end()) result.all.push_back(own);
    }
    return result;
  }
  // Of a family of types, `t` from 0 under the pia to 1.
  static Vec3 family_colour(std::span<const Family> families, std::size_t family, float t) {
    if (!families[family].glia) return along(ramps[family % ramps.size()], t);
    const auto before = std::ranges::count(families.first(family), true, &Family::glia);
    return along(glial[std::size_t(before) % glial.size()], t);
  }

  HueOf make_scheme(ColourBy by) {
    const auto& circuit = forest_.circuit();
    const auto first = std::uint16_t(hues_.size());
    switch (by) {
      case ColourBy::type:
        return by_type();
      case ColourBy::layer:
        for (std::size_t i = 0; i < circuit.layers.size(); ++i)
          add_hue(on_background(layered_light(i, circuit.layers.size())), circuit.layers[i].name);
        return [this, first](std::uint32_t i) { return hue_at(first, forest_.layers()[i]); };
      case ColourBy::neuron:
        for (const std::uint32_t rgb : categorical) add_hue(on_background(rgb), "");
        return [this, first](std::uint32_t i) {
          return hue_at(first, (i * 2654435761u >> 16 & 0xff) % categorical.size());
        };
      case ColourBy::kind: {
        Hue hue{{}, {}};
        for (std::size_t kind = 0; kind < 8; ++kind)  // only the soma's would be lost on light
          hue.kinds[kind] = kind == 1 ? on_background(anatomical[kind]) : light_of(anatomical[kind]);
        const auto seen = kinds();
        const auto name = [&](std::size_t kind) -> std::string {
          if (kind == 1) return "soma";
          // Files call all dendrites basal where none is apical.
          if (SectionKind(kind) == SectionKind::basal && !seen[std::size_t(SectionKind::apical)])
            return "dendrite";
          return std::string(name_of(SectionKind(kind)));
        };
        for (std::size_t kind = 0; kind < 8; ++kind)
          if (seen[kind]) hue.legend.push_back({name(kind), hue.kinds[kind]});
        const std::uint16_t neurons = add_hue(std::move(hue));
        const auto& types = circuit.types;
        if (std::ranges::none_of(types, &circuit::CellType::glia))
          return [neurons](std::uint32_t) { return neurons; };
        // Whatever a file calls its processes.
        Hue glia{{}, {{"glia", on_background(anatomical[7])}}};
        glia.kinds.fill(glia.legend[0].colour);
        glia.kinds[1] = on_background(anatomical[1]);
        return [this, neurons, others = add_hue(std::move(glia))](std::uint32_t i) {
          return is_glia(i) ? others : neurons;
        };
      }
      case ColourBy::depth:
        return by_depth();
      case ColourBy::order:
      case ColourBy::radius:
      case ColourBy::distance:
        return by_gauge(by);
      case ColourBy::target: {
        std::vector<std::uint16_t> of(looks_.size(),
                                      add_hue(on_background(grey), view_.targets.empty() ? "no target" : ""));
        for (std::size_t t = 0; t < view_.targets.size(); ++t) {
          const Appearance& a = view_.targets[t];
          if (a.branch) continue;
          const std::uint16_t hue =
              a.colour ? flat(a) : add_hue(on_background(categorical[t % categorical.size()]), a.name);
          for (const std::uint32_t i : targets_.find(a.name)) of[i] = hue;
        }
        return [of = std::move(of)](std::uint32_t i) { return of[i]; };
      }
    }
    return [first](std::uint32_t) { return first; };
  }

  // The hue tells the family of types, its step the layer. Pairs of them are numbered as they are met.
  HueOf by_type() {
    const auto& circuit = forest_.circuit();
    auto [all, of_type] = families();
    const std::size_t layers = circuit.layers.size(), pairs = all.size() * layers;
    if (pairs > (1u << 20)) {  // by the family alone
      const auto first = std::uint16_t(hues_.size());
      for (std::size_t f = 0; f < all.size(); ++f) add_hue(family_colour(all, f, .5f), all[f].name);
      return [this, first, of_type = std::move(of_type)](std::uint32_t i) {
        return hue_at(first, of_type[forest_.types()[i]]);
      };
    }
    std::vector<std::uint16_t> hue_of(pairs);
    std::vector<bool> met(pairs);
    for (std::uint32_t i = 0; i < looks_.size(); ++i)
      met[of_type[forest_.types()[i]] * layers + forest_.layers()[i]] = true;
    for (std::size_t f = 0; f < all.size(); ++f) {
      const auto begin = met.begin() + std::ptrdiff_t(f * layers);
      const auto steps = std::count(begin, begin + std::ptrdiff_t(layers), true);
      std::ptrdiff_t step = 0;
      for (std::size_t layer = 0; layer < layers; ++layer)
        if (met[f * layers + layer]) {
          hue_of[f * layers + layer] = add_hue(
              family_colour(all, f, steps > 1 ? float(step) / float(steps - 1) : .5f) * (light_ ? .7f : 1.f),
              all[f].name, false, steps > 1 ? circuit.layers[layer].name : "");
          ++step;
        }
    }
    return [this, layers, of_type = std::move(of_type), hue_of = std::move(hue_of)](std::uint32_t i) {
      return hue_of[of_type[forest_.types()[i]] * layers + forest_.layers()[i]];
    };
  }

  HueOf by_gauge(ColourBy by) {
    if (gauge_)
      throw Error(fmt::format("a picture tells one quantity of branches, not both {} and {}; choose one",
                              colour_by_words[std::size_t(gauge_->by)], colour_by_words[std::size_t(by)]));
    gauge_ = std::make_shared<Gauge>(gauge_of(forest_, by));
    Hue hue{.kinds = {}, .legend = {}, .gauged = true};
    hue.kinds.fill(gauge_map(view_.background)(.5f));
    hue.kinds[1] = gauge_soma(view_.background);
    return [hue = add_hue(std::move(hue))](std::uint32_t) { return hue; };
  }

  // Of the soma below the pia: as its circuit tells it of curved tissue, else below the top of the highest layer.
  HueOf by_depth() {
    const auto first = std::uint16_t(hues_.size());
    const std::span<const double> told = depths_in_elements();
    float pia = -INFINITY, bottom = INFINITY;
    for (const auto& layer : forest_.circuit().layers)
      pia = std::max(pia, layer.top), bottom = std::min(bottom, layer.bottom);
    const Bounds& somata = forest_.soma_bounds();
    if (!somata.empty()) pia = std::max(pia, somata.high.y()), bottom = std::min(bottom, somata.low.y());
    const float deepest = told.empty() ? pia - bottom : float(std::ranges::max(told));
    const float step = std::max(deepest / float(depth_steps), 1e-3f);
    const bool planted = !is_gallery(forest_);  // else nobody knows where the pia is
    for (std::size_t i = 0; i < depth_steps; ++i) {
      add_hue(on_background(layered_light(i, depth_steps)),
              planted ? fmt::format("{:.0f}–{:.0f} µm deep", step * float(i), step * float(i + 1)) : "");
    }
    return [this, first, pia, step, told](std::uint32_t i) {
      const float depth = told.empty() ? pia - forest_.instances()[i].y : float(told[i]);
      return hue_at(first, std::size_t(std::clamp(depth / step, 0.f, float(depth_steps) - .5f)));
    };
  }

  // µm below the pia, of all neurons of a circuit that stands in elements (cortex/elements.h); else none.
  std::span<const double> depths_in_elements() const {
    const auto find = [&](std::string_view name) -> std::span<const double> {
      const auto& attributes = forest_.nodes().attributes;
      const auto found = std::ranges::find(attributes, name, &circuit::NodeAttribute::name);
      return found == attributes.end() ? std::span<const double>() : found->of.numbers;
    };
    const std::span<const double> depths = find("depth");
    const bool all = std::ranges::all_of(depths, [](double d) { return std::isfinite(d); });
    return all && !find("element").empty() ? depths : std::span<const double>();
  }

  // The hue of an appearance with a colour of its own.
  std::uint16_t flat(const Appearance& a) {
    const std::string name = !a.branch ? a.name
                             : a.branch->section == soma_section
                                 ? fmt::format("neuron {}", a.branch->neuron)
                                 : fmt::format("neuron {}, a branch", a.branch->neuron);
    const auto [known, first] = flat_.try_emplace({*a.colour, name}, std::uint16_t(0));
    if (first) known->second = add_hue(light_of(*a.colour), name, true);
    return known->second;
  }

  void apply(const Appearance& a) {
    if (a.branch) return apply_to_branch(a);
    const circuit::Members& members = targets_.find(a.name);
    const Change change = change_of(a);
    for (const std::uint32_t i : members) change(looks_[i], i);
    if (!parts_.empty())
      for (PartLook& part : parts_)
        if (std::ranges::binary_search(members, part.instance)) change(part.look, part.instance);
  }

  void apply_to_branch(const Appearance& a) {
    const Branch& b = *a.branch;
    const std::string where = fmt::format("neuron {}", b.neuron);
    if (b.neuron >= looks_.size())
      throw Error(
          fmt::format("there is no {} in this forest of {}; give one from 0 on", where, looks_.size()));
    const Neuron& neuron = forest_.neurons()[forest_.instances()[b.neuron].morphology];
    if (b.section != soma_section && b.section >= neuron.section_count)
      throw Error(fmt::format("{} has {} sections and no section {}; give one from 0 on", where,
                              neuron.section_count, b.section));
    const Change change = change_of(a);
    if (b.section == soma_section) {
      change(looks_[b.neuron], b.neuron);
      for (PartLook& part : parts_)
        if (part.instance == b.neuron) change(part.look, b.neuron);
      return;
    }
    looks_[b.neuron].flags |= frame::State::parted;
    PartLook part{b.neuron, b.section, looks_[b.neuron]};
    for (const PartLook& before : parts_)  // a branch of one that is shown otherwise already begins as that
      if (before.instance == b.neuron && within(neuron, b.section, before.section)) part.look = before.look;
    for (PartLook& below : parts_)
      if (below.instance == b.neuron && within(neuron, below.section, b.section))
        change(below.look, b.neuron);
    change(part.look, b.neuron);
    // Before its own branches, which stay as they were said to be.
    const auto at = std::ranges::find_if(parts_, [&](const PartLook& other) {
      return other.instance == b.neuron && within(neuron, other.section, b.section);
    });
    parts_.insert(at, part);
  }

  // Whether a section is `branch` or grows out of it.
  bool within(const Neuron& neuron, std::uint32_t section, std::uint32_t branch) const {
    while (section != 0xffffffffu && section > branch)
      section = forest_.sections()[neuron.first_section + section].parent;
    return section == branch;
  }

  // An appearance made ready for thousands of neurons.
  struct Change {
    const Appearance& a;
    std::uint8_t opacity;
    const HueOf* hue_of;  // null: none, or a flat one
    std::optional<std::uint16_t> hue;
    std::vector<std::uint8_t> row;  // by the row before

    void operator()(Look& look, std::uint32_t i) const {
      const auto set = [&](std::uint8_t flag, const std::optional<bool>& on) {
        if (on) look.flags = std::uint8_t(*on ? look.flags | flag : look.flags & ~flag);
      };
      set(frame::State::visible, a.visible);
      set(frame::State::simulated, a.simulated);
      if (hue_of) look.hue = (*hue_of)(i);
      if (hue) look.hue = *hue;
      if (a.kind) look.kind = *a.kind;
      if (a.opacity) look.opacity = opacity;
      look.row = row[look.row];
    }
  };
  Change change_of(const Appearance& a) {
    Change change{a, byte_of(a.opacity.value_or(1.f)), nullptr, std::nullopt, {}};
    if (a.colour) change.hue = flat(a);
    if (a.colour_by) change.hue_of = &scheme(*a.colour_by);
    for (std::size_t before = 0, count = rows_.size(); before < count; ++before) {
      OpacityRow row = rows_[before];
      for (std::size_t kind = 0; kind < 8; ++kind)
        if (a.opacity_of[kind]) row[kind] = byte_of(*a.opacity_of[kind]);
      auto known = std::ranges::find(rows_, row);
      if (known == rows_.end() && rows_.size() >= most_rows)
        throw Error("a view tells opacities by kind of branch in too many ways; leave some of them out");
      if (known == rows_.end()) rows_.push_back(row), known = rows_.end() - 1;
      change.row.push_back(std::uint8_t(known - rows_.begin()));
    }
    return change;
  }

  Colouring in_classes() {
    // How often each hue with each row of opacities is seen.
    const std::size_t rows = rows_.size();
    std::vector<std::uint32_t> seen(std::max<std::size_t>(hues_.size(), 1) * rows);
    const auto count = [&](const Look& look) {
      if (look.flags & (frame::State::visible | frame::State::parted)) ++seen[look.hue * rows + look.row];
    };
    for (const Look& look : looks_) count(look);
    for (const PartLook& part : parts_) count(part.look);
    std::vector<std::size_t> used;
    for (std::size_t i = 0; i < seen.size(); ++i)
      if (seen[i]) used.push_back(i);
    std::vector<std::size_t> kept = used;
    const std::size_t classes = gauge_ ? colour_classes - gauge_classes : colour_classes;
    if (kept.size() > classes) {
      std::ranges::stable_sort(kept, std::greater(), [&](std::size_t i) { return seen[i]; });
      kept.resize(classes);
      std::ranges::sort(kept);
    }
    std::vector<std::uint8_t> class_of(seen.size());
    for (const std::size_t i : used) class_of[i] = std::uint8_t(nearest(i, kept, rows));

    Colouring result{.palette = frame::black_palette(),
                     .opacities = frame::opaque(),
                     .states = {},
                     .parts = {},
                     .legend = {},
                     .gauge = {}};
    for (std::size_t c = 0; c < kept.size(); ++c) {
      const Hue& hue = hues_[kept[c] / rows];
      result.gauged |= std::uint16_t(hue.gauged << c);
      for (std::size_t kind = 0; kind < 8; ++kind) {
        result.palette[8 * c + kind] = hue.kinds[kind];
        result.opacities[8 * c + kind] = rows_[kept[c] % rows][kind];
      }
    }
    if (result.gauged) {
      result.gauge = gauge_;
      for (std::uint32_t i = 0; i < Gauge::steps; ++i)
        result.palette[gauge_entry + i] = gauge_map(view_.background)(float(i) / float(Gauge::steps - 1));
    }
    explain(used, kept, class_of, rows, result.legend);
    const auto state_of = [&](const Look& look) {
      return frame::State{class_of[look.hue * rows + look.row], look.kind, look.opacity, look.flags};
    };
    result.states.reserve(looks_.size());
    for (const Look& look : looks_) result.states.push_back(state_of(look));
    for (const PartLook& part : parts_) {
      frame::State state = state_of(part.look);
      state.flags &= std::uint8_t(~frame::State::parted);
      result.parts.push_back({part.instance, part.section, state});
    }
    std::ranges::stable_sort(result.parts, {}, &Part::instance);
    result.opacities[highlight_entry] = result.opacities[outline_entry] = 255;
    result.palette[highlight_entry] = light_ ? light_of(0xC00040) : Vec3(1.f, 1.f, 1.f);
    result.palette[outline_entry] = light_ ? light_of(0x8090A0) : light_of(0x5A6B80);
    return result;
  }

  // Each colour that is seen by the first of those who have it, and how many others do. Three steps of one thing or more are one
  // entry, as colours that lie so near to one another are not told apart in a list.
  void explain(const std::vector<std::size_t>& used, const std::vector<std::size_t>& kept,
               const std::vector<std::uint8_t>& class_of, std::size_t rows,
               std::vector<LegendEntry>& legend) const {
    struct Told {
      Hue::Name first;
      std::string last;  // step that has this colour
      std::size_t others = 0;
    };
    std::vector<Told> all;
    std::vector<bool> told(hues_.size());
    for (const std::size_t i : used) {
      if (told[i / rows]) continue;
      told[i / rows] = true;
      const Hue &own = hues_[i / rows], &shown = hues_[kept[class_of[i]] / rows];
      for (std::size_t k = 0; k < own.legend.size(); ++k) {
        const Hue::Name& as =
            shown.legend.empty() ? own.legend[k] : shown.legend[std::min(k, shown.legend.size() - 1)];
        const auto same =
            std::ranges::find_if(all, [&](const Told& t) { return t.first.colour == as.colour; });
        if (same == all.end())
          all.push_back({{own.legend[k].name, as.colour, own.legend[k].step}, own.legend[k].step});
        else if (!own.legend[k].step.empty() && same->first.name == own.legend[k].name)
          same->last = own.legend[k].step;
        else if (same->first.name != own.legend[k].name)
          ++same->others;
      }
    }
    constexpr std::size_t few = 3;
    for (std::size_t k = 0, end; k < all.size(); k = end) {
      const auto of_one = [&](const Told& t) {
        return !t.first.step.empty() && t.first.name == all[k].first.name;
      };
      end =
          std::size_t(std::find_if_not(all.begin() + std::ptrdiff_t(k) + 1, all.end(), of_one) - all.begin());
      if (end - k < few) end = k + 1;
      const std::string &name = all[k].first.name, &from = all[k].first.step, &to = all[end - 1].last;
      LegendEntry entry{
          from.empty() ? name : fmt::format("{}, {}{}", name, from, to == from ? "" : " to " + to), {}};
      std::size_t others = 0;
      for (std::size_t i = k; i < end; ++i)
        entry.colours.push_back(all[i].first.colour), others += all[i].others;
      if (others) entry.name += fmt::format(" and {} more", others);
      legend.push_back(std::move(entry));
    }
  }

  // Of those kept, the one that looks most alike: what one sees through must stay so, the colour may differ.
  std::size_t nearest(std::size_t i, const std::vector<std::size_t>& kept, std::size_t rows) const {
    const auto far = [&](std::size_t other) {
      float sum = 0.f;
      for (std::size_t kind = 0; kind < 8; ++kind) {
        sum += (hues_[i / rows].kinds[kind] - hues_[other / rows].kinds[kind]).squaredNorm();
        const float by = float(rows_[i % rows][kind]) - float(rows_[other % rows][kind]);
        sum += by * by / 255.f;
      }
      return sum;
    };
    return std::size_t(std::ranges::min_element(kept, {}, far) - kept.begin());
  }

  const Targets& targets_;
  const View& view_;
  const Forest& forest_;
  bool light_;
  std::vector<Look> looks_;
  std::vector<PartLook> parts_;
  std::vector<Hue> hues_;
  std::vector<OpacityRow> rows_{{255, 255, 255, 255, 255, 255, 255, 255}};
  std::array<HueOf, colour_by_words.size()> schemes_;
  std::shared_ptr<const Gauge> gauge_;
  std::map<std::pair<std::uint32_t, std::string>, std::uint16_t> flat_;
};

}  // namespace

Vec3 light_of(std::uint32_t rgb) {
  return {from_srgb(float(rgb >> 16 & 255) / 255.f), from_srgb(float(rgb >> 8 & 255) / 255.f),
          from_srgb(float(rgb & 255) / 255.f)};
}

Vec3 screen_of(const Vec3& light) {
  return light.unaryExpr([](float c) { return to_srgb(std::clamp(c, 0.f, 1.f)); });
}

std::uint8_t Colouring::entry(const frame::State& state, std::uint32_t segment, std::uint32_t kind) const {
  const std::uint8_t step = gauged >> state.colour_class & 1 ? gauge->step[segment] : Gauge::none;
  return std::uint8_t(step == Gauge::none || kind == 1 ? 8u * state.colour_class + kind : gauge_entry + step);
}

Colouring colour(const Targets& targets, const View& view) { return Painter(targets, view).paint(); }

Colouring colour(const Forest& forest, ColourBy by, Background background) {
  View view;
  view.colour_by = by, view.background = background;
  return colour(Targets(forest), view);
}

}  // namespace forest::scene
