// SPDX-License-Identifier: Apache-2.0
// What is written is read back here by readers of a few lines, which know nothing of the writers.
#include "forest/io/model.h"

#include <algorithm>
#include <cstring>
#include <iterator>
#include <limits>
#include <map>
#include <set>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"

#include "tests/zoo.h"

namespace forest::io {
namespace {

template <class T>
T at(std::string_view bytes, std::size_t offset) {
  T value;
  EXPECT_LE(offset + sizeof value, bytes.size());
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

Model model_of(const Morphology& m, Geometry geometry) {
  std::vector<Warning> losses;
  return make_model(m, "a \"cell\" <&>", {.geometry = geometry, .sides = 6, .detail = 0.f}, losses);
}

std::string written(std::string_view format, const Model& model) {
  return find_model_format(format)->write(model);
}

/// Every model of the zoo as lines and as tubes.
template <class Check>
void for_models(Check&& check) {
  for (const Specimen& specimen : zoo())
    for (const Geometry geometry : {Geometry::stick, Geometry::cylinder}) {
      SCOPED_TRACE(specimen.name + (geometry == Geometry::stick ? " as sticks" : " as tubes"));
      check(model_of(specimen.morphology, geometry));
    }
}

std::size_t edges_of(const Lines& lines) { return lines.positions.size() - lines.starts.size(); }

TEST(Model, TheTableIsSound) {
  std::set<std::string_view> seen;
  for (const ModelFormat& format : model_formats()) {
    EXPECT_TRUE(seen.insert(format.name).second);
    for (const std::string_view extension : format.extensions) EXPECT_TRUE(seen.insert(extension).second);
    EXPECT_EQ(model_format_of("A/b" + std::string(format.extensions[0])), &format);
  }
  EXPECT_EQ(model_format_of("a.swc"), nullptr);
  EXPECT_EQ(find_model_format("swc"), nullptr);
  EXPECT_NE(model_format_of("A.GLB"), nullptr);
}

TEST(Model, SticksAreRefusedWhereThereAreOnlyTriangles) {
  EXPECT_THROW(check(*find_model_format("stl"), Geometry::stick), Error);
  check(*find_model_format("stl"), Geometry::surface);
  check(*find_model_format("ply"), Geometry::stick);
}

TEST(Model, StlHoldsEveryTriangleWithItsNormal) {
  const Model model = model_of(zoo_parts::binary_tree(2), Geometry::cylinder);
  const std::string bytes = written("stl", model);
  EXPECT_FALSE(bytes.starts_with("solid"));
  ASSERT_EQ(at<std::uint32_t>(bytes, 80), model.mesh.triangles.size());
  ASSERT_EQ(bytes.size(), 84 + 50 * model.mesh.triangles.size());
  for (std::size_t t = 0; t < model.mesh.triangles.size(); ++t)
    for (std::size_t i = 0; i < 9; ++i)
      EXPECT_EQ(at<float>(bytes, 84 + 50 * t + 12 + 4 * i),
                model.mesh.positions[model.mesh.triangles[t][i / 3]][Eigen::Index(i % 3)]);
}

TEST(Model, PlyIsAsLongAsItsHeaderSays) {
  for_models([](const Model& model) {
    const std::string bytes = written("ply", model);
    const std::size_t begin = bytes.find("end_header\n") + 11;
    std::istringstream header(bytes.substr(0, begin));
    std::size_t vertices = 0, faces = 0, edges = 0, vertex_size = 0;
    std::string word, element;
    for (std::string line; std::getline(header, line);) {
      std::istringstream words(line);
      words >> word;
      if (word == "element") {
        words >> element;
        words >> (element == "vertex" ? vertices : element == "face" ? faces : edges);
      } else if (word == "property" && element == "vertex") {
        words >> word;
        vertex_size += word == "float" ? 4 : 1;
      }
    }
    EXPECT_EQ(vertices, model.lines.positions.size() + model.mesh.positions.size());
    EXPECT_EQ(faces, model.mesh.triangles.size());
    EXPECT_EQ(edges, edges_of(model.lines));
    EXPECT_EQ(bytes.size(), begin + vertex_size * vertices + 13 * faces + 8 * edges);
    for (std::size_t i = 0; i < faces; ++i) {
      const std::size_t face = begin + vertex_size * vertices + 13 * i;
      EXPECT_EQ(bytes[face], 3);
      EXPECT_LT(at<std::uint32_t>(bytes, face + 1), vertices);
    }
  });
}

TEST(Model, ObjCountsFromOneAndGroupsByKind) {
  for_models([](const Model& model) {
    std::istringstream text(written("obj", model));
    std::size_t vertices = 0, faces = 0, edges = 0;
    std::set<std::string> groups;
    for (std::string line, word; std::getline(text, line);) {
      std::istringstream words(line);
      words >> word;
      std::vector<std::size_t> indices;
      if (word == "v") {
        std::vector<float> numbers(std::istream_iterator<float>(words), {});
        EXPECT_EQ(numbers.size(), 6u);
        ++vertices;
      } else if (word == "g") {
        words >> word;
        EXPECT_TRUE(groups.insert(word).second);
      } else if (word == "f" || word == "l") {
        indices.assign(std::istream_iterator<std::size_t>(words), {});
        for (const std::size_t index : indices) EXPECT_TRUE(index >= 1 && index <= vertices);
        (word == "f" ? faces : edges) += word == "f" ? 1 : indices.size() - 1;
      }
    }
    EXPECT_EQ(vertices, model.lines.positions.size() + model.mesh.positions.size());
    EXPECT_EQ(faces, model.mesh.triangles.size());
    EXPECT_EQ(edges, edges_of(model.lines));
  });
}

TEST(Model, GltfAccessorsLieWithinTheirViewsAndTellTheirBounds) {
  for_models([](const Model& model) {
    const std::string bytes = written("gltf", model);
    ASSERT_EQ(bytes.substr(0, 4), "glTF");
    EXPECT_EQ(at<std::uint32_t>(bytes, 4), 2u);
    ASSERT_EQ(at<std::uint32_t>(bytes, 8), bytes.size());
    const std::size_t json_size = at<std::uint32_t>(bytes, 12);
    EXPECT_EQ(json_size % 4, 0u);
    const auto json = nlohmann::json::parse(bytes.substr(20, json_size));
    EXPECT_EQ(json["asset"]["version"], "2.0");
    EXPECT_EQ(json["nodes"][0]["scale"][0], 1e-6);
    if (!json.contains("meshes")) {
      EXPECT_TRUE(model.lines.positions.empty() && model.mesh.positions.empty());
      return;
    }
    const std::size_t data = 20 + json_size + 8, data_size = at<std::uint32_t>(bytes, data - 8);
    EXPECT_EQ(bytes.substr(data - 4, 4), std::string("BIN\0", 4));
    EXPECT_EQ(data + data_size, bytes.size());
    EXPECT_EQ(json["buffers"][0]["byteLength"], data_size);
    const std::map<int, std::size_t> sizes{{5123, 2}, {5125, 4}, {5126, 4}};
    const std::map<std::string, std::size_t> parts{{"SCALAR", 1}, {"VEC3", 3}, {"VEC4", 4}};
    for (const auto& accessor : json["accessors"]) {
      const auto& view = json["bufferViews"][accessor["bufferView"].get<std::size_t>()];
      EXPECT_EQ(accessor["count"].get<std::size_t>() * sizes.at(accessor["componentType"]) *
                    parts.at(accessor["type"]),
                view["byteLength"].get<std::size_t>());
      EXPECT_EQ(view["byteOffset"].get<std::size_t>() % 4, 0u);
      EXPECT_LE(view["byteOffset"].get<std::size_t>() + view["byteLength"].get<std::size_t>(), data_size);
    }
    const auto& primitive = json["meshes"][0]["primitives"][0];
    const auto& places = json["accessors"][primitive["attributes"]["POSITION"].get<std::size_t>()];
    const std::size_t count = places["count"];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      float low = std::numeric_limits<float>::infinity(), high = -low;
      for (std::size_t i = 0; i < count; ++i) {
        const float x = at<float>(bytes, data + 12 * i + 4 * axis);
        low = std::min(low, x), high = std::max(high, x);
      }
      EXPECT_EQ(places["min"][axis].get<float>(), low);
      EXPECT_EQ(places["max"][axis].get<float>(), high);
    }
    const auto& indices = json["accessors"][primitive["indices"].get<std::size_t>()];
    const std::size_t begin = json["bufferViews"][indices["bufferView"].get<std::size_t>()]["byteOffset"];
    EXPECT_EQ(indices["count"], model.mesh.triangles.size() * 3 + edges_of(model.lines) * 2);
    for (std::size_t i = 0; i < indices["count"].get<std::size_t>(); ++i)
      EXPECT_LT(at<std::uint32_t>(bytes, data + begin + 4 * i), count);
  });
}

TEST(Model, GltfOfNothingToDrawHasNoEmptyAccessor) {
  MorphologyBuilder b;
  b.add_section({}, SectionKind::axon, std::vector<Point>{{1, 2, 3, 1}});
  std::vector<Warning> lost;
  const Model model = make_model(b.build(), "stump", {.geometry = Geometry::stick}, lost);
  const std::string bytes = find_model_format("gltf")->write(model);
  EXPECT_EQ(bytes.find("\"count\":0"), bytes.npos);
  EXPECT_EQ(bytes.find("\"byteLength\":0"), bytes.npos);
}

TEST(Model, VrmlBracesBalanceAndEveryFaceHasItsColour) {
  for_models([](const Model& model) {
    const std::string text = written("vrml", model);
    EXPECT_TRUE(text.starts_with("#VRML V2.0 utf8\n"));
    EXPECT_EQ(std::ranges::count(text, '{'), std::ranges::count(text, '}'));
    EXPECT_EQ(std::ranges::count(text, '['), std::ranges::count(text, ']'));
    const auto list = [&](std::string_view name) {
      const std::size_t begin = text.find(std::string(name) + " [") + name.size() + 2;
      std::istringstream words(text.substr(begin, text.find(']', begin) - begin));
      return std::vector<long>(std::istream_iterator<long>(words), {});
    };
    const auto indices = list("coordIndex");
    const std::size_t shapes = model.mesh.triangles.size() + model.lines.starts.size();
    EXPECT_EQ(std::size_t(std::ranges::count(indices, -1)), shapes);
    EXPECT_EQ(list("colorIndex").size(), shapes);
    EXPECT_EQ(indices.size(),
              4 * model.mesh.triangles.size() + model.lines.positions.size() + model.lines.starts.size());
  });
}

TEST(Model, X3dTellsItsUnitAndEscapesTheName) {
  const std::string text = written("x3d", model_of(zoo_parts::binary_tree(2), Geometry::stick));
  EXPECT_THAT(text, testing::HasSubstr("a &quot;cell&quot; &lt;&amp;>"));
  EXPECT_THAT(text, testing::HasSubstr("conversionFactor=\"0.000001\""));
}

TEST(Model, WhatIsNotShownIsTold) {
  MorphologyBuilder b;
  b.add_section({}, SectionKind::axon, std::vector<Point>{{0, 0, 0, 0}, {0, 10, 0, 1}});
  b.add_spine({.section = SectionId(0), .position = 1.f});
  std::vector<Warning> losses;
  make_model(b.build(), "cell", {}, losses);
  ASSERT_EQ(losses.size(), 2u);
  EXPECT_EQ(losses[0].code, "thickened");
  EXPECT_EQ(losses[1].code, "spines");
}

}  // namespace
}  // namespace forest::io
