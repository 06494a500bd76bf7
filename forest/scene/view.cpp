// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/view.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

#include <Eigen/Eigenvalues>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/core/half.h"
#include "forest/core/json.h"
#include "forest/scene/gallery.h"
#include "forest/scene/placed.h"

namespace forest::scene {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::array<std::string_view, 7> kind_names{"any",    "dots", "lines", "capsules",
                                                     "somata", "skin", "bricks"};
constexpr std::array<std::string_view, 3> synapse_colour_by_words{"none", "sign", "target"};
constexpr std::array<std::string_view, 2> projection_names{"perspective", "orthographic"};

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

bool flag_of(const Json& json, const std::string& name, std::string_view key) {
  if (!json.is_boolean()) throw InputError(name, 0, fmt::format("'{}' must be true or false", key));
  return json.get<bool>();
}

std::uint32_t index_of(const Json& json, const std::string& name, std::string_view key) {
  if (!json.is_number_unsigned() || json.get<std::uint64_t>() >= 0xffffffffull)
    throw InputError(name, 0, fmt::format("'{}' must be a whole number from 0 on", key));
  return json.get<std::uint32_t>();
}

// "#ff8800", or what colours mean.
void read_colour(const Json& json, const std::string& name, Appearance& a) {
  const std::string word = json.is_string() ? json.get<std::string>() : "";
  if (word.starts_with('#')) {
    std::uint32_t rgb = 0;
    const auto [end, error] = std::from_chars(word.data() + 1, word.data() + word.size(), rgb, 16);
    if (word.size() == 7 && error == std::errc() && end == word.data() + word.size()) {
      a.colour = rgb;
      return;
    }
  } else if (const auto found = std::ranges::find(colour_by_words, word); found != colour_by_words.end()) {
    a.colour_by = ColourBy(found - colour_by_words.begin());
    return;
  }
  throw InputError(name, 0,
                   fmt::format("'colour' of a target must be a colour as \"#ff8800\", or one of: {}",
                               fmt::join(colour_by_words, ", ")));
}

// The kinds whose opacity can be told apart, by their number in Segment::meta.
std::string_view section_word(std::size_t kind) { return kind == 1 ? "soma" : name_of(SectionKind(kind)); }

void read_opacities(const Json& json, const std::string& name, Appearance& a) {
  if (json.is_number()) {
    a.opacity = number_of(json, name, "opacity", 0.f, 1.f);
    return;
  }
  if (!json.is_object())
    throw InputError(
        name, 0,
        "'opacity' must be a number from 0 to 1, or one for each kind as {\"axon\": 0.2, \"soma\": 1}");
  for (const auto& [word, value] : json.items()) {
    if (word == "all") {
      a.opacity = number_of(value, name, word, 0.f, 1.f);
      continue;
    }
    std::size_t kind = 0;
    while (kind < 8 && section_word(kind) != word) ++kind;
    if (kind == 8)
      throw InputError(
          name, 0, fmt::format("'{}' is no kind of section; give soma, axon, basal, apical or all", word));
    a.opacity_of[kind] = number_of(value, name, word, 0.f, 1.f);
  }
}

Appearance appearance_of(const Json& json, const std::string& name) {
  if (!json.is_object())
    throw InputError(name, 0, "'targets' must hold objects as {\"name\": \"L5\", \"opacity\": 0.4}");
  Appearance a;
  for (const auto& [key, value] : json.items()) {
    if (key == "name") {
      if (!value.is_string() || value.get<std::string>().empty())
        throw InputError(
            name, 0, "'name' must be the name of a target, or an expression as \"L5 and not inhibitory\"");
      a.name = value.get<std::string>();
    } else if (key == "neuron") {
      if (!a.branch) a.branch = Branch{};
      a.branch->neuron = index_of(value, name, key);
    } else if (key == "section") {
      if (!a.branch) a.branch = Branch{};
      a.branch->section = index_of(value, name, key);
    } else if (key == "visible") {
      a.visible = flag_of(value, name, key);
    } else if (key == "simulated") {
      a.simulated = flag_of(value, name, key);
    } else if (key == "colour") {
      read_colour(value, name, a);
    } else if (key == "kind") {
      a.kind = frame::Kind(word_of(value, name, key, kind_names));
    } else if (key == "opacity") {
      read_opacities(value, name, a);
    } else {
      throw InputError(name, 0, fmt::format("'{}' is no key of a target; see docs/scene/targets.md", key));
    }
  }
  if (a.name.empty() == !a.branch || (a.branch && !json.contains("neuron")))
    throw InputError(
        name, 0,
        "each of the targets must have a 'name', or a 'neuron' with or without a 'section', and not both");
  return a;
}

Json json_of(const Appearance& a) {
  Json json;
  if (a.branch) {
    json["neuron"] = a.branch->neuron;
    if (a.branch->section != soma_section) json["section"] = a.branch->section;
  } else {
    json["name"] = a.name;
  }
  const auto number = [](float value) { return std::round(double(value) * 1e4) / 1e4; };
  if (a.visible) json["visible"] = *a.visible;
  if (a.colour) json["colour"] = fmt::format("#{:06x}", *a.colour);
  if (a.colour_by) json["colour"] = colour_by_words[std::size_t(*a.colour_by)];
  if (a.kind) json["kind"] = kind_names[std::size_t(*a.kind)];
  Json parts;
  if (a.opacity) parts["all"] = number(*a.opacity);
  for (std::size_t kind = 0; kind < 8; ++kind)
    if (a.opacity_of[kind]) parts[section_word(kind)] = number(*a.opacity_of[kind]);
  if (!parts.is_null()) json["opacity"] = parts.size() == 1 && a.opacity ? parts["all"] : parts;
  if (a.simulated) json["simulated"] = *a.simulated;
  return json;
}

// A key of a view, or of what is in one: how it is read and written, and what it may hold (words, or a range of numbers).
template <class Of>
struct Key {
  std::string_view name;
  std::vector<std::string> values;
  std::function<void(Of&, const Json&, const std::string& file)> read;
  std::function<Json(const Of&)> write;  // null: nothing is said of it

