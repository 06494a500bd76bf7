// SPDX-License-Identifier: Apache-2.0
#include "forest/io/stl.h"

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <unordered_map>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/number.h"
#include "forest/io/surface.h"
#include "forest/io/words.h"

namespace forest::io {
namespace {

constexpr std::size_t head = 84, record = 50;  // bytes

std::uint32_t little_endian(std::string_view bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 4; i-- > 0;) value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
  return value;
}

bool is_binary(std::string_view bytes) {
  return bytes.size() >= head && bytes.size() == head + record * std::uint64_t(little_endian(bytes, 80));
}

bool is_text(std::string_view bytes) {
  bytes = bytes.substr(0, 4096);
  std::string_view line = next_line(bytes);
  if (next_word(line) != "solid") return false;
  while (!bytes.empty()) {
    line = next_line(bytes);
    if (const auto word = next_word(line); !word.empty()) return word == "facet" || word == "endsolid";
  }
  return false;
}

// Corners by their place.
class Welded {
 public:
  explicit Welded(const std::string& name) : name_(name) {}

  std::uint32_t corner(Vec3 at) {
    for (float& x : at) x += 0.f;  // minus zero is zero
    const std::array<std::uint32_t, 3> key{std::bit_cast<std::uint32_t>(at[0]),
                                           std::bit_cast<std::uint32_t>(at[1]),
                                           std::bit_cast<std::uint32_t>(at[2])};
    const auto [place, fresh] = known_.try_emplace(key, std::uint32_t(mesh.positions.size()));
    if (fresh) mesh.positions.push_back(micrometres(at, name_, mesh.positions.size()));
    return place->second;
  }
  // Two corners at one place make it none.
  void triangle(const Triangle& t) {
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) mesh.triangles.push_back(t);
  }

  Mesh mesh;

 private:
  struct Hash {
    std::size_t operator()(const std::array<std::uint32_t, 3>& key) const {
      std::uint64_t h = 0x9e3779b97f4a7c15u;
      for (const std::uint32_t x : key) h = (h ^ x) * 0xff51afd7ed558ccdu, h ^= h >> 29;
      return std::size_t(h);
    }
  };
  const std::string& name_;
  std::unordered_map<std::array<std::uint32_t, 3>, std::uint32_t, Hash> known_;
};

Mesh read_binary(std::string_view bytes, const std::string& name) {
  Welded welded(name);
  for (std::size_t at = head; at < bytes.size(); at += record) {
    Triangle triangle{};
    for (std::size_t k = 0; k < 3; ++k) {
      Vec3 place;
      for (std::size_t a = 0; a < 3; ++a)
        place[Eigen::Index(a)] = std::bit_cast<float>(little_endian(bytes, at + 12 * (k + 1) + 4 * a));
      triangle[k] = welded.corner(place);
    }
    welded.triangle(triangle);
  }
  return std::move(welded.mesh);
}

Mesh read_text(std::string_view text, const std::string& name) {
  Welded welded(name);
  std::size_t number = 0, corners = 0;
  Triangle triangle{};
  bool open = false;  // between solid and endsolid
  while (!text.empty()) {
    std::string_view line = next_line(text);
    ++number;
    const std::string_view word = next_word(line);
    if (word == "solid") open = true;
    if (word == "endsolid") open = false;
    if (word == "facet") corners = 0;
    if (word == "vertex") {
      Vec3 at;
      for (float& x : at) {
        const std::string_view coordinate = next_word(line);
        const auto value = number_of<float>(coordinate);
        if (!value)
          throw InputError(name, number,
                           fmt::format("'{}' is no coordinate; mend the vertex", printable(coordinate)));
        x = *value;
      }
      if (corners == 3)
        throw InputError(name, number, "a facet has more than three corners; write it as triangles");
      triangle[corners++] = welded.corner(at);
    }
    if (word == "endfacet") {
      if (corners != 3)
        throw InputError(name, number, fmt::format("a facet has {} corners, not three; mend it", corners));
      welded.triangle(triangle);
      corners = 0;
    }
  }
  if (open) throw InputError(name, number, "ends before 'endsolid'; get the whole file");
  return std::move(welded.mesh);
}

}  // namespace

bool is_stl(std::string_view bytes) { return is_binary(bytes) || is_text(bytes); }

Mesh read_stl_surface(std::string_view bytes, const std::string& name) {
  Mesh mesh = is_binary(bytes) ? read_binary(bytes, name) : read_text(bytes, name);
  mesh.labels.assign(mesh.positions.size(), 0);
  if (mesh.triangles.empty()) throw InputError(name, 0, "has no triangle; give a surface that is not empty");
  return mesh;
}

}  // namespace forest::io
