// SPDX-License-Identifier: Apache-2.0
#include "forest/io/obj.h"

#include <utility>
#include <vector>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/number.h"
#include "forest/geometry/weld.h"
#include "forest/io/surface.h"
#include "forest/io/words.h"

namespace forest::io {
namespace {

// The text from its first word on that is no comment.
std::string_view first_words(std::string_view bytes) {
  while (!bytes.empty()) {
    std::string_view rest = bytes, line = next_line(rest);
    const std::size_t begin = line.find_first_not_of(between_words);
    if (begin != std::string_view::npos && line[begin] != '#') return bytes.substr(begin);
    bytes = rest;
  }
  return bytes;
}

void add_face(Mesh& mesh, const std::vector<std::uint32_t>& corners) {
  for (std::size_t i = 2; i < corners.size(); ++i)
    mesh.triangles.push_back({corners[0], corners[i - 1], corners[i]});
}

Mesh read_wavefront(std::string_view text, const std::string& name) {
  Mesh mesh;
  std::vector<std::uint32_t> corners;
  for (std::size_t line_number = 1; !text.empty(); ++line_number) {
    std::string_view line = next_line(text);
    const auto fail = [&](const std::string& sentence) { throw InputError(name, line_number, sentence); };
    const std::string_view kind = next_word(line);
    if (kind == "v") {
      Vec3 at;
      for (float& x : at) {
        const std::string_view word = next_word(line);
        const auto value = number_of<float>(word);
        if (!value) fail(fmt::format("'{}' is no coordinate; mend the vertex", printable(word)));
        x = *value;
      }
      mesh.positions.push_back(micrometres(at, name, mesh.positions.size()));
    } else if (kind == "f") {
      corners.clear();
      for (std::string_view word = next_word(line); !word.empty(); word = next_word(line)) {
        const auto corner = number_of<std::int64_t>(word.substr(0, word.find('/')));
        const auto count = std::int64_t(mesh.positions.size());
        const std::int64_t index = !corner ? -1 : *corner < 0 ? count + *corner : *corner - 1;
        if (index < 0 || index >= count)
          fail(fmt::format("a face names vertex '{}' of {}; get the whole file", printable(word), count));
        corners.push_back(std::uint32_t(index));
      }
      if (corners.size() < 3) fail("a face has fewer than three corners; mend it");
      add_face(mesh, corners);
    }
  }
  return mesh;
}

// Numbers one after the other, over as many lines as there are.
class Numbers {
 public:
  Numbers(std::string_view text, const std::string& name) : text_(text), name_(name) {}

  template <class Number>
  Number next(const char* of) {
    std::string_view word;
    while ((word = next_word(line_)).empty()) {
      if (text_.empty())
        throw InputError(name_, line_number_, fmt::format("ends within its {}; get the whole file", of));
      line_ = next_line(text_), ++line_number_;
    }
    const auto value = number_of<Number>(word);
    if (!value)
      throw InputError(name_, line_number_,
                       fmt::format("'{}' is no number of its {}; get the file again", printable(word), of));
    return *value;
  }
  std::uint32_t count(const char* of) {
    const auto value = next<std::uint32_t>(of);
    if (value > text_.size() + line_.size())  // each takes a sign at least
      throw InputError(
          name_, line_number_,
          fmt::format("says that it has {} {} and is too short for them; get the whole file", value, of));
    return value;
  }

 private:
  std::string_view text_, line_;
  const std::string& name_;
  std::size_t line_number_ = 0;
};

Mesh read_mni(std::string_view text, const std::string& name) {
  text = first_words(text).substr(1);
  Numbers numbers(text, name);
  for (int i = 0; i < 5; ++i) numbers.next<float>("surface properties");
  const std::uint32_t vertices = numbers.count("points");
  Mesh mesh;
  mesh.positions.reserve(vertices);
  for (std::uint32_t i = 0; i < vertices; ++i) {
    Vec3 at;
    for (float& x : at) x = numbers.next<float>("points");
    mesh.positions.push_back(micrometres(at, name, i));
  }
  for (std::uint64_t i = 0; i < 3 * std::uint64_t(vertices); ++i) numbers.next<float>("normals");
  const std::uint32_t faces = numbers.count("faces");
  const auto colouring = numbers.next<std::uint32_t>("colours");
  const std::uint64_t colours = colouring == 0 ? 1 : colouring == 1 ? faces : vertices;
  for (std::uint64_t i = 0; i < 4 * colours; ++i) numbers.next<float>("colours");
  std::vector<std::uint32_t> ends(faces), corners;
  for (std::uint32_t& end : ends) end = numbers.next<std::uint32_t>("ends of faces");
  std::uint32_t begin = 0;
  for (std::uint32_t i = 0; i < faces; begin = ends[i], ++i) {
    if (ends[i] < begin + 3 || ends[i] - begin > vertices)
      throw InputError(name, 0, fmt::format("face {} has fewer than three corners; get the file again", i));
    corners.clear();
    for (std::uint32_t k = begin; k < ends[i]; ++k) corners.push_back(numbers.next<std::uint32_t>("corners"));
    add_face(mesh, corners);
  }
  check_corners(mesh, name);
  return mesh;
}

}  // namespace

bool is_obj(std::string_view bytes) {
  std::string_view words = first_words(bytes);
  words = words.substr(0, words.find('\n'));
  const std::string_view first = next_word(words);
  if (first == "v" || first == "P") return number_of<float>(next_word(words)).has_value();
  return first == "mtllib" || first == "o" || first == "g";
}

Mesh read_obj_surface(std::string_view text, const std::string& name) {
  Mesh mesh = first_words(text).starts_with('P') ? read_mni(text, name) : read_wavefront(text, name);
  mesh.labels.assign(mesh.positions.size(), 0);
  if (mesh.triangles.empty()) throw InputError(name, 0, "has no triangle; give a surface that is not empty");
  return welded_if_open(std::move(mesh));
}

}  // namespace forest::io
