// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/colour_bar.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "forest/core/round_numbers.h"
#include "forest/scene/gauge.h"
#include "forest/scene/playback.h"
#include "forest/scene/surfaces.h"

namespace forest::scene {
namespace {

// In heights of a letter.
constexpr float margin = 1.6f, padding = 1.3f, line = 1.9f, thick = 1.2f, wide = 20.f;

constexpr float share_at_most = .65f;  // of a picture's width and height that a plate takes

std::size_t lines_of(const ColourBar& bar) {
  return (bar.map ? 1 : 0) + (!bar.title.empty() || !bar.units.empty()) + !bar.note.empty();
}
float mark_size(float letter) { return 1.1f * letter; }
// Steps stand side by side, half as wide.
float swatch_width(const LegendEntry& entry, float letter) {
  const auto n = float(entry.colours.size());
  return mark_size(letter) * (n > 1.f ? .5f * n : n);
}
float marks_width(const ColourBar& bar, float letter) {
  return bar.marks.empty() ? 0.f : (float(bar.marks.size()) + .7f) * mark_size(letter);
}
float thick_of(const ColourBar& bar) { return bar.map ? thick : 0.f; }
std::string note_of(const ActivityView& activity) {
  return fmt::format("a spike, then fading, {:g} µm/ms", activity.speed);
}
// Whether a plate of this size leaves enough of a picture.
bool fits(const frame::Viewport& picture, float width, float height) {
  return width <= share_at_most * picture.width && height <= share_at_most * picture.height;
}
float tall(const ColourBar& bar) { return thick_of(bar) + line * float(lines_of(bar)); }

}  // namespace

Vec3 ColourBar::at(float t) const {
  const bool is_less = threshold && low + t * (high - low) < *threshold;
  if (is_less) return screen_of(below_threshold(branches.value_or(Background::dark)));
  return branches ? screen_of(on_branches(*map, t, *branches)) : map->screen(t);
}

std::pair<std::string, std::string> ColourBar::ends() const {
  for (int digits = 4;; ++digits) {
    std::pair ends(fmt::format("{:.{}g}", low, digits), fmt::format("{:.{}g}", high, digits));
    if (ends.first == ends.second && digits < 9) continue;
    if (below) ends.first = "≤ " + ends.first;
    if (above) ends.second = "≥ " + ends.second;
    return ends;
  }
}

std::vector<ColourBar::Tick> ColourBar::between() const {
  std::vector<Tick> all;
  const auto tell = [&](float value) {
    all.push_back({(value - low) / (high - low), fmt::format("{:g}", value)});
  };
  if (threshold) return tell(*threshold), all;
  for (const double value : ticks(double(low), double(high), 4))
    if (!whole || value == std::round(value)) tell(float(value));
  return all;
}

std::optional<ColourBar> bar_of(const Colouring& colouring, Background background) {
  if (!colouring.gauge) return std::nullopt;
  const Gauge& gauge = *colouring.gauge;
  return ColourBar{.map = &gauge_map(background),
                   .marks = {screen_of(gauge_soma(background))},
                   .high = gauge.high,
                   .above = gauge.above,
                   .whole = gauge.whole,
                   .units = gauge.unit,
                   .title = gauge.title,
                   .note = "soma"};
}

std::optional<ColourBar> bar_of(const Surfaces& surfaces) {
  if (!surfaces.has_values()) return std::nullopt;
  const auto [low, high] = surfaces.shown_range();
  const auto [below, above] = surfaces.beyond_range();
  return ColourBar{
      .map = surfaces.map, .low = low, .high = high, .below = below, .above = above, .title = surfaces.title};
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
          .note = flashes ? note_of(activity) : "",
          .branches = background};
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
  const auto [low, high] = bar.ends();
  letters.write(image, low, place.left, base);
  letters.write(image, high, place.right - letters.width(high), base);
  const float apart = 1.3f * letters.height, end = place.right - letters.width(high) - apart;
  float begin = place.left + letters.width(low) + apart;
  for (const ColourBar::Tick& tick : bar.between()) {
    const float at = place.left + tick.at * (place.right - place.left),
                half = .5f * letters.width(tick.label);
    if (at - half < begin || at + half > end) continue;
    letters.write(image, tick.label, at - half, base);
    begin = at + half + apart;
  }
}

