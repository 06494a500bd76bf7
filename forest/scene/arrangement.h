// SPDX-License-Identifier: Apache-2.0
// Where words stand in a picture: legends, colour bars and scale bars each where they hide least of what they explain, and on
// quiet ground as far as they hide anything. Those of a film are placed once, after a look at moments all through it.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>

#include "forest/scene/lettering.h"
#include "forest/scene/view.h"

namespace forest::scene {

/// What a picture is drawn on: from what does not differ from it nothing is hidden.
struct Paper {
  Vec3 top, bottom;    // linear light, at the picture's edges
  Vec3 plate;          // sRGB 0–1, the quiet ground of words, through which the picture is seen faintly
  bool clear = false;  // nothing: a pixel shows what is opaque, and words need a plate wherever they stand
};
Paper paper_of(Background background);

/// Letters as large as a picture allows.
Lettering letters_in(const frame::Viewport& picture, Background background);

/// Corners first, and before the others those in which legends are usual.
enum class Spot : std::uint8_t { top_left, top_right, bottom_left, bottom_right, left, right, top, bottom };
inline constexpr std::size_t spots = 8;

/// Words that belong together, ready to be painted anywhere.
struct Block {
  enum Kind : std::uint8_t { values, names, scale, step };
  static constexpr std::size_t kinds = 4;

  Kind kind = names;  // of each a picture has one
  Spot usual = Spot::top_left;
  float width = 0.f, height = 0.f, margin = 0.f;  // pixels, the margin from the edges of the picture
  // At its upper left corner, without ground.
  std::function<void(frame::Image&, float left, float top)> paint = {};

  Box at(Spot spot, const frame::Viewport& picture) const;
};

/// How much of what a picture shows lies in a box, 0–1: the mean over its pixels, of which one counts as far as it is seen to
/// differ from the paper.
float hidden_by(const Box& box, const frame::Image& image, const Paper& paper);
/// Of ground for words that hide so much: none where they hide nothing, unless the paper is clear.
float plate_opacity(float hidden, const Paper& paper);
void paint_plate(frame::Image& image, const Paper& paper, const Box& box);

class Arrangement {
 public:
  /// Has a look at a picture in which the blocks are to stand, or at one like it.
  void look_at(const frame::Image& image, const Paper& paper, std::span<const Block> blocks);
  /// Where it stands: where it hides least, on the mean over the pictures looked at, and beside those that were placed before it; of
  /// spots that are nearly alike the usual one, then a corner. Where one of its kind stood before it stays.
  Box place(const Block& block, const frame::Viewport& picture);
  /// Paints them where they stand. What no look was had for has one at this picture.
  void paint(frame::Image& image, const Paper& paper, std::span<const Block> blocks);

 private:
  struct Place {
    std::array<float, spots> hidden{};  // sums over the pictures
    std::uint32_t pictures = 0;
    std::optional<Spot> spot;
    Box box;
  };
  Spot best(const Block& block, const frame::Viewport& picture) const;

  std::array<Place, Block::kinds> places_;
};

}  // namespace forest::scene
