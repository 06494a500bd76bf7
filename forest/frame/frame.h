// SPDX-License-Identifier: Apache-2.0
// One picture as plain data. The scene decides what is in it, a renderer draws it; neither knows the other.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "forest/frame/camera.h"
#include "forest/frame/layout.h"

namespace forest::frame {

/// What stays from picture to picture; loaded once into a renderer. The memory must outlive the renderer's use of it.
struct Geometry {
  std::span<const Segment> segments;
  std::span<const Instance> instances;
};

/// Colours are linear light, 0–1. An instance of colour class c (0–15) shows its sections of kind k as entry 8 c + k.
using Palette = std::array<Vec3, 128>;
inline Palette black_palette() {
  Palette palette;
  palette.fill(Vec3::Zero());
  return palette;
}

struct Style {
  Vec3 background_top{.010f, .014f, .024f};
  Vec3 background_bottom{.004f, .005f, .008f};
  Vec3 fog_colour{.006f, .009f, .016f};
  float fog_start = 0.f;    // depth where fog begins, µm
  float fog_length = 1e9f;  // depth over which light falls to 1 / e, µm
  float halo = 1.f;         // strength of the dark rim around nearer branches; 0 for none
  float exposure = 1.f;
};

/// A capsule in world coordinates beside the forest: a highlighted branch, an outline.
struct Overlay {
  Vec3 a = Vec3::Zero(), b = Vec3::Zero();
  float radius = 1.f;        // µm; never thinner than two pixels on screen
  std::uint32_t colour = 0;  // palette entry
};

/// Where a band of a frame's lists ends. Bands follow one another from near to far; what the earlier ones hide
/// is not drawn in the later ones.
struct Band {
  std::uint32_t dots = 0, lines = 0, capsules = 0;
};

/// Palette entries of single segments: one for each dot, cluster_size for each item of the other lists. A list without any
/// is coloured by the colour classes.
struct Entries {
  std::span<const std::uint8_t> dots, lines, capsules;
};

struct Lists {
  std::span<const Item> dots;      // small spheres: one segment an item
  std::span<const Item> lines;     // thin runs
  std::span<const Item> capsules;  // runs near enough to have a surface
  std::span<const Band> bands;     // the last one ends at the ends of the lists; none: all is one band
  Entries entries;                 // where colours change along branches
};

/// How far one sees: of every square of FOREST_TILE pixels, in rows from the top, the depth of its farthest pixel (µm,
/// along the view); infinite where a pixel shows nothing.
struct DepthMap {
  std::uint32_t width = 0, height = 0;  // squares
  std::vector<float> depths;
};

struct Frame : Lists {
  Camera camera;
  std::uint32_t width = 1280, height = 720;  // pixels
  std::uint32_t subframes = 1;               // averaged for anti-aliasing and exact coverage of thin branches
  // A still picture may be drawn in parts, so that nobody waits for it: of its subframes only [first, last) are drawn,
  // and the image is the mean of all so far. The frames of the parts before must have shown the same.
  std::uint32_t first_subframe = 0, last_subframe = 1024;
  Style style;
  Palette palette = black_palette();
  std::span<const std::uint8_t> colour_class;  // one an instance, 0–15
  std::span<const Overlay> overlays;
  /// What the scene left out as probably hidden, and shows after all: asked for in every subframe, once the lists are
  /// drawn, with how far one sees then. What it returns must stay valid until it is asked again. May be empty.
  std::function<Lists(const DepthMap&)> rest;
};

/// 8-bit sRGB, rows from the top, 4 bytes a pixel (alpha 255).
struct Image {
  std::uint32_t width = 0, height = 0;
  std::vector<std::uint8_t> pixels;
  double covered = 0.;  // share of pixels that show something of the forest
};

struct Timing {
  double draw = 0., resolve = 0.;  // milliseconds of one picture, all subframes
};

/// Where light comes from, in camera axes (x right, y up, z along the view); unit length.
Vec3 light_direction();

/// Where subframe number `subframe` looks through each pixel: x and y from its middle, in pixels, within ±½ (the 2, 3
/// sequence of Halton); a picture of one subframe looks through the middle. The centre of the picture moves by as much.
Vec2 sample_place(std::uint32_t subframe, std::uint32_t subframes);

/// Throws Error naming the first violated sentence of this contract: sizes, indices, finite camera, colours.
void check(const Frame& frame, const Geometry& geometry);
void check(const Lists& lists, const Geometry& geometry);

}  // namespace forest::frame
