// SPDX-License-Identifier: Apache-2.0
// How every neuron of a forest is shown: its colour, whether it is there at all, with what it is drawn, how much one sees
// through it. One small state a neuron, worked out anew whenever a view changes; nothing else is.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "forest/frame/frame.h"
#include "forest/scene/cut.h"
#include "forest/scene/targets.h"

namespace forest::scene {

struct View;
struct Gauge;

/// Of a neuron, of its kinds of branches, or of single places on these (gauge.h).
enum class ColourBy : std::uint8_t { type, layer, kind, neuron, target, depth, order, radius, distance };
inline constexpr std::array<std::string_view, 9> colour_by_words{
    "type", "layer", "kind", "neuron", "target", "depth", "order", "radius", "distance"};
/// What a picture is for: a transparent one for any ground that is put behind it, in the colours of a light one.
enum class Background : std::uint8_t { dark, light, transparent };
inline constexpr std::array<std::string_view, 3> background_words{"dark", "light", "transparent"};
/// What the colours of synapses mean (synapses.h): whether they excite, or whose they are; none: they are not shown.
enum class SynapseColour : std::uint8_t { none, sign, target };

/// A branch of one neuron: the section and all that grows out of it; soma_section means the whole neuron.
struct Branch {
  std::uint32_t neuron = 0, section = 0xffffffffu;
  bool operator==(const Branch&) const = default;
};

/// How a target or a branch is shown. What is not said stays as it was; of a view's appearances later ones win.
struct Appearance {
  std::string name;  // of the target, or an expression; "" when it is a branch
  std::optional<Branch> branch;
  std::optional<bool> visible;
  std::optional<std::uint32_t> colour;  // 0xrrggbb, sRGB
  std::optional<ColourBy> colour_by;    // instead of one colour
  std::optional<frame::Kind> kind;
  std::optional<float> opacity;                      // 0–1
  std::array<std::optional<float>, 8> opacity_of{};  // by section kind (1: the soma), times that
  std::optional<bool> simulated;                     // whether it shows a simulation that plays

  bool operator==(const Appearance&) const = default;
};

struct LegendEntry {
  std::string name;
  std::vector<Vec3> colours;  // linear light; several are the steps of one thing, such as a type's layers
};

/// Colours and states of all instances.
struct Colouring {
  frame::Palette palette;
  frame::Opacities opacities = frame::opaque();
  std::vector<frame::State> states;  // one an instance
  std::vector<Part> parts;           // by instance
  std::vector<LegendEntry> legend;
  std::shared_ptr<const Gauge> gauge = {};  // none: a kind of a class has one colour
  // Bit c: branches of class c are in its colours, and only somata in that of the class.
  std::uint16_t gauged = 0;

  Shown shown() const { return {states, parts}; }
  /// The palette entry of a segment in Forest::segments() that is no straw.
  std::uint8_t entry(const frame::State& state, std::uint32_t segment, std::uint32_t kind) const;
};

/// There are so many colour classes: where a view needs more, the rarest colours become the most similar of the others.
/// Throws Error for a target that is not there, a branch of a neuron that is not there, and two gauges in one picture.
Colouring colour(const Targets& targets, const View& view);
/// Without targets.
Colouring colour(const Forest& forest, ColourBy by, Background background);

/// Whose the entries of the palette are: eight a class of neurons, of which the last ones are those of a gauge where there is one; then eight that are always left for surfaces, which also take
/// those of unused classes; synapses by sign; marks: spikes that fade and that are new, what is picked, outlines, and what is bright.
inline constexpr std::uint32_t colour_classes = 14, gauge_classes = 5,
                               gauge_entry = 8 * (colour_classes - gauge_classes), synapse_entry = 120,
                               fading_entry = 123, spike_entry = 124, section_entry = 125,
                               outline_entry = 126, highlight_entry = 127;

/// Linear light of 0xrrggbb.
Vec3 light_of(std::uint32_t rgb);
/// sRGB 0–1 of linear light.
Vec3 screen_of(const Vec3& light);

}  // namespace forest::scene
