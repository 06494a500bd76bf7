// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/colour_map.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "forest/core/srgb.h"

namespace forest::scene {
namespace {

using Points = std::array<std::uint32_t, 10>;
constexpr Points viridis{0x440154, 0x482878, 0x3E4A89, 0x31688E, 0x26828E,
                         0x1F9E89, 0x35B779, 0x6DCD59, 0xB4DE2C, 0xFDE725};
constexpr Points magma{0x000004, 0x180F3E, 0x451077, 0x721F81, 0x9F2F7F,
                       0xCD4071, 0xF1605D, 0xFD9567, 0xFEC98D, 0xFCFDBF};
constexpr Points inferno{0x000004, 0x1B0C42, 0x4B0C6B, 0x781C6D, 0xA52C60,
                         0xCF4446, 0xED6925, 0xFB9A06, 0xF7D03C, 0xFCFFA4};
constexpr Points plasma{0x0D0887, 0x47039F, 0x7301A8, 0x9C179E, 0xBD3786,
                        0xD8576B, 0xED7953, 0xFA9E3B, 0xFDC926, 0xF0F921};
constexpr Points cividis{0x00204D, 0x00336F, 0x39486B, 0x575C6D, 0x707173,
                         0x8A8779, 0xA69D75, 0xC4B56C, 0xE4CF5B, 0xFFEA46};
// Every fourth of Moreland's table of 33.
constexpr std::array<std::uint32_t, 9> cool_warm{0x3B4CC0, 0x6282EA, 0x8DB0FE, 0xB8D0F9, 0xDDDDDD,
                                                 0xF5C4AD, 0xF49A7B, 0xDE604D, 0xB40426};
constexpr std::array<std::uint32_t, 2> grey{0x101010, 0xF8F8F8};

constexpr const char* of_matplotlib = "Smith & van der Walt 2015, matplotlib, CC0";
constexpr ColourMap maps[] = {
    {"plasma", of_matplotlib, plasma},
    {"inferno", of_matplotlib, inferno},
    {"magma", of_matplotlib, magma},
    {"viridis", of_matplotlib, viridis},
    {"cividis", "Nuñez, Anderton & Renslow 2018, PLoS ONE 13:e0199239", cividis},
    {"cool-warm", "Moreland 2009, Advances in Visual Computing (ISVC), LNCS 5876:92", cool_warm, true},
    {"grey", "evenly in sRGB", grey},
};

}  // namespace

Vec3 ColourMap::screen(float t) const {
  const float at = std::clamp(t, 0.f, 1.f) * float(points.size() - 1);
  const std::size_t i = std::min<std::size_t>(std::size_t(at), points.size() - 2);
  const auto rgb = [&](std::size_t k) -> Vec3 {
    return Vec3(float(points[k] >> 16 & 255), float(points[k] >> 8 & 255), float(points[k] & 255)) / 255.f;
  };
  return rgb(i) + (at - float(i)) * (rgb(i + 1) - rgb(i));
}

Vec3 ColourMap::operator()(float t) const {
  const Vec3 c = screen(t);
  return {from_srgb(c.x()), from_srgb(c.y()), from_srgb(c.z())};
}

std::span<const ColourMap> colour_maps() { return maps; }

const ColourMap* find_colour_map(std::string_view name) {
  const auto found = std::ranges::find(maps, name, &ColourMap::name);
  return found == std::end(maps) ? nullptr : found;
}

float lightness(const Vec3& c) {
  const float y = .2126f * c.x() + .7152f * c.y() + .0722f * c.z();  // Rec. 709
  return y > .008856f ? 116.f * std::cbrt(y) - 16.f : 903.3f * y;
}

}  // namespace forest::scene
