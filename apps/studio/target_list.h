// SPDX-License-Identifier: Apache-2.0
// What the panel of targets lists, and what its controls do to a view: as tables of values, without a window.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "forest/scene/view.h"

namespace forest::studio {

/// A target, or the selected branch, as it is shown now.
struct TargetRow {
  enum class Seen { none, some, all };

  scene::Appearance who;  // its name or branch alone
  std::string title, origin;
  std::size_t count = 0;  // neurons
  Seen seen = Seen::none;
  // Of apical dendrites, linear light, each once; none where colours change along branches.
  std::vector<Vec3> colours;
  // Of its first neuron:
  frame::Kind kind = frame::Kind::any;
  float opacity = 1.f;
  bool simulated = true;
  std::string problem;  // why it cannot be shown; "" when it can
};

/// The selected branch first, then expressions of the view that are no names, then all that Targets lists.
std::vector<TargetRow> target_rows(const scene::Targets& targets, const scene::View& view,
                                   const scene::Colouring& colouring,
                                   const std::optional<scene::Branch>& selected);

/// What `what` says holds from now on for `who`, whatever the view said before of it or of others: what is said last wins.
/// @param own_colour  false: what was said of its colour is forgotten
void change_target(scene::View& view, const scene::Appearance& who, const scene::Appearance& what,
                   bool own_colour = true);

/// That alone is shown of now on, and `all` else hidden.
void show_only(scene::View& view, const scene::Appearance& all, const scene::Appearance& who);
/// Nothing is hidden any more; what else was said of targets stays.
void show_all(scene::View& view);

/// Words that colour a target: those of a view's way of colouring, or one colour.
struct TargetColour {
  const char* name;
  std::optional<std::uint32_t> rgb;
  std::optional<scene::ColourBy> by;  // neither: as the rest of the view
};
std::span<const TargetColour> target_colours();
/// In the order of frame::Kind.
std::span<const char* const> kind_words();

}  // namespace forest::studio
