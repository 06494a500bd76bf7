// SPDX-License-Identifier: Apache-2.0
#include "forest/io/freesurfer.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>
#include <map>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/io/surface.h"

namespace forest::io {
namespace {

constexpr std::string_view surface_mark = "\xff\xff\xfe", values_mark = "\xff\xff\xff";

class Words {
 public:
  Words(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(name) {}

  void skip(std::size_t count) { bytes_.remove_prefix(std::min(count, bytes_.size())); }
  void skip_line() { skip(std::min(bytes_.find('\n'), bytes_.size()) + 1); }
  /// Refuses to go on when fewer bytes are left.
  void need(std::uint64_t count) const {
    if (bytes_.size() < count)
      throw InputError(name_, 0,
                       fmt::format("is cut off: {} more bytes should follow and {} do; get the whole file",
                                   count, bytes_.size()));
  }
  std::uint32_t word() {
    need(4);
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < 4; ++i) value = value << 8 | static_cast<unsigned char>(bytes_[i]);
    skip(4);
    return value;
  }
  std::string text(std::uint32_t count) {
    need(count);
    std::string result(bytes_.substr(0, count));
    skip(count);
    return result.substr(0, result.find('\0'));
  }
  std::size_t left() const { return bytes_.size(); }
  float real() { return std::bit_cast<float>(word()); }
  std::uint32_t count(const char* of) {
    const auto value = std::int32_t(word());
    if (value < 0)
      throw InputError(name_, 0, fmt::format("says that it has {} {}; get the file again", value, of));
    return std::uint32_t(value);
  }

 private:
  std::string_view bytes_;
  const std::string& name_;
};

}  // namespace

bool is_freesurfer_surface(std::string_view bytes) { return bytes.starts_with(surface_mark); }
bool is_freesurfer_values(std::string_view bytes) { return bytes.starts_with(values_mark); }

// No mark says so: pairs that name vertices, of which there are as many, and what follows them.
bool is_freesurfer_areas(std::string_view bytes) {
  const auto word = [&](std::uint64_t i) {
    std::uint32_t value = 0;
    for (std::uint64_t k = 4 * i; k < 4 * i + 4; ++k)
      value = value << 8 | static_cast<unsigned char>(bytes[k]);
    return value;
  };
  if (bytes.size() < 16) return false;
  const std::uint64_t vertices = word(0);
  if (vertices == 0 || bytes.size() / 4 < 2 * vertices + 2 || word(2 * vertices + 1) != 1) return false;
  for (std::uint64_t i = 0; i < vertices; ++i)
    if (word(2 * i + 1) >= vertices) return false;
  return true;
}

SurfaceValues read_freesurfer_areas(std::string_view bytes, const std::string& name) {
  Words words(bytes, name);
  const std::uint32_t vertices = words.count("vertices");
  words.need(8 * std::uint64_t(vertices) + 8);
  std::vector<std::uint32_t> colours(vertices, 0);
  for (std::uint32_t i = 0; i < vertices; ++i) {
    const std::uint32_t vertex = words.word(), colour = words.word();
    if (vertex >= vertices)
      throw InputError(name, 0, fmt::format("names vertex {} of {}; get the whole file", vertex, vertices));
    colours[vertex] = colour;
  }
  words.word();  // there is a table
  auto entries = std::int32_t(words.word());
  const bool numbered = entries < 0;
  if (numbered) {
    if (entries != -2)
      throw InputError(
          name, 0,
          fmt::format("has a table of colours of version {}, and 2 is read", -std::int64_t(entries)));
    words.word();  // the largest number
  }
  words.text(words.count("letters"));  // the file that the table is of
  if (numbered) entries = std::int32_t(words.count("areas"));
  if (std::uint64_t(entries) > words.left() / 20)
    throw InputError(
        name, 0,
        fmt::format("says that it has {} areas, for which it is too short; get the whole file", entries));
  SurfaceValues result;
  std::map<std::uint32_t, std::int32_t> keys;  // of colours
  for (std::int32_t key = 0; key < entries; ++key) {
    if (numbered) words.word();
    SurfaceLabel label{.key = key, .name = words.text(words.count("letters"))};
    std::uint32_t packed = 0;
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t level = words.word();
      packed |= (level & 255) << (8 * k);
      label.colour[k] = float(std::min(level, 255u)) / 255.f;
    }
    label.alpha = 1.f - float(std::min(words.word(), 255u)) / 255.f;
    keys.emplace(packed, key);
    result.labels.push_back(std::move(label));
  }
  for (const std::uint32_t colour : colours) {
    const auto key = keys.find(colour);
    result.values.push_back(key == keys.end() ? std::numeric_limits<float>::quiet_NaN() : float(key->second));
  }
  return result;
}

Mesh read_freesurfer_surface(std::string_view bytes, const std::string& name) {
  Words words(bytes, name);
  words.skip(surface_mark.size());
  words.skip_line(), words.skip_line();
  const std::uint64_t vertices = words.count("vertices"), triangles = words.count("triangles");
  words.need(12 * (vertices + triangles));
  Mesh mesh;
  mesh.positions.reserve(vertices), mesh.triangles.reserve(triangles);
  for (std::uint64_t i = 0; i < vertices; ++i) {
    Vec3 at;
    for (float& x : at) x = words.real();
    mesh.positions.push_back(micrometres(at, name, i));
  }
  mesh.labels.assign(vertices, 0);
  for (std::uint64_t i = 0; i < triangles; ++i) {
    Triangle& corners = mesh.triangles.emplace_back();
    for (std::uint32_t& corner : corners) corner = words.word();
  }
  check_corners(mesh, name);
  if (mesh.triangles.empty()) throw InputError(name, 0, "has no triangle; give a surface that is not empty");
  return mesh;
}

std::vector<float> read_freesurfer_values(std::string_view bytes, const std::string& name) {
  Words words(bytes, name);
  words.skip(values_mark.size());
  const std::uint32_t vertices = words.count("vertices");
  words.count("triangles");
  if (const std::uint32_t each = words.count("values a vertex"); each != 1)
    throw InputError(name, 0,
                     fmt::format("has {} values a vertex and one is shown; it may be a surface of the old "
                                 "kind, which mris_convert makes anew",
                                 each));
  words.need(4 * std::uint64_t(vertices));
  std::vector<float> values(vertices);
  for (float& value : values) value = words.real();
  return values;
}

std::string write_freesurfer_surface(const Mesh& mesh) {
  std::string bytes =
      "\xff\xff\xfe"
      "created by Brain Forest\n\n";
  bytes.reserve(bytes.size() + 8 + 12 * (mesh.positions.size() + mesh.triangles.size()));
  const auto append = [&](std::uint32_t value) {
    for (const int shift : {24, 16, 8, 0}) bytes += char(value >> shift & 255);
  };
  append(std::uint32_t(mesh.positions.size())), append(std::uint32_t(mesh.triangles.size()));
  for (const Vec3& p : mesh.positions)
    for (int k = 0; k < 3; ++k) append(std::bit_cast<std::uint32_t>(p[k] / 1000.f));
  for (const Triangle& t : mesh.triangles)
    for (const std::uint32_t corner : t) append(corner);
  return bytes;
}

}  // namespace forest::io
