// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/colour_bar.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "forest/scene/playback.h"

namespace forest::scene {
namespace {

// In heights of a letter.
constexpr float margin = 1.6f, padding = 1.3f, line = 1.9f, thick = 1.2f, wide = 20.f;

std::size_t lines_of(const ColourBar& bar) {
  return (bar.map ? 1 : 0) + (!bar.title.empty() || !bar.units.empty()) + !bar.note.empty();
}
float mark_size(float letter) { return 1.1f * letter; }
float marks_width(const ColourBar& bar, float letter) {
  return bar.marks.empty() ? 0.f : (float(bar.marks.size()) + .7f) * mark_size(letter);
}
float thick_of(const ColourBar& bar) { return bar.map ? thick : 0.f; }
std::string note_of(const ActivityView& activity) {
  return fmt::format("a spike, then fading, {:g} µm/ms", activity.speed);
}
// Whether a plate of this size leaves enough of a picture.
bool fits(const frame::Image& image, float width, float height) {
  return width <= .65f * float(image.width) && height <= .65f * float(image.height);
}

}  // namespace

Writing writing_in(const frame::Image& image, Background background) {
  const bool dark = background == Background::dark;
  return {{.height = std::max(7.f, std::round(float(image.height) / 80.f)),
           .colour = dark ? Vec3(.89f, .91f, .94f) : Vec3(.13f, .16f, .20f)},
          dark ? Vec3(.03f, .05f, .075f) : Vec3(1.f, 1.f, 1.f)};
}

Vec3 ColourBar::at(float t) const {
  const bool below = threshold && low + t * (high - low) < *threshold;
  return below ? Vec3(.25f, .28f, .32f) : map->screen(t);
}

ColourBar bar_of(const ActivityView& activity, double time, const std::string& units, Background background) {
  const auto [bright, fading] = flash_colours(background);
  const bool flashes = activity.speed > 0.f;
  return {.map = activity.map,
          .marks = flashes ? std::vector{screen_of(bright), screen_of(fading)} : std::vector<Vec3>(),
          .low = activity.low,
          .high = activity.high,
          .units = units,
          .threshold = activity.threshold,
          .title = fmt::format("{:.1f} ms", time),
          .note = flashes ? note_of(activity) : ""};
}

ColourBar bar_of_spikes(const ActivityView& activity, double time, Background background) {
  frame::Palette palette = frame::black_palette();
  make_quiet(palette, background);
  return {.map = nullptr,
          .marks = {screen_of(palette[spike_entry]), screen_of(palette[fading_entry])},
          .title = fmt::format("{:.1f} ms", time),
          .note = activity.speed > 0.f ? note_of(activity) : "spikes are not shown"};
}

ColourBar bar_of(const Playback& playback, const ActivityView& activity, Background background) {
  const double time = activity.time.value_or(playback.begin());
  if (!playback.has_values()) return bar_of_spikes(activity, time, background);
  ActivityView shown = activity;
  if (playback.activity().spikes().empty()) shown.speed = 0.f;
  return bar_of(shown, time, playback.activity().facts().units, background);
}

void paint(frame::Image& image, const ColourBar& bar, const Box& place, const Lettering& letters) {
  // Whole columns: two halves of one let the ground through.
  const float first = std::round(place.left), steps = std::max(1.f, std::round(place.right) - first);
  for (float i = 0.f; i < steps; i += 1.f) {
    const float left = first + i;
    fill(image, {left, place.top, left + 1.f, place.bottom}, bar.at((i + .5f) / steps));
  }
  const float base = place.bottom + 1.7f * letters.height;
  const std::string high = fmt::format("{:.4g}", bar.high);
  letters.write(image, fmt::format("{:.4g}", bar.low), place.left, base);
  letters.write(image, high, place.right - letters.width(high), base);
}

bool paint(frame::Image& image, std::span<const ColourBar> bars, Background background) {
  const auto [letters, ground] = writing_in(image, background);
  const float h = letters.height;
  float tall = 0.f;
  for (const ColourBar& bar : bars)
    tall += h * (margin + 2.f * padding + thick_of(bar) + line * float(lines_of(bar)));
  if (bars.empty() || !fits(image, h * (wide + 2.f * padding), tall)) return false;
  float top = h * margin;
  for (const ColourBar& bar : bars) {
    const float left = h * (margin + padding), right = left + h * wide;
    const float bottom = top + h * (2.f * padding + thick_of(bar) + line * float(lines_of(bar)));
    const float note = bar.note.empty() ? 0.f : marks_width(bar, h) + letters.width(bar.note);
    fill(image, {left - h * padding, top, std::max(right, left + note) + h * padding, bottom}, ground, .62f);
    float base = top + h * (padding + 1.f);
    if (!bar.title.empty() || !bar.units.empty()) {
      letters.write(image, bar.title, left, base);
      letters.write(image, bar.units, right - letters.width(bar.units), base);
      base += h * line;
    }
    if (bar.map) {
      const Box place{left, base - h, right, base - h + h * thick};
      paint(image, bar, place, letters);
      base = place.bottom + h * (1.7f + line);
    }
    const float dot = mark_size(h);
    for (std::size_t i = 0; i < bar.marks.size(); ++i)
      fill(image, {left + float(i) * dot, base - dot, left + float(i + 1) * dot, base}, bar.marks[i]);
    letters.write(image, bar.note, left + marks_width(bar, h), base);
    top = bottom + h * margin;
  }
  return true;
}

bool paint(frame::Image& image, std::span<const LegendEntry> names, Background background, bool right) {
  const auto [letters, ground] = writing_in(image, background);
  const float h = letters.height, dot = mark_size(h), indent = dot + .7f * h;
  float widest = 0.f;
  for (const LegendEntry& entry : names) widest = std::max(widest, letters.width(entry.name));
  const float width = indent + widest + 2.f * padding * h,
              height = h * (2.f * padding + 1.f + line * (float(names.size()) - 1.f));
  if (names.empty() || !fits(image, width + margin * h, height + margin * h)) return false;
  const float left = right ? float(image.width) - h * margin - width : h * margin, top = h * margin;
  fill(image, {left, top, left + width, top + height}, ground, .62f);
  float base = top + h * (padding + 1.f);
  for (const LegendEntry& entry : names) {
    const float at = std::round(left + h * padding), foot = std::round(base);
    fill(image, {at, foot - std::round(dot), at + std::round(dot), foot}, screen_of(entry.colour));
    letters.write(image, entry.name, at + indent, base);
    base += h * line;
  }
  return true;
}

}  // namespace forest::scene
