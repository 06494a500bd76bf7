// SPDX-License-Identifier: Apache-2.0
// What is told and shown of a picked branch: its facts as one table, and the marks over its subarbor.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "forest/core/bounds.h"
#include "forest/frame/frame.h"
#include "forest/scene/pick.h"
#include "forest/scene/skin.h"
#include "forest/scene/synapses.h"

namespace forest::studio {

/// A picked segment with the segments that grow out of its section.
struct Selection {
  scene::Pick pick;
  std::vector<std::uint32_t> subarbor;  // in Forest::segments()

  bool is_soma() const { return pick.section == scene::soma_section; }
};

Selection select(const scene::Forest& forest, const scene::Pick& pick);
/// The section that the selected one grows out of (the soma for a stem); none for the soma.
std::optional<scene::Pick> parent_of(const scene::Forest& forest, const scene::Pick& pick);

/// A row of the selection panel.
struct Fact {
  const char* name;  // in the field's words
  const char* unit;  // "" when it has none
  const char* hint;
  std::string value;
};
/// Those that apply: a soma has no order, a section no radius.
std::vector<Fact> facts(const scene::Forest& forest, const Selection& selection);
/// The same for a machine, {"neuron": 12, …}: lengths in µm.
nlohmann::ordered_json to_json(const scene::Forest& forest, const Selection& selection);

/// Of a synapse: what it does, who makes it and where it comes from.
std::vector<Fact> facts(const scene::Synapses& synapses, std::uint32_t synapse);
nlohmann::ordered_json to_json(const scene::Synapses& synapses, std::uint32_t synapse);

/// The section that a spine under a place of the picture stands on, where spines are drawn (scene/skin.h). As scene::pick has it.
/// @param has_skin  whether an instance is drawn with one
std::optional<scene::Pick> pick_spine(scene::Skin& skin, const scene::Forest& forest,
                                      const frame::Camera& camera, const frame::Viewport& viewport,
                                      const Vec2& place, const std::function<bool(std::uint32_t)>& has_skin);

inline constexpr std::size_t most_marks = 50'000;  // capsules of a highlight; the section itself comes first

/// Marks over a branch that taper as it does, in steps too small to be seen; each as wide as the branch there, or a little wider.
/// @param entry  of the palette
void add_marks(const RoundCone& branch, std::uint32_t entry, std::vector<frame::Overlay>& to);
/// Marks a hair's breadth wider than the branches: the picked section as scene::section_entry, the rest as highlight_entry.
std::vector<frame::Overlay> highlight(const scene::Forest& forest, const Selection& selection);
/// A sphere around the subarbor, in the world.
Sphere around(const scene::Forest& forest, const Selection& selection);

}  // namespace forest::studio
