// SPDX-License-Identifier: Apache-2.0
// One picture as plain data. The scene decides what is in it, a renderer draws it; neither knows the other.
#pragma once

#include <array>
#include <bit>
#include <concepts>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "forest/frame/camera.h"
#include "forest/frame/layout.h"
#include "forest/geometry/mesh.h"
#include "forest/geometry/plane.h"

namespace forest::frame {

/// What stays from picture to picture; loaded once into a renderer. The memory must outlive the renderer's use of it.
struct Geometry {
  std::span<const Segment> segments;
  std::span<const Instance> instances;
  std::span<const Owner> owners = {};  // of the last segments, which lie in the world

  bool straw(const Item& item) const { return item.instance == FOREST_IN_WORLD; }
  /// Of a straw.
  const Owner& owner(std::size_t segment) const {
    return owners[segment - (segments.size() - owners.size())];
  }
};

/// Primitives that a neuron may be drawn with, however large it is in the picture.
enum class Kind : std::uint8_t { any, dots, lines, capsules, somata, skin, bricks };

/// How a neuron is shown, or a branch of it: 4 bytes, so that changing thousands costs nothing. Renderers read the colour
/// class and the opacity; the rest has been obeyed by whoever made the lists.
struct State {
  static constexpr std::uint8_t visible = 1, simulated = 2,
                                parted = 4;  // parted: branches of it have states of their own

  std::uint8_t colour_class = 0;  // 0–15
  Kind kind = Kind::any;
  std::uint8_t opacity = 255;  // times that of the palette entry; 255: opaque
  std::uint8_t flags = visible | simulated;

  bool is(std::uint8_t flag) const { return flags & flag; }
  bool operator==(const State&) const = default;
};
static_assert(sizeof(State) == 4);

/// As Item::state.
inline std::uint32_t packed(const State& s) { return std::bit_cast<std::uint32_t>(s); }
inline State unpacked(std::uint32_t bits) { return std::bit_cast<State>(bits); }

/// The bits that any of some states has, and those that all have: what can be said of a million at once.
struct StateBits {
  State any, all;
};
/// Of none: no bit, and all bits.
StateBits bits_of(std::span<const State> states);

/// States that are looked at for their bits once: whoever changes one of them makes these anew.
class States : public std::span<const State> {
 public:
  States() = default;
  template <class List>
  requires std::convertible_to<const List&, std::span<const State>> States(const List& states)
      : span(states), bits_(bits_of(*this)) {}

  const StateBits& bits() const { return bits_; }

