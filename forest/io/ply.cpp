// SPDX-License-Identifier: Apache-2.0
#include "forest/io/ply.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
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

enum class Order : std::uint8_t { text, little, big };

struct Type {
  std::string_view name, other_name;
  std::size_t size;
  double (*value)(std::uint64_t bits);
};
template <class T, class Bits>
double as(std::uint64_t bits) {
  return double(std::bit_cast<T>(Bits(bits)));
}
constexpr std::array types{Type{"char", "int8", 1, as<std::int8_t, std::uint8_t>},
                           Type{"uchar", "uint8", 1, as<std::uint8_t, std::uint8_t>},
                           Type{"short", "int16", 2, as<std::int16_t, std::uint16_t>},
                           Type{"ushort", "uint16", 2, as<std::uint16_t, std::uint16_t>},
                           Type{"int", "int32", 4, as<std::int32_t, std::uint32_t>},
                           Type{"uint", "uint32", 4, as<std::uint32_t, std::uint32_t>},
                           Type{"float", "float32", 4, as<float, std::uint32_t>},
                           Type{"double", "float64", 8, as<double, std::uint64_t>}};

struct Property {
  std::string_view name;
  const Type* type = nullptr;
  const Type* count = nullptr;  // of a list: the type of its length
};
struct Element {
  std::string_view name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

struct Header {
  Order order = Order::text;
  std::vector<Element> elements;
  std::size_t lines = 0;
};

// The header, which the bytes lose.
Header read_header(std::string_view& bytes, const std::string& name) {
  Header header;
  bool format = false;
  while (!bytes.empty()) {
    std::string_view line = next_line(bytes);
    ++header.lines;
    const auto fail = [&](const std::string& sentence) { throw InputError(name, header.lines, sentence); };
    const std::string_view word = next_word(line);
    const auto type_of = [&](std::string_view text) {
      for (const Type& type : types)
        if (text == type.name || text == type.other_name) return &type;
      fail(fmt::format("'{}' is no type of PLY; get the file again", printable(text)));
      return &types[0];
    };
    if (word == "end_header") {
      if (!format) fail("does not say how its values are stored; add a line 'format ascii 1.0'");
      return header;
    }
    if (word == "format") {
      const std::string_view how = next_word(line);
      if (how != "ascii" && how != "binary_little_endian" && how != "binary_big_endian")
        fail(fmt::format("its format '{}' is not known; write it as ascii", printable(how)));
      header.order = how == "ascii" ? Order::text : how == "binary_big_endian" ? Order::big : Order::little;
      format = true;
    } else if (word == "element") {
      Element element;
      element.name = next_word(line);
      const auto count = number_of<std::uint64_t>(next_word(line));
      if (!count) fail("an element has no number of how many there are; get the file again");
      element.count = *count;
      header.elements.push_back(element);
    } else if (word == "property") {
      if (header.elements.empty()) fail("a property stands before all elements; get the file again");
      Property property;
      std::string_view type = next_word(line);
      if (type == "list") property.count = type_of(next_word(line)), type = next_word(line);
      property.type = type_of(type), property.name = next_word(line);
      header.elements.back().properties.push_back(property);
    }  // else: the first line, a comment, or what a program adds
  }
  throw InputError(name, header.lines, "ends within its header; get the whole file");
}

// Values one after the other.
class Values {
 public:
  Values(std::string_view bytes, Order order, std::size_t lines, const std::string& name)
      : bytes_(bytes), order_(order), line_number_(lines), name_(name) {}

