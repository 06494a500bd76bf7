// SPDX-License-Identifier: Apache-2.0
// What a picture shows besides branches: surfaces of a cortex, the skin of neurons near the eye, synapses. What the command
// line and the studio share.
#pragma once

#include <optional>

#include "forest/scene/skin.h"
#include "forest/scene/surfaces.h"
#include "forest/scene/synapses.h"
#include "forest/scene/view.h"

namespace forest {

struct DressingLimits {
  scene::SkinLimits skin;
  std::size_t synapses = 400'000;  // as Synapses::choose has it
};

struct Dressing {
  explicit Dressing(scene::Forest of) : forest(std::move(of)), skin(forest) {}

  scene::Forest forest;
  scene::Surfaces surfaces;
  scene::Skin skin;
  bool skinned = false;  // all neurons near the eye have one, not only those that a target forces to
  std::optional<scene::Synapses> synapses;  // none: nothing is known of any
  scene::Synapses::Choice chosen;           // those of the last picture, of all its layers
  scene::Skin::Figures skins;               // likewise

  /// Whether a picture of the view shows anything of them.
  bool wanted(const scene::View& view, const scene::Colouring& colouring) const;
  /// scene::sees_through, or skin that begins, or surfaces that are clear.
  bool sees_through(const scene::View& view, const scene::Colouring& colouring) const;
  /// scene::still_samples, which skin that begins and surfaces that are seen through need, too.
  std::uint32_t still_samples(const scene::View& view, const scene::Colouring& colouring) const;
  /// A picture begins, of one frame or of several layers.
  void begin() { chosen = {}, skins = {}; }
  /// Adds them to a frame composed of `cut`, as the view wants them. The frame must not outlive this object, or its next call.
  /// @param playing  activity takes the palette entries of branches
  void put_on(frame::Frame& frame, const scene::View& view, const scene::Cut& cut, const scene::Eye& eye,
              const scene::Colouring& colouring, bool playing, const scene::Chooser::Painter& painter,
              const DressingLimits& limits = {});

 private:
  scene::Synapses::Choice of_frame_;
};

}  // namespace forest
