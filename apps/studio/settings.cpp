// SPDX-License-Identifier: Apache-2.0
#include "apps/studio/settings.h"

#include <cmath>

#include <nlohmann/json.hpp>

#include "apps/studio/camera_control.h"

namespace forest::studio {
namespace {

using S = Settings;

constexpr const char* group_names[] = {"Eye",    "Flight", "Gaze",  "Plane",
                                       "Detail", "Colour", "Depth", "Shown"};
constexpr const char* colour_words[] = {"Cell type",    "Layer",  "Kind of branch",
                                        "Neuron",       "Target", "Depth",
                                        "Branch order", "Radius", "Distance from the soma"};
constexpr const char* background_words[] = {"Dark", "Light"};
constexpr const char* projection_words[] = {"Perspective", "Orthographic"};
constexpr const char* synapse_words[] = {"Excitatory or inhibitory", "As their target"};
constexpr const char* across_words[] = {"x", "y", "z", "Any direction"};

constexpr double far = 1e6;  // µm

template <Vec3 frame::Camera::*point, int axis>
float coordinate(const S& s) {
  return (s.view.camera.*point)[axis];
}
template <Vec3 frame::Camera::*point, int axis>
void set_coordinate(S& s, float value) {
  frame::Camera moved = s.view.camera;
  (moved.*point)[axis] = value;
  if (bearing(moved).distance >= shortest) s.view.camera = moved;
}
template <float Bearing::*angle>
float turn(const S& s) {
  return bearing(s.view.camera).*angle;
}
template <float Bearing::*angle>
void set_turn(S& s, float value) {
  Bearing b = bearing(s.view.camera);
  b.*angle = value;
  s.view.camera = looking(s.view.camera, b);
}
void set_distance(S& s, float value) {
  Bearing b = bearing(s.view.camera);
  b.distance = value;
  s.view.camera = around_target(s.view.camera, b);
}

Vec2 gaze(const S& s) { return s.view.detail.gaze.value_or(Vec2(.5f, .5f)); }
template <int axis>
void set_gaze(S& s, float percent) {
  if (!s.view.detail.gaze) return;
  (*s.view.detail.gaze)[axis] = percent / 100.f;
}

scene::SynapseColour synapse_colour(const S& s) {
  return s.view.synapses == scene::SynapseColour::none ? s.synapse_colour : s.view.synapses;
}

using Camera = frame::Camera;
constexpr Number number_table[] = {
    {"Eye", "Eye", "x", "µm", "Where the eye is", "Alt+X", -far, far, 10, 1, coordinate<&Camera::eye, 0>,
     set_coordinate<&Camera::eye, 0>},
    {"Eye", "Eye", "y", "µm", "Where the eye is; in a forest y grows towards the pia", "Alt+Y", -far, far, 10,
     1, coordinate<&Camera::eye, 1>, set_coordinate<&Camera::eye, 1>},
    {"Eye", "Eye", "z", "µm", "Where the eye is", "Alt+Z", -far, far, 10, 1, coordinate<&Camera::eye, 2>,
     set_coordinate<&Camera::eye, 2>},
    {"Eye", "Target", "x", "µm", "The point looked at and orbited about", "Alt+Shift+X", -far, far, 10, 1,
     coordinate<&Camera::target, 0>, set_coordinate<&Camera::target, 0>},
    {"Eye", "Target", "y", "µm", "The point looked at; in a forest y grows towards the pia", "Alt+Shift+Y",
     -far, far, 10, 1, coordinate<&Camera::target, 1>, set_coordinate<&Camera::target, 1>},
    {"Eye", "Target", "z", "µm", "The point looked at and orbited about", "Alt+Shift+Z", -far, far, 10, 1,
     coordinate<&Camera::target, 2>, set_coordinate<&Camera::target, 2>},
    {"Eye", "Azimuth", "", "°", "Direction of view about the vertical: 0 towards -z, 90 towards +x", "Alt+A",
     -180, 180, 5, 1, turn<&Bearing::azimuth>, set_turn<&Bearing::azimuth>},
    {"Eye", "Elevation", "", "°",
     "Direction of view: 90 straight up, in a forest to the pia, -90 straight down", "Alt+L", -steepest,
     steepest, 5, 1, turn<&Bearing::elevation>, set_turn<&Bearing::elevation>},
    {"Eye", "Distance", "", "µm", "From the eye to the target", "Alt+D", shortest, far, 10, 1,
     turn<&Bearing::distance>, set_distance},
    {"Eye", "Field of view", "", "°", "Height of the picture as an angle at the eye", "Alt+O", 1, 170, 5, 1,
     [](const S& s) { return s.view.camera.field_of_view; },
     [](S& s, float v) { s.view.camera.field_of_view = v; }},
    {"Flight", "Speed", "", "µm/s", "Of flight with W A S D Q E; four times as fast with Shift", "Alt+S", 1,
     5000, 20, 0, [](const S& s) { return s.speed; }, [](S& s, float v) { s.speed = v; }},
    {"Gaze", "Gaze", "x", "%", "Share of the width of the picture, from its left", "Alt+G", 0, 100, 5, 0,
     [](const S& s) { return 100.f * gaze(s).x(); }, set_gaze<0>},
    {"Gaze", "Gaze", "y", "%", "Share of the height of the picture, from its top", "Alt+Shift+G", 0, 100, 5,
     0, [](const S& s) { return 100.f * gaze(s).y(); }, set_gaze<1>},
    {"Gaze", "Acuity slope", "", "′/°",
     "How fast detail falls off: arc minutes of resolution a degree of eccentricity (people: 1.3 to 1.7)",
     "Alt+U", 0, 60, .1, 2, [](const S& s) { return s.view.detail.acuity_slope; },
     [](S& s, float v) { s.view.detail.acuity_slope = v; }},
    {"Gaze", "Fovea", "", "°", "Around the gaze so many degrees are drawn as without one", "Alt+Shift+F", 0,
     90, .5, 1, [](const S& s) { return s.view.detail.fovea; },
     [](S& s, float v) { s.view.detail.fovea = v; }},
    {"Gaze", "Screen", "", "°",
     "Height of the picture as an angle at your eye; 0: as large as the field of view", "Alt+Shift+S", 0, 170,
     5, 1, [](const S& s) { return s.view.detail.screen; }, [](S& s, float v) { s.view.detail.screen = v; }},
    {"Plane", "Place", "", "µm",
     "Of the plane of intersection, along its normal from the middle of the forest", "Alt+P", -far, far, 5, 1,
     [](const S& s) { return s.plane_at; }, [](S& s, float v) { s.plane_at = v; }},
    {"Plane", "Normal", "az", "°", "Direction of the plane's normal about the vertical", "Alt+B", -180, 180,
     5, 0, [](const S& s) { return s.normal_azimuth; },
     [](S& s, float v) { s.normal_azimuth = v, s.across = Across::any; }},
    {"Plane", "Normal", "el", "°", "Direction of the plane's normal above the horizontal", "Alt+Shift+B", -90,
     90, 5, 0, [](const S& s) { return s.normal_elevation; },
     [](S& s, float v) { s.normal_elevation = v, s.across = Across::any; }},
    {"Plane", "Opacity", "", "%", "How much of what lies behind the plane it hides", "Alt+Shift+P", 0, 100, 5,
     0, [](const S& s) { return 100.f * s.plane_opacity; },
     [](S& s, float v) { s.plane_opacity = v / 100.f; }},
    {"Detail", "Acceptable error", "", "pixels", "How far, at most, anything may be drawn from its place",
     "Alt+R", .05, 100, .25, 2, [](const S& s) { return s.view.detail.error; },
     [](S& s, float v) { s.view.detail.error = v; }},
    {"Detail", "Samples", "", "a pixel", "Pictures averaged when the view stands still: 1 rough, 16 smooth",
     "Alt+M", 1, 1024, 4, 0, [](const S& s) { return float(s.view.samples); },
     [](S& s, float v) { s.view.samples = std::uint32_t(v); }},
    {"Shown", "Surface opacity", "", "%", "Of the surfaces of a cortex: 100 hides what lies behind", "Alt+E",
     0, 100, 10, 0, [](const S& s) { return 100.f * s.surface_opacity; },
     [](S& s, float v) { s.surface_opacity = v / 100.f; }},
    {"Depth", "Fog", "", "×", "How fast what is far fades; 0 for none", "Alt+I", 0, 100, .25, 2,
     [](const S& s) { return s.view.fog; }, [](S& s, float v) { s.view.fog = v; }},
    {"Depth", "Halo", "", "×", "Dark rim around nearer branches; 0 for none", "Alt+J", 0, 10, .25, 2,
     [](const S& s) { return s.view.halo; }, [](S& s, float v) { s.view.halo = v; }},
};

constexpr Choice choice_table[] = {
    {"Eye", "Projection",
     "Perspective as an eye sees, or orthographic: as large near as far, true at the target's depth", "J",
     projection_words, [](const S& s) { return int(s.view.camera.projection); },
     [](S& s, int i) { s.view.camera.projection = frame::Projection(i); }},
    {"Plane", "Across", "The axis that the plane of intersection stands across", "Shift+K", across_words,
     [](const S& s) { return int(s.across); }, [](S& s, int i) { s.across = Across(i); }},
    {"Colour", "Colour by", "What a colour means; the legend names it", "C", colour_words,
     [](const S& s) { return int(s.view.colour_by); },
     [](S& s, int i) { s.view.colour_by = scene::ColourBy(i); }},
    {"Colour", "Synapse colour", "What the colours of synapses mean", "Shift+Y", synapse_words,
     [](const S& s) { return int(synapse_colour(s) == scene::SynapseColour::target); },
     [](S& s, int i) { s.view.synapses = i ? scene::SynapseColour::target : scene::SynapseColour::sign; }},
    {"Colour", "Background", "Dark for the eye and film, light for print", "B", background_words,
     [](const S& s) { return int(s.view.background != scene::Background::dark); },
     [](S& s, int i) { s.view.background = scene::Background(i); }},
};

constexpr Toggle toggle_table[] = {
    {"Flight", "Fly", "A drag looks around from where the eye is, instead of orbiting the target", "V",
     [](const S& s) { return s.fly; }, [](S& s, bool on) { s.fly = on; }},
    {"Gaze", "Gaze-contingent detail", "Full detail only where one looks, less around it", "G",
     [](const S& s) { return s.view.detail.gaze.has_value(); },
     [](S& s, bool on) {
       s.view.detail.gaze = on ? std::optional(gaze(s)) : std::nullopt;
       s.gaze_follows &= on;
     }},
    {"Gaze", "Gaze follows the mouse", "The point looked at is where the mouse is", "M",
     [](const S& s) { return s.gaze_follows; },
     [](S& s, bool on) {
       s.gaze_follows = on;
       if (on) s.view.detail.gaze = gaze(s);
     }},
    {"Plane", "Plane of intersection", "A plane through the forest, and its section in a panel", "K",
     [](const S& s) { return s.plane; }, [](S& s, bool on) { s.plane = on; }},
    {"Depth", "Dim the rest", "The forest steps back while a branch is selected", "X",
     [](const S& s) { return s.dim; }, [](S& s, bool on) { s.dim = on; }},
    {"Shown", "Synapses", "Where their branches are in sight, when a file of synapses is open", "Y",
     [](const S& s) { return s.has_synapses && s.view.synapses != scene::SynapseColour::none; },
     [](S& s, bool on) {
       s.synapse_colour = synapse_colour(s);
       s.view.synapses = on ? s.synapse_colour : scene::SynapseColour::none;
     },
     [](const S& s) { return s.has_synapses; }},
    {"Shown", "Skin", "Neurons near the eye have a smooth skin and spines, once the view stands still", "N",
     [](const S& s) { return s.skin && s.view.skin; },
     [](S& s, bool on) {
       s.skin = on;
       s.view.skin |= on;
     }},
    {"Shown", "Surfaces", "Of a cortex, when some are open", "U",
     [](const S& s) { return s.has_surfaces && s.surfaces; }, [](S& s, bool on) { s.surfaces = on; },
     [](const S& s) { return s.has_surfaces; }},
    {"Shown", "Outline", "The column and the limits of its layers", "O", [](const S& s) { return s.outline; },
     [](S& s, bool on) { s.outline = on; }},
    {"Shown", "Legend", "What colours mean", "L", [](const S& s) { return s.legend; },
     [](S& s, bool on) { s.legend = on; }},
    {"Shown", "Scale and directions", "A scale bar, true at the target's depth, and the axes of the tissue",
     "R", [](const S& s) { return s.scale; }, [](S& s, bool on) { s.scale = on; }},
};

}  // namespace

Plane plane_of(const Settings& s, const Vec3& middle, const Vec3& pia) {
  const float azimuth = radians(s.normal_azimuth), elevation = radians(s.normal_elevation);
  const Vec3 normals[] = {Vec3::UnitX(), Vec3::UnitY(), Vec3::UnitZ(),
                          Vec3(std::cos(elevation) * std::sin(azimuth), std::sin(elevation),
                               -std::cos(elevation) * std::cos(azimuth))};
  return Plane::through(middle, normals[int(s.across)], pia).moved(s.plane_at);
}

scene::View whole_view(const Settings& settings, const Vec3& middle) {
  scene::View view = settings.view;
  if (settings.plane) {
    const Plane plane = plane_of(settings, middle);
    view.plane = {.at = plane.origin, .normal = plane.normal, .opacity = settings.plane_opacity};
  }
  return view;
}

std::string text_of(const Settings& settings, const Vec3& middle) {
  auto text = nlohmann::ordered_json::parse(scene::to_json(whole_view(settings, middle)));
  // A view alone says only where none may be: most pictures show one to those that ask for it beside the view.
  if (settings.skin && settings.view.skin) text["skin"] = true;
  return text.dump();
}

bool asks_for_skin(const std::function<scene::View(const scene::View&)>& read) {
  scene::View without;
  without.skin = false;
  return read(without).skin;
}

void set_view(Settings& s, const scene::View& view, const Vec3& middle) {
  s.view = view;
  s.view.plane.reset();
  s.plane = view.plane.has_value();
  if (!view.plane) return;
  const Vec3 normal = view.plane->normal.normalized();
  s.across = Across::any;
  for (const Across axis : {Across::x, Across::y, Across::z})
    if (normal[int(axis)] > 1.f - 1e-6f) s.across = axis;
  s.normal_azimuth = degrees(std::atan2(normal.x(), -normal.z()));
  s.normal_elevation = degrees(std::asin(std::clamp(normal.y(), -1.f, 1.f)));
  s.plane_at = normal.dot(view.plane->at - middle);
  s.plane_opacity = view.plane->opacity;
}

std::span<const char* const> groups() { return group_names; }
std::span<const Number> numbers() { return number_table; }
std::span<const Choice> choices() { return choice_table; }
std::span<const Toggle> toggles() { return toggle_table; }

}  // namespace forest::studio