  Key said_if(bool (*says)(const Of&)) const {
    Key key = *this;
    key.write = [says, write = write](const Of& of) { return says(of) ? write(of) : Json(); };
    return key;
  }
};
template <class Of>
using Keys = std::span<const Key<Of>>;

// "0.05–100,000", as docs/scene/view.md has it.
std::string range_of(double low, double high) {
  const auto number = [](double x) {
    std::string text = fmt::format("{:g}", x);
    if (x < 1e4) return text;
    text = fmt::format("{:.0f}", x);
    for (std::size_t at = text.size(); at > 3;) text.insert(at -= 3, ",");
    return text;
  };
  return fmt::format("{}–{}", number(low), number(high));
}

// Rows of one kind; `at` is where the value lies: at(View&) is a reference to it, at(const View&) too.
template <class Of, class At>
Key<Of> point(std::string_view name, At at) {
  return {name,
          {},
          [=](Of& of, const Json& json, const std::string& file) { at(of) = vector_of(json, file, name); },
          [=](const Of& of) {
            const Vec3& p = at(of);
            return Json{p.x(), p.y(), p.z()};
          }};
}
template <class Of, class At>
Key<Of> number(std::string_view name, float low, float high, At at) {
  return {name,
          {range_of(double(low), double(high))},
          [=](Of& of, const Json& json, const std::string& file) {
            at(of) = number_of(json, file, name, low, high);
          },
          [=](const Of& of) { return Json(at(of)); }};
}
template <class Of, class At>
Key<Of> whole(std::string_view name, std::uint32_t low, std::uint32_t high, At at) {
  return {name,
          {range_of(low, high)},
          [=](Of& of, const Json& json, const std::string& file) {
            const double value = json.is_number() ? json.get<double>() : NAN;
            if (!(value >= low && value <= high && value == std::floor(value)))
              throw InputError(file, 0,
                               fmt::format("'{}' must be a whole number from {} to {}", name, low, high));
            at(of) = std::uint32_t(value);
          },
          [=](const Of& of) {
            const std::optional<std::uint32_t> value = at(of);
            return value ? Json(*value) : Json();
          }};
}
template <class Of, class At>
Key<Of> flag(std::string_view name, At at) {
  return {name,
          {"true", "false"},
          [=](Of& of, const Json& json, const std::string& file) { at(of) = flag_of(json, file, name); },
          [=](const Of& of) { return Json(at(of)); }};
}
template <class Of, std::size_t N, class At>
Key<Of> word(std::string_view name, const std::array<std::string_view, N>& words, At at) {
  return {name,
          {words.begin(), words.end()},
          [=, &words](Of& of, const Json& json, const std::string& file) {
            at(of) = std::remove_cvref_t<decltype(at(of))>(word_of(json, file, name, words));
          },
          [=, &words](const Of& of) { return Json(words[std::size_t(at(of))]); }};
}

template <class Of>
void read_all(Of& of, const Json& json, Keys<Of> keys, const std::string& file, std::string_view whose) {
  for (const auto& [name, value] : json.items()) {
    const auto key = std::ranges::find(keys, name, &Key<Of>::name);
    if (key == keys.end())
      throw InputError(file, 0,
                       fmt::format("'{}' is no key of a view{}; see docs/scene/view.md", name, whose));
    key->read(of, value, file);
  }
}
template <class Of>
Json write_all(const Of& of, Keys<Of> keys) {
  Json json;
  for (const Key<Of>& key : keys)
    if (Json value = key.write(of); !value.is_null()) json[std::string(key.name)] = std::move(value);
  return json;
}

constexpr float far = 1e9f;  // beyond all values of reports

void read_map(ActivityView& a, const Json& json, const std::string& file) {
  a.map = json.is_string() ? find_colour_map(json.get<std::string>()) : nullptr;
  if (a.map) return;
  std::vector<std::string_view> names;
  for (const ColourMap& map : colour_maps()) names.push_back(map.name);
  throw InputError(file, 0, fmt::format("'map' must be one of: {}", fmt::join(names, ", ")));
}

void read_range(ActivityView& a, const Json& json, const std::string& file) {
  if (!json.is_array() || json.size() != 2)
    throw InputError(file, 0, "'range' must be the values at both ends of the colours, as [-80, 20]");
  a.low = number_of(json[0], file, "range", -far, far), a.high = number_of(json[1], file, "range", -far, far);
  if (!(a.low < a.high)) throw InputError(file, 0, "'range' must have its lower end first");
}

// In the order in which they are written.
Keys<ActivityView> keys_of_activity() {
  using A = ActivityView;
  static const std::vector<Key<A>> keys = [] {
    std::vector<std::string> maps;
    for (const ColourMap& map : colour_maps()) maps.emplace_back(map.name);
    return std::vector<Key<A>>{
        {"map", maps, read_map, [](const A& a) { return Json(a.map->name); }},
        {"range",
         {},
         read_range,
         [](const A& a) {
           return Json{a.low, a.high};
         }},
        number<A>(
            "speed", 0.f, 1e6f, [](auto& a) -> auto& { return a.speed; }),
        number<A>(
            "fade", .01f, 1e6f, [](auto& a) -> auto& { return a.fade; }),
        {"threshold",
         {},
         [](A& a, const Json& json, const std::string& file) {
           a.threshold = number_of(json, file, "threshold", -far, far);
         },
         [](const A& a) { return a.threshold ? Json(*a.threshold) : Json(); }},
        {"time",
         {},
         [](A& a, const Json& json, const std::string& file) {
           number_of(json, file, "time", -far, far);
           a.time = json.get<double>();
         },
         [](const A& a) { return a.time ? Json(*a.time) : Json(); }},
        whole<A>(
            "neuron", 0, 0xffff'fffe, [](auto& a) -> auto& { return a.neuron; }),
    };
  }();
  return keys;
}

void read_gaze(View& v, const Json& json, const std::string& file) {
  if (!json.is_array() || json.size() != 2 || !json[0].is_number() || !json[1].is_number())
    throw InputError(file, 0,
                     "'gaze' must be two shares of the picture's width and height, for example [0.5, 0.5]");
  const Vec2 gaze(json[0].get<float>(), json[1].get<float>());
  if (!((gaze.array() >= 0.f) && (gaze.array() <= 1.f)).all())
    throw InputError(file, 0,
                     "'gaze' lies beside the picture; give shares of its width and height from 0 to 1");
  v.detail.gaze = gaze;
}

void read_targets(View& v, const Json& json, const std::string& file) {
  if (!json.is_array()) throw InputError(file, 0, "'targets' must be a list; see docs/scene/targets.md");
  for (const Json& one : json) v.targets.push_back(appearance_of(one, file));
}

void read_activity(View& v, const Json& json, const std::string& file) {
  if (!json.is_object())
    throw InputError(file, 0, "'activity' must be an object such as {\"map\":\"plasma\",\"range\":[-80,20]}");
  read_all(v.activity.emplace(), json, keys_of_activity(), file, "'s activity");
}

Keys<CutPlane> keys_of_plane() {
  using P = CutPlane;
  static const std::vector<Key<P>> keys{
      point<P>(
          "at", [](auto& p) -> auto& { return p.at; }),
      point<P>(
          "normal", [](auto& p) -> auto& { return p.normal; }),
      number<P>(
          "opacity", 0.f, 1.f, [](auto& p) -> auto& { return p.opacity; }),
  };
  return keys;
}

void read_plane(View& v, const Json& json, const std::string& file) {
  if (!json.is_object() || !json.contains("at"))
    throw InputError(file, 0, "'plane' must be an object such as {\"at\":[0,1000,0],\"normal\":[0,0,1]}");
  read_all(v.plane.emplace(), json, keys_of_plane(), file, "'s plane");
  if (v.plane->normal.isZero())
    throw InputError(file, 0, "'normal' has no direction; give one such as [0, 0, 1]");
}

bool has_gaze(const View& v) { return v.detail.gaze.has_value(); }

// In the order in which they are written.
Keys<View> keys_of_view() {
  using V = View;
  static const std::vector<Key<V>> keys{
      point<V>(
          "eye", [](auto& v) -> auto& { return v.camera.eye; }),
      point<V>(
          "target", [](auto& v) -> auto& { return v.camera.target; }),
      point<V>(
          "up", [](auto& v) -> auto& { return v.camera.up; }),
      number<V>(
          "field_of_view", 1.f, 170.f, [](auto& v) -> auto& { return v.camera.field_of_view; }),
      word<V>(
          "projection", projection_names, [](auto& v) -> auto& { return v.camera.projection; }),
      number<V>(
          "near", .05f, 1e5f, [](auto& v) -> auto& { return v.camera.near; }),
      number<V>(
          "error", .05f, 100.f, [](auto& v) -> auto& { return v.detail.error; }),
      number<V>(
          "acuity_slope", 0.f, 60.f, [](auto& v) -> auto& { return v.detail.acuity_slope; }),
      word<V>(
          "colour_by", colour_by_words, [](auto& v) -> auto& { return v.colour_by; }),
      word<V>(
          "background", background_words, [](auto& v) -> auto& { return v.background; }),
      whole<V>(
          "samples", 1, 1024, [](auto& v) -> auto& { return v.samples; }),
      number<V>(
          "fog", 0.f, 100.f, [](auto& v) -> auto& { return v.fog; }),
      number<V>(
          "halo", 0.f, 10.f, [](auto& v) -> auto& { return v.halo; }),
      {"least_width",
       {"0–4"},
       [](V& v, const Json& json, const std::string& file) {
         v.least_width = number_of(json, file, "least_width", 0.f, 4.f);
       },
       [](const V& v) { return v.least_width ? Json(*v.least_width) : Json(); }},
      flag<V>(
          "skin", [](auto& v) -> auto& { return v.skin; })
          .said_if([](const V& v) { return !v.skin; }),
      word<V>(
          "synapses", synapse_colour_by_words, [](auto& v) -> auto& { return v.synapses; })
          .said_if([](const V& v) { return v.synapses != V().synapses; }),
      {"gaze",
       {},
       read_gaze,
       [](const V& v) {
         return has_gaze(v) ? Json{v.detail.gaze->x(), v.detail.gaze->y()} : Json();
       }},
      number<V>(
          "fovea", 0.f, 90.f, [](auto& v) -> auto& { return v.detail.fovea; })
          .said_if(has_gaze),
      number<V>(
          "screen", 0.f, 170.f, [](auto& v) -> auto& { return v.detail.screen; })
          .said_if([](const V& v) { return has_gaze(v) && v.detail.screen > 0.f; }),
      {"targets",
       {},
       read_targets,
       [](const V& v) {
         Json list;
         for (const Appearance& a : v.targets) list.push_back(json_of(a));
         return list;
       }},
      {"activity",
       {},
       read_activity,
       [](const V& v) {
         return v.activity ? write_all<ActivityView>(*v.activity, keys_of_activity()) : Json();
       }},
      {"plane",
       {},
       read_plane,
       [](const V& v) { return v.plane ? write_all<CutPlane>(*v.plane, keys_of_plane()) : Json(); }},
  };
  return keys;
}

template <class Of>
std::vector<ViewKey> facts_of(Keys<Of> keys) {
  std::vector<ViewKey> facts;
  for (const Key<Of>& key : keys) facts.push_back({std::string(key.name), key.values});
  return facts;
}

// The colours of activity on a background.
void paint(frame::Palette& palette, const ActivityView& a, bool light) {
  const std::uint32_t steps = a.neuron ? half_map_steps : map_steps;
  for (std::uint32_t i = 0; i < steps; ++i)
    palette[i] =
        on_branches(*a.map, float(i) / float(steps - 1), light ? Background::light : Background::dark);
  const float kept = light ? .25f : .15f;
  const Vec3 ground = light ? light_of(0xDDE3EB) : Vec3::Zero();
  for (std::uint32_t i = steps; i < map_steps; ++i)
    palette[i] = kept * palette[i - steps] + (1.f - kept) * ground;
  palette[below_entry] = below_threshold(light ? Background::light : Background::dark);
  palette[no_value_entry] = light_of(light ? 0xB4BCC8 : 0x475160);
  const Vec3 dim = palette[no_value_entry];
  const auto [bright, fading] = flash_colours(light ? Background::light : Background::dark);
  for (std::uint32_t i = 0; i < flash_steps; ++i) {
    const float share = 2.f * float(i + 1) / float(flash_steps);
    palette[flash_entry + i] =
        share < 1.f ? Vec3(dim + share * (fading - dim)) : Vec3(fading + (share - 1.f) * (bright - fading));
  }
}

constexpr int outline_corners = 16;

/// Places on branches of neurons that are seen: of few the ends of all segments and all that somata take up, else spread evenly over
/// their area, the straws of one level of bricks.
struct Places {
  std::vector<Vec3> places;
  std::vector<Sphere> somata;  // of which each has some
  bool all = true;             // else a sample
};
/// @param seen  whether an instance is
template <class Seen>
Places places_on_branches(const Forest& forest, const Seen& seen) {
  constexpr std::size_t enough = 4096, small = 1'000'000;
  const auto instances = forest.instances();
  std::uint64_t total = 0;
  for (std::uint32_t i = 0; i < instances.size(); ++i)
    if (seen(i)) total += forest.neurons()[instances[i].morphology].original_count;
  std::vector<Vec3> places;
  std::vector<Sphere> somata;
  if (total <= small) {
    for (std::uint32_t i = 0; i < instances.size(); ++i) {
      if (!seen(i)) continue;
      const Placed placed(instances[i]);
      const Neuron& neuron = forest.neurons()[instances[i].morphology];
      for (const frame::Segment& s : forest.segments().subspan(neuron.first_segment, neuron.original_count)) {
        places.push_back(placed({{s.bx, s.by, s.bz}, 0.f}).centre);
        if ((s.meta & 7u) != 1u) continue;
        somata.push_back(placed({{s.ax, s.ay, s.az}, from_half(s.radii & 0xffffu)}));
        somata.push_back(placed({{s.bx, s.by, s.bz}, from_half(s.radii >> 16)}));
      }
    }
    return {std::move(places), std::move(somata), true};
  }
  const auto bricks = forest.bricks();
  const auto owners = forest.owners();
  const std::size_t first_straw = forest.segments().size() - owners.size();
  for (std::size_t level = 0; level < bricks.size(); level = bricks[level].first_child) {
    const Brick& first = bricks[level];
    const std::size_t end =
        first.child_count ? bricks[first.first_child].first_segment : forest.segments().size();
    places.clear();
    for (std::size_t i = first.first_segment; i < end; ++i) {
      const frame::Segment& s = forest.segments()[i];
      if (seen(owners[i - first_straw].instance))
        places.emplace_back(.5f * (s.ax + s.bx), .5f * (s.ay + s.by), .5f * (s.az + s.bz));
    }
    if (places.size() >= enough || !first.child_count) break;
  }
  return {std::move(places), {}, false};
}

/// Where an eye must be so that a pyramid of view of given directions and slopes encloses points. With axes r (right) and d
/// (backward), an eye at c r + D d sees p where ±(r·p − c) ≤ slope (D − d·p): the extremes of ±r·p + slope d·p decide.
class Enclosing {
 public:
  Enclosing(const Mat3& axes, float slope_across, float slope_up) : axes_(axes) {
    for (const int side : {0, 1})
      for (const float sign : {1.f, -1.f}) {
        const float slope = side ? slope_up : slope_across;
        normals_[std::size_t(2 * side) + (sign < 0.f)] = sign * axes.col(side) + slope * axes.col(2);
        slopes_[std::size_t(side)] = slope;
      }
    reach_.fill(-std::numeric_limits<float>::infinity());
  }

  void add(const Vec3& p, float radius = 0.f) {
    for (std::size_t n = 0; n < 4; ++n)
      reach_[n] = std::max(reach_[n], normals_[n].dot(p) + radius * normals_[n].norm());
  }
  /// All but a few that reach far beyond the others; of a sample, which has few of the farthest, all but those.
  void add_most(std::span<const Vec3> points, bool sample) {
    if (points.empty()) return;
    constexpr float beyond = .15f;  // of what the others take
    std::array<float, 4> most, all;
    std::vector<float> reaches(points.size());
    for (std::size_t n = 0; n < 4; ++n) {
      std::ranges::transform(points, reaches.begin(), [&](const Vec3& p) { return normals_[n].dot(p); });
      const auto last = reaches.end() - 1 - std::ptrdiff_t(points.size() / few);
      std::ranges::nth_element(reaches, last);
      most[n] = *last, all[n] = *std::max_element(last, reaches.end());
    }
    for (std::size_t n = 0; n < 4; ++n) {
      const float taken = most[n] + most[n ^ 1];
      reach_[n] = std::max(reach_[n], !sample && all[n] <= most[n] + beyond * taken ? all[n] : most[n]);
    }
  }
  /// The eye, with a little room on all sides and no nearer than `least` µm, and what it looks at, as far away as `depth_of`.
  std::pair<Vec3, Vec3> camera(const Vec3& depth_of, float least) const {
    constexpr float room = 1.06f;
    const float distance = std::max(
        {(reach_[0] + reach_[1]) / (2.f * slopes_[0]), (reach_[2] + reach_[3]) / (2.f * slopes_[1])});
    const Vec3 across =
        .5f * (reach_[0] - reach_[1]) * axes_.col(0) + .5f * (reach_[2] - reach_[3]) * axes_.col(1);
    const float depth = axes_.col(2).dot(depth_of);
    const float away = std::max(room * (distance - depth), least);
    return {across + (depth + away) * axes_.col(2), across + depth * axes_.col(2)};
  }

 private:
  static constexpr std::size_t few = 4000;  // points for each that is left out
  Mat3 axes_;
  std::array<Vec3, 4> normals_;  // right, left, up, down
  std::array<float, 2> slopes_{};
  std::array<float, 4> reach_{};
};

/// How far what lies in that box reaches at most along a direction, µm.
float height_of(const Bounds& box, const Vec3& up) { return box.extent().dot(up.cwiseAbs()); }

}  // namespace

Mat3 standing(const Forest& forest) {
  // Where neurons stand in all directions, as over a hemisphere, z is up, as surfaces of brains have it.
  const Vec3 up = towards_pia(forest).value_or(Vec3::UnitZ());
  if (up == Vec3::UnitY()) return Mat3::Identity();
  Mat3 stands = Quat::FromTwoVectors(Vec3::UnitY(), up).toRotationMatrix();
  // A row of elements shows its face: in front is where somata spread least.
  constexpr float flat = .7f;  // of the deviations the other way
  Eigen::Matrix<float, 3, 2> level;
  level << stands.col(0), stands.col(2);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2f> spread(level.transpose() * forest.soma_spread() *
                                                              level);
  if (spread.eigenvalues()[0] >= flat * flat * spread.eigenvalues()[1]) return stands;
  Vec3 front = level * spread.eigenvectors().col(0);
  // From the side that z points to; of a hemisphere from outside.
  const float aside = front.dot(stands.col(2)), out = front.dot(forest.soma_bounds().centre());
  if ((std::abs(aside) > .1f ? aside : out) < 0.f) front = -front;
  stands.col(0) = stands.col(1).cross(front), stands.col(2) = front;
  return stands;
}

View parse_view(std::string_view text, const std::string& name, const Vec3& up, const View* whole) {
  const auto json = parse_json<Json>(
      text, name, "correct what stands there or before, as docs/scene/view.md shows", {.keys_once = true});
  if (!json.is_object())
    throw InputError(name, 0, "a view is a JSON object with 'eye' and 'target'; see docs/scene/view.md");
  const bool stands = !whole || json.contains("eye") || json.contains("target");
  View v = whole ? *whole : View();
  if (stands) v.camera = frame::Camera{.up = up}, v.fog = View().fog;
  read_all(v, json, keys_of_view(), name, "");  // what is misspelt first
  for (const char* needed : {"eye", "target"})
    if (stands && !json.contains(needed))
      throw InputError(name, 0, fmt::format("the view lacks '{}'; give it as [x, y, z] in µm", needed));
  if (v.camera.eye == v.camera.target)
    throw InputError(name, 0, "'eye' and 'target' are the same point; move one of them");
  if (v.camera.up.isZero()) throw InputError(name, 0, "'up' has no direction; give one such as [0, 1, 0]");
  return v;
}

std::string to_json(const View& view) { return write_all(view, keys_of_view()).dump(); }

// On dark ground through a colour of its own, for between white and the grey of what has no value lies grey; on light ground
// black, then a green that hardly any map has.
Vec3 below_threshold(Background background) {
  return light_of(background != Background::dark ? 0xC9CFD8 : 0x383E46);
}

Vec3 on_branches(const ColourMap& map, float t, Background background) {
  if (background != Background::dark) return .85f * map(t);
  constexpr float least = .07f;
  return (1.f - least) * map(t) + least * Vec3(.8f, .9f, 1.2f);
}

FlashColours flash_colours(Background background) {
  if (background == Background::dark) return {Vec3(1.f, 1.f, .92f), light_of(0x2FD6FF)};
  return {light_of(0x000000), light_of(0x00A040)};
}

std::vector<ViewKey> view_keys() { return facts_of(keys_of_view()); }
std::vector<ViewKey> activity_keys() { return facts_of(keys_of_activity()); }
std::vector<ViewKey> plane_keys() { return facts_of(keys_of_plane()); }

View overview(const Forest& forest, float aspect, std::span<const frame::State> states,
              std::span<const frame::Overlay> drawn) {
  if (is_gallery(forest)) return view_of_gallery(forest, aspect, states);
  const auto seen = seen_in(states);
  View view;
  view.camera.near = 2.f;
  const Mat3 stands = standing(forest);
  view.camera.up = stands.col(1);
  frame::Camera looking = view.camera;
  looking.eye = stands * Vec3(.42f, .16f, 1.f).normalized(), looking.target = Vec3::Zero();
  const float slope = std::tan(.5f * radians(view.camera.field_of_view));
  Enclosing enclosing(looking.axes(), slope * aspect, slope);

  Bounds bounds;  // as the forest stands; layers lie in place only where it stands along y
  bool all = true;
  for (std::uint32_t i = 0; i < forest.instances().size(); ++i) {
    const Vec3 at(forest.instances()[i].x, forest.instances()[i].y, forest.instances()[i].z);
    if (seen(i))
      bounds.add(stands.transpose() * at), enclosing.add(at);
    else
      all = false;
  }
  const float radius = all ? forest.circuit().radius : 0.f;
  const Vec3 axis = radius > 0.f || bounds.empty() ? Vec3(Vec3::Zero()) : bounds.centre();
  for (const auto& layer : all ? forest.layers_in_place() : std::vector<circuit::Layer>())
    for (const float y : {layer.bottom, layer.top}) {
      bounds.add({axis.x(), y, axis.z()});
      for (int i = 0; i < outline_corners; ++i) {
        const float turn = 2.f * std::numbers::pi_v<float> * float(i) / float(outline_corners);
        enclosing.add({axis.x() + radius * std::cos(turn), y, axis.z() + radius * std::sin(turn)});
      }
    }
  if (bounds.empty()) return view;
  // Fog is as deep as the whole forest, and would only dim a part of it.
  constexpr float least = .2f;
  if (const float whole = forest.soma_bounds().extent().norm(); !all && whole > 0.f)
    view.fog = std::clamp(bounds.extent().norm() / whole, least, 1.f);
  const Places branches = places_on_branches(forest, seen);
  enclosing.add_most(branches.places, !branches.all);
  for (const Sphere& s : branches.somata) enclosing.add(s.centre, s.radius);
  for (const frame::Overlay& line : drawn) enclosing.add(line.a), enclosing.add(line.b);
  // The near side of a wide forest shall not hide what lies behind it; a slab has none.
  const float wide = std::max(radius,
                              std::min(.25f * bounds.extent().norm(), reach_along(forest, stands.col(2)))),
              high = std::max(bounds.extent().y(), wide) + 120.f;
  const auto [eye, middle] =
      enclosing.camera(stands * bounds.centre(), 1.08f * std::max(.5f * high, wide) / slope + wide);
  view.camera.eye = eye, view.camera.target = middle;
  return view;
}

std::optional<Vec3> towards_pia(const Forest& forest) {
  if (is_gallery(forest)) return std::nullopt;
  if (const Vec3& up = forest.circuit().up; up != Vec3::UnitY()) return up.normalized();
  float along = 0.f;
  for (const frame::Instance& i : forest.instances())
    along += (Quat(i.qw, i.qx, i.qy, i.qz) * Vec3::UnitY()).y() / float(forest.instances().size());
  if (along > .5f) return Vec3::UnitY();
  return std::nullopt;
}

View portrait(const Forest& forest) {
  View view = overview(forest);
  const Bounds& bounds = forest.soma_bounds();
  if (bounds.empty()) return view;
  const Mat3 stands = standing(forest);
  const float radius = std::max(forest.circuit().radius, 50.f), height = height_of(bounds, stands.col(1));
  const Vec3 centre = bounds.centre();
  view.camera.field_of_view = 46.f;
  // The whole column, a little from above; what roots out of it below may be cut off.
  const float half = .56f * height + radius;
  const float away = half / std::tan(.5f * radians(view.camera.field_of_view)) + radius;
  view.camera.target = centre + .03f * height * stands.col(1);
  view.camera.eye = view.camera.target + away * (stands * Vec3(.45f, .16f, 1.f).normalized());
  view.camera.near = .5f;
  view.fog = 1.4f, view.halo = 1.5f;
  view.samples = 24;
  return view;
}

bool sees_through(const View& view, const Colouring& colouring) {
  frame::Frame f;
  f.opacities = colouring.opacities, f.states = colouring.states;
  return view.plane || frame::transparent(f);
}

std::uint32_t still_samples(const View& view, const Colouring& colouring, bool more) {
  // A thin line lies in half of the samples of a pixel: a fifth of sixteen leaves it one or two of them, and dotted.
  constexpr std::uint32_t see_through = 64;
  if (view.samples < samples_at_rest) return view.samples;  // as asked for
  return more || sees_through(view, colouring) ? std::max(view.samples, see_through) : view.samples;
}

float thinnest_of(const View& view) {
  return view.samples == 1 ? std::max(view.detail.thinnest, 1.f) : view.detail.thinnest;
}

View within(View view, const Budget& budget) {
  view.samples = budget.samples();
  view.detail.error *= budget.error();
  view.detail.thinnest = budget.thinnest(), view.detail.pixel = budget.pixel();
  view.detail.turns = budget.turns();
  return view;
}

float fog_strength(const View& view) {
  constexpr float on_light = .16f;
  return view.background != Background::dark ? on_light * view.fog : view.fog;
}

Detail detail_for(const View& view, std::uint32_t width, std::uint32_t height) {
  Detail detail = view.detail;
  detail.thinnest = thinnest_of(view);
  detail.fog = fog_strength(view);
  if (detail.gaze) detail.gaze = Vec2(detail.gaze->x() * float(width), detail.gaze->y() * float(height));
  return detail;
}

float least_width_of(const Forest& forest, const frame::Camera& camera, std::uint32_t width,
                     std::uint32_t height) {
  constexpr std::size_t most = 500;  // of more there is never room for all
  constexpr float lines_in_height = 700.f, sparse = .3f, dense = 1.f;
  if (forest.instances().size() > most) return 0.f;
  double length = 0.;  // of all branches, µm
  for (const frame::Instance& instance : forest.instances()) {
    const Neuron& neuron = forest.neurons()[instance.morphology];
    for (const SectionFacts& section : forest.sections().subspan(neuron.first_section, neuron.section_count))
      length += double(section.length);
  }
  // Pixels a µm in the middle of what is looked at, and how much of the picture the neurons take there at most.
  const Bounds& somata = forest.soma_bounds();
  if (somata.empty() || !(length > 0.)) return 0.f;
  const float scale =
      camera.focal(float(height)) /
      (camera.orthographic() ? 1.f : std::max((somata.centre() - camera.eye).norm(), camera.near));
  const float reach = scale * (.5f * somata.extent().norm() + forest.mean_reach());
  const float area = std::min(float(width) * float(height), std::numbers::pi_v<float> * reach * reach);
  const float least = std::max(1.f, float(height) / lines_in_height);
  const float share = float(length) * scale * least / area;
  return std::min(least, 4.f) * std::clamp((dense - share) / (dense - sparse), 0.f, 1.f);
}

Ground ground_of(Background background) {
  return background != Background::dark ? Ground{light_of(0xF7F9FC), light_of(0xE6EBF2), light_of(0xEDF1F7)}
                                        : Ground{light_of(0x0E1420), light_of(0x05070C), light_of(0x0A0F1A)};
}

frame::Frame compose(const Forest& forest, const View& view, const Colouring& colouring, const Cut& cut,
                     std::uint32_t width, std::uint32_t height, std::span<const frame::Overlay> overlays) {
  frame::Frame f;
  f.camera = view.camera;
  f.width = width, f.height = height, f.subframes = view.samples, f.thinnest = thinnest_of(view);
  f.least_width = view.least_width.value_or(least_width_of(forest, view.camera, width, height));
  f.palette = colouring.palette;
  f.opacities = colouring.opacities, f.states = colouring.states;
  if (cut.entries && cut.entries->of_activity)
    paint(f.palette, view.activity.value_or(ActivityView()), view.background != Background::dark);
  static_cast<frame::Lists&>(f) = cut.lists();
  f.overlays = overlays;
  frame::Style& s = f.style;
  constexpr float rim_on_light = .3f;  // a darkness among dark branches hides their colours
  s.halo = view.background != Background::dark ? rim_on_light * view.halo : view.halo;
  Ground ground = ground_of(view.background);
  if (view.behind) ground.top = ground.bottom = ground.fog = Vec3::Constant(*view.behind);
  s.background_top = ground.top, s.background_bottom = ground.bottom, s.fog_colour = ground.fog;
  if (const Fog fog = fog_of(forest, view.camera, fog_strength(view)); std::isfinite(fog.length))
    s.fog_start = fog.start, s.fog_length = fog.length;
  return f;
}

std::vector<frame::Overlay> outline(const Forest& forest) {
  constexpr float width = .12f;  // µm, half: thinner than the dendrites among which it is seen
  std::vector<frame::Overlay> lines;
  for (const auto& line : forest.circuit().outline)
    for (std::size_t i = 0; i + 1 < line.size(); ++i)
      lines.push_back({line[i], line[i + 1], width, outline_entry});
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
    for (int i = 0; i < sides; ++i) lines.push_back({corner(i, y), corner(i + 1, y), width, outline_entry});
  for (int i = 0; i < sides; i += sides / 8)
    lines.push_back({corner(i, low), corner(i, high), width, outline_entry});
  return lines;
}

}  // namespace forest::scene
