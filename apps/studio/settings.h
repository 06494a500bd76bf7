// SPDX-License-Identifier: Apache-2.0
// All that a person can set in the studio, as one value and as tables of controls: a row feeds the view panel, the menus,
// the shortcuts and what a screen reader says.
#pragma once

#include <functional>
#include <span>
#include <string>

#include "forest/geometry/plane.h"
#include "forest/scene/view.h"

namespace forest::studio {

enum class Across : std::uint8_t { x, y, z, any };

struct Settings {
  scene::View view;
  bool plane = false;         // of intersection, with its section in a panel
  Across across = Across::z;  // the axis that the plane stands across, or a direction of its own
  float normal_azimuth = 135.f, normal_elevation = 35.f;  // of that direction, degrees, as those of the eye
  float plane_at = 0.f;  // along its normal from the middle of the forest, µm
  float plane_opacity = .18f;
  bool fly = false;           // a drag looks around instead of orbiting
  float speed = 120.f;        // of flight, µm/s
  bool gaze_follows = false;  // the gaze is where the mouse is
  bool outline = true;        // of the column and its layers
  bool legend = true;         // what colours mean
  bool scale = true;          // scale bar and directions
  bool dim = true;            // the rest of the forest while a branch is selected
  bool skin = false;          // of neurons near the eye; a target's that is forced to have one aside
  bool surfaces = true;       // of a cortex, where some are open
  scene::SynapseColour synapse_colour = scene::SynapseColour::sign;  // while none are shown: the last one
  float surface_opacity = 1.f;
  // What is open: nobody sets these.
  bool has_synapses = false, has_surfaces = false;
};

/// Called by a panel with what a person did, which is done to the settings of that moment.
using Change = std::function<void(const std::function<void(Settings&)>&)>;

/// The plane of intersection, `middle` being that of the forest.
Plane plane_of(const Settings& settings, const Vec3& middle, const Vec3& pia = Vec3::UnitY());

/// The view as text has it: with the plane in it, where it is shown.
scene::View whole_view(const Settings& settings, const Vec3& middle);
/// That as one line of JSON, which says too that neurons near the eye have a skin where they do.
std::string text_of(const Settings& settings, const Vec3& middle);
/// Whether a text of a view says so.
/// @param read  the view of that text, as far as it says nothing else that of its argument
bool asks_for_skin(const std::function<scene::View(const scene::View&)>& read);
/// From now on the settings show this view, and its plane or none.
void set_view(Settings& settings, const scene::View& view, const Vec3& middle);

/// A number with its unit. Rows that follow one another with the same `row` share a line.
struct Number {
  const char *group, *row, *name, *unit, *hint;
  const char* shortcut;  // puts the cursor into the field; "" for none
  double low, high, step;
  int decimals;
  float (*value)(const Settings&);
  void (*set)(Settings&, float);
};

/// One of several words.
struct Choice {
  const char *group, *name, *hint;
  const char* shortcut;  // goes on to the next word
  std::span<const char* const> words;
  int (*value)(const Settings&);
  void (*set)(Settings&, int);
};

/// On or off.
struct Toggle {
  const char *group, *name, *hint, *shortcut;
  bool (*value)(const Settings&);
  void (*set)(Settings&, bool);
  bool (*usable)(const Settings&) = [](const Settings&) { return true; };  // there is something to show
};

std::span<const char* const> groups();  // in the order of the panel
std::span<const Number> numbers();
std::span<const Choice> choices();
std::span<const Toggle> toggles();

}  // namespace forest::studio
