// SPDX-License-Identifier: Apache-2.0
#include "forest/io/gifti.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <optional>
#include <pugixml.hpp>
#include <span>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/number.h"
#include "forest/io/inflate.h"
#include "forest/io/plain_text.h"

namespace forest::io {
namespace {

constexpr std::string_view points_intent = "NIFTI_INTENT_POINTSET",
                           triangles_intent = "NIFTI_INTENT_TRIANGLE";

template <class T>
double number_at(const char* at) {
  T value{};
  std::memcpy(&value, at, sizeof value);
  return double(value);
}
struct TypeRow {
  std::string_view name;
  std::size_t size;
  double (*number)(const char* at);
};
template <class T>
constexpr TypeRow row(std::string_view name) {
  return {name, sizeof(T), number_at<T>};
}
// The standard's three, and what programs write besides.
constexpr std::array types{row<std::uint8_t>("NIFTI_TYPE_UINT8"),   row<std::int32_t>("NIFTI_TYPE_INT32"),
                           row<std::uint32_t>("NIFTI_TYPE_UINT32"), row<std::int64_t>("NIFTI_TYPE_INT64"),
                           row<float>("NIFTI_TYPE_FLOAT32"),        row<double>("NIFTI_TYPE_FLOAT64")};

// Rows of numbers. All of them fit a double, but for whole ones above 2⁵³, which are none of a vertex.
struct Array {
  std::string_view intent;
  std::size_t rows = 0, columns = 1;
  std::vector<double> numbers;  // row by row
  std::string name = {};        // what its metadata call it
};

constexpr auto whole = number_of<std::uint64_t>;

bool blank(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

// White space is skipped; none when there is a sign that does not belong there.
std::optional<std::string> base64(std::string_view text) {
  static constexpr auto values = [] {
    std::array<std::int8_t, 256> table{};
    table.fill(-1);
    for (int i = 0; i < 64; ++i)
      table[std::size_t("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/"[i])] =
          std::int8_t(i);
    return table;
  }();
  std::string bytes;
  bytes.reserve(text.size() / 4 * 3 + 3);
  std::uint32_t bits = 0, count = 0;
  bool ended = false;
  for (const char c : text) {
    if (blank(c)) continue;
    if (c == '=') {
      ended = true;
      continue;
    }
    const std::int8_t value = values[static_cast<unsigned char>(c)];
    if (value < 0 || ended) return {};
    bits = bits << 6 | std::uint32_t(value);
    if (++count % 4 != 1) bytes += char(bits >> (2 * (3 - (count - 1) % 4)) & 255);
  }
  return bytes;
}

class Reader {
 public:
  Reader(std::string_view bytes, const std::string& name) : name_(name) {
    const std::string_view text = plain_text(bytes, name).text;
    const auto parsed =
        document_.load_buffer(text.data(), text.size(), pugi::parse_default, pugi::encoding_utf8);
    if (!parsed) {
      const auto at = std::clamp<std::ptrdiff_t>(parsed.offset, 0, std::ptrdiff_t(text.size()));
      throw InputError(name_, 1 + std::size_t(std::count(text.begin(), text.begin() + at, '\n')),
                       fmt::format("the XML is broken ({}); get the whole file", parsed.description()));
    }
    root_ = document_.document_element();
    if (std::string_view(root_.name()) != "GIFTI")
      throw InputError(name_, 0, "has no <GIFTI> element; give a GIFTI file");
  }

  // The first array that `wanted` takes; none when there is none.
  std::optional<Array> find(auto&& wanted) const {
    for (const pugi::xml_node& element : root_.children("DataArray")) {
      const std::string_view intent = element.attribute("Intent").value();
      if (wanted(intent)) return read(element, intent);
    }
    return {};
  }

  // What the metadata of the points, or else of the file, call something; empty when they do not.
  std::string about(std::string_view what) const {
    std::string found = about(root_, what);
    for (const pugi::xml_node& element : root_.children("DataArray"))
      if (std::string_view(element.attribute("Intent").value()) == points_intent)
        if (std::string own = about(element, what); !own.empty()) found = std::move(own);
    return found;
  }

  std::vector<SurfaceLabel> labels() const {
    std::vector<SurfaceLabel> result;
    for (const pugi::xml_node& label : root_.child("LabelTable").children("Label")) {
      const auto share = [&](const char* of, float otherwise) {
        const auto value = number_of<float>(label.attribute(of).value());
        return value && std::isfinite(*value) ? std::clamp(*value, 0.f, 1.f) : otherwise;
      };
      const pugi::xml_attribute key =
          label.attribute("Key") ? label.attribute("Key") : label.attribute("Index");
      result.push_back({key.as_int(),
                        label.child_value(),
                        {share("Red", .7f), share("Green", .7f), share("Blue", .7f)},
                        share("Alpha", 1.f)});
    }
    return result;
  }

 private:
  Array read(const pugi::xml_node& element, std::string_view intent) const {
    Array array{.intent = intent, .numbers = {}};
    const std::string_view type_name = element.attribute("DataType").value();
    const auto type = std::ranges::find(types, type_name, &TypeRow::name);
    if (type == types.end())
      fail(intent, fmt::format("has the type '{}', which is not read; write it as {}", printable(type_name),
                               intent == triangles_intent ? "NIFTI_TYPE_INT32" : "NIFTI_TYPE_FLOAT32"));
    const std::uint64_t dimensions = whole(element.attribute("Dimensionality").value()).value_or(1);
    std::uint64_t count = 1;
    for (std::uint64_t i = 0; i < std::min<std::uint64_t>(dimensions, 6); ++i) {
      const auto size = whole(element.attribute(fmt::format("Dim{}", i).c_str()).value());
      if (!size || *size > (1u << 28)) fail(intent, fmt::format("does not say how large it is (Dim{})", i));
      if (i == 0)
        array.rows = *size;
      else
        array.columns *= *size;
      count *= *size;
      if (count > (1u << 28))
        fail(intent, "says that it has more than 268,435,456 numbers; get the file again");
    }
    if (dimensions == 0) fail(intent, "has no dimension; get the file again");
    const pugi::xml_node data = element.child("Data");
    const std::string_view text = data.child_value();
    const std::string_view encoding = element.attribute("Encoding").value();
    if (encoding == "ASCII") {
      array.numbers = numbers_of(text, count, intent);
    } else if (encoding == "Base64Binary" || encoding == "GZipBase64Binary") {
      auto bytes = base64(text);
      if (!bytes) fail(intent, "holds something that is no base64; get the file again");
      if (encoding[0] == 'G') bytes = inflated(*bytes, count * type->size, name_);
      if (bytes->size() != count * type->size)
        fail(intent, fmt::format("should have {} bytes and has {}; get the whole file", count * type->size,
                                 bytes->size()));
      const bool swapped = (std::string_view(element.attribute("Endian").value()) == "BigEndian") !=
                           (std::endian::native == std::endian::big);
      array.numbers = numbers_of(*bytes, *type, count, swapped);
    } else if (encoding == "ExternalFileBinary") {
      fail(intent,
           "keeps its numbers in another file; bring both together by 'wb_command -gifti-convert "
           "GZIP_BASE64_BINARY IN OUT'");
    } else {
      fail(intent, fmt::format("has the encoding '{}', which is not known; write it as GZipBase64Binary",
                               printable(encoding)));
    }
    if (std::string_view(element.attribute("ArrayIndexingOrder").value()) == "ColumnMajorOrder" &&
        array.columns > 1) {
      std::vector<double> rows(array.numbers.size());
      for (std::size_t r = 0; r < array.rows; ++r)
        for (std::size_t c = 0; c < array.columns; ++c)
          rows[r * array.columns + c] = array.numbers[c * array.rows + r];
      array.numbers = std::move(rows);
    }
    array.name = about(element, "Name");
    return array;
  }

  static std::string about(const pugi::xml_node& of, std::string_view what) {
    for (const pugi::xml_node& pair : of.child("MetaData").children("MD"))
      if (std::string_view(pair.child_value("Name")) == what) return pair.child_value("Value");
    return {};
  }

  std::vector<double> numbers_of(std::string_view text, std::uint64_t count, std::string_view intent) const {
    std::vector<double> numbers;
    numbers.reserve(std::min<std::uint64_t>(count, text.size() / 2 + 1));
    for (std::size_t at = 0; at < text.size();) {
      while (at < text.size() && blank(text[at])) ++at;
      const std::size_t begin = at;
      while (at < text.size() && !blank(text[at])) ++at;
      if (at == begin) break;
      const std::string_view word = text.substr(begin, at - begin);
      const auto number = number_of<double>(word);  // NaN and infinities, too
      if (!number) fail(intent, fmt::format("'{}' is no number", printable(word)));
      numbers.push_back(*number);
      if (numbers.size() > count) break;
    }
    if (numbers.size() != count)
      fail(intent, fmt::format("should have {} numbers and has {}{}; get the whole file", count,
                               numbers.size() > count ? "more than " : "",
                               std::min<std::size_t>(numbers.size(), count)));
    return numbers;
  }

  static std::vector<double> numbers_of(std::string& bytes, const TypeRow& type, std::uint64_t count,
                                        bool swapped) {
    std::vector<double> numbers(count);
    for (std::size_t i = 0; i < count; ++i) {
      char* at = bytes.data() + i * type.size;
      if (swapped) std::reverse(at, at + type.size);
      numbers[i] = type.number(at);
    }
    return numbers;
  }

  [[noreturn]] void fail(std::string_view intent, const std::string& sentence) const {
    throw InputError(name_, 0, fmt::format("the array {} {}", printable(intent), sentence));
  }

  const std::string& name_;
  pugi::xml_document document_;
  pugi::xml_node root_;
};

}  // namespace

Mesh read_gifti_surface(std::string_view text, const std::string& name) {
  const Reader reader(text, name);
  const auto points = reader.find([](std::string_view intent) { return intent == points_intent; });
  const auto triangles = reader.find([](std::string_view intent) { return intent == triangles_intent; });
  if (!points || !triangles)
    throw InputError(name, 0,
                     fmt::format("has no array {}; give a surface (.surf.gii), and values with --overlay",
                                 points ? triangles_intent : points_intent));
  for (const Array& array : {std::cref(*points), std::cref(*triangles)})
    if (array.columns != 3)
      throw InputError(
          name, 0,
          fmt::format("the array {} should have rows of 3 numbers and has {}; get the file again",
                      array.intent, array.columns));
  Mesh mesh;
  mesh.positions.reserve(points->rows), mesh.triangles.reserve(triangles->rows);
  for (std::size_t i = 0; i < points->rows; ++i)
    mesh.positions.push_back(
        micrometres(Eigen::Vector3d::Map(&points->numbers[3 * i]).cast<float>(), name, i));
  mesh.labels.assign(points->rows, 0);
  for (std::size_t i = 0; i < triangles->rows; ++i) {
    Triangle& corners = mesh.triangles.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) {
      const double corner = triangles->numbers[3 * i + k];
      if (!(corner >= 0. && corner < double(points->rows)) || corner != std::floor(corner))
        throw InputError(
            name, 0,
            fmt::format("triangle {} names vertex {} of {}; get the whole file", i, corner, points->rows));
      corners[k] = std::uint32_t(corner);
    }
  }
  if (mesh.triangles.empty()) throw InputError(name, 0, "has no triangle; give a surface that is not empty");
  return mesh;
}

std::string gifti_structure(std::string_view text, const std::string& name) {
  std::string structure;
  for (const char c : Reader(text, name).about("AnatomicalStructurePrimary")) {  // CortexLeft
    const bool large = c >= 'A' && c <= 'Z';
    if (large && !structure.empty()) structure += '_';
    structure += c >= 'a' && c <= 'z' ? char(c - 'a' + 'A') : c;
  }
  return structure;
}

SurfaceValues read_gifti_values(std::string_view text, const std::string& name) {
  const Reader reader(text, name);
  const auto array = reader.find(
      [](std::string_view intent) { return intent != points_intent && intent != triangles_intent; });
  if (!array)
    throw InputError(name, 0, "has no values; give a file such as .shape.gii, .func.gii or .label.gii");
  if (array->columns != 1)
    throw InputError(name, 0,
                     fmt::format("has {} values a vertex and one is shown; split it by 'wb_command "
                                 "-metric-merge OUT -metric IN -column 1'",
                                 array->columns));
  SurfaceValues result;
  result.values.assign(array->numbers.begin(), array->numbers.end());
  result.title = array->name;
  if (array->intent == "NIFTI_INTENT_LABEL") result.labels = reader.labels();
  return result;
}

std::string write_gifti_surface(const Mesh& mesh) {
  const auto coded = [](std::string_view bytes) {
    constexpr const char* signs = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    text.reserve(bytes.size() / 3 * 4 + 4);
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
      std::uint32_t bits = 0;
      for (std::size_t k = 0; k < 3; ++k)
        bits = bits << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
      for (std::size_t k = 0; k < 4; ++k)
        text += i + k <= bytes.size() ? signs[bits >> (18 - 6 * k) & 63] : '=';
    }
    return text;
  };
  std::string points, corners;
  const auto append = [](std::string& bytes, auto value) {
    std::array<char, sizeof value> raw;
    std::memcpy(raw.data(), &value, sizeof value);
    if (std::endian::native == std::endian::big) std::ranges::reverse(raw);
    bytes.append(raw.data(), raw.size());
  };
  for (const Vec3& p : mesh.positions)
    for (int k = 0; k < 3; ++k) append(points, p[k] / 1000.f);
  for (const Triangle& t : mesh.triangles)
    for (const std::uint32_t corner : t) append(corners, std::int32_t(corner));
  const auto array = [&](std::string_view intent, std::string_view type, std::size_t rows,
                         const std::string& bytes) {
    return fmt::format(
        "<DataArray Intent=\"{}\" DataType=\"{}\" ArrayIndexingOrder=\"RowMajorOrder\" Dimensionality=\"2\" "
        "Dim0=\"{}\" Dim1=\"3\" Encoding=\"Base64Binary\" Endian=\"LittleEndian\" ExternalFileName=\"\" "
        "ExternalFileOffset=\"\">\n<Data>{}</Data>\n</DataArray>\n",
        intent, type, rows, coded(bytes));
  };
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<GIFTI Version=\"1.0\" NumberOfDataArrays=\"2\">\n" +
         array(points_intent, "NIFTI_TYPE_FLOAT32", mesh.positions.size(), points) +
         array(triangles_intent, "NIFTI_TYPE_INT32", mesh.triangles.size(), corners) + "</GIFTI>\n";
}

}  // namespace forest::io