  double next(const Type& type) {
    if (order_ == Order::text) {
      std::string_view word;
      while ((word = next_word(line_)).empty()) {
        if (bytes_.empty())
          throw InputError(name_, line_number_, "ends before its last value; get the whole file");
        line_ = next_line(bytes_), ++line_number_;
      }
      const auto value = number_of<double>(word);
      if (!value)
        throw InputError(name_, line_number_,
                         fmt::format("'{}' is no number; get the file again", printable(word)));
      return *value;
    }
    if (bytes_.size() < type.size)
      throw InputError(name_, 0, "ends before its last value; get the whole file");
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < type.size; ++i)
      bits = bits << 8 | static_cast<unsigned char>(bytes_[order_ == Order::big ? i : type.size - 1 - i]);
    bytes_.remove_prefix(type.size);
    return type.value(bits);
  }
  /// A length of a list, or a corner.
  std::uint32_t whole(const Type& type, const char* what) {
    const double value = next(type);
    if (!(value >= 0. && value <= double(std::numeric_limits<std::uint32_t>::max()) &&
          value == std::floor(value)))
      throw InputError(name_, order_ == Order::text ? line_number_ : 0,
                       fmt::format("has {} of {}; get the file again", what, value));
    return std::uint32_t(value);
  }
  std::size_t left() const { return bytes_.size() + line_.size(); }

 private:
  std::string_view bytes_, line_;
  Order order_;
  std::size_t line_number_;
  const std::string& name_;
};

}  // namespace

bool is_ply(std::string_view bytes) {
  return bytes.starts_with("ply") && bytes.substr(3, 32).find('\n') != bytes.npos &&
         bytes.substr(3, bytes.find('\n') - 3).find_first_not_of(between_words) == bytes.npos;
}

Mesh read_ply_surface(std::string_view bytes, const std::string& name) {
  const Header header = read_header(bytes, name);
  Values values(bytes, header.order, header.lines, name);
  Mesh mesh;
  std::vector<std::uint32_t> corners;
  for (const Element& element : header.elements) {
    const bool vertices = element.name == "vertex", faces = element.name == "face";
    if (element.properties.empty()) continue;  // it takes no room, however many there are
    if (element.count > values.left())         // each takes a sign or a byte at least
      throw InputError(
          name, 0,
          fmt::format("says that it has {} of '{}' and is too short for them; get the whole file",
                      element.count, printable(element.name)));
    std::array<bool, 3> known{};
    bool cornered = false;
    for (const Property& property : element.properties) {
      for (std::size_t a = 0; a < 3; ++a)
        known[a] = known[a] ||
                   (vertices && !property.count && property.name == std::string_view("xyz").substr(a, 1));
      cornered = cornered || (faces && property.count &&
                              (property.name == "vertex_indices" || property.name == "vertex_index"));
    }
    if (vertices && !(known[0] && known[1] && known[2]))
      throw InputError(name, 0, "has vertices without x, y or z; get the file again");
    if (faces && !cornered)
      throw InputError(name, 0, "has faces without vertex_indices; write it with faces as lists of vertices");
    for (std::uint64_t i = 0; i < element.count; ++i) {
      Vec3 at = Vec3::Zero();
      for (const Property& property : element.properties) {
        if (!property.count) {
          const double value = values.next(*property.type);
          if (vertices && property.name.size() == 1)
            if (const std::size_t axis = std::string_view("xyz").find(property.name); axis < 3)
              at[Eigen::Index(axis)] = float(value);
          continue;
        }
        const std::uint32_t length = values.whole(*property.count, "a list");
        const bool taken = faces && (property.name == "vertex_indices" || property.name == "vertex_index");
        corners.clear();
        for (std::uint32_t k = 0; k < length; ++k)
          if (taken)
            corners.push_back(values.whole(*property.type, "a corner"));
          else
            values.next(*property.type);
        if (!taken) continue;
        if (length < 3)
          throw InputError(name, 0, fmt::format("face {} has fewer than three corners; mend it", i));
        for (std::size_t k = 2; k < corners.size(); ++k)
          mesh.triangles.push_back({corners[0], corners[k - 1], corners[k]});
      }
      if (vertices) mesh.positions.push_back(micrometres(at, name, mesh.positions.size()));
    }
  }
  mesh.labels.assign(mesh.positions.size(), 0);
  if (mesh.triangles.empty()) throw InputError(name, 0, "has no triangle; give a surface that is not empty");
  check_corners(mesh, name);
  return welded_if_open(std::move(mesh));
}

}  // namespace forest::io
