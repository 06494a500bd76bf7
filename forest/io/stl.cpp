// SPDX-License-Identifier: Apache-2.0
#include "forest/io/stl.h"

#include <bit>
#include <cstdint>
#include <cstring>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/number.h"
#include "forest/geometry/weld.h"
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

std::uint32_t add_corner(Mesh& mesh, const Vec3& at, const std::string& name) {
  mesh.positions.push_back(micrometres(at, name, mesh.positions.size()));
  return std::uint32_t(mesh.positions.size() - 1);
}

Mesh read_binary(std::string_view bytes, const std::string& name) {
  Mesh mesh;
  for (std::size_t at = head; at < bytes.size(); at += record) {
    Triangle triangle{};
    for (std::size_t k = 0; k < 3; ++k) {
      Vec3 place;
      for (std::size_t a = 0; a < 3; ++a)
        place[Eigen::Index(a)] = std::bit_cast<float>(little_endian(bytes, at + 12 * (k + 1) + 4 * a));
      triangle[k] = add_corner(mesh, place, name);
    }
    mesh.triangles.push_back(triangle);
  }
  return mesh;
}

Mesh read_text(std::string_view text, const std::string& name) {
  Mesh mesh;
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
      triangle[corners++] = add_corner(mesh, at, name);
    }
    if (word == "endfacet") {
      if (corners != 3)
        throw InputError(name, number, fmt::format("a facet has {} corners, not three; mend it", corners));
      mesh.triangles.push_back(triangle);
      corners = 0;
    }
  }
  if (open) throw InputError(name, number, "ends before 'endsolid'; get the whole file");
  return mesh;
}

}  // namespace

bool is_stl(std::string_view bytes) { return is_binary(bytes) || is_text(bytes); }

Mesh read_stl_surface(std::string_view bytes, const std::string& name) {
  Mesh mesh = welded(is_binary(bytes) ? read_binary(bytes, name) : read_text(bytes, name));
  mesh.labels.assign(mesh.positions.size(), 0);
  if (mesh.triangles.empty()) throw InputError(name, 0, "has no triangle; give a surface that is not empty");
  return mesh;
}

}  // namespace forest::io
