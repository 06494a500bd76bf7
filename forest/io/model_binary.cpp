// SPDX-License-Identifier: Apache-2.0
// Models as binary files, all little-endian: glTF 2.0 (Khronos 2017–2021, ISO/IEC 12113), PLY (Turk 1994), STL (3D
// Systems 1989).
#include <bit>
#include <cmath>
#include <cstring>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/bounds.h"
#include "forest/core/error.h"
#include "forest/core/srgb.h"
#include "forest/io/model_writers.h"

namespace forest::io {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers are written as they lie in memory");

template <class T>
void put(std::string& bytes, const T& value) {
  static_assert(std::is_arithmetic_v<T>);
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

void put(std::string& bytes, const Vec3& v) {
  for (int i = 0; i < 3; ++i) put(bytes, v[i]);
}

/// The labels of all positions of the lines, in order.
std::vector<std::uint8_t> labels_of(const Lines& lines) {
  std::vector<std::uint8_t> labels;
  labels.reserve(lines.positions.size());
  for (std::size_t i = 0; i < lines.starts.size(); ++i)
    labels.insert(labels.end(), lines.line(i).size(), lines.labels[i]);
  return labels;
}

std::vector<std::array<std::uint32_t, 2>> edges_of(const Lines& lines) {
  std::vector<std::array<std::uint32_t, 2>> edges;
  edges.reserve(lines.positions.size());
  for (std::size_t i = 0; i < lines.starts.size(); ++i)
    for (std::uint32_t k = 1; k < lines.line(i).size(); ++k)
      edges.push_back({lines.starts[i] + k - 1, lines.starts[i] + k});
  return edges;
}

/// A part of sRGB as light, in 65535ths: colours of vertices are linear in glTF.
std::uint16_t linear(std::uint8_t part) {
  return std::uint16_t(std::lround(65535. * from_srgb(double(part) / 255.)));
}

}  // namespace

std::string write_gltf(const Model& model) {
  using Json = nlohmann::ordered_json;
  constexpr int unsigned_short = 5123, unsigned_int = 5125, real = 5126, vertices = 34962, elements = 34963;
  const bool sticks = !model.lines.starts.empty();
  const auto& positions = sticks ? model.lines.positions : model.mesh.positions;
  const auto labels = sticks ? labels_of(model.lines) : model.mesh.labels;

  Json json{{"asset", {{"version", "2.0"}, {"generator", "Brain Forest"}}}, {"scene", 0}};
  // One unit of glTF is a metre.
  Json node{{"name", model.name}, {"scale", {1e-6, 1e-6, 1e-6}}};
  std::string data;
  const auto accessor = [&](Json about, std::size_t begin, int target) {
    json["bufferViews"].push_back(
        {{"buffer", 0}, {"byteOffset", begin}, {"byteLength", data.size() - begin}, {"target", target}});
    about["bufferView"] = json["bufferViews"].size() - 1;
    json["accessors"].push_back(std::move(about));
    return json["accessors"].size() - 1;
  };
  if (sticks ? !edges_of(model.lines).empty() : !model.mesh.triangles.empty()) {  // accessors are never empty
    node["mesh"] = 0;
    Bounds box;
    std::size_t begin = data.size();
    for (const Vec3& p : positions) put(data, p), box.add(p);
    Json attributes;
    attributes["POSITION"] = accessor({{"componentType", real},
                                       {"count", positions.size()},
                                       {"type", "VEC3"},
                                       {"min", {box.low.x(), box.low.y(), box.low.z()}},
                                       {"max", {box.high.x(), box.high.y(), box.high.z()}}},
                                      begin, vertices);
    if (!sticks) {
      begin = data.size();
      for (const Vec3& n : vertex_normals(model.mesh)) put(data, n);
      attributes["NORMAL"] =
          accessor({{"componentType", real}, {"count", positions.size()}, {"type", "VEC3"}}, begin, vertices);
    }
    begin = data.size();
    for (const std::uint8_t label : labels) {
      for (const std::uint8_t part : model_colour(label)) put(data, linear(part));
      put(data, std::uint16_t(65535));
    }
    attributes["COLOR_0"] = accessor({{"componentType", unsigned_short},
                                      {"normalized", true},
                                      {"count", positions.size()},
                                      {"type", "VEC4"}},
                                     begin, vertices);
    begin = data.size();
    if (sticks)
      for (const auto& edge : edges_of(model.lines)) put(data, edge[0]), put(data, edge[1]);
    else
      for (const Triangle& t : model.mesh.triangles)
        for (const std::uint32_t v : t) put(data, v);
    const auto indices =
        accessor({{"componentType", unsigned_int}, {"count", (data.size() - begin) / 4}, {"type", "SCALAR"}},
                 begin, elements);
    constexpr int as_lines = 1, as_triangles = 4;
    json["materials"] = Json::array(
        {{{"name", "neurite"}, {"pbrMetallicRoughness", {{"metallicFactor", 0}, {"roughnessFactor", .6}}}}});
    json["meshes"] =
        Json::array({{{"name", model.name},
                      {"primitives", Json::array({{{"attributes", attributes},
                                                   {"indices", indices},
                                                   {"material", 0},
                                                   {"mode", sticks ? as_lines : as_triangles}}})}}});
    json["buffers"] = Json::array({{{"byteLength", data.size()}}});
  }
  json["nodes"] = Json::array({node});
  json["scenes"] = Json::array({{{"nodes", {0}}}});

  std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  text.resize((text.size() + 3) / 4 * 4, ' ');
  const std::size_t size = 12 + 8 + text.size() + (data.empty() ? 0 : 8 + data.size());
  if (size > 0xffffffffu)
    throw LimitError("a glTF file holds at most 4 GiB; choose a coarser detail or fewer sides");
  std::string bytes = "glTF";
  bytes.reserve(size);
  put(bytes, std::uint32_t(2)), put(bytes, std::uint32_t(size));
  put(bytes, std::uint32_t(text.size()));
  bytes += "JSON" + text;
  if (!data.empty()) {  // its length is a multiple of 4
    put(bytes, std::uint32_t(data.size()));
    bytes.append("BIN\0", 4);
    bytes += data;
  }
  return bytes;
}

std::string write_ply(const Model& model) {
  const bool sticks = !model.lines.starts.empty();
  const auto& positions = sticks ? model.lines.positions : model.mesh.positions;
  const auto labels = sticks ? labels_of(model.lines) : model.mesh.labels;
  const auto edges = edges_of(model.lines);
  const auto normals = vertex_normals(model.mesh);
  std::string bytes = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment made by Brain Forest, unit micrometre\nelement vertex "
      "{}\n"
      "property float x\nproperty float y\nproperty float z\n{}"
      "property uchar red\nproperty uchar green\nproperty uchar blue\n",
      positions.size(), sticks ? "" : "property float nx\nproperty float ny\nproperty float nz\n");
  bytes += sticks ? fmt::format("element edge {}\nproperty int vertex1\nproperty int vertex2\n", edges.size())
                  : fmt::format("element face {}\nproperty list uchar int vertex_indices\n",
                                model.mesh.triangles.size());
  bytes += "end_header\n";
  for (std::size_t i = 0; i < positions.size(); ++i) {
    put(bytes, positions[i]);
    if (!sticks) put(bytes, normals[i]);
    for (const std::uint8_t part : model_colour(labels[i])) put(bytes, part);
  }
  for (const auto& edge : edges) put(bytes, edge[0]), put(bytes, edge[1]);
  for (const Triangle& t : model.mesh.triangles) {
    put(bytes, std::uint8_t(3));
    for (const std::uint32_t v : t) put(bytes, v);
  }
  return bytes;
}

std::string write_stl(const Model& model) {
  std::string bytes =
      "Brain Forest, unit micrometre";  // must not begin with "solid", the mark of STL as text
  bytes.resize(80, ' ');
  put(bytes, std::uint32_t(model.mesh.triangles.size()));
  bytes.reserve(84 + 50 * model.mesh.triangles.size());
  for (const Triangle& t : model.mesh.triangles) {
    const std::array<Vec3, 3> p{model.mesh.positions[t[0]], model.mesh.positions[t[1]],
                                model.mesh.positions[t[2]]};
    put(bytes, Vec3((p[1] - p[0]).cross(p[2] - p[0]).stableNormalized()));
    for (const Vec3& v : p) put(bytes, v);
    put(bytes, std::uint16_t(0));
  }
  return bytes;
}

}  // namespace forest::io
