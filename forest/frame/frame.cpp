// SPDX-License-Identifier: Apache-2.0
#include "forest/frame/frame.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include <fmt/format.h>

#include "forest/core/error.h"

namespace forest::frame {
namespace {

void require(bool good, std::string_view sentence) {
  if (!good) throw Error(fmt::format("frame: {}", sentence));
}

float halton(std::uint32_t index, std::uint32_t base) {
  float result = 0.f, share = 1.f;
  for (std::uint32_t i = index + 1; i; i /= base) share /= float(base), result += share * float(i % base);
  return result;
}

}  // namespace

Vec3 light_direction() { return Vec3(-.35f, .75f, -.55f).normalized(); }

Vec2 sample_place(std::uint32_t subframe, std::uint32_t subframes) {
  return subframes == 1 ? Vec2(0.f, 0.f) : Vec2(halton(subframe, 2) - .5f, halton(subframe, 3) - .5f);
}

StateBits bits_of(std::span<const State> states) {
  std::uint32_t any = 0, all = ~0u;
  for (const State& state : states) any |= packed(state), all &= packed(state);
  return {unpacked(any), unpacked(all)};
}

void check(const Frame& frame, const Geometry& geometry) {
  const Camera& c = frame.camera;
  require(c.eye.allFinite() && c.target.allFinite() && c.up.allFinite(), "the camera must be finite");
  require(c.eye != c.target, "the camera must not look at its own eye");
  require(c.field_of_view > 0.f && c.field_of_view < 180.f,
          "the field of view must lie between 0 and 180 degrees");
  require(c.near > 0.f, "the near distance must be positive");
  require(frame.width > 0 && frame.height > 0 && frame.width <= 16384 && frame.height <= 16384,
          "a picture must be 1 to 16384 pixels wide and high");
  if (const auto& a = frame.area)
    require(a->left < a->right && a->top < a->bottom && a->right <= frame.width && a->bottom <= frame.height,
            "the wanted part of a picture must lie in it and not be empty");
  const auto squares = [](std::uint32_t pixels) {
    return std::size_t(pixels + FOREST_TILE - 1) / FOREST_TILE;
  };
  require(frame.unwanted.empty() || frame.unwanted.size() == squares(frame.width) * squares(frame.height),
          "every square of a picture is wanted or not");
  require(frame.thinnest >= 0.f && frame.thinnest <= 64.f, "the thinnest lines must be 0 to 64 pixels wide");
  require(frame.least_width >= 0.f && frame.least_width <= 4.f,
          "branches can be drawn no thinner than 0 to 4 pixels");
  require(frame.gaps >= 0.f && frame.gaps < 1.f, "the share of gaps must be at least 0 and less than 1");
  require(frame.subframes > 0 && frame.subframes <= 1024, "there must be 1 to 1024 subframes");
  require(frame.first_subframe < std::min(frame.subframes, frame.last_subframe),
          "a part of a picture must have at least one of its subframes");
  require(frame.style.fog_length > 0.f, "the length of the fog must be positive");
  for (const Vec3& colour : frame.palette)
    require(colour.allFinite() && colour.minCoeff() >= 0.f, "colours must not be negative");
  require(frame.states.size() == geometry.instances.size(), "every instance needs a state");
  require(frame.states.bits().any.colour_class < 16, "a colour class must be below 16");
  check(static_cast<const Lists&>(frame), geometry);
  if (const auto& g = frame.glass)
    require(g->plane.origin.allFinite() && g->plane.normal.allFinite() && g->colour.allFinite() &&
                g->opacity >= 0.f && g->opacity <= 1.f && g->low.allFinite() && g->high.allFinite(),
            "the glass must be finite and its opacity lie between 0 and 1");
  for (const Overlay& o : frame.overlays)
    require(o.a.allFinite() && o.b.allFinite() && o.radius >= 0.f && o.colour < frame.palette.size(),
            "an overlay must be finite and its colour a palette entry");
  bool finite = true;  // of all of them: there may be a million
  std::uint8_t colours_of_balls = 0;
  for (const Ball& b : frame.balls)
    finite &= b.centre.allFinite() && b.radius >= 0.f && b.radius < 65504.f, colours_of_balls |= b.colour;
  require(finite && colours_of_balls < frame.palette.size() && frame.balls.size() < (1u << 26),
          "balls must be finite and fewer than 67,108,864, and their colours palette entries");
  require(frame.surfaces.size() < (1u << 20), "there must be fewer than 1,048,576 surfaces");
  for (const Surface& surface : frame.surfaces) check(surface, geometry);
}

void check(const Surface& s, const Geometry& geometry) {
  const std::size_t count = s.positions.size();
  require(s.normals.size() == count && s.entries.size() == count &&
              (s.openness.empty() || s.openness.size() == count) &&
              (s.presence.empty() || s.presence.size() == count),
          "every position of a surface needs a normal and a palette entry; light and presence have all of "
          "them or none");
  require(count < (1u << 27) && s.triangles.size() < (1u << 27),
          "a surface must have fewer than 134,217,728 positions and triangles");
  require(s.instance == Surface::in_world || s.instance < geometry.instances.size(),
          "a surface names an instance that is not there");
  float most = 0.f;  // of all of them: there may be a million
  bool finite = true;
  for (std::size_t i = 0; i < count; ++i) {
    finite &= s.positions[i].allFinite();
    most = std::max(most, std::abs(s.normals[i].squaredNorm() - 1.f));
    finite &= s.normals[i].allFinite();
  }
  require(finite, "the positions and normals of a surface must be finite");
  require(most < .01f, "the normals of a surface must be of unit length");
  std::uint32_t bits = 0, last = 0;
  for (const std::uint8_t entry : s.entries) bits |= entry;
  require(bits < 128, "the colours of a surface must be palette entries");
  for (const Triangle& t : s.triangles) last = std::max({last, t[0], t[1], t[2]});
  require(s.triangles.empty() || last < count, "a triangle names a position that is not there");
}

bool transparent(const Frame& frame) {
  // Lists that come later, by `rest`, hold no item whose state is not announced by its neuron's being parted.
  const auto [any, all] = frame.states.bits();
  std::uint8_t least = all.opacity;
  for (const Ball& b : frame.balls) least = std::min(least, b.opacity);
  return least < 255 || any.is(State::parted) || frame.opacities != opaque();
}

void check(const Lists& lists, const Geometry& geometry) {
  // Of all of them: there may be a million.
  std::uint64_t last = 0;
  std::uint32_t classes = 0;
  bool known = true, finite = true;
  for (const auto list : {lists.dots, lists.lines, lists.capsules})
    for (const Item& item : list) {
      known &= geometry.straw(item) ? item.first_segment >= geometry.segments.size() - geometry.owners.size()
                                    : item.instance < geometry.instances.size();
      classes |= unpacked(item.state).colour_class;
      last = std::max(last, item.first_segment + std::uint64_t(std::bit_width(item.drawn)));
      finite &= item.radius >= 0.f && std::isfinite(item.x + item.y + item.z + item.radius);
    }
  require(known, "an item names an instance that is not there");
  require(classes < 16, "a colour class must be below 16");
  require(last <= geometry.segments.size(), "an item names segments that are not there");
  require(finite, "an item's sphere must be finite");
  const auto check_entries = [](std::span<const std::uint8_t> entries, std::size_t wanted) {
    require(entries.empty() || entries.size() == wanted,
            "a list has colours for all of its segments, or for none");
    static_assert(std::tuple_size_v<Palette> == 128);
    std::uint32_t bits = 0;  // of all of them: there may be a million
    for (const std::uint8_t entry : entries) bits |= entry;
    require(bits < 128, "a segment's colour must be a palette entry");
  };
  check_entries(lists.entries.dots, lists.dots.size());
  check_entries(lists.entries.lines, lists.lines.size() * cluster_size);
  check_entries(lists.entries.capsules, lists.capsules.size() * cluster_size);
  for (const auto list : {lists.dots, lists.lines, lists.capsules})
    require(list.size() < (1u << 26), "a list must have fewer than 67,108,864 items");
  for (const Item& item : lists.dots) require(item.drawn == 1, "a dot is one segment");
  Band before;
  for (const Band& b : lists.bands) {
    require(b.dots >= before.dots && b.lines >= before.lines && b.capsules >= before.capsules,
            "bands must follow one another");
    before = b;
  }
  require(lists.bands.empty() || (before.dots == lists.dots.size() && before.lines == lists.lines.size() &&
                                  before.capsules == lists.capsules.size()),
          "the last band must end where the lists end");
}

}  // namespace forest::frame
