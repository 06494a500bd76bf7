// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/view.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"

namespace forest::scene {
namespace {

using Json = nlohmann::ordered_json;

constexpr float seen_inside = 95.f;  // µm: how far one sees between branches

constexpr std::array<std::string_view, 4> colour_names{"type", "layer", "kind", "neuron"};
constexpr std::array<std::string_view, 2> background_names{"dark", "light"};

float linear(float srgb) { return srgb <= .04045f ? srgb / 12.92f : std::pow((srgb + .055f) / 1.055f, 2.4f); }
Vec3 hex(std::uint32_t rgb) {
  return {linear(float(rgb >> 16 & 255) / 255.f), linear(float(rgb >> 8 & 255) / 255.f),
          linear(float(rgb & 255) / 255.f)};
}

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
// Layers from the pia down: seven steps of viridis (Smith & van der Walt 2015), perceptually even.
constexpr std::array<std::uint32_t, 7> layered{0xFDE725, 0x90D743, 0x35B779, 0x21918C,
                                               0x31688E, 0x5A5AA8, 0x8E4A9E};

// How a section kind changes the colour of its neuron: somata brighter, axons cooler and dimmer.
Vec3 of_kind(const Vec3& base, std::uint32_t kind, float lift) {
  switch (kind) {
    case 1:
      return (base * 1.35f + Vec3::Constant(.10f * lift)).cwiseMin(1.f);
    case std::uint32_t(SectionKind::axon):
      return .55f * (.6f * base + .4f * hex(0x6C9BD2));
    case std::uint32_t(SectionKind::apical):
      return base;
    default:
      return .85f * base;
  }
}

Vec3 vector_of(const Json& json, const std::string& name, std::string_view key) {
  if (!json.is_array() || json.size() != 3)
    throw InputError(name, 0,
                     fmt::format("'{}' must be three numbers in µm, for example [0, 800, 1500]", key));
  Vec3 v;
  for (int i = 0; i < 3; ++i) {
    if (!json[std::size_t(i)].is_number())
      throw InputError(name, 0, fmt::format("'{}' must hold numbers only", key));
    v[i] = json[std::size_t(i)].get<float>();
  }
  if (!v.allFinite()) throw InputError(name, 0, fmt::format("'{}' must be finite", key));
  return v;
}

Vec3 ramp_colour(std::uint32_t type, float t) {
  const auto& ramp = ramps[type % ramps.size()];
  const float at = 2.f * std::clamp(t, 0.f, 1.f);
  const std::size_t i = at < 1.f ? 0 : 1;
  return hex(ramp[i]) + (hex(ramp[i + 1]) - hex(ramp[i])) * (at - float(i));
}

float number_of(const Json& json, const std::string& name, std::string_view key, float low, float high) {
  if (!json.is_number() || !(json.get<float>() >= low && json.get<float>() <= high))
    throw InputError(name, 0, fmt::format("'{}' must be a number from {} to {}", key, low, high));
  return json.get<float>();
}

template <std::size_t N>
std::uint8_t word_of(const Json& json, const std::string& name, std::string_view key,
                     const std::array<std::string_view, N>& words) {
  const auto found = json.is_string() ? std::ranges::find(words, json.get<std::string>()) : words.end();
  if (found == words.end())
    throw InputError(name, 0, fmt::format("'{}' must be one of: {}", key, fmt::join(words, ", ")));
  return std::uint8_t(found - words.begin());
}

ActivityView activity_of(const Json& json, const std::string& name) {
  if (!json.is_object())
    throw InputError(name, 0, "'activity' must be an object such as {\"map\":\"plasma\",\"range\":[-80,20]}");
  constexpr float far = 1e9f;
  ActivityView a;
  for (const auto& [key, value] : json.items()) {
    if (key == "map") {
      a.map = value.is_string() ? find_colour_map(value.get<std::string>()) : nullptr;
      if (!a.map) {
        std::vector<std::string_view> names;
        for (const ColourMap& map : colour_maps()) names.push_back(map.name);
        throw InputError(name, 0, fmt::format("'map' must be one of: {}", fmt::join(names, ", ")));
      }
    } else if (key == "range") {
      if (!value.is_array() || value.size() != 2)
        throw InputError(name, 0, "'range' must be the values at both ends of the colours, as [-80, 20]");
      a.low = number_of(value[0], name, key, -far, far), a.high = number_of(value[1], name, key, -far, far);
      if (!(a.low < a.high)) throw InputError(name, 0, "'range' must have its lower end first");
    } else if (key == "threshold") {
      a.threshold = number_of(value, name, key, -far, far);
    } else if (key == "speed") {
      a.speed = number_of(value, name, key, 0.f, 1e6f);
    } else if (key == "fade") {
      a.fade = number_of(value, name, key, .01f, 1e6f);
    } else if (key == "time") {
      number_of(value, name, key, -far, far);
      a.time = value.get<double>();
    } else {
      throw InputError(name, 0,
                       fmt::format("'{}' is no key of a view's activity; see docs/scene/view.md", key));
    }
  }
  return a;
}

// The colours of activity on a background.
void paint(frame::Palette& palette, const ActivityView& a, bool light) {
  for (std::uint32_t i = 0; i < map_steps; ++i)
    palette[i] = (*a.map)(float(i) / float(map_steps - 1)) * (light ? .85f : 1.f);
  palette[below_entry] = hex(light ? 0xC9CFD8 : 0x2A303A);
  palette[no_value_entry] = hex(light ? 0xB4BCC8 : 0x3C4450);
  const Vec3 dim = palette[no_value_entry], bright = light ? hex(0xC00010) : Vec3(1.f, 1.f, .92f);
  for (std::uint32_t i = 0; i < flash_steps; ++i)
    palette[flash_entry + i] = dim + (bright - dim) * (float(i + 1) / float(flash_steps));
}

}  // namespace

View parse_view(std::string_view text, const std::string& name) {
  Json json;
  try {
    json = Json::parse(text);
  } catch (const nlohmann::json::exception& e) {
    throw InputError(name, 0, fmt::format("is no view: {}; see docs/scene/view.md", e.what()));
  }
  if (!json.is_object())
    throw InputError(name, 0, "a view is a JSON object with 'eye' and 'target'; see docs/scene/view.md");
  for (const char* needed : {"eye", "target"})
    if (!json.contains(needed))
      throw InputError(name, 0, fmt::format("the view lacks '{}'; give it as [x, y, z] in µm", needed));
  View v;
  for (const auto& [key, value] : json.items()) {
    if (key == "eye")
      v.camera.eye = vector_of(value, name, key);
    else if (key == "target")
      v.camera.target = vector_of(value, name, key);
    else if (key == "up")
      v.camera.up = vector_of(value, name, key);
    else if (key == "field_of_view")
      v.camera.field_of_view = number_of(value, name, key, 1.f, 170.f);
    else if (key == "near")
      v.camera.near = number_of(value, name, key, .05f, 1e5f);
    else if (key == "error")
      v.detail.error = number_of(value, name, key, .05f, 100.f);
    else if (key == "acuity_slope")
      v.detail.acuity_slope = number_of(value, name, key, 0.f, 60.f);
    else if (key == "samples")
      v.samples = std::uint32_t(number_of(value, name, key, 1.f, 1024.f));
    else if (key == "fog")
      v.fog = number_of(value, name, key, 0.f, 100.f);
    else if (key == "halo")
      v.halo = number_of(value, name, key, 0.f, 10.f);
    else if (key == "colour_by")
      v.colour_by = ColourBy(word_of(value, name, key, colour_names));
    else if (key == "background")
      v.background = Background(word_of(value, name, key, background_names));
    else if (key == "activity")
      v.activity = activity_of(value, name);
    else if (key == "gaze") {
      if (!value.is_array() || value.size() != 2 || !value[0].is_number() || !value[1].is_number())
        throw InputError(
            name, 0, "'gaze' must be two shares of the picture's width and height, for example [0.5, 0.5]");
      v.detail.gaze = Vec2(value[0].get<float>(), value[1].get<float>());
    } else {
      throw InputError(name, 0, fmt::format("'{}' is no key of a view; see docs/scene/view.md", key));
    }
  }
  if (v.camera.eye == v.camera.target)
    throw InputError(name, 0, "'eye' and 'target' are the same point; move one of them");
  return v;
}

std::string to_json(const View& v) {
  const auto list = [](const Vec3& p) { return Json{p.x(), p.y(), p.z()}; };
  Json json{{"eye", list(v.camera.eye)},
            {"target", list(v.camera.target)},
            {"up", list(v.camera.up)},
            {"field_of_view", v.camera.field_of_view},
            {"near", v.camera.near},
            {"error", v.detail.error},
            {"acuity_slope", v.detail.acuity_slope},
            {"colour_by", colour_names[std::size_t(v.colour_by)]},
            {"background", background_names[std::size_t(v.background)]},
            {"samples", v.samples},
            {"fog", v.fog},
            {"halo", v.halo}};
  if (v.detail.gaze) json["gaze"] = {v.detail.gaze->x(), v.detail.gaze->y()};
  if (v.activity) {
    const ActivityView& a = *v.activity;
    Json& activity = json["activity"] = {
        {"map", a.map->name}, {"range", {a.low, a.high}}, {"speed", a.speed}, {"fade", a.fade}};
    if (a.threshold) activity["threshold"] = *a.threshold;
    if (a.time) activity["time"] = *a.time;
  }
  return json.dump();
}

View overview(const Forest& forest) {
  View view;
  Bounds bounds = forest.soma_bounds();
  for (const auto& layer : forest.circuit().layers) {
    bounds.add({0.f, layer.bottom, 0.f});
    bounds.add({0.f, layer.top, 0.f});
  }
  if (bounds.empty()) return view;
  const float radius = std::max(forest.circuit().radius, .5f * bounds.extent().norm() * .5f);
  const float height = std::max(bounds.extent().y(), radius) + 120.f;
  const float distance =
      std::max(.5f * height, radius) / std::tan(.5f * radians(view.camera.field_of_view)) * 1.08f + radius;
  view.camera.target = bounds.centre();
  view.camera.eye = bounds.centre() + distance * Vec3(.42f, .16f, 1.f).normalized();
  view.camera.near = 2.f;
  return view;
}

View portrait(const Forest& forest) {
  View view = overview(forest);
  const Bounds& bounds = forest.soma_bounds();
  if (bounds.empty()) return view;
  const float radius = std::max(forest.circuit().radius, 50.f), height = bounds.extent().y();
  const Vec3 centre = bounds.centre();
  view.camera.target = centre + Vec3(.42f * radius, .2f * height, 0.f);
  view.camera.eye = centre + Vec3(3.f * radius, .74f * height, 5.8f * radius);
  view.camera.field_of_view = 46.f;
  view.camera.near = .5f;
  view.fog = 1.4f, view.halo = 1.5f;
  view.samples = 24;
  return view;
}

Colouring colour(const Forest& forest, ColourBy by, Background background) {
  Colouring result{.palette = frame::black_palette(),
                   .classes = std::vector<std::uint8_t>(forest.instances().size()),
                   .legend = {}};
  const bool light = background == Background::light;
  std::array<Vec3, 16> base;
  base.fill(hex(0xBBBBBB));
  const auto& circuit = forest.circuit();
  const auto fill = [&](std::size_t count, const auto& rgb, const auto& name_of_class) {
    for (std::size_t i = 0; i < std::min<std::size_t>(count, base.size()); ++i) {
      base[i] = hex(rgb(i)) * (light ? .7f : 1.f);
      result.legend.push_back({name_of_class(i), base[i]});
    }
  };
  switch (by) {
    case ColourBy::type: {
      // The hue tells the type, its step the layer. Pairs of them are numbered as they are met; past sixteen they share.
      std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint8_t> pairs;
      for (std::size_t i = 0; i < result.classes.size(); ++i)
        pairs.try_emplace({forest.types()[i], forest.layers()[i]}, std::uint8_t(0));
      std::map<std::uint32_t, std::uint32_t> layers_of_type;
      for (const auto& [pair, number] : pairs) ++layers_of_type[pair.first];
      std::uint32_t next = 0, step = 0, type_before = 0;
      for (auto& [pair, number] : pairs) {
        const auto [type, layer] = pair;
        step = next > 0 && type == type_before ? step + 1 : 0;
        type_before = type;
        number = std::uint8_t(std::min(next++, 15u));
        const std::uint32_t steps = layers_of_type[type];
        base[number] =
            ramp_colour(type, steps > 1 ? float(step) / float(steps - 1) : .5f) * (light ? .6f : 1.f);
        result.legend.push_back(
            {circuit.types[type].name + (steps > 1 ? ", " + circuit.layers[layer].name : ""), base[number]});
      }
      for (std::size_t i = 0; i < result.classes.size(); ++i)
        result.classes[i] = pairs[{forest.types()[i], forest.layers()[i]}];
      break;
    }
    case ColourBy::layer:
      fill(
          circuit.layers.size(), [&](std::size_t i) { return layered[i % layered.size()]; },
          [&](std::size_t i) { return circuit.layers[i].name; });
      for (std::size_t i = 0; i < result.classes.size(); ++i)
        result.classes[i] = std::uint8_t(forest.layers()[i] % 16);
      break;
    case ColourBy::neuron:
      for (std::size_t i = 0; i < 14; ++i) base[i] = hex(categorical[i]) * (light ? .7f : 1.f);
      for (std::size_t i = 0; i < result.classes.size(); ++i)
        result.classes[i] = std::uint8_t(i * 2654435761u >> 16 & 0xffff) % 14;
      break;
    case ColourBy::kind:
      break;
  }
  for (std::uint32_t c = 0; c < 16; ++c)
    for (std::uint32_t kind = 0; kind < 8; ++kind)
      result.palette[8 * c + kind] = of_kind(base[c], kind, light ? 0.f : 1.f);
  if (by == ColourBy::kind) {
    // The colours neuroanatomists know: soma black or white, axon blue, basal red, apical magenta.
    const std::array<std::uint32_t, 8> kinds{0x999999, 0xF0E442, 0x0072B2, 0xD55E00,
                                             0xCC79A7, 0x009E73, 0x56B4E9, 0x7FD8B8};
    for (std::uint32_t i = 0; i < 128; ++i) result.palette[i] = hex(kinds[i % 8]) * (light ? .7f : 1.f);
    const std::array<std::uint32_t, 4> shown{1, 2, 3, 4};
    for (const auto kind : shown)
      result.legend.push_back(
          {kind == 1 ? "soma" : std::string(name_of(SectionKind(kind))), result.palette[kind]});
  }
  result.palette[highlight_entry] = light ? hex(0xC00040) : Vec3(1.f, 1.f, 1.f);
  result.palette[outline_entry] = light ? hex(0x8090A0) : hex(0x5A6B80);
  return result;
}

Detail detail_for(const View& view, std::uint32_t width, std::uint32_t height) {
  Detail detail = view.detail;
  detail.thin = view.samples == 1;
  if (detail.gaze) detail.gaze = Vec2(detail.gaze->x() * float(width), detail.gaze->y() * float(height));
  return detail;
}

frame::Frame compose(const Forest& forest, const View& view, const Colouring& colouring, const Cut& cut,
                     std::uint32_t width, std::uint32_t height, std::span<const frame::Overlay> overlays) {
  frame::Frame f;
  f.camera = view.camera;
  f.width = width, f.height = height, f.subframes = view.samples;
  f.palette = colouring.palette;
  if (cut.entries)
    paint(f.palette, view.activity.value_or(ActivityView()), view.background == Background::light);
  f.colour_class = colouring.classes;
  static_cast<frame::Lists&>(f) = cut.lists();
  f.overlays = overlays;
  frame::Style& s = f.style;
  s.halo = view.halo;
  if (view.background == Background::light) {
    s.background_top = hex(0xF7F9FC), s.background_bottom = hex(0xE6EBF2), s.fog_colour = hex(0xEDF1F7);
  } else {
    s.background_top = hex(0x0E1420), s.background_bottom = hex(0x05070C), s.fog_colour = hex(0x0A0F1A);
  }
  // Fog begins at the front of the forest, or a little before the eye inside it, and takes the forest's own depth.
  const Bounds& bounds = forest.soma_bounds();
  if (view.fog > 0.f && !bounds.empty()) {
    const Mat3 axes = view.camera.axes();
    const float extent = .5f * bounds.extent().norm() + 100.f;
    const float depth = -axes.col(2).dot(bounds.centre() - view.camera.eye);
    const float size = .5f * std::hypot(bounds.extent().x(), bounds.extent().z()) + 50.f;
    s.fog_start = std::max(20.f, depth - size);
    // Within the forest one sees a hundred micrometres or two, whatever its size.
    const float inside = std::clamp(1.f - (depth - size) / size, 0.f, 1.f);
    const float length = std::max(60.f, std::min(2.f * size, extent) * .9f);
    s.fog_length = (length + inside * (std::min(length, seen_inside) - length)) / view.fog;
  }
  return f;
}

std::vector<frame::Overlay> outline(const Forest& forest) {
  std::vector<frame::Overlay> lines;
  const float radius = forest.circuit().radius;
  const auto& layers = forest.circuit().layers;
  if (!(radius > 0.f) || layers.empty()) return lines;
  constexpr int sides = 96;
  const auto corner = [&](int i, float y) {
    const float angle = 2.f * pi * float(i) / sides;
    return Vec3(radius * std::cos(angle), y, radius * std::sin(angle));
  };
  float low = INFINITY, high = -INFINITY;
  std::vector<float> heights;
  for (const auto& layer : layers) {
    heights.push_back(layer.top), heights.push_back(layer.bottom);
    low = std::min(low, layer.bottom), high = std::max(high, layer.top);
  }
  std::ranges::sort(heights);
  heights.erase(std::unique(heights.begin(), heights.end(), [](float a, float b) { return b - a < .01f; }),
                heights.end());
  for (const float y : heights)
    for (int i = 0; i < sides; ++i) lines.push_back({corner(i, y), corner(i + 1, y), .5f, outline_entry});
  for (int i = 0; i < sides; i += sides / 8)
    lines.push_back({corner(i, low), corner(i, high), .5f, outline_entry});
  return lines;
}

}  // namespace forest::scene
