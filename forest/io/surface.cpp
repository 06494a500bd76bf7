// SPDX-License-Identifier: Apache-2.0
#include "forest/io/surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/lower.h"
#include "forest/core/number.h"
#include "forest/io/freesurfer.h"
#include "forest/io/gifti.h"
#include "forest/io/inflate.h"
#include "forest/io/obj.h"
#include "forest/io/plain_text.h"
#include "forest/io/ply.h"
#include "forest/io/stl.h"
#include "forest/io/words.h"

namespace forest::io {
namespace {

constexpr std::size_t most_unpacked = std::size_t(1) << 30;  // bytes

bool is_packed(std::string_view bytes) { return bytes.starts_with("\x1f\x8b"); }

// As they are, or unpacked into `place`.
std::string_view unpacked(std::string_view bytes, std::string& place, const std::string& name) {
  if (!is_packed(bytes)) return bytes;
  place = inflated(bytes, most_unpacked, name);
  return place;
}

bool is_gifti(std::string_view bytes) { return first_element(bytes) == "GIFTI"; }

// Without what a picture cannot show, and not endless.
std::string title_in(std::string_view text) {
  constexpr std::size_t longest = 80;
  std::string title(trimmed(text, between_words).substr(0, longest));
  while (title.size() == longest && (title.back() & 0xc0) == 0x80) title.pop_back();  // part of a letter
  for (char& c : title)
    if (static_cast<unsigned char>(c) < ' ') c = ' ';
  return title;
}

// One number a line; empty lines are none, and what stands behind # is a title where it is the first.
SurfaceValues read_lines(std::string_view text, const std::string& name) {
  SurfaceValues result;
  for (std::size_t line = 1; !text.empty(); ++line) {
    const std::string_view word = trimmed(next_line(text), between_words);
    if (word.starts_with('#') && result.title.empty() && result.values.empty())
      result.title = title_in(word.substr(1));
    if (word.empty() || word.starts_with('#')) continue;
    const auto value = number_of<float>(word);
    if (!value)
      throw InputError(name, line,
                       fmt::format("'{}' is no number; give a GIFTI or FreeSurfer file of values, or one "
                                   "number a line",
                                   printable(word)));
    result.values.push_back(*value);
  }
  return result;
}

// FreeSurfer's files of values are called by what they hold, whose units its documentation tells.
std::string title_of(const std::string& name) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 5> known{
      {{".thickness", "thickness (mm)"},
       {".curv", "curvature (1/mm)"},
       {".area", "area (mm²)"},
       {".volume", "volume (mm³)"},
       {".sulc", "sulcal depth"}}};
  for (const auto& [ending, title] : known)
    if (name.ends_with(ending)) return std::string(title);
  return {};
}

// FreeSurfer's converter calls what it writes as GIFTI by the path that it read it from.
std::string without_folders(const std::string& title) {
  if (!title.starts_with('/')) return title;
  const std::string known = title_of(title);
  return known.empty() ? title.substr(title.rfind('/') + 1) : known;
}

}  // namespace

bool may_be_surface(std::string_view bytes) {
  return is_packed(bytes) || is_freesurfer_surface(bytes) || is_freesurfer_values(bytes) ||
         is_freesurfer_areas(bytes) || is_gifti(bytes) || is_ply(bytes) || is_stl(bytes) || is_obj(bytes);
}

Mesh read_surface(std::string_view bytes, const std::string& name) {
  std::string place;
  const std::string_view content = unpacked(bytes, place, name);
  if (content.empty()) throw InputError(name, 0, "is empty; get the file again");
  if (is_freesurfer_surface(content)) return read_freesurfer_surface(content, name);
  if (is_gifti(content)) return read_gifti_surface(content, name);
  if (is_ply(content)) return read_ply_surface(content, name);
  if (is_stl(content)) return read_stl_surface(content, name);
  if (is_obj(content)) return read_obj_surface(content, name);
  if (const std::string ending = lower(name); ending.ends_with(".stl") || ending.ends_with(".stl.gz"))
    throw InputError(name, 0, "is not as long as an STL file of its triangles must be; get the whole file");
  throw InputError(name, 0,
                   "is no surface that is known; give a GIFTI file (.surf.gii), FreeSurfer's triangles "
                   "(lh.pial), PLY, STL or OBJ; mris_convert makes some of them of many others");
}

std::string surface_structure(std::string_view bytes, const std::string& name) {
  std::string place;
  const std::string_view content = unpacked(bytes, place, name);
  if (is_gifti(content))
    if (std::string told = gifti_structure(content, name); !told.empty()) return told;
  const std::string file = name.substr(name.rfind('/') + 1);
  return file.starts_with("lh.") ? "CORTEX_LEFT" : file.starts_with("rh.") ? "CORTEX_RIGHT" : "";
}

SurfaceValues read_surface_values(std::string_view bytes, const std::string& name) {
  std::string place;
  const std::string_view content = unpacked(bytes, place, name);
  SurfaceValues result;
  if (is_freesurfer_values(content))
    result = {.values = read_freesurfer_values(content, name), .title = title_of(name), .labels = {}};
  else if (is_freesurfer_areas(content))
    result = read_freesurfer_areas(content, name);
  else if (is_gifti(content))
    result = read_gifti_values(content, name), result.title = title_in(without_folders(result.title));
  else
    result = read_lines(content, name);
  if (result.values.empty())
    throw InputError(name, 0, "holds no value; give a file with one for every vertex");
  for (float& value : result.values)
    if (!std::isfinite(value)) value = std::numeric_limits<float>::quiet_NaN();
  return result;
}

std::string write_surface_values(std::string_view title, std::span<const double> values) {
  std::string text = fmt::format("# {}\n", title);
  for (const double value : values) fmt::format_to(std::back_inserter(text), "{:.6g}\n", value);
  return text;
}

std::string printable(std::string_view word) {
  std::string result(word.substr(0, 40));
  for (char& c : result)
    if (c < ' ' || c > '~') c = '?';
  return result;
}

Vec3 micrometres(const Vec3& millimetres, const std::string& name, std::size_t vertex) {
  constexpr float farthest = 1e5f;                     // mm
  if (!(millimetres.array().abs() <= farthest).all())  // each by itself: a maximum may pass over no number
    throw InputError(
        name, 0,
        fmt::format("has a vertex that is nowhere, number {} (not a number, or farther than 100 m); mend it",
                    vertex));
  return millimetres * 1000.f;
}

void check_corners(const Mesh& mesh, const std::string& name) {
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    for (const std::uint32_t corner : mesh.triangles[i])
      if (corner >= mesh.positions.size())
        throw InputError(name, 0,
                         fmt::format("triangle {} names vertex {} of {}; get the whole file", i,
                                     std::int32_t(corner), mesh.positions.size()));
}

std::string write_surface(const Mesh& mesh, std::string_view file_name) {
  return lower(file_name).ends_with(".gii") ? write_gifti_surface(mesh) : write_freesurfer_surface(mesh);
}

}  // namespace forest::io
