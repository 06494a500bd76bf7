// SPDX-License-Identifier: Apache-2.0
#include "apps/dressing.h"

#include <algorithm>

namespace forest {
namespace {

constexpr std::size_t most_triangles_at_rest = 4'000'000;

bool has_skin(const frame::State& state) { return state.kind == frame::Kind::skin; }

bool forced(const scene::Colouring& colouring) {
  constexpr auto skin = std::uint8_t(frame::Kind::skin);
  // Most have no bit of it.
  return ((std::uint8_t(frame::bits_of(colouring.states).any.kind) & skin) == skin &&
          std::ranges::any_of(colouring.states, has_skin)) ||
         std::ranges::any_of(colouring.parts, has_skin, &scene::Part::state);
}

// With a skin for those alone that are forced to have one.
scene::Colouring alone(scene::Colouring colouring) {
  const auto bare = [](frame::State& state) {
    if (state.kind == frame::Kind::any) state.kind = frame::Kind::capsules;
  };
  std::ranges::for_each(colouring.states, bare);
  for (scene::Part& part : colouring.parts) bare(part.state);
  return colouring;
}

}  // namespace

bool Dressing::wanted(const scene::View& view, const scene::Colouring& colouring) const {
  return (!surfaces.empty() && surfaces.visibility > 0.f) || (view.skin && (skinned || forced(colouring))) ||
         (synapses && view.synapses != scene::SynapseColour::none);
}

bool Dressing::sees_through(const scene::View& view, const scene::Colouring& colouring) const {
  return scene::sees_through(view, colouring) || (view.skin && (skinned || forced(colouring))) ||
         (!surfaces.empty() && surfaces.visibility > 0.f && surfaces.visibility < 1.f);
}

std::uint32_t Dressing::still_samples(const scene::View& view, const scene::Colouring& colouring) const {
  return scene::still_samples(view, colouring, sees_through(view, colouring));
}

void Dressing::put_on(frame::Frame& frame, const scene::View& view, const scene::Cut& cut,
                      const scene::Eye& eye, const scene::Colouring& colouring, bool playing,
                      const scene::Chooser::Painter& painter, const DressingLimits& limits) {
  surfaces.show(frame, colouring, playing);
  // Where there is time to make pieces there is some for what the pixels can show: a voxel is some pixels wide, and half of the
  // triangles are averted.
  scene::SkinLimits most = limits.skin;
  if (most.new_pieces > 0)
    most.triangles =
        std::clamp(3 * std::size_t(frame.width) * frame.height, most.triangles, most_triangles_at_rest);
  if (view.skin && skinned)
    skin.show(frame, cut, eye, colouring, painter, most);
  else if (view.skin && forced(colouring))
    skin.show(frame, cut, eye, alone(colouring), painter, most);
  else
    skin.rest();
  skins += skin.figures();
  if (!synapses) return;
  const bool taken = playing && view.synapses == scene::SynapseColour::target;
  of_frame_ =
      synapses->choose(eye, colouring, taken ? scene::SynapseColour::sign : view.synapses, limits.synapses);
  chosen.balls.insert(chosen.balls.end(), of_frame_.balls.begin(), of_frame_.balls.end());
  chosen.synapses.insert(chosen.synapses.end(), of_frame_.synapses.begin(), of_frame_.synapses.end());
  scene::paint_synapses(frame.palette, view.background);
  frame.balls = of_frame_.balls;
}

}  // namespace forest