 private:
  StateBits bits_ = bits_of({});
};

/// Colours are linear light, 0–1. An instance of colour class c (0–15) shows its sections of kind k as entry 8 c + k.
using Palette = std::array<Vec3, 128>;
/// Of every palette entry, 0–255.
using Opacities = std::array<std::uint8_t, 128>;
inline Palette black_palette() {
  Palette palette;
  palette.fill(Vec3::Zero());
  return palette;
}

inline Opacities opaque() {
  Opacities opacities;
  opacities.fill(255);
  return opacities;
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

/// A small sphere in the world beside the forest: a synapse. Of less than a pixel it covers its share on the mean.
struct Ball {
  Vec3 centre = Vec3::Zero();
  float radius = 1.f;       // µm
  std::uint8_t colour = 0;  // palette entry, whose own opacity does not count
  std::uint8_t opacity = 255;
};

/// Triangles with smooth shading: the surface of a cortex, the skin of a neuron. Both sides are seen.
struct Surface {
  static constexpr std::uint32_t in_world = 0xffffffffu;

  std::span<const Vec3> positions;  // µm, in the world or of a neuron
  std::span<const Vec3>
      normals;  // unit, one a position; of the side from which triangles run counter-clockwise
  std::span<const std::uint8_t>
      entries;  // of the palette, one a position. Between them triangles are dithered
  std::span<const std::uint8_t>
      openness;  // one a position: the share of light that gets there, in 255ths; none: all of it
  std::span<const std::uint8_t> presence;  // one a position: times the opacity, in 255ths; none: all is there
  std::span<const Triangle> triangles;     // into positions
  std::uint32_t instance = in_world;       // whose coordinates these are
  std::uint8_t opacity = 255;              // 255: opaque
  // What a renderer has seen under this number, entries, presence and opacity aside, it need not take again; 0: it may have
  // changed.
  std::uint64_t version = 0;
};

/// What tells its screen door from others: surfaces in the world are things of their own, those of one instance pieces of one.
inline std::uint32_t door_number(std::span<const Surface> surfaces, std::size_t which) {
  return surfaces[which].instance == Surface::in_world ? std::uint32_t(which) : 0u;
}

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
  std::span<const Item> dots;      // somata, branches as beads: one segment an item
  std::span<const Item> lines;     // thin runs
  std::span<const Item> capsules;  // runs near enough to have a surface
  std::span<const Band> bands;     // the last one ends at the ends of the lists; none: all is one band
  Entries entries;                 // where colours change along branches

  bool empty() const { return dots.empty() && lines.empty() && capsules.empty(); }
};

/// How far one sees: of every square of FOREST_TILE pixels, in rows from the top, the depth of its farthest pixel (µm,
/// along the view); infinite where a pixel shows nothing. Of a picture of which only an area is wanted, those of that may be all.
struct DepthMap {
  std::uint32_t width = 0, height = 0;  // squares
  std::vector<float> depths;
  std::uint32_t left = 0, top = 0;  // squares of the picture before the first
};

/// A clear rectangle in the world, through which what lies behind is seen tinted.
struct Glass {
  Plane plane;
  Vec2 low = Vec2::Zero(), high = Vec2::Zero();  // along the plane's right and up, µm
  Vec3 colour = Vec3::Constant(.5f);             // linear light
  float opacity = .2f;                           // share of the colour in what lies behind, 0–1
};

struct Frame : Lists {
  Camera camera;
  std::uint32_t width = 1280, height = 720;  // pixels
  std::uint32_t subframes = 1;               // averaged for anti-aliasing and exact coverage of thin branches
  // Lines thinner than this are drawn as wide, for their like: so few of them are in a frame's lists that they cover their
  // area on the mean; pixels, and 1 for a picture of a single subframe.
  float thinnest = 0.f;
  float least_width = 0.f;   // pixels: branches and somata are drawn no thinner, however many; 0–4
  std::optional<Area> area;  // only these pixels are wanted, the others may show anything; none: all of them
  // Of them, 1 for each square of FOREST_TILE pixels of which nothing is wanted either, in rows from the upper left corner of the
  // picture; none: every square is.
  std::span<const std::uint8_t> unwanted;
  // What shows only through gaps of this share of a square of FOREST_TILE pixels need not be drawn; 0: all must be.
  float gaps = 0.f;
  // A still picture may be drawn in parts, so that nobody waits for it: of its subframes only [first, last) are drawn,
  // and the image is the mean of all so far. The frames of the parts before must have shown the same.
  std::uint32_t first_subframe = 0, last_subframe = 1024;
  Style style;
  Palette palette = black_palette();
  Opacities opacities = opaque();
  States states;  // one an instance
  std::span<const Overlay> overlays;
  std::span<const Ball> balls;
  std::span<const Surface> surfaces;
  std::optional<Glass> glass;
  /// What the scene left out as probably hidden, or as far, and shows after all. Asked in rounds 0, 1, 2 … in every subframe, or
  /// once for those that are drawn together: when the lists are drawn, then when what was returned before is, each time with how far
  /// one sees then, until nothing comes back. A map without squares asks for all at once. What it returns must stay valid until
  /// it is asked again. May be empty.
  std::function<Lists(const DepthMap&, std::uint32_t round)> rest;
};

/// 8-bit sRGB, rows from the top, 4 bytes a pixel (alpha 255).
struct Image {
  std::uint32_t width = 0, height = 0;
  std::vector<std::uint8_t> pixels;
  double covered = 0.;  // share of pixels that show something of the forest
};

struct Timing {
  double draw = 0., resolve = 0.;  // milliseconds of one picture, all subframes
  std::uint64_t drawn =
      0;  // segments of the last subframe that were neither hidden nor beside what is wanted; 0: unknown
};

/// Where light comes from, in camera axes (x right, y up, z along the view); unit length.
Vec3 light_direction();

/// Where subframe number `subframe` looks through each pixel: x and y from its middle, in pixels, within ±½ (the 2, 3
/// sequence of Halton); a picture of one subframe looks through the middle. The centre of the picture moves by as much.
Vec2 sample_place(std::uint32_t subframe, std::uint32_t subframes);

/// Subframes that the processor draws together, in groups that begin at multiples of it: a part of a picture is drawn soonest
/// in whole groups.
inline std::uint32_t drawn_together(std::uint32_t subframes) {
  return subframes == 1 ? 1 : subframes <= 4 ? 4 : 16;
}

/// Throws Error naming the first violated sentence of this contract: sizes, indices, finite camera, colours.
void check(const Frame& frame, const Geometry& geometry);
void check(const Surface& surface, const Geometry& geometry);
/// Whether any segment in it may be transparent.
bool transparent(const Frame& frame);
void check(const Lists& lists, const Geometry& geometry);

}  // namespace forest::frame