std::optional<Block> block_of(std::span<const ColourBar> bars, const frame::Viewport& picture,
                              Background background) {
  const Lettering letters = letters_in(picture, background);
  const float h = letters.height;
  float width = h * wide, height = h * (2.f * padding - margin);
  for (const ColourBar& bar : bars) {
    height += h * (margin + tall(bar));
    if (!bar.note.empty()) width = std::max(width, marks_width(bar, h) + letters.width(bar.note));
  }
  width += 2.f * h * padding;
  if (bars.empty() || !fits(picture, h * (wide + 2.f * padding), height)) return std::nullopt;
  const auto paint_all = [list = std::vector(bars.begin(), bars.end()), letters, h](frame::Image& image,
                                                                                    float left, float top) {
    left += h * padding;
    const float right = left + h * wide, dot = mark_size(h);
    for (const ColourBar& bar : list) {
      float base = top + h * (padding + 1.f);
      if (!bar.title.empty() || !bar.units.empty()) {
        // Units may be long, and leave the title two thirds of the room.
        const float room = right - left - (bar.units.empty() ? 0.f : h);
        const std::string title =
            letters.shortened(bar.title, std::max(room - letters.width(bar.units), room / 1.5f));
        const std::string units = letters.shortened(bar.units, room - letters.width(title));
        letters.write(image, title, left, base);
        letters.write(image, units, right - letters.width(units), base);
        base += h * line;
      }
      if (bar.map) {
        const Box place{left, base - h, right, base - h + h * thick};
        scene::paint(image, bar, place, letters);
        base = place.bottom + h * (1.7f + line);
      }
      for (std::size_t i = 0; i < bar.marks.size(); ++i)
        fill(image, {left + float(i) * dot, base - dot, left + float(i + 1) * dot, base}, bar.marks[i]);
      letters.write(image, bar.note, left + marks_width(bar, h), base);
      top += h * (margin + tall(bar));
    }
  };
  return Block{Block::values, Spot::top_left, width, height, h * margin, paint_all};
}

std::optional<Block> block_of(std::span<const LegendEntry> all, const frame::Viewport& picture,
                              Background background) {
  const Lettering letters = letters_in(picture, background);
  const float h = letters.height;
  float indent = 0.f;
  for (const LegendEntry& entry : all) indent = std::max(indent, swatch_width(entry, h) + .7f * h);
  // What has no room is shortened, and counted.
  const float room = share_at_most * picture.width - indent - (2.f * padding + margin) * h,
              rows = (share_at_most * picture.height / h - margin - 2.f * padding - 1.f) / line + 1.f;
  if (all.empty() || room < 8.f * h || rows < std::min(3.f, float(all.size()))) return std::nullopt;
  std::vector<LegendEntry> names(all.begin(), all.end());
  if (float(names.size()) > rows) {
    names.resize(std::size_t(rows) - 1);
    names.push_back({fmt::format("… and {} more", all.size() - names.size()), {}});
  }
  float widest = 0.f;
  for (LegendEntry& entry : names) {
    entry.name = letters.shortened(std::move(entry.name), room);
    widest = std::max(widest, letters.width(entry.name));
  }
  const float width = indent + widest + 2.f * padding * h,
              height = h * (2.f * padding + 1.f + line * (float(names.size()) - 1.f));
  const auto paint_all = [names, letters, h, indent](frame::Image& image, float left, float top) {
    float base = top + h * (padding + 1.f);
    for (const LegendEntry& entry : names) {
      const float at = std::round(left + h * padding), foot = std::round(base);
      const auto n = float(entry.colours.size());
      for (float k = 0.f; k < n; k += 1.f) {
        const float wide = swatch_width(entry, h) / n;
        fill(image,
             {at + std::round(k * wide), foot - std::round(mark_size(h)), at + std::round((k + 1.f) * wide),
              foot},
             screen_of(entry.colours[std::size_t(k)]));
      }
      letters.write(image, entry.name, at + indent, base);
      base += h * line;
    }
  };
  return Block{Block::names, Spot::top_left, width, height, h * margin, paint_all};
}

}  // namespace forest::scene
