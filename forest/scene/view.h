// SPDX-License-Identifier: Apache-2.0
// A view as text: where the eye is, where it looks, what colours mean. One line of JSON can be pasted to a colleague.
#pragma once

#include <algorithm>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "forest/frame/frame.h"
#include "forest/scene/colour_map.h"
#include "forest/scene/colouring.h"
#include "forest/scene/cut.h"

namespace forest::scene {

/// How a simulation is shown (playback.h), and which moment of it.
struct ActivityView {
  const ColourMap* map = &colour_maps().front();  // one of colour_maps()
  float low = -80.f, high = 20.f;                 // values at its ends, in the unit of the report
  std::optional<float> threshold;                 // what is less is dim and grey
  float speed =
      300.f;  // of spikes along axons, µm/ms; 0 for no flashes. Thin axons without myelin have some hundreds
  float fade = 1.f;                     // ms in which a flash falls to 1/e
  std::optional<double> time;           // ms; none: the beginning
  std::optional<std::uint32_t> neuron;  // that stands out: the colours of all others step back
};

/// A plane of intersection, clear as glass (slice_picture.h).
struct CutPlane {
  Vec3 at = Vec3::Zero();       // a point of it, µm
  Vec3 normal = Vec3::UnitZ();  // of any length but zero
  float opacity = .18f;         // how much of what lies behind it hides
};

struct View {
  frame::Camera camera;
  Detail detail;  // gaze in shares of the width and height here, so that a view fits every picture size
  ColourBy colour_by = ColourBy::type;
  Background background = Background::dark;
  std::optional<float>
      behind;  // not part of its text: the light, 0–1, of all ground and fog instead (frame/matte.h)
  std::uint32_t samples = 16;                    // subframes of a still picture
  float fog = 1.f;                               // strength of the depth cue; 0 for none
  float halo = 1.f;                              // strength of the rim around nearer branches; 0 for none
  std::optional<float> least_width;              // of branches, pixels, 0–4; none: least_width_of
  bool skin = true;                              // of neurons near the eye (skin.h)
  SynapseColour synapses = SynapseColour::sign;  // where there are some
  std::vector<Appearance> targets;               // how they are shown; later ones win
  std::optional<ActivityView> activity;          // used where there is a simulation to show
  std::optional<CutPlane> plane;
};

/// {"eye":[x,y,z],"target":[x,y,z],"up":[0,1,0],"field_of_view":40,"projection":"perspective","gaze":[.5,.5],"error":1,
///  "colour_by":"type","background":"dark","samples":16,"fog":1,"halo":1,"skin":true,"synapses":"sign","targets":[{"name":"L5","opacity":.4}],
///  "activity":{"map":"plasma","range":[-80,20],"threshold":-60,"speed":300,"fade":1,"time":12.5},
///  "plane":{"at":[0,1000,0],"normal":[0,0,1],"opacity":.18}}; only eye and target are needed, and these not where `whole` is given.
/// Throws InputError naming the wrong key. Unknown keys are errors too, so that a typing slip is noticed.
/// @param up     of the camera where nothing is said of it: the forest's (circuit::Circuit::up)
/// @param whole  what is shown as far as nothing else is said; without its camera and fog where there is an eye or a target
View parse_view(std::string_view json, const std::string& name = "view", const Vec3& up = Vec3::UnitY(),
                const View* whole = nullptr);
std::string to_json(const View& view);

/// A key of that object, and what it may hold: words, or the range of a number as "1–170"; none where there is more to say. So
/// docs/scene/view.md has it.
struct ViewKey {
  std::string name;
  std::vector<std::string> values;
};
std::vector<ViewKey> view_keys();
std::vector<ViewKey> activity_keys();  // of its `activity`
std::vector<ViewKey> plane_keys();     // of its `plane`

/// Whether an instance is seen, or a branch of it, as states say; where all are hidden, or nothing is said, all are.
inline auto seen_in(std::span<const frame::State> states) {
  const auto shown = [](const frame::State& s) {
    return s.is(frame::State::visible) || s.is(frame::State::parted);
  };
  return [states, shown, all = std::ranges::none_of(states, shown)](std::uint32_t instance) {
    return all || shown(states[instance]);
  };
}

/// The view that shows the whole forest, branches and all, from outside, a little from above.
/// @param aspect  width over height of the picture
/// @param states  of its instances: those that are hidden need no room, unless all are; what is seen has less fog, the smaller it is
/// @param drawn   lines beside it that are to be seen whole, as its outline
View overview(const Forest& forest, float aspect = 16.f / 9.f, std::span<const frame::State> states = {},
              std::span<const frame::Overlay> drawn = {});

/// A picture to hang on a wall: the column from its crown down, near enough to follow single dendrites.
View portrait(const Forest& forest);

/// Entries where activity colours branches: the map from low to high, what is below the threshold, what has no value, and
/// flashes from dim to bright.
inline constexpr std::uint32_t map_steps = 96, below_entry = 96, no_value_entry = 97, flash_entry = 98,
                               flash_steps = 16;
/// Where a neuron stands out (ActivityView::neuron) the map has half as many steps, and after them the same for the others.
inline constexpr std::uint32_t half_map_steps = map_steps / 2;

/// The colour of a branch whose value is a share 0–1 of the map's range, linear light: thin branches need some distance from the ground,
/// on which the ends of most maps would be lost.
Vec3 on_branches(const ColourMap& map, float t, Background background);
/// The colour of branches that are below the threshold there.
Vec3 below_threshold(Background background);

/// Of a flash on a branch that has a value: when it is new, and half faded. Linear light.
struct FlashColours {
  Vec3 bright, fading;
};
FlashColours flash_colours(Background background);

/// How wide branches are drawn at least where there is room for all of them, pixels: a seven hundredth of the picture's height, or 1.
/// Where they would cover the picture it is 0, as what is thin must be faint then, and in between it falls.
float least_width_of(const Forest& forest, const frame::Camera& camera, std::uint32_t width,
                     std::uint32_t height);

/// What lies behind everything, in linear light: at the top and the bottom of a picture, and in its fog.
struct Ground {
  Vec3 top, bottom, fog;
};
Ground ground_of(Background background);

/// The picture of a view. The spans of the frame point into `cut`, `colouring` and `overlays`, which must outlive it.
frame::Frame compose(const Forest& forest, const View& view, const Colouring& colouring, const Cut& cut,
                     std::uint32_t width, std::uint32_t height,
                     std::span<const frame::Overlay> overlays = {});

/// The view as one of those pictures that follow one another shows it: with the detail that the budget has time for.
View within(View view, const Budget& budget);

/// How strong the fog of its picture is. Light is added where the background is light, and bleaches the colours of dark branches
/// before it takes their contrast: so there is less of it.
float fog_strength(const View& view);
/// `view.detail` with the gaze in pixels of a picture of that size.
Detail detail_for(const View& view, std::uint32_t width, std::uint32_t height);
/// Whether something may be seen through: neurons, or the view's plane.
bool sees_through(const View& view, const Colouring& colouring);
/// Samples from which on a picture is one at rest, and none of those that follow one another quickly.
inline constexpr std::uint32_t samples_at_rest = 16;
/// Samples of a picture of that view at rest: more than it says where something is seen through, of which each sample shows all or nothing.
/// @param more  something is seen through beside neurons and the view's plane
std::uint32_t still_samples(const View& view, const Colouring& colouring, bool more = false);
/// Pixels that the thinnest lines of its picture measure (Detail::thinnest).
float thinnest_of(const View& view);

/// Turns y, which is up in a column, to the forest's way up (circuit::Circuit::up), and z, which is in front, to where somata that lie
/// in a slab spread least.
Mat3 standing(const Forest& forest);
/// Which way the pia lies: as the circuit says, or along y where neurons stand along it. Nothing where they stand in all directions.
std::optional<Vec3> towards_pia(const Forest& forest);

/// The outline of a column: circles at the limits of the layers and a few verticals; of what was planted in elements, that of
/// these (cortex/outline.h). Empty where there is neither.
std::vector<frame::Overlay> outline(const Forest& forest);

}  // namespace forest::scene
