// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/arrangement.h"

#include <algorithm>
#include <cmath>

namespace forest::scene {
namespace {

// Differences of a channel, in 255ths: from where on one is seen, and from where on it is as good as any. Dithering makes one of 1.
constexpr float seen = 4.f, plain = 40.f;
// A spot is as good as the best where it hides no more than so many times as much, and this share of its pixels besides.
constexpr float times_alike = 1.2f, alike = .006f;
constexpr float opacity_at_most = .82f;  // more would show lines through the words
constexpr float busy = .004f;            // hidden share from which on a plate is as opaque

frame::Viewport size_of(const frame::Image& image) { return {float(image.width), float(image.height)}; }

bool overlap(const Box& a, const Box& b) {
  return a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
}

}  // namespace

Paper paper_of(Background background) {
  const Ground ground = ground_of(background);
  return {ground.top, ground.bottom,
          background == Background::dark ? Vec3(.03f, .05f, .075f) : Vec3(1.f, 1.f, 1.f),
          background == Background::transparent};
}

Lettering letters_in(const frame::Viewport& picture, Background background) {
  return {.height = std::max(7.f, std::round(picture.height / 80.f)),
          .colour = background == Background::dark ? Vec3(.89f, .91f, .94f) : Vec3(.13f, .16f, .20f)};
}

Box Block::at(Spot spot, const frame::Viewport& picture) const {
  // 0: left or top, 1: in the middle, 2: right or bottom; in the order of spots.
  constexpr std::array<std::array<int, 2>, spots> places{
      {{0, 0}, {2, 0}, {0, 2}, {2, 2}, {0, 1}, {2, 1}, {1, 0}, {1, 2}}};
  const auto [across, down] = places[std::size_t(spot)];
  const auto begin = [&](int place, float room, float size) {
    return margin + std::round(.5f * float(place) * (room - size - 2.f * margin));
  };
  const float left = begin(across, picture.width, width), top = begin(down, picture.height, height);
  return {left, top, left + width, top + height};
}

float hidden_by(const Box& box, const frame::Image& image, const Paper& paper) {
  const auto within = [](float x, std::uint32_t size) {
    return std::size_t(std::clamp(std::round(x), 0.f, float(size)));
  };
  const std::size_t left = within(box.left, image.width), right = within(box.right, image.width),
                    top = within(box.top, image.height), bottom = within(box.bottom, image.height);
  if (left >= right || top >= bottom) return 0.f;
  double sum = 0.;
  for (std::size_t y = top; y < bottom; ++y) {
    const Vec3 light = paper.top + (float(y) + .5f) / float(image.height) * (paper.bottom - paper.top);
    const Vec3 empty = 255.f * screen_of(light);
    float row = 0.f;
    for (std::size_t x = left; x < right; ++x) {
      const std::uint8_t* p = &image.pixels[4 * (y * image.width + x)];
      float differs = paper.clear ? float(p[3]) : 0.f;
      for (int c = 0; c < 3 && !paper.clear; ++c)
        differs = std::max(differs, std::abs(float(p[c]) - empty[c]));
      row += std::clamp((differs - seen) / (plain - seen), 0.f, 1.f);
    }
    sum += double(row);
  }
  return float(sum / double((right - left) * (bottom - top)));
}

float plate_opacity(float hidden, const Paper& paper) {
  return opacity_at_most * (paper.clear ? 1.f : std::min(1.f, hidden / busy));
}

void paint_plate(frame::Image& image, const Paper& paper, const Box& box) {
  if (const float opacity = plate_opacity(hidden_by(box, image, paper), paper); opacity > 0.f)
    fill(image, box, paper.plate, opacity);
}

void Arrangement::look_at(const frame::Image& image, const Paper& paper, std::span<const Block> blocks) {
  for (const Block& block : blocks) {
    Place& place = places_[block.kind];
    for (std::size_t i = 0; i < spots; ++i)
      place.hidden[i] += hidden_by(block.at(Spot(i), size_of(image)), image, paper);
    ++place.pictures;
  }
}

Spot Arrangement::best(const Block& block, const frame::Viewport& picture) const {
  std::array<float, spots> hidden = places_[block.kind].hidden;
  for (std::size_t i = 0; i < spots; ++i) {
    hidden[i] /= float(std::max(1u, places_[block.kind].pictures));
    for (const Place& other : places_)
      if (other.spot && overlap(other.box, block.at(Spot(i), picture))) hidden[i] += 10.f;
  }
  const float good = times_alike * std::ranges::min(hidden) + alike;
  if (hidden[std::size_t(block.usual)] <= good) return block.usual;
  return Spot(std::ranges::find_if(hidden, [&](float h) { return h <= good; }) - hidden.begin());
}

Box Arrangement::place(const Block& block, const frame::Viewport& picture) {
  Place& place = places_[block.kind];
  if (!place.spot) place.spot = best(block, picture);
  return place.box = block.at(*place.spot, picture);
}

void Arrangement::paint(frame::Image& image, const Paper& paper, std::span<const Block> blocks) {
  for (const Block& block : blocks)  // before any of them is in the picture
    if (!places_[block.kind].pictures) look_at(image, paper, {&block, 1});
  for (const Block& block : blocks) {
    const Box box = place(block, size_of(image));
    paint_plate(image, paper, box);
    block.paint(image, box.left, box.top);
  }
}

}  // namespace forest::scene
