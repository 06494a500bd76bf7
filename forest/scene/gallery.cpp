// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/gallery.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "forest/core/half.h"
#include "forest/scene/arrangement.h"
#include "forest/scene/placed.h"

namespace forest::scene {
namespace {

constexpr const char* traced = "traced";      // the layer that neurons of a gallery lie in
constexpr float gap = .12f, least_gap = 5.f;  // between neurons: of their mean extent; µm
constexpr float row_gap = 1.8f;               // times that between rows, where names stand
constexpr float least_slot = .6f;  // of the mean width: what a neuron takes, that its name has room
constexpr float filled = .9f;      // of the picture's width or height
constexpr int stops = 24;          // on the way around

struct Row {
  std::size_t first = 0, end = 0;
  float width = 0.f, above = 0.f, below = 0.f;  // of somata
};

// As many neurons in each row as are not wider than `most`, at least one.
std::vector<Row> rows_of(std::span<const Bounds> boxes, float most, float apart) {
  std::vector<Row> rows;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const float wide = boxes[i].extent().x();
    if (rows.empty() || rows.back().width + apart + wide > most) rows.push_back({.first = i, .end = i});
    Row& row = rows.back();
    row.width += wide + (row.end > row.first ? apart : 0.f), row.end = i + 1;
    row.above = std::max(row.above, boxes[i].high.y()), row.below = std::max(row.below, -boxes[i].low.y());
  }
  return rows;
}

// The height of a picture that holds them, of its aspect.
float height_with(std::span<const Row> rows, float aspect, float apart) {
  float wide = 0.f, high = row_gap * apart * float(rows.size() - 1);
  for (const Row& row : rows) wide = std::max(wide, row.width), high += row.above + row.below;
  return std::max(high, wide / aspect);
}

// Of all that belongs to a neuron, about its soma.
Bounds box_of(const Morphology& neuron) {
  const Sphere soma{neuron.soma().sphere().position(), neuron.soma().sphere().radius};
  Bounds box;
  box.add(Vec3(Vec3::Zero()), soma.radius);
  if (const Bounds all = neuron.bounds(); !all.empty())
    box.add(Vec3(all.low - soma.centre)), box.add(Vec3(all.high - soma.centre));
  return box;
}

Bounds box_of(const Forest& forest, const frame::Instance& instance) {
  const Neuron& neuron = forest.neurons()[instance.morphology];
  const Placed placed(instance);
  Bounds box;
  for (const frame::Segment& s : forest.segments().subspan(neuron.first_segment, neuron.original_count)) {
    const auto add = [&](const Vec3& at, float radius) {
      box.add(placed.position + placed.turn * at, radius);
    };
    add({s.ax, s.ay, s.az}, from_half(s.radii)), add({s.bx, s.by, s.bz}, from_half(s.radii >> 16));
  }
  return box;
}

Bounds box_of(const Forest& forest, std::span<const frame::State> states) {
  const auto seen = seen_in(states);
  Bounds all;
  for (std::uint32_t i = 0; i < forest.instances().size(); ++i)
    if (seen(i)) all.add(box_of(forest, forest.instances()[i]));
  return all;
}

// Without an ending that all have, as ".CNG": it takes the room of what tells them apart.
std::vector<std::string> without_common_ending(std::vector<std::string> names) {
  const std::string ending = names[0].substr(std::min(names[0].rfind('.'), names[0].size()));
  const bool common = std::ranges::all_of(
      names, [&](const std::string& name) { return name.size() > ending.size() && name.ends_with(ending); });
  for (std::string& name : names)
    if (common) name.resize(name.size() - ending.size());
  return names;
}

View view_without_place() {
  View view;
  view.colour_by = ColourBy::kind;
  view.samples = 64;  // thin lines on nothing
  view.fog = .3f;     // a neuron is as deep as it is wide, and no farther part of it matters less
  return view;
}

}  // namespace

std::vector<Vec3> places_in_gallery(std::span<const Morphology> neurons, float aspect) {
  std::vector<Bounds> boxes;
  float extents = 0.f, widths = 0.f;
  for (const Morphology& neuron : neurons) {
    boxes.push_back(box_of(neuron));
    const Vec3 extent = boxes.back().extent();
    extents += .5f * (extent.x() + extent.y()), widths += extent.x();
  }
  const float slot = least_slot * widths / float(std::max<std::size_t>(neurons.size(), 1));
  for (Bounds& box : boxes)
    if (const float lack = .5f * (slot - box.extent().x()); lack > 0.f)
      box.low.x() -= lack, box.high.x() += lack;
  const float apart = std::max(least_gap, gap * extents / float(std::max<std::size_t>(neurons.size(), 1)));
  // The widest row may be as wide as any number of neurons is together.
  std::vector<Row> best;
  for (std::size_t first = 0; first < boxes.size(); ++first) {
    float wide = -apart;
    for (std::size_t end = first; end < boxes.size(); ++end) {
      wide += apart + boxes[end].extent().x();
      std::vector<Row> rows = rows_of(boxes, wide * 1.0001f, apart);
      if (best.empty() || height_with(rows, aspect, apart) < .999f * height_with(best, aspect, apart))
        best = std::move(rows);
    }
  }
  std::vector<Vec3> places;
  float y = 0.f;
  for (const Row& row : best) {
    y -= row.above;
    float x = -.5f * row.width;
    for (std::size_t i = row.first; i < row.end; ++i) {
      places.emplace_back(x - boxes[i].low.x(), y, 0.f);
      x += boxes[i].extent().x() + apart;
    }
    y -= row.below + row_gap * apart;
  }
  return places;
}

Forest hung(std::span<const Morphology> neurons, std::vector<std::string> names,
            std::span<const Vec3> places) {
  circuit::Circuit circuit;
  circuit.name = names.size() == 1 ? names[0] : "neurons";
  circuit.layers = {{traced, -1.f, 1.f}};
  for (std::size_t i = 0; i < neurons.size(); ++i) {
    const auto number = std::uint32_t(i);
    circuit.instances.push_back({.position = places[i], .morphology = number, .type = number});
    circuit.types.push_back({names[i], traced});
  }
  circuit.morphologies = std::move(names);
  return Forest::from_bytes(pack(circuit, neurons));
}

Forest gallery(std::span<const Morphology> neurons, std::vector<std::string> names, float aspect) {
  return hung(neurons, std::move(names), places_in_gallery(neurons, aspect));
}

bool is_gallery(const Forest& forest) {
  const auto& layers = forest.circuit().layers;
  return layers.size() == 1 && layers[0].name == traced && layers[0].bottom == -1.f && layers[0].top == 1.f;
}

View view_of_gallery(const Forest& forest, float aspect, std::span<const frame::State> states) {
  View view = view_without_place();
  const Bounds box = box_of(forest, states);
  if (box.empty()) return view;
  const Vec3 extent = box.extent();
  view.camera.projection = frame::Projection::orthographic;
  const float half = .5f * std::max({extent.y(), extent.x() / aspect, 1.f}) / filled;
  // As far before it as the field of view says, but before all of it, and where depth is still told (frame/layout.h).
  constexpr float farthest = 2e5f;
  const float usual = half / std::tan(.5f * radians(view.camera.field_of_view)),
              away = std::max(std::min(usual, farthest), .5f * extent.z() + 2.f);
  if (away != usual) view.camera.field_of_view = 2.f * degrees(std::atan(half / away));
  view.camera.target = box.centre(), view.camera.eye = box.centre() + Vec3(0.f, 0.f, away);
  return view;
}

std::vector<View> around_gallery(const Forest& forest, float aspect, std::span<const frame::State> states) {
  View view = view_without_place();
  const Bounds box = box_of(forest, states);
  if (box.empty()) return {view};
  const Vec3 extent = box.extent();
  const float slope = std::tan(.5f * radians(view.camera.field_of_view)) * filled;
  const float reach = .5f * std::hypot(extent.x(), extent.z());
  const float away = reach + std::max({.5f * extent.y() / slope, reach / (slope * aspect), 1.f});
  std::vector<View> views;
  for (int i = 0; i <= stops; ++i) {
    const float turn = 2.f * std::numbers::pi_v<float> * float(i % stops) / float(stops);
    view.camera.target = box.centre();
    view.camera.eye = box.centre() + away * Vec3(std::sin(turn), 0.f, std::cos(turn));
    views.push_back(view);
  }
  return views;
}

void paint_names(frame::Image& image, const Forest& forest, const View& view) {
  if (forest.instances().size() < 2) return;
  const frame::Viewport viewport{float(image.width), float(image.height)};
  Lettering letters = letters_in(viewport, view.background);
  letters.height *= .8f;
  const Paper paper = paper_of(view.background);
  std::vector<Bounds> boxes;
  float widths = 0.f;
  for (const frame::Instance& instance : forest.instances()) {
    boxes.push_back(box_of(forest, instance));
    if (!boxes.back().empty()) widths += boxes.back().extent().x();
  }
  const Vec3 first = boxes.front().empty() ? Vec3(Vec3::Zero()) : boxes.front().centre();
  const float slot = least_slot * widths / float(boxes.size()) /
                     view.camera.pixel_size(viewport.height, (first - view.camera.eye).norm());
  const std::vector<std::string> names = without_common_ending(forest.circuit().morphologies);
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const Bounds& box = boxes[i];
    if (box.empty()) continue;
    const Vec3 centre = box.centre();
    const Vec3 left = project(view.camera, viewport, {box.low.x(), box.low.y(), centre.z()}),
               right = project(view.camera, viewport, {box.high.x(), box.low.y(), centre.z()});
    if (!(left.z() > 0.f) || !(right.z() > 0.f)) continue;
    const std::string& name = names[forest.instances()[i].morphology];
    const float most = std::max((right.x() - left.x()) * (1.f + .5f * gap), slot);
    const std::string text = letters.shortened(name, most);
    const float h = letters.height, half = .5f * letters.width(text), middle = .5f * (left.x() + right.x()),
                base = left.y() + 1.6f * h;
    paint_plate(image, paper,
                {middle - half - .5f * h, base - 1.4f * h, middle + half + .5f * h, base + .6f * h});
    letters.write(image, text, middle - half, base);
  }
}

}  // namespace forest::scene
